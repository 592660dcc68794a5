// SPDX-License-Identifier: Apache-2.0
// The structs of the SDK as messages (layer: core, header-only). Those that contain objects are in
// proxies.h.
#pragma once

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/physics_notes.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/retimer.h>
#include <robomosp/sdk/robot_code.h>
#include <robomosp/sdk/round_outside.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/arity.h"
#include "kernel/provider_process/wire.h"

namespace robomosp::apart {

// Structs of doubles and of numbers without invalid values.
#define RMP_PLAIN(T) \
  template <>        \
  struct IsPlain<T> : std::true_type {}
RMP_PLAIN(TipWrench);
RMP_PLAIN(BaseMotion);
RMP_PLAIN(Energy);
RMP_PLAIN(IkTolerance);
RMP_PLAIN(IkGoal);
RMP_PLAIN(CurveSample);
RMP_PLAIN(LawTask);
RMP_PLAIN(LawSample);
RMP_PLAIN(OrientationSample);
RMP_PLAIN(PathSample);
RMP_PLAIN(CollisionPair);
RMP_PLAIN(PairDistance);
RMP_PLAIN(PhysicsContact);
RMP_PLAIN(PhysicsJoint);
RMP_PLAIN(OdeStatistics);
RMP_PLAIN(MeshQuality);
RMP_PLAIN(JointFriction);
RMP_PLAIN(JointSpring);
RMP_PLAIN(JointCoupling);
RMP_PLAIN(CsgEdgePoint);
RMP_PLAIN(ExportPrimitive);
#undef RMP_PLAIN

/// Whether a struct has these members, which are of each process: its size, and space for later
/// versions of the SDK (the functions `fields` list the members one by one).
template <class T>
concept HasStructSize = requires(T x) {
  x.struct_size;
};
template <class T>
concept HasRoom = requires(T x) {
  x.room;
};
/// T has `named` members beside them: one that is added to it and forgotten here does not compile.
template <class T, std::size_t named>
void check_named() {
  check_members<T, named + (HasStructSize<T> ? 1 : 0) + (HasRoom<T> ? 1 : 0)>();
}

/// RMP_FIELDS(Type, a, b, ...): its fields in order. Those of functions that are written out say by
/// check_named() how many they name.
#define RMP_EACH_1(a) fields(v, x.a);
#define RMP_EACH_2(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_1(__VA_ARGS__)
#define RMP_EACH_3(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_2(__VA_ARGS__)
#define RMP_EACH_4(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_3(__VA_ARGS__)
#define RMP_EACH_5(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_4(__VA_ARGS__)
#define RMP_EACH_6(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_5(__VA_ARGS__)
#define RMP_EACH_7(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_6(__VA_ARGS__)
#define RMP_EACH_8(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_7(__VA_ARGS__)
#define RMP_EACH_9(a, ...) \
  fields(v, x.a);          \
  RMP_EACH_8(__VA_ARGS__)
#define RMP_EACH_10(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_9(__VA_ARGS__)
#define RMP_EACH_11(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_10(__VA_ARGS__)
#define RMP_EACH_12(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_11(__VA_ARGS__)
#define RMP_EACH_13(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_12(__VA_ARGS__)
#define RMP_EACH_14(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_13(__VA_ARGS__)
#define RMP_EACH_15(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_14(__VA_ARGS__)
#define RMP_EACH_16(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_15(__VA_ARGS__)
#define RMP_EACH_17(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_16(__VA_ARGS__)
#define RMP_EACH_18(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_17(__VA_ARGS__)
#define RMP_EACH_19(a, ...) \
  fields(v, x.a);           \
  RMP_EACH_18(__VA_ARGS__)
#define RMP_PICK_(_1, _2, _3, _4, _5, _6, _7, _8, _9, _10, _11, _12, _13, _14, _15, _16, _17, _18, \
                  _19, name, ...)                                                                  \
  name
#define RMP_COUNT_(...) \
  RMP_PICK_(__VA_ARGS__, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1)
#define RMP_FIELDS(T, ...)                                                                        \
  template <class V>                                                                              \
  void fields(V& v, T& x) {                                                                       \
    check_named<T, RMP_COUNT_(__VA_ARGS__)>();                                                    \
    RMP_PICK_(__VA_ARGS__, RMP_EACH_19, RMP_EACH_18, RMP_EACH_17, RMP_EACH_16, RMP_EACH_15,       \
              RMP_EACH_14, RMP_EACH_13, RMP_EACH_12, RMP_EACH_11, RMP_EACH_10, RMP_EACH_9,        \
              RMP_EACH_8, RMP_EACH_7, RMP_EACH_6, RMP_EACH_5, RMP_EACH_4, RMP_EACH_3, RMP_EACH_2, \
              RMP_EACH_1)                                                                         \
    (__VA_ARGS__)                                                                                 \
  }

RMP_FIELDS(Mesh, positions, normals, triangles, faces, edge_points, edge_sizes)

// Robots.
RMP_FIELDS(JointModel, name, type, parent, q_index, v_index, placement, link, body, coupling,
           passive, lower, upper, max_velocity, max_acceleration, max_jerk, max_force, armature,
           friction, spring)
RMP_FIELDS(TipModel, name, joint, tool)
RMP_FIELDS(LoopModel, name, joint_a, joint_b, in_a, in_b, fixed)
RMP_FIELDS(RobotModel, name, joints, tips, base, gravity, loops, coordinates, velocities)

/// Scratch has no value to send: the other side has its own.
template <class V>
void scratch_fields(V& v, std::span<double>& scratch) {
  std::uint64_t n = scratch.size();
  v.bytes(&n, sizeof n);
  if constexpr (V::is_reader) {
    if (n > std::uint64_t{1} << 26) return v.fail();
    std::shared_ptr<double[]> own(new double[n]);
    scratch = {own.get(), static_cast<std::size_t>(n)};
    v.keep(std::move(own));
  }
}
template <class V>
void fields(V& v, DynamicsBatch& x) {
  check_named<DynamicsBatch, 10>();
  fields(v, x.count);
  fields(v, x.q);
  fields(v, x.qd);
  fields(v, x.qdd);
  fields(v, x.tau);
  fields(v, x.tip);
  fields(v, x.terms);
  scratch_fields(v, x.scratch);
  fields(v, x.tip_index);
  fields(v, x.base);
}
RMP_FIELDS(IkResult, status, q, position_error, rotation_error, iterations, detail, shortfall,
           limiting_joint, lost_direction)
template <class V>
void fields(V& v, ControlInput& x) {
  check_named<ControlInput, 10>();
  fields(v, x.time);
  fields(v, x.dt);
  fields(v, x.q);
  fields(v, x.qd);
  fields(v, x.q_desired);
  fields(v, x.qd_desired);
  fields(v, x.qdd_desired);
  pointee(v, x.tip_desired);
  fields(v, x.tip_velocity_desired);
  fields(v, x.tip_acceleration_desired);
}
RMP_FIELDS(CodeFile, name, text)

// Motions.
RMP_FIELDS(JointLimits, lower, upper, velocity, acceleration, jerk)
RMP_FIELDS(JointEnds, start_velocity, end_velocity, start_acceleration, end_acceleration)
RMP_FIELDS(JointSamples, q, qd, qdd, qddd)
RMP_FIELDS(RetimeProblem, dof, s, q, q1, q2, velocity, acceleration, torque_a, torque_b, torque_c,
           torque, rate, start_rate, end_rate)
RMP_FIELDS(Retiming, rate, time)
RMP_FIELDS(OdeRun, start, end, x0, sample_times, relative_tolerance, absolute_tolerance, step)
RMP_FIELDS(Plan, points, goal)

// Bodies.
RMP_FIELDS(RoundOutside, pose, sphere, profile)
template <class V>
void fields(V& v, Shape& x) {
  check_named<Shape, 4>();
  fields(v, x.kind);
  fields(v, x.sizes);
  pointee(v, x.mesh);
  fields(v, x.pose);
  std::span<const Vec3> corners = corners_of(x);
  fields(v, corners);
  if constexpr (V::is_reader) set_corners(x, corners);
  const RoundOutside* outside = outside_of(x);
  pointee(v, outside);
  if constexpr (V::is_reader) set_outside(x, outside);
}
RMP_FIELDS(ShapedBody, shapes)
RMP_FIELDS(PhysicsBody, shape, mass, pose, velocity, angular_velocity, friction, restitution, group,
           self)
RMP_FIELDS(PhysicsNote, a, b, text)
RMP_FIELDS(PhysicsState, poses, velocities, angular_velocities, joint_positions, joint_velocities)

// Solids.
RMP_FIELDS(CsgCurve, kind, points)
RMP_FIELDS(CsgLoop, start, curves)
RMP_FIELDS(CsgProfile, loops)
RMP_FIELDS(CsgGeometry, form, brep, points, triangles, digest, source, deviation)
RMP_FIELDS(CsgNode, kind, parent, placement, sizes, name, profile, geometry, select)
RMP_FIELDS(CsgTree, nodes)
RMP_FIELDS(Moments, volume, area, first, second, exact, relative_error)
RMP_FIELDS(CsgEngine::Partition, parts, overlap)
RMP_FIELDS(CsgFeature, kind, point, direction, radius, size, inward)
RMP_FIELDS(CsgEdge, kind, is_closed, length, centre, axis, radius, angle, points)

// Files.
RMP_FIELDS(ImportedFile, name, text)
RMP_FIELDS(ImportedGeometry, name, geometry)
RMP_FIELDS(ForeignGeometry, name, path, scale, unit)
RMP_FIELDS(Imported, records, geometries, notes, profile, foreign)
RMP_FIELDS(ExportedFile, name, bytes)
RMP_FIELDS(ExportReport::Count, what, count)
RMP_FIELDS(ExportReport, notes, counts)
RMP_FIELDS(ExportLink, name, parent, joint, joint_count, joint_T_link, is_row, has_mass)
RMP_FIELDS(ExportFrame, name, link, pose)
RMP_FIELDS(ExportPose, name, q)
RMP_FIELDS(ExportPair, a, b, why, text)
RMP_FIELDS(ExportMechanism, links, frames, poses, left_out, pairs)
template <class V>
void fields(V& v, ExportItem& x) {
  check_named<ExportItem, 8>();
  fields(v, x.name);
  fields(v, x.parent);
  fields(v, x.pose);
  fields(v, x.colour);
  pointee(v, x.mesh);
  pointee(v, x.geometry);
  fields(v, x.definition);
  pointee(v, x.profile);
  const ExportPrimitive* is = primitive(x);
  pointee(v, is);
  if constexpr (V::is_reader) set_primitive(x, is);
  for (const std::size_t word : {std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{4}})
    fields(v, x.room.words[word]);
}
template <class V>
void fields(V& v, ExportRobot& x) {
  check_named<ExportRobot, 4>();
  fields(v, x.name);
  pointee(v, x.model);
  fields(v, x.pose);
  fields(v, x.q);
  const ExportMechanism* m = mechanism(x);
  pointee(v, m);
  if constexpr (V::is_reader) set_mechanism(x, m);
  const MassProperties* standing = standing_mass(x);
  pointee(v, standing);
  if constexpr (V::is_reader) set_standing_mass(x, standing);
}
template <class V>
void fields(V& v, ExportTask& x) {
  check_named<ExportTask, 5>();
  fields(v, x.extension);
  fields(v, x.name);
  fields(v, x.items);
  fields(v, x.robots);  // the report goes with the call (proxies.cpp)
}

/// A row of a parameter table that owns its texts.
struct RowWire {
  std::string name, type, unit, doc, label, group;
  std::optional<std::string> default_text, choices;
  double min = 0, max = 0;
  std::uint32_t flags = 0;
};
RMP_FIELDS(RowWire, name, type, unit, doc, label, group, default_text, choices, min, max, flags)

// Values of modules.
template <class V>
void fields(V& v, ModuleValue& x) {
  using Type = ModuleValue::Type;
  Type type = x.type();
  fields(v, type);
  if constexpr (V::is_reader) {
    x = {};
    if (++v.depth > kDeepest) return v.fail();
  }
  switch (type) {
    case Type::none: break;
    case Type::boolean: {
      bool b = x.boolean();
      fields(v, b);
      if constexpr (V::is_reader) x = ModuleValue(b);
      break;
    }
    case Type::integer: {
      std::int64_t n = x.integer();
      fields(v, n);
      if constexpr (V::is_reader) x = ModuleValue(n);
      break;
    }
    case Type::real: {
      double d = x.real();
      fields(v, d);
      if constexpr (V::is_reader) x = ModuleValue(d);
      break;
    }
    case Type::text: {
      std::string s = x.text();
      fields(v, s);
      if constexpr (V::is_reader) x = ModuleValue(std::move(s));
      break;
    }
    case Type::numbers: {
      std::vector<double> all = x.numbers();
      std::uint64_t rows = x.rows(), columns = x.columns();
      std::string unit = x.unit();
      fields(v, all);
      fields(v, rows);
      fields(v, columns);
      fields(v, unit);
      if constexpr (V::is_reader)
        x = ModuleValue::matrix(std::move(all), rows, columns, std::move(unit));
      break;
    }
    case Type::list:
    case Type::map: {
      const std::uint64_t n = count_of(v, x.size(), 1);
      if constexpr (V::is_reader)  // each key of a map is looked for among the others
        if (type == Type::map && n > 65536) return v.fail();
      if constexpr (V::is_reader) x = type == Type::map ? ModuleValue::map() : ModuleValue::list();
      for (std::uint64_t i = 0; i < n; ++i) {
        if constexpr (V::is_reader) {
          if (v.is_broken()) break;
          std::string key;
          ModuleValue item;
          if (type == Type::map) fields(v, key);
          fields(v, item);
          if (type == Type::map) x.set(std::move(key), std::move(item));
          else x.add(std::move(item));
        } else {
          if (type == Type::map) fields(v, const_cast<std::string&>(x.key(i)));
          fields(v, const_cast<ModuleValue&>(x.item(i)));
        }
      }
      break;
    }
    case Type::reference: {
      std::string kind = x.kind();
      std::uint64_t number = x.number();
      fields(v, kind);
      fields(v, number);
      if constexpr (V::is_reader) x = ModuleValue::reference(std::move(kind), number);
      break;
    }
    default:
      if constexpr (V::is_reader) v.fail();
  }
  if constexpr (V::is_reader) --v.depth;
}
template <class V>
void fields(V& v, ModuleRunNotice& x) {
  check_named<ModuleRunNotice, 6>();
  fields(v, x.kind);
  fields(v, x.number);
  fields(v, x.command);
  fields(v, x.session);
  pointee(v, x.arguments);
  fields(v, x.is_job);
}
template <class V>
void fields(V& v, ModuleRunEnd& x) {
  check_named<ModuleRunEnd, 3>();
  fields(v, x.seconds);
  fields(v, x.error);
  pointee(v, x.result);
}

}  // namespace robomosp::apart

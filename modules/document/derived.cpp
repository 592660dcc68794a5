// SPDX-License-Identifier: Apache-2.0
#include "document/derived.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "document/cache.h"
#include "document/digest.h"
#include "geometry/mesh_checks.h"
#include "kernel/fingerprint.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/build_model.h"
#include "robotics/skin.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::document {

namespace {

using text::quote;

constexpr std::size_t kMostLeaves = 100'000;  ///< solids in one object, nested ones included
constexpr double kSkinChord = 2e-4;           ///< tessellation of generated bodies [m]
constexpr double kSkinShininess = 0.4;
constexpr std::size_t kShapeBytesPerNode = 16'384;  ///< an engine's solid, about

using ShapePtr = std::shared_ptr<const CsgShape>;

Error stale(const Snapshot& s, AnyId id) {
  return error(ErrorCode::stale_handle, s.describe(id) + " does not exist",
               "Look it up again by its name.");
}

/// `object "arm" waits for solid "bore": ...`
Error waits(const Snapshot& s, AnyId who, Error e) {
  e.where = s.describe(who) + (e.where.empty() ? "" : " waits for " + e.where);
  return e;
}

Error broken(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + quote(provider) + " " + what,
               "Report it to the provider's author or choose another provider.");
}

bool is_finite(const Moments& m) {
  return std::isfinite(m.volume) && std::isfinite(m.area) && spatial::is_finite(m.first) &&
         spatial::is_finite(m.second) && std::isfinite(m.relative_error);
}

/// A sentence about what is wrong with a mesh a provider made, or "".
std::string fault_of(const Mesh& m) {
  if (m.positions.size() % 3 != 0 || m.triangles.size() % 3 != 0)
    return "made a mesh with incomplete vertices or triangles";
  if (m.normals.size() != m.positions.size())
    return "made a mesh with " + std::to_string(m.normals.size() / 3) + " normals for " +
           std::to_string(m.positions.size() / 3) + " vertices";
  if (m.triangles.empty()) return "made a mesh without triangles";
  for (const auto* numbers : {&m.positions, &m.normals, &m.edge_points})
    for (const float v : *numbers)
      if (!std::isfinite(v)) return "made a mesh with numbers that are not finite";
  for (const auto i : m.triangles)
    if (i >= m.vertex_count()) return "made a mesh whose triangles name vertices that do not exist";
  std::size_t edge_points = 0;
  for (const auto n : m.edge_sizes) edge_points += n;
  if (edge_points * 3 != m.edge_points.size())
    return "made a mesh whose edges have the wrong number of points";
  for (const auto& f : m.faces)
    if (std::size_t{f.first_triangle} + f.triangle_count > m.triangle_count())
      return "made a mesh whose faces exceed its triangles";
  const auto report = geometry::check(m);
  return report.is_closed ? "" : "made an open mesh: " + report.problem;
}

std::size_t mesh_bytes(const Mesh& m) {
  return sizeof(Mesh) +
         4 * (m.positions.size() + m.normals.size() + m.triangles.size() + m.edge_points.size() +
              m.edge_sizes.size()) +
         sizeof(Mesh::Face) * m.faces.size();
}

CsgTree tree_of(const model::Solid& s) {
  CsgTree tree;
  tree.nodes.reserve(s.nodes.size());
  for (const auto& n : s.nodes)
    tree.nodes.push_back({n.kind, n.parent, model::pose(n.placement), n.sizes, n.name, n.profile,
                          n.geometry, n.select});
  return tree;
}

void feed(Fingerprinter& fp, const Pose& t) {
  fp.add(std::span<const double>(t.R)).add(std::span<const double>(t.p));
}

void feed(Fingerprinter& fp, const CsgProfile& profile) {
  fp.add(profile.loops.size());
  for (const CsgLoop& loop : profile.loops) {
    fp.add(std::span<const double>(loop.start)).add(loop.curves.size());
    for (const CsgCurve& c : loop.curves) {
      fp.add(static_cast<int>(c.kind)).add(c.points.size());
      for (const auto& p : c.points) fp.add(std::span<const double>(p));
    }
  }
}

/// A solid at a place within an object, nested objects resolved.
struct Leaf {
  SolidId solid;
  Pose placement;         ///< outermost_T_solid
  MaterialId material;    ///< resolved; may be none
  std::string name;       ///< "gripper.finger"; a solid's own name when it stands alone
  std::size_t group = 0;  ///< leaves of one group share an object whose overlaps count once
};

/// All solids of a solid or object in order of listing. The outermost material given wins.
Result<std::vector<Leaf>> leaves_of(const Snapshot& s, AnyId id) {
  struct Step {
    AnyId what;
    Pose placement;
    MaterialId material;
    std::string name;
    std::optional<std::size_t> group;
  };
  std::vector<Leaf> leaves;
  std::size_t groups = 0, steps = 0;
  std::vector<Step> stack{{id, {}, {}, "", std::nullopt}};
  while (!stack.empty()) {
    Step step = std::move(stack.back());
    stack.pop_back();
    if (++steps > kMostLeaves || leaves.size() >= kMostLeaves)
      return error(
          ErrorCode::unsupported,
          "it has more than " + std::to_string(kMostLeaves) + " parts, nested ones included",
          "Divide it into smaller objects.", s.describe(id));
    const Record* record = s.find(step.what);
    if (!record) return stale(s, step.what);
    if (const auto* solid = std::get_if<model::Solid>(&record->body)) {
      leaves.push_back({SolidId{step.what.number}, step.placement,
                        step.material ? step.material : solid->material,
                        step.name.empty() ? record->name : std::move(step.name),
                        step.group ? *step.group : groups++});
      continue;
    }
    const auto* object = std::get_if<model::Object>(&record->body);
    if (!object)
      return error(ErrorCode::invalid_argument,
                   s.describe(step.what) + " is neither a solid nor an object");
    if (!step.group && object->overlap == model::Overlap::once) step.group = groups++;
    for (auto p = object->parts.rbegin(); p != object->parts.rend(); ++p)
      stack.push_back({p->what, spatial::compose(step.placement, model::pose(p->placement)),
                       step.material ? step.material : p->material,
                       step.name.empty() ? p->name : step.name + "." + p->name, step.group});
  }
  return leaves;
}

}  // namespace

struct Derived::Impl {
  Impl(const Registry& r, std::size_t budget) : registry(r), cache(budget) {}

  /// The CSG provider in use and its part of every key.
  struct Engine {
    std::shared_ptr<CsgEngine> csg;
    std::string name, version;
  };
  struct Shape {
    ShapePtr shape;
    Fingerprint key;
    Engine engine;
  };

  Result<Engine> engine() {
    const std::uint64_t revision = registry.revision();
    {
      const std::lock_guard lock(mutex);
      if (known && known_revision == revision) return *known;
    }
    RMP_TRY_ASSIGN(const ProviderInfo info, registry.find(CsgEngine::kInterfaceId, ""));
    RMP_TRY_ASSIGN(auto csg, registry.create<CsgEngine>(info.name));
    const std::lock_guard lock(mutex);
    known = Engine{std::move(csg), info.name, info.version};
    known_revision = revision;
    return *known;
  }

  Result<Shape> shape(const CsgTree& tree, Progress& progress) {
    RMP_TRY_ASSIGN(Engine e, engine());
    Fingerprinter fp("shape/1");
    fp.add(std::string_view(e.name)).add(std::string_view(e.version)).add(tree.nodes.size());
    for (const CsgNode& n : tree.nodes) {
      fp.add(static_cast<int>(n.kind))
          .add(static_cast<int>(n.parent))
          .add(std::span<const double>(n.sizes))
          .add(std::string_view(n.select));
      fp.add(n.profile != nullptr).add(n.geometry != nullptr);
      if (n.profile) feed(fp, *n.profile);
      if (n.geometry)
        fp.add(static_cast<std::int64_t>(n.geometry->digest[0]))
            .add(static_cast<std::int64_t>(n.geometry->digest[1]));
      feed(fp, n.placement);
    }
    const Fingerprint key = fp.finish();
    // A failure names nodes, so equal trees with other names do not share it.
    Fingerprinter failure("shape failure/1");
    failure.add(key);
    for (const CsgNode& n : tree.nodes) failure.add(std::string_view(n.name));
    RMP_TRY_ASSIGN(auto found,
                   cache.get<ShapePtr>(
                       key, failure.finish(),
                       [&]() -> Result<ShapePtr> {
                         if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
                         auto made =
                             guarded(e.name, [&] { return e.csg->evaluate(tree, progress); });
                         if (made.ok() && !*made) return broken(e.name, "returned no solid");
                         return made;
                       },
                       [&](const ShapePtr&) { return kShapeBytesPerNode * tree.nodes.size(); }));
    return Shape{*found, key, std::move(e)};
  }

  Result<std::shared_ptr<const Mesh>> mesh(const CsgTree& tree, double chord, Progress& progress) {
    RMP_TRY_ASSIGN(const Shape s, shape(tree, progress));
    MeshQuality quality;
    quality.chord = chord;
    Fingerprinter fp("mesh/1");
    fp.add(s.key).add(quality.chord).add(quality.angle);
    const Fingerprint key = fp.finish();
    return cache.get<Mesh>(
        key, key,
        [&]() -> Result<Mesh> {
          auto made = guarded(s.engine.name,
                              [&] { return s.engine.csg->mesh(*s.shape, quality, progress); });
          if (made.ok())
            if (const std::string fault = fault_of(*made); !fault.empty())
              return broken(s.engine.name, fault);
          return made;
        },
        mesh_bytes);
  }

  Result<Moments> moments(const Shape& s, Progress& progress) {
    Fingerprinter fp("moments/1");
    fp.add(s.key);
    const Fingerprint key = fp.finish();
    RMP_TRY_ASSIGN(
        auto found,
        cache.get<Moments>(
            key, key,
            [&]() -> Result<Moments> {
              auto made =
                  guarded(s.engine.name, [&] { return s.engine.csg->moments(*s.shape, progress); });
              if (made.ok() && !is_finite(*made))
                return broken(s.engine.name, "returned moments that are not finite numbers");
              if (made.ok() && !(made->volume > 0))
                return broken(s.engine.name,
                              "returned a volume of " + text::print(made->volume) + " m^3");
              return made;
            },
            [](const Moments&) { return sizeof(Moments); }));
    return *found;
  }

  /// The solid's content, or why there is none to work on.
  static Result<const model::Solid*> solid_of(const Snapshot& s, SolidId id) {
    const auto* solid = s.get(id);
    if (!solid) return stale(s, id);
    if (solid->nodes.empty())
      return error(ErrorCode::invalid_argument, "it has no nodes",
                   "Add a primitive such as a box to it.", s.describe(id));
    return solid;
  }

  Result<Shape> shape(const Snapshot& s, SolidId id, Progress& progress) {
    RMP_TRY_ASSIGN(const auto* solid, solid_of(s, id));
    return shape(tree_of(*solid), progress).in(s.describe(id));
  }

  Result<CsgEngine::Partition> partition(const std::vector<Shape>& shapes,
                                         const std::vector<Pose>& poses, Progress& progress) {
    const Engine& e = shapes.front().engine;
    Fingerprinter fp("partition/1");
    fp.add(shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      fp.add(shapes[i].key);
      feed(fp, poses[i]);
    }
    const Fingerprint key = fp.finish();
    RMP_TRY_ASSIGN(
        auto found,
        cache.get<CsgEngine::Partition>(
            key, key,
            [&]() -> Result<CsgEngine::Partition> {
              std::vector<PlacedShape> placed;
              for (std::size_t i = 0; i < shapes.size(); ++i)
                placed.push_back({shapes[i].shape, poses[i]});
              auto made = guarded(e.name, [&] { return e.csg->partition(placed, progress); });
              if (!made.ok()) return made;
              if (made->parts.size() != placed.size())
                return broken(e.name, "returned " + std::to_string(made->parts.size()) +
                                          " parts for " + std::to_string(placed.size()));
              if (!std::isfinite(made->overlap) ||
                  !std::all_of(made->parts.begin(), made->parts.end(), is_finite))
                return broken(e.name, "returned moments that are not finite numbers");
              return made;
            },
            [](const CsgEngine::Partition& p) { return sizeof(Moments) * p.parts.size(); }));
    return *found;
  }

  /// Adds the mass of leaves that share one object with Overlap::once.
  Result<void> add_group(const Snapshot& s, std::vector<const Leaf*> group,
                         std::vector<MassProperties>& masses, BodyMass& sum, Progress& progress) {
    std::stable_partition(group.begin(), group.end(),
                          [](const Leaf* l) { return static_cast<bool>(l->material); });
    std::vector<Shape> shapes;
    std::vector<Pose> poses;
    std::vector<double> densities;
    std::vector<Moments> whole;
    for (const Leaf* l : group) {
      RMP_TRY_ASSIGN(Shape shape_of_leaf, shape(s, l->solid, progress));
      auto m = moments(shape_of_leaf, progress).in(s.describe(l->solid));
      if (!m.ok()) return std::move(m).error();
      whole.push_back(*m);
      shapes.push_back(std::move(shape_of_leaf));
      poses.push_back(l->placement);
      const auto* material = l->material ? s.get(l->material) : nullptr;
      if (l->material && !material) return stale(s, l->material);
      densities.push_back(material ? material->density : 0);
      if (!material) {
        std::string note = s.describe(l->solid) + " has no material, so it has no mass.";
        if (std::find(sum.notes.begin(), sum.notes.end(), note) == sum.notes.end())
          sum.notes.push_back(std::move(note));
      }
      sum.area += m->area;
      sum.exact = sum.exact && m->exact;
      for (const std::string& note : shapes.back().shape->notes()) {
        std::string full = s.describe(l->solid) + ": " + note;
        if (std::find(sum.notes.begin(), sum.notes.end(), full) == sum.notes.end())
          sum.notes.push_back(std::move(full));
      }
    }
    if (group.size() == 1) {
      sum.volume += whole[0].volume;
      masses.push_back(
          spatial::in_frame(spatial::mass_properties(whole[0], densities[0]), poses[0]));
      return {};
    }
    RMP_TRY_ASSIGN(const CsgEngine::Partition parts, partition(shapes, poses, progress));
    sum.overlap += parts.overlap;
    for (std::size_t i = 0; i < group.size(); ++i) {
      sum.volume += parts.parts[i].volume;
      sum.exact = sum.exact && parts.parts[i].exact;
      masses.push_back(spatial::mass_properties(parts.parts[i], densities[i]));
    }
    return {};
  }

  Result<BodyMass> mass(const Snapshot& s, AnyId id, Progress& progress) {
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
    std::size_t groups = 0;
    for (const Leaf& l : leaves) groups = std::max(groups, l.group + 1);
    std::vector<std::vector<const Leaf*>> by_group(groups);
    for (const Leaf& l : leaves) by_group[l.group].push_back(&l);
    BodyMass sum;
    std::vector<MassProperties> masses;
    for (auto& group : by_group) {
      if (group.empty()) continue;
      auto added = add_group(s, std::move(group), masses, sum, progress);
      if (!added.ok()) return std::move(added).error();
    }
    sum.mass = spatial::combine(masses);
    if (!spatial::is_finite(sum.mass))
      return error(ErrorCode::invalid_argument, "its mass is beyond the range of real numbers",
                   "Check sizes and densities.", s.describe(id));
    return sum;
  }

  Result<std::vector<Drawable>> drawables(const Snapshot& s, AnyId id, Progress& progress) {
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
    std::vector<Drawable> all;
    for (const Leaf& l : leaves) {
      RMP_TRY_ASSIGN(const auto* solid, solid_of(s, l.solid));
      auto m = mesh(tree_of(*solid), solid->chord, progress).in(s.describe(l.solid));
      if (!m.ok()) return std::move(m).error();
      const auto* given = l.material ? s.get(l.material) : nullptr;
      const model::Material look = given ? *given : model::Material{};
      all.push_back({l.name, *m, l.placement, look.colour, look.shininess, look.metalness});
    }
    return all;
  }

  Result<std::array<Vec3, 2>> bounds(const Snapshot& s, AnyId id, Progress& progress) {
    RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
    if (leaves.empty())
      return error(ErrorCode::invalid_argument, "it has no parts", "Add a part to it.",
                   s.describe(id));
    constexpr double kInf = std::numeric_limits<double>::infinity();
    std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
    for (const Leaf& l : leaves) {
      RMP_TRY_ASSIGN(const Shape shape_of_leaf, shape(s, l.solid, progress));
      auto own = guarded(shape_of_leaf.engine.name, [&]() -> Result<std::array<Vec3, 2>> {
        return shape_of_leaf.shape->bounds();
      });
      if (!own.ok()) return std::move(own).error().in(s.describe(l.solid));
      if (!spatial::is_finite((*own)[0]) || !spatial::is_finite((*own)[1]))
        return broken(shape_of_leaf.engine.name, "returned bounds that are not finite numbers")
            .in(s.describe(l.solid));
      for (unsigned corner = 0; corner < 8; ++corner) {
        const Vec3 p =
            spatial::transform(l.placement, {(*own)[corner & 1U][0], (*own)[(corner >> 1U) & 1U][1],
                                             (*own)[(corner >> 2U) & 1U][2]});
        for (std::size_t i = 0; i < 3; ++i) {
          box[0][i] = std::min(box[0][i], p[i]);
          box[1][i] = std::max(box[1][i], p[i]);
        }
      }
    }
    return box;
  }

  /// Mass of a link's designed parts in the link's frame; nullopt without parts or material.
  Result<std::optional<MassProperties>> designed_mass(const Snapshot& s, const model::Link& link,
                                                      Progress& progress) {
    std::vector<MassProperties> masses;
    for (const auto& p : link.parts) {
      RMP_TRY_ASSIGN(const BodyMass m, mass(s, p.what, progress));
      if (m.mass.mass > 0) masses.push_back(spatial::in_frame(m.mass, model::pose(p.placement)));
    }
    if (masses.empty()) return std::optional<MassProperties>{};
    return std::optional<MassProperties>{spatial::combine(masses)};
  }

  Result<std::shared_ptr<const RobotModel>> robot_model(const Snapshot& s, RobotId id, Vec3 gravity,
                                                        Progress& progress) {
    const Record* record = s.find(id);
    if (!record) return stale(s, id);
    const auto& robot = std::get<model::Robot>(record->body);
    std::vector<std::optional<MassProperties>> masses;
    if (robot.mass_source == model::MassSource::designed)
      for (const auto& link : robot.links) {
        RMP_TRY_ASSIGN(auto m, designed_mass(s, link, progress));
        masses.push_back(m);
      }
    // The key: what the model is built from, without looks, poses, solvers and parts.
    model::Robot kinematic = robot;
    kinematic.description.clear();
    kinematic.source.clear();
    kinematic.base_parts.clear();
    kinematic.poses.clear();
    kinematic.ik = kinematic.inverse_dynamics = kinematic.forward_dynamics = {};
    kinematic.skin_colour = kinematic.skin_accent = {};
    kinematic.parametric = {};  // what it comes from does not matter, only the numbers
    for (auto& link : kinematic.links) {
      link.parts.clear();
      link.visible = true;
    }
    Fingerprinter fp("robot_model/1");
    fp.add(std::string_view(record->name)).add(std::span<const double>(gravity));
    document::feed(fp, kinematic, [](Fingerprinter&, AnyId) {});
    for (const auto& m : masses) {
      fp.add(m.has_value());
      if (!m) continue;
      const Sym3& i = m->inertia;
      fp.add(m->mass).add(std::span<const double>(m->com));
      for (const double v : {i.xx, i.yy, i.zz, i.xy, i.yz, i.xz}) fp.add(v);
    }
    const Fingerprint key = fp.finish();
    return cache.get<RobotModel>(
        key, key, [&] { return robotics::build_robot_model(record->name, robot, masses, gravity); },
        [](const RobotModel& m) {
          return sizeof(RobotModel) + sizeof(JointModel) * m.joints.size();
        });
  }

  Result<RobotBodies> robot_bodies(const Snapshot& s, RobotId id, Progress& progress) {
    const auto* robot = s.get(id);
    if (!robot) return stale(s, id);
    RobotBodies out;
    out.bodies.resize(robot->links.size() + 1);
    out.generated =
        robot->base_parts.empty() && std::all_of(robot->links.begin(), robot->links.end(),
                                                 [](const auto& l) { return l.parts.empty(); });
    if (out.generated) {
      RMP_TRY(add_skin(*robot, out, progress));
      return out;
    }
    const auto add = [&](const std::vector<model::BodyPart>& parts,
                         std::vector<Drawable>& to) -> Result<void> {
      for (const auto& p : parts) {
        RMP_TRY_ASSIGN(auto drawn, drawables(s, p.what, progress));
        for (Drawable& d : drawn) {
          d.placement = spatial::compose(model::pose(p.placement), d.placement);
          to.push_back(std::move(d));
        }
      }
      return {};
    };
    RMP_TRY(add(robot->base_parts, out.bodies[0]));
    for (std::size_t i = 0; i < robot->links.size(); ++i)
      if (robot->links[i].visible) RMP_TRY(add(robot->links[i].parts, out.bodies[i + 1]));
    return out;
  }

  Result<void> add_skin(const model::Robot& robot, RobotBodies& out, Progress& progress) {
    const robotics::Skin skin = robotics::make_skin(robot);
    const auto add = [&](const std::vector<robotics::SkinPiece>& pieces, const std::string& name,
                         std::vector<Drawable>& to) -> Result<void> {
      for (const auto& piece : pieces) {
        RMP_TRY_ASSIGN(auto m, mesh(piece.tree, kSkinChord, progress));
        to.push_back(
            {name,
             std::move(m),
             {},
             piece.role == robotics::SkinRole::tube ? robot.skin_colour : robot.skin_accent,
             kSkinShininess,
             0});
      }
      return {};
    };
    RMP_TRY(add(skin.base, "base", out.bodies[0]));
    for (std::size_t i = 0; i < robot.links.size() && i < skin.links.size(); ++i)
      RMP_TRY(add(skin.links[i], robot.links[i].name, out.bodies[i + 1]));
    return {};
  }

  const Registry& registry;
  Cache cache;
  std::mutex mutex;
  std::optional<Engine> known;       // guarded by mutex
  std::uint64_t known_revision = 0;  // guarded by mutex
};

namespace {

/// Adds who asked to an error of a part.
template <class T>
Result<T> for_whom(const Snapshot& s, AnyId who, Result<T> result) {
  if (result.ok() || result.error().code == ErrorCode::cancelled) return result;
  if (who.kind == Kind::solid || result.error().where == s.describe(who) || !s.find(who))
    return result;
  return waits(s, who, std::move(result).error());
}

}  // namespace

Derived::Derived(const Registry& registry, std::size_t budget_bytes)
    : impl_(std::make_unique<Impl>(registry, budget_bytes)) {}
Derived::~Derived() = default;

Result<std::shared_ptr<const Mesh>> Derived::mesh(const Snapshot& s, SolidId id,
                                                  Progress& progress) {
  RMP_TRY_ASSIGN(const auto* solid, Impl::solid_of(s, id));
  return impl_->mesh(tree_of(*solid), solid->chord, progress).in(s.describe(id));
}

Result<Moments> Derived::moments(const Snapshot& s, SolidId id, Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->shape(s, id, progress));
  return impl_->moments(shape, progress).in(s.describe(id));
}

Result<BodyMass> Derived::mass(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->mass(s, id, progress));
}

Result<std::array<Vec3, 2>> Derived::bounds(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->bounds(s, id, progress));
}

Result<std::vector<Drawable>> Derived::drawables(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, impl_->drawables(s, id, progress));
}

Result<std::shared_ptr<const RobotModel>> Derived::robot_model(const Snapshot& s, RobotId id,
                                                               Vec3 gravity, Progress& progress) {
  auto made = impl_->robot_model(s, id, gravity, progress);
  // Faults of the robot itself say so already.
  if (!made.ok() && made.error().where.starts_with("robot ")) return made;
  return for_whom(s, id, std::move(made));
}

Result<RobotBodies> Derived::robot_bodies(const Snapshot& s, RobotId id, Progress& progress) {
  return for_whom(s, id, impl_->robot_bodies(s, id, progress));
}

CacheStats Derived::stats() const { return impl_->cache.stats(); }
void Derived::clear() { impl_->cache.clear(); }
void Derived::set_enabled(bool is_enabled) { impl_->cache.set_enabled(is_enabled); }

}  // namespace robomosp::document

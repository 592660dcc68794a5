// SPDX-License-Identifier: Apache-2.0
// Golden text of what host and plugins must agree on: sizes, offsets, enumerators and the order of
// virtual functions of all SDK types. Run with ROBOMOSP_UPDATE_GOLDEN=1 to write it anew.
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/collision_bounds.h>
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/csg_select.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/files.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/ik_branches.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/language.h>
#include <robomosp/sdk/language_editing.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/physics_notes.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/program_code.h>
#include <robomosp/sdk/program_reader.h>
#include <robomosp/sdk/reader_offers.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/retimer.h>
#include <robomosp/sdk/robot_code.h>
#include <robomosp/sdk/round_outside.h>
#include <robomosp/sdk/threads.h>
#include <robomosp/sdk/tip_force.h>
#include <robomosp/sdk/trajectory.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

/// Slot of a virtual function in its table. GCC (Itanium C++ ABI, 2.3) writes 1 + offset in bytes
/// into the first word of a pointer to a virtual member function.
template <class Pointer>
std::size_t slot(Pointer member) {
  static_assert(sizeof(member) == 2 * sizeof(std::ptrdiff_t));
  std::ptrdiff_t word = 0;
  std::memcpy(&word, &member, sizeof word);
  EXPECT_EQ(word & 1, 1) << "not a virtual function";
  return static_cast<std::size_t>(word - 1) / sizeof(void*);
}

#define TYPE(T) out << #T << " size " << sizeof(T) << " align " << alignof(T) << "\n"
#define FIELD(T, name) \
  out << "  " #name " at " << offsetof(T, name) << " size " << sizeof(T::name) << "\n"
#define VIRTUAL(T, name) out << "  virtual " #name " slot " << slot(&T::name) << "\n"
#define VALUE(name) out << "  " #name " = " << static_cast<long long>(name) << "\n"
#define F1(T, a) FIELD(T, a)
#define F2(T, a, b) \
  F1(T, a);         \
  FIELD(T, b)
#define F3(T, a, b, c) \
  F2(T, a, b);         \
  FIELD(T, c)
#define F4(T, a, b, c, d) \
  F3(T, a, b, c);         \
  FIELD(T, d)
#define F5(T, a, b, c, d, e) \
  F4(T, a, b, c, d);         \
  FIELD(T, e)
#define F6(T, a, b, c, d, e, f) \
  F5(T, a, b, c, d, e);         \
  FIELD(T, f)
#define F7(T, a, b, c, d, e, f, g) \
  F6(T, a, b, c, d, e, f);         \
  FIELD(T, g)
#define F8(T, a, b, c, d, e, f, g, h) \
  F7(T, a, b, c, d, e, f, g);         \
  FIELD(T, h)

void module_types(std::ostream& out) {
  TYPE(ModuleValue);
  TYPE(ModuleValue::Type);
  TYPE(ModuleFields);
  F3(ModuleFields, rows, count, row_size);
  TYPE(ModuleCommand);
  F8(ModuleCommand, name, summary, details, example, effects, sometimes, params, result_type);
  F4(ModuleCommand, result_unit, result_doc, result_fields, run);
  TYPE(ModuleRun);
  VALUE(kModuleRunSimulation);
  VALUE(kModuleRunTask);
  VALUE(kModuleRunJob);
  TYPE(ModuleTable);
  F6(ModuleTable, struct_size, commands, command_count, command_size, settings, runs);
  TYPE(ModuleRunNotice);
  F7(ModuleRunNotice, struct_size, kind, number, command, session, arguments, is_job);
  TYPE(ModuleRunEnd);
  F4(ModuleRunEnd, struct_size, seconds, error, result);
  TYPE(ModuleCall);
  VIRTUAL(ModuleCall, extension);
  VIRTUAL(ModuleCall, run);
  VIRTUAL(ModuleCall, setting);
  VIRTUAL(ModuleCall, name);
  VIRTUAL(ModuleCall, robot_model);
  VIRTUAL(ModuleCall, progress);
  VIRTUAL(ModuleCall, say);
  VIRTUAL(ModuleCall, session);
  TYPE(Module);
  VIRTUAL(Module, extension);
  VIRTUAL(Module, table);
  VIRTUAL(Module, before_run);
  VIRTUAL(Module, after_run);
}

void plain_types(std::ostream& out) {
  TYPE(rmp_param);
  F8(rmp_param, name, type, unit, doc, default_text, choices, min, max);
  F3(rmp_param, flags, label, group);
  TYPE(rmp_host);
  F7(rmp_host, struct_size, program_version, log, run, create, list, extension);
  TYPE(rmp_threads);
  F3(rmp_threads, struct_size, cores, spread);
  TYPE(rmp_files);
  F3(rmp_files, struct_size, kind, read);
  TYPE(rmp_program);
  F8(rmp_program, struct_size, name, arguments, argument_count, input, input_size, seconds, memory);
  F5(rmp_program, most_output, context, output, line, cancelled);
  TYPE(rmp_provider);
  F8(rmp_provider, interface_id, name, summary, tags, params, param_count, param_size, create);
  TYPE(rmp_plugin);
  F8(rmp_plugin, struct_size, abi_tag, id, version, license, summary, providers, provider_count);
  F1(rmp_plugin, provider_size);
  TYPE(Room);
  F1(Room, words);
  TYPE(Pose);
  F2(Pose, R, p);
  TYPE(Sym3);
  F6(Sym3, xx, yy, zz, xy, yz, xz);
  TYPE(MassProperties);
  F3(MassProperties, mass, com, inertia);
  TYPE(Colour);
  F4(Colour, r, g, b, a);
  TYPE(Mesh);
  F6(Mesh, positions, normals, triangles, faces, edge_points, edge_sizes);
  TYPE(Mesh::Face);
  F3(Mesh::Face, first_triangle, triangle_count, id);
  TYPE(Error);
  F5(Error, code, fault_set, message, where, hint);
  TYPE(ResultMisread);
  TYPE(Result<void>);
  TYPE(Result<double>);
  TYPE(Result<std::string>);
  TYPE(JointFriction);
  F3(JointFriction, viscous, coulomb_positive, coulomb_negative);
  TYPE(JointSpring);
  F2(JointSpring, stiffness, rest);
  TYPE(JointCoupling);
  F3(JointCoupling, of, ratio, offset);
  TYPE(JointModel);
  F8(JointModel, name, type, parent, q_index, v_index, placement, link, body);
  F4(JointModel, coupling, passive, lower, upper);
  F7(JointModel, max_velocity, max_acceleration, max_jerk, max_force, armature, friction, spring);
  TYPE(LoopModel);
  F6(LoopModel, name, joint_a, joint_b, in_a, in_b, fixed);
  TYPE(TipModel);
  F3(TipModel, name, joint, tool);
  TYPE(RobotModel);
  F1(RobotModel, struct_size);
  F8(RobotModel, name, joints, tips, base, gravity, loops, coordinates, velocities);
  TYPE(IkTolerance);
  F2(IkTolerance, position, rotation);
  TYPE(IkBatch);
  F1(IkBatch, struct_size);
  F6(IkBatch, targets, seeds, tolerance, all_solutions, continuous, tip);
  F4(IkBatch, goals, objective, clearance, arm_angles);
  TYPE(IkGoal);
  F3(IkGoal, tip, parts, weight);
  TYPE(IkResult);
  F1(IkResult, room);
  F6(IkResult, status, q, position_error, rotation_error, iterations, detail);
  F3(IkResult, shortfall, limiting_joint, lost_direction);
  TYPE(IkBranchChoice);
  F4(IkBranchChoice, name, positive, negative, room);
  TYPE(TipWrench);
  F2(TipWrench, force, moment);
  TYPE(DynamicsBatch);
  F8(DynamicsBatch, count, q, qd, qdd, tau, tip, terms, scratch);
  F2(DynamicsBatch, tip_index, base);
  TYPE(BaseMotion);
  F4(BaseMotion, gravity, acceleration, angular_velocity, angular_acceleration);
  TYPE(Energy);
  F5(Energy, kinetic, potential, momentum, angular_momentum, com);
  TYPE(Shape);
  F1(Shape, room);
  F4(Shape, kind, sizes, mesh, pose);
  TYPE(ShapedBody);
  F1(ShapedBody, shapes);
  TYPE(RoundOutside);
  F3(RoundOutside, pose, sphere, profile);
  TYPE(PathSample);
  F5(PathSample, pose, velocity, angular_velocity, acceleration, angular_acceleration);
  TYPE(CurveSample);
  F4(CurveSample, p, d1, d2, d3);
  TYPE(LawTask);
  F1(LawTask, struct_size);
  F2(LawTask, length, turn);
  TYPE(LawSample);
  F4(LawSample, share, rate, acceleration, jerk);
  TYPE(OrientationSample);
  F3(OrientationSample, R, turn, bend);
  TYPE(OrientationTask);
  F1(OrientationTask, struct_size);
  F3(OrientationTask, points, shares, curve);
  TYPE(JointLimits);
  F1(JointLimits, struct_size);
  F5(JointLimits, lower, upper, velocity, acceleration, jerk);
  TYPE(JointSamples);
  F4(JointSamples, q, qd, qdd, qddd);
  TYPE(JointEnds);
  F1(JointEnds, struct_size);
  F4(JointEnds, start_velocity, end_velocity, start_acceleration, end_acceleration);
  TYPE(RetimeProblem);
  F1(RetimeProblem, struct_size);
  F7(RetimeProblem, dof, s, q, q1, q2, velocity, acceleration);
  F7(RetimeProblem, torque_a, torque_b, torque_c, torque, rate, start_rate, end_rate);
  TYPE(Retiming);
  F2(Retiming, rate, time);
  TYPE(PlanProblem);
  TYPE(Plan);
  F2(Plan, points, goal);
  TYPE(CollisionPair);
  F2(CollisionPair, a, b);
  TYPE(PairDistance);
  F3(PairDistance, distance, on_a, on_b);
  TYPE(PhysicsBody);
  F1(PhysicsBody, room);
  F7(PhysicsBody, shape, mass, pose, velocity, angular_velocity, friction, restitution);
  F2(PhysicsBody, group, self);
  TYPE(PhysicsJoint);
  F1(PhysicsJoint, room);
  F7(PhysicsJoint, a, b, type, in_a, in_b, lower, upper);
  F7(PhysicsJoint, viscous, coulomb, armature, follows, ratio, offset, fixed);
  TYPE(PhysicsState);
  F1(PhysicsState, struct_size);
  F5(PhysicsState, poses, velocities, angular_velocities, joint_positions, joint_velocities);
  TYPE(PhysicsContact);
  F6(PhysicsContact, a, b, point, normal, depth, force);
  TYPE(PhysicsNote);
  F3(PhysicsNote, a, b, text);
  TYPE(OdeRun);
  F1(OdeRun, struct_size);
  F7(OdeRun, start, end, x0, sample_times, relative_tolerance, absolute_tolerance, step);
  TYPE(OdeStatistics);
  F5(OdeStatistics, steps, rejected, rates, events, end);
  TYPE(ControlInput);
  F1(ControlInput, struct_size);
  F7(ControlInput, time, dt, q, qd, q_desired, qd_desired, qdd_desired);
  F3(ControlInput, tip_desired, tip_velocity_desired, tip_acceleration_desired);
  TYPE(CodeFile);
  F2(CodeFile, name, text);
  TYPE(CsgSize);
  F5(CsgSize, name, unit, range, required, default_value);
  TYPE(CsgNodeInfo);
  F5(CsgNodeInfo, kind, name, children, sizes, doc);
  TYPE(CsgCurve);
  F2(CsgCurve, kind, points);
  TYPE(CsgLoop);
  F2(CsgLoop, start, curves);
  TYPE(CsgProfile);
  F1(CsgProfile, loops);
  TYPE(CsgGeometry);
  F7(CsgGeometry, form, brep, points, triangles, digest, source, deviation);
  TYPE(CsgEdgePoint);
  F3(CsgEdgePoint, position, tangent, normals);
  TYPE(CsgEdge);
  F4(CsgEdge, kind, is_closed, length, centre);
  F4(CsgEdge, axis, radius, angle, points);
  TYPE(CsgFeature);
  F6(CsgFeature, kind, point, direction, radius, size, inward);
  TYPE(CsgNode);
  F5(CsgNode, kind, parent, placement, sizes, name);
  F3(CsgNode, profile, geometry, select);
  TYPE(CsgTree);
  F1(CsgTree, nodes);
  TYPE(MeshQuality);
  F2(MeshQuality, chord, angle);
  TYPE(Moments);
  F6(Moments, volume, area, first, second, exact, relative_error);
  TYPE(PlacedShape);
  F2(PlacedShape, shape, placement);
  TYPE(CsgEngine::Partition);
  F2(CsgEngine::Partition, parts, overlap);
  TYPE(ImportedFile);
  F2(ImportedFile, name, text);
  TYPE(ImportedGeometry);
  F2(ImportedGeometry, name, geometry);
  TYPE(ForeignGeometry);
  F4(ForeignGeometry, name, path, scale, unit);
  TYPE(Imported);
  F4(Imported, records, geometries, notes, profile);
  F1(Imported, foreign);
  TYPE(ExportItem);
  F1(ExportItem, room);
  F5(ExportItem, name, parent, pose, colour, mesh);
  F3(ExportItem, geometry, definition, profile);
  TYPE(ItemOfRobot);
  F2(ItemOfRobot, robot, joint);
  TYPE(ExportRobot);
  F5(ExportRobot, name, model, pose, q, room);
  TYPE(ExportTask);
  F5(ExportTask, struct_size, extension, name, items, robots);
  F1(ExportTask, report);
  TYPE(ExportPrimitive);
  F3(ExportPrimitive, form, pose, sizes);
  TYPE(ExportLink);
  F5(ExportLink, name, parent, joint, joint_count, joint_T_link);
  F3(ExportLink, is_row, has_mass, room);
  TYPE(ExportFrame);
  F4(ExportFrame, name, link, pose, room);
  TYPE(ExportPose);
  F2(ExportPose, name, q);
  TYPE(ExportMechanism);
  F6(ExportMechanism, struct_size, links, frames, poses, left_out, pairs);
  TYPE(ExportPair);
  F5(ExportPair, a, b, why, text, room);
  TYPE(ExportReport);
  F3(ExportReport, struct_size, notes, counts);
  TYPE(ExportReport::Count);
  F2(ExportReport::Count, what, count);
  TYPE(ExportedFile);
  F2(ExportedFile, name, bytes);
}

void picture_types(std::ostream& out) {
  using namespace render;
  TYPE(Appearance);
  F6(Appearance, colour, shininess, metalness, ambient, specular, emission);
  TYPE(Item);
  F6(Item, id, name, mesh, pose, appearance, selected);
  F1(Item, room);
  TYPE(Line);
  F4(Line, id, points, colour, width);
  F1(Line, room);
  TYPE(Triad);
  F5(Triad, id, pose, length, label, on_top);
  F1(Triad, room);
  TYPE(MassMark);
  F4(MassMark, id, pose, gyration, label);
  F1(MassMark, room);
  TYPE(Label);
  F2(Label, place, text);
  F1(Label, room);
  TYPE(Legend::Tick);
  F2(Legend::Tick, share, text);
  TYPE(Legend);
  F3(Legend, title, colours, ticks);
  F1(Legend, room);
  TYPE(Light);
  F5(Light, kind, pose, colour, intensity, angle);
  F1(Light, room);
  TYPE(Light::Kind);
  VALUE(Light::Kind::sun);
  VALUE(Light::Kind::point);
  VALUE(Light::Kind::spot);
  VALUE(Light::Kind::ambient);
  TYPE(Scene);
  F6(Scene, items, lines, triads, marks, labels, legends);
  F2(Scene, lights, struct_size);
  TYPE(Camera);
  F5(Camera, view, perspective, eye, target, zoom);
  TYPE(Section);
  F4(Section, point, normal, colour, hatch);
  TYPE(Look);
  F6(Look, camera, style, feature_edges, hidden_edges, section, background);
  F4(Look, background_colour, grid, world_axes, caption);
  TYPE(Options);
  F5(Options, struct_size, width, height, quality, look);
  TYPE(Image);
  F4(Image, width, height, rgba, clip_T_world);
  TYPE(Renderer);
  VIRTUAL(Renderer, extension);
  VIRTUAL(Renderer, draw);
  VIRTUAL(Renderer, png);
  TYPE(Camera::View);
  VALUE(Camera::View::isometric);
  VALUE(Camera::View::bottom);
  VALUE(Camera::View::custom);
  TYPE(Style);
  VALUE(Style::smooth);
  VALUE(Style::flat);
  VALUE(Style::wireframe);
  VALUE(Style::hidden_line);
  TYPE(Background);
  VALUE(Background::automatic);
  VALUE(Background::studio);
  VALUE(Background::plain);
  VALUE(Background::transparent);
  TYPE(Quality);
  VALUE(Quality::draft);
  VALUE(Quality::normal);
  VALUE(Quality::high);
}

void interfaces(std::ostream& out) {
  TYPE(Params);
  VIRTUAL(Params, extension);
  VIRTUAL(Params, has);
  VIRTUAL(Params, real);
  VIRTUAL(Params, integer);
  VIRTUAL(Params, boolean);
  VIRTUAL(Params, text);
  VIRTUAL(Params, reals);
  VIRTUAL(Params, pose);
  TYPE(Progress);
  VIRTUAL(Progress, extension);
  VIRTUAL(Progress, report);
  VIRTUAL(Progress, cancelled);
  TYPE(NoProgress);
  TYPE(IkSolver);
  VIRTUAL(IkSolver, extension);
  VIRTUAL(IkSolver, prepare);
  VIRTUAL(IkSolver, solve);
  TYPE(IkBranches);
  VIRTUAL(IkBranches, extension);
  VIRTUAL(IkBranches, choices);
  VIRTUAL(IkBranches, measure);
  TYPE(InverseDynamics);
  VIRTUAL(InverseDynamics, extension);
  VIRTUAL(InverseDynamics, prepare);
  VIRTUAL(InverseDynamics, scratch_size);
  VIRTUAL(InverseDynamics, torques);
  VIRTUAL(InverseDynamics, inertia);
  VIRTUAL(InverseDynamics, derivatives);
  VIRTUAL(InverseDynamics, regressor);
  VIRTUAL(InverseDynamics, energy);
  TYPE(ForwardDynamics);
  VIRTUAL(ForwardDynamics, extension);
  VIRTUAL(ForwardDynamics, prepare);
  VIRTUAL(ForwardDynamics, scratch_size);
  VIRTUAL(ForwardDynamics, accelerations);
  VIRTUAL(ForwardDynamics, constrained);
  VIRTUAL(ForwardDynamics, derivatives);
  TYPE(Segment);
  VIRTUAL(Segment, extension);
  VIRTUAL(Segment, duration);
  VIRTUAL(Segment, length);
  VIRTUAL(Segment, sample);
  TYPE(SegmentFactory);
  VIRTUAL(SegmentFactory, extension);
  VIRTUAL(SegmentFactory, make);
  TYPE(Curve);
  VIRTUAL(Curve, extension);
  VIRTUAL(Curve, end);
  VIRTUAL(Curve, evaluate);
  VIRTUAL(Curve, knots);
  VIRTUAL(Curve, is_timed);
  VIRTUAL(Curve, is_even);
  TYPE(CurveFactory);
  VIRTUAL(CurveFactory, extension);
  VIRTUAL(CurveFactory, make);
  TYPE(MotionLaw);
  VIRTUAL(MotionLaw, extension);
  VIRTUAL(MotionLaw, duration);
  VIRTUAL(MotionLaw, sample);
  TYPE(MotionLawFactory);
  VIRTUAL(MotionLawFactory, extension);
  VIRTUAL(MotionLawFactory, make);
  TYPE(Orientation);
  VIRTUAL(Orientation, extension);
  VIRTUAL(Orientation, evaluate);
  TYPE(OrientationFactory);
  VIRTUAL(OrientationFactory, extension);
  VIRTUAL(OrientationFactory, make);
  TYPE(JointSegment);
  VIRTUAL(JointSegment, extension);
  VIRTUAL(JointSegment, duration);
  VIRTUAL(JointSegment, sample);
  TYPE(JointSegmentFactory);
  VIRTUAL(JointSegmentFactory, extension);
  VIRTUAL(JointSegmentFactory, make);
  TYPE(Retimer);
  VIRTUAL(Retimer, extension);
  VIRTUAL(Retimer, retime);
  TYPE(Planner);
  VIRTUAL(Planner, extension);
  VIRTUAL(Planner, plan);
  TYPE(CollisionScene);
  VIRTUAL(CollisionScene, extension);
  VIRTUAL(CollisionScene, distances);
  VIRTUAL(CollisionScene, collisions);
  TYPE(CollisionBounds);
  VIRTUAL(CollisionBounds, extension);
  VIRTUAL(CollisionBounds, lower_bounds);
  TYPE(CollisionEngine);
  VIRTUAL(CollisionEngine, extension);
  VIRTUAL(CollisionEngine, build);
  TYPE(PhysicsWorld);
  VIRTUAL(PhysicsWorld, extension);
  VIRTUAL(PhysicsWorld, step);
  VIRTUAL(PhysicsWorld, read);
  VIRTUAL(PhysicsWorld, contacts);
  VIRTUAL(PhysicsWorld, attach);
  VIRTUAL(PhysicsWorld, release);
  VIRTUAL(PhysicsWorld, move);
  VIRTUAL(PhysicsWorld, servo);
  VIRTUAL(PhysicsWorld, push);
  VIRTUAL(PhysicsWorld, ignore);
  TYPE(PhysicsNotes);
  VIRTUAL(PhysicsNotes, extension);
  VIRTUAL(PhysicsNotes, notes);
  TYPE(OdeSystem);
  VIRTUAL(OdeSystem, extension);
  VIRTUAL(OdeSystem, size);
  VIRTUAL(OdeSystem, positions);
  VIRTUAL(OdeSystem, rate);
  VIRTUAL(OdeSystem, project);
  VIRTUAL(OdeSystem, events);
  VIRTUAL(OdeSystem, event_values);
  VIRTUAL(OdeSystem, at_event);
  TYPE(OdeSink);
  VIRTUAL(OdeSink, extension);
  VIRTUAL(OdeSink, sample);
  TYPE(Integrator);
  VIRTUAL(Integrator, extension);
  VIRTUAL(Integrator, prepare);
  VIRTUAL(Integrator, run);
  TYPE(TipForce);
  VIRTUAL(TipForce, extension);
  VIRTUAL(TipForce, prepare);
  VIRTUAL(TipForce, at);
  TYPE(Controller);
  VIRTUAL(Controller, extension);
  VIRTUAL(Controller, prepare);
  VIRTUAL(Controller, state_size);
  VIRTUAL(Controller, scratch_size);
  VIRTUAL(Controller, torques);
  TYPE(RobotCodeGenerator);
  VIRTUAL(RobotCodeGenerator, extension);
  VIRTUAL(RobotCodeGenerator, generate);
  TYPE(ClearanceField);
  VIRTUAL(ClearanceField, extension);
  VIRTUAL(ClearanceField, distance);
  TYPE(PhysicsEngine);
  VIRTUAL(PhysicsEngine, extension);
  VIRTUAL(PhysicsEngine, create);
  TYPE(CsgShape);
  VIRTUAL(CsgShape, extension);
  VIRTUAL(CsgShape, bounds);
  VIRTUAL(CsgShape, notes);
  TYPE(CsgEdges);
  VIRTUAL(CsgEdges, extension);
  VIRTUAL(CsgEdges, edges);
  TYPE(CsgEngine);
  VIRTUAL(CsgEngine, extension);
  VIRTUAL(CsgEngine, evaluate);
  VIRTUAL(CsgEngine, mesh);
  VIRTUAL(CsgEngine, moments);
  VIRTUAL(CsgEngine, partition);
  VIRTUAL(CsgEngine, features);
  VIRTUAL(CsgEngine, section);
  VIRTUAL(CsgEngine, geometry);
  TYPE(CsgPrimitive);
  VIRTUAL(CsgPrimitive, extension);
  VIRTUAL(CsgPrimitive, build);
  TYPE(Importer);
  VIRTUAL(Importer, extension);
  VIRTUAL(Importer, extensions);
  VIRTUAL(Importer, read);
  TYPE(Exporter);
  VIRTUAL(Exporter, extension);
  VIRTUAL(Exporter, extensions);
  VIRTUAL(Exporter, is_exact);
  VIRTUAL(Exporter, write);
}

void enumerators(std::ostream& out) {
  TYPE(ErrorCode);
  VALUE(ErrorCode::invalid_argument);
  VALUE(ErrorCode::internal);
  TYPE(JointType);
  VALUE(JointType::revolute);
  VALUE(JointType::prismatic);
  VALUE(JointType::spherical);
  VALUE(JointType::free);
  TYPE(LoopDirection);
  TYPE(IkParts);
  TYPE(RobotCodePart);
  TYPE(IkObjective);
  VALUE(IkObjective::none);
  VALUE(IkObjective::centre);
  VALUE(IkObjective::manipulability);
  VALUE(IkObjective::limits);
  VALUE(IkObjective::clearance);
  TYPE(ShapeKind);
  VALUE(ShapeKind::mesh);
  VALUE(ShapeKind::box);
  VALUE(ShapeKind::sphere);
  VALUE(ShapeKind::cylinder);
  VALUE(ShapeKind::capsule);
  VALUE(ShapeKind::convex);
  VALUE(ShapeKind::cone);
  VALUE(ShapeKind::ellipsoid);
  TYPE(IkStatus);
  VALUE(IkStatus::solved);
  VALUE(IkStatus::out_of_reach);
  VALUE(IkStatus::joint_limit);
  VALUE(IkStatus::not_converged);
  TYPE(DynamicsTerm);
  VALUE(kGravityTerm);
  VALUE(kInertialTerm);
  VALUE(kVelocityTerm);
  VALUE(kFrictionTerm);
  VALUE(kExternalTerm);
  VALUE(kSpringTerm);
  VALUE(kLoopPoint);
  VALUE(kLoopRevolute);
  VALUE(kLoopWeld);
  VALUE(kIkAxis);
  VALUE(kIkPose);
  VALUE(kCodeAll);
  VALUE(kAllTerms);
  TYPE(CsgKind);
  VALUE(CsgKind::union_);
  VALUE(CsgKind::difference);
  VALUE(CsgKind::intersection);
  VALUE(CsgKind::mirror);
  VALUE(CsgKind::linear_pattern);
  VALUE(CsgKind::circular_pattern);
  VALUE(CsgKind::fillet);
  VALUE(CsgKind::chamfer);
  VALUE(CsgKind::scale);
  VALUE(CsgKind::box);
  VALUE(CsgKind::cylinder);
  VALUE(CsgKind::cone);
  VALUE(CsgKind::sphere);
  VALUE(CsgKind::torus);
  VALUE(CsgKind::frustum);
  VALUE(CsgKind::wedge);
  VALUE(CsgKind::pyramid);
  VALUE(CsgKind::prism);
  VALUE(CsgKind::revolution);
  VALUE(CsgKind::imported);
  VALUE(CsgKind::custom);
  VALUE(CsgKind::ellipsoid);
  TYPE(CsgChildren);
  TYPE(CsgRange);
  TYPE(CsgCurve::Kind);
  TYPE(CsgGeometry::Form);
  TYPE(ExportPair::Why);
  TYPE(CsgEdge::Kind);
  TYPE(CsgFeature::Kind);
  TYPE(CsgEdgeTest);
  F2(CsgEdgeTest, kind, point);
  TYPE(CsgEdgeTest::Kind);
  TYPE(CsgEdgeWord);
  F2(CsgEdgeWord, word, kind);
}

void programs(std::ostringstream& out) {
  TYPE(rmp_table);
  FIELD(rmp_table, rows);
  FIELD(rmp_table, count);
  FIELD(rmp_table, row_size);
  TYPE(rmp_span);
  FIELD(rmp_span, file);
  FIELD(rmp_span, line);
  FIELD(rmp_span, column);
  FIELD(rmp_span, begin);
  FIELD(rmp_span, end);
  TYPE(rmp_code_file);
  FIELD(rmp_code_file, name);
  TYPE(rmp_fault_severity);
  VALUE(RMP_FAULT_ERROR);
  VALUE(RMP_FAULT_WARNING);
  VALUE(RMP_FAULT_NOTE);
  TYPE(rmp_code_fault);
  FIELD(rmp_code_fault, severity);
  FIELD(rmp_code_fault, span);
  FIELD(rmp_code_fault, message);
  FIELD(rmp_code_fault, hint);
  TYPE(rmp_type_kind);
  VALUE(RMP_TYPE_VOID);
  VALUE(RMP_TYPE_INT);
  VALUE(RMP_TYPE_REAL);
  VALUE(RMP_TYPE_CHAR);
  VALUE(RMP_TYPE_BOOL);
  VALUE(RMP_TYPE_STRING);
  VALUE(RMP_TYPE_TEXT);
  VALUE(RMP_TYPE_FILE);
  VALUE(RMP_TYPE_SEMAPHORE);
  VALUE(RMP_TYPE_PROCESS);
  VALUE(RMP_TYPE_ARRAY);
  VALUE(RMP_TYPE_RECORD);
  VALUE(RMP_TYPE_LIST);
  TYPE(rmp_type_role);
  VALUE(RMP_ROLE_NONE);
  VALUE(RMP_ROLE_POSITION);
  VALUE(RMP_ROLE_ORIENTATION);
  VALUE(RMP_ROLE_POSE);
  VALUE(RMP_ROLE_MAIN_JOINT);
  VALUE(RMP_ROLE_ADD_JOINT);
  VALUE(RMP_ROLE_JOINT);
  VALUE(RMP_ROLE_ROBTARGET);
  VALUE(RMP_ROLE_ROBOT);
  TYPE(rmp_code_type);
  FIELD(rmp_code_type, kind);
  FIELD(rmp_code_type, role);
  FIELD(rmp_code_type, name);
  FIELD(rmp_code_type, element);
  FIELD(rmp_code_type, first_field);
  FIELD(rmp_code_type, field_count);
  FIELD(rmp_code_type, lower);
  FIELD(rmp_code_type, upper);
  FIELD(rmp_code_type, span);
  TYPE(rmp_code_field);
  FIELD(rmp_code_field, name);
  FIELD(rmp_code_field, type);
  FIELD(rmp_code_field, span);
  TYPE(rmp_constant_kind);
  VALUE(RMP_CONSTANT_INT);
  VALUE(RMP_CONSTANT_REAL);
  VALUE(RMP_CONSTANT_TEXT);
  TYPE(rmp_code_constant);
  FIELD(rmp_code_constant, kind);
  FIELD(rmp_code_constant, type);
  FIELD(rmp_code_constant, integer);
  FIELD(rmp_code_constant, real);
  FIELD(rmp_code_constant, text);
  FIELD(rmp_code_constant, text_size);
  TYPE(rmp_scope_kind);
  VALUE(RMP_SCOPE_PREDEFINED);
  VALUE(RMP_SCOPE_SYSTEM);
  VALUE(RMP_SCOPE_MODULE);
  VALUE(RMP_SCOPE_PROGRAM);
  VALUE(RMP_SCOPE_ROUTINE);
  TYPE(rmp_code_scope);
  FIELD(rmp_code_scope, kind);
  FIELD(rmp_code_scope, parent);
  FIELD(rmp_code_scope, name);
  FIELD(rmp_code_scope, span);
  TYPE(rmp_symbol_kind);
  VALUE(RMP_SYMBOL_CONSTANT);
  VALUE(RMP_SYMBOL_VARIABLE);
  VALUE(RMP_SYMBOL_PARAMETER);
  VALUE(RMP_SYMBOL_INPUT);
  VALUE(RMP_SYMBOL_OUTPUT);
  VALUE(RMP_SYMBOL_ROBOT);
  VALUE(RMP_SYMBOL_TYPE);
  VALUE(RMP_SYMBOL_ROUTINE);
  VALUE(RMP_SYMBOL_LABEL);
  VALUE(RMP_SYMBOL_INTRINSIC);
  VALUE(RMP_SYMBOL_IMPORT);
  TYPE(rmp_parameter_mode);
  VALUE(RMP_MODE_IN);
  VALUE(RMP_MODE_OUT);
  VALUE(RMP_MODE_INOUT);
  TYPE(rmp_code_symbol);
  FIELD(rmp_code_symbol, kind);
  FIELD(rmp_code_symbol, mode);
  FIELD(rmp_code_symbol, name);
  FIELD(rmp_code_symbol, type);
  FIELD(rmp_code_symbol, scope);
  FIELD(rmp_code_symbol, routine);
  FIELD(rmp_code_symbol, value);
  FIELD(rmp_code_symbol, constant);
  FIELD(rmp_code_symbol, address);
  FIELD(rmp_code_symbol, width);
  FIELD(rmp_code_symbol, span);
  TYPE(rmp_routine_kind);
  VALUE(RMP_ROUTINE_PROGRAM);
  VALUE(RMP_ROUTINE_PROCEDURE);
  VALUE(RMP_ROUTINE_FUNCTION);
  VALUE(RMP_ROUTINE_PROCESS);
  VALUE(RMP_ROUTINE_INTERRUPT);
  VALUE(RMP_ROUTINE_DATA_LIST);
  TYPE(rmp_code_routine);
  FIELD(rmp_code_routine, kind);
  FIELD(rmp_code_routine, symbol);
  FIELD(rmp_code_routine, scope);
  FIELD(rmp_code_routine, first_parameter);
  FIELD(rmp_code_routine, parameter_count);
  FIELD(rmp_code_routine, result);
  FIELD(rmp_code_routine, body);
  FIELD(rmp_code_routine, priority);
  FIELD(rmp_code_routine, condition);
  FIELD(rmp_code_routine, first_instruction);
  FIELD(rmp_code_routine, instruction_count);
  FIELD(rmp_code_routine, temporary_count);
  FIELD(rmp_code_routine, label_count);
  FIELD(rmp_code_routine, is_recursive);
  FIELD(rmp_code_routine, span);
  TYPE(rmp_expression_op);
  VALUE(RMP_EXPR_LITERAL);
  VALUE(RMP_EXPR_SYMBOL);
  VALUE(RMP_EXPR_FIELD);
  VALUE(RMP_EXPR_INDEX);
  VALUE(RMP_EXPR_CALL);
  VALUE(RMP_EXPR_INTRINSIC);
  VALUE(RMP_EXPR_MAKE);
  VALUE(RMP_EXPR_CONVERT);
  VALUE(RMP_EXPR_NEGATE);
  VALUE(RMP_EXPR_NOT);
  VALUE(RMP_EXPR_ADD);
  VALUE(RMP_EXPR_SUBTRACT);
  VALUE(RMP_EXPR_MULTIPLY);
  VALUE(RMP_EXPR_DIVIDE);
  VALUE(RMP_EXPR_DIV);
  VALUE(RMP_EXPR_MOD);
  VALUE(RMP_EXPR_EQUAL);
  VALUE(RMP_EXPR_NOT_EQUAL);
  VALUE(RMP_EXPR_LESS);
  VALUE(RMP_EXPR_LESS_EQUAL);
  VALUE(RMP_EXPR_GREATER);
  VALUE(RMP_EXPR_GREATER_EQUAL);
  VALUE(RMP_EXPR_AND);
  VALUE(RMP_EXPR_OR);
  VALUE(RMP_EXPR_EXOR);
  VALUE(RMP_EXPR_COMPOSE);
  TYPE(rmp_code_expression);
  FIELD(rmp_code_expression, op);
  FIELD(rmp_code_expression, type);
  FIELD(rmp_code_expression, symbol);
  FIELD(rmp_code_expression, constant);
  FIELD(rmp_code_expression, first);
  FIELD(rmp_code_expression, count);
  FIELD(rmp_code_expression, span);
  TYPE(rmp_statement_op);
  VALUE(RMP_STMT_ASSIGN);
  VALUE(RMP_STMT_CALL);
  VALUE(RMP_STMT_IF);
  VALUE(RMP_STMT_ARM);
  VALUE(RMP_STMT_CASE);
  VALUE(RMP_STMT_WHILE);
  VALUE(RMP_STMT_REPEAT);
  VALUE(RMP_STMT_LOOP);
  VALUE(RMP_STMT_FOR);
  VALUE(RMP_STMT_FOR_DOWN);
  VALUE(RMP_STMT_EXIT);
  VALUE(RMP_STMT_GOTO);
  VALUE(RMP_STMT_LABEL);
  VALUE(RMP_STMT_RETURN);
  VALUE(RMP_STMT_WAIT_TIME);
  VALUE(RMP_STMT_WAIT_FOR);
  VALUE(RMP_STMT_PAUSE);
  VALUE(RMP_STMT_HALT);
  VALUE(RMP_STMT_MOVE);
  VALUE(RMP_STMT_START);
  VALUE(RMP_STMT_STOP);
  VALUE(RMP_STMT_CONTINUE);
  VALUE(RMP_STMT_CANCEL);
  VALUE(RMP_STMT_ENABLE);
  VALUE(RMP_STMT_DISABLE);
  VALUE(RMP_STMT_TEACH);
  TYPE(rmp_code_statement);
  FIELD(rmp_code_statement, op);
  FIELD(rmp_code_statement, next);
  FIELD(rmp_code_statement, a);
  FIELD(rmp_code_statement, b);
  FIELD(rmp_code_statement, c);
  FIELD(rmp_code_statement, body);
  FIELD(rmp_code_statement, symbol);
  FIELD(rmp_code_statement, motion);
  FIELD(rmp_code_statement, first);
  FIELD(rmp_code_statement, count);
  FIELD(rmp_code_statement, span);
  TYPE(rmp_interpolation);
  VALUE(RMP_MOVE_PTP);
  VALUE(RMP_MOVE_LIN);
  VALUE(RMP_MOVE_CIRCLE);
  VALUE(RMP_MOVE_PATH);
  TYPE(rmp_code_motion);
  FIELD(rmp_code_motion, interpolation);
  FIELD(rmp_code_motion, is_incremental);
  FIELD(rmp_code_motion, first_target);
  FIELD(rmp_code_motion, target_count);
  FIELD(rmp_code_motion, first_attribute);
  FIELD(rmp_code_motion, attribute_count);
  FIELD(rmp_code_motion, until);
  FIELD(rmp_code_motion, action);
  FIELD(rmp_code_motion, span);
  TYPE(rmp_motion_attribute);
  VALUE(RMP_ATTR_SPEED);
  VALUE(RMP_ATTR_SPEED_ORI);
  VALUE(RMP_ATTR_ACC);
  VALUE(RMP_ATTR_TIME);
  VALUE(RMP_ATTR_C_CP);
  VALUE(RMP_ATTR_C_SPEED);
  VALUE(RMP_ATTR_C_PASS);
  VALUE(RMP_ATTR_WOBBLE);
  VALUE(RMP_ATTR_ACT_ROB);
  VALUE(RMP_ATTR_DEVICE);
  VALUE(RMP_ATTR_ADAX_CONTROL);
  VALUE(RMP_ATTR_SPEED_PTP);
  VALUE(RMP_ATTR_ACC_PTP);
  VALUE(RMP_ATTR_C_PTP);
  VALUE(RMP_ATTR_TOOL);
  VALUE(RMP_ATTR_FRAME);
  TYPE(rmp_code_attribute);
  FIELD(rmp_code_attribute, attribute);
  FIELD(rmp_code_attribute, value);
  FIELD(rmp_code_attribute, span);
  TYPE(rmp_operand_kind);
  VALUE(RMP_OPERAND_NONE);
  VALUE(RMP_OPERAND_CONSTANT);
  VALUE(RMP_OPERAND_VARIABLE);
  VALUE(RMP_OPERAND_TEMPORARY);
  VALUE(RMP_OPERAND_REFERENCE);
  VALUE(RMP_OPERAND_LABEL);
  VALUE(RMP_OPERAND_ROUTINE);
  VALUE(RMP_OPERAND_NUMBER);
  VALUE(RMP_OPERAND_WORD);
  VALUE(RMP_OPERAND_INTRINSIC);
  TYPE(rmp_code_operand);
  FIELD(rmp_code_operand, kind);
  FIELD(rmp_code_operand, type);
  FIELD(rmp_code_operand, index);
  TYPE(rmp_instruction_op);
  VALUE(RMP_OP_COPY);
  VALUE(RMP_OP_CONVERT);
  VALUE(RMP_OP_NEGATE);
  VALUE(RMP_OP_NOT);
  VALUE(RMP_OP_ADD);
  VALUE(RMP_OP_SUBTRACT);
  VALUE(RMP_OP_MULTIPLY);
  VALUE(RMP_OP_DIVIDE);
  VALUE(RMP_OP_DIV);
  VALUE(RMP_OP_MOD);
  VALUE(RMP_OP_EQUAL);
  VALUE(RMP_OP_NOT_EQUAL);
  VALUE(RMP_OP_LESS);
  VALUE(RMP_OP_LESS_EQUAL);
  VALUE(RMP_OP_GREATER);
  VALUE(RMP_OP_GREATER_EQUAL);
  VALUE(RMP_OP_EXOR);
  VALUE(RMP_OP_COMPOSE);
  VALUE(RMP_OP_FIELD);
  VALUE(RMP_OP_ELEMENT);
  VALUE(RMP_OP_LOAD);
  VALUE(RMP_OP_STORE);
  VALUE(RMP_OP_ARGUMENT);
  VALUE(RMP_OP_ARGUMENT_PLACE);
  VALUE(RMP_OP_CALL);
  VALUE(RMP_OP_INTRINSIC);
  VALUE(RMP_OP_MAKE);
  VALUE(RMP_OP_LABEL);
  VALUE(RMP_OP_JUMP);
  VALUE(RMP_OP_JUMP_IF);
  VALUE(RMP_OP_JUMP_UNLESS);
  VALUE(RMP_OP_RETURN);
  VALUE(RMP_OP_WAIT_TIME);
  VALUE(RMP_OP_WAIT_BEGIN);
  VALUE(RMP_OP_WAIT_TEST);
  VALUE(RMP_OP_PAUSE);
  VALUE(RMP_OP_HALT);
  VALUE(RMP_OP_TARGET);
  VALUE(RMP_OP_ATTRIBUTE);
  VALUE(RMP_OP_UNTIL);
  VALUE(RMP_OP_UNTIL_TEST);
  VALUE(RMP_OP_MOVE);
  VALUE(RMP_OP_START);
  VALUE(RMP_OP_STOP);
  VALUE(RMP_OP_CONTINUE);
  VALUE(RMP_OP_CANCEL);
  VALUE(RMP_OP_ENABLE);
  VALUE(RMP_OP_DISABLE);
  VALUE(RMP_OP_INTERRUPT_TEST);
  VALUE(RMP_OP_TEACH);
  TYPE(rmp_code_instruction);
  FIELD(rmp_code_instruction, op);
  FIELD(rmp_code_instruction, a);
  FIELD(rmp_code_instruction, b);
  FIELD(rmp_code_instruction, r);
  FIELD(rmp_code_instruction, span);
  TYPE(rmp_code);
  FIELD(rmp_code, struct_size);
  FIELD(rmp_code, has_errors);
  FIELD(rmp_code, name);
  FIELD(rmp_code, files);
  FIELD(rmp_code, faults);
  FIELD(rmp_code, types);
  FIELD(rmp_code, fields);
  FIELD(rmp_code, constants);
  FIELD(rmp_code, scopes);
  FIELD(rmp_code, symbols);
  FIELD(rmp_code, routines);
  FIELD(rmp_code, expressions);
  FIELD(rmp_code, statements);
  FIELD(rmp_code, motions);
  FIELD(rmp_code, attributes);
  FIELD(rmp_code, links);
  FIELD(rmp_code, instructions);
  TYPE(ReaderFormat);
  FIELD(ReaderFormat, extension);
  FIELD(ReaderFormat, controller);
  TYPE(ProgramReaderTask);
  FIELD(ProgramReaderTask, struct_size);
  FIELD(ProgramReaderTask, files);
  TYPE(ReadFile);
  FIELD(ReadFile, name);
  FIELD(ReadFile, text);
  FIELD(ReadFile, room);
  TYPE(ReadLine);
  FIELD(ReadLine, irl_file);
  FIELD(ReadLine, irl_line);
  FIELD(ReadLine, file);
  FIELD(ReadLine, line);
  TYPE(ReadProgram);
  VIRTUAL(ReadProgram, extension);
  VIRTUAL(ReadProgram, files);
  VIRTUAL(ReadProgram, faults);
  VIRTUAL(ReadProgram, lines);
  TYPE(ProgramReader);
  VIRTUAL(ProgramReader, extension);
  VIRTUAL(ProgramReader, formats);
  VIRTUAL(ProgramReader, claims);
  VIRTUAL(ProgramReader, needs);
  VIRTUAL(ProgramReader, read);
  TYPE(ReaderOffers);
  VIRTUAL(ReaderOffers, extension);
  VIRTUAL(ReaderOffers, folders);
  VIRTUAL(ReaderOffers, offers);
  TYPE(SourceFile);
  FIELD(SourceFile, name);
  FIELD(SourceFile, text);
  FIELD(SourceFile, room);
  TYPE(GivenValue);
  FIELD(GivenValue, name);
  FIELD(GivenValue, field);
  FIELD(GivenValue, text);
  FIELD(GivenValue, room);
  TYPE(LanguageTask);
  FIELD(LanguageTask, struct_size);
  FIELD(LanguageTask, files);
  FIELD(LanguageTask, values);
  TYPE(CompiledProgram);
  VIRTUAL(CompiledProgram, extension);
  VIRTUAL(CompiledProgram, code);
  TYPE(Language);
  VIRTUAL(Language, extension);
  VIRTUAL(Language, extensions);
  VIRTUAL(Language, needs);
  VIRTUAL(Language, compile);
  TYPE(SourceTokenKind);
  VALUE(SourceTokenKind::keyword);
  VALUE(SourceTokenKind::unknown);
  TYPE(SourceCase);
  VALUE(SourceCase::lower);
  TYPE(SourceRange);
  FIELD(SourceRange, file);
  FIELD(SourceRange, begin);
  FIELD(SourceRange, end);
  TYPE(SourceToken);
  FIELD(SourceToken, kind);
  FIELD(SourceToken, begin);
  FIELD(SourceToken, end);
  FIELD(SourceToken, is_declaration);
  FIELD(SourceToken, is_predefined);
  FIELD(SourceToken, room);
  TYPE(SourceCompletion);
  FIELD(SourceCompletion, label);
  FIELD(SourceCompletion, insert);
  FIELD(SourceCompletion, detail);
  FIELD(SourceCompletion, doc);
  FIELD(SourceCompletion, kind);
  FIELD(SourceCompletion, begin);
  FIELD(SourceCompletion, end);
  FIELD(SourceCompletion, rank);
  FIELD(SourceCompletion, room);
  TYPE(SourceHover);
  FIELD(SourceHover, range);
  FIELD(SourceHover, detail);
  FIELD(SourceHover, doc);
  FIELD(SourceHover, room);
  TYPE(SourceReference);
  FIELD(SourceReference, range);
  FIELD(SourceReference, is_declaration);
  FIELD(SourceReference, room);
  TYPE(SourceEdit);
  FIELD(SourceEdit, range);
  FIELD(SourceEdit, text);
  FIELD(SourceEdit, room);
  TYPE(SourceSymbol);
  FIELD(SourceSymbol, name);
  FIELD(SourceSymbol, detail);
  FIELD(SourceSymbol, kind);
  FIELD(SourceSymbol, parent);
  FIELD(SourceSymbol, begin);
  FIELD(SourceSymbol, end);
  FIELD(SourceSymbol, name_begin);
  FIELD(SourceSymbol, name_end);
  FIELD(SourceSymbol, room);
  TYPE(SourceSignature);
  FIELD(SourceSignature, label);
  FIELD(SourceSignature, doc);
  FIELD(SourceSignature, parameters);
  FIELD(SourceSignature, active);
  FIELD(SourceSignature, room);
  TYPE(SourceFault);
  FIELD(SourceFault, severity);
  FIELD(SourceFault, range);
  FIELD(SourceFault, message);
  FIELD(SourceFault, hint);
  FIELD(SourceFault, room);
  TYPE(SourceLayout);
  FIELD(SourceLayout, struct_size);
  FIELD(SourceLayout, indent);
  FIELD(SourceLayout, words);
  TYPE(EditedProgram);
  VIRTUAL(EditedProgram, extension);
  VIRTUAL(EditedProgram, faults);
  VIRTUAL(EditedProgram, tokens);
  VIRTUAL(EditedProgram, complete);
  VIRTUAL(EditedProgram, hover);
  VIRTUAL(EditedProgram, definition);
  VIRTUAL(EditedProgram, references);
  VIRTUAL(EditedProgram, rename);
  VIRTUAL(EditedProgram, format);
  VIRTUAL(EditedProgram, outline);
  VIRTUAL(EditedProgram, signature);
  VIRTUAL(EditedProgram, folds);
  TYPE(LanguageEditing);
  VIRTUAL(LanguageEditing, extension);
  VIRTUAL(LanguageEditing, open);
}

void post_types(std::ostringstream& out) {
  TYPE(PostFeature);
  TYPE(PostMotions);
  TYPE(PostCircle);
  TYPE(PostBlending);
  TYPE(PostSpeed);
  TYPE(PostCase);
  TYPE(PostCharset);
  TYPE(PostForm);
  TYPE(PostStatus);
  TYPE(PostAxisOrigin);
  VALUE(PostCircle::none);
  VALUE(PostCircle::via);
  VALUE(PostCircle::centre);
  VALUE(PostBlending::none);
  VALUE(PostBlending::distance);
  VALUE(PostBlending::percent);
  VALUE(PostBlending::radius);
  VALUE(PostBlending::zone);
  VALUE(PostBlending::accuracy);
  VALUE(PostSpeed::mm_per_s);
  VALUE(PostSpeed::m_per_s);
  VALUE(PostSpeed::mm_per_min);
  VALUE(PostSpeed::percent);
  VALUE(PostSpeed::time);
  VALUE(PostCase::kept);
  VALUE(PostCase::upper);
  VALUE(PostCase::lower);
  VALUE(PostCharset::ascii);
  VALUE(PostCharset::latin1);
  VALUE(PostCharset::utf8);
  VALUE(kPostProcedures);
  VALUE(kPostFunctions);
  VALUE(kPostParameters);
  VALUE(kPostOutParameters);
  VALUE(kPostRecursion);
  VALUE(kPostLocals);
  VALUE(kPostIntegers);
  VALUE(kPostReals);
  VALUE(kPostBooleans);
  VALUE(kPostStrings);
  VALUE(kPostArrays);
  VALUE(kPostRecords);
  VALUE(kPostPoses);
  VALUE(kPostPoseProduct);
  VALUE(kPostJointValues);
  VALUE(kPostFunctionsOfMath);
  VALUE(kPostIf);
  VALUE(kPostElsif);
  VALUE(kPostWhile);
  VALUE(kPostRepeat);
  VALUE(kPostLoop);
  VALUE(kPostExit);
  VALUE(kPostFor);
  VALUE(kPostForStep);
  VALUE(kPostCase);
  VALUE(kPostGoto);
  VALUE(kPostReturn);
  VALUE(kPostProcesses);
  VALUE(kPostInterrupts);
  VALUE(kPostWaitFor);
  VALUE(kPostWaitTimeout);
  VALUE(kPostUntil);
  VALUE(kPostVariableTargets);
  VALUE(kPostVariableAttributes);
  VALUE(kPostMessages);
  VALUE(kPostFiles);
  VALUE(kPostLists);
  VALUE(kPostPause);
  VALUE(kPostOutputsAreRead);
  VALUE(kPostTools);
  VALUE(kPostFrames);
  VALUE(kPostTime);
  VALUE(kPostTeach);
  VALUE(kPostShortCircuit);
  VALUE(kPostParts);
  VALUE(kPostPtpJoints);
  VALUE(kPostPtpPose);
  VALUE(kPostLinPose);
  VALUE(kPostLinJoints);
  VALUE(kPostCircle);
  VALUE(kPostPath);
  VALUE(kPostPtpIncrement);
  VALUE(kPostLinIncrement);
  VALUE(kPostStructured);
  VALUE(kPostFlat);
  VALUE(kPostShoulderBehind);
  VALUE(kPostElbowOther);
  VALUE(kPostWristFlipped);
  VALUE(PostAxisOrigin::not_known);
  VALUE(PostAxisOrigin::profile);
  VALUE(PostAxisOrigin::robot);
  TYPE(PostCapabilities);
  FIELD(PostCapabilities, struct_size);
  FIELD(PostCapabilities, forms);
  FIELD(PostCapabilities, features);
  FIELD(PostCapabilities, motions);
  FIELD(PostCapabilities, circle);
  FIELD(PostCapabilities, blending);
  FIELD(PostCapabilities, speed);
  FIELD(PostCapabilities, external_axes);
  FIELD(PostCapabilities, max_name);
  FIELD(PostCapabilities, name_case);
  FIELD(PostCapabilities, case_matters);
  FIELD(PostCapabilities, charset);
  FIELD(PostCapabilities, crlf);
  FIELD(PostCapabilities, max_points);
  FIELD(PostCapabilities, max_lines);
  FIELD(PostCapabilities, max_nesting);
  FIELD(PostCapabilities, reserved);
  FIELD(PostCapabilities, extensions);
  FIELD(PostCapabilities, title);
  TYPE(PostPoint);
  FIELD(PostPoint, expression);
  FIELD(PostPoint, motion);
  FIELD(PostPoint, role);
  FIELD(PostPoint, pose);
  FIELD(PostPoint, q);
  FIELD(PostPoint, external);
  FIELD(PostPoint, status);
  FIELD(PostPoint, status_known);
  FIELD(PostPoint, has_pose);
  FIELD(PostPoint, has_status);
  FIELD(PostPoint, q_missing);
  FIELD(PostPoint, turns);
  FIELD(PostPoint, turns_first);
  FIELD(PostPoint, turns_from);
  FIELD(PostPoint, room);
  TYPE(PostAxis);
  FIELD(PostAxis, name);
  FIELD(PostAxis, joint);
  FIELD(PostAxis, external);
  FIELD(PostAxis, linear);
  FIELD(PostAxis, sign);
  FIELD(PostAxis, offset);
  FIELD(PostAxis, pulses);
  FIELD(PostAxis, lower);
  FIELD(PostAxis, upper);
  FIELD(PostAxis, coupled);
  FIELD(PostAxis, origin);
  FIELD(PostAxis, of_robot);
  FIELD(PostAxis, room);
  TYPE(PostSignal);
  FIELD(PostSignal, name);
  FIELD(PostSignal, target);
  FIELD(PostSignal, number);
  FIELD(PostSignal, kind);
  FIELD(PostSignal, inverted);
  FIELD(PostSignal, room);
  TYPE(PostPlace);
  FIELD(PostPlace, name);
  FIELD(PostPlace, number);
  FIELD(PostPlace, pose);
  FIELD(PostPlace, mass);
  FIELD(PostPlace, com);
  FIELD(PostPlace, room);
  TYPE(PostOption);
  FIELD(PostOption, name);
  FIELD(PostOption, value);
  FIELD(PostOption, room);
  TYPE(PostProfile);
  FIELD(PostProfile, struct_size);
  FIELD(PostProfile, name);
  FIELD(PostProfile, axes);
  FIELD(PostProfile, signals);
  FIELD(PostProfile, tools);
  FIELD(PostProfile, frames);
  FIELD(PostProfile, tool);
  FIELD(PostProfile, frame);
  FIELD(PostProfile, prologue);
  FIELD(PostProfile, epilogue);
  FIELD(PostProfile, length_digits);
  FIELD(PostProfile, angle_digits);
  FIELD(PostProfile, speed_digits);
  FIELD(PostProfile, max_points);
  FIELD(PostProfile, max_lines);
  FIELD(PostProfile, max_bytes);
  FIELD(PostProfile, max_speed);
  FIELD(PostProfile, max_speed_ori);
  FIELD(PostProfile, options);
  TYPE(PostTask);
  FIELD(PostTask, struct_size);
  FIELD(PostTask, code);
  FIELD(PostTask, form);
  FIELD(PostTask, name);
  FIELD(PostTask, points);
  FIELD(PostTask, robot);
  FIELD(PostTask, kinematics);
  FIELD(PostTask, profile);
  FIELD(PostTask, axes_are_unknown);
  TYPE(PostKinematics);
  VIRTUAL(PostKinematics, extension);
  VIRTUAL(PostKinematics, forward);
  VIRTUAL(PostKinematics, inverse);
  VIRTUAL(PostKinematics, status);
  TYPE(PostOutput);
  VIRTUAL(PostOutput, extension);
  VIRTUAL(PostOutput, file);
  VIRTUAL(PostOutput, from);
  VIRTUAL(PostOutput, fault);
  TYPE(Post);
  VIRTUAL(Post, extension);
  VIRTUAL(Post, capabilities);
  VIRTUAL(Post, write);
}

std::string layout_now() {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "sdk_abi " << RMP_SDK_ABI << "\n";
  plain_types(out);
  picture_types(out);
  interfaces(out);
  enumerators(out);
  module_types(out);
  programs(out);
  post_types(out);
  return out.str();
}

std::string read_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The first line that differs, for the message.
std::string first_difference(const std::string& golden, const std::string& now) {
  std::istringstream a(golden), b(now);
  std::string x, y, type;
  for (;;) {
    const bool more_a = static_cast<bool>(std::getline(a, x)),
               more_b = static_cast<bool>(std::getline(b, y));
    if (!more_a && !more_b) return "none";
    if (!more_a) x = "(nothing)";
    if (!more_b) y = "(nothing)";
    if (x != y) return "in " + type + ": was \"" + x + "\", is \"" + y + "\"";
    if (!x.empty() && x[0] != ' ') type = x.substr(0, x.find(' '));
  }
}

TEST(SdkLayout, IsTheOneThatReleasedPluginsWereBuiltFor) {
  const fs::path file = fs::path(ROBOMOSP_SOURCE_DIR) / "tests/abi/layout.txt";
  const std::string now = layout_now(), golden = read_file(file);
  if (std::getenv("ROBOMOSP_UPDATE_GOLDEN")) {
    std::ofstream(file, std::ios::binary) << now;
    GTEST_SKIP() << "written anew";
  }
  EXPECT_EQ(golden, now)
      << "The layout of the SDK changed (" << first_difference(golden, now)
      << "). Plugins stay in the field: let structs with struct_size grow at their end, elements "
         "of "
         "arrays in their room, interfaces through extension(). Functions that change take the "
         "next "
         "number of their interface, and the number before an adapter "
         "(kernel/interface_adapters.cpp) with its headers in tests/abi/frozen; only a change of "
         "what all share raises RMP_SDK_ABI. Then run this test with ROBOMOSP_UPDATE_GOLDEN=1 and "
         "commit tests/abi/layout.txt with the change.";
}

TEST(SdkLayout, CoversEveryTypeOfTheHeaders) {
  const std::string now = layout_now();
  const std::regex declaration(
      R"(^\s*(?:typedef )?(?:struct|class|enum class|enum)\s+(\w+)[^;<]*\{)");
  std::set<std::string> seen;
  for (const auto& entry :
       fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "sdk/include/robomosp/sdk")) {
    // Helpers that are inline only and cross no boundary.
    static const std::set<std::string> kInlineOnly{"csg_check.h",
                                                   "eigen.h",
                                                   "host.h",
                                                   "names.h",
                                                   "utf8_text.h",
                                                   "model_file.h",
                                                   "post_lines.h",
                                                   "post_names.h",
                                                   "post_constructs.h",
                                                   "post_numbers.h",
                                                   "post_orientations.h",
                                                   "post_writer.h",
                                                   "program_numbers.h",
                                                   "program_tables.h",
                                                   "program_turns.h"};
    if (!entry.is_regular_file() || kInlineOnly.contains(entry.path().filename().string()))
      continue;
    std::istringstream lines(read_file(entry.path()));
    std::smatch match;
    for (std::string line; std::getline(lines, line);) {
      if (!std::regex_search(line, match, declaration)) continue;
      const std::string name = match[1];
      seen.insert(name);
      const bool listed = std::regex_search(now, std::regex("(^|\n)(\\w+::)?" + name + " size "));
      EXPECT_TRUE(listed) << name << " of " << entry.path().filename()
                          << " is missing from tests/abi/layout_test.cpp";
    }
  }
  EXPECT_GT(seen.size(), 50U);
}

/// Every interface can be extended at the same place, so that a host may ask objects of any.
TEST(SdkLayout, EveryInterfaceHasItsExtensionBehindTheDestructor) {
  std::istringstream lines(layout_now());
  std::string type;
  bool is_new = false;
  int classes = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line[0] != ' ') {
      type = line.substr(0, line.find(' '));
      is_new = true;
      continue;
    }
    if (!line.starts_with("  virtual ")) continue;
    if (is_new) {
      EXPECT_EQ(line, "  virtual extension slot 2") << type;
      ++classes;
    }
    is_new = false;
  }
  EXPECT_GT(classes, 30);
}

TEST(SdkLayout, VirtualFunctionsFollowTheDestructorInOrderOfDeclaration) {
  // Two slots of the destructor come first (Itanium C++ ABI); then extension, prepare, solve.
  EXPECT_EQ(slot(&IkSolver::extension), 2U);
  EXPECT_EQ(slot(&IkSolver::prepare), 3U);
  EXPECT_EQ(slot(&IkSolver::solve), 4U);
}

}  // namespace
}  // namespace robomosp

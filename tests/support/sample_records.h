// SPDX-License-Identifier: Apache-2.0
// Records of every kind with something in every field, in a document with all that they refer to.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "document/document.h"
#include "io/geometry.h"
#include "model/declare.h"
#include "model/parametric.h"
#include "model/program.h"

namespace robomosp::test {

struct SampleRecords {
  document::Document document;
  std::vector<AnyId> ids;       ///< of what the tests change
  std::vector<AnyId> programs;  ///< that the world may run
  MaterialId steel, brass;
  SolidId ball, block;
  ObjectId pair, inner;
  RobotId arm, closed, counted;
  TrajectoryId stroke, other_stroke, third_stroke;
  TaskId job, other_job, third_job;
  WorldId cell;

  template <class R>
  Id<model::kind_of<R>> add(document::Transaction& tx, const std::string& name, R content) {
    const auto id = tx.add(name, std::move(content));
    EXPECT_TRUE(id.ok()) << (id.ok() ? "" : id.error().sentence());
    if (!id.ok()) return {};
    ids.push_back(*id);
    return *id;
  }

  SampleRecords() {
    using namespace model;
    auto tx = document.begin("samples");
    steel = add(*tx, "steel", a_material());
    brass = add(*tx, "brass", Material{});
    ball = add(*tx, "ball", a_solid());
    Solid plain;
    plain.nodes.push_back({CsgKind::box, "box", -1, {}, {1, 1, 1}});
    block = add(*tx, "block", plain);
    Object small;
    small.parts.push_back({"block", block, {}, {}});
    inner = add(*tx, "inner", small);
    pair = add(*tx, "pair", an_object());
    arm = add(*tx, "arm", a_robot());
    closed = add(*tx, "closed", a_closed_robot());
    counted = add(*tx, "counted", a_counted_robot());
    Trajectory line;
    line.segments.push_back(a_line());
    other_stroke = add(*tx, "other_stroke", line);
    third_stroke = add(*tx, "third_stroke", line);
    stroke = add(*tx, "stroke", a_trajectory());
    other_job = add(*tx, "other_job", Task{});
    third_job = add(*tx, "third_job", Task{});
    job = add(*tx, "job", a_task());
    const Kind program = register_kind_of<Program>("program", ".prg", "programs");
    for (const char* name : {"carry", "rest"}) {
      Record r;
      r.name = name;
      r.body = OtherContent(program, Program{});
      const auto id = tx->add(std::move(r));
      EXPECT_TRUE(id.ok()) << (id.ok() ? "" : id.error().sentence());
      if (id.ok()) programs.push_back(*id);
    }
    cell = add(*tx, "cell", a_world());
    const auto commit = tx->commit();
    EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
  }

  static model::Placement turned() {
    model::Placement p;
    p.position = {0.1, 0.2, 0.3};
    p.angles = {0.4, 0.5, 0.6};
    return p;
  }
  static MassProperties a_mass() { return {2, {0.1, 0.2, 0.3}, {0.3, 0.4, 0.5, 0.01, 0.02, 0.03}}; }
  static model::ProviderChoice a_choice(const std::string& name) {
    model::ProviderChoice c{name, {}};
    c.params["gain"] = 0.5;
    c.params["steps"] = std::int64_t{5};
    c.params["mode"] = std::string("quick");
    c.params["is_on"] = true;
    c.params["weights"] = std::vector<double>{0.5, 0.25};
    return c;
  }
  static model::Parametric parameters(const std::string& path,
                                      const std::string& expression = "bore/2") {
    model::Parametric p;
    p.parameters = {{"bore", "", "m", 0.5, "of the hole"},
                    {"half", "bore/2", "m", 0.25, ""},
                    {"unused", "", "m", 1, ""}};
    p.expressions[path] = expression;
    return p;
  }

  static model::Material a_material() {
    model::Material m;
    m.description = "plain";
    m.source = "a book";
    m.density = 7850;
    m.ambient = Colour{0.1F, 0.2F, 0.3F, 1};
    m.specular = Colour{0.4F, 0.2F, 0.3F, 1};
    m.parametric = parameters("shininess", "bore / (2 m)");
    m.shininess = 0.25;
    return m;
  }
  [[nodiscard]] model::Solid a_solid() const {
    using namespace model;
    Solid s;
    s.description = "all kinds of nodes";
    s.material = steel;
    s.parametric = parameters("box.x");
    s.measured = MeasuredMass{a_mass(), "scales"};
    s.nodes.push_back({CsgKind::union_, "all", -1, turned(), {}});
    s.nodes.push_back({CsgKind::box, "box", 0, turned(), {0.25, 0.5, 0.5, 0.01}});
    s.nodes.back().is_centred = true;
    s.nodes.push_back({CsgKind::fillet, "round", 0, {}, {0.01}});
    s.nodes.back().select = "top";
    s.nodes.push_back({CsgKind::sphere, "knob", 2, {}, {0.3}});
    s.nodes.push_back({CsgKind::union_, "group", 0, {}, {}});
    s.nodes.push_back({CsgKind::sphere, "left", 4, {}, {0.3}});
    s.nodes.push_back({CsgKind::sphere, "right", 4, {}, {0.3}});
    auto profile = std::make_shared<CsgProfile>();
    CsgLoop outline;
    outline.start = {1, 0};
    outline.curves = {{CsgCurve::Kind::line, {{2, 0}}},
                      {CsgCurve::Kind::arc, {{2.5, 0.5}, {2, 1}}},
                      {CsgCurve::Kind::spline, {{1.5, 1.25}, {1, 1}}}};
    CsgLoop hole;
    hole.curves = {{CsgCurve::Kind::circle, {{1.5, 0.5}, {0.2, 0}}}};
    profile->loops = {outline, hole};
    s.nodes.push_back({CsgKind::prism, "plate", 0, {}, {0.5}, profile});
    s.nodes.push_back({CsgKind::custom, "gear", 0, {}, {}});
    s.nodes.back().primitive = a_choice("gear");
    CsgGeometry brep;
    brep.brep = "DBRep_DrawableShape\n\nCASCADE Topology V1, (c) Matra-Datavision\n";
    brep.source = "part.step";
    auto geometry = io::make_geometry(brep);
    EXPECT_TRUE(geometry.ok());
    s.nodes.push_back({CsgKind::imported, "housing", 0, {}, {1}});
    if (geometry.ok()) s.nodes.back().geometry = *geometry;
    return s;
  }
  [[nodiscard]] model::Object an_object() const {
    using namespace model;
    Object o;
    o.description = "two";
    o.parametric = parameters("left.position.x");
    o.measured = MeasuredMass{a_mass(), "scales"};
    o.parts.push_back({"left", ball, turned(), brass});
    o.parts.back().placement.position[0] = 0.25;
    o.parts.push_back({"right", inner, turned(), {}});
    o.tcps.push_back({"tip", turned()});
    return o;
  }
  [[nodiscard]] model::Robot a_robot() const {
    using namespace model;
    Robot r;
    r.description = "three joints";
    r.source = "a data sheet";
    r.parametric = parameters("upper.a");
    r.base = turned();
    r.base_parts = {{ball, turned()}};
    r.base_mass = a_mass();
    Link lower;
    lower.name = "lower";
    lower.row = {0.1, 0.2, 0.3, 0.4};
    lower.convention = Convention::mdh;
    lower.lower = -2;
    lower.upper = 2;
    lower.max_velocity = 2;
    lower.max_acceleration = 4;
    lower.max_jerk = 8;
    lower.max_force = 16;
    lower.drive = {0.001, 50, 0.01, 0.2, -0.3};
    lower.spring = {10, 0.1};
    lower.given = a_mass();
    lower.parts = {{ball, turned()}, {pair, turned()}};
    Link upper = lower;
    upper.name = "upper";
    upper.parent = 0;
    upper.row.a = 0.25;
    Link slide;
    slide.name = "slide";
    slide.parent = 1;
    slide.joint = JointKind::prismatic;
    slide.origin = turned();
    slide.axis = {0, 1, 0};
    slide.mimic = Mimic{0, 0.5, 0.1};
    r.links = {lower, upper, slide};
    r.tool = turned();
    r.payload = a_mass();
    r.tools = {{"camera", 1, turned(), a_mass()}};
    r.attached = {{"torch", pair, 2, turned()}, {"lamp", ball, 0, turned()}};
    r.tcp = "torch.tip";
    r.poses = {{"home", {0.1, 0.2}}};  // the following joint has no independent coordinate
    r.pair_rules = {{"lower", "slide", true, "far apart"}, {"base", "upper", false, ""}};
    r.ik = a_choice("numeric");
    r.inverse_dynamics = a_choice("newton_euler");
    r.forward_dynamics = a_choice("articulated");
    r.controller = a_choice("computed_torque");
    return r;
  }
  [[nodiscard]] static model::Robot a_closed_robot() {
    using namespace model;
    Robot r;
    r.convention = Convention::mdh;
    Link crank;
    crank.name = "crank";
    Link rocker;
    rocker.name = "rocker";
    rocker.passive = true;
    rocker.visible = false;
    r.links = {crank, rocker};
    r.loops = {{"pin", LoopKind::planar, 0, 1, turned(), turned()}};
    return r;
  }
  /// With axes of its maker.
  [[nodiscard]] static model::Robot a_counted_robot() {
    using namespace model;
    Robot r;
    for (const char* name : {"waist", "shoulder", "elbow", "wrist"}) {
      Link l;
      l.name = name;
      l.parent = static_cast<std::int32_t>(r.links.size()) - 1;
      r.links.push_back(l);
    }
    r.axes = {{"A1", 0, -1, 0.5, {{1, 0.75}}, AxisUnit::deg, true, -2.5, 2.5}};
    return r;
  }
  static model::TrajectorySegment a_line() {
    model::TrajectorySegment s;
    s.shape = a_choice("line");
    s.points = {turned(), {}};
    return s;
  }
  [[nodiscard]] model::Trajectory a_trajectory() const {
    using namespace model;
    Trajectory t;
    t.description = "three segments";
    t.parametric = parameters("segments.1.points.1.position.x");
    t.segments.push_back(a_line());
    t.segments.back().points[0].position[0] = 0.25;
    t.segments.back().law = a_choice("trapezoidal");
    t.segments.back().orientation = a_choice("slerp");
    t.segments.back().turning = a_choice("quintic");
    TrajectorySegment again;
    again.stored = other_stroke;
    again.placement = turned();
    again.transition = {true, 0.01, 0.1};
    t.segments.push_back(again);
    TrajectorySegment move;
    move.shape = a_choice("ptp");
    move.joints = {{0.1, 0.2}, {0.3, 0.4}};
    t.segments.push_back(move);
    EdgePath along;
    along.solid = block;
    along.edges = {2, 1};
    along.is_reversed = true;
    along.from = {0.25, 0, 1};
    along.tilt = 0.1, along.lead = 0.2, along.stand_off = 0.01;
    along.lead_in = 0.02, along.lead_out = 0.03, along.approach = 0.04, along.retract = 0.05;
    along.speed = 0.5, along.travel_speed = 0.6, along.acceleration = 0.7, along.chord = 0.001;
    t.along = along;
    return t;
  }
  [[nodiscard]] model::Task a_task() const {
    using namespace model;
    Task t;
    t.description = "all kinds of steps";
    t.parametric = parameters("steps.4.target.position.x");
    const auto step = [&t](StepKind kind, std::int32_t parent = -1) -> TaskStep& {
      TaskStep& s = t.steps.emplace_back();
      s.kind = kind;
      s.parent = parent;
      return s;
    };
    step(StepKind::repeat).count = 3;
    step(StepKind::message, 0).text = "again";
    step(StepKind::message).text = "done";
    TaskStep& follow = step(StepKind::move);
    follow.robot = "arm";
    follow.trajectory = stroke;
    follow.target = turned();
    follow.target->position[0] = 0.25;
    follow.frame = "table";
    follow.link = "camera";
    TaskStep& pose = step(StepKind::move);
    pose.pose = "home";
    pose.profile = "trapezoidal";
    pose.speed = 0.5;
    pose.duration = 2;
    step(StepKind::move).joints = {0.1, 0.2};
    TaskStep& straight = step(StepKind::move);
    straight.target = turned();
    straight.is_straight = true;
    straight.tool_speed = 0.1;
    step(StepKind::attach).object = "part";
    t.steps.back().link = "camera";
    t.steps.back().tcp = "tip";
    step(StepKind::detach).object = "part";
    step(StepKind::set).signal = "open";
    t.steps.back().expression = "1";
    step(StepKind::wait).duration = 0.5;
    step(StepKind::wait).expression = "open > 0";
    t.steps.back().timeout = 3;
    step(StepKind::call).task = other_job;
    const auto when = static_cast<std::int32_t>(t.steps.size());
    step(StepKind::when).expression = "open > 0";
    step(StepKind::message, when).text = "open";
    step(StepKind::otherwise);
    step(StepKind::message, when + 2).text = "shut";
    return t;
  }
  [[nodiscard]] model::World a_world() const {
    using namespace model;
    World w;
    w.description = "a cell";
    w.parametric = parameters("part.position.x");
    w.objects = {{"part", ball, turned()}, {"rack", pair, turned()}};
    w.objects[0].placement.position[0] = 0.25;
    w.robots = {{"arm", arm, turned(), {0.1, 0.2}},
                {"spare", closed, {}, {}, BaseKind::serpentine, "drive"}};
    w.trajectories = {{"stroke", stroke, turned()}, {"drive", stroke, {}}};
    w.frames = {{"table", turned()}};
    w.lights = {{"lamp", LightKind::spot, turned(), {0.5F, 0.25F, 0.125F, 1}, 2, 0.75}};
    w.tasks = {{"job", job, "arm"}};
    ProgramBinding binding;
    binding.kind = BindingKind::point;
    binding.name = "place";
    w.programs = {{"carry", programs.front(), "arm", {binding}}};
    w.signals = {{"open", SignalKind::digital, "", 1, "arm", "rack", "of the gripper"},
                 {"level", SignalKind::analogue, "m", 0.5, "", "", ""}};
    w.attachments = {{"part", "arm", "camera", turned()}};
    w.pair_rules = {{"part", "rack", true, "side by side"}};
    return w;
  }
};

}  // namespace robomosp::test

// SPDX-License-Identifier: Apache-2.0
// Points and numbers of programs that follow objects, frames and parameters of a world, down to
// posted code.
#include <cmath>
#include <filesystem>
#include <numbers>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class ProgramPoints : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    arm_ = call("robot.get", {{"name", std::string("ur5")}});
    cell_ = call("world.create", {{"name", std::string("cell")}});
    call("world.add_robot", {{"id", cell_}, {"robot", arm_}, {"name", std::string("ur5")}});
    const Map bore{{"kind", std::string("cylinder")},
                   {"name", std::string("bore")},
                   {"radius", std::string("bore/2")},
                   {"height", std::string("height + 2 mm")},
                   {"position", List{0.03, 0.01, std::string("-1 mm")}}};
    const Map body{{"kind", std::string("box")},
                   {"name", std::string("body")},
                   {"x", 0.2},
                   {"y", 0.15},
                   {"z", std::string("height")}};
    block_ =
        call("solid.create",
             {{"name", std::string("housing")},
              {"parameters", Map{{"height", std::string("60 mm")}, {"bore", std::string("40 mm")}}},
              {"root", Map{{"kind", std::string("difference")}, {"children", List{body, bore}}}}});
    // Turned by 90 degrees: the block's x is the world's y.
    call("world.add_object", {{"id", cell_},
                              {"what", block_},
                              {"name", std::string("housing")},
                              {"position", List{0.5, 0.1, 0.05}},
                              {"rpy", List{0.0, 0.0, std::numbers::pi / 2}}});
  }
  Value put(const std::string& declarations, const std::string& body = {}) {
    const Value p =
        call("program.create",
             {{"name", "job" + std::to_string(++made_)},
              {"source", "PROGRAM job;\n" + declarations + "BEGIN\n" + body + "ENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", p}});
    return p;
  }
  void bind(const Value& p, Map args) {
    args.set("id", p);
    call("program.bind", args);
  }
  std::string refused(const Value& p, Map args) {
    args.set("id", p);
    return fails("program.bind", args).sentence();
  }
  std::string posted(const Value& p, const std::string& target = "krl") {
    const Value out = call("program.post", {{"id", p}, {"target", target}});
    std::string all;
    for (const Value& f : *out.as_map()->find("files")->as_list())
      all += *f.as_map()->find("text")->as_string();
    return all;
  }
  /// x, y, z, A, B, C of a point of the .dat file.
  static std::vector<double> krl_point(const std::string& code, const std::string& name) {
    const std::regex line("X" + name +
                              R"(=\{X ([-+0-9.eE]+),Y ([-+0-9.eE]+),Z ([-+0-9.eE]+),)"
                              R"(A ([-+0-9.eE]+),B ([-+0-9.eE]+),C ([-+0-9.eE]+))",
                          std::regex::icase);
    std::smatch m;
    std::vector<double> out;
    if (std::regex_search(code, m, line))
      for (std::size_t i = 1; i < m.size(); ++i) out.push_back(std::stod(m[i]));
    return out;
  }
  void parameter(const char* name, const char* value) {
    call("solid.set_parameter",
         {{"id", block_}, {"name", std::string(name)}, {"value", std::string(value)}});
  }
  const std::string kRing =
      "CONST\n  REAL: RADIUS := 1.0;\nVAR\n  POSE: ring := POSE(POSITION(1.0, 2.0, 3.0), "
      "ORIZYX(0.0, 180.0, 0.0));\n";
  const std::string kMoves =
      "  MOVE PTP ring;\n  MOVE LIN ring @ POSE(POSITION(RADIUS, 0.0, "
      "0.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := 50.0;\n";
  Value arm_, cell_, block_;
  int made_ = 0;
};

TEST_F(ProgramPoints, AParameterCarriesThroughToPostedCodeAndBack) {
  const Value p = put(kRing, kMoves);
  const std::string unbound = posted(p);
  bind(p, {{"kind", std::string("point")},
           {"name", std::string("ring")},
           {"to", std::string("housing")},
           {"at", std::string("bore")},
           {"position", List{0.0, 0.0, std::string("height + 1 mm")}},
           {"rpy", List{std::string("180 deg"), 0.0, 0.0}}});
  bind(p, {{"kind", std::string("value")},
           {"name", std::string("radius")},
           {"to", std::string("housing")},
           {"expression", std::string("bore/2 + 4 mm")}});
  const std::string before = posted(p);
  EXPECT_NE(before, unbound);
  // By hand: the bore is at (30, 10) of the block, whose x is the world's y, 500 and 100 mm away;
  // its floor is 1 mm under the block, which stands at 50.
  auto ring = krl_point(before, "ring");
  ASSERT_EQ(ring.size(), 6U) << before;
  EXPECT_NEAR(ring[0], 500 - 10, 1e-6);
  EXPECT_NEAR(ring[1], 100 + 30, 1e-6);
  EXPECT_NEAR(ring[2], 50 - 1 + 60 + 1, 1e-6);
  parameter("bore", "50 mm");
  parameter("height", "80 mm");
  const std::string after = posted(p);
  EXPECT_NE(after, before);
  ring = krl_point(after, "ring");
  EXPECT_NEAR(ring[0], 490, 1e-6);
  EXPECT_NEAR(ring[2], 130, 1e-6);
  // What runs is what is posted.
  const Value run = call("program.check_run", {{"id", p}, {"contacts", false}});
  const NumericArray& end =
      *run.as_map()->find("motions")->as_list()->back().as_map()->find("end")->as_array();
  // The tool's x after half a turn about x is the block's, which is the world's y.
  EXPECT_NEAR(end[0], 0.490, 1e-6);
  EXPECT_NEAR(end[1], 0.130 + 0.029, 1e-6);
  EXPECT_NEAR(end[2], 0.130, 1e-6);
  call("document.undo", {});
  call("document.undo", {});
  EXPECT_EQ(posted(p), before);
  call("program.unbind", {{"id", p}, {"name", std::string("ring")}});
  call("program.unbind", {{"id", p}, {"name", std::string("radius")}});
  EXPECT_EQ(posted(p), unbound);
}

TEST_F(ProgramPoints, FeaturesCentrePointsPartsAndFramesArePlaces) {
  const Value p =
      put("VAR\n  POSE: ring := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));\n",
          "  MOVE PTP ring;\n");
  const auto at = [&](const char* to, const char* what) {
    Map args{
        {"kind", std::string("point")}, {"name", std::string("ring")}, {"to", std::string(to)}};
    if (*what) args.set("at", Value(std::string(what)));
    bind(p, args);
    return krl_point(posted(p), "ring");
  };
  // The block's own frame: at its corner or middle, as boxes have it; turned by 90 degrees.
  auto q = at("housing", "");
  ASSERT_EQ(q.size(), 6U);
  EXPECT_NEAR(q[0], 500, 1e-6);
  EXPECT_NEAR(q[1], 100, 1e-6);
  EXPECT_NEAR(q[2], 50, 1e-6);
  EXPECT_NEAR(q[3], 90, 1e-6);
  // The hole's wall: amid its axis, which stands upright.
  q = at("housing", "hole");
  EXPECT_NEAR(q[0], 490, 1e-6);
  EXPECT_NEAR(q[1], 130, 1e-6);
  // A frame of the world, whose numbers may be expressions over its parameters.
  call("world.set_parameter",
       {{"id", cell_}, {"name", std::string("lift")}, {"value", std::string("70 mm")}});
  call("world.add_frame", {{"id", cell_},
                           {"name", std::string("bench")},
                           {"position", List{0.3, 0.2, std::string("lift")}}});
  q = at("bench", "");
  EXPECT_NEAR(q[0], 300, 1e-6);
  EXPECT_NEAR(q[2], 70, 1e-6);
  call("world.set_parameter",
       {{"id", cell_}, {"name", std::string("lift")}, {"value", std::string("90 mm")}});
  EXPECT_NEAR(krl_point(posted(p), "ring")[2], 90, 1e-6);
  // Targets in a frame: the point in that.
  bind(p, {{"kind", std::string("robot")}, {"frame", std::string("bench")}});
  q = krl_point(posted(p), "ring");
  EXPECT_NEAR(q[0], 0, 1e-6);
  EXPECT_NEAR(q[2], 0, 1e-6);
  // A moved object takes its points along.
  q = at("housing", "bore");
  call("world.place",
       {{"id", cell_}, {"member", std::string("housing")}, {"position", List{0.6, 0.1, 0.05}}});
  const auto moved = krl_point(posted(p), "ring");
  EXPECT_NEAR(moved[0], 600 + 30 - 300, 1e-6);
}

TEST_F(ProgramPoints, EveryTypeOfPlaceAndNumberIsGiven) {
  const Value p = put(
      "CONST\n  INT: TIMES := 1;\n"
      "VAR\n  ROBTARGET: a := ROBTARGET(POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0)), 2, "
      "[0, 0], ADD_JOINT(0.0));\n"
      "  POSITION: b;\n  ORIENTATION: c;\n  REAL: angle;\n  ARRAY [1..TIMES] OF INT: row;\n"
      "  ROBTARGET: none;\n",
      "  b.X := b.X;\n");
  for (const char* name : {"a", "b", "c"})
    bind(p, {{"kind", std::string("point")},
             {"name", std::string(name)},
             {"to", std::string("housing")}});
  bind(p, {{"kind", std::string("value")},
           {"name", std::string("angle")},
           {"expression", std::string("30 deg")}});
  bind(p, {{"kind", std::string("value")},
           {"name", std::string("TIMES")},
           {"to", std::string("housing")},
           {"expression", std::string("height / 20 mm")}});
  const Value run = call("program.run_alone", {{"id", p}});
  (void)run;
  const Value tree = call("program.tree", {{"id", p}});
  std::string types;
  for (const Value& s : *tree.as_map()->find("symbols")->as_list())
    if (*s.as_map()->find("name")->as_string() == "row")
      types = *s.as_map()->find("type")->as_string();
  // 60 mm / 20 mm: bounds of arrays are known before the program runs, and follow.
  EXPECT_EQ(types, "ARRAY [1..3] OF INT");
  // STATUS and TURNS stay as they were written.
  EXPECT_NE(posted(put(kRing, kMoves)), "");
  EXPECT_NE(refused(p, {{"kind", std::string("point")},
                        {"name", std::string("none")},
                        {"to", std::string("housing")}})
                .find("PSE"),
            std::string::npos);
}

TEST_F(ProgramPoints, WhatMeansNothingIsRefusedWithASentence) {
  const Value p = put(kRing, kMoves);
  const auto point = [](const char* name, const char* to, const char* at = "") {
    Map args{{"kind", std::string("point")}, {"name", std::string(name)}, {"to", std::string(to)}};
    if (*at) args.set("at", Value(std::string(at)));
    return args;
  };
  const auto says = [&](Map args, const char* words) {
    const std::string s = refused(p, std::move(args));
    EXPECT_NE(s.find(words), std::string::npos) << s;
  };
  says(point("rng", "housing"), "ring");  // the one meant
  says(point("ring", "housng"), "housing");
  says(point("ring", "housing", "bor"), "selector");
  says(point("radius", "housing"), "is not a point");
  says({{"kind", std::string("value")},
        {"name", std::string("ring")},
        {"expression", std::string("1")}},
       "is not a number");
  says({{"kind", std::string("value")},
        {"name", std::string("radius")},
        {"expression", std::string("bore/0")},
        {"to", std::string("housing")}},
       "expression");
  says({{"kind", std::string("value")},
        {"name", std::string("radius")},
        {"expression", std::string("nothing/2")},
        {"to", std::string("housing")}},
       "nothing");
  Map angle = point("ring", "housing");
  angle.set("position", Value(List{std::string("30 deg"), 0.0, 0.0}));
  says(angle, "length");
  angle.set("position", Value(List{0.0, 0.0}));
  says(angle, "three");
  angle.set("position", Value(List{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}));
  says(angle, "neither");
  says({{"kind", std::string("signal")},
        {"name", std::string("x")},
        {"to", std::string("y")},
        {"at", std::string("bore")}},
       "at");
  EXPECT_TRUE(call("program.bindings", {{"id", p}}).as_list()->empty());
  // What is taken away later is an error where the program is used, with the binding's name.
  bind(p, point("ring", "housing", "bore"));
  call("world.remove_member", {{"id", cell_}, {"member", std::string("housing")}});
  const std::string gone =
      fails("program.post", {{"id", p}, {"target", std::string("krl")}}).sentence();
  EXPECT_NE(gone.find("ring"), std::string::npos) << gone;
  EXPECT_NE(gone.find("housing"), std::string::npos) << gone;
}

TEST_F(ProgramPoints, TwoWorldsThatDisagreeHaveToBeChosenBetween) {
  const Value p = put(kRing, kMoves);
  const Value other = call("world.create", {{"name", std::string("other")}});
  call("world.add_robot", {{"id", other}, {"robot", arm_}, {"name", std::string("ur5")}});
  call("world.add_object", {{"id", other},
                            {"what", block_},
                            {"name", std::string("housing")},
                            {"position", List{0.4, 0.1, 0.05}}});
  call("world.add_program", {{"id", other}, {"program", p}});
  for (const Value& world : {cell_, other})
    bind(p, {{"kind", std::string("point")},
             {"name", std::string("ring")},
             {"to", std::string("housing")},
             {"world", world}});
  const Error e = fails("program.post", {{"id", p}, {"target", std::string("krl")}});
  EXPECT_NE(e.sentence().find("world"), std::string::npos) << e.sentence();
  const Value out =
      call("program.post", {{"id", p}, {"target", std::string("krl")}, {"world", other}});
  std::string all;
  for (const Value& f : *out.as_map()->find("files")->as_list())
    all += *f.as_map()->find("text")->as_string();
  const auto q = krl_point(all, "ring");
  ASSERT_EQ(q.size(), 6U);
  EXPECT_NEAR(q[0], 400, 1e-6);
}

TEST_F(ProgramPoints, BindingsAreSavedAndLoaded) {
  const fs::path folder = fs::temp_directory_path() / "robomosp-program-points";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const Value p = put(kRing, kMoves);
  bind(p, {{"kind", std::string("point")},
           {"name", std::string("ring")},
           {"to", std::string("housing")},
           {"at", std::string("bore")},
           {"position", List{0.0, 0.0, std::string("height")}},
           {"rpy", List{std::string("180 deg"), 0.0, 0.0}}});
  const std::string before = posted(p);
  const std::string file = (folder / "cell.wld").string();
  call("world.save", {{"id", cell_}, {"file", file}});
  app().document.clear();
  call("world.load", {{"file", file}});
  EXPECT_EQ(posted(call("program.get", {{"name", std::string("job1")}})), before);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace robomosp

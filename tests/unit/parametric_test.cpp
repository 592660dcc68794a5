// SPDX-License-Identifier: Apache-2.0
// Parameters and expressions of records: paths, resolution, and what a document keeps consistent
// across renaming, removal, worlds and undo.
#include "model/parametric.h"

#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "document/document.h"
#include "support/records.h"

namespace robomosp {
namespace {

using document::Document;
using document::Transaction;
using model::Parameter;
using test::make;

const model::WorldParameters kNoWorlds = [](const Expression::Name&) { return std::nullopt; };

/// A plate with a bore, a tapped hole in profile, and parameters bore = 20 mm, wall = bore/4 + 2
/// mm.
model::Solid plate() {
  model::Solid s;
  s.nodes.push_back({CsgKind::difference, "body", -1, {}, {}});
  s.nodes.push_back({CsgKind::box, "block", 0, {}, {0.2, 0.1, 0.01}});
  s.nodes.push_back({CsgKind::cylinder, "bore", 0, {}, {0.01, 0.03}});
  s.parametric.parameters = {{"wall", "bore/4 + 2 mm", "m", 0, ""},
                             {"bore", "", "m", 0.02, "of the shaft"}};
  s.parametric.expressions = {{"bore.radius", "bore/2"},
                              {"block.z", "2*wall"},
                              {"bore.position.x", "-wall"},
                              {"bore.rpy.z", "atan2(wall, bore)"}};
  return s;
}
model::World cell(double gap) {
  model::World w;
  w.parametric.parameters = {{"gap", "", "m", gap, ""}, {"twice", "2*gap", "m", 0, ""}};
  return w;
}
template <class R>
Result<document::Commit> edit(Document& d, Id<model::kind_of<R>> id,
                              const std::function<void(model::Record&, R&)>& change,
                              const std::string& gesture = {}) {
  auto tx = d.begin("edit", gesture);
  if (!tx.ok()) return std::move(tx).error();
  RMP_TRY(tx->edit(id, [&](model::Record& r) -> Result<void> {
    change(r, std::get<R>(r.body));
    return {};
  }));
  return tx->commit();
}
double at(const Document& d, AnyId id, std::string_view path) {
  const auto n = model::number_at(d.now()->find(id)->body, path);
  EXPECT_TRUE(n) << path;
  return n ? n->value : std::nan("");
}
std::string expression(const Document& d, AnyId id, const std::string& path) {
  const auto& all = model::parametric_of(d.now()->find(id)->body)->expressions;
  const auto it = all.find(path);
  return it == all.end() ? "" : it->second;
}
std::string sentence(Result<document::Commit> r) { return r.ok() ? "ok" : r.error().sentence(); }
void set_gap(Document& d, WorldId id, double gap) {
  const auto done = edit<model::World>(
      d, id, [&](model::Record&, model::World& w) { w.parametric.parameters[0].value = gap; });
  EXPECT_TRUE(done.ok()) << done.error().sentence();
}

TEST(Parametric, PathsNameTheNumbersOfEveryKind) {
  model::Solid s = plate();
  auto profile = std::make_shared<CsgProfile>();
  profile->loops.push_back(
      {{1, 2}, {{CsgCurve::Kind::line, {{3, 4}}}, {CsgCurve::Kind::arc, {{5, 6}, {7, 8}}}}});
  profile->loops.push_back({{0, 0}, {{CsgCurve::Kind::circle, {{0.5, 0.25}, {0.125, 0}}}}});
  s.nodes.push_back({CsgKind::prism, "web", 0, {}, {0.004}});
  s.nodes.back().profile = profile;
  s.nodes.push_back(
      {CsgKind::box, "a.b", 0, {{1, 2, 3}, {4, 5, 6}, model::AngleRepresentation::zyz}, {9}});
  s.nodes.back().placement.coordinates = model::PositionRepresentation::cylindrical;
  model::Robot r;
  r.links.resize(2);
  r.links[0].name = "tool";
  r.links[1].name = "slide";
  r.links[1].joint = model::JointKind::prismatic;
  r.links[1].row = {1, 2, 3, 4};
  r.links[1].given = MassProperties{};
  r.links[1].given->com = {7, 8, 9};
  r.links[1].parts.resize(2);
  r.links[1].parts[1].placement.position = {0.1, 0.2, 0.3};
  r.tool.position = {0, 0, 0.5};
  model::World w;
  w.objects.push_back({"table", {}, {{1, 2, 3}, {}}});
  model::Object o;
  o.parts.push_back({"finger", {}, {{1, 2, 3}, {0.4, 0.5, 0.6}}, {}});
  const struct {
    model::Body body;
    const char* path;
    double value;
    const char* unit;
  } good[] = {{s, "chord", 1e-4, "m"},
              {s, "bore.radius", 0.01, "m"},
              {s, "bore.position.y", 0, "m"},
              {s, "web.profile.1.1.y", 2, "m"},
              {s, "web.profile.1.2.x", 3, "m"},
              {s, "web.profile.1.4.y", 8, "m"},
              {s, "web.profile.2.1.x", 0.5, "m"},
              {s, "web.profile.2.radius", 0.125, "m"},
              {s, "a.b.x", 9, "m"},
              {s, "a.b.position.y", 2, "rad"},
              {s, "a.b.zyz.z", 6, "rad"},
              {r, "slide.d", 3, "m"},
              {r, "slide.theta", 4, "rad"},
              {r, "slide.lower", -std::numeric_limits<double>::infinity(), "m"},
              {r, "slide.com.z", 9, "m"},
              {r, "slide.parts.2.position.y", 0.2, "m"},
              {r, "tool.position.z", 0.5, "m"},
              {r, "tool.alpha", 0, "rad"},
              {r, "base.rpy.x", 0, "rad"},
              {w, "table.position.z", 3, "m"},
              {w, "gravity.z", -9.81, "m/s^2"},
              {o, "finger.rpy.y", 0.5, "rad"}};
  for (const auto& g : good) {
    const auto n = model::number_at(g.body, g.path);
    ASSERT_TRUE(n) << g.path;
    EXPECT_EQ(n->value, g.value) << g.path;
    EXPECT_EQ(n->unit, g.unit) << g.path;
    model::Body changed = g.body;
    ASSERT_TRUE(model::set_number(changed, g.path, 42)) << g.path;
    EXPECT_EQ(model::number_at(changed, g.path)->value, 42) << g.path;
    EXPECT_EQ(model::number_at(g.body, g.path)->value, g.value) << "shared profiles are copied";
  }
  const model::Body bodies[] = {s, r, w, o, model::Material{}};
  for (const char* bad :
       {"", ".", "bore", "bore.", "bore.radius.x", "bore.position.w", "bore.xyz.x",
        "web.profile.0.1.x", "web.profile.3.1.x", "web.profile.1.5.x", "web.profile.1.1.z",
        "web.profile.2.2.x", "web.profile.1.radius", "tool.com.x", "slide.parts.3.position.x",
        "colour.x", "description", "gravity.w", "finger.position"})
    for (const auto& body : bodies) EXPECT_FALSE(model::number_at(body, bad)) << bad;
}

TEST(Parametric, ParametersAreEvaluatedInTheOrderOfTheirDependencies) {
  model::Body body = plate();
  const auto done = model::resolve(body, "plate", kNoWorlds);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  const double bore = 0.02, wall = bore / 4 + 0.002;
  EXPECT_EQ(std::get<model::Solid>(body).parametric.parameters[0].value, wall);
  EXPECT_EQ(model::number_at(body, "bore.radius")->value, bore / 2);
  EXPECT_EQ(model::number_at(body, "block.z")->value, 2 * wall);
  EXPECT_EQ(model::number_at(body, "bore.position.x")->value, -wall);
  EXPECT_EQ(model::number_at(body, "bore.rpy.z")->value, std::atan2(wall, bore));
}

TEST(Parametric, FaultsNameTheParameterOrPath) {
  const auto with = [](std::vector<Parameter> parameters,
                       std::map<std::string, std::string> expressions) {
    model::Solid s = plate();
    s.parametric = {std::move(parameters), std::move(expressions)};
    model::Body body = s;
    const auto done = model::resolve(body, "plate", kNoWorlds);
    return done.ok() ? std::string("ok") : done.error().sentence();
  };
  EXPECT_EQ(
      with({{"a", "b + 1 mm", "m", 0, ""}, {"b", "2*c", "m", 0, ""}, {"c", "a", "m", 0, ""}}, {}),
      "parameter \"a\" depends on itself: a > b > c > a. Give one of them a plain value.");
  EXPECT_EQ(with({{"a", "a", "m", 0, ""}}, {}),
            "parameter \"a\" depends on itself: a > a. Give one of them a plain value.");
  EXPECT_EQ(with({{"a", "", "m", 1, ""}, {"a", "", "m", 2, ""}}, {}),
            "there are two parameters named \"a\". Give each its own name.");
  EXPECT_EQ(with({{"mm", "", "m", 1, ""}}, {}),
            "\"mm\" cannot name a parameter: it is a unit. Choose a longer one, such as mm_1.");
  EXPECT_EQ(with({{"turn", "", "rad", 1, ""}}, {{"bore.radius", "turn"}}),
            "bore.radius: \"turn\" is an angle; a length (m) is expected.");
  EXPECT_EQ(with({{"wall", "", "m", 1, ""}}, {{"bore.radius", "3 mm + wal"}}),
            "bore.radius, at character 8 of \"3 mm + wal\": there is no parameter \"wal\". Did you "
            "mean \"wall\"?");
  EXPECT_EQ(with({{"wall", "", "m", 1, ""}, {"a", "wall + 2 deg", "m", 0, ""}}, {}),
            "parameter \"a\", at character 6 of \"wall + 2 deg\": a length (wall) and an angle (2 "
            "deg) cannot be added.");
  EXPECT_EQ(with({}, {{"bore.colour", "1"}}),
            "\"bore.colour\" names no number that can be an expression.");
  EXPECT_EQ(with({}, {{"bore.radius", "1 mm +"}}),
            "bore.radius, at character 7 of \"1 mm +\": the expression ends where a value is "
            "expected.");
  EXPECT_EQ(with({}, {{"bore.radius", "other.gap"}}), "ok") << "keeps its last value";
}

TEST(Parametric, EditsReachEveryNumberInOneUndoStep) {
  Document d;
  const auto id = make(d, "plate", plate());
  EXPECT_EQ(at(d, id, "bore.radius"), 0.01);
  const auto before = d.content_digest();
  ASSERT_TRUE(edit<model::Solid>(d, id, [](model::Record&, model::Solid& s) {
                s.parametric.parameters[1].value = 0.04;
              }).ok());
  EXPECT_EQ(at(d, id, "bore.radius"), 0.02);
  EXPECT_EQ(at(d, id, "block.z"), 2 * (0.04 / 4 + 0.002));
  const auto after = d.content_digest();
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(d.content_digest(), before);
  ASSERT_TRUE(d.redo().ok());
  EXPECT_EQ(d.content_digest(), after);
}

TEST(Parametric, AParameterThatMakesASolidImpossibleIsRefused) {
  Document d;
  const auto id = make(d, "plate", plate());
  EXPECT_EQ(sentence(edit<model::Solid>(
                d, id,
                [](model::Record&, model::Solid& s) { s.parametric.parameters[1].value = -0.04; })),
            "solid \"plate\": z of box \"block\" is -0.016 m; it must be greater than 0.");
  EXPECT_EQ(at(d, id, "bore.radius"), 0.01);
}

TEST(Parametric, APlainNumberTakesTheExpressionsPlace) {
  Document d;
  const auto id = make(d, "plate", plate());
  ASSERT_TRUE(edit<model::Solid>(d, id, [](model::Record&, model::Solid& s) {
                s.nodes[2].sizes[0] = 0.007;
              }).ok());
  EXPECT_EQ(at(d, id, "bore.radius"), 0.007);
  EXPECT_EQ(expression(d, id, "bore.radius"), "");
  EXPECT_EQ(expression(d, id, "block.z"), "2*wall");
  // A new expression beside a changed number is what the edit wants.
  ASSERT_TRUE(edit<model::Solid>(d, id, [](model::Record&, model::Solid& s) {
                s.nodes[2].sizes[0] = 1;
                s.parametric.expressions["bore.radius"] = "bore/4";
              }).ok());
  EXPECT_EQ(at(d, id, "bore.radius"), 0.005);
}

TEST(Parametric, ExpressionsFollowRenamedElementsAndGoWithRemovedOnes) {
  Document d;
  const auto id = make(d, "plate", plate());
  ASSERT_TRUE(edit<model::Solid>(d, id, [](model::Record&, model::Solid& s) {
                s.nodes[2].name = "hole";
              }).ok());
  EXPECT_EQ(expression(d, id, "hole.radius"), "bore/2");
  EXPECT_EQ(expression(d, id, "hole.position.x"), "-wall");
  EXPECT_EQ(expression(d, id, "bore.radius"), "");
  ASSERT_TRUE(
      edit<model::Solid>(d, id, [](model::Record&, model::Solid& s) { s.nodes.pop_back(); }).ok());
  EXPECT_EQ(expression(d, id, "hole.radius"), "");
  EXPECT_EQ(expression(d, id, "block.z"), "2*wall");
}

/// A document with world "cell" (gap = 4 mm), a solid, an object and a robot that use it.
struct Workshop {
  Document d;
  WorldId world = make(d, "cell", cell(0.004));
  SolidId solid;
  ObjectId object;
  RobotId robot;
  Workshop() {
    model::Solid s = plate();
    s.parametric.parameters[1] = {"bore", "5*cell.gap", "m", 0, ""};
    solid = make(d, "plate", s);
    model::Object o;
    o.parts.push_back({"finger", solid, {}, {}});
    o.parametric.expressions["finger.position.x"] = "cell.twice + 1 mm";
    object = make(d, "hand", o);
    model::Robot r;
    r.links.resize(1);
    r.links[0].name = "arm";
    r.parametric.parameters = {{"reach", "10*cell.gap", "m", 0, ""}};
    r.parametric.expressions = {{"arm.a", "reach"}, {"arm.alpha", "-45 deg * 2"}};
    robot = make(d, "scara", r);
  }
};

TEST(Parametric, AWorldsParameterReachesAllRecordsThatUseItInOneStep) {
  Workshop w;
  EXPECT_EQ(at(w.d, w.solid, "bore.radius"), 5 * 0.004 / 2);
  EXPECT_EQ(at(w.d, w.object, "finger.position.x"), 2 * 0.004 + 0.001);
  EXPECT_EQ(at(w.d, w.robot, "arm.a"), 10 * 0.004);
  EXPECT_EQ(w.d.now()->users_of_worlds(), (std::vector<AnyId>{w.solid, w.object, w.robot}));
  const auto before = w.d.content_digest();
  const std::size_t steps = w.d.undo_labels().size();
  set_gap(w.d, w.world, 0.006);
  EXPECT_EQ(at(w.d, w.world, "gravity.z"), -9.81);
  EXPECT_EQ(at(w.d, w.solid, "bore.radius"), 5 * 0.006 / 2);
  EXPECT_EQ(at(w.d, w.object, "finger.position.x"), 2 * 0.006 + 0.001);
  EXPECT_EQ(at(w.d, w.robot, "arm.a"), 10 * 0.006);
  EXPECT_EQ(w.d.undo_labels().size(), steps + 1);
  ASSERT_TRUE(w.d.undo().ok());
  EXPECT_EQ(w.d.content_digest(), before);
  EXPECT_EQ(at(w.d, w.robot, "arm.a"), 10 * 0.004);
}

TEST(Parametric, RenamingAWorldRewritesItsMentionsInTheSameStep) {
  Workshop w;
  const auto before = w.d.content_digest();
  ASSERT_TRUE(edit<model::World>(w.d, w.world, [](model::Record& r, model::World& x) {
                r.name = "big cell";
                x.parametric.parameters[1].expression = "cell.gap*2";  // by its own name
              }).ok());
  EXPECT_EQ(expression(w.d, w.object, "finger.position.x"), "'big cell'.twice + 1 mm");
  EXPECT_EQ(w.d.now()->get(w.solid)->parametric.parameters[1].expression, "5*'big cell'.gap");
  EXPECT_EQ(w.d.now()->get(w.world)->parametric.parameters[1].expression, "'big cell'.gap*2");
  set_gap(w.d, w.world, 0.008);
  EXPECT_EQ(at(w.d, w.object, "finger.position.x"), 2 * 0.008 + 0.001);
  ASSERT_TRUE(w.d.undo().ok() && w.d.undo().ok());
  EXPECT_EQ(w.d.content_digest(), before);
}

TEST(Parametric, WhatIsStillUsedCannotBeRemoved) {
  Workshop w;
  const auto drop = [&](std::size_t i) {
    return sentence(edit<model::World>(w.d, w.world, [i](model::Record&, model::World& x) {
      x.parametric.parameters.erase(x.parametric.parameters.begin() +
                                    static_cast<std::ptrdiff_t>(i));
    }));
  };
  EXPECT_EQ(drop(1),
            "world \"cell\": cannot remove parameter \"twice\": object \"hand\" uses it "
            "(finger.position.x). Give it a plain number or another expression first.");
  auto tx = w.d.begin("remove");
  EXPECT_EQ(
      tx->remove(w.world).error().sentence(),
      "cannot remove world \"cell\": solid \"plate\", object \"hand\" and robot \"scara\" use "
      "its parameters. Give their numbers plain values or other expressions first.");
  // Once nobody uses it, it can go.
  ASSERT_TRUE(tx->edit(w.object, [](model::Record& r) -> Result<void> {
                  std::get<model::Object>(r.body).parametric = {};
                  return {};
                }).ok());
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(drop(1), "ok");
  EXPECT_EQ(w.d.now()->users_of_worlds(), (std::vector<AnyId>{w.solid, w.robot}));
}

TEST(Parametric, AChangeThatDoesNotSuitAUserIsRefusedAsAWhole) {
  Workshop w;
  const auto before = w.d.content_digest();
  EXPECT_EQ(
      sentence(edit<model::World>(w.d, w.world,
                                  [](model::Record&, model::World& x) {
                                    x.parametric.parameters[1] = {"twice", "", "rad", 1, ""};
                                  })),
      "object \"hand\", finger.position.x, at character 12 of \"cell.twice + 1 mm\": an angle "
      "(cell.twice) and a length (1 mm) cannot be added.");
  EXPECT_EQ(sentence(edit<model::World>(
                w.d, w.world,
                [](model::Record&, model::World& x) { x.parametric.parameters[0].value = -1; })),
            "solid \"plate\": z of box \"block\" is -2.496 m; it must be greater than 0.");
  EXPECT_EQ(w.d.content_digest(), before);
  // The transaction lives on after a refused edit, with nothing of it.
  auto tx = w.d.begin("try");
  EXPECT_FALSE(tx->edit(w.world, [](model::Record& r) -> Result<void> {
                   std::get<model::World>(r.body).parametric.parameters[1].unit = "rad";
                   return {};
                 }).ok());
  const auto commit = tx->commit();
  ASSERT_TRUE(commit.ok());
  EXPECT_TRUE(commit->changed.empty());
}

TEST(Parametric, AWorldThatIsNotThereKeepsTheLastValues) {
  Document d;
  model::Solid s = plate();
  s.nodes[2].sizes[0] = 0.005;
  s.parametric = {{}, {{"bore.radius", "cell.gap"}}};
  const auto id = make(d, "plate", s);
  EXPECT_EQ(at(d, id, "bore.radius"), 0.005);
  const auto world = make(d, "cell", cell(0.003));  // comes later, as when files are loaded
  EXPECT_EQ(at(d, id, "bore.radius"), 0.003);
  set_gap(d, world, 0.009);
  EXPECT_EQ(at(d, id, "bore.radius"), 0.009);
}

TEST(Parametric, AWorldUsesItsOwnParametersOnly) {
  Document d;
  make(d, "cell", cell(0.003));
  model::World w;
  w.parametric.parameters = {{"x", "cell.gap", "m", 0, ""}};
  auto tx = d.begin("add");
  EXPECT_EQ(tx->add("other", w).error().sentence(),
            "world \"other\", parameter \"x\": \"cell.gap\" uses cell.gap of another world. The "
            "expressions of a world use its own parameters only.");
  w.parametric.parameters = {{"x", "", "m", 0.5, ""}, {"y", "other.x*2", "m", 0, ""}};
  const auto id = tx->add("other", w);
  ASSERT_TRUE(id.ok()) << id.error().sentence();
  EXPECT_EQ(tx->now().get(*id)->parametric.parameters[1].value, 1);
}

/// Random edits of parameters, plain numbers, names, undo and redo: what each number should be is
/// kept beside the document, and the index of who uses worlds is compared with a full search.
TEST(Parametric, ARandomWalkStaysConsistent) {
  constexpr unsigned kSeed = 20261;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 random(kSeed);
  Document d;
  const auto world = make(d, "cell", cell(0.004));
  std::vector<SolidId> solids;
  for (int i = 0; i < 12; ++i) {
    model::Solid s = plate();
    if (i % 2) s.parametric.parameters[1].expression = "cell.gap + " + std::to_string(i) + " mm";
    solids.push_back(make(d, "plate" + std::to_string(i), s));
  }
  const auto check = [&] {
    const auto now = d.now();
    const double gap = now->get(world)->parametric.parameters[0].value;
    std::set<AnyId> users;
    for (std::size_t i = 0; i < solids.size(); ++i) {
      const model::Solid& s = *now->get(solids[i]);
      const Parameter& bore = s.parametric.parameters[1];
      if (!bore.expression.empty()) {
        users.insert(solids[i]);
        ASSERT_EQ(bore.value, gap + static_cast<double>(i) / 1000.0);
      }
      const double wall = bore.value / 4 + 0.002;
      ASSERT_EQ(s.parametric.parameters[0].value, wall);
      for (const auto& [path, text] : s.parametric.expressions) {
        const double want = text == "bore/2"   ? bore.value / 2
                            : text == "2*wall" ? 2 * wall
                            : text == "-wall"  ? -wall
                                               : std::atan2(wall, bore.value);
        ASSERT_EQ(model::number_at(s, path)->value, want) << path;
      }
    }
    const auto listed = now->users_of_worlds();
    ASSERT_EQ(std::set<AnyId>(listed.begin(), listed.end()), users);
  };
  for (int step = 0; step < 600; ++step) {
    const auto id = solids[random() % solids.size()];
    const double value = static_cast<double>(1 + random() % 50) / 1000.0;
    bool ok = true;
    switch (random() % 7) {
      case 0: set_gap(d, world, value); break;
      case 1:
        ok = edit<model::Solid>(d, id, [&](model::Record&, model::Solid& s) {
               s.parametric.parameters[1].expression.clear();
               s.parametric.parameters[1].value = value;
             }).ok();
        break;
      case 2:
        ok = edit<model::Solid>(d, id, [&](model::Record&, model::Solid& s) {
               s.nodes[2].sizes[0] = value;
             }).ok();
        break;
      case 3:
        ok = edit<model::Solid>(d, id, [&](model::Record&, model::Solid& s) {
               const std::size_t i = static_cast<std::size_t>(
                   std::find(solids.begin(), solids.end(), id) - solids.begin());
               s.parametric.parameters[1].expression = "cell.gap + " + std::to_string(i) + " mm";
               s.parametric.expressions[s.nodes[2].name + ".radius"] = "bore/2";
             }).ok();
        break;
      case 4:
        ok = edit<model::Solid>(d, id, [&](model::Record&, model::Solid& s) {
               s.nodes[2].name = "n" + std::to_string(random() % 1000);
             }).ok();
        break;
      case 5: ok = d.undo_labels().size() < 14 || d.undo().ok(); break;
      default: ok = d.redo_labels().empty() || d.redo().ok();
    }
    ASSERT_TRUE(ok);
    check();
    if (HasFatalFailure()) FAIL() << "step " << step;
  }
}

}  // namespace
}  // namespace robomosp

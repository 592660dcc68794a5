// SPDX-License-Identifier: Apache-2.0
// Parameters and expressions in native files: byte-equal rewriting, values that are missing, worlds
// that are not loaded, faults with their place.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "document/document.h"
#include "io/native.h"
#include "model/parametric.h"

namespace robomosp {
namespace {

using document::Document;

Result<io::Loaded> load(Document& d, std::string_view text, const std::string& shown = "t.csg") {
  auto tx = d.begin("load");
  if (!tx.ok()) return std::move(tx).error();
  auto loaded = io::load_text(*tx, text, shown, "/nowhere", {});
  if (!loaded.ok()) return loaded;
  auto commit = tx->commit();
  if (!commit.ok()) return std::move(commit).error();
  return loaded;
}
std::string fault(std::string_view text) {
  Document d;
  const auto loaded = load(d, text);
  return loaded.ok() ? "ok" : loaded.error().sentence();
}
std::string printed(const Document& d, AnyId id) {
  const auto text = io::print(*d.now(), id, "/nowhere/t.csg", {});
  EXPECT_TRUE(text.ok()) << text.error().sentence();
  return text.ok() ? *text : "";
}
double field_at(const Document& d, AnyId id, std::string_view path) {
  const auto n = model::number_at(d.now()->find(id)->body, path);
  EXPECT_TRUE(n) << path;
  return n ? n->value : std::nan("");
}

const char* const kPlateOfExpressions = R"(robomosp solid 1
name plate
chord 5e-04 = "wall/12"
parameter bore 20 mm "of the \"shaft\""
parameter wall 6 mm = "bore/4 + 1 mm" "around it"
parameter turn 30 deg
parameter n 3
difference body {
  box block { x 0.2  y 0.1  z 0.012 = "2*wall" }
  cylinder hole { at (-6 mm = "-wall", 0, 0)  rpy (0, 0, 60 deg = "2*turn")  radius 0.01 = "bore/2"  height 0.03 }
  linear_pattern row {  count 3 = "n"  dx 6 mm = "wall"
    sphere ball { radius 1 mm }
  }
  prism web {  height 1 mm
    profile {
      loop {
        start (0, 6 mm = "wall")
        line (0.02 = "bore", 0)
        line (0.02, 0.02 = "bore")
        arc (0.01 = "bore/2", 0.03) (0, 0.02)
      }
      loop { circle (5 mm, 0.01)  radius 1 mm = "wall/6" }
    }
  }
}
)";

TEST(NativeExpressions, AreRewrittenByteForByte) {
  Document d;
  const auto loaded = load(d, kPlateOfExpressions);
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_TRUE(loaded->notes.empty());
  EXPECT_EQ(printed(d, loaded->id), kPlateOfExpressions);
  const auto& p = d.now()->get(SolidId{loaded->id.number})->parametric;
  EXPECT_EQ(p.parameters[1].expression, "bore/4 + 1 mm");
  EXPECT_EQ(p.parameters[1].description, "around it");
  EXPECT_EQ(p.expressions.size(), 12U);
  EXPECT_EQ(p.expressions.at("web.profile.1.4.x"), "bore/2");
  EXPECT_EQ(field_at(d, loaded->id, "web.profile.2.radius"), 0.006 / 6);
}

TEST(NativeExpressions, RobotsObjectsAndWorldsHoldThemAsWell) {
  const char* const robot = R"~(robomosp robot 1
name arm
parameter reach 0.3 m
convention dh
base { at (0, 0, 0.3 = "reach") }
link shoulder {
  row { a 0.3 = "reach"  alpha 90 deg = "pi/2 * rad"  d 0  theta 0 }
  limits (-1 = "-1 rad", 2)
  drive { gear_ratio 1 = "reach / (300 mm)"  coulomb (0, 0 = "-0 N m") }
  given { mass 3 = "10 kg * reach / (1 m)"  com (0, 0, 0 = "0 * reach") }
}
tool { at (0, 0, 0 = "reach - reach") }
)~";
  Document d;
  const auto loaded = load(d, robot, "arm.rbt");
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(printed(d, loaded->id), robot);
  auto tx = d.begin("reach");
  ASSERT_TRUE(tx->edit(loaded->id, [](model::Record& r) -> Result<void> {
                  std::get<model::Robot>(r.body).parametric.parameters[0].value = 0.45;
                  return {};
                }).ok());
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(field_at(d, loaded->id, "shoulder.a"), 0.45);
  EXPECT_EQ(field_at(d, loaded->id, "shoulder.gear_ratio"), 0.45 / 0.3);
  EXPECT_EQ(field_at(d, loaded->id, "base.position.z"), 0.45);

  const char* const world = R"~(robomosp world 1
name cell
parameter fall -9.81 m/s^2
parameter rate 2 m^-1 = "1 / (0.5 m)"
gravity (0, 0, -4.905 = "fall/2")
)~";
  Document cells;
  const auto cell = load(cells,
                         "robomosp world 1\nname cell\nparameter fall -9.81 m/s^2\n"
                         "parameter rate = \"1 / (0.5 m)\"\ngravity (0, 0, = \"fall/2\")\n");
  ASSERT_TRUE(cell.ok()) << cell.error().sentence();
  EXPECT_EQ(field_at(cells, cell->id, "gravity.z"), -9.81 / 2);
  EXPECT_EQ(printed(cells, cell->id), world);
  Document again;
  ASSERT_TRUE(load(again, world).ok());
  EXPECT_EQ(again.content_digest(), cells.content_digest());
}

TEST(NativeExpressions, AHandWrittenFileNeedsNoValues) {
  Document d;
  const auto loaded = load(d, R"(robomosp solid 1
name bush
parameter wall = "bore/4 + arc"
parameter arc = "bore * turn"
parameter bore 20 mm parameter turn 0.5 rad
cylinder body { at (= "bore", 0, 0)  radius = "bore/2 + wall"  height 30 mm }
)");
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(field_at(d, loaded->id, "body.radius"), 0.02 / 2 + (0.02 / 4 + 0.02 * 0.5));
  EXPECT_EQ(field_at(d, loaded->id, "body.position.x"), 0.02);
  const std::string text = printed(d, loaded->id);
  Document again;
  const auto reread = load(again, text);
  ASSERT_TRUE(reread.ok()) << reread.error().sentence();
  EXPECT_EQ(printed(again, reread->id), text);
}

TEST(NativeExpressions, StandBehindTheParametersOfPluginsPrimitives) {
  const char* const text =
      "robomosp solid 1\nname w\nparameter n 12\nparameter bore 20 mm\n"
      "custom wheel { primitive gear { face 0.005  hub \"plain\"  module 0.002 = \"bore/10\"  "
      "teeth "
      "24.0 = \"2*n\" } }\n";
  Document d;
  const auto loaded = load(d, text);
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(field_at(d, loaded->id, "wheel.primitive.teeth"), 24);
  EXPECT_EQ(field_at(d, loaded->id, "wheel.primitive.module"), 0.02 / 10);
  EXPECT_EQ(printed(d, loaded->id), text);
  // Written by hand: a whole number, or none, in front of the expression.
  Document by_hand;
  const auto again = load(by_hand,
                          "robomosp solid 1\nname w\nparameter n 12\nparameter bore 20 mm\n"
                          "custom wheel { primitive gear { teeth 7 = \"2*n\"  face 5 mm  "
                          "module = \"bore/10\"  hub \"plain\" } }\n");
  ASSERT_TRUE(again.ok()) << again.error().sentence();
  EXPECT_EQ(printed(by_hand, again->id), text);
}

TEST(NativeExpressions, ExpressionsWinOverOldValues) {
  Document d;
  const auto loaded = load(d,
                           "robomosp solid 1\nname b\nparameter bore 40 mm\n"
                           "sphere s { radius 10 mm = \"bore/2\" }\n");
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ(field_at(d, loaded->id, "s.radius"), 0.02);
}

TEST(NativeExpressions, AWorldThatIsNotLoadedKeepsTheLastValuesAndIsTold) {
  Document d;
  const char* const text =
      "robomosp solid 1\nname b\nparameter bore 17 mm = \"cell.gap * 2\"\n"
      "sphere s { radius 0.0085 = \"bore/2\" }\n";
  const auto loaded = load(d, text);
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(loaded->notes, std::vector<std::string>{
                               "The expressions of solid \"b\" use cell.gap of a world that is not "
                               "loaded; its last value is kept."});
  EXPECT_EQ(field_at(d, loaded->id, "s.radius"), 0.0085);
  EXPECT_EQ(printed(d, loaded->id), text);
  ASSERT_TRUE(load(d, "robomosp world 1\nname cell\nparameter gap 5 mm\n").ok());
  EXPECT_EQ(field_at(d, loaded->id, "s.radius"), 0.005);
}

TEST(NativeExpressions, FaultsHaveTheirPlace) {
  const std::string start = "robomosp solid 1\nname b\nparameter bore 20 mm\n";
  EXPECT_EQ(fault(start + "sphere s { radius 1 mm = \"bor/2\" }"),
            "t.csg:4:26: at character 1 of \"bor/2\": there is no parameter \"bor\". Did you mean "
            "\"bore\"?");
  EXPECT_EQ(fault(start + "sphere s { radius 1 mm = \"bore + 2 deg\" }"),
            "t.csg:4:26: at character 6 of \"bore + 2 deg\": a length (bore) and an angle (2 deg) "
            "cannot be added.");
  EXPECT_EQ(fault(start + "sphere s { radius 1 mm = \"bore +\" }"),
            "t.csg:4:26: at character 7 of \"bore +\": the expression ends where a value is "
            "expected.");
  EXPECT_EQ(
      fault(start + "sphere s { radius = \"cell.bore\" }"),
      "t.csg:4:21: the last value is missing in front of this expression, which uses a world. "
      "Such as: radius 10 mm = \"cell.bore/2\".");
  EXPECT_EQ(fault(start + "parameter a 1 mm = \"2*c\"\nparameter c = \"a\"\nsphere s { radius 1 }"),
            "t.csg:4:20: parameter \"a\" depends on itself: a > c > a. Give one of them a plain "
            "value.");
  EXPECT_EQ(fault(start + "parameter bore 3\nsphere s { radius 1 }"),
            "t.csg:4:11: there is already a parameter named \"bore\".");
  EXPECT_EQ(
      fault("robomosp solid 1\nname b\nparameter mm 3\nsphere s { radius 1 }"),
      "t.csg:3:11: \"mm\" cannot name a parameter: it is a unit. Choose a longer one, such as "
      "mm_1.");
  EXPECT_EQ(fault("robomosp material 1\nname b\ndensity 7850\ncolour (0.5 = \"2*bore\", 0, 0)"),
            "t.csg:4:15: this number of \"colour\" cannot be an expression. Whole numbers and "
            "colours are written as they are.");
  for (const char* bad :
       {"radius 1 mm =", "radius 1 mm = bore", "radius 1 mm = \"\"", "radius =", "radius = 3",
        "= \"bore\"", "at (0, 0, 1 mm = bore)", "parameter", "radius 1 mm = \"bore\" \"bore\""})
    EXPECT_NE(fault(start + "sphere s { " + bad + " }"), "ok") << bad;
  for (const char* bad :
       {"parameter", "parameter x", "parameter x { }", "parameter x (1)",
        "parameter x 1 = ", "parameter x 1 \"a\" \"b\"", "parameter x word", "parameter \"a b\" 1"})
    EXPECT_NE(fault(start + bad + "\nsphere s { radius 1 }"), "ok") << bad;
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Native files: what they say, what is refused and in which words, and that writing is exact.
#include "io/native.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using document::Document;

/// A folder of its own for a test, removed afterwards.
class NativeFiles : public testing::Test {
 protected:
  NativeFiles() {
    std::string pattern = (fs::temp_directory_path() / "robomosp_native_XXXXXX").string();
    folder = ::mkdtemp(pattern.data());
  }
  ~NativeFiles() override {
    std::error_code ec;
    fs::remove_all(folder, ec);
  }
  fs::path put(const std::string& name, const std::string& text) const {
    const fs::path file = folder / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  static std::string get(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    return s.str();
  }
  /// Loads and commits.
  Result<io::Loaded> load(const fs::path& file) {
    auto tx = document.begin("load");
    if (!tx.ok()) return std::move(tx).error();
    RMP_TRY_ASSIGN(auto loaded, io::load(*tx, file, library));
    RMP_TRY(tx->commit());
    return loaded;
  }
  /// The sentence with which a text is refused; "" when it is accepted.
  std::string refusal(const std::string& text, const std::string& shown = "a.rbt") {
    auto tx = document.begin("load");
    const auto loaded = io::load_text(*tx, text, shown, folder, library);
    EXPECT_EQ(tx->now().size(), document.now()->size())
        << "a refused file must leave nothing behind";
    return loaded.ok() ? "" : loaded.error().sentence();
  }
  /// Loads a text, prints it, loads that and prints again; both prints must be the same bytes.
  std::string rewritten(const std::string& text) {
    std::string first, second;
    for (std::string* out : {&first, &second}) {
      Document scratch;
      auto tx = scratch.begin("load");
      const auto loaded = io::load_text(*tx, out == &first ? text : first, "a", folder, library);
      if (!loaded.ok()) {
        ADD_FAILURE() << loaded.error().sentence() << "\n" << (out == &first ? text : first);
        return {};
      }
      const auto printed = io::print(tx->now(), loaded->id, folder / "a", library);
      if (!printed.ok()) {
        ADD_FAILURE() << printed.error().sentence();
        return {};
      }
      *out = *printed;
    }
    EXPECT_EQ(first, second);
    return first;
  }

  fs::path folder;
  std::vector<fs::path> library;
  Document document;
};

constexpr const char* kSteel = R"(robomosp material 1
name steel
description "Structural steel S235"
source "EN 10025-2"
density 7850 kg/m^3
colour (0.55, 0.57, 0.6)
shininess 0.5
metalness 0.8
)";

constexpr const char* kPlate = R"(robomosp solid 1
name base_plate
material "steel.mtr"
difference body {
  box plate { x 0.2  y 0.2  z 0.05  fillet 2 mm }
  cylinder bore { at (0, 0, -1 mm)  radius 0.02  height 0.052 }
  union bosses {  at (0, 0, 0.05)  rpy (0, 90 deg, 0)
    sphere s1 { radius 0.01 }
  }
}
)";

constexpr const char* kCompound = R"(robomosp object 1
name compound
part plate { solid "plate.csg" }
part other { solid "plate.csg"  at (0.3, 0, 0)  material "steel.mtr" }
)";

constexpr const char* kRobot = R"(robomosp robot 1
name pa10
source "paper"
convention mdh
base { at (0, 0, 0.1) }
base_part { object "compound.part" }
link shoulder {
  row { a 0  alpha 0  d 0.317  theta 0 }
  limits (-177 deg, 177 deg)
  max_velocity 57 deg/s
  max_acceleration 10
  max_force 200
  drive { motor_inertia 2e-04  gear_ratio -62.6111  viscous 0.00148  coulomb (0.395, -0.435) }
  given { mass 9.22  com (0, 0, -0.01)  inertia (0.122706, 0.122706, 0.0530564, 0, 0, 0) }
  part { solid "plate.csg"  rpy (0, 0, 90 deg) }
  visible false
}
link rail {
  joint prismatic
  row { a 0.02  alpha -90 deg  d 0  theta 0 }
  limits (0, 0.5)
}
link finger_left {
  joint fixed
  row { a 0  alpha 0  d 0.1  theta 0 }
}
link finger_right {
  parent rail
  row { a 0  alpha 0  d 0.1  theta 0 }
}
tool { at (0, 0, 0.11) }
pose home (0, 0, 0)
pose ready (45 deg, 0.25, 1.5)
ik numeric {
  max_iterations 200
  tolerance 1e-09
}
skin { colour (1, 0.5, 0) }
)";

constexpr const char* kCircle = R"(robomosp trajectory 1
name circle
sample_time 0.1
segment circle {
  closed true
  count 3
  mode "fast"
  speed 0.01
  weights (1, 2.5)
  point { at (0.558, 0, 0.7346)  rpy (180 deg, 0, 180 deg) }
  point { at (0.6, 0.1, 0.7)  zyz (10 deg, 0.2, 0) }
}
)";

constexpr const char* kWorld = R"(robomosp world 1
name cell
gravity (0, 0, -1.62)
object table { object "compound.part"  at (1, 0, 0) }
robot pa10 { robot "pa10.rbt"  at (0, 0, 0.5)  q (45 deg, 0.1, 0) }
trajectory circle { trajectory "circle.tjc" }
)";

TEST_F(NativeFiles, AWorldLoadsWithEverythingItRefersToInOneStep) {
  put("steel.mtr", kSteel);
  put("plate.csg", kPlate);
  put("compound.part", kCompound);
  put("pa10.rbt", kRobot);
  put("circle.tjc", kCircle);
  const auto loaded = load(put("cell.wld", kWorld));
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  const auto now = document.now();
  EXPECT_EQ(now->size(), 6U);
  EXPECT_EQ(loaded->all.size(), 6U);
  EXPECT_EQ(loaded->id, *now->find(Kind::world, "cell"));
  EXPECT_EQ(document.undo_labels().size(), 1U);

  const auto* steel = now->get(MaterialId{now->find(Kind::material, "steel")->number});
  EXPECT_EQ(steel->density, 7850);
  EXPECT_EQ(steel->description, "Structural steel S235");
  const auto* plate = now->get(SolidId{now->find(Kind::solid, "base_plate")->number});
  ASSERT_EQ(plate->nodes.size(), 5U);
  EXPECT_EQ(plate->nodes[1].name, "plate");
  EXPECT_EQ(plate->nodes[1].sizes[2], 0.05);
  EXPECT_EQ(plate->nodes[3].parent, 0);
  EXPECT_EQ(plate->nodes[3].placement.angles[1], std::numbers::pi / 2);
  EXPECT_EQ(plate->nodes[4].parent, 3);
  EXPECT_EQ(AnyId(plate->material), *now->find(Kind::material, "steel"));
  const auto* robot = now->get(RobotId{now->find(Kind::robot, "pa10")->number});
  ASSERT_EQ(robot->links.size(), 4U);
  EXPECT_EQ(robot->convention, model::Convention::mdh);
  EXPECT_NEAR(robot->links[0].lower, -177 * std::numbers::pi / 180, 1e-15);
  EXPECT_EQ(robot->links[0].drive.coulomb_negative, -0.435);
  EXPECT_EQ(robot->links[0].given->com[2], -0.01);
  EXPECT_EQ(robot->links[1].row.a, 0.02);
  EXPECT_EQ(robot->links[3].parent, 1);
  EXPECT_EQ(robot->poses[1].q[0], std::numbers::pi / 4);
  EXPECT_EQ(std::get<std::int64_t>(robot->ik.params.at("max_iterations")), 200);
  EXPECT_EQ(std::get<double>(robot->ik.params.at("tolerance")), 1e-9);
  const auto* world = now->get(WorldId{loaded->id.number});
  EXPECT_EQ(world->robots[0].q[0], std::numbers::pi / 4);
  EXPECT_EQ(world->gravity[2], -1.62);
}

TEST_F(NativeFiles, WritingWhatWasReadGivesTheSameBytes) {
  put("steel.mtr", kSteel);
  put("plate.csg", kPlate);
  put("compound.part", kCompound);
  put("pa10.rbt", kRobot);
  put("circle.tjc", kCircle);
  EXPECT_EQ(rewritten(kSteel), kSteel);
  EXPECT_EQ(rewritten(kPlate), kPlate);
  EXPECT_EQ(rewritten(kCompound), kCompound);
  EXPECT_EQ(rewritten(kRobot), kRobot);
  EXPECT_EQ(rewritten(kCircle), kCircle);
  EXPECT_EQ(rewritten(kWorld), kWorld);
}

TEST_F(NativeFiles, AMechanismWithEverythingARobotCanHaveKeepsItsBytes) {
  std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "tests/fuzz/corpus/mechanism.rbt");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(rewritten(text), text);
}

TEST_F(NativeFiles, SegmentsWithEverythingTheyCanHaveKeepTheirBytes) {
  put("circle.tjc", kCircle);
  std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "tests/fuzz/corpus/segments.tjc");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(rewritten(text), text);
  const auto loaded = load(put("segments.tjc", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  const auto now = document.now();
  const auto& segments = now->get(TrajectoryId{loaded->id.number})->segments;
  ASSERT_EQ(segments.size(), 4U);
  EXPECT_EQ(std::get<double>(segments[0].law.params.at("jerk")), 5);
  EXPECT_EQ(std::get<std::string>(segments[0].orientation.params.at("ease")), "smooth");
  EXPECT_EQ(segments[0].points[1].angles[0], 0.5);
  EXPECT_EQ(std::get<std::vector<double>>(segments[1].shape.params.at("times")),
            (std::vector<double>{0, 1, 2.5}));
  EXPECT_EQ(segments[1].transition, (model::Transition{true, 0.02, 0.1}));
  EXPECT_EQ(segments[2].joints,
            (std::vector<std::vector<double>>{{0.1, 0.2, 0.3}, {std::numbers::pi / 4, 0, -0.5}}));
  EXPECT_FALSE(segments[2].transition.is_smooth);
  EXPECT_EQ(AnyId(segments[3].stored), *now->find(Kind::trajectory, "circle"));
  EXPECT_EQ(segments[3].placement.angles[2], std::numbers::pi / 2);
  ASSERT_TRUE(document.undo().ok());
  EXPECT_EQ(document.now()->size(), 0U);
}

TEST_F(NativeFiles, FaultsOfSegmentsAreToldWhereTheyStand) {
  const std::string head = "robomosp trajectory 1\nname a\n";
  EXPECT_EQ(refusal(head + "segment { at (0, 0, 0) }\n", "a.tjc"),
            "a.tjc:3:1: \"trajectory\" is missing in a stored segment.");
  EXPECT_EQ(refusal(head + "segment line { transition { distance 3 rad } }\n", "a.tjc"),
            "a.tjc:3:38: 3 rad is an angle; a length (m) is expected.");
}

TEST_F(NativeFiles, FaultsOfMechanismsAreToldWhereTheyStand) {
  const std::string head = "robomosp robot 1\nname a\nlink one { row { } }\n";
  const auto refused = [&](const std::string& rest) { return refusal(head + rest); };
  EXPECT_EQ(
      refused("link two { }\n"),
      "a.rbt:4:1: \"row\" is missing in a link. Give its row, or origin and axis of its joint.");
  EXPECT_EQ(refused("link two { row { }  origin { } }\n"),
            "a.rbt:4:1: link \"two\" has a row and an origin. Keep only one of them.");
  EXPECT_EQ(refused("link two { row { }  mimic { link two } }\n"),
            "a.rbt:4:34: \"two\" is not a link before link \"two\". A joint can only follow that "
            "of an earlier link.");
  EXPECT_EQ(refused("tool cam { link onw }\n"),
            "a.rbt:4:17: \"onw\" is not a link of the robot. Did you mean \"one\"?");
  EXPECT_EQ(refused("tool { }\ntool { }\n"),
            "a.rbt:5:1: \"tool\" is given twice in a robot. The first one is at a.rbt:4:1. Further "
            "tools need a name and a link.");
  EXPECT_EQ(refused("loop pin { a { link one } }\n"), "a.rbt:4:1: \"b\" is missing in a loop.");
  EXPECT_EQ(refused("link two { joint planar  row { } }\npose home (0, 0)\n"),
            "a.rbt:5:1: pose \"home\" has 2 joint values; the robot has 4 coordinates.");
  EXPECT_EQ(refused("link two { joint spherical  row { } }\npose home (0, 0, 0, 0, 0)\n"),
            "a.rbt:5:1: a quaternion of pose \"home\" is zero. Use 1 0 0 0 for no rotation.");
  EXPECT_EQ(refused("loop pin { a { link one }  b { link one } }\n"),
            "a.rbt:4:1: loop \"pin\" does not hold two links of the robot. Name two links, or a "
            "link and the base.");
}

TEST_F(NativeFiles, SpacesCommentsOrderAndLineEndsAreFree) {
  const std::string loose =
      "\xEF\xBB\xBFrobomosp material 1\r\n# steel\r\ndensity 7.85 g/cm^3 colour (1,0.5,\r\n0) "
      "name \"mild steel\"\r\n";
  EXPECT_EQ(rewritten(loose),
            "robomosp material 1\nname \"mild steel\"\ndensity 7850 kg/m^3\ncolour (1, 0.5, 0)\n");
}

TEST_F(NativeFiles, NumbersKeepEveryBit) {
  for (const double v :
       {0.1, 1.0 / 3, std::numbers::pi, 1e-300, 123456789.123456789, 0.017453292519943295}) {
    Document scratch;
    auto tx = scratch.begin("load");
    model::Solid s;
    s.nodes.push_back(
        {CsgKind::sphere, "s", -1, {{v, -v, v}, {v, 0, -v}, model::AngleRepresentation::zyz}, {v}});
    const auto id = tx->add("s", s);
    const auto text = io::print(tx->now(), *id, folder / "s.csg", {});
    ASSERT_TRUE(text.ok());
    const auto back = io::load_text(*tx, *text, "s.csg", folder, {});
    ASSERT_TRUE(back.ok()) << back.error().sentence();
    const auto& n = tx->now().get(SolidId{back->id.number})->nodes[0];
    EXPECT_EQ(n.sizes[0], v);
    EXPECT_EQ(n.placement.position, (Vec3{v, -v, v}));
    EXPECT_EQ(n.placement.angles, (Vec3{v, 0, -v}));
  }
}

TEST_F(NativeFiles, TextsKeepQuotesBackslashesAndNewLines) {
  auto tx = document.begin("x");
  model::Material m;
  m.description = "a \"b\" \\ c\nd\te \xC3\xA9";
  const auto id = tx->add("m", m);
  const auto text = io::print(tx->now(), *id, folder / "m.mtr", {});
  ASSERT_TRUE(text.ok());
  const auto back = io::load_text(*tx, *text, "m.mtr", folder, {});
  ASSERT_TRUE(back.ok()) << back.error().sentence();
  EXPECT_EQ(tx->now().get(MaterialId{back->id.number})->description, m.description);
}

TEST_F(NativeFiles, NodesWithoutNamesGetOnes) {
  const std::string text = rewritten(
      "robomosp solid 1 \nname s\nunion { box { x 1 y 1 z 1 } box box_1 { x 1 y 2 z 1 } box { x 1 "
      "y 3 z 1 } }");
  EXPECT_EQ(text,
            "robomosp solid 1\nname s\nunion union_1 {\n  box box_2 { x 1  y 1  z 1 }\n  box box_1 "
            "{ x 1  y 2  z 1 }\n"
            "  box box_3 { x 1  y 3  z 1 }\n}\n");
}

TEST_F(NativeFiles, FaultsAreToldWithFileLineAndColumn) {
  const std::string head = "robomosp robot 1\nname r\nlink a {\n";
  EXPECT_EQ(refusal(head + "  row { a 0  alpa -90 deg }\n}\n", "pa10.rbt"),
            "pa10.rbt:4:14: \"alpa\" is not a field of a DH row. Did you mean \"alpha\"?");
  EXPECT_EQ(refusal(head + "  row { a 90 deg }\n}\n"),
            "a.rbt:4:11: 90 deg is an angle; a length (m) is expected.");
  EXPECT_EQ(refusal(head + "  row { a 90 mmm }\n}\n"),
            "a.rbt:4:14: \"mmm\" is not a unit. Did you mean \"mm\"?");
  EXPECT_EQ(refusal(head + "  row { a 90mmm }\n}\n"),
            "a.rbt:4:13: \"mmm\" is not a unit. Did you mean \"mm\"?");
  EXPECT_EQ(refusal(head + "  row { a 90 mmm d 1 }\n}\n"),
            "a.rbt:4:14: \"mmm\" is not a unit. Did you mean \"mm\"?");
  EXPECT_EQ(refusal(head + "  row { a 1  a 2 }\n}\n"),
            "a.rbt:4:14: \"a\" is given twice in a DH row. The first one is at a.rbt:4:9.");
  EXPECT_EQ(refusal(head + "  joint fixed\n}\n"),
            "a.rbt:3:1: \"row\" is missing in a link. Give its row, or origin and axis of its "
            "joint.");
  EXPECT_EQ(refusal(head + "  row { a x }\n}\n"), "a.rbt:4:11: \"a\" needs a number.");
  EXPECT_EQ(refusal(head + "  row { }\n  limits (1)\n}\n"),
            "a.rbt:5:10: \"limits\" needs 2 numbers in parentheses; it has 1.");
  EXPECT_EQ(refusal(head + "  row { }\n  limits (2, 1)\n}\n"),
            "a.rbt:3:1: the lower limit of link \"a\" is 2 and the upper 1. The lower limit must "
            "not exceed the upper one.");
  EXPECT_EQ(
      refusal(head + "  row { }\n  joint revolut\n}\n"),
      "a.rbt:5:9: \"joint\" must be revolute, prismatic, fixed, universal, cylindrical, planar, "
      "spherical or free. Did you mean \"revolute\"?");
  EXPECT_EQ(refusal(head + "  row { }\n}\nlink b {\n  parent aa\n  row { }\n}\n"),
            "a.rbt:7:10: \"aa\" is not a link before link \"b\". Did you mean \"a\"?");
  EXPECT_EQ(refusal(head + "  row { }\n}\nlink a { row { } }\n"),
            "a.rbt:6:6: there is already a link named \"a\". The first one is at a.rbt:3:1.");
  EXPECT_EQ(refusal(head + "  row { }\n}\npose home (1, 2)\n"),
            "a.rbt:6:1: pose \"home\" has 2 joint values; the robot has 1 moving joint.");
  EXPECT_EQ(refusal(head + "  row { \n"),
            "a.rbt:5:1: the file ends inside a block. The block of \"row\", which starts at "
            "a.rbt:4:3, is not closed.");
  EXPECT_EQ(refusal(head + "  row { }\n} }\n"),
            "a.rbt:5:3: there is no block for this \"}\" to close. Remove it, or add the \"{\" "
            "that is missing.");
  EXPECT_EQ(refusal("robomosp robot 1\nname r\ndescription \"abc\nsource \"x\"\n"),
            "a.rbt:3:13: the text that starts here has no closing \". A text ends on the line "
            "where it starts; write \\n for a "
            "new line.");
  EXPECT_EQ(refusal("robomosp material 1\nname m\ndensity 1.2.3\n", "m.mtr"),
            "m.mtr:3:9: \"1.2.3\" is not a number.");
  EXPECT_EQ(refusal("robomosp material 1\nname m\ndensity 1e999\n", "m.mtr"),
            "m.mtr:3:9: \"1e999\" is outside the range of real numbers.");
  EXPECT_EQ(refusal("robomosp material 1\nname m\ndensity -1\n", "m.mtr"),
            "m.mtr:1:10: the density is -1 kg/m^3; it must not be negative.");
  EXPECT_EQ(refusal("robomosp material 1\nname m\n", "m.mtr"),
            "m.mtr:1:10: \"density\" is missing in a material.");
  EXPECT_EQ(refusal("robomosp material 1\nname 2m\ndensity 1\n", "m.mtr"),
            "m.mtr:2:6: \"name\" needs a name.");
  EXPECT_EQ(
      refusal("robomosp material 1\nname \"\xC3\xA9\" density 1 \xC3\xA9\n", "m.mtr"),
      "m.mtr:2:20: the character \"\xC3\xA9\" is not allowed here. Put text with such letters "
      "in double quotes.");
}

TEST_F(NativeFiles, SolidsAreRefusedWithTheirNode) {
  const std::string head = "robomosp solid 1\nname s\n";
  EXPECT_EQ(refusal(head + "box b { x 1  y 1 }", "s.csg"), "s.csg:3:1: \"z\" is missing in a box.");
  EXPECT_EQ(refusal(head + "union u {\n  box b { x 1  y 0  z 1 }\n}", "s.csg"),
            "s.csg:4:3: y of box \"b\" is 0 m; it must be greater than 0.");
  EXPECT_EQ(refusal(head + "box b { x 1  y 1  z 1  radius 2 }", "s.csg"),
            "s.csg:3:24: \"radius\" is not a field of a box. Fields are x, y, z, fillet, at, "
            "cylindrical, spherical, rpy, xyz, zyz, frame and centred.");
  EXPECT_EQ(refusal(head + "box b { x 1 y 1 z 1 sphere s { radius 1 } }", "s.csg"),
            "s.csg:3:21: a box is a primitive and has no nodes inside. Put both inside a union, "
            "difference or intersection.");
  EXPECT_EQ(refusal(head + "box b { x 1 y 1 z 1 }\nbox c { x 1 y 1 z 1 }", "s.csg"),
            "s.csg:4:1: a solid has a single top-level node, but this is the second. Put both "
            "inside a union, difference or "
            "intersection.");
  EXPECT_EQ(refusal(head + "box b { x 1 y 1 z 1 rpy (0,0,0) xyz (0,0,0) }", "s.csg"),
            "s.csg:3:33: \"xyz\" cannot be combined with \"rpy\". A placement can have only one "
            "set of angles.");
}

TEST_F(NativeFiles, OtherFilesAreRefusedForWhatTheyAre) {
  EXPECT_EQ(refusal("solid cube\n facet normal 0 0 0\n", "cube.stl"),
            "cube.stl:1:1: this is not a robomosp file. Its first line must be such as \"robomosp "
            "robot 1\"; CAD and mesh files are read by import.");
  EXPECT_EQ(refusal("", "empty.rbt"),
            "empty.rbt:1:1: this is not a robomosp file. Its first line must be such as \"robomosp "
            "robot 1\"; CAD and mesh files are read by import.");
  EXPECT_EQ(refusal("robomosp robot 2\nname r\n"),
            "a.rbt:1:16: the file was written by a newer version of the program: its format is 2, "
            "this program reads up to 1. "
            "Update the program.");
  EXPECT_EQ(refusal("robomosp robbot 1\n"),
            "a.rbt:1:10: \"robbot\" is not a kind of record. Did you mean \"robot\"?");
  EXPECT_EQ(refusal("robomosp robot\n"),
            "a.rbt:1:1: the first line must be \"robomosp\", a kind and a version. Such as "
            "\"robomosp robot 1\".");
  EXPECT_EQ(refusal("robomosp robot 1\nname \"\xFF\"\n"),
            "a.rbt:2:7: this byte is not UTF-8 text. Robomosp files are plain text in UTF-8; CAD "
            "and mesh files are read by import.");
  EXPECT_EQ(refusal(std::string("\x7F"
                                "ELF\0\0",
                                6)),
            "a.rbt:1:5: this is a binary file, not a text. Robomosp files are plain text in UTF-8; "
            "CAD and mesh files are read by import.");
}

TEST_F(NativeFiles, AMissingFileIsToldWithBothFilesAndTheFoldersLookedIn) {
  library = {folder / "lib"};
  const fs::path part = put("c.part", "robomosp object 1\nname c\npart p { solid \"gone.csg\" }\n");
  const auto loaded = load(part);
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().sentence(),
            part.string() + ":3:16: there is no file \"gone.csg\", which part \"p\" of \"" +
                part.string() + "\" refers to. Looked in \"" + folder.string() + "\" and \"" +
                (folder / "lib").string() + "\".");
  EXPECT_EQ(document.now()->size(), 0U);
  const auto nothing = load(folder / "no.wld");
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().code, ErrorCode::not_found);
}

TEST_F(NativeFiles, AFaultInAReferredFileLeavesNothingAndNamesThatFile) {
  put("steel.mtr", kSteel);
  const fs::path bad =
      put("plate.csg", "robomosp solid 1\nname s\nmaterial \"steel.mtr\"\nbox b { x 1 }\n");
  const auto loaded = load(put("compound.part", kCompound));
  ASSERT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.error().sentence(), bad.string() + ":4:1: \"y\" is missing in a box.");
  EXPECT_EQ(document.now()->size(), 0U);
}

TEST_F(NativeFiles, AFileOfTheWrongKindIsRefusedWhereItIsReferredTo) {
  put("steel.mtr", kSteel);
  const fs::path part =
      put("c.part", "robomosp object 1\nname c\npart p { solid \"steel.mtr\" }\n");
  EXPECT_EQ(load(part).error().sentence(),
            part.string() +
                ":3:16: the file \"steel.mtr\" holds a material, but part \"p\" needs a solid.");
}

TEST_F(NativeFiles, FilesThatReferInACircleAreRefusedWithThePath) {
  put("a.part", "robomosp object 1\nname a\npart p { object \"b.part\" }\n");
  put("b.part", "robomosp object 1\nname b\npart p { object \"c.part\" }\n");
  put("c.part", "robomosp object 1\nname c\npart p { object \"b.part\" }\n");
  const auto loaded = load(folder / "a.part");
  ASSERT_FALSE(loaded.ok());
  const std::string b = (folder / "b.part").string(), c = (folder / "c.part").string();
  EXPECT_EQ(loaded.error().sentence(),
            c + ":3:17: these files refer to each other in a circle: " + b + " > " + c + " > " + b +
                ". An object cannot contain itself.");
}

TEST_F(NativeFiles, AFileLoadedBeforeIsUsedAgain) {
  put("steel.mtr", kSteel);
  put("plate.csg", kPlate);
  const auto plate = load(folder / "plate.csg");
  ASSERT_TRUE(plate.ok());
  const auto compound = load(put("sub/../compound.part", kCompound));
  ASSERT_TRUE(compound.ok()) << compound.error().sentence();
  EXPECT_EQ(document.now()->size(), 3U);
  EXPECT_EQ(document.now()->get(ObjectId{compound->id.number})->parts[0].what, plate->id);
  const auto again = load(folder / "plate.csg");
  EXPECT_EQ(again->id, plate->id);
  EXPECT_EQ(again->notes.size(), 1U);
}

TEST_F(NativeFiles, ANameThatIsTakenGetsANumberAndANote) {
  put("a/steel.mtr", kSteel);
  put("b/steel.mtr", kSteel);
  ASSERT_TRUE(load(folder / "a/steel.mtr").ok());
  const auto second = load(folder / "b/steel.mtr");
  ASSERT_TRUE(second.ok());
  EXPECT_TRUE(document.now()->find(Kind::material, "steel_2"));
  ASSERT_EQ(second->notes.size(), 1U);
  EXPECT_EQ(second->notes[0],
            "The material of \"" + (folder / "b/steel.mtr").string() +
                "\" is named \"steel_2\" here, since there is a \"steel\" already.");
}

TEST_F(NativeFiles, ReferencesAreAlsoFoundInTheLibraryAndWrittenThatWay) {
  library = {folder / "lib"};
  put("lib/materials/steel.mtr", kSteel);
  const fs::path solid =
      put("mine/ball.csg",
          "robomosp solid 1\nname ball\nmaterial \"materials/steel.mtr\"\nsphere s { radius 1 }\n");
  const auto loaded = load(solid);
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(io::print(*document.now(), loaded->id, solid, library).value(), get(solid));
  // Within the library itself the path is relative, so that the library can be moved.
  EXPECT_NE(io::print(*document.now(), loaded->id, folder / "lib/solids/ball.csg", library)
                .value()
                .find("\"../materials/steel.mtr\""),
            std::string::npos);
}

TEST_F(NativeFiles, SavingWritesWhatWasNeverSavedBesideIt) {
  auto tx = document.begin("make");
  model::Material m;
  m.density = 2700;
  const auto material = tx->add("aluminium", m);
  model::Solid s;
  s.material = *material;
  s.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
  const auto solid = tx->add("ball", s);
  model::Object o;
  o.parts.push_back({"one", *solid, {}, {}});
  const auto object = tx->add("balls", o);

  const auto early = io::print(tx->now(), *object, folder / "balls.part", {});
  ASSERT_TRUE(early.ok()) << early.error().sentence();
  EXPECT_EQ(*early, "robomosp object 1\nname balls\npart one { solid \"ball.csg\" }\n")
      << "where saving would put it";

  put("ball.csg", "somebody else's file");
  const auto saved = io::save(*tx, *object, folder / "balls", {});
  ASSERT_TRUE(saved.ok()) << saved.error().sentence();
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(get(folder / "ball.csg"), "somebody else's file");
  EXPECT_EQ(get(folder / "balls.part"),
            "robomosp object 1\nname balls\npart one { solid \"ball_2.csg\" }\n");
  EXPECT_EQ(saved->size(), 3U);
  EXPECT_EQ(fs::weakly_canonical(folder / "balls.part"),
            document.now()->find(AnyId(*object))->file);

  Document other;
  auto tx2 = other.begin("load");
  ASSERT_TRUE(io::load(*tx2, folder / "balls.part", {}).ok());
  ASSERT_TRUE(tx2->commit().ok());
  EXPECT_EQ(other.content_digest(), document.content_digest());
}

TEST_F(NativeFiles, SavingIntoAFolderThatDoesNotExistIsASentence) {
  auto tx = document.begin("make");
  const auto id = tx->add("m", model::Material{});
  const auto saved = io::save(*tx, *id, folder / "no/m.mtr", {});
  ASSERT_FALSE(saved.ok());
  EXPECT_EQ(saved.error().sentence(),
            "there is no folder \"" + (folder / "no").string() +
                "\" to save \"m.mtr\" in. Create the folder first or choose another one.");
}

TEST_F(NativeFiles, SavingOverAnotherRecordsFileIsRefused) {
  const fs::path file = put("steel.mtr", kSteel);
  ASSERT_TRUE(load(file).ok());
  auto tx = document.begin("make");
  const auto id = tx->add("m", model::Material{});
  EXPECT_EQ(
      io::save(*tx, *id, file, {}).error().sentence(),
      "the file \"" + file.string() + "\" belongs to material \"steel\". Choose another file.");
}

TEST_F(NativeFiles, ASaveReplacesTheFileWholeAndLeavesNoTemporaryBehind) {
  const fs::path file = put("x.txt", "old");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  ASSERT_TRUE(io::write_file(file, "new").ok());
  EXPECT_EQ(get(file), "new");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST_F(NativeFiles, AFileThatIsTooLargeIsRefused) {
  const fs::path file = put("x.txt", "12345");
  EXPECT_FALSE(io::read_file(file, 4).ok());
  EXPECT_EQ(io::read_file(file, 5).value(), "12345");
  EXPECT_FALSE(io::read_file(folder).ok());
}

TEST_F(NativeFiles, EveryFileOfTheLibraryLoadsAndIsWrittenStably) {
  library = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(library[0])) {
    const fs::path& file = entry.path();
    const bool is_native = std::any_of(all_kinds().begin(), all_kinds().end(), [&](Kind k) {
      return io::extension(k) == file.extension().string();
    });
    if (!is_native) continue;
    ++files;
    Document first, second;
    auto tx = first.begin("load");
    const auto loaded = io::load(*tx, file, library);
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    ASSERT_TRUE(tx->commit().ok());
    const auto text = io::print(*first.now(), loaded->id, file, library);
    ASSERT_TRUE(text.ok()) << text.error().sentence();
    auto tx2 = second.begin("load");
    const auto again = io::load_text(*tx2, *text, file.string(), file.parent_path(), library);
    ASSERT_TRUE(again.ok()) << again.error().sentence() << "\n" << *text;
    EXPECT_EQ(io::print(tx2->now(), again->id, file, library).value(), *text);
    ASSERT_TRUE(tx2->commit().ok());
    EXPECT_EQ(second.content_digest(), first.content_digest()) << file;
  }
  EXPECT_GT(files, 0U);
}

TEST_F(NativeFiles, ATreeAHundredThousandLevelsDeepLoadsAndSaves) {
  constexpr int kDepth = 100'000;
  std::string text = "robomosp solid 1\nname deep\n";
  for (int i = 0; i < kDepth; ++i) text += "union {\n";
  text += "sphere { radius 1 }\n";
  for (int i = 0; i < kDepth; ++i) text += "}\n";
  auto tx = document.begin("load");
  const auto loaded = io::load_text(*tx, text, "deep.csg", folder, {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(document.now()->get(SolidId{loaded->id.number})->nodes.size(), kDepth + 1U);
  const auto printed = io::print(*document.now(), loaded->id, folder / "deep.csg", {});
  ASSERT_TRUE(printed.ok());
  Document other;
  auto tx2 = other.begin("load");
  ASSERT_TRUE(io::load_text(*tx2, *printed, "deep.csg", folder, {}).ok());
  EXPECT_EQ(refusal(
                "robomosp solid 1\nname deep\n" +
                    [] {
                      std::string s;
                      for (int i = 0; i < kDepth; ++i) s += "union {";
                      return s;
                    }(),
                "deep.csg")
                .substr(0, 60),
            "deep.csg:3:700001: the file ends inside a block. The block o");
}

}  // namespace
}  // namespace robomosp

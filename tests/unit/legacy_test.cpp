// SPDX-License-Identifier: Apache-2.0
// Files of ROBOMOSP 1.4 (2006): read, refused in words, written and read again; the samples here
// are our own. Where the files of the original are there (ROBOMOSP_LEGACY_DATA, a folder with a
// Saves folder of that program, or sample data beside the project), all its solids and objects are
// read and computed too.
#include "io/legacy.h"

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "model/placement.h"
#include "spatial/pose.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::unwrap;
using test::Workbench;

constexpr double kPi = std::numbers::pi;

const char* const kRed =
    "\"red\"\r\n( 0.5, 0.0, 0.0, 0.25 )\r\n( 0.8, 0.1, 0.1, 0.25 )\r\n( 0.2, 0.2, 0.2, 0.25 )\r\n"
    "( 0.0, 0.0, 0.0, 0.25 )\r\n64.0\r\n#Density\r\n2700.000000\r\n#Metric Units\r\n0\r\n";
const char* const kGrey =
    "\"\"\n(0.3, 0.3, 0.3, 1)\n(0.6 0.6 0.6 1)\n(0, 0, 0, 1)\n(0, 0, 0, 1)\n0\n8000\n0\n";
const char* const kPost =  // a post of two materials with a bore
    "\"a post\"\n#Metric Units ( Length, Mass, Angle)\n 0 0 0\n"
    "{ [ Union ( 0, 0, 0, 0, 0, 0 ) 0 3 0 ]\n"
    "  { [ Difference ( 0, 0, 0, 0, 0, 0 ) 0 3 0 ]\n"
    "    { [ Cube ( 0, 0, 0.05, 0, 0, 0 ) 0 3 0 ( 0.04, 0.04, 0.04, 0.04, 0.1 )\n"
    "        \"./Saves/Materials/red.mtr\" ] }\n"
    "    { [ Cylinder ( 0, 0, 0.05, 0, 0, 0 ) 0 3 0 ( 0.01, 0.01, 0.2, 12, 3 )\n"
    "        \"./Saves/Materials/grey.mtr\" ] }\n"
    "  }\n"
    "  { [ Cylinder ( 0, 0, 0.15, 0, 0, 0 ) 0 3 0 ( 0.02, 0.01, 0.1, 12, 3 )\n"
    "      \"./Saves/Materials/grey.mtr\" ] }\n"
    "}\n";

class Legacy : public testing::Test {
 protected:
  Legacy() {
    std::string pattern = (fs::temp_directory_path() / "robomosp_legacy_XXXXXX").string();
    folder = ::mkdtemp(pattern.data());
    put("Saves/Materials/red.mtr", kRed);
    put("Saves/Materials/grey.mtr", kGrey);
  }
  ~Legacy() override {
    std::error_code ec;
    fs::remove_all(folder, ec);
  }
  fs::path put(const std::string& name, const std::string& text) const {
    const fs::path file = folder / name;
    fs::create_directories(file.parent_path());
    fs::remove(file);  // file systems flush a file that is emptied and written again
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  /// A solid of one node, with a number of `lines` before it for the places of errors.
  static std::string solid_text(const std::string& node) {
    return "\"\"\n 0 0 0\n{ [ " + node + " ] }\n";
  }
  AnyId load(const fs::path& file, std::optional<Kind> wanted = {}) {
    auto tx = bench.document.begin("load");
    auto loaded = io::load(*tx, file, {}, wanted);
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence();
      return {};
    }
    notes = loaded->notes;
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return loaded->id;
  }
  std::string refusal(const std::string& text, std::optional<Kind> wanted = {}) {
    const fs::path file = put("Saves/CSGs/bad.csg", text);
    auto tx = bench.document.begin("load");
    const std::size_t before = tx->now().size();
    const auto loaded = io::load(*tx, file, {}, wanted);
    if (loaded.ok()) return "";
    EXPECT_EQ(tx->now().size(), before) << "a refused file must leave nothing behind";
    std::string sentence = loaded.error().sentence();
    const auto at = sentence.find("bad.csg");
    return at == std::string::npos ? sentence : sentence.substr(at);
  }
  const model::Solid& solid(AnyId id) {
    return std::get<model::Solid>(bench.document.now()->find(id)->body);
  }
  evaluation::BodyMass mass(AnyId id) {
    NoProgress progress;
    return unwrap(bench.derived.mass(*bench.document.now(), id, progress));
  }
  Moments moments(AnyId id) {
    NoProgress progress;
    return unwrap(bench.derived.moments(*bench.document.now(), SolidId{id.number}, progress));
  }

  fs::path folder;
  Workbench bench;
  std::vector<std::string> notes;
};

TEST_F(Legacy, AMaterialHasItsColoursAndDensityAndIsOpaque) {
  const AnyId id = load(folder / "Saves/Materials/red.mtr");
  const auto snapshot = bench.document.now();
  const auto& record = *snapshot->find(id);
  EXPECT_EQ(record.name, "red");
  EXPECT_TRUE(record.file.empty()) << "saving must not overwrite the old program's file";
  const auto& m = std::get<model::Material>(record.body);
  EXPECT_EQ(m.density, 2700);
  EXPECT_EQ(m.colour.r, 0.8F);
  EXPECT_EQ(m.colour.a, 1.0F);
  ASSERT_TRUE(m.ambient && m.specular);
  EXPECT_EQ(m.ambient->r, 0.5F);
  EXPECT_EQ(m.specular->g, 0.2F);
  EXPECT_EQ(m.shininess, 0.5);
}

TEST_F(Legacy, DensitiesAreInTheUnitOfTheFile) {
  const struct {
    const char *number, *code;
    double density;
  } files[] = {{"8000", "0", 8000}, {"7.85", "1", 7850},      {"490.06", "2", 7850.0081},
               {"2.7", "3", 2700},  {"0.016020", "1", 16.02}, {"1", "2", 16.0184634}};
  int n = 0;
  for (const auto& f : files) {
    std::string text = kGrey;
    text.replace(text.rfind('0'), 1, f.code);
    text.replace(text.find("8000"), 4, f.number);
    const AnyId id = load(put("Saves/Materials/m" + std::to_string(++n) + ".mtr", text));
    const auto snapshot = bench.document.now();
    EXPECT_NEAR(std::get<model::Material>(snapshot->find(id)->body).density, f.density, 1e-3)
        << f.number << " " << f.code;
    EXPECT_TRUE(notes.empty());
  }
  std::string text = kGrey;
  text.replace(text.rfind('0'), 1, "4");
  EXPECT_EQ(refusal(text),
            "bad.csg:8:1: the unit 4 of the density is not known. 0 is kg/m^3, 1 g/cm^3, 2 "
            "lb/ft^3, 3 kg/dm^3.");
}

TEST_F(Legacy, LengthsOfSolidsAndObjectsAreInTheUnitOfTheFile) {
  put("Saves/Materials/grey.mtr", kGrey);
  const double metres[] = {1, 0.1, 0.01, 0.001, 0.3048, 0.0254};
  for (int code = 0; code < 6; ++code) {
    const double m = metres[code];
    const std::string name = "unit" + std::to_string(code);
    put("Saves/CSGs/" + name + ".csg",
        "\"\"\n " + std::to_string(code) +
            " 2 0\n{ [ Cube ( 1, 2, 3, 0, 0, 90 ) 0 3 0 ( 2, 3, 2, 3, 4 ) "
            "\"./Saves/Materials/grey.mtr\" ] }");
    const AnyId solid = load(folder / ("Saves/CSGs/" + name + ".csg"));
    auto snapshot = bench.document.now();
    const auto& node = std::get<model::Solid>(snapshot->find(solid)->body).nodes.at(0);
    EXPECT_NEAR(node.sizes[0], 2 * m, 1e-15);
    EXPECT_NEAR(node.sizes[2], 4 * m, 1e-15);
    EXPECT_NEAR(model::pose(node.placement).p[1], (2 + 2) * m, 1e-15) << "turned about x, it lies";
    EXPECT_NEAR(model::pose(node.placement).p[2], 3 * m, 1e-15);
    put("Saves/Objects/" + name + ".obj", "\"\"\n " + std::to_string(code) +
                                              " 1 0\n( 1 )\n{ [ \"./Saves/CSGs/" + name +
                                              ".csg\" ( 2, 90, 5, 0, 0, 0 ) 1 3 0 ] }");
    const AnyId object = load(folder / ("Saves/Objects/" + name + ".obj"));
    snapshot = bench.document.now();
    const Vec3 at =
        model::pose(std::get<model::Object>(snapshot->find(object)->body).parts.at(0).placement).p;
    EXPECT_NEAR(at[1], 2 * m, 1e-15) << "cylindrical";
    EXPECT_NEAR(at[2], 5 * m, 1e-15);
  }
}

TEST_F(Legacy, ADensityThatNoMatterHasIsTakenAsSiAndToldSo) {
  std::string text = kGrey;
  text.replace(text.rfind('0'), 1, "3");
  const AnyId id = load(put("Saves/Materials/blue.mtr", text));
  const auto snapshot = bench.document.now();
  EXPECT_EQ(std::get<model::Material>(snapshot->find(id)->body).density, 8000);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(
      notes[0].find(
          "blue.mtr:8:1: no material has a density of 8000 kg/dm^3 (unit 3), so 8000 is taken"),
      std::string::npos)
      << notes[0];
}

TEST_F(Legacy, PrimitivesAreCentredInTheMiddleOfTheirHeight) {
  // A truncated cone of radii R, r about the middle of its height: V = pi h (R^2 + R r + r^2) / 3,
  // centroid from the base h (R^2 + 2 R r + 3 r^2) / 4 (R^2 + R r + r^2).
  const double R = 0.03, r = 0.01, h = 0.1;
  const AnyId cone = load(put("Saves/CSGs/cone.csg",
                              solid_text("Cylinder (0.5, 0, 0.2, 0, 0, 0) 0 3 0 (0.03, 0.01, 0.1, "
                                         "12, 3) \"./Saves/Materials/red.mtr\"")));
  const double s = R * R + R * r + r * r;
  const Moments m = moments(cone);
  EXPECT_NEAR(m.volume, kPi * h * s / 3, 1e-15);
  EXPECT_NEAR(m.first[0] / m.volume, 0.5, 1e-12);
  EXPECT_NEAR(m.first[2] / m.volume, 0.2 - h / 2 + h * (R * R + 2 * R * r + 3 * r * r) / (4 * s),
              1e-12);
  // A wedge whose top is an edge: half the block, centroid a third up.
  const AnyId ridge = load(put("Saves/CSGs/ridge.csg",
                               solid_text("Cube (0, 0, 0, 0, 0, 0) 0 3 0 (0.2, 0.05, 0, 0.05, 0.3) "
                                          "\"./Saves/Materials/red.mtr\"")));
  const Moments w = moments(ridge);
  EXPECT_NEAR(w.volume, 0.2 * 0.05 * 0.3 / 2, 1e-12);
  EXPECT_NEAR(w.first[2] / w.volume, -0.15 + 0.1, 1e-9);
  // The same upside down: an edge below.
  const AnyId keel = load(put("Saves/CSGs/keel.csg",
                              solid_text("Cube (0, 0, 0, 0, 0, 0) 0 3 0 (0, 0.05, 0.2, 0.05, 0.3) "
                                         "\"./Saves/Materials/red.mtr\"")));
  const Moments k = moments(keel);
  EXPECT_NEAR(k.volume, w.volume, 1e-12);
  EXPECT_NEAR(k.first[2] / k.volume, 0.05, 1e-9);
}

TEST_F(Legacy, FramesInEveryNotationTurnAndMoveAsWritten) {
  const double a = 30, b = 40, c = 50, d = kPi / 180;
  const auto z = [](double t) { return spatial::rotation_z(t); };
  const auto y = [](double t) { return spatial::rotation_y(t); };
  const auto x = [](double t) { return spatial::rotation_x(t); };
  const auto product = [](const Pose& p, const Pose& q, const Pose& r) {
    return spatial::compose(spatial::compose(p, q), r);
  };
  const Pose expected[] = {
      product(x(a * d), y(b * d), z(c * d)), product(z(a * d), x(b * d), z(c * d)),
      product(z(a * d), y(b * d), z(c * d)), product(z(a * d), y(b * d), x(c * d))};
  for (int type = 0; type < 4; ++type) {
    const AnyId id = load(put("Saves/CSGs/turn" + std::to_string(type) + ".csg",
                              solid_text("Sphere (0.5, 60, 0.25, 30, 40, 50) 1 " +
                                         std::to_string(type) + " 0 (0.1, 12, 12) \"\"")));
    const Pose t = model::pose(solid(id).nodes[0].placement);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(t.R[i], expected[type].R[i], 1e-14) << type;
    EXPECT_NEAR(t.p[0], 0.25, 1e-15);
    EXPECT_NEAR(t.p[1], 0.5 * std::sin(kPi / 3), 1e-15);
    EXPECT_EQ(t.p[2], 0.25);
  }
  const AnyId id = load(put("Saves/CSGs/ball.csg", solid_text("Sphere (2, 90, 30, 0, 0, 0) 2 3 0 "
                                                              "(0.1, 12, 12) \"\"")));
  const Vec3 p = model::pose(solid(id).nodes[0].placement).p;
  EXPECT_NEAR(p[0], 0, 1e-15);
  EXPECT_NEAR(p[1], 1, 1e-15);
  EXPECT_NEAR(p[2], std::sqrt(3.0), 1e-15);
}

TEST_F(Legacy, ASolidOfSeveralMaterialsIsAnObjectThatWeighsEach) {
  const fs::path file = put("Saves/CSGs/post.csg", kPost);
  const AnyId id = load(file);
  ASSERT_EQ(id.kind, Kind::object);
  const double block = 0.04 * 0.04 * 0.1 - kPi * 0.01 * 0.01 * 0.1;
  const double tip = kPi * 0.1 * (4e-4 + 2e-4 + 1e-4) / 3;
  EXPECT_NEAR(mass(id).mass.mass, 2700 * block + 8000 * tip, 1e-9);
  EXPECT_EQ(bench.document.now()->list(Kind::material).size(), 2U);
  // The object of an .obj keeps the name of its file.
  bench.document.clear();
  const AnyId outer =
      load(put("Saves/Objects/post.obj",
               "\"\" 0 0 0 ( 0 ) { [ \"./Saves/CSGs/post.csg\" ( 0, 0, 0, 0, 0, 0 ) "
               "0 3 0 ] }"));
  EXPECT_EQ(bench.document.now()->find(outer)->name, "post");
  EXPECT_NEAR(mass(outer).mass.mass, 2700 * block + 8000 * tip, 1e-9);
  // As one solid it is all of the first, and says so.
  const AnyId whole = load(file, Kind::solid);
  ASSERT_EQ(whole.kind, Kind::solid);
  EXPECT_NEAR(mass(whole).mass.mass, 2700 * (block + tip), 1e-9);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("2 materials"), std::string::npos) << notes[0];
}

TEST_F(Legacy, PartsOfAnObjectChainAndBareFramesCount) {
  put("Saves/CSGs/cube.csg", solid_text("Cube (0, 0, 0, 0, 0, 0) 0 3 0 (0.1, 0.1, 0.1, 0.1, 0.1) "
                                        "\"./Saves/Materials/red.mtr\""));
  const AnyId id = load(put("Saves/Objects/stack.obj",
                            "\"\"\n0 0 0\n( 1, 2, 3 )\n"
                            "{ [ \"./Saves/CSGs/cube.csg\" ( 1, 0, 0, 90, 0, 0 ) 0 3 0 ]\n"
                            "  { [ \"\" ( 1, 0, 0, 0, 0, 0 ) 0 3 0 ]\n"
                            "    { [ \"./Saves/CSGs/cube.csg\" ( 1, 0, 0, 0, 0, 0 ) 0 3 0 ] }\n"
                            "    { [ \"./Saves/CSGs/cube.csg\" ( 5, 6, 7, 0, 0, 0 ) 0 3 1 ] }\n"
                            "  }\n}\n"));
  const auto snapshot = bench.document.now();
  const auto& o = std::get<model::Object>(snapshot->find(id)->body);
  ASSERT_EQ(o.parts.size(), 3U);
  EXPECT_EQ(o.parts[1].name, "cube_2");
  EXPECT_EQ(o.parts[0].what, o.parts[1].what) << "copies share one solid";
  const Vec3 second = model::pose(o.parts[1].placement).p;
  EXPECT_NEAR(second[0], 1, 1e-15);  // the first turns by 90 degrees, so x runs along y
  EXPECT_NEAR(second[1], 2, 1e-15);
  EXPECT_EQ(model::pose(o.parts[2].placement).p, (Vec3{5, 6, 7}));  // global
  EXPECT_NEAR(mass(id).mass.mass, 3 * 2.7, 1e-9);
  // A second load finds the solid and the material that are there.
  load(folder / "Saves/Objects/stack.obj");
  EXPECT_EQ(bench.document.now()->list(Kind::solid).size(), 1U);
  EXPECT_EQ(bench.document.now()->list(Kind::object).size(), 1U);
}

TEST_F(Legacy, Latin1BecomesUtf8) {
  const AnyId id = load(put(
      "Saves/CSGs/n.csg", "\"Dise\xF1o\" 0 0 0 { [ Sphere (0,0,0,0,0,0) 0 3 0 (0.1,4,4) \"\" ] }"));
  EXPECT_EQ(solid(id).description, "Dise\xC3\xB1o");
}

TEST_F(Legacy, FaultsAreToldAtTheirPlace) {
  const std::string sphere = "Sphere (0, 0, 0, 0, 0, 0) 0 3 0 (0.1, 4, 4) \"\"";
  ASSERT_EQ(refusal(solid_text(sphere)), "");
  EXPECT_EQ(refusal(solid_text("Ball (0, 0, 0, 0, 0, 0) 0 3 0 (0.1, 4, 4) \"\"")),
            "bad.csg:3:5: there is no primitive \"Ball\". There are Sphere, Cylinder, Cube, Cone "
            "and Pyramid.");
  EXPECT_EQ(refusal(solid_text("Sphere (0, 0, 0, 0, 0) 0 3 0 (0.1, 4, 4) \"\"")),
            "bad.csg:3:12: the frame of a node has 5 numbers, not 6.");
  EXPECT_EQ(refusal(solid_text("Sphere (0, 0, 0, 0, 0, 0) 0 7 0 (0.1, 4, 4) \"\"")),
            "bad.csg:3:31: the orientation's type 7 is not known. 0 is Euler XYZ, 1 Euler X, 2 "
            "Euler Y, 3 roll-pitch-yaw.");
  EXPECT_EQ(refusal("\"\"\n 6 0 0\n{ [ " + sphere + " ] }\n"),
            "bad.csg:2:2: the unit 6 of length is not known. 0 is metre, 1 decimetre, 2 "
            "centimetre, 3 millimetre, 4 foot, 5 inch.");
  EXPECT_EQ(refusal("\"\"\n 0 3 0\n{ [ " + sphere + " ] }\n"),
            "bad.csg:2:4: the unit 3 of mass is not known. 0 is kilogram, 1 gram, 2 pound.");
  EXPECT_EQ(refusal("\"\"\n 0 0 1\n{ [ " + sphere + " ] }\n"),
            "bad.csg:2:6: the unit 1 of angle is not known. Only 0 is: degree.");
  EXPECT_EQ(
      refusal(solid_text("Sphere (0, 0, 0, 0, 0, 0) 0 4 0 (0.1, 4, 4) \"\"")),
      "bad.csg:3:31: the orientation's type 4 is the quaternion, and no known file shows how it is "
      "stored in the six numbers of a frame. Convert it to type 3, roll-pitch-yaw, there.");
  EXPECT_EQ(refusal(solid_text("Sphere (0, 0, 0, 0, 0, 0) 0 3 0 (-0.1, 4, 4) \"\"")),
            "bad.csg:3:5: radius of sphere \"sphere\" is -0.1 m; it must be greater than 0.");
  EXPECT_EQ(refusal("\"\"\n 0 0 0\n{ [ " + sphere + " ] { [ " + sphere + " ] } }\n"),
            "bad.csg:3:56: a primitive has a node inside. Only Union, Intersection and Difference "
            "have children.");
  EXPECT_EQ(refusal("\"\"\n 0 0 0\n{ [ Union (0, 0, 0, 0, 0, 0) 0 3 0 ] }\n"),
            "bad.csg:3:5: a union has no nodes inside.");
  EXPECT_EQ(refusal("\"\"\n 0 0 0\n{ [ " + sphere + " ]\n"),
            "bad.csg:4:1: the file ends where { or } should be.");
  EXPECT_EQ(refusal(solid_text(sphere), Kind::material),
            "bad.csg:1:1: this is a solid, not a material. solid.load reads it.");
  EXPECT_EQ(refusal("\"\"\n 1\n(0, 0, 0, 0, 0, 0) 0 3 0\n"),
            "bad.csg:4:1: the file ends where ( before the objects should be.")
      << "a robot by its content";
  EXPECT_NE(refusal(solid_text("Sphere (0, 0, 0, 0, 0, 0) 0 3 0 (0.1, 4, 4) \"./Saves/none.mtr\""))
                .find("there is no file \"./Saves/none.mtr\", which solid \"bad\" refers to"),
            std::string::npos);
}

TEST_F(Legacy, AFileThatEndsAnywhereIsRefusedOrReadButLeavesNothingHalf) {
  const std::string post = kPost;
  for (std::size_t n = 1; n + 1 < post.size(); n += 3) {
    const fs::path file = put("Saves/CSGs/cut.csg", post.substr(0, n));
    auto tx = bench.document.begin("load");
    const auto loaded = io::load(*tx, file, {});
    EXPECT_FALSE(loaded.ok()) << post.substr(0, n);
    EXPECT_EQ(tx->now().size(), 0U);
  }
}

TEST_F(Legacy, WhatIsExportedReadsBackToTheSameBody) {
  // Every kind of node that the format can express, turned and moved, in every notation.
  auto tx = bench.document.begin("make");
  const auto steel = unwrap(tx->add("steel", [] {
    model::Material m;
    m.density = 7850;
    return m;
  }()));
  model::Solid s;
  s.material = steel;
  const auto node = [&](CsgKind kind, std::int32_t parent, model::Placement p,
                        std::array<double, 6> sizes) {
    model::SolidNode n;
    n.kind = kind;
    n.parent = parent;
    n.name = "n" + std::to_string(s.nodes.size());
    n.placement = p;
    n.sizes = sizes;
    s.nodes.push_back(n);
  };
  using model::AngleRepresentation;
  using model::PositionRepresentation;
  node(CsgKind::union_, -1, {{0.1, 0.2, 0.3}, {0.1, 0.2, 0.3}, AngleRepresentation::xyz}, {});
  node(CsgKind::difference, 0, {{}, {0.3, 0, 0.1}, AngleRepresentation::zyz}, {});
  node(CsgKind::box, 1, {{0, 0, 0.1}, {0.1, 0.2, 0.3}}, {0.2, 0.1, 0.05, 0});
  node(CsgKind::cylinder, 1, {{0.02, 0, 0.05}, {}}, {0.01, 0.3, 0});
  node(CsgKind::intersection, 0,
       {{0.3, 1.0, 0.1}, {}, AngleRepresentation::rpy, PositionRepresentation::cylindrical}, {});
  node(CsgKind::sphere, 4, {}, {0.05});
  node(CsgKind::cone, 4, {{0, 0, -0.03}, {}}, {0.05, 0.02, 0.06});
  node(CsgKind::frustum, 0,
       {{0.5, 0.2, 0.4}, {}, AngleRepresentation::rpy, PositionRepresentation::spherical},
       {0.1, 0.08, 0.05, 0, 0.07});
  node(CsgKind::pyramid, 0, {{-0.4, 0, 0}, {0, 0.2, 0}}, {4, 0.1, 0.03, 0.09});
  const auto solid_id = unwrap(tx->add("thing", s));
  model::Object inner, outer;
  inner.parts.push_back({"thing", solid_id, {{0, 0, 1}, {0.5, 0, 0}}, {}});
  const auto inner_id = unwrap(tx->add("inner", inner));
  outer.parts.push_back({"a", inner_id, {{1, 0, 0}, {0, 0, 0.7}}, {}});
  outer.parts.push_back({"b", solid_id, {{0, -1, 0}, {}}, {}});
  const auto outer_id = unwrap(tx->add("outer", outer));
  ASSERT_TRUE(tx->commit().ok());
  const auto before = mass(outer_id);

  const auto files = unwrap(io::export_legacy(*bench.document.now(), outer_id, folder, false));
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files.back(), folder / "Saves/Objects/outer.obj");
  bench.document.clear();
  const auto after = mass(load(files.back()));
  ASSERT_NEAR(before.mass.mass, after.mass.mass, 1e-6);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(before.mass.com[i], after.mass.com[i], 1e-8);
  EXPECT_NEAR(before.mass.inertia.xx, after.mass.inertia.xx, 1e-6);
  EXPECT_NEAR(before.mass.inertia.yz, after.mass.inertia.yz, 1e-6);
}

TEST_F(Legacy, WhatCannotBeExpressedNamesTheNodeAndNothingIsWritten) {
  auto tx = bench.document.begin("make");
  model::Solid s;
  model::SolidNode n;
  n.kind = CsgKind::torus;
  n.name = "ring";
  n.sizes = {0.1, 0.01};
  s.nodes.push_back(n);
  const auto bare = unwrap(tx->add("bare", s));
  s.material = unwrap(tx->add("m", model::Material{}));
  const auto ring = unwrap(tx->add("handle", s));
  const auto sentence = [&](AnyId id) {
    const auto r = io::export_legacy(tx->now(), id, folder / "out", false);
    return r.ok() ? std::string() : r.error().sentence();
  };
  EXPECT_EQ(sentence(ring).substr(0, 14), "there is no fo");
  fs::create_directories(folder / "out");
  EXPECT_EQ(sentence(ring),
            "solid \"handle\": the 2006 format cannot express the torus \"ring\". It has unions, "
            "differences, intersections, spheres, cones, plain cylinders and blocks with equally "
            "inclined sides.");
  EXPECT_NE(sentence(bare).find("has no material"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder / "out"));
}

TEST_F(Legacy, AFileWithOtherContentIsOnlyReplacedWhenAsked) {
  const AnyId id = load(folder / "Saves/Materials/red.mtr");
  const auto refused = io::export_legacy(*bench.document.now(), id, folder, false);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::conflict);
  ASSERT_TRUE(io::export_legacy(*bench.document.now(), id, folder, true).ok());
  EXPECT_TRUE(io::export_legacy(*bench.document.now(), id, folder, false).ok()) << "now it is same";
}

/// Files of the original program, when they are there.
fs::path original_data() {
  const char* given = std::getenv("ROBOMOSP_LEGACY_DATA");
  return given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4";
}

TEST_F(Legacy, AllSolidsAndObjectsOfTheOriginalLoadAndEvaluate) {
  const fs::path data = original_data();
  if (!fs::is_directory(data / "Saves")) GTEST_SKIP() << "no files of the 2006 program here";
  std::size_t solids = 0, objects = 0;
  for (const char* sub : {"Saves/Materials", "Saves/CSGs", "Saves/Objects"})
    for (const auto& entry : fs::directory_iterator(data / sub)) {
      const bool csg = entry.path().extension() == ".csg", obj = entry.path().extension() == ".obj";
      const AnyId id = load(entry.path(), csg ? std::optional(Kind::solid) : std::nullopt);
      ASSERT_TRUE(id) << entry.path();
      if (csg) {
        ++solids;
        EXPECT_GT(moments(id).volume, 0) << entry.path();
      }
      if (obj) {
        ++objects;
        EXPECT_GT(mass(id).volume, 0) << entry.path();
      }
    }
  EXPECT_GT(solids, 0U);
  EXPECT_GT(objects, 0U);
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Native files of solids: all kinds of nodes, and the geometry files beside them.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using document::Document;

/// A tetrahedron with a corner at the origin.
CsgGeometry tetrahedron(double size = 0.1) {
  CsgGeometry g;
  g.form = CsgGeometry::Form::mesh;
  g.points = {0, 0, 0, size, 0, 0, 0, size, 0, 0, 0, size / 3};
  g.triangles = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
  return g;
}
CsgGeometry brep(const std::string& rest = "") {
  CsgGeometry g;
  g.brep = "DBRep_DrawableShape\n\nCASCADE Topology V1, (c) Matra-Datavision\n" + rest;
  return g;
}

class NativeSolids : public testing::Test {
 protected:
  NativeSolids() {
    std::string pattern = (fs::temp_directory_path() / "robomosp_solids_XXXXXX").string();
    folder = ::mkdtemp(pattern.data());
  }
  ~NativeSolids() override {
    std::error_code ec;
    fs::remove_all(folder, ec);
  }
  fs::path put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  }
  static std::string get(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    return s.str();
  }
  std::string refusal(const std::string& fields) {
    auto tx = document.begin("load");
    const auto loaded =
        io::load_text(*tx, "robomosp solid 1\nname s\n" + fields, "s.csg", folder, {});
    return loaded.ok() ? "" : loaded.error().sentence();
  }
  /// The solid of a text; also checks that writing it gives the same bytes.
  model::Solid exact(const std::string& fields) {
    const std::string text = "robomosp solid 1\nname s\n" + fields;
    Document scratch;
    auto tx = scratch.begin("load");
    const auto loaded = io::load_text(*tx, text, "s.csg", folder, {});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence() << "\n" << text;
      return {};
    }
    const auto printed = io::print(tx->now(), loaded->id, folder / "s.csg", {});
    EXPECT_TRUE(printed.ok());
    EXPECT_EQ(printed.ok() ? *printed : "", text);
    return *tx->now().get(SolidId{loaded->id.number});
  }

  fs::path folder;
  Document document;
};

TEST_F(NativeSolids, ModifiersHoldOneNodeAndTheirSizes) {
  const auto s = exact(R"(fillet soft {  radius 2 mm  select "convex and parallel z"
  mirror both {  normal_x 0  normal_y 1  keep 0
    linear_pattern row {  count 3  dx 0.01
      circular_pattern ring {  count 6  angle 90 deg
        chamfer edge {  distance 1 mm
          box b { x 0.1  y 0.1  z 0.1 }
        }
      }
    }
  }
}
)");
  ASSERT_EQ(s.nodes.size(), 6U);
  EXPECT_EQ(s.nodes[0].select, "convex and parallel z");
  EXPECT_EQ(s.nodes[1].sizes, (std::array<double, 6>{0, 1, 0, 0, 0}));
  EXPECT_EQ(s.nodes[2].sizes, (std::array<double, 6>{3, 0.01, 0, 0}));
  EXPECT_EQ(s.nodes[5].parent, 4);

  EXPECT_EQ(refusal("fillet f { radius 1 mm }"),
            "s.csg:3:1: fillet \"f\" has no node inside; it needs exactly one. Put one inside.");
  EXPECT_EQ(refusal("mirror m { sphere a { radius 1 } sphere b { radius 2 } }"),
            "s.csg:3:1: mirror \"m\" has 2 nodes inside; it needs exactly one. Put them into a "
            "union.");
  EXPECT_EQ(refusal("mirror m { normal_x 0 sphere a { radius 1 } }"),
            "s.csg:3:1: the normal of mirror \"m\" is zero. It must be the direction that the "
            "plane faces.");
  EXPECT_EQ(refusal("linear_pattern m { count 2.5 dx 1 sphere a { radius 1 } }"),
            "s.csg:3:1: count of linear_pattern \"m\" is 2.5; it must be a whole number from 1 to "
            "10000.");
  EXPECT_EQ(
      refusal("linear_pattern m { count 2 sphere a { radius 1 } }"),
      "s.csg:3:1: the copies of linear_pattern \"m\" all lie at the same position. Give dx, dy "
      "or dz.");
  EXPECT_EQ(
      refusal("fillet f { radius 1 mm  select \"parallel w\" sphere a { radius 1 } }")
          .substr(0, 81),
      "s.csg:3:1: \"parallel\" in the selection \"parallel w\" must be followed by x, y or z");
}

TEST_F(NativeSolids, ProfilesAreWrittenCurveByCurve) {
  const auto s = exact(R"(prism web {  height 0.01
  profile {
    loop {
      start (0, 0)
      line (0.1, 0)
      arc (0.12, 0.02) (0.1, 0.04)
      spline (0.05, 0.05) (0.02, 0.045) (0, 0.04)
    }
    loop { circle (0.05, 0.02)  radius 8 mm }
  }
}
)");
  ASSERT_TRUE(s.nodes.at(0).profile);
  const auto& loops = s.nodes[0].profile->loops;
  ASSERT_EQ(loops.size(), 2U);
  ASSERT_EQ(loops[0].curves.size(), 3U);
  EXPECT_EQ(loops[0].curves[1].kind, CsgCurve::Kind::arc);
  EXPECT_EQ(loops[0].curves[1].points[1], (std::array<double, 2>{0.1, 0.04}));
  EXPECT_EQ(loops[0].curves[2].points.size(), 3U);
  EXPECT_EQ(loops[1].curves[0].points[1], (std::array<double, 2>{0.008, 0}));
  exact(
      "revolution cup {  angle 90 deg\n  profile {\n    loop {\n      start (0.1, 0)\n      line "
      "(0.2, 0)\n      line (0.2, 0.1)\n    }\n  }\n}\n");

  // Several points behind one `line` are as many lines.
  auto tx = document.begin("load");
  const auto loaded = io::load_text(
      *tx,
      "robomosp solid 1 \nname s prism p { height 1 profile { loop { start (0,0) line (1,0) "
      "(1,1) } } }",
      "s.csg", folder, {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(tx->now().get(SolidId{loaded->id.number})->nodes[0].profile->loops[0].curves.size(),
            2U);
}

TEST_F(NativeSolids, ProfilesThatEncloseNothingAreRefused) {
  const auto loop = [&](const std::string& inside) {
    return refusal("prism p { height 1 profile { loop { " + inside + " } } }");
  };
  EXPECT_EQ(refusal("prism p { height 1 }"), "s.csg:3:1: \"profile\" is missing in a prism.");
  EXPECT_EQ(refusal("prism p { height 1 profile { } }"),
            "s.csg:3:1: the profile of prism \"p\" has no loops. Give it at least one outline.");
  EXPECT_EQ(loop("start (0, 0)"), "s.csg:3:1: loop 1 of the profile of prism \"p\" has no curves.");
  EXPECT_EQ(loop("line (1, 0)"), "s.csg:3:30: this loop has no start. Such as: start (0, 0)");
  EXPECT_EQ(loop("start (0, 0) line (1, 0)"),
            "s.csg:3:1: loop 1 of the profile of prism \"p\" encloses no area: it has fewer than "
            "three corners.");
  EXPECT_EQ(loop("start (0, 0) line (1, 0) line (1, 0) line (0, 1)"),
            "s.csg:3:1: curve 2 of loop 1 of the profile of prism \"p\" ends where it begins. "
            "Remove it.");
  EXPECT_EQ(loop("start (0, 0) arc (1, 0) (2, 0) line (0, 1)"),
            "s.csg:3:1: the three points of curve 1 of loop 1 of the profile of prism \"p\" are on "
            "a line or coincide. Use a line, or a circle in a separate loop.");
  EXPECT_EQ(loop("start (0, 0) arc (1, 0)"),
            "s.csg:3:50: an arc needs two points: a via point and its end.");
  EXPECT_EQ(loop("start (0, 0) line (1, 0, 0)"),
            "s.csg:3:55: \"line\" needs points such as (10 mm, 0).");
  EXPECT_EQ(loop("start (0, 0) spline (1, 0) (1, 0, 2)"),
            "s.csg:3:64: these parentheses hold 3 numbers, those before them 2.");
  EXPECT_EQ(loop("circle (0, 0)"), "s.csg:3:30: the circle of this loop has no radius.");
  EXPECT_EQ(loop("circle (0, 0) radius 0"),
            "s.csg:3:1: the radius of loop 1 of the profile of prism \"p\" is 0 m; it must be "
            "greater than 0.");
  EXPECT_EQ(refusal("revolution r { profile { loop { circle (1, 0) radius 2 } } }"),
            "s.csg:3:1: loop 1 of the profile of revolution \"r\" reaches x = -1 m, beyond its "
            "axis of revolution. Keep x at 0 or more.");
  EXPECT_EQ(refusal("box b { at (1, 2, 3) (4, 5, 6) x 1 y 1 z 1 }"),
            "s.csg:3:12: \"at\" needs its numbers in a single pair of parentheses.");
}

TEST_F(NativeSolids, PositionsMayBeCylindricalSphericalAndGlobal) {
  const auto s = exact(R"(union u {
  sphere a { cylindrical (0.1, 30 deg, 0.02)  radius 0.01 }
  sphere b { spherical (0.1, 30 deg, 90 deg)  rpy (0, 0, 1)  frame global  radius 0.01 }
  sphere c { cylindrical (0, 0, 0)  radius 0.01 }
}
)");
  EXPECT_EQ(s.nodes.at(1).placement.coordinates, model::PositionRepresentation::cylindrical);
  EXPECT_EQ(s.nodes.at(2).placement.coordinates, model::PositionRepresentation::spherical);
  EXPECT_TRUE(s.nodes.at(2).is_global);
  EXPECT_EQ(refusal("sphere s { radius 1 at (0,0,0) spherical (0,0,0) }"),
            "s.csg:3:32: \"spherical\" cannot be combined with \"at\". A placement can have only "
            "one position.");
  EXPECT_EQ(refusal("sphere s { radius 1 cylindrical (1, 2 m, 3) }"),
            "s.csg:3:37: 2 m is a length; an angle (rad) is expected.");
}

TEST_F(NativeSolids, PrimitivesThatStandMayBeCentred) {
  const auto s = exact("box b { at (1, 2, 3)  centred true  x 1  y 1  z 1 }\n");
  EXPECT_TRUE(s.nodes.at(0).is_centred);
  EXPECT_NE(refusal("sphere s { radius 1 centred true }").find("centred"), std::string::npos);
}

TEST_F(NativeSolids, CustomNodesKeepTheParametersOfTheirPlugin) {
  const auto s =
      exact("custom wheel { at (0, 0, 0.1)  primitive gear { module 0.002  teeth 20 } }\n");
  EXPECT_EQ(s.nodes.at(0).primitive.name, "gear");
  EXPECT_EQ(std::get<std::int64_t>(s.nodes[0].primitive.params.at("teeth")), 20);
  exact("custom wheel { primitive gear }\n");
  EXPECT_EQ(refusal("custom c { }"), "s.csg:3:1: \"primitive\" is missing in a custom.");
}

TEST_F(NativeSolids, GeometriesAreWrittenBesideTheirSolidAndReadBackToTheBit) {
  const auto mesh = io::make_geometry(tetrahedron(1.0 / 3));
  CsgGeometry text = brep("Locations 0\n");
  text.source = "bracket \"7\".step";
  const auto shape = io::make_geometry(text);
  ASSERT_TRUE(mesh.ok() && shape.ok());
  model::Solid solid;
  solid.nodes.resize(4);
  solid.nodes[0] = {CsgKind::union_, "all", -1, {}, {}};
  const std::shared_ptr<const CsgGeometry> held[] = {*mesh, *shape, *mesh};
  for (std::size_t i = 0; i < 3; ++i) {
    auto& n = solid.nodes[i + 1];
    n = {CsgKind::imported, "part" + std::to_string(i), 0, {}, {1}};
    n.geometry = held[i];
  }
  auto tx = document.begin("make");
  const auto id = tx->add("housing", solid);
  const auto saved = io::save(*tx, *id, folder / "housing.csg", {});
  ASSERT_TRUE(saved.ok()) << saved.error().sentence();
  ASSERT_TRUE(tx->commit().ok());
  ASSERT_EQ(saved->size(), 3U);  // two contents, and the record last
  EXPECT_EQ(saved->back().filename(), "housing.csg");
  for (const auto& file : *saved) EXPECT_TRUE(file.filename().string().starts_with("housing"));
  const fs::path ply = folder / io::geometry_file_name("housing.csg", **mesh);
  const fs::path bre = folder / io::geometry_file_name("housing.csg", **shape);
  EXPECT_EQ(get(bre), text.brep);
  EXPECT_NE(get(folder / "housing.csg").find("source \"bracket \\\"7\\\".step\""),
            std::string::npos);

  Document other;
  auto tx2 = other.begin("load");
  const auto loaded = io::load(*tx2, folder / "housing.csg", {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  const auto& nodes = tx2->now().get(SolidId{loaded->id.number})->nodes;
  EXPECT_EQ(nodes[1].geometry->points, (*mesh)->points);
  EXPECT_EQ(nodes[1].geometry->triangles, (*mesh)->triangles);
  EXPECT_EQ(nodes[1].geometry->digest, (*mesh)->digest);
  EXPECT_EQ(nodes[1].geometry, nodes[3].geometry) << "a file is read once";
  EXPECT_EQ(nodes[2].geometry->brep, text.brep);
  EXPECT_EQ(nodes[2].geometry->source, text.source);
  ASSERT_TRUE(tx2->commit().ok());
  EXPECT_EQ(other.content_digest(), document.content_digest());

  // Another content never lands in the same file; a damaged file is made whole by the next save.
  const std::string whole = get(ply);
  std::ofstream(ply, std::ios::binary) << "junk";
  auto tx3 = document.begin("again");
  ASSERT_TRUE(io::save(*tx3, *id, folder / "housing.csg", {}).ok());
  EXPECT_EQ(get(ply), whole);
  EXPECT_NE(io::geometry_file_name("housing.csg", **io::make_geometry(tetrahedron(0.2))),
            io::geometry_file_name("housing.csg", **mesh));
}

TEST_F(NativeSolids, FaultsOfGeometryFilesAreOneSentenceWithThePlaceThatNamesThem) {
  const std::string good = io::geometry_bytes(tetrahedron()).value();
  const auto told = [&](const std::string& file) {
    return refusal("imported part { geometry \"" + file + "\" }");
  };
  put("good.ply", good);
  EXPECT_EQ(told("good.ply"), "");
  EXPECT_EQ(
      told("gone.ply"),
      "s.csg:3:26: there is no file \"gone.ply\", which node \"part\" of \"s.csg\" refers to. "
      "Looked in \"" +
          folder.string() + "\".");
  put("cut.ply", good.substr(0, good.size() - 5));
  EXPECT_EQ(told("cut.ply"),
            "s.csg:3:26: \"cut.ply\": the file has 143 bytes after its header, but 4 vertices "
            "and 4 triangles need 148. It is truncated or does not contain triangles only.");
  put("text.ply", "ply\nformat ascii 1.0\nend_header\n");
  EXPECT_EQ(
      told("text.ply").substr(0, 83),
      "s.csg:3:26: \"text.ply\": the header of this PLY file is not that of a robomosp mesh.");
  put("none.ply", "");
  EXPECT_NE(told("none.ply").find("this is not a PLY file"), std::string::npos);
  put("x.brep", "solid");
  EXPECT_NE(told("x.brep").find("this is not a B-rep in the text form of Open CASCADE"),
            std::string::npos);
  put("x.step", "ISO-10303-21");
  EXPECT_EQ(told("x.step"),
            "s.csg:3:26: \"" + (folder / "x.step").string() +
                "\" is not a geometry file: it ends neither with .brep nor with .ply. Import other "
                "formats first.");
  EXPECT_EQ(refusal("imported part { }"), "s.csg:3:1: \"geometry\" is missing in an imported.");

  CsgGeometry open = tetrahedron();
  open.triangles.resize(9);
  EXPECT_TRUE(io::make_geometry(open).ok()) << "meshes are kept as they are";
  CsgGeometry turned = tetrahedron();
  std::swap(turned.triangles[0], turned.triangles[1]);
  EXPECT_TRUE(io::make_geometry(turned).ok());
  EXPECT_NE(io::make_geometry(turned).value()->digest, io::make_geometry(open).value()->digest);
  CsgGeometry far = tetrahedron();
  far.triangles[0] = 7;
  EXPECT_EQ(io::make_geometry(far).error().sentence(),
            "triangle 0 of the mesh refers to point 7 of 4.");
  CsgGeometry nan = tetrahedron();
  nan.points[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(io::make_geometry(nan).error().sentence(), "point 1 of the mesh is not finite.");
}

TEST_F(NativeSolids, DigestsTellContentsApartAndNothingElse) {
  const auto digest = [](CsgGeometry g) { return io::make_geometry(std::move(g)).value()->digest; };
  CsgGeometry named = tetrahedron();
  named.source = "elsewhere";
  EXPECT_EQ(digest(tetrahedron()), digest(named));
  EXPECT_NE(digest(tetrahedron()), digest(tetrahedron(0.2)));
  EXPECT_NE(digest(brep()), digest(brep(" ")));
  CsgGeometry other = tetrahedron();
  std::rotate(other.triangles.begin(), other.triangles.begin() + 3, other.triangles.end());
  EXPECT_NE(digest(tetrahedron()), digest(other));
}

TEST_F(NativeSolids, MutatedMeshFilesAreRefusedOrReadToTheSameBytes) {
  const std::string good = io::geometry_bytes(tetrahedron()).value();
  std::mt19937 random(test::seed());
  const auto pick = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  std::size_t refused = 0;
  for (int run = 0; run < 3000; ++run) {
    std::string bytes = good;
    for (std::size_t n = 1 + pick(3); n > 0; --n) {
      const std::size_t at = pick(bytes.size());
      if (pick(3) == 0) bytes.erase(at, 1 + pick(9));
      else bytes[at] = static_cast<char>(pick(256));
      if (bytes.empty()) break;
    }
    const auto read = io::parse_geometry(CsgGeometry::Form::mesh, bytes, "m.ply");
    if (!read.ok()) {
      EXPECT_FALSE(read.error().message.empty());
      ++refused;
      continue;
    }
    const auto again =
        io::parse_geometry(CsgGeometry::Form::mesh, io::geometry_bytes(**read).value(), "m.ply");
    ASSERT_TRUE(again.ok());
    EXPECT_EQ((*again)->digest, (*read)->digest);
  }
  EXPECT_GT(refused, 1000U);
}

TEST_F(NativeSolids, FilesInMemoryReferToEachOtherAndToTheirGeometries) {
  io::MemoryFiles files;
  files.texts["arm.part"] =
      "robomosp object 1\nname arm\npart a { solid \"link.csg\" }\npart b { solid \"link.csg\" }\n";
  files.texts["link.csg"] =
      "robomosp solid 1\nname link\nimported body { geometry \"link.ply\"  source \"arm.step\" }\n";
  files.geometries["link.ply"] = io::make_geometry(tetrahedron()).value();
  auto tx = document.begin("import");
  const auto loaded = io::load_memory(*tx, files, "arm.part", "arm.step", folder, {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(tx->now().size(), 2U);
  EXPECT_EQ(loaded->all.size(), 2U);
  const auto solid = tx->now().find(Kind::solid, "link");
  ASSERT_TRUE(solid);
  EXPECT_EQ(tx->now().find(*solid)->file, "");
  const auto& node = tx->now().get(SolidId{solid->number})->nodes[0];
  EXPECT_EQ(node.geometry->source, "arm.step");
  EXPECT_EQ(node.geometry->digest, files.geometries["link.ply"]->digest);

  files.texts["link.csg"] = "robomosp solid 1\nname link\nbox b { }\n";
  EXPECT_EQ(io::load_memory(*tx, files, "arm.part", "arm.step", folder, {}).error().sentence(),
            "arm.step/link.csg:3:1: \"x\" is missing in a box.");
  EXPECT_FALSE(io::load_memory(*tx, files, "leg.part", "arm.step", folder, {}).ok());
}

}  // namespace
}  // namespace robomosp

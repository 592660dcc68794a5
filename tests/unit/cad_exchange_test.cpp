// SPDX-License-Identifier: Apache-2.0
// Foreign files in and out: volumes, names, colours, assemblies, units, repairs, and files that are
// damaged. Reading runs in the worker program, as for users.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <sstream>

#include <gtest/gtest.h>
#include <robomosp/sdk/io.h>

#include "cad_exchange/dxf_reader.h"
#include "cad_exchange/mesh_repair.h"
#include "cad_exchange/scene.h"
#include "cad_exchange/spline2d.h"
#include "cad_exchange/stl_reader.h"
#include "cad_exchange/writers.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"
#include "support/workbench.h"
#include "support/zip_package.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
namespace cx = cad_exchange;
using test::unwrap;
constexpr double kPi = std::numbers::pi;

struct Exchange : testing::Test {
  Exchange() : folder(fs::path(testing::TempDir()) / ("exchange-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~Exchange() override { fs::remove_all(folder); }

  std::string put(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return (folder / name).string();
  }
  /// What an importer makes of a file.
  Result<Imported> read(const std::string& path, Map values = {}) const {
    const std::string e = fs::path(path).extension().string().substr(1);
    for (const ProviderInfo& info : bench.registry.list(Importer::kInterfaceId)) {
      const auto importer = unwrap(bench.registry.create<Importer>(info.name));
      for (const std::string_view known : text::split(importer->extensions(), ','))
        if (known == e) {
          const auto params = make_params(unwrap(check(info.schema, values)));
          NoProgress progress;
          return importer->read(path, *params, progress);
        }
    }
    return error(ErrorCode::unknown_name, "no importer");
  }
  /// The same as records of the document; the main one.
  AnyId load(const Imported& made) {
    io::MemoryFiles files;
    for (const ImportedGeometry& g : made.geometries)
      files.geometries.emplace(g.name, unwrap(io::make_geometry(g.geometry)));
    for (const ImportedFile& f : made.records) files.texts.emplace(f.name, f.text);
    auto tx = unwrap_transaction();
    auto loaded = io::load_memory(*tx, files, made.records.back().name, "test", folder, {});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence();
      return {};
    }
    const auto commit = tx->commit();
    EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
    return loaded->id;
  }
  Result<document::Transaction> unwrap_transaction() { return bench.document.begin("import"); }

  Result<std::string> write(const std::string& extension, std::span<const ExportItem> items,
                            Map values = {}) const {
    for (const ProviderInfo& info : bench.registry.list(Exporter::kInterfaceId)) {
      const auto exporter = unwrap(bench.registry.create<Exporter>(info.name));
      for (const std::string_view known : text::split(exporter->extensions(), ','))
        if (known == extension) {
          const auto params = make_params(unwrap(check(info.schema, values)));
          NoProgress progress;
          ExportTask task;
          task.extension = extension;
          task.name = "file";
          task.items = items;
          auto files = exporter->write(task, *params, progress);
          if (!files.ok()) return std::move(files).error();
          EXPECT_EQ(files->size(), 1U);
          EXPECT_EQ(files->front().name, "file");
          return std::move(files->front().bytes);
        }
    }
    return error(ErrorCode::unknown_name, "no exporter");
  }
  /// A cylinder of radius 20 mm and height 50 mm less a bore of 10 mm, exact and as a mesh.
  struct Part {
    CsgGeometry geometry;
    Mesh mesh;
    double volume = 0;
  };
  Part bushing() const {
    const auto engine = unwrap(bench.registry.create<CsgEngine>("occt"));
    CsgTree tree;
    tree.nodes.resize(3);
    tree.nodes[0].kind = CsgKind::difference;
    tree.nodes[1] = {CsgKind::cylinder, 0, {}, {0.02, 0.05, 0}, "body"};
    tree.nodes[2] = {CsgKind::cylinder, 0, {}, {0.01, 0.05, 0}, "bore"};
    tree.nodes[2].placement.p[0] = 0.004;  // off the centre, so that a turned copy differs
    NoProgress progress;
    Part p;
    const auto shape = unwrap(engine->evaluate(tree, progress));
    if (!shape) return p;
    p.geometry = unwrap(engine->geometry(*shape, progress));
    p.mesh = unwrap(engine->mesh(*shape, {}, progress));
    p.volume = kPi * (0.02 * 0.02 - 0.01 * 0.01) * 0.05;
    return p;
  }
  double volume(AnyId id) {
    NoProgress progress;
    return unwrap(bench.derived.mass(*bench.document.now(), id, progress)).volume;
  }
  /// An assembly "arm" with the parts "left" and "right", two copies of one, the right one turned.
  static std::vector<ExportItem> assembly(const Part& part, bool exact) {
    std::vector<ExportItem> items(3);
    items[0].name = "arm";
    for (std::size_t i : {1U, 2U}) {
      items[i].name = i == 1 ? "left" : "right";
      items[i].parent = 0;
      items[i].definition = 7;
      items[i].colour = {0.8F, 0.2F, 0.1F, 1};
      if (exact) items[i].geometry = &part.geometry;
      else items[i].mesh = &part.mesh;
    }
    items[1].pose.p = {0.1, 0, 0.02};
    items[2].pose = spatial::rotation_z(0.5);
    items[2].pose.p = {-0.1, 0.03, 0};
    return items;
  }

  test::Workbench bench;
  fs::path folder;
};

/// Volume and triangles of all meshes of a file, placements left out.
std::pair<double, std::size_t> meshes_of(const Imported& made) {
  double volume = 0;
  std::size_t triangles = 0;
  for (const ImportedGeometry& g : made.geometries) {
    const auto& p = g.geometry.points;
    for (std::size_t t = 0; t + 2 < g.geometry.triangles.size(); t += 3) {
      const auto at = [&](std::size_t c, std::size_t k) {
        return p[3 * std::size_t{g.geometry.triangles[t + c]} + k];
      };
      volume += (at(0, 0) * (at(1, 1) * at(2, 2) - at(1, 2) * at(2, 1)) -
                 at(0, 1) * (at(1, 0) * at(2, 2) - at(1, 2) * at(2, 0)) +
                 at(0, 2) * (at(1, 0) * at(2, 1) - at(1, 1) * at(2, 0))) /
                6;
      ++triangles;
    }
  }
  return {volume, triangles};
}

std::string all_notes(const Imported& made) {
  std::string s;
  for (const auto& n : made.notes) s += n + "\n";
  return s;
}

/// A box from 0 to size, as STL would hold it: no corner shared.
void box(double size, std::vector<double>& points, std::vector<std::uint32_t>& triangles) {
  static constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : kQuads)
    for (const int c : {0, 1, 2, 0, 2, 3}) {
      triangles.push_back(static_cast<std::uint32_t>(points.size() / 3));
      for (int k = 0; k < 3; ++k) points.push_back((q[c] >> k & 1) ? size : 0.0);
    }
}

// --- exact formats -------------------------------------------------------------------------

TEST_F(Exchange, StepAndIgesKeepTheVolumeOfASolid) {
  const Part part = bushing();
  std::vector<ExportItem> items(1);
  items[0].name = "bushing";
  items[0].geometry = &part.geometry;
  items[0].colour = {0.1F, 0.5F, 0.9F, 1};
  for (const auto& [extension, unit, schema] :
       std::vector<std::array<std::string, 3>>{{"step", "mm", "ap214"},
                                               {"stp", "in", "ap203"},
                                               {"step", "m", "ap242"},
                                               {"iges", "mm", "ap214"},
                                               {"igs", "in", "ap214"}}) {
    const auto bytes = write(extension, items, Map{{"unit", unit}, {"schema", schema}});
    ASSERT_TRUE(bytes.ok()) << bytes.error().sentence();
    const auto made = read(put("b." + extension, *bytes), Map{{"name", extension + unit}});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    ASSERT_EQ(made->geometries.size(), 1U) << extension << " " << all_notes(*made);
    EXPECT_EQ(made->geometries[0].geometry.form, CsgGeometry::Form::brep);
    const AnyId id = load(*made);
    EXPECT_EQ(id.kind, Kind::solid) << extension;
    // IGES in inches rounds each number once more.
    EXPECT_NEAR(volume(id) / part.volume, 1, extension == "igs" ? 1e-8 : 1e-9)
        << extension << " in " << unit;
    EXPECT_NE(made->records[0].text.find("colour (0.1, 0.5, 0.9)"), std::string::npos)
        << made->records[0].text;
  }
}

TEST_F(Exchange, AVeryLargeSolidGetsAChordForItsSize) {
  const Part part = bushing();
  std::vector<ExportItem> items(1);
  items[0].name = "bushing";
  items[0].geometry = &part.geometry;
  auto bytes = write("step", items, Map{{"unit", "mm"}});
  ASSERT_TRUE(bytes.ok()) << bytes.error().sentence();
  const auto small = read(put("small.step", *bytes), Map{{"name", "small"}});
  ASSERT_TRUE(small.ok());
  EXPECT_EQ(all_notes(*small).find("chord"), std::string::npos);
  // The same numbers as metres: a thousand times the size.
  const std::string milli = "SI_UNIT(.MILLI.,.METRE.)";
  const auto at = bytes->find(milli);
  ASSERT_NE(at, std::string::npos);
  bytes->replace(at, milli.size(), "SI_UNIT($,.METRE.)");
  const auto large = read(put("large.step", *bytes), Map{{"name", "large"}});
  ASSERT_TRUE(large.ok()) << large.error().sentence();
  EXPECT_NE(
      all_notes(*large).find("mesh of solids larger than 2 m is coarser, see chord: \"large\""),
      std::string::npos)
      << all_notes(*large);
  const AnyId id = load(*large);
  EXPECT_NEAR(volume(id) / part.volume, 1e9, 1);
  const double chord = bench.document.now()->get(SolidId{id.number})->chord;
  EXPECT_GT(chord, 1e-4 * 2);
  EXPECT_LT(chord, 0.1) << "still a hundredth of a percent or so of its size";
}

TEST_F(Exchange, StepKeepsNamesColoursAndSharedParts) {
  const Part part = bushing();
  const auto items = assembly(part, true);
  const auto bytes = write("step", items);
  ASSERT_TRUE(bytes.ok()) << bytes.error().sentence();
  const auto made = read(put("arm.step", *bytes));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ(made->geometries.size(), 1U) << "the copies must share their solid";
  const AnyId id = load(*made);
  ASSERT_EQ(id.kind, Kind::object);
  const auto now = bench.document.now();
  const auto& object = *now->get(ObjectId{id.number});
  EXPECT_EQ(now->find(id)->name, "arm");
  ASSERT_EQ(object.parts.size(), 2U);
  EXPECT_EQ(object.parts[0].name, "left");
  EXPECT_EQ(object.parts[1].name, "right");
  EXPECT_EQ(object.parts[0].what, object.parts[1].what);
  for (std::size_t i = 0; i < 2; ++i) {
    const Pose t = model::pose(object.parts[i].placement);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(t.R[k], items[i + 1].pose.R[k], 1e-12);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(t.p[k], items[i + 1].pose.p[k], 1e-12);
  }
  EXPECT_NEAR(volume(id) / (2 * part.volume), 1, 1e-9);
  const auto& solid = *now->get(SolidId{object.parts[0].what.number});
  const auto& material = *now->get(solid.material);
  EXPECT_NEAR(material.colour.r, 0.8, 1e-3);
  EXPECT_NEAR(material.colour.g, 0.2, 1e-3);
  EXPECT_NEAR(material.colour.b, 0.1, 1e-3);
  EXPECT_EQ(material.density, 2700);
  EXPECT_NE(all_notes(*made).find("density of aluminium"), std::string::npos) << all_notes(*made);
}

// --- IGES of loose faces -----------------------------------------------------------------------

/// Writes IGES of flat patches, each a surface of its own, and of groups of them.
class LooseFaces {
 public:
  using Corner = std::array<double, 3>;
  /// Corners in turn; entries are counted from 1.
  int patch(const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
    std::ostringstream s;
    s << "128,1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.";
    for (const Corner& p : {a, b, d, c})
      for (const double x : p) s << "," << x << ".";
    s << ",0.,1.,0.,1.;";
    return add(128, 0, s.str());
  }
  /// The faces of a box from `low` to `high`, whole millimetres; `without` leaves one out.
  std::vector<int> box(const Corner& low, const Corner& high, int without = -1) {
    static constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    const auto corner = [&](int i) {
      return Corner{(i & 1 ? high : low)[0], (i & 2 ? high : low)[1], (i & 4 ? high : low)[2]};
    };
    std::vector<int> made;
    for (int i = 0; i < 6; ++i)
      if (i != without)
        made.push_back(patch(corner(kSides[i][0]), corner(kSides[i][1]), corner(kSides[i][2]),
                             corner(kSides[i][3])));
    return made;
  }
  void group(const std::vector<int>& members) {
    std::ostringstream s;
    s << "402," << members.size();
    for (const int m : members) s << "," << 2 * m - 1;
    s << ";";
    for (const int m : members) status_[static_cast<std::size_t>(m - 1)] = "00010000";
    add(402, 7, s.str());
  }
  std::string text() const {
    std::ostringstream out;
    const auto line = [&](std::string body, char section, int number) {
      body.resize(72, ' ');
      char end[16];
      std::snprintf(end, sizeof end, "%c%7d\n", section, number);
      out << body << end;
    };
    line("faces", 'S', 1);
    line("1H,,1H;,5Hfaces,5Hfaces,4Htest,4Htest,32,38,6,308,15,5Hfaces,1.,2,2HMM,1,", 'G', 1);
    line("0.01,13H260101.000000,0.001,1000.,4Htest,4Htest,11,0,13H260101.000000;", 'G', 2);
    const auto eights = [](const std::vector<std::string>& words) {
      std::string s;
      for (const std::string& w : words) s += std::string(8 - w.size(), ' ') + w;
      return s;
    };
    int first = 1;
    std::vector<std::vector<std::string>> lines;
    for (std::size_t i = 0; i < data_.size(); ++i) {
      std::vector<std::string> cut;
      for (std::string rest = data_[i]; !rest.empty();) {
        std::size_t n = rest.size() <= 64 ? rest.size() : rest.rfind(',', 63) + 1;
        cut.push_back(rest.substr(0, n));
        rest.erase(0, n);
      }
      const std::string type = std::to_string(type_[i]);
      const int number = 2 * static_cast<int>(i) + 1;
      line(eights({type, std::to_string(first), "0", "0", "0", "0", "0", "0", status_[i]}), 'D',
           number);
      line(eights({type, "0", "0", std::to_string(cut.size()), std::to_string(form_[i])}), 'D',
           number + 1);
      first += static_cast<int>(cut.size());
      lines.push_back(std::move(cut));
    }
    int at = 1;
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (std::string body : lines[i]) {
        body.resize(64, ' ');
        char back[16];
        std::snprintf(back, sizeof back, " %7d", 2 * static_cast<int>(i) + 1);
        line(body + back, 'P', at++);
      }
    char end[40];
    std::snprintf(end, sizeof end, "S%7dG%7dD%7dP%7d", 1, 2, 2 * static_cast<int>(data_.size()),
                  at - 1);
    line(end, 'T', 1);
    return out.str();
  }

 private:
  int add(int type, int form, std::string data) {
    type_.push_back(type);
    form_.push_back(form);
    status_.emplace_back("00000000");
    data_.push_back(std::move(data));
    return static_cast<int>(data_.size());
  }
  std::vector<int> type_, form_;
  std::vector<std::string> status_, data_;
};

TEST_F(Exchange, LooseFacesOfIgesBecomeTheSolidsThatTheyBound) {
  // Two boxes that touch with a whole face, one with a hollow in it, and a block in the hollow.
  LooseFaces file;
  file.box({0, 0, 0}, {10, 10, 10});
  file.box({10, 0, 0}, {30, 10, 10});
  file.box({100, 0, 0}, {140, 40, 40});
  file.box({110, 10, 10}, {130, 30, 30});
  file.box({115, 15, 15}, {120, 20, 20});
  const Imported made = unwrap(read(put("loose.igs", file.text())));
  EXPECT_EQ(made.geometries.size(), 4U) << all_notes(made);
  EXPECT_NE(all_notes(made).find("30 faces of the file were joined to 4 solids"), std::string::npos)
      << all_notes(made);
  EXPECT_NE(all_notes(made).find("a shell inside another became its cavity"), std::string::npos)
      << all_notes(made);
  const double expected = 1e-6 + 2e-6 + (64e-6 - 8e-6) + 0.125e-6;
  EXPECT_NEAR(volume(load(made)), expected, 1e-9 * expected);
}

TEST_F(Exchange, GroupsOfAnIgesFileAreJoinedEachByItself) {
  // Boxes that touch, their faces in no order: only the groups say which belong together.
  LooseFaces file;
  std::vector<int> one = file.box({0, 0, 0}, {10, 10, 10}, 0), two;
  two = file.box({10, 0, 0}, {30, 10, 10});
  one.push_back(file.patch({0, 0, 0}, {0, 10, 0}, {10, 10, 0}, {10, 0, 0}));
  file.group(one);
  file.group(two);
  const Imported made = unwrap(read(put("groups.igs", file.text())));
  EXPECT_EQ(made.geometries.size(), 2U) << all_notes(made);
  EXPECT_NEAR(volume(load(made)), 3e-6, 1e-14);
}

TEST_F(Exchange, WhatOfLooseFacesDoesNotCloseIsSaidWithItsShare) {
  LooseFaces file;
  file.box({0, 0, 0}, {10, 10, 10});
  file.box({50, 0, 0}, {60, 10, 10}, 3);
  const Imported made = unwrap(read(put("open.igs", file.text())));
  EXPECT_EQ(made.geometries.size(), 1U) << all_notes(made);
  EXPECT_NE(all_notes(made).find("5 faces do not close to a solid"), std::string::npos)
      << all_notes(made);
  EXPECT_NE(all_notes(made).find("45.5 % of the area"), std::string::npos) << all_notes(made);
  EXPECT_NEAR(volume(load(made)), 1e-6, 1e-14);
}

TEST_F(Exchange, ADensityIsTakenAsGivenAndNothingIsAssumed) {
  const Part part = bushing();
  const auto bytes = unwrap(write("step", assembly(part, true)));
  const auto made = read(put("arm.step", bytes), Map{{"density", 7850.0}});
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_TRUE(made->notes.empty()) << all_notes(*made);
  NoProgress progress;
  const AnyId id = load(*made);
  const auto mass = unwrap(bench.derived.mass(*bench.document.now(), id, progress));
  EXPECT_NEAR(mass.mass.mass, 7850 * 2 * part.volume, 1e-6);
}

TEST_F(Exchange, AMeshIsNotWrittenAsAnExactSolid) {
  const Part part = bushing();
  const auto bytes = write("step", assembly(part, false));
  ASSERT_FALSE(bytes.ok());
  EXPECT_EQ(bytes.error().code, ErrorCode::unsupported);
}

// --- meshes --------------------------------------------------------------------------------

TEST_F(Exchange, MeshFormatsKeepTrianglesAndVolume) {
  const Part part = bushing();
  const std::size_t triangles = part.mesh.triangle_count();
  const auto items = assembly(part, false);
  for (const std::string extension : {"stl", "obj", "ply", "glb", "3mf"}) {
    const auto bytes = write(extension, items);
    ASSERT_TRUE(bytes.ok()) << bytes.error().sentence();
    const auto made = read(put("m." + extension, *bytes));
    ASSERT_TRUE(made.ok()) << extension << ": " << made.error().sentence();
    const auto [volume, count] = meshes_of(*made);
    // STL and PLY hold one mesh, OBJ two, GLB and 3MF one that is used twice.
    const bool is_shared = extension == "glb" || extension == "3mf";
    const double copies = is_shared ? 1 : 2;
    EXPECT_EQ(count, static_cast<std::size_t>(copies) * triangles) << extension;
    EXPECT_NEAR(volume / copies, part.volume, 0.01 * part.volume) << extension;
    if (is_shared) {
      const AnyId id = load(*made);
      ASSERT_EQ(id.kind, Kind::object) << extension;
      const auto now = bench.document.now();
      const auto& object = *now->get(ObjectId{id.number});
      ASSERT_EQ(object.parts.size(), 2U) << extension;
      EXPECT_EQ(object.parts[0].what, object.parts[1].what);
      EXPECT_NEAR(model::pose(object.parts[0].placement).p[2], 0.02, 1e-6) << extension;
      const Pose t = model::pose(object.parts[1].placement);
      EXPECT_NEAR(t.R[0], std::cos(0.5), 1e-6) << extension;
      EXPECT_NEAR(t.R[3], std::sin(0.5), 1e-6) << extension;
      if (extension == "glb") {
        EXPECT_EQ(object.parts[0].name, "left");
        const auto& solid = *now->get(SolidId{object.parts[0].what.number});
        EXPECT_NEAR(now->get(solid.material)->colour.r, 0.8, 1e-3);
      }
    }
  }
}

TEST_F(Exchange, UnitsAreAskedForToldAndStated) {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;
  box(1, points, triangles);
  Mesh mesh;
  for (const double x : points) mesh.positions.push_back(static_cast<float>(x));
  mesh.triangles = triangles;
  std::vector<ExportItem> items(1);
  items[0].mesh = &mesh;
  const std::string stl = unwrap(write("stl", items, Map{{"unit", "m"}}));
  const auto size = [&](const Imported& made) { return std::cbrt(meshes_of(made).first); };

  auto made = unwrap(read(put("one.stl", stl)));
  EXPECT_NEAR(size(made), 1e-3, 1e-9);
  EXPECT_NE(all_notes(made).find("read as millimetres"), std::string::npos);
  EXPECT_NE(all_notes(made).find("give unit=\"m\""), std::string::npos) << "it is tiny";
  made = unwrap(read(put("one.stl", stl), Map{{"unit", "in"}}));
  EXPECT_NEAR(size(made), 0.0254, 1e-9);
  EXPECT_EQ(all_notes(made).find("millimetres"), std::string::npos);
  for (const std::string unit : {"mm", "cm", "m", "in", "ft"}) {
    made = unwrap(read(put("one.3mf", unwrap(write("3mf", items, Map{{"unit", unit}})))));
    EXPECT_NEAR(size(made), 1, 1e-5) << unit;
    const auto dxf = unwrap(write("dxf", items, Map{{"unit", unit}}));
    made = unwrap(read(put("one.dxf", dxf)));
    EXPECT_NEAR(size(made), 1, 1e-9) << unit;
  }
  made = unwrap(read(put("one.glb", unwrap(write("glb", items))), Map{{"unit", "mm"}}));
  EXPECT_NEAR(size(made), 1, 1e-6);
  EXPECT_NE(all_notes(made).find("was not used"), std::string::npos);
}

TEST_F(Exchange, AnExtensionThatDoesNotFitTheContentIsRefusedBecauseTheUnitDependsOnIt) {
  const Part part = bushing();
  const auto items = assembly(part, false);
  const std::vector<std::string> formats{"ply", "obj", "glb", "3mf"};
  for (const std::string& content : formats)
    for (const std::string& name : formats) {
      const auto made = read(put("one." + name, unwrap(write(content, items))));
      EXPECT_EQ(made.ok(), name == content) << content << " as " << name;
      if (made.ok()) continue;
      EXPECT_NE(made.error().sentence().find(
                    "the beginning of the file is not that of the format " + name),
                std::string::npos)
          << made.error().sentence();
    }
}

TEST_F(Exchange, ColladaKeepsItsUnitAndUpAxis) {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;
  box(1, points, triangles);
  const auto dae = [&](const char* axis) {
    std::ostringstream s;
    s << "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
         "version=\"1.4.1\"><asset><unit name=\"inch\" meter=\"0.0254\"/><up_axis>"
      << axis
      << "</up_axis></asset><library_geometries><geometry id=\"g\" name=\"g\"><mesh><source "
         "id=\"p\"><float_array id=\"a\" count=\""
      << points.size() << "\">";
    // 1 x 1 x 3: the third coordinate is long
    for (std::size_t i = 0; i < points.size(); ++i) s << points[i] * (i % 3 == 2 ? 3 : 1) << ' ';
    s << "</float_array><technique_common><accessor source=\"#a\" count=\"" << points.size() / 3
      << "\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" "
         "type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
         "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles "
         "count=\""
      << triangles.size() / 3 << "\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>";
    for (const auto t : triangles) s << t << ' ';
    s << "</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>"
         "<visual_scene id=\"s\"><node id=\"n\" name=\"tower\"><instance_geometry url=\"#g\"/>"
         "</node></visual_scene></library_visual_scenes><scene><instance_visual_scene "
         "url=\"#s\"/></scene></COLLADA>";
    return s.str();
  };
  for (const char* axis : {"Z_UP", "Y_UP"}) {
    const auto made = read(put("t.dae", dae(axis)), Map{{"name", axis}});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    EXPECT_NEAR(meshes_of(*made).first, 3 * std::pow(0.0254, 3), 1e-9);
    const AnyId id = load(*made);
    Vec3 tip{0, 0, 3 * 0.0254};  // of the long edge, in the mesh
    if (id.kind == Kind::object) {
      const auto& object = *bench.document.now()->get(ObjectId{id.number});
      ASSERT_EQ(object.parts.size(), 1U);
      tip = spatial::transform(model::pose(object.parts[0].placement), tip);
    }
    const bool is_y_up = std::string(axis) == "Y_UP";
    EXPECT_NEAR(tip[2], is_y_up ? 0 : 3 * 0.0254, 1e-6) << axis;
    EXPECT_NEAR(tip[1], is_y_up ? -3 * 0.0254 : 0, 1e-6) << axis;
  }
}

TEST(MeshRepair, HolesAreFilledTurnedTrianglesTurnedAndAllIsTold) {
  const auto make = [](auto&& spoil) {
    std::vector<double> points;
    std::vector<std::uint32_t> triangles;
    box(2, points, triangles);
    spoil(points, triangles);
    const cx::MeshRepair done = cx::repair(points, triangles, true);
    EXPECT_NEAR(done.volume, 8, 1e-6);
    EXPECT_EQ(done.open_edges, 0U);
    return done;
  };
  using Points = std::vector<double>;
  using Triangles = std::vector<std::uint32_t>;
  EXPECT_TRUE(make([](Points&, Triangles&) {}).notes("box").empty());
  const auto holed = make([](Points&, Triangles& t) { t.resize(t.size() - 6); });
  EXPECT_EQ(holed.holes, 1U);
  EXPECT_NEAR(holed.widest_hole, 2, 1e-12);
  EXPECT_EQ(holed.notes("box").size(), 1U);
  const auto turned = make([](Points&, Triangles& t) { std::swap(t[0], t[1]); });
  EXPECT_EQ(turned.turned, 1U);
  EXPECT_EQ(turned.holes, 0U);
  const auto inside_out = make([](Points&, Triangles& t) {
    for (std::size_t i = 0; i < t.size(); i += 3) std::swap(t[i], t[i + 1]);
  });
  EXPECT_TRUE(inside_out.inside_out);
  const auto gapped = make([](Points& p, Triangles&) { p[0] += 1e-7; });
  EXPECT_EQ(gapped.welded, 1U);
  const auto doubled = make([](Points&, Triangles& t) { t.insert(t.end(), {t[0], t[1], t[2]}); });
  EXPECT_EQ(doubled.doubled, 1U);
}

TEST(MeshRepair, AnyTriangleSoupBecomesClosedOrStaysAsItWas) {
  std::mt19937 random(7);
  int closed = 0, kept = 0;
  for (int run = 0; run < 300; ++run) {
    std::vector<double> points;
    std::vector<std::uint32_t> triangles;
    const std::size_t n = 3 + random() % 12;
    for (std::size_t i = 0; i < 3 * n; ++i) points.push_back(static_cast<double>(random() % 5));
    for (std::size_t i = 0; i < 3 * (1 + random() % 30); ++i)
      triangles.push_back(static_cast<std::uint32_t>(random() % n));
    triangles.resize(triangles.size() / 3 * 3);
    std::vector<double> plain_points = points;
    std::vector<std::uint32_t> plain = triangles;
    const cx::MeshRepair untouched = cx::repair(plain_points, plain, false);
    const cx::MeshRepair done = cx::repair(points, triangles, true);
    for (const auto i : triangles) ASSERT_LT(i, points.size() / 3);
    if (done.failure.empty()) {
      EXPECT_EQ(done.open_edges, 0U) << "run " << run;
      EXPECT_GE(done.volume, -1e-12);
      ++closed;
    } else {
      EXPECT_EQ(triangles.size(), plain.size()) << "run " << run;
      EXPECT_EQ(done.open_edges, untouched.open_edges);
      EXPECT_EQ(done.holes, 0U) << "what was taken back is not told as done";
      EXPECT_NE(done.notes("soup").back().find(done.failure), std::string::npos);
      ++kept;
    }
  }
  EXPECT_GT(closed, 20);
  EXPECT_GT(kept, 20);
}

TEST(MeshRepair, AFillingThatCutsTheSurfaceIsTakenBack) {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;
  box(2, points, triangles);
  triangles.resize(triangles.size() - 6);
  // A needle through the missing face.
  const auto first = static_cast<std::uint32_t>(points.size() / 3);
  double low = 1e9, high = -1e9;
  for (const double x : points) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  const double middle = (low + high) / 2, reach = 3 * (high - low);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double way : {-1.0, 1.0})
      for (std::size_t k = 0; k < 3; ++k) points.push_back(middle + (k == axis ? way * reach : 0));
  for (std::uint32_t axis = 0; axis < 3; ++axis)
    triangles.insert(triangles.end(),
                     {first + 2 * axis, first + 2 * axis + 1, first + 2 * ((axis + 1) % 3)});
  const std::size_t count = triangles.size();
  const cx::MeshRepair done = cx::repair(points, triangles, true);
  EXPECT_NE(done.failure, "");
  EXPECT_EQ(triangles.size(), count);
  EXPECT_GT(done.open_edges, 4U);
}

// --- drawings ------------------------------------------------------------------------------

double area(const CsgProfile& p) {
  double sum = 0;
  for (const CsgLoop& l : p.loops) {
    std::array<double, 2> tip = l.start;
    double a = 0;
    const auto to = [&](const std::array<double, 2>& q) {
      a += 0.5 * (tip[0] * q[1] - tip[1] * q[0]);
      tip = q;
    };
    for (const CsgCurve& c : l.curves) {
      if (c.kind == CsgCurve::Kind::circle) a += kPi * c.points[1][0] * c.points[1][0];
      else if (c.kind == CsgCurve::Kind::line) to(c.points[0]);
      else if (c.kind == CsgCurve::Kind::arc) {
        // Sector less triangle, from three points.
        const auto s = tip, m = c.points[0], e = c.points[1];
        const double bx = m[0] - s[0], by = m[1] - s[1], ex = e[0] - s[0], ey = e[1] - s[1];
        const double d = 2 * (bx * ey - by * ex), bb = bx * bx + by * by, ee = ex * ex + ey * ey;
        const double ux = (ey * bb - by * ee) / d, uy = (bx * ee - ex * bb) / d;
        const double r = std::hypot(ux, uy);
        const auto angle = [&](const std::array<double, 2>& q) {
          return std::atan2(q[1] - s[1] - uy, q[0] - s[0] - ux);
        };
        double sweep = std::fmod(angle(e) - angle(s) + 4 * kPi, 2 * kPi);
        if (d < 0) sweep -= 2 * kPi;
        a += 0.5 * r * r * (sweep - std::sin(sweep));
        to(e);
      } else {
        std::vector<cx::Point2> points{tip};
        points.insert(points.end(), c.points.begin(), c.points.end());
        const cx::NaturalSpline spline(points);
        for (int i = 1; i <= 4000; ++i) to(spline.at(spline.length() * i / 4000));
      }
    }
    to(l.start);
    sum += std::abs(a) * (&l == &p.loops[0] ? 1 : -1);
  }
  return sum;
}

std::string drawing(const std::string& entities, const char* header = "9\n$INSUNITS\n70\n4\n") {
  return "0\nSECTION\n2\nHEADER\n" + std::string(header) + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" +
         entities + "0\nENDSEC\n0\nEOF\n";
}

TEST(Dxf, WhatIsWrittenIsReadBackExactly) {
  CsgProfile p;
  CsgLoop outer;
  outer.start = {0, 0};
  outer.curves = {{CsgCurve::Kind::line, {{0.1, 0}}},
                  {CsgCurve::Kind::arc, {{0.125, 0.025}, {0.1, 0.05}}},
                  {CsgCurve::Kind::spline, {{0.07, 0.06}, {0.03, 0.04}, {0, 0.05}}},
                  {CsgCurve::Kind::arc, {{0.01, 0.025}, {0, 0}}}};  // this one runs right
  CsgLoop hole;
  hole.curves = {{CsgCurve::Kind::circle, {{0.05, 0.02}, {0.01, 0}}}};
  p.loops = {outer, hole};
  std::vector<ExportItem> items(1);
  items[0].name = "plate";
  items[0].profile = &p;
  const auto text = unwrap(cx::write_dxf(items, {}));
  const auto scene = unwrap(cx::read_dxf(text, 0));
  ASSERT_EQ(scene.profile.loops.size(), 2U) << text;
  const auto& a = scene.profile.loops;
  const std::size_t round = a[0].curves[0].kind == CsgCurve::Kind::circle ? 0 : 1;
  EXPECT_NEAR(a[round].curves[0].points[0][0], 0.05, 1e-15);
  EXPECT_NEAR(a[round].curves[0].points[1][0], 0.01, 1e-15);
  const CsgLoop& loop = a[1 - round];
  ASSERT_EQ(loop.curves.size(), 4U);
  EXPECT_EQ(loop.curves[2].kind, CsgCurve::Kind::spline);
  ASSERT_EQ(loop.curves[2].points.size(), 3U);
  EXPECT_NEAR(loop.curves[2].points[0][1], 0.06, 1e-12);
  CsgProfile ordered;
  ordered.loops = {loop, a[round]};
  EXPECT_NEAR(area(ordered), area(p), 1e-12);
  EXPECT_TRUE(scene.notes.empty()) << scene.notes[0];
}

TEST(Dxf, PolylinesWithBulgesEllipsesAndBlocksAreRead) {
  // A slot: two straight sides, two half circles of radius 5.
  const std::string slot =
      "0\nLWPOLYLINE\n90\n4\n70\n1\n10\n0\n20\n0\n10\n20\n20\n0\n42\n1\n10\n20\n20\n10\n10\n0\n20\n"
      "10\n42\n1\n";
  auto scene = unwrap(cx::read_dxf(drawing(slot), 0));
  ASSERT_EQ(scene.profile.loops.size(), 1U);
  EXPECT_NEAR(area(scene.profile), (200 + 25 * kPi) * 1e-6, 1e-12);

  const std::string old_slot =
      "0\nPOLYLINE\n70\n1\n0\nVERTEX\n10\n0\n20\n0\n0\nVERTEX\n10\n20\n20\n0\n42\n1\n0\nVERTEX\n10"
      "\n"
      "20\n20\n10\n0\nVERTEX\n10\n0\n20\n10\n42\n1\n0\nSEQEND\n";
  scene = unwrap(cx::read_dxf(drawing(old_slot), 0));
  EXPECT_NEAR(area(scene.profile), (200 + 25 * kPi) * 1e-6, 1e-12);

  const std::string ellipse =
      "0\nELLIPSE\n10\n1\n20\n2\n11\n30\n21\n0\n40\n0.5\n41\n0\n42\n6.283185307179586\n";
  scene = unwrap(cx::read_dxf(drawing(ellipse), 0));
  ASSERT_EQ(scene.profile.loops.size(), 1U);
  EXPECT_NEAR(area(scene.profile), kPi * 30 * 15 * 1e-6, 1e-10);
  ASSERT_EQ(scene.notes.size(), 1U);
  EXPECT_NE(scene.notes[0].find("splines through points"), std::string::npos);

  // A block with a circle of radius 3 and one line of a square, inserted twice, the second time
  // twice as large.
  const std::string blocks =
      "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB\n10\n0\n20\n0\n0\nCIRCLE\n10\n0\n20\n0\n40\n3\n0\n"
      "ENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nINSERT\n2\nB\n10\n10\n20\n0\n0\nINSERT\n2\nB"
      "\n"
      "10\n50\n20\n0\n41\n2\n42\n2\n0\nENDSEC\n0\nEOF\n";
  scene = unwrap(cx::read_dxf(blocks, 0.001));
  ASSERT_EQ(scene.profile.loops.size(), 2U);
  EXPECT_NEAR(scene.profile.loops[1].curves[0].points[1][0], 0.006, 1e-15);
  EXPECT_NEAR(scene.profile.loops[1].curves[0].points[0][0], 0.05, 1e-15);
}

TEST(Dxf, PiecesAreJoinedInAnyOrderAndDirectionAndWhatIsOpenIsTold) {
  const std::string pieces =
      "0\nLINE\n10\n0\n20\n0\n11\n10\n21\n0\n0\nLINE\n10\n0\n20\n10\n11\n10\n21\n10\n0\nLINE\n10\n0"
      "\n"
      "20\n0\n11\n0\n21\n10\n0\nARC\n10\n10\n20\n5\n40\n5\n50\n270\n51\n90\n0\nLINE\n10\n100\n20\n0"
      "\n"
      "11\n110\n21\n0\n0\nTEXT\n1\nhello\n";
  const auto scene = unwrap(cx::read_dxf(drawing(pieces, ""), 0));
  ASSERT_EQ(scene.profile.loops.size(), 1U);
  EXPECT_NEAR(area(scene.profile), (100 + 12.5 * kPi) * 1e-6, 1e-12);
  std::string notes;
  for (const auto& n : scene.notes) notes += n + "\n";
  EXPECT_NE(notes.find("read as millimetres"), std::string::npos) << notes;
  EXPECT_NE(notes.find("1 TEXT was left out"), std::string::npos) << notes;
  EXPECT_NE(notes.find("1 line does not close"), std::string::npos) << notes;
}

TEST(Dxf, ASplineOfAnotherProgramIsFollowedClosely) {
  // A full circle of radius 10 as a rational quadratic B-spline, exactly (Piegl and Tiller, The
  // NURBS Book, example 7.1).
  std::string s = "0\nSPLINE\n70\n8\n71\n2\n72\n12\n73\n9\n";
  for (const char* k : {"0", "0", "0", "1", "1", "2", "2", "3", "3", "4", "4", "4"})
    s += std::string("40\n") + k + "\n";
  const int xy[9][2] = {{10, 0},    {10, 10}, {0, 10},   {-10, 10}, {-10, 0},
                        {-10, -10}, {0, -10}, {10, -10}, {10, 0}};
  for (int i = 0; i < 9; ++i)
    s += std::string("41\n") + (i % 2 ? "0.7071067811865476" : "1") + "\n10\n" +
         std::to_string(xy[i][0]) + "\n20\n" + std::to_string(xy[i][1]) + "\n";
  const auto scene = unwrap(cx::read_dxf(drawing(s), 0));
  ASSERT_EQ(scene.profile.loops.size(), 1U);
  EXPECT_NEAR(area(scene.profile), kPi * 1e-4, 1e-8 * 1e-1);
}

TEST_F(Exchange, ADrawingComesAsAProfileAndAPolyfaceMeshAsASolid) {
  const auto made = read(put("c.dxf", drawing("0\nCIRCLE\n10\n0\n20\n0\n40\n5\n")));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_TRUE(made->records.empty());
  ASSERT_EQ(made->profile.loops.size(), 1U);
  EXPECT_NEAR(area(made->profile), 25e-6 * kPi, 1e-15);

  std::string face = "0\nPOLYLINE\n66\n1\n70\n64\n";
  const int corner[4][3] = {{0, 0, 0}, {30, 0, 0}, {0, 30, 0}, {0, 0, 30}};
  for (const auto& c : corner)
    face += "0\nVERTEX\n70\n192\n10\n" + std::to_string(c[0]) + "\n20\n" + std::to_string(c[1]) +
            "\n30\n" + std::to_string(c[2]) + "\n";
  for (const char* f :
       {"1\n72\n3\n73\n2", "1\n72\n2\n73\n4", "1\n72\n-4\n73\n3", "2\n72\n3\n73\n4"})
    face += std::string("0\nVERTEX\n70\n128\n71\n") + f + "\n";
  const auto solid = read(put("f.dxf", drawing(face + "0\nSEQEND\n")));
  ASSERT_TRUE(solid.ok()) << solid.error().sentence();
  EXPECT_NEAR(meshes_of(*solid).first, 27e-6 / 6, 1e-15);
}

// --- damage --------------------------------------------------------------------------------

// --- 3MF of other programs -------------------------------------------------------------------

/// A box from 0 to size as the mesh of an object; `triangle` goes into each of its triangles.
std::string box_3mf(double size, const std::string& triangle = {}, const std::string& more = {}) {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;
  box(size, points, triangles);
  std::ostringstream s;
  s << "<mesh><vertices>";
  for (std::size_t i = 0; i < points.size(); i += 3)
    s << "<vertex x=\"" << points[i] << "\" y=\"" << points[i + 1] << "\" z=\"" << points[i + 2]
      << "\"/>";
  s << "</vertices><triangles>";
  for (std::size_t i = 0; i < triangles.size(); i += 3)
    s << "<triangle v1=\"" << triangles[i] << "\" v2=\"" << triangles[i + 1] << "\" v3=\""
      << triangles[i + 2] << "\" " << triangle << "/>";
  s << "</triangles>" << more << "</mesh>";
  return s.str();
}

std::string model_3mf(const std::string& resources, const std::string& build,
                      const std::string& attributes = {}) {
  return "<?xml version=\"1.0\"?>\n<model " + attributes +
         " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\""
         " xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\""
         " xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\""
         " xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\""
         " xmlns:x=\"http://example.org/shapes\"><resources>" +
         resources + "</resources><build>" + build + "</build></model>";
}

using Parts = std::vector<std::pair<std::string, std::string>>;
std::string package_3mf(const std::string& model, Parts more = {}) {
  more.insert(more.begin(),
              {{"_rels/.rels",
                "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/"
                "relationships\"><Relationship Target=\"/3D/model.model\" Id=\"r\" Type=\"http://"
                "schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
               {"3D/model.model", model}});
  return test::zip_package(more);
}

TEST_F(Exchange, A3mfOfSeveralPartsIsReadWithItsComponentsScalesAndUnits) {
  // Part "a" is in a file of its own, in centimetres; "pair" holds it twice, once mirrored and
  // doubled; the build has the pair, moved, and a box of the root.
  const std::string other = model_3mf("<object id=\"1\" name=\"a\">" + box_3mf(1) + "</object>", "",
                                      "unit=\"centimeter\"");
  const std::string root = model_3mf(
      "<object id=\"4\" name=\"pair\"><components>"
      "<component objectid=\"1\" p:path=\"/3D/Other%20Parts/a.model\"/>"
      "<component objectid=\"1\" p:path=\"/3d/other parts/A.model\" "
      "transform=\"-2 0 0 0 2 0 0 0 2 50 0 0\"/></components></object>"
      "<object id=\"7\" name=\"block\">" +
          box_3mf(30) + "</object><object id=\"8\" type=\"support\">" + box_3mf(5) + "</object>",
      "<item objectid=\"4\" transform=\"1 0 0 0 1 0 0 0 1 100 0 0\"/><item objectid=\"7\"/>"
      "<item objectid=\"8\"/>");
  const Imported made =
      unwrap(read(put("parts.3mf", package_3mf(root, {{"3D/Other Parts/a.model", other}}))));
  EXPECT_EQ(made.geometries.size(), 3U) << "a, its scaled copy, the block";
  EXPECT_NE(all_notes(made).find("different units"), std::string::npos) << all_notes(made);
  EXPECT_NE(all_notes(made).find("1 support for printing was left out"), std::string::npos);
  const double expected = 1e-6 + 8e-6 + 27e-6;
  const AnyId id = load(made);
  EXPECT_NEAR(volume(id), expected, 1e-9 * expected);
  NoProgress progress;
  const auto mass = unwrap(bench.derived.mass(*bench.document.now(), id, progress));
  // Middles: 105 and 100 + 50 - 10 (mirrored), 15 [mm].
  EXPECT_NEAR(mass.mass.com[0], (1e-6 * 0.105 + 8e-6 * 0.14 + 27e-6 * 0.015) / expected, 1e-9);
}

TEST_F(Exchange, ColoursOf3mfAreTheMostCommonOnes) {
  const std::string root = model_3mf(
      "<basematerials id=\"1\"><base name=\"r\" displaycolor=\"#FF0000\"/></basematerials>"
      "<m:colorgroup id=\"2\"><m:color color=\"#00FF00\"/><m:color color=\"#0000FF80\"/>"
      "</m:colorgroup><m:multiproperties id=\"3\" pids=\"9 2\"><m:multi pindices=\"0 1\"/>"
      "</m:multiproperties><object id=\"5\" pid=\"1\" pindex=\"0\">" +
          box_3mf(10, "pid=\"3\" p1=\"0\"") + "</object>",
      "<item objectid=\"5\"/>");
  const Imported made = unwrap(read(put("colours.3mf", package_3mf(root))));
  const auto material = std::find_if(made.records.begin(), made.records.end(),
                                     [](const auto& f) { return f.name.ends_with(".mtr"); });
  ASSERT_NE(material, made.records.end());
  EXPECT_NE(material->text.find("colour (0, 0, 1, 0.502)"), std::string::npos) << material->text;
}

TEST_F(Exchange, WhatA3mfHasBesidesMeshesIsSaid) {
  const std::string lattice =
      "<b:beamlattice><b:beams><b:beam v1=\"0\" v2=\"1\"/></b:beams>"
      "</b:beamlattice>";
  const auto made = read(
      put("lattice.3mf",
          package_3mf(model_3mf("<object id=\"1\" name=\"core\">" + box_3mf(10, "", lattice) +
                                    "</object><m:texture2dgroup id=\"2\" texid=\"3\"/>",
                                "<item objectid=\"1\"/>", "requiredextensions=\"b m p\""),
                      {{"Metadata/model_settings.config", "<part subtype=\"modifier_part\"/>"}})));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const std::string notes = all_notes(*made);
  EXPECT_NE(notes.find("\"core\" has a lattice of 1 beam, which was left out; its mesh was read"),
            std::string::npos)
      << notes;
  EXPECT_NE(notes.find("Textures were left out"), std::string::npos) << notes;
  EXPECT_NE(notes.find("marked bodies of this file as modifiers"), std::string::npos) << notes;

  const auto required =
      read(put("required.3mf",
               package_3mf(model_3mf("<object id=\"1\">" + box_3mf(10) + "</object>",
                                     "<item objectid=\"1\"/>", "requiredextensions=\"x\""))));
  ASSERT_FALSE(required.ok());
  EXPECT_NE(required.error().message.find("http://example.org/shapes"), std::string::npos)
      << required.error().sentence();
  // One model is what 3MF allows; of two the first is read, and the other is named.
  const std::string relation =
      "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>";
  const std::string box =
      model_3mf("<object id=\"1\">" + box_3mf(10) + "</object>", "<item objectid=\"1\"/>");
  const auto two = read(put(
      "two.3mf",
      test::zip_package({{"_rels/.rels",
                          "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/"
                          "relationships\"><Relationship Target=\"/3D/a.model\" Id=\"a\" " +
                              relation + "<Relationship Target=\"/3D/b.model\" Id=\"b\" " +
                              relation + "</Relationships>"},
                         {"3D/a.model", box},
                         {"3D/b.model", box}})));
  ASSERT_TRUE(two.ok()) << two.error().sentence();
  EXPECT_EQ(two->geometries.size(), 1U);
  EXPECT_NE(all_notes(*two).find("further models were left out: \"/3D/b.model\""),
            std::string::npos)
      << all_notes(*two);
  // What no build names is read where it lies, and undeclared prefixes do not stop the reader.
  const auto unbuilt = read(
      put("unbuilt.3mf",
          package_3mf(model_3mf(
              "<z:thing a:b=\"1\"/><object id=\"1\" q:k=\"2\">" + box_3mf(10) + "</object>", ""))));
  ASSERT_TRUE(unbuilt.ok()) << unbuilt.error().sentence();
  EXPECT_NE(all_notes(*unbuilt).find("1 object was read in place"), std::string::npos)
      << all_notes(*unbuilt);
}

TEST_F(Exchange, Faulty3mfEndsInASentenceThatSaysWhere) {
  const auto refused = [&](const std::string& bytes, const std::string& words) {
    const auto made = read(put("faulty.3mf", bytes));
    ASSERT_FALSE(made.ok()) << words;
    EXPECT_NE(made.error().sentence().find(words), std::string::npos) << made.error().sentence();
    EXPECT_EQ(made.error().sentence().find("crashed"), std::string::npos)
        << made.error().sentence();
  };
  const std::string item = "<item objectid=\"1\"/>";
  refused(package_3mf(model_3mf("<object id=\"1\"><components><component objectid=\"1\"/>"
                                "</components></object>",
                                item)),
          "is a component of itself");
  refused(package_3mf(model_3mf("", item)), "places object 1, which is missing");
  refused(package_3mf(model_3mf("<object id=\"1\"><mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/>"
                                "</vertices><triangles><triangle v1=\"0\" v2=\"0\" v3=\"8\"/>"
                                "</triangles></mesh></object>",
                                item)),
          "a triangle of object 1 names vertex 8 of 1");
  refused(package_3mf(model_3mf("<object id=\"1\"><mesh><vertices><vertex x=\"1e999\" y=\"0\" "
                                "z=\"0\"/></vertices></mesh></object>",
                                item)),
          "line 2: the x of a vertex is \"1e999\"");
  refused(package_3mf(model_3mf("<object id=\"1\">" + box_3mf(1) + "</object>",
                                "<item objectid=\"1\" transform=\"1 0 0\"/>")),
          "is not a placement of twelve numbers");
  refused(package_3mf(model_3mf("<object id=\"1\">" + box_3mf(1) + "</object>",
                                "<item objectid=\"1\" p:path=\"/3D/gone.model\"/>")),
          "\"/3D/gone.model\" is not in the package");
  refused(package_3mf("<!DOCTYPE model [<!ENTITY a \"aaaaaaaaaaaaaaaaaaaa\">]><model/>"),
          "document type");
  refused(package_3mf(model_3mf("", "", "unit=\"furlong\"")), "\"furlong\" is not a unit");
  refused(test::zip_package({{"readme.txt", "hello"}}), "holds no 3MF model");
  std::string torn = package_3mf(model_3mf("<object id=\"1\">" + box_3mf(1) + "</object>", item));
  torn[torn.find("vertex x=\"") + 10] ^= 1;
  refused(torn, "cannot be unpacked");
  // Forty objects, each of two copies of the one before, are 10^12 parts in 4 kB.
  std::string bomb = "<object id=\"1\">" + box_3mf(1) + "</object>";
  for (int i = 2; i < 42; ++i) {
    const std::string one = "<component objectid=\"" + std::to_string(i - 1) + "\"/>";
    bomb += "<object id=\"" + std::to_string(i) + "\"><components>" + one + one +
            "</components></object>";
  }
  refused(package_3mf(model_3mf(bomb, "<item objectid=\"41\"/>")), "more than 100000 parts");
}

TEST_F(Exchange, TooManyAttributesAndPrefixesIn3mfTakeTimeInProportion) {
  std::string many;
  for (int i = 0; i < 300000; ++i)
    many += " xmlns:n" + std::to_string(i) + "=\"u\" a" + std::to_string(i) + "=\"\"";
  const auto made =
      read(put("attributes.3mf",
               package_3mf(model_3mf("<object id=\"1\"" + many + ">" + box_3mf(10) + "</object>",
                                     "<item objectid=\"1\"/>"))),
           Map{{"seconds", 10.0}});
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_EQ(made->geometries.size(), 1U);
}

TEST_F(Exchange, APartNamedAfterAFileThatBeginsWithADigitGetsAValidName) {
  const auto made =
      read(put("3parts.3mf",
               package_3mf(model_3mf("<object id=\"1\">" + box_3mf(10) +
                                         "</object><object id=\"2\">" + box_3mf(20) + "</object>",
                                     "<item objectid=\"1\"/><item objectid=\"2\" "
                                     "transform=\"1 0 0 0 1 0 0 0 1 40 0 0\"/>"))));
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_NEAR(volume(load(*made)), 9e-6, 1e-14);
}

TEST_F(Exchange, DamagedFilesEndInASentence) {
  const Part part = bushing();
  const std::string step = unwrap(write("step", assembly(part, true)));
  const std::string glb = unwrap(write("glb", assembly(part, false)));
  std::mt19937 random(11);
  std::size_t refused = 0;
  for (const auto& [extension, whole] : std::map<std::string, std::string>{
           {"step", step},
           {"glb", glb},
           {"iges", "S      1\nnonsense"},
           {"dae", "<COLLADA><a>"},
           {"3mf", "PK\x03\x04 cut"},
           {"obj", "v 0 0\nf 1 2 99999999\n"},
           {"stl", "solid x\nfacet"},
           {"ply", "ply\nformat ascii 1.0\nelement vertex 99999999999\nend_header\n"}})
    for (int i = 0; i < 2; ++i) {
      std::string bytes = whole.substr(0, 1 + random() % whole.size());
      if (i == 1) bytes[random() % bytes.size()] = static_cast<char>(random());
      const auto made = read(put("bad." + extension, bytes));
      if (made.ok()) continue;
      ++refused;
      EXPECT_FALSE(made.error().message.empty());
      EXPECT_NE(made.error().sentence().find("bad." + extension), std::string::npos)
          << made.error().sentence();
    }
  EXPECT_GE(refused, 10U);
  const auto absent = read((folder / "absent.step").string());
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().code, ErrorCode::not_found);
}

TEST(Scene, CutOrChangedBytesAreRefusedAndErrorsComeThrough) {
  cx::Scene s;
  cx::Shape shape;
  box(1, shape.points, shape.triangles);
  shape.name = "box";
  s.shapes.push_back(shape);
  s.nodes.resize(2);
  s.nodes[1].parent = 0;
  s.nodes[1].shape = 0;
  s.profile.loops.push_back({{0, 0}, {{CsgCurve::Kind::circle, {{0, 0}, {1, 0}}}}});
  s.notes = {"a note"};
  const std::string whole = cx::encode(s);
  const auto back = cx::decode(whole);
  ASSERT_TRUE(back.ok()) << back.error().sentence();
  EXPECT_EQ(back->scene.shapes[0].points, shape.points);
  EXPECT_EQ(back->scene.profile, s.profile);
  EXPECT_EQ(back->scene.notes, s.notes);
  for (std::size_t n = 0; n < whole.size(); ++n)
    EXPECT_FALSE(cx::decode(whole.substr(0, n)).ok()) << n;
  s.nodes[1].pose.R[0] = 2;
  EXPECT_FALSE(cx::decode(cx::encode(s)).ok()) << "not a rotation";
  s.nodes[1].pose.R[0] = 1;
  s.shapes[0].triangles[0] = 1000;
  EXPECT_FALSE(cx::decode(cx::encode(s)).ok()) << "no such corner";
  const auto told = cx::decode(cx::encode(error(ErrorCode::syntax, "bad", "Mend it.", "here")));
  ASSERT_FALSE(told.ok());
  EXPECT_EQ(told.error().code, ErrorCode::syntax);
  EXPECT_EQ(told.error().sentence(), "here: bad. Mend it.");
  const auto raw = cx::decode(cx::encode(error(
      ErrorCode::syntax, "\"\x1B[31m\xFF\xC3\xA4\xE2\x82\xAC\xED\xA0\x80\xC2\x9B\xE2\x82\"")));
  ASSERT_FALSE(raw.ok());
  EXPECT_EQ(raw.error().message, "\"?[31m?\xC3\xA4\xE2\x82\xAC???????\"");
}

// --- files of others, where there are some -------------------------------------------------

/// Folder of sample data, named by ROBOMOSP_SAMPLE_DATA or beside the project; need not exist.
fs::path samples() {
  const char* given = std::getenv("ROBOMOSP_SAMPLE_DATA");
  return given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data";
}

TEST_F(Exchange, MeshesOfRobotsBecomeSolids) {
  const fs::path robots = samples() / "robots";
  if (!fs::exists(robots)) GTEST_SKIP() << "there is no sample data";
  std::vector<fs::path> files;
  for (const auto& e : fs::recursive_directory_iterator(robots))
    if (e.path().extension() == ".stl" || e.path().extension() == ".dae") files.push_back(e.path());
  std::sort(files.begin(), files.end());
  ASSERT_FALSE(files.empty());
  std::size_t read_well = 0;
  for (std::size_t i = 0; i < files.size(); i += 5) {
    Map values;
    if (files[i].extension() == ".stl") values.set("unit", "m");
    const auto made = read(files[i].string(), values);
    if (!made.ok()) {
      std::cout << files[i].filename() << ": " << made.error().sentence() << "\n";
      continue;
    }
    ++read_well;
    EXPECT_GT(meshes_of(*made).first, 1e-7) << files[i];
    EXPECT_LT(meshes_of(*made).first, 0.2) << files[i];
  }
  EXPECT_GE(2 * read_well, files.size() / 5);
}

TEST_F(Exchange, StepFilesOfTheSystemAreRead) {
  const fs::path file = "/usr/share/opencascade/data/step/screw.step";
  if (!fs::exists(file)) GTEST_SKIP() << "Debian's samples (occt-misc) are not installed";
  const auto made = read(file.string());
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  EXPECT_GE(made->geometries.size(), 1U);
  const AnyId id = load(*made);
  EXPECT_GT(volume(id), 1e-9);
}

}  // namespace
}  // namespace robomosp

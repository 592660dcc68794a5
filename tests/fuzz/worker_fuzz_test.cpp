// SPDX-License-Identifier: Apache-2.0
// Seeded mutation of files of every foreign format, through the worker program and on to the mass
// of what came out of it: whatever becomes of the worker, this program lives and has a solid or a
// sentence. ROBOMOSP_FUZZ_SECONDS gives a time for each format, ROBOMOSP_FUZZ_FORMATS names some of
// them ("step,glb").
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/io.h>

#include "io/geometry.h"
#include "io/native.h"
#include "kernel/schema.h"
#include "kernel/text.h"
#include "support/seed.h"
#include "support/workbench.h"
#include "support/zip_package.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::unwrap;

/// Stops what takes too long, so that a slow file is one more refusal.
class Deadline final : public Progress {
 public:
  explicit Deadline(double seconds)
      : end_(std::chrono::steady_clock::now() +
             std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                 std::chrono::duration<double>(seconds))) {}
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return std::chrono::steady_clock::now() > end_; }

 private:
  std::chrono::steady_clock::time_point end_;
};

/// What a COLLADA exporter writes of a tetrahedron; ours writes none.
const char* const kCollada =
    "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" "
    "version=\"1.4.1\"><asset><unit meter=\"0.001\"/><up_axis>Z_UP</up_axis></asset>"
    "<library_geometries><geometry id=\"g\" name=\"g\"><mesh><source id=\"p\"><float_array "
    "id=\"a\" "
    "count=\"12\">0 0 0 10 0 0 0 10 0 0 0 10</float_array><technique_common><accessor "
    "source=\"#a\" "
    "count=\"4\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
    "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"v\">"
    "<input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"4\"><input "
    "semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>"
    "</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id=\"s\"><node "
    "id=\"n\" name=\"n\"><instance_geometry url=\"#g\"/></node></visual_scene>"
    "</library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";

class WorkerFuzz : public testing::Test {
 protected:
  WorkerFuzz()
      : folder(fs::path(testing::TempDir()) / ("worker-fuzz-" + std::to_string(::getpid()))) {
    fs::create_directories(folder);
  }
  ~WorkerFuzz() override { fs::remove_all(folder); }

  /// A part with planes, cylinders, a sphere, a torus and a drawn profile, twice in an assembly.
  void make_samples() {
    const auto engine = unwrap(bench.registry.create<CsgEngine>("occt"));
    CsgTree tree;
    tree.nodes.resize(6);
    tree.nodes[0].kind = CsgKind::difference;
    tree.nodes[1].kind = CsgKind::union_;
    tree.nodes[1].parent = 0;
    tree.nodes[2] = {CsgKind::cylinder, 1, {}, {0.02, 0.03, 0.004}, "body"};
    tree.nodes[3] = {CsgKind::sphere, 1, {}, {0.022}, "ball"};
    tree.nodes[4] = {CsgKind::cylinder, 0, {}, {0.01, 0.05, 0}, "bore"};
    tree.nodes[5] = {CsgKind::prism, 1, {}, {0.01}, "ear"};
    auto ear = std::make_shared<CsgProfile>();
    ear->loops.push_back({{0, -0.01},
                          {{CsgCurve::Kind::line, {{0.03, -0.01}}},
                           {CsgCurve::Kind::spline, {{0.035, 0}, {0.03, 0.01}}},
                           {CsgCurve::Kind::line, {{0, 0.01}}}}});
    tree.nodes[5].profile = ear;
    std::swap(tree.nodes[4], tree.nodes[5]);
    NoProgress progress;
    const auto shape = unwrap(engine->evaluate(tree, progress));
    ASSERT_TRUE(shape);
    geometry = unwrap(engine->geometry(*shape, progress));
    mesh = unwrap(engine->mesh(*shape, {5e-4, 0.5}, progress));
    Pose level;
    level.p[2] = 0.005;
    profile = unwrap(engine->section(*shape, level, 1e-4, progress));
  }
  std::string sample(const std::string& format) const {
    if (format == "dae") return kCollada;
    const bool is_exact = format == "step" || format == "iges";
    std::vector<ExportItem> items(3);
    items[0].name = "arm";
    for (std::size_t i : {1U, 2U}) {
      items[i].name = i == 1 ? "left" : "right";
      items[i].parent = 0;
      items[i].definition = 7;
      items[i].pose.p[0] = 0.1 * static_cast<double>(i);
      if (format == "dxf" && i == 1) items[i].profile = &profile;
      else if (is_exact) items[i].geometry = &geometry;
      else items[i].mesh = &mesh;
    }
    for (const ProviderInfo& info : bench.registry.list(Exporter::kInterfaceId)) {
      const auto exporter = unwrap(bench.registry.create<Exporter>(info.name));
      for (const std::string_view known : text::split(exporter->extensions(), ','))
        if (known == format) {
          const auto params = make_params(unwrap(check(info.schema, Map{})));
          NoProgress progress;
          ExportTask task;
          task.extension = format;
          task.name = "file";
          task.items = items;
          return unwrap(exporter->write(task, *params, progress)).front().bytes;
        }
    }
    return {};
  }

  struct Tally {
    std::size_t files = 0, solids = 0, refused = 0, weighed = 0;
    std::map<std::string, std::size_t> died;  ///< by how the worker ended
  };

  void run(const std::string& format, const std::string& bytes, Tally& tally) {
    const std::string path = (folder / ("file." + format)).string();
    std::ofstream(path, std::ios::binary) << bytes;
    ++tally.files;
    auto made = read(format, path);
    if (!made.ok()) {
      ++tally.refused;
      EXPECT_FALSE(made.error().message.empty());
      constexpr std::string_view kDied = "in a separate process, so nothing was changed: ";
      const std::string& message = made.error().message;
      if (const auto at = message.find(kDied); at != std::string::npos)
        ++tally.died[message.substr(at + kDied.size())];
      return;
    }
    if (made->records.empty()) return;  // a drawing
    io::MemoryFiles files;
    for (ImportedGeometry& g : made->geometries) {
      auto kept = io::make_geometry(std::move(g.geometry));
      if (!kept.ok()) return told(kept.error());
      files.geometries.emplace(g.name, std::move(*kept));
    }
    for (ImportedFile& f : made->records) files.texts.emplace(f.name, std::move(f.text));
    document::Document document;
    auto tx = document.begin("import");
    ASSERT_TRUE(tx.ok());
    auto loaded = io::load_memory(*tx, files, made->records.back().name, "fuzz", folder, {});
    if (!loaded.ok()) return told(loaded.error());
    ASSERT_TRUE(tx->commit().ok());
    ++tally.solids;
    Deadline deadline(kSeconds);
    for (const AnyId id : loaded->all) {
      if (id.kind != Kind::solid) continue;
      const auto mass = bench.derived.mass(*document.now(), id, deadline);
      if (!mass.ok()) told(mass.error());
      else ++tally.weighed;
      const auto shown = bench.derived.drawables(*document.now(), id, deadline);
      if (!shown.ok()) told(shown.error());
      if (testing::Test::HasFailure()) return;
    }
    bench.derived.clear();
  }
  static void told(const Error& e) { EXPECT_FALSE(e.message.empty()); }

  Result<Imported> read(const std::string& format, const std::string& path) {
    for (const ProviderInfo& info : bench.registry.list(Importer::kInterfaceId)) {
      const auto importer = unwrap(bench.registry.create<Importer>(info.name));
      for (const std::string_view known : text::split(importer->extensions(), ','))
        if (known == format) {
          const auto params =
              make_params(unwrap(check(info.schema, Map{{"seconds", kSeconds}, {"memory", 2}})));
          NoProgress progress;
          return importer->read(path, *params, progress);
        }
    }
    return error(ErrorCode::unknown_name, "no importer");
  }

  static constexpr double kSeconds = 20;
  test::Workbench bench;
  fs::path folder;
  CsgGeometry geometry;
  Mesh mesh;
  CsgProfile profile;
};

std::string mutate(std::string s, std::mt19937& random) {
  static const char* const kTokens[] = {"1e308",
                                        "-1e-320",
                                        "nan",
                                        "inf",
                                        "0.",
                                        "-1",
                                        "99999999999999999999",
                                        "#1",
                                        "#99999",
                                        "$",
                                        "*",
                                        "()",
                                        "''",
                                        ";\n",
                                        "\xFF\xFF\xFF\xFF",
                                        "NaN",
                                        "[]",
                                        "{}",
                                        "<",
                                        "\"",
                                        ",,",
                                        "END",
                                        "4294967295"};
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t n = 1 + pick(6); n > 0 && !s.empty(); --n) {
    const std::size_t at = pick(s.size()), length = std::min(1 + pick(40), s.size() - at);
    switch (pick(9)) {
      case 0: s[at] = static_cast<char>(random()); break;
      case 1: s.erase(at, length); break;
      case 2: s.insert(at, s.substr(at, length)); break;
      case 3: s.insert(at, kTokens[pick(std::size(kTokens))]); break;
      case 4: s.replace(at, length, s.substr(pick(s.size()), length)); break;
      case 5: {  // another number
        std::size_t from = at;
        while (from < s.size() && !is_digit(s[from])) ++from;
        std::size_t to = from;
        while (to < s.size() && is_digit(s[to])) ++to;
        if (to > from) s.replace(from, to - from, kTokens[pick(8)]);
        break;
      }
      case 6:  // another digit, which readers take
        for (std::size_t k = at; k < s.size(); ++k)
          if (is_digit(s[k])) {
            s[k] = static_cast<char>('0' + pick(10));
            break;
          }
        break;
      case 7: s[at] = static_cast<char>(s[at] ^ static_cast<char>(1U << pick(8))); break;
      default:
        if (pick(6) == 0) s.resize(at);
    }
  }
  return s;
}

/// A package whose model is mutated and whose sums are right, so that the reader sees all of it.
std::string mutate_model(const std::string& whole, std::mt19937& random) {
  const std::string name = "3D/3dmodel.model", last = "</model>";
  const auto begin = whole.find("<?xml", whole.find(name)), end = whole.find(last, begin);
  if (end == std::string::npos) return {};
  std::string relations = whole.substr(whole.find("<?xml", whole.find("_rels/.rels")));
  relations.resize(relations.find("</Relationships>") + 16);
  return test::zip_package(
      {{"_rels/.rels", relations},
       {name, mutate(whole.substr(begin, end + last.size() - begin), random)}});
}

TEST_F(WorkerFuzz, AMutatedFileIsASolidOrASentence) {
  std::string wanted = "step,iges,stl,obj,ply,glb,dae,3mf,dxf";
  if (const char* given = std::getenv("ROBOMOSP_FUZZ_FORMATS")) wanted = given;
  std::mt19937 random(test::seed());
  make_samples();
  for (const std::string_view format_view : text::split(wanted, ',')) {
    const std::string format(format_view);
    const std::string whole = sample(format);
    ASSERT_FALSE(whole.empty()) << format;
    Tally sound;
    run(format, whole, sound);
    ASSERT_EQ(sound.refused, 0U) << format << ": the sample itself";
    Tally tally;
    const test::FuzzBudget budget(2, 1.0 / 9);
    for (std::size_t n = 0; budget.allows(n) && !HasFailure(); ++n) {
      const bool is_sealed = format == "3mf" && n % 2 == 0;
      const std::string bytes = is_sealed ? mutate_model(whole, random) : mutate(whole, random);
      // Where this program dies, the file that killed it stays.
      run(format, bytes, tally);
    }
    std::cout << format << ": " << tally.files << " files, " << tally.solids << " became solids ("
              << tally.weighed << " weighed), " << tally.refused << " refused";
    for (const auto& [how, count] : tally.died) std::cout << "; " << count << " x " << how;
    std::cout << "\n" << std::flush;
  }
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Seeded mutation of what our own readers of foreign files read in-process: STL, DXF and the bytes
// the worker program hands over. Nothing crashes, a refusal is a sentence, and what is accepted
// holds up: indices in range, numbers finite, meshes closed after repair.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cad_exchange/dxf_reader.h"
#include "cad_exchange/mesh_repair.h"
#include "cad_exchange/records.h"
#include "cad_exchange/scene.h"
#include "cad_exchange/stl_reader.h"
#include "support/seed.h"

namespace robomosp::cad_exchange {
namespace {

std::string text_stl() {
  return "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
         "endloop\nendfacet\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 "
         "0 0\nendloop\nendfacet\nendsolid a\n";
}
std::string binary_stl() {
  std::string s(84 + 2 * 50, '\0');
  s[80] = 2;
  for (std::size_t i = 84; i < s.size(); i += 7) s[i] = static_cast<char>(i);
  return s;
}
std::string dxf() {
  return "0\nSECTION\n2\nHEADER\n9\n$"
         "INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\n"
         "B\n10\n1\n20\n1\n0\nCIRCLE\n10\n0\n20\n0\n40\n3\n0\nINSERT\n2\nC\n10\n1\n20\n1\n0\nENDBLK"
         "\n"
         "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n70\n1\n10\n0\n20\n0\n42\n0."
         "5\n10\n10\n20\n"
         "0\n10\n10\n20\n10\n0\nSPLINE\n71\n3\n40\n0\n40\n0\n40\n0\n40\n0\n40\n1\n40\n1\n40\n1\n40"
         "\n1\n"
         "10\n0\n20\n0\n10\n1\n20\n2\n10\n3\n20\n2\n10\n4\n20\n0\n0\nLINE\n10\n4\n20\n0\n11\n0\n21"
         "\n0\n"
         "0\nINSERT\n2\nB\n10\n40\n20\n0\n41\n2\n42\n2\n50\n30\n0\nELLIPSE\n10\n0\n20\n0\n11\n5\n21"
         "\n1\n"
         "40\n0.3\n41\n0\n42\n6."
         "3\n0\nPOLYLINE\n70\n64\n0\nVERTEX\n70\n192\n10\n0\n20\n0\n30\n0\n0\n"
         "VERTEX\n70\n192\n10\n1\n20\n0\n30\n0\n0\nVERTEX\n70\n192\n10\n0\n20\n1\n30\n0\n0\nVERTEX"
         "\n70\n"
         "128\n71\n1\n72\n2\n73\n-"
         "3\n0\nSEQEND\n0\n3DFACE\n10\n0\n20\n0\n30\n0\n11\n1\n21\n0\n31\n0\n12\n"
         "1\n22\n1\n32\n1\n13\n0\n23\n1\n33\n1\n0\nENDSEC\n0\nEOF\n";
}
std::string scene() {
  Scene s;
  s.shapes.resize(2);
  s.shapes[0].brep = "DBRep_DrawableShape";
  s.shapes[1].points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  s.shapes[1].triangles = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  s.nodes.resize(3);
  s.nodes[1].parent = s.nodes[2].parent = 0;
  s.nodes[1].shape = 0;
  s.nodes[2].shape = 1;
  s.nodes[1].name = "a";
  s.profile.loops.push_back({{0, 0}, {{CsgCurve::Kind::arc, {{1, 0}, {1, 1}}}}});
  s.notes = {"one", "two"};
  return encode(s);
}

void check_mesh(std::vector<double> points, std::vector<std::uint32_t> triangles) {
  for (const double x : points) ASSERT_TRUE(std::isfinite(x));
  for (const std::uint32_t i : triangles) ASSERT_LT(i, points.size() / 3);
  const MeshRepair done = repair(points, triangles, true);
  EXPECT_EQ(done.open_edges == 0, done.failure.empty()) << "closed, or it says why not";
  for (const std::uint32_t i : triangles) ASSERT_LT(i, points.size() / 3);
}

void check_scene(Scene s) {
  const auto fine = check(s);
  EXPECT_TRUE(fine.ok()) << fine.error().sentence();
  for (const Shape& shape : s.shapes)
    if (shape.brep.empty()) check_mesh(shape.points, shape.triangles);
  const Imported made = records(std::move(s), {"name", "file", true, 0});
  for (const ImportedFile& f : made.records) EXPECT_TRUE(f.text.starts_with("robomosp ")) << f.text;
}

/// Tells whether it was accepted.
bool run(std::size_t kind, const std::string& bytes) {
  const auto told = [](const Error& e) { EXPECT_FALSE(e.message.empty()); };
  if (kind <= 1) {
    std::vector<std::string> notes;
    auto shapes = read_stl(bytes, 1e-3, notes);
    if (!shapes.ok()) return told(shapes.error()), false;
    for (Shape& s : *shapes) check_mesh(s.points, s.triangles);
    return true;
  }
  if (kind == 2) {
    auto drawing = read_dxf(bytes, 0);
    if (!drawing.ok()) return told(drawing.error()), false;
    check_scene(std::move(*drawing));
    return true;
  }
  auto answer = decode(bytes);
  if (!answer.ok()) return told(answer.error()), false;
  check_scene(std::move(answer->scene));
  return true;
}

std::string mutate(std::string s, std::mt19937& random) {
  static const char* const kTokens[] = {"0\nLINE\n",
                                        "1e308\n",
                                        "-1e-320\n",
                                        "nan\n",
                                        "inf\n",
                                        "10\n",
                                        "42\n",
                                        "INSERT\n",
                                        "\n",
                                        "0\nSEQEND\n",
                                        "99999999999999999999\n",
                                        "\xFF",
                                        "vertex 1 2 3 ",
                                        "facet "};
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  for (std::size_t n = 1 + pick(5); n > 0 && !s.empty(); --n) {
    const std::size_t at = pick(s.size()), length = std::min(1 + pick(20), s.size() - at);
    switch (pick(6)) {
      case 0: s[at] = static_cast<char>(random()); break;
      case 1: s.erase(at, length); break;
      case 2: s.insert(at, s.substr(at, length)); break;
      case 3: s.insert(at, kTokens[pick(std::size(kTokens))]); break;
      case 4: s[at] = static_cast<char>('0' + pick(10)); break;
      default:
        if (pick(4) == 0) s.resize(at);
    }
  }
  return s;
}

TEST(ExchangeFuzz, MutatedFilesAreRefusedInASentenceOrHoldUp) {
  std::mt19937 random(test::seed());
  const test::FuzzBudget budget(20'000);
  const std::vector<std::string> samples{text_stl(), binary_stl(), dxf(), scene()};
  for (std::size_t i : {0U, 2U, 3U}) ASSERT_TRUE(run(i, samples[i])) << i;
  std::vector<std::size_t> runs(4), accepted(4);
  for (std::size_t n = 0; budget.allows(n) && !testing::Test::HasFailure(); ++n) {
    const std::size_t kind = random() % samples.size();
    const std::string bytes = mutate(samples[kind], random);
    accepted[kind] += run(kind, bytes) ? 1U : 0U;
    ++runs[kind];
    if (testing::Test::HasFailure()) std::cout << "kind " << kind << ":\n" << bytes << "\n";
  }
  for (std::size_t i = 0; i < 4; ++i)
    std::cout << "kind " << i << ": " << runs[i] << " files, " << accepted[i] << " accepted\n";
  EXPECT_GT(accepted[2], 0U);
  EXPECT_LT(accepted[2], runs[2]);
}

}  // namespace
}  // namespace robomosp::cad_exchange

// SPDX-License-Identifier: Apache-2.0
// Seeded mutation of native files: reading never crashes, a refusal is a sentence with a place and
// leaves nothing behind, and what is accepted is written and read again to the same bytes.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/mutator.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream s;
  s << in.rdbuf();
  return s.str();
}

std::vector<std::string> samples() {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "tests/fuzz/corpus"))
    if (entry.is_regular_file() && entry.path().extension() != ".ply")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // so that a seed gives the same run everywhere
  std::vector<std::string> texts;
  for (const auto& f : files) texts.push_back(slurp(f));
  return texts;
}

constexpr const char* kTokens[] = {"{",
                                   "}",
                                   "(",
                                   ")",
                                   ",",
                                   "\"",
                                   "#",
                                   "\n",
                                   "\\",
                                   " -",
                                   "1e308 ",
                                   "1e-320 ",
                                   "-0 ",
                                   "inf ",
                                   "nan ",
                                   "0x1 ",
                                   "mm ",
                                   " deg ",
                                   "name ",
                                   "union { ",
                                   "box { x 1 y 1 z 1 }",
                                   "at (0, 0, 1) ",
                                   "rpy (1, 2, 3) ",
                                   "robomosp ",
                                   "\xC3\xA9",
                                   "\xFF",
                                   "true ",
                                   "9223372036854775808 ",
                                   "material \"a.mtr\" ",
                                   "pose p () ",
                                   "parent base ",
                                   " (0, 1)",
                                   "mirror { ",
                                   "profile { loop { ",
                                   "frame global ",
                                   "spherical (1, 2, 3) ",
                                   "repeat { count 2 ",
                                   "if { condition \"a == 1\" ",
                                   "else { ",
                                   "wait { time 1 } ",
                                   "call { task \"rest.tsk\" } ",
                                   "move { pose \"home\" } ",
                                   "signal ready { } ",
                                   "light sun { kind sun } ",
                                   "task rest { task \"rest.tsk\" } ",
                                   "attachment { object \"table\"  robot \"pa10\" } ",
                                   "turning cubic { ",
                                   "transition none "};

/// Reads a text; when it is accepted, checks that writing it is stable. Tells whether it was.
bool check(const std::string& text, const fs::path& folder) {
  document::Document document;
  auto tx = document.begin("fuzz");
  const auto loaded = io::load_text(*tx, text, "fuzz", folder, {});
  if (!loaded.ok()) {
    EXPECT_EQ(tx->now().size(), 0U);
    EXPECT_FALSE(loaded.error().message.empty());
    EXPECT_NE(loaded.error().where.find(':'), std::string::npos)
        << loaded.error().sentence() << "\n"
        << text;
    return false;
  }
  const auto first = io::print(tx->now(), loaded->id, folder / "fuzz", {});
  if (!first.ok()) {
    ADD_FAILURE() << first.error().sentence() << "\n" << text;
    return true;
  }
  EXPECT_TRUE(tx->commit().ok()) << text;
  document::Document again;
  auto tx2 = again.begin("fuzz");
  const auto reloaded = io::load_text(*tx2, *first, "fuzz", folder, {});
  if (!reloaded.ok()) {
    ADD_FAILURE() << reloaded.error().sentence() << "\nread:\n" << text << "\nwritten:\n" << *first;
    return true;
  }
  EXPECT_TRUE(tx2->commit().ok());
  EXPECT_EQ(io::print(*again.now(), reloaded->id, folder / "fuzz", {}).value(), *first) << text;
  EXPECT_EQ(again.content_digest(), document.content_digest()) << text;
  return true;
}

TEST(NativeFuzz, MutatedFilesAreRefusedInASentenceOrRewrittenExactly) {
  std::mt19937 random(test::seed());
  const test::FuzzBudget budget(150'000);
  const auto texts = samples();
  ASSERT_GE(texts.size(), 7U);
  const fs::path folder = fs::path(ROBOMOSP_SOURCE_DIR) / "tests/fuzz/corpus";
  for (const auto& t : texts) ASSERT_TRUE(check(t, folder)) << t;

  test::Mutator mutator(random, texts, kTokens);
  std::size_t runs = 0, accepted = 0;
  while (budget.allows(runs) && !testing::Test::HasFailure()) {
    const std::string& base =
        texts[std::uniform_int_distribution<std::size_t>(0, texts.size() - 1)(random)];
    accepted += check(mutator.mutate(base), folder) ? 1U : 0U;
    ++runs;
  }
  std::cout << runs << " files, " << accepted << " accepted\n";
  EXPECT_GT(accepted, 0U);
  EXPECT_LT(accepted, runs);
}

}  // namespace
}  // namespace robomosp

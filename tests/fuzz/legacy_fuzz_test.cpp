// SPDX-License-Identifier: Apache-2.0
// Seeded mutation of files of the 2006 program, each within a folder of whole ones: reading never
// crashes, a refusal is a sentence with a place and leaves nothing behind, and what is accepted can
// be kept and written as native files.
#include <unistd.h>

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

constexpr const char* kLegacyTokens[] = {"{",
                                         "}",
                                         "(",
                                         ")",
                                         ",",
                                         "\"",
                                         "#",
                                         "\n",
                                         "[",
                                         "]",
                                         "\"\" ",
                                         "1e308 ",
                                         "1e-320 ",
                                         "-0 ",
                                         "nan ",
                                         "0x1 ",
                                         "-1 ",
                                         "7 ",
                                         "999999999999 ",
                                         "0 3 0 ",
                                         "2 1 1 ",
                                         "Fixed ",
                                         "Revolute ",
                                         "Prismatic ",
                                         "Cartesian ",
                                         "Joint ",
                                         "( 0, 0, 0, 0, 0, 0 ) ",
                                         "\xF1",
                                         "\xC3",
                                         "./Saves/Robots/reacher.rbt\" "};

/// Removed first: file systems flush a file that is emptied and written again.
void write(const fs::path& file, const std::string& text) {
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << text;
}

/// Whether the file is accepted.
bool check(const fs::path& file, const std::string& text) {
  document::Document document;
  auto tx = document.begin("fuzz");
  const auto loaded = io::load(*tx, file, {});
  if (!loaded.ok()) {
    EXPECT_EQ(tx->now().size(), 0U) << text;
    EXPECT_FALSE(loaded.error().message.empty());
    EXPECT_NE(loaded.error().where.find(':'), std::string::npos)
        << loaded.error().sentence() << "\n"
        << text;
    return false;
  }
  EXPECT_TRUE(io::print(tx->now(), loaded->id, file.parent_path() / "fuzz", {}).ok()) << text;
  const auto done = tx->commit();
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence()) << "\n" << text;
  return true;
}

TEST(LegacyFuzz, MutatedFilesAreRefusedInASentenceOrKept) {
  std::mt19937 random(test::seed());
  const test::FuzzBudget budget(2'000);
  std::string pattern = (fs::temp_directory_path() / "robomosp_fuzz_XXXXXX").string();
  const fs::path folder = ::mkdtemp(pattern.data());
  fs::copy(fs::path(ROBOMOSP_SOURCE_DIR) / "tests/support/files-2006", folder,
           fs::copy_options::recursive);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // so that a seed gives the same run everywhere
  std::vector<std::string> texts;
  for (const auto& f : files) {
    std::ifstream in(f, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    texts.push_back(s.str());
    ASSERT_TRUE(check(f, texts.back()));
  }
  ASSERT_GE(files.size(), 10U);

  test::Mutator mutator(random, texts, kLegacyTokens);
  std::size_t runs = 0, accepted = 0;
  while (budget.allows(runs) && !testing::Test::HasFailure()) {
    const std::size_t k = std::uniform_int_distribution<std::size_t>(0, files.size() - 1)(random);
    const std::string text = mutator.mutate(texts[k]);
    write(files[k], text);
    accepted += check(files[k], text) ? 1U : 0U;
    write(files[k], texts[k]);
    ++runs;
  }
  std::cout << runs << " files, " << accepted << " accepted\n";
  EXPECT_GT(accepted, 0U);
  EXPECT_LT(accepted, runs);
  std::error_code ec;
  fs::remove_all(folder, ec);
}

}  // namespace
}  // namespace robomosp

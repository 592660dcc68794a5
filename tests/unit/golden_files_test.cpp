// SPDX-License-Identifier: Apache-2.0
// Files keep their bytes: every record of the library, which earlier programs saved, is written
// exactly as it was read. The library's files are the golden ones; none of them is made anew here.
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/native.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

TEST(GoldenFiles, EveryRecordOfTheLibraryIsWrittenWithTheBytesThatItHas) {
  const std::vector<fs::path> library{fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"};
  const std::set<std::string> extensions{".mtr", ".csg", ".part", ".rbt", ".tjc", ".wld", ".tsk"};
  std::size_t files = 0;
  std::set<Kind> kinds;
  for (const auto& entry : fs::recursive_directory_iterator(library[0])) {
    const fs::path& file = entry.path();
    if (!extensions.contains(file.extension().string())) continue;
    ++files;
    document::Document d;
    auto tx = d.begin("load");
    const auto loaded = io::load(*tx, file, library);
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    kinds.insert(loaded->id.kind);
    const auto text = io::print(tx->now(), loaded->id, file, library);
    ASSERT_TRUE(text.ok()) << text.error().sentence();
    EXPECT_EQ(*text, io::read_file(file).value()) << file;
  }
  EXPECT_GE(files, 150U);
  EXPECT_GE(kinds.size(), 6U) << "the library has no tasks";
}

}  // namespace
}  // namespace robomosp

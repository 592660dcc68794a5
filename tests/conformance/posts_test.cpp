// SPDX-License-Identifier: Apache-2.0
// The suite of posts on every target that is shipped, and on packs of templates.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include <robomosp/sdk/conformance/post_suite.h>

#include "program_post/templates.h"

namespace robomosp::conformance {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLanguage = ROBOMOSP_PLUGIN_DIR "/irl.so";
constexpr const char* kConstructs = ROBOMOSP_SOURCE_DIR "/scripts/post_test/constructs.txt";

std::vector<PostSubject> shipped() {
  std::vector<PostSubject> all;
  std::set<std::string> files;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(ROBOMOSP_PLUGIN_DIR, none))
    if (entry.path().filename().string().starts_with("post_")) files.insert(entry.path());
  for (const std::string& file : files)
    for (const std::string& name : provider_names<Post>(file.c_str()))
      all.push_back({file, name, kLanguage, kConstructs, {}});
  return all;
}

/// The post of a pack, with what its folder has.
std::shared_ptr<Post> by_templates(const fs::path& file) {
  const auto read = [](const fs::path& f) {
    std::ifstream in(f, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto pack = program_post::read_templates(
      read(file), file.filename().string(), [&](const std::string& name) -> Result<std::string> {
        return read(file.parent_path() / name);
      });
  EXPECT_TRUE(pack.ok()) << (pack.ok() ? "" : pack.error().sentence());
  return pack.ok() ? std::shared_ptr<Post>(program_post::make_template_post(*pack)) : nullptr;
}
std::vector<PostSubject> packs() {
  std::vector<PostSubject> all;
  std::error_code none;
  for (const fs::path& folder : {fs::path(ROBOMOSP_SOURCE_DIR "/sdk/examples"),
                                fs::path(ROBOMOSP_SOURCE_DIR "/tests/conformance/packs")})
    for (const auto& entry : fs::directory_iterator(folder, none))
      if (fs::is_regular_file(entry.path() / "pack.post", none))
        all.push_back({"", entry.path().filename().string(), kLanguage, kConstructs,
                       [file = entry.path() / "pack.post"] { return by_templates(file); }});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Shipped, PostConformance, testing::ValuesIn(shipped()),
                         [](const auto& one) { return one.param.provider; });
INSTANTIATE_TEST_SUITE_P(Templates, PostConformance, testing::ValuesIn(packs()),
                         [](const auto& one) { return one.param.provider; });

TEST(Posts, AllOfTheTreeAreJudged) {
  EXPECT_GE(shipped().size(), 17U);
  EXPECT_GE(packs().size(), 2U);
}

}  // namespace
}  // namespace robomosp::conformance

// SPDX-License-Identifier: Apache-2.0
// Every picture of docs/images is made by scripts/make_pictures.sh or named here, stands on a page,
// and every picture on a page is there.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

const fs::path kSource = ROBOMOSP_SOURCE_DIR;

/// Photographs of the window by `robomosp-desktop --tour`.
bool is_of_the_window(const std::string& name) { return name.starts_with("desktop_"); }

/// Taken in a browser, which no script of ours starts; measured by tests/bench/growth.lua.
const Names kByHand{"browser_console.png", "browser_recording.png", "browser_world.png",
                    "replay_pa10.png",     "growth_records.png",    "growth_samples.png",
                    "growth_nodes.png",    "growth_objects.png",    "growth_joints.png"};

Names in_folder() {
  Names all;
  for (const auto& entry : fs::directory_iterator(kSource / "docs/images"))
    all.insert(entry.path().filename().string());
  return all;
}

Names made() {
  Names all;
  const std::string command = (kSource / "scripts/make_pictures.sh").string() + " --list";
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return all;
  std::array<char, 256> line{};
  while (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) {
    std::string name = line.data();
    while (!name.empty() && name.back() == '\n') name.pop_back();
    EXPECT_TRUE(all.insert(name).second) << name << " is made twice";
  }
  EXPECT_EQ(pclose(pipe), 0);
  return all;
}

Names linked() {
  std::vector<fs::path> pages{kSource / "README.md"};
  for (const auto& entry : fs::recursive_directory_iterator(kSource / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  Names all;
  const std::regex picture(R"(!\[[^\]]*\]\(([^)]*images/([^)/]+))\))");
  for (const fs::path& page : pages) {
    std::ifstream in(page);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (std::sregex_iterator at(text.begin(), text.end(), picture), end; at != end; ++at) {
      const fs::path file = page.parent_path() / (*at)[1].str();
      EXPECT_TRUE(fs::exists(file)) << page << " shows " << file << ", which is not there";
      all.insert((*at)[2]);
    }
  }
  return all;
}

std::string difference(const Names& a, const Names& b) {
  std::string out;
  for (const std::string& name : a)
    if (b.count(name) == 0) out += name + " ";
  return out;
}

TEST(Pictures, AreAllMadeByTheScript) {
  Names all = made();
  EXPECT_GT(all.size(), 50U);
  all.insert(kByHand.begin(), kByHand.end());
  for (const std::string& name : in_folder())
    if (is_of_the_window(name)) all.insert(name);
  EXPECT_EQ(difference(in_folder(), all), "") << "are in docs/images and made by nothing";
  EXPECT_EQ(difference(all, in_folder()), "") << "are made and not in docs/images";
}

TEST(Pictures, AllStandOnAPage) {
  EXPECT_EQ(difference(in_folder(), linked()), "") << "are on no page";
}

TEST(Pictures, AreMadeByDemosThatAreThere) {
  std::ifstream in(kSource / "scripts/make_pictures.sh");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::regex recipe(R"(\n([a-z0-9_]+)( normal)?( \d+)?: [a-z])");
  int count = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), recipe), end; at != end; ++at, ++count)
    EXPECT_TRUE(fs::exists(kSource / "scripts/demos" / ((*at)[1].str() + ".lua"))) << (*at)[1];
  EXPECT_GE(count, 15);
}

}  // namespace
}  // namespace robomosp

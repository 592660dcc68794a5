// SPDX-License-Identifier: Apache-2.0
// What the built programs and plugins link to: the other half of the layer rule.
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

/// Libraries the dynamic loader would load, as ldd prints them.
std::string libraries_of(const std::string& file) {
  EXPECT_TRUE(std::filesystem::exists(file)) << file;
  std::string out;
  if (std::FILE* pipe = popen(("ldd '" + file + "'").c_str(), "r")) {
    std::array<char, 512> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) out += line.data();
    EXPECT_EQ(pclose(pipe), 0) << "ldd " << file;
  }
  EXPECT_NE(out.find("libstdc++"), std::string::npos) << out;
  return out;
}

void expect_none(const std::string& file, const std::vector<std::string>& forbidden) {
  const std::string found = libraries_of(file);
  for (const auto& name : forbidden)
    EXPECT_EQ(found.find(name), std::string::npos) << file << " links " << name;
}

const std::string kPlugins = ROBOMOSP_PLUGIN_DIR;

TEST(Links, TheConsoleProgramNamesNeitherOpenSceneGraphNorQtNorASolidsEngine) {
  expect_none(ROBOMOSP_BUILD_DIR "/bin/robomosp", {"libosg", "libOpenThreads", "libQt", "libGL",
                                                   "libEGL", "libX11", "libTK", "liblua5.4.so"});
}

TEST(Links, LuaIsTheFlavourThatUnwindsCppFrames) {
  EXPECT_NE(libraries_of(ROBOMOSP_BUILD_DIR "/bin/robomosp").find("liblua5.4-c++"),
            std::string::npos);
}

TEST(Links, TheSolidsPluginIsADoorUntilItIsUsed) {
  expect_none(kPlugins + "/csg_occt.so", {"libTK"});
  EXPECT_NE(libraries_of(kPlugins + "/lazy/csg_occt.so").find("libTK"), std::string::npos);
}

TEST(Links, PluginsLinkNeitherLuaNorAnyDisplay) {
  int seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kPlugins)) {
    if (entry.path().extension() != ".so") continue;
    ++seen;
    expect_none(entry.path().string(), {"liblua", "libosg", "libQt", "libX11", "libGL"});
  }
  EXPECT_GE(seen, 4);
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// No provider is shipped without the SDK's suite of its interface: what the plugins of the build
// offer, as the program's loader reads it, against the cases of all programs of this folder, as
// --gtest_list_tests lists them. Those programs are tests of their own; this one only sees that
// nobody is forgotten.
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/plugin_loader.h"
#include "kernel/registry.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

/// The suite that judges an interface, by its name in the SDK's headers: that of
/// robomosp.joint_segment is JointSegmentConformance, and interfaces that share one have the last
/// word of their names in common: DynamicsConformance. "" = there is none. A suite's cases print as
/// "PROVIDER ...".
std::string suite_of(std::string_view interface_id) {
  static const std::string headers = [] {
    std::ostringstream all;
    for (const auto& entry : fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) /
                                                    "sdk/include/robomosp/sdk/conformance"))
      all << std::ifstream(entry.path()).rdbuf();
    return all.str();
  }();
  std::string_view name = interface_id.substr(0, interface_id.find('/'));
  name.remove_prefix(name.find('.') + 1);
  const auto named = [](std::string_view words) {
    std::string out;
    bool is_first = true;
    for (const char c : words) {
      if (c != '_')
        out += is_first ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
      is_first = c == '_';
    }
    return out + "Conformance";
  };
  for (const std::string_view words : {name, name.substr(name.rfind('_') + 1)})
    if (headers.find("class " + named(words) + " ") != std::string::npos) return named(words);
  return "";
}
/// Interfaces without a suite that any provider could pass, and where theirs are tested.
const std::map<std::string, std::string> kTestedElsewhere{
    {"robomosp.importer/1",
     "tests/unit/cad_exchange_test.cpp, robot_files_test.cpp and tests/fuzz"},
    {"robomosp.exporter/1", "tests/unit/cad_exchange_test.cpp"},
    {"robomosp.program_reader/1",
     "tests/unit/program_readers_test.cpp; what readers share is the guard of the host"},
    {"robomosp.renderer/2", "tests/viewer/render_test.cpp"},
};

/// "suite provider" of every case that a test program lists.
std::set<std::string> judged(const std::string& program) {
  std::set<std::string> found;
  FILE* pipe = popen(("\"" + program + "\" --gtest_list_tests").c_str(), "r");
  if (!pipe) return found;
  std::string text;
  std::array<char, 4096> part{};
  while (const std::size_t n = fread(part.data(), 1, part.size(), pipe))
    text.append(part.data(), n);
  EXPECT_EQ(pclose(pipe), 0) << program;
  std::string suite;
  for (std::size_t at = 0, end = 0; at < text.size(); at = end + 1) {
    end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    if (!line.empty() && line[0] != ' ') {  // "Fcl/CollisionConformance.  # TypeParam..."
      const std::size_t from = line.find('/') == std::string::npos ? 0 : line.find('/') + 1;
      suite = line.substr(from, line.find('.', from) - from);
      continue;
    }
    constexpr std::string_view kCase = "# GetParam() = ";
    const std::size_t from = line.find(kCase);
    if (from == std::string::npos) continue;
    std::string who = line.substr(from + kCase.size());
    if (suite == "DynamicsConformance") {  // "INVERSE and FORWARD on MODEL", or "INVERSE on MODEL"
      const std::size_t both = who.find(" and ");
      found.insert("robomosp.inverse_dynamics/1 " + who.substr(0, who.find(' ')));
      if (both == std::string::npos || both > who.find(" on ")) continue;
      who = who.substr(both + 5);
      found.insert("robomosp.forward_dynamics/1 " + who.substr(0, who.find(' ')));
      continue;
    }
    for (const std::string& interface_id : known_interfaces())
      if (suite_of(interface_id) == suite)
        found.insert(interface_id + " " + who.substr(0, who.find(' ')));
  }
  return found;
}

TEST(Conformance, EveryShippedProviderIsJudgedByTheSuiteOfItsInterface) {
  std::set<std::string> all;
  std::ifstream programs(ROBOMOSP_CONFORMANCE_PROGRAMS);
  for (std::string program; std::getline(programs, program);) all.merge(judged(program));
  EXPECT_TRUE(all.contains("robomosp.ik/1 numeric")) << "the lists of tests are not understood";

  EXPECT_EQ(suite_of("robomosp.forward_dynamics/1"), "DynamicsConformance");
  EXPECT_EQ(suite_of("robomosp.renderer/1"), "");
  Registry registry;
  PluginLoader loader(registry);
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(ROBOMOSP_PLUGIN_DIR)) {
    if (entry.path().extension() != ".so") continue;
    ++files;
    const PluginReport report = loader.load(entry.path().string());
    EXPECT_TRUE(report.loaded && report.remarks.empty())
        << entry.path() << ": what it offers cannot be seen";
  }
  EXPECT_GT(files, 5U);
  for (const ProviderInfo& p : registry.list()) {
    SCOPED_TRACE(p.origin);
    if (const std::string suite = suite_of(p.interface_id); !suite.empty()) {
      EXPECT_TRUE(all.contains(p.interface_id + " " + p.name))
          << p.interface_id << " \"" << p.name << "\" is judged by no case of " << suite
          << ". Instantiate it in a program of tests/conformance.";
    } else {
      EXPECT_TRUE(kTestedElsewhere.contains(p.interface_id))
          << p.interface_id << " \"" << p.name
          << "\": there is no suite of this interface. Write one in "
             "sdk/include/robomosp/sdk/conformance, or tell here where its providers are tested.";
    }
  }
}

}  // namespace
}  // namespace robomosp

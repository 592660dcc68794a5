// SPDX-License-Identifier: Apache-2.0
// Every command's example runs in a fresh session, and docs/ioci says what the table says.
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "docs/examples.h"
#include "ioci/core/application.h"
#include "lua/lua_state.h"
#include "remote/json.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

Application& app() { return test::examples_app(); }

/// The application ends before the libraries do that its plugins opened.
class End final : public testing::Environment {
  void TearDown() override { test::examples_holder().reset(); }
};
const testing::Environment* const kEnd = testing::AddGlobalTestEnvironment(new End);

/// Time that passes for this thread, without what it waited for a core of a busy machine.
std::chrono::nanoseconds own_time() {
  std::ifstream in("/proc/thread-self/schedstat");
  std::int64_t ran = 0, waited = 0;
  in >> ran >> waited;  // without such a file nothing is left out
  return std::chrono::steady_clock::now().time_since_epoch() - std::chrono::nanoseconds(waited);
}

TEST(IociExamples, EveryExampleRunsInAFreshSession) {
  app().lock.set_clock(own_time);
  const AppLock::Stats at_first = app().lock.stats();
  const test::ExamplesFolder folder("examples");  // examples write files by relative names
  for (const CommandSpec* spec : app().commands.list()) {
    // A build without the viewer has nothing that draws.
    if (test::cannot_draw(*spec)) continue;
    app().document.clear();
    for (const auto& [number, recording] : app().recordings.list()) app().recordings.remove(number);
    Session session("example");
    lua::LuaState lua(app(), session,
                      {.print = [](std::string_view) {},
                       .module_path = {fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/lib"}});
    const auto done = lua.run_string(spec->example, spec->name);
    EXPECT_TRUE(done.ok()) << spec->name << ": " << (done.ok() ? "" : done.error().sentence())
                           << "\n"
                           << spec->example;
  }
  app().document.clear();
  const AppLock::Stats lock = app().lock.stats();
  EXPECT_GT(lock.holds, at_first.holds + 1000) << "the examples edit";
  EXPECT_EQ(lock.long_holds, 0U) << "the application lock was held for "
                                 << std::chrono::duration<double, std::milli>(lock.longest).count()
                                 << " ms by " << lock.longest_by;
  EXPECT_EQ(lock.calls_within, 0U) << "a provider or script was called while it was held";
  app().lock.set_clock({});
}

TEST(IociExamples, EveryExampleCallsItsCommand) {
  for (const CommandSpec* spec : app().commands.list()) {
    const auto dot = spec->name.find('.');
    const std::string verb = dot == std::string::npos ? spec->name : spec->name.substr(dot + 1);
    EXPECT_TRUE(spec->example.find(spec->name) != std::string::npos ||
                spec->example.find(":" + verb) != std::string::npos)
        << spec->name << "\n"
        << spec->example;
  }
}

TEST(IociReference, TheFolderDocsIociIsWhatTheTableSays) {
  const fs::path folder = fs::path(ROBOMOSP_SOURCE_DIR) / "docs/ioci";
  const auto pages =
      reference_pages(app().commands, [](const Value& v) { return remote::to_json(v); });
  for (const auto& [name, text] : pages) {
    std::ifstream in(folder / name, std::ios::binary);
    ASSERT_TRUE(in) << name << " is missing; robomosp commands --markdown docs/ioci writes it";
    std::ostringstream now;
    now << in.rdbuf();
    EXPECT_TRUE(now.str() == text)
        << name << " differs; robomosp commands --markdown docs/ioci writes it anew";
  }
  for (const auto& entry : fs::directory_iterator(folder))
    EXPECT_TRUE(pages.contains(entry.path().filename().string()))
        << entry.path() << " is not in the table any more";
}

TEST(IociReference, WritingTheReferenceRemovesPagesThatAreGone) {
  const auto folder =
      fs::temp_directory_path() / ("robomosp-reference-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "gone.md") << "# gone\n\nGenerated from the command table; do not edit.\n";
  std::ofstream(folder / "notes.md") << "# Mine\n";
  ASSERT_TRUE(write_reference(app().commands, folder).ok());
  EXPECT_FALSE(fs::exists(folder / "gone.md"));
  EXPECT_TRUE(fs::exists(folder / "notes.md")) << "a page written by hand stays";
  EXPECT_TRUE(fs::exists(folder / "robot.md"));
  fs::remove_all(folder);
}

TEST(IociReference, EveryCommandIsExplained) {
  for (const CommandSpec* spec : app().commands.list()) {
    EXPECT_TRUE(spec->summary.ends_with(".")) << spec->name;
    for (const ParamSpec& p : spec->params)
      EXPECT_TRUE(p.doc.ends_with(".")) << spec->name << ", " << p.name;
    const bool told =
        spec->returns.type != "map" || !spec->returns.fields.empty() || !spec->returns.doc.empty();
    EXPECT_TRUE(told) << spec->name << " does not tell its fields";
    for (const ParamSpec& p : spec->returns.fields)
      EXPECT_TRUE(p.doc.ends_with(".")) << spec->name << ", returned " << p.name;
  }
}

// The original's commands that this program answers, from its console reference and the paper.
TEST(IociReference, TheClassicSpellingsAreThere) {
  const char* const spellings[] = {"World LsPObjects",
                                   "World LsPRobots",
                                   "World LsPTrajectories",
                                   "World LoadPTrajectory",
                                   "World WorldInvKineSim",
                                   "World WorldInvDynSim",
                                   "World InvKineWorldSim",
                                   "World InvDynWorldSim",
                                   "World GetPObjectId",
                                   "World GetPRobotId",
                                   "World GetPTrajectoryId",
                                   "World GetPRobotIndex",
                                   "World GetPTrajectoryIndex",
                                   "World Close",
                                   "World Save",
                                   "World Show",
                                   "Worlds Open",
                                   "Worlds Create",
                                   "Worlds LsWorlds",
                                   "Worlds GetWorldId",
                                   "Worlds GetWorldIndex",
                                   "PRobot AddLinks",
                                   "PRobot SetLinks",
                                   "PRobot vGetDynamic",
                                   "PRobot vGetDynamicp",
                                   "PRobot mGetDHP",
                                   "PRobot mGetToolHMT",
                                   "PRobot GetDOF",
                                   "PRobot GetBaseType",
                                   "PRobot LLRL mJacobian",
                                   "PRobot LLRL FKine",
                                   "PRobot LLRL IKine",
                                   "PObject vGetDynamicp",
                                   "PTrajectory GetParameters",
                                   "PTrajectory GetNumGenPoints",
                                   "PTrajectory GetGenPoint",
                                   "Transform Get",
                                   "Transform Set",
                                   "Transform Add",
                                   "ForceReDraw"};
  for (const std::string line : spellings) {
    const auto blank = line.find(' ');
    EXPECT_NE(app().commands.find_classic(line.substr(0, blank),
                                          blank == std::string::npos ? "" : line.substr(blank + 1)),
              nullptr)
        << line;
  }
}

}  // namespace
}  // namespace robomosp::ioci

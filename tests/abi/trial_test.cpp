// SPDX-License-Identifier: Apache-2.0
// Plugins that end the process that opens them: named, left out, tried once more, then left out.
#include "kernel/plugin_trial.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <robomosp/sdk/ik.h>

#include "kernel/plugin_loader.h"

#include <sys/wait.h>
#include <unistd.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class Trial : public testing::Test {
 protected:
  Trial() {
    std::string pattern = (fs::temp_directory_path() / "rmp-trial-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
    folder_ = fs::canonical(folder_);
    plugins_ = folder_ / "plugins";
    fs::create_directories(plugins_);
  }
  ~Trial() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  /// A copy of a plugin of the build in the folder that starts look in.
  fs::path install(const std::string& name) {
    const fs::path to = plugins_ / (name + ".so");
    fs::copy_file(fs::path(ABI_PLUGIN_DIR) / ("abi_" + name + ".so"), to,
                  fs::copy_options::overwrite_existing);
    return to;
  }
  /// One start of the program: what it says of each file.
  std::vector<PluginReport> start() {
    Registry registry;
    PluginLoader loader(registry);
    loader.set_search_path({plugins_});
    loader.set_trial_seconds(trial_seconds_);
    loader.remember_failures(folder_ / "state");
    loader.load_all();
    return loader.reports();
  }
  /// The refusal of the only file without its name; "loaded" when there is none.
  std::string said() {
    const auto reports = start();
    EXPECT_EQ(reports.size(), 1U);
    if (reports.empty() || !reports[0].refusal) return "loaded";
    EXPECT_NE(reports[0].refusal->where.find(plugins_.string()), std::string::npos);
    return reports[0].refusal->sentence().substr(reports[0].refusal->where.size() + 2);
  }
  void expect_tried_twice(const std::string& name, const std::string& how) {
    install(name);
    EXPECT_EQ(said(),
              "it " + how +
                  ", and is left out. It is tried once more at the next start; remove it if "
                  "it is not needed.");
    EXPECT_EQ(
        said(),
        "it " + how + ", and is left out. Update or remove it; plugin.load tries it once more.");
    trial_seconds_ = 120;
    const auto before = std::chrono::steady_clock::now();
    EXPECT_EQ(said(), "it " + how +
                          ", 2 times, and is left out. Update or remove it; plugin.load tries it "
                          "once more.");
    // No process was started for that, so not even a hang costs anything.
    const std::chrono::duration<double, std::milli> took =
        std::chrono::steady_clock::now() - before;
    RecordProperty("left_out_ms", std::to_string(took.count()));
    std::printf("a start without it took %.0f ms (aim 500)\n", took.count());
    EXPECT_LT(took, std::chrono::seconds(15));
  }
  fs::path folder_, plugins_;
  double trial_seconds_ = 60;
};

TEST_F(Trial, ACrashOfAStaticObjectIsNamed) {
  expect_tried_twice("load_crashes", "crashed (signal SIGILL) while it was loaded");
}
TEST_F(Trial, ACrashOfTheEntryIsNamed) {
#ifdef __SANITIZE_ADDRESS__  // which turns the signal into an exit
  expect_tried_twice("entry_crashes", "ended the process that loaded it with exit code 1");
#else
  expect_tried_twice("entry_crashes", "crashed (signal SIGSEGV) while it was loaded");
#endif
}
TEST_F(Trial, AHangIsNamed) {
  trial_seconds_ = 1;
  expect_tried_twice("load_hangs", "did not come back within 1 s while it was loaded");
}
TEST_F(Trial, AnExitWithStatusZeroIsNamed) {
  expect_tried_twice("load_exits", "ended the process that loaded it");
}
TEST_F(Trial, AnImmediateExitWithStatusZeroIsNamed) {
  expect_tried_twice("load_leaves", "ended the process that loaded it");
}

TEST_F(Trial, TheOthersLoadAndAGoodOneIsTriedOnce) {
  install("load_exits");
  install("good");
  install("wrong_tag");
  for (int i = 0; i < 3; ++i) {
    const auto reports = start();
    ASSERT_EQ(reports.size(), 3U);
    EXPECT_TRUE(reports[0].loaded) << "good";
    EXPECT_TRUE(reports[1].refusal) << "load_exits";
    EXPECT_NE(reports[2].refusal->message.find("ABI tag"), std::string::npos);
  }
}

TEST_F(Trial, ANewBuildOfTheFileIsTriedAnew) {
  install("load_exits");
  for (int i = 0; i < 3; ++i) EXPECT_NE(said(), "loaded");
  fs::copy_file(fs::path(ABI_PLUGIN_DIR) / "abi_good.so", plugins_ / "load_exits.so",
                fs::copy_options::overwrite_existing);
  EXPECT_EQ(said(), "loaded");
}

TEST_F(Trial, WhoNamesAFileHasItTriedHoweverOftenItFailed) {
  const fs::path file = install("load_exits");
  for (int i = 0; i < 3; ++i) EXPECT_NE(said(), "loaded");
  Registry registry;
  PluginLoader loader(registry);
  loader.set_trial_seconds(1);
  loader.remember_failures(folder_ / "state");
  EXPECT_NE(loader.load(file.string()).refusal->message.find("ended the process"),
            std::string::npos);
}

/// A process that dies as the program would: in the middle of opening a plugin that passed its
/// trial.
void die_while_opening(const fs::path& state, const fs::path& file) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    PluginTrials trials(state, 1);
    const bool admitted = trials.admit(file, false, false).ok();
    const PluginTrials::Opening opening(trials, file);
    ::_exit(admitted ? 7 : 8);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

TEST_F(Trial, WhatEndedTheProgramItselfSitsOutTheNextStartAndIsTriedAtTheOneAfter) {
  const fs::path file = install("good");
  die_while_opening(folder_ / "state", file);
  EXPECT_EQ(said(),
            "it ended the program while it was loaded at the start before, and is left out. It is "
            "tried once more at the next start; remove it if it is not needed.");
  die_while_opening(folder_ / "state", file);
  EXPECT_EQ(said(),
            "it ended the program while it was loaded, 2 times, and is left out. Update or remove "
            "it; plugin.load tries it once more.");
}

TEST_F(Trial, AnExitOfAPluginThatIsOpenedHereEndsWithASentenceAndNotWithStatusZero) {
  const fs::path file = install("good");
  EXPECT_EXIT(
      {
        PluginTrials trials(folder_ / "state", 1);
        const PluginTrials::Opening opening(trials, file);
        std::exit(0);
      },
      testing::ExitedWithCode(3), "ended the program while it was loaded");
}

TEST_F(Trial, AProgramThatRunsOnIsNoDeath) {
  const fs::path file = install("good");
  PluginTrials first(folder_ / "state", 1);
  const PluginTrials::Opening opening(first, file);
  PluginTrials second(folder_ / "state", 1);  // another start meanwhile
  EXPECT_TRUE(second.admit(file, false, false).ok());
}

TEST_F(Trial, WithoutAPlaceToRememberFilesAreStillTried) {
  const fs::path file = install("load_crashes");
  PluginTrials trials({}, 1);
  EXPECT_FALSE(trials.admit(file, false, false).ok());
  PluginTrials unwritable("/proc/nowhere", 1);
  EXPECT_FALSE(unwritable.admit(file, false, false).ok());
  EXPECT_TRUE(unwritable.admit(install("good"), false, false).ok());
}

}  // namespace
}  // namespace robomosp

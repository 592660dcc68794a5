// SPDX-License-Identifier: Apache-2.0
// The program is killed while it saves, again and again under one process number, as in containers:
// every file is whole, those that refer to each other are there, and the next run saves as if
// nothing had been.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/same_process_number.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

/// Saves a world and what is in it under the names that they have, for ever or once.
std::string script(const std::string& loop) {
  return "for i = 1, 40 do material.create{name = 'm' .. i, density = i, description = "
         "('long '):rep(400)} end "
         "solid.create{name = 'block', material = 'm1', root = {kind = 'box', x = 1, y = 1, z = "
         "1}} "
         "world.create{name = 'cell'} world.add_object{id = 'cell', what = 'block'} " +
         loop;
}
const std::string kForEver =
    "local n = 1 while true do file.save_all{folder = '.', overwrite = true} n = n + 1 "
    "for i = 1, 40 do material.set{id = 'm' .. i, density = n} end end";

pid_t run(const fs::path& folder) {
  const pid_t child = test::fork_as_the_first();
  if (child != 0) return child;
  if (::chdir((folder / "work").c_str()) != 0) ::_exit(126);
  if (!std::freopen((folder / "errors.txt").c_str(), "w", stderr)) ::_exit(126);
  for (const char* home : {"HOME", "XDG_STATE_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"})
    ::setenv(home, (folder / "home").c_str(), 1);
  const std::string program = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
  // With a journal of unsaved work, which the runs that are killed leave behind as well.
  ::execl(program.c_str(), program.c_str(), "-q", "--no-plugins", "run",
          (folder / "code.lua").c_str(), nullptr);
  ::_exit(127);
}

TEST(SaveFuzz, KilledSavesLeaveWholeFilesAndBlockNobody) {
  std::mt19937 random(test::seed());
  std::string pattern = (fs::temp_directory_path() / "robomosp_saves_XXXXXX").string();
  const fs::path folder = ::mkdtemp(pattern.data());
  for (const char* name : {"work", "home"}) fs::create_directory(folder / name);
  const auto write = [&](const std::string& code) {
    std::ofstream(folder / "code.lua", std::ios::binary) << code;
  };
  const test::FuzzBudget budget(5);
  std::size_t kills = 0, left = 0;
  std::uniform_real_distribution<double> wait(0.03, 0.4);
  for (; budget.allows(kills) && !testing::Test::HasFailure(); ++kills) {
    write(script(kForEver));
    const pid_t child = run(folder);
    std::this_thread::sleep_for(std::chrono::duration<double>(wait(random)));
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, WNOHANG), 0) << "it ended by itself";
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    for (const auto& entry : fs::directory_iterator(folder / "work")) {
      if (entry.path().filename().string()[0] == '.') {
        ++left;
        continue;
      }
      document::Document d;
      auto tx = d.begin("read");
      const auto loaded = io::load(*tx, entry.path(), {});
      EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : loaded.error().sentence());
    }
    // The next one saves.
    write(script("assert(#file.save_all{folder = '.', overwrite = true} == 42)"));
    const pid_t next = run(folder);
    ASSERT_EQ(::waitpid(next, &status, 0), next);
    std::ifstream errors(folder / "errors.txt");
    EXPECT_EQ(status, 0) << std::string(std::istreambuf_iterator<char>(errors), {});
  }
  std::cout << kills << " kills left " << left << " temporary files in all\n";
  std::error_code ec;
  fs::remove_all(folder, ec);
}

}  // namespace
}  // namespace robomosp

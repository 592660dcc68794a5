// SPDX-License-Identifier: Apache-2.0
// Files that are written together: all or none, and whatever ends the process leaves each of them
// the old or the new one.
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/same_process_number.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

struct Folder {
  Folder()
      : path(fs::temp_directory_path() / ("robomosp_file_batch_" + std::to_string(::getpid()))) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  [[nodiscard]] std::map<std::string, std::string> content() const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::directory_iterator(path)) {
      std::ifstream in(entry.path(), std::ios::binary);
      out[entry.path().filename().string()] = std::string(std::istreambuf_iterator<char>(in), {});
    }
    return out;
  }
  fs::path path;
};

/// More than stand open at once.
constexpr int kFiles = 140;

std::string name(int i) { return "f" + std::to_string(i); }
/// A few blocks of the disk, so that a torn file would show.
std::string text(int i, int round) {
  return std::string(9000, static_cast<char>('a' + round % 26)) + std::to_string(i) + "/" +
         std::to_string(round);
}

Result<void> write(const fs::path& folder, int round) {
  io::FileBatch batch;
  for (int i = 0; i < kFiles; ++i) RMP_TRY(batch.add(folder / name(i), text(i, round)));
  return batch.finish();
}

TEST(FileBatch, PutsAllInTheirPlacesOnlyWhenItIsFinished) {
  const Folder folder;
  ASSERT_TRUE(write(folder.path, 1).ok());
  std::map<std::string, std::string> wanted;
  for (int i = 0; i < kFiles; ++i) wanted[name(i)] = text(i, 1);
  EXPECT_EQ(folder.content(), wanted);
  {
    io::FileBatch batch;
    for (int i = 0; i < kFiles; ++i) ASSERT_TRUE(batch.add(folder.path / name(i), "new").ok());
    auto now = folder.content();
    EXPECT_EQ(now.size(), 2 * wanted.size());  // beside them
    for (const auto& [file, bytes] : wanted) ASSERT_EQ(now[file], bytes);
  }
  EXPECT_EQ(folder.content(), wanted);  // and gone
}

TEST(FileBatch, WhereOneCannotBeWrittenNoneIs) {
  const Folder folder;
  ASSERT_TRUE(write(folder.path, 1).ok());
  const auto before = folder.content();
  const auto refused = [&](const fs::path& file) {
    io::FileBatch batch;
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(batch.add(folder.path / name(i), "new").ok());
    const auto added = batch.add(file, "new");
    return added.ok() ? std::string() : added.error().message;
  };
  EXPECT_EQ(refused(folder.path / "none" / "file").rfind("there is no folder", 0), 0U);
  EXPECT_EQ(folder.content(), before);
  fs::create_directories(folder.path / "sub" / "folder");
  EXPECT_NE(refused(folder.path / "sub" / "folder").find("is a folder"), std::string::npos);
  fs::remove_all(folder.path / "sub");
  EXPECT_EQ(folder.content(), before);
}

TEST(FileBatch, AFileKeepsItsPermissionsAndTheLastOfOneNameStays) {
  const Folder folder;
  const fs::path file = folder.path / "kept";
  ASSERT_TRUE(io::write_file(file, "old").ok());
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
  io::FileBatch batch;
  ASSERT_TRUE(batch.add(file, "first").ok());
  ASSERT_TRUE(batch.add(file, "last").ok());
  ASSERT_TRUE(batch.finish().ok());
  EXPECT_EQ(folder.content(), (std::map<std::string, std::string>{{"kept", "last"}}));
  struct stat is {};
  ASSERT_EQ(::stat(file.c_str(), &is), 0);
  EXPECT_EQ(is.st_mode & 07777U, 0640U);
}

TEST(FileBatch, AProcessThatIsKilledLeavesOldOrNewFiles) {
  const Folder folder;
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(write(folder.path, 0).ok());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::mt19937 random(test::seed());
  std::uniform_real_distribution<double> part(0.5, 2.2);
  std::size_t mixed = 0;
  for (int kill = 0; kill < 4; ++kill) {
    const pid_t child = test::fork_as_the_first();
    if (child == 0) {
      for (int round = 1;; ++round)
        if (!write(folder.path, round).ok()) ::_exit(1);
    }
    std::this_thread::sleep_for(took * part(random));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    std::map<int, int> rounds;
    for (const auto& [file, bytes] : folder.content()) {
      if (file[0] == '.') continue;  // what it could not take away, and what others step over
      const int i = std::stoi(file.substr(1)), round = std::stoi(bytes.substr(bytes.find('/') + 1));
      ASSERT_EQ(bytes, text(i, round)) << file;
      ++rounds[round];
    }
    std::size_t files = 0;
    for (const auto& [round, count] : rounds) files += static_cast<std::size_t>(count);
    ASSERT_EQ(files, static_cast<std::size_t>(kFiles));
    ASSERT_LE(rounds.size(), 2U);  // those of one batch and of the one before
    mixed += rounds.size() - 1;
    ASSERT_TRUE(write(folder.path, 0).ok());
  }
  RecordProperty("mixed", static_cast<int>(mixed));
  // What was left behind goes with a later save, when it is certain that nobody writes it.
  for (const auto& entry : fs::directory_iterator(folder.path))
    fs::last_write_time(entry.path(), fs::file_time_type::clock::now() - std::chrono::hours(2));
  ASSERT_TRUE(write(folder.path, 0).ok());
  EXPECT_EQ(folder.content().size(), static_cast<std::size_t>(kFiles));
}

TEST(FileBatch, WhatKilledSavesLeftBehindIsSteppedOverAndGoesWhenItIsOld) {
  const Folder folder;
  const fs::path file = folder.path / "arm.rbt";
  for (int k = 0; k < 3; ++k)
    std::ofstream(folder.path / (".arm.rbt.part" + std::to_string(k))) << "torn";
  ASSERT_TRUE(io::write_file(file, "whole").ok());
  EXPECT_EQ(folder.content().size(), 4U);
  for (int k = 0; k < 2; ++k)
    fs::last_write_time(folder.path / (".arm.rbt.part" + std::to_string(k)),
                        fs::file_time_type::clock::now() - std::chrono::hours(2));
  ASSERT_TRUE(io::write_file(file, "again").ok());
  EXPECT_EQ(folder.content(),
            (std::map<std::string, std::string>{{".arm.rbt.part2", "torn"}, {"arm.rbt", "again"}}));
}

TEST(FileBatch, ALongNameLeavesRoomForTheTemporaryFile) {
  const Folder folder;
  const std::string name(255, 'n');
  const auto written = io::write_file(folder.path / name, "text");
  ASSERT_TRUE(written.ok()) << written.error().sentence();
  EXPECT_EQ(folder.content(), (std::map<std::string, std::string>{{name, "text"}}));
}

TEST(FileBatch, OfALinkTheFileBehindItIsReplaced) {
  const Folder folder;
  fs::create_directory(folder.path / "real");
  const fs::path real = folder.path / "real" / "arm.rbt", link = folder.path / "arm.rbt",
                 far = folder.path / "far.rbt";
  fs::create_symlink("real/arm.rbt", link);
  fs::create_symlink(link, far);
  // It need not be there yet.
  for (const char* text : {"first", "second"}) {
    ASSERT_TRUE(io::write_file(far, text).ok());
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_TRUE(fs::is_symlink(far));
    EXPECT_TRUE(io::file_holds(real, text));
  }
  fs::create_symlink("round.rbt", folder.path / "round.rbt");
  EXPECT_FALSE(io::write_file(folder.path / "round.rbt", "text").ok());
  fs::create_symlink("absent/arm.rbt", folder.path / "lost.rbt");
  EXPECT_FALSE(io::write_file(folder.path / "lost.rbt", "text").ok());
}

TEST(FileBatch, AFileThatSomebodyElseChangedIsNotReplacedAndNoneOfTheOthersIs) {
  const Folder folder;
  ASSERT_TRUE(io::write_file(folder.path / "a", "theirs").ok());
  ASSERT_TRUE(io::write_file(folder.path / "b", "known").ok());
  io::FileBatch batch;
  const io::FileBefore known{true, io::file_fingerprint("known")};
  ASSERT_TRUE(batch.add(folder.path / "b", "new", known).ok());
  ASSERT_TRUE(batch.add(folder.path / "c", "new", known).ok());  // gone since, or not yet there
  ASSERT_TRUE(batch.add(folder.path / "a", "new", known).ok());
  const auto done = batch.finish();
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::conflict);
  EXPECT_NE(done.error().message.find((folder.path / "a").string()), std::string::npos);
  EXPECT_TRUE(io::file_holds(folder.path / "b", "known"));
  EXPECT_FALSE(fs::exists(folder.path / "c"));

  io::FileBatch asked;
  ASSERT_TRUE(asked.add(folder.path / "a", "new", {true, {}}).ok());
  ASSERT_TRUE(asked.add(folder.path / "b", "known", {true, {}}).ok());
  ASSERT_TRUE(asked.finish().ok());
  EXPECT_EQ(asked.replaced(), (std::vector<fs::path>{folder.path / "a"}));
}

TEST(FileBatch, WhoeverSavesIntoAFolderAtOnceLearnsOfTheOthers) {
  const Folder folder;
  const fs::path file = folder.path / "shared";
  ASSERT_TRUE(io::write_file(file, "0").ok());
  std::atomic<int> refused{0}, made{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 25; ++i) {
        const std::string seen = io::read_file(file).value();
        io::FileBatch batch;
        const std::string mine = seen + "," + std::to_string(100 * t + i);
        EXPECT_TRUE(batch.add(file, mine, {true, io::file_fingerprint(seen)}).ok());
        if (batch.finish().ok()) ++made;
        else ++refused;
      }
    });
  for (auto& t : threads) t.join();
  // Nobody's word is lost: each that was taken builds on all before.
  const std::string last = io::read_file(file).value();
  EXPECT_EQ(std::count(last.begin(), last.end(), ','), made.load());
  EXPECT_EQ(made + refused, 100);
}

}  // namespace
}  // namespace robomosp

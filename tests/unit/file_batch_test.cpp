// SPDX-License-Identifier: Apache-2.0
// Files that are written together: all or none, and whatever ends the process leaves each of them
// the old or the new one.
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "io/native.h"
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
    const pid_t child = ::fork();
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
      if (file[0] == '.') {  // what it could not take away
        fs::remove(folder.path / file);
        continue;
      }
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
}

}  // namespace
}  // namespace robomosp

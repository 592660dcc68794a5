// SPDX-License-Identifier: Apache-2.0
// The door of confined sessions: what it lets through, and that no swapping of links leads out.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/file_root.h"
#include "kernel/folder_names.h"
#include "kernel/permit.h"
#include "kernel/schema.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void put(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

class Door : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "file-root-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    top_ = fs::canonical(name);
    root_ = top_ / "root";
    fs::create_directories(root_ / "sub");
    fs::create_directories(top_ / "outside");
    fs::create_directories(top_ / "library" / "robots");
    put(top_ / "outside" / "secret", "THE SECRET");
    put(top_ / "library" / "robots" / "a.rbt", "robot");
    put(root_ / "own", "mine");
    put(root_ / "sub" / "deep", "deep");
    fs::create_symlink(top_ / "outside" / "secret", root_ / "link_out");
    fs::create_symlink("../outside", root_ / "folder_out");
    fs::create_symlink(root_ / "sub" / "deep", root_ / "link_in");
    fs::create_symlink("sub/../own", root_ / "link_dots");
    fs::create_symlink("round", root_ / "round");
    fs::create_symlink("sub/new", root_ / "dangling");
    fs::create_symlink("/proc/self/environ", root_ / "environ");
    ASSERT_EQ(::mkfifo((root_ / "fifo").c_str(), 0600), 0);
    auto made = FileRoot::open(root_, {top_ / "library", top_ / "no such library"});
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    permit_ = {"guest",
               "a test",
               Effects::all(),
               {},
               false,
               false,
               std::make_shared<const FileRoot>(std::move(*made))};
    scope_ = std::make_unique<PermitScope>(&permit_);
  }
  void TearDown() override {
    scope_.reset();
    fs::remove_all(top_);
  }
  static std::string read(const fs::path& path) {
    const auto r = read_permitted(path, 1 << 20);
    return r.ok() ? *r : "error " + std::string(to_string(r.error().code));
  }
  static bool write(const fs::path& path, const std::string& text) {
    const auto fd = open_to_write(path, O_WRONLY | O_CREAT | O_TRUNC);
    return fd.ok() && ::write(fd->get(), text.data(), text.size()) >= 0;
  }

  fs::path top_, root_;
  Permit permit_;
  std::unique_ptr<PermitScope> scope_;
};

TEST_F(Door, NamesInTheFolderAreFoundWhateverWayTheyAreWritten) {
  for (const std::string& name :
       {std::string("own"), std::string("./own"), std::string("sub/../own"),
        (root_ / "own").string(), (root_ / "sub" / ".." / "own").string(),
        std::string("link_dots")})
    EXPECT_EQ(read(name), "mine") << name;
  EXPECT_EQ(read("link_in"), "deep");
  EXPECT_EQ(*permitted_path("link_in", Effect::files_read), root_ / "sub" / "deep");
  EXPECT_EQ(*permitted_name("link_in"), root_ / "link_in");
  EXPECT_EQ(*permitted_path("new/er", Effect::files_write), root_ / "new" / "er");
  EXPECT_EQ(*permitted_path(".", Effect::files_read), root_);
  EXPECT_EQ(file_kind("sub"), FileKind::folder);
  EXPECT_EQ(file_kind("sub/"), FileKind::folder);
  EXPECT_EQ(file_kind("own/"), FileKind::none);
  EXPECT_EQ(file_kind("fifo"), FileKind::other);
  EXPECT_EQ(file_kind("nothing"), FileKind::none);
}

TEST_F(Door, NothingOutsideIsReachedAndNothingIsSaidOfIt) {
  std::vector<std::string> names{"..",
                                 "../outside/secret",
                                 "../outside/nothing",
                                 "sub/../../outside/secret",
                                 "../root/own",  // it leads back, but by way of a folder outside
                                 "link_out",
                                 "folder_out",
                                 "folder_out/secret",
                                 "folder_out/nothing",
                                 "folder_out/../root/own",
                                 "environ",
                                 "/",
                                 "/proc/self/environ",
                                 "/dev/zero",
                                 "//own",
                                 (top_ / "outside" / "secret").string(),
                                 (top_ / "outside" / "nothing").string(),
                                 (root_ / ".." / "outside" / "secret").string(),
                                 root_.string() + "x"};
  for (const std::string& name : names) {
    const auto path = permitted_path(name, Effect::files_read);
    ASSERT_FALSE(path.ok()) << name;
    EXPECT_EQ(path.error().code, ErrorCode::permission) << name;
    // The same sentence, whether something is there or not.
    EXPECT_EQ(path.error().message,
              "\"" + name + "\" is not in the folder that the files of this session lie in");
    EXPECT_FALSE(open_to_read(name).ok()) << name;
    EXPECT_FALSE(open_to_write(name, O_WRONLY | O_CREAT).ok()) << name;
    EXPECT_FALSE(place_to_write(name).ok()) << name;
    EXPECT_FALSE(make_folders(name + "/more").ok()) << name;
    EXPECT_FALSE(list_folder(name, 10).ok()) << name;
    EXPECT_EQ(file_kind(name), FileKind::none) << name;
  }
  EXPECT_FALSE(remove_file("../outside/secret").ok());
  EXPECT_FALSE(rename_file("own", "../outside/own").ok());
  EXPECT_FALSE(rename_file("../outside/secret", "secret").ok());
  EXPECT_EQ(content(top_ / "outside" / "secret"), "THE SECRET");
  EXPECT_EQ(std::distance(fs::directory_iterator(top_ / "outside"), {}), 1);
  // A link is removed itself.
  EXPECT_TRUE(*remove_file("folder_out"));
  EXPECT_TRUE(fs::exists(top_ / "outside" / "secret"));
}

TEST_F(Door, OddNamesAndWhatIsNoFileEndInASentenceAtOnce) {
  EXPECT_EQ(permitted_path("", Effect::files_read).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(permitted_path(std::string("a\0b", 3), Effect::files_read).error().code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(permitted_path(std::string(5000, 'x'), Effect::files_read).error().code,
            ErrorCode::invalid_argument);
  EXPECT_FALSE(open_to_read(std::string(300, 'x')).ok());
  std::string deep;
  for (int i = 0; i < 2000; ++i) deep += "a/";
  EXPECT_FALSE(open_to_read(deep + "b").ok());
  EXPECT_EQ(open_to_read("round").error().code, ErrorCode::io);
  EXPECT_EQ(open_to_read("fifo").error().code, ErrorCode::io);
  EXPECT_EQ(open_to_write("fifo", O_WRONLY | O_CREAT).error().code, ErrorCode::io);
  EXPECT_EQ(open_to_read("sub").error().code, ErrorCode::io);
  EXPECT_EQ(open_to_read("own/more").error().code, ErrorCode::io);
  EXPECT_EQ(open_to_read("nothing").error().code, ErrorCode::not_found);
  EXPECT_FALSE(remove_file(".").ok());
  EXPECT_FALSE(*remove_file("nothing"));
  EXPECT_TRUE(write("\xff\xfe", "bytes"));
  EXPECT_EQ(read("\xff\xfe"), "bytes");
  EXPECT_TRUE(write("dangling", "by a link"));
  EXPECT_EQ(content(root_ / "sub" / "new"), "by a link");
}

TEST_F(Door, WhatComesWithTheProgramIsReadOnly) {
  const fs::path file = top_ / "library" / "robots" / "a.rbt";
  EXPECT_EQ(read(file), "robot");
  EXPECT_EQ(file_kind(file), FileKind::file);
  EXPECT_EQ(file_kind(top_ / "library"), FileKind::folder);
  EXPECT_EQ(list_folder(top_ / "library" / "robots", 10)->size(), 1U);
  EXPECT_EQ(open_to_write(file, O_WRONLY).error().code, ErrorCode::permission);
  EXPECT_EQ(place_to_write(file).error().code, ErrorCode::permission);
  EXPECT_EQ(remove_file(file).error().code, ErrorCode::permission);
  EXPECT_EQ(read(top_ / "library" / ".." / "outside" / "secret"), "error permission");
  EXPECT_EQ(content(file), "robot");
}

TEST_F(Door, FoldersAreMadeListedAndRemoved) {
  EXPECT_TRUE(make_folders("a/b/c").ok());
  EXPECT_TRUE(make_folders("a/b/c").ok());
  EXPECT_TRUE(write("a/b/c/file", "x"));
  EXPECT_FALSE(remove_file("a/b/c").ok()) << "it is not empty";
  EXPECT_TRUE(rename_file("a/b/c/file", "a/file").ok());
  EXPECT_TRUE(*remove_file("a/b/c"));
  const auto all = list_folder(".", 100);
  ASSERT_TRUE(all.ok());
  std::map<std::string, FileKind> kinds;
  for (const FolderEntry& e : *all) kinds[e.name] = e.kind;
  EXPECT_EQ(kinds.at("own"), FileKind::file);
  EXPECT_EQ(kinds.at("link_in"), FileKind::file);
  EXPECT_EQ(kinds.at("link_out"), FileKind::none);
  EXPECT_EQ(kinds.at("folder_out"), FileKind::none);
  EXPECT_EQ(kinds.at("a"), FileKind::folder);
  EXPECT_EQ(list_folder(".", 3).error().code, ErrorCode::unsupported);
}

TEST_F(Door, PathsOfASchemaAreThoseOfTheFolder) {
  Schema schema(1);
  schema[0].name = "file";
  schema[0].type = "path";
  EXPECT_EQ(*check(schema, {{"file", "new.txt"}})->find("file")->as_string(),
            (root_ / "new.txt").string());
  EXPECT_EQ(check(schema, {{"file", "../new.txt"}}).error().code, ErrorCode::permission);
  EXPECT_EQ(permit_.files->shown("cannot write \"" + (root_ / "a").string() + "\""),
            "cannot write \"a\"");
  const PermitScope none(nullptr);
  EXPECT_EQ(*check(schema, {{"file", "../new.txt"}})->find("file")->as_string(), "../new.txt");
}

TEST_F(Door, OwnWorkAndWorkElsewhereKeepToTheFolder) {
  const auto kept = keep_permit();
  {
    const OwnWorkScope own;
    EXPECT_EQ(read("../outside/secret"), "error permission");
    EXPECT_EQ(read("own"), "mine");
  }
  std::string elsewhere;
  std::thread([&] {
    const PermitScope scope(kept.get());
    elsewhere = read("../outside/secret");
  }).join();
  EXPECT_EQ(elsewhere, "error permission");
}

// One thread puts a folder and a link to a folder outside in turn under one name, another goes
// through it by every function of the door.
TEST_F(Door, ALinkThatIsSwappedInMeanwhileLeadsNowhere) {
  const fs::path name = root_ / "swapped", link = root_ / "link";
  fs::create_directories(name);
  put(name / "secret", "inside");
  fs::create_symlink(top_ / "outside", link);
  std::atomic<bool> is_over{false};
  std::thread swaps([&] {
    while (!is_over)  // both are there at every moment, under one name or the other
      (void)::renameat2(AT_FDCWD, name.c_str(), AT_FDCWD, link.c_str(), RENAME_EXCHANGE);
  });
  std::size_t found = 0, outside = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  while (std::chrono::steady_clock::now() < end) {
    const std::string text = read("swapped/secret");
    EXPECT_NE(text, "THE SECRET");
    found += text == "inside" || text == "mine";
    outside += text == "error permission";
    (void)write("swapped/secret", "mine");
    (void)write("swapped/new", "mine");
    if (const auto place = place_to_write("swapped/placed"); place.ok()) {
      const int fd =
          ::openat(place->folder, place->name.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0600);
      if (fd >= 0) ::close(fd);
    }
    (void)make_folders("swapped/made/more").ok();
    (void)rename_file("swapped/new", "swapped/newer").ok();
    (void)remove_file("swapped/newer").ok();
    if (const auto all = list_folder("swapped", 100); all.ok()) {
      for (const FolderEntry& e : *all) EXPECT_NE(e.size, 10U) << e.name;
    }
  }
  is_over = true;
  swaps.join();
  EXPECT_GT(found, 0U) << "the folder was never met";
  EXPECT_GT(outside, 0U) << "the link was never met";
  EXPECT_EQ(content(top_ / "outside" / "secret"), "THE SECRET");
  EXPECT_EQ(std::distance(fs::directory_iterator(top_ / "outside"), {}), 1);
}

TEST_F(Door, TheFirstNamesAreThoseThatAreFirstInTheAlphabet) {
  const fs::path many = root_ / "many";
  fs::create_directories(many / "m folder");
  std::vector<std::string> all{"m folder"};
  std::mt19937 random(test::seed());
  while (all.size() < 300) {
    std::string name = std::to_string(random());
    if (random() % 4 == 0) name = "é" + name;
    if (fs::exists(many / name)) continue;
    if (random() % 8 == 0) fs::create_symlink(root_ / "own", many / name);
    else put(many / name, "");
    all.push_back(name);
  }
  std::sort(all.begin(), all.end());
  const auto names = [&](std::size_t most, std::string_view begin = "") {
    const auto found = first_names(
        many, most, [begin](std::string_view name, FileKind) { return name.starts_with(begin); });
    std::vector<std::string> out;
    if (found.ok())
      for (const FolderEntry& e : *found) out.push_back(e.name);
    return out;
  };
  for (const std::size_t most : {0UL, 1UL, 7UL, 299UL, 300UL, 301UL, 100'000UL})
    EXPECT_EQ(names(most),
              std::vector<std::string>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(
                                                                      std::min(most, all.size()))))
        << most;
  std::vector<std::string> ones;
  for (const std::string& name : all)
    if (name.starts_with("1") && ones.size() < 5) ones.push_back(name);
  EXPECT_EQ(names(5, "1"), ones);
}

TEST(NoDoor, WithoutAFolderEverythingIsAsTheSystemHasIt) {
  EXPECT_EQ(current_file_root(), nullptr);
  EXPECT_EQ(*permitted_path("../x/./y", Effect::files_write), fs::path("../x/./y"));
  EXPECT_EQ(file_kind("/dev/null"), FileKind::other);
  EXPECT_EQ(file_kind("/"), FileKind::folder);
  EXPECT_FALSE(FileRoot::open("/no/such/folder").ok());
  EXPECT_FALSE(FileRoot::open("/dev/null").ok());
}

}  // namespace
}  // namespace robomosp

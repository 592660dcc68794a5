// SPDX-License-Identifier: Apache-2.0
// Records and the files they are kept in: what others change on the disk is noticed, saving is no
// step of the history, and undo forgets no file.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "io/native.h"
#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using ioci::Application;

class KeptFiles : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::string name = (fs::temp_directory_path() / "robomosp-kept-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  static std::string get(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void put(const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
  }
  /// As another program does: the same file with another number.
  static void change(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = get(file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << text;
    put(file, text.replace(at, from.size(), to));
  }
  Value brass(const char* file) {
    const Value id = call("material.create", {{"name", "brass"}, {"density", 8500}});
    call("material.save", {{"id", id}, {"file", path(file)}});
    return id;
  }
  double density(const Value& id) {
    return *at(call("material.describe", {{"id", id}}), "density").as_real();
  }
  std::string file_of(const Value& id) {
    return *at(call("material.describe", {{"id", id}}), "file").as_string();
  }
  /// Messages of a code since the last call of it.
  std::vector<Message> said(std::string_view code) {
    std::vector<Message> out;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code && m.time > since_) out.push_back(m);
    since_ = std::chrono::system_clock::now();
    return out;
  }

  fs::path folder_;
  std::chrono::system_clock::time_point since_ = std::chrono::system_clock::now();
};

TEST_F(KeptFiles, AFileThatChangedOnTheDiskIsSaidAndReadAgainWhenAsked) {
  const Value id = brass("brass.mtr");
  EXPECT_EQ(call("material.load", {{"file", path("brass.mtr")}}), id);
  EXPECT_TRUE(said("file_changed").empty());

  change(path("brass.mtr"), "8500", "8600");
  EXPECT_EQ(call("material.load", {{"file", path("brass.mtr")}}), id);
  EXPECT_EQ(density(id), 8500);
  const auto warned = said("file_changed");
  ASSERT_EQ(warned.size(), 1U);
  EXPECT_EQ(warned[0].severity, Severity::warning);
  EXPECT_NE(warned[0].text.find("was changed on the disk since material \"brass\""),
            std::string::npos)
      << warned[0].text;

  for (const char* command : {"material.load", "file.load"}) {
    EXPECT_EQ(call(command, {{"file", path("brass.mtr")}, {"reload", true}}), id);
    EXPECT_EQ(density(id), 8600);
    EXPECT_TRUE(said("file_changed").empty());
  }
  call("document.undo");
  EXPECT_EQ(density(id), 8500);
  call("document.redo");
  EXPECT_EQ(density(id), 8600);

  // What was edited here goes when it is asked for, though the file is as it was.
  call("material.set", {{"id", id}, {"density", 1}});
  call("material.load", {{"file", path("brass.mtr")}});
  EXPECT_EQ(density(id), 1);
  call("material.load", {{"file", path("brass.mtr")}, {"reload", true}});
  EXPECT_EQ(density(id), 8600);
}

TEST_F(KeptFiles, WhatAFileRefersToIsReadAgainWithItWhereItChanged) {
  const Value id = brass("brass.mtr");
  const Value pin = call(
      "solid.create",
      {{"name", "pin"}, {"material", "brass"}, {"root", Map{{"kind", "sphere"}, {"radius", 0.1}}}});
  call("solid.save", {{"id", pin}, {"file", path("pin.csg")}});
  change(path("brass.mtr"), "8500", "8600");
  EXPECT_EQ(call("solid.load", {{"file", path("pin.csg")}, {"reload", true}}), pin);
  EXPECT_EQ(density(id), 8600);
  change(path("pin.csg"), "0.1", "0.2");
  call("solid.load", {{"file", path("pin.csg")}, {"reload", true}});
  EXPECT_NE(call("solid.text", {{"id", pin}}).as_string()->find("0.2"), std::string::npos);
}

TEST_F(KeptFiles, AReloadThatFailsChangesNothing) {
  const Value id = brass("brass.mtr");
  put(path("brass.mtr"), "robomosp material 1\nname brass\ndensity -1\n");
  const Error bad = fails("material.load", {{"file", path("brass.mtr")}, {"reload", true}});
  EXPECT_FALSE(bad.where.empty()) << bad.sentence();
  put(path("brass.mtr"), "robomosp solid 1\nname brass\nroot a\nsphere a { radius 1 }\n");
  fails("material.load", {{"file", path("brass.mtr")}, {"reload", true}});
  fs::remove(path("brass.mtr"));
  EXPECT_EQ(fails("material.load", {{"file", path("brass.mtr")}, {"reload", true}}).code,
            ErrorCode::not_found);
  said("file_changed");
  EXPECT_EQ(call("material.load", {{"file", path("brass.mtr")}}), id);
  EXPECT_EQ(said("file_changed").size(), 1U);
  EXPECT_EQ(density(id), 8500);
}

TEST_F(KeptFiles, AnElementOfAWorldIsReplacedByWhatItsFileHoldsNow) {
  const auto ball = [&](double radius) {
    return Map{{"name", "ball"}, {"root", Map{{"kind", "sphere"}, {"radius", radius}}}};
  };
  const Value id = call("solid.create", ball(0.1));
  call("solid.save", {{"id", id}, {"file", path("ball.csg")}});
  const Value cell = call("world.create", {{"name", "cell"}});
  call("world.load_element", {{"id", cell}, {"file", path("ball.csg")}});
  change(path("ball.csg"), "0.1", "0.2");
  call("world.load_element", {{"id", cell}, {"file", path("ball.csg")}, {"clash", "replace"}});
  EXPECT_NE(call("solid.text", {{"id", id}}).as_string()->find("0.2"), std::string::npos);
  EXPECT_EQ(at(call("world.describe", {{"id", cell}}), "objects").as_list()->size(), 1U);
}

TEST_F(KeptFiles, SavingIsNoStepAndUndoForgetsNoFile) {
  const Value id = call("material.create", {{"name", "brass"}, {"density", 8500}});
  call("material.set", {{"id", id}, {"density", 8600}});
  const auto steps = app().document.undo_labels().size();
  call("material.save", {{"id", id}, {"file", path("brass.mtr")}});
  EXPECT_EQ(app().document.undo_labels().size(), steps);
  const std::string file = file_of(id);
  EXPECT_FALSE(file.empty());

  call("document.undo");  // the density, not the save
  EXPECT_EQ(density(id), 8500);
  EXPECT_EQ(file_of(id), file);
  call("document.undo");
  EXPECT_TRUE(app().document.now()->list().empty());
  call("document.redo");
  EXPECT_EQ(file_of(id), file);
  call("document.redo");
  EXPECT_EQ(density(id), 8600);
  EXPECT_EQ(file_of(id), file);
  call("material.save", {{"id", id}});
  EXPECT_TRUE(said("file_replaced").empty());
}

TEST_F(KeptFiles, TwoProgramsThatSaveIntoOneFolderHearOfEachOther) {
  auto made = Application::create({.plugin_path = {}, .library = {}, .plugins = false});
  ASSERT_TRUE(made.ok());
  Application& other = **made;
  ioci::Session theirs("other");
  const auto ask = [&](std::string_view name, const Map& args) {
    return other.dispatch(theirs, name, args);
  };
  const Value id = call("material.create", {{"name", "brass"}, {"density", 8500}});
  call("file.save_all", {{"folder", folder_.string()}});
  ASSERT_TRUE(ask("material.create", {{"name", "brass"}, {"density", 1}}).ok());
  // A file that it never read is replaced, and said to be.
  ASSERT_TRUE(ask("file.save_all", {{"folder", folder_.string()}}).ok());
  const auto last = other.messages.recent(20);
  EXPECT_TRUE(std::any_of(last.begin(), last.end(), [](const Message& m) {
    return m.code == "file_replaced" && m.severity == Severity::warning;
  }));
  const std::string theirs_text = get(path("brass.mtr"));

  call("material.set", {{"id", id}, {"density", 8600}});
  for (const auto& [command, args] : {std::pair<const char*, Map>{"material.save", {{"id", id}}},
                                      {"record.save", {{"id", id}, {"file", path("brass.mtr")}}},
                                      {"file.save_all", {{"folder", folder_.string()}}}}) {
    const Error refused = fails(command, args);
    EXPECT_EQ(refused.code, ErrorCode::conflict);
    EXPECT_NE(refused.message.find("changed by another program"), std::string::npos);
    EXPECT_EQ(get(path("brass.mtr")), theirs_text);
  }
  call("material.save", {{"id", id}, {"overwrite", true}});
  EXPECT_NE(get(path("brass.mtr")), theirs_text);
  EXPECT_EQ(said("file_replaced").size(), 1U);
  call("material.save", {{"id", id}});
  EXPECT_TRUE(said("file_replaced").empty());
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Programs of records are compiled, checked and posted by functions that need no command and no
// application: records, a registry and derived values are enough.
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "evaluation/derived.h"
#include "kernel/fault.h"
#include "kernel/plugin_loader.h"
#include "model/controller.h"
#include "model/program_kinds.h"
#include "program_check/check_program.h"
#include "program_post/compare_targets.h"
#include "program_post/post.h"
#include "program_post/read_back.h"

namespace robomosp {
namespace {

class ProgramPosting : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"irl.so", "post_krl.so", "post_rapid.so", "program_readers.so"}) {
      const auto plugin = std::filesystem::path(ROBOMOSP_PLUGIN_DIR) / name;
      if (!std::filesystem::exists(plugin)) GTEST_SKIP() << name << " is not built";
      ASSERT_TRUE(loader.load(plugin.string()).loaded) << name;
    }
  }
  template <class Content>
  AnyId add(Kind kind, const std::string& name, Content content) {
    auto tx = document.begin("add");
    model::Record r;
    r.name = name;
    r.body = model::OtherContent(kind, std::move(content));
    const auto id = tx->add(std::move(r));
    EXPECT_TRUE(id.ok());
    EXPECT_TRUE(tx->commit().ok());
    return *id;
  }
  AnyId program(const std::string& body, const std::string& name = "lift") {
    model::Program p;
    p.files.push_back(
        {"lift.irl", program_source::lines_of("PROGRAM lift;\nVAR\n"
                                              "  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), "
                                              "ORIZYX(0.0, 180.0, 0.0));\n"
                                              "BEGIN\n" +
                                              body + "ENDPROGRAM;\n")});
    return add(program_kind(), name, std::move(p));
  }
  program_source::Workshop workshop() {
    now = document.now();
    return {{registry, derived, *now},
            document,
            [this](std::shared_ptr<const RobotModel> m, const model::ProviderChoice& c) {
              return sim::bind_ik(registry, std::move(m), c);
            },
            progress};
  }

  Registry registry;
  PluginLoader loader{registry};
  document::Document document;
  evaluation::Derived derived{registry};
  document::SnapshotPtr now;
  NoProgress progress;
};

TEST_F(ProgramPosting, ARecordBecomesATextOfTheTargetWithoutACommand) {
  program_post::PostRequest request;
  request.program = program("  MOVE LIN place SPEED := 80.0;\n");
  request.target = "krl";
  const auto done = program_post::post(workshop(), request);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(done->target.name, "krl");
  EXPECT_EQ(done->posted.form, "structured");
  EXPECT_EQ(done->posted.errors(), 0U);
  ASSERT_FALSE(done->posted.files.empty());
  EXPECT_NE(done->posted.files.front().second.find("LIN XPLACE"), std::string::npos)
      << done->posted.files.front().second;
}

TEST_F(ProgramPosting, TheProfileDecidesTheTargetAndTheName) {
  model::Controller c;
  c.target = "rapid";
  c.program = "cell";
  program_post::PostRequest request;
  request.program = program("  MOVE LIN place SPEED := 80.0;\n");
  request.profile = add(controller_kind(), "irc5", c);
  const auto done = program_post::post(workshop(), request);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(done->target.name, "rapid");
  ASSERT_FALSE(done->posted.files.empty());
  EXPECT_EQ(done->posted.files.front().first, "cell.mod");
  request.target = "krl";
  const auto other = program_post::post(workshop(), request);
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().where, "target");
}

TEST_F(ProgramPosting, WhatCannotBePostedIsAFaultWithItsLine) {
  program_post::PostRequest request;
  request.program = program("  PAUSE;\n");
  request.target = "nothing";
  const auto unknown = program_post::post(workshop(), request);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("nothing"), std::string::npos);
  const AnyId broken = program("  MOVE LIN nowhere;\n", "broken");
  request.program = broken;
  request.target = "krl";
  const auto wrong = program_post::post(workshop(), request);
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::syntax);
  const auto faults = faults_of(wrong.error());
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults.front().code, "program.syntax");
  EXPECT_EQ(faults.front().subject.line, 5U);
  EXPECT_EQ(faults.front().subject.path, "files.1.lines.5");
}

TEST_F(ProgramPosting, PostedFilesAreReadBack) {
  program_post::PostRequest request;
  request.program = program("  MOVE LIN place SPEED := 80.0;\n");
  request.target = "krl";
  const auto with = workshop();
  const auto done = program_post::post(with, request);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  const auto read = program_post::read_posted(with, done->posted.files);
  ASSERT_TRUE(read.ok()) << read.error().sentence();
  EXPECT_EQ(read->reader, "krl") << read->not_read;
  EXPECT_NE(read->program, nullptr);
}

TEST_F(ProgramPosting, TargetsAreCompared) {
  program_post::PostRequest request;
  request.program = program("  MOVE LIN place SPEED := 80.0;\n");
  const auto with = workshop();
  const auto made = program_source::compile_whole(with, request.program, {});
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const std::vector<std::string> targets{"krl", "rapid"};
  const auto c = program_post::comparison::compare_targets(with, request, *made, targets);
  ASSERT_TRUE(c.ok()) << c.error().sentence();
  ASSERT_EQ(c->sides.size(), 2U);
  for (const auto& side : c->sides) {
    EXPECT_TRUE(side.is_correct) << side.target;
    EXPECT_EQ(side.not_read, "") << side.target;
  }
}

TEST_F(ProgramPosting, ACheckNeedsAWorldOrARobot) {
  program_check::CheckTask task;
  task.program = program("  WAIT 1.0 SEC;\n");
  const auto none = program_check::check_program(workshop(), task);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().message, "no world has this program");
  EXPECT_EQ(none.error().where, "program \"lift\"");
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// A command of its own, of this file alone: it is found, checked, documented and run, and nothing
// else knows of it. And none of the program's own files of commands is lost by the linker.
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

Result<Value> twice(CommandContext& ctx, const Map& args) {
  const double twice = 2 * content<model::Material>(ctx, args).density;
  if (flag(args, "keep"))
    RMP_TRY(change<model::Material>(ctx, ref(args, "id"), [&](model::Material& m) -> Result<void> {
      m.density = twice;
      return {};
    }));
  return Value(twice);
}

RMP_COMMANDS(own_commands) {
  std::vector<CommandSpec> all;
  all.push_back({.name = "material.twice",
                 .classic = "",
                 .summary = "Gives twice the density of a material.",
                 .details = "",
                 .example = "assert(material.create{name = \"m\", density = 1}:twice() == 2)",
                 .params = {self("material"),
                            defaulted("keep", "bool", "", false, "Whether it becomes that.")},
                 .returns = {"real", "kg/m^3", "Twice it.", {}},
                 .effect = Effect::edits,
                 .run = twice});
  return all;
}

class OwnCommand : public test::CommandTest {};

TEST_F(OwnCommand, IsFoundCheckedDocumentedRunAndUndone) {
  const Value brass = call("material.create", {{"name", "brass"}, {"density", 8500}});
  EXPECT_EQ(call("material.twice", {{"id", "brass"}}).number(), 17000);
  EXPECT_NE(fails("material.twice", {{"id", "brass"}, {"keap", true}}).sentence().find("\"keep\""),
            std::string::npos);
  EXPECT_EQ(call("material.twice", {{"id", brass}, {"keep", true}}).number(), 17000);
  EXPECT_EQ(call("material.twice", {{"id", brass}}).number(), 34000);
  call("document.undo");
  EXPECT_EQ(call("material.twice", {{"id", brass}}).number(), 17000);
  EXPECT_NE(call("help", {{"topic", "material.twice"}}).text().find("Gives twice the density"),
            std::string::npos);
  EXPECT_NE(reference_pages(app().commands).at("material.md").find("## material.twice"),
            std::string::npos);
  const auto methods = app().commands.methods_of("material");
  EXPECT_TRUE(std::any_of(methods.begin(), methods.end(),
                          [](const CommandSpec* s) { return s->name == "material.twice"; }));
}

/// They register themselves, so nothing names their objects: the build has to keep them.
TEST_F(OwnCommand, NoFileOfCommandsIsLost) {
  namespace fs = std::filesystem;
  std::multiset<std::string> linked;
  for (const auto& [file, make] : CommandFile::all()) {
    const fs::path path(file);
    linked.insert((path.parent_path().filename() / path.filename()).string());
    EXPECT_FALSE(make().empty()) << file;
  }
  std::size_t count = 0;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "modules/ioci")) {
    if (entry.path().extension() != ".cpp") continue;
    std::stringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    if (text.str().find("\nRMP_COMMANDS(") == std::string::npos) continue;
    ++count;
    EXPECT_EQ(
        linked.count((entry.path().parent_path().filename() / entry.path().filename()).string()),
        1U)
        << entry.path();
  }
  EXPECT_EQ(linked.size(), count + 1) << "and this file";
  EXPECT_GT(count, 40U);
}

}  // namespace
}  // namespace robomosp::ioci

// SPDX-License-Identifier: Apache-2.0
// Faults of commands: what they are about can be opened, what they offer mends them, and front ends
// get them whole.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include <gtest/gtest.h>

#include "kernel/argument_faults.h"
#include "kernel/fault.h"
#include "kernel/text.h"
#include "lua/lua_state.h"
#include "lua/sandbox/wire.h"
#include "model/field_path.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

class Faults : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    call("robot.create",
         {{"name", "arm"}, {"links", List{Value(Map{{"a", 0.3}}), Value(Map{{"a", 0.2}})}}});
    call("world.create", {{"name", "cell"}});
    call("solid.create", {{"name", "pin"},
                          {"root", Map{{"kind", "cylinder"}, {"radius", 0.01}, {"height", 0.05}}}});
  }
  std::vector<Fault> faults(std::string_view command, const Map& args) {
    return faults_of(fails(command, args));
  }
  /// What a fault names is there.
  void expect_open(const Fault& f) {
    SCOPED_TRACE(sentence(f));
    EXPECT_NE(find_fault_code(f.code), nullptr) << f.code;
    const FaultSubject& s = f.subject;
    if (s.record.number) {
      const auto id = Application::record_id(*app().document.now(), s.record);
      ASSERT_TRUE(id.ok());
      if (!s.path.empty()) {
        EXPECT_TRUE(model::find(model::content(app().document.now()->find(*id)->body), s.path))
            << s.path;
      }
    }
    if (!s.command.empty()) {
      EXPECT_NE(app().commands.find(s.command), nullptr);
    }
  }
};

TEST_F(Faults, EachArgumentIsNamedWithCommandAndRecord) {
  const Map args{{"id", "cell"},
                 {"robot", "arm"},
                 {"trajectory", "t"},
                 {"strt", "path"},
                 {"sample_time", "2 kg"}};
  const auto all = faults("world.check", args);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].code, "argument.unknown");
  EXPECT_EQ(all[0].subject.argument, "strt");
  EXPECT_EQ(all[1].subject.argument, "sample_time");
  for (const Fault& f : all) {
    EXPECT_EQ(f.subject.command, "world.check");
    EXPECT_EQ(f.subject.name, "cell");
    EXPECT_TRUE(f.where.starts_with("world.check")) << f.where;
    expect_open(f);
  }
}

TEST_F(Faults, RemediesOfACallMendIt) {
  const std::pair<const char*, Map> calls[] = {
      {"robot.set_link", {{"id", "arm"}, {"link", 1}, {"lowr", -1}}},
      {"robot.fk", {{"id", "arn"}, {"q", List{0, 0}}}},
      {"solid.create", {{"name", "cube"}, {"chord", -1}}},
      {"message.list", {{"at_most", 0}, {"severity", "warnin"}}},
      {"fault.list", {{"record", "pim"}}}};
  std::size_t tried = 0;
  for (const auto& [command, args] : calls)
    for (const Fault& f : faults(command, args))
      for (const FaultRemedy& r : f.remedies) {
        SCOPED_TRACE(command + (": " + r.label));
        if (!r.is_tried) continue;
        ++tried;
        EXPECT_EQ(r.command, command);
        const auto again =
            app().dispatch(session_, r.command, r.repeats ? repeated(r, args) : r.args);
        if (again.ok()) continue;
        for (const Fault& left : faults_of(again.error()))
          EXPECT_FALSE(left.code == f.code && left.subject.argument == f.subject.argument)
              << sentence(left);
      }
  EXPECT_GE(tried, 5U);
}

TEST_F(Faults, NamesAtAnyDepthHaveTheirPlaceAndARemedyThatMendsThem) {
  call("robot.create", {{"name", "limb"},
                        {"links", List{Value(Map{{"name", "upper"}, {"a", 0.3}}),
                                       Value(Map{{"name", "fore"}, {"a", 0.2}}),
                                       Value(Map{{"name", "hand"}, {"a", 0.1}})}}});
  call("task.create", {{"name", "shift"}});
  const Value limb = call("robot.get", {{"name", "limb"}});
  const auto calls_task = [](const char* name) {
    return List{Value(Map{{"step", "call"}, {"task", name}})};
  };
  const auto with_part = [](const char* name) {
    return List{Value(Map{{"parts", List{Value(Map{{"what", name}})}}})};
  };
  const struct {
    const char* command;
    Map args;
    const char *argument, *where;
  } cases[] = {{"task.create",
                {{"name", "day"}, {"steps", calls_task("shiff")}},
                "steps[1].task",
                "task.create, steps[1], task"},
               {"robot.create",
                {{"name", "two"}, {"links", with_part("pim")}},
                "links[1].parts[1].what",
                "robot.create, links[1].parts[1], what"},
               {"robot.set_link",
                {{"id", "limb"}, {"link", "uper"}, {"a", 1}},
                "link",
                "robot.set_link, link"},
               {"robot.add_link",
                {{"id", "limb"}, {"mimic", Map{{"link", "foree"}}}},
                "mimic.link",
                "robot \"limb\", link 4.mimic.link"},
               {"record.set",
                {{"id", limb}, {"path", "links.3.parent"}, {"value", "uppr"}},
                "value",
                "robot \"limb\", links.3.parent"}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.command);
    const auto all = faults(c.command, c.args);
    ASSERT_EQ(all.size(), 1U);
    EXPECT_EQ(all[0].subject.argument, c.argument);
    EXPECT_EQ(all[0].where, c.where);
    ASSERT_EQ(all[0].remedies.size(), 1U) << sentence(all[0]);
    const FaultRemedy& r = all[0].remedies[0];
    EXPECT_TRUE(r.is_tried) << r.untried;
    const auto again = app().dispatch(session_, r.command, repeated(r, c.args));
    EXPECT_TRUE(again.ok()) << again.error().sentence();
  }
  // A name that is near nothing gets no remedy.
  for (const Fault& f : faults("task.create", {{"name", "n"}, {"steps", calls_task("xyzzy")}}))
    EXPECT_TRUE(f.remedies.empty()) << f.remedies[0].label;
}

TEST_F(Faults, AFieldOfAnotherKindOfStepIsNamedWithThatKind) {
  const List steps{Value(Map{{"step", "move"}, {"time", 9}})};
  const auto all = faults("task.create", {{"name", "day"}, {"steps", steps}});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].message, "\"time\" is not a parameter of step = \"move\"");
  EXPECT_TRUE(all[0].hint.starts_with("\"time\" is one of step = \"wait\". ")) << all[0].hint;
}

TEST_F(Faults, PathsIntoRecordsHaveOneForm) {
  call("record.set", {{"id", "arm"}, {"path", "links[2].upper"}, {"value", -1}});
  const auto all = faults("record.set", {{"id", "arm"}, {"path", "links[2].lower"}, {"value", 0}});
  ASSERT_EQ(all.size(), 1U);
  const Value map = fault_map(all[0]);
  const Value* path = map.as_map()->find("subject")->as_map()->find("path");
  ASSERT_NE(path, nullptr);
  EXPECT_TRUE(path->text().starts_with("links.2")) << path->text();
  EXPECT_EQ(path->text().find('['), std::string::npos) << path->text();
}

TEST_F(Faults, ARecordThatWouldBeWrongIsNamedWithItsPath) {
  call("record.set", {{"id", "arm"}, {"path", "links[2].upper"}, {"value", -1}});
  const auto all = faults("record.set", {{"id", "arm"}, {"path", "links[2].lower"}, {"value", 0}});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_TRUE(all[0].code.starts_with("record.")) << all[0].code;
  EXPECT_EQ(all[0].subject.record.kind, "robot");
  EXPECT_TRUE(all[0].subject.path.starts_with("links[2]")) << all[0].subject.path;
  expect_open(all[0]);
}

TEST_F(Faults, ARecordThatWasNotMadeIsNotNamed) {
  const auto all =
      faults("robot.create", {{"name", "b"}, {"links", List{Value(Map{{"a", 1e300}})}}});
  ASSERT_GE(all.size(), 1U);
  EXPECT_EQ(all[0].subject.record.number, 0U);
  EXPECT_EQ(all[0].subject.command, "robot.create");
}

TEST_F(Faults, TheListNamesLinesOfProgramsAndNodesOfSolids) {
  call("program.create",
       {{"name", "weld"}, {"source", "PROGRAM weld;\nBEGIN\n  x := 1;\nENDPROGRAM;\n"}});
  call("solid.create",
       {{"name", "empty"},
        {"root",
         Map{{"kind", "intersection"},
             {"name", "cut"},
             {"children", List{Value(Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}),
                               Value(Map{{"kind", "box"},
                                         {"x", 0.1},
                                         {"y", 0.1},
                                         {"z", 0.1},
                                         {"position", NumericArray({1, 0, 0})}})}}}}});
  const Value found = call("fault.list");
  std::set<std::string> codes;
  for (const Value& row : *at(found, "faults").as_list()) {
    const auto f = fault_from(row);
    ASSERT_TRUE(f);
    codes.insert(f->code);
    expect_open(*f);
    if (f->code == "program.syntax") {
      EXPECT_EQ(f->subject.line, 3U);
      EXPECT_GT(f->subject.end_column, f->subject.column);
    }
  }
  EXPECT_TRUE(codes.contains("program.syntax"));
  EXPECT_TRUE(codes.contains("solid.failed"));
  EXPECT_TRUE(*at(found, "is_whole").as_bool());
  const Value one = call("fault.list", {{"record", "weld"}, {"at_most", 1}});
  EXPECT_EQ(at(one, "faults").as_list()->size(), 1U);
}

TEST_F(Faults, LuaGetsThemAndGivesThemBack) {
  lua::LuaState state(app(), session_, lua::LuaOptions{});
  const auto seen = state.eval(
      "local ok, e = pcall(world.check, {id = \"cell\", robot = \"arm\", trajectory = \"t\", "
      "strt = \"path\", sample_time = \"2 kg\"})\n"
      "assert(not ok and #e.faults == 2)\n"
      "assert(e.faults[1].subject.argument == \"strt\")\n"
      "assert(e.faults[2].subject.argument == \"sample_time\")\n"
      "assert(e.faults[1].remedies[1].args.start == \"path\")\nerror(e)");
  ASSERT_FALSE(seen.ok());
  const auto back = faults_of(seen.error());
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].subject.argument, "strt");
  EXPECT_EQ(back[0].remedies.size(), 1U);
  EXPECT_EQ(back[1].code, "argument.wrong_unit");
}

TEST_F(Faults, TheSandboxGetsThem) {
  const Error e = fails("robot.set_link", {{"id", "arm"}, {"link", 1}, {"lowr", -1}});
  const Error back = lua::wire::error_from(lua::wire::error_value(e));
  ASSERT_TRUE(kept_faults(back));
  EXPECT_TRUE(faults_of(back) == faults_of(e));
}

TEST_F(Faults, ErrorsOfAProgramComeOneByOneThroughLuaAndTheSandbox) {
  call("program.create", {{"name", "weld"},
                          {"source",
                           "PROGRAM weld;\nVAR\n  INT: count;\nBEGIN\n  coumt := 1;\n  "
                           "other := 2;\nENDPROGRAM;\n"}});
  const Error e = fails("program.run_alone", {{"id", "weld"}});
  const auto all = faults_of(e);
  ASSERT_EQ(all.size(), 2U) << e.sentence();
  EXPECT_EQ(all[0].message, e.message);
  EXPECT_TRUE(e.where.ends_with("program \"weld\", weld.irl:5:3")) << e.where;
  EXPECT_TRUE(all[1].where.ends_with("program \"weld\", weld.irl:6:3")) << all[1].where;
  EXPECT_EQ(all[1].where.find("weld.irl:5"), std::string::npos) << all[1].where;
  for (const Fault& f : all) {
    EXPECT_EQ(f.code, "program.syntax");
    EXPECT_EQ(f.subject.command, "program.run_alone");
    expect_open(f);
  }
  EXPECT_TRUE(all[1].subject.path.ends_with("lines.6")) << all[1].subject.path;
  EXPECT_TRUE(faults_of(lua::wire::error_from(lua::wire::error_value(e))) == all);
  lua::LuaState state(app(), session_, lua::LuaOptions{});
  const auto seen = state.eval(
      "local ok, e = pcall(program.run_alone, {id = \"weld\"})\n"
      "assert(not ok and #e.faults == 2 and e.faults[2].subject.line == 6)\n"
      "local r = e.faults[1].remedies[1]\n"
      "assert(r.command == \"program.set_file\")\n"
      "program.set_file(r.args)\n"
      "local found = fault.list{record = \"weld\"}.faults\n"
      "assert(#found == 1 and found[1].subject.line == 6)");
  EXPECT_TRUE(seen.ok()) << seen.error().sentence();
}

TEST_F(Faults, TrialsAreSeenByNobody) {
  call("program.create", {{"name", "weld"},
                          {"source",
                           "PROGRAM weld;\nVAR\n  INT: count;\nBEGIN\n  coumt := "
                           "1;\nENDPROGRAM;\n"}});
  const auto before = app().document.now();
  std::size_t audits = 0;
  const auto token =
      app().messages.subscribe([&](const Message& m) { audits += m.code == "audit"; });
  const Value found = call("fault.list", {{"record", "weld"}});
  app().messages.unsubscribe(token);
  const auto f = fault_from(at(found, "faults").as_list()->front());
  ASSERT_TRUE(f && !f->remedies.empty());
  EXPECT_TRUE(f->remedies[0].is_tried);
  EXPECT_EQ(app().document.now(), before);
  EXPECT_EQ(audits, 0U);
  EXPECT_TRUE(call("draft.list").as_list()->empty());
  // Where nothing may be tried, it is offered as a guess.
  const Value untried = call("fault.list", {{"record", "weld"}, {"try_remedies", false}});
  const auto guess = fault_from(at(untried, "faults").as_list()->front());
  ASSERT_TRUE(guess && !guess->remedies.empty());
  EXPECT_FALSE(guess->remedies[0].is_tried);
  EXPECT_EQ(guess->remedies[0].untried, "Trials were not wanted.");
}

/// The joint of a link cannot move, which "Make the joint fixed" mends.
constexpr const char* kStuck =
    "robot.create{name = 'stuck', links = {{a = 0.3, lower = 0.5, upper = 0.5}, {a = 0.2}}}\n";

TEST_F(Faults, RemediesAreTriedOnTheRecordsOfAnOpenGroup) {
  lua::LuaState state(app(), session_, lua::LuaOptions{});
  const std::string digest = app().document.content_digest();
  const auto seen =
      state.eval("pcall(ioci.transaction, function()\n" + std::string(kStuck) +
                 "  local r = fault.list{record = 'stuck'}.faults[1].remedies[1]\n"
                 "  tried = {r.is_tried, r.untried, robot.get('stuck'):links()[1].joint}\n"
                 "  local ok, e = pcall(robot.fk, {id = 'stuck', q = {0, 0}, tip = 'nowhere'})\n"
                 "  offered = e.faults[1].remedies[1].is_tried\n"
                 "  error('back')\nend)\n"
                 "assert(tried[1] == true and tried[2] == nil and tried[3] == 'revolute')\n"
                 "assert(offered == true)");
  EXPECT_TRUE(seen.ok()) << seen.error().sentence();
  EXPECT_EQ(app().document.content_digest(), digest);
}

TEST_F(Faults, RemediesAreTriedOnADraftAndInAJob) {
  lua::LuaState state(app(), session_, lua::LuaOptions{});
  ASSERT_TRUE(state.eval(kStuck).ok());
  const auto first_remedy = [](const Value& listed) {
    const auto f = fault_from(at(listed, "faults").as_list()->front());
    EXPECT_TRUE(f && !f->remedies.empty());
    return f && !f->remedies.empty() ? f->remedies.front() : FaultRemedy{};
  };
  const Value draft = call("draft.open", {{"label", "d"}});
  const FaultRemedy on_draft = first_remedy(
      call("draft.run",
           {{"draft", draft}, {"command", "fault.list"}, {"arguments", Map{{"record", "stuck"}}}}));
  EXPECT_TRUE(on_draft.is_tried) << on_draft.untried;
  const auto before = app().document.now();
  const auto job = app().dispatch_async(session_, "fault.list", {{"record", "stuck"}});
  ASSERT_TRUE(job.ok()) << job.error().sentence();
  const FaultRemedy in_job = first_remedy(*app().jobs.wait(job->number));
  EXPECT_TRUE(in_job.is_tried) << in_job.untried;
  EXPECT_EQ(app().document.now(), before);
}

TEST_F(Faults, ADisabledProviderSaysHowToEnableIt) {
  lua::LuaState state(app(), session_, lua::LuaOptions{});
  ASSERT_TRUE(
      state
          .eval("robot.create{name = 'own', ik = 'numeric', links = {{a = 0.3}, {a = 0.2}}}\n"
                "provider.disable('ik', 'numeric')")
          .ok());
  const Error e = fails("robot.solve_ik", {{"id", "own"}, {"target", List{0.3, 0.2, 0, 0, 0, 0}}});
  EXPECT_NE(e.sentence().find("is disabled. provider.enable(\"ik\", \"numeric\")"),
            std::string::npos)
      << e.sentence();
  const Value listed = call("fault.list", {{"record", "own"}});
  const auto f = fault_from(at(listed, "faults").as_list()->front());
  ASSERT_TRUE(f);
  EXPECT_EQ(f->code, "provider.missing");
  ASSERT_GE(f->remedies.size(), 2U);
  EXPECT_EQ(f->remedies[0].command, "provider.enable");
  EXPECT_FALSE(f->remedies[0].is_tried);
  EXPECT_FALSE(f->remedies[0].untried.empty());
  EXPECT_TRUE(f->remedies.back().is_tried) << f->remedies.back().untried;
  // The facts about it are still there.
  EXPECT_FALSE(
      call("provider.params", {{"interface", "ik"}, {"name", "numeric"}}).as_list()->empty());
  call(f->remedies[0].command, f->remedies[0].args);
  EXPECT_TRUE(at(call("fault.list", {{"record", "own"}}), "faults").as_list()->empty());
}

TEST_F(Faults, EveryCodeIsListed) {
  const Value listed = call("fault.codes");
  EXPECT_EQ(listed.as_list()->size(), fault_codes().size());
}

TEST_F(Faults, ThePageListsEveryCode) {
  std::string page =
      "# Fault codes\n\nThe codes of [faults](faults.md). They are stable: programs may compare "
      "them.\nThe class is the usual one of the error.\n\n| code | class | meaning "
      "|\n|---|---|---|\n";
  for (const FaultCode& c : fault_codes())
    page += "| `" + std::string(c.code) + "` | `" + std::string(to_string(c.error)) + "` | " +
            c.doc + " |\n";
  const std::string file = ROBOMOSP_SOURCE_DIR "/docs/user/fault_codes.md";
  if (std::getenv("ROBOMOSP_UPDATE_DOCS")) std::ofstream(file) << page;
  std::ifstream in(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), page)
      << "ROBOMOSP_UPDATE_DOCS=1 build/release/tests/faults_test writes it";
}

}  // namespace
}  // namespace robomosp::ioci

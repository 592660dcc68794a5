// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "ioci/core/handle_text.h"
#include "ioci/core/renamed_arguments.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

class Ioci : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-ioci-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Value classic(std::string_view line) {
    auto r = app().dispatch_classic(session_, line);
    EXPECT_TRUE(r.ok()) << line << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? std::move(*r) : Value();
  }
  Error classic_fails(std::string_view line) {
    auto r = app().dispatch_classic(session_, line);
    EXPECT_FALSE(r.ok()) << line << " should have failed";
    return r.ok() ? Error{} : r.error();
  }
  /// The latest message with a code.
  static Message last(std::string_view code) {
    Message found;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code) found = m;
    EXPECT_FALSE(found.code.empty()) << "no message " << code;
    return found;
  }
  std::size_t steps() { return app().document.undo_labels().size(); }
  Value brass() { return call("material.create", {{"name", "brass"}, {"density", 8500}}); }
  Value plate() {
    return call(
        "solid.create",
        {{"name", "plate"},
         {"root",
          Map{{"kind", "difference"},
              {"children",
               List{Map{{"kind", "box"}, {"name", "body"}, {"x", 0.2}, {"y", 0.1}, {"z", 0.01}},
                    Map{{"kind", "cylinder"},
                        {"name", "bore"},
                        {"radius", 0.01},
                        {"height", 0.03},
                        {"position", List{0, 0, -0.01}}}}}}}});
  }

  fs::path folder_;
};

// --- old words -----------------------------------------------------------------------------

TEST_F(Ioci, OldWordsOfArgumentsAreReadAndAMessageSaysWhichOnesToUse) {
  call("robot.create",
       {{"name", "arm"},
        {"links", List{Map{{"name", "upper"}, {"a", 0.5}}, Map{{"name", "fore"}, {"a", 0.4}}}}});
  call("world.create", {{"name", "cell"}});
  call("world.add_robot", {{"id", "cell"}, {"robot", "arm"}});
  call("robot.set_joint", {{"id", "arm"}, {"link", "fore"}, {"value", 0.3}});
  EXPECT_EQ(last("old_word").text, "robot.set_joint calls the argument \"link\" \"joint\" now.");
  const auto old_word_messages = [&] {
    const auto all = app().messages.recent(1000);
    return std::count_if(all.begin(), all.end(),
                         [](const Message& m) { return m.code == "old_word"; });
  };
  const auto before = old_word_messages();
  const Value after = call("robot.add_joint", {{"id", "arm"}, {"joint", 2}, {"value", 0.1}});
  EXPECT_DOUBLE_EQ(after.as_array()->data().at(1), 0.4);
  EXPECT_EQ(old_word_messages(), before) << "the words of now need no message";
  const Value old = call("robot.analytical_jacobian",
                         {{"id", "arm"}, {"q", List{0.1, 0.2}}, {"notation", "quaternion"}});
  EXPECT_EQ(old.as_map()->find("jacobian")->as_array()->rows(), 7U);
  EXPECT_NE(fails("robot.set_joint", {{"id", "arm"}, {"link", 1}, {"joint", 2}, {"value", 0}})
                .sentence()
                .find("link"),
            std::string::npos)
      << "both words at once are one too many";
}

TEST_F(Ioci, EveryOldWordHasAnArgumentOfTheNewOneAndNoneOfItsOwn) {
  ASSERT_FALSE(old_words().empty());
  for (const OldWord& word : old_words()) {
    const CommandSpec* spec = app().commands.find(word.command);
    ASSERT_NE(spec, nullptr) << word.command;
    const auto has = [&](std::string_view name) {
      return std::any_of(spec->params.begin(), spec->params.end(),
                         [&](const ParamSpec& p) { return p.name == name; });
    };
    EXPECT_TRUE(has(word.is)) << word.command << " " << word.is;
    EXPECT_FALSE(has(word.was)) << word.command << " " << word.was;
  }
}

// --- errors --------------------------------------------------------------------------------

TEST_F(Ioci, AnUnknownCommandSuggestsTheNearName) {
  const Error e = fails("robot.dhtable");
  EXPECT_EQ(e.code, ErrorCode::unknown_name);
  EXPECT_EQ(e.sentence(),
            "there is no command \"robot.dhtable\". Did you mean \"robot.dh_table\"?");
}

TEST_F(Ioci, AnUnknownVerbOfAKnownTopicListsItsCommands) {
  EXPECT_NE(fails("cache.defragment").hint.find("clear"), std::string::npos);
}

TEST_F(Ioci, AllFaultsOfTheArgumentsAreToldAtOnce) {
  const Error e = fails("material.create", {{"density", "heavy"}, {"colur", 1}});
  EXPECT_EQ(e.code, ErrorCode::invalid_argument) << e.sentence();
  for (const char* word : {"name", "density", "colur", "colour"})
    EXPECT_NE(e.sentence().find(word), std::string::npos) << e.sentence();
}

TEST_F(Ioci, AUnitOfAnotherDimensionIsRefused) {
  const Error e = fails("material.create", {{"name", "brass"}, {"density", "90 deg"}});
  EXPECT_NE(e.sentence().find("deg"), std::string::npos) << e.sentence();
  EXPECT_NE(e.sentence().find("kg/m^3"), std::string::npos) << e.sentence();
}

TEST_F(Ioci, AMissingFileIsNamed) {
  const Error e = fails("robot.load", {{"file", (folder_ / "none.rbt").string()}});
  EXPECT_EQ(e.code, ErrorCode::not_found) << e.sentence();
  EXPECT_NE(e.sentence().find("none.rbt"), std::string::npos);
}

TEST_F(Ioci, AFileOfAnotherKindNamesTheRightCommand) {
  EXPECT_EQ(fails("robot.load", {{"file", "a.csg"}}).hint, "solid.load reads it.");
}

TEST_F(Ioci, AHandleToARemovedRecordIsStaleAndNeverAnotherRecord) {
  const Value old = brass();
  call("material.remove", {{"id", old}});
  brass();
  EXPECT_EQ(fails("material.describe", {{"id", old}}).code, ErrorCode::stale_handle);
}

TEST_F(Ioci, AHandleOfAnotherKindIsRefusedByName) {
  const Error e = fails("robot.dh_table", {{"id", brass()}});
  EXPECT_NE(e.sentence().find("material:brass"), std::string::npos) << e.sentence();
}

TEST_F(Ioci, AKindOfHandlesOfItsOwnIsFoundNamedAndGoesStale) {
  // The application is that of all tests: the kind stays, and what it says is static.
  static bool is_there = true;
  HandleKinds& kinds = app().handle_kinds;
  ASSERT_TRUE(kinds
                  .add("probe",
                       [](std::uint64_t number) {
                         return is_there && number == 3 ? std::optional<std::string>("at the gate")
                                                        : std::nullopt;
                       })
                  .ok());
  for (const char* taken : {"probe", "recording", "robot"})
    EXPECT_NE(kinds.add(taken, {}).error().sentence().find(taken), std::string::npos);
  EXPECT_EQ(handle_from_text(kinds, "probe:at the gate#3"), (Handle{"probe", 3}));
  EXPECT_EQ(handle_from_text(kinds, "teapot#3"), std::nullopt);

  const auto resolved = [&](const Value& v) {
    return app().resolve(*app().document.now(), "probe|robot", v);
  };
  for (const Value& v : {Value(Handle{"probe", 3}), Value("probe#3"), Value("3")}) {
    const auto h = resolved(v);
    ASSERT_TRUE(h.ok()) << h.error().sentence();
    EXPECT_EQ(app().name_of(*h), "at the gate");
  }
  EXPECT_EQ(resolved(Value("probe#4")).error().code, ErrorCode::stale_handle);
  is_there = false;
  EXPECT_EQ(resolved(Value("probe#3")).error().code, ErrorCode::stale_handle);
}

TEST_F(Ioci, ACycleOfObjectsIsRefusedWithItsPath) {
  plate();
  call("object.create", {{"name", "hand"}, {"parts", List{Map{{"what", "plate"}}}}});
  call("object.create", {{"name", "arm"}, {"parts", List{Map{{"what", "hand"}}}}});
  const Error e = fails("object.add_part", {{"id", "hand"}, {"what", "arm"}});
  EXPECT_EQ(e.code, ErrorCode::conflict);
  EXPECT_NE(e.sentence().find("hand"), std::string::npos) << e.sentence();
  EXPECT_NE(e.sentence().find("arm"), std::string::npos) << e.sentence();
}

TEST_F(Ioci, WhatOthersReferToCannotBeRemoved) {
  brass();
  plate();
  call("solid.set", {{"id", "plate"}, {"path", "material"}, {"value", "brass"}});
  const Error e = fails("material.remove", {{"id", "brass"}});
  EXPECT_EQ(e.code, ErrorCode::conflict);
  EXPECT_NE(e.sentence().find("plate"), std::string::npos) << e.sentence();
}

TEST_F(Ioci, AnUnreachableTargetTellsHowFarItIs) {
  call("robot.get", {{"name", "pa10"}});
  const Map far{{"id", "pa10"}, {"target", List{5.0, 0, 0.3, 0, 0, 0}}};
  const Error e = fails("robot.solve_ik", far);
  EXPECT_EQ(e.code, ErrorCode::unreachable) << e.sentence();
  EXPECT_NE(e.sentence().find("out of reach by"), std::string::npos) << e.sentence();
  Map partial = far;
  partial.set("partial", true);
  const Value answer = call("robot.solve_ik", partial);
  EXPECT_NE(*at(answer, "status").as_string(), "solved");
  EXPECT_GT(at(answer, "position_error").number(), 3.0);
}

TEST_F(Ioci, ANameThatOnlyTheLibraryKnowsIsNotLoadedSilently) {
  const Error e = fails("robot.dh_table", {{"id", "pa10"}});
  EXPECT_EQ(e.code, ErrorCode::unknown_name);
  EXPECT_NE(e.hint.find("robot.get(\"pa10\")"), std::string::npos) << e.sentence();
  EXPECT_EQ(app().document.now()->size(), 0U);
}

TEST_F(Ioci, ARecordOfTheLibraryIsNotSavedOverTheLibrarysFileUnasked) {
  const Value puma = call("robot.get", {{"name", "puma560"}});
  const fs::path file = app().document.now()->find({Kind::robot, puma.as_handle()->number})->file;
  const auto text_of_file = [](const fs::path& name) {
    std::ifstream in(name);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string before = text_of_file(file);
  ASSERT_FALSE(before.empty()) << file;
  call("robot.set", {{"id", puma}, {"description", "mine"}});
  const Error refused = fails("robot.save", {{"id", puma}});
  EXPECT_EQ(refused.code, ErrorCode::permission);
  EXPECT_NE(refused.sentence().find("library"), std::string::npos) << refused.sentence();
  EXPECT_EQ(text_of_file(file), before);
  const fs::path own = folder_ / "puma560.rbt";
  call("robot.save", {{"id", puma}, {"file", own.string()}});
  EXPECT_NE(text_of_file(own).find("mine"), std::string::npos);
  call("robot.save", {{"id", puma}});  // its file is its own now
  EXPECT_EQ(text_of_file(file), before);
}

TEST_F(Ioci, AMisspeltLibraryNameSuggestsTheRightOne) {
  EXPECT_NE(fails("robot.get", {{"name", "puma506"}}).hint.find("puma560"), std::string::npos);
}

TEST_F(Ioci, AWrongNodePathNamesWhatTheSolidHas) {
  plate();
  const Error e = fails("solid.set", {{"id", "plate"}, {"path", "bor.radius"}, {"value", 0.01}});
  EXPECT_EQ(e.hint, "Did you mean \"bore\"?");
  EXPECT_NE(fails("solid.set", {{"id", "plate"}, {"path", "bore.raduis"}, {"value", 0.01}})
                .hint.find("radius"),
            std::string::npos);
  EXPECT_EQ(fails("solid.set", {{"id", "plate"}, {"path", "bore.radius"}, {"value", -0.01}}).code,
            ErrorCode::invalid_argument);
}

TEST_F(Ioci, AGapBetweenSegmentsIsRefusedWhereNoTransitionMayBridgeIt) {
  const auto line = [](double from, double to) {
    return Map{{"shape", "line"},
               {"transition", "none"},
               {"points", List{List{from, 0, 0, 0, 0, 0}, List{to, 0, 0, 0, 0, 0}}}};
  };
  fails("trajectory.create", {{"name", "t"}, {"segments", List{line(0, 0.1), line(0.2, 0.3)}}});
  call("trajectory.create", {{"name", "t"}, {"segments", List{line(0, 0.1), line(0.1, 0.3)}}});
}

TEST_F(Ioci, AnUnknownShapeNamesThoseAvailable) {
  const Error e =
      fails("trajectory.create", {{"name", "t"}, {"segments", List{Map{{"shape", "lin"}}}}});
  EXPECT_NE(e.sentence().find("line"), std::string::npos) << e.sentence();
}

TEST_F(Ioci, ADeepTreeOfSolidsDoesNotExhaustTheStack) {
  Value node = Map{{"kind", "box"}, {"x", 1}, {"y", 1}, {"z", 1}};
  for (int i = 0; i < 2000; ++i) node = Map{{"kind", "union"}, {"children", List{std::move(node)}}};
  call("solid.create", {{"name", "deep"}, {"root", node}});
  EXPECT_EQ(at(call("solid.describe", {{"id", "deep"}}), "nodes").as_list()->size(), 2001U);
}

// --- permissions ---------------------------------------------------------------------------

TEST_F(Ioci, ADeniedEffectStopsTheCommandBeforeItRuns) {
  session_.deny(Effect::edits);
  session_.deny(Effect::files_write);
  EXPECT_EQ(fails("material.create", {{"name", "brass"}, {"density", 8500}}).code,
            ErrorCode::permission);
  EXPECT_EQ(fails("material.save", {{"id", "x"}}).code, ErrorCode::permission);
  call("document.list");
}

// --- steps and groups ----------------------------------------------------------------------

TEST_F(Ioci, OneCommandIsOneStep) {
  brass();
  EXPECT_EQ(steps(), 1U);
  plate();
  EXPECT_EQ(steps(), 2U);
  call("document.list");
  EXPECT_EQ(steps(), 2U) << "reading leaves no step";
  call("robot.get", {{"name", "pa10"}});
  EXPECT_EQ(steps(), 2U) << "what comes from the library is no step";
  const auto records = app().document.now()->size();
  call("robot.get", {{"name", "pa10"}});
  EXPECT_EQ(app().document.now()->size(), records) << "what is there is not loaded again";
  call("document.undo");
  EXPECT_EQ(app().document.now()->size(), records - 1);
  call("document.redo");
  EXPECT_EQ(app().document.now()->size(), records);
}

TEST_F(Ioci, EditsOfOneGestureShareAStep) {
  plate();
  for (int i = 1; i <= 5; ++i)
    call("solid.set", {{"id", "plate"},
                       {"path", "bore.radius"},
                       {"value", 0.01 + 0.001 * i},
                       {"gesture", "drag 1"}});
  EXPECT_EQ(steps(), 2U);
  call("document.undo");
  EXPECT_EQ(
      at((*at(call("solid.tree", {{"id", "plate"}}), "children").as_list())[1], "radius").number(),
      0.01);
}

TEST_F(Ioci, AGroupIsOneStepAndSeesItsOwnEdits) {
  const auto done = app().transaction(session_, "two materials", [&]() -> Result<void> {
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "brass"}, {"density", 8500}}));
    RMP_TRY_ASSIGN(const Value steel, app().dispatch(session_, "material.create",
                                                     {{"name", "steel"}, {"density", 7850}}));
    EXPECT_EQ(app().name_of(*steel.as_handle(), &session_), "steel");
    EXPECT_EQ(app().name_of(*steel.as_handle()), std::nullopt) << "nobody else sees it yet";
    RMP_TRY(app().dispatch(session_, "material.set", {{"id", "steel"}, {"density", 7900}}));
    return {};
  });
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(steps(), 1U);
  EXPECT_EQ(app().document.undo_labels().front(), "two materials");
  call("document.undo");
  EXPECT_EQ(app().document.now()->size(), 0U);
}

TEST_F(Ioci, AGroupThatFailsLeavesNothing) {
  const std::string before = app().document.content_digest();
  const auto done = app().transaction(session_, "fails", [&]() -> Result<void> {
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "brass"}, {"density", 8500}}));
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "brass"}, {"density", 1}}));
    return {};
  });
  EXPECT_FALSE(done.ok());
  EXPECT_EQ(app().document.content_digest(), before);
  EXPECT_EQ(steps(), 0U);
  brass();  // the program goes on
}

TEST_F(Ioci, ACommandThatFailsWithinAGroupLeavesTheRestOfTheGroup) {
  const auto done = app().transaction(session_, "group", [&]() -> Result<void> {
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "brass"}, {"density", 8500}}));
    EXPECT_FALSE(
        app().dispatch(session_, "material.create", {{"name", "brass"}, {"density", 1}}).ok());
    EXPECT_FALSE(app().dispatch(session_, "document.undo", {}).ok())
        << "history waits for the end of the group";
    return {};
  });
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(at(call("material.describe", {{"id", "brass"}}), "density").number(), 8500);
}

TEST_F(Ioci, AGroupOfAnotherSessionIsNotJoined) {
  Session other("other");
  const auto done = app().transaction(session_, "mine", [&]() -> Result<void> {
    RMP_TRY(app().dispatch(session_, "material.create", {{"name", "ours"}, {"density", 2}}));
    EXPECT_TRUE(
        app().dispatch(other, "material.create", {{"name", "theirs"}, {"density", 1}}).ok());
    EXPECT_FALSE(app().dispatch(other, "material.describe", {{"id", "ours"}}).ok());
    return {};
  });
  EXPECT_TRUE(done.ok()) << "nobody changed what it looked at";
  EXPECT_EQ(app().document.now()->size(), 2U);
  EXPECT_EQ(app().document.undo_labels(), (std::vector<std::string>{"mine", "material.create"}));
}

TEST_F(Ioci, AnInterruptedCommandIsCancelledAndLeavesNoTrace) {
  call("world.get", {{"name", "pa10_circle"}});
  const auto world = app().document.now()->list(Kind::world).front();
  session_.interrupt();
  const Value name = Value(app().document.now()->find(world)->name);
  const Error e = fails("world.inverse_kinematics",
                        {{"id", name}, {"robot", "pa10"}, {"trajectory", "circle"}});
  EXPECT_EQ(e.code, ErrorCode::cancelled) << e.sentence();
  session_.clear_interrupt();
}

// --- audit ---------------------------------------------------------------------------------

TEST_F(Ioci, WhatChangesIsAuditedAsALineOfLua) {
  call("material.create", {{"name", "gold"}, {"density", 19300}});
  const auto said = app().messages.recent(1).back();
  EXPECT_EQ(said.code, "audit");
  EXPECT_EQ(said.text, "material.create{name = \"gold\", density = 19300}");
  EXPECT_EQ(said.source, "test");
  call("document.list");
  EXPECT_EQ(app().messages.recent(1).back().text, said.text) << "reading is not audited";
}

// --- front ends ----------------------------------------------------------------------------

TEST_F(Ioci, NamedPositionalAndClassicCallsGiveEqualResults) {
  call("robot.get", {{"name", "pa10"}});
  const Value name("pa10");
  const Value by_name = call("robot.dh_table", {{"id", "pa10"}});
  const auto by_position =
      app().dispatch_positional(session_, "robot.dh_table", std::span(&name, 1));
  ASSERT_TRUE(by_position.ok());
  EXPECT_EQ(by_name, *by_position);
  const Value in_degrees = call("robot.dh_table", {{"id", "pa10"}, {"angles", "degrees"}});
  EXPECT_EQ(in_degrees, classic("PRobot pa10 mGetDHP"));
  EXPECT_EQ(in_degrees, classic("probot pa10 MGETDHP")) << "classic lines are case-blind";
  EXPECT_EQ(by_name, classic("PRobot pa10 LLRL mGetDHP")) << "the LLRL speaks of radians";
  EXPECT_EQ(by_name, classic("robot.dh_table pa10"));
  EXPECT_EQ(call("robot.dynamics", {{"id", "pa10"}}), classic("PRobot pa10 vGetDynamic"));
  EXPECT_EQ(call("robot.dynamics", {{"id", "pa10"}}), classic("PRobot pa10 vGetDynamicp"));
  EXPECT_EQ(call("robot.tool", {{"id", "pa10"}}), classic("PRobot pa10 mGetToolHMT"));
  EXPECT_EQ(call("robot.fk", {{"id", "pa10"}, {"q", List{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}}}),
            classic("PRobot pa10 LLRL FKine 0.1 0.2 0.3 0.4 0.5 0.6 0.7"));
  EXPECT_EQ(
      call("robot.jacobian",
           {{"id", "pa10"}, {"q", List{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}}, {"frame", "tool"}}),
      classic("PRobot pa10 LLRL mJacobian {0.1 0.2 0.3 0.4 0.5 0.6 0.7} tool"));
  EXPECT_EQ(call("robot.link_parameters", {{"id", "pa10"}, {"link", 3}, {"angles", "degrees"}}),
            classic("PRobot pa10 Link 3 vGetDHp"));
}

TEST_F(Ioci, ClassicLinesRunAWholeSimulation) {
  classic("Worlds Open \"" + std::string(ROBOMOSP_SOURCE_DIR) +
          "/scripts/library/worlds/pa10_circle.wld\"");
  const Value worlds = classic("Worlds LsWorlds");
  ASSERT_EQ(worlds.as_list()->size(), 1U);
  const std::string cell = *app().name_of(*(*worlds.as_list())[0].as_handle());
  EXPECT_EQ(classic("Worlds GetWorldId 1"), Value(cell));
  EXPECT_EQ(classic("World " + cell + " LsPRobots"), call("world.robots", {{"id", cell}}));
  EXPECT_EQ(classic("World " + cell + " GetPRobotId 1"), Value("pa10"));
  EXPECT_EQ(classic("World " + cell + " GetPRobotIndex pa10"), Value(1));
  const Value kinematics = classic("World " + cell + " WorldInvKineSim pa10 circle");
  ASSERT_NE(kinematics.as_handle(), nullptr);
  EXPECT_EQ(kinematics.as_handle()->kind, "recording");
  const Value dynamics = classic("World " + cell + " InvDynWorldSim pa10 circle sample_time=0.5");
  const Value torques = call("recording.values", {{"id", dynamics}, {"columns", "tau"}});
  EXPECT_EQ(torques.as_array()->cols(), 7U);
  // 62.832 s for one turn (2 pi 0.1 m at 10 mm/s) in steps of 0.5 s: 0 .. 62.5 and the very end.
  EXPECT_EQ(torques.as_array()->rows(), 127U);
  EXPECT_EQ(classic("PTrajectory circle GetGenPoint 1"),
            call("trajectory.sample", {{"id", "circle"}, {"t", 0}}));
  const Value set = classic("PRobot pa10 SetLinks 10 20 30 40 50 60 70");
  EXPECT_NEAR(classic("PRobot pa10 AddLinks 0 0 0 0 0 0 10").as_array()->data()[6], 80, 1e-12);
  EXPECT_NEAR(set.as_array()->data()[0], 10, 1e-12);
  EXPECT_NEAR(classic("PRobot pa10 LLRL mGetInJointp").as_array()->data()[6], 80 * M_PI / 180,
              1e-12);
  classic("Transform pa10.tool Set P3 \"150 mm\"");
  EXPECT_EQ(classic("Transform pa10.tool Get P3"), Value(0.15));
  classic("World " + cell + " Close");
  EXPECT_TRUE(classic("Worlds LsWorlds").as_list()->empty());
}

TEST_F(Ioci, AClassicLineLoadsFromTheLibraryByAnySpellingAndNothingWhenItIsRefused) {
  const std::string before = app().document.content_digest();
  EXPECT_EQ(classic_fails("PRobot PA10 Link 9 GetMaxAngle").code, ErrorCode::invalid_argument);
  EXPECT_EQ(app().document.content_digest(), before);
  EXPECT_EQ(classic("PRobot PA10 GetDOF"), Value(7));
  EXPECT_NE(app().document.content_digest(), before);
}

TEST_F(Ioci, ClassicLinesThatAreWrongAreAnsweredInSentences) {
  call("robot.get", {{"name", "pa10"}});
  EXPECT_EQ(classic_fails("PRobt pa10 mGetDHP").sentence(),
            "there is no classic command \"PRobt\". Did you mean \"PRobot\"?");
  EXPECT_EQ(classic_fails("PRobot pa10 mGetDPH").sentence(),
            "PRobot has no option \"mGetDPH\". Did you mean \"mGetDHP\"?");
  EXPECT_EQ(classic_fails("PRobot mGetDHP").code, ErrorCode::usage);
  EXPECT_EQ(classic_fails("PRobot pa10 mGetDHP 7").code, ErrorCode::usage);
  EXPECT_EQ(classic_fails("PRobot \"pa10").code, ErrorCode::syntax);
  EXPECT_EQ(classic_fails("PRobot pa11 mGetDHP").code, ErrorCode::unknown_name);
}

TEST_F(Ioci, ClassicWordsAreSplitAtBlanksOutsideQuotesAndBraces) {
  const auto words = split_classic("World \"my cell\" Show {1 2 {3}}  a=\"b c\" \"q\\\"q\"");
  ASSERT_TRUE(words.ok());
  EXPECT_EQ(*words,
            (std::vector<std::string>{"World", "my cell", "Show", "{1 2 {3}}", "a=b c", "q\"q"}));
  EXPECT_FALSE(split_classic("World {1 2").ok());
}

TEST_F(Ioci, TooManyPositionalArgumentsAreRefused) {
  const std::vector<Value> args(3, Value("x"));
  const auto r = app().dispatch_positional(session_, "robot.dof", args);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::usage);
}

// --- content -------------------------------------------------------------------------------

TEST_F(Ioci, ThePaperPumaHoldsItselfWithThePublishedTorques) {
  // Corke's toolbox, standard-DH Puma 560 at q = 0 under 9.81 m/s^2: {0, 37.48366665, 0.24892875,
  // 0, 0, 0} N m.
  call("robot.get", {{"name", "puma560"}});
  const Value tau =
      call("robot.gravity_torques",
           {{"id", "puma560"}, {"q", List{0, 0, 0, 0, 0, 0}}, {"gravity", List{0, 0, -9.81}}});
  const double expected[] = {0, 37.48366665, 0.24892875, 0, 0, 0};
  ASSERT_EQ(tau.as_array()->size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR((*tau.as_array())[i], expected[i], 5e-9) << i;
  EXPECT_EQ(tau.as_array()->unit(), "N m");
}

TEST_F(Ioci, ThePaperCompoundHasItsExactMass) {
  call("object.get", {{"name", "paper_compound"}});
  const Value m = call("object.mass", {{"id", "paper_compound"}});
  // Steel box 0.2 x 0.2 x 0.05 m and aluminium cylinder r 0.05, l 0.2 m: closed form.
  EXPECT_NEAR(at(m, "mass").number(), 7850 * 0.2 * 0.2 * 0.05 + 2700 * M_PI * 0.05 * 0.05 * 0.2,
              1e-9);
  const auto& principal = *at(m, "principal_moments").as_array();
  const auto& inertia = *at(m, "inertia").as_array();
  EXPECT_NEAR(principal[0] + principal[1] + principal[2],
              inertia.at(0, 0) + inertia.at(1, 1) + inertia.at(2, 2), 1e-12);
  // Axes diagonalise: I a = lambda a, column by column.
  const auto& axes = *at(m, "principal_axes").as_array();
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < 3; ++j) sum += inertia.at(i, j) * axes.at(j, k);
      EXPECT_NEAR(sum, principal[k] * axes.at(i, k), 1e-12);
    }
}

TEST_F(Ioci, InverseKinematicsComesBackToTheTargetOfAnotherConvention) {
  call("robot.get", {{"name", "pa10"}});
  // The paper's fourth case: (0.557, 0, 0.374) m, roll-pitch-yaw (pi, 0, pi).
  const Value s =
      call("robot.solve_ik", {{"id", "pa10"}, {"target", List{0.557, 0, 0.374, M_PI, 0, M_PI}}});
  const Value back = call("robot.fk", {{"id", "pa10"}, {"q", at(s, "q")}});
  EXPECT_NEAR((*at(back, "position").as_array())[0], 0.557, 1e-8);
  EXPECT_NEAR((*at(back, "position").as_array())[2], 0.374, 1e-8);
}

TEST_F(Ioci, NodesOfATreeCanBeAddedWrappedAndRemoved) {
  plate();
  call("solid.wrap", {{"id", "plate"},
                      {"node", "body"},
                      {"kind", "union"},
                      {"name", "blank"},
                      {"with", Map{{"kind", "sphere"}, {"name", "knob"}, {"radius", 0.02}}}});
  call("solid.add_node",
       {{"id", "plate"},
        {"parent", "blank"},
        {"node", Map{{"kind", "union"},
                     {"name", "pair"},
                     {"children", List{Map{{"kind", "sphere"}, {"radius", 0.01}},
                                       Map{{"kind", "sphere"}, {"radius", 0.005}}}}}}});
  const auto order = [&] {
    std::string names;
    const Value all = call("solid.describe", {{"id", "plate"}});
    for (const Value& n : *at(all, "nodes").as_list()) {
      const Value* parent = n.as_map()->find("parent");
      names += *at(n, "name").as_string() + "<" + (parent ? *parent->as_string() : "") + " ";
    }
    return names;
  };
  EXPECT_EQ(order(),
            "difference< blank<difference body<blank knob<blank pair<blank sphere<pair "
            "sphere_2<pair bore<difference ");
  call("solid.remove_node", {{"id", "plate"}, {"node", "pair"}});
  EXPECT_EQ(order(), "difference< blank<difference body<blank knob<blank bore<difference ");
  fails("solid.remove_node", {{"id", "plate"}, {"node", "difference"}});
  call("document.undo");
  call("document.undo");
  call("document.undo");
  EXPECT_EQ(order(), "difference< body<difference bore<difference ");
}

TEST_F(Ioci, ATreeReadBackMakesAnEqualSolid) {
  plate();
  call("solid.create", {{"name", "twin"}, {"root", call("solid.tree", {{"id", "plate"}})}});
  EXPECT_EQ(at(call("solid.describe", {{"id", "plate"}}), "nodes"),
            at(call("solid.describe", {{"id", "twin"}}), "nodes"));
}

TEST_F(Ioci, ALinkChangesItsFieldsInTheUnitsOfItsJoint) {
  call("robot.create",
       {{"name", "scara"},
        {"links",
         List{Map{{"a", 0.3}},
              Map{{"joint", "prismatic"}, {"d", 0.1}, {"lower", 0}, {"upper", "200 mm"}}}}});
  call("robot.set_link", {{"id", "scara"}, {"link", 1}, {"upper", "90 deg"}});
  fails("robot.set_link", {{"id", "scara"}, {"link", 2}, {"upper", "90 deg"}});
  fails("robot.set_link", {{"id", "scara"}, {"link", 3}, {"upper", 1}});
  const Value joints = call("robot.joints", {{"id", "scara"}});
  EXPECT_NEAR(at((*joints.as_list())[0], "upper").number(), M_PI / 2, 1e-15);
  EXPECT_EQ(at((*joints.as_list())[1], "upper").number(), 0.2);
  const Value at_pose = call("robot.fk", {{"id", "scara"}, {"q", List{"90 deg", "50 mm"}}});
  EXPECT_NEAR((*at(at_pose, "position").as_array())[1], 0.3, 1e-15);
  EXPECT_NEAR((*at(at_pose, "position").as_array())[2], 0.15, 1e-15);
}

TEST_F(Ioci, SavedAndLoadedRecordsAreEqual) {
  brass();
  plate();
  call("solid.set", {{"id", "plate"}, {"path", "material"}, {"value", "brass"}});
  call("solid.save", {{"id", "plate"}, {"file", (folder_ / "plate.csg").string()}});
  const Value before = call("solid.describe", {{"id", "plate"}});
  app().document.clear();
  call("solid.load", {{"file", (folder_ / "plate.csg").string()}});
  EXPECT_EQ(call("solid.describe", {{"id", "plate"}}), before);
  EXPECT_EQ(app().document.now()->list(Kind::material).size(), 1U)
      << "the material was saved beside it";
}

TEST_F(Ioci, EvaluatingAWorldFillsTheCacheForAllItsSolids) {
  plate();
  call("world.create", {{"name", "cell"}});
  call("world.add_object", {{"id", "cell"}, {"what", "plate"}});
  const Value e = call("world.evaluate", {{"id", "cell"}});
  const Value& row = (*at(e, "solids").as_list())[0];
  EXPECT_NEAR(at(row, "volume").number(), 0.2 * 0.1 * 0.01 - M_PI * 0.01 * 0.01 * 0.01, 1e-15);
  const auto misses = app().derived.stats().misses;
  call("solid.moments", {{"id", "plate"}});
  EXPECT_EQ(app().derived.stats().misses, misses);
}

TEST_F(Ioci, AClassicLineLoadsWhatItWorksOnFromTheLibrary) {
  const Value table = classic("PRobot pa10 mGetDHP");
  EXPECT_EQ(at(table, "rows").as_list()->size(), 7U);
  EXPECT_TRUE(app().document.now()->find(Kind::robot, "pa10"));
  const std::string before = app().document.content_digest();
  const auto steps_before = steps();
  classic("PRobot pa10 GetDOF");
  EXPECT_EQ(app().document.content_digest(), before) << "loaded once";
  EXPECT_EQ(steps(), steps_before);
}

TEST_F(Ioci, AClassicLineInTheTablesOwnNamesLoadsAsWell) {
  classic("robot.fk pa10 {0 0 0 0 0 0 0}");
  EXPECT_TRUE(app().document.now()->find(Kind::robot, "pa10"));
}

TEST_F(Ioci, OnlyClassicLinesLoadFromTheLibraryUnasked) {
  EXPECT_EQ(fails("robot.dh_table", {{"id", "pa10"}}).code, ErrorCode::unknown_name);
  EXPECT_EQ(classic_fails("PRobot nobody mGetDHP").code, ErrorCode::unknown_name);
  EXPECT_TRUE(app().document.now()->list(Kind::robot).empty());
}

TEST_F(Ioci, TorquesOfARobotWithoutMassComeWithAWarning) {
  call("robot.create", {{"name", "ghost"}, {"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
  const Value tau = call("robot.gravity_torques", {{"id", "ghost"}, {"q", List{0.0, 0.0}}});
  EXPECT_EQ(tau, Value(NumericArray({0, 0}, "N m")));
  EXPECT_EQ(last("no_mass").text,
            "robot \"ghost\" has no masses, so its torques are zero. Give its links masses or "
            "designed parts.");
  EXPECT_EQ(last("no_mass").severity, Severity::warning);
  call("robot.mass", {{"id", "ghost"}});
  EXPECT_EQ(last("no_mass").severity, Severity::info);
  call("robot.set_link", {{"id", "ghost"}, {"link", 2}, {"mass", 1}});
  const auto told = app().messages.recent().size();
  call("robot.gravity_torques", {{"id", "ghost"}, {"q", List{0.0, 0.0}}});
  EXPECT_EQ(app().messages.recent().size(), told);
}

TEST_F(Ioci, AnInertiaThatNoBodyHasIsKeptWithAWarning) {
  call("robot.create",
       {{"name", "odd"},
        {"links", List{Map{{"a", 0.3}, {"mass", 1}, {"inertia", List{0.0, 0.35, 0.0, 0, 0, 0}}}}}});
  EXPECT_EQ(last("inertia").text,
            "robot \"odd\", link \"link1\": no body has the given inertia, with the principal "
            "moments 0, 0 and 0.35 kg m^2. None can be negative or exceed the sum of the others.");
  const auto told = app().messages.recent(1000).size();
  // A flat plate is the limit: Izz = Ixx + Iyy.
  call("robot.create",
       {{"name", "plate"},
        {"links", List{Map{{"a", 0.3}, {"mass", 1}, {"inertia", List{0.1, 0.2, 0.3, 0, 0, 0}}}}}});
  EXPECT_EQ(app().messages.recent(1000).size(), told + 1) << "only the audit line";
}

TEST_F(Ioci, LengthsBeyondTenKilometresAreRefused) {
  EXPECT_NE(fails("robot.create", {{"name", "far"}, {"links", List{Map{{"a", 1e300}}}}})
                .sentence()
                .find("it must be -10000 to 10000 m"),
            std::string::npos);
  call("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 1e4}}}}});
  fails("robot.set_link", {{"id", "arm"}, {"link", 1}, {"d", -10001}});
  fails("robot.set_link", {{"id", "arm"}, {"link", 1}, {"mass", 2e9}});
}

TEST_F(Ioci, CountsAndArticlesReadWell) {
  call("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
  EXPECT_EQ(fails("robot.fk", {{"id", "arm"}, {"q", List{1.0}}}).message,
            "1 joint value is given; the robot has 2 joints");
  EXPECT_EQ(fails("robot.manipulability", {{"id", "arm"}}).sentence(),
            "robot.manipulability, q: joint values are required.");
  EXPECT_NE(fails("object.mass", {{"id", 5}}).sentence().find("5 is not an object"),
            std::string::npos);
}

TEST_F(Ioci, ARobotIsNamedOnceInAnErrorOfItsSolver) {
  call("robot.create", {{"name", "ghost"}, {"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
  const std::string said =
      fails("robot.forward_dynamics", {{"id", "ghost"}, {"q", List{0.0, 0.0}}}).sentence();
  EXPECT_EQ(said.find("robot \"ghost\""), said.rfind("robot \"ghost\"")) << said;
}

TEST_F(Ioci, DescribingTheTableGivesEveryCommand) {
  const Value all = call("ioci.describe");
  EXPECT_EQ(all.as_list()->size(), app().commands.list().size());
  EXPECT_EQ(app().commands.methods_of("robot").front()->params.front().name, "id");
}

}  // namespace
}  // namespace robomosp::ioci

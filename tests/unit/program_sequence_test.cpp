// SPDX-License-Identifier: Apache-2.0
// Sequences of joint trajectories: who reads the files only, by the page, finds what the program
// does in its trace: outputs, waits and texts in order, and between them the same motions.
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include <gtest/gtest.h>

#include <robomosp/sdk/program_tables.h>

#include "motion/provider_params.h"
#include "program/trace.h"
#include "support/program.h"

namespace robomosp {
namespace {

using Json = nlohmann::json;

class Sequence : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    for (const char* name : {"puma560", "ur10e"}) call("robot.get", {{"name", name}});
  }
  static std::string shipped(const std::string& name) {
    std::ifstream in(std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/" + name + ".irl");
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  program::Trace trace_of(const std::string& text) {
    const SourceFile file{"one.irl", text, {}};
    auto language = app().registry.create<Language>("irl");
    const auto info = app().registry.find(Language::kInterfaceId, "irl");
    auto params = motion::checked_params(*info, {}, "irl");
    LanguageTask task;
    task.files = std::span(&file, 1);
    Silent progress;
    auto compiled = (*language)->compile(task, **params, progress);
    EXPECT_TRUE(compiled.ok() && !(*compiled)->code().has_errors) << text;
    auto t = program::trace(std::shared_ptr<const CompiledProgram>(std::move(*compiled)));
    EXPECT_TRUE(t.ok()) << t.error().sentence();
    return t.ok() ? std::move(*t) : program::Trace{};
  }
  /// Where the tool is at these joints, seen from the robot's base [mm].
  std::array<double, 3> tool_at(const Json& positions, const std::string& robot) {
    List q;
    for (const auto& v : positions) q.emplace_back(v.get<double>());
    const Value pose = call("robot.fk", {{"id", robot}, {"q", q}});
    const Value& place = at(pose, "position");
    std::array<double, 3> out{};
    const NumericArray* all = place.as_array();
    EXPECT_NE(all, nullptr) << place.text();
    for (std::size_t i = 0; all && i < 3; ++i) out[i] = all->data()[i] * 1000;
    return out;
  }
  void check(const std::string& text, const std::string& robot = "puma560") {
    const Value id = call("program.create", {{"name", "one"}, {"source", text}});
    const Value posted = call("program.post", {{"id", id},
                                               {"target", "joint_trajectory"},
                                               {"robot", robot},
                                               {"name", "one"},
                                               {"source_map", true}});
    std::map<std::string, Json> files;
    for (const Value& f : *at(posted, "files").as_list())
      if (const std::string name = *at(f, "name").as_string(); name.ends_with(".json"))
        files[name] = Json::parse(*at(f, "text").as_string());
    std::map<std::string, std::vector<std::int64_t>> lines;  // of IRL, by file and line
    for (const Value& l : *at(posted, "source_map").as_list()) {
      auto& to = lines[*at(l, "file").as_string()];
      to.resize(
          std::max<std::size_t>(to.size(), static_cast<std::size_t>(*at(l, "line").as_int()) + 1));
      to[static_cast<std::size_t>(*at(l, "line").as_int())] = *at(l, "source_line").as_int();
    }
    ASSERT_TRUE(files.contains("one_sequence.json"));
    const Json& steps = files["one_sequence.json"]["steps"];
    const program::Trace t = trace_of(text);
    const rmp_code& c = t.program->code();
    // What a stretch still has: points that were not come to.
    std::size_t step = 0, point = 0, motions = 0, others = 0;
    std::string stretch;
    const auto points = [&]() -> const Json& { return files[stretch + ".json"]["points"]; };
    const auto is_in_stretch = [&] { return !stretch.empty() && point < points().size(); };
    for (const program::TraceEntry& e : t.entries) {
      SCOPED_TRACE("line " + std::to_string(e.span.line) + ", step " + std::to_string(step));
      if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) {
        if (!is_in_stretch()) {
          ASSERT_LT(step, steps.size());
          ASSERT_TRUE(steps[step].contains("trajectory")) << steps[step];
          stretch = steps[step++]["trajectory"];
          point = 0;
        }
        // Its points: those whose line of the file comes from the motion's line.
        const std::size_t first = point;
        while (is_in_stretch() && lines[stretch + ".json"][point + 4] == e.span.line) {
          ++point;
          // Where the same line is carried out again, its end is where it goes.
          const auto end = tool_at(points()[point - 1]["positions"], robot);
          const auto& goal = m->absolute.back();
          if (goal && std::hypot(end[0] - goal->position[0], end[1] - goal->position[1],
                                 end[2] - goal->position[2]) < 0.05)
            break;
        }
        ASSERT_GT(point, first);
        const auto end = tool_at(points()[point - 1]["positions"], robot);
        ASSERT_TRUE(m->absolute.back());
        for (std::size_t i = 0; i < 3; ++i)
          EXPECT_NEAR(end[i], m->absolute.back()->position[i], 0.05);
        ++motions;
        continue;
      }
      ++others;
      const auto* wait = std::get_if<program::TracedWait>(&e.what);
      if (wait && !wait->condition && is_in_stretch()) {
        EXPECT_EQ(points()[point]["positions"], points()[point - 1]["positions"]);
        const auto time = [&](std::size_t i) {
          const Json& x = points()[i]["time_from_start"];
          return x["sec"].get<double>() + 1e-9 * x["nanosec"].get<double>();
        };
        EXPECT_NEAR(time(point) - time(point - 1), wait->seconds, 1e-6);
        ++point;
        continue;
      }
      EXPECT_FALSE(is_in_stretch()) << "the stretch goes on";
      ASSERT_LT(step, steps.size());
      const Json& s = steps[step++];
      if (wait && wait->condition) {
        // One input, or not one.
        const std::string text_of = wait->condition->text(c);
        Json asked = s["wait_for"];
        bool is_on = true;
        for (; asked[0] == "not"; asked = Json(asked[1])) is_on = !is_on;
        if (asked[0] == "=") {
          is_on = asked[2].get<bool>();
          asked = Json(asked[1]);
        }
        ASSERT_EQ(asked[0], "input") << s;
        const std::string name = asked[1];
        EXPECT_NE(text_of.find(name), std::string::npos) << text_of;
        EXPECT_EQ(
            text_of.find("NOT") == std::string::npos && text_of.find("FALSE") == std::string::npos,
            is_on)
            << text_of << s;
        if (wait->seconds >= 0) EXPECT_EQ(s["timeout"], wait->seconds);
        else EXPECT_FALSE(s.contains("timeout"));
      } else if (wait) {
        EXPECT_EQ(s["wait"], wait->seconds);
      } else if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
        const auto& signal = row<rmp_code_symbol>(c.symbols, w->symbol);
        EXPECT_EQ(s["set"], signal.name);
        EXPECT_EQ(s["number"], signal.address);
        if (signal.type == RMP_TYPE_BOOL) EXPECT_EQ(s["value"], w->value.integer != 0);
        else if (signal.type == RMP_TYPE_INT) EXPECT_EQ(s["value"], w->value.integer);
        else EXPECT_EQ(s["value"], w->value.real);
      } else if (const auto* said = std::get_if<program::TracedText>(&e.what)) {
        std::string wanted = said->text;
        if (wanted.ends_with('\n')) wanted.pop_back();
        EXPECT_EQ(s["text"], wanted);
      } else {
        ADD_FAILURE() << s;
      }
    }
    EXPECT_FALSE(is_in_stretch());
    EXPECT_EQ(step, steps.size());
    EXPECT_GT(motions, 5U);
    EXPECT_GT(others, 3U);
  }

  class Silent final : public Progress {
   public:
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return false; }
  };
};

TEST_F(Sequence, OfHanoiIsWhatTheProgramDoes) { check(shipped("hanoi")); }
TEST_F(Sequence, OfPalletisingIsWhatTheProgramDoes) { check(shipped("palletising"), "ur10e"); }
TEST_F(Sequence, OfArcWeldingIsWhatTheProgramDoes) { check(shipped("arc_weld")); }
TEST_F(Sequence, OfEachPartOfTwoRobotsIsWhatThePartDoes) {
  List lines;
  for (const char* name : {"left_starts", "right_starts", "part_there_released",
                           "part_there_acquired", "table_free_released", "table_free_acquired"})
    lines.emplace_back(
        Map{{"name", name}, {"number", static_cast<std::int64_t>(20 + lines.size())}});
  const Value profile =
      call("record.create", {{"kind", "controller"},
                             {"name", "lines"},
                             {"fields", Map{{"target", "krl"}, {"signals", std::move(lines)}}}});
  const Value both = call("program.create", {{"name", "both"}, {"source", shipped("two_robots")}});
  for (const char* robot : {"left", "right"}) {
    const Value part =
        call("program.part_of_robot",
             {{"id", both}, {"robot", robot}, {"name", std::string(robot)}, {"profile", profile}});
    check(*call("program.source", {{"id", at(part, "program")}}).as_string());
    call("document.undo");
  }
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Programs of several robots, a part for each controller: both parts in one world, joined by
// lines, do what the program did; posted and read back, too. What lines cannot say is refused.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/program_tables.h>

#include "motion/provider_params.h"
#include "program/trace.h"
#include "support/program_events.h"
#include "support/program_run.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::Event, test::RecordingPtr, test::Signals, test::events, test::same;

const std::vector<std::string> kLines{"left_starts",         "right_starts",
                                      "part_there_released", "part_there_acquired",
                                      "table_free_released", "table_free_acquired"};

std::string two_robots() {
  std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs/two_robots.irl");
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}
/// A program of the robots left and right, which have these processes.
std::string program(const std::string& declared, const std::string& left, const std::string& right,
                    const std::string& own = "") {
  const std::string pose = "POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0))";
  return "PROGRAM both;\nTYPE\n  RECORD POSE: R_BASE, R_TOOL; ENDRECORD: R_SPEC_TYPE;\n"
         "  ROBOT left := R_SPEC_TYPE(" +
         pose + ", " + pose + ");\n  ROBOT right := R_SPEC_TYPE(" + pose + ", " + pose + ");\n" +
         declared +
         "PROCEDURE go (IN REAL: a);\nBEGIN\n"
         "  MOVE PTP MAIN_JOINT(a, -60.0, 60.0, 0.0, 30.0, 0.0) ACT_ROB := left;\nENDPROC;\n"
         "PROCEDURE come (IN REAL: a);\nBEGIN\n"
         "  MOVE PTP MAIN_JOINT(a, -70.0, 60.0, 0.0, 30.0, 0.0) ACT_ROB := right;\nENDPROC;\n"
         "PROCESS make PRIORITY 2;\nVAR INT: i;\nBEGIN\n" +
         left + "ENDPROCESS;\nPROCESS use PRIORITY 1;\nVAR INT: k;\nBEGIN\n" + right +
         "ENDPROCESS;\nBEGIN\n  START make;\n  START use;\n" + own + "ENDPROGRAM;\n";
}

const std::string kGo =
    "  MOVE PTP MAIN_JOINT(1.0, -60.0, 60.0, 0.0, 30.0, 0.0) ACT_ROB := left;\n";
const std::string kCome =
    "  MOVE PTP MAIN_JOINT(1.0, -60.0, 60.0, 0.0, 30.0, 0.0) ACT_ROB := right;\n";

class Parts : public test::ProgramRun {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    call("robot.get", {{"name", "ur5"}});
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Value made(const std::string& name, const std::string& source) {
    return call("program.create", {{"name", name}, {"source", source}});
  }
  Value controller(const std::string& name, const std::vector<std::string>& lines,
                   const std::string& target = "krl") {
    List signals;
    // Those of few have 0, 1, 2, 5, 6, 7: the program has 3 and 4.
    const bool has_few = target == "urscript" || target == "movemaster";
    for (std::size_t i = 0; i < lines.size(); ++i)
      signals.emplace_back(
          Map{{"name", lines[i]},
              {"number", static_cast<std::int64_t>(has_few ? i + (i > 2 ? 2 : 0) : 20 + i)}});
    return call(
        "record.create",
        {{"kind", "controller"},
         {"name", name},
         {"fields", Map{{"target", target}, {"max_speed", 2.0}, {"signals", std::move(signals)}}}});
  }
  Value part(const Value& both, const std::string& robot, const Value& profile) {
    Map args{{"id", both}, {"robot", robot}, {"name", robot + "_part" + std::to_string(++made_)}};
    if (profile != Value()) args.set("profile", profile);
    return at(call("program.part_of_robot", args), "program");
  }
  std::string source_of(const Value& id) {
    return *call("program.source", {{"id", id}}).as_string();
  }
  /// A world of two robots with these signals.
  void new_world(const std::string& name, const std::vector<std::string>& digital,
                 const std::vector<std::string>& numbers, double value = 0) {
    cell_ = call("world.create", {{"name", name}});
    for (const char* robot : {"left", "right"})
      call("world.add_robot", {{"id", cell_},
                               {"robot", call("robot.get", {{"name", "ur5"}})},
                               {"name", robot},
                               {"position", List{0.0, robot[0] == 'l' ? -0.6 : 0.6, 0.0}}});
    for (const std::string& s : digital)
      call("world.add_signal",
           {{"id", cell_}, {"name", s}, {"initial", s.ends_with("gripper") ? 0.0 : value}});
    for (const std::string& s : numbers)
      call("world.add_signal", {{"id", cell_}, {"name", s}, {"kind", "analogue"}});
  }
  void add(const Value& program) {
    call("world.add_program", {{"id", cell_}, {"program", program}});
  }
  /// Texts with their times, in order; of one text or of all.
  static std::vector<std::pair<double, std::string>> texts(const RecordingPtr& r,
                                                           const std::string& word = "") {
    std::vector<std::pair<double, std::string>> out;
    for (const std::string& n : r->notes) {
      const auto colon = n.find(": "), second = n.find(": ", colon + 2);
      if (!n.starts_with("t = ") || second == std::string::npos) continue;
      const std::string text = n.substr(second + 2);
      if (n.find("lacks limits") != std::string::npos || !text.starts_with(word)) continue;
      out.emplace_back(std::stod(n.substr(4)), text);
    }
    return out;
  }
  /// The same texts, 0.2 s later.
  static void expect_later(const std::vector<std::pair<double, std::string>>& a,
                           const std::vector<std::pair<double, std::string>>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_NEAR(a[i].first + 0.2, b[i].first, 1e-3) << a[i].second;  // notes have six digits
      EXPECT_EQ(a[i].second, b[i].second);
    }
  }
  /// Both parts of a program, joined by lines, in a world; `change` may change their sources.
  template <class Change>
  void put_parts(const Value& both, const std::vector<std::string>& digital,
                 const std::vector<std::string>& numbers, double first, Change&& change) {
    std::vector<std::string> lines = digital;
    lines.insert(lines.end(), numbers.begin(), numbers.end());
    const Value profile = controller("lines" + std::to_string(++made_), lines);
    new_world("parts" + std::to_string(made_), digital, numbers, first);
    for (const char* robot : {"left", "right"}) {
      const Value p = part(both, robot, profile);
      parts_[robot] = p;
      std::string text = source_of(p);
      change(std::string(robot), text);
      const Value files = call("program.files", {{"id", p}});
      call("program.set_file",
           {{"id", p}, {"name", *at(files.as_list()->at(0), "name").as_string()}, {"text", text}});
      add(p);
    }
  }
  template <class Change>
  RecordingPtr run_parts(const Value& both, const std::vector<std::string>& digital,
                         const std::vector<std::string>& numbers, double first, Change&& change) {
    put_parts(both, digital, numbers, first, change);
    return run();
  }
  static void unchanged(const std::string&, std::string&) {}

  /// A text without its motions to a place that is computed from where the robot is.
  static std::string without_steps_from_here(const std::string& text) {
    std::istringstream lines(text);
    std::string out;
    for (std::string line; std::getline(lines, line);)
      if (line.find("MOVE LIN pose_sum(") == std::string::npos ||
          line.find("R_ROBTARGET_ACT") == std::string::npos)
        out += line + "\n";
    return out;
  }
  /// What a program of the document does alone.
  std::vector<Event> trace_of(const Value& id, bool has_groups) {
    const Value names = call("program.files", {{"id", id}});
    std::vector<std::pair<std::string, std::string>> texts;
    for (const Value& f : *names.as_list()) {
      const std::string name = *at(f, "name").as_string();
      const Value text = call("program.source", {{"id", id}, {"name", name}});
      texts.emplace_back(name, without_steps_from_here(*text.as_string()));
    }
    const std::string& text = texts[0].second;
    std::vector<SourceFile> files;
    for (const auto& [name, each] : texts) files.push_back({name, each, {}});
    auto language = app().registry.create<Language>("irl");
    const auto info = app().registry.find(Language::kInterfaceId, "irl");
    auto params = motion::checked_params(*info, {}, "irl");
    LanguageTask task;
    task.files = files;
    Silent progress;
    auto compiled = (*language)->compile(task, **params, progress);
    EXPECT_TRUE(compiled.ok() && !(*compiled)->code().has_errors) << text;
    if (!compiled.ok() || (*compiled)->code().has_errors) return {};
    auto t = program::trace(std::shared_ptr<const CompiledProgram>(std::move(*compiled)));
    EXPECT_TRUE(t.ok()) << t.error().sentence() << text;
    return t.ok() ? events(*t, has_groups) : std::vector<Event>{};
  }
  /// The first error of a part, with its line.
  std::string refused(const std::string& source, const std::string& robot,
                      const std::vector<std::string>& lines) {
    const Value both = made("refused" + std::to_string(++made_), source);
    Map args{{"id", both},     {"only_robot", robot},  {"target", "krl"},
             {"robot", "ur5"}, {"form", "structured"}, {"check", true}};
    if (!lines.empty()) args.set("profile", controller("c" + std::to_string(made_), lines));
    const Value found = call("program.post", args);
    for (const Value& f : *at(found, "faults").as_list())
      if (*at(f, "severity").as_string() == "error") {
        EXPECT_NE(*at(f, "hint").as_string(), "") << at(f, "message").text();
        return at(f, "line").text() + ": " + *at(f, "message").as_string();
      }
    return "posted";
  }

  class Silent final : public Progress {
   public:
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return false; }
  };
  std::map<std::string, Value> parts_;  ///< of the last world, by robot
  fs::path folder_ = fs::temp_directory_path() / ("parts-" + std::to_string(::getpid()));
};

TEST_F(Parts, InOneWorldTheyDoWhatTheProgramDidRowForRow) {
  const Value both = made("both", two_robots());
  new_world("whole", {"left_gripper", "right_gripper"}, {});
  add(both);
  const RecordingPtr whole = run();
  ASSERT_TRUE(whole);
  std::vector<std::string> digital = kLines;
  digital.insert(digital.end(), {"left_gripper", "right_gripper"});
  const RecordingPtr parts = run_parts(both, digital, {}, 0, unchanged);
  ASSERT_TRUE(parts);
  // They begin 0.2 s later, when each has seen the other.
  constexpr std::size_t kLater = 10;
  std::size_t compared = 0;
  for (const auto& c : whole->columns) {
    if (c.name.ends_with(".line")) continue;
    const auto& other = column(parts, c.name);
    ASSERT_EQ(c.values.size() + kLater, other.size()) << c.name;
    const double shift = c.name == "time" ? 0.2 : 0;
    for (std::size_t i = 0; i < c.values.size(); ++i)
      ASSERT_NEAR(c.values[i] + shift, other[i + kLater], 1e-9) << c.name << " " << i;
    ++compared;
  }
  EXPECT_EQ(compared, 1U + 2 * 18 + 2);
  expect_later(texts(whole), texts(parts));
  ASSERT_EQ(texts(whole).size(), 1U);
  // Each line has changed as often as it was passed on.
  const auto changes = [&](const char* name) {
    const auto& v = column(parts, name);
    std::size_t n = 0;
    for (std::size_t i = 1; i < v.size(); ++i) n += v[i] != v[i - 1];
    return n;
  };
  EXPECT_EQ(changes("signal.part_there_released"), 3U);
  EXPECT_EQ(changes("signal.part_there_acquired"), 3U);
  EXPECT_EQ(changes("signal.table_free_released"), 3U);
}

TEST_F(Parts, BeginTogetherWhateverTheLinesWereLeftAsAndWhoeverComesLater) {
  const Value both = made("both", two_robots());
  std::vector<std::string> digital = kLines;
  digital.insert(digital.end(), {"left_gripper", "right_gripper"});
  // Over the table, by the places where grippers change: one behind the other, three times.
  const auto order = [&](const RecordingPtr& r) {
    std::string out;
    const auto &l = column(r, "signal.left_gripper"), &x = column(r, "signal.right_gripper");
    for (std::size_t i = 1; i < l.size(); ++i) {
      if (l[i] < l[i - 1]) out += 'l';
      if (x[i] > x[i - 1]) out += 'r';
    }
    return out;
  };
  for (const double first : {0.0, 1.0})
    for (const std::string late : {"", "left", "right"}) {
      SCOPED_TRACE(late + std::to_string(first));
      put_parts(both, digital, {}, first, [&](const std::string& robot, std::string& text) {
        const auto at = text.find("BEGIN\n  begin_together;");
        ASSERT_NE(at, std::string::npos) << text;
        if (robot == late) text.insert(at + 6, "  WAIT 2.5 SEC;\n");
      });
      if (first > 0.5 && late == "left") {
        // A line that says of one that is not there that it begins: nobody moves, until the one
        // that believed it is started again.
        EXPECT_NE(fault().find("which can never come true after t = 2.5 s"), std::string::npos);
        continue;
      }
      const RecordingPtr r = run();
      ASSERT_TRUE(r);
      EXPECT_EQ(order(r), "lrlrlr");
      ASSERT_EQ(texts(r).size(), 1U);
      EXPECT_EQ(texts(r)[0].second, "3 parts taken");
      EXPECT_GT(texts(r)[0].first, late.empty() ? 16.0 : 18.5);
      // Neither robot moves before both have begun.
      const auto &t = column(r, "time"), &q = column(r, "left.q1");
      for (std::size_t i = 0; i < t.size() && !late.empty() && t[i] < 2.5; ++i)
        ASSERT_NEAR(q[i], q[0], 1e-12) << t[i];
    }
}

TEST_F(Parts, NumbersAndTruthValuesOfOneRobotAreReadByTheOther) {
  const std::string source = program(
      "SIGNAL OUTPUT BOOL: lamp AT 5;\n"
      "VAR SEMAPHORE: ready, spare := 1, done; INT: other, n := 2 + 1, z; BOOL: last;\n",
      "  FOR i := 1 TO 4\n    go(10.0 * i);\n    n := n * 2 - i;\n    last := i = 4;\n"
      "    lamp := NOT lamp;\n    WRITELN('made ', n, ' ', other);\n    RELEASE(ready);\n"
      "    ACQUIRE(done);\n  ENDFOR;\n",
      "  LOOP\n    ACQUIRE(ready);\n    come(5.0 * n);\n    WRITELN('used ', n);\n"
      "    IF lamp THEN WRITELN('lit'); ENDIF;\n    z := z + n;\n"
      "    IF last THEN EXIT; ENDIF;\n    RELEASE(done);\n  ENDLOOP;\n  RELEASE(done);\n",
      "  WAIT FOR last;\n  WRITELN('the last is made');\n");
  const Value both = made("both", source);
  new_world("whole", {"lamp"}, {});
  add(both);
  const RecordingPtr whole = run();
  ASSERT_TRUE(whole);
  const RecordingPtr parts =
      run_parts(both,
                {"left_starts", "right_starts", "ready_released", "ready_acquired", "done_released",
                 "done_acquired", "last", "lamp"},
                {"n"}, 0, unchanged);
  ASSERT_TRUE(parts);
  for (const char* word : {"made", "used", "lit", "the last"}) {
    expect_later(texts(whole, word), texts(parts, word));
    EXPECT_FALSE(texts(whole, word).empty()) << word;
  }
  EXPECT_EQ(texts(whole).size(), texts(parts).size());
  EXPECT_EQ(texts(whole, "used").back().second, "used 22");
  const Value &left = parts_["left"], &right = parts_["right"];
  EXPECT_NE(source_of(left).find("OUTPUT INT: n AT 28;"), std::string::npos) << source_of(left);
  EXPECT_NE(source_of(left).find("VAR INT: other, z;"), std::string::npos) << source_of(left);
  EXPECT_NE(source_of(left).find("n := 2 + 1;"), std::string::npos) << source_of(left);
  EXPECT_NE(source_of(right).find("INPUT BOOL: lamp AT 27;"), std::string::npos)
      << source_of(right);
}

TEST_F(Parts, NothingIsLostWhereOneRobotIsFarAhead) {
  const std::string source =
      program("VAR SEMAPHORE: ready;\n",
              "  FOR i := 1 TO 5\n    go(10.0 * i);\n    WRITELN('made ', i);\n"
              "    RELEASE(ready);\n  ENDFOR;\n",
              "  FOR k := 1 TO 5\n    ACQUIRE(ready);\n    WAIT 3.0 SEC;\n    come(5.0 * k);\n"
              "    WRITELN('used ', k);\n  ENDFOR;\n");
  const RecordingPtr r = run_parts(
      made("both", source), {"left_starts", "right_starts", "ready_released", "ready_acquired"}, {},
      0, unchanged);
  ASSERT_TRUE(r);
  const auto m = texts(r, "made"), u = texts(r, "used");
  ASSERT_EQ(m.size(), 5U);
  ASSERT_EQ(u.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_GT(u[i].first, m[i].first + 3.0 - 1e-6) << i;
  // No more than one is held: the third RELEASE waits until the second part is acquired.
  EXPECT_GT(m[3].first, u[0].first);
}

TEST_F(Parts, PostedAndReadBackTheyDoTheSame) {
  struct Read {
    const char *target, *reader;
    bool is_named, has_groups;
  };
  constexpr Read kRead[] = {
      {"krl", "krl", false, false},          {"rapid", "rapid", true, true},
      {"urscript", "urscript", true, false}, {"melfa5", "melfa", false, false},
      {"melfa4", "melfa", false, false},     {"val3", "val3", true, false}};
  call("robot.get", {{"name", "puma560"}});
  const Value both = made("both", two_robots());
  std::size_t n = 0;
  for (const Read& language : kRead)
    for (const std::string robot : {"left", "right"})
      for (const char* form : {"structured", "flat"}) {
        SCOPED_TRACE(std::string(language.target) + " " + robot + " " + form);
        const fs::path folder = folder_ / std::to_string(++n);
        fs::create_directories(folder);
        const Value profile = controller("c" + std::to_string(n), kLines, language.target);
        const Value own = call("program.part_of_robot", {{"id", both},
                                                         {"robot", robot},
                                                         {"name", "p" + std::to_string(n)},
                                                         {"profile", profile}});
        auto wanted = trace_of(at(own, "program"), language.has_groups);
        EXPECT_GT(wanted.size(), 40U);
        // Steps from where the robot then is: a trace has no robot, and VAL3 does not read them.
        const auto without_steps = [&](std::vector<Event>& all) {
          if (std::string(language.target) != "urscript" && std::string(language.target) != "val3")
            return std::size_t{0};
          return std::erase_if(all, [](const Event& e) {
            return e.kind <= Event::Kind::step && e.interpolation == RMP_MOVE_LIN;
          });
        };
        without_steps(wanted);
        const auto posted = app().dispatch(session_, "program.post",
                                           {{"id", both},
                                            {"only_robot", robot},
                                            {"profile", profile},
                                            {"robot", "puma560"},
                                            {"form", form},
                                            {"folder", folder.string()}});
        if (!posted.ok()) {
          // What stands in the way is not that it is of one robot.
          EXPECT_EQ(std::string(form), "structured");
          EXPECT_NE(posted.error().sentence().find("MELFA-BASIC"), std::string::npos)
              << posted.error().sentence();
          EXPECT_NE(posted.error().sentence().find("no values in messages"), std::string::npos)
              << posted.error().sentence();
          continue;
        }
        const std::string file = *at(at(*posted, "files").as_list()->at(0), "path").as_string();
        const Value back = call(
            "program.import",
            {{"file", file}, {"language", language.reader}, {"name", "back" + std::to_string(n)}});
        auto got = trace_of(back, language.has_groups);
        without_steps(got);
        Signals signals(language.is_named);
        std::string all;
        for (const Event& e : got) all += e.text() + "\n";
        ASSERT_EQ(wanted.size(), got.size()) << all;
        for (std::size_t k = 0; k < got.size(); ++k)
          EXPECT_TRUE(same(wanted[k], got[k], signals)) << wanted[k].text() << got[k].text();
      }
}

/// What a controller of several robots gets, read back, in a world where what its tasks share are
/// signals.
TEST_F(Parts, TasksOfOneControllerShareVariablesAndDoTheSame) {
  const Value both = made("both", two_robots());
  new_world("whole", {"left_gripper", "right_gripper"}, {});
  add(both);
  const RecordingPtr whole = run();
  ASSERT_TRUE(whole);
  for (const std::string form : {"structured", "flat"}) {
    SCOPED_TRACE(form);
    const fs::path folder = folder_ / ("tasks" + form);
    fs::create_directories(folder);
    const Value posted = call("program.post", {{"id", both},
                                               {"target", "rapid"},
                                               {"robot", "ur5"},
                                               {"form", form},
                                               {"folder", folder.string()}});
    EXPECT_EQ(at(posted, "files").as_list()->size(), 2U);
    new_world("tasks" + form, {"left_gripper", "right_gripper"}, {});
    for (const std::string& s : kLines) call("world.add_signal", {{"id", cell_}, {"name", s}});
    for (const std::string robot : {"left", "right"}) {
      const fs::path file = folder / ("two_robots_" + robot + ".mod");
      std::ifstream in(file);
      std::ostringstream read;
      read << in.rdbuf();
      const std::string text = read.str();
      // Each task has its own tool and frame; what is shared has one name in both.
      EXPECT_NE(text.find("TASK PERS tooldata RmpTool"), std::string::npos);
      EXPECT_NE(text.find("TASK PERS wobjdata RmpFrame"), std::string::npos);
      for (const std::string& s : kLines)
        EXPECT_NE(text.find("  PERS bool " + s + ":=FALSE;\n"), std::string::npos) << text;
      const Value back =
          call("program.import",
               {{"file", file.string()}, {"name", robot + form}, {"language", "rapid"}});
      std::string irl = source_of(back), signals;
      for (const std::string& s : kLines) {
        const std::string as_read = "  BOOL: " + s + " := FALSE;\n";
        const auto k = irl.find(as_read);
        ASSERT_NE(k, std::string::npos) << irl;
        irl.erase(k, as_read.size());
        const bool is_set = irl.find("  " + s + " := ") != std::string::npos;
        signals += std::string(is_set ? "  OUTPUT" : "  INPUT") + " BOOL: " + s + " AT " +
                   std::to_string(50 + signals.size()) + ";\n";
      }
      irl.insert(irl.find("SIGNAL\n") + 7, signals);
      const Value files = call("program.files", {{"id", back}});
      call(
          "program.set_file",
          {{"id", back}, {"name", *at(files.as_list()->at(0), "name").as_string()}, {"text", irl}});
      add(back);
      call("program.bind", {{"id", back}, {"kind", "robot"}, {"to", robot}});
      call("program.bind", {{"id", back},
                            {"kind", "signal"},
                            {"name", robot == "left" ? "do3" : "do4"},
                            {"to", robot + "_gripper"}});
    }
    const RecordingPtr tasks = run();
    ASSERT_TRUE(tasks);
    // The same places, and grippers at the same times, 0.2 s later.
    for (const char* name : {"signal.left_gripper", "signal.right_gripper"}) {
      const auto times = [&](const RecordingPtr& r) {
        std::vector<double> out;
        const auto &t = column(r, "time"), &v = column(r, name);
        for (std::size_t i = 1; i < v.size(); ++i)
          if (v[i] != v[i - 1]) out.push_back(t[i]);
        return out;
      };
      const auto a = times(whole), b = times(tasks);
      ASSERT_EQ(a.size(), 6U);
      ASSERT_EQ(b.size(), 6U);
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a[i] + 0.2, b[i], 0.05) << name;
    }
    for (const char* joint : {"left.q1", "left.q3", "right.q2", "right.q5"})
      EXPECT_NEAR(column(whole, joint).back(), column(tasks, joint).back(), 2e-3) << joint;
    EXPECT_NEAR(column(whole, "time").back() + 0.2, column(tasks, "time").back(), 0.1);
  }
}

TEST_F(Parts, EveryTargetThatTakesOneRobotTakesThem) {
  call("robot.get", {{"name", "puma560"}});
  const Value both = made("both", two_robots());
  // Which say no, with the reason; each other posts both.
  const std::map<std::string, std::string> kNo{{"crcl", "CRCL has no WAIT FOR"}};
  std::size_t n = 0;
  std::string refusals;
  for (const char* target :
       {"as", "c", "crcl", "fanuc_tp", "gcode", "inform", "joint_trajectory", "krl", "melfa4",
        "melfa5", "movemaster", "pa10", "pacscript", "pdl2", "rapid", "urscript", "val3"})
    for (const char* robot : {"left", "right"}) {
      const auto r =
          app().dispatch(session_, "program.post",
                         {{"id", both},
                          {"only_robot", robot},
                          {"profile", controller("c" + std::to_string(++n), kLines, target)},
                          {"robot", "puma560"}});
      if (const auto no = kNo.find(target); no != kNo.end()) {
        ASSERT_FALSE(r.ok()) << target;
        EXPECT_NE(r.error().sentence().find(no->second), std::string::npos) << r.error().sentence();
        continue;
      }
      if (!r.ok())
        refusals += std::string(target) + " " + robot + ": " + r.error().sentence() + "\n";
      else EXPECT_FALSE(at(*r, "files").as_list()->empty()) << target;
    }
  EXPECT_EQ(refusals, "");
}

TEST_F(Parts, WhatIsLeftOutAndWhatElseCountsIsSaid) {
  const Value both = made("both", two_robots());
  const Value found = call("program.post", {{"id", both},
                                            {"only_robot", "right"},
                                            {"profile", controller("c", kLines)},
                                            {"robot", "ur5"}});
  EXPECT_EQ(*at(at(found, "files").as_list()->at(0), "name").as_string(), "TWO_ROBOTS_RIGHT.src");
  std::string all;
  for (const Value& f : *at(found, "faults").as_list())
    all += *at(f, "severity").as_string() + " " + at(f, "line").text() + " " +
           *at(f, "message").as_string() + "\n";
  for (const char* each :
       {"note 25 the part of right is posted, and the others are left out; of left are bring.",
        "note 54 RELEASE of table_free waits there while left has not acquired the previous one",
        "warning 67 HALT ends the part of right only.",
        "warning 64 the part has one process, take, and becomes a program without processes"})
    EXPECT_NE(all.find(each), std::string::npos) << each << "\n" << all;
  const Error e =
      fails("program.post", {{"id", both}, {"only_robot", "middle"}, {"target", "krl"}});
  EXPECT_NE(e.sentence().find("no robot \"middle\""), std::string::npos) << e.sentence();
  EXPECT_NE(e.sentence().find("left, right"), std::string::npos) << e.sentence();
}

TEST_F(Parts, TheOnlyRobotNeedNotBeNamed) {
  std::string one = program("", kGo, kGo);
  for (std::size_t k; (k = one.find(" ACT_ROB := left")) != std::string::npos;) one.erase(k, 16);
  for (std::size_t k; (k = one.find(" ACT_ROB := right")) != std::string::npos;) one.erase(k, 17);
  one.erase(one.find("  ROBOT right"), one.find("PROCEDURE go") - one.find("  ROBOT right"));
  const Value both = made("both", one);
  const std::string part = source_of(this->part(both, "left", Value()));
  for (const char* each : {"PROCESS make", "PROCESS use", "START make", "PROGRAM both;"})
    EXPECT_NE(part.find(each), std::string::npos) << part;
}

/// PDL2 is not read back: what the programs share is held against the program with lines, whose
/// words are the same but for the states of ports.
TEST_F(Parts, ProgramsOfArmsShareVariablesOfTheOneThatWritesThem) {
  const Value both = made("both", two_robots());
  List named, options;
  for (const std::string& s : kLines) named.emplace_back(Map{{"name", s}, {"target", s}});
  options.emplace_back(Map{{"name", "arm_right"}, {"value", "4"}});
  const auto record = [&](const char* name, List signals) {
    return call("record.create",
                {{"kind", "controller"},
                 {"name", name},
                 {"fields",
                  Map{{"target", "pdl2"}, {"signals", std::move(signals)}, {"options", options}}}});
  };
  const Value lines = record("lines", named), none = record("none", {});
  const Value shared = call("program.post", {{"id", both}, {"profile", none}, {"robot", "ur5"}});
  ASSERT_EQ(at(shared, "files").as_list()->size(), 2U);
  for (const std::size_t k : {0U, 1U}) {
    const std::string robot = k == 0 ? "left" : "right", other = k == 0 ? "right" : "left";
    const Value& file = at(shared, "files").as_list()->at(k);
    EXPECT_EQ(*at(file, "name").as_string(), "two_robots_" + robot + ".pdl");
    std::string text = *at(file, "text").as_string();
    for (const std::string& s : kLines) {
      const bool is_own =
          s == robot + "_starts" || text.find("  " + s + " := ") != std::string::npos;
      const std::string declared = "  " + s + " : BOOLEAN" + (is_own ? " (FALSE)" : "") +
                                   " EXPORTED FROM two_robots_" + (is_own ? robot : other) + "\n";
      const auto i = text.find(declared);
      ASSERT_NE(i, std::string::npos) << declared << text;
      text.erase(i, declared.size());
      for (const auto& [word, state] : {std::pair{"TRUE", "ON"}, std::pair{"FALSE", "OFF"}})
        for (std::size_t j; (j = text.find("  " + s + " := " + word)) != std::string::npos;)
          text.replace(j, s.size() + 6 + std::string(word).size(), "  " + s + " := " + state);
    }
    const std::string arm = k == 0 ? "1" : "4", head = " PROG_ARM = ";
    const auto i = text.find(head + arm + "\n");
    ASSERT_NE(i, std::string::npos) << text;
    text.replace(i, head.size() + 1, head + "1");
    // Each has a timer of its own.
    for (std::size_t j; (j = text.find("$TIMER[2]")) != std::string::npos;)
      text.replace(j, 9, "$TIMER[1]");
    const Value own =
        call("program.post",
             {{"id", both}, {"only_robot", robot}, {"profile", lines}, {"robot", "ur5"}});
    EXPECT_EQ(text, *at(at(own, "files").as_list()->at(0), "text").as_string());
  }
}

/// Whatever the two do when, each hands over to the other what the program did, in its order.
TEST_F(Parts, RandomHandOversKeepTheirOrderWhoeverIsSlower) {
  unsigned state = 7;
  std::string trail;
  const auto random = [&](unsigned n) {
    state = state * 1664525U + 1013904223U;
    return (state >> 8U) % n;
  };
  const auto wait = [&] {
    return "  WAIT " + std::to_string(random(4)) + "." + std::to_string(random(10)) + "5 SEC;\n";
  };
  for (int round = 0; round < 12; ++round) {
    // A chain of hand-overs in turn, with waits between, and numbers that go along.
    std::string left = kGo, right = kCome, declared = "VAR SEMAPHORE: to_left, to_right";
    const int steps = 3 + static_cast<int>(random(5));
    const bool has_first = random(2) == 1;
    if (has_first) declared += ", spare := 1";
    declared += ";\nINT: a, b; BOOL: even;\n";
    for (int k = 0; k < steps; ++k) {
      const std::string n = std::to_string(k);
      left += wait() + "  a := a + b + " + n + ";\n  even := a MOD 2 = 0;\n  WRITELN('left " + n +
              " ', a);\n  RELEASE(to_right);\n";
      if (random(2) == 1) left += wait();
      if (has_first && k < 2) left += "  ACQUIRE(spare);\n  WRITELN('left spare');\n";
      left += "  ACQUIRE(to_left);\n";
      right += "  ACQUIRE(to_right);\n" + wait() +
               "  b := b + a * 2;\n  IF even THEN b := b + 1; " + "ENDIF;\n  WRITELN('right " + n +
               " ', b);\n";
      if (has_first && k == 1) right += "  RELEASE(spare);\n";
      right += "  RELEASE(to_left);\n";
    }
    const std::string source = program(declared, left, right);
    const Value both = made("random" + std::to_string(round), source);
    new_world("whole" + std::to_string(round), {}, {});
    add(both);
    const RecordingPtr whole = run();
    ASSERT_TRUE(whole) << source;
    std::vector<std::string> digital{"left_starts",
                                     "right_starts",
                                     "to_left_released",
                                     "to_left_acquired",
                                     "to_right_released",
                                     "to_right_acquired",
                                     "even"};
    if (has_first) digital.insert(digital.end(), {"spare_released", "spare_acquired"});
    const RecordingPtr parts = run_parts(both, digital, {"a", "b"}, round % 2, unchanged);
    ASSERT_TRUE(parts) << source;
    expect_later(texts(whole), texts(parts));
    ASSERT_GE(texts(whole).size(), 6U);
    for (const auto& [t, text] : texts(whole)) trail += text + ";";
  }
  EXPECT_GT(trail.size(), 1000U);
}

TEST_F(Parts, ProcessesThatDoMoreStayProcesses) {
  // Who looks at a button while the robot moves is no program that comes behind.
  const std::string source =
      program("SIGNAL INPUT BOOL: button AT 1; OUTPUT BOOL: lamp AT 2;\nVAR INT: n;\n",
              "  FOR i := 1 TO 3\n    " + kGo + "    n := n + 1;\n  ENDFOR;\n", kCome,
              "  WAIT FOR button OR n = 3;\n  lamp := TRUE;\n");
  const Value both = made("both", source);
  const std::string left = source_of(part(both, "left", Value()));
  EXPECT_NE(left.find("PROCESS make"), std::string::npos) << left;
  EXPECT_NE(left.find("START make"), std::string::npos) << left;
  EXPECT_EQ(left.find("PROCESS use"), std::string::npos) << left;
  EXPECT_EQ(refused(source, "right", {}), "posted");
  EXPECT_NE(refused(source, "left", {}).find("parallel processes"), std::string::npos)
      << refused(source, "left", {});
  const Value posted = call("program.post", {{"id", both},
                                             {"only_robot", "left"},
                                             {"target", "urscript"},
                                             {"form", "structured"},
                                             {"robot", "ur5"}});
  EXPECT_NE(at(at(posted, "files").as_list()->at(0), "text").as_string()->find("run make()"),
            std::string::npos);
}

TEST_F(Parts, WhatLinesCannotSayIsAnErrorAtItsLine) {
  const std::vector<std::string> all{"left_starts", "right_starts", "s_released", "s_acquired",
                                     "t_released",  "t_acquired",   "n",          "flag"};
  const std::string go = kGo, come = kCome;
  const struct {
    std::string source, robot, sentence;
    std::vector<std::string> lines;
  } cases[] = {
      {program("VAR SEMAPHORE: s;\n", go + "  RELEASE(s);\n", "  ACQUIRE(s);\n" + come),
       "left",
       "the semaphore s is released by left and acquired by right, which are two controllers, but "
       "no controller record defines lines between them",
       {}},
      {program("VAR SEMAPHORE: s;\n", go + "  RELEASE(s);\n", "  ACQUIRE(s);\n" + come),
       "left",
       "left and right wait for each other on two controllers, and the record",
       {"s_released", "s_acquired"}},
      {program("VAR SEMAPHORE: s := 1;\n", "  ACQUIRE(s);\n" + go + "  RELEASE(s);\n",
               "  ACQUIRE(s);\n" + come + "  RELEASE(s);\n"),
       "right", "the semaphore s is acquired by two controllers", all},
      {program("VAR SEMAPHORE: s := 2;\n", go + "  RELEASE(s);\n", "  ACQUIRE(s);\n" + come),
       "left",
       "the semaphore s begins with 2, but a line between two controllers can hold only one", all},
      {program("VAR INT: n;\n", go + "  n := 1;\n", "  n := 2;\n" + come), "left",
       "n is written by two controllers", all},
      {program("VAR REAL: n;\n", go + "  n := 1.0;\n", "  WAIT FOR n > 0.5;\n" + come), "right",
       "n is written by left and read by right, which are two controllers, and is not a BOOL", all},
      {program("SIGNAL OUTPUT BOOL: lamp AT 1;\n", go + "  lamp := TRUE;\n",
               "  lamp := FALSE;\n" + come),
       "left", "the output lamp is written by two controllers", all},
      {program("", go + "  R_SPEED := 50.0;\n", come), "right",
       "R_SPEED is set by left while right moves on another controller", all},
      {program("", go + come, come), "left",
       "the process make moves left and, here, right, each with its own controller", all},
      {program("", go + "  STOP use;\n", come), "left",
       "the process use is of right, and a controller cannot stop", all},
      {program("", go + "  IF GETSTATUS(use) = R_PROCESS_READY THEN HALT; ENDIF;\n", come), "left",
       "the process use is of right, and another controller cannot see its state", all},
      {program("VAR SEMAPHORE: s;\n", go + "  RELEASE(s);\n", come + "  ACQUIRE(s);\n",
               "  WAIT 1.0 SEC;\n") +
           "",
       "left", "posted", all},
      {program("VAR INT: s_phase, n; SEMAPHORE: s; INT: s_released;\n", go + "  RELEASE(s);\n",
               come + "  ACQUIRE(s);\n"),
       "left", "the line s_released has a name already used in the program", all},
      {program("", go, come, "  MOVE PTP MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);\n"), "left",
       "this motion names no robot, but the program has several", all},
  };
  for (const auto& c : cases) {
    const std::string found = refused(c.source, c.robot, c.lines);
    EXPECT_NE(found.find(c.sentence), std::string::npos) << found << "\nwanted: " << c.sentence;
    EXPECT_EQ(found.find("0: "), c.sentence == "posted" ? std::string::npos : found.find("0: "));
  }
}

}  // namespace
}  // namespace robomosp

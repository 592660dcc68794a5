// SPDX-License-Identifier: Apache-2.0
// What posted programs do, motion by motion, by readers of the tests' own: those of
// posted_programs.py for AS, PDL2, PacScript, INFORM, Movemaster and CRCL, libraries that write
// down what they are told for C and the PA-10. Equal to the interpreter's trace; damaged files not.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "motion/provider_params.h"
#include "program/trace.h"
#include "support/command_line.h"
#include "support/program.h"
#include "support/program_events.h"
#include "support/random_program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::Event;
using test::quoted;
using test::run;
using test::Said;

const fs::path kHere = fs::path(ROBOMOSP_SOURCE_DIR) / "tests/checkers";
const fs::path kLibrary = fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library/controllers";
constexpr double kDegree = 57.29577951308232;

std::string read(const fs::path& p) {
  std::ifstream in(p, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// One change of a file that a reader has to see; $01 in `by` is the first group.
struct Damage {
  const char *what, *pattern, *by;
  bool is_fault = false;  ///< the reader says that it is no program
};
/// What a language can say, and how exactly.
struct Dialect {
  const char *target, *profile, *robot;
  std::size_t posted;  ///< how many of the shipped programs, in both forms
  bool has_groups;     ///< an output of several bits is one
  double mm = 0.01, degrees = 0.01, seconds = 0.01;
  double speed = 0, share = 0;  ///< [mm/s], [%]: beside 1 %; -1 = it says none
  bool says_joint_share = true;
  bool has_chords = false;  ///< in place of arcs
  std::size_t random = 0;   ///< how many random programs are equal, at least
  std::vector<Damage> damages{};
};
const char* const kDigit = "a digit of a place";
const char* const kTurn = "a digit of a turn";
const char* const kJoint = "a digit of a joint";
const char* const kOutput = "an output is missing";
const char* const kWait = "another wait";
const char* const kSpeed = "another speed";
const char* const kKind = "another kind of motion";
const std::vector<Dialect>& dialects() {
  static const std::vector<Dialect> kAll = [] {
    std::vector<Dialect> all;
    Dialect l{"as", "kawasaki_e", "puma560", 8, false};
    l.random = 12;
    l.damages = {{kDigit, R"((\np\d+ -?\d+\.\d)0)", "$015"},
                 {kDigit, R"((_foot\[1\] = TRANS\(-?\d+\.\d)0)", "$015"},
                 {kTurn, R"((\np\d+(?: -?\d+\.\d+){3} -?\d+\.\d)0)", "$015"},
                 {kOutput, R"(\n *SIGNAL [^\n]*)", ""},
                 {kWait, R"((TWAIT 0\.)\d)", "$019"},
                 {kSpeed, R"((SPEED \d*)\d(\.\d+ MM/S))", "$019$02"},
                 {kKind, "LMOVE", "JMOVE"}};
    all.push_back(l);
    l = {"pdl2", "comau_c5g", "puma560", 8, true};
    l.random = 12;
    l.damages = {{kDigit, R"((POS\(-?[1-9]\d+\.\d)0)", "$015"},
                 {kTurn, R"((POS\((?:-?[1-9]\d+\.\d+, )(?:-?\d+\.\d+, ){2}-?\d+\.\d)0)", "$015"},
                 {kOutput, R"(\n *\$DOUT[^\n]*)", ""},
                 {kWait, R"((DELAY )\d(\d))", "$019$02"},
                 {kSpeed, R"((\$LIN_SPD = \d\.)\d)", "$019"},
                 {kKind, "MOVE LINEAR", "MOVE JOINT"}};
    all.push_back(l);
    l = {"pacscript", "denso_rc8", "puma560", 6, false};
    l.random = 8;
    l.damages = {{kDigit, R"((P\(-?[1-9]\d+\.\d)0)", "$015"},
                 {kTurn, R"((P\((?:-?[1-9]\d+\.\d+, )(?:-?\d+\.\d+, ){2}-?\d+\.\d)0)", "$015"},
                 {kOutput, R"(\n *(?:Set|Reset) IO[^\n]*)", ""},
                 {kWait, R"((Delay )\d(\d))", "$019$02"},
                 {kSpeed, R"((Move L.*Speed = \d*\.)\d)", "$019"},
                 {kKind, "Move L", "Move P"}};
    all.push_back(l);
    l = {"inform", "yaskawa_dx200", "puma560", 3, false};
    l.random = 6;
    l.damages = {{kDigit, R"((\nC\d+=-?\d+\.\d)0)", "$015"},
                 {kTurn, R"((\nC\d+=(?:-?\d+\.\d+,){3}-?\d+\.\d)0)", "$015"},
                 {kOutput, R"(\nDOUT [^\n]*)", ""},
                 {kWait, R"((TIMER T=0\.)\d)", "$019"},
                 {kSpeed, R"((V=\d*)\d(\.\d+ PL))", "$019$02"},
                 {kKind, "MOVL ([^\\n]*) V=", "MOVJ $01 VJ="}};
    all.push_back(l);
    l = {"movemaster", "mitsubishi_rv_m1", "puma560", 2, false};
    // It counts tenths, and has ten speeds.
    l.has_chords = true;
    l.mm = 0.0501, l.degrees = 0.1, l.seconds = 0.0501, l.speed = 55.6, l.share = 5.56;
    l.random = 0;  // hands out of the plane, mostly
    l.damages = {{kDigit, R"((PD \d+,-?\d+\.)\d)", "$019"},
                 {kTurn, R"((PD \d+(?:,-?\d+\.\d){4},-?\d+\.)\d)", "$019"},
                 {kTurn, R"((PD \d+(?:,-?\d+\.\d){3},-?\d+\.)\d)", "$019"},
                 {kOutput, R"(\n\d+ OB [^\n]*)", ""},
                 {kWait, R"((TI )\d)", "$019"},
                 {kSpeed, R"((SP )1)", "$013"},
                 {kKind, R"(MS (\d+),\d+)", "MO $01"}};
    all.push_back(l);
    l = {"crcl", "nist_crcl", "puma560", 2, true};
    l.says_joint_share = false;
    l.has_chords = true;
    l.random = 1;
    l.damages = {
        {kDigit, R"((<Y>-?\d+\.\d)\d)", "$015"},
        {kTurn, R"((<XAxis>\s*<I>-?\d\.\d+</I>\s*<J>-?\d\.\d\d)\d)", "$019", true},
        {kOutput,
         R"(<MiddleCommand xsi:type="SetRobotParametersType">(\s*<CommandID>\d+</CommandID>))"
         R"(\s*<ParameterSetting>[\s\S]*?</ParameterSetting>)",
         "<MiddleCommand xsi:type=\"MessageType\">$01<Message>on</Message>"},
        {kWait, R"((<DwellTime>0\.)\d)", "$019"},
        {kSpeed, R"((<Setting>1)\d)", "$019"},
        {kKind, "<MoveStraight>true", "<MoveStraight>false"}};
    all.push_back(l);
    l = {"c", "robomosp_c", "puma560", 8, true};
    l.random = 1;
    l.damages = {{kDigit, R"((rmp_lin\(rmp_placed\(rmp_at\(-?\d+\.)0)", "$015"},
                 {kTurn, R"((rmp_turned\(-?\d\.\d\d)\d)", "$019"},
                 {kOutput, R"(\n *rmp_output\([^\n]*)", ""},
                 {kWait, R"((rmp_wait\(0\.)\d)", "$019"},
                 {kSpeed, R"((rmp_lin\([^\n]*\(rmp_move\)\{\d*)\d(\.\d))", "$019$02"},
                 {kKind, "rmp_lin\\(", "rmp_ptp_pose("}};
    all.push_back(l);
    l = {"pa10", "mitsubishi_pa10", "pa10", 6, true};
    l.speed = l.share = -1;
    l.has_chords = true;
    l.random = 1;
    l.damages = {{kDigit, R"((rmp_lin\(rmp_placed\(rmp_at\(-?\d+\.)0)", "$015"},
                 {kTurn, R"((rmp_lin\([^\n]*rmp_turned\(-?\d\.\d\d)\d)", "$019"},
                 {kJoint, R"((rmp_joints\(\(const double\[\]\)\{-?\d+\.)\d)", "$019"},
                 {kOutput, R"(\n *rmp_output\([^\n]*)", ""},
                 {kWait, R"((rmp_wait\(0\.)\d)", "$019"}};
    all.push_back(l);
    return all;
  }();
  return kAll;
}

/// An event as a reader tells it: "?" of truth and a TIMEOUT of -2 are not known.
struct Told {
  Event event;
  std::string truth;
  double share = -1;
};
std::vector<std::string> fields(const std::string& line, char between) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string f; std::getline(in, f, between);)
    if (between != ' ' || !f.empty()) out.push_back(f);
  return out;
}
std::vector<Told> told(const std::string& said) {
  static const std::map<std::string, Event::Kind> kKinds{
      {"joints", Event::Kind::joints}, {"pose", Event::Kind::pose},
      {"step", Event::Kind::step},     {"output", Event::Kind::output},
      {"wait", Event::Kind::wait},     {"condition", Event::Kind::condition}};
  static const std::map<std::string, std::uint32_t> kMotions{{"-", RMP_MOVE_PTP},
                                                             {"ptp", RMP_MOVE_PTP},
                                                             {"lin", RMP_MOVE_LIN},
                                                             {"circle", RMP_MOVE_CIRCLE}};
  const auto number = [](const std::string& s) {
    return s == "-" ? -1.0 : std::strtod(s.c_str(), nullptr);
  };
  std::vector<Told> out;
  for (const std::string& l : fields(said, '\n')) {
    const std::vector<std::string> f = fields(l, ';');
    if (f.size() != 7 || !kKinds.contains(f[0]) || !kMotions.contains(f[1])) {
      ADD_FAILURE() << l;
      return out;
    }
    Told t;
    t.event.kind = kKinds.at(f[0]);
    t.event.interpolation = kMotions.at(f[1]);
    t.event.speed = number(f[2]);
    t.share = number(f[3]);
    for (const std::string& s : fields(f[4], ' ')) t.event.signals.push_back(std::stoi(s));
    t.truth = f[5];
    for (const std::string& s : fields(f[6], ' ')) t.event.numbers.push_back(number(s));
    out.push_back(std::move(t));
  }
  return out;
}

double apart(const Event& a, const Event& b) {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(a.numbers[k] - b.numbers[k]));
  return most;
}
double turned_apart(const Event& a, const Event& b) {
  double dot = 0, aa = 0, bb = 0;
  for (std::size_t k = 3; k < 7; ++k) {
    dot += a.numbers[k] * b.numbers[k];
    aa += a.numbers[k] * a.numbers[k];
    bb += b.numbers[k] * b.numbers[k];
  }
  return 2 * std::acos(std::min(1.0, std::fabs(dot) / std::sqrt(aa * bb))) * kDegree;
}
bool is_place(const Event& e) {
  return e.kind == Event::Kind::pose || e.kind == Event::Kind::position ||
         e.kind == Event::Kind::step;
}
/// What is not the same of two events; "" = nothing.
std::string unlike(const Dialect& l, const Event& a, const Told& told) {
  const Event& b = told.event;
  const bool is_same_kind =
      a.kind == b.kind || (a.kind == Event::Kind::position && b.kind == Event::Kind::pose);
  if (!is_same_kind) return "another kind";
  if (a.kind <= Event::Kind::step && a.interpolation != b.interpolation) return "another motion";
  if (a.kind <= Event::Kind::step) {
    if (a.speed >= 0 && l.speed >= 0 && !(std::fabs(a.speed - b.speed) <= 0.01 * a.speed + l.speed))
      return "another speed";
    const bool is_asked = a.share >= 0 && (l.says_joint_share || a.kind != Event::Kind::joints);
    if (is_asked && l.share >= 0 && !(std::fabs(a.share - told.share) <= 0.01 * a.share + l.share))
      return "another share of the speed";
  }
  if (a.signals != b.signals) return "other signals";
  if (a.truth.size() != told.truth.size()) return "another condition";
  for (std::size_t k = 0; k < a.truth.size(); ++k)
    if (told.truth[k] != '?' && (told.truth[k] == '1') != a.truth[k]) return "another condition";
  if (is_place(a)) {
    if (!(apart(a, b) <= l.mm)) return "another place";
    if (a.kind != Event::Kind::position && !(turned_apart(a, b) <= l.degrees))
      return "another orientation";
    return "";
  }
  if (a.kind == Event::Kind::condition && b.numbers.at(0) == -2) return "";
  if (b.numbers.size() < a.numbers.size()) return "too few numbers";
  for (std::size_t k = 0; k < b.numbers.size(); ++k)
    if (!(std::fabs((k < a.numbers.size() ? a.numbers[k] : 0) - b.numbers[k]) <=
          (a.kind == Event::Kind::joints   ? l.degrees
           : a.kind == Event::Kind::output ? 1e-9
                                           : l.seconds + 1e-9)))
      return a.kind == Event::Kind::joints ? "other joints" : "another number";
  return "";
}

struct Posted {
  std::string name, form, faults;
  std::vector<Event> events;
  std::vector<fs::path> files;
};

class PostedPrograms : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    fs::create_directories(folder_);
    // The programs have joints as the rows count them, some beyond the ranges of the maker's axes.
    call("robot.set_axes", {{"id", call("robot.get", {{"name", "puma560"}})}, {"axes", List{}}});
    call("robot.get", {{"name", "pa10"}});
  }
  static void TearDownTestSuite() {
    fs::remove_all(folder_);
    shipped_.clear();
    CommandTest::TearDownTestSuite();
  }

  /// Random programs have two inputs that their flow depends on.
  static bool asks_for_modes(const std::string& text) {
    return text.find("mode1") != std::string::npos;
  }
  /// Nothing where what the program does depends on what is not known.
  std::vector<Event> events_of(const std::string& text, bool has_groups) {
    auto language = app().registry.create<Language>("irl");
    const auto info = app().registry.find(Language::kInterfaceId, "irl");
    auto params = motion::checked_params(*info, {}, "irl");
    const std::vector<SourceFile> sources{{"p.irl", text, {}}};
    LanguageTask task;
    task.files = sources;
    class Silent final : public Progress {
     public:
      void report(double, std::string_view) override {}
      [[nodiscard]] bool cancelled() const override { return false; }
    } progress;
    auto made = (*language)->compile(task, **params, progress);
    EXPECT_TRUE(made.ok());
    program::TraceOptions options;
    if (asks_for_modes(text)) options.inputs = {{"mode1", {1, 1}}, {"mode2", {0, 0}}};
    auto t = program::trace(std::shared_ptr<const CompiledProgram>(std::move(*made)), options);
    return t.ok() ? test::events(*t, has_groups) : std::vector<Event>{};
  }
  std::optional<Posted> post(const Dialect& l, const std::string& name, const std::string& text,
                             const std::string& form) {
    Posted out{name, form, "", {}, {}};
    const fs::path folder = folder_ / (std::string(l.target) + "-" + form) / name;
    fs::create_directories(folder);
    const Value id = call("program.create", {{"name", name}, {"source", text}});
    Map args{{"id", id},
             {"target", l.target},
             {"form", form},
             {"robot", l.robot},
             {"profile", call("controller.get", {{"name", l.profile}})},
             {"folder", folder.string()}};
    if (asks_for_modes(text) && form == "flat")
      args.set("inputs", Map{{"mode1", true}, {"mode2", false}});
    auto r = app().dispatch(session_, "program.post", args);
    call("document.undo");
    if (!r.ok()) return std::nullopt;
    for (const Value& f : *at(*r, "files").as_list())
      out.files.emplace_back(*at(f, "path").as_string());
    for (const Value& f : *at(*r, "faults").as_list())
      out.faults += *at(f, "message").as_string() + "\n";
    out.events = events_of(text, l.has_groups);
    return out;
  }
  /// Every shipped program of one robot, in each form that the target takes; posted once for all
  /// tests. Those of several robots are several programs there (program_parts_test).
  const std::vector<Posted>& shipped(const Dialect& l) {
    std::vector<Posted>& out = shipped_[l.target];
    if (!out.empty()) return out;
    for (const char* name : {"hanoi", "pick_and_place", "palletising", "arc_weld"})
      for (const char* form : {"structured", "flat"}) {
        const std::string text =
            read(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs" / (std::string(name) + ".irl"));
        if (auto p = post(l, name, text, form)) out.push_back(std::move(*p));
      }
    return out;
  }
  static bool is_c(const Dialect& l) {
    return l.target == std::string("c") || l.target == std::string("pa10");
  }
  /// What the controller's record says that a reader needs.
  static std::string options(const Dialect& l) {
    const std::string record = read(kLibrary / (std::string(l.profile) + ".ctl"));
    std::smatch m;
    std::string out;
    if (std::regex_search(record, m, std::regex(R"(max_speed ([\d.]+))")))
      out += " max_speed=" + std::to_string(1000 * std::stod(m[1]));  // m/s in the record
    for (const char* name : {"speed", "roll"})
      if (std::regex_search(record, m,
                            std::regex(std::string("option ") + name + R"( \{ value "([^"]*))")))
        out += std::string(" ") + name + "=" + m[1].str();
    std::string pulses;
    const std::regex axis(R"(pulses (\d+) \})");
    for (std::sregex_iterator it(record.begin(), record.end(), axis), end; it != end; ++it)
      pulses += (pulses.empty() ? "" : ",") + (*it)[1].str();
    return out + (pulses.empty() ? "" : " pulses=" + pulses);
  }
  /// What readers make of each of the files; of C programs once with all inputs FALSE, once with
  /// all TRUE.
  static std::vector<std::vector<Said>> look(const Dialect& l, const std::vector<fs::path>& files) {
    std::vector<std::vector<Said>> out;
    if (is_c(l)) {
      for (const fs::path& f : files) out.push_back(recorded(l, f));
      return out;
    }
    std::string command =
        "/usr/bin/python3 " + quoted(kHere / "posted_programs.py") + " " + l.target + options(l);
    for (const fs::path& f : files) command += " " + quoted(f);
    const Said all = run(command);
    // "==== code" stands before what is said of each.
    for (const std::string& line : fields(all.text, '\n')) {
      if (line.starts_with("==== ")) out.push_back({{std::stoi(line.substr(5)), ""}});
      else if (!out.empty()) out.back()[0].text += line + "\n";
    }
    EXPECT_EQ(out.size(), files.size()) << all.text;
    out.resize(files.size(), {all});
    return out;
  }
  static std::vector<Said> recorded(const Dialect& l, const fs::path& main) {
    const bool is_pa10 = l.target == std::string("pa10");
    const fs::path in = main.parent_path(), program = in / "recorded",
                   library = folder_ / (std::string(l.target) + ".so");
    const std::string cc = "cc -std=c99 -pedantic -Wall -Wextra -Werror -O0 -fPIC -I" +
                           quoted(kHere) + " -I" + quoted(kHere / "pa10") + " -I" + quoted(in) +
                           " ";
    // What stands beside each program is the same for all.
    if (!fs::exists(library)) {
      const Said made = run(cc + "-shared " + quoted(in / "rmp_motion.c") + " " +
                            (is_pa10 ? quoted(in / "rmp_pa10.c") + " " : "") +
                            quoted(kHere / (is_pa10 ? "record_pa10.c" : "record_motion.c")) +
                            " -lm -o " + quoted(library));
      if (made.code != 0) return {made};
    }
    const Said made = run(cc + quoted(main) + " " + quoted(library) + " -lm -o " + quoted(program));
    if (made.code != 0) return {made};
    // What is written down goes to the errors; what the program says is not looked at.
    const std::string to = " 2>&1 >/dev/null";
    return {run("RECORD_INPUTS=0 " + quoted(program) + to),
            run("RECORD_INPUTS=1 " + quoted(program) + to)};
  }
  /// Pose of a robot's tip at joints [degrees]: x y z [mm] and the quaternion.
  std::vector<double> tip(const char* robot, const std::vector<double>& joints) {
    List q;
    for (const double x : joints) q.emplace_back(x / kDegree);
    const Value r = call("robot.fk", {{"id", robot}, {"q", q}});
    std::vector<double> out;
    for (std::size_t k = 0; k < 3; ++k) out.push_back((*at(r, "position").as_array())[k] * 1000);
    for (std::size_t k = 0; k < 4; ++k) out.push_back((*at(r, "quaternion").as_array())[k]);
    return out;
  }
  /// What differs between a program and what one run of a reader tells; "" = nothing. An arc may
  /// be chords. The library of the PA-10 moves to joints and straight to poses: a PTP to a pose is
  /// the joints that lead there, or straight where the post has said so.
  std::string difference(const Dialect& l, const Posted& p, const std::vector<Told>& got) {
    std::size_t k = 0;
    std::vector<double> here;
    for (std::size_t i = 0; i < p.events.size(); ++i) {
      const Event& e = p.events[i];
      const auto text = [&](const std::string& what) {
        return what + ", " + std::to_string(k) + ": " + e.text() + " | " +
               (k < got.size() ? got[k].event.text() : "end");
      };
      if (k >= got.size()) return text("too few");
      const bool is_pose = e.kind == Event::Kind::pose;
      if (l.target == std::string("pa10") && is_pose && e.interpolation == RMP_MOVE_PTP) {
        Event there = got[k].event;
        if (there.kind == Event::Kind::joints) there.numbers = tip(l.robot, there.numbers);
        else if (there.kind != Event::Kind::pose) return text("another kind");
        else if (p.faults.find("straight line") == std::string::npos)
          return text("straight, unsaid");
        if (!(apart(e, there) <= l.mm && turned_apart(e, there) <= l.degrees))
          return text("another place");
        ++k;
      } else if (is_pose && e.interpolation == RMP_MOVE_CIRCLE && l.has_chords) {
        if (here.empty()) return text("a circle begins nowhere");
        const Event& end = p.events.at(++i);
        std::size_t chords = 1;
        for (;; ++k, ++chords) {
          if (k >= got.size() || got[k].event.kind != Event::Kind::pose) return text("no arc");
          const Event& at = got[k].event;
          if (!test::is_on_arc(here.data(), e.numbers.data(), end.numbers.data(), at.numbers.data(),
                               2 * l.mm))
            return text("beside the arc");
          if (apart(end, at) <= l.mm && turned_apart(end, at) <= l.degrees) break;
        }
        if (chords < 3) return text("few chords");
        ++k;
        here = end.numbers;
        continue;
      } else {
        if (const std::string what = unlike(l, e, got[k]); !what.empty()) return text(what);
        ++k;
      }
      if (is_place(e)) here = e.numbers;
    }
    return k == got.size() ? "" : "more: " + got[k].event.text();
  }
  std::string difference(const Dialect& l, const Posted& p, const std::vector<Said>& said) {
    for (const Said& s : said) {
      if (s.code != 0) return "the reader says: " + s.text;
      if (std::string what = difference(l, p, told(s.text)); !what.empty()) return what;
    }
    return "";
  }
  /// "" = each damage of the file is seen; which kinds there were is added to `done`.
  std::string unseen(const Dialect& l, const Posted& p, std::set<std::string>& done) {
    const std::string good = read(p.files[0]);
    std::vector<fs::path> files;
    std::vector<const Damage*> damages;
    for (const Damage& d : l.damages) {
      const std::string bad = std::regex_replace(good, std::regex(d.pattern), d.by,
                                                 std::regex_constants::format_first_only);
      if (bad == good) continue;
      files.push_back(p.files[0].parent_path() /
                      ("damaged" + std::to_string(files.size()) + p.files[0].extension().string()));
      std::ofstream(files.back(), std::ios::binary) << bad;
      damages.push_back(&d);
      done.insert(d.what);
    }
    const auto said = look(l, files);
    for (std::size_t k = 0; k < files.size(); ++k) {
      // A file that is refused would be seen as well; here the readers have to take it.
      for (const Said& s : said[k])
        if ((s.code != 0) != damages[k]->is_fault)
          return std::string(damages[k]->what) + ": " + s.text;
      if (difference(l, p, said[k]).empty()) return damages[k]->what;
    }
    return "";
  }
  static bool has(const Dialect& l) {
    return run(is_c(l) ? "cc --version" : "/usr/bin/python3 --version").code == 0;
  }
  inline static const fs::path folder_ =
      fs::temp_directory_path() / ("posted-" + std::to_string(::getpid()));
  inline static std::map<std::string, std::vector<Posted>> shipped_;
};

TEST_F(PostedPrograms, ShippedProgramsDoWhatTheInterpreterDoesInEightLanguages) {
  std::string missing;
  for (const Dialect& l : dialects()) {
    if (!has(l)) {
      missing += std::string(" ") + l.target;
      continue;
    }
    std::size_t events = 0;
    const std::vector<Posted>& all = shipped(l);
    EXPECT_EQ(all.size(), l.posted) << l.target;
    for (const Posted& p : all) {
      EXPECT_GT(p.events.size(), 5U) << p.name;
      EXPECT_EQ(difference(l, p, look(l, {p.files[0]})[0]), "")
          << l.target << " " << p.name << " " << p.form << "\n"
          << read(p.files[0]);
      events += p.events.size();
    }
    std::cout << l.target << ": " << all.size() << " programs, " << events << " events\n";
  }
  if (!missing.empty())
    GTEST_SKIP() << "not looked at:" << missing << "; install python3 and build-essential";
}

TEST_F(PostedPrograms, OneDigitOrOneLineThatIsWrongIsSeen) {
  for (const Dialect& l : dialects()) {
    if (!has(l)) continue;
    std::set<std::string> done, wanted;
    for (const Damage& d : l.damages) wanted.insert(d.what);
    for (const Posted& p : shipped(l)) {
      // Of C programs, which are compiled for each, one is enough.
      if (is_c(l) && (p.name != "arc_weld" || p.form != "flat")) continue;
      EXPECT_EQ(unseen(l, p, done), "") << l.target << " " << p.name << " " << p.form;
    }
    EXPECT_EQ(done, wanted) << l.target;
  }
}

/// Hands of all pitches and rolls, in the plane through the waist, where random ones hardly are.
TEST_F(PostedPrograms, HandsOfFiveAxesDoTheSame) {
  std::string text = "PROGRAM hands;\nBEGIN\n";
  for (int k = 0; k < 12; ++k) {
    const double waist = -50 + 9.5 * k, pitch = 95 + 7.25 * k, roll = -170 + 29.3 * k;
    const double r = 420 + 7.5 * k, z = 260.5 - 4.25 * k;
    // The hand's z leans from upwards by pitch in the plane; roll turns about it.
    std::ostringstream line;
    line << std::fixed << "  MOVE " << (k % 2 == 0 ? "PTP" : "LIN") << " POSE(POSITION("
         << r * std::cos(waist / kDegree) << ", " << r * std::sin(waist / kDegree) << ", " << z
         << "), ORIZYZ2(" << waist << ", " << pitch << ", " << roll << "));\n";
    text += line.str();
  }
  text += "ENDPROGRAM;\n";
  for (const Dialect& l : dialects()) {
    if (!has(l) || is_c(l)) continue;
    const auto p = post(l, "hands", text, "flat");
    ASSERT_TRUE(p) << l.target;
    EXPECT_EQ(p->events.size(), 12U);
    EXPECT_EQ(difference(l, *p, look(l, {p->files[0]})[0]), "") << l.target << "\n"
                                                                << text << read(p->files[0]);
  }
}

/// The table of signs; the lamp goes on as often as the number says. Loops ask a function, too.
TEST_F(PostedPrograms, DivAndModGoTowardsZeroAndLoopsAskFunctions) {
  const std::string text =
      "PROGRAM signs;\nSIGNAL OUTPUT BOOL: lamp AT 1;\nOUTPUT BOOL: bell AT 2;\n"
      "VAR ARRAY [1..8] OF INT: a := [7, -7, 7, -7, 1, -1, 6, -6];\n"
      "ARRAY [1..8] OF INT: b := [2, 2, -2, -2, 3, 3, -3, -3];\nINT: i, k, x;\n"
      "FUNCTION below (IN INT: p; IN INT: q): BOOL;\nBEGIN\n  RETURN p DIV 2 < q;\nENDFCT;\n"
      "BEGIN\n  MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 60.0, 0.0);\n"
      "  WHILE below(i, 3) DO\n    i := i + 1;\n    lamp := TRUE;\n    lamp := FALSE;\n  "
      "ENDWHILE;\n"
      "  REPEAT\n    i := i - 1;\n    lamp := TRUE;\n    lamp := FALSE;\n"
      "  UNTIL i < 9 AND below(i, -1);\n"
      "  FOR i := 1 TO 8\n    x := 9 + a[i] DIV b[i];\n"
      "    FOR k := 1 TO x\n      lamp := TRUE;\n      lamp := FALSE;\n    ENDFOR;\n"
      "    bell := TRUE;\n    x := 9 + (a[i] - 20) DIV b[i] DIV 2 + a[i] MOD b[i];\n"
      "    FOR k := 1 TO x\n      lamp := TRUE;\n      lamp := FALSE;\n    ENDFOR;\n"
      "    bell := FALSE;\n  ENDFOR;\nENDPROGRAM;\n";
  std::set<std::string> done;
  for (const Dialect& l : dialects()) {
    if (!has(l) || is_c(l)) continue;
    const auto p = post(l, "signs", text, "structured");
    if (!p) continue;
    EXPECT_GT(p->events.size(), 100U);
    EXPECT_EQ(difference(l, *p, look(l, {p->files[0]})[0]), "") << l.target << "\n"
                                                                << read(p->files[0]);
    done.insert(l.target);
  }
  EXPECT_TRUE(done.contains("as"));
  EXPECT_TRUE(done.contains("pdl2"));
}

/// How many random programs are posted to each target: ROBOMOSP_RANDOM_PROGRAMS.
std::uint32_t random_programs() {
  const char* given = std::getenv("ROBOMOSP_RANDOM_PROGRAMS");
  return given ? static_cast<std::uint32_t>(std::atoi(given)) : 40;
}

/// Turns about three axes, joints, circles, frames, tools, groups of bits, conditions that are
/// negated: what the shipped programs have none of.
TEST_F(PostedPrograms, RandomProgramsDoTheSame) {
  for (const Dialect& l : dialects()) {
    if (!has(l)) continue;
    const std::uint32_t programs = is_c(l) ? random_programs() / 8 : random_programs();
    std::size_t equal = 0, refused = 0, events = 0;
    std::map<std::string, std::size_t> unread;
    std::vector<Posted> all;
    std::vector<fs::path> files;
    std::vector<std::string> texts;
    for (std::uint32_t k = 0; k < programs; ++k) {
      const std::string text = test::RandomProgram(k).text();
      // The order of processes is the controller's; curves are chords, which are not looked at.
      if (text.find("PROCESS ") != std::string::npos || text.find("MOVE PATH") != std::string::npos)
        continue;
      for (const char* form : {"structured", "flat"}) {
        auto p = post(l, "rnd" + std::to_string(k), text, form);
        if (!p || p->events.empty()) {
          ++refused;
          continue;
        }
        files.push_back(p->files[0]);
        all.push_back(std::move(*p));
        texts.push_back(text);
      }
    }
    const auto said = look(l, files);
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (said[k][0].code != 0) {
        ++unread[said[k][0].text.substr(said[k][0].text.find(": ") + 2)];
        continue;
      }
      const std::string what = difference(l, all[k], said[k]);
      EXPECT_EQ(what, "") << l.target << " " << all[k].name << " " << all[k].form << "\n"
                          << texts[k] << read(files[k]);
      equal += what.empty();
      events += all[k].events.size();
    }
    std::cout << l.target << ": " << equal << " equal, " << events << " events, " << refused
              << " refused\n";
    for (const auto& [sentence, n] : unread) std::cout << "  not read, " << n << ": " << sentence;
    EXPECT_GE(equal * 40, l.random * random_programs()) << l.target;
  }
}

}  // namespace
}  // namespace robomosp

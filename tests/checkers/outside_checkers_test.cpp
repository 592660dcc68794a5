// SPDX-License-Identifier: Apache-2.0
// Posted programs before checkers that others have written: an interpreter of G-code, the colours
// of KRL in Vim, messages of ROS, xmllint, the C compiler. Shipped and random programs; wrong
// files, so that each checker is known to object.
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
#include <sstream>
#include <string>
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

/// How many random programs go through the interpreter of G-code: ROBOMOSP_RANDOM_PROGRAMS.
int random_programs() {
  const char* given = std::getenv("ROBOMOSP_RANDOM_PROGRAMS");
  return given ? std::atoi(given) : 160;
}

struct Posted {
  std::string name;
  std::vector<Event> events;  ///< of the program
  std::vector<fs::path> files;
};

class OutsideCheckers : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    fs::create_directories(folder_);
    call("robot.get", {{"name", "puma560"}});
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string shipped(const char* name) {
    std::ifstream in(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs" /
                     (std::string(name) + ".irl"));
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  /// The shipped programs and `random` random ones, posted where the target takes them.
  std::vector<Posted> posted(const std::string& target, const std::string& form, int random,
                             const std::string& profile = "") {
    std::vector<std::pair<std::string, std::string>> sources;
    for (const char* name : {"hanoi", "pick_and_place", "palletising", "arc_weld"})
      sources.emplace_back(name, shipped(name));
    for (int k = 0; k < random; ++k)
      sources.emplace_back("rnd" + std::to_string(k),
                           test::RandomProgram(static_cast<std::uint32_t>(k)).text());
    std::vector<Posted> all;
    for (const auto& [name, text] : sources) {
      Posted out;
      out.name = name;
      const fs::path folder = folder_ / (target + form) / name;
      fs::create_directories(folder);
      const Value id = call("program.create", {{"name", name}, {"source", text}});
      Map args{{"id", id},
               {"target", target},
               {"form", form},
               {"robot", "puma560"},
               {"name", "prog" + std::to_string(all.size())},
               {"folder", folder.string()}};
      if (!profile.empty()) args.set("profile", call("controller.get", {{"name", profile}}));
      if (text.find("mode1") != std::string::npos && form == "flat")
        args.set("inputs", Map{{"mode1", true}, {"mode2", false}});
      const auto r = app().dispatch(session_, "program.post", args);
      call("document.undo");
      if (!r.ok()) continue;
      for (const Value& f : *at(*r, "files").as_list())
        out.files.push_back(*at(f, "path").as_string());
      out.events = events_of(text);
      all.push_back(std::move(out));
    }
    return all;
  }
  std::vector<Event> events_of(const std::string& text) {
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
    if (text.find("mode1") != std::string::npos)
      options.inputs = {{"mode1", {1, 1}}, {"mode2", {0, 0}}};
    auto t = program::trace(std::shared_ptr<const CompiledProgram>(std::move(*made)), options);
    return t.ok() ? test::events(*t, false) : std::vector<Event>{};
  }
  fs::path folder_ = fs::temp_directory_path() / ("checkers-" + std::to_string(::getpid()));
};

// ---- G-code: rs274 of LinuxCNC ----

/// The command line of the interpreter, or "".
std::string rs274() {
  if (run("command -v rs274").code == 0) return "rs274";
  const fs::path root = ROBOMOSP_CHECKERS_DIR;
  const fs::path program = root / "usr/bin/rs274";
  if (!fs::exists(program)) return "";
  return "LD_LIBRARY_PATH=" + quoted(root / "usr/lib") + ":" +
         quoted(root / "usr/lib/x86_64-linux-gnu") + " " + quoted(program);
}
/// What the machine does, by the interpreter: places [mm], turns [degrees], feed [mm/min].
struct Canonical {
  enum class Kind { rapid, line, arc, on, off, dwell } kind = Kind::line;
  std::array<double, 3> end{};
  std::array<double, 3> turns{};
  std::array<double, 3> centre{};            ///< of an arc: the two of its plane
  std::array<std::size_t, 3> axes{0, 1, 2};  ///< of an arc: first and second of its plane, the rest
  int sense = 1;
  double feed = 0, value = 0;
};
std::vector<double> numbers_of(const std::string& s) {
  std::vector<double> out;
  std::istringstream in(s);
  for (std::string word; std::getline(in, word, ',');)
    out.push_back(std::strtod(word.c_str(), nullptr));
  return out;
}
std::vector<Canonical> canonical(const std::string& said) {
  std::vector<Canonical> out;
  std::istringstream in(said);
  double feed = 0;
  std::array<std::size_t, 3> axes{0, 1, 2};
  for (std::string l; std::getline(in, l);) {
    const std::size_t open = l.find('(');
    std::size_t begin = l.rfind(' ', open);
    if (open == std::string::npos || begin == std::string::npos) continue;
    const std::string word = l.substr(begin + 1, open - begin - 1);
    const std::string inside = l.substr(open + 1, l.rfind(')') - open - 1);
    const std::vector<double> n = numbers_of(inside);
    Canonical c;
    c.feed = feed;
    if (word == "SET_FEED_RATE") feed = n.at(0);
    else if (word == "SELECT_PLANE")
      axes = inside == "CANON_PLANE_XY"   ? std::array<std::size_t, 3>{0, 1, 2}
             : inside == "CANON_PLANE_XZ" ? std::array<std::size_t, 3>{2, 0, 1}
                                          : std::array<std::size_t, 3>{1, 2, 0};
    else if (word == "STRAIGHT_TRAVERSE" || word == "STRAIGHT_FEED") {
      c.kind = word == "STRAIGHT_FEED" ? Canonical::Kind::line : Canonical::Kind::rapid;
      for (std::size_t k = 0; k < 3; ++k) c.end[k] = n.at(k), c.turns[k] = n.at(3 + k);
      out.push_back(c);
    } else if (word == "ARC_FEED") {
      c.kind = Canonical::Kind::arc;
      c.axes = axes;
      c.end[axes[0]] = n.at(0);
      c.end[axes[1]] = n.at(1);
      c.centre[axes[0]] = n.at(2);
      c.centre[axes[1]] = n.at(3);
      c.sense = n.at(4) > 0 ? 1 : -1;
      c.end[axes[2]] = n.at(5);
      for (std::size_t k = 0; k < 3; ++k) c.turns[k] = n.at(6 + k);
      out.push_back(c);
    } else if (word == "SET_AUX_OUTPUT_BIT" || word == "CLEAR_AUX_OUTPUT_BIT") {
      c.kind = word[0] == 'S' ? Canonical::Kind::on : Canonical::Kind::off;
      c.value = n.at(0);
      out.push_back(c);
    } else if (word == "DWELL") {
      c.kind = Canonical::Kind::dwell;
      c.value = n.at(0);
      out.push_back(c);
    }
  }
  return out;
}
using Q = std::array<double, 4>;
Q times(const Q& a, const Q& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
double apart(const std::array<double, 3>& a, const double* b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}
using Place = std::array<double, 3>;
/// Turns A, B, C about fixed x, y, z [degrees] as w, x, y, z.
Q turned(const Place& abc) {
  Q all{1, 0, 0, 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Q one{std::cos(abc[axis] * M_PI / 360), 0, 0, 0};
    one[axis + 1] = std::sin(abc[axis] * M_PI / 360);
    all = times(one, all);
  }
  return all;
}
/// Degrees between turns A, B, C about fixed x, y, z and a quaternion.
double turned_apart(const Place& abc, const double* q) {
  const Q all = turned(abc);
  double dot = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += all[k] * q[k];
  return 2 * std::acos(std::min(1.0, std::fabs(dot))) * 180 / M_PI;
}
/// The same between two such turns.
double turned_apart(const Place& a, const Place& b) {
  const Q q = turned(b);
  return turned_apart(a, q.data());
}
/// The natural cubic spline through places by their distances: what MOVE PATH means. Its second
/// derivatives solve one system of equations, here by elimination over the whole matrix.
class Spline {
 public:
  explicit Spline(std::vector<Place> through) : through_(std::move(through)) {
    const std::size_t n = through_.size();
    for (std::size_t i = 1; i < n; ++i) way_.push_back(apart(through_[i], through_[i - 1].data()));
    std::vector<std::vector<double>> rows(n, std::vector<double>(n + 3, 0.0));
    for (std::size_t i = 0; i < n; ++i) {
      rows[i][i] = 1;
      if (i == 0 || i + 1 == n) continue;
      rows[i][i - 1] = way_[i - 1] / 6;
      rows[i][i] = (way_[i - 1] + way_[i]) / 3;
      rows[i][i + 1] = way_[i] / 6;
      for (std::size_t k = 0; k < 3; ++k)
        rows[i][n + k] = (through_[i + 1][k] - through_[i][k]) / way_[i] -
                         (through_[i][k] - through_[i - 1][k]) / way_[i - 1];
    }
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        if (j == i || rows[j][i] == 0) continue;
        const double f = rows[j][i] / rows[i][i];
        for (std::size_t k = 0; k < n + 3; ++k) rows[j][k] -= f * rows[i][k];
      }
    for (std::size_t i = 0; i < n; ++i)
      second_.push_back(
          {rows[i][n] / rows[i][i], rows[i][n + 1] / rows[i][i], rows[i][n + 2] / rows[i][i]});
  }
  [[nodiscard]] std::size_t pieces() const { return way_.size(); }
  /// At u = i + t of the piece i, 0 <= t <= 1.
  [[nodiscard]] Place at(double u) const {
    const std::size_t i = std::min(static_cast<std::size_t>(u), way_.size() - 1);
    const double t = u - static_cast<double>(i), s = 1 - t, h = way_[i] * way_[i] / 6;
    Place p{};
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = s * through_[i][k] + t * through_[i + 1][k] +
             h * ((s * s * s - s) * second_[i][k] + (t * t * t - t) * second_[i + 1][k]);
    return p;
  }
  /// Distance [mm] of a place to the part from `from` on to the end of its piece.
  [[nodiscard]] double distance(const Place& p, double from) const {
    const double to = std::floor(from) + 1;
    double best = 1e300, where = from;
    constexpr int kSteps = 400;
    for (int k = 0; k <= kSteps; ++k) {
      const double u = from + (to - from) * k / kSteps;
      if (const double d = apart(at(u), p.data()); d < best) best = d, where = u;
    }
    double a = std::max(from, where - (to - from) / kSteps),
           b = std::min(to, where + (to - from) / kSteps);
    for (int k = 0; k < 60; ++k) {
      const double c = a + (b - a) / 3, d = b - (b - a) / 3;
      if (apart(at(c), p.data()) < apart(at(d), p.data())) b = d;
      else a = c;
    }
    return std::min(best, apart(at(a), p.data()));
  }

 private:
  std::vector<Place> through_, second_;
  std::vector<double> way_;
};
constexpr double kChord = 0.01;  ///< [mm], the option chord_mm of linuxcnc_abc
/// Holds what the interpreter does against what the program does; "" = the same. Counts paths.
std::string difference(const std::vector<Event>& events, const std::vector<Canonical>& all,
                       std::size_t& paths) {
  std::size_t at = 0;
  std::array<double, 3> here{}, here_turns{};
  const auto text = [&](const Event& e, const std::string& what) {
    return e.text() + ": " + what + ", command " + std::to_string(at) + " of " +
           std::to_string(all.size());
  };
  const auto moves = [&](Canonical::Kind k) {
    return k == Canonical::Kind::rapid || k == Canonical::Kind::line || k == Canonical::Kind::arc;
  };
  for (std::size_t k = 0; k < events.size(); ++k) {
    const Event& e = events[k];
    switch (e.kind) {
      case Event::Kind::joints: return text(e, "joints");
      case Event::Kind::step: return text(e, "a step from where nobody knows");
      case Event::Kind::condition: break;  // M66 is no command of the machine
      case Event::Kind::wait:
        if (at >= all.size() || all[at].kind != Canonical::Kind::dwell ||
            std::fabs(all[at].value - e.numbers[0]) > 0.01)
          return text(e, "no dwell");
        ++at;
        break;
      case Event::Kind::output: {
        const auto wanted = e.numbers[0] != 0 ? Canonical::Kind::on : Canonical::Kind::off;
        if (at >= all.size() || all[at].kind != wanted || all[at].value != e.signals[0])
          return text(e, "another output");
        ++at;
        break;
      }
      case Event::Kind::pose:
      case Event::Kind::position: {
        const bool has_pose = e.kind == Event::Kind::pose;
        if (e.interpolation == RMP_MOVE_CIRCLE) {
          // The place on the way, then the end: an arc, or chords on the circle.
          const Event& last = events[++k];
          const auto [centre, radius] =
              test::circle(here.data(), e.numbers.data(), last.numbers.data());
          bool is_there = false;
          while (!is_there) {
            if (at >= all.size() || !moves(all[at].kind)) return text(e, "the arc ends early");
            const Canonical& c = all[at++];
            if (std::fabs(apart(centre, c.end.data()) - radius) > 0.02)
              return text(e, "beside the circle");
            if (c.kind == Canonical::Kind::arc) {
              for (const std::size_t axis : {c.axes[0], c.axes[1]})
                if (std::fabs(c.centre[axis] - centre[axis]) > 0.02)
                  return text(e, "another centre");
              // From here by the sense of the arc the place on the way comes before the end.
              const auto angle = [&](const double* p) {
                const double a =
                    std::atan2(p[c.axes[1]] - centre[c.axes[1]], p[c.axes[0]] - centre[c.axes[0]]);
                const double from = std::atan2(here[c.axes[1]] - centre[c.axes[1]],
                                               here[c.axes[0]] - centre[c.axes[0]]);
                const double d = c.sense * (a - from);
                return d - 2 * M_PI * std::floor(d / (2 * M_PI));
              };
              if (angle(e.numbers.data()) > angle(last.numbers.data()))
                return text(e, "the other way round");
            }
            if (last.speed > 0 && std::fabs(c.feed / 60 - last.speed) > 0.01)
              return text(last, "feed " + std::to_string(c.feed));
            is_there = apart(c.end, last.numbers.data()) < test::kMm;
          }
          here = {last.numbers[0], last.numbers[1], last.numbers[2]};
          here_turns = all[at - 1].turns;
          break;
        }
        if (e.interpolation == RMP_MOVE_PATH) {
          // Straight pieces, their ends on the curve and their middles near it.
          std::vector<const Event*> targets{&e};
          while (k + 1 < events.size() && events[k + 1].interpolation == RMP_MOVE_PATH &&
                 events[k + 1].target == targets.size())
            targets.push_back(&events[++k]);
          std::vector<Place> through{here};
          std::vector<const Event*> ends;
          for (const Event* t : targets) {
            const Place p{t->numbers[0], t->numbers[1], t->numbers[2]};
            if (apart(through.back(), p.data()) <= 1e-6) continue;
            through.push_back(p);
            ends.push_back(t);
          }
          if (ends.empty()) return text(e, "a path without a length");
          const Spline curve(through);
          for (std::size_t piece = 0; piece < ends.size(); ++piece) {
            const Event& last = *ends[piece];
            const bool has_turn = last.kind == Event::Kind::pose;
            const Place from = here_turns;
            const double whole = has_turn ? turned_apart(from, last.numbers.data() + 3) : 0;
            for (bool is_there = false; !is_there;) {
              if (at >= all.size() || all[at].kind != Canonical::Kind::line)
                return text(last, "the path ends early");
              const Canonical& c = all[at++];
              const auto start = static_cast<double>(piece);
              if (curve.distance(c.end, start) > 0.02) return text(last, "beside the curve");
              Place middle{};
              for (std::size_t i = 0; i < 3; ++i) middle[i] = (here[i] + c.end[i]) / 2;
              if (curve.distance(middle, start) > kChord + 0.02)
                return text(last, "a piece that leaves the curve");
              if (last.speed > 0 && std::fabs(c.feed / 60 - last.speed) > 0.01)
                return text(last, "feed " + std::to_string(c.feed));
              // Turned evenly: never off the shorter way from the one target to the next.
              if (has_turn &&
                  turned_apart(from, c.turns) + turned_apart(c.turns, last.numbers.data() + 3) >
                      whole + 0.05)
                return text(last, "turned on another way");
              here = c.end;
              here_turns = c.turns;
              is_there = apart(c.end, last.numbers.data()) < test::kMm;
            }
            if (has_turn && turned_apart(here_turns, last.numbers.data() + 3) > test::kDegree)
              return text(last, "another orientation");
          }
          ++paths;
          break;
        }
        if (at >= all.size() || !moves(all[at].kind)) return text(e, "no motion");
        const Canonical& c = all[at++];
        if ((c.kind == Canonical::Kind::rapid) != (e.interpolation == RMP_MOVE_PTP))
          return text(e, "another kind of motion");
        if (apart(c.end, e.numbers.data()) > test::kMm) return text(e, "another place");
        if (has_pose && turned_apart(c.turns, e.numbers.data() + 3) > test::kDegree)
          return text(e, "another orientation");
        if (c.kind == Canonical::Kind::line && e.speed > 0 &&
            std::fabs(c.feed / 60 - e.speed) > 0.01)
          return text(e, "feed " + std::to_string(c.feed));
        here = c.end;
        here_turns = c.turns;
        break;
      }
    }
  }
  return at == all.size() ? "" : "more commands than the program has";
}

TEST_F(OutsideCheckers, Rs274GoesWhereTheProgramGoes) {
  const std::string program = rs274();
  if (program.empty())
    GTEST_SKIP() << "rs274 is not here: ./bootstrap checkers unpacks it from linuxcnc-uspace";
  std::ofstream(folder_ / "tool.tbl") << "T1 P1 D0.0 ;none\n";
  std::ofstream(folder_ / "machine.var");
  const auto interpreted = [&](const fs::path& file) {
    return run("cd " + quoted(folder_) + " && " + program + " -t tool.tbl -v machine.var -g " +
               quoted(file));
  };
  // It objects to what is wrong.
  std::ofstream(folder_ / "wrong.ngc") << "G21 G90\nG1 X10 QQ\nM2\n";
  EXPECT_NE(interpreted(folder_ / "wrong.ngc").code, 0);
  std::size_t motions = 0, programs = 0, paths = 0;
  for (const Posted& p : posted("gcode", "flat", random_programs(), "linuxcnc_abc")) {
    ASSERT_EQ(p.files.size(), 1U);
    const Said said = interpreted(p.files[0]);
    ASSERT_EQ(said.code, 0) << p.name << "\n" << said.text;
    const std::vector<Canonical> all = canonical(said.text);
    std::ifstream in(p.files[0]);
    std::ostringstream text;
    text << in.rdbuf();
    if (std::any_of(p.events.begin(), p.events.end(),
                    [](const Event& e) { return e.kind == Event::Kind::joints; }))
      continue;  // their pose is the robot's
    EXPECT_EQ(difference(p.events, all, paths), "") << p.name << "\n" << text.str() << said.text;
    motions += all.size();
    ++programs;
  }
  std::cout << programs << " programs, " << motions << " commands of the machine, " << paths
            << " paths\n";
  EXPECT_GE(programs, 15U);
  EXPECT_GE(paths, 1U);
}

// ---- KRL: Vim ----

/// Lines "file, line or line:column, group, word".
std::vector<std::array<std::string, 4>> coloured(const fs::path& folder,
                                                 const std::vector<fs::path>& files) {
  std::string command = "cd " + quoted(folder) + " && KRL_OUT=" + quoted(folder / "found.txt") +
                        " vim -u NONE -N -i NONE -n -es -S " + quoted(kHere / "krl_check.vim");
  for (const fs::path& f : files) command += " " + quoted(f);
  fs::remove(folder / "found.txt");
  const Said said = run(command + " </dev/null");
  std::vector<std::array<std::string, 4>> out;
  std::ifstream in(folder / "found.txt");
  EXPECT_TRUE(in.good()) << said.text;
  for (std::string l; std::getline(in, l);) {
    std::array<std::string, 4> fields;
    std::istringstream line(l);
    for (std::string& f : fields) std::getline(line, f, '\t');
    out.push_back(fields);
  }
  return out;
}
bool has_vim() {
  return run("vim -u NONE -N -es -c 'if !has(\"eval\") || empty(globpath(&rtp, "
             "\"syntax/krl.vim\")) | cquit | endif' -c 'qall!' </dev/null")
             .code == 0;
}

TEST_F(OutsideCheckers, VimFindsNoErrorInKrl) {
  if (!has_vim()) GTEST_SKIP() << "vim with syntax/krl.vim is not here: install the package vim";
  // It objects to what is wrong: a name of 30 letters, = for ==, WHILE with DO.
  std::ofstream(folder_ / "wrong.src")
      << "DEF wrong( )\n  IF a=b THEN\n  ENDIF\n  WHILE a DO\n  ENDWHILE\n"
         "  abcdefghijklmnopqrstuvwxyzabcd=1\nEND\n";
  std::map<std::string, int> wrong;
  for (const auto& l : coloured(folder_, {folder_ / "wrong.src"}))
    if (l[2].starts_with("krlError")) ++wrong[l[2]];
  EXPECT_GE(wrong.size(), 3U);

  std::vector<fs::path> files;
  for (const char* form : {"structured", "flat"})
    for (const Posted& p : posted("krl", form, 25))
      files.insert(files.end(), p.files.begin(), p.files.end());
  ASSERT_GT(files.size(), 30U);
  // What the first word of a line is, by Vim.
  const std::map<std::string, std::string> kGroups{{"DEF", "krlTypedef"},
                                                   {"END", "krlTypedef"},
                                                   {"DEFFCT", "krlTypedef"},
                                                   {"ENDFCT", "krlTypedef"},
                                                   {"DEFDAT", "krlTypedef"},
                                                   {"ENDDAT", "krlTypedef"},
                                                   {"&ACCESS", "krlHeader"},
                                                   {"&REL", "krlHeader"},
                                                   {"DECL", "krlStorageClass"},
                                                   {"STRUC", "krlStorageClass"},
                                                   {"GLOBAL", "krlStatement"},
                                                   {"SIGNAL", "krlType"},
                                                   {"INT", "krlType"},
                                                   {"REAL", "krlType"},
                                                   {"BOOL", "krlType"},
                                                   {"PTP", "krlMovement"},
                                                   {"LIN", "krlMovement"},
                                                   {"CIRC", "krlMovement"},
                                                   {"LIN_REL", "krlMovement"},
                                                   {"PTP_REL", "krlMovement"},
                                                   {"BRAKE", "krlMovement"},
                                                   {"IF", "krlConditional"},
                                                   {"ELSE", "krlConditional"},
                                                   {"ENDIF", "krlConditional"},
                                                   {"SWITCH", "krlConditional"},
                                                   {"CASE", "krlConditional"},
                                                   {"DEFAULT", "krlConditional"},
                                                   {"ENDSWITCH", "krlConditional"},
                                                   {"FOR", "krlRepeat"},
                                                   {"ENDFOR", "krlRepeat"},
                                                   {"WHILE", "krlRepeat"},
                                                   {"ENDWHILE", "krlRepeat"},
                                                   {"REPEAT", "krlRepeat"},
                                                   {"UNTIL", "krlRepeat"},
                                                   {"LOOP", "krlRepeat"},
                                                   {"ENDLOOP", "krlRepeat"},
                                                   {"EXIT", "krlRepeat"},
                                                   {"GOTO", "krlLabel"},
                                                   {"WAIT", "krlStatement"},
                                                   {"INTERRUPT", "krlStatement"},
                                                   {"RETURN", "krlException"},
                                                   {"RESUME", "krlException"},
                                                   {"HALT", "krlException"},
                                                   {"CONTINUE", "krlContinue"},
                                                   {"BAS", "krlFunction"}};
  std::map<std::string, std::size_t> words;
  std::size_t lines = 0;
  for (const auto& [file, line, group, word] : coloured(folder_, files)) {
    const std::string where = file + ":" + line + ": ";
    ASSERT_FALSE(group.starts_with("krlError")) << where << group << " " << word;
    ++lines;
    const auto known = kGroups.find(word);
    if (known != kGroups.end()) {
      EXPECT_EQ(group, known->second) << where << word;
      ++words[word];
    } else if (word[0] == '$') {
      EXPECT_EQ(group, "krlSysvars") << where << word;
    } else if (word[0] == ';') {
      EXPECT_TRUE(group.find("Comment") != std::string::npos) << where << word;
    } else {
      // A variable that is assigned, a call, a label; no word that Vim has for something else.
      EXPECT_TRUE(group.empty() || group == "krlFunction" || group == "krlLabel")
          << where << group << " " << word;
    }
  }
  for (const char* word : {"PTP", "LIN", "CIRC", "IF", "WHILE", "FOR", "WAIT", "DECL", "INTERRUPT"})
    EXPECT_GT(words[word], 0U) << word;
  std::cout << files.size() << " files, " << lines << " lines\n";
}

// ---- ROS ----

TEST_F(OutsideCheckers, TrajectoriesAreMessagesOfRos) {
  const std::string python = "/usr/bin/python3 " + quoted(kHere / "trajectory_check.py");
  const Said there = run(python);
  if (there.code == 77 || there.code == 127)
    GTEST_SKIP() << "no messages of ROS here: install the package python3-trajectory-msgs. "
                 << there.text;
  ASSERT_EQ(there.code, 0) << there.text;
  std::ofstream names(folder_ / "names");
  std::size_t count = 0, sequences = 0;
  fs::path one, sequence;
  for (const Posted& p : posted("joint_trajectory", "flat", 60))
    for (const fs::path& f : p.files)
      if (f.extension() == ".json") {
        const fs::path name = fs::path(f).replace_extension();
        const bool is_sequence = name.string().ends_with("_sequence");
        (is_sequence ? sequence : one) = name;
        ++(is_sequence ? sequences : count);
        names << name.string() << "\n";
      }
  names.close();
  ASSERT_GE(count, 40U);
  ASSERT_GE(sequences, 3U);
  const Said said = run(python + " " + quoted(fs::path("@" + (folder_ / "names").string())));
  EXPECT_EQ(said.code, 0) << said.text;
  std::cout << count << " trajectories, " << sequences << " sequences, " << said.text;
  // It objects: a number missing, a time that falls, another number in the YAML.
  fs::path file = one;
  const auto objects = [&](const std::string& from, const std::string& to) {
    std::ifstream in(file.string() + ".json");
    std::ostringstream text;
    text << in.rdbuf();
    std::string bad = text.str();
    const std::size_t at_text = bad.find(from);
    ASSERT_NE(at_text, std::string::npos) << from << bad;
    bad.replace(at_text, from.size(), to);
    for (const char* extension : {".json", ".yaml"}) {
      fs::copy_file(file.string() + extension, file.string() + extension + "_kept");
      std::ofstream(file.string() + extension) << bad;
    }
    EXPECT_EQ(run(python + " " + quoted(file)).code, 1) << from;
    for (const char* extension : {".json", ".yaml"})
      fs::rename(file.string() + extension + "_kept", file.string() + extension);
    EXPECT_EQ(run(python + " " + quoted(file)).code, 0);
  };
  objects("\"positions\": [", "\"positions\": [1.0, ");
  objects("\"positions\": [", "\"positions\": [\"x\", ");
  objects("\"velocities\": []", "\"velocities\": [0.5]");
  objects("\"nanosec\": ", "\"nanosec\": 9999999999");
  objects("\"effort\"", "\"force\"");
  // And a trajectory out of order, a step of no kind, an output without a value.
  file = sequence;
  objects("_1\"", "_2\"");
  objects("\"trajectory\"", "\"path\"");
  objects("\"value\"", "\"state\"");
}

// ---- CRCL, VAL3: xmllint ----

TEST_F(OutsideCheckers, XmllintTakesCrclAndVal3) {
  if (run("xmllint --version").code != 0)
    GTEST_SKIP() << "xmllint is not here: install the package libxml2-utils";
  const char* nist = std::getenv("ROBOMOSP_CRCL_XSD");
  std::vector<fs::path> schemas{kHere / "crcl.xsd"};
  if (nist) schemas.emplace_back(nist);
  std::size_t count = 0;
  for (const Posted& p : posted("crcl", "flat", 40))
    for (const fs::path& f : p.files) {
      ++count;
      for (const fs::path& schema : schemas) {
        const Said said = run("xmllint --noout --schema " + quoted(schema) + " " + quoted(f));
        EXPECT_EQ(said.code, 0) << p.name << ": " << said.text;
      }
    }
  EXPECT_GE(count, 6U);
  const auto objects = [&](const std::string& middle) {
    std::ofstream(folder_ / "wrong.xml")
        << "<?xml version=\"1.0\"?>\n<CRCLProgram "
           "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"><Name>x</Name><InitCanon>"
           "<CommandID>1</CommandID></InitCanon>"
        << middle << "<EndCanon><CommandID>3</CommandID></EndCanon></CRCLProgram>\n";
    return run("xmllint --noout --schema " + quoted(schemas[0]) + " " +
               quoted(folder_ / "wrong.xml"))
               .code != 0;
  };
  const std::string begin = "<MiddleCommand xsi:type=\"";
  EXPECT_FALSE(objects(begin + "DwellType\"><CommandID>2</CommandID><DwellTime>0.5</DwellTime>"
                               "</MiddleCommand>"));
  EXPECT_TRUE(objects(begin + "DwellType\"><CommandID>2</CommandID><DwellTime>nan</DwellTime>"
                              "</MiddleCommand>"));
  EXPECT_TRUE(objects(begin + "DwellType\"><DwellTime>0.5</DwellTime><CommandID>2</CommandID>"
                              "</MiddleCommand>"));
  EXPECT_TRUE(objects(begin + "SleepType\"><CommandID>2</CommandID></MiddleCommand>"));
  EXPECT_TRUE(objects(begin + "DwellType\"><CommandID>1</CommandID><DwellTime>0.5</DwellTime>"
                              "</MiddleCommand>"));
  std::size_t applications = 0;
  for (const char* form : {"structured", "flat"})
    for (const Posted& p : posted("val3", form, 10)) {
      ++applications;
      for (const fs::path& f : p.files) {
        const Said said = run("xmllint --noout " + quoted(f));
        EXPECT_EQ(said.code, 0) << p.name << ": " << said.text;
      }
    }
  EXPECT_GE(applications, 8U);
  std::cout << count << " files of CRCL, " << applications << " applications of VAL3\n";
}

// ---- C: the compiler ----

TEST_F(OutsideCheckers, TheCompilerTakesCWithoutAWarning) {
  if (run("cc --version").code != 0) GTEST_SKIP() << "cc is not here: install build-essential";
  const fs::path client = fs::path(ROBOMOSP_SOURCE_DIR) / "sdk/clients/c";
  // The PA-10's header comes with the arm: names of published programs.
  std::ofstream(folder_ / "pa.h")
      << "#ifndef PA_H\n#define PA_H\n"
         "typedef struct ANGLE { double s1, s2, s3, e1, e2, w1, w2; } ANGLE;\n"
         "typedef double MATRIX[3][4];\nenum { ARM0 = 0 };\n"
         "enum { S1 = 1, S2 = 2, S3 = 4, E1 = 8, E2 = 16, W1 = 32, W2 = 64 };\n"
         "enum { WM_WAIT = 1, MM_XYZNOA = 3 };\n"
         "int pa_ini_sys(void);\nint pa_ter_sys(void);\nint pa_opn_arm(int arm);\n"
         "int pa_cls_arm(int arm);\nint pa_sta_arm(int arm);\nint pa_ext_arm(int arm);\n"
         "int pa_stp_arm(int arm);\nint pa_sus_arm(int arm);\nint pa_rsm_arm(int arm);\n"
         "int pa_exe_axs(int arm, int axes, const ANGLE *angle, int wait);\n"
         "int pa_mov_mat(int arm, int mode, MATRIX m, const ANGLE *angle, int wait);\n#endif\n";
  {
    // OR within AND needs its parentheses; ABS of an INT is no function of REAL.
    const Value id =
        call("program.create", {{"name", "both"},
                                {"source",
                                 "PROGRAM both;\nVAR BOOL: a, b, c; INT: i;\nBEGIN\n"
                                 "  c := (a OR b) AND c;\n  c := a OR b AND c;\n  i := ABS(i);\n"
                                 "ENDPROGRAM;\n"}});
    const Value r = call("program.post", {{"id", id}, {"target", "c"}});
    const std::string text = *at((*at(r, "files").as_list())[0], "text").as_string();
    EXPECT_NE(text.find("c = (a || b) && c;"), std::string::npos) << text;
    EXPECT_NE(text.find("c = a || (b && c);"), std::string::npos) << text;
    EXPECT_NE(text.find("i = abs(i);"), std::string::npos) << text;
    call("document.undo");
  }
  std::size_t count = 0;
  for (const char* target : {"c", "pa10"})
    for (const char* form : {"structured", "flat"})
      for (const Posted& p : posted(target, form, 10)) {
        std::string command = "cc -std=c99 -pedantic -Wall -Wextra -Werror -fsyntax-only -I" +
                              quoted(client) + " -I" + quoted(folder_);
        for (const fs::path& f : p.files)
          if (f.extension() == ".c" && (count == 0 || f.filename().string().starts_with("prog")))
            command += " " + quoted(f);
        const Said said = run(command);
        EXPECT_EQ(said.code, 0) << p.name << " " << target << " " << form << "\n" << said.text;
        ++count;
      }
  EXPECT_GE(count, 16U);
  std::cout << count << " programs\n";
}

}  // namespace
}  // namespace robomosp

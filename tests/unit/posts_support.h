// SPDX-License-Identifier: Apache-2.0
// Posts in tests: IRL compiled, its known points computed here (not by the host), and what a post
// writes and says.
#pragma once

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/post_points.h>
#include <robomosp/sdk/post_writer.h>

#include "compile.h"
#include "support/constructs.h"

namespace robomosp::posts_test {

using conformance::plain::about;
using conformance::plain::kDeg;
using conformance::plain::matrix;
using conformance::plain::Numbers;
using conformance::plain::PlainKinematics;
using conformance::plain::Points;
using conformance::plain::Q;
using conformance::plain::six_joints;
using conformance::plain::times;
using conformance::plain::turned;

class NoParams final : public Params {
 public:
  bool has(std::string_view) const override { return false; }
  double real(std::string_view) const override { return 0; }
  long long integer(std::string_view) const override { return 0; }
  bool boolean(std::string_view) const override { return false; }
  std::string_view text(std::string_view) const override { return ""; }
  std::span<const double> reals(std::string_view) const override { return {}; }
  Pose pose(std::string_view) const override { return {}; }
};

/// What a post wrote and said: faults as "error 12: message. hint".
class Posted final : public PostOutput {
 public:
  std::map<std::string, std::string, std::less<>> files;
  std::string faults;
  int errors = 0, warnings = 0;
  std::map<std::string, std::map<std::uint32_t, std::uint32_t>, std::less<>> lines;
  void file(std::string_view name, std::string_view bytes) override {
    EXPECT_TRUE(files.emplace(name, bytes).second) << name << " comes twice";
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    lines[std::string(file)][line] = span.line;
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view hint) override {
    static constexpr const char* kWords[] = {"error", "warning", "note"};
    if (severity == RMP_FAULT_ERROR) ++errors;
    if (severity == RMP_FAULT_WARNING) ++warnings;
    faults += std::string(kWords[severity]) + " " + std::to_string(span.line) + ": " +
              std::string(message) + (hint.empty() ? "" : ". " + std::string(hint)) + "\n";
  }
  /// The only file, without comments of the test's choice.
  std::string text() const { return files.size() == 1 ? files.begin()->second : ""; }
};

inline std::unique_ptr<ProgramTables> compiled(const std::string& text) {
  const std::vector<SourceFile> all{{"p.irl", text, {}}};
  NoProgress progress;
  auto made = irl::compile(all, progress);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return nullptr;
  for (const rmp_code_fault& f : (*made)->faults)
    EXPECT_NE(f.severity, RMP_FAULT_ERROR) << f.span.line << ": " << f.message << "\n" << text;
  return std::move(*made);
}
struct How {
  PostProfile profile{};
  bool robot = false;
  std::uint32_t form = kPostStructured;
  std::string name = "prog";
};
inline Posted posted(const Post& post, const ProgramTables& p, const How& how = {}) {
  Posted out;
  if (p.code().has_errors) return out;
  const Points points(p.code(), how.robot);
  const RobotModel robot = six_joints();
  PostTask task;
  task.code = &p.code();
  task.form = how.form;
  task.name = how.name;
  task.points = points.points;
  task.profile = &how.profile;
  if (how.robot) {
    task.robot = &robot;
    task.kinematics = &points.kinematics;
  }
  NoProgress progress;
  const auto done = post.write(task, NoParams(), out, progress);
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
  return out;
}
inline Posted posted(const Post& post, const std::string& irl, const How& how = {}) {
  const auto p = compiled(irl);
  return p ? posted(post, *p, how) : Posted{};
}

// ---- readers ----

/// All numbers of a text, in order.
inline Numbers numbers_in(const std::string& s) {
  Numbers out;
  for (std::size_t i = 0; i < s.size();) {
    const bool starts =
        (s[i] >= '0' && s[i] <= '9') ||
        ((s[i] == '-' || s[i] == '.') && i + 1 < s.size() && s[i + 1] >= '0' && s[i + 1] <= '9');
    const bool in_word =
        i > 0 && (std::isalnum(static_cast<unsigned char>(s[i - 1])) || s[i - 1] == '_');
    if (!starts || in_word) {
      ++i;
      continue;
    }
    std::size_t end = i + 1;
    while (end < s.size() && ((s[end] >= '0' && s[end] <= '9') || s[end] == '.')) ++end;
    double v = 0;
    std::from_chars(s.data() + i, s.data() + end, v);
    out.push_back(v);
    i = end;
  }
  return out;
}
inline std::vector<std::string> lines_of(const std::string& s) {
  std::vector<std::string> out;
  std::istringstream in(s);
  for (std::string l; std::getline(in, l);) out.push_back(l);
  return out;
}
inline bool has_text(const std::string& s, const std::string& part) {
  return s.find(part) != std::string::npos;
}

// ---- straight programs and what is read back from the text ----

/// A motion, an output or a wait, as the program or a reader of the target's text has it.
struct Seen {
  std::string what;  ///< "ptp joints", "ptp", "lin", "via", "circle", "out", "wait"
  std::array<double, 3> mm{};
  std::array<double, 9> R{};
  Numbers joints;    ///< degrees
  double value = 0;  ///< speed [mm/s or %], state of an output, seconds
  int number = 0;    ///< of a signal
};
struct Straight {
  std::string irl;
  std::vector<Seen> seen;
};
/// `n` motions with outputs and waits between them; equal seeds give equal programs.
inline Straight straight(int n, unsigned seed, bool with_circles = true, bool with_joints = true) {
  Straight out;
  unsigned state = seed * 2654435761U + 1;
  const auto random = [&](double lower, double upper) {
    state = state * 1664525U + 1013904223U;
    return std::round((lower + (upper - lower) * (state >> 8U) / 16777216.0) * 100) / 100;
  };
  out.irl = "PROGRAM prog;\nSIGNAL OUTPUT BOOL: grip AT 2; INPUT BOOL: ready AT 1;\nBEGIN\n";
  const auto number = [](double v) { return post::fixed(v, 2); };
  const auto pose = [&](Seen& s) {
    const double a = random(-170, 170), b = random(-80, 80), c = random(-170, 170);
    s.mm = {random(200, 800), random(-500, 500), random(100, 900)};
    s.R = matrix(times(times(about(2, a), about(1, b)), about(0, c)));
    return "POSE(POSITION(" + number(s.mm[0]) + ", " + number(s.mm[1]) + ", " + number(s.mm[2]) +
           "), ORIZYX(" + number(a) + ", " + number(b) + ", " + number(c) + "))";
  };
  for (int i = 0; i < n; ++i) {
    Seen s;
    switch (i == 0 ? 1 : i % 10) {
      case 1:
        if (with_joints) {
          s.what = "ptp joints";
          std::string all;
          for (int k = 0; k < 6; ++k) {
            s.joints.push_back(random(-120, 120));
            all += (k ? ", " : "") + number(s.joints.back());
          }
          s.value = 50;
          out.irl += "MOVE PTP JOINT(MAIN_JOINT(" + all + "), ADD_JOINT(0.0)) SPEED_PTP := 50.0;\n";
          break;
        }
        [[fallthrough]];
      case 2:
        s.what = "ptp";
        s.value = 25;
        out.irl += "MOVE PTP " + pose(s) + " SPEED_PTP := 25.0;\n";
        break;
      case 5:
        if (with_circles) {
          Seen end;
          s.what = "via";
          end.what = "circle";
          const std::string via = pose(s);
          s.value = end.value = 60;
          out.irl += "MOVE CIRCLE " + via + ", " + pose(end) + " SPEED := 60.0;\n";
          out.seen.push_back(s);
          s = end;
          break;
        }
        [[fallthrough]];
      default:
        s.what = "lin";
        s.value = std::round(random(20, 500));
        out.irl += "MOVE LIN " + pose(s) + " SPEED := " + number(s.value) + ";\n";
    }
    out.seen.push_back(s);
    if (i % 7 == 3) {
      Seen o;
      o.what = "out";
      o.number = 2;
      o.value = i % 2;
      out.irl += std::string("grip := ") + (i % 2 ? "TRUE" : "FALSE") + ";\n";
      out.seen.push_back(o);
    }
    if (i % 11 == 4) {
      Seen w;
      w.what = "wait";
      w.value = 0.25;
      out.irl += "WAIT 0.25 SEC;\n";
      out.seen.push_back(w);
    }
  }
  out.irl += "ENDPROGRAM;\n";
  return out;
}
inline void same(const std::vector<Seen>& want, const std::vector<Seen>& got, bool with_R = true) {
  ASSERT_EQ(want.size(), got.size());
  for (std::size_t i = 0; i < want.size(); ++i) {
    const Seen &a = want[i], &b = got[i];
    ASSERT_EQ(a.what, b.what) << i;
    ASSERT_EQ(a.number, b.number) << i;
    ASSERT_NEAR(a.value, b.value, 0.006 + 1e-4 * a.value) << i << " " << a.what;
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(a.mm[k], b.mm[k], 0.01) << i;
    ASSERT_EQ(a.joints.size(), b.joints.size()) << i;
    for (std::size_t k = 0; k < a.joints.size(); ++k) ASSERT_NEAR(a.joints[k], b.joints[k], 0.01);
    if (!with_R) continue;
    // 0.01 degrees is 1.7e-4 in an entry of the matrix at most.
    for (std::size_t k = 0; k < 9; ++k) ASSERT_NEAR(a.R[k], b.R[k], 1.7e-4) << i;
  }
}
inline void set_pose(Seen& s, const Numbers& n, std::size_t at, double scale, const Q& q) {
  for (std::size_t k = 0; k < 3; ++k) s.mm[k] = n[at + k] * scale;
  s.R = matrix(q);
}
inline Q rpy(double rx, double ry, double rz) {
  return times(times(about(2, rz), about(1, ry)), about(0, rx));
}
/// Positions that no controller takes, names of 200 letters; what is said stands at line 3 or 4.
inline void wrong_input(const Post& post, const How& how) {
  for (const char* x : {"1.0E300", "-1.0E300", "1.0E9"}) {
    const Posted p =
        posted(post,
               "PROGRAM prog;\nVAR POSE: x := POSE(POSITION(" + std::string(x) +
                   ", 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0));\nBEGIN\nMOVE LIN x;\nENDPROGRAM;\n",
               how);
    EXPECT_GT(p.errors, 0) << x << p.text();
    EXPECT_TRUE(has_text(p.faults, "error 4:")) << p.faults;
  }
  // Numbers that are not finite cannot be written in IRL; a host may still hand them over.
  const auto t = compiled(
      "PROGRAM prog;\nBEGIN\nMOVE LIN POSE(POSITION(400.0, 0.0, 300.0), ORIZYX(0.0, 180.0, "
      "0.0));\nENDPROGRAM;\n");
  for (auto& k : t->constants)
    if (k.kind == RMP_CONSTANT_REAL && k.real == 400.0) k.real = std::nan("");
  t->seal();
  EXPECT_GT(posted(post, *t, how).errors, 0);
}
/// Ten times the motions take about ten times as long, and 10,000 less than 2 s.
inline void is_linear(const Post& post, const How& how, bool circles = true, bool joints = true) {
  const auto seconds = [&](int n) {
    const auto t = compiled(straight(n, 3, circles, joints).irl);
    double best = 1e9;
    for (int k = 0; k < 3; ++k) {
      const auto begin = std::chrono::steady_clock::now();
      const Posted p = posted(post, *t, how);
      EXPECT_EQ(p.errors, 0) << p.faults.substr(0, 1000);
      best = std::min(
          best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return best;
  };
  const double one = seconds(1000), ten = seconds(10'000);
  EXPECT_LT(ten, 40 * one + 0.05);
  EXPECT_LT(ten, 2.0);
  ::testing::Test::RecordProperty("ms_for_10000", static_cast<int>(ten * 1000));
  std::printf("10,000 motions: %.0f ms\n", ten * 1000);
}

/// Every statement and many expressions of the language: what a post makes of them is a text, or an
/// error at their line or before it. The first frame of the catalogue, which `robomosp post test`
/// reads, too.
inline const std::vector<post::ConstructCase>& constructs() {
  static const std::vector<post::ConstructCase> kAll = [] {
    std::vector<post::ConstructCase> all;
    for (auto& c : test::construct_catalogue())
      if (c.source.starts_with("PROGRAM prog;")) all.push_back(std::move(c));
    return all;
  }();
  return kAll;
}
/// The program that every page of a target shows.
inline std::string weld() {
  return R"(PROGRAM weld;
SIGNAL
  OUTPUT BOOL: arc AT 5;
  INPUT  BOOL: arc_stable AT 6;
VAR
  ORIENTATION: torch := ORIZYX(0.0, 135.0, 0.0);
  POSE: a := POSE(POSITION(500.0, -150.0, 100.0), torch);
BEGIN
  MOVE PTP POSE(POSITION(500.0, -150.0, 180.0), torch) SPEED_PTP := 50.0;
  MOVE LIN a SPEED := 300.0;
  arc := TRUE;
  WAIT FOR arc_stable;
  MOVE LIN POSE(POSITION(620.0, -150.0, 100.0), torch) SPEED := 8.0;
  MOVE CIRCLE POSE(POSITION(680.0, -90.0, 100.0), torch),
              POSE(POSITION(620.0, -30.0, 100.0), torch) SPEED := 8.0;
  arc := FALSE;
  WAIT 0.5 SEC;
ENDPROGRAM;
)";
}
/// Whether a page shows a program of IRL and, in the block behind it, what the post makes of it.
/// With ROBOMOSP_UPDATE_GOLDEN=1 the second block is written.
inline void page_is_right(const Post& post, const std::string& page, const How& how) {
  const std::string file = std::string(ROBOMOSP_SOURCE_DIR) + "/docs/user/irl/targets/" + page;
  std::ifstream in(file);
  std::stringstream all;
  all << in.rdbuf();
  std::string text = all.str();
  const std::size_t irl = text.find("```irl\n");
  ASSERT_NE(irl, std::string::npos) << file;
  const std::size_t irl_end = text.find("```\n", irl + 7);
  const Posted p = posted(post, text.substr(irl + 7, irl_end - irl - 7), how);
  EXPECT_EQ(p.errors, 0) << p.faults;
  std::string want;
  for (const auto& [name, bytes] : p.files) want += bytes;
  std::erase(want, '\r');
  const std::size_t begin = text.find('\n', text.find("```", irl_end + 4)) + 1;
  const std::size_t end = text.find("```", begin);
  ASSERT_NE(end, std::string::npos) << file;
  if (std::getenv("ROBOMOSP_UPDATE_GOLDEN")) {
    text.replace(begin, end - begin, want);
    std::ofstream(file) << text;
    return;
  }
  EXPECT_EQ(text.substr(begin, end - begin), want);
}
/// Every construct over a post: a file, or an error whose line is known.
inline void every_construct(const Post& post, const How& how, std::size_t at_least) {
  std::size_t written = 0;
  EXPECT_GE(constructs().size(), 150U);
  for (const post::ConstructCase& construct : constructs()) {
    const std::string& c = construct.text;
    const Posted p = posted(post, construct.source, how);
    EXPECT_TRUE(p.errors > 0 || !p.files.empty()) << c;
    EXPECT_FALSE(p.errors > 0 && has_text(p.faults, "error 0:")) << c << "\n" << p.faults;
    for (const auto& [name, text] : p.files) {
      std::string numbers = text;
      for (std::size_t at; (at = numbers.find("nanosec")) != std::string::npos;)
        numbers.erase(at, 7);
      EXPECT_FALSE(has_text(numbers, "nan")) << c << "\n" << text;
      EXPECT_FALSE(has_text(text, "-0.0 ") || has_text(text, "-0.000,")) << c << "\n" << text;
    }
    if (p.errors == 0) ++written;
  }
  EXPECT_GE(written, at_least);
}

}  // namespace robomosp::posts_test

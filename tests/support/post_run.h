// SPDX-License-Identifier: Apache-2.0
// Posts of programs for tests: source to tables by the compiler of IRL, known points as the host
// finds them, and what a post says and writes.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "compile.h"
#include "program_post/points.h"
#include "support/constructs.h"

namespace robomosp::post_run {

struct Output final : PostOutput {
  void file(std::string_view name, std::string_view bytes) override {
    EXPECT_TRUE(files.emplace(name, bytes).second) << name << " twice";
  }
  void from(std::string_view file, std::uint32_t line, const rmp_span& span) override {
    map[std::string(file)][line] = span.line;
  }
  void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
             std::string_view) override {
    static constexpr const char* kWords[] = {"error ", "warning ", "note "};
    EXPECT_FALSE(message.empty());
    faults += kWords[severity] + std::to_string(span.line) + ": " + std::string(message) + "\n";
    if (severity == RMP_FAULT_ERROR) ++errors;
  }
  [[nodiscard]] std::string only() const { return files.size() == 1 ? files.begin()->second : ""; }
  std::map<std::string, std::string> files;
  std::map<std::string, std::map<std::uint32_t, std::uint32_t>> map;
  std::string faults;
  int errors = 0;
};

struct Station {
  std::vector<PostAxis> axes;
  std::vector<PostSignal> signals;
  std::vector<PostPlace> tools, frames;
  std::vector<PostOption> options;
  PostProfile profile;
  std::string name = "prog";
  std::function<void(std::vector<PostPoint>&)> change;
};

class NoParams final : public Params {
 public:
  [[nodiscard]] bool has(std::string_view) const override { return false; }
  [[nodiscard]] double real(std::string_view) const override { return 0; }
  [[nodiscard]] long long integer(std::string_view) const override { return 0; }
  [[nodiscard]] bool boolean(std::string_view) const override { return false; }
  [[nodiscard]] std::string_view text(std::string_view) const override { return ""; }
  [[nodiscard]] std::span<const double> reals(std::string_view) const override { return {}; }
  [[nodiscard]] Pose pose(std::string_view) const override { return {}; }
};

inline std::unique_ptr<ProgramTables> compiled(const std::string& source) {
  std::vector<SourceFile> all{{"p.irl", source, {}}};
  NoProgress progress;
  auto made = irl::compile(all, progress);
  EXPECT_TRUE(made.ok());
  if (!made.ok()) return nullptr;
  for (const rmp_code_fault& f : (*made)->faults)
    EXPECT_NE(f.severity, std::uint32_t{RMP_FAULT_ERROR})
        << f.span.line << ": " << f.message << "\n"
        << source.substr(0, 3000);
  return std::move(made).value();
}

inline Output run(const Post& post, const std::string& source, Station setup = {}) {
  Output out;
  const auto tables = compiled(source);
  if (!tables || tables->code().has_errors) return out;
  auto points = program_post::known_points(tables->code(), nullptr, nullptr);
  if (setup.change) setup.change(points.points);
  setup.profile.axes = setup.axes;
  setup.profile.signals = setup.signals;
  setup.profile.tools = setup.tools;
  setup.profile.frames = setup.frames;
  setup.profile.options = setup.options;
  PostTask task;
  task.code = &tables->code();
  task.form = post.capabilities().forms & kPostStructured ? kPostStructured : kPostFlat;
  task.name = setup.name;
  task.points = points.points;
  task.profile = &setup.profile;
  NoProgress progress;
  const auto done = post.write(task, NoParams{}, out, progress);
  EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
  return out;
}

inline std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream all(text);
  for (std::string l; std::getline(all, l);) {
    while (!l.empty() && (l.back() == '\r' || l.back() == ' ')) l.pop_back();
    out.push_back(l);
  }
  return out;
}
/// Text without carriage returns.
inline std::string unix_text(const std::string& s) {
  std::string out;
  for (const char c : s)
    if (c != '\r') out += c;
  return out;
}
inline std::vector<double> numbers(const std::string& s) {
  std::vector<double> out;
  for (std::size_t i = 0; i < s.size();) {
    const bool begins = (s[i] >= '0' && s[i] <= '9') ||
                        (s[i] == '-' && i + 1 < s.size() && s[i + 1] >= '0' && s[i + 1] <= '9');
    const bool in_word =
        i > 0 && (std::isalnum(static_cast<unsigned char>(s[i - 1])) || s[i - 1] == '_');
    if (!begins || in_word) {
      ++i;
      continue;
    }
    std::size_t used = 0;
    out.push_back(std::stod(s.substr(i, 40), &used));
    i += used;
  }
  return out;
}

using Matrix = std::array<double, 9>;
inline Matrix about(std::size_t axis, double degrees) {
  const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
  if (axis == 0) return {1, 0, 0, 0, c, -s, 0, s, c};
  if (axis == 1) return {c, 0, s, 0, 1, 0, -s, 0, c};
  return {c, -s, 0, s, c, 0, 0, 0, 1};
}
inline Matrix times(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return out;
}
/// Angle between two orientations [degrees], by the distance of the matrices: acos of the trace
/// does not resolve small ones.
inline double between(const Matrix& a, const Matrix& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 9; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return 2 * std::asin(std::min(1.0, std::sqrt(sum / 8))) * 180 / M_PI;
}

/// A motion as a reader of the target finds it, and as the program means it.
struct Read {
  std::string kind;             ///< ptp, joints, lin, via, circle
  std::vector<double> numbers;  ///< x y z [mm] of a pose; joints [degrees]
  Matrix R{};
  double speed = -1;  ///< mm/s, or % of PTP
};
struct Motions {
  std::string source;
  std::vector<Read> meant;
};
inline std::string text(double v) {
  std::ostringstream s;
  s.precision(17);
  s << v;
  return s.str().find_first_of(".e") == std::string::npos ? s.str() + ".0" : s.str();
}
/// Random motions, with what they are.
inline Motions straight_program(int n, unsigned seed, bool has_circles, bool has_joints) {
  Motions out;
  std::uint64_t state = seed;
  const auto random = [&](double low, double high) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return std::round((low + (high - low) * double(state >> 11U) / 9007199254740992.0) * 1e4) / 1e4;
  };
  std::ostringstream s;
  s << "PROGRAM flat;\nBEGIN\n";
  const auto pose = [&](Read& r) {
    const double a = random(-180, 180), b = random(-89, 89), c = random(-180, 180);
    r.numbers = {random(-900, 900), random(-900, 900), random(-900, 900)};
    r.R = times(times(about(2, a), about(1, b)), about(0, c));
    return "POSE(POSITION(" + text(r.numbers[0]) + ", " + text(r.numbers[1]) + ", " +
           text(r.numbers[2]) + "), ORIZYX(" + text(a) + ", " + text(b) + ", " + text(c) + "))";
  };
  for (int i = 0; i < n; ++i) {
    Read r;
    const int kind = static_cast<int>(random(0, 1000)) % 4;
    if (kind == 0 && has_joints) {
      r.kind = "joints";
      s << "MOVE PTP MAIN_JOINT(";
      for (int k = 0; k < 6; ++k) {
        r.numbers.push_back(random(-170, 170));
        s << (k ? ", " : "") << text(r.numbers.back());
      }
      r.speed = std::round(random(1, 100));
      s << ") SPEED_PTP := " << text(r.speed) << ";\n";
    } else if (kind == 1) {
      r.kind = "ptp";
      r.speed = std::round(random(1, 100));
      const std::string p = pose(r);
      s << "MOVE PTP " << p << " SPEED_PTP := " << text(r.speed) << ";\n";
    } else if (kind == 2 && has_circles) {
      Read via;
      via.kind = "via";
      const std::string v = pose(via), e = pose(r);
      r.kind = "circle";
      r.speed = via.speed = std::round(random(1, 900));
      s << "MOVE CIRCLE " << v << ", " << e << " SPEED := " << text(r.speed) << ";\n";
      out.meant.push_back(via);
    } else {
      r.kind = "lin";
      r.speed = std::round(random(1, 900));
      const std::string p = pose(r);
      s << "MOVE LIN " << p << " SPEED := " << text(r.speed) << ";\n";
    }
    out.meant.push_back(r);
  }
  s << "ENDPROGRAM;\n";
  out.source = s.str();
  return out;
}
inline void expect_same(const std::vector<Read>& read, const std::vector<Read>& meant) {
  ASSERT_EQ(read.size(), meant.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].kind, meant[i].kind) << i;
    ASSERT_EQ(read[i].numbers.size(), meant[i].numbers.size()) << i;
    for (std::size_t k = 0; k < read[i].numbers.size(); ++k)
      EXPECT_NEAR(read[i].numbers[k], meant[i].numbers[k], 0.01) << i;
    if (meant[i].kind != "joints") {
      EXPECT_LT(between(read[i].R, meant[i].R), 0.01) << i;
    }
    EXPECT_NEAR(read[i].speed, meant[i].speed, 1e-3) << i;
  }
}

/// Every statement and operation of the language, one a row: the second frame of the catalogue,
/// which `robomosp post test` reads, too.
inline const std::vector<post::ConstructCase>& every_construct() {
  static const std::vector<post::ConstructCase> kAll = [] {
    std::vector<post::ConstructCase> all;
    for (auto& c : test::construct_catalogue())
      if (c.source.starts_with("PROGRAM p;")) all.push_back(std::move(c));
    return all;
  }();
  return kAll;
}
/// Statements in a program with some variables, from line 12.
inline std::string with(const std::string& statements) {
  std::string all = every_construct().front().without;
  return all.insert(all.find("\nENDPROGRAM"), statements);
}
inline constexpr int kStatementLine = 12;
#define RMP_A "POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 180.0, 0.0))"
#define RMP_B "POSE(POSITION(9.0, 2.0, 4.0), ORIZYX(0.0, 180.0, 0.0))"
/// Each construct is text, or an error at its line with its words. Gives those that are errors.
inline std::string table(const Post& post, const Station& setup = {}) {
  std::string errors;
  const auto whole = [](const Output& o) {
    std::string all;
    for (const auto& [n, text] : o.files) all += text;
    return all;
  };
  const std::string nothing = whole(run(post, with(""), setup));
  EXPECT_GE(every_construct().size(), 150U);
  for (const post::ConstructCase& construct : every_construct()) {
    const std::string& s = construct.text;
    const Output out = run(post, construct.source, setup);
    if (out.errors == 0) {
      EXPECT_TRUE(whole(out) != nothing || !out.faults.empty())
          << s << " is neither text nor a fault";
      continue;
    }
    errors += s + "\n";
    for (const std::string& l : lines(out.faults)) {
      if (!l.starts_with("error ")) continue;
      const int at = std::stoi(l.substr(6));
      EXPECT_TRUE(at >= 1 && at <= kStatementLine) << s << l;
      if (std::getenv("ROBOMOSP_SHOW")) std::cout << s << "\n  " << l << "\n";
    }
  }
  return errors;
}
/// Refused by all targets with structured programs: their refusals are these and a few individual
/// ones.
inline const std::vector<std::string>& refused_by_all() {
  static const std::vector<std::string> kAll{
      "i := SIZEOF(l);",
      "pv.ORI.Q1 := r;",
      "ori := ORIVANG(pos, r);",
      "ori := ORIQUAT(r, q, 0.0, 0.0);",
      "pos := pv @ pos; pv.POS.Z := r;",
      "r := ANGLEX('XYZ', ori); ori := ORIZYX(r, q, 0.0);",
      "r := QUATA(ori); ori := ORIZYX(r, q, 0.0);",
      "r := ROTANGLE(ori); ori := ORIZYX(r, q, 0.0);",
      "pos := VECTORN(ori); ori := ORIZYX(r, q, 0.0);",
      "pos := CROSS(pos, pos); pos.X := r;",
      "r := DOT(pos, pos);",
      "c := 'x';",
      "c := s[1];",
      "jv := TRAFOINV(tv);",
      "tv := TRAFO(jv);",
      "jv.M_JOINT.A1 := r;",
      "tv.PSE := pv;",
      "LIST_ADD(l, 1);",
      "i := l[1];",
      "OPEN(f, 'x', 'R');",
      "READ(f, i);",
      "CLOSE(f);",
      "WRITE(f, i);",
      "READ(i);",
      "ACQUIRE(sem);",
      "RELEASE(sem);",
      "s := CONCAT(s, t);",
      "ENABLE alarm;",
      "DISABLE alarm;",
      "jv.M_JOINT.A1 := 1.0; MOVE PTP jv;",
      "MOVE LIN POSITION(1.0, 2.0, 3.0);",
      "MOVE PTP ADD_JOINT(1.0);",
      "MOVE PATH " RMP_A ", " RMP_B ";",
      "MOVE_INC LIN POSE(POSITION(0.0, 0.0, 80.0), ORIZYX(10.0, 0.0, 0.0));",
      "MOVE LIN " RMP_A " TIME := 2.0;",
      "MOVE LIN " RMP_A " WOBBLE := TRUE;",
      "MOVE LIN " RMP_A " DEVICE := 2;",
      "TEACH pv;"};
  return kAll;
}
inline void expect_refused(const Post& post, const std::vector<std::string>& of_its_own,
                           const Station& station = {}, const std::vector<std::string>& said = {}) {
  std::set<std::string> want(refused_by_all().begin(), refused_by_all().end());
  want.insert(of_its_own.begin(), of_its_own.end());
  for (const std::string& s : said) want.erase(s);
  std::set<std::string> is;
  for (const std::string& l : lines(table(post, station))) is.insert(l);
  for (const std::string& s : is) EXPECT_TRUE(want.count(s)) << s << " is refused";
  for (const std::string& s : want) EXPECT_TRUE(is.count(s)) << s << " is said";
}
/// Wrong and extreme input: no crash, and a fault for each.
inline void expect_sane(const Post& post, const Station& setup = {}) {
  const std::string move = with("MOVE LIN " RMP_A ";");
  for (const double x : {std::nan(""), 1e300, -HUGE_VAL, 1e7}) {
    Station s = setup;
    s.change = [x](std::vector<PostPoint>& all) {
      for (PostPoint& p : all)
        if (p.has_pose) p.pose.p[0] = x;
    };
    EXPECT_GT(run(post, move, s).errors, 0) << x;
    s.change = [x](std::vector<PostPoint>& all) {
      for (PostPoint& p : all)
        if (p.has_pose) p.pose.R[4] = x;
    };
    if (!std::isfinite(x)) {
      EXPECT_GT(run(post, move, s).errors, 0) << x;
    }
  }
  Station joints = setup;
  joints.change = [](std::vector<PostPoint>& all) {
    for (PostPoint& p : all) p.q = {};
  };
  EXPECT_GT(run(post, with("MOVE PTP MAIN_JOINT(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);"), joints).errors,
            0);
  if (!(post.capabilities().forms & kPostStructured)) return;
  const std::string n(200, 'n');
  const Output out = run(post,
                         "PROGRAM p; VAR REAL: " + n + "a, " + n + "b; BEGIN " + n + "a := 1.0; " +
                             n + "b := " + n + "a * 2.0; MOVE LIN POSE(POSITION(" + n + "a, " + n +
                             "b, 0.0), ORIZYX(0.0, 0.0, 0.0)); ENDPROGRAM;",
                         setup);
  EXPECT_EQ(out.errors, 0) << out.faults;
  const std::string longer(static_cast<std::size_t>(post.capabilities().max_name) + 1, 'n');
  for (const auto& [f, text] : out.files) EXPECT_EQ(text.find(longer), std::string::npos);
}
/// Seconds of a post of so many motions.
inline double seconds(const Post& post, int motions, bool has_circles, bool has_joints,
                      const Station& station = {}) {
  const Motions m = straight_program(motions, 7, has_circles, has_joints);
  const auto tables = compiled(m.source);
  const auto points = program_post::known_points(tables->code(), nullptr, nullptr);
  PostProfile profile = station.profile;
  profile.options = station.options;
  PostTask task;
  task.code = &tables->code();
  task.name = "prog";
  task.points = points.points;
  task.profile = &profile;
  double best = 1e9;
  for (int k = 0; k < 2; ++k) {
    Output out;
    NoProgress progress;
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(post.write(task, NoParams{}, out, progress).ok());
    best = std::min(
        best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    EXPECT_EQ(out.errors, 0) << out.faults.substr(0, 300);
  }
  return best;
}
inline void expect_linear(const Post& post, bool has_circles, bool has_joints,
                          const Station& station = {}) {
  const double one = seconds(post, 1000, has_circles, has_joints, station);
  const double ten = seconds(post, 10'000, has_circles, has_joints, station);
  EXPECT_LT(ten, 30 * one + 0.05) << one;
  std::cout << "10,000 motions: " << ten * 1000 << " ms\n";
}

/// Whether a text is well-formed XML, and of a schema where one is given; nothing = there is no
/// xmllint here.
inline std::optional<bool> is_xml(const std::string& text, const std::string& schema = "") {
  if (std::system("xmllint --version >/dev/null 2>&1") != 0) return std::nullopt;
  const auto file =
      std::filesystem::temp_directory_path() /
      ("post_run_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) + "_" +
       std::to_string(reinterpret_cast<std::uintptr_t>(&text)) + ".xml");
  std::ofstream(file, std::ios::binary) << text;
  const std::string command = "xmllint --noout " +
                              (schema.empty() ? std::string() : "--schema '" + schema + "' ") +
                              "'" + file.string() + "' 2>/dev/null";
  const bool good = std::system(command.c_str()) == 0;
  std::filesystem::remove(file);
  return good;
}

/// What the golden texts are made of.
inline const std::string& pick() {
  static const std::string kAll = R"(PROGRAM pick;
SIGNAL
  INPUT BOOL: part AT 1;
  OUTPUT BOOL: grip AT 3;
CONST REAL: SLOW := 80.0;
VAR
  POSE: above := POSE(POSITION(550.0, -300.0, 200.0), ORIZYX(30.0, 20.0, 10.0));
  POSE: place := POSE(POSITION(550.0, 300.0, 80.0), ORIZYX(90.0, 180.0, 0.0));
  INT: good := 0;
BEGIN
  MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 90.0, 0.0) SPEED_PTP := 60.0;
  WHILE good < 5 DO
    WAIT FOR part TIMEOUT 2.0;
    MOVE PTP above;
    MOVE LIN above @ POSE(POSITION(0.0, 0.0, 100.0), ORIZYX(0.0, 0.0, 0.0)) SPEED := SLOW;
    grip := TRUE;
    WAIT 0.25 SEC;
    MOVE LIN above SPEED := 400.0, C_CP := 10.0;
    MOVE CIRCLE POSE(POSITION(600.0, 0.0, 200.0), ORIZYX(30.0, 20.0, 10.0)), place SPEED := 400.0;
    grip := FALSE;
    good := good + 1;
  ENDWHILE;
ENDPROGRAM;
)";
  return kAll;
}

}  // namespace robomosp::post_run

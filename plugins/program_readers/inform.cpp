// SPDX-License-Identifier: Apache-2.0
// Yaskawa INFORM: jobs .jbi with what a backup has of tools (TOOL.CND) and user frames
// (UFRAME.CND).
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kInformStyle{.comment = "'",
                         .quotes = "\"",
                         .name_first = "_",
                         .name_rest = "_#",
                         .signs = {"<>", "<=", ">="},
                         .has_lines = true,
                         .joins_in_brackets = false,
                         .hex = {}};
constexpr Binary kInformBinaries[] = {
    {"or", 10, Op::or_}, {"and", 12, Op::and_}, {"=", 20, Op::eq},  {"<>", 20, Op::ne},
    {"<", 20, Op::lt},   {">", 20, Op::gt},     {"<=", 20, Op::le}, {">=", 20, Op::ge},
    {"+", 30, Op::add},  {"-", 30, Op::sub},    {"*", 40, Op::mul}, {"/", 40, Op::div}};

/// Numbers between commas; nothing where there is something else.
std::optional<std::vector<double>> numbers_of_line(std::string_view s) {
  std::vector<double> out;
  std::size_t i = 0;
  while (i < s.size()) {
    while (i < s.size() && (s[i] == ' ' || s[i] == '\t' || s[i] == '\r')) ++i;
    if (i == s.size()) break;
    if (s[i] == '+') ++i;
    double v = 0;
    const auto r = std::from_chars(s.data() + i, s.data() + s.size(), v);
    if (r.ec != std::errc() || !(std::fabs(v) < 1e12) || out.size() > 100) return std::nullopt;
    out.push_back(v);
    i = static_cast<std::size_t>(r.ptr - s.data());
    while (i < s.size() && (s[i] == ' ' || s[i] == '\t' || s[i] == '\r')) ++i;
    if (i < s.size() && s[i] != ',') return std::nullopt;
    if (i < s.size()) ++i;
  }
  return out;
}

/// A position of a job, as its file has it.
struct InformPosition {
  std::string type;             ///< upper-case: PULSE, BASE, ROBOT, USER, ...
  std::vector<double> numbers;  ///< pulses, degrees, or mm and degrees
  std::vector<double> conf;     ///< RCONF
  int tool = 0, user = 0;
  At at;
};
struct InformJob {
  std::string name;
  std::size_t file = 0;
  std::map<std::string, InformPosition> positions;  ///< by kind and number: "C12"
  std::size_t begin = 0, end = 0;                   ///< of its instructions [bytes]
  std::uint32_t line = 1;
  At at;
};

class InformReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (const std::string e = extension(files_[f].name); e == "cnd") conditions(f);
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (extension(files_[f].name) != "cnd") head(f);
    if (jobs_.empty()) return;
    name_ = jobs_.front().name;
    for (std::size_t j = 1; j < jobs_.size(); ++j) announce(routine_of(jobs_[j].name), {}, kNone);
    for (std::size_t j = 0; j < jobs_.size(); ++j) {
      if (is_cancelled()) return;
      job_ = &jobs_[j];
      scan(job_->file, kInformStyle, {job_->begin, job_->end, job_->line});
      if (j > 0) begin(routine_of(job_->name), {}, kNone, job_->at);
      instructions();
      if (j > 0) close();
    }
  }

 private:
  std::span<const Binary> binaries() const override { return kInformBinaries; }
  bool divides_whole() const override { return true; }
  int not_precedence() const override { return 15; }
  static std::string routine_of(const std::string& job) { return "job_" + job; }

  // ---- the head of a job, and conditions ----

  struct FileLine {
    std::string_view text;  ///< without blanks around it
    At at;
  };
  std::vector<FileLine> lines_of(std::size_t f) const {
    std::vector<FileLine> out;
    const std::string_view text = files_[f].text;
    std::size_t at = 0;
    std::uint32_t line = 1;
    while (at < text.size()) {
      std::size_t end = text.find('\n', at);
      if (end == std::string_view::npos) end = text.size();
      std::size_t b = at, e = end;
      while (b < e && (text[b] == ' ' || text[b] == '\t' || text[b] == '\r')) ++b;
      while (e > b && (text[e - 1] == ' ' || text[e - 1] == '\t' || text[e - 1] == '\r' ||
                       text[e - 1] == '\x1a'))
        --e;
      out.push_back({text.substr(b, e - b),
                     {static_cast<std::uint32_t>(f), line, static_cast<std::uint32_t>(b - at + 1),
                      static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(e)}});
      at = end + 1;
      ++line;
    }
    return out;
  }
  static std::string upper_text(std::string_view s) {
    std::string out(s);
    for (char& c : out)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    return out;
  }
  /// What follows a word of a head line, such as "///TOOL 3"; nothing = another line.
  static std::optional<std::string_view> behind(std::string_view line, std::string_view word) {
    if (line.size() < word.size() || upper_text(line.substr(0, word.size())) != word)
      return std::nullopt;
    std::string_view rest = line.substr(word.size());
    if (!rest.empty() && rest[0] != ' ' && rest[0] != '\t') return std::nullopt;
    while (!rest.empty() && (rest[0] == ' ' || rest[0] == '\t')) rest.remove_prefix(1);
    return rest;
  }
  /// TOOL.CND: a line of six numbers behind the name of each tool; UFRAME.CND: ////BUSER.
  void conditions(std::size_t f) {
    int tool = -1, user = -1;
    for (const FileLine& l : lines_of(f)) {
      if (const auto n = behind(l.text, "//TOOL")) {
        const auto v = numbers_of_line(*n);
        tool = v && v->size() == 1 ? static_cast<int>((*v)[0]) : -1;
        continue;
      }
      if (const auto n = behind(l.text, "//UFRAME")) {
        const auto v = numbers_of_line(*n);
        user = v && v->size() == 1 ? static_cast<int>((*v)[0]) : -1;
        continue;
      }
      if (const auto n = behind(l.text, "////BUSER"); n && user >= 0) {
        if (const auto v = numbers_of_line(*n); v && v->size() == 6) users_[user] = *v;
        user = -1;
        continue;
      }
      if (tool < 0 || l.text.empty() || l.text[0] == '/') continue;
      if (const auto v = numbers_of_line(l.text); v && v->size() == 6) tools_[tool] = *v;
      tool = -1;
    }
  }
  void head(std::size_t f) {
    InformJob job;
    job.file = f;
    job.name = std::string(stem(files_[f].name));
    std::string type = "PULSE";
    std::vector<double> conf;
    int tool = 0, user = 0;
    bool is_job = false, is_begun = false, is_ended = false;
    const auto lines = lines_of(f);
    for (const FileLine& l : lines) {
      if (l.text.empty() || is_ended) continue;
      if (is_begun) {
        if (upper_text(l.text) != "END") continue;
        is_ended = true;
        job.end = l.at.begin;
        continue;
      }
      const std::string up = upper_text(l.text);
      if (up == "/JOB") {
        is_job = true;
        job.at = l.at;
      } else if (const auto n = behind(l.text, "//NAME")) {
        if (!n->empty()) job.name = std::string(*n);
      } else if (const auto t = behind(l.text, "///TOOL")) {
        const auto v = numbers_of_line(*t);
        tool = v && !v->empty() ? static_cast<int>(v->front()) : 0;
      } else if (const auto u = behind(l.text, "///USER")) {
        const auto v = numbers_of_line(*u);
        user = v && !v->empty() ? static_cast<int>(v->front()) : 0;
      } else if (const auto p = behind(l.text, "///POSTYPE")) {
        type = upper_text(*p);
        conf.clear();
      } else if (const auto c = behind(l.text, "///RCONF")) {
        conf = numbers_of_line(*c).value_or(std::vector<double>{});
      } else if (up == "NOP") {
        if (!is_job) break;
        is_begun = true;
        job.begin = l.at.end;
        job.line = l.at.line;
        job.end = files_[f].text.size();
      } else if (const std::size_t sign = l.text.find('=');
                 sign != std::string_view::npos && l.text[0] != '/') {
        const std::string key = position_key(l.text.substr(0, sign));
        auto v = numbers_of_line(l.text.substr(sign + 1));
        if (key.empty() || !v) fail(l.at, "this is not a position of a job (a name and numbers)");
        else job.positions[key] = {type, std::move(*v), conf, tool, user, l.at};
      } else if (const auto g = behind(l.text, "///GROUP2"); g && !g->empty()) {
        fail(l.at, "jobs that move two robots together are not read");
      }
    }
    if (!is_job || !is_begun) {
      fail(lines.empty() ? At{static_cast<std::uint32_t>(f), 1, 1, 0, 0} : lines.front().at,
           "this is not a job: /JOB at the beginning and NOP before the instructions are missing",
           "Controllers save jobs as .JBI.");
      return;
    }
    if (!is_ended) warn(lines.back().at, "the job has no END", "Check that the file is complete.");
    jobs_.push_back(std::move(job));
  }
  /// "C00012", "P012", "BC00012" as "C12", "P12", "BC12"; empty = none of these.
  static std::string position_key(std::string_view s) {
    while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
    const std::size_t digits = s.find_first_of("0123456789");
    if (digits == std::string_view::npos || digits == 0 || s.size() - digits > 6) return {};
    const std::string kind = upper_text(s.substr(0, digits));
    if (kind != "C" && kind != "BC" && kind != "EC" && kind != "P" && kind != "BP" &&
        kind != "EX" && kind != "LP")
      return {};
    int n = 0;
    const auto r = std::from_chars(s.data() + digits, s.data() + s.size(), n);
    if (r.ec != std::errc() || r.ptr != s.data() + s.size()) return {};
    return kind + std::to_string(n);
  }

  // ---- positions ----

  static std::string pose_text(const std::vector<double>& v) {
    std::string out = "POSE(POSITION(";
    for (std::size_t i = 0; i < 3; ++i) out += (i ? ", " : "") + measure(v[i]).s;
    // Rx, Ry, Rz about fixed axes, one after the other.
    return out + "), ORIZYX(" + measure(v[5]).s + ", " + measure(v[4]).s + ", " + measure(v[3]).s +
           "))";
  }
  static Ex fixed_pose(const std::vector<double>& v) {
    Ex e = value(pose_text(v), kPose);
    e.is_constant = true;
    return e;
  }
  /// Pulses of an axis to degrees or mm; nothing = said.
  std::optional<double> of_pulses(double pulses, std::size_t axis, const At& at) {
    const auto all = params_.reals("pulses");
    if (axis < all.size() && all[axis] != 0) return pulses / all[axis];
    bad(at,
        "this position is in pulses, and the pulses per degree of axis " +
            std::to_string(axis + 1) + " are unknown",
        "Give the controller's record (profile = ...) with the axes' pulses, or settings = "
        "{pulses = {...}}: pulses per degree of each axis.");
    return std::nullopt;
  }
  struct Place {
    Ex target;
    bool is_joints = false;
    int tool = 0, user = 0;
    std::vector<double> numbers;  ///< to see whether two are one
  };
  /// The position at this place, with additional axes behind it.
  std::optional<Place> place_here() {
    const At at = here();
    const std::string key = peek().kind == Tk::name ? position_key(peek().raw) : std::string();
    if (key.empty() || key[0] == 'B' || key[0] == 'E') {
      bad(at, "a position of the job is expected here, such as C00000");
      return std::nullopt;
    }
    next();
    std::vector<std::pair<std::string, At>> more;
    while (peek().kind == Tk::name) {
      const std::string k = position_key(peek().raw);
      if (k.empty() || (k[0] != 'B' && k[0] != 'E')) break;
      more.emplace_back(k, next().at);
    }
    const auto found = job_->positions.find(key);
    if (found == job_->positions.end()) {
      bad(at,
          key[0] == 'C' ? "the job has no position " + key
                        : "the value of position variable " + key + " is stored on the controller",
          key[0] == 'C' ? "" : "Use a position of the job (C), or save the job with its values.");
      return std::nullopt;
    }
    const InformPosition& p = found->second;
    const bool is_pulse = p.type == "PULSE", is_angle = p.type == "ANGLE";
    std::vector<Ex> external;
    std::size_t axis = p.numbers.size();
    for (const auto& [k, where] : more) {
      const auto e = job_->positions.find(k);
      if (e == job_->positions.end()) {
        bad(where, "the job has no position " + k);
        return std::nullopt;
      }
      if (!is_pulse && !is_angle && k[0] == 'B') {
        bad(where, "poses of a robot on a base axis are not read", "Save the job in pulses.");
        return std::nullopt;
      }
      if (!is_pulse && !is_angle) axis = std::max<std::size_t>(axis, 6);
      for (const double v : e->second.numbers) {
        const auto one = is_pulse ? of_pulses(v, axis++, where) : std::optional<double>(v);
        if (!one) return std::nullopt;
        external.push_back(measure(*one));
      }
    }
    Place out;
    out.tool = p.tool;
    out.user = p.type == "USER" ? p.user : -1;
    out.numbers = p.numbers;
    if (is_pulse || is_angle) {
      if (p.numbers.size() < 4 || p.numbers.size() > 8) {
        bad(p.at, "an axis position has from 4 to 8 numbers, but this one " +
                      std::to_string(p.numbers.size()));
        return std::nullopt;
      }
      learned_.axes = std::max(learned_.axes, static_cast<int>(p.numbers.size()));
      std::vector<Ex> q;
      for (std::size_t i = 0; i < p.numbers.size(); ++i) {
        const auto v =
            is_pulse ? of_pulses(p.numbers[i], i, at) : std::optional<double>(p.numbers[i]);
        if (!v) return std::nullopt;
        q.push_back(measure(*v));
      }
      out.target = joints(q, external);
      out.is_joints = true;
      return out;
    }
    if (p.type != "BASE" && p.type != "ROBOT" && p.type != "USER") {
      bad(at, "positions of type " + p.type.substr(0, 40) + " are not read",
          "Save them in BASE or in PULSE.");
      return std::nullopt;
    }
    if (p.numbers.size() < 6) {
      bad(p.at, "a pose must have six numbers, but this one " + std::to_string(p.numbers.size()));
      return std::nullopt;
    }
    const Ex pose = fixed_pose(p.numbers);
    if (p.conf.size() < 6) {
      out.target = external.empty() ? pose : target(pose, integer(0), {}, external);
      return out;
    }
    // 1 no flip, 1 lower elbow, 1 behind; then R, T and S at 180 degrees or more.
    const int status =
        (p.conf[2] != 0 ? 1 : 0) + (p.conf[1] != 0 ? 2 : 0) + (p.conf[0] == 0 ? 4 : 0);
    if ((p.conf[3] != 0 || p.conf[4] != 0 || p.conf[5] != 0) &&
        said_turns_.insert(p.at.begin).second)
      fail(p.at,
           "an axis of this position is beyond 180 degrees, but RCONF does not give the side; turn "
           "0 is assumed",
           "Save the position in pulses.");
    out.target = target(pose, integer(status), std::vector<Ex>(6, integer(0)), external);
    return out;
  }
  /// TOOL and FRAME of a place in space.
  void frames(Motion& m, const Place& p, const At& at) {
    m.has_frames = false;
    if (p.is_joints) return;
    const auto look = [&](const std::map<int, std::vector<double>>& all, int n, const char* what,
                          const char* file) {
      const auto it = all.find(n);
      if (it != all.end()) return fixed_pose(it->second);
      if (said_places_.insert(what + std::to_string(n)).second)
        fail(at,
             std::string("the value of ") + what + " " + std::to_string(n) +
                 " is known only to the controller; zero is assumed",
             std::string("Read the job beside ") + file + " of the backup.");
      return identity();
    };
    if (tools_.contains(p.tool) || p.tool != 0) {
      m.attributes.emplace_back("TOOL", look(tools_, p.tool, "tool", "TOOL.CND"));
    } else if (!std::exchange(told_tool_, true)) {
      note(at, "tool 0 is taken as the robot's present tool",
           "TOOL.CND of the backup contains its tip.");
    }
    if (p.user >= 0)
      m.attributes.emplace_back("FRAME", look(users_, p.user, "user frame", "UFRAME.CND"));
  }

  // ---- values ----

  Ex primary() override {
    if (auto e = literal_here()) return *e;
    const Token t = peek();
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      e.is_grouped = true;
      e.s = "(" + e.s + ")";
      e.prec = kPrimary;
      return e;
    }
    if (t.kind != Tk::name) return bad(t.at, "a value is expected here");
    if (t.low == "on" || t.low == "off") {
      next();
      return boolean(t.low == "on");
    }
    if (t.raw.ends_with('#')) return signal_here();
    return variable_here();
  }
  /// B, I, D (whole) and R of the controller, and L before it of a job.
  Ex variable_here() {
    const Token t = next();
    std::string_view s = t.low;
    const bool is_local = s.size() > 1 && s[0] == 'l';
    if (is_local) s.remove_prefix(1);
    const bool is_number = s.size() > 1 && s.size() < 6 &&
                           s.substr(1).find_first_not_of("0123456789") == std::string_view::npos;
    if (!is_number || (s[0] != 'b' && s[0] != 'i' && s[0] != 'd' && s[0] != 'r'))
      return bad(t.at, "\"" + std::string(t.raw.substr(0, 40)) +
                           "\" is not a numeric variable (B, I, D, R)");
    if (is("[")) return bad(t.at, "variables with computed numbers are not read");
    std::string name = upper_text(t.raw);
    if (is_local) name += "_" + job_->name;
    if (!is_local && !std::exchange(told_variables_, true))
      warn(t.at, "variables start at 0: their values are stored on the controller");
    const Symbol& v = implied(name, s[0] == 'r' ? kReal : kInt, t.at);
    return place(v.irl, v.type);
  }
  /// IN#(n), OT#(n), IG#(n), OG#(n), IGH#(n), OGH#(n), AO#(n), AI#(n).
  Ex signal_here() {
    const Token t = next();
    if (!expect("(")) return failed();
    const Token n = peek();
    if (n.kind != Tk::number || !n.is_integer || n.value < 1 || n.value > 99999)
      return bad(n.at, "signals with computed numbers are not read");
    next();
    if (!expect(")")) return failed();
    const auto number = static_cast<std::int64_t>(n.value);
    const std::string& w = t.low;
    if (w == "in#" || w == "ot#" || w == "out#") {
      const Symbol& s = signal(w != "in#", number);
      return place(s.irl, s.type);
    }
    if (w == "ig#" || w == "og#") {
      const Symbol& s = signal(w == "og#", (number - 1) * 8 + 1, 8);
      return place(s.irl, s.type);
    }
    if (w == "igh#" || w == "ogh#") {
      const Symbol& s = signal(w == "ogh#", (number - 1) * 4 + 1, 4);
      return place(s.irl, s.type);
    }
    if (w == "ao#" || w == "ai#") {
      const Symbol& s = named_signal(upper_text(w.substr(0, 2)) + "_" + std::to_string(number),
                                     w == "ao#", kReal, t.at, number);
      return place(s.irl, s.type);
    }
    return bad(t.at, "signals " + std::string(t.raw.substr(0, 40)) + " are not read");
  }

  // ---- instructions ----

  void instructions() {
    loops_.clear();
    circle_.clear();
    last_.clear();
    find_labels();
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        next();
        continue;
      }
      const At at = here();
      statement(at, [&] {
        one();
        if (!at_line_end())
          bad(here(),
              "\"" + std::string(peek().raw.substr(0, 40)) + "\" of this instruction is not read");
      });
      skip_line();
      if (is_cancelled()) return;
    }
    close_blocks(here());
  }
  /// A word behind a sign or a colon, with whatever letters names of jobs and labels have.
  std::string raw_name() {
    const std::string_view text = files_[job_->file].text;
    const std::size_t from = here().begin;
    std::size_t to = from;
    while (to < text.size() && std::string_view(" \t\r\n").find(text[to]) == std::string_view::npos)
      ++to;
    while (!at_line_end() && here().begin < to) next();
    return std::string(text.substr(from, to - from));
  }
  /// A number or variable behind "TAG=".
  std::optional<Ex> tag(std::string_view word) {
    if (!is(word) || !is("=", 1)) return std::nullopt;
    next();
    next();
    return primary();
  }
  /// IF and a condition at the end of a statement; "" = none.
  std::string guard(const At& at) {
    if (!accept("if")) return {};
    const Ex c = converted(expression(), kBool, at);
    return c.ok ? c.s : std::string("FALSE");
  }
  void guarded(const std::string& text, const At& at) {
    const std::string c = guard(at);
    emit(c.empty() ? text : "IF " + c + " THEN " + text + " ENDIF;", at);
  }
  void one() {
    const Token t = peek();
    const At at = t.at;
    if (t.kind == Tk::sign && t.low == "*") {
      next();
      emit("LABEL " + label("label_" + raw_name()) + ":", at);
      return;
    }
    if (t.kind != Tk::name) {
      bad(at, "an instruction must begin with its name");
      return;
    }
    const std::string w = t.low;
    next();
    if (w == "movj" || w == "movl") return motion(w == "movl", at);
    if (w == "movc") return circle(at);
    if (w == "nop") return;
    if (w == "end" || w == "ret") return guarded("RETURN;", at);
    if (w == "pause") return guarded("PAUSE;", at);
    if (w == "abort") return guarded("HALT;", at);
    if (w == "speed") return speeds(at);
    if (w == "timer") {
      const auto v = tag("t");
      if (!v) {
        bad(at, "TIMER takes T=");
        return;
      }
      if (v->ok) emit("WAIT " + within(seconds(*v, at), kSum) + " SEC;", at);
      return;
    }
    if (w == "dout") return output(at);
    if (w == "aout") {
      const Ex to = primary();
      const Ex v = as_real(expression(), at);
      if (to.ok && v.ok) assign(to, v, at);
      return;
    }
    if (w == "din") {
      const Ex to = primary();
      const Ex from = primary();
      if (to.ok && from.ok) assign(to, converted(from, to.type, at), at);
      return;
    }
    if (w == "pulse") return pulse(at);
    if (w == "wait") return wait(at);
    if (w == "jump") return jump(at);
    if (w == "call") return call_job(at);
    if (w == "msg") {
      const Ex e = primary();
      if (e.ok) emit("WRITELN(" + e.s + ");", at);
      return;
    }
    if (w == "cls") {
      left_out(RMP_FAULT_WARNING, at, "CLS neither moves a robot nor switches a signal");
      return;
    }
    if (w == "set" || w == "add" || w == "sub" || w == "mul" || w == "div" || w == "mod")
      return compute(w, at);
    if (w == "inc" || w == "dec") {
      const Ex v = primary();
      if (v.ok && v.is_place) emit(v.s + " := " + v.s + (w == "inc" ? " + 1;" : " - 1;"), at);
      else if (v.ok) bad(at, "only variables can be incremented or decremented");
      return;
    }
    if (w == "clear") {
      const Ex v = primary();
      const Token n = peek();
      if (n.kind != Tk::number || n.value != 1) {
        bad(n.at, "CLEAR of several variables is not read");
        return;
      }
      next();
      if (v.ok && v.is_place) assign(v, v.type.k == K::real ? real(0) : integer(0), at);
      return;
    }
    if (w == "ifthen" || w == "ifthenexp") {
      const std::string c = truth(at);
      emit("IF " + c + " THEN", at);
      open_block("endif", "ENDIF");
      return;
    }
    if (w == "elseif" || w == "elseifexp") {
      const std::string c = truth(at);
      if (is_in("endif")) between("ELSIF " + c + " THEN", at);
      else bad(at, "no IFTHEN is open here");
      return;
    }
    if (w == "else") {
      if (is_in("endif")) between("ELSE", at);
      else bad(at, "no IFTHEN is open here");
      return;
    }
    if (w == "while" || w == "whileexp") {
      const std::string c = truth(at);
      emit("WHILE " + c + " DO", at);
      open_block("endwhile", "ENDWHILE");
      return;
    }
    if (w == "endif" || w == "endwhile" || w == "endswitch") {
      close_block(w, at);
      return;
    }
    if (w == "for") return for_loop(at);
    if (w == "next") {
      const Ex v = primary();
      if (v.ok && (loops_.empty() || loops_.back() != v.s)) {
        bad(at, "NEXT names a different variable than FOR");
        return;
      }
      if (close_block("next", at) && !loops_.empty()) loops_.pop_back();
      return;
    }
    if (w == "switch") {
      open_case("endswitch", at);
      if (is("case")) case_arm(at);
      return;
    }
    if (w == "case") {
      at_ -= 1;
      return case_arm(at);
    }
    if (w == "default") {
      if (is_in("endswitch")) open_default(at);
      else bad(at, "no SWITCH is open here");
      return;
    }
    skip_rest();
    bad(at, upper_text(w.substr(0, 40)) + " is not read: IRL has no counterpart");
  }
  void case_arm(const At& at) {
    next();
    const Ex v = expression();
    if (!is_in("endswitch")) {
      bad(at, "no SWITCH is open here");
      return;
    }
    open_arm({{v}}, at);
  }
  void for_loop(const At& at) {
    const Ex v = primary();
    accept("start");
    const bool has_sign = expect("=");
    const Ex from = has_sign ? as_integer(expression(), at) : failed();
    const bool has_to = has_sign && expect("to");
    const Ex to = has_to ? as_integer(expression(), at) : failed();
    std::string step;
    if (accept("step")) {
      accept("=");
      const Ex s = as_integer(expression(), at);
      if (s.ok && s.is_literal && s.v < 0) {
        bad(at, "a loop that counts down is not read");
      } else if (s.ok) {
        step = " STEP " + within(s, kSum);
      }
    }
    const std::string name = v.ok && v.is_place ? v.s : declared_counter(at);
    emit("FOR " + name + " := " + (from.ok ? from.s : "0") + " TO " + (to.ok ? to.s : "0") + step +
             " DO",
         at);
    open_block("next", "ENDFOR");
    loops_.push_back(name);
  }
  std::string declared_counter(const At& at) { return implied("counted", kInt, at).irl; }
  Ex seconds(const Ex& v, const At& at) {
    // Variables count hundredths.
    return v.is_literal ? as_real(v, at) : scaled(as_real(v, at), 0.01);
  }
  void output(const At& at) {
    const Ex to = primary();
    Ex v = expression();
    if (!to.ok || !v.ok) return;
    if (to.type.k == K::boolean && v.type.k == K::integer && !v.is_literal)
      v = value(within(v, kSign) + " MOD 2 = 1", kBool, kRel);  // bit 0 of it
    const Ex x = converted(v, to.type, at);
    if (x.ok) assign(to, x, at);
  }
  void pulse(const At& at) {
    const Ex to = primary();
    const auto t = tag("t");
    if (!to.ok) return;
    const Ex s = t ? seconds(*t, at) : real(0.3);
    if (!s.ok) return;
    emit(to.s + " := TRUE;", at);
    emit("WAIT " + within(s, kSum) + " SEC;", at);
    emit(to.s + " := FALSE;", at);
    warn(at, "the IRL program waits for the end of the pulse; the controller does not");
  }
  void wait(const At& at) {
    const Ex c = converted(expression(), kBool, at);
    const auto t = tag("t");
    if (!c.ok) return;
    emit("WAIT FOR " + c.s + (t ? " TIMEOUT " + within(seconds(*t, at), kSum) : "") + ";", at);
  }
  void jump(const At& at) {
    if (!accept("*")) {
      skip_rest();
      bad(at, "only jumps to a label of the job are read");
      return;
    }
    const std::string to = "label_" + raw_name();
    if (!blocks_.empty()) {
      skip_rest();
      bad(at, "a jump out of a block is not read", "Write it with IFTHEN or WHILE.");
      return;
    }
    if (!has_job_label(to)) {
      skip_rest();
      bad(at, "the label *" + to.substr(6, 40) + " is not in this job");
      return;
    }
    guarded("GOTO " + label(to) + ";", at);
  }
  [[nodiscard]] bool has_job_label(const std::string& to) const { return labels_.contains(to); }
  void find_labels() {
    labels_.clear();
    const std::string_view text = std::string_view(files_[job_->file].text).substr(0, job_->end);
    std::size_t at = job_->begin;
    while (at < text.size()) {
      std::size_t end = text.find('\n', at);
      if (end == std::string_view::npos) end = text.size();
      std::string_view l = text.substr(at, end - at);
      while (!l.empty() && (l[0] == ' ' || l[0] == '\t')) l.remove_prefix(1);
      if (!l.empty() && l[0] == '*') {
        l.remove_prefix(1);
        while (!l.empty() && (l[0] == ' ' || l[0] == '\t')) l.remove_prefix(1);
        labels_.insert("label_" + std::string(l.substr(0, l.find_first_of(" \t\r"))));
      }
      at = end + 1;
    }
  }
  void call_job(const At& at) {
    if (!accept("job") || !accept(":")) {
      skip_rest();
      bad(at, "only calls of a job by its name (JOB:) are read");
      return;
    }
    const std::string name = raw_name();
    if (!is("if") && !at_line_end()) {
      skip_rest();
      bad(at, "arguments of a job are not read");
      return;
    }
    const bool is_there = std::any_of(jobs_.begin(), jobs_.end(), [&](const InformJob& j) {
      return lower(j.name) == lower(name);
    });
    if (is_there && lower(name) == lower(jobs_.front().name)) {
      skip_rest();
      bad(at, "a recursive call of the job being read is not read");
      return;
    }
    if (!is_there) {
      skip_rest();
      bad(at, "job " + name.substr(0, 40) + " is not among the files",
          "Read the program together with " + name.substr(0, 40) + ".JBI.");
      return;
    }
    const std::string text = call(routine_of(name), {}, at);
    if (!text.empty()) guarded(text + ";", at);
  }
  void compute(const std::string& w, const At& at) {
    const Ex to = primary();
    Ex v = accept("express") ? expression() : primary_or_signed();
    if (!to.ok || !v.ok) return;
    if (!to.is_place || !is_number(to.type)) {
      bad(at, "only numeric variables can be assigned");
      return;
    }
    if (w != "set") {
      const Op op = w == "add"   ? Op::add
                    : w == "sub" ? Op::sub
                    : w == "mul" ? Op::mul
                    : w == "div" ? Op::div
                                 : Op::mod;
      Ex self = to;
      v = binary(op, self, v, at);
      if (!v.ok) return;
    }
    if (to.type.k == K::integer && v.type.k == K::real && !v.is_literal)
      v = value("TRUNC(" + v.s + ")", kInt);
    assign(to, v, at);
  }
  Ex primary_or_signed() {
    if (accept("-")) return negative(primary());
    return primary();
  }

  // ---- motions ----

  /// Variables count hundredths of % and tenths of mm/s and degrees/s.
  Ex rate(const Ex& v, double unit, const At& at) {
    return v.is_literal ? as_real(v, at) : scaled(as_real(v, at), unit);
  }
  void speeds(const At& at) {
    bool any = false;
    for (;;) {
      if (const auto v = tag("vj")) set("joint_speed", rate(*v, 0.01, at), at);
      else if (const auto l = tag("v")) set("speed", rate(*l, 0.1, at), at);
      else if (const auto r = tag("vr")) set("turn_speed", rate(*r, 0.1, at), at);
      else break;
      any = true;
    }
    if (!any) bad(at, "SPEED takes VJ=, V= or VR=");
  }
  [[nodiscard]] double level_mm() const { return params_.real("pl_mm") * 1000; }
  /// Tags behind the position: speed, level, acceleration, UNTIL.
  struct Tags {
    std::optional<Ex> speed, turn;
    double level = -1, acc = 100, dec = 100;
    std::string until;
    bool is_fine = true, has_end = false;
  };
  Tags tags(bool is_joint, const At& at) {
    Tags out;
    const auto number = [&](const std::optional<Ex>& e, double& to, double least, double most) {
      if (!e) return false;
      if (!e->ok || !e->is_literal || e->v < least || e->v > most) {
        bad(at, "a number from " + number_text(least) + " to " + number_text(most) +
                    " is expected after this tag");
        out.is_fine = false;
      }
      to = e->v;
      return true;
    };
    while (!at_line_end() && out.is_fine) {
      if (auto v = tag("vj")) {
        out.speed = rate(*v, 0.01, at);
        if (!is_joint) bad(at, "VJ= belongs to MOVJ");
      } else if (auto l = tag("v")) {
        out.speed = rate(*l, 0.1, at);
        if (is_joint) bad(at, "V= belongs to MOVL and MOVC");
      } else if (auto r = tag("vr")) {
        out.turn = rate(*r, 0.1, at);
      } else if (number(tag("pl"), out.level, 0, 8) || number(tag("acc"), out.acc, 20, 100) ||
                 number(tag("dec"), out.dec, 20, 100)) {
        continue;
      } else if (accept("fpt")) {
        out.has_end = true;
      } else if (accept("until")) {
        const Ex c = converted(expression(), kBool, at);
        if (c.ok) out.until = c.s;
        else out.is_fine = false;
      } else {
        break;
      }
    }
    return out;
  }
  void attributes(Motion& m, const Tags& g, bool is_joint, const At& at) {
    const auto& speed = g.speed;
    if (is_joint) {
      if (speed) m.attributes.emplace_back("SPEED_PTP", *speed);
      else if (is_set("joint_speed"))
        m.attributes.emplace_back("SPEED_PTP", get("joint_speed", kReal, at));
      else if (!std::exchange(told_speed_, true)) warn(at, "no VJ= is given before this motion");
    } else {
      if (speed) m.attributes.emplace_back("SPEED", *speed);
      else if (is_set("speed")) m.attributes.emplace_back("SPEED", get("speed", kReal, at));
      else if (!std::exchange(told_speed_, true))
        warn(at, "no V= is given before this motion", "R_SPEED counts.");
      if (g.turn) m.attributes.emplace_back("SPEED_ORI", *g.turn);
      else if (is_set("turn_speed"))
        m.attributes.emplace_back("SPEED_ORI", get("turn_speed", kReal, at));
    }
    if (g.level > 0) {
      // Levels pass ever farther away: the option pl_mm says how many mm one has.
      if (is_joint) m.attributes.emplace_back("C_PTP", measure(g.level * 100 / 8));
      else m.attributes.emplace_back("C_CP", measure(g.level * level_mm()));
      if (!std::exchange(told_level_, true))
        note(at,
             "a level PL is taken as " + number_text(level_mm()) +
                 " mm of a path, and as an eighth of a joint motion",
             "settings = {pl_mm = ...} changes this distance.");
    } else if (g.level < 0 && !std::exchange(told_stop_, true)) {
      note(at, "a motion without PL is assumed to stop at its end");
    }
    const double acc = std::min(g.acc, g.dec);
    if (acc < 100) m.attributes.emplace_back(is_joint ? "ACC_PTP" : "ACC", measure(acc));
    if (g.acc != g.dec && !std::exchange(told_dec_, true))
      warn(at, "ACC and DEC differ: the lower one is used for both");
    m.until = g.until;
  }
  void motion(bool is_straight, const At& at) {
    circle_.clear();
    const auto to = place_here();
    if (!to) {
      skip_rest();
      return;
    }
    const Tags g = tags(!is_straight, at);
    if (!g.is_fine || !at_line_end()) return;
    if (g.has_end) {
      bad(at, "FPT belongs to MOVC");
      return;
    }
    Motion m;
    m.word = is_straight ? "LIN" : "PTP";
    m.targets.push_back(is_straight ? as_place(to->target) : to->target);
    attributes(m, g, !is_straight, at);
    frames(m, *to, at);
    last_ = to->numbers;
    move(std::move(m), at);
  }
  /// Three MOVC are an arc: the first goes straight to where it begins.
  void circle(const At& at) {
    auto to = place_here();
    if (!to) {
      skip_rest();
      circle_.clear();
      return;
    }
    const Tags g = tags(false, at);
    if (!g.is_fine || !at_line_end()) return;
    if (circle_.empty() || circle_.size() >= 3) {
      if (circle_.size() >= 3) {
        bad(at, "arcs that follow one another without FPT are not read",
            "Write three MOVC for each arc.");
        return;
      }
      const bool is_here = last_ == to->numbers;
      last_ = to->numbers;
      if (!is_here) {
        Motion m;
        m.word = "LIN";
        m.targets.push_back(as_place(to->target));
        attributes(m, g, false, at);
        frames(m, *to, at);
        move(std::move(m), at);
      }
      circle_.push_back(std::move(*to));
      return;
    }
    circle_.push_back(std::move(*to));
    if (circle_.size() < 3) {
      if (!next_is_circle()) bad(at, "an arc needs three MOVC, but this is the last one");
      return;
    }
    const Place& via = circle_[1];
    const Place& end = circle_[2];
    if (via.tool != end.tool || via.user != end.user) {
      bad(at, "the positions of an arc have different tools or frames");
      return;
    }
    Motion m;
    m.word = "CIRCLE";
    m.targets = {as_place(via.target), as_place(end.target)};
    attributes(m, g, false, at);
    frames(m, end, at);
    last_ = end.numbers;
    move(std::move(m), at);
    if (g.has_end) {
      // The next arc begins where this one ends.
      Place begin = end;
      circle_.clear();
      circle_.push_back(std::move(begin));
    }
  }
  /// Whether the next instruction is MOVC, comments between them apart.
  [[nodiscard]] bool next_is_circle() const {
    std::size_t k = 0;
    while (peek(k).kind == Tk::line) ++k;
    return is("movc", k);
  }

  std::vector<InformJob> jobs_;
  const InformJob* job_ = nullptr;
  std::map<int, std::vector<double>> tools_, users_;
  std::vector<std::string> loops_;
  std::vector<Place> circle_;
  std::vector<double> last_;
  std::set<std::uint32_t> said_turns_;
  std::set<std::string> said_places_, labels_;
  bool told_tool_ = false, told_variables_ = false, told_speed_ = false, told_level_ = false,
       told_stop_ = false, told_dec_ = false;
};

}  // namespace

std::vector<std::string> inform_needs(const SourceFile& file) {
  std::vector<std::string> out;
  if (extension(file.name) == "cnd") return out;
  const std::string low = lower(file.text);
  for (std::size_t at = low.find("job:"); at != std::string::npos; at = low.find("job:", at + 4)) {
    const std::size_t end = std::min(low.find_first_of(" \t\r\n", at), low.size());
    const std::string name = low.substr(at + 4, end - at - 4);
    if (!name.empty() && name.size() < 64 && out.size() < 200 &&
        name.find_first_of("/\\") == std::string::npos)
      out.push_back(name + ".jbi");
  }
  out.insert(out.end(), {"tool.cnd", "uframe.cnd"});
  return out;
}

Made read_inform(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<InformReader>(task, params, progress);
}

}  // namespace robomosp::readers

// SPDX-License-Identifier: Apache-2.0
// Mitsubishi MELFA-BASIC IV and V: .prg.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kMelfaStyle{.comment = "'",
                        .quotes = "\"",
                        .name_first = "_",
                        .name_rest = "_$",
                        .signs = {"<>", "><", "<=", "=<", ">=", "=>", "<<", ">>"},
                        .has_lines = true,
                        .joins_in_brackets = false,
                        .hex = "&h"};
constexpr Binary kMelfaBinaries[] = {
    {"or", 10, Op::or_}, {"xor", 11, Op::exor}, {"and", 12, Op::and_}, {"=", 20, Op::eq},
    {"<>", 20, Op::ne},  {"><", 20, Op::ne},    {"<", 20, Op::lt},     {">", 20, Op::gt},
    {"<=", 20, Op::le},  {"=<", 20, Op::le},    {">=", 20, Op::ge},    {"=>", 20, Op::ge},
    {"+", 30, Op::add},  {"-", 30, Op::sub},    {"mod", 35, Op::mod},  {"\\", 36, Op::idiv},
    {"*", 40, Op::mul},  {"/", 40, Op::div},    {"^", 50, Op::power}};

class MelfaReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    for (const char* percent : {"override", "joint_override"}) starts_with(percent, real(100));
    starts_with("continuous", boolean(false));
    starts_with("continuous_distance", real(0));
    // Programs that are called come first: what they have is theirs, and nothing else is there yet.
    for (std::size_t f = 1; f < files_.size(); ++f) announce(called_name(f), {}, kNone);
    for (std::size_t f = 1; f < files_.size(); ++f) called_program(f);
    scan(0, kMelfaStyle);
    whole_.clear();
    split();
    declare_positions();
    find_subroutines();
    // The program itself, without its subroutines.
    emit_lines(0, lines_.size(), {});
    for (std::size_t n = 0; n < subroutines_.size(); ++n) {
      const Subroutine s = subroutines_[n];
      begin(s.label, {}, kNone, tokens_[lines_[s.first].first].at);
      routine_ = s.label;
      emit_lines(s.first, s.end, s.label);
      routine_.clear();
      close();
    }
  }

 private:
  struct SourceLine {
    std::size_t first, end;  ///< tokens
    std::string label;
    bool has_number = false, is_data = false;
    std::int64_t number = -1;
  };
  struct Subroutine {
    std::string label;
    std::size_t first, end;
  };

  [[nodiscard]] std::string called_name(std::size_t file) const {
    return "program_" + std::string(stem(files_[file].name));
  }
  /// A program that another one calls by CallP: a procedure with variables of its own.
  void called_program(std::size_t file) {
    scan(file, kMelfaStyle);
    whole_.clear();
    lines_.clear();
    split();
    begin(called_name(file), {}, kNone, At{static_cast<std::uint32_t>(file), 1, 1, 0, 0});
    is_called_ = true;
    declare_positions();
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i)
      if (tokens_[i].kind == Tk::name && tokens_[i].low == "gosub") {
        fail(tokens_[i].at, "subroutines of a called program are not read",
             "Move them into the program, or read it separately.");
        break;
      }
    all_labels_.clear();
    used_lines_.clear();
    for (const SourceLine& l : lines_) all_labels_.insert(l.label);
    find_line_numbers();
    is_outside_.assign(lines_.size(), false);
    emit_lines(0, lines_.size(), {});
    is_called_ = false;
    close();
    lines_.clear();
    all_labels_.clear();
    line_numbers_.clear();
    used_lines_.clear();
  }
  /// A variable that its first use declares: of this program, and of no other.
  Symbol& own(std::string_view foreign, const Type& t, const At& at) {
    if (!is_called_ || find(lower(foreign))) return implied(foreign, t, at);
    Symbol& s = declare(foreign, t, Symbol::variable, true);
    declare_variable(s, {}, at, true);
    return s;
  }

  std::span<const Binary> binaries() const override { return kMelfaBinaries; }
  std::string_view not_word() const override { return "not"; }
  void skip_condition() override {
    while (!at_line_end() && !is("then")) next();
  }
  int not_precedence() const override { return 15; }

  // ---- lines ----

  void split() {
    bool has_numbers = false;
    for (std::size_t i = 0; i < tokens_.size();) {
      SourceLine l;
      l.first = i;
      while (i < tokens_.size() && tokens_[i].kind != Tk::line && tokens_[i].kind != Tk::end) ++i;
      l.end = i;
      ++i;
      if (l.first == l.end) continue;
      if (tokens_[l.first].kind == Tk::number && tokens_[l.first].is_integer) {
        l.has_number = has_numbers = true;
        l.number = static_cast<std::int64_t>(tokens_[l.first].value);
        ++l.first;
      }
      if (l.first < l.end && tokens_[l.first].low == "*" && l.first + 1 < l.end &&
          tokens_[l.first + 1].kind == Tk::name) {
        l.label = tokens_[l.first + 1].low;
        l.first += 2;
        if (l.first < l.end && tokens_[l.first].low == ":") ++l.first;
      }
      lines_.push_back(std::move(l));
    }
    const SourceLine* last_number = nullptr;
    for (const SourceLine& l : lines_)
      if (l.has_number) last_number = &l;
    bool is_behind_end = false;
    for (SourceLine& l : lines_) {
      if (l.first >= l.end) continue;
      const Token& t = tokens_[l.first];
      // P1=(...)(...)
      const bool is_list = t.kind == Tk::name && l.end - l.first > 4 && l.label.empty() &&
                           ((tokens_[l.first + 1].low == "=" && tokens_[l.first + 2].low == "(") ||
                            (tokens_[l.first + 1].low == "(" && tokens_[l.end - 1].low == ")"));
      bool has_comma = false;
      for (std::size_t k = l.first; k < l.end; ++k) has_comma = has_comma || tokens_[k].low == ",";
      const bool is_last = !last_number || &l >= last_number;
      l.is_data = is_list && has_comma && tokens_[l.first + 1].low == "=" && !l.has_number &&
                  (has_numbers || is_behind_end) && (is_last || is_behind_end);
      if (t.low == "end" && l.end == l.first + 1) is_behind_end = true;
    }
  }
  /// Lines of positions behind the program are values of variables.
  void declare_positions() {
    for (const SourceLine& l : lines_) {
      if (!l.is_data) continue;
      at_ = l.first;
      const At at = here();
      statement(at, [&] {
        const Token name = next();
        next();
        const Ex e = literal(name, at);
        if (!e.ok) return;
        if (!e.is_constant) {
          bad(at, "the values of a position after the program must be numbers");
          return;
        }
        learn(name.low, e.type);
        const Type t = learned_.types[name.low];
        if (is_called_ ? current().symbols.contains(name.low) : globals_.contains(name.low)) {
          bad(at, std::string(name.raw) + " has two values");
          return;
        }
        Symbol& s = declare(name.raw, t, Symbol::variable, is_called_);
        const Ex x = converted(e, t, at);
        declare_variable(s, x.s, at, is_called_);
        if (is_straight_) straight_.insert(s.irl);
      });
    }
  }
  void find_subroutines() {
    std::set<std::string> wanted;
    for (std::size_t i = 0; i + 2 < tokens_.size(); ++i)
      if (tokens_[i].kind == Tk::name && tokens_[i].low == "gosub" && tokens_[i + 1].low == "*")
        wanted.insert(tokens_[i + 2].low);
    is_outside_.assign(lines_.size(), false);
    for (std::size_t n = 0; n < lines_.size(); ++n) {
      if (lines_[n].label.empty()) continue;
      all_labels_.insert(lines_[n].label);
      if (!wanted.contains(lines_[n].label)) continue;
      if (std::any_of(subroutines_.begin(), subroutines_.end(),
                      [&](const Subroutine& s) { return s.label == lines_[n].label; })) {
        fail(tokens_[std::min(lines_[n].first, tokens_.size() - 1)].at,
             "the label " + lines_[n].label + " already exists");
        continue;
      }
      int depth = 0;
      std::size_t end = lines_.size();
      bool has_return = false;
      for (std::size_t k = n; k < lines_.size(); ++k) {
        const SourceLine& l = lines_[k];
        if (l.is_data) break;
        if (l.first >= l.end) continue;
        const std::string& w = tokens_[l.first].low;
        if (w == "if" && tokens_[l.end - 1].low == "then") ++depth;
        if (w == "while" || w == "for" || w == "select") ++depth;
        if (w == "endif" || w == "wend" || w == "next" ||
            (w == "end" && l.end - l.first == 2 && tokens_[l.first + 1].low == "select"))
          --depth;
        if (w == "return" && depth <= 0) {
          end = k + 1;
          has_return = true;
          break;
        }
      }
      const Token& t = tokens_[std::min(lines_[n].first, tokens_.size() - 1)];
      if (!has_return) {
        fail(t.at, "the subroutine " + lines_[n].label + " has no Return");
        for (std::size_t k = n; k < lines_.size(); ++k)
          if (lines_[k].is_data) {
            end = k;
            break;
          }
      }
      announce(lines_[n].label, {}, kNone);
      subroutines_.push_back({lines_[n].label, n, end});
      for (std::size_t k = n; k < end; ++k) is_outside_[k] = true;
    }
    // What runs into a subroutine runs on in the program, too.
    for (const Subroutine& s : subroutines_) {
      std::size_t k = s.first;
      while (k > 0 && (lines_[k - 1].first >= lines_[k - 1].end || lines_[k - 1].is_data)) --k;
      if (k == 0 || is_outside_[k - 1]) continue;
      const std::string& w = tokens_[lines_[k - 1].first].low;
      if (w != "end" && w != "goto" && w != "hlt" && w != "return" && w != "fend")
        fail(tokens_[lines_[s.first].first].at, "the program runs into the subroutine " + s.label,
             "End it before the subroutine.");
    }
    find_line_numbers();
  }
  void find_line_numbers() {
    for (const auto& l : lines_)
      if (l.has_number && l.number >= 0) line_numbers_.insert(l.number);
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i)
      if ((tokens_[i].low == "goto" || tokens_[i].low == "gosub" || tokens_[i].low == "then" ||
           tokens_[i].low == "else") &&
          tokens_[i + 1].kind == Tk::number && tokens_[i + 1].is_integer)
        used_lines_.insert(static_cast<std::int64_t>(tokens_[i + 1].value));
  }

  void emit_lines(std::size_t from, std::size_t to, const std::string& of) {
    labels_here_.clear();
    std::set<std::string> placed;
    for (std::size_t n = from; n < to; ++n)
      if (of.empty() ? !is_outside_[n] : true) {
        if (!lines_[n].label.empty()) labels_here_.insert(lines_[n].label);
        if (used_lines_.contains(lines_[n].number))
          labels_here_.insert("line_" + std::to_string(lines_[n].number));
      }
    blocks_.clear();
    goal_.clear();
    for (std::size_t n = from; n < to; ++n) {
      if (of.empty() && is_outside_[n]) continue;
      const SourceLine& l = lines_[n];
      if (l.is_data) continue;
      if (progress_.cancelled()) {
        statement(here(), [] {});
        return;
      }
      const At at = tokens_[std::min(l.first, l.end)].at;
      if (!l.label.empty()) {
        if (placed.insert(l.label).second) emit("LABEL " + label(l.label) + ":", at);
        else fail(at, "the label " + l.label + " already exists");
      }
      if (used_lines_.contains(l.number)) {
        const std::string line = "line_" + std::to_string(l.number);
        if (placed.insert(line).second) emit("LABEL " + label(line) + ":", at);
        else fail(at, "the line " + std::to_string(l.number) + " already exists");
      }
      // Whether the arm is still where the motion above has brought it.
      static const std::set<std::string, std::less<>> kStays{
          "mov", "mvs", "mvr", "cnt", "spd", "jovrd", "ovrd", "accel", "dly", "m_out"};
      if (!l.label.empty() || used_lines_.contains(l.number) || !blocks_.empty()) goal_.clear();
      if (l.first >= l.end) continue;
      if (!kStays.contains(tokens_[l.first].low)) goal_.clear();
      at_ = l.first;
      if (const std::size_t behind = timed_wait(n, to, at); behind > 0) {
        n = behind - 1;
        continue;
      }
      const bool is_last_return = !of.empty() && n + 1 == to && tokens_[l.first].low == "return";
      if (is_last_return) continue;
      statement(at, [&] {
        one();
        while (accept(":")) one();
        if (!at_line_end()) {
          bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
          skip_rest();
        }
      });
    }
    const At at = tokens_[std::min(tokens_.size() - 1, to > from ? lines_[to - 1].first : 0)].at;
    close_blocks(at);
  }

  /// A loop that looks at M_Timer while it waits is a WAIT FOR with TIMEOUT:
  ///   M_Timer(1)=0 / *A / If c Then GoTo *B / If M_Timer(1)<t*1000 Then GoTo *A / M=1 / *B
  /// Gives the line behind it that is read next; 0 = it is none.
  std::size_t timed_wait(std::size_t n, std::size_t to, const At& at) {
    const auto has = [&](std::size_t line, std::size_t k, auto... words) {
      const std::string_view all[] = {words...};
      for (const std::string_view w : all) {
        if (k >= lines_[line].end || (tokens_[k].low != w && tokens_[k].raw != w)) return false;
        ++k;
      }
      return true;
    };
    const auto is_plain = [&](std::size_t line) {
      return line < to && !lines_[line].is_data && lines_[line].label.empty() &&
             !used_lines_.contains(lines_[line].number);
    };
    const auto is_label = [&](std::size_t line) {
      return line < to && !lines_[line].label.empty() && lines_[line].first >= lines_[line].end;
    };
    if (n + 4 >= to || lines_[n].end - lines_[n].first != 6 || !is_label(n + 1) ||
        !is_plain(n + 2) || !is_plain(n + 3))
      return 0;
    const std::size_t f = lines_[n].first;
    const std::string timer(tokens_[f + 2].raw);
    if (!has(n, f, "m_timer", "(", timer, ")", "=", "0")) return 0;
    const SourceLine &until = lines_[n + 2], &again = lines_[n + 3];
    const std::string& begin = lines_[n + 1].label;
    std::size_t out = n + 4;
    const bool tells = is_plain(out) && lines_[out].end - lines_[out].first == 3 &&
                       has(out, lines_[out].first + 1, "=", "1");
    if (tells) ++out;
    if (out >= to || lines_[out].label.empty() || again.end < again.first + 11 ||
        until.end < until.first + 6)
      return 0;
    if (!has(n + 2, until.first, "if") ||
        !has(n + 2, until.end - 4, "then", "goto", "*", lines_[out].label) ||
        !has(n + 3, again.first, "if", "m_timer", "(", timer, ")", "<") ||
        !has(n + 3, again.end - 6, "*", "1000", "then", "goto", "*", begin))
      return 0;
    if (uses(begin) != 2) return 0;
    statement(at, [&] {
      const auto read = [&](std::size_t first, std::size_t end) {
        at_ = first;
        const Token kept = tokens_[end];
        tokens_[end].kind = Tk::line;
        Ex e = expression();
        if (e.ok && at_ != end) e = bad(here(), "this is not expected here");
        tokens_[end] = kept;
        return e;
      };
      const Ex c = converted(read(until.first + 1, until.end - 4), kBool, at);
      const Ex t = as_real(read(again.first + 6, again.end - 6), at);
      at_ = again.end;
      if (!c.ok || !t.ok) return;
      emit("WAIT FOR " + c.s + " TIMEOUT " + within(t, kSum) + ";", at);
      if (tells) {
        emit("IF R_TIMEOUT THEN", at);
        indented(1);
        at_ = lines_[out - 1].first;
        one();
        indented(-1);
        emit("ENDIF;", at);
      }
    });
    return out;
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (t.kind == Tk::sign && t.low == "*" && peek(1).kind == Tk::name) return jump(at);
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      return;
    }
    const bool is_assigned = is("=", 1);
    static const std::map<std::string, void (MelfaReader::*)(const At&), std::less<>> kWords{
        {"mov", &MelfaReader::motion},
        {"mvs", &MelfaReader::motion},
        {"mvr", &MelfaReader::arc},
        {"mvr2", &MelfaReader::no},
        {"mvr3", &MelfaReader::no},
        {"mvc", &MelfaReader::no},
        {"mva", &MelfaReader::no},
        {"mvspl", &MelfaReader::no},
        {"if", &MelfaReader::if_},
        {"else", &MelfaReader::else_},
        {"elseif", &MelfaReader::elseif},
        {"endif", &MelfaReader::end_word},
        {"for", &MelfaReader::for_},
        {"next", &MelfaReader::next_},
        {"while", &MelfaReader::while_},
        {"wend", &MelfaReader::end_word},
        {"select", &MelfaReader::select},
        {"case", &MelfaReader::case_},
        {"default", &MelfaReader::default_},
        {"break", &MelfaReader::break_},
        {"end", &MelfaReader::end},
        {"goto", &MelfaReader::jump},
        {"gosub", &MelfaReader::gosub},
        {"return", &MelfaReader::return_},
        {"on", &MelfaReader::on},
        {"dly", &MelfaReader::delay},
        {"wait", &MelfaReader::wait},
        {"hlt", &MelfaReader::halt},
        {"hopen", &MelfaReader::hand},
        {"hclose", &MelfaReader::hand},
        {"ovrd", &MelfaReader::speed},
        {"spd", &MelfaReader::speed},
        {"jovrd", &MelfaReader::speed},
        {"accel", &MelfaReader::accel},
        {"cnt", &MelfaReader::cnt},
        {"tool", &MelfaReader::frame},
        {"base", &MelfaReader::frame},
        {"def", &MelfaReader::def},
        {"dim", &MelfaReader::dim},
        {"callp", &MelfaReader::callp},
        {"act", &MelfaReader::act},
        {"rem", &MelfaReader::remark},
        {"error", &MelfaReader::error_},
        {"print", &MelfaReader::no},
        {"input", &MelfaReader::no},
        {"open", &MelfaReader::no},
        {"close", &MelfaReader::no},
        {"function", &MelfaReader::no},
        {"fend", &MelfaReader::no},
        {"plt", &MelfaReader::no},
        {"clr", &MelfaReader::no},
        {"reset", &MelfaReader::no},
        {"xrun", &MelfaReader::no},
        {"xstp", &MelfaReader::no},
        {"xrst", &MelfaReader::no},
        {"xload", &MelfaReader::no},
        {"xclr", &MelfaReader::no},
        {"title", &MelfaReader::remark},
        {"com", &MelfaReader::no},
        {"ret", &MelfaReader::no},
        {"skip", &MelfaReader::no},
        {"zone", &MelfaReader::no},
        {"cmp", &MelfaReader::no},
        {"fsc", &MelfaReader::no}};
    static const std::set<std::string, std::less<>> kHarmless{
        "servo", "fine",   "loadset", "oadl",  "getm", "relm", "colchk", "colset", "collvl", "torq",

        "prec",  "mvtune", "spdopt",  "cavchk"};
    if (t.low == "m_out" || !is_assigned) {
      if (const auto it = kWords.find(t.low);
          it != kWords.end() && !is_assigned && !(is("(", 1) && find(t.low))) {
        next();
        word_ = t.low;
        (this->*it->second)(at);
        return;
      }
      if (kHarmless.contains(t.low)) {
        skip_rest();
        left_out(RMP_FAULT_WARNING, at, "IRL has no counterpart of " + std::string(t.raw));
        return;
      }
    }
    assignment(at);
  }
  void no(const At& at) {
    skip_rest();
    bad(at, "IRL has no counterpart of this statement");
  }
  void remark(const At& at) {
    skip_rest();
    emit("{ " + source_line(at) + " }", at);
  }
  void error_(const At& at) {
    const Ex e = expression();
    if (e.ok) {
      emit("WRITELN('error ', " + e.s + ");", at);
      emit("HALT;", at);
    }
  }
  Ex with_offset(Ex e, const At& at) {
    if (!accept(",")) return e;
    const Ex z = as_real(expression(), at);
    if (!e.ok || !z.ok) return failed();
    if (e.type.k == K::joint) e = as_place(e);
    const Ex by =
        pose({real(0), real(0), z}, orientation("ORIQUAT", {real(1), real(0), real(0), real(0)}));
    return with_pose(e, binary(Op::compose, as_pose(e, at), by, at));
  }
  void attributes(Motion& m, bool is_joint, const At& at) {
    const auto percent = [&](const char* key) {
      return is_set(key) ? get(key, kReal, at) : real(100);
    };
    if (is_joint) {
      if (is_set("override") || is_set("joint_override")) {
        Ex e = binary(Op::mul, percent("joint_override"), percent("override"), at);
        const Ex a = percent("joint_override"), b = percent("override");
        if (a.is_constant && b.is_constant && !a.is_place && !b.is_place)
          e = measure(std::strtod(a.s.c_str(), nullptr) * std::strtod(b.s.c_str(), nullptr) / 100);
        else e = scaled(e, 0.01);
        m.attributes.emplace_back("SPEED_PTP", e);
      }
    } else if (is_set_before("speed", at)) {
      const Ex v = get("speed", kReal, at);
      Ex e = v;
      if (is_set("override")) {
        const Ex b = get("override", kReal, at);
        if (v.is_constant && b.is_constant && !v.is_place && !b.is_place)
          e = measure(std::strtod(v.s.c_str(), nullptr) * std::strtod(b.s.c_str(), nullptr) / 100);
        else e = scaled(binary(Op::mul, v, b, at), 0.01);
      }
      m.attributes.emplace_back("SPEED", e);
    }
    if (is_set("continuous")) {
      m.attributes.emplace_back("C_PASS", get("continuous", kBool, at));
      if (is_set_before("continuous_distance", at)) {
        if (is_joint && !std::exchange(told_zone_, true))
          note(at, "a distance in mm of a joint motion becomes C_PTP in %");
        Ex d = get("continuous_distance", kReal, at);
        if (is_joint) d = share_of_zone(d);
        m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", d);
      }
    }
  }
  /// A distance [mm] of a motion of joints as C_PTP [%].
  Ex share_of_zone(const Ex& mm) const {
    const double full = params_.real("c_ptp_mm") * 1000;
    char* end = nullptr;
    const double v = std::strtod(mm.s.c_str(), &end);
    if (mm.is_place || *end != '\0') return scaled(mm, 100 / full);
    return measure(std::min(100.0, v * 100 / full));
  }
  void skip_to_with() {
    while (!at_line_end() && !is("wth") && !is("wthif")) next();
  }
  /// Wth M_Out(1)=1, WthIf M_In(1)=1,Skip
  void tail(Motion m, const At& at) {
    if (accept("type")) {
      // The short way is that of turns that are not given.
      const bool is_short = peek().raw == "0" && is(",", 1) && peek(2).raw == "0" &&
                            m.targets.size() == 1 && any_turns_.contains(m.targets[0].s);
      if (!is_short) {
        skip_rest();
        bad(at, "IRL cannot choose how the tool rotates during a motion (Type)", "Take Type out.");
        return;
      }
      skip_to_with();
    }
    if (accept("wthif")) {
      const Ex c = converted(expression(), kBool, at);
      expect(",");
      if (accept("skip") && c.ok) {
        m.until = c.s;
        move(std::move(m), at);
        return;
      }
      bad(at, "WthIf has no counterpart in IRL, except with Skip");
      skip_rest();
      return;
    }
    if (accept("wth")) {
      const std::size_t before = current().body.size();
      assignment(at);
      if (current().body.size() > before)
        warn(at, "the statement after Wth is executed before the motion begins");
    }
    move(std::move(m), at);
  }
  void motion(const At& at) {
    const bool is_joint = word_ == "mov";
    Motion m;
    m.word = is_joint ? "PTP" : "LIN";
    if (is(",")) {
      skip_rest();
      bad(at, "IRL has no motions relative to the tool's present pose");
      return;
    }
    if (is("p_curr") && is("+", 1)) {
      next();
      next();
      m.is_incremental = true;
    }
    Ex e = expression();
    if (!e.ok) return;
    if (m.is_incremental) return step(std::move(m), e, is_joint, at);
    if (e.type.k != K::pose && e.type.k != K::target && e.type.k != K::joint) {
      bad(at, "this is not a position");
      return;
    }
    e = with_offset(e, at);
    if (e.type.k == K::joint) {
      m.has_frames = false;
      m.has_tool = is_joint;
      // IRL's TRAFO is of the robot's own tool.
      if (!is_joint && is_set_before("tool", at))
        fail(at, "a straight motion to joint values uses the robot's present tool here, not Tool",
             "Give a position.");
    }
    m.targets.push_back(is_joint ? e : as_place(e));
    attributes(m, is_joint, at);
    goal_ = !is("wthif") ? e.s : "";
    tail(std::move(m), at);
  }
  /// P_Curr+P1: by so much from where it is, where the tool does not turn.
  void step(Motion m, const Ex& e, bool is_joint, const At& at) {
    if (e.type.k != K::pose && e.type.k != K::target) {
      bad(at, "this is not a position");
      return;
    }
    if (is_set("frame")) {
      bad(at, "a step from P_Curr after Base is not read", "Give the target position itself.");
      return;
    }
    if (!straight_.contains(e.s) || learned_.flags.contains("assigned " + e.s)) {
      bad(at, "a step from P_Curr that may rotate the tool is not read",
          "Add a position with A, B and C equal to 0.");
      return;
    }
    const Ex p = as_pose(e, at);
    m.targets.push_back(value(within(p, kPrimary) + ".POS", kPosition));
    attributes(m, is_joint, at);
    goal_.clear();
    tail(std::move(m), at);
  }
  void arc(const At& at) {
    Motion to, m;
    m.word = "CIRCLE";
    const Ex a = as_place(expression());
    expect(",");
    const Ex b = as_place(expression());
    expect(",");
    const Ex c = as_place(expression());
    if (!a.ok || !b.ok || !c.ok) return;
    to.targets.push_back(a);
    m.targets = {b, c};
    attributes(to, false, at);
    attributes(m, false, at);
    if (goal_.empty() || goal_ != a.s) move(std::move(to), at);
    goal_ = !is("wthif") ? c.s : "";
    tail(std::move(m), at);
  }
  void simple(const At& at) {
    if (peek().kind == Tk::number && peek().is_integer) {
      const std::string n = "line_" + std::to_string(static_cast<std::int64_t>(next().value));
      if (labels_here_.contains(n)) emit("GOTO " + label(n) + ";", at);
      else bad(at, "the line does not exist here");
      return;
    }
    one();
  }
  void if_(const At& at) {
    const std::string c = truth(at);
    expect("then");
    emit("IF " + c + " THEN", at);
    if (at_line_end()) {
      open_block("endif", "ENDIF");
      return;
    }
    if (++nested_ > 30) {
      skip_rest();
      bad(at, "this is nested too deeply");
      --nested_;
      return;
    }
    open_block("one line", "ENDIF");
    const std::size_t depth = blocks_.size();
    const auto close_inner = [&] {
      for (; blocks_.size() > depth; close_block(std::string(blocks_.back().word), at)) {
        bad(at, "a block begins within a one-line If");
        if (is_in("next") && !steps_.empty()) steps_.pop_back();
      }
    };
    simple(at);
    while (accept(":")) simple(at);
    close_inner();
    if (accept("else")) {
      between("ELSE", at);
      if (!at_line_end()) simple(at);
      while (accept(":")) simple(at);
      close_inner();
    }
    accept("endif");
    --nested_;
    close_block("one line", at);
  }
  void else_(const At& at) {
    if (!is_in("endif")) {
      bad(at, "Else is outside If");
      skip_rest();
      return;
    }
    between("ELSE", at);
    if (!at_line_end()) simple(at);
  }
  void elseif(const At& at) {
    if (!is_in("endif")) {
      bad(at, "ElseIf is outside If");
      skip_rest();
      return;
    }
    const std::string c = truth(at);
    accept("then");
    between("ELSIF " + c + " THEN", at);
  }
  void end_word(const At& at) { close_block(word_, at); }
  void for_(const At& at) {
    const Token name = peek();
    will_write(name.low);
    if (name.kind == Tk::name && !is_array_here()) {
      if (!is_whole(name)) learn(lower(name.raw), kReal);
      if (!find(name.low)) own(name.raw, number_type(name), at);
    }
    const Ex v = primary();
    expect("=");
    const Ex from = expression(25);
    expect("to");
    const Ex to = expression(25);
    Ex step = integer(1);
    if (accept("step")) step = expression(25);
    const bool are_numbers = is_number(v.type) && is_number(from.type) && is_number(to.type);
    if (!v.ok || !from.ok || !to.ok || !v.is_place || !are_numbers || !step.is_literal ||
        step.v == 0) {
      if (step.ok && v.ok && from.ok && to.ok)
        bad(at, are_numbers ? "the step of this loop is unknown" : "a loop must count numbers");
      open_unread_loop("next", at);
      steps_.push_back({});
      return;
    }
    // The counter may be any number, and is kept behind the loop.
    assign(v, from, at);
    learned_.modal_varies.insert("=" + v.s);
    emit("WHILE " + v.s + (step.v < 0 ? " >= " : " <= ") + within(to, kSum) + " DO", at);
    open_block("next", "ENDWHILE");
    steps_.push_back(v.s + " := " + v.s + (step.v < 0 ? " - " : " + ") +
                     (step.v < 0 ? negative(step) : step).s + ";");
  }
  void next_(const At& at) {
    if (peek().kind == Tk::name) {
      next();
      suffix();
    }
    if (!is_in("next") || steps_.empty()) {
      bad(at, "Next has no loop");
      return;
    }
    if (!steps_.back().empty()) emit(steps_.back(), at);
    steps_.pop_back();
    close_block("next", at);
  }
  void while_(const At& at) {
    emit("WHILE " + truth(at) + " DO", at);
    open_block("wend", "ENDWHILE");
  }
  void select(const At& at) { open_case("select", at); }
  void case_(const At& at) {
    if (!is_in("select")) {
      bad(at, "Case is outside Select");
      skip_rest();
      return;
    }
    if (is("is")) {
      bad(at, "Case Is is not read", "Give the values of this Case.");
      skip_rest();
      return open_arm({}, at);
    }
    std::vector<ArmValue> values;
    do {
      ArmValue v{expression(25)};
      if (accept("to")) v.to = expression(25);
      values.push_back(std::move(v));
    } while (accept(","));
    open_arm(values, at);
  }
  void default_(const At& at) {
    if (is_in("select")) open_default(at);
    else bad(at, "Default is outside Select");
  }
  void break_(const At& at) {
    const bool is_in_loop = std::any_of(blocks_.begin(), blocks_.end(),
                                        [](const Block& b) { return b.irl == "ENDWHILE"; });
    if (is_in("select")) return;  // arms do not run into each other
    if (is_in_loop) emit("EXIT;", at);
    else bad(at, "Break is within a block of a case", "Let the case end without Break.");
  }
  void end(const At& at) {
    if (accept("select")) {
      close_block("select", at, "End Select has no open Select");
      return;
    }
    if (accept("if")) {
      close_block("endif", at);
      return;
    }
    emit(routine_.empty() ? "RETURN;" : "HALT;", at);
  }
  std::string label_here(const At& at) {
    if (peek().kind == Tk::number && peek().is_integer) {
      const std::string n = "line_" + std::to_string(static_cast<std::int64_t>(next().value));
      if (labels_here_.contains(n)) return label(n);
      bad(at, "the line does not exist here");
      return {};
    }
    accept("*");
    const Token t = next();
    if (labels_here_.contains(t.low) && t.kind == Tk::name) return label(t.raw);
    bad(t.at, "the label " + std::string(t.raw.substr(0, 40)) + " does not exist here",
        all_labels_.contains(t.low) ? "It is in a subroutine, or outside this one." : "");
    return {};
  }
  void jump(const At& at) {
    const std::string l = label_here(at);
    if (!l.empty()) emit("GOTO " + l + ";", at);
  }
  void gosub(const At& at) {
    accept("*");
    const Token t = next();
    const Symbol* s = find(t.low);
    if (!s || s->kind != Symbol::routine) {
      bad(at, "the subroutine " + std::string(t.raw.substr(0, 40)) + " does not exist");
      return;
    }
    emit(s->irl + "();", at);
  }
  void return_(const At& at) {
    if (!at_line_end() && !is("else") && !is(":") && !is("endif")) {
      const Ex where = expression();
      if (!where.is_literal || where.v != 0) {
        bad(at, "an interrupt of IRL can only return to the interrupted statement (Return 0)");
        return;
      }
    }
    if (routine_.empty()) warn(at, "Return is outside a subroutine; it ends the program");
    emit("RETURN;", at);
  }
  void on(const At& at) {
    const Ex e = as_integer(expression(25), at);
    const bool is_call = is("gosub");
    if (!accept("goto") && !accept("gosub")) {
      bad(at, "GoTo or GoSub is expected here");
      skip_rest();
      return;
    }
    int n = 0;
    do {
      ++n;
      if (is(",")) continue;
      if (!e.ok) {
        skip_rest();
        return;
      }
      std::string text;
      if (is_call) {
        accept("*");
        const Token t = next();
        const Symbol* s = find(t.low);
        if (s && s->kind == Symbol::routine) text = s->irl + "();";
        else bad(at, "the subroutine does not exist");
      } else {
        const std::string l = label_here(at);
        if (!l.empty()) text = "GOTO " + l + ";";
      }
      if (text.empty()) return;
      emit("IF " + within(e, kSum) + " = " + std::to_string(n) + " THEN " + text + " ENDIF;", at);
    } while (accept(",") && n < 100);
  }
  void delay(const At& at) {
    const Ex e = as_real(expression(), at);
    if (e.is_literal && e.v < 0) bad(at, "a time must not be negative");
    else if (e.ok) emit("WAIT " + within(e, kSum) + " SEC;", at);
  }
  void wait(const At& at) {
    const Ex c = converted(expression(), kBool, at);
    std::string timeout;
    if (accept(",")) {
      const Ex t = as_real(expression(), at);
      if (t.ok) timeout = " TIMEOUT " + within(t, kSum);
    }
    if (c.ok) emit("WAIT FOR " + c.s + timeout + ";", at);
  }
  void halt(const At& at) { emit("PAUSE;", at); }
  void hand(const At& at) {
    const bool is_open = word_ == "hopen";
    const Ex n = as_integer(expression(25), at);
    if (is(",")) {
      while (accept(",")) (void)expression();
      warn(at, "the forces of a motorised hand are left out; it only opens and closes");
    }
    if (!n.is_literal || n.v < 1 || n.v > 8) {
      if (n.ok) bad(at, "the number of the hand must be 1 to 8");
      return;
    }
    const auto k = static_cast<std::int64_t>(n.v);
    const std::string key = "hand_" + std::to_string(k);
    Symbol* s = find(key);
    if (!s) {
      s = &declare(key, kBool, Symbol::output);
      signals_.push_back(
          {"OUTPUT BOOL: " + s->irl + " AT " + std::to_string(900 + 2 * (k - 1)) + ";", at, true});
      note(at, key + " is TRUE if the hand is closed");
    }
    emit(s->irl + (is_open ? " := FALSE;" : " := TRUE;"), at);
  }
  void speed(const At& at) {
    const char* key = word_ == "ovrd" ? "override" : word_ == "spd" ? "speed" : "joint_override";
    if (accept("m_novrd") || accept("m_njovrd")) {
      set(key, real(100), at);  // what the controller starts with
      return;
    }
    if (peek().low == "m_nspd") {
      skip_rest();
      bad(at, "the controller's maximum speed (M_NSpd) is unknown", "Give a number.");
      return;
    }
    const Ex e = as_real(expression(), at);
    if (is(",")) {
      skip_rest();
      bad(at, "overrides of upward and downward motions are not read");
      return;
    }
    if (e.is_literal && e.v <= 0) {
      bad(at, "this is not a speed");
      return;
    }
    set(key, e, at);
  }
  void accel(const At& at) {
    if (at_line_end()) {
      emit("R_ACC := 100.0;", at);
      emit("R_ACC_PTP := 100.0;", at);
      return;
    }
    const Ex a = as_real(expression(), at);
    if (accept(",")) {
      const Ex down = as_real(expression(), at);
      if (a.ok && down.ok && a.s != down.s)
        warn(at, std::string("IRL decelerates as it accelerates; the deceleration is left out") +
                     kOtherTimes);
    }
    if (is(",")) {
      skip_rest();
      bad(at, "accelerations of upward and downward motions are not read");
      return;
    }
    if (!a.ok) return;
    if (a.is_literal && (a.v <= 0 || a.v > 100)) {
      bad(at, "an acceleration must be above 0 and at most 100 % in IRL");
      return;
    }
    emit("R_ACC := " + a.s + ";", at);
    emit("R_ACC_PTP := " + a.s + ";", at);
  }
  void cnt(const At& at) {
    const Ex on = as_integer(expression(), at);
    Ex r = failed();
    if (accept(",")) r = as_real(expression(), at);
    if (accept(",")) {
      const Ex next_one = as_real(expression(), at);
      if (next_one.ok && r.ok && next_one.s != r.s) {
        bad(at,
            "IRL has one distance for the end of a motion and the start of the next, but these "
            "differ");
        return;
      }
    }
    if (!on.is_literal) {
      if (on.ok) bad(at, "Cnt is 0 or 1");
      return;
    }
    set("continuous", boolean(on.v != 0), at);
    // Cnt 0 stops, and Cnt 1 alone says no distance: that of before does not stay.
    if (r.ok && on.v != 0) set("continuous_distance", r, at);
    else if (learned_.modal.contains("continuous_distance"))
      set("continuous_distance", real(0), at);
  }
  void frame(const At& at) {
    const bool is_tool = word_ == "tool";
    const Ex p = as_pose(expression(), at);
    if (!p.ok) return;
    if (is_tool) {
      set("tool", p, at);
    } else {
      // Where the robot stands in the world: places are seen from there.
      Ex inverse = value("INV(" + p.s + ")", kPose);
      inverse.is_constant = p.is_constant;
      set("frame", inverse, at);
    }
  }
  void def(const At& at) {
    const Token what = next();
    const std::map<std::string, Type> kTypes{{"inte", kInt},    {"long", kInt},   {"float", kReal},
                                             {"double", kReal}, {"pos", kTarget}, {"jnt", kJoint},
                                             {"char", kString}};
    if (const auto it = kTypes.find(what.low); it != kTypes.end()) {
      do {
        const Token n = next();
        if (n.kind != Tk::name) {
          bad(n.at, "the name of a variable is expected here");
          return;
        }
        suffix();
        if (find(n.low)) continue;  // its position stands behind the program
        if (it->second.k == K::target) learned_.turns = 6;
        Symbol& s = declare(n.raw, it->second, Symbol::variable, is_called_);
        declare_variable(s, {}, at, is_called_);
      } while (accept(","));
      return;
    }
    if (what.low == "plt") return pallet(at);
    if (what.low == "io") {
      const Token name = next();
      expect("=");
      const Token kind = next();
      expect(",");
      const Ex n = expression();
      if (is(",")) {
        skip_rest();
        bad(at, "the mask of Def IO is not read");
        return;
      }
      const std::int64_t width = kind.low == "bit"    ? 1
                                 : kind.low == "byte" ? 8
                                 : kind.low == "word" ? 16
                                                      : 0;
      if (!n.is_literal || n.v < 0 || n.v > 100000 || width == 0) {
        bad(at, "Def IO needs Bit, Byte or Word, and a number");
        return;
      }
      ios_[name.low] = {static_cast<std::int64_t>(n.v), width};
      return;
    }
    if (what.low == "act") {
      const Ex n = integer(static_cast<std::int64_t>(peek().value));
      const Token number = next();
      expect(",");
      const Ex c = converted(expression(), kBool, at);
      if (!accept("gosub")) {
        bad(at, "an interrupt that jumps (GoTo) has no counterpart in IRL",
            "Make it call a subroutine (GoSub).");
        skip_rest();
        return;
      }
      accept("*");
      const Token l = next();
      if (is(",")) {
        skip_rest();
        bad(at, "IRL cannot choose how an interrupt stops the motion (S, F, L)",
            "Leave it out, and the interrupt acts at once.");
        return;
      }
      const Symbol* s = find(l.low);
      if (!c.ok) return;
      if (!s || s->kind != Symbol::routine || number.kind != Tk::number) {
        bad(at, "the subroutine does not exist");
        return;
      }
      const std::string key = "!act" + std::string(number.raw);
      if (globals_.contains(key)) {
        bad(at, "the interrupt " + std::string(number.raw) + " is defined twice",
            "IRL allows one body for each.");
        return;
      }
      const std::string text = s->irl + "();";
      Symbol x;
      x.kind = Symbol::data;
      x.irl = irl_name("act_" + std::string(number.raw));
      const std::string irl = x.irl;
      globals_.emplace(key, std::move(x));
      Routine& before = current();
      const bool was_main = is_in_main();
      Routine& r =
          open("INTERRUPT " + irl + " PRIORITY " + n.s + " WHEN " + c.s, "ENDINTERRUPT", at);
      r.body.push_back({"  " + text, at, true});
      if (was_main) close();
      else set_current(before);
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    skip_rest();
    bad(at, "Def " + std::string(what.raw.substr(0, 40)) + " is not read");
  }
  void act(const At& at) {
    const Token n = next();
    expect("=");
    const Token v = next();
    if (n.value == 0 && v.kind == Tk::number) {
      left_out(RMP_FAULT_WARNING, at, "IRL enables and disables interrupts one by one");
      return;
    }
    const auto it = globals_.find("!act" + std::string(n.raw));
    if (it == globals_.end() || v.kind != Tk::number) {
      bad(at, "this interrupt is not defined above");
      return;
    }
    emit((v.value != 0 ? "ENABLE " : "DISABLE ") + it->second.irl + ";", at);
  }
  void dim(const At& at) {
    do {
      const Token n = next();
      suffix();
      if (n.kind != Tk::name || !expect("(")) {
        bad(at, "the name of an array is expected here");
        return;
      }
      std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
      do {
        const Ex e = expression();
        if (!e.is_literal || e.v < 1 || e.v > 10000) {
          bad(at, "the size of the array is unknown");
          skip_rest();
          return;
        }
        bounds.emplace_back(1, static_cast<std::int64_t>(e.v));
      } while (accept(","));
      expect(")");
      if (find(n.low)) {
        bad(at, std::string(n.raw) + " is declared twice");
        return;
      }
      const Type of = type_of(n);
      if (of.k == K::target) learned_.turns = 6;
      Symbol& s = declare(n.raw, array_of(of, bounds), Symbol::variable, is_called_);
      declare_variable(s, {}, at, is_called_);
    } while (accept(","));
  }
  void callp(const At& at) {
    const Token name = next();
    std::vector<Ex> args;
    while (accept(",")) args.push_back(expression());
    if (name.kind != Tk::text) {
      bad(at, "the name of the called program must be in quotes");
      return;
    }
    for (const Ex& e : args)
      if (!e.ok) return;
    const std::string text = call("program_" + std::string(name.raw), args, at);
    if (!text.empty()) emit(text + ";", at);
  }
  void pallet(const At& at) {
    const Token n = peek();
    const Ex number = expression(25);
    std::vector<Ex> points;
    expect(",");
    for (int i = 0; i < 4; ++i) {
      if (accept(",")) {
        points.push_back(failed());
        continue;
      }
      const Ex p = expression();
      points.push_back(as_pose(p, at));
      expect(",");
    }
    const Ex columns = as_integer(expression(), at);
    expect(",");
    const Ex rows = as_integer(expression(), at);
    expect(",");
    const Ex way = as_integer(expression(), at);
    if (!number.ok || !columns.ok || !rows.ok || !way.ok || points.size() < 4 || !points[0].ok ||
        !points[1].ok || !points[2].ok)
      return;
    const std::string key = "!plt " + number.s;
    if (globals_.contains(key)) {
      bad(at, "this pallet is defined twice");
      return;
    }
    const std::string base = irl_name("pallet_" + std::string(n.raw));
    const auto variable = [&](const char* what, const Type& t, const std::string& v) {
      const std::string name = irl_name(base + "_" + what);
      variables_.push_back(
          {type_text(t) + ": " + name + (initial(t).empty() ? "" : " := " + initial(t)) + ";", at,
           false});
      emit(name + " := " + v + ";", at);
      return name;
    };
    const std::string p = variable("start", kPose, points[0].s),
                      a = variable("end_a", kPose, points[1].s),
                      b = variable("end_b", kPose, points[2].s);
    const std::string d = points[3].ok ? variable("corner", kPose, points[3].s) : std::string();
    const std::string na = variable("columns", kInt, columns.s),
                      nb = variable("rows", kInt, rows.s), w = variable("way", kInt, way.s);
    Symbol s;
    s.kind = Symbol::data;
    s.irl = irl_name(base + "_place");
    Routine& before = current();
    const bool was_main = is_in_main();
    Routine& r = open("FUNCTION " + s.irl + " (IN INT: number): POSE", "ENDFCT", at);
    r.locals.push_back({"INT: i, k;", at, false});
    r.locals.push_back({"REAL: s, t;", at, false});
    const auto line = [&](std::string text) {
      r.body.push_back({"  " + std::move(text), at, false});
    };
    line("i := (number - 1) MOD " + na + ";");
    line("k := (number - 1) DIV " + na + ";");
    line("IF " + w + " = 1 AND k MOD 2 = 1 THEN i := " + na + " - 1 - i; ENDIF;");
    line("IF " + na + " > 1 THEN s := i / (" + na + " - 1); ENDIF;");
    line("IF " + nb + " > 1 THEN t := k / (" + nb + " - 1); ENDIF;");
    std::string xyz;
    for (const char c : {'X', 'Y', 'Z'}) {
      const auto f = [&](const std::string& v) { return v + ".POS." + c; };
      std::string e =
          f(p) + " + s * (" + f(a) + " - " + f(p) + ") + t * (" + f(b) + " - " + f(p) + ")";
      if (!d.empty()) e += " + s * t * (" + f(d) + " - " + f(a) + " - " + f(b) + " + " + f(p) + ")";
      xyz += (xyz.empty() ? "" : ", ") + e;
    }
    line("RETURN POSE(POSITION(" + xyz + "), " + p + ".ORI);");
    if (was_main) close();
    else set_current(before);
    globals_.emplace(key, std::move(s));
  }

  /// P1.FL1=P_Curr.FL1: the configuration and the turns in which the robot is.
  bool flags_of_here(const At& at) {
    const std::string f = peek(2).low;
    if (!is(".", 1) || (f != "fl1" && f != "fl2") || !is("=", 3) || !is("p_curr", 4) ||
        !is(".", 5) || !is(f, 6))
      return false;
    const Token name = peek();
    const Symbol* s = find(name.low);
    for (int k = 0; k < 7; ++k) next();
    if (!s || s->type.k != K::target) return true;  // it has no flags
    if (f == "fl1") {
      emit(s->irl + ".STATUS := -1;", at);
    } else {
      emit(s->irl + ".TURNS := [-128, -128, -128, -128, -128, -128];", at);
      any_turns_.insert(s->irl);
    }
    return true;
  }
  void assignment(const At& at) {
    if (peek().kind == Tk::name && flags_of_here(at)) return;
    const Token name = peek();
    if (name.low == "p_curr" || name.low == "j_curr") {
      skip_rest();
      bad(at, std::string(name.raw) + " is where the robot is, and gets no value");
      return;
    }
    if (const Symbol* s = find(name.low)) any_turns_.erase(s->irl);
    will_write(name.low);
    learned_.flags.insert("valued " + name.low);
    next();
    suffix();
    const bool is_plain = is("=");
    while (at_ > 0 && peek().at.begin != name.at.begin) --at_;
    if (is_plain && !find(name.low) && !ios_.contains(name.low)) {
      next();
      suffix();
      next();
      Ex e;
      if (is("(") && is_position_list()) e = literal(name, at);
      else e = expression();
      if (!e.ok) return;
      if (name.low.starts_with("m_") || name.low.starts_with("p_") || name.low.starts_with("c_")) {
        bad(at, "IRL has no counterpart of " + std::string(name.raw));
        return;
      }
      Type t = e.type;
      if (t.k == K::integer || t.k == K::boolean) t = kReal;
      if (t.k == K::real) t = number_type(name);
      if (t.k == K::pose && type_of(name).k == K::target && learned_.types.contains(name.low))
        t = learned_.types[name.low];
      const Symbol& s = own(name.raw, t, at);
      keep_number(s.irl, e);
      assign(place(s.irl, s.type), e, at);
      return;
    }
    const Ex to = primary();
    if (!to.ok) {
      skip_rest();
      return;
    }
    if (!expect("=")) {
      skip_rest();
      return;
    }
    const Ex e = is("(") && is_position_list() ? literal(name, at) : expression();
    keep_number(to.s, e);
    learned_.flags.insert("assigned " + to.s.substr(0, to.s.find('.')));
    assign(to, e, at);
    // M_Out(1)=1 Dly 0.5 goes back after that time.
    if (is("dly") && name.low.starts_with("m_out")) {
      next();
      const Ex time = as_real(expression(), at);
      if (!time.ok || !e.ok || !e.is_literal || to.type.k != K::boolean) {
        bad(at, "a pulse needs one output and 1 or 0");
        return;
      }
      emit("WAIT " + within(time, kSum) + " SEC;", at);
      emit(to.s + (e.v != 0 ? " := FALSE;" : " := TRUE;"), at);
      warn(at, "the IRL program waits for the end of this pulse; the controller does not");
    }
  }
  /// What numbers a variable gets in all of the program: signals may be named by it.
  void keep_number(const std::string& variable, const Ex& e) {
    if (!is_number(e.type)) return;
    auto& values = learned_.modal["=" + variable];
    if (e.is_literal && values.size() < 2) values.insert(e.s);
    if (!e.is_literal) learned_.modal_varies.insert("=" + variable);
  }
  bool is_position_list() const {
    int depth = 0;
    for (std::size_t i = 0; i < 400; ++i) {
      const Token& t = peek(i);
      if (t.kind == Tk::line || t.kind == Tk::end) return false;
      if (t.low == "(") ++depth;
      if (t.low == ")" && --depth == 0) return false;
      if (t.low == "," && depth == 1) return true;
    }
    return false;
  }
  /// (x,y,z,a,b,c)(flags), or six joints.
  Ex literal(const Token& name, const At& at) {
    if (!expect("(")) return failed();
    std::vector<Ex> x, f;
    while (!at_line_end() && !is(")")) {
      x.push_back(is(",") ? real(0) : as_real(expression(), at));
      if (!accept(",")) break;
    }
    expect(")");
    bool has_flags = false;
    if (accept("(")) {
      has_flags = true;
      while (!at_line_end() && !is(")")) {
        f.push_back(is(",") ? integer(0) : as_integer(expression(), at));
        if (!accept(",")) break;
      }
      expect(")");
    }
    for (const Ex& e : x)
      if (!e.ok) return failed();
    for (const Ex& e : f)
      if (!e.ok) return failed();
    is_straight_ = true;
    for (std::size_t i = 3; i < 6 && i < x.size(); ++i)
      is_straight_ = is_straight_ && x[i].is_literal && x[i].v == 0;
    if (x.size() > 8 || x.empty()) return bad(at, "a position must have 3 to 8 numbers");
    std::vector<Ex> external;
    for (std::size_t i = 6; i < x.size(); ++i) external.push_back(x[i]);
    while (!external.empty() && external.back().is_literal && external.back().v == 0)
      external.pop_back();
    while (x.size() < 6) x.push_back(real(0));
    if (name.low[0] == 'j' && !has_flags)
      return joints({x[0], x[1], x[2], x[3], x[4], x[5]}, external);
    const Ex p = pose({x[0], x[1], x[2]}, orientation("ORIZYX", {x[5], x[4], x[3]}));
    if (!has_flags) return p;
    std::int64_t status = 0;
    const std::int64_t flags =
        !f.empty() && f[0].is_literal ? static_cast<std::int64_t>(f[0].v) : 7;
    if (!(flags & 4)) status |= 1;
    if (!(flags & 2)) status |= 2;
    if (!(flags & 1)) status |= 4;
    std::vector<Ex> turns(6, integer(0));
    if (f.size() > 1 && f[1].is_literal) {
      // Four bits a joint, from joint 1 on.
      const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(f[1].v));
      for (std::size_t i = 0; i < 6; ++i) {
        auto n = static_cast<std::int64_t>((bits >> (4 * i)) & 15U);
        if (n > 7) n -= 16;
        turns[i] = integer(n);
      }
    }
    return target(p, integer(status), turns, external);
  }
  Type type_of(const Token& n) {
    if (n.low.ends_with("$") || n.low[0] == 'c') return kString;
    if (n.low[0] == 'p') return kTarget;
    if (n.low[0] == 'j') return kJoint;
    return number_type(n);
  }
  void suffix() {
    // M1%, M1!, M1# and M1&: kinds of numbers.
    if (peek().kind == Tk::sign && (is("%") || is("!") || is("#") || is("&")) && at_ > 0 &&
        tokens_[at_ - 1].at.end == peek().at.begin)
      ++at_;
  }
  /// True if the program has the name with the sign % or & anywhere: an integer variable, which
  /// rounds the values it gets.
  [[nodiscard]] bool is_whole(const Token& n) {
    if (whole_.empty()) {
      whole_.insert("");
      for (std::size_t i = 0; i + 1 < tokens_.size(); ++i)
        if (tokens_[i].kind == Tk::name && tokens_[i + 1].kind == Tk::sign &&
            (tokens_[i + 1].low == "%" || tokens_[i + 1].low == "&") &&
            tokens_[i].at.end == tokens_[i + 1].at.begin)
          whole_.insert(tokens_[i].low);
    }
    return whole_.contains(n.low);
  }
  [[nodiscard]] Type number_type(const Token& n) { return is_whole(n) ? kInt : kReal; }
  /// True if the next token is a name with an index.
  [[nodiscard]] bool is_array_here() const { return is("(", 1) || is("(", 2); }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    const auto is_place_of = [](const Ex& e) {
      return e.type.k == K::pose || e.type.k == K::target;
    };
    if (!is_place_of(a) || !is_place_of(b)) return std::nullopt;
    if (op == Op::mul) {
      const Ex p = binary(Op::compose, as_pose(a, at), as_pose(b, at), at);
      return a.type.k == K::target && a.prec == kPrimary ? with_pose(a, p) : p;
    }
    if (op == Op::div) {
      const Ex y = as_pose(b, at);
      return binary(Op::compose, as_pose(a, at), value("INV(" + y.s + ")", kPose), at);
    }
    if (op == Op::add || op == Op::sub) {
      const Ex x = as_pose(a, at), y = as_pose(b, at);
      if (x.s.size() > 300 || y.s.size() > 300) return bad(at, "only two positions can be added");
      const std::string sign = op == Op::add ? " + " : " - ";
      std::string p, o;
      if (x.s.starts_with("POSE(") || y.s.starts_with("POSE("))
        return bad(at, "added positions must have names");
      for (const char c : {'X', 'Y', 'Z'})
        p += (p.empty() ? "" : ", ") + x.s + ".POS." + c + sign + y.s + ".POS." + c;
      for (const char c : {'Z', 'Y', 'X'})
        o += (o.empty() ? "ANGLE" : ", ANGLE") + std::string(1, c) + "('ZYX', " + x.s + ".ORI)" +
             sign + "ANGLE" + c + "('ZYX', " + y.s + ".ORI)";
      return with_pose(a, value("POSE(POSITION(" + p + "), ORIZYX(" + o + "))", kPose));
    }
    return std::nullopt;
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (t.kind == Tk::number) {
      next();
      suffix();
      return t.is_integer ? integer(static_cast<std::int64_t>(t.value)) : real(t.value);
    }
    if (t.kind == Tk::text) {
      next();
      return string(t.raw);
    }
    if (is("(")) {
      if (is_position_list()) return suffixes(literal(Token{}, at));
      next();
      Ex e = expression();
      expect(")");
      e.is_grouped = true;
      return suffixes(e);
    }
    if (const auto e = binary_here("&")) return *e;
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    next();
    suffix();
    if (t.low == "on" || t.low == "off") return boolean(t.low == "on");
    if (t.low == "p_zero") return identity();
    if (t.low == "m_pi") return real(3.141592653589793);
    if (t.low == "m_on" || t.low == "m_off") return integer(t.low == "m_on");
    if (t.low == "p_tool") return get("tool", kPose, at);
    if (t.low == "p_curr") return suffixes(present_target(at));
    if (t.low == "j_curr") return suffixes(present_joints());
    if (t.low == "plt") {
      const Ex n = expression(25);
      if (!expect(",")) return failed();
      const Ex i = as_integer(expression(25), at);
      const auto it = globals_.find("!plt " + n.s);
      if (it == globals_.end())
        return n.ok ? bad(at, "this pallet is not defined above") : failed();
      return i.ok ? value(it->second.irl + "(" + i.s + ")", kPose) : failed();
    }
    if (t.low.starts_with("m_in") || t.low.starts_with("m_out")) return io(t);
    if (const auto it = ios_.find(t.low); it != ios_.end()) {
      const bool is_out = is("=");
      const Symbol& s = signal(is_out, it->second.first, it->second.second);
      Ex e = place(s.irl, s.type);
      e.is_place = is_out;
      return e;
    }
    const Symbol* s = find(t.low);
    if (s && s->kind == Symbol::routine) return bad(at, std::string(t.raw) + " is not a value");
    if (!s && is("(")) return suffixes(function(t));
    if (!s) {
      if (t.low.starts_with("m_") || t.low.starts_with("p_") || t.low.starts_with("j_") ||
          t.low.starts_with("c_"))
        return bad(at, "IRL has no counterpart of " + std::string(t.raw));
      const Type guess = learned_.types.contains(t.low) ? learned_.types[t.low] : type_of(t);
      if (guess.k == K::target || guess.k == K::joint) {
        if (guess.k == K::target) learned_.turns = 6;
        if (!learned_.flags.contains("valued " + t.low))
          fail(at, std::string(t.raw) + " has no value in the program; it is zero here",
               "Teach it, or add its line.");
      }
      Symbol& made = own(t.raw, guess, at);
      return suffixes(place(made.irl, made.type));
    }
    return suffixes(place(s->irl, s->type));
  }
  Ex suffixes(Ex e) {
    for (;;) {
      if (is("(") && e.type.k == K::array) {
        const At at = next().at;
        std::string list;
        std::size_t n = 0;
        bool in_bounds = true;
        do {
          const Ex i = as_integer(expression(), at);
          if (!i.ok) return failed();
          if (n < e.type.bounds.size() && i.is_literal)
            in_bounds = in_bounds && i.v >= static_cast<double>(e.type.bounds[n].first) &&
                        i.v <= static_cast<double>(e.type.bounds[n].second);
          list += (n++ ? ", " : "") + i.s;
        } while (accept(","));
        expect(")");
        if (n != e.type.bounds.size())
          return bad(at, "the array has " + std::to_string(e.type.bounds.size()) + " indices");
        if (!in_bounds) return bad(at, "the array has no element " + list);
        const Type of = *e.type.element;
        e = place(e.s + "[" + list + "]", of);
        continue;
      }
      if (is(".") && peek(1).kind == Tk::name) {
        next();
        const Token f = next();
        const std::string& n = f.low;
        if (e.type.k == K::joint && n.size() == 2 && n[0] == 'j' && n[1] >= '1' && n[1] <= '6') {
          const std::string a =
              e.s + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") + n.substr(1);
          e = value(a + " / " + number_text(kDegree), kReal, kTerm);
          e.is_place = true;
          e.setter = a + " := (%) * " + number_text(kDegree);
          continue;
        }
        if (e.type.k == K::pose || e.type.k == K::target) {
          const std::string p = e.s + (e.type.k == K::target ? ".PSE" : "");
          if (n == "x" || n == "y" || n == "z") {
            e = place(p + ".POS." + static_cast<char>(n[0] - 32), kReal);
            continue;
          }
          if (n == "a" || n == "b" || n == "c") {
            // A, B, C are about x, y, z, and in radians where a program reads them.
            const auto angle = [&](char c) {
              return std::string("ANGLE") + c + "('ZYX', " + p + ".ORI)";
            };
            const char axis = static_cast<char>('X' + n[0] - 'a');
            Ex a = value(angle(axis) + " / " + number_text(kDegree), kReal, kTerm);
            a.is_place = true;
            a.setter = p + ".ORI := ORIZYX(";
            for (const char c : {'Z', 'Y', 'X'})
              a.setter +=
                  (c == 'Z' ? "" : ", ") + (c == axis ? "(%) * " + number_text(kDegree) : angle(c));
            a.setter += ")";
            e = a;
            continue;
          }
        }
        return bad(f.at, "there is no component " + std::string(f.raw.substr(0, 40)) + " here");
      }
      return e;
    }
  }
  Ex io(const Token& t) {
    const At at = t.at;
    const bool is_out = t.low.starts_with("m_out");
    const std::string kind = t.low.substr(is_out ? 5 : 4);
    const std::int64_t width = kind.empty()                  ? 1
                               : kind == "b" || kind == "8"  ? 8
                               : kind == "w" || kind == "16" ? 16
                               : kind == "32"                ? 32
                                                             : 0;
    if (width == 0) return bad(at, "IRL has no counterpart of " + std::string(t.raw));
    if (!expect("(")) return failed();
    const Ex n = expression();
    expect(")");
    if (!n.ok) return n;
    double number = n.is_literal ? n.v : -1;
    if (!n.is_literal) {
      // A variable that gets one number and no other.
      const auto it = learned_.modal.find("=" + n.s);
      if (it != learned_.modal.end() && it->second.size() == 1 &&
          !learned_.modal_varies.contains("=" + n.s))
        number = std::strtod(it->second.begin()->c_str(), nullptr);
    }
    if (!(number >= 0 && number <= 100000))
      return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
    const Symbol& s = signal(is_out, static_cast<std::int64_t>(number), width);
    Ex e = place(s.irl, s.type);
    e.is_place = is_out;
    return e;
  }
  Ex function(const Token& t) {
    const At at = t.at;
    next();
    const auto a = arguments();
    for (const Ex& e : a)
      if (!e.ok) return failed();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},  {"cos", "COS"}, {"tan", "TAN"}, {"atn", "ATAN"},  {"atn2", "ATAN2"},
        {"sqr", "SQRT"}, {"exp", "EXP"}, {"ln", "LN"},   {"asin", "ASIN"}, {"acos", "ACOS"}};
    if (const auto it = kMath.find(t.low); it != kMath.end()) return math(it->second, a, at, true);
    if (t.low == "abs") return math("ABS", a, at);
    if (t.low == "fix") return math("TRUNC", a, at);
    if ((t.low == "round" || t.low == "cint") && a.size() == 1) return math("ROUND", a, at);
    if (t.low == "int" && a.size() == 1)
      return value(helper("floor") + "(" + as_real(a[0], at).s + ")", kInt);
    if (t.low == "rad" && a.size() == 1) return scaled(as_real(a[0], at), 1 / kDegree);
    if (t.low == "deg" && a.size() == 1) return scaled(as_real(a[0], at), kDegree);
    if (t.low == "len" && a.size() == 1 && a[0].type.k == K::string)
      return value("LENGTH(" + a[0].s + ")", kInt);
    if (t.low == "inv" && a.size() == 1) return value("INV(" + as_pose(a[0], at).s + ")", kPose);
    if (t.low == "ptoj" && a.size() == 1 && a[0].type.k == K::target && learned_.external_axes == 0)
      return value("TRAFOINV(" + a[0].s + ").M_JOINT", kJoint);
    if (t.low == "jtop" && a.size() == 1 && a[0].type.k == K::joint) return as_place(a[0]);
    if (t.low == "dist" && a.size() == 2) {
      const Ex x = as_pose(a[0], at), y = as_pose(a[1], at);
      if (x.ok && y.ok)
        return value(helper("distance") + "(" + x.s + ".POS, " + y.s + ".POS)", kReal);
      return failed();
    }
    return bad(at,
               std::string(t.raw.substr(0, 40)) + " is neither an array nor a supported function",
               "Declare arrays with Dim.");
  }

  std::vector<SourceLine> lines_;
  std::vector<Subroutine> subroutines_;
  std::vector<bool> is_outside_;
  std::set<std::string> all_labels_, labels_here_;
  std::set<std::int64_t> line_numbers_, used_lines_;
  std::map<std::string, std::pair<std::int64_t, std::int64_t>> ios_;
  std::vector<std::string> steps_;
  std::set<std::string> straight_;     ///< positions that are given with angles of zero
  bool is_straight_ = false;           ///< the position that was read last
  std::set<std::string> whole_;        ///< variables that a sign makes whole, and ""
  bool is_called_ = false;             ///< the program that is read is one that another calls
  std::string word_, routine_, goal_;  // goal_: where the motion above has ended
  std::set<std::string> any_turns_;    ///< positions with the turns of where the robot is
  bool told_zone_ = false;
  int nested_ = 0;
};

}  // namespace

Made read_melfa(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<MelfaReader>(task, params, progress);
}

bool looks_like_melfa(std::string_view text) {
  int found = 0;
  std::size_t lines = 0;
  while (!text.empty() && lines++ < 400) {
    const std::size_t end = text.find('\n');
    std::string line = lower(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    std::size_t i = line.find_first_not_of(" \t0123456789");
    if (i == std::string::npos) continue;
    line = line.substr(i);
    for (const char* word :
         {"mov ", "mvs ", "ovrd ", "hopen ", "hclose ", "dly ", "def pos", "def inte", "m_out(",
          "servo on", "hlt", "gosub *", "goto *", "wend", "def plt"})
      if (line.starts_with(word)) ++found;
    if (line.size() > 4 && line[0] == 'p' && line.find("=(") != std::string::npos) ++found;
    if (line[0] == '*') ++found;
  }
  return found > 0;
}

}  // namespace robomosp::readers

// SPDX-License-Identifier: Apache-2.0
// FANUC TP: listings .ls.
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "reader.h"
#include "readers.h"
#include "tp_flow.h"

namespace robomosp::readers {
namespace {

const Style kTpStyle{.comment = {},
                     .quotes = "\"'",
                     .name_first = "_$",
                     .name_rest = "_$",
                     .signs = {"<>", "<=", ">="},
                     .has_lines = false,
                     .joins_in_brackets = false,
                     .hex = {}};
constexpr Binary kTpBinaries[] = {{"or", 10, Op::or_},   {"and", 12, Op::and_}, {"=", 20, Op::eq},
                                  {"<>", 20, Op::ne},    {"<", 20, Op::lt},     {">", 20, Op::gt},
                                  {"<=", 20, Op::le},    {">=", 20, Op::ge},    {"+", 30, Op::add},
                                  {"-", 30, Op::sub},    {"*", 40, Op::mul},    {"/", 40, Op::div},
                                  {"div", 40, Op::idiv}, {"mod", 40, Op::mod}};

class TpReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    starts_with("wait_timeout", real(30));
    starts_with("override", real(100));
    for (std::size_t f = 0; f < files_.size(); ++f) {
      if (extension(files_[f].name) == "va") values(f);
      else split(f);
    }
    for (const SourceFile& file : files_) are_timers_read_ = are_timers_read_ || reads_timer(file);
    for (std::size_t f = 1; f < programs_.size(); ++f)
      if (!programs_[f].is_values) announce(programs_[f].name, parameters(programs_[f]), kNone);
    std::set<std::string> names;
    for (std::size_t f = 0; f < programs_.size(); ++f) find_scopes(f);
    for (std::size_t f = 0; f < programs_.size(); ++f)
      if (!programs_[f].is_values && names.insert(lower(programs_[f].name)).second)
        flow_.add(lower(programs_[f].name), steps(f));
    flow_.solve();
    for (std::size_t f = 0; f < programs_.size(); ++f)
      if (!programs_[f].is_values) program(f);
  }

 private:
  struct Statement {
    std::size_t begin, end;
    std::uint32_t line;
  };
  struct Program {
    std::string name;
    std::vector<Statement> statements, points;
    At at;
    std::vector<std::string> scopes;  ///< of each statement: the prefix of its labels
    std::set<int> groups;             ///< that it moves besides the first, of DEFAULT_GROUP
    bool is_values = false;           ///< no program but variables of the controller, .va
  };

  std::span<const Binary> binaries() const override { return kTpBinaries; }
  std::string_view not_word() const override { return "!"; }
  int not_precedence() const override { return 60; }
  void skip_rest() override {
    while (!at_end()) next();
  }
  /// Up to THEN, or to the comma before the action.
  void skip_condition() override {
    std::size_t last = 0;
    int depth = 0;
    for (std::size_t k = 0; peek(k).kind != Tk::end; ++k) {
      if (is("then", k)) {
        last = k;
        break;
      }
      if (is("(", k) || is("[", k)) ++depth;
      if (is(")", k) || is("]", k)) --depth;
      if (is(",", k) && depth <= 0 && last == 0) last = k;
    }
    for (; last > 0; --last) next();
  }

  /// TIMER[n] stands somewhere else than at the beginning of a statement, before "=".
  static bool reads_timer(const SourceFile& file) {
    const std::string low = lower(file.text);
    for (std::size_t at = low.find("timer["); at != std::string::npos;
         at = low.find("timer[", at + 6)) {
      const std::size_t line = low.find_last_of(";\n", at) + 1;  // npos + 1 is 0
      const std::size_t first = low.find_first_not_of("0123456789: \t", line);
      if (low[first] == '!') continue;
      const std::size_t close = low.find(']', at);
      const std::size_t behind = low.find_first_not_of(" \t", std::min(close, low.size() - 1) + 1);
      if (first != at || close == std::string::npos || behind == std::string::npos ||
          low[behind] != '=')
        return true;
    }
    return false;
  }
  /// What a backup says of registers and frames: POSREG.VA, NUMREG.VA, SYSFRAME.VA. Of the first
  /// group; what has no values, or joints, is not in it.
  void values(std::size_t f) {
    Program& p = programs_.emplace_back();
    p.is_values = true;
    static const std::map<std::string, const char*, std::less<>> kArrays{
        {"$posreg", "PR"}, {"$numreg", "R"}, {"$mnuframe", "UFRAME"}, {"$mnutool", "UTOOL"}};
    const std::string text = lower(files_[f].text);
    std::string array;
    std::int64_t number = 0;
    std::map<char, double> parts;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      const std::string line = text.substr(at, end - at);
      at = end + 1;
      const std::size_t first = line.find_first_not_of(" \t\r");
      if (first == std::string::npos) continue;
      if (line[first] == '[' && line.find('$') != std::string::npos && line[first + 1] == '*') {
        // [*POSREG*]$POSREG  Storage: ...
        const std::size_t name = line.find('$');
        const auto it = kArrays.find(line.substr(name, line.find_first_of(" \t\r", name) - name));
        array = it == kArrays.end() ? "" : it->second;
        number = 0;
        continue;
      }
      if (array.empty()) continue;
      if (line[first] == '[') {
        // [1,12] = and lines behind it, or [12] = 4.5
        const std::size_t close = line.find(']', first), comma = line.find(',', first);
        parts.clear();
        number = 0;
        if (close == std::string::npos) continue;
        const std::size_t from = comma < close ? comma + 1 : first + 1;
        const auto n = std::strtoll(line.c_str() + from, nullptr, 10);
        const bool is_first = comma > close || line.compare(first, 3, "[1,") == 0;
        if (!is_first || n < 1 || n > 10'000) continue;
        if (array != "R") {
          number = n;
          continue;
        }
        const std::size_t equals = line.find('=', close);
        if (equals == std::string::npos) continue;
        char* stop = nullptr;
        const double v = std::strtod(line.c_str() + equals + 1, &stop);
        if (stop != line.c_str() + equals + 1 && std::isfinite(v)) known_[array][n] = real(v).s;
        continue;
      }
      if (number == 0) continue;
      for (std::size_t k = first; k + 1 < line.size(); ++k) {
        if (line[k + 1] != ':' || std::string_view("xyzwpr").find(line[k]) == std::string::npos ||
            (k > 0 && line[k - 1] != ' ' && line[k - 1] != '\t'))
          continue;
        char* stop = nullptr;
        const double v = std::strtod(line.c_str() + k + 2, &stop);
        if (stop != line.c_str() + k + 2 && std::isfinite(v)) parts[line[k]] = v;
      }
      if (parts.size() == 6)
        known_[array][number] =
            pose({real(parts['x']), real(parts['y']), real(parts['z'])},
                 orientation("ORIZYX", {real(parts['r']), real(parts['p']), real(parts['w'])}))
                .s;
    }
  }
  /// The sections of a listing, and their statements, which end with ";".
  void split(std::size_t f) {
    const std::string_view text = files_[f].text;
    Program p;
    p.name = std::string(stem(files_[f].name));
    p.at.file = static_cast<std::uint32_t>(f);
    std::size_t at = 0;
    std::uint32_t line = 1;
    enum { none, main, points } section = none;
    bool has_program = false;
    while (at < text.size()) {
      std::size_t end = text.find('\n', at);
      if (end == std::string_view::npos) end = text.size();
      std::string_view l = text.substr(at, end - at);
      const std::size_t first = l.find_first_not_of(" \t\r");
      const At here{static_cast<std::uint32_t>(f), line, 1, static_cast<std::uint32_t>(at),
                    static_cast<std::uint32_t>(end)};
      if (first != std::string_view::npos && l[first] == '/' && l.substr(first, 2) != "//") {
        std::string word = lower(l.substr(first));
        word = word.substr(0, word.find_first_of(" \t\r"));
        section = word == "/mn" ? main : word == "/pos" ? points : none;
        if (word == "/prog") {
          has_program = true;
          std::string_view rest = l.substr(std::min(l.size(), first + 5));
          const std::size_t b = rest.find_first_not_of(" \t");
          if (b != std::string_view::npos) {
            rest = rest.substr(b);
            p.name = std::string(rest.substr(0, rest.find_first_of(" \t\r")));
          }
        }
        at = end + 1;
        ++line;
        continue;
      }
      if (section == none || first == std::string_view::npos) {
        // DEFAULT_GROUP = 1,1,*,*,*;
        if (first != std::string_view::npos && lower(l.substr(first, 13)) == "default_group") {
          int group = 1;
          for (const char c : l.substr(std::min(l.size(), l.find('=')))) {
            if (c == ',') ++group;
            if (c == '1' && group > 1) p.groups.insert(group);
          }
        }
        at = end + 1;
        ++line;
        continue;
      }
      // From here to the ";" that ends a line; comments may have others within.
      const std::size_t begin = at;
      const std::uint32_t begin_line = line;
      bool is_whole = false;
      for (;;) {
        std::string_view tail = text.substr(at, end - at);
        while (!tail.empty() && (tail.back() == ' ' || tail.back() == '\r' || tail.back() == '\t'))
          tail.remove_suffix(1);
        ++line;
        is_whole = !tail.empty() && tail.back() == ';';
        const std::size_t stop = at + tail.size();
        at = end + 1;
        if (is_whole || at >= text.size() || text[at] == '/') {
          auto& to = section == main ? p.statements : p.points;
          to.push_back({begin, std::max(begin, is_whole ? stop - 1 : stop), begin_line});
          break;
        }
        end = text.find('\n', at);
        if (end == std::string_view::npos) end = text.size();
      }
      if (!is_whole) fail(here, "a statement must end with \";\"");
    }
    if (!has_program) fail(p.at, "this is not a listing of a TP program: it has no /PROG");
    programs_.push_back(std::move(p));
  }
  std::vector<Parameter> parameters(const Program& p) const {
    std::size_t most = 0;
    for (std::size_t n = 1; n <= 10; ++n)
      if (learned_.flags.contains("ar " + lower(p.name) + " " + std::to_string(n))) most = n;
    std::vector<Parameter> out;
    for (std::size_t n = 1; n <= most; ++n)
      out.push_back({"AR_" + std::to_string(n), kReal, false});
    return out;
  }

  // ---- what is active where ----

  /// A statement in lower case, without its number and blanks, and without comments in brackets.
  [[nodiscard]] std::string packed(std::size_t f, const Statement& s) const {
    const std::string low = lower(files_[f].text.substr(s.begin, s.end - s.begin));
    std::string out;
    std::size_t i = low.find_first_not_of(" \t");
    while (i < low.size() && low[i] >= '0' && low[i] <= '9') ++i;
    while (i < low.size() && (low[i] == ':' || low[i] == ' ' || low[i] == '\t')) ++i;
    int depth = 0;
    bool is_comment = false;
    for (; i < low.size(); ++i) {
      const char c = low[i];
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ';') continue;
      if (c == '[') ++depth;
      if (c == ']' && depth > 0 && --depth == 0) is_comment = false;
      // R[1:count], but PR[GP1:1]
      if (c == ':' && depth > 0 && !out.ends_with("gp1")) is_comment = true;
      if (c == ':' && depth == 0) continue;  // a further line of the statement
      if (!is_comment) out += c;
    }
    return out;
  }
  static std::int64_t number_at(const std::string& s, std::size_t at) {
    if (at >= s.size() || s[at] < '0' || s[at] > '9') return -1;
    return std::strtoll(s.substr(at, 9).c_str(), nullptr, 10);
  }
  /// The label that a statement defines, with its prefix; "" = none.
  [[nodiscard]] std::string label_of(std::size_t f, std::size_t k) const {
    const std::string s = packed(f, programs_[f].statements[k]);
    if (!s.starts_with("lbl[")) return {};
    return programs_[f].scopes[k] + s.substr(4, s.find(']') - 4);
  }
  /// Labels of what is done at a point (P-SPS) are its own, up to the line of dashes.
  void find_scopes(std::size_t f) {
    Program& p = programs_[f];
    std::size_t logics = 0;
    bool is_logic = false;
    for (const Statement& s : p.statements) {
      const std::string low = lower(files_[f].text.substr(s.begin, s.end - s.begin));
      const std::size_t text = low.find_first_not_of("0123456789: \t");
      if (text != std::string::npos && low.compare(text, 2, "--") == 0) is_logic = false;
      p.scopes.push_back(is_logic ? "p" + std::to_string(logics) + "_" : "");
      if (text != std::string::npos && low[text] != '!' && low.find("p-sps") != low.npos) {
        is_logic = true;
        ++logics;
      }
    }
  }
  /// In which user frame and tool a place was taught; -1 = in what is active where it is used.
  struct Taught {
    std::int64_t frame = -1, tool = -1;
    bool is_joint = false;
  };
  /// P[n] of a section /POS.
  [[nodiscard]] std::pair<std::int64_t, Taught> taught_of(std::size_t f, const Statement& s) const {
    const std::string low = lower(files_[f].text.substr(s.begin, s.end - s.begin));
    std::string all;
    for (const char c : low)
      if (c != ' ' && c != '\t' && c != '\r' && c != '\n') all += c;
    Taught t;
    const std::size_t first = all.find('{'), second = all.find("gp2:");
    const std::string group = first == std::string::npos
                                  ? ""
                                  : all.substr(first, second == all.npos ? second : second - first);
    const auto number = [&](const char* key) {
      const std::size_t at = group.find(key);
      return at == std::string::npos ? -1 : number_at(group, at + 3);
    };
    t.frame = number("uf:");
    t.tool = number("ut:");
    t.is_joint = group.find("j1=") != std::string::npos;
    const std::size_t open = all.find("p[");
    return {open == std::string::npos ? -1 : number_at(all, open + 2), t};
  }
  /// What the statements of a program set and where they go, for the analysis of what is active.
  std::vector<TpStep> steps(std::size_t f) {
    const Program& p = programs_[f];
    std::map<std::int64_t, Taught> taught;
    for (const Statement& s : p.points) taught.insert(taught_of(f, s));
    std::map<std::string, std::size_t> labels;
    for (std::size_t k = 0; k < p.statements.size(); ++k)
      if (const std::string l = label_of(f, k); !l.empty()) labels.emplace(l, k);
    std::vector<TpStep> out(p.statements.size());
    std::int64_t skips = 0, offsets = 0, tool_offsets = 0;
    struct Open {
      std::size_t from;
      bool is_loop;
    };
    std::vector<Open> open;
    for (std::size_t k = 0; k < out.size(); ++k) {
      TpStep& step = out[k];
      const std::string s = packed(f, p.statements[k]);
      if (s.empty() || s[0] == '!' || s.starts_with("//") || s.starts_with("--") ||
          s.starts_with("message["))
        continue;
      step.is_label = s.starts_with("lbl[");
      const auto given = [&](std::string_view word) -> std::optional<std::uint64_t> {
        if (!s.starts_with(word)) return std::nullopt;
        const std::int64_t n = number_at(s, word.size());
        const bool is_plain = s.find_first_not_of("0123456789", word.size()) == std::string::npos;
        return n >= 0 && is_plain ? tp_bit(n) : kTpComputed;
      };
      step.frame = given("uframe_num=");
      step.tool = given("utool_num=");
      // The conditions are known by the statements that set them.
      if (s.starts_with("skipcondition")) step.skip = tp_bit(skips++);
      if (s.starts_with("offsetcondition")) step.offset = tp_bit(offsets++);
      if (s.starts_with("tool_offsetcondition")) step.tool_offset = tp_bit(tool_offsets++);
      for (const std::string_view word : {"jmplbl[", "skip,lbl[", "timeout,lbl["})
        for (std::size_t at = s.find(word); at != std::string::npos; at = s.find(word, at + 1)) {
          const std::int64_t n = number_at(s, at + word.size());
          if (n < 0) step.jumps_anywhere = true;
          else if (const auto l = labels.find(p.scopes[k] + std::to_string(n)); l != labels.end())
            step.to.push_back(l->second);
        }
      const bool is_conditional =
          s.starts_with("if") || s.starts_with("select") || s[0] == '=' || s.starts_with("else,");
      step.is_conditional = is_conditional;
      for (std::size_t at = s.find("call"); at != std::string::npos; at = s.find("call", at + 4)) {
        if (at > 0 && s[at - 1] != ',') continue;
        step.calls.push_back(s.substr(at + 4, s.find_first_of("(,", at + 4) - at - 4));
      }
      if (s.starts_with("jmplbl[")) step.goes_on = false;
      if (s == "end" || s == "abort") {
        step.goes_on = false;
        step.returns = s == "end";
      }
      if (is_conditional && (s.ends_with(",end") || s.find(",end,") != std::string::npos))
        step.returns = true;
      if (s.size() > 2 && std::string_view("jlc").find(s[0]) != std::string_view::npos &&
          s.compare(1, 2, "p[") == 0) {
        const auto it = taught.find(number_at(s, 3));
        if (it != taught.end() && !it->second.is_joint) {
          if (it->second.frame >= 0) step.taught_frame = tp_bit(it->second.frame);
          if (it->second.tool >= 0) step.taught_tool = tp_bit(it->second.tool);
        }
      }
      if (s.starts_with("if") && s.ends_with("then")) {
        open.push_back({k, false});
      } else if (s.starts_with("for") && s.find('=') != std::string::npos) {
        open.push_back({k, true});
      } else if (s == "else" && !open.empty() && !open.back().is_loop) {
        out[open.back().from].to.push_back(k + 1);
        open.back().from = k;
        step.goes_on = false;  // the arm above ends here
      } else if ((s == "endif" || s == "endfor") && !open.empty() &&
                 open.back().is_loop == (s == "endfor")) {
        out[open.back().from].to.push_back(k + (s == "endfor" ? 1 : 0));
        if (s == "endfor") step.to.push_back(open.back().from);
        open.pop_back();
      }
    }
    return out;
  }
  /// The condition, of those that the program sets, that counts for the statement that is read.
  template <class Condition>
  const Condition* condition_in_force(const std::vector<Condition>& all, std::uint64_t possible,
                                      const char* word, const At& at) {
    if (possible == 0) possible = kTpBefore;  // nothing leads here
    if (const auto n = tp_only(possible); n && *n < static_cast<std::int64_t>(all.size()))
      return &all[static_cast<std::size_t>(*n)];
    bad(at,
        possible == kTpBefore ? std::string("no ") + word + " CONDITION comes before this"
                              : std::string("which ") + word +
                                    " CONDITION applies here depends on the path to this point",
        possible == kTpBefore ? "" : "Set it before each motion that uses it.");
    return nullptr;
  }

  void program(std::size_t f) {
    const Program& p = programs_[f];
    name_of_ = lower(p.name);
    groups_ = p.groups;
    skip_conditions_.clear();
    offsets_.clear();
    tool_offsets_.clear();
    points_.clear();
    taught_.clear();
    ends_.clear();
    if (f == 0) {
      name_ = p.name;
      close();
    } else {
      begin(p.name, parameters(p), kNone, p.at);
    }
    labels_.clear();
    placed_.clear();
    std::map<std::size_t, std::string> begins_with;  // of statements, the label
    for (std::size_t k = 0; k < p.statements.size(); ++k)
      if (std::string name = label_of(f, k); !name.empty()) {
        labels_.insert(name);
        begins_with[k] = std::move(name);
      }
    for (const Statement& s : p.points) {
      scan(f, kTpStyle, {s.begin, s.end, s.line});
      pending_point();
    }
    for (const Statement& s : p.statements) {
      if (progress_.cancelled()) {
        statement(here(), [] {});
        break;
      }
      const auto k = static_cast<std::size_t>(&s - p.statements.data());
      const auto label = begins_with.find(k + 1);
      next_label_ = label == begins_with.end() ? std::string() : label->second;
      scope_ = p.scopes[k];
      state_ = flow_.before(name_of_, k);
      one(f, s);
    }
    end_select(p.at);
    while (!ends_.empty()) {
      fail(p.at, "a block has no " + ends_.back() + " above");
      block_end(ends_.back(), p.at);
    }
    for (const std::string& name : labels_)
      if (!placed_.contains(name)) {
        fail(p.at, "the statement of the label " + name + " was not read; it is at the end here");
        emit("LABEL " + label("lbl_" + name) + ":", p.at);
      }
    close();
  }

  // ---- positions ----

  void pending_point() {
    const At at = here();
    statement(at, [&] { point(at); });
  }
  void point(const At& at) {
    if (at_end()) return;
    if (!expect("p") || !expect("[")) return;
    const Token n = next();
    std::string name;
    if (accept(":")) name = std::string(next().raw);
    while (!at_end() && !accept("]")) next();
    if (!n.is_integer) {
      bad(n.at, "a position must have a number");
      return;
    }
    if (!expect("{")) return;
    std::map<std::string, Ex> parts;
    std::string configuration;
    bool is_joint = false, is_known = true;
    int group = 1;
    std::map<int, std::map<std::string, Ex>> others;  // joints of further groups
    while (!at_end() && !is("}")) {
      const Token t = next();
      if (t.kind != Tk::name) continue;
      if (t.low.size() == 3 && t.low.starts_with("gp") && is(":")) {
        group = t.low[2] - '0';
        continue;
      }
      if (t.low == "config") {
        accept(":");
        const Token c = next();
        if (group == 1) configuration = std::string(c.raw);
        continue;
      }
      if ((t.low == "uf" || t.low == "ut") && accept(":")) {
        const Token u = next();
        if (u.kind == Tk::number && group == 1)
          parts[t.low] = integer(static_cast<std::int64_t>(u.value));
        continue;
      }
      if (!accept("=")) continue;
      bool is_negative = accept("-");
      const Token v = next();
      if (v.kind != Tk::number) {
        // Never taught: "********"
        bad(v.at, "this position has no value", "Teach it on the controller.");
        return;
      }
      if (group != 1) {
        const bool is_axis = t.low.size() == 2 && t.low[0] == 'j';
        if (is_axis) others[group][t.low] = real(is_negative ? -v.value : v.value);
        is_known = is_known && (is_axis || !groups_.contains(group));
        continue;
      }
      if (t.low.size() == 2 && t.low[0] == 'j') is_joint = true;
      parts[t.low] = real(is_negative ? -v.value : v.value);
    }
    if (parts.empty() && !others.empty()) {
      bad(at, "this position belongs to a group other than the first, and only the first is read");
      return;
    }
    if (!is_known)
      fail(at, "another group of this position has a Cartesian position, which is not read",
           "Write a separate program for a second robot.");
    const auto part = [&](const char* k) {
      const auto it = parts.find(k);
      return it == parts.end() ? real(0) : it->second;
    };
    std::vector<Ex> external;
    for (const char* e : {"e1", "e2", "e3"}) external.push_back(part(e));
    const bool has_own =
        std::any_of(external.begin(), external.end(), [](const Ex& x) { return x.v != 0; });
    // What further groups move are additional axes, too: behind E1 to E3, where there are such.
    std::vector<Ex> further;
    for (const auto& [number, axes] : others)
      if (groups_.contains(number))
        for (const auto& [axis, v] : axes) further.push_back(v);
    if (!further.empty()) {
      if (!has_own && !learned_.flags.contains("own axes")) external.clear();
      external.insert(external.end(), further.begin(), further.end());
      if (external.size() > 6) {
        fail(at, "this position has more than six additional axes; the others are left out");
        external.resize(6);
      }
      if (!std::exchange(told_groups_, true))
        note(at, "the joints of the groups after the first are additional axes here");
    } else {
      while (!external.empty() && external.back().v == 0) external.pop_back();
    }
    if (has_own) learned_.flags.insert("own axes");
    Ex e;
    if (is_joint) {
      if (!std::exchange(told_j3_, true))
        note(at, "J3 is measured from the horizontal, not from the upper arm",
             "A run converts it to the robot's joint if the robot has its maker's axes "
             "(robot.set_axes).");
      e = joints({part("j1"), part("j2"), part("j3"), part("j4"), part("j5"), part("j6")},
                 external);
    } else {
      const Ex p = pose({part("x"), part("y"), part("z")},
                        orientation("ORIZYX", {part("r"), part("p"), part("w")}));
      // 'N U T, 0, 0, 0'
      std::int64_t status = 0;
      std::vector<Ex> turns(6, integer(0));
      std::size_t k = 0;
      const std::string low = lower(configuration);
      const std::size_t comma = low.find(',');
      for (const char c : low.substr(0, comma)) {
        if (c == 'f') status |= 4;
        if (c == 'd') status |= 2;
        if (c == 'b') status |= 1;
      }
      static constexpr std::size_t kAxes[] = {0, 3, 5};
      for (std::size_t i = comma; i != std::string::npos && k < 3; i = low.find(',', i + 1)) {
        const std::string word = low.substr(i + 1, low.find(',', i + 1) - i - 1);
        const std::size_t b = word.find_first_not_of(' ');
        if (b != std::string::npos)
          turns[kAxes[k]] = integer(std::strtol(word.c_str() + b, nullptr, 10));
        ++k;
      }
      e = configuration.empty() && external.empty() ? p
                                                    : target(p, integer(status), turns, external);
    }
    const std::string key = "P_" + std::to_string(static_cast<std::int64_t>(n.value)) +
                            (name.empty() ? "" : "_" + name);
    Symbol s;
    s.irl = irl_name(key);
    s.type = e.type;
    declare_variable(s, e.s, at, !is_in_main());
    points_[static_cast<std::int64_t>(n.value)] = std::move(s);
    const auto uf = parts.find("uf"), ut = parts.find("ut");
    taught_[static_cast<std::int64_t>(n.value)] = {
        uf == parts.end() ? -1 : static_cast<std::int64_t>(uf->second.v),
        ut == parts.end() ? -1 : static_cast<std::int64_t>(ut->second.v), is_joint};
  }

  // ---- statements ----

  void one(std::size_t f, const Statement& s) {
    const std::string_view text = files_[f].text.substr(s.begin, s.end - s.begin);
    std::size_t i = text.find_first_not_of(" \t");
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    // Lines of nothing but ":" come before it.
    std::uint32_t line = s.line;
    std::size_t line_begin = 0;
    while (i < text.size() && std::string_view(": \t\r\n").find(text[i]) != std::string_view::npos)
      if (text[i++] == '\n') {
        ++line;
        line_begin = i;
      }
    if (i == std::string_view::npos || i >= text.size()) return;
    const std::string_view body = text.substr(i);
    At at{static_cast<std::uint32_t>(f), line, static_cast<std::uint32_t>(i - line_begin + 1),
          static_cast<std::uint32_t>(s.begin + i), static_cast<std::uint32_t>(s.end)};
    if (body[0] == '!' || body.starts_with("//") || body.starts_with("--")) {
      const std::string words(body.substr(body[0] == '!' ? 1 : 2));
      std::string clean;
      for (const char c : words)
        clean += c == '{' ? '(' : c == '}' ? ')' : static_cast<unsigned char>(c) < 32 ? ' ' : c;
      emit("{ " + clean + " }", at);
      return;
    }
    if (body.size() > 8 && lower(body.substr(0, 8)) == "message[") {
      const std::string_view words =
          body.substr(8, body.rfind(']') == std::string_view::npos ? 0 : body.rfind(']') - 8);
      emit("WRITELN(" + string(words).s + ");", at);
      return;
    }
    if (const std::string number = register_of_present(body);
        !number.empty() && sets_all_elements(f, s.end, number)) {
      learned_.flags.insert("set pr " + number);
      return;
    }
    // Further lines begin with ":".
    scan(f, kTpStyle, {s.begin + i, s.end, line});
    std::vector<Token> kept;
    for (const Token& t : tokens_) {
      if (t.low == ":" && t.kind == Tk::sign && !kept.empty() && t.at.line != kept.back().at.line)
        continue;
      kept.push_back(t);
    }
    tokens_ = std::move(kept);
    comment_file_ = static_cast<std::uint32_t>(-1);
    statement(at, [&] {
      act(at);
      if (!at_end()) {
        bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
        skip_rest();
      }
    });
  }
  /// A statement without blanks, line number and end, in lower case.
  static std::string packed(std::string_view statement) {
    std::string out;
    for (const char c : statement)
      if (std::string_view(" \t\r\n;").find(c) == std::string_view::npos)
        out += lower(std::string_view(&c, 1));
    std::size_t i = 0;
    while (i < out.size() && out[i] >= '0' && out[i] <= '9') ++i;
    while (i > 0 && i < out.size() && out[i] == ':') ++i;
    return i > 0 && out[i - 1] == ':' ? out.substr(i) : out;
  }
  /// The number of a register in PR[n]=LPOS; "" = the statement is another one.
  static std::string register_of_present(std::string_view statement) {
    const std::string s = packed(statement);
    if (!s.starts_with("pr[") || !s.ends_with("]=lpos")) return {};
    const std::size_t end = s.find_first_not_of("0123456789", 3);
    return end == 3 ? std::string() : s.substr(3, end - 3);
  }
  /// Whether the statements behind a place give all six elements of a register: what it had counts
  /// for nothing then.
  bool sets_all_elements(std::size_t f, std::size_t from, const std::string& number) const {
    const std::string_view text = files_[f].text;
    for (int k = 1; k <= 6; ++k) {
      if (from < text.size() && text[from] == ';') ++from;
      const std::size_t end = std::min(text.find(';', from), text.size());
      if (from >= text.size() || !packed(text.substr(from, end - from))
                                      .starts_with("pr[" + number + "," + std::to_string(k) + "]="))
        return false;
      from = end;
    }
    return true;
  }
  void act(const At& at) {
    const Token t = peek();
    if (is("=") || (is("else") && is(",", 1) && in_select_)) return select_arm(at);
    end_select(at);
    if ((t.low == "j" || t.low == "l" || t.low == "c" || t.low == "a" || t.low == "s") &&
        (is("p", 1) || is("pr", 1)))
      return motion(at);
    next();
    const std::string& w = t.low;
    if (w == "lbl") {
      const std::string n = label_in_brackets();
      if (n.empty()) return;
      if (!placed_.insert(n).second) {
        bad(at, "this label already exists");
        return;
      }
      emit("LABEL " + label("lbl_" + n) + ":", at);
    } else if (w == "jmp" || w == "call" || w == "run") {
      --at_;
      action(at);
    } else if (w == "if") {
      if_(at);
    } else if (w == "else") {
      if (ends_.empty() || ends_.back() != "endif") {
        bad(at, "ELSE is outside IF");
        return;
      }
      if (elses_.contains(ends_.size())) {
        bad(at, "this IF already has an ELSE");
        return;
      }
      elses_.insert(ends_.size());
      indented(-1);
      emit("ELSE", at);
      indented(1);
    } else if (w == "endif" || w == "endfor") {
      if (ends_.empty() || ends_.back() != w) {
        bad(at, "no block is open here");
        return;
      }
      block_end(w, at);
    } else if (w == "select") {
      const Ex e = expression(25);
      // Arms of what is not read stay, and are never gone into.
      selected_ = e;
      in_select_ = true;
      while (!e.ok && !at_end() && !is("=")) next();
      is_first_arm_ = true;
      select_arm(at);
    } else if (w == "for") {
      for_(at);
    } else if (w == "wait") {
      wait(at);
    } else if (w == "pause") {
      emit("PAUSE;", at);
    } else if (w == "abort") {
      emit("HALT;", at);
    } else if (w == "end") {
      emit("RETURN;", at);
    } else if (w == "uframe_num" || w == "utool_num") {
      if (!expect("=")) return;
      const bool is_tool = w == "utool_num";
      const Ex n = as_integer(expression(), at);
      if (!n.ok) return;
      if (n.is_literal && (n.v < 0 || n.v > 61)) {
        bad(at, "there is no number " + n.s);
        return;
      }
      select(is_tool, n, at);
    } else if (w == "uframe" || w == "utool") {
      const bool is_tool = w == "utool";
      const Ex i = index(at);
      expect("]");
      if (!expect("=")) return;
      const Ex to = frame_element(is_tool, i, at, true);
      const Ex p = as_pose(expression(), at);
      if (!to.ok || !p.ok) return;
      assign(to, p, at);
      // It is a new one for the motions behind it, where it is the active one.
      if (is_varied(is_tool)) {
        const Symbol& n = active_number(is_tool, at);
        emit("IF " + n.irl + " = " + within(i, kSum) + " THEN " + active_pose(is_tool, at).irl +
                 " := " + to.s + "; ENDIF;",
             at);
      }
    } else if (w == "skip" || w == "offset" || w == "tool_offset") {
      if (!expect("condition")) return;
      if (w == "skip") {
        skip_conditions_.emplace_back();
        const Ex c = converted(expression(), kBool, at);
        if (c.ok) skip_conditions_.back() = c.s;
      } else {
        auto& conditions = w == "offset" ? offsets_ : tool_offsets_;
        conditions.push_back(failed());
        conditions.back() = as_pose(expression(), at);
        if (accept(",")) {
          // OFFSET CONDITION PR[1],UFRAME[2]
          skip_rest();
          conditions.back() = bad(at, "an offset in another user frame is not read");
        }
      }
      emit("{ " + source_line(at) + " }", at);
    } else if (w == "ualm") {
      const std::string n = number_in_brackets();
      if (n.empty()) return;
      emit("WRITELN(" + string("UALM[" + n + "]").s + ");", at);
      emit("PAUSE;", at);
      warn(at,
           "a user alarm becomes a line of text and PAUSE; its text and its other effects are set "
           "on the controller");
    } else if (w == "override") {
      if (!expect("=")) return;
      const Ex e = as_real(expression(), at);
      accept("%");
      if (e.is_literal && (e.v <= 0 || e.v > 100))
        bad(at, "an override must be above 0 and at most 100 %");
      else set("override", e, at);
    } else if (w == "payload" || w == "lock" || w == "unlock" || w == "col" || w == "timer" ||
               w == "joint_max_speed" || w == "linear_max_speed" || w == "weave" || w == "arc" ||
               w == "track" || w == "mnt" || w == "rsr" || w == "tc_online" || w == "monitor" ||
               w == "coord" || w == "touch" || w == "search" || w == "vision") {
      skip_rest();
      // What weighs, looks for collisions or starts programs from outside moves nothing itself.
      const bool is_meant =
          w == "timer" ? are_timers_read_
                       : w != "payload" && w != "lock" && w != "unlock" && w != "col" && w != "rsr";
      left_out(is_meant ? RMP_FAULT_ERROR : RMP_FAULT_WARNING, at,
               "IRL has no counterpart of " + std::string(t.raw));
    } else {
      --at_;
      assignment(at);
    }
  }
  void block_end(const std::string& word, const At& at) {
    if (word == "endfor" && !steps_.empty()) {
      emit(steps_.back(), at);
      steps_.pop_back();
    }
    indented(-1);
    emit(word == "endif" ? "ENDIF;" : "ENDWHILE;", at);
    elses_.erase(ends_.size());
    ends_.pop_back();
  }
  /// The key of a label: its number, and of which point's logic it is.
  std::string label_in_brackets() {
    const std::string n = number_in_brackets();
    return n.empty() ? n : scope_ + n;
  }
  /// JMP LBL[R[n]]: one jump for each label that is there; a fault of the controller else.
  void computed_jump(const At& at) {
    const Ex n = index(at);
    if (!expect("]") || !n.ok) return;
    for (const std::string& key : labels_) {
      if (!key.starts_with(scope_) ||
          key.find_first_not_of("0123456789", scope_.size()) != std::string::npos)
        continue;
      emit("IF " + within(n, kSum) + " = " + key.substr(scope_.size()) + " THEN GOTO " +
               label("lbl_" + key) + "; ENDIF;",
           at);
    }
    emit("HALT;", at);
    note(at, "for numbers without a label, the program halts here",
         "The controller raises a fault there.");
  }
  /// JMP, CALL and what else stands behind a condition.
  void action(const At& at) {
    if (accept("jmp")) {
      if (!expect("lbl")) return;
      if (is("[") && (peek(1).low == "r" || peek(1).low == "ar")) return computed_jump(at);
      const std::string n = label_in_brackets();
      if (n.empty()) return;
      if (!labels_.contains(n)) {
        bad(at, "the label " + n + " does not exist");
        return;
      }
      emit("GOTO " + label("lbl_" + n) + ";", at);
      return;
    }
    if (accept("call")) {
      const Token name = next();
      learned_.flags.insert("called " + name.low);
      std::vector<Ex> args;
      if (accept("(")) args = arguments();
      for (Ex& a : args)
        if (a.type.k == K::integer) a = as_real(a, at);
      // What a program does not read of its arguments changes nothing.
      for (const Program& p : programs_)
        if (!p.is_values && lower(p.name) == name.low && args.size() > parameters(p).size())
          args.resize(parameters(p).size());
      if (lower(name.raw) == lower(programs_[0].name)) {
        bad(at, "the program calls itself");
        return;
      }
      const std::string text = call(name.raw, args, at);
      if (!text.empty()) emit(text + ";", at);
      return;
    }
    if (is("run")) {
      skip_rest();
      bad(at, "programs that run in parallel are not read");
      return;
    }
    if (accept("pause")) {
      emit("PAUSE;", at);
      return;
    }
    if (accept("abort")) {
      emit("HALT;", at);
      return;
    }
    if (accept("end")) {
      emit("RETURN;", at);
      return;
    }
    assignment(at);
  }
  void if_(const At& at) {
    const Ex c = condition(at, [&] { return expression(); });
    if (accept("then")) {
      emit("IF " + c.s + " THEN", at);
      ends_.push_back("endif");
      indented(1);
      return;
    }
    if (!expect(",")) {
      skip_rest();
      return;
    }
    emit("IF " + c.s + " THEN", at);
    indented(1);
    action(at);
    if (accept(",") && accept("else")) {
      accept(",");
      indented(-1);
      emit("ELSE", at);
      indented(1);
      action(at);
    }
    indented(-1);
    emit("ENDIF;", at);
  }
  void select_arm(const At& at) {
    if (!in_select_) {
      bad(at, "this is outside SELECT");
      skip_rest();
      return;
    }
    if (accept("else")) {
      accept(",");
      if (is_first_arm_) emit("IF TRUE THEN", at);
      else emit("ELSE", at);
    } else {
      if (!expect("=")) return;
      const Ex v = expression(25);
      accept(",");
      const Ex c = v.ok && selected_.ok ? binary(Op::eq, selected_, v, at) : boolean(false);
      emit((is_first_arm_ ? "IF " : "ELSIF ") + c.s + " THEN", at);
    }
    is_first_arm_ = false;
    has_arms_ = true;
    indented(1);
    action(at);
    indented(-1);
  }
  void end_select(const At& at) {
    if (in_select_ && has_arms_) emit("ENDIF;", at);
    in_select_ = has_arms_ = false;
  }
  void for_(const At& at) {
    will_set();
    const Ex v = primary();
    if (!expect("=")) return;
    const Ex from = expression();
    const bool is_down = is("downto");
    if (!accept("downto") && !expect("to")) return;
    const Ex to = expression();
    if (!v.ok || !from.ok || !to.ok || !is_number(v.type)) {
      emit("WHILE FALSE DO", at);
      indented(1);
      steps_.emplace_back("{ no step }");
      ends_.push_back("endfor");
      return;
    }
    // The counter is a register, which keeps its value behind the loop.
    assign(v, from, at);
    emit("WHILE " + v.s + (is_down ? " >= " : " <= ") + within(to, kSum) + " DO", at);
    indented(1);
    steps_.push_back(v.s + " := " + v.s + (is_down ? " - 1;" : " + 1;"));
    ends_.push_back("endfor");
  }
  void wait(const At& at) {
    const Ex e = expression();
    if (!e.ok) return;
    if (is_number(e.type)) {
      if (accept("(")) {
        accept("sec");
        expect(")");
      }
      if (e.is_literal && e.v < 0) {
        bad(at, "a time must not be negative");
        return;
      }
      emit("WAIT " + within(as_real(e, at), kSum) + " SEC;", at);
      return;
    }
    const Ex c = converted(e, kBool, at);
    if (!c.ok) return;
    if (accept("timeout")) {
      expect(",");
      if (!expect("lbl")) return;
      const std::string n = label_in_brackets();
      if (!labels_.contains(n)) {
        bad(at, "the label " + n + " does not exist");
        return;
      }
      const Ex t = is_set("wait_timeout") ? get("wait_timeout", kReal, at) : real(30);
      emit("WAIT FOR " + c.s + " TIMEOUT " + within(t, kSum) + ";", at);
      // To the next line it goes on anyway.
      if (n != next_label_) emit("IF R_TIMEOUT THEN GOTO " + label("lbl_" + n) + "; ENDIF;", at);
      return;
    }
    emit("WAIT FOR " + c.s + ";", at);
  }
  // ---- frames, tools and speeds of motions ----

  /// UF and UT of the position that comes next; registers have none.
  [[nodiscard]] Taught next_place() const {
    if (!is("p") || !is("[", 1) || !peek(2).is_integer) return {};
    const auto it = taught_.find(static_cast<std::int64_t>(peek(2).value));
    return it == taught_.end() ? Taught{} : it->second;
  }
  /// Whether some motion needs to know at run time which one is active.
  [[nodiscard]] bool is_varied(bool is_tool) const {
    return learned_.flags.contains(is_tool ? "tools vary" : "frames vary");
  }
  const Symbol& active_number(bool is_tool, const At& at) {
    const std::string key = is_tool ? "%number of tool" : "%number of frame";
    if (const auto it = globals_.find(key); it != globals_.end()) return it->second;
    Symbol s;
    s.type = kInt;
    s.irl = irl_name(is_tool ? "present_utool" : "present_uframe");
    declare_variable(s, "-1", at);
    return globals_.emplace(key, std::move(s)).first->second;
  }
  const Symbol& active_pose(bool is_tool, const At& at) {
    const std::string key = is_tool ? "%active tool" : "%active frame";
    if (const auto it = globals_.find(key); it != globals_.end()) return it->second;
    Symbol s;
    s.type = kPose;
    s.irl = irl_name(is_tool ? "present_tool" : "present_frame");
    declare_variable(s, {}, at);
    return globals_.emplace(key, std::move(s)).first->second;
  }
  /// UFRAME_NUM and UTOOL_NUM. The motions name the frame and tool; variables keep them only
  /// where a motion is reached with several.
  void select(bool is_tool, const Ex& n, const At& at) {
    if (!is_varied(is_tool)) {
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    emit(active_number(is_tool, at).irl + " := " + n.s + ";", at);
    const std::string pose = active_pose(is_tool, at).irl;
    if (n.is_literal) {
      emit(pose + " := " + numbered_pose(is_tool, static_cast<std::int64_t>(n.v), at).s + ";", at);
      return;
    }
    const Ex e = numbered(is_tool ? "UTOOL" : "UFRAME", n, at);
    if (!e.ok) return;
    emit("IF " + within(n, kSum) + " = 0 THEN " + pose + " := " + identity().s + "; ELSE " + pose +
             " := " + e.s + "; ENDIF;",
         at);
  }
  /// The frame or tool of a number; 0 is the robot's base, or its flange.
  Ex numbered_pose(bool is_tool, std::int64_t n, const At& at) {
    return n == 0 ? identity() : numbered(is_tool ? "UTOOL" : "UFRAME", integer(n), at);
  }
  /// Gives a motion the tool and the frame that its places mean. False = the controller refuses it.
  bool in_frames(Motion& m, const std::vector<Taught>& places, const At& at) {
    const bool has_joints = std::any_of(m.targets.begin(), m.targets.end(),
                                        [](const Ex& e) { return e.type.k == K::joint; });
    if (has_joints) {
      m.has_frames = false;
      // Joints are the same in every frame and with every tool; on a path there a tool is meant.
      if (m.word == "PTP") {
        m.has_tool = false;
        const auto only = tp_only(state_.tool);
        if (only && has_value("UTOOL", integer(*only))) m.tool = numbered_pose(true, *only, at);
        return true;
      }
    }
    for (const bool is_tool : {false, true}) {
      if (has_joints && !is_tool) continue;
      const std::uint64_t active = is_tool ? state_.tool : state_.frame;
      std::int64_t taught = -1;
      for (const Taught& p : places) {
        const std::int64_t n = is_tool ? p.tool : p.frame;
        if (n < 0) continue;
        if (taught >= 0 && n != taught) {
          bad(at, std::string("the positions of this arc were taught ") +
                      (is_tool ? "with different tools" : "in different user frames"));
          return false;
        }
        taught = n;
      }
      std::optional<Ex>& goes = is_tool ? m.tool : m.frame;
      if (has_joints) {
        const auto only = tp_only(active);
        m.has_tool = false;
        if (only == 0 || (active != 0 && (active & ~kTpBefore) == 0)) continue;
        fail(at, "this straight motion to joint values uses the robot's present tool, not UTOOL",
             "Teach the position in Cartesian coordinates.");
        continue;
      }
      if (taught >= 0) {
        const std::uint64_t bit = tp_bit(taught);
        const std::uint64_t others = active & ~bit & ~kTpBefore;
        if (active != 0 && (active & (bit | kTpBefore | kTpComputed)) == 0) {
          const auto only = tp_only(active);
          bad(at,
              std::string("this position was taught ") + (is_tool ? "with UTOOL " : "in UFRAME ") +
                  std::to_string(taught) + ", and " +
                  (only ? (is_tool ? "UTOOL " : "UFRAME ") + std::to_string(*only) + " is active"
                        : "others are active") +
                  "; the controller stops here (" + (is_tool ? "INTP-253" : "INTP-252") + ")",
              "Select these before this motion, or teach it again.");
          return false;
        }
        if (others != 0) {
          learned_.flags.insert(is_tool ? "tools vary" : "frames vary");
          if (is_varied(is_tool)) {
            const std::string number = active_number(is_tool, at).irl;
            if ((active & kTpBefore) != 0)
              emit("IF " + number + " = -1 THEN " + number + " := " + std::to_string(taught) +
                       "; " + active_pose(is_tool, at).irl +
                       " := " + numbered_pose(is_tool, taught, at).s + "; ENDIF;",
                   at);
            emit("IF " + number + " <> " + std::to_string(taught) + " THEN HALT; ENDIF;", at);
          }
        }
        goes = numbered_pose(is_tool, taught, at);
      } else if (const auto only = tp_only(active)) {
        goes = numbered_pose(is_tool, *only, at);
      } else {
        const char* const word = is_tool ? "UTOOL" : "UFRAME";
        if ((active & kTpBefore) != 0 && told_.insert(std::string("own ") + word).second)
          fault(is_tool && active == kTpBefore ? RMP_FAULT_NOTE : RMP_FAULT_ERROR, at,
                std::string("which ") + word + " is active here is set on the controller; " +
                    (is_tool ? "the robot's present tool" : "none") + " is taken",
                std::string("Set ") + word + "_NUM before this motion.");
        if ((active & ~kTpBefore) != 0) {
          learned_.flags.insert(is_tool ? "tools vary" : "frames vary");
          if (is_varied(is_tool)) goes = place(active_pose(is_tool, at).irl, kPose);
        }
      }
      // The robot's base needs no FRAME.
      if (!is_tool && goes && goes->s == identity().s) goes.reset();
      if (is_tool && !goes) m.has_tool = false;
      if (!is_tool && !goes) m.has_frames = false;
    }
    return true;
  }
  /// What OVERRIDE leaves of a speed.
  Ex overridden(const Ex& v, bool is_time, const At& at) {
    if (!is_set("override")) return v;
    const Ex share = get("override", kReal, at);
    if (!v.ok || !share.ok) return v;
    if (share.is_constant && !share.is_place && v.is_literal) {
      const double s = std::strtod(share.s.c_str(), nullptr) / 100;
      return measure(is_time ? v.v / s : v.v * s);
    }
    if (is_time) return binary(Op::div, scaled(v, 100), share, at);
    return scaled(binary(Op::mul, v, share, at), 0.01);
  }
  /// The speed of a motion: 50%, 100mm/sec, 2.5sec, 45deg/sec, max_speed, R[1]...
  bool speed(Motion& m, bool is_joint, const At& at) {
    if (accept("max_speed")) {
      // The limit of the controller ($PARAM_GROUP.$SPEEDLIM), or of the joints.
      if (is_joint) {
        m.attributes.emplace_back("SPEED_PTP", overridden(real(100), false, at));
        return true;
      }
      const double most = params_.real("max_speed") * 1000;
      if (!std::exchange(told_max_, true))
        warn(at,
             "max_speed is a limit of the controller; " + number_text(most) + " mm/s is assumed",
             "Set max_speed to the limit of this one.");
      m.attributes.emplace_back("SPEED", overridden(measure(most), false, at));
      return true;
    }
    const Ex v = primary();
    if (!v.ok) return false;
    if (!is_number(v.type)) {
      bad(at, "the speed of the motion is expected here");
      return false;
    }
    if (v.is_literal && v.v <= 0) {
      bad(at, "this is not a speed");
      return false;
    }
    if (accept("%")) {
      if (!is_joint) {
        bad(at, "a path needs a speed in mm/sec");
        return false;
      }
      m.attributes.emplace_back("SPEED_PTP", overridden(as_real(v, at), false, at));
      return true;
    }
    if (is("sec") || is("msec")) {
      const double unit = next().low == "msec" ? 0.001 : 1;
      m.attributes.emplace_back("TIME", overridden(scaled(as_real(v, at), unit), true, at));
      return true;
    }
    static const std::map<std::string, double, std::less<>> kUnits{
        {"mm", 1}, {"cm", 10}, {"inch", 25.4}, {"deg", 1}};
    const auto unit = kUnits.find(peek().low);
    const bool is_minute = is("min", 2);
    if (unit == kUnits.end() || !is("/", 1) || (!is("sec", 2) && !is_minute)) {
      bad(here(),
          "the unit of a speed is expected here: %, sec, msec, mm/sec, cm/min, inch/min, deg/sec");
      return false;
    }
    for (int k = 0; k < 3; ++k) next();
    const Ex e = scaled(as_real(v, at), unit->second / (is_minute ? 60 : 1));
    if (unit->first == "deg") {
      if (is_joint) {
        bad(at, "a joint motion has no speed in deg/sec");
        return false;
      }
      m.attributes.emplace_back("SPEED_ORI", overridden(e, false, at));
    } else if (is_joint) {
      Ex share = scaled(e, 100 / (params_.real("tcp_speed") * 1000));
      if (share.is_literal && share.v > 100) share = real(100);
      m.attributes.emplace_back("SPEED_PTP", overridden(share, false, at));
    } else {
      m.attributes.emplace_back("SPEED", overridden(e, false, at));
    }
    return true;
  }
  void motion(const At& at) {
    const std::string kind = next().low;
    Motion m;
    m.word = kind == "j" ? "PTP" : kind == "c" ? "CIRCLE" : "LIN";
    if (kind == "a" || kind == "s") {
      skip_rest();
      bad(at, "arcs of several statements (A, S) are not read", "Use C.");
      return;
    }
    const bool is_register = is("pr");
    std::vector<Taught> places{next_place()};
    m.targets.push_back(primary());
    if (kind == "c") {
      places.push_back(next_place());
      m.targets.push_back(primary());
    }
    if (is_register && !groups_.empty() && told_.insert("groups of " + name_of_).second)
      fail(at,
           "the joints of further groups in position registers are not read; they keep their "
           "positions");
    if (is_register && learned_.flags.contains("own axes") &&
        told_.insert("axes of " + name_of_).second)
      fail(at,
           "the additional axes E1 to E3 of position registers are not read; in motions to them "
           "these axes keep their positions",
           "Teach the position as P[n].");
    const bool is_joint = kind == "j";
    if (!speed(m, is_joint, at)) return;
    for (const auto& [name, e] : m.attributes)
      if (e.is_literal && e.v <= 0) bad(at, "this is not a speed");
    std::string skip, until;
    std::size_t at_point = 0, behind_point = 0;  ///< where what is done at the point stands
    Ex by = failed(), tool_by = failed();
    while (!at_end()) {
      const Token t = next();
      const auto digits = [&](std::size_t from) {
        double n = 0;
        for (std::size_t i = from; i < t.low.size(); ++i) {
          if (t.low[i] < '0' || t.low[i] > '9') return -1.0;
          n = n * 10 + (t.low[i] - '0');
        }
        return t.low.size() > from && t.low.size() < from + 6 ? n : -1.0;
      };
      if (t.low == "fine") continue;
      if (t.low.starts_with("cnt") || t.low == "cnt") {
        Ex n = digits(3) >= 0 ? real(digits(3)) : primary();
        if (!n.ok) return;
        if (n.is_literal && n.v == 0) {
          m.attributes.emplace_back("C_PASS", boolean(true));
        } else {
          if (n.is_literal && n.v > 100) n = real(100);
          if (!std::exchange(told_cnt_, true) && !is_joint)
            note(t.at, "CNT of paths is taken as C_SPEED, the speed in % kept at the target");
          m.attributes.emplace_back(is_joint ? "C_PTP" : "C_SPEED", as_real(n, at));
        }
      } else if (t.low.starts_with("acc") && (digits(3) >= 0 || t.low == "acc")) {
        Ex n = digits(3) >= 0 ? real(digits(3)) : primary();
        if (n.is_literal && n.v > 100) {
          warn(t.at, std::string("an acceleration above 100 % is taken as 100 %") + kOtherTimes);
          n = real(100);
        }
        if (n.is_literal && n.v <= 0) bad(t.at, "this is not an acceleration");
        m.attributes.emplace_back(is_joint ? "ACC_PTP" : "ACC", as_real(n, at));
      } else if ((t.low.starts_with("cd") || t.low.starts_with("cr")) && digits(2) >= 0 &&
                 !is_joint) {
        m.attributes.emplace_back("C_CP", real(digits(2)));
      } else if (t.low == "offset" || t.low == "tool_offset") {
        const bool is_offset = t.low == "offset";
        Ex p = failed();
        if (accept(",")) {
          p = as_pose(primary(), at);
          if (is(",") && (is("uframe", 1) || is("utool", 1))) {
            bad(here(), "an offset in another frame is not read");
            skip_rest();
            return;
          }
        } else if (const Ex* found =
                       condition_in_force(is_offset ? offsets_ : tool_offsets_,
                                          is_offset ? state_.offset : state_.tool_offset,
                                          is_offset ? "OFFSET" : "TOOL_OFFSET", t.at)) {
          p = *found;
          if (!p.ok) bad(t.at, "the condition that applies here was not read");
        }
        (is_offset ? by : tool_by) = p;
      } else if (t.low == "inc") {
        m.is_incremental = true;
      } else if (t.low == "skip") {
        expect(",");
        expect("lbl");
        skip = label_in_brackets();
        const std::string* found = condition_in_force(skip_conditions_, state_.skip, "SKIP", t.at);
        if (found) until = *found;
        if (found && until.empty()) bad(t.at, "the condition that applies here was not read");
        else if (!labels_.contains(skip)) bad(t.at, "the label " + skip + " does not exist");
      } else if (t.low == "tb" || t.low == "ta" || t.low == "db") {
        // The time or the way before the point, and what is done there.
        const Ex by_how_much = primary();
        if (!accept("sec") && !accept("msec") && !accept("mm"))
          bad(here(), "sec or mm is expected here");
        if (!by_how_much.ok || !expect(",")) return;
        const bool is_behind = t.low == "ta" && !(by_how_much.is_literal && by_how_much.v == 0);
        if (is_behind)
          fail(t.at,
               "an action after a point during the next motion has no counterpart in IRL; it is "
               "left out");
        else if (!(by_how_much.is_literal && by_how_much.v == 0))
          warn(t.at, "an action set " + std::string(t.low == "db" ? "a distance" : "a time") +
                         " before the point is executed at the point");
        if (accept("p") && accept("-") && accept("sps")) continue;
        const std::size_t from = at_;
        while (!at_end() && !is("offset") && !is("tool_offset") && !is("skip")) next();
        if (!is_behind) {
          at_point = from;
          behind_point = at_;
        }
      } else if (t.low == "pth" || t.low == "break") {
        // How far the controller looks ahead.
        warn(t.at, std::string(t.raw) + " has no counterpart in IRL");
      } else {
        bad(t.at,
            "\"" + std::string(t.raw.substr(0, 40)) + "\" of a motion has no counterpart in IRL",
            "Split the statement.");
        skip_rest();
        return;
      }
    }
    if (!in_frames(m, places, at)) return;
    for (Ex& e : m.targets) {
      if (!e.ok) return;
      if (e.type.k == K::joint) {
        if (!is_joint || by.ok || tool_by.ok) e = as_place(e);
      }
      if (by.ok) e = with_pose(e, binary(Op::compose, by, as_pose(e, at), at));
      if (tool_by.ok) e = with_pose(e, binary(Op::compose, as_pose(e, at), tool_by, at));
    }
    m.until = until;
    move(std::move(m), at);
    if (at_point != 0) {
      const std::size_t behind = at_;
      at_ = at_point;
      action(at);
      if (at_ != behind_point)
        bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
      at_ = behind;
    }
    if (!skip.empty() && !until.empty() && labels_.contains(skip))
      emit("IF NOT (" + until + ") THEN GOTO " + label("lbl_" + skip) + "; ENDIF;", at);
  }
  void assignment(const At& at) {
    const Token t = peek();
    if (t.low == "$waittmout" && is("=", 1)) {
      next();
      next();
      const Ex e = as_real(expression(), at);
      set("wait_timeout", scaled(e, 0.01), at);
      return;
    }
    if (t.low[0] == '$') {
      skip_rest();
      left_out(RMP_FAULT_ERROR, at,
               "IRL has no counterpart of " + std::string(t.raw.substr(0, 60)));
      return;
    }
    if (t.kind != Tk::name || !(is("[", 1))) {
      bad(at, "\"" + std::string(t.raw.substr(0, 40)) + "\" does not begin a supported statement");
      skip_rest();
      return;
    }
    will_set();
    const Ex to = primary();
    if (!to.ok) {
      skip_rest();
      return;
    }
    if (!expect("=")) return;
    if (is("pulse")) {
      next();
      Ex time = real(0.1);
      if (accept(",")) {
        time = primary();
        accept("sec");
      }
      if (!to.is_place || to.type.k != K::boolean || !time.ok) {
        bad(at, "a pulse needs an output");
        return;
      }
      emit(to.s + " := TRUE;", at);
      emit("WAIT " + within(as_real(time, at), kSum) + " SEC;", at);
      emit(to.s + " := FALSE;", at);
      warn(at, "the IRL program waits for the end of this pulse; the controller does not");
      return;
    }
    const Ex e = expression();
    if (!e.ok) return;
    if (to.type.k == K::pose && e.type.k == K::joint) {
      bad(at, "position registers with joints are not read",
          "Use positions in Cartesian coordinates.");
      return;
    }
    assign(to, e, at);
  }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    if ((op == Op::add || op == Op::sub) && (a.type.k == K::pose || a.type.k == K::target) &&
        (b.type.k == K::pose || b.type.k == K::target)) {
      const Ex x = as_pose(a, at), y = as_pose(b, at);
      if (x.prec < kPrimary || y.prec < kPrimary) return bad(at, "only two positions can be added");
      const std::string sign = op == Op::add ? " + " : " - ";
      std::string p, o;
      for (const char c : {'X', 'Y', 'Z'})
        p += (p.empty() ? "" : ", ") + x.s + ".POS." + c + sign + y.s + ".POS." + c;
      for (const char c : {'Z', 'Y', 'X'})
        o += (o.empty() ? "ANGLE" : ", ANGLE") + std::string(1, c) + "('ZYX', " + x.s + ".ORI)" +
             sign + "ANGLE" + c + "('ZYX', " + y.s + ".ORI)";
      return value("POSE(POSITION(" + p + "), ORIZYX(" + o + "))", kPose);
    }
    return std::nullopt;
  }
  std::string number_in_brackets() {
    if (!expect("[")) return {};
    const Token n = next();
    while (!at_end() && !is("]")) next();
    expect("]");
    if (n.kind == Tk::number && n.is_integer)
      return std::to_string(static_cast<std::int64_t>(n.value));
    bad(n.at, "a number is expected here; a computed one is not read");
    return {};
  }
  /// An index, with its comment behind ":".
  Ex index(const At& at) {
    if (!expect("[")) return failed();
    // PR[GP1:n]
    if (peek().low.size() == 3 && peek().low.starts_with("gp") && is(":", 1)) {
      const Token group = next();
      next();
      if (group.low != "gp1")
        return bad(group.at, "only position registers of the first group are read");
    }
    const Ex i = as_integer(expression(25), at);
    if (accept(":"))
      while (!at_end() && !is("]")) next();
    return i;
  }
  /// The array of registers or frames, which the first use declares with what is known of it.
  Symbol& registers(const std::string& array, const std::string& name, const Type& of,
                    std::int64_t n, const At& at) {
    const auto known = known_.find(array);
    if (known == known_.end()) return implied(name, array_of(of, {{1, n}}), at);
    const std::string low = lower(name);
    learn(low, array_of(of, {{1, n}}));
    if (Symbol* s = find(low)) return *s;
    const Type type = learned_.types[low];
    std::string list;
    for (std::int64_t k = 1; k <= type.bounds[0].second; ++k) {
      const auto it = known->second.find(k);
      list += (k > 1 ? ", " : "") + (it != known->second.end() ? it->second
                                     : of.k == K::pose         ? identity().s
                                                               : "0.0");
    }
    Symbol& s = declare(name, type);
    declare_variable(s, "[" + list + "]", at);
    return s;
  }
  [[nodiscard]] bool is_known(const std::string& array, const Ex& i) const {
    const auto it = known_.find(array);
    return it != known_.end() && i.is_literal &&
           it->second.contains(static_cast<std::int64_t>(i.v));
  }
  /// R[n] or PR[n] stands here and gets a value.
  void will_set() {
    if (!is("r") && !is("pr") && !is("f") && !is("m") && !is("sr")) return;
    const std::size_t k = peek(2).low.starts_with("gp") && is(":", 3) ? 4 : 2;
    const Token& n = peek(k);
    const bool is_known = n.is_integer && (is("]", k + 1) || is(",", k + 1) || is(":", k + 1));
    const auto number = [](const Token& t) {
      return std::to_string(static_cast<std::int64_t>(t.value));
    };
    const std::string what = peek().low + " " + (is_known ? number(n) : std::string("*"));
    if (!is_known) {
      learned_.flags.insert("set " + what);
    } else if (is("pr") && is(",", k + 1)) {  // an element; the others keep what the controller has
      if (peek(k + 2).is_integer) learned_.flags.insert("part " + what + " " + number(peek(k + 2)));
    } else if (!reads_itself(n)) {
      learned_.flags.insert("set " + what);
    }
  }
  /// Whether what is assigned to the register that stands here has the register in it, so that it
  /// goes on from the controller's value.
  [[nodiscard]] bool reads_itself(const Token& n) const {
    const std::string word = peek().low;
    for (std::size_t k = 3; peek(k).kind != Tk::line && peek(k).kind != Tk::end; ++k)
      if (peek(k).low == word && is("[", k + 1) && peek(k + 2).is_integer &&
          peek(k + 2).value == n.value)
        return true;
    return false;
  }
  /// Whether a program sets the register, or each element of it.
  [[nodiscard]] bool is_set_here(const std::string& word, const std::string& key) const {
    if (learned_.flags.contains("set " + key)) return true;
    if (word != "pr") return false;
    for (const char* element : {"1", "2", "3", "4", "5", "6"})
      if (!learned_.flags.contains("part " + key + " " + element)) return false;
    return true;
  }
  /// Registers keep their values on the controller; what no program here sets is zero.
  void will_read(const std::string& word, const Ex& i, const At& at) {
    if (!i.ok) return;
    if ((word == "r" || word == "pr") && is_known(word == "r" ? "R" : "PR", i)) {
      if (word == "pr" && told_.insert("kept pr").second)
        note(at, "position registers are read without their configuration");
      return;
    }
    if (!i.is_literal || learned_.flags.contains("set " + word + " *")) return;
    const std::string key = word + " " + std::to_string(static_cast<std::int64_t>(i.v));
    if (is_set_here(word, key) || !told_.insert("unset " + key).second) return;
    std::string name = word + "[" + i.s + "]";
    for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
    if (word != "r" && word != "pr")
      warn(at,
           name + " is not set by any program here; it is " + (word == "sr" ? "empty" : "FALSE"),
           "Give it its value at its declaration.");
    else if (word == "pr")
      fail(at, name + " is set on the controller; it is zero here",
           "Give it its value at the declaration of PR, or POSREG.VA beside the listing.");
    else
      warn(at, name + " is not set by any program here; it is zero",
           "Give it its value at the declaration of R, or NUMREG.VA beside the listing.");
  }
  Ex element(const std::string& array, const Type& of, const Ex& i, const At& at) {
    if (!i.ok) return failed();
    if (i.is_literal && (i.v < 1 || i.v > 10000)) return bad(at, array + " has no number " + i.s);
    const auto n =
        i.is_literal ? static_cast<std::int64_t>(i.v) : std::int64_t{of.k == K::pose ? 64 : 200};
    // A program may have the name of the registers: CALL PR(...).
    const std::string key = lower(array);
    const bool is_program = learned_.flags.contains("called " + key) ||
                            std::any_of(programs_.begin(), programs_.end(),
                                        [&](const Program& p) { return lower(p.name) == key; });
    Symbol& s = registers(array, is_program ? array + "_register" : array, of, n, at);
    return place(s.irl + "[" + i.s + "]", of);
  }
  /// True if the programs or a backup give UFRAME[i] or UTOOL[i] a value.
  [[nodiscard]] bool has_value(const std::string& array, const Ex& i) const {
    const std::string set = "set " + array + " ";
    if (learned_.flags.contains(set + "*")) return true;
    if (!i.is_literal)
      return known_.contains(array) || (learned_.flags.lower_bound(set) != learned_.flags.end() &&
                                        learned_.flags.lower_bound(set)->starts_with(set));
    return i.v == 0 || is_known(array, i) || learned_.flags.contains(set + i.s);
  }
  /// An element of UFRAME or UTOOL that is read: what the controller has, unless the programs or a
  /// backup say it.
  Ex numbered(const std::string& array, const Ex& i, const At& at) {
    const Ex e = element(array, kPose, i, at);
    if (e.ok && !has_value(array, i) &&
        told_.insert("unset " + array + (i.is_literal ? i.s : "")).second)
      fail(at,
           (i.is_literal ? array + "[" + i.s + "]" : array) +
               " is set on the controller; it is zero here",
           "Give it its value at the declaration of " + array +
               ", or SYSFRAME.VA beside the listing.");
    return e;
  }
  Ex frame_element(bool is_tool, const Ex& i, const At& at, bool is_written) {
    const std::string array = is_tool ? "UTOOL" : "UFRAME";
    if (!i.ok) return failed();
    if (is_written) {
      learned_.flags.insert("set " + array + (i.is_literal ? " " + i.s : " *"));
      return element(array, kPose, i, at);
    }
    return numbered(array, i, at);
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      return e;
    }
    if (t.kind != Tk::name) {
      if (!at_end()) next();
      return bad(at, "a value is expected here");
    }
    next();
    if (t.low == "on" || t.low == "off") return boolean(t.low == "on");
    if (t.low == "true" || t.low == "false") return boolean(t.low == "true");
    if (t.low == "r") {
      const Ex i = index(at);
      expect("]");
      if (i.ok) will_read("r", i, at);
      return element("R", kReal, i, at);
    }
    if (t.low == "f" || t.low == "m") {
      const Ex i = index(at);
      expect("]");
      will_read(t.low, i, at);
      return element(t.low == "f" ? "FLAG" : "MARKER", kBool, i, at);
    }
    if (t.low == "sr") {
      const Ex i = index(at);
      expect("]");
      will_read("sr", i, at);
      return element("SR", kString, i, at);
    }
    if (t.low == "ar") {
      const Ex i = index(at);
      expect("]");
      if (!i.is_literal || i.v < 1 || i.v > 10) return bad(at, "there is no such argument");
      const std::string n = std::to_string(static_cast<std::int64_t>(i.v));
      learned_.flags.insert("ar " + name_of_ + " " + n);
      const Symbol* s = find("ar_" + n);
      if (!s) s = &implied("AR_" + n, kReal, at);
      Ex e = place(s->irl, kReal);
      e.is_place = false;
      return e;
    }
    if (t.low == "p") {
      const Ex i = index(at);
      expect("]");
      if (!i.ok) return i;
      if (!i.is_literal) return bad(at, "positions with computed numbers are not read");
      const auto it = points_.find(static_cast<std::int64_t>(i.v));
      if (it == points_.end()) return bad(at, "the position P[" + i.s + "] has no value in /POS");
      return place(it->second.irl, it->second.type);
    }
    if (t.low == "pr") {
      const Ex i = index(at);
      if (i.ok) will_read("pr", i, at);
      Ex j = failed();
      if (accept(",")) {
        j = as_integer(expression(25), at);
        if (accept(":"))
          while (!at_end() && !is("]")) next();
        expect("]");
        const Ex p = element("PR", kPose, i, at);
        return p.ok && j.ok ? component(p, j, at) : failed();
      }
      expect("]");
      return element("PR", kPose, i, at);
    }
    if (t.low == "uframe" || t.low == "utool") {
      const Ex i = index(at);
      expect("]");
      return frame_element(t.low == "utool", i, at, false);
    }
    if (t.low == "lpos") {
      // Seen from the user frame and with the tool that are active, as a motion is.
      Motion m;
      m.targets.push_back(identity());
      if (!in_frames(m, {Taught{}}, at)) return failed();
      return as_pose(present_target(m.tool, m.frame), at);
    }
    if (t.low == "jpos")
      return bad(at, "position registers are Cartesian here, and JPOS is joints",
                 "Use LPOS, or teach the position.");
    static const std::map<std::string, std::pair<bool, int>, std::less<>> kSignals{
        {"di", {false, 0}},    {"do", {true, 0}},    {"ri", {false, 1000}}, {"ro", {true, 1000}},
        {"ui", {false, 2000}}, {"uo", {true, 2000}}, {"si", {false, 3000}}, {"so", {true, 3000}},
        {"wi", {false, 5000}}, {"wo", {true, 5000}}};
    if (const auto it = kSignals.find(t.low); it != kSignals.end()) {
      const Ex i = index(at);
      expect("]");
      if (!i.ok) return i;
      if (!i.is_literal || i.v < 0 || i.v > 100000)
        return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
      if (it->second.second > 0 && told_.insert(t.low).second)
        note(at, std::string(t.raw) + " are numbered from " + std::to_string(it->second.second) +
                     " on here");
      const Symbol& s =
          signal(it->second.first, static_cast<std::int64_t>(i.v) + it->second.second);
      Ex e = place(s.irl, s.type);
      e.is_place = it->second.first;
      return e;
    }
    if (t.low == "gi" || t.low == "go") {
      const Ex i = index(at);
      expect("]");
      if (!i.ok) return i;
      if (!i.is_literal)
        return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
      if (i.v < 0 || i.v > 20'000) return bad(at, "there is no group of signals with this number");
      // WI and WO begin at 5000.
      const auto n = static_cast<std::int64_t>(i.v);
      if (told_.insert(t.low).second)
        note(at,
             std::string(t.raw) +
                 "[n] are mapped to 16 bits from 4000 + 16 n on, above 62 from 200000 + 16 n on");
      const Symbol& s = signal(t.low == "go", (n > 62 ? 200'000 : 4000) + 16 * n, 16);
      Ex e = place(s.irl, s.type);
      e.is_place = t.low == "go";
      return e;
    }
    if (is("[")) {
      while (!at_end() && !accept("]")) next();
    }
    return bad(at, "IRL has no counterpart of " + std::string(t.raw.substr(0, 40)));
  }
  Ex component(const Ex& p, const Ex& j, const At& at) {
    if (j.is_literal && j.v >= 7 && j.v <= 9)
      return bad(at, "the additional axes E1 to E3 of position registers are not read",
                 "Teach the position as P[n].");
    if (!j.is_literal || j.v < 1 || j.v > 6)
      return bad(at, "the component of a position must be a known number from 1 to 6");
    const auto k = static_cast<int>(j.v);
    if (k <= 3) return place(p.s + ".POS." + static_cast<char>('X' + k - 1), kReal);
    const auto angle = [&](char c) {
      return std::string("ANGLE") + c + "('ZYX', " + p.s + ".ORI)";
    };
    const char axis = static_cast<char>('X' + k - 4);
    Ex e = place(angle(axis), kReal);
    e.setter = p.s + ".ORI := ORIZYX(";
    for (const char c : {'Z', 'Y', 'X'})
      e.setter += (c == 'Z' ? "" : ", ") + (c == axis ? "%" : angle(c));
    e.setter += ")";
    return e;
  }

  std::vector<Program> programs_;
  std::map<std::int64_t, Symbol> points_;
  /// What backups say of PR, R, UFRAME and UTOOL, in IRL.
  std::map<std::string, std::map<std::int64_t, std::string>> known_;
  std::set<std::string> labels_, told_, placed_;
  std::string next_label_;
  std::string scope_;     ///< of the labels: of which point's logic they are
  std::set<int> groups_;  ///< that the program moves, besides the first
  bool are_timers_read_ = false, told_groups_ = false, told_j3_ = false;
  std::vector<std::string> ends_, steps_;
  std::set<std::size_t> elses_;  ///< of the open blocks, how deep those are that have an ELSE
  std::string name_of_;
  Ex selected_;
  TpFlow flow_;
  TpState state_;                             ///< where the statement begins that is read
  std::vector<std::string> skip_conditions_;  ///< in IRL, as the program sets them
  std::vector<Ex> offsets_, tool_offsets_;    ///< the same of OFFSET and TOOL_OFFSET CONDITION
  std::map<std::int64_t, Taught> taught_;     ///< of the program's positions
  bool in_select_ = false, is_first_arm_ = true, has_arms_ = false, told_cnt_ = false,
       told_max_ = false;
};

}  // namespace

Made read_tp(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<TpReader>(task, params, progress);
}

}  // namespace robomosp::readers

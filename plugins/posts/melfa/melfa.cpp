// SPDX-License-Identifier: Apache-2.0
// The first letter says what a variable is: M a number, P a position, J joints, C a text. Routines
// are subroutines of one program (GoSub): parameters and locals are variables of their own, which
// is right because nothing recurses. BOOL is 0 or 1; conditions are comparisons, so that the
// bitwise Not is never needed. Loops are labels and GoTo: nothing has to be left early.
#include "melfa.h"

#include <robomosp/sdk/post_passing.h>

#include "../common/moves.h"

namespace robomosp::post {
namespace {

class MelfaWriter final : public MoveWriter {
 public:
  MelfaWriter(const PostTask& task, PostOutput& output, const PostCapabilities& c, Progress& p,
              int step)
      : MoveWriter(task, output, c, p), step_(step) {}

 private:
  // ---- the program ----
  /// A file: its lines, and the positions that stand behind them.
  struct Program {
    File lines{0};
    std::vector<std::string> positions;
    Points points, joints;
  };
  /// A part of a flattened program that is too long for one file.
  [[nodiscard]] bool is_part(std::uint32_t r) const { return r != 0 && task_.form == kPostFlat; }

  void begin() override {
    out_ = &program_.lines;
    ptp_radius_ = number_option("ptp_radius", 50);
    if (profile_.frame >= 0)
      note("poses are written in the robot's base: the profile's frame is not set by Base");
    if (!profile_.prologue.empty()) program_.lines.add_lines(profile_.prologue);
    for (const char* s : {"P1", "J1", "M1", "C1"}) names_.reserve(s);
  }
  void routine_begin(std::uint32_t r) override {
    if (r == 0) {
      if (profile_.tool >= 0 && static_cast<std::size_t>(profile_.tool) < profile_.tools.size())
        set_tool(profile_.tools[static_cast<std::size_t>(profile_.tool)].pose);
      return;
    }
    const auto& x = routine(r);
    if (x.kind == RMP_ROUTINE_PROCESS)
      cannot("parallel processes within a program", "Post it as a program for a separate slot.");
    if (x.kind == RMP_ROUTINE_INTERRUPT) cannot("interrupts of this kind", "Use UNTIL.");
    if (is_part(r)) {
      main_ = std::exchange(program_, {});
      return;
    }
    line(entry(r));
  }
  void routine_end(std::uint32_t r) override {
    if (is_part(r)) {
      line("End");
      finished_.emplace_back(r, std::exchange(program_, std::exchange(main_, {})));
      return;
    }
    if (r != 0) {
      line("Return");
      return;
    }
    if (!profile_.epilogue.empty()) program_.lines.add_lines(profile_.epilogue);
    line("End");
  }
  std::string entry(std::uint32_t r) {
    const auto [it, is_new] = entries_.try_emplace(r);
    if (is_new) it->second = "*" + names_.unique(symbol(routine(r).symbol).name);
    return it->second;
  }
  void finish() override {
    give(0, program_);
    for (auto& [r, part] : finished_) give(r, part);
  }
  void give(std::uint32_t r, Program& p) {
    std::size_t n = 0;
    const std::size_t longest = step_ == 10 ? 127 : 240;
    for (std::string& s : p.lines.lines()) {
      s = std::to_string(++n * static_cast<std::size_t>(step_)) + " " + s;
      if (s.size() <= longest) continue;
      at_ = p.lines.spans()[n - 1].file != RMP_NONE ? p.lines.spans()[n - 1] : routine(r).span;
      fail("this becomes a line of " + std::to_string(s.size()) + " characters, and " +
               std::string(caps_.title) + " takes " + std::to_string(longest),
           "Compute parts of it beforehand, or use shorter names.");
    }
    const std::size_t most =
        static_cast<std::size_t>(profile_.max_lines > 0 ? profile_.max_lines : caps_.max_lines);
    at_ = routine(r).span;
    if (n > most)
      fail("the program has " + std::to_string(n) + " lines, and the controller allows " +
               std::to_string(most),
           "Split it, or set the controller's limit in the profile (max_lines).");
    for (const std::string& s : p.positions) p.lines.add(s);
    p.lines.give(output_, (r == 0 ? std::string(task_.name) : routine_name(r)) + ".prg", true);
  }
  std::string new_label() { return "*" + names_.unique("L"); }

  // ---- variables ----
  char kind(std::uint32_t t) const {
    const auto& x = type(t);
    if (t == RMP_TYPE_INT || t == RMP_TYPE_REAL || t == RMP_TYPE_BOOL) return 'M';
    if (t == RMP_TYPE_STRING || t == RMP_TYPE_CHAR) return 'C';
    switch (x.role) {
      case RMP_ROLE_POSITION:
      case RMP_ROLE_ORIENTATION:
      case RMP_ROLE_POSE:
      case RMP_ROLE_ROBTARGET: return 'P';
      case RMP_ROLE_JOINT:
      case RMP_ROLE_MAIN_JOINT: return 'J';
      default: return 0;
    }
  }
  struct Place {
    std::uint32_t symbol = RMP_NONE;
    std::string suffix, index;
    std::uint32_t type = RMP_NONE;
  };
  std::string part(std::uint32_t s, const std::string& suffix, char k) {
    const auto [it, is_new] = parts_.try_emplace({s, suffix});
    if (!is_new) return it->second;
    const std::string wish = std::string(1, k) + symbol(s).name + suffix;
    if (k != 'C') return it->second = names_.unique(wish);
    return it->second = names_.unique(wish) + "$";
  }
  std::optional<Place> place(std::uint32_t e) {
    const auto& x = expression(e);
    const auto o = links(x.first, x.count);
    if (x.op == RMP_EXPR_SYMBOL) {
      const auto k = symbol(x.symbol).kind;
      if (k == RMP_SYMBOL_INPUT || k == RMP_SYMBOL_OUTPUT) return std::nullopt;
      return Place{x.symbol, "", "", x.type};
    }
    if (x.op == RMP_EXPR_FIELD) {
      const std::uint32_t of = expression(o[0]).type;
      if (role(of) != RMP_ROLE_NONE) return std::nullopt;
      auto p = place(o[0]);
      if (!p) return std::nullopt;
      p->suffix += "_" + field_name(of, x.symbol);
      p->type = x.type;
      return p;
    }
    if (x.op == RMP_EXPR_INDEX) {
      const auto& of = type(expression(o[0]).type);
      if (of.kind != RMP_TYPE_ARRAY) return std::nullopt;
      auto p = place(o[0]);
      if (!p) return std::nullopt;
      // Elements are counted from 1.
      std::string i;
      if (const auto v = known(o[1])) {
        i = std::to_string(static_cast<std::int64_t>(*v) - of.lower + 1);
      } else {
        const std::int64_t by = of.lower - 1;
        i = text(o[1]);
        if (by != 0)
          i = within(expr(o[1]), 6) + (by > 0 ? "-" : "+") + std::to_string(by > 0 ? by : -by);
      }
      if (!p->index.empty())
        i = "(" + p->index + "-1)*" + std::to_string(std::int64_t{of.upper} - of.lower + 1) + "+" +
            i;
      p->index = i;
      p->type = x.type;
      return p;
    }
    return std::nullopt;
  }
  std::string place_text(const Place& p) {
    const char k = kind(p.type);
    if (k == 0) {
      cannot("whole values of type " + type_name(p.type), "Assign its parts one by one.");
      return "M1";
    }
    return part(p.symbol, p.suffix, k) + (p.index.empty() ? "" : "(" + p.index + ")");
  }
  struct Leaf {
    std::string suffix;
    std::uint32_t type;
    std::vector<std::uint32_t> values;
    bool is_array = false;
  };
  void leaves(std::uint32_t t, std::uint32_t e, const std::string& suffix, bool in_array,
              std::vector<Leaf>& out, int depth) {
    if (depth > 100 || out.size() > 1000) return;
    if (kind(t) != 0) {
      for (Leaf& l : out)
        if (l.suffix == suffix) {
          l.values.push_back(e);
          return;
        }
      out.push_back({suffix, t, {e}, in_array});
      return;
    }
    const auto& x = type(t);
    if ((x.kind != RMP_TYPE_RECORD && x.kind != RMP_TYPE_ARRAY) || x.role != RMP_ROLE_NONE) {
      cannot("variables of type " + type_name(t), "Post the flattened program (form = \"flat\").");
      return;
    }
    std::span<const std::uint32_t> parts;
    if (e != RMP_NONE) {
      if (expression(e).op != RMP_EXPR_MAKE) {
        cannot("such value of type " + type_name(t) + " at the start of a variable",
               "Assign its parts in the program.");
        return;
      }
      parts = links(expression(e).first, expression(e).count);
    }
    const bool is_array = x.kind == RMP_TYPE_ARRAY;
    const std::int64_t n = is_array ? std::int64_t{x.upper} - x.lower + 1 : x.field_count;
    if (n > 9999) {
      fail("arrays of more than 9999 elements cannot be posted", "Make it smaller.");
      return;
    }
    for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(n); ++k)
      leaves(is_array ? x.element : field_row(x.first_field + k).type,
             k < parts.size() ? parts[k] : RMP_NONE,
             is_array ? suffix : suffix + "_" + field_name(t, k), in_array || is_array, out,
             depth + 1);
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    const auto& x = symbol(s);
    at_ = x.span;
    if (x.kind == RMP_SYMBOL_ROBOT) return;
    std::vector<Leaf> all;
    leaves(x.type, x.value, "", false, all, 0);
    for (const Leaf& l : all) {
      const char k = kind(l.type);
      const std::string n = part(s, l.suffix, k);
      if (l.is_array) line("Dim " + n + "(" + std::to_string(l.values.size()) + ")");
      for (std::size_t i = 0; i < l.values.size(); ++i) {
        const std::string to = n + (l.is_array ? "(" + std::to_string(i + 1) + ")" : "");
        if (l.values[i] != RMP_NONE) set(to, l.type, l.values[i]);
        else if (k == 'M') line(to + "=0");
        else if (k == 'C') line(to + "=\"\"");
        else if (k == 'P') line(to + "=" + zero());
      }
    }
  }
  /// A position of zeros.
  std::string zero() { return constant_position("(0.00,0.00,0.00,0.00,0.00,0.00)(7,0)"); }
  void set(const std::string& to, std::uint32_t t, std::uint32_t value) {
    if (t == RMP_TYPE_BOOL) {
      if (const auto v = known(value)) line(to + "=" + (*v != 0 ? "1" : "0"));
      else line("If " + condition(value) + " Then " + to + "=1 Else " + to + "=0");
      return;
    }
    line(to + "=" + text(value));
  }
  Text variable(std::uint32_t s) override {
    const char k = kind(symbol(s).type);
    if (k == 0) {
      cannot("whole values of type " + type_name(symbol(s).type), "Assign its parts one by one.");
      return {"M1"};
    }
    return {part(s, "", k)};
  }
  /// X, Y or Z of a position that is a variable; the position of a pose, too.
  std::optional<std::string> component(std::uint32_t object, std::uint32_t n) {
    if (role(expression(object).type) != RMP_ROLE_POSITION) return std::nullopt;
    std::uint32_t e = object;
    for (int k = 0; k < 3; ++k) {
      const auto& x = expression(e);
      if (x.op != RMP_EXPR_FIELD || x.symbol != 0) break;
      const std::uint32_t outer = links(x.first, x.count)[0];
      const std::uint32_t r = role(expression(outer).type);
      if (r != RMP_ROLE_POSE && r != RMP_ROLE_ROBTARGET) break;
      e = outer;
    }
    const auto p = place(e);
    if (!p) return std::nullopt;
    return place_text(*p) + "." + "XYZ"[n];
  }
  Text field(std::uint32_t object, std::uint32_t n, const rmp_code_expression& e) override {
    if (const auto c = component(object, n)) return {*c};
    if (const auto p = place(static_cast<std::uint32_t>(&e - &expression(0))))
      return {place_text(*p)};
    if (role(expression(object).type) == RMP_ROLE_ROBTARGET && n == 0) return expr(object);
    cannot("such part of a value at run time",
           "Read X, Y and Z, or post the flattened program (form = \"flat\").");
    return {"M1"};
  }
  Text index(std::uint32_t, std::uint32_t, const rmp_code_expression& e) override {
    if (const auto p = place(static_cast<std::uint32_t>(&e - &expression(0))))
      return {place_text(*p)};
    cannot("such element at run time", "Use an ARRAY of the program.");
    return {"M1"};
  }
  void assign(std::uint32_t to, std::uint32_t value) override {
    const auto& x = expression(to);
    const auto o = links(x.first, x.count);
    if (x.op == RMP_EXPR_FIELD) {
      if (const auto c = component(o[0], x.symbol)) {
        line(*c + "=" + text(value));
        return;
      }
      if (role(expression(o[0]).type) == RMP_ROLE_ROBTARGET && x.symbol == 0) {
        assign(o[0], value);
        return;
      }
      // The position of a pose keeps the orientation.
      const auto& of = expression(o[0]);
      if (role(of.type) == RMP_ROLE_POSE && x.symbol == 0) {
        const auto p = place(o[0]);
        const std::string v = text(value);
        if (p && v.find_first_of("*+( ") == std::string::npos) {
          for (const char c : {'X', 'Y', 'Z'}) line(place_text(*p) + "." + c + "=" + v + "." + c);
          return;
        }
      }
    }
    const auto p = place(to);
    if (!p || kind(p->type) == 0) {
      cannot("assignments to this place", "Assign its parts, or post the flattened program.");
      return;
    }
    const std::string where = place_text(*p);
    set(where, p->type, value);
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {
        {RMP_EXPR_NEGATE, "-", 8, Operator::prefix},
        {RMP_EXPR_ADD, "+", 6},
        {RMP_EXPR_SUBTRACT, "-", 6},
        {RMP_EXPR_MULTIPLY, "*", 7},
        {RMP_EXPR_DIVIDE, "/", 7},
        // Which of them and * and / goes first is left to no controller: parentheses say it.
        {RMP_EXPR_DIV, "\\", 7, Operator::infix, 6},
        {RMP_EXPR_MOD, " Mod ", 7, Operator::infix, 6},
    };
    return kAll;
  }
  const Operator* operation(const rmp_code_expression& e) override {
    for (const std::uint32_t o : links(e.first, e.count))
      if (kind(expression(o).type) != 'M') return nullptr;
    return Writer::operation(e);
  }
  /// A comparison that is true where the expression is, or where it is not.
  Text compare(std::uint32_t e, bool is_true) {
    static constexpr std::array<const char*, 6> kSigns{"=", "<>", "<", "<=", ">", ">="};
    static constexpr std::array<std::size_t, 6> kOther{1, 0, 5, 4, 3, 2};
    const auto& x = expression(e);
    const auto o = links(x.first, x.count);
    if (const auto v = known(e)) return {(*v != 0) == is_true ? "1=1" : "1=0", 5};
    if (x.op == RMP_EXPR_NOT) return compare(o[0], !is_true);
    if (x.op == RMP_EXPR_AND || x.op == RMP_EXPR_OR) {
      if (matters(o[1]))
        warn("MELFA-BASIC evaluates both sides of AND and OR",
             "Nest IF statements if the right side must not be evaluated.");
      const bool is_and = (x.op == RMP_EXPR_AND) == is_true;
      const int b = is_and ? 3 : 1;
      const std::string left = within(compare(o[0], is_true), b);
      return {left + (is_and ? " And " : " Or ") + within(compare(o[1], is_true), b + 1), b};
    }
    if (x.op == RMP_EXPR_EXOR) {
      const auto part = [&](bool a, bool b) {
        const std::string left = within(compare(o[0], a), 4);
        return "(" + left + " And " + within(compare(o[1], b), 4) + ")";
      };
      return {part(true, !is_true) + " Or " + part(false, is_true), 1};
    }
    if (x.op >= RMP_EXPR_EQUAL && x.op <= RMP_EXPR_GREATER_EQUAL) {
      if (expression(o[0]).type == RMP_TYPE_BOOL) {
        const bool same = (x.op == RMP_EXPR_EQUAL) == is_true;
        for (std::size_t i = 0; i < 2; ++i)
          if (const auto v = known(o[1 - i])) return compare(o[i], (*v != 0) == same);
        const auto part = [&](bool a, bool b) {
          const std::string left = within(compare(o[0], a), 4);
          return "(" + left + " And " + within(compare(o[1], b), 4) + ")";
        };
        return {part(true, same) + " Or " + part(false, !same), 1};
      }
      const char k = kind(expression(o[0]).type);
      const bool is_text = k == 'C' && (x.op == RMP_EXPR_EQUAL || x.op == RMP_EXPR_NOT_EQUAL);
      if (k != 'M' && !is_text) {
        cannot("comparisons of values of type " + type_name(expression(o[0]).type),
               "Compare numbers.");
        return {"1=1", 5};
      }
      std::size_t sign = x.op - RMP_EXPR_EQUAL;
      if (!is_true) sign = kOther[sign];
      const std::string left = within(expr(o[0]), 6);
      return {left + kSigns[sign] + within(expr(o[1]), 6), 5};
    }
    // A value of its own: a variable, a signal, what a function gave.
    return {within(expr(e), 6) + (is_true ? "=1" : "=0"), 5};
  }
  std::string condition(std::uint32_t e) { return compare(e, true).text; }
  bool matters(std::uint32_t first) const {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const auto& x = expression(open.back());
      open.pop_back();
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_CALL || x.op == RMP_EXPR_INDEX || x.op == RMP_EXPR_DIVIDE ||
          x.op == RMP_EXPR_DIV || x.op == RMP_EXPR_MOD)
        return true;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL) return {k.integer ? "1" : "0"};
    return Writer::literal(k);
  }
  std::string real_literal(double v) override {
    if (!(std::fabs(v) < 1e15)) {
      fail("the number " + shortest(v) + " is too large to write", "Use another unit.");
      return "0";
    }
    return trimmed(v, 9, 1);
  }
  Text string_literal(std::string_view s) override { return {"\"" + plain_text(s, '"') + "\""}; }
  Text convert(std::uint32_t operand, const rmp_code_expression& e) override {
    if (kind(e.type) == 'C' && kind(expression(operand).type) == 'C') return expr(operand);
    return Writer::convert(operand, e);
  }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression&) override {
    const std::string left = within(expr(a), 7);
    return {left + "*" + within(expr(b), 8), 7};
  }
  Text make(std::span<const std::uint32_t> o, const rmp_code_expression& e) override {
    switch (role(e.type)) {
      // Either part has zeros where the other has its numbers.
      case RMP_ROLE_POSE: return {within(expr(o[0]), 6) + "+" + within(expr(o[1]), 6), 6};
      case RMP_ROLE_POSITION: {
        const std::string t = names_.unique("PT");
        line(t + "=" + zero());
        for (std::size_t i = 0; i < 3; ++i) line(t + "." + "XYZ"[i] + "=" + text(o[i]));
        return {t};
      }
      case RMP_ROLE_ROBTARGET:
        warn("status and turns of a target computed at run time are not written",
             "Move to a known target first.");
        return expr(o[0]);
      default: return Writer::make(o, e);
    }
  }
  Text intrinsic(std::string_view f, std::span<const std::uint32_t> a,
                 const rmp_code_expression& e) override {
    const auto t = [&](std::size_t i) { return text(a[i]); };
    for (const auto& [from, to] : {std::pair{"SIN", "Sin"}, {"COS", "Cos"}, {"TAN", "Tan"}})
      if (f == from) return {std::string(to) + "(Rad(" + t(0) + "))"};
    if (f == "ATAN") return {"Deg(Atn(" + t(0) + "))"};
    if (f == "ATAN2") return {"Deg(Atn2(" + t(0) + "," + t(1) + "))"};
    for (const auto& [from, to] : {std::pair{"SQRT", "Sqr"},
                                   {"ABS", "Abs"},
                                   {"EXP", "Exp"},
                                   {"LN", "Ln"},
                                   {"TRUNC", "Fix"},
                                   {"INV", "Inv"}})
      if (f == from) return {std::string(to) + "(" + t(0) + ")"};
    if (f == "ROUND") {
      const std::string x = within(expr(a[0]), 6);
      return {"Fix(" + x + "+0.5*Sgn(" + t(0) + "))"};
    }
    if (f == "FLOAT") return expr(a[0]);
    if (f == "ORIMULT") return {within(expr(a[0]), 7) + "*" + within(expr(a[1]), 8), 7};
    if (f == "CONCAT") return {within(expr(a[0]), 6) + "+" + within(expr(a[1]), 6), 6};
    if (f == "LENGTH") return {"Len(" + t(0) + ")"};
    if (f == "EXTRACT") return {"Mid$(" + t(0) + "," + t(1) + "," + t(2) + ")"};
    return Writer::intrinsic(f, a, e);
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    call(r, arguments);
    const char k = kind(routine(r).result);
    if (k == 0) {
      cannot("functions of type " + type_name(routine(r).result), "Use a variable of the program.");
      return {"M1"};
    }
    // Its result may be computed again before it is used.
    const std::string keep = temporary(k);
    line(keep + "=" + result(r));
    return {keep};
  }
  std::string temporary(char k) {
    return names_.unique(std::string(1, k) + "T") + (k == 'C' ? "$" : "");
  }
  bool has_call(std::uint32_t first) const {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const auto& x = expression(open.back());
      open.pop_back();
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_CALL) return true;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  std::string result(std::uint32_t r) {
    const auto [it, is_new] = results_.try_emplace(r);
    if (is_new) {
      const char k = std::max(kind(routine(r).result), 'C');
      it->second =
          names_.unique(std::string(1, k) + symbol(routine(r).symbol).name) + (k == 'C' ? "$" : "");
    }
    return it->second;
  }

  // ---- points ----
  std::string constant_position(const std::string& numbers) {
    const auto [n, is_new] = program_.points.add(numbers);
    std::string name = "P" + std::to_string(n + 1);
    if (is_new) {
      names_.reserve(name);
      program_.positions.push_back(name + "=" + numbers);
    }
    return name;
  }
  std::string pose_name(const Pose& p, const PostPoint* of, bool is_motion) {
    if (!usable(p)) return "P1";
    const Placed at = placed(p, Orientation::fixed_xyz);
    std::string s = "(";
    const int digits = std::max(2, static_cast<int>(profile_.length_digits));
    for (std::size_t i = 0; i < 3; ++i) s += (i ? "," : "") + number(at.mm[i], digits);
    for (std::size_t i = 0; i < 3; ++i) s += "," + number(at.ori[i], std::max(3, digits));
    if (of)
      for (const double v : external_axes(*of)) s += "," + number(v, digits);
    std::uint32_t f1 = 7;
    std::uint64_t f2 = 0;
    if (of && (of->has_status || !of->q.empty())) {
      f1 = ((of->status & kPostShoulderBehind) ? 0U : 4U) |
           ((of->status & kPostElbowOther) ? 0U : 2U) |
           ((of->status & kPostWristFlipped) ? 0U : 1U);
      if (!of->q.empty()) (void)checked_axes(*of);
      for (std::size_t i = 0; i < 8; ++i) {
        const int turn = axis_turn(*of, i).value_or(0);
        if (turn < -8 || turn > 7)
          fail("axis " + std::to_string(i + 1) + " would be at turn " + std::to_string(turn) +
                   ", and MELFA-BASIC counts from -8 to 7",
               "Give other TURNS.");
        f2 |= static_cast<std::uint64_t>(turn & 15) << (4 * i);
      }
      if (of->q.empty() && !of->turns.empty() && of->turns_from != kTurnsFrom)
        warn(
            "TURNS of this target are not written: MELFA's turn numbers cannot be derived from "
            "them",
            "Name the robot: program.post{robot = ...}.");
    } else if (is_motion && !told_status_) {
      told_status_ = true;
      warn("the configuration of targets is unknown and is written as 7: right, above, non-flip",
           "Name the robot: program.post{robot = ...}, or give ROBTARGETs.");
    }
    return constant_position(s + ")(" + std::to_string(f1) + "," + std::to_string(f2) + ")");
  }
  std::string joints_name(const PostPoint& p) {
    const auto q = checked_axes(p);
    std::string s = "(";
    for (std::size_t i = 0; i < q.size(); ++i) s += (i ? "," : "") + number(q[i], 3);
    for (const double v : external_axes(p)) s += "," + number(v, 3);
    const auto [n, is_new] = program_.joints.add(s + ")");
    std::string name = "J" + std::to_string(n + 1);
    if (is_new) {
      names_.reserve(name);
      program_.positions.push_back(name + "=" + s + ")");
    }
    return name;
  }
  bool has_externals() const {
    return std::any_of(profile_.axes.begin(), profile_.axes.end(),
                       [](const PostAxis& a) { return a.external; });
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression&) override {
    if (!has_externals()) no_external(&p);
    if (is_joints(p.role)) return Text{joints_name(p)};
    if (!p.has_pose) return std::nullopt;
    return Text{pose_name(p.pose, p.role == RMP_ROLE_ROBTARGET ? &p : nullptr, false)};
  }

  // ---- signals ----
  bool is_hand(const Signal& s) {
    return s.kind.size() == 4 && lower(s.kind) == "hand" && s.type == RMP_TYPE_BOOL;
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (s.type == RMP_TYPE_REAL) {
      cannot("analogue outputs", "Use an INT over several signals.");
      return;
    }
    if (s.type == RMP_TYPE_BOOL) {
      const auto v = known(value);
      const auto bit = [&](bool on) {
        if (is_hand(s))
          return std::string(on != s.inverted ? "HClose " : "HOpen ") + std::to_string(s.number);
        return "M_Out(" + std::to_string(s.number) + ")=" + (on != s.inverted ? "1" : "0");
      };
      if (v) line(bit(*v != 0));
      else line("If " + condition(value) + " Then " + bit(true) + " Else " + bit(false));
      return;
    }
    const std::string n = std::to_string(s.number);
    const auto v = known(value);
    if (v && (*v < 0 || *v >= std::pow(2.0, s.width))) {
      fail("the value " + trimmed(*v, 0) + " does not fit into " + std::to_string(s.width) +
               " signals",
           "Widen the signal or make the value smaller.");
      return;
    }
    if (s.width == 8 || s.width == 16) {
      line(std::string(s.width == 8 ? "M_Outb(" : "M_Outw(") + n + ")=" + text(value));
      return;
    }
    std::string all = v ? "" : within(expr(value), 8);
    for (int k = 0; k < s.width && k < 31; ++k) {
      const std::string bit = "M_Out(" + std::to_string(s.number + k) + ")=";
      if (v) line(bit + (((static_cast<std::int64_t>(*v) >> k) & 1) ? "1" : "0"));
      else if (k == 0) line(bit + all + " Mod 2");
      else line(bit + "(" + all + "\\" + std::to_string(1LL << k) + ") Mod 2");
    }
  }
  Text read(const Signal& s, const char* way) {
    if (s.type == RMP_TYPE_REAL) {
      cannot("analogue signals", "Use an INT over several signals.");
      return {"0"};
    }
    const std::string n = std::to_string(s.number), m = std::string("M_") + way;
    if (s.type == RMP_TYPE_BOOL) {
      if (s.inverted) return {"1-" + m + "(" + n + ")", 6};
      return {m + "(" + n + ")"};
    }
    if (s.width == 8) return {m + "b(" + n + ")"};
    if (s.width == 16) return {m + "w(" + n + ")"};
    if (s.width > 16) {
      cannot("inputs of more than 16 signals", "Read them in parts.");
      return {"0"};
    }
    return {m + (s.width < 8 ? "b(" : "w(") + n + ") And " + std::to_string((1 << s.width) - 1), 3};
  }
  Text input(const Signal& s) override { return read(s, "In"); }
  Text output(const Signal& s) override { return read(s, "Out"); }

  // ---- statements ----
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    if (is_part(r)) {
      line("CallP \"" + routine_name(r) + "\"");
      return;
    }
    const auto& x = routine(r);
    std::vector<std::pair<std::string, std::string>> back, kept;
    // Parameters are variables of the program: a call in a later argument may be of this routine.
    std::size_t last = 0;
    for (std::size_t k = 0; k < arguments.size(); ++k)
      if (has_call(arguments[k])) last = k;
    for (std::uint32_t k = 0; k < x.parameter_count && k < arguments.size(); ++k) {
      const std::uint32_t s = x.first_parameter + k;
      const auto& p = symbol(s);
      if (kind(p.type) == 0) {
        cannot("parameters of type " + type_name(p.type), "Use a variable of the program.");
        return;
      }
      const std::string to = part(s, "", kind(p.type));
      auto where = p.mode == RMP_MODE_IN ? std::nullopt : place(arguments[k]);
      if (p.mode != RMP_MODE_IN && !where) {
        cannot("such place as an OUT parameter", "Use a variable.");
        return;
      }
      // The element that it was before the call gets the value.
      if (where && where->index.find_first_not_of("0123456789") != std::string::npos) {
        const std::string i = names_.unique("MT");
        line(i + "=" + std::exchange(where->index, i));
      }
      if (where && k < last) {
        if (p.mode != RMP_MODE_OUT) kept.emplace_back(to, place_text(*where));
        else if (kind(p.type) == 'M') kept.emplace_back(to, "0");
      } else if (where) {
        if (p.mode != RMP_MODE_OUT) line(to + "=" + place_text(*where));
        else if (kind(p.type) == 'M') line(to + "=0");
      } else if (k < last) {
        kept.emplace_back(to, temporary(kind(p.type)));
        set(kept.back().second, p.type, arguments[k]);
      } else {
        set(to, p.type, arguments[k]);
      }
      if (where) back.emplace_back(place_text(*where), to);
    }
    for (const auto& [to, from] : kept) line(to + "=" + from);
    line("GoSub " + entry(r));
    for (const auto& [to, from] : back) line(to + "=" + from);
  }
  void return_(std::uint32_t value) override {
    if (in_routine_ == 0) {
      line("End");
      return;
    }
    if (value != RMP_NONE) set(result(in_routine_), expression(value).type, value);
    line("Return");
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    std::string all;
    for (const std::uint32_t v : values) {
      const auto& x = expression(v);
      if (x.constant == RMP_NONE) {
        cannot("values in messages", "Write constant texts, or remove the statement.");
        return;
      }
      const auto& k = constant(x.constant);
      all += k.kind == RMP_CONSTANT_TEXT ? std::string(k.text, k.text_size) : text(v);
    }
    line("' " + plain_text(all, '\0'));
    warn("WRITE is written as a comment: MELFA-BASIC shows no messages",
         "Send a signal to a device that shows it.");
  }
  void if_begin(std::uint32_t c) override { line("If " + condition(c) + " Then"); }
  void else_() override { line("Else"); }
  void if_end() override { line("EndIf"); }
  struct Loop {
    std::string again, out, step;
  };
  void start_loop() {
    loops_.push_back({new_label(), new_label(), ""});
    line(loops_.back().again);
  }
  void end_loop() {
    line("GoTo " + loops_.back().again);
    line(loops_.back().out);
    loops_.pop_back();
  }
  void while_begin(std::uint32_t c) override {
    start_loop();
    line("If " + compare(c, false).text + " Then GoTo " + loops_.back().out);
  }
  void while_end() override { end_loop(); }
  void loop_begin() override { start_loop(); }
  void loop_end() override { end_loop(); }
  void repeat_begin() override { start_loop(); }
  void repeat_end(std::uint32_t until) override {
    line("If " + condition(until) + " Then GoTo " + loops_.back().out);
    end_loop();
  }
  void exit_loop() override {
    if (!loops_.empty()) line("GoTo " + loops_.back().out);
  }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    const std::string i = variable(s).text;
    const auto once = [&](std::uint32_t e) {
      if (e == RMP_NONE) return std::string("1");
      if (known(e)) return within(expr(e), 6);
      const std::string t = names_.unique("MT");
      line(t + "=" + text(e));
      return t;
    };
    const std::string end = once(to), by = once(step);
    line(i + "=" + text(from));
    start_loop();
    loops_.back().step = i + "=" + i + (down ? "-" : "+") + by;
    line("If " + i + (down ? "<" : ">") + end + " Then GoTo " + loops_.back().out);
  }
  void for_end(std::uint32_t) override {
    line(loops_.back().step);
    end_loop();
  }
  std::string user_label(std::uint32_t s) {
    const auto [it, is_new] = user_labels_.try_emplace(s);
    if (is_new) it->second = "*" + names_.unique(symbol(s).name);
    return it->second;
  }
  void go_to(std::uint32_t s) override { line("GoTo " + user_label(s)); }
  void label(std::uint32_t s) override { line(user_label(s)); }
  void wait_time(std::uint32_t seconds) override {
    if (const auto v = known(seconds)) {
      if (!(*v >= 0 && *v <= 1e6)) {
        fail("a wait of " + shortest(*v) + " s", "Give a time from 0 to 1000000 s.");
        return;
      }
      const std::string s = fixed(*v, 2);
      if (std::fabs(*v * 100 - std::round(*v * 100)) > 1e-6)
        warn("the wait is rounded to " + s + " s: MELFA-BASIC counts hundredths");
      line("Dly " + s);
      return;
    }
    line("Dly " + text(seconds));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    if (timeout == RMP_NONE) {
      if (const auto t = signal_test(c); t && t->signal.type == RMP_TYPE_BOOL) {
        line(std::string("Wait M_") + (t->signal.is_output ? "Out(" : "In(") +
             std::to_string(t->signal.number) + ")=" + (wanted(*t) ? "1" : "0"));
        return;
      }
      const std::string again = new_label();
      line(again);
      line("If " + compare(c, false).text + " Then GoTo " + again);
      return;
    }
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool told = flag != RMP_NONE && is_used(flag);
    const std::string again = new_label(), out = new_label();
    const Text t = expr(timeout);
    if (told) line(variable(flag).text + "=0");
    line("M_Timer(1)=0");
    line(again);
    line("If " + condition(c) + " Then GoTo " + out);
    line("If M_Timer(1)<" + within(t, 7) + "*1000 Then GoTo " + again);
    if (told) line(variable(flag).text + "=1");
    line(out);
  }
  void pause(std::uint32_t text_of) override {
    if (text_of != RMP_NONE) {
      const std::uint32_t one[] = {text_of};
      message(one, true);
    }
    line("Hlt");
  }
  void halt() override { line("End"); }

  // ---- motions ----
  void forget() override {
    MoveWriter::forget();
    last_name_.clear();
    speed_.forget();
    joint_speed_.forget();
    accel_.forget();
    blend_.forget();
    tool_.forget();
  }
  void set_tool(const Pose& p) {
    const std::string n = pose_name(p, nullptr, false);
    if (tool_.changes(n)) line("Tool " + n);
  }
  std::string value(const Motion& m, std::uint32_t a, const char* name, double least, double most,
                    int digits, double otherwise) {
    if (m[a].known) return fixed(number_of(m, a, name, least, most).value_or(otherwise), digits);
    if (m[a].expression == RMP_NONE) return fixed(otherwise, digits);
    return text(m[a].expression);
  }
  /// A setting, where it is another one; what is computed may have changed since.
  void set(Modal<std::string>& modal, const std::string& v, bool is_known, const std::string& all) {
    if (modal.changes(v)) line(all);
    if (!is_known) modal.forget();
  }
  bool prepare(const Motion& m, bool is_ptp) {
    if (!plain(m)) return false;
    if (has_other_tool_) last_name_.clear();
    if (has_time(m)) {
      cannot("TIME of motions", "Give SPEED or SPEED_PTP.");
      return false;
    }
    if (m[RMP_ATTR_TOOL].given) {
      const auto p = pose_of(m, RMP_ATTR_TOOL, "TOOL");
      if (!p) return false;
      set_tool(*p);
      had_tool_ = true;
    } else if (profile_.tool >= 0 &&
               static_cast<std::size_t>(profile_.tool) < profile_.tools.size()) {
      set_tool(profile_.tools[static_cast<std::size_t>(profile_.tool)].pose);
    } else if (had_tool_) {
      fail("this motion has no TOOL, an earlier one has, and the initial tool is unknown",
           "Give it a TOOL, or set the initial tool in the profile.");
      return false;
    }
    if (is_ptp) {
      const std::string v = value(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", 0.01, 100, 2, 100);
      set(joint_speed_, v, m[RMP_ATTR_SPEED_PTP].known.has_value(), "JOvrd " + v);
    } else {
      const std::string v = value(m, RMP_ATTR_SPEED, "SPEED", 0.01, 10'000, 2, 250);
      set(speed_, v, m[RMP_ATTR_SPEED].known.has_value(), "Spd " + v);
      if (m[RMP_ATTR_SPEED_ORI].given)
        warn("SPEED_ORI is not written: the tool rotates with the path", "Give a lower SPEED.");
    }
    const std::uint32_t acc = is_ptp && !m[RMP_ATTR_ACC].given ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    const std::string a = value(m, acc, "the acceleration", 1, 100, 0, 100);
    set(accel_, a, m[acc].known.has_value(), "Accel " + a + "," + a);
    const std::uint32_t c = is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP;
    std::string blend = "Cnt 0";
    if (m[c].known) {
      double r = number_of(m, c, is_ptp ? "C_PTP" : "C_CP").value_or(0);
      if (is_ptp && r > 0) {
        note("C_PTP of " + trimmed(r, 2) + " % is written as " + trimmed(ptp_radius_ * r / 100, 2) +
                 " mm",
             "The profile's option ptp_radius sets the radius for 100 %.");
        r *= ptp_radius_ / 100;
      }
      if (r > 0) blend = "Cnt 1," + fixed(r, 2) + "," + fixed(r, 2);
      else if (m[RMP_ATTR_C_PASS].known.value_or(0) != 0) {
        blend = "Cnt 1";
        if (m.until == RMP_NONE)
          note(
              "C_PASS without a distance is written as Cnt 1: the controller chooses the distance, "
              "and the simulated robot " +
                  post::at_c_pass_in_a_run(*task_.code, m),
              std::string("Give ") + (is_ptp ? "C_PTP." : "C_CP."));
      }
    } else if (m[c].expression != RMP_NONE) {
      std::string r = text(m[c].expression);
      if (is_ptp) r = within(expr(m[c].expression), 7) + "*" + trimmed(ptp_radius_ / 100, 6, 1);
      blend = "Cnt 1," + r + "," + r;
    }
    if (m.until != RMP_NONE && blend != "Cnt 0") {
      warn("a motion with UNTIL is not blended", "Remove C_CP and C_PTP.");
      blend = "Cnt 0";
    }
    set(blend_, blend, m[c].known.has_value(), blend);
    return true;
  }
  std::string target(const Motion& m, const Target& t) {
    if (!has_externals()) no_external(t.point);
    if (is_joints(t.role)) {
      if (m.incremental) {
        cannot("increments of joints", "Give joints, or an increment of the pose.");
        return {};
      }
      return text(t.expression);
    }
    if (t.role == RMP_ROLE_ADD_JOINT) {
      cannot("motions of additional axes only", "Give a JOINT or a ROBTARGET with all axes.");
      return {};
    }
    if (const auto at = goal(m, t)) {
      if (!usable(*at)) return {};
      return pose_name(*at, m.incremental ? nullptr : t.point, true);
    }
    if (m.incremental) {
      const auto by = step(m, t);
      if (t.role != RMP_ROLE_POSITION && (!by || !same_place({by->R, {}}, Pose{}))) {
        cannot("increments that rotate from an unknown pose", "Begin with a motion to a pose.");
        return {};
      }
      if (!m[RMP_ATTR_FRAME].given) return "P_Curr+" + within(expr(t.expression), 7);
      if (!by) {
        cannot("computed increments in a frame", "Give them in the base's axes.");
        return {};
      }
      return "P_Curr+" + pose_name(*by, nullptr, false);
    }
    if (t.role == RMP_ROLE_POSITION) {
      const std::string p = names_.unique("PT"), v = text(t.expression);
      line(p + "=P_Curr");
      const std::string from = names_.unique("PT");
      line(from + "=" + v);
      for (const char c : {'X', 'Y', 'Z'}) line(p + "." + c + "=" + from + "." + c);
      return p;
    }
    if (m[RMP_ATTR_FRAME].given)
      return within(expr(m[RMP_ATTR_FRAME].expression), 7) + "*" + within(expr(t.expression), 8);
    return text(t.expression);
  }
  std::string skip(const Motion& m) {
    return m.until == RMP_NONE ? "" : " WthIf " + condition(m.until) + ",Skip";
  }
  void skipped(const Motion& m) {
    if (m.until == RMP_NONE || m.action == RMP_NONE) return;
    line("If M_SkipCq=1 Then GoSub " + entry(m.action));
  }
  void ptp(const Motion& m) override { simple(m, true); }
  void lin(const Motion& m) override { simple(m, false); }
  void simple(const Motion& m, bool is_ptp) {
    if (!prepare(m, is_ptp)) return;
    const Target& t = m.targets[0];
    const auto at = goal(m, t);
    std::string to = target(m, t);
    if (to.empty()) return;
    // A pose that is computed has the flags of the position on its left: it gets those of where the
    // robot is, and goes there the short way.
    std::string type;
    if (!at && !m.incremental && t.role == RMP_ROLE_POSE) {
      const std::string p = names_.unique("PT");
      line(p + "=" + to);
      for (const char* flags : {".FL1", ".FL2"}) line(p + flags + "=P_Curr" + flags);
      to = p;
      if (is_ptp) type = " Type 0,0";
    }
    line((is_ptp ? "Mov " : "Mvs ") + to + type + skip(m));
    skipped(m);
    arrived(m.until == RMP_NONE ? at : std::nullopt);
    last_name_ = m.until == RMP_NONE && to.starts_with('P') && !to.starts_with("P_") &&
                         to.find_first_of("+*(") == std::string::npos
                     ? to
                     : "";
  }
  void circle(const Motion& m) override {
    if (!prepare(m, false)) return;
    if (m.incremental) {
      cannot("circles through increments", "Give poses.");
      return;
    }
    std::string from = last_name_;
    if (from.empty()) {
      if (last()) {
        from = pose_name(*last(), nullptr, false);
      } else {
        // Where it stands: the motion before has ended when the line is reached with Cnt 0.
        from = names_.unique("PT");
        line(from + "=P_Curr");
      }
    }
    const std::string via = target(m, m.targets[0]), to = target(m, m.targets[1]);
    if (via.empty() || to.empty()) return;
    const auto at = goal(m, m.targets[1]);
    line("Mvr " + from + "," + via + "," + to + skip(m));
    skipped(m);
    arrived(m.until == RMP_NONE ? at : std::nullopt);
    last_name_ = m.until == RMP_NONE && to.find_first_of("+*(") == std::string::npos ? to : "";
  }

  int step_;
  Program program_, main_;  ///< the one that is written; the program itself while a part is
  std::vector<std::pair<std::uint32_t, Program>> finished_;
  std::map<std::pair<std::uint32_t, std::string>, std::string> parts_;
  std::map<std::uint32_t, std::string> entries_, results_, user_labels_;
  std::vector<Loop> loops_;
  std::string last_name_;
  Modal<std::string> speed_, joint_speed_, accel_, blend_, tool_;
  double ptp_radius_ = 50;
  bool had_tool_ = false, told_status_ = false;
};

PostCapabilities melfa(int version) {
  PostCapabilities c;
  c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
               kPostLocals | kPostIntegers | kPostReals | kPostBooleans | kPostStrings |
               kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostFunctionsOfMath |
               kPostIf | kPostWhile | kPostRepeat | kPostLoop | kPostExit | kPostFor |
               kPostForStep | kPostGoto | kPostReturn | kPostWaitFor | kPostWaitTimeout |
               kPostUntil | kPostVariableTargets | kPostVariableAttributes | kPostPause |
               kPostOutputsAreRead | kPostTools | kPostFrames | kPostParts;
  c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostPtpIncrement |
              kPostLinIncrement;
  c.circle = PostCircle::via;
  c.blending = PostBlending::distance;
  c.external_axes = 2;
  c.max_name = version == 4 ? 8 : 16;
  c.name_case = PostCase::upper;
  c.crlf = true;
  c.max_lines = version == 4 ? 3276 : 32'767;
  c.max_nesting = 16;
  c.reserved =
      "MOV MVS MVR MVR2 MVR3 MVC OVRD SPD JOVRD ACCEL CNT FINE TOOL BASE DLY HOPEN HCLOSE WAIT HLT "
      "END GOTO GOSUB RETURN DEF DIM IF THEN ELSE ENDIF WHILE WEND FOR NEXT SELECT CASE CALLP "
      "FUNCTION FEND PRINT OPEN CLOSE AND OR XOR NOT MOD MIN MAX P_CURR P_FBC M_IN M_OUT M_TIMER";
  c.extensions = "prg";
  c.title = version == 4 ? "MELFA-BASIC IV" : "MELFA-BASIC V";
  return c;
}

}  // namespace

const PostCapabilities& Melfa4::capabilities() const {
  static const PostCapabilities kAll = melfa(4);
  return kAll;
}
Result<void> Melfa4::write(const PostTask& task, const Params&, PostOutput& output,
                           Progress& progress) const {
  return MelfaWriter(task, output, capabilities(), progress, 10).run();
}
const PostCapabilities& Melfa5::capabilities() const {
  static const PostCapabilities kAll = melfa(5);
  return kAll;
}
Result<void> Melfa5::write(const PostTask& task, const Params&, PostOutput& output,
                           Progress& progress) const {
  return MelfaWriter(task, output, capabilities(), progress, 1).run();
}

}  // namespace robomosp::post

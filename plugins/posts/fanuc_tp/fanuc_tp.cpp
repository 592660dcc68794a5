// SPDX-License-Identifier: Apache-2.0
// TP has registers instead of variables: R for numbers, F (flags) for BOOL, PR for poses; AR are a
// program's parameters, numbers only: of a BOOL 0 or 1. A routine is a program of its own.
// Conditions and sums stand in parentheses (mixed logic, R-30iA and later).
#include "fanuc_tp.h"

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_passing.h>

#include "../common/moves.h"

namespace robomosp::post {
namespace {

class TpWriter final : public MoveWriter {
 public:
  using MoveWriter::MoveWriter;

 private:
  struct Program {
    File lines{0};
    std::vector<std::string> positions;
    Points known;
    std::uint32_t labels = 0;
  };
  enum Space : int { numbers = 0, flags = 1, poses = 2 };
  /// Numbers or flags of a variable: the first register, and what is at it.
  struct Slot {
    std::int64_t base = 0;
    std::int64_t stride_register = -1;  ///< register with the rest of the number; -1 = none
    std::uint32_t type = RMP_NONE;
  };

  // ---- the program ----
  void begin() override {
    // Programs are files of a controller whose file system knows these as devices.
    for (const char* device : {"CON", "PRN", "AUX", "NUL", "COM1", "LPT1"}) names_.reserve(device);
    programs_.resize(c_.routines.count);
    next_[0] = static_cast<std::int64_t>(number_option("first_register", 1));
    next_[1] = static_cast<std::int64_t>(number_option("first_flag", 1));
    next_[2] = static_cast<std::int64_t>(number_option("first_position_register", 1));
    cnt_mm_ = number_option("cnt_mm", 100);
    for (const PostAxis& a : profile_.axes) externals_ += a.external ? 1 : 0;
  }
  Program& here() { return programs_[in_routine_]; }
  void routine_begin(std::uint32_t r) override {
    out_ = &programs_[r].lines;
    const auto& x = routine(r);
    if (x.kind == RMP_ROUTINE_FUNCTION)
      cannot("functions", "Write a procedure that assigns a variable of the program.");
    if (x.kind == RMP_ROUTINE_PROCESS) cannot("parallel processes of this kind");
    if (x.kind == RMP_ROUTINE_INTERRUPT) cannot("interrupts");
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const auto& s = symbol(x.first_parameter + k);
      at_ = s.span;
      if (s.mode != RMP_MODE_IN)
        cannot("parameters that are changed (OUT, INOUT)", "Use a variable of the program.");
      if (s.type != RMP_TYPE_INT && s.type != RMP_TYPE_REAL && s.type != RMP_TYPE_BOOL)
        cannot("parameters of type " + type_name(s.type), "Use a variable of the program.");
    }
    if (x.parameter_count > 10) cannot("routines of more than 10 parameters");
    at_ = x.span;
    if (r == 0) {
      if (!profile_.prologue.empty()) raw(profile_.prologue);
      select(start_frame(), start_tool());
    }
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0 && !profile_.epilogue.empty()) raw(profile_.epilogue);
  }
  void raw(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      put(std::string(text.substr(0, end)));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
  }
  void finish() override {
    for (std::uint32_t r = 0; r < c_.routines.count; ++r) {
      if (!is_reached(r)) continue;
      Program& p = programs_[r];
      const rmp_span head = routine(r).span;
      const std::string n = routine_name(r);
      File all(0);
      const auto add = [&](const std::string& s) { all.add(s, &head); };
      add("/PROG  " + n);
      add("/ATTR");
      add("OWNER\t\t= MNEDITOR;");
      add("COMMENT\t\t= \"\";");
      add("PROG_SIZE\t= 0;");
      add("VERSION\t\t= 0;");
      // The second line of a circle is none of its own.
      const auto count =
          std::count_if(p.lines.lines().begin(), p.lines.lines().end(),
                        [](const std::string& s) { return !s.starts_with("    :"); });
      add("LINE_COUNT\t= " + std::to_string(count) + ";");
      add("MEMORY_SIZE\t= 0;");
      add("PROTECT\t\t= READ_WRITE;");
      add("TCD:  STACK_SIZE\t= 0,");
      add("      TASK_PRIORITY\t= 50,");
      add("      TIME_SLICE\t= 0,");
      add("      BUSY_LAMP_OFF\t= 0,");
      add("      ABORT_REQUEST\t= 0,");
      add("      PAUSE_REQUEST\t= 0;");
      add("DEFAULT_GROUP\t= 1,*,*,*,*;");
      add("CONTROL_CODE\t= 00000000 00000000;");
      add("/APPL");
      add("/MN");
      std::size_t n_line = 0;
      for (std::size_t i = 0; i < p.lines.size(); ++i) {
        std::string& s = p.lines.lines()[i];
        if (s.starts_with("    :")) continue;
        std::string number = std::to_string(++n_line);
        s = std::string(number.size() < 4 ? 4 - number.size() : 0, ' ') + number + ":" + s;
      }
      const std::int32_t most = profile_.max_lines > 0 ? profile_.max_lines : caps_.max_lines;
      if (n_line > static_cast<std::size_t>(most)) {
        at_ = head;
        fail(n + " has " + std::to_string(n_line) + " lines, and the controller allows " +
                 std::to_string(most),
             "Split it into procedures, or set the controller's limit in the profile (max_lines).");
      }
      all.append(p.lines);
      all.add("/POS", &head);
      for (const std::string& s : p.positions) all.add_lines(s);
      all.add("/END", &head);
      all.give(output_, n + ".LS", true);
    }
  }
  void put(const std::string& s) { line("  " + s + " ;"); }
  std::string new_label() { return "LBL[" + std::to_string(++here().labels) + "]"; }

  // ---- registers ----
  /// Whether it is made of numbers, BOOLs and positions.
  bool has_slots(std::uint32_t t, int depth = 0) const {
    const auto& x = type(t);
    if (depth > 100) return false;
    if (t == RMP_TYPE_INT || t == RMP_TYPE_REAL || t == RMP_TYPE_BOOL) return true;
    if (x.role == RMP_ROLE_POSITION) return true;
    if (x.kind == RMP_TYPE_ARRAY) return has_slots(x.element, depth + 1);
    if (x.kind != RMP_TYPE_RECORD || x.role != RMP_ROLE_NONE) return false;
    for (std::uint32_t k = 0; k < x.field_count; ++k)
      if (!has_slots(field_row(x.first_field + k).type, depth + 1)) return false;
    return true;
  }
  /// How many numbers or flags it takes.
  std::int64_t slots(std::uint32_t t, Space space) const {
    const auto& x = type(t);
    if (t == RMP_TYPE_BOOL) return space == flags ? 1 : 0;
    if (t == RMP_TYPE_INT || t == RMP_TYPE_REAL) return space == numbers ? 1 : 0;
    if (x.role == RMP_ROLE_POSITION) return space == numbers ? 3 : 0;
    if (x.kind == RMP_TYPE_ARRAY)
      return (std::int64_t{x.upper} - x.lower + 1) * slots(x.element, space);
    std::int64_t all = 0;
    for (std::uint32_t k = 0; k < x.field_count; ++k)
      all += slots(field_row(x.first_field + k).type, space);
    return all;
  }
  bool is_pose(std::uint32_t t) const {
    return role(t) == RMP_ROLE_POSE || role(t) == RMP_ROLE_ROBTARGET;
  }
  std::int64_t take(Space space, std::int64_t count) {
    static constexpr std::array<const char*, 3> kNames{"registers", "flags", "position_registers"};
    static constexpr std::array<double, 3> kMost{200, 1024, 100};
    const auto k = static_cast<std::size_t>(space);
    const std::int64_t first = next_[k];
    const auto most = static_cast<std::int64_t>(number_option(kNames[k], kMost[k]));
    if (count > most || first + count - 1 > most) {
      fail("the program needs more " + std::string(kNames[k]) + " than the " +
               std::to_string(most) + " that the controller has",
           "Make its variables smaller, or set their number in the profile (option " +
               std::string(kNames[k]) + ") how many there are.");
      return first;
    }
    next_[k] += count;
    return first;
  }
  /// A register that counts until the next statement begins.
  std::int64_t temporary() {
    if (temporaries_used_ == temporaries_.size()) temporaries_.push_back(take(numbers, 1));
    return temporaries_[temporaries_used_++];
  }
  void begin_statement() { temporaries_used_ = 0; }
  std::int64_t base_of(std::uint32_t s, Space space) {
    const auto it = bases_.find({s, space});
    if (it != bases_.end()) return it->second;
    const std::int64_t n = space == poses ? 1 : slots(symbol(s).type, space);
    return bases_[{s, space}] = take(space, std::max<std::int64_t>(1, n));
  }
  std::string comment(std::uint32_t s) { return ":" + std::string(symbol(s).name).substr(0, 16); }
  void declare(std::uint32_t s, std::uint32_t r) override {
    const auto& x = symbol(s);
    at_ = x.span;
    if (x.kind == RMP_SYMBOL_ROBOT) return;
    if (x.type == RMP_TYPE_BOOL) {
      put(variable(s).text + "=(" + (x.value == RMP_NONE ? "OFF" : text(x.value)) + ")");
    } else if (is_pose(x.type)) {
      const std::int64_t to = base_of(s, poses);
      if (x.value != RMP_NONE) assign_pose(to, x.value);
    } else if (has_slots(x.type)) {
      std::array<std::int64_t, 2> first{};
      const std::uint32_t errors = errors_;
      for (const Space space : {numbers, flags})
        if (slots(x.type, space) > 0) first[space] = base_of(s, space);
      if (errors_ != errors) return;
      Values all;
      collect(x.type, x.value, all);
      const bool is_one = all[numbers].size() == 1 && all[flags].empty();
      for (const Space space : {numbers, flags})
        for (std::size_t i = 0; i < all[space].size(); ++i)
          put((space == flags ? "F[" : "R[") +
              std::to_string(first[space] + static_cast<std::int64_t>(i)) +
              (is_one ? comment(s) : "") + "]=" + all[space][i]);
    } else {
      cannot("variables of type " + type_name(x.type),
             "Post the flattened program (form = \"flat\").");
    }
    (void)r;
  }
  using Values = std::array<std::vector<std::string>, 2>;  ///< numbers, flags
  void collect(std::uint32_t t, std::uint32_t e, Values& out) {
    if (t == RMP_TYPE_INT || t == RMP_TYPE_REAL) {
      out[numbers].push_back(e == RMP_NONE ? "0" : operand(e));
      return;
    }
    if (t == RMP_TYPE_BOOL) {
      out[flags].push_back("(" + (e == RMP_NONE ? "OFF" : text(e)) + ")");
      return;
    }
    std::span<const std::uint32_t> parts;
    if (e != RMP_NONE) {
      const auto& x = expression(e);
      const PostPoint* p = point(e);
      if (p && p->has_pose && p->role == RMP_ROLE_POSITION) {
        for (const double v : p->pose.p) out[numbers].push_back(length(v * 1000));
        return;
      }
      if (x.op != RMP_EXPR_MAKE) {
        cannot("such value of type " + type_name(t) + " at the start of a variable",
               "Assign its parts in the program.");
        return;
      }
      parts = links(x.first, x.count);
    }
    const auto& x = type(t);
    const std::size_t n = x.kind == RMP_TYPE_ARRAY
                              ? static_cast<std::size_t>(std::int64_t{x.upper} - x.lower + 1)
                              : x.field_count;
    for (std::size_t k = 0; k < n; ++k)
      collect(x.kind == RMP_TYPE_ARRAY
                  ? x.element
                  : field_row(x.first_field + static_cast<std::uint32_t>(k)).type,
              k < parts.size() ? parts[k] : RMP_NONE, out);
  }
  std::optional<Slot> slot(std::uint32_t e, Space space) {
    const auto& x = expression(e);
    const auto o = links(x.first, x.count);
    if (x.op == RMP_EXPR_SYMBOL) {
      const auto& s = symbol(x.symbol);
      if (s.kind == RMP_SYMBOL_PARAMETER || s.kind == RMP_SYMBOL_INPUT ||
          s.kind == RMP_SYMBOL_OUTPUT || !has_slots(s.type))
        return std::nullopt;
      return Slot{base_of(x.symbol, space), -1, x.type};
    }
    if (x.op == RMP_EXPR_FIELD) {
      auto p = slot(o[0], space);
      if (!p) return std::nullopt;
      const auto& of = type(expression(o[0]).type);
      for (std::uint32_t k = 0; k < x.symbol; ++k)
        p->base += slots(field_row(of.first_field + k).type, space);
      p->type = x.type;
      return p;
    }
    if (x.op == RMP_EXPR_INDEX) {
      const auto& of = type(expression(o[0]).type);
      auto p = slot(o[0], space);
      if (!p || of.kind != RMP_TYPE_ARRAY) return std::nullopt;
      const std::int64_t n = slots(of.element, space);
      p->type = x.type;
      if (const auto v = known(o[1])) {
        p->base += (static_cast<std::int64_t>(*v) - of.lower) * n;
        return p;
      }
      p->base -= of.lower * n;
      const std::int64_t t = temporary();
      std::string sum = n == 1 ? text(o[1]) : within(expr(o[1]), 7) + "*" + std::to_string(n);
      if (p->stride_register >= 0) sum += "+R[" + std::to_string(p->stride_register) + "]";
      put("R[" + std::to_string(t) + "]=(" + sum + ")");
      p->stride_register = t;
      return p;
    }
    return std::nullopt;
  }
  std::string slot_text(const Slot& s) {
    if (s.type != RMP_TYPE_INT && s.type != RMP_TYPE_REAL && s.type != RMP_TYPE_BOOL) {
      cannot("whole values of type " + type_name(s.type), "Assign its parts one by one.");
      return "R[1]";
    }
    const std::string kind = s.type == RMP_TYPE_BOOL ? "F[" : "R[";
    if (s.stride_register < 0) return kind + std::to_string(s.base) + "]";
    const std::string t = "R[" + std::to_string(s.stride_register) + "]";
    if (s.base != 0)
      put(t + "=(" + t + (s.base > 0 ? "+" : "-") + std::to_string(s.base > 0 ? s.base : -s.base) +
          ")");
    return kind + t + "]";
  }
  static Space space_of(std::uint32_t t) { return t == RMP_TYPE_BOOL ? flags : numbers; }
  Text variable(std::uint32_t s) override {
    const auto& x = symbol(s);
    if (x.kind == RMP_SYMBOL_PARAMETER) {
      const std::uint32_t k = s - routine(in_routine_).first_parameter + 1;
      const std::string ar = "AR[" + std::to_string(k) + "]";
      return x.type == RMP_TYPE_BOOL ? Text{ar + "=1", 5} : Text{ar};
    }
    if (x.type == RMP_TYPE_BOOL)
      return {"F[" + std::to_string(base_of(s, flags)) + comment(s) + "]"};
    if (is_pose(x.type)) return {"PR[" + std::to_string(base_of(s, poses)) + "]"};
    if (x.type == RMP_TYPE_INT || x.type == RMP_TYPE_REAL)
      return {"R[" + std::to_string(base_of(s, numbers)) + comment(s) + "]"};
    cannot("values of type " + type_name(x.type), "Use numbers, or post the flattened program.");
    return {"R[1]"};
  }
  /// Number of an element of a PR: X Y Z W P R.
  std::optional<std::string> pose_part(std::uint32_t object, std::uint32_t n) {
    if (role(expression(object).type) != RMP_ROLE_POSITION) return std::nullopt;
    std::uint32_t e = object;
    for (int k = 0; k < 3; ++k) {
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_SYMBOL) break;
      if (x.op != RMP_EXPR_FIELD || x.symbol != 0) return std::nullopt;
      e = links(x.first, x.count)[0];
    }
    const auto& x = expression(e);
    if (x.op != RMP_EXPR_SYMBOL || !is_pose(x.type) ||
        symbol(x.symbol).kind == RMP_SYMBOL_PARAMETER)
      return std::nullopt;
    return "PR[" + std::to_string(base_of(x.symbol, poses)) + "," + std::to_string(n + 1) + "]";
  }
  Text field(std::uint32_t object, std::uint32_t n, const rmp_code_expression& e) override {
    if (const auto p = pose_part(object, n)) return {*p};
    if (const auto s = slot(static_cast<std::uint32_t>(&e - &expression(0)), space_of(e.type)))
      return {slot_text(*s)};
    cannot("such part of a value at run time", "Use numbers, or post the flattened program.");
    return {"R[1]"};
  }
  Text index(std::uint32_t, std::uint32_t, const rmp_code_expression& e) override {
    if (const auto s = slot(static_cast<std::uint32_t>(&e - &expression(0)), space_of(e.type)))
      return {slot_text(*s)};
    cannot("such element at run time", "Use an ARRAY of numbers, or post the flattened program.");
    return {"R[1]"};
  }
  void assign_pose(std::int64_t to, std::uint32_t value) {
    const PostPoint* p = point(value);
    const std::string pr = "PR[" + std::to_string(to);
    if (p && p->has_pose && usable(p->pose)) {
      const Placed at = placed(framed(p->pose, start_frame_pose()), Orientation::fixed_xyz);
      // What was there may be joints, whose elements are other ones: first a Cartesian position,
      // the present one, whose configuration stays.
      put(pr + "]=LPOS");
      for (std::size_t i = 0; i < 6; ++i)
        put(pr + "," + std::to_string(i + 1) +
            "]=" + signed_number(i < 3 ? length(at.mm[i]) : angle(at.ori[i - 3])));
      return;
    }
    const auto& x = expression(value);
    if (x.op == RMP_EXPR_SYMBOL && is_pose(x.type) &&
        symbol(x.symbol).kind == RMP_SYMBOL_VARIABLE) {
      put(pr + "]=PR[" + std::to_string(base_of(x.symbol, poses)) + "]");
      return;
    }
    cannot("poses computed at run time",
           "Assign X, Y and Z of a pose, or post the flattened program (form = \"flat\").");
  }
  static std::string signed_number(const std::string& s) {
    return s.starts_with('-') ? "(" + s + ")" : s;
  }
  void assign(std::uint32_t to, std::uint32_t value) override {
    begin_statement();
    const auto& x = expression(to);
    if (x.op == RMP_EXPR_SYMBOL && is_pose(x.type)) {
      assign_pose(base_of(x.symbol, poses), value);
      return;
    }
    if (x.type == RMP_TYPE_BOOL) {
      const std::string v = text(value);
      put(text(to) + "=(" + v + ")");
      return;
    }
    const std::string v = operand(value);
    put(text(to) + "=" + v);
  }
  /// The right side of an assignment.
  std::string operand(std::uint32_t e) {
    const Text t = expr(e);
    if (t.text.starts_with('-')) return "(" + t.text + ")";
    return t.binding < 100 ? "(" + t.text + ")" : t.text;
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {
        {RMP_EXPR_NOT, "!", 8, Operator::prefix},
        // There is a sign of numbers only.
        {RMP_EXPR_NEGATE, "0-", 6, Operator::prefix_group},
        {RMP_EXPR_ADD, "+", 6},
        {RMP_EXPR_SUBTRACT, "-", 6},
        {RMP_EXPR_MULTIPLY, "*", 7},
        {RMP_EXPR_DIVIDE, "/", 7},
        {RMP_EXPR_DIV, " DIV ", 7},
        {RMP_EXPR_MOD, " MOD ", 7},
        {RMP_EXPR_EQUAL, "=", 5},
        {RMP_EXPR_NOT_EQUAL, "<>", 5},
        {RMP_EXPR_LESS, "<", 5},
        {RMP_EXPR_LESS_EQUAL, "<=", 5},
        {RMP_EXPR_GREATER, ">", 5},
        {RMP_EXPR_GREATER_EQUAL, ">=", 5},
        {RMP_EXPR_AND, " AND ", 3},
        {RMP_EXPR_OR, " OR ", 1},
        // Comparisons stand in parentheses within it.
        {RMP_EXPR_EXOR, "<>", 6, Operator::infix, 5},
    };
    return kAll;
  }
  const Operator* operation(const rmp_code_expression& e) override {
    for (const std::uint32_t o : links(e.first, e.count)) {
      const auto t = expression(o).type;
      if (t != RMP_TYPE_INT && t != RMP_TYPE_REAL && t != RMP_TYPE_BOOL) return nullptr;
      if ((e.op == RMP_EXPR_AND || e.op == RMP_EXPR_OR) && &o != &links(e.first, e.count)[0] &&
          expression(o).op == RMP_EXPR_INDEX)
        warn("both sides of AND and OR are evaluated: TP computes elements before the line");
    }
    return Writer::operation(e);
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL) return {k.integer ? "ON" : "OFF"};
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_INT)
      return {std::to_string(k.integer), k.integer < 0 ? 0 : 100};
    if (k.kind == RMP_CONSTANT_REAL) {
      if (!(std::fabs(k.real) < 1e7)) {
        fail("the number " + shortest(k.real) + " does not fit a register",
             "Registers have about 7 digits.");
        return {"0"};
      }
      const std::string s = trimmed(k.real, 6);
      return {s, s[0] == '-' ? 0 : 100};
    }
    return Writer::literal(k);
  }
  Text intrinsic(std::string_view f, std::span<const std::uint32_t> a,
                 const rmp_code_expression& e) override {
    if (f == "FLOAT") return expr(a[0]);
    if (f == "ABS" && !is_asked_again_) {
      const std::string v = operand(a[0]);
      const std::string reg = "R[" + std::to_string(temporary()) + "]";
      put(reg + "=" + v);
      put("IF (" + reg + "<0) THEN");
      put(reg + "=(0-" + reg + ")");
      put("ENDIF");
      return {reg};
    }
    return Writer::intrinsic(f, a, e);
  }

  // ---- signals ----
  std::string place(const Signal& s) {
    std::string kind = upper(s.kind);
    if (kind.empty())
      kind = s.type == RMP_TYPE_REAL ? "A" : s.type == RMP_TYPE_BOOL || s.width >= 1 ? "D" : "G";
    if (kind.size() == 1) kind += s.is_output ? "O" : "I";
    if (s.number < 1)
      fail("signals of the controller are numbered from 1",
           "Give the profile a number for this signal.");
    return kind + "[" + std::to_string(s.number) + "]";
  }
  bool is_group(const Signal& s) { return !s.kind.empty() && (s.kind[0] | 32) == 'g'; }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (s.type == RMP_TYPE_BOOL) {
      const auto v = known(value);
      if (v) put(place(s) + "=" + ((*v != 0) != s.inverted ? "ON" : "OFF"));
      else put(place(s) + "=(" + (s.inverted ? "!(" + text(value) + ")" : text(value)) + ")");
      return;
    }
    if (s.type == RMP_TYPE_REAL || is_group(s)) {
      put(place(s) + "=" + operand(value));
      return;
    }
    const auto v = known(value);
    if (!v) {
      cannot("INT on single outputs at run time",
             "Make a group of them, and give the profile its number with kind G.");
      return;
    }
    if (*v < 0 || *v >= std::pow(2.0, s.width)) {
      fail("the value " + trimmed(*v, 0) + " does not fit into " + std::to_string(s.width) +
               " signals",
           "Widen the signal or make the value smaller.");
      return;
    }
    Signal one = s;
    for (int k = 0; k < s.width; ++k, ++one.number)
      put(place(one) + "=" + (((static_cast<std::int64_t>(*v) >> k) & 1) ? "ON" : "OFF"));
  }
  Text read(const Signal& s) {
    if (s.type == RMP_TYPE_INT && !is_group(s)) {
      cannot("INT of single signals",
             "Make a group of them, and give the profile its number with kind G.");
      return {"R[1]"};
    }
    if (s.inverted && s.type == RMP_TYPE_BOOL) return {"!" + place(s), 8};
    return {place(s)};
  }
  Text input(const Signal& s) override { return read(s); }
  Text output(const Signal& s) override { return read(s); }
  /// A condition without parentheses where it is one signal, else with them.
  std::string condition(std::uint32_t e) {
    if (const auto t = signal_test(e); t && t->signal.type == RMP_TYPE_BOOL)
      return place(t->signal) + "=" + (wanted(*t) ? "ON" : "OFF");
    return "(" + text(e) + ")";
  }

  // ---- statements ----
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    begin_statement();
    std::string all;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      if (expression(arguments[i]).type == RMP_TYPE_BOOL) {
        all += (i ? "," : "") + zero_or_one(arguments[i]);
        continue;
      }
      all += (i ? "," : "") + in_register(expr(arguments[i]));
    }
    put("CALL " + routine_name(r) + (all.empty() ? "" : "(" + all + ")"));
  }
  /// Arguments and times are constants and registers; sums go through a register.
  std::string in_register(const Text& t) {
    if (t.binding == 100) return t.text;
    const std::string reg = "R[" + std::to_string(temporary()) + "]";
    put(reg + "=(" + t.text + ")");
    return reg;
  }
  /// A BOOL as a number.
  std::string zero_or_one(std::uint32_t e) {
    if (const auto v = known(e)) return *v != 0 ? "1" : "0";
    const std::string reg = "R[" + std::to_string(temporary()) + "]";
    put("IF (" + text(e) + ") THEN");
    put(reg + "=1");
    put("ELSE");
    put(reg + "=0");
    put("ENDIF");
    return reg;
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    std::string all;
    for (const std::uint32_t v : values) {
      const auto& x = expression(v);
      if (x.constant == RMP_NONE) {
        cannot("values in messages", "Write constant texts only.");
        return;
      }
      const auto& k = constant(x.constant);
      all += k.kind == RMP_CONSTANT_TEXT ? std::string(k.text, k.text_size) : trimmed(*known(v), 6);
    }
    all = plain_text(all, ']');
    if (all.size() > 24) {
      warn("the message is cut to the 24 characters of TP: \"" + all.substr(0, 24) + "\"",
           "Write a shorter text.");
      all.resize(24);
    }
    put("MESSAGE[" + all + "]");
  }
  void if_begin(std::uint32_t c) override {
    begin_statement();
    put("IF (" + text(c) + ") THEN");
  }
  void else_() override { put("ELSE"); }
  void if_end() override { put("ENDIF"); }
  struct Loop {
    std::string again, out, step;
  };
  void start_loop() {
    loops_.push_back({new_label(), new_label(), ""});
    put(loops_.back().again);
  }
  void end_loop() {
    put("JMP " + loops_.back().again);
    put(loops_.back().out);
    loops_.pop_back();
  }
  void while_begin(std::uint32_t c) override {
    start_loop();
    put("IF (!(" + text(c) + ")),JMP " + loops_.back().out);
  }
  void while_end() override { end_loop(); }
  void loop_begin() override { start_loop(); }
  void loop_end() override { end_loop(); }
  void repeat_begin() override { start_loop(); }
  void repeat_end(std::uint32_t until) override {
    put("IF (" + text(until) + "),JMP " + loops_.back().out);
    end_loop();
  }
  void exit_loop() override {
    if (!loops_.empty()) put("JMP " + loops_.back().out);
  }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    const std::string i = variable(s).text;
    const auto once = [&](std::uint32_t e) {
      if (e == RMP_NONE) return std::string("1");
      if (known(e)) return signed_number(text(e));
      const std::string reg = "R[" + std::to_string(take(numbers, 1)) + "]";
      put(reg + "=" + operand(e));
      return reg;
    };
    const std::string end = once(to), by = once(step);
    put(i + "=" + operand(from));
    start_loop();
    loops_.back().step = i + "=" + i + (down ? "-" : "+") + by;
    put("IF (" + i + (down ? "<" : ">") + end + "),JMP " + loops_.back().out);
  }
  void for_end(std::uint32_t) override {
    put(loops_.back().step);
    end_loop();
  }
  std::string user_label(std::uint32_t s) {
    const auto [it, is_new] = user_labels_.try_emplace(s);
    if (is_new) it->second = new_label();
    return it->second;
  }
  void go_to(std::uint32_t s) override { put("JMP " + user_label(s)); }
  void label(std::uint32_t s) override { put(user_label(s)); }
  void return_(std::uint32_t value) override {
    if (value != RMP_NONE) return;  // a function, which was refused
    put("END");
  }
  void wait_time(std::uint32_t seconds) override {
    const auto v = known(seconds);
    if (!v) {
      put("WAIT " + in_register(expr(seconds)));
      return;
    }
    if (!(*v >= 0 && *v <= 655)) {
      fail("a wait of " + shortest(*v) + " s", "TP waits from 0 to 655 s.");
      return;
    }
    std::string s = fixed(*v, 2);
    if (std::fabs(*v - std::round(*v * 100) / 100) > 1e-9)
      warn("the wait is rounded to " + s + " s: TP counts hundredths");
    put("WAIT " + s + "(sec)");
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    is_asked_again_ = true;
    const std::string asked = condition(c);
    is_asked_again_ = false;
    if (timeout == RMP_NONE) {
      put("WAIT " + asked);
      return;
    }
    const auto v = known(timeout);
    if (!v || !(*v >= 0 && *v <= 327)) {
      cannot(v ? "TIMEOUT of " + shortest(*v) + " s" : "a computed TIMEOUT",
             "Give a constant from 0 to 327 s.");
      return;
    }
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool told = flag != RMP_NONE && is_used(flag);
    if (told) put(variable(flag).text + "=(OFF)");
    put("$WAITTMOUT=" + fixed(*v * 100, 0));
    const std::string late = new_label();
    put("WAIT " + asked + " TIMEOUT," + late);
    if (told) {
      const std::string on = new_label();
      put("JMP " + on);
      put(late);
      put(variable(flag).text + "=(ON)");
      put(on);
    } else {
      put(late);
    }
  }
  void pause(std::uint32_t text_of) override {
    if (text_of != RMP_NONE) {
      const std::uint32_t one[] = {text_of};
      message(one, true);
    }
    put("PAUSE");
  }
  void halt() override { put("ABORT"); }

  // ---- motions ----
  std::int32_t start_frame() {
    if (profile_.frame < 0) return 0;
    return profile_.frames[static_cast<std::size_t>(profile_.frame)].number;
  }
  std::int32_t start_tool() {
    if (profile_.tool < 0) return 1;
    return profile_.tools[static_cast<std::size_t>(profile_.tool)].number;
  }
  Pose start_frame_pose() {
    if (profile_.frame < 0) return {};
    return profile_.frames[static_cast<std::size_t>(profile_.frame)].pose;
  }
  static Pose framed(const Pose& p, const Pose& frame) { return product(inverse(frame), p); }
  void select(std::int32_t frame, std::int32_t tool) {
    if (frame_.changes(frame)) put("UFRAME_NUM=" + std::to_string(frame));
    if (tool_.changes(tool)) put("UTOOL_NUM=" + std::to_string(tool));
  }
  void forget() override {
    MoveWriter::forget();
    frame_.forget();
    tool_.forget();
  }
  std::string config(const PostPoint* p) {
    if (!p || (p->q.empty() && !p->has_status)) {
      warn("the configuration of this target is unknown and is written as N U T, 0, 0, 0",
           "Name the robot: program.post{robot = ...}, or give a ROBTARGET.");
      return "N U T, 0, 0, 0";
    }
    std::string out;
    out += (p->status & kPostWristFlipped) ? "F " : "N ";
    out += (p->status & kPostElbowOther) ? "D " : "U ";
    out += (p->status & kPostShoulderBehind) ? "B" : "T";
    // Turns of axes 1, 4 and 6.
    if (!p->q.empty()) (void)checked_axes(*p);
    for (const std::size_t i : {0U, 3U, 5U}) out += ", " + std::to_string(turn(*p, i));
    for (const std::size_t i : {1U, 2U, 4U})
      if (turn(*p, i) != 0)
        warn("the turn of axis " + std::to_string(i + 1) +
                 " is not written: CONFIG has those of axes 1, 4 and 6",
             "Move to joints (MAIN_JOINT) where it matters.");
    return out;
  }
  int turn(const PostPoint& p, std::size_t axis) {
    const auto t = axis_turn(p, axis);
    if (!t && !p.turns.empty())
      warn(
          "TURNS of this target are written as 0, since those of the controller's axes are unknown",
          "Name the robot: program.post{robot = ...}.");
    return t.value_or(0);
  }
  std::string padded(double v, int digits) {
    std::string s = number(v, digits);
    return std::string(s.size() < 9 ? 9 - s.size() : 0, ' ') + s;
  }
  std::string externals(const PostPoint* p) {
    if (externals_ == 0) {
      no_external(p);
      return {};
    }
    std::string out;
    int k = 0;
    if (!p) return out;
    const auto values = external_axes(*p);
    for (const PostAxis& a : profile_.axes) {
      if (!a.external) continue;
      out += std::string(k % 3 == 0 ? ",\n" : ",") + "\tE" + std::to_string(k + 1) + "=" +
             padded(values[static_cast<std::size_t>(k)], 3) + (a.linear ? "  mm" : " deg");
      ++k;
    }
    return out;
  }
  std::string position(const std::string& data) {
    Program& p = here();
    const auto [n, is_new] = p.known.add(data);
    const std::string name = "P[" + std::to_string(n + 1) + "]";
    if (is_new) p.positions.push_back(name + "{\n   GP1:\n" + data + "\n};\n");
    return name;
  }
  std::string frame_text() const {
    return "\tUF : " + std::to_string(used_frame_) + ", UT : " + std::to_string(used_tool_) + ",";
  }
  std::string pose_position(const Pose& p, const PostPoint* of) {
    const Placed at = placed(p, Orientation::fixed_xyz);
    return position(frame_text() + "\t\tCONFIG : '" + config(of) +
                    "',\n\tX =" + padded(at.mm[0], 3) + "  mm,\tY =" + padded(at.mm[1], 3) +
                    "  mm,\tZ =" + padded(at.mm[2], 3) + "  mm,\n\tW =" + padded(at.ori[0], 3) +
                    " deg,\tP =" + padded(at.ori[1], 3) + " deg,\tR =" + padded(at.ori[2], 3) +
                    " deg" + externals(of));
  }
  std::string joint_position(const PostPoint& p) {
    const auto q = checked_axes(p);
    if (RMP_HAS(&task_, axes_are_unknown) && task_.axes_are_unknown != 0 &&
        !std::exchange(told_j3_, true))
      note(
          "J3 is written as the angle of the robot's third joint, but this controller measures it "
          "from the horizontal",
          "Give the robot its maker's axes (robot.set_axes).");
    std::vector<bool> slides;
    for (const PostAxis& a : profile_.axes)
      if (!a.external) slides.push_back(axis_scale(a, task_.robot) == 1000.0);
    std::string out = frame_text() + "\t";
    for (std::size_t i = 0; i < q.size(); ++i) {
      const bool is_mm = slides.empty() ? joint_slides(task_.robot, i) : slides[i];
      out += (i % 3 == 0 ? "\n\tJ" : "\tJ") + std::to_string(i + 1) + "=" + padded(q[i], 3) +
             (is_mm ? "  mm" : " deg") + (i + 1 < q.size() ? "," : "");
    }
    return position(out + externals(&p));
  }
  /// P[..] or PR[..] of a target; empty = said.
  std::string target(const Motion& m, const Target& t) {
    if (is_joints(t.role)) {
      if (m.incremental) {
        cannot("increments of joints", "Give joints, or an increment of the pose.");
        return {};
      }
      if (!t.point) {
        cannot("joint values computed at run time", "Post the flattened program.");
        return {};
      }
      return joint_position(*t.point);
    }
    const auto& x = expression(t.expression);
    if (!t.point && is_pose(x.type) && x.op == RMP_EXPR_SYMBOL && !m.incremental &&
        !m[RMP_ATTR_FRAME].given)
      return "PR[" + std::to_string(base_of(x.symbol, poses)) + "]";
    const auto at = certain_goal(m, t);
    if (!at) return {};
    const Pose written = framed(*at, used_frame_pose_);
    return pose_position(written, m.incremental || t.role == RMP_ROLE_POSITION ? nullptr : t.point);
  }
  std::string tail(const Motion& m, bool is_ptp) {
    double cnt = 0;
    const std::uint32_t a = is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP;
    if (m[a].known) {
      const double v = number_of(m, a, is_ptp ? "C_PTP" : "C_CP").value_or(0);
      cnt = is_ptp ? v : 100 * v / cnt_mm_;
      if (!is_ptp && v > 0) {
        cnt = std::clamp(std::round(cnt), 1.0, 100.0);
        note("C_CP of " + trimmed(v, 2) + " mm is written as CNT" + fixed(cnt, 0),
             "The profile's option cnt_mm sets the distance in mm for CNT100.");
      }
    } else if (m[a].expression != RMP_NONE) {
      cannot("computed C_CP and C_PTP", "Give constants.");
    }
    if (m[RMP_ATTR_C_PASS].known.value_or(0) != 0 && cnt == 0) {
      cnt = 100;
      if (m.until == RMP_NONE)
        note("C_PASS without a distance is written as CNT100, and the simulated robot " +
                 post::at_c_pass_in_a_run(*task_.code, m),
             std::string("Give ") + (is_ptp ? "C_PTP." : "C_CP."));
    }
    cnt = std::clamp(std::round(cnt), 0.0, 100.0);
    if (m.until != RMP_NONE && cnt > 0) {
      warn("a motion with UNTIL is not blended", "Remove C_CP and C_PTP.");
      cnt = 0;
    }
    std::string out = cnt > 0 ? " CNT" + fixed(cnt, 0) : " FINE";
    const std::uint32_t acc = is_ptp && !m[RMP_ATTR_ACC].given ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    if (!m[acc].known && m[acc].expression != RMP_NONE)
      cannot("computed accelerations", "Give a constant.");
    const double v = number_of(m, acc, "the acceleration", 0, 150).value_or(100);
    if (v != 100) out += " ACC" + fixed(v, 0);
    return out;
  }
  std::string speed(const Motion& m, bool is_ptp, const std::optional<Pose>& at) {
    if (has_time(m)) {
      const auto t = time_of(m);
      if (!t) {
        if (!m[RMP_ATTR_TIME].known) cannot("a computed TIME", "Give a constant.");
        return " 100%";
      }
      std::string s = fixed(*t, 1);
      if (std::fabs(*t * 10 - std::round(*t * 10)) > 1e-9 || s == "0.0") {
        if (s == "0.0") s = "0.1";
        warn("TIME is rounded to " + s + " s: TP counts tenths");
      }
      return " " + s + "sec";
    }
    const bool turns_only = !is_ptp && at && last() &&
                            std::hypot(at->p[0] - last()->p[0], at->p[1] - last()->p[1],
                                       at->p[2] - last()->p[2]) < 1e-6 &&
                            !same_place(*at, *last());
    const std::uint32_t a = is_ptp       ? RMP_ATTR_SPEED_PTP
                            : turns_only ? RMP_ATTR_SPEED_ORI
                                         : RMP_ATTR_SPEED;
    const char* unit = is_ptp ? "%" : turns_only ? "deg/sec" : "mm/sec";
    if (!is_ptp && !turns_only && m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: the tool rotates with the path",
           "Give TIME, or a lower SPEED.");
    if (!m[a].known) {
      if (m[a].expression == RMP_NONE) return is_ptp ? " 100%" : " 250mm/sec";
      const Text t = expr(m[a].expression);
      std::string reg = t.text;
      if (!reg.starts_with("R[") || t.binding < 100) {
        reg = "R[" + std::to_string(take(numbers, 1)) + "]";  // motions are read ahead
        put(reg + "=(" + t.text + ")");
      }
      return " " + reg + unit;
    }
    const double most = is_ptp ? 100 : 2000;
    const double v = number_of(m, a, is_ptp ? "SPEED_PTP" : "SPEED", 0, 1e9).value_or(1);
    const double whole = std::clamp(std::round(v), 1.0, most);
    if (std::fabs(whole - v) > 1e-9)
      warn("a speed of " + trimmed(v, 4) + unit + " is written as " + fixed(whole, 0) + unit,
           "TP takes whole numbers from 1 to " + fixed(most, 0) + ".");
    return " " + fixed(whole, 0) + unit;
  }
  /// Frame and tool of the motion; false = said.
  bool places(const Motion& m) {
    used_frame_ = start_frame();
    used_frame_pose_ = start_frame_pose();
    used_tool_ = start_tool();
    if (m[RMP_ATTR_FRAME].given) {
      const auto p = pose_of(m, RMP_ATTR_FRAME, "FRAME");
      if (!p) return false;
      // Poses are written in the frame in use: one that the controller has not is no matter.
      for (const PostPlace& f : profile_.frames)
        if (f.number >= 0 && same_place(f.pose, *p)) {
          used_frame_ = f.number;
          used_frame_pose_ = f.pose;
        }
    }
    if (m[RMP_ATTR_TOOL].given) {
      const auto p = pose_of(m, RMP_ATTR_TOOL, "TOOL");
      if (!p) return false;
      // UTOOL 0 is the flange on every controller.
      const bool is_listed =
          std::any_of(profile_.tools.begin(), profile_.tools.end(),
                      [&](const PostPlace& t) { return same_place(t.pose, *p); });
      const auto n = same_place(*p, Pose{}) && !is_listed
                         ? std::optional<std::int32_t>(0)
                         : place_number(profile_.tools, *p, "tool");
      if (!n) return false;
      used_tool_ = *n;
    }
    if (used_frame_ < 0 || used_tool_ < 0) {
      fail("the profile's tool or frame at the start has no number", "Give it its number.");
      return false;
    }
    select(used_frame_, used_tool_);
    return true;
  }
  /// Text behind a motion that a condition ends, and its label; the SKIP CONDITION is written.
  std::string skip(const Motion& m) {
    if (m.until == RMP_NONE) return {};
    const auto t = signal_test(m.until);
    if (!t || t->signal.type != RMP_TYPE_BOOL) {
      cannot("UNTIL with conditions other than one BOOL signal",
             "Use one signal for the condition.");
      return {};
    }
    put("SKIP CONDITION " + condition(m.until));
    skip_ = new_label();
    return " Skip," + skip_;
  }
  void skipped(const Motion& m, const std::string& text) {
    if (text.empty()) return;
    // The motion goes to the label where the condition did not end it.
    if (m.action != RMP_NONE) put("CALL " + routine_name(m.action));
    put(skip_);
  }
  void ptp(const Motion& m) override { simple(m, true); }
  void lin(const Motion& m) override { simple(m, false); }
  void simple(const Motion& m, bool is_ptp) {
    if (!plain(m) || !places(m)) return;
    const std::string to = target(m, m.targets[0]);
    if (to.empty()) return;
    const auto at = goal(m, m.targets[0]);
    const std::string v = speed(m, is_ptp, at);
    const std::string end = skip(m);
    line((is_ptp ? "J " : "L ") + to + v + tail(m, is_ptp) + end + " ;");
    skipped(m, end);
    arrived(m.until == RMP_NONE ? at : std::nullopt);
  }
  void circle(const Motion& m) override {
    if (!plain(m) || !places(m)) return;
    if (m.incremental || m.targets.size() != 2) {
      cannot("circles through increments", "Give poses.");
      return;
    }
    const std::string via = target(m, m.targets[0]), to = target(m, m.targets[1]);
    if (via.empty() || to.empty()) return;
    const auto at = goal(m, m.targets[1]);
    const std::string v = speed(m, false, at), end = skip(m);
    line("C " + via);
    line("    :  " + to + v + tail(m, false) + end + " ;");
    skipped(m, end);
    arrived(m.until == RMP_NONE ? at : std::nullopt);
  }

  std::deque<Program> programs_;
  std::array<std::int64_t, 3> next_{1, 1, 1};
  std::vector<std::int64_t> temporaries_;
  std::size_t temporaries_used_ = 0;
  std::map<std::pair<std::uint32_t, Space>, std::int64_t> bases_;
  std::map<std::uint32_t, std::string> user_labels_;
  std::vector<Loop> loops_;
  Modal<std::int32_t> frame_, tool_;
  std::int32_t used_frame_ = 0, used_tool_ = 1;
  Pose used_frame_pose_;
  std::string skip_;
  bool is_asked_again_ = false;  ///< a condition that is looked at until it is true
  double cnt_mm_ = 100;
  int externals_ = 0;
  bool told_j3_ = false;
};

}  // namespace

const PostCapabilities& FanucTp::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostParameters | kPostLocals | kPostIntegers | kPostReals |
                 kPostParts | kPostBooleans | kPostArrays | kPostRecords | kPostPoses | kPostIf |
                 kPostWhile | kPostRepeat | kPostLoop | kPostExit | kPostFor | kPostForStep |
                 kPostGoto | kPostReturn | kPostWaitFor | kPostWaitTimeout | kPostUntil |
                 kPostVariableTargets | kPostVariableAttributes | kPostMessages | kPostPause |
                 kPostOutputsAreRead | kPostTools | kPostFrames | kPostTime;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle;
    c.circle = PostCircle::via;
    c.blending = PostBlending::percent;
    c.external_axes = 3;
    c.max_name = 36;
    c.name_case = PostCase::upper;
    c.crlf = true;
    c.max_lines = 9999;
    c.max_nesting = 10;
    c.extensions = "ls";
    c.title = "FANUC TP";
    return c;
  }();
  return kAll;
}

Result<void> FanucTp::write(const PostTask& task, const Params&, PostOutput& output,
                            Progress& progress) const {
  TpWriter writer(task, output, capabilities(), progress);
  return writer.run();
}

}  // namespace robomosp::post

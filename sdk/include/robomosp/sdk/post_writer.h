// SPDX-License-Identifier: Apache-2.0
// Help for posts: Writer walks through the structured program and asks for the text of each
// construct. Files, numbers, names and orientations are in separate headers (layer: contract
// helper, inline only, not part of the ABI).
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_lines.h>
#include <robomosp/sdk/post_names.h>
#include <robomosp/sdk/post_numbers.h>
#include <robomosp/sdk/post_orientations.h>
#include <robomosp/sdk/program_tables.h>
#include <robomosp/sdk/program_turns.h>

namespace robomosp::post {

// ---- the walk ----

/// Text of an expression, and how strongly its outermost operation binds.
struct Text {
  std::string text;
  int binding = 100;  ///< 100 = a name, a call, a number
};
/// An operation of the target's expressions. Larger numbers bind stronger.
struct Operator {
  enum Form {
    infix,
    prefix,
    call,          ///< SPELLING(a, b)
    prefix_group,  ///< SPELLING(a), which binds as said
  };
  std::uint32_t op = 0;       ///< rmp_expression_op
  const char* spelling = "";  ///< " + ", "NOT "; of a call its name
  int binding = 0;
  Form form = infix;
  int outer = 0;  ///< infix: how strongly the whole binds, where that is not `binding`
};

struct Attribute {
  bool given = false;                   ///< at the motion itself
  std::uint32_t expression = RMP_NONE;  ///< none = neither given nor a system variable
  std::optional<double> known;
};
struct Target {
  std::uint32_t expression = RMP_NONE;
  std::uint32_t role = RMP_ROLE_NONE;
  const PostPoint* point = nullptr;  ///< nullptr = known when it runs only
};
/// A motion with all that it needs: one target (PTP, LIN), two (CIRCLE) or more (PATH).
struct Motion {
  std::uint32_t row = RMP_NONE;
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool incremental = false;
  std::vector<Target> targets;
  std::array<Attribute, RMP_ATTR_FRAME + 1> attributes{};
  std::uint32_t until = RMP_NONE, action = RMP_NONE;
  rmp_span span{};
  [[nodiscard]] const Attribute& operator[](std::uint32_t a) const { return attributes[a]; }
};
/// A signal of the program, as the controller has it.
struct Signal {
  std::string name;    ///< in the program
  std::string target;  ///< name there; "" = by number
  std::int64_t number = 0;
  std::int32_t width = 1;
  std::string kind;
  bool is_output = false, inverted = false;
  std::uint32_t type = RMP_TYPE_BOOL;
};

/// Walks through a program. Override what the target has: a construct without an overridden hook
/// is an error at its line. Hooks write lines with line(); `at_` is the place of the present
/// construct. The order: begin(), each routine (the program itself first, or last), finish().
class Writer {
 public:
  Writer(const PostTask& task, PostOutput& output, const PostCapabilities& capabilities,
         Progress& progress)
      : task_(task),
        c_(*task.code),
        profile_(*task.profile),
        caps_(capabilities),
        names_(capabilities),
        output_(output),
        progress_(progress) {
    by_expression_.assign(c_.expressions.count, nullptr);
    for (const PostPoint& p : task.points)
      if (p.expression < by_expression_.size()) by_expression_[p.expression] = &p;
  }
  virtual ~Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  Result<void> run() {
    collect();
    if (c_.routines.count > 0) at_ = routine(0).span;
    begin();
    std::vector<std::uint32_t> order;
    for (std::uint32_t r = 1; r < c_.routines.count; ++r)
      if (reached_[r]) order.push_back(r);
    order.insert(program_is_last() ? order.end() : order.begin(), 0U);
    std::vector<std::vector<std::uint32_t>> locals(c_.routines.count);
    for (std::uint32_t s = 0; s < c_.symbols.count; ++s) {
      const std::uint32_t r = symbol(s).routine == RMP_NONE ? 0 : symbol(s).routine;
      if (r < locals.size() && is_local_of(s, r)) locals[r].push_back(s);
    }
    for (const std::uint32_t r : order) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "posting was cancelled");
      progress_.report(static_cast<double>(r) / std::max(1U, c_.routines.count), "writing");
      in_routine_ = r;
      at_ = routine(r).span;
      forget();
      routine_begin(r);
      for (const std::uint32_t s : locals[r])
        if (used_[s]) declare(s, r);
      routine_code(r);
      block(routine(r).body, 0);
      at_ = end_of(routine(r).span);
      routine_end(r);
    }
    at_ = c_.routines.count > 0 ? routine(0).span : rmp_span{};
    finish();
    if (progress_.cancelled()) return error(ErrorCode::cancelled, "posting was cancelled");
    return {};
  }

 protected:
  // ---- hooks: the program ----
  virtual bool program_is_last() const { return false; }
  virtual void begin() {}
  virtual void routine_begin(std::uint32_t /*routine*/) = 0;
  /// A variable of a routine that is used in it; those of the program come with routine 0.
  virtual void declare(std::uint32_t symbol, std::uint32_t /*routine*/) {
    at_ = this->symbol(symbol).span;
    cannot("variables");
  }
  /// Between declarations and statements.
  virtual void routine_code(std::uint32_t /*routine*/) {}
  virtual void routine_end(std::uint32_t /*routine*/) = 0;
  /// Gives the files to `output_`.
  virtual void finish() = 0;

  // ---- hooks: statements ----
  virtual void assign(std::uint32_t /*place*/, std::uint32_t /*value*/) { cannot("assignments"); }
  virtual void set_output(const Signal&, std::uint32_t /*value*/) { cannot("outputs"); }
  virtual void call(std::uint32_t /*routine*/, std::span<const std::uint32_t> /*arguments*/) {
    cannot("calls of procedures");
  }
  /// A procedure of the language, such as LIST_ADD; WRITE and WRITELN have message().
  virtual void intrinsic_call(std::string_view name, std::span<const std::uint32_t> /*arguments*/) {
    cannot(std::string(name));
  }
  virtual void message(std::span<const std::uint32_t> /*values*/, bool /*ends_line*/) {
    cannot("messages (WRITE)", "Remove the statement, or post the flattened program.");
  }
  virtual void if_begin(std::uint32_t /*condition*/) { cannot("IF"); }
  virtual void else_if(std::uint32_t /*condition*/) { cannot("ELSIF"); }
  virtual void else_() { cannot("ELSE"); }
  virtual void if_end() {}
  virtual void while_begin(std::uint32_t /*condition*/) { cannot("WHILE"); }
  virtual void while_end() {}
  virtual void repeat_begin() { cannot("REPEAT"); }
  virtual void repeat_end(std::uint32_t /*until*/) {}
  virtual void loop_begin() { cannot("LOOP"); }
  virtual void loop_end() {}
  virtual void for_begin(std::uint32_t /*symbol*/, std::uint32_t /*from*/, std::uint32_t /*to*/,
                         std::uint32_t /*step; none = 1*/, bool /*down*/) {
    cannot("FOR");
  }
  virtual void for_end(std::uint32_t /*symbol*/) {}
  virtual void exit_loop() { cannot("EXIT"); }
  virtual void case_begin(std::uint32_t /*selector*/) { cannot("CASE"); }
  virtual void case_when(std::span<const std::uint32_t> /*labels*/) {}
  virtual void case_default() {}
  virtual void case_end() {}
  virtual void go_to(std::uint32_t /*label symbol*/) { cannot("GOTO"); }
  virtual void label(std::uint32_t /*symbol*/) { cannot("LABEL"); }
  virtual void return_(std::uint32_t /*value; none = none*/) { cannot("RETURN"); }
  virtual void wait_time(std::uint32_t /*seconds*/) { cannot("WAIT ... SEC"); }
  virtual void wait_for(std::uint32_t /*condition*/, std::uint32_t timeout) {
    cannot(timeout == RMP_NONE ? "WAIT FOR" : "WAIT FOR with a TIMEOUT");
  }
  virtual void pause(std::uint32_t /*message; none = none*/) { cannot("PAUSE"); }
  virtual void halt() { cannot("HALT"); }
  virtual void ptp(const Motion&) { cannot("PTP motions"); }
  virtual void lin(const Motion&) { cannot("LIN motions"); }
  virtual void circle(const Motion&) { cannot("CIRCLE motions"); }
  virtual void path(const Motion&) { cannot("PATH motions"); }
  virtual void process(std::uint32_t /*statement op: START ...*/, std::uint32_t /*routine*/,
                       std::uint32_t /*priority*/) {
    cannot("parallel processes");
  }
  virtual void interrupt(std::uint32_t /*statement op: ENABLE, DISABLE*/, std::uint32_t /*routine*/,
                         std::uint32_t /*priority*/) {
    cannot("interrupts");
  }
  virtual void teach(std::uint32_t /*symbol*/) { cannot("TEACH"); }
  /// What is known of the controller's state holds no more: another path leads here.
  virtual void forget() {}

  // ---- hooks: expressions ----
  /// The operations that the target has; those that are missing are errors where they are used.
  [[nodiscard]] virtual std::span<const Operator> operators() const = 0;
  virtual Text literal(const rmp_code_constant& k) {
    switch (k.kind) {
      case RMP_CONSTANT_INT:
        if (k.type == RMP_TYPE_BOOL) return {k.integer ? "TRUE" : "FALSE"};
        if (k.type == RMP_TYPE_CHAR) return string_literal(std::string(1, char(k.integer)));
        return {std::to_string(k.integer), k.integer < 0 ? 0 : 100};
      case RMP_CONSTANT_REAL:
        if (!std::isfinite(k.real)) cannot("numbers that are not finite");
        return {real_literal(k.real), std::signbit(k.real) && k.real != 0 ? 0 : 100};
      case RMP_CONSTANT_TEXT: return string_literal({k.text, k.text_size});
      default: cannot("constants of this kind"); return {};
    }
  }
  virtual std::string real_literal(double v) { return shortest(v); }
  virtual Text string_literal(std::string_view) {
    cannot("strings");
    return {};
  }
  virtual Text variable(std::uint32_t symbol) { return {name(symbol)}; }
  virtual Text input(const Signal&) {
    cannot("inputs");
    return {};
  }
  virtual Text output(const Signal&) {
    cannot("reading an output", "Keep its state in a variable.");
    return {};
  }
  virtual Text field(std::uint32_t object, std::uint32_t number, const rmp_code_expression&) {
    return {within(expr(object), 100) + "." + field_name(expression(object).type, number)};
  }
  virtual Text index(std::uint32_t /*object*/, std::uint32_t /*index*/,
                     const rmp_code_expression&) {
    cannot("arrays");
    return {};
  }
  virtual Text call_function(std::uint32_t routine, std::span<const std::uint32_t> arguments) {
    return {routine_name(routine) + "(" + list(arguments) + ")"};
  }
  virtual Text intrinsic(std::string_view name, std::span<const std::uint32_t> /*arguments*/,
                         const rmp_code_expression&) {
    cannot(std::string(name) + "() at run time",
           "Compute the value with constants, or post the flattened program.");
    return {};
  }
  /// A record, array or list of its operands.
  virtual Text make(std::span<const std::uint32_t> /*operands*/, const rmp_code_expression& e) {
    cannot("values of " + type_name(e.type), "Assign its parts one by one.");
    return {};
  }
  /// A geometric value that is known; asked first wherever there is one.
  virtual std::optional<Text> known_point(const PostPoint&, const rmp_code_expression&) {
    return std::nullopt;
  }
  /// INT to REAL is the number itself by default.
  virtual Text convert(std::uint32_t operand, const rmp_code_expression& e) {
    if (e.type == RMP_TYPE_REAL && expression(operand).type == RMP_TYPE_INT) return expr(operand);
    cannot("conversion of " + type_name(expression(operand).type) + " to " + type_name(e.type));
    return {};
  }
  virtual Text compose(std::uint32_t /*a*/, std::uint32_t /*b*/, const rmp_code_expression&) {
    cannot("operator @ at run time",
           "Post the flattened program, or compute the pose with constants.");
    return {};
  }
  /// An operator's text as a whole, where no spelling between or before its operands says it.
  virtual std::optional<Text> operated(const rmp_code_expression&) { return std::nullopt; }
  /// Where its spelling depends on the operands' types.
  virtual const Operator* operation(const rmp_code_expression& e) {
    for (const Operator& o : operators())
      if (o.op == e.op) return &o;
    return nullptr;
  }

  // ---- to be called from hooks: expressions ----
  /// The text of an expression. Values that are known are literals.
  Text expr(std::uint32_t e) {
    if (e >= c_.expressions.count || depth_ > kDeepest) {
      cannot(depth_ > kDeepest ? "expressions nested this deep" : "this expression");
      return {};
    }
    const Depth here(depth_);
    const auto& x = expression(e);
    if (x.constant != RMP_NONE && type(x.type).kind <= RMP_TYPE_STRING)
      return literal(constant(x.constant));
    if (by_expression_[e])
      if (auto text = known_point(*by_expression_[e], x)) return *text;
    const auto operands = links(x.first, x.count);
    switch (x.op) {
      case RMP_EXPR_LITERAL: return literal(constant(x.constant));
      case RMP_EXPR_SYMBOL: {
        const auto& s = symbol(x.symbol);
        if (s.kind == RMP_SYMBOL_INPUT) return input(signal(x.symbol));
        if (s.kind == RMP_SYMBOL_OUTPUT) return output(signal(x.symbol));
        if (s.constant != RMP_NONE) return literal(constant(s.constant));
        return variable(x.symbol);
      }
      case RMP_EXPR_FIELD: return field(operands[0], x.symbol, x);
      case RMP_EXPR_INDEX: return index(operands[0], operands[1], x);
      case RMP_EXPR_CALL: return call_function(symbol(x.symbol).routine, operands);
      case RMP_EXPR_INTRINSIC: return intrinsic(upper(symbol(x.symbol).name), operands, x);
      case RMP_EXPR_MAKE: return make(operands, x);
      case RMP_EXPR_CONVERT: return convert(operands[0], x);
      case RMP_EXPR_COMPOSE: return compose(operands[0], operands[1], x);
      default: break;
    }
    if (auto whole = operated(x)) return *whole;
    const Operator* o = operation(x);
    if (!o || !*o->spelling) {
      cannot(std::string("operator ") + operator_name(x.op));
      return {};
    }
    if (o->form == Operator::call) return {std::string(o->spelling) + "(" + list(operands) + ")"};
    if (o->form == Operator::prefix_group)
      return {std::string(o->spelling) + "(" + text(operands[0]) + ")", o->binding};
    if (o->form == Operator::prefix)
      return {o->spelling + within(expr(operands[0]), o->binding), o->binding};
    // Comparisons are not joined without parentheses.
    const bool compares = x.op >= RMP_EXPR_EQUAL && x.op <= RMP_EXPR_GREATER_EQUAL;
    // The left side first: what it calls may write its own lines.
    const std::string left = within(expr(operands[0]), o->binding + (compares ? 1 : 0));
    return {left + o->spelling + within(expr(operands[1]), o->binding + 1),
            o->outer > 0 ? o->outer : o->binding};
  }
  /// The same without its binding.
  std::string text(std::uint32_t e) { return expr(e).text; }
  static std::string within(const Text& t, int binding) {
    return t.binding < binding ? "(" + t.text + ")" : t.text;
  }
  std::string list(std::span<const std::uint32_t> expressions, std::string_view between = ", ") {
    std::string out;
    for (std::size_t i = 0; i < expressions.size(); ++i)
      out += (i ? std::string(between) : std::string()) + text(expressions[i]);
    return out;
  }
  /// The value of a number that is known.
  [[nodiscard]] std::optional<double> known(std::uint32_t e) const {
    if (e == RMP_NONE) return std::nullopt;
    const auto& x = expression(e);
    if (x.constant == RMP_NONE) return std::nullopt;
    const auto& k = constant(x.constant);
    if (k.kind == RMP_CONSTANT_INT) return static_cast<double>(k.integer);
    if (k.kind == RMP_CONSTANT_REAL) return k.real;
    return std::nullopt;
  }
  [[nodiscard]] const PostPoint* point(std::uint32_t e) const {
    return e < by_expression_.size() ? by_expression_[e] : nullptr;
  }

  // ---- to be called from hooks: writing ----
  void line(std::string_view text) { out_->add(text, &at_); }
  void open(std::string_view text) {
    line(text);
    out_->in();
  }
  void close(std::string_view text) {
    out_->out();
    line(text);
  }
  /// Lines of the target's own between parts of the same construct (ELSE).
  void middle(std::string_view text) {
    out_->out();
    line(text);
    out_->in();
  }
  void say(std::uint32_t severity, std::string message, std::string hint = {}) {
    if (!told_.emplace(severity, at_.file, at_.begin, message).second) return;
    if (severity == RMP_FAULT_ERROR) ++errors_;
    output_.fault(severity, at_, message, hint);
  }
  /// An error here: the target has no such construct.
  void cannot(std::string what, std::string hint = {}) {
    say(RMP_FAULT_ERROR, std::string(caps_.title) + " has no " + what,
        hint.empty() ? "Rewrite it, or post the flattened program (form = \"flat\")."
                     : std::move(hint));
  }
  void fail(std::string message, std::string hint = {}) {
    say(RMP_FAULT_ERROR, std::move(message), std::move(hint));
  }
  void warn(std::string message, std::string hint = {}) {
    say(RMP_FAULT_WARNING, std::move(message), std::move(hint));
  }
  void note(std::string message, std::string hint = {}) {
    say(RMP_FAULT_NOTE, std::move(message), std::move(hint));
  }

  // ---- names ----
  std::string name(std::uint32_t s) {
    const std::string& there = names_.of(s, symbol(s).name);
    if (named_.insert(s).second) tell_renamed(s, there);
    return there;
  }
  /// A note where the name of a routine, or of a variable or signal of the whole program, is
  /// another one there, but for its case.
  void tell_renamed(std::uint32_t s, const std::string& there) {
    const auto& x = symbol(s);
    const std::string_view own = x.name;
    if (x.kind != RMP_SYMBOL_ROUTINE && x.routine != RMP_NONE && x.routine != 0) return;
    // What passes have added has the place of a statement.
    if (upper(own) == upper(there) || is_system(s) || x.span.end - x.span.begin != own.size())
      return;
    note_renamed(own, there, x.span);
  }
  void note_renamed(std::string_view own, const std::string& there, const rmp_span& place) {
    const rmp_span before = std::exchange(at_, place);
    note(std::string(own) + " is called " + there + " there: the name is " +
             (own.size() > static_cast<std::size_t>(std::max(caps_.max_name, 4))
                  ? std::string("too long")
                  : std::string("taken, or has characters not allowed in names")),
         "Rename it if operators look for it.");
    at_ = before;
  }
  std::string routine_name(std::uint32_t r) {
    if (r != 0) return name(routine(r).symbol);
    const std::string& there = names_.of(kProgram, task_.name);
    if (!std::exchange(told_program_, true) && upper(task_.name) != upper(there))
      note_renamed(task_.name, there, at_);
    return there;
  }
  std::string field_name(std::uint32_t t, std::uint32_t number) {
    const auto& x = type(t);
    if (x.kind != RMP_TYPE_RECORD || number >= x.field_count) return "x";
    const auto [it, is_new] = fields_.try_emplace({t, number});
    if (is_new) {
      // Names of one record's fields only have to differ from each other.
      auto [names, made] = field_names_.try_emplace(t, caps_);
      it->second = names->second.unique(field_row(x.first_field + number).name);
    }
    return it->second;
  }
  std::string type_name(std::uint32_t t) const {
    static constexpr const char* kBasic[] = {"no value", "INT",  "REAL", "CHAR",      "BOOL",
                                             "STRING",   "TEXT", "FILE", "SEMAPHORE", "PROCESS"};
    if (t <= RMP_TYPE_PROCESS) return kBasic[t];
    const auto& x = type(t);
    if (*x.name) return x.name;
    return x.kind == RMP_TYPE_ARRAY ? "ARRAY" : x.kind == RMP_TYPE_LIST ? "LIST" : "RECORD";
  }
  static std::string operator_name(std::uint32_t op) {
    static constexpr const char* kNames[] = {
        "value", "name", ".", "[]", "call", "function", "aggregate", "conversion", "- (sign)",
        "NOT",   "+",    "-", "*",  "/",    "DIV",      "MOD",       "=",          "<>",
        "<",     "<=",   ">", ">=", "AND",  "OR",       "EXOR",      "@"};
    return op < std::size(kNames) ? kNames[op] : "?";
  }

  // ---- profile ----
  Signal signal(std::uint32_t s) const {
    const auto& x = symbol(s);
    Signal out;
    out.name = x.name;
    out.number = x.address;
    out.width = std::max(1, x.width);
    out.is_output = x.kind == RMP_SYMBOL_OUTPUT;
    out.type = x.type;
    for (const PostSignal& p : profile_.signals) {
      if (upper(p.name) != upper(x.name)) continue;
      out.target = p.target;
      if (p.number >= 0) out.number = p.number;
      out.kind = p.kind;
      out.inverted = p.inverted;
    }
    return out;
  }
  [[nodiscard]] std::string_view option(std::string_view name,
                                        std::string_view otherwise = {}) const {
    for (const PostOption& o : profile_.options)
      if (o.name == name) return o.value;
    return otherwise;
  }
  [[nodiscard]] double number_option(std::string_view name, double otherwise) {
    const std::string_view s = option(name);
    if (s.empty()) return otherwise;
    double v = otherwise;
    const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
    if (r.ec != std::errc() || r.ptr != s.data() + s.size() || !std::isfinite(v)) {
      fail("the profile's option " + std::string(name) + " is \"" + std::string(s) +
               "\", which is not a number",
           "Give a number in the profile.");
      return otherwise;
    }
    return v;
  }
  std::string length(double mm) { return number(mm, profile_.length_digits); }
  std::string angle(double degrees) { return number(degrees, profile_.angle_digits); }
  std::string number(double v, int digits) {
    if (!std::isfinite(v)) fail("a number here is not finite", "Check what it is computed from.");
    return fixed(v, digits);
  }
  /// Whether there are axes of the robot that the controller does not keep as external ones.
  [[nodiscard]] bool has_axes() const {
    return std::any_of(profile_.axes.begin(), profile_.axes.end(),
                       [](const PostAxis& a) { return !a.external; });
  }
  /// A warning, once a program, where joint values, turns or a configuration are written and the
  /// axes of the controller are not known.
  void axes_are_needed() {
    if (!RMP_HAS(&task_, axes_are_unknown) || task_.axes_are_unknown == 0 ||
        std::exchange(told_axes_, true))
      return;
    warn(
        "the controller's axis convention is unknown: joint values, turns and configurations are "
        "written in the robot's joint convention",
        "Give the robot its maker's axes (robot.set_axes), or set sign and offset of the profile's "
        "axes.");
  }
  /// Values of the controller's axes for the robot's joints at a point, external ones not counted
  /// [degrees or mm]. If they are not known a warning reports it, and they are empty.
  std::vector<double> axes(const PostPoint& p) {
    std::vector<double> out;
    if (p.q.empty()) {
      fail(*p.q_missing ? p.q_missing : "the joint values of this target are unknown",
           "Name the robot: program.post{robot = ...}.");
      return out;
    }
    axes_are_needed();
    if (!has_axes()) {
      for (std::size_t i = 0; i < p.q.size(); ++i)
        out.push_back(p.q[i] * (joint_slides(task_.robot, i) ? 1000.0 : kDegree));
      return out;
    }
    for (const PostAxis& a : profile_.axes) {
      if (a.external) continue;
      const auto v = axis_value(a, p.q, task_.robot);
      if (!v) {
        fail("axis " + std::string(a.name) + " of the profile is joint " +
                 std::to_string(a.joint + 1) + ", which the target does not have",
             "Give the profile's axes the joints of this robot.");
        return {};
      }
      out.push_back(*v);
      within_limits(a, *v);
    }
    return out;
  }
  void within_limits(const PostAxis& a, double v) {
    if (!(a.lower < a.upper) || (v >= a.lower - 1e-6 && v <= a.upper + 1e-6)) return;
    const auto limit = [](double x) {
      return std::isfinite(x) ? trimmed(x, 3) : std::string("no limit");
    };
    fail("axis " + std::string(a.name) + " would be at " + trimmed(v, 3) +
             ", outside its limits of " + limit(a.lower) + " to " + limit(a.upper),
         "Move the target, or choose another configuration.");
  }
  /// The turn of axis `axis` of the controller (0 = its first) where turn 0 begins at `from`
  /// degrees; nothing = it is not known.
  [[nodiscard]] std::optional<std::int32_t> axis_turn(const PostPoint& p, std::size_t axis,
                                                      double from = kTurnsFrom) const {
    std::size_t at = 0;
    const PostAxis* named = nullptr;
    for (const PostAxis& a : profile_.axes) {
      if (a.external || at++ != axis) continue;
      if (a.joint < 0 || a.linear) return std::nullopt;
      named = &a;
    }
    if (at > 0 && !named) return std::nullopt;
    const std::size_t joint = named ? static_cast<std::size_t>(named->joint) : axis;
    if (!p.q.empty()) {
      if (joint >= p.q.size() || joint_slides(task_.robot, joint)) return std::nullopt;
      if (!named) return turn_of(p.q[joint] * kDegree, from);
      const auto v = axis_value(*named, p.q, task_.robot);
      return v ? std::optional<std::int32_t>(turn_of(*v, from)) : std::nullopt;
    }
    const bool is_as_it_is =
        !named || (named->sign == 1 && named->offset == 0 && named->coupled.empty());
    if (!is_as_it_is || p.turns_from != from || joint < p.turns_first ||
        joint - p.turns_first >= p.turns.size())
      return std::nullopt;
    const std::int32_t t = p.turns[joint - p.turns_first];
    return is_any_turn(t) ? std::nullopt : std::optional<std::int32_t>(t);
  }
  /// Where the program asks for turns and the language has none: a warning at its line.
  void no_turns(const PostPoint* p) {
    if (!p) return;
    for (const std::int32_t t : p->turns)
      if (!is_any_turn(t) && (t != 0 || p->turns_from != kTurnsFrom)) {
        warn("TURNS of this target are not written: " + std::string(caps_.title) +
                 " has none, and the robot takes the shortest path",
             "Move to joints (MAIN_JOINT) where the turn matters.");
        return;
      }
  }
  /// Whether any target has an additional joint that is not 0, or the program computes one.
  [[nodiscard]] bool has_additional_joints() {
    if (!has_additional_) has_additional_ = uses_additional_joints();
    return *has_additional_;
  }
  [[nodiscard]] bool uses_additional_joints() const {
    // The profile's external axes are somewhere, also at 0.
    for (const PostAxis& a : profile_.axes)
      if (a.external && a.of_robot == 0) return true;
    for (const PostPoint& p : task_.points)
      for (const double x : p.external)
        if (x != 0) return true;
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_FIELD && x.count > 0 &&
          role(expression(links(x.first, x.count)[0]).type) == RMP_ROLE_ADD_JOINT)
        return true;
    }
    return false;
  }
  /// The same of the external axes: joints of the robot that its controller keeps as such, and the
  /// additional joints: those of the profile, or, where it names none and the program uses them,
  /// all as they are, which is noted.
  std::vector<double> external_axes(const PostPoint& p) {
    std::vector<double> out;
    const bool has_external = std::any_of(profile_.axes.begin(), profile_.axes.end(),
                                          [](const PostAxis& a) { return a.external; });
    if (!has_external) {
      if (p.external.empty() || !has_additional_joints()) return out;
      if (!std::exchange(told_plain_external_, true))
        note(
            "additional joints are written as the external axes with the same numbers, in the "
            "program's degrees or mm, since the profile names none",
            "Give the profile its external axes (is_external = true).");
      return {p.external.begin(), p.external.end()};
    }
    for (std::size_t i = 0; i < p.external.size(); ++i)
      if (p.external[i] != 0 &&
          std::none_of(profile_.axes.begin(), profile_.axes.end(), [&](const PostAxis& a) {
            return a.external && a.joint == static_cast<std::int32_t>(i);
          }))
        fail("additional joint " + std::to_string(i + 1) + " of this target is at " +
                 trimmed(p.external[i], 4) + ", and the profile has no external axis for it",
             "Add an axis with is_external = true and this joint to the profile.");
    for (const PostAxis& a : profile_.axes) {
      if (!a.external) continue;
      if (a.of_robot != 0) {
        const auto v = axis_value(a, p.q, task_.robot);
        if (!v)
          fail("external axis " + std::string(a.name) +
                   " is a joint of the robot, and the joint values of this target are unknown",
               *p.q_missing ? std::string(p.q_missing) + "." : "Name the robot.");
        else within_limits(a, *v);
        out.push_back(v.value_or(0));
        continue;
      }
      const auto i = static_cast<std::size_t>(a.joint);
      const double v = a.joint >= 0 && i < p.external.size() ? p.external[i] : 0.0;
      out.push_back(a.sign * v + a.offset);
      within_limits(a, out.back());
    }
    return out;
  }

  // ---- tables ----
  [[nodiscard]] const rmp_code_expression& expression(std::uint32_t i) const {
    return row<rmp_code_expression>(c_.expressions, i);
  }
  [[nodiscard]] const rmp_code_statement& statement(std::uint32_t i) const {
    return row<rmp_code_statement>(c_.statements, i);
  }
  [[nodiscard]] const rmp_code_symbol& symbol(std::uint32_t i) const {
    return row<rmp_code_symbol>(c_.symbols, i);
  }
  [[nodiscard]] const rmp_code_routine& routine(std::uint32_t i) const {
    return row<rmp_code_routine>(c_.routines, i);
  }
  [[nodiscard]] const rmp_code_type& type(std::uint32_t i) const {
    return row<rmp_code_type>(c_.types, i);
  }
  [[nodiscard]] const rmp_code_field& field_row(std::uint32_t i) const {
    return row<rmp_code_field>(c_.fields, i);
  }
  [[nodiscard]] const rmp_code_constant& constant(std::uint32_t i) const {
    return row<rmp_code_constant>(c_.constants, i);
  }
  [[nodiscard]] std::uint32_t role(std::uint32_t t) const { return type(t).role; }
  [[nodiscard]] std::span<const std::uint32_t> links(std::uint32_t first,
                                                     std::uint32_t count) const {
    if (count == 0) return {};
    return {static_cast<const std::uint32_t*>(c_.links.rows) + first, count};
  }
  /// Variable of the routine; those of program, modules and cell belong to routine 0.
  [[nodiscard]] bool is_local_of(std::uint32_t s, std::uint32_t r) const {
    const auto& x = symbol(s);
    if (x.kind != RMP_SYMBOL_VARIABLE && x.kind != RMP_SYMBOL_ROBOT &&
        !(x.kind == RMP_SYMBOL_CONSTANT && x.constant == RMP_NONE))
      return false;
    return (x.routine == RMP_NONE ? 0 : x.routine) == r;
  }
  [[nodiscard]] bool is_system(std::uint32_t s) const {
    const auto& x = symbol(s);
    return x.scope != RMP_NONE &&
           row<rmp_code_scope>(c_.scopes, x.scope).kind == RMP_SCOPE_PREDEFINED;
  }
  [[nodiscard]] bool is_used(std::uint32_t s) const { return used_[s]; }
  /// Record types of the program's own that its symbols and the results of its reached functions
  /// are made of, those within others first.
  [[nodiscard]] std::set<std::uint32_t> records_in_use() const {
    std::set<std::uint32_t> out;
    std::vector<std::uint32_t> open;
    for (std::uint32_t s = 0; s < c_.symbols.count; ++s)
      if (is_used(s)) open.push_back(symbol(s).type);
    for (std::uint32_t r = 1; r < c_.routines.count; ++r)
      if (is_reached(r)) open.push_back(routine(r).result);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      const auto& x = type(t);
      if (x.kind == RMP_TYPE_ARRAY) open.push_back(x.element);
      if (x.kind != RMP_TYPE_RECORD || x.role != RMP_ROLE_NONE || !out.insert(t).second) continue;
      for (std::uint32_t k = 0; k < x.field_count; ++k)
        open.push_back(field_row(x.first_field + k).type);
    }
    return out;
  }
  /// The pose of TOOL or FRAME that all motions have in common, to be set once at the start; empty
  /// = there are several, some motions have none, or it is known only when the program runs. PTP
  /// motions to joints need no FRAME.
  [[nodiscard]] std::optional<Pose> common_place(std::uint32_t attribute) const {
    std::optional<Pose> out;
    for (std::uint32_t i = 0; i < c_.motions.count; ++i) {
      const auto& m = row<rmp_code_motion>(c_.motions, i);
      const PostPoint* place = nullptr;
      bool is_given = false;
      for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
        const auto& a = row<rmp_code_attribute>(c_.attributes, m.first_attribute + k);
        if (a.attribute != attribute) continue;
        is_given = true;
        place = point(a.value);
      }
      if (!is_given && attribute == RMP_ATTR_FRAME && m.interpolation == RMP_MOVE_PTP &&
          goes_to_joints(m))
        continue;
      if (!place || !place->has_pose) return std::nullopt;
      if (!out) {
        out = place->pose;
        continue;
      }
      constexpr double kSame = 1e-9;  // [m], of a direction
      for (std::size_t k = 0; k < 3; ++k)
        if (!(std::fabs(out->p[k] - place->pose.p[k]) < kSame)) return std::nullopt;
      for (std::size_t k = 0; k < 9; ++k)
        if (!(std::fabs(out->R[k] - place->pose.R[k]) < kSame)) return std::nullopt;
    }
    return out;
  }
  [[nodiscard]] bool goes_to_joints(const rmp_code_motion& m) const {
    for (const std::uint32_t t : links(m.first_target, m.target_count)) {
      const std::uint32_t role = type(expression(t).type).role;
      if (role != RMP_ROLE_JOINT && role != RMP_ROLE_MAIN_JOINT && role != RMP_ROLE_ADD_JOINT)
        return false;
    }
    return true;
  }
  [[nodiscard]] bool is_assigned(std::uint32_t s) const { return assigned_[s]; }
  [[nodiscard]] bool is_reached(std::uint32_t r) const { return reached_[r]; }
  /// A symbol by its name among those of the language itself, such as R_SPEED; RMP_NONE = none.
  [[nodiscard]] std::uint32_t system_symbol(std::string_view name) const {
    const auto it = system_.find(std::string(name));
    return it == system_.end() ? RMP_NONE : it->second;
  }
  static rmp_span end_of(rmp_span s) {
    s.begin = s.end > 0 ? s.end - 1 : 0;
    return s;
  }

  const PostTask& task_;
  const rmp_code& c_;
  const PostProfile& profile_;
  const PostCapabilities& caps_;
  Names names_;
  PostOutput& output_;
  Progress& progress_;
  File* out_ = nullptr;  ///< where line() writes
  rmp_span at_{};
  std::uint32_t in_routine_ = 0;
  std::uint32_t errors_ = 0;

 private:
  std::set<std::uint32_t> named_;  ///< symbols with names that were requested
  bool told_plain_external_ = false;
  std::optional<bool> has_additional_;
  static constexpr int kDeepest = 1200;
  static constexpr std::uint64_t kProgram = 1ULL << 40U;
  struct Depth {
    explicit Depth(int& d) : depth(d) { ++depth; }
    ~Depth() { --depth; }
    Depth(const Depth&) = delete;
    Depth& operator=(const Depth&) = delete;
    int& depth;
  };

  // What the program uses: nothing else has to be declared.
  void collect() {
    used_.assign(c_.symbols.count, false);
    assigned_.assign(c_.symbols.count, false);
    reached_.assign(c_.routines.count, false);
    marked_.assign(c_.expressions.count, false);
    for (std::uint32_t s = 0; s < c_.symbols.count; ++s)
      if (is_system(s)) system_.emplace(upper(symbol(s).name), s);
    // Assigned first: a system variable that is nowhere assigned is a number.
    for (std::uint32_t s = 0; s < c_.statements.count; ++s) {
      const auto& x = statement(s);
      if (x.op == RMP_STMT_ASSIGN) assigned(x.a);
      if ((x.op == RMP_STMT_FOR || x.op == RMP_STMT_FOR_DOWN || x.op == RMP_STMT_TEACH) &&
          x.symbol != RMP_NONE)
        assigned_[x.symbol] = true;
    }
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE && is_system(x.symbol))
        of_symbol_.emplace(x.symbol, e);
      if (x.op != RMP_EXPR_CALL && x.op != RMP_EXPR_INTRINSIC) continue;
      const auto arguments = links(x.first, x.count);
      for (std::size_t k = 0; k < arguments.size(); ++k)
        if (x.op == RMP_EXPR_INTRINSIC || is_out(x.symbol, k)) assigned(arguments[k]);
    }
    reach(0);
    while (!to_do_.empty()) {
      const std::uint32_t r = to_do_.front();
      to_do_.pop_front();
      mark(routine(r).priority);
      mark(routine(r).condition);
      mark_block(routine(r).body);
    }
  }
  [[nodiscard]] bool is_out(std::uint32_t routine_symbol, std::size_t k) const {
    const std::uint32_t r = symbol(routine_symbol).routine;
    if (r == RMP_NONE || k >= routine(r).parameter_count) return false;
    return symbol(routine(r).first_parameter + static_cast<std::uint32_t>(k)).mode != RMP_MODE_IN;
  }
  void assigned(std::uint32_t e) {
    while (e != RMP_NONE) {
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_SYMBOL) {
        if (x.symbol != RMP_NONE) assigned_[x.symbol] = true;
        return;
      }
      if ((x.op != RMP_EXPR_FIELD && x.op != RMP_EXPR_INDEX) || x.count == 0) return;
      e = links(x.first, x.count)[0];
    }
  }
  void reach(std::uint32_t r) {
    if (r == RMP_NONE || r >= reached_.size() || reached_[r]) return;
    reached_[r] = true;
    to_do_.push_back(r);
  }
  void mark(std::uint32_t first) {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const std::uint32_t e = open.back();
      open.pop_back();
      if (e == RMP_NONE || marked_[e]) continue;
      marked_[e] = true;
      const auto& x = expression(e);
      if (x.constant != RMP_NONE && type(x.type).kind <= RMP_TYPE_STRING) continue;
      if (by_expression_[e] && keeps_as_point(*by_expression_[e], x)) continue;
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE) {
        used_[x.symbol] = true;
        open.push_back(symbol(x.symbol).value);
      }
      if (x.op == RMP_EXPR_CALL) reach(symbol(x.symbol).routine);
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
  }

 protected:
  /// Whether a geometric value that is known is written as its numbers, so that its variables need
  /// no declaration.
  virtual bool keeps_as_point(const PostPoint&, const rmp_code_expression&) const { return true; }

  /// Whether an expression reads an input or output.
  [[nodiscard]] bool reads_signals(std::uint32_t first) const {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const std::uint32_t e = open.back();
      open.pop_back();
      if (e == RMP_NONE) continue;
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
          (symbol(x.symbol).kind == RMP_SYMBOL_INPUT || symbol(x.symbol).kind == RMP_SYMBOL_OUTPUT))
        return true;
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }

 private:
  void mark_block(std::uint32_t first) {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const std::uint32_t i = open.back();
      open.pop_back();
      if (i == RMP_NONE) continue;
      const auto& s = statement(i);
      open.push_back(s.next);
      open.push_back(s.body);
      for (const std::uint32_t e : {s.a, s.b, s.c}) mark(e);
      if (s.op == RMP_STMT_ASSIGN) mark_place(s.a);
      for (const std::uint32_t e : links(s.first, s.count)) mark(e);
      if (s.symbol != RMP_NONE) {
        if (symbol(s.symbol).kind == RMP_SYMBOL_ROUTINE) reach(symbol(s.symbol).routine);
        else if (s.op != RMP_STMT_GOTO && s.op != RMP_STMT_LABEL) used_[s.symbol] = true;
      }
      if (s.motion == RMP_NONE) continue;
      const auto& m = row<rmp_code_motion>(c_.motions, s.motion);
      for (const std::uint32_t e : links(m.first_target, m.target_count)) mark(e);
      const Motion all = motion(s.motion);
      for (const Attribute& a : all.attributes)
        if (!a.known) mark(a.expression);
      mark(m.until);
      reach(m.action);
    }
  }
  void mark_place(std::uint32_t e) {
    while (e != RMP_NONE) {
      const auto& x = expression(e);
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE) {
        used_[x.symbol] = true;
        mark(symbol(x.symbol).value);
      }
      if ((x.op != RMP_EXPR_FIELD && x.op != RMP_EXPR_INDEX) || x.count == 0) return;
      const auto operands = links(x.first, x.count);
      for (std::size_t k = 1; k < operands.size(); ++k) mark(operands[k]);
      e = operands[0];
    }
  }

  Motion motion(std::uint32_t number) const {
    // Tables of other languages, and flattened ones, need not have these variables.
    static constexpr struct {
      std::uint32_t attribute;
      const char* variable;
      double standard;
    } kSystem[] = {{RMP_ATTR_SPEED, "R_SPEED", 250},
                   {RMP_ATTR_SPEED_ORI, "R_SPEED_ORI", 90},
                   {RMP_ATTR_ACC, "R_ACC", 100},
                   {RMP_ATTR_TIME, "R_MOVE_TIME", -1},
                   {RMP_ATTR_C_CP, "R_C_CP", 0},
                   {RMP_ATTR_C_SPEED, "R_C_SPEED", 100},
                   {RMP_ATTR_SPEED_PTP, "R_SPEED_PTP", 100},
                   {RMP_ATTR_ACC_PTP, "R_ACC_PTP", 100},
                   {RMP_ATTR_C_PTP, "R_C_PTP", 0}};
    const auto& m = row<rmp_code_motion>(c_.motions, number);
    Motion out;
    out.row = number;
    out.interpolation = m.interpolation;
    out.incremental = m.is_incremental != 0;
    out.until = m.until;
    out.action = m.action;
    out.span = m.span;
    for (const std::uint32_t e : links(m.first_target, m.target_count))
      out.targets.push_back({e, role(expression(e).type), by_expression_[e]});
    for (const auto& k : kSystem) {
      const std::uint32_t s = system_symbol(k.variable);
      Attribute& a = out.attributes[k.attribute];
      if (s == RMP_NONE) a.known = k.standard;
      else if (!assigned_[s]) a.known = known(symbol(s).value);
      else a.expression = expression_of(s);
    }
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const auto& a = row<rmp_code_attribute>(c_.attributes, m.first_attribute + k);
      if (a.attribute >= out.attributes.size()) continue;
      out.attributes[a.attribute] = {true, a.value, known(a.value)};
    }
    return out;
  }
  /// An expression that is this symbol; RMP_NONE = there is none.
  std::uint32_t expression_of(std::uint32_t s) const {
    const auto it = of_symbol_.find(s);
    return it == of_symbol_.end() ? RMP_NONE : it->second;
  }

  /// Whether what comes next is something that others see (an output, a wait, a text): motions end
  /// before it. Where the program's flow decides, it does not.
  [[nodiscard]] bool is_seen(std::uint32_t i, int depth = 0) const {
    for (int n = 0; i != RMP_NONE && n < 64; ++n, i = statement(i).next) {
      const auto& s = statement(i);
      switch (s.op) {
        case RMP_STMT_ASSIGN: {
          const auto& place = expression(s.a);
          if (place.op == RMP_EXPR_SYMBOL && place.symbol != RMP_NONE &&
              symbol(place.symbol).kind == RMP_SYMBOL_OUTPUT)
            return true;
          if (reads_signals(s.b)) return true;
          continue;
        }
        case RMP_STMT_CALL: {
          const auto& e = expression(s.a);
          if (e.op != RMP_EXPR_CALL) return true;
          if (depth > 8 || e.symbol == RMP_NONE || symbol(e.symbol).routine == RMP_NONE)
            return false;
          return is_seen(routine(symbol(e.symbol).routine).body, depth + 1);
        }
        case RMP_STMT_IF: return s.body != RMP_NONE && reads_signals(statement(s.body).a);
        case RMP_STMT_CASE:
        case RMP_STMT_WHILE: return reads_signals(s.a);
        case RMP_STMT_LABEL: continue;
        case RMP_STMT_WAIT_TIME:
        case RMP_STMT_WAIT_FOR:
        case RMP_STMT_PAUSE:
        case RMP_STMT_HALT:
        case RMP_STMT_START:
        case RMP_STMT_STOP:
        case RMP_STMT_CONTINUE:
        case RMP_STMT_CANCEL: return true;
        // A motion that a condition ends begins where the one before has ended.
        case RMP_STMT_MOVE: return row<rmp_code_motion>(c_.motions, s.motion).until != RMP_NONE;
        default: return false;
      }
    }
    return false;
  }
  /// Blending of a motion that ends before the next action, taken out.
  void end_before_what_is_seen(Motion& m) {
    bool asked = false;
    for (const std::uint32_t a : {RMP_ATTR_C_CP, RMP_ATTR_C_PTP, RMP_ATTR_C_PASS}) {
      Attribute& x = m.attributes[a];
      asked = asked || (x.given && x.known != 0.0);
      if (x.known.value_or(1) != 0) x = {false, RMP_NONE, 0.0};
    }
    if (asked)
      note(
          "the motion ends at its target: an output, a wait, a text or a motion with UNTIL follows",
          "Blending needs a following motion; remove C_CP, C_PTP and C_PASS here.");
  }

  void move(const rmp_code_statement& s) {
    Motion m = motion(s.motion);
    const bool ends = is_seen(s.next);
    const bool one_by_one = m.interpolation == RMP_MOVE_PTP || m.interpolation == RMP_MOVE_LIN;
    if (one_by_one && m.targets.size() > 1) {
      if (m.until != RMP_NONE) {
        fail("UNTIL over several targets cannot be posted", "Write a MOVE for each target.");
        return;
      }
      const std::vector<Target> all = m.targets;
      for (std::size_t k = 0; k < all.size(); ++k) {
        m.targets = {all[k]};
        if (ends && k + 1 == all.size()) end_before_what_is_seen(m);
        one_move(m);
      }
      return;
    }
    if (ends) end_before_what_is_seen(m);
    one_move(m);
  }
  void one_move(const Motion& m) {
    switch (m.interpolation) {
      case RMP_MOVE_PTP: ptp(m); return;
      case RMP_MOVE_LIN: lin(m); return;
      case RMP_MOVE_CIRCLE: circle(m); return;
      case RMP_MOVE_PATH: path(m); return;
      default: cannot("motions of this kind"); return;
    }
  }

  void block(std::uint32_t first, int depth) {
    if (first != RMP_NONE && depth > kDeepest) {
      fail("statements are nested too deep to post", "Move the inner ones into procedures.");
      return;
    }
    std::uint32_t n = 0;
    for (std::uint32_t i = first; i != RMP_NONE; i = statement(i).next) {
      if (++n % 1024 == 0 && progress_.cancelled()) return;
      at_ = statement(i).span;
      one(statement(i), depth);
    }
  }
  void inner(std::uint32_t body, const rmp_code_statement& s, int depth) {
    block(body, depth + 1);
    at_ = end_of(s.span);
    forget();
  }
  void one(const rmp_code_statement& s, int depth) {
    switch (s.op) {
      case RMP_STMT_ASSIGN: {
        const auto& place = expression(s.a);
        if (place.op == RMP_EXPR_SYMBOL && symbol(place.symbol).kind == RMP_SYMBOL_OUTPUT)
          set_output(signal(place.symbol), s.b);
        else assign(s.a, s.b);
        return;
      }
      case RMP_STMT_CALL: {
        const auto& e = expression(s.a);
        const auto arguments = links(e.first, e.count);
        if (e.op == RMP_EXPR_CALL) {
          call(symbol(e.symbol).routine, arguments);
          forget();
          return;
        }
        const std::string name = e.symbol == RMP_NONE ? "" : upper(symbol(e.symbol).name);
        const bool has_file =
            !arguments.empty() && (expression(arguments[0]).type == RMP_TYPE_TEXT ||
                                   expression(arguments[0]).type == RMP_TYPE_FILE);
        if ((name == "WRITE" || name == "WRITELN") && !has_file)
          message(arguments, name == "WRITELN");
        else intrinsic_call(name, arguments);
        return;
      }
      case RMP_STMT_IF: {
        bool is_first = true;
        for (std::uint32_t a = s.body; a != RMP_NONE; a = statement(a).next) {
          const auto& arm = statement(a);
          at_ = arm.span;
          if (is_first) if_begin(arm.a);
          else if (arm.a == RMP_NONE) else_();
          else else_if(arm.a);
          is_first = false;
          inner(arm.body, s, depth);
        }
        if (!is_first) if_end();
        return;
      }
      case RMP_STMT_CASE:
        case_begin(s.a);
        for (std::uint32_t a = s.body; a != RMP_NONE; a = statement(a).next) {
          const auto& arm = statement(a);
          at_ = arm.span;
          if (arm.count == 0) case_default();
          else case_when(links(arm.first, arm.count));
          inner(arm.body, s, depth);
        }
        case_end();
        return;
      case RMP_STMT_WHILE:
        forget();
        while_begin(s.a);
        inner(s.body, s, depth);
        while_end();
        return;
      case RMP_STMT_REPEAT:
        forget();
        repeat_begin();
        inner(s.body, s, depth);
        repeat_end(s.a);
        return;
      case RMP_STMT_LOOP:
        forget();
        loop_begin();
        inner(s.body, s, depth);
        loop_end();
        return;
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN:
        forget();
        for_begin(s.symbol, s.a, s.b, s.c, s.op == RMP_STMT_FOR_DOWN);
        inner(s.body, s, depth);
        for_end(s.symbol);
        return;
      case RMP_STMT_EXIT: exit_loop(); return;
      case RMP_STMT_GOTO: go_to(s.symbol); return;
      case RMP_STMT_LABEL:
        forget();
        label(s.symbol);
        return;
      case RMP_STMT_RETURN: return_(s.a); return;
      case RMP_STMT_WAIT_TIME: wait_time(s.a); return;
      case RMP_STMT_WAIT_FOR: wait_for(s.a, s.b); return;
      case RMP_STMT_PAUSE: pause(s.a); return;
      case RMP_STMT_HALT: halt(); return;
      case RMP_STMT_MOVE: move(s); return;
      case RMP_STMT_START:
      case RMP_STMT_STOP:
      case RMP_STMT_CONTINUE:
      case RMP_STMT_CANCEL: process(s.op, symbol(s.symbol).routine, s.a); return;
      case RMP_STMT_ENABLE:
      case RMP_STMT_DISABLE: interrupt(s.op, symbol(s.symbol).routine, s.a); return;
      case RMP_STMT_TEACH: teach(s.symbol); return;
      default: cannot("statements of kind " + std::to_string(s.op)); return;
    }
  }

  std::vector<const PostPoint*> by_expression_;
  std::vector<bool> used_, assigned_, reached_, marked_;
  std::deque<std::uint32_t> to_do_;
  std::map<std::string, std::uint32_t> system_;
  std::map<std::uint32_t, std::uint32_t> of_symbol_;  ///< system variables only
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::string> fields_;
  std::map<std::uint32_t, Names> field_names_;
  std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::string>> told_;
  int depth_ = 0;
  bool told_axes_ = false, told_program_ = false;
};

/// Points of a program by their name: equal ones have one name.
class Points {
 public:
  /// The number of a point with this text, and whether it is new.
  std::pair<std::size_t, bool> add(std::string text) {
    const auto [it, is_new] = numbers_.try_emplace(std::move(text), numbers_.size());
    return {it->second, is_new};
  }
  [[nodiscard]] std::size_t size() const { return numbers_.size(); }

 private:
  std::map<std::string, std::size_t> numbers_;
};

}  // namespace robomosp::post

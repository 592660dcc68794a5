// SPDX-License-Identifier: Apache-2.0
#include "program/flatten.h"

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/program_turns.h>

#include "program/state.h"

namespace robomosp::program {
namespace {

using Operand = rmp_code_operand;
constexpr double kNotSaid = 1000;  ///< beyond what cell_number() gives

class Flattening {
 public:
  explicit Flattening(const Trace& trace)
      : trace_(trace),
        from_(trace.program->code()),
        made_(std::make_unique<ProgramTables>()),
        p_(*made_) {}

  Result<std::unique_ptr<ProgramTables>> run() {
    tables();
    std::uint32_t last = kNone;
    for (const TraceEntry& e : trace_.entries) {
      if (e.process != 0)
        return error(
            ErrorCode::unsupported,
            "the process " + std::string(routine_name(e.process)) +
                " runs in parallel to the program, which a flattened program cannot express",
            "Flatten programs without processes that write or move.", where(e.span));
      temporaries_ = 0;
      at_ = e.span;
      rmp_code_statement s{};
      s.next = s.a = s.b = s.c = s.body = s.symbol = s.motion = kNone;
      s.span = e.span;
      RMP_TRY(std::visit([&](const auto& what) { return one(what, s); }, e.what));
      const auto id = static_cast<std::uint32_t>(p_.statements.size());
      p_.statements.push_back(s);
      if (last == kNone) p_.routines[0].body = id;
      else p_.statements[last].next = id;
      last = id;
    }
    p_.routines[0].instruction_count = static_cast<std::uint32_t>(p_.instructions.size());
    p_.routines[0].temporary_count = most_;
    p_.routines[0].label_count = labels_;
    p_.seal();
    return std::move(made_);
  }

 private:
  [[nodiscard]] std::string routine_name(std::uint32_t r) const {
    if (r >= from_.routines.count) return std::to_string(r);
    return row<rmp_code_symbol>(from_.symbols, row<rmp_code_routine>(from_.routines, r).symbol)
        .name;
  }
  [[nodiscard]] std::string where(const rmp_span& s) const {
    if (s.file >= from_.files.count || !s.line) return {};
    return std::string(row<rmp_code_file>(from_.files, s.file).name) + ":" +
           std::to_string(s.line) + ":" + std::to_string(s.column);
  }
  [[nodiscard]] const rmp_code_type& type(std::uint32_t t) const { return p_.types[t]; }

  /// Types, fields and files as they were; signals and robots; what the language has itself.
  void tables() {
    p_.set_name(from_.name);
    for (std::uint32_t i = 0; i < from_.files.count; ++i)
      p_.files.push_back({p_.keep(row<rmp_code_file>(from_.files, i).name)});
    for (std::uint32_t i = 0; i < from_.types.count; ++i) {
      rmp_code_type t = row<rmp_code_type>(from_.types, i);
      t.name = p_.keep(t.name);
      p_.types.push_back(t);
    }
    for (std::uint32_t i = 0; i < from_.fields.count; ++i) {
      rmp_code_field f = row<rmp_code_field>(from_.fields, i);
      f.name = p_.keep(f.name);
      p_.fields.push_back(f);
    }
    const rmp_span whole = row<rmp_code_routine>(from_.routines, 0).span;
    p_.scopes.push_back({RMP_SCOPE_PREDEFINED, kNone, p_.keep("predefined"), {}});
    p_.scopes.push_back({RMP_SCOPE_PROGRAM, 0, p_.keep(from_.name), whole});
    for (std::uint32_t i = 0; i < from_.symbols.count; ++i) {
      const auto& s = row<rmp_code_symbol>(from_.symbols, i);
      if (s.kind != RMP_SYMBOL_INPUT && s.kind != RMP_SYMBOL_OUTPUT && s.kind != RMP_SYMBOL_ROBOT)
        continue;
      rmp_code_symbol x = s;
      x.name = p_.keep(s.name);
      x.scope = 1;
      x.routine = x.value = x.constant = kNone;
      symbols_.emplace(i, static_cast<std::uint32_t>(p_.symbols.size()));
      p_.symbols.push_back(x);
    }
    // What the cell says of how joints and turns count.
    for (const char* name : {"R_TURNS_FROM", "R_MAKER_AXES"}) {
      const double v = cell_number(from_, name, kNotSaid);
      if (v == kNotSaid || v != std::floor(v)) continue;
      rmp_code_symbol x{};
      x.kind = RMP_SYMBOL_CONSTANT;
      x.type = RMP_TYPE_INT;
      x.name = p_.keep(name);
      x.routine = x.value = kNone;
      x.constant = p_.integer(static_cast<std::int64_t>(v), RMP_TYPE_INT);
      p_.symbols.push_back(x);
    }
    for (const char* name : {"WRITE", "WRITELN"}) {
      rmp_code_symbol x{};
      x.kind = RMP_SYMBOL_INTRINSIC;
      x.name = p_.keep(name);
      x.routine = x.value = x.constant = kNone;
      intrinsics_.push_back(static_cast<std::uint32_t>(p_.symbols.size()));
      p_.symbols.push_back(x);
    }
    rmp_code_symbol self{};
    self.kind = RMP_SYMBOL_ROUTINE;
    self.name = p_.keep(from_.name);
    self.scope = 1;
    self.value = self.constant = kNone;
    rmp_code_routine r{};
    r.symbol = static_cast<std::uint32_t>(p_.symbols.size());
    r.scope = 1;
    r.body = r.priority = r.condition = kNone;
    r.span = whole;
    p_.symbols.push_back(self);
    p_.routines.push_back(r);
  }

  // ---- expressions ----
  std::uint32_t expression(std::uint32_t op, std::uint32_t of,
                           const std::vector<std::uint32_t>& operands, std::uint32_t symbol = kNone,
                           std::uint32_t constant = kNone) {
    rmp_code_expression e{};
    e.op = op;
    e.type = of;
    e.symbol = symbol;
    e.constant = constant;
    e.first = static_cast<std::uint32_t>(p_.links.size());
    e.count = static_cast<std::uint32_t>(operands.size());
    e.span = at_;
    p_.links.insert(p_.links.end(), operands.begin(), operands.end());
    p_.expressions.push_back(e);
    return static_cast<std::uint32_t>(p_.expressions.size() - 1);
  }
  std::uint32_t literal(std::uint32_t constant) {
    return expression(RMP_EXPR_LITERAL, p_.constants[constant].type, {}, kNone, constant);
  }
  std::uint32_t real(double v) { return literal(p_.real(v)); }
  std::uint32_t whole(std::int64_t v, std::uint32_t of = RMP_TYPE_INT) {
    return literal(p_.integer(v, of));
  }
  /// The values of a type in their order, from `at` on.
  std::uint32_t value(std::uint32_t of, const std::vector<double>& numbers, std::size_t& at) {
    const rmp_code_type t = type(of);
    if (t.kind == RMP_TYPE_INT) return whole(static_cast<std::int64_t>(numbers[at++]));
    if (t.kind == RMP_TYPE_REAL) return real(numbers[at++]);
    std::vector<std::uint32_t> parts;
    if (t.kind == RMP_TYPE_ARRAY)
      for (std::int64_t k = t.lower; k <= t.upper; ++k)
        parts.push_back(value(t.element, numbers, at));
    else
      for (std::uint32_t k = 0; k < t.field_count; ++k)
        parts.push_back(value(p_.fields[t.first_field + k].type, numbers, at));
    return expression(RMP_EXPR_MAKE, of, parts);
  }
  [[nodiscard]] std::size_t slots(std::uint32_t of) const {
    const rmp_code_type& t = type(of);
    if (t.kind == RMP_TYPE_ARRAY)
      return static_cast<std::size_t>(std::int64_t{t.upper} - t.lower + 1) * slots(t.element);
    if (t.kind != RMP_TYPE_RECORD) return 1;
    std::size_t n = 0;
    for (std::uint32_t k = 0; k < t.field_count; ++k) n += slots(p_.fields[t.first_field + k].type);
    return n;
  }
  /// The type of a role that holds so many numbers.
  Result<std::uint32_t> type_of_role(std::uint32_t role, std::size_t numbers) const {
    for (std::uint32_t t = RMP_TYPE_PROCESS + 1; t < p_.types.size(); ++t)
      if (p_.types[t].role == role && slots(t) == numbers) return t;
    return error(ErrorCode::invalid_argument,
                 "the program has no type for a target of " + std::to_string(numbers) + " numbers",
                 "Its cell declares the types of targets.", where(at_));
  }
  static void add(std::vector<double>& to, const PlainPose& p) {
    to.insert(to.end(), p.position.begin(), p.position.end());
    to.insert(to.end(), p.quaternion.begin(), p.quaternion.end());
  }
  Result<std::uint32_t> pose(const PlainPose& x) {
    std::vector<double> numbers;
    add(numbers, x);
    RMP_TRY_ASSIGN(const std::uint32_t t, type_of_role(RMP_ROLE_POSE, numbers.size()));
    std::size_t at = 0;
    return value(t, numbers, at);
  }
  Result<std::uint32_t> target(const Target& x) {
    std::vector<double> numbers;
    const auto append = [&](const auto& v) { numbers.insert(numbers.end(), v.begin(), v.end()); };
    switch (x.role) {
      case RMP_ROLE_POSITION: append(x.pose.position); break;
      case RMP_ROLE_POSE: add(numbers, x.pose); break;
      case RMP_ROLE_MAIN_JOINT: append(x.joints); break;
      case RMP_ROLE_ADD_JOINT: append(x.additional); break;
      case RMP_ROLE_JOINT:
        append(x.joints);
        append(x.additional);
        break;
      default:
        add(numbers, x.pose);
        numbers.push_back(x.status);
        append(x.turns);
        append(x.additional);
        break;
    }
    RMP_TRY_ASSIGN(const std::uint32_t t, type_of_role(x.role, numbers.size()));
    std::size_t at = 0;
    return value(t, numbers, at);
  }
  std::uint32_t condition(const Condition& c) {
    std::vector<std::uint32_t> made;
    for (const ConditionNode& n : c.nodes) {
      if (n.op == RMP_EXPR_LITERAL)
        made.push_back(n.type == RMP_TYPE_REAL ? real(n.real) : whole(n.integer, n.type));
      else if (n.op == RMP_EXPR_SYMBOL)
        made.push_back(expression(RMP_EXPR_SYMBOL, n.type, {}, symbols_.at(n.symbol)));
      else if (n.b == kNone) made.push_back(expression(n.op, n.type, {made[n.a]}));
      else made.push_back(expression(n.op, n.type, {made[n.a], made[n.b]}));
    }
    return made.back();
  }

  // ---- three-address code of them ----
  void emit(std::uint32_t op, const Operand& a, const Operand& b, const Operand& r) {
    p_.instructions.push_back({op, a, b, r, at_});
  }
  Operand temporary(std::uint32_t of) {
    const Operand t{RMP_OPERAND_TEMPORARY, of, temporaries_++};
    most_ = std::max(most_, temporaries_);
    return t;
  }
  static Operand number(std::uint64_t n) {
    return {RMP_OPERAND_NUMBER, 0, static_cast<std::int64_t>(n)};
  }
  static Operand word(std::uint32_t w) { return {RMP_OPERAND_WORD, 0, w}; }
  [[nodiscard]] Operand variable(std::uint32_t s) const {
    return {RMP_OPERAND_VARIABLE, p_.symbols[s].type, s};
  }
  /// Conditions are nested as deep as a source may be, and targets four times.
  Operand computed(std::uint32_t id) {
    const rmp_code_expression e = p_.expressions[id];
    if (e.constant != kNone) return {RMP_OPERAND_CONSTANT, e.type, e.constant};
    if (e.op == RMP_EXPR_SYMBOL) return variable(e.symbol);
    if (e.op == RMP_EXPR_AND || e.op == RMP_EXPR_OR) {
      const Operand t = temporary(RMP_TYPE_BOOL);
      const Operand done{RMP_OPERAND_LABEL, 0, labels_++};
      emit(RMP_OP_COPY, computed(p_.links[e.first]), {}, t);
      emit(e.op == RMP_EXPR_AND ? RMP_OP_JUMP_UNLESS : RMP_OP_JUMP_IF, t, {}, done);
      emit(RMP_OP_COPY, computed(p_.links[e.first + 1]), {}, t);
      emit(RMP_OP_LABEL, {}, {}, done);
      return t;
    }
    std::vector<Operand> all;
    for (std::uint32_t k = 0; k < e.count; ++k) all.push_back(computed(p_.links[e.first + k]));
    const Operand t = temporary(e.type);
    switch (e.op) {
      case RMP_EXPR_MAKE:
        for (const Operand& a : all) emit(RMP_OP_ARGUMENT, a, {}, {});
        emit(RMP_OP_MAKE, {}, number(all.size()), t);
        return t;
      case RMP_EXPR_CONVERT: emit(RMP_OP_CONVERT, all[0], {}, t); return t;
      case RMP_EXPR_NEGATE: emit(RMP_OP_NEGATE, all[0], {}, t); return t;
      case RMP_EXPR_NOT: emit(RMP_OP_NOT, all[0], {}, t); return t;
      case RMP_EXPR_EXOR: emit(RMP_OP_EXOR, all[0], all[1], t); return t;
      default:
        // ADD .. GREATER_EQUAL stand in one order in both.
        emit(RMP_OP_ADD + (e.op - RMP_EXPR_ADD), all[0], all[1], t);
        return t;
    }
  }

  // ---- entries ----
  Result<void> one(const TracedMotion& t, rmp_code_statement& s) {
    const Motion& m = t.motion;
    rmp_code_motion out{};
    out.interpolation = m.interpolation;
    out.is_incremental = m.is_incremental;
    out.until = out.action = kNone;
    out.span = at_;
    std::vector<std::uint32_t> targets;
    for (const Target& x : m.targets) {
      RMP_TRY_ASSIGN(const std::uint32_t e, target(x));
      targets.push_back(e);
    }
    std::vector<rmp_code_attribute> attributes;
    const MotionAttributes& a = m.attributes;
    const MotionAttributes standard;
    const auto attribute = [&](std::uint32_t number, bool differs, auto&& make) {
      if (!differs && !(a.given >> number & 1u)) return;
      attributes.push_back({number, make(), at_});
    };
    const auto number_attribute = [&](std::uint32_t number, double v, double usual) {
      attribute(number, v != usual, [&] { return real(v); });
    };
    number_attribute(RMP_ATTR_SPEED, a.speed, standard.speed);
    number_attribute(RMP_ATTR_SPEED_ORI, a.speed_orientation, standard.speed_orientation);
    number_attribute(RMP_ATTR_ACC, a.acceleration, standard.acceleration);
    number_attribute(RMP_ATTR_TIME, a.time, standard.time);
    number_attribute(RMP_ATTR_C_CP, a.c_cp, standard.c_cp);
    number_attribute(RMP_ATTR_C_SPEED, a.c_speed, standard.c_speed);
    attribute(RMP_ATTR_C_PASS, a.passes, [&] { return whole(a.passes, RMP_TYPE_BOOL); });
    if (a.weaves && (a.wobble_amplitude != standard.wobble_amplitude ||
                     a.wobble_length != standard.wobble_length))
      return error(ErrorCode::unsupported,
                   "WOBBLE uses other values of R_WOBBLE_AMPLITUDE and R_WOBBLE_LENGTH than the "
                   "initial ones, and a flattened program cannot set them",
                   "Leave these variables as they are, or WOBBLE out.");
    attribute(RMP_ATTR_WOBBLE, a.weaves, [&] { return whole(a.weaves, RMP_TYPE_BOOL); });
    if (a.robot_symbol != kNone)
      attributes.push_back(
          {RMP_ATTR_ACT_ROB,
           expression(RMP_EXPR_SYMBOL, p_.symbols[symbols_.at(a.robot_symbol)].type, {},
                      symbols_.at(a.robot_symbol)),
           at_});
    attribute(RMP_ATTR_DEVICE, a.device != standard.device, [&] { return whole(a.device); });
    attribute(RMP_ATTR_ADAX_CONTROL, a.additional_axes != standard.additional_axes,
              [&] { return whole(a.additional_axes); });
    number_attribute(RMP_ATTR_SPEED_PTP, a.speed_ptp, standard.speed_ptp);
    number_attribute(RMP_ATTR_ACC_PTP, a.acceleration_ptp, standard.acceleration_ptp);
    number_attribute(RMP_ATTR_C_PTP, a.c_ptp, standard.c_ptp);
    if (a.tool) {
      RMP_TRY_ASSIGN(const std::uint32_t e, pose(*a.tool));
      attributes.push_back({RMP_ATTR_TOOL, e, at_});
    }
    if (a.frame) {
      RMP_TRY_ASSIGN(const std::uint32_t e, pose(*a.frame));
      attributes.push_back({RMP_ATTR_FRAME, e, at_});
    }
    if (t.until) out.until = condition(*t.until);
    std::vector<Operand> values;
    for (const std::uint32_t e : targets) values.push_back(computed(e));
    for (const rmp_code_attribute& x : attributes) values.push_back(computed(x.value));
    for (std::size_t k = 0; k < targets.size(); ++k) emit(RMP_OP_TARGET, values[k], {}, {});
    for (std::size_t k = 0; k < attributes.size(); ++k)
      emit(RMP_OP_ATTRIBUTE, values[targets.size() + k], word(attributes[k].attribute), {});
    if (out.until != kNone) {
      const Operand past{RMP_OPERAND_LABEL, 0, labels_++};
      emit(RMP_OP_UNTIL, {}, {}, past);
      const Operand c = computed(out.until);
      emit(RMP_OP_UNTIL_TEST, c, {}, {});
      emit(RMP_OP_LABEL, {}, {}, past);
    }
    emit(RMP_OP_MOVE, word(m.interpolation), number(m.is_incremental), {});
    out.first_target = static_cast<std::uint32_t>(p_.links.size());
    out.target_count = static_cast<std::uint32_t>(targets.size());
    p_.links.insert(p_.links.end(), targets.begin(), targets.end());
    out.first_attribute = static_cast<std::uint32_t>(p_.attributes.size());
    out.attribute_count = static_cast<std::uint32_t>(attributes.size());
    p_.attributes.insert(p_.attributes.end(), attributes.begin(), attributes.end());
    s.op = RMP_STMT_MOVE;
    s.motion = static_cast<std::uint32_t>(p_.motions.size());
    p_.motions.push_back(out);
    return {};
  }
  Result<void> one(const TracedWrite& w, rmp_code_statement& s) {
    const std::uint32_t symbol = symbols_.at(w.symbol);
    const std::uint32_t of = p_.symbols[symbol].type;
    s.op = RMP_STMT_ASSIGN;
    s.a = expression(RMP_EXPR_SYMBOL, of, {}, symbol);
    s.b = of == RMP_TYPE_REAL ? real(w.value.real) : whole(w.value.integer, of);
    emit(RMP_OP_COPY, computed(s.b), {}, variable(symbol));
    return {};
  }
  Result<void> one(const TracedWait& w, rmp_code_statement& s) {
    if (!w.condition) {
      s.op = RMP_STMT_WAIT_TIME;
      s.a = real(w.seconds);
      emit(RMP_OP_WAIT_TIME, computed(s.a), {}, {});
      return {};
    }
    s.op = RMP_STMT_WAIT_FOR;
    s.a = condition(*w.condition);
    Operand limit{};
    if (w.seconds >= 0) {
      s.b = real(w.seconds);
      limit = computed(s.b);
    }
    emit(RMP_OP_WAIT_BEGIN, limit, {}, {});
    const Operand again{RMP_OPERAND_LABEL, 0, labels_++};
    emit(RMP_OP_LABEL, {}, {}, again);
    const Operand c = computed(s.a);
    emit(RMP_OP_WAIT_TEST, c, {}, again);
    return {};
  }
  Result<void> one(const TracedText& t, rmp_code_statement& s) {
    const bool ends = !t.text.empty() && t.text.back() == '\n';
    const std::string_view text =
        std::string_view(t.text).substr(0, t.text.size() - (ends ? 1 : 0));
    for (const char c : text)
      if (static_cast<unsigned char>(c) < ' ')
        return error(
            ErrorCode::unsupported,
            "a written text has a control character, code " + std::to_string(static_cast<int>(c)),
            "Write letters and WRITELN only.", where(at_));
    const std::uint32_t symbol = intrinsics_[ends ? 1 : 0];
    s.op = RMP_STMT_CALL;
    std::vector<std::uint32_t> arguments;
    if (!text.empty()) arguments.push_back(literal(p_.text(text)));
    s.a = expression(RMP_EXPR_INTRINSIC, RMP_TYPE_VOID, arguments, symbol);
    for (const std::uint32_t a : arguments) emit(RMP_OP_ARGUMENT, computed(a), {}, {});
    emit(RMP_OP_INTRINSIC, {RMP_OPERAND_INTRINSIC, 0, symbol}, number(arguments.size()), {});
    return {};
  }
  Result<void> one(const TracedPause& t, rmp_code_statement& s) {
    s.op = RMP_STMT_PAUSE;
    Operand message{};
    if (!t.message.empty()) {
      s.a = literal(p_.text(t.message));
      message = computed(s.a);
    }
    emit(RMP_OP_PAUSE, message, {}, {});
    return {};
  }
  Result<void> one(const TracedHalt&, rmp_code_statement& s) {
    s.op = RMP_STMT_HALT;
    emit(RMP_OP_HALT, {}, {}, {});
    return {};
  }

  const Trace& trace_;
  const rmp_code& from_;
  std::unique_ptr<ProgramTables> made_;
  ProgramTables& p_;
  std::map<std::uint32_t, std::uint32_t> symbols_;
  std::vector<std::uint32_t> intrinsics_;
  std::uint32_t temporaries_ = 0, most_ = 0, labels_ = 0;
  rmp_span at_{};
};

}  // namespace

Result<std::unique_ptr<ProgramTables>> flatten(const Trace& trace) {
  if (!trace.program)
    return error(ErrorCode::invalid_argument, "there is no program to flatten", "Trace one first.");
  return Flattening(trace).run();
}

}  // namespace robomosp::program

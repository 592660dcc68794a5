// SPDX-License-Identifier: Apache-2.0
// A run without a world. What a condition asks of unknown inputs stays as an expression; all else
// of it is replaced by its value.
#include "program/trace.h"

#include <algorithm>
#include <cmath>

#include "kernel/letters.h"
#include "program/presets.h"
#include "program/state.h"

namespace robomosp::program {
namespace {}  // namespace

class Tracer final : public World, public Observer {
 public:
  Tracer(Machine& machine, const TraceOptions& options, Trace& out)
      : m_(machine), c_(*machine.code_), options_(options), out_(out) {
    for (const auto& [name, value] : options.inputs) inputs_[text::upper(name)] = value;
  }

  Result<void> run(const Progress* progress) {
    double now = 0;
    for (;;) {
      if (progress && progress->cancelled())
        return error(ErrorCode::cancelled, "the run was cancelled");
      Machine::State& s = m_.own();
      Run(c_, s, this, nullptr, this).run(now);
      const Status& status = s.status;
      if (status.state == RunState::over) return {};
      if (status.state == RunState::fault) {
        const Fault& f = *status.fault;
        std::string where = f.file;
        if (f.span.line)
          where += ":" + std::to_string(f.span.line) + ":" + std::to_string(f.span.column);
        return error(f.message.find("depends on") == std::string::npos ? ErrorCode::invalid_argument
                                                                       : ErrorCode::unsupported,
                     f.message, f.hint, where);
      }
      if (status.state == RunState::busy) continue;
      bool goes_on = false;
      double next = INFINITY;
      rmp_span stands{};
      for (const Wait& w : status.waits) {
        if (w.kind == WaitKind::pause) goes_on = m_.resume_pause(w.process) || goes_on;
        if (w.until) next = std::min(next, *w.until);
        stands = w.span;
      }
      if (goes_on) continue;
      if (!std::isfinite(next)) {
        std::string where;
        if (stands.file < c_.tables().files.count && stands.line)
          where = std::string(row<rmp_code_file>(c_.tables().files, stands.file).name) + ":" +
                  std::to_string(stands.line) + ":" + std::to_string(stands.column);
        return error(ErrorCode::invalid_argument,
                     "the program waits here forever with the present input values",
                     "Give other values, or none.", where);
      }
      now = std::max(now, next);
    }
  }

  // ---- the world ----
  Result<std::optional<SignalValue>> read_signal(const Signal& s) override {
    if (s.is_output)
      if (const auto found = outputs_.find(s.symbol); found != outputs_.end())
        return std::optional(found->second);
    if (const auto found = inputs_.find(text::upper(s.name)); found != inputs_.end())
      return std::optional(found->second);
    return std::optional<SignalValue>();
  }
  Result<void> write_signal(const Signal& s, SignalValue v) override {
    outputs_[s.symbol] = v;
    return add(process_now(), span_now(), TracedWrite{s.symbol, v});
  }
  Result<void> begin_motion(const Motion& m) override {
    if (moving_ != kNone && moving_ != m.process)
      return error(ErrorCode::unsupported,
                   "the processes " + c_.routine_name(moving_) + " and " +
                       c_.routine_name(m.process) + " both move, and their order depends on time",
                   m.attributes.robot_symbol == moving_robot_
                       ? "Run each by itself, or run the program in a world."
                       : "Post a part for each robot (only_robot, --only-robot), or run the "
                         "program in a world.");
    moving_ = m.process;
    moving_robot_ = m.attributes.robot_symbol;
    TracedMotion t;
    t.motion = m;
    t.until = std::exchange(until_, std::nullopt);
    Last& last = last_[m.attributes.robot_symbol];
    if (last.tool != m.attributes.tool) last.pose.reset();
    last.tool = m.attributes.tool;
    for (const Target& target : m.targets) {
      std::optional<PlainPose> pose;
      const bool is_place = target.role == RMP_ROLE_POSE || target.role == RMP_ROLE_ROBTARGET ||
                            target.role == RMP_ROLE_POSITION;
      PlainPose given = target.pose;
      if (target.role == RMP_ROLE_POSITION) given.quaternion = {1, 0, 0, 0};
      if (is_place && m.is_incremental) {
        if (last.pose) {
          if (m.attributes.frame) {
            // The same step, in the axes of the frame.
            PlainPose f = *m.attributes.frame;
            f.position = {0, 0, 0};
            given = compose_poses(compose_poses(f, given), inverse_pose(f));
          }
          PlainPose p = *last.pose;
          for (std::size_t k = 0; k < 3; ++k) p.position[k] += given.position[k];
          compose_orientations(given.quaternion.data(), last.pose->quaternion.data(),
                               p.quaternion.data());
          pose = p;
        }
      } else if (is_place) {
        if (m.attributes.frame) given = compose_poses(*m.attributes.frame, given);
        if (target.role != RMP_ROLE_POSITION) {
          pose = given;
        } else if (last.pose) {
          given.quaternion = last.pose->quaternion;
          pose = given;
        }
      } else if (target.role == RMP_ROLE_ADD_JOINT) {
        pose = last.pose;
      }
      t.absolute.push_back(pose);
      // On its way CIRCLE is at no target's end; what counts is where it ends.
      last.pose = pose;
    }
    if (t.until) last.pose.reset();
    return add(m.process, m.span, std::move(t));
  }
  Result<MotionState> motion_state(std::uint64_t) override { return MotionState::done; }
  Result<void> abort_motion(std::uint64_t, AbortReason) override { return {}; }
  Result<void> hold_motion(std::uint64_t) override { return {}; }
  Result<void> resume_motion(std::uint64_t) override { return {}; }
  Result<Target> robot_state(std::uint32_t, std::uint32_t) override { return needs_robot(); }
  Result<PlainPose> robot_flange(std::uint32_t, std::uint32_t) override { return needs_robot(); }
  Result<double> robot_speed(std::uint32_t, std::uint32_t) override { return needs_robot(); }
  Result<Target> forward(const Target&, std::uint32_t) override { return needs_robot(); }
  Result<Target> inverse(const Target&, std::uint32_t) override { return needs_robot(); }
  Result<void> write_text(std::uint32_t process, std::string_view text) override {
    // Pieces of one line are one text, so that a line stays one whoever wrote it.
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      const std::string_view piece =
          text.substr(0, end == std::string_view::npos ? text.size() : end + 1);
      text.remove_prefix(piece.size());
      if (!out_.entries.empty() && out_.entries.back().process == process)
        if (auto* last = std::get_if<TracedText>(&out_.entries.back().what);
            last && last->text.back() != '\n') {
          if (last->text.size() + piece.size() > 1'000'000)
            return error(ErrorCode::unsupported, "a line of text has more than 1000000 characters");
          last->text += piece;
          continue;
        }
      RMP_TRY(add(process, span_now(), TracedText{std::string(piece)}));
    }
    return {};
  }
  Result<std::optional<std::string>> read_line(std::uint32_t) override {
    return error(ErrorCode::unsupported, "the flow depends on operator input",
                 "Replace READ with values to run the program without a world.");
  }
  Result<void> pause(std::uint32_t process, std::string_view message) override {
    return add(process, span_now(), TracedPause{std::string(message)});
  }
  Result<std::string> read_file(std::string_view name) override {
    return error(ErrorCode::unsupported,
                 "the flow depends on the file " + std::string(name) +
                     ", but a run without a world reads no files",
                 "Put its values into the program or into a data list.");
  }
  Result<void> write_file(std::string_view name, std::string_view, bool) override {
    return error(
        ErrorCode::unsupported,
        "the file " + std::string(name) + " is written, but a run without a world has no files",
        "Use WRITE without a file.");
  }

  // ---- what the machine tells ----
  Result<bool> unknown_wait(std::uint32_t process, const WaitInfo& w, double timeout) override {
    const Process* p = of(process);
    const std::uint32_t routine = p->frames.back().routine;
    const auto& statements = statements_of(routine);
    if (w.order >= statements.waits.size()) return false;
    RMP_TRY_ASSIGN(auto condition, partial(*p, statements.waits[w.order]));
    TracedWait t;
    t.seconds = timeout;
    t.condition = std::move(condition);
    RMP_TRY(add(process, c_.instruction(w.begin).span, std::move(t)));
    return true;
  }
  Result<void> waits_for_time(std::uint32_t process, double seconds, const rmp_span& s) override {
    return add(process, s, TracedWait{seconds, std::nullopt});
  }
  Result<void> halts(std::uint32_t process, const rmp_span& s) override {
    return add(process, s, TracedHalt{});
  }
  Result<void> moves(std::uint32_t process, const MoveInfo& m) override {
    until_.reset();
    if (m.until == kNone) return {};
    const Process* p = of(process);
    const auto& statements = statements_of(p->frames.back().routine);
    if (m.order >= statements.moves.size() || statements.moves[m.order] == kNone)
      return error(ErrorCode::unsupported,
                   "the flow depends on a condition of UNTIL, and this program has no statements",
                   "Compile it from its source.");
    RMP_TRY_ASSIGN(Condition c, partial(*p, statements.moves[m.order]));
    const ConditionNode& whole = c.nodes.back();
    if (whole.op == RMP_EXPR_LITERAL) {
      if (!whole.integer) return {};  // nothing can change it: nothing else runs meanwhile
      return error(
          ErrorCode::unsupported,
          "the condition of UNTIL holds before the motion begins, so its end depends on the robot",
          "Leave the motion out, or the condition.");
    }
    if (m.action != kNone)
      return error(ErrorCode::unsupported,
                   "the flow depends on the condition of UNTIL, after which " +
                       c_.routine_name(m.action) + " is called",
                   "Give values for its inputs, or test them after the motion.");
    until_ = std::move(c);
    return {};
  }

 private:
  struct Last {
    std::optional<PlainPose> pose, tool;
  };
  struct Statements {
    std::vector<std::uint32_t> waits, moves;  ///< conditions, expressions
  };
  [[nodiscard]] static Error needs_robot() {
    return error(ErrorCode::unsupported, "the flow depends on the robot's state or kinematics",
                 "Run the program in a world that has the robot.");
  }
  [[nodiscard]] const Process* of(std::uint32_t routine) const {
    for (const Process& p : m_.state_->processes)
      if (p.routine == routine) return &p;
    return nullptr;
  }
  // The process that runs is the only one whose statement asks the world.
  void note(std::uint32_t process, const rmp_span& span) {
    process_ = process;
    span_ = span;
  }
  [[nodiscard]] std::uint32_t process_now() const { return process_; }
  [[nodiscard]] rmp_span span_now() const { return span_; }
  void running(std::uint32_t process, const rmp_span& span) override { note(process, span); }

  Result<void> add(std::uint32_t process, const rmp_span& span, decltype(TraceEntry::what) what) {
    if (out_.entries.size() >= options_.most_entries)
      return error(ErrorCode::unsupported,
                   "the program does more than " + std::to_string(options_.most_entries) +
                       " actions in a row",
                   "Run an endless program in a world.");
    out_.entries.push_back({process, span, std::move(what)});
    return {};
  }

  /// Conditions of WAIT FOR and UNTIL of a routine, in the order in which code has them.
  const Statements& statements_of(std::uint32_t routine) {
    const auto [it, is_new] = statements_.try_emplace(routine);
    if (!is_new) return it->second;
    const rmp_code& t = c_.tables();
    std::vector<std::uint32_t> work;
    if (c_.routine(routine).body < t.statements.count) work.push_back(c_.routine(routine).body);
    std::size_t steps = 0;
    while (!work.empty() && steps++ <= 2 * std::size_t{t.statements.count}) {
      const std::uint32_t id = work.back();
      work.pop_back();
      const auto& s = row<rmp_code_statement>(t.statements, id);
      if (s.op == RMP_STMT_WAIT_FOR) it->second.waits.push_back(s.a);
      if (s.op == RMP_STMT_MOVE)
        it->second.moves.push_back(
            s.motion < t.motions.count ? row<rmp_code_motion>(t.motions, s.motion).until : kNone);
      if (s.next < t.statements.count) work.push_back(s.next);
      if (s.body < t.statements.count) work.push_back(s.body);
    }
    return it->second;
  }

  // ---- partial evaluation ----
  struct Part {
    bool is_known = true;
    std::uint32_t type = RMP_TYPE_VOID;
    std::int64_t integer = 0;
    double real = 0;
    std::string text;
    std::uint32_t node = kNone;
    [[nodiscard]] double number() const {
      return type == RMP_TYPE_REAL ? real : static_cast<double>(integer);
    }
  };
  Result<Condition> partial(const Process& p, std::uint32_t e) {
    Condition c;
    now_ = &p;
    RMP_TRY_ASSIGN(Part whole, part(c, e, 0));
    node_of(c, whole);
    // Operands that are no longer asked for are left out.
    Condition used;
    std::vector<std::uint32_t> to(c.nodes.size(), kNone);
    std::vector<bool> is_used(c.nodes.size(), false);
    is_used[whole.node] = true;
    for (std::size_t k = whole.node + 1; k-- > 0;) {
      if (!is_used[k]) continue;
      for (const std::uint32_t o : {c.nodes[k].a, c.nodes[k].b})
        if (o != kNone) is_used[o] = true;
    }
    for (std::size_t k = 0; k <= whole.node; ++k) {
      if (!is_used[k]) continue;
      ConditionNode n = c.nodes[k];
      if (n.a != kNone) n.a = to[n.a];
      if (n.b != kNone) n.b = to[n.b];
      to[k] = static_cast<std::uint32_t>(used.nodes.size());
      used.nodes.push_back(n);
    }
    return used;
  }
  static void node_of(Condition& c, Part& p) {
    if (!p.is_known) return;
    ConditionNode n;
    n.op = RMP_EXPR_LITERAL;
    n.type = p.type;
    n.integer = p.integer;
    n.real = p.real;
    p.node = static_cast<std::uint32_t>(c.nodes.size());
    c.nodes.push_back(n);
  }
  [[nodiscard]] Error depends(const std::string& what) const {
    return error(ErrorCode::unsupported, "the flow depends on " + what,
                 "Give values for the inputs of this condition.");
  }
  /// Where a variable, field or element stands; nullptr = it is no such thing.
  Result<const Slot*> place(Condition& c, std::uint32_t e, int depth) {
    const auto& x = row<rmp_code_expression>(c_.tables().expressions, e);
    const auto operand = [&](std::uint32_t k) {
      return row<std::uint32_t>(c_.tables().links, x.first + k);
    };
    Run run(c_, *m_.state_, nullptr, nullptr, nullptr);
    auto& p = const_cast<Process&>(*now_);
    const Slot* nothing = nullptr;
    if (depth > 600) return depends("a condition nested too deeply");
    if (x.op == RMP_EXPR_SYMBOL) {
      const Place& v = c_.place_of[x.symbol];
      if (v.offset == kNone) return nothing;
      if (v.space == kGlobal) return m_.state_->globals.data() + v.offset;
      if (v.space == kConstant) return c_.constants.data() + v.offset;
      const std::size_t base = p.frames.back().base + v.offset;
      if (!v.is_reference) return static_cast<const Slot*>(p.stack.data() + base);
      return static_cast<const Slot*>(run.at(p, p.stack[base].bits, c_.types[v.type].slots, false));
    }
    if (x.op == RMP_EXPR_FIELD) {
      RMP_TRY_ASSIGN(const Slot* of, place(c, operand(0), depth + 1));
      if (!of) return nothing;
      const auto& t = c_.type(row<rmp_code_expression>(c_.tables().expressions, operand(0)).type);
      for (std::uint32_t k = 0; k < x.symbol && k < t.field_count; ++k)
        of += c_.types[c_.field(t.first_field + k).type].slots;
      return of;
    }
    if (x.op == RMP_EXPR_INDEX) {
      const std::uint32_t type = row<rmp_code_expression>(c_.tables().expressions, operand(0)).type;
      RMP_TRY_ASSIGN(const Slot* of, place(c, operand(0), depth + 1));
      RMP_TRY_ASSIGN(const Part i, part(c, operand(1), depth + 1));
      if (!of) return nothing;
      if (!i.is_known) return depends("an index that depends on an input");
      const TypeInfo& t = c_.types[type];
      std::int64_t low = 1, count = 0;
      if (t.kind == RMP_TYPE_ARRAY) {
        low = t.lower;
        count = t.length;
      } else if (t.kind == RMP_TYPE_LIST) {
        const Heap::List* l = run.list_of(*of);
        count =
            l && t.element_slots ? static_cast<std::int64_t>(l->slots.size() / t.element_slots) : 0;
        of = l ? l->slots.data() : of;
      } else {
        return nothing;
      }
      if (i.integer < low || i.integer >= low + count)
        return error(ErrorCode::invalid_argument, "the index " + std::to_string(i.integer) +
                                                      " is outside " + std::to_string(low) + ".." +
                                                      std::to_string(low + count - 1));
      return of + static_cast<std::uint64_t>(i.integer - low) * t.element_slots;
    }
    return nothing;
  }
  Part known_int(std::uint32_t type, std::int64_t v) {
    Part p;
    p.type = type;
    p.integer = v;
    return p;
  }
  Result<Part> part(Condition& c, std::uint32_t e, int depth) {
    if (depth > 600) return depends("a condition nested too deeply");
    const rmp_code& t = c_.tables();
    const auto& x = row<rmp_code_expression>(t.expressions, e);
    const auto operand = [&](std::uint32_t k) { return row<std::uint32_t>(t.links, x.first + k); };
    Part out;
    out.type = x.type;
    if (x.constant != kNone) {
      const auto& k = row<rmp_code_constant>(t.constants, x.constant);
      out.integer = k.integer;
      out.real = k.real;
      if (k.kind == RMP_CONSTANT_TEXT) out.text.assign(k.text, k.text_size);
      return out;
    }
    const auto add_node = [&](std::uint32_t op, std::uint32_t a, std::uint32_t b) {
      ConditionNode n;
      n.op = op;
      n.type = x.type;
      n.a = a;
      n.b = b;
      out.is_known = false;
      out.node = static_cast<std::uint32_t>(c.nodes.size());
      c.nodes.push_back(n);
      return out;
    };
    switch (x.op) {
      case RMP_EXPR_SYMBOL: {
        const auto& s = c_.symbol(x.symbol);
        if (s.kind == RMP_SYMBOL_INPUT || s.kind == RMP_SYMBOL_OUTPUT) {
          RMP_TRY_ASSIGN(const auto v, read_signal(c_.signal(x.symbol)));
          if (v) {
            out.integer = s.type == RMP_TYPE_BOOL ? v->integer != 0 : v->integer;
            out.real = v->real;
            return out;
          }
          add_node(RMP_EXPR_SYMBOL, kNone, kNone);
          c.nodes.back().symbol = x.symbol;
          return out;
        }
        [[fallthrough]];
      }
      case RMP_EXPR_FIELD:
      case RMP_EXPR_INDEX: {
        RMP_TRY_ASSIGN(const Slot* s, place(c, e, depth + 1));
        if (!s || x.type > RMP_TYPE_STRING) return depends("a value unknown here");
        if (x.type == RMP_TYPE_REAL) out.real = s->real();
        else if (x.type == RMP_TYPE_STRING)
          out.text = std::string(Run(c_, *m_.state_, nullptr, nullptr, nullptr).text_of(*s));
        else out.integer = s->integer();
        return out;
      }
      case RMP_EXPR_CONVERT: {
        RMP_TRY_ASSIGN(const Part a, part(c, operand(0), depth + 1));
        if (!a.is_known) return add_node(RMP_EXPR_CONVERT, a.node, kNone);
        out.integer = a.integer;
        out.real = a.number();
        out.text = a.type == RMP_TYPE_CHAR ? std::string(1, static_cast<char>(a.integer)) : a.text;
        return out;
      }
      case RMP_EXPR_NOT:
      case RMP_EXPR_NEGATE: {
        RMP_TRY_ASSIGN(const Part a, part(c, operand(0), depth + 1));
        if (!a.is_known) return add_node(x.op, a.node, kNone);
        out.integer = x.op == RMP_EXPR_NOT ? !a.integer : -a.integer;
        out.real = -a.real;
        return out;
      }
      case RMP_EXPR_AND:
      case RMP_EXPR_OR: {
        const bool decides = x.op == RMP_EXPR_OR;
        RMP_TRY_ASSIGN(Part a, part(c, operand(0), depth + 1));
        if (a.is_known)
          return (a.integer != 0) == decides ? Result<Part>(a) : part(c, operand(1), depth + 1);
        RMP_TRY_ASSIGN(Part b, part(c, operand(1), depth + 1));
        if (b.is_known) return (b.integer != 0) == decides ? b : a;
        return add_node(x.op, a.node, b.node);
      }
      case RMP_EXPR_INTRINSIC: {
        const auto f = number_function(c_.symbol(x.symbol).name);
        if (!f || x.count > 2)
          return depends(std::string(c_.symbol(x.symbol).name) + " in a condition with inputs");
        double v[2] = {0, 0};
        for (std::uint32_t k = 0; k < x.count; ++k) {
          RMP_TRY_ASSIGN(const Part a, part(c, operand(k), depth + 1));
          if (!a.is_known) return depends(std::string(c_.symbol(x.symbol).name) + " of an input");
          v[k] = a.number();
        }
        const auto y = number_value(*f, std::span(v, x.count));
        if (!y) return depends(std::string(c_.symbol(x.symbol).name) + ", which has no value here");
        out.real = *y;
        out.integer = std::fabs(*y) < 1e18 ? static_cast<std::int64_t>(*y) : 0;
        return out;
      }
      case RMP_EXPR_CALL:
        return depends("the function " + std::string(c_.symbol(x.symbol).name) +
                       " in a condition with inputs");
      default: break;
    }
    if (x.op < RMP_EXPR_ADD || x.op > RMP_EXPR_EXOR) return depends("a value unknown here");
    RMP_TRY_ASSIGN(Part a, part(c, operand(0), depth + 1));
    RMP_TRY_ASSIGN(Part b, part(c, operand(1), depth + 1));
    if (!a.is_known || !b.is_known) {
      if ((a.is_known && a.type == RMP_TYPE_STRING) || (b.is_known && b.type == RMP_TYPE_STRING))
        return depends("a comparison of strings");
      node_of(c, a);
      node_of(c, b);
      return add_node(x.op, a.node, b.node);
    }
    if (x.op == RMP_EXPR_EXOR) return known_int(x.type, (a.integer != 0) != (b.integer != 0));
    if (x.op >= RMP_EXPR_EQUAL) {
      int order = 0;
      if (a.type == RMP_TYPE_STRING) order = a.text.compare(b.text);
      else if (a.type == RMP_TYPE_REAL) order = a.real < b.real ? -1 : a.real > b.real ? 1 : 0;
      else order = a.integer < b.integer ? -1 : a.integer > b.integer ? 1 : 0;
      const bool v = x.op == RMP_EXPR_EQUAL        ? order == 0
                     : x.op == RMP_EXPR_NOT_EQUAL  ? order != 0
                     : x.op == RMP_EXPR_LESS       ? order < 0
                     : x.op == RMP_EXPR_LESS_EQUAL ? order <= 0
                     : x.op == RMP_EXPR_GREATER    ? order > 0
                                                   : order >= 0;
      return known_int(x.type, v);
    }
    const auto beyond = [&] {
      return error(
          ErrorCode::invalid_argument,
          "a value of this condition is outside the range of its type, or it divides by zero");
    };
    if (x.type == RMP_TYPE_REAL) {
      if (x.op == RMP_EXPR_DIVIDE && b.real == 0) return beyond();
      out.real = x.op == RMP_EXPR_ADD        ? a.real + b.real
                 : x.op == RMP_EXPR_SUBTRACT ? a.real - b.real
                 : x.op == RMP_EXPR_MULTIPLY ? a.real * b.real
                                             : a.real / b.real;
      if (!std::isfinite(out.real)) return beyond();
      return out;
    }
    if ((x.op == RMP_EXPR_DIV || x.op == RMP_EXPR_MOD) && b.integer == 0) return beyond();
    out.integer = x.op == RMP_EXPR_ADD        ? a.integer + b.integer
                  : x.op == RMP_EXPR_SUBTRACT ? a.integer - b.integer
                  : x.op == RMP_EXPR_MULTIPLY ? a.integer * b.integer
                  : x.op == RMP_EXPR_DIV      ? a.integer / b.integer
                                              : a.integer % b.integer;
    if (out.integer > 2147483647 || out.integer < -2147483648LL) return beyond();
    return out;
  }

  Machine& m_;
  const Machine::Code& c_;
  const TraceOptions& options_;
  Trace& out_;
  std::map<std::string, SignalValue> inputs_;
  std::map<std::uint32_t, SignalValue> outputs_;
  std::map<std::uint32_t, Last> last_;
  std::map<std::uint32_t, Statements> statements_;
  std::optional<Condition> until_;
  std::uint32_t moving_ = kNone, moving_robot_ = kNone;
  const Process* now_ = nullptr;
  std::uint32_t process_ = 0;
  rmp_span span_{};
};

std::size_t Trace::motion_count() const {
  std::size_t n = 0;
  for (const TraceEntry& e : entries) n += std::holds_alternative<TracedMotion>(e.what);
  return n;
}

std::string Condition::text(const rmp_code& code) const {
  struct Word {
    const char* text;
    int rank;
  };
  const auto word = [](std::uint32_t op) -> Word {
    switch (op) {
      case RMP_EXPR_OR: return {" OR ", 1};
      case RMP_EXPR_EXOR: return {" EXOR ", 1};
      case RMP_EXPR_AND: return {" AND ", 2};
      case RMP_EXPR_NOT: return {"NOT ", 3};
      case RMP_EXPR_EQUAL: return {" = ", 4};
      case RMP_EXPR_NOT_EQUAL: return {" <> ", 4};
      case RMP_EXPR_LESS: return {" < ", 4};
      case RMP_EXPR_LESS_EQUAL: return {" <= ", 4};
      case RMP_EXPR_GREATER: return {" > ", 4};
      case RMP_EXPR_GREATER_EQUAL: return {" >= ", 4};
      case RMP_EXPR_ADD: return {" + ", 5};
      case RMP_EXPR_SUBTRACT: return {" - ", 5};
      case RMP_EXPR_MULTIPLY: return {" * ", 6};
      case RMP_EXPR_DIVIDE: return {" / ", 6};
      case RMP_EXPR_DIV: return {" DIV ", 6};
      case RMP_EXPR_MOD: return {" MOD ", 6};
      case RMP_EXPR_NEGATE: return {"-", 7};
      default: return {"", 9};
    }
  };
  std::vector<std::pair<std::string, int>> made;
  for (const ConditionNode& n : nodes) {
    const Word w = word(n.op);
    const auto within = [&](std::uint32_t k, int least) {
      return made[k].second < least ? "(" + made[k].first + ")" : made[k].first;
    };
    if (n.op == RMP_EXPR_LITERAL) {
      std::string s;
      if (n.type == RMP_TYPE_REAL) s = real_literal(n.real);
      else if (n.type == RMP_TYPE_BOOL) s = n.integer ? "TRUE" : "FALSE";
      else s = std::to_string(n.integer);
      made.emplace_back(s, s[0] == '-' ? 7 : 9);
    } else if (n.op == RMP_EXPR_SYMBOL) {
      made.emplace_back(row<rmp_code_symbol>(code.symbols, n.symbol).name, 9);
    } else if (n.op == RMP_EXPR_CONVERT) {
      made.push_back(made[n.a]);
    } else if (n.b == kNone) {
      made.emplace_back(w.text + within(n.a, w.rank + 1), w.rank);
    } else {
      // A comparison holds no other one, and what is on the right binds tighter.
      made.emplace_back(within(n.a, w.rank == 4 ? 5 : w.rank) + w.text + within(n.b, w.rank + 1),
                        w.rank);
    }
  }
  return made.empty() ? std::string() : made.back().first;
}

Result<Trace> trace(std::shared_ptr<const CompiledProgram> program, const TraceOptions& options,
                    const Progress* progress) {
  Limits limits = options.limits;
  limits.most_instructions = options.most_instructions;
  Trace out;
  out.program = program;
  RMP_TRY_ASSIGN(Machine m, Machine::load(std::move(program), limits));
  for (const auto& [name, value] : options.inputs) {
    bool is_known = false;
    for (std::uint32_t s = 0; s < m.code().symbols.count; ++s) {
      const auto& x = row<rmp_code_symbol>(m.code().symbols, s);
      const bool is_it = (x.kind == RMP_SYMBOL_INPUT || x.kind == RMP_SYMBOL_OUTPUT) &&
                         text::upper(x.name) == text::upper(name);
      if (is_it) RMP_TRY(fits_signal(x, value));
      is_known = is_known || is_it;
    }
    if (!is_known)
      return error(ErrorCode::unknown_name, "the program has no signal " + name,
                   "Values can be given for declared inputs only.");
  }
  RMP_TRY(Tracer(m, options, out).run(progress));
  return out;
}

}  // namespace robomosp::program

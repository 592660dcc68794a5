// SPDX-License-Identifier: Apache-2.0
// Statements, motions.
#include <algorithm>
#include <array>
#include <iterator>

#include "checker.h"

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;

struct AttributeRow {
  std::string_view name;
  Id type;        ///< kNone: a pose (TOOL, FRAME) or a robot (ACT_ROB)
  bool in_ptp;    ///< has an effect on motions of the joints
  bool in_paths;  ///< on motions along a path
};
constexpr std::array<AttributeRow, 16> kAttributeRows{{
    {"SPEED", RMP_TYPE_REAL, false, true},
    {"SPEED_ORI", RMP_TYPE_REAL, false, true},
    {"ACC", RMP_TYPE_REAL, true, true},
    {"TIME", RMP_TYPE_REAL, true, true},
    {"C_CP", RMP_TYPE_REAL, false, true},
    {"C_SPEED", RMP_TYPE_REAL, false, true},
    {"C_PASS", RMP_TYPE_BOOL, true, true},
    {"WOBBLE", RMP_TYPE_BOOL, false, true},
    {"ACT_ROB", kNone, true, true},
    {"DEVICE", RMP_TYPE_INT, true, true},
    {"ADAX_CONTROL", RMP_TYPE_INT, true, true},
    {"SPEED_PTP", RMP_TYPE_REAL, true, false},
    {"ACC_PTP", RMP_TYPE_REAL, true, false},
    {"C_PTP", RMP_TYPE_REAL, true, false},
    {"TOOL", kNone, true, true},
    {"FRAME", kNone, true, true},
}};

}  // namespace

Id Checker::add_statement(std::uint32_t op, const Node& n) {
  rmp_code_statement s{};
  s.op = op;
  s.next = s.a = s.b = s.c = s.body = s.symbol = s.motion = kNone;
  s.span = span(n);
  out_.statements.push_back(s);
  return static_cast<Id>(out_.statements.size() - 1);
}

Id Checker::block(Id n) {
  if (n == kNone) return kNone;
  blocks_.push_back(next_block_++);
  Id first = kNone, last = kNone;
  for (Id c = at(n).first; c != kNone && !faults_.is_full(); c = at(c).next) {
    const Id s = statement(at(c));
    if (s == kNone) continue;
    if (last == kNone) first = s;
    else out_.statements[last].next = s;
    last = s;
  }
  blocks_.pop_back();
  return first;
}

Id Checker::boolean(Id n, const std::string& what) {
  return convert(expression(n), RMP_TYPE_BOOL, at(n), what);
}
Id Checker::number(Id n, const std::string& what) {
  return convert(expression(n), RMP_TYPE_INT, at(n), what);
}

/// Whether an expression is a place that may be written to.
bool Checker::check_place(Id e, const Node& where, const std::string& what) {
  Id root = e;
  bool has_index_of_text = false;
  while (out_.expressions[root].op == RMP_EXPR_FIELD ||
         out_.expressions[root].op == RMP_EXPR_INDEX) {
    const Id of = out_.links[out_.expressions[root].first];
    has_index_of_text = has_index_of_text || type_of(of) == RMP_TYPE_STRING;
    root = of;
  }
  const rmp_code_expression& x = out_.expressions[root];
  if (x.type == kBad) return false;
  if (x.op != RMP_EXPR_SYMBOL) {
    fail(where, what + " needs a variable, but this is a value");
    return false;
  }
  const rmp_code_symbol& s = out_.symbols[x.symbol];
  switch (s.kind) {
    case RMP_SYMBOL_CONSTANT:
      fail(where, std::string(s.name) + " is a constant and cannot be assigned");
      return false;
    case RMP_SYMBOL_INPUT:
      fail(where, std::string(s.name) + " is an input, which can only be read");
      return false;
    case RMP_SYMBOL_PARAMETER:
      if (s.mode != RMP_MODE_IN) return true;
      fail(where, std::string(s.name) + " is an IN parameter, which can only be read",
           "Make it INOUT, or copy it to a variable.");
      return false;
    case RMP_SYMBOL_VARIABLE:
    case RMP_SYMBOL_ROBOT:
    case RMP_SYMBOL_OUTPUT: return true;
    default: fail(where, what + " needs a variable, but this is not one"); return false;
  }
}

Id Checker::routine_named(const Node& n, std::uint32_t kind, const char* what) {
  if (n.name == kNone) return kNone;
  const Id s = lookup(n.name);
  use(n, s);
  if (s == kNone) {
    fail_name(n, "there is no name " + written(n), suggestion(n.name));
    return kNone;
  }
  const rmp_code_symbol& x = out_.symbols[s];
  if (x.kind == RMP_SYMBOL_ROUTINE && out_.routines[x.routine].kind == kind) return s;
  fail_name(n, written(n) + " is no " + what);
  return kNone;
}

void Checker::resolve_gotos() {
  for (const Goto& g : gotos_) {
    const auto found = labels_.find(g.at.name);
    if (found == labels_.end()) {
      fail_name(g.at, "there is no label " + written(g.at) + " in this routine");
      continue;
    }
    const auto& [symbol, its_block] = found->second;
    use(g.at, symbol);
    if (std::find(g.blocks.begin(), g.blocks.end(), its_block) == g.blocks.end())
      fail_name(g.at, "GOTO leads into a statement from outside",
                "A label can be reached only from its block and from blocks inside it.");
    out_.statements[g.statement].symbol = symbol;
  }
  gotos_.clear();
}

/// Whether the end of a block is not reached.
bool Checker::always_returns(Id n) const {
  Id last = kNone;
  for (Id c = at(n).first; c != kNone; c = at(c).next) last = c;
  if (last == kNone) return false;
  const Node& x = at(last);
  switch (x.kind) {
    case N::return_:
    case N::halt:
    case N::goto_: return true;
    case N::loop: return true;  // EXIT is rare enough in functions; it is no error
    case N::if_:
    case N::case_: {
      bool has_else = false;
      for (Id a = x.kind == N::case_ ? at(x.first).next : x.first; a != kNone; a = at(a).next) {
        has_else = has_else || at(a).flag;
        const Id body = at(a).flag ? at(a).first : at(at(a).first).next;
        if (body == kNone || !always_returns(body)) return false;
      }
      return has_else;
    }
    default: return false;
  }
}

/// R_ACT_ROB := robot; it chooses, and copies nothing. kNone = it is another assignment.
Id Checker::robot_choice(const Node& n) {
  const Node& to = at(n.first);
  if (to.kind != N::name || to.name == kNone || names_.upper(to.name) != "R_ACT_ROB") return kNone;
  const Id symbol = lookup(to.name);
  if (symbol == kNone || out_.symbols[symbol].kind != RMP_SYMBOL_INTRINSIC) return kNone;
  use(to, symbol);
  const Id robot = expression(to.next);
  const Id t = type_of(robot);
  if (t != kBad && !is_robot(robot))
    fail(at(to.next), "R_ACT_ROB needs the name of a robot, but this is " + shown(t),
         "Such as: R_ACT_ROB := arm; where the cell has ROBOT arm := ...;");
  const Id s = add_statement(RMP_STMT_CALL, n);
  const Id call = add(RMP_EXPR_INTRINSIC, RMP_TYPE_VOID, span(n), {robot}, symbol);
  out_.statements[s].a = call;
  return s;
}

/// Values that nothing looks at: of system variables, and of fields of robots.
void Checker::warn_without_effect(Id place, const Node& n) {
  const rmp_code_expression& x = out_.expressions[place];
  if (x.op == RMP_EXPR_SYMBOL) {
    const rmp_code_symbol& s = out_.symbols[x.symbol];
    const std::string_view name = s.name;
    if (out_.scopes[s.scope].kind != RMP_SCOPE_PREDEFINED) return;
    if (name == "R_SCALE_FORW" || name == "R_SCALE_BACK" || name == "R_DISTANCE_FORW" ||
        name == "R_DISTANCE_BACK")
      warn(at(n.first), std::string(name) + " has no effect on motions",
           "Its meaning is unknown. Speeds are set by R_SPEED, R_SPEED_PTP and R_ACC.");
    return;
  }
  Id root = place;
  while (out_.expressions[root].op == RMP_EXPR_FIELD || out_.expressions[root].op == RMP_EXPR_INDEX)
    root = out_.links[out_.expressions[root].first];
  if (root == place || !is_robot(root)) return;
  Id inner = place;
  while (out_.links[out_.expressions[inner].first] != root)
    inner = out_.links[out_.expressions[inner].first];
  if (out_.expressions[inner].op != RMP_EXPR_FIELD) return;
  const rmp_code_type& t = out_.types[type_of(root)];
  const std::string field = upper(out_.fields[t.first_field + out_.expressions[inner].symbol].name);
  if (field == "R_JOINT_ACT" || field == "R_ROBTARGET_ACT" || field == "R_SPEED_ACT")
    warn(at(n.first), field + " is the state of the robot, and an assigned value is lost",
         "Move it with a motion.");
  else if (field.substr(0, 2) == "R_" && field != "R_DEVICES")
    warn(at(n.first), "the field " + field + " of a robot has no effect on its motions",
         "The system variables apply: R_SPEED, R_SPEED_ORI, R_ACC, R_C_CP, R_C_SPEED, R_SPEED_PTP, "
         "R_ACC_PTP and R_C_PTP.");
}

Id Checker::statement(const Node& n) {
  switch (n.kind) {
    case N::assign: {
      if (const Id chosen = robot_choice(n); chosen != kNone) return chosen;
      const Id place = expression(n.first);
      const Id t = type_of(place);
      const Id value = component(at(n.first).next, t, "this variable");
      if (t == kBad || !check_place(place, at(n.first), "an assignment") || type_of(value) == kBad)
        return kNone;
      if (t == RMP_TYPE_FILE || t == RMP_TYPE_TEXT || t == RMP_TYPE_SEMAPHORE ||
          t == RMP_TYPE_PROCESS) {
        fail(n, "a " + shown(t) + " cannot be assigned");
        return kNone;
      }
      warn_without_effect(place, n);
      const Id s = add_statement(RMP_STMT_ASSIGN, n);
      out_.statements[s].a = place;
      out_.statements[s].b = value;
      return s;
    }
    case N::call_stmt: {
      const Node& what = at(n.first);
      const Id e = expression(n.first);
      if (type_of(e) == kBad) return kNone;
      const std::uint32_t op = out_.expressions[e].op;
      if (op != RMP_EXPR_CALL && op != RMP_EXPR_INTRINSIC) {
        fail(what, written(what) + " is not a procedure, and this has no effect",
             "Assign a variable with \":=\".");
        return kNone;
      }
      if (type_of(e) != RMP_TYPE_VOID) {
        fail(what, "the result of " + written(what) + " is not used", "Assign it to a variable.");
        return kNone;
      }
      const Id s = add_statement(RMP_STMT_CALL, n);
      out_.statements[s].a = e;
      return s;
    }
    case N::if_: {
      const Id s = add_statement(RMP_STMT_IF, n);
      Id last = kNone;
      for (Id a = n.first; a != kNone; a = at(a).next) {
        const Id arm = add_statement(RMP_STMT_ARM, at(a));
        if (!at(a).flag) {
          const Id c = boolean(at(a).first, "IF");
          out_.statements[arm].a = c;
        }
        const Id body = block(at(a).flag ? at(a).first : at(at(a).first).next);
        out_.statements[arm].body = body;
        if (last == kNone) out_.statements[s].body = arm;
        else out_.statements[last].next = arm;
        last = arm;
      }
      return s;
    }
    case N::case_: {
      const Id s = add_statement(RMP_STMT_CASE, n);
      const Id selector = expression(n.first);
      out_.statements[s].a = selector;
      const Id t = type_of(selector);
      if (t != kBad && t != RMP_TYPE_INT && t != RMP_TYPE_CHAR && t != RMP_TYPE_BOOL &&
          t != RMP_TYPE_STRING)
        fail(at(n.first), "CASE needs INT, CHAR, BOOL or STRING, but this is " + shown(t));
      std::set<Id> seen;
      Id last = kNone;
      for (Id a = at(n.first).next; a != kNone; a = at(a).next) {
        const Id arm = add_statement(RMP_STMT_ARM, at(a));
        std::vector<Id> labels;
        if (!at(a).flag)
          for (Id l = at(at(a).first).first; l != kNone; l = at(l).next) {
            const Id e = convert(expression(l), t, at(l), "this case");
            if (type_of(e) == kBad) continue;
            const Id constant = out_.expressions[e].constant;
            if (constant == kNone) fail(at(l), "a value of an arm must be known before run time");
            else if (!seen.insert(constant).second) fail(at(l), "this value already has a case");
            labels.push_back(e);
          }
        out_.statements[arm].first = static_cast<Id>(out_.links.size());
        out_.statements[arm].count = static_cast<Id>(labels.size());
        out_.links.insert(out_.links.end(), labels.begin(), labels.end());
        const Id body = block(at(a).flag ? at(a).first : at(at(a).first).next);
        out_.statements[arm].body = body;
        if (last == kNone) out_.statements[s].body = arm;
        else out_.statements[last].next = arm;
        last = arm;
      }
      return s;
    }
    case N::while_:
    case N::repeat:
    case N::loop: {
      const Id s = add_statement(n.kind == N::while_   ? RMP_STMT_WHILE
                                 : n.kind == N::repeat ? RMP_STMT_REPEAT
                                                       : RMP_STMT_LOOP,
                                 n);
      const Id second = n.first == kNone ? kNone : at(n.first).next;
      if (n.kind == N::while_) {
        const Id c = boolean(n.first, "WHILE");
        out_.statements[s].a = c;
      }
      ++loops_;
      const Id body = block(n.kind == N::while_ ? second : n.first);
      --loops_;
      out_.statements[s].body = body;
      if (n.kind == N::repeat && second != kNone) {
        const Id c = boolean(second, "UNTIL");
        out_.statements[s].a = c;
      }
      return s;
    }
    case N::for_: {
      const Id s = add_statement(n.flag ? RMP_STMT_FOR_DOWN : RMP_STMT_FOR, n);
      if (n.name == kNone || n.first == kNone) return kNone;
      const Id symbol = lookup(n.name);
      use(n, symbol);
      if (symbol == kNone) {
        fail_name(n, "the loop's variable " + written(n) + " is not declared",
                  "Declare it after VAR: INT: " + written(n) + ";");
      } else if (out_.symbols[symbol].kind != RMP_SYMBOL_VARIABLE ||
                 out_.symbols[symbol].type != RMP_TYPE_INT) {
        fail_name(n, "the loop's variable " + written(n) + " is not a variable of type INT");
      }
      out_.statements[s].symbol = symbol;
      const Id from = number(n.first, "FOR");
      out_.statements[s].a = from;
      const Id second = at(n.first).next;
      if (second == kNone) return s;
      const Id to = number(second, n.flag ? "DOWNTO" : "TO");
      out_.statements[s].b = to;
      Id body = at(second).next;
      if (body != kNone && at(body).kind != N::block) {
        const Id step = number(body, "STEP");
        out_.statements[s].c = step;
        if (const rmp_code_constant* c = known(step); c && c->integer < 1)
          fail(at(body), "STEP must be at least 1, but this is " + std::to_string(c->integer),
               n.flag ? "" : "Use DOWNTO to count downwards.");
        body = at(body).next;
      }
      ++loops_;
      const Id inner = block(body);
      --loops_;
      out_.statements[s].body = inner;
      return s;
    }
    case N::exit_:
      if (loops_ == 0) fail(n, "EXIT is outside a loop", "Use RETURN to leave a routine.");
      return add_statement(RMP_STMT_EXIT, n);
    case N::goto_: {
      const Id s = add_statement(RMP_STMT_GOTO, n);
      if (n.name != kNone) gotos_.push_back({s, n, blocks_});
      return s;
    }
    case N::label: {
      if (n.name == kNone) return kNone;
      const Id s = add_statement(RMP_STMT_LABEL, n);
      rmp_code_symbol x{};
      x.kind = RMP_SYMBOL_LABEL;
      x.name = out_.keep(written(n));
      x.type = RMP_TYPE_VOID;
      x.scope = scope_;
      x.routine = routine_;
      x.value = x.constant = kNone;
      x.span = name_span(n);
      const Id symbol = static_cast<Id>(out_.symbols.size());
      if (!labels_.emplace(n.name, std::pair{symbol, blocks_.back()}).second) {
        fail_name(n, "the label " + written(n) + " already exists");
        return kNone;
      }
      out_.symbols.push_back(x);
      symbol_names_.push_back(kNone);
      use(n, symbol, Use::symbol, true);
      out_.statements[s].symbol = symbol;
      return s;
    }
    case N::return_: {
      const Id s = add_statement(RMP_STMT_RETURN, n);
      ++returns_;
      const rmp_code_routine& r = out_.routines[routine_ == kNone ? 0 : routine_];
      if (r.kind == RMP_ROUTINE_FUNCTION) {
        if (n.first == kNone) {
          fail(n, "RETURN of a function needs a value of type " + shown(r.result));
          return s;
        }
        const Id value = component(n.first, r.result, "RETURN");
        out_.statements[s].a = value;
      } else if (n.first != kNone) {
        expression(n.first);
        fail(at(n.first), "RETURN has a value, but this is not a function");
      }
      return s;
    }
    case N::wait_time: {
      const Id s = add_statement(RMP_STMT_WAIT_TIME, n);
      const Id time = convert(expression(n.first), RMP_TYPE_REAL, at(n.first), "WAIT");
      if (const rmp_code_constant* c = known(time); c && type_of(time) != kBad && c->real < 0)
        fail(at(n.first), "a time must not be negative");
      out_.statements[s].a = time;
      return s;
    }
    case N::wait_for: {
      const Id s = add_statement(RMP_STMT_WAIT_FOR, n);
      const Id c = boolean(n.first, "WAIT FOR");
      out_.statements[s].a = c;
      if (const Id limit = at(n.first).next; limit != kNone) {
        const Id time = convert(expression(limit), RMP_TYPE_REAL, at(limit), "TIMEOUT");
        out_.statements[s].b = time;
      }
      return s;
    }
    case N::pause: {
      const Id s = add_statement(RMP_STMT_PAUSE, n);
      if (n.first != kNone) {
        const Id text = convert(expression(n.first), RMP_TYPE_STRING, at(n.first), "PAUSE");
        out_.statements[s].a = text;
      }
      return s;
    }
    case N::halt: return add_statement(RMP_STMT_HALT, n);
    case N::move: return motion(n);
    case N::process_stmt: {
      static constexpr std::uint32_t kOps[] = {RMP_STMT_START,  RMP_STMT_STOP,   RMP_STMT_CONTINUE,
                                               RMP_STMT_CANCEL, RMP_STMT_ENABLE, RMP_STMT_DISABLE};
      const bool is_interrupt = n.flag >= 4;
      const Id symbol = routine_named(n, is_interrupt ? RMP_ROUTINE_INTERRUPT : RMP_ROUTINE_PROCESS,
                                      is_interrupt ? "interrupt" : "process");
      const Id s = add_statement(kOps[n.flag], n);
      out_.statements[s].symbol = symbol;
      return s;
    }
    case N::teach: {
      Id first = kNone, last = kNone;
      for (Id v = n.first; v != kNone; v = at(v).next) {
        const Id symbol = lookup(at(v).name);
        use(at(v), symbol);
        if (symbol == kNone) {
          fail_name(at(v), "there is no name " + written(at(v)), suggestion(at(v).name));
          continue;
        }
        const rmp_code_symbol& x = out_.symbols[symbol];
        if (x.kind != RMP_SYMBOL_VARIABLE || x.routine != kNone) {
          fail_name(at(v), written(at(v)) + " is not a variable of the program",
                    "Only variables of the program have taught values.");
          continue;
        }
        teaches_.emplace_back(symbol, at(v));
        const Id s = add_statement(RMP_STMT_TEACH, at(v));
        out_.statements[s].symbol = symbol;
        if (last != kNone) out_.statements[last].next = s;
        else first = s;
        last = s;
      }
      if (first == last) return first;
      // Several are a block of their own, so that a statement stays one row of its list.
      const Id all = add_statement(RMP_STMT_IF, n), arm = add_statement(RMP_STMT_ARM, n);
      out_.statements[all].body = arm;
      out_.statements[arm].body = first;
      return all;
    }
    case N::broken:
      ++loops_;
      for (Id b = n.first; b != kNone; b = at(b).next) block(b);
      --loops_;
      return kNone;
    default: return kNone;
  }
}

namespace {

/// Whether motions have a meaning for records of this name.
bool is_target_name(std::string name) {
  for (char& c : name)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
  static constexpr std::string_view kNames[] = {"ROBTARGET", "POSE",       "POSITION",
                                                "JOINT",     "MAIN_JOINT", "ADD_JOINT"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames);
}

}  // namespace

Id Checker::motion(const Node& n) {
  static constexpr const char* kWords[] = {"PTP", "LIN", "CIRCLE", "PATH"};
  rmp_code_motion m{};
  m.interpolation = static_cast<std::uint32_t>(n.flag >> 1U);
  m.is_incremental = n.flag & 1U;
  m.until = m.action = kNone;
  m.span = span(n);
  const std::string word =
      std::string(m.is_incremental ? "MOVE_INC " : "MOVE ") + kWords[m.interpolation];
  const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
  std::vector<Id> targets;
  const Node& list = at(n.first);
  for (Id t = list.first; t != kNone; t = at(t).next) {
    const Id e = expression(t);
    targets.push_back(e);
    const Id type = type_of(e);
    if (type == kBad) continue;
    const std::uint32_t role = out_.types[type].role;
    const bool is_joint = role == RMP_ROLE_JOINT || role == RMP_ROLE_MAIN_JOINT;
    const bool is_place =
        role == RMP_ROLE_POSE || role == RMP_ROLE_ROBTARGET || role == RMP_ROLE_POSITION;
    if (role == RMP_ROLE_ADD_JOINT && m.interpolation <= RMP_MOVE_LIN) continue;
    if (is_place || (is_joint && is_ptp)) continue;
    if (is_joint)
      fail(at(t), word + " moves along a path to a position, but this is " + shown(type),
           "Use MOVE PTP, or TRAFO(...) for the pose that the joints reach.");
    else if (misfits_.contains(type)) continue;  // its declaration is an error already
    else if (const std::string name = out_.types[type].name ? out_.types[type].name : "";
             is_target_name(name))
      fail(at(t),
           "this " + name + " is a record declared by the program, which motions do not support",
           "Rename the record, and give the motion the " + name + " of the language or cell.");
    else
      fail(at(t), shown(type) + " is not a target of " + word,
           is_ptp ? "Targets are ROBTARGET, POSE, POSITION, JOINT, MAIN_JOINT and ADD_JOINT."
                  : "Targets are ROBTARGET, POSE and POSITION.");
  }
  if (m.interpolation == RMP_MOVE_CIRCLE && targets.size() != 2)
    fail(list, "CIRCLE needs two targets, a point on the arc and the end",
         "Such as: MOVE CIRCLE via, end;");
  m.first_target = static_cast<Id>(out_.links.size());
  m.target_count = static_cast<Id>(targets.size());
  out_.links.insert(out_.links.end(), targets.begin(), targets.end());
  std::vector<rmp_code_attribute> attributes;
  for (Id a = list.next; a != kNone; a = at(a).next) {
    const Node& x = at(a);
    if (x.kind == N::until) {
      const Id until = boolean(x.first, "UNTIL");
      m.until = until;
      if (x.name != kNone) {
        const Id s = routine_named(x, RMP_ROUTINE_PROCEDURE, "procedure");
        if (s != kNone) {
          m.action = out_.symbols[s].routine;
          if (routine_ != kNone) calls_[routine_].insert(m.action);
          if (out_.routines[m.action].parameter_count > 0)
            fail_name(x, written(x) + " has parameters, but is called without arguments");
        }
      }
      continue;
    }
    const std::string& name = names_.upper(x.name);
    const auto* row = std::find_if(kAttributeRows.begin(), kAttributeRows.end(),
                                   [&](const AttributeRow& r) { return r.name == name; });
    if (row == kAttributeRows.end()) {
      std::string all;
      for (const AttributeRow& r : kAttributeRows)
        all += (all.empty() ? "" : ", ") + std::string(r.name);
      fail_name(x, "a motion has no attribute " + written(x), "Attributes are " + all + ".");
      expression(x.first);
      continue;
    }
    const auto number_of = static_cast<std::uint32_t>(row - kAttributeRows.begin());
    use(x, number_of, Use::attribute);
    for (const rmp_code_attribute& b : attributes)
      if (b.attribute == number_of) fail_name(x, written(x) + " is given twice");
    Id value = kNone;
    if (number_of == RMP_ATTR_ACT_ROB) {
      value = expression(x.first);
      const Id t = type_of(value);
      if (t != kBad && out_.types[t].role != RMP_ROLE_ROBOT)
        fail(at(x.first), "ACT_ROB needs a robot, but this is " + shown(t));
      else if (t != kBad && !is_robot(value))
        fail(
            at(x.first), "ACT_ROB needs the name of a robot",
            "Name one declared by the cell: ROBOT name := ...; R_ACT_ROB applies without ACT_ROB.");
    } else if (number_of == RMP_ATTR_TOOL || number_of == RMP_ATTR_FRAME) {
      value = component(x.first, named_type("POSE"), written(x));
    } else {
      value = convert(expression(x.first), row->type, at(x.first), written(x));
    }
    if (is_ptp ? !row->in_ptp : !row->in_paths)
      warn(x, written(x) + " has no effect on " + word,
           is_ptp ? "Joint motions have SPEED_PTP, ACC_PTP and C_PTP."
                  : "Motions along a path have SPEED, ACC and C_CP.");
    if (const rmp_code_constant* c = type_of(value) == RMP_TYPE_REAL ? known(value) : nullptr) {
      const bool is_speed = number_of == RMP_ATTR_SPEED || number_of == RMP_ATTR_SPEED_ORI ||
                            number_of == RMP_ATTR_SPEED_PTP || number_of == RMP_ATTR_ACC ||
                            number_of == RMP_ATTR_ACC_PTP;
      const bool is_share = number_of == RMP_ATTR_SPEED_PTP || number_of == RMP_ATTR_ACC ||
                            number_of == RMP_ATTR_ACC_PTP || number_of == RMP_ATTR_C_PTP ||
                            number_of == RMP_ATTR_C_SPEED;
      if (is_speed && c->real <= 0) fail(at(x.first), written(x) + " must be above zero");
      else if (number_of == RMP_ATTR_TIME && c->real <= 0 && c->real != -1.0)
        fail(at(x.first), written(x) + " must be above zero, or -1 for none");
      else if (number_of != RMP_ATTR_TIME && c->real < 0)
        fail(at(x.first), written(x) + " must not be negative");
      else if (is_share && c->real > 100)
        fail(at(x.first), written(x) + " must be a percentage of at most 100");
    }
    attributes.push_back({number_of, value, span(x)});
  }
  m.first_attribute = static_cast<Id>(out_.attributes.size());
  m.attribute_count = static_cast<Id>(attributes.size());
  out_.attributes.insert(out_.attributes.end(), attributes.begin(), attributes.end());
  const Id s = add_statement(RMP_STMT_MOVE, n);
  out_.statements[s].motion = static_cast<Id>(out_.motions.size());
  out_.motions.push_back(m);
  return s;
}

}  // namespace robomosp::irl

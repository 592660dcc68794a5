// SPDX-License-Identifier: Apache-2.0
#include "program_post/legalise.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <set>

#include <robomosp/sdk/post_writer.h>

#include "program_post/arcs.h"
#include "program_post/parts.h"
#include "program_post/points.h"
#include "program_post/recursion.h"
#include "program_post/rewriter.h"
#include "program_post/robots.h"
#include "program_post/scalars.h"
#include "program_post/taught.h"
#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

template <class Row>
void copy(std::vector<Row>& to, const rmp_table& from) {
  to.reserve(from.count);
  for (std::uint32_t i = 0; i < from.count; ++i) to.push_back(row<Row>(from, i));
}

class Passes final : Rewriter {
 public:
  Passes(ProgramTables& t, const PostCapabilities& caps) : Rewriter(t), caps_(caps) {}
  Legal run(const LegaliseOptions& options) {
    Legal out;
    to_one_robot(t_, caps_.title, out.remarks);
    KnownPoints known;
    std::vector<PostPoint> points(options.points.begin(), options.points.end());
    if (!has(kPostTeach) && to_taught_values(t_, out.remarks) && !points.empty())
      known = known_now(points);
    to_chords(t_, caps_, points, options.chord_mm, out.remarks);
    to_loops(t_, caps_, options.recursion_depth, out.remarks);
    to_scalars(t_, caps_, out.remarks);
    find_loops_whose_variable_is_read_behind();
    for (std::uint32_t r = 0; r < t_.routines.size(); ++r) {
      routine_ = r;
      const std::uint32_t body = t_.routines[r].body;
      t_.routines[r].body = block(body, {}, 0);
    }
    out.remarks.insert(out.remarks.end(), notes_.begin(), notes_.end());
    if (options.parts > 0) out.parts = to_parts(t_, options.parts, options.name);
    return out;
  }

 private:
  static constexpr int kDeepest = 1200;
  /// Adds the points that are known now to those that were; gives what they refer to.
  KnownPoints known_now(std::vector<PostPoint>& points) {
    t_.seal();
    KnownPoints out = known_points(t_.code(), nullptr, nullptr);
    const auto by_expression = [](const PostPoint& a, const PostPoint& b) {
      return a.expression < b.expression;
    };
    const std::vector<PostPoint> before = points;
    for (const PostPoint& p : out.points)
      if (!std::binary_search(before.begin(), before.end(), p, by_expression)) points.push_back(p);
    std::sort(points.begin(), points.end(), by_expression);
    return out;
  }
  /// What EXIT within a loop jumps to; made when it is asked for.
  struct Loop {
    bool is_rewritten = false;
    std::uint32_t* label = nullptr;
  };
  [[nodiscard]] bool has(std::uint64_t feature) const { return (caps_.features & feature) != 0; }
  std::uint32_t new_label(const char* name, const rmp_span& span) {
    rmp_code_symbol s{};
    s.kind = RMP_SYMBOL_LABEL;
    s.type = RMP_TYPE_VOID;
    s.name = t_.keep(name);
    s.scope = t_.routines[routine_].scope;
    s.routine = routine_ == 0 ? RMP_NONE : routine_;
    s.value = s.constant = RMP_NONE;
    s.span = span;
    t_.symbols.push_back(s);
    return static_cast<std::uint32_t>(t_.symbols.size() - 1);
  }
  /// An assignment to a variable.
  std::uint32_t assign(std::uint32_t s, std::uint32_t value, const rmp_span& span) {
    return assignment(variable(s, span), value, span);
  }
  std::uint32_t integer(std::int64_t v, const rmp_span& span) {
    return literal(t_.integer(v), span);
  }

  /// Rewrites a block; gives its first statement.
  std::uint32_t block(std::uint32_t first, const Loop& loop, int depth) {
    std::uint32_t head = RMP_NONE, tail = RMP_NONE;
    const auto add = [&](std::uint32_t i) {
      if (i == RMP_NONE) return;
      if (tail == RMP_NONE) head = i;
      else st(tail).next = i;
      tail = i;
      while (st(tail).next != RMP_NONE) tail = st(tail).next;
    };
    for (std::uint32_t i = first; i != RMP_NONE;) {
      const std::uint32_t next = st(i).next;
      st(i).next = RMP_NONE;
      if (depth > kDeepest) add(i);  // the writer says that it is too deep
      else add(one(i, loop, depth));
      i = next;
    }
    return head;
  }
  /// One statement; what takes its place, one or several in a row.
  std::uint32_t one(std::uint32_t i, const Loop& loop, int depth) {
    switch (st(i).op) {
      case RMP_STMT_IF: {
        for (std::uint32_t a = st(i).body; a != RMP_NONE; a = st(a).next) {
          const std::uint32_t body = block(st(a).body, loop, depth + 1);
          st(a).body = body;
        }
        if (!has(kPostElsif)) nest(i);
        return i;
      }
      case RMP_STMT_CASE: {
        for (std::uint32_t a = st(i).body; a != RMP_NONE; a = st(a).next) {
          const std::uint32_t body = block(st(a).body, loop, depth + 1);
          st(a).body = body;
        }
        return has(kPostCase) ? i : case_to_if(i);
      }
      case RMP_STMT_WHILE: return whole_loop(i, depth, true, i);
      case RMP_STMT_LOOP: {
        const bool stays = has(kPostLoop);
        return whole_loop(i, depth, true, [&] {
          if (stays) return i;
          st(i).op = RMP_STMT_WHILE;
          const std::uint32_t always = truth(true, st(i).span);
          st(i).a = always;
          return i;
        }());
      }
      case RMP_STMT_REPEAT: return repeat(i, depth);
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN: return for_loop(i, depth);
      case RMP_STMT_EXIT:
        if (has(kPostExit) && !loop.is_rewritten) return i;
        if (!loop.label || !has(kPostGoto)) return i;  // the writer says that there is no EXIT
        if (*loop.label == RMP_NONE) *loop.label = new_label("loop_end", st(i).span);
        st(i).op = RMP_STMT_GOTO;
        st(i).symbol = *loop.label;
        return i;
      case RMP_STMT_MOVE: return move(i);
      default: return i;
    }
  }
  std::uint32_t label(std::uint32_t s, const rmp_span& span) {
    const std::uint32_t l = statement(RMP_STMT_LABEL, span);
    st(l).symbol = s;
    return l;
  }
  /// Loops that keep their shape: the body, and the label behind that EXIT jumps to.
  std::uint32_t whole_loop(std::uint32_t i, int depth, bool keeps_exit, std::uint32_t shaped) {
    std::uint32_t end = RMP_NONE;
    const Loop inner{!keeps_exit, &end};
    const std::uint32_t body = block(st(i).body, inner, depth + 1);
    st(i).body = body;
    if (end != RMP_NONE) {
      const std::uint32_t l = label(end, st(i).span);
      st(shaped).next = l;
    }
    return shaped;
  }
  std::uint32_t repeat(std::uint32_t i, int depth) {
    if (has(kPostRepeat)) return whole_loop(i, depth, true, i);
    const rmp_span span = st(i).span;
    if (has(kPostLoop) && has(kPostExit)) {
      // LOOP body; IF until THEN EXIT; ENDLOOP
      std::uint32_t end = RMP_NONE;
      std::uint32_t body = block(st(i).body, {false, &end}, depth + 1);
      const std::uint32_t leave = statement(RMP_STMT_EXIT, span);
      const std::uint32_t test = if_then(st(i).a, leave, span);
      body = joined(body, test);
      st(i).op = RMP_STMT_LOOP;
      st(i).a = RMP_NONE;
      st(i).body = body;
      return i;
    }
    if (!has(kPostGoto)) return i;  // the writer says so
    // LABEL again: body; IF NOT until THEN GOTO again;
    std::uint32_t end = RMP_NONE;
    const std::uint32_t again = new_label("repeat", span);
    const std::uint32_t begin = label(again, span);
    const std::uint32_t body = block(st(i).body, {true, &end}, depth + 1);
    const std::uint32_t jump = statement(RMP_STMT_GOTO, span);
    st(jump).symbol = again;
    const std::uint32_t stays = expression(RMP_EXPR_NOT, RMP_TYPE_BOOL, span, {st(i).a});
    const std::uint32_t test = if_then(stays, jump, span);
    st(begin).next = joined(body, test);
    if (end != RMP_NONE) {
      const std::uint32_t behind = label(end, span);
      st(test).next = behind;
    }
    return begin;
  }
  std::uint32_t joined(std::uint32_t first, std::uint32_t second) {
    if (first == RMP_NONE) return second;
    std::uint32_t tail = first;
    while (st(tail).next != RMP_NONE) tail = st(tail).next;
    st(tail).next = second;
    return first;
  }
  /// IF a ELSIF b ELSE c to IF a ELSE IF b ELSE c.
  void nest(std::uint32_t i) {
    std::uint32_t arm = st(i).body;
    while (arm != RMP_NONE) {
      const std::uint32_t next = st(arm).next;
      if (next == RMP_NONE || st(next).a == RMP_NONE) return;
      const rmp_span span = st(next).span;
      const std::uint32_t inner = statement(RMP_STMT_IF, span);
      const std::uint32_t other = statement(RMP_STMT_ARM, span);
      st(inner).body = next;
      st(other).body = inner;
      st(arm).next = other;
      arm = next;
    }
  }
  std::uint32_t case_to_if(std::uint32_t i) {
    const rmp_span span = st(i).span;
    std::uint32_t before = RMP_NONE;
    // The selector is looked at once.
    std::uint32_t selector = st(i).a;
    const rmp_code_expression asked = t_.expressions[selector];
    std::uint32_t kept = RMP_NONE;
    if (asked.op != RMP_EXPR_SYMBOL && asked.constant == RMP_NONE) {
      kept = new_variable(asked.type, "selector", routine_, span);
      before = assign(kept, selector, span);
    }
    st(i).op = RMP_STMT_IF;
    st(i).a = RMP_NONE;
    for (std::uint32_t a = st(i).body; a != RMP_NONE; a = st(a).next) {
      const std::uint32_t first = st(a).first, count = st(a).count;
      const rmp_span at = st(a).span;
      std::uint32_t all = RMP_NONE;
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t value = kept == RMP_NONE ? selector : variable(kept, at);
        const std::uint32_t one =
            expression(RMP_EXPR_EQUAL, RMP_TYPE_BOOL, at, {value, t_.links[first + k]});
        all = all == RMP_NONE ? one : expression(RMP_EXPR_OR, RMP_TYPE_BOOL, at, {all, one});
      }
      st(a).a = all;
      st(a).first = st(a).count = 0;
    }
    // Only DEFAULT: its statements are all that there is.
    if (st(i).body != RMP_NONE && st(st(i).body).a == RMP_NONE) {
      const std::uint32_t always = truth(true, span);
      st(st(i).body).a = always;
    }
    if (st(i).body == RMP_NONE) return before;
    if (!has(kPostElsif)) nest(i);
    return before == RMP_NONE ? i : joined(before, i);
  }
  /// Whether statements of a block give a variable a value by its name.
  bool assigns(std::uint32_t first, std::uint32_t variable) {
    const auto at = [&](std::uint32_t i) -> const rmp_code_statement& { return st(i); };
    return any_statement(first, at, [&](const rmp_code_statement& s) {
      return s.symbol == variable ||
             (s.op == RMP_STMT_ASSIGN && t_.expressions[s.a].op == RMP_EXPR_SYMBOL &&
              t_.expressions[s.a].symbol == variable);
    });
  }
  bool calls(std::uint32_t e) {
    if (e == RMP_NONE || t_.expressions[e].constant != RMP_NONE) return false;
    const rmp_code_expression x = t_.expressions[e];
    if (x.op == RMP_EXPR_CALL) return true;
    for (std::uint32_t k = 0; k < x.count; ++k)
      if (calls(t_.links[x.first + k])) return true;
    return false;
  }
  /// FOR of controllers leaves its variable at the value behind the last one, or nobody says at
  /// which. Where the value may be read behind the loop, the loop becomes a WHILE that keeps it.
  /// By places in the text: a mention outside of all loops over the variable, behind this one, or
  /// anywhere when it runs again or another routine reads it.
  void find_loops_whose_variable_is_read_behind() {
    struct Over {
      std::uint32_t statement, file, begin, body, end, first;  ///< first: of its routine
      bool runs_again;
    };
    std::map<std::uint32_t, std::vector<Over>> loops;  // by variable
    std::set<std::uint32_t> places;                    // left sides of assignments
    bool has_goto = false;
    for (const rmp_code_routine& r : t_.routines) {
      const std::uint32_t first = r.body == RMP_NONE ? 0 : st(r.body).span.begin;
      // Ends of blocks; nesting is as deep as the compiler lets it be.
      const auto walk = [&](const auto& self, std::uint32_t i, bool again) -> std::uint32_t {
        std::uint32_t end = 0;
        for (; i != RMP_NONE; i = st(i).next) {
          const rmp_code_statement& s = st(i);
          const bool is_for = s.op == RMP_STMT_FOR || s.op == RMP_STMT_FOR_DOWN;
          const bool is_loop =
              is_for || s.op == RMP_STMT_WHILE || s.op == RMP_STMT_REPEAT || s.op == RMP_STMT_LOOP;
          has_goto = has_goto || s.op == RMP_STMT_GOTO;
          if (s.op == RMP_STMT_ASSIGN) places.insert(s.a);
          const std::uint32_t inner =
              std::max(s.span.end, s.body == RMP_NONE ? 0U : self(self, s.body, again || is_loop));
          if (is_for) {
            const std::uint32_t body = s.body == RMP_NONE ? inner : st(s.body).span.begin;
            loops[s.symbol].push_back({i, s.span.file, s.span.begin, body, inner, first, again});
          }
          end = std::max(end, inner);
        }
        return end;
      };
      walk(walk, r.body, false);
    }
    if (loops.empty()) return;
    for (auto& [v, all] : loops)
      std::sort(all.begin(), all.end(), [](const Over& a, const Over& b) {
        return std::pair(a.file, a.begin) < std::pair(b.file, b.begin);
      });
    struct Outside {
      std::uint32_t file = RMP_NONE, least = RMP_NONE, most = 0;
      bool is_elsewhere = false;  ///< in several files
    };
    std::map<std::uint32_t, Outside> outside;
    for (std::uint32_t e = 0; e < t_.expressions.size(); ++e) {
      const rmp_code_expression& x = t_.expressions[e];
      if (x.op != RMP_EXPR_SYMBOL || places.count(e) > 0) continue;
      const auto of = loops.find(x.symbol);
      if (of == loops.end()) continue;
      // The last loop over it that begins before the mention.
      const auto behind = std::upper_bound(
          of->second.begin(), of->second.end(), std::pair(x.span.file, x.span.begin),
          [](const auto& at, const Over& l) { return at < std::pair(l.file, l.begin); });
      if (behind != of->second.begin()) {
        const Over& l = *std::prev(behind);
        if (l.file == x.span.file && x.span.begin >= l.body && x.span.begin < l.end) continue;
      }
      Outside& o = outside[x.symbol];
      o.is_elsewhere = o.is_elsewhere || (o.file != RMP_NONE && o.file != x.span.file);
      o.file = x.span.file;
      o.least = std::min(o.least, x.span.begin);
      o.most = std::max(o.most, x.span.begin);
    }
    for (const auto& [v, o] : outside)
      for (const Over& l : loops[v])
        if (l.runs_again || has_goto || o.is_elsewhere || o.file != l.file || o.most > l.begin ||
            o.least < l.first)
          read_behind_.insert(l.statement);
  }
  std::uint32_t for_loop(std::uint32_t i, int depth) {
    std::optional<double> step = 1.0;
    if (st(i).c != RMP_NONE) {
      step.reset();
      const std::uint32_t k = t_.expressions[st(i).c].constant;
      if (k != RMP_NONE && t_.constants[k].kind == RMP_CONSTANT_INT)
        step = static_cast<double>(t_.constants[k].integer);
    }
    const bool is_plain = step && *step == 1.0 && st(i).op == RMP_STMT_FOR;
    const bool is_int = t_.symbols[st(i).symbol].type == RMP_TYPE_INT;
    const bool is_read_behind = has(kPostWhile) && read_behind_.count(i) > 0;
    if (is_int && has(kPostFor) && (is_plain || (step && has(kPostForStep))) && !is_read_behind)
      return whole_loop(i, depth, true, i);
    // v := from; last := to; WHILE v <= last; body; v := v + step; ENDWHILE
    const rmp_span span = st(i).span;
    const std::uint32_t v = st(i).symbol, type = t_.symbols[v].type;
    const bool is_down = st(i).op == RMP_STMT_FOR_DOWN;
    const auto held = [&](std::uint32_t e, const char* name, std::uint32_t& head) {
      if (e == RMP_NONE || t_.expressions[e].constant != RMP_NONE) return e;
      const std::uint32_t s = new_variable(t_.expressions[e].type, name, routine_, span);
      const std::uint32_t a = assign(s, e, span);
      head = joined(head, a);
      return variable(s, span);
    };
    std::uint32_t head = RMP_NONE;
    // The first value is computed first, and counts as it was then.
    const bool is_first = calls(st(i).b) || calls(st(i).c);
    const std::uint32_t from = is_first ? held(st(i).a, "first", head) : st(i).a;
    const std::uint32_t to = held(st(i).b, "last", head);
    std::uint32_t by = held(st(i).c, "step", head);
    if (by == RMP_NONE) {
      by = integer(1, span);
      if (type == RMP_TYPE_REAL) by = expression(RMP_EXPR_CONVERT, RMP_TYPE_REAL, span, {by});
    }
    // Limit and step are computed before the variable changes; it keeps its last value, as a
    // counter of its own is what passes the limit. A body that changes it counts by the variable
    // itself.
    const std::uint32_t start = assign(v, from, span);
    head = joined(head, start);
    const bool is_own = !assigns(st(i).body, v);
    std::uint32_t counter = v;
    std::uint32_t keep = RMP_NONE;
    if (is_own) {
      counter = new_variable(type, "counter", routine_, span);
      const std::uint32_t first = variable(v, span);
      const std::uint32_t begin = assign(counter, first, span);
      head = joined(head, begin);
      const std::uint32_t count = variable(counter, span);
      keep = assign(v, count, span);
    }
    std::uint32_t end = RMP_NONE;
    std::uint32_t body = block(st(i).body, {false, &end}, depth + 1);
    if (keep != RMP_NONE) body = joined(keep, body);
    const std::uint32_t now = variable(counter, span);
    const std::uint32_t sum =
        expression(is_down ? RMP_EXPR_SUBTRACT : RMP_EXPR_ADD, type, span, {now, by});
    const std::uint32_t further = assign(counter, sum, span);
    body = joined(body, further);
    const auto again = [&](std::uint32_t e) {
      return t_.expressions[e].op == RMP_EXPR_SYMBOL ? variable(t_.expressions[e].symbol, span) : e;
    };
    const auto until = [&](bool downwards) {
      const std::uint32_t here = variable(counter, span), last = again(to);
      return expression(downwards ? RMP_EXPR_GREATER_EQUAL : RMP_EXPR_LESS_EQUAL, RMP_TYPE_BOOL,
                        span, {here, last});
    };
    std::uint32_t goes = RMP_NONE;
    if (step) {
      goes = until(is_down);
    } else {
      // Which way a computed step goes is known when it runs.
      const auto way = [&](bool is_above) {
        std::uint32_t zero = integer(0, span);
        if (type == RMP_TYPE_REAL) zero = expression(RMP_EXPR_CONVERT, RMP_TYPE_REAL, span, {zero});
        const std::uint32_t given = again(by);
        const std::uint32_t sign = expression(is_above ? RMP_EXPR_GREATER : RMP_EXPR_LESS,
                                              RMP_TYPE_BOOL, span, {given, zero});
        const std::uint32_t left = until(is_down == is_above);
        return expression(RMP_EXPR_AND, RMP_TYPE_BOOL, span, {sign, left});
      };
      const std::uint32_t above = way(true), below = way(false);
      goes = expression(RMP_EXPR_OR, RMP_TYPE_BOOL, span, {above, below});
      notes_.push_back({RMP_FAULT_NOTE, span,
                        "a STEP of 0 at run time skips the loop on the controller, while the "
                        "interpreter raises a fault",
                        ""});
    }
    st(i).op = RMP_STMT_WHILE;
    st(i).a = goes;
    st(i).b = st(i).c = st(i).symbol = RMP_NONE;
    st(i).body = body;
    if (end != RMP_NONE) {
      const std::uint32_t behind = label(end, span);
      st(i).next = behind;
    }
    return joined(head, i);
  }
  /// PATH a, b, c: LIN to each, passing all but the last.
  std::uint32_t move(std::uint32_t i) {
    const std::uint32_t number = st(i).motion;
    const rmp_code_motion m = t_.motions[number];
    if (m.interpolation != RMP_MOVE_PATH || (caps_.motions & kPostPath) || m.until != RMP_NONE ||
        m.target_count == 0)
      return i;
    std::uint32_t head = RMP_NONE, tail = RMP_NONE;
    for (std::uint32_t k = 0; k < m.target_count; ++k) {
      const std::uint32_t s = k == 0 ? i : statement(RMP_STMT_MOVE, st(i).span);
      rmp_code_motion part = m;
      part.interpolation = RMP_MOVE_LIN;
      part.first_target = static_cast<std::uint32_t>(t_.links.size());
      part.target_count = 1;
      const std::uint32_t target = t_.links[m.first_target + k];
      t_.links.push_back(target);
      if (k + 1 < m.target_count) {
        // Passed, not stopped at.
        const std::uint32_t always = truth(true, m.span);
        part.first_attribute = static_cast<std::uint32_t>(t_.attributes.size());
        for (std::uint32_t a = 0; a < m.attribute_count; ++a) {
          const rmp_code_attribute other = t_.attributes[m.first_attribute + a];
          if (other.attribute != RMP_ATTR_C_PASS) t_.attributes.push_back(other);
        }
        t_.attributes.push_back({RMP_ATTR_C_PASS, always, m.span});
        part.attribute_count =
            static_cast<std::uint32_t>(t_.attributes.size()) - part.first_attribute;
      }
      t_.motions.push_back(part);
      st(s).motion = static_cast<std::uint32_t>(t_.motions.size() - 1);
      if (tail == RMP_NONE) head = s;
      else st(tail).next = s;
      tail = s;
    }
    return head;
  }

  const PostCapabilities& caps_;
  std::uint32_t routine_ = 0;
  std::set<std::uint32_t> read_behind_;  ///< FOR statements
  std::vector<Remark> notes_;            ///< of the routines
};

}  // namespace

std::unique_ptr<ProgramTables> copied_tables(const rmp_code& code) {
  auto to = std::make_unique<ProgramTables>();
  copy(to->files, code.files);
  copy(to->types, code.types);
  copy(to->fields, code.fields);
  copy(to->constants, code.constants);
  copy(to->scopes, code.scopes);
  copy(to->symbols, code.symbols);
  copy(to->routines, code.routines);
  copy(to->expressions, code.expressions);
  copy(to->statements, code.statements);
  copy(to->motions, code.motions);
  copy(to->attributes, code.attributes);
  copy(to->links, code.links);
  for (rmp_code_routine& r : to->routines) r.first_instruction = r.instruction_count = 0;
  to->set_name(code.name);
  return to;
}

Legal legalise(const rmp_code& code, const PostCapabilities& capabilities,
               const LegaliseOptions& options) {
  auto tables = copied_tables(code);
  Legal out = Passes(*tables, capabilities).run(options);
  tables->seal();
  out.tables = std::move(tables);
  return out;
}

bool wants_points(const rmp_code& code, const PostCapabilities& capabilities) {
  const bool has_circle =
      (capabilities.motions & kPostCircle) != 0 && capabilities.circle != PostCircle::none;
  const bool has_path = (capabilities.motions & kPostPath) != 0;
  for (std::uint32_t i = 0; i < code.motions.count; ++i) {
    const auto kind = row<rmp_code_motion>(code.motions, i).interpolation;
    if ((kind == RMP_MOVE_CIRCLE && !has_circle) || (kind == RMP_MOVE_PATH && !has_path))
      return true;
  }
  return false;
}

}  // namespace robomosp::program_post

// SPDX-License-Identifier: Apache-2.0
#include "program_post/part_of_robot.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <robomosp/sdk/program_tables.h>

#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

using Id = std::uint32_t;
constexpr const char* kOwn =
    "Give each robot's processes their own variables, or write a program for each robot.";

std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

/// Words and signs of a source, without blanks and comments.
struct Token {
  std::uint32_t begin = 0, end = 0;
};
std::vector<Token> tokens_of(std::string_view t) {
  std::vector<Token> out;
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  for (std::size_t i = 0; i < t.size();) {
    const std::size_t begin = i;
    if (t[i] == '{') {
      i = std::min(t.find('}', i), t.size() - 1) + 1;
      continue;
    }
    if (t[i] == ' ' || t[i] == '\t' || t[i] == '\r' || t[i] == '\n') {
      ++i;
      continue;
    }
    if (t[i] == '\'') {
      for (++i; i < t.size() && t[i] != '\''; ++i) {
      }
      ++i;  // a doubled quote is two strings one behind the other, which is as good here
    } else if (is_word(t[i])) {
      while (i < t.size() && is_word(t[i])) ++i;
    } else {
      i += t.substr(i, 2) == ":=" ? 2 : 1;
    }
    i = std::min(i, t.size());
    out.push_back({static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(i)});
  }
  return out;
}

enum class How { read, write, acquire, release, other };
struct Use {
  Id symbol;
  How how;
  rmp_span span;
};
/// What a routine, or a thread with what it calls, does.
struct Facts {
  std::vector<Use> uses;
  std::set<Id> calls;
  std::vector<std::pair<Id, rmp_span>> motions;  ///< whose; RMP_NONE = not named
  std::vector<std::pair<Id, Id>> starts;         ///< statement, routine
  std::vector<std::pair<Id, Id>> controls;       ///< STOP, CONTINUE, CANCEL: the same
  std::vector<rmp_span> halts;
  std::vector<rmp_span> timeouts;
  std::vector<std::pair<Id, Id>> handovers;    ///< ACQUIRE, RELEASE: statement, symbol
  std::vector<std::pair<Id, rmp_span>> asked;  ///< GETSTATUS: routine
  bool has_loops = false, has_interrupts = false;
};
struct Thread {
  Id routine = 0;
  Id robot = RMP_NONE;
  bool moves = false;
  std::set<Id> routines;  ///< its own and those that it calls
  Facts facts;
};
struct Edit {
  std::uint32_t begin, end;
  std::string text;
};

class Splitter {
 public:
  explicit Splitter(const PartTask& task) : task_(task), c_(*task.code) {}

  Result<Part> run() {
    RMP_TRY(find_robot());
    tokens_ = tokens_of(task_.text);
    main_file_ = routine(0).span.file;
    find_facts();
    find_prefix();
    find_threads();
    place_threads();
    if (has_errors()) return std::move(part_);
    check_starts();
    find_couplings();
    if (has_errors()) return std::move(part_);
    if (partner_ != RMP_NONE) part_.partner = name(partner_);
    tell_what_is_left_out();
    write();
    return std::move(part_);
  }

 private:
  // ---- the tables ----
  [[nodiscard]] const rmp_code_symbol& symbol(Id i) const {
    return row<rmp_code_symbol>(c_.symbols, i);
  }
  [[nodiscard]] const rmp_code_routine& routine(Id i) const {
    return row<rmp_code_routine>(c_.routines, i);
  }
  [[nodiscard]] const rmp_code_expression& ex(Id i) const {
    return row<rmp_code_expression>(c_.expressions, i);
  }
  [[nodiscard]] const rmp_code_statement& st(Id i) const {
    return row<rmp_code_statement>(c_.statements, i);
  }
  [[nodiscard]] Id operand(Id e, Id k) const { return row<Id>(c_.links, ex(e).first + k); }
  [[nodiscard]] std::string name(Id s) const { return symbol(s).name; }
  [[nodiscard]] Id meant(Id s) const {
    for (int k = 0; k < 64 && s < c_.symbols.count; ++k) {
      if (symbol(s).kind != RMP_SYMBOL_IMPORT) return s;
      s = symbol(s).value;
    }
    return RMP_NONE;
  }
  [[nodiscard]] Id root_of(Id e) const {
    while ((ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX) && ex(e).count > 0)
      e = operand(e, 0);
    return ex(e).op == RMP_EXPR_SYMBOL ? meant(ex(e).symbol) : RMP_NONE;
  }
  [[nodiscard]] bool is_shared_kind(Id s) const {
    const std::uint32_t k = symbol(s).kind;
    return symbol(s).routine == RMP_NONE &&
           (k == RMP_SYMBOL_VARIABLE || k == RMP_SYMBOL_OUTPUT || k == RMP_SYMBOL_INPUT);
  }
  [[nodiscard]] bool is_predefined(Id s) const {
    return symbol(s).scope < c_.scopes.count &&
           row<rmp_code_scope>(c_.scopes, symbol(s).scope).kind <= RMP_SCOPE_SYSTEM;
  }
  void fail(const rmp_span& span, std::string message, std::string hint) {
    part_.remarks.push_back({RMP_FAULT_ERROR, span, std::move(message), std::move(hint)});
  }
  void tell(std::uint32_t severity, const rmp_span& span, std::string message,
            std::string hint = "") {
    part_.remarks.push_back({severity, span, std::move(message), std::move(hint)});
  }
  [[nodiscard]] bool has_errors() const {
    return std::any_of(part_.remarks.begin(), part_.remarks.end(),
                       [](const Remark& r) { return r.severity == RMP_FAULT_ERROR; });
  }

  Result<void> find_robot() {
    std::string known;
    for (Id s = 0; s < c_.symbols.count; ++s) {
      if (symbol(s).kind != RMP_SYMBOL_ROBOT) continue;
      known += (known.empty() ? "" : ", ") + name(s);
      if (upper(name(s)) == upper(task_.robot)) robot_ = s;
    }
    if (robot_ != RMP_NONE) return {};
    return error(ErrorCode::unknown_name,
                 "the program has no robot \"" + std::string(task_.robot) + "\"",
                 known.empty() ? "It declares no ROBOT: leave only_robot out."
                               : "It declares " + known + ".",
                 "only_robot");
  }

  // ---- what routines do ----
  void add_use(Facts& f, Id s, How how, const rmp_span& span) const {
    if (s != RMP_NONE && is_shared_kind(s)) f.uses.push_back({s, how, span});
  }
  void read(Facts& f, Id first) const {
    std::vector<Id> open{first};
    while (!open.empty()) {
      const Id e = open.back();
      open.pop_back();
      if (e == RMP_NONE) continue;
      const rmp_code_expression& x = ex(e);
      if (x.op == RMP_EXPR_SYMBOL) {
        const Id s = meant(x.symbol);
        const bool is_semaphore = s != RMP_NONE && symbol(s).type == RMP_TYPE_SEMAPHORE;
        add_use(f, s, is_semaphore ? How::other : How::read, x.span);
        if (s != RMP_NONE && symbol(s).kind == RMP_SYMBOL_ROUTINE)
          f.asked.emplace_back(symbol(s).routine, x.span);
        continue;
      }
      if (x.op == RMP_EXPR_CALL || x.op == RMP_EXPR_INTRINSIC) arguments(f, x);
      for (Id k = 0; k < x.count; ++k) open.push_back(operand(e, k));
    }
  }
  /// What a call changes.
  void arguments(Facts& f, const rmp_code_expression& x) const {
    const Id s = meant(x.symbol);
    if (s == RMP_NONE) return;
    Id first = RMP_NONE;
    if (x.op == RMP_EXPR_CALL) {
      f.calls.insert(symbol(s).routine);
      first = routine(symbol(s).routine).first_parameter;
    } else if (x.type != RMP_TYPE_VOID) {
      return;  // functions of the language only look
    } else if (name(s) == "WRITE" || name(s) == "WRITELN") {
      return;
    }
    for (Id k = 0; k < x.count; ++k) {
      const Id e = row<Id>(c_.links, x.first + k);
      if (x.op == RMP_EXPR_CALL && symbol(first + k).mode == RMP_MODE_IN) continue;
      add_use(f, root_of(e), How::write, ex(e).span);
    }
  }
  void place(Facts& f, Id e) const {
    add_use(f, root_of(e), How::write, ex(e).span);
    for (; (ex(e).op == RMP_EXPR_FIELD || ex(e).op == RMP_EXPR_INDEX) && ex(e).count > 0;
         e = operand(e, 0))
      if (ex(e).op == RMP_EXPR_INDEX && ex(e).count > 1) read(f, operand(e, 1));
  }
  /// ACQUIRE or RELEASE of a semaphore by its name.
  bool handover(Facts& f, Id i) const {
    const rmp_code_statement& s = st(i);
    if (s.op != RMP_STMT_CALL || ex(s.a).op != RMP_EXPR_INTRINSIC || ex(s.a).count != 1)
      return false;
    const std::string_view what = symbol(ex(s.a).symbol).name;
    const Id e = operand(s.a, 0);
    if ((what != "ACQUIRE" && what != "RELEASE") || ex(e).op != RMP_EXPR_SYMBOL) return false;
    const Id which = meant(ex(e).symbol);
    if (which == RMP_NONE || !is_shared_kind(which)) return false;
    add_use(f, which, what == "ACQUIRE" ? How::acquire : How::release, s.span);
    f.handovers.emplace_back(i, which);
    return true;
  }
  void one(Facts& f, Id i) const {
    const rmp_code_statement& s = st(i);
    const auto target = [&] {
      const Id p = meant(s.symbol);
      return p == RMP_NONE ? RMP_NONE : symbol(p).routine;
    };
    if (handover(f, i)) return;
    if (s.op == RMP_STMT_ASSIGN) {
      place(f, s.a);
      read(f, s.b);
      return;
    }
    for (const Id e : {s.a, s.b, s.c}) read(f, e);
    for (Id k = 0; k < s.count; ++k) read(f, row<Id>(c_.links, s.first + k));
    switch (s.op) {
      case RMP_STMT_FOR:
      case RMP_STMT_FOR_DOWN:
        add_use(f, meant(s.symbol), How::write, s.span);
        f.has_loops = true;
        break;
      case RMP_STMT_TEACH: add_use(f, meant(s.symbol), How::write, s.span); break;
      case RMP_STMT_WHILE:
      case RMP_STMT_REPEAT:
      case RMP_STMT_LOOP:
      case RMP_STMT_GOTO: f.has_loops = true; break;
      case RMP_STMT_WAIT_FOR:
        if (s.b != RMP_NONE) f.timeouts.push_back(s.span);
        break;
      case RMP_STMT_HALT: f.halts.push_back(s.span); break;
      case RMP_STMT_START: f.starts.emplace_back(i, target()); break;
      case RMP_STMT_STOP:
      case RMP_STMT_CONTINUE:
      case RMP_STMT_CANCEL: f.controls.emplace_back(i, target()); break;
      case RMP_STMT_ENABLE:
        f.calls.insert(target());
        f.has_interrupts = true;
        break;
      case RMP_STMT_DISABLE: f.has_interrupts = true; break;
      case RMP_STMT_MOVE: motion(f, row<rmp_code_motion>(c_.motions, s.motion)); break;
      default: break;
    }
  }
  void motion(Facts& f, const rmp_code_motion& m) const {
    Id who = RMP_NONE;
    for (Id k = 0; k < m.target_count; ++k) read(f, row<Id>(c_.links, m.first_target + k));
    for (Id k = 0; k < m.attribute_count; ++k) {
      const auto& a = row<rmp_code_attribute>(c_.attributes, m.first_attribute + k);
      if (a.attribute == RMP_ATTR_ACT_ROB) who = root_of(a.value);
      else read(f, a.value);
    }
    read(f, m.until);
    if (m.action != RMP_NONE) f.calls.insert(m.action);
    f.motions.emplace_back(who, m.span);
  }
  void block(Facts& f, Id first) const {
    std::vector<Id> open{first};
    while (!open.empty()) {
      const Id i = open.back();
      open.pop_back();
      if (i == RMP_NONE) continue;
      open.push_back(st(i).next);
      open.push_back(st(i).body);
      one(f, i);
    }
  }
  void find_facts() {
    facts_.resize(c_.routines.count);
    for (Id r = 1; r < c_.routines.count; ++r) {
      block(facts_[r], routine(r).body);
      read(facts_[r], routine(r).condition);
    }
  }

  // ---- threads ----
  /// Statements that the program begins with: first values, then processes that start.
  void find_prefix() {
    bool started = false;
    for (rest_ = routine(0).body; rest_ != RMP_NONE; rest_ = st(rest_).next) {
      const rmp_code_statement& s = st(rest_);
      Facts f;
      one(f, rest_);
      if (s.op == RMP_STMT_ASSIGN && !started && f.calls.empty() &&
          std::none_of(f.uses.begin(), f.uses.end(), [&](const Use& u) {
            return u.how == How::read && symbol(u.symbol).kind != RMP_SYMBOL_VARIABLE;
          })) {
        first_values_.push_back(rest_);
      } else if (s.op == RMP_STMT_START) {
        started = true;
        first_starts_.emplace_back(rest_, f.starts[0].second);
      } else {
        break;
      }
    }
    block(facts_[0], rest_);
  }
  Thread thread_of(Id r) const {
    Thread t;
    t.routine = r;
    std::vector<Id> open{r};
    while (!open.empty()) {
      const Id i = open.back();
      open.pop_back();
      if (i >= c_.routines.count || !t.routines.insert(i).second) continue;
      const Facts& f = facts_[i];
      const auto add = [](auto& to, const auto& from) {
        to.insert(to.end(), from.begin(), from.end());
      };
      add(t.facts.uses, f.uses);
      add(t.facts.motions, f.motions);
      add(t.facts.starts, f.starts);
      add(t.facts.controls, f.controls);
      add(t.facts.halts, f.halts);
      add(t.facts.timeouts, f.timeouts);
      add(t.facts.handovers, f.handovers);
      add(t.facts.asked, f.asked);
      t.facts.has_loops |= f.has_loops;
      t.facts.has_interrupts |= f.has_interrupts;
      open.insert(open.end(), f.calls.begin(), f.calls.end());
    }
    return t;
  }
  [[nodiscard]] std::string called(const Thread& t) const {
    return t.routine == 0 ? "the program itself" : "the process " + name(routine(t.routine).symbol);
  }
  void find_threads() {
    std::set<Id> wanted{0};
    std::vector<Id> open{0};
    for (const auto& [statement, r] : first_starts_)
      if (wanted.insert(r).second) open.push_back(r);
    while (!open.empty()) {
      const Id r = open.back();
      open.pop_back();
      threads_.push_back(thread_of(r));
      for (const auto& [statement, p] : threads_.back().facts.starts)
        if (p < c_.routines.count && wanted.insert(p).second) open.push_back(p);
    }
    std::sort(threads_.begin(), threads_.end(),
              [](const Thread& a, const Thread& b) { return a.routine < b.routine; });
  }
  void place_threads() {
    // Where there is one robot, motions need not name it.
    Id only = robot_;
    for (Id s = 0; s < c_.symbols.count; ++s)
      if (symbol(s).kind == RMP_SYMBOL_ROBOT && s != robot_) only = RMP_NONE;
    for (Thread& t : threads_) {
      for (const auto& [named, span] : t.facts.motions) {
        const Id who = named == RMP_NONE ? only : named;
        if (who == RMP_NONE || symbol(who).kind != RMP_SYMBOL_ROBOT) {
          fail(span, "this motion names no robot, but the program has several",
               "Give it ACT_ROB with the name of a ROBOT.");
          return;
        }
        if (t.moves && t.robot != who) {
          fail(span,
               called(t) + " moves " + name(t.robot) + " and, here, " + name(who) +
                   ", each with its own controller",
               "Move each robot in a separate process.");
          return;
        }
        t.moves = true;
        t.robot = who;
      }
      if (t.moves) moving_.insert(t.robot);
    }
    if (!moving_.contains(robot_)) {
      fail(symbol(robot_).span, "no motion executed by the program belongs to " + name(robot_),
           "Select a robot that moves.");
      return;
    }
    // The others by what they share; of equal ones that which is declared first.
    for (Thread& t : threads_) {
      if (t.moves) continue;
      std::map<Id, bool> own;  // symbols, and whether they are changed
      for (const Use& u : t.facts.uses) own[u.symbol] |= u.how != How::read;
      std::map<Id, std::set<Id>> with;
      for (const Thread& other : threads_)
        if (other.robot != RMP_NONE)
          for (const Use& u : other.facts.uses)
            if (const auto it = own.find(u.symbol);
                it != own.end() && (it->second || u.how != How::read))
              with[other.robot].insert(u.symbol);
      t.robot = *moving_.begin();
      for (const auto& [who, what] : with)
        if (what.size() > with[t.robot].size()) t.robot = who;
    }
  }
  [[nodiscard]] bool is_here(const Thread& t) const { return t.robot == robot_; }
  [[nodiscard]] const Thread* thread(Id r) const {
    const auto it = std::find_if(threads_.begin(), threads_.end(),
                                 [&](const Thread& t) { return t.routine == r; });
    return it == threads_.end() ? nullptr : &*it;
  }
  void check_starts() {
    for (const Thread& t : threads_) {
      for (const auto& [statement, p] : t.facts.starts)
        if (const Thread* other = thread(p); other && other->robot != t.robot)
          fail(st(statement).span,
               called(*other) + " is of " + name(other->robot) +
                   ", which starts on its own controller, but is started here by " + called(t) +
                   " of " + name(t.robot),
               "Start it before anything else, and let it ACQUIRE a semaphore that is RELEASEd "
               "here.");
      for (const auto& [p, span] : t.facts.asked)
        if (const Thread* other = thread(p); other && other->robot != t.robot)
          fail(span,
               called(*other) + " is of " + name(other->robot) +
                   ", and another controller cannot see its state",
               "Make it set a variable that nothing else assigns.");
      for (const auto& [statement, p] : t.facts.controls)
        if (const Thread* other = thread(p); other && other->robot != t.robot)
          fail(st(statement).span,
               called(*other) + " is of " + name(other->robot) +
                   ", and a controller cannot stop or continue a process of another one",
               "Make it wait for a semaphore, or for a variable that only " + called(t) +
                   " gives values.");
    }
  }

  // ---- what controllers share ----
  struct Sides {
    std::set<Id> readers, writers, acquirers, releasers, others;  ///< robots
    std::set<Id> acquiring, releasing;                            ///< threads
    rmp_span here{};                                              ///< the first use of this part
    rmp_span second{};  ///< the first use that writes, of another robot than the first writer
    bool is_here = false;
  };
  [[nodiscard]] const Line* line(const std::string& n) const {
    for (const Line& l : task_.lines)
      if (upper(l.name) == upper(n)) return &l;
    return nullptr;
  }
  /// The other controller; RMP_NONE = there is none, or an error was said.
  void partner(Id other, const rmp_span& span) {
    if (partner_ != RMP_NONE && partner_ != other) {
      fail(span,
           name(robot_) + " shares something with " + name(partner_) + " and with " + name(other) +
               ", but only two controllers can start together",
           "Hand over between pairs of robots, or write a program for each robot.");
      return;
    }
    partner_ = other;
  }
  void needs(const std::string& n, bool is_out, std::uint32_t type, const rmp_span& span,
             const std::string& why) {
    const Line* l = line(n);
    const bool is_shared = !l && task_.shares;
    if (!l && !is_shared) {
      wanted_.push_back(n);
      if (!missing_) missing_ = span, missing_why_ = why;
      return;
    }
    (is_out ? part_.out : part_.in).push_back(n);
    if (is_shared) part_.shared.push_back(n);
    // Those that have a name only are numbered for the language.
    const auto at = l && l->number >= 0
                        ? l->number
                        : static_cast<std::int32_t>(1000 + part_.out.size() + part_.in.size());
    signals_.push_back({std::string(gap()) + (is_out ? "OUTPUT " : "INPUT ") +
                            (type == RMP_TYPE_INT ? "INT: " : "BOOL: ") + n + " AT " +
                            std::to_string(at) + ";",
                        span});
    if (!l || l->number < 0 || l->has_kind) return;
    for (Id s = 0; s < c_.symbols.count; ++s) {
      const rmp_code_symbol& other = symbol(s);
      const bool is_same = other.kind == (is_out ? RMP_SYMBOL_OUTPUT : RMP_SYMBOL_INPUT) &&
                           used_.contains(s) && upper(name(s)) != upper(n);
      if (is_same && !line(name(s)) && l->number >= other.address &&
          l->number < other.address + std::max(other.width, 1))
        fail(span,
             "the line " + n + " has the number " + std::to_string(l->number) +
                 " in the controller's record, as the signal " + name(s) + " of the program has",
             "Give one of them another number there.");
    }
  }
  [[nodiscard]] const char* gap() const { return task_.keeps_lines ? " " : "\n  "; }
  /// Adds to what stands before the program's BEGIN.
  struct Piece {
    std::string text;
    rmp_span span;
  };
  [[nodiscard]] const char* line_end() const { return task_.keeps_lines ? " " : "\n"; }
  std::string unique(std::string n) {
    if (names_.empty())
      for (Id s = 0; s < c_.symbols.count; ++s) names_.insert(upper(name(s)));
    while (!names_.insert(upper(n)).second) n += "_x";
    return n;
  }
  bool is_free(const std::string& n, const rmp_span& span) {
    if (unique(n) == n) return true;
    fail(span, "the line " + n + " has a name already used in the program", "Rename that.");
    return false;
  }
  void find_couplings() {
    std::map<Id, Sides> all;
    for (const Thread& t : threads_) {
      for (const Use& u : t.facts.uses) {
        Sides& s = all[u.symbol];
        switch (u.how) {
          case How::read: s.readers.insert(t.robot); break;
          case How::write:
            s.writers.insert(t.robot);
            if (s.writers.size() == 2 && s.second.line == 0) s.second = u.span;
            break;
          case How::acquire: s.acquirers.insert(t.robot), s.acquiring.insert(t.routine); break;
          case How::release: s.releasers.insert(t.robot), s.releasing.insert(t.routine); break;
          case How::other: s.others.insert(t.robot); break;
        }
        if (is_here(t) && !s.is_here) s.is_here = true, s.here = u.span;
        if (is_here(t)) used_.insert(u.symbol);
      }
      // Motions look at what the system's variables say.
      if (t.moves)
        for (Id v = 0; v < c_.symbols.count; ++v)
          if (is_shared_kind(v) && is_predefined(v)) all[v].readers.insert(t.robot);
    }
    owners(all);
    for (const auto& [s, sides] : all) {
      if (symbol(s).type == RMP_TYPE_SEMAPHORE) semaphore(s, sides);
      else if (symbol(s).kind == RMP_SYMBOL_INPUT) input(s, sides);
      else variable(s, sides);
    }
    if (partner_ != RMP_NONE && !has_errors()) beginning();
    if (missing_) {
      std::string names;
      for (const std::string& n : wanted_) names += (names.empty() ? "" : ", ") + n;
      fail(*missing_,
           missing_why_ + (task_.controller.empty()
                               ? ", but no controller record defines lines between them"
                               : ", and the record " + std::string(task_.controller) +
                                     " defines no lines between them"),
           "Give a profile with the signals " + names + ", with their numbers there.");
    }
  }
  void semaphore(Id s, const Sides& x) {
    std::set<Id> robots = x.acquirers;
    robots.insert(x.releasers.begin(), x.releasers.end());
    robots.insert(x.others.begin(), x.others.end());
    if (robots.size() < 2 || !x.is_here) return;
    const std::string n = name(s);
    if (!x.others.empty() || symbol(s).span.file != main_file_) {
      fail(x.here, "the semaphore " + n + " of two controllers is not used by name only",
           "Use a semaphore declared by the program itself in ACQUIRE and RELEASE.");
      return;
    }
    if (x.acquirers.size() != 1 || x.releasers.size() != 1) {
      fail(
          x.here,
          "the semaphore " + n +
              (x.acquirers.size() > 1 ? " is acquired by two controllers"
                                      : " is released by two controllers") +
              ", but lines between them have one direction",
          "Use a semaphore for each direction: one controller RELEASEs it, the other ACQUIREs it.");
      return;
    }
    if (x.acquiring.size() != 1 || x.releasing.size() != 1) {
      fail(x.here, "the semaphore " + n + " of two controllers is used by two processes of one",
           "Use a semaphore for each of these processes.");
      return;
    }
    std::int64_t count = 0;
    if (symbol(s).value != RMP_NONE && ex(symbol(s).value).constant != RMP_NONE)
      count = row<rmp_code_constant>(c_.constants, ex(symbol(s).value).constant).integer;
    if (count > 1) {
      fail(symbol(s).span,
           "the semaphore " + n + " begins with " + std::to_string(count) +
               ", but a line between two controllers can hold only one",
           "Use several semaphores that begin with 1, or write a program for each robot.");
      return;
    }
    const bool releases = *x.releasers.begin() == robot_;
    partner(releases ? *x.acquirers.begin() : *x.releasers.begin(), x.here);
    const std::string why = "the semaphore " + n + " is released by " + name(*x.releasers.begin()) +
                            " and acquired by " + name(*x.acquirers.begin()) +
                            ", which are two controllers";
    const std::string released = n + "_released", acquired = n + "_acquired";
    if (!is_free(released, x.here) || !is_free(acquired, x.here)) return;
    needs(released, releases, RMP_TYPE_BOOL, x.here, why);
    needs(acquired, !releases, RMP_TYPE_BOOL, x.here, why);
    const std::string phase = unique(n + "_phase");
    const std::string procedure = unique((releases ? "release_" : "acquire_") + n);
    phases_.push_back({(phases_.empty() ? "VAR BOOL: " : ", ") + phase, x.here});
    // There is one as long as the two lines differ; each side changes its own.
    const std::string seen = releases ? acquired : released, set = releases ? released : acquired;
    const std::string yes = "WAIT FOR " + seen + ";", no = "WAIT FOR NOT " + seen + ";";
    procedures_.push_back({"PROCEDURE " + procedure + "();" + line_end() + "BEGIN" + gap() + "IF " +
                               phase + " THEN " + (releases ? yes : no) + " ELSE " +
                               (releases ? no : yes) + " ENDIF;" + gap() + phase + " := NOT " +
                               phase + ";" + gap() + set + " := " + phase + ";" + line_end() +
                               "ENDPROC;" + line_end(),
                           x.here});
    const char* first = !releases && count == 1 ? "TRUE" : "FALSE";
    first_lines_ += phase + " := " + first + ";" + gap() + set + " := " + phase + ";" + gap();
    called_for_[s] = procedure;
    moved_.insert(s);
    if (releases)
      tell(RMP_FAULT_NOTE, x.here,
           "RELEASE of " + n + " waits there while " + name(partner_) +
               " has not acquired the previous one: a line can hold only one");
  }
  void input(Id s, const Sides& x) {
    if (x.readers.size() < 2 || !x.is_here) return;
    tell(RMP_FAULT_NOTE, x.here,
         "the input " + name(s) + " is read by several controllers and must be wired to each");
  }
  void variable(Id s, const Sides& x) {
    if (x.writers.empty()) return;
    const bool is_output = symbol(s).kind == RMP_SYMBOL_OUTPUT;
    const std::string what = (is_output ? "the output " : "") + name(s);
    if (x.writers.size() > 1) {
      if (!is_predefined(s) || name(s) != "R_TIMEOUT")
        fail(
            x.second, what + " is written by two controllers",
            is_output
                ? "An output belongs to one controller: make the other request it with a semaphore."
                : kOwn);
      return;
    }
    const Id from = *x.writers.begin();
    std::set<Id> to = x.readers;
    to.erase(from);
    if (to.empty()) return;
    if (is_predefined(s)) {
      fail(x.is_here ? x.here : symbol(s).span,
           what + " is set by " + name(from) + " while " + name(*to.begin()) +
               " moves on another controller",
           "Give the motions the attribute instead, or set it before the first START.");
      return;
    }
    if (!x.is_here) return;
    const std::uint32_t type = symbol(s).type;
    if ((type != RMP_TYPE_BOOL && type != RMP_TYPE_INT) || symbol(s).span.file != main_file_) {
      fail(x.here,
           what + " is written by " + name(from) + " and read by " + name(*to.begin()) +
               ", which are two controllers, and is not a BOOL or INT of the program itself",
           kOwn);
      return;
    }
    for (const Id i : first_values_)
      if (root_of(st(i).a) == s) {
        fail(st(i).span,
             what + " is passed from one controller to another and gets its first value here",
             "Set it in its declaration.");
        return;
      }
    if (from == robot_) {
      for (const Id r : to) partner(r, x.here);
    } else if (to.contains(robot_)) {
      partner(from, x.here);
    } else {
      return;
    }
    const std::string why = what + " is written by " + name(from) + " and read by " +
                            name(from == robot_ ? *to.begin() : robot_) +
                            ", which are two controllers";
    if (is_output && from == robot_) {  // it is a line already
      part_.out.push_back(name(s));
      return;
    }
    needs(name(s), from == robot_, type, x.here, why);
    moved_.insert(s);
    if (from != robot_) return;
    std::string value = first_value(s);
    if (value.empty()) value = type == RMP_TYPE_BOOL ? "FALSE" : "0";
    first_lines_ += name(s) + " := " + value + ";" + gap();
  }
  /// Outputs that first values are given, and whose they are.
  void owners(const std::map<Id, Sides>& all) {
    const Thread* own = thread(0);
    for (const Id i : first_values_) {
      const Id s = root_of(st(i).a);
      if (s == RMP_NONE || symbol(s).kind != RMP_SYMBOL_OUTPUT) continue;
      const auto it = all.find(s);
      const Id owner =
          it == all.end() || it->second.writers.empty() ? own->robot : *it->second.writers.begin();
      if (owner != robot_) dropped_.push_back(i);
      else used_.insert(s);
    }
    for (const Id i : first_values_) {
      if (std::count(dropped_.begin(), dropped_.end(), i)) continue;
      Facts f;
      one(f, i);
      for (const Use& u : f.uses) used_.insert(u.symbol);
    }
    for (Id s = 0; s < c_.symbols.count; ++s) {
      if (!is_shared_kind(s) || symbol(s).value == RMP_NONE) continue;
      Facts f;
      read(f, symbol(s).value);
      for (const Use& u : f.uses) used_.insert(u.symbol);
    }
  }
  /// Both begin together. The lines may be left as they were when a part was ended: the one that
  /// follows is down long enough to be seen, and goes on only when the other has seen it up and has
  /// set its lines; that one goes on only when the first has set its own and is down again.
  void beginning() {
    const bool leads = robot_ < partner_;
    const std::string own = name(robot_) + "_starts", other = name(partner_) + "_starts";
    const std::string why =
        name(robot_) + " and " + name(partner_) + " wait for each other on two controllers";
    const rmp_span span = routine(0).span;
    if (!is_free(own, span) || !is_free(other, span)) return;
    needs(own, true, RMP_TYPE_BOOL, span, why);
    needs(other, false, RMP_TYPE_BOOL, span, why);
    begin_ = unique("begin_together");
    const auto wait = [&](bool is_on) {
      return std::string("WAIT FOR ") + (is_on ? "" : "NOT ") + other + ";";
    };
    const auto set = [&](bool is_on) { return own + (is_on ? " := TRUE;" : " := FALSE;"); };
    procedures_.push_back(
        {"PROCEDURE " + begin_ + "();" + line_end() + "BEGIN" + gap() +
             (leads ? wait(false) + gap() + set(true) + gap() + wait(true) + gap() + first_lines_ +
                          set(false) + gap() + wait(false)
                    : set(false) + gap() + "WAIT 0.2 SEC;" + gap() + wait(true) + gap() +
                          first_lines_ + set(true) + gap() + wait(false) + gap() + set(false)) +
             line_end() + "ENDPROC;" + line_end(),
         span});
  }

  void tell_what_is_left_out() {
    std::map<Id, std::string> names;
    rmp_span first{};
    for (const Thread& t : threads_) {
      if (is_here(t)) continue;
      if (first.line == 0) first = t.routine == 0 ? st_span_of_rest() : routine(t.routine).span;
      if (t.routine == 0 && rest_ == RMP_NONE) continue;
      std::string& to = names[t.robot];
      to += (to.empty() ? "" : ", ") + (t.routine == 0
                                            ? "the statements of the main program from line " +
                                                  std::to_string(st(rest_).span.line)
                                            : name(routine(t.routine).symbol));
    }
    std::string all;
    for (const auto& [who, what] : names) all += "; of " + name(who) + " are " + what;
    if (!all.empty() && !task_.shares)
      tell(RMP_FAULT_NOTE, first,
           "the part of " + name(robot_) + " is posted, and the others are left out" + all);
    if (!part_.shared.empty())
      tell(RMP_FAULT_NOTE, routine(0).span,
           "the program of " + name(robot_) + " shares variables with that of " + name(partner_) +
               ": each robot has its own program",
           "Load each into the task of its robot; they start together.");
    if (part_.out.size() + part_.in.size() > part_.shared.size()) {
      const auto list = [](const std::vector<std::string>& v) {
        std::string s;
        for (const std::string& n : v) s += (s.empty() ? "" : ", ") + n;
        return s.empty() ? std::string("none") : s;
      };
      tell(RMP_FAULT_NOTE, routine(0).span,
           "the controllers of " + name(robot_) + " and " + name(partner_) +
               " are joined by lines: this one sets " + list(part_.out) + ", and reads " +
               list(part_.in),
           "Wire each to the line of the same name on the other controller; a line that is set "
           "first must also arrive there first.");
    }
    for (const Thread& t : threads_)
      if (is_here(t) && moving_.size() > 1)
        for (const rmp_span& h : t.facts.halts)
          tell(RMP_FAULT_WARNING, h, "HALT ends the part of " + name(robot_) + " only");
  }
  [[nodiscard]] rmp_span st_span_of_rest() const {
    return rest_ == RMP_NONE ? routine(0).span : st(rest_).span;
  }

  // ---- the text ----
  [[nodiscard]] std::string_view word(std::size_t t) const {
    return t < tokens_.size()
               ? task_.text.substr(tokens_[t].begin, tokens_[t].end - tokens_[t].begin)
               : std::string_view();
  }
  [[nodiscard]] bool is(std::size_t t, std::string_view w) const { return upper(word(t)) == w; }
  [[nodiscard]] std::size_t token_at(std::uint32_t begin) const {
    const auto it = std::lower_bound(tokens_.begin(), tokens_.end(), begin,
                                     [](const Token& a, std::uint32_t b) { return a.begin < b; });
    return static_cast<std::size_t>(it - tokens_.begin());
  }
  [[nodiscard]] std::size_t semicolon(std::size_t t) const {
    while (t < tokens_.size() && word(t) != ";") ++t;
    return std::min(t, tokens_.size() - 1);
  }
  /// Behind the value of a declaration.
  [[nodiscard]] std::size_t value_end(std::size_t t) const {
    for (int depth = 0; t < tokens_.size(); ++t) {
      if (word(t) == "(" || word(t) == "[") ++depth;
      if (word(t) == ")" || word(t) == "]") --depth;
      if (depth == 0 && (word(t) == "," || word(t) == ";")) break;
    }
    return t;
  }
  void cut(std::size_t from, std::size_t to) {
    edits_.push_back({tokens_[from].begin, tokens_[to].end, ""});
  }
  void cut_statement(Id i) {
    const std::size_t t = token_at(st(i).span.begin);
    cut(t, semicolon(t));
  }
  [[nodiscard]] std::string first_value(Id s) const {
    const std::size_t t = token_at(symbol(s).span.begin);
    if (word(t + 1) != ":=") return "";
    const std::size_t end = value_end(t + 2);
    std::string out(
        task_.text.substr(tokens_[t + 2].begin, tokens_[end - 1].end - tokens_[t + 2].begin));
    std::replace(out.begin(), out.end(), '\n', ' ');
    return out;
  }
  /// Takes names out of declarations of variables.
  void take_out(const std::set<Id>& symbols) {
    std::map<std::size_t, std::set<std::size_t>> by_colon;
    for (const Id s : symbols) {
      if (symbol(s).span.file != main_file_) continue;
      const std::size_t t = token_at(symbol(s).span.begin);
      std::size_t colon = t;
      if (symbol(s).kind != RMP_SYMBOL_VARIABLE) {  // a signal stands alone
        cut(t - 3, semicolon(t));
        continue;
      }
      while (colon > 0 && word(colon) != ":") --colon;
      by_colon[colon].insert(t);
    }
    for (const auto& [colon, out] : by_colon) {
      std::string kept;
      std::size_t t = colon + 1;
      for (;;) {
        const std::size_t end = value_end(t);
        if (!out.contains(t))
          kept += (kept.empty() ? "" : ", ") +
                  std::string(
                      task_.text.substr(tokens_[t].begin, tokens_[end - 1].end - tokens_[t].begin));
        t = end + 1;
        if (word(end) != ",") break;
      }
      if (kept.empty()) cut(colon - 1, t - 1);
      else edits_.push_back({tokens_[colon + 1].begin, tokens_[t - 1].begin, kept});
    }
  }
  /// A routine from its first word to its last.
  [[nodiscard]] std::pair<std::size_t, std::size_t> routine_tokens(Id r) const {
    std::size_t t = token_at(symbol(routine(r).symbol).span.begin);
    const std::size_t begin = t - 1;
    while (t < tokens_.size() && !is(t, "ENDPROC") && !is(t, "ENDFCT") && !is(t, "ENDPROCESS") &&
           !is(t, "ENDINTERRUPT"))
      ++t;
    return {begin, semicolon(t)};
  }
  /// The only process besides the program, where nothing that the program does itself counts while
  /// it runs.
  [[nodiscard]] std::optional<Id> plain_process() const {
    std::optional<Id> found;
    for (const Thread& t : threads_)
      if (is_here(t) && t.routine != 0) {
        if (found) return std::nullopt;
        found = t.routine;
      }
    if (!found || routine(*found).span.file != main_file_) return std::nullopt;
    int starts = 0;
    for (const auto& [statement, p] : first_starts_) starts += p == *found;
    const Thread& process = *thread(*found);
    if (starts != 1 || !process.facts.asked.empty() || !process.facts.controls.empty() ||
        !process.facts.starts.empty())
      return std::nullopt;
    const Thread& own = *thread(0);
    if (!is_here(own) || rest_ == RMP_NONE) return found;
    const Facts& f = own.facts;
    if (own.moves || f.has_loops || f.has_interrupts || process.facts.has_interrupts ||
        !f.asked.empty() || !f.controls.empty() || !f.starts.empty() || !f.handovers.empty())
      return std::nullopt;
    for (const Use& u : f.uses) {
      if (symbol(u.symbol).kind != RMP_SYMBOL_VARIABLE || moved_.contains(u.symbol))
        return std::nullopt;
      if (u.how != How::read && std::any_of(process.facts.uses.begin(), process.facts.uses.end(),
                                            [&](const Use& p) { return p.symbol == u.symbol; }))
        return std::nullopt;
    }
    return found;
  }
  void write() {
    std::set<Id> kept_routines;
    for (const Thread& t : threads_)
      if (is_here(t)) kept_routines.insert(t.routines.begin(), t.routines.end());
    const bool has_main = is_here(*thread(0));
    const std::optional<Id> plain = plain_process();
    if (!has_main) kept_routines.erase(0);
    for (Id r = 1; r < c_.routines.count; ++r) {
      if (kept_routines.contains(r) || routine(r).kind == RMP_ROUTINE_DATA_LIST ||
          routine(r).span.file != main_file_)
        continue;
      const auto [from, to] = routine_tokens(r);
      cut(from, to);
    }
    std::set<Id> out = moved_;
    for (Id s = 0; s < c_.symbols.count; ++s)
      if (is_shared_kind(s) && !used_.contains(s) && !is_predefined(s) &&
          (symbol(s).kind != RMP_SYMBOL_VARIABLE || symbol(s).type == RMP_TYPE_SEMAPHORE))
        out.insert(s);
    take_out(out);
    for (const Id r : kept_routines)
      for (const auto& [i, s] : facts_[r].handovers) {
        const auto it = called_for_.find(s);
        if (it == called_for_.end() || st(i).span.file != main_file_) continue;
        const std::size_t t = token_at(st(i).span.begin);
        edits_.push_back({tokens_[t].begin, tokens_[semicolon(t)].end, it->second + ";"});
      }
    write_beginning(plain, has_main);
    if (plain) write_plain(*plain);
    apply();
  }
  void write_beginning(const std::optional<Id>& plain, bool has_main) {
    std::size_t begin = tokens_.size() - 1;
    while (begin > 0 && !is(begin, "BEGIN")) --begin;
    std::string all;
    const auto add = [&](const std::vector<Piece>& pieces, const char* before,
                         const std::string& behind) {
      if (pieces.empty()) return;
      all += before;
      for (const Piece& p : pieces) {
        const auto from = static_cast<std::uint32_t>(all.size());
        all += p.text;
        part_.made_for.push_back({from, static_cast<std::uint32_t>(all.size()), p.span});
      }
      all += behind;
    };
    add(signals_, "SIGNAL", line_end());
    add(phases_, "", std::string(";") + line_end());
    add(procedures_, "", "");
    made_at_ = tokens_[begin].begin;
    edits_.push_back({made_at_, made_at_, all});
    if (!begin_.empty())
      edits_.push_back({tokens_[begin].end, tokens_[begin].end, gap() + begin_ + ";"});
    for (const Id i : dropped_) cut_statement(i);
    for (const auto& [i, p] : first_starts_) {
      if (!is_here(*thread(p))) cut_statement(i);
      else if (plain == p) {
        const std::size_t t = token_at(st(i).span.begin);
        edits_.push_back(
            {tokens_[t].begin, tokens_[semicolon(t)].end, name(routine(p).symbol) + ";"});
      }
    }
    if (!has_main && rest_ != RMP_NONE) {
      std::size_t end = tokens_.size() - 1;
      while (end > 0 && !is(end, "ENDPROGRAM")) --end;
      cut(token_at(st(rest_).span.begin), end - 1);
    }
    // A name of its own, so that files of the parts may lie together.
    const std::size_t named = token_at(symbol(routine(0).symbol).span.begin);
    if (moving_.size() > 1 && is(named - 1, "PROGRAM"))
      edits_.push_back({tokens_[named].end, tokens_[named].end, "_" + name(robot_)});
  }
  void write_plain(Id r) {
    const auto [from, to] = routine_tokens(r);
    edits_.push_back({tokens_[from].begin, tokens_[from].end, "PROCEDURE"});
    const std::size_t head = semicolon(from);
    if (is(from + 2, "PRIORITY")) cut(from + 2, head - 1);
    edits_.push_back({tokens_[to - 1].begin, tokens_[to - 1].end, "ENDPROC"});
    const Thread& own = *thread(0);
    if (!is_here(own) || rest_ == RMP_NONE) return;
    const std::string which = name(routine(r).symbol);
    tell(own.facts.timeouts.empty() && own.facts.halts.empty() ? RMP_FAULT_NOTE : RMP_FAULT_WARNING,
         st(rest_).span,
         "the part has one process, " + which +
             ", and becomes a program without processes: the following statements come after it" +
             (own.facts.timeouts.empty() ? "" : ", and TIMEOUT counts from its end"));
  }
  void apply() {
    std::stable_sort(edits_.begin(), edits_.end(),
                     [](const Edit& a, const Edit& b) { return a.begin < b.begin; });
    std::string& out = part_.text;
    std::uint32_t at = 0;
    for (const Edit& e : edits_) {
      if (e.begin < at) continue;  // within what is cut
      std::uint32_t end = e.end;
      out += task_.text.substr(at, e.begin - at);
      if (e.begin == made_at_ && e.end == made_at_)
        for (MadeFor& m : part_.made_for) {
          m.begin += static_cast<std::uint32_t>(out.size());
          m.end += static_cast<std::uint32_t>(out.size());
        }
      out += e.text;
      const auto lines = [](std::string_view s) { return std::count(s.begin(), s.end(), '\n'); };
      const auto gone = lines(task_.text.substr(e.begin, e.end - e.begin)) - lines(e.text);
      if (task_.keeps_lines) {
        if (gone > 0) out.append(static_cast<std::size_t>(gone), '\n');
      } else if (e.text.empty() && end > e.begin) {
        // With its line, where nothing else stands there.
        std::size_t first = out.size();
        while (first > 0 && out[first - 1] == ' ') --first;
        while (end < task_.text.size() && (task_.text[end] == ' ' || task_.text[end] == '\r'))
          ++end;
        if ((first == 0 || out[first - 1] == '\n') && end < task_.text.size() &&
            task_.text[end] == '\n') {
          out.resize(first);
          ++end;
        }
      }
      at = end;
    }
    out += task_.text.substr(at);
  }

  const PartTask& task_;
  const rmp_code& c_;
  Part part_;
  Id robot_ = RMP_NONE, partner_ = RMP_NONE;
  std::uint32_t main_file_ = 0;
  std::vector<Token> tokens_;
  std::vector<Facts> facts_;  ///< by routine; of the program itself what follows its beginning
  std::vector<Id> first_values_;
  std::vector<std::pair<Id, Id>> first_starts_;
  Id rest_ = RMP_NONE;  ///< the first statement behind those
  std::vector<Thread> threads_;
  std::set<Id> moving_;  ///< robots
  std::set<Id> used_;    ///< symbols, in this part
  std::set<Id> moved_;   ///< those that become lines
  std::vector<Id> dropped_;
  std::map<Id, std::string> called_for_;  ///< procedures in place of ACQUIRE and RELEASE
  std::set<std::string> names_;
  std::vector<std::string> wanted_;  ///< lines that the record lacks
  std::optional<rmp_span> missing_;
  std::string missing_why_;
  std::vector<Piece> signals_, phases_, procedures_;
  std::string first_lines_, begin_;
  std::uint32_t made_at_ = 0;  ///< before the program's BEGIN
  std::vector<Edit> edits_;
};

}  // namespace

Result<Part> part_of_robot(const PartTask& task) { return Splitter(task).run(); }

std::vector<std::string> robots_that_move(const rmp_code& code) {
  std::set<Id> found;
  for (Id a = 0; a < code.attributes.count; ++a) {
    const auto& x = row<rmp_code_attribute>(code.attributes, a);
    if (x.attribute != RMP_ATTR_ACT_ROB) continue;
    Id s = row<rmp_code_expression>(code.expressions, x.value).symbol;
    for (int k = 0; k < 64 && s < code.symbols.count; ++k) {
      const auto& named = row<rmp_code_symbol>(code.symbols, s);
      if (named.kind == RMP_SYMBOL_ROBOT) found.insert(s);
      if (named.kind != RMP_SYMBOL_IMPORT) break;
      s = named.value;
    }
  }
  std::vector<std::string> out;
  for (const Id s : found) out.emplace_back(row<rmp_code_symbol>(code.symbols, s).name);
  return out;
}

}  // namespace robomosp::program_post

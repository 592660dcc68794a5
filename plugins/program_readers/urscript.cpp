// SPDX-License-Identifier: Apache-2.0
// Universal Robots URScript: .script.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kUrscriptStyle{.comment = "#",
                           .quotes = "\"'",
                           .name_first = "_",
                           .name_rest = "_",
                           .signs = {"==", "!=", "<=", ">="},
                           .has_lines = true,
                           .joins_in_brackets = true,
                           .hex = "0x"};
constexpr Binary kUrscriptBinaries[] = {
    {"or", 10, Op::or_}, {"xor", 11, Op::exor}, {"and", 12, Op::and_}, {"==", 20, Op::eq},
    {"!=", 20, Op::ne},  {"<", 20, Op::lt},     {">", 20, Op::gt},     {"<=", 20, Op::le},
    {">=", 20, Op::ge},  {"+", 30, Op::add},    {"-", 30, Op::sub},    {"*", 40, Op::mul},
    {"/", 40, Op::div},  {"%", 40, Op::mod},    {"^", 50, Op::power}};

struct Argument {
  std::string name;
  Ex e;
};

class UrscriptReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    scan(0, kUrscriptStyle);
    rename_routines();
    find_routines();
    block(0);
    // What is called, and was not found as a statement.
    for (; next_def_ < defs_.size(); ++next_def_) {
      const Def& d = defs_[next_def_];
      if (d.is_main) continue;
      fail(here(), "the function or thread " + d.name + " is not read");
      if (d.is_thread) open("PROCESS " + globals_[lower(d.name)].irl, "ENDPROCESS", here());
      else begin(d.name, parameters(d), kNone, here());
      close();
    }
  }

 private:
  struct Def {
    std::string name;
    std::vector<std::string> parameters;
    int depth = 0;
    bool is_thread = false, is_main = false;
  };

  std::span<const Binary> binaries() const override { return kUrscriptBinaries; }
  std::string_view not_word() const override { return "not"; }
  int not_precedence() const override { return 15; }
  void skip_condition() override {
    while (!at_line_end() && !is(":")) next();
  }
  bool divides_whole() const override { return false; }

  // ---- structure ----

  /// Functions of one name, each within another one, get names that differ: the text sees the one
  /// of the innermost.
  void rename_routines() {
    struct Found {
      std::string low;
      std::size_t name, begin, end;  ///< tokens: its name; where it is known
    };
    struct Open {
      bool is_routine;
      std::size_t begin;  ///< token behind the head
      std::vector<std::size_t> defs;
    };
    std::vector<Found> found;
    std::vector<Open> open{{true, 0, {}}};
    bool begins = true;
    const auto close = [&](std::size_t end) {
      for (const std::size_t d : open.back().defs) found[d].end = end;
      open.pop_back();
    };
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i) {
      const Token& t = tokens_[i];
      const bool is_first =
          std::exchange(begins, t.kind == Tk::line || (t.low == ":" && t.kind == Tk::sign));
      if (t.kind != Tk::name || !is_first) continue;
      if (t.low == "def" || t.low == "thread" || t.low == "sec") {
        std::size_t in = open.size() - 1;
        while (!open[in].is_routine) --in;
        open[in].defs.push_back(found.size());
        found.push_back({tokens_[i + 1].low, i + 1, open[in].begin, tokens_.size()});
        open.push_back({true, i + 2, {}});
      } else if (t.low == "if" || t.low == "while") {
        open.push_back({false, i, {}});
      } else if (t.low == "end" && open.size() > 1) {
        close(i);
      }
    }
    while (!open.empty()) close(tokens_.size());
    std::map<std::string, std::vector<std::size_t>> by_name;
    for (std::size_t d = 0; d < found.size(); ++d) by_name[found[d].low].push_back(d);
    for (auto& [low, all] : by_name) {
      if (all.size() < 2) continue;
      // The innermost first: what is left of a name is that of the function around it.
      std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
        return found[a].end - found[a].begin < found[b].end - found[b].begin;
      });
      for (std::size_t k = 0; k + 1 < all.size(); ++k) {
        const Found& d = found[all[k]];
        const std::string& name =
            own_names_.emplace_back(std::string(tokens_[d.name].raw) + "_" + std::to_string(k + 2));
        const bool is_twice = std::any_of(all.begin(), all.end(), [&](std::size_t other) {
          return found[other].begin == d.begin && found[other].name > d.name;
        });
        // A second one beside it replaces it from there on.
        std::size_t end = d.end;
        for (const std::size_t other : all)
          if (found[other].begin == d.begin && found[other].name > d.name)
            end = std::min(end, found[other].name);
        if (is_twice)
          fail(tokens_[d.name].at,
               std::string(tokens_[d.name].raw.substr(0, 60)) +
                   " is defined twice; calls before the second definition use the first");
        for (std::size_t i = d.begin; i < end; ++i)
          if (tokens_[i].kind == Tk::name && tokens_[i].low == low) {
            tokens_[i].raw = name;
            tokens_[i].low = lower(name);
          }
      }
    }
  }
  void find_routines() {
    int depth = 0;
    bool has_statements = false;
    std::vector<std::size_t> top;
    bool begins = true;
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i) {
      const Token& t = tokens_[i];
      const bool is_first =
          std::exchange(begins, t.kind == Tk::line || (t.low == ":" && t.kind == Tk::sign));
      if (t.kind == Tk::name && is_first) {
        if (t.low == "def" || t.low == "thread" || t.low == "sec") {
          Def d;
          d.name = std::string(tokens_[i + 1].raw);
          d.depth = depth;
          d.is_thread = t.low == "thread";
          for (std::size_t k = i + 2;
               k < tokens_.size() && tokens_[k].kind != Tk::line && tokens_[k].low != ")"; ++k)
            if (tokens_[k].kind == Tk::name) {
              d.parameters.push_back(std::string(tokens_[k].raw));
              while (k + 1 < tokens_.size() && tokens_[k + 1].kind != Tk::line &&
                     tokens_[k + 1].low != "," && tokens_[k + 1].low != ")")
                ++k;
            }
          if (depth == 0 && !d.is_thread) top.push_back(defs_.size());
          defs_.push_back(std::move(d));
          ++depth;
        } else if (t.low == "if" || t.low == "while") {
          ++depth;
        } else if (t.low == "end") {
          depth = std::max(0, depth - 1);
        } else if (depth == 0 && t.low != "global" && t.low != "local") {
          has_statements = true;
        }
      }
    }
    // The program is what a controller would run: the statements outside, or a routine around all.
    if (!has_statements && !top.empty()) {
      for (std::size_t n = top.size(); n-- > 0;) {
        Def& d = defs_[top[n]];
        if (!d.parameters.empty()) continue;
        std::size_t uses = 0;
        for (const Token& t : tokens_) uses += t.kind == Tk::name && t.raw == d.name;
        if (uses > 1 && top.size() > 1) continue;
        d.is_main = true;
        name_ = d.name;
        break;
      }
    }
    for (const Def& d : defs_) {
      if (d.is_main) continue;
      if (d.is_thread) {
        Symbol& s = declare(d.name, kNone, Symbol::data);
        s.irl = irl_name(d.name);
        continue;
      }
      const auto r = learned_.types.find(lower(d.name) + "()");
      announce(d.name, parameters(d), r == learned_.types.end() ? kNone : r->second);
    }
  }
  std::vector<Parameter> parameters(const Def& d) const {
    std::vector<Parameter> out;
    for (const std::string& p : d.parameters) {
      const auto it = learned_.types.find(lower(d.name) + "." + lower(p));
      out.push_back({p, it == learned_.types.end() ? kReal : it->second, false});
    }
    return out;
  }

  void end_line() {
    if (!at_line_end())
      bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
  }
  /// Statements up to the END of a routine; those within blocks are kept in a list, no recursion.
  void block(int) {
    while (!at_end()) {
      if (progress_.cancelled()) {
        statement(here(), [] {});
        return;
      }
      if (peek().kind == Tk::line) {
        next();
        continue;
      }
      const At at = here();
      if (is("def") || is("thread") || is("sec")) {
        definition(at);
        continue;
      }
      if (is("end")) {
        comments_until(at);
        next();
        end_block(at);
        continue;
      }
      statement(at, [&] { one(); });
      if (here().begin == at.begin && !at_end()) next();
    }
    while (!blocks_.empty()) {
      fail(here(), "a block above has no end");
      end_block(here());
    }
  }
  struct Block {
    std::string end;    ///< what closes it in IRL; "" = a routine
    std::string again;  ///< label of "continue"; "" = not used
    Routine* before = nullptr;
    std::string routine;
    bool is_loop = false, is_main = false, has_else = false;
  };
  void definition(const At& at) {
    next();
    if (next_def_ >= defs_.size()) {
      skip_line();
      return;
    }
    const Def& d = defs_[next_def_++];
    skip_rest();
    Block b;
    b.before = is_in_main() ? nullptr : &current();
    b.routine = routine_;
    b.is_main = d.is_main;
    indents_.push_back(current().indent);
    if (d.is_main) {
      close();
    } else if (d.is_thread) {
      open("PROCESS " + globals_[lower(d.name)].irl, "ENDPROCESS", at);
      routine_ = lower(d.name);
    } else {
      const auto r = learned_.types.find(lower(d.name) + "()");
      begin(d.name, parameters(d), r == learned_.types.end() ? kNone : r->second, at);
      routine_ = lower(d.name);
    }
    blocks_.push_back(std::move(b));
  }
  void end_block(const At& at) {
    if (blocks_.empty()) {
      fail(at, "\"end\" has no open block");
      return;
    }
    Block b = std::move(blocks_.back());
    blocks_.pop_back();
    if (b.end.empty()) {
      if (b.before) set_current(*b.before);
      else close();
      routine_ = b.routine;
      current().indent = indents_.back();
      indents_.pop_back();
      return;
    }
    if (!b.again.empty()) emit("LABEL " + b.again + ":", at);
    indented(-1);
    emit(b.end + ";", at);
  }

  // ---- statements ----

  /// A loop of nothing but sync(), which may count get_steptime(), is a WAIT FOR. False = it is
  /// another loop.
  bool wait_loop(const At& at) {
    std::size_t k = at_;
    const auto to_line_end = [&] {
      while (tokens_[k].kind != Tk::line && tokens_[k].kind != Tk::end) ++k;
      return tokens_[k].kind == Tk::line && tokens_[k - 1].low == ":";
    };
    const auto has = [&](std::initializer_list<std::string_view> words) {
      std::size_t i = k;
      for (const std::string_view w : words) {
        if (i >= tokens_.size()) return false;
        if (w == "\n") {
          if (tokens_[i].kind != Tk::line) return false;
          while (tokens_[i].kind == Tk::line) ++i;
        } else if (tokens_[i++].low != w) {
          return false;
        }
      }
      k = i;
      return true;
    };
    if (!to_line_end()) return false;
    const std::size_t colon = k - 1;
    std::size_t limit = 0;
    Token count, told;
    if (!has({"\n", "sync", "(", ")", "\n", "end"})) {
      if (at_ < 4 || tokens_[at_ - 1].kind != Tk::line || tokens_[at_ - 2].kind != Tk::number ||
          tokens_[at_ - 2].value != 0 || tokens_[at_ - 3].low != "=")
        return false;
      count = tokens_[at_ - 4];
      // It is counted for this loop only.
      if (uses(count.low) != 4) return false;
      if (!has({"\n", "if", count.low, ">="})) return false;
      limit = k;
      if (!to_line_end() || !has({"\n"})) return false;
      if (tokens_[k].kind == Tk::name && tokens_[k + 1].low == "=") {
        told = tokens_[k];
        if (!has({told.low, "=", "true", "\n"})) return false;
      }
      if (!has({"break", "\n", "end", "\n", "sync", "(", ")", "\n", count.low, "=", count.low, "+",
                "get_steptime", "(", ")", "\n", "end"}))
        return false;
    }
    const std::size_t behind = k;
    next();
    const std::size_t first = at_;
    std::string until;
    if (accept("not")) {
      const Ex c = expression(not_precedence());
      if (c.ok && at_ == colon) until = converted(c, kBool, at).s;
    }
    if (until.empty()) {
      at_ = first;
      const Ex c = converted(expression(), kBool, at);
      if (c.ok && at_ != colon) bad(here(), "\":\" is expected here");
      until = "NOT " + within(c, kRel);
    }
    if (limit > 0) {
      at_ = limit;
      until += " TIMEOUT " + within(as_real(expression(), at), kSum);
    }
    emit("WAIT FOR " + until + ";", at);
    if (told.kind == Tk::name && limit > 0)
      if (const Symbol* s = find(told.low))
        emit("IF R_TIMEOUT THEN " + s->irl + " := TRUE; ENDIF;", at);
    at_ = behind;
    return true;
  }
  Ex truth(const At& at) {
    const Ex c = condition(at, [&] {
      const Ex e = expression();
      return is(":") ? e : bad(here(), "\":\" is expected here");
    });
    accept(":");
    return c;
  }
  void one() {
    const Token t = peek();
    const At at = t.at;
    if (is("$") && peek(1).kind == Tk::number) {
      // $ 3 "MoveJ": where the line comes from on the pendant.
      const Token words = peek(2);
      skip_rest();
      std::string clean;
      for (const char c : words.kind == Tk::text ? words.raw : std::string_view())
        clean += c == '{' ? '(' : c == '}' ? ')' : static_cast<unsigned char>(c) < 32 ? ' ' : c;
      if (!clean.empty()) emit("{ " + clean + " }", at);
      return;
    }
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      return;
    }
    if (t.low == "if" && !is("=", 1)) {
      next();
      const Ex c = truth(at);
      emit("IF " + c.s + " THEN", at);
      blocks_.push_back({"ENDIF", {}, nullptr, {}, false, false, false});
      indented(1);
      rest_of_line(at);
      return;
    }
    if (t.low == "elif" || t.low == "else" || t.low == "elseif") {
      if (blocks_.empty() || blocks_.back().end != "ENDIF") {
        bad(at, "this is outside \"if\"");
        skip_rest();
        return;
      }
      next();
      if (blocks_.back().has_else) {
        bad(at, "this \"if\" has an \"else\" already");
        skip_rest();
        return;
      }
      blocks_.back().has_else = t.low == "else";
      indented(-1);
      if (t.low == "else") {
        accept(":");
        emit("ELSE", at);
      } else {
        const Ex c = truth(at);
        emit("ELSIF " + c.s + " THEN", at);
      }
      indented(1);
      rest_of_line(at);
      return;
    }
    if (t.low == "while") {
      if (wait_loop(at)) return;
      next();
      const Ex c = truth(at);
      emit("WHILE " + c.s + " DO", at);
      blocks_.push_back({"ENDWHILE", {}, nullptr, {}, true, false, false});
      indented(1);
      rest_of_line(at);
      return;
    }
    if (t.low == "break" || t.low == "continue") {
      next();
      Block* loop = nullptr;
      for (std::size_t i = blocks_.size(); i-- > 0 && !blocks_[i].end.empty() && !loop;)
        if (blocks_[i].is_loop) loop = &blocks_[i];
      if (!loop) {
        bad(at, "this is outside a loop");
        return;
      }
      if (t.low == "break") {
        emit("EXIT;", at);
      } else {
        if (loop->again.empty()) loop->again = irl_name("again");
        emit("GOTO " + loop->again + ";", at);
      }
      return end_line();
    }
    if (t.low == "return") {
      next();
      if (at_line_end()) {
        emit("RETURN;", at);
        return;
      }
      if (routine_.empty()) {
        skip_rest();
        bad(at, "the program returns no value");
        return;
      }
      is_guessed_ = false;
      const Ex e = expression();
      if (!e.ok) return;
      if (!is_guessed_) learn(routine_ + "()", e.type);
      if (current().result.k != K::none)
        emit("RETURN " + converted(e, current().result, at).s + ";", at);
      return end_line();
    }
    if (t.low == "pass") {
      next();
      return end_line();
    }
    if (t.low == "halt") {
      next();
      emit("HALT;", at);
      return end_line();
    }
    if (t.low == "run" || t.low == "kill" || t.low == "join") {
      next();
      thread(t, at);
      return;
    }
    bool is_local = false;
    if ((t.low == "local" || t.low == "global") && peek(1).kind == Tk::name) {
      is_local = t.low == "local";
      next();
    }
    if (is("=", 1) || is("[", 1)) {
      assignment(is_local, at);
      return end_line();
    }
    if (is("(", 1)) {
      command(at);
      return end_line();
    }
    next();
    if ((t.low == "enter_critical" || t.low == "exit_critical") && at_line_end()) {
      note_line(at, "locks out other threads; IRL has no counterpart");
      return end_line();
    }
    bad(t.at, "\"" + std::string(t.raw.substr(0, 40)) + "\" does not begin a supported statement");
    skip_rest();
  }
  /// if c: statement
  void rest_of_line(const At&) {
    if (at_line_end()) return;
    if (is("end")) return;
    const At at = here();
    if (++nested_ < 40) statement(at, [&] { one(); });
    else skip_rest();
    --nested_;
  }
  void thread(const Token& what, const At& at) {
    const Token name = next();
    if (accept("(")) expect(")");
    const Symbol* s = find(name.low);
    if (!s || s->kind != Symbol::data) {
      // kill of a variable that holds the thread
      const auto it = threads_.find(name.low);
      s = it == threads_.end() ? nullptr : find(it->second);
    }
    if (!s) {
      bad(at, "there is no thread " + std::string(name.raw.substr(0, 40)));
      return;
    }
    if (what.low == "join") emit("WAIT FOR GETSTATUS(" + s->irl + ") = R_PROCESS_READY;", at);
    else emit((what.low == "run" ? "START " : "CANCEL ") + s->irl + ";", at);
    end_line();
  }
  void assignment(bool is_local, const At& at) {
    const Token name = next();
    if (is("[")) {
      --at_;
      const Ex to = primary();
      if (!expect("=")) return;
      const Ex e = expression();
      assign(to, e, at);
      return;
    }
    next();
    if (is("run") && peek(1).kind == Tk::name) {
      const Token run = next();
      threads_[name.low] = peek().low;
      thread(run, at);
      return;
    }
    Ex e = expression();
    if (!e.ok) return;
    if (e.type.k == K::none) {
      bad(at, "this returns no value");
      return;
    }
    if (e.s == "[]") {
      const auto known = learned_.types.find(routine_.empty() || learned_.types.contains(name.low)
                                                 ? name.low
                                                 : routine_ + "." + name.low);
      if (known == learned_.types.end() || known->second.k != K::array || !known->second.element) {
        if (!learned_.flags.insert("empty " + name.low).second)
          bad(at, "no other statement determines the element type of this empty list");
        return;
      }
      e.type = array_of(*known->second.element, {{0, -1}});
    }
    will_write(name.low);
    const bool is_inside = !routine_.empty();
    const auto local = current().symbols.find(name.low);
    if (is_inside && local == current().symbols.end() &&
        (is_local || !globals_.contains(name.low))) {
      const std::string key = routine_ + "." + name.low;
      if (is_local || !learned_.flags.contains("global " + name.low)) {
        learn(key, e.type);
        Symbol& s = declare(name.raw, learned_.types[key], Symbol::variable, true);
        declare_variable(s, {}, at, true);
      }
    }
    if (is_inside && current().symbols.contains(name.low)) {
      const std::string key = routine_ + "." + name.low;
      if (learned_.types.contains(key)) learn(key, e.type);
      const Symbol& s = current().symbols[name.low];
      give(place(s.irl, s.type), key, e, at);
      return;
    }
    if (!is_inside) learned_.flags.insert("global " + name.low);
    const Symbol& s = implied(name.raw, e.type, at);
    if (s.kind != Symbol::variable) {
      bad(at, std::string(name.raw) + " is not a variable");
      return;
    }
    give(place(s.irl, s.type), name.low, e, at);
  }
  /// Gives a variable its value; of lists, which may have another length each time, their elements.
  void give(const Ex& to, const std::string& key, const Ex& e, const At& at) {
    if (to.type.k != K::array || e.type.k != K::array || !e.ok) {
      assign(to, e, at);
      return;
    }
    if (e.type.bounds != to.type.bounds) learned_.flags.insert("length of " + key);
    if (!learned_.flags.contains("length of " + key)) {
      assign(to, e, at);
      return;
    }
    const std::string& length = length_of(to.s, key, at);
    if (e.type.bounds.size() != 1 || to.type.bounds.size() != 1 ||
        e.type.bounds[0].second > to.type.bounds[0].second) {
      bad(at, "this list is longer than the variable");
      return;
    }
    if (e.is_place) {
      const auto from = lengths_.find(e.s);
      for (std::int64_t i = 0; i <= e.type.bounds[0].second; ++i) {
        const std::string n = "[" + std::to_string(i) + "]";
        assign(place(to.s + n, *to.type.element), place(e.s + n, *e.type.element), at);
      }
      emit(length + " := " +
               (from == lengths_.end() ? std::to_string(e.type.bounds[0].second + 1)
                                       : from->second) +
               ";",
           at);
      return;
    }
    if (e.type.bounds[0].second >= 0 && (e.s.front() != '[' || e.s.size() < 3)) {
      bad(at,
          "a list of changing length can only be assigned lists of elements or other variables");
      return;
    }
    if (e.type.bounds[0].second >= 0 &&
        list_.size() != static_cast<std::size_t>(e.type.bounds[0].second) + 1) {
      bad(at, "a list of changing length can only be assigned its elements");
      return;
    }
    for (std::size_t i = 0; i < list_.size() && e.type.bounds[0].second >= 0; ++i)
      assign(place(to.s + "[" + std::to_string(i) + "]", *to.type.element), list_[i], at);
    emit(length + " := " + std::to_string(e.type.bounds[0].second + 1) + ";", at);
  }
  /// The variable with the number of elements of a list that gets several lengths.
  const std::string& length_of(const std::string& variable, const std::string& key, const At& at) {
    const auto [it, is_new] = lengths_.try_emplace(variable);
    if (is_new) {
      it->second = irl_name(variable + "_length");
      (is_in_main() || globals_.contains(key) ? variables_ : current().locals)
          .push_back({"INT: " + it->second + ";", at, false});
    }
    return it->second;
  }
  std::vector<Argument> named_arguments() {
    std::vector<Argument> out;
    expect("(");
    while (!at_line_end() && !is(")")) {
      Argument a;
      if (peek().kind == Tk::name && is("=", 1)) {
        a.name = next().low;
        next();
      }
      a.e = expression();
      out.push_back(std::move(a));
      if (!accept(",")) break;
    }
    expect(")");
    return out;
  }
  static const Ex* argument(const std::vector<Argument>& all, std::string_view name,
                            std::size_t place_) {
    for (const Argument& a : all)
      if (a.name == name) return &a.e;
    if (place_ < all.size() && all[place_].name.empty()) {
      return &all[place_].e;
    }
    return nullptr;
  }
  /// str_cat(text, to_str(number)): the parts of a text, as WRITELN shows them.
  std::string text_parts(int depth) {
    if (depth > 50) {
      bad(here(), "this text is nested too deeply");
      return {};
    }
    if (is("str_cat") && is("(", 1)) {
      next();
      next();
      const std::string a = text_parts(depth + 1);
      expect(",");
      const std::string b = text_parts(depth + 1);
      expect(")");
      return a.empty() || b.empty() ? std::string() : a + ", " + b;
    }
    const bool is_number_text = is("to_str") && is("(", 1);
    if (is_number_text) {
      next();
      next();
    }
    const Ex e = expression();
    if (is_number_text) expect(")");
    return e.ok ? e.s : std::string();
  }
  void command(const At& at) {
    const Token t = next();
    const std::string& w = t.low;
    if (find(w) && find(w)->kind == Symbol::routine) {
      const auto args = named_arguments();
      const std::string text = call_of(t, args, at);
      if (!text.empty()) emit(text + ";", at);
      return;
    }
    if (w == "textmsg" && is("(") && (is("str_cat", 1) || is("to_str", 1))) {
      next();
      const std::string list = text_parts(0);
      expect(")");
      if (!list.empty()) emit("WRITELN(" + list + ");", at);
      return;
    }
    const auto a = named_arguments();
    for (const Argument& x : a)
      if (!x.e.ok) return;
    if (w == "movej" || w == "movel" || w == "movep" || w == "movec") return motion(w, a, at);
    if (w == "set_tcp" && !a.empty() && (a[0].name.empty() || a[0].name == "pose")) {
      set("tool", as_pose(a[0].e, at), at);
      return;
    }
    static const std::map<std::string, int, std::less<>> kOutputs{
        {"set_standard_digital_out", 0},
        {"set_digital_out", 0},
        {"set_configurable_digital_out", 8},
        {"set_tool_digital_out", 16}};
    if (const auto it = kOutputs.find(w); it != kOutputs.end() && a.size() == 2) {
      if (!a[0].e.is_literal && a[0].e.ok && is_number(a[0].e.type)) {
        // Which one is computed: there are no more than these.
        const Ex n = as_integer(a[0].e, at), to = converted(a[1].e, kBool, at);
        if (!n.ok || !to.ok) return;
        emit("CASE " + n.s + " OF", at);
        for (int k = 0; k < (it->second == 16 ? 2 : 8); ++k)
          emit("  WHEN " + std::to_string(k) + ": " + signal(true, k + it->second).irl +
                   " := " + to.s + ";",
               at);
        emit("ENDCASE;", at);
        return;
      }
      const Ex s = output(a[0].e, it->second, at);
      if (s.ok) assign(s, a[1].e, at);
      return;
    }
    if ((w == "set_standard_analog_out" || w == "set_analog_out") && a.size() == 2 &&
        a[0].e.is_literal) {
      Symbol& s = analog(true, a[0].e.v, at);
      assign(place(s.irl, s.type), as_real(a[1].e, at), at);
      return;
    }
    if (w == "sleep" && a.size() == 1) {
      const Ex e = as_real(a[0].e, at);
      if (e.is_literal && e.v < 0) bad(at, "a time must not be negative");
      else if (e.ok) emit("WAIT " + within(e, kSum) + " SEC;", at);
      return;
    }
    if (w == "sync" && a.empty()) {
      // One cycle of the controller.
      emit("WAIT 0.002 SEC;", at);
      return;
    }
    if (w == "textmsg" && !a.empty()) {
      std::string list;
      for (const Argument& x : a) list += (list.empty() ? "" : ", ") + x.e.s;
      emit("WRITELN(" + list + ");", at);
      return;
    }
    if (w == "popup" && !a.empty()) {
      const Ex* blocks = argument(a, "blocking", 4);
      if (blocks && blocks->s == "TRUE") emit("PAUSE " + a[0].e.s + ";", at);
      else emit("WRITELN(" + a[0].e.s + ");", at);
      return;
    }
    static const std::set<std::string, std::less<>> kHarmless{
        "set_payload",
        "set_payload_mass",
        "set_payload_cog",
        "set_gravity",
        "set_target_payload",
        "set_standard_analog_input_domain",
        "set_tool_communication",
        "set_tool_voltage",
        "set_tool_output_mode",
        "set_tool_digital_output_mode",
        "set_tool_analog_input_domain",
        "set_dual_output_pin_mode",
        "set_analog_outputdomain",
        "set_analog_inputrange",
        "set_runstate_outputs",
        "set_runstate_standard_digital_output_to_value",
        "modbus_set_runstate_dependent_choice",
        "set_input_actions_to_default",
        "reset_world_model",
        "set_safety_mode_transition_hardness",
        "set_standard_digital_input_action",
        "set_tool_digital_input_action",
        "step_count_jitter"};
    const bool is_harmless = kHarmless.contains(w);
    static const std::set<std::string, std::less<>> kKnown{"servoj",
                                                           "servoc",
                                                           "speedj",
                                                           "speedl",
                                                           "stopj",
                                                           "stopl",
                                                           "force_mode",
                                                           "end_force_mode",
                                                           "freedrive_mode",
                                                           "end_freedrive_mode",
                                                           "teach_mode",
                                                           "end_teach_mode",
                                                           "socket_open",
                                                           "socket_close",
                                                           "socket_send_string",
                                                           "socket_send_line",
                                                           "socket_send_int",
                                                           "socket_set_var",
                                                           "enter_critical",
                                                           "exit_critical",
                                                           "write_output_float_register",
                                                           "write_output_integer_register",
                                                           "write_output_boolean_register",
                                                           "write_port_bit",
                                                           "write_port_register",
                                                           "rtde_set_watchdog",
                                                           "conveyor_pulse_decode",
                                                           "track_conveyor_linear",
                                                           "track_conveyor_circular",
                                                           "stop_conveyor_tracking",
                                                           "set_conveyor_tick_count",
                                                           "powerdown",
                                                           "zero_ftsensor",
                                                           "modbus_add_signal",
                                                           "modbus_set_output_signal",
                                                           "modbus_delete_signal",
                                                           "modbus_set_output_register",
                                                           "modbus_set_signal_update_frequency",
                                                           "set_flag",
                                                           "position_deviation_warning",
                                                           "path_offset_enable",
                                                           "path_offset_disable",
                                                           "path_offset_set",
                                                           "screw_driving"};
    if (is_harmless || kKnown.contains(w)) {
      left_out(is_harmless ? RMP_FAULT_WARNING : RMP_FAULT_ERROR, at,
               "IRL has no counterpart of " + std::string(t.raw));
      return;
    }
    if (is_own_word(w)) {
      bad(at, std::string(t.raw) + " is not read with these arguments");
      return;
    }
    const std::string text = call_of(t, a, at);
    if (!text.empty()) emit(text + ";", at);
  }
  /// Functions of URScript, by its manual (5.11 and SW 10): no routine of a user.
  static bool is_own_word(std::string_view low) {
    static const std::set<std::string, std::less<>> kWords{
        "acos",
        "asin",
        "atan",
        "atan2",
        "binary_list_to_integer",
        "ceil",
        "cos",
        "d2r",
        "floor",
        "get_list_length",
        "integer_to_binary_list",
        "interpolate_pose",
        "inv",
        "length",
        "log",
        "norm",
        "normalize",
        "point_dist",
        "pose_add",
        "pose_dist",
        "pose_inv",
        "pose_sub",
        "pose_trans",
        "pow",
        "r2d",
        "random",
        "rotvec2rpy",
        "rpy2rotvec",
        "sin",
        "size",
        "sqrt",
        "tan",
        "wrench_trans",
        "movec",
        "movej",
        "movel",
        "movep",
        "optimovej",
        "optimovel",
        "servoc",
        "servoj",
        "speedj",
        "speedl",
        "stopj",
        "stopl",
        "set_conveyor_tick_count",
        "set_pos",
        "conveyor_pulse_decode",
        "encoder_enable_pulse_decode",
        "encoder_enable_set_tick_count",
        "encoder_get_tick_count",
        "encoder_set_tick_count",
        "encoder_unwind_delta_tick_count",
        "end_force_mode",
        "end_freedrive_mode",
        "end_screw_driving",
        "end_teach_mode",
        "force_mode",
        "force_mode_set_damping",
        "force_mode_set_gain_scaling",
        "freedrive_mode",
        "freedrive_mode_no_incorrect_payload_check",
        "get_conveyor_tick_count",
        "get_freedrive_status",
        "get_target_tcp_pose_along_path",
        "get_target_tcp_speed_along_path",
        "path_offset_disable",
        "path_offset_enable",
        "path_offset_get",
        "path_offset_set",
        "path_offset_set_alpha_filter",
        "path_offset_set_max_offset",
        "pause_on_error_code",
        "position_deviation_warning",
        "reset_revolution_counter",
        "screw_driving",
        "select_payload",
        "set_external_ft_sensor",
        "ft_rtde_input_enable",
        "stop_conveyor_tracking",
        "teach_mode",
        "track_conveyor_circular",
        "track_conveyor_linear",
        "get_joint_torques",
        "get_inverse_kin",
        "get_forward_kin",
        "get_inverse_kin_has_solution",
        "is_steady",
        "is_within_safety_limits",
        "popup",
        "powerdown",
        "set_gravity",
        "set_payload",
        "set_payload_cog",
        "set_payload_mass",
        "set_target_payload",
        "set_tcp",
        "sleep",
        "str_at",
        "str_cat",
        "str_empty",
        "str_find",
        "str_len",
        "str_sub",
        "sync",
        "textmsg",
        "time",
        "to_num",
        "to_str",
        "tool_contact",
        "zero_ftsensor",
        "set_baselight_iec",
        "set_baselight_off",
        "set_baselight_solid",
        "direct_torque",
        "set_safety_mode_transition_hardness",
        "enable_external_ft_sensor",
        "get_target_payload",
        "get_tcp_force",
        "get_tool_current",
        "high_holding_torque_disable",
        "high_holding_torque_enable",
        "read_flag",
        "read_input_boolean_register",
        "read_input_float_register",
        "read_input_integer_register",
        "read_output_boolean_register",
        "read_output_float_register",
        "read_output_integer_register",
        "read_port_bit",
        "read_port_register",
        "rpc_factory",
        "rtde_set_watchdog",
        "set_analog_inputrange",
        "set_analog_out",
        "set_analog_outputdomain",
        "set_configurable_digital_out",
        "set_digital_out",
        "set_flag",
        "set_runstate_configurable_digital_output_to_value",
        "set_runstate_gp_boolean_output_to_value",
        "set_runstate_standard_analog_output_to_value",
        "set_runstate_tool_digital_output_to_value",
        "set_standard_analog_input_domain",
        "set_standard_analog_out",
        "set_standard_digital_out",
        "set_tool_digital_out",
        "set_tool_communication",
        "socket_close",
        "socket_get_var",
        "socket_open",
        "socket_read_ascii_float",
        "socket_read_binary_integer",
        "socket_read_byte_list",
        "socket_read_line",
        "socket_read_string",
        "socket_send_byte",
        "socket_send_int",
        "socket_send_line",
        "socket_send_string",
        "socket_set_var",
        "write_output_boolean_register",
        "write_output_float_register",
        "write_output_integer_register",
        "write_port_bit",
        "write_port_register",
        "set_configurable_digital_input_action",
        "set_gp_boolean_input_action",
        "modbus_add_rw_signal",
        "modbus_get_error",
        "modbus_get_signal_status",
        "modbus_get_time_since_signal_invalid",
        "modbus_send_custom_command",
        "modbus_set_digital_input_action",
        "mc_add_linear",
        "mc_add_circular",
        "mc_add_path",
        "mc_get_target_rtcp_speed",
        "mc_initialize",
        "mc_load_path",
        "mc_run_motion",
        "mc_set_pcs",
        "mc_set_speed_factor",
        "set_hw_io_configuration"};
    return kWords.contains(low);
  }
  std::string call_of(const Token& t, const std::vector<Argument>& args, const At& at,
                      std::optional<Type> result = std::nullopt) {
    std::vector<Ex> list;
    if (def_of_.empty())
      for (std::size_t d = 0; d < defs_.size(); ++d)
        if (!defs_[d].is_main) def_of_[lower(defs_[d].name)] = d;
    const auto known = def_of_.find(t.low);
    const Def* const def = known == def_of_.end() ? nullptr : &defs_[known->second];
    for (std::size_t i = 0; i < args.size(); ++i) {
      if (!args[i].e.ok) return {};
      if (def && i < def->parameters.size())
        learn(t.low + "." + lower(def->parameters[i]), args[i].e.type);
      list.push_back(args[i].e);
    }
    if (t.low == lower(name_) && !def) {
      bad(at, "the program calls itself");
      return {};
    }
    return call(t.raw, list, at, result);
  }
  Ex output(const Ex& n, int from, const At& at) {
    if (!n.is_literal || n.v < 0 || n.v > 1000)
      return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
    const Symbol& s = signal(true, static_cast<std::int64_t>(n.v) + from);
    return place(s.irl, s.type);
  }
  /// A function that gives the signal of a number: get_digital_in(n), where n is computed.
  std::string reading(const std::string& name, bool is_output, int from, const At& at) {
    const std::string key = "%" + name;
    if (const auto it = globals_.find(key); it != globals_.end()) return it->second.irl;
    Symbol s;
    s.kind = Symbol::routine;
    s.irl = irl_name(name);
    Routine& reader = current();
    Routine& r = open("FUNCTION " + s.irl + " (IN INT: n): BOOL", "ENDFCT", at);
    set_current(reader);
    r.body.push_back({"  CASE n OF", {}, false});
    for (int k = 0; k < (from == 16 ? 2 : 8); ++k)
      r.body.push_back(
          {"    WHEN " + std::to_string(k) + ": RETURN " + signal(is_output, k + from).irl + ";",
           {},
           false});
    r.body.push_back({"  ENDCASE;", {}, false});
    r.body.push_back({"  RETURN FALSE;", {}, false});
    return globals_.emplace(key, std::move(s)).first->second.irl;
  }
  Symbol& analog(bool is_output, double n, const At& at) {
    const auto number = static_cast<std::int64_t>(std::clamp(n, 0.0, 100.0));
    return named_signal((is_output ? "analog_out_" : "analog_in_") + std::to_string(number),
                        is_output, kReal, at, number);
  }
  void motion(const std::string& w, const std::vector<Argument>& a, const At& at) {
    Motion m;
    const bool is_joint = w == "movej", is_arc = w == "movec";
    m.word = is_joint ? "PTP" : is_arc ? "CIRCLE" : "LIN";
    const std::size_t first = is_arc ? 2 : 1;
    if (a.size() < first) {
      bad(at, w + " needs a target");
      return;
    }
    for (std::size_t i = 0; i < first; ++i) {
      Ex e = a[i].e;
      if (e.type.k != K::pose && e.type.k != K::joint && e.type.k != K::target) {
        bad(at, "this is neither a pose nor a joint position");
        return;
      }
      if (e.type.k == K::joint) {
        // IRL's TRAFO is of the robot's own tool; in joints every tool comes to the same.
        if (!is_joint && is_set_before("tool", at))
          fail(at, "a path to joint values uses the robot's present tool here, not that of set_tcp",
               "Give a pose.");
        m.has_tool = is_joint;
      }
      m.targets.push_back(is_joint ? e : as_place(e));
    }
    const Ex* acc = argument(a, "a", first);
    const Ex* v = argument(a, "v", first + 1);
    const Ex* time = is_arc || w == "movep" ? nullptr : argument(a, "t", first + 2);
    const Ex* r = argument(a, "r", is_arc || w == "movep" ? first + 2 : first + 3);
    std::set<std::string, std::less<>> known{"a", "v", "r"};
    if (is_arc) known.insert({"pose_via", "pose_to", "mode"});
    else known.insert("pose");
    if (is_joint) known.insert("q");
    if (!is_arc && w != "movep") known.insert("t");
    for (const Argument& x : a)
      if (!x.name.empty() && !known.contains(x.name)) {
        bad(at, w + " has no argument " + x.name + " that is read");
        return;
      }
    if (a.size() > first + (is_arc || w == "movep" ? 3U : 4U) + (is_arc ? 1U : 0U)) {
      bad(at, w + " has more arguments than are supported");
      return;
    }
    if (const Ex* mode = is_arc ? argument(a, "mode", 5) : nullptr;
        mode && !(mode->is_literal && mode->v == 0)) {
      bad(at, "an arc that keeps its orientation to the path (mode = 1) is not read");
      return;
    }
    if (time && !(time->is_literal && time->v == 0)) {
      m.attributes.emplace_back("TIME", as_real(*time, at));
    } else if (v) {
      Ex speed = as_real(*v, at);
      if (is_joint) {
        speed = scaled(speed, 100 / params_.real("joint_speed"));
        if (speed.is_literal && speed.v > 100) {
          warn(at, "this is faster than 100 %", "Set joint_speed to the speed of 100 %.");
          speed = real(100);
        }
      } else {
        speed = scaled(speed, 1000);
      }
      if (speed.is_literal && speed.v <= 0) bad(at, "this is not a speed");
      m.attributes.emplace_back(is_joint ? "SPEED_PTP" : "SPEED", speed);
    }
    if (r && !(r->is_literal && r->v == 0)) {
      Ex blend = scaled(as_real(*r, at), 1000);
      if (is_joint) {
        if (!std::exchange(told_blend_, true))
          note(at, "blend radii of movej become C_PTP in % of c_ptp_mm");
        blend = scaled(blend, 0.1 / params_.real("c_ptp_mm"));
        if (blend.is_literal && blend.v > 100) blend = real(100);
      }
      m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", blend);
    }
    if (acc && !std::exchange(told_acceleration_, true))
      warn(at,
           std::string(
               "accelerations in m/s^2 and rad/s^2 have no counterpart in IRL, which has them in "
               "% of the maximum") +
               kOtherTimes,
           "Set ACC and ACC_PTP manually.");
    m.has_frames = false;
    move(std::move(m), at);
  }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    if (op == Op::mul && a.type.k == K::pose && b.type.k == K::pose)
      return binary(Op::compose, a, b, at);
    return std::nullopt;
  }
  Ex pose_of(const std::vector<Ex>& x, const At& at) {
    if (x.size() != 6) return bad(at, "a pose must have six numbers");
    std::vector<Ex> p, r;
    bool is_known = true;
    for (std::size_t i = 0; i < 6; ++i) {
      const Ex e = as_real(x[i], at);
      if (!e.ok) return failed();
      if (i < 3) p.push_back(scaled(e, 1000));
      else {
        r.push_back(e);
        is_known = is_known && e.is_literal;
      }
    }
    if (is_known) {
      double q[4];
      quaternion_of_vector({r[0].v, r[1].v, r[2].v}, q);
      return pose(p, orientation("ORIQUAT", {measure_exact(q[0]), measure_exact(q[1]),
                                             measure_exact(q[2]), measure_exact(q[3])}));
    }
    // The three parts of a rotation are it, also where it turns about nothing.
    const std::size_t of = r[0].s.find(".ORI).X * ROTANGLE(");
    const std::string whole =
        of != std::string::npos && r[0].s.starts_with("ROTAXIS(") ? r[0].s.substr(8, of - 8) : "";
    const bool is_whole = !whole.empty() && r[0].s == rotation_part(whole, 'X') &&
                          r[1].s == rotation_part(whole, 'Y') &&
                          r[2].s == rotation_part(whole, 'Z');
    Ex o =
        is_whole
            ? value(whole + ".ORI", kOrientation)
            : value(helper("rotation_vector") + "(" + r[0].s + ", " + r[1].s + ", " + r[2].s + ")",
                    kOrientation);
    return pose(p, o);
  }
  static Ex measure_exact(double v) { return real(std::fabs(v) < 1e-16 ? 0.0 : v); }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      return suffixes(e);
    }
    if (accept("[")) {
      const auto x = arguments("]");
      for (const Ex& e : x)
        if (!e.ok) return failed();
      const bool are_numbers =
          std::all_of(x.begin(), x.end(), [](const Ex& e) { return is_number(e.type); });
      if (x.size() == 6 && are_numbers) {
        std::vector<Ex> degrees;
        for (const Ex& e : x) degrees.push_back(scaled(as_real(e, at), kDegree));
        return suffixes(joints(degrees, {}));
      }
      if (x.empty()) {
        // Its variable has the type of its elements, from other assignments.
        Ex none = value("[]", array_of(kNone, {{0, -1}}));
        if (at_line_end()) return none;
        return bad(at, "an empty list is not read here");
      }
      // Numbers of a list may be any, whatever it has at first.
      const Type of = is_number(x[0].type) ? kReal : x[0].type;
      bool is_constant = true;
      for (const Ex& e : x) {
        is_constant = is_constant && e.is_constant;
      }
      std::string list;
      for (const Ex& e : x) {
        const Ex c = converted(e, of, at);
        if (!c.ok) return failed();
        list += (list.empty() ? "" : ", ") + c.s;
      }
      Ex e = value("[" + list + "]", array_of(of, {{0, static_cast<std::int64_t>(x.size()) - 1}}));
      e.is_constant = is_constant;
      list_ = x;
      return suffixes(e);
    }
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    next();
    if (t.low == "true" || t.low == "false") return boolean(t.low == "true");
    if (t.low == "p" && is("[")) {
      const Symbol* s = find("p");
      if (!s || peek(2).low == ",") {
        next();
        return suffixes(pose_of(arguments("]"), at));
      }
    }
    if (is("(")) return suffixes(function(t));
    const Symbol* s = find(t.low);
    if (!s) {
      if (t.low == "pi") return real(3.141592653589793);
      return bad(at, std::string(t.raw.substr(0, 60)) + " has no value before this");
    }
    if (s->kind == Symbol::routine || s->kind == Symbol::data)
      return bad(at, std::string(t.raw) + " is not a value");
    Ex e = place(s->irl, s->type);
    e.is_place = s->kind == Symbol::variable || s->kind == Symbol::output;
    return suffixes(e);
  }
  static std::string rotation_part(const std::string& pose, char axis) {
    return "ROTAXIS(" + pose + ".ORI)." + axis + " * ROTANGLE(" + pose + ".ORI) / " +
           number_text(kDegree);
  }
  Ex suffixes(Ex e) {
    while (is("[") && e.ok) {
      const At at = next().at;
      const Ex i = as_integer(expression(), at);
      expect("]");
      if (!i.ok) return failed();
      if (e.type.k == K::array) {
        if (i.is_literal && (i.v < 0 || i.v > static_cast<double>(e.type.bounds[0].second)))
          return bad(at, "the list has no element " + i.s);
        const Type of = *e.type.element;
        const bool is_place = e.is_place;
        e = place(e.s + "[" + i.s + "]", of);
        e.is_place = is_place;
        continue;
      }
      if (!i.is_literal || i.v < 0 || i.v > 5)
        return bad(at, "the index must be a known number from 0 to 5");
      const auto n = static_cast<int>(i.v);
      if (e.type.k == K::joint) {
        const std::string a =
            e.s + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") + std::to_string(n + 1);
        const bool is_place = e.is_place;
        e = value(a + " / " + number_text(kDegree), kReal, kTerm);
        e.is_place = is_place;
        e.setter = a + " := (%) * " + number_text(kDegree);
        continue;
      }
      if (e.type.k == K::pose) {
        if (n < 3) {
          const std::string a = e.s + ".POS." + static_cast<char>('X' + n);
          const bool is_place = e.is_place;
          e = value(a + " / 1000.0", kReal, kTerm);
          e.is_place = is_place;
          e.setter = a + " := (%) * 1000.0";
          continue;
        }
        const char axis = static_cast<char>('X' + n - 3);
        const auto component = [&](char c) { return rotation_part(e.s, c); };
        const bool is_place = e.is_place;
        std::string setter = e.s + ".ORI := " + (is_place ? helper("rotation_vector") : "") + "(";
        for (const char c : {'X', 'Y', 'Z'})
          setter += (c == 'X' ? "" : ", ") + (c == axis ? "%" : component(c));
        e = value(component(axis), kReal, kTerm);
        e.is_place = is_place;
        e.setter = setter + ")";
        continue;
      }
      return bad(at, "this has no elements");
    }
    return e;
  }
  Ex function(const Token& t) {
    const At at = t.at;
    const auto named = named_arguments();
    std::vector<Ex> a;
    for (const Argument& x : named) {
      if (!x.e.ok) return failed();
      a.push_back(x.e);
    }
    const std::string& w = t.low;
    const Symbol* s = find(w);
    if (!s || s->kind != Symbol::routine || learned_.stubs.contains(w)) {
      static const std::map<std::string, std::string, std::less<>> kMath{
          {"sin", "SIN"},     {"cos", "COS"},   {"tan", "TAN"},
          {"asin", "ASIN"},   {"acos", "ACOS"}, {"atan", "ATAN"},
          {"atan2", "ATAN2"}, {"sqrt", "SQRT"}, {"exp", "EXP"}};
      if (const auto it = kMath.find(w); it != kMath.end()) return math(it->second, a, at, true);
      if ((w == "norm" || w == "fabs") && a.size() == 1 && is_number(a[0].type))
        return math("ABS", a, at);
      if (w == "abs" && a.size() == 1) return math("ABS", a, at);
      if (w == "d2r" && a.size() == 1) return scaled(as_real(a[0], at), 1 / kDegree);
      if (w == "r2d" && a.size() == 1) return scaled(as_real(a[0], at), kDegree);
      if (w == "floor" && a.size() == 1)
        return value(helper("floor") + "(" + as_real(a[0], at).s + ")", kInt);
      if (w == "ceil" && a.size() == 1)
        return value("-" + helper("floor") + "(-(" + as_real(a[0], at).s + "))", kInt, kSign);
      if (w == "pow" && a.size() == 2) return binary(Op::power, a[0], a[1], at);
      if (w == "length" && a.size() == 1 && (a[0].type.k == K::array || a[0].type.k == K::string))
        return lengths_.contains(a[0].s) ? value(lengths_[a[0].s], kInt)
                                         : value("SIZEOF(" + a[0].s + ")", kInt);
      if (w == "pose_trans" && a.size() == 2) return binary(Op::compose, a[0], a[1], at);
      if (w == "pose_inv" && a.size() == 1) {
        const Ex p = as_pose(a[0], at);
        return p.ok ? value("INV(" + p.s + ")", kPose) : failed();
      }
      if (w == "pose_add" && a.size() == 2 && a[0].type.k == K::pose && a[1].type.k == K::pose) {
        return value(helper("pose_sum") + "(" + a[0].s + ", " + a[1].s + ")", kPose);
      }
      if ((w == "get_inverse_kin") && !a.empty() && a[0].type.k == K::pose &&
          learned_.external_axes == 0)
        return value("TRAFOINV(" + target(a[0], integer(2), {}, {}).s + ").M_JOINT", kJoint);
      if (w == "get_forward_kin" && !a.empty() && a[0].type.k == K::joint)
        return as_pose(as_place(a[0]), at);
      if ((w == "get_actual_tcp_pose" || w == "get_target_tcp_pose") && a.empty())
        return as_pose(present_target(at), at);
      if ((w == "get_actual_joint_positions" || w == "get_target_joint_positions") && a.empty())
        return present_joints();
      if (w == "point_dist" && a.size() == 2 && a[0].type.k == K::pose && a[1].type.k == K::pose)
        return scaled(value(helper("distance") + "(" + a[0].s + ".POS, " + a[1].s + ".POS)", kReal),
                      0.001);
      static const std::map<std::string, std::pair<bool, int>, std::less<>> kSignals{
          {"get_standard_digital_in", {false, 0}},     {"get_digital_in", {false, 0}},
          {"get_configurable_digital_in", {false, 8}}, {"get_tool_digital_in", {false, 16}},
          {"get_standard_digital_out", {true, 0}},     {"get_digital_out", {true, 0}},
          {"get_configurable_digital_out", {true, 8}}, {"get_tool_digital_out", {true, 16}}};
      if (const auto it = kSignals.find(w); it != kSignals.end() && a.size() == 1) {
        if (!a[0].is_literal && a[0].ok && is_number(a[0].type)) {
          const Ex n = as_integer(a[0], at);
          return n.ok ? value(reading(w, it->second.first, it->second.second, at) + "(" + n.s + ")",
                              kBool)
                      : failed();
        }
        if (!a[0].is_literal || a[0].v < 0 || a[0].v > 1000)
          return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
        const Symbol& x =
            signal(it->second.first, static_cast<std::int64_t>(a[0].v) + it->second.second);
        return value(x.irl, x.type);
      }
      if ((w == "get_standard_analog_in" || w == "get_analog_in") && a.size() == 1 &&
          a[0].is_literal)
        return value(analog(false, a[0].v, at).irl, kReal);
      if ((w == "get_standard_analog_out" || w == "get_analog_out") && a.size() == 1 &&
          a[0].is_literal)
        return value(analog(true, a[0].v, at).irl, kReal);
      if (w == "str_cat" && a.size() == 2 && a[0].type.k == K::string && a[1].type.k == K::string)
        return binary(Op::add, a[0], a[1], at);
      if (w == "str_len" && a.size() == 1 && a[0].type.k == K::string)
        return value("LENGTH(" + a[0].s + ")", kInt);
      if (w.starts_with("get_") || w.starts_with("socket_") || w.starts_with("read_") ||
          w.starts_with("is_") || w == "to_str" || w == "to_num" || w == "force" ||
          w == "interpolate_pose" || w == "pose_sub" || w == "rpc_factory" || w == "random" ||
          w == "time" || w.starts_with("modbus_") || w.starts_with("str_") ||
          w.starts_with("request_") || w.starts_with("rotvec") || w.starts_with("rpy") ||
          w.starts_with("binary_") || w.starts_with("integer_") || w.starts_with("list_") ||
          w == "struct" || w == "make_list" || w == "pose_dist")
        return bad(at, "IRL has no counterpart of " + std::string(t.raw));
    }
    if (!s && is_own_word(w))
      return bad(at, std::string(t.raw) + " returns no value that is read here");
    Type result = kReal;
    if (s && s->kind == Symbol::routine && !learned_.stubs.contains(w)) {
      result = s->type;
      if (result.k == K::none) {
        // A function whose type is not known yet, in the first pass.
        (void)call_of(t, named, at);
        if (!learned_.flags.insert("called " + w).second && learned_.flags.contains("again " + w))
          return bad(at, std::string(t.raw) + " returns no value that was read");
        learned_.flags.insert("again " + w);
        is_guessed_ = true;
        return value(s->irl + "()", kReal);
      }
    }
    const std::string text = call_of(t, named, at, result);
    return text.empty() ? failed() : value(text, result);
  }

  std::vector<Def> defs_;
  std::unordered_map<std::string, std::size_t> def_of_;  ///< by name, when one is called first
  std::size_t next_def_ = 0;
  std::vector<Block> blocks_;
  std::vector<int> indents_;
  std::map<std::string, std::string> threads_;
  std::string routine_;
  bool told_blend_ = false, told_acceleration_ = false;
  bool is_guessed_ =
      false;  ///< a value of the present statement is of a type that is not known yet
  int nested_ = 0;
  std::deque<std::string> own_names_;           ///< of functions that were renamed
  std::map<std::string, std::string> lengths_;  ///< of lists, the variables with their lengths
  std::vector<Ex> list_;                        ///< the elements of the list that was read last
};

}  // namespace

Made read_urscript(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<UrscriptReader>(task, params, progress);
}

}  // namespace robomosp::readers

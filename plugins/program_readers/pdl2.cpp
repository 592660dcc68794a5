// SPDX-License-Identifier: Apache-2.0
// Comau PDL2: a program of .pdl with its routines.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kPdl2Style{.comment = "--",
                       .quotes = "'",
                       .name_first = "_$",
                       .name_rest = "_$",
                       .signs = {":=", "<>", "<=", ">=", "::", "**"},
                       .has_lines = true,
                       .joins_in_brackets = true,
                       .hex = "0x"};
// PDL2 Programming Language Manual, order of operations: AND as *, OR and XOR as +.
constexpr Binary kPdl2Binaries[] = {
    {"=", 20, Op::eq},     {"<>", 20, Op::ne},    {"<", 20, Op::lt},    {">", 20, Op::gt},
    {"<=", 20, Op::le},    {">=", 20, Op::ge},    {"+", 30, Op::add},   {"-", 30, Op::sub},
    {"or", 30, Op::or_},   {"xor", 30, Op::exor}, {"*", 40, Op::mul},   {"/", 40, Op::div},
    {"and", 40, Op::and_}, {"div", 40, Op::idiv}, {"mod", 40, Op::mod}, {":", 50, Op::compose},
    {"**", 50, Op::power}};

class Pdl2Reader final : public Reader {
 public:
  using Reader::Reader;

  [[nodiscard]] MakerLanguage language() const override { return MakerLanguage::pdl2; }

  void run() override {
    name_ = std::string(stem(files_[0].name));
    scan(0, kPdl2Style);
    // Routines may be called above their place.
    is_announcing_ = true;
    program();
    is_announcing_ = false;
    at_ = 0;
    next_comment_ = 0;
    program();
    learned_.flags.insert("passed");
    if (!has_body_)
      fail({0, 1, 1, 0, 0}, "this program has no BEGIN",
           "A program is PROGRAM name, its variables and routines, BEGIN and END name.");
  }

 private:
  std::span<const Binary> binaries() const override { return kPdl2Binaries; }
  std::string_view not_word() const override { return "not"; }
  int not_precedence() const override { return 60; }

  // ---- declarations ----

  std::optional<Type> type_here(std::int64_t* size = nullptr) {
    const Token t = next();
    std::optional<Type> out;
    if (t.low == "integer") out = kInt;
    if (t.low == "real") out = kReal;
    if (t.low == "boolean") out = kBool;
    if (t.low == "vector") out = kPosition;
    if (t.low == "position" || t.low == "xtndpos") out = kTarget;
    if (t.low == "jointpos") out = joint_type();
    if (t.low == "string") out = kString;
    if (const auto it = types_named_.find(t.low); it != types_named_.end()) out = it->second;
    if (t.low == "array") {
      std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
      if (accept("[")) {
        do {
          if (is("*")) {
            next();
            bounds.clear();
            break;
          }
          const Ex n = expression();
          const auto known = constant_number(n);
          if (!known || *known < 1 || *known > 100'000) {
            skip_to("]");
            return std::nullopt;
          }
          bounds.emplace_back(1, static_cast<std::int64_t>(*known));
        } while (accept(","));
        expect("]");
      }
      if (!accept("of")) return std::nullopt;
      const auto of = type_here(size);
      if (!of || bounds.empty()) return std::nullopt;
      return array_of(*of, bounds);
    }
    is_extended_ = t.low == "xtndpos";
    if (accept("[")) skip_to("]");  // length of a string
    if (accept("for")) {
      accept("arm");
      if (accept("[")) skip_to("]");
    }
    return out;
  }
  void skip_to(std::string_view close) {
    while (!at_line_end() && !accept(close)) ++at_;
  }
  std::optional<double> constant_number(const Ex& e) const {
    if (e.is_literal) return e.v;
    const auto it = numbers_.find(e.s);
    return it == numbers_.end() ? std::nullopt : std::optional(it->second);
  }
  [[nodiscard]] std::string initial_of(const Type& t) {
    if (t.k == K::target)
      return target(identity(), integer(0), std::vector<Ex>(6, integer(-128)), {}).s;
    if (t.k == K::array && t.element && t.element->k == K::target && t.bounds.size() == 1 &&
        t.bounds[0].second <= 64) {
      std::string all;
      for (std::int64_t i = t.bounds[0].first; i <= t.bounds[0].second; ++i)
        all += (all.empty() ? "" : ", ") + initial_of(*t.element);
      return "[" + all + "]";
    }
    return {};
  }
  /// a, b : TYPE (value) NOSAVE; up to the next section.
  void variables(bool is_local) {
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      if (begins_section()) return;
      const At at = here();
      if (is_announcing_ && is_local) {
        skip_line();
        continue;
      }
      const auto read = [&] { variable_line(is_local, at); };
      if (is_announcing_ || is_local) statement(at, read);
      skip_line();
    }
  }
  [[nodiscard]] bool begins_section() const {
    static const std::set<std::string, std::less<>> kWords{"begin", "routine", "var",
                                                           "const", "type",    "end"};
    return peek().kind == Tk::name && kWords.contains(peek().low) && !is(":", 1) && !is(",", 1) &&
           !is("=", 1);
  }
  void variable_line(bool is_local, const At& at) {
    std::vector<Token> names;
    do {
      const Token t = next();
      if (t.kind != Tk::name) {
        bad(t.at, "the name of a variable is expected here");
        return skip_rest();
      }
      names.push_back(t);
    } while (accept(","));
    if (!expect(":")) return skip_rest();
    const auto type = type_here();
    const bool is_extended = is_extended_;
    if (!type) {
      bad(at, "IRL has no variables of this type, or their number is unknown");
      return skip_rest();
    }
    std::string text;
    bool is_foreign = false;
    if (accept("(")) {
      const Ex e = converted(expression(), *type, at);
      expect(")");
      if (e.ok) text = e.s;
    }
    while (!at_line_end()) {
      const Token t = next();
      if (t.low == "exported" && is("from")) {
        next();
        const Token from = next();
        is_foreign = from.low != lower(name_);
      }
    }
    for (const Token& n : names) {
      if ((is_local ? current().symbols : globals_).contains(n.low)) {
        bad(n.at, std::string(n.raw) + " is declared twice");
        continue;
      }
      Symbol& s = declare(n.raw, *type, Symbol::variable, is_local);
      if (is_extended) extended_.insert(s.irl);
      if (text.empty() && !is_foreign) without_value(s);
      declare_variable(s, text.empty() ? initial_of(*type) : text, at, is_local);
      if (is_foreign)
        warn(n.at, std::string(n.raw) + " belongs to another program, and becomes a variable here");
      if (!text.empty()) gives(s.irl);
    }
  }
  void constants(bool is_local) {
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      if (begins_section()) return;
      const At at = here();
      if (is_announcing_ || is_local)
        statement(at, [&] {
          const Token n = next();
          expect("=");
          const Ex e = expression();
          if (!e.ok) return;
          Symbol& s =
              declare(n.raw, e.type,
                      is_local || !e.is_constant ? Symbol::variable : Symbol::constant, is_local);
          declare_variable(s, e.s, at, is_local);
          gives(s.irl);
          if (e.is_literal) numbers_[s.irl] = e.v;
        });
      skip_line();
    }
  }
  /// name = RECORD fields ENDRECORD
  void types() {
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      if (begins_section()) return;
      const At at = here();
      const Token name = next();
      accept("=");
      const bool is_record = accept("record");
      skip_line();
      std::string fields;
      std::vector<std::pair<std::string, Type>> known;
      bool ok = is_record;
      while (!at_end() && !accept("endrecord") && !accept("endnodedef") && !is("begin") &&
             !is("routine")) {
        if (peek().kind == Tk::line) {
          ++at_;
          continue;
        }
        std::vector<Token> names;
        do names.push_back(next());
        while (accept(","));
        const bool has_type = accept(":");
        const auto t = has_type ? type_here() : std::nullopt;
        ok = ok && t && t->k != K::array;
        if (t)
          for (const Token& f : names) {
            known.emplace_back(f.low, *t);
            fields += " " + type_text(*t) + ": f_" + f.low + ";";
          }
        skip_line();
      }
      skip_rest();
      if (!is_announcing_) continue;
      if (!ok || known.empty()) {
        fail(at, "IRL has no counterpart of the type " + std::string(name.raw.substr(0, 40)));
        continue;
      }
      Type t;
      t.k = K::record;
      t.record = irl_name(name.raw);
      records_[t.record] = known;
      types_.push_back({"RECORD" + fields + " ENDRECORD: " + t.record + ";", at, true});
      types_named_[name.low] = t;
    }
  }

  // ---- programs and routines ----

  void program() {
    while (!at_end()) {
      if (progress_.cancelled()) return statement(here(), [] {});
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      const At at = here();
      const std::string w = peek().kind == Tk::name ? peek().low : "";
      if (w == "program") {
        next();
        const Token n = next();
        if (n.kind == Tk::name) name_ = std::string(n.raw);
        while (!at_line_end()) {
          if (accept("prog_arm") && accept("=") && peek().kind == Tk::number)
            arm_ = std::string(peek().raw);
          ++at_;
        }
      } else if (w == "import") {
        skip_rest();
        if (is_announcing_)
          warn(at, "exports of another program are not read",
               "Write its variables and routines into this one.");
      } else if (w == "var") {
        next();
        variables(false);
      } else if (w == "const") {
        next();
        constants(false);
      } else if (w == "type") {
        next();
        types();
      } else if (w == "routine") {
        routine();
      } else if (w == "begin") {
        next();
        has_body_ = true;
        const bool is_cycle = accept("cycle");
        if (is_announcing_) {
          skip_body();
        } else {
          close();
          while (next_comment_ < comments_.size() && comments_[next_comment_].line < at.line)
            ++next_comment_;
          body(at, is_cycle);
        }
      } else if (w == "end") {
        skip_line();
      } else {
        if (is_announcing_)
          fail(at,
               "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected outside BEGIN",
               "A program is PROGRAM name, its variables and routines, BEGIN and END name.");
        skip_line();
      }
    }
  }
  void skip_body() {
    while (!at_end()) {
      while (peek().kind == Tk::line) ++at_;
      if (is("end") && !at_end()) {
        skip_rest();
        return;
      }
      skip_line();
    }
  }
  void routine() {
    const At at = here();
    next();
    const Token name = next();
    std::vector<Parameter> list;
    std::set<std::string> extended;
    bool ok = true;
    if (accept("(")) {
      while (!at_end() && !is(")")) {
        std::vector<Token> names;
        do names.push_back(next());
        while (accept(","));
        if (!accept(":")) {
          ok = false;
          break;
        }
        const auto t = type_here();
        if (is_extended_)
          for (const Token& n : names) extended.insert(n.low);
        if (accept("(")) skip_to(")");
        ok = ok && t;
        for (const Token& n : names)
          list.push_back({std::string(n.raw), t.value_or(kReal),
                          learned_.flags.contains("written " + name.low + "." + n.low)});
        if (!accept(";") && !accept(",")) break;
      }
      while (!at_line_end() && !accept(")")) ++at_;
    }
    Type result;
    if (accept(":")) {
      const auto t = type_here();
      ok = ok && t;
      result = t.value_or(kReal);
    }
    if (accept("exported")) {
      // Of another program: a call of it is one of a routine that is missing.
      exported_.insert(name.low);
      skip_rest();
      return;
    }
    skip_rest();
    if (is_announcing_) {
      if (!ok)
        fail(at, "the parameters of " + std::string(name.raw.substr(0, 40)) + " are not read");
      announce(name.raw, list, result);
    } else {
      begin(name.raw, list, result, at);
      for (const std::string& p : extended)
        if (const Symbol* s = find(p)) extended_.insert(s->irl);
      while (next_comment_ < comments_.size() && comments_[next_comment_].line < at.line)
        ++next_comment_;
    }
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      if (accept("var")) variables(true);
      else if (accept("const")) constants(true);
      else if (accept("type")) types();
      else if (is("begin")) break;
      else return;  // only announced: EXPORTED FROM on another line
    }
    const At from = here();
    next();
    if (is_announcing_) return skip_body();
    result_ = result;
    parameters_.clear();
    for (const Parameter& p : list) parameters_.insert(lower(p.foreign));
    body(from, false);
    parameters_.clear();
    close();
  }
  void body(const At& begin_at, bool is_cycle) {
    blocks_.clear();
    forget();
    current().indent = 1;
    if (is_cycle) {
      emit("LOOP", begin_at);
      open_block("end", "ENDLOOP");
    }
    while (!at_end()) {
      if (progress_.cancelled()) return statement(here(), [] {});
      if (peek().kind == Tk::line) {
        ++at_;
        continue;
      }
      const At at = here();
      if (is("end") && !is("::", 1) && !is(":=", 1)) {
        comments_until(at);
        if (is_in("end")) close_block("end", at);
        close_blocks(at);
        skip_rest();
        return;
      }
      statement(at, [&] {
        one();
        if (!at_line_end()) {
          bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
          skip_rest();
        }
      });
      if (here().begin == at.begin && !at_end()) ++at_;
    }
    close_blocks(here());
    fail(here(), "this body has no END");
  }
  /// What the statements above have brought about is not known where others lead here, too.
  void forget() {
    goal_.clear();
    cares_.reset();
    move_type_.reset();
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      return skip_rest();
    }
    if (is("::", 1)) {
      next();
      next();
      forget();
      emit("LABEL " + label(t.raw) + ":", at);
      if (!at_line_end()) one();
      return;
    }
    if (t.low.starts_with("$")) return system_variable(at);
    static const std::map<std::string, void (Pdl2Reader::*)(const At&), std::less<>> kWords{
        {"move", &Pdl2Reader::motion},
        {"movefly", &Pdl2Reader::motion},
        {"if", &Pdl2Reader::if_},
        {"elsif", &Pdl2Reader::elsif},
        {"else", &Pdl2Reader::else_},
        {"endif", &Pdl2Reader::end_word},
        {"for", &Pdl2Reader::for_},
        {"endfor", &Pdl2Reader::end_word},
        {"while", &Pdl2Reader::while_},
        {"endwhile", &Pdl2Reader::end_word},
        {"repeat", &Pdl2Reader::repeat},
        {"until", &Pdl2Reader::until},
        {"select", &Pdl2Reader::select},
        {"case", &Pdl2Reader::case_},
        {"default", &Pdl2Reader::default_},
        {"endselect", &Pdl2Reader::end_word},
        {"goto", &Pdl2Reader::jump},
        {"return", &Pdl2Reader::return_},
        {"wait", &Pdl2Reader::wait},
        {"delay", &Pdl2Reader::delay},
        {"pause", &Pdl2Reader::pause},
        {"deactivate", &Pdl2Reader::deactivate},
        {"write", &Pdl2Reader::write},
        {"pulse", &Pdl2Reader::pulse},
        {"condition", &Pdl2Reader::condition_block},
        {"cycle", &Pdl2Reader::cycle},
        {"attach", &Pdl2Reader::harmless},
        {"detach", &Pdl2Reader::harmless},
        {"jnt", &Pdl2Reader::jnt}};
    static const std::set<std::string, std::less<>> kOthers{
        "activate", "cancel",  "close",  "connect", "disable", "disconnect",   "enable", "exit",
        "hold",     "lock",    "open",   "purge",   "read",    "relax",        "resume", "signal",
        "unlock",   "unpause", "with",   "endmove", "endopen", "endcondition", "when",   "endtry",
        "try",      "decode",  "encode", "resynch", "release", "bypass",       "begin",  "program"};
    if (!is(":=", 1) && !is("[", 1) && !is(".", 1)) {
      if (const auto it = kWords.find(t.low); it != kWords.end()) {
        next();
        word_ = t.low;
        (this->*it->second)(at);
        return;
      }
    } else if ((t.low == "condition" || t.low == "move") && is("[", 1)) {
      next();
      word_ = t.low;
      if (t.low == "condition") condition_block(at);
      else motion(at);
      return;
    }
    if (kOthers.contains(t.low) && !is(":=", 1)) {
      skip_motion();
      bad(at, "IRL has no counterpart of " + std::string(t.raw), "Write the same in IRL.");
      return;
    }
    // A routine, or what gets a value.
    const Symbol* s = find(t.low);
    if (is(":=", 1) || is("[", 1) || is(".", 1) || (s && s->kind != Symbol::routine && !is("(", 1)))
      return assignment(at);
    if (!s && !exported_.contains(t.low) && !maker_word(language(), t.low)) {
      skip_rest();
      bad(at,
          std::string(t.raw.substr(0, 40)) +
              " is neither a statement nor a routine of this program",
          "Declare it with ROUTINE, even if it is EXPORTED FROM another program.");
      return;
    }
    next();
    std::vector<Ex> args;
    if (accept("(")) args = call_arguments(t.low);
    for (const Ex& e : args)
      if (!e.ok) return;
    forget();
    const std::string text = call(t.raw, args, at);
    if (!text.empty()) emit(text + ";", at);
  }
  /// Variables go by reference: what a routine changes is changed for the caller.
  std::vector<Ex> call_arguments(const std::string& routine) {
    std::vector<Ex> args;
    if (accept(")")) return args;
    const Symbol* s = find(routine);
    do {
      const Token first = peek();
      Ex e = expression();
      if (s && s->kind == Symbol::routine && args.size() < s->parameters.size() &&
          s->parameters[args.size()].is_out && e.is_place) {
        will_write(first.low);
        gives(e.s);
      }
      args.push_back(std::move(e));
    } while (accept(",") && args.size() < 100);
    expect(")");
    return args;
  }
  void harmless(const At& at) {
    skip_rest();
    left_out(RMP_FAULT_WARNING, at,
             "this neither moves a robot nor switches a signal; it was left out");
  }
  void assignment(const At& at) {
    const Token name = peek();
    will_write(name.low);
    const Ex to = places(false);
    if (!to.ok) return skip_rest();
    if (!expect(":=")) return skip_rest();
    const Ex e = expression();
    if (!e.ok) return;
    gives(to.s);
    goal_.clear();
    // The place of a position with additional axes: its pose and configuration.
    if (const std::string field = std::exchange(part_, {});
        field == "pos" && to.type.k == K::target) {
      const Ex from = converted(e, kTarget, at);
      if (e.type.k == K::target && e.is_place) {
        for (const char* f : {"PSE", "STATUS", "TURNS"})
          emit(to.s + "." + f + " := " + e.s + "." + f + ";", at);
      } else if (e.type.k == K::target && last_status_ && from.ok) {
        emit(to.s + ".PSE := " + last_pose_ + ";", at);
        emit(to.s + ".STATUS := " + std::to_string(*last_status_) + ";", at);
      } else {
        const Ex p = plain(e, at);
        if (p.ok) emit(to.s + ".PSE := " + p.s + ";", at);
      }
      return;
    }
    assign(to, e, at);
  }

  void gives(const std::string& irl) {
    learned_.flags.insert("given " + irl.substr(0, irl.find_first_of(".[")));
  }
  /// The pose of a target; of one that is written out its own text.
  Ex plain(const Ex& e, const At& at) {
    if (e.type.k == K::target)
      if (const auto it = poses_.find(e.s); it != poses_.end()) {
        Ex p = value(it->second, kPose);
        p.is_constant = e.is_constant;
        return p;
      }
    return as_pose(as_place(e), at);
  }

  // ---- system variables ----

  static bool is_signal(const std::string& low) {
    return low == "$din" || low == "$dout" || low == "$gin" || low == "$gout";
  }
  /// $DOUT[n]; nothing = it is none that IRL has.
  Symbol* signal_here(const At& at) {
    const Token t = next();
    if (!expect("[")) return nullptr;
    const Ex n = expression();
    expect("]");
    const auto known = constant_number(n);
    if (!n.ok) return nullptr;
    if (!known || *known < 0 || *known > 100'000) {
      bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
      return nullptr;
    }
    const auto number = static_cast<std::int64_t>(*known);
    const bool is_out = t.low.ends_with("out");
    if (t.low[1] == 'd') return &signal(is_out, number);
    // The width of a group is the controller's.
    if (!std::exchange(said_groups_, true))
      note(at,
           "the width of a group ($GIN, $GOUT) is in the controller's configuration; 16 bits are "
           "assumed");
    return &signal(is_out, number, 16);
  }
  void system_variable(const At& at) {
    const Token t = peek();
    if (is_signal(t.low)) {
      Symbol* s = signal_here(at);
      if (!expect(":=")) return skip_rest();
      const Ex e = expression();
      if (!s || !e.ok) return;
      if (s->kind != Symbol::output) {
        bad(at, "an input cannot be assigned");
        return;
      }
      const Ex x = converted(e, s->type, at);
      if (x.ok) emit(s->irl + " := " + x.s + ";", at);
      return;
    }
    next();
    if (t.low == "$timer") return timer(at);
    if (is("[")) {
      skip_rest();
      bad(at, "IRL has no counterpart of " + std::string(t.raw));
      return;
    }
    if (!expect(":=")) return skip_rest();
    setting(t, at, nullptr);
  }
  struct With {
    std::map<std::string, Ex> values;
    std::optional<std::string> move_type;
    std::optional<bool> cares;
  };
  /// A setting of motions: of all that follow, or of one (WITH).
  void setting(const Token& t, const At& at, With* with) {
    static const std::set<std::string, std::less<>> kReal_{
        "$lin_spd",      "$rot_spd",     "$prog_spd_ovr", "$arm_spd_ovr", "$gen_ovr",  "$arm_ovr",
        "$prog_acc_ovr", "$arm_acc_ovr", "$prog_dec_ovr", "$arm_dec_ovr", "$fly_dist", "$fly_per"};
    static const std::set<std::string, std::less<>> kPlaces{"$tool", "$uframe", "$base"};
    // What says how a motion ends or computes, and not where it goes.
    static const std::set<std::string, std::less<>> kHarmless{
        "$term_type",  "$fly_traj",  "$sing_care", "$jnt_mturn",    "$stress_per",
        "$tol_coarse", "$tol_fine",  "$prog_cnfg", "$coll_ena",     "$coll_type",
        "$move_state", "$tool_mass", "$tool_cntr", "$tool_inertia", "$tool_rmt"};
    if (kReal_.contains(t.low)) {
      const Ex e = as_real(expression(), at);
      if (!e.ok) return;
      if (with) with->values[t.low] = e;
      else set(t.low, e, at);
      return;
    }
    if (kPlaces.contains(t.low)) {
      const Ex e = plain(expression(), at);
      if (!e.ok) return;
      if (with) {
        with->values[t.low] = e;
        return;
      }
      goal_.clear();
      set(t.low == "$tool" ? "tool" : t.low.substr(1), e, at);
      return;
    }
    if (t.low == "$move_type") {
      const Token v = next();
      if (v.low != "joint" && v.low != "linear" && v.low != "circular") {
        bad(at, "IRL has no motions of the type " + std::string(v.raw.substr(0, 40)));
        return;
      }
      if (with) with->move_type = v.low;
      else move_type_ = v.low;
      if (!with) learned_.flags.insert("move type");
      return;
    }
    if (t.low == "$cnfg_care" || t.low == "$turn_care") {
      const Ex e = converted(expression(), kBool, at);
      if (!e.ok) return;
      if (!e.is_constant) {
        bad(at, std::string(t.raw) + " that is computed is not read");
        return;
      }
      if (t.low == "$turn_care") {
        if (e.s == "TRUE") learned_.flags.insert("turns");
        return;
      }
      if (with) with->cares = e.s == "TRUE";
      else cares_ = e.s == "TRUE";
      learned_.flags.insert(e.s == "TRUE" ? "cares" : "cares not");
      return;
    }
    if (t.low == "$spd_opt") {
      const Token v = next();
      if (v.low == "spd_lin" || v.low == "spd_const" || v.low == "spd_jnt") return;
      bad(at, "a speed by " + std::string(v.raw.substr(0, 40)) + " is not read",
          "SPD_LIN is the speed of the tool.");
      return;
    }
    if (t.low == "$fly_type") {
      const Token v = next();
      if (v.low != "fly_cart" && v.low != "fly_norm" && v.low != "fly_pass")
        bad(at, "FLY_CART or FLY_NORM is expected here");
      return;
    }
    if (t.low == "$ornt_type") {
      const Token v = next();
      if (v.low == "rs_world") return;
      left_out(RMP_FAULT_WARNING, at,
               "the tool rotates about one axis along a path in IRL, and by " +
                   std::string(v.raw.substr(0, 40)) + " there");
      return;
    }
    if (kHarmless.contains(t.low)) {
      (void)next();
      while (!at_line_end() && !is(",") && !is("endmove")) ++at_;
      return;
    }
    skip_rest();
    bad(at, std::string(t.raw.substr(0, 40)) + " is specific to the controller and is not read",
        "Write the same in IRL, or remove it.");
  }

  // ---- motions ----

  /// The places that stand for STATUS and turns in a configuration such as 'S E T1:1'.
  bool configuration(std::string_view text, int& status, std::vector<Ex>& turns, const At& at) {
    status = 0;
    turns.assign(6, integer(-128));
    const std::string low = lower(text);
    for (std::size_t i = 0; i < low.size(); ++i) {
      const char c = low[i];
      if (c == ' ' || c == '\t') continue;
      if (c == 's') status |= 1;
      else if (c == 'e') status |= 2;
      else if (c == 'w') status |= 4;
      else if (c == 't' && i + 2 < low.size() && low[i + 2] == ':') {
        char* end = nullptr;
        const double n = std::strtod(low.c_str() + i + 3, &end);
        const std::size_t axis = low[i + 1] == '1' ? 3 : low[i + 1] == '2' ? 5 : 6;
        if (learned_.flags.contains("turns")) {
          if (axis < 6) turns[axis] = integer(static_cast<std::int64_t>(n));
          else if (n != 0) {
            bad(at, "the turns of T" + std::string(1, low[i + 1]) + " are not read");
            return false;
          }
        }
        i = static_cast<std::size_t>(end - low.c_str()) - 1;
      } else {
        bad(at, "the configuration '" + std::string(text.substr(0, 40)) + "' is not read");
        return false;
      }
    }
    return true;
  }
  std::optional<Ex> setting_of(const With& with, const std::string& key) {
    if (const auto it = with.values.find(key); it != with.values.end()) return it->second;
    if (is_set(key)) return constant_of(get(key, kReal, here()));
    return std::nullopt;
  }
  /// A product of shares in %, which count from 100.
  Ex share(const Ex& of, const std::vector<std::optional<Ex>>& by, const At& at) {
    Ex out = of;
    for (const auto& e : by) {
      if (!e) continue;
      if (out.is_constant && e->is_constant && !out.is_place && !e->is_place) {
        out =
            measure(std::strtod(out.s.c_str(), nullptr) * std::strtod(e->s.c_str(), nullptr) / 100);
        continue;
      }
      out = scaled(binary(Op::mul, out, *e, at), 0.01);
    }
    return out;
  }
  void attributes(Motion& m, const With& with, bool is_joint, bool flies, const At& at) {
    const std::vector<std::optional<Ex>> by{
        setting_of(with, "$prog_spd_ovr"), setting_of(with, "$arm_spd_ovr"),
        setting_of(with, "$gen_ovr"), setting_of(with, "$arm_ovr")};
    const bool has_any = std::any_of(by.begin(), by.end(), [](const auto& e) { return !!e; });
    if (is_joint) {
      if (has_any) m.attributes.emplace_back("SPEED_PTP", share(real(100), by, at));
    } else {
      if (const auto v = setting_of(with, "$lin_spd"))
        m.attributes.emplace_back("SPEED", share(scaled(constant_of(*v), 1000), by, at));
      if (const auto w = setting_of(with, "$rot_spd"))
        m.attributes.emplace_back("SPEED_ORI", share(scaled(constant_of(*w), kDegree), by, at));
    }
    const std::optional<Ex> acc = setting_of(with, "$prog_acc_ovr")
                                      ? setting_of(with, "$prog_acc_ovr")
                                      : setting_of(with, "$arm_acc_ovr"),
                            dec = setting_of(with, "$prog_dec_ovr")
                                      ? setting_of(with, "$prog_dec_ovr")
                                      : setting_of(with, "$arm_dec_ovr");
    if (acc) m.attributes.emplace_back(is_joint ? "ACC_PTP" : "ACC", *acc);
    if (dec && (!acc || acc->s != dec->s) && !std::exchange(said_dec_, true))
      warn(
          at,
          "IRL has one number for acceleration and deceleration; the one of $PROG_ACC_OVR is used");
    if (flies) {
      if (auto mm = setting_of(with, "$fly_dist"); mm && !(mm->is_literal && mm->v < 0)) {
        if (is_joint && !std::exchange(said_zone_, true))
          note(at, "a $FLY_DIST in mm of a joint motion becomes C_PTP in %");
        if (is_joint && mm->is_literal && mm->v > 100) mm = real(100);
        m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", *mm);
      } else {
        const auto per = setting_of(with, "$fly_per");
        m.attributes.emplace_back(is_joint ? "C_PTP" : "C_SPEED", per ? *per : real(100));
      }
    }
    // $UFRAME is in the world, and $BASE is where the robot stands in it.
    const auto base = place_of(with, "$base"), frame = place_of(with, "$uframe");
    if (m.has_frames && (base || frame)) {
      Ex f = base ? value("INV(" + base->s + ")", kPose) : *frame;
      if (base && frame) f = binary(Op::compose, f, *frame, at);
      m.attributes.emplace_back("FRAME", f);
    }
    m.has_frames = false;
  }
  /// A number that get() gives as text.
  static Ex constant_of(const Ex& e) {
    if (e.is_literal || !e.is_constant || e.is_place) return e;
    char* end = nullptr;
    const double v = std::strtod(e.s.c_str(), &end);
    return *end == '\0' ? real(v) : e;
  }
  std::optional<Ex> place_of(const With& with, const std::string& key) {
    if (const auto it = with.values.find(key); it != with.values.end()) return it->second;
    const std::string modal = key.substr(1);
    if (is_set(modal)) return get(modal, kPose, here());
    return std::nullopt;
  }
  void motion(const At& at) {
    is_read_ = false;
    motion_read(at);
    if (!is_read_) skip_motion();
  }
  void motion_read(const At& at) {
    const bool flies = word_ == "movefly";
    if (accept("arm") && accept("[")) {
      const Token n = next();
      expect("]");
      if (n.raw != arm_) {
        skip_motion();
        bad(at, "a motion of another arm is not read", "Read a program for each arm.");
        return;
      }
    }
    std::string type;
    if (is("linear") || is("joint") || is("circular")) type = next().low;
    std::optional<Ex> to, via;
    bool is_step = false, has_frames = true;
    enum : std::uint8_t { whole, near_, away } how = whole;
    Ex by = failed();
    if (accept("to")) {
      to = place_here();
    } else if (accept("near")) {
      how = near_;
      to = place_here();
      expect("by");
      by = as_real(expression(), at);
    } else if (accept("away")) {
      how = away;
      by = as_real(expression(), at);
    } else if (accept("relative")) {
      to = converted(expression(), kPosition, at);
      expect("in");
      const Token in = next();
      is_step = true;
      has_frames = in.low == "uframe";
      if (in.low != "base" && in.low != "uframe") {
        skip_motion();
        bad(at, "IRL has no motions relative to the tool's present pose");
        return;
      }
    } else {
      skip_motion();
      bad(at, "TO, NEAR, AWAY or RELATIVE is expected here; other motions are not read");
      return;
    }
    if (accept("via")) via = place_here();
    accept("advance");
    std::string until;
    bool is_good = true;
    while (accept("til")) {
      const Ex c = converted(expression(), kBool, at);
      is_good = is_good && c.ok;
      until += (until.empty() ? "" : " OR ") + within(c, kAnd);
      accept(",");
    }
    With with;
    is_good = withs(with, at) && is_good;
    is_read_ = is_good && (!to || to->ok) && (!via || via->ok);
    if (!is_good || (to && !to->ok) || (via && !via->ok)) return;
    if (type.empty() && with.move_type) type = *with.move_type;
    if (type.empty() && move_type_) type = *move_type_;
    if (type.empty()) {
      if (learned_.flags.contains("move type") && (blocks_.size() > 0 || !is_in_main()))
        note(at, "the active $MOVE_TYPE is unknown here; a joint motion is assumed");
      type = "joint";
    }
    if (how == away) {
      if (goal_.empty() || !by.ok) {
        if (by.ok) bad(at, "the start of this motion is unknown", "Name its end position.");
        return;
      }
      to = value(goal_, kPose);
    }
    if (how != whole) {
      if (!by.ok) return;
      const Ex back = pose({real(0), real(0), negative(by)},
                           orientation("ORIQUAT", {real(1), real(0), real(0), real(0)}));
      to = binary(Op::compose, plain(*to, at), back, at);
    }
    Motion m;
    m.until = until;
    m.is_incremental = is_step;
    m.has_frames = has_frames;
    const bool is_joint = type == "joint";
    if (is_step) {
      m.word = is_joint ? "PTP" : "LIN";
      m.targets.push_back(*to);
      goal_.clear();
    } else if (type == "circular") {
      if (!via) {
        bad(at, "a circle needs a VIA position");
        return;
      }
      m.word = "CIRCLE";
      const Ex p = plain(*via, at), q = plain(*to, at);
      m.targets = {carried(*via, p), carried(*to, q)};
      goal_ = q.s;
    } else if (via) {
      bad(at, "only CIRCULAR motions have a VIA position");
      return;
    } else {
      m.word = is_joint ? "PTP" : "LIN";
      if (to->type.k == K::joint) {
        m.has_frames = false;
        goal_.clear();
        m.targets.push_back(is_joint ? *to : as_place(*to));
      } else {
        const Ex p = plain(*to, at);
        goal_ = p.s.size() < 300 ? p.s : "";
        m.targets.push_back(is_joint ? configured(*to, p, with, at) : carried(*to, p));
      }
    }
    for (const Ex& t : m.targets)
      if (!t.ok) return;
    if (!until.empty()) goal_.clear();
    attributes(m, with, is_joint, flies && until.empty(), at);
    if (const auto tool = with.values.find("$tool"); tool != with.values.end()) {
      if (is_set("tool")) {
        bad(at, "$TOOL of a single motion in addition to the global $TOOL is not read");
        return;
      }
      m.attributes.emplace_back("TOOL", tool->second);
    }
    move(std::move(m), at);
  }
  /// A target with its configuration, where that counts.
  Ex configured(const Ex& to, const Ex& p, const With& with, const At& at) {
    if (to.type.k != K::target) return p;
    std::optional<bool> cares = with.cares ? with.cares : cares_;
    if (!cares) {
      const bool yes = learned_.flags.contains("cares"), no = learned_.flags.contains("cares not");
      if (yes && no)
        return bad(at, "it is unknown whether configurations apply here",
                   "Write $CNFG_CARE := before the motion.");
      cares = yes || (!no && last_has_letters_);
    }
    return *cares ? to : carried(to, p);
  }
  /// A position with additional axes takes them along, also where its configuration does not count.
  Ex carried(const Ex& to, const Ex& p) {
    if (learned_.external_axes == 0 || to.type.k != K::target || !to.is_place || !is_extended(to.s))
      return p;
    std::vector<Ex> aux;
    for (int k = 1; k <= learned_.external_axes; ++k)
      aux.push_back(place(to.s + ".A_JOINT.AA" + std::to_string(k), kReal));
    return target(p, integer(-1), std::vector<Ex>(6, integer(-128)), aux);
  }
  /// Whether a place in IRL is an XTNDPOS, or an element of an array of them.
  [[nodiscard]] bool is_extended(const std::string& irl) const {
    return extended_.contains(irl.substr(0, irl.find_first_of(".[")));
  }
  Ex place_here() {
    part_.clear();
    last_has_letters_ = false;
    if (is("{")) return braces();
    Ex e = expression();
    if (part_ == "pos") e.is_place = false;  // it has no additional axes
    if (e.ok && e.type.k != K::target && e.type.k != K::pose && e.type.k != K::joint)
      return bad(here(), "a position is expected here");
    return e;
  }
  Ex braces() {
    const At at = here();
    next();
    std::vector<Ex> axes, outer;
    std::size_t n = 0;
    while (!at_line_end() && !is("}")) {
      const Ex e = is(",") ? real(0) : as_real(expression(), at);
      if (!e.ok) return e;
      (n < 6 ? axes : outer).push_back(e);
      ++n;
      if (!accept(",")) break;
    }
    expect("}");
    if (n < 1 || n > 18) return bad(at, "joints are expected here");
    return joints(axes, outer);
  }
  /// WITH $LIN_SPD = 0.5, $FLY_DIST = 5, on this line or the next ones; then ENDMOVE.
  bool withs(With& with, const At& at) {
    bool ok = true;
    for (;;) {
      const std::size_t before = at_;
      const bool has_comma = accept(",");
      std::size_t lines = 0;
      while (has_comma && peek().kind == Tk::line && lines < 50) {
        ++at_;
        ++lines;
      }
      if (accept("endmove")) return ok;
      if (!accept("with")) {
        at_ = before;
        std::size_t k = at_;
        while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
        if (k < tokens_.size() && tokens_[k].low == "endmove") at_ = k + 1;
        return ok;
      }
      do {
        while (peek().kind == Tk::line && !at_end()) ++at_;
        if (is("endmove")) break;
        const Token v = next();
        if (v.low == "condition") {
          bad(at, "condition handlers are not read", "Use IRL's UNTIL and interrupts instead.");
          skip_motion();
          return false;
        }
        if (!expect("=")) {
          skip_rest();
          return false;
        }
        setting(v, at, &with);
      } while (is(",") && [&] {
        // A comma goes on with the list; another WITH begins one of its own.
        std::size_t k = at_ + 1;
        while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
        if (k < tokens_.size() && (tokens_[k].low == "with" || tokens_[k].low == "endmove"))
          return false;
        ++at_;
        return true;
      }());
    }
  }
  /// The rest of a statement that goes on to ENDMOVE or ENDOPEN.
  void skip_motion() {
    for (;;) {
      skip_rest();
      std::size_t k = at_;
      while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
      const std::string& w = k < tokens_.size() ? tokens_[k].low : word_;
      const bool is_end = w == "endmove" || w == "endopen";
      if (k >= tokens_.size() || (w != "with" && !is_end)) return;
      at_ = k + 1;
      if (is_end) return;
    }
  }

  // ---- control flow ----

  void if_(const At& at) {
    const std::string c = truth(at);
    accept("then");
    emit("IF " + c + " THEN", at);
    open_block("endif", "ENDIF");
    forget();
  }
  void elsif(const At& at) {
    const std::string c = truth(at);
    accept("then");
    forget();
    if (is_in("endif")) between("ELSIF " + c + " THEN", at);
    else bad(at, "ELSIF is outside IF");
  }
  void else_(const At& at) {
    forget();
    if (is_in("endselect")) return default_(at);
    if (is_in("endif")) between("ELSE", at);
    else bad(at, "ELSE is outside IF");
  }
  void end_word(const At& at) {
    forget();
    close_block(word_, at);
  }
  void for_(const At& at) {
    const Token name = peek();
    will_write(name.low);
    const Ex v = places(false);
    expect(":=");
    const Ex from = as_integer(expression(), at);
    bool down = is("downto");
    if (!accept("to") && !accept("downto")) bad(here(), "TO or DOWNTO is expected here");
    const Ex to = as_integer(expression(), at);
    std::string step;
    if (accept("step")) {
      Ex s = as_integer(expression(), at);
      if (s.is_literal && s.v < 0) {
        s = negative(s);
        down = !down;
      }
      if (s.ok) step = " STEP " + s.s;
    }
    accept("do");
    const bool ok = v.ok && from.ok && to.ok && v.type.k == K::integer &&
                    v.s.find_first_of(".[") == std::string::npos;
    if (!ok && v.ok && from.ok && to.ok) bad(at, "the variable of FOR must be a whole number");
    if (ok) gives(v.s);
    emit(ok ? "FOR " + v.s + " := " + from.s + (down ? " DOWNTO " : " TO ") + to.s + step
            : std::string("WHILE FALSE DO"),
         at);
    open_block("endfor", ok ? "ENDFOR" : "ENDWHILE");
    forget();
  }
  void while_(const At& at) {
    const std::string c = truth(at);
    accept("do");
    emit("WHILE " + c + " DO", at);
    open_block("endwhile", "ENDWHILE");
    forget();
  }
  /// REPEAT / DELAY / UNTIL c is a WAIT FOR.
  void repeat(const At& at) {
    std::size_t k = at_;
    const auto pass_lines = [&] {
      while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
    };
    pass_lines();
    if (k < tokens_.size() && tokens_[k].low == "delay") {
      while (k < tokens_.size() && tokens_[k].kind != Tk::line) ++k;
      pass_lines();
      if (k < tokens_.size() && tokens_[k].low == "until") {
        at_ = k + 1;
        const Ex c = converted(expression(), kBool, at);
        if (c.ok) emit("WAIT FOR " + c.s + ";", at);
        return;
      }
    }
    emit("REPEAT", at);
    open_block("until", "UNTIL TRUE");
    forget();
  }
  void until(const At& at) {
    const std::string c = truth(at);
    forget();
    if (!is_in("until")) {
      bad(at, "UNTIL has no open loop");
      return;
    }
    blocks_.back().irl = "UNTIL " + c;
    close_block("until", at);
  }
  /// $TIMER[n] := 0 / REPEAT / DELAY / UNTIL (c) OR ($TIMER[n] >= t) is a WAIT FOR with TIMEOUT.
  void timer(const At& at) {
    const std::size_t begin = at_;
    std::string n;
    if (accept("[")) {
      n = std::string(next().raw);
      expect("]");
    }
    const auto fail_here = [&] {
      at_ = begin;
      skip_rest();
      bad(at, "IRL has no timers that run in parallel to the program",
          "Only $TIMER[n] := 0 before a REPEAT that waits for a condition or the time is read.");
    };
    if (!accept(":=") || !(peek().kind == Tk::number && peek().value == 0)) return fail_here();
    next();
    std::size_t k = at_;
    const auto pass_lines = [&] {
      while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
    };
    const auto has = [&](auto... words) {
      std::size_t i = k;
      for (const std::string_view w : {std::string_view(words)...}) {
        if (i >= tokens_.size() || (tokens_[i].low != w && tokens_[i].raw != w)) return false;
        ++i;
      }
      return true;
    };
    pass_lines();
    if (!has("repeat")) return fail_here();
    ++k;
    pass_lines();
    if (!has("delay")) return fail_here();
    while (k < tokens_.size() && tokens_[k].kind != Tk::line) ++k;
    pass_lines();
    if (!has("until")) return fail_here();
    const std::size_t until = k;
    std::size_t or_ = 0;
    int depth = 0;
    for (; k < tokens_.size() && tokens_[k].kind != Tk::line; ++k) {
      depth += tokens_[k].low == "(" ? 1 : tokens_[k].low == ")" ? -1 : 0;
      if (depth == 0 && has("or", "(", "$timer", "[", n, "]", ">=")) or_ = k;
    }
    const std::size_t end = k;
    if (or_ == 0) return fail_here();
    at_ = until + 1;
    const Token kept = tokens_[or_];
    tokens_[or_].kind = Tk::line;
    Ex c = converted(expression(), kBool, at);
    if (c.ok && at_ != or_) c = bad(here(), "this is not expected here");
    tokens_[or_] = kept;
    at_ = or_ + 7;
    const Ex ms = as_real(expression(), at);
    expect(")");
    if (!c.ok || !ms.ok) {
      at_ = end;
      return;
    }
    emit("WAIT FOR " + c.s + " TIMEOUT " + within(seconds_of(ms), kSum) + ";", tokens_[until].at);
    // Whether it was the time.
    k = at_;
    if (!at_line_end()) return;
    pass_lines();
    if (k + 1 < tokens_.size() && tokens_[k].kind == Tk::name && tokens_[k + 1].low == ":=") {
      const std::size_t flag = k;
      k += 2;
      if (!has("$timer", "[", n, "]", ">=")) return;
      at_ = flag;
      const Ex to = places(false);
      while (!at_line_end()) ++at_;
      gives(to.s);
      assign(to, value("R_TIMEOUT", kBool), at);
    }
  }
  /// Milliseconds, without the rounding to whole ones.
  Ex seconds_of(const Ex& ms) {
    Ex e = ms;
    if (!e.is_literal && e.s.starts_with("ROUND(") && e.s.ends_with(" * 1000)"))
      return value(e.s.substr(6, e.s.size() - 6 - 8), kReal, kTerm);
    if (!e.is_literal && e.s.starts_with("ROUND(") && e.s.ends_with(" * 1000.0)"))
      return value(e.s.substr(6, e.s.size() - 6 - 10), kReal, kTerm);
    return scaled(e, 0.001);
  }
  void select(const At& at) {
    open_case("endselect", at);
    accept("of");
    forget();
  }
  void case_(const At& at) {
    forget();
    if (!is_in("endselect")) {
      bad(at, "CASE is outside SELECT");
      return skip_rest();
    }
    std::vector<ArmValue> values;
    if (expect("(")) {
      do {
        values.push_back({expression()});
      } while (accept(","));
      expect(")");
    }
    accept(":");
    open_arm(values, at);
  }
  void default_(const At& at) {
    forget();
    accept(":");
    if (is_in("endselect")) open_default(at);
    else bad(at, "DEFAULT is outside SELECT");
  }
  void jump(const At& at) {
    const Token t = next();
    const auto has = [&] {
      for (std::size_t k = 0; k + 1 < tokens_.size(); ++k)
        if (tokens_[k].low == t.low && tokens_[k + 1].low == "::") return true;
      return false;
    };
    if (t.kind != Tk::name || !has()) {
      bad(at, "the label " + std::string(t.raw.substr(0, 40)) + " does not exist");
      return;
    }
    emit("GOTO " + label(t.raw) + ";", at);
  }
  void return_(const At& at) {
    if (at_line_end()) {
      emit("RETURN;", at);
      return;
    }
    const Ex e = expression();
    if (is_in_main() || result_.k == K::none) {
      if (e.ok) bad(at, "this routine returns no value");
      return;
    }
    const Ex x = converted(e, result_, at);
    if (x.ok) emit("RETURN " + x.s + ";", at);
  }
  void wait(const At& at) {
    if (!accept("for")) {
      skip_rest();
      bad(at, "semaphores are not read");
      return;
    }
    const Ex c = converted(expression(), kBool, at);
    if (c.ok) emit("WAIT FOR " + c.s + ";", at);
  }
  void delay(const At& at) {
    const Ex ms = as_real(expression(), at);
    if (ms.is_literal && ms.v < 0) bad(at, "a time must not be negative");
    else if (ms.ok) emit("WAIT " + within(seconds_of(ms), kSum) + " SEC;", at);
  }
  void pause(const At& at) {
    if (!at_line_end()) {
      skip_rest();
      bad(at, "pauses of other programs are not read");
      return;
    }
    emit("PAUSE;", at);
  }
  void deactivate(const At& at) {
    if (!at_line_end()) {
      const Token t = next();
      if (t.low != lower(name_)) {
        skip_rest();
        bad(at, "other programs are not read");
        return;
      }
    }
    emit("HALT;", at);
  }
  void cycle(const At& at) {
    if (!is_in_main() || !blocks_.empty()) {
      bad(at, "CYCLE is within a block or a routine");
      return;
    }
    emit("LOOP", at);
    open_block("end", "ENDLOOP");
    forget();
  }
  void pulse(const At& at) {
    if (peek().low != "$dout") {
      skip_rest();
      bad(at, "only pulses of $DOUT are read");
      return;
    }
    Symbol* s = signal_here(at);
    if (!accept("for")) bad(at, "FOR is expected here");
    const Ex ms = as_real(expression(), at);
    if (accept(",")) skip_rest();
    accept("advance");
    if (!s || !ms.ok) return;
    emit(s->irl + " := TRUE;", at);
    emit("WAIT " + within(scaled(ms, 0.001), kSum) + " SEC;", at);
    emit(s->irl + " := FALSE;", at);
    warn(at, "the IRL program waits for the end of this pulse; the controller may continue");
  }
  void condition_block(const At& at) {
    while (!at_end() && !is("endcondition")) ++at_;
    accept("endcondition");
    skip_rest();
    bad(at, "condition handlers are not read", "Use IRL's UNTIL and interrupts instead.");
  }
  /// JNT(place, joints ...)
  void jnt(const At& at) {
    expect("(");
    const Token name = peek();
    will_write(name.low);
    const Ex to = places(false);
    std::vector<Ex> axes, outer;
    bool ok = to.ok;
    while (accept(",")) {
      const Ex e = as_real(expression(), at);
      ok = ok && e.ok;
      (axes.size() < 6 ? axes : outer).push_back(e);
    }
    expect(")");
    if (!ok) return;
    gives(to.s);
    assign(to, joints(axes, outer), at);
  }
  void write(const At& at) {
    if (!is("(")) {
      const Token lun = next();
      if (lun.low != "lun_crt" && lun.low != "lun_tp" && lun.low != "crt_lun") {
        skip_rest();
        bad(at, "files are not read", "WRITE to the screen becomes WRITELN.");
        return;
      }
    }
    if (!expect("(")) return;
    std::string list;
    bool ok = true;
    const auto flush = [&](bool ends) {
      if (ends) emit("WRITELN(" + (list.empty() ? "''" : list) + ");", at);
      else if (!list.empty()) emit("WRITE(" + list + ");", at);
      list.clear();
    };
    std::size_t count = 0;
    std::vector<std::pair<std::string, bool>> lines;
    while (!at_line_end() && !is(")") && count++ < 200) {
      if (accept("nl")) {
        lines.emplace_back(std::exchange(list, {}), true);
      } else {
        const Ex e = expression();
        ok = ok && e.ok;
        list += (list.empty() ? "" : ", ") + e.s;
        while (accept("::")) next();
      }
      if (!accept(",")) break;
    }
    expect(")");
    lines.emplace_back(std::exchange(list, {}), false);
    if (!ok) return;
    for (auto& [text, ends] : lines) {
      list = text;
      flush(ends);
    }
  }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    if (op == Op::compose && (a.type.k == K::target || b.type.k == K::target))
      return binary(op, plain(a, at), b.type.k == K::target ? plain(b, at) : b, at);
    if (a.type.k == K::position && b.type.k == K::position && (op == Op::add || op == Op::sub) &&
        a.is_place && b.is_place) {
      std::string list;
      for (const char c : {'X', 'Y', 'Z'})
        list += (list.empty() ? "" : ", ") + a.s + "." + c + (op == Op::add ? " + " : " - ") + b.s +
                "." + c;
      return value("POSITION(" + list + ")", kPosition);
    }
    return std::nullopt;
  }
  /// A name with its elements and fields; `is_read`: it has to have a value.
  Ex places(bool is_read) {
    const Token t = next();
    const At at = t.at;
    part_.clear();
    Symbol* s = find(t.low);
    if (!s || s->kind == Symbol::routine)
      return bad(at, "the name " + std::string(t.raw.substr(0, 40)) + " is not declared here");
    Ex e = place(s->irl, s->type);
    e.is_place = s->kind != Symbol::constant;
    e.is_constant = s->kind == Symbol::constant;
    const bool is_target = e.type.k == K::target || e.type.k == K::joint;
    if (is_read && is_target && !s->is_in_parameter &&
        !learned_.flags.contains("given " + s->irl) && learned_.flags.contains("passed") &&
        !parameters_.contains(t.low) && unvalued_.insert(s->irl).second)
      fail(at, std::string(t.raw) + " has no value in this program; it is zero here",
           "Assign one: the controller stores it in the .var file.");
    for (;;) {
      if (is("[") && e.type.k == K::array) {
        next();
        std::string list;
        std::size_t n = 0;
        do {
          const Ex i = as_integer(expression(), at);
          if (!i.ok) return i;
          list += (n++ ? ", " : "") + i.s;
        } while (accept(","));
        expect("]");
        if (n != e.type.bounds.size())
          return bad(at, "the array has " + std::to_string(e.type.bounds.size()) + " indices");
        const Type of = *e.type.element;
        e = place(e.s + "[" + list + "]", of);
        continue;
      }
      if (is("[") && e.type.k == K::joint) {
        next();
        const Ex i = as_integer(expression(), at);
        expect("]");
        const auto n = constant_number(i);
        if (!i.ok) return i;
        if (!n || *n < 1 || *n > 18) return bad(at, "the number of this joint is unknown");
        const int k = static_cast<int>(*n);
        if (k > 6) learned_.external_axes = std::max(learned_.external_axes, k - 6);
        const std::string of = learned_.external_axes > 0 ? ".M_JOINT.A" : ".A";
        e = place(e.s + (k > 6 ? ".A_JOINT.AA" + std::to_string(k - 6) : of + std::to_string(k)),
                  kReal);
        continue;
      }
      if (!is(".") || peek(1).kind != Tk::name) return e;
      next();
      const Token f = next();
      if (e.type.k == K::record) {
        const auto& fields = records_[e.type.record];
        const auto it = std::find_if(fields.begin(), fields.end(),
                                     [&](const auto& x) { return x.first == f.low; });
        if (it == fields.end())
          return bad(f.at, "there is no component " + std::string(f.raw.substr(0, 40)) + " here");
        e = place(e.s + ".f_" + f.low, it->second);
        continue;
      }
      if (e.type.k == K::position && f.low.size() == 1 && f.low[0] >= 'x' && f.low[0] <= 'z') {
        e = place(e.s + "." + static_cast<char>(f.low[0] - 32), kReal);
        continue;
      }
      if (e.type.k == K::target && f.low == "pos" && is_extended(e.s)) {
        part_ = "pos";
        continue;
      }
      if (e.type.k == K::target && f.low == "aux" && accept("[")) {
        const Ex i = expression();
        expect("]");
        const auto n = constant_number(i);
        if (!n || *n < 1 || *n > 12) return bad(at, "the number of this axis is unknown");
        learned_.external_axes = std::max(learned_.external_axes, static_cast<int>(*n));
        e = place(e.s + ".A_JOINT.AA" + std::to_string(static_cast<int>(*n)), kReal);
        continue;
      }
      if (e.type.k == K::target || e.type.k == K::pose) {
        const std::string p = e.s + (e.type.k == K::target ? ".PSE" : "");
        part_.clear();
        if (f.low == "x" || f.low == "y" || f.low == "z") {
          e = place(p + ".POS." + static_cast<char>(f.low[0] - 32), kReal);
          continue;
        }
        if (f.low == "a" || f.low == "e" || f.low == "r") {
          static constexpr const char* kAngles[] = {"ANGLEZ", "ANGLEY", "ANGLEZ2"};
          const std::size_t which = f.low == "a" ? 0 : f.low == "e" ? 1 : 2;
          const auto angle = [&](std::size_t k) {
            return std::string(kAngles[k]) + "('ZYZ2', " + p + ".ORI)";
          };
          Ex a = value(angle(which), kReal);
          a.is_place = true;
          a.setter = p + ".ORI := ORIZYZ2(";
          for (std::size_t k = 0; k < 3; ++k)
            a.setter += (k ? ", " : "") + (k == which ? std::string("%") : angle(k));
          a.setter += ")";
          e = a;
          continue;
        }
      }
      return bad(f.at, "there is no component " + std::string(f.raw.substr(0, 40)) + " here");
    }
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      e.is_grouped = true;
      e.is_place = false;  // a value, and no variable that a routine may change
      return e;
    }
    if (is("{")) return braces();
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    if (t.low == "true" || t.low == "on") return next(), boolean(true);
    if (t.low == "false" || t.low == "off") return next(), boolean(false);
    if (is_signal(t.low)) {
      const Symbol* s = signal_here(at);
      if (!s) return failed();
      return place(s->irl, s->type);
    }
    if (t.low == "$tool") return next(), get("tool", kPose, at);
    if (t.low == "$uframe") return next(), get("uframe", kPose, at);
    if (t.low == "$base") return next(), get("base", kPose, at);
    if (t.low.starts_with("$")) {
      next();
      if (accept("[")) skip_to("]");
      return bad(
          at, std::string(t.raw.substr(0, 40)) + " is specific to the controller and is not read");
    }
    const Symbol* s = find(t.low);
    if (s && s->kind != Symbol::routine) return places(true);
    if (s) {
      const Type result = s->type;
      next();
      std::vector<Ex> args;
      if (accept("(")) args = call_arguments(t.low);
      for (const Ex& e : args)
        if (!e.ok) return failed();
      if (result.k == K::none) return bad(at, std::string(t.raw) + " returns no value");
      const std::string text = call(t.raw, args, at, result);
      return text.empty() ? failed() : value(text, result);
    }
    if (t.low == "arm_jntp" && !is("(", 1)) return next(), present_joints();
    if (is("(", 1)) return function();
    next();
    if (maker_word(language(), t.low))
      return bad(
          at, std::string(t.raw.substr(0, 40)) + " is specific to the controller and is not read");
    return bad(at, "the name " + std::string(t.raw.substr(0, 40)) + " is not declared here");
  }
  Ex function() {
    const Token t = next();
    const At at = t.at;
    next();
    if (t.low == "pos") return pos(at);
    const auto a = arguments();
    for (const Ex& e : a)
      if (!e.ok) return failed();
    if (t.low == "arm_jntp" && a.empty()) return present_joints();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},   {"cos", "COS"},     {"tan", "TAN"},     {"asin", "ASIN"},
        {"acos", "ACOS"}, {"atan2", "ATAN2"}, {"sqrt", "SQRT"},   {"exp", "EXP"},
        {"ln", "LN"},     {"abs", "ABS"},     {"round", "ROUND"}, {"trunc", "TRUNC"}};
    if (const auto it = kMath.find(t.low); it != kMath.end()) return math(it->second, a, at);
    if (t.low == "vec" && a.size() == 3) return position(a);
    if (t.low == "pos_inv" && a.size() == 1) {
      const Ex p = plain(a[0], at);
      return p.ok ? value("INV(" + p.s + ")", kPose) : p;
    }
    if (t.low == "str_len" && a.size() == 1 && a[0].type.k == K::string)
      return value("LENGTH(" + a[0].s + ")", kInt);
    if (t.low == "chr" && a.size() == 1 && is_number(a[0].type))
      return value("CHR(" + as_integer(a[0], at).s + ")",
                   {.k = K::character, .record = {}, .bounds = {}, .element = {}});
    if (maker_word(language(), t.low))
      return bad(at, std::string(t.raw) + " is a controller function and is not read");
    return bad(at, "the function " + std::string(t.raw.substr(0, 40)) + " is not in this program");
  }
  Ex pos(const At& at) {
    std::vector<Ex> n;
    std::string text;
    bool ok = true;
    while (!at_line_end() && !is(")")) {
      if (peek().kind == Tk::text) {
        text = std::string(next().raw);
      } else {
        n.push_back(as_real(is(",") ? real(0) : expression(), at));
        ok = ok && n.back().ok;
      }
      if (!accept(",")) break;
    }
    expect(")");
    if (!ok) return failed();
    if (n.size() > 6) return bad(at, "a position must be six numbers and a configuration");
    while (n.size() < 6) n.push_back(real(0));
    int status = 0;
    std::vector<Ex> turns;
    if (!configuration(text, status, turns, at)) return failed();
    last_has_letters_ = status != 0;
    const Ex p = pose({n[0], n[1], n[2]}, orientation("ORIZYZ2", {n[3], n[4], n[5]}));
    last_status_ = status;
    last_pose_ = p.s;
    Ex e = target(p, integer(status), turns, {});
    if (e.ok) poses_.emplace(e.s, p.s);
    return e;
  }

  std::map<std::string, Type> types_named_;
  std::map<std::string, double> numbers_;  ///< constants, by their names in IRL
  std::set<std::string> extended_, unvalued_, parameters_, exported_;
  std::map<std::string, std::string> poses_;  ///< of targets that are written out
  std::string arm_ = "1", word_, goal_, part_, last_pose_;
  Type result_;
  std::optional<bool> cares_;             ///< $CNFG_CARE, where it is known
  std::optional<std::string> move_type_;  ///< $MOVE_TYPE, where it is known
  std::optional<int> last_status_;
  bool is_announcing_ = false, has_body_ = false, is_extended_ = false, last_has_letters_ = false;
  bool is_read_ = false, said_groups_ = false, said_dec_ = false, said_zone_ = false;
};

}  // namespace

Made read_pdl2(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<Pdl2Reader>(task, params, progress);
}

}  // namespace robomosp::readers

// SPDX-License-Identifier: Apache-2.0
// ABB RAPID: modules of .mod, .prg and .sys.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kRapidStyle{.comment = "!",
                        .quotes = "\"",
                        .name_first = "_",
                        .name_rest = "_",
                        .signs = {":=", "<>", "<=", ">="},
                        .has_lines = false,
                        .joins_in_brackets = false,
                        .hex = "0x"};
constexpr Binary kRapidBinaries[] = {
    {"or", 10, Op::or_}, {"xor", 10, Op::exor}, {"and", 12, Op::and_}, {"=", 20, Op::eq},
    {"<>", 20, Op::ne},  {"<", 20, Op::lt},     {">", 20, Op::gt},     {"<=", 20, Op::le},
    {">=", 20, Op::ge},  {"+", 30, Op::add},    {"-", 30, Op::sub},    {"*", 40, Op::mul},
    {"/", 40, Op::div},  {"div", 40, Op::idiv}, {"mod", 40, Op::mod}};

/// A value in brackets, or the expression that one consists of.
struct Aggregate {
  std::vector<Aggregate> items;
  Ex e;
  bool is_list = false;
  At at;
};

/// Names that a module declares outside of its routines, and those of others that it may use.
struct RapidNames {
  std::set<std::string> local, global, used;
};
RapidNames rapid_names(const std::vector<Token>& tokens) {
  RapidNames out;
  std::string end;                    // of the routine or record that is open
  std::set<std::string> inside, own;  // names in it, and those that it declares itself
  std::vector<std::string> counters;  // of its open FOR loops, which hide other names
  std::size_t head_end = 0;           // behind its parameters
  const auto close = [&] {
    std::set_difference(inside.begin(), inside.end(), own.begin(), own.end(),
                        std::inserter(out.used, out.used.end()));
    inside.clear();
    own.clear();
    counters.clear();
    end.clear();
  };
  for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
    const Token& t = tokens[i];
    const Token& behind = tokens[i + 1];
    if (t.kind != Tk::name) continue;
    const bool is_part = i > 0 && (tokens[i - 1].low == "." || tokens[i - 1].low == "\\");
    const bool is_data = t.low == "var" || t.low == "const" || t.low == "pers";
    if (!end.empty()) {
      if (t.low == end) {
        close();
        continue;
      }
      if (end == "endrecord") {  // type component;
        if (behind.low != ";") inside.insert(t.low);
        continue;
      }
      // The name of a parameter ends it: INOUT num x{*}, \switch on | \switch off
      static const std::set<std::string, std::less<>> kBehind{",", ")", "{", "|", "\\"};
      if (i < head_end && kBehind.contains(behind.low)) own.insert(t.low);
      if (is_data && i + 2 < tokens.size() && tokens[i + 2].kind == Tk::name)
        own.insert(tokens[i + 2].low);
      if (t.low == "goto") own.insert(behind.low);
      if (t.low == "for") counters.push_back(behind.low);
      if (t.low == "endfor" && !counters.empty()) counters.pop_back();
      if (!is_part && std::find(counters.begin(), counters.end(), t.low) == counters.end())
        inside.insert(t.low);
      continue;
    }
    if (!is_part) out.used.insert(t.low);
    const bool is_routine = t.low == "proc" || t.low == "func" || t.low == "trap";
    if (!is_routine && !is_data && t.low != "record" && t.low != "alias") continue;
    std::size_t k = i + (t.low == "func" || is_data || t.low == "alias" ? 2 : 1);
    if (k >= tokens.size() || tokens[k].kind != Tk::name) continue;
    const bool is_local = i > 0 && tokens[i - 1].low == "local";
    (is_local ? out.local : out.global).insert(tokens[k].low);
    if (!is_routine && t.low != "record") continue;
    end = "end" + t.low;
    head_end = 0;
    if (is_routine && k + 1 < tokens.size() && tokens[k + 1].low == "(")
      for (head_end = k + 1; head_end < tokens.size() && tokens[head_end].low != ")";) ++head_end;
  }
  close();
  return out;
}

class RapidReader final : public Reader {
 public:
  using Reader::Reader;

  [[nodiscard]] MakerLanguage language() const override { return MakerLanguage::rapid; }

  void run() override {
    name_ = std::string(stem(files_[0].name));
    starts_with("displacement", identity());
    name_locals();
    for (is_announcing_ = true;; is_announcing_ = false) {
      for (std::size_t f = 0; f < files_.size(); ++f)
        if (!is_list_of_modules(f)) file(f);
      if (!is_announcing_) break;
    }
    if (!has_main_)
      note({}, "no routine is named main; the program has no statements",
           "Call one of its procedures after BEGIN.");
  }

 protected:
  /// Joints and external axes of VAR are 0; a rotation of zeros is none.
  [[nodiscard]] bool begins_without_value(K k) const override { return k != K::joint; }

 private:
  std::span<const Binary> binaries() const override { return kRapidBinaries; }
  int turns_from() const override { return 0; }
  std::string_view not_word() const override { return "not"; }
  /// NOT stands before a logical term, which may have AND in it: NOT a AND b is NOT (a AND b)
  /// (RAPID kernel, expressions).
  int not_precedence() const override { return 11; }
  void skip_rest() override {
    while (!at_end() && !is(";") && !is("endproc") && !is("endfunc") && !is("endtrap") &&
           !is("endmodule"))
      next();
  }
  void skip_condition() override {
    while (!at_end() && !is("then") && !is("do") && !is(";") && !is("endif") && !is("endwhile") &&
           !is("endproc") && !is("endfunc") && !is("endtrap"))
      next();
  }
  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At&) override {
    if (a.type.k == K::position && b.type.k == K::position && (op == Op::add || op == Op::sub) &&
        a.is_place && b.is_place) {
      std::string list;
      for (const char c : {'X', 'Y', 'Z'})
        list += (list.empty() ? "" : ", ") + a.s + "." + c + (op == Op::add ? " + " : " - ") + b.s +
                "." + c;
      return value("POSITION(" + list + ")", kPosition);
    }
    if (op == Op::mul && a.type.k == K::orientation && b.type.k == K::orientation)
      return value(within(a, kTerm) + " @ " + within(b, kSign), kOrientation, kTerm);
    return std::nullopt;
  }

  // ---- types ----

  /// A .pgf names modules in XML; some hold a module themselves.
  bool is_list_of_modules(std::size_t f) const {
    return extension(files_[f].name) == "pgf" &&
           lower(files_[f].text.substr(0, 4000)).find("<program") != std::string::npos;
  }
  /// Of what is declared with a type of RAPID; nothing where IRL has none.
  std::optional<Type> type_named(const std::string& low) const {
    static const std::map<std::string, Type, std::less<>> kTypes{
        {"num", kReal},       {"dnum", kReal},        {"bool", kBool},
        {"string", kString},  {"pos", kPosition},     {"orient", kOrientation},
        {"pose", kPose},      {"robtarget", kTarget}, {"jointtarget", kJoint},
        {"speeddata", kReal}, {"zonedata", kReal},    {"tooldata", kPose},
        {"wobjdata", kPose},  {"byte", kReal}};
    if (const auto it = kTypes.find(low); it != kTypes.end()) return it->second;
    if (const auto it = types_named_.find(low); it != types_named_.end()) return it->second;
    return std::nullopt;
  }
  static bool is_speed(const std::string& t) { return t == "speeddata" || t == "zonedata"; }

  // ---- modules ----

  /// A name that a module declares LOCAL and another module has, too, is one of its own:
  /// "p1" of the module b is "p1.b".
  void name_locals() {
    if (files_.size() < 2) return;
    std::vector<RapidNames> all;
    std::map<std::string, int> files_with;
    for (std::size_t f = 0; f < files_.size(); ++f) {
      scan(f, kRapidStyle);
      all.push_back(rapid_names(tokens_));
      std::set<std::string> names;
      for (const Token& t : tokens_)
        if (t.kind == Tk::name) names.insert(t.low);
      for (const std::string& n : names) ++files_with[n];
    }
    local_names_.resize(files_.size());
    for (std::size_t f = 0; f < files_.size(); ++f)
      for (const std::string& n : all[f].local)
        if (files_with[n] > 1) local_names_[f].insert(n);
  }
  void scan_module(std::size_t f) {
    scan(f, kRapidStyle);
    if (f >= local_names_.size() || local_names_[f].empty()) return;
    const std::string module(stem(files_[f].name));
    for (std::size_t i = 0; i < tokens_.size(); ++i) {
      Token& t = tokens_[i];
      if (t.kind != Tk::name || !local_names_[f].contains(t.low) ||
          (i > 0 && (tokens_[i - 1].low == "." || tokens_[i - 1].low == "\\")))
        continue;
      const std::string& text =
          own_texts_
              .try_emplace(std::string(t.raw) + "." + module, std::string(t.raw) + "." + module)
              .first->second;
      t.raw = text;
      t.low = lower(text);
    }
  }
  void file(std::size_t f) {
    scan_module(f);
    looked_at_of_ = nullptr;
    if (is_announcing_) next_comment_ = comments_.size();
    if (is("%")) {
      int n = 0;
      while (!at_end() && n < 6) n += next().low == "%";
    }
    while (!at_end()) {
      if (progress_.cancelled()) {
        statement(here(), [] {});
        return;
      }
      item();
    }
  }
  void item() {
    const At at = here();
    accept("local");
    accept("task");
    if (accept("module")) {
      const Token name = next();
      if (at.file == 0) name_ = std::string(name.raw);
      if (accept("("))
        while (!at_end() && !accept(")")) next();
      return;
    }
    if (accept("endmodule")) return;
    if (is("var") || is("const") || is("pers")) {
      if (is_announcing_) return statement(at, [&] { data(); });
      skip_rest();
      accept(";");
      return;
    }
    if (accept("record")) return record(at);
    if (accept("alias")) {
      const Token of = next();
      const Token name = next();
      if (const auto t = type_named(of.low)) types_named_[name.low] = *t;
      accept(";");
      return;
    }
    if (is("proc") || is("func") || is("trap")) return routine();
    if (accept(";")) return;
    if (is_announcing_) {
      fail(at,
           "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected outside a routine",
           "A module holds data and routines: MODULE name, PROC name(), ENDPROC, ENDMODULE.");
    }
    next();
    while (!at_end() && !is(";") && !is("proc") && !is("func") && !is("trap") && !is("endmodule") &&
           !is("var") && !is("const") && !is("pers") && !is("module"))
      next();
  }
  void record(const At& at) {
    const Token name = next();
    Type t;
    t.k = K::record;
    std::string fields, irl;
    std::vector<std::pair<std::string, Type>> known;
    bool is_good = true;
    while (!at_end() && !accept("endrecord")) {
      const Token of = next();
      const Token field = next();
      if (!accept(";")) {
        skip_rest();
        accept(";");
        is_good = false;
        continue;
      }
      const auto type = type_named(of.low);
      is_good = is_good && type && type->k != K::none;
      if (type) {
        known.emplace_back(field.low, *type);
        fields += " " + type_text(*type) + ": f_" + field.low + ";";
      }
    }
    if (!is_announcing_) return;
    if (!is_good || known.empty()) {
      fail(at, "the record " + std::string(name.raw) + " has components that IRL does not have");
      return;
    }
    t.record = irl_name(name.raw);
    records_[t.record] = known;
    types_.push_back({"RECORD" + fields + " ENDRECORD: " + t.record + ";", at, true});
    types_named_[name.low] = t;
  }
  void data(bool is_local = false) {
    const At from = here();
    const std::string how = next().low;
    const Token of = next();
    const Token name = next();
    const auto type = type_named(of.low);
    if (!type || name.kind != Tk::name) {
      skip_rest();
      accept(";");
      if (name.kind == Tk::name) unread_.insert(name.low);
      const bool is_signal = of.low.starts_with("signal");
      note(from, "IRL has no type " + std::string(of.raw.substr(0, 40)) + "; " +
                     std::string(name.raw.substr(0, 40)) + " is left out" +
                     (is_signal ? " here" : ""));
      return;
    }
    Type t = *type;
    if (accept("{")) {
      std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
      do {
        const Ex n = as_integer(expression(), from);
        const auto known = sizes_.find(lower(n.s));
        const double v = n.is_literal ? n.v : known != sizes_.end() ? known->second : 0;
        if (!(v >= 1 && v <= 100000)) {
          bad(from, "the size of " + std::string(name.raw) + " is not known");
          skip_rest();
          accept(";");
          return;
        }
        bounds.emplace_back(1, static_cast<std::int64_t>(v));
      } while (accept(","));
      expect("}");
      t = array_of(t, bounds);
    }
    std::string text;
    bool is_constant = how == "const";
    int frames = 0;
    if (accept(":=")) {
      want_ = of.low;
      const Aggregate a = aggregate();
      both_frames_ = 0;
      const Ex e = built(a, of.low, t);
      frames = std::exchange(both_frames_, 0);
      want_.clear();
      if (e.ok && !is_local && calls_routine(e.s))
        bad(from, "a function call is not read in a declaration",
            "Assign it at the start of the program.");
      if (!e.ok || (!is_local && calls_routine(e.s))) {
        skip_rest();
        accept(";");
        // Declared all the same, so that what uses it is read.
        declare_variable(declare(name.raw, t, Symbol::variable, is_local), {}, from, is_local);
        return;
      }
      text = e.s;
      is_constant = is_constant && e.is_constant;
      if (is_constant && e.is_literal) {
        sizes_["round(" + name.low + ")"] = e.v;
        sizes_[name.low] = e.v;
      }
    } else {
      is_constant = false;
    }
    expect(";");
    if (!is_local && globals_.contains(name.low)) {
      bad(name.at, std::string(name.raw) + " is declared twice");
      return;
    }
    Symbol& s =
        declare(name.raw, t,
                is_constant && !(is_local && !is_in_main()) ? Symbol::constant : Symbol::variable,
                is_local);
    if (is_constant) sizes_["round(" + lower(s.irl) + ")"] = sizes_[name.low];
    keep_frames(s.irl, frames);
    declare_variable(s, text, from, is_local);
  }
  void keep_frames(const std::string& irl, int which) {
    if (which & 1) learned_.flags.insert("uframe " + irl);
    if (which & 2) learned_.flags.insert("oframe " + irl);
  }
  std::vector<Parameter> parameters() {
    std::vector<Parameter> out;
    if (!accept("(")) return out;
    bool is_optional = false;
    while (!at_end() && !is(")")) {
      if (accept("\\")) is_optional = true;
      Parameter p;
      if (accept("switch")) {
        const Token name = next();
        optional_.insert(name.low);
      } else {
        p.is_out = accept("inout") || accept("var") || accept("pers");
        const Token of = next();
        const Token name = next();
        p.foreign = std::string(name.raw);
        const auto t = type_named(of.low);
        if (of.low.starts_with("signal")) {
          p.type = kBool;
          if (is_announcing_)
            fail(of.at, "IRL has no signal parameters", "Use the signal by name in the routine.");
        } else {
          p.type = t.value_or(kReal);
          if (!t && is_announcing_)
            fail(of.at, "IRL has no type " + std::string(of.raw.substr(0, 40)));
        }
        if (accept("{")) {
          while (!at_end() && !accept("}")) next();
          if (is_announcing_) fail(of.at, "IRL has no open-size arrays as parameters");
        }
        if (is_optional) {
          optional_.insert(name.low);
          if (is_announcing_)
            warn(name.at, "IRL has no optional parameters; " + p.foreign + " is missing");
        } else {
          out.push_back(std::move(p));
        }
      }
      if (accept(",")) is_optional = false;
      else if (is("\\") || is("|")) accept("|");
      else break;
    }
    if (!accept(")")) {
      fail(here(), "\")\" is expected here");
      while (!at_end() && !accept(")")) next();
    }
    return out;
  }
  void routine() {
    const At at = here();
    const std::string kind = next().low;
    Type result;
    std::string result_name;
    if (kind == "func") {
      const Token of = next();
      result_name = of.low;
      const auto t = type_named(of.low);
      result = t.value_or(kReal);
      if (!t && is_announcing_) fail(of.at, "IRL has no type " + std::string(of.raw.substr(0, 40)));
    }
    const Token name = next();
    const auto list = kind == "trap" ? std::vector<Parameter>{} : parameters();
    const bool is_main = name.low == "main" && kind == "proc" && list.empty();
    const std::string end = "end" + kind;
    if (is_announcing_) {
      if (is_main) has_main_ = true;
      else announce(name.raw, list, result);
      while (!at_end() && !accept(end)) next();
      return;
    }
    result_name_ = result_name;
    if (is_main) close();
    else begin(name.raw, list, result, at);
    current().indent = 1;
    blocks_.clear();
    while (!at_end() && !is(end) && !is("endmodule")) {
      if (progress_.cancelled()) return;
      if (is("error") || is("undo") || is("backward")) {
        if (!is(":=", 1) && !is(":", 1)) {
          handler(end);
          break;
        }
      }
      const At from = here();
      statement(from, [&] { one(); });
      if (here().begin == from.begin && !at_end()) next();
    }
    comments_until(here());
    close_blocks(here());
    if (!accept(end))
      fail(here(), "the routine " + std::string(name.raw.substr(0, 60)) + " has no " + end);
    close();
  }
  void handler(const std::string& end) {
    const At at = here();
    if (is("error")) learned_.flags.insert("handlers");
    while (!at_end() && !is(end)) next();
    emit("{ not read: the handler " + source_line(at) + " }", at);
    warn(
        at, "error handlers are not read",
        "Without an error the program does the same; where the controller would run the handler, a "
        "run stops.");
  }

  // ---- statements ----

  void semicolon() {
    if (accept(";")) return;
    bad(here(), "\";\" is expected here, not \"" + std::string(peek().raw.substr(0, 40)) + "\"");
    skip_rest();
    accept(";");
  }

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (accept(";")) return;
    if (is("var") || is("const") || is("pers")) return data(true);
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      accept(";");
      return;
    }
    if (is(":", 1) && t.low != "default") {
      next();
      next();
      place_label(t.raw, at);
      return;
    }
    word_ = t.low;
    static const std::map<std::string, void (RapidReader::*)(const At&), std::less<>> kBlocks{
        {"if", &RapidReader::if_},           {"elseif", &RapidReader::elseif},
        {"else", &RapidReader::else_},       {"endif", &RapidReader::end_},
        {"for", &RapidReader::for_},         {"endfor", &RapidReader::end_},
        {"while", &RapidReader::while_},     {"endwhile", &RapidReader::end_},
        {"test", &RapidReader::test},        {"case", &RapidReader::case_},
        {"default", &RapidReader::default_}, {"endtest", &RapidReader::end_}};
    if (const auto it = kBlocks.find(t.low); it != kBlocks.end()) {
      next();
      (this->*it->second)(at);
      return;
    }
    const bool is_assigned = is(":=", 1) || is("{", 1) || is(".", 1);
    static const std::map<std::string, void (RapidReader::*)(const At&), std::less<>> kWords{
        {"movej", &RapidReader::motion},
        {"movel", &RapidReader::motion},
        {"movec", &RapidReader::motion},
        {"moveabsj", &RapidReader::motion},
        {"moveldo", &RapidReader::motion},
        {"movejdo", &RapidReader::motion},
        {"movecdo", &RapidReader::motion},
        {"set", &RapidReader::set_},
        {"reset", &RapidReader::set_},
        {"setdo", &RapidReader::set_signal},
        {"setgo", &RapidReader::set_signal},
        {"setao", &RapidReader::set_signal},
        {"pulsedo", &RapidReader::pulse},
        {"waitdi", &RapidReader::wait_signal},
        {"waitdo", &RapidReader::wait_signal},
        {"waitgi", &RapidReader::wait_signal},
        {"waituntil", &RapidReader::wait_until},
        {"waittime", &RapidReader::wait_time},
        {"tpwrite", &RapidReader::tpwrite},
        {"errwrite", &RapidReader::tpwrite},
        {"stop", &RapidReader::stop},
        {"break", &RapidReader::stop},
        {"exit", &RapidReader::exit},
        {"exitcycle", &RapidReader::exit},
        {"return", &RapidReader::return_},
        {"goto", &RapidReader::goto_},
        {"incr", &RapidReader::count},
        {"decr", &RapidReader::count},
        {"add", &RapidReader::count},
        {"clear", &RapidReader::count},
        {"accset", &RapidReader::accset},
        {"connect", &RapidReader::connect},
        {"isignaldi", &RapidReader::isignal},
        {"isignaldo", &RapidReader::isignal},
        {"searchl", &RapidReader::motion},
        {"searchc", &RapidReader::no_counterpart},
        {"raise", &RapidReader::no_counterpart},
        {"velset", &RapidReader::velset},
        {"confj", &RapidReader::conf},
        {"confl", &RapidReader::conf},
        {"singarea", &RapidReader::singarea},
        {"pdispset", &RapidReader::pdisp},
        {"pdispoff", &RapidReader::pdisp},
        {"invertdo", &RapidReader::invert},
        {"waitrob", &RapidReader::waitrob},
        {"movejsync", &RapidReader::no_counterpart},
        {"movelsync", &RapidReader::no_counterpart}};
    if (const auto it = kWords.find(t.low); it != kWords.end() && !is_assigned && !find(t.low)) {
      next();
      (this->*it->second)(at);
      semicolon();
      return;
    }
    static const std::set<std::string, std::less<>> kNoEffect{
        "tperase", "clkreset",  "clkstart", "clkstop",   "gripload", "mechunitload", "tpshow",
        "softact", "softdeact", "actunit",  "deactunit", "isleep",   "iwatch",       "idelete"};
    static const std::set<std::string, std::less<>> kQuiet{"tperase", "gripload", "mechunitload",
                                                           "tpshow",  "actunit",  "softdeact"};
    if (kNoEffect.contains(t.low) && !is_assigned && !find(t.low)) {
      skip_rest();
      accept(";");
      left_out(kQuiet.contains(t.low) ? RMP_FAULT_WARNING : RMP_FAULT_ERROR, at,
               "IRL has no counterpart of " + std::string(t.raw));
      return;
    }
    if (is_assigned) {
      for (std::size_t i = 1; peek(i).kind != Tk::end && !is(":=", i) && !is(";", i); ++i)
        if (is("tload", i)) {
          skip_rest();
          accept(";");
          left_out(RMP_FAULT_WARNING, at, std::string("IRL has no loads of tools") + kOtherTimes);
          return;
        }
      will_write(t.low);
      const Ex to = primary();
      expect(":=");
      if (!to.ok) {
        skip_rest();
        accept(";");
        return;
      }
      if (to.type.k == K::target && is("crobt") && is_placed_anew(t.low)) {
        // Of where the robot is now only the configuration stays: the nearest one.
        skip_rest();
        emit(to.s + ".STATUS := -1;", at);
        emit(to.s + ".TURNS := [-128, -128, -128, -128, -128, -128];", at);
        learned_.turns = 6;
        semicolon();
        return;
      }
      const Aggregate a = aggregate();
      both_frames_ = 0;
      const Ex from = built(a, {}, to.type);
      keep_frames(to.s.substr(0, to.s.find_first_of(".[")), std::exchange(both_frames_, 0));
      assign(to, from, at);
      semicolon();
      return;
    }
    // A call; its values are behind blanks.
    next();
    std::vector<Ex> args;
    while (!at_end() && !is(";")) {
      if (accept("\\")) {
        const Token name = next();
        if (accept(":=")) (void)expression();
        bad(at, "IRL has no optional parameters, such as " + std::string(name.raw.substr(0, 40)));
        skip_rest();
        break;
      }
      args.push_back(argument(t.low, args.size()));
      if (!accept(",") && !is("\\")) break;
    }
    bool is_ok = true;
    for (const Ex& a : args) is_ok = is_ok && a.ok;
    if (is_ok) {
      if (has_main_ && t.low == "main") {
        bad(at, "the program calls itself");
      } else {
        const std::string text = call(t.raw, args, at);
        if (!text.empty()) emit(text + ";", at);
      }
    }
    semicolon();
  }
  /// A value of a call: one in brackets is of the type that the routine has there.
  Ex argument(const std::string& routine, std::size_t n) {
    const Symbol* s = find(routine);
    if (!is("[") || !s || s->kind != Symbol::routine || n >= s->parameters.size())
      return expression();
    const Type t = s->parameters[n].type;
    return built(aggregate(), {}, t);
  }
  /// CRobT(\Tool:=t \WObj:=w)
  Ex present_place(const std::map<std::string, Ex>& options, const At& at) {
    std::optional<Ex> tool, frame;
    for (const auto& [name, e] : options) {
      if (!e.ok) return failed();
      if (e.type.k != K::pose || (name != "tool" && name != "wobj"))
        return bad(at, "CRobT of another robot or task is not read");
      (name == "tool" ? tool : frame) = e;
    }
    if (!tool || !frame)
      return bad(at,
                 "CRobT without \\Tool or \\WObj is in those of the last motion, which differ from "
                 "motion to motion",
                 "Write CRobT(\\Tool:=... \\WObj:=...).");
    const Ex id = identity();
    if (is_set("displacement"))
      frame = binary(Op::compose, *frame, get("displacement", kPose, at), at);
    else if (frame->s == id.s) frame.reset();
    return present_target(tool, frame);
  }
  /// Behind t := CRobT(...): t.trans and t.rot get values in the next two statements.
  [[nodiscard]] bool is_placed_anew(const std::string& low) const {
    std::size_t k = 0;
    std::string parts;
    for (int n = 0; n < 3; ++n) {
      while (peek(k).kind != Tk::end && !is(";", k)) ++k;
      ++k;
      if (n < 2 && is(low, k) && is(".", k + 1) && is(":=", k + 3)) parts += peek(k + 2).low + " ";
    }
    return parts == "trans rot " || parts == "rot trans ";
  }
  /// A text of several parts; numbers that are made texts stay numbers, which WRITELN shows.
  std::string text_parts() {
    std::string list;
    do {
      Ex e;
      if ((is("valtostr") || is("numtostr")) && is("(", 1) && !find(peek().low)) {
        next();
        next();
        e = expression();
        while (!at_end() && !is(")") && !is(";")) next();  // digits behind the point
        expect(")");
      } else {
        e = expression(31);
      }
      if (!e.ok) return {};
      list += (list.empty() ? "" : ", ") + e.s;
    } while (accept("+"));
    return list;
  }
  void no_counterpart(const At& at) {
    skip_rest();
    bad(at, "IRL has no counterpart of this statement");
  }
  void if_(const At& at) {
    const std::string c = truth(at);
    if (accept("then")) {
      emit("IF " + c + " THEN", at);
      open_block("endif", "ENDIF");
      return;
    }
    // IF c statement;
    emit("IF " + c + " THEN", at);
    indented(1);
    if (++nested_ > 50) {
      skip_rest();
      bad(at, "this is nested too deeply");
    } else if (!at_end() && !is("endproc") && !is("endfunc")) {
      statement(here(), [&] { one(); });
    }
    --nested_;
    indented(-1);
    emit("ENDIF;", at);
  }
  void elseif(const At& at) {
    if (!is_in("endif")) {
      bad(at, "ELSEIF is outside IF");
      return;
    }
    const std::string c = truth(at);
    accept("then");
    between("ELSIF " + c + " THEN", at);
  }
  void else_(const At& at) {
    if (is_in("endif")) between("ELSE", at);
    else bad(at, "ELSE is outside IF");
  }
  void end_(const At& at) {
    const std::string word = word_;
    close_block(word, at, "\"" + word + "\" has no open block");
    if (word == "endfor" && !loops_.empty()) {
      current().symbols.erase(loops_.back());
      if (is_in_main()) globals_.erase("." + loops_.back());
      loops_.pop_back();
    }
    accept(";");
  }
  /// A number of FOR, which counts in whole numbers.
  Ex whole(const Ex& e, const At& at) {
    if (e.ok && e.is_literal && e.v != std::round(e.v))
      return bad(at, "IRL counts in whole numbers, not by " + e.s, "Use WHILE.");
    return as_integer(e, at);
  }
  void for_(const At& at) {
    const Token v = next();
    expect("from");
    const Ex from = whole(expression(), at);
    expect("to");
    const Ex to = whole(expression(), at);
    Ex step = integer(1);
    const bool has_step = accept("step");
    if (has_step) step = whole(expression(), at);
    if (!expect("do")) {
      while (!at_end() && !is("do") && !is(";")) next();
      accept("do");
    }
    // A variable of the loop's own.
    Symbol s;
    s.type = kInt;
    s.irl = irl_name(v.raw);
    (is_in_main() ? variables_ : current().locals).push_back({"INT: " + s.irl + ";", at, false});
    const std::string irl = s.irl;
    current().symbols.insert_or_assign(v.low, std::move(s));
    loops_.push_back(v.low);
    std::string by;
    bool is_down = false;
    if (step.is_literal && step.v != 0) {
      is_down = step.v < 0;
      if (std::fabs(step.v) != 1)
        by = " STEP " + integer(static_cast<std::int64_t>(std::fabs(step.v))).s;
    } else if (step.ok && !step.is_literal) {
      by = " STEP " + step.s;  // below zero it counts down
    } else if (step.ok) {
      bad(at, "the step of this loop is zero");
    }
    // RAPID counts down by itself where the end is below.
    if (!has_step && from.is_literal && to.is_literal) is_down = from.v > to.v;
    else if (!has_step && from.ok && to.ok)
      by = " STEP " + helper("counting") + "(" + from.s + ", " + to.s + ")";
    if (from.ok && to.ok)
      emit("FOR " + irl + " := " + from.s + (is_down ? " DOWNTO " : " TO ") + to.s + by + " DO",
           at);
    if (!from.ok || !to.ok) return open_unread_loop("endfor", at);
    open_block("endfor", "ENDFOR");
  }
  void while_(const At& at) {
    const std::string c = truth(at);
    accept("do");
    emit("WHILE " + c + " DO", at);
    open_block("endwhile", "ENDWHILE");
  }
  void test(const At& at) { open_case("endtest", at); }
  bool is_in_test(const At& at) {
    if (is_in("endtest")) return true;
    bad(at, "this is outside TEST");
    while (!at_end() && !is(":") && !is(";")) next();
    accept(":");
    return false;
  }
  void case_(const At& at) {
    if (!is_in_test(at)) return;
    std::vector<ArmValue> values;
    do {
      values.push_back({expression()});
    } while (accept(","));
    if (!expect(":")) {
      while (!at_end() && !is(":") && !is(";")) next();
      accept(":");
    }
    open_arm(values, at);
  }
  void default_(const At& at) {
    if (!is_in_test(at)) return;
    expect(":");
    open_default(at);
  }

  /// The tool or work object that stands here: a name, an element of an array, a component.
  Ex frame_here() {
    const Token t = peek();
    if ((t.low == "tool0" || t.low == "wobj0") && !find(t.low)) {
      next();
      return identity();
    }
    if (is("[")) return built(aggregate(), {}, kPose);
    if (t.kind != Tk::name) {
      if (!at_end() && !is(";")) next();
      return bad(t.at, "the name of a tool or work object is expected here");
    }
    if (!find(t.low)) {
      declare_variable(declare(t.raw, kPose), {}, t.at);
      fail(t.at, std::string(t.raw) + " is not declared; it is zero here",
           "Read its module together with this one, or give its value.");
    }
    const Ex e = primary();
    if (e.ok && e.type.k != K::pose)
      return bad(t.at, std::string(t.raw) + " is neither a tool nor a work object");
    return e;
  }
  void motion(const At& at) {
    const std::string word = word_;
    const bool is_joint = word.starts_with("movej") || word == "moveabsj";
    Motion m;
    m.word = is_joint ? "PTP" : word.starts_with("movel") ? "LIN" : "CIRCLE";
    const auto options = [&](std::map<std::string, Ex>& to) {
      while (is("\\") || (is(",") && is("\\", 1))) {
        accept(",");
        accept("\\");
        const Token name = next();
        if (!accept(":=")) {
          to[name.low] = boolean(true);
        } else if (name.low == "wobj" || name.low == "tool") {
          to[name.low] = frame_here();
        } else if (name.low == "tload" || name.low == "id") {
          next();  // loads and the numbers of motions of several robots
        } else if (name.low == "inpos") {
          next();
          to[name.low] = boolean(true);
        } else {
          to[name.low] = expression();
        }
        static const std::set<std::string, std::less<>> kKnown{
            "wobj", "tool", "tload",   "id",   "inpos", "conc",  "v",
            "t",    "z",    "noeoffs", "stop", "pstop", "sstop", "sup"};
        if (!kKnown.contains(name.low))
          bad(name.at, "\\" + std::string(name.raw.substr(0, 40)) + " of a motion is not read");
      }
    };
    std::map<std::string, Ex> given, here;
    bool is_free = false;
    if (is_joint && word != "moveabsj" && !has_free_configuration(is_free, at)) return skip_rest();
    options(given);  // \Conc
    if (given.contains("conc")) accept(",");
    if (word == "searchl" && !search(given, m, at)) return;
    const auto read_target = [&] {
      if (m.word != "CIRCLE" && is("offs") && is("(", 1) && is("crobt", 2)) {
        // So much from where it is.
        next();
        next();
        next();
        expect("(");
        accept(",");
        options(here);
        expect(")");
        std::vector<Ex> by;
        for (int k = 0; k < 3; ++k) {
          expect(",");
          by.push_back(as_real(expression(), at));
        }
        expect(")");
        m.is_incremental = true;
        return position(by);
      }
      const Aggregate a = aggregate();
      is_any_configuration_ = is_free;
      const Ex e = built(a, word == "moveabsj" ? "jointtarget" : "robtarget",
                         word == "moveabsj" ? kJoint : kTarget);
      is_any_configuration_ = false;
      options(given);
      return e;
    };
    m.targets.push_back(read_target());
    expect(",");
    if (m.word == "CIRCLE") {
      m.targets.push_back(read_target());
      expect(",");
    }
    want_ = "speeddata";
    const Aggregate speed_value = aggregate();
    const Ex speed = built(speed_value, "speeddata", kReal);
    want_.clear();
    options(given);
    expect(",");
    Ex zone = real(0);
    if (word != "searchl") {
      want_ = "zonedata";
      const Aggregate zone_value = aggregate();
      zone = built(zone_value, "zonedata", kReal);
      want_.clear();
      options(given);
      expect(",");
    }
    const Ex t = frame_here();
    options(given);
    Ex output = failed(), level = failed();
    if (word.ends_with("do")) {
      expect(",");
      const Token s = next();
      output = signal_of(s, true, kBool);
      expect(",");
      level = converted(expression(), kBool, at);
    }
    if (!speed.ok || !zone.ok || !t.ok) return;
    if (const auto it = given.find("t"); it != given.end()) {
      m.attributes.emplace_back("TIME", as_real(it->second, at));
    } else if (is_joint) {
      const double full = params_.real("tcp_speed") * 1000;
      Ex share = scaled(speed, 100 / full);
      if (share.is_literal && share.v > 100) share = real(100);
      if (share.is_literal && share.v <= 0) bad(at, "this is not a speed");
      m.attributes.emplace_back("SPEED_PTP", share);
    } else {
      const auto v = given.find("v");
      const Ex used = v != given.end() ? as_real(v->second, at) : speed;
      if (used.is_literal && used.v <= 0) bad(at, "this is not a speed");
      m.attributes.emplace_back("SPEED", used);
    }
    Ex z = zone;
    if (const auto it = given.find("z"); it != given.end()) z = as_real(it->second, at);
    if (given.contains("inpos")) z = real(0);  // data of a stop point
    is_stopped_ = z.is_literal && z.v == 0;
    if (!(z.is_literal && z.v == 0)) {
      if (is_joint) {
        if (!std::exchange(told_zone_, true))
          note(at, "zones of joint motions become C_PTP in %, 1 % per mm");
        if (z.is_literal && z.v > 100) z = real(100);
      }
      m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", z);
    }
    const Ex id = identity();
    if (m.is_incremental) {
      const auto given_or = [&](const std::map<std::string, Ex>& all, const char* name) {
        const auto it = all.find(name);
        return it == all.end() ? id.s : it->second.s;
      };
      if (given_or(here, "tool") != t.s || given_or(here, "wobj") != given_or(given, "wobj")) {
        bad(at, "CRobT uses a different tool or work object than the motion",
            "Use the same for both, so that it becomes MOVE_INC.");
        return;
      }
    }
    if (t.s != id.s) m.tool = t;
    if (const auto it = given.find("wobj"); it != given.end() && word != "moveabsj") {
      if (!it->second.ok) return;
      if (it->second.s != id.s) m.frame = it->second;
    }
    if (is_set("displacement") && word != "moveabsj" && !m.is_incremental) {
      // PDispSet moves places within their work object.
      const Ex by = get("displacement", kPose, at);
      m.frame = m.frame ? binary(Op::compose, *m.frame, by, at) : by;
    }
    if (given.contains("conc"))
      bad(at, "\\Conc has no counterpart in IRL: the next statement waits for the motion",
          "Take \\Conc out.");
    if (is_free)
      for (Ex& e : m.targets) e = without_configuration(e);
    move(std::move(m), at);
    if (output.ok && level.ok) emit(output.s + " := " + level.s + ";", at);
  }
  /// Behind ConfJ\Off a joint motion takes the nearest configuration. False = it was reported.
  bool has_free_configuration(bool& is_free, const At& at) {
    const std::string how = mode("conf_j", "on", at);
    is_free = how == "off";
    if (!how.empty()) return true;
    bad(at, "ConfJ is On on one path to this motion and Off on another");
    return false;
  }
  Ex without_configuration(const Ex& e) {
    if (!e.ok || e.type.k != K::target) return e;
    if (e.s.starts_with("ROBTARGET(") && e.s.find("), -1, [-128") != std::string::npos) return e;
    if (learned_.external_axes == 0) return value(within(e, kPrimary) + ".PSE", kPose);
    return value(helper("any_configuration_target") + "(" + e.s + ")", kTarget);
  }
  void conf(const At& at) {
    std::string how = "on";
    while (accept("\\")) how = next().low;
    // A motion along a path keeps the configuration that it comes with anyway.
    if (word_ == "confl") return note_line(at, "IRL keeps the configuration along a path");
    learned_.modal["conf_j"];
    set_mode("conf_j", how, at);
    emit("{ " + source_line(at) + " }", at);
  }
  void singarea(const At& at) {
    std::string how;
    while (accept("\\")) how = next().low;
    if (how == "off") return note_line(at, "it is IRL's default");
    skip_rest();
    left_out(RMP_FAULT_ERROR, at, "IRL keeps the orientation near a singularity",
             "IRL moves as with SingArea\\Off.");
  }
  void velset(const At& at) {
    const Ex percent = as_real(expression(), at);
    expect(",");
    const Ex most = as_real(expression(), at);
    if (!percent.ok || !most.ok) return;
    if (percent.is_literal && percent.v == 100 && most.is_literal && most.v >= 5000)
      return note_line(at, "it is IRL's default");
    left_out(RMP_FAULT_ERROR, at, "IRL has no override of all later speeds",
             "Multiply the speeds of the motions by it.");
  }
  void pdisp(const At& at) {
    if (word_ == "pdispoff") {
      if (is_set("displacement")) set("displacement", identity(), at);
      else note_line(at, "no displacement is set");
      return;
    }
    const Aggregate a = aggregate();
    const Ex e = built(a, "pose", kPose);
    if (e.ok) set("displacement", e, at);
  }
  void invert(const At& at) {
    const Ex s = signal_of(next(), true, kBool);
    if (s.ok) emit(s.s + " := NOT " + s.s + ";", at);
  }
  /// In IRL a wait comes behind the motion before it, so that one for its end is no other.
  void waitrob(const At& at) {
    skip_rest();
    if (is_stopped_) note_line(at, "the previous motion has stopped");
    else emit("WAIT 0.0 SEC;", at);
  }
  /// SearchL\SStop, signal, place, ...: a straight motion that a signal ends.
  bool search(const std::map<std::string, Ex>& given, Motion& m, const At& at) {
    m.word = "LIN";
    if (!given.contains("stop") && !given.contains("pstop") && !given.contains("sstop")) {
      bad(at, "a search that continues after its signal has no counterpart in IRL",
          "Give it \\Stop, \\PStop or \\SStop.");
      skip_rest();
      return false;
    }
    expect(",");
    const Token name = next();
    bool is_low = false;
    while (accept("\\")) {
      const Token level = next();
      is_low = level.low == "lowlevel";
      if (!is_low && level.low != "highlevel") {
        bad(level.at, "a search for a signal edge has no counterpart in IRL",
            "IRL tests a level: use \\HighLevel or \\LowLevel.");
        skip_rest();
        return false;
      }
    }
    const Ex s = signal_of(name, false, kBool);
    expect(",");
    const Token found = next();
    expect(",");
    if (!s.ok || found.kind != Tk::name) return false;
    m.until = is_low ? "NOT " + s.s : s.s;
    if (is_looked_at(found.low))
      bad(at, "the position at the signal is not stored in " + std::string(found.raw.substr(0, 40)),
          "IRL has no robot position at run time.");
    else warn(at, "a missing signal is not an error in IRL; the motion continues to its target");
    return true;
  }
  /// Whether a name of this text is more than declared and given to searches.
  bool is_looked_at(const std::string& low) {
    if (looked_at_of_ != tokens_.data()) {
      looked_at_of_ = tokens_.data();
      looked_at_.clear();
      bool is_known = false;  // behind VAR, PERS and SearchL of a statement
      for (const Token& t : tokens_)
        if (t.low == ";") is_known = false;
        else if (t.low == "searchl" || t.low == "var" || t.low == "pers") is_known = true;
        else if (t.kind == Tk::name && !is_known) looked_at_.insert(t.low);
    }
    return looked_at_.contains(low);
  }
  Ex signal_of(const Token& t, bool is_output, const Type& type) {
    if (t.kind != Tk::name) return bad(t.at, "the name of a signal is expected here");
    if (const Symbol* s = find(t.low); s && s->kind != Symbol::input && s->kind != Symbol::output)
      return bad(t.at, std::string(t.raw) + " is no signal");
    learned_.flags.insert((is_output ? "output " : "input ") + t.low);
    if (type.k == K::real) learned_.flags.insert("analogue " + t.low);
    else if (type.k != K::boolean) learned_.flags.insert("group " + t.low);
    const Type& of = learned_.flags.contains("analogue " + t.low) ? kReal
                     : learned_.flags.contains("group " + t.low)  ? kInt
                                                                  : kBool;
    const bool is_out = learned_.flags.contains("output " + t.low);
    const Symbol& s = named_signal(t.raw, is_out, of, t.at);
    Ex e = place(s.irl, s.type);
    e.is_place = is_out;
    return e;
  }
  void set_(const At& at) {
    const bool on = word_ == "set";
    const Ex s = signal_of(next(), true, kBool);
    if (s.ok) assign(s, integer(on), at);
  }
  void set_signal(const At& at) {
    const Type& type = word_ == "setdo" ? kBool : word_ == "setgo" ? kInt : kReal;
    while (accept("\\")) {
      const Token option = next();
      if (accept(":=")) (void)expression();
      bad(option.at, "IRL sets signals immediately", "Split the statement.");
    }
    const Ex s = signal_of(next(), true, type);
    expect(",");
    const Token v = peek();
    Ex e;
    if (v.low == "high" || v.low == "low") {
      next();
      e = integer(v.low == "high");
    } else {
      e = expression();
    }
    if (s.ok && e.ok) assign(s, e, at);
  }
  void pulse(const At& at) {
    Ex time = real(0.2);
    bool is_high = false;
    while (accept("\\")) {
      const Token option = next();
      if (accept(":=")) {
        const Ex e = as_real(expression(), at);
        if (option.low == "plength") time = e;
      } else if (option.low == "high") {
        is_high = true;
      } else {
        bad(option.at, "this option is not known");
      }
      accept(",");
    }
    const Ex s = signal_of(next(), true, kBool);
    if (!s.ok || !time.ok) return;
    pulse_of(s, is_high ? "TRUE" : "NOT " + s.s, is_high ? "FALSE" : "NOT " + s.s, time, at);
  }
  void wait_for(const Ex& c, const At& at) {
    std::string timeout;
    while (accept("\\")) {
      const Token option = next();
      if (!accept(":=")) continue;
      if (option.low == "maxtime") {
        const Ex t = as_real(expression(), at);
        if (t.ok) timeout = " TIMEOUT " + within(t, kSum);
      } else if (option.low == "timeflag") {
        const Token flag = next();
        after_.push_back(flag);
      } else {
        (void)expression();
        if (option.low != "pollrate") bad(option.at, "this option is not known");
      }
    }
    if (!c.ok) return;
    emit("WAIT FOR " + c.s + timeout + ";", at);
    // Without a flag the controller raises an error.
    if (!timeout.empty() && after_.empty()) {
      if (learned_.flags.contains("handlers"))
        bad(at, "IRL has neither the error raised after the time nor its handler",
            "Use \\TimeFlag, and test it.");
      else emit("IF R_TIMEOUT THEN HALT; ENDIF;", at);
    }
    // A flag that is declared and set only tells nobody anything.
    for (const Token& flag : after_)
      if (const Symbol* s = find(flag.low); s && uses(flag.low) > 2)
        emit(s->irl + " := R_TIMEOUT;", at);
    after_.clear();
  }
  void wait_signal(const At& at) {
    const bool is_out = word_ == "waitdo", is_group = word_ == "waitgi";
    const Ex s = signal_of(next(), is_out, is_group ? kInt : kBool);
    expect(",");
    Ex v;
    if (is("high") || is("low")) v = integer(next().low == "high");
    else v = expression();
    wait_for(s.ok && v.ok ? binary(Op::eq, s, v, at) : failed(), at);
  }
  void wait_until(const At& at) {
    while (accept("\\")) {
      next();  // \InPos: a wait comes behind the motion anyway
      accept(",");
    }
    const Ex c = converted(expression(), kBool, at);
    wait_for(c, at);
  }
  void wait_time(const At& at) {
    if (accept("\\")) {
      next();  // \InPos: a wait comes behind the motion anyway
      accept(",");
    }
    const Ex t = as_real(expression(), at);
    if (t.is_literal && t.v < 0) {
      bad(at, "a time must not be negative");
      return;
    }
    if (t.ok) emit("WAIT " + within(t, kSum) + " SEC;", at);
  }
  void tpwrite(const At& at) {
    std::string list;
    bool ok = true;
    while (!at_end() && !is(";")) {
      if (accept("\\")) {
        next();
        if (!accept(":=")) continue;
      }
      const std::string part = text_parts();
      ok = ok && !part.empty();
      list += (list.empty() ? "" : ", ") + part;
      if (!accept(",") && !is("\\")) break;
    }
    if (ok) emit("WRITELN(" + list + ");", at);
  }
  void stop(const At& at) {
    skip_rest();
    emit("PAUSE;", at);
  }
  void exit(const At& at) {
    if (word_ == "exitcycle") warn(at, "EXITCYCLE is read as the end of the program");
    emit("HALT;", at);
  }
  void return_(const At& at) {
    if (is(";")) {
      emit("RETURN;", at);
      return;
    }
    if (is_in_main() || current().result.k == K::none) {
      bad(at, "RETURN has a value, and this is no function");
      skip_rest();
      return;
    }
    const Aggregate a = aggregate();
    const Ex e = built(a, result_name_, current().result);
    if (e.ok) emit("RETURN " + e.s + ";", at);
  }
  void goto_(const At& at) {
    const Token t = next();
    if (has_label(t.low, false)) emit("GOTO " + label(t.raw) + ";", at);
    else bad(at, "the label does not exist");
  }
  void count(const At& at) {
    const std::string word = word_;
    const Token name = peek();
    will_write(name.low);
    const Ex to = primary();
    Ex by = integer(1);
    if (word == "add" && expect(",")) by = expression();
    if (!to.ok || !by.ok) return;
    if (word == "clear") assign(to, integer(0), at);
    else assign(to, binary(word == "decr" ? Op::sub : Op::add, to, by, at), at);
  }
  void accset(const At& at) {
    const Ex a = as_real(expression(), at);
    bool has_ramp = false;
    while (accept(",")) {
      const Ex ramp = expression();
      has_ramp = has_ramp || !ramp.is_literal || ramp.v != 100;
    }
    while (accept("\\")) {
      next();
      if (accept(":=")) (void)expression();
    }
    if (!a.ok) return;
    if (a.is_literal && (a.v <= 0 || a.v > 100)) {
      bad(at, "the acceleration must be a percentage");
      return;
    }
    emit("R_ACC := " + a.s + ";", at);
    emit("R_ACC_PTP := " + a.s + ";", at);
    if (has_ramp) warn(at, std::string("IRL has no acceleration ramps") + kOtherTimes);
  }
  void connect(const At& at) {
    const Token i = next();
    expect("with");
    const Token trap = next();
    const Symbol* s = find(trap.low);
    if (!s || s->kind != Symbol::routine) {
      bad(at, "the trap does not exist");
      return;
    }
    traps_[i.low] = trap.low;
    emit("{ " + source_line(at) + " }", at);
  }
  void isignal(const At& at) {
    const bool is_out = word_ == "isignaldo";
    while (accept("\\")) {
      const Token option = next();
      if (option.low != "singlesafe" && option.low != "single") accept(",");
      else {
        bad(option.at, "IRL has no one-time interrupts", "Switch it off in its trap.");
        accept(",");
      }
    }
    const Ex s = signal_of(next(), is_out, kBool);
    expect(",");
    const Ex v = expression();
    expect(",");
    const Token i = next();
    const auto it = traps_.find(i.low);
    if (!s.ok || !v.ok) return;
    if (it == traps_.end()) {
      bad(at, "no CONNECT before this assigns a trap to the interrupt");
      return;
    }
    const std::string key = "!interrupt " + i.low;
    if (!globals_.contains(key)) {
      Symbol x;
      x.kind = Symbol::data;
      x.irl = irl_name(i.raw);
      const std::string irl = x.irl;
      globals_.emplace(key, std::move(x));
      const std::string text = call(it->second, {}, at);
      const Ex c = binary(Op::eq, s, v, at);
      Routine& before = current();
      const bool was_main = is_in_main();
      Routine& r = open("INTERRUPT " + irl + " WHEN " + c.s, "ENDINTERRUPT", at);
      r.body.push_back({"  " + text + ";", at, true});
      if (was_main) close();
      else set_current(before);
    }
    emit("ENABLE " + globals_[key].irl + ";", at);
  }

  // ---- values ----

  Aggregate aggregate(int depth = 0) {
    Aggregate a;
    a.at = here();
    if (is("[") && depth < 20) {
      next();
      a.is_list = true;
      if (accept("]")) return a;
      do {
        a.items.push_back(aggregate(depth + 1));
      } while (accept(",") && a.items.size() < 100000);
      expect("]");
      return a;
    }
    a.e = expression();
    return a;
  }
  static std::string shape(const Aggregate& a) {
    if (!a.is_list) return ".";
    std::string s;
    for (const Aggregate& i : a.items) s += i.is_list ? std::to_string(i.items.size()) : ".";
    return s;
  }
  std::vector<Ex> numbers(const Aggregate& a, std::size_t count) {
    std::vector<Ex> out;
    if (!a.is_list || a.items.size() != count) {
      bad(a.at, std::to_string(count) + " numbers in brackets are expected here");
    }
    for (std::size_t i = 0; i < count; ++i)
      out.push_back(i < a.items.size() && !a.items[i].is_list ? as_real(a.items[i].e, a.at)
                                                              : real(0));
    return out;
  }
  std::vector<Ex> external(const Aggregate& a) {
    std::vector<Ex> out = numbers(a, 6);
    // 9E9 is an axis that is missing.
    while (!out.empty() && out.back().is_literal && (out.back().v > 8.9e9)) out.pop_back();
    for (Ex& e : out)
      if (e.is_literal && e.v > 8.9e9) e = real(0);
    return out;
  }
  Ex quaternion(const Aggregate& a) {
    if (!a.is_list) return converted(a.e, kOrientation, a.at);
    return orientation("ORIQUAT", numbers(a, 4));
  }
  Ex point(const Aggregate& a) {
    if (!a.is_list) return converted(a.e, kPosition, a.at);
    return position(numbers(a, 3));
  }
  Ex frame(const Aggregate& a) {
    if (!a.is_list) return as_pose(a.e, a.at);
    if (a.items.size() != 2) return bad(a.at, "a pose must have a position and an orientation");
    const Ex p = point(a.items[0]), o = quaternion(a.items[1]);
    Ex e = value("POSE(" + p.s + ", " + o.s + ")", kPose);
    e.ok = p.ok && o.ok;
    e.is_constant = p.is_constant && o.is_constant;
    return e;
  }
  /// A value of a type of RAPID (`name`, may be empty) that is `t` in IRL.
  Ex built(const Aggregate& a, const std::string& name, const Type& t) {
    if (!a.is_list) return converted(a.e, t, a.at);
    if (t.k == K::array) {
      std::string list;
      bool ok = true, is_constant = true;
      Type inner = *t.element;
      if (t.bounds.size() > 1) inner = array_of(*t.element, {t.bounds.begin() + 1, t.bounds.end()});
      for (const Aggregate& i : a.items) {
        if (t.bounds.size() > 1 && !i.is_list) return bad(i.at, "a list is expected here");
        const Ex e = built(i, name, inner);
        ok = ok && e.ok;
        is_constant = is_constant && e.is_constant;
        list += (list.empty() ? "" : ", ") + e.s;
      }
      if (t.bounds[0].second != static_cast<std::int64_t>(a.items.size()))
        return bad(a.at, std::to_string(t.bounds[0].second) + " values are expected here");
      Ex e = value("[" + list + "]", t);
      e.ok = ok;
      e.is_constant = is_constant;
      return e;
    }
    switch (t.k) {
      case K::position: return point(a);
      case K::orientation: return quaternion(a);
      case K::pose: {
        if (name == "tooldata" || (name.empty() && shape(a).size() == 3)) {
          if (a.items.size() != 3) return bad(a.at, "a tool must have three parts");
          if (a.items[0].e.s == "FALSE") bad(a.at, "IRL has no stationary tools");
          return frame(a.items[1]);
        }
        if (name == "wobjdata" || (name.empty() && shape(a).size() == 5)) {
          if (a.items.size() != 5) return bad(a.at, "a work object must have five parts");
          if (a.items[0].e.s == "TRUE") bad(a.at, "IRL has no work objects held by the robot");
          if (a.items[1].e.s == "FALSE")
            bad(a.at, "IRL has no work objects moved by another mechanical unit");
          const Ex u = frame(a.items[3]), o = frame(a.items[4]);
          if (!u.ok || !o.ok) return failed();
          const auto is_zero = [](const Ex& e) {
            return e.s == "POSE(POSITION(0.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0))";
          };
          // Which of both an assignment to uframe or oframe may change alone.
          both_frames_ = (is_zero(u) ? 0 : 1) | (is_zero(o) ? 0 : 2);
          if (is_zero(o)) return u;
          if (is_zero(u)) return o;
          return binary(Op::compose, u, o, a.at);
        }
        return frame(a);
      }
      case K::target: {
        if (a.items.size() != 4) return bad(a.at, "a robtarget must have four parts");
        const Ex p = point(a.items[0]), o = quaternion(a.items[1]);
        Ex f = value("POSE(" + p.s + ", " + o.s + ")", kPose);
        f.ok = p.ok && o.ok;
        f.is_constant = p.is_constant && o.is_constant;
        if (is_any_configuration_ && a.is_list) {
          const std::vector<Ex> more = external(a.items[3]);
          if (more.empty() && learned_.external_axes == 0) return f;
          return target(f, integer(-1), std::vector<Ex>(6, integer(-128)), more);
        }
        const std::vector<Ex> cf = numbers(a.items[2], 4);
        // Axes 2, 3 and 5 are not told: whichever turn is nearest.
        std::vector<Ex> turns(6, integer(-128));
        for (const std::size_t k : {0U, 3U, 5U}) turns[k] = integer(0);
        for (const auto& [from, to] : {std::pair{0, 0}, std::pair{1, 3}, std::pair{2, 5}}) {
          const Ex& c = cf[static_cast<std::size_t>(from)];
          if (c.is_literal && std::fabs(c.v) < 1000)
            turns[static_cast<std::size_t>(to)] =
                integer(static_cast<std::int64_t>(std::floor(c.v / 4)));
          else if (c.ok) return bad(a.at, "the configuration of this target is unknown");
        }
        std::int64_t status = 0;
        if (cf[3].is_literal && cf[3].v >= 0 && cf[3].v <= 7) {
          const auto x = static_cast<std::int64_t>(cf[3].v);
          // 4 behind axis 1, 2 behind the lower arm (axis 3), 1 axis 5 is negative.
          status = ((x >> 2) & 1) | (((x & 2) != 0) != ((x & 4) != 0) ? 2 : 0) | ((x & 1) << 2);
        } else if (cf[3].ok) {
          warn(a.at,
               "the configuration " + cf[3].s + " is unknown; arm in front, elbow up is assumed");
          status = 0;
        }
        return target(f, integer(status), turns, external(a.items[3]));
      }
      case K::joint: {
        if (a.items.size() != 2) return bad(a.at, "a jointtarget must have two parts");
        return joints(numbers(a.items[0], 6), external(a.items[1]));
      }
      case K::real: {
        // Of an assignment the number of parts tells which it is.
        const auto is_of = [&](const char* type, std::size_t parts) {
          return name == type || want_ == type ||
                 (name.empty() && want_.empty() && a.items.size() == parts);
        };
        if (is_of("speeddata", 4)) return as_real(a.items.empty() ? failed() : a.items[0].e, a.at);
        if (is_of("zonedata", 7)) {
          if (a.items.size() < 2) return bad(a.at, "a zone must have seven parts");
          return a.items[0].e.s == "TRUE" ? real(0) : as_real(a.items[1].e, a.at);
        }
        return bad(a.at, "a number is expected here");
      }
      case K::record: {
        const auto& fields = records_[t.record];
        if (fields.size() != a.items.size())
          return bad(a.at, "this record has " + std::to_string(fields.size()) + " components");
        std::string list;
        bool ok = true;
        for (std::size_t i = 0; i < fields.size(); ++i) {
          const Ex e = built(a.items[i], {}, fields[i].second);
          ok = ok && e.ok;
          list += (i ? ", " : "") + e.s;
        }
        Ex e = value(t.record + "(" + list + ")", t);
        e.ok = ok;
        return e;
      }
      default: return bad(a.at, "brackets do not contain a value of this type");
    }
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      return e;
    }
    if (is("[")) {
      const Aggregate a = aggregate();
      const std::string s = shape(a);
      if (s == "3446") return built(a, "robtarget", kTarget);
      if (s == "66") return built(a, "jointtarget", kJoint);
      if (s == "34") return frame(a);
      if (s == "...") return point(a);
      if (s == "....") return quaternion(a);
      return bad(at, "the type of this value is unknown");
    }
    if (t.kind != Tk::name) {
      if (!at_end() && !is(";")) next();
      return bad(at, "a value is expected here");
    }
    next();
    if (t.low == "true" || t.low == "false") return boolean(t.low == "true");
    if (is("(") && !(find(t.low) && find(t.low)->kind != Symbol::routine)) return function(t);
    const Symbol* s = find(t.low);
    if (!s) {
      if (t.low.size() >= 2 && (t.low[0] == 'v' || t.low[0] == 'z')) {
        double n = 0;
        bool is_all = true;
        for (std::size_t i = 1; i < t.low.size(); ++i) {
          is_all = is_all && t.low[i] >= '0' && t.low[i] <= '9' && t.low.size() < 6;
          n = n * 10 + (t.low[i] - '0');
        }
        if (is_all) return t.low == "z0" ? real(0.3) : real(n);
      }
      if (t.low == "vmax") return real(5000);
      if (t.low == "fine") return real(0);
      if (t.low == "pi") return real(3.141592653589793);
      if (t.low == "tool0" || t.low == "wobj0") return identity();
      if (t.low == "high" || t.low == "low") return integer(t.low == "high");
      if (t.low == "edge") return integer(1);
      static const std::set<std::string, std::less<>> kSignals{"di", "do", "gi", "go"};
      if (learned_.flags.contains("output " + t.low) || learned_.flags.contains("input " + t.low) ||
          kSignals.contains(t.low.substr(0, 2))) {
        if (t.low.starts_with("do") || t.low.starts_with("go"))
          return signal_of(t, true, t.low[0] == 'g' ? kInt : kBool);
        return signal_of(t, learned_.flags.contains("output " + t.low),
                         t.low.starts_with("gi") ? kInt : kBool);
      }
      return bad(at,
                 std::string(t.raw.substr(0, 60)) + " is not declared" +
                     (unread_.contains(t.low) ? " that IRL has" : ""),
                 "Read its module together with this one.");
    }
    if (s->kind == Symbol::routine || s->kind == Symbol::data)
      return bad(at, std::string(t.raw) + " is not a value");
    Ex e = place(s->irl, s->type);
    e.is_place = s->kind == Symbol::variable || s->kind == Symbol::output;
    e.is_constant = s->kind == Symbol::constant;
    return suffixes(std::move(e));
  }
  Ex suffixes(Ex e) {
    for (;;) {
      if (is("{")) {
        const At at = next().at;
        std::string list;
        std::size_t n = 0;
        std::vector<Ex> known;
        do {
          const Ex i = as_integer(expression(), at);
          if (!i.ok) return failed();
          known.push_back(i);
          list += (n++ ? ", " : "") + i.s;
        } while (accept(","));
        expect("}");
        if (e.type.k != K::array || e.type.bounds.size() != n)
          return bad(at, "this is not an array of " + std::to_string(n) + " indices");
        for (std::size_t k = 0; k < n; ++k)
          if (known[k].is_literal && (known[k].v < static_cast<double>(e.type.bounds[k].first) ||
                                      known[k].v > static_cast<double>(e.type.bounds[k].second)))
            return bad(at, "the index " + known[k].s + " is outside the array");
        const Type element = *e.type.element;
        const bool is_place = e.is_place;
        e = place(e.s + "[" + list + "]", element);
        e.is_place = is_place;
        continue;
      }
      if (is(".") && peek(1).kind == Tk::name) {
        next();
        const Token f = next();
        const bool is_place = e.is_place;
        e = component(e, f);
        e.is_place = e.is_place && is_place;
        if (!e.ok) return e;
        continue;
      }
      return e;
    }
  }
  Ex component(const Ex& e, const Token& f) {
    const std::string& n = f.low;
    switch (e.type.k) {
      case K::record:
        for (const auto& [name, type] : records_[e.type.record])
          if (name == n) return place(e.s + ".f_" + name, type);
        break;
      case K::target:
        if (n == "trans") return place(e.s + ".PSE.POS", kPosition);
        if (n == "rot") return place(e.s + ".PSE.ORI", kOrientation);
        if (n == "extax" && accept(".")) {
          const Token a = next();
          if (a.low.size() == 5 && a.low.starts_with("eax_") && a.low[4] >= 'a' &&
              a.low[4] <= 'f') {
            learned_.external_axes = std::max(learned_.external_axes, a.low[4] - 'a' + 1);
            return place(e.s + ".A_JOINT.AA" + std::to_string(a.low[4] - 'a' + 1), kReal);
          }
        }
        break;
      case K::joint:
        if (n == "robax" && accept(".")) {
          const Token a = next();
          if (a.low.size() == 5 && a.low.starts_with("rax_") && a.low[4] >= '1' && a.low[4] <= '6')
            return place(e.s + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") + a.low.substr(4),
                         kReal);
        }
        if (n == "extax" && accept(".")) {
          const Token a = next();
          if (a.low.size() == 5 && a.low.starts_with("eax_") && a.low[4] >= 'a' &&
              a.low[4] <= 'f') {
            learned_.external_axes = std::max(learned_.external_axes, a.low[4] - 'a' + 1);
            return place(e.s + ".A_JOINT.AA" + std::to_string(a.low[4] - 'a' + 1), kReal);
          }
        }
        break;
      case K::pose:
        if (n == "trans") return place(e.s + ".POS", kPosition);
        if (n == "rot") return place(e.s + ".ORI", kOrientation);
        if (n == "tframe") return e;
        if (n == "uframe" || n == "oframe") {
          const std::string name = e.s.substr(0, e.s.find_first_of(".["));
          const bool is_user = n == "uframe";
          learned_.flags.insert((is_user ? "uframe " : "oframe ") + name);
          if (learned_.flags.contains((is_user ? "oframe " : "uframe ") + name))
            return bad(
                f.at, "IRL has one frame for user and object frame, but this work object has both");
          return e;
        }
        break;
      case K::position:
        if (n == "x" || n == "y" || n == "z")
          return place(e.s + "." + std::string(1, static_cast<char>(n[0] - 32)), kReal);
        break;
      case K::orientation:
        if (n.size() == 2 && n[0] == 'q' && n[1] >= '1' && n[1] <= '4')
          return place(e.s + ".Q" + n.substr(1), kReal);
        break;
      case K::real:
        if (n == "v_tcp" || n == "pzone_tcp") return e;
        break;
      default: break;
    }
    return bad(f.at, "there is no component " + std::string(f.raw.substr(0, 40)) + " here");
  }
  Ex function(const Token& t) {
    const At at = t.at;
    next();
    static const std::map<std::string, std::pair<bool, bool>, std::less<>> kSignals{
        {"dinput", {false, false}},
        {"testdi", {false, false}},
        {"ginput", {false, true}},
        {"doutput", {true, false}},
        {"goutput", {true, true}}};
    if (const auto it = kSignals.find(t.low);
        it != kSignals.end() && !find(t.low) && peek().kind == Tk::name && is(")", 1)) {
      const Ex e = signal_of(next(), it->second.first, it->second.second ? kInt : kBool);
      expect(")");
      return e;
    }
    std::vector<Ex> a;
    std::map<std::string, Ex> options;
    while (!at_end() && !is(")") && !is(";")) {
      if (accept("\\")) {
        const Token name = next();
        options[name.low] = accept(":=") ? expression() : boolean(true);
        accept(",");
        continue;
      }
      a.push_back(argument(t.low, a.size()));
      if (!accept(",") && !is("\\")) break;
    }
    expect(")");
    for (const Ex& e : a)
      if (!e.ok) return failed();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},   {"cos", "COS"},     {"tan", "TAN"},   {"asin", "ASIN"}, {"acos", "ACOS"},
        {"atan", "ATAN"}, {"atan2", "ATAN2"}, {"sqrt", "SQRT"}, {"abs", "ABS"},   {"exp", "EXP"}};
    if (!find(t.low)) {
      if (const auto it = kMath.find(t.low); it != kMath.end()) return math(it->second, a, at);
      if ((t.low == "round" || t.low == "trunc") && a.size() == 1 && options.empty())
        return math(t.low == "round" ? "ROUND" : "TRUNC", a, at);
      if ((t.low == "round" || t.low == "trunc") && a.size() == 1 && options.contains("dec") &&
          options["dec"].is_literal && options["dec"].v >= 0 && options["dec"].v < 9) {
        const double k = std::pow(10.0, options["dec"].v);
        return scaled(math(t.low == "round" ? "ROUND" : "TRUNC", {scaled(a[0], k)}, at), 1 / k);
      }
      if (t.low == "pow" && a.size() == 2) return binary(Op::power, a[0], a[1], at);
      if (t.low == "offs" && a.size() == 4) return offset(a[0], a[1], a[2], a[3], at);
      if (t.low == "reltool" && a.size() == 4) {
        const auto angle = [&](const char* n) {
          return options.contains(n) ? options[n] : real(0);
        };
        const Ex by = pose({a[1], a[2], a[3]},
                           orientation("ORIXYZ", {angle("rx"), angle("ry"), angle("rz")}));
        return with_pose(a[0], binary(Op::compose, as_pose(a[0], at), by, at));
      }
      if (t.low == "posemult" && a.size() == 2) return binary(Op::compose, a[0], a[1], at);
      if (t.low == "posevect" && a.size() == 2) return binary(Op::compose, a[0], a[1], at);
      if (t.low == "poseinv" && a.size() == 1)
        return value("INV(" + as_pose(a[0], at).s + ")", kPose);
      if (t.low == "orientzyx" && a.size() == 3) return orientation("ORIZYX", a);
      if (t.low == "norient" && a.size() == 1) return a[0];
      if (t.low == "eulerzyx" && a.size() == 1 && a[0].type.k == K::orientation)
        for (const char* n : {"x", "y", "z"})
          if (options.contains(n))
            return value(
                std::string("ANGLE") + static_cast<char>(*n - 32) + "('ZYX', " + a[0].s + ")",
                kReal);
      if (t.low == "distance" && a.size() == 2 && a[0].type.k == K::position &&
          a[1].type.k == K::position)
        return value(helper("distance") + "(" + a[0].s + ", " + a[1].s + ")", kReal);
      if (t.low == "vectmagn" && a.size() == 1 && a[0].type.k == K::position)
        return value("SQRT(DOT(" + a[0].s + ", " + a[0].s + "))", kReal);
      if (t.low == "dotprod" && a.size() == 2 && a[0].type.k == K::position &&
          a[1].type.k == K::position)
        return value("DOT(" + a[0].s + ", " + a[1].s + ")", kReal);
      if (kSignals.contains(t.low) && a.size() == 1) return a[0];
      if (t.low == "strlen" && a.size() == 1 && a[0].type.k == K::string)
        return value("LENGTH(" + a[0].s + ")", kInt);
      if (t.low == "strpart" && a.size() == 3 && a[0].type.k == K::string)
        return value("EXTRACT(" + a[0].s + ", " + as_integer(a[1], at).s + ", " +
                         as_integer(a[2], at).s + ")",
                     kString);
      if (t.low == "dim" && a.size() == 2 && a[0].type.k == K::array && a[1].is_literal &&
          a[1].v >= 1 && a[1].v <= static_cast<double>(a[0].type.bounds.size()))
        return integer(a[0].type.bounds[static_cast<std::size_t>(a[1].v) - 1].second);
      if (t.low == "present") return boolean(false);
      if (t.low == "cjointt" && a.empty() && options.empty()) return present_joints();
      if (t.low == "crobt" && a.empty()) return present_place(options, at);
      static const std::set<std::string, std::less<>> kNone{
          "crobt",   "cjointt",      "cpos",       "cspeedoverride", "valtostr", "numtostr",
          "clkread", "calcrobt",     "calcjointt", "ctime",          "cdate",    "opmode",
          "robos",   "uimessagebox", "uinumentry", "aoutput",        "ainput"};
      if (kNone.contains(t.low)) return bad(at, "IRL has no counterpart of " + std::string(t.raw));
    }
    if (!options.empty()) return bad(at, "IRL has no optional parameters");
    const Symbol* s = find(t.low);
    if (s && s->kind == Symbol::routine && s->type.k == K::none && !learned_.stubs.contains(t.low))
      return bad(at, std::string(t.raw) + " returns no value");
    const Type result = s && s->type.k != K::none ? s->type : kReal;
    const std::string text = call(t.raw, a, at, result);
    if (text.empty()) return failed();
    return suffixes(value(text, result));
  }

  std::map<std::string, Type> types_named_;
  std::map<std::string, double> sizes_;
  std::set<std::string> unread_, optional_;
  std::map<std::string, std::string> traps_;
  std::vector<std::string> loops_;
  std::vector<Token> after_;
  std::string word_, want_, result_name_;
  bool is_announcing_ = true, has_main_ = false, told_zone_ = false;
  std::set<std::string> looked_at_;
  const Token* looked_at_of_ = nullptr;  ///< the text that looked_at_ is of
  bool is_any_configuration_ = false;
  bool is_stopped_ = false;  ///< the last motion that was read stops at its target
  int both_frames_ = 0;      ///< of the last work object: 1 user frame, 2 object frame
  int nested_ = 0;
  std::vector<std::set<std::string>> local_names_;  ///< of each file, that others have, too
  std::map<std::string, std::string> own_texts_;
};

}  // namespace

namespace {

class RapidScan final : public Reader {
 public:
  using Reader::Reader;
  void run() override {}
  RapidNames names() {
    scan(0, kRapidStyle);
    return rapid_names(tokens_);
  }

 private:
  Ex primary() override { return failed(); }
};
RapidNames names_of_module(const SourceFile& file) {
  const SourceFile one[] = {file};
  Learned learned;
  const NoParams params;
  NoProgress progress;
  return RapidScan(one, learned, params, progress).names();
}

}  // namespace

std::vector<std::string> rapid_needs(const SourceFile& file) {
  std::vector<std::string> out{"CalibData.mod"};
  const RapidNames names = names_of_module(file);
  for (const std::string& n : names.used)
    if (!names.local.contains(n) && !names.global.contains(n) && n != "main" &&
        !maker_word(MakerLanguage::rapid, n))
      out.push_back("@" + n);
  return out;
}
std::vector<std::string> rapid_offers(const SourceFile& file) {
  const RapidNames names = names_of_module(file);
  std::vector<std::string> out;
  for (const std::string& n : names.global)
    if (n != "main") out.push_back(n);
  return out;
}

Made read_rapid(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<RapidReader>(task, params, progress);
}

}  // namespace robomosp::readers

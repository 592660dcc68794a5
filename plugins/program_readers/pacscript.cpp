// SPDX-License-Identifier: Apache-2.0
// Denso PacScript (RC8): a file of .pcs with its procedures.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kPacStyle{.comment = "'",
                      .quotes = "\"",
                      .name_first = "_",
                      .name_rest = "_$%!#",
                      .signs = {"<>", "><", "<=", "=<", ">=", "=>", "<<", ">>"},
                      .has_lines = true,
                      .joins_in_brackets = true,
                      .hex = "&h"};
constexpr Binary kPacBinaries[] = {
    {"or", 10, Op::or_}, {"xor", 10, Op::exor}, {"and", 12, Op::and_}, {"=", 20, Op::eq},
    {"<>", 20, Op::ne},  {"><", 20, Op::ne},    {"<", 20, Op::lt},     {">", 20, Op::gt},
    {"<=", 20, Op::le},  {"=<", 20, Op::le},    {">=", 20, Op::ge},    {"=>", 20, Op::ge},
    {"+", 30, Op::add},  {"-", 30, Op::sub},    {"mod", 35, Op::mod},  {"\\", 36, Op::idiv},
    {"*", 40, Op::mul},  {"/", 40, Op::div},    {"^", 50, Op::power}};

class PacReader final : public Reader {
 public:
  using Reader::Reader;

  [[nodiscard]] MakerLanguage language() const override { return MakerLanguage::pacscript; }

  void run() override {
    name_ = std::string(stem(files_[0].name));
    scan(0, kPacStyle);
    macros();
    find_outputs();
    is_announcing_ = true;
    file();
    is_announcing_ = false;
    at_ = 0;
    next_comment_ = 0;
    file();
    learned_.flags.insert("passed");
    if (!has_main_)
      note({0, 1, 1, 0, 0}, "no procedure is named Main; the program has no statements",
           "Call one of its procedures after BEGIN.");
  }

 private:
  std::span<const Binary> binaries() const override { return kPacBinaries; }
  std::string_view not_word() const override { return "not"; }
  int not_precedence() const override { return 15; }

  // ---- macros ----

  /// #define NAME words: the words stand where the name does.
  void macros() {
    std::map<std::string, std::vector<Token>> known;
    std::vector<Token> out;
    out.reserve(tokens_.size());
    for (std::size_t i = 0; i < tokens_.size();) {
      const bool begins = out.empty() || out.back().kind == Tk::line;
      if (begins && tokens_[i].low == "#" && i + 1 < tokens_.size() &&
          tokens_[i + 1].kind == Tk::name) {
        const Token what = tokens_[i + 1];
        std::size_t end = i + 2;
        while (end < tokens_.size() && tokens_[end].kind != Tk::line &&
               tokens_[end].kind != Tk::end)
          ++end;
        if (what.low == "define" && i + 2 < end && tokens_[i + 2].kind == Tk::name) {
          const bool has_values = i + 3 < end && tokens_[i + 3].low == "(" &&
                                  tokens_[i + 3].at.begin == tokens_[i + 2].at.end;
          if (has_values) fail(what.at, "macros with arguments are not read", "Write a Function.");
          else
            known[tokens_[i + 2].low] = {tokens_.begin() + static_cast<std::ptrdiff_t>(i + 3),
                                         tokens_.begin() + static_cast<std::ptrdiff_t>(end)};
        } else if (what.low == "include") {
          warn(what.at, "included files are not read; their definitions are unknown",
               "Copy their lines into this file.");
        } else if (what.low == "undef" && i + 2 < end) {
          known.erase(tokens_[i + 2].low);
        } else if (what.low != "pragma") {
          fail(what.at, "#" + std::string(what.raw.substr(0, 20)) + " is not read");
        }
        i = end;
        continue;
      }
      put(out, tokens_[i], known, 0, tokens_[i].at);
      ++i;
      if (out.size() > 4'000'000) break;
    }
    tokens_ = std::move(out);
    if (tokens_.empty() || tokens_.back().kind != Tk::end) tokens_.push_back({});
  }
  void put(std::vector<Token>& out, Token t, const std::map<std::string, std::vector<Token>>& known,
           int depth, const At& at) {
    const auto it = t.kind == Tk::name ? known.find(t.low) : known.end();
    if (it == known.end() || depth > 8 || out.size() > 4'000'000) {
      t.at = at;
      out.push_back(std::move(t));
      return;
    }
    for (const Token& each : it->second) put(out, each, known, depth + 1, at);
  }
  /// Numbers that are switched are outputs; the others are inputs, in the one row of IO.
  void find_outputs() {
    for (std::size_t i = 0; i + 3 < tokens_.size(); ++i) {
      const std::string& w = tokens_[i].low;
      const bool is_assigned = w == "io" && tokens_[i + 1].low == "[" &&
                               (i == 0 || tokens_[i - 1].kind == Tk::line ||
                                tokens_[i - 1].low == "then" || tokens_[i - 1].low == "else");
      if (w != "set" && w != "reset" && w != "out" && !is_assigned) continue;
      std::size_t k = is_assigned ? i : i + 1;
      if (tokens_[k].kind != Tk::name || !tokens_[k].low.starts_with("io")) continue;
      if (tokens_[k].low != "io") {
        outputs_.insert(std::atoll(tokens_[k].low.c_str() + 2));
        continue;
      }
      if (tokens_[k + 1].low != "[" || tokens_[k + 2].kind != Tk::number) continue;
      const auto from = static_cast<std::int64_t>(tokens_[k + 2].value);
      outputs_.insert(from);
      if (tokens_[k + 3].low == "to" && k + 4 < tokens_.size() &&
          tokens_[k + 4].kind == Tk::number && tokens_[k + 4].value - tokens_[k + 2].value < 64)
        for (auto n = from; n <= static_cast<std::int64_t>(tokens_[k + 4].value); ++n)
          outputs_.insert(n);
    }
  }

  // ---- procedures ----

  void file() {
    while (!at_end()) {
      if (progress_.cancelled()) return statement(here(), [] {});
      if (peek().kind == Tk::line || is(":")) {
        ++at_;
        continue;
      }
      const At at = here();
      accept("public");
      accept("private");
      if (is("sub") || is("function")) {
        procedure();
      } else if (is("program")) {
        next();
        skip_rest();
        main_body(at, "end");
      } else if (accept("dim") || accept("static")) {
        if (is_announcing_) statement(at, [&] { dim(false, at); });
        skip_line();
      } else if (is("option") || is("rem")) {
        skip_line();
      } else {
        if (is_announcing_)
          fail(at,
               "\"" + std::string(peek().raw.substr(0, 40)) +
                   "\" is not expected outside a procedure",
               "A program is Sub Main, its lines and End Sub.");
        skip_line();
      }
    }
  }
  void main_body(const At& at, std::string_view end) {
    has_main_ = true;
    if (is_announcing_) return skip_body(end);
    close();
    passes_comments(at);
    function_.clear();
    body(end);
  }
  void passes_comments(const At& at) {
    while (next_comment_ < comments_.size() && comments_[next_comment_].line < at.line)
      ++next_comment_;
  }
  [[nodiscard]] bool at_body_end(std::string_view end) const {
    if (!is("end")) return false;
    const Token& t = peek(1);
    if (end == "end") return t.kind == Tk::line || t.kind == Tk::end;
    return t.low == end;
  }
  void skip_body(std::string_view end) {
    while (!at_end()) {
      while (peek().kind == Tk::line) ++at_;
      if (at_body_end(end)) {
        skip_rest();
        return;
      }
      skip_line();
    }
  }
  std::optional<Type> type_here() {
    const Token t = next();
    static const std::map<std::string, Type, std::less<>> kTypes{
        {"integer", kInt},     {"long", kInt},      {"single", kReal},   {"double", kReal},
        {"boolean", kBool},    {"string", kString}, {"position", kPose}, {"trans", kPose},
        {"vector", kPosition}, {"byte", kInt},      {"variant", kReal}};
    if (t.low == "joint") return joint_type();
    const auto it = kTypes.find(t.low);
    return it == kTypes.end() ? std::nullopt : std::optional(it->second);
  }
  static std::optional<Type> type_of_suffix(const std::string& low) {
    if (low.ends_with("$")) return kString;
    if (low.ends_with("%")) return kInt;
    if (low.ends_with("!") || low.ends_with("#")) return kReal;
    return std::nullopt;
  }
  void procedure() {
    const At at = here();
    const bool is_function = next().low == "function";
    const Token name = next();
    std::vector<Parameter> list;
    bool ok = true;
    if (accept("(")) {
      while (!at_line_end() && !is(")")) {
        const bool by_value = accept("byval");
        accept("byref");
        accept("optional");
        const Token n = next();
        if (accept("(")) {
          ok = false;
          while (!at_line_end() && !accept(")")) ++at_;
        }
        std::optional<Type> t = type_of_suffix(n.low);
        if (accept("as")) t = type_here();
        ok = ok && n.kind == Tk::name;
        Type type = t.value_or(kReal);
        type = known_type(lower(name.raw) + "|" + n.low, type);
        list.push_back({std::string(n.raw), type,
                        !by_value && learned_.flags.contains("written " + name.low + "." + n.low)});
        if (!accept(",")) break;
      }
      expect(")");
    }
    Type result;
    if (is_function) {
      result = type_of_suffix(name.low).value_or(kReal);
      if (accept("as")) {
        const auto t = type_here();
        ok = ok && t;
        if (t) result = *t;
      }
    }
    skip_rest();
    const std::string end = is_function ? "function" : "sub";
    if (name.low == "main" && !is_function && list.empty()) return main_body(at, end);
    if (is_announcing_) {
      if (!ok)
        fail(at, "the parameters of " + std::string(name.raw.substr(0, 40)) + " are not read");
      announce(name.raw, list, result);
      return skip_body(end);
    }
    begin(name.raw, list, result, at);
    passes_comments(at);
    function_ = is_function ? name.low : "";
    routine_ = lower(name.raw);
    parameters_.clear();
    for (const Parameter& p : list) parameters_.insert(lower(p.foreign));
    if (is_function) {
      Symbol& s = declare("=" + std::string(name.raw), result, Symbol::variable, true);
      declare_variable(s, {}, at, true);
    }
    body(end);
    if (is_function) emit("RETURN " + current().symbols["=" + function_].irl + ";", here());
    function_.clear();
    routine_.clear();
    parameters_.clear();
    close();
  }
  void body(std::string_view end) {
    blocks_.clear();
    loops_.clear();
    goal_.clear();
    current().indent = 1;
    while (!at_end()) {
      if (progress_.cancelled()) return statement(here(), [] {});
      if (peek().kind == Tk::line || is(":")) {
        ++at_;
        continue;
      }
      const At at = here();
      if (at_body_end(end)) {
        comments_until(at);
        close_blocks(at);
        skip_rest();
        return;
      }
      statement(at, [&] {
        one();
        if (!at_line_end() && !is(":")) {
          bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
          skip_rest();
        }
      });
      if (here().begin == at.begin && !at_end()) ++at_;
    }
    close_blocks(here());
    fail(here(), "this procedure has no End " + std::string(end == "end" ? "" : end));
  }

  // ---- variables ----

  /// The type of a name, which becomes a target where figures are given.
  Type known_type(const std::string& key, Type t) const {
    if (t.k == K::pose && learned_.flags.contains("figure " + key)) return kTarget;
    if (t.k == K::array && t.element && t.element->k == K::pose &&
        learned_.flags.contains("figure " + key))
      return array_of(kTarget, t.bounds);
    return t;
  }
  [[nodiscard]] std::string key_of(const std::string& low) const {
    const bool is_local = current_symbols().contains(low) || parameters_.contains(low);
    return (is_local ? routine_ : std::string()) + "|" + low;
  }
  [[nodiscard]] const std::map<std::string, Symbol>& current_symbols() const {
    return const_cast<PacReader*>(this)->current().symbols;
  }
  [[nodiscard]] std::string initial_of(const Type& t) {
    const auto one = [&] {
      return target(identity(), integer(0), std::vector<Ex>(6, integer(-128)), {}).s;
    };
    if (t.k == K::target) return one();
    return {};
  }
  /// Dim a As Long = 5, b(3) As Position
  void dim(bool is_local, const At& at) {
    do {
      const Token n = next();
      if (n.kind != Tk::name) {
        bad(n.at, "the name of a variable is expected here");
        return skip_rest();
      }
      std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
      if (accept("(")) {
        do {
          const Ex e = expression();
          if (!e.is_literal || e.v < 0 || e.v > 100'000) {
            if (e.ok) bad(at, "the size of " + std::string(n.raw) + " is not known");
            return skip_rest();
          }
          bounds.emplace_back(0, static_cast<std::int64_t>(e.v));
        } while (accept(","));
        expect(")");
      }
      std::optional<Type> t = type_of_suffix(n.low).value_or(kReal);
      if (accept("as")) t = type_here();
      if (!t) {
        bad(at, "IRL has no variables of this type");
        return skip_rest();
      }
      Type type = known_type((is_local ? routine_ : "") + "|" + n.low,
                             bounds.empty() ? *t : array_of(*t, bounds));
      if ((is_local ? current().symbols : globals_).contains(n.low)) {
        bad(n.at, std::string(n.raw) + " is declared twice");
        return skip_rest();
      }
      std::string text = initial_of(type);
      std::optional<Ex> given;
      if (accept("=")) given = expression();
      Symbol& s = declare(n.raw, type, Symbol::variable, is_local);
      if (given && given->ok && given->is_constant && !is_local) {
        const Ex x = converted(*given, type, at);
        if (x.ok) text = x.s;
        given.reset();
        gives(n.low);
      }
      declare_variable(s, text, at, is_local);
      if (given && given->ok) {
        gives(n.low);
        give(place(s.irl, s.type), n.low, *given, at);
      }
    } while (accept(","));
  }
  void gives(const std::string& low) { learned_.flags.insert("given " + key_of(low)); }
  /// P10, P[10], J1, I[i] ...: variables of the controller.
  static std::optional<Type> global_type(const std::string& low) {
    if (low.empty()) return std::nullopt;
    for (std::size_t k = 1; k < low.size(); ++k)
      if (low[k] < '0' || low[k] > '9') return std::nullopt;
    switch (low[0]) {
      case 'i': return kInt;
      case 'f':
      case 'd': return kReal;
      case 'p':
      case 't': return kPose;
      case 's': return kString;
      case 'v': return kPosition;
      case 'j': return Type{.k = K::joint, .record = {}, .bounds = {}, .element = {}};
      default: return std::nullopt;
    }
  }
  static std::string initial_name(char c, std::int64_t n) {
    return std::string(1, c) + std::to_string(n);
  }
  /// A variable of the controller that stands here; nothing = none does.
  bool is_global_here() const {
    const Token& t = peek();
    if (t.kind != Tk::name || current_symbols().contains(t.low) ||
        (globals_.contains(t.low) && !elements_.contains(t.low)))
      return false;
    if (t.low.size() == 1) return global_type(t.low) && is("[", 1);
    return global_type(t.low).has_value();
  }
  Ex global_here(bool is_written) {
    const Token t = next();
    const At at = t.at;
    std::optional<std::int64_t> number;
    Ex index;
    if (t.low.size() > 1) {
      number = std::atoll(t.low.c_str() + 1);
    } else {
      expect("[");
      index = as_integer(expression(), at);
      expect("]");
      if (!index.ok) return index;
      if (index.is_literal) number = static_cast<std::int64_t>(index.v);
    }
    const char c = t.low[0];
    const std::string family = std::string(1, c) + "[]";
    if (number && (*number < 0 || *number > 100'000))
      return bad(at, "the number of this variable is out of range");
    Type of = *global_type(std::string(1, c));
    if (of.k == K::pose && learned_.flags.contains("figure |" + family)) of = kTarget;
    if (!number) learned_.flags.insert("computed " + family);
    if (number) {
      // The least and greatest number of a row that is asked for by a computed one.
      Type& row = learned_.types[family];
      if (row.k != K::array) row = array_of(kInt, {{*number, *number}});
      row.bounds[0].first = std::min(row.bounds[0].first, *number);
      row.bounds[0].second = std::max(row.bounds[0].second, *number);
    }
    const std::string element = number ? initial_name(c, *number) : family;
    last_key_ = family;
    if (is_written) {
      learned_.flags.insert("given " + element);
    } else if (learned_.flags.contains("passed") && !learned_.flags.contains("given " + element) &&
               !learned_.flags.contains("given " + family) && number &&
               unvalued_.insert(element).second) {
      fail(at,
           std::string(t.raw) + (t.low.size() == 1 ? "[" + std::to_string(*number) + "]" : "") +
               " has no value in this program; it is zero here",
           "Assign one: the controller stores it in its variables.");
    }
    if (!learned_.flags.contains("computed " + family)) {
      Symbol* s = find(element);
      if (!s) {
        elements_.insert(element);
        s = &declare(std::string(1, static_cast<char>(c - 32)) + element.substr(1), of);
        declare_variable(*s, initial_of(of), at);
      }
      return place(s->irl, s->type);
    }
    const auto row = learned_.types.find(family);
    if (row == learned_.types.end() || row->second.k != K::array)
      return bad(at, "the possible variables of " + std::string(t.raw) + "[...] are unknown",
                 "Use one with a number in this program.");
    Symbol* s = find(family);
    const Type type = array_of(of, row->second.bounds);
    if (!s) {
      s = &declare(family, type);
      declare_variable(*s, {}, at);
    }
    return place(s->irl + "[" + (number ? std::to_string(*number) : index.s) + "]", of);
  }
  /// What gets a value: a name with its indices.
  Ex place_here(bool is_written) {
    if (is_global_here()) return global_here(is_written);
    const Token t = next();
    const At at = t.at;
    if (t.low == function_ && !is("(")) {
      last_key_ = "=" + function_;
      const Symbol& s = current().symbols["=" + function_];
      return place(s.irl, s.type);
    }
    Symbol* s = find(t.low);
    if (!s || s->kind == Symbol::routine)
      return bad(at, "the name " + std::string(t.raw.substr(0, 40)) + " is not declared here",
                 "Declare it with Dim; names in included files are unknown.");
    last_key_ = t.low;
    Ex e = place(s->irl, s->type);
    e.is_place = s->kind != Symbol::constant;
    if (e.type.k == K::array) {
      const char* close = is("[") ? "]" : ")";
      if (!accept("(") && !accept("[")) return bad(at, "an array is used as a whole");
      std::string list;
      std::size_t n = 0;
      do {
        const Ex i = as_integer(expression(), at);
        if (!i.ok) return i;
        list += (n++ ? ", " : "") + i.s;
      } while (accept(","));
      expect(close);
      if (n != e.type.bounds.size())
        return bad(at, "the array has " + std::to_string(e.type.bounds.size()) + " indices");
      const Type of = *e.type.element;
      e = place(e.s + "[" + list + "]", of);
    }
    if (is_written) {
      will_write(t.low);
      gives(t.low);
    } else if ((e.type.k == K::pose || e.type.k == K::target || e.type.k == K::joint) &&
               learned_.flags.contains("passed") && !parameters_.contains(t.low) &&
               !learned_.flags.contains("given " + key_of(t.low)) &&
               unvalued_.insert(key_of(t.low)).second) {
      fail(at, std::string(t.raw) + " has no value in this program; it is zero here",
           "Assign one before it is used.");
    }
    return e;
  }
  /// An assignment; a position with a figure makes its variable a target.
  void give(const Ex& to, const std::string& low, const Ex& e, const At& at) {
    if (!to.ok || !e.ok) return;
    if (to.type.k == K::pose && e.type.k == K::target) {
      learned_.flags.insert("figure " + (low.ends_with("[]") ? "|" + low : key_of(low)));
      const Ex p = plain(e, at);
      if (p.ok) assign(to, p, at);
      return;
    }
    if (to.type.k == K::target && e.type.k == K::pose) {
      emit(to.s + ".PSE := " + e.s + ";", at);
      if (e.is_constant)
        fail(at,
             "a position without a figure is assigned to a variable that has figures elsewhere; it "
             "keeps its present figure",
             "Write the figure.");
      return;
    }
    if (to.type.k == K::target && e.type.k == K::joint) {
      assign(to, as_place(e), at);
      return;
    }
    if (to.type.k == K::pose && e.type.k == K::joint) {
      const Ex p = as_pose(as_place(e), at);
      if (p.ok) assign(to, p, at);
      return;
    }
    assign(to, e, at);
  }
  Ex plain(const Ex& e, const At& at) {
    if (e.type.k == K::target)
      if (const auto it = poses_.find(e.s); it != poses_.end()) {
        Ex p = value(it->second, kPose);
        p.is_constant = e.is_constant;
        return p;
      }
    return as_pose(as_place(e), at);
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (t.kind == Tk::sign && t.low == "*" && peek(1).kind == Tk::name) {
      next();
      const Token l = next();
      accept(":");
      goal_.clear();
      emit("LABEL " + label(l.raw) + ":", at);
      return;
    }
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      return skip_rest();
    }
    static const std::map<std::string, void (PacReader::*)(const At&), std::less<>> kWords{
        {"move", &PacReader::motion},
        {"approach", &PacReader::approach},
        {"depart", &PacReader::depart},
        {"draw", &PacReader::draw},
        {"drivea", &PacReader::drive},
        {"if", &PacReader::if_},
        {"elseif", &PacReader::elseif},
        {"else", &PacReader::else_},
        {"end", &PacReader::end},
        {"select", &PacReader::select},
        {"case", &PacReader::case_},
        {"for", &PacReader::for_},
        {"next", &PacReader::next_},
        {"do", &PacReader::do_},
        {"loop", &PacReader::loop},
        {"while", &PacReader::while_},
        {"wend", &PacReader::wend},
        {"repeat", &PacReader::repeat},
        {"until", &PacReader::until},
        {"exit", &PacReader::exit_},
        {"goto", &PacReader::jump},
        {"call", &PacReader::call_},
        {"set", &PacReader::set_},
        {"reset", &PacReader::set_},
        {"out", &PacReader::out},
        {"in", &PacReader::in},
        {"wait", &PacReader::wait},
        {"delay", &PacReader::delay},
        {"hold", &PacReader::hold},
        {"halt", &PacReader::halt},
        {"printdbg", &PacReader::print},
        {"print", &PacReader::print},
        {"printlcd", &PacReader::print},
        {"printmsg", &PacReader::print},
        {"speed", &PacReader::speed},
        {"extspeed", &PacReader::speed},
        {"jspeed", &PacReader::speed},
        {"accel", &PacReader::accel},
        {"jaccel", &PacReader::accel},
        {"decel", &PacReader::accel},
        {"tool", &PacReader::tool},
        {"work", &PacReader::tool},
        {"changetool", &PacReader::change},
        {"changework", &PacReader::change},
        {"takearm", &PacReader::take},
        {"givearm", &PacReader::harmless},
        {"motor", &PacReader::harmless},
        {"dim", &PacReader::dim_},
        {"static", &PacReader::dim_},
        {"let", &PacReader::let},
        {"letx", &PacReader::let_part},
        {"lety", &PacReader::let_part},
        {"letz", &PacReader::let_part},
        {"rem", &PacReader::remark},
        {"highpathaccuracy", &PacReader::harmless}};
    if (!is("=", 1)) {
      if (const auto it = kWords.find(t.low); it != kWords.end()) {
        next();
        word_ = t.low;
        (this->*it->second)(at);
        return;
      }
    }
    if (is(":", 1) && has_label(t.low, true)) {
      next();
      next();
      goal_.clear();
      emit("LABEL " + label(t.raw) + ":", at);
      return;
    }
    if (t.low == "io" || (t.low.starts_with("io") && io_number(t.low))) {
      Symbol* s = io_here(at);
      if (!expect("=")) return skip_rest();
      const Ex e = expression();
      if (s && e.ok) switch_to(*s, converted(e, kBool, at), at);
      return;
    }
    const Symbol* s = find(t.low);
    const bool is_variable =
        is_global_here() || (s && s->kind != Symbol::routine) || (t.low == function_ && is("=", 1));
    if (is_variable || is("=", 1)) return assignment(at);
    // A procedure, with or without brackets; one of another file is called by Call.
    if (!s && !maker_word(language(), t.low)) {
      skip_rest();
      bad(at,
          std::string(t.raw.substr(0, 40)) +
              " is neither a supported statement nor a procedure here",
          "Write the same in IRL, or remove it.");
      return;
    }
    next();
    call_of(t, at);
  }
  void remark(const At& at) {
    while (!at_line_end()) ++at_;
    emit("{ " + source_line(at) + " }", at);
  }
  void harmless(const At& at) {
    (void)at;
    while (!at_line_end() && !is(":")) ++at_;
  }
  void dim_(const At& at) { dim(!is_in_main(), at); }
  void let(const At& at) { assignment(at); }
  void assignment(const At& at) {
    const Ex to = place_here(true);
    const std::string low = last_key_;
    if (!to.ok || !expect("=")) return skip_rest();
    const Ex e = expression();
    goal_.clear();
    give(to, low, e, at);
  }
  /// LetX place = value
  void let_part(const At& at) {
    const char c = static_cast<char>(word_[3] - 32);
    const Ex to = place_here(true);
    if (!expect("=")) return skip_rest();
    const Ex e = as_real(expression(), at);
    if (!to.ok || !e.ok) return;
    goal_.clear();
    if (to.type.k == K::position) emit(to.s + "." + c + " := " + e.s + ";", at);
    else if (to.type.k == K::pose) emit(to.s + ".POS." + c + " := " + e.s + ";", at);
    else if (to.type.k == K::target) emit(to.s + ".PSE.POS." + c + " := " + e.s + ";", at);
    else bad(at, "this has no component " + std::string(1, c));
  }

  // ---- settings ----

  void speed(const At& at) {
    const std::string key = word_ == "extspeed" ? "ext_speed"
                            : word_ == "jspeed" ? "joint_speed"
                                                : "speed";
    std::vector<Ex> n;
    do n.push_back(as_real(expression(), at));
    while (accept(","));
    for (const Ex& e : n)
      if (!e.ok) return;
    if (n[0].is_literal && n[0].v <= 0) {
      bad(at, "this is not a speed");
      return;
    }
    set(key, n[0], at);
    if (n.size() > 1 && key == "speed") set("accel", n[1], at);
  }
  void accel(const At& at) {
    std::vector<Ex> n;
    do n.push_back(as_real(expression(), at));
    while (accept(","));
    for (const Ex& e : n)
      if (!e.ok || (e.is_literal && (e.v <= 0 || e.v > 100))) {
        if (e.ok) bad(at, "an acceleration must be above 0 and at most 100 % in IRL");
        return;
      }
    if (word_ == "decel") {
      decels(n[0], at);
      return;
    }
    set(word_ == "jaccel" ? "joint_accel" : "accel", n[0], at);
    if (n.size() > 1 && n[1].s != n[0].s) decels(n[1], at);
  }
  void decels(const Ex&, const At& at) {
    if (!std::exchange(said_["decel"], true))
      warn(at, std::string("IRL has one number for acceleration and deceleration; the one of Accel is "
                           "used") +
                   kOtherTimes);
  }
  /// Tool n, place and Work n, place: what ChangeTool n and ChangeWork n choose.
  void tool(const At& at) {
    const Ex n = as_integer(expression(), at);
    expect(",");
    const Ex p = plain(expression(), at);
    if (accept(",")) {
      bad(at, "a work coordinate system with an attribute is not read");
      return skip_rest();
    }
    if (!n.ok || !p.ok) return;
    if (!n.is_literal) {
      bad(at, "the number of the " + word_ + " is computed");
      return;
    }
    set(word_ + "_" + n.s, p, at);
    // What is chosen changes with it.
    const std::string key = word_ == "tool" ? "tool" : "frame";
    if (chosen_[key] == n.s) choose(key, word_ + "_" + n.s, at);
  }
  void choose(const std::string& key, const std::string& of, const At& at) {
    const auto it = learned_.modal.find(of);
    Ex p;
    if (it != learned_.modal.end() && it->second.size() == 1 &&
        !learned_.modal_varies.contains(of)) {
      p = value(*it->second.begin(), kPose);
      p.is_constant = true;
    } else {
      p = get(of, kPose, at);
    }
    goal_.clear();
    set(key, p, at);
  }
  void change(const At& at) {
    const bool is_tool = word_ == "changetool";
    const Ex n = as_integer(expression(), at);
    if (!n.ok) return;
    if (!n.is_literal) {
      bad(at, "the number of the tool or work coordinate system is computed");
      return;
    }
    const std::string key = is_tool ? "tool" : "frame";
    const std::string of = (is_tool ? "tool_" : "work_") + n.s;
    chosen_[key] = n.s;
    goal_.clear();
    if (is_set(of)) return choose(key, of, at);
    if (n.v != 0)
      fail(at,
           std::string(is_tool ? "tool " : "work coordinate system ") + n.s +
               " is set on the controller; it is zero here",
           std::string("Write ") + (is_tool ? "Tool " : "Work ") + n.s + ", P(...) before.");
    set(key, identity(), at);
  }
  /// TakeArm begins with tool 0, work 0 and full speed, but with Keep = 1.
  void take(const At& at) {
    bool keeps = false;
    while (!at_line_end() && !is(":")) {
      if (accept("keep")) {
        expect("=");
        const Ex e = expression();
        keeps = e.is_literal && e.v != 0;
        continue;
      }
      ++at_;
    }
    if (keeps) return;
    chosen_.clear();
    goal_.clear();
    for (const char* each : {"tool", "frame"})
      if (is_set(each)) set(each, identity(), at);
    if (is_set("speed")) set("speed", real(100), at);
  }

  // ---- motions ----

  struct Options {
    std::optional<Ex> speed, accel, time;
    bool is_next = false;
  };
  struct Goal {
    Ex place;
    bool passes = false;
    std::optional<Ex> distance;
    std::vector<std::pair<int, Ex>> outer;
  };
  /// P, L, C before the first comma.
  std::string interpolation(const At& at) {
    const Token t = next();
    expect(",");
    if (t.low == "p" || t.low == "ptp") return "PTP";
    if (t.low == "l") return "LIN";
    if (t.low == "c") return "CIRCLE";
    bad(at, "motions of the kind " + std::string(t.raw.substr(0, 20)) + " are not read");
    return {};
  }
  /// @0, @E, @C, @P or @20; false = none of them.
  bool arrival(Goal& g, const At& at) {
    if (!accept("@")) return true;
    if (peek().kind == Tk::name) {
      const Token t = next();
      if (t.low == "p") g.passes = true;
      else if (t.low != "e" && t.low != "c" && t.low != "m")
        return bad(at, "@P, @E or @n is expected here"), false;
    } else {
      const Ex d = accept("(") ? expression() : literal_here().value_or(failed());
      if (tokens_[at_ - 1].low != ")" && !d.is_literal) expect(")");
      const Ex x = as_real(d, at);
      if (!x.ok) return bad(at, "a distance belongs behind @"), false;
      if (!(x.is_literal && x.v == 0)) {
        g.passes = true;
        g.distance = x;
      }
    }
    accept(",");  // some write one here
    return true;
  }
  bool goal(Goal& g, const At& at) {
    if (!arrival(g, at)) return false;
    g.place = expression();
    // EX((7, v), ...) is by so much, EXA to there.
    if (is("exa") || is("ex")) {
      const bool is_absolute = next().low == "exa";
      if (!is_absolute)
        return bad(at, "relative motions of additional axes (EX) are not read"), false;
      expect("(");
      do {
        if (!expect("(")) return false;
        const Ex n = as_integer(expression(), at);
        expect(",");
        const Ex v = as_real(expression(), at);
        expect(")");
        if (!n.ok || !v.ok) return false;
        if (!n.is_literal || n.v < 7 || n.v > 16)
          return bad(at, "additional axes must be numbered from 7"), false;
        g.outer.emplace_back(static_cast<int>(n.v) - 7, v);
      } while (accept(","));
      expect(")");
    }
    return g.place.ok;
  }
  /// , Speed = 50, Accel = 30, Next
  bool options(Options& o, const At& at) {
    while (accept(",")) {
      const Token t = next();
      if (t.low == "next") {
        o.is_next = true;
        continue;
      }
      if (!expect("=")) return false;
      const Ex e = as_real(expression(), at);
      if (!e.ok) return false;
      if (t.low == "speed" || t.low == "s") o.speed = e;
      else if (t.low == "accel") o.accel = e;
      else if (t.low == "decel") {
        if (!o.accel || o.accel->s != e.s) decels(e, at);
      } else if (t.low == "time" || t.low == "t") {
        o.time = e;
      } else {
        bad(at, "the option " + std::string(t.raw.substr(0, 20)) + " of a motion is not read");
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] bool at_option() const {
    return is(",") && peek(1).kind == Tk::name && (is("=", 2) || peek(1).low == "next");
  }
  static Ex constant_of(const Ex& e) {
    if (e.is_literal || !e.is_constant || e.is_place) return e;
    char* end = nullptr;
    const double v = std::strtod(e.s.c_str(), &end);
    return *end == '\0' ? real(v) : e;
  }
  Ex times(const Ex& a, const Ex& percent, const At& at) {
    const Ex x = constant_of(a), y = constant_of(percent);
    if (x.is_literal && y.is_literal) return measure(x.v * y.v / 100);
    return scaled(binary(Op::mul, x, y, at), 0.01);
  }
  void attributes(Motion& m, const Options& o, const Goal& g, bool is_joint, const At& at) {
    if (o.time) m.attributes.emplace_back("TIME", scaled(*o.time, 0.001));
    std::optional<Ex> v = o.speed;
    if (!v && is_joint && is_set("joint_speed")) v = get("joint_speed", kReal, at);
    if (!v && is_set("speed")) v = get("speed", kReal, at);
    if (is_set("ext_speed")) v = times(v ? *v : real(100), get("ext_speed", kReal, at), at);
    if (v && !o.time) {
      if (is_joint) {
        m.attributes.emplace_back("SPEED_PTP", constant_of(*v));
      } else {
        if (!std::exchange(said_["speed"], true))
          note(at, "a path speed in % is converted to mm/s; 100 % is tcp_speed",
               "Set it with settings = {tcp_speed = ...}.");
        m.attributes.emplace_back("SPEED", scaled(constant_of(*v), params_.real("tcp_speed") * 10));
      }
    }
    std::optional<Ex> a = o.accel;
    if (!a && is_joint && is_set("joint_accel")) a = get("joint_accel", kReal, at);
    if (!a && is_set("accel")) a = get("accel", kReal, at);
    if (a) m.attributes.emplace_back(is_joint ? "ACC_PTP" : "ACC", *a);
    if (!g.passes) return;
    if (!g.distance) {
      m.attributes.emplace_back("C_PASS", boolean(true));
      return;
    }
    if (is_joint && !std::exchange(said_["zone"], true))
      note(at, "a distance in mm of a joint motion becomes C_PTP in %");
    Ex d = *g.distance;
    if (is_joint && d.is_literal && d.v > 100) d = real(100);
    m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", d);
  }
  void go(const std::string& how, const Goal& g, const Options& o, const At& at) {
    Motion m;
    m.word = how == "PTP" ? "PTP" : "LIN";
    const bool is_joint = how == "PTP";
    Ex e = g.place;
    if (e.type.k == K::joint) {
      if (!g.outer.empty()) {
        learned_.external_axes = std::max(learned_.external_axes, 1);
        const std::string v = temporary(e.type, at);
        emit(v + " := " + e.s + ";", at);
        for (const auto& [axis, to] : g.outer) {
          learned_.external_axes = std::max(learned_.external_axes, axis + 1);
          emit(v + ".A_JOINT.AA" + std::to_string(axis + 1) + " := " + to.s + ";", at);
        }
        e = place(v, e.type);
      }
      m.has_frames = false;
      goal_.clear();
      if (!is_joint) e = as_place(e);
    } else if (e.type.k == K::pose || e.type.k == K::target) {
      if (!g.outer.empty()) {
        if (e.type.k != K::target) {
          bad(at, "a position with additional axes needs a figure in IRL", "Write the figure.");
          return;
        }
        const std::string v = temporary(kTarget, at);
        emit(v + " := " + e.s + ";", at);
        for (const auto& [axis, to] : g.outer) {
          learned_.external_axes = std::max(learned_.external_axes, axis + 1);
          emit(v + ".A_JOINT.AA" + std::to_string(axis + 1) + " := " + to.s + ";", at);
        }
        goal_.clear();
        e = place(v, kTarget);
      } else {
        const Ex p = plain(e, at);
        goal_ = p.s.size() < 300 ? p.s : "";
        if (!is_joint) e = p;
      }
    } else {
      bad(at, "this is not a target of a motion");
      return;
    }
    m.targets.push_back(e);
    attributes(m, o, g, is_joint, at);
    move(std::move(m), at);
  }
  std::string temporary(const Type& t, const At& at) {
    const std::string v = irl_name("target");
    (is_in_main() ? variables_ : current().locals)
        .push_back({type_text(t) + ": " + v + ";", at, false});
    return v;
  }
  void motion(const At& at) {
    const std::string how = interpolation(at);
    if (how.empty()) return skip_rest();
    if (how == "CIRCLE") {
      const Ex via = expression();
      expect(",");
      Goal g;
      if (!via.ok || !goal(g, at)) return;
      Options o;
      if (!options(o, at)) return;
      next_said(o, at);
      if (!g.outer.empty()) {
        bad(at, "a circle with additional axes is not read");
        return;
      }
      Motion m;
      m.word = "CIRCLE";
      const Ex a = plain(via, at), b = plain(g.place, at);
      if (!a.ok || !b.ok) return;
      m.targets = {a, b};
      goal_ = b.s.size() < 300 ? b.s : "";
      attributes(m, o, g, false, at);
      move(std::move(m), at);
      return;
    }
    // Dev(CurPos, P(x, y, z)): by so much along the axes of the work coordinate system.
    if (step_here(how, at)) return;
    std::vector<Goal> goals;
    do {
      Goal g;
      if (!goal(g, at)) return;
      goals.push_back(std::move(g));
    } while (!at_option() && accept(",") && goals.size() < 1000);
    Options o;
    if (!options(o, at)) return;
    next_said(o, at);
    for (const Goal& g : goals) go(how, g, o, at);
  }
  void next_said(const Options& o, const At& at) {
    if (!o.is_next || std::exchange(said_["next"], true)) return;
    warn(at,
         "with Next the controller continues while the robot moves; in IRL the motion ends first");
  }
  bool step_here(const std::string& how, const At& at) {
    std::size_t k = 0;
    if (is("@", k)) k += 2;
    if (!(is("dev", k) && is("(", k + 1) && is("curpos", k + 2) && is(",", k + 3))) return false;
    Goal g;
    if (!arrival(g, at)) return true;
    for (int i = 0; i < 4; ++i) next();
    const Token p = next();
    expect("(");
    std::vector<Ex> n = arguments();
    expect(")");
    Options o;
    if (!options(o, at)) return true;
    if (p.low != "p" || n.size() < 3) {
      bad(at, "only Dev(CurPos, P(x, y, z)) is read", "Give the position itself.");
      return true;
    }
    for (std::size_t i = 0; i < n.size(); ++i) {
      if (!n[i].ok) return true;
      if (i >= 3 && i < 6 && !(n[i].is_literal && n[i].v == 0)) {
        bad(at, "a step that rotates the tool is not read", "Give the position itself.");
        return true;
      }
    }
    step(how.c_str(), {n[0], n[1], n[2]}, g, o, at);
    return true;
  }
  void step(const char* how, const std::vector<Ex>& by, const Goal& g, const Options& o,
            const At& at) {
    Motion m;
    m.word = how;
    m.is_incremental = true;
    m.targets.push_back(position(by));
    goal_.clear();
    attributes(m, o, g, std::string_view(how) == "PTP", at);
    move(std::move(m), at);
  }
  void draw(const At& at) {
    const std::string how = interpolation(at);
    if (how.empty()) return skip_rest();
    Goal g;
    if (!arrival(g, at)) return;
    const Ex v = expression();
    Options o;
    if (!options(o, at) || !v.ok) return;
    if (v.type.k != K::position) {
      bad(at, "Draw needs a vector, V(x, y, z)");
      return;
    }
    Motion m;
    m.word = how == "PTP" ? "PTP" : "LIN";
    m.is_incremental = true;
    m.targets.push_back(v);
    goal_.clear();
    attributes(m, o, g, how == "PTP", at);
    move(std::move(m), at);
  }
  Ex before(const Ex& p, const Ex& d, const At& at) {
    const Ex by = pose({real(0), real(0), negative(d)},
                       orientation("ORIQUAT", {real(1), real(0), real(0), real(0)}));
    const Ex q = binary(Op::compose, plain(p, at), by, at);
    // The figure is that of the place itself.
    return p.type.k == K::target ? with_pose(p, q) : q;
  }
  void approach(const At& at) {
    const std::string how = interpolation(at);
    if (how.empty()) return skip_rest();
    const Ex p = expression();
    expect(",");
    Goal g;
    if (!arrival(g, at)) return;
    const Ex d = as_real(expression(), at);
    Options o;
    if (!p.ok || !d.ok || !options(o, at)) return;
    next_said(o, at);
    g.place = before(p.type.k == K::joint ? as_place(p) : p, d, at);
    if (g.place.ok) go(how, g, o, at);
  }
  void depart(const At& at) {
    const std::string how = interpolation(at);
    if (how.empty()) return skip_rest();
    Goal g;
    if (!arrival(g, at)) return;
    const Ex d = as_real(expression(), at);
    Options o;
    if (!d.ok || !options(o, at)) return;
    next_said(o, at);
    if (goal_.empty()) {
      bad(at, "the start of this motion is unknown", "Name the position: Approach.");
      return;
    }
    g.place = before(value(goal_, kPose), d, at);
    if (g.place.ok) go(how, g, o, at);
  }
  /// DriveA J: all axes.
  void drive(const At& at) {
    Goal g;
    if (!arrival(g, at)) return;
    if (is("(")) {
      skip_rest();
      bad(at, "DriveA of single axes is not read", "Name all joints: DriveA J(...).");
      return;
    }
    g.place = expression();
    Options o;
    if (!g.place.ok || !options(o, at)) return;
    next_said(o, at);
    if (g.place.type.k != K::joint) {
      bad(at, "DriveA needs joint values");
      return;
    }
    go("PTP", g, o, at);
  }

  // ---- control flow ----

  void simple(const At& at) {
    if (++nested_ > 30) {
      --nested_;
      skip_rest();
      bad(at, "this is nested too deeply");
      return;
    }
    one();
    while (accept(":") && !at_line_end() && !is("else")) one();
    --nested_;
  }
  void if_(const At& at) {
    const std::string c = truth(at);
    if (!accept("then") && !is("goto")) expect("then");
    emit("IF " + c + " THEN", at);
    goal_.clear();
    if (at_line_end()) {
      open_block("if", "ENDIF");
      return;
    }
    indented(1);
    simple(at);
    if (accept("else")) {
      between("ELSE", at);
      if (!at_line_end()) simple(at);
    }
    indented(-1);
    goal_.clear();
    emit("ENDIF;", at);
  }
  void elseif(const At& at) {
    const std::string c = truth(at);
    accept("then");
    goal_.clear();
    if (is_in("if")) between("ELSIF " + c + " THEN", at);
    else bad(at, "ElseIf is outside If");
  }
  void else_(const At& at) {
    goal_.clear();
    if (is_in("if")) between("ELSE", at);
    else bad(at, "Else is outside If");
  }
  void end(const At& at) {
    goal_.clear();
    if (accept("if")) {
      close_block("if", at);
      return;
    }
    if (accept("select")) {
      close_block("select", at);
      return;
    }
    if (accept("while")) return wend(at);
    if (at_line_end()) {
      emit(is_in_main() ? "RETURN;" : "HALT;", at);
      return;
    }
    bad(at, "no block is open here");
    skip_rest();
  }
  void select(const At& at) {
    accept("case");
    open_case("select", at);
    goal_.clear();
  }
  void case_(const At& at) {
    goal_.clear();
    if (!is_in("select")) {
      bad(at, "Case is outside Select Case");
      return skip_rest();
    }
    if (accept("else")) {
      open_default(at);
      return;
    }
    std::vector<ArmValue> values;
    if (is("is")) {
      bad(at, "Case Is is not read");
      skip_rest();
    } else {
      do {
        ArmValue v{expression(25)};
        if (accept("to")) v.to = expression(25);
        values.push_back(std::move(v));
      } while (accept(","));
    }
    open_arm(values, at);
  }
  void for_(const At& at) {
    const Ex v = place_here(true);
    expect("=");
    const Ex from = expression(25);
    expect("to");
    const Ex to = expression(25);
    Ex step = integer(1);
    if (accept("step")) step = expression(25);
    goal_.clear();
    const bool ok = v.ok && from.ok && to.ok && step.ok;
    if (ok && !step.is_literal) bad(at, "the step of this loop is unknown");
    if (!ok || !step.is_literal || step.v == 0) {
      emit("WHILE FALSE DO", at);
      open_block("for", "ENDWHILE");
      loops_.push_back({"for", ""});
      return;
    }
    // The variable is kept behind the loop, and may be changed within.
    assign(v, from, at);
    emit("WHILE " + v.s + (step.v < 0 ? " >= " : " <= ") + within(to, kSum) + " DO", at);
    open_block("for", "ENDWHILE");
    loops_.push_back({"for", v.s + " := " + v.s + (step.v < 0 ? " - " : " + ") +
                                 (step.v < 0 ? negative(step) : step).s + ";"});
  }
  void next_(const At& at) {
    goal_.clear();
    if (!at_line_end() && !is(":")) (void)place_here(true);
    if (!is_in("for") || loops_.empty()) {
      bad(at, "Next has no loop");
      return;
    }
    if (!loops_.back().second.empty()) emit(loops_.back().second, at);
    loops_.pop_back();
    close_block("for", at);
  }
  void do_(const At& at) {
    goal_.clear();
    if (is("while") || is("until")) {
      const bool is_until = next().low == "until";
      const std::string c = truth(at);
      emit("WHILE " + (is_until ? "NOT (" + c + ")" : c) + " DO", at);
      open_block("do", "ENDWHILE");
    } else {
      emit("LOOP", at);
      open_block("do", "ENDLOOP");
    }
    loops_.push_back({"do", ""});
  }
  void loop(const At& at) {
    goal_.clear();
    if (!is_in("do")) {
      bad(at, "Loop has no open loop");
      return skip_rest();
    }
    if (is("while") || is("until")) {
      const bool is_while = next().low == "while";
      const std::string c = truth(at);
      emit("IF " + (is_while ? "NOT (" + c + ")" : c) + " THEN EXIT; ENDIF;", at);
    }
    if (!loops_.empty()) loops_.pop_back();
    close_block("do", at);
  }
  void while_(const At& at) {
    const std::string c = truth(at);
    goal_.clear();
    emit("WHILE " + c + " DO", at);
    open_block("while", "ENDWHILE");
    loops_.push_back({"while", ""});
  }
  void wend(const At& at) {
    goal_.clear();
    if (is_in("while") && !loops_.empty()) loops_.pop_back();
    close_block("while", at);
  }
  void repeat(const At& at) {
    goal_.clear();
    emit("REPEAT", at);
    open_block("until", "UNTIL TRUE");
    loops_.push_back({"repeat", ""});
  }
  void until(const At& at) {
    const std::string c = truth(at);
    goal_.clear();
    if (!is_in("until")) {
      bad(at, "Until has no open loop");
      return;
    }
    if (!loops_.empty()) loops_.pop_back();
    blocks_.back().irl = "UNTIL " + c;
    close_block("until", at);
  }
  void exit_(const At& at) {
    const Token t = next();
    if (t.low == "sub" || t.low == "function") {
      if (t.low == "function" && !function_.empty())
        emit("RETURN " + current().symbols["=" + function_].irl + ";", at);
      else emit("RETURN;", at);
      return;
    }
    if (t.low != "do" && t.low != "for" && t.low != "while") {
      bad(at, "Exit Do, Exit For, Exit Sub or Exit Function is expected here");
      return;
    }
    if (loops_.empty() || loops_.back().first != t.low) {
      bad(at, "IRL's EXIT ends the innermost loop, but this ends an outer one");
      return;
    }
    emit("EXIT;", at);
  }
  void jump(const At& at) {
    accept("*");
    const Token t = next();
    bool found = false;
    for (std::size_t k = 0; k + 1 < tokens_.size() && !found; ++k)
      found = tokens_[k].low == t.low &&
              (tokens_[k + 1].low == ":" ||
               (k > 0 && tokens_[k - 1].low == "*" && (k == 1 || tokens_[k - 2].kind == Tk::line)));
    if (!found || t.kind != Tk::name) {
      bad(at, "the label " + std::string(t.raw.substr(0, 40)) + " does not exist");
      return;
    }
    emit("GOTO " + label(t.raw) + ";", at);
  }
  void call_(const At& at) {
    const Token t = next();
    call_of(t, at);
  }
  void call_of(const Token& t, const At& at) {
    goal_.clear();
    std::vector<Ex> args;
    if (accept("(")) args = call_arguments(t.low, ")");
    else if (!at_line_end() && !is(":")) args = call_arguments(t.low, "");
    for (const Ex& e : args)
      if (!e.ok) return;
    const std::string text = call(t.raw, args, at);
    if (!text.empty()) emit(text + ";", at);
  }
  std::vector<Ex> call_arguments(const std::string& routine, const std::string& close) {
    std::vector<Ex> args;
    if (!close.empty() && accept(close)) return args;
    const Symbol* s = find(routine);
    do {
      const Symbol::Parameter* p =
          s && s->kind == Symbol::routine && args.size() < s->parameters.size()
              ? &s->parameters[args.size()]
              : nullptr;
      const Token first = peek();
      const std::size_t begin = at_;
      if (p && p->is_out && first.kind == Tk::name &&
          (is_global_here() || (find(first.low) && find(first.low)->kind != Symbol::routine))) {
        Ex e = place_here(true);
        if (is(",") || (!close.empty() && is(close)) || at_line_end()) {
          args.push_back(std::move(e));
          continue;
        }
        at_ = begin;
      }
      Ex e = expression();
      // A parameter becomes a target where a figure is given.
      if (p && p->type.k == K::pose && e.type.k == K::target) e = plain(e, first.at);
      args.push_back(std::move(e));
    } while (accept(",") && args.size() < 100);
    if (!close.empty()) expect(close);
    return args;
  }

  // ---- waits, signals and texts ----

  static std::optional<std::int64_t> io_number(const std::string& low) {
    if (low.size() < 3) return std::nullopt;
    for (std::size_t k = 2; k < low.size(); ++k)
      if (low[k] < '0' || low[k] > '9') return std::nullopt;
    return std::atoll(low.c_str() + 2);
  }
  /// IO[n], IO10, or IO[a To b] with its width.
  Symbol* io_here(const At& at, std::int64_t* width = nullptr) {
    const Token t = next();
    std::optional<std::int64_t> from = io_number(t.low), to;
    if (!from) {
      if (!expect("[")) return nullptr;
      const Ex a = as_integer(expression(), at);
      if (a.is_literal) from = static_cast<std::int64_t>(a.v);
      if (accept("to")) {
        const Ex b = as_integer(expression(), at);
        if (b.is_literal) to = static_cast<std::int64_t>(b.v);
        if (!b.is_literal) from.reset();
      }
      expect("]");
      if (!a.ok) return nullptr;
    }
    if (!from || *from < 0 || *from > 100'000 || (to && (*to < *from || *to - *from > 30))) {
      bad(at, "IRL has no signals with computed numbers, and at most 31 bits",
          "Give each of them a name.");
      return nullptr;
    }
    const std::int64_t w = to ? *to - *from + 1 : 1;
    if (to && !width) {
      bad(at, "several signals must be read with In and switched with Out");
      return nullptr;
    }
    if (width) *width = w;
    return &signal(outputs_.contains(*from), *from, w);
  }
  void switch_to(const Symbol& s, const Ex& to, const At& at) {
    if (!to.ok) return;
    if (s.kind != Symbol::output) {
      bad(at, "an input cannot be assigned");
      return;
    }
    emit(s.irl + " := " + to.s + ";", at);
  }
  void set_(const At& at) {
    const bool is_on = word_ == "set";
    if (peek().kind != Tk::name || !peek().low.starts_with("io")) {
      bad(at, "Set and Reset need IO[n]");
      return skip_rest();
    }
    std::int64_t width = 1;
    Symbol* s = io_here(at, &width);
    if (!s) return skip_rest();
    if (width > 1) {
      switch_to(*s, integer(is_on ? (std::int64_t{1} << width) - 1 : 0), at);
      return;
    }
    switch_to(*s, boolean(is_on), at);
    if (accept(",")) {
      const Ex ms = as_real(expression(), at);
      if (!ms.ok) return;
      emit("WAIT " + within(scaled(ms, 0.001), kSum) + " SEC;", at);
      switch_to(*s, boolean(!is_on), at);
      warn(at, "the IRL program waits for the end of this pulse; the controller continues");
    }
  }
  void out(const At& at) {
    std::int64_t width = 1;
    Symbol* s = io_here(at, &width);
    if (!expect("=")) return skip_rest();
    const Ex e = as_integer(expression(), at);
    if (!s || !e.ok) return;
    switch_to(*s, width == 1 ? converted(e, kBool, at) : e, at);
  }
  void in(const At& at) {
    const Ex to = place_here(true);
    const std::string low = last_key_;
    if (!expect("=")) return skip_rest();
    std::int64_t width = 1;
    Symbol* s = io_here(at, &width);
    if (!s || !to.ok) return;
    give(to, low, place(s->irl, s->type), at);
  }
  void wait(const At& at) {
    const Ex c = converted(expression(), kBool, at);
    std::string timeout;
    bool ok = c.ok;
    if (accept(",")) {
      const Ex ms = as_real(expression(), at);
      ok = ok && ms.ok;
      timeout = " TIMEOUT " + within(scaled_time(ms), kSum);
    }
    std::optional<Ex> seen;
    std::string low;
    if (accept(",")) {
      seen = place_here(true);
      low = last_key_;
      ok = ok && seen->ok;
    }
    if (!ok) return;
    emit("WAIT FOR " + c.s + timeout + ";", at);
    if (seen) give(*seen, low, value("NOT R_TIMEOUT", kBool, kNot), at);
  }
  /// Milliseconds; what was made of seconds is seconds again.
  static Ex scaled_time(const Ex& ms) {
    for (const char* tail : {" * 1000.0", " * 1000"})
      if (!ms.is_literal && ms.ok && ms.s.ends_with(tail))
        return value(ms.s.substr(0, ms.s.size() - std::string_view(tail).size()), kReal, kTerm);
    return scaled(ms, 0.001);
  }
  void delay(const At& at) {
    const Ex ms = as_real(expression(), at);
    if (ms.is_literal && ms.v < 0) bad(at, "a time must not be negative");
    else if (ms.ok) emit("WAIT " + within(scaled_time(ms), kSum) + " SEC;", at);
  }
  void hold(const At& at) {
    if (!at_line_end() && !is(":")) {
      const Ex e = expression();
      if (e.ok) emit("WRITELN(" + e.s + ");", at);
    }
    emit("PAUSE;", at);
  }
  void halt(const At& at) {
    if (!at_line_end() && !is(":")) {
      const Ex e = expression();
      if (e.ok) emit("WRITELN(" + e.s + ");", at);
    }
    emit("HALT;", at);
  }
  void print(const At& at) {
    std::string list;
    bool ok = true;
    while (!at_line_end() && !is(":")) {
      const Ex e = expression();
      ok = ok && e.ok;
      list += (list.empty() ? "" : ", ") + e.s;
      if (!accept(";") && !accept(",")) break;
    }
    if (ok) emit("WRITELN(" + (list.empty() ? "''" : list) + ");", at);
  }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    const auto is_place_of = [](const Ex& e) {
      return e.type.k == K::pose || e.type.k == K::target;
    };
    if (is_place_of(a) && is_place_of(b) && (op == Op::mul || op == Op::add || op == Op::sub))
      return bad(at, "positions must be combined with Dev and DevH");
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
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      e.is_grouped = true;
      return e;
    }
    if (const auto e = binary_here("&")) return *e;
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    if (t.low == "true" || t.low == "on") return next(), boolean(true);
    if (t.low == "false" || t.low == "off") return next(), boolean(false);
    if (t.low == "pi") return next(), real(3.141592653589793);
    if ((t.low == "io" && is("[", 1)) || (t.low.starts_with("io") && io_number(t.low))) {
      const Symbol* s = io_here(at);
      return s ? place(s->irl, s->type) : failed();
    }
    if (t.low == "curpos") return next(), present_target(at);
    if (t.low == "curjnt") return next(), present_joints();
    if (t.low == "destpos" || t.low == "destjnt") {
      next();
      return bad(at, "the robot's present position is not read", "Give the position itself.");
    }
    const Symbol* s = find(t.low);
    if (is_global_here() || (s && s->kind != Symbol::routine)) return place_here(false);
    if (s) {
      const Type result = s->type;
      next();
      std::vector<Ex> args;
      if (accept("(")) args = call_arguments(t.low, ")");
      for (const Ex& e : args)
        if (!e.ok) return failed();
      if (result.k == K::none) return bad(at, std::string(t.raw) + " returns no value");
      const std::string text = call(t.raw, args, at, result);
      return text.empty() ? failed() : value(text, result);
    }
    if (is("(", 1)) return function();
    next();
    return bad(at, "the name " + std::string(t.raw.substr(0, 40)) + " is not declared here",
               "Declare it with Dim; names in included files are unknown.");
  }
  /// P(x, y, z, RX, RY, RZ, figure): turns about the fixed x, y and z.
  Ex position_value(const std::vector<Ex>& given, const At& at) {
    std::vector<Ex> n = given;
    if (n.size() > 7) return bad(at, "a position must be six numbers and a figure");
    Ex figure = integer(-1);
    if (n.size() == 7) {
      figure = n[6];
      n.pop_back();
    }
    while (n.size() < 6) n.push_back(real(0));
    const Ex p = pose({n[0], n[1], n[2]}, orientation("ORIZYX", {n[5], n[4], n[3]}));
    if (!p.ok || !figure.ok) return failed();
    if (!figure.is_literal) return bad(at, "a computed figure is not read");
    const auto f = static_cast<std::int64_t>(figure.v);
    if (f < 0) return p;
    if (f > 31) return bad(at, "a figure must be from 0 to 31, or -1");
    const auto status = static_cast<std::int64_t>(
        (static_cast<unsigned>(f) & 7U) ^ (static_cast<unsigned>(params_.integer("fig_xor")) & 7U));
    // Joints 4 and 6 within half a turn (SINGLE), or beyond (DOUBLE) on a side that is not said.
    std::vector<Ex> turns(6, integer(-128));
    if (!(f & 8)) turns[3] = integer(0);
    if (!(f & 16)) turns[5] = integer(0);
    Ex e = target(p, integer(status), turns, {});
    if (e.ok) poses_.emplace(e.s, p.s);
    return e;
  }
  Ex function() {
    const Token t = next();
    const At at = t.at;
    next();
    const auto a = arguments();
    for (const Ex& e : a)
      if (!e.ok) return failed();
    const std::string& w = t.low;
    if (w == "p") return position_value(a, at);
    if (w == "j") {
      if (a.empty() || a.size() > 8) return bad(at, "there can be at most eight joint values");
      std::vector<Ex> axes;
      for (std::size_t k = 0; k < a.size(); ++k) {
        if (k >= 6 && !(a[k].is_literal && a[k].v == 0))
          return bad(at, "additional axes move by EXA", "Write EXA((7, value)).");
        if (k < 6) axes.push_back(as_real(a[k], at));
      }
      return joints(axes, {});
    }
    if (w == "v" && a.size() == 3) return position(a);
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},  {"cos", "COS"},    {"tan", "TAN"},    {"asin", "ASIN"}, {"acos", "ACOS"},
        {"atn", "ATAN"}, {"atn2", "ATAN2"}, {"sqr", "SQRT"},   {"exp", "EXP"},   {"log", "LN"},
        {"abs", "ABS"},  {"fix", "TRUNC"},  {"round", "ROUND"}};
    if (const auto it = kMath.find(w); it != kMath.end()) return math(it->second, a, at);
    if (w == "int" && a.size() == 1)
      return value(helper("floor") + "(" + as_real(a[0], at).s + ")", kInt);
    if (w == "raddeg" && a.size() == 1) return scaled(as_real(a[0], at), kDegree);
    if (w == "degrad" && a.size() == 1) return scaled(as_real(a[0], at), 1 / kDegree);
    if (w == "len" && a.size() == 1 && a[0].type.k == K::string)
      return value("LENGTH(" + a[0].s + ")", kInt);
    if ((w == "cint" || w == "clng") && a.size() == 1) return math("ROUND", a, at);
    if ((w == "cdbl" || w == "csng") && a.size() == 1) return as_real(a[0], at);
    if ((w == "p2t" || w == "t2p") && a.size() == 1) return plain(a[0], at);
    if (w == "j2p" && a.size() == 1 && a[0].type.k == K::joint) return as_pose(as_place(a[0]), at);
    if (w == "tinv" && a.size() == 1) {
      const Ex p = plain(a[0], at);
      return p.ok ? value("INV(" + p.s + ")", kPose) : p;
    }
    if (w == "devh" && a.size() == 2) {
      const Ex q = binary(Op::compose, plain(a[0], at), plain(a[1], at), at);
      return a[0].type.k == K::target ? with_pose(a[0], q) : q;
    }
    if (w == "dev" && a.size() == 2) {
      // By x, y, z along the axes of the work coordinate system.
      const Ex by = plain(a[1], at);
      if (!by.ok) return by;
      if (by.s.find("ORIZYX(0.0, 0.0, 0.0)") == std::string::npos)
        return bad(at, "Dev with a rotation is not read", "Use DevH, or give the position itself.");
      const std::string b = within(by, kPrimary);
      return offset(a[0].type.k == K::joint ? as_place(a[0]) : a[0], value(b + ".POS.X", kReal),
                    value(b + ".POS.Y", kReal), value(b + ".POS.Z", kReal), at);
    }
    if (w.size() == 4 && w.starts_with("pos") && w[3] >= 'x' && w[3] <= 'z' && a.size() == 1) {
      if (a[0].type.k == K::position)
        return value(within(a[0], kPrimary) + "." + static_cast<char>(w[3] - 32), kReal);
      const Ex p = plain(a[0], at);
      if (!p.ok) return p;
      return value(within(p, kPrimary) + ".POS." + static_cast<char>(w[3] - 32), kReal);
    }
    if ((w == "posrx" || w == "posry" || w == "posrz") && a.size() == 1) {
      const Ex p = plain(a[0], at);
      if (!p.ok) return p;
      return value(std::string("ANGLE") + static_cast<char>(w[4] - 32) + "('ZYX', " +
                       within(p, kPrimary) + ".ORI)",
                   kReal);
    }
    if (w == "joint" && a.size() == 2 && a[0].is_literal && a[1].type.k == K::joint &&
        a[0].v >= 1 && a[0].v <= 6)
      return value(within(a[1], kPrimary) + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") +
                       std::to_string(static_cast<int>(a[0].v)),
                   kReal);
    if (w == "dist" && a.size() == 2) {
      const Ex x = plain(a[0], at), y = plain(a[1], at);
      if (!x.ok || !y.ok) return failed();
      return value(
          helper("distance") + "(" + within(x, kPrimary) + ".POS, " + within(y, kPrimary) + ".POS)",
          kReal);
    }
    if (w == "not" && a.size() == 1) {
      const Ex b = converted(a[0], kBool, at);
      return b.ok ? value("NOT " + within(b, kRel), kBool, kNot) : b;
    }
    return bad(at, std::string(t.raw.substr(0, 40)) +
                       " is a controller function or not in this file, and is not read");
  }

  std::set<std::int64_t> outputs_;
  std::set<std::string> unvalued_, parameters_, elements_;  ///< elements_: P10, I1 and so on
  std::vector<std::pair<std::string, std::string>> loops_;  ///< kind, and the step of a For
  std::map<std::string, std::string> chosen_;               ///< numbers of tool and frame
  std::map<std::string, std::string> poses_;                ///< of targets that are written out
  std::map<std::string, bool> said_;
  std::string word_, goal_, function_, routine_, last_key_;
  bool is_announcing_ = false, has_main_ = false;
  int nested_ = 0;
};

}  // namespace

Made read_pacscript(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<PacReader>(task, params, progress);
}

}  // namespace robomosp::readers

// SPDX-License-Identifier: Apache-2.0
// KUKA KRL: modules of .src and .dat.
#include <algorithm>
#include <cmath>

#include "krl_backup.h"
#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

// Comparisons bind tighter than AND here, as their writers mean them; see special().
constexpr Binary kKrlBinaries[] = {
    {"or", 10, Op::or_},      {"exor", 11, Op::exor},  {"and", 12, Op::and_}, {"b_or", 10, Op::or_},
    {"b_exor", 11, Op::exor}, {"b_and", 12, Op::and_}, {"==", 20, Op::eq},    {"<>", 20, Op::ne},
    {"<", 20, Op::lt},        {">", 20, Op::gt},       {"<=", 20, Op::le},    {">=", 20, Op::ge},
    {"+", 30, Op::add},       {"-", 30, Op::sub},      {"*", 40, Op::mul},    {"/", 40, Op::div},
    {":", 50, Op::compose}};

constexpr const char* kRoutine = "A routine begins with DEF name( ) and ends with END.";

class KrlReader final : public Reader {
 public:
  using Reader::Reader;

  [[nodiscard]] MakerLanguage language() const override { return MakerLanguage::krl; }

  void run() override {
    name_ = std::string(stem(files_[0].name));
    // Data first, so that the program finds them declared: what is global before what uses it.
    for (const bool is_config : {true, false})
      for (std::size_t f = 0; f < files_.size(); ++f)
        if (is_data(f) && (!backup_.is_own(f)) == is_config) data_file(f);
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (!is_data(f) && !backup_.is_submit(f)) announce_all(f);
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (!is_data(f) && !backup_.is_submit(f)) source_file(f);
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (backup_.is_submit(f)) submit_file(f);
    if (!headers_.empty() && main_name_.empty() && !is_data(0))
      note(headers_[0].at,
           "the first routine, " + headers_[0].name +
               ", takes or gives values, so that the program does nothing by itself",
           "Read the program that calls it, or call it behind BEGIN.");
  }

 private:
  struct Header {
    std::string name;
    std::vector<Parameter> parameters;
    Type result;
    bool is_main = false;
    At at;
  };

  std::span<const Binary> binaries() const override { return kKrlBinaries; }
  int turns_from() const override { return 0; }
  std::string setting_name(const std::string& key) const override {
    if (key == "frame") return "$BASE";
    if (key == "tool") return "$TOOL";
    std::string s = "$APO." + key.substr(4);
    for (char& c : s)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return s;
  }
  std::string_view not_word() const override { return "not"; }
  int not_precedence() const override { return 60; }
  bool divides_whole() const override { return true; }

  void skip_condition() override {
    while (!at_line_end() && !is("then")) next();
  }
  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    const bool joins = op == Op::and_ || op == Op::or_ || op == Op::exor;
    for (const Ex* e : {&a, &b})
      if (joins && e->prec == kRel && !e->is_grouped) {
        // Both readings are possible where truth values are compared.
        if (e->of_truths)
          return bad(at, "a comparison of truth values next to AND or OR has no parentheses",
                     "The controller evaluates AND and OR before comparisons. Add parentheses.");
      }
    return std::nullopt;
  }

  // ---- declarations ----

  std::optional<Type> type_named(const std::string& low) {
    if (low == "int") return kInt;
    if (low == "real") return kReal;
    if (low == "bool") return kBool;
    if (low == "char") return Type{.k = K::character, .record = {}, .bounds = {}, .element = {}};
    if (low == "frame") return kPose;
    if (low == "pos" || low == "e6pos" || low == "e3pos") return kTarget;
    if (low == "axis" || low == "e6axis" || low == "e3axis") return kJoint;
    if (const auto it = types_named_.find(low); it != types_named_.end()) return it->second;
    return std::nullopt;
  }
  bool begins_declaration() {
    std::size_t i = 0;
    while (is("decl", i) || is("global", i) || is("const", i) || is("public", i)) ++i;
    if (is("signal", i) || is("struc", i) || is("enum", i) || is("ext", i) || is("extfct", i) ||
        is("import", i))
      return true;
    if (i > 0 && (is("interrupt", i) || is("def", i) || is("deffct", i))) return false;
    if (i > 0) return true;
    return peek().kind == Tk::name && type_named(peek().low) && peek(1).kind == Tk::name;
  }
  void declaration(bool is_in_data) {
    bool is_constant = false;
    const At from = here();
    for (;;) {
      if (accept("decl") || accept("global") || accept("public")) continue;
      if (accept("const")) {
        is_constant = true;
        continue;
      }
      break;
    }
    if (accept("ext") || accept("extfct") || accept("import")) {
      skip_rest();
      return;
    }
    if (accept("struc")) return structure();
    if (accept("enum")) {
      const Token name = next();
      types_named_[name.low] = kInt;
      // One number for each name: a name that two types have is the same value in both.
      do {
        const Token one = next();
        if (one.kind != Tk::name) {
          bad(one.at, "the name of a value is expected here");
          return;
        }
        if (globals_.contains("#" + one.low)) continue;
        Symbol& s = declare("#" + one.low, kInt, Symbol::constant);
        constants_.push_back(
            {"INT: " + s.irl + " := " + std::to_string(++enumerators_) + ";", one.at, true});
      } while (accept(","));
      return;
    }
    if (accept("signal")) return signal_declaration();
    const Token type_token = next();
    const auto type = type_named(type_token.low);
    if (!type) return system_data(type_token, from);
    do {
      const Token name = next();
      if (name.kind != Tk::name) {
        bad(name.at, "the name of a variable is expected here");
        return;
      }
      Type t = *type;
      if (accept("[")) {
        std::vector<std::pair<std::int64_t, std::int64_t>> bounds;
        while (!at_line_end() && !is("]")) {
          if (is(",")) {
            next();
            continue;
          }
          const Ex n = expression();
          const double size = n.is_literal ? n.v : known_integer(n);
          if (!(size >= 1 && size <= 100000)) {
            bad(from, "the size of the array " + std::string(name.raw) + " is not known");
            return;
          }
          bounds.emplace_back(1, static_cast<std::int64_t>(size));
        }
        expect("]");
        if (t.k == K::character) t = kString;
        else if (!bounds.empty()) t = array_of(t, bounds);
        else if (current().symbols.contains(name.low)) continue;  // a parameter of open size
      }
      const bool is_local = !is_in_data && !is_in_main();
      if (is_local && current().symbols.contains(name.low)) continue;  // a parameter
      std::string text;
      if (accept("=")) {
        want_ = t;
        is_bare_ = false;
        const Ex e = converted(expression(), t, name.at);
        want_.reset();
        if (!e.ok) return;
        if (!is_local && calls_routine(e.s)) {
          bad(name.at, "a function call is not read in a declaration",
              "Assign it at the start of the program.");
          return;
        }
        text = e.s;
        if (is_bare_ && !is_local && (t.k == K::pose || t.k == K::target)) bare_.insert(name.low);
        if (is_constant && t.k == K::integer) known_[name.low] = e.v;
        is_constant = is_constant && e.is_constant;
      } else {
        is_constant = false;
      }
      if (!is_local && globals_.contains(name.low)) {
        bad(name.at, std::string(name.raw) + " is declared twice");
        return;
      }
      Symbol& s = declare(name.raw, t,
                          is_constant && !is_local ? Symbol::constant : Symbol::variable, is_local);
      declare_variable(s, text, from, is_local);
    } while (accept(","));
  }
  double known_integer(const Ex& e) const {
    for (const auto& [low, v] : known_) {
      const auto it = globals_.find(low);
      if (it != globals_.end() && it->second.irl == e.s) return v;
    }
    return -1;
  }
  void structure() {
    const Token name = next();
    Type t;
    t.k = K::record;
    t.record = irl_name(name.raw);
    std::string fields;
    auto& known = records_[t.record];
    do {
      if (const auto of = type_named(peek().low); of && peek(1).kind == Tk::name) {
        field_type_ = *of;
        next();
      } else if (known.empty()) {
        bad(here(), "IRL has no type " + std::string(peek().raw.substr(0, 40)));
        return;
      }
      const Token field = next();
      Type of = field_type_;
      if (accept("[")) {
        const Ex n = at_line_end() || is("]") ? integer(80) : expression();
        expect("]");
        of = of.k == K::character
                 ? kString
                 : array_of(of, {{1, std::max<std::int64_t>(
                                         1, std::min<std::int64_t>(
                                                100000, static_cast<std::int64_t>(n.v)))}});
      }
      known.emplace_back(field.low, of);
      fields += " " + type_text(of) + ": " + field_name(field.low) + ";";
    } while (accept(","));
    types_.push_back({"RECORD" + fields + " ENDRECORD: " + t.record + ";", name.at, true});
    types_named_[name.low] = t;
  }
  static std::string field_name(const std::string& low) { return "f_" + low; }
  void signal_declaration() {
    const Token name = next();
    const Token what = next();
    const bool is_out = what.low == "$out", is_in = what.low == "$in";
    if (!is_out && !is_in) {
      bad(what.at, "signals of " + std::string(what.raw.substr(0, 40)) + " are not read",
          "Only those of $IN and $OUT are.");
      return;
    }
    expect("[");
    const Ex a = expression();
    expect("]");
    std::int64_t width = 1;
    if (accept("to")) {
      next();
      expect("[");
      const Ex b = expression();
      expect("]");
      width = static_cast<std::int64_t>(b.v - a.v + 1);
    }
    if (!a.is_literal || a.v < 0 || a.v > 1e6 || width < 1 || width > 32) {
      bad(name.at, "the numbers of this signal are not a range of 1 to 32 signals");
      return;
    }
    const std::string place =
        (is_out ? "out " : "in ") + std::to_string(a.v) + " " + std::to_string(width);
    if (globals_.contains(name.low)) {
      if (signal_places_[name.low] != place)
        bad(name.at, std::string(name.raw) + " is declared twice");
      return;
    }
    signal_places_[name.low] = place;
    Symbol& s =
        declare(name.raw, width > 1 ? kInt : kBool, is_out ? Symbol::output : Symbol::input);
    signals_.push_back({std::string(is_out ? "OUTPUT " : "INPUT ") + type_text(s.type) + ": " +
                            s.irl + " AT " + std::to_string(static_cast<std::int64_t>(a.v)) +
                            (width > 1 ? ", " + std::to_string(width) : "") + ";",
                        name.at, true});
  }
  /// DECL FDAT and the like: what inline forms keep.
  void system_data(const Token& type, const At& from) {
    const Token name = next();
    if (type.low == "fdat" || type.low == "pdat" || type.low == "ldat") {
      Symbol s;
      s.kind = Symbol::data;
      if (accept("=") && is("{")) s.fields = aggregate();
      globals_.insert_or_assign(name.low, std::move(s));
      return;
    }
    skip_rest();
    note(from, "IRL has no type " + std::string(type.raw) + "; " + std::string(name.raw) +
                   " is left out");
  }

  // ---- files ----

  void end_line() {
    if (!at_line_end())
      bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
  }
  void line(const std::function<void()>& read) {
    const At from = here();
    statement(from, [&] {
      read();
      end_line();
    });
    skip_line();
  }
  bool is_data(std::size_t f) const { return extension(files_[f].name) == "dat"; }
  void scan_file(std::size_t f) {
    const std::size_t kept = fault_count();
    scan(f, kKrlStyle);
    if (!backup_.is_own(f)) {
      // What is wrong with text that the program does not use is not reported.
      std::set<std::uint32_t> lines;
      if (is_data(f))
        for (const Token& t : tokens_)
          if (backup_.lines(f).contains(t.at.begin)) lines.insert(t.at.line);
      drop_faults(kept, [&](const At& at) {
        return at.file == f &&
               !(is_data(f) ? lines.contains(at.line) : backup_.is_in_used(f, at.begin));
      });
    }
    backup_.give_new_names(f, tokens_);
  }
  void data_file(std::size_t f) {
    const bool is_config = !backup_.is_own(f);
    const std::set<std::uint32_t>& used = backup_.lines(f);
    scan_file(f);
    next_comment_ = comments_.size();
    while (!at_end()) {
      if (peek().kind == Tk::line || is("&") || is("defdat") || is("enddat") ||
          (is_config && !used.contains(here().begin))) {
        skip_line();
        continue;
      }
      line([&] {
        if (begins_declaration() || (peek().kind == Tk::name && peek(1).kind == Tk::name))
          declaration(true);
        else assignment();
      });
    }
  }
  std::optional<Header> header() {
    std::size_t i = 0;
    if (is("global", i)) ++i;
    if (!is("def", i) && !is("deffct", i)) return std::nullopt;
    Header h;
    h.at = here();
    accept("global");
    const bool is_function = next().low == "deffct";
    accept("global");
    if (is_function) {
      const Token t = next();
      h.result = type_named(t.low).value_or(kReal);
      if (accept("[")) {  // a text of so many characters
        while (!at_line_end() && !accept("]")) next();
        if (h.result.k == K::character) h.result = kString;
        else fail(t.at, "IRL has no functions that return arrays");
      }
      if (!type_named(t.low))
        fail(t.at,
             "IRL has no type " + std::string(t.raw.substr(0, 40)) + "; REAL is used instead");
    }
    h.name = std::string(next().raw);
    if (accept("(")) {
      while (!at_line_end() && !is(")")) {
        Parameter p;
        p.foreign = std::string(next().raw);
        p.type = kReal;
        bool is_list = accept("[");
        while (is_list && !at_line_end() && !accept("]")) next();
        if (accept(":")) p.is_out = next().low == "out";
        h.parameters.push_back(std::move(p));
        if (!accept(",")) break;
      }
      accept(")");
    }
    skip_line();
    // Their types are declared in the routine.
    const std::size_t back = at_;
    for (std::size_t lines = 0;
         lines < 300 && !at_end() && !is("end") && !is("endfct") && !is("def") && !is("deffct");
         ++lines) {
      if (!begins_declaration()) {
        skip_line();
        continue;
      }
      while (accept("decl") || accept("global")) {
      }
      const auto t = type_named(peek().low);
      if (t) {
        next();
        while (!at_line_end()) {
          const Token name = next();
          for (Parameter& p : h.parameters) {
            if (lower(p.foreign) != name.low || name.kind != Tk::name) continue;
            p.type = *t;
            if (is("[") && t->k == K::character) p.type = kString;
            else if (is("[") && peek(1).kind == Tk::number)
              p.type = array_of(
                  *t, {{1, std::max<std::int64_t>(
                               1, static_cast<std::int64_t>(std::min(peek(1).value, 1e5)))}});
          }
        }
      }
      skip_line();
    }
    at_ = back;
    return h;
  }
  bool is_header() const {
    const std::size_t i = is("global") ? 1 : 0;
    return is("def", i) || is("deffct", i);
  }
  void announce_all(std::size_t f) {
    scan_file(f);
    // Types and constants of headers come first.
    while (!at_end()) {
      if (is_header() && !backup_.is_used(f, here().begin)) {
        skip_line();
        continue;
      }
      auto h = header();
      if (!h) {
        skip_line();
        continue;
      }
      h->is_main = f == 0 && headers_.empty() && h->parameters.empty() && h->result.k == K::none;
      if (!h->is_main) announce(h->name, h->parameters, h->result);
      else main_name_ = lower(h->name);
      look_for_stop(lower(h->name));
      headers_.push_back(std::move(*h));
    }
  }
  /// A motion that a condition ends has a routine of its own, INTERRUPT ON before it and nothing
  /// that moves behind it, and the interrupt's is BRAKE and RESUME. The body begins here.
  void look_for_stop(const std::string& name) {
    std::vector<std::vector<std::string>> lines;
    std::vector<std::string> words;
    for (std::size_t i = at_; lines.size() < 8; ++i) {
      const Token& t = tokens_[i];
      if (t.kind != Tk::line && t.kind != Tk::end) {
        if (words.size() < 64) words.push_back(lower(t.raw));
        continue;
      }
      if (!words.empty()) {
        if (words[0] == "end" || words[0] == "def" || words[0] == "deffct") break;
        lines.push_back(std::exchange(words, {}));
      }
      if (t.kind == Tk::end) break;
    }
    const auto is_line = [&](std::size_t k, std::initializer_list<const char*> wanted) {
      return k < lines.size() && lines[k].size() >= wanted.size() &&
             std::equal(wanted.begin(), wanted.end(), lines[k].begin());
    };
    if (lines.size() == 2 && lines[0][0] == "brake" && is_line(1, {"resume"})) {
      stops_.insert(name);
      return;
    }
    if (!is_line(0, {"interrupt", "on"}) || lines[0].size() != 3) return;
    std::size_t k = 1;
    const bool has_if = is_line(k, {"if", "not", "("});
    if (has_if && lines[k].back() != "then") return;
    k += has_if;
    if (k >= lines.size()) return;
    const std::string& word = lines[k][0];
    if (word != "ptp" && word != "lin" && word != "circ" && word != "ptp_rel" &&
        word != "lin_rel" && word != "circ_rel" && word != "sptp" && word != "slin" &&
        word != "scirc")
      return;
    ++k;
    if (has_if && !is_line(k++, {"endif"})) return;
    if (is_line(k, {"wait", "sec"}) && (lines[k].back() == "0" || lines[k].back() == "0.0")) ++k;
    if (is_line(k, {"interrupt", "off"})) ++k;
    if (k == lines.size()) moves_.insert_or_assign(name, StoppedMove{lines[0][2], {}});
  }
  /// Folds of the editor: their title is what people see.
  void tidy_comments() {
    for (Comment& c : comments_) {
      if (const std::size_t meta = c.text.find(";%"); meta != std::string::npos)
        c.text.resize(meta);
      const std::size_t b = c.text.find_first_not_of(" \t");
      const std::string low = lower(c.text);
      if (b != std::string::npos && low.compare(b, 7, "endfold") == 0) c.text.clear();
      else if (b != std::string::npos && low.compare(b, 5, "fold ") == 0) c.text.erase(0, b + 5);
    }
  }
  /// The submit interpreter runs beside the program and is not read; what it sets, the program may
  /// not rely on.
  void submit_file(std::size_t f) {
    const std::size_t kept = fault_count();
    scan(f, kKrlStyle);
    drop_faults(kept, [](const At&) { return true; });
    const KrlFile& names = backup_.names(f);
    const auto is_local = [&](const std::string& low) {
      return std::any_of(names.routines.begin(), names.routines.end(),
                         [&](const KrlRoutine& r) { return r.locals.contains(low); });
    };
    note(here(), files_[f].name.empty()
                     ? std::string()
                     : std::string(files_[f].name) +
                           " runs beside the program on the controller, and is not read");
    while (!at_end()) {
      const Token t = peek();
      std::size_t i = t.low == "pulse" && is("(", 1) ? 2 : 0;
      const bool is_pulse = i > 0;
      if (peek(i).kind == Tk::name && !is_local(peek(i).low)) {
        std::string name = peek(i).low;
        std::string shown(peek(i).raw);
        ++i;
        if (is("[", i) && peek(i + 1).kind == Tk::number && is("]", i + 2)) {
          if (name.starts_with("$")) name += "[" + std::string(peek(i + 1).raw) + "]";
          shown += "[" + std::string(peek(i + 1).raw) + "]";
          i += 3;
        }
        while (is(".", i) && peek(i + 1).kind == Tk::name) i += 2;
        if ((is_pulse || is("=", i)) && backup_.uses(name))
          fail(t.at, "the submit interpreter sets " + shown + " here while the program runs",
               "Write a PROCESS in the IRL that does the same, or take " + shown +
                   " out of the program.");
      }
      skip_line();
    }
  }
  /// Passes a routine that the program does not use.
  void skip_routine() {
    do {
      skip_line();
    } while (!at_end() && !is("end") && !is("endfct") && !is_header());
    while (next_comment_ < comments_.size() && comments_[next_comment_].line <= here().line)
      ++next_comment_;
    if (!is_header()) skip_line();
  }
  void source_file(std::size_t f) {
    scan_file(f);
    tidy_comments();
    bool is_open = false, is_main = false;
    while (!at_end()) {
      if (progress_.cancelled()) {
        statement(here(), [] {});
        return;
      }
      if (peek().kind == Tk::line || is("&")) {
        skip_line();
        continue;
      }
      if (is_header()) {
        const At at = here();
        if (!is_open && !backup_.is_used(f, at.begin)) {
          skip_routine();
          continue;
        }
        (void)header();
        if (is_open) fail(at, "the previous routine has no END");
        if (next_header_ >= headers_.size()) return;
        const Header& h = headers_[next_header_++];
        is_open = true;
        is_main = h.is_main;
        blocks_.clear();
        routine_name_ = lower(h.name);
        is_stop_if_ = false;
        if (is_main) close();
        else begin(h.name, h.parameters, h.result, h.at);
        if (is_main) name_ = h.name;
        current().indent = 1;
        continue;
      }
      if (is("end") || is("endfct")) {
        comments_until(here());
        close_blocks(here());
        if (!is_open && backup_.is_own(f)) fail(here(), "END is outside a routine", kRoutine);
        is_open = false;
        close();
        skip_line();
        continue;
      }
      if (!is_open) {
        if (backup_.is_own(f)) fail(here(), "this is outside a routine", kRoutine);
        skip_line();
        continue;
      }
      line([&] { one(); });
    }
    close_blocks(here());
    if (is_open) fail(here(), "the last routine has no END");
    close();
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (begins_declaration()) return declaration(false);
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      return;
    }
    if (is(":", 1) && t.low.front() != '$') {
      next();
      next();
      place_label(t.raw, at);
      return;
    }
    static const std::map<std::string, void (KrlReader::*)(const At&), std::less<>> kWords{
        {"ptp", &KrlReader::motion},
        {"lin", &KrlReader::motion},
        {"circ", &KrlReader::motion},
        {"sptp", &KrlReader::motion},
        {"slin", &KrlReader::motion},
        {"scirc", &KrlReader::motion},
        {"ptp_rel", &KrlReader::motion},
        {"lin_rel", &KrlReader::motion},
        {"circ_rel", &KrlReader::motion},
        {"sptp_rel", &KrlReader::motion},
        {"slin_rel", &KrlReader::motion},
        {"if", &KrlReader::if_},
        {"else", &KrlReader::else_},
        {"endif", &KrlReader::end_},
        {"for", &KrlReader::for_},
        {"endfor", &KrlReader::end_},
        {"while", &KrlReader::while_},
        {"endwhile", &KrlReader::end_},
        {"repeat", &KrlReader::repeat},
        {"until", &KrlReader::until},
        {"loop", &KrlReader::loop},
        {"endloop", &KrlReader::end_},
        {"switch", &KrlReader::switch_},
        {"case", &KrlReader::case_},
        {"default", &KrlReader::default_},
        {"endswitch", &KrlReader::end_},
        {"exit", &KrlReader::exit},
        {"goto", &KrlReader::goto_},
        {"wait", &KrlReader::wait},
        {"halt", &KrlReader::halt},
        {"return", &KrlReader::return_},
        {"continue", &KrlReader::continue_},
        {"interrupt", &KrlReader::interrupt},
        {"global", &KrlReader::interrupt},
        {"pulse", &KrlReader::pulse},
        {"brake", &KrlReader::brake},
        {"resume", &KrlReader::resume},
        {"trigger", &KrlReader::no_counterpart},
        {"anin", &KrlReader::no_counterpart},
        {"anout", &KrlReader::no_counterpart},
        {"spline", &KrlReader::no_counterpart},
        {"endspline", &KrlReader::no_counterpart},
        {"spl", &KrlReader::no_counterpart}};
    const auto it = kWords.find(t.low);
    if (it != kWords.end() && !is("=", 1) && !is("[", 1)) {
      next();
      word_ = t.low;
      (this->*it->second)(at);
      return;
    }
    if (t.low == "bas" && is("(", 1)) return bas(at);
    if (is("(", 1) && !is("$", 0)) {
      next();
      next();
      const auto args = arguments();
      routine_call(t, args, at);
      return;
    }
    if (peek(1).kind == Tk::line || peek(1).kind == Tk::end) {
      next();
      routine_call(t, {}, at);
      return;
    }
    assignment();
  }
  /// A name that another file of the backup has for itself. True = that is reported.
  bool is_hidden(const Token& t) {
    const std::size_t dot = t.raw.find('.');
    if (dot == std::string_view::npos || find(t.low)) return false;
    bad(t.at,
        std::string(t.raw.substr(0, dot)) +
            " is declared in another file, which keeps it to "
            "itself",
        "There, a routine needs GLOBAL DEF, and data need DECL GLOBAL in a DEFDAT name PUBLIC.");
    return true;
  }
  void routine_call(const Token& name, const std::vector<Ex>& args, const At& at) {
    if (is_hidden(name)) return;
    if (name.low == main_name_) {
      bad(at, "the program calls itself", "Move the called statements into a separate routine.");
      return;
    }
    if (!find(name.low) && (name.low.starts_with("msg_") || name.low == "opt_move")) {
      left_out(RMP_FAULT_WARNING, at, std::string(name.raw) + " is a message of the controller");
      return;
    }
    if (const auto it = moves_.find(name.low); it != moves_.end())
      if (const auto until = untils_.find(it->second.number); until != untils_.end()) {
        if (!it->second.until.empty() && it->second.until != until->second) {
          bad(at, std::string(name.raw) + " is ended by two conditions",
              "Give each motion a separate routine.");
          return;
        }
        it->second.until = until->second;
      }
    const std::string text = call(name.raw, args, at);
    if (!text.empty()) emit(text + ";", at);
  }
  /// The routine that is read is one of a motion that a condition ends; the condition, else "".
  std::string stopped_by() const {
    const auto it = moves_.find(routine_name_);
    return it == moves_.end() ? std::string() : it->second.until;
  }
  void resume(const At& at) {
    if (stops_.contains(routine_name_)) return note_line(at, "UNTIL at the motion says it");
    skip_rest();
    bad(at, "RESUME leaves the routines in between, which IRL does not support",
        "BRAKE and RESUME alone in the routine, and one motion in the routine that switches the "
        "interrupt on, are read as UNTIL.");
  }
  void no_counterpart(const At& at) {
    skip_rest();
    bad(at, "IRL has no counterpart of this statement");
  }

  void bas(const At& at) {
    next();
    next();
    accept("#");
    const Token what = next();
    Ex v = real(0);
    if (accept(",")) v = expression();
    expect(")");
    if (!v.ok) return;
    if (what.low == "#initmov" || what.low == "initmov") {
      if (globals_.contains("tool_data") && !learned_.types.contains("tool_data")) {
        // With the values that $config.dat has.
        const auto known = [&](const char* name) -> std::optional<Ex> {
          const auto it = globals_.find(name);
          if (it == globals_.end() || !is_number(it->second.type)) return std::nullopt;
          return place(it->second.irl, it->second.type);
        };
        if (const auto e = known("def_vel_ptp")) set_variable("R_SPEED_PTP", *e, at);
        if (const auto e = known("def_vel_cp")) set_variable("R_SPEED", scaled(*e, 1000), at);
        if (const auto e = known("def_vel_ori1")) set_variable("R_SPEED_ORI", *e, at);
        for (const auto& [name, key] :
             {std::pair{"def_apo_cptp", "apo_cptp"}, std::pair{"def_apo_cdis", "apo_cdis"},
              std::pair{"def_apo_cvel", "apo_cvel"}})
          if (const auto e = known(name)) set(key, as_real(*e, at), at);
        set("tool", numbered("tool_data", integer(1), at), at);
        set("frame", identity(), at);
      }
      note_line(at, "initialises the motions; values missing in $config.dat keep IRL's defaults");
    } else if (what.low == "vel_ptp") {
      set_variable("R_SPEED_PTP", v, at);
    } else if (what.low == "vel_cp") {
      set_variable("R_SPEED", scaled(v, 1000), at);
    } else if (what.low == "ptp_params" || what.low == "ptp_dat") {
      if (pdat_) take_data(*pdat_, true, what.low == "ptp_dat", at);
      if (what.low == "ptp_params") {
        set_variable("R_SPEED_PTP", v, at);
        if (fdat_) frames(at);
      }
    } else if (what.low == "cp_params" || what.low == "cp_dat") {
      if (ldat_) take_data(*ldat_, false, what.low == "cp_dat", at);
      if (what.low == "cp_params") {
        set_variable("R_SPEED", scaled(v, 1000), at);
        if (fdat_) frames(at);
      }
    } else if (what.low == "acc_ptp") {
      set_variable("R_ACC_PTP", v, at);
    } else if (what.low == "acc_cp") {
      set_variable("R_ACC", v, at);  // in % of DEF_ACC_CP
    } else if (what.low == "tool" || what.low == "base") {
      numbered_frame(what.low == "tool", v, at);
    } else if (what.low == "frames") {
      if (!fdat_) {
        bad(at, "no FDAT_ACT is set before this");
        return;
      }
      frames(at);
    } else {
      bad(at, "BAS(#" + std::string(what.raw) + ") is not known");
    }
  }
  /// FHOME and PDEFAULT of $config.dat, which every program of inline forms begins with: where that
  /// file is missing, what they set is unknown.
  std::map<std::string, Symbol>::iterator delivered_data(const Token& name) {
    Symbol s;
    s.kind = Symbol::data;
    if (name.low != "fhome" && name.low != "pdefault" && name.low != "ldefault")
      return globals_.end();
    s.fields = {{"!unknown", integer(0)}};
    note(name.at, std::string(name.raw) +
                      " is in $config.dat, which is not among the files; its settings are unknown "
                      "from here on");
    return globals_.emplace(name.low, std::move(s)).first;
  }
  /// Speed, acceleration and approximation of PDAT_ACT or LDAT_ACT.
  void take_data(const std::string& name, bool is_ptp, bool with_speed, const At& at) {
    const auto fields = globals_.at(name).fields;
    const auto has = [&](const char* key) -> const Ex* {
      const auto it = fields.find(key);
      return it == fields.end() ? nullptr : &it->second;
    };
    if (const Ex* e = has("ori_typ"); e && !is_ptp && e->s != "#var") {
      bad(at, "IRL rotates the tool evenly along a path (ORI_TYP #VAR)");
      return;
    }
    if (has("!unknown")) {
      forget(is_ptp ? "apo_cptp" : "apo_cdis", at);
      return;
    }
    const Ex* mode = has("apo_mode");
    const bool is_distance = !is_ptp || (mode && mode->s == "#cdis");
    if (const Ex* e = has("apo_dist")) {
      Ex x = as_real(*e, at);
      if (!is_distance && x.is_literal && x.v > 100) x = real(100);
      set(is_distance ? "apo_cdis" : "apo_cptp", x, at);
    }
    if (const Ex* e = has("vel"); e && with_speed)
      set_variable(is_ptp ? "R_SPEED_PTP" : "R_SPEED", is_ptp ? *e : scaled(*e, 1000), at);
    const char* acc = is_ptp ? "R_ACC_PTP" : "R_ACC";
    if (const Ex* e = has("acc"); e && e->ok && is_number(e->type)) {
      // 100 % is so in IRL, where nothing else was set.
      if (!e->is_literal || e->v != 100) learned_.flags.insert(acc);
      if (learned_.flags.contains(acc)) set_variable(acc, *e, at);
    }
  }
  void frames(const At& at) {
    const auto fields = globals_.at(*fdat_).fields;
    if (const auto it = fields.find("ipo_frame"); it != fields.end() && it->second.s != "#base") {
      bad(at, "IRL has no stationary tools (IPO_FRAME)");
      return;
    }
    if (fields.contains("!unknown")) {
      forget("tool", at);
      forget("frame", at);
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    for (const auto& [key, is_tool] : {std::pair{"tool_no", true}, std::pair{"base_no", false}})
      if (const auto it = fields.find(key); it != fields.end())
        numbered_frame(is_tool, it->second, at);
  }
  void numbered_frame(bool is_tool, const Ex& n, const At& at) {
    if (n.is_literal && n.v == 0) {
      set(is_tool ? "tool" : "frame", identity(), at);
      return;
    }
    set(is_tool ? "tool" : "frame", numbered(is_tool ? "tool_data" : "base_data", n, at), at);
  }
  Ex numbered(const std::string& array, const Ex& index, const At& at) {
    if (index.is_literal && (index.v < 1 || index.v > 64))
      return bad(at, array + " has no number " + index.s);
    if (!globals_.contains(array) || learned_.types.contains(array))
      learn(array,
            array_of(kPose, {{1, index.is_literal ? static_cast<std::int64_t>(index.v) : 32}}));
    if (!globals_.contains(array)) {
      Symbol& s = declare(array, learned_.types[array]);
      declare_variable(s, {}, at);
      fail(at, array + " is in $config.dat, which is not among the files; its frames are zero here",
           "Give them their values at the declaration of " + s.irl + ".");
    }
    const Ex i = as_integer(index, at);
    if (const Type& t = globals_.at(array).type;
        t.k != K::array || t.bounds.size() != 1 || *t.element != kPose)
      return bad(at, array + " is not a list of frames");
    else if (i.is_literal && i.v > static_cast<double>(t.bounds[0].second))
      return bad(at, array + " has no number " + i.s);
    return place(globals_.at(array).irl + "[" + i.s + "]", kPose);
  }
  void set_variable(const char* name, const Ex& e, const At& at) {
    const Ex x = as_real(e, at);
    if (x.is_literal && x.v <= 0) {
      bad(at, "this is not a speed");
      return;
    }
    if (x.ok) emit(std::string(name) + " := " + x.s + ";", at);
  }

  void motion(const At& at) {
    const bool is_relative = word_.ends_with("_rel");
    std::string_view word = word_;
    if (is_relative) word.remove_suffix(4);
    if (word[0] == 's') word.remove_prefix(1);
    Motion m;
    m.word = word == "ptp" ? "PTP" : word == "lin" ? "LIN" : "CIRCLE";
    m.is_incremental = is_relative;
    if ((peek().low == "$pos_act" || peek().low == "$axis_act") && peek(1).kind != Tk::sign) {
      next();
      while (!at_line_end()) next();
      note_line(at, "it moves to its present position, so it is left out");
      return;
    }
    m.targets.push_back(target_of(is_relative, at));
    if (word == "circ") {
      expect(",");
      m.targets.push_back(target_of(is_relative, at));
      if (accept(",")) {
        bad(at, "IRL has no angle of an arc (CA)", "Compute the end of the arc.");
        skip_rest();
        return;
      }
    }
    with_apo_.reset();
    is_with_reported_ = false;
    std::string near;
    while (!at_line_end()) {
      const Token t = next();
      // Of PTP into LIN the second word is of the path that follows: C_PTP C_DIS.
      if (t.low == "c_ptp" || t.low == "c_spl" || t.low == "c_dis") {
        near = word == "ptp" ? "C_PTP" : "C_CP";
      } else if (t.low == "c_vel" && word != "ptp") {
        m.attributes.emplace_back("C_SPEED", get("apo_cvel", kReal, at));
      } else if (t.low == "c_ori" || (t.low == "c_vel" && word == "ptp")) {
        bad(t.at, "IRL has no counterpart of " + std::string(t.raw) + " at this motion",
            "Approximate by distance: C_DIS, or C_PTP of PTP.");
        return;
      } else if (t.low == "#" && is("base")) {
        next();
      } else if (t.low == "#" && is("tool")) {
        next();
        bad(t.at, "IRL has no motions relative to the tool");
        return;
      } else if (t.low == "with") {
        if (!with(m, word == "ptp", at)) return;
      } else {
        bad(t.at, "\"" + std::string(t.raw.substr(0, 40)) + "\" is not a keyword of a motion");
        return;
      }
    }
    is_approximated_ = !near.empty();
    if (!near.empty())
      m.attributes.emplace_back(near, with_apo_         ? *with_apo_
                                      : near == "C_PTP" ? get("apo_cptp", kReal, at)
                                                        : get("apo_cdis", kReal, at));
    m.until = stopped_by();
    if (m.targets[0].type.k == K::joint) {
      m.has_frames = false;
      if (word == "ptp") m.frame.reset();
    }
    if (word != "ptp")
      for (Ex& e : m.targets) e = as_place(e);
    move(std::move(m), at);
  }
  /// What follows the name of a function of WITH: values, names of data and their components.
  struct WithArgument {
    std::optional<Ex> e;
    std::string data, component;
  };
  /// WITH $VEL=SVEL_CP(0.2), $TOOL=..., of this motion only. False = it was reported.
  bool with(Motion& m, bool is_ptp, const At& at) {
    do {
      const Token what = next();
      std::string key = what.low;
      Ex index = integer(1);
      if (accept("[")) {
        index = expression();
        expect("]");
      }
      while (accept(".")) key += "." + next().low;
      if (!expect("=")) return false;
      std::string function;
      std::vector<WithArgument> a;
      std::optional<Ex> plain;
      if (peek().kind == Tk::name && is("(", 1) && peek().low.starts_with("s") &&
          !find(peek().low)) {
        function = next().low;
        next();
        while (!at_line_end() && !is(")")) {
          WithArgument one;
          if (peek().kind == Tk::name && globals_.contains(peek().low) &&
              globals_.at(peek().low).kind == Symbol::data) {
            one.data = next().low;
            if (accept(".")) one.component = next().low;
          } else if (!is(",")) {
            one.e = expression();
            if (!one.e->ok) return false;
          }
          a.push_back(std::move(one));
          if (!accept(",")) break;
        }
        if (!expect(")")) return false;
      } else if (key == "$tool" || key == "$base") {
        want_ = kPose;
        plain = as_pose(expression(), at);
        want_.reset();
        if (!plain->ok) return false;
      } else if (accept("#")) {
        function = "#" + next().low;
      } else {
        plain = expression();
        if (!plain->ok) return false;
      }
      /// A component of data, or the first value.
      const auto part = [&](std::initializer_list<const char*> names) -> std::optional<Ex> {
        for (const WithArgument& x : a) {
          if (x.e) return x.e;
          if (x.data.empty()) continue;
          const auto& fields = globals_.at(x.data).fields;
          if (!x.component.empty()) {
            const auto it = fields.find(x.component);
            return it == fields.end() ? std::nullopt : std::optional(it->second);
          }
          for (const char* n : names)
            if (const auto it = fields.find(n); it != fields.end()) return it->second;
        }
        return plain;
      };
      const auto unknown = [&] {
        bad(what.at, "WITH " + std::string(what.raw.substr(0, 40)) + " is not read here",
            "Set it before the motion.");
        return false;
      };
      if (key == "$tool" || key == "$base") {
        const bool is_tool = key[1] == 't';
        Ex frame = plain ? *plain : failed();
        if (!plain) {
          const auto n = part({is_tool ? "tool_no" : "base_no"});
          if (!n || !n->ok || !is_number(n->type)) return unknown();
          frame = n->is_literal && n->v == 0
                      ? identity()
                      : numbered(is_tool ? "tool_data" : "base_data", *n, at);
        }
        if (!frame.ok) return false;
        (is_tool ? m.tool : m.frame) = frame;
      } else if ((key == "$vel" || key == "$vel.cp") && !is_ptp) {
        const auto v = part({"vel"});
        if (!v || !v->ok || !is_number(v->type)) return unknown();
        m.attributes.emplace_back("SPEED", scaled(as_real(*v, at), 1000));
      } else if ((key == "$vel_axis" || key == "$acc_axis") && is_ptp) {
        const auto v = part({key[1] == 'v' ? "vel" : "acc"});
        if (!v || !v->ok || !is_number(v->type) || !index.is_literal) return unknown();
        m.attributes.emplace_back(key[1] == 'v' ? "SPEED_PTP" : "ACC_PTP", as_real(*v, at));
      } else if (key == "$apo" || key == "$apo.cdis" || key == "$apo.cptp") {
        const auto v = part({"apo_dist"});
        if (!v || !v->ok || !is_number(v->type)) return unknown();
        with_apo_ = as_real(*v, at);
      } else if (key == "$ori_type" || key == "$ipo_mode" || key == "$circ_type") {
        const auto v = function.starts_with("#")
                           ? std::nullopt
                           : part({key == "$ori_type" ? "ori_typ" : "ipo_frame"});
        const std::string mode = v ? lower(v->s) : function;
        if (mode != "#var" && mode != "#base") return unknown();
      } else if (key == "$load" || key.starts_with("$acc") || key == "$jerk" ||
                 key == "$gear_jerk" || key.starts_with("$collmon")) {
        if (!std::exchange(is_with_reported_, true))
          warn(what.at, "IRL has no loads, jerks and accelerations in m/s^2; WITH " +
                            std::string(what.raw) + " is left out" + kOtherTimes);
      } else {
        return unknown();
      }
    } while (accept(","));
    return true;
  }
  Ex target_of(bool is_relative, const At& at) {
    is_relative_ = is_relative;
    is_target_ = true;
    const Token t = peek();
    if (t.kind == Tk::name && !find(t.low) && t.low[0] != '$' && peek(1).low != "(" &&
        t.raw.find('.') == std::string_view::npos) {
      // Taught elsewhere, such as XHOME.
      const bool is_joint = t.low.starts_with("xhome");
      Symbol& s = declare(t.raw, is_joint ? kJoint : kTarget);
      if (!is_joint) learned_.turns = 6;
      declare_variable(s, {}, at);
      fail(t.at, std::string(t.raw) + " is not declared; its values are zero here",
           "Read the program together with its .dat and $config.dat, or give the values.");
    }
    Ex e = expression();
    is_target_ = is_relative_ = false;
    // Declared without A, B, C: they stay as they are, as with a POSITION.
    if (e.ok && !is_relative && t.kind == Tk::name && bare_.contains(t.low) &&
        e.s == globals_.at(t.low).irl) {
      if (learned_.flags.contains("written " + t.low))
        return bad(at, std::string(t.raw) + " has no A, B, C in its declaration, but is assigned",
                   "Give all of X, Y, Z, A, B, C.");
      return value(e.s + (e.type.k == K::target ? ".PSE.POS" : ".POS"), kPosition);
    }
    if (e.ok && e.type.k != K::pose && e.type.k != K::target && e.type.k != K::joint &&
        e.type.k != K::position)
      return bad(at, "this is not a target of a motion");
    if (e.ok && is_relative && e.type.k == K::target) e = as_pose(e, at);
    return e;
  }

  void if_(const At& at) {
    const std::string c = truth(at);
    accept("then");
    if (const std::string by = stopped_by();
        !by.empty() && (c == "NOT " + by || c == "NOT (" + by + ")")) {
      // UNTIL that holds already is no motion.
      is_stop_if_ = true;
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    emit("IF " + c + " THEN", at);
    open_block("endif", "ENDIF");
  }
  void else_(const At& at) {
    if (is_in("endif")) between("ELSE", at);
    else bad(at, "ELSE is outside IF");
  }
  void end_(const At& at) {
    if (word_ == "endif" && blocks_.empty() && std::exchange(is_stop_if_, false)) {
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    close_block(word_, at);
  }
  void for_(const At& at) {
    const Token v = next();
    expect("=");
    const Ex from = as_integer(expression(), at);
    expect("to");
    const Ex to = as_integer(expression(), at);
    Ex step = integer(1);
    if (accept("step")) step = as_integer(expression(), at);
    will_write(v.low);
    const Symbol* s = find(v.low);
    std::string head;
    if (!from.ok || !to.ok || !step.is_literal || step.v == 0 || !s || s->type.k != K::integer) {
      bad(at, !s ? "the loop's variable is not declared" : "the step of this loop is unknown");
      skip_rest();
      return open_unread_loop("endfor", at);
    }
    head = "FOR " + s->irl + " := " + from.s + (step.v < 0 ? " DOWNTO " : " TO ") + to.s;
    if (std::fabs(step.v) != 1)
      head += " STEP " + integer(static_cast<std::int64_t>(std::fabs(step.v))).s;
    emit(head + " DO", at);
    open_block("endfor", "ENDFOR");
  }
  void while_(const At& at) {
    const std::string c = truth(at);
    accept("do");
    emit("WHILE " + c + " DO", at);
    open_block("endwhile", "ENDWHILE");
  }
  void repeat(const At& at) {
    emit("REPEAT", at);
    open_block("until", "UNTIL TRUE");
  }
  void until(const At& at) {
    const std::string c = truth(at);
    if (is_in("until")) blocks_.back().irl = "UNTIL " + c;
    close_block("until", at);
  }
  void loop(const At& at) {
    emit("LOOP", at);
    open_block("endloop", "ENDLOOP");
  }
  void switch_(const At& at) { open_case("endswitch", at); }
  bool in_switch(const At& at) {
    if (is_in("endswitch")) return true;
    bad(at, "this is outside SWITCH");
    return false;
  }
  void case_(const At& at) {
    if (!in_switch(at)) return;
    std::vector<ArmValue> values;
    do {
      values.push_back({expression()});
    } while (accept(","));
    open_arm(values, at);
  }
  void default_(const At& at) {
    if (in_switch(at)) open_default(at);
  }
  void exit(const At& at) {
    const bool is_in_loop = std::any_of(blocks_.begin(), blocks_.end(), [](const Block& b) {
      return b.irl == "ENDLOOP" || b.irl == "ENDFOR" || b.irl == "ENDWHILE" || b.word == "until";
    });
    if (is_in_loop) emit("EXIT;", at);
    else bad(at, "EXIT is outside a loop");
  }
  void goto_(const At& at) {
    const Token t = next();
    if (t.kind != Tk::name || !has_label(t.low, true)) {
      bad(at, "the label does not exist");
      return;
    }
    emit("GOTO " + label(t.raw) + ";", at);
  }
  /// A wait for nothing: the motion before it goes all the way to its target.
  void stop_advance(const At& at) {
    if (is_approximated_) emit("WAIT 0.0 SEC;", at);
    else note_line(at, "it does not wait; it only stops the advance run");
  }
  void wait(const At& at) {
    if (accept("sec")) {
      const Ex e = as_real(expression(), at);
      if (e.is_literal && e.v <= 0) return stop_advance(at);
      if (e.ok) emit("WAIT " + within(e, kSum) + " SEC;", at);
      return;
    }
    if (!expect("for")) return;
    const Ex e = converted(expression(), kBool, at);
    if (!e.ok) return;
    if (e.s == "TRUE") return stop_advance(at);
    emit("WAIT FOR " + e.s + ";", at);
  }
  /// A timer that runs from -t while its flag is waited for, too: WAIT FOR with TIMEOUT.
  bool timed_wait(const At& at) {
    const std::string n(peek(2).raw);
    if (!is("[", 1) || peek(2).kind != Tk::number || !is("]", 3) || !is("=", 4)) return false;
    std::size_t k = at_ + 5;
    const auto line = [&] {
      while (tokens_[k].kind != Tk::line && tokens_[k].kind != Tk::end) ++k;
      const bool is_there = tokens_[k].kind == Tk::line;
      while (tokens_[k].kind == Tk::line) ++k;
      return is_there;
    };
    const auto has = [&](std::initializer_list<std::string_view> words) {
      std::size_t i = k;
      for (const std::string_view w : words) {
        if (i >= tokens_.size() || (tokens_[i].low != w && tokens_[i].raw != w)) return false;
        ++i;
      }
      return true;
    };
    if (!line() || !has({"$timer_stop", "[", n, "]", "=", "false"}) || !line() ||
        !has({"wait", "for"}))
      return false;
    const std::size_t waits = k + 2;
    if (!line()) return false;
    const std::size_t behind = k;
    if (!has({"$timer_stop", "[", n, "]", "=", "true"})) return false;
    std::size_t last = behind - 1;
    while (tokens_[last].kind == Tk::line) --last;
    k = last - 4;
    if (last < waits + 5 || !has({"or", "$timer_flag", "[", n, "]"})) return false;
    const std::size_t or_ = last - 4;
    at_ += 5;
    const Ex t = as_real(expression(), at);
    if (t.ok && !at_line_end()) bad(here(), "the end of the line is expected here");
    at_ = waits;
    const Token kept = tokens_[or_];
    tokens_[or_].kind = Tk::line;
    const Ex c = converted(expression(), kBool, at);
    tokens_[or_] = kept;
    at_ = behind + 6;
    if (!t.ok || !c.ok) return true;
    const Ex seconds = t.is_literal ? measure(-t.v / 1000) : scaled(negative(t), 0.001);
    emit("WAIT FOR " + c.s + " TIMEOUT " + within(seconds, kSum) + ";", at);
    return true;
  }
  void halt(const At& at) { emit("PAUSE;", at); }
  void return_(const At& at) {
    if (at_line_end()) {
      emit("RETURN;", at);
      return;
    }
    if (is_in_main() || current().result.k == K::none) {
      bad(at, "RETURN has a value, and this is no function");
      skip_rest();
      return;
    }
    want_ = current().result;
    const Ex e = converted(expression(), current().result, at);
    want_.reset();
    if (e.ok) emit("RETURN " + e.s + ";", at);
  }
  void continue_(const At& at) {
    // The statement behind it runs before the motion ends.
    std::size_t i = 0;
    while (peek(i).kind == Tk::line) ++i;
    bool has_signals = false;
    for (; peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i) {
      const Symbol* s = peek(i).kind == Tk::name ? find(peek(i).low) : nullptr;
      has_signals = has_signals || peek(i).low == "$out" || peek(i).low == "$in" ||
                    peek(i).low == "pulse" || peek(i).low == "wait" ||
                    (s && (s->kind == Symbol::input || s->kind == Symbol::output));
    }
    if (!has_signals)
      return note_line(at, "CONTINUE concerns the advance run, which IRL does not have");
    left_out(RMP_FAULT_ERROR, at,
             "the statement after CONTINUE runs before the motion ends, but in IRL after it",
             "Take CONTINUE out.");
  }
  void brake(const At& at) {
    if (stops_.contains(routine_name_)) {
      skip_rest();
      return note_line(at, "UNTIL at the motion says it");
    }
    accept("f");
    emit("BRAKE(1);", at);
  }
  void pulse(const At& at) {
    expect("(");
    const Ex out = expression();
    expect(",");
    const Ex level = converted(expression(), kBool, at);
    expect(",");
    const Ex time = as_real(expression(), at);
    expect(")");
    if (!out.ok || !level.ok || !time.ok) return;
    if (!out.is_place || out.type.k != K::boolean || !level.is_constant) {
      bad(at, "a pulse needs an output and TRUE or FALSE");
      return;
    }
    pulse_of(out, level.s, level.s == "TRUE" ? "FALSE" : "TRUE", time, at);
  }
  void interrupt(const At& at) {
    if (word_ == "global") expect("interrupt");
    if (accept("decl")) {
      const Token n = next();
      for (std::size_t i = 0; peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i)
        if (peek(i).low == "ir_stopm") {
          // Of each program that an editor makes: what the controller does where it stops.
          skip_rest();
          stop_interrupts_.insert(std::string(n.raw));
          note_line(at, "the controller's stop interrupt is not part of the program");
          return;
        }
      expect("when");
      const Ex c = converted(expression(), kBool, at);
      expect("do");
      const Token routine = next();
      if (accept("(")) {
        if (!accept(")")) {
          skip_rest();
          bad(at, "the routine of an interrupt has arguments",
              "IRL calls interrupt routines without arguments.");
          return;
        }
      }
      if (!c.ok) return;
      if (stops_.contains(routine.low)) {
        untils_.insert_or_assign(std::string(n.raw), c.s);
        emit("{ " + source_line(at) + " }", at);
        return;
      }
      if (n.kind != Tk::number) {
        bad(n.at, "an interrupt has a number");
        return;
      }
      const std::string text = call(routine.raw, {}, at);
      if (text.empty()) return;
      const std::string key = "!interrupt" + std::string(n.raw);
      if (globals_.contains(key)) {
        bad(at, "the interrupt " + std::string(n.raw) + " is declared twice",
            "IRL allows one body for each.");
        return;
      }
      Symbol& s = declare(key, {}, Symbol::data);
      s.irl = irl_name("interrupt_" + std::string(n.raw));
      Routine& before = current();
      const bool was_main = is_in_main();
      Routine& r = open("INTERRUPT " + s.irl + " PRIORITY " + std::string(n.raw) + " WHEN " + c.s,
                        "ENDINTERRUPT", at);
      r.body.push_back({"  " + text + ";", at, true});
      if (was_main) close();
      else set_current(before);
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    const Token what = next();
    const bool on = what.low == "on" || what.low == "enable";
    if (!on && what.low != "off" && what.low != "disable") {
      bad(at, "INTERRUPT DECL, ON, OFF, ENABLE or DISABLE is expected here");
      skip_rest();
      return;
    }
    if (at_line_end()) {
      bad(at, "IRL enables and disables interrupts one by one", "Give the number.");
      return;
    }
    const Token n = next();
    if (stop_interrupts_.contains(std::string(n.raw))) {
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    if (untils_.contains(std::string(n.raw))) {
      if (!on || !stopped_by().empty()) {
        emit("{ " + source_line(at) + " }", at);
        return;
      }
      bad(at, "this interrupt does not stop a single motion in a separate routine",
          "Write a routine that switches it on and moves once, or use UNTIL at the motion.");
      return;
    }
    const auto it = globals_.find("!interrupt" + std::string(n.raw));
    if (it == globals_.end()) {
      bad(at, "the interrupt " + std::string(n.raw.substr(0, 20)) + " is not declared above");
      return;
    }
    emit((on ? "ENABLE " : "DISABLE ") + it->second.irl + ";", at);
  }

  void assignment() {
    const Token t = peek();
    const At at = t.at;
    if (t.low == "$msg_t") {
      skip_rest();
      left_out(RMP_FAULT_WARNING, at, "it is a message of the controller");
      return;
    }
    if (t.low[0] == '$' && setting(t)) return;
    if ((t.low == "pdat_act" || t.low == "ldat_act" || t.low == "fdat_act") && is("=", 1)) {
      next();
      next();
      if (is("{")) {
        Symbol s;
        s.kind = Symbol::data;
        s.fields = aggregate();
        const std::string name = "!" + t.low + std::to_string(at.begin);
        globals_.insert_or_assign(name, std::move(s));
        (t.low[0] == 'p' ? pdat_ : t.low[0] == 'l' ? ldat_ : fdat_) = name;
        emit("{ " + source_line(at) + " }", at);
        return;
      }
      const Token from = next();
      auto it = globals_.find(from.low);
      if (it == globals_.end()) it = delivered_data(from);
      if (it == globals_.end() || it->second.kind != Symbol::data) {
        bad(at, std::string(from.raw.substr(0, 40)) + " is not declared",
            "Read the program together with its .dat.");
        return;
      }
      (t.low[0] == 'p' ? pdat_ : t.low[0] == 'l' ? ldat_ : fdat_) = from.low;
      emit("{ " + source_line(at) + " }", at);
      return;
    }
    if (t.low == "$pos_act" || t.low == "$axis_act") {
      skip_rest();
      bad(at, std::string(t.raw) + " is where the robot is, and gets no value");
      return;
    }
    will_write(t.low);
    const Ex to = primary();
    if (!to.ok) {
      skip_rest();
      return;
    }
    if (!expect("=")) return;
    want_ = to.type;
    if (bare_.contains(t.low)) learned_.flags.insert("written " + t.low);
    if (is("{") && (to.type.k == K::pose || to.type.k == K::target || to.type.k == K::joint ||
                    to.type.k == K::record)) {
      const std::size_t back = at_;
      const auto f = aggregate();
      if (is_partial(f, to.type)) {
        // The components without a value keep theirs.
        want_.reset();
        for (const auto& [name, e] : f) {
          Token component = t;
          component.low = component.raw = name;
          assign(this->component(to, component), e, at);
        }
        return;
      }
      at_ = back;
      want_ = to.type;
    }
    const Ex e = expression();
    want_.reset();
    if (to.type.k == K::target && e.ok && e.type.k == K::pose) {
      assign(to, e, at);
      return;
    }
    assign(to, e, at);
  }
  /// Assignments to what the controller keeps. True = it was one.
  bool setting(const Token& t) {
    const At at = t.at;
    static const std::set<std::string, std::less<>> kFree{
        "$advance",   "$ori_type",   "$circ_type", "$ipo_mode", "$load",      "$act_tool",
        "$act_base",  "$timer_stop", "$apo",       "$vel",      "$acc",       "$vel_axis",
        "$acc_axis",  "$tool",       "$base",      "$jerk",     "$ov_pro",    "$gear_jerk",
        "$vel_extax", "$acc_extax",  "$timer",     "$loop_msg", "$circ_mode", "$orio_type",
        "$c_dis",     "$red_vel",    "$bwdstart",  "$h_pos",    "$sen_pinta", "$tech",
        "$null"};
    if (!kFree.contains(t.low)) return false;
    if (t.low == "$timer" && timed_wait(at)) return true;
    next();
    std::string what = t.low;
    Ex index = failed();
    if (accept("[")) {
      index = expression();
      expect("]");
    }
    while (accept(".")) what += "." + next().low;
    if (!expect("=")) return true;
    if (what == "$ori_type" || what == "$circ_type" || what == "$ipo_mode" ||
        what.starts_with("$circ_mode")) {
      // The values of the delivery are how IRL moves.
      const std::string mode = is("#") ? peek(1).low : peek().low;
      const bool is_usual =
          mode == (what == "$ori_type" ? "var" : "base") && !what.starts_with("$circ_mode");
      skip_rest();
      if (is_usual) note_line(at, std::string(t.raw) + " is IRL's default");
      else left_out(RMP_FAULT_ERROR, at, "IRL has no counterpart of this " + std::string(t.raw));
      return true;
    }
    if (what.starts_with("$load") || what.starts_with("$jerk") || what.starts_with("$gear") ||
        what.starts_with("$acc_extax")) {
      skip_rest();
      left_out(RMP_FAULT_WARNING, at,
               "IRL has no counterpart of " + std::string(t.raw) + kOtherTimes);
      return true;
    }
    if (what.starts_with("$timer") || what == "$red_vel" || what.starts_with("$tech") ||
        what.starts_with("$sen")) {
      skip_rest();
      left_out(RMP_FAULT_ERROR, at, "IRL has no counterpart of " + std::string(t.raw));
      return true;
    }
    if (what == "$ov_pro" || what == "$vel_extax") {
      const Ex e = as_real(expression(), at);
      if (!e.ok) return true;
      if (what == "$vel_extax" && learned_.external_axes == 0)
        note_line(at, "the program moves no additional axes");
      else if (e.is_literal && e.v == 100) note_line(at, "100 % is IRL's default");
      else
        left_out(RMP_FAULT_ERROR, at, "IRL has no " + std::string(t.raw) + " of a program",
                 "Multiply the speeds by it.");
      return true;
    }
    if (what == "$advance" || what == "$act_tool" || what == "$act_base" || what == "$bwdstart" ||
        what == "$loop_msg") {
      skip_rest();
      note_line(at, std::string(t.raw) + " has no effect in IRL");
      return true;
    }
    if ((what.starts_with("$tool.") || what.starts_with("$base.")) && !what.ends_with(".s") &&
        !what.ends_with(".t")) {
      const char* key = what[1] == 't' ? "tool" : "frame";
      Token component = t;
      component.low = what.substr(6);
      const Ex to = this->component(get(key, kPose, at), component);
      set_part(key, to, expression(), at);
      return true;
    }
    if ((what == "$tool" || what == "$base") && is("{")) {
      const char* key = what[1] == 't' ? "tool" : "frame";
      const std::size_t back = at_;
      const auto f = aggregate();
      if (is_partial(f, kPose)) {
        for (const auto& [name, e] : f) {
          Token component = t;
          component.low = name;
          const Ex to = this->component(get(key, kPose, at), component);
          if (!to.ok || !e.ok) return true;
          set_part(key, to, e, at);
        }
        return true;
      }
      at_ = back;
    }
    if (what == "$tool" || what == "$base") {
      want_ = kPose;
      const Ex e = as_pose(expression(), at);
      want_.reset();
      set(what == "$tool" ? "tool" : "frame", e, at);
      return true;
    }
    if (what == "$h_pos") {
      skip_rest();
      left_out(RMP_FAULT_ERROR, at, "IRL has no home position of the controller");
      return true;
    }
    if (what == "$apo" || what == "$vel" || what == "$acc") {
      bad(at, "the components of " + std::string(t.raw) + " are set one by one here",
          "Such as $VEL.CP=0.2.");
      skip_rest();
      return true;
    }
    const Ex e = as_real(expression(), at);
    if (!e.ok) return true;
    if (what == "$vel.cp") set_variable("R_SPEED", scaled(e, 1000), at);
    else if (what == "$vel.ori1" || what == "$vel.ori2") {
      // One speed of orientations: both get the same as a rule.
      one_of_many(what == "$vel.ori1", "R_SPEED_ORI", "$VEL.ORI1 and $VEL.ORI2", e, at);
    } else if (what == "$vel_axis" || what == "$acc_axis") {
      const bool is_speed = what[1] == 'v';
      one_of_many(!index.is_literal || index.v == 1, is_speed ? "R_SPEED_PTP" : "R_ACC_PTP",
                  is_speed ? "$VEL_AXIS of all axes" : "$ACC_AXIS of all axes", e, at);
    } else if (what == "$apo.cdis") set("apo_cdis", e, at);
    else if (what == "$apo.cptp") set("apo_cptp", e, at);
    else if (what == "$apo.cvel") set("apo_cvel", e, at);
    else if (what == "$apo.cori") note_line(at, "no motion here is blended by its orientation");
    else if (what.starts_with("$acc.")) {
      left_out(
          RMP_FAULT_WARNING, at,
          std::string("IRL has accelerations in % of the maximum, not in m/s^2") + kOtherTimes);
    } else {
      left_out(RMP_FAULT_ERROR, at, "IRL has no counterpart of " + what);
    }
    return true;
  }
  /// One variable of IRL for several of the controller: the first sets it, and the others repeat
  /// it.
  void one_of_many(bool is_first, const char* name, const char* them, const Ex& e, const At& at) {
    std::string& last = last_of_many_[name];
    if (is_first) {
      last = e.s;
      set_variable(name, e, at);
    } else if (last == e.s) {
      note_line(at, std::string("IRL has one value for ") + them);
    } else {
      left_out(RMP_FAULT_ERROR, at,
               std::string("IRL has one value for ") + them + ", and these differ",
               "Set all of them to the same value, starting with the first.");
    }
  }

  // ---- expressions ----

  std::map<std::string, Ex> aggregate() {
    std::map<std::string, Ex> out;
    expect("{");
    if (peek().kind == Tk::name && is(":", 1)) {
      next();
      next();
    }
    while (!at_line_end() && !is("}")) {
      const Token name = next();
      if (name.kind != Tk::name) {
        bad(name.at, "the name of a component is expected here");
        return out;
      }
      if (accept("[")) accept("]");
      const auto before = std::exchange(want_, std::nullopt);
      if (before && before->k == K::record)
        for (const auto& [field, type] : records_[before->record])
          if (field == name.low) want_ = type;
      if (peek().low == "#" || peek().low[0] == '#') {
        // An enumerator that the reader may not know.
        const auto e = enumerator();
        out.insert_or_assign(name.low, e);
      } else {
        out.insert_or_assign(name.low, expression(25));
      }
      want_ = before;
      if (!accept(",")) break;
    }
    expect("}");
    return out;
  }
  /// Whether an aggregate leaves components of a value out that keep theirs then.
  bool is_partial(const std::map<std::string, Ex>& f, const Type& of) {
    const auto lacks = [&](std::initializer_list<const char*> names) {
      return std::any_of(names.begin(), names.end(), [&](const char* n) { return !f.contains(n); });
    };
    if (f.empty()) return false;
    if (of.k == K::record)
      return std::any_of(records_[of.record].begin(), records_[of.record].end(),
                         [&](const auto& x) { return !f.contains(x.first); });
    if (of.k == K::joint) return lacks({"a1", "a2", "a3", "a4", "a5", "a6"});
    return lacks({"x", "y", "z", "a", "b", "c"});
  }
  Ex enumerator() {
    const Token hash = next();
    const Token name = hash.low == "#" ? next() : hash;
    const auto it = globals_.find("#" + name.low);
    if (it != globals_.end()) {
      Ex e = value(it->second.irl, kInt);
      e.is_constant = true;
      return e;
    }
    Ex e = integer(0);
    e.is_literal = false;
    e.ok = false;
    e.s = "#" + name.low;
    return e;
  }
  Ex from_aggregate(const At& at) {
    const auto want = want_;
    const bool is_target = is_target_, is_relative = is_relative_;
    const auto f = aggregate();
    if (f.empty()) return bad(at, "there is nothing between these braces");
    for (const auto& [name, e] : f)
      if (!e.ok && (!want || want->k == K::record)) return failed();
    const auto get_field = [&](const char* name) -> const Ex* {
      const auto it = f.find(name);
      return it == f.end() ? nullptr : &it->second;
    };
    if (want && want->k == K::record) {
      std::string list;
      for (const auto& [name, type] : records_[want->record]) {
        const Ex* e = get_field(name.c_str());
        if (!e) {
          return bad(at, "the component " + name + " has no value here");
        }
        list += (list.empty() ? "" : ", ") + converted(*e, type, at).s;
      }
      Ex e = value(want->record + "(" + list + ")", *want);
      return e;
    }
    const auto take = [&](const char* name) {
      const Ex* e = get_field(name);
      return e ? *e : real(0);
    };
    std::vector<Ex> external;
    bool has_external = false;
    for (int i = 1; i <= 6; ++i) {
      const Ex* e = get_field(("e" + std::to_string(i)).c_str());
      has_external = has_external || e;
      external.push_back(e ? *e : real(0));
    }
    // Where the file moves external axes, E1 0 is a place of theirs.
    has_external = has_external && learned_.external_axes > 0;
    while (!external.empty() && external.back().is_literal && external.back().v == 0)
      external.pop_back();
    bool is_joint = false;
    int axes = 0, place_parts = 0, turn_parts = 0;
    for (const auto& [name, e] : f) {
      if (name.size() == 2 && name[0] == 'a' && name[1] >= '1' && name[1] <= '6') {
        is_joint = true;
        ++axes;
      } else if (name == "x" || name == "y" || name == "z") {
        ++place_parts;
      } else if (name == "a" || name == "b" || name == "c") {
        ++turn_parts;
      } else if (name != "s" && name != "t" &&
                 !(name.size() == 2 && name[0] == 'e' && name[1] >= '1' && name[1] <= '6')) {
        return bad(at, "\"" + name + "\" is not a component of a position");
      }
    }
    if (is_joint) {
      if (axes < 6 && is_target && !is_relative)
        return bad(at, "axes without a value keep their positions, which IRL cannot express",
                   "Give all six.");
      std::vector<Ex> a;
      for (int i = 1; i <= 6; ++i) a.push_back(take(("a" + std::to_string(i)).c_str()));
      return joints(a, external);
    }
    if (is_target && !is_relative && (place_parts < 3 || (turn_parts != 0 && turn_parts != 3)))
      return bad(at, "components without a value keep their values, which IRL cannot express",
                 "Give all of X, Y, Z, A, B, C.");
    if (is_target && !is_relative && turn_parts == 0 && external.empty() && !has_external) {
      std::string list;
      for (const char* c : {"x", "y", "z"})
        list += (list.empty() ? "" : ", ") + as_real(take(c), at).s;
      return value("POSITION(" + list + ")",
                   {.k = K::position, .record = {}, .bounds = {}, .element = {}});
    }
    is_bare_ = place_parts == 3 && turn_parts == 0;
    const Ex p = pose({take("x"), take("y"), take("z")},
                      orientation("ORIZYX", {take("a"), take("b"), take("c")}));
    const Ex* s = get_field("s");
    const Ex* t = get_field("t");
    // Without S and T the controller keeps the configuration it is in.
    const std::vector<Ex> any_turns(6, integer(-128));
    if (!s && !t && external.empty() && !has_external)
      return want && want->k == K::target ? target(p, integer(-1), any_turns, {}) : p;
    Ex status = s ? as_integer(*s, at) : integer(-1);
    if (s && status.ok && !status.is_literal)
      return bad(at, "the configuration S is unknown", "Give its number.");
    if (s && status.is_literal) {
      // Bit 1 is axis 3 at or above its limit, which is the elbow up where the shoulder is in front
      // and down where it is behind; STATUS 2 is the elbow down.
      const auto bits = static_cast<std::int64_t>(status.v) & 7;
      status = integer((bits & 5) | (((bits & 2) != 0) == ((bits & 1) != 0) ? 2 : 0));
    }
    std::vector<Ex> turns;
    if (t) {
      const Ex n = as_integer(*t, at);
      if (!n.is_literal) return bad(at, "the turns T are unknown");
      // Bit i: joint i + 1 is negative.
      for (int i = 0; i < 6; ++i)
        turns.push_back(integer((static_cast<std::int64_t>(n.v) >> i) & 1 ? -1 : 0));
    }
    return target(p, status, t ? turns : any_turns, external);
  }

  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (t.kind == Tk::number) {
      next();
      return t.is_integer ? integer(static_cast<std::int64_t>(t.value)) : real(t.value);
    }
    if (t.kind == Tk::text) {
      next();
      return t.raw.size() == 1 && want_ && want_->k == K::character
                 ? converted(string(t.raw), *want_, at)
                 : string(t.raw);
    }
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      e.is_grouped = true;
      return e;
    }
    if (is("{")) return from_aggregate(at);
    if (is("'")) {
      // 'HFF', 'B101'
      next();
      const Token n = next();
      expect("'");
      std::int64_t v = 0;
      const std::string digits = n.low.empty() ? std::string(n.raw) : n.low;
      if (digits.size() > 1 && digits.size() < 34 && (digits[0] == 'b' || digits[0] == 'h')) {
        const int base = digits[0] == 'b' ? 2 : 16;
        bool is_good = true;
        for (std::size_t i = 1; i < digits.size(); ++i) {
          const int d = digits[i] >= 'a' ? digits[i] - 'a' + 10 : digits[i] - '0';
          is_good = is_good && d >= 0 && d < base;
          v = (v * base + d) & 0xFFFFFFFF;
        }
        if (is_good) return integer(v > 0x7FFFFFFF ? v - 0x100000000 : v);
      }
      return bad(at, "this is not a number");
    }
    if (is("#")) {
      const Token name = peek(1);
      const Ex e = enumerator();
      if (!e.ok) return bad(at, "#" + std::string(name.raw.substr(0, 40)) + " is not known");
      return e;
    }
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    next();
    if (t.low == "true" || t.low == "false") return boolean(t.low == "true");
    if (t.low[0] == '$') return system_value(t);
    if (is("(")) return function(t);
    if ((t.low == "tool_data" || t.low == "base_data") && is("[") &&
        (!find(t.low) || learned_.types.contains(t.low))) {
      next();
      const Ex i = expression();
      expect("]");
      return suffixes(numbered(t.low, i, at), at);
    }
    if (is_hidden(t)) return failed();
    const Symbol* s = find(t.low);
    if (!s || s->kind == Symbol::data)
      return bad(at, std::string(t.raw) + " is not declared",
                 "Read the program together with its .dat and any other file that declares it.");
    if (s->kind == Symbol::routine) return bad(at, std::string(t.raw) + " is a routine");
    Ex e = place(s->irl, s->type);
    e.is_place = s->kind == Symbol::variable || s->kind == Symbol::output;
    e.is_constant = s->kind == Symbol::constant;
    return suffixes(std::move(e), at);
  }
  Ex suffixes(Ex e, const At& at) {
    for (;;) {
      if (is("[")) {
        next();
        if (accept("]")) continue;  // the whole of an array
        std::string list;
        std::size_t n = 0;
        std::vector<Ex> known;
        do {
          if (is("]")) break;
          const Ex i = as_integer(expression(), at);
          if (!i.ok) return failed();
          known.push_back(i);
          list += (n++ ? ", " : "") + i.s;
        } while (accept(","));
        expect("]");
        if (e.type.k == K::string && n == 1) {
          Type t = e.type;
          t.k = K::character;
          e = place(e.s + "[" + list + "]", t);
          continue;
        }
        if (e.type.k != K::array || e.type.bounds.size() != n)
          return bad(at, "this is not an array of " + std::to_string(n) + " indices");
        for (std::size_t k = 0; k < n; ++k)
          if (known[k].is_literal && (known[k].v < static_cast<double>(e.type.bounds[k].first) ||
                                      known[k].v > static_cast<double>(e.type.bounds[k].second)))
            return bad(at, "the index " + known[k].s + " is outside the array");
        const Type element = *e.type.element;
        e = place(e.s + "[" + list + "]", element);
        continue;
      }
      if (is(".") && peek(1).kind == Tk::name) {
        next();
        const Token f = next();
        e = component(e, f);
        if (!e.ok) return e;
        continue;
      }
      return e;
    }
  }
  Ex component(const Ex& e, const Token& f) {
    const std::string& n = f.low;
    if (e.type.k == K::record) {
      for (const auto& [name, type] : records_[e.type.record])
        if (name == n) return place(e.s + "." + field_name(name), type);
    }
    if (e.type.k == K::pose || e.type.k == K::target) {
      const std::string p = e.s + (e.type.k == K::target ? ".PSE" : "");
      if (n == "x" || n == "y" || n == "z")
        return place(p + ".POS." + std::string(1, static_cast<char>(n[0] - 'a' + 'A')), kReal);
      if (n == "a" || n == "b" || n == "c") {
        const auto angle = [&](char c) {
          return "ANGLE" + std::string(1, static_cast<char>('Z' - (c - 'a'))) + "('ZYX', " + p +
                 ".ORI)";
        };
        Ex a = value(angle(n[0]), kReal);
        a.is_place = true;
        a.setter = p + ".ORI := ORIZYX(";
        for (const char c : {'a', 'b', 'c'}) {
          a.setter += c == 'a' ? "" : ", ";
          a.setter += c == n[0] ? "%" : angle(c);
        }
        a.setter += ")";
        return a;
      }
      if (e.type.k == K::target && n == "s")
        return bad(f.at, "S of a position encodes the elbow differently from STATUS",
                   "Assign the whole position.");
      if (e.type.k == K::target && n.size() == 2 && n[0] == 'e' && n[1] >= '1' && n[1] <= '6') {
        learned_.external_axes = std::max(learned_.external_axes, n[1] - '0');
        learned_.turns = 6;
        return place(e.s + ".A_JOINT.AA" + n.substr(1), kReal);
      }
    }
    if (e.type.k == K::joint && n.size() == 2 && n[1] >= '1' && n[1] <= '6') {
      if (n[0] == 'a')
        return place(e.s + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") + n.substr(1), kReal);
      if (n[0] == 'e') {
        learned_.external_axes = std::max(learned_.external_axes, n[1] - '0');
        return place(e.s + ".A_JOINT.AA" + n.substr(1), kReal);
      }
    }
    return bad(f.at, "there is no component " + std::string(f.raw) + " here");
  }
  Ex system_value(const Token& t) {
    const At at = t.at;
    const bool is_out = t.low == "$out";
    if (is_out || t.low == "$in") {
      if (!expect("[")) return failed();
      const Ex i = expression();
      expect("]");
      if (!i.ok) return failed();
      double n = i.is_literal ? i.v : known_integer(i);
      if (!(n >= 0 && n <= 1e6))
        return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
      if (!is_out && (n == 1025 || n == 1026)) return boolean(n == 1025);
      const Symbol& s = signal(is_out, static_cast<std::int64_t>(n));
      Ex e = place(s.irl, s.type);
      e.is_place = is_out;
      return e;
    }
    if (t.low == "$flag" || t.low == "$cycflag") {
      if (!expect("[")) return failed();
      const Ex i = as_integer(expression(), at);
      expect("]");
      if (!i.ok) return failed();
      Symbol& s = implied(t.raw, array_of(kBool, {{1, 1024}}), at);
      return place(s.irl + "[" + i.s + "]", kBool);
    }
    if (t.low == "$nullframe" || t.low == "$world") return suffixes(identity(), at);
    if (t.low == "$tool" || t.low == "$base")
      return suffixes(get(t.low == "$tool" ? "tool" : "frame", kPose, at), at);
    if (t.low == "$pos_act") return suffixes(present_target(at), at);
    if (t.low == "$axis_act") return suffixes(present_joints(), at);
    while (is("[") || is(".")) {
      if (accept("[")) {
        if (!is("]")) (void)expression();
        expect("]");
      } else {
        next();
        next();
      }
    }
    return bad(at, "IRL has no counterpart of " + std::string(t.raw));
  }
  Ex function(const Token& t) {
    const At at = t.at;
    next();
    const auto args = arguments();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},     {"cos", "COS"},   {"tan", "TAN"}, {"acos", "ACOS"},
        {"atan2", "ATAN2"}, {"sqrt", "SQRT"}, {"abs", "ABS"}};
    if (const auto it = kMath.find(t.low); it != kMath.end()) return math(it->second, args, at);
    if (t.low == "inv_pos" && args.size() == 1) {
      const Ex p = as_pose(args[0], at);
      return p.ok ? value("INV(" + p.s + ")", kPose) : failed();
    }
    for (const Ex& a : args)
      if (!a.ok) return failed();
    if (is_hidden(t)) return failed();
    const Symbol* s = find(t.low);
    const Type result = s && s->kind == Symbol::routine ? s->type : kReal;
    if (s && s->kind == Symbol::routine && result.k == K::none && !learned_.stubs.contains(t.low))
      return bad(at, std::string(t.raw) + " returns no value");
    const std::string text = call(t.raw, args, at, result.k == K::none ? kReal : result);
    if (text.empty()) return failed();
    return suffixes(value(text, result.k == K::none ? kReal : result), at);
  }

  std::map<std::string, Type> types_named_;
  std::map<std::string, double> known_;
  std::map<std::string, std::string> signal_places_;
  int enumerators_ = 0;
  KrlBackup backup_{files_};
  std::vector<Header> headers_;
  std::size_t next_header_ = 0;
  std::string main_name_;
  std::set<std::string> stop_interrupts_;
  struct StoppedMove {
    std::string number, until;  ///< of the interrupt; its condition, once it is called
  };
  std::map<std::string, StoppedMove> moves_;  ///< routines of one motion that an interrupt ends
  std::set<std::string> stops_;               ///< routines of BRAKE and RESUME
  std::map<std::string, std::string>
      untils_;  ///< conditions of interrupts that call such, by number
  std::string routine_name_;
  bool is_stop_if_ = false;
  std::string word_;
  std::map<std::string, std::string> last_of_many_;
  std::optional<Ex> with_apo_;
  bool is_with_reported_ = false;
  bool is_approximated_ = false;  ///< the last motion that was read
  std::optional<Type> want_;
  Type field_type_;
  std::optional<std::string> pdat_, ldat_, fdat_;
  bool is_target_ = false, is_relative_ = false;
  bool is_bare_ = false;                     ///< the last aggregate has X, Y, Z and no A, B, C
  std::set<std::string, std::less<>> bare_;  ///< variables that are declared with such a one
};

}  // namespace

Made read_krl(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<KrlReader>(task, params, progress);
}

}  // namespace robomosp::readers

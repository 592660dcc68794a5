// SPDX-License-Identifier: Apache-2.0
#include "program_post/templates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_passing.h>

#include "program_post/template_pack.h"

namespace robomosp::program_post {
namespace {

/// A value: text, and a number where it is one.
struct Variable {
  std::string text;
  std::optional<double> number;
};
using Variables = std::map<std::string, Variable, std::less<>>;

class TemplateWriter final : public post::Writer {
 public:
  TemplateWriter(const PostTask& task, PostOutput& output, const TemplatePack& pack,
                 Progress& progress)
      : Writer(task, output, pack.caps, progress),
        pack_(pack),
        own_names_(pack),
        body_(pack.indent) {}

 private:
  using Motion = post::Motion;
  using Text = post::Text;

  // ---- filling in ----
  /// With the pack's sign in place of the point.
  std::string signed_by_pack(std::string s) const {
    std::replace(s.begin(), s.end(), '.', pack_.decimal_sign);
    return s;
  }
  Variable num(double v) const { return {signed_by_pack(post::trimmed(v, pack_.digits)), v}; }
  static Variable word(std::string s) { return {std::move(s), std::nullopt}; }
  static bool is_on(const Variables& v, const std::string& name) {
    const auto it = v.find(name);
    if (it == v.end()) return false;
    if (it->second.number) return *it->second.number != 0;
    return !it->second.text.empty();
  }
  std::string filled(const TemplateLine& l, const Variables& variables) {
    std::string out;
    for (std::size_t i = 0; i < l.pieces.size(); ++i) {
      const Piece& p = l.pieces[i];
      if (!p.is_variable) {
        out += p.text;
        continue;
      }
      const auto it = variables.find(p.text);
      if (it == variables.end()) {
        fail(
            "the template's variable " + p.text + " has no value here",
            p.text == "speed_percent" || p.text == "speed_m"
                ? "Post constants, and give max_speed in the controller's record."
            : p.text == "joints" || p.text == "turns" || joint_number(p.text, 'q') > 0 ||
                    joint_number(p.text, 'e') > 0
                ? "Remove it from the template, or name the robot."
                : "Remove it from the template, or write it under the condition [" + p.text + "].");
        continue;
      }
      Variable v = it->second;
      for (const Filter& f : p.filters) filter(f, v, p.text);
      if (v.number && !(std::fabs(*v.number) < kGreatest))
        fail("the number " + p.text + " here is beyond the controller's range",
             "Check what it is computed from.");
      if (v.number && is_measure(p.text)) tell_rounded(p.text, v);
      out += p.text == "text" && is_in_signs(l, i) ? within_signs(pack_, v.text) : v.text;
    }
    return out;
  }
  /// Numbers of which a share counts: places have their own digits, which are looked at anyway.
  static bool is_measure(std::string_view name) {
    constexpr std::string_view kAll[] = {"speed",     "speed_m", "speed_percent", "speed_ori",
                                         "speed_ptp", "acc",     "blend",         "blend_ptp",
                                         "time",      "seconds", "milliseconds",  "value"};
    return std::find(std::begin(kAll), std::end(kAll), name) != std::end(kAll);
  }
  /// Says where the template's digits are too few for a number.
  void tell_rounded(const std::string& name, const Variable& v) {
    constexpr double kShare = 0.005;
    std::string s = v.text;
    std::replace(s.begin(), s.end(), pack_.decimal_sign, '.');
    char* end = nullptr;
    const double written = std::strtod(s.c_str(), &end);
    if (s.empty() || *end != '\0' ||
        std::fabs(written - *v.number) <= kShare * std::fabs(*v.number) + 1e-12)
      return;
    warn("the " + name + " " + post::trimmed(*v.number, 9) + " is written as " + v.text,
         "Give the template more digits (fixed:3), or the pack's head (digits), or use a number "
         "that can be written exactly.");
  }
  /// Whether a piece stands between two of the pack's signs of texts.
  bool is_in_signs(const TemplateLine& l, std::size_t i) const {
    return i > 0 && i + 1 < l.pieces.size() && !pack_.text_sign.empty() &&
           !l.pieces[i - 1].is_variable && !l.pieces[i + 1].is_variable &&
           l.pieces[i - 1].text.ends_with(pack_.text_sign) &&
           l.pieces[i + 1].text.starts_with(pack_.text_sign);
  }
  void filter(const Filter& f, Variable& v, const std::string& name) {
    const auto width = static_cast<std::size_t>(std::max(0.0, f.by));
    if (f.name == "upper") v.text = post::upper(v.text);
    if (f.name == "lower") v.text = post::lower(v.text);
    if (f.name == "first" && v.text.size() > width) {
      std::size_t end = width;  // no letter is cut in two
      while (end > 0 && (static_cast<unsigned char>(v.text[end]) & 0xC0U) == 0x80) --end;
      v.text.resize(end);
    }
    if (f.name == "pad" && v.text.size() < width) v.text.insert(0, width - v.text.size(), ' ');
    if (f.name == "left" && v.text.size() < width) v.text.append(width - v.text.size(), ' ');
    if (f.name == "zeros" && v.text.size() < width)
      v.text.insert(v.text.starts_with('-') || v.text.starts_with('+') ? 1 : 0,
                    width - v.text.size(), '0');
    if (is_of_text(f.name)) return;
    if (!v.number)
      return fail("the filter " + f.name + " needs a number, and " + name + " is computed here",
                  task_.form == kPostFlat ? "Remove the filter from the template."
                                          : "Write constants, or post the flattened program.");
    if (f.name == "sign") {
      if (!v.text.starts_with('-')) v.text.insert(0, 1, '+');
      return;
    }
    if (f.name == "times") *v.number *= f.by;
    if (f.name == "plus") *v.number += f.by;
    const bool computes = f.name == "times" || f.name == "plus";
    const int digits = computes ? pack_.digits : static_cast<int>(f.by);
    v.text = signed_by_pack(f.name == "fixed" ? post::fixed(*v.number, digits)
                                              : post::trimmed(*v.number, digits));
  }
  void emit(std::string_view construct, const Variables& variables, int before = 0, int after = 0) {
    const Template* t = pack_.find(construct);
    if (!t) {
      cannot(std::string(construct), "Write the template == " + std::string(construct) +
                                         " (and its feature) in the pack, or change the program.");
      return;
    }
    if (before < 0) out_->out();
    bool is_said = false;
    for (const TemplateLine& l : *t) {
      if (!l.condition.empty() && is_on(variables, l.condition) == l.is_not) continue;
      line(filled(l, variables));
      is_said = true;
    }
    if (!is_said && must_say(construct))
      fail("the template \"" + std::string(construct) +
               "\" writes nothing here: none of its conditions holds",
           "Add a line for this case.");
    if (after > 0) out_->in();
  }

  // ---- names ----
  std::string name(std::uint32_t s) { return own_names_.of(s, symbol(s).name); }
  std::string routine_name(std::uint32_t r) {
    return r == 0 ? own_names_.of(kLabel, task_.name) : name(routine(r).symbol);
  }
  Text variable(std::uint32_t s) override { return {name(s)}; }
  /// As files take it: signs that only names have are left out.
  std::string file_stem() {
    std::string out = routine_name(0);
    std::erase_if(out, [](char c) {
      return !((c >= '0' && c <= '9') || ((c | 32) >= 'a' && (c | 32) <= 'z') || c == '_' ||
               c == '-' || c == '.');
    });
    return out;
  }
  /// Counted from 1 in the order in which they are first written.
  static Variable count_of(std::map<std::uint64_t, std::size_t>& all, std::uint64_t which) {
    const auto n = static_cast<double>(all.try_emplace(which, all.size() + 1).first->second);
    return {post::trimmed(n, 0), n};
  }

  // ---- program ----
  void begin() override { out_ = &body_; }
  /// Lines of the controller's record, as they are.
  void add_lines(std::string_view text) {
    while (!text.empty()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view one = text.substr(0, end);
      if (one.ends_with('\r')) one.remove_suffix(1);
      body_.add(one);
      text.remove_prefix(std::min(end + 1, text.size()));
    }
  }
  static Variable number_of(std::span<const PostPlace> places, std::int32_t which) {
    if (which < 0 || static_cast<std::size_t>(which) >= places.size()) return word("");
    const std::int32_t n = places[static_cast<std::size_t>(which)].number;
    return {n < 0 ? "" : std::to_string(n), static_cast<double>(n)};
  }
  void routine_begin(std::uint32_t r) override {
    Variables v{{"name", word(routine_name(r))}, {"program", word(std::string(task_.name))}};
    starts_[r] = body_.size();
    if (r == 0) {
      v["tool"] = number_of(profile_.tools, profile_.tool);
      v["frame"] = number_of(profile_.frames, profile_.frame);
      emit("program_begin", v, 0, 1);
      add_lines(profile_.prologue);
      return;
    }
    if (routine(r).kind != RMP_ROUTINE_PROCEDURE || routine(r).parameter_count > 0)
      cannot("routines with parameters, results or conditions", flat_hint());
    v["number"] = count_of(procedures_, r);
    emit("procedure_begin", v, 0, 1);
  }
  void routine_end(std::uint32_t r) override {
    Variables v{{"name", word(routine_name(r))}, {"program", word(std::string(task_.name))}};
    if (r == 0) add_lines(profile_.epilogue);
    else v["number"] = count_of(procedures_, r);
    emit(r == 0 ? "program_end" : "procedure_end", v, -1);
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = symbol(s).span;
    if (r != 0) return cannot("variables of routines", "Declare them in the program.");
    const std::uint32_t t = symbol(s).type;
    const char* kind = t == RMP_TYPE_INT    ? "declare_int"
                       : t == RMP_TYPE_REAL ? "declare_real"
                       : t == RMP_TYPE_BOOL ? "declare_bool"
                                            : nullptr;
    if (!kind) return cannot("variables of " + type_name(t));
    const std::string value = symbol(s).value != RMP_NONE ? text(symbol(s).value)
                              : t == RMP_TYPE_BOOL        ? pack_.false_word
                                                          : std::string("0");
    if (symbol(s).value != RMP_NONE && !uses(pack_.find(kind), {"value"}))
      fail("the value that " + std::string(symbol(s).name) +
               " begins with is lost: the template \"" + kind + "\" does not write {{value}}",
           "Add it to the template, or assign the value at the start of the program.");
    emit(kind, {{"name", word(name(s))}, {"value", word(value)}});
  }
  void finish() override {
    post::File points(pack_.indent);
    write_points(points);
    post::File all(pack_.indent);
    const Variables v{{"name", word(file_stem())}};
    using Where = TemplatePack::Points;
    if (pack_.points == Where::before) all.append(points);
    all.append(body_);
    if (pack_.points == Where::behind) all.append(points);
    const std::size_t before = pack_.points == Where::before ? points.size() : 0;
    if (pack_.are_points_numbered) number_lines(all, before, 0, all.size());
    else number_lines(all, 0, before, before + body_.size());
    if (pack_.longest_line > 0)
      for (std::size_t i = 0; i < all.size(); ++i)
        if (all.lines()[i].size() > static_cast<std::size_t>(pack_.longest_line)) {
          if (all.spans()[i].file != RMP_NONE) at_ = all.spans()[i];
          fail("a line here has " + std::to_string(all.lines()[i].size()) + " characters, and " +
                   pack_.title + " takes " + std::to_string(pack_.longest_line),
               "Split the expression, or shorten the names.");
        }
    const std::string name = filled(pack_.file_name, v);
    all.give(output_, name, caps_.crlf);
    if (pack_.points == Where::file && !points.empty()) {
      const std::string own = filled(pack_.points_file, v);
      if (own == name)
        return fail("the points would go into the program's file " + name,
                    "Give points_file another name in the pack.");
      points.give(output_, own, caps_.crlf);
    }
  }
  /// Numbers before the lines from `first` to `end`, and in place of the marks of jumps to them; of
  /// the program there are `before` in front of it that have numbers.
  void number_lines(post::File& all, std::size_t before, std::size_t first, std::size_t end_line) {
    const auto number_at = [&](std::size_t i) {
      return pack_.first_number + static_cast<std::int64_t>(before + i) * pack_.number_step;
    };
    std::vector<std::string>& lines = all.lines();
    for (std::size_t i = 0; i < lines.size(); ++i) {
      std::string& l = lines[i];
      for (std::size_t at; (at = l.find('\x01')) != std::string::npos;) {
        const std::size_t end = std::min(l.find('\x01', at + 1), l.size() - 1);
        const auto line =
            starts_.find(std::strtoull(l.substr(at + 1, end - at - 1).c_str(), nullptr, 10));
        l.replace(at, end + 1 - at,
                  line == starts_.end() ? "?" : std::to_string(number_at(line->second)));
      }
      if (pack_.number_step == 0 || i < first || i >= end_line) continue;
      const double n = static_cast<double>(pack_.first_number) +
                       static_cast<double>(i - first) * static_cast<double>(pack_.number_step);
      l.insert(0, filled(pack_.line_number, {{"line", num(n)}}));
    }
  }
  void write_points(post::File& points) {
    if (!pack_.find("point") || points_.empty()) return;
    out_ = &points;
    const Variables v{{"name", word(routine_name(0))},
                      {"points", num(static_cast<double>(points_.size()))}};
    if (pack_.find("points_begin")) emit("points_begin", v);
    for (const auto& [construct, variables, span] : points_) {
      at_ = span;
      emit(construct, variables);
    }
    if (pack_.find("points_end")) emit("points_end", v);
    out_ = &body_;
  }

  // ---- expressions ----
  std::span<const post::Operator> operators() const override { return pack_.operators; }
  std::optional<Text> operated(const rmp_code_expression& x) override {
    const auto it = pack_.patterns.find(x.op);
    if (it == pack_.patterns.end()) return std::nullopt;
    const auto operands = links(x.first, x.count);
    Variables v{{"a", word(text(operands[0]))}};
    if (operands.size() > 1) v["b"] = word(text(operands[1]));
    return Text{filled(it->second.first, v), it->second.second};
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL)
      return {k.integer ? pack_.true_word : pack_.false_word};
    if (k.kind == RMP_CONSTANT_TEXT) {
      const std::string said(k.text, k.text_size);
      if (caps_.charset == PostCharset::ascii && std::any_of(said.begin(), said.end(), [](char c) {
            return static_cast<unsigned char>(c) > 126;
          }))
        cannot("letters beyond ASCII", "Write plain letters, or characters: utf8 in the pack.");
      return {said};
    }
    return Writer::literal(k);
  }
  Text string_literal(std::string_view s) override { return {std::string(s)}; }
  std::string real_literal(double v) override {
    constexpr std::size_t kLongest = 40;
    if (!std::isfinite(v)) return Writer::real_literal(v);
    std::string s;
    if (pack_.real_digits >= 0) {
      s = post::trimmed(v, pack_.real_digits, 1);
      if (std::strtod(s.c_str(), nullptr) != post::rounded_to_meaning(v))
        warn("the number " + post::shortest(v) + " is written as " + s,
             pack_.title + " has " + std::to_string(pack_.real_digits) +
                 " decimal places (real_digits).");
    } else if (s = post::shortest(v); !pack_.has_exponents && s.find('E') != std::string::npos) {
      s = post::without_exponent(v);
      if (s.ends_with(".0")) s.resize(s.size() - 2);
      if (s.size() > kLongest) {
        fail("the number " + post::shortest(v) + " has " + std::to_string(s.size()) +
                 " digits without an exponent, but " + pack_.title + " writes none",
             "Check what it is computed from, or give it in another unit.");
        return "0";
      }
    }
    if (s.find('E') == std::string::npos) {
      if (s.find('.') == std::string::npos) s += ".0";
      if (!pack_.has_real_point && s.ends_with(".0")) s.resize(s.size() - 2);
    }
    return signed_by_pack(std::move(s));
  }
  Text input(const post::Signal& s) override {
    const Template* t = pack_.find("input");
    if (!t || t->empty() || s.type != RMP_TYPE_BOOL) {
      cannot(s.type == RMP_TYPE_BOOL ? "inputs" : "inputs of several bits",
             s.type == RMP_TYPE_BOOL
                 ? "Add the feature inputs and the template == input to the pack."
                 : "Read each bit as a separate input.");
      return {};
    }
    Text out{filled(t->front(), signal_variables(s))};
    if (const auto it = pack_.patterns.find(RMP_EXPR_NOT); s.inverted && it != pack_.patterns.end())
      return {filled(it->second.first, {{"a", word(out.text)}}), it->second.second};
    if (s.inverted) {
      for (const auto& o : pack_.operators)
        if (o.op == RMP_EXPR_NOT)
          return {std::string(o.spelling) + "(" + out.text + ")", o.binding};
      cannot("inverted inputs, without the operator NOT");
    }
    return out;
  }
  Variables signal_variables(const post::Signal& s) const {
    return {{"signal", word(s.target.empty() ? s.name : s.target)},
            {"number", num(static_cast<double>(s.number))}};
  }

  // ---- statements ----
  void assign(std::uint32_t to, std::uint32_t value) override {
    if (expression(to).op != RMP_EXPR_SYMBOL) return cannot("records and arrays");
    emit("assign", {{"name", word(name(expression(to).symbol))}, {"value", value_of(value)}});
  }
  Variable value_of(std::uint32_t e) {
    if (const auto v = known(e)) return {text(e), *v};
    return word(text(e));
  }
  void set_output(const post::Signal& s, std::uint32_t value) override {
    Variables v = signal_variables(s);
    if (s.type == RMP_TYPE_BOOL) {
      const auto on = known(value);
      if (!on) return cannot("outputs with a computed state", "Use IF with TRUE and FALSE.");
      return emit((*on != 0) != s.inverted ? "output_on" : "output_off", v);
    }
    v.emplace("value", value_of(value));
    emit("output_value", v);
  }
  void call(std::uint32_t r, std::span<const std::uint32_t>) override {
    emit("call", {{"name", word(routine_name(r))},
                  {"routine_line", mark(r)},
                  {"number", count_of(procedures_, r)}});
  }
  /// The sign that a template has around {{text}}, where it is in the text, too.
  std::string spoils(std::string_view construct, std::string_view said) const {
    const Template* t = pack_.find(construct);
    if (!t) return {};
    for (const TemplateLine& l : *t)
      for (std::size_t i = 1; i + 1 < l.pieces.size(); ++i) {
        const std::string &before = l.pieces[i - 1].text, &behind = l.pieces[i + 1].text;
        if (!l.pieces[i].is_variable || l.pieces[i].text != "text" || l.pieces[i - 1].is_variable ||
            l.pieces[i + 1].is_variable || before.empty() || behind.empty())
          continue;
        if (pack_.quotes != TemplatePack::Quotes::refused && is_in_signs(l, i)) continue;
        const char c = behind.front();
        const bool is_sign =
            c > 32 && c < 127 && !(c >= '0' && c <= '9') && !((c | 32) >= 'a' && (c | 32) <= 'z');
        if (is_sign && said.find(c) != std::string_view::npos) return std::string(1, c);
      }
    return {};
  }
  /// A text that is known before the program runs; nothing = it has values that are not.
  std::optional<std::string> constant_text(std::span<const std::uint32_t> values) {
    std::string said;
    for (const std::uint32_t v : values) {
      // How a controller prints the others is its own.
      const std::uint32_t t = expression(v).type;
      if (expression(v).constant == RMP_NONE || t == RMP_TYPE_REAL || t == RMP_TYPE_BOOL)
        return std::nullopt;
      said += text(v);
    }
    return said;
  }
  /// Texts in their signs and values, as the controller's own lines join them.
  std::string joined(std::span<const std::uint32_t> values) {
    std::vector<std::pair<std::string, bool>> parts;  // text, and whether it is a constant
    for (const std::uint32_t v : values) {
      const std::uint32_t one[] = {v};
      const auto said = constant_text(one);
      if (said && !parts.empty() && parts.back().second) parts.back().first += *said;
      else parts.emplace_back(said ? *said : text(v), said.has_value());
    }
    if (parts.empty()) parts.emplace_back("", true);
    std::string out;
    for (const auto& [part, is_text] : parts) {
      if (!out.empty()) out += pack_.between_values;
      if (is_text && !pack_.text_sign.empty() && pack_.quotes == TemplatePack::Quotes::refused &&
          part.find(pack_.text_sign) != std::string::npos)
        cannot("notation for " + pack_.text_sign + " within a text",
               "Remove it from the text, or set quotes in the pack.");
      out += is_text ? pack_.text_sign + within_signs(pack_, part) + pack_.text_sign : part;
    }
    return out;
  }
  /// Fills in what a message says; false = said why not.
  bool say_values(Variables& v, std::string_view construct, std::span<const std::uint32_t> values) {
    const auto said = constant_text(values);
    if (!said && !uses(pack_.find(construct), {"values"})) {
      cannot("notation for values within texts: the template \"" + std::string(construct) +
                 "\" has no {{values}}",
             flat_hint());
      return false;
    }
    if (const std::string bad = said ? spoils(construct, *said) : ""; !bad.empty()) {
      cannot("notation for " + bad + " within a text",
             bad == pack_.text_sign ? "Remove it from the text, or set quotes in the pack."
                                    : "Remove it from the text.");
      return false;
    }
    v["text"] = word(said.value_or(""));
    v["values"] = word(uses(pack_.find(construct), {"values"}) ? joined(values) : std::string());
    for (const char* each : {"text", "values"})
      for (const char c : v[each].text)
        if (static_cast<unsigned char>(c) < 32) {
          cannot("texts with control characters", "Remove them from the text.");
          return false;
        }
    return true;
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    const bool is_message = pack_.find("message") != nullptr;
    if (!is_message && !pack_.find("comment")) return cannot("messages", "Remove the statement.");
    const char* construct = is_message ? "message" : "comment";
    Variables v;
    if (!say_values(v, construct, values)) return;
    if (!is_message) warn(pack_.title + " cannot write texts; this one becomes a comment");
    emit(construct, v);
  }
  // Where there are only jumps, blocks are made of them: each has a label for where it goes on, and
  // one behind it.
  std::uint64_t new_label() { return kJump + jumps_++; }
  Variables to_label(std::uint64_t key) {
    const Variable number = count_of(labels_, key);
    return {{"label", word(own_names_.of(key, "L" + number.text))},
            {"label_line", mark(key)},
            {"number", number}};
  }
  void set_label(std::uint64_t key) {
    starts_[key] = body_.size();
    emit("label", to_label(key));
  }
  void jump(std::uint64_t key) { emit("goto", to_label(key)); }
  /// Goes on here where the condition holds, else at `other`.
  void jump_unless(std::uint32_t c, std::uint64_t other) {
    Variables v = condition(c);
    if (pack_.find("jump_unless")) {
      v.merge(to_label(other));
      return emit("jump_unless", v);
    }
    const std::uint64_t here = new_label();
    v.merge(to_label(here));
    emit("jump_if", v);
    jump(other);
    set_label(here);
  }
  struct Block {
    std::uint64_t begin = 0, other = 0, behind = 0;
  };
  void if_begin(std::uint32_t c) override {
    if (pack_.find("if_begin")) return emit("if_begin", condition(c), 0, 1);
    blocks_.push_back({0, new_label(), 0});
    jump_unless(c, blocks_.back().other);
  }
  void else_if(std::uint32_t c) override { emit("else_if", condition(c), -1, 1); }
  void else_() override {
    if (pack_.find("if_begin")) return emit("else", {}, -1, 1);
    Block& b = blocks_.back();
    b.behind = new_label();
    jump(b.behind);
    set_label(b.other);
  }
  void if_end() override {
    if (pack_.find("if_begin")) return emit("if_end", {}, -1);
    const Block b = blocks_.back();
    blocks_.pop_back();
    set_label(b.behind ? b.behind : b.other);
  }
  void while_begin(std::uint32_t c) override {
    loops_.push_back(0);
    if (pack_.find("while_begin")) return emit("while_begin", condition(c), 0, 1);
    blocks_.push_back({new_label(), 0, new_label()});
    loops_.back() = blocks_.back().behind;
    set_label(blocks_.back().begin);
    jump_unless(c, blocks_.back().behind);
  }
  void while_end() override {
    loops_.pop_back();
    if (pack_.find("while_begin")) return emit("while_end", {}, -1);
    const Block b = blocks_.back();
    blocks_.pop_back();
    jump(b.begin);
    set_label(b.behind);
  }
  void repeat_begin() override {
    loops_.push_back(0);
    emit("repeat_begin", {}, 0, 1);
  }
  void repeat_end(std::uint32_t c) override {
    loops_.pop_back();
    emit("repeat_end", condition(c), -1);
  }
  void loop_begin() override {
    loops_.push_back(0);
    emit("loop_begin", {}, 0, 1);
  }
  void loop_end() override {
    loops_.pop_back();
    emit("loop_end", {}, -1);
  }
  /// What is made of jumps is left by one.
  void exit_loop() override {
    if (!loops_.empty() && loops_.back() != 0) return jump(loops_.back());
    emit("exit", {});
  }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t,
                 bool) override {
    loops_.push_back(0);
    emit(
        "for_begin",
        {{"name", word(name(s))}, {"from", value_of(from)}, {"to", value_of(to)}, {"step", num(1)}},
        0, 1);
  }
  void for_end(std::uint32_t s) override {
    loops_.pop_back();
    emit("for_end", {{"name", word(name(s))}}, -1);
  }
  void go_to(std::uint32_t l) override {
    emit("goto", {{"label", word(name(l))},
                  {"label_line", mark(kLabel + l)},
                  {"number", count_of(labels_, kLabel + l)}});
  }
  void label(std::uint32_t l) override {
    starts_[kLabel + l] = body_.size();
    emit("label", {{"label", word(name(l))},
                   {"label_line", mark(kLabel + l)},
                   {"number", count_of(labels_, kLabel + l)}});
  }
  /// Stands for the number of a line that may not be written yet.
  static Variable mark(std::uint64_t key) { return word("\x01" + std::to_string(key) + "\x01"); }
  void return_(std::uint32_t v) override {
    if (v != RMP_NONE || in_routine_ == 0) return cannot("RETURN here");
    emit("return", {});
  }
  Variables condition(std::uint32_t c) { return {{"condition", word(text(c))}}; }
  /// The way out where the structured form does not say it.
  std::string flat_hint() const {
    return task_.form == kPostFlat ? "Rewrite it without them."
                                   : "Post the flattened program (form = \"flat\").";
  }
  /// False = said.
  bool seconds(Variables& v, std::uint32_t e, std::string_view construct) {
    if (const auto s = known(e)) {
      v.emplace("seconds", num(*s));
      v.emplace("milliseconds", num(*s * 1000));
      return true;
    }
    // What is computed stands there as it is.
    if (uses(pack_.find(construct), {"milliseconds"})) {
      cannot("computed times, in milliseconds",
             "Give a number of seconds, or write the template with {{seconds}}.");
      return false;
    }
    v.emplace("seconds", word(text(e)));
    return true;
  }
  void wait_time(std::uint32_t e) override {
    Variables v;
    if (seconds(v, e, "wait_time")) emit("wait_time", v);
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    Variables v = condition(c);
    if (timeout == RMP_NONE) return emit("wait_for", v);
    if (!seconds(v, timeout, "wait_for_timeout")) return;
    const std::uint32_t told = system_symbol("R_TIMEOUT");
    const bool is_asked = told != RMP_NONE && is_used(told);
    const Template* t = pack_.find("wait_for_timeout");
    if (is_asked && t && !uses(t, {"timed_out"}))
      return cannot(
          "outcome of WAIT FOR with a TIMEOUT (R_TIMEOUT): the template "
          "\"wait_for_timeout\" does not set {{timed_out}}",
          "Set it there, such as {{timed_out}} = not ({{condition}}).");
    v["timed_out"] = word(is_asked ? name(told) : std::string());
    emit("wait_for_timeout", v);
  }
  void pause(std::uint32_t m) override {
    Variables v{{"text", word("")}, {"values", word("")}};
    const std::uint32_t one[] = {m};
    if (m != RMP_NONE && uses(pack_.find("pause"), {"text", "values"})) {
      if (!say_values(v, "pause", one)) return;
    } else if (m != RMP_NONE && (pack_.find("message") || pack_.find("comment"))) {
      message(one, true);
    } else if (m != RMP_NONE) {
      warn("the text of PAUSE is not written: the template \"pause\" has no {{text}}",
           "Remove it here, or add it to the template.");
    }
    emit("pause", v);
  }
  void halt() override { emit("halt", {}); }

  // ---- motions ----
  void forget() override { speed_.forget(); }
  /// Says which attributes the template of a motion does not write.
  void tell_dropped(const Motion& m) {
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    const char* construct = m.interpolation == RMP_MOVE_LIN      ? "lin"
                            : m.interpolation == RMP_MOVE_CIRCLE ? "circle"
                            : pack_.find("ptp_pose")             ? "ptp_pose"
                                                                 : "ptp_joints";
    const Template* t = pack_.find(construct);
    if (!t) return;
    struct Row {
      std::uint32_t attribute;
      const char* word;
      double standard;
      std::initializer_list<std::string_view> variables;
    };
    const Row of_ptp[] = {
        {RMP_ATTR_SPEED_PTP, "SPEED_PTP", 100, {"speed", "speed_m", "speed_ptp", "speed_percent"}},
        {RMP_ATTR_ACC_PTP, "ACC_PTP", 100, {"acc"}},
        {RMP_ATTR_C_PTP, "C_PTP", 0, {"blend", "blend_ptp", "passes"}}};
    const Row of_path[] = {{RMP_ATTR_SPEED, "SPEED", 250, {"speed", "speed_m", "speed_percent"}},
                           {RMP_ATTR_SPEED_ORI, "SPEED_ORI", 90, {"speed_ori"}},
                           {RMP_ATTR_ACC, "ACC", 100, {"acc"}},
                           {RMP_ATTR_C_CP, "C_CP", 0, {"blend", "passes"}},
                           {RMP_ATTR_C_SPEED, "C_SPEED", 100, {}}};
    const auto look = [&](const Row& r) {
      const auto& a = m[r.attribute];
      // Where the program sets the system's variable, every motion after it is meant.
      if ((!a.given && (a.known || a.expression == RMP_NONE)) || a.known == r.standard ||
          uses(t, r.variables))
        return;
      const std::string way = r.variables.size() == 0
                                  ? std::string("templates have no variable for it")
                                  : "the template \"" + std::string(construct) + "\" has no {{" +
                                        std::string(*r.variables.begin()) + "}}";
      warn(std::string(r.word) + " is not written: " + way,
           "Remove it here" +
               std::string(r.variables.size() == 0 ? "." : ", or add it to the template."));
    };
    if (is_ptp) std::for_each(std::begin(of_ptp), std::end(of_ptp), look);
    else std::for_each(std::begin(of_path), std::end(of_path), look);
    tell_pass(m, *t, construct);
    const auto& time = m[RMP_ATTR_TIME];
    if (time.given && time.known != -1.0 && !uses(t, {"time"}))
      fail("TIME is not written: the template \"" + std::string(construct) + "\" has no {{time}}",
           "Give SPEED instead, or add it to the template.");
  }
  /// C_PASS without a distance: controllers have their own, and a run stops but for PTP in a TIME.
  void tell_pass(const Motion& m, const Template& t, const char* construct) {
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    const auto& pass = m[RMP_ATTR_C_PASS];
    const auto& blend = m[is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP];
    const bool has_distance = blend.known ? *blend.known > 0 : blend.expression != RMP_NONE;
    if (has_distance || !pass.given || pass.known == 0.0) return;
    const std::string give = is_ptp ? "Give C_PTP" : "Give C_CP";
    if (!pass.known && uses(&t, {"passes"}))
      return cannot("a computed C_PASS", "Write TRUE or FALSE.");
    const std::string of = "the template \"" + std::string(construct) + "\" ";
    const std::string in_a_run = post::at_c_pass_in_a_run(*task_.code, m);
    const std::string as_in_a_run = post::may_pass_in_a_run(*task_.code, m)
                                        ? "and the simulated robot " + in_a_run
                                        : "as in a run";
    if (uses(&t, {"passes"}))
      note("C_PASS without a distance is written as " + of +
               "has it: the controller chooses the distance, and the simulated robot " + in_a_run,
           give + ".");
    else if (uses(&t, {"blend", "blend_ptp"}))
      note("C_PASS without a distance is written as a stop, " + as_in_a_run + ": " + of +
               "has no {{passes}}",
           give + ", or add it to the template.");
    else
      note("C_PASS is written as a stop, " + as_in_a_run + ": " + of + "has no {{passes}}",
           "Remove it here, or add it to the template.");
  }
  Variables motion_variables(const Motion& m) {
    Variables v;
    const auto put = [&](const char* name, std::uint32_t a, double otherwise) {
      if (m[a].known) v[name] = num(*m[a].known);
      else if (m[a].expression == RMP_NONE) v[name] = num(otherwise);
      else v[name] = word(text(m[a].expression));
    };
    if (m.until != RMP_NONE) cannot("motions that end on a condition");
    if (m.incremental)
      cannot("increments", task_.form == kPostFlat
                               ? "Move to the target pose itself: after UNTIL it is unknown."
                               : "Post the flattened program, or move to the target pose itself.");
    for (const auto& [a, what] : {std::pair{RMP_ATTR_TOOL, "tools of single motions"},
                                  {RMP_ATTR_FRAME, "frames of motions"}})
      if (m[a].given) cannot(what);
    if (m[RMP_ATTR_WOBBLE].given && m[RMP_ATTR_WOBBLE].known != 0.0) cannot("weaving");
    if (m[RMP_ATTR_DEVICE].given && m[RMP_ATTR_DEVICE].known != 1.0) cannot("other devices");
    if (m[RMP_ATTR_ADAX_CONTROL].given && m[RMP_ATTR_ADAX_CONTROL].known != 0.0)
      cannot("control of additional axes");
    tell_dropped(m);
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    put("speed", is_ptp ? RMP_ATTR_SPEED_PTP : RMP_ATTR_SPEED, is_ptp ? 100 : 250);
    put("speed_ptp", RMP_ATTR_SPEED_PTP, 100);
    put("speed_ori", RMP_ATTR_SPEED_ORI, 90);
    put("acc", is_ptp ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC, 100);
    put("blend", is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP, 0);
    put("blend_ptp", RMP_ATTR_C_PTP, 0);
    put("time", RMP_ATTR_TIME, -1);
    if (v["time"].number && *v["time"].number < 0) v["time"] = word("");
    const auto& speed = v["speed"];
    if (speed.number) v["speed_m"] = num(*speed.number / 1000);
    if (is_ptp) v["speed_percent"] = speed;
    else if (speed.number && profile_.max_speed > 0)
      v["speed_percent"] = num(*speed.number / profile_.max_speed * 100);
    const bool changes = speed_.changes((is_ptp ? "p" : "l") + speed.text);
    if (!speed.number) speed_.forget();
    v["speed_changed"] = num(changes ? 1 : 0);
    const bool passes = (m[RMP_ATTR_C_PASS].given && m[RMP_ATTR_C_PASS].known != 0.0) ||
                        !v["blend"].number || *v["blend"].number > 0;  // computed: it may
    v["passes"] = num(passes ? 1 : 0);
    return v;
  }
  /// Whether a template that writes joints one by one writes all of them; false = said.
  bool has_all_joints(const char* construct, std::size_t joints, std::size_t external) {
    const Template* t = pack_.find(construct);
    std::size_t last_q = 0, last_e = 0;
    bool has_list = false;
    if (t)
      for (const TemplateLine& l : *t)
        for (const Piece& p : l.pieces) {
          if (!p.is_variable) continue;
          last_q = std::max(last_q, joint_number(p.text, 'q'));
          last_e = std::max(last_e, joint_number(p.text, 'e'));
          has_list = has_list || p.text == "joints";
        }
    if (has_list || last_q == 0 || (last_q >= joints && last_e >= external)) return true;
    fail("the joint " +
             (last_q < joints ? "q" + std::to_string(last_q + 1)
                              : "e" + std::to_string(last_e + 1)) +
             " of this target is lost: the template \"" + construct + "\" does not write it",
         "Write all joints of the robot there, or {{joints}}.");
    return false;
  }
  /// Angles that the pack does not write stay as they are from the first pose on; false = said.
  bool keeps_other_angles(const std::array<double, 4>& ori, bool turns) {
    const std::size_t count = pack_.orientation == post::Orientation::quaternion ? 4 : 3;
    for (std::size_t i = 0; i < count; ++i) {
      if (pack_.angles.find("abcd"[i]) != std::string::npos) continue;
      if (!first_angles_[i]) first_angles_[i] = ori[i];
      double far = std::fabs(ori[i] - *first_angles_[i]);
      if (turns) far = std::min(far, std::fabs(far - 360));
      if (far < (turns ? 1e-3 : 1e-5)) continue;
      fail("the orientation of this pose is lost: its angle " + std::string(1, "abcd"[i]) +
               " differs from the previous one, and " + pack_.title + " does not write it",
           "Keep the orientation of the first pose, or list the angle in the pack's head.");
      return false;
    }
    return true;
  }
  /// Values of a target; `prefix` "via_" for the first of a circle.
  bool place(Variables& v, const post::Target& t, const std::string& prefix, bool is_joints,
             const char* motion) {
    const PostPoint* p = t.point;
    if (!p) {
      cannot("computed targets", flat_hint());
      return false;
    }
    Variables own;
    if (p->has_pose && p->role != RMP_ROLE_POSITION) {
      const auto at = post::placed(p->pose, pack_.orientation);
      static constexpr const char* kNames[] = {"x", "y", "z", "a", "b", "c", "d"};
      for (std::size_t i = 0; i < 3; ++i) own[prefix + kNames[i]] = num(at.mm[i] * pack_.length);
      const bool turns = pack_.orientation != post::Orientation::quaternion &&
                         pack_.orientation != post::Orientation::rotation_vector;
      for (std::size_t i = 0; i < 4; ++i)
        own[prefix + kNames[3 + i]] = num(at.ori[i] * (turns ? pack_.angle : 1.0));
      if (!keeps_other_angles(at.ori, turns)) return false;
    } else if (!is_joints) {
      cannot("targets of " + type_name(expression(t.expression).type) + " for this motion",
             "Give a POSE.");
      return false;
    }
    if (is_joints || !p->q.empty()) {
      const auto a = axes(*p);
      const auto e = external_axes(*p);
      std::string all;
      unsigned turned = 0;
      for (const auto* values : {&a, &e})
        for (const double x : *values)
          if (!(std::fabs(x) < kGreatest)) {
            fail("a joint value of this target is beyond the controller's range",
                 "Check what it is computed from.");
            return false;
          }
      const char* construct = is_joints ? "point_joints" : "point";
      if (!pack_.find(construct)) construct = motion;
      if (!has_all_joints(construct, a.size(), e.size())) return false;
      for (std::size_t i = 0; i < a.size(); ++i) {
        own["q" + std::to_string(i + 1)] = num(a[i] * pack_.angle);
        all += (i ? pack_.separator : "") + num(a[i] * pack_.angle).text;
        turned |= (a[i] < 0 ? 1U : 0U) << std::min<std::size_t>(i, 31);
      }
      for (std::size_t i = 0; i < e.size(); ++i) {
        own["e" + std::to_string(i + 1)] = num(e[i]);
        all += pack_.separator + num(e[i]).text;
      }
      own["joints"] = word(all);
      own["turns"] = num(turned);
    }
    own["status"] = num(p->status);
    std::string key = is_joints ? "j" : "p";
    for (const auto& [name, value] : own) key += name + "=" + value.text + " ";
    std::string point;
    std::size_t number = 0;
    if (pack_.find(is_joints ? "point_joints" : "point")) {
      const auto [n, is_new] = table_.add(key);
      if (is_new) {
        const auto& x = expression(t.expression);
        names_of_points_.push_back(own_names_.unique(x.op == RMP_EXPR_SYMBOL
                                                         ? std::string(symbol(x.symbol).name)
                                                         : "P" + std::to_string(n + 1)));
        Variables of = own;
        // As the template of points has them, without the prefix.
        for (const auto& [name, value] : own)
          if (!prefix.empty() && name.starts_with(prefix)) of[name.substr(prefix.size())] = value;
        of["name"] = word(names_of_points_.back());
        of["number"] = num(static_cast<double>(n + 1));
        points_.emplace_back(is_joints ? "point_joints" : "point", of, at_);
      }
      point = names_of_points_[n];
      number = n + 1;
    }
    v.insert(own.begin(), own.end());
    v[prefix.empty() ? "point" : "via"] = word(point);
    if (number > 0)
      v[prefix.empty() ? "point_number" : "via_number"] = num(static_cast<double>(number));
    return true;
  }
  void ptp(const Motion& m) override {
    Variables v = motion_variables(m);
    const auto& t = m.targets[0];
    const bool is_joints = t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
    const bool has_pose = (caps_.motions & kPostPtpPose) != 0;
    const bool has_joints = (caps_.motions & kPostPtpJoints) != 0;
    // Said by joints where poses are not, as far as they are known; and the other way.
    const bool by_joints = is_joints ? has_joints : !has_pose;
    const char* construct = by_joints ? "ptp_joints" : "ptp_pose";
    if (!place(v, t, "", by_joints, construct)) return;
    if (by_joints ? !has_joints : !has_pose)
      return cannot(by_joints ? "motions to joint values" : "joint motions to poses");
    emit(construct, v);
  }
  void lin(const Motion& m) override {
    Variables v = motion_variables(m);
    if (place(v, m.targets[0], "", false, "lin")) emit("lin", v);
  }
  void circle(const Motion& m) override {
    Variables v = motion_variables(m);
    if (m.targets.size() != 2) return fail("a circle has two targets");
    if (!place(v, m.targets[0], "via_", false, "circle") ||
        !place(v, m.targets[1], "", false, "circle"))
      return;
    v["end"] = v["point"];
    emit("circle", v);
  }

  const TemplatePack& pack_;
  PackNames own_names_;
  post::File body_;
  post::Points table_;
  std::vector<std::string> names_of_points_;
  std::vector<std::tuple<std::string, Variables, rmp_span>> points_;
  post::Modal<std::string> speed_;
  std::array<std::optional<double>, 4> first_angles_;  ///< that are not written
  static constexpr std::uint64_t kLabel = 1ULL << 40U;
  static constexpr double kGreatest = 1e12;
  static constexpr std::uint64_t kJump = 1ULL << 41U;
  std::map<std::uint64_t, std::size_t> starts_;  ///< lines of routines, and of labels (kLabel +)
  std::map<std::uint64_t, std::size_t> procedures_, labels_;  ///< their numbers
  std::vector<std::uint64_t> loops_;  ///< around here: the label behind one of jumps, else 0
  std::vector<Block> blocks_;         ///< that are made of jumps, open
  std::uint64_t jumps_ = 1;           ///< labels of blocks, counted
};

class TemplatePost final : public Post {
 public:
  explicit TemplatePost(std::shared_ptr<const TemplatePack> pack) : pack_(std::move(pack)) {}
  [[nodiscard]] const PostCapabilities& capabilities() const override { return pack_->caps; }
  Result<void> write(const PostTask& task, const Params&, PostOutput& output,
                     Progress& progress) const override {
    return TemplateWriter(task, output, *pack_, progress).run();
  }

 private:
  std::shared_ptr<const TemplatePack> pack_;
};

}  // namespace

const std::string& pack_name(const TemplatePack& p) { return p.name; }
const std::string& pack_title(const TemplatePack& p) { return p.title; }
std::unique_ptr<Post> make_template_post(std::shared_ptr<const TemplatePack> pack) {
  return std::make_unique<TemplatePost>(std::move(pack));
}

}  // namespace robomosp::program_post

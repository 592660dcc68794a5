// SPDX-License-Identifier: Apache-2.0
// Staubli VAL3: an application of .pjx, .dtx and .pgx.
#include <algorithm>
#include <cmath>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kVal3Style{.comment = "//",
                       .quotes = "\"",
                       .name_first = "_",
                       .name_rest = "_",
                       .signs = {"==", "!=", "<>", "<=", ">="},
                       .has_lines = true,
                       .joins_in_brackets = false,
                       .hex = {}};
constexpr Binary kVal3Binaries[] = {
    {"or", 10, Op::or_}, {"xor", 11, Op::exor}, {"and", 12, Op::and_}, {"==", 20, Op::eq},
    {"!=", 20, Op::ne},  {"<>", 20, Op::ne},    {"<", 20, Op::lt},     {">", 20, Op::gt},
    {"<=", 20, Op::le},  {">=", 20, Op::ge},    {"+", 30, Op::add},    {"-", 30, Op::sub},
    {"*", 40, Op::mul},  {"/", 40, Op::div},    {"%", 40, Op::mod},    {"&", 30, Op::add}};

/// A tag of XML as far as applications have them.
struct Tag {
  std::string name;  ///< lower-case, without a prefix
  std::map<std::string, std::string> attributes;
  bool is_end = false, is_closed = false;
  std::size_t begin = 0, end = 0;  ///< bytes of the file
  std::uint32_t line = 1;
};

std::string unescaped(std::string_view s) {
  std::string out;
  static constexpr std::pair<std::string_view, char> kNames[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  for (std::size_t i = 0; i < s.size(); ++i) {
    bool found = false;
    for (const auto& [name, c] : kNames)
      if (!found && s.substr(i).starts_with(name)) {
        out += c;
        i += name.size() - 1;
        found = true;
      }
    if (!found) out += s[i];
  }
  return out;
}
/// All tags of a text; CDATA is a tag named "![cdata[", whose bytes are its text.
std::vector<Tag> tags(std::string_view text) {
  std::vector<Tag> out;
  std::uint32_t line = 1;
  std::size_t i = 0, counted = 0;
  const auto line_at = [&](std::size_t k) {
    for (; counted < k; ++counted) line += text[counted] == '\n';
    return line;
  };
  while ((i = text.find('<', i)) != std::string_view::npos) {
    Tag t;
    if (text.substr(i).starts_with("<![CDATA[")) {
      t.name = "![cdata[";
      t.begin = i + 9;
      t.end = std::min(text.size(), text.find("]]>", i));
      t.begin = std::min(t.begin, t.end);
      t.line = line_at(t.begin);
      out.push_back(t);
      i = t.end;
      if (i >= text.size()) break;
      continue;
    }
    if (text.substr(i).starts_with("<!--")) {
      i = text.find("-->", i);
      if (i == std::string_view::npos) break;
      continue;
    }
    t.begin = i;
    t.line = line_at(i);
    ++i;
    if (i < text.size() && text[i] == '/') {
      t.is_end = true;
      ++i;
    }
    const auto is_blank = [&](std::size_t k) {
      return text[k] == ' ' || text[k] == '\t' || text[k] == '\n' || text[k] == '\r';
    };
    std::size_t e = i;
    while (e < text.size() && !is_blank(e) && text[e] != '>' && text[e] != '/') ++e;
    t.name = lower(text.substr(i, e - i));
    if (const std::size_t colon = t.name.find(':'); colon != std::string::npos)
      t.name.erase(0, colon + 1);
    i = e;
    while (i < text.size() && text[i] != '>') {
      if (text[i] == '/' || is_blank(i) || text[i] == '?') {
        t.is_closed = text[i] == '/';
        ++i;
        continue;
      }
      e = i;
      while (e < text.size() && text[e] != '=' && text[e] != '>' && !is_blank(e)) ++e;
      std::string key = lower(text.substr(i, e - i));
      if (const std::size_t colon = key.find(':'); colon != std::string::npos)
        key.erase(0, colon + 1);
      i = e;
      while (i < text.size() && (is_blank(i) || text[i] == '=')) ++i;
      if (i < text.size() && (text[i] == '"' || text[i] == '\'')) {
        const std::size_t close = text.find(text[i], i + 1);
        if (close == std::string_view::npos) return out;
        // "xsi:type" and "type" are two things.
        if (key == "type" && text.substr(e > 8 ? e - 8 : 0, 4) == "xsi:") key = "kind";
        t.attributes.insert_or_assign(key, unescaped(text.substr(i + 1, close - i - 1)));
        i = close + 1;
      } else if (i == e) {
        ++i;
      }
    }
    t.end = i;
    out.push_back(std::move(t));
  }
  return out;
}
std::string base_name(std::string s) {
  if (const std::size_t slash = s.find_last_of("/\\"); slash != std::string::npos)
    s.erase(0, slash + 1);
  return s;
}

class Val3Reader final : public Reader {
 public:
  using Reader::Reader;

  [[nodiscard]] MakerLanguage language() const override { return MakerLanguage::val3; }

  void run() override {
    name_ = std::string(stem(files_[0].name));
    comment_file_ = static_cast<std::uint32_t>(-1);
    if (extension(files_[0].name) == "pjx") missing();
    else
      note({}, "the data of the application are read with its project",
           "Read the .pjx file together with the files beside it.");
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (extension(files_[f].name) == "dtx") data(f);
    for (std::size_t f = 0; f < files_.size(); ++f)
      if (extension(files_[f].name) == "pgx") programs(f);
    if (const std::size_t old = of_version_6(); old < files_.size())
      fail({static_cast<std::uint32_t>(old), 1, 1, 0, 0},
           "this program is in the format of VAL 3 s6 (CS8C), which is not read",
           "Convert the application to s7 or later in Staubli Robotics Suite, and read its .pjx.");
    else if (programs_.empty()) fail({}, "no program (.pgx) is among the files");
    std::size_t main = programs_.size();
    for (std::size_t i = 0; i < programs_.size(); ++i) {
      const Program& p = programs_[i];
      if (lower(p.name) == "start" && p.parameters.empty() && main == programs_.size()) main = i;
    }
    if (main == programs_.size() && programs_.size() == 1 && programs_[0].parameters.empty())
      main = 0;
    if (main == programs_.size() && !programs_.empty())
      note({}, "no program is named start; the program has no statements",
           "Call one of the procedures after BEGIN.");
    for (std::size_t i = 0; i < programs_.size(); ++i)
      if (i != main) announce(key_of(programs_[i]), programs_[i].parameters, kNone);
    for (std::size_t i = 0; i < programs_.size(); ++i) {
      if (is_cancelled()) return;
      program(programs_[i], i == main);
    }
  }

 protected:
  [[nodiscard]] bool begins_without_value(K) const override { return false; }

 private:
  struct Program {
    std::string name;
    std::vector<Parameter> parameters;
    std::vector<Tag> locals;
    Part code;
    std::size_t file = 0;
    At at;
  };
  /// A motion descriptor. What the programs change of it is in variables.
  struct Motions {
    std::string name;
    std::map<std::string, double> values{
        {"vel", 100}, {"accel", 100}, {"tvel", 99999}, {"leave", 0}};
    std::string blend = "off";
    At at;
  };
  /// The frame or tool that a value is relative to: its name and index; "" = world or flange.
  struct Father {
    std::string name;
    std::int64_t index = 0;
    bool operator==(const Father&) const = default;
  };

  std::span<const Binary> binaries() const override { return kVal3Binaries; }
  std::string_view not_word() const override { return "!"; }
  int not_precedence() const override { return 60; }

  At at_tag(std::size_t f, const Tag& t) const {
    const std::string_view text = files_[f].text;
    const std::size_t before =
        t.begin == 0 ? std::string_view::npos : text.rfind('\n', t.begin - 1);
    return {static_cast<std::uint32_t>(f), t.line,
            static_cast<std::uint32_t>(t.begin -
                                       (before == std::string_view::npos ? 0 : before + 1) + 1),
            static_cast<std::uint32_t>(t.begin),
            static_cast<std::uint32_t>(std::max(t.begin, t.end))};
  }
  void missing() {
    for (const std::string& name : val3_needs(files_[0])) {
      const bool is_there = std::any_of(files_.begin(), files_.end(), [&](const SourceFile& f) {
        return lower(f.name) == lower(name);
      });
      if (!is_there)
        fail({}, "the file " + name + " of the project is missing", "Put it beside the project.");
    }
  }
  std::optional<Type> type_named(const std::string& low) const {
    static const std::map<std::string, Type, std::less<>> kTypes{
        {"num", kReal},   {"bool", kBool},    {"string", kString}, {"trsf", kPose},
        {"point", kPose}, {"pointrx", kPose}, {"pointrs", kPose},  {"frame", kPose},
        {"tool", kPose},  {"joint", kJoint},  {"jointrx", kJoint}};
    const auto it = kTypes.find(low);
    return it == kTypes.end() ? std::nullopt : std::optional(it->second);
  }
  static double number(const Tag& t, const char* key) {
    const auto it = t.attributes.find(key);
    return it == t.attributes.end() ? 0 : std::strtod(it->second.c_str(), nullptr);
  }
  static std::string text(const Tag& t, const char* key) {
    const auto it = t.attributes.find(key);
    return it == t.attributes.end() ? std::string() : it->second;
  }
  Ex value_of(const std::string& low, const Tag& v) {
    if (low == "num") return real(number(v, "value"));
    if (low == "bool") return boolean(lower(text(v, "value")) == "true");
    if (low == "string") return string(text(v, "value"));
    if (low.starts_with("joint"))
      return joints({real(number(v, "j1")), real(number(v, "j2")), real(number(v, "j3")),
                     real(number(v, "j4")), real(number(v, "j5")), real(number(v, "j6"))},
                    {});
    return pose({real(number(v, "x")), real(number(v, "y")), real(number(v, "z"))},
                orientation("ORIXYZ",
                            {real(number(v, "rx")), real(number(v, "ry")), real(number(v, "rz"))}));
  }
  Ex point_value(const Tag& v, const Ex& p) {
    const std::string shoulder = lower(text(v, "shoulder")), elbow = lower(text(v, "elbow")),
                      wrist = lower(text(v, "wrist"));
    const std::vector<Ex> any(6, integer(-128));  // VAL3 says no turns
    if (shoulder.empty() || shoulder == "ssame" || shoulder == "sfree")
      return target(p, integer(-1), any, {});
    // Lefty is in front; enegative is the sign of joint 3, which a shoulder behind turns round.
    const bool behind = shoulder == "righty";
    const int status = (behind ? 1 : 0) | ((elbow == "enegative") != behind ? 2 : 0) |
                       (wrist == "wnegative" ? 4 : 0);
    return target(p, integer(status), any, {});
  }
  void data(std::size_t f) {
    std::string name, low;
    std::vector<Tag> values;
    Tag head;
    bool is_open = false;
    const auto finish = [&] {
      if (std::exchange(is_open, false)) declare_data(f, head, values);
    };
    for (const Tag& t : tags(files_[f].text)) {
      if ((t.name == "data" || t.name == "local") && !t.is_end) {
        finish();
        if (text(t, "name").empty()) continue;
        head = t;
        values.clear();
        is_open = true;
        if (t.is_closed) finish();
      } else if (t.name == "data" && t.is_end) {
        finish();
      } else if (t.name == "value" && is_open && values.size() < 10000) {
        values.push_back(t);
      }
    }
    finish();
  }
  void declare_data(std::size_t f, const Tag& head, const std::vector<Tag>& values,
                    bool is_local = false) {
    const At at = at_tag(f, head);
    const std::string name = text(head, "name"), low = lower(text(head, "type"));
    if (globals_.contains(lower(name)) && !is_local) {
      fail(at, name + " is declared twice");
      return;
    }
    const double size = std::max(1.0, number(head, "size"));
    if (low == "mdesc") {
      Motions m;
      m.name = name;
      m.at = at;
      for (const Tag& v : values) {
        if (text(v, "key") != "0" && values.size() > 1) continue;
        m.values["vel"] = number(v, "vel");
        m.values["accel"] = number(v, "accel");
        if (v.attributes.contains("tmax")) m.values["tvel"] = number(v, "tmax");
        m.blend = lower(text(v, "blend"));
        m.values["leave"] = number(v, "leave");
        const bool blends = m.blend != "off" && !m.blend.empty();
        if ((v.attributes.contains("decel") && number(v, "decel") != number(v, "accel")) ||
            (blends && v.attributes.contains("reach") && number(v, "reach") != number(v, "leave")))
          warn(at_tag(f, v),
               "IRL decelerates as it accelerates, and leaves and rejoins a path at the same "
               "distance from the point; decel and reach of " +
                   name + " are left out");
      }
      if (size > 1) fail(at, name + " is an array of motion descriptors; only the first is read");
      motions_[lower(name)] = m;
      return;
    }
    if (low == "dio" || low == "aio") {
      if (size > 1) {
        std::vector<std::string> all;
        for (std::size_t i = 0; i < static_cast<std::size_t>(std::min(size, 64.0)); ++i)
          all.push_back(name + "_" + std::to_string(i));
        signals_of_[lower(name)] = {all, low == "aio"};
      } else {
        signals_of_[lower(name)] = {{name}, low == "aio"};
      }
      for (const Tag& v : values) {
        const std::string link =
            lower(text(v, "iolink").empty() ? text(v, "link") : text(v, "iolink"));
        if (link.find("out") != std::string::npos) learned_.flags.insert("output " + lower(name));
      }
      return;
    }
    const auto t = type_named(low);
    if (!t || !(size <= 10000)) {
      note(at, "IRL has no type " + text(head, "type") + "; " + name + " is left out");
      return;
    }
    Type type = *t;
    const auto n = static_cast<std::size_t>(size);
    std::vector<Ex> list(n, failed());
    const bool is_point = low.starts_with("point");
    bool has_configuration = false;
    for (const Tag& v : values)
      has_configuration = has_configuration || (is_point && v.attributes.contains("shoulder"));
    if (has_configuration || (is_point && learned_.flags.contains("target " + lower(name))))
      type = kTarget;
    std::vector<Father> fathers(n);
    bool has_father = false;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto k = static_cast<std::size_t>(std::clamp(number(values[i], "key"), 0.0, 9999.0));
      Ex e = value_of(low, values[i]);
      if (type.k == K::target) e = point_value(values[i], e);
      if (k < n) list[k] = e;
      const std::string of = lower(text(values[i], "fatherid"));
      const std::string name_of = of.substr(0, of.find('['));
      Father father;
      if (name_of != "world" && name_of != "flange") {
        father.name = name_of;
        if (const std::size_t open = of.find('['); open != std::string::npos)
          father.index = std::strtoll(of.c_str() + open + 1, nullptr, 10);
      }
      // Elements without a value are where the first is.
      if (!std::exchange(has_father, true)) std::fill(fathers.begin(), fathers.end(), father);
      if (k < n) fathers[k] = father;
    }
    if (std::any_of(fathers.begin(), fathers.end(),
                    [](const Father& x) { return !x.name.empty(); }))
      fathers_[lower(name)] = std::move(fathers);
    const Ex empty = type.k == K::target
                         ? target(identity(), integer(-1), std::vector<Ex>(6, integer(-128)), {})
                     : type.k == K::pose    ? identity()
                     : type.k == K::joint   ? joints({}, {})
                     : type.k == K::boolean ? boolean(false)
                     : type.k == K::string  ? string("")
                                            : real(0);
    std::string value;
    for (std::size_t i = 0; i < n; ++i)
      value += (i ? ", " : "") + (list[i].ok ? list[i].s : empty.s);
    if (n > 1) {
      type = array_of(type, {{0, static_cast<std::int64_t>(n) - 1}});
      value = "[" + value + "]";
    }
    Symbol& s = declare(name, type, Symbol::variable, is_local);
    declare_variable(s, value, at, is_local);
  }
  void programs(std::size_t f) {
    Program p;
    bool is_open = false;
    for (const Tag& t : tags(files_[f].text)) {
      if (t.name == "program" && !t.is_end && t.attributes.contains("name")) {
        p = Program{};
        p.name = text(t, "name");
        p.file = f;
        p.at = at_tag(f, t);
        is_open = true;
      } else if (t.name == "parameter" && !t.is_end && is_open) {
        Parameter q;
        q.foreign = text(t, "name");
        const std::string low = lower(text(t, "type"));
        const auto type = type_named(low);
        q.type = type.value_or(kReal);
        if (low.starts_with("point")) q.type = kTarget;
        q.is_out = lower(text(t, "use")) == "reference";
        if (low == "mdesc" || low == "dio" || !type)
          fail(at_tag(f, t), "IRL has no parameters of type " + text(t, "type"));
        else p.parameters.push_back(std::move(q));
      } else if (t.name == "local" && !t.is_end && is_open) {
        p.locals.push_back(t);
      } else if (t.name == "![cdata[" && is_open) {
        p.code = {t.begin, t.end, t.line};
        programs_.push_back(p);
        is_open = false;
      }
    }
  }
  /// The first file with programs in the format of VAL 3 s6; files_.size() = none.
  [[nodiscard]] std::size_t of_version_6() const {
    const auto it = std::find_if(files_.begin(), files_.end(), [](const SourceFile& f) {
      return extension(f.name) == "pgx" && f.text.find("<programList") != std::string_view::npos;
    });
    return static_cast<std::size_t>(it - files_.begin());
  }
  /// A program and a variable may have one name.
  static std::string key_of(const Program& p) { return "!" + p.name; }
  void program(const Program& p, bool is_main) {
    if (is_main) close();
    else begin(key_of(p), p.parameters, kNone, p.at);
    for (const Tag& t : p.locals) {
      // Locals of the program itself are variables of all, by their own names.
      if (is_main && globals_.contains(lower(text(t, "name")))) {
        fail(at_tag(p.file, t), text(t, "name") + " is declared twice");
        continue;
      }
      declare_data(p.file, t, {}, !is_main);
    }
    scan(p.file, kVal3Style, p.code);
    blocks_.clear();
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
      statement(at, [&] {
        one();
        if (!at_line_end()) {
          bad(here(), "\"" + std::string(peek().raw.substr(0, 40)) + "\" is not expected here");
          skip_rest();
        }
      });
    }
    comments_until(here());
    close_blocks(here());
    close();
  }

  // ---- statements ----

  void one() {
    const Token t = peek();
    const At at = t.at;
    if (t.kind != Tk::name) {
      bad(at, "a statement does not begin with \"" + std::string(t.raw.substr(0, 40)) + "\"");
      skip_rest();
      return;
    }
    const std::string& w = t.low;
    if (is("=", 1) || is("[", 1) || is(".", 1)) return assignment(at);
    static const std::set<std::string, std::less<>> kFlow{
        "if",     "else", "elseif", "while", "do",        "until",   "endif", "endwhile",
        "endfor", "for",  "switch", "case",  "endswitch", "default", "call",  "begin"};
    if (kFlow.contains(w)) linked_.clear();
    if (w == "begin" || w == "end") {
      next();
      return;
    }
    if (w == "if") {
      next();
      const std::string c = truth(at);
      accept("then");
      emit("IF " + c + " THEN", at);
      open_block("endif", "ENDIF");
      return;
    }
    if (w == "else" || w == "elseif") {
      next();
      if (!is_in("endif")) {
        bad(at, "this is outside if");
        skip_rest();
        return;
      }
      std::string head = "ELSE";
      if (w == "elseif") {
        head = "ELSIF " + truth(at) + " THEN";
        accept("then");
      }
      between(head, at);
      return;
    }
    if (w == "while") {
      next();
      const std::string c = truth(at);
      accept("do");
      emit("WHILE " + c + " DO", at);
      open_block("endwhile", "ENDWHILE");
      return;
    }
    if (w == "do") {
      next();
      emit("REPEAT", at);
      open_block("until", "UNTIL TRUE");
      return;
    }
    if (w == "until") {
      next();
      const std::string c = truth(at);
      if (is_in("until")) blocks_.back().irl = "UNTIL " + c;
    }
    if (w == "endif" || w == "endwhile" || w == "endfor" || w == "until" || w == "endswitch") {
      if (w != "until") next();
      if (w == "endfor" && is_in(w) && !steps_.empty()) {
        emit(steps_.back(), at);
        steps_.pop_back();
      }
      close_block(w, at);
      return;
    }
    if (w == "for") return for_(at);
    if (w == "switch") {
      next();
      open_case("endswitch", at);
      return;
    }
    if ((w == "case" || w == "default") && is_in("endswitch")) {
      next();
      if (w == "default") {
        open_default(at);
        return;
      }
      std::vector<ArmValue> values;
      do {
        values.push_back({expression()});
      } while (accept(","));
      open_arm(values, at);
      return;
    }
    if (w == "break") {
      next();
      if (is_in("endswitch")) return;
      bad(at, "break is outside an arm of switch");
      return;
    }
    if (w == "return") {
      next();
      emit("RETURN;", at);
      return;
    }
    if (w == "call") {
      next();
      const Token name = next();
      std::vector<Ex> args;
      if (accept("(") && !accept(")")) {
        do {
          father_ = {};
          args.push_back(expression());
          Ex& a = args.back();
          const bool is_place = a.type.k == K::pose || a.type.k == K::target;
          if (a.ok && is_place && !father_.name.empty())
            a = bad(
                at,
                "a point in a frame cannot be passed to a program, since the frame would be lost");
        } while (accept(",") && args.size() < 100);
        expect(")");
      }
      for (Ex& a : args)
        if (a.type.k == K::integer) a = as_real(a, at);
      const auto called = std::find_if(programs_.begin(), programs_.end(), [&](const Program& p) {
        return lower(p.name) == lower(name.raw);
      });
      if (called != programs_.end() && !find(lower(key_of(*called)))) {
        bad(at, "the program calls itself");
        return;
      }
      const std::string text =
          call(called != programs_.end() ? key_of(*called) : std::string(name.raw), args, at);
      if (!text.empty()) emit(text + ";", at);
      return;
    }
    if (w == "movej" || w == "movel" || w == "movec") return motion(at);
    if (w == "link" && is("(", 1)) return link(at);
    if (w == "dioset" && is("(", 1) && signals_of_.contains(peek(2).low) && is(",", 3))
      return set_bits(at);
    if (w == "taskkill" && is("(", 1) && peek(2).kind == Tk::text &&
        lower(peek(2).raw) == lower(std::string(stem(files_[0].name))) + "~" && is(")", 3)) {
      // The application's own task.
      for (int k = 0; k < 4; ++k) next();
      emit("HALT;", at);
      return;
    }
    if (is("(", 1) && (w == "logmsg" || w == "putln" || w == "put" || w == "popupmsg")) {
      next();
      next();
      const std::string list = text_parts();
      expect(")");
      if (!list.empty()) emit((w == "put" ? "WRITE(" : "WRITELN(") + list + ");", at);
      return;
    }
    if (!is("(", 1)) {
      next();
      bad(at, "\"" + std::string(t.raw.substr(0, 40)) + "\" does not begin a supported statement");
      skip_rest();
      return;
    }
    next();
    next();
    if (w == "waitendmove") {
      expect(")");
      note_line(at, "IRL motions end before the next statement, except where they are blended");
      return;
    }
    if (w == "open" || w == "close") {
      const Token tool = next();
      while (!at_line_end() && !accept(")")) next();
      Symbol& s = named_signal("hand_" + std::string(tool.raw), true, kBool, at);
      emit(s.irl + (w == "open" ? " := FALSE;" : " := TRUE;"), at);
      return;
    }
    const auto a = arguments();
    for (const Ex& e : a)
      if (!e.ok) return;
    if (w == "delay" && a.size() == 1) {
      const Ex e = as_real(a[0], at);
      if (e.is_literal && e.v < 0) bad(at, "a time must not be negative");
      else if (e.ok) emit("WAIT " + within(e, kSum) + " SEC;", at);
    } else if (w == "wait" && a.size() == 1) {
      const Ex c = converted(a[0], kBool, at);
      if (c.ok) emit("WAIT FOR " + c.s + ";", at);
    } else if (w == "watch" && a.size() == 2) {
      const Ex c = converted(a[0], kBool, at), time = as_real(a[1], at);
      if (c.ok && time.ok) emit("WAIT FOR " + c.s + " TIMEOUT " + within(time, kSum) + ";", at);
    } else if ((w == "put" || w == "putln" || w == "popupmsg" || w == "logmsg" || w == "title") &&
               a.size() == 1) {
      emit((w == "put" ? "WRITE(" : "WRITELN(") + a[0].s + ");", at);
    } else {
      static const std::set<std::string, std::less<>> kHarmless{
          "resetmotion", "enablepower", "disablepower", "cls", "gotoxy", "userpage", "restartmove"};
      const bool is_harmless =
          kHarmless.contains(w) || maker_word(language(), w) == MakerWord::tells;
      left_out(is_harmless ? RMP_FAULT_WARNING : RMP_FAULT_ERROR, at,
               "IRL has no counterpart of " + std::string(t.raw));
    }
  }
  void for_(const At& at) {
    next();
    const Token name = peek();
    will_write(name.low);
    const Ex v = primary();
    expect("=");
    const Ex from = expression();
    expect("to");
    const Ex to = expression();
    Ex step = integer(1);
    if (accept("step")) step = expression();
    accept("do");
    const bool are_numbers = is_number(v.type) && is_number(from.type) && is_number(to.type);
    if (!v.ok || !from.ok || !to.ok || !are_numbers || !step.is_literal || step.v == 0) {
      if (step.ok && v.ok && from.ok && to.ok)
        bad(at, are_numbers ? "the step of this loop is unknown" : "a loop must count numbers");
      open_unread_loop("endfor", at);
      steps_.push_back("{ no step }");
      return;
    }
    assign(v, from, at);
    emit("WHILE " + v.s + (step.v < 0 ? " >= " : " <= ") + within(to, kSum) + " DO", at);
    open_block("endfor", "ENDWHILE");
    steps_.push_back(v.s + " := " + v.s + (step.v < 0 ? " - " : " + ") +
                     (step.v < 0 ? negative(step) : step).s + ";");
  }
  /// A text of several parts; numbers that become texts stay numbers, which WRITELN shows.
  std::string text_parts() {
    std::string list;
    do {
      Ex e;
      if (is("tostring") && is("(", 1)) {
        next();
        next();
        while (!at_line_end() && !accept(",")) next();  // how it is written
        e = expression();
        expect(")");
      } else {
        e = expression(31);
      }
      if (!e.ok) return {};
      list += (list.empty() ? "" : ", ") + e.s;
    } while (accept("+") || accept("&"));
    return list;
  }
  /// link(point, frame): the frame that the point is in from now on.
  void link(const At& at) {
    next();
    next();
    const Token point = next();
    expect(",");
    const Token frame = next();
    expect(")");
    const Symbol* p = find(point.low);
    const Symbol* f = find(frame.low);
    if (!p || (p->type.k != K::target && p->type.k != K::pose)) {
      bad(at, "link() of " + std::string(point.raw.substr(0, 40)) +
                  " is not read: it is not a single declared point");
      return;
    }
    if (frame.low != "world" && (!f || f->type.k != K::pose)) {
      bad(at, "the frame " + std::string(frame.raw.substr(0, 40)) + " is not declared");
      return;
    }
    learned_.modal["link " + point.low].insert(frame.low);
    if (frame.low == "world") fathers_.erase(point.low);
    else fathers_[point.low] = {Father{.name = frame.low}};
    linked_.insert(point.low);
    emit("{ " + source_line(at) + " }", at);
  }
  /// point = here(tool, frame), then parts of it by so much, then a motion there: MOVE_INC.
  bool step(const At& at) {
    const std::string point = peek().low;
    std::size_t k = 3;
    if (!is("(", k)) return false;
    const std::string tool = peek(k + 1).low, frame = peek(k + 3).low;
    if (!is(",", k + 2) || !is(")", k + 4)) return false;
    k += 5;
    std::vector<Ex> by(3, real(0));
    const std::size_t begin = at_;
    at_ += k;
    for (;;) {
      if (peek().kind != Tk::line) break;
      while (peek().kind == Tk::line) ++at_;
      if ((is("movej") || is("movel")) && is("(", 1) && is(point, 2) && is(",", 3) && is(tool, 4)) {
        step_ = by;
        step_frame_ = frame == "world" ? Father{} : Father{.name = frame};
        motion(at);
        step_.reset();
        return true;
      }
      // point.trsf.x = point.trsf.x + d
      const bool is_part = is(point) && is(".", 1) && is("trsf", 2) && is(".", 3) &&
                           peek(4).low.size() == 1 && peek(4).low[0] >= 'x' &&
                           peek(4).low[0] <= 'z' && is("=", 5) && is(point, 6) && is(".", 7) &&
                           is("trsf", 8) && is(".", 9) && is(peek(4).low, 10) &&
                           (is("+", 11) || is("-", 11));
      if (!is_part) break;
      const auto axis = static_cast<std::size_t>(peek(4).low[0] - 'x');
      const bool is_less = is("-", 11);
      at_ += 12;
      const Ex d = as_real(expression(31), at);
      if (!d.ok) break;
      by[axis] = is_less ? negative(d) : d;
    }
    at_ = begin;
    return false;
  }
  void motion(const At& at) {
    const std::string w = next().low;
    const bool is_joint = w == "movej";
    Motion m;
    m.word = is_joint ? "PTP" : w == "movel" ? "LIN" : "CIRCLE";
    bool has_joints = false;
    if (!expect("(")) return;
    std::vector<Father> fathers;
    for (int i = 0; i < (w == "movec" ? 2 : 1); ++i) {
      father_ = {};
      const Token point = peek();
      Ex e = failed();
      if (step_) {
        next();
        e = position(*step_);
        m.is_incremental = true;
        father_ = step_frame_;
      } else {
        e = expression();
        if (const auto it = learned_.modal.find("link " + point.low);
            it != learned_.modal.end() && it->second.size() > 1 && !linked_.contains(point.low))
          e = bad(at, "which frame " + std::string(point.raw) + " uses is unknown here",
                  "Write link() before the motion.");
      }
      expect(",");
      if (!e.ok) {
        skip_rest();
        return;
      }
      if (step_) {
        fathers.push_back(father_);
        m.targets.push_back(e);
        continue;
      }
      if (e.type.k != K::pose && e.type.k != K::target && e.type.k != K::joint) {
        bad(at, "this is neither a pose nor a joint position");
        skip_rest();
        return;
      }
      if (e.type.k == K::joint) {
        m.has_frames = false;
        has_joints = true;
      } else {
        fathers.push_back(father_);
      }
      m.targets.push_back(is_joint ? e : as_place(e));
    }
    father_ = {};
    Ex tool = peek().low == "flange" ? (next(), identity()) : expression();
    if (tool.ok && !father_.name.empty()) tool = seen_from(father_, tool, at);
    expect(",");
    const Token how = next();
    if (accept("[")) {
      const Ex i = expression();
      expect("]");
      if (i.ok && !(i.is_literal && i.v == 0)) {
        bad(how.at, "only the first of an array of motion descriptors is read");
        return;
      }
    }
    expect(")");
    const auto it = motions_.find(how.low);
    if (it == motions_.end()) {
      bad(how.at,
          "the motion descriptor " + std::string(how.raw.substr(0, 40)) + " is not declared");
      return;
    }
    const Motions& d = it->second;
    const auto percent = [&](const char* field) {
      const Ex e = descriptor(d, field);
      if (!e.is_literal || e.v <= 100) return e;
      if (told_.insert(how.low + " " + field).second)
        warn(how.at, std::string(field) + " of " + std::string(how.raw) +
                         " is above 100 % and is taken as 100 %");
      return real(100);
    };
    const Ex velocity = percent("vel"), acceleration = percent("accel");
    if (is_joint) {
      if (!velocity.is_literal || velocity.v > 0) m.attributes.emplace_back("SPEED_PTP", velocity);
      if (!acceleration.is_literal || (acceleration.v > 0 && acceleration.v != 100))
        m.attributes.emplace_back("ACC_PTP", acceleration);
    } else {
      const Ex limit = descriptor(d, "tvel");
      if (!limit.is_literal || (limit.v > 0 && limit.v < 90000))
        m.attributes.emplace_back("SPEED", limit);
      else if (told_.insert(how.low + " t").second)
        warn(how.at, std::string(how.raw) + " has no speed in mm/s (tmax); R_SPEED applies");
      if (!acceleration.is_literal || (acceleration.v > 0 && acceleration.v != 100))
        m.attributes.emplace_back("ACC", acceleration);
    }
    if (d.blend != "off" && !d.blend.empty()) {
      Ex leave = descriptor(d, "leave");
      if (is_joint && leave.is_literal && leave.v > 100) leave = real(100);
      if (!leave.is_literal || leave.v > 0)
        m.attributes.emplace_back(is_joint ? "C_PTP" : "C_CP", leave);
    }
    if (has_joints && !is_joint) {
      // IRL's TRAFO is of the robot's own tool; in joints every tool comes to the same.
      m.has_tool = false;
      if (tool.ok && tool.s != identity().s)
        fail(at, "a path to joint values uses the robot's present tool here, not this one",
             "Give a point.");
    } else if (tool.ok && tool.s != identity().s) {
      m.tool = as_pose(tool, at);
    }
    if (!fathers.empty() && std::any_of(fathers.begin(), fathers.end(),
                                        [&](const Father& x) { return !(x == fathers[0]); })) {
      bad(at, "the points of this arc are in different frames");
      return;
    }
    if (!fathers.empty() && !fathers[0].name.empty() && m.has_frames)
      m.frame = seen_from(fathers[0], std::nullopt, at);
    if (!tool.ok) return;
    if (at_line_end()) m.until = ended_by();
    if (!m.until.empty())
      std::erase_if(m.attributes, [](const auto& a) { return a.first.starts_with("C_"); });
    move(std::move(m), at);
  }
  /// A field of a motion descriptor: a number, or a variable if the programs change it.
  Ex descriptor(const Motions& d, const std::string& field) {
    const double v = d.values.at(field);
    const std::string key = lower(d.name) + "." + field;
    if (!learned_.flags.contains("changed " + key)) return real(v);
    if (const auto it = globals_.find("%" + key); it != globals_.end())
      return place(it->second.irl, kReal);
    Symbol s;
    s.type = kReal;
    s.irl = irl_name(d.name + "_" + field);
    declare_variable(s, real(v).s, d.at);
    return place(globals_.emplace("%" + key, std::move(s)).first->second.irl, kReal);
  }
  /// The pose of a frame or tool relative to the world or the flange; `inner` is relative to
  /// it.
  Ex seen_from(Father father, std::optional<Ex> inner, const At& at) {
    for (int depth = 0; !father.name.empty(); ++depth) {
      const Symbol* s = find(father.name);
      if (depth > 20 || !s || (s->type.k != K::pose && s->type.k != K::array) ||
          (s->type.k == K::array && (s->type.element->k != K::pose || father.index < 0 ||
                                     father.index > s->type.bounds[0].second)))
        return bad(at, "the frame or tool " + father.name + " is not among the data");
      const Ex outer = place(
          s->irl + (s->type.k == K::array ? "[" + std::to_string(father.index) + "]" : ""), kPose);
      inner = inner ? binary(Op::compose, outer, as_pose(*inner, at), at) : outer;
      const auto it = fathers_.find(father.name);
      if (it == fathers_.end() || father.index >= static_cast<std::int64_t>(it->second.size()))
        break;
      father = it->second[static_cast<std::size_t>(father.index)];
    }
    return inner ? *inner : identity();
  }
  /// Behind a motion: wait(c or isEmpty()), then resetMotion() is UNTIL c. Empty = it is not so.
  std::string ended_by() {
    const std::size_t begin = at_;
    std::size_t k = at_;
    const auto is_there = [&](std::initializer_list<std::string_view> words) {
      std::size_t i = k;
      for (const std::string_view w : words) {
        if (i >= tokens_.size() || tokens_[i].low != w) return false;
        ++i;
      }
      return true;
    };
    const auto pass_lines = [&] {
      while (k < tokens_.size() && tokens_[k].kind == Tk::line) ++k;
    };
    pass_lines();
    if (!is_there({"wait", "("})) return {};
    const std::size_t from = k + 2;
    std::size_t or_ = 0;
    for (; k < tokens_.size() && tokens_[k].kind != Tk::line; ++k)
      if (is_there({"or", "isempty", "(", ")", ")"})) or_ = k;
    if (or_ == 0 || tokens_[or_ + 5].kind != Tk::line) return {};
    pass_lines();
    if (!is_there({"resetmotion", "(", ")"})) return {};
    at_ = from;
    const Token kept = tokens_[or_];
    tokens_[or_].kind = Tk::line;
    const Ex c = converted(expression(), kBool, here());
    const bool is_whole = at_ == or_;
    tokens_[or_] = kept;
    at_ = c.ok && is_whole ? k + 3 : begin;
    return c.ok && is_whole ? c.s : std::string();
  }
  /// The outputs of an array, which are the bits of a number.
  void set_bits(const At& at) {
    next();
    next();
    const Token name = next();
    expect(",");
    const Ex n = as_integer(expression(), at);
    expect(")");
    learned_.flags.insert("output " + name.low);
    const auto& [names, is_analogue] = signals_of_[name.low];
    if (!n.ok) return;
    if (is_analogue || names.size() > 31) {
      bad(at, "dioSet() needs at most 31 digital outputs");
      return;
    }
    for (std::size_t k = 0; k < names.size(); ++k) {
      const Symbol& s = named_signal(names[k], true, kBool, at);
      const std::int64_t bit = std::int64_t{1} << k;
      std::string to;
      if (n.is_literal) to = (static_cast<std::int64_t>(n.v) & bit) != 0 ? "TRUE" : "FALSE";
      else to = within(n, kTerm) + " DIV " + std::to_string(bit) + " MOD 2 = 1";
      emit(s.irl + " := " + to + ";", at);
    }
  }
  Ex bits_value(const At& at) {
    const Token name = next();
    expect(")");
    const auto& [names, is_analogue] = signals_of_[name.low];
    if (is_analogue || names.size() > 31)
      return bad(at, "dioGet() needs at most 31 digital signals");
    const bool is_out = learned_.flags.contains("output " + name.low);
    Ex all = failed();
    for (std::size_t k = 0; k < names.size(); ++k) {
      const Symbol& s = named_signal(names[k], is_out, kBool, at);
      Ex bit = converted(place(s.irl, s.type), kInt, at);
      if (k > 0) bit = binary(Op::mul, integer(std::int64_t{1} << k), bit, at);
      all = k == 0 ? bit : binary(Op::add, all, bit, at);
    }
    return all;
  }
  /// Whether a variable is declared, and set by watch(), and nothing else: nobody looks at it.
  [[nodiscard]] bool is_only_watched(const std::string& low) {
    if (words_.empty())
      for (const SourceFile& f : files_) {
        const std::string text = lower(f.text);
        const auto is_part = [](char c) {
          return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
        };
        for (std::size_t i = 0; i < text.size();) {
          std::size_t end = i;
          while (end < text.size() && is_part(text[end])) ++end;
          if (end > i) {
            auto& [all, watched] = words_[text.substr(i, end - i)];
            ++all;
            watched += text.compare(end, 9, " = watch(") == 0;
          }
          i = std::max(end, i + 1);
        }
      }
    const auto it = words_.find(low);
    return it != words_.end() && it->second.first == 1 + it->second.second;
  }
  std::map<std::string, std::pair<std::size_t, std::size_t>> words_;  ///< all, and set by watch()
  void assignment(const At& at) {
    const Token name = peek();
    if (is("=", 1) && is("watch", 2) && is("(", 3) && is_only_watched(name.low)) {
      next();
      next();
      one();
      return;
    }
    if (const auto it = motions_.find(name.low); it != motions_.end()) {
      next();
      while (accept("[")) {
        (void)expression();
        expect("]");
      }
      expect(".");
      const Token field = next();
      expect("=");
      const Ex e = as_real(expression(), at);
      if (!e.ok) return;
      if (field.low == "reach" || field.low == "decel" || field.low == "rvel") {
        left_out(RMP_FAULT_WARNING, at,
                 std::string(field.raw) + " of a motion descriptor has no counterpart in IRL");
        return;
      }
      if (!it->second.values.contains(field.low)) {
        bad(at, std::string(field.raw.substr(0, 40)) + " of a motion descriptor is not read");
        return;
      }
      learned_.flags.insert("changed " + name.low + "." + field.low);
      const Ex to = descriptor(it->second, field.low);
      if (to.is_place) assign(to, e, at);
      return;
    }
    if (is("=", 1) && is("here", 2) && step(at)) return;
    if (signals_of_.contains(name.low)) learned_.flags.insert("output " + name.low);
    will_write(name.low);
    father_ = {};
    const Ex to = primary();
    if (!to.ok) {
      skip_rest();
      return;
    }
    if (!expect("=")) return;
    const Father own = std::exchange(father_, Father{});
    const Ex e = expression();
    if (e.ok && (!father_.name.empty() || e.type.k == K::target) && !(own == father_)) {
      bad(at, "assigning this point would change its frame, which is not read",
          "Give both points the same frame.");
      return;
    }
    assign(to, e, at);
  }

  // ---- values ----

  std::optional<Ex> special(Op op, const Ex& a, const Ex& b, const At& at) override {
    if (op == Op::mul && a.type.k == K::pose && b.type.k == K::pose)
      return binary(Op::compose, a, b, at);
    return std::nullopt;
  }
  Ex primary() override {
    const Token t = peek();
    const At at = t.at;
    if (const auto e = literal_here()) return *e;
    if (accept("(")) {
      Ex e = expression();
      expect(")");
      return suffixes(e);
    }
    if (accept("{")) {
      const auto x = arguments("}");
      for (const Ex& e : x)
        if (!e.ok) return failed();
      if (x.size() == 6) return pose({x[0], x[1], x[2]}, orientation("ORIXYZ", {x[3], x[4], x[5]}));
      return bad(at, "six numbers are expected here");
    }
    if (t.kind != Tk::name) {
      if (!at_line_end()) next();
      return bad(at, "a value is expected here");
    }
    next();
    if (t.low == "true" || t.low == "false") return boolean(t.low == "true");
    if (t.low == "flange" || t.low == "world") return identity();
    if (const auto it = signals_of_.find(t.low); it != signals_of_.end()) {
      std::size_t n = 0;
      if (accept("[")) {
        const Ex i = expression();
        expect("]");
        if (!i.is_literal || i.v < 0 || i.v >= static_cast<double>(it->second.first.size()))
          return bad(at, "IRL has no signals with computed numbers", "Give each of them a name.");
        n = static_cast<std::size_t>(i.v);
      }
      const bool is_out = learned_.flags.contains("output " + t.low);
      const Symbol& s =
          named_signal(it->second.first[n], is_out, it->second.second ? kReal : kBool, at);
      Ex e = place(s.irl, s.type);
      e.is_place = is_out;
      return e;
    }
    if (is("(")) return suffixes(function(t));
    const Symbol* s = find(t.low);
    if (!s || s->kind == Symbol::routine || s->kind == Symbol::data)
      return bad(at, std::string(t.raw.substr(0, 60)) + " is not declared",
                 "Read the project (.pjx) with its data.");
    if (const auto f = fathers_.find(t.low); f != fathers_.end()) {
      // Elements of an array may be relative to different frames.
      const auto n = !is("[")                           ? std::int64_t{0}
                     : peek(1).is_integer && is("]", 2) ? std::int64_t(peek(1).value)
                                                        : std::int64_t{-1};
      const auto& all = f->second;
      if (n >= 0 && n < static_cast<std::int64_t>(all.size())) {
        father_ = all[static_cast<std::size_t>(n)];
      } else if (std::all_of(all.begin(), all.end(),
                             [&](const Father& x) { return x == all[0]; })) {
        father_ = all[0];
      } else {
        skip_rest();
        return bad(at, "the elements of " + std::string(t.raw) +
                           " are in different frames, and the index is computed");
      }
    }
    if (s->type.k == K::array && !is("[")) {
      // The first element.
      return suffixes(place(s->irl + "[0]", *s->type.element));
    }
    return suffixes(place(s->irl, s->type));
  }
  Ex suffixes(Ex e) {
    for (;;) {
      if (is("[") && e.ok) {
        const At at = next().at;
        const Ex i = as_integer(expression(), at);
        expect("]");
        if (!i.ok) return failed();
        if (e.type.k == K::array) {
          if (i.is_literal && (i.v < 0 || i.v > static_cast<double>(e.type.bounds[0].second)))
            return bad(at, "the array has no element " + i.s);
          const Type of = *e.type.element;
          e = place(e.s + "[" + i.s + "]", of);
        } else if (!(i.is_literal && i.v == 0)) {
          return bad(at, "this is not an array");
        }
        continue;
      }
      if (is(".") && peek(1).kind == Tk::name && e.ok) {
        next();
        const Token f = next();
        const std::string& n = f.low;
        if (e.type.k == K::joint && n.size() == 2 && n[0] == 'j' && n[1] >= '1' && n[1] <= '6') {
          e = place(e.s + (learned_.external_axes > 0 ? ".M_JOINT.A" : ".A") + n.substr(1), kReal);
          continue;
        }
        if (n == "trsf") father_ = {};
        if (e.type.k == K::target && n == "trsf") {
          e = place(e.s + ".PSE", kPose);
          continue;
        }
        if ((e.type.k == K::pose || e.type.k == K::target) && (n == "trsf" || n == "config")) {
          if (n == "config") return bad(f.at, "configurations are not read as values");
          continue;
        }
        if (e.type.k == K::pose && (n == "x" || n == "y" || n == "z")) {
          e = place(e.s + ".POS." + static_cast<char>(n[0] - 32), kReal);
          continue;
        }
        if (e.type.k == K::pose && (n == "rx" || n == "ry" || n == "rz")) {
          const std::string p = e.s;
          const auto angle = [&](char c) {
            return std::string("ANGLE") + c + "('XYZ', " + p + ".ORI)";
          };
          const char axis = static_cast<char>(n[1] - 32);
          Ex a = place(angle(axis), kReal);
          a.setter = p + ".ORI := ORIXYZ(";
          for (const char c : {'X', 'Y', 'Z'})
            a.setter += (c == 'X' ? "" : ", ") + (c == axis ? "%" : angle(c));
          a.setter += ")";
          e = a;
          continue;
        }
        return bad(f.at, "there is no component " + std::string(f.raw.substr(0, 40)) + " here");
      }
      return e;
    }
  }
  /// How many tokens sel(x < 0, roundUp(x), roundDown(x)) has from its parenthesis on, if this is
  /// it; 0 = it is not. That is x towards zero.
  [[nodiscard]] std::size_t truncation() const {
    std::size_t comma = 1, open = 0;
    for (; open > 0 || !is(",", comma); ++comma) {
      const Tk kind = peek(comma).kind;
      if (kind == Tk::end || kind == Tk::line || (open == 0 && is(")", comma))) return 0;
      if (is("(", comma)) ++open;
      if (is(")", comma)) --open;
    }
    if (comma < 4 || !is("<", comma - 2) || peek(comma - 1).raw != "0") return 0;
    std::size_t i = comma;
    for (const auto& [word, end] : {std::pair("roundup", ","), std::pair("rounddown", ")")}) {
      if (!is(word, i + 1) || !is("(", i + 2)) return 0;
      i += 3;
      for (std::size_t k = 1; k + 2 < comma; ++k, ++i)
        if (peek(i).kind != peek(k).kind || peek(i).raw != peek(k).raw) return 0;
      if (!is(")", i) || !is(end, i + 1)) return 0;
      ++i;
    }
    return i + 1;
  }
  Ex function(const Token& t) {
    const At at = t.at;
    if (const std::size_t n = t.low == "sel" ? truncation() : 0; n > 0) {
      const At last = peek(n - 1).at;
      next();
      const Ex x = as_real(expression(21), at);
      while (here().begin < last.begin) next();
      next();
      return x.ok ? math("TRUNC", {x}, at) : failed();
    }
    next();
    if (t.low == "dioget" && signals_of_.contains(peek().low) && is(")", 1)) return bits_value(at);
    Father kept = father_;
    std::vector<Ex> a;
    if (!accept(")")) {
      do {
        a.push_back(expression());
        if (a.size() == 1) kept = father_;
      } while (accept(",") && a.size() < 100);
      expect(")");
    }
    for (const Ex& e : a)
      if (!e.ok) return failed();
    static const std::map<std::string, std::string, std::less<>> kMath{
        {"sin", "SIN"},   {"cos", "COS"},   {"tan", "TAN"},    {"asin", "ASIN"},
        {"acos", "ACOS"}, {"atan", "ATAN"}, {"sqrt", "SQRT"},  {"abs", "ABS"},
        {"exp", "EXP"},   {"log", "LN"},    {"round", "ROUND"}};
    if (const auto it = kMath.find(t.low); it != kMath.end()) return math(it->second, a, at);
    if (t.low == "rounddown" && a.size() == 1)
      return value(helper("floor") + "(" + as_real(a[0], at).s + ")", kInt);
    if (t.low == "roundup" && a.size() == 1)
      return value("-" + helper("floor") + "(-(" + as_real(a[0], at).s + "))", kInt, kSign);
    if (t.low == "power" && a.size() == 2) return binary(Op::power, a[0], a[1], at);
    if (t.low == "appro" && a.size() == 2) {
      father_ = kept;
      return with_pose(a[0], binary(Op::compose, as_pose(a[0], at), as_pose(a[1], at), at));
    }
    if (t.low == "compose" && a.size() == 3) {
      // Moved by a transformation that is seen from the frame; the frame of the point is the one.
      father_ = kept;
      return with_pose(a[0], binary(Op::compose, as_pose(a[2], at), as_pose(a[0], at), at));
    }
    if (t.low == "herej" && a.empty()) return present_joints();
    if (t.low == "distance" && a.size() == 2) {
      const Ex x = as_pose(a[0], at), y = as_pose(a[1], at);
      return x.ok && y.ok ? value(helper("distance") + "(" + x.s + ".POS, " + y.s + ".POS)", kReal)
                          : failed();
    }
    if (t.low == "len" && a.size() == 1 && a[0].type.k == K::string)
      return value("LENGTH(" + a[0].s + ")", kInt);
    if (t.low == "size" && a.size() == 1 && a[0].type.k == K::array)
      return integer(a[0].type.bounds[0].second + 1);
    if (t.low == "watch" && a.size() == 2) {
      const Ex c = converted(a[0], kBool, at), time = as_real(a[1], at);
      if (!c.ok || !time.ok) return failed();
      emit("WAIT FOR " + c.s + " TIMEOUT " + within(time, kSum) + ";", at);
      return value("NOT R_TIMEOUT", kBool, kNot);
    }
    return bad(at, "IRL has no counterpart of " + std::string(t.raw.substr(0, 40)));
  }

  std::vector<Program> programs_;
  std::map<std::string, Motions> motions_;
  std::map<std::string, std::pair<std::vector<std::string>, bool>> signals_of_;
  std::map<std::string, std::vector<Father>> fathers_;  ///< of the elements of a variable
  std::vector<std::string> steps_;
  std::set<std::string> told_;
  Father father_;                        ///< of the place that was read last
  std::set<std::string> linked_;         ///< points that a link() above says the frame of
  std::optional<std::vector<Ex>> step_;  ///< of the motion that is read: by so much
  Father step_frame_;
};

}  // namespace

Made read_val3(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<Val3Reader>(task, params, progress);
}
std::vector<std::string> val3_needs(const SourceFile& file) {
  std::vector<std::string> out;
  if (extension(file.name) != "pjx") return out;
  for (const Tag& t : tags(file.text)) {
    const auto it = t.attributes.find("file");
    if (t.is_end || it == t.attributes.end() || out.size() >= 150) continue;
    const std::string e = extension(it->second);
    if (e == "pgx" || e == "dtx") out.push_back(base_name(it->second));
  }
  return out;
}

}  // namespace robomosp::readers

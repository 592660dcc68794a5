// SPDX-License-Identifier: Apache-2.0
#include "reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace robomosp::readers {
namespace {

constexpr std::size_t kMostText = std::size_t{16} << 20;
constexpr std::size_t kMostFaults = 1000;
constexpr int kDeepest = 150;

/// Words that name something in IRL already, lower-case.
const std::set<std::string, std::less<>>& taken() {
  static const std::set<std::string, std::less<>> kTaken{"program",
                                                         "endprogram",
                                                         "module",
                                                         "endmodule",
                                                         "system_specification",
                                                         "datalist",
                                                         "import",
                                                         "export",
                                                         "const",
                                                         "var",
                                                         "type",
                                                         "signal",
                                                         "record",
                                                         "endrecord",
                                                         "array",
                                                         "of",
                                                         "list",
                                                         "procedure",
                                                         "endproc",
                                                         "function",
                                                         "endfct",
                                                         "process",
                                                         "endprocess",
                                                         "interrupt",
                                                         "endinterrupt",
                                                         "begin",
                                                         "if",
                                                         "then",
                                                         "elsif",
                                                         "else",
                                                         "endif",
                                                         "while",
                                                         "do",
                                                         "endwhile",
                                                         "for",
                                                         "to",
                                                         "downto",
                                                         "endfor",
                                                         "repeat",
                                                         "until",
                                                         "loop",
                                                         "endloop",
                                                         "exit",
                                                         "case",
                                                         "when",
                                                         "default",
                                                         "endcase",
                                                         "goto",
                                                         "label",
                                                         "return",
                                                         "wait",
                                                         "pause",
                                                         "halt",
                                                         "move",
                                                         "move_inc",
                                                         "and",
                                                         "or",
                                                         "exor",
                                                         "not",
                                                         "div",
                                                         "mod",
                                                         "in",
                                                         "out",
                                                         "inout",
                                                         "sec",
                                                         "step",
                                                         "from",
                                                         "at",
                                                         "start",
                                                         "stop",
                                                         "continue",
                                                         "cancel",
                                                         "enable",
                                                         "disable",
                                                         "teach",
                                                         "priority",
                                                         "timeout",
                                                         "input",
                                                         "output",
                                                         "robot",
                                                         "ptp",
                                                         "lin",
                                                         "circle",
                                                         "path",
                                                         "int",
                                                         "real",
                                                         "bool",
                                                         "char",
                                                         "string",
                                                         "text",
                                                         "file",
                                                         "semaphore",
                                                         "position",
                                                         "orientation",
                                                         "pose",
                                                         "main_joint",
                                                         "add_joint",
                                                         "joint",
                                                         "robtarget",
                                                         "true",
                                                         "false",
                                                         "sin",
                                                         "cos",
                                                         "tan",
                                                         "asin",
                                                         "acos",
                                                         "atan",
                                                         "atan2",
                                                         "sqrt",
                                                         "exp",
                                                         "ln",
                                                         "abs",
                                                         "trunc",
                                                         "round",
                                                         "float",
                                                         "chr",
                                                         "ord",
                                                         "sizeof",
                                                         "cross",
                                                         "dot",
                                                         "orixyz",
                                                         "oriyxz",
                                                         "orizyx",
                                                         "orizyz2",
                                                         "orirs",
                                                         "orivang",
                                                         "oriquat",
                                                         "orimat",
                                                         "orimult",
                                                         "anglex",
                                                         "angley",
                                                         "anglez",
                                                         "anglez2",
                                                         "quata",
                                                         "quatb",
                                                         "quatc",
                                                         "quatd",
                                                         "rotangle",
                                                         "rotaxis",
                                                         "vectorn",
                                                         "vectoro",
                                                         "vectora",
                                                         "inv",
                                                         "trafo",
                                                         "trafoinv",
                                                         "compare",
                                                         "concat",
                                                         "length",
                                                         "locate",
                                                         "extract",
                                                         "delete",
                                                         "list_add",
                                                         "list_insert",
                                                         "list_delete",
                                                         "list_clear",
                                                         "list_index",
                                                         "open",
                                                         "close",
                                                         "eof",
                                                         "eol",
                                                         "write",
                                                         "writeln",
                                                         "read",
                                                         "readln",
                                                         "acquire",
                                                         "release",
                                                         "getstatus",
                                                         "speed",
                                                         "speed_ori",
                                                         "acc",
                                                         "time",
                                                         "c_cp",
                                                         "c_speed",
                                                         "c_pass",
                                                         "wobble",
                                                         "act_rob",
                                                         "device",
                                                         "adax_control",
                                                         "speed_ptp",
                                                         "acc_ptp",
                                                         "c_ptp",
                                                         "tool",
                                                         "frame",
                                                         "rs",
                                                         "xyz",
                                                         "yxz",
                                                         "zyx",
                                                         "zyz2",
                                                         "vang",
                                                         "quat",
                                                         "bounds",
                                                         "brake",
                                                         "no_pred",
                                                         "no_adax_control",
                                                         "tcp_keep",
                                                         "tcp_keep_rel",
                                                         "device_rel",
                                                         "ax_none",
                                                         "ax_main",
                                                         "adax_is",
                                                         "adax_ie",
                                                         "adax_ex",
                                                         "predefined",
                                                         "standard"};
  return kTaken;
}

std::string real_text(double v) {
  char buffer[40];
  // Without an exponent where a person writes none: 100000.0, and not 1.0e+05.
  const double size = std::fabs(v);
  const auto end =
      size >= 1e-4 && size < 1e15
          ? std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::fixed).ptr
          : std::to_chars(buffer, buffer + sizeof buffer, v == 0 ? 0.0 : v).ptr;
  std::string s(buffer, end);
  const std::size_t e = s.find('e');
  if (s.find('.') == std::string::npos) s.insert(e == std::string::npos ? s.size() : e, ".0");
  return s;
}

/// Text of a comment of IRL: one line, without what would end it.
std::string comment_text(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '}') out += ')';
    else if (c == '{') out += '(';
    else if (static_cast<unsigned char>(c) < 0x20) out += ' ';
    else out += c;
  }
  const std::size_t b = out.find_first_not_of(' ');
  if (b == std::string::npos) return {};
  out = out.substr(b, out.find_last_not_of(' ') - b + 1);
  if (out.size() > 200) {
    std::size_t cut = 200;
    while (cut > 0 && (static_cast<unsigned char>(out[cut]) & 0xC0U) == 0x80U) --cut;
    out = out.substr(0, cut) + " ...";
  }
  return out;
}
std::string quoted(std::string_view s) {
  std::string out = "'";
  for (const char c : s) {
    if (static_cast<unsigned char>(c) < 0x20) out += ' ';
    else out += c;
    if (c == '\'') out += c;
  }
  return out + "'";
}
std::string kind_word(const Type& t) {
  switch (t.k) {
    case K::none: return "nothing";
    case K::integer: return "a whole number";
    case K::real: return "a number";
    case K::boolean: return "a truth value";
    case K::character: return "a character";
    case K::string: return "a text";
    case K::position: return "a position";
    case K::orientation: return "an orientation";
    case K::pose: return "a pose";
    case K::joint: return "a joint position";
    case K::target: return "a target";
    case K::record: return "a record " + t.record;
    default: return "an array";
  }
}

}  // namespace

bool is_number(const Type& t) { return t.k == K::integer || t.k == K::real; }
Type array_of(Type element, std::vector<std::pair<std::int64_t, std::int64_t>> bounds) {
  Type t;
  t.k = K::array;
  t.bounds = std::move(bounds);
  t.element = std::make_shared<const Type>(std::move(element));
  return t;
}
std::string number_text(double v) { return real_text(v); }
std::string within(const Ex& e, int prec) { return e.prec >= prec ? e.s : "(" + e.s + ")"; }
Ex value(std::string s, Type t, int prec) {
  Ex e;
  e.s = std::move(s);
  e.type = std::move(t);
  e.prec = prec;
  return e;
}
Ex place(std::string s, Type t) {
  Ex e = value(std::move(s), std::move(t));
  e.is_place = true;
  return e;
}
Ex integer(std::int64_t v) {
  Ex e = value(std::to_string(v), {.k = K::integer, .record = {}, .bounds = {}, .element = {}},
               v < 0 ? kSign : kPrimary);
  e.is_literal = e.is_constant = true;
  e.v = static_cast<double>(v);
  return e;
}
Ex real(double v) {
  Ex e = value(real_text(v), {.k = K::real, .record = {}, .bounds = {}, .element = {}},
               v < 0 ? kSign : kPrimary);
  e.is_literal = e.is_constant = true;
  e.v = v;
  return e;
}
Ex measure(double v) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.12g", v);
  double r = v;
  std::from_chars(buffer, buffer + std::char_traits<char>::length(buffer), r);
  return real(std::fabs(r) < 1e-12 ? 0.0 : r);
}
Ex boolean(bool b) {
  Ex e = value(b ? "TRUE" : "FALSE", {.k = K::boolean, .record = {}, .bounds = {}, .element = {}});
  e.is_constant = true;
  e.v = b;
  return e;
}
Ex string(std::string_view s) {
  Ex e = value(quoted(s), {.k = K::string, .record = {}, .bounds = {}, .element = {}});
  e.is_constant = true;
  return e;
}
Ex failed() {
  Ex e = integer(0);
  e.ok = false;
  e.is_literal = false;
  return e;
}
Ex scaled(const Ex& a, double by) {
  if (!a.ok || by == 1.0) return a;
  if (a.is_literal) return measure(a.v * by);
  Ex e =
      value(within(a, kTerm) + (by < 1 && std::round(1 / by) == 1 / by ? " / " + real_text(1 / by)
                                                                       : " * " + real_text(by)),
            {.k = K::real, .record = {}, .bounds = {}, .element = {}}, kTerm);
  e.is_constant = a.is_constant;
  return e;
}
Ex negative(const Ex& a) {
  if (a.is_literal)
    return a.type.k == K::integer ? integer(-static_cast<std::int64_t>(a.v)) : real(-a.v);
  Ex e = value("-" + within(a, kPrimary), a.type, kSign);
  e.ok = a.ok;
  e.is_constant = a.is_constant;
  return e;
}
void quaternion_of_vector(const double (&r)[3], double (&q)[4]) {
  const double a = std::hypot(r[0], r[1], r[2]);
  const double k = a < 1e-12 ? 0.5 : std::sin(a / 2) / a;
  q[0] = std::cos(a / 2);
  for (int i = 0; i < 3; ++i) q[i + 1] = k * r[i];
}

Result<void> fits(std::span<const SourceFile> files) {
  std::size_t all = 0;
  for (const SourceFile& f : files) all += f.text.size();
  if (all <= kMostText) return {};
  return error(ErrorCode::unsupported,
               "the program has more than " + std::to_string(kMostText >> 20) + " MB",
               "Read its files one by one.");
}
Error cancelled() { return error(ErrorCode::cancelled, "reading was cancelled"); }

Reader::Reader(std::span<const SourceFile> files, Learned& learned, const Params& params,
               Progress& progress)
    : files_(files), learned_(learned), params_(params), progress_(progress) {
  tokens_.push_back({});
  main_.end = "ENDPROGRAM";
  line_starts_.resize(files_.size());
}

// ---- faults ----

void Reader::fault(std::uint32_t severity, const At& at, std::string message, std::string hint) {
  if (faults_.size() >= kMostFaults) {
    ++dropped_faults_;
    return;
  }
  if (hint.empty() && severity == RMP_FAULT_ERROR)
    hint = "Change it in this file and read it again, or write the same in the IRL program.";
  faults_.push_back({severity, at, std::move(message), std::move(hint)});
}
void Reader::drop_faults(std::size_t kept, const std::function<bool(const At&)>& is_dropped) {
  const auto from = faults_.begin() + static_cast<std::ptrdiff_t>(std::min(kept, faults_.size()));
  faults_.erase(
      std::remove_if(from, faults_.end(), [&](const Fault& f) { return is_dropped(f.at); }),
      faults_.end());
}
Ex Reader::bad(const At& at, std::string message, std::string hint) {
  // The first is what is wrong; what follows from it says nothing.
  if (pending_.empty())
    pending_.push_back({RMP_FAULT_ERROR, at, std::move(message), std::move(hint)});
  return failed();
}
std::size_t Reader::uses(const std::string& low) {
  if (uses_.empty())
    for (const Token& t : tokens_) ++uses_[t.low];
  const auto it = uses_.find(low);
  return it == uses_.end() ? 0 : it->second;
}
void Reader::skip_rest() {
  while (!at_line_end()) ++at_;
}
void Reader::note_line(const At& at, std::string what) {
  emit("{ " + source_line(at) + " }", at);
  note(at, std::move(what));
}
Ex Reader::identity() {
  Ex e = value("POSE(POSITION(0.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0))", kPose);
  e.is_constant = true;
  return e;
}
Ex Reader::position(const std::vector<Ex>& xyz) {
  std::string list;
  bool ok = true, is_constant = true;
  for (const Ex& a : xyz) {
    ok = ok && a.ok;
    is_constant = is_constant && a.is_constant;
    list += (list.empty() ? "" : ", ") + converted(a, kReal, here()).s;
  }
  Ex e = value("POSITION(" + list + ")", kPosition);
  e.ok = ok;
  e.is_constant = is_constant;
  return e;
}
Ex Reader::offset(const Ex& p, const Ex& x, const Ex& y, const Ex& z, const At& at) {
  if (!p.ok) return p;
  if (p.type.k != K::target && p.type.k != K::pose) return bad(at, "a target is expected here");
  const Ex a = as_real(x, at), b = as_real(y, at), c = as_real(z, at);
  if (!a.ok || !b.ok || !c.ok) return failed();
  return value(helper(p.type.k == K::target ? "shifted_target" : "shifted") + "(" + p.s + ", " +
                   a.s + ", " + b.s + ", " + c.s + ")",
               p.type);
}
Ex Reader::as_place(const Ex& e) {
  if (!e.ok || e.type.k != K::joint) return e;
  learned_.turns = 6;
  return value(
      "TRAFO(" + (learned_.external_axes > 0 ? e.s : "JOINT(" + e.s + ", ADD_JOINT(0.0))") + ")",
      kTarget);
}
Ex Reader::with_pose(const Ex& t, const Ex& p) {
  if (!t.ok || !p.ok) return failed();
  if (t.type.k != K::target) return p;
  return value(helper("with_pose") + "(" + t.s + ", " + p.s + ")", kTarget);
}
std::string Reader::source_line(const At& at) const {
  const std::string_view text = files_[at.file].text;
  const std::size_t from = std::min<std::size_t>(at.begin, text.size());
  // Of very long lines what is near.
  std::size_t b = from;
  while (b > 0 && text[b - 1] != '\n' && from - b < 300) --b;
  if (b > 0 && text[b - 1] != '\n') b = from;
  return comment_text(text.substr(b, std::min<std::size_t>(text.substr(b, 1000).find('\n'), 1000)));
}
void Reader::statement(const At& from, const std::function<void()>& read) {
  if (progress_.cancelled()) is_cancelled_ = true;
  comments_until(from);
  std::vector<Fault> outer = std::move(pending_);
  pending_.clear();
  Routine& in = *current_;
  const std::size_t before = in.body.size();
  const auto armless = [&] {
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      if (blocks_[i].tested && !blocks_[i].has_arm && !blocks_[i].is_reported) return i;
    return blocks_.size();
  };
  const std::size_t case_before = armless(), open_before = blocks_.size();
  read();
  // What a TEST of an expression computes comes before its own block.
  if (case_before < open_before && case_before < blocks_.size() && case_before == armless() &&
      &in == current_ &&
      std::any_of(in.body.begin() + static_cast<std::ptrdiff_t>(std::min(before, in.body.size())),
                  in.body.end(), [](const Line& l) {
                    const std::size_t b = l.s.find_first_not_of(' ');
                    return b != std::string::npos && l.s[b] != '{' && l.s[b] != kChangeMark;
                  })) {
    blocks_[case_before].is_reported = true;
    fail(from, "this comes before the first case of its block; it is always executed");
  }
  if (!pending_.empty()) {
    // Lines that open and close blocks stay: what follows relies on them.
    const auto is_of_a_block = [](const Line& l) {
      static const std::set<std::string, std::less<>> kWords{
          "IF",    "ELSIF", "ELSE",    "ENDIF", "WHILE", "ENDWHILE", "FOR",     "ENDFOR", "REPEAT",
          "UNTIL", "LOOP",  "ENDLOOP", "CASE",  "WHEN",  "DEFAULT",  "ENDCASE", "LABEL"};
      const std::size_t b = l.s.find_first_not_of(' ');
      if (b == std::string::npos) return false;
      const std::size_t end = l.s.find("ENDIF;");
      if (end != std::string::npos && end > b) return false;  // a whole IF in one line opens none
      return kWords.contains(l.s.substr(b, l.s.find_first_of(" ;:", b) - b));
    };
    if (&in == current_ && in.body.size() > before)
      in.body.erase(std::remove_if(in.body.begin() + static_cast<std::ptrdiff_t>(before),
                                   in.body.end(), [&](const Line& l) { return !is_of_a_block(l); }),
                    in.body.end());
    emit("{ not read: " + source_line(from) + " }", from);
    for (Fault& f : pending_) fault(f.severity, f.at, std::move(f.message), std::move(f.hint));
  }
  pending_ = std::move(outer);
}
Ex Reader::condition(const At& from, const std::function<Ex()>& read) {
  const std::vector<Fault> outer = std::move(pending_);
  pending_.clear();
  Ex e = read();
  if (pending_.empty() && e.ok && e.type.k != K::boolean)
    e = converted(e, boolean(true).type, from);
  if (!pending_.empty() || !e.ok) {
    emit("{ not read: " + source_line(from) + " }", from);
    for (Fault& f : pending_) fault(f.severity, f.at, std::move(f.message), std::move(f.hint));
    e = boolean(false);
    skip_condition();
  }
  pending_ = outer;
  return e;
}
void Reader::left_out(std::uint32_t severity, const At& at, std::string message, std::string hint) {
  emit("{ not read: " + source_line(at) + " }", at);
  fault(severity, at, std::move(message), std::move(hint));
}

// ---- expressions ----

std::optional<Ex> Reader::literal_here() {
  const Token t = peek();
  if (t.kind != Tk::number && t.kind != Tk::text) return std::nullopt;
  next();
  if (t.kind == Tk::text) return string(t.raw);
  return t.is_integer ? integer(static_cast<std::int64_t>(t.value)) : real(t.value);
}

std::optional<Ex> Reader::binary_here(std::string_view sign) {
  if (!is(sign) || !peek(1).low.starts_with("b")) return std::nullopt;
  const At at = here();
  next();
  const Token n = next();
  const std::string digits = n.low.substr(1);
  if (digits.empty() || digits.find_first_not_of("01") != std::string::npos)
    return bad(at,
               std::string(sign) + std::string(n.raw.substr(0, 40)) + " is not a binary number");
  const std::size_t first = std::min(digits.find('1'), digits.size());
  if (digits.size() - first > 31)
    return bad(at, std::string(sign) + std::string(n.raw.substr(0, 40)) + " has more than 31 bits");
  std::int64_t v = 0;
  for (const char c : digits) v = v * 2 + (c == '1');
  return integer(v);
}

Ex Reader::expression(int least) {
  if (++depth_ > kDeepest) {
    --depth_;
    skip_rest();
    return bad(here(), "this expression is nested too deeply");
  }
  Ex left = unary(least);
  for (;;) {
    const Token& t = peek();
    if (t.kind != Tk::name && t.kind != Tk::sign) break;
    const Binary* found = nullptr;
    for (const Binary& b : binaries())
      if (b.word == t.low) found = &b;
    if (!found || found->prec < least) break;
    const At at = next().at;
    const Ex right = expression(found->prec + 1);
    left = binary(found->op, left, right, at);
    if (left.s.size() > 4000) {
      --depth_;
      skip_rest();
      return bad(at, "this expression is too long");
    }
  }
  --depth_;
  return left;
}
Ex Reader::unary(int least) {
  const Token& t = peek();
  if ((t.kind == Tk::name || t.kind == Tk::sign) && t.low == not_word()) {
    const At at = next().at;
    const Ex a = expression(std::max(least, not_precedence()));
    const Ex b = converted(a, boolean(true).type, at);
    Ex e = value("NOT " + within(b, kRel), boolean(true).type, kNot);
    e.ok = b.ok;
    return e;
  }
  if (t.kind == Tk::sign && (t.low == "-" || t.low == "+")) {
    const Token sign = next();
    const Ex a = expression(90);
    if (a.ok && !is_number(a.type))
      return bad(sign.at, "a sign must be before a number, but this is " + kind_word(a.type));
    return sign.low == "-" ? negative(a) : a;
  }
  return primary();
}
Ex Reader::binary(Op op, const Ex& a, const Ex& b, const At& at) {
  if (!a.ok || !b.ok) return failed();
  if (auto e = special(op, a, b, at)) return *e;
  const auto wrong = [&] {
    return bad(at,
               kind_word(a.type) + " and " + kind_word(b.type) + " cannot be combined like this");
  };
  const auto made = [&](const std::string& sign, int prec, Type t) {
    Ex e = value(within(a, prec) + " " + sign + " " + within(b, prec + 1), std::move(t), prec);
    e.is_constant = a.is_constant && b.is_constant;
    return e;
  };
  const Type number = a.type.k == K::integer && b.type.k == K::integer ? kInt : kReal;
  const bool are_numbers = is_number(a.type) && is_number(b.type);
  switch (op) {
    case Op::or_:
    case Op::and_:
    case Op::exor: {
      if (are_numbers)
        return bad(at, "IRL has no bitwise operators", "Split the signals into single ones.");
      const Ex x = converted(a, kBool, at), y = converted(b, kBool, at);
      if (!x.ok || !y.ok) return failed();
      const int prec = op == Op::and_ ? kAnd : kOr;
      return value(within(x, prec) +
                       (op == Op::and_  ? " AND "
                        : op == Op::or_ ? " OR "
                                        : " EXOR ") +
                       within(y, prec + 1),
                   kBool, prec);
    }
    case Op::eq:
    case Op::ne: {
      const std::string sign = op == Op::eq ? "=" : "<>";
      // Controllers compare signals with 0 and 1, too.
      for (const auto& [x, y] : {std::pair{&a, &b}, std::pair{&b, &a}})
        if (x->type.k == K::boolean && y->is_literal && (y->v == 0 || y->v == 1)) {
          Ex e =
              value(within(*x, kSum) + " = " + ((y->v == 1) == (op == Op::eq) ? "TRUE" : "FALSE"),
                    kBool, kRel);
          return e;
        }
      if (are_numbers || a.type == b.type || (a.type.k == K::string && b.type.k == K::character) ||
          (a.type.k == K::character && b.type.k == K::string)) {
        if (a.type.k == K::string)
          return value("COMPARE(" + a.s + ", " + b.s + ") " + sign + " 0", kBool, kRel);
        if (are_numbers || a.type.k == K::boolean || a.type.k == K::character) {
          Ex e = value(within(a, kSum) + " " + sign + " " + within(b, kSum), kBool, kRel);
          e.of_truths = a.type.k == K::boolean;
          return e;
        }
      }
      return wrong();
    }
    case Op::lt:
    case Op::gt:
    case Op::le:
    case Op::ge: {
      static constexpr std::string_view kSigns[] = {"<", ">", "<=", ">="};
      const std::string sign(kSigns[static_cast<int>(op) - static_cast<int>(Op::lt)]);
      if (!are_numbers) return wrong();
      return value(within(a, kSum) + " " + sign + " " + within(b, kSum), kBool, kRel);
    }
    case Op::add:
      if ((a.type.k == K::string || a.type.k == K::character) &&
          (b.type.k == K::string || b.type.k == K::character))
        return value("CONCAT(" + a.s + ", " + b.s + ")", string("").type);
      [[fallthrough]];
    case Op::sub:
      if (!are_numbers) return wrong();
      return made(op == Op::add ? "+" : "-", kSum, number);
    case Op::mul: return are_numbers ? made("*", kTerm, number) : wrong();
    case Op::div:
      if (!are_numbers) return wrong();
      if (b.is_literal && b.v == 0) return bad(at, "this divides by zero");
      if (number.k == K::integer && divides_whole()) return made("DIV", kTerm, kInt);
      return made("/", kTerm, kReal);
    case Op::idiv:
    case Op::mod: {
      if (!are_numbers) return wrong();
      const Ex x = as_integer(a, at), y = as_integer(b, at);
      if (y.is_literal && y.v == 0) return bad(at, "this divides by zero");
      return value(within(x, kTerm) + (op == Op::idiv ? " DIV " : " MOD ") + within(y, kSign), kInt,
                   kTerm);
    }
    case Op::compose: {
      if (a.type.k == K::orientation && b.type.k == K::orientation) return made("@", kTerm, a.type);
      const Ex x = as_pose(a, at);
      if (b.type.k == K::position)
        return value(within(x, kTerm) + " @ " + within(b, kSign), b.type, kTerm);
      const Ex y = as_pose(b, at);
      if (!x.ok || !y.ok) return failed();
      Ex e = value(within(x, kTerm) + " @ " + within(y, kSign), x.type, kTerm);
      e.is_constant = x.is_constant && y.is_constant;
      return e;
    }
    case Op::power: {
      if (!are_numbers) return wrong();
      if (b.is_literal && b.v == 2 && a.prec == kPrimary && a.is_place)
        return value(a.s + " * " + a.s, a.type, kTerm);
      return value("EXP(" + within(b, kTerm) + " * LN(" + a.s + "))", kReal);
    }
  }
  return wrong();
}
Ex Reader::converted(const Ex& a, const Type& to, const At& at) {
  if (!a.ok || a.type == to) return a;
  const K f = a.type.k, t = to.k;
  if (f == K::integer && t == K::real) {
    if (a.is_literal) return real(a.v);
    Ex e = a;
    e.type = to;
    e.is_place = false;
    return e;
  }
  if (f == K::real && t == K::integer) return as_integer(a, at);
  if (f == K::target && t == K::pose) return value(within(a, kPrimary) + ".PSE", to);
  if (f == K::boolean && t == K::real) return converted(converted(a, integer(0).type, at), to, at);
  if (f == K::boolean && t == K::integer) {
    if (a.s == "TRUE" || a.s == "FALSE") return integer(a.s == "TRUE");
    return value(helper("bool_number") + "(" + a.s + ")", to);
  }
  if (is_number(a.type) && t == K::boolean) {
    if (a.is_literal) return boolean(a.v != 0);
    return value(within(a, kSum) + " <> 0", to, kRel);
  }
  if ((f == K::character && t == K::string) || (f == K::integer && t == K::character)) {
    Ex e = a;
    e.type = to;
    return e;
  }
  if (f == K::string && t == K::character && a.s.size() == 3) {
    Ex e = a;
    e.type = to;
    return e;
  }
  if (f == K::pose && t == K::target) {
    // A pose has no configuration: the nearest one.
    return target(a, integer(-1), std::vector<Ex>(6, integer(-128)), {});
  }
  if (f == K::array && t == K::array && a.type.element && to.element &&
      a.type.bounds.size() == to.bounds.size() &&
      (*a.type.element == *to.element ||
       (a.is_constant && is_number(*a.type.element) && is_number(*to.element))) &&
      std::equal(
          a.type.bounds.begin(), a.type.bounds.end(), to.bounds.begin(),
          [](const auto& x, const auto& y) { return x.second - x.first == y.second - y.first; })) {
    Ex e = a;
    e.type = to;
    return e;
  }
  return bad(at, kind_word(to) + " is expected here, but this is " + kind_word(a.type));
}
Ex Reader::as_integer(const Ex& a, const At& at) {
  if (!a.ok || a.type.k == K::integer) return a;
  if (a.type.k != K::real) return converted(a, integer(0).type, at);
  if (a.is_literal && std::fabs(a.v) < 2147483647.0 && a.v == std::round(a.v))
    return integer(static_cast<std::int64_t>(a.v));
  Ex e = value("ROUND(" + a.s + ")", kInt);
  e.is_constant = a.is_constant;
  return e;
}
Ex Reader::as_real(const Ex& a, const At& at) { return converted(a, real(0).type, at); }
Ex Reader::as_pose(const Ex& a, const At& at) {
  return converted(a, {.k = K::pose, .record = {}, .bounds = {}, .element = {}}, at);
}
std::vector<Ex> Reader::arguments(std::string_view close) {
  std::vector<Ex> out;
  if (accept(close)) return out;
  do {
    out.push_back(expression());
  } while (accept(",") && out.size() < 1000);
  expect(close);
  return out;
}
Ex Reader::math(std::string_view irl, const std::vector<Ex>& args, const At& at, bool radians) {
  const std::size_t count = irl == "ATAN2" ? 2 : 1;
  if (args.size() != count)
    return bad(at, std::string(irl) + " takes " + std::to_string(count) +
                       " numbers, but here are " + std::to_string(args.size()));
  std::string list;
  for (const Ex& a : args) {
    if (!a.ok) return failed();
    if (!is_number(a.type)) return bad(at, std::string(irl) + " needs a number");
    Ex x = a;
    if (radians && (irl == "SIN" || irl == "COS" || irl == "TAN")) x = scaled(a, 57.29577951308232);
    list += (list.empty() ? "" : ", ") + x.s;
  }
  const bool is_whole =
      irl == "TRUNC" || irl == "ROUND" || (irl == "ABS" && args[0].type.k == K::integer);
  Ex e = value(std::string(irl) + "(" + list + ")", is_whole ? integer(0).type : real(0).type);
  e.is_constant = std::all_of(args.begin(), args.end(), [](const Ex& a) { return a.is_constant; });
  if (radians && irl[0] == 'A' && irl != "ABS") {
    const bool is_constant = e.is_constant;
    e = value(e.s + " / 57.29577951308232", real(0).type, kTerm);
    e.is_constant = is_constant;
  }
  return e;
}
Ex Reader::orientation(std::string_view function, const std::vector<Ex>& args) {
  std::string list;
  bool ok = true, is_constant = true;
  for (const Ex& a : args) {
    ok = ok && a.ok;
    is_constant = is_constant && a.is_constant;
    list += (list.empty() ? "" : ", ") + converted(a, real(0).type, here()).s;
  }
  Ex e = value(std::string(function) + "(" + list + ")",
               {.k = K::orientation, .record = {}, .bounds = {}, .element = {}});
  e.ok = ok;
  e.is_constant = is_constant;
  return e;
}
Ex Reader::pose(const std::vector<Ex>& xyz, const Ex& o) {
  std::string list;
  bool ok = o.ok, is_constant = o.is_constant;
  for (const Ex& a : xyz) {
    ok = ok && a.ok;
    is_constant = is_constant && a.is_constant;
    list += (list.empty() ? "" : ", ") + converted(a, real(0).type, here()).s;
  }
  Ex e = value("POSE(POSITION(" + list + "), " + o.s + ")",
               {.k = K::pose, .record = {}, .bounds = {}, .element = {}});
  e.ok = ok;
  e.is_constant = is_constant;
  return e;
}
Type Reader::joint_type() const {
  return {.k = K::joint, .record = {}, .bounds = {}, .element = {}};
}
Ex Reader::joints(const std::vector<Ex>& a, const std::vector<Ex>& external) {
  std::string list;
  bool ok = true, is_constant = true;
  const auto add = [&](const Ex& x, std::string& to) {
    ok = ok && x.ok;
    is_constant = is_constant && x.is_constant;
    to += (to.empty() ? "" : ", ") + converted(x, real(0).type, here()).s;
  };
  learned_.turns = 6;  // the cell says whose the joints are
  for (std::size_t i = 0; i < static_cast<std::size_t>(learned_.axes); ++i)
    add(i < a.size() ? a[i] : real(0), list);
  learned_.external_axes = std::max(learned_.external_axes, static_cast<int>(external.size()));
  std::string text = "MAIN_JOINT(" + list + ")";
  if (learned_.external_axes > 0) {
    std::string more;
    for (int i = 0; i < learned_.external_axes; ++i)
      add(static_cast<std::size_t>(i) < external.size() ? external[static_cast<std::size_t>(i)]
                                                        : real(0),
          more);
    text = "JOINT(" + text + ", ADD_JOINT(" + more + "))";
  }
  Ex e = value(text, joint_type());
  e.ok = ok;
  e.is_constant = is_constant;
  return e;
}
Ex Reader::target(const Ex& p, const Ex& status, const std::vector<Ex>& turns,
                  const std::vector<Ex>& external) {
  learned_.turns = 6;
  learned_.external_axes = std::max(learned_.external_axes, static_cast<int>(external.size()));
  std::string t, x;
  bool ok = p.ok && status.ok, is_constant = p.is_constant && status.is_constant;
  for (std::size_t i = 0; i < 6; ++i) {
    const Ex n = i < turns.size() ? as_integer(turns[i], here()) : integer(0);
    ok = ok && n.ok;
    is_constant = is_constant && n.is_constant;
    t += (t.empty() ? "" : ", ") + n.s;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(1, learned_.external_axes)); ++i) {
    const Ex n = i < external.size() ? as_real(external[i], here()) : real(0);
    ok = ok && n.ok;
    is_constant = is_constant && n.is_constant;
    x += (x.empty() ? "" : ", ") + n.s;
  }
  Ex e = value("ROBTARGET(" + p.s + ", " + status.s + ", [" + t + "], ADD_JOINT(" + x + "))",
               {.k = K::target, .record = {}, .bounds = {}, .element = {}});
  e.ok = ok;
  e.is_constant = is_constant;
  return e;
}

// ---- names, declarations, routines ----

std::string Reader::irl_name(std::string_view foreign) {
  std::string s;
  for (const char c : foreign) {
    const bool is_good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (is_good) s += c;
    else if (!s.empty() && s.back() != '_') s += '_';
  }
  while (!s.empty() && s.back() == '_') s.pop_back();
  if (s.empty()) s = "x";
  if (s[0] >= '0' && s[0] <= '9') s = "n" + s;
  if (s.size() > 60) s.resize(60);
  const std::string low = lower(s);
  if (taken().contains(low) || low.starts_with("r_") || low.starts_with("quat")) s += "_v";
  for (int& n = name_counts_[lower(s)];;) {
    std::string tried = n++ == 0 ? s : s + "_" + std::to_string(n);
    if (used_names_.insert(lower(tried)).second) return tried;
  }
}
std::string Reader::type_text(const Type& t) const {
  switch (t.k) {
    case K::none:
    case K::real: return "REAL";
    case K::integer: return "INT";
    case K::boolean: return "BOOL";
    case K::character: return "CHAR";
    case K::string: return "STRING";
    case K::position: return "POSITION";
    case K::orientation: return "ORIENTATION";
    case K::pose: return "POSE";
    case K::joint: return learned_.external_axes > 0 ? "JOINT" : "MAIN_JOINT";
    case K::target: return "ROBTARGET";
    case K::record: return t.record;
    case K::array: {
      std::string b;
      for (const auto& [lo, hi] : t.bounds)
        b += (b.empty() ? "" : ", ") + std::to_string(lo) + ".." + std::to_string(hi);
      return "ARRAY [" + b + "] OF " + (t.element ? type_text(*t.element) : "REAL");
    }
  }
  return "REAL";
}
std::string Reader::initial(const Type& t) const {
  // A quaternion of zeros is no orientation.
  if (t.k == K::pose) return "POSE(POSITION(0.0, 0.0, 0.0), ORIQUAT(1.0, 0.0, 0.0, 0.0))";
  if (t.k == K::orientation) return "ORIQUAT(1.0, 0.0, 0.0, 0.0)";
  if (t.k == K::array && t.element && t.bounds.size() == 1) {
    const std::string one = initial(*t.element);
    const std::int64_t n = t.bounds[0].second - t.bounds[0].first + 1;
    if (one.empty() || n > 64) return {};
    std::string all;
    for (std::int64_t i = 0; i < n; ++i) all += (i ? ", " : "") + one;
    return "[" + all + "]";
  }
  return {};
}
Symbol* Reader::find(std::string_view low) {
  const std::string key(low);
  if (const auto it = current_->symbols.find(key); it != current_->symbols.end())
    return &it->second;
  const auto it = globals_.find(key);
  return it == globals_.end() ? nullptr : &it->second;
}
Symbol& Reader::declare(std::string_view foreign, Type type, Symbol::Kind kind, bool is_local) {
  Symbol s;
  s.kind = kind;
  s.irl = kind == Symbol::data ? std::string(foreign) : irl_name(foreign);
  s.type = std::move(type);
  if (kind == Symbol::routine) routine_names_.insert(s.irl);
  auto& in = is_local ? current_->symbols : globals_;
  return in.insert_or_assign(lower(foreign), std::move(s)).first->second;
}
void Reader::without_value(const Symbol& s) {
  const bool is_target = s.type.k == K::pose || s.type.k == K::target || s.type.k == K::joint;
  if (is_target && s.kind == Symbol::variable && begins_without_value(s.type.k))
    unvalued_targets_.emplace_back(s.irl, s.type.k);
}
void Reader::declare_variable(const Symbol& s, std::string text, const At& at, bool is_local) {
  if (text.empty()) without_value(s);
  if (text.empty()) text = initial(s.type);
  std::string line = type_text(s.type) + ": " + s.irl + (text.empty() ? "" : " := " + text) + ";";
  auto& to = is_local && !is_in_main()    ? current_->locals
             : s.kind == Symbol::constant ? constants_
                                          : variables_;
  to.push_back({std::move(line), at, true});
}
void Reader::learn(std::string_view foreign, const Type& t) {
  const auto [it, is_new] = learned_.types.try_emplace(lower(foreign), t);
  if (is_new || it->second == t) return;
  if (it->second.k == K::integer && t.k == K::real) it->second = t;
  else if (it->second.k == K::boolean && is_number(t)) it->second = t;
  else if (it->second.k == K::pose && t.k == K::target) it->second = t;
  else if (it->second.k == K::none) it->second = t;
  else if (it->second.k == K::array && t.k == K::array && it->second.bounds.size() == 1 &&
           t.bounds.size() == 1 && it->second.bounds[0].second < t.bounds[0].second)
    it->second = t;
}
Symbol& Reader::implied(std::string_view foreign, const Type& t, const At& at) {
  const std::string low = lower(foreign);
  if (Symbol* s = find(low)) {
    if (learned_.types.contains(low)) learn(low, t);
    return *s;
  }
  learn(low, t);
  Symbol& s = declare(foreign, learned_.types[low]);
  declare_variable(s, {}, at);
  return s;
}
Symbol& Reader::signal(bool is_output, std::int64_t number, std::int64_t width) {
  const std::string foreign = (is_output ? "out_" : "in_") + std::to_string(number) +
                              (width > 1 ? "_" + std::to_string(width) : "");
  const std::string key = "$" + foreign;
  if (const auto it = globals_.find(key); it != globals_.end()) return it->second;
  Symbol s;
  s.kind = is_output ? Symbol::output : Symbol::input;
  s.irl = irl_name(foreign);
  s.type = width > 1 ? integer(0).type : boolean(true).type;
  signals_.push_back({std::string(is_output ? "OUTPUT " : "INPUT ") + (width > 1 ? "INT" : "BOOL") +
                          ": " + s.irl + " AT " + std::to_string(number) +
                          (width > 1 ? ", " + std::to_string(width) : "") + ";",
                      {},
                      false});
  return globals_.emplace(key, std::move(s)).first->second;
}
Symbol& Reader::named_signal(std::string_view foreign, bool is_output, const Type& t, const At& at,
                             std::int64_t known_number) {
  const std::string low = lower(foreign);
  if (Symbol* s = find(low)) return *s;
  Symbol& s = declare(foreign, t, is_output ? Symbol::output : Symbol::input);
  const std::int64_t number =
      known_number >= 0 ? known_number : static_cast<std::int64_t>(signals_.size()) + 1;
  signals_.push_back({std::string(is_output ? "OUTPUT " : "INPUT ") + type_text(t) + ": " + s.irl +
                          " AT " + std::to_string(number) + (t.k == K::integer ? ", 16" : "") + ";",
                      at, true});
  if (known_number >= 0) return s;
  note(at,
       "the number of the signal " + std::string(foreign) +
           " is in the controller's configuration; " + std::to_string(number) + " is taken for it",
       "Write the actual number after AT.");
  return s;
}
void Reader::announce(std::string_view foreign, const std::vector<Parameter>& parameters,
                      const Type& result) {
  Symbol& s = declare(foreign, result, Symbol::routine);
  for (const Parameter& p : parameters) s.parameters.push_back({p.type, p.is_out});
}
void Reader::begin(std::string_view foreign, const std::vector<Parameter>& parameters,
                   const Type& result, const At& at) {
  const std::string key = lower(foreign);
  const Symbol* s = &globals_[key];
  Symbol second;
  if (!begun_.insert(key).second) {
    const std::string_view shown = foreign.substr(foreign.starts_with("!") ? 1 : 0, 60);
    fail(at, std::string(shown) + " is declared twice; the first one is called");
    second.irl = irl_name(foreign);
    s = &second;
  }
  const bool is_function = result.k != K::none;
  Routine& r = open({}, is_function ? "ENDFCT" : "ENDPROC", at);
  r.key = key;
  r.result = result;
  std::string list;
  for (const Parameter& p : parameters) {
    Symbol v;
    v.type = p.type;
    v.irl = irl_name(p.foreign);
    v.is_in_parameter = !p.is_out;
    std::string given = v.irl;
    if (!p.is_out && learned_.flags.contains("written " + key + "." + lower(p.foreign))) {
      given = irl_name(p.foreign + "_given");
      r.locals.push_back({type_text(p.type) + ": " + v.irl + ";", at, false});
      r.body.push_back({"  " + v.irl + " := " + given + ";", at, false});
      v.is_in_parameter = false;
    }
    list += (list.empty() ? "" : "; ") + std::string(p.is_out ? "INOUT " : "IN ") +
            type_text(p.type) + ": " + given;
    r.symbols.insert_or_assign(lower(p.foreign), std::move(v));
  }
  r.head = (is_function ? "FUNCTION " : "PROCEDURE ") + s->irl + " (" + list + ")" +
           (is_function ? ": " + type_text(result) : "");
}
bool Reader::calls_routine(const std::string& text) const {
  for (std::size_t i = 0; i < text.size();) {
    if (std::isalpha(static_cast<unsigned char>(text[i])) == 0) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < text.size() &&
           (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_'))
      ++end;
    if (routine_names_.contains(text.substr(i, end - i))) return true;
    i = end;
  }
  return false;
}
void Reader::will_write(std::string_view low) {
  const auto it = current_->symbols.find(std::string(low));
  if (it != current_->symbols.end() && it->second.is_in_parameter)
    learned_.flags.insert("written " + current_->key + "." + std::string(low));
}
Routine& Reader::open(std::string_view head, std::string_view end, const At& at) {
  Routine& r = routines_.emplace_back();
  r.head = head;
  r.end = end;
  r.at = at;
  current_ = &r;
  return r;
}
void Reader::close() { current_ = &main_; }
void Reader::emit(std::string s, const At& at) {
  const auto by = static_cast<std::size_t>(std::clamp(current_->indent, 1, 40)) * 2;
  current_->body.push_back({std::string(by, ' ') + std::move(s) + take_marks(), at, true});
}
void Reader::indented(int by) { current_->indent += by; }
void Reader::comments_until(const At& at) {
  if (at.file != comment_file_) return;
  for (; next_comment_ < comments_.size() && comments_[next_comment_].line <= at.line;
       ++next_comment_) {
    const std::string s = comment_text(comments_[next_comment_].text);
    if (s.find_first_not_of("-=*+_#/!;.~ ") == std::string::npos) continue;
    At where = at;
    where.line = comments_[next_comment_].line;
    emit("{ " + s + " }", where);
  }
}

// ---- blocks ----

void Reader::open_block(std::string_view word, std::string irl) {
  blocks_.push_back({std::string(word), std::move(irl), false});
  indented(1);
}
bool Reader::is_in(std::string_view word) const {
  return !blocks_.empty() && blocks_.back().word == word;
}
void Reader::open_dead(const At& at) {
  emit("IF FALSE THEN", at);
  indented(1);
  blocks_.back().is_dead = true;
}
void Reader::close_dead(const At& at) {
  if (!std::exchange(blocks_.back().is_dead, false)) return;
  indented(-1);
  emit("ENDIF;", at);
}
bool Reader::close_block(std::string_view word, const At& at, std::string otherwise) {
  if (!is_in(word)) {
    bad(at, std::move(otherwise));
    return false;
  }
  close_dead(at);
  const Block b = std::move(blocks_.back());
  blocks_.pop_back();
  indented(b.has_arm && !b.is_chain ? -2 : -1);
  // A CASE without an arm is nothing.
  if (!b.tested || b.has_arm) emit(b.irl + ";", at);
  return true;
}
void Reader::close_blocks(const At& at) {
  while (!blocks_.empty()) {
    const std::string word = blocks_.back().word;
    fail(at, "a block has no " + word + " above");
    close_block(word, at);
  }
  current().indent = 1;
}
void Reader::between(const std::string& head, const At& at) {
  if (blocks_.empty()) {
    bad(at, "this is outside a block");
    return;
  }
  close_dead(at);
  const bool is_else = !head.starts_with("ELSIF");
  if (blocks_.back().has_else) {
    bad(at, is_else ? "this IF already has an ELSE" : "this comes after the ELSE of its IF");
    open_dead(at);
    return;
  }
  blocks_.back().has_else = is_else;
  indented(-1);
  emit(head, at);
  indented(1);
}
void Reader::open_unread_loop(std::string_view word, const At& at) {
  emit("WHILE FALSE DO", at);
  open_block(word, "ENDWHILE");
}
void Reader::open_case(std::string_view word, const At& at) {
  Ex e = expression();
  const bool is_chain = !e.ok || e.type.k != K::integer;
  if (e.ok && is_chain && !e.is_place && !e.is_constant && e.type.k != K::array) {
    // It is computed once.
    Symbol s;
    s.type = e.type;
    s.irl = irl_name("tested");
    declare_variable(s, {}, at, true);
    emit(s.irl + " := " + e.s + ";", at);
    e = place(s.irl, s.type);
  }
  open_block(word, is_chain ? "ENDIF" : "ENDCASE");
  blocks_.back().tested = std::move(e);
  blocks_.back().is_chain = is_chain;
}
void Reader::open_arm(const std::vector<ArmValue>& values, const At& at) {
  Block& b = blocks_.back();
  close_dead(at);
  if (b.has_else) {
    bad(at, "this case comes after the default case");
    return open_dead(at);
  }
  std::string list;
  bool ok = !values.empty() && b.tested->ok;
  const auto add = [&](const std::string& s, const char* between) {
    list += (list.empty() ? "" : between) + s;
  };
  // Values that are computed are compared, too.
  if (ok && !b.has_arm && !b.is_chain)
    for (const ArmValue& v : values)
      if (v.from.ok && (!v.from.is_constant || v.from.type.k != K::integer)) {
        b.is_chain = true;
        b.irl = "ENDIF";
      }
  for (const ArmValue& v : values) {
    if (!ok) break;
    if (b.is_chain && v.to) {
      const Ex low = binary(Op::ge, *b.tested, v.from, at),
               high = binary(Op::le, *b.tested, *v.to, at);
      ok = low.ok && high.ok;
      add(within(low, kRel) + " AND " + within(high, kRel), " OR ");
    } else if (b.is_chain) {
      const Ex e = binary(Op::eq, *b.tested, v.from, at);
      ok = e.ok;
      add(within(e, kRel), " OR ");
    } else if (!v.from.ok || !v.from.is_constant || v.from.type.k != K::integer ||
               (v.to && (!v.from.is_literal || !v.to->is_literal || v.to->v - v.from.v > 1000))) {
      if (v.from.ok) bad(at, "the values of this case must be known before run time");
      ok = false;
    } else {
      std::vector<std::string> each{v.from.s};
      if (v.to) {
        each.clear();
        for (double x = v.from.v; x <= v.to->v; ++x)
          each.push_back(integer(static_cast<std::int64_t>(x)).s);
      }
      // The first arm with a value is taken.
      for (const std::string& s : each)
        if (b.values.insert(s).second) add(s, ", ");
    }
  }
  if (!ok || list.empty()) {
    if (ok && !b.is_chain)
      warn(at, "earlier cases contain all values of this case, so it is never reached");
    if (!b.has_arm) {
      b.is_chain = true;
      b.irl = "ENDIF";
    } else if (!b.is_chain) {
      return open_dead(at);
    }
    list = "FALSE";
  }
  if (b.is_chain) {
    indented(-1);
    emit((b.has_arm ? "ELSIF " : "IF ") + list + " THEN", at);
    indented(1);
  } else {
    indented(-1);
    if (!b.has_arm) emit("CASE " + b.tested->s + " OF", at);
    indented(b.has_arm ? 0 : 1);
    emit("WHEN " + list + ":", at);
    indented(1);
  }
  b.has_arm = true;
}
void Reader::open_default(const At& at) {
  Block& b = blocks_.back();
  close_dead(at);
  if (b.has_else) {
    bad(at, "there already is a default case");
    return open_dead(at);
  }
  if (!b.has_arm) {
    b.is_chain = true;
    b.irl = "ENDIF";
  }
  indented(-1);
  emit(!b.is_chain ? "DEFAULT:" : b.has_arm ? "ELSE" : "IF TRUE THEN", at);
  indented(1);
  b.has_arm = b.has_else = true;
}
void Reader::assign(const Ex& to, const Ex& from, const At& at) {
  if (!to.ok || !from.ok) return;
  if (!to.setter.empty()) {
    const Ex x = converted(from, to.type, at);
    std::string line;
    for (const char c : to.setter) line += c == '%' ? x.s : std::string(1, c);
    if (x.ok) emit(line + ";", at);
    return;
  }
  if (!to.is_place) {
    bad(at, "this cannot be assigned");
    return;
  }
  if (to.type.k == K::target && from.type.k == K::pose) {
    emit(to.s + ".PSE := " + from.s + ";", at);
    return;
  }
  const Ex x = converted(from, to.type, at);
  if (x.ok) emit(to.s + " := " + x.s + ";", at);
}
std::string Reader::call(std::string_view foreign, const std::vector<Ex>& args, const At& at,
                         std::optional<Type> result) {
  const std::string low = lower(foreign);
  const std::string_view key = foreign;
  if (foreign.starts_with("!")) foreign.remove_prefix(1);  // part of the key only
  const Symbol* s = find(low);
  std::string list;
  if (s && s->kind == Symbol::routine && !learned_.stubs.contains(low)) {
    if (args.size() > s->parameters.size()) {
      bad(at, std::string(foreign) + " takes " + std::to_string(s->parameters.size()) +
                  " values, but here are " + std::to_string(args.size()));
      return {};
    }
    for (std::size_t i = 0; i < s->parameters.size(); ++i) {
      const Type& t = s->parameters[i].type;
      if (i >= args.size()) {
        bad(at, std::string(foreign) + " takes " + std::to_string(s->parameters.size()) +
                    " values, but here are " + std::to_string(args.size()));
        return {};
      }
      Ex x = converted(args[i], t, at);
      if (s->parameters[i].is_out && args[i].is_place) {
        // A parameter of ours that it changes.
        const std::string root = args[i].s.substr(0, args[i].s.find_first_of(".["));
        for (const auto& [name, symbol] : current_->symbols)
          if (symbol.irl == root && symbol.is_in_parameter)
            learned_.flags.insert("written " + current_->key + "." + name);
      }
      if (s->parameters[i].is_out && (!x.is_place || x.s != args[i].s)) {
        // A value is given where a place may be changed: a variable of ours takes it.
        if (args[i].is_place) {
          bad(at, "a variable of a different type is changed by " + std::string(foreign));
          return {};
        }
        const std::string v = irl_name("given");
        (is_in_main() ? variables_ : current_->locals)
            .push_back({type_text(t) + ": " + v + ";", at, false});
        emit(v + " := " + x.s + ";", at);
        x = place(v, t);
      }
      list += (list.empty() ? "" : ", ") + x.s;
    }
    return unused(s->irl + "(" + list + ")", result ? kNone : s->type, at);
  }
  if (s && s->kind != Symbol::routine) {
    bad(at, std::string(foreign) + " is not a routine");
    return {};
  }
  if (const auto word = maker_word(language(), low); word && !s) {
    const std::string name(foreign);
    if (*word == MakerWord::moves || result)
      bad(at, name + " is specific to the controller and is not read",
          "Write the same in IRL, or remove it.");
    else
      left_out(RMP_FAULT_WARNING, at,
               name + " is specific to the controller and moves nothing; it was left out");
    return {};
  }
  // It is not among the files: an empty one replaces it.
  auto [it, is_new] = learned_.stubs.try_emplace(low);
  std::vector<Type>& types = it->second;
  for (std::size_t i = 0; i < args.size(); ++i) {
    if (!args[i].ok) return {};
    if (types.size() <= i) types.push_back(args[i].type);
    else if (types[i].k == K::integer && args[i].type.k == K::real) types[i] = args[i].type;
    else if (types[i].k == K::pose && args[i].type.k == K::target) types[i] = args[i].type;
  }
  if (result) learned_.stub_results.try_emplace(low, *result);
  if (!s) {
    Symbol& made = declare(key, result ? *result : Type{}, Symbol::routine);
    Routine r;
    std::string parameters;
    for (std::size_t i = 0; i < types.size(); ++i)
      parameters += (i ? "; IN " : "IN ") + type_text(types[i]) + ": a" + std::to_string(i + 1);
    const bool is_function = learned_.stub_results.contains(low);
    r.head = std::string(is_function ? "FUNCTION " : "PROCEDURE ") + made.irl + " (" + parameters +
             ")" + (is_function ? ": " + type_text(learned_.stub_results[low]) : "");
    r.end = is_function ? "ENDFCT" : "ENDPROC";
    if (is_function) {
      const Type t = learned_.stub_results[low];
      const std::string zero = initial(t);
      r.locals.push_back(
          {type_text(t) + ": nothing" + (zero.empty() ? "" : " := " + zero) + ";", at, false});
    }
    r.body.push_back(
        {"  WRITELN(" + quoted(std::string(foreign) + " is not among the files") + ");", at,
         false});
    if (is_function) r.body.push_back({"  RETURN nothing;", at, false});
    r.at = at;
    routines_.push_back(std::move(r));
    fail(at, std::string(foreign) + " is not among the files; an empty routine replaces it",
         "Write its statements, or read the program together with its file.");
    s = find(low);
  }
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (i >= args.size()) {
      bad(at, std::string(foreign) + " is called with different numbers of arguments",
          "IRL has no optional parameters.");
      return {};
    }
    const Ex x = converted(args[i], types[i], at);
    list += (i ? ", " : "") + x.s;
  }
  const auto given = learned_.stub_results.find(low);
  return unused(s->irl + "(" + list + ")",
                result || given == learned_.stub_results.end() ? kNone : given->second, at);
}
std::string Reader::unused(const std::string& call, const Type& t, const At& at) {
  if (t.k == K::none) return call;
  const std::string key = "%unused " + type_text(t);
  if (!globals_.contains(key)) {
    Symbol s;
    s.type = t;
    s.irl = irl_name("unused");
    variables_.push_back(
        {type_text(t) + ": " + s.irl + (initial(t).empty() ? "" : " := " + initial(t)) + ";", at,
         false});
    globals_.emplace(key, std::move(s));
  }
  return globals_[key].irl + " := " + call;
}
std::string Reader::helper(std::string_view name) {
  const std::string n(name);
  const std::string key = "%" + n;
  if (const auto it = globals_.find(key); it != globals_.end()) return it->second.irl;
  Symbol s;
  s.kind = Symbol::routine;
  s.irl = irl_name(n);
  routine_names_.insert(s.irl);
  Routine r;
  r.end = "ENDFCT";
  const auto line = [&](const char* t) { r.body.push_back({t, {}, false}); };
  if (n == "bool_number") {
    r.head = "FUNCTION " + s.irl + " (IN BOOL: b): INT";
    line("  IF b THEN RETURN 1; ENDIF;");
    line("  RETURN 0;");
  } else if (n == "rotation_vector") {
    r.head = "FUNCTION " + s.irl + " (IN REAL: x, y, z): ORIENTATION";
    r.locals.push_back({"REAL: angle;", {}, false});
    line("  angle := SQRT(x * x + y * y + z * z);");
    line("  IF angle = 0.0 THEN RETURN ORIQUAT(1.0, 0.0, 0.0, 0.0); ENDIF;");
    line("  RETURN ORIVANG(POSITION(x / angle, y / angle, z / angle), angle * 57.29577951308232);");
  } else if (n == "counting") {
    r.head = "FUNCTION " + s.irl + " (IN INT: first, last): INT";
    line("  IF first > last THEN RETURN -1; ENDIF;");
    line("  RETURN 1;");
  } else if (n == "floor") {
    r.head = "FUNCTION " + s.irl + " (IN REAL: x): INT";
    line("  IF x < TRUNC(x) THEN RETURN TRUNC(x) - 1; ENDIF;");
    line("  RETURN TRUNC(x);");
  } else if (n == "distance") {
    r.head = "FUNCTION " + s.irl + " (IN POSITION: a, b): REAL";
    line(
        "  RETURN SQRT((a.X - b.X) * (a.X - b.X) + (a.Y - b.Y) * (a.Y - b.Y) + (a.Z - b.Z) * (a.Z "
        "- b.Z));");
  } else if (n == "shifted") {
    r.head = "FUNCTION " + s.irl + " (IN POSE: p; IN REAL: x, y, z): POSE";
    line("  RETURN POSE(POSITION(p.POS.X + x, p.POS.Y + y, p.POS.Z + z), p.ORI);");
  } else if (n == "pose_sum") {
    r.head = "FUNCTION " + s.irl + " (IN POSE: p, q): POSE";
    line(
        "  RETURN POSE(POSITION(p.POS.X + q.POS.X, p.POS.Y + q.POS.Y, p.POS.Z + q.POS.Z), p.ORI @ "
        "q.ORI);");
  } else if (n == "shifted_target") {
    r.head = "FUNCTION " + s.irl + " (IN ROBTARGET: p; IN REAL: x, y, z): ROBTARGET";
    r.locals.push_back({"ROBTARGET: t;", {}, false});
    line("  t := p;");
    line("  t.PSE.POS := POSITION(p.PSE.POS.X + x, p.PSE.POS.Y + y, p.PSE.POS.Z + z);");
    line("  RETURN t;");
  } else if (n == "any_configuration_target") {
    r.head = "FUNCTION " + s.irl + " (IN ROBTARGET: p): ROBTARGET";
    r.locals.push_back({"ROBTARGET: t;", {}, false});
    line("  t := p;");
    line("  t.STATUS := -1;");
    for (char k = '1'; k <= '6'; ++k)
      r.body.push_back({"  t.TURNS[" + std::string(1, k) + "] := -128;", {}, false});
    line("  RETURN t;");
  } else if (n == "with_pose") {
    r.head = "FUNCTION " + s.irl + " (IN ROBTARGET: p; IN POSE: q): ROBTARGET";
    r.locals.push_back({"ROBTARGET: t;", {}, false});
    line("  t := p;");
    line("  t.PSE := q;");
    line("  RETURN t;");
  }
  if (n.find("target") != std::string::npos || n == "with_pose") learned_.turns = 6;
  routines_.push_front(std::move(r));
  return globals_.emplace(key, std::move(s)).first->second.irl;
}
void Reader::pulse_of(const Ex& output, const std::string& first, const std::string& then,
                      const Ex& seconds, const At& at) {
  // One process an output: a new pulse takes the place of the one before.
  const std::string key = "%pulse " + output.s + " " + then;
  if (!globals_.contains(key)) {
    Symbol s;
    s.kind = Symbol::data;
    s.irl = irl_name("pulse_" + output.s);
    Symbol length;
    length.type = kReal;
    length.irl = irl_name("length_" + output.s);
    variables_.push_back({"REAL: " + length.irl + ";", at, false});
    Routine r;
    r.head = "PROCESS " + s.irl;
    r.end = "ENDPROCESS";
    r.body.push_back({"  WAIT " + length.irl + " SEC;", at, false});
    r.body.push_back({"  " + output.s + " := " + then + ";", at, false});
    r.at = at;
    routines_.push_back(std::move(r));
    globals_.emplace(key + "/length", std::move(length));
    globals_.emplace(key, std::move(s));
  }
  const std::string name = globals_[key].irl;
  emit("CANCEL " + name + ";", at);
  emit(output.s + " := " + first + ";", at);
  emit(globals_[key + "/length"].irl + " := " + as_real(seconds, at).s + ";", at);
  emit("START " + name + ";", at);
}
std::string Reader::label(std::string_view foreign) {
  const std::string key =
      std::to_string(reinterpret_cast<std::uintptr_t>(current_)) + "." + lower(foreign);
  auto [it, is_new] = labels_.try_emplace(key);
  if (is_new) it->second = irl_name(foreign);
  return it->second;
}

void Reader::place_label(std::string_view foreign, const At& at) {
  const std::string name = label(foreign);
  if (placed_labels_.emplace(current_, name).second) emit("LABEL " + name + ":", at);
  else bad(at, "this routine has the label " + std::string(foreign) + " already");
}

bool Reader::has_label(const std::string& low, bool begins_line) {
  for (std::size_t i = 0; !has_colons_ && i + 1 < tokens_.size(); ++i)
    if (tokens_[i].kind == Tk::name && tokens_[i + 1].low == ":") {
      bool& begins = colons_[tokens_[i].low];
      begins = begins || i == 0 || tokens_[i - 1].kind == Tk::line;
    }
  has_colons_ = true;
  const auto found = colons_.find(low);
  return found != colons_.end() && (found->second || !begins_line);
}

// ---- motions and settings ----

void Reader::declare_modal(const std::string& key, const Type& t, const At& at) {
  if (globals_.contains("%" + key)) return;
  Symbol s;
  s.type = t;
  s.irl = irl_name("present_" + key);
  const auto one = learned_.constant_settings.find(key);
  const auto start = at_start_.find(key);
  declare_variable(s,
                   one != learned_.constant_settings.end() ? one->second
                   : start != at_start_.end()              ? start->second
                                                           : std::string(),
                   at);
  globals_.emplace("%" + key, std::move(s));
}
void Reader::use_setting(const std::string& key, const At& at, bool is_relevant, bool is_left_out) {
  pending_uses_.push_back(uses_of_settings_.size());
  uses_of_settings_.push_back({key, at, is_relevant, is_left_out});
}
std::string Reader::take_marks() {
  std::string marks;
  for (const std::size_t n : pending_uses_) marks += kUseMark + std::to_string(n) + kMarkEnd;
  pending_uses_.clear();
  return marks;
}
void Reader::starts_with(std::string_view modal, const Ex& e) {
  at_start_.insert_or_assign(std::string(modal), e.s);
}
void Reader::set(std::string_view modal, const Ex& to, const At& at) {
  if (!to.ok) return;
  const std::string key(modal);
  learned_.modal[key];
  const std::string mark = kChangeMark + std::to_string(changes_.size()) + kMarkEnd;
  changes_.push_back({key, to.s, to.is_constant, false, false});
  if (to.is_constant && learned_.constant_settings.contains(key)) {
    if (to.type.k == K::pose) declare_modal(key, to.type, at);
    current_->body.push_back({mark, at, false});
    return;
  }
  declare_modal(key, to.type, at);
  const Symbol* s = find("%" + key);
  const Ex x = converted(to, s->type, at);
  if (x.ok) emit(s->irl + " := " + x.s + ";" + mark, at);
}
void Reader::forget(std::string_view modal, const At& at) {
  current_->body.push_back({kChangeMark + std::to_string(changes_.size()) + kMarkEnd, at, false});
  changes_.push_back({std::string(modal), {}, false, false, true});
}
void Reader::set_part(std::string_view modal, const Ex& to, const Ex& from, const At& at) {
  if (!to.ok || !from.ok) return;
  const std::string key(modal);
  learned_.modal[key];
  assign(to, from, at);
  current_->body.push_back({kChangeMark + std::to_string(changes_.size()) + kMarkEnd, at, false});
  changes_.push_back({key, {}, false, true, false});
}
bool Reader::is_set(std::string_view modal) const {
  return learned_.modal.contains(std::string(modal));
}
bool Reader::is_set_before(std::string_view modal, const At& at) {
  const std::string key(modal);
  use_setting(key, at, true, true);
  return learned_.modal.contains(key) && !learned_.unset_uses.contains({key, at.file, at.begin});
}
Ex Reader::get(std::string_view modal, const Type& t, const At& at) {
  const std::string key(modal);
  use_setting(key, at, true, false);
  const auto one = learned_.constant_settings.find(key);
  if (t.k != K::pose && one != learned_.constant_settings.end()) {
    Ex e = value(one->second, t);
    e.is_constant = true;
    return e;
  }
  declare_modal(key, t, at);
  const Symbol* s = find("%" + key);
  return place(s->irl, s->type);
}
void Reader::set_mode(std::string_view modal, const std::string& word, const At& at) {
  const std::string key(modal);
  current_->body.push_back({kChangeMark + std::to_string(changes_.size()) + kMarkEnd, at, false});
  changes_.push_back({key, word, true, false, false});
}
std::string Reader::mode(std::string_view modal, const std::string& at_start, const At& at) {
  const std::string key(modal);
  at_start_.try_emplace(key, at_start);
  use_setting(key, at, false, true);
  const auto it = learned_.known_uses.find({key, at.file, at.begin});
  return it != learned_.known_uses.end() ? it->second
         : learned_.modal.contains(key)  ? ""
                                         : at_start;
}
std::optional<Ex> Reader::setting_here(const std::string& key, const At& at, bool is_relevant) {
  use_setting(key, at, is_relevant, true);
  if (!is_set(key) || learned_.unset_uses.contains({key, at.file, at.begin})) return std::nullopt;
  declare_modal(key, kPose, at);
  return place(find("%" + key)->irl, kPose);
}
Ex Reader::present_joints() {
  learned_.turns = 6;  // the cell says whose the joints are
  return value(learned_.external_axes > 0 ? "R_JOINT_ACT" : "R_JOINT_ACT.M_JOINT", kJoint);
}
Ex Reader::present_target(const std::optional<Ex>& tool, const std::optional<Ex>& frame) {
  learned_.turns = 6;
  if ((tool && !tool->ok) || (frame && !frame->ok)) return failed();
  if (!tool && !frame) return value("R_ROBTARGET_ACT", kTarget);
  std::string pose = tool ? "R_FLANGE_ACT @ " + within(*tool, kSign) : "R_ROBTARGET_ACT.PSE";
  if (frame) pose = "INV(" + frame->s + ") @ " + pose;
  return value(helper("with_pose") + "(R_ROBTARGET_ACT, " + pose + ")", kTarget);
}
Ex Reader::present_target(const At& at) {
  const auto tool = setting_here("tool", at, true);
  return present_target(tool, setting_here("frame", at, true));
}
void Reader::move(Motion m, const At& at) {
  std::string list;
  for (const Ex& t : m.targets) {
    if (!t.ok) return;
    list += (list.empty() ? "" : ", ") + t.s;
  }
  std::string text =
      std::string(m.is_incremental ? "MOVE_INC " : "MOVE ") + std::string(m.word) + " " + list;
  // A motion of joints to joints is the same with any tool.
  const bool has_place =
      m.word != "PTP" || std::any_of(m.targets.begin(), m.targets.end(),
                                     [](const Ex& t) { return t.type.k != K::joint; });
  if (!m.tool && m.has_tool) m.tool = setting_here("tool", at, has_place);
  if (!m.frame && m.has_frames) m.frame = setting_here("frame", at, has_place);
  if (m.tool) m.attributes.emplace_back("TOOL", *m.tool);
  if (m.frame) m.attributes.emplace_back("FRAME", *m.frame);
  std::map<std::string, std::string> given;
  for (const auto& [name, e] : m.attributes) {
    if (!e.ok) return;
    const auto [it, is_new] = given.try_emplace(name, e.s);
    if (!is_new && it->second != e.s) bad(at, name + " of this motion has two values");
    if (!is_new) continue;
    text += " " + name + " := " + within(e, kSum);
  }
  if (!m.until.empty()) text += " UNTIL " + m.until;
  emit(text + ";", at);
}

// ---- the result ----

namespace {

class FinishedProgram final : public ReadProgram {
 public:
  std::deque<std::string> texts;
  std::vector<ReadFile> made;
  std::vector<rmp_code_fault> faults_;
  std::vector<ReadLine> lines_;
  [[nodiscard]] std::span<const ReadFile> files() const override { return made; }
  [[nodiscard]] std::span<const rmp_code_fault> faults() const override { return faults_; }
  [[nodiscard]] std::span<const ReadLine> lines() const override { return lines_; }
};

}  // namespace

/// Bytes that are no UTF-8, as a text that was cut may have, become question marks.
std::string clean(std::string s) {
  for (std::size_t i = 0; i < s.size();) {
    const auto c = static_cast<unsigned char>(s[i]);
    const std::size_t n = c < 0x80                ? 1
                          : c >= 0xC2 && c < 0xE0 ? 2
                          : c >= 0xE0 && c < 0xF0 ? 3
                          : c >= 0xF0 && c < 0xF5 ? 4
                                                  : 0;
    bool is_good = n > 0 && i + n <= s.size();
    for (std::size_t k = 1; is_good && k < n; ++k)
      is_good = (static_cast<unsigned char>(s[i + k]) & 0xC0U) == 0x80U;
    if (is_good && n > 2) {
      const auto d = static_cast<unsigned char>(s[i + 1]);
      is_good = !(c == 0xE0 && d < 0xA0) && !(c == 0xED && d >= 0xA0) && !(c == 0xF0 && d < 0x90) &&
                !(c == 0xF4 && d >= 0x90);
    }
    if (!is_good || c == 0) s[i] = '?';
    i += is_good ? n : 1;
  }
  return s;
}

std::unique_ptr<ReadProgram> Reader::finish() {
  auto made = std::make_unique<FinishedProgram>();
  std::string text;
  std::uint32_t line = 1;
  const auto put = [&](const std::string& s, const At* at = nullptr) {
    text += s;
    text += '\n';
    if (at) made->lines_.push_back({0, line, at->file, at->line});
    ++line;
  };
  const auto put_all = [&](const std::vector<Line>& all, std::string_view before = {}) {
    for (const Line& l : all) {
      // Without the marks of settings; a line of marks only is none.
      std::string kept;
      for (std::size_t i = 0; i < l.s.size(); ++i)
        if (l.s[i] == kUseMark || l.s[i] == kChangeMark)
          while (i < l.s.size() && l.s[i] != kMarkEnd) ++i;
        else kept += l.s[i];
      if (!kept.empty() || l.s.empty())
        put(std::string(before) + kept, l.is_mapped ? &l.at : nullptr);
    }
  };
  const auto section = [&](const char* word, const std::vector<Line>& all) {
    if (all.empty()) return;
    put(word);
    put_all(all, "  ");
  };
  std::string name = irl_name(name_);
  put("PROGRAM " + name + ";");
  const bool has_cell = learned_.turns > 0 || learned_.external_axes > 0;
  if (has_cell) put("SYSTEM_SPECIFICATION '" + lower(name) + ".ssi';");
  for (Routine& r : routines_) {
    if (r.end != "ENDFCT") continue;
    const auto returns = [](const Line& l) {
      const std::size_t b = l.s.find_first_not_of(' ');
      return b != std::string::npos && l.s[b] != '{' && l.s.find("RETURN ") != std::string::npos;
    };
    if (std::any_of(r.body.begin(), r.body.end(), returns)) continue;
    fail(r.at, "this function returns no value that was read; it returns zero here");
    const std::string zero = initial(r.result), given = irl_name("nothing");
    r.locals.push_back(
        {type_text(r.result) + ": " + given + (zero.empty() ? "" : " := " + zero) + ";", r.at,
         false});
    r.body.push_back({"  RETURN " + given + ";", r.at, false});
  }
  const bool is_empty = constants_.empty() && types_.empty() && signals_.empty() &&
                        variables_.empty() && routines_.empty() && main_.body.empty();
  const bool has_reason = std::any_of(faults_.begin(), faults_.end(),
                                      [](const Fault& f) { return f.severity == RMP_FAULT_ERROR; });
  if (is_empty && !has_reason)
    fail({0, 1, 1, 0, 0}, "this file contains no program",
         "It is empty or in another language; select the reader with language = ...");
  section("CONST", constants_);
  section("TYPE", types_);
  section("SIGNAL", signals_);
  section("VAR", variables_);
  for (const Routine& r : routines_) {
    put("");
    put(r.head + ";", r.at.end ? &r.at : nullptr);
    section("VAR", r.locals);
    put("BEGIN");
    put_all(r.body);
    put(r.end + ";");
  }
  put("");
  put("BEGIN");
  put_all(main_.body);
  text += "ENDPROGRAM;\n";
  made->texts.push_back(clean(std::move(text)));
  made->texts.push_back(lower(name) + ".irl");
  made->made.push_back({made->texts[1], made->texts[0], {}});
  if (has_cell) {
    const int n = learned_.external_axes;
    std::string axes, main_axes;
    for (int i = 0; i < std::max(1, n); ++i) axes += (i ? ", AA" : "AA") + std::to_string(i + 1);
    for (int i = 0; i < learned_.axes; ++i) main_axes += (i ? ", A" : "A") + std::to_string(i + 1);
    made->texts.push_back(
        "PROGRAM cell;\n"
        "CONST\n"
        "  INT: R_NTURNS := 6, R_NADDJ := " +
        std::to_string(n) + ", R_NJ := " + std::to_string(learned_.axes + n) +
        ", R_DEVICE_NUMBER := 1;\n" +
        (learned_.has_robot_joints ? "" : "  INT: R_MAKER_AXES := 1;\n") +
        (turns_from() == -180 ? ""
                              : "  INT: R_TURNS_FROM := " + std::to_string(turns_from()) + ";\n") +
        "  STRING: RS := 'RS', XYZ := 'XYZ', YXZ := 'YXZ', ZYX := 'ZYX', ZYZ2 := 'ZYZ2';\n"
        "  STRING: R_DEF_ORI := ZYX;\n"
        "TYPE\n"
        "  RECORD REAL: " +
        main_axes +
        "; ENDRECORD: MAIN_JOINT;\n"
        "  RECORD REAL: " +
        axes +
        "; ENDRECORD: ADD_JOINT;\n"
        "  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n"
        "  RECORD\n"
        "    POSE: PSE;\n"
        "    INT: STATUS;\n"
        "    ARRAY [1..R_NTURNS] OF INT: TURNS;\n"
        "    ADD_JOINT: A_JOINT;\n"
        "  ENDRECORD: ROBTARGET;\n"
        "ENDPROGRAM;\n");
    made->texts.push_back(lower(name) + ".ssi");
    made->made.push_back({made->texts[3], made->texts[2], {}});
  }
  std::stable_sort(faults_.begin(), faults_.end(), [](const Fault& a, const Fault& b) {
    return std::pair(a.at.file, a.at.begin) < std::pair(b.at.file, b.at.begin);
  });
  if (dropped_faults_ > 0)
    faults_.push_back({RMP_FAULT_ERROR, faults_.back().at,
                       std::to_string(dropped_faults_) + " more faults are not listed",
                       "They are marked in the IRL with the comment \"not read\"."});
  for (const Fault& f : faults_) {
    const char* message = made->texts.emplace_back(clean(f.message)).c_str();
    const char* hint = made->texts.emplace_back(clean(f.hint)).c_str();
    rmp_code_fault one{};
    one.severity = f.severity;
    const auto size = static_cast<std::uint32_t>(files_[f.at.file].text.size());
    const std::uint32_t begin = std::min(f.at.begin, size);
    one.span = {f.at.file, f.at.line, f.at.column, begin, std::clamp(f.at.end, begin, size)};
    one.message = message;
    one.hint = hint;
    made->faults_.push_back(one);
  }
  return made;
}

}  // namespace robomosp::readers

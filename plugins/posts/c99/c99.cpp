// SPDX-License-Identifier: Apache-2.0
#include "c99.h"

#include <string>

#include <robomosp/sdk/post_writer.h>

#include "runtime.h"

namespace robomosp::posts {
namespace {

using post::Motion;
using post::Operator;
using post::Signal;
using post::Target;
using post::Text;

constexpr Operator kOperators[] = {{RMP_EXPR_OR, " || ", 10},
                                   {RMP_EXPR_AND, " && ", 20},
                                   {RMP_EXPR_EXOR, " != ", 45, Operator::infix, 40},
                                   {RMP_EXPR_EQUAL, " == ", 40},
                                   {RMP_EXPR_NOT_EQUAL, " != ", 40},
                                   {RMP_EXPR_LESS, " < ", 40},
                                   {RMP_EXPR_LESS_EQUAL, " <= ", 40},
                                   {RMP_EXPR_GREATER, " > ", 40},
                                   {RMP_EXPR_GREATER_EQUAL, " >= ", 40},
                                   {RMP_EXPR_ADD, " + ", 50},
                                   {RMP_EXPR_SUBTRACT, " - ", 50},
                                   {RMP_EXPR_MULTIPLY, " * ", 60},
                                   {RMP_EXPR_DIVIDE, " / ", 60},
                                   {RMP_EXPR_DIV, " / ", 60},
                                   {RMP_EXPR_MOD, " % ", 60},
                                   {RMP_EXPR_NOT, "!", 5, Operator::prefix_group},
                                   {RMP_EXPR_NEGATE, "-", 5, Operator::prefix_group}};
// Joined with others they stand in parentheses, which compilers ask for, as comparisons of
// comparisons do.
constexpr Operator kAndInOr{RMP_EXPR_AND, " && ", 20, Operator::infix, 9};

PostCapabilities both() {
  PostCapabilities c;
  c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
               kPostRecursion | kPostLocals | kPostIntegers | kPostReals | kPostBooleans |
               kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostJointValues |
               kPostFunctionsOfMath | kPostIf | kPostElsif | kPostWhile | kPostRepeat | kPostLoop |
               kPostExit | kPostFor | kPostForStep | kPostGoto | kPostReturn | kPostWaitFor |
               kPostWaitTimeout | kPostVariableTargets | kPostVariableAttributes | kPostMessages |
               kPostPause | kPostOutputsAreRead | kPostFrames | kPostShortCircuit;
  c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostPtpIncrement |
              kPostLinIncrement;
  c.circle = PostCircle::via;
  c.external_axes = 12;  // RMP_MOST_JOINTS of the runtime
  c.max_name = 31;
  c.case_matters = true;
  c.name_case = PostCase::lower;
  c.reserved =
      "auto break case char const continue default do double else enum extern float for goto if "
      "inline int long register restrict return short signed sizeof static struct switch typedef "
      "union unsigned void volatile while main printf exit abs div remove rename y0 y1 yn j0 j1 jn "
      "index signal system time clock exp log sin cos tan sqrt floor ceil fabs pow round trunc "
      "gamma fputs fflush stdout stdin stderr errno bool true false NULL";
  c.extensions = "c,h";
  c.title = "C";
  return c;
}
const PostCapabilities& c_capabilities() {
  static const PostCapabilities c = [] {
    PostCapabilities all = both();
    all.features |= kPostUntil | kPostTime;
    return all;
  }();
  return c;
}
const PostCapabilities& pa10_capabilities() {
  static const PostCapabilities c = [] {
    PostCapabilities all = both();
    all.title = "C for the PA-10";
    return all;
  }();
  return c;
}

class CWriter final : public post::Writer {
 public:
  CWriter(const PostTask& task, PostOutput& output, const PostCapabilities& caps,
          Progress& progress, const char* runtime_name, const char* runtime)
      : Writer(task, output, caps, progress), runtime_name_(runtime_name), runtime_(runtime) {}

 private:
  // ---- program ----
  bool program_is_last() const override { return true; }
  void begin() override {
    writes_additional_ = has_additional_joints();
    out_ = &body_;
    for (const std::uint32_t t : records_in_use()) {
      const auto& x = type(t);
      at_ = x.span;
      types_.add("typedef struct " + struct_name(t) + " {", &at_);
      types_.in();
      for (std::uint32_t k = 0; k < x.field_count; ++k)
        types_.add(declared(field_row(x.first_field + k).type, field_name(t, k)) + ";", &at_);
      types_.out();
      types_.add("} " + struct_name(t) + ";");
    }
    for (std::uint32_t r = 1; r < c_.routines.count; ++r)
      if (is_reached(r)) {
        at_ = routine(r).span;
        heads_.add("static " + head(r) + ";", &at_);
      }
  }
  std::string head(std::uint32_t r) {
    const auto& x = routine(r);
    std::string s = (x.kind == RMP_ROUTINE_FUNCTION ? c_type(x.result) : std::string("void")) +
                    " " + routine_name(r) + "(";
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const std::uint32_t p = x.first_parameter + k;
      const bool is_out = symbol(p).mode != RMP_MODE_IN;
      if (type(symbol(p).type).kind == RMP_TYPE_ARRAY && !is_out)
        cannot("arrays passed by value", "Make the parameter INOUT.");
      s += (k ? ", " : "") + (is_out ? declared(symbol(p).type, "(*" + name(p) + ")")
                                     : declared(symbol(p).type, name(p)));
    }
    return s + (x.parameter_count ? ")" : "void)");
  }
  void routine_begin(std::uint32_t r) override {
    const auto& x = routine(r);
    init_.clear();
    if (x.kind == RMP_ROUTINE_PROCESS || x.kind == RMP_ROUTINE_INTERRUPT)
      cannot(x.kind == RMP_ROUTINE_PROCESS ? "parallel processes" : "interrupts");
    if (!body_.empty()) body_.add("");
    open(r == 0 ? "int main(int argc, char **argv) {" : "static " + head(r) + " {");
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = symbol(s).span;
    if (symbol(s).kind == RMP_SYMBOL_ROBOT) {
      cannot("descriptions of robots", "Leave the robot to the program's arguments.");
      return;
    }
    const std::string d = declared(symbol(s).type, name(s)) + ";";
    if (r == 0) globals_.add("static " + d, &at_);
    else line(d);
    init_.push_back(s);
  }
  void routine_code(std::uint32_t r) override {
    if (r == 0) {
      line("rmp_open(argc, argv);");
      if (!profile_.prologue.empty()) body_.add_lines(profile_.prologue);
    }
    for (const std::uint32_t s : init_) {
      at_ = symbol(s).span;
      initial(name(s), symbol(s).type, symbol(s).value);
    }
    at_ = routine(r).span;
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0) {
      if (!profile_.epilogue.empty()) body_.add_lines(profile_.epilogue);
      line("rmp_close();");
      line("return 0;");
    }
    close("}");
  }
  void finish() override {
    post::File all;
    const std::string name = routine_name(0);
    all.add("/* " + name + ": compile with rmp_motion.c and " + std::string(runtime_name_) +
            ". */");
    if (needs_math_) all.add("#include <math.h>");
    all.add("#include <stdio.h>");
    if (needs_abs_ || !write_real_.empty()) all.add("#include <stdlib.h>");
    all.add("#include <string.h>");
    all.add("");
    all.add("#include \"rmp_motion.h\"");
    all.add("");
    for (const auto* f : {&types_, &globals_, &heads_}) {
      all.append(*f);
      if (!f->empty()) all.add("");
    }
    if (!write_real_.empty()) write_real(all);
    all.append(conditions_);
    if (!conditions_.empty()) all.add("");
    all.append(body_);
    all.give(output_, name + ".c", false);
    output_.file("rmp_motion.h", c_runtime::kHeader);
    output_.file("rmp_motion.c", c_runtime::kGeometry);
    output_.file(runtime_name_, std::string(runtime_) +
                                    (writes_additional_ ? c_runtime::additional(runtime_) : ""));
  }

  /// A function that prints a number as a run of the IRL does: the fewest digits that read back to
  /// it, an exponent from 1e15 on and below 1e-5 only.
  void write_real(post::File& to) const {
    for (const char* l :
         {") {", "  char digits[40], *e;", "  int p, exponent;",
          "  if (v == 0) v = 0;  /* not -0 */", "  for (p = 0; p < 17; ++p) {",
          "    sprintf(digits, \"%.*e\", p, v);", "    if (strtod(digits, NULL) == v) break;",
          "  }", "  e = strchr(digits, 'e');", "  exponent = e ? atoi(e + 1) : 0;",
          "  if (e && (exponent < -5 || exponent >= 15))",
          "    printf(\"%.*s%s%s\", (int)(e - digits), digits, p ? \"\" : \".0\", e);", "  else",
          "    printf(\"%.*f\", p - exponent > 1 ? p - exponent : 1, v);", "}", ""})
      to.add(*l == ')' ? "static void " + write_real_ + "(double v" + l : std::string(l));
  }

  // ---- types and values ----
  std::string struct_name(std::uint32_t t) {
    return names_.of((1ULL << 41U) + t, *type(t).name ? type(t).name : "record_type");
  }
  std::string c_type(std::uint32_t t) {
    const auto& x = type(t);
    switch (x.kind) {
      case RMP_TYPE_INT:
      case RMP_TYPE_BOOL: return "int";
      case RMP_TYPE_REAL: return "double";
      case RMP_TYPE_CHAR: return "char";
      case RMP_TYPE_ARRAY: return c_type(x.element);
      case RMP_TYPE_RECORD: break;
      default: cannot("variables of " + type_name(t)); return "int";
    }
    switch (x.role) {
      case RMP_ROLE_POSITION: return "rmp_position";
      case RMP_ROLE_ORIENTATION: return "rmp_orientation";
      case RMP_ROLE_POSE: return "rmp_pose";
      case RMP_ROLE_ROBTARGET: return "rmp_target";
      case RMP_ROLE_JOINT:
      case RMP_ROLE_MAIN_JOINT:
      case RMP_ROLE_ADD_JOINT: return "rmp_joint";
      case RMP_ROLE_ROBOT: cannot("descriptions of robots"); return "int";
      default: return struct_name(t);
    }
  }
  std::string declared(std::uint32_t t, const std::string& what) {
    std::string s = c_type(t) + " " + what;
    for (; type(t).kind == RMP_TYPE_ARRAY; t = type(t).element)
      s += "[" + std::to_string(std::int64_t{type(t).upper} - type(t).lower + 1) + "]";
    return s;
  }
  void initial(const std::string& to, std::uint32_t t, std::uint32_t value) {
    const auto& x = type(t);
    const bool is_whole =
        x.kind == RMP_TYPE_ARRAY || (x.kind == RMP_TYPE_RECORD && x.role == RMP_ROLE_NONE);
    if (is_whole && value == RMP_NONE) {
      line("memset(&" + to + ", 0, sizeof " + to + ");");
      // Orientations of zero are none.
      return;
    }
    if (is_whole && expression(value).op == RMP_EXPR_MAKE) {
      const auto of = links(expression(value).first, expression(value).count);
      for (std::size_t k = 0; k < of.size(); ++k) {
        const auto n = static_cast<std::uint32_t>(k);
        if (x.kind == RMP_TYPE_ARRAY) initial(to + "[" + std::to_string(k) + "]", x.element, of[k]);
        else initial(to + "." + field_name(t, n), field_row(x.first_field + n).type, of[k]);
      }
      return;
    }
    if (x.kind == RMP_TYPE_ARRAY) {
      copy_array(to, value);
      return;
    }
    line(to + " = " + (value == RMP_NONE ? zero(t) : text(value)) + ";");
  }
  void copy_array(const std::string& to, std::uint32_t value) {
    const std::string from = place(value);
    line("memcpy(&" + to + ", &" + from + ", sizeof " + to + ");");
  }
  std::string zero(std::uint32_t t) {
    const std::string k = c_type(t);
    if (k == "double") return "0.0";
    if (k == "rmp_position") return "rmp_at(0, 0, 0)";
    if (k == "rmp_orientation") return "rmp_turned(1, 0, 0, 0)";
    if (k == "rmp_pose") return "rmp_placed(rmp_at(0, 0, 0), rmp_turned(1, 0, 0, 0))";
    if (k == "rmp_joint") return "rmp_joints(NULL, 0, NULL, 0)";
    if (k == "rmp_target")
      return "rmp_aimed(rmp_placed(rmp_at(0, 0, 0), rmp_turned(1, 0, 0, 0)), 0, NULL, 0)";
    return "0";
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override { return kOperators; }
  const Operator* operation(const rmp_code_expression& e) override {
    if (e.op == RMP_EXPR_AND) return &kAndInOr;
    return Writer::operation(e);
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL) return {k.integer ? "1" : "0"};
    if (k.kind == RMP_CONSTANT_INT && k.integer == -2147483648LL) return {"(-2147483647 - 1)"};
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_CHAR) return {std::to_string(k.integer)};
    return Writer::literal(k);
  }
  Text string_literal(std::string_view s) override { return {quoted(s, false)}; }
  static std::string quoted(std::string_view s, bool is_format) {
    std::string out = "\"";
    for (const char c : s) {
      const auto u = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') out += '\\';
      if (is_format && c == '%') out += '%';
      if (c == '?') out += '\\';
      if (u < 32 || u > 126) {
        char octal[8];
        std::snprintf(octal, sizeof octal, "\\%03o", u);
        out += octal;
      } else {
        out += c;
      }
    }
    return out + "\"";
  }
  Text variable(std::uint32_t s) override {
    const bool is_out = symbol(s).kind == RMP_SYMBOL_PARAMETER && symbol(s).mode != RMP_MODE_IN;
    return {is_out ? "(*" + name(s) + ")" : name(s)};
  }
  Text value_of(const std::string& call, const Signal& s) {
    if (s.type == RMP_TYPE_BOOL) return {"(" + call + (s.inverted ? " == 0)" : " != 0)")};
    if (s.type == RMP_TYPE_INT) return {"(int)" + call, 70};
    return {call};
  }
  Text input(const Signal& s) override {
    return value_of("rmp_input(" + std::to_string(s.number) + ", " + quoted(s.name, false) + ")",
                    s);
  }
  Text output(const Signal& s) override {
    return value_of("rmp_state(" + std::to_string(s.number) + ")", s);
  }
  Text convert(std::uint32_t operand, const rmp_code_expression& e) override {
    const std::uint32_t from = expression(operand).type;
    if (e.type == RMP_TYPE_REAL && from == RMP_TYPE_INT)
      return {"(double)" + within(expr(operand), 70), 65};
    if (e.type == RMP_TYPE_INT && from == RMP_TYPE_CHAR)
      return {"(int)(unsigned char)" + within(expr(operand), 70), 65};
    if (e.type == RMP_TYPE_CHAR && from == RMP_TYPE_INT)
      return {"(char)" + within(expr(operand), 70), 65};
    return Writer::convert(operand, e);
  }
  std::uint32_t row_of(const rmp_code_expression& x) const {
    return static_cast<std::uint32_t>(
        static_cast<std::size_t>(reinterpret_cast<const char*>(&x) -
                                 static_cast<const char*>(c_.expressions.rows)) /
        c_.expressions.row_size);
  }
  std::string place(std::uint32_t e) {
    const auto& x = expression(e);
    if (x.op == RMP_EXPR_SYMBOL) return variable(x.symbol).text;
    if (x.op == RMP_EXPR_CALL) return text(e);
    if (x.op == RMP_EXPR_INDEX) {
      const auto of = links(x.first, x.count);
      const auto& t = type(expression(of[0]).type);
      if (t.kind != RMP_TYPE_ARRAY) {
        cannot("elements of " + type_name(expression(of[0]).type));
        return "0";
      }
      if (const auto v = known(of[1]))
        return place(of[0]) + "[" + post::fixed(*v - t.lower, 0) + "]";
      std::string i = within(expr(of[1]), 50);
      if (t.lower > 0) i += " - " + std::to_string(t.lower);
      if (t.lower < 0) i += " + " + std::to_string(-std::int64_t{t.lower});
      return place(of[0]) + "[" + i + "]";
    }
    if (x.op != RMP_EXPR_FIELD) {
      // A known value: what stands for it is an expression.
      return within(expr(e), 100);
    }
    const std::uint32_t object = links(x.first, x.count)[0];
    const std::uint32_t t = expression(object).type;
    static constexpr const char* kXyz[] = {"x", "y", "z"};
    static constexpr const char* kQ[] = {"w", "x", "y", "z"};
    const std::string at = place(object);
    const std::uint32_t n = x.symbol;
    switch (role(t)) {
      case RMP_ROLE_POSITION: return at + "." + kXyz[n % 3];
      case RMP_ROLE_ORIENTATION: return at + "." + kQ[n % 4];
      case RMP_ROLE_POSE: return at + (n == 0 ? ".pos" : ".ori");
      case RMP_ROLE_JOINT: return at;
      case RMP_ROLE_MAIN_JOINT: return at + ".main[" + std::to_string(n) + "]";
      case RMP_ROLE_ADD_JOINT: return at + ".add[" + std::to_string(n) + "]";
      case RMP_ROLE_ROBTARGET:
        if (n == 0) return at + ".pse";
        if (n == 1) return at + ".status";
        if (n == 3) return at;
        cannot("turn numbers of targets", "They follow from the joints.");
        return at;
      default: return at + "." + field_name(t, n);
    }
  }
  Text index(std::uint32_t, std::uint32_t, const rmp_code_expression& x) override {
    return {place(row_of(x))};
  }
  Text field(std::uint32_t, std::uint32_t, const rmp_code_expression& x) override {
    return {place(row_of(x))};
  }
  std::string at(const Pose& p) {
    for (const double x : p.p)
      if (!(std::fabs(x) < 1e6))
        fail("a position here is beyond the reach of any robot", "Check what it is computed from.");
    return "rmp_at(" + post::with_unit_digits(p.p[0] * 1000) + ", " +
           post::with_unit_digits(p.p[1] * 1000) + ", " + post::with_unit_digits(p.p[2] * 1000) +
           ")";
  }
  std::string turned(const Pose& p) {
    for (const double x : p.R)
      if (!std::isfinite(x))
        fail("an orientation here is not finite", "Check what it is computed from.");
    const auto q = post::quaternion(p.R);
    return "rmp_turned(" + post::with_unit_digits(q[0]) + ", " + post::with_unit_digits(q[1]) +
           ", " + post::with_unit_digits(q[2]) + ", " + post::with_unit_digits(q[3]) + ")";
  }
  static std::string numbers(std::span<const double> v, double by) {
    if (v.empty()) return "NULL, 0";
    std::string s = "(const double[]){";
    for (std::size_t i = 0; i < v.size(); ++i)
      s += (i ? ", " : "") + post::with_unit_digits(v[i] * by);
    return s + "}, " + std::to_string(v.size());
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression&) override {
    switch (p.role) {
      case RMP_ROLE_POSITION: return Text{at(p.pose)};
      case RMP_ROLE_ORIENTATION: return Text{turned(p.pose)};
      case RMP_ROLE_POSE: return Text{"rmp_placed(" + at(p.pose) + ", " + turned(p.pose) + ")"};
      case RMP_ROLE_ROBTARGET:
        return Text{"rmp_aimed(rmp_placed(" + at(p.pose) + ", " + turned(p.pose) + "), " +
                    std::to_string(p.status) + ", " + numbers(p.external, 1) + ")"};
      default:
        return Text{"rmp_joints(" + numbers(p.q, post::kDegree) + ", " + numbers(p.external, 1) +
                    ")"};
    }
  }
  Text make(std::span<const std::uint32_t> of, const rmp_code_expression& x) override {
    const auto array = [&] {
      return of.empty() ? std::string("NULL, 0")
                        : "(const double[]){" + list(of) + "}, " + std::to_string(of.size());
    };
    switch (role(x.type)) {
      case RMP_ROLE_POSITION: return {"rmp_at(" + list(of) + ")"};
      case RMP_ROLE_ORIENTATION: return {"rmp_turned(" + list(of) + ")"};
      case RMP_ROLE_POSE: return {"rmp_placed(" + list(of) + ")"};
      case RMP_ROLE_MAIN_JOINT: return {"rmp_joints(" + array() + ", NULL, 0)"};
      case RMP_ROLE_ADD_JOINT: return {"rmp_joints(NULL, 0, " + array() + ")"};
      case RMP_ROLE_JOINT: return {"rmp_with_add(" + text(of[0]) + ", " + text(of[1]) + ")"};
      case RMP_ROLE_NONE:
        if (type(x.type).kind == RMP_TYPE_RECORD)
          return {"(" + struct_name(x.type) + "){" + list(of) + "}"};
        return Writer::make(of, x);
      default: return Writer::make(of, x);
    }
  }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression&) override {
    const bool is_pose = role(expression(a).type) == RMP_ROLE_POSE;
    const bool is_place = role(expression(b).type) == RMP_ROLE_POSITION;
    return {std::string(is_pose ? (is_place ? "rmp_moved(" : "rmp_composed(")
                                : (is_place ? "rmp_rotated(" : "rmp_product(")) +
            text(a) + ", " + text(b) + ")"};
  }
  Text intrinsic(std::string_view name, std::span<const std::uint32_t> of,
                 const rmp_code_expression& x) override {
    static constexpr std::pair<std::string_view, const char*> kSame[] = {
        {"SIN", "rmp_sin"},     {"COS", "rmp_cos"},        {"TAN", "rmp_tan"},
        {"ASIN", "rmp_asin"},   {"ACOS", "rmp_acos"},      {"ATAN", "rmp_atan"},
        {"ATAN2", "rmp_atan2"}, {"SQRT", "sqrt"},          {"EXP", "exp"},
        {"LN", "log"},          {"TRUNC", "rmp_trunc"},    {"ROUND", "rmp_round"},
        {"CROSS", "rmp_cross"}, {"DOT", "rmp_dot"},        {"ORIQUAT", "rmp_turned"},
        {"INV", "rmp_inverse"}, {"ORIMULT", "rmp_product"}};
    for (const auto& [irl, c] : kSame)
      if (name == irl) {
        needs_math_ = needs_math_ || c[0] != 'r';
        return {std::string(c) + "(" + list(of) + ")"};
      }
    const auto three = [&](int a, int b, int c, bool is_back) {
      const auto about = [&](int axis, std::size_t k) {
        return "rmp_about(" + std::to_string(axis) + ", " + text(of[k]) + ")";
      };
      return Text{"rmp_product(rmp_product(" + about(a, is_back ? 2 : 0) + ", " + about(b, 1) +
                  "), " + about(c, is_back ? 0 : 2) + ")"};
    };
    if (name == "ORIXYZ") return three(0, 1, 2, false);
    if (name == "ORIYXZ") return three(1, 0, 2, false);
    if (name == "ORIZYX") return three(2, 1, 0, false);
    if (name == "ORIZYZ2") return three(2, 1, 2, false);
    if (name == "ORIRS") return three(2, 1, 0, true);
    if (name == "FLOAT") return {"(double)" + within(expr(of[0]), 70), 65};
    if (name == "ABS") {
      const bool is_int = x.type == RMP_TYPE_INT;
      (is_int ? needs_abs_ : needs_math_) = true;
      return {std::string(is_int ? "abs(" : "fabs(") + text(of[0]) + ")"};
    }
    return Writer::intrinsic(name, of, x);
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> of) override {
    return {routine_name(r) + "(" + arguments(r, of) + ")"};
  }
  std::string arguments(std::uint32_t r, std::span<const std::uint32_t> of) {
    std::string s;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const auto p = routine(r).first_parameter + static_cast<std::uint32_t>(k);
      const bool is_out = symbol(p).mode != RMP_MODE_IN;
      s += (k ? ", " : "") + (is_out ? "&" + place(of[k]) : text(of[k]));
    }
    return s;
  }

  // ---- statements ----
  void assign(std::uint32_t to, std::uint32_t value) override {
    const auto& x = expression(to);
    const auto& v = expression(value);
    if (type(x.type).kind == RMP_TYPE_ARRAY) {
      if (v.op == RMP_EXPR_MAKE) initial(place(to), x.type, value);
      else copy_array(place(to), value);
      return;
    }
    if (x.op == RMP_EXPR_FIELD) {
      const std::uint32_t of = role(expression(links(x.first, x.count)[0]).type);
      const std::string p = place(to);
      if (of == RMP_ROLE_JOINT)
        return line(p + " = " + (x.symbol == 0 ? "rmp_with_main(" : "rmp_with_add(") + p + ", " +
                    text(value) + ");");
      if (of == RMP_ROLE_ROBTARGET && x.symbol == 3) {
        cannot("assignments of a target's additional joints as a whole", "Assign them one by one.");
        return;
      }
    }
    line(place(to) + " = " + text(value) + ";");
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    std::string v = text(value);
    if (s.inverted && s.type == RMP_TYPE_BOOL) v = "!(" + v + ")";
    line("rmp_output(" + std::to_string(s.number) + ", " + quoted(s.name, false) + ", " + v + ");");
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> of) override {
    line(routine_name(r) + "(" + arguments(r, of) + ");");
  }
  /// Values of several parts as a run writes them: records in ( ), arrays in [ ].
  bool whole(const std::string& from, std::uint32_t t, std::string& format, std::string& rest) {
    const auto& x = type(t);
    const auto number = [&](const char* how, const std::string& what) {
      format += how;
      rest += ", " + what;
      return true;
    };
    switch (x.kind) {
      case RMP_TYPE_INT: return number("%d", from);
      case RMP_TYPE_REAL: return number("%g", from);
      case RMP_TYPE_CHAR: return number("%c", from);
      case RMP_TYPE_BOOL: return number("%s", from + " ? \"TRUE\" : \"FALSE\"");
      default: break;
    }
    std::vector<std::pair<std::string, std::uint32_t>> parts;
    const bool is_array = x.kind == RMP_TYPE_ARRAY;
    if (is_array) {
      const std::int64_t count = std::int64_t{x.upper} - x.lower + 1;
      for (std::int64_t k = 0; k < count && k <= 100; ++k)
        parts.emplace_back(from + "[" + std::to_string(k) + "]", x.element);
    } else if (x.kind == RMP_TYPE_RECORD) {
      static constexpr const char* kXyz[] = {"x", "y", "z"};
      static constexpr const char* kQ[] = {"w", "x", "y", "z"};
      for (std::uint32_t k = 0; k < x.field_count; ++k) {
        std::string part;
        switch (x.role) {
          case RMP_ROLE_POSITION: part = from + "." + kXyz[k % 3]; break;
          case RMP_ROLE_ORIENTATION: part = from + "." + kQ[k % 4]; break;
          case RMP_ROLE_POSE: part = from + (k == 0 ? ".pos" : ".ori"); break;
          case RMP_ROLE_JOINT: part = from; break;
          case RMP_ROLE_MAIN_JOINT: part = from + ".main[" + std::to_string(k) + "]"; break;
          case RMP_ROLE_ADD_JOINT: part = from + ".add[" + std::to_string(k) + "]"; break;
          case RMP_ROLE_NONE: part = from + "." + field_name(t, k); break;
          default: break;
        }
        if (!part.empty()) parts.emplace_back(std::move(part), field_row(x.first_field + k).type);
      }
    }
    if (parts.empty() || parts.size() > 100 || rest.size() > 4000) {
      cannot("messages with " + type_name(t), "Write its parts one by one.");
      return false;
    }
    format += is_array ? "[" : "(";
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (k) format += ", ";
      // Joints are doubles in C, whatever the cell says.
      const bool is_joint = x.role == RMP_ROLE_MAIN_JOINT || x.role == RMP_ROLE_ADD_JOINT;
      if (!(is_joint ? number("%g", parts[k].first)
                     : whole(parts[k].first, parts[k].second, format, rest)))
        return false;
    }
    format += is_array ? "]" : ")";
    return true;
  }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    std::string format, rest;
    const auto print = [&] {
      if (!format.empty()) line("printf(\"" + format + "\"" + rest + ");");
      format.clear();
      rest.clear();
    };
    for (const std::uint32_t v : values) {
      const auto& x = expression(v);
      if (x.constant != RMP_NONE && constant(x.constant).kind == RMP_CONSTANT_TEXT) {
        const std::string q =
            quoted({constant(x.constant).text, constant(x.constant).text_size}, true);
        format += q.substr(1, q.size() - 2);
        continue;
      }
      switch (type(x.type).kind) {
        case RMP_TYPE_INT: format += "%d"; break;
        case RMP_TYPE_BOOL: format += "%s"; break;
        case RMP_TYPE_REAL:
          print();
          if (write_real_.empty()) write_real_ = names_.unique("write_real");
          line(write_real_ + "(" + text(v) + ");");
          continue;
        case RMP_TYPE_CHAR: format += "%c"; break;
        default:
          if (x.op != RMP_EXPR_SYMBOL && x.op != RMP_EXPR_INDEX && x.op != RMP_EXPR_FIELD) {
            cannot("messages with " + type_name(x.type) + " computed in place",
                   "Assign it to a variable.");
            return;
          }
          if (!whole(place(v), x.type, format, rest)) return;
          continue;
      }
      rest += ", " + (type(x.type).kind == RMP_TYPE_BOOL
                          ? within(expr(v), 9) + " ? \"TRUE\" : \"FALSE\""
                          : text(v));
    }
    if (ends_line) format += "\\n";
    print();
  }
  void if_begin(std::uint32_t c) override { open("if (" + text(c) + ") {"); }
  void else_if(std::uint32_t c) override { middle("} else if (" + text(c) + ") {"); }
  void else_() override { middle("} else {"); }
  void if_end() override { close("}"); }
  void while_begin(std::uint32_t c) override { open("while (" + text(c) + ") {"); }
  void while_end() override { close("}"); }
  void repeat_begin() override { open("do {"); }
  void repeat_end(std::uint32_t c) override { close("} while (!(" + text(c) + "));"); }
  void loop_begin() override { open("for (;;) {"); }
  void loop_end() override { close("}"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    const std::string v = variable(s).text;
    const std::string last = names_.unique("last"), by = names_.unique("step");
    // The last value stays, and is not passed by.
    open("{");
    line("const int " + last + " = " + text(to) + ", " + by + " = " +
         (step == RMP_NONE ? std::string("1") : text(step)) + ";");
    open("for (" + v + " = " + text(from) + "; " + v + (down ? " >= " : " <= ") + last + "; " + v +
         (down ? " -= " : " += ") + by + ") {");
    loops_.push_back("if (" +
                     (down ? "(double)" + v + " - " + last : "(double)" + last + " - " + v) +
                     " < " + by + ") break;");
  }
  void for_end(std::uint32_t) override {
    line(loops_.back());
    loops_.pop_back();
    close("}");
    close("}");
  }
  void exit_loop() override { line("break;"); }
  void go_to(std::uint32_t l) override { line("goto " + name(l) + ";"); }
  void label(std::uint32_t l) override { line(name(l) + ":;"); }
  void return_(std::uint32_t v) override {
    if (in_routine_ == 0) {
      line("rmp_close();");
      line("return 0;");
      return;
    }
    line(v == RMP_NONE ? "return;" : "return " + text(v) + ";");
  }
  void wait_time(std::uint32_t s) override { line("rmp_wait(" + text(s) + ");"); }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    const std::uint32_t told = system_symbol("R_TIMEOUT");
    const bool tells = told != RMP_NONE && is_used(told);
    if (tells) line(name(told) + " = 0;");
    line("rmp_wait_begin(" + (timeout == RMP_NONE ? std::string("-1") : text(timeout)) + ");");
    open("while (!(" + text(c) + "))");
    if (tells) line("if (rmp_wait_over()) { " + name(told) + " = 1; break; }");
    else line("if (rmp_wait_over()) break;");
    out_->out();
  }
  void pause(std::uint32_t m) override {
    line("rmp_pause(" + (m == RMP_NONE ? std::string("\"\"") : text(m)) + ");");
  }
  void halt() override { line("rmp_halt();"); }

  // ---- motions ----
  std::string number_of(const Motion& m, std::uint32_t a, double otherwise) {
    const auto& x = m[a];
    if (x.known) return post::shortest(*x.known);
    return x.expression == RMP_NONE ? post::shortest(otherwise) : text(x.expression);
  }
  std::string how(const Motion& m) {
    if (m[RMP_ATTR_WOBBLE].given && m[RMP_ATTR_WOBBLE].known != 0.0) cannot("weaving");
    if (m[RMP_ATTR_DEVICE].given && m[RMP_ATTR_DEVICE].known != 1.0) cannot("other devices");
    if (m[RMP_ATTR_ADAX_CONTROL].given && m[RMP_ATTR_ADAX_CONTROL].known != 0.0)
      cannot("control of additional axes");
    if (m[RMP_ATTR_TOOL].given)
      cannot("tools of motions (TOOL, or the robot's tool in its world)",
             "Multiply the targets by INV of the tool, or post for a controller with tools.");
    if ((caps_.features & kPostTime) == 0 && m[RMP_ATTR_TIME].given &&
        !(m[RMP_ATTR_TIME].known && *m[RMP_ATTR_TIME].known < 0))
      cannot("motions with a given duration");
    const auto blends = [&](std::uint32_t a) {
      return (m[a].known && *m[a].known > 0) || (!m[a].known && m[a].expression != RMP_NONE);
    };
    if (blends(m.interpolation == RMP_MOVE_PTP ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP) ||
        (m[RMP_ATTR_C_PASS].given && m[RMP_ATTR_C_PASS].known != 0.0))
      note("C stops at this target: the library's motion functions do not blend");
    if (m[RMP_ATTR_C_SPEED].given && m[RMP_ATTR_C_SPEED].known != 100.0)
      warn("C_SPEED is not written: the library's motion functions do not blend", "Take it out.");
    if ((caps_.features & kPostUntil) == 0 && !std::exchange(told_speed_, true))
      warn("the library uses its own speeds: its speed functions are not called",
           "Set the speeds on the arm, or in the profile's prologue.");
    return "(rmp_move){" + number_of(m, RMP_ATTR_SPEED, 250) + ", " +
           number_of(m, RMP_ATTR_SPEED_ORI, 90) + ", " + number_of(m, RMP_ATTR_ACC, 100) + ", " +
           number_of(m, RMP_ATTR_TIME, -1) + ", " + number_of(m, RMP_ATTR_C_CP, 0) + ", " +
           number_of(m, RMP_ATTR_SPEED_PTP, 100) + ", " + number_of(m, RMP_ATTR_ACC_PTP, 100) +
           ", " + number_of(m, RMP_ATTR_C_PTP, 0) + ", 0}";
  }
  bool is_local(std::uint32_t e) const {
    const auto& x = expression(e);
    if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE && x.constant == RMP_NONE) {
      const auto& s = symbol(x.symbol);
      if (s.kind == RMP_SYMBOL_PARAMETER) return true;
      if (s.kind == RMP_SYMBOL_VARIABLE && s.routine != RMP_NONE && s.routine != 0) return true;
    }
    for (const std::uint32_t o : links(x.first, x.count))
      if (is_local(o)) return true;
    return false;
  }
  std::string until(const Motion& m) {
    if (m.until == RMP_NONE) return "NULL";
    if ((caps_.features & kPostUntil) == 0) {
      cannot("motions that end on a condition", "The library has none.");
      return "NULL";
    }
    if (is_local(m.until)) {
      fail("C evaluates this condition outside the routine, where its local variables are unknown",
           "Use variables of the program.");
      return "NULL";
    }
    const std::string f = names_.unique("until");
    conditions_.add("static int " + f + "(void) { return " + text(m.until) + "; }", &at_);
    return f;
  }
  std::string behind(const Motion& m) { return ", " + how(m) + ", " + until(m) + ");"; }
  void action(const Motion& m) {
    additional(m.targets.back());
    if (m.action == RMP_NONE) return;
    line("if (" + text(m.until) + ") " + routine_name(m.action) + "();");
  }
  /// Additional joints have their values at the end of a motion.
  void additional(const Target& t) {
    if (!writes_additional_) return;
    if (t.point) {
      if (!t.point->external.empty())
        line("rmp_additional(" + numbers(t.point->external, 1) + ");");
      return;
    }
    if (t.role != RMP_ROLE_ROBTARGET && t.role != RMP_ROLE_JOINT && t.role != RMP_ROLE_ADD_JOINT)
      return;
    const std::uint32_t op = expression(t.expression).op;
    if (op != RMP_EXPR_SYMBOL && op != RMP_EXPR_INDEX && op != RMP_EXPR_FIELD) {
      cannot("additional joints of a target computed in place", "Assign it to a variable.");
      return;
    }
    line("rmp_additional(" + place(t.expression) + ".add, RMP_MOST_JOINTS);");
  }
  /// In the base, whatever frame it is given in.
  std::string pose(const Motion& m, const Target& t) {
    std::string p;
    switch (t.role) {
      case RMP_ROLE_POSE: p = text(t.expression); break;
      case RMP_ROLE_ROBTARGET: {
        no_turns(t.point);
        if (t.point && t.point->has_pose)
          p = "rmp_placed(" + at(t.point->pose) + ", " + turned(t.point->pose) + ")";
        else p = place(t.expression) + ".pse";
        break;
      }
      case RMP_ROLE_POSITION: p = "rmp_here(" + text(t.expression) + ")"; break;
      default:
        cannot("targets of " + type_name(expression(t.expression).type) + " for this motion",
               "Give a POSE.");
        return "rmp_here(rmp_at(0, 0, 0))";
    }
    if (!m[RMP_ATTR_FRAME].given) return p;
    return "rmp_composed(" + text(m[RMP_ATTR_FRAME].expression) + ", " + p + ")";
  }
  void increment(const Motion& m, const char* function) {
    const Target& t = m.targets[0];
    std::string by;
    if (t.role == RMP_ROLE_POSITION) by = text(t.expression);
    else if (t.role == RMP_ROLE_POSE && t.point) {
      const auto o = post::orientation(t.point->pose.R, post::Orientation::rotation_vector);
      if (std::hypot(o[0], o[1], o[2]) > 1e-9)
        cannot("increments that turn the tool", "Move to the target pose itself.");
      by = at(t.point->pose);
    } else {
      cannot("increments of this kind", "Give a POSITION.");
      return;
    }
    if (m[RMP_ATTR_FRAME].given) {
      // The frame turns the step.
      const PostPoint* f = point(m[RMP_ATTR_FRAME].expression);
      if (!f || !f->has_pose) {
        cannot("increments in a computed frame", "Give them in the base.");
        return;
      }
      Pose turn;
      turn.R = f->pose.R;
      if (t.point && t.point->has_pose) by = at(post::product(turn, t.point->pose));
      else if (!post::same_place(turn, Pose{}))
        by = "rmp_rotated(" + turned(turn) + ", " + by + ")";
    }
    line(std::string(function) + "(" + by + behind(m));
  }
  /// The PA-10's library goes to poses on straight lines only.
  bool moves_straight_to_poses() const { return (caps_.features & kPostUntil) == 0; }
  void goes_straight() {
    warn(
        "this PTP becomes a straight line: the PA-10 library moves straight to poses, and the "
        "joint values of this target are unknown",
        "Name the robot (program.post{robot = ...}), or give MAIN_JOINT.");
  }
  void ptp(const Motion& m) override {
    const Target& t = m.targets[0];
    const bool is_joints = t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
    const bool is_straight = (m.incremental || !is_joints) && moves_straight_to_poses();
    const bool has_joints = is_straight && !m.incremental && t.point && !t.point->q.empty();
    if (is_straight && !has_joints) goes_straight();
    if (m.incremental) increment(m, "rmp_ptp_by");
    else if (is_joints) line("rmp_ptp_joints(" + text(t.expression) + behind(m));
    else if (has_joints)
      line("rmp_ptp_to(rmp_joints(" + numbers(t.point->q, post::kDegree) + ", " +
           numbers(t.point->external, 1) + "), " + pose(m, t) + behind(m));
    else line("rmp_ptp_pose(" + pose(m, t) + behind(m));
    action(m);
  }
  void lin(const Motion& m) override {
    if (m.incremental) increment(m, "rmp_lin_by");
    else line("rmp_lin(" + pose(m, m.targets[0]) + behind(m));
    action(m);
  }
  void circle(const Motion& m) override {
    if (m.incremental) return cannot("incremental circles", "Give both points in the base frame.");
    if (m.targets.size() != 2) return fail("a circle has two targets");
    line("rmp_circle(" + pose(m, m.targets[0]) + ", " + pose(m, m.targets[1]) + behind(m));
    action(m);
  }

  const char* runtime_name_;
  const char* runtime_;
  post::File types_, globals_, heads_, conditions_, body_;
  std::vector<std::uint32_t> init_;
  std::vector<std::string> loops_;
  bool writes_additional_ = false;  ///< some target has additional joints
  bool needs_math_ = false, needs_abs_ = false, told_speed_ = false;
  std::string write_real_;  ///< name of the function that prints a REAL; "" = no message has one
};

}  // namespace

const PostCapabilities& C99::capabilities() const { return c_capabilities(); }
Result<void> C99::write(const PostTask& task, const Params&, PostOutput& output,
                        Progress& progress) const {
  return CWriter(task, output, c_capabilities(), progress, "rmp_robomosp.c", c_runtime::kRobomosp)
      .run();
}

const PostCapabilities& Pa10::capabilities() const { return pa10_capabilities(); }
Result<void> Pa10::write(const PostTask& task, const Params&, PostOutput& output,
                         Progress& progress) const {
  return CWriter(task, output, pa10_capabilities(), progress, "rmp_pa10.c", c_runtime::kPa10).run();
}

}  // namespace robomosp::posts

// SPDX-License-Identifier: Apache-2.0
#include "krl.h"

#include <cmath>
#include <string>

#include <robomosp/sdk/post_passing.h>

#include "../common/declared.h"

namespace robomosp::posts {
namespace {

using post::Helper;
using post::Motion;
using post::Operator;
using post::Signal;
using post::Target;
using post::Text;

// Comparisons bind loosest in KRL, NOT strongest but for the geometric operator. Programs are also
// written as if they bound tighter than AND, and read so: what is on either side of one stands in
// parentheses where that would be another thing.
constexpr Operator kOperators[] = {{RMP_EXPR_EQUAL, "==", 41, Operator::infix, 10},
                                   {RMP_EXPR_NOT_EQUAL, "<>", 41, Operator::infix, 10},
                                   {RMP_EXPR_LESS, "<", 41, Operator::infix, 10},
                                   {RMP_EXPR_LESS_EQUAL, "<=", 41, Operator::infix, 10},
                                   {RMP_EXPR_GREATER, ">", 41, Operator::infix, 10},
                                   {RMP_EXPR_GREATER_EQUAL, ">=", 41, Operator::infix, 10},
                                   {RMP_EXPR_OR, " OR ", 20},
                                   {RMP_EXPR_EXOR, " EXOR ", 30},
                                   {RMP_EXPR_AND, " AND ", 40},
                                   {RMP_EXPR_ADD, "+", 50},
                                   {RMP_EXPR_SUBTRACT, "-", 50},
                                   {RMP_EXPR_MULTIPLY, "*", 60},
                                   {RMP_EXPR_DIVIDE, "/", 60},
                                   {RMP_EXPR_DIV, "/", 60},
                                   {RMP_EXPR_MOD, "RMP_MOD", 100, Operator::call},
                                   {RMP_EXPR_NOT, "NOT ", 70, Operator::prefix},
                                   {RMP_EXPR_NEGATE, "-", 45, Operator::prefix_group}};
// INT / INT is whole in KRL.
constexpr Operator kDivideWhole{RMP_EXPR_DIVIDE, "*1.0/", 60};
constexpr int kFrameBinding = 80;

constexpr Helper kHelpers[] = {{"RMP_XYZ",
                                "DEFFCT FRAME RMP_XYZ(X:IN,Y:IN,Z:IN)\n"
                                "  DECL REAL X,Y,Z\n"
                                "  DECL FRAME F\n"
                                "  F={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
                                "  F.X=X\n"
                                "  F.Y=Y\n"
                                "  F.Z=Z\n"
                                "  RETURN F\n"
                                "ENDFCT\n"},
                               {"RMP_ABC",
                                "DEFFCT FRAME RMP_ABC(A:IN,B:IN,C:IN)\n"
                                "  DECL REAL A,B,C\n"
                                "  DECL FRAME F\n"
                                "  F={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
                                "  F.A=A\n"
                                "  F.B=B\n"
                                "  F.C=C\n"
                                "  RETURN F\n"
                                "ENDFCT\n"},
                               {"RMP_POS",
                                "DEFFCT FRAME RMP_POS(P:IN)\n"
                                "  DECL FRAME P\n"
                                "  P.A=0.0\n"
                                "  P.B=0.0\n"
                                "  P.C=0.0\n"
                                "  RETURN P\n"
                                "ENDFCT\n"},
                               {"RMP_ORI",
                                "DEFFCT FRAME RMP_ORI(P:IN)\n"
                                "  DECL FRAME P\n"
                                "  P.X=0.0\n"
                                "  P.Y=0.0\n"
                                "  P.Z=0.0\n"
                                "  RETURN P\n"
                                "ENDFCT\n"},
                               {"RMP_PSE",
                                "DEFFCT FRAME RMP_PSE(P:IN)\n"
                                "  DECL E6POS P\n"
                                "  DECL FRAME F\n"
                                "  F={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
                                "  F.X=P.X\n"
                                "  F.Y=P.Y\n"
                                "  F.Z=P.Z\n"
                                "  F.A=P.A\n"
                                "  F.B=P.B\n"
                                "  F.C=P.C\n"
                                "  RETURN F\n"
                                "ENDFCT\n"},
                               {"RMP_MOD",
                                "DEFFCT INT RMP_MOD(A:IN,B:IN)\n"
                                "  DECL INT A,B\n"
                                "  RETURN A-A/B*B\n"
                                "ENDFCT\n"},
                               {"RMP_TRUNC",
                                "DEFFCT INT RMP_TRUNC(X:IN)\n"
                                "  DECL REAL X\n"
                                "  DECL INT I\n"
                                "  I=X\n"
                                "  IF (X>=0.0) AND (I>X) THEN\n"
                                "    I=I-1\n"
                                "  ENDIF\n"
                                "  IF (X<0.0) AND (I<X) THEN\n"
                                "    I=I+1\n"
                                "  ENDIF\n"
                                "  RETURN I\n"
                                "ENDFCT\n"},
                               {"RMP_ROUND",
                                "DEFFCT INT RMP_ROUND(X:IN)\n"
                                "  DECL REAL X\n"
                                "  DECL INT I\n"
                                "  IF X>=0.0 THEN\n"
                                "    I=RMP_TRUNC(X+0.5)\n"
                                "  ELSE\n"
                                "    I=RMP_TRUNC(X-0.5)\n"
                                "  ENDIF\n"
                                "  RETURN I\n"
                                "ENDFCT\n"}};

const PostCapabilities& capabilities_of() {
  static const PostCapabilities all = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
                 kPostRecursion | kPostLocals | kPostIntegers | kPostReals | kPostBooleans |
                 kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostJointValues |
                 kPostFunctionsOfMath | kPostIf | kPostWhile | kPostRepeat | kPostLoop | kPostExit |
                 kPostFor | kPostForStep | kPostCase | kPostGoto | kPostReturn | kPostInterrupts |
                 kPostWaitFor | kPostWaitTimeout | kPostUntil | kPostVariableTargets |
                 kPostVariableAttributes | kPostPause | kPostOutputsAreRead | kPostTools |
                 kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostLinJoints | kPostCircle |
                kPostPtpIncrement | kPostLinIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::distance;
    c.speed = PostSpeed::m_per_s;
    c.external_axes = 6;
    c.max_name = 24;
    c.name_case = PostCase::upper;
    c.reserved =
        "AND ANIN ANOUT BAS BOOL BRAKE B_AND B_EXOR B_NOT B_OR CASE CAST_FROM CAST_TO CCLOSE CHAR "
        "CHANNEL CIRC CIRC_REL CONFIRM CONST CONTINUE COPEN CREAD CWRITE DECL DEF DEFAULT DEFDAT "
        "DEFFCT DELAY DIGIN DISTANCE DO E6AXIS E6POS ELSE END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP "
        "ENDSWITCH ENDWHILE ENUM EXIT EXT EXTFCT EXTFCTP EXTP EXOR FALSE FOR FRAME GLOBAL GOTO "
        "HALT IF IMPORT INT INTERRUPT IS LIN LIN_REL LOOP MAXIMUM MINIMUM NOT OFF ON OR PATH "
        "POS AXIS PRIO PTP PTP_REL PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC SIGNAL SLIN "
        "SPL SPLINE SPTP SREAD STEP STRUC SWITCH SWRITE THEN TO TRIGGER TRUE UNTIL WAIT WHEN WHILE "
        "ABS ACOS ATAN2 COS SIN SQRT TAN X Y Z A B C S T E1 E2 E3 E4 E5 E6 "
        "RMP_XYZ RMP_ABC RMP_POS RMP_ORI RMP_PSE RMP_MOD RMP_TRUNC RMP_ROUND RMP_T RMP_V C_PTP "
        "C_DIS C_VEL C_ORI";
    c.extensions = "src,dat";
    c.title = "KUKA KRL";
    return c;
  }();
  return all;
}

class KrlWriter final : public post::DeclaredWriter {
 public:
  KrlWriter(const PostTask& task, PostOutput& output, Progress& progress)
      : DeclaredWriter(task, output, capabilities_of(), progress,
                       {'[', ']', "=", "", "RECORD_TYPE", 50}) {}

 private:
  // ---- program ----
  void begin() override {
    out_ = &body_;
    const std::string name = routine_name(0);
    dat_.add("&ACCESS RVP");
    dat_.add("&REL 1");
    dat_.add("DEFDAT " + name + " PUBLIC");
    structures();
    for (std::uint32_t s = 0; s < c_.symbols.count; ++s)
      if (is_used(s)) group_signal(s);
    common_tool_ = common_place(RMP_ATTR_TOOL);
    common_base_ = common_place(RMP_ATTR_FRAME);
    other_tool_ = is_anywhere(RMP_ATTR_TOOL);
    other_base_ = is_anywhere(RMP_ATTR_FRAME);
    changed_acc_ = is_anywhere(RMP_ATTR_ACC);
  }
  void structures() {
    // Made of earlier types, so the order of their rows is one of declaration.
    for (const std::uint32_t t : records_in_use()) {
      const auto& x = type(t);
      at_ = x.span;
      std::string s = "STRUC " + struct_name(t) + " ";
      for (std::uint32_t k = 0; k < x.field_count; ++k)
        s += (k ? "," : "") + krl_type(field_row(x.first_field + k).type) + " " + field_name(t, k) +
             dimensions(field_row(x.first_field + k).type);
      dat_.add(s, &at_);
    }
  }
  void group_signal(std::uint32_t s) {
    const auto& x = symbol(s);
    if ((x.kind != RMP_SYMBOL_INPUT && x.kind != RMP_SYMBOL_OUTPUT) || x.type != RMP_TYPE_INT)
      return;
    const Signal g = signal(s);
    at_ = x.span;
    const std::string word = g.is_output ? "$OUT[" : "$IN[";
    dat_.add("SIGNAL " + name(s) + " " + word + std::to_string(g.number) + "] TO " + word +
                 std::to_string(g.number + g.width - 1) + "]",
             &at_);
    groups_.emplace(std::pair(g.is_output, g.number), name(s));
  }
  void routine_begin(std::uint32_t r) override {
    const auto& x = routine(r);
    init_.clear();
    if (r != 0) body_.add("");
    if (r == 0) {
      body_.add("&ACCESS RVP");
      body_.add("&REL 1");
      body_.add("DEF " + routine_name(0) + "( )", &at_);
      body_.in();
      return;
    }
    if (x.kind == RMP_ROUTINE_PROCESS) cannot("parallel processes", "Use the submit interpreter.");
    std::string head = (x.kind == RMP_ROUTINE_FUNCTION ? "DEFFCT " + krl_type(x.result) + " "
                                                       : std::string("DEF ")) +
                       routine_name(r) + "(";
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const std::uint32_t p = x.first_parameter + k;
      const bool is_array = type(symbol(p).type).kind == RMP_TYPE_ARRAY;
      head += (k ? "," : "") + name(p) + (is_array ? "[]" : "") +
              (symbol(p).mode == RMP_MODE_IN && !is_array ? ":IN" : ":OUT");
    }
    open(head + (x.parameter_count ? ")" : " )"));
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const std::uint32_t p = x.first_parameter + k;
      const bool is_array = type(symbol(p).type).kind == RMP_TYPE_ARRAY;
      line("DECL " + krl_type(symbol(p).type) + " " + name(p) + (is_array ? "[]" : ""));
    }
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = symbol(s).span;
    if (symbol(s).kind == RMP_SYMBOL_ROBOT) {
      cannot("descriptions of robots", "Leave the robot to the profile.");
      return;
    }
    const std::string text =
        "DECL " + krl_type(symbol(s).type) + " " + name(s) + dimensions(symbol(s).type);
    if (r == 0) dat_.add(text, &at_);
    else line(text);
    init_.push_back(s);
  }
  void routine_code(std::uint32_t r) override {
    if (r == 0) start();
    set_initial(r);
  }
  void start() {
    line("BAS(#INITMOV,0)");
    line("$ADVANCE=" + std::to_string(static_cast<int>(number_option("advance", 3))));
    line("$ACC.CP=" + real_literal(number_option("acc_cp", 2.3)));
    if (common_tool_) line(krl_place(*common_tool_, profile_.tools, "#TOOL", "$TOOL"));
    else tool_base(profile_.tool, profile_.tools, "#TOOL", "$TOOL");
    line(common_base_ ? krl_place(*common_base_, profile_.frames, "#BASE", "$BASE")
                      : std::string("$BASE=$NULLFRAME"));
    if (!profile_.prologue.empty()) body_.add_lines(profile_.prologue);
    std::uint32_t number = 21;
    for (std::uint32_t r = 1; r < c_.routines.count; ++r) {
      if (routine(r).kind != RMP_ROUTINE_INTERRUPT || !is_reached(r)) continue;
      at_ = routine(r).span;
      if (number == 40) number = 81;  // 40 to 80 are the system's
      if (number > 128) cannot("more than 67 interrupts");
      interrupts_[r] = number;
      line("GLOBAL INTERRUPT DECL " + std::to_string(number++) + " WHEN " +
           text(routine(r).condition) + " DO " + routine_name(r) + "( )");
    }
  }
  /// Sets a tool or base: by its number where the profile has it, else by its place.
  std::string krl_place(const Pose& pose, std::span<const PostPlace> places, const char* word,
                        const char* variable) {
    for (const PostPlace& p : places)
      if (p.number > 0 && post::same_place(p.pose, pose))
        return std::string("BAS(") + word + "," + std::to_string(p.number) + ")";
    return std::string(variable) + "=" + frame(pose);
  }
  void tool_base(std::int32_t i, std::span<const PostPlace> places, const char* word,
                 const char* variable) {
    if (i < 0 || static_cast<std::size_t>(i) >= places.size()) {
      line(std::string(variable) + "=$NULLFRAME");
      return;
    }
    const PostPlace& p = places[static_cast<std::size_t>(i)];
    if (p.number > 0) line(std::string("BAS(") + word + "," + std::to_string(p.number) + ")");
    else line(std::string(variable) + "=" + frame(p.pose));
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0 && !profile_.epilogue.empty()) body_.add_lines(profile_.epilogue);
    close(routine(r).kind == RMP_ROUTINE_FUNCTION ? "ENDFCT" : "END");
  }
  void finish() override {
    for (const post::File& f : extra_) {
      body_.add("");
      body_.append(f);
    }
    static constexpr std::pair<const char*, const char*> kNeeds[] = {{"RMP_ROUND", "RMP_TRUNC"}};
    const std::string used = joined(body_);
    add_helpers(used, kHelpers, kNeeds, body_);
    if (used.find("RMP_T") != std::string::npos) dat_.add("DECL FRAME RMP_T");
    dat_.append(points_);
    dat_.add("ENDDAT");
    const std::string name = routine_name(0);
    body_.give(output_, name + ".src", caps_.crlf);
    dat_.give(output_, name + ".dat", caps_.crlf);
  }

  // ---- types and values ----
  std::string krl_type(std::uint32_t t) {
    const auto& x = type(t);
    switch (x.kind) {
      case RMP_TYPE_VOID: return "";
      case RMP_TYPE_INT: return "INT";
      case RMP_TYPE_REAL: return "REAL";
      case RMP_TYPE_CHAR: return "CHAR";
      case RMP_TYPE_BOOL: return "BOOL";
      case RMP_TYPE_ARRAY: return krl_type(x.element);
      case RMP_TYPE_RECORD: break;
      default: cannot("variables of " + type_name(t)); return "INT";
    }
    switch (x.role) {
      case RMP_ROLE_POSITION:
      case RMP_ROLE_ORIENTATION:
      case RMP_ROLE_POSE: return "FRAME";
      case RMP_ROLE_ROBTARGET: return "E6POS";
      case RMP_ROLE_JOINT:
      case RMP_ROLE_MAIN_JOINT:
      case RMP_ROLE_ADD_JOINT: return "E6AXIS";
      case RMP_ROLE_ROBOT: cannot("descriptions of robots"); return "INT";
      default: return struct_name(t);
    }
  }
  void begins_with(const std::string&, std::uint32_t) override {
    fail("an initial value of an array must list its elements", "Write them as [a, b, c].");
  }
  std::string first_value(std::uint32_t value) override {
    const PostPoint* p = point(value);
    return p ? aggregate(*p) : text(value);
  }
  std::string zero(std::uint32_t t) override {
    const std::string k = krl_type(t);
    if (k == "FRAME") return "{X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}";
    if (k == "E6POS")
      return "{X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 2,T 0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 "
             "0.0}";
    if (k == "E6AXIS")
      return "{A1 0.0,A2 0.0,A3 0.0,A4 0.0,A5 0.0,A6 0.0,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 "
             "0.0}";
    if (k == "REAL") return "0.0";
    if (k == "BOOL") return "FALSE";
    if (k == "CHAR") return "\" \"";
    return "0";
  }
  std::string frame(const Pose& pose) {
    const auto p = post::placed(pose, post::Orientation::zyx);
    for (const double x : p.mm)
      if (std::isfinite(x) && std::fabs(x) > 1e9)
        fail("a position here is beyond the controller's range", "Check what it is computed from.");
    static constexpr const char* kWords[] = {"{X ", ",Y ", ",Z ", ",A ", ",B ", ",C "};
    std::string s;
    for (std::size_t i = 0; i < 3; ++i) s += kWords[i] + length(p.mm[i]);
    for (std::size_t i = 0; i < 3; ++i) s += kWords[3 + i] + angle(p.ori[i]);
    return s + "}";
  }
  std::string externals(const PostPoint& p) {
    const auto e = external_axes(p);
    std::string s;
    for (std::size_t i = 0; i < e.size() && i < 6; ++i)
      s += ",E" + std::to_string(i + 1) + " " + length(e[i]);
    if (e.size() > 6) fail("KUKA KRL has six external axes, and the profile has more");
    return s;
  }
  /// S: bit 0 the wrist is behind axis 1, bit 1 A3 is at or above the angle at which the arm is
  /// stretched (0 only where axes 3 and 4 meet), bit 2 A5 is negative. The first two are geometry,
  /// so that they need no axes; the option a3_limit gives the angle otherwise.
  std::uint32_t status_bits(const PostPoint& p) {
    std::uint32_t s = p.status & kPostShoulderBehind;
    if (!p.q.empty()) axes_are_needed();
    const auto a = has_axes() && p.q.size() >= 6 ? axes(p) : std::vector<double>{};
    if (a.size() >= 6 && !option("a3_limit").empty())
      s |= a[2] >= number_option("a3_limit", 0) ? 2U : 0U;
    else if (!post::wrist_behind_lower_arm(p.status)) s |= 2U;
    return s | (a.size() >= 6 ? (a[4] < 0 ? 4U : 0U) : p.status & kPostWristFlipped);
  }
  /// A point with all that is known of it.
  std::string aggregate(const PostPoint& p) {
    if (p.role == RMP_ROLE_JOINT || p.role == RMP_ROLE_MAIN_JOINT) {
      const auto a = axes(p);
      if (a.size() > 6) {
        fail("KUKA KRL has six axes, and this target has " + std::to_string(a.size()),
             "Give the profile's axes; the others can be external ones.");
        return "{A1 0.0}";
      }
      std::string s = "{";
      for (std::size_t i = 0; i < a.size(); ++i)
        s += (i ? ",A" : "A") + std::to_string(i + 1) + " " + angle(a[i]);
      return s + externals(p) + "}";
    }
    if (p.role == RMP_ROLE_ADD_JOINT) {
      const std::string s = externals(p);
      if (s.empty() && has_additional_joints())
        fail("the profile has no external axes", "Give it axes with is_external = true.");
      return "{" + (s.empty() ? "E1 0.0" : s.substr(1)) + "}";
    }
    if (p.role == RMP_ROLE_POSITION && p.motion != RMP_NONE)
      return "{X " + length(p.pose.p[0] * 1000) + ",Y " + length(p.pose.p[1] * 1000) + ",Z " +
             length(p.pose.p[2] * 1000) + "}";
    std::string s = frame(p.pose);
    if (p.motion == RMP_NONE && p.role != RMP_ROLE_ROBTARGET) return s;
    s.pop_back();
    if (p.status_known || p.has_status) s += ",S " + std::to_string(status_bits(p));
    if (p.q.size() <= 6) s += turn_bits(p);
    return s + externals(p) + "}";
  }
  /// T: bit i is set where axis i + 1 is negative.
  std::string turn_bits(const PostPoint& p) {
    std::size_t n = p.q.size();
    if (!p.q.empty()) {
      const auto a = axes(p);
      n = a.size();
      for (std::size_t i = 0; i < n; ++i)
        if (std::fabs(a[i]) >= 360)
          warn("axis " + std::to_string(i + 1) + " would be at " + post::trimmed(a[i], 3) +
                   " degrees, and T gives its sign only",
               "Move to joints (MAIN_JOINT) where the turn matters.");
    } else if (p.turns_first == 0) {
      n = p.turns.size();
    }
    unsigned turns = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const auto t = axis_turn(p, i, 0);
      if (!t) {
        n = 0;
        break;
      }
      turns |= (*t < 0 ? 1U : 0U) << i;
    }
    if (n > 0) return ",T " + std::to_string(turns);
    for (const std::int32_t t : p.turns)
      if (t != 0) {
        warn(
            "TURNS of this target are not written: T holds the sign of each axis, which is unknown",
            "Name the robot: program.post{robot = ...}.");
        break;
      }
    return "";
  }
  /// The name of a point in the .dat.
  std::string point_name(const PostPoint& p, std::uint32_t e) {
    const bool is_joints =
        p.role == RMP_ROLE_JOINT || p.role == RMP_ROLE_MAIN_JOINT || p.role == RMP_ROLE_ADD_JOINT;
    const bool is_frame = p.motion == RMP_NONE || p.role == RMP_ROLE_POSITION;
    const std::string kind = is_joints ? "E6AXIS" : is_frame ? "FRAME" : "E6POS";
    const std::string value = aggregate(p);
    const auto [number, is_new] = table_.add(kind + value);
    if (!is_new) return point_names_[number];
    // Named after the variable, where the target is one.
    const auto& x = expression(e);
    const std::string wish = x.op == RMP_EXPR_SYMBOL ? "X" + std::string(symbol(x.symbol).name)
                                                     : "XP" + std::to_string(number + 1);
    point_names_.push_back(names_.unique(wish));
    points_.add("DECL " + kind + " " + point_names_.back() + "=" + value, &at_);
    return point_names_.back();
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override { return kOperators; }
  const Operator* operation(const rmp_code_expression& e) override {
    if (e.op == RMP_EXPR_DIVIDE) {
      const auto of = links(e.first, e.count);
      const auto& a = expression(of[0]);
      if (a.op == RMP_EXPR_CONVERT && a.constant == RMP_NONE) return &kDivideWhole;
    }
    if ((e.op == RMP_EXPR_ADD || e.op == RMP_EXPR_SUBTRACT) && role(e.type) == RMP_ROLE_POSITION) {
      cannot("sums of positions", "Add X, Y and Z, or use @.");
    }
    return Writer::operation(e);
  }
  std::string real_literal(double v) override { return post::shortest(v); }
  Text string_literal(std::string_view s) override {
    std::string out = "\"";
    for (const char c : s) {
      if (c == '"' || static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126)
        fail("this text has characters that KUKA KRL does not have", "Use letters of ASCII.");
      out += c;
    }
    return {out + "\""};
  }
  Text input(const Signal& s) override { return signal_text(s); }
  Text output(const Signal& s) override { return signal_text(s); }
  Text signal_text(const Signal& s) {
    const std::string t = place_of(s);
    if (s.inverted && s.type == RMP_TYPE_BOOL) return {"NOT " + t, 70};
    return {t};
  }
  std::string place_of(const Signal& s) {
    if (s.type == RMP_TYPE_INT) {
      const auto it = groups_.find({s.is_output, s.number});
      if (it != groups_.end()) return it->second;
    }
    const std::string n = "[" + std::to_string(s.number) + "]";
    if (s.type == RMP_TYPE_REAL) return (s.is_output ? "$ANOUT" : "$ANIN") + n;
    return (s.is_output ? "$OUT" : "$IN") + n;
  }
  /// Where the parts of a geometric value stand: target.PSE.POS is the target.
  std::string place(std::uint32_t e) override {
    const auto& x = expression(e);
    if (x.op == RMP_EXPR_FIELD) {
      const std::uint32_t object = links(x.first, x.count)[0];
      const std::uint32_t of = role(expression(object).type);
      if (of == RMP_ROLE_POSE || (of == RMP_ROLE_ROBTARGET && x.symbol == 0)) return place(object);
      if (of == RMP_ROLE_JOINT) return place(object);
      return place(object) + "." + part_name(expression(object).type, x.symbol);
    }
    if (x.op == RMP_EXPR_SYMBOL) return variable(x.symbol).text;
    if (x.op == RMP_EXPR_INDEX) return indexed(e);
    return text(e);
  }
  std::string part_name(std::uint32_t t, std::uint32_t number) {
    static constexpr const char* kXyz[] = {"X", "Y", "Z"};
    switch (role(t)) {
      case RMP_ROLE_POSITION:
        if (number < 3) return kXyz[number];
        break;
      case RMP_ROLE_MAIN_JOINT: return "A" + std::to_string(number + 1);
      case RMP_ROLE_ADD_JOINT: return "E" + std::to_string(number + 1);
      case RMP_ROLE_ROBTARGET: cannot("such part of a target", "Only its PSE exists."); return "S";
      case RMP_ROLE_ORIENTATION:
        cannot("quaternions", "Use ANGLEX, ANGLEY and ANGLEZ of the mode 'ZYX' instead.");
        return "A";
      default: break;
    }
    return field_name(t, number);
  }
  Text field(std::uint32_t object, std::uint32_t number, const rmp_code_expression& x) override {
    const std::uint32_t of = role(expression(object).type);
    if (of == RMP_ROLE_POSE) {
      return {std::string(number == 0 ? "RMP_POS(" : "RMP_ORI(") + text(object) + ")"};
    }
    if (of == RMP_ROLE_ROBTARGET && number == 0) return {"RMP_PSE(" + place(object) + ")"};
    const auto& o = expression(object);
    if (o.op == RMP_EXPR_CALL || o.op == RMP_EXPR_MAKE || o.op == RMP_EXPR_COMPOSE ||
        o.op == RMP_EXPR_INTRINSIC) {
      fail("KUKA KRL can access parts of variables only", "Assign the value to a variable first.");
      return {"0"};
    }
    return {place(row_of(x))};
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression& x) override {
    return Text{point_name(p, row_of(x))};
  }
  Text make(std::span<const std::uint32_t> of, const rmp_code_expression& x) override {
    switch (role(x.type)) {
      case RMP_ROLE_POSITION: return {"RMP_XYZ(" + list(of, ",") + ")"};
      case RMP_ROLE_POSE:
        return {within(expr(of[0]), kFrameBinding) + ":" + within(expr(of[1]), kFrameBinding),
                kFrameBinding};
      default: return Writer::make(of, x);
    }
  }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression&) override {
    return {within(expr(a), kFrameBinding) + ":" + within(expr(b), kFrameBinding), kFrameBinding};
  }
  Text intrinsic(std::string_view name, std::span<const std::uint32_t> of,
                 const rmp_code_expression& x) override {
    const auto turn = [&](std::size_t axis, std::size_t argument) {
      const std::string v = text(of[argument]);
      return std::string("RMP_ABC(") + (axis == 2 ? v : "0.0") + "," + (axis == 1 ? v : "0.0") +
             "," + (axis == 0 ? v : "0.0") + ")";
    };
    const auto three = [&](std::size_t a, std::size_t b, std::size_t c) {
      return Text{turn(a, 0) + ":" + turn(b, 1) + ":" + turn(c, 2), kFrameBinding};
    };
    if (name == "ORIZYX") return {"RMP_ABC(" + list(of, ",") + ")"};
    if (name == "ORIRS")
      return {"RMP_ABC(" + text(of[2]) + "," + text(of[1]) + "," + text(of[0]) + ")"};
    if (name == "ORIXYZ") return three(0, 1, 2);
    if (name == "ORIYXZ") return three(1, 0, 2);
    if (name == "ORIZYZ2") return three(2, 1, 2);
    if (name == "ORIMULT") return compose(of[0], of[1], x);
    if (name == "SIN" || name == "COS" || name == "TAN" || name == "ACOS" || name == "SQRT" ||
        name == "ABS" || name == "ATAN2")
      return {std::string(name) + "(" + list(of, ",") + ")"};
    if (name == "ASIN") return {"90.0-ACOS(" + list(of) + ")", 50};
    if (name == "ATAN") return {"ATAN2(" + list(of) + ",1.0)"};
    if (name == "FLOAT") return expr(of[0]);
    if (name == "TRUNC") return {"RMP_TRUNC(" + list(of) + ")"};
    if (name == "ROUND") return {"RMP_ROUND(" + list(of) + ")"};
    return Writer::intrinsic(name, of, x);
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> of) override {
    return {routine_name(r) + "(" + arguments(of) + ")"};
  }
  std::string arguments(std::span<const std::uint32_t> of) {
    std::string out;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const bool is_array = type(expression(of[k]).type).kind == RMP_TYPE_ARRAY;
      out += (k ? "," : "") + (is_array ? place(of[k]) + "[]" : text(of[k]));
    }
    return out;
  }

  // ---- statements ----
  void assign(std::uint32_t to, std::uint32_t value) override {
    const auto& x = expression(to);
    const std::uint32_t of = x.op == RMP_EXPR_FIELD
                                 ? role(expression(links(x.first, x.count)[0]).type)
                                 : static_cast<std::uint32_t>(RMP_ROLE_NONE);
    if (of == RMP_ROLE_POSE || (of == RMP_ROLE_ROBTARGET && x.symbol == 0)) {
      const std::string target = place(to);
      line("RMP_T=" + text(value));
      const bool pos = of == RMP_ROLE_ROBTARGET || x.symbol == 0;
      const bool ori = of == RMP_ROLE_ROBTARGET || x.symbol == 1;
      for (const char* k : {"X", "Y", "Z", "A", "B", "C"})
        if ((k[0] >= 'X' && pos) || (k[0] < 'X' && ori)) line(target + "." + k + "=RMP_T." + k);
      return;
    }
    if (type(x.type).kind == RMP_TYPE_ARRAY ||
        (expression(value).op == RMP_EXPR_MAKE && role(x.type) == RMP_ROLE_NONE)) {
      if (expression(value).op != RMP_EXPR_MAKE) {
        cannot("assignments of arrays", "Assign its elements in a loop.");
        return;
      }
      initial(place(to), x.type, value);
      return;
    }
    line(place(to) + "=" + text(value));
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    Text v = expr(value);
    if (s.inverted && s.type == RMP_TYPE_BOOL) v = {"NOT " + within(v, 70), 70};
    line(place_of(s) + "=" + v.text);
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> of) override {
    line(routine_name(r) + "(" + (of.empty() ? " " : arguments(of)) + ")");
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    std::string said;
    for (const std::uint32_t v : values) {
      const auto& x = expression(v);
      if (x.constant != RMP_NONE && constant(x.constant).kind == RMP_CONSTANT_TEXT)
        said += std::string(constant(x.constant).text, constant(x.constant).text_size);
      else said += "<" + text(v) + ">";
    }
    for (char& c : said) {
      if (static_cast<unsigned char>(c) < 32) c = ' ';
      if (static_cast<unsigned char>(c) > 126)
        fail("this text has characters that KUKA KRL does not have", "Use letters of ASCII.");
    }
    warn("KUKA KRL cannot write texts by itself; this one becomes a comment",
         "Call a message program of the controller in its place.");
    line("; WRITE " + said);
  }
  void if_begin(std::uint32_t c) override { open("IF " + text(c) + " THEN"); }
  void else_() override { middle("ELSE"); }
  void if_end() override { close("ENDIF"); }
  void while_begin(std::uint32_t c) override { open("WHILE " + text(c)); }
  void while_end() override { close("ENDWHILE"); }
  void repeat_begin() override { open("REPEAT"); }
  void repeat_end(std::uint32_t c) override { close("UNTIL " + text(c)); }
  void loop_begin() override { open("LOOP"); }
  void loop_end() override { close("ENDLOOP"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    std::string by;
    if (step != RMP_NONE || down) {
      const double v = (step == RMP_NONE ? 1.0 : known(step).value_or(1.0)) * (down ? -1.0 : 1.0);
      by = " STEP " + post::fixed(v, 0);
    }
    open("FOR " + name(s) + "=" + text(from) + " TO " + text(to) + by);
  }
  void for_end(std::uint32_t) override { close("ENDFOR"); }
  void exit_loop() override { line("EXIT"); }
  void case_begin(std::uint32_t s) override { case_opens("SWITCH " + text(s)); }
  void case_when(std::span<const std::uint32_t> labels) override {
    arm("CASE " + list(labels, ","));
  }
  void case_default() override { arm("DEFAULT"); }
  void case_end() override { case_closes("ENDSWITCH"); }
  void go_to(std::uint32_t l) override { line("GOTO " + name(l)); }
  void label(std::uint32_t l) override { line(name(l) + ":"); }
  void return_(std::uint32_t v) override { line(v == RMP_NONE ? "RETURN" : "RETURN " + text(v)); }
  void wait_time(std::uint32_t s) override { line("WAIT SEC " + text(s)); }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    if (timeout == RMP_NONE) {
      line("WAIT FOR " + text(c));
      return;
    }
    const std::string n = "[" + std::to_string(static_cast<int>(number_option("timer", 1))) + "]";
    // A timer that runs from -t turns its flag at zero.
    const auto t = known(timeout);
    line("$TIMER" + n + "=" +
         (t ? post::fixed(-*t * 1000, 0) : "-1000.0*" + within(expr(timeout), 61)));
    line("$TIMER_STOP" + n + "=FALSE");
    const Text condition = expr(c);
    line("WAIT FOR " + within(condition, 21) + " OR $TIMER_FLAG" + n);
    line("$TIMER_STOP" + n + "=TRUE");
    const std::uint32_t told = system_symbol("R_TIMEOUT");
    if (told != RMP_NONE && is_used(told)) line(name(told) + "=NOT " + within(condition, 71));
  }
  void pause(std::uint32_t m) override {
    if (m != RMP_NONE) {
      const std::uint32_t one[] = {m};
      message(one, true);
    }
    line("HALT");
  }
  void halt() override {
    // The operator's start key would go on behind HALT.
    open("LOOP");
    line("HALT");
    close("ENDLOOP");
  }
  void interrupt(std::uint32_t op, std::uint32_t r, std::uint32_t) override {
    line(std::string("INTERRUPT ") + (op == RMP_STMT_ENABLE ? "ON " : "OFF ") +
         std::to_string(interrupts_[r]));
  }

  /// BRAKE in an interrupt's program holds the motion, which goes on behind it.
  void intrinsic_call(std::string_view name, std::span<const std::uint32_t> of) override {
    if (name != "BRAKE") return Writer::intrinsic_call(name, of);
    const bool holds = of.size() == 1 && known(of[0]) == 1.0;
    if (!holds)
      return cannot("BRAKE that ends a motion or belongs to another robot",
                    "BRAKE(1) in an INTERRUPT pauses the motion, and UNTIL ends it.");
    if (routine(in_routine_).kind != RMP_ROUTINE_INTERRUPT)
      return cannot("BRAKE outside an interrupt", "Write it in the INTERRUPT itself.");
    line("BRAKE");
  }

  // ---- motions ----
  void forget() override {
    for (auto* m :
         {&speed_, &speed_ori_, &acc_, &cdis_, &speed_ptp_, &acc_ptp_, &cptp_, &tool_, &base_})
      m->forget();
  }
  /// `text` with the number divided, or an expression of it.
  std::string scaled(const post::Attribute& a, double by) {
    if (a.known) return real_literal(*a.known * by);
    if (by == 1) return text(a.expression);
    return within(expr(a.expression), 60) + "*" + real_literal(by);
  }
  static bool is_set(const post::Attribute& a) { return a.known || a.expression != RMP_NONE; }
  /// What is computed may have another value the next time.
  void set(post::Modal<std::string>& modal, const std::string& l, bool is_known = true) {
    if (modal.changes(l)) line(l);
    if (!is_known) modal.forget();
  }
  void common(const Motion& m) {
    if (m[RMP_ATTR_TIME].given && !(m[RMP_ATTR_TIME].known && *m[RMP_ATTR_TIME].known < 0))
      cannot("motions with a given duration", "Give SPEED instead.");
    else if (!m[RMP_ATTR_TIME].known && m[RMP_ATTR_TIME].expression != RMP_NONE)
      cannot("motions with a given duration (R_MOVE_TIME)", "Give SPEED instead.");
    if (m[RMP_ATTR_WOBBLE].given && m[RMP_ATTR_WOBBLE].known != 0.0) cannot("weaving");
    if (m[RMP_ATTR_DEVICE].given && m[RMP_ATTR_DEVICE].known != 1.0) cannot("other devices");
    if (m[RMP_ATTR_ADAX_CONTROL].given && m[RMP_ATTR_ADAX_CONTROL].known != 0.0)
      cannot("control of additional axes");
    if (m[RMP_ATTR_C_SPEED].given && m[RMP_ATTR_C_SPEED].known != 100.0)
      warn("C_SPEED is not written: in KUKA KRL the controller chooses the speed of transitions",
           "Tune $APO.CVEL by hand.");
    place_attribute(m[RMP_ATTR_TOOL], tool_, "$TOOL");
    place_attribute(m[RMP_ATTR_FRAME], base_, "$BASE");
  }
  void place_attribute(const post::Attribute& a, post::Modal<std::string>& modal,
                       const char* word) {
    const bool is_tool = word[1] == 'T';
    if (is_tool ? common_tool_ : common_base_) return;
    if (!a.given) {
      if (!(is_tool ? other_tool_ : other_base_)) return;  // never another one than at the start
      const std::int32_t i = is_tool ? profile_.tool : -1;
      std::string back = "$NULLFRAME";
      if (i >= 0 && static_cast<std::size_t>(i) < profile_.tools.size()) {
        const PostPlace& p = profile_.tools[static_cast<std::size_t>(i)];
        if (p.number > 0) {
          set(modal, "BAS(#TOOL," + std::to_string(p.number) + ")");
          return;
        }
        back = frame(p.pose);
      }
      set(modal, std::string(word) + "=" + back);
      return;
    }
    const PostPoint* p = point(a.expression);
    set(modal, std::string(word) + "=" + (p ? frame(p->pose) : text(a.expression)), p != nullptr);
  }
  /// Speeds of a path; what stands behind its target.
  std::string cartesian(const Motion& m) {
    common(m);
    if (is_set(m[RMP_ATTR_SPEED]))
      set(speed_, "$VEL.CP=" + scaled(m[RMP_ATTR_SPEED], 0.001),
          m[RMP_ATTR_SPEED].known.has_value());
    if (is_set(m[RMP_ATTR_SPEED_ORI])) {
      const std::string v = scaled(m[RMP_ATTR_SPEED_ORI], 1);
      if (speed_ori_.changes(v)) {
        line("$VEL.ORI1=" + v);
        line("$VEL.ORI2=" + v);
      }
      if (!m[RMP_ATTR_SPEED_ORI].known) speed_ori_.forget();
    }
    const auto& acc = m[RMP_ATTR_ACC];
    if (is_set(acc)) {
      const double most = number_option("acc_cp", 2.3);
      const std::string v = "$ACC.CP=" + scaled(acc, most / 100);
      if (acc.given || changed_acc_ || acc.known != 100.0) {
        changed_acc_ = true;
        set(acc_, v, acc.known.has_value());
      }
    }
    const auto& c = m[RMP_ATTR_C_CP];
    if (is_set(c) && !(c.known && *c.known <= 0)) {
      set(cdis_, "$APO.CDIS=" + scaled(c, 1), c.known.has_value());
      return " C_DIS";
    }
    if (!passes(m)) return "";
    note(
        "C_PASS without C_CP is written as C_VEL: the controller blends by $APO.CVEL, and the "
        "simulated robot stops here",
        "Give C_CP.");
    return " C_VEL";
  }
  bool passes(const Motion& m) {
    const auto& p = m[RMP_ATTR_C_PASS];
    if (!p.given) return false;
    if (!p.known) cannot("a computed C_PASS");
    return p.known != 0.0;
  }
  std::string joint(const Motion& m) {
    common(m);
    if (is_set(m[RMP_ATTR_SPEED_PTP]))
      set(speed_ptp_, "BAS(#VEL_PTP," + percent(m[RMP_ATTR_SPEED_PTP]) + ")",
          m[RMP_ATTR_SPEED_PTP].known.has_value());
    if (is_set(m[RMP_ATTR_ACC_PTP]))
      set(acc_ptp_, "BAS(#ACC_PTP," + percent(m[RMP_ATTR_ACC_PTP]) + ")",
          m[RMP_ATTR_ACC_PTP].known.has_value());
    const auto& c = m[RMP_ATTR_C_PTP];
    if (is_set(c) && !(c.known && *c.known <= 0)) {
      set(cptp_, "$APO.CPTP=" + percent(c), c.known.has_value());
      return " C_PTP";
    }
    if (!passes(m)) return "";
    note(
        "C_PASS without C_PTP is written as C_PTP: the controller blends by $APO.CPTP, and the "
        "simulated robot " +
            post::at_c_pass_in_a_run(*task_.code, m),
        "Give C_PTP.");
    return " C_PTP";
  }
  std::string percent(const post::Attribute& a) {
    if (!a.known) return text(a.expression);
    if (*a.known < 0 || *a.known > 100)
      fail("a percentage is " + post::shortest(*a.known), "The range is 0 to 100.");
    if (std::floor(*a.known) != *a.known)
      warn("KUKA KRL takes whole percentages: " + post::shortest(*a.known) + " is rounded");
    return post::fixed(*a.known, 0);
  }
  std::string target(const Target& t) {
    if (t.point) return point_name(*t.point, t.expression);
    if (t.role == RMP_ROLE_ADD_JOINT || t.role == RMP_ROLE_POSITION) {
      cannot("targets of " + type_name(expression(t.expression).type) + " that are computed",
             "Give a POSE.");
      return "RMP_T";
    }
    const auto& x = expression(t.expression);
    if (x.op == RMP_EXPR_SYMBOL || x.op == RMP_EXPR_INDEX) return place(t.expression);
    if (role(x.type) != RMP_ROLE_POSE) return text(t.expression);
    line("RMP_T=" + text(t.expression));
    return "RMP_T";
  }
  void go(const Motion& m, const std::string& l) {
    if (m.until == RMP_NONE) {
      line(l);
      return;
    }
    // The condition of an interrupt and the subprogram that moves see what the .dat has only.
    bool sees_all = !uses_locals(m.until);
    for (const Target& t : m.targets) {
      // Poses that are computed go by RMP_T.
      const auto op = expression(t.expression).op;
      const bool is_copied = role(expression(t.expression).type) == RMP_ROLE_POSE &&
                             op != RMP_EXPR_SYMBOL && op != RMP_EXPR_INDEX;
      sees_all = sees_all && (t.point || is_copied || !uses_locals(t.expression));
    }
    if (!sees_all) {
      cannot("UNTIL in a routine with a condition or a target that uses its local variables",
             "Use variables of the program.");
      return;
    }
    // BRAKE and RESUME leave the subprogram that moves, up to where the interrupt was declared. An
    // interrupt comes when its condition becomes true: what is true already is no motion.
    const std::string move = names_.unique("RMP_GO"), stop = names_.unique("RMP_STOP");
    const std::string number =
        std::to_string(static_cast<int>(number_option("until_interrupt", 20)));
    line("INTERRUPT DECL " + number + " WHEN " + text(m.until) + " DO " + stop + "( )");
    line(move + "( )");
    line("INTERRUPT OFF " + number);
    if (m.action != RMP_NONE) {
      warn("the procedure after UNTIL ... DO is called only if the condition holds at the end",
           "Check that the signal stays on.");
      open("IF " + text(m.until) + " THEN");
      line(routine_name(m.action) + "( )");
      close("ENDIF");
    }
    post::File f;
    f.add("DEF " + move + "( )", &at_);
    f.in();
    f.add("INTERRUPT ON " + number, &at_);
    f.add("IF NOT (" + text(m.until) + ") THEN", &at_);
    f.in();
    f.add(l, &at_);
    f.out();
    f.add("ENDIF", &at_);
    f.add("WAIT SEC 0.0", &at_);  // no advance beyond the motion
    f.out();
    f.add("END", &at_);
    f.add("");
    f.add("DEF " + stop + "( )", &at_);
    f.in();
    f.add("BRAKE", &at_);
    f.add("RESUME", &at_);
    f.out();
    f.add("END", &at_);
    extra_.push_back(std::move(f));
    forget();
  }
  bool uses_locals(std::uint32_t first) const {
    std::vector<std::uint32_t> open{first};
    while (!open.empty()) {
      const std::uint32_t e = open.back();
      open.pop_back();
      if (e == RMP_NONE || point(e)) continue;
      const auto& x = expression(e);
      if (x.constant != RMP_NONE) continue;
      if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE) {
        const auto& s = symbol(x.symbol);
        if (s.kind == RMP_SYMBOL_PARAMETER ||
            (s.kind == RMP_SYMBOL_VARIABLE && s.routine != RMP_NONE && s.routine != 0))
          return true;
      }
      for (const std::uint32_t o : links(x.first, x.count)) open.push_back(o);
    }
    return false;
  }
  void ptp(const Motion& m) override {
    const std::string tail = joint(m);
    go(m, (m.incremental ? "PTP_REL " + increment(m) : "PTP " + target(m.targets[0])) + tail);
  }
  void lin(const Motion& m) override {
    const std::string tail = cartesian(m);
    go(m, (m.incremental ? "LIN_REL " + increment(m) : "LIN " + target(m.targets[0])) + tail);
  }
  void circle(const Motion& m) override {
    const std::string tail = cartesian(m);
    if (m.incremental) {
      cannot("incremental circles", "Give both points in the base frame.");
      return;
    }
    if (m.targets.size() != 2) return fail("a circle has two targets");
    const std::string via = target(m.targets[0]);
    if (!m.targets[0].point && !m.targets[1].point && via == "RMP_T") {
      cannot("circles through two computed poses", "Assign them to variables first.");
      return;
    }
    const std::string end = target(m.targets[1]);
    go(m, "CIRC " + via + "," + end + tail);
  }
  std::string increment(const Motion& m) {
    const PostPoint* p = m.targets[0].point;
    if (!p) {
      cannot("computed increments", "Add to a pose, and move there.");
      return "{X 0.0}";
    }
    if (p->role == RMP_ROLE_JOINT || p->role == RMP_ROLE_MAIN_JOINT) {
      axes_are_needed();
      std::string s = "{";
      std::size_t i = 0;
      const auto add = [&](double degrees) {
        s += (i ? ",A" : "A") + std::to_string(i + 1) + " " + angle(degrees);
        ++i;
      };
      for (const PostAxis& a : profile_.axes)
        if (!a.external) add(axis_value(a, p->q, task_.robot).value_or(0) - a.offset);
      if (i == 0)
        for (const double q : p->q) add(q * post::kDegree);
      return s + "}";
    }
    if (!p->has_pose || p->role == RMP_ROLE_ADD_JOINT) {
      cannot("increments of this kind");
      return "{X 0.0}";
    }
    const auto o = post::orientation(p->pose.R, post::Orientation::rotation_vector);
    if (std::hypot(o[0], o[1], o[2]) > 1e-9)
      cannot("increments that turn the tool", "Move to the target pose itself.");
    return "{X " + length(p->pose.p[0] * 1000) + ",Y " + length(p->pose.p[1] * 1000) + ",Z " +
           length(p->pose.p[2] * 1000) + "}";
  }
  post::File body_, dat_, points_;
  std::vector<post::File> extra_;
  post::Points table_;
  std::vector<std::string> point_names_;
  std::map<std::pair<bool, std::int64_t>, std::string> groups_;
  std::map<std::uint32_t, std::uint32_t> interrupts_;
  post::Modal<std::string> speed_, speed_ori_, acc_, cdis_, speed_ptp_, acc_ptp_, cptp_, tool_,
      base_;
  std::optional<Pose> common_tool_, common_base_;  ///< of all motions, set at the start
  bool changed_acc_ = false, other_tool_ = false, other_base_ = false;
};

}  // namespace

const PostCapabilities& Krl::capabilities() const { return capabilities_of(); }

Result<void> Krl::write(const PostTask& task, const Params&, PostOutput& output,
                        Progress& progress) const {
  return KrlWriter(task, output, progress).run();
}

}  // namespace robomosp::posts

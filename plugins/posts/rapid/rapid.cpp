// SPDX-License-Identifier: Apache-2.0
#include "rapid.h"

#include <algorithm>
#include <cmath>
#include <set>
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

constexpr Operator kOperators[] = {{RMP_EXPR_OR, " OR ", 10},
                                   {RMP_EXPR_EXOR, " XOR ", 10},
                                   {RMP_EXPR_AND, " AND ", 20},
                                   {RMP_EXPR_EQUAL, "=", 30},
                                   {RMP_EXPR_NOT_EQUAL, "<>", 30},
                                   {RMP_EXPR_LESS, "<", 30},
                                   {RMP_EXPR_LESS_EQUAL, "<=", 30},
                                   {RMP_EXPR_GREATER, ">", 30},
                                   {RMP_EXPR_GREATER_EQUAL, ">=", 30},
                                   {RMP_EXPR_ADD, "+", 40},
                                   {RMP_EXPR_SUBTRACT, "-", 40},
                                   {RMP_EXPR_MULTIPLY, "*", 50},
                                   {RMP_EXPR_DIVIDE, "/", 50},
                                   {RMP_EXPR_DIV, " DIV ", 50},
                                   {RMP_EXPR_MOD, " MOD ", 50},
                                   {RMP_EXPR_NOT, "NOT ", 5, Operator::prefix_group},
                                   {RMP_EXPR_NEGATE, "-", 35, Operator::prefix_group}};

constexpr Helper kHelpers[] = {{"RmpTarget",
                                "  LOCAL FUNC robtarget RmpTarget(pose p)\n"
                                "    VAR robtarget t;\n"
                                "    t:=CRobT(\\Tool:=RmpTool\\WObj:=RmpFrame);\n"
                                "    t.trans:=p.trans;\n"
                                "    t.rot:=p.rot;\n"
                                "    RETURN t;\n"
                                "  ENDFUNC\n"},
                               {"RmpPlace",
                                "  LOCAL FUNC robtarget RmpPlace(pos p)\n"
                                "    VAR robtarget t;\n"
                                "    t:=CRobT(\\Tool:=RmpTool\\WObj:=RmpFrame);\n"
                                "    t.trans:=p;\n"
                                "    RETURN t;\n"
                                "  ENDFUNC\n"},
                               {"RmpJoints",
                                "  LOCAL FUNC jointtarget RmpJoints(robjoint j)\n"
                                "    VAR jointtarget t;\n"
                                "    t:=CJointT();\n"
                                "    t.robax:=j;\n"
                                "    RETURN t;\n"
                                "  ENDFUNC\n"},
                               {"RmpTrunc",
                                "  LOCAL FUNC num RmpTrunc(num x)\n"
                                "    IF x<0 RETURN -Trunc(-x);\n"
                                "    RETURN Trunc(x);\n"
                                "  ENDFUNC\n"},
                               {"RmpRound",
                                "  LOCAL FUNC num RmpRound(num x)\n"
                                "    IF x<0 RETURN -Trunc(0.5-x);\n"
                                "    RETURN Trunc(x+0.5);\n"
                                "  ENDFUNC\n"},
                               {"RmpDiv",
                                "  LOCAL FUNC num RmpDiv(num a,num b)\n"
                                "    RETURN RmpTrunc(a/b);\n"
                                "  ENDFUNC\n"},
                               // MOD of RAPID is never negative, and its DIV goes with it.
                               {"RmpMod",
                                "  LOCAL FUNC num RmpMod(num a,num b)\n"
                                "    RETURN a-b*RmpTrunc(a/b);\n"
                                "  ENDFUNC\n"}};

const PostCapabilities& capabilities_of() {
  static const PostCapabilities all = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
                 kPostRecursion | kPostLocals | kPostIntegers | kPostReals | kPostBooleans |
                 kPostStrings | kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct |
                 kPostJointValues | kPostFunctionsOfMath | kPostIf | kPostElsif | kPostWhile |
                 kPostFor | kPostForStep | kPostCase | kPostGoto | kPostReturn | kPostWaitFor |
                 kPostWaitTimeout | kPostVariableTargets | kPostVariableAttributes | kPostMessages |
                 kPostPause | kPostOutputsAreRead | kPostTools | kPostFrames | kPostTime;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostLinIncrement |
                kPostPtpIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::zone;
    c.speed = PostSpeed::mm_per_s;
    c.external_axes = 6;
    c.max_name = 32;
    c.reserved =
        "ALIAS AND BACKWARD CASE CONNECT CONST DEFAULT DIV DO ELSE ELSEIF ENDFOR ENDFUNC ENDIF "
        "ENDMODULE ENDPROC ENDRECORD ENDTEST ENDTRAP ENDWHILE ERROR EXIT FALSE FOR FROM FUNC GOTO "
        "IF INOUT LOCAL MOD MODULE NOSTEPIN NOT NOVIEW OR PERS PROC RAISE READONLY RECORD RETRY "
        "RETURN STEP SYSMODULE TASK TEST THEN TO TRAP TRUE TRYNEXT UNDO VAR VIEWONLY WHILE WITH "
        "XOR num bool string pos orient pose robtarget jointtarget robjoint extjoint confdata "
        "speeddata zonedata tooldata wobjdata main fine stop MoveJ MoveL MoveC MoveAbsJ Offs "
        "RelTool PoseMult PoseInv WaitTime WaitUntil WaitDI SetDO SetGO SetAO TPWrite Stop CRobT "
        "CJointT Trunc Round Abs Sin Cos Tan ASin ACos ATan ATan2 Sqrt Exp Pow OrientZYX "
        "NumToStr ValToStr StrLen StrPart x y z trans rot tool0 wobj0 RmpTool RmpFrame RmpTarget "
        "RmpPlace RmpJoints RmpTrunc RmpRound RmpMod RmpDiv RmpHit RmpTimeout SearchL ERRNO "
        "Add Break Clear Close Decr Incr Load Open Present Reset Rewind Save Set Start Write "
        "clock1 "
        "reg1 reg2 reg3 reg4 reg5 DInput DOutput GInput GOutput AInput AOutput AccSet ConfJ ConfL "
        "PoseVect NOrient DotProd StrFind";
    c.extensions = "mod";
    c.title = "ABB RAPID";
    return c;
  }();
  return all;
}

class RapidWriter final : public post::DeclaredWriter {
 public:
  RapidWriter(const PostTask& task, PostOutput& output, Progress& progress)
      : DeclaredWriter(task, output, capabilities_of(), progress,
                       {'{', '}', ":=", ";", "recordtype", 40}) {}

 private:
  // ---- program ----
  void begin() override {
    out_ = &body_;
    for (auto* f : {&data_, &body_}) f->in();
    structures();
    common_tool_ = common_place(RMP_ATTR_TOOL);
    common_frame_ = common_place(RMP_ATTR_FRAME);
    tool_and_frame();
    other_tool_ = is_anywhere(RMP_ATTR_TOOL);
    other_frame_ = is_anywhere(RMP_ATTR_FRAME);
    changed_acc_ = is_anywhere(RMP_ATTR_ACC) || is_anywhere(RMP_ATTR_ACC_PTP);
  }
  void structures() {
    for (const std::uint32_t t : records_in_use()) {
      const auto& x = type(t);
      at_ = x.span;
      data_.add("RECORD " + struct_name(t), &at_);
      data_.in();
      for (std::uint32_t k = 0; k < x.field_count; ++k) {
        const std::uint32_t of = field_row(x.first_field + k).type;
        if (type(of).kind == RMP_TYPE_ARRAY)
          cannot("arrays within records", "Make it a separate array.");
        data_.add(rapid_type(of) + " " + field_name(t, k) + ";", &at_);
      }
      data_.out();
      data_.add("ENDRECORD");
    }
  }
  void tool_and_frame() {
    const PostPlace* tool = nullptr;
    if (profile_.tool >= 0 && static_cast<std::size_t>(profile_.tool) < profile_.tools.size())
      tool = &profile_.tools[static_cast<std::size_t>(profile_.tool)];
    if (common_tool_) {
      tool = nullptr;
      for (const PostPlace& p : profile_.tools)
        if (post::same_place(p.pose, *common_tool_)) tool = &p;
    }
    tool_text_ = common_tool_ ? pose(*common_tool_)
                 : tool       ? pose(tool->pose)
                              : std::string(kNowhere);
    const double mass = tool && tool->mass > 0 ? tool->mass : number_option("tool_mass", 1.0);
    tail_ = ",[" + plain(mass, 3) + ",[0,0,1],[1,0,0,0],0,0,0]]";
    // Tasks that share variables have tools and frames of their own.
    std::string own;
    for (const PostSignal& s : profile_.signals)
      if (s.kind == "shared") own = "TASK ";
    data_.add(own + "PERS tooldata RmpTool:=[TRUE," + tool_text_ + tail_ + ";");
    data_.add(own + "PERS wobjdata RmpFrame:=[FALSE,TRUE,\"\"," +
              (common_frame_ ? pose(*common_frame_) : std::string(kNowhere)) + "," + kNowhere +
              "];");
  }
  void routine_begin(std::uint32_t r) override {
    const auto& x = routine(r);
    init_.clear();
    if (!body_.empty()) body_.add("");
    if (r == 0) {
      open("PROC " + std::string(option("main", "main")) + "()");
      return;
    }
    if (x.kind == RMP_ROUTINE_PROCESS || x.kind == RMP_ROUTINE_INTERRUPT)
      cannot(x.kind == RMP_ROUTINE_PROCESS ? "parallel processes in one program" : "interrupts");
    std::string head = x.kind == RMP_ROUTINE_FUNCTION
                           ? "FUNC " + rapid_type(x.result) + " " + routine_name(r) + "("
                           : "PROC " + routine_name(r) + "(";
    for (std::uint32_t k = 0; k < x.parameter_count; ++k) {
      const std::uint32_t p = x.first_parameter + k;
      const std::uint32_t t = symbol(p).type;
      head += (k ? "," : "") +
              std::string(
                  symbol(p).mode == RMP_MODE_IN && type(t).kind != RMP_TYPE_ARRAY ? "" : "INOUT ") +
              rapid_type(t) + " " + name(p);
      int n = 0;
      for (std::uint32_t e = t; type(e).kind == RMP_TYPE_ARRAY; e = type(e).element) ++n;
      if (n > 0) head += "{*" + std::string(n > 1 ? ",*" : "") + (n > 2 ? ",*" : "") + "}";
    }
    open(head + ")");
  }
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = symbol(s).span;
    if (symbol(s).kind == RMP_SYMBOL_ROBOT) {
      cannot("descriptions of robots", "Leave the robot to the profile.");
      return;
    }
    const std::string text =
        "VAR " + rapid_type(symbol(s).type) + " " + name(s) + dimensions(symbol(s).type) + ";";
    if (r == 0) data_.add(text, &at_);
    else line(text);
    init_.push_back(s);
  }
  void routine_code(std::uint32_t r) override {
    if (r == 0) {
      line("ConfJ\\" + std::string(option("conf_j", knows_configurations() ? "On" : "Off")) + ";");
      line("ConfL\\" + std::string(option("conf_l", "Off")) + ";");
      if (!profile_.prologue.empty()) body_.add_lines(profile_.prologue);
    }
    set_initial(r);
  }
  /// Whether the joints of all PTP targets are known: a configuration that is only guessed must not
  /// be kept to.
  [[nodiscard]] bool knows_configurations() const {
    for (std::uint32_t i = 0; i < c_.motions.count; ++i) {
      const auto& m = row<rmp_code_motion>(c_.motions, i);
      if (m.interpolation != RMP_MOVE_PTP || m.is_incremental || goes_to_joints(m)) continue;
      for (const std::uint32_t t : links(m.first_target, m.target_count))
        if (const PostPoint* p = point(t); !p || p->q.empty()) return false;
    }
    return true;
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0 && !profile_.epilogue.empty()) body_.add_lines(profile_.epilogue);
    if (std::exchange(in_search_, false)) {
      // A signal that never came, or that was there already, is no fault of the program.
      middle("ERROR");
      line("IF ERRNO=ERR_WHLSEARCH OR ERRNO=ERR_SIGSUPSEARCH TRYNEXT;");
    }
    close(routine(r).kind == RMP_ROUTINE_FUNCTION ? "ENDFUNC" : "ENDPROC");
  }
  void finish() override {
    post::File all;
    const std::string name = routine_name(0);
    all.add("MODULE " + name);
    all.append(data_);
    all.append(points_);
    all.add("");
    all.append(body_);
    static constexpr std::pair<const char*, const char*> kNeeds[] = {{"RmpMod", "RmpTrunc"},
                                                                     {"RmpDiv", "RmpTrunc"}};
    add_helpers(joined(body_), kHelpers, kNeeds, all);
    all.add("ENDMODULE");
    all.give(output_, name + ".mod", caps_.crlf);
  }

  // ---- types and values ----
  std::string rapid_type(std::uint32_t t) {
    const auto& x = type(t);
    switch (x.kind) {
      case RMP_TYPE_INT:
      case RMP_TYPE_REAL: return "num";
      case RMP_TYPE_CHAR:
      case RMP_TYPE_STRING: return "string";
      case RMP_TYPE_BOOL: return "bool";
      case RMP_TYPE_ARRAY: return rapid_type(x.element);
      case RMP_TYPE_RECORD: break;
      default: cannot("variables of " + type_name(t)); return "num";
    }
    switch (x.role) {
      case RMP_ROLE_POSITION: return "pos";
      case RMP_ROLE_ORIENTATION: return "orient";
      case RMP_ROLE_POSE: return "pose";
      case RMP_ROLE_ROBTARGET: return "robtarget";
      case RMP_ROLE_JOINT: return "jointtarget";
      case RMP_ROLE_MAIN_JOINT: return "robjoint";
      case RMP_ROLE_ADD_JOINT: return "extjoint";
      case RMP_ROLE_ROBOT: cannot("descriptions of robots"); return "num";
      default: return struct_name(t);
    }
  }
  void begins_with(const std::string& to, std::uint32_t value) override { set(to, text(value)); }
  std::string first_value(std::uint32_t value) override {
    const PostPoint* p = point(value);
    return p ? literal_point(*p) : text(value);
  }
  std::string zero(std::uint32_t t) override {
    const std::string k = rapid_type(t);
    if (k == "bool") return "FALSE";
    if (k == "string") return "\"\"";
    if (k == "pos") return "[0,0,0]";
    if (k == "orient") return "[1,0,0,0]";
    if (k == "pose") return "[[0,0,0],[1,0,0,0]]";
    if (k == "robtarget") return "[[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    if (k == "robjoint") return "[0,0,0,0,0,0]";
    if (k == "extjoint") return "[9E9,9E9,9E9,9E9,9E9,9E9]";
    if (k == "jointtarget") return "[[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    return "0";
  }
  std::string plain(double v, int digits) {
    if (!(std::fabs(v) < 1e9))
      fail(std::isfinite(v) ? "a number here is beyond the controller's range"
                            : "a number here is not finite",
           "Check what it is computed from.");
    return post::trimmed(v, digits);
  }
  std::string mm(double metres) { return plain(metres * 1000, profile_.length_digits); }
  std::string place_text(const Pose& p) {
    return "[" + mm(p.p[0]) + "," + mm(p.p[1]) + "," + mm(p.p[2]) + "]";
  }
  std::string turn(const Pose& p) {
    // Nine digits keep it normalised to what the controller checks.
    const auto q = post::quaternion(p.R);
    std::string s;
    for (const double x : q) s += (s.empty() ? "[" : ",") + plain(x, 9);
    return s + "]";
  }
  std::string pose(const Pose& p) { return "[" + place_text(p) + "," + turn(p) + "]"; }
  std::string externals(const PostPoint& p) {
    const auto e = external_axes(p);
    if (e.size() > 6) fail("ABB RAPID has six external axes, and the profile has more");
    std::string s;
    for (std::size_t i = 0; i < 6; ++i)
      s += (i ? "," : "[") +
           (i < e.size() ? plain(e[i], profile_.length_digits) : std::string("9E9"));
    return s + "]";
  }
  std::string joints(const PostPoint& p) {
    const auto a = axes(p);
    if (a.size() > 6)
      fail("ABB RAPID has six axes, and this target has " + std::to_string(a.size()),
           "Give the profile's axes; the others can be external ones.");
    std::string s;
    for (std::size_t i = 0; i < 6; ++i)
      s += (i ? "," : "[") + (i < a.size() ? plain(a[i], profile_.angle_digits) : std::string("0"));
    return s + "]";
  }
  /// cf1, cf4, cf6: quarters of a turn; cfx: the configuration.
  std::string configuration(const PostPoint& p) {
    // cfx: 4 the wrist is behind axis 1, 2 behind the lower arm, 1 axis 5 is negative.
    std::uint32_t cfx = p.status_known || p.has_status
                            ? ((p.status & kPostShoulderBehind) ? 4U : 0U) |
                                  (post::wrist_behind_lower_arm(p.status) ? 2U : 0U) |
                                  ((p.status & kPostWristFlipped) ? 1U : 0U)
                            : 0U;
    if (p.q.empty()) {
      const std::string out = "[0,0,0," + std::to_string(cfx) + "]";
      warn(std::string(*p.q_missing ? p.q_missing : "the joint values of this target are unknown") +
               ": its configuration is written as " + out +
               ", and ConfJ\\Off makes the controller use the nearest one",
           "Name the robot (program.post{robot = ...}), or check the target.");
      return out;
    }
    const auto a = axes(p);
    // The controller's own axis 5 counts.
    if (has_axes() && a.size() >= 6) cfx = (cfx & 6U) | (a[4] < 0 ? 1U : 0U);
    const auto quarter = [&](std::size_t i) {
      return i < a.size() ? post::fixed(std::floor(a[i] / 90.0 + 1e-7), 0) : std::string("0");
    };
    return "[" + quarter(0) + "," + quarter(3) + "," + quarter(5) + "," + std::to_string(cfx) + "]";
  }
  std::string robtarget(const PostPoint& p) {
    return "[" + place_text(p.pose) + "," + turn(p.pose) + "," + configuration(p) + "," +
           externals(p) + "]";
  }
  std::string literal_point(const PostPoint& p) {
    switch (p.role) {
      case RMP_ROLE_POSITION: return place_text(p.pose);
      case RMP_ROLE_ORIENTATION: return turn(p.pose);
      case RMP_ROLE_POSE: return pose(p.pose);
      case RMP_ROLE_ROBTARGET: return robtarget(p);
      case RMP_ROLE_MAIN_JOINT: return joints(p);
      case RMP_ROLE_ADD_JOINT: return externals(p);
      default: return "[" + joints(p) + "," + externals(p) + "]";
    }
  }
  std::string named(const char* kind, const std::string& value, std::uint32_t e) {
    const auto [number, is_new] = table_.add(kind + value);
    if (!is_new) return point_names_[number];
    const auto& x = expression(e);
    const std::string wish = x.op == RMP_EXPR_SYMBOL ? "p_" + std::string(symbol(x.symbol).name)
                                                     : "p" + std::to_string(number + 1);
    point_names_.push_back(names_.unique(wish));
    if (points_.empty()) points_.in();
    points_.add(std::string("CONST ") + kind + " " + point_names_.back() + ":=" + value + ";",
                &at_);
    return point_names_.back();
  }

  // ---- expressions ----
  std::span<const Operator> operators() const override { return kOperators; }
  const Operator* operation(const rmp_code_expression& e) override {
    static constexpr Operator kMod{RMP_EXPR_MOD, "RmpMod", 100, Operator::call};
    static constexpr Operator kDiv{RMP_EXPR_DIV, "RmpDiv", 100, Operator::call};
    if (e.op == RMP_EXPR_MOD) return &kMod;
    if (e.op == RMP_EXPR_DIV) return &kDiv;
    return Writer::operation(e);
  }
  std::string real_literal(double v) override {
    std::string s = post::shortest(v);
    // num has the precision of binary32 or, as dnum, more; whole ones go without a point.
    if (s.size() > 2 && s.ends_with(".0")) s.resize(s.size() - 2);
    return s;
  }
  Text string_literal(std::string_view s) override {
    std::string out = "\"";
    if (s.size() > 80)
      fail("this text is longer than the 80 letters of a string in ABB RAPID", "Split it in two.");
    for (const char c : s) {
      if (static_cast<unsigned char>(c) < 32)
        fail("this text has a control character", "Take it out.");
      if (static_cast<unsigned char>(c) > 126)
        fail("this text has characters that ABB RAPID does not have", "Use letters of ASCII.");
      out += c;
      if (c == '"' || c == '\\') out += c;
    }
    return {out + "\""};
  }
  std::string signal_name(const Signal& s, std::string_view own) {
    if (!s.target.empty()) return s.target;
    return std::string(own);
  }
  std::string signal_word(const Signal& s) {
    if (!s.target.empty()) return s.target;
    if (s.type == RMP_TYPE_INT)
      return (s.is_output ? "go" : "gi") + std::to_string(s.number) + "_" + std::to_string(s.width);
    if (s.type == RMP_TYPE_REAL) return (s.is_output ? "ao" : "ai") + std::to_string(s.number);
    return (s.is_output ? "do" : "di") + std::to_string(s.number);
  }
  /// A variable that the tasks of several robots share, in place of a line between them.
  bool is_shared(const Signal& s) {
    if (s.kind != "shared") return false;
    const std::string word = signal_word(s);
    if (shared_.insert(word).second)
      data_.add("PERS " + std::string(s.type == RMP_TYPE_BOOL ? "bool " : "num ") + word +
                ":=" + (s.type == RMP_TYPE_BOOL ? "FALSE" : "0") + ";");
    return true;
  }
  Text state(const Signal& s) {
    const std::string word = signal_word(s);
    if (is_shared(s)) return {word};
    if (s.type == RMP_TYPE_BOOL)
      return {(s.is_output ? "DOutput(" : "DInput(") + word + ")=" + (s.inverted ? "0" : "1"), 29};
    if (s.type == RMP_TYPE_INT) return {(s.is_output ? "GOutput(" : "GInput(") + word + ")"};
    return {(s.is_output ? "AOutput(" : "AInput(") + word + ")"};
  }
  Text input(const Signal& s) override { return state(s); }
  Text output(const Signal& s) override { return state(s); }
  Text convert(std::uint32_t operand, const rmp_code_expression& e) override {
    if (e.type == RMP_TYPE_STRING && expression(operand).type == RMP_TYPE_CHAR)
      return expr(operand);
    return Writer::convert(operand, e);
  }
  static std::string part(std::uint32_t role, std::uint32_t number) {
    static constexpr const char* kXyz[] = {"x", "y", "z"};
    static constexpr const char* kQ[] = {"q1", "q2", "q3", "q4"};
    static constexpr const char* kJoint[] = {"robax", "extax"};
    static constexpr const char* kPose[] = {"trans", "rot"};
    static constexpr const char* kEax[] = {"eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"};
    switch (role) {
      case RMP_ROLE_POSITION: return number < 3 ? kXyz[number] : "";
      case RMP_ROLE_ORIENTATION: return number < 4 ? kQ[number] : "";
      case RMP_ROLE_POSE: return number < 2 ? kPose[number] : "";
      case RMP_ROLE_JOINT: return number < 2 ? kJoint[number] : "";
      case RMP_ROLE_MAIN_JOINT: return number < 6 ? "rax_" + std::to_string(number + 1) : "";
      case RMP_ROLE_ADD_JOINT: return number < 6 ? kEax[number] : "";
      case RMP_ROLE_ROBTARGET: return number == 3 ? "extax" : "";
      default: return "";
    }
  }
  /// Where something stands: target.PSE is the target, whose trans and rot are the pose's.
  std::string place(std::uint32_t e) override {
    const auto& x = expression(e);
    if (x.op == RMP_EXPR_SYMBOL) return variable(x.symbol).text;
    if (x.op == RMP_EXPR_INDEX) return indexed(e);
    if (x.op != RMP_EXPR_FIELD) {
      fail("ABB RAPID can access parts of variables only", "Assign the value to a variable first.");
      return "x";
    }
    const std::uint32_t object = links(x.first, x.count)[0];
    const std::uint32_t of = role(expression(object).type);
    if (of == RMP_ROLE_ROBTARGET && x.symbol == 0) return place(object);
    if (of == RMP_ROLE_NONE)
      return place(object) + "." + field_name(expression(object).type, x.symbol);
    const std::string word = part(of, x.symbol);
    if (word.empty()) {
      cannot("such part of " + type_name(expression(object).type),
             "Only PSE and the additional joints of a target exist.");
      return "x";
    }
    return place(object) + "." + word;
  }
  Text field(std::uint32_t object, std::uint32_t number, const rmp_code_expression& x) override {
    if (role(expression(object).type) == RMP_ROLE_ROBTARGET && number == 0) {
      const std::string p = place(object);
      return {"[" + p + ".trans," + p + ".rot]"};
    }
    return {place(row_of(x))};
  }
  std::optional<Text> known_point(const PostPoint& p, const rmp_code_expression&) override {
    return Text{literal_point(p)};
  }
  Text make(std::span<const std::uint32_t> of, const rmp_code_expression& x) override {
    switch (role(x.type)) {
      case RMP_ROLE_POSITION:
      case RMP_ROLE_POSE:
      case RMP_ROLE_ORIENTATION:
      case RMP_ROLE_JOINT: return {"[" + list(of, ",") + "]"};
      case RMP_ROLE_MAIN_JOINT: {
        std::string s = list(of, ",");
        for (std::size_t k = of.size(); k < 6; ++k) s += ",0";
        if (of.size() > 6) cannot("robots of more than six axes");
        return {"[" + s + "]"};
      }
      case RMP_ROLE_ADD_JOINT: {
        std::string s = list(of, ",");
        for (std::size_t k = of.size(); k < 6; ++k) s += ",9E9";
        return {"[" + s + "]"};
      }
      case RMP_ROLE_NONE:
        if (type(x.type).kind == RMP_TYPE_RECORD || type(x.type).kind == RMP_TYPE_ARRAY)
          return {"[" + list(of, ",") + "]"};
        return Writer::make(of, x);
      default: return Writer::make(of, x);
    }
  }
  Text compose(std::uint32_t a, std::uint32_t b, const rmp_code_expression&) override {
    const std::uint32_t left = role(expression(a).type), right = role(expression(b).type);
    if (left == RMP_ROLE_POSE && right == RMP_ROLE_POSE)
      return {"PoseMult(" + text(a) + "," + text(b) + ")"};
    if (left == RMP_ROLE_POSE) return {"PoseVect(" + text(a) + "," + text(b) + ")"};
    if (right == RMP_ROLE_POSITION) return {"PoseVect([[0,0,0]," + text(a) + "]," + text(b) + ")"};
    return {within(expr(a), 50) + "*" + within(expr(b), 51), 50};
  }
  Text intrinsic(std::string_view name, std::span<const std::uint32_t> of,
                 const rmp_code_expression& x) override {
    static constexpr std::pair<std::string_view, const char*> kSame[] = {
        {"SIN", "Sin"},        {"COS", "Cos"},       {"TAN", "Tan"},         {"ASIN", "ASin"},
        {"ACOS", "ACos"},      {"ATAN", "ATan"},     {"ATAN2", "ATan2"},     {"SQRT", "Sqrt"},
        {"EXP", "Exp"},        {"ABS", "Abs"},       {"INV", "PoseInv"},     {"TRUNC", "RmpTrunc"},
        {"ROUND", "RmpRound"}, {"LENGTH", "StrLen"}, {"EXTRACT", "StrPart"}, {"DOT", "DotProd"}};
    for (const auto& [irl, rapid] : kSame)
      if (name == irl) return {std::string(rapid) + "(" + list(of, ",") + ")"};
    // OrientZYX(anglez, angley, anglex).
    if (name == "ORIZYX") return {"OrientZYX(" + list(of, ",") + ")"};
    if (name == "ORIRS")
      return {"OrientZYX(" + text(of[2]) + "," + text(of[1]) + "," + text(of[0]) + ")"};
    const auto about = [&](std::size_t axis, std::size_t k) {
      const std::string v = text(of[k]);
      return std::string("OrientZYX(") + (axis == 2 ? v : "0") + "," + (axis == 1 ? v : "0") + "," +
             (axis == 0 ? v : "0") + ")";
    };
    const auto three = [&](std::size_t a, std::size_t b, std::size_t c) {
      return Text{about(a, 0) + "*" + about(b, 1) + "*" + about(c, 2), 50};
    };
    if (name == "ORIXYZ") return three(0, 1, 2);
    if (name == "ORIYXZ") return three(1, 0, 2);
    if (name == "ORIZYZ2") return three(2, 1, 2);
    if (name == "ORIQUAT") return {"NOrient([" + list(of, ",") + "])"};
    if (name == "ORIMULT") return compose(of[0], of[1], x);
    if (name == "FLOAT") return expr(of[0]);
    if (name == "CONCAT") return {within(expr(of[0]), 40) + "+" + within(expr(of[1]), 41), 40};
    return Writer::intrinsic(name, of, x);
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> of) override {
    return {routine_name(r) + "(" + arguments(r, of) + ")"};
  }
  std::string arguments(std::uint32_t r, std::span<const std::uint32_t> of) {
    std::string out;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const auto p = routine(r).first_parameter + static_cast<std::uint32_t>(k);
      const bool is_place =
          symbol(p).mode != RMP_MODE_IN || type(expression(of[k]).type).kind == RMP_TYPE_ARRAY;
      out += (k ? "," : "") + (is_place ? place(of[k]) : text(of[k]));
    }
    return out;
  }

  // ---- statements ----
  void assign(std::uint32_t to, std::uint32_t value) override {
    const auto& x = expression(to);
    if (x.op == RMP_EXPR_FIELD && x.symbol == 0 &&
        role(expression(links(x.first, x.count)[0]).type) == RMP_ROLE_ROBTARGET) {
      const std::string target = place(to);
      const auto& v = expression(value);
      if (v.op == RMP_EXPR_SYMBOL || v.op == RMP_EXPR_INDEX) {
        line(target + ".trans:=" + place(value) + ".trans;");
        line(target + ".rot:=" + place(value) + ".rot;");
        return;
      }
      const PostPoint* p = point(value);
      if (!p) {
        fail("the pose of a target must be a variable", "Assign the value to a variable first.");
        return;
      }
      line(target + ".trans:=" + place_text(p->pose) + ";");
      line(target + ".rot:=" + turn(p->pose) + ";");
      return;
    }
    if (type(x.type).kind == RMP_TYPE_ARRAY && expression(value).op == RMP_EXPR_MAKE) {
      initial(place(to), x.type, value);
      return;
    }
    line(place(to) + ":=" + text(value) + ";");
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    const std::string word = signal_word(s);
    if (is_shared(s)) return line(word + ":=" + text(value) + ";");
    if (s.type == RMP_TYPE_INT) return line("SetGO " + word + "," + text(value) + ";");
    if (s.type == RMP_TYPE_REAL) return line("SetAO " + word + "," + text(value) + ";");
    if (const auto v = known(value))
      return line("SetDO " + word + "," + ((*v != 0) != s.inverted ? "1" : "0") + ";");
    open("IF " + text(value) + " THEN");
    line("SetDO " + word + "," + (s.inverted ? "0" : "1") + ";");
    middle("ELSE");
    line("SetDO " + word + "," + (s.inverted ? "1" : "0") + ";");
    close("ENDIF");
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> of) override {
    const std::string a = arguments(r, of);
    line(routine_name(r) + (a.empty() ? "" : " " + a) + ";");
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    std::string s;
    for (const std::uint32_t v : values) {
      const std::uint32_t t = expression(v).type;
      s += (s.empty() ? "" : "+") + (t == RMP_TYPE_STRING || t == RMP_TYPE_CHAR
                                         ? within(expr(v), 40)
                                         : "ValToStr(" + text(v) + ")");
    }
    line("TPWrite " + (s.empty() ? std::string("\"\"") : s) + ";");
  }
  void if_begin(std::uint32_t c) override { open("IF " + text(c) + " THEN"); }
  void else_if(std::uint32_t c) override { middle("ELSEIF " + text(c) + " THEN"); }
  void else_() override { middle("ELSE"); }
  void if_end() override { close("ENDIF"); }
  void while_begin(std::uint32_t c) override { open("WHILE " + text(c) + " DO"); }
  void while_end() override { close("ENDWHILE"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    // FOR has a counter of its own, which nothing else sees.
    const std::string counter = names_.unique("i_" + std::string(symbol(s).name));
    const double by = (step == RMP_NONE ? 1.0 : known(step).value_or(1.0)) * (down ? -1.0 : 1.0);
    open("FOR " + counter + " FROM " + text(from) + " TO " + text(to) + " STEP " +
         post::fixed(by, 0) + " DO");  // without it RAPID would count down, too
    line(name(s) + ":=" + counter + ";");
  }
  void for_end(std::uint32_t) override { close("ENDFOR"); }
  void case_begin(std::uint32_t s) override { case_opens("TEST " + text(s)); }
  void case_when(std::span<const std::uint32_t> labels) override {
    arm("CASE " + list(labels, ",") + ":");
  }
  void case_default() override { arm("DEFAULT:"); }
  void case_end() override { case_closes("ENDTEST"); }
  void go_to(std::uint32_t l) override { line("GOTO " + name(l) + ";"); }
  void label(std::uint32_t l) override { line(name(l) + ":"); }
  void return_(std::uint32_t v) override {
    line(v == RMP_NONE ? "RETURN;" : "RETURN " + text(v) + ";");
  }
  void wait_time(std::uint32_t s) override { line("WaitTime " + text(s) + ";"); }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    if (timeout == RMP_NONE) return line("WaitUntil " + text(c) + ";");
    const std::uint32_t told = system_symbol("R_TIMEOUT");
    std::string flag;
    if (told != RMP_NONE && is_used(told)) flag = name(told);
    else {
      flag = names_.of(1ULL << 42U, "RmpTimeout");
      if (!std::exchange(has_flag_, true)) data_.add("VAR bool " + flag + ";");
    }
    line("WaitUntil " + text(c) + "\\MaxTime:=" + text(timeout) + "\\TimeFlag:=" + flag + ";");
  }
  void pause(std::uint32_t m) override {
    if (m != RMP_NONE) {
      const std::uint32_t one[] = {m};
      message(one, true);
    }
    line("Stop;");
  }
  void halt() override { line("EXIT;"); }

  // ---- motions ----
  static bool is_set(const post::Attribute& a) { return a.known || a.expression != RMP_NONE; }
  std::string value_of(const post::Attribute& a, double by, double otherwise) {
    if (a.known) return plain(*a.known * by, 6);
    if (a.expression == RMP_NONE) return plain(otherwise, 6);
    return by == 1 ? text(a.expression) : within(expr(a.expression), 50) + "*" + plain(by, 9);
  }
  void common(const Motion& m) {
    if (m[RMP_ATTR_WOBBLE].given && m[RMP_ATTR_WOBBLE].known != 0.0) cannot("weaving");
    if (m[RMP_ATTR_DEVICE].given && m[RMP_ATTR_DEVICE].known != 1.0) cannot("other devices");
    if (m[RMP_ATTR_ADAX_CONTROL].given && m[RMP_ATTR_ADAX_CONTROL].known != 0.0)
      cannot("control of additional axes");
    if (m[RMP_ATTR_C_SPEED].given && m[RMP_ATTR_C_SPEED].known != 100.0)
      warn("C_SPEED is not written: in ABB RAPID the controller chooses the speed of transitions");
    const auto& acc = m[m.interpolation == RMP_MOVE_PTP ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC];
    if (is_set(acc) && (acc.given || acc.known != 100.0 || changed_acc_)) {
      changed_acc_ = true;
      const std::string v = value_of(acc, 1, 100);
      if (acc_.changes(v)) line("AccSet " + v + ",100;");
      if (!acc.known) acc_.forget();
    }
  }
  void forget() override {
    acc_.forget();
    at_tool_.forget();
    at_frame_.forget();
  }
  void places(const Motion& m) {
    if (!common_tool_)
      place_attribute(m[RMP_ATTR_TOOL], at_tool_, "RmpTool.tframe", tool_text_, other_tool_);
    if (!common_frame_)
      place_attribute(m[RMP_ATTR_FRAME], at_frame_, "RmpFrame.uframe", kNowhere, other_frame_);
  }
  void place_attribute(const post::Attribute& a, post::Modal<std::string>& modal, const char* word,
                       const std::string& standard, bool& other) {
    if (!a.given && !other) return;
    other = true;
    const std::string v = a.given ? text(a.expression) : standard;
    if (modal.changes(v)) line(std::string(word) + ":=" + v + ";");
    if (a.given && !point(a.expression)) modal.forget();
  }
  std::string speed(const Motion& m) {
    std::string s;
    if (m.interpolation == RMP_MOVE_PTP) {
      // A share of the fastest: the tool's speed cannot be given, so the limit is.
      const double most = profile_.max_speed > 0 ? profile_.max_speed : 5000;
      const double turn = profile_.max_speed_ori > 0 ? profile_.max_speed_ori : 500;
      s = "[" + value_of(m[RMP_ATTR_SPEED_PTP], most / 100, most) + "," +
          value_of(m[RMP_ATTR_SPEED_PTP], turn / 100, turn) + ",5000,1000]";
    } else {
      s = "[" + value_of(m[RMP_ATTR_SPEED], 1, 250) + "," + value_of(m[RMP_ATTR_SPEED_ORI], 1, 90) +
          ",5000,1000]";
    }
    const auto& time = m[RMP_ATTR_TIME];
    if (is_set(time) && !(time.known && *time.known < 0)) {
      if (!time.known) {
        cannot("motions with a computed duration", "Give a number of seconds.");
        return s;
      }
      s += "\\T:=" + plain(*time.known, 6);
    }
    return s;
  }
  std::string zone(const Motion& m) {
    const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
    const auto& c = m[is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP];
    const auto& pass = m[RMP_ATTR_C_PASS];
    if (pass.given && !pass.known) cannot("a computed C_PASS");
    std::string r;
    if (is_set(c) && !(c.known && *c.known <= 0)) {
      // Of PTP in % of the way; RAPID has mm: the profile's zone at 100 %.
      const double at_full = number_option("zone_ptp", 200);
      r = value_of(c, is_ptp ? at_full / 100 : 1.0, 0);
    } else if (pass.given && pass.known != 0.0) {
      r = plain(number_option("zone_pass", 10), 3);
      note("C_PASS without a distance is written as a zone of " + r +
               " mm, and the simulated robot " + post::at_c_pass_in_a_run(*task_.code, m),
           std::string("Give ") + (is_ptp ? "C_PTP" : "C_CP") +
               "; the profile's option zone_pass sets the zone.");
    } else {
      return "fine";
    }
    const auto tail = [&] {
      if (!c.known && c.expression != RMP_NONE)
        return r + "*1.5," + r + "*1.5," + r + "*0.15," + r + "*1.5," + r + "*0.15";
      double v = 0;
      std::from_chars(r.data(), r.data() + r.size(), v);
      const std::string a = plain(v * 1.5, 3), b = plain(v * 0.15, 3);
      return a + "," + a + "," + b + "," + a + "," + b;
    };
    return "[FALSE," + r + "," + tail() + "]";
  }
  std::string behind(const Motion& m) {
    const std::string z = zone(m);
    passed_ = z != "fine";
    return "," + speed(m) + "," + z + ",RmpTool\\WObj:=RmpFrame;";
  }
  std::string target(const Target& t) {
    switch (t.role) {
      case RMP_ROLE_POSITION: return "RmpPlace(" + text(t.expression) + ")";
      case RMP_ROLE_POSE:
        // Without a robot its configuration is not known: that of the moment is kept.
        if (t.point && !t.point->q.empty())
          return named("robtarget", robtarget(*t.point), t.expression);
        return "RmpTarget(" + text(t.expression) + ")";
      case RMP_ROLE_ROBTARGET:
        if (t.point) return named("robtarget", robtarget(*t.point), t.expression);
        return text(t.expression);
      default:
        cannot("targets of " + type_name(expression(t.expression).type) + " for this motion",
               "Give a POSE.");
        return "p";
    }
  }
  void increment(const Motion& m, const char* word) {
    const PostPoint* p = m.targets[0].point;
    if (m.targets[0].role != RMP_ROLE_POSE && m.targets[0].role != RMP_ROLE_POSITION) {
      cannot("increments of joints", "Move to the target joints themselves.");
      return;
    }
    if (m.targets[0].role == RMP_ROLE_POSE) {
      if (!p) {
        cannot("computed increments, as POSE", "Give a POSITION.");
        return;
      }
      const auto o = post::orientation(p->pose.R, post::Orientation::rotation_vector);
      if (std::hypot(o[0], o[1], o[2]) > 1e-9) {
        cannot("increments that turn the tool", "Move to the target pose itself.");
        return;
      }
    }
    if (passed_)
      warn("the previous motion blends past its target, so the robot may not be there yet",
           "Remove its C_CP or C_PTP.");
    // From the place that was reached last.
    const std::string by = p ? mm(p->pose.p[0]) + "," + mm(p->pose.p[1]) + "," + mm(p->pose.p[2])
                             : place(m.targets[0].expression) + ".x," +
                                   place(m.targets[0].expression) + ".y," +
                                   place(m.targets[0].expression) + ".z";
    line(std::string(word) + " Offs(CRobT(\\Tool:=RmpTool\\WObj:=RmpFrame)," + by + ")" +
         behind(m));
  }
  void ptp(const Motion& m) override {
    common(m);
    places(m);
    if (!until_is_said(m)) return;
    if (m.incremental) return increment(m, "MoveJ");
    const Target& t = m.targets[0];
    const bool is_joint = t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
    if (!is_joint) return line("MoveJ " + target(t) + behind(m));
    if (t.point)
      return line("MoveAbsJ " +
                  named("jointtarget", "[" + joints(*t.point) + "," + externals(*t.point) + "]",
                        t.expression) +
                  behind(m));
    line("MoveAbsJ " +
         (t.role == RMP_ROLE_JOINT ? text(t.expression) : "RmpJoints(" + text(t.expression) + ")") +
         behind(m));
  }
  /// The input that a condition asks for; nothing = it is another condition.
  std::optional<Signal> searched(std::uint32_t e) const {
    const auto& x = expression(e);
    if (x.op == RMP_EXPR_EQUAL) {
      const auto of = links(x.first, x.count);
      if (known(of[1]) == 1.0) return searched(of[0]);
      return std::nullopt;
    }
    if (x.op != RMP_EXPR_SYMBOL || x.symbol == RMP_NONE ||
        symbol(x.symbol).kind != RMP_SYMBOL_INPUT || symbol(x.symbol).type != RMP_TYPE_BOOL ||
        signal(x.symbol).kind == "shared")
      return std::nullopt;
    return signal(x.symbol);
  }
  bool until_is_said(const Motion& m) {
    if (m.until == RMP_NONE) return true;
    cannot("motions of this kind that end on a condition",
           "A straight motion may end on an input (UNTIL part_here).");
    return false;
  }
  void lin(const Motion& m) override {
    common(m);
    places(m);
    if (m.until != RMP_NONE) {
      const auto s = searched(m.until);
      if (!s || m.incremental) {
        (void)until_is_said(m);
        return;
      }
      if (!std::exchange(searches_, true)) data_.add("VAR robtarget RmpHit;", &at_);
      in_search_ = true;
      // A soft stop: \Stop is for speeds below 100 mm/s. \LowLevel ends at once where the signal
      // is low already, as the search without a switch does where it is high; \NegFlank does not.
      line("SearchL\\SStop," + signal_word(*s) + (s->inverted ? "\\LowLevel" : "") + ",RmpHit," +
           target(m.targets[0]) + "," + speed(m) + ",RmpTool\\WObj:=RmpFrame;");
      if (m.action != RMP_NONE) {
        open("IF " + text(m.until) + " THEN");
        line(routine_name(m.action) + ";");
        close("ENDIF");
      }
      return;
    }
    if (m.incremental) return increment(m, "MoveL");
    line("MoveL " + target(m.targets[0]) + behind(m));
  }
  void circle(const Motion& m) override {
    common(m);
    places(m);
    if (!until_is_said(m)) return;
    if (m.incremental) return cannot("incremental circles", "Give both points in the base frame.");
    if (m.targets.size() != 2) return fail("a circle has two targets");
    const std::string via = target(m.targets[0]);
    line("MoveC " + via + "," + target(m.targets[1]) + behind(m));
  }

  static constexpr const char* kNowhere = "[[0,0,0],[1,0,0,0]]";
  std::optional<Pose> common_tool_, common_frame_;  ///< of all motions, in the declarations
  post::File body_, data_, points_;
  post::Points table_;
  std::vector<std::string> point_names_;
  std::string tool_text_, tail_;
  post::Modal<std::string> acc_, at_tool_, at_frame_;
  bool searches_ = false, in_search_ = false;
  bool changed_acc_ = false, passed_ = false, other_tool_ = false, other_frame_ = false,
       has_flag_ = false;
  std::set<std::string> shared_;  ///< variables of all tasks
};

}  // namespace

const PostCapabilities& Rapid::capabilities() const { return capabilities_of(); }

Result<void> Rapid::write(const PostTask& task, const Params&, PostOutput& output,
                          Progress& progress) const {
  return RapidWriter(task, output, progress).run();
}

}  // namespace robomosp::posts

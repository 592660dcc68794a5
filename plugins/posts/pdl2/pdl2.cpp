// SPDX-License-Identifier: Apache-2.0
#include "pdl2.h"

#include <memory>
#include <set>
#include <string>

#include "../brand/brand_writer.h"

namespace robomosp::post::pdl2 {
namespace {

const PostCapabilities& pdl2_capabilities() {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
                 kPostRecursion | kPostLocals | kPostIntegers | kPostReals | kPostBooleans |
                 kPostStrings | kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct |
                 kPostFunctionsOfMath | kPostIf | kPostElsif | kPostWhile | kPostRepeat |
                 kPostLoop | kPostFor | kPostForStep | kPostCase | kPostGoto | kPostReturn |
                 kPostWaitFor | kPostWaitTimeout | kPostUntil | kPostVariableTargets |
                 kPostVariableAttributes | kPostMessages | kPostPause | kPostOutputsAreRead |
                 kPostTools | kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostLinIncrement |
                kPostPtpIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::distance;
    c.speed = PostSpeed::m_per_s;
    c.external_axes = 4;
    c.max_name = 32;
    c.name_case = PostCase::lower;
    c.reserved =
        "abs acos activate advance and array asin at atan2 attach begin boolean by call cancel "
        "case "
        "circular close condition connect const cos cycle deactivate default delay detach disable "
        "div "
        "do downto else elsif enable end endcondition endfor endif endmove endselect endtry "
        "endwhile "
        "error event exit exp exported false file for from global goto hand hold if import in "
        "integer "
        "joint jointpos linear ln lock mod move movefly near node nodefault not of off on open or "
        "path "
        "pause pos pos_inv position pulse purge read real record relative relax release repeat "
        "resume "
        "return round routine select semaphore signal sin sqrt step stop str_len string sync tan "
        "then "
        "til time to true trunc try type unlock until unpause var vec vector via wait when while "
        "with "
        "write xor xtndpos";
    c.extensions = "pdl";
    c.title = "PDL2";
    return c;
  }();
  return kAll;
}

class Pdl2Writer final : public brand::BrandWriter {
 public:
  Pdl2Writer(const PostTask& t, PostOutput& o, Progress& p)
      : BrandWriter(t, o, pdl2_capabilities(), p) {}

 private:
  using Kind = brand::Kind;
  struct Routine {
    File head{2}, variables{2}, code{2};
  };

  static std::string type_of(Kind k) {
    switch (k) {
      case Kind::integer: return "INTEGER";
      case Kind::real: return "REAL";
      case Kind::boolean: return "BOOLEAN";
      case Kind::string: return "STRING[127]";
      default: return "POSITION";
    }
  }
  std::string position(const Pose& p, const std::string& configuration = "") {
    const Placed x = placed(p, Orientation::zyz);
    std::string out = "POS(";
    for (std::size_t i = 0; i < 3; ++i) out += length(x.mm[i]) + ", ";
    for (std::size_t i = 0; i < 3; ++i) out += angle(x.ori[i]) + ", ";
    return out + "'" + configuration + "')";
  }

  // ---- program ----
  void begin() override {
    main_.head.add(
        "PROGRAM " + routine_name(0) + " PROG_ARM = " + trimmed(number_option("arm", 1), 0), &at_);
  }
  void routine_begin(std::uint32_t r) override {
    const auto k = routine(r).kind;
    refuse_beside(r);
    Routine& p = r == 0 ? main_ : routines_.emplace_back();
    now_ = &p;
    out_ = &p.code;
    p.variables.in();
    if (r != 0) {
      std::string all;
      if (check_parameters(r))
        for (std::uint32_t i = 0; i < routine(r).parameter_count; ++i) {
          const std::uint32_t s = parameter(r, i);
          // A parameter of strings takes any length.
          const Kind of = kind(symbol(s).type);
          all += (i ? "; " : "") + leaf_name(s, "", of) + " : " +
                 (of == Kind::string ? "STRING" : type_of(of));
        }
      std::string result;
      if (k == RMP_ROUTINE_FUNCTION) {
        if (kind(routine(r).result) == Kind::none)
          cannot("functions of " + type_name(routine(r).result));
        result =
            " : " + (kind(routine(r).result) == Kind::string ? std::string("STRING")
                                                             : type_of(kind(routine(r).result)));
      }
      p.head.add("ROUTINE " + routine_name(r) + (all.empty() ? "" : "(" + all + ")") + result,
                 &at_);
    }
    open("BEGIN");
    if (r != 0) return;
    for (const std::string_view l : lines_of(profile_.prologue)) out_->add(l);
    for (const char* l : {"$ORNT_TYPE := RS_WORLD", "$TURN_CARE := FALSE", "$SING_CARE := FALSE",
                          "$SPD_OPT := SPD_LIN", "$TERM_TYPE := COARSE", "$FLY_TYPE := FLY_CART",
                          "$FLY_TRAJ := FLY_PASS"})
      line(l);
  }
  void declare_leaf(const std::string& n, Kind k, const std::vector<brand::Bounds>& b,
                    std::uint32_t) override {
    std::string dimensions;
    for (const brand::Bounds& x : b)
      dimensions += (dimensions.empty() ? "" : ", ") + std::to_string(x.size());
    now_->variables.add(n + " : " + (b.empty() ? "" : "ARRAY[" + dimensions + "] OF ") + type_of(k),
                        &at_);
  }
  int most_dimensions() const override { return 2; }
  void routine_code(std::uint32_t) override { set_initial(); }
  void routine_end(std::uint32_t r) override {
    if (r == 0)
      for (const std::string_view l : lines_of(profile_.epilogue)) out_->add(l);
    close("END " + routine_name(r));
  }
  void forget() override {
    tool_.forget();
    frame_.forget();
    care_.forget();
  }
  void finish() override {
    File all{2};
    all.append(main_.head);
    const auto variables = [&](const Routine& r) {
      if (r.variables.empty()) return;
      all.add("VAR");
      all.append(r.variables);
    };
    variables(main_);
    for (const Routine& r : routines_) {
      all.append(r.head);
      variables(r);
      all.append(r.code);
    }
    all.append(main_.code);
    all.give(output_, routine_name(0) + ".pdl", false);
  }

  // ---- words ----
  [[nodiscard]] std::span<const Operator> operators() const override {
    // AND binds as *, OR as +, and comparisons below them.
    static constexpr Operator kAll[] = {{RMP_EXPR_EQUAL, " = ", 3},
                                        {RMP_EXPR_NOT_EQUAL, " <> ", 3},
                                        {RMP_EXPR_LESS, " < ", 3},
                                        {RMP_EXPR_LESS_EQUAL, " <= ", 3},
                                        {RMP_EXPR_GREATER, " > ", 3},
                                        {RMP_EXPR_GREATER_EQUAL, " >= ", 3},
                                        {RMP_EXPR_OR, " OR ", 5},
                                        {RMP_EXPR_EXOR, " XOR ", 5},
                                        {RMP_EXPR_ADD, " + ", 5},
                                        {RMP_EXPR_SUBTRACT, " - ", 5},
                                        {RMP_EXPR_AND, " AND ", 6},
                                        {RMP_EXPR_MULTIPLY, " * ", 6},
                                        {RMP_EXPR_DIVIDE, " / ", 6},
                                        {RMP_EXPR_DIV, " DIV ", 6},
                                        {RMP_EXPR_MOD, " MOD ", 6},
                                        {RMP_EXPR_NEGATE, "-", 8, Operator::prefix},
                                        {RMP_EXPR_NOT, "NOT ", 8, Operator::prefix}};
    return kAll;
  }
  Text string_literal(std::string_view s) override { return quoted(s, '\''); }
  std::string function(std::string_view n) override {
    static constexpr std::pair<const char*, const char*> kAll[] = {
        {"SIN", "SIN"},       {"COS", "COS"},     {"TAN", "TAN"},     {"ASIN", "ASIN"},
        {"ACOS", "ACOS"},     {"ATAN2", "ATAN2"}, {"SQRT", "SQRT"},   {"EXP", "EXP"},
        {"LN", "LN"},         {"ABS", "ABS"},     {"ROUND", "ROUND"}, {"TRUNC", "TRUNC"},
        {"LENGTH", "STR_LEN"}};
    for (const auto& [irl, there] : kAll)
      if (n == irl) return there;
    return "";
  }
  std::string transform(const Pose& p) override { return position(p); }
  std::string translation(const std::string& x, const std::string& y,
                          const std::string& z) override {
    return "POS(" + x + ", " + y + ", " + z + ", 0, 0, 0, '')";
  }
  std::string rotation(std::size_t axis, const std::string& d) override {
    // Turns about z, y, z: one about x is between two of 90 degrees.
    if (axis == 0) return "POS(0, 0, 0, -90, " + d + ", 90, '')";
    if (axis == 1) return "POS(0, 0, 0, 0, " + d + ", 0, '')";
    return "POS(0, 0, 0, " + d + ", 0, 0, '')";
  }
  Text product(const Text& a, const Text& b) override {
    return {"(" + a.text + " : " + b.text + ")"};
  }
  Text inverse_of(const Text& a) override { return {"POS_INV(" + a.text + ")"}; }
  std::string component(const std::string& of, std::size_t axis) override {
    if (of.empty() || of[0] == '(' || of.back() == ')') {
      cannot("parts of a computed position", "Keep it in a variable first.");
      return "0";
    }
    return of + "." + "XYZ"[axis];
  }
  void set_component(const std::string& of, std::size_t axis, const std::string& to) override {
    line(of + "." + "XYZ"[axis] + " := " + to);
  }
  std::string element(const std::string& n, const std::vector<std::string>& i,
                      const std::vector<brand::Bounds>& b) override {
    return n + "[" + counted(i, b, 1) + "]";
  }
  void assign_text(const std::string& to, Kind, const std::string& value) override {
    line(to + " := " + value);
  }

  // ---- statements ----
  bool has_functions() const override { return true; }
  std::string call_line(const std::string& n, const std::string& arguments) override {
    return n + (arguments.empty() ? "" : "(" + arguments + ")");
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    if (routine(r).kind == RMP_ROUTINE_FUNCTION)
      cannot("calls of functions as statements", "Assign the value to a variable.");
    line(call_line(routine_name(r), by_mode(r, arguments)));
  }
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    return {routine_name(r) + (arguments.empty() ? "" : "(" + by_mode(r, arguments) + ")")};
  }
  /// Variables are passed by reference, and their types must be those of the parameters; in extra
  /// parentheses they are passed by value.
  std::string by_mode(std::uint32_t r, std::span<const std::uint32_t> arguments) {
    std::string out;
    for (std::size_t k = 0; k < arguments.size(); ++k) {
      const auto p = parameter(r, static_cast<std::uint32_t>(k));
      std::uint32_t e = arguments[k];
      while (expression(e).op == RMP_EXPR_CONVERT && expression(e).constant == RMP_NONE)
        e = links(expression(e).first, expression(e).count)[0];
      const bool by_value = symbol(p).mode == RMP_MODE_IN && expression(e).constant == RMP_NONE &&
                            place(e).has_value();
      const std::string t = text(arguments[k]);
      out += (k ? ", " : "") + (by_value ? "(" + t + ")" : t);
    }
    return out;
  }
  void if_begin(std::uint32_t c) override { open("IF " + text(c) + " THEN"); }
  void else_if(std::uint32_t c) override { middle("ELSIF " + text(c) + " THEN"); }
  void else_() override { middle("ELSE"); }
  void if_end() override { close("ENDIF"); }
  void while_begin(std::uint32_t c) override { open("WHILE " + text(c) + " DO"); }
  void while_end() override { close("ENDWHILE"); }
  void repeat_begin() override { open("REPEAT"); }
  void repeat_end(std::uint32_t until) override { close("UNTIL " + text(until)); }
  void loop_begin() override { open("WHILE TRUE DO"); }
  void loop_end() override { close("ENDWHILE"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    open("FOR " + leaf_name(s, "", Kind::integer) + " := " + text(from) +
         (down ? " DOWNTO " : " TO ") + text(to) + (step == RMP_NONE ? "" : " STEP " + text(step)) +
         " DO");
  }
  void for_end(std::uint32_t) override { close("ENDFOR"); }
  void case_begin(std::uint32_t selector) override { open("SELECT " + text(selector) + " OF"); }
  void case_when(std::span<const std::uint32_t> labels) override {
    middle("CASE (" + list(labels) + "):");
  }
  void case_default() override { middle("ELSE:"); }
  void case_end() override { close("ENDSELECT"); }
  void go_to(std::uint32_t s) override { line("GOTO " + name(s)); }
  void label(std::uint32_t s) override { line(name(s) + "::"); }
  void return_(std::uint32_t value) override {
    line(value == RMP_NONE ? "RETURN" : "RETURN(" + text(value) + ")");
  }
  std::string milliseconds(std::uint32_t seconds) {
    if (const auto k = known(seconds)) return number(*k * 1000, 0);
    return "ROUND(" + within(expr(seconds), 6) + " * 1000)";
  }
  void wait_time(std::uint32_t seconds) override {
    warn_of_rounding(seconds);
    line("DELAY " + milliseconds(seconds));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool keeps = flag != RMP_NONE && is_used(flag);
    if (timeout == RMP_NONE) {
      if (is_of_signals_only(c)) {
        line("WAIT FOR " + text(c));
      } else {
        // Events are of ports and of variables that all programs see.
        open("REPEAT");
        line("DELAY 1");
        close("UNTIL " + text(c));
      }
      if (keeps) line(leaf_name(flag, "", Kind::boolean) + " := FALSE");
      return;
    }
    const std::string timer = "$TIMER[" + trimmed(number_option("timer", 1), 0) + "]";
    line(timer + " := 0");
    open("REPEAT");
    line("DELAY 1");
    close("UNTIL (" + text(c) + ") OR (" + timer + " >= " + milliseconds(timeout) + ")");
    if (keeps)
      line(leaf_name(flag, "", Kind::boolean) + " := " + timer + " >= " + milliseconds(timeout));
  }
  void pause(std::uint32_t m) override {
    if (m != RMP_NONE) line("WRITE (" + text(m) + ", NL)");
    line("PAUSE");
  }
  void halt() override { line("DEACTIVATE " + routine_name(0)); }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    auto given = message_text(values, ", ");
    if (!given) return;
    std::string all = std::move(*given);
    if (ends_line) all += all.empty() ? "NL" : ", NL";
    line("WRITE (" + all + ")");
  }

  // ---- signals ----
  /// A variable shared by the programs of several robots, in place of a line between them. It
  /// belongs to the program that assigns it.
  bool is_shared(const Signal& s) {
    if (s.kind != "shared") return false;
    const bool is_bool = s.type == RMP_TYPE_BOOL;
    if (shared_.insert(s.target).second)
      main_.variables.add(s.target + " : " + (is_bool ? "BOOLEAN" : "INTEGER") +
                              (s.is_output ? is_bool ? " (FALSE)" : " (0)" : "") +
                              " EXPORTED FROM " +
                              (s.is_output ? routine_name(0) : lower(option("shared_with"))),
                          &at_);
    return true;
  }
  Text port(const Signal& s) {
    if (is_shared(s)) return {s.target};
    if (s.type == RMP_TYPE_REAL) {
      cannot("analog signals in physical units", "Use an INT, and scale it in the program.");
      return {};
    }
    if (!s.target.empty()) return {s.target};
    const bool is_group = s.type == RMP_TYPE_INT;
    if (is_group)
      note("the bits of an INT are port " + std::to_string(s.number) + " of the groups",
           "Set the group up on the controller.");
    return {std::string("$") + (is_group ? "G" : "D") + (s.is_output ? "OUT[" : "IN[") +
            std::to_string(s.number) + "]"};
  }
  Text signal_text(const Signal& s) {
    const Text p = port(s);
    return s.inverted && s.type == RMP_TYPE_BOOL ? Text{"NOT " + p.text, 8} : p;
  }
  Text input(const Signal& s) override { return signal_text(s); }
  Text output(const Signal& s) override { return signal_text(s); }
  void set_output(const Signal& s, std::uint32_t value) override {
    const std::string p = port(s).text;
    if (s.kind == "shared") return line(p + " := " + text(value));
    if (s.type == RMP_TYPE_BOOL)
      if (const auto b = constant_bool(value, s.inverted)) {
        line(p + (*b ? " := ON" : " := OFF"));
        return;
      }
    const Text v = expr(value);
    line(p + " := " + (s.inverted && s.type == RMP_TYPE_BOOL ? "NOT " + within(v, 8) : v.text));
  }

  // ---- motions ----
  bool has_external() const override { return true; }
  bool has_speed_ori() const override { return true; }
  std::string configuration(const brand::Goal& g) {
    if (!g.point || g.point->status_known == 0) return "";
    if (!g.point->q.empty()) axes_are_needed();
    std::string out;
    static constexpr struct {
      std::uint32_t bit;
      char letter;
    } kBits[] = {{kPostShoulderBehind, 'S'}, {kPostElbowOther, 'E'}, {kPostWristFlipped, 'W'}};
    for (const auto& b : kBits)
      if (g.point->status & g.point->status_known & b.bit)
        out += (out.empty() ? "" : " ") + std::string(1, b.letter);
    return out;
  }
  void system_place(const char* variable, const brand::Placing& x, Modal<std::string>& modal) {
    const std::string v = !x.text.empty() ? x.text : position(x.pose.value_or(Pose{}));
    if (modal.changes(v) || !x.text.empty()) line(std::string(variable) + " := " + v);
  }
  std::string per_thousand(const brand::Number& n, int digits) {
    return n.known ? number(*n.known / 1000, digits) : "(" + n.text + ") / 1000";
  }
  void write_move(const Motion& m, const brand::Move& x) override {
    system_place("$TOOL", x.tool, tool_);
    system_place("$UFRAME", x.frame, frame_);
    const bool cares = std::any_of(x.goals.begin(), x.goals.end(), [](const brand::Goal& g) {
      return !g.is_joints && g.point && g.point->status_known != 0;
    });
    if (care_.changes(cares)) line(std::string("$CNFG_CARE := ") + (cares ? "TRUE" : "FALSE"));
    std::vector<std::string> with;
    if (x.is_ptp) with.push_back("$PROG_SPD_OVR = " + shown(x.speed, 0));
    else with.push_back("$LIN_SPD = " + per_thousand(x.speed, profile_.speed_digits + 3));
    if (x.is_ptp && x.speed.known && *x.speed.known != std::round(*x.speed.known))
      note("the speed percentage is rounded to whole %");
    if (!x.is_ptp && m[RMP_ATTR_SPEED_ORI].given)
      with.push_back("$ROT_SPD = " + (x.speed_ori.known ? number(*x.speed_ori.known / kDegree, 6)
                                                        : "(" + x.speed_ori.text + ") / 57.29578"));
    if (!x.acc.known || *x.acc.known != 100) {
      with.push_back("$PROG_ACC_OVR = " + shown(x.acc, 0));
      with.push_back("$PROG_DEC_OVR = " + shown(x.acc, 0));
    }
    if (x.passes) with.push_back("$FLY_DIST = " + shown(blend_mm(x), profile_.length_digits));
    std::vector<std::string> goals;
    for (const brand::Goal& g : x.goals) {
      if (x.incremental) {
        const Vec3& d = g.pose->p;
        goals.push_back("RELATIVE VEC(" + length(d[0] * 1000) + ", " + length(d[1] * 1000) + ", " +
                        length(d[2] * 1000) + ") IN " +
                        (x.frame.text.empty() && is_identity(x.frame.pose.value_or(Pose{}))
                             ? "BASE"
                             : "UFRAME"));
        continue;
      }
      if (g.is_joints) {
        std::string v;
        for (const double a : g.axes) v += (v.empty() ? "" : ", ") + angle(a);
        for (const double a : g.external) v += ", " + number(a, profile_.angle_digits);
        goals.push_back("TO {" + v + "}");
        continue;
      }
      std::string p = g.pose ? position(*g.pose, configuration(g)) : g.text;
      if (!g.external.empty()) {
        if (x.goals.size() > 1) {
          cannot("circles with external axes", "Remove the additional joints from the targets.");
          return;
        }
        extended(p, g);
        p = extended_;
      }
      goals.push_back("TO " + p);
    }
    std::string s = x.passes ? "MOVEFLY " : "MOVE ";
    if (x.goals.size() == 2) s += "CIRCULAR " + goals[1] + " VIA " + goals[0].substr(3);
    else s += (x.is_ptp ? (x.goals[0].is_joints ? "" : "JOINT ") : "LINEAR ") + goals[0];
    if (x.passes) s += " ADVANCE";
    if (m.until != RMP_NONE) {
      if (!is_of_signals_only(m.until)) {
        fail("PDL2 can end motions early on signals only",
             "Write UNTIL with inputs and constants.");
        return;
      }
      s += " TIL " + text(m.until);
    }
    for (std::size_t k = 0; k < with.size(); ++k) s += (k ? ", " : " WITH ") + with[k];
    line(s);
    if (m.until == RMP_NONE || m.action == RMP_NONE) return;
    open("IF " + text(m.until) + " THEN");
    line(routine_name(m.action));
    close("ENDIF");
  }
  void extended(const std::string& p, const brand::Goal& g) {
    if (extended_.empty()) {
      extended_ = names_.unique("p_aux");
      main_.variables.add(extended_ + " : XTNDPOS");
    }
    line(extended_ + ".POS := " + p);
    for (std::size_t k = 0; k < g.external.size(); ++k)
      line(extended_ + ".AUX[" + std::to_string(k + 1) +
           "] := " + number(g.external[k], profile_.angle_digits));
  }

  Routine main_;
  std::set<std::string> shared_;  ///< variables of all programs
  std::deque<Routine> routines_;
  Routine* now_ = nullptr;
  std::string extended_;
  Modal<std::string> tool_, frame_;
  Modal<bool> care_;
};

}  // namespace

const PostCapabilities& Pdl2::capabilities() const { return pdl2_capabilities(); }

Result<void> Pdl2::write(const PostTask& task, const Params&, PostOutput& output,
                         Progress& progress) const {
  return Pdl2Writer(task, output, progress).run();
}

}  // namespace robomosp::post::pdl2

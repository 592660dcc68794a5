// SPDX-License-Identifier: Apache-2.0
#include "pacscript.h"

#include <memory>

#include "../brand/brand_writer.h"

namespace robomosp::post::pacscript {
namespace {

const PostCapabilities& pacscript_capabilities() {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostFunctions | kPostParameters | kPostOutParameters |
                 kPostLocals | kPostIntegers | kPostReals | kPostBooleans | kPostStrings |
                 kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostFunctionsOfMath |
                 kPostIf | kPostElsif | kPostWhile | kPostRepeat | kPostLoop | kPostExit |
                 kPostFor | kPostForStep | kPostCase | kPostGoto | kPostReturn | kPostWaitFor |
                 kPostWaitTimeout | kPostVariableTargets | kPostMessages | kPostPause |
                 kPostOutputsAreRead | kPostTools | kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostLinIncrement |
                kPostPtpIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::distance;
    c.speed = PostSpeed::percent;
    c.external_axes = 2;
    c.max_name = 32;
    c.crlf = true;
    c.reserved =
        "abs accel acos and as asin atn atn2 boolean byref byval call case changetool changework "
        "cos "
        "curpos decel delay dev devh dim do double else elseif end exa exit exp false fig fix for "
        "function givearm goto halt hold if in int integer io iob j joint len letx lety letz log "
        "long "
        "loop main mod move next not off on or out p p2t position posx posy posz printdbg reset "
        "run "
        "select set sin single speed sqr step string sub suspend t t2p takearm tan then tinv to "
        "tool "
        "trans true until vector wait while work xor";
    c.extensions = "pcs";
    c.title = "PacScript";
    return c;
  }();
  return kAll;
}

class PacWriter final : public brand::BrandWriter {
 public:
  PacWriter(const PostTask& t, PostOutput& o, Progress& p)
      : BrandWriter(t, o, pacscript_capabilities(), p) {}

 private:
  using Kind = brand::Kind;
  struct Procedure {
    File head{2}, code{2};
  };

  static const char* type_of(Kind k) {
    switch (k) {
      case Kind::integer: return "Long";
      case Kind::real: return "Double";
      case Kind::boolean: return "Boolean";
      case Kind::string: return "String";
      default: return "Position";
    }
  }
  std::string numbers(const Pose& p) {
    const std::string_view how = option("orientation", "fixed_xyz");
    if (how != "fixed_xyz" && how != "xyz" && how != "zyz" && !told_)
      fail("the profile's option orientation is \"" + std::string(how) + "\"",
           "It is fixed_xyz, xyz or zyz.");
    told_ = true;
    const Placed x = placed(p, how == "xyz"   ? Orientation::xyz
                               : how == "zyz" ? Orientation::zyz
                                              : Orientation::fixed_xyz);
    std::string out;
    for (std::size_t i = 0; i < 3; ++i) out += (i ? ", " : "") + length(x.mm[i]);
    for (std::size_t i = 0; i < 3; ++i) out += ", " + angle(x.ori[i]);
    return out;
  }

  // ---- program ----
  void begin() override { main_.head.add("'!TITLE \"" + routine_name(0) + "\""); }
  void routine_begin(std::uint32_t r) override {
    result_.clear();
    const auto k = routine(r).kind;
    refuse_beside(r);
    Procedure& p = r == 0 ? main_ : procedures_.emplace_back();
    now_ = &p;
    out_ = &p.code;
    if (r == 0) {
      out_->add("");
      open("Sub Main");
      for (const std::string_view l : lines_of(profile_.prologue)) out_->add(l);
      line("TakeArm Keep = 0");
      return;
    }
    std::string all;
    if (check_parameters(r))
      for (std::uint32_t i = 0; i < routine(r).parameter_count; ++i) {
        const std::uint32_t s = parameter(r, i);
        all += std::string(i ? ", " : "") + (symbol(s).mode == RMP_MODE_IN ? "ByVal " : "ByRef ") +
               leaf_name(s, "", kind(symbol(s).type)) + " As " + type_of(kind(symbol(s).type));
      }
    p.head.add("");
    if (k == RMP_ROUTINE_FUNCTION) {
      if (kind(routine(r).result) == Kind::none)
        cannot("functions of " + type_name(routine(r).result));
      p.head.add(
          "Function " + routine_name(r) + "(" + all + ") As " + type_of(kind(routine(r).result)),
          &at_);
    } else {
      p.head.add("Sub " + routine_name(r) + "(" + all + ")", &at_);
    }
    p.head.in();
    out_->in();
  }
  void declare_leaf(const std::string& n, Kind k, const std::vector<brand::Bounds>& b,
                    std::uint32_t) override {
    std::string dimensions;
    for (const brand::Bounds& x : b)
      dimensions += (dimensions.empty() ? "" : ", ") + std::to_string(x.size());
    now_->head.add("Dim " + n + (b.empty() ? "" : "(" + dimensions + ")") + " As " + type_of(k),
                   &at_);
  }
  int most_dimensions() const override { return 3; }
  void routine_code(std::uint32_t) override { set_initial(); }
  void routine_end(std::uint32_t r) override {
    if (r == 0) {
      for (const std::string_view l : lines_of(profile_.epilogue)) out_->add(l);
      line("GiveArm");
    }
    close(routine(r).kind == RMP_ROUTINE_FUNCTION ? "End Function" : "End Sub");
  }
  void forget() override {
    tool_.forget();
    work_.forget();
  }
  void finish() override {
    File all{2};
    all.append(main_.head);
    all.append(main_.code);
    for (const Procedure& p : procedures_) {
      all.append(p.head);
      all.append(p.code);
    }
    all.give(output_, routine_name(0) + ".pcs", true);
  }

  // ---- words ----
  [[nodiscard]] std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {{RMP_EXPR_OR, " Or ", 1},
                                        {RMP_EXPR_EXOR, " Xor ", 0},
                                        {RMP_EXPR_AND, " And ", 2},
                                        {RMP_EXPR_EQUAL, " = ", 4},
                                        {RMP_EXPR_NOT_EQUAL, " <> ", 4},
                                        {RMP_EXPR_LESS, " < ", 4},
                                        {RMP_EXPR_LESS_EQUAL, " <= ", 4},
                                        {RMP_EXPR_GREATER, " > ", 4},
                                        {RMP_EXPR_GREATER_EQUAL, " >= ", 4},
                                        {RMP_EXPR_ADD, " + ", 5},
                                        {RMP_EXPR_SUBTRACT, " - ", 5},
                                        {RMP_EXPR_MOD, " Mod ", 6},
                                        {RMP_EXPR_DIV, " \\ ", 7},
                                        {RMP_EXPR_MULTIPLY, " * ", 8},
                                        {RMP_EXPR_DIVIDE, " / ", 8},
                                        {RMP_EXPR_NEGATE, "-", 9, Operator::prefix},
                                        {RMP_EXPR_NOT, "Not", 10, Operator::call}};
    return kAll;
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL)
      return {k.integer ? "True" : "False"};
    return BrandWriter::literal(k);
  }
  std::string zero(Kind k) override { return k == Kind::boolean ? "False" : BrandWriter::zero(k); }
  Text string_literal(std::string_view s) override { return quoted(s, '"'); }
  std::string function(std::string_view n) override {
    static constexpr std::pair<const char*, const char*> kAll[] = {
        {"SIN", "Sin"},   {"COS", "Cos"},  {"TAN", "Tan"},    {"ASIN", "Asin"},
        {"ACOS", "Acos"}, {"ATAN", "Atn"}, {"ATAN2", "Atn2"}, {"SQRT", "Sqr"},
        {"EXP", "Exp"},   {"LN", "Log"},   {"ABS", "Abs"},    {"LENGTH", "Len"}};
    for (const auto& [irl, there] : kAll)
      if (n == irl) return there;
    return "";
  }
  std::string transform(const Pose& p) override { return "P(" + numbers(p) + ", -1)"; }
  std::string translation(const std::string& x, const std::string& y,
                          const std::string& z) override {
    return "P(" + x + ", " + y + ", " + z + ", 0, 0, 0, -1)";
  }
  std::string rotation(std::size_t axis, const std::string& d) override {
    // For a single axis all conventions agree, except rotations about z, y, z.
    if (option("orientation") == "zyz") {
      if (axis == 0) return "P(0, 0, 0, -90, " + d + ", 90, -1)";
      return axis == 1 ? "P(0, 0, 0, 0, " + d + ", 0, -1)" : "P(0, 0, 0, " + d + ", 0, 0, -1)";
    }
    std::string out = "P(0, 0, 0";
    for (std::size_t i = 0; i < 3; ++i) out += ", " + (i == axis ? d : "0");
    return out + ", -1)";
  }
  Text product(const Text& a, const Text& b) override {
    return {"DevH(" + a.text + ", " + b.text + ")"};
  }
  Text inverse_of(const Text& a) override { return {"T2P(TInv(P2T(" + a.text + ")))"}; }
  std::string component(const std::string& of, std::size_t axis) override {
    return std::string("Pos") + "XYZ"[axis] + "(" + of + ")";
  }
  void set_component(const std::string& of, std::size_t axis, const std::string& to) override {
    line(std::string("Let") + "XYZ"[axis] + " " + of + " = " + to);
  }
  std::string element(const std::string& n, const std::vector<std::string>& i,
                      const std::vector<brand::Bounds>& b) override {
    return n + "(" + counted(i, b, 0) + ")";
  }
  void assign_text(const std::string& to, Kind, const std::string& value) override {
    line(to + " = " + value);
  }

  // ---- statements ----
  bool has_functions() const override { return true; }
  std::string temporary(Kind k) override {
    const std::string n = names_.unique("part");
    now_->head.add("Dim " + n + " As " + type_of(k), &at_);
    return n;
  }
  std::string call_line(const std::string& n, const std::string& arguments) override {
    return "Call " + n + (arguments.empty() ? "" : "(" + arguments + ")");
  }
  void if_begin(std::uint32_t c) override {
    const std::string s = text(c);
    open("If " + s + " Then");
  }
  void else_if(std::uint32_t c) override { middle("ElseIf " + asked_again(c) + " Then"); }
  void else_() override { middle("Else"); }
  void if_end() override { close("End If"); }
  void loop_opens(const std::string& s, const char* kind) {
    open(s);
    loops_.push_back(kind);
  }
  void loop_closes(const std::string& s) {
    loops_.pop_back();
    close(s);
  }
  void while_begin(std::uint32_t c) override { loop_opens("Do While " + asked_again(c), "Do"); }
  void while_end() override { loop_closes("Loop"); }
  void repeat_begin() override { loop_opens("Do", "Do"); }
  void repeat_end(std::uint32_t until) override { loop_closes("Loop Until " + asked_again(until)); }
  void loop_begin() override { loop_opens("Do", "Do"); }
  void loop_end() override { loop_closes("Loop"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    loop_opens("For " + leaf_name(s, "", Kind::integer) + " = " +
                   range(from, to, step, down, " To ", " Step ", 9),
               "For");
  }
  void for_end(std::uint32_t s) override { loop_closes("Next " + leaf_name(s, "", Kind::integer)); }
  void exit_loop() override {
    line("Exit " + (loops_.empty() ? std::string("Do") : loops_.back()));
  }
  void case_begin(std::uint32_t selector) override { open("Select Case " + text(selector)); }
  void case_when(std::span<const std::uint32_t> labels) override { middle("Case " + list(labels)); }
  void case_default() override { middle("Case Else"); }
  void case_end() override { close("End Select"); }
  void go_to(std::uint32_t s) override { line("GoTo *" + name(s)); }
  void label(std::uint32_t s) override { line("*" + name(s) + ":"); }
  void return_(std::uint32_t value) override {
    const bool is_function = routine(in_routine_).kind == RMP_ROUTINE_FUNCTION;
    if (value != RMP_NONE) line(routine_name(in_routine_) + " = " + text(value));
    line(is_function ? "Exit Function" : "Exit Sub");
  }
  std::string milliseconds(std::uint32_t seconds) {
    if (const auto k = known(seconds)) return number(*k * 1000, 0);
    return within(expr(seconds), 8) + " * 1000";
  }
  void wait_time(std::uint32_t seconds) override {
    warn_of_rounding(seconds);
    line("Delay " + milliseconds(seconds));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool keeps = flag != RMP_NONE && is_used(flag);
    std::string s = "Wait " + asked_again(c);
    if (timeout != RMP_NONE) s += ", " + milliseconds(timeout);
    if (!keeps) {
      line(s);
      return;
    }
    const std::string f = leaf_name(flag, "", Kind::boolean);
    if (timeout == RMP_NONE) {
      line(s);
      line(f + " = False");
      return;
    }
    // The third argument receives whether the condition became true.
    line(s + ", " + f);
    line(f + " = Not(" + f + ")");
  }
  void pause(std::uint32_t m) override { line("Hold" + (m == RMP_NONE ? "" : " " + text(m))); }
  void halt() override { line("Halt"); }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    const auto all = message_text(values, "; ");
    if (!all) return;
    if (!ends_line) note("PacScript writes each message on a separate line");
    line("PrintDbg " + (all->empty() ? "\"\"" : *all));
  }

  // ---- signals ----
  static std::string bits(const Signal& s) {
    return "IO[" + std::to_string(s.number) + " To " + std::to_string(s.number + s.width - 1) + "]";
  }
  /// Inputs and outputs are one row of numbers there, and two in IRL.
  bool is_in_one_row(const Signal& s) {
    if (!is_numbered(s)) return false;
    for (std::int64_t n = s.number; n < s.number + std::max(s.width, 1); ++n) {
      const auto [it, is_new] = ios_.try_emplace(n, s.is_output, false);
      auto& [is_output, is_told] = it->second;
      if (is_output == s.is_output) continue;
      if (!std::exchange(is_told, true))
        fail("IO[" + std::to_string(n) +
                 "] would be an input and an output: PacScript numbers both in one sequence",
             "Give one of the two signals another number in the profile.");
      return false;
    }
    return true;
  }
  Text signal_text(const Signal& s) {
    if (!is_in_one_row(s)) return {};
    if (s.type == RMP_TYPE_INT) {
      if (!may_call_) {
        fail(
            "a signal of several bits cannot be posted in a condition that is evaluated repeatedly",
            "Assign it to a variable before, and at the end of the loop.");
        return {};
      }
      const std::string to = temporary(Kind::integer);
      line("In " + to + " = " + bits(s));
      return {to};
    }
    return {"IO[" + std::to_string(s.number) + "] = " + (s.inverted ? "Off" : "On"), 4};
  }
  Text input(const Signal& s) override { return signal_text(s); }
  Text output(const Signal& s) override { return signal_text(s); }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (!is_in_one_row(s)) return;
    const std::string v = text(value);
    const std::string io = "IO[" + std::to_string(s.number) + "]";
    if (s.type == RMP_TYPE_INT) {
      line("Out " + bits(s) + " = " + v);
      return;
    }
    if (const auto b = constant_bool(value, s.inverted)) {
      line((*b ? "Set " : "Reset ") + io);
      return;
    }
    open("If " + v + " Then");
    line((s.inverted ? "Reset " : "Set ") + io);
    middle("Else");
    line((s.inverted ? "Set " : "Reset ") + io);
    close("End If");
  }

  // ---- motions ----
  bool has_external() const override { return true; }
  int figure(const brand::Goal& g) {
    if (!g.point || (g.point->status_known & 7U) != 7U) return -1;
    if (!g.point->q.empty()) axes_are_needed();
    // An arm in front of its first axis with the elbow up and the wrist not flipped has 5.
    auto out = static_cast<int>((g.point->status & 7U) ^
                                (static_cast<unsigned>(number_option("fig_xor", 5)) & 7U));
    // Joints 4 and 6 more than half a turn away (DOUBLE).
    for (const std::size_t i : {std::size_t{3}, std::size_t{5}}) {
      const std::int32_t turn = axis_turn(*g.point, i).value_or(0);
      if (turn < -1 || turn > 1)
        warn("axis " + std::to_string(i + 1) +
                 " would be more than one and a half turns away, and a figure allows one",
             "Move to joints (MAIN_JOINT) where the turn matters.");
      if (turn != 0) out |= i == 3 ? 8 : 16;
    }
    return out;
  }
  void place(const char* set, const char* change, const brand::Placing& x,
             Modal<std::string>& modal, std::int32_t profile_number,
             std::span<const PostPlace> places) {
    if (x.text.empty() && (!x.pose || is_identity(*x.pose))) {
      if (modal.changes("0")) line(std::string(change) + " 0");
      return;
    }
    std::int32_t n = 1;
    if (profile_number >= 0 && static_cast<std::size_t>(profile_number) < places.size() &&
        places[static_cast<std::size_t>(profile_number)].number > 0)
      n = places[static_cast<std::size_t>(profile_number)].number;
    const std::string value = x.text.empty() ? "P(" + numbers(*x.pose) + ")" : x.text;
    if (!modal.changes(value) && x.text.empty()) return;
    line(std::string(set) + " " + std::to_string(n) + ", " + value);
    line(std::string(change) + " " + std::to_string(n));
  }
  void write_move(const Motion& m, const brand::Move& x) override {
    if (m.until != RMP_NONE) {
      cannot("motions that end early (UNTIL)", "Move in steps, and test the signal between them.");
      return;
    }
    std::string speed;
    if (x.is_ptp) {
      speed = shown(x.speed, profile_.speed_digits);
    } else {
      if (!(profile_.max_speed > 0)) {
        fail("PacScript speeds are percentages of the maximum, which the profile does not set",
             "Give max_speed [mm/s] in the profile.");
        return;
      }
      speed = x.speed.known ? number(*x.speed.known / profile_.max_speed * 100,
                                     std::max(profile_.speed_digits, 5))
                            : "(" + x.speed.text + ") * " + plain(100 / profile_.max_speed);
    }
    place("Tool", "ChangeTool", x.tool, tool_, profile_.tool, profile_.tools);
    place("Work", "ChangeWork", x.frame, work_, profile_.frame, profile_.frames);
    std::string arrive = "@0 ";
    if (x.passes) {
      const brand::Number mm = blend_mm(x);
      if (mm.known && *mm.known < 1)
        note("blending below 1 mm is posted as @P, the controller's default");
      if (!mm.known)
        warn("blending computed at run time is posted as @P, the controller's default");
      else if (*mm.known != std::round(*mm.known) && *mm.known >= 1)
        note("the blending distance is rounded to whole mm");
      arrive = mm.known && *mm.known >= 1 ? "@" + number(*mm.known, 0) + " " : "@P ";
    }
    std::vector<std::string> goals;
    for (const brand::Goal& g : x.goals) {
      if (x.incremental) {
        const Vec3& d = g.pose->p;
        goals.push_back("Dev(CurPos, P(" + length(d[0] * 1000) + ", " + length(d[1] * 1000) + ", " +
                        length(d[2] * 1000) + ", 0, 0, 0))");
        continue;
      }
      if (g.is_joints) {
        std::string v;
        for (const double a : g.axes) v += (v.empty() ? "" : ", ") + angle(a);
        goals.push_back("J(" + v + ")");
      } else {
        goals.push_back(g.pose ? "P(" + numbers(*g.pose) + ", " + std::to_string(figure(g)) + ")"
                               : g.text);
      }
    }
    std::string outer;
    const brand::Goal& last = x.goals.back();
    for (std::size_t k = 0; k < last.external.size(); ++k)
      outer += std::string(k ? ", " : " EXA(") + "(" + std::to_string(7 + k) + ", " +
               number(last.external[k], profile_.angle_digits) + ")";
    if (!outer.empty()) outer += ")";
    std::string how = ", Speed = " + speed;
    if (!x.acc.known || *x.acc.known != 100)
      how += ", Accel = " + shown(x.acc, 0) + ", Decel = " + shown(x.acc, 0);
    if (x.goals.size() == 2) line("Move C, " + goals[0] + ", " + arrive + goals[1] + outer + how);
    else line(std::string(x.is_ptp ? "Move P, " : "Move L, ") + arrive + goals[0] + outer + how);
  }

  Procedure main_;
  std::deque<Procedure> procedures_;
  Procedure* now_ = nullptr;
  std::vector<std::string> loops_;
  std::map<std::int64_t, std::pair<bool, bool>> ios_;  ///< whether it is an output; whether a clash
                                                       ///< was reported
  std::string result_;
  Modal<std::string> tool_, work_;
  bool told_ = false;
};

}  // namespace

const PostCapabilities& PacScript::capabilities() const { return pacscript_capabilities(); }

Result<void> PacScript::write(const PostTask& task, const Params&, PostOutput& output,
                              Progress& progress) const {
  return PacWriter(task, output, progress).run();
}

}  // namespace robomosp::post::pacscript

// SPDX-License-Identifier: Apache-2.0
#include "as.h"

#include <memory>

#include "../brand/brand_writer.h"

namespace robomosp::post::as {
namespace {

const PostCapabilities& as_capabilities() {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostParameters | kPostOutParameters | kPostRecursion |
                 kPostLocals | kPostIntegers | kPostReals | kPostBooleans | kPostStrings |
                 kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostFunctionsOfMath |
                 kPostIf | kPostWhile | kPostRepeat | kPostLoop | kPostFor | kPostForStep |
                 kPostCase | kPostGoto | kPostReturn | kPostWaitFor | kPostWaitTimeout |
                 kPostUntil | kPostVariableTargets | kPostVariableAttributes | kPostMessages |
                 kPostPause | kPostOutputsAreRead | kPostTools | kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostLinIncrement |
                kPostPtpIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::accuracy;
    c.speed = PostSpeed::mm_per_s;
    c.external_axes = 6;
    c.max_name = 14;  // 15 with the point of a local variable
    c.name_case = PostCase::lower;
    c.max_nesting = 20;
    c.reserved =
        "above abs accel accuracy align and any base below bits break by c1move c2move call case "
        "cp "
        "decel delay do draw drive dwrist dx dy dz else end exit external false for frame goto "
        "halt "
        "here if int jmove joint lefty lmove mod mm not null off on or pause point print px pi "
        "return "
        "righty rx ry rz scase shift sig signal sin cos atan2 sqrt speed step stop svalue swait "
        "tan then till "
        "timer to tool trans true twait type until uwrist value wait while xmove xor";
    c.extensions = "as,pg";
    c.title = "AS";
    return c;
  }();
  return kAll;
}

class AsWriter final : public brand::BrandWriter {
 public:
  AsWriter(const PostTask& t, PostOutput& o, Progress& p)
      : BrandWriter(t, o, as_capabilities(), p) {}

 private:
  using Kind = brand::Kind;

  std::string numbers(const Pose& p, const char* between) {
    const Placed x = placed(p, Orientation::zyz);
    std::string out;
    for (std::size_t i = 0; i < 3; ++i) out += (i ? between : "") + length(x.mm[i]);
    for (std::size_t i = 0; i < 3; ++i) out += between + angle(x.ori[i]);
    return out;
  }
  static std::string outer_text(const brand::Goal& g, AsWriter& w) {
    std::string out;
    for (const double x : g.external) out += " " + w.number(x, w.profile_.angle_digits);
    return out;
  }

  // ---- program ----
  void begin() override { out_ = &programs_; }
  void routine_begin(std::uint32_t r) override {
    out_ = &programs_;
    const auto k = routine(r).kind;
    refuse_beside(r);
    std::string all;
    if (check_parameters(r))
      for (std::uint32_t i = 0; i < routine(r).parameter_count; ++i) {
        const std::uint32_t s = parameter(r, i);
        all += (i ? ", " : "") + leaf_name(s, "", kind(symbol(s).type));
      }
    result_.clear();
    if (k == RMP_ROUTINE_FUNCTION) {
      result_ = "." + names_.unique("result");
      if (kind(routine(r).result) == Kind::none || kind(routine(r).result) == Kind::string)
        cannot("functions of " + type_name(routine(r).result));
      all += (all.empty() ? "" : ", ") + result_;
    }
    open(".PROGRAM " + routine_name(r) + "(" + all + ")");
    if (r != 0) return;
    for (const std::string_view l : lines_of(profile_.prologue)) out_->add(l);
    line("CP ON");
  }
  std::string spelled(std::uint32_t s, Kind k, const std::string& n) override {
    const bool is_local = symbol(s).kind == RMP_SYMBOL_PARAMETER ||
                          (symbol(s).routine != RMP_NONE && symbol(s).routine != 0);
    if (k == Kind::string && is_local) {
      cannot("local strings of a procedure", "Declare the variable in the program.");
      return "$" + n;
    }
    return k == Kind::string ? "$" + n : is_local ? "." + n : n;
  }
  void declare_leaf(const std::string&, Kind, const std::vector<brand::Bounds>&,
                    std::uint32_t) override {}
  int most_dimensions() const override { return 3; }
  void routine_code(std::uint32_t) override { set_initial(); }
  void routine_end(std::uint32_t r) override {
    settle();
    if (r == 0)
      for (const std::string_view l : lines_of(profile_.epilogue)) out_->add(l);
    close(".END");
  }
  void forget() override {
    pending_ = true;
    tool_.forget();
    config_.clear();
  }
  /// The program runs ahead of a motion; BREAK waits for its end.
  void settle() override {
    if (pending_) line("BREAK");
    pending_ = false;
  }
  void finish() override {
    const auto most = profile_.max_points;
    if (most > 0 && places_.size() + joints_.size() > static_cast<std::size_t>(most))
      fail("the program has " + std::to_string(places_.size() + joints_.size()) +
               " points, more than the controller's " + std::to_string(most),
           "Split it into several programs.");
    if (!places_.empty()) {
      programs_.add(".TRANS");
      programs_.append(place_lines_);
      programs_.add(".END");
    }
    if (!joints_.empty()) {
      programs_.add(".JOINTS");
      programs_.append(joint_lines_);
      programs_.add(".END");
    }
    programs_.give(output_, routine_name(0) + ".as", false);
  }
  std::string place(const Pose& p, const std::string& outer = "") {
    const std::string v = numbers(p, " ") + outer;
    const auto [it, is_new] = places_.try_emplace(v);
    if (is_new) {
      it->second = names_.unique("p" + std::to_string(places_.size()));
      place_lines_.add(it->second + " " + v);
    }
    return it->second;
  }

  // ---- words ----
  [[nodiscard]] std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {{RMP_EXPR_OR, " OR ", 1},
                                        {RMP_EXPR_EXOR, " XOR ", 0},
                                        {RMP_EXPR_AND, " AND ", 2},
                                        {RMP_EXPR_EQUAL, " == ", 4},
                                        {RMP_EXPR_NOT_EQUAL, " <> ", 4},
                                        {RMP_EXPR_LESS, " < ", 4},
                                        {RMP_EXPR_LESS_EQUAL, " <= ", 4},
                                        {RMP_EXPR_GREATER, " > ", 4},
                                        {RMP_EXPR_GREATER_EQUAL, " >= ", 4},
                                        {RMP_EXPR_ADD, " + ", 5},
                                        {RMP_EXPR_SUBTRACT, " - ", 5},
                                        {RMP_EXPR_MULTIPLY, "*", 6},
                                        {RMP_EXPR_DIVIDE, "/", 6},
                                        {RMP_EXPR_MOD, " MOD ", 6},
                                        {RMP_EXPR_NEGATE, "-", 7, Operator::prefix},
                                        {RMP_EXPR_NOT, "NOT", 8, Operator::call}};
    return kAll;
  }
  /// Numbers are real there; INT() cuts off what is behind the point.
  std::optional<Text> operated(const rmp_code_expression& e) override {
    if (e.op != RMP_EXPR_DIV) return BrandWriter::operated(e);
    const auto of = links(e.first, e.count);
    const std::string left = within(expr(of[0]), 6);
    return Text{"INT(" + left + "/" + within(expr(of[1]), 7) + ")"};
  }
  Text string_literal(std::string_view s) override { return quoted(s, '"'); }
  std::string function(std::string_view n) override {
    static constexpr std::pair<const char*, const char*> kAll[] = {
        {"SIN", "SIN"}, {"COS", "COS"},   {"ATAN2", "ATAN2"}, {"SQRT", "SQRT"},
        {"ABS", "ABS"}, {"TRUNC", "INT"}, {"LENGTH", "LEN"}};
    for (const auto& [irl, there] : kAll)
      if (n == irl) return there;
    return "";
  }
  std::string transform(const Pose& p) override { return "TRANS(" + numbers(p, ", ") + ")"; }
  std::string translation(const std::string& x, const std::string& y,
                          const std::string& z) override {
    return "TRANS(" + x + ", " + y + ", " + z + ")";
  }
  std::string rotation(std::size_t axis, const std::string& d) override {
    return std::string("R") + "XYZ"[axis] + "(" + d + ")";
  }
  Text product(const Text& a, const Text& b) override {
    return {within(a, 5) + " + " + within(b, 6), 5};
  }
  Text inverse_of(const Text& a) override { return {"-" + within(a, 8), 7}; }
  std::string component(const std::string& of, std::size_t axis) override {
    return std::string("D") + "XYZ"[axis] + "(" + of + ")";
  }
  void set_component(const std::string& of, std::size_t axis, const std::string& to) override {
    std::string by;
    for (std::size_t i = 0; i < 3; ++i)
      by += (i ? ", " : "") + (i == axis ? "(" + to + ") - " + component(of, i) : std::string("0"));
    line("POINT " + of + " = SHIFT(" + of + " BY " + by + ")");
  }
  std::string element(const std::string& n, const std::vector<std::string>& i,
                      const std::vector<brand::Bounds>& b) override {
    // Elements have any number from 0 on.
    std::string out;
    for (std::size_t k = 0; k < i.size(); ++k)
      out += (k ? "," : "") + counted(i[k], std::max<std::int64_t>(0, -std::int64_t{b[k].lower}));
    return n + "[" + out + "]";
  }
  void assign_text(const std::string& to, Kind k, const std::string& value) override {
    line((k == Kind::transform ? "POINT " : "") + to + " = " + value);
  }

  // ---- statements ----
  std::string temporary(Kind) override { return "." + names_.unique("f"); }
  void if_begin(std::uint32_t c) override {
    settle_for(c);
    const std::string s = text(c);
    open("IF " + s + " THEN");
  }
  void else_() override { middle("ELSE"); }
  void if_end() override { close("END"); }
  void while_begin(std::uint32_t c) override {
    loop_asks(c);
    open("WHILE " + asked_again(c) + " DO");
  }
  void while_end() override {
    loop_asks_again();
    close("END");
  }
  void repeat_begin() override { open("DO"); }
  void repeat_end(std::uint32_t until) override {
    settle_for(until);
    close("UNTIL " + asked_again(until));
  }
  void loop_begin() override { open("WHILE TRUE DO"); }
  void loop_end() override { close("END"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    open("FOR " + leaf_name(s, "", Kind::integer) + " = " +
         range(from, to, step, down, " TO ", " STEP ", 8));
  }
  void for_end(std::uint32_t) override { close("END"); }
  void case_begin(std::uint32_t selector) override {
    settle_for(selector);
    open("CASE " + text(selector) + " OF");
  }
  void case_when(std::span<const std::uint32_t> labels) override {
    middle("VALUE " + list(labels, ",") + ":");
  }
  void case_default() override { middle("ANY :"); }
  void case_end() override { close("END"); }
  std::string number_of(std::uint32_t label) {
    return std::to_string(labels_.try_emplace(label, labels_.size() * 10 + 10).first->second);
  }
  void go_to(std::uint32_t s) override { line("GOTO " + number_of(s)); }
  void label(std::uint32_t s) override { line(number_of(s) + " ; " + symbol(s).name); }
  void return_(std::uint32_t value) override {
    settle();
    if (value != RMP_NONE) {
      const Kind k = kind(routine(in_routine_).result);
      const std::string v = text(value);
      assign_text(result_, k, v);
    }
    line("RETURN");
  }
  void wait_time(std::uint32_t seconds) override {
    settle();
    line("TWAIT " + text(seconds));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    settle();
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool keeps = flag != RMP_NONE && is_used(flag);
    const auto& x = expression(c);
    const bool plain = x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
                       symbol(x.symbol).kind == RMP_SYMBOL_INPUT;
    if (timeout == RMP_NONE) {
      if (plain) {
        const Signal s = signal(x.symbol);
        if (!is_numbered(s)) return;
        line(std::string("SWAIT ") + (s.inverted ? "-" : "") + number_of(s));
      } else {
        line("WAIT " + asked_again(c));
      }
      if (keeps) line(leaf_name(flag, "", Kind::boolean) + " = FALSE");
      return;
    }
    const std::string timer = trimmed(number_option("timer", 1), 0);
    line("TIMER " + timer + " = 0");
    const std::string condition = within(expr(c), 2);
    line("WAIT " + condition + " OR TIMER(" + timer + ") >= " + within(expr(timeout), 5));
    if (keeps)
      line(leaf_name(flag, "", Kind::boolean) + " = TIMER(" + timer +
           ") >= " + within(expr(timeout), 5));
  }
  void pause(std::uint32_t m) override {
    settle();
    if (m != RMP_NONE) line("PRINT " + text(m));
    line("PAUSE");
  }
  void halt() override {
    settle();
    line("HALT");
  }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    auto given = message_text(values, ", ");
    if (!given) return;
    std::string all = std::move(*given);
    if (!ends_line) all += all.empty() ? "/S" : ", /S";
    settle();
    line("PRINT " + (all.empty() ? "\"\"" : all));
  }

  // ---- signals ----
  /// Inputs have numbers from 1001.
  std::string number_of(const Signal& s) {
    if (s.number < 1) fail("signals of AS are numbered from 1", "Give its number in the profile.");
    const double base = number_option("input_base", 1000);
    return std::to_string(s.number +
                          (!s.is_output && s.number <= 1000 ? static_cast<std::int64_t>(base) : 0));
  }
  Text signal_text(const Signal& s) {
    if (!is_numbered(s)) return {};
    if (s.type == RMP_TYPE_INT)
      return {"BITS(" + number_of(s) + "," + std::to_string(s.width) + ")"};
    return {std::string("SIG(") + (s.inverted ? "-" : "") + number_of(s) + ")"};
  }
  Text input(const Signal& s) override { return signal_text(s); }
  Text output(const Signal& s) override { return signal_text(s); }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (!is_numbered(s)) return;
    const std::string n = number_of(s);
    const std::string v = text(value);
    settle();
    if (s.type == RMP_TYPE_INT) {
      line("BITS " + n + "," + std::to_string(s.width) + " = " + v);
      return;
    }
    if (const auto b = constant_bool(value, s.inverted)) {
      line(std::string("SIGNAL ") + (*b ? "" : "-") + n);
      return;
    }
    open("IF " + v + " THEN");
    line(std::string("SIGNAL ") + (s.inverted ? "-" : "") + n);
    middle("ELSE");
    line(std::string("SIGNAL ") + (s.inverted ? "" : "-") + n);
    close("END");
  }

  // ---- motions ----
  bool has_external() const override { return true; }
  bool has_speed_ori() const override { return true; }
  void choose(const brand::Goal& g) {
    static constexpr struct {
      std::uint32_t bit;
      const char *name, *usual, *other;
    } kBits[] = {{kPostShoulderBehind, "shoulder", "RIGHTY", "LEFTY"},
                 {kPostElbowOther, "elbow", "ABOVE", "BELOW"},
                 {kPostWristFlipped, "wrist", "UWRIST", "DWRIST"}};
    if (g.point && g.point->status_known != 0 && !g.point->q.empty()) axes_are_needed();
    for (const auto& b : kBits) {
      if (!g.point || !(g.point->status_known & b.bit)) continue;
      const std::string_view usual = option(b.name, b.usual);
      const std::string_view other = usual == b.other ? b.usual : b.other;
      const std::string word((g.point->status & b.bit) ? other : usual);
      if (std::exchange(config_[b.bit], word) != word) line(word);
    }
  }
  void describe(const Motion& m, const brand::Move& x) {
    const auto value = [&](const brand::Number& n, int digits) { return shown(n, digits); };
    if (x.is_ptp) line("SPEED " + value(x.speed, profile_.speed_digits));
    else
      line("SPEED " + value(x.speed, profile_.speed_digits) + " MM/S" +
           (m[RMP_ATTR_SPEED_ORI].given
                ? ", " + value(x.speed_ori, profile_.speed_digits) + " DEG/S"
                : ""));
    if (!x.acc.known || *x.acc.known != 100) {
      line("ACCEL " + value(x.acc, 0));
      line("DECEL " + value(x.acc, 0));
    }
    if (x.passes) line("ACCURACY " + shown(mm_, profile_.length_digits));
  }
  void write_move(const Motion& m, const brand::Move& x) override {
    mm_ = x.passes ? blend_mm(x) : brand::Number{};
    if (!x.tool.text.empty()) {
      line("TOOL " + x.tool.text);
      tool_.forget();
    } else {
      const std::string t =
          x.tool.pose && !is_identity(*x.tool.pose) ? place(*x.tool.pose) : "NULL";
      if (tool_.changes(t)) line("TOOL " + t);
    }
    std::string frame;
    if (!x.frame.text.empty()) frame = x.frame.text + " + ";
    else if (x.frame.pose && !is_identity(*x.frame.pose)) frame = place(*x.frame.pose) + " + ";
    if (m.until != RMP_NONE) {
      until(m, x, frame);
      return;
    }
    if (x.incremental) {
      if (!x.frame.text.empty()) {
        cannot("increments in a computed frame", "Give them in the base's axes.");
        return;
      }
      // SHIFT is along the base's axes.
      Pose turn;
      if (x.frame.pose) turn.R = x.frame.pose->R;
      const Vec3 d = post::product(turn, *x.goals[0].pose).p;
      line("BREAK");
      describe(m, x);
      line(std::string(x.is_ptp ? "JMOVE" : "LMOVE") + " SHIFT(HERE BY " + length(d[0] * 1000) +
           ", " + length(d[1] * 1000) + ", " + length(d[2] * 1000) + ")");
    }
    for (std::size_t k = 0; k < x.goals.size() && !x.incremental; ++k) {
      const brand::Goal& g = x.goals[k];
      if (x.is_ptp && !g.is_joints) choose(g);
      describe(m, x);
      const char* verb = x.goals.size() == 2 ? (k == 0 ? "C1MOVE " : "C2MOVE ")
                         : x.is_ptp          ? "JMOVE "
                                             : "LMOVE ";
      line(verb + (g.is_joints ? joints(g) : frame + goal_text(g, !frame.empty())));
    }
    if (!x.passes) line("BREAK");
    pending_ = x.passes;
  }
  std::string goal_text(const brand::Goal& g, bool in_sum) {
    if (!g.pose) return in_sum ? "(" + g.text + ")" : g.text;
    return place(*g.pose, outer_text(g, *this));
  }
  std::string joints(const brand::Goal& g) {
    std::string v;
    for (const double a : g.axes) v += (v.empty() ? "" : " ") + angle(a);
    v += outer_text(g, *this);
    const auto [it, is_new] = joints_.try_emplace(v);
    if (is_new) {
      it->second = "#" + names_.unique("j" + std::to_string(joints_.size()));
      joint_lines_.add(it->second + " " + v);
    }
    return it->second;
  }
  void until(const Motion& m, const brand::Move& x, const std::string& frame) {
    const rmp_code_expression* e = &expression(m.until);
    bool is_not = false;
    if (e->op == RMP_EXPR_NOT) {
      is_not = true;
      e = &expression(links(e->first, e->count)[0]);
    }
    if (x.is_ptp || x.goals.size() != 1 || x.incremental || e->op != RMP_EXPR_SYMBOL ||
        e->symbol == RMP_NONE || symbol(e->symbol).kind != RMP_SYMBOL_INPUT) {
      fail("AS can end a straight motion early on one input only",
           "Write MOVE LIN ... UNTIL signal or UNTIL NOT signal.");
      return;
    }
    Signal s = signal(e->symbol);
    if (s.type != RMP_TYPE_BOOL) {
      fail("AS can end a motion early only on a one-bit input");
      return;
    }
    s.inverted = s.inverted != is_not;
    describe(m, x);
    line("XMOVE/LVL " + frame + goal_text(x.goals[0], !frame.empty()) + " TILL " +
         (s.inverted ? "-" : "") + number_of(s));
    line("BREAK");
    pending_ = false;
    if (m.action == RMP_NONE) return;
    open("IF " + signal_text(s).text + " THEN");
    line("CALL " + routine_name(m.action) + "()");
    close("END");
  }

  File programs_{2}, place_lines_{0}, joint_lines_{0};
  std::map<std::string, std::string> places_, joints_;
  std::map<std::uint32_t, std::size_t> labels_;
  std::map<std::uint32_t, std::string> config_;
  std::string result_;
  Modal<std::string> tool_;
  brand::Number mm_;
  bool pending_ = false;
};

}  // namespace

const PostCapabilities& As::capabilities() const { return as_capabilities(); }

Result<void> As::write(const PostTask& task, const Params&, PostOutput& output,
                       Progress& progress) const {
  return AsWriter(task, output, progress).run();
}

}  // namespace robomosp::post::as

// SPDX-License-Identifier: Apache-2.0
// A post for a controller that does not exist, the Kestrel: numbered steps with jumps to them, a
// header with their count and a checksum, points in a file of their own with the configuration of
// the arm. The header and the letters of the configuration cannot be said by templates. Its
// language:
//
//     %KESTREL 2                      P001 J 0.000 -90.000 90.000 0.000 90.000 0.000
//     %PROGRAM LIFT                   P002 C 500.000 0.000 120.000 180.000 0.000 0.000 RUN
//     %STEPS 3
//     %CHECK 05C6
//     S0001 JMOV P001 V50.0
//     S0002 LMOV P002 V80.0 R5.0
//     S0003 END
//
// Registers R1..R99 hold numbers; conditions stand in IFNOT condition JUMP step and HOLD condition.
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/post_passing.h>
#include <robomosp/sdk/post_writer.h>

namespace {

using namespace robomosp;

/// What the language has. The host rewrites the rest where there is a way: CASE and FOR become IF
/// and WHILE, records their parts, PATH pieces of LIN.
const PostCapabilities& kestrel() {
  static const PostCapabilities all = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostReturn | kPostIntegers | kPostReals | kPostIf | kPostElsif |
                 kPostWhile | kPostRepeat | kPostLoop | kPostExit | kPostGoto | kPostWaitFor |
                 kPostMessages | kPostPause;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle;
    c.circle = PostCircle::via;
    c.blending = PostBlending::radius;
    c.speed = PostSpeed::mm_per_s;
    c.max_name = 8;
    c.name_case = PostCase::upper;
    c.crlf = true;
    c.max_points = 999;
    c.max_lines = 9999;
    c.reserved =
        "CALL CIRC DELAY END HOLD IFNOT IN JMOV JUMP LMOV NOT AND OR OUT PAUSE RETURN "
        "SET SHOW STOP SUB";
    c.extensions = "ksl,kpt";
    c.title = "Kestrel KSL";
    return c;
  }();
  return all;
}

class KestrelWriter final : public post::Writer {
 public:
  KestrelWriter(const PostTask& task, PostOutput& output, Progress& progress)
      : Writer(task, output, kestrel(), progress) {}

 private:
  using Motion = post::Motion;
  using Text = post::Text;

  // ---- the program ----
  void begin() override {
    out_ = &body_;
    body_.add_lines(profile_.prologue);
  }
  void routine_begin(std::uint32_t r) override {
    if (r == 0) return;
    if (routine(r).kind != RMP_ROUTINE_PROCEDURE || routine(r).parameter_count > 0)
      cannot("routines with parameters, results or conditions");
    line("SUB " + routine_name(r));
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0) body_.add_lines(profile_.epilogue);
    line(r == 0 ? "END" : "RETURN");
  }
  /// Variables are registers, which begin with what the program says.
  void declare(std::uint32_t s, std::uint32_t r) override {
    at_ = symbol(s).span;
    if (r != 0) return cannot("variables of routines", "Declare them in the program.");
    const std::uint32_t t = symbol(s).type;
    if (t != RMP_TYPE_INT && t != RMP_TYPE_REAL) return cannot("variables of " + type_name(t));
    line("SET " + variable(s).text + " = " +
         (symbol(s).value == RMP_NONE ? "0" : text(symbol(s).value)));
  }
  void finish() override {
    // Steps get their numbers, and the marks of jumps the numbers of their steps.
    post::File all(0);
    unsigned check = 0;
    std::vector<std::string>& steps = body_.lines();
    for (std::size_t i = 0; i < steps.size(); ++i) {
      std::string& s = steps[i];
      if (const std::size_t at = s.find('\x01'); at != std::string::npos)
        s.replace(at, std::string::npos, step(marks_.at(std::stoull(s.substr(at + 1)))));
      s = step(i) + " " + s;
      for (const char c : s) check = (check + static_cast<unsigned char>(c)) % 65536;
    }
    static constexpr char kHex[] = "0123456789ABCDEF";
    std::string sum;
    for (unsigned shift : {12U, 8U, 4U, 0U}) sum += kHex[check >> shift & 15U];
    all.add("%KESTREL 2");
    all.add("%PROGRAM " + routine_name(0));
    all.add("%STEPS " + std::to_string(steps.size()));
    all.add("%CHECK " + sum);
    all.append(body_);
    all.give(output_, routine_name(0) + ".KSL", true);
    if (!points_.empty()) points_.give(output_, routine_name(0) + ".KPT", true);
  }

  // ---- jumps ----
  std::uint64_t mark() { return next_mark_++; }
  void put(std::uint64_t mark) { marks_[mark] = body_.size(); }
  void jump(std::uint64_t to, const std::string& before = {}) {
    line(before + "JUMP \x01" + std::to_string(to));
  }
  static std::string step(std::size_t i) {
    std::string n = std::to_string(i + 1);
    return "S" + std::string(4 - std::min<std::size_t>(4, n.size()), '0') + n;
  }
  void unless(std::uint32_t condition, std::uint64_t to) {
    jump(to, "IFNOT " + text(condition) + " ");
  }
  struct Branch {
    std::uint64_t next = 0, end = 0;
  };
  void if_begin(std::uint32_t c) override {
    ifs_.push_back({mark(), mark()});
    unless(c, ifs_.back().next);
  }
  void else_() override {
    jump(ifs_.back().end);
    put(ifs_.back().next);
    ifs_.back().next = mark();
  }
  void else_if(std::uint32_t c) override {
    else_();
    unless(c, ifs_.back().next);
  }
  void if_end() override {
    put(ifs_.back().next);
    put(ifs_.back().end);
    ifs_.pop_back();
  }
  void loop_begin() override {
    loops_.push_back({mark(), mark()});
    put(loops_.back().next);
  }
  void loop_end() override {
    jump(loops_.back().next);
    leave_loop();
  }
  void while_begin(std::uint32_t c) override {
    loop_begin();
    unless(c, loops_.back().end);
  }
  void while_end() override { loop_end(); }
  void repeat_begin() override { loop_begin(); }
  void repeat_end(std::uint32_t until) override {
    unless(until, loops_.back().next);
    leave_loop();
  }
  void leave_loop() {
    put(loops_.back().end);
    loops_.pop_back();
  }
  void exit_loop() override { jump(loops_.back().end); }
  std::uint64_t label_mark(std::uint32_t s) {
    const auto [it, is_new] = labels_.try_emplace(s, next_mark_);
    if (is_new) ++next_mark_;
    return it->second;
  }
  void go_to(std::uint32_t l) override { jump(label_mark(l)); }
  void label(std::uint32_t l) override { put(label_mark(l)); }

  // ---- expressions ----
  std::span<const post::Operator> operators() const override {
    static constexpr post::Operator kAll[] = {{RMP_EXPR_NEGATE, "-", 70, post::Operator::prefix},
                                              {RMP_EXPR_NOT, "NOT ", 25, post::Operator::prefix},
                                              {RMP_EXPR_ADD, " + ", 50},
                                              {RMP_EXPR_SUBTRACT, " - ", 50},
                                              {RMP_EXPR_MULTIPLY, " * ", 60},
                                              {RMP_EXPR_DIVIDE, " / ", 60},
                                              {RMP_EXPR_EQUAL, " = ", 30},
                                              {RMP_EXPR_NOT_EQUAL, " <> ", 30},
                                              {RMP_EXPR_LESS, " < ", 30},
                                              {RMP_EXPR_LESS_EQUAL, " <= ", 30},
                                              {RMP_EXPR_GREATER, " > ", 30},
                                              {RMP_EXPR_GREATER_EQUAL, " >= ", 30},
                                              {RMP_EXPR_AND, " AND ", 20},
                                              {RMP_EXPR_OR, " OR ", 10}};
    return kAll;
  }
  Text variable(std::uint32_t s) override {
    const auto [it, is_new] = registers_.try_emplace(s, registers_.size() + 1);
    if (is_new && it->second > 99)
      fail("the program has more than 99 variables, which are registers here",
           "Use fewer variables, or post the flattened program (form = \"flat\").");
    return {"R" + std::to_string(it->second)};
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL)
      return {k.integer ? "1 = 1" : "1 = 0", 30};
    return Writer::literal(k);
  }
  Text input(const post::Signal& s) override {
    if (s.type != RMP_TYPE_BOOL) cannot("inputs of several bits");
    const std::string in = "IN(" + signal_name(s) + ")";
    return s.inverted ? Text{"NOT " + in, 25} : Text{in};
  }
  static std::string signal_name(const post::Signal& s) {
    return s.target.empty() ? std::to_string(s.number) : s.target;
  }

  // ---- statements ----
  void assign(std::uint32_t place, std::uint32_t value) override {
    if (expression(place).op != RMP_EXPR_SYMBOL) return cannot("records and arrays");
    line("SET " + text(place) + " = " + text(value));
  }
  void set_output(const post::Signal& s, std::uint32_t value) override {
    const auto on = known(value);
    if (s.type != RMP_TYPE_BOOL) return cannot("outputs of several bits");
    if (!on) return cannot("outputs with a computed state", "Use IF with TRUE and FALSE.");
    line("OUT " + signal_name(s) + ((*on != 0) != s.inverted ? " ON" : " OFF"));
  }
  void call(std::uint32_t r, std::span<const std::uint32_t>) override {
    line("CALL " + routine_name(r));
  }
  void return_(std::uint32_t value) override {
    if (value != RMP_NONE || in_routine_ == 0) return cannot("RETURN here");
    line("RETURN");
  }
  void wait_time(std::uint32_t e) override {
    const auto s = known(e);
    if (!s) return cannot("computed times", "Give a number of seconds.");
    if (!(*s >= 0 && *s <= 3600))
      return fail("a delay of " + post::shortest(*s) + " s is not from 0 to 3600 s",
                  "Give another time.");
    if (std::fabs(*s * 1000 - std::round(*s * 1000)) > 1e-6)
      warn("the delay is rounded to a millisecond", "Give whole milliseconds.");
    line("DELAY " + post::fixed(*s * 1000, 0));
  }
  void wait_for(std::uint32_t condition, std::uint32_t timeout) override {
    if (timeout != RMP_NONE)
      return cannot("WAIT FOR with a TIMEOUT", "Test the condition in a LOOP.");
    line("HOLD " + text(condition));
  }
  void show(std::uint32_t value) {
    const auto& x = expression(value);
    if (x.constant == RMP_NONE || constant(x.constant).kind != RMP_CONSTANT_TEXT)
      return cannot("values in messages", "Write a text only.");
    const std::string said(constant(x.constant).text, constant(x.constant).text_size);
    for (const char c : said)
      if (c < 32 || c > 126 || c == '"')
        return cannot("notation for every letter of this text",
                      "Use plain letters without quotes.");
    line("SHOW \"" + said + "\"");
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    if (values.empty()) line("SHOW \"\"");
    for (const std::uint32_t v : values) show(v);
  }
  void pause(std::uint32_t message) override {
    if (message != RMP_NONE) show(message);
    line("PAUSE");
  }
  void halt() override { line("STOP"); }

  // ---- motions ----
  /// What no step says is an error; what the controller chooses itself, a warning.
  void look_at(const Motion& m) {
    if (m.until != RMP_NONE) cannot("motions that end on a condition (UNTIL)");
    if (m.incremental) cannot("increments", "Move to the target pose itself.");
    struct Row {
      std::uint32_t attribute;
      const char* word;
      double harmless;
    };
    static constexpr Row kNever[] = {
        {RMP_ATTR_TIME, "TIME", -1},       {RMP_ATTR_WOBBLE, "WOBBLE", 0},
        {RMP_ATTR_DEVICE, "DEVICE", 1},    {RMP_ATTR_ADAX_CONTROL, "ADAX_CONTROL", 0},
        {RMP_ATTR_TOOL, "TOOL", NAN},      {RMP_ATTR_FRAME, "FRAME", NAN},
        {RMP_ATTR_ACT_ROB, "ACT_ROB", NAN}};
    for (const Row& r : kNever)
      if (m[r.attribute].given && m[r.attribute].known != r.harmless)
        cannot(std::string(r.word) + " of a motion");
    static constexpr Row kOwn[] = {{RMP_ATTR_ACC, "ACC", 100},
                                   {RMP_ATTR_ACC_PTP, "ACC_PTP", 100},
                                   {RMP_ATTR_SPEED_ORI, "SPEED_ORI", 90},
                                   {RMP_ATTR_C_SPEED, "C_SPEED", 100}};
    for (const Row& r : kOwn)
      if (m[r.attribute].given && m[r.attribute].known != r.harmless)
        warn(std::string(r.word) + " is not written: the Kestrel chooses it", "Take it out.");
  }
  /// " V80.0 R5.0"; an empty text where something is wrong, which is said.
  std::string how(const Motion& m, std::uint32_t speed, double most, std::uint32_t blend) {
    look_at(m);
    const auto v = m[speed].known, r = m[blend].known;
    if (!v || !r) {
      cannot("computed speeds and blending", "Write constants.");
      return {};
    }
    if (!(*v >= 0.1 && *v <= most)) {
      fail("a speed of " + post::shortest(*v) + " is not from 0.1 to " + post::trimmed(most, 0),
           "Give another speed.");
      return {};
    }
    double round = *r;
    if (round == 0 && m[RMP_ATTR_C_PASS].given && m[RMP_ATTR_C_PASS].known != 0.0) {
      round = 1;
      note("C_PASS without a distance is written as R1.0, and the simulated robot " +
               post::at_c_pass_in_a_run(*task_.code, m),
           m.interpolation == RMP_MOVE_PTP ? "Give C_PTP." : "Give C_CP.");
    }
    if (!(round >= 0 && round <= 500)) {
      fail("blending of " + post::shortest(round) + " is not from 0 to 500",
           "Give another number.");
      return {};
    }
    return " V" + post::fixed(*v, 1) + (round > 0 ? " R" + post::fixed(round, 1) : "");
  }
  /// The name of a target in the file of points; equal ones are written once.
  std::string place(const post::Target& t, bool by_joints) {
    const PostPoint* p = t.point;
    if (!p) {
      cannot("computed targets");
      return {};
    }
    std::string numbers;
    const auto add = [&](double v) {
      if (!(std::fabs(v) <= 100'000))
        fail("a target here is beyond the Kestrel's range", "Check what it is computed from.");
      numbers += " " + post::fixed(v, 3);
    };
    if (by_joints) {
      numbers = " J";
      for (const double a : axes(*p)) add(a);
    } else if (!p->has_pose || p->role == RMP_ROLE_POSITION) {
      cannot("targets of " + type_name(expression(t.expression).type), "Give a POSE.");
      return {};
    } else {
      numbers = " C";
      const post::Placed at = post::placed(p->pose, post::Orientation::fixed_xyz);
      for (const double x : at.mm) add(x);
      for (std::size_t i = 0; i < 3; ++i) add(at.ori[i]);
      const auto letter = [&](std::uint32_t bit, char other, char usual) {
        return !(p->status_known & bit) ? '-' : p->status & bit ? other : usual;
      };
      numbers += std::string(" ") + letter(kPostShoulderBehind, 'L', 'R') +
                 letter(kPostElbowOther, 'D', 'U') + letter(kPostWristFlipped, 'F', 'N');
      no_turns(p);
    }
    const auto [n, is_new] = table_.add(numbers);
    const std::string name = "P" + step(n).substr(2);
    if (is_new) points_.add(name + numbers, &at_);
    return name;
  }
  static bool is_joints(const post::Target& t) {
    return t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT;
  }
  void ptp(const Motion& m) override {
    const std::string to = place(m.targets[0], is_joints(m.targets[0]));
    line("JMOV " + to + how(m, RMP_ATTR_SPEED_PTP, 100, RMP_ATTR_C_PTP));
  }
  void lin(const Motion& m) override {
    const std::string to = place(m.targets[0], false);
    line("LMOV " + to + how(m, RMP_ATTR_SPEED, 5000, RMP_ATTR_C_CP));
  }
  void circle(const Motion& m) override {
    if (m.targets.size() != 2)
      return fail("a circle has two targets", "Give a via point and an end point.");
    const std::string via = place(m.targets[0], false), to = place(m.targets[1], false);
    line("CIRC " + via + " " + to + how(m, RMP_ATTR_SPEED, 5000, RMP_ATTR_C_CP));
  }

  post::File body_{0}, points_{0};
  post::Points table_;
  std::map<std::uint32_t, std::size_t> registers_;
  std::map<std::uint32_t, std::uint64_t> labels_;
  std::map<std::uint64_t, std::size_t> marks_;  ///< step that a mark stands for
  std::vector<Branch> ifs_, loops_;
  std::uint64_t next_mark_ = 0;
};

class KestrelPost final : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override { return kestrel(); }
  Result<void> write(const PostTask& task, const Params&, PostOutput& output,
                     Progress& progress) const override {
    return KestrelWriter(task, output, progress).run();
  }
};

}  // namespace

RMP_PLUGIN("org.example.kestrel_post", "0.1.0", "Apache-2.0", "Programs for the Kestrel.",
           RMP_PROVIDER_NO_PARAMS(KestrelPost, "kestrel", "Kestrel KSL: .KSL and .KPT.", ""))

// SPDX-License-Identifier: Apache-2.0
#include "val3.h"

#include <algorithm>
#include <memory>

#include "../brand/brand_writer.h"

namespace robomosp::post::val3 {
namespace {

const PostCapabilities& val3_capabilities() {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.features = kPostProcedures | kPostParameters | kPostOutParameters | kPostRecursion |
                 kPostLocals | kPostIntegers | kPostReals | kPostBooleans | kPostStrings |
                 kPostArrays | kPostRecords | kPostPoses | kPostPoseProduct | kPostFunctionsOfMath |
                 kPostIf | kPostElsif | kPostWhile | kPostRepeat | kPostLoop | kPostFor |
                 kPostForStep | kPostReturn | kPostProcesses | kPostWaitFor | kPostWaitTimeout |
                 kPostUntil | kPostVariableTargets | kPostVariableAttributes | kPostMessages |
                 kPostOutputsAreRead | kPostTools | kPostFrames;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle | kPostLinIncrement |
                kPostPtpIncrement;
    c.circle = PostCircle::via;
    c.blending = PostBlending::distance;
    c.speed = PostSpeed::mm_per_s;
    c.max_name = 15;
    c.crlf = true;
    c.reserved =
        "abs accel acos align and appro asin atan aio begin blend bool break call case config cos "
        "decel default delay dio do else elseIf end endFor endIf endSwitch endWhile exp false "
        "flange "
        "for frame getLatch here if isEmpty isSettled joint jointRx jointRs leave limit link ln "
        "log "
        "logMsg max mdesc min movec movej movel not num or point pointRx pointRs popUpMsg reach "
        "resetMotion return round roundDown roundUp rvel sel setFrame sin size sio sqrt start step "
        "stop stopMove string switch tan taskCreate taskKill taskResume taskSuspend to tool "
        "toString "
        "trsf true tvel until user vel wait waitEndMove watch while world xor";
    c.extensions = "pjx,dtx,pgx";
    c.title = "VAL3";
    return c;
  }();
  return kAll;
}

class Val3Writer final : public brand::BrandWriter {
 public:
  Val3Writer(const PostTask& t, PostOutput& o, Progress& p)
      : BrandWriter(t, o, val3_capabilities(), p) {}

 private:
  using Kind = brand::Kind;
  struct Program {
    std::string name;
    std::vector<std::string> parameters, locals;
    File code{2};
    int temporaries = 0;
    bool has_point = false, has_flag = false;
  };

  static std::string xml(std::string_view s) {
    std::string out;
    for (const char c : s)
      out += c == '&'   ? "&amp;"
             : c == '<' ? "&lt;"
             : c == '>' ? "&gt;"
             : c == '"' ? "&quot;"
                        : std::string(1, c);
    return out;
  }
  static const char* type_of(Kind k) {
    switch (k) {
      case Kind::boolean: return "bool";
      case Kind::string: return "string";
      case Kind::transform: return "trsf";
      default: return "num";
    }
  }
  std::string numbers(const Pose& p, const char* separator = ", ") {
    const Placed x = placed(p, Orientation::xyz);
    std::string out;
    for (std::size_t i = 0; i < 3; ++i) out += (i ? separator : "") + length(x.mm[i]);
    for (std::size_t i = 0; i < 3; ++i) out += separator + angle(x.ori[i]);
    return out;
  }
  std::string attributes(const Pose& p) {
    static constexpr const char* kNames[] = {"x", "y", "z", "rx", "ry", "rz"};
    const Placed x = placed(p, Orientation::xyz);
    std::string out;
    for (std::size_t i = 0; i < 6; ++i)
      out += std::string(i ? " " : "") + kNames[i] + "=\"" +
             (i < 3 ? length(x.mm[i]) : angle(x.ori[i - 3])) + "\"";
    return out;
  }
  void data(const std::string& name, const char* type, const std::vector<std::string>& values,
            std::size_t size = 1) {
    std::string head = "    <Data name=\"" + name +
                       "\" access=\"private\" xsi:type=\"array\" type=\"" + type + "\" size=\"" +
                       std::to_string(size) + "\"";
    if (values.empty()) {
      data_.add(head + " />");
      return;
    }
    data_.add(head + ">");
    for (std::size_t i = 0; i < values.size(); ++i)
      data_.add("      <Value key=\"" + std::to_string(i) + "\" " + values[i] + " />");
    data_.add("    </Data>");
  }
  /// The name of a datum with these values; equal values share one.
  std::string datum(const char* prefix, const char* type, const std::string& values) {
    const auto [it, is_new] = kept_.try_emplace(std::string(type) + " " + values);
    if (is_new) {
      it->second = names_.unique(prefix + std::to_string(++counts_[prefix]));
      data(it->second, type, {values});
      ++points_;
    }
    return it->second;
  }

  // ---- program ----
  void begin() override {
    app_ = routine_name(0);
    for (std::uint32_t s = 0; s < c_.symbols.count; ++s) {
      const auto k = symbol(s).kind;
      if (is_used(s) && (k == RMP_SYMBOL_INPUT || k == RMP_SYMBOL_OUTPUT)) declare_signal(s);
    }
  }
  void declare_signal(std::uint32_t s) {
    at_ = symbol(s).span;
    const Signal x = signal(s);
    if (!x.target.empty() && x.width > 1) {
      fail(std::string("the signal ") + symbol(s).name + " has " + std::to_string(x.width) +
               " bits, and one name in the profile",
           "Give its first number instead; the bits follow each other.");
      return;
    }
    const bool is_real = x.type == RMP_TYPE_REAL;
    std::vector<std::string> values;
    for (std::int32_t i = 0; i < x.width && i < 64; ++i)
      values.push_back("link=\"" +
                       xml(x.target.empty()
                               ? std::string(option("io_module", "BasicIO-1")) + "\\%" +
                                     (is_real ? "A" : "") + (x.is_output ? "Q" : "I") +
                                     std::to_string(x.number + i)
                               : x.target) +
                       "\"");
    if (x.width > 32) fail("a signal of more than 32 bits cannot be posted", "Split it.");
    data(name(s), is_real ? "aio" : "dio", values, static_cast<std::size_t>(x.width));
    signals_[s] = x;
  }
  void routine_begin(std::uint32_t r) override {
    programs_.emplace_back();
    Program& p = programs_.back();
    p.name = r == 0 ? "start" : routine_name(r);
    out_ = &p.code;
    result_.clear();
    if (routine(r).kind == RMP_ROUTINE_INTERRUPT || routine(r).kind == RMP_ROUTINE_DATA_LIST) {
      cannot("interrupts", "Test the condition in the program, or in a process.");
      return;
    }
    if (check_parameters(r))
      for (std::uint32_t k = 0; k < routine(r).parameter_count; ++k) {
        const std::uint32_t s = parameter(r, k);
        add_parameter(p, leaf_name(s, "", kind(symbol(s).type)), kind(symbol(s).type),
                      symbol(s).mode != RMP_MODE_IN);
      }
    if (routine(r).result != RMP_TYPE_VOID && routine(r).kind == RMP_ROUTINE_FUNCTION) {
      if (kind(routine(r).result) == Kind::none)
        cannot("functions of " + type_name(routine(r).result));
      result_ = names_.unique("x_result");
      add_parameter(p, result_, kind(routine(r).result), true);
    }
    out_->in();
    if (r != 0) return;
    for (const std::string_view l : lines_of(profile_.prologue)) out_->add(l);
  }
  static void add_parameter(Program& p, const std::string& name, Kind k, bool by_reference) {
    p.parameters.push_back("      <Parameter name=\"" + name + "\" type=\"" + type_of(k) +
                           "\" xsi:type=\"element\"" + (by_reference ? " use=\"reference\"" : "") +
                           " />");
  }
  void local(const std::string& name, const char* type, std::int64_t size = 1) {
    programs_.back().locals.push_back("      <Local name=\"" + name + "\" type=\"" + type +
                                      "\" xsi:type=\"array\" size=\"" + std::to_string(size) +
                                      "\" />");
  }
  void declare_leaf(const std::string& name, Kind k, const std::vector<brand::Bounds>& b,
                    std::uint32_t r) override {
    const std::int64_t n = b.empty() ? 1 : b[0].size();
    if (r == 0) data(name, type_of(k), {}, static_cast<std::size_t>(n));
    else local(name, type_of(k), n);
  }
  void routine_code(std::uint32_t) override { set_initial(); }
  void routine_end(std::uint32_t r) override {
    settle();
    if (r == 0)
      for (const std::string_view l : lines_of(profile_.epilogue)) out_->add(l);
    out_->out();
  }
  void forget() override { pending_ = true; }
  /// Motions run in parallel with the program: the next statement waits for those that blend.
  void settle() override {
    if (pending_) line("waitEndMove()");
    pending_ = false;
  }

  void finish() override {
    const auto most = profile_.max_points;
    if (most > 0 && points_ > static_cast<std::size_t>(most))
      fail("the program has " + std::to_string(points_) + " data, more than the controller's " +
               std::to_string(most),
           "Split it into several programs.");
    Program& stop = programs_.emplace_back();
    stop.name = "stop";
    stop.code.in();
    stop.code.add("resetMotion()");
    File project;
    project.add_lines(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<Project xmlns=\"http://www.staubli.com/robotics/VAL3/Project/3\">");
    project.add("  <Parameters version=\"" + xml(option("version", "s7.11")) +
                "\" stackSize=\"5000\" millimeterUnit=\"true\" />");
    project.add("  <Programs>");
    for (const Program& p : programs_) project.add("    <Program file=\"" + p.name + ".pgx\" />");
    project.add_lines("  </Programs>\n  <Database>");
    project.add("    <Data file=\"" + app_ + ".dtx\" />");
    project.add_lines("  </Database>\n  <Libraries />\n</Project>");
    const std::string folder = app_ + "/";
    project.give(output_, folder + app_ + ".pjx", true);
    File all;
    all.add_lines(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<Database xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
        "xmlns=\"http://www.staubli.com/robotics/VAL3/Data/2\">\n  <Datas>");
    all.append(data_);
    all.add_lines("  </Datas>\n</Database>");
    all.give(output_, folder + app_ + ".dtx", true);
    for (Program& p : programs_) write_program(p, folder);
  }
  void write_program(Program& p, const std::string& folder) {
    File f;
    f.add_lines(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<Programs xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
        "xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">");
    f.add("  <Program name=\"" + p.name + "\"" +
          (p.name == "start" || p.name == "stop" ? "" : " access=\"public\"") + ">");
    if (!p.parameters.empty()) {
      f.add("    <Parameters xmlns=\"http://www.staubli.com/robotics/VAL3/Param/1\">");
      for (const std::string& l : p.parameters) f.add(l);
      f.add("    </Parameters>");
    }
    if (!p.locals.empty()) {
      f.add("    <Locals>");
      for (const std::string& l : p.locals) f.add(l);
      f.add("    </Locals>");
    }
    f.add("    <Code><![CDATA[begin");
    // Two brackets and > end a section: a[b[1]]>2 is written over two of them.
    for (std::string& l : p.code.lines())
      for (std::size_t at = 0; (at = l.find("]]>", at)) != std::string::npos; at += 15)
        l.replace(at, 3, "]]]]><![CDATA[>");
    f.append(p.code);
    f.add_lines("end]]></Code>\n  </Program>\n</Programs>");
    f.give(output_, folder + p.name + ".pgx", true);
  }

  // ---- words ----
  [[nodiscard]] std::span<const Operator> operators() const override {
    static constexpr Operator kAll[] = {{RMP_EXPR_OR, " or ", 1},
                                        {RMP_EXPR_AND, " and ", 2},
                                        {RMP_EXPR_EQUAL, " == ", 4},
                                        {RMP_EXPR_NOT_EQUAL, " != ", 4},
                                        {RMP_EXPR_EXOR, " != ", 5, Operator::infix, 4},
                                        {RMP_EXPR_LESS, " < ", 4},
                                        {RMP_EXPR_LESS_EQUAL, " <= ", 4},
                                        {RMP_EXPR_GREATER, " > ", 4},
                                        {RMP_EXPR_GREATER_EQUAL, " >= ", 4},
                                        {RMP_EXPR_ADD, " + ", 5},
                                        {RMP_EXPR_SUBTRACT, " - ", 5},
                                        {RMP_EXPR_MULTIPLY, " * ", 6},
                                        {RMP_EXPR_DIVIDE, " / ", 6},
                                        {RMP_EXPR_MOD, " % ", 6},
                                        {RMP_EXPR_NEGATE, "-", 7, Operator::prefix},
                                        {RMP_EXPR_NOT, "!", 8, Operator::prefix}};
    return kAll;
  }
  Text literal(const rmp_code_constant& k) override {
    if (k.kind == RMP_CONSTANT_INT && k.type == RMP_TYPE_BOOL)
      return {k.integer ? "true" : "false"};
    return BrandWriter::literal(k);
  }
  std::string zero(Kind k) override {
    return k == Kind::boolean ? "false" : k == Kind::real ? "0" : BrandWriter::zero(k);
  }
  Text string_literal(std::string_view s) override { return quoted(s, '"'); }
  std::string function(std::string_view n) override {
    static constexpr std::pair<const char*, const char*> kAll[] = {
        {"SIN", "sin"},   {"COS", "cos"},   {"TAN", "tan"},    {"ASIN", "asin"},
        {"ACOS", "acos"}, {"ATAN", "atan"}, {"SQRT", "sqrt"},  {"EXP", "exp"},
        {"LN", "ln"},     {"ABS", "abs"},   {"ROUND", "round"}};
    for (const auto& [irl, val3] : kAll)
      if (n == irl) return val3;
    return "";
  }
  /// Towards zero, for an argument that is repeated three times: roundDown() alone rounds a
  /// negative one down.
  Text truncated(const Text& x) {
    if (x.text.size() > 1000) {
      fail("nested DIV and TRUNC are too long for VAL3, which expresses them with sel()",
           "Assign the inner ones to variables first.");
      return {};
    }
    return {"sel(" + within(x, 5) + " < 0, roundUp(" + x.text + "), roundDown(" + x.text + "))"};
  }
  /// An expression with a text that is written more than once: its signals are read before.
  Text repeated(std::uint32_t e) {
    const bool outer = std::exchange(is_repeated_, true);
    Text out = expr(e);
    is_repeated_ = outer;
    return out;
  }
  std::optional<Text> operated(const rmp_code_expression& e) override {
    if (e.op != RMP_EXPR_DIV) return BrandWriter::operated(e);
    const auto of = links(e.first, e.count);
    const std::string left = within(repeated(of[0]), 6);
    return truncated({left + " / " + within(repeated(of[1]), 7), 6});
  }
  Text intrinsic(std::string_view name, std::span<const std::uint32_t> a,
                 const rmp_code_expression& e) override {
    if (name == "TRUNC" && a.size() == 1) return truncated(repeated(a[0]));
    return BrandWriter::intrinsic(name, a, e);
  }
  std::string transform(const Pose& p) override { return "{" + numbers(p) + "}"; }
  std::string translation(const std::string& x, const std::string& y,
                          const std::string& z) override {
    return "{" + x + ", " + y + ", " + z + ", 0, 0, 0}";
  }
  std::string rotation(std::size_t axis, const std::string& d) override {
    std::string out = "{0, 0, 0";
    for (std::size_t i = 0; i < 3; ++i) out += ", " + (i == axis ? d : "0");
    return out + "}";
  }
  Text product(const Text& a, const Text& b) override {
    return {within(a, 6) + " * " + within(b, 7), 6};
  }
  Text inverse_of(const Text& a) override { return {"!" + within(a, 8), 8}; }
  std::string component(const std::string& of, std::size_t axis) override {
    if (of.empty() || of[0] == '{' || of[0] == '(') {
      cannot("parts of a computed transform", "Keep it in a variable first.");
      return "0";
    }
    return of + "." + "xyz"[axis];
  }
  void set_component(const std::string& of, std::size_t axis, const std::string& to) override {
    line(of + "." + "xyz"[axis] + " = " + to);
  }
  std::string element(const std::string& n, const std::vector<std::string>& i,
                      const std::vector<brand::Bounds>& b) override {
    return n + "[" + counted(i, b, 0) + "]";
  }
  void assign_text(const std::string& to, Kind, const std::string& value) override {
    line(to + " = " + value);
  }
  std::string spelled(std::uint32_t, Kind, const std::string& n) override { return n; }

  // ---- calls ----
  std::string temporary(Kind k) override {
    const std::string to = names_.unique("l_f" + std::to_string(++programs_.back().temporaries));
    local(to, type_of(k));
    return to;
  }
  std::string call_line(const std::string& n, const std::string& arguments) override {
    return "call " + n + "(" + arguments + ")";
  }
  void if_begin(std::uint32_t c) override {
    settle_for(c);
    const std::string s = text(c);
    open("if " + s);
  }
  void else_if(std::uint32_t c) override { middle("elseIf " + asked_again(c)); }
  void else_() override { middle("else"); }
  void if_end() override { close("endIf"); }
  void while_begin(std::uint32_t c) override {
    loop_asks(c);
    open("while " + asked_again(c));
  }
  void while_end() override {
    loop_asks_again();
    close("endWhile");
  }
  void repeat_begin() override { open("do"); }
  void repeat_end(std::uint32_t until) override {
    settle_for(until);
    close("until " + asked_again(until));
  }
  void loop_begin() override { open("while true"); }
  void loop_end() override { close("endWhile"); }
  void for_begin(std::uint32_t s, std::uint32_t from, std::uint32_t to, std::uint32_t step,
                 bool down) override {
    open("for " + leaf_name(s, "", Kind::integer) + " = " +
         range(from, to, step, down, " to ", " step ", 8));
  }
  void for_end(std::uint32_t) override { close("endFor"); }
  void return_(std::uint32_t value) override {
    settle();
    if (value != RMP_NONE) {
      const std::string v = text(value);
      line(result_ + " = " + v);
    }
    line("return");
  }

  // ---- signals and time ----
  Text input(const Signal& s) override { return signal_text(s); }
  Text output(const Signal& s) override { return signal_text(s); }
  std::string name_of(const Signal& s) {
    for (const auto& [symbol, x] : signals_)
      if (x.number == s.number && x.target == s.target && x.is_output == s.is_output &&
          x.type == s.type && x.width == s.width)
        return name(symbol);
    return "io";
  }
  Text signal_text(const Signal& s) {
    const std::string n = name_of(s);
    if (s.type == RMP_TYPE_REAL || s.type == RMP_TYPE_INT) {
      std::string read = (s.type == RMP_TYPE_REAL ? "aioGet(" : "dioGet(") + n + ")";
      return is_repeated_ ? read_once(read) : Text{std::move(read)};
    }
    return s.inverted ? Text{"!" + n, 8} : Text{n};
  }
  /// The value of a signal that occurs several times in one expression.
  Text read_once(const std::string& read) {
    if (!may_call_) {
      fail(
          "a signal within DIV or TRUNC cannot be posted in a condition that is evaluated "
          "repeatedly",
          "Assign its value to a variable before, and at the end of the loop.");
      return {};
    }
    settle();
    const std::string to = temporary(Kind::real);
    line(to + " = " + read);
    return {to};
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    const std::string n = name_of(s);
    const Text v = expr(value);
    settle();
    if (s.type == RMP_TYPE_REAL) line("aioSet(" + n + ", " + v.text + ")");
    else if (s.type == RMP_TYPE_INT) line("dioSet(" + n + ", " + v.text + ")");
    else if (const auto b = constant_bool(value, s.inverted))
      line(n + (*b ? " = true" : " = false"));
    else line(n + " = " + (s.inverted ? "!" + within(v, 8) : v.text));
  }
  void wait_time(std::uint32_t seconds) override {
    settle();
    line("delay(" + text(seconds) + ")");
  }
  void wait_for(std::uint32_t condition, std::uint32_t timeout) override {
    settle();
    const std::string c = asked_again(condition);
    const std::uint32_t flag = system_symbol("R_TIMEOUT");
    const bool keeps = flag != RMP_NONE && is_used(flag);
    if (timeout == RMP_NONE) {
      line("wait(" + c + ")");
      if (keeps) line(leaf_name(flag, "", Kind::boolean) + " = false");
      return;
    }
    if (!keeps && !std::exchange(programs_.back().has_flag, true)) local("l_bSeen", "bool");
    line((keeps ? leaf_name(flag, "", Kind::boolean) + " = !" : std::string("l_bSeen = ")) +
         "watch(" + c + ", " + text(timeout) + ")");
  }
  void halt() override {
    settle();
    line("taskKill(\"" + app_ + "~\")");
  }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    std::string all;
    for (const std::uint32_t v : values) {
      if (!is_word(v)) return;
      const Kind k = kind(expression(v).type);
      const std::string t = within(expr(v), 6);
      all += (all.empty() ? "" : " + ") +
             (k == Kind::string ? t
              : k == Kind::boolean
                  ? "toString(\"\", sel(" + t + ", 1, 0))"
                  : "toString(\"" + std::string(k == Kind::real ? ".6" : "") + "\", " + t + ")");
    }
    if (!ends_line) note("VAL3 writes each message on a separate line");
    settle();
    line("logMsg(" + (all.empty() ? "\"\"" : all) + ")");
  }
  void process(std::uint32_t op, std::uint32_t r, std::uint32_t) override {
    const std::string n = routine_name(r);
    switch (op) {
      case RMP_STMT_START: {
        const auto p = known(routine(r).priority);
        // 1 to 100 lines a turn, where a higher priority of IRL is a greater number.
        const double share = p ? std::clamp(*p, 1.0, 100.0) : 10.0;
        if (p && share != *p) warn("the priority is posted as " + trimmed(share, 0));
        line("taskCreate \"" + n + "\", " + trimmed(share, 0) + ", " + n + "()");
        return;
      }
      case RMP_STMT_STOP: line("taskSuspend(\"" + n + "\")"); return;
      case RMP_STMT_CONTINUE: line("taskResume(\"" + n + "\", 0)"); return;
      default: line("taskKill(\"" + n + "\")"); return;
    }
  }

  // ---- motions ----
  bool has_speed_ori() const override { return true; }
  std::string config(const brand::Goal& g) {
    static constexpr struct {
      std::uint32_t bit;
      const char *name, *same, *usual, *other;
    } kBits[] = {{kPostShoulderBehind, "shoulder", "ssame", "lefty", "righty"},
                 {kPostElbowOther, "elbow", "esame", "epositive", "enegative"},
                 {kPostWristFlipped, "wrist", "wsame", "wpositive", "wnegative"}};
    std::string out;
    if (g.point && g.point->status_known != 0 && !g.point->q.empty()) axes_are_needed();
    std::uint32_t status = g.point ? g.point->status : 0;
    // "enegative" is the sign of joint 3, which a shoulder behind turns round.
    status = (status & ~std::uint32_t{kPostElbowOther}) |
             (wrist_behind_lower_arm(status) ? kPostElbowOther : 0U);
    for (const auto& b : kBits) {
      const bool knows = g.point && (g.point->status_known & b.bit);
      // The words of a controller's first pose are data: option "shoulder" = word of bit 0.
      const std::string_view usual = option(b.name, b.usual);
      const std::string_view other = usual == b.other ? b.usual : b.other;
      out += std::string(" ") + b.name + "=\"" +
             std::string(!knows             ? b.same
                         : (status & b.bit) ? other
                                            : usual) +
             "\"";
    }
    return out;
  }
  std::string placed_datum(const char* prefix, const char* type, const brand::Placing& p,
                           const std::string& father) {
    if (!p.text.empty()) {
      const std::string n = datum(prefix, type, attributes(Pose{}) + father + " ");
      line(n + ".trsf = " + p.text);
      return n;
    }
    return datum(prefix, type, attributes(*p.pose) + father);
  }
  void write_move(const Motion& m, const brand::Move& x) override {
    const bool is_rs = task_.robot && task_.robot->coordinate_count() == 4;
    const std::string tool = placed_datum(
        "tTool", "tool", x.tool.pose || !x.tool.text.empty() ? x.tool : brand::Placing{Pose{}, ""},
        " fatherId=\"flange[0]\" ioLink=\"" + xml(option("tool_io", "valve1")) + "\"");
    std::string frame = "world";
    const bool has_frame =
        !x.frame.text.empty() ||
        (x.frame.pose && (x.frame.pose->p != Pose{}.p || x.frame.pose->R != Pose{}.R));
    if (has_frame) frame = placed_datum("fFrame", "frame", x.frame, " fatherId=\"world[0]\"");
    const std::string how = description(x);
    if (how.empty()) return;
    std::vector<std::string> goals;
    if (x.incremental) {
      // From its current position: the arm must be at rest there.
      line("waitEndMove()");
      point_variable();
      line("l_pTo = here(" + tool + ", " + frame + ")");
      for (std::size_t k = 0; k < 3; ++k)
        line(std::string("l_pTo.trsf.") + "xyz"[k] + " = l_pTo.trsf." + "xyz"[k] + " + " +
             length(x.goals[0].pose->p[k] * 1000));
      goals.emplace_back("l_pTo");
    }
    for (const brand::Goal& g : x.goals) {
      if (x.incremental) break;
      if (g.is_joints) {
        if (g.axes.size() != 6 && g.axes.size() != 4) {
          fail(
              "VAL3 has robots of 6 or 4 axes, and the target has " + std::to_string(g.axes.size()),
              "Give the profile the axes of the controller.");
          return;
        }
        std::string v;
        for (std::size_t i = 0; i < g.axes.size(); ++i)
          v += std::string(i ? " " : "") + "j" + std::to_string(i + 1) + "=\"" + angle(g.axes[i]) +
               "\"";
        goals.push_back(datum("jTo", g.axes.size() == 6 ? "jointRx" : "jointRs", v));
      } else if (g.pose) {
        goals.push_back(datum(
            "pTo", is_rs ? "pointRs" : "pointRx",
            attributes(*g.pose) + (is_rs ? "" : config(g)) + " fatherId=\"" + frame + "[0]\""));
      } else {
        if (x.goals.size() > 1) {
          cannot("circles through points computed at run time");
          return;
        }
        point_variable();
        if (has_frame) line("link(l_pTo, " + frame + ")");
        line("l_pTo.trsf = " + g.text);
        goals.emplace_back("l_pTo");
      }
    }
    const char* verb = x.goals.size() == 2 ? "movec(" : x.is_ptp ? "movej(" : "movel(";
    std::string all;
    for (const std::string& g : goals) all += g + ", ";
    line(verb + all + tool + ", " + how + ")");
    if (m.until != RMP_NONE) {
      const std::string c = asked_again(m.until);
      line("wait((" + c + ") or isEmpty())");
      if (m.action != RMP_NONE) {
        open("if !isEmpty()");
        line("resetMotion()");
        line("waitEndMove()");
        line("call " + routine_name(m.action) + "()");
        middle("else");
        line("waitEndMove()");
        close("endIf");
      } else {
        line("resetMotion()");
        line("waitEndMove()");
      }
      pending_ = false;
      return;
    }
    if (!x.passes) line("waitEndMove()");
    pending_ = x.passes;
  }
  void point_variable() {
    if (std::exchange(programs_.back().has_point, true)) return;
    local("l_pTo", task_.robot && task_.robot->coordinate_count() == 4 ? "pointRs" : "pointRx");
  }
  /// The datum of speeds and blending.
  std::string description(const brand::Move& x) {
    const brand::Number mm = blend_mm(x);
    const bool is_known = x.speed.known && x.speed_ori.known && x.acc.known && mm.known;
    const auto value = [&](const brand::Number& n, double otherwise) {
      return n.known ? number(*n.known, profile_.speed_digits) : trimmed(otherwise, 0);
    };
    const std::string share = x.is_ptp ? value(x.speed, 100) : "100";
    const std::string acc = value(x.acc, 100);
    const std::string far = x.passes ? length(mm.known.value_or(0)) : "0";
    const std::string values = "accel=\"" + acc + "\" vel=\"" + share + "\" decel=\"" + acc +
                               "\" tmax=\"" + (x.is_ptp ? "99999" : value(x.speed, 250)) +
                               "\" rmax=\"" + (x.is_ptp ? "99999" : value(x.speed_ori, 90)) +
                               "\" blend=\"" + (x.passes ? "joint" : "off") + "\" leave=\"" + far +
                               "\" reach=\"" + far + "\"";
    if (is_known) return datum("mMove", "mdesc", values);
    // A datum with components that are set before each use.
    const std::string n = datum("mMove", "mdesc", values + " ");
    if (!x.speed.known) line(n + (x.is_ptp ? ".vel = " : ".tvel = ") + x.speed.text);
    if (!x.is_ptp && !x.speed_ori.known) line(n + ".rvel = " + x.speed_ori.text);
    if (!x.acc.known) {
      line(n + ".accel = " + x.acc.text);
      line(n + ".decel = " + x.acc.text);
    }
    if (!mm.known) {
      line(n + ".leave = " + mm.text);
      line(n + ".reach = " + mm.text);
    }
    return n;
  }

  std::string app_, result_;
  std::vector<Program> programs_;
  File data_;
  std::map<std::string, std::string> kept_;
  std::map<std::string, int> counts_;
  std::map<std::uint32_t, Signal> signals_;
  std::size_t points_ = 0;
  bool pending_ = false;
  bool is_repeated_ = false;  ///< the text being written is repeated in its expression
};

}  // namespace

const PostCapabilities& Val3::capabilities() const { return val3_capabilities(); }

Result<void> Val3::write(const PostTask& task, const Params&, PostOutput& output,
                         Progress& progress) const {
  return Val3Writer(task, output, progress).run();
}

}  // namespace robomosp::post::val3

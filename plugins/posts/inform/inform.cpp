// SPDX-License-Identifier: Apache-2.0
// A job has its positions first, C00000 and on: pulses of the axes, or poses in the base (BASE).
// Variables of a job (I, R, B) exist but no names and few expressions, so that this post takes
// straight programs with waits; control flow is what flattening is for.
#include "inform.h"

#include <robomosp/sdk/post_passing.h>

#include "../common/straight.h"

namespace robomosp::post {
namespace {

class InformWriter final : public StraightWriter {
 public:
  using StraightWriter::StraightWriter;

 private:
  struct Position {
    std::string kind, conf, text;
    int tool = 0;
    rmp_span from{};
  };
  struct Job {
    File lines{0};
    std::vector<Position> points;
    std::map<std::string, std::size_t> known;
  };

  void begin() override {
    out_ = &job_.lines;
    pl_mm_ = number_option("pl_mm", 10);
    const std::string_view wish = option("postype");
    if (!wish.empty() && upper(wish) != "PULSE" && upper(wish) != "BASE") {
      fail("the profile's option postype is \"" + std::string(wish) + "\"", "Give PULSE or BASE.");
    }
    // Pulses where every axis of the profile has them.
    bool all = false;
    for (const PostAxis& a : profile_.axes)
      if (!a.external) all = true;
    for (const PostAxis& a : profile_.axes) all = all && (a.external || a.pulses != 0);
    pulses_ = wish.empty() ? all : upper(wish) == "PULSE";
    if (pulses_ && !all)
      fail("the profile has no pulses for each axis of the robot",
           "Give its axes pulses per degree (or mm), or set the option postype = BASE.");
    tool_ = profile_.tool >= 0 && static_cast<std::size_t>(profile_.tool) < profile_.tools.size()
                ? profile_.tools[static_cast<std::size_t>(profile_.tool)].number
                : 0;
    if (tool_ < 0) {
      fail("the profile's tool at the start has no number", "Give it its number.");
      tool_ = 0;
    }
    if (profile_.frame >= 0)
      note("poses are written in the robot's base: the profile's frame is not used");
    if (!profile_.prologue.empty()) job_.lines.add_lines(profile_.prologue);
  }
  /// Parts of a program that is too long for one job are jobs that it calls.
  void routine_begin(std::uint32_t r) override {
    if (r == 0) return;
    program_ = std::exchange(job_, {});
    out_ = &job_.lines;
  }
  void routine_end(std::uint32_t r) override {
    if (r == 0) return;
    finished_.emplace_back(r, std::exchange(job_, std::exchange(program_, {})));
  }
  void call(std::uint32_t r, std::span<const std::uint32_t>) override {
    line("CALL JOB:" + routine_name(r));
    arrived(std::nullopt);
    start_.clear();
  }
  void finish() override {
    if (!profile_.epilogue.empty()) job_.lines.add_lines(profile_.epilogue);
    give(0, job_);
    for (const auto& [r, job] : finished_) give(r, job);
  }
  void give(std::uint32_t r, const Job& job) {
    at_ = routine(r).span;
    const std::string job_name = r == 0 ? std::string(task_.name) : routine_name(r);
    const std::size_t most =
        static_cast<std::size_t>(profile_.max_points > 0 ? profile_.max_points : caps_.max_points);
    if (job.points.size() > most)
      fail("the job has " + std::to_string(job.points.size()) + " positions, and a job allows " +
               std::to_string(most),
           "Split the program, or set the controller's limit in the profile (max_points).");
    const rmp_span head = routine(r).span;
    File all(0);
    const auto add = [&](const std::string& s) { all.add(s, &head); };
    add("/JOB");
    add("//NAME " + job_name);
    add("//POS");
    add("///NPOS " + std::to_string(job.points.size()) + ",0,0,0,0,0");
    int tool = -1;
    std::string kind, conf;
    for (const Position& p : job.points) {
      if (p.tool != tool) add("///TOOL " + std::to_string(p.tool));
      tool = p.tool;
      if (p.kind != kind) {
        add("///POSTYPE " + p.kind);
        if (p.kind == "PULSE") {
          add("///PULSE");
        } else {
          add("///RECTAN");
          conf.clear();
        }
      }
      kind = p.kind;
      if (p.kind != "PULSE" && p.conf != conf) add("///RCONF " + p.conf);
      conf = p.conf;
      all.add(p.text, &p.from);
    }
    add("//INST");
    add("///DATE " + std::string(option("date", "2000/01/01 00:00")));
    const bool is_relative = std::any_of(job.points.begin(), job.points.end(),
                                         [](const Position& p) { return p.kind == "BASE"; });
    add(is_relative ? "///ATTR SC,RW,RJ" : "///ATTR SC,RW");
    if (is_relative) add("////FRAME BASE");
    add("///GROUP1 RB1");
    add("NOP");
    all.append(job.lines);
    add("END");
    all.give(output_, job_name + ".JBI", true);
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    at_ = symbol(s).span;
    cannot("variables with names", "Post the flattened program (form = \"flat\").");
  }
  std::string add(std::string kind, std::string conf, const std::string& numbers) {
    const auto [it, is_new] = job_.known.try_emplace(
        kind + conf + std::to_string(tool_now_) + numbers, job_.points.size());
    std::string n = std::to_string(it->second);
    n = "C" + std::string(n.size() < 5 ? 5 - n.size() : 0, '0') + n;
    if (is_new)
      job_.points.push_back({std::move(kind), std::move(conf), n + "=" + numbers, tool_now_, at_});
    return n;
  }
  /// Name of a target's position; empty = said.
  std::string target(const Motion& m, const Target& t) {
    bool has_external = false;
    for (const PostAxis& a : profile_.axes) has_external = has_external || a.external;
    if (has_external) {
      cannot("additional axes (BC, EC) by this post", "Remove them from the profile.");
      return {};
    }
    no_external(t.point);
    if (m.incremental && is_joints(t.role)) {
      cannot("increments of joints", "Give joints, or an increment of the pose.");
      return {};
    }
    const bool moved = m.incremental || t.role == RMP_ROLE_POSITION ||
                       (m[RMP_ATTR_FRAME].given && t.point && t.point->q.empty());
    if (pulses_ || is_joints(t.role)) {
      if (!t.point) {
        (void)certain_goal(m, t);
        return {};
      }
      PostPoint p = *t.point;
      std::vector<double> q;
      if (moved && !is_joints(t.role)) {
        // Another place than the expression says: its joints are asked for anew.
        const auto at = certain_goal(m, t);
        if (!at) return {};
        if (!task_.kinematics || !task_.robot) {
          fail("the joint values of this target are unknown, since no robot is named",
               "Name the robot: program.post{robot = ...}, or post BASE positions.");
          return {};
        }
        if (q_before_.empty()) q_before_.assign(task_.robot->coordinate_count(), 0.0);
        auto found = task_.kinematics->inverse(product(*at, inverse(tool_pose_)), q_before_, -1);
        if (!found.ok()) {
          fail(found.error().message, found.error().hint);
          return {};
        }
        q = *found;
        p.q = q;
      }
      const auto values = checked_axes(p);
      if (values.empty()) return {};
      q_before_.assign(p.q.begin(), p.q.end());
      std::string numbers;
      std::size_t i = 0;
      for (const PostAxis& a : profile_.axes) {
        if (a.external) continue;
        if (a.pulses == 0) {
          fail("axis " + std::string(a.name) + " of the profile has no pulses",
               "Joints are written in pulses: give the axis its pulses per degree.");
          return {};
        }
        const double v = values[i++] * a.pulses;
        if (!(std::fabs(v) < 2147483647.0)) {
          fail("axis " + std::string(a.name) + " would be at " + shortest(v) + " pulses",
               "Check the pulses of the profile.");
          return {};
        }
        numbers += (numbers.empty() ? "" : ",") + fixed(v, 0);
      }
      if (numbers.empty()) {
        fail("joints are written in pulses, and the profile has no axes",
             "Give its axes pulses per degree.");
        return {};
      }
      return add("PULSE", "", numbers);
    }
    const auto at = certain_goal(m, t);
    if (!at) return {};
    const Placed x = placed(*at, Orientation::fixed_xyz);
    std::string numbers;
    for (std::size_t i = 0; i < 3; ++i) numbers += (i ? "," : "") + number(x.mm[i], 3);
    for (std::size_t i = 0; i < 3; ++i) numbers += "," + number(x.ori[i], 4);
    // RCONF: 1 no flip, 0 upper arm, 0 front, 0 R, T and S within 180 degrees.
    std::uint32_t status = 0;
    std::string turns = ",0,0,0";
    if (t.point && (t.point->has_status || !t.point->q.empty())) {
      status = t.point->status;
      if (!t.point->q.empty()) (void)checked_axes(*t.point);
      turns.clear();
      // R, T and S: whether beyond 180 degrees, whichever way.
      for (const std::size_t k : {3U, 5U, 0U}) {
        const int turn = axis_turn(*t.point, k).value_or(0);
        turns += turn != 0 ? ",1" : ",0";
        if (turn < -1 || turn > 1)
          warn("the axis makes " + std::to_string(turn) +
                   " turns, and RCONF states only that it is beyond 180 degrees",
               "Post positions in pulses (postype = PULSE).");
      }
      if (t.point->q.empty() && !t.point->turns.empty() && t.point->turns_from != kTurnsFrom)
        no_turns(t.point);
    } else {
      warn("the configuration of this target is unknown and is written as 1,0,0,0,0,0,0,0",
           "Name the robot: program.post{robot = ...}, or give a ROBTARGET.");
    }
    const std::string conf = std::string((status & kPostWristFlipped) ? "0" : "1") +
                             ((status & kPostElbowOther) ? ",1" : ",0") +
                             ((status & kPostShoulderBehind) ? ",1" : ",0") + turns + ",0,0";
    return add("BASE", conf, numbers);
  }
  /// PL; ACC and DEC.
  std::pair<std::string, std::string> tail(const Motion& m, bool is_ptp) {
    const std::uint32_t a = is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP;
    const double r = certain(m, a, is_ptp ? "C_PTP" : "C_CP", 0);
    int pl = 0;
    if (r > 0) {
      // Levels of positioning: 0 stops, 1 to 8 pass ever farther away.
      const double level = is_ptp ? 8 * r / 100 : r / pl_mm_;
      pl = std::clamp(static_cast<int>(std::ceil(level - 1e-9)), 1, 8);
      note((is_ptp ? "C_PTP of " : "C_CP of ") + trimmed(r, 2) + (is_ptp ? " %" : " mm") +
               " is written as PL=" + std::to_string(pl),
           "The profile's option pl_mm sets the distance in mm per level.");
    } else if (m[RMP_ATTR_C_PASS].known.value_or(0) != 0) {
      pl = 8;
      note("C_PASS without a distance is written as PL=8, and the simulated robot " +
               post::at_c_pass_in_a_run(*task_.code, m),
           std::string("Give ") + (is_ptp ? "C_PTP." : "C_CP."));
    }
    const std::uint32_t acc = is_ptp && !m[RMP_ATTR_ACC].given ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    const double v = certain(m, acc, "the acceleration", 100, 20, 100);
    return {" PL=" + std::to_string(pl),
            v != 100 ? " ACC=" + fixed(v, 0) + " DEC=" + fixed(v, 0) : ""};
  }
  std::string speed(const Motion& m, bool is_ptp) {
    if (has_time(m)) cannot("TIME of motions", "Give SPEED or SPEED_PTP.");
    if (is_ptp) {
      const double v = certain(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", 100, 0.01, 100);
      return " VJ=" + fixed(v, 2);
    }
    if (m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: the tool rotates with the path", "Give a lower SPEED.");
    const double v = certain(m, RMP_ATTR_SPEED, "SPEED", 250, 0.1, 1500);
    if (std::fabs(v * 10 - std::round(v * 10)) > 1e-9)
      warn("a speed of " + trimmed(v, 4) + " mm/s is rounded to tenths");
    return " V=" + fixed(v, 1);
  }
  bool prepare(const Motion& m) {
    if (!plain(m)) return false;
    if (has_other_tool_) start_.clear();
    tool_now_ = tool_;
    tool_pose_ =
        profile_.tool >= 0 ? profile_.tools[static_cast<std::size_t>(profile_.tool)].pose : Pose{};
    if (m[RMP_ATTR_TOOL].given) {
      const auto p = pose_of(m, RMP_ATTR_TOOL, "TOOL");
      if (!p) return false;
      const auto n = place_number(profile_.tools, *p, "tool");
      if (!n) return false;
      tool_now_ = *n;
      tool_pose_ = *p;
    }
    return true;
  }
  std::string until(const Motion& m) {
    if (m.until == RMP_NONE) return {};
    const auto t = signal_test(m.until);
    if (!t || t->signal.type != RMP_TYPE_BOOL || m.action != RMP_NONE) {
      cannot("UNTIL with conditions other than one BOOL signal, or with DO",
             "Use one signal for the condition.");
      return {};
    }
    return " UNTIL " + place(t->signal) + "=" + (wanted(*t) ? "ON" : "OFF");
  }
  void ptp(const Motion& m) override { simple(m, true); }
  void lin(const Motion& m) override { simple(m, false); }
  void simple(const Motion& m, bool is_ptp) {
    if (!prepare(m)) return;
    const std::string to = target(m, m.targets[0]);
    if (to.empty()) return;
    // The controller lists its tags in this order: PL, UNTIL, ACC, DEC.
    const auto [level, dynamics] = tail(m, is_ptp);
    line((is_ptp ? "MOVJ " : "MOVL ") + to + speed(m, is_ptp) + level + until(m) + dynamics);
    arrived(m.until == RMP_NONE ? goal(m, m.targets[0]) : std::nullopt);
    start_ = m.until == RMP_NONE ? to : "";
  }
  void circle(const Motion& m) override {
    if (!prepare(m) || !no_until(m)) return;
    if (m.incremental) {
      cannot("circles through increments", "Give poses.");
      return;
    }
    if (start_.empty()) {
      fail("a circle begins at the job's previous position, and there is none",
           "Begin with a MOVE to the start of the circle.");
      return;
    }
    const std::string via = target(m, m.targets[0]), to = target(m, m.targets[1]);
    if (via.empty() || to.empty()) return;
    // Three MOVC: where the arc starts (the robot is there), through, and to.
    const std::string v = speed(m, false);
    line("MOVC " + start_ + v + " PL=0");
    line("MOVC " + via + v);
    const auto [level, dynamics] = tail(m, false);
    line("MOVC " + to + v + level + dynamics);
    arrived(goal(m, m.targets[1]));
    start_ = to;
  }
  std::string place(const Signal& s) {
    if (s.number < 1 || s.number > 1024)
      fail("signal " + std::to_string(s.number) + " is not one of the general signals, 1 to 1024",
           "Give the profile a number for this signal.");
    return std::string(s.is_output ? "OT#(" : "IN#(") + std::to_string(s.number) + ")";
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (s.type == RMP_TYPE_REAL) {
      const auto v = output_value(s, value);
      if (!v) return;
      if (s.number < 1 || s.number > 40)
        fail("signal " + std::to_string(s.number) + " is not one of the analogue signals, 1 to 40",
             "Give the profile a number for this signal.");
      if (!(std::fabs(*v) <= 14))
        fail("an analogue output of " + trimmed(*v, 3) + " V", "The range is -14 to 14 V.");
      line("AOUT AO#(" + std::to_string(s.number) + ") " + fixed(*v, 2));
      return;
    }
    for (const auto& [n, on] : bits(s, value)) {
      Signal one = s;
      one.number = n;
      line("DOUT " + place(one) + (on ? " ON" : " OFF"));
    }
  }
  void wait_time(std::uint32_t e) override {
    const auto v = seconds(e, 655.35);
    if (!v) return;
    const std::string s = fixed(*v, 2);
    if (std::fabs(*v * 100 - std::round(*v * 100)) > 1e-6)
      warn("the wait is rounded to " + s + " s: INFORM counts hundredths");
    line("TIMER T=" + s);
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    const auto t = signal_test(c);
    if (!t || t->signal.type != RMP_TYPE_BOOL) {
      cannot("WAIT FOR with conditions other than one BOOL signal",
             "Use one signal for the condition.");
      return;
    }
    std::string s = "WAIT " + place(t->signal) + "=" + (wanted(*t) ? "ON" : "OFF");
    if (timeout != RMP_NONE) {
      const auto v = seconds(timeout, 655.35);
      if (!v) return;
      s += " T=" + fixed(*v, 2);
    }
    line(s);
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    auto s = constant_text(values);
    if (!s) return;
    if (s->size() > 32) {
      warn("the text is cut to the 32 characters of INFORM: \"" + s->substr(0, 32) + "\"",
           "Write a shorter text.");
      s->resize(32);
    }
    line("MSG \"" + plain_text(*s, '"') + "\"");
  }
  void pause(std::uint32_t text_of) override {
    if (text_of != RMP_NONE) {
      const std::uint32_t one[] = {text_of};
      message(one, true);
    }
    line("PAUSE");
  }
  void halt() override { line("ABORT"); }
  void return_(std::uint32_t) override { line("RET"); }

  Job job_, program_;  ///< the one that is written; the program while a part is
  std::vector<std::pair<std::uint32_t, Job>> finished_;
  std::vector<double> q_before_;
  std::string start_;
  bool pulses_ = false;
  int tool_ = 0, tool_now_ = 0;
  Pose tool_pose_;  ///< of tool_now_ on the flange
  double pl_mm_ = 10;
};

}  // namespace

const PostCapabilities& Inform::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.forms = kPostFlat;
    c.features = kPostWaitFor | kPostWaitTimeout | kPostUntil | kPostMessages | kPostPause |
                 kPostTools | kPostFrames | kPostReturn | kPostParts;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle;
    c.circle = PostCircle::via;
    c.blending = PostBlending::zone;
    c.max_name = 8;
    c.name_case = PostCase::upper;
    c.crlf = true;
    c.max_points = 99'999;
    c.max_lines = 9999;
    c.extensions = "jbi";
    c.title = "INFORM";
    return c;
  }();
  return kAll;
}

Result<void> Inform::write(const PostTask& task, const Params&, PostOutput& output,
                           Progress& progress) const {
  return InformWriter(task, output, capabilities(), progress).run();
}

}  // namespace robomosp::post

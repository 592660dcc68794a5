// SPDX-License-Identifier: Apache-2.0
// The Movemaster has five axes: a hand that lies in the plane through the waist, its pitch and its
// roll. Positions are defined first by commands that run at once (PD); numbered lines are stored.
#include "movemaster.h"

#include "../common/straight.h"

namespace robomosp::post {
namespace {

class MovemasterWriter final : public StraightWriter {
 public:
  using StraightWriter::StraightWriter;

 private:
  void begin() override {
    out_ = &lines_;
    speed_ = number_option("speed", 1000);
    step_mm_ = number_option("step_mm", 10);
    roll_ = number_option("roll", 0);
    if (speed_ <= 0 || step_mm_ <= 0)
      fail("the profile's options speed and step_mm are above 0", "Give other values.");
    const auto common = common_place(RMP_ATTR_TOOL);
    is_tool_common_ = common.has_value();
    if (common ||
        (profile_.tool >= 0 && static_cast<std::size_t>(profile_.tool) < profile_.tools.size())) {
      const Pose& t =
          common ? *common : profile_.tools[static_cast<std::size_t>(profile_.tool)].pose;
      const double z = t.p[2] * 1000;
      Pose along;
      along.p[2] = t.p[2];
      if (!same_place(t, along) || z < 0 || z > 300)
        fail("the initial tool is not one that the Movemaster supports",
             "A tool there is a length along the hand, 0 to 300 mm (TL).");
      else put("TL " + fixed(z, 0));
      if (std::fabs(z - std::round(z)) > 1e-6)
        warn("the tool's length of " + trimmed(z, 3) + " mm is written as " + fixed(z, 0) + " mm",
             "The Movemaster takes whole millimetres (TL).");
    }
    if (profile_.frame >= 0)
      note("positions are written in the robot's base: the Movemaster has no other frames");
    if (!profile_.prologue.empty()) lines_.add_lines(profile_.prologue);
  }
  void put(const std::string& s) { line(std::to_string(lines_.size() + 1) + " " + s); }
  void finish() override {
    if (!profile_.epilogue.empty()) lines_.add_lines(profile_.epilogue);
    put("ED");
    const auto limit = [&](std::size_t n, std::int32_t own, std::int32_t there, const char* what) {
      const auto most = static_cast<std::size_t>(own > 0 ? own : there);
      if (n > most)
        fail("the program has " + std::to_string(n) + " " + what + ", and the Movemaster allows " +
                 std::to_string(most),
             "Split the program.");
    };
    limit(points_.size(), profile_.max_points, caps_.max_points, "positions");
    limit(lines_.size(), profile_.max_lines, caps_.max_lines, "lines");
    if (points_.size() > 0)
      note("positions are rounded to 0.1 mm and 0.1 degrees, the resolution of the Movemaster");
    File all(0);
    for (const auto& [s, from] : positions_) all.add(s, &from);
    all.append(lines_);
    all.give(output_, std::string(task_.name) + ".rm1", true);
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    at_ = symbol(s).span;
    cannot("variables", "Post the flattened program (form = \"flat\").");
  }
  /// Number of the position; 0 = said.
  std::size_t position(const Motion& m, const Target& t) {
    no_external(t.point);
    no_turns(t.point);
    if (is_joints(t.role) && !m.incremental && t.point && t.point->has_pose &&
        !std::exchange(told_joints_, true))
      note("joint values are written as the resulting pose: MJ moves by angles only");
    const auto at = certain_goal(m, t);
    if (!at) return 0;
    const Vec3& p = at->p;
    const std::array<double, 9>& r = at->R;
    // The plane of the arm, and how far the hand leans out of it.
    const double away = std::hypot(p[0], p[1]);
    const double c = away < 1e-6 ? 1 : p[0] / away, s = away < 1e-6 ? 0 : p[1] / away;
    const Vec3 a{r[2], r[5], r[8]}, y{r[1], r[4], r[7]};
    const double out = -s * a[0] + c * a[1];
    if (std::fabs(out) > 0.0018) {
      fail("the hand would tilt out of the plane of the arm by " +
               trimmed(std::asin(std::clamp(out, -1.0, 1.0)) * kDegree, 2) +
               " degrees: the Movemaster has five axes",
           "Turn the tool into the plane through the waist.");
      return 0;
    }
    const double pitch = std::atan2(a[2], c * a[0] + s * a[1]) * kDegree;
    // Roll: from the horizontal across the plane to the tool's y, about the hand.
    const Vec3 across{-s, c, 0};
    const Vec3 up{a[1] * across[2] - a[2] * across[1], a[2] * across[0] - a[0] * across[2],
                  a[0] * across[1] - a[1] * across[0]};
    const double roll = std::atan2(y[0] * up[0] + y[1] * up[1] + y[2] * up[2],
                                   y[0] * across[0] + y[1] * across[1] + y[2] * across[2]) *
                            kDegree +
                        roll_;
    std::string text;
    for (const double v : {p[0] * 1000, p[1] * 1000, p[2] * 1000, pitch, roll})
      text += "," + number(v, 1);
    const auto [n, is_new] = points_.add(text);
    if (is_new) positions_.emplace_back("PD " + std::to_string(n + 1) + text, at_);
    return n + 1;
  }
  void select(double share) {
    const double exact = 9 * share;
    const int level = std::clamp(static_cast<int>(std::round(exact)), 0, 9);
    if (std::fabs(exact - level) > 1e-9)
      note("the speed is written as SP " + std::to_string(level) +
               ", the nearest of the ten of the Movemaster",
           "The profile's option speed sets the mm/s of SP 9.");
    if (sp_.changes(level)) put("SP " + std::to_string(level));
  }
  bool prepare(const Motion& m) {
    if (!plain(m) || !no_until(m) || !(is_tool_common_ || no_tool(m))) return false;
    if (has_time(m)) {
      cannot("TIME of motions", "Give SPEED or SPEED_PTP.");
      return false;
    }
    if (certain(m, RMP_ATTR_C_CP, "C_CP", 0) > 0 || certain(m, RMP_ATTR_C_PTP, "C_PTP", 0) > 0 ||
        m[RMP_ATTR_C_PASS].known.value_or(0) != 0)
      warn("the target is a stop: the Movemaster does not blend", "Remove C_CP and C_PTP.");
    if (certain(m, RMP_ATTR_ACC, "ACC", 100) != 100 ||
        certain(m, RMP_ATTR_ACC_PTP, "ACC_PTP", 100) != 100)
      warn("accelerations are not written: the Movemaster chooses its own", "Take ACC out.");
    return true;
  }
  void ptp(const Motion& m) override {
    if (!prepare(m)) return;
    select(certain(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", 100, 0.01, 100) / 100);
    const std::size_t n = position(m, m.targets[0]);
    if (n == 0) return;
    put("MO " + std::to_string(n));
    arrived(goal(m, m.targets[0]));
  }
  void lin(const Motion& m) override {
    if (!prepare(m)) return;
    if (m[RMP_ATTR_SPEED_ORI].given)
      warn("SPEED_ORI is not written: the hand rotates with the path", "Give a lower SPEED.");
    const double v = certain(m, RMP_ATTR_SPEED, "SPEED", 250, 0.01, 1e5);
    if (v > speed_)
      warn("a speed of " + trimmed(v, 2) + " mm/s is written as the maximum, SP 9",
           "Give a lower SPEED.");
    select(std::min(1.0, v / speed_));
    const auto at = goal(m, m.targets[0]);
    const std::size_t n = position(m, m.targets[0]);
    if (n == 0) return;
    // A straight line goes over so many points between.
    int steps = 99;
    if (at && last()) {
      const double way = 1000 * std::hypot(at->p[0] - last()->p[0], at->p[1] - last()->p[1],
                                           at->p[2] - last()->p[2]);
      steps = std::clamp(static_cast<int>(std::min(99.0, std::ceil(way / step_mm_))), 1, 99);
    }
    put("MS " + std::to_string(n) + "," + std::to_string(steps));
    arrived(at);
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    if (lower(s.kind) == "hand" && s.type == RMP_TYPE_BOOL) {
      const auto v = output_value(s, value);
      if (v) put((*v != 0) != s.inverted ? "GC" : "GO");
      return;
    }
    for (const auto& [n, on] : bits(s, value)) {
      if (n < 0 || n > 7) {
        fail("signal " + std::to_string(n) + " is not one of the Movemaster's signals, 0 to 7",
             "Give the profile a number for it, or the kind hand.");
        return;
      }
      put(std::string("OB ") + (on ? "+" : "-") + std::to_string(n));
    }
  }
  void wait_time(std::uint32_t e) override {
    const auto v = seconds(e, 3276.7);
    if (!v) return;
    if (std::fabs(*v * 10 - std::round(*v * 10)) > 1e-6)
      warn("the wait is rounded to " + fixed(*v, 1) + " s: the Movemaster counts tenths");
    put("TI " + fixed(*v * 10, 0));
  }
  void wait_for(std::uint32_t c, std::uint32_t timeout) override {
    if (timeout != RMP_NONE) {
      cannot("WAIT FOR with a TIMEOUT", "Remove the TIMEOUT.");
      return;
    }
    const auto t = signal_test(c);
    if (!t || t->signal.type != RMP_TYPE_BOOL || t->signal.is_output || t->signal.number < 0 ||
        t->signal.number > 7) {
      cannot("WAIT FOR with conditions other than one BOOL input, 0 to 7",
             "Use one signal for the condition, and set its number in the profile.");
      return;
    }
    // Read the inputs, and again while the bit is the other way.
    const std::string here = std::to_string(lines_.size() + 1);
    put("ID");
    put(std::string("TB ") + (wanted(*t) ? "-" : "+") + std::to_string(t->signal.number) + "," +
        here);
  }
  void message(std::span<const std::uint32_t> values, bool) override {
    if (constant_text(values))
      warn("WRITE is not written: the Movemaster shows no messages", "Remove the statement.");
  }
  void pause(std::uint32_t text_of) override {
    if (text_of != RMP_NONE) {
      const std::uint32_t one[] = {text_of};
      message(one, true);
    }
    put("HLT");
  }
  void halt() override { put("ED"); }

  File lines_{0};
  std::vector<std::pair<std::string, rmp_span>> positions_;
  Points points_;
  Modal<int> sp_;
  double speed_ = 1000, step_mm_ = 10, roll_ = 0;
  bool told_joints_ = false, is_tool_common_ = false;
};

}  // namespace

const PostCapabilities& Movemaster::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.forms = kPostFlat;
    c.features = kPostWaitFor | kPostPause | kPostReturn | kPostFrames;
    c.motions = kPostPtpPose | kPostLinPose;
    c.circle = PostCircle::none;
    c.blending = PostBlending::none;
    c.speed = PostSpeed::percent;
    c.max_name = 8;
    c.name_case = PostCase::upper;
    c.crlf = true;
    c.max_points = 629;
    c.max_lines = 2048;
    c.extensions = "rm1";
    c.title = "Movemaster RV-M1";
    return c;
  }();
  return kAll;
}

Result<void> Movemaster::write(const PostTask& task, const Params&, PostOutput& output,
                               Progress& progress) const {
  return MovemasterWriter(task, output, capabilities(), progress).run();
}

}  // namespace robomosp::post

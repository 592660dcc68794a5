// SPDX-License-Identifier: Apache-2.0
// A trajectory_msgs/JointTrajectory as YAML and as JSON: positions [rad, m] with strictly rising
// times. Lines and circles are sampled and their joints solved; the controller interpolates. A
// program that does more than move is several, and a sequence that says what comes between them.
#include "joint_trajectory.h"

#include "../common/straight.h"

namespace robomosp::post {
namespace {

class TrajectoryWriter final : public StraightWriter {
 public:
  using StraightWriter::StraightWriter;

 private:
  struct Point {
    std::vector<double> q;
    double t = 0;  ///< [s]
    rmp_span from{};
  };

  void begin() override {
    out_ = &nothing_;
    step_mm_ = number_option("step_mm", 5);
    step_deg_ = number_option("step_deg", 2);
    joint_speed_ = number_option("joint_speed", 60);
    start_s_ = number_option("start_s", 3);
    if (!(step_mm_ >= 0.01) || !(step_deg_ >= 0.01) || !(joint_speed_ > 0) || !(start_s_ >= 0.001))
      fail("an option of the profile is too small",
           "step_mm and step_deg are at least 0.01, joint_speed is above 0, start_s at least "
           "0.001.");
    if (!task_.robot) {
      fail("joint values are written, and no robot is named",
           "Name the robot: program.post{robot = ...}.");
    }
    if (std::any_of(profile_.axes.begin(), profile_.axes.end(), [](const PostAxis& a) {
          return is_of_robot(a) && (a.sign != 1 || a.offset != 0 || !a.coupled.empty());
        }))
      note(
          "positions are those of the robot's joints, as in its URDF, not those of its maker's "
          "axes");
    if (!profile_.prologue.empty() || !profile_.epilogue.empty())
      warn("prologue and epilogue are not written: a message has no program lines",
           "Remove them from the profile.");
  }
  void declare(std::uint32_t s, std::uint32_t) override {
    at_ = symbol(s).span;
    cannot("variables", "Post the flattened program (form = \"flat\").");
  }
  std::vector<std::string> joint_names() const {
    std::vector<std::string> out;
    // The maker's names of a robot are not those of its joints.
    for (const PostAxis& a : profile_.axes)
      if (!a.external && (a.origin != PostAxisOrigin::robot || (a.of_robot & 2) != 0))
        out.emplace_back(a.name);
    if (out.empty() && task_.robot)
      for (const JointModel& j : task_.robot->joints)
        if (!j.is_coupled() && coordinate_count(j.type) == 1) out.push_back(j.name);
    for (std::size_t i = 0; i < out.size(); ++i)
      if (out[i].empty()) out[i] = "joint_" + std::to_string(i + 1);
    return out;
  }
  static std::string quoted(const std::string& s) {
    std::string out = "\"";
    for (const char c : s) {
      if (c == '"' || c == '\\') out += '\\';
      out += static_cast<unsigned char>(c) < 32 ? ' ' : c;
    }
    return out + "\"";
  }
  void finish() override {
    const auto names = joint_names();
    if (!here_.empty() && names.size() != here_.size() && task_.robot) {
      fail("the profile names " + std::to_string(names.size()) + " joints, and the robot has " +
               std::to_string(here_.size()),
           "Give the profile the axes of this robot.");
    }
    std::set<std::string> unique(names.begin(), names.end());
    if (unique.size() != names.size())
      fail("two joints have the same name", "Give the profile's axes distinct names.");
    if (!has_steps_) {
      if (points_.empty()) warn("the trajectory is empty: the program has no motions");
      give(std::string(task_.name), names);
      return;
    }
    end_stretch();
    File yaml(0), json(0);
    const rmp_span head = routine(0).span;
    yaml.add("sequence: 1", &head);
    yaml.add(steps_.empty() ? "steps: []" : "steps:", &head);
    json.add("{\"sequence\": 1,", &head);
    json.add(" \"steps\": [", &head);
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      yaml.add("  - " + steps_[i].text, &steps_[i].from);
      json.add("  " + steps_[i].text + (i + 1 < steps_.size() ? "," : ""), &steps_[i].from);
    }
    json.add(" ]}", &head);
    yaml.give(output_, std::string(task_.name) + "_sequence.yaml", false);
    json.give(output_, std::string(task_.name) + "_sequence.json", false);
  }
  /// What comes between motions: the points before it are a trajectory of their own.
  void step(std::string text) {
    has_steps_ = true;
    end_stretch();
    steps_.push_back({std::move(text), at_});
  }
  void end_stretch() {
    if (points_.empty()) return;
    const std::string name = std::string(task_.name) + "_" + std::to_string(++stretches_);
    steps_.push_back({"{\"trajectory\": " + quoted(name) + "}", points_.front().from});
    give(name, joint_names());
    points_.clear();
    time_ = 0;
  }
  void give(const std::string& name, const std::vector<std::string>& names) {
    File yaml(0), json(0);
    const rmp_span head = routine(0).span;
    std::string all = "[";
    for (std::size_t i = 0; i < names.size(); ++i) all += (i ? ", " : "") + quoted(names[i]);
    all += "]";
    yaml.add("header: {stamp: {sec: 0, nanosec: 0}, frame_id: \"\"}", &head);
    yaml.add("joint_names: " + all, &head);
    yaml.add(points_.empty() ? "points: []" : "points:", &head);
    json.add("{\"header\": {\"stamp\": {\"sec\": 0, \"nanosec\": 0}, \"frame_id\": \"\"},", &head);
    json.add(" \"joint_names\": " + all + ",", &head);
    json.add(" \"points\": [", &head);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Point& p = points_[i];
      std::string q;
      for (std::size_t k = 0; k < p.q.size(); ++k) q += (k ? ", " : "") + trimmed(p.q[k], 7, 1);
      // Counted in nanoseconds, so that equal times stay equal in both parts.
      const auto ns = static_cast<std::int64_t>(std::llround(p.t * 1e9));
      const std::string sec = std::to_string(ns / 1'000'000'000),
                        nano = std::to_string(ns % 1'000'000'000);
      yaml.add("  - {positions: [" + q +
                   "], velocities: [], accelerations: [], effort: [], "
                   "time_from_start: {sec: " +
                   sec + ", nanosec: " + nano + "}}",
               &p.from);
      json.add("  {\"positions\": [" + q +
                   "], \"velocities\": [], \"accelerations\": [], "
                   "\"effort\": [], \"time_from_start\": {\"sec\": " +
                   sec + ", \"nanosec\": " + nano + "}}" + (i + 1 < points_.size() ? "," : ""),
               &p.from);
    }
    json.add(" ]}", &head);
    yaml.give(output_, name + ".yaml", false);
    json.give(output_, name + ".json", false);
  }
  double greatest(std::size_t i) {
    double v = joint_speed_ / kDegree;
    if (task_.robot && task_.robot->is_simple() && i < task_.robot->joints.size()) {
      const double own = task_.robot->joints[i].max_velocity;
      if (std::isfinite(own) && own > 0) return own;
      if (!std::exchange(told_speed_, true))
        note("the robot has no speed limits: 100 % is taken as " + trimmed(joint_speed_, 2) +
                 " degrees/s",
             "Give its joints limits, or the profile the option joint_speed.");
    }
    return v;
  }
  /// Time that the joints need at a share of their speeds.
  double joint_time(const std::vector<double>& a, const std::vector<double>& b, double share) {
    double t = 0;
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
      t = std::max(t, std::fabs(b[i] - a[i]) / (greatest(i) * share));
    return t;
  }
  void add(std::vector<double> q, double after) {
    // A millisecond at least: times rise strictly.
    time_ += std::max(after, 0.001);
    if (time_ > 2e9) {
      fail("the trajectory lasts longer than 2^31 s", "Give higher speeds or shorter waits.");
      time_ = 1;
    }
    here_ = q;
    points_.push_back({std::move(q), time_, at_});
  }
  /// Joints of a target; nothing = said. Absolute ones come with the point.
  std::optional<std::vector<double>> joints(const Motion& m, const Target& t) {
    if (!task_.robot) return std::nullopt;
    const bool moved = m.incremental || t.role == RMP_ROLE_POSITION ||
                       (m[RMP_ATTR_FRAME].given && t.point && t.point->q.empty());
    if (is_joints(t.role) && m.incremental) {
      cannot("increments of joints", "Give joints, or an increment of the pose.");
      return std::nullopt;
    }
    std::vector<double> q;
    if (t.point && !moved && !t.point->q.empty()) {
      q.assign(t.point->q.begin(), t.point->q.end());
    } else if (t.point && !moved && !t.point->has_pose) {
      fail(*t.point->q_missing ? t.point->q_missing : "the joint values of this target are unknown",
           "Name the robot: program.post{robot = ...}.");
      return std::nullopt;
    } else {
      const auto at = certain_goal(m, t);
      if (!at) return std::nullopt;
      auto found = solve(*at);
      if (!found) return std::nullopt;
      q = *found;
    }
    for (const double v : q)
      if (!(std::fabs(v) < 1e4)) {
        fail("a joint of this target is not finite or beyond 10000 rad", "Check the target.");
        return std::nullopt;
      }
    if (q.size() != task_.robot->coordinate_count()) {
      fail("this target has " + std::to_string(q.size()) + " joints, and the robot " +
               std::to_string(task_.robot->coordinate_count()),
           "Give the joints of this robot.");
      return std::nullopt;
    }
    return q;
  }
  std::optional<std::vector<double>> solve(const Pose& at) {
    if (!task_.kinematics) {
      fail("the joints of this motion are not known, since no robot is named",
           "Name the robot: program.post{robot = ...}.");
      return std::nullopt;
    }
    std::vector<double> seed =
        here_.empty() ? std::vector<double>(task_.robot->coordinate_count(), 0.0) : here_;
    auto found = task_.kinematics->inverse(product(at, inverse(tool_)), seed, -1);
    if (!found.ok()) {
      fail("the robot does not reach a point of this motion: " + found.error().message,
           "Move the target, or choose another start.");
      return std::nullopt;
    }
    return *found;
  }
  bool prepare(const Motion& m, bool is_ptp) {
    if (!plain(m) || !no_until(m)) return false;
    // The tool is in the joints.
    tool_ =
        profile_.tool >= 0 ? profile_.tools[static_cast<std::size_t>(profile_.tool)].pose : Pose{};
    if (m[RMP_ATTR_TOOL].given) {
      const auto tool = pose_of(m, RMP_ATTR_TOOL, "TOOL");
      if (!tool) return false;
      tool_ = *tool;
    }
    if (certain(m, is_ptp ? RMP_ATTR_C_PTP : RMP_ATTR_C_CP, "C_CP and C_PTP", 0) > 0 ||
        m[RMP_ATTR_C_PASS].known.value_or(0) != 0)
      note("the target is reached exactly: a trajectory passes through all its points");
    const std::uint32_t acc = is_ptp && !m[RMP_ATTR_ACC].given ? RMP_ATTR_ACC_PTP : RMP_ATTR_ACC;
    if (certain(m, acc, "the acceleration", 100) != 100)
      warn("accelerations are not written, only positions and times", "Take ACC out.");
    return true;
  }
  double asked_time(const Motion& m, double otherwise) {
    if (!has_time(m)) return otherwise;
    const auto t = time_of(m);
    if (!t && !m[RMP_ATTR_TIME].known)
      cannot("a computed TIME", "Post the flattened program (form = \"flat\").");
    return t.value_or(otherwise);
  }
  void ptp(const Motion& m) override {
    if (!prepare(m, true)) return;
    no_external(m.targets[0].point);
    const auto q = joints(m, m.targets[0]);
    if (!q) return;
    const double share = certain(m, RMP_ATTR_SPEED_PTP, "SPEED_PTP", 100, 0.01, 100) / 100;
    if (here_.empty()) {
      start(*q);
    } else {
      add(*q, asked_time(m, joint_time(here_, *q, share)));
    }
    arrive(m, m.targets[0], *q);
  }
  void start(const std::vector<double>& q) {
    note("the robot's start is unknown: it has " + trimmed(start_s_, 3) + " s for the first motion",
         "The profile's option start_s sets this time.");
    add(q, start_s_);
  }
  void arrive(const Motion& m, const Target& t, const std::vector<double>& q) {
    auto at = goal(m, t);
    if (!at && task_.kinematics)
      if (auto found = task_.kinematics->forward(q); found.ok()) at = product(*found, tool_);
    arrived(at);
  }
  /// Poses along a path, from share 0 to 1.
  template <class PoseAt>
  void follow(const Motion& m, double mm, const Pose& from, const Pose& to, PoseAt&& pose_at,
              const std::vector<double>& end) {
    const auto q = quaternion(product(inverse(from), to).R);
    const double degrees =
        2 * std::atan2(std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), q[0]) * kDegree;
    const double v = certain(m, RMP_ATTR_SPEED, "SPEED", 250, 0.001, 1e6);
    const double w = certain(m, RMP_ATTR_SPEED_ORI, "SPEED_ORI", 90, 0.001, 1e6);
    const double t = asked_time(m, std::max(mm / v, degrees / w));
    const double pieces =
        std::clamp(std::ceil(std::max(mm / step_mm_, degrees / step_deg_)), 1.0, 100'000.0);
    for (double k = 1; k < pieces; ++k) {
      if (progress_.cancelled()) return;
      const auto found = solve(pose_at(k / pieces));
      if (!found) return;
      add(*found, t / pieces);
    }
    add(end, t / pieces);
  }
  /// The rotation from one to another, a share of it.
  static Pose turned(const Pose& from, const Pose& to, double share) {
    const auto v = orientation(product(inverse(from), to).R, Orientation::rotation_vector);
    const double a = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    Pose out = from;
    if (a < 1e-12) return out;
    const double c = std::cos(a * share), s = std::sin(a * share), k = 1 - c;
    const double x = v[0] / a, y = v[1] / a, z = v[2] / a;
    Pose turn;
    turn.R = {c + x * x * k,     x * y * k - z * s, x * z * k + y * s,
              y * x * k + z * s, c + y * y * k,     y * z * k - x * s,
              z * x * k - y * s, z * y * k + x * s, c + z * z * k};
    out.R = product(from, turn).R;
    return out;
  }
  void lin(const Motion& m) override {
    if (!prepare(m, false)) return;
    no_external(m.targets[0].point);
    const auto q = joints(m, m.targets[0]);
    if (!q) return;
    if (here_.empty()) {
      start(*q);
      arrive(m, m.targets[0], *q);
      return;
    }
    const auto to = certain_goal(m, m.targets[0]);
    if (!to || !last()) {
      if (to) fail("the start of this line is unknown", "Begin with a motion to a pose.");
      return;
    }
    const Pose from = *last();
    const double mm =
        1000 * std::hypot(to->p[0] - from.p[0], to->p[1] - from.p[1], to->p[2] - from.p[2]);
    follow(
        m, mm, from, *to,
        [&](double share) {
          Pose p = turned(from, *to, share);
          for (std::size_t i = 0; i < 3; ++i) p.p[i] = from.p[i] + share * (to->p[i] - from.p[i]);
          return p;
        },
        *q);
    arrived(to);
  }
  void circle(const Motion& m) override {
    if (!prepare(m, false)) return;
    if (m.incremental) {
      cannot("circles through increments", "Give poses.");
      return;
    }
    const auto via = certain_goal(m, m.targets[0]), to = certain_goal(m, m.targets[1]);
    const auto q = joints(m, m.targets[1]);
    if (!via || !to || !q) return;
    if (!last() || here_.empty()) {
      fail("the start of this circle is unknown", "Begin with a motion to a pose.");
      return;
    }
    const Pose from = *last();
    const auto minus = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    };
    const auto dot = [](const Vec3& a, const Vec3& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const auto cross = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const Vec3 u = minus(via->p, from.p), v = minus(to->p, from.p), n = cross(u, v);
    const double area = dot(n, n);
    if (!(area > 1e-6 * dot(u, u) * dot(v, v)) || !(area > 0)) {
      fail("start, via and end of this circle lie on a line", "Move the via point.");
      return;
    }
    const Vec3 vn = cross(v, n), nu = cross(n, u);
    Vec3 c{};
    for (std::size_t i = 0; i < 3; ++i) c[i] = (dot(u, u) * vn[i] + dot(v, v) * nu[i]) / (2 * area);
    const double r = std::sqrt(dot(c, c)), size = std::sqrt(area);
    const Vec3 e1{-c[0] / r, -c[1] / r, -c[2] / r};
    const Vec3 e2 = cross({n[0] / size, n[1] / size, n[2] / size}, e1);
    const Vec3 end = minus(v, c);
    double angle = std::atan2(dot(end, e2), dot(end, e1));
    if (angle <= 0) angle += 2 * 3.141592653589793;
    follow(
        m, 1000 * r * angle, from, *to,
        [&](double share) {
          Pose p = turned(from, *to, share);
          for (std::size_t i = 0; i < 3; ++i)
            p.p[i] = from.p[i] + c[i] +
                     r * (std::cos(angle * share) * e1[i] + std::sin(angle * share) * e2[i]);
          return p;
        },
        *q);
    arrived(to);
  }
  void wait_time(std::uint32_t e) override {
    const auto v = seconds(e, 1e6);
    if (!v || *v == 0) return;
    if (points_.empty()) step("{\"wait\": " + trimmed(*v, 6, 1) + "}");
    else add(points_.back().q, *v);
  }
  static std::string signal_text(const Signal& s) {
    return quoted(s.target.empty() ? s.name : s.target);
  }
  void set_output(const Signal& s, std::uint32_t value) override {
    const auto v = output_value(s, value);
    if (!v) return;
    std::string text = "{\"set\": " + signal_text(s) + ", \"number\": " + std::to_string(s.number);
    if (s.type == RMP_TYPE_INT) text += ", \"width\": " + std::to_string(s.width);
    text += ", \"value\": ";
    if (s.type == RMP_TYPE_BOOL) text += (*v != 0) != s.inverted ? "true" : "false";
    else text += s.type == RMP_TYPE_INT ? trimmed(*v, 0) : exact(*v);
    step(text + "}");
  }
  /// A number of JSON and of YAML: with a point, and with the sign of its exponent.
  static std::string exact(double v) {
    std::string s = shortest(v);
    if (const auto e = s.find('E'); e != std::string::npos)
      s.replace(e, 1, s[e + 1] == '-' ? "e" : "e+");
    return s;
  }
  /// What a condition asks, as a list: the operator first. Nothing = said.
  std::optional<std::string> asked(std::uint32_t e, int depth = 0) {
    const auto& x = expression(e);
    if (depth > 60) {
      cannot("conditions nested this deep", "Split the condition.");
      return std::nullopt;
    }
    if (x.op == RMP_EXPR_SYMBOL && x.symbol != RMP_NONE &&
        (symbol(x.symbol).kind == RMP_SYMBOL_INPUT || symbol(x.symbol).kind == RMP_SYMBOL_OUTPUT)) {
      const Signal s = signal(x.symbol);
      std::string text = std::string("[") + (s.is_output ? "\"output\"" : "\"input\"") + ", " +
                         signal_text(s) + ", " + std::to_string(s.number);
      if (s.type == RMP_TYPE_INT) text += ", " + std::to_string(s.width);
      text += "]";
      return s.inverted && s.type == RMP_TYPE_BOOL ? "[\"not\", " + text + "]" : text;
    }
    if (const auto v = known(e)) {
      if (x.type == RMP_TYPE_BOOL) return *v != 0 ? "true" : "false";
      return x.type == RMP_TYPE_INT ? trimmed(*v, 0) : exact(*v);
    }
    static constexpr std::pair<std::uint32_t, const char*> kWords[] = {
        {RMP_EXPR_NOT, "not"},          {RMP_EXPR_AND, "and"},       {RMP_EXPR_OR, "or"},
        {RMP_EXPR_EXOR, "xor"},         {RMP_EXPR_EQUAL, "="},       {RMP_EXPR_NOT_EQUAL, "<>"},
        {RMP_EXPR_LESS, "<"},           {RMP_EXPR_LESS_EQUAL, "<="}, {RMP_EXPR_GREATER, ">"},
        {RMP_EXPR_GREATER_EQUAL, ">="}, {RMP_EXPR_ADD, "+"},         {RMP_EXPR_SUBTRACT, "-"},
        {RMP_EXPR_MULTIPLY, "*"},       {RMP_EXPR_NEGATE, "negate"}};
    const std::vector<std::uint32_t> parts = [&] {
      const auto all = links(x.first, x.count);
      return std::vector<std::uint32_t>(all.begin(), all.end());
    }();
    if (x.op == RMP_EXPR_CONVERT && parts.size() == 1) return asked(parts[0], depth + 1);
    for (const auto& [op, word] : kWords) {
      if (x.op != op) continue;
      std::string text = "[" + quoted(word);
      for (const std::uint32_t p : parts) {
        const auto one = asked(p, depth + 1);
        if (!one) return std::nullopt;
        text += ", " + *one;
      }
      return text + "]";
    }
    cannot("this condition", "Post the flattened program (form = \"flat\").");
    return std::nullopt;
  }
  void wait_for(std::uint32_t condition, std::uint32_t timeout) override {
    std::string until;
    if (timeout != RMP_NONE) {
      const auto t = seconds(timeout, 1e6);
      if (!t) return;
      until = ", \"timeout\": " + trimmed(*t, 6, 1);
    }
    if (const auto text = asked(condition)) step("{\"wait_for\": " + *text + until + "}");
  }
  void message(std::span<const std::uint32_t> values, bool ends_line) override {
    if (const auto text = told(values))
      step("{\"text\": " + quoted(*text) + (ends_line ? "}" : ", \"ends_line\": false}"));
  }
  void pause(std::uint32_t message) override {
    std::optional<std::string> text = "";
    if (message != RMP_NONE) text = told(std::span(&message, 1));
    if (text) step("{\"pause\": " + quoted(*text) + "}");
  }
  void halt() override { step("{\"halt\": true}"); }

  struct Step {
    std::string text;
    rmp_span from{};
  };
  File nothing_{0};
  std::vector<Point> points_;  ///< of the present stretch
  Pose tool_;                  ///< of the motion, on the flange
  std::vector<double> here_;   ///< where the last point of all is; empty = nobody knows
  std::vector<Step> steps_;
  std::size_t stretches_ = 0;
  bool has_steps_ = false;
  double time_ = 0, step_mm_ = 5, step_deg_ = 2, joint_speed_ = 60, start_s_ = 3;
  bool told_speed_ = false;
};

}  // namespace

const PostCapabilities& JointTrajectory::capabilities() const {
  static const PostCapabilities kAll = [] {
    PostCapabilities c;
    c.forms = kPostFlat;
    c.features = kPostTime | kPostTools | kPostFrames | kPostWaitFor | kPostWaitTimeout |
                 kPostMessages | kPostPause;
    c.motions = kPostPtpJoints | kPostPtpPose | kPostLinPose | kPostCircle;
    c.circle = PostCircle::via;
    c.blending = PostBlending::none;
    c.speed = PostSpeed::time;
    c.max_name = 64;
    c.case_matters = true;
    c.charset = PostCharset::utf8;
    c.extensions = "yaml,json";
    c.title = "JointTrajectory";
    return c;
  }();
  return kAll;
}

Result<void> JointTrajectory::write(const PostTask& task, const Params&, PostOutput& output,
                                    Progress& progress) const {
  return TrajectoryWriter(task, output, capabilities(), progress).run();
}

}  // namespace robomosp::post

// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics of SCARA robots in closed form, in one file: two parallel turning joints, a
// slide along them and a turning joint about them (such as the Adept Cobra 600). The elbow follows
// from the law of cosines; there are two configurations, elbow left and elbow right.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kParallel = 1e-9;  // sine of the angle between axes that count as parallel

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
Vec3 column(const Pose& t, std::size_t i) { return {t.R[i], t.R[i + 3], t.R[i + 6]}; }

Pose times(const Pose& a, const Pose& b) {
  Pose c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.p[i] = a.p[i];
    for (std::size_t j = 0; j < 3; ++j) {
      c.p[i] += a.R[3 * i + j] * b.p[j];
      c.R[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) c.R[3 * i + j] += a.R[3 * i + k] * b.R[3 * k + j];
    }
  }
  return c;
}

class ScaraIk final : public IkSolver {
 public:
  // The model has joint frames whose z axes are the joint axes; what DH rows they came from does
  // not matter. A robot that is none is refused with one sentence.
  Result<void> prepare(const RobotModel& model, const Params&) override {
    const auto refused = [&](const std::string& why) -> Error {
      return error(ErrorCode::unsupported, "it is not a SCARA: " + why, "Choose another provider.",
                   "robot \"" + model.name + "\"");
    };
    if (!model.is_serial() || !model.is_simple() || model.joints.size() != 4 ||
        model.tips.empty() || model.tips[0].joint != 3)
      return refused("it is not a chain of four joints");
    Pose at;
    Vec3 points[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const bool slides = model.joints[i].type == JointType::prismatic;
      if (slides != (i == 2))
        return refused("its joints are not revolute, revolute, prismatic, revolute");
      at = times(at, model.joints[i].placement);
      points[i] = at.p;
      if (i == 0) up_ = column(at, 2), x_ = column(at, 0);
      if (norm(cross(up_, column(at, 2))) > kParallel) return refused("its axes are not parallel");
      sign_[i] = dot(up_, column(at, 2)) < 0 ? -1 : 1;
    }
    model_ = &model;
    y_ = cross(up_, x_);
    rest_ = times(at, model.tips[0].tool);
    first_ = points[0];
    // In the plane across the axes, seen from joint 1: x, y, and the angle of the tip's turn.
    upper_ = flat(minus(points[1], points[0]));
    fore_ = flat(minus(points[3], points[1]));
    hand_ = minus(rest_.p, points[3]);
    l2_ = std::hypot(upper_.x, upper_.y);
    l3_ = std::hypot(fore_.x, fore_.y);
    if (l2_ == 0 || l3_ == 0) return refused("a link has no length");
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    RMP_TRY(check(batch, results.size()));
    std::vector<double> near(4);
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (i % 256 == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "inverse kinematics was cancelled");
      if (i == 0 || !batch.continuous)
        for (std::size_t j = 0; j < 4; ++j) {
          const JointModel& joint = model_->joints[j];
          const std::size_t seed = batch.seeds.size() == 4 ? j : 4 * i + j;
          near[j] = batch.seeds.empty() ? 0.5 * (joint.lower + joint.upper) : batch.seeds[seed];
          if (!std::isfinite(near[j])) near[j] = 0;
          near[j] = std::clamp(near[j], joint.lower, joint.upper);
        }
      solve_one(batch, batch.targets[i], near, results[i]);
      near.assign(results[i].q.begin(), results[i].q.begin() + 4);
    }
    return {};
  }

 private:
  struct Flat {
    double x = 0, y = 0;
  };
  Flat flat(const Vec3& v) const { return {dot(x_, v), dot(y_, v)}; }
  static Flat turned(const Flat& v, double t) {
    return {std::cos(t) * v.x - std::sin(t) * v.y, std::sin(t) * v.x + std::cos(t) * v.y};
  }

  Result<void> check(const IkBatch& batch, std::size_t results) const {
    const auto bad = [](const char* what) -> Error {
      return error(ErrorCode::invalid_argument, what, "Correct the call.");
    };
    if (!batch.goals.empty() || batch.objective != IkObjective::none || !batch.arm_angles.empty())
      return error(ErrorCode::unsupported, "this solver accepts full poses only",
                   "Choose another provider.");
    const std::size_t count = batch.targets.size();
    if (results != count) return bad("there must be one result per target");
    if (!batch.seeds.empty() && batch.seeds.size() != 4 && batch.seeds.size() != 4 * count)
      return bad("the seeds must be four numbers, for all targets or for each");
    if (batch.tip != 0) return bad("there is only one tip");
    for (const Pose& t : batch.targets) {
      for (const double x : t.R)
        if (!std::isfinite(x)) return bad("a target is not a pose");
      for (const double x : t.p)
        if (!std::isfinite(x)) return bad("a target is not a pose");
    }
    for (const double x : batch.seeds)
      if (!std::isfinite(x)) return bad("a seed is not a number");
    return {};
  }

  // The turn nearest to `near`, moved into the limits by whole turns where that is possible.
  double settled(std::size_t j, double q, double near) const {
    const JointModel& joint = model_->joints[j];
    q += kTurn * std::round((near - q) / kTurn);
    if (q > joint.upper + 1e-10) q -= kTurn * std::ceil((q - joint.upper - 1e-10) / kTurn);
    else if (q < joint.lower - 1e-10) q += kTurn * std::ceil((joint.lower - 1e-10 - q) / kTurn);
    return q;
  }

  void solve_one(const IkBatch& batch, const Pose& target, const std::vector<double>& near,
                 IkResult& out) const {
    out = IkResult{};
    // The turn of the tip about the axes since q = 0.
    const Vec3 x = column(target, 0), x0 = column(rest_, 0), z = column(target, 2),
               z0 = column(rest_, 2), y = column(target, 1), y0 = column(rest_, 1);
    const double c = dot(x, x0) + dot(y, y0) + dot(z, z0);
    const double s = dot(up_, cross(x0, x)) + dot(up_, cross(y0, y)) + dot(up_, cross(z0, z));
    // trace(R) = 1 + 2 cos and the skew part 2 sin, for a turn about `up`.
    const double turn = std::atan2(s / 2, (c - 1) / 2);
    // Axis 4: the target without the hand, which has turned.
    const Flat hand = turned(flat(hand_), turn);
    const Vec3 to = minus(target.p, first_);
    const Flat wrist{flat(to).x - hand.x, flat(to).y - hand.y};
    const double height = dot(up_, minus(target.p, rest_.p));
    const double r = std::hypot(wrist.x, wrist.y);
    const double shortfall = std::max({0.0, r - l2_ - l3_, std::fabs(l2_ - l3_) - r});

    // |upper + turned(fore, q2)|^2 = r^2: a cos + b sin = k.
    const double a = upper_.x * fore_.x + upper_.y * fore_.y;
    const double b = upper_.y * fore_.x - upper_.x * fore_.y;
    const double k = std::clamp((r * r - l2_ * l2_ - l3_ * l3_) / (2 * l2_ * l3_), -1.0, 1.0);
    struct Found {
      double q[4];
      double cost = 0, outside = 0;
      std::size_t worst = 0;
    };
    std::vector<Found> found;
    for (const double side : {1.0, -1.0}) {
      const double t2 = std::atan2(b, a) + side * std::acos(k);
      const Flat f = turned(fore_, t2), arm{upper_.x + f.x, upper_.y + f.y};
      const double t1 = std::atan2(wrist.y, wrist.x) - std::atan2(arm.y, arm.x);
      Found one{{sign_[0] * t1, sign_[1] * t2, sign_[2] * height, sign_[3] * (turn - t1 - t2)}};
      for (std::size_t j = 0; j < 4; ++j) {
        const JointModel& joint = model_->joints[j];
        if (j != 2) one.q[j] = settled(j, one.q[j], near[j]);
        const double excess = std::max(one.q[j] - joint.upper, joint.lower - one.q[j]);
        if (excess > std::max(one.outside, 1e-10)) one.outside = excess, one.worst = j;
        one.cost += (one.q[j] - near[j]) * (one.q[j] - near[j]);
      }
      found.push_back(one);
      if (std::fabs(k) == 1) break;  // stretched or folded: both are one
    }
    std::sort(found.begin(), found.end(), [](const Found& p, const Found& q) {
      return (p.outside > 0) != (q.outside > 0) ? q.outside > 0 : p.cost < q.cost;
    });
    for (const Found& one : found) {
      if (!out.q.empty() && (one.outside > 0 || !batch.all_solutions)) break;
      for (std::size_t j = 0; j < 4; ++j)
        out.q.push_back(std::clamp(one.q[j], model_->joints[j].lower, model_->joints[j].upper));
    }
    measure(target, out);
    if (found[0].outside == 0 && out.position_error <= batch.tolerance.position &&
        out.rotation_error <= batch.tolerance.rotation) {
      out.status = IkStatus::solved;
    } else if (shortfall > batch.tolerance.position) {
      out.status = IkStatus::out_of_reach;
      out.shortfall = shortfall;
      out.detail = "the target is out of reach by " + std::to_string(shortfall) + " m";
    } else if (found[0].outside > 0) {
      out.status = IkStatus::joint_limit;
      out.limiting_joint = static_cast<std::int32_t>(found[0].worst);
      out.detail = "a limit of joint \"" + model_->joints[found[0].worst].name + "\" prevents it";
    } else {
      out.status = IkStatus::out_of_reach;
      out.detail = "a SCARA cannot tilt its tool";
    }
    out.q.resize(out.status == IkStatus::solved ? out.q.size() : 4);
  }

  // What forward kinematics leaves of the target at the first answer.
  void measure(const Pose& target, IkResult& out) const {
    Pose at;
    for (std::size_t j = 0; j < 4; ++j) {
      Pose motion;
      const double s = std::sin(out.q[j]), c = std::cos(out.q[j]);
      if (j == 2) motion.p = {0, 0, out.q[j]};
      else motion.R = {c, -s, 0, s, c, 0, 0, 0, 1};
      at = times(times(at, model_->joints[j].placement), motion);
    }
    at = times(at, model_->tips[0].tool);
    out.position_error = norm(minus(at.p, target.p));
    double square = 0;
    for (std::size_t i = 0; i < 9; ++i) square += (at.R[i] - target.R[i]) * (at.R[i] - target.R[i]);
    out.rotation_error = 2 * std::asin(std::min(1.0, std::sqrt(square / 8)));
  }

  const RobotModel* model_ = nullptr;
  Vec3 up_{}, x_{}, y_{};  // axis 1 and directions across it, base frame
  Vec3 first_{}, hand_{};  // a point of axis 1; axis 4 to tip at q = 0
  Pose rest_;              // base_T_tip at q = 0
  Flat upper_, fore_;
  double l2_ = 0, l3_ = 0;
  double sign_[4] = {1, 1, 1, 1};  // -1: the axis points against axis 1
};

}  // namespace

RMP_PLUGIN("org.example.scara_ik", "0.1.0", "Apache-2.0", "Inverse kinematics of SCARA robots.",
           RMP_PROVIDER_NO_PARAMS(ScaraIk, "scara",
                                  "Both configurations of SCARA robots in closed form.",
                                  "serial,closed_form,all_solutions"))

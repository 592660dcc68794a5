// SPDX-License-Identifier: Apache-2.0
// A numeric inverse kinematics solver in one file: damped least squares on the pose error,
//   dq = J^T (J J^T + lambda 1)^-1 e   (Nakamura and Hanafusa 1986),
// with lambda = e^T e / 2 + a little (Sugihara 2011), joints held at their limits, and restarts.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <robomosp/sdk/eigen.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>
#include <Eigen/Cholesky>

namespace {

using namespace robomosp;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// One configuration, the pose error there, and the Jacobian.
struct State {
  Eigen::VectorXd q;
  Vector6 error;  // position [m], rotation vector [rad], both in the base frame
  Jacobian J;
  double position() const { return error.head<3>().norm(); }
  double rotation() const { return error.tail<3>().norm(); }
};

class MyIk final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    if (model.joints.empty() || model.tips.empty())
      return error(ErrorCode::unsupported, "robot \"" + model.name + "\" has no joints or no tip");
    // What this solver cannot do it must refuse here: below, entry i of q is joint i, and nothing
    // looks at loops. The tag "simple" says the same to the host, which then does not even ask.
    if (!model.is_simple() || !model.loops.empty())
      return error(ErrorCode::unsupported,
                   "robot \"" + model.name +
                       "\" has joints of several coordinates, followers or closed loops",
                   "Choose another solver, such as numeric.");
    model_ = &model;
    restarts_ = params.integer("restarts");
    iterations_ = params.integer("iterations");
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    if (auto wrong = check(batch, results.size()); !wrong.ok()) return wrong;
    const std::size_t dof = model_->dof(), count = batch.targets.size();
    Eigen::VectorXd start = middle();
    for (std::size_t i = 0; i < count; ++i) {
      if (!batch.seeds.empty() && (i == 0 || !batch.continuous)) {
        const std::size_t at = batch.seeds.size() == dof ? 0 : i * dof;
        start = clamped(
            Eigen::Map<const Eigen::VectorXd>(&batch.seeds[at], static_cast<Eigen::Index>(dof)));
      }
      if (!solve_one(batch, batch.targets[i], start, results[i], progress))
        return error(ErrorCode::cancelled, "inverse kinematics was cancelled");
      if (batch.continuous && results[i].status == IkStatus::solved)
        start =
            Eigen::Map<const Eigen::VectorXd>(results[i].q.data(), static_cast<Eigen::Index>(dof));
      if (i % 100 == 0)
        progress.report(static_cast<double>(i) / static_cast<double>(count), "inverse kinematics");
    }
    return {};
  }

 private:
  /// Wrong sizes and numbers are errors; an unreachable target is not.
  Result<void> check(const IkBatch& batch, std::size_t results) const {
    const std::size_t count = batch.targets.size(), dof = model_->dof(), seeds = batch.seeds.size();
    if (results != count)
      return error(ErrorCode::invalid_argument, "there must be one result for each target");
    if (seeds != 0 && seeds != dof && seeds != dof * count)
      return error(ErrorCode::invalid_argument, std::to_string(seeds) + " seed values do not fit " +
                                                    std::to_string(dof) + " joints");
    if (batch.tip < 0 || static_cast<std::size_t>(batch.tip) >= model_->tips.size())
      return error(ErrorCode::invalid_argument, "there is no tip " + std::to_string(batch.tip));
    const bool is_whole = batch.goals.empty();
    if (!is_whole || batch.objective != IkObjective::none || !batch.arm_angles.empty())
      return error(ErrorCode::unsupported,
                   "this solver serves whole poses of one tip, without goals, objectives or arm "
                   "angles",
                   "Choose another solver, such as numeric.");
    for (const double q : batch.seeds)
      if (!std::isfinite(q))
        return error(ErrorCode::invalid_argument, "a seed is not a finite number");
    for (const Pose& t : batch.targets)
      if (!map(t.p).allFinite() || !rotation(t).allFinite())
        return error(ErrorCode::invalid_argument, "a target is not finite");
    return {};
  }

  /// False when cancelled.
  bool solve_one(const IkBatch& batch, const Pose& target, const Eigen::VectorXd& start,
                 IkResult& result, Progress& progress) const {
    const bool too_far = map(target.p).norm() > reach(batch.tip);
    std::mt19937_64 random(1);  // the same call gives the same answer
    State best;
    result = {};
    for (long long attempt = 0; attempt <= (too_far ? 2 : restarts_); ++attempt) {
      if (progress.cancelled()) return false;
      const State end =
          descend(attempt == 0 ? start : anywhere(random), batch, target, result.iterations);
      if (attempt == 0 || end.error.norm() < best.error.norm()) best = end;
      if (reached(best, batch.tolerance)) break;
    }
    result.q.assign(best.q.begin(), best.q.end());
    result.position_error = best.position();
    result.rotation_error = best.rotation();
    if (reached(best, batch.tolerance)) {
      result.status = IkStatus::solved;
    } else {
      result.status = too_far ? IkStatus::out_of_reach : IkStatus::not_converged;
      result.detail = too_far ? "the target is farther away than the stretched arm"
                              : "no restart reached the target";
    }
    return true;
  }

  /// Damped least squares from one start until reached, stuck, or out of iterations.
  State descend(const Eigen::VectorXd& start, const IkBatch& batch, const Pose& target,
                std::int32_t& iterations) const {
    State s = evaluate(start, batch.tip, target), best = s;
    for (long long i = 0; i < iterations_ && !reached(best, batch.tolerance); ++i, ++iterations) {
      const Eigen::VectorXd q = clamped(s.q + step(s));
      if ((q - s.q).cwiseAbs().maxCoeff() < 1e-13) break;
      s = evaluate(q, batch.tip, target);
      if (s.error.norm() < best.error.norm()) best = s;
    }
    return best;
  }

  /// One step; a joint that would be pushed out of its range is taken out and the step made anew.
  Eigen::VectorXd step(State& s) const {
    const double damping = 0.5 * s.error.squaredNorm() + 1e-12;
    for (;;) {
      const Matrix6 A = s.J * s.J.transpose() + damping * Matrix6::Identity();
      const Eigen::VectorXd dq = s.J.transpose() * A.ldlt().solve(s.error);
      bool blocked = false;
      for (Eigen::Index j = 0; j < dq.size(); ++j) {
        const JointModel& joint = model_->joints[static_cast<std::size_t>(j)];
        if ((dq[j] > 0 && s.q[j] >= joint.upper) || (dq[j] < 0 && s.q[j] <= joint.lower)) {
          s.J.col(j).setZero();
          blocked = true;
        }
      }
      if (!blocked) return dq;
    }
  }

  State evaluate(const Eigen::VectorXd& q, std::int32_t tip, const Pose& target) const {
    std::vector<Eigen::Isometry3d> frames(model_->dof());  // base_T_joint
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const JointModel& joint = model_->joints[i];
      const double qi = q[static_cast<Eigen::Index>(i)];
      frames[i] = joint.parent < 0
                      ? isometry(joint.placement)
                      : frames[static_cast<std::size_t>(joint.parent)] * isometry(joint.placement);
      if (joint.type == JointType::revolute)
        frames[i].rotate(Eigen::AngleAxisd(qi, Eigen::Vector3d::UnitZ()));
      else frames[i].translate(Eigen::Vector3d(0, 0, qi));
    }
    const TipModel& t = model_->tips[static_cast<std::size_t>(tip)];
    const Eigen::Isometry3d at = t.joint < 0
                                     ? isometry(t.tool)
                                     : frames[static_cast<std::size_t>(t.joint)] * isometry(t.tool);
    State s{q, Vector6::Zero(), Jacobian::Zero(6, q.size())};
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(rotation(target) * at.linear().transpose()));
    s.error << map(target.p) - at.translation(), turn.angle() * turn.axis();
    for (std::int32_t i = t.joint; i >= 0; i = model_->joints[static_cast<std::size_t>(i)].parent) {
      const Eigen::Isometry3d& frame = frames[static_cast<std::size_t>(i)];
      const Eigen::Vector3d z = frame.linear().col(2);
      if (model_->joints[static_cast<std::size_t>(i)].type == JointType::revolute)
        s.J.col(i) << z.cross(at.translation() - frame.translation()), z;
      else s.J.col(i) << z, Eigen::Vector3d::Zero();
    }
    return s;
  }

  /// Half of the tolerance, so that rounding in the caller's own check cannot undo the answer.
  static bool reached(const State& s, const IkTolerance& t) {
    return s.position() <= t.position / 2 && s.rotation() <= t.rotation / 2;
  }

  /// No pose of the tip is farther from the base than the lengths of its branch together [m].
  double reach(std::int32_t tip) const {
    const TipModel& t = model_->tips[static_cast<std::size_t>(tip)];
    double sum = map(t.tool.p).norm();
    for (std::int32_t i = t.joint; i >= 0; i = model_->joints[static_cast<std::size_t>(i)].parent) {
      const JointModel& joint = model_->joints[static_cast<std::size_t>(i)];
      sum += map(joint.placement.p).norm();
      if (joint.type == JointType::prismatic)
        sum += std::max(std::abs(joint.lower), std::abs(joint.upper));
    }
    return sum;
  }

  Eigen::VectorXd clamped(Eigen::VectorXd q) const {
    for (Eigen::Index j = 0; j < q.size(); ++j)
      q[j] = std::clamp(q[j], model_->joints[static_cast<std::size_t>(j)].lower,
                        model_->joints[static_cast<std::size_t>(j)].upper);
    return q;
  }
  /// Each joint at `pick(lower, upper)` of its range; ranges without end count as one turn or
  /// metre.
  template <class Pick>
  Eigen::VectorXd configuration(Pick pick) const {
    Eigen::VectorXd q(static_cast<Eigen::Index>(model_->dof()));
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      const JointModel& joint = model_->joints[static_cast<std::size_t>(j)];
      const double span = joint.type == JointType::revolute ? std::numbers::pi : 0.5;
      q[j] = pick(std::max(joint.lower, std::min(-span, joint.upper - 2 * span)),
                  std::min(joint.upper, std::max(span, joint.lower + 2 * span)));
    }
    return q;
  }
  Eigen::VectorXd middle() const {
    return configuration([](double low, double high) { return (low + high) / 2; });
  }
  Eigen::VectorXd anywhere(std::mt19937_64& random) const {
    return configuration([&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    });
  }

  const RobotModel* model_ = nullptr;
  long long restarts_ = 0, iterations_ = 0;
};

const rmp_param kParams[] = {
    {"restarts", "int", "", "Random starts tried after the given one.", "200", nullptr, 0, 100000},
    {"iterations", "int", "", "Greatest number of steps from each start.", "100", nullptr, 1,
     100000},
};

}  // namespace

RMP_PLUGIN("org.example.my_ik", "0.1.0", "Apache-2.0",
           "A numeric inverse kinematics solver to start from",
           RMP_PROVIDER(MyIk, "my_ik", "Damped least squares with restarts, for any chain",
                        "simple,numeric,serial,tree", kParams))

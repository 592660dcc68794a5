// SPDX-License-Identifier: Apache-2.0
#include "sim/closed_dynamics.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "kernel/text.h"
#include "robotics/closure.h"
#include "robotics/loop_motion.h"
#include "sim/for_samples.h"

namespace robomosp::sim {
namespace {

using robotics::LoopMotion;

/// Loops that are open by more are no closed mechanism [m, rad].
constexpr double kOpenBy = 1e-6;
/// Rates and accelerations that open loops by more than this part of what single joints do.
constexpr double kOpening = 1e-6;
/// Loops of recorded rows that are left as they are, and the most that is closed [m, rad].
constexpr double kClosedAlready = 1e-12, kRecordedOpen = 1e-3;
/// About what linearising the loops of a state takes.
constexpr double kNanosecondsOfLoops = 2e4;

std::string of_robot(const RobotModel& model) { return "robot " + text::quote(model.name); }

std::span<const double> batch_sample(std::span<const double> all, std::size_t i,
                                     std::size_t width) {
  return all.empty() ? all : all.subspan(i * width, width);
}

/// A solver of the open tree whose forces are carried to the motors.
class ClosedDynamics final : public InverseDynamics {
 public:
  ClosedDynamics(std::shared_ptr<const RobotModel> model, std::shared_ptr<InverseDynamics> tree,
                 LoopMotion loops)
      : model_(std::move(model)), tree_(std::move(tree)), loops_(std::move(loops)) {}

  [[nodiscard]] const void* extension(const char* id) const override {
    return tree_->extension(id);
  }
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  [[nodiscard]] std::size_t scratch_size() const override { return tree_->scratch_size(); }

  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    RMP_TRY(tree_->torques(batch, tau, progress));
    return reduced(batch, tau, model_->dof(), progress,
                   [](LoopMotion& loops, std::span<double> one) { loops.to_motors(one); });
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    RMP_TRY(tree_->inertia(batch, m, progress));
    return reduced(batch, m, model_->dof() * model_->dof(), progress,
                   [](LoopMotion& loops, std::span<double> one) { loops.inertia_to_motors(one); });
  }
  Result<void> regressor(const DynamicsBatch& batch, std::span<double> y,
                         Progress& progress) const override {
    RMP_TRY(tree_->regressor(batch, y, progress));
    const std::size_t columns = 10 * model_->joints.size();
    return reduced(
        batch, y, model_->dof() * columns, progress,
        [columns](LoopMotion& loops, std::span<double> one) { loops.to_motors(one, columns); });
  }
  Result<void> energy(const DynamicsBatch& batch, std::span<Energy> out,
                      Progress& progress) const override {
    return tree_->energy(batch, out, progress);
  }

 private:
  template <class Reduce>
  Result<void> reduced(const DynamicsBatch& batch, std::span<double> out, std::size_t width,
                       Progress& progress, Reduce&& reduce) const {
    // What is not a number stays so: it is found where answers are checked.
    const std::size_t nq = model_->coordinate_count();
    return for_samples(batch.count, kNanosecondsOfLoops, progress,
                       [&](std::size_t first, std::size_t last, std::size_t) -> Result<void> {
                         LoopMotion loops = loops_;
                         for (std::size_t i = first; i < last; ++i) {
                           loops.at(batch.q.subspan(i * nq, nq));
                           reduce(loops, out.subspan(i * width, width));
                         }
                         return {};
                       });
  }

  std::shared_ptr<const RobotModel> model_;
  std::shared_ptr<InverseDynamics> tree_;
  LoopMotion loops_;
};

class ClosedController final : public Controller {
 public:
  ClosedController(std::shared_ptr<Controller> tree, LoopMotion loops)
      : tree_(std::move(tree)), loops_(std::move(loops)) {}

  [[nodiscard]] const void* extension(const char* id) const override {
    return tree_->extension(id);
  }
  Result<void> prepare(const RobotModel&, const InverseDynamics&, const Params&) override {
    return {};
  }
  [[nodiscard]] std::size_t state_size() const override { return tree_->state_size(); }
  [[nodiscard]] std::size_t scratch_size() const override { return tree_->scratch_size(); }
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override {
    RMP_TRY(tree_->torques(in, state, scratch, tau));
    std::unique_ptr<LoopMotion> loops = take();
    loops->at(in.q);
    loops->to_motors(tau);
    // What only joints without motors could do is not done.
    for (std::size_t v = 0; v < tau.size(); ++v)
      if (!loops->has_motor()[v]) tau[v] = 0;
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(loops));
    return {};
  }

 private:
  /// One that no other thread uses; kept between calls, as copying allocates.
  [[nodiscard]] std::unique_ptr<LoopMotion> take() const {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<LoopMotion>(loops_);
    std::unique_ptr<LoopMotion> out = std::move(idle_.back());
    idle_.pop_back();
    return out;
  }

  std::shared_ptr<Controller> tree_;
  LoopMotion loops_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<LoopMotion>> idle_;
};

}  // namespace

Result<std::shared_ptr<InverseDynamics>> close_dynamics(std::shared_ptr<const RobotModel> model,
                                                        std::shared_ptr<InverseDynamics> tree) {
  RMP_TRY_ASSIGN(LoopMotion loops, LoopMotion::make(*model));
  return std::shared_ptr<InverseDynamics>(
      std::make_shared<ClosedDynamics>(std::move(model), std::move(tree), std::move(loops)));
}

bool is_closed(const InverseDynamics& solver) {
  return dynamic_cast<const ClosedDynamics*>(&solver) != nullptr;
}

Result<std::shared_ptr<Controller>> close_controller(std::shared_ptr<const RobotModel> model,
                                                     std::shared_ptr<Controller> tree) {
  RMP_TRY_ASSIGN(LoopMotion loops, LoopMotion::make(*model));
  return std::shared_ptr<Controller>(
      std::make_shared<ClosedController>(std::move(tree), std::move(loops)));
}

std::shared_ptr<const RobotModel> model_with_all_motors(const RobotModel& model) {
  auto driven = std::make_shared<RobotModel>(model);
  for (JointModel& j : driven->joints) j.passive = false;
  return driven;
}

Result<void> check_loops(const RobotModel& model, DynamicsBatch& batch, FollowedRates* follow,
                         const std::function<std::string(std::size_t)>& of_state,
                         Progress& progress) {
  if (model.loops.empty()) return {};
  const std::size_t n = model.dof(), nq = model.coordinate_count();
  const bool moves = !batch.qd.empty(),
             accelerates = (batch.terms & kInertialTerm) != 0 && (moves || !batch.qdd.empty());
  if (follow) {
    if (moves) follow->qd.assign(batch.qd.begin(), batch.qd.end());
    if (accelerates) {
      follow->qdd.assign(batch.qdd.begin(), batch.qdd.end());
      follow->qdd.resize(batch.count * n);
    }
  }
  RMP_TRY_ASSIGN(const LoopMotion prototype, LoopMotion::make(model));
  RMP_TRY(for_samples(
      batch.count, kNanosecondsOfLoops, progress,
      [&](std::size_t first, std::size_t last, std::size_t) -> Result<void> {
        LoopMotion loops = prototype;
        for (std::size_t i = first; i < last; ++i) {
          const std::span<const double> q = batch.q.subspan(i * nq, nq);
          std::span<const double> qd = batch_sample(batch.qd, i, n),
                                  qdd = batch_sample(batch.qdd, i, n);
          if (follow && moves) {
            const std::span<double> own = std::span(follow->qd).subspan(i * n, n);
            loops.at(q);
            loops.follow_rates(own);
            qd = own;
          }
          loops.at(q, qd);
          if (const double open = loops.gap(); !(open <= kOpenBy))
            return error(ErrorCode::invalid_argument,
                         "loop " + text::quote(model.loops[loops.worst_loop()].name) +
                             " is open by " + text::print_rounded(open, 3) +
                             " m or rad at these joint values" + of_state(i),
                         "Give values that close it, such as those of robot.close, or close = "
                         "true.",
                         of_robot(model));
          const auto opening = [&](const char* what, const char* argument) {
            return error(
                ErrorCode::invalid_argument,
                std::string("its joint ") + what + " pull the closed loops apart" + of_state(i),
                follow ? "Give joints with motors " + std::string(what) +
                             " that the others can follow."
                       : std::string("Give ") + argument +
                             " of all joints so that the loops stay closed, or close = true: "
                             "then joints without motors follow those with one.",
                of_robot(model));
          };
          if (!(loops.rate_error() <= kOpening)) return opening("speeds", "qd");
          if (!accelerates) continue;
          if (follow) {
            const std::span<double> own = std::span(follow->qdd).subspan(i * n, n);
            loops.follow_accelerations(own);
            qdd = own;
          }
          if (!(loops.acceleration_error(qdd) <= kOpening)) return opening("accelerations", "qdd");
        }
        return {};
      }));
  if (follow && moves) batch.qd = follow->qd;
  if (follow && accelerates) batch.qdd = follow->qdd;
  return {};
}

Result<double> close_rows(const RobotModel& model, std::span<double> q, std::span<double> qd,
                          std::span<double> qdd, Progress& progress) {
  if (model.loops.empty()) return 0.0;
  const std::size_t n = model.dof(), nq = model.coordinate_count(), count = q.size() / nq;
  const std::vector<bool> none(n, false);
  RMP_TRY_ASSIGN(const LoopMotion prototype, LoopMotion::make(model));
  std::vector<double> gaps(count);
  RMP_TRY(for_samples(
      count, kNanosecondsOfLoops, progress,
      [&](std::size_t first, std::size_t last, std::size_t) -> Result<void> {
        LoopMotion loops = prototype;
        for (std::size_t i = first; i < last; ++i) {
          const std::span<double> at = q.subspan(i * nq, nq), rates = qd.subspan(i * n, n);
          loops.at(at);
          gaps[i] = loops.gap();
          if (gaps[i] > kClosedAlready) {
            robotics::Closure closed;
            if (gaps[i] <= kRecordedOpen) closed = robotics::close_loops(model, at, at, none);
            if (!closed.is_closed)
              return error(ErrorCode::invalid_argument,
                           "loop " + text::quote(model.loops[loops.worst_loop()].name) +
                               " is open by " + text::print_rounded(gaps[i], 3) +
                               " m or rad in row " + std::to_string(i + 1),
                           "Forces of motors need rows with closed loops.", of_robot(model));
            std::copy(closed.q.begin(), closed.q.end(), at.begin());
            loops.at(at);
          }
          loops.follow_rates(rates);
          if (qdd.empty()) continue;
          loops.at(at, rates);
          loops.follow_accelerations(qdd.subspan(i * n, n));
        }
        return {};
      }));
  return gaps.empty() ? 0.0 : *std::max_element(gaps.begin(), gaps.end());
}

std::optional<MissingMotor> missing_motor(const RobotModel& model, std::span<const double> tau) {
  if (model.loops.empty()) return std::nullopt;
  MissingMotor most;
  double greatest = 0;
  const std::size_t n = model.dof();
  for (const double x : tau) greatest = std::max(greatest, std::fabs(x));
  for (const JointModel& j : model.joints) {
    if (j.is_coupled() || !j.passive) continue;
    for (std::int32_t k = 0; k < velocity_count(j.type); ++k)
      for (std::size_t v = static_cast<std::size_t>(j.v_index + k); v < tau.size(); v += n)
        if (std::fabs(tau[v]) > most.force) most = {v % n, std::fabs(tau[v])};
  }
  if (!(most.force > 1e-9 * greatest) || most.force == 0) return std::nullopt;
  return most;
}

}  // namespace robomosp::sim

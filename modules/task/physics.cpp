// SPDX-License-Identifier: Apache-2.0
// Contact physics on the clock of tasks and programs.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel/text.h"
#include "spatial/pose.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

/// Rows and steps this near [relative] are the same.
constexpr double kNearTime = 1e-12;
constexpr double kMostSteps = 1e5;  ///< of physics in a row

bool is_same(const Pose& a, const Pose& b) { return a.p == b.p && a.R == b.R; }

}  // namespace

/// Robots on the moves that have been given.
class TaskExecutor::Ways : public sim::RobotWays {
 public:
  explicit Ways(const TaskExecutor& executor) : executor_(executor) {}
  void at(std::size_t robot, double t, sim::MotionReference::Sample& out) const override {
    const Actor& a = executor_.actors_[robot];
    sample(a, t, state_);
    out.q = state_.q;
    if (can_move(a)) out.qd = state_.qd;
    else out.qd.assign(a.model->dof(), 0.0);
    out.qdd.assign(out.qd.size(), 0.0);
  }
  [[nodiscard]] bool stands(std::size_t robot, double t) const override {
    return moved_until(executor_.actors_[robot]) <= t;
  }

 private:
  const TaskExecutor& executor_;
  mutable JointState state_;
};

Result<void> TaskExecutor::add_physics(const sim::PhysicsRun& wanted, Progress& progress) {
  sim::PhysicsRun run = wanted;
  run.world = id_;
  run.sample_time = step_;
  if (!(step_ / run.step <= kMostSteps))
    return error(ErrorCode::invalid_argument,
                 "the step of " + text::print_rounded(run.step) + " s is too short for rows of " +
                     text::print_rounded(step_) + " s",
                 "Give a step such as 0.001 s.", "contact physics");
  run.step = step_ / std::ceil(step_ / run.step * (1 - kNearTime));
  RMP_TRY_ASSIGN(physics_, sim::SteppedPhysics::create(*sim_, std::move(run), progress));
  note_physics(0);
  if (std::none_of(things_.begin(), things_.end(),
                   [&](const Thing& thing) { return physics_->is_movable(place_of(thing)); }))
    note(0, "no object of the world has a mass and is free, so physics moves nothing");
  // As the engine has it, to the last bit.
  for (Thing& thing : things_)
    if (is_loose(thing)) thing.history.back().pose = physics_->pose(place_of(thing), 0);
  return {};
}

void TaskExecutor::note_physics(double t) {
  const auto& all = physics_->notes();
  for (; physics_notes_ < all.size(); ++physics_notes_) note(t, all[physics_notes_]);
}

double TaskExecutor::next_step(double now) const {
  if (!physics_) return std::numeric_limits<double>::infinity();
  const double step = physics_->step();
  return step * (std::floor(now / step * (1 + kNearTime)) + 1);
}

Result<void> TaskExecutor::go_to(double t, Progress& progress) {
  if (!physics_) return {};
  const Ways ways(*this);
  for (;;) {
    const double row = step_ * static_cast<double>(rows_of_physics_ + 1);
    if (row > t * (1 + kNearTime)) break;
    RMP_TRY(physics_->go_to(row, ways, progress));
    note_physics(row);
    ++rows_of_physics_;
    for (Thing& thing : things_) {
      if (!is_loose(thing)) continue;
      const Pose pose = physics_->pose(place_of(thing), row);
      if (!is_same(pose, thing.history.back().pose))
        thing.history.push_back({row, 0, false, -1, pose});
    }
  }
  RMP_TRY(physics_->go_to(t, ways, progress));
  note_physics(t);
  return {};
}

bool TaskExecutor::is_loose(const Thing& thing) const {
  return physics_ && !thing.history.back().is_held && physics_->is_movable(place_of(thing));
}

}  // namespace robomosp::task

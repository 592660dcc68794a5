// SPDX-License-Identifier: Apache-2.0
#include "robotics/batch_kinematics.h"

#include <algorithm>
#include <numeric>

#include "kernel/check.h"
#include "robotics/kinematics_kernels.h"
#include "spatial/parallel.h"

namespace robomosp::robotics {

const kernels::Table& kernels::table(spatial::InstructionSet set) {
#if defined(__x86_64__)
  set = std::min(set, spatial::widest_instruction_set());
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return avx512::table();
#endif
  if (set == spatial::InstructionSet::avx2) return avx2::table();
#endif
  (void)set;
  return baseline::table();
}

namespace {

constexpr std::size_t kGrain = 256;       // samples a thread takes at least
constexpr double kNanosecondsAJoint = 3;  // about, to decide on threads
static_assert(sizeof(Pose) == 12 * sizeof(double));

}  // namespace

BatchKinematics::BatchKinematics(const RobotModel& model, spatial::InstructionSet set)
    : kernels_(&kernels::table(set)),
      all_(model.joints.size()),
      base_(model.base),
      coordinates_(model.coordinate_count()),
      dof_(model.dof()) {
  for (const JointModel& j : model.joints) joints_.push_back(spatial::joint_constants(j));
  std::iota(all_.begin(), all_.end(), 0);
  for (const TipModel& t : model.tips) {
    Tip tip{{}, t.tool};
    for (std::int32_t j = t.joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent)
      tip.path.push_back(j);
    std::reverse(tip.path.begin(), tip.path.end());
    tips_.push_back(std::move(tip));
  }
  for (const JointModel& j : model.joints) coupled_ = coupled_ || j.is_coupled();
}

std::size_t BatchKinematics::scratch_size() const {
  return spatial::cores() * kernels_->scratch(joints_.size(), coordinates_, dof_);
}

void BatchKinematics::run(kernels::Task& task, std::size_t samples,
                          std::span<double> scratch) const {
  RMP_CHECK(scratch.size() >= scratch_size(), "scratch is too small");
  task.joints = joints_.data();
  task.joint_count = joints_.size();
  task.coordinates = coordinates_;
  task.dof = dof_;
  task.coupled = coupled_;
  const std::size_t own = kernels_->scratch(joints_.size(), coordinates_, dof_);
  const std::size_t threads = spatial::worthwhile_threads(
      samples, kNanosecondsAJoint * static_cast<double>(task.path_count + 1));
  if (threads == 1) return kernels_->run(task, samples, 0, samples, scratch.data());
  spatial::in_parallel(samples, kGrain, threads,
                       [&](std::size_t first, std::size_t last, std::size_t thread) {
                         kernels_->run(task, samples, first, last, scratch.data() + thread * own);
                       });
}

void BatchKinematics::joint_frames(std::span<const double> q, std::span<Pose> frames,
                                   std::span<double> scratch) const {
  if (frames.empty()) return;
  const std::size_t samples = frames.size() / joints_.size();
  RMP_CHECK(frames.size() == samples * joints_.size() && q.size() == samples * coordinates_,
            "spans do not fit");
  kernels::Task task{};
  task.path = all_.data(), task.path_count = all_.size();
  task.q = q.data();
  task.frames = frames.data()->R.data();
  run(task, samples, scratch);
}

void BatchKinematics::tip_poses(std::size_t tip, std::span<const double> q, std::span<Pose> poses,
                                std::span<double> scratch) const {
  RMP_CHECK(tip < tips_.size() && q.size() == poses.size() * coordinates_, "spans do not fit");
  if (poses.empty()) return;
  kernels::Task task{};
  task.path = tips_[tip].path.data(), task.path_count = tips_[tip].path.size();
  task.tool = tips_[tip].tool.R.data();
  task.q = q.data();
  task.poses = poses.data()->R.data();
  run(task, poses.size(), scratch);
}

kernels::Task BatchKinematics::jacobian_task(std::size_t tip, std::span<const double> q,
                                             JacobianFrame frame, std::span<double> out) const {
  RMP_CHECK(tip < tips_.size() && out.size() % (6 * dof_) == 0 &&
                q.size() == out.size() / (6 * dof_) * coordinates_,
            "spans do not fit");
  kernels::Task task{};
  task.path = tips_[tip].path.data(), task.path_count = tips_[tip].path.size();
  task.tool = tips_[tip].tool.R.data();
  task.turned_by = frame == JacobianFrame::world ? base_.R.data() : nullptr;
  task.in_tip = frame == JacobianFrame::tip;
  task.q = q.data();
  task.jacobians = out.data();
  return task;
}

void BatchKinematics::jacobians(std::size_t tip, std::span<const double> q, JacobianFrame frame,
                                std::span<Pose> poses, std::span<double> jacobians,
                                std::span<double> scratch) const {
  if (jacobians.empty()) return;
  kernels::Task task = jacobian_task(tip, q, frame, jacobians);
  const std::size_t samples = jacobians.size() / (6 * dof_);
  RMP_CHECK(poses.empty() || poses.size() == samples, "spans do not fit");
  task.poses = poses.empty() ? nullptr : poses.data()->R.data();
  run(task, samples, scratch);
}

void BatchKinematics::jacobian_rows(std::size_t tip, std::span<const double> q, JacobianFrame frame,
                                    std::span<double> rows, std::span<double> scratch) const {
  if (rows.empty()) return;
  kernels::Task task = jacobian_task(tip, q, frame, rows);
  task.by_rows = true;
  run(task, rows.size() / (6 * dof_), scratch);
}

void BatchKinematics::describe(std::span<const Pose> poses, const Pose& base,
                               const kernels::PoseRows& to) const {
  if (poses.empty()) return;
  const bool is_apart = base.R != Pose{}.R || base.p != Pose{}.p;
  kernels_->describe(poses.data()->R.data(), poses.size(), is_apart ? base.R.data() : nullptr, to);
}

}  // namespace robomosp::robotics

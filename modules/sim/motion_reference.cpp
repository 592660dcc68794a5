// SPDX-License-Identifier: Apache-2.0
#include "sim/motion_reference.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "sim/index.h"
#include "sim/joint_rates.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"

namespace robomosp::sim {
namespace {

using recording::Column;
using recording::Recording;

std::size_t at_or_before(std::span<const double> times, double t) {
  const auto it = std::upper_bound(times.begin(), times.end(), t);
  const auto i = static_cast<std::size_t>(it - times.begin());
  return i == 0 ? 0 : std::min(i - 1, times.size() - 2);
}

}  // namespace

void TimedRows::at(double t, std::span<double> out) const {
  const std::size_t last = times.size() - 1;
  if (t <= times.front() || last == 0) {
    std::copy_n(values.begin(), width, out.begin());
    return;
  }
  if (t >= times[last]) {
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(last * width), width, out.begin());
    return;
  }
  const std::size_t i = at_or_before(times, t);
  const double step = times[i + 1] - times[i], u = step > 0 ? (t - times[i]) / step : 1;
  for (std::size_t k = 0; k < width; ++k) {
    const double a = values[i * width + k], b = values[(i + 1) * width + k];
    out[k] = a + u * (b - a);
  }
}

Result<TimedRows> timed_rows(const Recording& recording, const std::string& stem,
                             std::size_t width) {
  TimedRows rows;
  rows.width = width;
  const Column* time = recording.find("time");
  if (!time || time->values.empty())
    return error(ErrorCode::invalid_argument, "the recording has no samples over time",
                 "Give another recording.");
  rows.times = time->values;
  if (!std::is_sorted(rows.times.begin(), rows.times.end()))
    return error(ErrorCode::invalid_argument, "the times of the recording do not increase",
                 "Give another recording.");
  rows.values.resize(rows.times.size() * width);
  for (std::size_t k = 0; k < width; ++k) {
    const std::string name = stem + std::to_string(k + 1);
    const Column* column = recording.find(name);
    if (!column)
      return error(ErrorCode::invalid_argument,
                   "the recording has no column " + text::quote(name) + "; " +
                       std::to_string(width) + " such are needed",
                   "Give a recording of a robot with the same joints.");
    for (std::size_t i = 0; i < rows.times.size(); ++i)
      rows.values[i * width + k] = column->values[i];
  }
  return rows;
}

MotionReference::MotionReference(const RobotModel& model, std::vector<double> q)
    : model_(&model), times_{0}, q_(std::move(q)), qd_(model.dof(), 0.0), qdd_(model.dof(), 0.0) {}

Result<MotionReference> MotionReference::from_recording(const RobotModel& model,
                                                        const Recording& recording,
                                                        const std::string& stem) {
  MotionReference r(model);
  RMP_TRY_ASSIGN(auto q, timed_rows(recording, stem + "q", model.coordinate_count()));
  r.times_ = std::move(q.times);
  r.q_ = std::move(q.values);
  const double start = r.times_.front();
  for (double& t : r.times_) t -= start;
  const std::size_t n = model.dof();
  r.qd_.resize(r.times_.size() * n);
  r.qdd_.resize(r.times_.size() * n);
  const bool is_plain = n == model.coordinate_count();
  if (is_plain) differentiate(r.times_, r.q_, n, r.qd_, r.qdd_);
  if (recording.find(stem + "qd1") || !is_plain) {
    RMP_TRY_ASSIGN(auto qd, timed_rows(recording, stem + "qd", n));
    r.qd_ = std::move(qd.values);
  }
  if (recording.find(stem + "qdd1")) {
    RMP_TRY_ASSIGN(auto qdd, timed_rows(recording, stem + "qdd", n));
    r.qdd_ = std::move(qdd.values);
  }
  return r;
}

void MotionReference::follow(std::shared_ptr<const motion::Path> path, const Pose& base_T_path) {
  path_ = std::move(path);
  base_T_path_ = base_T_path;
}

Result<void> MotionReference::at(double t, Sample& out) const {
  const std::size_t n = model_->dof(), c = model_->coordinate_count();
  const double last = times_.back();
  if (t >= last || times_.size() == 1) {
    out.q.assign(q_.end() - static_cast<std::ptrdiff_t>(c), q_.end());
    out.qd.assign(n, 0.0);
    out.qdd.assign(n, 0.0);
    if (t == last && times_.size() > 1) {
      out.qd.assign(qd_.end() - static_cast<std::ptrdiff_t>(n), qd_.end());
      out.qdd.assign(qdd_.end() - static_cast<std::ptrdiff_t>(n), qdd_.end());
    }
  } else {
    const double now = std::max(t, times_.front());
    const std::size_t i = at_or_before(times_, now);
    const double h = times_[i + 1] - times_[i], u = h > 0 ? (now - times_[i]) / h : 1;
    out.q.resize(c), out.qd.resize(n), out.qdd.resize(n);
    for (std::size_t v = 0; v < n; ++v) {
      out.qd[v] = qd_[i * n + v] + u * (qd_[(i + 1) * n + v] - qd_[i * n + v]);
      out.qdd[v] = qdd_[i * n + v] + u * (qdd_[(i + 1) * n + v] - qdd_[i * n + v]);
    }
    for (std::size_t k = 0; k < c; ++k)
      out.q[k] = q_[i * c + k] + u * (q_[(i + 1) * c + k] - q_[i * c + k]);
    for (const JointModel& joint : model_->joints) {
      if (joint.is_coupled()) continue;
      const std::size_t k = index(joint.q_index), v = index(joint.v_index);
      if (const std::int32_t count = coordinate_count(joint.type); count > 1) {
        double length = 0;
        double* quaternion = &out.q[k + index(count) - 4];
        for (std::size_t m = 0; m < 4; ++m) length += quaternion[m] * quaternion[m];
        for (std::size_t m = 0; m < 4; ++m) quaternion[m] /= std::sqrt(length);
        continue;
      }
      if (!(h > 0)) continue;
      const spatial::Jet m =
          spatial::Quintic({q_[i * c + k], qd_[i * n + v], qdd_[i * n + v]},
                           {q_[(i + 1) * c + k], qd_[(i + 1) * n + v], qdd_[(i + 1) * n + v]}, h)
              .at(u);
      out.q[k] = m.v, out.qd[v] = m.d, out.qdd[v] = m.dd;
    }
  }
  out.has_tip = path_ != nullptr;
  if (!path_) return {};
  PathSample s;
  const double clamped = std::clamp(t, 0.0, path_->duration());
  RMP_TRY(path_->sample(std::span(&clamped, 1), std::span(&s, 1)));
  out.tip = spatial::compose(base_T_path_, s.pose);
  out.tip_velocity = {}, out.tip_acceleration = {};
  if (t > path_->duration()) return {};
  const Vec3 v = spatial::rotate(base_T_path_, s.velocity),
             w = spatial::rotate(base_T_path_, s.angular_velocity),
             a = spatial::rotate(base_T_path_, s.acceleration),
             wd = spatial::rotate(base_T_path_, s.angular_acceleration);
  for (std::size_t k = 0; k < 3; ++k) {
    out.tip_velocity[k] = v[k], out.tip_velocity[3 + k] = w[k];
    out.tip_acceleration[k] = a[k], out.tip_acceleration[3 + k] = wd[k];
  }
  return {};
}

}  // namespace robomosp::sim

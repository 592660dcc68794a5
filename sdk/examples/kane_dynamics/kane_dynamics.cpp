// SPDX-License-Identifier: Apache-2.0
// Inverse and forward dynamics of one's own for trees of revolute and prismatic joints, by Kane's
// equations: the torque of a joint is the sum over the bodies of (inertial force) . (velocity of
// the centre of mass for unit joint speed) + (inertial moment) . (angular velocity likewise) (Kane
// and Levinson, Dynamics: Theory and Applications, 1985, chapter 6). Forward dynamics solves with
// the inertia matrix, whose columns are torques of unit accelerations.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
using Matrix = std::array<double, 9>;  // row-major
Vec3 operator*(const Matrix& R, const Vec3& v) {
  return {R[0] * v[0] + R[1] * v[1] + R[2] * v[2], R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
          R[6] * v[0] + R[7] * v[1] + R[8] * v[2]};
}
Vec3 transposed_times(const Matrix& R, const Vec3& v) {
  return {R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
          R[2] * v[0] + R[5] * v[1] + R[8] * v[2]};
}
Matrix operator*(const Matrix& A, const Matrix& B) {
  Matrix C{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) C[3 * r + c] += A[3 * r + k] * B[3 * k + c];
  return C;
}

// Joint i in motion, all in the base frame. Kept in the caller's scratch: a provider allocates
// nothing after prepare.
struct Moving {
  Matrix R;
  Vec3 p, z;      // origin and axis
  Vec3 w, dw, a;  // angular velocity and acceleration, acceleration of the origin
};
constexpr std::size_t kNumbers = sizeof(Moving) / sizeof(double);

// Motion of one sample; a null pointer means zeros. Weight is an acceleration of the base upwards.
struct Motion {
  const double* q = nullptr;
  const double* qd = nullptr;
  const double* qdd = nullptr;
  std::size_t unit = SIZE_MAX;  // the joint with an acceleration of 1, when qdd is null
  Vec3 base_w{}, base_dw{}, base_a{};
};

class Equations {
 public:
  Result<void> prepare(const RobotModel& model) {
    // What it cannot do is an error that says so; the program then names another choice.
    if (!model.is_simple() || !model.loops.empty())
      return error(ErrorCode::unsupported,
                   "it has joints of several coordinates, followers or closed loops",
                   "Choose newton_euler.", "robot \"" + model.name + "\"");
    model_ = &model;
    return {};
  }
  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] std::size_t n() const { return model_->dof(); }
  [[nodiscard]] std::size_t scratch_size() const { return kNumbers * n(); }

  Result<void> check(const DynamicsBatch& b, std::size_t scratch, std::size_t output,
                     std::size_t output_per_sample) const {
    const auto fits = [&](std::size_t size) { return size == 0 || size == b.count * n(); };
    const auto one_or_all = [&](std::size_t size) { return size <= 1 || size == b.count; };
    if (b.q.size() != b.count * n() || !fits(b.qd.size()) || !fits(b.qdd.size()) ||
        !fits(b.tau.size()) || !one_or_all(b.tip.size()) || !one_or_all(b.base.size()) ||
        b.scratch.size() < scratch || output != b.count * output_per_sample)
      return error(ErrorCode::invalid_argument, "a vector does not fit the number of samples",
                   "Give one number for each joint and sample.");
    return {};
  }

  // tau of sample i for the terms.
  void torques(const DynamicsBatch& b, std::size_t i, std::uint32_t terms, double* tau) const {
    Motion m;
    m.q = b.q.data() + i * n();
    if (!b.qd.empty() && (terms & kVelocityTerm)) m.qd = b.qd.data() + i * n();
    if (!b.qdd.empty() && (terms & kInertialTerm)) m.qdd = b.qdd.data() + i * n();
    Vec3 gravity = model_->gravity;
    if (!b.base.empty()) {
      const BaseMotion& base = b.base[b.base.size() == 1 ? 0 : i];
      gravity = base.gravity;
      if (terms & (kInertialTerm | kVelocityTerm)) m.base_w = base.angular_velocity;
      if (terms & kInertialTerm)
        m.base_dw = base.angular_acceleration, m.base_a = base.acceleration;
    }
    if (terms & kGravityTerm) m.base_a = m.base_a - gravity;
    std::fill_n(tau, n(), 0.0);
    Moving* all = reinterpret_cast<Moving*>(b.scratch.data());
    // The turning base alone belongs to the inertial term, with moving joints to the velocity term.
    if (!(terms & kInertialTerm) && dot(m.base_w, m.base_w) > 0) {
      Motion still;
      still.q = m.q;
      still.base_w = m.base_w;
      add(still, -1, all, tau);
    }
    add(m, 1, all, tau);
    for (std::size_t j = 0; j < n(); ++j) {
      const JointModel& joint = model_->joints[j];
      const double rate = b.qd.empty() ? 0 : b.qd[i * n() + j];
      if (m.qdd) tau[j] += joint.armature * m.qdd[j];
      if (terms & kSpringTerm) tau[j] += joint.spring.stiffness * (m.q[j] - joint.spring.rest);
      if (terms & kFrictionTerm)
        tau[j] += joint.friction.viscous * rate + (rate > 1e-9    ? joint.friction.coulomb_positive
                                                   : rate < -1e-9 ? joint.friction.coulomb_negative
                                                                  : 0);
    }
    if (!(terms & kExternalTerm) || b.tip.empty()) return;
    const TipWrench& wrench = b.tip[b.tip.size() == 1 ? 0 : i];
    const TipModel& tip = model_->tips[static_cast<std::size_t>(b.tip_index)];
    if (tip.joint < 0) return;
    const Moving& last = all[tip.joint];
    project(tip.joint, last.p + last.R * tip.tool.p, -1.0 * wrench.force, -1.0 * wrench.moment, all,
            tau);
  }

  // M(q), column by column; it is symmetric.
  void inertia(const double* q, Moving* all, double* m) const {
    std::fill_n(m, n() * n(), 0.0);
    for (std::size_t c = 0; c < n(); ++c) {
      Motion unit;
      unit.q = q;
      unit.unit = c;
      add(unit, 1, all, m + c * n());
      m[c * n() + c] += model_->joints[c].armature;
    }
  }

 private:
  // Adds sign times the torques of a motion, without what stands in the joints themselves.
  void add(const Motion& m, double sign, Moving* all, double* tau) const {
    for (std::size_t i = 0; i < n(); ++i) {
      const JointModel& joint = model_->joints[i];
      const double rate = m.qd ? m.qd[i] : 0, push = m.qdd ? m.qdd[i] : m.unit == i ? 1 : 0;
      const Moving base{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}, {}, m.base_w, m.base_dw, m.base_a};
      const Moving& up = joint.parent < 0 ? base : all[joint.parent];
      Moving& now = all[i];
      now.R = up.R * joint.placement.R;
      now.z = {now.R[2], now.R[5], now.R[8]};
      Vec3 arm = up.R * joint.placement.p;  // from the parent's origin to this one
      now.w = up.w, now.dw = up.dw;
      if (joint.type == JointType::revolute) {
        const double c = std::cos(m.q[i]), s = std::sin(m.q[i]);
        now.R = now.R * Matrix{c, -s, 0, s, c, 0, 0, 0, 1};
        now.w = up.w + rate * now.z;
        now.dw = up.dw + push * now.z + cross(up.w, rate * now.z);
      } else {
        arm = arm + m.q[i] * now.z;
      }
      now.p = up.p + arm;
      now.a = up.a + cross(up.dw, arm) + cross(up.w, cross(up.w, arm));
      if (joint.type == JointType::prismatic)
        now.a = now.a + 2.0 * cross(up.w, rate * now.z) + push * now.z;
    }
    for (std::size_t i = 0; i < n(); ++i) {
      const MassProperties& body = model_->joints[i].body;
      const Moving& now = all[i];
      const Vec3 com = now.R * body.com;
      const auto turned = [&](const Vec3& v) {  // the inertia about the centre of mass times v
        const Sym3& I = body.inertia;
        return now.R * (Matrix{I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz} *
                        transposed_times(now.R, v));
      };
      const Vec3 force =
          sign * body.mass * (now.a + cross(now.dw, com) + cross(now.w, cross(now.w, com)));
      const Vec3 moment = sign * (turned(now.dw) + cross(now.w, turned(now.w)));
      project(static_cast<std::int32_t>(i), now.p + com, force, moment, all, tau);
    }
  }
  // Adds the power of a force at a point and a moment on a body, for unit speed of each joint.
  void project(std::int32_t body, const Vec3& at, const Vec3& force, const Vec3& moment,
               const Moving* all, double* tau) const {
    for (std::int32_t j = body; j >= 0; j = model_->joints[static_cast<std::size_t>(j)].parent)
      tau[j] += model_->joints[static_cast<std::size_t>(j)].type == JointType::revolute
                    ? dot(all[j].z, cross(at - all[j].p, force) + moment)
                    : dot(all[j].z, force);
  }

  const RobotModel* model_ = nullptr;
};

Error cancelled() { return error(ErrorCode::cancelled, "stopped", "Start it again."); }

class KaneInverse final : public InverseDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params&) override {
    return equations_.prepare(model);
  }
  std::size_t scratch_size() const override { return equations_.scratch_size(); }
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    const std::size_t n = equations_.n();
    RMP_TRY(equations_.check(batch, scratch_size(), tau.size(), n));
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % 1024 == 0 && progress.cancelled()) return cancelled();
      equations_.torques(batch, i, batch.terms, &tau[i * n]);
    }
    return {};
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    const std::size_t n = equations_.n();
    RMP_TRY(equations_.check(batch, scratch_size(), m.size(), n * n));
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % 1024 == 0 && progress.cancelled()) return cancelled();
      equations_.inertia(&batch.q[i * n], reinterpret_cast<Moving*>(batch.scratch.data()),
                         &m[i * n * n]);
    }
    return {};
  }

 private:
  Equations equations_;
};

// M = L L^T in the lower triangle; false and the row where M is not positive definite.
bool factor(double* m, std::size_t n, std::size_t& row) {
  for (row = 0; row < n; ++row)
    for (std::size_t c = 0; c <= row; ++c) {
      double s = m[row * n + c];
      for (std::size_t k = 0; k < c; ++k) s -= m[row * n + k] * m[c * n + k];
      if (c < row) {
        m[row * n + c] = s / m[c * n + c];
      } else if (s > 1e-12 * m[row * n + row]) {
        m[row * n + row] = std::sqrt(s);
      } else {
        return false;
      }
    }
  return true;
}

class KaneForward final : public ForwardDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params&) override {
    RMP_TRY(equations_.prepare(model));
    // A joint that moves no mass has no acceleration; seen in any configuration.
    const std::size_t n = equations_.n();
    std::vector<double> q(n, 0.3), m(n * n), scratch(equations_.scratch_size());
    equations_.inertia(q.data(), reinterpret_cast<Moving*>(scratch.data()), m.data());
    std::size_t row = 0;
    if (!factor(m.data(), n, row))
      return error(ErrorCode::invalid_argument,
                   "joint \"" + model.joints[row].name + "\" moves no mass",
                   "Give its link a mass or its motor an inertia.", "robot \"" + model.name + "\"");
    return {};
  }
  std::size_t scratch_size() const override {
    return equations_.scratch_size() + equations_.n() * equations_.n();
  }
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override {
    const std::size_t n = equations_.n();
    RMP_TRY(equations_.check(batch, scratch_size(), qdd.size(), n));
    DynamicsBatch still = batch;
    still.qdd = {};
    double* m = batch.scratch.data() + equations_.scratch_size();
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % 1024 == 0 && progress.cancelled()) return cancelled();
      // M qdd = tau - (all that does not depend on qdd); a moving base counts always.
      double* x = &qdd[i * n];
      equations_.torques(still, i, batch.terms | kInertialTerm, x);
      for (std::size_t j = 0; j < n; ++j)
        x[j] = (batch.tau.empty() ? 0 : batch.tau[i * n + j]) - x[j];
      equations_.inertia(&batch.q[i * n], reinterpret_cast<Moving*>(batch.scratch.data()), m);
      std::size_t row = 0;
      if (!factor(m, n, row))
        return error(ErrorCode::invalid_argument,
                     "joint \"" + equations_.model().joints[row].name + "\" moves no mass here",
                     "Give its link a mass or its motor an inertia.");
      for (std::size_t r = 0; r < n; ++r) {
        for (std::size_t k = 0; k < r; ++k) x[r] -= m[r * n + k] * x[k];
        x[r] /= m[r * n + r];
      }
      for (std::size_t r = n; r-- > 0;) {
        for (std::size_t k = r + 1; k < n; ++k) x[r] -= m[k * n + r] * x[k];
        x[r] /= m[r * n + r];
      }
    }
    return {};
  }

 private:
  Equations equations_;
};

}  // namespace

RMP_PLUGIN("org.example.kane_dynamics", "0.1.0", "Apache-2.0", "Dynamics as an example.",
           RMP_PROVIDER_NO_PARAMS(KaneInverse, "kane", "Torques by Kane's equations.",
                                  "serial,tree"),
           RMP_PROVIDER_NO_PARAMS(KaneForward, "kane",
                                  "Accelerations with the inertia matrix by Kane's equations.",
                                  "serial,tree"))

// SPDX-License-Identifier: Apache-2.0
// Providers "newton_euler" (inverse dynamics) and "inertia_matrix" (forward dynamics)
// (layer: plugin). Paper eqs 2-6 and 8-10.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/plugin.h>

#include "chain.h"
#include "inertia_matrix.h"
#include "newton_euler.h"

namespace robomosp::newton_euler {
namespace {

const rmp_param kParams[] = {
    {"inertia_method", "enum", "",
     "How the joint-space inertia is found: composite bodies, or column by column from "
     "Newton-Euler.",
     "composite", "composite|columns", 1, 0},
};

InertiaMethod chosen_method(const Params& params) {
  return params.text("inertia_method") == "columns" ? InertiaMethod::columns
                                                    : InertiaMethod::composite;
}

Error not_finite(const char* what, std::size_t sample) {
  return error(ErrorCode::invalid_argument,
               std::string(what) + " of sample " + std::to_string(sample + 1) + " are not finite",
               "Check the joint values, rates and forces given for it.");
}

bool all_finite(const double* v, std::size_t n) {
  // 0 * v is NaN for infinities and NaN, else 0.
  return std::accumulate(v, v + n, 0.0, [](double s, double x) { return s + 0 * x; }) == 0;
}

Error cancelled() { return error(ErrorCode::cancelled, "the dynamics were stopped"); }

class NewtonEuler final : public InverseDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY_ASSIGN(chain_, make_chain(model));
    method_ = chosen_method(params);
    return {};
  }
  std::size_t scratch_size() const override {
    return std::max(newton_euler_scratch(chain_), inertia_scratch(chain_, method_));
  }
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    const std::size_t n = chain_.dof();
    RMP_TRY(check_batch(chain_, batch, newton_euler_scratch(chain_), tau.size(), n));
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      double* out = tau.data() + i * n;
      selected_torques(chain_, batch, i, batch.terms, batch.scratch.data(), out);
      if (!all_finite(out, n)) return not_finite("the torques", i);
    }
    return {};
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    const std::size_t n = chain_.dof();
    RMP_TRY(check_batch(chain_, batch, inertia_scratch(chain_, method_), m.size(), n * n));
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      double* out = m.data() + i * n * n;
      joint_space_inertia(chain_, method_, batch.q.data() + i * n, batch.scratch.data(), out);
      if (!all_finite(out, n * n)) return not_finite("the inertias", i);
    }
    return {};
  }

 private:
  Chain chain_;
  InertiaMethod method_ = InertiaMethod::composite;
};

class InertiaMatrix final : public ForwardDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY_ASSIGN(chain_, make_chain(model));
    method_ = chosen_method(params);
    robot_ = model.name;
    names_.clear();
    for (const JointModel& joint : model.joints) names_.push_back(joint.name);
    return refuse_singular();
  }
  std::size_t scratch_size() const override {
    const std::size_t n = chain_.dof();
    return std::max(newton_euler_scratch(chain_), inertia_scratch(chain_, method_)) + n * n + n;
  }
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override {
    const std::size_t n = chain_.dof();
    RMP_TRY(check_batch(chain_, batch, scratch_size(), qdd.size(), n));
    double* m = batch.scratch.data();
    double* bias = m + n * n;
    double* rest = bias + n;
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      double* out = qdd.data() + i * n;
      selected_torques(chain_, batch, i, batch.terms & ~static_cast<std::uint32_t>(kInertialTerm),
                       rest, bias);
      for (std::size_t j = 0; j < n; ++j)
        out[j] = (batch.tau.empty() ? 0.0 : batch.tau[i * n + j]) - bias[j];
      if (!all_finite(out, n)) return not_finite("the forces", i);
      joint_space_inertia(chain_, method_, batch.q.data() + i * n, rest, m);
      if (const std::int32_t joint = factor(chain_, m, bias); joint >= 0)
        return std::move(singular(joint)).in("sample " + std::to_string(i + 1));
      solve(chain_, m, out);
    }
    return {};
  }

 private:
  [[nodiscard]] Error singular(std::int32_t joint) const {
    return error(
        ErrorCode::invalid_argument,
        "the inertia that it moves is zero or negative, so its acceleration is undefined",
        "Give the bodies it carries a mass, or its drive a motor inertia.",
        "robot \"" + robot_ + "\", joint \"" + names_[static_cast<std::size_t>(joint)] + "\"");
  }
  // A mechanism that is singular wherever one looks is singular by its masses; a single
  // configuration could be an accident. The places are multiples of the golden angle.
  [[nodiscard]] Result<void> refuse_singular() const {
    const std::size_t n = chain_.dof();
    std::vector<double> q(n), m(n * n), diagonal(n), rest(inertia_scratch(chain_, method_));
    std::int32_t joint = -1;
    for (int attempt = 1; attempt <= 4; ++attempt) {
      for (std::size_t j = 0; j < n; ++j)
        q[j] = std::fmod(
            2.399963229728653 * static_cast<double>(static_cast<std::size_t>(attempt) * (j + 1)),
            3.0);
      joint_space_inertia(chain_, method_, q.data(), rest.data(), m.data());
      joint = factor(chain_, m.data(), diagonal.data());
      if (joint < 0) return {};
    }
    return singular(joint);
  }

  Chain chain_;
  InertiaMethod method_ = InertiaMethod::composite;
  std::string robot_;
  std::vector<std::string> names_;
};

}  // namespace
}  // namespace robomosp::newton_euler

RMP_PLUGIN("org.robomosp.dynamics_newton_euler", "0.1.0", "Apache-2.0",
           "Inverse and forward dynamics by recursive Newton-Euler.",
           RMP_PROVIDER(robomosp::newton_euler::NewtonEuler, "newton_euler",
                        "Recursive Newton-Euler in joint frames, for chains and trees of any size.",
                        "serial,tree,batch", robomosp::newton_euler::kParams),
           RMP_PROVIDER(robomosp::newton_euler::InertiaMatrix, "inertia_matrix",
                        "Joint-space inertia matrix and its sparse factorization, O(n^3) at worst.",
                        "serial,tree,batch", robomosp::newton_euler::kParams))

// SPDX-License-Identifier: Apache-2.0
// Providers of forward dynamics beside the inertia matrix (layer: plugin).
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/plugin.h>

#include "articulated_body.h"
#include "constrained.h"
#include "divide_and_conquer.h"
#include "samples.h"
#include "spatial/parallel.h"
#include "spatial/recursion_batch.h"

namespace robomosp::articulated {
namespace {

using spatial::recursions::Chain;
using spatial::recursions::Runner;
using What = spatial::recursions::Task::What;

const rmp_param kArticulatedParams[] = {
    {"instructions", "enum", "",
     "The processor's instructions to use: the widest it has, or no wider than these.", "auto",
     "auto|avx512|avx2|baseline", 1, 0},
};

class ArticulatedBody final : public ForwardDynamics {
 public:
  explicit ArticulatedBody(const rmp_host* host) { spatial::use_threads_of(host); }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(refuse_loops(model));
    RMP_TRY_ASSIGN(articulated_, make_articulated(model));
    simple_ = model.is_simple();
    if (simple_) {
      RMP_TRY_ASSIGN(chain_, Chain::make(model));
      runner_ = Runner(spatial::instruction_set_up_to(params.text("instructions")),
                       articulated_.pivot.data());
    }
    std::vector<double> scratch(articulated_scratch(articulated_));
    return refuse_singular(tree(), [&](const DynamicsBatch& b, double* qdd) {
      return articulated::accelerations(articulated_, b, 0, scratch.data(), qdd);
    });
  }
  std::size_t scratch_size() const override {
    const std::size_t n = tree().velocities;
    return std::max(own_scratch(), spatial::derivatives_scratch(tree()) + n * n + 2 * n);
  }
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override {
    const std::size_t n = tree().velocities;
    RMP_TRY(spatial::check_batch(tree(), batch, own_scratch(), qdd.size(), n));
    if (simple_) {
      std::size_t bad = 0;
      RMP_TRY_ASSIGN(bad, runner_.run(chain_, What::accelerations, batch, qdd, progress));
      if (bad == batch.count) return {};
      RMP_TRY(one(batch, bad, qdd.data() + bad * n));
      return not_finite("the forces", bad);
    }
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      RMP_TRY(one(batch, i, qdd.data() + i * n));
    }
    return {};
  }
  Result<void> derivatives(const DynamicsBatch& batch, std::span<double> by_q,
                           std::span<double> by_qd, std::span<double> by_tau,
                           Progress& progress) const override {
    const std::size_t n = tree().velocities;
    RMP_TRY(spatial::check_batch(tree(), batch, scratch_size(), by_q.size(), n * n));
    RMP_TRY(spatial::check_batch(tree(), batch, scratch_size(), by_qd.size(), n * n));
    RMP_TRY(spatial::check_batch(tree(), batch, scratch_size(), by_tau.size(), n * n));
    double* m = batch.scratch.data() + spatial::derivatives_scratch(tree());
    double *qdd = m + n * n, *column = qdd + n;
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      // The accelerations' scratch may reach into m, which is filled afterwards; qdd is moved out
      // of its way.
      RMP_TRY(one(batch, i, by_tau.data() + i * n * n));
      std::copy_n(by_tau.data() + i * n * n, n, qdd);
      const std::span<double> dq = by_q.subspan(i * n * n, n * n),
                              dqd = by_qd.subspan(i * n * n, n * n),
                              dtau = by_tau.subspan(i * n * n, n * n);
      spatial::tree_derivatives(tree(), batch, i, qdd, true, batch.scratch.data(), dq, dqd);
      const auto swept = spatial::take_scratch(tree(), batch.scratch.data());
      spatial::tree_inertia(tree(), swept.bodies, swept.columns, std::span(m, n * n));
      if (const std::ptrdiff_t bad = spatial::cholesky(std::span(m, n * n), n); bad >= 0)
        return std::move(singular(tree(), joint_of(tree(), static_cast<std::size_t>(bad))))
            .in(sample_name(i));
      std::fill(dtau.begin(), dtau.end(), 0.0);
      for (std::size_t k = 0; k < n; ++k) dtau[k * n + k] = 1;
      for (const std::span<double> d : {dq, dqd, dtau})
        for (std::size_t c = 0; c < n; ++c) {
          const double sign = d.data() == dtau.data() ? 1 : -1;
          for (std::size_t r = 0; r < n; ++r) column[r] = sign * d[r * n + c];
          spatial::cholesky_solve(std::span<const double>(m, n * n), n, column);
          for (std::size_t r = 0; r < n; ++r) d[r * n + c] = column[r];
        }
    }
    return {};
  }

 private:
  std::size_t own_scratch() const {
    const std::size_t one = articulated_scratch(articulated_);
    return simple_ ? std::max(one, runner_.scratch_size(chain_, {What::accelerations})) : one;
  }
  const spatial::BodyTree& tree() const { return articulated_.tree; }
  Result<void> one(const DynamicsBatch& batch, std::size_t i, double* qdd) const {
    const std::int32_t bad =
        articulated::accelerations(articulated_, batch, i, batch.scratch.data(), qdd);
    const bool finite = all_finite(qdd, bad >= 0 ? 0 : tree().velocities);
    if (bad >= 0 && finite_inputs(tree(), batch, i))
      return std::move(singular(tree(), bad)).in(sample_name(i));
    if (bad >= 0 || !finite) return not_finite("the forces", i);
    return {};
  }
  Articulated articulated_;
  // Samples of revolute and prismatic joints are computed side by side.
  bool simple_ = false;
  Chain chain_;
  Runner runner_;
};

const rmp_param kConstrainedParams[] = {
    {"stabilization", "real", "1/s",
     "Rate at which gaps of the loops close, critically damped; 0 lets them drift.", "20", nullptr,
     0, 1000},
};

const rmp_param kDivideParams[] = {
    {"threads", "int", "", "Threads for one robot at most; 0 = as many as its length is worth.",
     "0", nullptr, 0, 64},
};

}  // namespace
}  // namespace robomosp::articulated

RMP_PLUGIN(
    "org.robomosp.dynamics_articulated", "0.1.0", "Apache-2.0",
    "Forward dynamics by articulated bodies, and of closed loops.",
    RMP_PROVIDER(robomosp::articulated::ArticulatedBody, "articulated_body",
                 "Articulated bodies in O(n): trees of all joint types, of any size.",
                 "serial,tree,coupled,floating,batch,derivatives",
                 robomosp::articulated::kArticulatedParams),
    RMP_PROVIDER(
        robomosp::articulated::Constrained, "constrained",
        "Closed loops by Lagrange's multipliers, with the forces that close them; trees too.",
        "serial,tree,coupled,floating,loops,batch", robomosp::articulated::kConstrainedParams),
    RMP_PROVIDER(robomosp::articulated::DivideAndConquer, "divide_and_conquer",
                 "Halves of long serial chains put together in O(log n) depth, on all cores.",
                 "serial,batch", robomosp::articulated::kDivideParams))

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
     "Greatest instruction set of the processor to use; by default the widest it has.", "auto",
     "auto|avx512|avx2|baseline", 1, 0},
};

class ArticulatedBody final : public ForwardDynamics {
 public:
  explicit ArticulatedBody(const rmp_host* host) { spatial::use_threads_of(host); }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(refuse_loops(model));
    RMP_TRY_ASSIGN(articulated_, make_articulated(model));
    simple_ = model.is_simple();
    RMP_TRY_ASSIGN(chain_, Chain::make(model));
    const auto set = spatial::instruction_set_up_to(params.text("instructions"));
    runner_ = simple_ ? Runner(set, articulated_.pivot.data()) : Runner(set, false);
    std::vector<double> scratch(articulated_scratch(articulated_));
    return refuse_singular(tree(), [&](const DynamicsBatch& b, double* qdd) {
      return articulated::accelerations(articulated_, b, 0, scratch.data(), qdd);
    });
  }
  std::size_t scratch_size() const override {
    const std::size_t derivatives = derivatives_scratch() + tree().velocities;
    return derivatives > kMostSharedScratch ? own_scratch() : std::max(own_scratch(), derivatives);
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
  Result<void> derivatives(const DynamicsBatch& given, std::span<double> by_q,
                           std::span<double> by_qd, std::span<double> by_tau,
                           Progress& progress) const override {
    const std::size_t n = tree().velocities;
    for (const std::span<double> out : {by_q, by_qd, by_tau})
      RMP_TRY(spatial::check_batch(tree(), given, scratch_size(), out.size(), n * n));
    DynamicsBatch batch = given;
    std::vector<double> scratch;  // of very long chains, whose accelerations need little
    if (const std::size_t all = derivatives_scratch() + n; batch.scratch.size() < all) {
      scratch.resize(all);
      batch.scratch = scratch;
    }
    if (simple_) {
      std::size_t bad = 0;
      RMP_TRY_ASSIGN(bad, runner_.differentiate(chain_, batch, by_q, by_qd, by_tau, progress));
      return bad == batch.count ? Result<void>() : no_derivatives(batch, bad);
    }
    const std::span<double> qdd = batch.scratch.subspan(derivatives_scratch(), n);
    for (std::size_t i = 0; i < batch.count; ++i) {
      if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
      // The accelerations' scratch may reach into qdd.
      const std::span<double> dtau = by_tau.subspan(i * n * n, n * n);
      RMP_TRY(one(batch, i, dtau.data()));
      std::copy_n(dtau.data(), n, qdd.data());
      DynamicsBatch sample = batch;
      sample.count = 1;
      sample.q = batch.q.subspan(i * tree().coordinates, tree().coordinates);
      if (!batch.qd.empty()) sample.qd = batch.qd.subspan(i * n, n);
      sample.qdd = qdd;
      if (batch.tip.size() > 1) sample.tip = batch.tip.subspan(i, 1);
      if (batch.base.size() > 1) sample.base = batch.base.subspan(i, 1);
      std::size_t bad = 0;
      RMP_TRY_ASSIGN(bad, runner_.differentiate(chain_, sample, by_q.subspan(i * n * n, n * n),
                                                by_qd.subspan(i * n * n, n * n), dtau, progress));
      if (bad != 1) return no_derivatives(batch, i);
    }
    return {};
  }

 private:
  std::size_t own_scratch() const {
    const std::size_t one = articulated_scratch(articulated_);
    return simple_ ? std::max(one, runner_.scratch_size(chain_, {What::accelerations})) : one;
  }
  std::size_t derivatives_scratch() const {
    return runner_.scratch_size(chain_, {What::acceleration_derivatives});
  }
  const spatial::BodyTree& tree() const { return articulated_.tree; }
  /// Why sample i has none.
  Result<void> no_derivatives(const DynamicsBatch& batch, std::size_t i) const {
    const std::size_t n = tree().velocities;
    std::vector<double> qdd(n), m(n * n), scratch(spatial::tree_scratch(tree()));
    RMP_TRY(one(batch, i, qdd.data()));
    const auto swept = spatial::take_scratch(tree(), scratch.data());
    spatial::TreeState still;
    still.q = batch.q.data() + i * tree().coordinates;
    spatial::sweep(tree(), still, swept.bodies, swept.columns);
    spatial::gather(tree(), swept.bodies, true);
    spatial::tree_inertia(tree(), swept.bodies, swept.columns, m);
    const std::ptrdiff_t bad = spatial::cholesky(m, n);
    if (bad < 0) return not_finite("the derivatives", i);
    return std::move(singular(tree(), joint_of(tree(), static_cast<std::size_t>(bad))))
        .in(sample_name(i));
  }
  Result<void> one(const DynamicsBatch& batch, std::size_t i, double* qdd) const {
    const std::int32_t bad =
        articulated::accelerations(articulated_, batch, i, batch.scratch.data(), qdd);
    const bool finite = all_finite(qdd, bad >= 0 ? 0 : tree().velocities);
    if (bad >= 0 && finite_inputs(tree(), batch, i))
      return std::move(singular(tree(), bad)).in(sample_name(i));
    if (bad >= 0 || !finite) return not_finite("the forces", i);
    return {};
  }
  /// Doubles that every call is given for derivatives, which few ask for.
  static constexpr std::size_t kMostSharedScratch = std::size_t{1} << 20;
  Articulated articulated_;
  // Accelerations of revolute and prismatic joints are computed side by side.
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
    {"threads", "int", "",
     "Greatest number of threads for one robot; 0 = as many as its length justifies.", "0", nullptr,
     0, 64},
};

}  // namespace
}  // namespace robomosp::articulated

RMP_PLUGIN("org.robomosp.dynamics_articulated", "0.1.0", "Apache-2.0",
           "Forward dynamics by articulated bodies, and of closed loops.",
           RMP_PROVIDER(robomosp::articulated::ArticulatedBody, "articulated_body",
                        "Articulated bodies in O(n): trees of all joint types, of any size.",
                        "serial,tree,coupled,floating,batch,derivatives",
                        robomosp::articulated::kArticulatedParams),
           RMP_PROVIDER(robomosp::articulated::Constrained, "constrained",
                        "Closed loops by Lagrange multipliers, with the loop forces; trees too.",
                        "serial,tree,coupled,floating,loops,batch",
                        robomosp::articulated::kConstrainedParams),
           RMP_PROVIDER(robomosp::articulated::DivideAndConquer, "divide_and_conquer",
                        "Divides long serial chains into halves: O(log n) depth, on all cores.",
                        "serial,batch", robomosp::articulated::kDivideParams))

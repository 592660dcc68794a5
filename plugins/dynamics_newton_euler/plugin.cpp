// SPDX-License-Identifier: Apache-2.0
// Providers "newton_euler" (inverse dynamics) and "inertia_matrix" (forward dynamics)
// (layer: plugin). Paper eqs 2-6 and 8-10.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/plugin.h>

#include "further.h"
#include "inertia_matrix.h"
#include "spatial/parallel.h"
#include "spatial/recursion_batch.h"

namespace robomosp::newton_euler {
namespace {

using spatial::recursions::Runner;
using What = spatial::recursions::Task::What;

const rmp_param kParams[] = {
    {"inertia_method", "enum", "",
     "Method for the joint-space inertia: composite bodies, or column by column from Newton-Euler.",
     "composite", "composite|columns", 1, 0},
    {"instructions", "enum", "",
     "Greatest instruction set of the processor to use; by default the widest it has.", "auto",
     "auto|avx512|avx2|baseline", 1, 0},
};

Runner make_runner(const Params& params) {
  return {spatial::instruction_set_up_to(params.text("instructions")),
          params.text("inertia_method") == "columns"};
}

Error not_finite(const char* what, std::size_t sample) {
  return error(ErrorCode::invalid_argument,
               std::string(what) + " of sample " + std::to_string(sample + 1) + " are not finite",
               "Check its joint values, rates and forces.");
}

class NewtonEuler final : public InverseDynamics {
 public:
  explicit NewtonEuler(const rmp_host* host) { spatial::use_threads_of(host); }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY_ASSIGN(chain_, Chain::make(model));
    runner_ = make_runner(params);
    RMP_TRY_ASSIGN(tree_, spatial::make_body_tree(model));
    scratch_ = std::max(runner_.scratch_size(chain_, {What::torques}), further_scratch(tree_));
    if (chain_.dof() <= kMostWithMatrices)
      scratch_ = std::max(scratch_,
                          runner_.scratch_size(chain_, {What::inertia, What::torque_derivatives}));
    return {};
  }
  std::size_t scratch_size() const override { return scratch_; }
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    return run(What::torques, "the torques", batch, tau, chain_.dof(), progress);
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    return run(What::inertia, "the inertias", batch, m, chain_.dof() * chain_.dof(), progress);
  }
  Result<void> derivatives(const DynamicsBatch& batch, std::span<double> by_q,
                           std::span<double> by_qd, Progress& progress) const override {
    const std::size_t width = chain_.dof() * chain_.dof();
    for (const std::span<double> out : {by_q, by_qd})
      RMP_TRY(spatial::check_batch(chain_.shape(), batch, scratch_, out.size(), width));
    const Enough enough(batch, runner_.scratch_size(chain_, {What::torque_derivatives}));
    std::size_t bad = 0;
    RMP_TRY_ASSIGN(bad, runner_.differentiate(chain_, enough.batch, by_q, by_qd, {}, progress));
    if (bad != batch.count) return not_finite("the derivatives", bad);
    return {};
  }
  Result<void> regressor(const DynamicsBatch& batch, std::span<double> y,
                         Progress& progress) const override {
    return newton_euler::regressor(tree_, batch, y, progress);
  }
  Result<void> energy(const DynamicsBatch& batch, std::span<Energy> out,
                      Progress& progress) const override {
    return newton_euler::energy(tree_, batch, out, progress);
  }

 private:
  Result<void> run(What what, const char* name, const DynamicsBatch& batch, std::span<double> out,
                   std::size_t width, Progress& progress) const {
    RMP_TRY(spatial::check_batch(chain_.shape(), batch, scratch_, out.size(), width));
    const Enough enough(batch, what == What::torques ? 0 : runner_.scratch_size(chain_, {what}));
    std::size_t bad = 0;
    RMP_TRY_ASSIGN(bad, runner_.run(chain_, what, enough.batch, out, progress));
    if (bad != batch.count) return not_finite(name, bad);
    return {};
  }

  /// Matrices of more velocities need scratch by their square: whoever asks for torques does not
  /// bring it, and whoever asks for the matrices gets as much written.
  static constexpr std::size_t kMostWithMatrices = 48;
  /// A batch with scratch of this size at least.
  struct Enough {
    Enough(const DynamicsBatch& given, std::size_t size) : batch(given) {
      if (given.scratch.size() >= size) return;
      own = std::make_unique_for_overwrite<double[]>(size);
      batch.scratch = {own.get(), size};
    }
    DynamicsBatch batch;
    std::unique_ptr<double[]> own;
  };

  Chain chain_;
  spatial::BodyTree tree_;  // of what is not in the kernels
  Runner runner_;
  std::size_t scratch_ = 0;
};

class InertiaMatrix final : public ForwardDynamics {
 public:
  explicit InertiaMatrix(const rmp_host* host) { spatial::use_threads_of(host); }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    if (!model.loops.empty())
      return error(ErrorCode::unsupported,
                   "it has closed loops, which this provider does not support",
                   "Choose a provider with the tag \"loops\", such as constrained.",
                   "robot \"" + model.name + "\"");
    RMP_TRY_ASSIGN(chain_, Chain::make(model));
    runner_ = make_runner(params);
    scratch_ = runner_.scratch_size(chain_, {What::inertia, What::accelerations});
    names_.clear();
    for (const JointModel& joint : model.joints) names_.push_back(joint.name);
    // Its time grows with the cube: of one sample of more, no cancelling would be heard in time.
    constexpr std::size_t kMostVelocities = 1000;
    if (model.dof() > kMostVelocities)
      return error(ErrorCode::unsupported,
                   "it has " + std::to_string(model.dof()) +
                       " velocities; the inertia matrix is factorised for up to " +
                       std::to_string(kMostVelocities),
                   "Choose articulated_body, which takes time linear in the number of joints.",
                   "robot \"" + model.name + "\"");
    return refuse_singular(model);
  }
  std::size_t scratch_size() const override { return scratch_; }
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override {
    RMP_TRY(spatial::check_batch(chain_.shape(), batch, scratch_, qdd.size(), chain_.dof()));
    std::size_t bad = 0;
    RMP_TRY_ASSIGN(bad, runner_.run(chain_, What::accelerations, batch, qdd, progress));
    if (bad == batch.count) return {};
    const std::size_t width = chain_.coordinates();
    std::int32_t entry = -1;
    RMP_TRY_ASSIGN(entry, singular_entry_at(batch.q.subspan(bad * width, width)));
    if (entry < 0) return not_finite("the forces", bad);
    return std::move(singular(entry)).in("sample " + std::to_string(bad + 1));
  }

 private:
  [[nodiscard]] Error singular(std::int32_t entry) const {
    const std::size_t joint = chain_.joint_of(static_cast<std::size_t>(entry));
    return error(ErrorCode::invalid_argument,
                 "the inertia that it moves is zero or negative, so its acceleration is undefined",
                 "Give its bodies a mass, or its drive a motor inertia.",
                 "robot \"" + chain_.robot() + "\", joint \"" + names_[joint] + "\"");
  }
  // -1 where the inertia is positive definite, or not finite.
  [[nodiscard]] Result<std::int32_t> singular_entry_at(std::span<const double> q) const {
    std::vector<double> m(chain_.dof() * chain_.dof()), scratch(scratch_);
    DynamicsBatch b;
    b.count = 1, b.q = q, b.scratch = scratch;
    NoProgress none;
    std::size_t bad = 0;
    RMP_TRY_ASSIGN(bad, runner_.run(chain_, What::inertia, b, m, none));
    return bad == 0 ? -1 : singular_entry(chain_, std::move(m));
  }
  // A mechanism that is singular wherever one looks is singular by its masses; a single
  // configuration could be an accident. The places are multiples of the golden angle, and for
  // quaternions numbers that are not all zero.
  [[nodiscard]] Result<void> refuse_singular(const RobotModel& model) const {
    std::vector<double> q(model.coordinate_count());
    std::int32_t entry = -1;
    for (int attempt = 1; attempt <= 4; ++attempt) {
      for (std::size_t j = 0; j < q.size(); ++j)
        q[j] = std::fmod(
            2.399963229728653 * static_cast<double>(static_cast<std::size_t>(attempt) * (j + 1)),
            3.0);
      RMP_TRY_ASSIGN(entry, singular_entry_at(q));
      if (entry < 0) return {};
    }
    return singular(entry);
  }

  Chain chain_;
  Runner runner_;
  std::size_t scratch_ = 0;
  std::vector<std::string> names_;
};

}  // namespace
}  // namespace robomosp::newton_euler

RMP_PLUGIN("org.robomosp.dynamics_newton_euler", "0.1.0", "Apache-2.0",
           "Inverse and forward dynamics by recursive Newton-Euler.",
           RMP_PROVIDER(robomosp::newton_euler::NewtonEuler, "newton_euler",
                        "Recursive Newton-Euler in joint frames, for chains and trees of any size.",
                        "serial,tree,floating,batch,derivatives,regressor,energy",
                        robomosp::newton_euler::kParams),
           RMP_PROVIDER(robomosp::newton_euler::InertiaMatrix, "inertia_matrix",
                        "Joint-space inertia matrix and its sparse factorization, O(n^3) at worst.",
                        "serial,tree,floating,batch", robomosp::newton_euler::kParams))

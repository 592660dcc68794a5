// SPDX-License-Identifier: Apache-2.0
// Provider "c99" of robot code, and the providers "compiled" of inverse and forward dynamics, which
// run that code (layer: plugin).
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/robot_code.h>

#include "compiled.h"
#include "emit.h"
#include "spatial/body_tree.h"

namespace robomosp::robot_code {
namespace {

const rmp_param kCodeParams[] = {
    {"stabilization", "real", "1/s",
     "Rate at which forward dynamics close gaps of closed loops, critically damped; 0 lets them "
     "drift.",
     "20", nullptr, 0, 1000},
};

bool is_identifier(std::string_view s) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  return !s.empty() && is_letter(s.front()) && std::all_of(s.begin(), s.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9');
  });
}

class C99 final : public RobotCodeGenerator {
 public:
  Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                         std::uint32_t parts, const Params& params,
                                         Progress& progress) const override {
    if (!is_identifier(name))
      return error(ErrorCode::invalid_argument,
                   "\"" + std::string(name) + "\" is not a valid C name",
                   "Use letters, digits and underscores, starting with a letter.");
    RMP_TRY(check_model(model));
    const bool is_closed = !model.loops.empty();
    const double stabilization = params.real("stabilization");
    if (is_closed && (parts & (kCodeInverseDynamics | kCodeInertia | kCodeForwardDynamics)))
      RMP_TRY(check_loops(model));
    struct Part {
      std::uint32_t bit;
      std::function<Result<Function>(const RobotModel&)> make;
    };
    using Model = const RobotModel&;
    const Part of_tree[] = {
        {kCodeForwardKinematics, [](Model m) -> Result<Function> { return forward_kinematics(m); }},
        {kCodeJacobian, [](Model m) -> Result<Function> { return jacobian(m); }},
        {kCodeInverseDynamics, [](Model m) -> Result<Function> { return inverse_dynamics(m); }},
        {kCodeInertia, [](Model m) -> Result<Function> { return inertia(m); }},
        {kCodeForwardDynamics, forward_dynamics}};
    const Part of_closed[] = {
        of_tree[0],
        of_tree[1],
        {kCodeInverseDynamics,
         [](Model m) -> Result<Function> { return closed_inverse_dynamics(m); }},
        {kCodeInertia, [](Model m) -> Result<Function> { return closed_inertia(m); }},
        {kCodeForwardDynamics,
         [stabilization](Model m) { return closed_forward_dynamics(m, stabilization); }}};
    std::vector<Function> functions;
    for (const Part& p : is_closed ? of_closed : of_tree) {
      if (!(parts & p.bit)) continue;
      if (progress.cancelled()) return error(ErrorCode::cancelled, "code generation was cancelled");
      RMP_TRY_ASSIGN(Function f, p.make(model));
      RMP_TRY(check_size(f, model));
      functions.push_back(std::move(f));
    }
    if (functions.empty())
      return error(ErrorCode::invalid_argument, "no part was selected", "Choose at least one.");
    return write_files(model, std::string(name), functions);
  }
};

Error cancelled() { return error(ErrorCode::cancelled, "the dynamics computation was cancelled"); }

/// What both providers share: the code, and the recursion that serves what the code leaves out.
class CompiledRobot {
 protected:
  explicit CompiledRobot(const rmp_host* host) : host_(host) {}
  Result<void> bind(const RobotModel& model, ForwardDynamicsPolicy forward) {
    RMP_TRY_ASSIGN(tree_, spatial::make_body_tree(model));
    RMP_TRY_ASSIGN(code_, compile(model, forward, host_));
    return {};
  }
  [[nodiscard]] std::size_t n() const { return tree_.velocities; }
  /// The code computes all terms for a base at rest and without a wrench at the tip.
  static bool is_plain(const DynamicsBatch& b, std::uint32_t needed) {
    return (b.terms & needed) == needed && b.base.empty() &&
           (b.tip.empty() || !(b.terms & kExternalTerm));
  }
  /// The first sample whose results are not finite is an error.
  static Result<void> check_finite(std::span<const double> out, std::size_t width,
                                   std::size_t first, const char* what) {
    for (std::size_t i = 0; i < out.size(); ++i)
      if (!std::isfinite(out[i]))
        return error(ErrorCode::invalid_argument,
                     std::string(what) + " of sample " + std::to_string(first + i / width + 1) +
                         " are not finite",
                     "Check its joint values, rates and forces.");
    return {};
  }
  /// Calls work(first, samples) for pieces short enough to hear a cancellation.
  template <class Work>
  static Result<void> in_pieces(std::size_t count, Progress& progress, Work&& work) {
    constexpr std::size_t kPiece = 4096;
    for (std::size_t i = 0; i < count; i += kPiece) {
      if (progress.cancelled()) return cancelled();
      RMP_TRY(work(i, std::min(kPiece, count - i)));
    }
    return {};
  }
  [[nodiscard]] static const double* at(std::span<const double> v, std::size_t i,
                                        std::size_t width) {
    return v.data() + i * width;
  }

  const rmp_host* host_;
  spatial::BodyTree tree_;
  Compiled code_;
};

class CompiledInverse final : public InverseDynamics, CompiledRobot {
 public:
  explicit CompiledInverse(const rmp_host* host) : CompiledRobot(host) {}
  Result<void> prepare(const RobotModel& model, const Params&) override {
    return bind(model, ForwardDynamicsPolicy::optional);
  }
  std::size_t scratch_size() const override { return spatial::tree_scratch(tree_) + n(); }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau,
                       Progress& progress) const override {
    RMP_TRY(spatial::check_batch(tree_, b, scratch_size(), tau.size(), n()));
    const bool is_plain_call =
        is_plain(b, kAllTerms & ~static_cast<std::uint32_t>(kExternalTerm)) && !b.qd.empty() &&
        !b.qdd.empty();
    return in_pieces(b.count, progress, [&](std::size_t first, std::size_t samples) {
      const std::span<double> out = tau.subspan(first * n(), samples * n());
      if (is_plain_call && samples == 1) {
        code_.inverse_dynamics(at(b.q, first, tree_.coordinates), at(b.qd, first, n()),
                               at(b.qdd, first, n()), out.data());
      } else if (is_plain_call) {
        code_.inverse_dynamics_batch(samples, at(b.q, first, tree_.coordinates),
                                     at(b.qd, first, n()), at(b.qdd, first, n()), out.data());
      } else {
        const auto scratch = spatial::take_scratch(tree_, b.scratch.data());
        for (std::size_t i = 0; i < samples; ++i)
          spatial::tree_torques(tree_, b, first + i, b.terms, false, scratch.bodies,
                                scratch.columns, out.subspan(i * n(), n()));
      }
      return check_finite(out, n(), first, "the torques");
    });
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m,
                       Progress& progress) const override {
    RMP_TRY(spatial::check_batch(tree_, b, 0, m.size(), n() * n()));
    return in_pieces(b.count, progress, [&](std::size_t first, std::size_t samples) {
      const std::span<double> out = m.subspan(first * n() * n(), samples * n() * n());
      if (samples == 1) code_.inertia(at(b.q, first, tree_.coordinates), out.data());
      else code_.inertia_batch(samples, at(b.q, first, tree_.coordinates), out.data());
      return check_finite(out, n() * n(), first, "the inertias");
    });
  }
};

class CompiledForward final : public ForwardDynamics, CompiledRobot {
 public:
  explicit CompiledForward(const rmp_host* host) : CompiledRobot(host) {}
  Result<void> prepare(const RobotModel& model, const Params&) override {
    if (!model.loops.empty())
      return error(ErrorCode::unsupported,
                   "it has closed loops, which this provider does not support",
                   "Choose the provider constrained.", "robot \"" + model.name + "\"");
    return bind(model, ForwardDynamicsPolicy::needed);
  }
  std::size_t scratch_size() const override {
    return spatial::tree_scratch(tree_) + n() * n() + n();
  }
  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& progress) const override {
    RMP_TRY(spatial::check_batch(tree_, b, scratch_size(), qdd.size(), n()));
    const bool is_plain_call =
        is_plain(b, kGravityTerm | kVelocityTerm | kFrictionTerm | kSpringTerm) && !b.qd.empty() &&
        !b.tau.empty();
    return in_pieces(
        b.count, progress, [&](std::size_t first, std::size_t samples) -> Result<void> {
          const std::span<double> out = qdd.subspan(first * n(), samples * n());
          if (is_plain_call && samples == 1) {
            code_.forward_dynamics(at(b.q, first, tree_.coordinates), at(b.qd, first, n()),
                                   at(b.tau, first, n()), out.data());
          } else if (is_plain_call) {
            code_.forward_dynamics_batch(samples, at(b.q, first, tree_.coordinates),
                                         at(b.qd, first, n()), at(b.tau, first, n()), out.data());
          } else {
            for (std::size_t i = 0; i < samples; ++i)
              general(b, first + i, out.subspan(i * n(), n()));
          }
          return check_finite(out, n(), first, "the accelerations");
        });
  }

 private:
  void general(const DynamicsBatch& b, std::size_t i, std::span<double> out) const {
    const auto scratch = spatial::take_scratch(tree_, b.scratch.data());
    spatial::tree_torques(tree_, b, i, b.terms, true, scratch.bodies, scratch.columns, out);
    for (std::size_t k = 0; k < n(); ++k)
      out[k] = (b.tau.empty() ? 0.0 : b.tau[i * n() + k]) - out[k];
    const std::span<double> m(scratch.rest, n() * n());
    code_.inertia(at(b.q, i, tree_.coordinates), m.data());
    if (spatial::cholesky(m, n()) < 0) spatial::cholesky_solve(m, n(), out.data());
    else std::fill(out.begin(), out.end(), std::nan(""));
  }
};

template <class T>
void* make(const rmp_host* host, char* error, std::uint32_t error_size) {
  try {
    return static_cast<typename T::Interface*>(new T(host));
  } catch (const std::exception& e) {
    if (error && error_size) std::snprintf(error, error_size, "%s", e.what());
  }
  return nullptr;
}

template <class T>
constexpr rmp_provider compiled(const char* summary) {
  return {T::Interface::kInterfaceId, "compiled", summary, "serial,tree,batch", nullptr, 0,
          sizeof(rmp_param),          &make<T>};
}

}  // namespace
}  // namespace robomosp::robot_code

using namespace robomosp::robot_code;

RMP_PLUGIN("org.robomosp.robot_code_c", "0.1.0", "Apache-2.0",
           "A robot's kinematics and dynamics as C99 source, and compiled as its solver.",
           RMP_PROVIDER(C99, "c99",
                        "C99 without dependencies: constants folded, common terms shared, single "
                        "and batch.",
                        "serial,tree,loops,batch", kCodeParams),
           compiled<CompiledInverse>("Inverse dynamics generated for one robot as C, compiled by "
                                     "the system's compiler at first use."),
           compiled<CompiledForward>("Forward dynamics generated for one robot as C, compiled by "
                                     "the system's compiler at first use."))

// SPDX-License-Identifier: Apache-2.0
// Guards of what is bound to a robot: inverse kinematics, dynamics, controllers, code.
#include <algorithm>
#include <memory>
#include <string>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/robot_code.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// What all guards of this file know of their provider.
class Named {
 public:
  explicit Named(const ProviderInfo& info) : name_(info.name), tags_(info.tags) {}

 protected:
  [[nodiscard]] bool has_tag(std::string_view tag) const {
    return std::find(tags_.begin(), tags_.end(), tag) != tags_.end();
  }
  /// A provider with the tag "simple" never sees a robot that is not.
  [[nodiscard]] Result<void> serves(const RobotModel& model) const {
    if (!has_tag("simple") || (model.is_simple() && model.loops.empty())) return {};
    return error(ErrorCode::unsupported,
                 "provider " + text::quote(name_) +
                     " serves robots whose joints have one coordinate each, without followers and "
                     "loops",
                 "Choose another provider for it.", "robot " + text::quote(model.name));
  }
  template <class Call>
  auto call(Call&& what) const -> decltype(what()) {
    return guarded(name_, std::forward<Call>(what));
  }

  std::string name_;
  std::vector<std::string> tags_;
};

class GuardedIk final : public IkSolver, private Named {
 public:
  GuardedIk(const ProviderInfo& info, IkSolver* inner) : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(serves(model));
    return call([&] { return inner_->prepare(model, params); });
  }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    RMP_TRY(needs(!is_whole(batch), "goals", "several goals or parts of a pose"));
    RMP_TRY(needs(batch.objective != IkObjective::none, "objectives", "objectives"));
    RMP_TRY(needs(!batch.arm_angles.empty(), "arm_angle", "arm angles"));
    if (batch.goals.empty() || has_tag("goals"))
      return call([&] { return inner_->solve(batch, results, progress); });
    // One whole pose of a tip is what every solver serves, in the words that it knows.
    IkBatch plain = batch;
    plain.tip = batch.goals[0].tip;
    plain.goals = {};
    return call([&] { return inner_->solve(plain, results, progress); });
  }

 private:
  static bool is_whole(const IkBatch& b) {
    return b.goals.empty() || (b.goals.size() == 1 && b.goals[0].parts == kIkPose);
  }
  [[nodiscard]] Result<void> needs(bool asked, const char* tag, const char* what) const {
    if (!asked || has_tag(tag)) return {};
    return error(
        ErrorCode::unsupported,
        "provider " + text::quote(name_) + " does not say that it serves " + what,
        std::string("If it does, write tags = {\"") + tag + "\"}; else choose another provider.");
  }
  std::unique_ptr<IkSolver> inner_;
};

class GuardedInverse final : public InverseDynamics, private Named {
 public:
  GuardedInverse(const ProviderInfo& info, InverseDynamics* inner) : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(serves(model));
    return call([&] { return inner_->prepare(model, params); });
  }
  [[nodiscard]] std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau, Progress& p) const override {
    return call([&] { return inner_->torques(b, tau, p); });
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m, Progress& p) const override {
    return call([&] { return inner_->inertia(b, m, p); });
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           Progress& p) const override {
    return call([&] { return inner_->derivatives(b, by_q, by_qd, p); });
  }
  Result<void> regressor(const DynamicsBatch& b, std::span<double> y, Progress& p) const override {
    return call([&] { return inner_->regressor(b, y, p); });
  }
  Result<void> energy(const DynamicsBatch& b, std::span<Energy> out, Progress& p) const override {
    return call([&] { return inner_->energy(b, out, p); });
  }

 private:
  std::unique_ptr<InverseDynamics> inner_;
};

class GuardedForward final : public ForwardDynamics, private Named {
 public:
  GuardedForward(const ProviderInfo& info, ForwardDynamics* inner) : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(serves(model));
    if (!model.loops.empty() && !has_tag("loops"))
      return error(ErrorCode::unsupported,
                   "provider " + text::quote(name_) +
                       " does not say that its accelerations keep loops closed",
                   "If they do, write tags = {\"loops\"}; else choose another provider, such as "
                   "constrained.",
                   "robot " + text::quote(model.name));
    return call([&] { return inner_->prepare(model, params); });
  }
  [[nodiscard]] std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& p) const override {
    return call([&] { return inner_->accelerations(b, qdd, p); });
  }
  Result<void> constrained(const DynamicsBatch& b, std::span<double> qdd, std::span<double> forces,
                           Progress& p) const override {
    return call([&] { return inner_->constrained(b, qdd, forces, p); });
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           std::span<double> by_tau, Progress& p) const override {
    return call([&] { return inner_->derivatives(b, by_q, by_qd, by_tau, p); });
  }

 private:
  std::unique_ptr<ForwardDynamics> inner_;
};

class GuardedController final : public Controller, private Named {
 public:
  GuardedController(const ProviderInfo& info, Controller* inner) : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override {
    RMP_TRY(serves(model));
    return call([&] { return inner_->prepare(model, dynamics, params); });
  }
  [[nodiscard]] std::size_t state_size() const override { return inner_->state_size(); }
  [[nodiscard]] std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> torques(const ControlInput& in, std::span<double> memory, std::span<double> scratch,
                       std::span<double> tau) const override {
    return call([&] { return inner_->torques(in, memory, scratch, tau); });
  }

 private:
  std::unique_ptr<Controller> inner_;
};

class GuardedRobotCode final : public RobotCodeGenerator, private Named {
 public:
  GuardedRobotCode(const ProviderInfo& info, RobotCodeGenerator* inner)
      : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<std::vector<CodeFile>> generate(const RobotModel& model, std::string_view name,
                                         std::uint32_t parts, const Params& params,
                                         Progress& progress) const override {
    RMP_TRY(serves(model));
    return call([&] { return inner_->generate(model, name, parts, params, progress); });
  }

 private:
  std::unique_ptr<RobotCodeGenerator> inner_;
};

}  // namespace

RMP_INTERFACES(solvers, guarded_interface<IkSolver, GuardedIk>("numeric"),
               guarded_interface<InverseDynamics, GuardedInverse>("newton_euler"),
               guarded_interface<ForwardDynamics, GuardedForward>("inertia_matrix"),
               guarded_interface<RobotCodeGenerator, GuardedRobotCode>("c99"),
               guarded_interface<Controller, GuardedController>("computed_torque"));

}  // namespace robomosp

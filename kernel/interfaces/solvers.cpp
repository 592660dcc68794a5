// SPDX-License-Identifier: Apache-2.0
// Guards of what is bound to a robot: inverse kinematics, dynamics, controllers, code.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
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

/// all_finite() of the long answers to batches, without a branch a number.
bool are_finite(std::span<const double> numbers) {
  constexpr std::size_t kTogether = 64;
  constexpr std::uint64_t kExponent = std::uint64_t{0x7ff} << 52;
  std::size_t i = 0;
  for (; i + kTogether <= numbers.size(); i += kTogether) {
    std::uint64_t beyond = 0;  // the sign of what is left of the greatest finite exponent
    for (std::size_t k = 0; k < kTogether; ++k)
      beyond |= kExponent - 1 - (std::bit_cast<std::uint64_t>(numbers[i + k]) & kExponent);
    if ((beyond >> 63) != 0) return false;
  }
  return all_finite(numbers.subspan(i));
}

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
                     " supports robots with one coordinate per joint, without followers and loops",
                 "Choose another provider for it.", "robot " + text::quote(model.name));
  }
  template <class Call>
  auto call(Call&& what) const -> decltype(what()) {
    return asked(name_, std::forward<Call>(what));
  }
  /// Fills `out` by `what`; what is left out, or is not a number, is said.
  template <class Call>
  [[nodiscard]] Result<void> numbers(std::span<double> out, Call&& what) const {
    std::fill(out.begin(), out.end(), std::numeric_limits<double>::quiet_NaN());
    RMP_TRY(call(std::forward<Call>(what)));
    return finite(out);
  }
  [[nodiscard]] Result<void> finite(std::span<const double> out) const {
    if (are_finite(out)) return {};
    return broken_answer(name_, "returned a value that is not a number");
  }
  [[nodiscard]] Error broken(const std::string& what) const { return broken_answer(name_, what); }

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
    joints_ = model.joints.size();
    return call([&] { return inner_->prepare(model, params); });
  }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY(ask(batch, results, progress));
    for (IkResult& r : results)
      if (const char* fault = fault_of(r)) return broken(fault);
    return {};
  }

 private:
  Result<void> ask(const IkBatch& batch, std::span<IkResult> results, Progress& progress) const {
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
  /// What a result says besides its joint values, which are held against the robot where they are
  /// used; its words are made fit to be shown.
  const char* fault_of(IkResult& r) const {
    if (r.status < IkStatus::solved || r.status > IkStatus::not_converged)
      return "returned a state that is not defined by its interface";
    const double said[] = {r.position_error, r.rotation_error, r.shortfall};
    if (!all_finite(said) || !all_finite(r.lost_direction))
      return "returned an error or a direction that is not a number";
    if (r.iterations < 0) return "counted a negative number of iterations";
    if (r.limiting_joint < -1 || r.limiting_joint >= static_cast<std::int64_t>(joints_))
      return "named a joint that the robot does not have";
    if (!r.detail.empty()) r.detail = heard(r.detail);
    return nullptr;
  }
  static bool is_whole(const IkBatch& b) {
    return b.goals.empty() || (b.goals.size() == 1 && b.goals[0].parts == kIkPose);
  }
  [[nodiscard]] Result<void> needs(bool asked, const char* tag, const char* what) const {
    if (!asked || has_tag(tag)) return {};
    return error(
        ErrorCode::unsupported,
        "provider " + text::quote(name_) + " does not declare support for " + what,
        std::string("If it does, write tags = {\"") + tag + "\"}; else choose another provider.");
  }
  std::unique_ptr<IkSolver> inner_;
  std::size_t joints_ = 0;
};

class GuardedInverse final : public InverseDynamics, private Named {
 public:
  GuardedInverse(const ProviderInfo& info, InverseDynamics* inner) : Named(info), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    RMP_TRY(serves(model));
    RMP_TRY(call([&] { return inner_->prepare(model, params); }));
    RMP_TRY_ASSIGN(scratch_, asked_size(name_, "scratch", [&] { return inner_->scratch_size(); }));
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return scratch_; }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau, Progress& p) const override {
    HeardProgress progress(p);
    return numbers(tau, [&] { return inner_->torques(b, tau, progress); });
  }
  Result<void> inertia(const DynamicsBatch& b, std::span<double> m, Progress& p) const override {
    HeardProgress progress(p);
    return numbers(m, [&] { return inner_->inertia(b, m, progress); });
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           Progress& p) const override {
    HeardProgress progress(p);
    RMP_TRY(numbers(by_q, [&] { return inner_->derivatives(b, by_q, by_qd, progress); }));
    return finite(by_qd);
  }
  Result<void> regressor(const DynamicsBatch& b, std::span<double> y, Progress& p) const override {
    HeardProgress progress(p);
    return numbers(y, [&] { return inner_->regressor(b, y, progress); });
  }
  Result<void> energy(const DynamicsBatch& b, std::span<Energy> out, Progress& p) const override {
    HeardProgress progress(p);
    RMP_TRY(call([&] { return inner_->energy(b, out, progress); }));
    for (const Energy& e : out) {
      const double said[] = {e.kinetic, e.potential};
      RMP_TRY(finite(said));
      for (const Vec3* v : {&e.momentum, &e.angular_momentum, &e.com}) RMP_TRY(finite(*v));
    }
    return {};
  }

 private:
  std::unique_ptr<InverseDynamics> inner_;
  std::size_t scratch_ = 0;
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
                       " does not declare that its accelerations keep loops closed",
                   "If they do, write tags = {\"loops\"}; else choose another provider, such as "
                   "constrained.",
                   "robot " + text::quote(model.name));
    RMP_TRY(call([&] { return inner_->prepare(model, params); }));
    RMP_TRY_ASSIGN(scratch_, asked_size(name_, "scratch", [&] { return inner_->scratch_size(); }));
    return {};
  }
  [[nodiscard]] std::size_t scratch_size() const override { return scratch_; }
  Result<void> accelerations(const DynamicsBatch& b, std::span<double> qdd,
                             Progress& p) const override {
    HeardProgress progress(p);
    return accelerated(b, qdd, [&] { return inner_->accelerations(b, qdd, progress); });
  }
  Result<void> constrained(const DynamicsBatch& b, std::span<double> qdd, std::span<double> forces,
                           Progress& p) const override {
    HeardProgress progress(p);
    RMP_TRY(accelerated(b, qdd, [&] { return inner_->constrained(b, qdd, forces, progress); }));
    return is_tame(b) ? finite(forces) : Result<void>();
  }
  Result<void> derivatives(const DynamicsBatch& b, std::span<double> by_q, std::span<double> by_qd,
                           std::span<double> by_tau, Progress& p) const override {
    HeardProgress progress(p);
    RMP_TRY(numbers(by_q, [&] { return inner_->derivatives(b, by_q, by_qd, by_tau, progress); }));
    RMP_TRY(finite(by_qd));
    return finite(by_tau);
  }

 private:
  /// Whether a state is one that accelerations exist for. Integrators try states beyond all sense
  /// and take a shorter step when what comes of them is not a number.
  static bool is_tame(const DynamicsBatch& b) {
    constexpr double kTame = 1e6;
    for (const std::span<const double> all : {b.q, b.qd, b.tau})
      for (const double x : all)
        if (!(std::fabs(x) <= kTame)) return false;
    return true;
  }
  template <class Call>
  [[nodiscard]] Result<void> accelerated(const DynamicsBatch& b, std::span<double> qdd,
                                         Call&& what) const {
    std::fill(qdd.begin(), qdd.end(), std::numeric_limits<double>::quiet_NaN());
    RMP_TRY(call(std::forward<Call>(what)));
    return are_finite(qdd) || !is_tame(b) ? Result<void>() : finite(qdd);
  }
  std::unique_ptr<ForwardDynamics> inner_;
  std::size_t scratch_ = 0;
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
    RMP_TRY(call([&] { return inner_->prepare(model, dynamics, params); }));
    RMP_TRY_ASSIGN(state_, asked_size(name_, "state", [&] { return inner_->state_size(); }));
    RMP_TRY_ASSIGN(scratch_, asked_size(name_, "scratch", [&] { return inner_->scratch_size(); }));
    return {};
  }
  [[nodiscard]] std::size_t state_size() const override { return state_; }
  [[nodiscard]] std::size_t scratch_size() const override { return scratch_; }
  Result<void> torques(const ControlInput& in, std::span<double> memory, std::span<double> scratch,
                       std::span<double> tau) const override {
    return call([&] { return inner_->torques(in, memory, scratch, tau); });
  }

 private:
  std::unique_ptr<Controller> inner_;
  std::size_t state_ = 0, scratch_ = 0;
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
                                         Progress& told) const override {
    RMP_TRY(serves(model));
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(auto files,
                   call([&] { return inner_->generate(model, name, parts, params, progress); }));
    if (files.empty()) return broken("made no files");
    std::set<std::string> names;
    for (const CodeFile& f : files) {
      if (!is_file_name(f.name, false)) return broken("named a file " + heard(text::quote(f.name)));
      if (!names.insert(f.name).second) return broken("made two files " + text::quote(f.name));
    }
    return files;
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

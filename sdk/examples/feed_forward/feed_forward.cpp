// SPDX-License-Identifier: Apache-2.0
// A controller of one's own: the torques of the reference motion by inverse dynamics, and PD
// feedback of the errors, tau = ID(q_w, qd_w, qdd_w) + Kp e + Kd ed. Unlike computed torque the
// model is evaluated on the reference only, so that noise of measurements does not pass through it
// (An, Atkeson, Hollerbach, Model-Based Control of a Robot Manipulator, 1988, chapter 6).
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

const rmp_param kParams[] = {
    {"kp", "real", "", "Gain of the position error [N m/rad or N/m].", "400", nullptr, 0, 1e9},
    {"kd", "real", "", "Gain of the velocity error [N m s/rad or N s/m].", "40", nullptr, 0, 1e9},
};

class FeedForward final : public Controller {
 public:
  // The program binds a controller to a robot once, and then calls torques() at every tick. What it
  // cannot do is an error here, in one sentence with a hint.
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override {
    if (!model.is_simple())
      return error(ErrorCode::unsupported, "it has joints of several coordinates or followers",
                   "Choose computed_torque.", "robot \"" + model.name + "\"");
    n_ = model.dof();
    dynamics_ = &dynamics;
    kp_ = params.real("kp");
    kd_ = params.real("kd");
    return {};
  }
  // What has to be remembered from tick to tick (integrals) is asked for here and handed to
  // torques(), so that one controller can serve many runs. This one remembers nothing.
  std::size_t state_size() const override { return 0; }
  std::size_t scratch_size() const override { return dynamics_->scratch_size(); }

  Result<void> torques(const ControlInput& in, std::span<double>, std::span<double> scratch,
                       std::span<double> tau) const override {
    if (in.q.size() != n_ || in.q_desired.size() != n_ || tau.size() != n_ ||
        scratch.size() < scratch_size())
      return error(ErrorCode::invalid_argument, "a vector is too short",
                   "Give one number for each joint.");
    DynamicsBatch batch;
    batch.count = 1;
    batch.q = in.q_desired, batch.qd = in.qd_desired, batch.qdd = in.qdd_desired;
    batch.scratch = scratch;
    NoProgress none;
    RMP_TRY(dynamics_->torques(batch, tau, none));
    for (std::size_t j = 0; j < n_; ++j)
      tau[j] += kp_ * (in.q_desired[j] - in.q[j]) + kd_ * (in.qd_desired[j] - in.qd[j]);
    return {};
  }

 private:
  std::size_t n_ = 0;
  const InverseDynamics* dynamics_ = nullptr;
  double kp_ = 0, kd_ = 0;
};

}  // namespace

RMP_PLUGIN("org.example.feed_forward", "0.1.0", "Apache-2.0", "A controller as an example.",
           RMP_PROVIDER(FeedForward, "feed_forward",
                        "Torques of the reference by inverse dynamics, and PD feedback.",
                        "joint_space,model_based", kParams))

// SPDX-License-Identifier: Apache-2.0
// Providers "computed_torque", "pd_gravity", "joint_pid" and "operational_space": the SDK's suite
// and what each promises by its equation.
#include <robomosp/sdk/conformance/controller_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/control.so";
const std::string kDynamics = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

ControllerCase of(const std::string& provider, RobotModel model) {
  ControllerCase c{kFile, provider, kDynamics, "newton_euler", without_friction(std::move(model)),
                   {},    true,     1e-4};
  if (provider == "joint_pid") c.compensates_weight = false, c.settles_to = 2e-3;
  // In joints the tip's error is what vanishes; the posture follows more slowly.
  if (provider == "operational_space") c.settles_to = 1e-3;
  return c;
}
std::vector<ControllerCase> cases() {
  std::vector<ControllerCase> all;
  for (const char* name : {"computed_torque", "pd_gravity", "joint_pid"})
    for (const RobotModel& m : {puma560(), scara(), tree()}) all.push_back(of(name, m));
  for (const RobotModel& m : {puma560(), pa10()}) all.push_back(of("operational_space", m));
  return all;
}
INSTANTIATE_TEST_SUITE_P(Plugin, ControllerConformance, testing::ValuesIn(cases()),
                         controller_case_name);

struct Bench {
  explicit Bench(const std::string& name, RobotModel m,
                 std::vector<std::pair<std::string, std::string>> params = {})
      : model(std::move(m)) {
    const rmp_provider* d = *find_provider<InverseDynamics>(kDynamics, "newton_euler");
    dynamics = conformance::create<InverseDynamics>(*d);
    EXPECT_TRUE(dynamics->prepare(model, TableParams(*d)).ok());
    const rmp_provider* c = *find_provider<Controller>(kFile, name);
    controller = conformance::create<Controller>(*c);
    TableParams table(*c);
    for (const auto& [key, text] : params) table.set(key, text);
    EXPECT_TRUE(controller->prepare(model, *dynamics, table).ok());
    state.resize(controller->state_size());
    scratch.resize(controller->scratch_size());
  }
  std::vector<double> torques(const ControlInput& in) {
    std::vector<double> tau(model.dof());
    const auto r = controller->torques(in, state, scratch, tau);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return tau;
  }
  RobotModel model;
  std::unique_ptr<InverseDynamics> dynamics;
  std::unique_ptr<Controller> controller;
  std::vector<double> state, scratch;
};

TEST(ComputedTorque, MakesTheErrorObeyItsLinearEquation) {
  Bench bench("computed_torque", without_friction(puma560()),
              {{"frequency", "20"}, {"damping", "0.7"}});
  Random random{5};
  const auto q = random.configuration(bench.model), qw = random.configuration(bench.model),
             qd = random.vector(6, -2, 2), qdw = random.vector(6, -2, 2),
             qddw = random.vector(6, -5, 5);
  ControlInput in;
  in.q = q, in.qd = qd, in.q_desired = qw, in.qd_desired = qdw, in.qdd_desired = qddw;
  Loop loop(bench.model, *bench.dynamics);
  const auto qdd = loop.accelerations(q, qd, bench.torques(in));
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(qddw[j] - qdd[j] + 2 * 0.7 * 20 * (qdw[j] - qd[j]) + 400 * (qw[j] - q[j]), 0, 1e-8);
}

TEST(ComputedTorque, OvercomesFrictionInTheWantedDirection) {
  RobotModel m = without_friction(puma560());
  Bench smooth("computed_torque", m);
  m.joints[1].friction = {2.0, 5.0, -3.0};
  Bench rough("computed_torque", m);
  std::vector<double> q(6), qd(6), qdw(6), none(6);
  qd[1] = 0.5, qdw[1] = -0.1;
  ControlInput in;
  in.q = q, in.qd = qd, in.q_desired = q, in.qd_desired = qdw, in.qdd_desired = none;
  EXPECT_NEAR(rough.torques(in)[1] - smooth.torques(in)[1], 2.0 * 0.5 - 3.0, 1e-12);
}

// J by differences of the tip's pose from the suite's own kinematics.
std::vector<double> numeric_tip_velocity(const RobotModel& m, const std::vector<double>& q,
                                         const std::vector<double>& qd) {
  const double h = 1e-5;
  std::vector<double> up = q, down = q;
  for (std::size_t j = 0; j < q.size(); ++j) up[j] += h * qd[j], down[j] -= h * qd[j];
  const Pose a = tip_pose(m, down.data()), b = tip_pose(m, up.data());
  double D[9] = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) D[3 * r + c] += b.R[3 * r + k] * a.R[3 * c + k];
  return {(b.p[0] - a.p[0]) / (2 * h), (b.p[1] - a.p[1]) / (2 * h), (b.p[2] - a.p[2]) / (2 * h),
          (D[7] - D[5]) / (4 * h),     (D[2] - D[6]) / (4 * h),     (D[3] - D[1]) / (4 * h)};
}

TEST(OperationalSpace, TheTipAcceleratesAsCommandedWhateverThePosture) {
  for (RobotModel m : {without_friction(puma560()), without_friction(pa10())}) {
    Bench bench("operational_space", m, {{"frequency", "0"}});
    const std::size_t n = m.dof();
    std::vector<double> q(n), qd(n), none(n);
    Random random{7};
    for (std::size_t j = 0; j < n; ++j) q[j] = 0.3 + 0.15 * static_cast<double>(j);
    qd = random.vector(n, -1, 1);
    ControlInput in;
    const Pose here = tip_pose(m, q.data());
    in.q = q, in.qd = qd, in.q_desired = none, in.qd_desired = none, in.qdd_desired = none;
    in.tip_desired = &here;
    in.tip_acceleration_desired = {1, -2, 0.5, 0.3, -0.4, 0.7};
    Loop loop(m, *bench.dynamics);
    const auto qdd = loop.accelerations(q, qd, bench.torques(in));
    // Rate of the tip's velocity along the motion, by differences.
    const double h = 2e-5;
    std::vector<double> q1 = q, q0 = q, qd1 = qd, qd0 = qd;
    for (std::size_t j = 0; j < n; ++j) {
      q1[j] += h * qd[j] + h * h / 2 * qdd[j], q0[j] += -h * qd[j] + h * h / 2 * qdd[j];
      qd1[j] += h * qdd[j], qd0[j] -= h * qdd[j];
    }
    const auto v1 = numeric_tip_velocity(m, q1, qd1), v0 = numeric_tip_velocity(m, q0, qd0);
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR((v1[k] - v0[k]) / (2 * h), in.tip_acceleration_desired[k], 2e-5) << m.name << k;
  }
}

TEST(JointPid, TheIntegralStandsStillAtTheLimitOfTheTorque) {
  RobotModel m = without_friction(puma560());
  for (JointModel& j : m.joints) j.max_force = 1;
  Bench limited("joint_pid", m);
  for (JointModel& j : m.joints) j.max_force = std::numeric_limits<double>::infinity();
  Bench free("joint_pid", m);
  const std::vector<double> q(6), qw(6, 1.0), none(6);
  ControlInput in;
  in.dt = 0.01, in.q = q, in.qd = none, in.q_desired = qw, in.qd_desired = none,
  in.qdd_desired = none;
  for (int i = 0; i < 1000; ++i) limited.torques(in), free.torques(in);
  EXPECT_EQ(limited.state[1], 0) << "the torque is at its limit from the first tick";
  EXPECT_GT(free.state[1], 10);
  // An error of the other sign unwinds.
  const std::vector<double> back(6, -1.0);
  free.state.assign(6, 5.0), limited.state = free.state;
  in.q_desired = back;
  limited.state.assign(6, 1e6);
  limited.torques(in);
  EXPECT_LT(limited.state[1], 1e6);
}

}  // namespace
}  // namespace robomosp::conformance

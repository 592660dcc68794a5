// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfdsolver_recursive_newton_euler.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include "bench/peers.h"
#include "spatial/pose.h"

namespace robomosp::bench {
namespace {

KDL::Vector vector(const Vec3& v) { return {v[0], v[1], v[2]}; }
KDL::Rotation rotation(const std::array<double, 9>& R) {
  return {R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]};
}
KDL::Frame frame(const Pose& t) { return {rotation(t.R), vector(t.p)}; }

// A segment turns about its own z and ends where the next joint begins; KDL wants its inertia
// there.
KDL::Chain chain_of(const RobotModel& model) {
  KDL::Chain chain;
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(model.joints[0].placement)));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const KDL::Frame end =
        frame(i + 1 < model.joints.size() ? model.joints[i + 1].placement : model.tips[0].tool);
    const MassProperties& b = model.joints[i].body;
    const Sym3& I = b.inertia;
    const KDL::RigidBodyInertia body(b.mass, vector(b.com),
                                     KDL::RotationalInertia(I.xx, I.yy, I.zz, I.xy, I.xz, I.yz));
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), end, end.Inverse() * body));
  }
  return chain;
}

struct Robot {
  explicit Robot(const RobotModel& model)
      : chain(chain_of(model)),
        gravity(vector(model.gravity)),
        fk(chain),
        jacobian(chain),
        inverse(chain, gravity),
        forward(chain, gravity),
        parameters(chain, gravity),
        n(static_cast<unsigned>(model.dof())),
        q(n),
        qd(n),
        u(n),
        result(n),
        J(n),
        M(n),
        none(chain.getNrOfSegments(), KDL::Wrench::Zero()),
        out(std::max<std::size_t>(12, 6 * n)) {}
  void set(const State& s) {
    std::copy(s.q.begin(), s.q.end(), q.data.data());
    std::copy(s.qd.begin(), s.qd.end(), qd.data.data());
    std::copy(s.u.begin(), s.u.end(), u.data.data());
  }
  KDL::Chain chain;
  KDL::Vector gravity;
  KDL::ChainFkSolverPos_recursive fk;
  KDL::ChainJntToJacSolver jacobian;
  KDL::ChainIdSolver_RNE inverse;
  KDL::ChainFdSolver_RNE forward;
  KDL::ChainDynParam parameters;
  unsigned n;
  KDL::JntArray q, qd, u, result;
  KDL::Jacobian J;
  KDL::JntSpaceInertiaMatrix M;
  KDL::Wrenches none;
  KDL::Frame tip;
  std::vector<double> out;
};

}  // namespace

Peer kdl(const RobotModel& model) {
  const auto r = std::make_shared<Robot>(model);
  const auto numbers = [](const auto& m) {
    return std::span<const double>(m.data.data(), static_cast<std::size_t>(m.data.size()));
  };
  Peer peer;
  peer["forward kinematics"] = [r](const State& s) {
    r->set(s);
    r->fk.JntToCart(r->q, r->tip);
    std::copy_n(r->tip.M.data, 9, r->out.data());
    std::copy_n(r->tip.p.data, 3, r->out.data() + 9);
    return std::span<const double>(r->out).first(12);
  };
  peer["Jacobian"] = [r](const State& s) {
    r->set(s);
    r->jacobian.JntToJac(r->q, r->J);
    Eigen::Map<Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>>(
        r->out.data(), 6, static_cast<Eigen::Index>(r->n)) = r->J.data;
    return std::span<const double>(r->out).first(6 * r->n);
  };
  peer["inverse dynamics"] = [r, numbers](const State& s) {
    r->set(s);
    r->inverse.CartToJnt(r->q, r->qd, r->u, r->none, r->result);
    return numbers(r->result);
  };
  peer["inertia"] = [r, numbers](const State& s) {
    r->set(s);
    r->parameters.JntToMass(r->q, r->M);
    return numbers(r->M);
  };
  peer["forward dynamics"] = [r, numbers](const State& s) {
    r->set(s);
    r->forward.CartToJnt(r->q, r->qd, r->u, r->none, r->result);
    return numbers(r->result);
  };
  return peer;
}

}  // namespace robomosp::bench

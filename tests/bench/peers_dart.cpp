// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>

#include "bench/peers.h"

namespace robomosp::bench {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::RevoluteJoint;
using dart::dynamics::SkeletonPtr;

Eigen::Isometry3d isometry(const Pose& t) {
  Eigen::Isometry3d m = Eigen::Isometry3d::Identity();
  m.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(t.R.data());
  m.translation() = Eigen::Map<const Eigen::Vector3d>(t.p.data());
  return m;
}

// DART refuses massless bodies; the least that it takes changes torques by some 1e-8.
constexpr double kLeastMass = 1e-9, kLeastInertia = 1e-12;

SkeletonPtr skeleton_of(const RobotModel& model) {
  SkeletonPtr skeleton = dart::dynamics::Skeleton::create(model.name);
  skeleton->setGravity(Eigen::Map<const Eigen::Vector3d>(model.gravity.data()));
  BodyNode* parent = nullptr;
  for (const JointModel& j : model.joints) {
    RevoluteJoint::Properties joint;
    joint.mName = j.name;
    joint.mAxis = Eigen::Vector3d::UnitZ();
    joint.mT_ParentBodyToJoint = isometry(j.placement);
    BodyNode::Properties body{BodyNode::AspectProperties(j.name)};
    const Sym3& I = j.body.inertia;
    body.mInertia = dart::dynamics::Inertia(
        std::max(j.body.mass, kLeastMass), Eigen::Map<const Eigen::Vector3d>(j.body.com.data()),
        (Eigen::Matrix3d() << I.xx + kLeastInertia, I.xy, I.xz, I.xy, I.yy + kLeastInertia, I.yz,
         I.xz, I.yz, I.zz + kLeastInertia)
            .finished());
    parent = skeleton->createJointAndBodyNodePair<RevoluteJoint>(parent, joint, body).second;
  }
  return skeleton;
}

}  // namespace

Peer dart(const RobotModel& model) {
  const SkeletonPtr robot = skeleton_of(model);
  BodyNode* last = robot->getBodyNode(robot->getNumBodyNodes() - 1);
  const Eigen::Isometry3d tool = isometry(model.tips[0].tool);
  const auto out = std::make_shared<std::vector<double>>(
      std::max<std::size_t>(12, std::max<std::size_t>(6, model.dof()) * model.dof()));
  const auto vector = [](std::span<const double> v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const auto give = [out](const auto& m) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        out->data(), m.rows(), m.cols()) = m;
    return std::span<const double>(*out).first(static_cast<std::size_t>(m.size()));
  };
  Peer peer;
  peer["forward kinematics"] = [=](const State& s) {
    robot->setPositions(vector(s.q));
    const Eigen::Isometry3d tip = last->getWorldTransform() * tool;
    give(tip.linear());
    Eigen::Map<Eigen::Vector3d>(out->data() + 9) = tip.translation();
    return std::span<const double>(*out).first(12);
  };
  peer["Jacobian"] = [=](const State& s) {
    robot->setPositions(vector(s.q));
    const dart::math::Jacobian J = last->getWorldJacobian(tool.translation());
    dart::math::Jacobian linear_first(6, J.cols());
    linear_first << J.bottomRows<3>(), J.topRows<3>();
    return give(linear_first);
  };
  peer["inverse dynamics"] = [=](const State& s) {
    robot->setPositions(vector(s.q));
    robot->setVelocities(vector(s.qd));
    robot->setAccelerations(vector(s.u));
    robot->computeInverseDynamics();
    return give(robot->getForces());
  };
  peer["inertia"] = [=](const State& s) {
    robot->setPositions(vector(s.q));
    return give(robot->getMassMatrix());
  };
  peer["forward dynamics"] = [=](const State& s) {
    robot->setPositions(vector(s.q));
    robot->setVelocities(vector(s.qd));
    robot->setForces(vector(s.u));
    robot->computeForwardDynamics();
    return give(robot->getAccelerations());
  };
  return peer;
}

}  // namespace robomosp::bench

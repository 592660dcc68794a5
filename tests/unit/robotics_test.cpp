// SPDX-License-Identifier: Apache-2.0
// Records to models, kinematics and skins. Expected models are the hand-filled ones of the SDK's
// conformance suites, which share no code with the module.
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>

#include "model/placement.h"
#include "robotics/build_model.h"
#include "robotics/kinematics.h"
#include "robotics/link_geometry.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::robotics {
namespace {

using conformance::kDeg;
using conformance::kPi;
using model::Convention;
using model::JointKind;

constexpr Vec3 kDown{0, 0, -9.81};
constexpr double kRight = kPi / 2;

model::Link link(double theta, double d, double a, double alpha,
                 std::optional<MassProperties> mass = {}) {
  model::Link l;
  l.row = {a, alpha, d, theta};
  l.given = mass;
  return l;
}
MassProperties body(double m, Vec3 com, Sym3 inertia) { return {m, com, inertia}; }

model::Robot chain(Convention convention, std::vector<model::Link> links) {
  model::Robot r;
  r.convention = convention;
  r.links = std::move(links);
  for (std::size_t i = 0; i < r.links.size(); ++i) {
    r.links[i].parent = static_cast<std::int32_t>(i) - 1;
    r.links[i].name = "link " + std::to_string(i + 1);
  }
  return r;
}

model::Robot puma() {
  model::Robot r = chain(
      Convention::dh,
      {link(0, 0, 0, kRight, body(0, {}, {0, 0.35, 0, 0, 0, 0})),
       link(0, 0, 0.4318, 0, body(17.4, {-0.3638, 0.006, 0.2275}, {0.13, 0.524, 0.539, 0, 0, 0})),
       link(0, 0.15005, 0.0203, -kRight,
            body(4.8, {-0.0203, -0.0141, 0.07}, {0.066, 0.086, 0.0125, 0, 0, 0})),
       link(0, 0.4318, 0, kRight, body(0.82, {0, 0.019, 0}, {1.8e-3, 1.3e-3, 1.8e-3, 0, 0, 0})),
       link(0, 0, 0, -kRight, body(0.34, {}, {0.3e-3, 0.4e-3, 0.3e-3, 0, 0, 0})),
       link(0, 0, 0, 0, body(0.09, {0, 0, 0.032}, {0.15e-3, 0.15e-3, 0.04e-3, 0, 0, 0}))});
  r.links[0].drive = {200e-6, -62.6111, 1.48e-3, 0.395, -0.435};
  return r;
}
model::Robot pa10() {
  model::Robot r = chain(Convention::mdh,
                         {link(0, 0.317, 0, 0), link(0, 0, 0, -kRight), link(0, 0.45, 0, kRight),
                          link(0, 0, 0, -kRight), link(0, 0.48, 0, kRight), link(0, 0, 0, -kRight),
                          link(0, 0.07, 0, kRight)});
  return r;
}
model::Robot pa10_nus() {
  return chain(Convention::dh,
               {link(0, 0.315, 0, -kRight), link(0, 0, 0, kRight), link(0, 0.45, 0, -kRight),
                link(0, 0, 0, kRight), link(0, 0.5, 0, -kRight), link(0, 0, 0, kRight),
                link(0, 0.08, 0, 0)});
}
model::Robot scara_record() {
  model::Robot r = chain(Convention::dh, {link(0, 0.387, 0.325, 0), link(0, 0, 0.275, kPi),
                                          link(0, 0, 0, 0), link(0, 0, 0, 0)});
  r.links[2].joint = JointKind::prismatic;
  r.links[2].lower = 0, r.links[2].upper = 0.21;
  return r;
}

RobotModel built(const model::Robot& r, Vec3 gravity = kDown) {
  auto m = build_robot_model("arm", r, {}, gravity);
  EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
  return std::move(m).value();
}
Pose tool_at(const RobotModel& m, const std::vector<double>& q) {
  std::vector<Pose> frames(m.joints.size());
  forward_kinematics(m, q, frames);
  return tip_pose(m, 0, frames);
}
std::string refusal(const model::Robot& r) {
  const auto m = build_robot_model("arm", r, {}, kDown);
  return m.ok() ? "accepted" : m.error().sentence();
}

TEST(BuildModel, PumaEqualsTheHandFilledModel) {
  const RobotModel m = built(puma()), expected = conformance::puma560();
  ASSERT_EQ(m.dof(), 6U);
  for (std::size_t j = 0; j < 6; ++j) {
    SCOPED_TRACE("joint " + std::to_string(j + 1));
    EXPECT_EQ(m.joints[j].parent, expected.joints[j].parent);
    EXPECT_LT(conformance::position_gap(m.joints[j].placement, expected.joints[j].placement),
              1e-15);
    EXPECT_LT(conformance::rotation_gap(m.joints[j].placement, expected.joints[j].placement),
              1e-15);
    EXPECT_LT(spatial::distance(m.joints[j].body.com, expected.joints[j].body.com), 1e-15);
    EXPECT_NEAR(m.joints[j].body.mass, expected.joints[j].body.mass, 0);
    EXPECT_NEAR(m.joints[j].body.inertia.yy, expected.joints[j].body.inertia.yy, 1e-15);
    EXPECT_NEAR(m.joints[j].body.inertia.zz, expected.joints[j].body.inertia.zz, 1e-15);
    for (const double x : m.joints[j].placement.R)
      EXPECT_TRUE(x == 0 || std::fabs(x) == 1) << "right angles stay clean";
  }
}

TEST(BuildModel, MotorsAreSeenAtTheJoint) {
  const JointModel j = built(puma()).joints[0];
  EXPECT_DOUBLE_EQ(j.armature, 62.6111 * 62.6111 * 200e-6);
  EXPECT_DOUBLE_EQ(j.friction.viscous, 62.6111 * 62.6111 * 1.48e-3);
  EXPECT_DOUBLE_EQ(j.friction.coulomb_positive, 62.6111 * 0.395)
      << "a negative gear ratio keeps the signs";
  EXPECT_DOUBLE_EQ(j.friction.coulomb_negative, 62.6111 * -0.435);
}

// In-plane answers of the paper's PA-10 pose, printed with four decimals of a degree.
TEST(ForwardKinematics, PaperPoseOfThePa10ForBothSetsOfLengths) {
  const Pose target = conformance::multiply(
      conformance::shift(0.557, 0, 0.374),
      conformance::multiply(conformance::turn_z(kPi), conformance::turn_x(kPi)));
  const std::pair<model::Robot, std::vector<double>> sets[] = {
      {pa10(), {0, 22.6421, 0, 104.2751, 0, 53.0827, 0}},
      {pa10_nus(), {0, 19.0765, 0, 105.8535, 0, 55.0700, 0}}};
  for (const auto& [robot, degrees] : sets) {
    std::vector<double> q;
    for (const double d : degrees) q.push_back(d * kDeg);
    const Pose t = tool_at(built(robot), q);
    // Half a unit of the fourth decimal is 8.7e-7 rad, at about 1 m arm length.
    EXPECT_LT(conformance::position_gap(t, target), 2e-6);
    EXPECT_LT(conformance::rotation_gap(t, target), 3e-6);
  }
}

TEST(ForwardKinematics, BatchesEqualSingleCallsAndTheIndependentForm) {
  const RobotModel m = conformance::tree();
  conformance::Random random(5);
  std::vector<double> q;
  for (int i = 0; i < 20; ++i)
    for (const double x : random.configuration(m)) q.push_back(x);
  std::vector<Pose> frames(q.size());
  forward_kinematics(m, q, frames);
  for (std::size_t i = 0; i < 20; ++i) {
    const auto expected = conformance::joint_frames(m, q.data() + i * m.dof());
    for (std::size_t j = 0; j < m.dof(); ++j) {
      EXPECT_LT(conformance::position_gap(frames[i * m.dof() + j], expected[j]), 1e-14);
      EXPECT_LT(conformance::rotation_gap(frames[i * m.dof() + j], expected[j]), 1e-14);
    }
  }
}

TEST(Jacobian, IsTheDerivativeOfTheTipPoseInEveryFrame) {
  RobotModel m = conformance::tree();
  m.base = conformance::multiply(conformance::shift(1, 2, 3), conformance::turn_x(0.7));
  conformance::Random random(6);
  const auto q = random.configuration(m);
  std::vector<Pose> frames(m.joints.size());
  forward_kinematics(m, q, frames);
  for (std::size_t tip = 0; tip < 2; ++tip)
    for (const JacobianFrame frame :
         {JacobianFrame::base, JacobianFrame::world, JacobianFrame::tip}) {
      std::vector<double> J(6 * m.dof());
      geometric_jacobian(m, tip, frames, frame, J);
      const Pose here = conformance::tip_pose(m, q.data(), tip);
      for (std::size_t j = 0; j < m.dof(); ++j) {
        const double h = 1e-5;
        auto up = q, down = q;
        up[j] += h, down[j] -= h;
        const Pose a = conformance::tip_pose(m, down.data(), tip),
                   b = conformance::tip_pose(m, up.data(), tip);
        Vec3 v = spatial::scale(spatial::sub(b.p, a.p), 0.5 / h);
        Vec3 w = spatial::scale(spatial::rotation_difference(a.R, b.R), 0.5 / h);
        if (frame == JacobianFrame::world)
          v = spatial::rotate(m.base, v), w = spatial::rotate(m.base, w);
        if (frame == JacobianFrame::tip)
          v = spatial::rotate_back(here, v), w = spatial::rotate_back(here, w);
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_NEAR(J[6 * j + k], v[k], 1e-9);
          EXPECT_NEAR(J[6 * j + 3 + k], w[k], 1e-9);
        }
      }
    }
}

TEST(Manipulability, OfTheTwoRodsIsTheirParallelogramAndVanishesStretched) {
  const RobotModel m = conformance::planar_rods();
  std::vector<Pose> frames(2);
  std::vector<double> J(12);
  const auto at = [&](double elbow) {
    const std::vector<double> q{0.3, elbow};
    forward_kinematics(m, q, frames);
    geometric_jacobian(m, 0, frames, JacobianFrame::base, J);
    return manipulability(J);
  };
  // det(J^T J) = |c1 x c2|^2 generalized: columns (v, w) with w = z twice.
  const double l1 = 0.7, l2 = 0.45, c = std::cos(1.1);
  const double a = l1 * l1 + l2 * l2 + 2 * l1 * l2 * c + 1, b = l2 * l2 + l1 * l2 * c + 1,
               d = l2 * l2 + 1;
  EXPECT_NEAR(at(1.1), std::sqrt(a * d - b * b), 1e-13);
  const RobotModel puma6 = conformance::puma560();
  std::vector<Pose> f(6);
  std::vector<double> K(36);
  forward_kinematics(puma6, std::vector<double>{0.1, 0.5, -0.3, 0.4, 0, 0.2}, f);
  geometric_jacobian(puma6, 0, f, JacobianFrame::base, K);
  EXPECT_NEAR(manipulability(K), 0, 1e-9) << "wrist axes 4 and 6 in line";
  forward_kinematics(puma6, std::vector<double>{0.1, 0.5, -0.3, 0.4, 0.8, 0.2}, f);
  geometric_jacobian(puma6, 0, f, JacobianFrame::base, K);
  EXPECT_GT(manipulability(K), 1e-2);
}

TEST(BuildModel, OffsetsBaseAndToolAreTaken) {
  model::Robot r = chain(Convention::dh, {link(0.5, 0.2, 0.3, 0.1)});
  r.base = {{1, 2, 3}, {kPi / 2, 0, 0}, model::AngleRepresentation::rpy};
  r.tool = {{0, 0, 0.1}, {0, 0, 0.2}, model::AngleRepresentation::rpy};
  const RobotModel m = built(r);
  const Pose expected =
      spatial::compose(spatial::dh_pose(0.3, 0.1, 0.2, 0.5 + 0.7), model::pose(r.tool));
  EXPECT_LT(conformance::position_gap(tool_at(m, {0.7}), expected), 1e-15);
  EXPECT_LT(conformance::rotation_gap(tool_at(m, {0.7}), expected), 1e-15);
  EXPECT_EQ(m.gravity, (Vec3{0, -9.81, 0})) << "gravity is turned into the base frame";
}

TEST(BuildModel, APrismaticVariableAddsToD) {
  model::Robot r = chain(Convention::mdh, {link(0.4, 0.25, 0.1, 0.3)});
  r.links[0].joint = JointKind::prismatic;
  const Pose expected = spatial::mdh_pose(0.1, 0.3, 0.25 + 0.6, 0.4);
  EXPECT_LT(conformance::position_gap(tool_at(built(r), {0.6}), expected), 1e-15);
  EXPECT_LT(conformance::rotation_gap(tool_at(built(r), {0.6}), expected), 1e-15);
}

// A fixed link in the middle equals the same robot with the row written into its neighbours.
TEST(BuildModel, FixedLinksAreFoldedIntoTheirParent) {
  const MassProperties m1 = body(2, {0.1, 0.2, 0.3}, {0.1, 0.2, 0.25, 0.01, 0.02, 0.03}),
                       m2 = body(3, {-0.1, 0, 0.2}, {0.3, 0.2, 0.25, 0, 0.01, 0});
  model::Robot r = chain(Convention::dh, {link(0.1, 0.2, 0.3, 0.4, m1),
                                          link(0.5, 0.6, 0.7, 0.8, m2), link(0.2, 0.1, 0.4, 0.3)});
  r.links[1].joint = JointKind::fixed;
  const RobotModel m = built(r);
  ASSERT_EQ(m.dof(), 2U);
  const auto links = link_frames(r);
  std::vector<Pose> frames(2), poses(3);
  const std::vector<double> q{0.3, -0.9};
  forward_kinematics(m, q, frames);
  link_poses(links, frames, poses);
  const Pose l1 = spatial::dh_pose(0.3, 0.4, 0.2, 0.1 + q[0]);
  const Pose l2 = spatial::compose(l1, spatial::dh_pose(0.7, 0.8, 0.6, 0.5));
  const Pose l3 = spatial::compose(l2, spatial::dh_pose(0.4, 0.3, 0.1, 0.2 + q[1]));
  EXPECT_LT(conformance::position_gap(poses[0], l1), 1e-15);
  EXPECT_LT(conformance::position_gap(poses[1], l2), 1e-15);
  EXPECT_LT(conformance::position_gap(poses[2], l3), 1e-15);
  EXPECT_EQ(moving_links(r), (std::vector<std::int32_t>{0, 2}));
  // Both bodies together, in the base: once by hand, once from the folded body.
  const MassProperties parts[] = {spatial::in_frame(m1, l1), spatial::in_frame(m2, l2)};
  const MassProperties expected = spatial::combine(parts),
                       folded = spatial::in_frame(m.joints[0].body, frames[0]);
  EXPECT_NEAR(folded.mass, 5, 1e-15);
  EXPECT_LT(spatial::distance(folded.com, expected.com), 1e-15);
  EXPECT_NEAR(folded.inertia.xx, expected.inertia.xx, 1e-14);
  EXPECT_NEAR(folded.inertia.yz, expected.inertia.yz, 1e-14);
}

TEST(BuildModel, EveryLeafBecomesATip) {
  model::Robot r =
      chain(Convention::mdh, {link(0, 0.1, 0, 0), link(0, 0.2, 0, 0), link(0, 0.3, 0, 0)});
  r.links[2].parent = 0;
  const RobotModel m = built(r);
  ASSERT_EQ(m.tips.size(), 2U);
  EXPECT_EQ(m.tips[0].name, "tool");
  EXPECT_EQ(m.tips[0].joint, 2);
  EXPECT_EQ(m.tips[1].name, "link 2");
  EXPECT_EQ(m.tips[1].joint, 1);
  EXPECT_FALSE(m.is_serial());
}

TEST(BuildModel, MassSourceDecidesBetweenGivenAndDesigned) {
  model::Robot r = chain(Convention::mdh,
                         {link(0, 0, 0, 0, body(1, {}, {})), link(0, 0, 0, 0, body(2, {}, {}))});
  const std::vector<std::optional<MassProperties>> designed{body(7, {}, {}), std::nullopt};
  EXPECT_EQ(build_robot_model("arm", r, designed, kDown)->joints[0].body.mass, 1);
  r.mass_source = model::MassSource::designed;
  EXPECT_EQ(build_robot_model("arm", r, designed, kDown)->joints[0].body.mass, 7);
  EXPECT_EQ(build_robot_model("arm", r, designed, kDown)->joints[1].body.mass, 2)
      << "falls back to the given value";
}

TEST(BuildModel, FaultsNameRobotAndLink) {
  model::Robot r = puma();
  r.links[2].name = "forearm";
  r.links[2].parent = 4;
  EXPECT_EQ(
      refusal(r),
      "robot \"arm\", link 3 \"forearm\": its parent is link 5, which does not come before it. "
      "Order the links so that parents come first; the base is parent 0.");
  r = puma();
  r.links[1].row.alpha = std::nan("");
  EXPECT_EQ(
      refusal(r).rfind(
          "robot \"arm\", link 2 \"link 2\": its row has a value that is not a finite number", 0),
      0U);
  r = puma();
  r.links[3].lower = 1, r.links[3].upper = -1;
  EXPECT_EQ(refusal(r),
            "robot \"arm\", link 4 \"link 4\": its lower limit 57.3 deg is above its upper limit "
            "-57.3 deg. Swap the two limits.");
  r = puma();
  r.links[5].given->mass = -2;
  EXPECT_EQ(
      refusal(r),
      "robot \"arm\", link 6 \"link 6\": its given mass is -2 kg. A mass cannot be negative.");
  EXPECT_EQ(refusal(model::Robot{}), "robot \"arm\": it has no links. Add a link with its joint.");
  r = chain(Convention::dh, {link(0, 0, 1, 0)});
  r.links[0].joint = JointKind::fixed;
  EXPECT_EQ(refusal(r),
            "robot \"arm\": all its links are fixed. Give at least one link a joint that moves.");
}

// Skins: pieces must be valid primitives, near the robot, and join joint to joint.
void expect_sound(const LinkGeometry& skin, double reach) {
  const auto check = [&](const std::vector<LinkGeometryPiece>& pieces) {
    for (const LinkGeometryPiece& p : pieces) {
      ASSERT_EQ(p.tree.nodes.size(), 1U);
      const CsgNode& n = p.tree.nodes[0];
      EXPECT_TRUE(spatial::is_rigid(n.placement)) << n.name;
      EXPECT_LE(spatial::norm(n.placement.p), 3 * reach) << n.name;
      EXPECT_GT(n.sizes[0], 0) << n.name;
      for (const double s : n.sizes) {
        EXPECT_TRUE(std::isfinite(s) && s >= 0) << n.name;
        EXPECT_LE(s, 3 * reach) << n.name;
      }
    }
  };
  check(skin.base);
  for (const auto& pieces : skin.links) check(pieces);
}

TEST(LinkGeometry, EveryLinkOfKnownRobotsHasABody) {
  const std::pair<model::Robot, double> robots[] = {
      {puma(), 1.0}, {pa10(), 1.4}, {pa10_nus(), 1.4}, {scara_record(), 1.2}};
  for (const auto& [robot, reach] : robots) {
    const LinkGeometry skin = make_link_geometry(robot);
    ASSERT_EQ(skin.links.size(), robot.links.size());
    EXPECT_FALSE(skin.base.empty());
    for (const auto& pieces : skin.links) EXPECT_FALSE(pieces.empty());
    expect_sound(skin, reach);
  }
}

TEST(LinkGeometry, ATubeJoinsTheElbowToTheWrist) {
  // PA-10 link 4 carries the forearm: from its own axis 0.48 m along the axis of joint 5.
  const LinkGeometry skin = make_link_geometry(pa10());
  double longest = 0;
  for (const LinkGeometryPiece& p : skin.links[3])
    if (p.tree.nodes[0].kind == CsgKind::cone)
      longest = std::max(longest, p.tree.nodes[0].sizes[2]);
  EXPECT_GT(longest, 0.38);
  EXPECT_LT(longest, 0.48);
}

TEST(LinkGeometry, WorksForHundredsOfLinksWithoutThickeningThem) {
  std::vector<model::Link> links;
  for (int i = 0; i < 400; ++i) links.push_back(link(0, 0, 0.1, i % 2 ? kRight : -kRight));
  const LinkGeometry skin = make_link_geometry(chain(Convention::dh, links));
  expect_sound(skin, 40);
  for (const auto& pieces : skin.links)
    for (const LinkGeometryPiece& p : pieces) EXPECT_LT(p.tree.nodes[0].sizes[0], 0.06);
}

TEST(LinkGeometry, DegenerateRobotsGetSomething) {
  const LinkGeometry zero =
      make_link_geometry(chain(Convention::dh, {link(0, 0, 0, 0), link(0, 0, 0, kRight)}));
  expect_sound(zero, 1);
  EXPECT_FALSE(zero.links[1].empty());
  EXPECT_TRUE(make_link_geometry(model::Robot{}).links.empty());
  model::Robot hidden = puma();
  hidden.links[1].visible = false;
  EXPECT_TRUE(make_link_geometry(hidden).links[1].empty());
  model::Robot endless = chain(Convention::dh, {link(0, 0, 0, 0)});
  endless.links[0].joint = JointKind::prismatic;
  expect_sound(make_link_geometry(endless), 1);
}

}  // namespace
}  // namespace robomosp::robotics

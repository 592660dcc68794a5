// SPDX-License-Identifier: Apache-2.0
#include "scene/build.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "model/placement.h"
#include "scene/motion.h"
#include "spatial/pose.h"
#include "support/workbench.h"

namespace robomosp::scene {
namespace {

using test::unwrap;
using test::Workbench;

/// A box of full lengths about the origin, as far as its corners matter.
std::shared_ptr<const Mesh> corners(float x, float y, float z) {
  auto m = std::make_shared<Mesh>();
  for (int i = 0; i < 8; ++i) {
    m->positions.push_back((i & 1) != 0 ? x / 2 : -x / 2);
    m->positions.push_back((i & 2) != 0 ? y / 2 : -y / 2);
    m->positions.push_back((i & 4) != 0 ? z / 2 : -z / 2);
  }
  return m;
}

render::Item item(std::uint64_t id, const std::shared_ptr<const Mesh>& mesh, const Vec3& place) {
  render::Item i;
  i.id = id;
  i.mesh = mesh;
  i.pose.p = place;
  return i;
}

TEST(Explode, PartsMoveOutwardsByTheShareOfTheirDistance) {
  render::Scene scene;
  const auto cube = corners(0.1F, 0.1F, 0.1F);
  scene.items = {item(1, cube, {-0.2, 0, 0}), item(2, cube, {0.2, 0, 0.1}),
                 item(3, cube, {0.2, 0, -0.1})};
  const std::size_t groups[] = {0, 1, 1};
  explode(scene, groups, 0.5);
  // The middle of all is the origin; the second group's middle is (0.2, 0, 0).
  const Vec3 wanted[] = {{-0.3, 0, 0}, {0.3, 0, 0.1}, {0.3, 0, -0.1}};
  for (std::size_t n = 0; n < 3; ++n)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(scene.items[n].pose.p[i], wanted[n][i], 1e-7) << n;
  ASSERT_EQ(scene.lines.size(), 2U);
  EXPECT_NEAR(scene.lines[0].points[1][0] - scene.lines[0].points[0][0], -0.1, 1e-7);
}

TEST(Explode, PartsInOnePlaceComeApart) {
  render::Scene scene;
  scene.items = {item(1, corners(0.1F, 0.1F, 0.3F), {}), item(2, corners(0.04F, 0.04F, 0.32F), {}),
                 item(3, corners(0.02F, 0.02F, 0.1F), {})};
  const std::size_t groups[] = {0, 1, 2};
  explode(scene, groups, 1.0);
  // Along z, the longest side: the first stays, the others stand clear above and below it.
  EXPECT_NEAR(scene.items[0].pose.p[2], 0, 1e-9);
  EXPECT_GT(scene.items[1].pose.p[2] - 0.16, 0.15);
  EXPECT_LT(scene.items[2].pose.p[2] + 0.05, -0.15);
}

TEST(MassMark, AxesAreAsLongAsTheRadiiOfGyration) {
  // A block a x b x c of mass m turned by 30 degrees about z: k_z^2 = (a^2 + b^2)/12.
  const double a = 0.3, b = 0.2, c = 0.1, m = 5, turn = std::numbers::pi / 6;
  const double ix = m * (b * b + c * c) / 12, iy = m * (a * a + c * c) / 12,
               iz = m * (a * a + b * b) / 12;
  const double cs = std::cos(turn), sn = std::sin(turn);
  MassProperties mass;
  mass.mass = m;
  mass.com = {1, 2, 3};
  mass.inertia = {
      ix * cs * cs + iy * sn * sn, ix * sn * sn + iy * cs * cs, iz, (ix - iy) * cs * sn, 0, 0};
  const render::MassMark mark = mass_mark(9, mass);
  EXPECT_EQ(mark.pose.p, mass.com);
  EXPECT_NEAR(mark.gyration[0], std::sqrt((b * b + c * c) / 12), 1e-12);
  EXPECT_NEAR(mark.gyration[1], std::sqrt((a * a + c * c) / 12), 1e-12);
  EXPECT_NEAR(mark.gyration[2], std::sqrt((a * a + b * b) / 12), 1e-12);
  // The smallest moment is about the longest side, 30 degrees from x.
  EXPECT_NEAR(std::abs(mark.pose.R[0]), cs, 1e-12);
  EXPECT_NEAR(std::abs(mark.pose.R[3]), sn, 1e-12);
}

struct SceneTest : testing::Test {
  Workbench bench;
  NoProgress progress;
  Built built(AnyId id, const Extras& extras = {}) {
    const auto now = bench.document.now();
    return unwrap(build({*now, bench.derived, bench.registry}, id, extras, progress));
  }
};

TEST_F(SceneTest, AWorldShowsItsObjectsRobotsAndTrajectories) {
  const AnyId world = bench.load("worlds/pa10_circle.wld");
  const Built b = built(world);
  EXPECT_TRUE(b.left_out.empty()) << b.left_out.front();
  EXPECT_GT(b.scene.items.size(), 10U);
  EXPECT_EQ(b.scene.lines.size(), 1U);
  EXPECT_EQ(b.scene.triads.size(), 1U);
  EXPECT_TRUE(b.scene.marks.empty());
  // The same member has the same id in another build, and no two share one.
  const Built again = built(world);
  std::set<std::uint64_t> ids;
  for (std::size_t i = 0; i < b.scene.items.size(); ++i) {
    EXPECT_EQ(b.scene.items[i].id, again.scene.items[i].id);
    ids.insert(b.scene.items[i].id);
  }
  EXPECT_EQ(ids.size(), b.scene.items.size());
}

TEST_F(SceneTest, AMarkOfMassForEveryBodyThatHasOne) {
  const Built b = built(bench.load("worlds/pa10_circle.wld"), {.com = true});
  EXPECT_GE(b.scene.marks.size() + b.left_out.size(), 3U);
  for (const auto& mark : b.scene.marks)
    for (const double k : mark.gyration) EXPECT_GT(k, 0);
}

TEST_F(SceneTest, ARobotIsShownAtTheJointValuesGiven) {
  const AnyId robot = bench.load("robots/twolink.rbt");
  const Built straight = built(robot, {.q = {0, 0}}), bent = built(robot, {.q = {0, 1.0}});
  ASSERT_EQ(straight.scene.triads.size(), 1U);
  const Vec3 a = straight.scene.triads[0].pose.p, b = bent.scene.triads[0].pose.p;
  EXPECT_GT(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 0.1);
  EXPECT_EQ(built(robot, {.frames = true}).scene.triads.size(),
            straight.scene.triads.size() + 3);  // base and two links
}

TEST_F(SceneTest, AMaterialIsShownOnASphereAndAClosedCone) {
  const Built b = built(bench.load("materials/brass.mtr"));
  ASSERT_EQ(b.scene.items.size(), 2U);
  EXPECT_GT(b.scene.items[0].appearance.metalness, 0.5F);
  // Volumes by the divergence theorem: of the sphere and the cone 0.1 m high.
  const double wanted[] = {std::numbers::pi / 6 * 1e-3, std::numbers::pi / 12 * 1e-3};
  for (std::size_t n = 0; n < 2; ++n) {
    const Mesh& m = *b.scene.items[n].mesh;
    double volume = 0;
    for (std::size_t t = 0; t < m.triangles.size(); t += 3) {
      double p[3][3];
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          p[k][c] = static_cast<double>(m.positions[3 * std::size_t{m.triangles[t + k]} + c]);
      volume += (p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                 p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                 p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0])) /
                6;
    }
    EXPECT_NEAR(volume, wanted[n], 0.01 * wanted[n]) << n;
  }
}

TEST_F(SceneTest, OfASolidThatCannotBeMadeTheOperandsAreShownAsAWarning) {
  // A box minus a larger box around it leaves nothing.
  model::Solid solid;
  solid.nodes.resize(3);
  solid.nodes[0].kind = CsgKind::difference;
  solid.nodes[0].name = "cut";
  for (std::size_t i : {1U, 2U}) {
    solid.nodes[i].kind = CsgKind::box;
    solid.nodes[i].name = i == 1 ? "inner" : "outer";
    solid.nodes[i].parent = 0;
    const double l = i == 1 ? 0.1 : 0.2;
    solid.nodes[i].sizes = {l, l, l};
  }
  auto transaction = bench.document.begin("add");
  ASSERT_TRUE(transaction.ok());
  const auto id = unwrap(transaction->add("nothing", std::move(solid)));
  ASSERT_TRUE(transaction->commit().ok());
  const Built b = built(id, {.com = true});
  ASSERT_EQ(b.scene.items.size(), 2U);
  for (const auto& item : b.scene.items) {
    EXPECT_LT(item.appearance.colour.a, 0.9F);
    EXPECT_GT(item.appearance.colour.r, 2 * item.appearance.colour.g);
  }
  ASSERT_EQ(b.left_out.size(), 1U);
  EXPECT_NE(b.left_out[0].find("nothing"), std::string::npos) << b.left_out[0];
}

TEST_F(SceneTest, FramesLightsAndHeldObjectsOfAWorldAreWhereTheyAre) {
  const RobotId arm{bench.load("robots/twolink.rbt").number};
  auto begun = bench.document.begin("world");
  ASSERT_TRUE(begun.ok());
  auto& tx = *begun;
  model::Solid ball;
  ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.05}});
  const AnyId what = unwrap(tx.add("ball", ball));
  model::World world;
  world.robots.push_back({"arm", arm, {.position = {0, 0, 1}}, {0, 0}});
  world.objects = {{"held", what, {.position = {9, 9, 9}}},
                   {"free", what, {.position = {0, 3, 0}}}};
  world.attachments.push_back({"held", "arm", "", {.position = {0.1, 0, 0}}});
  world.frames.push_back({"bench", {.position = {1, 2, 3}}});
  world.lights.push_back(
      {"lamp", model::LightKind::spot, {.position = {0, 0, 4}}, {1, 0, 0, 1}, 2, 0.3});
  const AnyId id = unwrap(tx.add("cell", world));
  ASSERT_TRUE(tx.commit().ok());

  Extras bent;
  bent.robot_q["arm"] = {0, 1.0};
  for (const Extras& extras : {Extras{}, bent}) {
    const Built b = built(id, extras);
    EXPECT_TRUE(b.left_out.empty());
    const auto named = [&](const std::string& name) {
      return *std::find_if(b.scene.items.begin(), b.scene.items.end(),
                           [&](const render::Item& i) { return i.name == name; });
    };
    const auto labelled = [&](const std::string& label) {
      return *std::find_if(b.scene.triads.begin(), b.scene.triads.end(),
                           [&](const render::Triad& t) { return t.label == label; });
    };
    // The tool's triad is the one without a name.
    const Vec3 wanted = spatial::transform(labelled("").pose, {0.1, 0, 0});
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(named("held").pose.p[k], wanted[k], 1e-12);
    EXPECT_EQ(named("free").pose.p, (Vec3{0, 3, 0}));
    EXPECT_EQ(labelled("bench").pose.p, (Vec3{1, 2, 3}));
    ASSERT_EQ(b.scene.lights.size(), 1U);
    const render::Light& lamp = b.scene.lights[0];
    EXPECT_EQ(lamp.kind, render::Light::Kind::spot);
    EXPECT_EQ(lamp.pose.p, (Vec3{0, 0, 4}));
    EXPECT_EQ(lamp.intensity, 2);
    EXPECT_EQ(lamp.angle, 0.3);
    EXPECT_EQ(lamp.colour.g, 0.0F);
  }
}

TEST_F(SceneTest, ArrowsOfAWayPointAlongItAndItsPointsAreNumbered) {
  const AnyId world = bench.load("worlds/pa10_circle.wld");
  Extras extras;
  extras.paths = ShownPath::points;
  const Built b = built(world, extras);
  ASSERT_EQ(b.scene.lines.size(), 1U);
  const auto& way = b.scene.lines[0].points;
  std::size_t arrows = 0;
  for (const render::Item& item : b.scene.items) {
    if (item.name != "circle" || item.appearance.metalness != 0 || !item.mesh) continue;
    // The arrow's middle is on the way, between the nearest point and the next along z.
    const Vec3 z{item.pose.R[2], item.pose.R[5], item.pose.R[8]};
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const Vec3 step{way[i + 1][0] - way[i][0], way[i + 1][1] - way[i][1],
                      way[i + 1][2] - way[i][2]};
      const double length = std::hypot(step[0], step[1], step[2]);
      const double along = (step[0] * z[0] + step[1] * z[1] + step[2] * z[2]) / length;
      if (std::abs(along - 1) < 1e-12) {
        ++arrows;
        break;
      }
    }
  }
  EXPECT_GE(arrows, 8U);
  ASSERT_FALSE(b.scene.labels.empty());
  EXPECT_EQ(b.scene.labels[0].text, "1");
  extras.paths = ShownPath::none;
  EXPECT_TRUE(built(world, extras).scene.lines.empty());
}

TEST(MarkPath, EachPieceHasTheColourOfItsWorseEnd) {
  sim::PathCheck check;
  check.trajectory = "way";
  using sim::PathState;
  check.states = {PathState::good, PathState::good, PathState::limit, PathState::unreachable};
  for (int i = 0; i < 4; ++i) {
    Pose pose;
    pose.p = {0.1 * i, 0, 0};
    check.poses.push_back(pose);
    check.times.push_back(i);
  }
  check.faults.push_back(
      {PathState::unreachable, 3, 3, 3, "it is out of reach", -1, 0, "", {}, {}});
  EXPECT_EQ(check.last_good(), 1U);
  render::Scene scene;
  add_path(scene, "way", check.poses, ShownPath::line);
  mark_path(scene, check);
  ASSERT_EQ(scene.lines.size(), 3U);                            // and the plain line is gone
  EXPECT_GT(scene.lines[0].colour.g, scene.lines[0].colour.r);  // green
  EXPECT_EQ(scene.lines[0].points.size(), 2U);
  EXPECT_GT(scene.lines[1].colour.g, 0.4F);  // orange
  EXPECT_LT(scene.lines[2].colour.g, 0.2F);  // red
  ASSERT_EQ(scene.labels.size(), 1U);
  EXPECT_EQ(scene.labels[0].text, "sample 4");
  ASSERT_EQ(scene.legends.size(), 1U);
  EXPECT_EQ(scene.legends[0].colours.size(), 3U);
}

TEST_F(SceneTest, ATrajectoryOnItsOwnIsRefusedInASentence) {
  const AnyId path = bench.load("trajectories/circle.tjc");
  const auto now = bench.document.now();
  const auto failed = build({*now, bench.derived, bench.registry}, path, {}, progress);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().sentence().find("has no body to show"), std::string::npos);
}

/// A recording of one robot of a world, joint values row after row.
recording::Recording joint_recording(const std::string& robot, std::vector<double> times,
                                     const std::vector<std::vector<double>>& rows) {
  recording::Recording r;
  r.robot = robot;
  r.dof = rows.front().size();
  r.columns.push_back({"time", "s", "", std::move(times)});
  for (std::size_t k = 0; k < r.dof; ++k) {
    recording::Column c{"q" + std::to_string(k + 1), "rad", "", {}};
    for (const auto& row : rows) c.values.push_back(row[k]);
    r.columns.push_back(std::move(c));
  }
  return r;
}

// A recording moves the ellipsoids with the robot: they are those of the robot at these joint
// values.
TEST(Ellipsoids, FollowTheRobotOfARecording) {
  Workbench bench;
  NoProgress progress;
  const AnyId id = bench.load("worlds/puma560.wld");
  const auto snapshot = bench.document.now();
  const Source source{*snapshot, bench.derived, bench.registry};
  const model::PlacedRobot& placed = snapshot->get(WorldId{id.number})->robots.front();
  const std::vector<double> a{0.1, -0.8, 0.3, 0.2, 0.6, 0}, b{0.5, -0.4, 0.7, 0.2, 1, 0.4},
      middle{0.3, -0.6, 0.5, 0.2, 0.8, 0.2};
  const auto recording = joint_recording(placed.name, {0, 2}, {a, b});
  Extras extras;
  extras.ellipsoids = {true, true};
  const auto ellipsoid_in = [](const render::Scene& scene, const std::string& ending) {
    const auto at = std::find_if(scene.items.begin(), scene.items.end(),
                                 [&](const auto& i) { return i.name.ends_with(ending); });
    return at == scene.items.end() ? render::Item{} : *at;
  };
  for (const auto& [time, q] : {std::pair(0.0, a), {1.0, middle}, {5.0, b}}) {
    extras.q = q;
    const Built still = unwrap(build(source, placed.robot, extras, progress));
    const auto motion = std::make_shared<const Motion>(
        unwrap(motion_at(*snapshot, WorldId{id.number}, recording, time)));
    const Built moved = unwrap(build(source, id, extras, progress, motion));
    for (const std::string ending : {" velocity ellipsoid", " force ellipsoid"}) {
      const render::Item item = ellipsoid_in(moved.scene, ending),
                         same = ellipsoid_in(still.scene, ending);
      ASSERT_TRUE(item.mesh && same.mesh) << ending;
      EXPECT_EQ(item.name, placed.name + ending);
      const Pose expected = spatial::compose(model::pose(placed.placement), same.pose);
      EXPECT_LT(spatial::distance(item.pose.p, expected.p), 1e-12);
      for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(item.pose.R[i], expected.R[i], 1e-9);
      ASSERT_EQ(item.mesh->positions.size(), same.mesh->positions.size());
      for (std::size_t v = 0; v < same.mesh->positions.size(); ++v)
        EXPECT_NEAR(item.mesh->positions[v], same.mesh->positions[v], 1e-6F);
    }
  }
}

}  // namespace
}  // namespace robomosp::scene

// SPDX-License-Identifier: Apache-2.0
// The library that ships with the program: that every file loads and is in the written form, and
// that robots and bodies are those that were published.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/csg.h>

#include "model/controller.h"
#include "model/declare.h"
#include "model/placement.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::unwrap;
using test::Workbench;

constexpr double kDeg = std::numbers::pi / 180;

std::vector<fs::path> files(const std::string& extension) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(Workbench::library()))
    if (entry.is_regular_file() && (extension.empty() || entry.path().extension() == extension))
      found.push_back(fs::relative(entry.path(), Workbench::library()));
  std::sort(found.begin(), found.end());
  return found;
}

model::Robot robot(Workbench& bench, const std::string& name) {
  const RobotId id{bench.load("robots/" + name + ".rbt").number};
  const model::Robot* found = bench.document.now()->get(id);
  return found ? *found : model::Robot{};
}

TEST(Library, EveryFileLoadsOnItsOwnAndIsWrittenBackByteEqual) {
  // Their commands are no part of this test, which register the kind otherwise.
  (void)model::register_kind_of<model::Controller>("controller", ".ctl", "controllers");
  ASSERT_GT(files("").size(), 100U);
  for (const fs::path& file : files("")) {
    document::Document document;
    auto transaction = document.begin("load");
    ASSERT_TRUE(transaction.ok());
    const fs::path path = Workbench::library() / file;
    const auto loaded = io::load(*transaction, path, {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    EXPECT_TRUE(loaded->notes.empty()) << file << ": " << loaded->notes.front();
    const auto commit = transaction->commit();
    ASSERT_TRUE(commit.ok()) << commit.error().sentence();
    const auto& record = *document.now()->find(loaded->id);
    EXPECT_EQ(unwrap(io::print(*document.now(), loaded->id, path, {})), unwrap(io::read_file(path)))
        << file;
    EXPECT_EQ(path.extension().string(), io::extension(record.kind())) << file;
  }
}

TEST(Library, AllWorldsTogetherKeepTheirNames) {
  Workbench bench;
  for (const fs::path& file : files(".wld")) {
    const AnyId id = bench.load(file.string());
    EXPECT_EQ(bench.document.now()->find(id)->name, file.stem().string());
  }
  // A record whose name was taken would have got a number behind it.
  for (const AnyId id : bench.document.now()->list(Kind::solid)) {
    const auto& record = *bench.document.now()->find(id);
    const std::string stem = fs::path(record.file).stem().string();
    EXPECT_TRUE(record.name.ends_with(stem)) << record.name << " from " << record.file;
  }
}

TEST(Library, MaterialsTellTheirSourceAndThePublishedDensities) {
  Workbench bench;
  for (const fs::path& file : files(".mtr")) {
    const MaterialId id{bench.load(file.string()).number};
    const auto snapshot = bench.document.now();
    const model::Material* m = snapshot->get(id);
    ASSERT_NE(m, nullptr) << file;
    EXPECT_FALSE(m->source.empty()) << file;
    EXPECT_GT(m->density, 500) << file;
    EXPECT_LT(m->density, 20000) << file;
    // g/cm^3 of periodic tables and data sheets.
    static const std::map<std::string, double> kKnown{{"steel", 7.85},
                                                      {"stainless_316", 8.0},
                                                      {"aluminium", 2.70},
                                                      {"aluminium_2024", 2.78},
                                                      {"aluminium_7075", 2.81},
                                                      {"titanium", 4.43},
                                                      {"tungsten", 19.3},
                                                      {"lead", 11.3},
                                                      {"pa6", 1.13},
                                                      {"ptfe", 2.16},
                                                      {"peek", 1.30},
                                                      {"water", 0.9982},
                                                      {"carbon_fibre", 0.6 * 1.8 + 0.4 * 1.2},
                                                      {"gfrp", (2.56 + 1.2) / 2}};
    if (const auto it = kKnown.find(file.stem().string()); it != kKnown.end()) {
      EXPECT_NEAR(m->density, 1000 * it->second, 1e-9) << file;
    }
  }
}

struct LibraryRow {
  double a, alpha_deg, d;  ///< [m], [deg], [m]
};

void expect_rows(const model::Robot& r, model::Convention convention,
                 const std::vector<LibraryRow>& rows) {
  EXPECT_EQ(r.convention, convention);
  ASSERT_EQ(r.links.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_DOUBLE_EQ(r.links[i].row.a, rows[i].a) << i;
    EXPECT_NEAR(r.links[i].row.alpha, rows[i].alpha_deg * kDeg, 1e-15) << i;
    EXPECT_DOUBLE_EQ(r.links[i].row.d, rows[i].d) << i;
    EXPECT_EQ(r.links[i].row.theta, 0) << i;
  }
}

// Corke and Armstrong-Helouvry, ICRA 1994, table of kinematic parameters.
TEST(Library, Puma560HasThePublishedRowsOfStandardDh) {
  Workbench bench;
  expect_rows(robot(bench, "puma560"), model::Convention::dh,
              {{0, 90, 0},
               {0.4318, 0, 0},
               {0.0203, -90, 0.15005},
               {0, 90, 0.4318},
               {0, -90, 0},
               {0, 0, 0}});
}

// Armstrong, Khatib and Burdick, ICRA 1986.
TEST(Library, Puma560MdhHasThePublishedRowsOfModifiedDh) {
  Workbench bench;
  expect_rows(robot(bench, "puma560_mdh"), model::Convention::mdh,
              {{0, 0, 0},
               {0, -90, 0.2435},
               {0.4318, 0, -0.0934},
               {-0.0203, 90, 0.4331},
               {0, -90, 0},
               {0, 90, 0}});
}

// PA-10 manual: 317, 450, 480 and 70 mm.
TEST(Library, Pa10HasTheLengthsOfItsManual) {
  Workbench bench;
  expect_rows(robot(bench, "pa10"), model::Convention::mdh,
              {{0, 0, 0.317},
               {0, -90, 0},
               {0, 90, 0.45},
               {0, -90, 0},
               {0, 90, 0.48},
               {0, -90, 0},
               {0, 90, 0.07}});
}

TEST(Library, RobotsHaveFiniteModelsPosesOfTheirSizeAndPositiveMasses) {
  Workbench bench;
  NoProgress progress;
  ASSERT_EQ(files(".rbt").size(), 23U);
  for (const fs::path& file : files(".rbt")) {
    const RobotId id{bench.load(file.string()).number};
    const auto snapshot = bench.document.now();
    const model::Robot& r = *snapshot->get(id);
    EXPECT_FALSE(r.description.empty()) << file;
    EXPECT_FALSE(r.source.empty()) << file;
    for (const model::Link& l : r.links) {
      EXPECT_LT(l.lower, l.upper) << file << " " << l.name;
      EXPECT_GT(l.max_velocity, 0) << file << " " << l.name;
      if (!l.given) continue;
      const MassProperties& m = *l.given;
      const bool is_inertia_only = m.mass == 0 && m.inertia.xx + m.inertia.yy + m.inertia.zz > 0;
      EXPECT_TRUE(m.mass > 0 || is_inertia_only) << file << " " << l.name;
      for (const double v : {m.mass, m.com[0], m.com[1], m.com[2], m.inertia.xx, m.inertia.yy,
                             m.inertia.zz, m.inertia.xy, m.inertia.yz, m.inertia.xz})
        EXPECT_TRUE(std::isfinite(v)) << file << " " << l.name;
    }
    EXPECT_TRUE(std::any_of(r.poses.begin(), r.poses.end(), [](const auto& p) {
      return p.name == "home";
    })) << file;
    const auto built = bench.derived.robot_model(*snapshot, id, {0, 0, -9.81}, progress);
    ASSERT_TRUE(built.ok()) << built.error().sentence();
    for (const auto& pose : r.poses) {
      ASSERT_EQ(pose.q.size(), (*built)->coordinate_count()) << file << " " << pose.name;
      EXPECT_EQ(robotics::joint_outside_limits(**built, pose.q), -1) << file << " " << pose.name;
    }
  }
}

// Box 0.2 x 0.2 x 0.05 m of steel, cylinder of 0.1 m diameter and 0.2 m length of aluminium on top,
// 0.05 m off along y: closed form.
TEST(Library, TheCompoundObjectHasItsClosedFormMass) {
  Workbench bench;
  NoProgress progress;
  const AnyId id = bench.load("parts/paper_compound.part");
  const auto body = unwrap(bench.derived.mass(*bench.document.now(), id, progress));
  const double box = 7850 * 0.2 * 0.2 * 0.05, post = 2700 * std::numbers::pi * 0.05 * 0.05 * 0.2;
  EXPECT_NEAR(body.mass.mass, box + post, 1e-9);
  EXPECT_NEAR(body.mass.mass, 19.941150082, 1e-8);
  EXPECT_NEAR(body.mass.com[1], post * 0.05 / (box + post), 1e-12);
  EXPECT_NEAR(body.mass.com[2], (box * 0.025 + post * 0.15) / (box + post), 1e-12);
  EXPECT_NEAR(body.mass.inertia.xx, 0.132913751, 1e-8);
  EXPECT_NEAR(body.mass.inertia.yz, -0.020869551, 1e-8);
}

// The designed castings weigh what the published links weigh, within a quarter.
TEST(Library, DesignedLinksWeighWhatWasPublishedWithinAQuarter) {
  for (const std::string name : {"pa10", "puma560"}) {
    Workbench bench;
    NoProgress progress;
    const model::Robot r = robot(bench, name);
    const auto snapshot = bench.document.now();
    for (const model::Link& l : r.links) {
      ASSERT_EQ(l.parts.size(), 1U) << name << " " << l.name;
      const auto body = unwrap(bench.derived.mass(*snapshot, l.parts[0].what, progress));
      EXPECT_NEAR(body.overlap, 0, 1e-9 + 0.02 * body.volume) << name << " " << l.name;
      ASSERT_TRUE(l.given) << name << " " << l.name;
      if (l.given->mass > 0) {
        EXPECT_NEAR(body.mass.mass / l.given->mass, 1, 0.25) << name << " " << l.name;
      }
    }
  }
}

/// The bodies of a robot, one list a link with the base first, placed for joint values q.
class PlacedBodies {
 public:
  PlacedBodies(Workbench& bench, RobotId id)
      : bench_(bench), snapshot_(bench.document.now()), robot_(*snapshot_->get(id)) {
    engine_ = unwrap(bench.registry.create<CsgEngine>(""));
  }
  std::vector<std::vector<PlacedShape>> at(const std::vector<double>& q) {
    std::vector<std::vector<PlacedShape>> bodies(1);
    const Pose base = model::pose(robot_.base);
    for (const auto& part : robot_.base_parts)
      add(bodies[0], part.what, spatial::compose(base, model::pose(part.placement)));
    Pose frame = base;
    for (std::size_t i = 0; i < robot_.links.size(); ++i) {
      const model::Link& l = robot_.links[i];
      const bool is_standard = robot_.convention == model::Convention::dh;
      const double theta = l.row.theta + q[i];
      frame = spatial::compose(
          frame, is_standard ? spatial::dh_pose(l.row.a, l.row.alpha, l.row.d, theta)
                             : spatial::mdh_pose(l.row.a, l.row.alpha, l.row.d, theta));
      bodies.emplace_back();
      for (const auto& part : l.parts)
        add(bodies.back(), part.what, spatial::compose(frame, model::pose(part.placement)));
    }
    return bodies;
  }
  /// Volume that two bodies share [m^3].
  double shared(const std::vector<PlacedShape>& a, const std::vector<PlacedShape>& b) {
    double volume = 0;
    for (const PlacedShape& x : a)
      for (const PlacedShape& y : b)
        volume += unwrap(engine_->partition(std::vector{x, y}, progress_)).overlap;
    return volume;
  }
  /// Lowest and highest z of a body [m].
  static std::array<double, 2> heights(const std::vector<PlacedShape>& body) {
    std::array<double, 2> z{1e9, -1e9};
    for (const PlacedShape& s : body) {
      const auto box = s.shape->bounds();
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p{box[corner & 1][0], box[(corner >> 1) & 1][1], box[(corner >> 2) & 1][2]};
        const double h = spatial::rotate(s.placement, p)[2] + s.placement.p[2];
        z = {std::min(z[0], h), std::max(z[1], h)};
      }
    }
    return z;
  }

 private:
  void add(std::vector<PlacedShape>& body, AnyId what, const Pose& at) {
    if (what.kind == Kind::object) {
      for (const auto& part : snapshot_->get(ObjectId{what.number})->parts)
        add(body, part.what, spatial::compose(at, model::pose(part.placement)));
      return;
    }
    auto& shape = shapes_[what.number];
    if (!shape) {
      CsgTree tree;
      for (const auto& n : snapshot_->get(SolidId{what.number})->nodes)
        tree.nodes.push_back({n.kind, n.parent, model::pose(n.placement), n.sizes, n.name});
      shape = unwrap(engine_->evaluate(tree, progress_));
    }
    body.push_back({shape, at});
  }

  Workbench& bench_;
  document::SnapshotPtr snapshot_;
  const model::Robot& robot_;
  std::shared_ptr<CsgEngine> engine_;
  std::map<std::uint64_t, std::shared_ptr<const CsgShape>> shapes_;
  NoProgress progress_;
};

class Pa10Bodies : public testing::TestWithParam<const char*> {};

TEST_P(Pa10Bodies, NeighboursMeetWithoutAGap) {
  Workbench bench;
  PlacedBodies placed(bench,
                      RobotId{bench.load(std::string("robots/") + GetParam() + ".rbt").number});
  const auto bodies = placed.at(std::vector<double>(7, 0.0));  // the arm points straight up
  ASSERT_EQ(bodies.size(), 8U);
  EXPECT_NEAR(PlacedBodies::heights(bodies[0])[0], 0, 1e-6);
  for (std::size_t i = 0; i + 1 < bodies.size(); ++i) {
    const double top = PlacedBodies::heights(bodies[i])[1],
                 bottom = PlacedBodies::heights(bodies[i + 1])[0];
    // Joints that roll: face on face. Joints that pivot: the fork reaches around the drum.
    if (i % 2 == 0 && i < 6) {
      EXPECT_NEAR(top, bottom, 1e-6) << i;
    } else {
      EXPECT_GT(top, bottom + 0.01) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BothParameterSets, Pa10Bodies, testing::Values("pa10", "pa10_nus"),
                         [](const auto& p) { return std::string(p.param); });

class DesignedBodies : public testing::TestWithParam<const char*> {};

TEST_P(DesignedBodies, DoNotPenetrateTheirNeighboursFromLimitToLimit) {
  Workbench bench;
  const model::Robot r = robot(bench, GetParam());
  PlacedBodies placed(bench,
                      RobotId{bench.load(std::string("robots/") + GetParam() + ".rbt").number});
  std::vector<std::vector<double>> poses(3);
  for (const model::Link& l : r.links) {
    poses[0].push_back(l.lower);
    poses[1].push_back(0);
    poses[2].push_back(l.upper);
  }
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const auto bodies = placed.at(poses[k]);
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (std::size_t j = i + 1; j < std::min(i + 3, bodies.size()); ++j)
        EXPECT_LT(placed.shared(bodies[i], bodies[j]), 1e-9)
            << "bodies " << i << " and " << j << ", pose " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheLibrary, DesignedBodies,
                         testing::Values("pa10", "pa10_nus", "puma560"),
                         [](const auto& p) { return std::string(p.param); });

TEST(Library, TheCircleWorldStartsAtTheFirstPointOfTheCircle) {
  Workbench bench;
  NoProgress progress;
  const WorldId id{bench.load("worlds/pa10_circle.wld").number};
  const auto snapshot = bench.document.now();
  const model::World& world = *snapshot->get(id);
  ASSERT_EQ(world.robots.size(), 1U);
  ASSERT_EQ(world.trajectories.size(), 1U);
  const auto& trajectory = *snapshot->get(world.trajectories[0].trajectory);
  ASSERT_EQ(trajectory.segments.size(), 1U);
  const Pose start = spatial::compose(model::pose(world.trajectories[0].placement),
                                      model::pose(trajectory.segments[0].points[0]));
  const auto built =
      unwrap(bench.derived.robot_model(*snapshot, world.robots[0].robot, world.gravity, progress));
  ASSERT_NE(built, nullptr);
  std::vector<Pose> frames(built->joints.size());
  robotics::forward_kinematics(*built, world.robots[0].q, frames);
  const Pose tip = spatial::compose(model::pose(world.robots[0].placement),
                                    robotics::tip_pose(*built, 0, frames));
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(tip.p[k], start.p[k], 1e-6);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(tip.R[k], start.R[k], 1e-6);
}

TEST(Library, DrawnAndPatternedPartsHaveTheVolumesOfTheirFormulas) {
  Workbench bench;
  NoProgress progress;
  const auto volume = [&](const std::string& name) {
    const SolidId id{bench.load("parts/" + name + ".csg").number};
    return unwrap(bench.derived.moments(*bench.document.now(), id, progress)).volume;
  };
  constexpr double kPi = std::numbers::pi;
  EXPECT_NEAR(volume("flange"),
              kPi * (0.0432 * 0.0432 * 0.01 + 0.02 * 0.02 * 0.02 - 0.01 * 0.01 * 0.03 -
                     6 * 0.0033 * 0.0033 * 0.01),
              1e-13);
  // The rounded corner adds a square less a quarter circle.
  EXPECT_NEAR(volume("bracket"),
              (0.06 * 0.006 + 0.054 * 0.006 + (1 - kPi / 4) * 0.008 * 0.008) * 0.04 -
                  2 * kPi * 0.0033 * 0.0033 * 0.006,
              1e-13);
  // Hub, web, and a rim whose groove takes away two trapezia turned about the axis: each frustum
  // of a cone has pi h (r^2 + r R + R^2) / 3.
  const auto frustum = [](double r, double R, double h) {
    return kPi * h * (r * r + r * R + R * R) / 3;
  };
  const auto ring = [](double r, double R, double h) { return kPi * h * (R * R - r * r); };
  EXPECT_NEAR(volume("pulley"),
              ring(0.006, 0.012, 0.024) + ring(0.012, 0.03, 0.008) + frustum(0.04, 0.04, 0.004) +
                  2 * frustum(0.034, 0.04, 0.004) + frustum(0.034, 0.034, 0.004) -
                  frustum(0.03, 0.03, 0.016),
              1e-13);
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// Worlds, robots and trajectories of ROBOMOSP 1.4 (2006): read, simulated, refused in words. The
// files in tests/support/files-2006 are our own; where the original's world is there
// (ROBOMOSP_LEGACY_DATA, or sample data beside the project), it is loaded and simulated too.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "io/legacy.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/kinematics.h"
#include "scene/build.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "spatial/vec.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using test::unwrap;
using test::Workbench;

constexpr double kPi = std::numbers::pi;
constexpr double kPerDegree = kPi / 180;

/// Removed first: file systems flush a file that is emptied and written again.
void rewrite(const fs::path& file, const std::string& content) {
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << content;
}

class LegacyWorld : public testing::Test {
 protected:
  LegacyWorld() {
    std::string pattern = (fs::temp_directory_path() / "robomosp_legacy_XXXXXX").string();
    folder = ::mkdtemp(pattern.data());
    fs::copy(fs::path(ROBOMOSP_SOURCE_DIR) / "tests/support/files-2006", folder,
             fs::copy_options::recursive);
  }
  ~LegacyWorld() override {
    std::error_code ec;
    fs::remove_all(folder, ec);
  }
  [[nodiscard]] std::string text(const std::string& name) const {
    std::ifstream in(folder / "Saves" / name, std::ios::binary);
    std::stringstream s;
    s << in.rdbuf();
    return s.str();
  }
  void put(const std::string& name, const std::string& content) const {
    rewrite(folder / "Saves" / name, content);
  }
  /// Replaces the first `from` of a file by `to`.
  void edit(const std::string& name, const std::string& from, const std::string& to) const {
    std::string s = text(name);
    const auto at = s.find(from);
    ASSERT_NE(at, std::string::npos) << name << " has no " << from;
    put(name, s.replace(at, from.size(), to));
  }
  AnyId load(const std::string& name) {
    auto tx = bench.document.begin("load");
    auto loaded = io::load(*tx, folder / "Saves" / name, {});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence();
      return {};
    }
    notes = loaded->notes;
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return loaded->id;
  }
  /// The sentence from the file's name on.
  std::string refusal(const std::string& name) {
    auto tx = bench.document.begin("load");
    const std::size_t before = tx->now().size();
    const auto loaded = io::load(*tx, folder / "Saves" / name, {});
    if (loaded.ok()) return "";
    EXPECT_EQ(tx->now().size(), before) << "a refused file must leave nothing behind";
    std::string sentence = loaded.error().sentence();
    const auto at = sentence.find(fs::path(name).filename().string());
    return at == std::string::npos ? sentence : sentence.substr(at);
  }
  template <class T>
  const T& get(AnyId id) {
    snapshot = bench.document.now();
    return std::get<T>(snapshot->find(id)->body);
  }
  std::shared_ptr<const motion::Path> path(AnyId id) {
    const auto& t = get<model::Trajectory>(id);
    return unwrap(motion::Path::build(bench.registry, "t", t));
  }

  /// Saved as native files, at least `files` of them, and loaded again it is the same world.
  void expect_same_from_native_files(AnyId id, std::size_t files) {
    fs::create_directories(folder / "native");
    auto tx = bench.document.begin("save");
    const auto written = unwrap(io::save(*tx, id, folder / "native/bench.wld", {}));
    EXPECT_GE(written.size(), files);
    ASSERT_TRUE(tx->commit().ok());
    const auto digest = bench.document.content_digest();
    bench.document.clear();
    auto back = bench.document.begin("load");
    EXPECT_TRUE(io::load(*back, folder / "native/bench.wld", {}).ok());
    ASSERT_TRUE(back->commit().ok());
    EXPECT_EQ(bench.document.content_digest(), digest);
  }

  fs::path folder;
  Workbench bench;
  std::shared_ptr<const document::Snapshot> snapshot;
  std::vector<std::string> notes;
};

PathSample path_sample(const motion::Path& path, double t) {
  PathSample s;
  EXPECT_TRUE(path.sample({&t, 1}, {&s, 1}).ok());
  return s;
}

/// The folder of the original's own files, where there is one.
fs::path original() {
  const char* given = std::getenv("ROBOMOSP_LEGACY_DATA");
  const fs::path data =
      given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4";
  return fs::is_directory(data / "Saves/Worlds") ? data : fs::path();
}

TEST_F(LegacyWorld, ARobotsJointValuesAreItsAnglesAndItsRowsTheRest) {
  const auto& r = get<model::Robot>(load("Robots/reacher.rbt"));
  EXPECT_EQ(r.description, "three joints in a plane");
  ASSERT_EQ(r.links.size(), 3U);
  EXPECT_EQ(r.links[0].name, "upper arm");
  EXPECT_EQ(r.links[1].name, "fore") << "without a description the object's file names it";
  EXPECT_EQ(r.links[2].parent, 1);
  EXPECT_EQ(r.links[0].row, (model::DhRow{0.4, 0, 0.2, 0})) << "theta is what was last shown";
  EXPECT_EQ(r.mass_source, model::MassSource::designed);
  ASSERT_EQ(r.base_parts.size(), 1U);
  ASSERT_EQ(r.links[2].parts.size(), 1U);
  EXPECT_EQ(snapshot->find(r.links[2].parts[0].what)->name, "hand");
  EXPECT_DOUBLE_EQ(r.links[1].lower, -150 * kPerDegree) << "limits the other way round";
  EXPECT_DOUBLE_EQ(r.links[1].upper, 150 * kPerDegree);
  ASSERT_EQ(r.poses.size(), 2U);
  EXPECT_EQ(r.poses[0].name, "home");
  EXPECT_DOUBLE_EQ(r.poses[0].q[2], -15 * kPerDegree);
  EXPECT_DOUBLE_EQ(r.poses[1].q[1], 90 * kPerDegree);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("eight numbers after a link's row are not applied"), std::string::npos);
}

TEST_F(LegacyWorld, BranchesAreReadAndAnyDepthIs) {
  const auto link = [](double a) {
    return "[ ( 0, " + std::to_string(a) +
           ", 0, 0, -90, 90, 0, 0 ) ( 0 0 0 0 0 0 0 0 ) Revolute ( \"\" \"\" ( 0, 0, 0, 0, 0, 0 ) "
           "0 3 0 ) ]";
  };
  const auto robot = [](int type, const std::string& tree) {
    return "\"\"\n " + std::to_string(type) + "\n( 0, 0, 0, 0, 0, 0 ) 0 3 0\n( )\n" + tree;
  };
  const std::string tree =
      "{ " + link(1) + " { " + link(2) + " { " + link(3) + " } } { " + link(4) + " } }";
  put("Robots/tree.rbt", robot(1, tree));
  const auto& r = get<model::Robot>(load("Robots/tree.rbt"));
  ASSERT_EQ(r.links.size(), 4U);
  EXPECT_EQ(r.links[3].parent, 0);
  EXPECT_EQ(r.links[3].row.a, 4);
  EXPECT_EQ(r.links[2].name, "link_3");
  put("Robots/tree.rbt", robot(0, tree));
  EXPECT_EQ(refusal("Robots/tree.rbt").substr(0, 67),
            "tree.rbt:5:332: a serial robot (type 0) has a branch. Robots with b");
  std::string deep;
  constexpr int kDepth = 5000;
  for (int i = 0; i < kDepth; ++i) deep += "{ " + link(0.1) + "\n";
  put("Robots/deep.rbt", robot(1, deep + std::string(kDepth, '}')));
  EXPECT_EQ(get<model::Robot>(load("Robots/deep.rbt")).links.back().parent, kDepth - 2);
  put("Robots/deep.rbt", robot(1, deep + std::string(kDepth - 1, '}')));
  EXPECT_NE(refusal("Robots/deep.rbt").find("the file ends where { or } should be"),
            std::string::npos);
}

TEST_F(LegacyWorld, APrismaticLinkMovesByMetresAndSaysThatThisIsNotProven) {
  edit("Robots/reacher.rbt", "-180.00000000, 180.00000000, -15.00000000, 0.00000000",
       "-0.1, 0.25, 0.05, 0");
  std::string s = text("Robots/reacher.rbt");
  s.replace(s.rfind("Revolute"), 8, "Prismatic");
  put("Robots/reacher.rbt", s);
  const auto& r = get<model::Robot>(load("Robots/reacher.rbt"));
  EXPECT_EQ(r.links[2].joint, model::JointKind::prismatic);
  EXPECT_DOUBLE_EQ(r.links[2].row.theta, 5 * kPerDegree);
  EXPECT_EQ(r.links[2].row.d, 0) << "its value is d";
  EXPECT_EQ(r.links[2].upper, 0.25);
  EXPECT_EQ(r.poses[0].q[2], 0.05);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[0].find("no file of the 2006 program with a Prismatic link is known"),
            std::string::npos);
}

TEST_F(LegacyWorld, ALineRunsAsItsSectionSays) {
  // 0.3 m at 0.12 m/s, a fifth of the time to speed up and to slow down: 0.3 / (0.12 0.8) s.
  const AnyId id = load("Trajectories/stroke.tjc");
  const auto& t = get<model::Trajectory>(id);
  EXPECT_EQ(t.description, "along the board");
  const auto p = path(id);
  const double T = 3.125, a = 0.12 / (0.2 * T);
  EXPECT_NEAR(p->duration(), T, 1e-12);
  EXPECT_EQ(p->sample_times(t.sample_time).size(), 126U) << "125 steps";
  EXPECT_NEAR(path_sample(*p, 0.3).pose.p[1], a * 0.09 / 2, 1e-12);
  EXPECT_NEAR(path_sample(*p, 1).velocity[1], 0.12, 1e-12);
  EXPECT_NEAR(path_sample(*p, 2).pose.p[1], 0.12 * (2 - 0.1 * T), 1e-12);
  EXPECT_NEAR(path_sample(*p, 3).acceleration[1], -a, 1e-12);
  EXPECT_NEAR(path_sample(*p, T).pose.p[1], 0.3, 1e-12);
  EXPECT_TRUE(notes.empty());
}

/// The line of stroke.tjc, which also turns by yaw 90, pitch 30, roll -45 degrees: 105 degrees in
/// all, since 90^2 + 30^2 + 45^2 = 105^2, from 0.4 degrees/s on.
std::string turning_line() {
  return R"("turning" "" 0 126 3.125
 0 0
( 0, 0, 0, 0, 0, 0 ) 0 3 0
{ "straight" 0 0 1 4 5 1 1 2 125 2 3.125 0.12 0 0 0 0.4 0 0.2 0.2
Cartesian
 [ ( 0, 0, 0, 0, 0, 0 ) 0 3 0
   ( 0 0 0 ) ( 0 0 0 ) ( 0.34285714 0.11428571 -0.17142857 ) ( 0 0 0 ) ( 0 0.192 0 ) 0,
   ( 0, 0.3, 0, 90, 30, -45 ) 0 3 0
   ( 0 0.3 0 ) ( 90 30 -45 ) ( 57.25714286 19.08571429 -28.62857143 ) ( 0 0 0 ) ( 0 -0.192 0 ) 3.125 ]
})";
}

TEST_F(LegacyWorld, AnglesThatChangeAtTheirOwnPaceRunWithAConstantAcceleration) {
  put("Trajectories/turning.tjc", turning_line());
  const AnyId id = load("Trajectories/turning.tjc");
  EXPECT_TRUE(notes.empty());
  const auto p = path(id);
  const double T = 3.125, k0 = 0.4 / 105;
  EXPECT_NEAR(p->duration(), T, 1e-12);
  for (int i = 0; i <= 20; ++i) {
    const double t = T * i / 20, s = k0 * t + (1 - k0 * T) * (t / T) * (t / T);
    const PathSample here = path_sample(*p, t);
    const auto R =
        spatial::from_rpy({-45 * kPerDegree * s, 30 * kPerDegree * s, 90 * kPerDegree * s});
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(here.pose.R[k], R[k], 1e-9) << t;
    if (i == 0 || i == 20) continue;
    // The angular velocity against differences of the orientation.
    constexpr double h = 1e-5;
    const Vec3 turn =
        spatial::rotation_difference(path_sample(*p, t - h).pose.R, path_sample(*p, t + h).pose.R);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(here.angular_velocity[k], turn[k] / (2 * h), 1e-7) << t;
    const Vec3 before = path_sample(*p, t - h).angular_velocity,
               after = path_sample(*p, t + h).angular_velocity;
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(here.angular_acceleration[k], (after[k] - before[k]) / (2 * h), 1e-7) << t;
  }
  // The way is that of the same line without the turn.
  const auto straight = path(load("Trajectories/stroke.tjc"));
  EXPECT_NEAR(path_sample(*p, 1).pose.p[1], path_sample(*straight, 1).pose.p[1], 1e-12);
}

TEST_F(LegacyWorld, TurnsOfMoreThanHalfACircleAreKeptAndTheTrajectorysFrameCarriesThem) {
  // The same three angles, yaw by another full turn; seen from a frame that is turned itself.
  std::string s = turning_line();
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = s.find(from, at)) != std::string::npos; at += to.size())
      s.replace(at, from.size(), to);
  };
  replace("90, 30, -45", "450, 30, -45");
  replace("( 90 30 -45 )", "( 450 30 -45 )");
  replace("( 0.34285714 0.11428571 -0.17142857 )", "( 0 0 0 )");
  replace(" 0.4 0 0.2", " 0 0 0.2");
  replace("57.25714286 19.08571429 -28.62857143", "288 19.2 -28.8");  // 2 / 3.125 of the angles
  replace("( 0, 0, 0, 0, 0, 0 ) 0 3 0\n{", "( 1, 2, 0, 0, 90, 0 ) 0 3 0\n{");
  put("Trajectories/turning.tjc", s);
  const auto p = path(load("Trajectories/turning.tjc"));
  const auto frame = spatial::from_rpy({0, 90 * kPerDegree, 0});
  for (const double x : {0.0, 0.3, 0.7, 1.0}) {
    const double w = x * x;
    const Pose seen = spatial::compose(
        Pose{frame, {}},
        Pose{spatial::from_rpy({-45 * kPerDegree * w, 30 * kPerDegree * w, 450 * kPerDegree * w}),
             {}});
    const PathSample here = path_sample(*p, 3.125 * x);
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(here.pose.R[k], seen.R[k], 1e-9) << x;
  }
}

TEST_F(LegacyWorld, AnglesThatAreNotThoseOfTheKnownSectionAreRefused) {
  const struct {
    const char *from, *to, *sentence;
  } cases[] = {
      {"57.25714286", "57.3", "the rates of the angles at its points are not those of a constant"},
      {" 0.4 0 0.2", " 80 0 0.2", "turns by 105 degrees in 3.125 s, but starts at 80 degrees/s"},
      {"( 90 30 -45 )", "( 90 30 45 )", "the angles of a point are not roll, pitch and yaw"},
      {"-45 ) 0 3 0", "-45 ) 0 0 0", "the angles of a point are not roll, pitch and yaw"},
  };
  for (const auto& c : cases) {
    put("Trajectories/turning.tjc", turning_line());
    edit("Trajectories/turning.tjc", c.from, c.to);
    EXPECT_NE(refusal("Trajectories/turning.tjc").find(c.sentence), std::string::npos) << c.to;
  }
  std::string arc = text("Trajectories/half turn.tjc");
  arc.replace(arc.find("4 5 1 0 0"), 9, "4 5 1 1 2");
  put("Trajectories/turning.tjc", arc);
  EXPECT_NE(refusal("Trajectories/turning.tjc").find("1 2 are known for lines only"),
            std::string::npos);
}

TEST_F(LegacyWorld, AnArcGoesThroughItsThreePointsAtTheSpeedOfTheFile) {
  const AnyId id = load("Trajectories/half turn.tjc");
  const auto p = path(id);
  const double T = kPi * 0.1 / 0.075;
  EXPECT_NEAR(p->duration(), T, 1e-12);
  EXPECT_EQ(p->sample_times(get<model::Trajectory>(id).sample_time).size(), 101U);
  const PathSample middle = path_sample(*p, T / 2);
  EXPECT_NEAR(middle.pose.p[0], 0.1, 1e-12);
  EXPECT_NEAR(middle.pose.p[1], 0.1, 1e-12);
  EXPECT_NEAR(middle.velocity[0], 0.1, 1e-12);
  for (int i = 0; i <= 50; ++i) {
    const Vec3 x = path_sample(*p, T * i / 50).pose.p;
    EXPECT_NEAR(std::hypot(x[0] - 0.1, x[1]), 0.1, 1e-12);
  }
}

TEST_F(LegacyWorld, AStoredSectionIsATrajectoryOfOneSegment) {
  const AnyId id = load("Trajectories/bow.stn");
  EXPECT_EQ(id.kind, Kind::trajectory);
  EXPECT_NEAR(path(id)->length(), kPi * 0.1, 1e-12);
  EXPECT_TRUE(notes.empty());
  // In braces it is a section of a trajectory; no such file of that program is known.
  put("Trajectories/braced.stn", "{ " + text("Trajectories/bow.stn") + " }");
  EXPECT_NEAR(path(load("Trajectories/braced.stn"))->length(), kPi * 0.1, 1e-12);
  ASSERT_GE(notes.size(), 1U);
  EXPECT_NE(notes[0].find("no .stn file of the 2006 program is in braces"), std::string::npos);
  put("Trajectories/braced.stn", text("Trajectories/bow.stn") + " }");
  EXPECT_NE(refusal("Trajectories/braced.stn").find("there is more after the end"),
            std::string::npos);
}

TEST_F(LegacyWorld, ACircleGoesRoundInItsTimeAndATurnOnTheSpotFollows) {
  const AnyId id = load("Trajectories/loop.tjc");
  EXPECT_TRUE(notes.empty());
  const auto p = path(id);
  ASSERT_EQ(p->segment_count(), 2U);
  EXPECT_NEAR(p->duration(), 6, 1e-12);
  EXPECT_EQ(p->sample_times(get<model::Trajectory>(id).sample_time).size(), 121U);
  // A fifth of the 4 s to speed up and to slow down; the ninth number (0.25) does not matter.
  const double r = 0.1, v = 2 * kPi * r / (4 * 0.8), a = v / 0.8;
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.1 * i, u = std::min(t, 4 - t);
    double way = u < 0.8 ? a * u * u / 2 : v * (u - 0.4);
    if (t > 2) way = 2 * kPi * r - way;
    const PathSample here = path_sample(*p, t);
    EXPECT_NEAR(here.pose.p[0], r * std::cos(way / r), 1e-12) << t;
    EXPECT_NEAR(here.pose.p[1], r * std::sin(way / r), 1e-12) << t;
    EXPECT_NEAR(here.velocity[1], std::min(a * u, v) * std::cos(way / r), 1e-12) << t;
    EXPECT_NEAR(here.pose.R[1], 0, 1e-12) << "whatever the middle point says";
  }
  // A quarter turn in 2 s with shares of 0.25: 60 degrees/s at most.
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.1 * i, u = std::min(t, 2 - t);
    double angle = u < 0.5 ? 60 * u * u : 60 * (u - 0.25);
    if (t > 1) angle = 90 - angle;
    const PathSample here = path_sample(*p, 4 + t);
    const auto R = spatial::from_rpy({0, 0, angle * kPerDegree});
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(here.pose.R[k], R[k], 1e-12) << t;
    EXPECT_NEAR(here.angular_velocity[2], std::min(120 * u, 60.0) * kPerDegree, 1e-12) << t;
    EXPECT_NEAR(here.pose.p[0], r, 1e-12);
    EXPECT_EQ(spatial::norm(here.velocity), 0);
  }
}

TEST_F(LegacyWorld, ASectionThatNeitherMovesNorTurnsIsAWait) {
  // A turn by nothing; angles that stay; no turn at all.
  put("Trajectories/still.tjc", text("Trajectories/loop.tjc"));
  edit("Trajectories/still.tjc", "90.00000000, 0.00000000, 0.00000000 ) 0 3 0",
       "0, 0.00000000, 0.00000000 ) 0 3 0");
  edit("Trajectories/still.tjc", "( 90.00000000 0.00000000 0.00000000 )", "( 0 0 0 )");
  const std::string still = text("Trajectories/still.tjc");
  for (const char* codes : {"0 1 1 0 0 1 4 4", "0 0 1 0 0 1 1 2", "0 0 1 0 0 1 0 0"}) {
    put("Trajectories/still.tjc", still);
    edit("Trajectories/still.tjc", "0 1 1 0 0 1 4 4", codes);
    const auto p = path(load("Trajectories/still.tjc"));
    EXPECT_NEAR(p->duration(), 6, 1e-12) << codes;
    const PathSample here = path_sample(*p, 5);
    EXPECT_NEAR(here.pose.p[0], 0.1, 1e-12) << codes;
    EXPECT_LT(spatial::norm(here.velocity), 1e-12) << codes;
    EXPECT_EQ(spatial::norm(here.angular_velocity), 0) << codes;
  }
}

TEST_F(LegacyWorld, AnArcWithAConstantAccelerationStartsAtRestOrAtItsSpeed) {
  const double length = 0.1 * kPi;
  auto p = path(load("Trajectories/gaining.tjc"));
  EXPECT_TRUE(notes.empty());
  EXPECT_NEAR(p->duration(), 2, 1e-12);
  for (const double t : {0.5, 1.0, 1.9}) {
    const Vec3 x = path_sample(*p, t).pose.p;
    EXPECT_NEAR(std::atan2(x[1], 0.1 - x[0]), length * t * t / 4 / 0.1, 1e-9) << t;
    EXPECT_NEAR(spatial::norm(path_sample(*p, t).velocity), length * t / 2, 1e-12) << t;
  }
  // The third number is the speed at the start, and the first point repeats it.
  const std::string at_rest = "2.00000000 0.00000000 0.00000000";
  edit("Trajectories/gaining.tjc", at_rest, "2.00000000 0.00000000 0.05");
  EXPECT_NE(refusal("Trajectories/gaining.tjc")
                .find("starts at 0.05 m/s by the third number of its times, but at 0 m/s by its "
                      "first point"),
            std::string::npos);
  edit("Trajectories/gaining.tjc", "( 0.00000000 0.00000000 0.00000000 ) ( 0.00000000 0.15707963",
       "( 0 0.05 0 ) ( 0.00000000 0.15707963");
  p = path(load("Trajectories/gaining.tjc"));
  EXPECT_NEAR(path_sample(*p, 0).velocity[1], 0.05, 1e-12);
  EXPECT_NEAR(spatial::norm(path_sample(*p, 2).velocity), length - 0.05, 1e-12);
}

TEST_F(LegacyWorld, UnionsReplaceTheEndsOfTwoSectionsOrJoinThem) {
  const AnyId id = load("Trajectories/joined.tjc");
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(
      notes[0].find("the file says 58 samples in 5.7 s; its sections give 56 in 5.5 s, since it "
                    "counts the samples at both ends of the replaced part of a union twice."),
      std::string::npos)
      << notes[0];
  const auto& t = get<model::Trajectory>(id);
  const auto p = path(id);
  ASSERT_EQ(p->segment_count(), 5U);
  EXPECT_NEAR(p->duration(), 5.5, 1e-12);
  EXPECT_EQ(p->sample_times(t.sample_time).size(), 56U);
  // 0.29 of 20 samples and of 10 are 6 and 3: the line is left at 1.4 s, the wait joined at 2.3 s.
  const auto cubic = [](double x, double T, double p0, double p1, double v0, double v1) {
    const double s = x / T;
    return p0 + v0 * x + (3 * (p1 - p0) - (2 * v0 + v1) * T) * s * s +
           ((v0 + v1) * T - 2 * (p1 - p0)) * s * s * s;
  };
  for (int i = 0; i <= 110; ++i) {
    const double x = 0.05 * i;
    Vec3 expected{};
    if (x <= 1.4) expected = {0.1 * x, 0, 0};
    else if (x <= 2.3) expected = {cubic(x - 1.4, 0.9, 0.14, 0.2, 0.1, 0), 0, 0};
    else if (x <= 3) expected = {0.2, 0, 0};
    else if (x <= 3.5) expected = {0.2, cubic(x - 3, 0.5, 0, 0.1, 0, 0.1), 0};
    else expected = {0.2, 0.1 + 0.1 * (x - 3.5), 0};
    const PathSample here = path_sample(*p, x);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(here.pose.p[k], expected[k], 1e-12) << x;
  }
  EXPECT_NEAR(path_sample(*p, 1.4).velocity[0], 0.1, 1e-12);
  EXPECT_NEAR(spatial::norm(path_sample(*p, 2.6).velocity), 0, 1e-12);
  // The trajectory's frame carries places and velocities.
  const std::string joined = text("Trajectories/joined.tjc");
  const std::string zero =
      "( 0.00000000, 0.00000000, 0.00000000, 0.00000000, 0.00000000, 0.00000000 )";
  edit("Trajectories/joined.tjc", zero, "( 1, 0, 0, 90, 0, 0 )");
  const auto turned = path(load("Trajectories/joined.tjc"));
  for (const double x : {1.0, 1.9, 2.5, 3.3, 5.0}) {
    const PathSample here = path_sample(*p, x), there = path_sample(*turned, x);
    EXPECT_NEAR(there.pose.p[0], 1 - here.pose.p[1], 1e-12) << x;
    EXPECT_NEAR(there.pose.p[1], here.pose.p[0], 1e-12) << x;
    EXPECT_NEAR(there.velocity[0], -here.velocity[1], 1e-12) << x;
  }
  // Saved as a native file it is the same trajectory, waits and all.
  bench.document.clear();
  put("Trajectories/joined.tjc", joined);
  const AnyId alone = load("Trajectories/joined.tjc");
  auto tx = bench.document.begin("save");
  (void)unwrap(io::save(*tx, alone, folder / "joined.tjc", {}));
  ASSERT_TRUE(tx->commit().ok());
  const auto digest = bench.document.content_digest();
  bench.document.clear();
  auto back = bench.document.begin("load");
  const auto again = io::load(*back, folder / "joined.tjc", {});
  ASSERT_TRUE(again.ok()) << again.error().sentence();
  ASSERT_TRUE(back->commit().ok());
  EXPECT_EQ(bench.document.content_digest(), digest);
}

TEST_F(LegacyWorld, WhatIsNotKnownOfCirclesTurnsAndUnionsIsRefused) {
  const struct {
    const char *file, *from, *to, *sentence;
  } cases[] = {
      {"loop", "0 0 3 4 4 1 0 0", "0 0 7 4 4 1 0 0",
       "loop.tjc:6:14: section 1 \"loop\": the curve's code 7 (Bezier curve) is not known."},
      {"loop", "0 0 3 4 4 1 0 0", "0 0 3 2 4 1 0 0",
       "the fourth and fifth code (motion law) 2 4 (trapezoid that only speeds up) are not known"},
      {"loop", "0 0 3 4 4 1 0 0", "0 0 3 9 4 1 0 0",
       "the fourth and fifth code (motion law) 9 4 are not known"},
      {"loop", "0 0 3 4 4 1 0 0", "0 1 3 4 4 1 0 0",
       "the codes 0 1 3 4 4 1 0 0 are not known together. A rotation in place is 0 1 1 0 0 1 4 4"},
      {"loop", "0 1 1 0 0 1 4 4", "0 0 1 0 0 1 4 4",
       "the codes 0 0 1 0 0 1 4 4 are not known together"},
      {"loop", "0 0 3 4 4 1 0 0", "1 0 3 4 4 1 0 0", "the first code 1 is not known"},
      {"loop", "0.20000000 0.25000000", "0.60000000 0.25000000", "speeds up for 0.6 of its time"},
      {"loop", "80 3 4.00000000", "80 3 0.00000000", "section 1 \"loop\" takes 0 s"},
      {"loop", "80 3 4.00000000", "80 2 4.00000000", "has 2 points. A circle has 3."},
      {"loop", "80 3 4.00000000", "80 3 1e300", "and an acceleration of 0. Check its time"},
      {"loop", "0.20000000 0.25000000", "1e-320 0.25000000", "and an acceleration of inf"},
      {"loop", "40 2 2.00000000", "40 2 1e300", "section 2 \"turn\" has a speed of"},
      {"loop", "0.25000000 0.25000000", "0.25000000 0.20000000", "0.25 and 0.2, differ"},
      {"loop", "90.00000000, 0.00000000, 0.00000000 ) 0 3 0",
       "90.00000000, 0.00000000, 1.00000000 ) 0 3 0", "are not roll, pitch and yaw"},
      {"joined", "\"SUSG\"", "\"XUSG\"",
       "union section 1: the kind \"XUSG\" is not known. Known are SUSG"},
      {"joined", "\"NUSG\" 0", "\"NUSG\" 3", "union section 2: the code 3 is not known"},
      {"joined", "0.90000000 0.29", "0.95000000 0.29",
       "union section 1 takes 0.95 s, but what it replaces of section 1 \"out\" and section 2 "
       "\"wait\" takes 0.9 s"},
      {"joined", "0.29000000 9", "1.29000000 9", "replaces 1.29 of its neighbours"},
      {"joined", "0.50000000 0.30000000 5", "0.00000000 0.30000000 5",
       "union section 2 takes 0 s and has 5 samples"},
      {"joined", "#Union Section Number 2:", "\"", "{ before a union section"},
      {"joined", "20 2 2.00000000", "20 2 -2.0000000", "section 1 \"out\" takes -2 s"},
      {"joined", "\" 1 58", "\" 0 58", "the second code"},
      {"joined", "0.30000000 5 \n}", "0.30000000 5 \n},\n{ \"NUSG\" 0 1 1 9 }",
       "a union section has no two sections to join"},
      {"stroke", "\" 0 126", "\" 1 126", "{ before a union section"},
  };
  for (const auto& c : cases) {
    const std::string name = std::string("Trajectories/") + c.file + ".tjc", good = text(name);
    edit(name, c.from, c.to);
    const std::string said = refusal(name);
    EXPECT_NE(said.find(c.sentence), std::string::npos) << c.to << "\n" << said;
    put(name, good);
  }
  // A union of what is no line at constant speed, or turns.
  const std::string joined = text("Trajectories/joined.tjc"), loop = text("Trajectories/loop.tjc");
  const auto from = loop.find("{ \"loop\""), to = loop.find("},");
  std::string s = joined;
  const auto first = s.find("{ \"out\""), end = s.find("},");
  put("Trajectories/mixed.tjc", s.replace(first, end - first, loop.substr(from, to - from)));
  EXPECT_NE(refusal("Trajectories/mixed.tjc")
                .find("union section 1 joins section 1 \"loop\", which is not a line, or rotates"),
            std::string::npos);
  // A union between different orientations.
  put("Trajectories/joined.tjc", joined);
  for (const char* y : {"0.10000000", "0.30000000"})
    edit("Trajectories/joined.tjc", "( 0.20000000, " + std::string(y) + ", 0.00000000, 0.00000000",
         "( 0.20000000, " + std::string(y) + ", 0.00000000, 5.00000000");
  EXPECT_NE(refusal("Trajectories/joined.tjc")
                .find("union section 2 joins sections of different orientations"),
            std::string::npos);
}

TEST_F(LegacyWorld, BlanksAroundAFilesNameAreNoPartOfTheRecords) {
  put("Trajectories/ along .tjc", text("Trajectories/stroke.tjc"));
  const AnyId id = load("Trajectories/ along .tjc");
  EXPECT_EQ(bench.document.now()->find(id)->name, "along");
}

TEST_F(LegacyWorld, SectionsFollowEachOtherAndTheTrajectorysFrameCarriesThem) {
  std::string s = text("Trajectories/stroke.tjc"), second = s.substr(s.find("#Section"));
  for (std::size_t at = 0; (at = second.find(" 0.30000000", at)) != std::string::npos;)
    second.replace(at, 11, " 0.60000000");
  // From 0.3 on, as the first ends there.
  const auto start = second.find("[\n") + 2;
  const std::size_t comma = second.find(", 0.00000000, 0.00000000", start);
  second.replace(comma, 12, ", 0.30000000");
  const std::size_t again = second.find("( 0.00000000 0.00000000 0.00000000 )", start);
  second.replace(again, 36, "( 0.00000000 0.30000000 0.00000000 )");
  const std::string zero =
      "( 0.00000000, 0.00000000, 0.00000000, 0.00000000, 0.00000000, 0.00000000 )";
  s.replace(s.find(zero), zero.size(), "( 1, 0, 0, 90, 0, 0 )");
  put("Trajectories/two.tjc", s + second);
  const auto p = path(load("Trajectories/two.tjc"));
  EXPECT_NEAR(p->duration(), 6.25, 1e-12);
  const Vec3 end = path_sample(*p, 6.25).pose.p;  // y of the sections is -x there
  EXPECT_NEAR(end[0], 1 - 0.6, 1e-12);
  EXPECT_NEAR(end[1], 0, 1e-12);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("the file says 126 samples in 3.125 s; its sections give 251 in 6.25 s"),
            std::string::npos)
      << notes[0];
}

TEST_F(LegacyWorld, UnknownCodesAreRefusedByNameAndPlace) {
  const struct {
    const char *from, *to, *sentence;
  } cases[] = {
      {"0 0 1 4 5 1 0 0 125", "0 0 9 4 5 1 0 0 125",
       "stroke.tjc:6:18: section 1 \"straight\": the curve's code 9 is not known. Known are 1 "
       "(line), 2 (arc through three points) and 3 (full circle through three points)."},
      {"0 0 1 4 5 1 0 0 125", "0 0 1 1 5 1 0 0 125",
       "stroke.tjc:6:20: section 1 \"straight\": the fourth and fifth code (motion law) 1 5 "
       "(constant acceleration) are not known. Known are 0 0 (constant speed), 1 2 (constant "
       "acceleration), 4 4 and 4 5 (the speed is a trapezoid in time)."},
      {"0 0 1 4 5 1 0 0 125", "0 0 1 4 5 1 1 3 125",
       "stroke.tjc:6:24: section 1 \"straight\": the sixth to eighth code (orientation) 1 1 3 are "
       "not known. Known are 10 10 10 and 1 0 0 (the tool keeps its orientation), 1 1 2 (its "
       "angles change in proportion, with a constant acceleration) and 1 4 4 (it rotates in place, "
       "with a trapezoidal rate)."},
      {"0 0 1 4 5 1 0 0 125", "0 7 1 4 5 1 0 0 125",
       "stroke.tjc:6:16: section 1 \"straight\": the second code 7 is not known. Known are 0 "
       "(timed by the path) and 1 (timed by the rotation)."},
      {"Cartesian", "Joint",
       "stroke.tjc:8:1: section 1 \"straight\": the space \"Joint\" is not known. In all known "
       "files it is Cartesian."},
      {"0.20000000 0.20000000 \n", "0.20000000 0.30000000 \n",
       "stroke.tjc:6:36: section 1 \"straight\": the last two numbers of its times, 0.2 and 0.3, "
       "differ. In all known files they are the same, so their meaning is unclear."},
      {"3.12500000 0.12000000", "3.12500000 0.25000000",
       "stroke.tjc:6:36: section 1 \"straight\" is 0.3 m long, but its speed of 0.25 m/s and its "
       "time of 3.125 s are those of 0.625 m. Speed x time x (1 - fraction of the time for "
       "acceleration) must be the length."},
      {"125 2 3.125", "125 3 3.125",
       "stroke.tjc:6:34: section 1 \"straight\" has 3 points. A line has 2."},
      {"0.30000000, 0.00000000, 0.00000000, 0.00000000, 0.00000000 ) 0 3 0",
       "0.30000000, 0.00000000, 10.0000000, 0.00000000, 0.00000000 ) 0 3 0",
       "stroke.tjc:6:3: section 1 \"straight\" has points of different orientations. By its "
       "sixth to eighth code (1 0 0) the tool keeps its orientation."},
      {"\" 0 126", "\" 4 126",
       "stroke.tjc:1:27: the trajectory's code 4 is not known. 0 means sections only, 1 means "
       "sections followed by unions."},
  };
  const std::string good = text("Trajectories/stroke.tjc");
  for (const auto& c : cases) {
    put("Trajectories/stroke.tjc", good);
    edit("Trajectories/stroke.tjc", c.from, c.to);
    EXPECT_EQ(refusal("Trajectories/stroke.tjc"), c.sentence);
  }
  put("Trajectories/stroke.tjc", good);
  const std::string robot = text("Robots/reacher.rbt"), world = text("Worlds/bench.wld");
  edit("Robots/reacher.rbt", " 0\n(", " 2\n(");
  EXPECT_EQ(refusal("Robots/reacher.rbt"),
            "reacher.rbt:3:2: the robot's type 2 is not known. 0 is serial, 1 hyper-branched.");
  put("Robots/reacher.rbt", robot);
  edit("Robots/reacher.rbt", "Revolute", "Spherical");
  EXPECT_NE(refusal("Robots/reacher.rbt").find("there is no joint \"Spherical\""),
            std::string::npos);
  put("Robots/reacher.rbt", robot);
  edit("Worlds/bench.wld", "Fixed", "Moving");
  EXPECT_EQ(refusal("Worlds/bench.wld"),
            "bench.wld:13:1: the kind of base \"Moving\" is not known. There are Fixed, Free "
            "Flying, Free Floating and Serpentine.");
  put("Worlds/bench.wld", world);
  edit("Worlds/bench.wld", "21.81276974, ", "");
  EXPECT_EQ(refusal("Worlds/bench.wld"),
            "bench.wld:12:3: robot \"reacher\" has 2 joint values, but 3 links. Each link has one "
            "joint value.");
  put("Worlds/bench.wld", world);
  edit("Worlds/bench.wld", "stroke.tjc\"", "stroke.rbt\"");
  EXPECT_NE(
      refusal("Worlds/bench.wld").find("there is no file \"./Saves/Trajectories/stroke.rbt\""),
      std::string::npos);
  put("Worlds/bench.wld", world);
  edit("Worlds/bench.wld", "Trajectories/stroke.tjc", "Robots/reacher.rbt");
  EXPECT_NE(refusal("Worlds/bench.wld").find("holds a robot, but trajectory \"stroke\" needs"),
            std::string::npos);
}

TEST_F(LegacyWorld, AWorldLoadsAndItsRobotStandsAtTheStartOfItsTrajectoryAndFollowsIt) {
  const AnyId id = load("Worlds/bench.wld");
  ASSERT_EQ(id.kind, Kind::world);
  const auto& w = get<model::World>(id);
  EXPECT_EQ(w.description, "a small bench");
  ASSERT_EQ(w.objects.size(), 1U);
  EXPECT_EQ(w.objects[0].name, "table top");
  ASSERT_EQ(w.robots.size(), 1U);
  EXPECT_EQ(w.robots[0].name, "reacher");
  ASSERT_EQ(w.trajectories.size(), 2U);
  EXPECT_EQ(w.trajectories[1].name, "half turn");
  const auto& q = w.robots[0].q;
  ASSERT_EQ(q.size(), 3U);
  EXPECT_NEAR(q[1], (253.66517722 - 360) * kPerDegree, 1e-12) << "full turns that leave the limits";
  const double a = q[0], b = a + q[1], c = b + q[2];
  EXPECT_NEAR(0.4 * std::cos(a) + 0.3 * std::cos(b) + 0.1 * std::cos(c), 0.5, 1e-8);
  EXPECT_NEAR(0.4 * std::sin(a) + 0.3 * std::sin(b) + 0.1 * std::sin(c), -0.15, 1e-8);
  NoProgress progress;
  const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
  for (const char* name : {"stroke", "half turn"}) {
    const auto r = unwrap(simulator.inverse_dynamics(
        {.world = WorldId{id.number}, .robot = "reacher", .trajectory = name}, progress));
    ASSERT_TRUE(r);
    EXPECT_EQ(r->rows(), name == std::string("stroke") ? 126U : 101U);
    EXPECT_NEAR(r->find("q1")->values.front(),
                name == std::string("stroke") ? a : r->find("q1")->values.front(), 1e-6);
    EXPECT_NEAR(r->find("z")->values.back(), 0.2, 1e-9);
  }
  expect_same_from_native_files(id, 5);
}

TEST_F(LegacyWorld, BasesAreOfFourKindsAndMayFollowATrajectory) {
  const std::string world = text("Worlds/bench.wld");
  const std::pair<const char*, model::BaseKind> kinds[] = {
      {"Free Flying", model::BaseKind::free_flying},
      {"Free Floating", model::BaseKind::free_floating},
      {"Serpentine", model::BaseKind::serpentine}};
  for (const auto& [words, kind] : kinds) {
    put("Worlds/bench.wld", world);
    edit("Worlds/bench.wld", "Fixed", words);
    const auto& w = get<model::World>(load("Worlds/bench.wld"));
    EXPECT_EQ(w.robots[0].base, kind);
    EXPECT_TRUE(w.robots[0].base_trajectory.empty());
    EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& n) {
      return n.find("the file names no trajectory for it") != std::string::npos;
    }));
  }
  bench.document.clear();
  put("Worlds/bench.wld", world);
  edit("Worlds/bench.wld", "Fixed",
       "Free Floating \"./Saves/Trajectories/stroke.tjc\" \"drive\" ( 0.1, 0, 0, 0, 0, 0 ) 0 3 0");
  const AnyId id = load("Worlds/bench.wld");
  const auto& w = get<model::World>(id);
  EXPECT_EQ(w.robots[0].base_trajectory, "drive");
  ASSERT_EQ(w.trajectories.size(), 3U);
  EXPECT_EQ(w.trajectories[0].name, "drive");
  EXPECT_DOUBLE_EQ(w.trajectories[0].placement.position[0], 0.1);
  expect_same_from_native_files(id, 1);
}

TEST_F(LegacyWorld, ATrajectoryInMillimetresIsTheSameAsInMetres) {
  const auto metres = path(load("Trajectories/stroke.tjc"));
  std::string s = text("Trajectories/stroke.tjc");
  // Every length, speed and acceleration of it in millimetres: those are the numbers along y.
  const auto all = [&](const std::string& from, const std::string& to) {
    for (auto at = s.find(from); at != std::string::npos; at = s.find(from, at + to.size()))
      s.replace(at, from.size(), to);
  };
  const auto units = s.find(" 0 0\n");
  ASSERT_NE(units, std::string::npos) << s;
  s.replace(units, 5, " 3 0\n");
  all("0.30000000", "300.00000000");
  all("0.12000000", "120.00000000");
  put("Trajectories/stroke mm.tjc", s);
  const auto millimetres = path(load("Trajectories/stroke mm.tjc"));
  EXPECT_NEAR(metres->length(), 0.3, 1e-12);
  EXPECT_NEAR(millimetres->length(), 0.3, 1e-12);
  EXPECT_NEAR(millimetres->duration(), metres->duration(), 1e-12);
  for (const double t : {0.0, 0.3, 1.0, 2.9}) {
    EXPECT_NEAR(path_sample(*millimetres, t).velocity[1], path_sample(*metres, t).velocity[1],
                1e-12);
    EXPECT_NEAR(path_sample(*millimetres, t).pose.p[1], path_sample(*metres, t).pose.p[1], 1e-12);
  }
}

TEST_F(LegacyWorld, EveryFileOfTheOriginalLoads) {
  const fs::path data = original();
  if (data.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  const std::map<std::string, Kind> kinds{{".mtr", Kind::material},   {".csg", Kind::solid},
                                          {".obj", Kind::object},     {".rbt", Kind::robot},
                                          {".tjc", Kind::trajectory}, {".stn", Kind::trajectory},
                                          {".wld", Kind::world}};
  std::map<std::string, std::size_t> read;
  for (const auto& entry : fs::recursive_directory_iterator(data)) {
    const auto kind = kinds.find(entry.path().extension().string());
    if (kind == kinds.end()) continue;
    auto tx = bench.document.begin("load");
    const auto loaded = io::load(*tx, entry.path(), {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    ASSERT_TRUE(tx->commit().ok()) << entry.path();
    // A .csg of several materials is an object.
    EXPECT_TRUE(loaded->id.kind == kind->second ||
                (kind->second == Kind::solid && loaded->id.kind == Kind::object))
        << entry.path();
    ++read[kind->first];
  }
  for (const auto& [extension, kind] : kinds) EXPECT_GT(read[extension], 0U) << extension;
}

TEST_F(LegacyWorld, TheTargetOfAWorldIsAFrame) {
  EXPECT_TRUE(get<model::World>(load("Worlds/bench.wld")).frames.empty()) << "it is at the origin";
  edit("Worlds/bench.wld", "( 0.00000000, 0.00000000, 0.00000000, 0.00000000,",
       "( 0.5, 0, 0.25, 90,");
  const auto& w = get<model::World>(load("Worlds/bench.wld"));
  ASSERT_EQ(w.frames.size(), 1U);
  EXPECT_EQ(w.frames[0].name, "target");
  EXPECT_EQ(w.frames[0].placement.position, (Vec3{0.5, 0, 0.25}));
  EXPECT_DOUBLE_EQ(w.frames[0].placement.angles[2], 90 * kPerDegree);
}

TEST_F(LegacyWorld, ReferencesAreFoundInSiblingFoldersWithoutAnInstallation) {
  fs::rename(folder / "Saves", folder / "Copies");
  auto tx = bench.document.begin("load");
  const auto loaded = io::load(*tx, folder / "Copies/Worlds/bench.wld", {});
  ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  EXPECT_EQ(loaded->id.kind, Kind::world);
}

TEST_F(LegacyWorld, AByteOfZeroIsNoText) {
  std::string s = text("Trajectories/stroke.tjc");
  s[s.find("board")] = '\0';
  put("Trajectories/stroke.tjc", s);
  EXPECT_EQ(refusal("Trajectories/stroke.tjc"),
            "stroke.tjc:1:20: this is a binary file, not a text. A text has no zero bytes.");
  s = text("Trajectories/half turn.tjc");
  put("Trajectories/half turn.tjc", s + std::string(1, '\0') + "more");
  EXPECT_NE(refusal("Trajectories/half turn.tjc").find("this is a binary file"), std::string::npos);
}

TEST_F(LegacyWorld, AFileThatEndsAnywhereIsRefused) {
  for (const char* name :
       {"Worlds/bench.wld", "Robots/reacher.rbt", "Trajectories/stroke.tjc", "Trajectories/bow.stn",
        "Trajectories/loop.tjc", "Trajectories/joined.tjc"}) {
    std::string whole = text(name);
    whole.resize(whole.find_last_of(")}"));
    const fs::path file = folder / "Saves" / fs::path(name).parent_path() / "cut.x";
    for (std::size_t n = 0; n <= whole.size(); n += 7) {
      rewrite(file, whole.substr(0, n));
      auto tx = bench.document.begin("load");
      EXPECT_FALSE(io::load(*tx, file, {}).ok()) << whole.substr(0, n);
      EXPECT_EQ(tx->now().size(), 0U);
    }
  }
}

TEST_F(LegacyWorld, TheWorldOfTheOriginalLoadsStandsAtItsTrajectoryAndFollowsIt) {
  const fs::path data = original();
  if (data.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  // In these the robot was saved in a pose of its own: its tool is more than 0.1 m from all of the
  // trajectory, at another height, so that no other reading of orientations brings it there. The
  // target of the worlds is elsewhere too.
  const std::set<std::string> kElsewhere{"Jarboter and Circle", "Jarboter and Line"};
  std::size_t worlds = 0;
  for (const auto& entry : fs::directory_iterator(data / "Saves/Worlds")) {
    if (entry.path().extension() != ".wld") continue;
    ++worlds;
    auto tx = bench.document.begin("load");
    const auto loaded = io::load(*tx, entry.path(), {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    ASSERT_TRUE(tx->commit().ok());
    const auto& w = get<model::World>(loaded->id);
    // One was saved empty.
    EXPECT_EQ(w.robots.size(), entry.path().stem() == "jarboterultimo" ? 0U : 1U) << entry.path();
    EXPECT_EQ(w.trajectories.size(), w.robots.size()) << entry.path();
    EXPECT_TRUE(w.objects.empty()) << entry.path();
    NoProgress progress;
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    for (const auto& placed : w.trajectories) {
      const auto& t = std::get<model::Trajectory>(snapshot->find(AnyId(placed.trajectory))->body);
      const auto& robot = w.robots.front();
      const auto model =
          unwrap(bench.derived.robot_model(*snapshot, robot.robot, {0, 0, -9.81}, progress));
      std::vector<Pose> frames(model->joints.size());
      robotics::forward_kinematics(*model, robot.q, frames);
      const Pose tip = robotics::tip_pose(*model, 0, frames),
                 start = spatial::compose(model::pose(placed.placement),
                                          path_sample(*path(AnyId(placed.trajectory)), 0).pose);
      const auto along = path(AnyId(placed.trajectory));
      if (kElsewhere.contains(entry.path().stem().string())) {
        double nearest = 1e300;
        for (const double x : along->sample_times(t.sample_time))
          nearest = std::min(
              nearest,
              spatial::distance(
                  tip.p,
                  spatial::compose(model::pose(placed.placement), path_sample(*along, x).pose).p));
        EXPECT_GT(nearest, 0.1) << entry.path();
      } else {
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(tip.p[k], start.p[k], 1e-6);
        for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(tip.R[k], start.R[k], 1e-6);
      }
      const auto r = unwrap(simulator.inverse_dynamics(
          {.world = WorldId{loaded->id.number}, .robot = robot.name, .trajectory = placed.name},
          progress));
      ASSERT_TRUE(r);
      const auto times = along->sample_times(t.sample_time);
      ASSERT_EQ(r->rows(), times.size());
      EXPECT_NEAR(r->find("time")->values.back(), along->duration(), 1e-9);
      // The robot does follow it.
      for (std::size_t i = 0; i < times.size(); ++i) {
        const Pose wanted =
            spatial::compose(model::pose(placed.placement), path_sample(*along, times[i]).pose);
        const char* const names[] = {"x", "y", "z"};
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_NEAR(r->find(names[k])->values[i], wanted.p[k], 1e-6) << times[i];
      }
      const auto all = unwrap(
          scene::build({*snapshot, bench.derived, bench.registry}, loaded->id, {}, progress));
      EXPECT_TRUE(all.left_out.empty()) << "everything of the world can be drawn";
      EXPECT_GT(all.scene.items.size(), 3U);
    }
  }
  EXPECT_GT(worlds, 0U);
}

TEST_F(LegacyWorld, TrajectoriesOfTheOriginalTakeTheTimesAndPlacesOfTheirFiles) {
  const fs::path data = original();
  if (data.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(data / "Saves/Trajectories")) {
    if (entry.path().extension() != ".tjc") continue;
    ++files;
    std::ifstream in(entry.path(), std::ios::binary);
    std::stringstream whole;
    whole << in.rdbuf();
    const std::string content = whole.str();
    // "name" "description" code samples time
    std::size_t at_number = 0;
    for (int quotes = 0; quotes < 4; ++at_number)
      if (content[at_number] == '"') ++quotes;
    int code = -1, samples = 0;
    double time = 0;
    ASSERT_EQ(std::sscanf(content.c_str() + at_number, "%d %d %lf", &code, &samples, &time), 3);
    auto tx = bench.document.begin("load");
    const auto loaded = io::load(*tx, entry.path(), {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    ASSERT_TRUE(tx->commit().ok());
    const auto& t = get<model::Trajectory>(loaded->id);
    const auto p = path(loaded->id);
    // A trajectory has one time between samples, its sections had their own; the note says so.
    const auto says = [&](const char* what) {
      return std::any_of(loaded->notes.begin(), loaded->notes.end(),
                         [&](const std::string& n) { return n.find(what) != std::string::npos; });
    };
    const bool is_even = !says("has samples every");
    if (code == 1) {
      // With unions the file counts two samples twice; its plot has the number and the end here.
      EXPECT_TRUE(says("counts the samples at both ends")) << entry.path();
      EXPECT_FALSE(is_even) << entry.path();
    } else {
      EXPECT_EQ(code, 0);
      EXPECT_NEAR(p->duration(), time, 1e-7) << entry.path();
      EXPECT_FALSE(says("its sections give")) << entry.path();
    }
    if (is_even) {
      EXPECT_EQ(p->sample_times(t.sample_time).size(), static_cast<std::size_t>(samples))
          << entry.path();
    }
    const PathSample start = path_sample(*p, 0), end = path_sample(*p, p->duration());
    const auto& back = t.segments.back();
    const auto &first = t.segments.front().points.front(),
               &last = back.shape.name == "circle" ? back.points.front() : back.points.back();
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(start.pose.p[k], first.position[k], 1e-9);
      EXPECT_NEAR(end.pose.p[k], last.position[k], 1e-9);
    }
    const Pose first_pose = model::pose(first), last_pose = model::pose(last);
    for (std::size_t k = 0; k < 9; ++k) {
      EXPECT_NEAR(start.pose.R[k], first_pose.R[k], 1e-9);
      EXPECT_NEAR(end.pose.R[k], last_pose.R[k], 1e-9);
    }
  }
  EXPECT_GT(files, 0U);
}

}  // namespace
}  // namespace robomosp

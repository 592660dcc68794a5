// SPDX-License-Identifier: Apache-2.0
// Replays: the page is read back by a decoder of its own, and its poses are those of forward
// kinematics to the steps they are kept in; where node is installed, the page's own scripts too.
#include "scene/replay.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/process.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/kinematics.h"
#include "scene/build.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/workbench.h"

namespace robomosp::scene {
namespace {

namespace fs = std::filesystem;
using test::unwrap;
using test::Workbench;

/// What stands in a page between a text that occurs once and the end of the element.
std::string element(const std::string& page, const std::string& start) {
  const std::size_t at = page.find(start);
  EXPECT_NE(at, page.npos) << start;
  const std::size_t from = at + start.size();
  return page.substr(from, page.find("</script>", from) - from);
}

std::string bytes_of_base64(const std::string& s) {
  std::string out;
  unsigned bits = 0;
  int count = 0;
  for (const char c : s) {
    if (c == '=') break;
    const unsigned digit = c >= 'A' && c <= 'Z'   ? static_cast<unsigned>(c - 'A')
                           : c >= 'a' && c <= 'z' ? static_cast<unsigned>(c - 'a' + 26)
                           : c >= '0' && c <= '9' ? static_cast<unsigned>(c - '0' + 52)
                           : c == '+'             ? 62U
                                                  : 63U;
    bits = (bits << 6U | digit) & 0xFFFFFFU;
    if ((count += 6) >= 8) {
      count -= 8;
      out += static_cast<char>(bits >> count & 0xFFU);
    }
  }
  return out;
}

/// The numbers behind every `"name":` of a header.
std::vector<double> numbers(const std::string& header, const std::string& name) {
  std::vector<double> out;
  const std::string key = "\"" + name + "\":";
  for (std::size_t at = header.find(key); at != header.npos; at = header.find(key, at + 1)) {
    const std::size_t from = at + key.size();
    const std::size_t end = header.find_first_of(",}]", from);
    if (const auto x = text::read_real(header.substr(from, end - from))) out.push_back(*x);
  }
  return out;
}
std::size_t count(const std::string& header, const std::string& name) {
  const auto all = numbers(header, name);
  EXPECT_EQ(all.size(), 1U) << name;
  return all.empty() ? 0 : static_cast<std::size_t>(all[0]);
}

/// Reads what Packer wrote.
struct Unpacker {
  std::string bytes;
  std::size_t at = 0;
  std::uint64_t whole() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; at < bytes.size(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(bytes[at++]);
      value |= static_cast<std::uint64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
    ADD_FAILURE() << "the data ends too early";
    return 0;
  }
  double next() {
    const std::uint64_t folded = whole();
    const double half = static_cast<double>(folded / 2);
    return folded % 2 == 1 ? -half - 1 : half;
  }
  std::vector<double> steps(std::size_t n) {
    std::vector<double> out(n);
    for (double& x : out) x = next();
    std::partial_sum(out.begin(), out.end(), out.begin());
    return out;
  }
  std::vector<double> bends(std::size_t n) {
    std::vector<double> out(n);
    for (double& x : out) x = next();
    if (n > 1) std::partial_sum(out.begin() + 1, out.end(), out.begin() + 1);
    std::partial_sum(out.begin(), out.end(), out.begin());
    return out;
  }
};

/// Everything in a page, in the units of the arrays it was made from.
struct Decoded {
  std::string header;
  struct MeshPart {
    std::vector<double> places[3], edges[3], triangles;
  };
  std::vector<MeshPart> meshes;
  std::vector<std::vector<double>> tracks;  ///< seven lists each
  std::vector<double> times;
  std::vector<std::vector<double>> columns;
};

Decoded decoded(const std::string& page) {
  Decoded d;
  d.header = element(page, "id=\"header\">");
  Unpacker in{bytes_of_base64(element(page, "id=\"bytes\">"))};
  const std::string& h = d.header;
  const auto vertices = numbers(h, "vertices"), triangles = numbers(h, "triangles"),
             polylines = numbers(h, "polylines");
  for (std::size_t m = 0; m < vertices.size(); ++m) {
    Decoded::MeshPart part;
    const auto n = static_cast<std::size_t>(vertices[m]);
    for (auto& axis : part.places) axis = in.steps(n);
    in.steps(n);
    in.steps(n);
    part.triangles = in.steps(3 * static_cast<std::size_t>(triangles[m]));
    std::size_t points = 0;
    for (double i = 0; i < polylines[m]; ++i) points += in.whole();
    for (auto& axis : part.edges) axis = in.steps(points);
    d.meshes.push_back(std::move(part));
  }
  const std::size_t frames = count(h, "frames");
  const double place = numbers(h, "position_step").at(0), turn = numbers(h, "rotation_step").at(0);
  for (std::size_t k = 0; k < 7 * count(h, "tracks"); ++k) {
    d.tracks.push_back(in.bends(frames));
    for (double& x : d.tracks.back()) x *= k % 7 < 3 ? place : turn;
  }
  for (const double points : numbers(h, "points"))
    for (int k = 0; k < 3; ++k) in.bends(static_cast<std::size_t>(points));
  const std::size_t samples = count(h, "samples");
  d.times = in.bends(samples);
  const double start = numbers(h, "start").at(0);
  for (double& t : d.times) t = start + t * numbers(h, "time_step").at(0);
  const auto low = numbers(h, "low"), high = numbers(h, "high");
  // Only those of columns are plain numbers; those of meshes are lists.
  for (std::size_t c = 0; c < high.size(); ++c) {
    d.columns.push_back(in.steps(samples));
    for (double& x : d.columns.back())
      x = x == 65535 ? std::nan("") : low[c] + x * (high[c] - low[c]) / 65534;
  }
  EXPECT_EQ(in.at, in.bytes.size());
  return d;
}

/// The PA-10's world, loaded once, and a recording of it that no trajectory limits.
struct ReplayTest : testing::Test {
  struct Loaded {
    Workbench bench;
    WorldId world{bench.load("worlds/pa10_circle.wld").number};
  };
  static Loaded& loaded() { return *loaded_; }
  static void SetUpTestSuite() { loaded_ = std::make_unique<Loaded>(); }
  static void TearDownTestSuite() { loaded_.reset(); }
  static std::unique_ptr<Loaded> loaded_;

  Workbench& bench = loaded().bench;
  NoProgress progress;
  WorldId world = loaded().world;
  recording::Recording recording = moving(61, 0.1);
  ReplayRequest request{.title = "PA-10 <swings> & \"stops\"", .camera = {}};

  recording::Recording moving(std::size_t rows, double step) const {
    recording::Recording r;
    r.title = "swing";
    r.world = world;
    r.robot = "pa10";
    r.dof = 7;
    r.columns.resize(8);
    r.columns[0] = {"time", "s", "", {}};
    for (std::size_t j = 1; j <= 7; ++j)
      r.columns[j] = {"q" + std::to_string(j), "rad", "joint \"" + std::to_string(j) + "\"", {}};
    for (std::size_t i = 0; i < rows; ++i) {
      const double t = 2 + step * static_cast<double>(i);
      r.columns[0].values.push_back(t);
      for (std::size_t j = 1; j <= 7; ++j)
        r.columns[j].values.push_back(1.2 * std::sin(static_cast<double>(j) * 0.4 * t));
    }
    return r;
  }
  Built scene() {
    const auto now = bench.document.now();
    return unwrap(build({*now, bench.derived, bench.registry}, world, {}, progress));
  }
  Playback playback() {
    const auto now = bench.document.now();
    return unwrap(
        build_playback({*now, bench.derived, bench.registry}, world, recording, progress));
  }
  std::string page() {
    for (std::size_t j = 1; j <= 7; ++j) request.columns.push_back(&recording.columns[j]);
    return replay_page(unwrap(replay_data(scene().scene, playback(), request, progress)),
                       request.title);
  }
};

std::unique_ptr<ReplayTest::Loaded> ReplayTest::loaded_;

TEST_F(ReplayTest, PosesAreThoseOfForwardKinematicsToTheStep) {
  request.frame_rate = 10;  // the samples' own
  const Decoded d = decoded(page());
  const Playback motion = playback();
  ASSERT_EQ(count(d.header, "frames"), 61U);
  ASSERT_EQ(d.tracks.size(), 7 * motion.ids.size());
  const double step = numbers(d.header, "position_step").at(0);
  EXPECT_LT(step, 5e-5);
  const auto now = bench.document.now();
  const auto& placed = now->get(world)->robots.at(0);
  const auto model = unwrap(bench.derived.robot_model(*now, placed.robot, {0, 0, -9.81}, progress));
  const Pose world_T_base = spatial::compose(model::pose(placed.placement), model->base);
  std::vector<Pose> frames(model->joints.size());
  for (std::size_t i = 0; i < 61; ++i) {
    std::vector<double> q;
    for (std::size_t j = 1; j <= 7; ++j) q.push_back(recording.columns[j].values[i]);
    robotics::forward_kinematics(*model, q, frames);
    // The tool is the last of the robot's tracks, and this world moves nothing else.
    std::vector<Pose> wanted{
        motion.poses.begin() + static_cast<std::ptrdiff_t>(i * motion.ids.size()),
        motion.poses.begin() + static_cast<std::ptrdiff_t>((i + 1) * motion.ids.size())};
    wanted.back() = spatial::compose(world_T_base, robotics::tip_pose(*model, 0, frames));
    for (std::size_t b = 0; b < wanted.size(); ++b) {
      const auto got = [&](std::size_t k) { return d.tracks[7 * b + k][i]; };
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_NEAR(got(k), wanted[b].p[k], 0.5 * step + 1e-9) << b << " at " << i;
      const auto R = spatial::from_quaternion({got(3), got(4), got(5), got(6)});
      for (std::size_t k = 0; k < 9; ++k) ASSERT_NEAR(R[k], wanted[b].R[k], 3e-5);
    }
  }
  // The sign of a quaternion never jumps, or what lies between two frames would spin.
  for (std::size_t b = 0; b < motion.ids.size(); ++b)
    for (std::size_t i = 1; i < 61; ++i) {
      double cosine = 0;
      for (std::size_t k = 3; k < 7; ++k)
        cosine += d.tracks[7 * b + k][i] * d.tracks[7 * b + k][i - 1];
      ASSERT_GT(cosine, 0);
    }
}

TEST_F(ReplayTest, FramesAreResampledEvenlyFromTheFirstToTheLastSample) {
  recording = moving(601, 0.01);
  request.frame_rate = 25;
  const Decoded d = decoded(page());
  EXPECT_EQ(count(d.header, "frames"), 151U);
  EXPECT_NEAR(numbers(d.header, "step").at(0), 0.04, 1e-12);
  EXPECT_EQ(numbers(d.header, "start").at(0), 2);
  const Playback motion = playback();
  for (std::size_t b = 0; b < motion.ids.size(); ++b)
    EXPECT_NEAR(d.tracks[7 * b].back(),
                motion.poses[motion.poses.size() - motion.ids.size() + b].p[0], 5e-5);
}

TEST_F(ReplayTest, MeshesAreSharedAndKeptToTheirSteps) {
  Built built = scene();
  // The same mesh twice is in the page once.
  render::Item twin = built.scene.items.front();
  twin.id = 77;
  built.scene.items.push_back(twin);
  const auto data = unwrap(replay_data(built.scene, playback(), request, progress));
  const Decoded d = decoded(replay_page(data, ""));
  std::vector<const Mesh*> meshes;
  for (const render::Item& item : built.scene.items)
    if (std::find(meshes.begin(), meshes.end(), item.mesh.get()) == meshes.end())
      meshes.push_back(item.mesh.get());
  ASSERT_EQ(d.meshes.size(), meshes.size());
  EXPECT_LT(meshes.size(), built.scene.items.size() - 2);  // three bushings share one as well
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Mesh& mesh = *meshes[m];
    ASSERT_EQ(d.meshes[m].triangles,
              std::vector<double>(mesh.triangles.begin(), mesh.triangles.end()));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = 1e9, high = -1e9;
      for (std::size_t i = axis; i < mesh.positions.size(); i += 3) {
        low = std::min(low, static_cast<double>(mesh.positions[i]));
        high = std::max(high, static_cast<double>(mesh.positions[i]));
      }
      for (std::size_t i = axis; i < mesh.edge_points.size(); i += 3) {
        low = std::min(low, static_cast<double>(mesh.edge_points[i]));
        high = std::max(high, static_cast<double>(mesh.edge_points[i]));
      }
      const double step = (high - low) / 65535;
      const auto near = [&](const std::vector<double>& got, const std::vector<float>& wanted) {
        ASSERT_EQ(got.size(), wanted.size() / 3);
        for (std::size_t i = 0; i < got.size(); ++i)
          ASSERT_NEAR(low + got[i] * step, static_cast<double>(wanted[3 * i + axis]),
                      0.5 * step + 1e-9);
      };
      near(d.meshes[m].places[axis], mesh.positions);
      near(d.meshes[m].edges[axis], mesh.edge_points);
    }
  }
}

TEST_F(ReplayTest, ColumnsKeepFourDigitsAndGaps) {
  recording.columns[3].values[7] = std::nan("");
  request.frame_rate = 1;
  // The robot does not follow the joint without a value here; only the plot has the gap.
  const Playback motion = [&] {
    recording::Recording whole = moving(61, 0.1);
    std::swap(whole, recording);
    Playback p = playback();
    std::swap(whole, recording);
    return p;
  }();
  request.columns = {&recording.columns[1], &recording.columns[3]};
  const Decoded d =
      decoded(replay_page(unwrap(replay_data(scene().scene, motion, request, progress)), "gap"));
  ASSERT_EQ(d.columns.size(), 2U);
  for (std::size_t i = 0; i < 61; ++i) {
    EXPECT_NEAR(d.times[i], recording.columns[0].values[i], 1e-6);
    EXPECT_NEAR(d.columns[0][i], recording.columns[1].values[i], 2.4 / 65534);
    if (i != 7) {
      EXPECT_NEAR(d.columns[1][i], recording.columns[3].values[i], 2.4 / 65534);
    }
  }
  EXPECT_TRUE(std::isnan(d.columns[1][7]));
}

TEST_F(ReplayTest, LongColumnsKeepTheirPeaks) {
  recording = moving(20001, 0.001);
  recording.columns[1].values[12345] = 9;
  request.columns = {&recording.columns[1]};
  const Decoded d = decoded(
      replay_page(unwrap(replay_data(scene().scene, playback(), request, progress)), "long"));
  EXPECT_LE(d.times.size(), 4002U);
  EXPECT_EQ(d.times.size(), d.columns[0].size());
  const auto peak = std::max_element(d.columns[0].begin(), d.columns[0].end());
  EXPECT_NEAR(*peak, 9, 1e-3);
  EXPECT_NEAR(d.times[static_cast<std::size_t>(peak - d.columns[0].begin())], 2 + 12.345, 0.02);
  EXPECT_TRUE(std::is_sorted(d.times.begin(), d.times.end()));
}

TEST_F(ReplayTest, APageLoadsNothingAndItsTitleIsText) {
  const std::string p = page();
  for (const char* outside : {"http:", "https:", "src=", "href=", "import ", "fetch(", "url("})
    EXPECT_EQ(p.find(outside), p.npos) << outside;
  EXPECT_NE(p.find("<title>PA-10 &lt;swings> &amp; \"stops\"</title>"), p.npos);
  EXPECT_NE(p.find(R"("title":"PA-10 \u003cswings> & \"stops\"")"), p.npos);
  EXPECT_EQ(p.find("@SCRIPT@"), p.npos);
}

TEST_F(ReplayTest, AMinuteOfThePa10TakesLessThanAQuarterOfTheFiveMegabytes) {
  recording = moving(601, 0.1);
  request.frame_rate = 30;
  EXPECT_LT(page().size(), 1'250'000U);
}

TEST_F(ReplayTest, AMinuteOfTwoRobotsAtTwentyFiveFramesASecondIsWithinFiveMegabytes) {
  const AnyId puma = bench.load("robots/puma560.rbt");
  model::World both = *bench.document.now()->get(world);
  both.robots.push_back({"puma", RobotId{puma.number}, {.position = {1.4, 0.3, 0.5}}, {}});
  auto begun = bench.document.begin("two robots");
  ASSERT_TRUE(begun.ok());
  world = unwrap(begun->add("two robots", std::move(both)));
  ASSERT_TRUE(begun->commit().ok());
  recording = moving(6001, 0.01);
  for (std::size_t j = 1; j <= 6; ++j) {
    recording.columns.push_back({"puma.q" + std::to_string(j), "rad", "", {}});
    for (const double t : recording.columns[0].values)
      recording.columns.back().values.push_back(0.7 * std::cos(static_cast<double>(j) * 0.3 * t));
  }
  request.frame_rate = 25;
  for (std::size_t j = 8; j <= 13; ++j) request.columns.push_back(&recording.columns[j]);
  const std::string whole = page();
  EXPECT_LT(whole.size(), 5'000'000U);
  const Decoded d = decoded(whole);
  EXPECT_EQ(count(d.header, "frames"), 1501U);
  EXPECT_EQ(d.columns.size(), 13U);
  // Both move: of no robot all tracks stand still.
  std::size_t moved = 0;
  for (const auto& track : d.tracks) {
    const auto [low, high] = std::minmax_element(track.begin(), track.end());
    moved += *high - *low > 0.01;
  }
  EXPECT_GT(moved, 6U * (7 + 6));
  RecordProperty("bytes", std::to_string(whole.size()));
}

TEST_F(ReplayTest, ThePagesOwnScriptsDecodeTheSame) {
  const fs::path node = program_on_path("node");
  if (node.empty()) GTEST_SKIP() << "node is not installed";
  request.frame_rate = 10;
  const fs::path folder = fs::path(testing::TempDir()) / "robomosp-replay";
  fs::create_directories(folder);
  std::ofstream(folder / "page.html", std::ios::binary) << page();
  std::ofstream poses(folder / "poses.txt");
  const Playback motion = playback();
  for (std::size_t i = 0; i < motion.poses.size(); i += 5) {
    const Pose& t = motion.poses[i];
    const auto q = spatial::to_quaternion(t.R);
    poses << i % motion.ids.size() << ' ' << i / motion.ids.size();
    for (const double x : {t.p[0], t.p[1], t.p[2], q.w, q.x, q.y, q.z})
      poses << ' ' << text::print(x);
    poses << '\n';
  }
  poses.close();
  ProcessSpec run;
  run.program = node;
  run.arguments = {std::string(ROBOMOSP_SOURCE_DIR) + "/tests/unit/replay_check.js",
                   (folder / "page.html").string(), (folder / "poses.txt").string()};
  run.memory = std::uint64_t{1} << 42;  // node reserves address space and does not use it
  std::string said;
  run.line = [&](std::string_view line) { said += std::string(line) + "\n"; };
  const auto done = run_process(run, progress);
  EXPECT_TRUE(done.ok()) << said;
  fs::remove_all(folder);
}

TEST_F(ReplayTest, AFollowedSceneSendsWhatChanged) {
  MeshKeys keys;
  const Built first = scene();
  const SceneData all = scene_data(first.scene, {}, keys, "", {});
  // Poses are those of the scene, bodies before frames.
  std::vector<Pose> wanted;
  for (const render::Item& item : first.scene.items)
    if (item.mesh && item.mesh->triangle_count() > 0) wanted.push_back(item.pose);
  for (const render::Triad& t : first.scene.triads) wanted.push_back(t.pose);
  ASSERT_EQ(all.poses.size(), 7 * wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double* x = &all.poses[7 * i];
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(x[k], wanted[i].p[k]);
    const auto R = spatial::from_quaternion({x[3], x[4], x[5], x[6]});
    for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(R[k], wanted[i].R[k], 1e-12);
  }
  // A robot that moved: the shape is the same, so that poses are all there is.
  Built moved = scene();
  pose_at(moved.scene, playback(), 3);
  const SceneData later = scene_data(moved.scene, {}, keys, all.shape, {});
  EXPECT_EQ(later.shape, all.shape);
  EXPECT_TRUE(later.header.empty() && later.bytes.empty());
  EXPECT_EQ(later.poses.size(), all.poses.size());
  EXPECT_NE(later.poses, all.poses);
  // A colour that changed: the header without the meshes that are kept, and another shape.
  std::set<std::string> kept;
  for (std::size_t at = 0; (at = all.header.find("\"key\":\"", at)) != std::string::npos; at += 7)
    kept.insert(all.header.substr(at + 7, 32));
  EXPECT_EQ(kept.size(), numbers(all.header, "vertices").size());
  moved.scene.items[0].appearance.colour.r *= 0.5F;
  const SceneData painted = scene_data(moved.scene, {}, keys, all.shape, kept);
  EXPECT_NE(painted.shape, all.shape);
  EXPECT_FALSE(painted.header.empty());
  EXPECT_LT(painted.bytes.size(), all.bytes.size() / 50);
  // One mesh that is another: that alone is sent.
  auto other = *moved.scene.items[0].mesh;
  other.positions[0] += 0.01F;
  moved.scene.items[0].mesh = std::make_shared<const Mesh>(std::move(other));
  const SceneData edited = scene_data(moved.scene, {}, keys, painted.shape, kept);
  EXPECT_NE(edited.shape, painted.shape);
  EXPECT_GT(edited.bytes.size(), painted.bytes.size());
  EXPECT_LT(edited.bytes.size(), all.bytes.size() / 2);
  // Keys are of content: another program, or the same mesh made again, has the same.
  MeshKeys others;
  EXPECT_EQ(scene_data(scene().scene, {}, others, "", {}).shape, all.shape);
}

TEST_F(ReplayTest, WhatCannotBeReplayedIsTold) {
  const auto told = [&](const Playback& motion) {
    const auto done = replay_data(scene().scene, motion, request, progress);
    return done.ok() ? std::string("it went well") : done.error().sentence();
  };
  Playback still = playback();
  still.times.resize(1);
  still.poses.resize(still.ids.size());
  EXPECT_NE(told(still).find("has no duration"), std::string::npos) << told(still);
  Playback lame = playback();
  lame.poses.pop_back();
  EXPECT_NE(told(lame).find("poses"), std::string::npos);
  recording::Column other{"other", "", "", {1, 2}};
  request.columns = {&other};
  EXPECT_NE(told(playback()).find("\"other\" has a different number of samples"),
            std::string::npos);
  request.columns.clear();
  request.frame_rate = 1e9;
  Playback dense = playback();
  for (std::size_t i = 0; i < dense.times.size(); ++i)
    dense.times[i] = i == 0 ? 0 : 1 + 1e-7 * static_cast<double>(i);
  EXPECT_NE(told(dense).find("Give a lower fps"), std::string::npos) << told(dense);
}

}  // namespace
}  // namespace robomosp::scene

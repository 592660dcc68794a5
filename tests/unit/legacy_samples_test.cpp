// SPDX-License-Identifier: Apache-2.0
// The sampled results that ROBOMOSP 1.4 (2006) stored of its trajectories, to every digit they were
// printed with, where that data is there (ROBOMOSP_LEGACY_DATA, or beside the project).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "io/legacy.h"
#include "motion/cartesian_path.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using spatial::norm;
using spatial::scale;
using spatial::sub;
using test::unwrap;
using test::Workbench;

constexpr double kDegree = std::numbers::pi / 180;
/// Half of the last digit printed [m, m/s, m/s^2, degrees, degrees/s, s].
constexpr double kHalf = 0.5e-5;

fs::path trajectories() {
  const char* given = std::getenv("ROBOMOSP_LEGACY_DATA");
  const fs::path data =
      given ? fs::path(given) : fs::path(ROBOMOSP_SOURCE_DIR) / "../shared/data/robomosp-1.4";
  const fs::path folder = data / "Saves/Trajectories";
  return fs::is_directory(folder / "GNUPlotData") ? folder : fs::path();
}

/// A line of a .plot.
struct Row {
  double time = 0;
  Vec3 p{}, v{};
  double speed = 0;
  Vec3 a{};
  double acceleration = 0;
  Vec3 angles{}, rates{};  ///< about z, y, x [degrees, degrees/s]
  double rate = 0;         ///< the three rates' length
};

std::vector<Row> read_plot(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);  // names of the columns
  std::vector<Row> out;
  while (std::getline(in, line)) {
    std::istringstream s(line);
    Row r;
    if (!(s >> r.time)) continue;
    for (double* x : {&r.p[0], &r.p[1], &r.p[2], &r.v[0], &r.v[1], &r.v[2], &r.speed, &r.a[0],
                      &r.a[1], &r.a[2], &r.acceleration, &r.angles[0], &r.angles[1], &r.angles[2],
                      &r.rates[0], &r.rates[1], &r.rates[2], &r.rate})
      s >> *x;
    EXPECT_TRUE(s) << file << ": " << line;
    out.push_back(r);
  }
  return out;
}

/// How that program got the velocities of a piece: of lines and turns they are exact; of other
/// curves they are differences of samples, and the accelerations differences of these.
enum class Derivatives { exact, differences, differences_of_unions };

std::vector<Vec3> differences(const std::vector<Vec3>& f, double h, bool is_parabola) {
  const std::size_t n = f.size() - 1;
  std::vector<Vec3> out(f.size());
  for (std::size_t i = 1; i < n; ++i) out[i] = scale(sub(f[i + 1], f[i - 1]), 1 / (2 * h));
  for (std::size_t k = 0; k < 3; ++k) {
    // At an end by the parabola through the three samples there, or by the last two.
    out[0][k] =
        is_parabola ? (-3 * f[0][k] + 4 * f[1][k] - f[2][k]) / (2 * h) : (f[1][k] - f[0][k]) / h;
    out[n][k] = is_parabola ? (3 * f[n][k] - 4 * f[n - 1][k] + f[n - 2][k]) / (2 * h)
                            : (f[n][k] - f[n - 1][k]) / h;
  }
  return out;
}

/// How a piece was sampled.
struct Sampling {
  Derivatives derivatives = Derivatives::exact;
  double way_ramp = 0, turn_ramp = 0;  ///< time to speed up, and to slow down, of a trapezoid [s]
};

/// When that program took n + 1 samples of a motion of T: evenly, but the ramps of a trapezoid by
/// themselves, each in its share of the n steps as a whole number. A row says the time of the way's
/// sample; the turn is sampled by its own law, and may be of another time than its row says.
std::vector<double> sample_times(double T, double ramp, std::size_t n) {
  const auto steps = static_cast<double>(n), up = std::floor(ramp / T * steps + 0.5);
  std::vector<double> out;
  for (std::size_t i = 0; i <= n; ++i) {
    const auto k = static_cast<double>(i);
    if (k <= up && up > 0) out.push_back(ramp * k / up);
    else if (k >= steps - up && up > 0) out.push_back(T - ramp * (steps - k) / up);
    else out.push_back(ramp + (T - 2 * ramp) * (k - up) / (steps - 2 * up));
  }
  return out;
}

/// Holds rows[first..] against a piece; rows[0] is the sample at its start.
void compare(const motion::Path::Piece& piece, const Sampling& how, std::span<const Row> rows,
             std::size_t first, double start, const std::string& where) {
  const Segment& segment = *piece.segment;
  const double T = segment.duration();
  const std::size_t n = rows.size() - 1;
  ASSERT_GE(n, 3U) << where;
  const auto times = sample_times(T, how.way_ramp, n),
             turn_times = sample_times(T, how.turn_ramp, n);
  for (std::size_t i = first; i <= n; ++i)
    EXPECT_NEAR(start + times[i], rows[i].time, kHalf + 1e-9) << where;
  const bool is_exact = how.derivatives == Derivatives::exact;
  const auto sample = [&](double t) {
    PathSample out;
    t = std::clamp(t, 0.0, T);
    EXPECT_TRUE(segment.sample({&t, 1}, {&out, 1}).ok());
    return out;
  };
  std::vector<PathSample> turns;
  std::vector<Vec3> p, v, a;
  for (std::size_t i = 0; i <= n; ++i) {
    turns.push_back(sample(turn_times[i]));
    const PathSample here = sample(times[i]);
    p.push_back(here.pose.p);
    v.push_back(here.velocity);
    a.push_back(here.acceleration);
  }
  if (!is_exact) {
    const double h = T / static_cast<double>(n);
    for (std::size_t i = 0; i <= n; ++i)
      ASSERT_NEAR(times[i], h * static_cast<double>(i), 1e-9) << where << ": even steps";
    const bool is_union = how.derivatives == Derivatives::differences_of_unions;
    const Vec3 v_start = v.front(), v_end = v.back();
    v = differences(p, h, is_union);
    if (!is_union) v.front() = v_start, v.back() = v_end;
    a = differences(v, h, is_union);
  }
  // Our own rounding: far below the digits printed.
  constexpr double kOurs = 1e-9;
  for (std::size_t i = first; i <= n; ++i) {
    const Row& row = rows[i];
    const std::string here = where + " at " + std::to_string(row.time) + " s";
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(p[i][k], row.p[k], kHalf + kOurs) << here;
      EXPECT_NEAR(v[i][k], row.v[k], kHalf + kOurs) << here;
    }
    EXPECT_NEAR(norm(v[i]), row.speed, kHalf + kOurs) << here;
    // Where the acceleration jumps it is that of either side.
    double off = 1e300;
    std::vector<Vec3> sides{a[i]};
    if (is_exact)
      for (const double side : {-1e-9, 1e-9}) sides.push_back(sample(times[i] + side).acceleration);
    for (const Vec3& side : sides) {
      double most = std::fabs(norm(side) - row.acceleration);
      for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(side[k] - row.a[k]));
      off = std::min(off, most);
    }
    EXPECT_LE(off, kHalf + kOurs) << here;

    const auto& [yaw, pitch, roll] = row.angles;
    Pose printed;
    printed.R = spatial::from_rpy({roll * kDegree, pitch * kDegree, yaw * kDegree});
    // Each of the three angles has its own rounding.
    EXPECT_LE(norm(spatial::rotation_difference(printed.R, turns[i].pose.R)),
              3 * kHalf * kDegree + kOurs)
        << here;
    const double y = yaw * kDegree, q = pitch * kDegree;
    const auto& [yaw_rate, pitch_rate, roll_rate] = row.rates;
    const Vec3 turning{
        (-std::sin(y) * pitch_rate + std::cos(y) * std::cos(q) * roll_rate) * kDegree,
        (std::cos(y) * pitch_rate + std::sin(y) * std::cos(q) * roll_rate) * kDegree,
        (yaw_rate - std::sin(q) * roll_rate) * kDegree};
    // The rounding of three rates, and of the two angles that say which way their axes point.
    EXPECT_LE(norm(sub(turning, turns[i].angular_velocity)),
              3 * kHalf * kDegree + kOurs + 2 * kHalf * kDegree * row.rate * kDegree)
        << here;
    EXPECT_NEAR(norm(row.rates), row.rate, 3 * kHalf) << here;
  }
}

class LegacySamples : public testing::Test {
 protected:
  /// The trajectory's path and how each piece's derivatives were got.
  struct Loaded {
    std::shared_ptr<const motion::Path> path;
    std::vector<Sampling> how;
    std::vector<std::string> notes;
  };
  Loaded load(const fs::path& file) {
    auto tx = bench.document.begin("load");
    const auto loaded = io::load(*tx, file, {});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence();
      return {};
    }
    EXPECT_TRUE(tx->commit().ok());
    const auto now = bench.document.now();
    const auto& t = std::get<model::Trajectory>(now->find(loaded->id)->body);
    Loaded out;
    out.notes = loaded->notes;
    out.path = unwrap(motion::Path::build(bench.registry, "t", t));
    const auto ramp = [](const auto& params, const char* speed, const char* acceleration) {
      return std::get<double>(params.at(speed)) / std::get<double>(params.at(acceleration));
    };
    for (const auto& segment : t.segments) {
      Sampling& how = out.how.emplace_back();
      if (segment.shape.params.contains("start_velocity"))
        how.derivatives = Derivatives::differences_of_unions;
      else if (segment.shape.name == "circle" || segment.shape.name == "arc")
        how.derivatives = Derivatives::differences;
      if (segment.law.name == "trapezoidal")
        how.way_ramp = ramp(segment.shape.params, "speed", "acceleration");
      if (segment.turning.name == "trapezoidal")
        how.turn_ramp = ramp(segment.turning.params, "angular_speed", "angular_acceleration");
    }
    EXPECT_EQ(out.how.size(), out.path->segment_count());
    return out;
  }

  Workbench bench;
};

TEST_F(LegacySamples, TrajectoriesMeetTheSamplesStoredOfThem) {
  const fs::path folder = trajectories();
  if (folder.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  std::size_t compared = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".tjc") continue;
    const fs::path plot = folder / "GNUPlotData" / (entry.path().stem().string() + ".plot");
    if (!fs::exists(plot)) continue;
    ++compared;
    const std::vector<Row> rows = read_plot(plot);
    const Loaded loaded = load(entry.path());
    ASSERT_TRUE(loaded.path) << plot;
    std::size_t from = 0;
    for (std::size_t k = 0; k < loaded.how.size(); ++k) {
      const motion::Path::Piece& piece = loaded.path->pieces()[k];
      const double end = piece.start + piece.segment->duration();
      std::size_t to = from;
      while (to + 1 < rows.size() && rows[to + 1].time <= end + kHalf + 1e-9) ++to;
      // What is printed at a joint is the end of the piece before it.
      compare(piece, loaded.how[k], std::span(rows).subspan(from, to - from + 1), k == 0 ? 0 : 1,
              piece.start, plot.filename().string() + ", segment " + std::to_string(k + 1));
      from = to;
    }
    EXPECT_EQ(from + 1, rows.size()) << plot << ": every row is compared";
    EXPECT_NEAR(rows.back().time, loaded.path->duration(), kHalf + 1e-9) << plot;
  }
  EXPECT_GT(compared, 0U);
}

TEST_F(LegacySamples, PartsOfTrajectoriesMeetTheSamplesStoredOfThem) {
  const fs::path folder = trajectories();
  if (folder.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  struct Part {
    const char* plot;
    const char* trajectory;
    std::size_t piece;
  };
  const Part parts[] = {
      {"Union1", "Jarboter - Three sections straight line - Meters ", 1},
      {"Union2", "Jarboter - Three sections straight line - Meters ", 3},
      {"Section2", "circle - 200", 1},
  };
  // Section1 is of a line that only speeds up; no trajectory with one is there. The next test.
  std::set<std::string> known{"Section1"};
  for (const Part& part : parts) {
    const fs::path plot = folder / "GNUPlotData" / (std::string(part.plot) + ".plot"),
                   file = folder / (std::string(part.trajectory) + ".tjc");
    known.insert(part.plot);
    if (!fs::exists(plot) || !fs::exists(file)) continue;
    const Loaded loaded = load(file);
    ASSERT_TRUE(loaded.path) << file;
    ASSERT_GT(loaded.how.size(), part.piece) << file;
    const std::vector<Row> rows = read_plot(plot);
    compare(loaded.path->pieces()[part.piece], loaded.how[part.piece], rows, 0, 0, part.plot);
  }
  for (const auto& entry : fs::directory_iterator(folder / "GNUPlotData")) {
    const std::string name = entry.path().stem().string();
    EXPECT_TRUE(known.contains(name) || fs::exists(folder / (name + ".tjc")))
        << name << ": no test compares it";
  }
}

TEST_F(LegacySamples, ALineThatOnlySpeedsUpMeetsItsSamples) {
  const fs::path folder = trajectories();
  const fs::path plot = folder / "GNUPlotData" / "Section1.plot";
  if (folder.empty() || !fs::exists(plot)) GTEST_SKIP() << "no files of the 2006 program here";
  const std::vector<Row> rows = read_plot(plot);
  ASSERT_EQ(rows.size(), 21U);
  // 0.02 of 0.5 s to speed up; the length is printed as 0.2965 m, and the speed tells it more
  // closely: v (T - ramp / 2).
  const double T = 0.5, ramp = 0.02 * T, length = 0.2964965, v = length / (T - ramp / 2);
  model::Trajectory t;
  const auto add = [&](double from, double to, const char* law, double duration) {
    auto& s = t.segments.emplace_back();
    s.shape.name = "line";
    s.transition.is_smooth = false;
    s.points = {{{0, from, 0}, {}}, {{0, to, 0}, {}}};
    s.law.name = law;
    s.shape.params["duration"] = duration;
  };
  add(0, v * ramp / 2, "constant_acceleration", ramp);
  add(v * ramp / 2, length, "constant_speed", T - ramp);
  const auto path = unwrap(motion::Path::build(bench.registry, "section", t));
  EXPECT_NEAR(path->duration(), rows.back().time, 1e-12);
  for (const Row& row : rows) {
    PathSample s;
    const double time = row.time;
    ASSERT_TRUE(path->sample({&time, 1}, {&s, 1}).ok());
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.pose.p[k], row.p[k], kHalf + 1e-9) << time;
      EXPECT_NEAR(s.velocity[k], row.v[k], kHalf + 1e-9) << time;
      if (time > 0) {
        EXPECT_NEAR(s.acceleration[k], row.a[k], kHalf + 1e-9) << time;
      }
    }
    EXPECT_NEAR(norm(s.velocity), row.speed, kHalf + 1e-9) << time;
    EXPECT_EQ(norm(row.angles) + norm(row.rates), 0) << "it keeps its orientation";
  }
  std::size_t plots = 0;
  for (const auto& entry : fs::directory_iterator(folder / "GNUPlotData"))
    plots += entry.path().extension() == ".plot" ? 1U : 0U;
  EXPECT_EQ(plots, 11U) << "all of them are compared: seven trajectories, four parts";
}

TEST_F(LegacySamples, ArcsAndCirclesStartWithTheAccelerationThatTheirFirstPointRepeats) {
  const fs::path folder = trajectories();
  if (folder.empty()) GTEST_SKIP() << "no files of the 2006 program here";
  std::size_t compared = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".tjc") continue;
    const Loaded loaded = load(entry.path());
    ASSERT_TRUE(loaded.path) << entry.path();
    if (loaded.how[0].derivatives != Derivatives::differences) continue;
    ++compared;
    // { "name" eight codes, samples ... [ ( frame of 6 ) three codes, five triples ...
    std::ifstream in(entry.path(), std::ios::binary);
    std::stringstream whole;
    whole << in.rdbuf();
    const std::string content = whole.str();
    const auto name = content.find('"', content.find('{'));
    std::istringstream codes(content.substr(content.find('"', name + 1) + 1));
    double samples = 0;
    for (int i = 0; i < 9; ++i) codes >> samples;
    std::string point = content.substr(content.find('[') + 1);
    for (char& c : point)
      if (c == '(' || c == ')' || c == ',') c = ' ';
    std::istringstream numbers(point);
    double skipped = 0;
    Vec3 stored{};
    for (int i = 0; i < 9 + 12; ++i) numbers >> skipped;
    for (double& x : stored) numbers >> x;
    ASSERT_TRUE(codes && numbers) << entry.path();
    // The difference of the first two velocities; at rest, and a difference of positions.
    const Segment& segment = *loaded.path->pieces()[0].segment;
    const double h = segment.duration() / samples;
    const std::array<double, 2> times{0, 2 * h};
    std::array<PathSample, 2> at;
    ASSERT_TRUE(segment.sample(times, at).ok());
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR((at[1].pose.p[k] - at[0].pose.p[k]) / (2 * h * h), stored[k], 0.5e-8 + 1e-10)
          << entry.path();
  }
  EXPECT_GT(compared, 0U);
}

TEST_F(LegacySamples, StoredSectionsRunInTheTimesAndPlacesOfTheirFiles) {
  const fs::path folder = trajectories();
  if (folder.empty() || !fs::is_directory(folder / "Sections"))
    GTEST_SKIP() << "no files of the 2006 program here";
  const std::map<std::string, Vec3> ends{{"Straight Line 1", {0, 9, 0}},
                                         {"Straight Line 2", {0, 9, 9}}};
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder / "Sections")) {
    if (entry.path().extension() != ".stn") continue;
    ++files;
    const Loaded loaded = load(entry.path());
    ASSERT_TRUE(loaded.path) << entry.path();
    EXPECT_TRUE(loaded.notes.empty()) << entry.path();
    const auto known = ends.find(entry.path().stem().string());
    if (known == ends.end()) continue;
    const Segment& segment = *loaded.path->pieces()[0].segment;
    EXPECT_NEAR(segment.duration(), 2, 1e-12);
    const double t = 2;
    PathSample end;
    ASSERT_TRUE(segment.sample({&t, 1}, {&end, 1}).ok());
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(end.pose.p[k], known->second[k], 1e-9);
    EXPECT_NEAR(norm(end.velocity), 4.5, 1e-9) << "as its points say";
  }
  EXPECT_GT(files, 0U);
}

}  // namespace
}  // namespace robomosp

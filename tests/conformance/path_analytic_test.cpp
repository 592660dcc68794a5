// SPDX-License-Identifier: Apache-2.0
// Lines and arcs as segments: the SDK's suite, the paper's circle and the error sentences.
#include <robomosp/sdk/conformance/segment_suite.h>

#include "kernel/plugin_loader.h"
#include "model/placement.h"
#include "motion/segment.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/path_analytic.so";

const Registry& registry() {
  static Registry* const with_plugin = [] {
    auto* r = new Registry;
    static PluginLoader loader(*r);
    const PluginReport report = loader.load(kFile);
    EXPECT_TRUE(r->find("robomosp.curve/1", "line").ok()) << report.file;
    return r;
  }();
  return *with_plugin;
}

Result<std::shared_ptr<const Segment>> make(
    const std::string& shape, const std::vector<Pose>& points,
    const std::vector<std::pair<std::string, double>>& values = {}) {
  model::TrajectorySegment record;
  record.shape.name = shape;
  for (const auto& [name, value] : values) record.shape.params[name] = value;
  for (const Pose& p : points) record.points.push_back(model::placement(p));
  return motion::make_segment(registry(), record, "it");
}
Result<std::shared_ptr<const Segment>> make_case(const SegmentCase& c) {
  return make(c.provider, c.points, c.params);
}

Pose down(double x, double y, double z) { return multiply(shift(x, y, z), turn_y(kPi)); }

std::vector<Pose> paper_points() {
  return {down(0.558, 0, 0.7346), down(0.758, 0, 0.7346), down(0.658, -0.1, 0.7346)};
}

std::vector<SegmentCase> bare_cases() {
  const Pose a = multiply(shift(0.1, 0.2, 0.3), turn_x(0.3)),
             b = multiply(shift(-0.4, 0.5, 0.1), turn_z(2));
  return {
      {kFile, "line", "straight", {shift(0, 0, 0), shift(1, 2, 2)}, {{"speed", 0.3}}, 0.3},
      {kFile, "line", "turning", {a, b}, {{"speed", 0.05}}, 0.05},
      {kFile,
       "line",
       "half_turn",
       {a, multiply(a, turn_y(kPi))},
       {{"angular_speed", 0.7}},
       0,
       false},
      {kFile, "circle", "paper", paper_points(), {{"speed", 0.01}}, 0.01, true, false},
      {kFile,
       "circle",
       "tilted_three_turns",
       {shift(1, 0, 0.2), multiply(shift(0, 1, 0.5), turn_x(1)),
        multiply(shift(-1, 0, 0.3), turn_z(0.5))},
       {{"speed", 0.4}, {"turns", 3}},
       0.4,
       false,
       false},
      {kFile,
       "arc",
       "short",
       {shift(1, 0, 0), shift(std::sqrt(0.5), std::sqrt(0.5), 0), shift(0, 1, 0)},
       {{"speed", 0.2}},
       0.2},
      {kFile,
       "arc",
       "long_way",
       {shift(1, 0, 0), shift(-1, 0, 0), shift(0, 1, 0)},
       {{"speed", 0.2}},
       0.2},
      {kFile, "arc", "turning", {a, shift(0.5, 0.1, -0.2), b}, {{"speed", 0.2}}, 0.2},
  };
}
std::vector<SegmentCase> cases() {
  std::vector<SegmentCase> all = bare_cases();
  for (SegmentCase& c : all) c.make = make_case;
  return all;
}
INSTANTIATE_TEST_SUITE_P(Analytic, SegmentConformance, testing::ValuesIn(cases()),
                         segment_case_name);

PathSample at(const Segment& s, double t) {
  PathSample out[1];
  const double times[] = {t};
  s.sample(times, out);
  return out[0];
}

// The paper's first validation case; 2 pi 100 mm / 10 mm/s = 62.832 s.
TEST(Circle, OfThePaperHasItsCentreRadiusAndDuration) {
  const auto made = make("circle", paper_points(), {{"speed", 0.01}});
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const Segment& s = **made;
  EXPECT_NEAR(s.duration(), 20 * kPi, 1e-10);
  EXPECT_NEAR(s.length(), 0.2 * kPi, 1e-12);
  for (int i = 0; i < 100; ++i) {
    const PathSample p = at(s, s.duration() * i / 100);
    EXPECT_NEAR(std::hypot(p.pose.p[0] - 0.658, p.pose.p[1]), 0.1, 1e-13);
    EXPECT_NEAR(p.pose.p[2], 0.7346, 1e-13);
    // In the printed order the points turn about -z: (centre to tool) x velocity points down.
    EXPECT_LT((p.pose.p[0] - 0.658) * p.velocity[1] - p.pose.p[1] * p.velocity[0], 0);
  }
  EXPECT_NEAR(position_gap(at(s, s.duration()).pose, paper_points()[0]), 0, 1e-13);
}

TEST(Segments, TellWhatIsWrongInSentences) {
  const Pose a = shift(0, 0, 0), b = shift(1, 0, 0), c = shift(2, 0, 0), d = shift(0, 1, 0);
  const auto sentence = [](const auto& r) {
    return r.ok() ? std::string("no error") : r.error().sentence();
  };
  EXPECT_EQ(sentence(make("line", {a})),
            "it: a line needs 2 points, 1 was given. Give start and end.");
  EXPECT_EQ(sentence(make("line", {a, a})),
            "it: start and end of the line are the same pose. Move or turn one of them.");
  EXPECT_EQ(sentence(make("line", {a, b}, {{"speed", 0}})),
            "it: speed is 0 m/s. It must be above 0.");
  EXPECT_EQ(sentence(make("line", {a, b}, {{"speed", -0.5}})),
            "it, speed: -0.5 m/s is out of range; it must be 0 to 1e+06 m/s.");
  EXPECT_EQ(
      sentence(make("circle", {a, b, c})),
      "it: the three points lie on a straight line. Move one of them off the line, or use a line.");
  EXPECT_EQ(sentence(make("arc", {a, b, a})),
            "it: points 1 and 3 are the same place. Three different points are needed to define a "
            "circle.");
  EXPECT_EQ(sentence(make("circle", {a, b, d}, {{"turns", 0}})),
            "it: turns is 0 turns. It must be above 0.");
  EXPECT_EQ(sentence(make("arc", {a, b})),
            "it: an arc needs 3 points, 2 were given. Give start, a point on the way, and end.");
}

}  // namespace
}  // namespace robomosp::conformance

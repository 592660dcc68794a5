// SPDX-License-Identifier: Apache-2.0
// Lines and arcs as segments: the SDK's suite, the paper's circle and the error sentences.
#include <map>

#include <robomosp/sdk/conformance/curve_suite.h>
#include <robomosp/sdk/conformance/motion_law_suite.h>
#include <robomosp/sdk/conformance/orientation_suite.h>

#include "support/segments.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/path_analytic.so";

const Registry& registry() {
  static const Registry& r = registry_with({"path_analytic"});
  return r;
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
/// Other curves, laws and orientations: a record in full.
SegmentCase other(const std::string& name, const std::string& shape,
                  const std::vector<Pose>& points,
                  const std::function<void(model::TrajectorySegment&)>& fill,
                  double constant_speed = 0, bool passes = true, bool ends = true) {
  SegmentCase c{kFile,  shape, name,
                points, {},    constant_speed,
                passes, ends,  points.size() > 2 || shape == "line"};
  c.make = [fill](const SegmentCase& with) {
    model::TrajectorySegment record;
    record.shape.name = with.provider;
    for (const Pose& p : with.points) record.points.push_back(model::placement(p));
    fill(record);
    return motion::make_segment(registry(), record, "it");
  };
  return c;
}

std::vector<SegmentCase> other_cases() {
  using Record = model::TrajectorySegment;
  using Numbers = std::vector<double>;
  const Pose a = multiply(shift(0.1, 0.2, 0.3), turn_x(0.3)),
             b = multiply(shift(-0.4, 0.5, 0.1), turn_z(2));
  const std::vector<Pose> corner{shift(1, 0, 0), multiply(shift(0.4, 0.8, 0.1), turn_x(1.2)),
                                 multiply(shift(0, 1, 0.2), turn_z(0.8))};
  std::vector<SegmentCase> all;
  all.push_back(other(
      "tilted", "arc_centre", {shift(1, 0, 0)},
      [](Record& r) {
        r.shape.params = {{"centre", Numbers{0.2, 0.1, 0}},
                          {"axis", Numbers{0, 0.6, 0.8}},
                          {"angle", -2.5},
                          {"speed", 0.3}};
      },
      0.3, true, false));
  all.push_back(other(
      "rising", "helix", {shift(1, 0, 0), multiply(shift(1, 0, 0), turn_z(1))},
      [](Record& r) {
        r.shape.params = {{"centre", Numbers{0, 0, 0}},
                          {"turns", 3.0},
                          {"pitch", 0.2},
                          {"speed", 0.5},
                          {"angular_speed", 10.0}};
      },
      0.5, false, false));
  for (const char* law :
       {"constant_acceleration", "trapezoidal", "s_curve", "cubic", "quintic", "cycloidal"})
    all.push_back(other(law, "line", {a, b}, [law](Record& r) { r.law.name = law; }));
  all.push_back(other("moving_ends", "line", {a, b}, [](Record& r) {
    r.law = {"s_curve",
             {{"start_speed", 0.02}, {"end_speed", 0.05}, {"speed", 0.06}, {"jerk", 2.0}}};
  }));
  all.push_back(other("timed", "line", {a, b}, [](Record& r) {
    r.law = {"trapezoidal", {{"duration", 9.0}, {"start_speed", 0.01}}};
  }));
  all.push_back(other("squad", "arc", corner, [](Record& r) { r.orientation.name = "squad"; }));
  all.push_back(other("eased", "arc", corner, [](Record& r) {
    r.orientation = {"slerp", {{"from", 0.23}, {"to", 0.87}, {"ease", std::string("smooth")}}};
  }));
  return all;
}

std::vector<SegmentCase> cases() {
  std::vector<SegmentCase> all = bare_cases();
  for (SegmentCase& c : all) c.make = make_case;
  for (SegmentCase& c : other_cases()) all.push_back(std::move(c));
  return all;
}
INSTANTIATE_TEST_SUITE_P(Analytic, SegmentConformance, testing::ValuesIn(cases()),
                         segment_case_name);

// ---- each interface by itself ----

using Texts = std::vector<std::pair<std::string, std::string>>;

std::vector<CurveCase> curve_cases() {
  const std::vector<Pose> three{shift(1, 0, 0.2), shift(0.1, 0.9, 0.5), shift(-1, 0, 0.3)};
  const Texts about{{"centre", "{0.2, 0.1, 0}"}, {"axis", "{0, 0.6, 0.8}"}};
  Texts arc = about, helix = about;
  arc.insert(arc.end(), {{"angle", "-2.5"}});
  helix.insert(helix.end(), {{"turns", "-3"}, {"pitch", "0.2"}});
  return {{kFile, "line", "straight", {shift(0.1, 0.2, 0.3), shift(1, 2, 2)}},
          {kFile, "arc", "tilted", three},
          {kFile, "circle", "tilted", three},
          {kFile, "circle", "part", three, {{"turns", "0.8"}}},
          {kFile, "arc_centre", "backwards", {shift(1, 0, 0)}, arc},
          {kFile, "helix", "backwards", {shift(1, 0, 0)}, helix}};
}
INSTANTIATE_TEST_SUITE_P(Analytic, CurveConformance, testing::ValuesIn(curve_cases()),
                         curve_case_name);

// Limits of a way of 2 m that turns by 3 rad at most: speed 0.4 m/s = 0.2 of the way each second,
// acceleration 1 m/s^2 = 0.5 and jerk 4 m/s^3 = 2 of it.
std::vector<LawCase> law_cases() {
  const LawTask way{sizeof(LawTask), 2, 3}, spot{sizeof(LawTask), 0, 1.5};
  const Texts limits{{"speed", "0.4"},
                     {"angular_speed", "100"},
                     {"acceleration", "1"},
                     {"angular_acceleration", "1000"}};
  const auto with = [&](Texts more) {
    more.insert(more.begin(), limits.begin(), limits.end());
    return more;
  };
  std::vector<LawCase> all;
  const auto add = [&](const char* law, const char* name, const LawTask& task, const Texts& params,
                       double rate, double acceleration) {
    all.push_back({kFile, law, name, task, params});
    all.back().rate = rate, all.back().acceleration = acceleration;
    return &all.back();
  };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  LawCase* c =
      add("constant_speed", "way", way, {{"speed", "0.4"}, {"angular_speed", "9"}}, 0.2, 0);
  c->start_rate = c->end_rate = 0.2, c->duration = 5;
  c = add("constant_speed", "spot", spot, {{"angular_speed", "0.5"}}, 1 / 3.0, 0);
  c->start_rate = c->end_rate = -1, c->duration = 3;
  c = add("constant_speed", "timed", way, {{"duration", "7"}}, 1 / 7.0, 1e-12);
  c->start_rate = c->end_rate = -1, c->duration = 7;
  // s = a t^2 / 2: 2 m at 1 m/s^2 take 2 s and end at 2 m/s.
  c = add("constant_acceleration", "from_rest", way,
          {{"acceleration", "1"}, {"angular_acceleration", "1000"}}, kNone, 0.5);
  c->end_rate = 1, c->duration = 2;
  c = add("constant_acceleration", "between", way, {{"start_speed", "0.3"}, {"end_speed", "0.1"}},
          0.15, kNone);
  c->start_rate = 0.15, c->end_rate = 0.05, c->duration = 10;
  // 0.4 s up, 0.4 s down, and 2 - 2 * 0.08 m at 0.4 m/s.
  c = add("trapezoidal", "limits", way, limits, 0.2, 0.5);
  c->duration = 0.8 + 1.84 / 0.4;
  c = add("trapezoidal", "moving_ends", way, with({{"start_speed", "0.1"}, {"end_speed", "0.2"}}),
          0.2, 0.5);
  c->start_rate = 0.05, c->end_rate = 0.1;
  c = add("trapezoidal", "timed", way, with({{"duration", "9"}}), 0.2, 0.5);
  c->duration = 9;
  c = add("trapezoidal", "spot", spot, {}, 1 / 3.0, 10 / 3.0);
  c = add("s_curve", "limits", way, with({{"jerk", "4"}, {"angular_jerk", "1e6"}}), 0.2, 0.5);
  c->jerk = 2, c->is_accelerating_at_ends = false;
  c = add(
      "s_curve", "moving_ends", way,
      with({{"jerk", "4"}, {"angular_jerk", "1e6"}, {"start_speed", "0.3"}, {"end_speed", "0.1"}}),
      0.2, 0.5);
  c->jerk = 2, c->is_accelerating_at_ends = false, c->start_rate = 0.15, c->end_rate = 0.05;
  for (const char* law : {"cubic", "quintic", "cycloidal"}) {
    const bool is_smooth = std::string(law) != "cubic";
    add(law, "limits", way, limits, 0.2, 0.5)->is_accelerating_at_ends = !is_smooth;
    c = add(law, "timed", way, {{"duration", "4"}}, kNone, kNone);
    c->is_accelerating_at_ends = !is_smooth, c->duration = 4;
    add(law, "spot", spot, {}, 1 / 3.0, 10 / 3.0);
  }
  c = add("quintic", "moving_ends", way, with({{"start_speed", "0.1"}, {"end_speed", "0.3"}}), 0.2,
          0.5);
  c->start_rate = 0.05, c->end_rate = 0.15, c->is_accelerating_at_ends = false;
  return all;
}
INSTANTIATE_TEST_SUITE_P(Analytic, MotionLawConformance, testing::ValuesIn(law_cases()),
                         law_case_name);

std::vector<OrientationCase> orientation_cases() {
  const std::vector<double> shares{0, 0.3, 0.55, 1};
  const std::vector<Pose> points{turn_x(0.3), multiply(turn_y(0.8), turn_x(0.2)), turn_z(-0.9),
                                 multiply(turn_z(1.2), turn_y(2.1))};
  std::vector<OrientationCase> all{
      {kFile, "fixed", "first", shares, points, {}, false},
      {kFile, "slerp", "plain", shares, points},
      {kFile, "slerp", "half_turn", {0, 1}, {turn_x(0.3), multiply(turn_x(0.3), turn_y(kPi))}},
      {kFile,
       "slerp",
       "part",
       shares,
       points,
       {{"from", "0.2"}, {"to", "0.7"}},
       true,
       false,
       {0.2, 0.7}},
      {kFile,
       "slerp",
       "eased",
       shares,
       points,
       {{"from", "0.2"}, {"to", "0.7"}, {"ease", "smooth"}}},
      {kFile, "slerp_points", "bent", shares, points, {}, true, true, {0.3, 0.55}},
      {kFile, "squad", "bent", shares, points, {}, true, true, {0.3, 0.55}},
      {kFile, "squad", "single", {0}, {turn_x(0.4)}, {}, true, true},
      {kFile, "angles", "plain", shares, points},
      {kFile,
       "angles",
       "turned_frame",  // first pose turn_x(0.3), given as no angles at all
       {0, 1},
       {turn_x(0.3), multiply(turn_x(0.3), turn_z(0.7))},
       {{"first", "{0, 0, 0}"}, {"last", "{0, 0, 6.983185307179586}"}}},  // 0.7 and a whole turn
      {kFile, "tangent", "x", shares, points, {{"up", "{0, 0, 1}"}}, false},
      {kFile, "tangent", "z", shares, points, {{"axis", "z"}, {"up", "{0.1, 0, 1}"}}, false}};
  return all;
}
INSTANTIATE_TEST_SUITE_P(Analytic, OrientationConformance, testing::ValuesIn(orientation_cases()),
                         orientation_case_name);

PathSample at(const Segment& s, double t) {
  PathSample out[1];
  const double times[] = {t};
  EXPECT_TRUE(s.sample(times, out).ok());
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
  EXPECT_TRUE(make("line", {a, a}).ok()) << "a wait";
  EXPECT_EQ(sentence(make("line", {a, b}, {{"speed", 0}})),
            "it: speed is 0 m/s. It must be above 0.");
  EXPECT_EQ(sentence(make("line", {a, b}, {{"speed", -0.5}})),
            "it, speed: -0.5 m/s is out of range; it must be 0 to 1e+06 m/s.");
  EXPECT_EQ(
      sentence(make("circle", {a, b, c})),
      "it: the three points lie on a straight line. Move one of them off the line, or use a line.");
  EXPECT_EQ(
      sentence(make("arc", {a, b, a})),
      "it: points 1 and 3 are at the same position. Three different points are needed to define a "
      "circle.");
  EXPECT_EQ(sentence(make("circle", {a, b, d}, {{"turns", 0}})),
            "it: turns is 0 turns. It must be above 0.");
  EXPECT_EQ(sentence(make("arc", {a, b})),
            "it: an arc needs 3 points, 2 were given. Give start, a via point, and end.");
}

// Times of the textbook's rest-to-rest laws over a way L under speed V and acceleration A (e.g.
// Siciliano et al., Robotics, section 4.2; Biagiotti and Melchiorri, Trajectory Planning for
// Automatic Machines and Robots, sections 2.1 and 3.4): trapezoid L/V + V/A; S-curve with jerk J
// L/V + V/A + A/J; cubic max(3/2 L/V, sqrt(6 L/A)); quintic max(15/8 L/V, sqrt(10/sqrt(3) L/A));
// cycloidal max(2 L/V, sqrt(2 pi L/A)).
TEST(Laws, TakeTheTimesOfTheTextbook) {
  const double L = 2, V = 0.5, A = 0.4, J = 1.5;
  const auto time_of = [&](const char* law) {
    model::TrajectorySegment r = record_of("line", {shift(0, 0, 0), shift(L, 0, 0)});
    r.law = {law, {{"speed", V}, {"acceleration", A}}};
    if (std::string(law) == "s_curve") r.law.params["jerk"] = J;
    const auto made = motion::make_segment(registry(), r, "it");
    EXPECT_TRUE(made.ok()) << made.error().sentence();
    return made.ok() ? (*made)->duration() : 0;
  };
  EXPECT_NEAR(time_of("trapezoidal"), L / V + V / A, 1e-12);
  EXPECT_NEAR(time_of("s_curve"), L / V + V / A + A / J, 1e-12);
  EXPECT_NEAR(time_of("cubic"), std::max(1.5 * L / V, std::sqrt(6 * L / A)), 1e-9);
  EXPECT_NEAR(time_of("quintic"), std::max(1.875 * L / V, std::sqrt(10 / std::sqrt(3.0) * L / A)),
              1e-9);
  EXPECT_NEAR(time_of("cycloidal"), std::max(2 * L / V, std::sqrt(2 * kPi * L / A)), 1e-9);
}

// Where the tool is: trapezoid a t^2 / 2, then v^2 / 2a + v (t - v/a), then L - a (T - t)^2 / 2;
// with a limited jerk J t^3 / 6 in the first phase of A / J, v (t - (v/a + a/J) / 2) at full speed
// (same books). The shapes in x = t / T: 3x^2 - 2x^3, 10x^3 - 15x^4 + 6x^5, x - sin(2 pi x) / (2
// pi).
TEST(Laws, PutTheToolWhereTheTextbookDoes) {
  const double L = 2, V = 0.5, A = 0.4, J = 1.5;
  const auto made = [&](const char* law, const std::map<std::string, double>& params) {
    model::TrajectorySegment r = record_of("line", {shift(0, 0, 0), shift(L, 0, 0)});
    r.law.name = law;
    for (const auto& [name, value] : params) r.law.params[name] = value;
    auto segment = motion::make_segment(registry(), r, "it");
    EXPECT_TRUE(segment.ok()) << segment.error().sentence();
    return *segment;
  };
  const auto trapezoid = made("trapezoidal", {{"speed", V}, {"acceleration", A}});
  const auto s_curve = made("s_curve", {{"speed", V}, {"acceleration", A}, {"jerk", J}});
  const double T = L / V + V / A, up = V / A, soft = V / A + A / J;
  for (int i = 0; i <= 50; ++i) {
    const double t = T * i / 50;
    const PathSample s = at(*trapezoid, t);
    EXPECT_NEAR(s.pose.p[0],
                t < up       ? A * t * t / 2
                : t < T - up ? V * (t - up / 2)
                             : L - A * (T - t) * (T - t) / 2,
                1e-12);
    EXPECT_NEAR(s.velocity[0], std::min({A * t, V, A * (T - t)}), 1e-12);
    const double y = T * i / 50 * (A / J) / T;  // within the first phase
    EXPECT_NEAR(at(*s_curve, y).pose.p[0], J * y * y * y / 6, 1e-12);
    EXPECT_NEAR(at(*s_curve, y).acceleration[0], J * y, 1e-11);
    const double z = soft + (L / V - soft) * i / 50;  // at full speed
    EXPECT_NEAR(at(*s_curve, z).pose.p[0], V * (z - soft / 2), 1e-12);
    const double x = i / 50.0, D = 3;
    EXPECT_NEAR(at(*made("cubic", {{"duration", D}}), D * x).pose.p[0], L * x * x * (3 - 2 * x),
                1e-12);
    EXPECT_NEAR(at(*made("quintic", {{"duration", D}}), D * x).pose.p[0],
                L * x * x * x * (10 + x * (6 * x - 15)), 1e-12);
    EXPECT_NEAR(at(*made("cycloidal", {{"duration", D}}), D * x).pose.p[0],
                L * (x - std::sin(2 * kPi * x) / (2 * kPi)), 1e-12);
    EXPECT_NEAR(at(*made("constant_acceleration", {{"duration", D}}), D * x).pose.p[0], L * x * x,
                1e-12);
  }
}

// Points of a circle about (1, -2, 0.5) with radius 0.7 in a tilted plane, by angle.
TEST(Arcs, LieOnTheirCircle) {
  const Pose plane = multiply(shift(1, -2, 0.5), multiply(turn_x(0.6), turn_y(-0.4)));
  const auto on = [&](double angle, double height = 0) {
    return multiply(plane, shift(0.7 * std::cos(angle), 0.7 * std::sin(angle), height));
  };
  const std::vector<double> centre{1, -2, 0.5}, axis{plane.R[2], plane.R[5], plane.R[8]};
  const auto expect_on = [&](const model::TrajectorySegment& r, double angle, double pitch) {
    const auto made = motion::make_segment(registry(), r, "it");
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    EXPECT_NEAR((*made)->length(), std::hypot(0.7, pitch) * angle, 1e-12);
    for (int i = 0; i <= 100; ++i) {
      const double share = i / 100.0;
      const Pose wanted = on(0.3 + share * angle, pitch * share * angle);
      EXPECT_LT(position_gap(at(**made, (*made)->duration() * share).pose, wanted), 1e-12);
    }
  };
  expect_on(record_of("arc", {on(0.3), on(1.1), on(2.4)}), 2.1, 0);
  expect_on(record_of("arc", {on(0.3), on(3.9), on(5.8)}), 5.5, 0);
  expect_on(record_of("circle", {on(0.3), on(1.1), on(2.4)}), 2 * kPi, 0);
  auto r = record_of("arc_centre", {on(0.3)});
  r.shape.params = {{"centre", centre}, {"axis", axis}, {"angle", 4.5}};
  expect_on(r, 4.5, 0);
  r = record_of("helix", {on(0.3)});
  r.shape.params = {{"centre", centre}, {"axis", axis}, {"turns", 1.5}, {"pitch", 0.2}};
  expect_on(r, 3 * kPi, 0.2 / (2 * kPi));
}

// A line along z, tangent orientation: x of the tool along the way, z as near to up as it can be.
TEST(Orientations, TangentPutsAnAxisAlongTheWay) {
  model::TrajectorySegment r =
      record_of("arc", {shift(1, 0, 0), shift(std::sqrt(0.5), std::sqrt(0.5), 0), shift(0, 1, 0)});
  r.orientation = {"tangent", {{"up", std::vector<double>{0, 0, 1}}}};
  const auto made = motion::make_segment(registry(), r, "it");
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double T = (*made)->duration(), speed = 0.1;
  for (int i = 0; i <= 20; ++i) {
    const PathSample s = at(**made, T * i / 20);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.pose.R[3 * k], s.velocity[k] / speed, 1e-12);
      EXPECT_NEAR(s.pose.R[3 * k + 2], k == 2 ? 1 : 0, 1e-12);
    }
    // Once round a circle of radius 1 in 2 pi / 0.1 s.
    EXPECT_NEAR(s.angular_velocity[2], speed, 1e-12);
    EXPECT_NEAR(s.angular_acceleration[2], 0, 1e-10);
  }
  r.orientation.params["up"] = std::vector<double>{1, 0, 0};
  EXPECT_FALSE(motion::make_segment(registry(), r, "it").ok()) << "the arc ends along up";
}

TEST(Laws, TellWhatIsImpossible) {
  const auto sentence = [](const model::TrajectorySegment& r) {
    const auto made = motion::make_segment(registry(), r, "it");
    return made.ok() ? std::string("no error") : made.error().sentence();
  };
  model::TrajectorySegment r = record_of("line", {shift(0, 0, 0), shift(1, 0, 0)});
  r.law = {"trapezoidal", {{"speed", 0.5}, {"acceleration", 1.0}, {"duration", 1.0}}};
  EXPECT_EQ(sentence(r),
            "it: a duration of 1 s is too short for the limits. The shortest is 2.5 s.");
  r.law.params = {{"speed", 2.0}, {"acceleration", 1.0}, {"end_speed", 1.9}};
  EXPECT_EQ(sentence(r),
            "it: to change from 0 m/s to 1.9 m/s takes 1.805 m, but the path is 1 m. Raise the "
            "acceleration (and jerk), or bring the speeds at the ends together.");
  r.law.params = {{"speed", 0.5}, {"start_speed", 0.7}};
  EXPECT_EQ(sentence(r),
            "it: the speed at an end is 0.7 m/s, above the maximum of 0.5 m/s. Lower it, or raise "
            "the speed.");
  r.law = {"constant_acceleration", {{"start_speed", 1.0}, {"duration", 5.0}}};
  EXPECT_EQ(sentence(r),
            "it: in 5 s the tool would run past the end. Shorten the duration to 2 s or less, or "
            "lower the speed.");
  r.law.name = "trapezoid";
  EXPECT_NE(sentence(r).find("trapezoidal"), std::string::npos) << sentence(r);
}

}  // namespace
}  // namespace robomosp::conformance

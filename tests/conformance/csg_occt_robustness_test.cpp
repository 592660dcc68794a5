// SPDX-License-Identifier: Apache-2.0
// The plugin csg_occt on operands that are hard: random ones, degenerate ones, nearly tangent ones.
// A result is right, or says by a note what it neglects, or is refused; never silently wrong.
//   ROBOMOSP_CSG_OPERATIONS=10000  random operations instead of a few hundred
//   ROBOMOSP_SEED=7                of the random operations
//   ROBOMOSP_CSG_PAIRS=362,408     only these pairs of the random operations
//   ROBOMOSP_CSG_VERBOSE=1         prints every refusal and remedy
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
// The suite itself runs in csg_occt_conformance_test.
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_DIR "/csg_occt.so";
constexpr double kPi = std::numbers::pi;

int number_from(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::atoi(text) : otherwise;
}
/// Numbers between commas; none when the variable is not set.
std::vector<int> numbers_from(const char* variable) {
  std::vector<int> numbers;
  const char* text = std::getenv(variable);
  std::istringstream words(text ? text : "");
  for (std::string word; std::getline(words, word, ',');)
    numbers.push_back(std::atoi(word.c_str()));
  return numbers;
}
bool is_verbose() { return number_from("ROBOMOSP_CSG_VERBOSE", 0) != 0; }

/// What became of a tree.
struct Outcome {
  enum class Kind { solid, empty, refused } kind = Kind::refused;
  double volume = 0;
  std::string note;   ///< a remedy that the engine reports
  std::string error;  ///< when refused
};

class OcctRobustness : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    engine_ = test::make_provider<CsgEngine>(kFile, "occt").release();
    // The same engine without its shortcut for prisms, so that these go the general way, too.
    setenv("ROBOMOSP_CSG_PRISMATIC", "off", 1);
    general_ = test::make_provider<CsgEngine>(kFile, "occt").release();
    unsetenv("ROBOMOSP_CSG_PRISMATIC");
  }
  static void TearDownTestSuite() {
    delete engine_;
    delete general_;
    engine_ = general_ = nullptr;
  }
  static Outcome outcome(const Csg& c) { return outcome(*engine_, c); }
  static Outcome outcome(const CsgEngine& engine, const Csg& c) {
    NoProgress progress;
    Outcome result;
    const auto s = engine.evaluate(c.tree(), progress);
    if (!s.ok()) {
      const bool is_empty = s.error().code == ErrorCode::invalid_argument &&
                            s.error().message.find("empty") != std::string::npos;
      result.kind = is_empty ? Outcome::Kind::empty : Outcome::Kind::refused;
      result.error = s.error().sentence();
      return result;
    }
    for (const std::string& note : (*s)->notes())
      if (note.find("pieces") == std::string::npos &&
          note.find("cuts nothing") == std::string::npos)
        result.note = note;
    const auto m = engine.moments(**s, progress);
    if (!m.ok()) {
      result.error = m.error().sentence();
      return result;
    }
    result.kind = Outcome::Kind::solid;
    result.volume = m->volume;
    return result;
  }
  static CsgEngine *engine_, *general_;
};
CsgEngine* OcctRobustness::engine_ = nullptr;
CsgEngine* OcctRobustness::general_ = nullptr;

/// Random solids; on a grid they meet in coplanar, tangent and coincident ways far more often than
/// free ones.
class Dice {
 public:
  Dice(unsigned seed, bool on_grid) : random_(seed), on_grid_(on_grid) {}

  double length(int low, int high) {
    if (on_grid_) return 0.005 * whole(low, high);
    return 0.005 * std::uniform_real_distribution<double>(low, high)(random_);
  }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

  Csg solid(bool also_drawn) {
    switch (whole(0, also_drawn ? 8 : 4)) {
      case 0: return box(length(2, 12), length(2, 12), length(2, 12));
      case 1: return cylinder(length(1, 6), length(2, 12));
      case 2: return sphere(length(2, 8));
      case 3: return cone(length(2, 6), length(0, 6), length(2, 12));
      case 4: {
        const double tube = length(1, 3);
        return torus(tube + length(1, 5), tube);
      }
      case 5: {
        const double x = length(3, 12);
        return wedge(x, length(2, 12), length(2, 12), whole(0, 1) == 0 ? 0 : x / 3);
      }
      case 6:
        return pyramid(whole(3, 8), length(2, 8), whole(0, 1) == 0 ? 0 : length(1, 4),
                       length(2, 12));
      case 7: {
        // A plate with a rounded side and a hole, or one with a bent side.
        const double a = length(3, 8), b = length(3, 8);
        CsgLoop outline{{-a, -b}, {line_to(a, -b)}};
        if (whole(0, 1) == 0) outline.curves.push_back(arc_to({a + b, 0}, {a, b}));
        else outline.curves.push_back(spline_to({{a + 0.01, -b / 3}, {a - 0.005, b / 3}, {a, b}}));
        outline.curves.push_back(line_to(-a, b));
        return prism({{outline, circle_loop(-a / 4, 0, 0.4 * std::min(a, b))}}, length(2, 12));
      }
      default: {
        const double in = length(0, 3), out = in + length(2, 6), h = length(2, 8);
        CsgLoop outline{{in, 0}, {line_to(out, 0), arc_to({out + 0.2 * h, h / 2}, {out, h})}};
        outline.curves.push_back(line_to(in, h));
        return revolution({{outline}});
      }
    }
  }
  Csg placed(const Csg& c, int i) {
    const Vec3 p{length(-6, 6), length(-6, 6), length(-6, 6)};
    if (!on_grid_) {
      const auto u = [&] { return std::uniform_real_distribution<double>(-1, 1)(random_); };
      return c.at(turned({u(), u(), 1.1 + u()}, kPi * u(), p));
    }
    if (i % 3 == 0) return c.at(turned({double(i % 2), 0, double(1 - i % 2)}, kPi / 4, p));
    return c.at(p[0], p[1], p[2]);
  }

 private:
  std::mt19937 random_;
  bool on_grid_;
};

// V(A u B) = V(A) + V(B) - V(A n B) and V(A - B) = V(A) - V(A n B) for whatever was not refused.
TEST_F(OcctRobustness, RandomOperationsAreRightOrRefused) {
  const int operations = number_from("ROBOMOSP_CSG_OPERATIONS", 210);
  const auto seed = static_cast<unsigned>(number_from("ROBOMOSP_SEED", 1));
  RecordProperty("seed", static_cast<int>(seed));
  const std::vector<int> pairs = numbers_from("ROBOMOSP_CSG_PAIRS");
  int refused = 0, remedied = 0, done = 0, wrong = 0;
  for (int n = 0; pairs.empty() ? done < operations : n < static_cast<int>(pairs.size()); ++n) {
    const int i = pairs.empty() ? n : pairs[static_cast<std::size_t>(n)];
    Dice dice(seed * 1'000'003U + static_cast<unsigned>(i), i % 2 == 0);
    const bool also_drawn = i % 4 >= 2;
    const Csg a = dice.solid(also_drawn), b = dice.placed(dice.solid(also_drawn), i / 2);
    const std::string what = "pair " + std::to_string(i) + " of seed " + std::to_string(seed);
    const Outcome A = outcome(a), B = outcome(b);
    ASSERT_EQ(A.kind, Outcome::Kind::solid) << what << ": " << A.error;
    ASSERT_EQ(B.kind, Outcome::Kind::solid) << what << ": " << B.error;
    const Outcome both = outcome(intersect({a, b})), either = outcome(unite({a, b})),
                  only = outcome(subtract({a, b}));
    done += 3;
    for (const Outcome* o : {&both, &either, &only}) {
      refused += o->kind == Outcome::Kind::refused ? 1 : 0;
      remedied += o->note.empty() ? 0 : 1;
      if (is_verbose() && (o->kind == Outcome::Kind::refused || !o->note.empty()))
        std::printf("%s: %s %s %s\n", what.c_str(), csg_info(a.node.kind).name.data(),
                    csg_info(b.node.kind).name.data(), (o->note + o->error).c_str());
    }
    // A fuzzy remedy moves surfaces by up to 1e-5 of the size and says so.
    const auto tolerance = [&](const Outcome& o) {
      return (o.note.empty() && both.note.empty() ? 1e-6 : 1e-4) * (A.volume + B.volume);
    };
    if (both.kind == Outcome::Kind::refused) continue;
    if (either.kind != Outcome::Kind::refused &&
        !(std::abs(either.volume - (A.volume + B.volume - both.volume)) <= tolerance(either))) {
      ++wrong;
      ADD_FAILURE() << what << ": union has " << either.volume << ", not "
                    << A.volume + B.volume - both.volume;
    }
    if (only.kind != Outcome::Kind::refused &&
        !(std::abs(only.volume - (A.volume - both.volume)) <= tolerance(only))) {
      ++wrong;
      ADD_FAILURE() << what << ": difference has " << only.volume << ", not "
                    << A.volume - both.volume;
    }
  }
  RecordProperty("refused", refused);
  RecordProperty("remedied", remedied);
  std::printf("%d operations: %d refused, %d by a remedy, %d wrong\n", done, refused, remedied,
              wrong);
  // One in ten thousand may be refused.
  EXPECT_LE(refused, (done + 9'999) / 10'000);
}

struct Row {
  std::string name;
  Csg solid;
  double volume;            ///< closed form; 0 = must be empty
  double relative = 1e-9;   ///< without a note
  double with_note = 1e-4;  ///< when the engine reports a remedy
  bool may_be_refused = false;
};

std::vector<Row> degenerate_rows() {
  std::vector<Row> rows;
  const auto add = [&](std::string name, Csg c, double volume, double relative = 1e-9) {
    rows.push_back({std::move(name), std::move(c), volume, relative});
  };
  const Csg cube = box(0.1, 0.1, 0.1);
  const Pose tilt = turned({1, 1, 0}, 5 * kPi / 180);
  for (const Pose& pose : {Pose{}, tilt}) {
    const std::string how = pose.R == Pose{}.R ? "" : ", turned by 5 degrees";
    add("coplanar faces, union" + how, unite({cube, cube.at(0.1, 0, 0)}).at(pose), 2e-3);
    add("shared side planes, union" + how, unite({cube, cube.at(0.05, 0, 0)}).at(pose), 1.5e-3);
    add("flush pocket" + how, subtract({cube, box(0.05, 0.05, 0.05).at(0, 0, 0.05)}).at(pose),
        8.75e-4);
    add("coaxial cylinders" + how, subtract({cylinder(0.05, 0.1), cylinder(0.04, 0.1)}).at(pose),
        kPi * 9e-4 * 0.1);
    add("coaxial cylinders, union" + how,
        unite({cylinder(0.05, 0.1), cylinder(0.04, 0.2)}).at(pose),
        kPi * (0.0025 * 0.1 + 0.0016 * 0.1));
    add("A - A" + how, subtract({cylinder(0.05, 0.1), cylinder(0.05, 0.1)}).at(pose), 0);
    add("A u A" + how, unite({cylinder(0.05, 0.1), cylinder(0.05, 0.1)}).at(pose),
        kPi * 0.0025 * 0.1);
    add("A n A" + how, intersect({cylinder(0.05, 0.1), cylinder(0.05, 0.1)}).at(pose),
        kPi * 0.0025 * 0.1);
    add("sphere u the same sphere" + how, unite({sphere(0.05), sphere(0.05)}).at(pose),
        4 * kPi / 3 * 1.25e-4);
  }
  add("cubes that share an edge", unite({cube, cube.at(0.1, 0.1, 0)}), 2e-3);
  add("hole as wide as the box", subtract({cube, cylinder(0.05, 0.1)}), 1e-3 - kPi * 2.5e-4);
  add("cubes that share a corner", unite({cube, cube.at(0.1, 0.1, 0.1)}), 2e-3);
  rows.push_back({"cylinder tangent to the side of a box",
                  unite({cylinder(0.005, 0.02), box(0.06, 0.03, 0.03).at(0.02, 0.02, 0.01)}),
                  kPi * 2.5e-5 * 0.02 + 0.06 * 0.03 * 0.03, 1e-9, 1e-9});
  rows.push_back(
      {"cylinders tangent from outside",
       unite({cylinder(0.02, 0.035),
              cylinder(0.005, 0.02).at(turned({0, 0, 1}, kPi / 4, {0, -0.025, -0.005}))}),
       kPi * (4e-4 * 0.035 + 2.5e-5 * 0.02), 1e-9, 1e-9});
  add("sphere that touches a plane", unite({cube, sphere(0.05).at(0, 0, 0.15)}),
      1e-3 + 4 * kPi / 3 * 1.25e-4);
  {
    const double r = 0.03;
    const Csg a = cylinder(r, 0.2).at(0, 0, -0.1);
    const Csg b = cylinder(r, 0.2).at(turned({0, 1, 0}, kPi / 2, {-0.1, 0, 0}));
    add("crossing equal cylinders, intersection", intersect({a, b}), 16.0 / 3 * r * r * r);
    add("crossing equal cylinders, union", unite({a, b}),
        2 * kPi * r * r * 0.2 - 16.0 / 3 * r * r * r);
    add("crossing equal cylinders, difference", subtract({a, b}),
        kPi * r * r * 0.2 - 16.0 / 3 * r * r * r);
  }
  // Radii 5 mm and 5.0001 mm, as crossing cylinders: the smaller lies almost wholly in the larger.
  // The share of the volume that distinguishes them is 3e-5, so the bound is wider.
  rows.push_back({"cylinders equal to 1e-4 mm, coaxial",
                  subtract({cylinder(0.0050001, 0.1), cylinder(0.005, 0.1)}),
                  kPi * (0.0050001 * 0.0050001 - 0.005 * 0.005) * 0.1, 1e-6});
  {
    const double r = 0.005, l = 0.05;
    const Csg a = cylinder(r, l).at(0, 0, -l / 2);
    const Csg b = cylinder(0.0050001, l).at(turned({0, 1, 0}, kPi / 2, {-l / 2, 0, 0}));
    rows.push_back(
        {"crossing cylinders equal to 1e-4 mm", intersect({a, b}), 16.0 / 3 * r * r * r, 1e-4});
  }
  for (const double angle : {1e-9, 1e-8, 3e-8, 1e-7, 1.5e-7, 2e-7, 3e-7, 1e-6, 1e-5, 1e-4}) {
    Row row{"box u box turned by " + std::to_string(angle * 1e9) + " nrad",
            unite({box(0.01, 0.01, 0.01), box(0.01, 0.01, 0.01).at(turned({0, 0, 1}, angle))}),
            1e-6 * (1 + angle / 2), 2e-6};
    row.may_be_refused = true;
    rows.push_back(row);
  }
  for (const double gap : {1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5})
    add("gap of " + std::to_string(gap * 1e9) + " nm", unite({cube, cube.at(0.1 + gap, 0, 0)}),
        2e-3, std::max(1e-9, 2 * gap / 0.1));
  for (const double overlap : {1e-11, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5})
    add("overlap of " + std::to_string(overlap * 1e9) + " nm",
        unite({cube, cube.at(0.1 - overlap, 0, 0)}), 2e-3 - 0.01 * overlap,
        std::max(1e-9, 2 * std::min(overlap, 1e-9) / 0.1));
  {
    // Sphere minus three bores, its pole on the rim of one: see csg_occt_test.cpp.
    const double R = 0.05, r = 0.02;
    const double one = 4 * kPi / 3 * (R * R * R - std::pow(R * R - r * r, 1.5));
    const double cut = 3 * one - 16 * r * r * r + 8 * (2 - std::sqrt(2.0)) * r * r * r;
    const Csg z = cylinder(r, 0.12).at(0, 0, -0.06);
    const Csg x = cylinder(r, 0.12).at(turned({0, 1, 0}, kPi / 2, {-0.06, 0, 0}));
    const Csg y = cylinder(r, 0.12).at(turned({1, 0, 0}, kPi / 2, {0, 0.06, 0}));
    rows.push_back({"pole on the cut",
                    subtract({sphere(R).at(turned({1, 0, 0}, std::asin(r / R))), x, y, z}),
                    4 * kPi / 3 * R * R * R - cut, 1e-8, 1e-8});
  }
  // build123d #590: boxes with a sphere cut out where they meet.
  add("two boxes minus a sphere in their joint",
      subtract({unite({cube, box(0.06, 0.06, 0.1).at(0, 0, 0.1)}), sphere(0.02).at(0, 0, 0.1)}),
      1e-3 + 3.6e-4 - 4 * kPi / 3 * 8e-6);
  add("two boxes minus a sphere at their edge",
      subtract({unite({cube, cube.at(0.1, 0, 0)}), sphere(0.02).at(0.05, 0, 0.1)}),
      2e-3 - 2 * kPi / 3 * 8e-6);
  // The new kinds: a hole tangent to a rounded end, a pyramid's tip on a face, a ridge in a face.
  CsgLoop slot{{-0.04, -0.03},
               {line_to(0.04, -0.03), arc_to({0.07, 0}, {0.04, 0.03}), line_to(-0.04, 0.03),
                arc_to({-0.07, 0}, {-0.04, -0.03})}};
  add("slot minus a hole of its own roundness",
      subtract({prism({{slot}}, 0.02), cylinder(0.03, 0.02).at(0.04, 0, 0)}),
      (0.08 * 0.06 + kPi * 9e-4 - kPi * 9e-4) * 0.02);
  add("pyramid with its tip on a face", unite({pyramid(5, 0.05, 0, 0.05), cube.at(0, 0, 0.05)}),
      5 * 0.0025 * std::sin(2 * kPi / 5) / 2 * 0.05 / 3 + 1e-3);
  add("ridge along a face", unite({frustum(0.1, 0.1, 0, 0.1, 0.05), cube.at(0, 0, 0.05)}),
      0.1 * 0.1 * 0.05 / 2 + 1e-3);
  add("revolution in its own hole",
      unite({revolution({{rectangle_loop(0.03, 0, 0.05, 0.04)}}), cylinder(0.03, 0.04)}),
      kPi * 0.0025 * 0.04);
  return rows;
}

TEST_F(OcctRobustness, DegenerateOperandsGiveTheRightVolumeOrSayWhatTheyNeglect) {
  for (const Row& row : degenerate_rows())
    for (const CsgEngine* engine : {engine_, general_}) {
      SCOPED_TRACE(row.name + (engine == general_ ? ", the general way" : ""));
      const Outcome o = outcome(*engine, row.solid);
      if (is_verbose())
        std::printf("%-45s %.12g (%.2e) %s%s\n", row.name.c_str(), o.volume,
                    row.volume > 0 ? o.volume / row.volume - 1 : o.volume, o.note.c_str(),
                    o.error.c_str());
      if (row.volume == 0) {
        EXPECT_EQ(o.kind, Outcome::Kind::empty) << o.error;
        continue;
      }
      if (o.kind == Outcome::Kind::refused && row.may_be_refused) continue;
      ASSERT_EQ(o.kind, Outcome::Kind::solid) << o.error;
      const double relative = o.note.empty() ? row.relative : std::max(row.relative, row.with_note);
      EXPECT_NEAR(o.volume, row.volume, relative * row.volume) << o.note;
    }
}

// Open CASCADE misses where these two cross unless their seams are turned, and not by every angle.
TEST_F(OcctRobustness, ToriThatCrossNearTheirSeamsHaveTheirCommonVolume) {
  const Outcome both =
      outcome(intersect({torus(0.02, 0.01), torus(0.035, 0.015).at(-0.005, -0.03, -0.01)}));
  ASSERT_EQ(both.kind, Outcome::Kind::solid) << both.error;
  const auto is_in = [](double x, double y, double z, double ring, double tube) {
    return std::hypot(std::hypot(x, y) - ring, z) < tube;
  };
  // By the midpoints of cubes of 0.2 mm in the first torus.
  const double h = 2e-4;
  int cubes = 0;
  for (double x = -0.03 + h / 2; x < 0.03; x += h)
    for (double y = -0.03 + h / 2; y < 0.03; y += h)
      for (double z = -0.01 + h / 2; z < 0.01; z += h)
        cubes += is_in(x, y, z, 0.02, 0.01) && is_in(x + 0.005, y + 0.03, z + 0.01, 0.035, 0.015);
  EXPECT_NEAR(both.volume, cubes * h * h * h, 1e-3 * both.volume);
}

// Many overlapping bumps on a ball (build123d #1271 has 155): together, and half by half.
TEST_F(OcctRobustness, ManyOverlappingBumpsJoin) {
  const int bumps = number_from("ROBOMOSP_CSG_BUMPS", 12);
  std::vector<Csg> all{intersect({sphere(0.05), box(0.2, 0.2, 0.1)})}, halves[2];
  for (int i = 0; i < bumps; ++i) {
    // A spiral of equal areas over the upper half.
    const double z = 0.05 * (i + 0.5) / bumps, ring = std::sqrt(0.0025 - z * z),
                 turn = 2.399963 * i;
    const Csg bump =
        sphere(0.016 / std::sqrt(bumps / 12.0)).at(ring * std::cos(turn), ring * std::sin(turn), z);
    all.push_back(bump);
    halves[i % 2].push_back(bump);
  }
  const Outcome together = outcome(unite(all));
  ASSERT_EQ(together.kind, Outcome::Kind::solid) << together.error;
  // Inclusion and exclusion of the two halves of the bumps, each with the ball.
  std::vector<Csg> one = halves[0], two = halves[1];
  one.push_back(all[0]);
  two.push_back(all[0]);
  const Outcome a = outcome(unite(one)), b = outcome(unite(two)),
                both = outcome(intersect({unite(one), unite(two)}));
  ASSERT_EQ(a.kind, Outcome::Kind::solid) << a.error;
  ASSERT_EQ(b.kind, Outcome::Kind::solid) << b.error;
  ASSERT_EQ(both.kind, Outcome::Kind::solid) << both.error;
  EXPECT_NEAR(together.volume, a.volume + b.volume - both.volume, 1e-6 * together.volume);
}

// Two discs and a plate whose sides are all but tangent to them. Rounding the corners leaves
// slivers between side and disc, from 1e-4 m down to nothing.
TEST_F(OcctRobustness, NearlyTangentPlatesJoin) {
  const bool all = number_from("ROBOMOSP_CSG_OPERATIONS", 0) > 1000;
  int refused = 0, count = 0, remedied = 0;
  for (const double R : {0.06, 0.05, 0.043, 0.1})
    for (const double r : {0.04, 0.0317, 0.02})
      for (const double d : {0.2, 0.173})
        for (const double step : {0.0, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
          if (!all && ++count % 8 != 1) continue;
          const double h = 0.02, c = (R - r) / d, s = std::sqrt(1 - c * c), angle = std::acos(c);
          const auto snap = [&](double x) { return step > 0 ? std::round(x / step) * step : x; };
          const double x1 = snap(R * c), y1 = snap(R * s), x2 = snap(d + r * c), y2 = snap(r * s);
          const Csg plate = unite({cylinder(R, h), cylinder(r, h).at(d, 0, 0),
                                   frustum(h, 2 * y1, h, 2 * y2, x2 - x1)
                                       .at(turned({0, 1, 0}, kPi / 2, {x1, 0, h / 2}))});
          const Outcome o = outcome(plate);
          const std::string what = "R " + std::to_string(R) + " r " + std::to_string(r) + " d " +
                                   std::to_string(d) + " step " + std::to_string(step * 1e9) +
                                   "e-9";
          remedied += o.note.empty() ? 0 : 1;
          if (o.kind != Outcome::Kind::solid) {
            ++refused;
            std::printf("%s: %s\n", what.c_str(), o.error.c_str());
            continue;
          }
          const double area =
              (x2 - x1) * (y1 + y2) + R * R * (kPi - angle + s * c) + r * r * (angle - s * c);
          EXPECT_NEAR(o.volume, area * h,
                      std::max(o.note.empty() ? 1e-9 : 1e-4, 4 * step / r) * area * h)
              << what << o.note;
        }
  RecordProperty("refused", refused);
  RecordProperty("remedied", remedied);
  EXPECT_EQ(refused, 0);
}

}  // namespace
}  // namespace robomosp::conformance

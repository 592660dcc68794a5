// SPDX-License-Identifier: Apache-2.0
#include "kernel/schema.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "kernel/bare_numbers.h"

namespace robomosp {
namespace {

constexpr double kSchemaHalfTurn = std::numbers::pi;
constexpr double kInf = std::numeric_limits<double>::infinity();

ParamSpec spec(std::string name, std::string type, std::string unit = {}) {
  ParamSpec s;
  s.name = std::move(name);
  s.type = std::move(type);
  s.unit = std::move(unit);
  return s;
}

std::string fault(const ParamSpec& s, const Value& v) {
  const auto r = check_value(s, v, s.name);
  return r.ok() ? "accepted: " + r->text() : r.error().sentence();
}

Value accepted(const ParamSpec& s, const Value& v) {
  auto r = check_value(s, v, s.name);
  EXPECT_TRUE(r.ok()) << r.error().sentence();
  return r.ok() ? *r : Value();
}

TEST(Schema, AWrongRealIsToldWithItsUnitAndAnExample) {
  EXPECT_EQ(fault(spec("speed", "real", "m/s"), "fast"),
            "speed: \"fast\" is not a real in m/s. Give a number such as 0.1 or \"100 mm/s\".");
  EXPECT_EQ(fault(spec("length", "real", "m"), "90 deg"),
            "length: 90 deg is an angle; a length (m) is expected.");
  EXPECT_EQ(fault(spec("length", "real", "m"), true),
            "length: true is not a real in m. Give a number such as 0.1 or \"100 mm\".");
}

TEST(Schema, AllFaultsAreToldAtOnce) {
  Schema schema = {spec("length", "real", "m"), spec("count", "int"), spec("mode", "enum")};
  schema[0].required = true;
  schema[2].choices = {"fast", "exact"};
  const auto r = check(schema, {{"lenght", 1}, {"count", 1.5}, {"mode", "exakt"}});
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().sentence(),
            "\"lenght\" is not a parameter. Did you mean \"length\"? "
            "length: no value is given; a real in m is required. Give a number such as 0.1 or "
            "\"100 mm\". "
            "count: 1.5 is not an integer. Give a whole number such as 3. "
            "mode: \"exakt\" is not one of the choices. Did you mean \"exact\"? Choices: fast and "
            "exact.");
  EXPECT_EQ(r.error().code, ErrorCode::invalid_argument);
}

TEST(Schema, AnUnknownParameterAloneIsAnUnknownName) {
  const auto r = check({spec("a", "int"), spec("b", "int")}, {{"zzz", 1}});
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::unknown_name);
  EXPECT_EQ(r.error().sentence(), "\"zzz\" is not a parameter. Parameters: a and b.");
  const auto two = check({spec("a", "int"), spec("b", "int")}, {{"yyy", 1}, {"zzz", 1}});
  ASSERT_FALSE(two.ok());
  EXPECT_EQ(two.error().sentence(),
            "\"yyy\" is not a parameter. \"zzz\" is not a parameter. Parameters: a and b.");
}

TEST(Schema, DefaultsAreFilledInAndConverted) {
  Schema schema = {spec("angle", "real", "rad"), spec("centre", "vec3", "m"),
                   spec("name", "string")};
  schema[0].default_value = Value("90 deg");
  schema[1].default_value = Value(List{0, "20 mm", 0.5});
  const auto r = check(schema, {});
  ASSERT_TRUE(r.ok());
  EXPECT_DOUBLE_EQ(r->find("angle")->number(), kSchemaHalfTurn / 2);
  EXPECT_EQ(r->find("centre")->as_array()->data(), (std::vector<double>{0, 0.02, 0.5}));
  EXPECT_EQ(r->find("name"), nullptr);
  const auto nil = check(schema, {{"angle", Value()}});
  ASSERT_TRUE(nil.ok());
  EXPECT_DOUBLE_EQ(nil->find("angle")->number(), kSchemaHalfTurn / 2);
}

TEST(Schema, NotANumberAndInfinityAreRefusedUnlessMeant) {
  ParamSpec s = spec("upper", "real", "rad");
  EXPECT_EQ(fault(s, kInf),
            "upper: inf is not a finite number. Give a number such as 1.57 or \"90 deg\".");
  EXPECT_EQ(fault(s, "inf"), fault(s, kInf));
  EXPECT_NE(fault(s, std::nan("")).find("nan is not a finite number"), std::string::npos);
  s.infinite = true;
  EXPECT_EQ(accepted(s, kInf), Value(kInf));
  EXPECT_NE(fault(s, std::nan("")).find("nan is not a finite number"), std::string::npos);
  s.max = 10;
  EXPECT_EQ(fault(s, kInf), "upper: inf rad is out of range; it must be at most 10 rad.");
}

TEST(Schema, RangesAreToldWithValueAndLimit) {
  ParamSpec s = spec("speed", "real", "m/s");
  s.min = kPositive;
  EXPECT_EQ(fault(s, 0.0), "speed: 0 m/s is out of range; it must be greater than 0.");
  s.max = 2;
  EXPECT_EQ(fault(s, "3000 mm/s"),
            "speed: 3 m/s is out of range; it must be greater than 0 and at most 2 m/s.");
  s.min = 1;
  EXPECT_EQ(fault(s, 0.5), "speed: 0.5 m/s is out of range; it must be 1 to 2 m/s.");
  ParamSpec i = spec("count", "int");
  i.min = 1;
  EXPECT_EQ(fault(i, 0), "count: 0 is out of range; it must be at least 1.");
}

TEST(Schema, IntegersTakeWholeRealsAndTexts) {
  const ParamSpec s = spec("n", "int");
  EXPECT_EQ(accepted(s, 3.0), Value(3));
  EXPECT_EQ(accepted(s, "-4"), Value(-4));
  EXPECT_NE(fault(s, 1e300).find("is not an integer"), std::string::npos);
  EXPECT_NE(fault(s, kInf).find("is not an integer"), std::string::npos);
  EXPECT_EQ(accepted(spec("on", "bool"), "yes"), Value(true));
  EXPECT_EQ(fault(spec("on", "bool"), 1), "on: 1 is not a bool. Give true or false.");
}

TEST(Schema, ListsOfRealsTellTheWrongEntry) {
  const ParamSpec s = spec("q", "real[]", "rad");
  EXPECT_EQ(accepted(s, List{1, "90 deg"}).as_array()->size(), 2U);
  EXPECT_EQ(accepted(s, "{0.5, 90 deg}").as_array()->size(), 2U);
  EXPECT_EQ(accepted(s, "0.5 1 2").as_array()->size(), 3U);
  EXPECT_EQ(accepted(s, Map()).as_array()->size(), 0U);
  // A number is a list of one.
  EXPECT_EQ(accepted(s, 0.5), Value(NumericArray({0.5})));
  EXPECT_EQ(accepted(s, 2), Value(NumericArray({2.0})));
  EXPECT_NEAR((*accepted(s, "90 deg").as_array())[0], 1.5707963267948966, 1e-15);
  EXPECT_FALSE(fault(spec("p", "vec3", "m"), 1).empty());
  EXPECT_EQ(fault(s, List{1, "x"}),
            "q[2]: \"x\" is not a real in rad. Give a number such as 1.57 or \"90 deg\".");
  EXPECT_EQ(fault(s, "1,,2"),
            "q[2]: \"\" is not a real in rad. Give a number such as 1.57 or \"90 deg\".");
  EXPECT_EQ(fault(spec("p", "vec3", "m"), List{1, 2}),
            "p: 2 numbers are given; three reals in m are needed. Give three numbers such as {0.1, "
            "0, 0.2}.");
}

TEST(Schema, NumbersThatAreUnlikelyInTheirUnitAreCollected) {
  const auto all = [](double) { return true; };
  const BareNumbers bare;
  (void)accepted(spec("alpha", "real", "rad"), 90);
  (void)accepted(spec("theta", "real", "rad"), 12);   // not quite two turns
  (void)accepted(spec("turns", "real", "rad"), 1e6);  // no angle in degrees either
  (void)accepted(spec("deg", "real", "rad"), "90 deg");
  (void)accepted(spec("x", "real", "m"), 431.8);
  (void)accepted(spec("y", "real", "m"), 25);
  (void)accepted(spec("f", "real", "N"), 300);
  (void)accepted(spec("far", "real", "m"), std::numeric_limits<double>::max());
  (void)accepted(spec("q", "real[]", "rad"), List{0.1, -170});
  const auto said = bare.numbers(all);
  ASSERT_EQ(said.size(), 3U);
  EXPECT_EQ(said[0],  // 90 * 180 / pi = 5156.62
            "alpha = 90 is taken as 90 rad, which is 5157 deg. Write \"90 deg\" for degrees.");
  EXPECT_EQ(said[1], "x = 431.8 is taken as 431.8 m. Write \"431.8 mm\" for millimetres.");
  EXPECT_TRUE(said[2].starts_with("q[2] = -170 is taken as -170 rad")) << said[2];
  EXPECT_EQ(bare.numbers([](double x) { return x == 90; }).size(), 1U);
  const BareNumbers many;
  List hundred;
  for (int i = 0; i < 100000; ++i) hundred.emplace_back(100.0 + i % 7);
  (void)accepted(spec("q", "real[]", "rad"), std::move(hundred));
  const auto few = many.numbers(all);
  ASSERT_EQ(few.size(), 3U);
  EXPECT_TRUE(few[2].ends_with("So are 97 further numbers of unlikely size.")) << few[2];
}

TEST(Schema, TextsWithoutAUnitAreToldToWhoeverAsks) {
  const auto all = [](std::string_view) { return true; };
  const BareNumbers outer;
  {
    const BareNumbers bare;
    (void)accepted(spec("x", "real", "m"), "200");
    (void)accepted(spec("x", "real", "m"), "0");
    (void)accepted(spec("y", "real", "m"), "200 mm");
    (void)accepted(spec("n", "real", ""), "7");
    (void)accepted(spec("q", "real[]", "rad"), "1, 30 deg, 4");
    const auto said = bare.sentences(all);
    ASSERT_EQ(said.size(), 3U);
    EXPECT_EQ(said[0],
              "x = \"200\" is taken as 200 m, since it names no unit. Write \"200 mm\" for "
              "millimetres.");
    EXPECT_TRUE(said[2].starts_with("q[3] = \"4\" is taken as 4 rad")) << said[2];
    EXPECT_EQ(bare.sentences([](std::string_view text) { return text == "1"; }).size(), 1U);
    const NumbersAreTexts quiet;
    (void)accepted(spec("z", "real", "m"), "200");
    EXPECT_EQ(bare.sentences(all).size(), 3U);
  }
  EXPECT_TRUE(outer.sentences(all).empty()) << "the innermost collects";
}

TEST(Schema, APoseIsTheSameHoweverItIsWritten) {
  const ParamSpec s = spec("target", "pose");
  // PA-10 pose of the paper: (0.557, 0, 0.374), rpy (pi, 0, pi), which is a half turn about y.
  const Value six = accepted(s, List{0.557, 0, 0.374, kSchemaHalfTurn, 0, kSchemaHalfTurn});
  const Value map = accepted(
      s, Map{{"position", List{"557 mm", 0, 0.374}}, {"rpy", List{"180 deg", 0, "180 deg"}}});
  const Value xyz =
      accepted(s, Map{{"position", List{0.557, 0, 0.374}}, {"xyz", List{0, kSchemaHalfTurn, 0}}});
  const Value zyz =
      accepted(s, Map{{"position", List{0.557, 0, 0.374}}, {"zyz", List{0, kSchemaHalfTurn, 0}}});
  const Value matrix = accepted(
      s, List{List{-1, 0, 0, 0.557}, List{0, 1, 0, 0}, List{0, 0, -1, 0.374}, List{0, 0, 0, 1}});
  const Value text = accepted(s, "557 mm, 0, 0.374, 180 deg, 0, 180 deg");
  for (const Value* v : {&six, &map, &xyz, &zyz, &text})
    for (std::size_t i = 0; i < 16; ++i)
      EXPECT_NEAR((*v->as_array())[i], (*matrix.as_array())[i], 1e-15) << v->text();
  const auto pose = pose_from(matrix);
  ASSERT_TRUE(pose.has_value());
  EXPECT_EQ(pose->p, (Vec3{0.557, 0, 0.374}));
  EXPECT_EQ(pose_value(*pose), matrix);
}

TEST(Schema, AnglesOfAPoseFollowTheirNotation) {
  // Independent: each notation applied to a vector as successive turns.
  const double a = 0.3, b = -0.7, c = 1.1;
  const auto turned = [](char axis, double angle, Vec3 v) {
    const double co = std::cos(angle), si = std::sin(angle);
    if (axis == 'x') return Vec3{v[0], co * v[1] - si * v[2], si * v[1] + co * v[2]};
    if (axis == 'y') return Vec3{co * v[0] + si * v[2], v[1], -si * v[0] + co * v[2]};
    return Vec3{co * v[0] - si * v[1], si * v[0] + co * v[1], v[2]};
  };
  const Vec3 v{0.2, -0.5, 0.9};
  const struct {
    const char* name;
    Vec3 expected;
  } cases[] = {
      {"rpy", turned('z', c, turned('y', b, turned('x', a, v)))},
      {"xyz", turned('x', a, turned('y', b, turned('z', c, v)))},
      {"zyz", turned('z', a, turned('y', b, turned('z', c, v)))},
  };
  for (const auto& one : cases) {
    const auto pose = pose_from(accepted(spec("t", "pose"), Map{{one.name, List{a, b, c}}}));
    ASSERT_TRUE(pose.has_value());
    for (std::size_t i = 0; i < 3; ++i) {
      const double got =
          pose->R[3 * i] * v[0] + pose->R[3 * i + 1] * v[1] + pose->R[3 * i + 2] * v[2];
      EXPECT_NEAR(got, one.expected[i], 1e-15) << one.name;
    }
  }
}

TEST(Schema, PosesTakeOtherCoordinatesQuaternionsAndAxesWithAngles) {
  const auto pose = [](Map m) {
    return pose_from(accepted(spec("t", "pose"), Value(std::move(m)))).value_or(Pose{});
  };
  const double h = std::sqrt(0.5);
  // 45 degrees about z; and 60 degrees from z (the height is a half).
  const Pose c = pose({{"cylindrical", List{2, "45 deg", "30 mm"}}});
  EXPECT_NEAR(c.p[0], 2 * h, 1e-15);
  EXPECT_NEAR(c.p[1], 2 * h, 1e-15);
  EXPECT_EQ(c.p[2], 0.03);
  const Pose s = pose({{"spherical", List{2, "90 deg", "60 deg"}}});
  EXPECT_NEAR(s.p[0], 0, 1e-15);
  EXPECT_NEAR(s.p[1], std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(s.p[2], 1, 1e-15);
  // A quarter turn about z takes x to y, in every spelling.
  for (const Pose& t :
       {pose({{"quaternion", List{2, 0, 0, 2}}}), pose({{"axis_angle", List{0, 0, 3, "90 deg"}}}),
        pose({{"axis_angle", Map{{"axis", List{0, 0, 1}}, {"angle", "90 deg"}}}}),
        pose({{"rpy", List{0, 0, "90 deg"}}})})
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_NEAR(t.R[i], (std::array<double, 9>{0, -1, 0, 1, 0, 0, 0, 0, 1})[i], 1e-15) << i;
  // A third of a turn about the space diagonal takes x to y to z.
  const Pose d = pose({{"axis_angle", List{1, 1, 1, "120 deg"}}});
  const Pose q = pose({{"quaternion", List{1, 1, 1, 1}}});
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_NEAR(d.R[i], (std::array<double, 9>{0, 0, 1, 1, 0, 0, 0, 1, 0})[i], 1e-15) << i;
    EXPECT_NEAR(q.R[i], d.R[i], 1e-15) << i;
  }
  const ParamSpec p = spec("t", "pose");
  EXPECT_NE(fault(p, Map{{"quaternion", List{0, 0, 0, 0}}}).find("the quaternion is zero"),
            std::string::npos);
  EXPECT_NE(fault(p, Map{{"axis_angle", List{0, 0, 0, 1}}}).find("the axis is zero"),
            std::string::npos);
  EXPECT_NE(fault(p, Map{{"spherical", List{1, 2, "3 m"}}}).find("3 m is a length"),
            std::string::npos);
  EXPECT_NE(fault(p, Map{{"spherical", List{1, 2, 3}}, {"position", List{1, 2, 3}}})
                .find("a pose has both spherical and position"),
            std::string::npos);
}

TEST(Schema, AMatrixThatIsNoRotationIsRefused) {
  const ParamSpec s = spec("t", "pose");
  const auto matrix = [](double r00, double r22) {
    return List{List{r00, 0, 0, 0}, List{0, 1, 0, 0}, List{0, 0, r22, 0}, List{0, 0, 0, 1}};
  };
  EXPECT_NE(fault(s, matrix(2, 1)).find("is not a rotation (off by 3;"), std::string::npos)
      << fault(s, matrix(2, 1));
  EXPECT_NE(fault(s, matrix(-1, 1)).find("is not a rotation"), std::string::npos);  // a mirror
  // Within rounding of a matrix typed with nine digits: made orthonormal again.
  const auto pose = pose_from(accepted(s, matrix(1 + 1e-8, 1)));
  ASSERT_TRUE(pose.has_value());
  EXPECT_NEAR(pose->R[0], 1, 1e-15);
  EXPECT_NE(fault(s, List{List{1, 2}, List{3, 4}}).find("2x2, not 4x4"), std::string::npos);
  EXPECT_NE(fault(s, Map{{"pos", List{0, 0, 0}}}).find("Did you mean \"position\"?"),
            std::string::npos);
  EXPECT_NE(fault(s, Map{{"position", List{0, 0}}}).find("t.position: 2 numbers are given"),
            std::string::npos);
  EXPECT_NE(fault(s, Map()).find("the pose is empty"), std::string::npos);
}

TEST(Schema, MatricesNeedRowsOfEqualLength) {
  const ParamSpec s = spec("m", "matrix");
  const Value m = accepted(s, List{List{1, 2, 3}, NumericArray({4, 5, 6})});
  EXPECT_EQ(m.as_array()->rows(), 2U);
  EXPECT_EQ(m.as_array()->at(1, 2), 6);
  EXPECT_EQ(fault(s, List{List{1, 2}, List{3}}),
            "m[2]: the row has 1 numbers, the first one 2. Give rows of equal length.");
  EXPECT_NE(fault(s, List{}).find("is not a matrix"), std::string::npos);
  EXPECT_NE(fault(s, 3).find("is not a matrix"), std::string::npos);
}

TEST(Schema, ReferencesAreResolvedToHandles) {
  const ParamSpec s = spec("robot", "ref:robot|object");
  const ResolveRef resolve = [](std::string_view kinds, const Value& v) -> Result<Handle> {
    EXPECT_EQ(kinds, "robot|object");
    if (v.as_string() && *v.as_string() == "pa10") return Handle{"robot", 17};
    return error(ErrorCode::unknown_name, "there is no robot \"pa1\"", "Did you mean \"pa10\"?");
  };
  EXPECT_EQ(*check_value(s, "pa10", "robot", resolve), Value(Handle{"robot", 17}));
  EXPECT_EQ(check_value(s, "pa1", "robot", resolve).error().sentence(),
            "robot: there is no robot \"pa1\". Did you mean \"pa10\"?");
  EXPECT_EQ(*check_value(s, Handle{"object", 2}, "robot"), Value(Handle{"object", 2}));
  EXPECT_EQ(fault(s, Handle{"world", 2}), "robot: world#2 is not a robot or object.");
  EXPECT_EQ(fault(s, 5), "robot: 5 is not a robot or object. Give its name or a handle.");
}

TEST(Schema, ChoicesThatAreNumbersMayBeGivenAsNumbers) {
  ParamSpec e = spec("degree", "enum");
  e.choices = {"3", "5"};
  EXPECT_EQ(*check_value(e, 5, "degree"), Value("5"));
  EXPECT_EQ(fault(e, 4), "degree: \"4\" is not one of the choices. Choices: 3 and 5.");
  EXPECT_EQ(fault(e, 5.5).substr(0, 12), "degree: 5.5 ");
}

TEST(Schema, DescriptionIsOneLineForHelp) {
  ParamSpec s = spec("speed", "real", "m/s");
  s.default_value = Value(0.1);
  s.min = kPositive;
  s.doc = "Speed along the path.";
  EXPECT_EQ(describe(s), "speed: real [m/s] = 0.1, greater than 0. Speed along the path.");
  ParamSpec e = spec("mode", "enum");
  e.choices = {"a", "b"};
  e.required = true;
  EXPECT_EQ(describe(e), "mode: enum a|b, required.");
}

TEST(Schema, AProviderTableBecomesASchema) {
  const rmp_param table[] = {
      {"damping", "real", "1", "Damping factor.", "0.01", nullptr, 1e-6, 1},
      {"radius", "real", "m", "Radius.", "20 mm", nullptr, 1, 0},
      {"mode", "enum", "", "How.", "exact", "fast|exact", 0, 0},
      {"points", "real[]", "m", "Points.", "0, 10 mm", nullptr, 1, 0},
      {"must", "int", "", "Needed.", nullptr, nullptr, 1, 0},
  };
  const auto schema = schema_from(table);
  ASSERT_TRUE(schema.ok()) << schema.error().sentence();
  auto checked = check(*schema, {{"must", 4}});
  ASSERT_TRUE(checked.ok()) << checked.error().sentence();
  const auto params = make_params(*checked);
  EXPECT_EQ(params->real("damping"), 0.01);
  EXPECT_EQ(params->real("radius"), 0.02);
  EXPECT_EQ(params->text("mode"), "exact");
  EXPECT_EQ(params->integer("must"), 4);
  ASSERT_EQ(params->reals("points").size(), 2U);
  EXPECT_EQ(params->reals("points")[1], 0.01);
  EXPECT_TRUE(params->has("mode"));
  EXPECT_FALSE(params->has("other"));
  EXPECT_EQ(params->text("other"), "");
  EXPECT_EQ(params->real("mode"), 0);
  EXPECT_EQ(params->pose("other").R[0], 1);
  EXPECT_FALSE(check(*schema, {}).ok());
  EXPECT_FALSE(check(*schema, {{"must", 4}, {"damping", 2}}).ok());
}

TEST(Schema, AMalformedProviderRowIsNamed) {
  const auto sentence = [](rmp_param row) {
    const auto r = schema_from({&row, 1});
    return r.ok() ? std::string("accepted") : r.error().sentence();
  };
  EXPECT_EQ(sentence({nullptr, "real", "", "", nullptr, nullptr, 1, 0}),
            "parameter row 1 has no name.");
  EXPECT_EQ(sentence({"a", "float", "", "", nullptr, nullptr, 1, 0}),
            "parameter \"a\" has the unknown type \"float\".");
  EXPECT_EQ(sentence({"a", nullptr, "", "", nullptr, nullptr, 1, 0}),
            "parameter \"a\" has the unknown type \"(null)\".");
  EXPECT_EQ(sentence({"a", "enum", "", "", "x", nullptr, 1, 0}),
            "parameter \"a\" is an enum without choices.");
  EXPECT_EQ(sentence({"a", "real", "m", "", "5", nullptr, 0, 1}),
            "parameter \"a\" has a bad default: 5 m is out of range; it must be 0 to 1 m.");
  EXPECT_EQ(sentence({"a", "real", "furlong", "", "5", nullptr, 1, 0}).substr(0, 44),
            "parameter \"a\" has a bad unit: \"furlong\" is n");
  EXPECT_EQ(sentence({"a", "real", nullptr, nullptr, nullptr, nullptr, 1, 0}), "accepted");
}

TEST(Schema, OfManyUnknownNamesTheFirstAreNamedAndTheOthersCounted) {
  Map given;
  for (int i = 0; i < 100'000; ++i) given.append("k" + std::to_string(i), i);
  const auto checked = check(Schema{}, given);
  ASSERT_FALSE(checked.ok());
  const std::string said = checked.error().sentence();
  EXPECT_NE(said.find("\"k9\""), std::string::npos) << said;
  EXPECT_EQ(said.find("\"k10\""), std::string::npos) << said;
  EXPECT_NE(said.find("99990 further names"), std::string::npos) << said;
  EXPECT_LT(said.size(), 1000U);
}

}  // namespace
}  // namespace robomosp

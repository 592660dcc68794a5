// SPDX-License-Identifier: Apache-2.0
#include "kernel/expression.h"

#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr units::Dimension kNumber{}, kLength{1, 0, 0, 0}, kArea{2, 0, 0, 0}, kAngle{0, 0, 0, 1};

/// bore = 20 mm, width = 0.1 m, n = 3, tilt = 30 deg, cell.bore = 8 mm, 'my cell-2'.gap = 1 mm.
Result<Quantity> sample(const Expression::Name& n) {
  const std::map<std::string, Quantity> known{{"bore", {0.02, kLength, false}},
                                              {"width", {0.1, kLength, false}},
                                              {"n", {3, kNumber, false}},
                                              {"none", {0, kNumber, false}},
                                              {"tilt", {kPi / 6, kAngle, false}},
                                              {"cell.bore", {0.008, kLength, false}},
                                              {"'my cell-2'.gap", {0.001, kLength, false}}};
  const auto it = known.find(Expression::spell(n));
  if (it != known.end()) return it->second;
  return error(ErrorCode::unknown_name,
               "there is no parameter " + text::quote(Expression::spell(n)));
}

Result<Quantity> evaluate(std::string_view text) {
  auto e = Expression::compile(text);
  if (!e.ok()) return std::move(e).error();
  return e->evaluate(sample);
}
Result<double> evaluate(std::string_view text, std::string_view unit) {
  auto e = Expression::compile(text);
  if (!e.ok()) return std::move(e).error();
  return e->evaluate(sample, unit);
}
std::string sentence(std::string_view text) {
  const auto r = evaluate(text);
  return r.ok() ? "ok" : r.error().sentence();
}

TEST(Expression, ValuesHaveTheirUnit) {
  const struct {
    const char* text;
    const char* unit;
    double value;
  } cases[] = {
      {"3 mm", "m", 0.003},
      {"35mm", "m", 0.035},
      {"bore/2 + 3 mm", "m", 0.013},
      {"  bore * 2  ", "m", 0.04},
      {"-bore", "m", -0.02},
      {"- -+-bore", "m", -0.02},
      {"2 - -3", "", 5},
      {"(bore + width) / 2", "m", 0.06},
      {"width - bore - bore", "m", 0.06},
      {"width / bore / 2", "", 2.5},
      {"width / (bore / 2)", "", 10},
      {"2 + 3 * 4", "", 14},
      {"-2^2", "", -4},
      {"(-2)^2", "", 4},
      {"2^3^2", "", 512},
      {"(2^3)^2", "", 64},
      {"2^-1", "", 0.5},
      {"2^0.5", "", std::sqrt(2.0)},
      {"bore^2", "m^2", 4e-4},
      {"6 mm / 2 mm", "", 3},
      {"1 / 2 mm", "1/m", 500},
      {"10 kg/m^3 * bore^3", "kg", 8e-5},
      {"3 N m", "N m", 3},
      {"100 mm/s * 2 s", "m", 0.2},
      {"100 mm / s * 2 s", "m", 0.2},
      {"9.81 m s^-2 * 1 s^2", "m", 9.81},
      {"7.85 g/cm^3", "kg/m^3", 7850},
      {"50 % * bore", "m", 0.01},
      {"floor(27.9 mm / mm) * mm", "m", 0.027},
      {"round(width / (30 mm)) * 30 mm", "m", 0.09},
      {"6 mm/min(2, 3)", "m", 0.003},
      {"60 s / min", "", 1},
      {"cell.bore + bore", "m", 0.028},
      {"'my cell-2'.gap * 2", "m", 0.002},
      {"pi * bore", "m", kPi * 0.02},
      {"1e3 mm", "m", 1},
      {".5 m", "m", 0.5},
      {"2.e-1", "", 0.2},
      {"if(bore > 10 mm, 1 mm, 2 mm)", "m", 0.001},
      {"if(n == 4, bore, 2 * bore)", "m", 0.04},
      {"if(n >= 3 and not bore > width, 1, 2)", "", 1},
      {"if(n < 3 or n != 3 or bore <= 20 mm, 1, 2)", "", 1},
      {"min(bore, width, 5 mm)", "m", 0.005},
      {"max(bore, width) ", "m", 0.1},
      {"abs(bore - width)", "m", 0.08},
      {"sqrt(bore * bore)", "m", 0.02},
      {"sqrt(2)", "", std::sqrt(2.0)},
      {"hypot(3 mm, 4 mm)", "m", 0.005},
      {"ceil(2.1) + floor(-2.1) + round(2.5)", "", 3},
      {"sin(30 deg)", "", 0.5},
      {"cos(2 * tilt)", "", 0.5},
      {"tan(45 deg)", "", 1},
      {"asin(0.5)", "rad", kPi / 6},
      {"acos(0.5)", "rad", kPi / 3},
      {"atan(1)", "rad", kPi / 4},
      {"atan2(bore, -bore)", "rad", 3 * kPi / 4},
      {"atan2(0, width)", "rad", 0},
      {"2 * tilt", "rad", kPi / 3},
      {"pi / 2 * rad", "rad", kPi / 2},
      {"tilt / deg", "", 30},
  };
  for (const auto& c : cases) {
    const auto r = evaluate(c.text, c.unit);
    ASSERT_TRUE(r.ok()) << c.text << ": " << r.error().sentence();
    EXPECT_NEAR(*r, c.value, 1e-14 * std::fabs(c.value) + 1e-16) << c.text;
  }
}

TEST(Expression, ANumberWithAUnitHasTheBitsOfTheQuantity) {
  for (const char* q : {"35 mm", "0.1 in", "57 deg/s", "7.85 g/cm^3", "33 kg mm^2", "12 N m/rad"}) {
    const auto e = Expression::compile(q);
    ASSERT_TRUE(e.ok());
    EXPECT_TRUE(e->is_literal()) << q;
    const auto v = e->evaluate(sample);
    const std::string unit = units::si_name(v->dimension);
    EXPECT_EQ(std::bit_cast<std::uint64_t>(v->value),
              std::bit_cast<std::uint64_t>(*units::read_quantity(q, unit)))
        << q << " " << unit;
  }
  EXPECT_TRUE(Expression::compile("-5 mm")->is_literal());
  EXPECT_FALSE(Expression::compile("5 mm + 0")->is_literal());
  EXPECT_FALSE(Expression::compile("bore")->is_literal());
}

TEST(Expression, ZeroFitsEverythingAndOtherPlainNumbersDoNot) {
  EXPECT_EQ(*evaluate("bore + 0", "m"), 0.02);
  EXPECT_EQ(*evaluate("max(0, -bore)", "m"), 0);
  EXPECT_EQ(*evaluate("if(bore > 0, bore, 0)", "m"), 0.02);
  EXPECT_EQ(*evaluate("0", "rad"), 0);
  EXPECT_EQ(*evaluate("-0", "m"), 0);
  EXPECT_EQ(
      sentence("bore + 1"),
      "at character 6 of \"bore + 1\": a length (bore) and a number without a unit (1) cannot "
      "be added. Give the number a unit.");
  // Only the written 0: a parameter that happens to be 0 keeps its dimension.
  EXPECT_FALSE(evaluate("bore + none").ok());
  EXPECT_EQ(
      evaluate("5 * 4", "m").error().sentence(),
      "\"5 * 4\" is a number without a unit; a length (m) is expected. Multiply it by a unit, "
      "such as mm.");
}

TEST(Expression, RadiansCountAsOneWhereThereAreMetresOrKilograms) {
  EXPECT_NEAR(*evaluate("bore * tilt", "m"), 0.02 * kPi / 6, 1e-17);  // an arc
  EXPECT_NEAR(*evaluate("width + bore * tilt", "m"), 0.1 + 0.02 * kPi / 6, 1e-16);
  EXPECT_NEAR(*evaluate("2 N m / rad * 3 rad", "N m"), 6, 1e-15);  // a spring
  EXPECT_NEAR(*evaluate("bore * tilt / bore", "rad"), kPi / 6, 1e-16);
  EXPECT_NEAR(*evaluate("sqrt(width * bore * tilt)", "m"), std::sqrt(0.1 * 0.02 * kPi / 6), 1e-16);
  EXPECT_NEAR(*evaluate("2 m/s / width", "1/s"), 20, 1e-14);
  // Without them an angle is no number: 90 is not 90 deg, and 50 Hz not 50 rad/s.
  EXPECT_FALSE(evaluate("tilt + 1").ok());
  EXPECT_FALSE(evaluate("1", "rad").ok());
  EXPECT_FALSE(evaluate("50 Hz * 1", "rad/s").ok());
  EXPECT_FALSE(evaluate("tilt", "").ok());
  EXPECT_EQ(
      sentence("sin(90)"),
      "at character 1 of \"sin(90)\": sin needs an angle; 90 is a number without a unit. Write "
      "30 deg, or multiply a number of radians by rad.");
}

TEST(Expression, AFaultIsOneSentenceWithItsPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"3 mm + 2 deg",
       "at character 6 of \"3 mm + 2 deg\": a length (3 mm) and an angle (2 deg) cannot be added."},
      {"bore < tilt",
       "at character 6 of \"bore < tilt\": a length (bore) and an angle (tilt) cannot be "
       "compared."},
      {"", "at character 1 of \"\": the expression is empty."},
      {"bore +", "at character 7 of \"bore +\": the expression ends where a value is expected."},
      {"(bore",
       "at character 1 of \"(bore\": this bracket is not closed. Add the \")\" that is "
       "missing."},
      {"bore)", "at character 5 of \"bore)\": \")\" is not expected here."},
      {"2 bore",
       "at character 3 of \"2 bore\": \"bore\" is not a unit. A name right behind a number is its "
       "unit; write a product as 2 * bore."},
      {"3 degg", "at character 3 of \"3 degg\": \"degg\" is not a unit. Did you mean \"deg\"?"},
      {"bore mm",
       "at character 6 of \"bore mm\": an operator is missing before \"mm\". Products are "
       "written with *: 2 * bore. Only a unit follows a number directly."},
      {"boore / 2", "at character 1 of \"boore / 2\": there is no parameter \"boore\"."},
      {"sqr(n)",
       "at character 1 of \"sqr(n)\": there is no function \"sqr\". Did you mean \"sqrt\"?"},
      {"sqrt", "at character 1 of \"sqrt\": \"sqrt\" is a function. Write sqrt(area)."},
      {"atan2(bore)",
       "at character 1 of \"atan2(bore)\": \"atan2\" is given 1 argument. Write atan2(y, x)."},
      {"bore = 3",
       "at character 6 of \"bore = 3\": \"=\" is not an operator. Equality is written ==."},
      {"1 < 2 < 3",
       "at character 7 of \"1 < 2 < 3\": comparisons cannot follow each other. Write a < b and b < "
       "c."},
      {"bore > 1 mm",
       "at character 1 of \"bore > 1 mm\": this is a condition, not a quantity. Use a condition "
       "within if: if(a > b, a, b)."},
      {"if(bore, 1, 2)",
       "at character 1 of \"if(bore, 1, 2)\": a length (bore) is not a condition. Compare it: bore "
       "> 0."},
      {"if(n > 1, bore, tilt)",
       "at character 1 of \"if(n > 1, bore, tilt)\": a length (bore) and an angle (tilt) cannot be "
       "alternatives of one if."},
      {"bore^0.5",
       "at character 5 of \"bore^0.5\": a length (bore) can be raised to whole powers "
       "from -9 to 9, not to 0.5. Roots of it are taken with sqrt."},
      {"sqrt(bore)", "at character 1 of \"sqrt(bore)\": the root of a length (bore) has no unit."},
      {"sqrt(-1)", "at character 1 of \"sqrt(-1)\": the root of a negative number: -1 is -1."},
      {"bore / (n - 3)", "at character 6 of \"bore / (n - 3)\": division by zero: n - 3 is 0."},
      {"floor(bore)",
       "at character 1 of \"floor(bore)\": floor needs a number without a unit; bore "
       "is a length. Divide by the unit first: floor(bore / mm) * mm."},
      {"asin(n)", "at character 1 of \"asin(n)\": asin needs a number from -1 to 1; n is 3."},
      {"1e300 * 1e300",
       "at character 7 of \"1e300 * 1e300\": 1e300 * 1e300 is beyond the range of real numbers."},
      {"1e999", "at character 1 of \"1e999\": \"1e999\" is outside the range of real numbers."},
      {"3 mm^n",
       "at character 6 of \"3 mm^n\": the power of a unit is a whole number from -9 to 9. "
       "The power of a number with its unit is written in brackets: (3 mm)^2."},
      {"'my cell'",
       "at character 1 of \"'my cell'\": a name in quotes is that of a world and needs "
       "a parameter behind it. Such as 'my cell'.bore."},
  };
  for (const auto& [text, wanted] : cases) EXPECT_EQ(sentence(text), wanted);
  for (const char* bad : {"1 2",   "1.2.3",    "()",          "(,)",      "min()",
                          "a..b",  "a.",       ".",           "'",        "''",
                          "@",     "bore\x01", "b\xC3\xB6re", "1 +* 2",   "*2",
                          "2^",    "not",      "a and",       "3 mm mm2", "if(1 > 2, 3)",
                          "cell.", "cell.2",   "f(x",         "2 pi",     "5 sin(1 deg)",
                          "m s"})
    EXPECT_FALSE(evaluate(bad).ok()) << bad;
}

TEST(Expression, TheBranchNotTakenNeedsNoValueButItsUnit) {
  EXPECT_EQ(*evaluate("if(none == 0, 0 mm, bore / none)", "m"), 0);
  EXPECT_EQ(*evaluate("if(none != 0 and 1 / none > 2, 1, 2)", ""), 2);
  EXPECT_EQ(*evaluate("if(none == 0 or sqrt(-1) > 2, 1, 2)", ""), 1);
  EXPECT_FALSE(evaluate("if(none != 0, 0 mm, bore / none)").ok());
  EXPECT_FALSE(evaluate("if(none == 0, 0 mm, tilt / none)").ok());
}

TEST(Expression, NamesAreListedAndRenamed) {
  const auto e = Expression::compile("bore/2 +cell.bore* bore - 'my cell-2'.gap");
  ASSERT_TRUE(e.ok());
  const std::vector<Expression::Name> wanted{{"", "bore"}, {"cell", "bore"}, {"my cell-2", "gap"}};
  EXPECT_EQ(e->names(), wanted);
  const auto to = [](const char* scope, const char* from, const char* name) {
    return [=](const Expression::Name& n) {
      return n.scope == scope && n.name == from ? Expression::Name{n.scope, name} : n;
    };
  };
  EXPECT_EQ(e->renamed(to("", "bore", "hole")), "hole/2 +cell.bore* hole - 'my cell-2'.gap");
  EXPECT_EQ(e->renamed(to("cell", "bore", "x")), "bore/2 +cell.x* bore - 'my cell-2'.gap");
  EXPECT_EQ(e->renamed([](const Expression::Name& n) {
    return n.scope == "cell" ? Expression::Name{"cell 2", n.name} : n;
  }),
            "bore/2 +'cell 2'.bore* bore - 'my cell-2'.gap");
}

TEST(Expression, UnitsFunctionsAndConstantsCannotNameAParameter) {
  for (const char* good : {"bore", "_x", "wall2", "M", "height", "Pi"})
    EXPECT_TRUE(Expression::check_name(good, "parameter").ok()) << good;
  for (const char* bad : {"", "2x", "a-b", "a b", "a.b", "mm", "h", "pi", "sqrt", "min", "and"})
    EXPECT_FALSE(Expression::check_name(bad, "parameter").ok()) << bad;
  EXPECT_EQ(Expression::check_name("h", "parameter").error().sentence(),
            "\"h\" cannot name a parameter: it is a unit. Choose a longer one, such as h_1.");
}

TEST(Expression, DepthAndLengthAreLimited) {
  const auto repeat = [](const std::string& s, std::size_t n) {
    std::string out;
    while (n-- > 0) out += s;
    return out;
  };
  EXPECT_TRUE(evaluate(repeat("(", 50) + "1" + repeat(")", 50)).ok());
  EXPECT_TRUE(evaluate("1" + repeat(" + 1", 900)).ok());
  for (const std::string& deep :
       {repeat("(", 2000) + "1" + repeat(")", 1900), repeat("-", 3999) + "1",
        repeat("abs(", 900) + "1", repeat("2^", 1999) + "1",
        "if(" + repeat("not ", 900) + "1 > 2,1,2)"}) {
    const auto r = evaluate(deep);
    ASSERT_FALSE(r.ok());
    EXPECT_NE(r.error().message.find("nested more than 60 levels"), std::string::npos)
        << r.error().sentence();
  }
  EXPECT_FALSE(evaluate("1" + repeat(" + 1", 1000)).ok());
}

/// A random expression with its value computed beside it.
class Generator {
 public:
  explicit Generator(unsigned seed) : random_(seed) {}
  struct Made {
    std::string text;
    double value = 0;
  };
  std::size_t pick(std::size_t n) { return random_() % n; }

  Made number(int depth) {
    if (depth <= 0) {
      if (pick(3) == 0) return {"n", 3};
      const double v = static_cast<double>(1 + pick(900)) / 100;
      return {text::print(v), v};
    }
    switch (pick(9)) {
      case 0: return pair(number(depth - 1), " + ", number(depth - 1), std::plus<>());
      case 1: return pair(number(depth - 1), "-", number(depth - 1), std::minus<>());
      case 2: return pair(number(depth - 1), "*", number(depth - 1), std::multiplies<>());
      case 3: {
        const Made a = length(depth - 1);
        return {"(" + a.text + ") / (7 mm)", a.value / (7.0 / 1000)};
      }
      case 4: {
        const Made a = angle(depth - 1);
        return {"sin(" + a.text + ")", std::sin(a.value)};
      }
      case 5: {
        const Made a = number(depth - 1);
        return {"(" + a.text + ")^2", a.value * a.value};
      }
      case 6: {
        const Made a = number(depth - 1);
        return {"-(" + a.text + ")", -a.value};
      }
      case 7: {
        const Made a = number(depth - 1), b = number(depth - 1), c = length(depth - 1),
                   d = length(depth - 1);
        return {"if(" + c.text + " < " + d.text + ", " + a.text + ", " + b.text + ")",
                c.value < d.value ? a.value : b.value};
      }
      default: {
        const Made a = number(depth - 1);
        return {"floor(" + a.text + ")", std::floor(a.value)};
      }
    }
  }
  Made length(int depth) {
    if (depth <= 0) {
      if (pick(2) == 0) return {"bore", 0.02};
      const int v = static_cast<int>(1 + pick(500));
      return {std::to_string(v) + (pick(2) ? " mm" : "mm"), v / 1000.0};
    }
    switch (pick(6)) {
      case 0: return pair(length(depth - 1), " + ", length(depth - 1), std::plus<>());
      case 1: return pair(length(depth - 1), " - ", length(depth - 1), std::minus<>());
      case 2: return pair(number(depth - 1), " * ", length(depth - 1), std::multiplies<>());
      case 3: {
        const Made a = length(depth - 1), b = length(depth - 1);
        return {"max(" + a.text + "," + b.text + ")", std::fmax(a.value, b.value)};
      }
      case 4: {
        const Made a = length(depth - 1), b = length(depth - 1);
        return {"hypot(" + a.text + ", " + b.text + ")", std::hypot(a.value, b.value)};
      }
      default: {
        const Made a = length(depth - 1);
        return {"abs(" + a.text + ")", std::fabs(a.value)};
      }
    }
  }
  Made angle(int depth) {
    if (depth <= 0) return {"tilt", kPi / 6};
    if (pick(2) == 0) return pair(number(depth - 1), "*", angle(depth - 1), std::multiplies<>());
    const Made y = length(depth - 1), x = length(depth - 1);
    return {"atan2(" + y.text + ", " + x.text + ")", std::atan2(y.value, x.value)};
  }

 private:
  template <class Fn>
  Made pair(const Made& a, const char* op, const Made& b, Fn fn) {
    return {"(" + a.text + ")" + op + "(" + b.text + ")", fn(a.value, b.value)};
  }
  std::mt19937 random_;
};

TEST(Expression, RandomTreesHaveTheValueComputedBesideThem) {
  constexpr unsigned kSeed = 4711;
  RecordProperty("seed", static_cast<int>(kSeed));
  Generator g(kSeed);
  for (int i = 0; i < 4000; ++i) {
    const auto made = g.length(static_cast<int>(g.pick(5)));
    const auto e = Expression::compile(made.text);
    ASSERT_TRUE(e.ok()) << e.error().sentence();
    const auto v = e->evaluate(sample, "m");
    ASSERT_TRUE(v.ok()) << made.text << "\n" << v.error().sentence();
    ASSERT_EQ(*v, made.value) << made.text;

    // Printed without needless brackets it is the same program.
    const std::string printed = e->print();
    const auto again = Expression::compile(printed);
    ASSERT_TRUE(again.ok()) << printed << "\n" << again.error().sentence();
    ASSERT_TRUE(*again == *e) << made.text << "\n" << printed;
    ASSERT_EQ(again->print(), printed);
    ASSERT_LE(printed.size(), made.text.size() + 40);
  }
}

TEST(Expression, PrintingKeepsWhatBracketsSay) {
  for (const char* s : {"(3 mm) / s",
                        "3 mm/s",
                        "(3 mm)^2",
                        "-2^2",
                        "(-2)^2",
                        "2^-1",
                        "(2^3)^2",
                        "2^3^2",
                        "a - (b - c)",
                        "a - b - c",
                        "a / (b * c)",
                        "a * (b / c)",
                        "not (a > b and c > d) or e < f",
                        "-(a + b)",
                        "a * -b",
                        "(2 * 3 mm) / s",
                        "(a < b) == (c < d)",
                        "'my cell'.x + cell.y",
                        "min(a, -b, (c))",
                        "3 mm^2 * m"}) {
    const auto e = Expression::compile(s);
    ASSERT_TRUE(e.ok()) << e.error().sentence();
    const auto again = Expression::compile(e->print());
    ASSERT_TRUE(again.ok()) << s << " -> " << e->print();
    EXPECT_TRUE(*again == *e) << s << " -> " << e->print();
  }
  EXPECT_EQ(Expression::compile("((a)+(b))*(2 mm)")->print(), "(a + b) * 2 mm");
  EXPECT_EQ(Expression::compile("(3 mm)/s")->print(), "(3 mm) / s");
  EXPECT_EQ(Expression::compile("3 mm/bore")->print(), "3 mm / bore");
  EXPECT_FALSE(*Expression::compile("a - b - c") == *Expression::compile("a - (b - c)"));
}

TEST(Expression, RandomTextsNeverCrash) {
  constexpr unsigned kSeed = 815;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937 random(kSeed);
  const char* const pieces[] = {"bore",   "cell.bore", "'my cell-2'.gap",
                                "3",      "2.5",       "mm",
                                "deg",    "^",         "^2",
                                "+",      "-",         "*",
                                "/",      "(",         ")",
                                ",",      "if(",       "sqrt(",
                                "atan2(", "min(",      "floor(",
                                "hypot(", "<",         "==",
                                " and ",  " or ",      "not ",
                                "pi",     "kg/m^3",    ".",
                                "'",      "0",         "1e300",
                                "%",      " ",         "\xC3\xA4",
                                "n",      "tilt",      "!=",
                                "\n",     "\"",        "#",
                                "none"};
  std::size_t good = 0;
  for (int i = 0; i < 60000; ++i) {
    std::string text;
    for (std::size_t k = random() % 12; k > 0; --k) {
      if (random() % 20 == 0) text += static_cast<char>(random() % 256);
      else text += pieces[random() % std::size(pieces)];
    }
    const auto e = Expression::compile(text);
    if (!e.ok()) {
      ASSERT_FALSE(e.error().message.empty());
      continue;
    }
    ++good;
    const auto again = Expression::compile(e->print());
    ASSERT_TRUE(again.ok() && *again == *e) << text << " -> " << e->print();
    const auto v = e->evaluate(sample);
    if (v.ok()) ASSERT_TRUE(std::isfinite(v->value)) << text;
    else ASSERT_FALSE(v.error().message.empty()) << text;
    ASSERT_EQ(e->renamed([](const Expression::Name& n) { return n; }), e->text());
  }
  EXPECT_GT(good, 1000U);  // else the pieces do not fit each other and nothing was tried
}

TEST(Units, DimensionsHaveNames) {
  EXPECT_EQ(units::si_name({1, 0, 0, 0}), "m");
  EXPECT_EQ(units::si_name({0, 0, -1, 1}), "rad/s");
  EXPECT_EQ(units::si_name({2, 1, -2, 0}), "N m");
  EXPECT_EQ(units::si_name({2, 1, 0, 0}), "kg m^2");
  EXPECT_EQ(units::si_name({0, 0, 0, 0}), "");
  EXPECT_EQ(units::si_name({-1, 0, 0, 0}), "m^-1");
  EXPECT_EQ(units::kind_of(kArea), "an area");
  EXPECT_EQ(units::kind_of({5, 1, 0, 0}), "a quantity in kg m^5");
  // Each of them reads back.
  for (int m = -3; m <= 3; ++m)
    for (int kg = -2; kg <= 2; ++kg)
      for (int s = -2; s <= 2; ++s)
        for (int rad = -2; rad <= 2; ++rad) {
          const units::Dimension d{m, kg, s, rad};
          const auto unit = units::parse(units::si_name(d));
          ASSERT_TRUE(unit.ok()) << units::si_name(d);
          EXPECT_EQ(unit->dimension, d) << units::si_name(d);
          EXPECT_EQ(unit->factor, 1);
        }
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
#include "kernel/units.h"

#include <bit>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <tuple>

#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }

TEST(Units, NamedUnitsHaveTheirSiFactor) {
  // 1 in = 25.4 mm, 1 ft = 0.3048 m, 1 lb = 0.45359237 kg exactly (yard and pound agreement, 1959).
  const struct {
    const char* text;
    const char* si;
    double value;
  } cases[] = {
      {"20 mm", "m", 0.02},
      {"35mm", "m", 0.035},
      {"7 cm", "m", 0.07},
      {"3 um", "m", 3e-6},
      {"2 km", "m", 2000},
      {"1 in", "m", 0.0254},
      {"1 ft", "m", 0.3048},
      {"250 g", "kg", 0.25},
      {"2 t", "kg", 2000},
      {"1 lb", "kg", 0.45359237},
      {"500 ms", "s", 0.5},
      {"3 min", "s", 180},
      {"2 h", "s", 7200},
      {"90 deg", "rad", kHalfTurn / 2},
      {"180deg", "rad", kHalfTurn},
      {"5 mrad", "rad", 0.005},
      {"1 rev", "rad", 2 * kHalfTurn},
      {"60 rpm", "rad/s", 2 * kHalfTurn},
      {"5 kN", "N", 5000},
      {"3 kJ", "J", 3000},
      {"2 bar", "Pa", 2e5},
      {"210 GPa", "Pa", 210e9},
      {"50 %", "", 0.5},
      {"7.85 g/cm^3", "kg/m^3", 7850},
      {"100 mm/s", "m/s", 0.1},
      {"2 N mm", "N m", 0.002},
      {"2 N*mm", "N m", 0.002},
      {"2 N.mm", "N m", 0.002},
      {"1 kg m^2/s^2", "J", 1},
      {"60 1/min", "Hz", 1},
      {"4 m s^-2", "m/s^2", 4},
      {"-5 mm", "m", -0.005},
      {"+5 mm", "m", 0.005},
      {"1e3 mm", "m", 1},
      {"0.5", "m", 0.5},
      {" 2 ", "kg", 2},
      {"3 Nm", "N m", 3},
      {"1 rev/min", "rad/s", 2 * kHalfTurn / 60},
  };
  for (const auto& c : cases) {
    const auto read = units::read_quantity(c.text, c.si);
    ASSERT_TRUE(read.ok()) << c.text << ": " << read.error().sentence();
    EXPECT_NEAR(*read, c.value, 4e-16 * std::abs(c.value)) << c.text;
  }
}

TEST(Units, DecimalPrefixesGiveTheBitsOfTheDecimalNumber) {
  for (int i = 0; i < 5000; ++i) {
    const auto read = units::read_quantity(std::to_string(i) + " mm", "m");
    ASSERT_TRUE(read.ok());
    ASSERT_EQ(bits(*read), bits(i / 1000.0)) << i;
  }
}

TEST(Units, AQuantityOfAnotherDimensionIsRefusedByName) {
  EXPECT_EQ(units::read_quantity("90 deg", "m").error().sentence(),
            "90 deg is an angle; a length (m) is expected.");
  EXPECT_EQ(units::read_quantity("90 mm", "rad").error().sentence(),
            "90 mm is a length; an angle (rad) is expected.");
  EXPECT_EQ(units::read_quantity("2 kg", "").error().sentence(),
            "2 kg is a mass; a number without a unit is expected.");
  EXPECT_EQ(units::read_quantity("2 kg m^5", "m").error().sentence(),
            "2 kg m^5 is a quantity in kg m^5; a length (m) is expected.");
  EXPECT_EQ(units::read_quantity("2 Hz", "rad/s").error().sentence(),
            "2 Hz is a frequency; an angular speed (rad/s) is expected.");
}

TEST(Units, AnUnknownUnitIsRefusedWithANearOne) {
  EXPECT_EQ(units::read_quantity("3 degg", "rad").error().sentence(),
            "\"degg\" is not a unit. Did you mean \"deg\"?");
  for (const char* bad :
       {"m^", "m^0", "m^99", "/s", "m//s", "m/", "^2", "m^2^2", "m *", "parsec", "(m)"})
    EXPECT_FALSE(units::parse(bad).ok()) << bad;
  for (const char* bad : {"", "fast", "mm", "1e999 mm", "- 1 mm", "1 2"})
    EXPECT_FALSE(units::read_quantity(bad, "m").ok()) << bad;
}

TEST(Units, PrintedQuantitiesReadBackToTheSameBits) {
  constexpr unsigned kSeed = 77;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> angle(-400, 400);
  for (const char* unit : {"m", "rad", "rad/s", "kg", "", "N m"}) {
    for (int i = 0; i < 3000; ++i) {
      double v = 0;
      if (i % 3 == 0) v = std::bit_cast<double>(random());  // any bits
      if (i % 3 == 1)
        v = std::round(angle(random) * 100) / 100 * (kHalfTurn / 180);  // angles people type
      if (i % 3 == 2) v = std::round(angle(random) * 100) / 1e5;        // lengths people type
      if (!std::isfinite(v)) continue;
      const std::string printed = units::print_quantity(v, unit);
      const auto back = units::read_quantity(printed, unit);
      ASSERT_TRUE(back.ok()) << printed;
      ASSERT_EQ(bits(*back), bits(v == 0 ? 0.0 : v)) << printed << " " << unit;
      ASSERT_EQ(units::print_quantity(*back, unit), printed);
    }
  }
}

TEST(Units, TheShorterOfSiAndCustomaryUnitIsPrinted) {
  EXPECT_EQ(units::print_quantity(kHalfTurn / 2, "rad"), "90 deg");
  EXPECT_EQ(units::print_quantity(0.5, "rad"), "0.5");
  EXPECT_EQ(units::print_quantity(0.002, "m"), "2 mm");
  EXPECT_EQ(units::print_quantity(0.48, "m"), "0.48");
  EXPECT_EQ(units::print_quantity(0.0015, "kg"), "0.0015");
  EXPECT_EQ(units::print_quantity(-0.0, "m"), "0");
  EXPECT_EQ(units::print_quantity(kHalfTurn, "rad/s"), "180 deg/s");
}

TEST(Units, SpellingsThatPeopleWriteAreUnitsBehindANumber) {
  // 180 degrees are pi; an inch is 25.4 mm and a foot 0.3048 m by the agreement of 1959.
  const std::tuple<const char*, const char*, double> all[] = {
      {"90\u00b0", "rad", kHalfTurn / 2},
      {"90 \u00b0", "rad", kHalfTurn / 2},
      {"-45 degrees", "rad", -kHalfTurn / 4},
      {"180 \u00b0/s", "rad/s", kHalfTurn},
      {"2 inch", "m", 0.0508},
      {"2 inches", "m", 0.0508},
      {"10 feet", "m", 3.048},
      {"20 millimetres", "m", 0.02},
      {"1.5 meters", "m", 1.5},
      {"3 seconds", "s", 3},
      {"120 degrees/second", "rad/s", kHalfTurn * 2 / 3}};
  for (const auto& [text, unit, si] : all) {
    const auto read = units::read_quantity(text, unit);
    ASSERT_TRUE(read.ok()) << text << ": " << read.error().sentence();
    EXPECT_NEAR(*read, si, 1e-15) << text;
  }
  // They stay free as names of parameters.
  EXPECT_FALSE(units::is_unit("inch"));
  EXPECT_FALSE(units::is_unit("second"));
  EXPECT_TRUE(units::is_unit_behind_number("inch"));
  EXPECT_FALSE(units::read_quantity("3 furlongs", "m").ok());
}

TEST(Units, WithItsUnitAQuantityReadsBackWithoutKnowingIt) {
  EXPECT_EQ(units::print_with_unit(0.02, "m"), "20 mm");
  EXPECT_EQ(units::print_with_unit(0.48, "m"), "480 mm");
  EXPECT_EQ(units::print_with_unit(2, "m"), "2 m");
  EXPECT_EQ(units::print_with_unit(0, "m"), "0 m");
  EXPECT_EQ(units::print_with_unit(kHalfTurn / 4, "rad"), "45 deg");
  EXPECT_EQ(units::print_with_unit(0.3, "rad"), "0.3 rad");
  EXPECT_EQ(units::print_with_unit(3, ""), "3");
  EXPECT_EQ(units::print_with_unit(0.1 / 3, "m"), "0.03333333333333333 m");
  EXPECT_EQ(units::print_with_unit(7850, "kg/m^3"), "7850 kg/m^3");
}

}  // namespace
}  // namespace robomosp

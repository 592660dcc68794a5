// SPDX-License-Identifier: Apache-2.0
#include "kernel/fingerprint.h"

#include <bit>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

TEST(Fingerprint, EqualInputsGiveEqualKeysAndDomainsKeepThemApart) {
  const auto key = [](std::string_view domain) {
    return Fingerprinter(domain).add("a").add(1.5).add(true).finish();
  };
  EXPECT_EQ(key("mesh/1"), key("mesh/1"));
  EXPECT_NE(key("mesh/1"), key("mesh/2"));
  EXPECT_EQ(key("mesh/1").hex().size(), 32U);
}

TEST(Fingerprint, FramesKeepSequencesApart) {
  std::set<Fingerprint> seen;
  const double two[] = {1, 2}, three[] = {1, 2, 0};
  const auto f = [] { return Fingerprinter("d"); };
  seen.insert(f().finish());
  seen.insert(f().add("").finish());
  seen.insert(f().add("ab").add("c").finish());
  seen.insert(f().add("a").add("bc").finish());
  seen.insert(f().add("abc").finish());
  seen.insert(f().add(std::string_view("abc\0", 4)).finish());
  seen.insert(f().add(1).finish());
  seen.insert(f().add(1.0).finish());
  seen.insert(f().add(true).finish());
  seen.insert(f().add(1.0).add(2.0).finish());
  seen.insert(f().add(std::span<const double>(two)).finish());
  seen.insert(f().add(std::span<const double>(three)).finish());
  seen.insert(f().add(f().finish()).finish());
  EXPECT_EQ(seen.size(), 13U);
}

TEST(Fingerprint, DoublesAreCanonical) {
  const auto key = [](double v) { return Fingerprinter("d").add(v).finish(); };
  EXPECT_EQ(key(0.0), key(-0.0));
  EXPECT_EQ(key(std::nan("1")), key(-std::nan("2")));
  EXPECT_NE(key(1.0), key(std::nextafter(1.0, 2.0)));
}

TEST(Fingerprint, OneChangedBitChangesAboutHalfOfTheKey) {
  // Mean of the binomial (128, 1/2) is 64; over 2000 trials its standard error is 0.13.
  double changed = 0;
  constexpr int kTrials = 2000;
  std::set<Fingerprint> seen;
  for (int i = 0; i < kTrials; ++i) {
    const auto a = Fingerprinter("d").add(std::int64_t{i}).finish();
    const auto b = Fingerprinter("d").add(std::int64_t{i} ^ (std::int64_t{1} << (i % 63))).finish();
    changed += std::popcount(a.hi ^ b.hi) + std::popcount(a.lo ^ b.lo);
    seen.insert(a);
  }
  EXPECT_NEAR(changed / kTrials, 64, 1);
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(kTrials));
}

TEST(Fingerprint, KeysStayTheSameBetweenVersionsOfTheProgram) {
  // Golden, from this implementation: a change here means caches on disk and recorded sessions
  // no longer match, so raise the domains' numbers when it is meant.
  EXPECT_EQ(Fingerprinter("golden").add("x").add(1).add(0.5).finish().hex(),
            "ecf32573c695da4db4e70497b80bef93");
}

}  // namespace
}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// The words that choose the edges of a fillet or chamfer (CsgNode::select), read once for every
// engine (layer: contract, std only).
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// One condition that an edge meets or not, in the frame of the fillet's child.
struct CsgEdgeTest {
  enum class Kind : std::int32_t {
    parallel_x,  ///< straight and along x, to within rounding
    parallel_y,
    parallel_z,
    straight,
    round,    ///< a circle or an arc of one
    convex,   ///< material on the inside of the corner
    concave,  ///< material on the outside
    top,      ///< wholly at the greatest z of the child
    bottom,   ///< wholly at the least z
    right,    ///< wholly at the greatest x
    left,     ///< wholly at the least x
    back,     ///< wholly at the greatest y
    front,    ///< wholly at the least y
    near,     ///< of the edges that meet all other conditions, the one next to `point`
  };
  Kind kind = Kind::straight;
  Vec3 point{};  ///< of near [m]
  bool operator==(const CsgEdgeTest&) const = default;
};

/// Words of the tests that take nothing behind them.
struct CsgEdgeWord {
  std::string_view word;
  CsgEdgeTest::Kind kind;
};
inline constexpr CsgEdgeWord kCsgEdgeWords[] = {
    {"straight", CsgEdgeTest::Kind::straight}, {"round", CsgEdgeTest::Kind::round},
    {"convex", CsgEdgeTest::Kind::convex},     {"concave", CsgEdgeTest::Kind::concave},
    {"top", CsgEdgeTest::Kind::top},           {"bottom", CsgEdgeTest::Kind::bottom},
    {"left", CsgEdgeTest::Kind::left},         {"right", CsgEdgeTest::Kind::right},
    {"front", CsgEdgeTest::Kind::front},       {"back", CsgEdgeTest::Kind::back},
};

namespace detail {

/// Takes blanks, then a word of letters, off the front.
inline std::string_view take_select_word(std::string_view& s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  std::size_t n = 0;
  while (n < s.size() && ((s[n] >= 'a' && s[n] <= 'z') || (s[n] >= 'A' && s[n] <= 'Z'))) ++n;
  const std::string_view word = s.substr(0, n);
  s.remove_prefix(n);
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  return word;
}

/// Takes "(x, y, z)" off the front.
inline bool take_select_point(std::string_view& s, Vec3& point) {
  const auto take = [&s](char c) {
    while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
    if (s.empty() || s.front() != c) return false;
    s.remove_prefix(1);
    while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
    return true;
  };
  if (!take('(')) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (i > 0 && !take(',')) return false;
    const auto got = std::from_chars(s.data(), s.data() + s.size(), point[i]);
    if (got.ec != std::errc() || !std::isfinite(point[i])) return false;
    s.remove_prefix(static_cast<std::size_t>(got.ptr - s.data()));
  }
  return take(')');
}

}  // namespace detail

/// Reads CsgNode::select: "" and `all` have no tests, so that every edge meets them; else tests
/// joined by `and`. An error names what cannot be read. [any thread]
[[nodiscard]] inline Result<std::vector<CsgEdgeTest>> parse_csg_select(std::string_view text) {
  const auto refuse = [](std::string message) {
    return error(ErrorCode::syntax, std::move(message),
                 "Edges are chosen by \"all\", or by parallel x, parallel y, parallel z, straight, "
                 "round, convex, concave, top, bottom, left, right, front, back or near (x, y, z) "
                 "in metres, joined by \"and\".");
  };
  const std::string whole = "\"" + std::string(text) + "\"";
  std::vector<CsgEdgeTest> tests;
  std::string_view rest = text;
  std::string_view word = detail::take_select_word(rest);
  if (rest.empty() && (word.empty() || word == "all")) return tests;
  for (;;) {
    CsgEdgeTest test;
    bool is_known = false;
    for (const CsgEdgeWord& row : kCsgEdgeWords) {
      if (row.word != word) continue;
      test.kind = row.kind;
      is_known = true;
    }
    if (word == "parallel") {
      const std::string_view axis = detail::take_select_word(rest);
      if (axis != "x" && axis != "y" && axis != "z")
        return refuse("\"parallel\" in the selection " + whole + " must be followed by x, y or z");
      test.kind = axis == "x"   ? CsgEdgeTest::Kind::parallel_x
                  : axis == "y" ? CsgEdgeTest::Kind::parallel_y
                                : CsgEdgeTest::Kind::parallel_z;
      is_known = true;
    } else if (word == "near") {
      test.kind = CsgEdgeTest::Kind::near;
      if (!detail::take_select_point(rest, test.point))
        return refuse("\"near\" in the selection " + whole +
                      " must be followed by a point such as (0.1, 0, 0.02)");
      is_known = true;
    }
    if (!is_known) {
      if (word.empty() && rest.empty())
        return refuse("the selection " + whole + " ends where a condition is expected");
      const std::string what(word.empty() ? rest.substr(0, rest.find(' ')) : word);
      return refuse("\"" + what + "\" in the selection " + whole + " is not an edge condition");
    }
    tests.push_back(test);
    word = detail::take_select_word(rest);
    if (word.empty() && rest.empty()) return tests;
    if (word != "and") {
      const std::string what(word.empty() ? rest.substr(0, rest.find(' ')) : word);
      return refuse("\"" + what + "\" in the selection " + whole + " is where \"and\" is expected");
    }
    word = detail::take_select_word(rest);
  }
}

}  // namespace robomosp

// SPDX-License-Identifier: Apache-2.0
// The effects of a program on a controller, as a list of events, for comparing posted programs that
// were read back with their originals.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/program_tables.h>

#include "program/state.h"
#include "program/trace.h"

namespace robomosp::test {

/// An action of a controller, in sequence.
struct Event {
  enum class Kind { joints, pose, position, step, output, wait, condition } kind = Kind::pose;
  std::uint32_t interpolation = RMP_MOVE_PTP;
  std::vector<double> numbers;  ///< joints [degrees, mm]; x y z [mm] and quaternion; value of an
                                ///< output; seconds; TIMEOUT or -1
  bool is_analogue = false;     ///< an output of REAL, with separate numbering
  std::vector<std::int32_t> signals;  ///< an output; inputs of a condition by first use
  std::vector<bool> truth;            ///< of the condition, a value for each of the inputs' values
  double speed = -1;                  ///< of LIN, CIRCLE and PATH [mm/s]; -1 = not given
  double share = -1;                  ///< of PTP [%], ignored by same(); -1 = not given
  std::size_t target = 0;             ///< index of this target in the motion, from 0
  std::uint32_t line = 0;
  [[nodiscard]] std::string text() const {
    static constexpr const char* kWords[] = {"joints", "pose", "position", "step",
                                             "output", "wait", "wait for"};
    std::string s = kWords[static_cast<int>(kind)];
    if (kind <= Kind::step) s += " " + std::to_string(interpolation);
    for (const std::int32_t i : signals) s += " #" + std::to_string(i);
    for (const double x : numbers) s += " " + std::to_string(x);
    for (const bool is_on : truth) s += is_on ? "1" : "0";
    if (speed >= 0) s += " at " + std::to_string(speed);
    return s + " (line " + std::to_string(line) + ")";
  }
};

inline double value_of(const program::Condition& c, std::uint32_t at,
                       const std::map<std::uint32_t, double>& inputs) {
  const program::ConditionNode& n = c.nodes[at];
  const auto a = [&] { return value_of(c, n.a, inputs); };
  const auto b = [&] { return value_of(c, n.b, inputs); };
  switch (n.op) {
    case RMP_EXPR_LITERAL: return n.type == RMP_TYPE_REAL ? n.real : static_cast<double>(n.integer);
    case RMP_EXPR_SYMBOL: return inputs.at(n.symbol);
    case RMP_EXPR_CONVERT: return a();
    case RMP_EXPR_NOT: return a() == 0;
    case RMP_EXPR_AND: return a() != 0 && b() != 0;
    case RMP_EXPR_OR: return a() != 0 || b() != 0;
    case RMP_EXPR_EXOR:
    case RMP_EXPR_NOT_EQUAL: return a() != b();
    case RMP_EXPR_EQUAL: return a() == b();
    default: ADD_FAILURE() << "operation " << n.op << " in a condition"; return 0;
  }
}
/// What a condition on a few BOOL inputs says, however it is written.
inline void look_at(const program::Condition& c, const rmp_code& code, Event& out) {
  std::vector<std::uint32_t> symbols;
  for (const program::ConditionNode& n : c.nodes)
    if (n.op == RMP_EXPR_SYMBOL &&
        std::find(symbols.begin(), symbols.end(), n.symbol) == symbols.end())
      symbols.push_back(n.symbol);
  ASSERT_LE(symbols.size(), 4U);
  for (const std::uint32_t s : symbols)
    out.signals.push_back(row<rmp_code_symbol>(code.symbols, s).address);
  for (std::uint32_t bits = 0; bits < 1U << symbols.size(); ++bits) {
    std::map<std::uint32_t, double> inputs;
    for (std::size_t i = 0; i < symbols.size(); ++i) inputs[symbols[i]] = (bits >> i) & 1U;
    out.truth.push_back(value_of(c, static_cast<std::uint32_t>(c.nodes.size()) - 1, inputs) != 0);
  }
}

/// An INT output of several bits is its bits, unless the language has names for groups only.
inline std::vector<Event> events(const program::Trace& t, bool has_groups) {
  const rmp_code& c = t.program->code();
  std::vector<Event> out;
  for (const program::TraceEntry& e : t.entries) {
    Event one;
    one.line = e.span.line;
    if (const auto* m = std::get_if<program::TracedMotion>(&e.what)) {
      one.interpolation = m->motion.interpolation;
      // Where a time is given, the speed is what comes of it.
      if (one.interpolation != RMP_MOVE_PTP && !(m->motion.attributes.time > 0))
        one.speed = m->motion.attributes.speed;
      if (one.interpolation == RMP_MOVE_PTP) one.share = m->motion.attributes.speed_ptp;
      for (std::size_t k = 0; k < m->motion.targets.size(); ++k) {
        const program::Target& target = m->motion.targets[k];
        Event here = one;
        here.target = k;
        const bool is_known = k < m->absolute.size() && m->absolute[k];
        if (!is_known && m->motion.is_incremental && target.joints.empty()) {
          // From where the run only knows, by so much in the base's axes.
          program::PlainPose by = target.pose;
          if (target.role == RMP_ROLE_POSITION) by.quaternion = {1, 0, 0, 0};
          if (m->motion.attributes.frame) {
            program::PlainPose f = *m->motion.attributes.frame;
            f.position = {0, 0, 0};
            by = program::compose_poses(program::compose_poses(f, by), program::inverse_pose(f));
          }
          here.kind = Event::Kind::step;
          here.numbers.assign(by.position.begin(), by.position.end());
          here.numbers.insert(here.numbers.end(), by.quaternion.begin(), by.quaternion.end());
        } else if (is_known || target.role == RMP_ROLE_POSITION) {
          program::PlainPose p = is_known ? *m->absolute[k] : target.pose;
          // How it is turned is not known, where it is in the robot's base is.
          if (!is_known && m->motion.attributes.frame)
            p.position = program::compose_poses(*m->motion.attributes.frame, p).position;
          // A place keeps the orientation before it, which may be known.
          here.kind = is_known ? Event::Kind::pose : Event::Kind::position;
          here.numbers.assign(p.position.begin(), p.position.end());
          here.numbers.insert(here.numbers.end(), p.quaternion.begin(), p.quaternion.end());
        } else {
          here.kind = Event::Kind::joints;
          here.numbers = target.joints;
        }
        if (m->until && k + 1 == m->motion.targets.size()) look_at(*m->until, c, here);
        out.push_back(here);
      }
    } else if (const auto* w = std::get_if<program::TracedWrite>(&e.what)) {
      const auto& s = row<rmp_code_symbol>(c.symbols, w->symbol);
      one.kind = Event::Kind::output;
      if (s.type == RMP_TYPE_INT && s.width > 1 && !has_groups) {
        for (std::int32_t bit = 0; bit < s.width; ++bit) {
          Event here = one;
          here.signals = {s.address + bit};
          here.numbers = {static_cast<double>((w->value.integer >> bit) & 1)};
          out.push_back(here);
        }
        continue;
      }
      one.signals = {s.address};
      one.is_analogue = s.type == RMP_TYPE_REAL;
      one.numbers = {s.type == RMP_TYPE_REAL ? w->value.real
                                             : static_cast<double>(w->value.integer)};
      out.push_back(one);
    } else if (const auto* d = std::get_if<program::TracedWait>(&e.what)) {
      one.kind = d->condition ? Event::Kind::condition : Event::Kind::wait;
      one.numbers = {d->seconds};
      if (one.kind == Event::Kind::wait && d->seconds == 0) continue;
      if (d->condition) look_at(*d->condition, c, one);
      out.push_back(one);
    }
  }
  return out;
}

/// Centre and radius of the circle through three places.
inline std::pair<std::array<double, 3>, double> circle(const double* a, const double* b,
                                                       const double* c) {
  std::array<double, 3> u{}, v{};
  for (std::size_t k = 0; k < 3; ++k) u[k] = b[k] - a[k], v[k] = c[k] - a[k];
  const auto cross = [](const auto& x, const auto& y) {
    return std::array<double, 3>{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2],
                                 x[0] * y[1] - x[1] * y[0]};
  };
  const auto dot = [](const auto& x, const auto& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const auto w = cross(u, v);
  const auto n = cross(w, u), m = cross(v, w);
  const double d = 2 * dot(w, w);
  std::array<double, 3> centre{};
  for (std::size_t k = 0; k < 3; ++k) centre[k] = a[k] + (dot(v, v) * n[k] + dot(u, u) * m[k]) / d;
  return {centre, std::hypot(centre[0] - a[0], centre[1] - a[1], centre[2] - a[2])};
}
/// Whether a place is on the arc from `a` through `b` to `c`, to within so many mm.
inline bool is_on_arc(const double* a, const double* b, const double* c, const double* p,
                      double mm = 0.02) {
  const auto [centre, radius] = circle(a, b, c);
  std::array<std::array<double, 3>, 4> r{};  // of a, b, c, p from the centre
  const std::array<const double*, 4> places{a, b, c, p};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 3; ++k) r[i][k] = places[i][k] - centre[k];
  const auto dot = [](const auto& x, const auto& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  // Axes in the plane of the arc: from the centre to its start, and across towards its middle.
  std::array<double, 3> x = r[0], y{};
  for (double& v : x) v /= radius;
  const auto across = [&](std::size_t i) {
    std::array<double, 3> v = r[i];
    for (std::size_t k = 0; k < 3; ++k) v[k] -= dot(r[i], x) * x[k];
    return v;
  };
  // Of the two the one that does not vanish says where the plane is.
  const auto of_b = across(1), of_c = across(2);
  y = dot(of_b, of_b) > dot(of_c, of_c) ? of_b : of_c;
  const double n = std::sqrt(dot(y, y));
  for (double& v : y) v /= n;
  const double turn = 2 * 3.141592653589793;
  const auto angle = [&](std::size_t i) {
    const double t = std::atan2(dot(r[i], y), dot(r[i], x));
    return t < 0 ? t + turn : t;
  };
  double end = angle(2), at = angle(3);
  if (angle(1) > end) end = turn - end, at = turn - at;  // the opposite direction
  const double u = dot(r[3], x), v = dot(r[3], y);
  std::array<double, 3> off{};
  for (std::size_t k = 0; k < 3; ++k) off[k] = r[3][k] - u * x[k] - v * y[k];
  return std::fabs(std::hypot(u, v) - radius) < mm && std::sqrt(dot(off, off)) < mm &&
         at * radius < end * radius + mm;
}

inline constexpr double kMm = 0.01, kDegree = 0.01, kSeconds = 0.01;

/// Numbers of signals: themselves, or, where the language has names, what the first use of each
/// says, one number for one.
class Signals {
 public:
  explicit Signals(bool are_named) : are_named_(are_named) {}
  bool same(bool is_output, bool is_analogue, std::int32_t a, std::int32_t b) {
    if (!are_named_) return a == b;
    const auto there = there_.try_emplace({is_output, is_analogue, a}, b).first->second;
    const auto back = back_.try_emplace({is_output, is_analogue, b}, a).first->second;
    return there == b && back == a;
  }

 private:
  bool are_named_;
  std::map<std::tuple<bool, bool, std::int32_t>, std::int32_t> there_, back_;
};

inline bool same(const Event& a, const Event& b, Signals& signals) {
  using Kind = Event::Kind;
  // A target that keeps its orientation says where it is only.
  const bool is_place =
      (a.kind == Kind::pose || a.kind == Kind::position) && b.kind == Kind::position;
  if ((a.kind != b.kind && !is_place) || a.numbers.size() != b.numbers.size()) return false;
  // A path through several places is lines that pass them, where a language has no curves.
  const auto straight = [](std::uint32_t kind) {
    return kind == RMP_MOVE_PATH ? std::uint32_t{RMP_MOVE_LIN} : kind;
  };
  if (a.kind <= Kind::step && straight(a.interpolation) != straight(b.interpolation)) return false;
  if (a.speed >= 0 && b.speed >= 0 && std::fabs(a.speed - b.speed) > 0.01 * a.speed) return false;
  if (a.is_analogue != b.is_analogue) return false;
  if (a.truth != b.truth || a.signals.size() != b.signals.size()) return false;
  for (std::size_t i = 0; i < a.signals.size(); ++i)
    if (!signals.same(a.kind == Kind::output, a.is_analogue, a.signals[i], b.signals[i]))
      return false;
  if (a.kind == Kind::pose || a.kind == Kind::position || a.kind == Kind::step) {
    for (std::size_t k = 0; k < 3; ++k)
      if (!(std::fabs(a.numbers[k] - b.numbers[k]) <= kMm)) return false;
    if (is_place) return true;
    double dot = 0;
    for (std::size_t k = 3; k < 7; ++k) dot += a.numbers[k] * b.numbers[k];
    return 2 * std::acos(std::min(1.0, std::fabs(dot))) * 57.29577951308232 <= kDegree;
  }
  for (std::size_t k = 0; k < a.numbers.size(); ++k)
    if (!(std::fabs(a.numbers[k] - b.numbers[k]) <= (a.kind == Kind::joints ? kDegree : kSeconds)))
      return false;
  return true;
}

}  // namespace robomosp::test

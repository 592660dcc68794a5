// SPDX-License-Identifier: Apache-2.0
// Points of a program for tests of posts, found by separate rules and not as the host finds
// them, and a robot with exact inverse kinematics (layer: contract helper for tests,
// header-only).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_writer.h>

namespace robomosp::conformance::plain {

using Numbers = std::vector<double>;
using Q = std::array<double, 4>;
inline constexpr double kDeg = 0.017453292519943295;

inline Q times(const Q& a, const Q& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
inline Q about(std::size_t axis, double degrees) {
  Q q{std::cos(degrees * kDeg / 2), 0, 0, 0};
  q[axis + 1] = std::sin(degrees * kDeg / 2);
  return q;
}
inline std::array<double, 3> turned(const Q& q, double x, double y, double z) {
  const Q r = times(times(q, Q{0, x, y, z}), Q{q[0], -q[1], -q[2], -q[3]});
  return {r[1], r[2], r[3]};
}
inline std::array<double, 9> matrix(const Q& q) {
  std::array<double, 9> m{};
  for (std::size_t j = 0; j < 3; ++j) {
    const auto c = turned(q, j == 0, j == 1, j == 2);
    for (std::size_t i = 0; i < 3; ++i) m[3 * i + j] = c[i];
  }
  return m;
}

/// A robot with the position [m] and the rotation vector of its tip as "joints": any pose is
/// reached, and exactly one configuration leads there.
class PlainKinematics final : public PostKinematics {
 public:
  Result<Pose> forward(std::span<const double> q) const override {
    Pose p;
    p.p = {q[0], q[1], q[2]};
    const double a = std::sqrt(q[3] * q[3] + q[4] * q[4] + q[5] * q[5]);
    const double s = a < 1e-12 ? 0.5 : std::sin(a / 2) / a;
    p.R = matrix({std::cos(a / 2), q[3] * s, q[4] * s, q[5] * s});
    return p;
  }
  Result<std::vector<double>> inverse(const Pose& p, std::span<const double>,
                                      std::int64_t) const override {
    const auto v = post::orientation(p.R, post::Orientation::rotation_vector);
    return std::vector<double>{p.p[0], p.p[1], p.p[2], v[0], v[1], v[2]};
  }
  std::uint32_t status(std::span<const double>, std::uint32_t& known) const override {
    known = 7;
    return 0;
  }
};

/// Known geometric values, by separate rules.
class Points {
 public:
  Points(const rmp_code& code, bool with_robot) : c_(code) {
    for (std::uint32_t i = 0; i < c_.statements.count; ++i) {
      const auto& s = row<rmp_code_statement>(c_.statements, i);
      if (s.op == RMP_STMT_ASSIGN) assigned_[root(s.a)] = true;
      if (s.op == RMP_STMT_TEACH) assigned_[s.symbol] = true;
    }
    for (std::uint32_t e = 0; e < c_.expressions.count; ++e) {
      const auto& x = row<rmp_code_expression>(c_.expressions, e);
      const auto& t = row<rmp_code_type>(c_.types, x.type);
      if (t.role == RMP_ROLE_NONE || t.role == RMP_ROLE_ROBOT) continue;
      const auto v = value(e);
      if (!v) continue;
      PostPoint p;
      p.expression = e;
      p.role = t.role;
      const auto pose = [&](std::size_t at) {
        for (std::size_t i = 0; i < 3; ++i) p.pose.p[i] = (*v)[at + i] / 1000;
        p.pose.R = matrix({(*v)[at + 3], (*v)[at + 4], (*v)[at + 5], (*v)[at + 6]});
        p.has_pose = true;
      };
      if (t.role == RMP_ROLE_POSITION) {
        for (std::size_t i = 0; i < 3; ++i) p.pose.p[i] = (*v)[i] / 1000;
        p.has_pose = true;
      }
      if (t.role == RMP_ROLE_ORIENTATION) {
        p.pose.R = matrix({(*v)[0], (*v)[1], (*v)[2], (*v)[3]});
        p.has_pose = true;
      }
      if (t.role == RMP_ROLE_POSE || t.role == RMP_ROLE_ROBTARGET) pose(0);
      if (t.role == RMP_ROLE_ROBTARGET) {
        p.has_status = true;
        p.status = static_cast<std::uint32_t>((*v)[7]);
        p.status_known = 7;
        p.external = keep({v->back()});
      }
      if (t.role == RMP_ROLE_JOINT || t.role == RMP_ROLE_MAIN_JOINT) {
        if (v->size() < 6) continue;  // of another robot
        Numbers q(v->begin(), v->begin() + 6);
        for (double& a : q) a *= kDeg;
        p.q = keep(q);
        if (v->size() > 6) p.external = keep({v->begin() + 6, v->end()});
        if (with_robot) {
          p.pose = *kinematics.forward(p.q);
          p.has_pose = true;
        }
      } else if (t.role == RMP_ROLE_ADD_JOINT) {
        p.external = keep(*v);
      } else if (with_robot && p.has_pose && t.role != RMP_ROLE_POSITION) {
        p.q = keep(*kinematics.inverse(p.pose, {}, -1));
      } else {
        p.q_missing = "the joint values of this target are unknown, since no robot is named";
      }
      points.push_back(p);
    }
  }
  std::vector<PostPoint> points;
  PlainKinematics kinematics;

 private:
  std::span<const double> keep(Numbers v) { return kept_.emplace_back(std::move(v)); }
  std::uint32_t root(std::uint32_t e) const {
    while (true) {
      const auto& x = row<rmp_code_expression>(c_.expressions, e);
      if (x.op == RMP_EXPR_SYMBOL) return x.symbol;
      if (x.op != RMP_EXPR_FIELD && x.op != RMP_EXPR_INDEX) return RMP_NONE;
      e = row<std::uint32_t>(c_.links, x.first);
    }
  }
  std::size_t size(std::uint32_t t) const {
    const auto& x = row<rmp_code_type>(c_.types, t);
    if (x.kind == RMP_TYPE_ARRAY)
      return static_cast<std::size_t>(x.upper - x.lower + 1) * size(x.element);
    if (x.kind != RMP_TYPE_RECORD) return 1;
    std::size_t n = 0;
    for (std::uint32_t k = 0; k < x.field_count; ++k)
      n += size(row<rmp_code_field>(c_.fields, x.first_field + k).type);
    return n;
  }
  std::optional<Numbers> value(std::uint32_t e) {
    const auto& x = row<rmp_code_expression>(c_.expressions, e);
    if (x.constant != RMP_NONE) {
      const auto& k = row<rmp_code_constant>(c_.constants, x.constant);
      if (k.kind == RMP_CONSTANT_TEXT) return std::nullopt;
      return Numbers{k.kind == RMP_CONSTANT_INT ? static_cast<double>(k.integer) : k.real};
    }
    std::vector<Numbers> o;
    for (std::uint32_t k = 0; x.op != RMP_EXPR_SYMBOL && k < x.count; ++k) {
      auto v = value(row<std::uint32_t>(c_.links, x.first + k));
      if (!v) return std::nullopt;
      o.push_back(*v);
    }
    const auto ori = [](const Numbers& v, std::size_t at) {
      return Q{v[at], v[at + 1], v[at + 2], v[at + 3]};
    };
    const auto numbers = [](const Q& q) { return Numbers(q.begin(), q.end()); };
    switch (x.op) {
      case RMP_EXPR_SYMBOL: {
        const auto& s = row<rmp_code_symbol>(c_.symbols, x.symbol);
        if (assigned_.contains(x.symbol) ||
            (s.kind != RMP_SYMBOL_VARIABLE && s.kind != RMP_SYMBOL_CONSTANT))
          return std::nullopt;
        if (s.value != RMP_NONE) return value(s.value);
        return std::nullopt;
      }
      case RMP_EXPR_CONVERT: return o[0];
      case RMP_EXPR_MAKE: {
        Numbers all;
        for (const Numbers& n : o) all.insert(all.end(), n.begin(), n.end());
        if (all.size() != size(x.type)) return std::nullopt;
        return all;
      }
      case RMP_EXPR_FIELD: {
        const auto& of = row<rmp_code_type>(
            c_.types,
            row<rmp_code_expression>(c_.expressions, row<std::uint32_t>(c_.links, x.first)).type);
        std::size_t at = 0;
        for (std::uint32_t k = 0; k < x.symbol; ++k)
          at += size(row<rmp_code_field>(c_.fields, of.first_field + k).type);
        const auto n = size(x.type);
        return Numbers(o[0].begin() + static_cast<std::ptrdiff_t>(at),
                       o[0].begin() + static_cast<std::ptrdiff_t>(at + n));
      }
      case RMP_EXPR_ADD: return Numbers{o[0][0] + o[1][0]};
      case RMP_EXPR_SUBTRACT: return Numbers{o[0][0] - o[1][0]};
      case RMP_EXPR_MULTIPLY: return Numbers{o[0][0] * o[1][0]};
      case RMP_EXPR_DIVIDE: return Numbers{o[0][0] / o[1][0]};
      case RMP_EXPR_NEGATE: return Numbers{-o[0][0]};
      case RMP_EXPR_COMPOSE: {
        if (o[0].size() != 7 || o[1].size() != 7) return std::nullopt;
        const auto t = turned(ori(o[0], 3), o[1][0], o[1][1], o[1][2]);
        Numbers out{o[0][0] + t[0], o[0][1] + t[1], o[0][2] + t[2]};
        for (const double v : times(ori(o[0], 3), ori(o[1], 3))) out.push_back(v);
        return out;
      }
      case RMP_EXPR_INTRINSIC: {
        const std::string f = row<rmp_code_symbol>(c_.symbols, x.symbol).name;
        if (f == "ORIZYX")
          return numbers(times(times(about(2, o[0][0]), about(1, o[1][0])), about(0, o[2][0])));
        if (f == "ORIQUAT") return Numbers{o[0][0], o[1][0], o[2][0], o[3][0]};
        if (f == "ORIXYZ")
          return numbers(times(times(about(0, o[0][0]), about(1, o[1][0])), about(2, o[2][0])));
        return std::nullopt;
      }
      default: return std::nullopt;
    }
  }
  const rmp_code& c_;
  std::map<std::uint32_t, bool> assigned_;
  std::deque<Numbers> kept_;
};

inline RobotModel six_joints() {
  RobotModel m;
  for (int i = 0; i < 6; ++i) {
    JointModel j;
    j.parent = i - 1;
    j.max_velocity = 3.141592653589793;
    m.joints.push_back(j);
  }
  m.number_coordinates();
  return m;
}

}  // namespace robomosp::conformance::plain

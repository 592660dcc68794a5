// SPDX-License-Identifier: Apache-2.0
// Orientations "fixed", "slerp", "slerp_points", "squad" and "tangent" (layer: plugin).
#include <algorithm>
#include <cmath>
#include <string_view>

#include "factories.h"
#include "spatial/jet.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::path_analytic {
namespace {

using spatial::add;
using spatial::Jet;
using spatial::JetQuaternion;
using spatial::JetVector;
using spatial::print_number;

/// Turns at a constant rate about an axis fixed in the trajectory's frame.
class Slerp final : public Orientation {
 public:
  Slerp(const spatial::Matrix3& start, const Vec3& whole) : whole_(whole) { start_.R = start; }
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    Pose turned;
    for (std::size_t i = 0; i < w.size(); ++i) {
      turned.R = spatial::rotation_exp(spatial::scale(whole_, w[i]));
      out[i] = {spatial::compose(turned, start_).R, whole_, {}};
    }
    return {};
  }

 private:
  Pose start_;
  Vec3 whole_;  ///< rotation vector from the first to the last orientation [rad]
};

Vec3 turn_between(const Pose& first, const Pose& last) {
  const Vec3 whole = spatial::rotation_difference(first.R, last.R);
  return spatial::norm(whole) < kSameRotation ? Vec3{} : whole;
}

/// Shares of the points that differ enough to be kept apart; a turn between points at one share
/// would be a jump.
Result<void> check_shares(const OrientationTask& task) {
  if (task.points.empty()) return bad("there is no point to take the orientation from", {});
  for (std::size_t i = 1; i < task.points.size(); ++i)
    if (!(task.shares[i] > task.shares[i - 1] + 1e-9) &&
        spatial::norm(turn_between(task.points[i - 1], task.points[i])) > 0)
      return bad("points " + std::to_string(i) + " and " + std::to_string(i + 1) +
                     " have different orientations at the same position",
                 "Move one of them, or use \"slerp\".");
  return {};
}

/// The piece of rising knots that w lies in.
std::size_t piece_of(std::span<const double> knots, double w) {
  const auto next = std::upper_bound(knots.begin() + 1, knots.end() - 1, w);
  return static_cast<std::size_t>(next - knots.begin()) - 1;
}

/// Slerp from point to point; the rate jumps at the points.
class SlerpPoints final : public Orientation {
 public:
  explicit SlerpPoints(const OrientationTask& task)
      : knots_(task.shares.begin(), task.shares.end()) {
    for (std::size_t i = 0; i < task.points.size(); ++i) {
      starts_.push_back(task.points[i]);
      starts_.back().p = {};
      const std::size_t next = std::min(i + 1, task.points.size() - 1);
      turns_.push_back(turn_between(task.points[i], task.points[next]));
    }
  }
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    Pose turned;
    for (std::size_t i = 0; i < w.size(); ++i) {
      const std::size_t k = piece_of(knots_, w[i]);
      const double h = knots_[k + 1] - knots_[k];
      const double x = h > 0 ? std::clamp((w[i] - knots_[k]) / h, 0.0, 1.0) : 0;
      turned.R = spatial::rotation_exp(spatial::scale(turns_[k], x));
      const bool is_turning = h > 0 && w[i] >= knots_[k] && w[i] <= knots_[k + 1];
      out[i] = {spatial::compose(turned, starts_[k]).R,
                is_turning ? spatial::scale(turns_[k], 1 / h) : Vec3{},
                {}};
    }
    return {};
  }

 private:
  std::vector<double> knots_;
  std::vector<Pose> starts_;
  std::vector<Vec3> turns_;
};

using Quaternion = std::array<double, 4>;

JetQuaternion constant(const Quaternion& q) { return {Jet{q[0]}, Jet{q[1]}, Jet{q[2]}, Jet{q[3]}}; }
/// Half the rotation vector of a^-1 b, in the axes of a.
Vec3 half_turn(const Quaternion& a, const Quaternion& b) {
  const JetVector v = spatial::log(constant(spatial::multiply(spatial::conjugate(a), b)));
  return {v[0].v, v[1].v, v[2].v};
}
Quaternion turned(const Quaternion& a, const Vec3& half) {
  const JetQuaternion e = spatial::exp(JetVector{Jet{half[0]}, Jet{half[1]}, Jet{half[2]}});
  return spatial::multiply(a, Quaternion{e[0].v, e[1].v, e[2].v, e[3].v});
}

/// Spherical quadrangle through all points (K. Shoemake, Animating rotation with quaternion
/// curves, SIGGRAPH 1985), its inner points chosen for knots at any distance: the angular velocity
/// at a point is the mean of those of its neighbouring turns, weighted by the other one's length.
/// Before the first and behind the last point, as on circles, the tool keeps its orientation: it
/// comes to rest there, so that the rate has no jump.
class Squad final : public Orientation {
 public:
  explicit Squad(const OrientationTask& task) : knots_(task.shares.begin(), task.shares.end()) {
    const std::size_t n = task.points.size();
    for (const Pose& p : task.points) {
      const spatial::Quaternion given = spatial::to_quaternion(p.R);
      Quaternion q{given.w, given.x, given.y, given.z};
      if (!q_.empty()) {  // the short way round
        double cosine = 0;
        for (std::size_t k = 0; k < 4; ++k) cosine += q[k] * q_.back()[k];
        if (cosine < 0)
          for (double& c : q) c = -c;
      }
      q_.push_back(q);
    }
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Vec3 ahead = half_turn(q_[i], q_[i + 1]);
      const double h = width(i);
      const Vec3 start = rate(i), end = rate(i + 1);
      Vec3 out, in;
      for (std::size_t k = 0; k < 3; ++k) {
        out[k] = (h * start[k] - ahead[k]) / 2;
        in[k] = (ahead[k] - h * end[k]) / 2;
      }
      inner_.push_back({turned(q_[i], out), turned(q_[i + 1], in)});
    }
  }

  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample>,
                        std::span<OrientationSample> out) const override {
    for (std::size_t i = 0; i < w.size(); ++i) {
      const std::size_t k = piece_of(knots_, w[i]);
      const double h = width(k), x = std::clamp((w[i] - knots_[k]) / h, 0.0, 1.0);
      const bool is_turning = w[i] >= knots_.front() && w[i] <= knots_.back();
      const Jet t{x, is_turning ? 1 / h : 0, 0};
      const JetQuaternion outer = slerp(constant(q_[k]), constant(q_[k + 1]), t),
                          inside = slerp(constant(inner_[k][0]), constant(inner_[k][1]), t),
                          q = slerp(outer, inside, t * (Jet{1} - t) * 2.0);
      out[i].R = spatial::from_quaternion({q[0].v, q[1].v, q[2].v, q[3].v});
      const spatial::TurnRates rates = spatial::turn_rates(q);
      out[i].turn = rates.velocity;
      out[i].bend = rates.acceleration;
    }
    return {};
  }

 private:
  [[nodiscard]] double width(std::size_t k) const {
    return std::max(knots_[k + 1] - knots_[k], 1e-12);
  }
  static constexpr double kAtEnd = 1e-9;  ///< shares this near an end of the way are there
  /// Half the angular velocity at a point, in its axes.
  [[nodiscard]] Vec3 rate(std::size_t i) const {
    const auto ahead = [&](std::size_t k) {
      return spatial::scale(half_turn(q_[i], q_[k + 1]), 1 / width(k));
    };
    if (i == 0) return knots_.front() > kAtEnd ? Vec3{} : ahead(0);
    const Vec3 behind = spatial::scale(half_turn(q_[i], q_[i - 1]), -1 / width(i - 1));
    if (i + 1 == q_.size()) return knots_.back() < 1 - kAtEnd ? Vec3{} : behind;
    const double before = width(i - 1), after = width(i);
    return spatial::scale(add(spatial::scale(behind, after), spatial::scale(ahead(i), before)),
                          1 / (before + after));
  }
  static JetQuaternion slerp(const JetQuaternion& a, const JetQuaternion& b, const Jet& t) {
    return spatial::multiply(a, spatial::exp(spatial::scale(
                                    spatial::log(spatial::multiply(spatial::conjugate(a), b)), t)));
  }

  std::vector<double> knots_;
  std::vector<Quaternion> q_;
  std::vector<std::array<Quaternion, 2>> inner_;
};

/// One axis of the tool along the tangent, another as near to `up` as it can be.
class Tangent final : public Orientation {
 public:
  /// `axis` 0, 1, 2 follows the tangent; the next but one (z for x) leans to `up`.
  Tangent(std::size_t axis, const Vec3& up) : axis_(axis), up_(up) {}
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    const JetVector up{Jet{up_[0]}, Jet{up_[1]}, Jet{up_[2]}};
    for (std::size_t i = 0; i < w.size(); ++i) {
      const CurveSample& p = along[i];
      const JetVector t =
          spatial::unit({Jet{p.d1[0], p.d2[0], p.d3[0]}, Jet{p.d1[1], p.d2[1], p.d3[1]},
                         Jet{p.d1[2], p.d2[2], p.d3[2]}});
      JetVector axes[3];
      axes[axis_] = t;
      axes[(axis_ + 1) % 3] = spatial::unit(spatial::cross(up, t));
      axes[(axis_ + 2) % 3] = spatial::cross(t, axes[(axis_ + 1) % 3]);
      OrientationSample& s = out[i];
      s.turn = s.bend = {};
      for (std::size_t c = 0; c < 3; ++c) {
        const JetVector& a = axes[c];
        for (std::size_t r = 0; r < 3; ++r) s.R[3 * r + c] = a[r].v;
        for (std::size_t r = 0; r < 3; ++r) {
          const std::size_t y = (r + 1) % 3, z = (r + 2) % 3;
          s.turn[r] += (a[y].v * a[z].d - a[z].v * a[y].d) / 2;
          s.bend[r] += (a[y].v * a[z].dd - a[z].v * a[y].dd) / 2;
        }
      }
    }
    return {};
  }

 private:
  std::size_t axis_;
  Vec3 up_;
};

/// Another orientation within a part of the way, and starting and stopping smoothly if wanted.
class Eased final : public Orientation {
 public:
  Eased(std::unique_ptr<Orientation> inner, double from, double to, bool is_smooth)
      : inner_(std::move(inner)), from_(from), to_(to), is_smooth_(is_smooth) {}
  Result<void> evaluate(std::span<const double> w, std::span<const CurveSample> along,
                        std::span<OrientationSample> out) const override {
    const double h = to_ - from_;
    for (std::size_t i = 0; i < w.size(); ++i) {
      const double x = std::clamp((w[i] - from_) / h, 0.0, 1.0);
      const bool is_turning = w[i] >= from_ && w[i] <= to_;
      const Jet eased = is_smooth_ ? spatial::ease(x) : Jet{x, 1, 0};
      RMP_TRY(inner_->evaluate({&eased.v, 1}, along.subspan(i, 1), out.subspan(i, 1)));
      OrientationSample& s = out[i];
      const double e1 = is_turning ? eased.d / h : 0, e2 = is_turning ? eased.dd / (h * h) : 0;
      s.bend = add(spatial::scale(s.bend, e1 * e1), spatial::scale(s.turn, e2));
      s.turn = spatial::scale(s.turn, e1);
    }
    return {};
  }

 private:
  std::unique_ptr<Orientation> inner_;
  double from_, to_;
  bool is_smooth_;
};

/// By the parameters from, to and ease.
Result<std::unique_ptr<Orientation>> eased(std::unique_ptr<Orientation> inner,
                                           const Params& params) {
  const double from = params.real("from"), to = params.real("to");
  const bool is_smooth = params.text("ease") == "smooth";
  if (!(to > from))
    return bad("the tool would rotate from " + print_number(100 * from) + " % to " +
                   print_number(100 * to) + " % of the path",
               "to must be greater than from.");
  if (from == 0 && to == 1 && !is_smooth) return inner;
  return std::unique_ptr<Orientation>(new Eased(std::move(inner), from, to, is_smooth));
}

}  // namespace

Result<std::unique_ptr<Orientation>> FixedFactory::make(const OrientationTask& task,
                                                        const Params&) const {
  if (task.points.empty()) return bad("there is no point to take the orientation from", {});
  return std::unique_ptr<Orientation>(new Slerp(task.points.front().R, {}));
}

Result<std::unique_ptr<Orientation>> SlerpFactory::make(const OrientationTask& task,
                                                        const Params& params) const {
  if (task.points.empty()) return bad("there is no point to take the orientation from", {});
  const Pose &first = task.points.front(), &last = task.points.back();
  return eased(std::make_unique<Slerp>(first.R, turn_between(first, last)), params);
}

Result<std::unique_ptr<Orientation>> SlerpPointsFactory::make(const OrientationTask& task,
                                                              const Params& params) const {
  RMP_TRY(check_shares(task));
  if (task.points.size() == 1) return FixedFactory().make(task, params);
  return std::unique_ptr<Orientation>(new SlerpPoints(task));
}

Result<std::unique_ptr<Orientation>> SquadFactory::make(const OrientationTask& task,
                                                        const Params& params) const {
  RMP_TRY(check_shares(task));
  if (task.points.size() == 1) return FixedFactory().make(task, params);
  return std::unique_ptr<Orientation>(new Squad(task));
}

Result<std::unique_ptr<Orientation>> TangentFactory::make(const OrientationTask& task,
                                                          const Params& params) const {
  if (task.points.empty()) return bad("there is no point to take the orientation from", {});
  const std::string_view name = params.text("axis");
  const std::size_t axis = name == "x" ? 0 : name == "y" ? 1 : 2, leaning = (axis + 2) % 3;
  Vec3 up{};
  if (const auto given = params.reals("up"); given.size() == 3) {
    up = {given[0], given[1], given[2]};
  } else if (given.empty()) {
    const auto& R = task.points.front().R;
    up = {R[leaning], R[3 + leaning], R[6 + leaning]};
  } else {
    return bad("up has " + std::to_string(given.size()) + " numbers", "Give x, y, z.");
  }
  if (!(spatial::norm(up) > 0))
    return bad("up has no length", "Give a direction, such as 0, 0, 1.");
  constexpr int kSamples = 200;
  for (int i = 0; i <= kSamples; ++i) {
    const double u = task.curve->end() * i / kSamples;
    CurveSample p;
    RMP_TRY(task.curve->evaluate({&u, 1}, {&p, 1}));
    const double length = spatial::norm(p.d1);
    if (!(length > 0))
      return bad("the curve has no tangent at " + print_number(100.0 * i / kSamples) +
                     " % of its parameter",
                 "Choose another orientation.");
    if (spatial::norm(spatial::cross(spatial::unit(up), p.d1)) < 1e-3 * length)
      return bad("at " + print_number(100.0 * i / kSamples) +
                     " % of its parameter the curve runs along up, so the tool's roll is undefined",
                 "Give another up.");
  }
  return std::unique_ptr<Orientation>(new Tangent(axis, spatial::unit(up)));
}

}  // namespace robomosp::path_analytic

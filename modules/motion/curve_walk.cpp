// SPDX-License-Identifier: Apache-2.0
#include "motion/curve_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernel/text.h"
#include "spatial/quintic.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::dot;

constexpr int kDeepest = 40;
// |d1| below this share of the mean counts as a standstill.
constexpr double kStandstill = 1e-9;

Result<CurveSample> at(const Curve& curve, double u) {
  CurveSample out;
  RMP_TRY(curve.evaluate({&u, 1}, {&out, 1}));
  return out;
}

/// Arc length from a to b by Gauss-Legendre quadrature with ten nodes; exact for |d1| of degree 19.
Result<double> quadrature(const Curve& curve, double a, double b) {
  // Abramowitz and Stegun, Handbook of Mathematical Functions, table 25.4.
  constexpr std::array<double, 5> x{0.148874338981631211, 0.433395394129247191,
                                    0.679409568299024406, 0.865063366688984511,
                                    0.973906528517171720};
  constexpr std::array<double, 5> weight{0.295524224714752870, 0.269266719309996355,
                                         0.219086362515982044, 0.149451349150580593,
                                         0.066671344308688138};
  std::array<double, 10> u;
  std::array<CurveSample, 10> p;
  const double mean = (a + b) / 2, half = (b - a) / 2;
  for (std::size_t i = 0; i < 5; ++i) {
    u[2 * i] = mean - half * x[i];
    u[2 * i + 1] = mean + half * x[i];
  }
  RMP_TRY(curve.evaluate(u, p));
  double sum = 0;
  for (std::size_t i = 0; i < 10; ++i) sum += weight[i / 2] * spatial::norm(p[i].d1);
  return sum * half;
}

/// The parameter with its derivatives with respect to arc length.
spatial::Jet by_length(double u, const CurveSample& p) {
  const double v2 = dot(p.d1, p.d1);
  return {u, 1 / std::sqrt(v2), -dot(p.d1, p.d2) / (v2 * v2)};
}

}  // namespace

Result<CurveWalk> CurveWalk::by_parameter(std::shared_ptr<const Curve> curve) {
  CurveWalk walk;
  walk.curve_ = std::move(curve);
  const double end = walk.curve_->end();
  if (walk.curve_->is_even()) {
    RMP_TRY_ASSIGN(const CurveSample start, at(*walk.curve_, 0));
    walk.length_ = spatial::norm(start.d1) * end;
    return walk;
  }
  // Smooth between knots: a few pieces each are measured to far below what a length is printed to.
  std::vector<double> knots = walk.curve_->knots();
  knots.insert(knots.begin(), 0);
  knots.push_back(end);
  constexpr int kParts = 16;
  for (std::size_t k = 1; k < knots.size(); ++k)
    for (int i = 0; i < kParts && knots[k] > knots[k - 1]; ++i) {
      const double h = (knots[k] - knots[k - 1]) / kParts, from = knots[k - 1] + i * h;
      RMP_TRY_ASSIGN(const double part, quadrature(*walk.curve_, from, from + h));
      walk.length_ += part;
    }
  return walk;
}

Result<CurveWalk> CurveWalk::build(std::shared_ptr<const Curve> curve) {
  if (curve->is_even()) return by_parameter(std::move(curve));
  RMP_TRY_ASSIGN(CurveWalk walk, by_parameter(curve));
  if (!(walk.length_ > 0)) return walk;
  std::vector<double> knots = curve->knots();
  knots.push_back(curve->end());
  double from = 0;
  for (const double knot : knots) {
    if (knot <= from) continue;
    RMP_TRY(walk.refine(from, std::min(knot, curve->end()), 0));
    from = knot;
  }
  walk.length_ = walk.pieces_.back().s0 + walk.pieces_.back().h;
  return walk;
}

Result<void> CurveWalk::refine(double u0, double u1, int depth) {
  RMP_TRY_ASSIGN(const CurveSample first, at(*curve_, u0));
  RMP_TRY_ASSIGN(const CurveSample last, at(*curve_, u1));
  const double mean_speed = length_ / curve_->end();
  for (const auto& [u, p] : {std::pair{u0, first}, std::pair{u1, last}})
    if (!(spatial::norm(p.d1) > kStandstill * mean_speed) || depth > kDeepest)
      return error(ErrorCode::invalid_argument,
                   "the curve has no direction at " + text::print_rounded(100 * u / curve_->end()) +
                       " % of its parameter",
                   "Coincident control points stop it there; move them apart, or give times.");
  RMP_TRY_ASSIGN(const double h, quadrature(*curve_, u0, u1));
  const double s0 = pieces_.empty() ? 0 : pieces_.back().s0 + pieces_.back().h;
  const spatial::Jet a = by_length(u0, first), b = by_length(u1, last);
  // In x = (s - s0) / h.
  const Piece piece{s0, h, spatial::Quintic(a, b, h).coefficients()};
  double worst = 0, before = u0, length = 0;
  for (const double x : {0.2, 0.5, 0.8}) {
    double u = piece.c[5];
    for (int k = 4; k >= 0; --k) u = u * x + piece.c[k];
    RMP_TRY_ASSIGN(const double part, quadrature(*curve_, before, u));
    length += part;
    before = u;
    worst = std::max(worst, std::abs(length - x * h));
  }
  if (worst <= kLengthTolerance * length_) {
    pieces_.push_back(piece);
    return {};
  }
  const double middle = (u0 + u1) / 2;
  RMP_TRY(refine(u0, middle, depth + 1));
  return refine(middle, u1, depth + 1);
}

double CurveWalk::parameter(double s, std::size_t& hint) const {
  if (hint >= pieces_.size() || s < pieces_[hint].s0 || s > pieces_[hint].s0 + pieces_[hint].h) {
    const auto next = std::upper_bound(pieces_.begin() + 1, pieces_.end(), s,
                                       [](double v, const Piece& p) { return v < p.s0; });
    hint = static_cast<std::size_t>(next - pieces_.begin()) - 1;
  }
  const Piece& piece = pieces_[hint];
  const double x = (s - piece.s0) / piece.h;
  double u = piece.c[5];
  for (int k = 4; k >= 0; --k) u = u * x + piece.c[k];
  return std::clamp(u, 0.0, curve_->end());
}

Result<std::vector<double>> CurveWalk::knot_shares() const {
  std::vector<double> shares = curve_->knots();
  for (double& k : shares) {
    if (pieces_.empty()) {
      k /= curve_->end();
      continue;
    }
    // The pieces end at the knots.
    const auto next = std::upper_bound(pieces_.begin() + 1, pieces_.end(), k,
                                       [](double v, const Piece& p) { return v < p.c[0]; });
    const Piece& piece = *(next - 1);
    const bool is_last = next == pieces_.end() && k >= curve_->end();
    RMP_TRY_ASSIGN(const double from_piece, quadrature(*curve_, piece.c[0], k));
    k = std::clamp((is_last ? length_ : piece.s0 + from_piece) / length_, 0.0, 1.0);
  }
  return shares;
}

Result<void> CurveWalk::evaluate(std::span<const double> w, std::span<CurveSample> out) const {
  constexpr std::size_t kChunk = 64;
  std::array<double, kChunk> u;
  const double end = curve_->end();
  std::size_t hint = 0;
  for (std::size_t first = 0; first < w.size(); first += kChunk) {
    const std::size_t n = std::min(kChunk, w.size() - first);
    for (std::size_t i = 0; i < n; ++i) {
      const double share = std::clamp(w[first + i], 0.0, 1.0);
      u[i] = pieces_.empty() ? share * end : parameter(share * length_, hint);
    }
    const auto chunk = out.subspan(first, n);
    RMP_TRY(curve_->evaluate(std::span<const double>(u).first(n), chunk));
    for (CurveSample& p : chunk) {
      // d/dw of u: end, or by arc length s = length w.
      double u1 = end, u2 = 0, u3 = 0;
      if (!pieces_.empty()) {
        const double v2 = dot(p.d1, p.d1), v = std::sqrt(v2), v1 = dot(p.d1, p.d2) / v;
        const double vv = (dot(p.d2, p.d2) + dot(p.d1, p.d3) - v1 * v1) / v;
        u1 = length_ / v;
        u2 = -v1 / v * u1 * u1;
        u3 = (3 * v1 * v1 / v2 - vv / v) * u1 * u1 * u1;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const double a = p.d1[k], b = p.d2[k], c = p.d3[k];
        p.d1[k] = a * u1;
        p.d2[k] = b * u1 * u1 + a * u2;
        p.d3[k] = c * u1 * u1 * u1 + 3 * b * u1 * u2 + a * u3;
      }
    }
  }
  return {};
}

}  // namespace robomosp::motion

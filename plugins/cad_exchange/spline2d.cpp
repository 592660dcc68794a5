// SPDX-License-Identifier: Apache-2.0
#include "spline2d.h"

#include <algorithm>
#include <cmath>

namespace robomosp::cad_exchange {
namespace {

double spline_distance(const Point2& a, const Point2& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1]);
}

/// More points would not make a better outline.
constexpr std::size_t kMostPieces = 1024;

}  // namespace

NaturalSpline::NaturalSpline(std::span<const Point2> points)
    : p_(points.begin(), points.end()), m_(points.size(), Point2{}), t_(points.size(), 0.0) {
  const std::size_t n = p_.size();
  for (std::size_t i = 1; i < n; ++i) t_[i] = t_[i - 1] + spline_distance(p_[i - 1], p_[i]);
  // Tridiagonal system for the second derivatives (Thomas' algorithm).
  std::vector<double> c(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = t_[i] - t_[i - 1], h1 = t_[i + 1] - t_[i];
    const double pivot = 2 * (h0 + h1) - h0 * c[i - 1];
    c[i] = h1 / pivot;
    for (std::size_t k = 0; k < 2; ++k) {
      const double r = 6 * ((p_[i + 1][k] - p_[i][k]) / h1 - (p_[i][k] - p_[i - 1][k]) / h0);
      m_[i][k] = (r - h0 * m_[i - 1][k]) / pivot;
    }
  }
  for (std::size_t i = n; i-- > 1;)
    if (i + 1 < n)
      for (std::size_t k = 0; k < 2; ++k) m_[i][k] -= c[i] * m_[i + 1][k];
}

Point2 NaturalSpline::at(double t) const {
  const auto above = std::upper_bound(t_.begin() + 1, t_.end() - 1, t);
  const auto i = static_cast<std::size_t>(above - t_.begin());
  const double h = t_[i] - t_[i - 1], a = (t_[i] - t) / h, b = (t - t_[i - 1]) / h;
  Point2 out{};
  for (std::size_t k = 0; k < 2; ++k)
    out[k] = a * p_[i - 1][k] + b * p_[i][k] +
             ((a * a * a - a) * m_[i - 1][k] + (b * b * b - b) * m_[i][k]) * h * h / 6;
  return out;
}

std::vector<Point2> NaturalSpline::bezier() const {
  std::vector<Point2> out{p_[0]};
  for (std::size_t i = 1; i < p_.size(); ++i) {
    const double h = t_[i] - t_[i - 1];
    Point2 b{}, c{};
    for (std::size_t k = 0; k < 2; ++k) {
      const double slope = (p_[i][k] - p_[i - 1][k]) / h;
      const double d0 = slope - h * (2 * m_[i - 1][k] + m_[i][k]) / 6;
      const double d1 = slope + h * (m_[i - 1][k] + 2 * m_[i][k]) / 6;
      b[k] = p_[i - 1][k] + h * d0 / 3;
      c[k] = p_[i][k] - h * d1 / 3;
    }
    out.insert(out.end(), {b, c, p_[i]});
  }
  return out;
}

bool BSpline::is_sound() const {
  if (degree < 1 || degree > 25 || points.size() < static_cast<std::size_t>(degree) + 1)
    return false;
  if (knots.size() != points.size() + static_cast<std::size_t>(degree) + 1) return false;
  if (!weights.empty() && weights.size() != points.size()) return false;
  if (std::any_of(weights.begin(), weights.end(), [](double w) { return !(w > 0); })) return false;
  return std::is_sorted(knots.begin(), knots.end()) && last() > first();
}

Point2 BSpline::at(double t) const {
  const auto d = static_cast<std::size_t>(degree);
  const auto above = std::upper_bound(
      knots.begin() + degree, knots.begin() + static_cast<std::ptrdiff_t>(points.size()), t);
  const auto span = static_cast<std::size_t>(above - knots.begin()) - 1;
  // De Boor's algorithm in homogeneous coordinates.
  std::vector<std::array<double, 3>> q(d + 1);
  for (std::size_t i = 0; i <= d; ++i) {
    const std::size_t j = span - d + i;
    const double w = weights.empty() ? 1 : weights[j];
    q[i] = {w * points[j][0], w * points[j][1], w};
  }
  for (std::size_t r = 1; r <= d; ++r)
    for (std::size_t i = d; i >= r; --i) {
      const double low = knots[span - d + i], high = knots[span + 1 + i - r];
      const double a = high > low ? (t - low) / (high - low) : 0;
      for (std::size_t k = 0; k < 3; ++k) q[i][k] = (1 - a) * q[i - 1][k] + a * q[i][k];
    }
  return {q[d][0] / q[d][2], q[d][1] / q[d][2]};
}

std::vector<double> BSpline::corners() const {
  std::vector<double> out{first()};
  for (auto i = static_cast<std::size_t>(degree); i < points.size();) {
    std::size_t next = i;
    while (next < knots.size() && knots[next] == knots[i]) ++next;
    if (knots[i] > first() && knots[i] < last() && next - i >= static_cast<std::size_t>(degree))
      out.push_back(knots[i]);
    i = next;
  }
  out.push_back(last());
  return out;
}

namespace {

/// Parameters at which a piece is taken over: even within knot spans, and ever closer towards both
/// ends, where the straight ends of a natural spline would show.
std::vector<double> stations(const std::vector<double>& spans, std::size_t pieces) {
  std::vector<double> t{spans.front()};
  for (std::size_t i = 1; i < spans.size(); ++i)
    for (std::size_t k = 1; k <= pieces; ++k)
      t.push_back(k == pieces ? spans[i]
                              : spans[i - 1] + (spans[i] - spans[i - 1]) * static_cast<double>(k) /
                                                   static_cast<double>(pieces));
  const double head = t[1] - t[0], tail = t[t.size() - 1] - t[t.size() - 2];
  for (int k = 1; k <= 8; ++k) {
    t.push_back(spans.front() + std::ldexp(head, -k));
    t.push_back(spans.back() - std::ldexp(tail, -k));
  }
  std::sort(t.begin(), t.end());
  return t;
}

/// Distance of a point from a piece of the spline near to it.
double distance_from(const NaturalSpline& s, const Point2& p, double low, double high) {
  for (int i = 0; i < 40; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (spline_distance(p, s.at(a)) < spline_distance(p, s.at(b)) ? high : low) =
        spline_distance(p, s.at(a)) < spline_distance(p, s.at(b)) ? b : a;
  }
  return spline_distance(p, s.at((low + high) / 2));
}

}  // namespace

std::vector<Point2> follow(const BSpline& s, double from, double to, double tolerance,
                           double& error) {
  std::vector<double> spans{from};
  for (const double k : s.knots)
    if (k > spans.back() && k < to) spans.push_back(k);
  spans.push_back(to);
  std::vector<Point2> best;
  error = INFINITY;
  for (std::size_t pieces = 4;; pieces *= 2) {
    if (!best.empty() && pieces * (spans.size() - 1) > kMostPieces) break;
    std::vector<Point2> through;
    std::vector<double> t;
    for (const double at : stations(spans, pieces)) {
      const Point2 p = s.at(at);
      if (!through.empty() && !(spline_distance(p, through.back()) > 0)) continue;
      through.push_back(p);
      t.push_back(at);
    }
    if (through.size() < 2) return {};
    const NaturalSpline fit(through);
    double worst = 0;
    for (std::size_t i = 1; i < through.size(); ++i)
      worst = std::max(worst, distance_from(fit, s.at(0.5 * (t[i - 1] + t[i])),
                                            fit.parameters()[i - 1], fit.parameters()[i]));
    best = std::move(through);
    error = worst;
    if (error <= tolerance) break;
  }
  return best;
}

}  // namespace robomosp::cad_exchange

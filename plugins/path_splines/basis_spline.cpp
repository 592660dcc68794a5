// SPDX-License-Identifier: Apache-2.0
#include "basis_spline.h"

#include <algorithm>
#include <cmath>

namespace robomosp::path_splines {
namespace {

/// The piece [t_k, t_(k+1)) with u in it; the last one that has a length at the end.
std::size_t span_of(const std::vector<double>& t, int degree, std::size_t count, double u) {
  const auto p = static_cast<std::ptrdiff_t>(degree);
  const auto first = t.begin() + p, last = t.begin() + static_cast<std::ptrdiff_t>(count);
  auto next = std::upper_bound(first, last, u);
  if (next == last)  // u at or behind the end: the last piece with a length
    while (next - 1 > first && *(next - 1) == *last) --next;
  return static_cast<std::size_t>(next - t.begin()) - 1;
}

/// Values of order `order` derivatives of the degree + 1 basis functions that are not zero on the
/// piece `k`, into out[0..degree]. De Boor's recursion, differentiated by differences of the
/// functions of lower degree.
void basis(const std::vector<double>& t, int degree, std::size_t k, double u, int order,
           std::vector<double>& out) {
  const auto at = [&](std::ptrdiff_t i) { return t[static_cast<std::size_t>(i)]; };
  const auto K = static_cast<std::ptrdiff_t>(k);
  out.assign(static_cast<std::size_t>(degree) + 1, 0.0);
  if (order > degree) return;
  out[0] = 1;
  const int low = degree - order;  // values of this degree, then `order` differences
  for (int d = 1; d <= low; ++d) {
    double carried = 0;
    for (int r = 0; r < d; ++r) {
      const double right = at(K + r + 1), left = at(K + r + 1 - d);
      const double share = out[static_cast<std::size_t>(r)] / (right - left);
      out[static_cast<std::size_t>(r)] = carried + (right - u) * share;
      carried = (u - left) * share;
    }
    out[static_cast<std::size_t>(d)] = carried;
  }
  for (int d = low + 1; d <= degree; ++d) {
    double carried = 0;
    for (int r = 0; r < d; ++r) {
      const double share =
          d * out[static_cast<std::size_t>(r)] / (at(K + r + 1) - at(K + r + 1 - d));
      out[static_cast<std::size_t>(r)] = carried - share;
      carried = share;
    }
    out[static_cast<std::size_t>(d)] = carried;
  }
}

/// A matrix with few entries about its diagonal, solved in place by Gauss with row exchange.
class Band {
 public:
  Band(std::size_t size, std::size_t reach)
      : size_(size), reach_(reach), width_(3 * reach + 1), a_(size * width_, 0.0) {}
  double& at(std::size_t row, std::size_t column) {
    return a_[row * width_ + column + reach_ - row];
  }
  void solve(std::vector<Vec3>& b) {
    for (std::size_t k = 0; k < size_; ++k) {
      const std::size_t last = std::min(size_ - 1, k + reach_),
                        right = std::min(size_ - 1, k + 2 * reach_);
      std::size_t pivot = k;
      for (std::size_t r = k + 1; r <= last; ++r)
        if (std::fabs(at(r, k)) > std::fabs(at(pivot, k))) pivot = r;
      if (pivot != k) {
        for (std::size_t c = k; c <= right; ++c) {
          const double mine = at(k, c), other = has(pivot, c) ? at(pivot, c) : 0;
          at(k, c) = other;
          if (has(pivot, c)) at(pivot, c) = mine;
        }
        std::swap(b[k], b[pivot]);
      }
      for (std::size_t r = k + 1; r <= last; ++r) {
        const double f = at(r, k) / at(k, k);
        if (f == 0) continue;
        for (std::size_t c = k; c <= right && has(r, c); ++c) at(r, c) -= f * at(k, c);
        for (std::size_t x = 0; x < 3; ++x) b[r][x] -= f * b[k][x];
      }
    }
    for (std::size_t k = size_; k-- > 0;) {
      for (std::size_t c = k + 1; c <= std::min(size_ - 1, k + 2 * reach_); ++c)
        for (std::size_t x = 0; x < 3; ++x) b[k][x] -= at(k, c) * b[c][x];
      for (double& x : b[k]) x /= at(k, k);
    }
  }

 private:
  [[nodiscard]] bool has(std::size_t row, std::size_t column) const {
    return column + reach_ >= row && column + reach_ - row < width_;
  }
  std::size_t size_, reach_, width_;
  std::vector<double> a_;
};

}  // namespace

void BasisSpline::derivatives(double u, int orders, std::span<Vec3> out) const {
  const std::size_t k = span_of(knots, degree, points.size(), u);
  std::vector<double> n;
  for (int order = 0; order <= orders; ++order) {
    basis(knots, degree, k, u, order, n);
    Vec3 sum{};
    for (std::size_t r = 0; r < n.size(); ++r)
      for (std::size_t x = 0; x < 3; ++x)
        sum[x] += n[r] * points[k - static_cast<std::size_t>(degree) + r][x];
    out[static_cast<std::size_t>(order)] = sum;
  }
}

std::vector<double> clamped_knots(int degree, double start, std::span<const double> inner,
                                  double end) {
  std::vector<double> knots(static_cast<std::size_t>(degree) + 1, start);
  knots.insert(knots.end(), inner.begin(), inner.end());
  knots.insert(knots.end(), static_cast<std::size_t>(degree) + 1, end);
  return knots;
}

BasisSpline interpolate(int degree, std::span<const double> times, std::span<const Vec3> points,
                        std::span<const EndCondition> ends) {
  BasisSpline out;
  out.degree = degree;
  out.knots =
      clamped_knots(degree, times.front(), times.subspan(1, times.size() - 2), times.back());
  const std::size_t size = points.size() + ends.size(), p = static_cast<std::size_t>(degree);
  out.points.resize(size);
  // Rows in the order of the places they speak of, so that the matrix stays narrow.
  Band matrix(size, p + ends.size());
  std::size_t row = 0;
  std::vector<double> n;
  const auto add = [&](double u, int order, const Vec3& value) {
    const std::size_t k = span_of(out.knots, degree, size, u);
    basis(out.knots, degree, k, u, order, n);
    for (std::size_t r = 0; r <= p; ++r) matrix.at(row, k - p + r) = n[r];
    out.points[row++] = value;
  };
  add(times.front(), 0, points.front());
  for (const EndCondition& e : ends)
    if (e.is_start) add(times.front(), e.order, e.value);
  for (std::size_t i = 1; i + 1 < points.size(); ++i) add(times[i], 0, points[i]);
  for (const EndCondition& e : ends)
    if (!e.is_start) add(times.back(), e.order, e.value);
  add(times.back(), 0, points.back());
  matrix.solve(out.points);
  return out;
}

BasisSpline interpolate_not_a_knot(int degree, std::span<const double> times,
                                   std::span<const Vec3> points) {
  BasisSpline out;
  out.degree = degree;
  const auto p = static_cast<std::size_t>(degree), size = points.size();
  const std::size_t at_end = (p - 1) / 2, at_start = p - 1 - at_end;
  out.knots = clamped_knots(degree, times.front(),
                            times.subspan(1 + at_start, times.size() - 1 - p), times.back());
  out.points.assign(points.begin(), points.end());
  Band matrix(size, p);
  std::vector<double> n;
  for (std::size_t row = 0; row < size; ++row) {
    const std::size_t k = span_of(out.knots, degree, size, times[row]);
    basis(out.knots, degree, k, times[row], 0, n);
    for (std::size_t r = 0; r <= p; ++r) matrix.at(row, k - p + r) = n[r];
  }
  matrix.solve(out.points);
  return out;
}

// The lower derivatives are those of a clamped spline with the same values x at both ends, and x is
// such that the higher ones agree as well. The spline is linear in x.
BasisSpline interpolate_periodic(int degree, std::span<const double> times,
                                 std::span<const Vec3> points) {
  const int orders = (degree - 1) / 2;
  const auto clamped = [&](int unit, std::span<const Vec3> through) {
    std::vector<EndCondition> ends;
    for (const bool is_start : {true, false})
      for (int m = 1; m <= orders; ++m) ends.push_back({is_start, m, {m == unit ? 1.0 : 0, 0, 0}});
    return interpolate(degree, times, through, ends);
  };
  // How far a higher derivative is from being the same at both ends.
  const auto jumps = [&](const BasisSpline& s) {
    std::vector<Vec3> first(static_cast<std::size_t>(degree)), last = first;
    s.derivatives(times.front(), degree - 1, first);
    s.derivatives(times.back(), degree - 1, last);
    std::vector<Vec3> out;
    for (std::size_t m = static_cast<std::size_t>(orders) + 1; m < first.size(); ++m)
      out.push_back({last[m][0] - first[m][0], last[m][1] - first[m][1], last[m][2] - first[m][2]});
    return out;
  };
  BasisSpline out = clamped(0, points);
  std::vector<Vec3> x = jumps(out);
  const std::vector<Vec3> nowhere(points.size());
  std::vector<BasisSpline> units;
  const auto count = static_cast<std::size_t>(orders);
  Band matrix(count, count);
  for (std::size_t m = 0; m < count; ++m) {
    units.push_back(clamped(static_cast<int>(m) + 1, nowhere));
    const std::vector<Vec3> column = jumps(units.back());
    for (std::size_t row = 0; row < count; ++row) matrix.at(row, m) = -column[row][0];
  }
  matrix.solve(x);
  for (std::size_t m = 0; m < count; ++m)
    for (std::size_t i = 0; i < out.points.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) out.points[i][c] += units[m].points[i][0] * x[m][c];
  return out;
}

}  // namespace robomosp::path_splines

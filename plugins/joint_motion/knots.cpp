// SPDX-License-Identifier: Apache-2.0
#include "knots.h"

#include <algorithm>
#include <cmath>

#include "spatial/cubic_spline.h"
#include "spatial/quintic.h"

namespace robomosp::joint_motion {
namespace {

/// A square system with `band` diagonals either side of the main one and several right sides;
/// elimination with row exchanges.
class BandSystem {
 public:
  BandSystem(std::size_t size, std::size_t band, std::size_t sides)
      : n_(size), b_(band), width_(3 * band + 1), sides_(sides), a_(n_ * width_), r_(n_ * sides) {}
  double& at(std::size_t row, std::size_t column) { return a_[row * width_ + column + b_ - row]; }
  double& side(std::size_t row, std::size_t k) { return r_[row * sides_ + k]; }
  void solve() {
    for (std::size_t k = 0; k < n_; ++k) {
      const std::size_t last = std::min(n_, k + b_ + 1), right = std::min(n_, k + 2 * b_ + 1);
      std::size_t best = k;
      for (std::size_t i = k + 1; i < last; ++i)
        if (std::fabs(at(i, k)) > std::fabs(at(best, k))) best = i;
      if (best != k) {
        for (std::size_t c = k; c < right; ++c) std::swap(at(k, c), at(best, c));
        for (std::size_t s = 0; s < sides_; ++s) std::swap(side(k, s), side(best, s));
      }
      for (std::size_t i = k + 1; i < last; ++i) {
        const double f = at(i, k) / at(k, k);
        if (f == 0) continue;
        for (std::size_t c = k; c < right; ++c) at(i, c) -= f * at(k, c);
        for (std::size_t s = 0; s < sides_; ++s) side(i, s) -= f * side(k, s);
      }
    }
    for (std::size_t k = n_; k-- > 0;)
      for (std::size_t s = 0; s < sides_; ++s) {
        double sum = side(k, s);
        for (std::size_t c = k + 1; c < std::min(n_, k + 2 * b_ + 1); ++c)
          sum -= at(k, c) * side(c, s);
        side(k, s) = sum / at(k, k);
      }
  }

 private:
  std::size_t n_, b_, width_, sides_;
  std::vector<double> a_, r_;
};

Piece quintic_piece(const spatial::Jet& start, const spatial::Jet& end, double h) {
  Piece c = spatial::Quintic(start, end, h).coefficients();
  double scale = 1;
  for (double& x : c) x /= scale, scale *= h;
  return c;
}

Spline cubic(const Task& t, std::span<const double> step, const Clamps* clamps) {
  const std::span<const double> none;
  const std::vector<double> rates = spatial::cubic_spline_rates(
      t.dof, t.q, step, clamps ? clamps->v0 : none, clamps ? clamps->v1 : none);
  Spline out{{step.begin(), step.end()}, {}};
  for (std::size_t i = 0; i < step.size(); ++i)
    for (std::size_t j = 0; j < t.dof; ++j) {
      const auto c = spatial::cubic_piece(t.at(i, j), t.at(i + 1, j), rates[i * t.dof + j],
                                          rates[(i + 1) * t.dof + j], step[i]);
      out.pieces.push_back({c[0], c[1], c[2], c[3], 0, 0});
    }
  return out;
}

/// Velocities and accelerations at the knots; third and fourth derivatives are the same on both
/// sides. Unknowns of a knot: its velocity, then its acceleration.
Spline quintic(const Task& t, std::span<const double> step, const Clamps* clamps) {
  const std::size_t n = t.count, m = n - 1;
  BandSystem s(2 * n, 3, t.dof);
  // Adds sign times a derivative of piece `i` at one of its ends to a row: with d the mean slope,
  // third = (60 d - 36 v - 24 w) / h^2 + s (3 b - 9 a) / h, fourth = s (-360 d + 192 v + 168 w) /
  // h^3 + (36 a - 24 b) / h^2, where v, a belong to that end, w, b to the other one, and s is 1 at
  // the start, -1 at the end.
  const auto add = [&](std::size_t row, std::size_t i, bool is_end, bool is_fourth, double sign) {
    const double h = step[i], e = is_end ? -1 : 1;
    const std::size_t here = 2 * (is_end ? i + 1 : i), other = 2 * (is_end ? i : i + 1);
    const double scale = sign * (is_fourth ? 1 / (h * h * h) : 1 / (h * h));
    const double v = is_fourth ? 192 * e : -36, w = is_fourth ? 168 * e : -24;
    const double a = is_fourth ? 36 * h : -9 * e * h, b = is_fourth ? -24 * h : 3 * e * h;
    const double d = is_fourth ? -360 * e : 60;
    s.at(row, here) += scale * v, s.at(row, other) += scale * w;
    s.at(row, here + 1) += scale * a, s.at(row, other + 1) += scale * b;
    for (std::size_t j = 0; j < t.dof; ++j)
      s.side(row, j) -= scale * d * (t.at(i + 1, j) - t.at(i, j)) / h;
  };
  for (const bool is_end : {false, true}) {
    const std::size_t row = is_end ? 2 * m : 0;
    if (!clamps && m == 1) {
      // Free at both ends it may be any parabola: the straight one.
      s.at(row, row) = s.at(row + 1, row + 1) = 1;
      for (std::size_t j = 0; j < t.dof; ++j) s.side(row, j) = (t.at(1, j) - t.at(0, j)) / step[0];
      continue;
    }
    if (!clamps) {
      add(row, is_end ? m - 1 : 0, is_end, false, 1);
      add(row + 1, is_end ? m - 1 : 0, is_end, true, 1);
      continue;
    }
    s.at(row, row) = s.at(row + 1, row + 1) = 1;
    for (std::size_t j = 0; j < t.dof; ++j) {
      s.side(row, j) = (is_end ? clamps->v1 : clamps->v0)[j];
      s.side(row + 1, j) = (is_end ? clamps->a1 : clamps->a0)[j];
    }
  }
  for (std::size_t i = 1; i < m; ++i)
    for (const bool is_fourth : {false, true}) {
      const std::size_t row = 2 * i + (is_fourth ? 1 : 0);
      add(row, i - 1, true, is_fourth, 1);
      add(row, i, false, is_fourth, -1);
    }
  s.solve();
  Spline out{{step.begin(), step.end()}, {}};
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < t.dof; ++j)
      out.pieces.push_back(
          quintic_piece({t.at(i, j), s.side(2 * i, j), s.side(2 * i + 1, j)},
                        {t.at(i + 1, j), s.side(2 * i + 2, j), s.side(2 * i + 3, j)}, step[i]));
  return out;
}

Spline clamped(const Task& t, std::span<const double> step, bool is_quintic, const Clamps* clamps) {
  return is_quintic ? quintic(t, step, clamps) : cubic(t, step, clamps);
}

double derivative_at(const Piece& p, int order, double t) {
  double sum = 0, power = 1;
  for (int k = order; k < static_cast<int>(p.size()); ++k, power *= t) {
    double factor = 1;
    for (int i = 0; i < order; ++i) factor *= k - i;
    sum += factor * p[static_cast<std::size_t>(k)] * power;
  }
  return sum;
}

/// What a spline misses of a rule, in times of about one piece: numbers of each joint.
std::vector<double> misses(const Spline& s, std::size_t dof, bool is_quintic, EndRule rule) {
  const std::size_t n = s.step.size();
  std::vector<double> out;
  const auto jump = [&](std::size_t before, std::size_t after, std::size_t j, int order) {
    return std::pow(s.step[after], order) *
           (derivative_at(s.pieces[before * dof + j], order, s.step[before]) -
            derivative_at(s.pieces[after * dof + j], order, 0));
  };
  for (std::size_t j = 0; j < dof; ++j) {
    if (rule == EndRule::periodic) {
      for (int order = is_quintic ? 3 : 2; order <= (is_quintic ? 4 : 2); ++order)
        out.push_back(jump(n - 1, 0, j, order));
      continue;
    }
    const std::size_t each = is_quintic ? 2 : 1;
    for (std::size_t k = 0; k < each; ++k) {
      out.push_back(jump(k, k + 1, j, is_quintic ? 5 : 3));
      out.push_back(jump(n - 2 - k, n - 1 - k, j, is_quintic ? 5 : 3));
    }
  }
  return out;
}

/// Rates at the ends with which the clamped spline meets another rule. A spline is linear in them,
/// and what one of them adds is the same for every joint.
Clamps clamps_that_meet(const Task& t, std::span<const double> step, bool is_quintic,
                        EndRule rule) {
  const bool is_periodic = rule == EndRule::periodic;
  const std::size_t unknowns = (is_periodic ? 1U : 2U) * (is_quintic ? 2U : 1U);
  // Unknown 0 is a velocity, at the start or at both ends; the others follow.
  const auto set = [&](Clamps& c, std::size_t k, std::size_t joint, double x) {
    const bool is_rate = k % (is_quintic ? 2U : 1U) == 0, is_end = k >= unknowns / 2;
    if (is_periodic) {
      (is_rate ? c.v0 : c.a0)[joint] = (is_rate ? c.v1 : c.a1)[joint] = x;
    } else if (is_rate) {
      (is_end ? c.v1 : c.v0)[joint] = x;
    } else {
      (is_end ? c.a1 : c.a0)[joint] = x;
    }
  };
  const auto rest = [](std::size_t dof) {
    const std::vector<double> zero(dof, 0.0);
    return Clamps{zero, zero, zero, zero};
  };
  Clamps out = rest(t.dof);
  const std::vector<double> at_rest =
      misses(clamped(t, step, is_quintic, &out), t.dof, is_quintic, rule);
  Task still;
  still.dof = 1;
  still.count = t.count;
  still.q.assign(t.count, 0.0);
  BandSystem system(unknowns, unknowns, t.dof);
  for (std::size_t k = 0; k < unknowns; ++k) {
    Clamps one = rest(1);
    set(one, k, 0, 1);
    const std::vector<double> by_one =
        misses(clamped(still, step, is_quintic, &one), 1, is_quintic, rule);
    for (std::size_t row = 0; row < unknowns; ++row) system.at(row, k) = by_one[row];
  }
  for (std::size_t j = 0; j < t.dof; ++j)
    for (std::size_t row = 0; row < unknowns; ++row)
      system.side(row, j) = -at_rest[j * unknowns + row];
  system.solve();
  for (std::size_t j = 0; j < t.dof; ++j)
    for (std::size_t k = 0; k < unknowns; ++k) set(out, k, j, system.side(k, j));
  return out;
}

Piece derivative(const Piece& p) { return {p[1], 2 * p[2], 3 * p[3], 4 * p[4], 5 * p[5], 0}; }
double horner(const Piece& p, double t) {
  return p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * (p[4] + t * p[5]))));
}

/// Where a polynomial changes its sign in 0..h: between the places where its derivatives do.
std::vector<double> sign_changes(const Piece& p, double h) {
  std::vector<Piece> chain{p};
  while (std::any_of(chain.back().begin() + 1, chain.back().end(), [](double c) { return c != 0; }))
    chain.push_back(derivative(chain.back()));
  std::vector<double> roots;
  for (std::size_t k = chain.size(); k-- > 0;) {
    std::vector<double> next, bounds{0};
    bounds.insert(bounds.end(), roots.begin(), roots.end());
    bounds.push_back(h);
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
      double low = bounds[i], high = bounds[i + 1];
      const bool is_rising = horner(chain[k], low) < 0;
      if (is_rising == (horner(chain[k], high) < 0)) continue;
      for (int step = 0; step < 60 && high - low > 1e-15 * h; ++step) {
        const double middle = (low + high) / 2;
        ((horner(chain[k], middle) < 0) == is_rising ? low : high) = middle;
      }
      next.push_back(high);
    }
    roots = std::move(next);
  }
  return roots;
}

}  // namespace

Spline through(const Task& t, std::span<const double> step, bool is_quintic, EndRule rule,
               const Clamps& clamps) {
  if (rule == EndRule::clamped) return clamped(t, step, is_quintic, &clamps);
  if (rule == EndRule::natural) return clamped(t, step, is_quintic, nullptr);
  const Clamps found = clamps_that_meet(t, step, is_quintic, rule);
  return clamped(t, step, is_quintic, &found);
}

Motion1 value(const Piece& p, double t) {
  return {horner(p, t), p[1] + t * (2 * p[2] + t * (3 * p[3] + t * (4 * p[4] + t * 5 * p[5]))),
          2 * p[2] + t * (6 * p[3] + t * (12 * p[4] + t * 20 * p[5])),
          6 * p[3] + t * (24 * p[4] + t * 60 * p[5])};
}

Range range(const Piece& piece, int order, double h) {
  Piece p = piece;
  for (int i = 0; i < order; ++i) p = derivative(p);
  const double a = horner(p, 0), b = horner(p, h);
  Range out{std::min(a, b), std::max(a, b)};
  for (const double t : sign_changes(derivative(p), h)) {
    const double x = horner(p, t);
    out = {std::min(out.least, x), std::max(out.most, x)};
  }
  return out;
}

Result<void> check_range(const Piece& piece, double h, const Task& t, std::size_t joint,
                         std::size_t point) {
  const Range r = range(piece, 0, h);
  const double slack = 1e-9 * (1 + std::fabs(r.least) + std::fabs(r.most));
  const bool is_above = r.most > t.upper[joint] + slack;
  if (!is_above && r.least >= t.lower[joint] - slack) return {};
  return bad("between joint vectors " + std::to_string(point + 1) + " and " +
                 std::to_string(point + 2) + " " + joint_name(joint) + " overshoots to " +
                 print_number(is_above ? r.most : r.least, 6) + ", outside its limits " +
                 print_number(t.lower[joint], 6) + " to " + print_number(t.upper[joint], 6),
             "Add joint vectors there, or give it wider limits, other times or slower ends.");
}

}  // namespace robomosp::joint_motion

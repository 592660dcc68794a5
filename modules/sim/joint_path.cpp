// SPDX-License-Identifier: Apache-2.0
#include "sim/joint_path.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace robomosp::sim {
namespace {

/// Lengths below this share of the whole way are none.
constexpr double kNoLength = 1e-9;
/// Motions between corners that are shorter than this share of the whole way are short.
constexpr double kShortMotion = 0.05;
/// Steps of a rounded corner, and of the whole way at least.
constexpr std::size_t kCornerSteps = 64, kWaySteps = 200;
/// Chords of a rounded corner at most, and what it may turn from one to the next.
constexpr std::size_t kMostCornerSteps = 1024;
constexpr double kCornerTurn = 0.2;
/// How often a corner without room is halved, and one that is rounded with less of it.
constexpr int kHalvings = 6, kReducedHalvings = 14;

/// Points as rows, and what is asked of them.
class Way {
 public:
  Way(const PlanProblem& problem, std::span<const double> points)
      : problem_(problem), points_(points.begin(), points.end()) {}

  [[nodiscard]] std::size_t count() const { return points_.size() / problem_.dof; }
  [[nodiscard]] std::span<const double> at(std::size_t i) const {
    return {points_.data() + i * problem_.dof, problem_.dof};
  }
  [[nodiscard]] double distance(std::span<const double> a, std::span<const double> b) const {
    double sum = 0;
    for (std::size_t j = 0; j < problem_.dof; ++j)
      sum += std::pow(problem_.weight[j] * (b[j] - a[j]), 2);
    return std::sqrt(sum);
  }
  [[nodiscard]] double length() const {
    double sum = 0;
    for (std::size_t i = 1; i < count(); ++i) sum += distance(at(i - 1), at(i));
    return sum;
  }
  [[nodiscard]] std::vector<double> between(std::span<const double> a, std::span<const double> b,
                                            double share) const {
    std::vector<double> out(problem_.dof);
    for (std::size_t j = 0; j < out.size(); ++j) out[j] = a[j] + share * (b[j] - a[j]);
    return out;
  }
  [[nodiscard]] bool is_free(std::span<const double> a, std::span<const double> b) const {
    return problem_.is_free_between(a, b);
  }
  void erase(std::size_t first, std::size_t last) {
    const auto row = [&](std::size_t i) {
      return points_.begin() + static_cast<std::ptrdiff_t>(i * problem_.dof);
    };
    points_.erase(row(first), row(last));
  }
  void insert(std::size_t before, std::span<const double> q) {
    points_.insert(points_.begin() + static_cast<std::ptrdiff_t>(before * problem_.dof), q.begin(),
                   q.end());
  }
  std::vector<double> take() { return std::move(points_); }

  /// Joins each point with one that it reaches straight: the last, else the one halfway to it, and
  /// so on; repeated from the same point as long as that leaves out any.
  void pass_by() {
    for (std::size_t i = 0; i + 2 < count(); ++i) {
      std::size_t most = count() - 1;  // the farthest that may be reached
      while (most > i + 1) {
        std::size_t k = most;
        while (k > i + 1 && !is_free(at(i), at(k))) k = i + (k - i + 1) / 2;
        if (k <= i + 1) break;
        erase(i + 1, k);
        // What is beyond twice as far did not do.
        most = std::min(count() - 1, i + 1 + (k - i));
      }
    }
  }
  /// Makes one point of the two ends of a motion that is short: the corners beside it could be
  /// rounded by no more than it. The way becomes no longer.
  void join_ends_of_short_motions() {
    const double least = kShortMotion * length();
    for (std::size_t i = 1; i + 2 < count(); ++i) {
      if (distance(at(i), at(i + 1)) >= least) continue;
      for (const double share : {0.5, 0.0, 1.0}) {
        const std::vector<double> q = between(at(i), at(i + 1), share);
        if (!is_free(at(i - 1), q) || !is_free(q, at(i + 2))) continue;
        erase(i, i + 2);
        insert(i, q);
        --i;
        break;
      }
    }
  }
  struct Place {
    std::size_t motion = 0;  ///< from point `motion` to the next
    std::vector<double> q;
  };
  [[nodiscard]] Place place(double s) const {
    for (std::size_t i = 0; i + 2 < count(); ++i) {
      const double own = distance(at(i), at(i + 1));
      if (s < own) return {i, between(at(i), at(i + 1), s / own)};
      s -= own;
    }
    const std::size_t i = count() - 2;
    const double own = distance(at(i), at(i + 1));
    return {i, between(at(i), at(i + 1), own > 0 ? std::min(1.0, s / own) : 0)};
  }

 private:
  const PlanProblem& problem_;
  std::vector<double> points_;
};

}  // namespace

double path_length(const PlanProblem& problem, std::span<const double> path) {
  return Way(problem, path).length();
}

Result<std::vector<double>> shorten(const PlanProblem& problem, std::vector<double> points,
                                    std::size_t tries, Progress& progress,
                                    const std::function<bool()>& is_late, std::size_t* tried) {
  Way path(problem, points);
  path.pass_by();
  std::mt19937_64 random(problem.seed);
  const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (std::size_t i = 0; i < tries && path.count() > 2; ++i) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the search for a path was cancelled");
    if (is_late && is_late()) break;
    if (tried) ++*tried;
    progress.report(static_cast<double>(i) / static_cast<double>(tries), "shortening the path");
    const double whole = path.length();
    double s0 = whole * share(), s1 = whole * share();
    if (s0 > s1) std::swap(s0, s1);
    const Way::Place a = path.place(s0), b = path.place(s1);
    if (a.motion == b.motion || path.distance(a.q, b.q) > (1 - kNoLength) * (s1 - s0) ||
        !path.is_free(a.q, b.q))
      continue;
    path.erase(a.motion + 1, b.motion + 1);
    path.insert(a.motion + 1, b.q);
    path.insert(a.motion + 1, a.q);
  }
  if (!is_late || !is_late()) {
    path.pass_by();
    path.join_ends_of_short_motions();
  }
  return path.take();
}

namespace {

/// From a to b about p, in `steps` chords. Control points a, (a + p) / 2, p, p, (p + b) / 2, b:
/// evenly spaced on either side, so that the second derivative is zero at both ends.
std::vector<double> corner_curve(std::span<const double> a, std::span<const double> p,
                                 std::span<const double> b, std::size_t steps) {
  std::vector<double> out;
  out.reserve((steps + 1) * p.size());
  for (std::size_t n = 0; n <= steps; ++n) {
    const double u = static_cast<double>(n) / static_cast<double>(steps), v = 1 - u;
    const double of_a = v * v * v * v * (v + 2.5 * u), of_b = u * u * u * u * (u + 2.5 * v);
    for (std::size_t j = 0; j < p.size(); ++j)
      out.push_back(of_a * a[j] + of_b * b[j] + (1 - of_a - of_b) * p[j]);
  }
  return out;
}

/// The greatest turn from one chord to the next [rad], in the problem's distances and in those of
/// the joints' own changes, by which the way is timed: a wrist weighs little and may turn far.
double greatest_turn(const PlanProblem& problem, std::span<const double> rows) {
  const std::size_t dof = problem.dof;
  double most = 0;
  for (std::size_t i = 1; (i + 2) * dof <= rows.size(); ++i)
    for (const bool is_weighted : {true, false}) {
      double ab = 0, aa = 0, bb = 0;
      for (std::size_t j = 0; j < dof; ++j) {
        const double w = is_weighted ? problem.weight[j] : 1, here = rows[i * dof + j];
        const double x = w * (here - rows[(i - 1) * dof + j]),
                     y = w * (rows[(i + 1) * dof + j] - here);
        ab += x * y, aa += x * x, bb += y * y;
      }
      if (aa > 0 && bb > 0)
        most = std::max(most, std::acos(std::clamp(ab / std::sqrt(aa * bb), -1.0, 1.0)));
    }
  return most;
}

}  // namespace

RoundWay round_corners(const PlanProblem& problem, std::span<const double> points,
                       std::span<const double> shares, const IsFreeAlong& is_free_along) {
  RoundWay out;
  const Way path(problem, points);
  const double whole = path.length();
  const auto add = [&](std::span<const double> q) {
    const std::span<const double> last(out.points.data() + out.points.size() - problem.dof,
                                       problem.dof);
    if (path.distance(last, q) > kNoLength * whole)
      out.points.insert(out.points.end(), q.begin(), q.end());
  };
  const auto add_line = [&](std::span<const double> to) {
    const std::vector<double> from(out.points.end() - static_cast<std::ptrdiff_t>(problem.dof),
                                   out.points.end());
    const auto steps =
        static_cast<std::size_t>(std::ceil(kWaySteps * path.distance(from, to) / whole));
    for (std::size_t k = 1; k < steps; ++k)
      add(path.between(from, to, static_cast<double>(k) / static_cast<double>(steps)));
    add(to);
  };
  /// The curve about a point, over at most `share` of the motions beside it; empty = there is none.
  const auto rounded = [&](std::size_t i, double share) {
    const auto p = path.at(i), from = path.at(i - 1), to = path.at(i + 1);
    const double before = path.distance(p, from), after = path.distance(p, to);
    for (const bool is_reduced : {false, true}) {
      double leg = share * std::min(before, after);
      const int halvings = is_reduced ? kReducedHalvings : kHalvings;
      for (int k = 0; k <= halvings && leg > kNoLength * whole; ++k, leg /= 2) {
        const auto a = path.between(p, from, leg / before), b = path.between(p, to, leg / after);
        std::vector<double> curve = corner_curve(a, p, b, kCornerSteps);
        for (std::size_t steps = 2 * kCornerSteps;
             steps <= kMostCornerSteps && greatest_turn(problem, curve) > kCornerTurn; steps *= 2)
          curve = corner_curve(a, p, b, steps);
        if (is_free_along(curve, is_reduced)) return curve;
      }
    }
    return std::vector<double>{};
  };
  out.points.assign(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(problem.dof));
  if (!(whole > 0)) return out;
  for (std::size_t i = 1; i + 1 < path.count(); ++i) {
    const std::vector<double> corner =
        shares[i - 1] > 0 ? rounded(i, shares[i - 1]) : std::vector<double>{};
    if (corner.empty()) {
      if (shares[i - 1] > 0) ++out.sharp;
      add_line(path.at(i));
      continue;
    }
    add_line(std::span<const double>(corner).first(problem.dof));
    for (std::size_t n = 1; n < corner.size() / problem.dof; ++n)
      add(std::span<const double>(corner).subspan(n * problem.dof, problem.dof));
  }
  add_line(path.at(path.count() - 1));
  return out;
}

}  // namespace robomosp::sim

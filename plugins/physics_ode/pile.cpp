// SPDX-License-Identifier: Apache-2.0
#include "pile.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "spatial/vec.h"

namespace robomosp::physics_ode {
namespace {

constexpr int kFewSteps = 6, kMostSteps = 60;  ///< of Newton's method
constexpr double kRounding = 1e-24;            ///< of the square of velocities, by mass
constexpr int kMostHalvings = 80;              ///< of a line search

/// Orders bodies so that those that touch are near each other (Cuthill and McKee, from an end of
/// the pile): place of each body.
std::vector<std::size_t> order(const std::vector<std::vector<std::size_t>>& touching) {
  const std::size_t n = touching.size();
  std::vector<std::size_t> found, place(n, n);
  std::vector<bool> is_seen(n);
  const auto walk = [&](std::size_t from, std::vector<std::size_t>& out) {
    const std::size_t begin = out.size();
    out.push_back(from);
    is_seen[from] = true;
    for (std::size_t i = begin; i < out.size(); ++i) {
      const std::size_t first = out.size();
      for (const std::size_t other : touching[out[i]])
        if (!is_seen[other]) is_seen[other] = true, out.push_back(other);
      std::stable_sort(
          out.begin() + static_cast<std::ptrdiff_t>(first), out.end(),
          [&](std::size_t x, std::size_t y) { return touching[x].size() < touching[y].size(); });
    }
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (is_seen[i]) continue;
    // Twice to the farthest body.
    std::size_t end = i;
    for (int round = 0; round < 2; ++round) {
      std::vector<std::size_t> all;
      walk(end, all);
      end = all.back();
      for (const std::size_t k : all) is_seen[k] = false;
    }
    walk(end, found);
  }
  for (std::size_t i = 0; i < n; ++i) place[found[i]] = i;
  return place;
}

double dot(const double* a, const double* b, std::size_t n) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    s0 += a[i] * b[i], s1 += a[i + 1] * b[i + 1];
    s2 += a[i + 2] * b[i + 2], s3 += a[i + 3] * b[i + 3];
  }
  for (; i < n; ++i) s0 += a[i] * b[i];
  return (s0 + s1) + (s2 + s3);
}

/// Two numbers at any address of doubles.
using Two [[gnu::vector_size(16), gnu::aligned(8), gnu::may_alias]] = double;

/// Products of six rows with six, of `n` numbers each, an even count: out[6 l + k] = sum of left[k]
/// from `left_at` on times right[l] from `right_at` on. Three rows at a time with three share their
/// loads; the order of the sums is the same on every processor.
void products(const std::array<double*, 6>& left, std::size_t left_at,
              const std::array<const double*, 6>& right, std::size_t right_at, std::size_t n,
              std::array<double, 36>& out) {
  const auto two = [](const double* p) { return *reinterpret_cast<const Two*>(p); };
  for (std::size_t k = 0; k < 6; k += 3)
    for (std::size_t l = 0; l < 6; l += 3) {
      const double *const a0 = left[k] + left_at, *const a1 = left[k + 1] + left_at,
                          *const a2 = left[k + 2] + left_at;
      const double *const b0 = right[l] + right_at, *const b1 = right[l + 1] + right_at,
                          *const b2 = right[l + 2] + right_at;
      Two s00{}, s01{}, s02{}, s10{}, s11{}, s12{}, s20{}, s21{}, s22{};
      for (std::size_t i = 0; i < n; i += 2) {
        const Two y0 = two(b0 + i), y1 = two(b1 + i), y2 = two(b2 + i);
        const Two x0 = two(a0 + i), x1 = two(a1 + i), x2 = two(a2 + i);
        s00 += x0 * y0, s01 += x0 * y1, s02 += x0 * y2;
        s10 += x1 * y0, s11 += x1 * y1, s12 += x1 * y2;
        s20 += x2 * y0, s21 += x2 * y1, s22 += x2 * y2;
      }
      double* const to = &out[6 * l + k];
      to[0] = s00[0] + s00[1], to[6] = s01[0] + s01[1], to[12] = s02[0] + s02[1];
      to[1] = s10[0] + s10[1], to[7] = s11[0] + s11[1], to[13] = s12[0] + s12[1];
      to[2] = s20[0] + s20[1], to[8] = s21[0] + s21[1], to[14] = s22[0] + s22[1];
    }
}

class Pile {
 public:
  Pile(std::vector<PileBody>& bodies, std::vector<PileContact>& contacts)
      : bodies_(bodies), contacts_(contacts), rows_(contacts.size()) {
    prepare_order();
    const std::size_t n = 6 * bodies.size();
    v_.resize(n), free_.resize(n), mass_.resize(36 * bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const PileBody& b = bodies[i];
      const std::size_t at = 6 * place_[i];
      for (std::size_t k = 0; k < 3; ++k) {
        v_[at + k] = b.v[k], v_[at + 3 + k] = b.w[k];
        free_[at + k] = b.v_free[k], free_[at + 3 + k] = b.w_free[k];
        mass_[6 * at + 7 * k] = b.mass;
        for (std::size_t l = 0; l < 3; ++l)
          mass_[6 * at + 6 * (k + 3) + l + 3] = b.inertia[3 * k + l];
      }
    }
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      const PileContact& x = contacts[c];
      for (std::size_t r = 0; r < 3; ++r) {
        Row& row = rows_[c][r];
        const Vec3 turn_a = spatial::cross(x.arm_a, x.axis[r]),
                   turn_b = spatial::cross(x.arm_b, x.axis[r]);
        for (std::size_t k = 0; k < 3; ++k) {
          row.a[k] = x.axis[r][k], row.a[k + 3] = turn_a[k];
          row.b[k] = -x.axis[r][k], row.b[k + 3] = -turn_b[k];
        }
        row.target = x.target[r];
        row.soft = r == 0 ? x.soft : x.soft_across;
        row.low = 0, row.high = r == 0 ? std::numeric_limits<double>::infinity() : 0;
      }
    }
  }

  [[nodiscard]] double cost() const {
    double sum = 0;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const auto width = static_cast<double>(6 * (i - first_[i]) + 3);
      sum += 3 * width * width;
    }
    return sum;
  }

  bool solve() {
    if (!minimise(0)) return false;
    for (std::size_t c = 0; c < rows_.size(); ++c) contacts_[c].place[0] = place_of(rows_[c][0]);
    for (std::size_t c = 0; c < rows_.size(); ++c) {
      const double limit = contacts_[c].limit >= 0 ? contacts_[c].limit
                                                   : contacts_[c].friction * impulse(rows_[c][0]);
      for (std::size_t r = 1; r < 3; ++r) rows_[c][r].low = -limit, rows_[c][r].high = limit;
    }
    if (!minimise(1)) return false;
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (std::size_t r = 0; r < 3; ++r) contacts_[c].place[r + 1] = place_of(rows_[c][r]);
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        bodies_[i].v[k] = v_[6 * place_[i] + k];
        bodies_[i].w[k] = v_[6 * place_[i] + 3 + k];
      }
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (std::size_t r = 0; r < 3; ++r) contacts_[c].impulse[r] = impulse(rows_[c][r]);
    return true;
  }

 private:
  struct Row {
    std::array<double, 6> a, b;
    double target, soft, low, high;
    double gap = 0;   ///< J v - target
    double rate = 0;  ///< of gap along the step
    bool is_active = false;
    // Of the way through the inside:
    double p = 0, above = 0, below = 0;  ///< impulse, multipliers of its limits
    double weight = 0, wanted = 0;
    double p_rate = 0, above_rate = 0, below_rate = 0;
  };

  void prepare_order() {
    std::vector<std::vector<std::size_t>> touching(bodies_.size());
    for (const PileContact& c : contacts_) {
      if (c.a < 0 || c.b < 0) continue;
      const auto a = static_cast<std::size_t>(c.a), b = static_cast<std::size_t>(c.b);
      touching[a].push_back(b), touching[b].push_back(a);
    }
    for (auto& all : touching) {
      std::sort(all.begin(), all.end());
      all.erase(std::unique(all.begin(), all.end()), all.end());
    }
    place_ = order(touching);
    first_.resize(bodies_.size());
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      std::size_t least = place_[i];
      for (const std::size_t other : touching[i]) least = std::min(least, place_[other]);
      first_[place_[i]] = least;
    }
    start_.resize(6 * bodies_.size());
    inverse_.resize(6 * bodies_.size());
    std::size_t used = 0;
    for (std::size_t i = 0; i < first_.size(); ++i)
      for (std::size_t k = 0; k < 6; ++k) {
        start_[6 * i + k] = used;
        used += 6 * (i - first_[i]) + k + 1;
      }
    matrix_size_ = used;
  }
  /// Row i of the lower triangle, by its column 6 first.
  [[nodiscard]] double* row(std::size_t i) { return matrix_.data() + start_[i]; }

  static double impulse(const Row& r) {
    const double p = -r.gap / r.soft;
    return p < r.low ? r.low : p > r.high ? r.high : p;
  }
  static bool gives_way(const Row& r) {
    const double p = -r.gap / r.soft;
    return p > r.low && p < r.high;
  }
  static bool can_push(const Row& r) { return r.high > r.low; }
  [[nodiscard]] double along(const PileContact& c, const Row& r,
                             const std::vector<double>& x) const {
    double sum = 0;
    if (c.a >= 0) {
      const double* at = &x[6 * place_[static_cast<std::size_t>(c.a)]];
      for (std::size_t k = 0; k < 6; ++k) sum += r.a[k] * at[k];
    }
    if (c.b >= 0) {
      const double* at = &x[6 * place_[static_cast<std::size_t>(c.b)]];
      for (std::size_t k = 0; k < 6; ++k) sum += r.b[k] * at[k];
    }
    return sum;
  }
  void set_gaps() {
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (Row& r : rows_[c]) r.gap = along(contacts_[c], r, v_) - r.target;
  }
  /// M (v - v_free) - J^T p.
  void set_gradient() {
    const std::size_t n = v_.size();
    gradient_.assign(n, 0.0);
    for (std::size_t i = 0; i < n; i += 6)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l < 6; ++l)
          gradient_[i + k] += mass_[6 * i + 6 * k + l] * (v_[i + l] - free_[i + l]);
    add_rows(gradient_, [](const Row& r) { return -impulse(r); });
  }
  /// The function that is least at the solution.
  [[nodiscard]] double value() const {
    double sum = 0;
    for (std::size_t i = 0; i < v_.size(); i += 6)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l < 6; ++l)
          sum += 0.5 * (v_[i + k] - free_[i + k]) * mass_[6 * i + 6 * k + l] *
                 (v_[i + l] - free_[i + l]);
    for (const auto& contact : rows_)
      for (const Row& r : contact) {
        // The integral of -p over the gap.
        const double p = impulse(r);
        sum -= p * (r.gap + 0.5 * r.soft * p);
      }
    return sum;
  }
  /// Goes to where all rows that may push at all do so without limits, if the function is less
  /// there: what rests is mostly there. The factored matrix is then that of the solution.
  bool try_all(bool& is_solution) {
    const double before = value();
    const std::vector<double> kept = v_;
    step_.assign(v_.size(), 0.0);
    for (std::size_t i = 0; i < v_.size(); i += 6)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l < 6; ++l) step_[i + k] += mass_[6 * i + 6 * k + l] * free_[i + l];
    add_rows(step_, [](const Row& r) { return r.target / r.soft; });
    if (!factor([](const Row& r) { return can_push(r) ? 1 / r.soft : 0; })) return false;
    back_substitute(step_);
    v_ = step_;
    set_gaps();
    if (value() < before) {
      is_solution = true;
      for (const auto& contact : rows_)
        for (const Row& r : contact) is_solution = is_solution && (!can_push(r) || gives_way(r));
      return true;
    }
    v_ = kept;
    set_gaps();
    return true;
  }
  /// M + sum of weight J^T J, factored; weight 0 = not this row.
  template <class Weight>
  bool factor(Weight&& weight) {
    using Block = std::array<double, 36>;  // rows, columns
    matrix_.assign(matrix_size_, 0.0);
    for (std::size_t i = 0; i < v_.size(); i += 6)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l <= k; ++l)
          row(i + k)[i - 6 * first_[i / 6] + l] = mass_[6 * i + 6 * k + l];
    const auto add = [&](std::size_t x, std::size_t y, const Block& block) {
      for (std::size_t k = 0; k < 6; ++k) {
        double* to = row(6 * x + k) + 6 * (y - first_[x]);
        const std::size_t end = x == y ? k + 1 : 6;
        for (std::size_t l = 0; l < end; ++l) to[l] += block[6 * k + l];
      }
    };
    const auto gather = [](Block& to, const std::array<double, 6>& left,
                           const std::array<double, 6>& right, double by) {
      for (std::size_t k = 0; k < 6; ++k) {
        const double f = by * left[k];
        for (std::size_t l = 0; l < 6; ++l) to[6 * k + l] += f * right[l];
      }
    };
    // Contacts of two bodies follow each other: their blocks are added once.
    for (std::size_t c = 0, end = 0; c < rows_.size(); c = end) {
      const std::int32_t of_a = contacts_[c].a, of_b = contacts_[c].b;
      const bool has_a = of_a >= 0, has_b = of_b >= 0;
      const std::size_t a = has_a ? place_[static_cast<std::size_t>(of_a)] : 0;
      const std::size_t b = has_b ? place_[static_cast<std::size_t>(of_b)] : 0;
      Block aa{}, bb{}, between{};
      for (end = c; end < rows_.size() && contacts_[end].a == of_a && contacts_[end].b == of_b;
           ++end)
        for (const Row& r : rows_[end]) {
          const double by = weight(r);
          if (by == 0) continue;
          if (has_a) gather(aa, r.a, r.a, by);
          if (has_b) gather(bb, r.b, r.b, by);
          if (!has_a || !has_b) continue;
          if (a > b) gather(between, r.a, r.b, by);
          else gather(between, r.b, r.a, by);
        }
      if (has_a) add(a, a, aa);
      if (has_b) add(b, b, bb);
      if (has_a && has_b) add(std::max(a, b), std::min(a, b), between);
    }
    for (std::size_t i = 0; i < first_.size(); ++i)
      if (!factor_block_row(i)) return false;
    return true;
  }
  /// Rows 6 i to 6 i + 5 of the factor, from the rows before.
  bool factor_block_row(std::size_t i) {
    const std::size_t own = 6 * first_[i];
    std::array<double*, 6> to;
    for (std::size_t k = 0; k < 6; ++k) to[k] = row(6 * i + k);
    std::array<double, 36> s;
    for (std::size_t j = first_[i]; j < i; ++j) {
      const std::size_t other = 6 * first_[j], from = std::max(own, other), at = 6 * j - own;
      std::array<const double*, 6> right;
      for (std::size_t l = 0; l < 6; ++l) right[l] = row(6 * j + l);
      products(to, from - own, right, from - other, 6 * j - from, s);
      // The six rows at once: s holds them as columns.
      for (std::size_t l = 0; l < 6; ++l) {
        double* const x = &s[6 * l];
        for (std::size_t k = 0; k < 6; ++k) x[k] = to[k][at + l] - x[k];
        const double* const diagonal = right[l] + (6 * j - other);
        for (std::size_t m = 0; m < l; ++m)
          for (std::size_t k = 0; k < 6; ++k) x[k] -= s[6 * m + k] * diagonal[m];
        for (std::size_t k = 0; k < 6; ++k) x[k] *= inverse_[6 * j + l];
        for (std::size_t k = 0; k < 6; ++k) to[k][at + l] = x[k];
      }
    }
    const std::size_t at = 6 * i - own;
    std::array<const double*, 6> right;
    std::copy(to.begin(), to.end(), right.begin());
    products(to, 0, right, 0, at, s);
    for (std::size_t k = 0; k < 6; ++k)
      for (std::size_t l = 0; l <= k; ++l) {
        double x = to[k][at + l] - s[6 * l + k];
        for (std::size_t m = 0; m < l; ++m) x -= to[k][at + m] * to[l][at + m];
        if (l < k) {
          to[k][at + l] = x * inverse_[6 * i + l];
          continue;
        }
        if (!(x > 0) || !std::isfinite(x)) return false;
        to[k][at + k] = std::sqrt(x);
        inverse_[6 * i + k] = 1 / to[k][at + k];
      }
    return true;
  }
  void back_substitute(std::vector<double>& x) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t own = 6 * first_[i / 6];
      x[i] = (x[i] - dot(row(i), x.data() + own, i - own)) / row(i)[i - own];
    }
    for (std::size_t i = x.size(); i-- > 0;) {
      const std::size_t own = 6 * first_[i / 6];
      const double* const from = row(i);
      x[i] /= from[i - own];
      for (std::size_t j = own; j < i; ++j) x[j] -= from[j - own] * x[i];
    }
  }
  /// Slope of the function along the step after a share of it.
  [[nodiscard]] double slope(double share, double still, double by_share) const {
    double sum = still + share * by_share;
    for (const auto& contact : rows_)
      for (const Row& r : contact) {
        const double p = -(r.gap + share * r.rate) / r.soft;
        sum -= (p < r.low ? r.low : p > r.high ? r.high : p) * r.rate;
      }
    return sum;
  }
  /// Where each row is: -1 and 1 at its limits, 0 between them.
  [[nodiscard]] std::vector<signed char> pattern() const {
    std::vector<signed char> all;
    all.reserve(3 * rows_.size());
    for (const auto& contact : rows_)
      for (const Row& r : contact) all.push_back(place_of(r));
    return all;
  }
  static signed char place_of(const Row& r) {
    const double p = -r.gap / r.soft;
    return static_cast<signed char>(p <= r.low ? -1 : p >= r.high ? 1 : 0);
  }

  /// Goes to where all rows are in their expected places, if the function is less there, or if they
  /// are there indeed: then it is the solution, of which the factored matrix is. False where
  /// nothing is expected or nothing is gained.
  bool try_expected(std::size_t stage, bool& is_solution) {
    std::vector<signed char> expected;
    expected.reserve(3 * rows_.size());
    std::size_t known = 0;
    for (const PileContact& c : contacts_)
      for (std::size_t r = 0; r < 3; ++r) {
        const signed char place = stage > 0 ? c.place[r + 1] : r == 0 ? c.place[0] : -1;
        known += place == 2 ? 0 : 1;
        expected.push_back(place == 2 ? 0 : place);
      }
    if (2 * known < expected.size()) return false;
    const double before = value();
    const std::vector<double> kept = v_;
    step_.assign(v_.size(), 0.0);
    for (std::size_t i = 0; i < v_.size(); i += 6)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l < 6; ++l) step_[i + k] += mass_[6 * i + 6 * k + l] * free_[i + l];
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (std::size_t r = 0; r < 3; ++r) {
        Row& row = rows_[c][r];
        row.is_active = can_push(row) && expected[3 * c + r] == 0;
        row.p = row.is_active             ? row.target / row.soft
                : expected[3 * c + r] < 0 ? row.low
                                          : row.high;
      }
    add_rows(step_, [](const Row& r) { return r.p; });
    if (!factor([](const Row& r) { return r.is_active ? 1 / r.soft : 0; })) return false;
    back_substitute(step_);
    v_ = step_;
    set_gaps();
    is_solution = true;
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (std::size_t r = 0; r < 3; ++r)
        is_solution =
            is_solution && (!can_push(rows_[c][r]) || place_of(rows_[c][r]) == expected[3 * c + r]);
    if (is_solution || value() < before) return true;
    v_ = kept;
    set_gaps();
    return false;
  }

  bool minimise(std::size_t stage) {
    set_gaps();
    bool is_solution = false;
    if (try_expected(stage, is_solution) && descend(is_solution, kFewSteps)) return true;
    bool is_factored = false;
    if (!try_all(is_factored)) return false;
    if (descend(is_factored, kFewSteps)) return true;
    through_the_inside();
    return descend(false, kMostSteps);
  }

  /// Adds J^T times a number of each row that may push.
  template <class Number>
  void add_rows(std::vector<double>& to, Number&& number) const {
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (const Row& r : rows_[c]) {
        if (!can_push(r)) continue;
        const double p = number(r);
        if (contacts_[c].a >= 0) {
          double* at = &to[6 * place_[static_cast<std::size_t>(contacts_[c].a)]];
          for (std::size_t k = 0; k < 6; ++k) at[k] += r.a[k] * p;
        }
        if (contacts_[c].b >= 0) {
          double* at = &to[6 * place_[static_cast<std::size_t>(contacts_[c].b)]];
          for (std::size_t k = 0; k < 6; ++k) at[k] += r.b[k] * p;
        }
      }
  }

  /// Goes near to the solution by the interior point method: some twenty factorizations however the
  /// rows change their places. Leaves v_ and the gaps there.
  void through_the_inside() {
    double speed = 1e-3, mass = 0, count = 0;
    for (const PileBody& b : bodies_) mass += b.mass / static_cast<double>(bodies_.size());
    for (std::size_t c = 0; c < rows_.size(); ++c)
      for (const Row& r : rows_[c])
        speed = std::max(speed, std::fabs(along(contacts_[c], r, free_) - r.target));
    v_ = free_;
    set_gaps();
    for (auto& contact : rows_)
      for (Row& r : contact) {
        if (!can_push(r)) continue;
        const bool has_top = std::isfinite(r.high);
        r.p = has_top ? 0.5 * (r.low + r.high) : r.low + mass * speed;
        r.above = speed, r.below = has_top ? speed : 0;
        count += has_top ? 2 : 1;
      }
    const double small = 1e-13 * mass * speed * speed;
    double share = 0;
    for (int step = 0; step < kMostSteps; ++step) {
      double gathered = 0;
      for (const auto& contact : rows_)
        for (const Row& r : contact) {
          if (!can_push(r)) continue;
          gathered += r.above * (r.p - r.low);
          if (r.below > 0) gathered += r.below * (r.high - r.p);
        }
      if (!(gathered / count > small)) break;
      const double center = (share > 0.9 ? 0.05 : share > 0.5 ? 0.2 : 0.5) * gathered / count;
      for (auto& contact : rows_)
        for (Row& r : contact) {
          if (!can_push(r)) continue;
          const double low = r.p - r.low, high = r.high - r.p;
          double stiff = r.soft + r.above / low;
          double wanted = -(r.gap + r.soft * r.p - r.above + r.below) + center / low - r.above;
          if (r.below > 0) stiff += r.below / high, wanted -= center / high - r.below;
          r.weight = 1 / stiff, r.wanted = wanted;
        }
      if (!factor([](const Row& r) { return can_push(r) ? r.weight : 0; })) break;
      // -(M (v - v_free) - J^T p) + J^T weight wanted
      step_.assign(v_.size(), 0.0);
      for (std::size_t i = 0; i < v_.size(); i += 6)
        for (std::size_t k = 0; k < 6; ++k)
          for (std::size_t l = 0; l < 6; ++l)
            step_[i + k] -= mass_[6 * i + 6 * k + l] * (v_[i + l] - free_[i + l]);
      add_rows(step_, [](const Row& r) { return r.p + r.weight * r.wanted; });
      back_substitute(step_);
      share = 1;
      for (std::size_t c = 0; c < rows_.size(); ++c)
        for (Row& r : rows_[c]) {
          if (!can_push(r)) continue;
          const double low = r.p - r.low, high = r.high - r.p;
          r.p_rate = r.weight * (r.wanted - along(contacts_[c], r, step_));
          r.above_rate = center / low - r.above - r.above / low * r.p_rate;
          const auto keep = [&](double x, double rate) {
            if (rate < 0) share = std::min(share, -0.995 * x / rate);
          };
          keep(low, r.p_rate), keep(r.above, r.above_rate);
          if (!(r.below > 0)) continue;
          r.below_rate = center / high - r.below + r.below / high * r.p_rate;
          keep(high, -r.p_rate), keep(r.below, r.below_rate);
        }
      if (!std::isfinite(share)) break;
      for (std::size_t i = 0; i < v_.size(); ++i) v_[i] += share * step_[i];
      for (auto& contact : rows_)
        for (Row& r : contact) {
          if (!can_push(r)) continue;
          r.p += share * r.p_rate, r.above += share * r.above_rate;
          if (r.below > 0) r.below += share * r.below_rate;
        }
      set_gaps();
    }
  }

  /// Newton's method from where v_ and the gaps are; true at the solution.
  bool descend(bool is_factored, int most) {
    std::vector<signed char> active = pattern();
    for (int step = 0; step < most; ++step) {
      if (!is_factored && !factor([](const Row& r) { return gives_way(r) ? 1 / r.soft : 0; }))
        return false;
      set_gradient();
      step_ = gradient_;
      for (double& x : step_) x = -x;
      back_substitute(step_);
      // Its slope along the step, without contacts.
      double still = 0, by_share = 0;
      for (std::size_t i = 0; i < v_.size(); i += 6)
        for (std::size_t k = 0; k < 6; ++k)
          for (std::size_t l = 0; l < 6; ++l) {
            const double m = mass_[6 * i + 6 * k + l] * step_[i + k];
            still += m * (v_[i + l] - free_[i + l]), by_share += m * step_[i + l];
          }
      for (std::size_t c = 0; c < rows_.size(); ++c)
        for (Row& r : rows_[c]) r.rate = along(contacts_[c], r, step_);
      if (!std::isfinite(still) || !std::isfinite(by_share)) return false;
      double share = 1;
      const double at_start = slope(0, still, by_share);
      if (!is_factored && slope(1, still, by_share) > 1e-9 * std::fabs(at_start)) {
        double low = 0, high = 1;
        for (int i = 0; i < kMostHalvings && high - low > 1e-14; ++i) {
          const double middle = 0.5 * (low + high);
          (slope(middle, still, by_share) > 0 ? high : low) = middle;
        }
        share = 0.5 * (low + high);
      }
      for (std::size_t i = 0; i < v_.size(); ++i) v_[i] += share * step_[i];
      set_gaps();
      // That took the rounding off a solution; or what is left is rounding, by which rows that are
      // at a limit without pressing on it change their places.
      double size = 0;
      for (std::size_t i = 0; i < v_.size(); ++i)
        size += mass_[36 * (i / 6) + 7 * (i % 6)] * (v_[i] * v_[i] + free_[i] * free_[i]);
      if (is_factored || std::fabs(at_start) <= kRounding * size) return true;
      if (at_start > 0) return false;  // too badly conditioned
      std::vector<signed char> now = pattern();
      const bool is_same = now == active;
      active = std::move(now);
      is_factored = is_same;
    }
    return false;
  }

  std::vector<PileBody>& bodies_;
  std::vector<PileContact>& contacts_;
  std::vector<std::array<Row, 3>> rows_;
  std::vector<std::size_t> place_, first_, start_;  ///< first_ of places, start_ of rows
  std::size_t matrix_size_ = 0;
  std::vector<double> v_, free_, mass_, matrix_, gradient_, step_;
  std::vector<double> inverse_;  ///< of the factor's diagonal
};

}  // namespace

bool solve_pile(std::vector<PileBody>& bodies, std::vector<PileContact>& contacts, double most) {
  Pile pile(bodies, contacts);
  return pile.cost() <= most && pile.solve();
}

}  // namespace robomosp::physics_ode

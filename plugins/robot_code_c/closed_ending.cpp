// SPDX-License-Identifier: Apache-2.0
#include "closed_ending.h"

#include <algorithm>
#include <utility>

#include "c_text.h"

namespace robomosp::robot_code {
namespace {

// Directions of loops and motors below 1e-9 of the greatest are lost; of loops that are open by g,
// below 1000 g (robotics/loop_motion.cpp).
constexpr const char* kShared = R"(
/* Closed loops: HELD directions are held, of ROWS velocities. */
enum { NAME_most = MOST };

/* a (rows x cols) = q r with its columns in this order, r in place of a, by Householder's
 * reflections. Returns the rank: pivots above `least` of the first one. */
static size_t NAME_factor(double *a, size_t rows, size_t cols, double least, double *q,
                          size_t *order) {
  double v[NAME_most], greatest = 0.0;
  size_t rank = 0;
  for (size_t i = 0; i < rows * rows; ++i) q[i] = 0.0;
  for (size_t i = 0; i < rows; ++i) q[i * rows + i] = 1.0;
  for (size_t k = 0; k < cols; ++k) order[k] = k;
  for (; rank < rows && rank < cols; ++rank) {
    size_t best = rank;
    double most = -1.0;
    for (size_t k = rank; k < cols; ++k) {
      double sum = 0.0;
      for (size_t i = rank; i < rows; ++i) sum += a[i * cols + k] * a[i * cols + k];
      if (sum > most) most = sum, best = k;
    }
    const double length = sqrt(most);
    if (rank == 0) greatest = length;
    if (!(length > least * greatest)) break;
    for (size_t i = 0; i < rows; ++i) {
      const double x = a[i * cols + rank];
      a[i * cols + rank] = a[i * cols + best];
      a[i * cols + best] = x;
    }
    const size_t place = order[rank];
    order[rank] = order[best];
    order[best] = place;
    const double pivot = a[rank * cols + rank] > 0.0 ? -length : length;
    double square = 0.0;
    for (size_t i = rank; i < rows; ++i) {
      v[i] = a[i * cols + rank] - (i == rank ? pivot : 0.0);
      square += v[i] * v[i];
    }
    for (size_t k = rank + 1; k < cols; ++k) {
      double sum = 0.0;
      for (size_t i = rank; i < rows; ++i) sum += v[i] * a[i * cols + k];
      for (size_t i = rank; i < rows; ++i) a[i * cols + k] -= 2.0 * sum / square * v[i];
    }
    for (size_t i = 0; i < rows; ++i) {
      double sum = 0.0;
      for (size_t k = rank; k < rows; ++k) sum += q[i * rows + k] * v[k];
      for (size_t k = rank; k < rows; ++k) q[i * rows + k] -= 2.0 * sum / square * v[k];
    }
    for (size_t i = rank; i < rows; ++i) a[i * cols + rank] = i == rank ? pivot : 0.0;
  }
  return rank;
}

/* Of the x (cols x sides) that come nearest to a x = b (rows x sides), those of the least squares.
 * Directions below `least` of the greatest are left out. */
static void NAME_nearest(const double *a, size_t rows, size_t cols, double least, const double *b,
                         size_t sides, double *x) {
  double r[NAME_most * NAME_most], q[NAME_most * NAME_most];
  double turned[NAME_most * NAME_most], p[NAME_most * NAME_most], y[NAME_most];
  size_t order[NAME_most], back[NAME_most];
  for (size_t i = 0; i < rows * cols; ++i) r[i] = a[i];
  const size_t rank = NAME_factor(r, rows, cols, least, q, order);
  for (size_t i = 0; i < rank; ++i)
    for (size_t k = 0; k < cols; ++k) turned[k * rank + i] = r[i * cols + k];
  NAME_factor(turned, cols, rank, 0.0, p, back);
  for (size_t side = 0; side < sides; ++side) {
    for (size_t i = 0; i < rank; ++i) {
      y[i] = 0.0;
      for (size_t k = 0; k < rows; ++k) y[i] += q[k * rows + back[i]] * b[k * sides + side];
      for (size_t k = 0; k < i; ++k) y[i] -= turned[k * rank + i] * y[k];
      y[i] /= turned[i * rank + i];
    }
    for (size_t k = 0; k < cols; ++k) {
      double sum = 0.0;
      for (size_t i = 0; i < rank; ++i) sum += p[k * cols + i] * y[i];
      x[order[k] * sides + side] = sum;
    }
  }
}

/* The motions that the loops allow: the columns of q from the returned one on. `loop`: the rows of
 * the loops, then how far they are open. */
static size_t NAME_held(const double *loop, double *q) {
  double a[ROWS * HELD], least = 1e-9;
  size_t order[NAME_most];
  for (size_t i = 0; i < HELD; ++i) {
    for (size_t k = 0; k < ROWS; ++k) a[k * HELD + i] = loop[i * ROWS + k];
    const double open = 1e3 * fabs(loop[HELD * ROWS + i]);
    if (open > least) least = open < 1e-3 ? open : 1e-3;
  }
  return NAME_factor(a, ROWS, HELD, least, q, order);
}
)";

constexpr const char* kToMotors = R"(
/* Forces at all joints of the tree (ROWS x sides) become forces of the motors that do the same
 * work on every motion that the loops allow, those of the least squares where there are more
 * motors than motions. What no motor can do stays at joints without motors. */
static void NAME_to_motors(const double *loop, double *tau, size_t sides) {
  double q[ROWS * ROWS], work[ROWS * ROWS], f[ROWS * ROWS];
  double drive[ROWS * ROWS], r[ROWS * ROWS], n[ROWS * ROWS], idle[ROWS * ROWS];
  size_t order[NAME_most], driven = 0;
  const size_t held = NAME_held(loop, q), motions = ROWS - held;
  double greatest = 0.0;
  for (size_t z = 0; z < motions; ++z) {
    for (size_t s = 0; s < sides; ++s) {
      work[z * sides + s] = 0.0;
      for (size_t k = 0; k < ROWS; ++k)
        work[z * sides + s] += q[k * ROWS + held + z] * tau[k * sides + s];
    }
    for (size_t m = 0; m < NAME_motor_count; ++m) {
      drive[z * NAME_motor_count + m] = q[NAME_motors[m] * ROWS + held + z];
      if (fabs(drive[z * NAME_motor_count + m]) > greatest) greatest = fabs(drive[z * NAME_motor_count + m]);
    }
  }
  for (size_t k = 0; k < ROWS * sides; ++k) tau[k] = 0.0;
  if (motions == 0) return;
  for (size_t k = 0; k < motions * motions; ++k) n[k] = k % (motions + 1) == 0 ? 1.0 : 0.0;
  if (greatest > 1e-9) {
    for (size_t k = 0; k < motions * NAME_motor_count; ++k) r[k] = drive[k];
    driven = NAME_factor(r, motions, NAME_motor_count, 1e-9, n, order);
  }
  const size_t left = motions - driven;
  if (left > 0 && NAME_passive_count > 0) {
    for (size_t i = 0; i < left; ++i) {
      for (size_t p = 0; p < NAME_passive_count; ++p) {
        idle[i * NAME_passive_count + p] = 0.0;
        for (size_t z = 0; z < motions; ++z)
          idle[i * NAME_passive_count + p] +=
              n[z * motions + driven + i] * q[NAME_passive[p] * ROWS + held + z];
      }
      for (size_t s = 0; s < sides; ++s) {
        r[i * sides + s] = 0.0;
        for (size_t z = 0; z < motions; ++z)
          r[i * sides + s] += n[z * motions + driven + i] * work[z * sides + s];
      }
    }
    NAME_nearest(idle, left, NAME_passive_count, 1e-9, r, sides, f);
    for (size_t p = 0; p < NAME_passive_count; ++p)
      for (size_t s = 0; s < sides; ++s) {
        tau[NAME_passive[p] * sides + s] = f[p * sides + s];
        for (size_t z = 0; z < motions; ++z)
          work[z * sides + s] -= q[NAME_passive[p] * ROWS + held + z] * f[p * sides + s];
      }
  }
  if (driven == 0) return;
  NAME_nearest(drive, motions, NAME_motor_count, 1e-9, work, sides, f);
  for (size_t m = 0; m < NAME_motor_count; ++m)
    for (size_t s = 0; s < sides; ++s) tau[NAME_motors[m] * sides + s] = f[m * sides + s];
}
)";

constexpr const char* kInertia = R"(
/* The tree's inertia becomes the one that the motors feel. */
static void NAME_inertia_to_motors(const double *loop, double *m) {
  double whole[ROWS * ROWS];
  NAME_to_motors(loop, m, ROWS);
  for (size_t i = 0; i < ROWS; ++i)
    for (size_t k = 0; k < ROWS; ++k) whole[i * ROWS + k] = m[k * ROWS + i];
  NAME_to_motors(loop, whole, ROWS);
  for (size_t i = 0; i < ROWS; ++i)
    for (size_t k = 0; k < ROWS; ++k)
      m[i * ROWS + k] = 0.5 * (whole[i * ROWS + k] + whole[k * ROWS + i]);
}
)";

constexpr const char* kAccelerations = R"(
/* Accelerations under forces that accelerate the tree (in qdd), with the tree's inertia m and the
 * loops' rows, gaps, drift and rates: those that close the loops, and the motions that they allow.
 * Gaps are closed with STABILIZATION 1/s, critically damped. */
static void NAME_closed_accelerations(const double *loop, const double *m, double *qdd) {
  double q[ROWS * ROWS], pull[HELD], own[ROWS], least = 1e-9;
  double inertia[ROWS * ROWS], x[ROWS];
  const double *gap = loop + HELD * ROWS, *drift = gap + HELD, *rate = drift + HELD;
  const size_t held = NAME_held(loop, q), motions = ROWS - held;
  for (size_t i = 0; i < HELD; ++i) {
    pull[i] = -(drift[i] + 2.0 * STABILIZATION * rate[i] +
                STABILIZATION * STABILIZATION * gap[i]);
    const double open = 1e3 * fabs(gap[i]);
    if (open > least) least = open < 1e-3 ? open : 1e-3;
  }
  NAME_nearest(loop, HELD, ROWS, least, pull, 1, own);
  for (size_t i = 0; i < ROWS; ++i)
    for (size_t k = 0; k < ROWS; ++k) qdd[i] -= m[i * ROWS + k] * own[k];
  for (size_t z = 0; z < motions; ++z) {
    x[z] = 0.0;
    for (size_t k = 0; k < ROWS; ++k) x[z] += q[k * ROWS + held + z] * qdd[k];
    for (size_t y = 0; y <= z; ++y) {
      inertia[z * motions + y] = 0.0;
      for (size_t i = 0; i < ROWS; ++i)
        for (size_t k = 0; k < ROWS; ++k)
          inertia[z * motions + y] +=
              q[i * ROWS + held + z] * m[i * ROWS + k] * q[k * ROWS + held + y];
    }
  }
  /* Cholesky */
  for (size_t k = 0; k < motions; ++k) {
    for (size_t j = 0; j < k; ++j)
      for (size_t i = k; i < motions; ++i)
        inertia[i * motions + k] -= inertia[i * motions + j] * inertia[k * motions + j];
    const double root = sqrt(inertia[k * motions + k]);
    for (size_t i = k; i < motions; ++i) inertia[i * motions + k] /= root;
    for (size_t j = 0; j < k; ++j) x[k] -= inertia[k * motions + j] * x[j];
    x[k] /= root;
  }
  for (size_t k = motions; k-- > 0;) {
    for (size_t i = k + 1; i < motions; ++i) x[k] -= inertia[i * motions + k] * x[i];
    x[k] /= inertia[k * motions + k];
  }
  for (size_t k = 0; k < ROWS; ++k) {
    qdd[k] = own[k];
    for (size_t z = 0; z < motions; ++z) qdd[k] += q[k * ROWS + held + z] * x[z];
  }
}
)";

}  // namespace

std::size_t closed_numbers(const ClosedLoops& loops, std::size_t velocities, bool accelerations) {
  return loops.rows * (velocities + (accelerations ? 3 : 1));
}

std::string closed_text(const std::string& name, const ClosedLoops& loops, std::size_t velocities,
                        const ClosedUses& uses, double stabilization) {
  const auto or_one = [](const std::vector<std::size_t>& v) {  // C has no empty arrays
    return v.empty() ? std::vector<std::size_t>{0} : v;
  };
  const auto count = [](const std::vector<std::size_t>& v) { return std::to_string(v.size()); };
  std::string s = kShared;
  if (uses.forces) {
    s += "\n/* Velocities with motors, and without. */\n"
         "static const size_t NAME_motor_count = " +
         count(loops.motors) + ", NAME_passive_count = " + count(loops.passive) + ";\n" +
         c_table("size_t", "NAME_motors", or_one(loops.motors)) +
         c_table("size_t", "NAME_passive", or_one(loops.passive)) + kToMotors;
    if (uses.inertia) s += kInertia;
  }
  if (uses.accelerations) s += kAccelerations;
  const std::pair<const char*, std::string> words[] = {
      {"MOST", std::to_string(std::max(velocities, loops.rows))},
      {"ROWS", std::to_string(velocities)},
      {"HELD", std::to_string(loops.rows)},
      {"STABILIZATION", c_literal(stabilization)},
      {"NAME", name}};  // last: it may have any of these words within
  for (const auto& [key, by] : words) s = replaced(std::move(s), key, by);
  return s;
}

}  // namespace robomosp::robot_code

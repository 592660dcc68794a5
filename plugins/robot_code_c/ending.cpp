// SPDX-License-Identifier: Apache-2.0
#include "ending.h"

#include <array>

#include "c_text.h"

namespace robomosp::robot_code {
namespace {

void fill_inertia(const Columns& c, std::span<const double> parts, std::vector<double>& m) {
  const std::size_t n = c.rows();
  m.assign(n * n, 0.0);
  for (std::size_t k = 0; k < n; ++k) m[k * n + k] = c.motor[k];
  const std::span<const double> wrenches = parts.subspan(kPlacementNumbers * c.joints());
  for (std::size_t joint = 0; joint < c.joints(); ++joint)
    for (std::size_t column = c.first[joint]; column < c.first[joint + 1]; ++column) {
      std::array<double, kWrenchNumbers> x{};
      for (std::size_t k = 0; k < x.size(); ++k) x[k] = wrenches[kWrenchNumbers * column + k];
      const std::size_t row = c.velocity[column];
      const auto add = [&](std::size_t other) {
        const double v = c.ratio[column] * c.ratio[other] * x[c.component[other]];
        m[row * n + c.velocity[other]] += v;
        if (other != column) m[c.velocity[other] * n + row] += v;
      };
      for (std::size_t other = c.first[joint]; other <= column; ++other) add(other);
      std::size_t at = joint;
      while (c.parent[at] >= 0) {
        const double* t = parts.data() + kPlacementNumbers * at;
        const double f[] = {t[0] * x[0] + t[1] * x[1] + t[2] * x[2],
                            t[3] * x[0] + t[4] * x[1] + t[5] * x[2],
                            t[6] * x[0] + t[7] * x[1] + t[8] * x[2]};
        const double u[] = {t[0] * x[3] + t[1] * x[4] + t[2] * x[5],
                            t[3] * x[3] + t[4] * x[4] + t[5] * x[5],
                            t[6] * x[3] + t[7] * x[4] + t[8] * x[5]};
        x = {f[0],
             f[1],
             f[2],
             u[0] + t[10] * f[2] - t[11] * f[1],
             u[1] + t[11] * f[0] - t[9] * f[2],
             u[2] + t[9] * f[1] - t[10] * f[0]};
        at = static_cast<std::size_t>(c.parent[at]);
        for (std::size_t other = c.first[at]; other < c.first[at + 1]; ++other) add(other);
      }
    }
}

void solve_in_place(std::vector<double>& m, std::vector<double>& x) {
  const std::size_t n = x.size();
  for (std::size_t k = n; k-- > 0;)
    for (std::size_t i = k; i-- > 0;) {
      const double factor = m[k * n + i] / m[k * n + k];
      if (factor != 0)
        for (std::size_t j = 0; j <= i; ++j) m[i * n + j] -= factor * m[k * n + j];
      m[k * n + i] = factor;
      x[i] -= factor * x[k];
    }
  for (std::size_t k = 0; k < n; ++k) {
    x[k] /= m[k * n + k];
    for (std::size_t i = 0; i < k; ++i) x[k] -= m[k * n + i] * x[i];
  }
}

constexpr const char* kFill = R"(
/* The inertia matrix from placements of the joints in their parents and from the force and moment
 * that a unit acceleration of each column takes: these are carried towards the base. */
static void NAME_fill_inertia(const double *part, double *m) {
  for (size_t k = 0; k < ROWS * ROWS; ++k) m[k] = 0.0;
  for (size_t k = 0; k < ROWS; ++k) m[k * ROWS + k] = NAME_motor[k];
  for (size_t joint = 0; joint < JOINTS; ++joint)
    for (size_t column = NAME_first[joint]; column < NAME_first[joint + 1]; ++column) {
      const double *start = part + 12 * JOINTS + 6 * column;
      double x[6] = {start[0], start[1], start[2], start[3], start[4], start[5]};
      const size_t row = NAME_velocity[column];
      size_t at = joint, end = column + 1;
      for (;;) {
        for (size_t other = NAME_first[at]; other < end; ++other) {
          const double v = NAME_ratio[column] * NAME_ratio[other] * x[NAME_component[other]];
          m[row * ROWS + NAME_velocity[other]] += v;
          if (other != column) m[NAME_velocity[other] * ROWS + row] += v;
        }
        if (NAME_parent[at] < 0) break;
        const double *t = part + 12 * at;
        const double f0 = t[0] * x[0] + t[1] * x[1] + t[2] * x[2];
        const double f1 = t[3] * x[0] + t[4] * x[1] + t[5] * x[2];
        const double f2 = t[6] * x[0] + t[7] * x[1] + t[8] * x[2];
        const double n0 = t[0] * x[3] + t[1] * x[4] + t[2] * x[5];
        const double n1 = t[3] * x[3] + t[4] * x[4] + t[5] * x[5];
        const double n2 = t[6] * x[3] + t[7] * x[4] + t[8] * x[5];
        x[0] = f0, x[1] = f1, x[2] = f2;
        x[3] = n0 + t[10] * f2 - t[11] * f1;
        x[4] = n1 + t[11] * f0 - t[9] * f2;
        x[5] = n2 + t[9] * f1 - t[10] * f0;
        at = (size_t)NAME_parent[at];
        end = NAME_first[at + 1];
      }
    }
}
)";

constexpr const char* kSolve = R"(
/* Solves m x = forces in place by m = L^T D L; m is overwritten. Zeros between branches stay. */
static void NAME_solve(double *m, double *x) {
  for (size_t k = ROWS; k-- > 0;) {
    const double inverse = 1.0 / m[k * ROWS + k];
    for (size_t i = k; i-- > 0;) {
      const double factor = m[k * ROWS + i] * inverse;
      if (factor != 0.0)
        for (size_t j = 0; j <= i; ++j) m[i * ROWS + j] -= factor * m[k * ROWS + j];
      m[k * ROWS + i] = factor;
      x[i] -= factor * x[k];
    }
    m[k * ROWS + k] = inverse;
  }
  for (size_t k = 0; k < ROWS; ++k) {
    x[k] *= m[k * ROWS + k];
    for (size_t i = 0; i < k; ++i) x[k] -= m[k * ROWS + i] * x[i];
  }
}
)";

constexpr const char* kFillBlock = R"(
static void NAME_fill_inertia_block(double (*restrict part)[LANES], double (*restrict m)[LANES]) {
  for (size_t k = 0; k < ROWS * ROWS; ++k)
    for (size_t l = 0; l < LANES; ++l) m[k][l] = 0.0;
  for (size_t k = 0; k < ROWS; ++k)
    for (size_t l = 0; l < LANES; ++l) m[k * ROWS + k][l] = NAME_motor[k];
  for (size_t joint = 0; joint < JOINTS; ++joint)
    for (size_t column = NAME_first[joint]; column < NAME_first[joint + 1]; ++column) {
      double x[6][LANES];
      for (size_t k = 0; k < 6; ++k)
        for (size_t l = 0; l < LANES; ++l) x[k][l] = part[12 * JOINTS + 6 * column + k][l];
      const size_t row = NAME_velocity[column];
      size_t at = joint, end = column + 1;
      for (;;) {
        for (size_t other = NAME_first[at]; other < end; ++other) {
          const double ratio = NAME_ratio[column] * NAME_ratio[other];
          const double *along = x[NAME_component[other]];
          double *here = m[row * ROWS + NAME_velocity[other]];
          for (size_t l = 0; l < LANES; ++l) here[l] += ratio * along[l];
          double *there = m[NAME_velocity[other] * ROWS + row];
          if (other != column)
            for (size_t l = 0; l < LANES; ++l) there[l] += ratio * along[l];
        }
        if (NAME_parent[at] < 0) break;
        double(*t)[LANES] = part + 12 * at;
        for (size_t l = 0; l < LANES; ++l) {
          const double f0 = t[0][l] * x[0][l] + t[1][l] * x[1][l] + t[2][l] * x[2][l];
          const double f1 = t[3][l] * x[0][l] + t[4][l] * x[1][l] + t[5][l] * x[2][l];
          const double f2 = t[6][l] * x[0][l] + t[7][l] * x[1][l] + t[8][l] * x[2][l];
          const double n0 = t[0][l] * x[3][l] + t[1][l] * x[4][l] + t[2][l] * x[5][l];
          const double n1 = t[3][l] * x[3][l] + t[4][l] * x[4][l] + t[5][l] * x[5][l];
          const double n2 = t[6][l] * x[3][l] + t[7][l] * x[4][l] + t[8][l] * x[5][l];
          x[0][l] = f0, x[1][l] = f1, x[2][l] = f2;
          x[3][l] = n0 + t[10][l] * f2 - t[11][l] * f1;
          x[4][l] = n1 + t[11][l] * f0 - t[9][l] * f2;
          x[5][l] = n2 + t[9][l] * f1 - t[10][l] * f0;
        }
        at = (size_t)NAME_parent[at];
        end = NAME_first[at + 1];
      }
    }
}
)";

constexpr const char* kSolveBlock = R"(
static void NAME_solve_block(double (*restrict m)[LANES], double (*restrict x)[LANES]) {
  for (size_t k = ROWS; k-- > 0;) {
    double inverse[LANES];
    for (size_t l = 0; l < LANES; ++l) inverse[l] = 1.0 / m[k * ROWS + k][l];
    for (size_t i = k; i-- > 0;) {
      double factor[LANES], some = 0.0;
      for (size_t l = 0; l < LANES; ++l) {
        factor[l] = m[k * ROWS + i][l] * inverse[l];
        some += factor[l] != 0.0 ? 1.0 : 0.0;
      }
      if (some > 0.0)
        for (size_t j = 0; j <= i; ++j)
          for (size_t l = 0; l < LANES; ++l)
            m[i * ROWS + j][l] -= factor[l] * m[k * ROWS + j][l];
      for (size_t l = 0; l < LANES; ++l) {
        m[k * ROWS + i][l] = factor[l];
        x[i][l] -= factor[l] * x[k][l];
      }
    }
    for (size_t l = 0; l < LANES; ++l) m[k * ROWS + k][l] = inverse[l];
  }
  for (size_t k = 0; k < ROWS; ++k) {
    for (size_t l = 0; l < LANES; ++l) x[k][l] *= m[k * ROWS + k][l];
    for (size_t i = 0; i < k; ++i)
      for (size_t l = 0; l < LANES; ++l) x[k][l] -= m[k * ROWS + i][l] * x[i][l];
  }
}
)";

}  // namespace

Columns columns_of(const RobotModel& model) {
  Columns c;
  c.motor.assign(model.dof(), 0.0);
  for (const JointModel& j : model.joints) {
    c.parent.push_back(j.parent);
    c.first.push_back(c.columns());
    const std::int32_t count = velocity_count(j.type);
    const double ratio = j.is_coupled() ? j.coupling.ratio : 1.0;
    for (std::int32_t k = 0; k < count; ++k) {
      const bool slides = j.type == JointType::prismatic || (j.type == JointType::free && k < 3);
      const std::size_t axis = count == 1 ? 2 : static_cast<std::size_t>(k % 3);
      c.velocity.push_back(static_cast<std::size_t>(j.v_index + k));
      c.component.push_back(slides ? axis : 3 + axis);
      c.ratio.push_back(ratio);
    }
    if (count == 1) c.motor[static_cast<std::size_t>(j.v_index)] += ratio * ratio * j.armature;
  }
  c.first.push_back(c.columns());
  return c;
}

std::size_t ending_width(Ending ending, const Columns& c) {
  const bool is_matrix = ending == Ending::inertia || ending == Ending::motor_inertia;
  return is_matrix ? c.rows() * c.rows() : c.rows();
}

std::vector<double> run_ending(Ending ending, const Columns& c, std::span<const double> parts) {
  std::vector<double> m;
  fill_inertia(c, parts, m);
  if (ending == Ending::inertia) return m;
  const auto forces = parts.last(c.rows());
  std::vector<double> x(forces.begin(), forces.end());
  solve_in_place(m, x);
  return x;
}

std::string ending_text(const std::string& name, const std::string& lanes, const Columns& c,
                        const EndingUses& uses) {
  std::string s =
      "\n/* Joints and the columns of their motion, one a velocity: parent joint, first "
      "column, row of the\n * matrix, component of force and moment, ratio of a "
      "follower; then what motors add. */\n";
  s += c_table("int", name + "_parent", c.parent);
  s += c_table("size_t", name + "_first", c.first);
  s += c_table("size_t", name + "_velocity", c.velocity);
  s += c_table("size_t", name + "_component", c.component);
  s += c_table("double", name + "_ratio", c.ratio);
  s += c_table("double", name + "_motor", c.motor);
  std::string loops = kFill;
  if (uses.solve) loops += kSolve;
  if (uses.fill_block) loops += kFillBlock;
  if (uses.solve_block) loops += kSolveBlock;
  loops = replaced(std::move(loops), "ROWS", std::to_string(c.rows()));
  loops = replaced(std::move(loops), "JOINTS", std::to_string(c.joints()));
  // Names of robots last: they may have any of these words within.
  loops = replaced(std::move(loops), "NAME_", "\1");
  loops = replaced(std::move(loops), "LANES", lanes);
  return s + replaced(std::move(loops), "\1", name + "_");
}

}  // namespace robomosp::robot_code

// SPDX-License-Identifier: Apache-2.0
// Linear algebra of scripts: the table `linalg`; those of its functions that begin with an array
// are methods of arrays too.
#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "kernel/text.h"
#include "kernel/unit_lists.h"
#include "kernel/units.h"
#include "lua/internal.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::lua {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

/// A decomposition of a larger matrix takes so long that a script should not be stuck in it.
constexpr Eigen::Index kLargestDecomposed = 1000;
/// Numbers of one array; 2 GiB.
constexpr double kMostNumbers = 1u << 28;

Error misuse(std::string message, std::string hint = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// An argument: an array, or a list of numbers or of rows, which need not be finite.
struct Operand {
  Matrix m;  ///< a vector is one column
  bool is_vector = false;
  std::string unit;

  [[nodiscard]] std::string shape() const {
    if (is_vector) return "a vector of " + std::to_string(m.rows());
    return "a " + std::to_string(m.rows()) + "x" + std::to_string(m.cols()) + " matrix";
  }
};

Result<Operand> operand(Impl& impl, lua_State* L, int index) {
  index = lua_absindex(L, index);
  const int top = lua_gettop(L);
  if (!array_at(L, index)) {
    if (!lua_istable(L, index))
      return misuse(std::string("an array is expected, not ") +
                        (lua_isnoneornil(L, index) ? "nothing" : luaL_typename(L, index)),
                    "Give an array or a list, such as {1, 2} or {{1, 0}, {0, 1}}.");
    RMP_TRY(push_array_of(impl, L, index, {}));
    index = lua_gettop(L);
  }
  const ArrayBox* a = array_at(L, index);
  const NumericArray v = a->value();
  Operand o;
  o.is_vector = !a->is_matrix();
  if (!units::is_list(a->unit)) o.unit = a->unit;  // entries change places
  const auto rows = static_cast<Eigen::Index>(v.rows());
  const auto cols = o.is_vector ? 1 : static_cast<Eigen::Index>(v.cols());
  o.m = Eigen::Map<const Matrix>(v.data().data(), rows, cols);
  lua_settop(L, top);
  return o;
}

NumericArray to_array(const Operand& o) {
  std::vector<double> numbers(o.m.data(), o.m.data() + o.m.size());
  if (o.is_vector) return NumericArray(std::move(numbers), o.unit);
  return {std::move(numbers), static_cast<std::size_t>(o.m.rows()),
          static_cast<std::size_t>(o.m.cols()), o.unit};
}

void push_matrix(Impl& impl, lua_State* L, const Matrix& m, std::string unit = {}) {
  push_array(impl, L,
             NumericArray(std::vector<double>(m.data(), m.data() + m.size()),
                          static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols()),
                          std::move(unit)));
}
void push_vector(Impl& impl, lua_State* L, const Vector& v, std::string unit = {}) {
  push_array(impl, L,
             NumericArray(std::vector<double>(v.data(), v.data() + v.size()), std::move(unit)));
}
/// As a vector when `is_vector`; `m` has one column then.
void push_shaped(Impl& impl, lua_State* L, const Matrix& m, bool is_vector, std::string unit = {}) {
  if (is_vector) push_vector(impl, L, m.col(0), std::move(unit));
  else push_matrix(impl, L, m, std::move(unit));
}

Result<void> need_finite(const Operand& o, std::string_view name) {
  if (o.m.allFinite()) return {};
  for (Eigen::Index i = 0; i < o.m.rows(); ++i)
    for (Eigen::Index j = 0; j < o.m.cols(); ++j)
      if (!std::isfinite(o.m(i, j)))
        return misuse(std::string(name) + " needs finite numbers; entry " +
                      (o.is_vector
                           ? std::to_string(i + 1)
                           : "(" + std::to_string(i + 1) + ", " + std::to_string(j + 1) + ")") +
                      " is " + text::print_rounded(o.m(i, j)));
  return {};
}

/// The matrix of a decomposition: finite, not empty, not beyond what a script can wait for.
Result<Operand> need_matrix(Impl& impl, lua_State* L, int index, std::string_view name) {
  RMP_TRY_ASSIGN(Operand o, operand(impl, L, index));
  if (o.is_vector)
    return misuse(std::string(name) + " needs a matrix, not " + o.shape(),
                  "Write array{{1, 0}, {0, 1}}.");
  if (o.m.rows() > kLargestDecomposed || o.m.cols() > kLargestDecomposed)
    return misuse(std::string(name) + " accepts matrices of up to 1000x1000, not " + o.shape());
  RMP_TRY(need_finite(o, name));
  return o;
}

Result<Operand> need_square(Impl& impl, lua_State* L, int index, std::string_view name) {
  RMP_TRY_ASSIGN(Operand o, need_matrix(impl, L, index, name));
  if (o.m.rows() != o.m.cols())
    return misuse(std::string(name) + " needs a square matrix, not " + o.shape(),
                  name == "solve"     ? "Write A:lstsq(b) for the least squares."
                  : name == "inverse" ? "Write A:pinv() for the pseudoinverse."
                                      : "");
  return o;
}

/// A vector of `size` numbers (0 = any number).
Result<Vector> need_vector(Impl& impl, lua_State* L, int index, Eigen::Index size,
                           std::string_view what) {
  RMP_TRY_ASSIGN(const Operand o, operand(impl, L, index));
  if (!o.is_vector || (size > 0 && o.m.rows() != size))
    return misuse(std::string(what) + " is " + o.shape() + ", not a vector" +
                  (size > 0 ? " of " + std::to_string(size) : ""));
  return Vector(o.m.col(0));
}

/// An optional number >= 0, or `otherwise`.
Result<double> tolerance(lua_State* L, int index, double otherwise) {
  if (lua_isnoneornil(L, index)) return otherwise;
  const double t = lua_type(L, index) == LUA_TNUMBER ? lua_tonumber(L, index) : -1.0;
  if (!(t >= 0) || !std::isfinite(t))
    return misuse("the tolerance is not a number of 0 or more", "Write A:rank(1e-9).");
  return t;
}

/// A whole number from `least` on.
Result<Eigen::Index> need_count(lua_State* L, int index, std::string_view what,
                                Eigen::Index least) {
  int is_whole = 0;
  const lua_Integer n = lua_type(L, index) == LUA_TNUMBER ? lua_tointegerx(L, index, &is_whole) : 0;
  if (!is_whole || n < least || static_cast<double>(n) > kMostNumbers)
    return misuse(std::string(what) + " is not a whole number from " + std::to_string(least) +
                  " to " + std::to_string(static_cast<long>(kMostNumbers)));
  return static_cast<Eigen::Index>(n);
}

/// Unit of a product of `a` to the power `pa` and `b` to `pb`; none when one of them is unknown.
std::string unit_of(const std::string& a, int pa, const std::string& b = {}, int pb = 0) {
  const auto ua = units::parse(a), ub = units::parse(b);
  if (!ua.ok() || !ub.ok()) return {};
  units::Dimension d{};
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = pa * ua->dimension[i] + pb * ub->dimension[i];
  return units::si_name(d);
}

// --- matrices ----------------------------------------------------------------------------------

/// The matrix over its largest entry, so that no product of entries overflows; and that entry.
/// A power of two: scaling by it loses nothing.
double scale_of(const Matrix& m) {
  const double largest = m.size() ? m.cwiseAbs().maxCoeff() : 0.0;
  if (!(largest > 0)) return 1;
  return std::ldexp(1.0, std::clamp(std::ilogb(largest), -1021, 1022));
}

struct Svd {
  Matrix u, v;
  Vector s;
  double scale = 1;
};

/// Thin; the singular values without the scale.
Svd decompose(const Matrix& m, bool with_vectors) {
  Svd out;
  out.scale = scale_of(m);
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(
      Eigen::MatrixXd(m / out.scale), with_vectors ? Eigen::ComputeThinU | Eigen::ComputeThinV : 0);
  out.s = svd.singularValues();
  if (with_vectors) {
    out.u = svd.matrixU();
    out.v = svd.matrixV();
  }
  return out;
}

/// Below this share of the largest a singular value counts as 0 (the customary choice).
double default_tolerance(const Matrix& m) {
  return static_cast<double>(std::max(m.rows(), m.cols())) * std::numeric_limits<double>::epsilon();
}

/// A = diag(2^rows) m diag(2^cols) with rows, then columns, of largest entries near 1: what is
/// badly scaled only is not taken for singular. Exact, since it moves exponents only.
struct Balanced {
  Matrix m;
  std::vector<int> rows, cols;

  explicit Balanced(const Matrix& a) : m(a) {
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      rows.push_back(exponent_of(m.row(i)));
      for (double& x : m.row(i)) x = std::ldexp(x, -rows.back());
    }
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      cols.push_back(exponent_of(m.col(j)));
      for (double& x : m.col(j)) x = std::ldexp(x, -cols.back());
    }
  }
  static int exponent_of(const auto& line) {
    const double largest = line.cwiseAbs().maxCoeff();
    return largest > 0 ? std::ilogb(largest) : 0;
  }
  /// diag(2^-powers) x
  static Matrix unscaled(Matrix x, const std::vector<int>& powers) {
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      for (double& v : x.row(i)) v = std::ldexp(v, -powers[static_cast<std::size_t>(i)]);
    return x;
  }
};

using Lu = Eigen::PartialPivLU<Eigen::MatrixXd>;

Result<int> det(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "det"));
  // Mantissa and exponent apart, so that only a determinant that is too large itself overflows.
  const Balanced b(a.m);
  const Lu lu{Eigen::MatrixXd(b.m)};
  auto mantissa = static_cast<double>(lu.permutationP().determinant());
  long exponent = 0;
  for (Eigen::Index i = 0; i < a.m.rows(); ++i) {
    int e = 0;
    mantissa = std::frexp(mantissa * lu.matrixLU()(i, i), &e);
    exponent += e + b.rows[static_cast<std::size_t>(i)] + b.cols[static_cast<std::size_t>(i)];
  }
  const double value =
      std::ldexp(mantissa, static_cast<int>(std::clamp(exponent, -100000L, 100000L)));
  if (!std::isfinite(value))
    return error(ErrorCode::invalid_argument,
                 "the determinant is larger than the largest number (about 2^" +
                     std::to_string(exponent) + ")",
                 "Scale the matrix.");
  lua_pushnumber(L, value);
  return 1;
}

/// LU of a matrix that is regular in double precision, or the error that gives its rank.
Result<Lu> regular(const Balanced& b, std::string_view hint) {
  const Eigen::Index n = b.m.rows();
  Lu lu{Eigen::MatrixXd(b.m)};
  bool has_zero = false;
  for (Eigen::Index i = 0; i < n; ++i) has_zero = has_zero || lu.matrixLU()(i, i) == 0;
  if (!has_zero && lu.rcond() > std::numeric_limits<double>::epsilon()) return lu;
  const Svd svd = decompose(b.m, false);
  const double limit = svd.s.size() ? svd.s[0] * default_tolerance(b.m) : 0;
  const auto rank = std::min((svd.s.array() > limit).count(), n - 1);
  return error(ErrorCode::invalid_argument,
               "the " + std::to_string(n) + "x" + std::to_string(n) +
                   " matrix is singular: its rank is " + std::to_string(rank),
               std::string(hint));
}

Result<int> inverse(Impl& impl, lua_State* L) {
  // The inverse of a pose is one, in every bit of its last row.
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "inverse"));
  if (const auto pose = rigid_pose(to_array(a))) {
    push(impl, L, pose_value(spatial::inverse(*pose)));
    return 1;
  }
  const Balanced b(a.m);
  RMP_TRY_ASSIGN(const Lu lu, regular(b, "Write A:pinv() for the pseudoinverse."));
  // A^-1 = diag(2^-cols) m^-1 diag(2^-rows)
  Matrix out = Balanced::unscaled(lu.inverse(), b.cols);
  out.transposeInPlace();
  out = Balanced::unscaled(std::move(out), b.rows);
  out.transposeInPlace();
  if (!out.allFinite())
    return error(ErrorCode::invalid_argument,
                 "entries of the inverse are larger than the largest number", "Scale the matrix.");
  push_matrix(impl, L, out, unit_of(a.unit, -1));
  return 1;
}

/// A x = b for a vector or the columns of a matrix.
Result<int> solve(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "solve"));
  RMP_TRY_ASSIGN(const Operand b, operand(impl, L, 2));
  if (b.m.rows() != a.m.rows())
    return misuse(a.shape() + " and " + b.shape() + " do not form equations",
                  "The right-hand side needs a row for each row of the matrix.");
  RMP_TRY(need_finite(b, "solve"));
  const Balanced scaled(a.m);
  RMP_TRY_ASSIGN(const Lu lu,
                 regular(scaled, "Write A:lstsq(b) for the least squares of least norm."));
  const Matrix y = lu.solve(Balanced::unscaled(b.m, scaled.rows));
  const Matrix x = Balanced::unscaled(y, scaled.cols);
  if (!x.allFinite())
    return error(ErrorCode::invalid_argument,
                 "numbers of the solution are larger than the largest number",
                 "Scale the equations.");
  push_shaped(impl, L, x, b.is_vector, unit_of(b.unit, 1, a.unit, -1));
  return 1;
}

Matrix pseudo(const Svd& svd, double limit) {
  Vector inverse = svd.s;
  for (double& s : inverse) s = s > limit && s > 0 ? 1 / s / svd.scale : 0.0;
  return svd.v * inverse.asDiagonal() * svd.u.transpose();
}

/// Least squares, of least norm among those.
Result<int> lstsq(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "lstsq"));
  RMP_TRY_ASSIGN(const Operand b, operand(impl, L, 2));
  if (b.m.rows() != a.m.rows())
    return misuse(a.shape() + " and " + b.shape() + " do not form equations",
                  "The right-hand side needs a row for each row of the matrix.");
  RMP_TRY(need_finite(b, "lstsq"));
  RMP_TRY_ASSIGN(const double t, tolerance(L, 3, default_tolerance(a.m)));
  const Svd svd = decompose(a.m, true);
  const double limit = svd.s.size() ? svd.s[0] * t : 0;
  push_shaped(impl, L, pseudo(svd, limit) * b.m, b.is_vector, unit_of(b.unit, 1, a.unit, -1));
  return 1;
}

Result<int> pinv(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "pinv"));
  RMP_TRY_ASSIGN(const double t, tolerance(L, 2, default_tolerance(a.m)));
  const Svd svd = decompose(a.m, true);
  push_matrix(impl, L, pseudo(svd, svd.s.size() ? svd.s[0] * t : 0), unit_of(a.unit, -1));
  return 1;
}

Result<int> rank(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "rank"));
  RMP_TRY_ASSIGN(const double t, tolerance(L, 2, default_tolerance(a.m)));
  const Svd svd = decompose(a.m, false);
  const double limit = svd.s.size() ? svd.s[0] * t : 0;
  lua_pushinteger(L, static_cast<lua_Integer>((svd.s.array() > limit).count()));
  return 1;
}

Result<int> cond(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "cond"));
  const Svd svd = decompose(a.m, false);
  if (svd.s.size() == 0) return misuse("an empty matrix has no condition number");
  const double least = svd.s[svd.s.size() - 1];
  lua_pushnumber(L, least > 0 ? svd.s[0] / least : std::numeric_limits<double>::infinity());
  return 1;
}

/// U, s, V with A = U diag(s) V^T.
Result<int> svd(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "svd"));
  const Svd d = decompose(a.m, true);
  push_matrix(impl, L, d.u);
  push_vector(impl, L, d.s * d.scale, a.unit);
  push_matrix(impl, L, d.v);
  return 3;
}

/// values, vectors [, imaginary parts of the vectors]
Result<int> eig(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "eig"));
  if (a.m.rows() == 0) return misuse("an empty matrix has no eigenvalues");
  const double scale = scale_of(a.m);
  const Eigen::MatrixXd m = a.m / scale;
  const Error lost = error(ErrorCode::unsupported,
                           "the eigenvalues of " + a.shape() + " were not found: no convergence");
  if (m == m.transpose()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> e(m);
    if (e.info() != Eigen::Success) return lost;
    push_vector(impl, L, e.eigenvalues() * scale, a.unit);
    push_matrix(impl, L, Matrix(e.eigenvectors()));
    return 2;
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> e(m);
  if (e.info() != Eigen::Success) return lost;
  const Eigen::VectorXcd values = e.eigenvalues();
  const Eigen::MatrixXcd vectors = e.eigenvectors();
  const Eigen::Index n = m.rows();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) order[static_cast<std::size_t>(i)] = i;
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) {
    return values[i].real() < values[j].real();
  });
  const bool is_real = (values.imag().array() == 0).all();
  Matrix sorted(n, 2), real(n, n), imaginary(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index i = order[static_cast<std::size_t>(k)];
    sorted(k, 0) = values[i].real() * scale;
    sorted(k, 1) = values[i].imag() * scale;
    real.col(k) = vectors.col(i).real();
    imaginary.col(k) = vectors.col(i).imag();
  }
  if (is_real) push_vector(impl, L, sorted.col(0), a.unit);
  else push_matrix(impl, L, sorted, a.unit);
  push_matrix(impl, L, real);
  if (is_real) return 2;
  push_matrix(impl, L, imaginary);
  return 3;
}

/// Q, R with A = Q R, thin.
Result<int> qr(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_matrix(impl, L, 1, "qr"));
  const double scale = scale_of(a.m);
  const Eigen::HouseholderQR<Eigen::MatrixXd> d{Eigen::MatrixXd(a.m / scale)};
  const Eigen::Index k = std::min(a.m.rows(), a.m.cols());
  const Eigen::MatrixXd q = d.householderQ() * Eigen::MatrixXd::Identity(a.m.rows(), k);
  const Eigen::MatrixXd r = d.matrixQR().topRows(k).triangularView<Eigen::Upper>();
  push_matrix(impl, L, q);
  push_matrix(impl, L, r * scale, a.unit);
  return 2;
}

/// L, U, P with P A = L U.
Result<int> lu(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "lu"));
  const double scale = scale_of(a.m);
  const Eigen::PartialPivLU<Eigen::MatrixXd> d{Eigen::MatrixXd(a.m / scale)};
  const Eigen::MatrixXd lower = d.matrixLU().triangularView<Eigen::UnitLower>();
  const Eigen::MatrixXd upper = d.matrixLU().triangularView<Eigen::Upper>();
  const Eigen::MatrixXd p = d.permutationP() * Eigen::MatrixXd::Identity(a.m.rows(), a.m.rows());
  push_matrix(impl, L, lower);
  push_matrix(impl, L, upper * scale, a.unit);
  push_matrix(impl, L, p);
  return 3;
}

/// Lower triangular L with A = L L^T.
Result<int> chol(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, need_square(impl, L, 1, "chol"));
  const Eigen::Index n = a.m.rows();
  // An even power of two, so that the root of the scale is exact.
  const int exponent = std::ilogb(scale_of(a.m)) / 2 * 2;
  const Eigen::MatrixXd m = a.m / std::ldexp(1.0, exponent);
  const double asymmetry = n ? (m - m.transpose()).cwiseAbs().maxCoeff() : 0.0;
  if (asymmetry > 1e-12 * (n ? m.cwiseAbs().maxCoeff() : 0.0))
    return misuse("chol needs a symmetric matrix; entries across the diagonal differ by " +
                  text::print_rounded(asymmetry * std::ldexp(1.0, exponent)));
  Eigen::MatrixXd lower = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const double rest = m(j, j) - lower.row(j).head(j).squaredNorm();
    if (!(rest > 0))
      return error(ErrorCode::invalid_argument,
                   "the matrix is not positive definite: its leading minor of order " +
                       std::to_string(j + 1) + " is not positive");
    lower(j, j) = std::sqrt(rest);
    const Eigen::Index below = n - j - 1;
    lower.col(j).tail(below) = (m.col(j).tail(below) - lower.bottomLeftCorner(below, j) *
                                                           lower.row(j).head(j).transpose()) /
                               lower(j, j);
  }
  push_matrix(impl, L, Matrix(lower * std::ldexp(1.0, exponent / 2)));
  return 1;
}

Result<int> trace(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  if (a.is_vector || a.m.rows() != a.m.cols())
    return misuse("trace needs a square matrix, not " + a.shape());
  lua_pushnumber(L, a.m.trace());
  return 1;
}

/// a:norm(), a:norm(1), a:norm(2), a:norm("inf"), A:norm("fro"). Without a kind: of a vector its
/// length, of a matrix the Frobenius norm.
Result<int> norm(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  std::string kind = lua_isnoneornil(L, 2) ? (a.is_vector ? "2" : "fro") : "?";
  if (lua_type(L, 2) == LUA_TNUMBER) {
    const double p = lua_tonumber(L, 2);
    kind = p == 1 ? "1" : p == 2 ? "2" : std::isinf(p) && p > 0 ? "inf" : "?";
  } else if (lua_type(L, 2) == LUA_TSTRING) {
    kind = lua_tostring(L, 2);
  }
  const auto m = a.m.cwiseAbs();
  double value = 0;
  if (a.m.size() == 0) value = 0;
  else if (a.m.hasNaN()) value = std::numeric_limits<double>::quiet_NaN();
  else if (!a.m.allFinite()) value = std::numeric_limits<double>::infinity();
  else if (kind == "1") value = m.colwise().sum().maxCoeff();
  else if (kind == "inf") value = m.rowwise().sum().maxCoeff();
  else if (kind == "fro" || (kind == "2" && a.is_vector)) value = a.m.stableNorm();
  else if (kind == "2") {
    RMP_TRY(need_matrix(impl, L, 1, "norm(2)"));
    const Svd d = decompose(a.m, false);
    value = d.s[0] * d.scale;
  }
  if (kind != "1" && kind != "2" && kind != "inf" && kind != "fro")
    return misuse("there is no such norm", "Kinds are 1, 2, \"inf\" and \"fro\".");
  lua_pushnumber(L, value);
  return 1;
}

Result<int> cross(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  RMP_TRY_ASSIGN(const Operand b, operand(impl, L, 2));
  if (!a.is_vector || !b.is_vector || a.m.rows() != 3 || b.m.rows() != 3)
    return misuse("the cross product needs two vectors of 3, not " + a.shape() + " and " +
                  b.shape());
  const Eigen::Vector3d u = a.m.col(0), v = b.m.col(0);
  push_vector(impl, L, u.cross(v), unit_of(a.unit, 1, b.unit, 1));
  return 1;
}

Result<void> room_for(double rows, double cols) {
  if (rows * cols <= kMostNumbers) return {};
  return misuse("the result would have " + text::print_rounded(rows) + " x " +
                text::print_rounded(cols) + " numbers, more than the " +
                text::print_rounded(kMostNumbers) + " of the largest array");
}

Result<int> outer(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Vector u, need_vector(impl, L, 1, 0, "the first argument of outer"));
  RMP_TRY_ASSIGN(const Vector v, need_vector(impl, L, 2, 0, "the second argument of outer"));
  RMP_TRY(room_for(static_cast<double>(u.size()), static_cast<double>(v.size())));
  push_matrix(impl, L, u * v.transpose());
  return 1;
}

Result<int> kron(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  RMP_TRY_ASSIGN(const Operand b, operand(impl, L, 2));
  RMP_TRY(room_for(static_cast<double>(a.m.rows()) * static_cast<double>(b.m.rows()),
                   static_cast<double>(a.m.cols()) * static_cast<double>(b.m.cols())));
  Matrix out(a.m.rows() * b.m.rows(), a.m.cols() * b.m.cols());
  for (Eigen::Index i = 0; i < a.m.rows(); ++i)
    for (Eigen::Index j = 0; j < a.m.cols(); ++j)
      out.block(i * b.m.rows(), j * b.m.cols(), b.m.rows(), b.m.cols()) = a.m(i, j) * b.m;
  push_shaped(impl, L, out, a.is_vector && b.is_vector, unit_of(a.unit, 1, b.unit, 1));
  return 1;
}

// --- parts and shapes --------------------------------------------------------------------------

struct Range {
  Eigen::Index first = 0, count = 0;
};

/// Entries from one number to another, both included; negative ones count from the end, as in
/// string.sub.
Result<Range> range(lua_State* L, int index, Eigen::Index size, std::string_view thing) {
  lua_Integer ends[2] = {1, static_cast<lua_Integer>(size)};
  for (int k = 0; k < 2; ++k) {
    if (lua_isnoneornil(L, index + k)) continue;
    int is_whole = 0;
    ends[k] = lua_type(L, index + k) == LUA_TNUMBER ? lua_tointegerx(L, index + k, &is_whole) : 0;
    const lua_Integer given = ends[k];
    if (given < 0) ends[k] += size + 1;
    if (!is_whole || ends[k] < 1 || ends[k] > size)
      return misuse("there is no " + std::string(thing) + " " +
                        (lua_type(L, index + k) == LUA_TNUMBER
                             ? text::print_rounded(lua_tonumber(L, index + k))
                             : std::string("of that kind")) +
                        "; they are numbered from 1 to " + std::to_string(size),
                    "Negative numbers count from the end.");
  }
  if (ends[1] < ends[0])
    return misuse("the last " + std::string(thing) + ", " + std::to_string(ends[1]) +
                  ", comes before the first, " + std::to_string(ends[0]));
  return Range{static_cast<Eigen::Index>(ends[0] - 1),
               static_cast<Eigen::Index>(ends[1] - ends[0] + 1)};
}

/// v:sub(first, last), A:sub(first row, last row [, first column, last column])
Result<int> sub(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  RMP_TRY_ASSIGN(const Range rows, range(L, 2, a.m.rows(), a.is_vector ? "entry" : "row"));
  if (a.is_vector) {
    push_vector(impl, L, a.m.col(0).segment(rows.first, rows.count), a.unit);
    return 1;
  }
  RMP_TRY_ASSIGN(const Range cols, range(L, 4, a.m.cols(), "column"));
  push_matrix(impl, L, a.m.block(rows.first, cols.first, rows.count, cols.count), a.unit);
  return 1;
}

Result<int> diagonal(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  if (!a.is_vector) {
    push_vector(impl, L, a.m.diagonal(), a.unit);
    return 1;
  }
  RMP_TRY(room_for(static_cast<double>(a.m.rows()), static_cast<double>(a.m.rows())));
  push_matrix(impl, L, Matrix(a.m.col(0).asDiagonal()), a.unit);
  return 1;
}

Result<int> reshape(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  RMP_TRY_ASSIGN(const Eigen::Index rows, need_count(L, 2, "the number of rows", 1));
  Eigen::Index cols = 0;
  if (!lua_isnoneornil(L, 3)) {
    RMP_TRY_ASSIGN(cols, need_count(L, 3, "the number of columns", 1));
  }
  if (a.m.size() != rows * std::max<Eigen::Index>(cols, 1))
    return misuse(a.shape() + " has " + std::to_string(a.m.size()) + " numbers, not " +
                  std::to_string(rows * std::max<Eigen::Index>(cols, 1)));
  if (cols == 0) push_vector(impl, L, Eigen::Map<const Vector>(a.m.data(), a.m.size()), a.unit);
  else push_matrix(impl, L, Eigen::Map<const Matrix>(a.m.data(), rows, cols), a.unit);
  return 1;
}

/// linalg.rows{a, b, ...}: below each other; linalg.columns{a, b, ...}: side by side. A vector is a
/// row, or a column.
Result<int> stack(Impl& impl, lua_State* L, bool as_rows) {
  const std::string name = as_rows ? "linalg.rows" : "linalg.columns";
  if (!lua_istable(L, 1) || lua_rawlen(L, 1) == 0)
    return misuse(name + " needs a list of vectors and matrices",
                  "Write " + name + "{{1, 2}, {3, 4}}.");
  const auto count = lua_rawlen(L, 1);
  std::vector<Matrix> parts;
  std::string unit;
  Eigen::Index total = 0;
  for (lua_Unsigned i = 1; i <= count; ++i) {
    lua_rawgeti(L, 1, static_cast<lua_Integer>(i));
    auto o = operand(impl, L, -1);
    lua_pop(L, 1);
    if (!o.ok()) return std::move(o).error().in("[" + std::to_string(i) + "]");
    if (o->is_vector && as_rows) o->m.transposeInPlace();
    if (i == 1) unit = o->unit;
    if (o->unit != unit) unit.clear();
    const Eigen::Index width = as_rows ? o->m.cols() : o->m.rows();
    const Eigen::Index wanted = parts.empty() ? width : as_rows ? parts[0].cols() : parts[0].rows();
    if (width != wanted)
      return misuse("part " + std::to_string(i) + " of " + name + " is " + std::to_string(width) +
                    (as_rows ? " wide" : " high") + ", the first one " + std::to_string(wanted));
    total += as_rows ? o->m.rows() : o->m.cols();
    parts.push_back(std::move(o->m));
  }
  const Eigen::Index width = as_rows ? parts[0].cols() : parts[0].rows();
  RMP_TRY(room_for(static_cast<double>(total), static_cast<double>(width)));
  Matrix out(as_rows ? total : width, as_rows ? width : total);
  Eigen::Index at = 0;
  for (const Matrix& p : parts) {
    if (as_rows) out.middleRows(at, p.rows()) = p;
    else out.middleCols(at, p.cols()) = p;
    at += as_rows ? p.rows() : p.cols();
  }
  push_matrix(impl, L, out, unit);
  return 1;
}
Result<int> stack_rows(Impl& impl, lua_State* L) { return stack(impl, L, true); }
Result<int> stack_columns(Impl& impl, lua_State* L) { return stack(impl, L, false); }

Result<int> filled(Impl& impl, lua_State* L, double value, std::string_view name) {
  RMP_TRY_ASSIGN(const Eigen::Index rows,
                 need_count(L, 1, "the number of rows of " + std::string(name), 1));
  if (lua_isnoneornil(L, 2)) {
    push_vector(impl, L, Vector::Constant(rows, value));
    return 1;
  }
  RMP_TRY_ASSIGN(const Eigen::Index cols,
                 need_count(L, 2, "the number of columns of " + std::string(name), 1));
  RMP_TRY(room_for(static_cast<double>(rows), static_cast<double>(cols)));
  push_matrix(impl, L, Matrix::Constant(rows, cols, value));
  return 1;
}
Result<int> zeros(Impl& impl, lua_State* L) { return filled(impl, L, 0, "linalg.zeros"); }
Result<int> ones(Impl& impl, lua_State* L) { return filled(impl, L, 1, "linalg.ones"); }

Result<int> identity(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Eigen::Index n, need_count(L, 1, "the size of linalg.identity", 1));
  RMP_TRY(room_for(static_cast<double>(n), static_cast<double>(n)));
  push_matrix(impl, L, Matrix::Identity(n, n));
  return 1;
}

/// linalg.linspace(first, last, count)
Result<int> linspace(Impl& impl, lua_State* L) {
  if (lua_type(L, 1) != LUA_TNUMBER || lua_type(L, 2) != LUA_TNUMBER)
    return misuse("linalg.linspace needs two numbers and a count",
                  "Write linalg.linspace(0, 1, 11).");
  const double first = lua_tonumber(L, 1), last = lua_tonumber(L, 2);
  RMP_TRY_ASSIGN(const Eigen::Index n, need_count(L, 3, "the count of linalg.linspace", 2));
  Vector v(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(n - 1);
    v[i] = (1 - t) * first + t * last;
  }
  push_vector(impl, L, v);
  return 1;
}

// --- entry by entry ----------------------------------------------------------------------------

template <typename F>
Result<int> each(Impl& impl, lua_State* L, bool keeps_unit, F f) {
  RMP_TRY_ASSIGN(Operand a, operand(impl, L, 1));
  for (double& x : a.m.reshaped()) x = f(x);
  push_shaped(impl, L, a.m, a.is_vector, keeps_unit ? a.unit : std::string());
  return 1;
}
template <double (*f)(double), bool keeps_unit = false>
Result<int> elementwise(Impl& impl, lua_State* L) {
  return each(impl, L, keeps_unit, f);
}

/// a:map(f): f of each number.
Result<int> map(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(Operand a, operand(impl, L, 1));
  if (!lua_isfunction(L, 2)) return misuse("map needs a function", "Write a:map(math.sin).");
  for (double& x : a.m.reshaped<Eigen::RowMajor>()) {
    lua_pushvalue(L, 2);
    lua_pushnumber(L, x);
    lua_call(L, 1, 1);
    if (lua_type(L, -1) != LUA_TNUMBER)
      return misuse(std::string("the function of map returned ") + luaL_typename(L, -1) + " for " +
                    text::print_rounded(x) + ", not a number");
    x = lua_tonumber(L, -1);
    lua_pop(L, 1);
  }
  push_shaped(impl, L, a.m, a.is_vector);
  return 1;
}

/// Two arrays of one shape, entry by entry.
template <typename F>
Result<int> pairwise(Impl& impl, lua_State* L, std::string_view verb, int power, F f) {
  RMP_TRY_ASSIGN(Operand a, operand(impl, L, 1));
  RMP_TRY_ASSIGN(const Operand b, operand(impl, L, 2));
  if (a.is_vector != b.is_vector || a.m.rows() != b.m.rows() || a.m.cols() != b.m.cols())
    return misuse(
        a.shape() + " and " + b.shape() + " cannot be " + std::string(verb) + " entry by entry",
        "Both must have the same shape.");
  a.m = a.m.binaryExpr(b.m, f).eval();
  push_shaped(impl, L, a.m, a.is_vector, unit_of(a.unit, 1, b.unit, power));
  return 1;
}
Result<int> times(Impl& impl, lua_State* L) {
  return pairwise(impl, L, "multiplied", 1, [](double x, double y) { return x * y; });
}
Result<int> over(Impl& impl, lua_State* L) {
  return pairwise(impl, L, "divided", -1, [](double x, double y) { return x / y; });
}
Result<int> power(Impl& impl, lua_State* L) {
  if (lua_type(L, 2) != LUA_TNUMBER) return misuse("pow needs a number", "Write a:pow(2).");
  const double p = lua_tonumber(L, 2);
  return each(impl, L, false, [p](double x) { return std::pow(x, p); });
}

Result<int> sum(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  lua_pushnumber(L, a.m.sum());
  return 1;
}
Result<int> mean(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  if (a.m.size() == 0) return misuse("an empty array has no mean");
  lua_pushnumber(L, a.m.sum() / static_cast<double>(a.m.size()));
  return 1;
}

// --- rotations, poses, twists ------------------------------------------------------------------

Result<int> skew(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Vector v, need_vector(impl, L, 1, 3, "the argument of skew"));
  Matrix m(3, 3);
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  push_matrix(impl, L, m);
  return 1;
}

/// The rotation of a 3x3 matrix or a pose.
Result<spatial::Matrix3> need_rotation(Impl& impl, lua_State* L, std::string_view name) {
  RMP_TRY_ASSIGN(Operand a, operand(impl, L, 1));
  if (!a.is_vector && a.m.rows() == 3 && a.m.cols() == 3) {
    Matrix pose = Matrix::Identity(4, 4);
    pose.topLeftCorner(3, 3) = a.m;
    a.m = std::move(pose);
  } else if (a.is_vector || a.m.rows() != 4 || a.m.cols() != 4) {
    return misuse(std::string(name) + " needs a 3x3 rotation or a pose, not " + a.shape());
  }
  if (const auto pose = rigid_pose(to_array(a))) return pose->R;
  return misuse(
      "the matrix is not a rotation: its columns are not the unit vectors of a right-handed frame");
}

Result<Pose> need_pose(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand a, operand(impl, L, 1));
  if (const auto pose = rigid_pose(to_array(a))) return *pose;
  return misuse(a.shape() + " is not a pose", "A pose is a 4x4 matrix such as pose(0.1, 0, 0.2).");
}

void push_rotation(Impl& impl, lua_State* L, const spatial::Matrix3& r) {
  push_array(impl, L, NumericArray(std::vector<double>(r.begin(), r.end()), 3, 3));
}

/// R:log(): axis times angle.
Result<int> rotation_log(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const auto r, need_rotation(impl, L, "rotvec"));
  const Vec3 v = spatial::rotation_log(r);
  push_array(impl, L, NumericArray({v[0], v[1], v[2]}, "rad"));
  return 1;
}
Result<int> rotation_exp(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Vector v, need_vector(impl, L, 1, 3, "the argument of rotation"));
  if (!v.allFinite()) return misuse("the rotation vector has a number that is not finite");
  push_rotation(impl, L, spatial::rotation_exp({v[0], v[1], v[2]}));
  return 1;
}
Result<int> to_quaternion(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const auto r, need_rotation(impl, L, "quaternion"));
  const spatial::Quaternion q = spatial::to_quaternion(r);
  push_array(impl, L, NumericArray({q.w, q.x, q.y, q.z}));
  return 1;
}
Result<int> from_quaternion(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Vector v, need_vector(impl, L, 1, 4, "the argument of from_quaternion"));
  const double length = v.stableNorm();
  if (!(length > 0) || !std::isfinite(length))
    return misuse("a quaternion of length " + text::print_rounded(length) + " is not a rotation",
                  "Give {w, x, y, z}.");
  const Vector q = v / length;
  push_rotation(impl, L, spatial::from_quaternion({q[0], q[1], q[2], q[3]}));
  return 1;
}

/// T:adjoint(): 6x6 of twists (v, w), moved to T's parent frame and its origin.
Result<int> adjoint(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Pose pose, need_pose(impl, L));
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(pose.R.data());
  const Eigen::Vector3d p(pose.p[0], pose.p[1], pose.p[2]);
  Matrix m = Matrix::Zero(6, 6);
  m.topLeftCorner(3, 3) = r;
  m.bottomRightCorner(3, 3) = r;
  for (Eigen::Index j = 0; j < 3; ++j) m.topRightCorner(3, 3).col(j) = p.cross(r.col(j));
  push_matrix(impl, L, m);
  return 1;
}

/// T:apply(points): each row of an nx3 matrix as a point.
Result<int> apply(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Operand points, operand(impl, L, 2));
  RMP_TRY_ASSIGN(const Pose pose, need_pose(impl, L));
  if (points.is_vector ? points.m.rows() != 3 : points.m.cols() != 3)
    return misuse(points.shape() + " is not a list of points",
                  "Give a vector of 3, or a matrix with one point of 3 per row.");
  Matrix out = points.m;
  for (Eigen::Index i = 0; i < out.size() / 3; ++i) {
    double* const x = out.data() + 3 * i;
    const Vec3 moved = spatial::transform(pose, {x[0], x[1], x[2]});
    std::copy(moved.begin(), moved.end(), x);
  }
  push_shaped(impl, L, out, points.is_vector, points.unit);
  return 1;
}

double sign_of(double x) { return x > 0 ? 1.0 : x < 0 ? -1.0 : x; }

/// `is_method`: of arrays too.
struct Named {
  const char* name;
  lua_CFunction function;
  bool is_method;
};
constexpr Named kFunctions[] = {
    {"abs", entry<elementwise<std::fabs, true>>, true},
    {"acos", entry<elementwise<std::acos>>, true},
    {"adjoint", entry<adjoint>, true},
    {"apply", entry<apply>, true},
    {"asin", entry<elementwise<std::asin>>, true},
    {"atan", entry<elementwise<std::atan>>, true},
    {"ceil", entry<elementwise<std::ceil, true>>, true},
    {"chol", entry<chol>, true},
    {"columns", entry<stack_columns>, false},
    {"cond", entry<cond>, true},
    {"cos", entry<elementwise<std::cos>>, true},
    {"cross", entry<cross>, true},
    {"det", entry<det>, true},
    {"diagonal", entry<diagonal>, true},
    {"eig", entry<eig>, true},
    {"exp", entry<elementwise<std::exp>>, true},
    {"floor", entry<elementwise<std::floor, true>>, true},
    {"from_quaternion", entry<from_quaternion>, false},
    {"identity", entry<identity>, false},
    {"inverse", entry<inverse>, true},
    {"kron", entry<kron>, true},
    {"linspace", entry<linspace>, false},
    {"log", entry<elementwise<std::log>>, true},
    {"lstsq", entry<lstsq>, true},
    {"lu", entry<lu>, true},
    {"map", entry<map>, true},
    {"mean", entry<mean>, true},
    {"norm", entry<norm>, true},
    {"ones", entry<ones>, false},
    {"outer", entry<outer>, true},
    {"over", entry<over>, true},
    {"pinv", entry<pinv>, true},
    {"pow", entry<power>, true},
    {"qr", entry<qr>, true},
    {"quaternion", entry<to_quaternion>, true},
    {"rank", entry<rank>, true},
    {"reshape", entry<reshape>, true},
    {"rotation", entry<rotation_exp>, false},
    {"rotvec", entry<rotation_log>, true},
    {"rows", entry<stack_rows>, false},
    {"sign", entry<elementwise<sign_of>>, true},
    {"sin", entry<elementwise<std::sin>>, true},
    {"skew", entry<skew>, true},
    {"solve", entry<solve>, true},
    {"sqrt", entry<elementwise<std::sqrt>>, true},
    {"sub", entry<sub>, true},
    {"sum", entry<sum>, true},
    {"svd", entry<svd>, true},
    {"tan", entry<elementwise<std::tan>>, true},
    {"times", entry<times>, true},
    {"trace", entry<trace>, true},
    {"zeros", entry<zeros>, false},
};

}  // namespace

void open_linear_algebra(lua_State* L) {
  lua_createtable(L, 0, static_cast<int>(std::size(kFunctions)));
  push_array_methods(L);
  for (const Named& f : kFunctions) {
    lua_pushcfunction(L, f.function);
    if (f.is_method) {
      lua_pushvalue(L, -1);
      lua_setfield(L, -3, f.name);
    }
    lua_setfield(L, -3, f.name);
  }
  lua_pop(L, 1);
  lua_setglobal(L, "linalg");
}

}  // namespace robomosp::lua

// SPDX-License-Identifier: Apache-2.0
// `linalg` of scripts against its defining identities, on random, singular, badly scaled and wrong
// arguments.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "kernel/text.h"
#include "support/lua_program.h"

namespace robomosp {
namespace {

class LinearAlgebra : public test::LuaProgramTest {
 protected:
  /// The one number that `code` answers; the sentence of an error fails the test.
  double number(const std::string& code) {
    const auto values = state_->eval_values(code);
    EXPECT_TRUE(values.ok()) << code << "\n" << (values.ok() ? "" : values.error().sentence());
    if (!values.ok() || values->empty() || !values->front().is_number()) return NAN;
    return values->front().number();
  }
  /// A random matrix as a script writes it.
  std::string matrix(std::size_t rows, std::size_t cols, double scale = 1) {
    std::normal_distribution<double> normal;
    std::string s = "array{";
    for (std::size_t i = 0; i < rows; ++i) {
      s += "{";
      for (std::size_t j = 0; j < cols; ++j)
        s += std::to_string(normal(random_)) + "*" + text::print(scale) + ",";
      s += "},";
    }
    return s + "}";
  }
  std::mt19937_64 random_{7};
};

TEST_F(LinearAlgebra, DecompositionsGiveTheirMatrixBack) {
  run("function far(a, b) return (a - b):norm(\"inf\") / (1e-300 + a:norm(\"inf\")) end");
  for (const double scale : {1.0, 1e-150, 1e150, 1e-300, 1e300})
    for (const std::size_t n : {1u, 2u, 3u, 6u, 17u, 40u}) {
      const std::string a = matrix(n, n, scale);
      SCOPED_TRACE(std::to_string(n) + " " + text::print(scale));
      run("A = " + a + " I = linalg.identity(" + std::to_string(n) + ")");
      const double tol = 1e-10 * static_cast<double>(n);
      if (scale > 1e-200 && scale < 1e200) {
        EXPECT_LT(number("far(I, A * A:inverse())"), tol);
        EXPECT_LT(number("far(A, A * A:pinv() * A)"), tol);
      }
      EXPECT_LT(number("(function() local b = A * linalg.ones(#A) "
                       "return (A:solve(b) - linalg.ones(#A)):norm() end)()"),
                tol);
      EXPECT_LT(number("(function() local u, s, v = A:svd() "
                       "return far(A, u * s:diagonal() * v:transpose()) end)()"),
                tol);
      EXPECT_LT(number("(function() local q, r = A:qr() return far(A, q * r) + "
                       "far(I, q:transpose() * q) end)()"),
                tol);
      EXPECT_LT(number("(function() local l, u, p = A:lu() return far(p * A, l * u) end)()"), tol);
      if (scale < 1e100 && scale > 1e-100) {
        EXPECT_LT(number("(function() local S = A * A:transpose() + I local l = S:chol() "
                         "return far(S, l * l:transpose()) end)()"),
                  tol);
        EXPECT_LT(number("(function() local S = A + A:transpose() local w, v = S:eig() "
                         "return far(S * v, v * w:diagonal()) end)()"),
                  tol);
      }
    }
}

TEST_F(LinearAlgebra, GeneralEigenvaluesAreThoseOfTheirVectors) {
  // Rotation by 30 degrees: cos +- i sin. Companion matrix of (x-1)(x-2)(x-3): 1, 2, 3.
  EXPECT_LT(number("(function() local w = rpy(0, 0, pi / 6):sub(1, 2, 1, 2):eig() return "
                   "(w - array{{math.cos(pi/6), -0.5}, {math.cos(pi/6), 0.5}}):norm() + "
                   "0 end)()"),
            2 + 1e-12);
  EXPECT_LT(number("(linalg.eig{{6, -11, 6}, {1, 0, 0}, {0, 1, 0}} - array{1, 2, 3}):norm()"),
            1e-12);
  for (int round = 0; round < 20; ++round) {
    run("A = " + matrix(7, 7));
    // A (x + iy) = (a + ib)(x + iy)
    EXPECT_LT(number("(function() local w, x, y = A:eig() local worst = 0 "
                     "for k = 1, 7 do "
                     "local a = y and w[k][1] or w[k] local b = y and w[k][2] or 0 "
                     "local u = x:col(k) local v = y and y:col(k) or 0 * u "
                     "worst = math.max(worst, (A * u - (a * u - b * v)):norm(), "
                     "(A * v - (a * v + b * u)):norm()) end return worst end)()"),
              1e-12);
  }
}

TEST_F(LinearAlgebra, RankLeastSquaresAndConditionOfSingularMatrices) {
  EXPECT_EQ(number("linalg.rank{{1, 2}, {2, 4}}"), 1);
  EXPECT_EQ(number("linalg.zeros(3, 2):rank()"), 0);
  EXPECT_EQ(number("linalg.rank({{1, 0}, {0, 1e-9}}, 1e-6)"), 1);
  EXPECT_EQ(number("linalg.cond{{1, 2}, {2, 4}} > 1e15 and 1 or 0"), 1);
  // A line through (0, 1), (1, 3), (2, 5), (3, 7.2): slope 2.06, from the normal equations.
  EXPECT_NEAR(number("linalg.lstsq({{0, 1}, {1, 1}, {2, 1}, {3, 1}}, {1, 3, 5, 7.2})[1]"), 2.06,
              1e-12);
  // The shortest of all solutions of x + y = 2.
  EXPECT_NEAR(number("(linalg.lstsq({{1, 1}}, {2}) - array{1, 1}):norm()"), 0, 1e-12);
  // Hilbert matrix of order 8: a published determinant (Choi, 1983): 2.737050e-33.
  EXPECT_NEAR(number("(function() local r = {} for i = 1, 8 do r[i] = {} for j = 1, 8 do "
                     "r[i][j] = 1 / (i + j - 1) end end return linalg.det(r) * 1e33 end)()"),
              2.737050, 1e-5);
  EXPECT_EQ(number("linalg.det{{1e200, 0, 0}, {0, 1e200, 0}, {0, 0, 1e-300}}"), 1e100);
  EXPECT_EQ(number("linalg.solve({{1e-200, 0}, {0, 1e200}}, {1e-200, 1e200})[1]"), 1);
}

TEST_F(LinearAlgebra, WrongArgumentsAreNamedWithTheirDimensions) {
  const std::pair<const char*, const char*> cases[] = {
      {"linalg.det{{1, 2, 3}, {4, 5, 6}}", "det needs a square matrix, not a 2x3 matrix"},
      {"linalg.inverse{{1, 2}, {2, 4}}", "the 2x2 matrix is singular: its rank is 1"},
      {"linalg.solve({{1, 2}, {3, 4}}, {1, 2, 3})",
       "a 2x2 matrix and a vector of 3 do not form equations"},
      {"linalg.solve({{1, 2, 3}, {3, 4, 5}}, {1, 2})", "A:lstsq(b)"},
      {"linalg.chol{{1, 2}, {2, 1}}", "leading minor of order 2 is not positive"},
      {"linalg.chol{{1, 2}, {0, 1}}", "chol needs a symmetric matrix"},
      {"linalg.cross({1, 2}, {3, 4})", "two vectors of 3, not a vector of 2"},
      {"array{1, 2}:det()", "det needs a matrix, not a vector of 2"},
      {"linalg.det{{1, 0/0}, {3, 4}}", "entry (1, 2) is"},
      {"linalg.svd{{1/0}}", "entry (1, 1) is inf"},
      {"array{1, 2, 3}:sub(2, 4)", "there is no entry 4; they are numbered from 1 to 3"},
      {"linalg.identity(3):sub(1, 2, 0, 2)", "there is no column 0"},
      {"array{1, 2, 3}:reshape(2, 2)", "a vector of 3 has 3 numbers, not 4"},
      {"array{1, 2}:times(array{1, 2, 3})", "cannot be multiplied entry by entry"},
      {"linalg.rows{{1, 2}, {1, 2, 3}}", "part 2 of linalg.rows is 3 wide, the first one 2"},
      {"linalg.zeros(1e9, 1e9)", "is not a whole number"},
      {"linalg.zeros(100000, 100000)", "more than the"},
      {"linalg.zeros(1.5)", "is not a whole number"},
      {"linalg.zeros(1100, 1100):svd()", "up to 1000x1000"},
      {"array{1, 2}:norm(3)", "Kinds are 1, 2"},
      {"linalg.det(5)", "an array is expected, not number"},
      {"linalg.det()", "an array is expected, not nothing"},
      {"array{1, 2}:map(tostring)", "not a number"},
      {"linalg.rotvec{{1, 0, 0}, {0, 1, 0}, {0, 0, 2}}", "the matrix is not a rotation"},
      {"linalg.from_quaternion{0, 0, 0, 0}", "is not a rotation"},
      // A 4x4 matrix that is no pose is inverted as a matrix, not as a pose.
      {"linalg.adjoint{{2, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}", "is not a pose"},
  };
  for (const auto& [code, sentence] : cases)
    EXPECT_NE(eval(code).find(sentence), std::string::npos) << code << "\n" << eval(code);
  EXPECT_EQ(number("linalg.inverse{{2, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}[1][1]"),
            0.5);
}

TEST_F(LinearAlgebra, PosesMoveRotationsPointsAndTwists) {
  run("T = pose(0.1, -0.2, 0.3, rpy(0.3, -0.4, 0.5)) S = pose(1, 2, 3, rpy(1, 0.2, -2))");
  EXPECT_LT(number("(T * S * array{1, 2, 3} - T * (S * array{1, 2, 3})):norm()"), 1e-14);
  EXPECT_LT(number("(T * rpy(0.1, 0.2, 0.3) - T * pose(0, 0, 0, rpy(0.1, 0.2, 0.3))):norm()"),
            1e-15);
  EXPECT_LT(number("(rpy(0.1, 0.2, 0.3) * T - pose(0, 0, 0, rpy(0.1, 0.2, 0.3)) * T):norm()"),
            1e-15);
  EXPECT_LT(number("(T:inverse() * T - linalg.identity(4)):norm()"), 1e-15);
  // Twist: the velocity (d/dt T exp(t xi)) at t = 0 by differences, against T * xi.
  run("xi = array{0.3, -0.2, 0.7, 0.5, 0.4, -0.6}");
  EXPECT_LT(number("(T:adjoint() * xi - T * xi):norm()"), 1e-15);
  // A point fixed to the moved frame: w x p + v in the parent frame.
  EXPECT_LT(number("(function() local m = T * xi local p = array{0.4, 0.1, -0.3} "
                   "local inside = xi:sub(4, 6):cross(p) + xi:sub(1, 3) "
                   "local outside = m:sub(4, 6):cross(T * p) + m:sub(1, 3) "
                   "return (T:sub(1, 3, 1, 3) * inside - outside):norm() end)()"),
            1e-14);
  EXPECT_LT(number("(linalg.rotation(T:rotvec()) - T:sub(1, 3, 1, 3)):norm()"), 1e-14);
  EXPECT_LT(number("(linalg.from_quaternion(T:quaternion()) - T:sub(1, 3, 1, 3)):norm()"), 1e-14);
  EXPECT_LT(number("(array{1, 2, 3}:skew() * array{3, 1, 2} - "
                   "array{1, 2, 3}:cross{3, 1, 2}):norm()"),
            1e-15);
  EXPECT_LT(number("(T:apply{{1, 2, 3}, {4, 5, 6}}[2] - T * array{4, 5, 6}):norm()"), 1e-15);
}

TEST_F(LinearAlgebra, PartsShapesUnitsAndEntryByEntry) {
  EXPECT_EQ(eval("array{1, 2, 3, 4}:sub(2, -2), array{{1, 2}, {3, 4}}:sub(2, 2, 1, 1)"),
            "{2, 3}\n[3]");
  EXPECT_EQ(eval("linalg.rows{{1, 2}, array{{3, 4}, {5, 6}}}:col(2), "
                 "linalg.columns{{1, 2}, {3, 4}}[1]"),
            "{2, 4, 6}\n{1, 3}");
  EXPECT_EQ(eval("array{1, 2, 3, 4}:reshape(2, 2)[2], linalg.diagonal{1, 2}[2], "
                 "linalg.identity(2):diagonal(), linalg.linspace(0, 1, 5)"),
            "{3, 4}\n{0, 2}\n{1, 1}\n{0, 0.25, 0.5, 0.75, 1}");
  EXPECT_EQ(eval("array({3, -4}, 'm'):abs(), array({3, 4}, 'm'):times(array({1, 2}, 'N')), "
                 "array({3, 4}, 'm'):over(array({1, 2}, 's'))"),
            "{3, 4} m\n{3, 8} N m\n{3, 2} m/s");
  EXPECT_EQ(eval("array{1, 4, 9}:sqrt(), array{1, 2}:pow(3), array{1, 2}:map(function(x) return "
                 "x + 1 end), array{{1, 2}, {3, 4}}:map(function(x) return 10 * x end)[1]"),
            "{1, 2, 3}\n{1, 8}\n{2, 3}\n{10, 20}");
  EXPECT_EQ(eval("array{1, 2, 3}:sum(), array{1, 2, 3}:mean(), linalg.trace{{1, 2}, {3, 4}}, "
                 "linalg.kron({{1, 2}}, {{1}, {1}})[2], linalg.outer({1, 2}, {3, 4})[2]"),
            "6\n2\n5\n{1, 2}\n{6, 8}");
  EXPECT_EQ(eval("array{3, -4}:norm(), array{3, -4}:norm(1), array{3, -4}:norm('inf'), "
                 "linalg.norm({{3, 0}, {0, 4}}, 2), linalg.norm({{3, 0}, {0, 4}}, 'fro'), "
                 "array{3e200, 4e200}:norm()"),
            "5\n7\n4\n4\n5\n5e+200");
}

TEST_F(LinearAlgebra, EveryFunctionHasHelp) {
  run("missing = {} for name in pairs(linalg) do "
      "if not help('linalg'):find('%f[%w_]' .. name .. '%f[^%w_]') then "
      "missing[#missing + 1] = name end end");
  EXPECT_EQ(eval("table.concat(missing, ' ')"), "");
  EXPECT_EQ(eval("help(linalg) == help 'linalg'"), "true");
}

}  // namespace
}  // namespace robomosp

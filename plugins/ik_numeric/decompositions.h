// SPDX-License-Identifier: Apache-2.0
// The one home of the decompositions that the search uses: each takes seconds to compile.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::LDLT<Eigen::MatrixXd>;
extern template class Eigen::PartialPivLU<Eigen::MatrixXd>;

// SPDX-License-Identifier: Apache-2.0
// The one home of Eigen's large decompositions: compiled once, in decompositions.cpp, since each takes
// seconds to compile wherever it is used (layer: data processing, robotics).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>

extern template class Eigen::JacobiSVD<Eigen::MatrixXd>;
extern template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
extern template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
extern template class Eigen::LDLT<Eigen::MatrixXd>;

// SPDX-License-Identifier: Apache-2.0
#include "robotics/decompositions.h"

template class Eigen::JacobiSVD<Eigen::MatrixXd>;
template class Eigen::ColPivHouseholderQR<Eigen::MatrixXd>;
template class Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
template class Eigen::LDLT<Eigen::MatrixXd>;

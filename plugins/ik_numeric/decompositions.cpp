// SPDX-License-Identifier: Apache-2.0
#include "decompositions.h"

template class Eigen::JacobiSVD<Eigen::MatrixXd>;
template class Eigen::LDLT<Eigen::MatrixXd>;
template class Eigen::PartialPivLU<Eigen::MatrixXd>;

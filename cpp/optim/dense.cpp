// SPDX-License-Identifier: MIT
#include "optim/dense.h"

#include <Eigen/Eigenvalues>

namespace sdftrack::optim {

template <int N>
Eigenpairs<N> eigenpairs(const Eigen::Matrix<double, N, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template Eigenpairs<3> eigenpairs<3>(const Eigen::Matrix3d&);
template Eigenpairs<Eigen::Dynamic> eigenpairs<Eigen::Dynamic>(const Eigen::MatrixXd&);
template Eigenpairs<6> eigenpairs<6>(const Eigen::Matrix<double, 6, 6>&);

}  // namespace sdftrack::optim

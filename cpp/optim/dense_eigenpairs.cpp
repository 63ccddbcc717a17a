// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>

#include "optim/dense.h"

namespace sdftrack::optim {

template <int N>
Eigenpairs<N> eigenpairs(const Eigen::Matrix<double, N, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}
template Eigenpairs<3> eigenpairs(const Eigen::Matrix3d&);
template Eigenpairs<6> eigenpairs(const Eigen::Matrix<double, 6, 6>&);
template Eigenpairs<Eigen::Dynamic> eigenpairs(const Eigen::MatrixXd&);

}  // namespace sdftrack::optim

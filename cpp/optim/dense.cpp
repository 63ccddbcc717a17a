// SPDX-License-Identifier: MIT
#include "optim/dense.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace sdftrack::optim {

template <int N, int M>
Eigen::Matrix<double, N, M> solve_symmetric(const Eigen::Matrix<double, N, N>& A,
                                            const Eigen::Matrix<double, N, M>& B) {
  return A.ldlt().solve(B);
}

template <int N>
Eigenpairs<N> eigenpairs(const Eigen::Matrix<double, N, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

#define SDFTRACK_SOLVE(N, M)                                                                     \
  template Eigen::Matrix<double, N, M> solve_symmetric<N, M>(const Eigen::Matrix<double, N, N>&, \
                                                             const Eigen::Matrix<double, N, M>&);
SDFTRACK_SOLVE(3, 1)
SDFTRACK_SOLVE(3, 3)
SDFTRACK_SOLVE(4, 1)
SDFTRACK_SOLVE(5, 1)
SDFTRACK_SOLVE(5, 6)
SDFTRACK_SOLVE(6, 1)
SDFTRACK_SOLVE(6, 6)
SDFTRACK_SOLVE(6, 7)
SDFTRACK_SOLVE(6, Eigen::Dynamic)
SDFTRACK_SOLVE(7, 1)
SDFTRACK_SOLVE(7, 7)
SDFTRACK_SOLVE(9, 1)
#undef SDFTRACK_SOLVE

template Eigenpairs<3> eigenpairs<3>(const Eigen::Matrix3d&);
template Eigenpairs<Eigen::Dynamic> eigenpairs<Eigen::Dynamic>(const Eigen::MatrixXd&);
template Eigenpairs<6> eigenpairs<6>(const Eigen::Matrix<double, 6, 6>&);

}  // namespace sdftrack::optim

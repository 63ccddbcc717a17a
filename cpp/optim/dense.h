// SPDX-License-Identifier: MIT
// Small dense systems: Eigen's decompositions, compiled once for every size that is used (dense_solve_*.cpp,
// dense_eigenpairs.cpp), because each instantiation takes seconds to compile.
#pragma once

#include <Eigen/Core>

namespace sdftrack::optim {

// X of A X = B, A symmetric and positive semidefinite: by L D L^T with pivots.
template <int N, int M>
Eigen::Matrix<double, N, M> solve_symmetric(const Eigen::Matrix<double, N, N>& A,
                                            const Eigen::Matrix<double, N, M>& B);

template <int N>
Eigen::Matrix<double, N, N> inverse_symmetric(const Eigen::Matrix<double, N, N>& A) {
  return solve_symmetric<N, N>(A, Eigen::Matrix<double, N, N>::Identity(A.rows(), A.cols()));
}

// Eigenpairs of a symmetric matrix, in increasing order; the vectors are columns.
template <int N>
struct Eigenpairs {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};
template <int N>
Eigenpairs<N> eigenpairs(const Eigen::Matrix<double, N, N>& A);

}  // namespace sdftrack::optim

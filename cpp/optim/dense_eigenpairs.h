// SPDX-License-Identifier: MIT
// The definition behind dense.h, for the files that instantiate it.
#pragma once

#include <Eigen/Eigenvalues>

#include "optim/dense.h"

namespace sdftrack::optim {

template <int N>
Eigenpairs<N> eigenpairs(const Eigen::Matrix<double, N, N>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace sdftrack::optim

#define SDFTRACK_EIGENPAIRS(N) template Eigenpairs<N> eigenpairs<N>(const Eigen::Matrix<double, N, N>&);

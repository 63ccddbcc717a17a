// SPDX-License-Identifier: MIT
// The definition behind dense.h, for the files that instantiate it. Each file has a few sizes: all in one
// file would take more than a gigabyte to compile.
#pragma once

#include <Eigen/Cholesky>

#include "optim/dense.h"

namespace sdftrack::optim {

template <int N, int M>
Eigen::Matrix<double, N, M> solve_symmetric(const Eigen::Matrix<double, N, N>& A,
                                            const Eigen::Matrix<double, N, M>& B) {
  if constexpr (M == Eigen::Dynamic) {
    if (B.cols() == 0) return B;  // Eigen would read the first coefficient of B
  }
  return A.ldlt().solve(B);
}

}  // namespace sdftrack::optim

#define SDFTRACK_SOLVE(N, M)                                                                     \
  template Eigen::Matrix<double, N, M> solve_symmetric<N, M>(const Eigen::Matrix<double, N, N>&, \
                                                             const Eigen::Matrix<double, N, M>&);

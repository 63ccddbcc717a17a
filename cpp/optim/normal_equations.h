// SPDX-License-Identifier: MIT
// The quadratic model of an energy at a state: cost + gradient . d + d^T hessian d / 2.
#pragma once

#include <Eigen/Core>

namespace sdftrack::optim {

struct NormalEquations {
  Eigen::MatrixXd hessian;  // positive semi-definite approximation, full symmetric matrix
  Eigen::VectorXd gradient;
  double cost = 0;
  double count = 0;  // pixels that contributed

  void reset(int n) {
    hessian.setZero(n, n);
    gradient.setZero(n);
    cost = count = 0;
  }
  void add(const NormalEquations& other, double weight) {
    hessian += weight * other.hessian;
    gradient += weight * other.gradient;
    cost += weight * other.cost;
    count += other.count;
  }
};

}  // namespace sdftrack::optim

// SPDX-License-Identifier: MIT
#include "optim/prior.h"

#include <Eigen/Core>

#include "optim/prior_terms.h"

namespace sdftrack::optim {

PosePrior::Matrix6d PosePrior::isotropic(double sigma_m, double sigma_rad) {
  const auto information = [](double sigma) { return sigma > 0 ? 1 / (sigma * sigma) : 0.0; };
  Eigen::Matrix<double, 6, 1> diagonal;
  diagonal.head<3>().setConstant(information(sigma_m));
  diagonal.tail<3>().setConstant(information(sigma_rad));
  return diagonal.asDiagonal();
}

PriorTerm PosePrior::term() const {
  PriorTerm out;
  out.given = true, out.T_prior_inverse = inverse(T_prior_);
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) out.information[a][b] = information_(a, b);
  return out;
}

double PosePrior::cost(const State& x) {
  const Rigidd D = x.T_obj_cam[object_] * inverse(T_prior_);
  Eigen::Matrix<double, 6, 1> e;
  prior_error(D, e.data());
  return 0.5 * e.dot(information_ * e);
}

void PosePrior::linearize(const State& x, NormalEquations* out) {
  PriorRow row;
  prior_row(x.T_obj_cam[object_] * inverse(T_prior_), &row);
  const Eigen::Matrix<double, 6, 1> e = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(row.e);
  const Eigen::Matrix<double, 6, 6> J =
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(row.J[0]);
  const int at = unknowns_.object_offset(object_);
  out->hessian.block<6, 6>(at, at) += J.transpose() * information_ * J;
  out->gradient.segment<6>(at) += J.transpose() * (information_ * e);
  out->cost += 0.5 * e.dot(information_ * e);
}

}  // namespace sdftrack::optim

// SPDX-License-Identifier: MIT
#include "tracking/size/size_look.h"

#include "optim/dense.h"

namespace sdftrack::tracking {

Eigen::Matrix3d strain_matrix(const Strain& s) {
  const double half = std::sqrt(0.5), sixth = std::sqrt(1 / 6.0);
  Eigen::Matrix3d m;
  m << half * s[0] + sixth * s[1], half * s[2], half * s[3],  //
      half * s[2], -half * s[0] + sixth * s[1], half * s[4],  //
      half * s[3], half * s[4], -2 * sixth * s[1];
  return m;
}

Strain strains(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double half = std::sqrt(0.5), sixth = std::sqrt(1 / 6.0);
  Strain s;
  s << half * (a[0] * b[0] - a[1] * b[1]), sixth * (a[0] * b[0] + a[1] * b[1] - 2 * a[2] * b[2]),
      half * (a[0] * b[1] + a[1] * b[0]), half * (a[0] * b[2] + a[2] * b[0]),
      half * (a[1] * b[2] + a[2] * b[1]);
  return s;
}

// Of a stretch by s along u, the part of trace 0 is s (u u^T - I / 3); u^T times that times u is 2 s / 3.
Strain stretch_weights(const Eigen::Vector3d& axis) {
  Strain w;
  for (int k = 0; k < kStrainModes; ++k) w[k] = 1.5 * axis.dot(strain_matrix(Strain::Unit(k)) * axis);
  return w;
}

StrainLook::Stretch StrainLook::largest() const {
  const optim::Eigenpairs<3> axes = optim::eigenpairs(strain_matrix(strain));
  int at = 0;
  axes.values.cwiseAbs().maxCoeff(&at);
  const Eigen::Vector3d axis = axes.vectors.col(at);
  const Strain w = stretch_weights(axis);
  return {axis, w.dot(strain), std::sqrt(w.dot((own_cov + shared_cov) * w))};
}

}  // namespace sdftrack::tracking

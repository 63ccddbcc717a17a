// SPDX-License-Identifier: MIT
// What one frame shows of an object's size relative to its model.
#pragma once

#include <cmath>

#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

// Greatest spread of the residuals, relative to before, that is left by a size that caused them.
constexpr double kExplained = 0.5;

// From one frame, with the pose estimated too.
struct SizeLook {
  double log_scale = 0;              // of the object over the model
  double own_var = 0;                // by errors of this frame alone
  double shared_var = 0;             // by errors that last as long as the view does
  Vector6d pull = Vector6d::Zero();  // increment of T_obj_cam that follows a log scale of 1
  double unexplained = 1;            // spread of the residuals at that size over that at the model's size

  double sd() const { return std::sqrt(own_var + shared_var); }
};

// From least squares x with covariance C of the pose (0 to 5), the log scale (6) and others: the pose's
// response to the log scale has all others eliminated.
template <int N>
SizeLook size_look(int k, const Eigen::Matrix<double, N, 1>& x, const Eigen::Matrix<double, N, N>& C,
                   double own_var, double shared_var) {
  return {x[k], own_var, shared_var, C.col(k).template head<6>() / C(k, k)};
}

// A strain of the model, of trace 0: its stretch in addition to its size. In the basis of the symmetric
// matrices (xx - yy) / sqrt(2), (xx + yy - 2 zz) / sqrt(6), sqrt(2) xy, sqrt(2) xz, sqrt(2) yz.
constexpr int kStrainModes = 5;
using Strain = Eigen::Matrix<double, kStrainModes, 1>;
using StrainCovariance = Eigen::Matrix<double, kStrainModes, kStrainModes>;

Eigen::Matrix3d strain_matrix(const Strain& strain);
// d^T E q for each strain E of the basis.
Strain strains(const Eigen::Vector3d& d, const Eigen::Vector3d& q);
// Weights of a strain that give the log stretch along a unit axis relative to that across it.
Strain stretch_weights(const Eigen::Vector3d& axis);

// Normal equations of a strain, pose and size eliminated; few directions may be determined.
struct StrainInformation {
  StrainCovariance information = StrainCovariance::Zero();
  Strain pull = Strain::Zero();
};

// From one frame, with pose and size estimated too: variances as in SizeLook.
struct StrainLook {
  Strain strain = Strain::Zero();
  StrainCovariance own_cov = StrainCovariance::Zero(), shared_cov = StrainCovariance::Zero();
  double unexplained = 1;  // spread of the remaining residuals over the noise

  // The axis of the largest strain, the log stretch along it relative to that across it, and its sd.
  struct Stretch {
    Eigen::Vector3d axis;
    double log_stretch, sd;
  };
  Stretch largest() const;
};

}  // namespace sdftrack::tracking

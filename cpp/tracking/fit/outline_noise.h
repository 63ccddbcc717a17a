// SPDX-License-Identifier: MIT
// How far the outline's lines may be believed beside the readings of depth (docs/math/outline.md, section 4).
#pragma once

#include <vector>

#include "energies/outline_energy.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

struct OutlineNoise {
  double factor = 0;        // size of the lines' residuals over their stated sd; 0: not measured
  double shared_lines = 0;  // how many neighbouring lines share one error
  // By how much the depth's covariance is too small, by the distance of the pose that depth asks for from the
  // one that the outline asks for.
  double depth_excess = 1;
};

// What two modalities say near one pose: Hessian, the sum of squared gradients, gradient.
struct Voices {
  Matrix6d depth_A, depth_B;  // of one reading each, independent
  double area_px;             // readings that share one error
  Matrix6d outline_H;
  Eigen::Matrix<double, 6, 1> outline_g;
  Eigen::Matrix<double, 6, 1> outline_bias;  // gradient of what all lines may err in common
  double outline_weight;                     // with which the pose was found
};

// Of the residuals that are left at the outline's own best pose: what depth asks for is no noise of the
// outline. `factor` 0 where there are too few lines.
OutlineNoise outline_noise(const energies::OutlineLines& lines, const Rigidd& T_obj_cam,
                           std::vector<energies::OutlineResidual>* scratch);

// Blur, exposure and a rounded edge move all of an outline outwards or inwards together: so much is not told
// by the scatter of its lines. noise: as in OutlineEnergy.
constexpr double kCommonError_px = 0.3;
Eigen::Matrix<double, 6, 1> common_error(const energies::OutlineLines& lines, const Rigidd& T_obj_cam,
                                         double noise, std::vector<energies::OutlineResidual>* scratch);

// The factor on the depth's covariance with which the two agree as well as chance has it (as
// DerSimonian and Laird estimate what varies between studies): 1 unless they are surely apart.
double depth_excess(const Voices& voices, double shared_lines, const Matrix6d& prior);

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// Robust fit of a map and of the colour images' delay, without outliers; covariance (thesis Eq. 3.26).
#pragma once

#include "calibration/registration/map_residuals.h"

namespace sdftrack::calibration {

// Quantile of a chi-square with two degrees of freedom: 0.1 % of true pairs are dropped.
constexpr double kDroppedChi2 = 13.82;

struct MapFit {
  DepthToColor map;
  double offset_s = 0;
  Eigen::MatrixXd covariance;  // over the map's unknowns, then the delay if it was estimated
  std::vector<Vec2d> residual_px;
  Chosen kept;
  // Of the variance: coordinates of kept pairs, minus unknowns, plus a constant for the stated noise.
  int freedom = 0;
};

// Each residual is whitened by the covariances of both centres. After each minimisation the scale of the
// residuals is estimated from their median, pairs beyond the 0.1 % quantile of a chi-square are rejected, and
// the minimisation is repeated until the set is stable. Pairs not `kept` at the start may be readmitted.
// path: nullptr if the delay is not estimated.
MapFit fit_map(const DepthToColor& start, const BallPairs& pairs, Chosen kept, const BallPath* path = nullptr,
               double offset_s = 0);

}  // namespace sdftrack::calibration

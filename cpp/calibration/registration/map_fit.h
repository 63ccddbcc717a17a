// SPDX-License-Identifier: MIT
// Robust fit of a map, and of the delay of colour, with outliers and the covariance (thesis Eq. 3.26).
#pragma once

#include "calibration/registration/map_residuals.h"

namespace sdftrack::calibration {

// Squared, of chi-square with two degrees of freedom: 0.1 % of true pairs are dropped.
constexpr double kDroppedChi2 = 13.82;

struct MapFit {
  DepthToColor map;
  double offset_s = 0;
  Eigen::MatrixXd covariance;  // of the map's unknowns, then of the delay if it was estimated
  std::vector<Vec2d> residual_px;
  Chosen kept;
  // Of the variance: coordinates of kept pairs less the unknowns, and what the stated noise counts for.
  int freedom = 0;
};

// Each residual is whitened by the covariances of both centres. After each minimisation the scale of the
// residuals is estimated from their median, pairs beyond the 0.1 % quantile of a chi-square are rejected, and
// the minimisation is repeated until the set is stable. Pairs not `kept` at the start may be readmitted.
// path: nullptr where the delay is not estimated.
MapFit fit_map(const DepthToColor& start, const BallPairs& pairs, Chosen kept, const BallPath* path = nullptr,
               double offset_s = 0);

}  // namespace sdftrack::calibration

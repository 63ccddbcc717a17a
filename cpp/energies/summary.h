// SPDX-License-Identifier: MIT
// Sums over an even subset of the pixels, from which a covariance is computed.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "energies/term_sums.h"

namespace sdftrack::energies {

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxUnknowns, kMaxUnknowns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxUnknowns, 1>;

// Sums at the final state for a covariance, from an even subset of the pixels, scaled up to all pixels. With
// psi = d cost / d residual: A = sum psi' J J^T, where psi' is replaced by the weight psi / residual times
// the mean psi' over the mean weight (a single pixel's psi' may be negative, and the sum of a weakly observed
// direction could vanish by chance). B = sum psi^2 J J^T. rounding = the gradient due to the interpolant's
// error. missed = the gradient of all pixels whose rays miss the model. geometry = the mean of J J^T (d phi /
// d unknowns) over the inliers: what the geometry determines, whatever the noise.
struct EnergySummary {
  SmallMatrix A, B, geometry;
  SmallVector rounding, missed;
  double inliers = 0;  // pixels of the subset with weight above one half
  // Robust sd of residual over noise scale, of the rays that meet the model; 0 if fewer than 20 do.
  double noise_m = 0;
  // With colours: mean cost of the depth penalty alone, each pixel weighted by its colour's posterior; and
  // the mean posterior of the pixels on the surface, -1 if there are none.
  double cost = 0, foreground = -1;
};

// `pixels`: the number of pixels that the sums stand for.
template <int P>
EnergySummary summary_of(const TermSums<P>& sums, int pixels) {
  constexpr double kMinSlope = 0.05;
  EnergySummary out;
  const double scale_up = sums.count > 0 ? double(pixels) / sums.count : 0;
  const auto matrix = [](const Sums<double, P>& s, double factor) {
    SmallMatrix M(P, P);
    for (int a = 0, k = 0; a < P; ++a)
      for (int b = 0; b <= a; ++b, ++k) M(a, b) = M(b, a) = factor * s.hessian[k];
    return M;
  };
  const auto vector = [](const Sums<double, P>& s, double factor) {
    return SmallVector(factor * Eigen::Map<const Eigen::Matrix<double, P, 1>>(s.gradient));
  };
  out.A = out.B = SmallMatrix::Zero(P, P);
  for (const auto& c : sums.classes) {
    if (!(c.weight > 0)) continue;
    const SmallMatrix JJ = matrix(c.JJ, scale_up / c.weight);
    out.A += std::max(kMinSlope * c.weight, c.curvature) * JJ;
    out.B += c.slope2 * JJ;
  }
  out.geometry = matrix(sums.inliers, sums.inliers.count > 0 ? 1 / sums.inliers.count : 0);
  out.rounding = vector(sums.inliers, scale_up);
  out.missed = vector(sums.missed, 1);
  out.inliers = sums.inliers.count;
  return out;
}

}  // namespace sdftrack::energies

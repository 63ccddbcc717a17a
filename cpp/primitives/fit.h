// SPDX-License-Identifier: MIT
// A solid fitted to a view: guesses, rigid at a given size, then pose and lengths together (thesis, 3.8).
#pragma once

#include <Eigen/Core>
#include <array>

#include "optim/lm.h"
#include "primitives/energies.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

constexpr int kFreedomWithoutMean =
    2;  // with this many degrees of freedom or fewer an estimated variance has no mean

struct PrimitiveFitOptions {
  Scaling scaling = Scaling::kExact;
  unsigned seed = 0;
  int max_points = 20000;  // in the last steps
  int max_rays = 1500;
  double tolerance_m = 0.003;  // of the solid's measurements up to 1 m; beyond, times Z^2
};

struct PrimitiveFit {
  PrimitiveKind kind = PrimitiveKind::kSphere;
  optim::State x;
  std::array<bool, sdf::kMaxSizes> bounded{};
  std::array<bool, sdf::kMaxSizes> far{};  // the length has reached its limit
  Eigen::MatrixXd covariance;  // over v, w (T_obj_cam's increment) and the logarithms of the sizes
  double scale_m = 0;          // s of the measurements' residuals
  double unit_m = 1;           // see PrimitiveEnergyOptions
  double rms_m = 0;            // of the measurements within the tolerance
  double inliers = 0;          // share of such measurements
  double outline = 1;          // share of the outline that agrees with the solid's
  int freedom = 0;             // measurements and outline pixels minus observable unknowns
  int steps = 0;               // trials of the optimiser
  bool found = false;

  PrimitiveSize size() const;
};

// Starts from guesses, or from `initial`, one pose and size.
PrimitiveFit fit_primitive(PrimitiveKind kind, const PrimitiveView& view, const SeedCloud& cloud,
                           const PrimitiveFitOptions& options, const PrimitiveGuess* initial);

// The share of measurements within the tolerance, and their rms, of all in the view.
void count_inliers(const PrimitiveView& view, const PrimitiveFitOptions& options, PrimitiveFit* fit);

}  // namespace sdftrack::primitives

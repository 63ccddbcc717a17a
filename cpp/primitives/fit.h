// SPDX-License-Identifier: MIT
// A solid fitted to a view: guesses, rigid at an arbitrary size, then pose and lengths together (thesis,
// section 3.8).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "optim/lm.h"
#include "primitives/energies.h"
#include "primitives/seeds.h"

namespace sdftrack::primitives {

constexpr int kUntold = 2;  // degrees of freedom, up to which a variance that is told by them has no mean

struct PrimitiveFitOptions {
  Scaling scaling = Scaling::kExact;
  unsigned seed = 0;
  int max_points = 20000;  // that the last steps look at
  int max_rays = 1500;
  double tolerance_m = 0.003;  // at up to 1 m, growing with the square of the depth: a reading of the solid
};

struct PrimitiveFit {
  PrimitiveKind kind = PrimitiveKind::kSphere;
  optim::State x;
  std::array<bool, sdf::kMaxSizes> bounded{false, false, false};
  std::array<bool, sdf::kMaxSizes> far{false, false, false};  // it ends at the limit that is set to it
  Eigen::MatrixXd covariance;  // of v, w (T_obj_cam's increment) and the logarithms of the lengths
  double scale_m = 0;          // s of the readings' residuals
  double rms_m = 0;            // of the readings within the tolerance
  double inliers = 0;          // their share
  double outline = 1;          // share of the picture's edge that is where the solid has its own
  int freedom = 0;             // readings and pixels of the outline more than there are unknowns that show
  int steps = 0;               // trials of the optimiser
  bool found = false;

  PrimitiveSize size() const;
};

// From guesses, or from one pose and size.
PrimitiveFit fit_primitive(PrimitiveKind kind, const PrimitiveView& view, const SeedCloud& cloud,
                           const PrimitiveFitOptions& options, const PrimitiveGuess* initial);

}  // namespace sdftrack::primitives

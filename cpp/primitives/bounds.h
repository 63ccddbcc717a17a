// SPDX-License-Identifier: MIT
// Which lengths a view bounds, and the covariance of all unknowns.
#pragma once

#include "primitives/fit.h"

namespace sdftrack::primitives {

// A length is bounded if the solid, grown by a third along it and moved to where it fits best, fits worse; an
// exponent if the solid with another one does.
void find_bounds(const PrimitiveView& view, const PrimitiveEnergyOptions& energy, optim::LmWork* work,
                 PrimitiveFit* fit);

// Sandwich covariance; directions without data have the variances of `diameter_m` and pi.
Eigen::MatrixXd fit_covariance(const PrimitiveView& view, const PrimitiveEnergyOptions& energy,
                               const PrimitiveFit& fit, double diameter_m);

// The covariance of T_cam_obj's increment, in the camera frame, and of the sizes (not their logarithms).
Eigen::MatrixXd camera_covariance(const PrimitiveFit& fit);

}  // namespace sdftrack::primitives

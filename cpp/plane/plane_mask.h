// SPDX-License-Identifier: MIT
// Which measurements of a depth image do not belong to a plane: docs/math/planes.md, section 4.
#pragma once

#include "plane/plane_fit.h"

namespace sdftrack::plane {

struct PlaneSlab {
  double tolerance_m = 0.01;  // least half thickness
  DepthNoise noise;
  double noise_scale = 1;  // times the law; 0: the tolerance alone
  bool feet = true;        // keep raised pixels beyond the noise that are connected to what stands out
};

// mask (width * height bytes): 1 where a measurement is not of the plane, 0 on it and where nothing was
// measured. The same bytes for any number of threads (0: all cores).
void mask_plane(const frame::DepthFrame& frame, const Camera& camera, const InversePlane& plane,
                const PlaneSlab& slab, int threads, unsigned char* mask);

}  // namespace sdftrack::plane

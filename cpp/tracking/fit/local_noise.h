// SPDX-License-Identifier: MIT
// The sensor's noise from the depth image alone, independent of the pose.
#pragma once

#include <vector>

#include "energies/pixel_set.h"

namespace sdftrack::tracking {

// Robust sd (m, at noise scale 1) of a pixel about the mean of its neighbours some pixels to the left and
// right. It excludes errors that neighbours share, so it is a lower bound of the noise; 0: too few pixels.
double local_noise_m(const energies::PixelSet& pixels, std::vector<float>* scratch);

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// The sensor's noise by the readings alone, whatever the pose.
#pragma once

#include <vector>

#include "energies/pixel_set.h"

namespace sdftrack::tracking {

// Robust sd (m, at noise scale 1) of a reading about the mean of its neighbours some pixels to the left and
// right. Errors that neighbours share are not in it, so it is what the noise is at least; 0: too few to tell.
double local_noise_m(const energies::PixelSet& pixels, std::vector<float>* scratch);

}  // namespace sdftrack::tracking

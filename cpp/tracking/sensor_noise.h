// SPDX-License-Identifier: MIT
// The sensor's noise as the tracker's options give it.
#pragma once

#include "tracking/options.h"
#include "tracking/region.h"

namespace sdftrack {

inline DepthNoiseLaw sensor_noise(const TrackerOptions& options) {
  return {options.noise_m, options.noise_per_m};
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// The sensor's noise as the tracker's options give it.
#pragma once

#include "frame/region.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

inline frame::DepthNoiseLaw sensor_noise(const TrackerOptions& options) {
  return {options.noise_m, options.noise_per_m};
}

// Sd of what a surface's readings have in common, as the options say.
inline double sensor_systematic_m(const TrackerOptions& options, double depth_m) {
  return options.systematic_m + options.systematic_per_m * depth_m * depth_m;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// The sensor's noise as the tracker's options give it.
#pragma once

#include "frame/region.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

inline frame::DepthNoiseLaw sensor_noise(const TrackerOptions& options) {
  return {options.noise_m, options.noise_per_m};
}

}  // namespace sdftrack::tracking

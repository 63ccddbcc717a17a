// SPDX-License-Identifier: MIT
// The sensor's noise as the tracker's options give it.
#pragma once

#include <algorithm>
#include <cmath>

#include "frame/region.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

inline frame::DepthNoiseLaw sensor_noise(const TrackerOptions& options) {
  return {options.noise_m, options.noise_per_m};
}

// Sd of the error that a surface's measurements share, as the options state it.
inline double sensor_systematic_m(const TrackerOptions& options, double depth_m) {
  return options.systematic_m + options.systematic_per_m * depth_m * depth_m;
}

inline double most_systematic_m(const TrackerOptions& options) {
  return std::max(options.systematic_m, options.max_systematic_m);
}

// Whether the options state nothing about errors that measurements share. max_systematic_m 0 states that
// there are none.
inline bool is_unstated(const TrackerOptions& options) {
  return !(options.systematic_m > 0 || options.systematic_per_m > 0) && options.max_systematic_m > 0;
}

// Sd of an error of the distance that no residual shows: the stated error beyond max_systematic_m, up to
// which measurements are tolerated. Where nothing is stated: that of a stereo camera within its maker's
// bound, 2 % at 2 m taken as two sd (data sheet of the RealSense D400 series).
inline double distance_error_m(const TrackerOptions& options, double depth_m) {
  if (is_unstated(options)) return 0.002 + 0.004 * depth_m * depth_m;
  const double stated_m = sensor_systematic_m(options, depth_m);
  const double excused_m = std::min(stated_m, most_systematic_m(options));
  return std::sqrt(stated_m * stated_m - excused_m * excused_m);
}

}  // namespace sdftrack::tracking

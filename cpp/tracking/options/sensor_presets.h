// SPDX-License-Identifier: MIT
// The errors of common depth cameras, from published measurements. The numbers are only here: Python's
// SensorModel.preset reads them from this file.
#pragma once

#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <string>

#include "tracking/options/options.h"

namespace sdftrack::tracking {

struct SensorPreset {
  const char* name;
  double noise_m = 0, noise_per_m = 0, noise_incidence = 0;  // sd: noise_m + noise_per_m Z^2
  double correlation_px = 0;                                 // sd of the window that shares one error
  double systematic_m = 0, systematic_per_m = 0;             // sd of what a surface's measurements share
  double lateral_px = 0;
  const char* source;
};

inline constexpr SensorPreset kSensorPresets[] = {
    {.name = "kinect_v1",
     .noise_m = 0.0003,
     .noise_per_m = 0.0014,
     .noise_incidence = 0.0014,
     .systematic_per_m = 0.001,
     .lateral_px = 1,
     .source =
         "along z 1.425e-3 Z^2: Khoshelham and Elberink, Sensors 12 (2012), who find no large bias in a "
         "calibrated sensor; lateral noise 0.8 px at 585 px focal length: Nguyen, Izadi and Lovell, 3DIMPVT "
         "2012; the systematic part (1 mm at 1 m, 1 px) is not published: set on recordings of this project"},
    {.name = "realsense_d400",
     .noise_m = 0.0003,
     .noise_per_m = 0.0038,
     .noise_incidence = 0.001,
     .correlation_px = 2,
     .systematic_m = 0.002,
     .systematic_per_m = 0.004,
     .lateral_px = 1,
     .source =
         "along z 0.08 px of disparity at a baseline of 50 mm and a focal length of 420 px (a D435 at 848 x "
         "480); that it grows with Z^2 and with incidence: Ahn et al., Ubiquitous Robots 2019; the "
         "systematic part: 2 % at 2 m, taken as two sd (the maker's data sheet), and 3 mm at 0.5 m in a "
         "recording of this project, on which the correlation is set too"},
    {.name = "azure_kinect",
     .noise_m = 0.0015,
     .systematic_m = 0.005,
     .lateral_px = 1,
     .source =
         "distance error below 11 mm up to 3.5 m, taken as two sd: the maker's data sheet, confirmed by "
         "Tolgyessy et al., Sensors 21 (2021); the lateral part is set, not published"},
};

// The options that state such a camera's errors; those about other things are unchanged. Throws
// std::invalid_argument for an unknown name.
inline void state_sensor(const std::string& name, TrackerOptions* options) {
  std::string known;
  for (const SensorPreset& sensor : kSensorPresets) {
    known += (known.empty() ? "'" : ", '") + std::string(sensor.name) + "'";
    if (name != sensor.name) continue;
    options->noise_m = std::max(sensor.noise_m, 1e-6), options->noise_per_m = sensor.noise_per_m;
    options->systematic_m = sensor.systematic_m, options->systematic_per_m = sensor.systematic_per_m;
    options->lateral_px = sensor.lateral_px;
    options->min_correlation_area_px = 2 * std::numbers::pi * sensor.correlation_px * sensor.correlation_px;
    return;
  }
  throw std::invalid_argument("sensor: expected one of " + known + ", got '" + name + "'");
}

}  // namespace sdftrack::tracking

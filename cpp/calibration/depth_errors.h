// SPDX-License-Identifier: MIT
// Errors of a depth image against a known surface, and the sensor's noise and bias from one image.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "base/camera.h"
#include "base/views.h"
#include "calibration/noise_fit.h"

namespace sdftrack::calibration {

// For every pixel: measured minus expected depth (m), NaN if unknown; expected depth; tan(incidence).
struct DepthErrors {
  int width, height;
  std::vector<double> error, depth, tangent;
};

// Errors from a plane n . p = -offset_m, unit normal n towards the camera. beside: not 0 off the plane.
DepthErrors errors_of_plane(const ImageView<float>& depth, const Camera& camera, const std::uint8_t* beside,
                            Vec3d normal, double offset_m);
// Errors against a rendered surface: its depth, 0 where there is none, and unit normals.
DepthErrors errors_of_surface(const ImageView<float>& depth, const Camera& camera, const float* expected,
                              const Vec3f* normals);

// The noise statistics of an image; NaN where unknown.
struct ImageNoise {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  int known = 0;                       // errors
  double depth_m = kNone;              // median
  double bias_m = kNone;               // median of the errors
  double bias_by_tangent = kNone;      // slope of the errors
  double correlation = kNone;          // of neighbouring pixels
  double systematic_m = kNone;         // sd of the smooth part of the errors
  std::vector<NoiseSample> samples{};  // by distance and incidence
};
// given_m: the depth before holes of a registration were filled, which has all of the noise; nullptr: the
// same.
ImageNoise noise_of(const DepthErrors& errors, const float* given_m);

}  // namespace sdftrack::calibration

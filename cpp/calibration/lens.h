// SPDX-License-Identifier: MIT
// A depth camera as a calibration sees it: from a pixel and its measurement to a point, with the derivatives
// by all possible unknowns. docs/math/intrinsics.md, section 1.
#pragma once

#include <array>

#include "base/camera.h"
#include "optim/arrow.h"

namespace sdftrack::calibration {

// The order of the unknowns' names, and of any subset of them in a vector.
enum class LensUnknown { kFx, kFy, kCx, kCy, kSkew, kK1, kK2, kDepthScale, kDepthOffset };
constexpr int kLensUnknowns = 9;
static_assert(kLensUnknowns == optim::kMaxShared);

struct Lens {
  Camera camera;
  double skew = 0;         // u = fx x + skew y + cx, x and y distorted
  double depth_scale = 1;  // depth = depth_scale * reading + depth_offset_m
  double depth_offset_m = 0;

  double get(LensUnknown which) const;
  void set(LensUnknown which, double value);
  double depth_m(double reading_m) const { return depth_scale * reading_m + depth_offset_m; }
};

struct LensRay {
  Vec3d ray;                                     // z = 1, distortion removed
  std::array<double, kLensUnknowns> dx{}, dy{};  // of ray.x and ray.y by the unknowns; 0 for the depth's
};

// `distorted`: whether distortion is among the camera's numbers or the unknowns.
LensRay look_through(const Lens& lens, bool distorted, double u_px, double v_px);

}  // namespace sdftrack::calibration

// SPDX-License-Identifier: MIT
// Whether a measurement is the object's, for the CPU's loops (roles.h) and the GPU's kernels.
#pragma once

#include "base/rigid.h"
#include "levelset/evidence_image_terms.h"

namespace sdftrack::reconstruction {

struct RoleOptions {
  float min_foreground = 0.6f;  // probability by colour
  float joined_m = 0.01f;       // depth steps between neighbouring measurements of one surface
  float near_m = 0.006f;        // measurements this near to the current surface continue it

  // Whether a measurement may be the object's by its colour.
  HD bool may_be(const float* foreground, int i) const {
    return !(foreground && foreground[i] < min_foreground);
  }
  HD bool starts(float distance_m) const { return abs(distance_m) < near_m; }
  HD bool joins(float depth_m, float other_m) const { return abs(depth_m - other_m) < joined_m; }
};

HD levelset::PixelRole masked_role(float depth_m, unsigned char mask) {
  return !(depth_m > 0) ? levelset::PixelRole::kUnknown
         : mask         ? levelset::PixelRole::kObject
                        : levelset::PixelRole::kBeyond;
}

// The measurements of a frame as points in the object frame.
struct ReadingTerm {
  LensRays lens;
  Rigidf T_obj_cam;

  // The point at pixel (x, y) of the image.
  HD Vec3f at(int x, int y, float depth_m) const {
    return T_obj_cam * (depth_m * lens.at(1.0 * x, 1.0 * y).cast<float>());
  }
};

}  // namespace sdftrack::reconstruction

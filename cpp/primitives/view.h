// SPDX-License-Identifier: MIT
// What is known of a solid: points of its surface, the edge of its picture, the table below it. Camera frame,
// m.
#pragma once

#include <vector>

#include "tracking/region.h"

namespace sdftrack {

// What a pixel beside the edge of the object's picture showed: the object, something else, or nothing.
enum class Sight : unsigned char { kOn, kBeside, kLost };

struct OutlineRay {
  Vec3d ray;             // z = 1
  double near_m, far_m;  // the stretch of it (depths) where the object would have been seen
  double pixel_m;        // what a pixel spans at the object
  Sight sight;
  double slack_m = 0;  // what is seen beside it touches the object: where it ends is known no better
};

struct PrimitiveView {
  std::vector<Vec3d> points;  // any first part of them is spread over all
  bool along_rays = false;    // their noise is along the ray from the camera; false: in all directions
  std::vector<OutlineRay> outline;
  bool has_plane = false;  // that the solid cannot reach through
  bool stands = false;     // it touches the plane
  Plane plane{{0, 0, 0}, 0};
};

}  // namespace sdftrack

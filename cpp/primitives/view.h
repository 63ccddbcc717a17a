// SPDX-License-Identifier: MIT
// What is known of a solid: points of its surface, the edge of its picture, the table below it. Camera frame,
// m.
#pragma once

#include <vector>

#include "frame/region.h"

namespace sdftrack::primitives {

// What a pixel beside the edge of the object's picture showed: the object, something else, or nothing.
enum class Sight : unsigned char { kOn, kBeside, kLost };

struct OutlineRay {
  Vec3d ray;             // z = 1
  double near_m, far_m;  // the stretch of it (depths) where the object would have been seen
  double pixel_m;        // what a pixel spans at the object
  Sight sight;
  double slack_m = 0;  // what is seen beside it touches the object: where it ends is known no better
};

// Points for loops over many at a time, in float, from an origin among them: they may lie far from their
// frame's.
struct FloatPoints {
  Vec3d origin{0, 0, 0};
  std::vector<float> x_m, y_m, z_m;

  explicit FloatPoints(const std::vector<Vec3d>& points = {}) {
    if (!points.empty()) origin = points.front();
    for (const Vec3d& p : points) {
      const Vec3f d = (p - origin).cast<float>();
      x_m.push_back(d.x), y_m.push_back(d.y), z_m.push_back(d.z);
    }
  }
};

struct PrimitiveView {
  std::vector<Vec3d> points;  // any first part of them is spread over all
  FloatPoints bare;           // the same, where they are not along rays
  bool along_rays = false;    // their noise is along the ray from the camera; false: in all directions
  std::vector<OutlineRay> outline;
  bool has_plane = false;  // that the solid cannot reach through
  bool stands = false;     // it touches the plane
  frame::Plane plane{{0, 0, 0}, 0};
};

}  // namespace sdftrack::primitives

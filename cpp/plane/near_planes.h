// SPDX-License-Identifier: MIT
// Tables, walls and boards around a place in a depth image: planes larger than the object there.
#pragma once

#include <vector>

#include "frame/image/point_image.h"

namespace sdftrack::plane {

struct NearPlane {
  frame::Plane plane;       // the normal points to the camera
  frame::PixelMask pixels;  // of the point image
  double extent_m;          // of its largest connected piece
};

// Half the thickness of such a plane at a depth.
inline double near_plane_tolerance_m(double depth_m) { return 0.005 + 0.005 * depth_m * depth_m; }

// Planes among the pixels `around` with a connected piece that extends farther than an object of `size_m`,
// the one with most pixels first.
std::vector<NearPlane> planes_near(const frame::PointImage& points, const frame::PixelMask& around,
                                   double size_m);

}  // namespace sdftrack::plane

// SPDX-License-Identifier: MIT
// Where a shape ends as seen from a point: rays that just touch its surface.
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/rigid.h"
#include "frame/shape.h"

namespace sdftrack::tracking {

// A surface point whose tangent plane contains the eye, and its outward normal; centred frame.
struct ContourPoint {
  Vec3d p_obj, n_obj;
};

// Working memory.
struct ContourScratch {
  std::vector<Vec2d> rim, hull;
};

// About `requested` points of the outer contour, in its order, from the origin of a pinhole camera. Rays
// start on the convex hull of the projected surface points, a little outside, and move towards the surface
// until they pass it within a few voxels. There the distance field is exact even at edges, which the volume
// itself rounds; the foot point is the contour's point. thickness_px: points where the object is thinner than
// this, or begins again within this distance outside, are left out.
void find_contour(const Intrinsics<double>& K, const frame::Shape& shape, const Rigidd& T_cam_obj,
                  int requested, double thickness_px, ContourScratch* scratch,
                  std::vector<ContourPoint>* out);

}  // namespace sdftrack::tracking

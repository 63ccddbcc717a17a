// SPDX-License-Identifier: MIT
// Tables, walls and boards around a location in a depth image: planes larger than the object.
#pragma once

#include <vector>

#include "base/vec.h"
#include "frame/region.h"
#include "plane/pixel_mask.h"

namespace sdftrack::plane {

// A part of a depth image: its points in the camera's frame (0, 0, 0 where nothing was measured), row by row,
// and which pixels were measured.
struct PointImage {
  PixelMask read;
  std::vector<Vec3d> points;
};

struct NearPlane {
  frame::Plane plane;  // the normal towards the camera
  PixelMask pixels;
  double extent_m;

  double height(Vec3d p_cam) const { return dot(plane.normal_cam, p_cam) + plane.offset_m; }
};

// Tolerance for a measurement at distance z to belong to a plane.
inline double near_plane_tolerance_m(double z_m) { return 0.005 + 0.005 * z_m * z_m; }

// Unit normals towards the camera; 0 at the border of the measurements.
std::vector<Vec3d> surface_normals(const PointImage& image);

// Planes among the pixels `around` with a connected extent larger than an object of `size_m`.
std::vector<NearPlane> planes_near(const PointImage& image, const std::vector<Vec3d>& normals,
                                   const PixelMask& around, double size_m);

}  // namespace sdftrack::plane

// SPDX-License-Identifier: MIT
// The points of a window of a depth image, their smoothed normals and their extent.
#pragma once

#include <vector>

#include "frame/image/pixel_mask.h"
#include "frame/region.h"

namespace sdftrack::frame {

// Camera frame, m; (0, 0, 0): no measurement.
struct PointImage {
  int width = 0, height = 0;
  std::vector<Vec3d> p;  // row by row

  std::size_t at(int x, int y) const { return std::size_t(y) * width + x; }
  PixelMask measured() const;
};

// The point of one pixel of a frame with a depth image.
Vec3d point_at(const DepthFrame& frame, const Camera& camera, int x, int y);
// Every `step`-th pixel of the window, from its first one on.
PointImage points_of(const DepthFrame& frame, const Camera& camera, const Rect& window, int step = 1);
std::vector<Vec3d> points_in(const PointImage& points, const PixelMask& mask);

// Unit normals towards the camera, of points averaged over 5 x 5 pixels; 0 next to holes and at the border.
std::vector<Vec3d> smooth_normals(const PointImage& points);

// Largest extent along a principal axis, between two shares of the points. 0: fewer than 3.
double longest_extent_m(const std::vector<Vec3d>& points, double low_share, double high_share);

}  // namespace sdftrack::frame

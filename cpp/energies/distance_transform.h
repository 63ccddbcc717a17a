// SPDX-License-Identifier: MIT
// Where the sensor sees past the object: distance to the nearest pixel that might show it.
#pragma once

#include <cstddef>
#include <vector>

#include "base/vec.h"

namespace sdftrack {

// A grid over a region of the image, one node every `step` pixels; beyond the grid the border's value goes
// on.
struct DistanceGrid {
  int x0 = 0, y0 = 0;  // pixel of node (0, 0)
  int step = 1;        // pixels between nodes
  int width = 0, height = 0;
  std::vector<float> distance_px;  // Euclidean, 0 at a node that is not free, at most limit_px
  float limit_px = 32;

  bool empty() const { return distance_px.empty(); }
};

// Fills distance_px from `free` (1: every pixel that the node stands for has a reading behind the object),
// row-major width x height. Exact Euclidean distance between nodes (Felzenszwalb and Huttenlocher 2012).
// `scratch` is working memory, kept by the caller from frame to frame.
struct DistanceScratch {
  std::vector<float> value, border;
  std::vector<int> root;
};
void distance_transform(const std::vector<unsigned char>& free, DistanceScratch* scratch, DistanceGrid* grid);

// Bilinear interpolant (px) and its exact derivative by the pixel.
template <class T>
inline void sample(const DistanceGrid& grid, Vec2<T> u_px, T* distance_px, Vec2<T>* gradient) {
  const T inv = T(1) / static_cast<T>(grid.step);
  const T x = (u_px.x - static_cast<T>(grid.x0)) * inv, y = (u_px.y - static_cast<T>(grid.y0)) * inv;
  const T last_x = static_cast<T>(grid.width - 1), last_y = static_cast<T>(grid.height - 1);
  const bool inside_x = x > T(0) && x<last_x, inside_y = y> T(0) && y < last_y;
  const T qx = x < T(0) ? T(0) : (x > last_x ? last_x : x), qy = y < T(0) ? T(0) : (y > last_y ? last_y : y);
  int ix = static_cast<int>(qx), iy = static_cast<int>(qy);
  ix = ix > grid.width - 2 ? grid.width - 2 : ix;
  iy = iy > grid.height - 2 ? grid.height - 2 : iy;
  const T fx = qx - static_cast<T>(ix), fy = qy - static_cast<T>(iy);
  const float* d = grid.distance_px.data() +
                   static_cast<std::size_t>(iy) * static_cast<std::size_t>(grid.width) +
                   static_cast<std::size_t>(ix);
  const T d00 = d[0], d10 = d[1], d01 = d[grid.width], d11 = d[grid.width + 1];
  const T top = d00 + fx * (d10 - d00), bottom = d01 + fx * (d11 - d01);
  *distance_px = top + fy * (bottom - top);
  gradient->x = inside_x ? inv * ((d10 - d00) + fy * ((d11 - d01) - (d10 - d00))) : T(0);
  gradient->y = inside_y ? inv * (bottom - top) : T(0);
}

}  // namespace sdftrack

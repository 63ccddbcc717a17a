// SPDX-License-Identifier: MIT
// Resampling, averaging and blurring of pictures.
#pragma once

#include "contour/grid_warp.h"
#include "contour/memory/plane.h"

namespace sdftrack::contour {

// x, y -> outer(inner(x, y)).
GridWarp after(const GridWarp& outer, const GridWarp& inner);

// The plane sampled at `to_source` of each pixel of a new plane, bilinear, 0 beyond the source.
template <class T>
Plane<T> warped(const Plane<T>& source, const GridWarp& to_source, int width, int height) {
  // With a border of zeros no pixel needs a test for the edge.
  Plane<T> bordered(source.width + 3, source.height + 3);
  for (int y = 0; y < source.height; ++y) std::copy_n(source.row(y), source.width, bordered.row(y + 1) + 1);
  const double most_u = source.width + 1, most_v = source.height + 1;
  Plane<T> out(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double u, v;
      to_source.to_image(x, y, &u, &v);
      u = std::min(std::max(0.0, u + 1), most_u), v = std::min(std::max(0.0, v + 1), most_v);
      const int ix = int(u), iy = int(v);
      const auto fx = float(u - ix), fy = float(v - iy);
      const T *a = bordered.row(iy) + ix, *b = bordered.row(iy + 1) + ix;
      const T top = a[0] + fx * (a[1] - a[0]), bottom = b[0] + fx * (b[1] - b[0]);
      out.row(y)[x] = top + fy * (bottom - top);
    }
  return out;
}

// Means of blocks of `block` x `block` pixels.
template <class T>
Plane<T> block_means(const Plane<T>& source, int block) {
  Plane<T> out(source.width / block, source.height / block);
  const float share = 1.0f / float(block * block);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      T sum{};
      for (int row = 0; row < block; ++row)
        for (int column = 0; column < block; ++column)
          sum = sum + source.row(y * block + row)[x * block + column];
      out.row(y)[x] = share * sum;
    }
  return out;
}

// Resizes, by area averaging where the picture shrinks, else bilinear.
Picture resized(const Picture& source, int width, int height);

// Mean over squares of 2 radius + 1 pixels, with the border mirrored.
Picture box_mean(const Picture& source, int radius);

// Pixels that replace those beyond the border: the mirrored ones, or the last one.
enum class Border { kMirrored, kRepeated };

Picture blurred(const Picture& source, double sigma_px, Border border);

}  // namespace sdftrack::contour

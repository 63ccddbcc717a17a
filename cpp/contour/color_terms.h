// SPDX-License-Identifier: MIT
// One pixel of the posterior by colours and one place of the search (docs/math/contour.md).
#pragma once

#include "base/lane.h"

namespace sdftrack::contour {

// Posterior of pixels from the shares of object and background, interpolated between four windows each.
struct WindowMixture {
  const float *x, *y;   // of each pixel, in windows, counted from the first
  int* colour;          // index of its shares, -1 for a colour never seen; room for a whole pack
  const float* shares;  // [window][object, background]
  int windows;          // windows per row
  float least;          // smallest posterior

  template <class T>
  HD T posterior(int i, int n) const {
    const T fx = load<T>(x + i, n), fy = load<T>(y + i, n), last(static_cast<float>(windows - 2));
    const IntOf<T> ix = truncate(select(fx < last, fx, last)), iy = truncate(select(fy < last, fy, last));
    const T ax = fx - real<T>(ix), ay = fy - real<T>(iy), bx = T(1) - ax, by = T(1) - ay;
    const T weight[4] = {bx * by, ax * by, bx * ay, ax * ay};
    const IntOf<T> begin = load_indices<T>(colour + i, n);
    const auto unseen = begin < 0;
    const IntOf<T> at = select(unseen, begin - begin, begin) + (iy * windows + ix) * 2;
    T f[4] = {T(0), T(0), T(0), T(0)}, b[4] = {T(0), T(0), T(0), T(0)};
    gather_pair(shares, at, &f[0], &b[0]);
    gather_pair(shares, at + 2, &f[1], &b[1]);
    gather_pair(shares, at + 2 * windows, &f[2], &b[2]);
    gather_pair(shares, at + 2 * windows + 2, &f[3], &b[3]);
    const T own = weight[0] * f[0] + weight[1] * f[1] + weight[2] * f[2] + weight[3] * f[3];
    const T other = weight[0] * b[0] + weight[1] * b[1] + weight[2] * b[2] + weight[3] * b[3];
    const T p = own / (own + other), most = T(1) - T(least);
    return select(unseen, T(0.5f), select(p < T(least), T(least), select(most < p, most, p)));
  }
};

// Samples of a shape, at which the posterior is summed for any place of the shape.
struct PlacedSamples {
  const float *x, *y;  // cells from the middle of the grid
  int count;
  float a[4];  // pixel = a (x, y) + place
  const float* posterior;
  int width, height;

  // Summed in the order of the samples. (u0, v0): the grid's middle plus one and a half pixels, so that
  // truncation rounds to the nearest on both sides of 0. A sample outside the image counts one half.
  template <class T>
  HD T sum(T u0, T v0) const {
    const T right(static_cast<float>(width + 2)), bottom(static_cast<float>(height + 2));
    T total(0);
    for (int i = 0; i < count; ++i) {
      const T u = u0 + T(a[0] * x[i]) + T(a[1] * y[i]), v = v0 + T(a[2] * x[i]) + T(a[3] * y[i]);
      // NaN becomes 0, which lies outside the image.
      const IntOf<T> iu = truncate(select(u > T(0), select(u < right, u, right), T(0))) - 1,
                     iv = truncate(select(v > T(0), select(v < bottom, v, bottom), T(0))) - 1;
      const auto there = (iu >= 0) & (iv >= 0) & (iu < width) & (iv < height);
      const IntOf<T> at = select(there, iv * width + iu, iu - iu);
      total += select(there, gather<T>(posterior, at), T(0.5f));
    }
    return total;
  }
};

}  // namespace sdftrack::contour

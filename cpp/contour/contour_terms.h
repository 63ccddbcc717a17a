// SPDX-License-Identifier: MIT
// One pixel of the posterior by colours and of the registration, one place of the search and one cell of the
// evolution of a contour (docs/math/contour.md).
#pragma once

#include "base/lane.h"
#include "energies/term.h"
#include "levelset/evolve_terms.h"

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
    const T fx = load<T>(x + i, n), fy = load<T>(y + i, n), last(float(windows - 2));
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
    const T right(float(width + 2)), bottom(float(height + 2));
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

constexpr float kMinMixture = 1e-6f;  // below it a pixel of posterior 0 or 1 would have an unbounded cost

// Cost of phi at a pixel: -log f with f = H P + (1 - H) (1 - P), H = 1 / (1 + e^(phi / s)). Its slope in phi
// is (gamma - H) / s with gamma = H P / f; Gauss-Newton takes H (1 - H) / s^2 as its curvature (section 2).
template <class T>
HD energies::Curve<T> posterior_cost(T phi, T foreground, T inv_s) {
  const T inside = levelset::heaviside(T(-1) * inv_s * phi), own = inside * foreground;
  const T mixture = own + (T(1) - inside) * (T(1) - foreground);
  const T f = select(mixture < T(kMinMixture), T(kMinMixture), mixture);
  return {T(-1) * log_positive(f), inv_s * (own / f - inside), inv_s * inv_s * inside * (T(1) - inside)};
}

// phi[iy * nx + ix], in cells, negative inside.
struct FlatView {
  const float* phi;
  int nx, ny;
};

// Bilinear value and its exact gradient; beyond the grid the border is extrapolated.
template <class T>
HD void sample_flat(const FlatView& grid, T x, T y, T* phi, T* gx, T* gy) {
  const T max_x(float(grid.nx) - 1.0f), max_y(float(grid.ny) - 1.0f);
  const auto in_x = (x >= T(0)) & (x <= max_x), in_y = (y >= T(0)) & (y <= max_y);
  const T cx = select(x > T(0), select(x < max_x, x, max_x), T(0)),  // NaN becomes 0: no read outside
      cy = select(y > T(0), select(y < max_y, y, max_y), T(0));
  // The last cell's far corner belongs to it, so that all four corners exist.
  const T last_x = max_x - T(1), last_y = max_y - T(1);
  const IntOf<T> ix = truncate(select(cx > last_x, last_x, cx)),
                 iy = truncate(select(cy > last_y, last_y, cy));
  const IntOf<T> at = iy * grid.nx + ix;
  const T fx = cx - real<T>(ix), fy = cy - real<T>(iy);
  T a, b, c, d;
  gather_pair(grid.phi, at, &a, &b);
  gather_pair(grid.phi, at + grid.nx, &c, &d);
  const T top = a + fx * (b - a), bottom = c + fx * (d - c);
  *phi = top + fy * (bottom - top);
  *gx = select(in_x, (b - a) + fy * ((d - c) - (b - a)), T(0));
  *gy = select(in_y, bottom - top, T(0));
}

// The pixels of a registration; fixed while it runs.
struct ContourPixels {
  int count;
  const float *u, *v, *foreground;
};

// P: 4 for a similarity, 6 for an affinity.
template <class T, int P>
struct RegistrationTerm {
  FlatView grid;
  ContourPixels pixels;
  float b[6];          // X = (b0 u + b1 v + b2, b3 u + b4 v + b5), cells from the middle
  float mid_x, mid_y;  // of the grid, in cells from its corner
  float inv_s;

  HD energies::Contribution<T, P> at(int i, int n) const {
    const T u = load<T>(pixels.u + i, n), v = load<T>(pixels.v + i, n);
    const T x = T(b[0]) * u + T(b[1]) * v + T(b[2]), y = T(b[3]) * u + T(b[4]) * v + T(b[5]);
    T phi, gx, gy;
    sample_flat(grid, x + T(mid_x), y + T(mid_y), &phi, &gx, &gy);
    const energies::Curve<T> c = posterior_cost(phi, load<T>(pixels.foreground + i, n), T(inv_s));
    if constexpr (P == 4)
      return {c.cost, c.slope, c.curvature, {x * gx + y * gy, x * gy - y * gx, gx, gy}};
    else
      return {c.cost, c.slope, c.curvature, {x * gx, y * gx, x * gy, y * gy, gx, gy}};
  }
};

// A step of the evolution, phi <- phi + dt (data + mu (div grad phi - curvature)): the gradient flow of
// sum -log f + mu / 2 sum (|grad phi| - 1)^2. `p` points at the cell; row: to the cell below.
template <class T>
struct ContourStep {
  float inv_s, dt, mu, tension;

  HD T step(const float* p, int row, T foreground, int n) const {
    const T own = load<T>(p, n), west = load<T>(p - 1, n), east = load<T>(p + 1, n),
            north = load<T>(p - row, n), south = load<T>(p + row, n);
    const T gx = T(0.5f) * (east - west), gy = T(0.5f) * (south - north);
    const T xx = east - own - own + west, yy = south - own - own + north;
    const T xy = T(0.25f) * (load<T>(p + row + 1, n) - load<T>(p + row - 1, n) - load<T>(p - row + 1, n) +
                             load<T>(p - row - 1, n));
    const T square = gx * gx + gy * gy, kept = select(square > T(1e-4f), square, T(1e-4f));
    // The Laplacian minus the curvature: diffusion across the level lines, not along them.
    const T along = (xx * gy * gy - T(2) * xy * gx * gy + yy * gx * gx) / kept;
    const T curvature = along / sqrt(kept);
    const energies::Curve<T> c = posterior_cost(own, foreground, T(inv_s));
    return own + T(dt) * (T(mu) * (xx + yy - T(1.0f - tension) * curvature) - c.slope);
  }
};

}  // namespace sdftrack::contour

// SPDX-License-Identifier: MIT
// One pixel of the registration and one cell of the evolution of a contour (docs/math/contour.md).
#pragma once

#include "energies/term.h"
#include "levelset/evolve_terms.h"

namespace sdftrack::contour {

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
  const T max_x(static_cast<float>(grid.nx) - 1.0f), max_y(static_cast<float>(grid.ny) - 1.0f);
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

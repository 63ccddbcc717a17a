// SPDX-License-Identifier: MIT
#include "contour/distance.h"

#include <algorithm>
#include <cmath>

#include "contour/contour_ops.h"

namespace sdftrack {

namespace {

constexpr float kLeastSlope = 0.3f;  // a flatter phi says nothing about where its zero is
constexpr float kBeside = 1.2f;      // cells whose distance phi itself gives

// Squared distance along a row to the nearest cell that is inside, or outside; `far` where none is nearer.
void along_row(const float* phi, int nx, bool inside, float far, float* square) {
  float run = far;
  for (int x = 0; x < nx; ++x) {
    run = (phi[x] < 0) == inside ? 0.0f : std::min(run + 1, far);
    square[x] = run;
  }
  run = far;
  for (int x = nx - 1; x >= 0; --x) {
    run = std::min(square[x], std::min(run + 1, far));
    square[x] = run * run;
  }
}

// phi over its slope at a cell beside the zero set.
float beside(const float* phi, int nx, int ny, int x, int y) {
  const float* p = phi + static_cast<std::ptrdiff_t>(y) * nx + x;
  const float gx = 0.5f * (p[x + 1 < nx ? 1 : 0] - p[x > 0 ? -1 : 0]);
  const float gy = 0.5f * (p[y + 1 < ny ? nx : 0] - p[y > 0 ? -nx : 0]);
  const float slope = std::max(std::sqrt(gx * gx + gy * gy), kLeastSlope);
  return std::clamp(*p / slope, -kBeside, kBeside);
}

}  // namespace

void redistance(int nx, int ny, int radius, FlatDistanceWork* work, float* phi) {
  const auto cells = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  const auto width = static_cast<std::size_t>(nx);
  work->to_outside.resize(cells), work->to_inside.resize(cells), work->kept.resize(cells);
  work->least.resize(2 * width);
  std::copy_n(phi, cells, work->kept.data());
  const auto far = static_cast<float>(radius) + 0.5f;
  for (int y = 0; y < ny; ++y) {
    const std::size_t at = static_cast<std::size_t>(y) * width;
    along_row(phi + at, nx, false, far, work->to_outside.data() + at);
    along_row(phi + at, nx, true, far, work->to_inside.data() + at);
  }
  const ContourOps& ops = contour_ops_for(used_isa());
  for (int y = 0; y < ny; ++y) {
    const std::size_t at = static_cast<std::size_t>(y) * width;
    const int above = std::min(radius, y), below = std::min(radius, ny - 1 - y);
    float *const out = work->least.data(), *const in = out + width;
    ops.least_square(work->to_outside.data() + at, nx, above, below, nx, out);
    ops.least_square(work->to_inside.data() + at, nx, above, below, nx, in);
    for (int x = 0; x < nx; ++x) {
      const auto i = at + static_cast<std::size_t>(x);
      const bool inside = work->kept[i] < 0;
      const float d = std::min(std::sqrt(inside ? out[x] : in[x]) - 0.5f, far);
      phi[i] = d < kBeside ? beside(work->kept.data(), nx, ny, x, y) : inside ? -d : d;
    }
  }
}

}  // namespace sdftrack

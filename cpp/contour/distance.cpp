// SPDX-License-Identifier: MIT
#include "contour/distance.h"

#include <algorithm>
#include <cmath>

#include "contour/contour_ops.h"

namespace sdftrack::contour {

namespace {

constexpr float kMinSlope = 0.3f;  // a flatter phi does not locate its zero
constexpr float kBeside = 1.2f;    // cells from the zero set within which phi gives the distance

// Squared distance along a row to the nearest cell inside, or outside; `far` if there is none nearer.
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

// phi over its slope at a cell next to the zero set.
float beside(const float* phi, int nx, int ny, int x, int y) {
  const float* p = phi + y * nx + x;
  const float gx = 0.5f * (p[x + 1 < nx ? 1 : 0] - p[x > 0 ? -1 : 0]);
  const float gy = 0.5f * (p[y + 1 < ny ? nx : 0] - p[y > 0 ? -nx : 0]);
  const float slope = std::max(std::sqrt(gx * gx + gy * gy), kMinSlope);
  return std::clamp(*p / slope, -kBeside, kBeside);
}

CellBox inside_of(const ContourGrid& grid) {
  CellBox box{grid.nx, grid.ny, -1, -1};
  for (int y = 0; y < grid.ny; ++y) {
    const float* const row = grid.phi.data() + std::ptrdiff_t(y) * grid.nx;
    int first = 0, last = grid.nx - 1;
    while (first < grid.nx && row[first] >= 0) ++first;
    if (first == grid.nx) continue;
    while (row[last] >= 0) --last;
    box = {std::min(box.x0, first), std::min(box.y0, y), std::max(box.x1, last), y};
  }
  return box.x1 < 0 ? CellBox{0, 0, 0, 0} : box;
}

}  // namespace

void redistance(int radius, FlatDistanceWork* work, ContourGrid* grid) {
  const int nx = grid->nx, ny = grid->ny;
  const auto width = std::size_t(nx);
  work->to_outside.resize(grid->phi.size()), work->to_inside.resize(grid->phi.size());
  work->least.resize(2 * width);
  work->kept.resize(grid->phi.size());
  grid->inside = inside_of(*grid);
  std::swap(grid->phi, work->kept);
  const auto far = float(radius);
  std::fill(grid->phi.begin(), grid->phi.end(), far);
  const CellBox box = grid->inside.grown(radius + 1, nx, ny);
  const int count = box.x1 - box.x0 + 1;
  const auto first = [&](int y) { return std::size_t(y) * width + box.x0; };
  for (int y = box.y0; y <= box.y1; ++y) {
    along_row(work->kept.data() + first(y), count, false, far + 1, work->to_outside.data() + first(y));
    along_row(work->kept.data() + first(y), count, true, far + 1, work->to_inside.data() + first(y));
  }
  const ContourOps& ops = for_isa<ContourOps>(used_isa());
  for (int y = box.y0; y <= box.y1; ++y) {
    const int above = std::min(radius, y - box.y0), below = std::min(radius, box.y1 - y);
    float *const out = work->least.data(), *const in = out + width;
    ops.min_square(work->to_outside.data() + first(y), nx, above, below, count, out);
    ops.min_square(work->to_inside.data() + first(y), nx, above, below, count, in);
    const float* const kept = work->kept.data() + first(y);
    float* const to = grid->phi.data() + first(y);
    for (int k = 0; k < count; ++k) {
      const float d = std::min(std::sqrt(kept[k] < 0 ? out[k] : in[k]) - 0.5f, far);
      to[k] = kept[k] < 0 ? -d : d;
    }
    for (int k = 0; k < count; ++k)
      if (std::abs(to[k]) < kBeside) to[k] = beside(work->kept.data(), nx, ny, box.x0 + k, y);
  }
}

}  // namespace sdftrack::contour

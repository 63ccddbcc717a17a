// SPDX-License-Identifier: MIT
#include "sdf/sweep.h"

#include <algorithm>
#include <cstddef>

#include "base/interrupt.h"
#include "sdf/sweep_terms.h"

namespace sdftrack::sdf {

namespace {

constexpr int kRounds = 2;  // of eight sweeps: the second round corrects paths around corners

struct Sweep {
  const Grid& grid;
  const std::vector<std::uint8_t>& known;
  std::vector<float>& u;

  // One row, forwards or backwards; returns whether a value fell.
  bool row(int iy, int iz, bool forward) const {
    const auto nx = std::ptrdiff_t(grid.nx);
    const std::ptrdiff_t slice = nx * grid.ny;
    const auto start = std::ptrdiff_t(grid.index(0, iy, iz));
    float* line = u.data() + start;
    const std::uint8_t* fixed = known.data() + start;
    const float h = float(grid.voxel_m);
    // At the border the missing neighbour is replaced by the one inside.
    const float *y0 = line + (iy > 0 ? -nx : nx), *y1 = line + (iy + 1 < grid.ny ? nx : -nx);
    const float *z0 = line + (iz > 0 ? -slice : slice), *z1 = line + (iz + 1 < grid.nz ? slice : -slice);
    bool changed = false;
    for (std::ptrdiff_t k = 0; k < nx; ++k) {
      const std::ptrdiff_t i = forward ? k : nx - 1 - k;
      if (fixed[i]) continue;
      const float a = std::min(line[i > 0 ? i - 1 : 1], line[i + 1 < nx ? i + 1 : nx - 2]);
      const float b = std::min(y0[i], y1[i]), c = std::min(z0[i], z1[i]);
      if (std::min(a, std::min(b, c)) >= line[i]) continue;
      const float next = godunov(a, b, c, h);
      if (next < line[i]) {
        line[i] = next;
        changed = true;
      }
    }
    return changed;
  }

  bool run(int order) const {
    const bool fx = order & 1, fy = order & 2, fz = order & 4;
    bool changed = false;
    for (int z = 0; z < grid.nz; ++z) {
      check_interrupt();
      for (int y = 0; y < grid.ny; ++y)
        changed = row(fy ? y : grid.ny - 1 - y, fz ? z : grid.nz - 1 - z, fx) || changed;
    }
    return changed;
  }
};

}  // namespace

void fast_sweep(const Grid& grid, const std::vector<std::uint8_t>& known, std::vector<float>* u) {
  for (std::size_t i = 0; i < u->size(); ++i)
    if (!known[i]) (*u)[i] = kUnreached;
  const Sweep sweep{grid, known, *u};
  for (int round = 0; round < kRounds; ++round) {
    bool changed = false;
    for (int order = 0; order < 8; ++order) changed = sweep.run(order) || changed;
    if (!changed) break;
  }
}

}  // namespace sdftrack::sdf

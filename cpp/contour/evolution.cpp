// SPDX-License-Identifier: MIT
#include "contour/evolution.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"
#include "contour/contour_ops.h"
#include "contour/steps_cuda.h"

namespace sdftrack::contour {

namespace {

constexpr int kBridged = 8;  // a shorter gap of cells between two runs is included in one run

std::size_t cells_of(const ContourGrid& grid) { return std::size_t(grid.nx) * grid.ny; }

// Bilinear sample; one half where a corner lies beyond the rectangle.
float sample_at(const PosteriorImage& image, double u, double v) {
  const ImagePart& r = image.rect;
  if (!(u >= r.x0 && v >= r.y0 && u < r.x1 - 1 && v < r.y1 - 1)) return 0.5f;
  const int x = int(u), y = int(v);
  const auto fx = float(u - x), fy = float(v - y);
  const float *const a = image.row(y) + (x - r.x0), *const b = a + r.width();
  const float top = a[0] + fx * (a[1] - a[0]), bottom = b[0] + fx * (b[1] - b[0]);
  return top + fy * (bottom - top);
}

int root_of(std::vector<int>* parent, int i) {
  auto& p = *parent;
  const auto at = [](int k) { return std::size_t(k); };
  while (p[at(i)] != i) i = p[at(i)] = p[at(p[at(i)])];
  return i;
}

}  // namespace

void find_band(const ContourGrid& grid, float band, std::vector<CellRun>* runs) {
  runs->clear();
  const int grow = to_int(std::min(band + 1, float(std::max(grid.nx, grid.ny))));
  const CellBox box = grid.inside.grown(grow, grid.nx, grid.ny);
  for (int y = std::max(1, box.y0); y <= std::min(grid.ny - 2, box.y1); ++y) {
    const float* const row = grid.phi.data() + std::ptrdiff_t(y) * grid.nx;
    for (int x = std::max(1, box.x0); x <= std::min(grid.nx - 2, box.x1); ++x) {
      if (std::abs(row[x]) > band) continue;
      if (!runs->empty() && runs->back().row == y && x - runs->back().last < kBridged)
        runs->back().last = x + 1;
      else
        runs->push_back({y, x, x + 1});
    }
  }
}

void sample_posterior(const ContourGrid& grid, const PosteriorImage& posterior, EvolutionWork* work) {
  work->foreground.resize(cells_of(grid));
  for (const CellRun& run : work->band) {
    double u, v;
    grid.warp.to_image(run.first - grid.mid_x(), run.row - grid.mid_y(), &u, &v);
    float* const to = work->foreground.data() + std::ptrdiff_t(run.row) * grid.nx;
    for (int x = run.first; x < run.last; ++x, u += grid.warp.a[0], v += grid.warp.a[2])
      to[x] = sample_at(posterior, u, v);
  }
}

void evolve_contour(const ContourOptions& options, int steps, EvolutionWork* work, ContourGrid* grid) {
  if (work->device >= 0) return evolve_contour_cuda(options, steps, work->device, work, grid);
  const ContourOps& ops = for_isa<ContourOps>(used_isa());
  const ContourStep<float> step{1 / options.softness, options.dt, options.mu, options.tension};
  work->next.resize(cells_of(*grid));
  std::copy(grid->phi.begin(), grid->phi.end(), work->next.begin());
  for (int k = 0; k < steps; ++k) {
    for (const CellRun& run : work->band) {
      const std::ptrdiff_t at = std::ptrdiff_t(run.row) * grid->nx + run.first;
      ops.step(step, grid->phi.data() + at, work->foreground.data() + at, grid->nx, run.last - run.first,
               work->next.data() + at);
    }
    std::swap(grid->phi, work->next);
  }
}

int drop_small_pieces(float min_part, int reach, EvolutionWork* work, ContourGrid* grid) {
  auto& runs = work->pieces;
  auto& parent = work->parent;
  auto& area = work->area;
  runs.clear(), parent.clear();
  std::size_t above = 0, here = 0;  // the first run of the row above, and of this one
  const CellBox box = grid->inside.grown(reach, grid->nx, grid->ny);
  for (int y = box.y0; y <= box.y1; ++y) {
    const float* const row = grid->phi.data() + std::ptrdiff_t(y) * grid->nx;
    above = here, here = runs.size();
    std::size_t other = above;
    for (int x = box.x0; x <= box.x1; ++x) {
      if (row[x] >= 0) continue;
      const int first = x;
      while (x <= box.x1 && row[x] < 0) ++x;
      const int own = int(runs.size());
      runs.push_back({y, first, x}), parent.push_back(own);
      while (other < here && runs[other].last <= first) ++other;
      for (std::size_t k = other; k < here && runs[k].first < x; ++k) {
        const int a = root_of(&parent, own), b = root_of(&parent, int(k));
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  area.assign(runs.size(), 0);
  for (std::size_t k = 0; k < runs.size(); ++k)
    area[root_of(&parent, int(k))] += runs[k].last - runs[k].first;
  const int largest = area.empty() ? 0 : *std::max_element(area.begin(), area.end());
  int inside = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const int whole = area[root_of(&parent, int(k))];
    if (float(whole) >= min_part * float(largest)) {
      inside += runs[k].last - runs[k].first;
      continue;
    }
    float* const row = grid->phi.data() + std::ptrdiff_t(runs[k].row) * grid->nx;
    std::fill(row + runs[k].first, row + runs[k].last, 0.5f);
  }
  return inside;
}

}  // namespace sdftrack::contour

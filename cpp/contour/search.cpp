// SPDX-License-Identifier: MIT
#include "contour/search.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::contour {

namespace {

constexpr int kSamples = 400;  // of each kind

double mean_at(const std::vector<float>& x, const std::vector<float>& y, const GridWarp& warp,
               const PosteriorImage& posterior) {
  const ImagePart& r = posterior.rect;
  const float a[4] = {static_cast<float>(warp.a[0]), static_cast<float>(warp.a[1]),
                      static_cast<float>(warp.a[2]), static_cast<float>(warp.a[3])};
  const float u0 = static_cast<float>(warp.t[0] - r.x0) + 1.5f,
              v0 = static_cast<float>(warp.t[1] - r.y0) + 1.5f;
  float sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    // One more than the nearest pixel, so that truncation rounds down on both sides of 0.
    const int u = to_int(std::max(u0 + a[0] * x[i] + a[1] * y[i], 0.0f)) - 1,
              v = to_int(std::max(v0 + a[2] * x[i] + a[3] * y[i], 0.0f)) - 1;
    const bool there = u >= 0 && v >= 0 && u < r.width() && v < r.height();
    sum += there ? posterior.foreground[static_cast<std::size_t>(v * r.width() + u)] : 0.5f;
  }
  return x.empty() ? 0.5 : static_cast<double>(sum) / static_cast<double>(x.size());
}

}  // namespace

void choose_samples(const ContourGrid& grid, float band, const unsigned char* hidden, ShapeSamples* samples) {
  auto& s = *samples;
  int in = 0, out = 0;
  const CellBox box = grid.inside.grown(to_int(band) + 1, grid.nx, grid.ny);
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = static_cast<std::size_t>(y * grid.nx + x);
      if (hidden && hidden[cell]) continue;
      const float phi = grid.phi[cell];
      in += phi<0, out += phi> 1 && phi < band;
    }
  s.in_x.clear(), s.in_y.clear(), s.out_x.clear(), s.out_y.clear();
  const int every_in = std::max(1, in / kSamples), every_out = std::max(1, out / kSamples);
  in = out = 0;
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = static_cast<std::size_t>(y * grid.nx + x);
      if (hidden && hidden[cell]) continue;
      const float phi = grid.phi[cell];
      const auto gx = static_cast<float>(x - grid.mid_x()), gy = static_cast<float>(y - grid.mid_y());
      if (phi < 0) {
        if (in++ % every_in == 0) s.in_x.push_back(gx), s.in_y.push_back(gy);
      } else if (phi > 1 && phi < band) {
        if (out++ % every_out == 0) s.out_x.push_back(gx), s.out_y.push_back(gy);
      }
    }
}

double contrast_at(const ShapeSamples& s, const GridWarp& warp, const PosteriorImage& posterior) {
  return mean_at(s.in_x, s.in_y, warp, posterior) - mean_at(s.out_x, s.out_y, warp, posterior);
}

double search_place(const ShapeSamples& samples, const PosteriorImage& posterior, int reach, int step,
                    GridWarp* warp) {
  GridWarp best = *warp;
  double most = contrast_at(samples, best, posterior);
  for (int half = reach; step >= 1; half = step, step /= 2) {
    const GridWarp around = best;
    for (int dy = -half / step * step; dy <= half; dy += step)
      for (int dx = -half / step * step; dx <= half; dx += step) {
        if (dx == 0 && dy == 0) continue;
        GridWarp trial = around;
        trial.t[0] += dx, trial.t[1] += dy;
        const double contrast = contrast_at(samples, trial, posterior);
        if (contrast > most) most = contrast, best = trial;
      }
  }
  *warp = best;
  return most;
}

}  // namespace sdftrack::contour

// SPDX-License-Identifier: MIT
#include "contour/search.h"

#include <algorithm>

#include "base/to_int.h"
#include "contour/contour_ops.h"

namespace sdftrack::contour {

namespace {

constexpr int kSamples = 400;  // of each kind

constexpr int kTogether = 64;

// Places of a shape that are evaluated together.
struct Places {
  int count = 0;
  double x[kTogether], y[kTogether];
  double contrast[kTogether];
};

// Means over a list of samples; `warp` is used without its place.
void means_at(const std::vector<float>& x, const std::vector<float>& y, const GridWarp& warp,
              const PosteriorImage& posterior, const Places& places, double* means) {
  const ImagePart& r = posterior.rect;
  if (x.empty() || r.empty()) {
    std::fill(means, means + places.count, 0.5);
    return;
  }
  float u0[kTogether], v0[kTogether], sums[kTogether];
  for (int k = 0; k < places.count; ++k) {
    u0[k] = float(places.x[k] - r.x0) + 1.5f;
    v0[k] = float(places.y[k] - r.y0) + 1.5f;
  }
  const PlacedSamples samples{x.data(),
                              y.data(),
                              int(x.size()),
                              {float(warp.a[0]), float(warp.a[1]), float(warp.a[2]), float(warp.a[3])},
                              posterior.foreground.data(),
                              r.width(),
                              r.height()};
  for_isa<ContourOps>(used_isa()).sums_at(samples, u0, v0, places.count, sums);
  for (int k = 0; k < places.count; ++k) means[k] = double(sums[k]) / double(x.size());
}

void evaluate(const ShapeSamples& s, const GridWarp& warp, const PosteriorImage& posterior, Places* places) {
  double beside[kTogether];
  means_at(s.in_x, s.in_y, warp, posterior, *places, places->contrast);
  means_at(s.out_x, s.out_y, warp, posterior, *places, beside);
  for (int k = 0; k < places->count; ++k) places->contrast[k] -= beside[k];
}

}  // namespace

void choose_samples(const ContourGrid& grid, float band, const unsigned char* hidden, ShapeSamples* samples) {
  auto& s = *samples;
  int in = 0, out = 0;
  const CellBox box = grid.inside.grown(to_int(band) + 1, grid.nx, grid.ny);
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = std::size_t(y * grid.nx + x);
      if (hidden && hidden[cell]) continue;
      const float phi = grid.phi[cell];
      in += phi<0, out += phi> 1 && phi < band;
    }
  s.in_x.clear(), s.in_y.clear(), s.out_x.clear(), s.out_y.clear();
  const int every_in = std::max(1, in / kSamples), every_out = std::max(1, out / kSamples);
  in = out = 1;  // until the next one is taken
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = std::size_t(y * grid.nx + x);
      if (hidden && hidden[cell]) continue;
      const float phi = grid.phi[cell];
      const auto gx = float(x - grid.mid_x()), gy = float(y - grid.mid_y());
      if (phi < 0) {
        if (--in == 0) s.in_x.push_back(gx), s.in_y.push_back(gy), in = every_in;
      } else if (phi > 1 && phi < band) {
        if (--out == 0) s.out_x.push_back(gx), s.out_y.push_back(gy), out = every_out;
      }
    }
}

double contrast_at(const ShapeSamples& s, const GridWarp& warp, const PosteriorImage& posterior) {
  Places one;
  one.count = 1, one.x[0] = warp.t[0], one.y[0] = warp.t[1];
  evaluate(s, warp, posterior, &one);
  return one.contrast[0];
}

double search_place(const ShapeSamples& samples, const PosteriorImage& posterior, int reach, int step,
                    GridWarp* warp) {
  GridWarp best = *warp;
  double most = contrast_at(samples, best, posterior);
  Places places;
  const auto look = [&] {
    evaluate(samples, *warp, posterior, &places);
    for (int k = 0; k < places.count; ++k)
      if (places.contrast[k] > most)
        most = places.contrast[k], best.t[0] = places.x[k], best.t[1] = places.y[k];
    places.count = 0;
  };
  for (int half = reach; step >= 1; half = step, step /= 2) {
    const double x = best.t[0], y = best.t[1];
    for (int dy = -half / step * step; dy <= half; dy += step)
      for (int dx = -half / step * step; dx <= half; dx += step) {
        if (dx == 0 && dy == 0) continue;
        places.x[places.count] = x + dx, places.y[places.count++] = y + dy;
        if (places.count == kTogether) look();
      }
    look();
  }
  *warp = best;
  return most;
}

}  // namespace sdftrack::contour

// SPDX-License-Identifier: MIT
#include "primitives/evidence.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace sdftrack::primitives {

namespace {

constexpr int kWitnesses = 2000;  // measurements, and outline pixels, that are compared
constexpr double kMostEffective =
    500;  // measurements that count, at most: no object is the solid to a 500th of its noise
constexpr double kLeastEffective = 10;  // at least: as many as there are unknowns
// Outline pixels with a common error: about four see an edge, two on either side, and the edge shifts over
// the correlation length of the measurements. Chosen on half of the scenes (experiments/primitives).
constexpr double kRaysPerPixel = 1.5;
constexpr double kFloor = 0.1;    // share of outline pixels that show something else
constexpr double kClip = 3;       // scales, at which an outlier's residual is clipped
constexpr double kUnlike = 0.05;  // a correlation below this counts as 0
constexpr int kLags_px[] = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48};
constexpr std::size_t kPairs = 4000;  // for each lag and direction

// Residuals in units of their scale, on the pixels around the object.
class ResidualImage {
 public:
  ResidualImage(const PrimitiveView& view, const std::vector<double>& r, double scale_m) : view_(view) {
    int x1 = 0, y1 = 0;
    for (const Pixel& p : view.pixels) x1 = std::max(x1, p.x), y1 = std::max(y1, p.y);
    x0_ = x1, y0_ = y1;
    for (const Pixel& p : view.pixels) x0_ = std::min(x0_, p.x), y0_ = std::min(y0_, p.y);
    width_ = x1 - x0_ + 1, height_ = y1 - y0_ + 1;
    at_.assign(std::size_t(width_) * height_, kNone);
    count_ = std::min(r.size(), view.pixels.size());
    for (std::size_t i = 0; i < count_; ++i)
      at_[index(view.pixels[i])] = float(std::clamp(r[i] / scale_m, -kClip, kClip));
  }

  // Mean product of pixels `lag` apart along x or y, over their mean square.
  double correlation(int lag) const {
    double products = 0, squares = 0;
    for (std::size_t i = 0; i < std::min(count_, kPairs); ++i) {
      const Pixel p = view_.pixels[i];
      const float here = at_[index(p)];
      for (const Pixel q : {Pixel{p.x + lag, p.y}, Pixel{p.x, p.y + lag}}) {
        if (q.x - x0_ >= width_ || q.y - y0_ >= height_) continue;
        const float there = at_[index(q)];
        if (there == kNone) continue;
        products += double(here) * double(there);
        squares += 0.5 * double(here * here + there * there);
      }
    }
    return squares > 0 ? products / squares : 0.0;
  }

 private:
  static constexpr float kNone = 1e9f;

  std::size_t index(Pixel p) const { return std::size_t(p.y - y0_) * width_ + std::size_t(p.x - x0_); }

  const PrimitiveView& view_;
  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
  std::size_t count_ = 0;
  std::vector<float> at_;
};

struct Costs {
  double readings = 0, rays = 0;  // nats per measurement and per outline pixel
};

double seen_rays(const PrimitiveView& view, std::size_t first) {
  const auto end = view.outline.begin() + std::ptrdiff_t(first);
  return double(std::count_if(view.outline.begin(), end,
                              [](const OutlineRay& ray) { return ray.sight != Sight::kLost; }));
}

Costs costs_of(const PrimitiveFit& fit, const PrimitiveView& view, const PrimitiveFitOptions& options,
               double scale_m) {
  PrimitiveEnergyOptions e;
  e.scaling = options.scaling, e.unit_m = fit.unit_m, e.scale_m = scale_m;
  e.points = std::min(options.max_points, kWitnesses), e.rays = std::min(options.max_rays, kWitnesses);
  e.outline_floor = kFloor;
  const PrimitiveEnergy energy(fit.kind, &view, e);
  const std::vector<double> d = energy.clearances(fit.x);
  const double seen = seen_rays(view, d.size());
  Costs out;
  out.readings = energy.readings_cost(fit.x) / double(std::min(view.points.size(), std::size_t(e.points)));
  if (seen > 0) out.rays = energy.outline_cost(d) / seen;
  return out;
}

}  // namespace

double correlated_px2(const PrimitiveFit& fit, const PrimitiveView& view,
                      const PrimitiveFitOptions& options) {
  if (view.pixels.empty()) return 1;
  PrimitiveEnergyOptions e;
  e.scaling = options.scaling, e.unit_m = fit.unit_m, e.points = options.max_points, e.rays = 0;
  std::vector<double> r;
  PrimitiveEnergy(fit.kind, &view, e).residuals(fit.x, &r);
  const ResidualImage image(view, r, fit.scale_m);
  // The integral of the correlation over the plane, by the trapezoidal rule in rings, as far as it is not 0.
  double area = 1, before = 1;
  int last = 0;
  for (const int lag : kLags_px) {
    const double now = image.correlation(lag);
    if (!(now > kUnlike)) break;
    area += 3.14159265358979 * (lag - last) * (before * last + now * lag);
    before = now, last = lag;
  }
  return area;
}

std::vector<KindEvidence> compare_kinds(const std::vector<PrimitiveFit>& fits, const PrimitiveView& view,
                                        const PrimitiveFitOptions& options, int threads) {
  const PrimitiveFit* best = nullptr;  // gives the scale of all kinds and the correlation
  for (const PrimitiveFit& fit : fits)
    if (fit.found && (!best || fit.scale_m < best->scale_m)) best = &fit;
  std::vector<KindEvidence> out(fits.size());
  if (!best) return out;
  const double alike_px2 = correlated_px2(*best, view, options);
  const auto count = double(view.points.size());
  const double effective = std::min(count, std::clamp(count / alike_px2, kLeastEffective, kMostEffective));
  const double rays = seen_rays(view, view.outline.size()) / (kRaysPerPixel * std::sqrt(alike_px2));
  parallel_for(fits.size(), threads, [&](std::size_t k) {
    if (!fits[k].found) return;
    const Costs costs = costs_of(fits[k], view, options, best->scale_m);
    out[k].effective = effective;
    out[k].against = costs.readings * effective + costs.rays * rays +
                     0.5 * free_count(fits[k].kind) * std::log(effective + rays);
  });
  return out;
}

}  // namespace sdftrack::primitives

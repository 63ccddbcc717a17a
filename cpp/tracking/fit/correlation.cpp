// SPDX-License-Identifier: MIT
#include "tracking/fit/correlation.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"
#include "frame/point_ops.h"

namespace sdftrack::tracking {

namespace {

// The window size is the largest that leaves this many windows side by side. Errors count as shared up to a
// window's side, and the variance of the factor is about 1 / kWindows (windows overlap by half).
constexpr int kWindows = 24;
// The fit has set six weighted sums to 0, which reduces the windows' sums as much as three whole windows
// would (measured with white noise on four objects: 2.3 to 3.6).
constexpr double kTaken = 3;
constexpr float kMaxStride_px = 8;

}  // namespace

CorrelationArea::Cell CorrelationArea::window(int x, int y) const {
  Cell total;
  for (int j = y; j < y + 2; ++j)
    for (int i = x; i < x + 2; ++i) {
      const Cell& c = cells_[j * width_ + i];
      total.sum += c.sum, total.square += c.square, total.count += c.count;
    }
  return total;
}

double CorrelationArea::measure(const energies::PixelSet& pixels,
                                const energies::DepthLogistic<float>& penalty, float color_prior) {
  float u0 = 1e9f, v0 = 1e9f, u1 = -1e9f, v1 = -1e9f, steps_px = 0;
  int hits = 0, pairs = 0;
  for (std::size_t i = 0; i < pixels.gain.size(); ++i) {
    if (pixels.gain[i] != 0) continue;
    const float step = i > 0 ? pixels.u_px[i] - pixels.u_px[i - 1] : 0;
    if (step > 0 && step < kMaxStride_px) steps_px += step, ++pairs;
    u0 = std::min(u0, pixels.u_px[i]), u1 = std::max(u1, pixels.u_px[i]);
    v0 = std::min(v0, pixels.v_px[i]), v1 = std::max(v1, pixels.v_px[i]);
    ++hits;
  }
  const double stride_px = pairs > 0 ? double(steps_px) / pairs : 1;        // of a subset of the pixels
  const int side = to_int(std::sqrt(hits * stride_px / (4.0 * kWindows)));  // a window is 2 x 2 cells
  if (side < 1) return 0;
  // A ring of empty cells, so that cells at the border are in four windows too.
  const float per_side = 1.0f / float(side);
  const auto at = [&](float x, float x0) { return 1 + to_int((x - x0) * per_side); };
  width_ = at(u1, u0) + 2, height_ = at(v1, v0) + 2;
  cells_.assign(std::size_t(width_) * height_, {});
  pulls_.resize(pixels.gain.size());
  frame::point_ops_for(used_isa())
      .pulls({penalty, pixels.hit_m.data(), pixels.depth_m.data(), pixels.per_noise.data()}, pixels.count(),
             pulls_.data());
  for (std::size_t i = 0; i < pixels.gain.size(); ++i) {
    if (pixels.gain[i] != 0) continue;
    const float share = color_prior > 0 ? std::min(1.0f, pixels.foreground[i] / color_prior) : 1.0f;
    const float pull = share * pulls_[i];
    Cell& cell = cells_[at(pixels.v_px[i], v0) * width_ + at(pixels.u_px[i], u0)];
    cell.sum += pull, cell.square += pull * pull, cell.count += 1;
  }
  double sums = 0, squares = 0, counts = 0, counts2 = 0;
  for (int y = 0; y + 1 < height_; ++y)
    for (int x = 0; x + 1 < width_; ++x) {
      const Cell w = window(x, y);
      const double sum = w.sum, count = w.count;
      sums += sum * sum, squares += double(w.square);
      counts += count, counts2 += count * count;
    }
  const double apart = counts * counts / (4 * counts2);  // windows that do not overlap
  if (!(squares > 0) || apart < 4 * kTaken) return 0;
  return sums / squares * apart / (apart - kTaken);
}

}  // namespace sdftrack::tracking

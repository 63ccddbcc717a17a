// SPDX-License-Identifier: MIT
#include "tracking/start/color_cut.h"

#include <algorithm>
#include <cmath>

#include "appearance/color_model.h"

namespace sdftrack::tracking {

namespace {

constexpr int kCutRounds = 4;
constexpr int kMeanOver_px = 2;  // to each side, of a pixel's neighbourhood

// The colour bin of each pixel; -1: not known.
std::vector<int> color_bins(const frame::DepthFrame& frame, const Camera& camera, int x0, int y0, int width,
                            int height) {
  const appearance::ColorImage& image = *frame.color;
  const frame::IdealPixel ideal{frame, camera.K.cast<float>(), camera.width};
  std::vector<int> out;
  for (int y = y0; y < y0 + height; ++y)
    for (int x = x0; x < x0 + width; ++x) {
      const float z = frame.depth_m(x, y);
      const Vec2f u = image.map.raw_pixel ? Vec2f{static_cast<float>(x), static_cast<float>(y)} : ideal(x, y);
      int cx = 0, cy = 0;
      float depth = 0;
      out.push_back(z > 0 && image.map.find(u, z, &cx, &cy, &depth) ? appearance::color_bin(image.at(cx, cy))
                                                                    : -1);
    }
  return out;
}

// The log odds that each pixel's colour is of the region, without knowledge 0. The prior is the region's
// share of the pixels: colours that are common around it are not its own, although it may hold some of them.
std::vector<float> log_odds(const std::vector<int>& bins, const frame::PixelMask& region) {
  appearance::ColorCounts counts;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    if (region.on[i])
      counts.add_object(bins[i]);
    else
      counts.add_background(bins[i]);
  }
  const int both = counts.object_pixels + counts.background_pixels;
  appearance::ColorModel model(static_cast<float>(counts.object_pixels) /
                               static_cast<float>(std::max(1, both)));
  model.update(counts, 1, 1);
  std::vector<float> out(bins.size());
  for (std::size_t i = 0; model.known() && i < bins.size(); ++i) {
    if (bins[i] < 0) continue;
    const float p = model.posterior()[static_cast<std::size_t>(bins[i])];
    out[i] = std::log(p / (1 - p));
  }
  return out;
}

// Whether the log odds of the free pixels around it are positive in sum.
bool is_own(const std::vector<float>& odds, const frame::PixelMask& free, int x, int y) {
  float sum = 0;
  for (int v = std::max(0, y - kMeanOver_px); v <= std::min(free.height - 1, y + kMeanOver_px); ++v)
    for (int u = std::max(0, x - kMeanOver_px); u <= std::min(free.width - 1, x + kMeanOver_px); ++u)
      if (free(u, v)) sum += odds[free.at(u, v)];
  return sum > 0;
}

}  // namespace

std::optional<frame::PixelMask> cut_by_color(const frame::DepthFrame& frame, const Camera& camera, int x0,
                                             int y0, const frame::PixelMask& free,
                                             const frame::PixelMask& region, const frame::PixelMask& sure) {
  if (!frame.color || frame::count(region) == static_cast<int>(region.on.size())) return std::nullopt;
  const std::vector<int> bins = color_bins(frame, camera, x0, y0, free.width, free.height);
  frame::PixelMask cut = region;
  for (int k = 0; k < kCutRounds; ++k) {
    const std::vector<float> odds = log_odds(bins, cut);
    frame::PixelMask next(free.width, free.height);
    for (int y = 0; y < free.height; ++y)
      for (int x = 0; x < free.width; ++x)
        next.on[next.at(x, y)] = sure(x, y) || (free(x, y) && is_own(odds, free, x, y));
    if (next == cut) break;
    cut = std::move(next);
  }
  if (cut == region) return std::nullopt;
  return cut;
}

}  // namespace sdftrack::tracking

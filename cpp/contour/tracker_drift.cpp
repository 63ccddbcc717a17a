// SPDX-License-Identifier: MIT
// The grid keeps up with the object: drift correction, and the search for what is lost.
#include <algorithm>
#include <cmath>

#include "contour/tracker.h"
#include "contour/tracker_limits.h"

namespace sdftrack {

namespace {

constexpr double kFound = 0.4;  // of the first contrast, to try a place

}  // namespace

// Moves the grid so that the shape's box lies in its middle, and has as many cells inside as at the start.
void ContourTracker::recentre() {
  ContourGrid& g = grid_;
  int x0 = g.nx, y0 = g.ny, x1 = 0, y1 = 0, inside = 0;
  for (int y = 0; y < g.ny; ++y)
    for (int x = 0; x < g.nx; ++x)
      if (g.phi[static_cast<std::size_t>(y * g.nx + x)] < 0)
        x0 = std::min(x0, x), y0 = std::min(y0, y), x1 = std::max(x1, x), y1 = std::max(y1, y), ++inside;
  if (inside < kLeastPixels) return;
  const double cx = 0.5 * (x0 + x1) - g.mid_x(), cy = 0.5 * (y0 + y1) - g.mid_y();
  double k = first_area_ > 0 ? std::sqrt(inside / first_area_) : 1;
  // Never so large that the background around it would leave the grid.
  k = std::max(k, std::max((x1 - x0 + 2 * kLeastRing_px) / static_cast<double>(g.nx),
                           (y1 - y0 + 2 * kLeastRing_px) / static_cast<double>(g.ny)));
  if (std::max(std::abs(cx), std::abs(cy)) < static_cast<double>(options_.drift_cells) &&
      std::abs(std::log(k)) < static_cast<double>(options_.drift_log_scale))
    return;
  for (std::vector<float>* const values : {&g.phi, &seen_}) {
    if (values->empty()) continue;
    const FlatView from{values->data(), g.nx, g.ny};
    resampled_.resize(g.phi.size());
    for (int y = 0; y < g.ny; ++y)
      for (int x = 0; x < g.nx; ++x) {
        float phi, unused_x, unused_y;
        sample_flat(from, static_cast<float>(k * (x - g.mid_x()) + cx + g.mid_x()),
                    static_cast<float>(k * (y - g.mid_y()) + cy + g.mid_y()), &phi, &unused_x, &unused_y);
        resampled_[static_cast<std::size_t>(y * g.nx + x)] = phi / static_cast<float>(k);
      }
    std::swap(*values, resampled_);
  }
  g.warp.t[0] += g.warp.a[0] * cx + g.warp.a[1] * cy, g.warp.t[1] += g.warp.a[2] * cx + g.warp.a[3] * cy;
  for (double& a : g.warp.a) a *= k;
  redistance(reach_cells(), &evolution_.distance, &g);
}

// What was lost is looked for with its last sure shape, around where that was, farther each frame.
bool ContourTracker::look_around(const RgbView& image) {
  constexpr double kScales[] = {0.8, 1.25};
  constexpr int kStep_px = 8, kMostReach_px = 240;
  grid_.phi = good_phi_, grid_.inside = good_inside_, grid_.warp = good_warp_;
  seen_.clear();
  const double half = 0.5 * good_warp_.scale() * std::max(grid_.nx, grid_.ny);
  const int reach = std::min(kMostReach_px, static_cast<int>(half * (0.5 + 0.1 * lost_frames_)));
  ImagePart part = rect_of(grid_, grid_.all(), image);
  part = {std::max(0, part.x0 - reach), std::max(0, part.y0 - reach), std::min(image.width, part.x1 + reach),
          std::min(image.height, part.y1 + reach)};
  ++lost_frames_;
  if (part.empty()) return false;
  model_.posterior_anywhere(image, part, &posterior_);
  choose_samples(grid_, options_.band, nullptr, &samples_);
  GridWarp best = good_warp_;
  double most = search_place(samples_, posterior_, reach, kStep_px, &best);
  for (const double scale : kScales) {
    GridWarp trial = best;
    for (double& a : trial.a) a *= scale;
    const double contrast = search_place(samples_, posterior_, 2 * kStep_px, kStep_px, &trial);
    if (contrast > most) most = contrast, best = trial;
  }
  report_.contrast = most, report_.confidence = 0;
  if (most < kFound * first_contrast_) return false;
  grid_.warp = best;
  return true;
}

}  // namespace sdftrack

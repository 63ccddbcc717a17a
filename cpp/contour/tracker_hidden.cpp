// SPDX-License-Identifier: MIT
// What a memory of shapes has filled in: where it may be seen again, and what it is looked for by.
#include <algorithm>
#include <limits>

#include "contour/tracker.h"
#include "contour/tracker_limits.h"

namespace sdftrack {

namespace {

constexpr int kHiddenMargin = 6;  // cells that what hides a part may move by in a frame

}  // namespace

// Which of the cells that were hidden are seen now: by the colours there, since no outline is near that could
// move.
void ContourTracker::look_behind() {
  seen_.clear();
  find_band(grid_, std::numeric_limits<float>::max(), &evolution_.band);
  evolution_.foreground.assign(grid_.phi.size(), 0.5f);
  sample_posterior(grid_, posterior_, &evolution_);
  for (int y = kBlur; y + kBlur < grid_.ny; ++y)
    for (int x = kBlur; x + kBlur < grid_.nx; ++x) {
      const auto cell = static_cast<std::size_t>(y * grid_.nx + x);
      if (hidden_[cell] && grid_.phi[cell] < 0 && mean_posterior(x, y) < 0.5f) grid_.phi[cell] = 0.5f;
    }
  redistance(reach_cells(), &evolution_.distance, &grid_);
}

// Cells of the whole shape that were not seen in the last frame, and those beside them, where what hides them
// may be now.
void ContourTracker::find_hidden() {
  if (seen_.empty()) return;
  hidden_.assign(grid_.phi.size(), 0);
  const CellBox box = grid_.inside.grown(0, grid_.nx, grid_.ny);
  for (int y = box.y0; y <= box.y1; ++y)
    for (int x = box.x0; x <= box.x1; ++x) {
      const auto cell = static_cast<std::size_t>(y * grid_.nx + x);
      if (!(grid_.phi[cell] < 0 && seen_[cell] >= 0)) continue;
      const CellBox near = CellBox{x, y, x, y}.grown(kHiddenMargin, grid_.nx, grid_.ny);
      for (int j = near.y0; j <= near.y1; ++j)
        std::fill(hidden_.begin() + j * grid_.nx + near.x0, hidden_.begin() + j * grid_.nx + near.x1 + 1, 1);
    }
}

void ContourTracker::replace_shape(const float* phi) {
  seen_ = grid_.phi;
  std::copy_n(phi, grid_.phi.size(), grid_.phi.data());
  redistance(reach_cells(), &evolution_.distance, &grid_);
  inside_ = 0;
  for (const float p : grid_.phi) inside_ += p < 0;
}

void ContourTracker::look_at_all(const RgbView& image, float* foreground) {
  model_.posterior(image, grid_, grid_.all(), &posterior_, true);
  find_band(grid_, std::numeric_limits<float>::max(), &evolution_.band);
  evolution_.foreground.assign(grid_.phi.size(), 0.5f);
  sample_posterior(grid_, posterior_, &evolution_);
  std::copy(evolution_.foreground.begin(), evolution_.foreground.end(), foreground);
}

}  // namespace sdftrack

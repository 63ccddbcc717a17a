// SPDX-License-Identifier: MIT
#include "tracking/trust/smooth_foreground.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr float kCell_m = 0.0065f;  // three of them are a finger's width
constexpr int kMaxCell_px = 16;
constexpr float kStep_m = 0.012f;  // readings this far apart in depth are of two surfaces
constexpr float kInFront_m = 0.005f, kInFrontPerNoise = 3;
constexpr float kInFrontLogOdds = -6;

}  // namespace

void ForegroundSmoother::smooth(int width, float focal_px, float noise_m, const float* distance_m,
                                energies::PixelSet* pixels) {
  if (pixels->count() == 0) return;
  const float middle_m = pixels->depth_m[pixels->depth_m.size() / 2];
  const int cell_px = std::clamp(static_cast<int>(kCell_m * focal_px / middle_m + 0.5f), 1, kMaxCell_px);
  weigh(std::max(kInFront_m, kInFrontPerNoise * noise_m), distance_m, *pixels);
  gather(width, cell_px, *pixels);
  average(pixels);
}

void ForegroundSmoother::weigh(float in_front_m, const float* distance_m, const energies::PixelSet& pixels) {
  const std::size_t n = pixels.at.size();
  log_odds_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float p = pixels.foreground[i];
    log_odds_[i] = std::log(p / (1 - p));
  }
  if (!distance_m) return;
  for (std::size_t i = 0; i < n; ++i)
    if (distance_m[i] > in_front_m) log_odds_[i] += kInFrontLogOdds;
}

// Into cells of the image, with a border of empty ones.
void ForegroundSmoother::gather(int width, int cell_px, const energies::PixelSet& pixels) {
  const std::size_t n = pixels.at.size();
  const int y0 = pixels.at.front() / width, rows = (pixels.at.back() / width - y0) / cell_px + 3;
  columns_ = (width - 1) / cell_px + 3;
  cells_.assign(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns_), Cell{});
  cell_of_.resize(n);
  int y = y0, next_row = (y0 + 1) * width;  // pixels come row by row
  for (std::size_t i = 0; i < n; ++i) {
    while (pixels.at[i] >= next_row) ++y, next_row += width;
    const int x = pixels.at[i] - (next_row - width);
    cell_of_[i] = ((y - y0) / cell_px + 1) * columns_ + x / cell_px + 1;
    Cell& cell = cells_[static_cast<std::size_t>(cell_of_[i])];
    const float z = pixels.depth_m[i];
    if (cell.count > 0 && std::abs(z - cell.depth_m) > kStep_m) {
      if (z > cell.depth_m) continue;  // of two surfaces the nearer one
      cell = {};
    }
    if (cell.count == 0) cell.depth_m = z;
    cell.log_odds += log_odds_[i], cell.count += 1;
  }
}

void ForegroundSmoother::average(energies::PixelSet* pixels) const {
  for (std::size_t i = 0; i < pixels->at.size(); ++i) {
    float sum = log_odds_[i], count = 1;
    const Cell* const middle = cells_.data() + cell_of_[i];
    for (const int row : {-columns_, 0, columns_})
      for (const Cell* cell = middle + row - 1; cell <= middle + row + 1; ++cell)
        if (std::abs(cell->depth_m - pixels->depth_m[i]) < kStep_m)
          sum += cell->log_odds, count += cell->count;
    pixels->foreground[i] = 1 / (1 + std::exp(-sum / count));
  }
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/trust/smooth_foreground.h"

#include <algorithm>
#include <cmath>

#include "base/fast_math.h"
#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr float kCell_m = 0.0065f;  // three of them are a finger's width
constexpr int kMaxCell_px = 16;
constexpr float kContinues_m = 0.012f;  // measurements this far apart in depth are of two surfaces
constexpr float kForeground_m = 0.005f, kForegroundPerNoise = 3;
constexpr float kInFrontLogOdds = -6;

float logistic(float log_odds) {
  const float e = exp_negative(-std::abs(log_odds));
  return (log_odds < 0 ? e : 1) / (1 + e);
}

}  // namespace

void ForegroundSmoother::smooth(int width, float focal_px, float noise_m, const float* distance_m,
                                float reach_m, energies::PixelSet* pixels) {
  if (pixels->count() == 0) return;
  const float middle_m = pixels->depth_m[pixels->depth_m.size() / 2];
  const int cell_px = std::clamp(to_int(kCell_m * focal_px / middle_m + 0.5f), 1, kMaxCell_px);
  weigh(std::max(kForeground_m, kForegroundPerNoise * noise_m), distance_m, *pixels);
  gather(width, cell_px, *pixels);
  sum_around();
  average(distance_m, reach_m, pixels);
}

void ForegroundSmoother::weigh(float in_front_m, const float* distance_m, const energies::PixelSet& pixels) {
  const std::size_t n = pixels.at.size();
  log_odds_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float p = pixels.foreground[i];
    log_odds_[i] = log_positive(p / (1 - p));
  }
  if (!distance_m) return;
  for (std::size_t i = 0; i < n; ++i)
    if (distance_m[i] > in_front_m) log_odds_[i] += kInFrontLogOdds;
}

// Sorts the pixels into cells of the image, with a border of empty cells.
void ForegroundSmoother::gather(int width, int cell_px, const energies::PixelSet& pixels) {
  const std::size_t n = pixels.at.size();
  const int y0 = pixels.at.front() / width, rows = (pixels.at.back() / width - y0) / cell_px + 3;
  columns_ = (width - 1) / cell_px + 3;
  cells_.assign(std::size_t(rows) * columns_, Cell{});
  cell_of_.resize(n);
  int y = y0, next_row = (y0 + 1) * width;  // pixels come row by row
  for (std::size_t i = 0; i < n; ++i) {
    while (pixels.at[i] >= next_row) ++y, next_row += width;
    const int x = pixels.at[i] - (next_row - width);
    cell_of_[i] = ((y - y0) / cell_px + 1) * columns_ + x / cell_px + 1;
    Cell& cell = cells_[cell_of_[i]];
    const float z = pixels.depth_m[i];
    if (cell.count > 0 && std::abs(z - cell.depth_m) > kContinues_m) {
      if (z > cell.depth_m) continue;  // of two surfaces the nearer one counts
      cell = {};
    }
    if (cell.count == 0) cell.depth_m = z;
    cell.log_odds += log_odds_[i], cell.count += 1;
  }
}

// Sums the three by three cells around each one, for measurements that all of these cells continue.
void ForegroundSmoother::sum_around() {
  around_.resize(cells_.size());
  const auto columns = std::size_t(columns_);
  for (std::size_t row = columns; row + columns < cells_.size(); row += columns)
    for (std::size_t k = row + 1; k + 1 < row + columns; ++k) {
      if (!(cells_[k].count > 0)) continue;
      Around& around = around_[k] = {0, 0, cells_[k].depth_m, cells_[k].depth_m};
      each_around(&cells_[k], [&](const Cell& cell) {
        if (!(cell.count > 0)) return;
        around.log_odds += cell.log_odds, around.count += cell.count;
        around.nearest_m = std::min(around.nearest_m, cell.depth_m);
        around.farthest_m = std::max(around.farthest_m, cell.depth_m);
      });
    }
}

void ForegroundSmoother::average(const float* distance_m, float reach_m, energies::PixelSet* pixels) {
  const std::size_t n = pixels->at.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (distance_m && !(std::abs(distance_m[i]) < reach_m)) continue;
    const auto at = std::size_t(cell_of_[i]);
    const float z = pixels->depth_m[i];
    Around sum = around_[at];
    if (!(z - sum.nearest_m < kContinues_m && sum.farthest_m - z < kContinues_m)) {
      sum = {};
      each_around(&cells_[at], [&](const Cell& cell) {
        if (std::abs(cell.depth_m - z) < kContinues_m) sum.log_odds += cell.log_odds, sum.count += cell.count;
      });
    }
    log_odds_[i] = (log_odds_[i] + sum.log_odds) / (1 + sum.count);
  }
  for (std::size_t i = 0; i < n; ++i) pixels->foreground[i] = logistic(log_odds_[i]);
}

}  // namespace sdftrack::tracking

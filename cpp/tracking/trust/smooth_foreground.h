// SPDX-License-Identifier: MIT
// Colour evidence smoothed over neighbouring measurements: fingers are wider than a pixel, and next to a
// pixel in front of the object, a pixel on its surface may well be the finger's.
#pragma once

#include <vector>

#include "energies/pixel_set.h"

namespace sdftrack::tracking {

class ForegroundSmoother {
 public:
  // Averages the log odds of every pixel's `foreground` over the measurements around it, some 20 mm across,
  // that continue its surface (docs/math/color.md, section 4). width, focal_px: of the depth image that the
  // pixels come from, row by row. distance_m: of each measurement from the surface at a nearly correct pose,
  // or nullptr; one in front by more than the noise counts as another object's. Measurements beyond reach_m
  // from the surface belong to others: their own `foreground` is not averaged.
  void smooth(int width, float focal_px, float noise_m, const float* distance_m, float reach_m,
              energies::PixelSet* pixels);

 private:
  struct Cell {
    float log_odds = 0, count = 0, depth_m = 0;
  };

  struct Around {
    float log_odds = 0, count = 0, nearest_m = 0, farthest_m = 0;
  };

  void weigh(float in_front_m, const float* distance_m, const energies::PixelSet& pixels);
  void gather(int width, int cell_px, const energies::PixelSet& pixels);
  void sum_around();
  template <class Visit>
  void each_around(const Cell* middle, const Visit& visit) const {
    for (const int row : {-columns_, 0, columns_})
      for (const Cell* cell = middle + row - 1; cell <= middle + row + 1; ++cell) visit(*cell);
  }
  void average(const float* distance_m, float reach_m, energies::PixelSet* pixels);

  std::vector<Cell> cells_;
  std::vector<Around> around_;
  int columns_ = 0;
  std::vector<int> cell_of_;
  std::vector<float> log_odds_;
};

}  // namespace sdftrack::tracking

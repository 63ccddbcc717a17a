// SPDX-License-Identifier: MIT
// How many neighbouring pixels share one error, measured from the residuals of a fit.
#pragma once

#include <vector>

#include "energies/penalty.h"
#include "energies/pixel_set.h"

namespace sdftrack::tracking {

// The sum of n independent pulls psi = d cost / d residual has the variance sum psi^2. Where neighbours share
// an error of the sensor or the shape, the sum over a window of the image has more. That factor is the
// correlation area in pixels; the inner matrix of the sandwich is too small by it. White noise gives 1.
class CorrelationArea {
 public:
  // The factor for the pixels whose rays meet the model, from the last hits and depths; 0 for too few.
  // color_prior: of the pixels' posteriors, which then weight them; 0: none.
  double measure(const energies::PixelSet& pixels, const energies::DepthLogistic<float>& penalty,
                 float color_prior = 0);

 private:
  struct Cell {
    float sum = 0, square = 0, count = 0;
  };
  Cell window(int x, int y) const;

  int width_ = 0, height_ = 0;
  std::vector<float> pulls_;
  std::vector<Cell> cells_;
};

}  // namespace sdftrack::tracking

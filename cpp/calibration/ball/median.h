// SPDX-License-Identifier: MIT
// The median of numbers, the mean of the two middle ones if their count is even.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "base/views.h"

namespace sdftrack::calibration {

// The median for every pixel of an image; border pixels are repeated outside.
std::vector<float> median5(const ImageView<float>& image);

// NaN for an empty list. Reorders the values.
inline double median_of(std::vector<double>* values) {
  if (values->empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values->begin() + std::ptrdiff_t(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  if (values->size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values->begin(), middle));
}

// sd of Gaussian residuals from the median of their absolute values.
inline double sd_by_median(const std::vector<double>& residuals) {
  std::vector<double> sizes;
  sizes.reserve(residuals.size());
  for (const double r : residuals) sizes.push_back(r < 0 ? -r : r);
  return 1.4826 * median_of(&sizes);
}

// Tukey's weight of a residual in standard deviations: 95 % efficient where there are no outliers.
inline double tukey_weight(double deviations) {
  constexpr double kReach = 4.685;
  const double u = deviations / kReach, inside = 1 - u * u;
  return inside > 0 ? inside * inside : 0;
}

}  // namespace sdftrack::calibration

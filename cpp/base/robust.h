// SPDX-License-Identifier: MIT
// Robust spread of numbers with outliers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sdftrack {

// sd of a Gaussian with these absolute values, from their 30 % quantile: outliers (a wrong shape, a touching
// hand) are among the largest values. 0 for too few values. Reorders the values.
template <class T>
double robust_sd(std::vector<T>* values) {
  if (values->size() < 20) return 0;
  const auto low = values->begin() + std::ptrdiff_t(3 * values->size() / 10);
  std::nth_element(values->begin(), low, values->end());
  return double(*low) / 0.38532;
}

}  // namespace sdftrack

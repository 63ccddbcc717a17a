// SPDX-License-Identifier: MIT
// Spread of numbers that are not all of one kind.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sdftrack {

// sd of a Gaussian whose absolute values these are, from their 30 % quantile: what fits badly (a shape that
// is off, a touching hand) is among the largest values. 0 for too few. Reorders them.
template <class T>
double robust_sd(std::vector<T>* values) {
  if (values->size() < 20) return 0;
  const auto low = values->begin() + static_cast<std::ptrdiff_t>(3 * values->size() / 10);
  std::nth_element(values->begin(), low, values->end());
  return static_cast<double>(*low) / 0.38532;
}

}  // namespace sdftrack

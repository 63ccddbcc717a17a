// SPDX-License-Identifier: MIT
// Quantiles of a list of numbers, interpolated between neighbours. The list is reordered, and not empty.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace sdftrack {

// Of the two numbers at `place` and after it in order.
template <class T>
T between(std::vector<T>* values, std::size_t place, T share) {
  const auto at = values->begin() + std::ptrdiff_t(place);
  std::nth_element(values->begin(), at, values->end());
  const T low = *at;
  if (at + 1 == values->end()) return low;
  const T high = *std::min_element(at + 1, values->end()), step = high - low;
  return share < T(0.5) ? low + step * share : high - step * (T(1) - share);
}

template <class T>
T quantile(std::vector<T>* values, double share) {
  const double place = share * double(values->size() - 1), whole = std::floor(place);
  return between(values, std::size_t(whole), static_cast<T>(place - whole));
}

// The mean of the two middle numbers if their count is even.
template <class T>
T median(std::vector<T>* values) {
  const std::size_t half = values->size() / 2;
  const auto at = values->begin() + std::ptrdiff_t(half);
  std::nth_element(values->begin(), at, values->end());
  if (values->size() % 2 == 1) return *at;
  const T high = *at, low = *std::max_element(values->begin(), at);
  return (low + high) / T(2);
}

}  // namespace sdftrack

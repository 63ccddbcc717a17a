// SPDX-License-Identifier: MIT
// Standard normal numbers, identical with every C++ standard library that has the same `log`; the method of
// std::normal_distribution depends on the library. Marsaglia's polar method, as in libstdc++.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

namespace sdftrack {

class Normal {
 public:
  double operator()(std::mt19937_64& random) {
    if (has_second_) return has_second_ = false, second_;
    double x, y, square;
    do {
      x = 2 * uniform(random) - 1;
      y = 2 * uniform(random) - 1;
      square = x * x + y * y;
    } while (square > 1 || square == 0);
    const double scale = std::sqrt(-2 * std::log(square) / square);
    second_ = x * scale, has_second_ = true;
    return y * scale;
  }

 private:
  // In [0, 1): the numbers just below 2^64 round up to it.
  static double uniform(std::mt19937_64& random) { return std::min(double(random()) * 0x1p-64, 1 - 0x1p-53); }

  double second_ = 0;
  bool has_second_ = false;
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Conversion of a number to an int. The language does not define the cast of NaN or of a number beyond the
// ints; here every number has the same result on every processor.
#pragma once

#include <type_traits>

#include "base/hd.h"

namespace sdftrack {

// The number without its fraction; the nearest int for a number beyond the ints, and 0 for NaN.
template <class T>
HD constexpr int to_int(T x) requires(std::is_floating_point_v<T>) {
  constexpr int kLeast = -2147483647 - 1, kMost = 2147483647;
  constexpr T kBeyond = T(2147483648.0);  // a power of 2: exact in a float, as kMost is not
  if (x >= kBeyond) return kMost;
  if (x < -kBeyond) return kLeast;
  return x == x ? int(x) : 0;
}

// As to_int, clamped to low..high; `low` for NaN.
template <class T>
HD constexpr int to_int_within(T x, int low, int high) requires(std::is_floating_point_v<T>) {
  const int i = x == x ? to_int(x) : low;
  return i < low ? low : i > high ? high : i;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// From a number to an int. The language leaves the cast open where the number has no int or is none at all;
// here every number has an answer, on every processor the same.
#pragma once

#include <type_traits>

#include "base/hd.h"

namespace sdftrack {

// The number without its fraction; beyond the ints the one at that end, and 0 for what is no number.
template <class T>
HD constexpr int to_int(T x) requires(std::is_floating_point_v<T>) {
  constexpr int kLeast = -2147483647 - 1, kMost = 2147483647;
  constexpr T kBeyond = T(2147483648.0);  // a power of 2: exact in a float, as kMost is not
  if (x >= kBeyond) return kMost;
  if (x < -kBeyond) return kLeast;
  return x == x ? static_cast<int>(x) : 0;
}

// The same, kept within low..high; `low` for what is no number.
template <class T>
HD constexpr int to_int_within(T x, int low, int high) requires(std::is_floating_point_v<T>) {
  const int i = x == x ? to_int(x) : low;
  return i < low ? low : i > high ? high : i;
}

}  // namespace sdftrack

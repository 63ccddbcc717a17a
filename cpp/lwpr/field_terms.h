// SPDX-License-Identifier: MIT
// The prediction of a field at a place, for one field (T = double) or a pack of kFieldLanes fields, shared by
// the CPU's loops and the CUDA kernel. docs/math/lwpr.md, eqs. 1 and 5.
#pragma once

#include <cstring>
#include <type_traits>

#include "lwpr/layout.h"

namespace sdftrack::lwpr {

// Reads number `row` of a block, starting at its lane.
template <class T>
struct LanesAt {
  const double* lane;
  HD T operator()(int row) const {
    T value;
    memcpy(&value, lane + row * kFieldLanes, sizeof(T));
    return value;
  }
};

// |M (x - c)|^2 = q, for any x with x[i]; the activation is exp(-q / 2).
template <int N, class T, class Row>
HD T field_distance2(const FieldLayout& at, LanesAt<T> read, const Row& x) {
  const int n = N > 0 ? N : at.n;
  T q = T{};
  if (at.diagonal) {
    for (int i = 0; i < n; ++i) {
      const T m = (x[i] - read(i)) * read(n + i);
      q = q + m * m;
    }
    return q;
  }
  int k = n;
  for (int i = 0; i < n; ++i) {
    T m = T{};
    for (int j = i; j < n; ++j, ++k) m = m + (x[j] - read(j)) * read(k);
    q = q + m * m;
  }
  return q;
}

// The field's linear function at x.
template <int N, class T, class Row>
HD T field_value(const FieldLayout& at, LanesAt<T> read, const Row& x) {
  const int n = N > 0 ? N : at.n, slope = at.slope();
  T y = read(at.value());
  for (int i = 0; i < n; ++i) y = y + (x[i] - read(i)) * read(slope + i);
  return y;
}

// f(N) with N a constant: the number of inputs if loops are unrolled for it, else 0.
template <class Function>
auto for_inputs(int n, Function f) {
  static_assert(FieldLayout::kMaxUnrolled == 3);
  switch (n) {
    case 1:
      return f(std::integral_constant<int, 1>{});
    case 2:
      return f(std::integral_constant<int, 2>{});
    case 3:
      return f(std::integral_constant<int, 3>{});
    default:
      return f(std::integral_constant<int, 0>{});
  }
}

}  // namespace sdftrack::lwpr

// SPDX-License-Identifier: MIT
// A lane type is a number or a pack of floats (pack.h). Per-pixel formulas are templates on it, and only
// these two files distinguish them: a comparison gives a mask, select(mask, a, b) replaces `mask ? a : b`.
// Every operation gives the same bits in a pack as in a float.
#pragma once

#include <cmath>
#include <cstring>

#include "base/hd.h"
#include "base/to_int.h"

namespace sdftrack {

// The number type of a lane, the type of its indices, and its number of numbers.
template <class T>
struct Lane {
  using Scalar = T;
  using Int = int;
  static constexpr int width = 1;
};
template <class T>
using ScalarOf = typename Lane<T>::Scalar;
template <class T>
using IntOf = typename Lane<T>::Int;
template <class T>
constexpr int kWidth = Lane<T>::width;

template <class T>
HD T select(bool mask, T a, T b) {
  return mask ? a : b;
}
HD int select(bool mask, int a, int b) { return mask ? a : b; }
HD bool any(bool mask) { return mask; }
HD bool all(bool mask) { return mask; }
HD float abs(float x) { return std::abs(x); }
HD double abs(double x) { return std::abs(x); }
HD float sqrt(float x) { return std::sqrt(x); }
HD double sqrt(double x) { return std::sqrt(x); }
HD float copysign(float size, float sign) { return std::copysign(size, sign); }
HD double copysign(double size, double sign) { return std::copysign(size, sign); }
// In a pack, a value beyond the ints gives a result that depends on the processor: the caller must bound it.
HD int truncate(float x) { return to_int(x); }
HD int truncate(double x) { return to_int(x); }
template <class T>
HD T real(int i) requires(kWidth<T> == 1) {
  return static_cast<T>(i);
}
HD int bits_of(float x) {
  int bits;
  memcpy(&bits, &x, sizeof bits);
  return bits;
}
template <class T>
HD float from_bits(int bits) requires(kWidth<T> == 1) {
  float x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

// The first n numbers from p on; n <= kWidth<T>, the rest is 0.
template <class T>
HD T load(const ScalarOf<T>* p, int n) {
  if constexpr (kWidth<T> == 1) {
    return *p;
  } else {
    T x;
    if (n >= kWidth<T>) {
      __builtin_memcpy(&x.v, p, sizeof(x.v));
    } else {
      float some[kWidth<T>] = {};
      for (int k = 0; k < n; ++k) some[k] = p[k];
      __builtin_memcpy(&x.v, some, sizeof(x.v));
    }
    return x;
  }
}
template <class T>
HD void store(T x, ScalarOf<T>* p, int n) {
  if constexpr (kWidth<T> == 1) {
    *p = x;
  } else if (n >= kWidth<T>) {
    __builtin_memcpy(p, &x.v, sizeof(x.v));
  } else {
    for (int k = 0; k < n; ++k) p[k] = x.v[k];
  }
}

// first, first + 1, ... in the first n lanes; the others repeat the last one.
template <class T>
HD IntOf<T> indices(int first, int n) {
  if constexpr (kWidth<T> == 1) {
    return first;
  } else {
    IntOf<T> i;
    for (int k = 0; k < kWidth<T>; ++k) i[k] = first + (k < n ? k : n - 1);
    return i;
  }
}
// As indices(), for the first n of a list of indices that has room for a whole pack.
template <class T>
HD IntOf<T> load_indices(int* list, int n) {
  if constexpr (kWidth<T> == 1) {
    return *list;
  } else {
    for (int k = n; k < kWidth<T>; ++k) list[k] = list[n - 1];
    IntOf<T> i;
    __builtin_memcpy(&i, list, sizeof(i));
    return i;
  }
}
// Whether a lane is one of the first n.
template <class T>
HD auto among_first(int n) {
  if constexpr (kWidth<T> == 1)
    return n > 0;
  else
    return indices<T>(0, kWidth<T>) < n;
}

// Prefetches the memory at p, which need not exist.
HD void prefetch([[maybe_unused]] const void* p) {
#ifndef __CUDA_ARCH__
  __builtin_prefetch(p);
#endif
}

// Appends the indices first, first + 1, ... of the true lanes; `out` has room for a pack. Returns their
// number.
HD int keep(bool mask, int first, int* out) {
  *out = first;
  return mask;
}

template <class T>
HD T gather(const float* p, int i) requires(kWidth<T> == 1) {
  return static_cast<T>(p[i]);
}
// p[i] and p[i + 1]: two neighbouring corners of a cell.
template <class T>
HD void gather_pair(const float* p, int i, T* a, T* b) {
  *a = static_cast<T>(p[i]), *b = static_cast<T>(p[i + 1]);
}

}  // namespace sdftrack

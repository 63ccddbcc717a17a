// SPDX-License-Identifier: MIT
// Connected regions of pixels on a GPU: each pixel has a parent, never a later one, so that a region's root
// is its first pixel whatever the order in which pixels are joined.
#pragma once

#include <cuda_runtime.h>

namespace sdftrack {

__device__ inline int root_of(const int* parent, int i) {
  while (true) {
    const int up = *const_cast<const volatile int*>(parent + i);
    if (up == i) return i;
    i = up;
  }
}

__device__ inline void unite(int* parent, int a, int b) {
  while (true) {
    a = root_of(parent, a), b = root_of(parent, b);
    if (a == b) return;
    const int early = a < b ? a : b, late = a < b ? b : a;
    if (atomicCAS(&parent[late], late, early) == late) return;  // else another thread was first: repeat
  }
}

}  // namespace sdftrack

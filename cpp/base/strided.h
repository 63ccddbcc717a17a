// SPDX-License-Identifier: MIT
// Every stride-th number below n. In 64 bits, because the number after the last may exceed an int.
#pragma once

#include <cstdint>

#include "base/hd.h"

namespace sdftrack {

// work(i), i an int, n at most 2^31 - 1.
template <class Work>
HD void strided(std::int64_t first, std::int64_t stride, std::int64_t n, const Work& work) {
  for (std::int64_t i = first; i < n; i += stride) work(int(i));
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Random samples that are the same with every C++ standard library.
#pragma once

#include <cstddef>
#include <random>
#include <vector>

namespace sdftrack::calibration {

// `count` different numbers below n >= count.
inline std::vector<std::size_t> distinct(std::size_t n, std::size_t count, std::mt19937_64* random) {
  std::vector<std::size_t> out;
  while (out.size() < count) {
    const std::size_t next = (*random)() % n;
    bool fresh = true;
    for (const std::size_t k : out) fresh = fresh && k != next;
    if (fresh) out.push_back(next);
  }
  return out;
}

}  // namespace sdftrack::calibration

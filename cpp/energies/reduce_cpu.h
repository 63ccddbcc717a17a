// SPDX-License-Identifier: MIT
// Sum over pixels on the CPU: fixed chunks, added in order, so the sum has the same bits on any number of
// threads.
#pragma once

#include <algorithm>
#include <vector>

#include "base/parallel.h"

namespace sdftrack {

constexpr int kChunk = 2048;  // pixels; part of the result's bits, so not a tuning knob

constexpr int kBlock = 256;  // pixels summed in Block's own arithmetic (float) before they go into S (double)

// Sum over pixels; add(i, &block) adds pixel i to a Block, and S += Block.
template <class S, class Block = S, class Add>
S reduce_cpu(int count, int threads, const Add& add) {
  const auto chunks = static_cast<std::size_t>((count + kChunk - 1) / kChunk);
  const auto chunk_sum = [&](std::size_t c) {
    S sum{};
    const int begin = static_cast<int>(c) * kChunk, end = std::min(count, begin + kChunk);
    for (int first = begin; first < end; first += kBlock) {
      Block block{};
      for (int i = first; i < std::min(end, first + kBlock); ++i) add(i, &block);
      sum += block;
    }
    return sum;
  };
  S total{};
  if (threads == 1 || chunks <= 1) {
    for (std::size_t c = 0; c < chunks; ++c) total += chunk_sum(c);
    return total;
  }
  std::vector<S> partial(chunks);
  parallel_for(chunks, threads, [&](std::size_t c) { partial[c] = chunk_sum(c); });
  for (const S& s : partial) total += s;
  return total;
}

}  // namespace sdftrack

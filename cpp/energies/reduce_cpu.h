// SPDX-License-Identifier: MIT
// Sum over pixels on the CPU: fixed chunks, added in order: the same bits on any number of threads.
#pragma once

#include <algorithm>
#include <vector>

#include "base/parallel.h"

namespace sdftrack::energies {

constexpr int kChunk = 2048;  // pixels; part of the result's bits, so not a tuning knob
// A chunk takes a few microseconds, as long as waking a thread. The caller sums fewer chunks itself.
constexpr std::size_t kChunksWorthThreads = 16;

// Sum of sum_of(begin, end) over the chunks of 0..count-1.
template <class S, class SumOf>
S reduce_cpu(int count, int threads, const SumOf& sum_of) {
  const auto chunks = std::size_t((count + kChunk - 1) / kChunk);
  const auto chunk_sum = [&](std::size_t c) {
    const int begin = int(c) * kChunk;
    return sum_of(begin, std::min(count, begin + kChunk));
  };
  S total{};
  if (threads == 1 || chunks < kChunksWorthThreads) {
    for (std::size_t c = 0; c < chunks; ++c) total += chunk_sum(c);
    return total;
  }
  std::vector<S> partial(chunks);
  parallel_for(chunks, threads, [&](std::size_t c) { partial[c] = chunk_sum(c); });
  for (const S& s : partial) total += s;
  return total;
}

}  // namespace sdftrack::energies

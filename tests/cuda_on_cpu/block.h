// SPDX-License-Identifier: MIT
// The threads of a block: where each is, and how they wait for each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

namespace cuda_on_cpu {

struct Index {
  unsigned x = 0, y = 0, z = 0;
};
inline constinit thread_local Index threadIdx, blockIdx, blockDim, gridDim;

// Runs `as_each_thread` as every thread of every block; `seed` gives the order. std::runtime_error: threads
// that wait for each other at different places, or what a thread throws.
void run_grid(Index grid, Index block, std::uint64_t seed, const std::function<void()>& as_each_thread);

// The following are called by threads of a block.
void wait_for_block();
void wait_for_warp(unsigned mask);
void let_others_run();  // now and then
int lane();
// What the thread of lane `from` gives for `bits`; its own where there is no such lane.
std::uint64_t exchange(unsigned mask, std::uint64_t bits, int from);
// Memory of the block, the same for the same key; filled with 0xff.
void* shared_memory(const void* key, std::size_t bytes, std::size_t alignment);

}  // namespace cuda_on_cpu

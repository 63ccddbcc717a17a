// SPDX-License-Identifier: MIT
// Under ThreadSanitizer each thread of a block is one of the system, and blocks run at once, so that it sees
// every access that no barrier and no atomic orders. Shuffles of parts of a warp are not supported.
#include "block.h"

#if defined(__SANITIZE_THREAD__)
#include <array>
#include <barrier>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace cuda_on_cpu {

namespace {

constexpr unsigned kBlocksAtOnce = 2;

struct Block {
  explicit Block(std::size_t count) : all(static_cast<std::ptrdiff_t>(count)), given(count) {
    for (std::size_t first = 0; first < count; first += 32)
      warps.push_back(std::make_unique<std::barrier<>>(
          static_cast<std::ptrdiff_t>(std::min<std::size_t>(32, count - first))));
  }
  std::barrier<> all;
  std::vector<std::unique_ptr<std::barrier<>>> warps;
  std::vector<std::uint64_t> given;
  std::mutex mutex;
  std::map<const void*, std::vector<std::max_align_t>> memory;
};

thread_local Block* current = nullptr;
thread_local std::size_t me = 0;

}  // namespace

void run_grid(Index grid, Index block, std::uint64_t, const std::function<void()>& as_each_thread) {
  const std::size_t count = std::size_t{block.x} * block.y * block.z;
  const unsigned blocks = grid.x * grid.y * grid.z;
  for (unsigned first = 0; first < blocks; first += kBlocksAtOnce) {
    std::vector<std::unique_ptr<Block>> running;
    std::vector<std::thread> threads;
    for (unsigned b = first; b < std::min(blocks, first + kBlocksAtOnce); ++b) {
      running.push_back(std::make_unique<Block>(count));
      for (std::size_t t = 0; t < count; ++t)
        threads.emplace_back([&, b, t, at = running.back().get()] {
          const auto i = static_cast<unsigned>(t);
          current = at, me = t, gridDim = grid, blockDim = block;
          blockIdx = {b % grid.x, b / grid.x % grid.y, b / (grid.x * grid.y)};
          threadIdx = {i % block.x, i / block.x % block.y, i / (block.x * block.y)};
          as_each_thread();
          at->all.arrive_and_drop();
          at->warps[t / 32]->arrive_and_drop();
        });
    }
    for (std::thread& thread : threads) thread.join();
  }
}

void wait_for_block() { current->all.arrive_and_wait(); }
void wait_for_warp(unsigned) { current->warps[me / 32]->arrive_and_wait(); }
void let_others_run() {}
int lane() { return static_cast<int>(me % 32); }

std::uint64_t exchange(unsigned mask, std::uint64_t bits, int from) {
  current->given[me] = bits;
  wait_for_warp(mask);
  const std::size_t other = me - me % 32 + static_cast<std::size_t>(from);
  const std::uint64_t got =
      from >= 0 && from < 32 && other < current->given.size() ? current->given[other] : bits;
  wait_for_warp(mask);
  return got;
}

void* shared_memory(const void* key, std::size_t bytes, std::size_t) {
  const std::lock_guard lock(current->mutex);
  auto& memory = current->memory[key];
  if (memory.empty()) {
    memory.resize((bytes + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t));
    std::memset(memory.data(), 0xff, memory.size() * sizeof(std::max_align_t));
  }
  return memory.data();
}

}  // namespace cuda_on_cpu
#endif

// SPDX-License-Identifier: MIT
// Blocks whose threads are fibers of one thread of the system; block_threads.cpp has those of
// ThreadSanitizer.
#include "block.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#if !defined(__SANITIZE_THREAD__)
#include "fiber.h"

namespace cuda_on_cpu {

namespace {

constexpr std::size_t kMostShared = 48 << 10;  // what a kernel may have without asking for more

enum class At { kReady, kBlock, kWarp, kEnd };

struct Thread {
  Fiber fiber;
  At at = At::kReady;
  unsigned mask = 0;                     // at kWarp: whom it waits for
  bool turn = false;                     // of exchange()
  std::array<std::uint64_t, 3> given{};  // two in turn for whole warps, one for parts of them
};

// The threads' stacks are kept from block to block.
class Block {
 public:
  void run(Index block, Index index, std::uint64_t seed, const std::function<void()>& as_each_thread);

  void wait(At at, unsigned mask) {
    Thread& t = *threads_[me_];
    t.at = at, t.mask = mask;
    t.fiber.yield();
  }
  void let_others_run() {
    if (random_() % 8 == 0) threads_[me_]->fiber.yield();
  }
  std::uint64_t exchange(unsigned mask, std::uint64_t bits, int from);
  void* shared(const void* key, std::size_t bytes);
  int lane() const { return static_cast<int>(me_ % 32); }

 private:
  bool resume_all();
  bool release();
  bool release_warp(std::size_t first);

  std::vector<std::unique_ptr<Thread>> threads_;
  std::vector<std::size_t> order_;
  std::size_t count_ = 0, me_ = 0;
  Index dim_;
  std::map<const void*, std::vector<char>> memory_;  // no byte more than asked for
  std::map<const void*, std::size_t> used_;          // by this block
  std::minstd_rand random_;
  std::exception_ptr error_;
};

thread_local Block* current = nullptr;

void Block::run(Index dim, Index index, std::uint64_t seed, const std::function<void()>& as_each_thread) {
  count_ = std::size_t{dim.x} * dim.y * dim.z, dim_ = dim;
  random_.seed(static_cast<unsigned>(seed ^ (seed >> 32)));
  while (threads_.size() < count_) threads_.push_back(std::make_unique<Thread>());
  order_.resize(count_);
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  for (auto& [key, memory] : memory_) std::memset(memory.data(), 0xff, memory.size());
  error_ = nullptr;
  used_.clear();
  for (std::size_t t = 0; t < count_; ++t) {
    threads_[t]->at = At::kReady;
    threads_[t]->fiber.start([this, t, &as_each_thread] {
      try {
        as_each_thread();
      } catch (...) {
        error_ = std::current_exception();
      }
      threads_[t]->at = At::kEnd;
    });
  }
  blockIdx = index, blockDim = dim;
  current = this;
  while (resume_all() || release())
    if (error_) break;
  current = nullptr;
  if (error_) std::rethrow_exception(error_);
  if (std::any_of(threads_.begin(), threads_.begin() + static_cast<std::ptrdiff_t>(count_),
                  [](const auto& t) { return t->at != At::kEnd; }))
    throw std::runtime_error("threads of a block wait for each other at different places");
}

bool Block::resume_all() {
  std::shuffle(order_.begin(), order_.end(), random_);
  bool any = false;
  for (const std::size_t t : order_) {
    if (threads_[t]->at != At::kReady) continue;
    any = true, me_ = t;
    const auto i = static_cast<unsigned>(t);
    threadIdx = {i % dim_.x, i / dim_.x % dim_.y, i / (dim_.x * dim_.y)};
    threads_[t]->fiber.resume();
  }
  return any;
}

// Those that wait and now have all that they wait for.
bool Block::release() {
  std::size_t waiting = 0, ended = 0;
  for (std::size_t t = 0; t < count_; ++t)
    waiting += threads_[t]->at == At::kBlock, ended += threads_[t]->at == At::kEnd;
  bool any = waiting > 0 && waiting + ended == count_;
  if (any)
    for (std::size_t t = 0; t < count_; ++t)
      if (threads_[t]->at == At::kBlock) threads_[t]->at = At::kReady;
  for (std::size_t first = 0; first < count_; first += 32) any = release_warp(first) || any;
  return any;
}

bool Block::release_warp(std::size_t first) {
  const std::size_t lanes = std::min<std::size_t>(32, count_ - first);
  unsigned waiting = 0;
  for (std::size_t k = 0; k < lanes; ++k)
    if (threads_[first + k]->at == At::kWarp) waiting |= 1u << k;
  const unsigned all = lanes == 32 ? 0xffffffffu : (1u << lanes) - 1;
  bool any = false;
  for (std::size_t k = 0; k < lanes; ++k) {
    const unsigned mask = threads_[first + k]->mask & all;
    if (!(waiting >> k & 1u) || (mask & waiting) != mask) continue;
    for (std::size_t j = 0; j < lanes; ++j)
      if (mask >> j & 1u) threads_[first + j]->at = At::kReady;
    waiting &= ~mask, any = true;
  }
  return any;
}

// For whole warps the slots alternate: none is written again before all have read it.
std::uint64_t Block::exchange(unsigned mask, std::uint64_t bits, int from) {
  const std::size_t me = me_, first = me - me % 32;
  Thread& t = *threads_[me];
  const bool whole = mask == 0xffffffffu;
  const std::size_t slot = whole ? static_cast<std::size_t>(t.turn = !t.turn) : 2;
  t.given[slot] = bits;
  wait(At::kWarp, mask);
  const std::size_t other = first + static_cast<std::size_t>(from);
  const bool there = from >= 0 && from < 32 && other < count_ && (mask >> from & 1u);
  const std::uint64_t got = there ? threads_[other]->given[slot] : bits;
  if (!whole) wait(At::kWarp, mask);
  return got;
}

void* Block::shared(const void* key, std::size_t bytes) {
  if (used_.emplace(key, bytes).second) {
    std::size_t all = 0;
    for (const auto& [other, size] : used_) all += size;
    if (all > kMostShared) throw std::runtime_error("more than 48 KB of memory for a block");
  }
  auto& memory = memory_[key];
  if (memory.empty()) {
    memory.resize(bytes, '\xff');
  }
  return memory.data();
}

}  // namespace

void run_grid(Index grid, Index block, std::uint64_t seed, const std::function<void()>& as_each_thread) {
  thread_local Block here;
  std::minstd_rand random(static_cast<unsigned>(seed));
  std::vector<unsigned> order(std::size_t{grid.x} * grid.y * grid.z);
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), random);
  gridDim = grid;
  for (const unsigned b : order)
    here.run(block, {b % grid.x, b / grid.x % grid.y, b / (grid.x * grid.y)}, seed + b, as_each_thread);
}

void wait_for_block() { current->wait(At::kBlock, 0); }
void wait_for_warp(unsigned mask) { current->wait(At::kWarp, mask); }
void let_others_run() { current->let_others_run(); }
int lane() { return current->lane(); }
std::uint64_t exchange(unsigned mask, std::uint64_t bits, int from) {
  return current->exchange(mask, bits, from);
}
void* shared_memory(const void* key, std::size_t bytes, std::size_t) { return current->shared(key, bytes); }

}  // namespace cuda_on_cpu
#endif

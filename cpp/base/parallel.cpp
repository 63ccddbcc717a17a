// SPDX-License-Identifier: MIT
#include "base/parallel.h"

#include <atomic>

#include "base/cpu_count.h"

#ifdef __unix__
#include <pthread.h>
#endif

namespace sdftrack {

namespace {

std::atomic<ThreadPool*> the_pool{nullptr};

// The child has only the thread that forked. The parent's pool is not freed: its memory may be in any state.
#ifdef __unix__
const int forgotten_in_children =
    pthread_atfork(nullptr, nullptr, [] { the_pool.store(nullptr, std::memory_order_relaxed); });
#endif

// Counted when the library is loaded: a fork could interrupt a count under a lock.
const int processors = usable_cpus();

}  // namespace

int thread_count(int requested) { return requested <= 0 ? processors : requested; }

ThreadPool* shared_pool() {
  ThreadPool* pool = the_pool.load(std::memory_order_acquire);
  if (!pool) {
    if (processors == 1) return nullptr;
    auto* const made = new ThreadPool(processors - 1);
    if (the_pool.compare_exchange_strong(pool, made, std::memory_order_acq_rel))
      pool = made;
    else
      delete made;  // another thread was first
  }
  return pool->workers() > 0 ? pool : nullptr;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Parallel loops over fixed chunks, on the threads of one pool.
#pragma once

#include <cstddef>

#include "base/thread_pool.h"

namespace sdftrack {

// Number of threads for a call that requests `requested`; 0: all processors that this process may use (by its
// affinity and its control group's quota).
int thread_count(int requested);

// The pool of this process, created at first use and never destroyed; nullptr if no thread could help. A
// forked child creates a new one.
ThreadPool* shared_pool();

// Calls body(chunk) once for each chunk in 0..chunks-1, on up to `threads` threads (0: all processors),
// including the caller's. Any thread may run a chunk, but the chunks must be fixed: then results that are
// combined in chunk order do not depend on the number of threads. After the first exception no chunk starts,
// and the exception is rethrown here. May be called by several threads at once, and within a chunk.
template <class Body>
void parallel_for(std::size_t chunks, int threads, const Body& body) {
  const int requested = thread_count(threads);
  ThreadPool* const pool = requested > 1 && chunks > 1 ? shared_pool() : nullptr;
  if (!pool) {
    for (std::size_t i = 0; i < chunks; ++i) body(i);
    return;
  }
  pool->run(chunks, requested - 1, ChunkBody(body));
}

}  // namespace sdftrack

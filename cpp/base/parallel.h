// SPDX-License-Identifier: MIT
// Parallel loops over fixed chunks. The one place that makes threads.
#pragma once

#include <cstddef>
#include <functional>

namespace sdftrack {

// Number of threads to use when the caller asks for `requested` (0: all cores).
int thread_count(int requested);

// Calls body(chunk) once for each chunk in 0..chunks-1, on up to `threads` threads (0: all cores). The
// caller's thread takes part. Which thread runs a chunk is not fixed, what a chunk is must be: then results
// that are combined in chunk order do not depend on the number of threads. The first exception is rethrown
// here.
void parallel_for(std::size_t chunks, int threads, const std::function<void(std::size_t)>& body);

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Phases of parallel work, one after another: bands of rows, and steps that are done once.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "base/parallel.h"

namespace sdftrack::superpixels {

class Phases {
 public:
  // `threads` 0: all processors.
  Phases(int threads, int bands)
      : threads_(std::clamp(thread_count(threads), 1, std::max(1, bands))),
        bands_(bands),
        shares_(threads_ == 1 ? 1 : std::min(bands, 4 * threads_)),
        next_(std::size_t(threads_)) {}

  // work(band) for all bands.
  template <class Work>
  void each(const Work& work) {
    hand_out(bands_, work);
  }
  // The same for some bands at a time: work(first, end). The ranges depend on the number of threads, so the
  // result must not depend on them.
  template <class Work>
  void each_share(const Work& work) {
    hand_out(shares_,
             [&](int share) { work(part_of(bands_, share, shares_), part_of(bands_, share + 1, shares_)); });
  }

 private:
  struct alignas(64) Counter {
    std::atomic<int> value{0};
  };
  static int part_of(int all, int part, int parts) {
    return int(static_cast<std::int64_t>(all) * part / parts);
  }
  // A thread does its own part first, whose rows its caches hold from the phases before, then the remaining
  // work of the others, which is all of it if no other thread came.
  template <class Work>
  void hand_out(int count, const Work& work) {
    for (Counter& next : next_) next.value.store(0, std::memory_order_relaxed);
    parallel_for(threads_, threads_, [&](std::size_t) {
      const int self = ThreadPool::thread_number();
      for (int other = 0; other < threads_; ++other) {
        const int part = (self + other) % threads_, begin = part_of(count, part, threads_),
                  end = part_of(count, part + 1, threads_);
        std::atomic<int>& next = next_[part].value;
        for (int i = begin + next.fetch_add(1, std::memory_order_relaxed); i < end;
             i = begin + next.fetch_add(1, std::memory_order_relaxed))
          work(i);
      }
    });
  }

  const int threads_, bands_, shares_;
  std::vector<Counter> next_;  // of each part
};

}  // namespace sdftrack::superpixels

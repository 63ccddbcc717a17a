// SPDX-License-Identifier: MIT
// What threads do together, one phase after another: bands of rows, and what then is done once.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace sdftrack {

// What they share.
class Together {
 public:
  Together(int threads, int bands)
      : threads_(threads),
        bands_(bands),
        shares_(threads == 1 ? 1 : std::min(bands, 4 * threads)),
        next_(static_cast<std::size_t>(threads)) {}

 private:
  friend class Phases;
  struct alignas(64) Counter {
    std::atomic<int> value{0};
  };
  const int threads_, bands_, shares_;
  std::vector<Counter> next_;  // of each thread's part
  std::atomic<int> here_{0};
  std::atomic<unsigned> phase_{0};
};

// For one of the threads.
class Phases {
 public:
  Phases(Together* all, int self) : all_(*all), self_(self) {}

  // work(band) for all bands; then() by the thread that is done last, before any goes on.
  template <class Work, class Then>
  void each(const Work& work, const Then& then) {
    hand_out(all_.bands_, work);
    meet(then);
  }
  template <class Work>
  void each(const Work& work) {
    each(work, [] {});
  }
  // By one of them, when all are here.
  template <class Work>
  void once(const Work& work) {
    meet(work);
  }
  // The same for some bands at a time, one after another: work(first, end). What they are depends on the
  // number of threads, so what comes of it must not depend on them.
  template <class Work, class Then>
  void each_share(const Work& work, const Then& then) {
    hand_out(all_.shares_, [&](int share) {
      work(part_of(all_.bands_, share, all_.shares_), part_of(all_.bands_, share + 1, all_.shares_));
    });
    meet(then);
  }

 private:
  static int part_of(int all, int part, int parts) {
    return static_cast<int>(static_cast<std::int64_t>(all) * part / parts);
  }
  // A thread's own part first, in which it has been before, then what others have left.
  template <class Work>
  void hand_out(int count, const Work& work) {
    const int threads = all_.threads_;
    for (int other = 0; other < threads; ++other) {
      const int part = (self_ + other) % threads, begin = part_of(count, part, threads),
                end = part_of(count, part + 1, threads);
      std::atomic<int>& next = all_.next_[static_cast<std::size_t>(part)].value;
      for (int i = begin + next++; i < end; i = begin + next++) work(i);
    }
  }
  template <class Then>
  void meet(const Then& then) {
    const unsigned now = all_.phase_.load(std::memory_order_relaxed);
    if (++all_.here_ < all_.threads_) return wait_while(now);
    then();
    for (auto& next : all_.next_) next.value = 0;
    all_.here_ = 0;
    all_.phase_.store(now + 1, std::memory_order_release);
    all_.phase_.notify_all();
  }
  // Awake for about as long as a band takes: to be woken takes longer. Others may have the processor
  // meanwhile.
  void wait_while(unsigned now) {
    constexpr int kAwake = 100;
    for (int i = 0; i < kAwake; ++i) {
      if (all_.phase_.load(std::memory_order_acquire) != now) return;
      std::this_thread::yield();
    }
    all_.phase_.wait(now, std::memory_order_acquire);
  }

  Together& all_;
  const int self_;
};

}  // namespace sdftrack

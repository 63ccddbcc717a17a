// SPDX-License-Identifier: MIT
// What threads do together, one phase after another: bands handed out one by one, and what then is done once.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>

namespace sdftrack {

class Phases {
 public:
  // More shares than threads, since they do not take equally long.
  Phases(int threads, int bands)
      : threads_(threads), bands_(bands), shares_(threads == 1 ? 1 : std::min(bands, 4 * threads)) {}

  // work(band) for all bands; then() by the thread that is done last, before any goes on.
  template <class Work, class Then>
  void each(const Work& work, const Then& then) {
    for (int band = next_++; band < bands_; band = next_++) work(band);
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
    const auto border = [this](int share) {
      return static_cast<int>(static_cast<std::int64_t>(bands_) * share / shares_);
    };
    for (int share = next_++; share < shares_; share = next_++) work(border(share), border(share + 1));
    meet(then);
  }

 private:
  template <class Then>
  void meet(const Then& then) {
    const unsigned now = phase_.load(std::memory_order_relaxed);
    if (++here_ < threads_) return wait_while(now);
    then();
    next_ = 0, here_ = 0;
    phase_.store(now + 1, std::memory_order_release);
    phase_.notify_all();
  }
  // Awake for about as long as a band takes: to be woken takes longer. Others may have the processor
  // meanwhile.
  void wait_while(unsigned now) {
    constexpr int kAwake = 100;
    for (int i = 0; i < kAwake; ++i) {
      if (phase_.load(std::memory_order_acquire) != now) return;
      std::this_thread::yield();
    }
    phase_.wait(now, std::memory_order_acquire);
  }

  const int threads_, bands_, shares_;
  std::atomic<int> next_{0}, here_{0};
  std::atomic<unsigned> phase_{0};
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// What threads do together, one phase after another: bands handed out one by one, or something done once.
#pragma once

#include <atomic>
#include <barrier>

namespace sdftrack {

class Phases {
 public:
  Phases(int threads, int bands) : bands_(bands), done_(threads, Again{&next_}) {}
  template <class Work>
  void each(const Work& work) {
    for (int band = next_++; band < bands_; band = next_++) work(band);
    done_.arrive_and_wait();
  }
  template <class Work>
  void once(const Work& work) {
    if (next_++ == 0) work();
    done_.arrive_and_wait();
  }

 private:
  struct Again {
    std::atomic<int>* next;
    void operator()() noexcept { *next = 0; }
  };
  const int bands_;
  std::atomic<int> next_{0};
  std::barrier<Again> done_;
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <vector>

#include "base/parallel.h"
#include "superpixels/phases.h"

namespace sdftrack {
namespace {

constexpr int kRounds = 200;  // enough for threads to sleep in some and to stay awake in others

class PhasesOf : public testing::TestWithParam<int> {
 protected:
  // body(phases) on all threads.
  template <class Body>
  void together(int bands, const Body& body) {
    const int threads = GetParam();
    Together all(threads, bands);
    parallel_for(static_cast<std::size_t>(threads), threads, [&](std::size_t worker) {
      Phases phases(&all, static_cast<int>(worker));
      body(&phases);
    });
  }
};

TEST_P(PhasesOf, threads_do_every_band_once_before_what_follows_and_that_before_the_next_phase) {
  constexpr int kBands = 13;         // no multiple of the threads
  std::vector<int> done(kBands, 0);  // no atomics: phases are what keeps threads apart
  int followed = 0, wrong = 0;
  together(kBands, [&](Phases* phases) {
    for (int round = 0; round < kRounds; ++round) {
      phases->each([&](int band) { done[static_cast<std::size_t>(band)] += followed == round; },
                   [&] {
                     for (const int n : done) wrong += n != round + 1;
                     ++followed;
                   });
    }
  });
  EXPECT_EQ(followed, kRounds);
  EXPECT_EQ(wrong, 0);
}

TEST_P(PhasesOf, shares_are_all_bands_without_a_gap) {
  for (const int bands : {1, 3, 30}) {
    std::vector<int> done(static_cast<std::size_t>(bands), 0);
    int followed = 0;
    together(bands, [&](Phases* phases) {
      phases->each_share(
          [&](int first, int end) {
            for (int band = first; band < end; ++band) ++done[static_cast<std::size_t>(band)];
          },
          [&] { ++followed; });
      phases->once([&] { followed += 10; });
    });
    EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(bands), 1)) << bands;
    EXPECT_EQ(followed, 11);
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, PhasesOf, testing::Values(1, 2, 5));

}  // namespace
}  // namespace sdftrack

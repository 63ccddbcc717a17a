// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "superpixels/phases.h"

namespace sdftrack {
namespace {

constexpr int kRounds = 200;  // enough for threads to sleep in some and to stay awake in others

class PhasesOf : public testing::TestWithParam<int> {};

TEST_P(PhasesOf, threads_do_every_band_once_before_what_follows_and_that_before_the_next_phase) {
  constexpr int kBands = 13;         // no multiple of the threads
  std::vector<int> done(kBands, 0);  // no atomics: phases are what keeps threads apart
  superpixels::Phases phases(GetParam(), kBands);
  for (int round = 0; round < kRounds; ++round) {
    phases.each([&](int band) { done[static_cast<std::size_t>(band)] += 1; });
    for (const int n : done) ASSERT_EQ(n, round + 1);
  }
}

TEST_P(PhasesOf, shares_are_all_bands_without_a_gap) {
  for (const int bands : {1, 3, 30}) {
    std::vector<int> done(static_cast<std::size_t>(bands), 0);
    superpixels::Phases phases(GetParam(), bands);
    phases.each_share([&](int first, int end) {
      for (int band = first; band < end; ++band) ++done[static_cast<std::size_t>(band)];
    });
    EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(bands), 1)) << bands;
  }
}

TEST_P(PhasesOf, an_exception_in_a_phase_comes_to_the_caller_and_leaves_the_next_phase_whole) {
  constexpr int kBands = 9;
  superpixels::Phases phases(GetParam(), kBands);
  const auto fails = [](int band) {
    if (band == 4) throw std::runtime_error("band 4");
  };
  EXPECT_THROW(phases.each(fails), std::runtime_error);
  std::vector<int> done(kBands, 0);
  phases.each([&](int band) { ++done[static_cast<std::size_t>(band)]; });
  EXPECT_EQ(done, std::vector<int>(kBands, 1));
}

INSTANTIATE_TEST_SUITE_P(Threads, PhasesOf, testing::Values(1, 2, 5));

}  // namespace
}  // namespace sdftrack

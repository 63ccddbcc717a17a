// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "tracking/alternatives.h"

namespace sdftrack {
namespace {

constexpr double kSharedPx = 50;
constexpr int kPixels = 1000;

// A fit whose last stage has this mean cost, and of whose 100 surface points so many agree.
tracking::Fitted fit_of(double mean_cost, int agree, int pixels = kPixels) {
  tracking::Fitted fitted;
  fitted.seen.expected = 100, fitted.seen.agree = agree, fitted.seen.farther = 100 - agree;
  fitted.seen.gap_m = 0.001;
  tracking::TrackStep last{};
  last.pixels = pixels, last.step.cost = mean_cost * pixels;
  fitted.steps.push_back(last);
  return fitted;
}

double between(const tracking::Fitted& a, const tracking::Fitted& b) {
  return tracking::log_odds_between(a, b, {}, kSharedPx);
}

TEST(Alternatives, equal_fits_leave_the_odds_even) {
  EXPECT_DOUBLE_EQ(between(fit_of(0.3, 90), fit_of(0.3, 90)), 0);
}

TEST(Alternatives, a_lower_cost_counts_once_for_each_independent_patch) {
  EXPECT_NEAR(between(fit_of(0.3, 90), fit_of(0.4, 90)), 0.1 * kPixels / kSharedPx, 1e-9);
  EXPECT_NEAR(between(fit_of(0.3, 90), fit_of(0.4, 90, 500)), 0.1 * 500 / kSharedPx, 1e-9);
}

TEST(Alternatives, what_speaks_for_one_speaks_against_the_other) {
  const tracking::Fitted good = fit_of(0.3, 95), bad = fit_of(0.35, 40);
  EXPECT_GT(between(good, bad), 0.05 * kPixels / kSharedPx);  // the surface that does not agree counts too
  EXPECT_NEAR(between(good, bad), -between(bad, good), 1e-9);
}

}  // namespace
}  // namespace sdftrack

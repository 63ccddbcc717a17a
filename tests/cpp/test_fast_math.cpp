// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>

#include "base/fast_math.h"

namespace sdftrack {
namespace {

TEST(FastMath, exp_of_a_negative_number_has_the_stated_error) {
  double worst = 0;
  for (float x = -80.0f; x <= 0.0f; x += 0.00037f)
    worst = std::max(worst, std::abs(exp_negative(x) / std::exp(static_cast<double>(x)) - 1));
  EXPECT_LT(worst, 8e-6);  // near -80 the rounding of x / ln 2 counts; near 0, where weights matter:
  worst = 0;
  for (float x = -4.0f; x <= 0.0f; x += 0.00037f)
    worst = std::max(worst, std::abs(exp_negative(x) / std::exp(static_cast<double>(x)) - 1));
  EXPECT_LT(worst, 4e-7);
  EXPECT_EQ(exp_negative(0.0f), 1.0f);
  EXPECT_LT(exp_negative(-1e30f), 1e-37f);
}

TEST(FastMath, log_of_a_positive_number_has_the_stated_error) {
  double worst = 0;
  for (float x = 1e-3f; x < 3.0f; x *= 1.0007f)
    worst =
        std::max(worst, std::abs(static_cast<double>(log_positive(x)) - std::log(static_cast<double>(x))));
  EXPECT_LT(worst, 4e-7);
  EXPECT_NEAR(log_positive(1.0f), 0.0f, 1e-7f);
}

}  // namespace
}  // namespace sdftrack

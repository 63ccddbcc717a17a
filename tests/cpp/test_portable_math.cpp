// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "base/portable_math.h"

namespace sdftrack {
namespace {

TEST(PortableMath, is_as_right_as_the_c_library) {
  for (double x = -6.5; x <= 6.5; x += 0.00137) {
    EXPECT_NEAR(error_function(x), std::erf(x), 4e-16 + 2e-15 * std::abs(std::erf(x))) << x;
    EXPECT_NEAR(hypotenuse(x, 1 - x), std::hypot(x, 1 - x), 1e-15 * std::hypot(x, 1 - x)) << x;
  }
  EXPECT_EQ(error_function(0), 0);
  EXPECT_EQ(error_function(1e300), 1);
  EXPECT_TRUE(std::isnan(error_function(NAN)));
}

// The same number on every processor: written down, not computed by this one.
TEST(PortableMath, has_these_bits_on_every_processor) {
  std::uint64_t hash = 14695981039346656037u;
  for (int i = 0; i < 20000; ++i) {
    const double x = -6 + 0.0006 * i, y = error_function(x) + hypotenuse(x, 0.3);
    std::uint64_t bits;
    std::memcpy(&bits, &y, sizeof bits);
    hash = (hash ^ bits) * 1099511628211u;
  }
  EXPECT_EQ(hash, 0x111fa851da6ec52bu);
}

}  // namespace
}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "base/cpu_count.h"

namespace sdftrack {
namespace {

TEST(CpuCount, the_quota_of_version_2_is_read_with_and_without_a_limit) {
  EXPECT_DOUBLE_EQ(quota_of_cpu_max("150000 100000").value(), 1.5);
  EXPECT_DOUBLE_EQ(quota_of_cpu_max("200000").value(), 2.0);
  EXPECT_FALSE(quota_of_cpu_max("max 100000"));
  EXPECT_FALSE(quota_of_cpu_max(""));
}

TEST(CpuCount, the_quota_of_version_1_is_read_with_and_without_a_limit) {
  EXPECT_DOUBLE_EQ(quota_of_cfs("50000", "100000").value(), 0.5);
  EXPECT_FALSE(quota_of_cfs("-1", "100000"));
  EXPECT_FALSE(quota_of_cfs("", ""));
}

}  // namespace
}  // namespace sdftrack

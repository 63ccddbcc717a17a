// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "base/cpu_count.h"

#ifdef __linux__
#include <sched.h>
#endif

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

#ifdef __linux__
TEST(CpuCount, a_process_bound_to_one_processor_uses_one) {
  cpu_set_t all, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof(all), &all), 0);
  CPU_ZERO(&one);
  for (int i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++i)
    if (CPU_ISSET(i, &all)) CPU_SET(i, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  const int bound = usable_cpus();
  sched_setaffinity(0, sizeof(all), &all);
  EXPECT_EQ(bound, 1);
  EXPECT_GE(usable_cpus(), 1);
  EXPECT_LE(usable_cpus(), CPU_COUNT(&all));
}
#endif

}  // namespace
}  // namespace sdftrack

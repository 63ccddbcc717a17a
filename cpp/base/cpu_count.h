// SPDX-License-Identifier: MIT
// How many processors this process may use.
#pragma once

#include <optional>
#include <string_view>

namespace sdftrack {

// The processors of the affinity mask, at most the CPU quota of the control groups rounded up; at least 1.
int usable_cpus();

// Quota over period of a control group: of the text of `cpu.max` (version 2), or of the numbers of
// `cpu.cfs_quota_us` and `cpu.cfs_period_us` (version 1). Nothing where there is no limit.
std::optional<double> quota_of_cpu_max(std::string_view text);
std::optional<double> quota_of_cfs(std::string_view quota_us, std::string_view period_us);

}  // namespace sdftrack

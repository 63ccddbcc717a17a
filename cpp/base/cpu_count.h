// SPDX-License-Identifier: MIT
// The number of processors that this process may use.
#pragma once

#include <optional>
#include <string_view>

namespace sdftrack {

// The processors of the affinity mask, at most the CPU quota of the control groups rounded up; at least 1.
int usable_cpus();

// Quota over period of a control group: from the text of `cpu.max` (version 2), or from the numbers of
// `cpu.cfs_quota_us` and `cpu.cfs_period_us` (version 1). No value if there is no limit.
std::optional<double> quota_of_cpu_max(std::string_view text);
std::optional<double> quota_of_cfs(std::string_view quota_us, std::string_view period_us);

}  // namespace sdftrack

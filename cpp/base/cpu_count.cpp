// SPDX-License-Identifier: MIT
#include "base/cpu_count.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>

#include "base/to_int.h"
#endif

namespace sdftrack {

namespace {

// "" where it cannot be read.
std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

int affinity() {
#ifdef __linux__
  std::vector<cpu_set_t> sets(16);  // 16,384 processors
  const std::size_t bytes = sets.size() * sizeof(cpu_set_t);
  if (sched_getaffinity(0, bytes, sets.data()) == 0) return CPU_COUNT_S(bytes, sets.data());
#endif
  return static_cast<int>(std::thread::hardware_concurrency());
}

// The tightest limit of a group and those above it. `group` is its path within the hierarchy: in a container
// it may name folders that are not mounted, where only the root's own files are left.
template <class QuotaAt>
double tightest(const std::string& root, std::string group, const QuotaAt& quota_at) {
  double limit = INFINITY;
  for (;;) {
    if (const std::optional<double> quota = quota_at(root + group)) limit = std::min(limit, *quota);
    if (group.empty()) return limit;
    group.erase(std::min(group.rfind('/'), group.size()));
  }
}

double control_group_limit() {
  double limit = INFINITY;
  std::ifstream groups("/proc/self/cgroup");  // lines "id:controllers:path"; version 2: "0::path"
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    std::string path = line.substr(second + 1);
    if (path == "/") path.clear();
    if (controllers.empty())
      limit = std::min(limit, tightest("/sys/fs/cgroup", path, [](const std::string& folder) {
                         return quota_of_cpu_max(first_line(folder + "/cpu.max"));
                       }));
    else if (("," + controllers + ",").find(",cpu,") != std::string::npos)
      limit = std::min(limit, tightest("/sys/fs/cgroup/cpu", path, [](const std::string& folder) {
                         return quota_of_cfs(first_line(folder + "/cpu.cfs_quota_us"),
                                             first_line(folder + "/cpu.cfs_period_us"));
                       }));
  }
  return limit;
}

std::optional<double> ratio(double quota, double period) {
  if (!(quota > 0) || !(period > 0)) return std::nullopt;
  return quota / period;
}

}  // namespace

std::optional<double> quota_of_cpu_max(const std::string& text) {
  std::istringstream in(text);
  double quota = 0, period = 100000;        // what the kernel takes where the period is left out
  if (!(in >> quota)) return std::nullopt;  // "max", or no file
  in >> period;
  return ratio(quota, period);
}

std::optional<double> quota_of_cfs(const std::string& quota_us, const std::string& period_us) {
  double quota = -1, period = 0;
  if (!(std::istringstream(quota_us) >> quota) || !(std::istringstream(period_us) >> period))
    return std::nullopt;
  return ratio(quota, period);
}

int usable_cpus() {
  const double limit = std::ceil(control_group_limit());
  return to_int(std::max(1.0, std::min(static_cast<double>(affinity()), limit)));
}

}  // namespace sdftrack

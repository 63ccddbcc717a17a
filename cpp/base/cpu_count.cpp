// SPDX-License-Identifier: MIT
#include "base/cpu_count.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>

#include "base/to_int.h"
#endif

namespace sdftrack {

namespace {

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// The text of a system file of a few lines; "" if it cannot be read. It uses the C library because it runs
// while the library is loaded: a stream that reads numbers would end the process there if the C++ library is
// linked statically and another module has loaded the system's.
std::string text_of(const std::string& path) {
  const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "r"));
  std::string text;
  char part[1024];
  while (const std::size_t n = file ? std::fread(part, 1, sizeof(part), file.get()) : 0) text.append(part, n);
  return text;
}

int affinity() {
#ifdef __linux__
  std::vector<cpu_set_t> sets(16);  // 16,384 processors
  const std::size_t bytes = sets.size() * sizeof(cpu_set_t);
  if (sched_getaffinity(0, bytes, sets.data()) == 0) return CPU_COUNT_S(bytes, sets.data());
#endif
  return int(std::thread::hardware_concurrency());
}

// The tightest limit of a group and the groups above it. `group` is its path in the hierarchy. In a container
// it may name folders that are not mounted; then only the root's files are available.
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
  // Lines "id:controllers:path"; version 2: "0::path".
  std::string groups = text_of("/proc/self/cgroup");
  for (std::size_t end = 0; (end = groups.find('\n')) != std::string::npos; groups.erase(0, end + 1)) {
    const std::string line = groups.substr(0, end);
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    std::string path = line.substr(second + 1);
    if (path == "/") path.clear();
    if (controllers.empty())
      limit = std::min(limit, tightest("/sys/fs/cgroup", path, [](const std::string& folder) {
                         return quota_of_cpu_max(text_of(folder + "/cpu.max"));
                       }));
    else if (("," + controllers + ",").find(",cpu,") != std::string::npos)
      limit = std::min(limit, tightest("/sys/fs/cgroup/cpu", path, [](const std::string& folder) {
                         return quota_of_cfs(text_of(folder + "/cpu.cfs_quota_us"),
                                             text_of(folder + "/cpu.cfs_period_us"));
                       }));
  }
  return limit;
}

// Removes and returns the number at the start of `text`, with the spaces before it. Else no value.
std::optional<std::int64_t> take_number(std::string_view* text) {
  text->remove_prefix(std::min(text->find_first_not_of(" \t\n"), text->size()));
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), number);
  if (error != std::errc()) return std::nullopt;
  text->remove_prefix(std::size_t(end - text->data()));
  return number;
}

std::optional<double> ratio(std::optional<std::int64_t> quota, std::optional<std::int64_t> period) {
  if (quota.value_or(0) <= 0 || period.value_or(0) <= 0) return std::nullopt;
  return double(*quota) / double(*period);
}

}  // namespace

std::optional<double> quota_of_cpu_max(std::string_view text) {
  const auto quota = take_number(&text);                     // "max", or no file: none
  return ratio(quota, take_number(&text).value_or(100000));  // the kernel's default
}

std::optional<double> quota_of_cfs(std::string_view quota_us, std::string_view period_us) {
  return ratio(take_number(&quota_us), take_number(&period_us));
}

int usable_cpus() {
  const double limit = std::ceil(control_group_limit());
  return to_int(std::max(1.0, std::min(double(affinity()), limit)));
}

}  // namespace sdftrack

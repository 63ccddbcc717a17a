// SPDX-License-Identifier: MIT
// Names of volumes that do not change, by which a GPU knows those that it has.
#pragma once

#include <atomic>
#include <cstdint>

namespace sdftrack {

// No two calls of a process give the same; never 0.
inline std::uint64_t new_volume_id() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace sdftrack

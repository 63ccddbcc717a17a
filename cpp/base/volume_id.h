// SPDX-License-Identifier: MIT
// Ids of constant volumes, by which a GPU recognises the volumes that it holds.
#pragma once

#include <atomic>
#include <cstdint>

namespace sdftrack {

// Each call in a process gives another id; never 0.
inline std::uint64_t new_volume_id() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace sdftrack

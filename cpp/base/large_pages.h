// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace sdftrack {

// Memory filled with zeros. On Linux large pieces use huge pages if the system has them: volumes are read in
// small blocks far apart, and with pages of 4 KiB address translation would be slow. Throws std::bad_alloc.
void* zeroed_pages(std::size_t bytes);
void free_pages(void* p, std::size_t bytes);

}  // namespace sdftrack

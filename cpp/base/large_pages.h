// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace sdftrack {

// Memory filled with zeros. On Linux large pieces come in huge pages where the system lends them: volumes are
// read in small blocks far apart, which with pages of 4 KiB is much waiting for addresses. Throws
// std::bad_alloc.
void* zeroed_pages(std::size_t bytes);
void free_pages(void* p, std::size_t bytes);

}  // namespace sdftrack

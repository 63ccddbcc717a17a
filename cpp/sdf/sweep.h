// SPDX-License-Identifier: MIT
// Fast sweeping (Zhao, Mathematics of Computation 74, 2005): |grad u| = 1 from known values outwards.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/grid.h"

namespace sdftrack::sdf {

// u (m, >= 0) is kept where known[i] != 0 and found elsewhere. Gauss-Seidel in eight orders with Godunov's
// upwind difference. The result depends on the order, but not on the number of threads.
void fast_sweep(const Grid& grid, const std::vector<std::uint8_t>& known, int threads, std::vector<float>* u);

}  // namespace sdftrack::sdf

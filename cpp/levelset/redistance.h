// SPDX-License-Identifier: MIT
// sdf/redistance.h on a CUDA device.
#pragma once

#include <vector>

#include "sdf/grid.h"

namespace sdftrack::levelset {

// Within sdf::kBandRedistanced voxels of the zero set the CPU's bits; beyond, swept until nothing changes.
std::vector<float> redistance_cuda(const sdf::Grid& grid, const float* phi, int device);

}  // namespace sdftrack::levelset

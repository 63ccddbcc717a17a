// SPDX-License-Identifier: MIT
// sdf/redistance.h on a CUDA device; defined in redistance.cu, or redistance_none.cpp.
#pragma once

#include <vector>

#include "sdf/grid.h"

namespace sdftrack::levelset {

// Within sdf::kBandRedistanced voxels of the zero set the same bits as on the CPU; beyond, swept until
// nothing changes.
std::vector<float> redistance_cuda(const sdf::Grid& grid, const float* phi, int device);

}  // namespace sdftrack::levelset

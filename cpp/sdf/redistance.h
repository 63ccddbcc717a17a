// SPDX-License-Identifier: MIT
// A distance field with the zero set of another field.
#pragma once

#include <vector>

#include "sdf/grid.h"

namespace sdftrack::sdf {

// phi: any field, negative inside. The result has its signs, and near its zero set the distance to its
// zero set (linear between the voxels). A field of one sign only has no zero set: std::invalid_argument.
constexpr double kBandRedistanced = 4;  // voxels of exact distance; beyond, sweeping
[[noreturn]] void refuse_one_sign();
std::vector<float> redistance(const Grid& grid, const float* phi, int threads);

}  // namespace sdftrack::sdf

// SPDX-License-Identifier: MIT
// Motions that leave a surface as it is: the turns of a body of revolution (slippable motions, Gelfand and
// Guibas, "Shape segmentation using local slippage analysis", 2004).
#pragma once

#include <array>
#include <vector>

#include "base/vec.h"

namespace sdftrack::frame {

// (v, w half_m) of unit length, orthogonal, along which the surface points move along the normals by less
// than the grain of a voxel volume makes of a perfect body of revolution. At most three.
std::vector<std::array<double, 6>> slips_of(const std::vector<Vec3f>& points,
                                            const std::vector<Vec3f>& normals, double half_m);

}  // namespace sdftrack::frame

// SPDX-License-Identifier: MIT
// The connected parts of a volume that are inside: the largest one is the object, others are not part of it.
#pragma once

#include <vector>

#include "sdf/grid.h"

namespace sdftrack::reconstruction {

// Voxels x0 <= x < x1 of a row that are inside.
struct BodyRun {
  int x0, x1, y, z;
  int body;  // number of the first run of its body
};

struct Bodies {
  std::vector<BodyRun> runs;
  int largest = -1;  // by its voxels; -1: nothing is inside
};

// Voxels with a negative distance, connected over their sides.
Bodies bodies_of(int nx, int ny, int nz, const float* phi);

}  // namespace sdftrack::reconstruction

// SPDX-License-Identifier: MIT
// What may stand beside the readings of one object where a device runs the whole search, in plain numbers.
#pragma once

#include "energies/outline_lines_term.h"
#include "energies/outline_term.h"
#include "energies/photometric_term.h"
#include "optim/pose_search.h"

namespace sdftrack::energies {

// Its points, grid, hits and lines are the host's, and are sent; the colours lie on the device already.
struct Beside {
  optim::PriorTerm prior{};
  OutlineTerm<float> outline{};  // free space; without points it is left out
  double outline_weight = 0;
  Brightness brightness{};
  double brightness_weight = 0;
  OutlineLinesTerm lines{};
  double lines_weight = 0;
};

}  // namespace sdftrack::energies

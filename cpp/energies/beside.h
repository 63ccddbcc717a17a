// SPDX-License-Identifier: MIT
// Terms in addition to the depth term of one object, as plain numbers for a search that runs on a device.
#pragma once

#include "energies/outline_lines_term.h"
#include "energies/outline_term.h"
#include "energies/photometric_term.h"
#include "optim/pose_search.h"

namespace sdftrack::energies {

// Points, grid, hits and lines are in host memory and are sent; the colours are on the device already.
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

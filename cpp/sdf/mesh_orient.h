// SPDX-License-Identifier: MIT
// Faces that point the wrong way: against their neighbours, or a whole part of them inwards.
#pragma once

#include <vector>

#include "sdf/mesh_report.h"

namespace sdftrack::sdf {

using Region = std::vector<std::size_t>;  // faces, connected over edges that two of them share

// Turns, in each region, the minority.
std::vector<Region> turn_flipped(std::vector<Face>* faces, MeshReport* report);

// Turns the regions that are inside out: before the faces of a good one the winding number is 0 (a wall of a
// cavity too), before those of an inverted one -1. A closed mesh whose regions all have a positive
// volume has none.
void turn_inverted(CleanMesh* mesh, const std::vector<Region>& regions, bool closed);

}  // namespace sdftrack::sdf

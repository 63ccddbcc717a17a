// SPDX-License-Identifier: MIT
// Repairs of faces: duplicates over the same three vertices, and wrong orientations: against the neighbours,
// or a whole part inside out.
#pragma once

#include <vector>

#include "sdf/mesh/mesh_report.h"

namespace sdftrack::sdf {

// Duplicates of opposite orientation cancel (a flap without volume); of the others one is kept. A
// double-sided surface has each face in both orientations and would vanish: if it is closed, or nothing else
// would be left, one side of it is kept.
std::vector<Face> drop_duplicates(const std::vector<Face>& faces, MeshReport* report);

using Region = std::vector<std::size_t>;  // faces, connected over edges that two of them share

// Turns the minority of faces in each region.
std::vector<Region> turn_flipped(std::vector<Face>* faces, MeshReport* report);

// Turns the regions that are inside out: the winding number in front of the faces is 0 for a good region
// (also for the wall of a cavity) and -1 for an inverted one. A closed mesh whose regions all have a positive
// volume has no inverted ones.
void turn_inverted(CleanMesh* mesh, const std::vector<Region>& regions, bool closed);

}  // namespace sdftrack::sdf

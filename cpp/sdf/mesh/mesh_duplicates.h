// SPDX-License-Identifier: MIT
// Faces over the same three vertices.
#pragma once

#include <vector>

#include "sdf/mesh/mesh_report.h"

namespace sdftrack::sdf {

// Duplicates of opposite orientation cancel (a flap without volume); of the others one is kept. A
// double-sided surface has each face in both orientations and would vanish: if it is closed, or nothing else
// would be left, one side of it is kept.
std::vector<Face> drop_duplicates(const std::vector<Face>& faces, MeshReport* report);

}  // namespace sdftrack::sdf

// SPDX-License-Identifier: MIT
// Faces over the same three vertices.
#pragma once

#include <vector>

#include "sdf/mesh_report.h"

namespace sdftrack::sdf {

// Those of opposite sense cancel (a flap without volume), and of the rest one is kept. A double-sided
// surface, each face of which is there both ways, would vanish: of one that is closed, or where nothing else
// would be left, one side is kept.
std::vector<Face> drop_duplicates(const std::vector<Face>& faces, MeshReport* report);

}  // namespace sdftrack::sdf

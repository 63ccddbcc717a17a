// SPDX-License-Identifier: MIT
// Triangles of a mesh file. Colours, normals and texture are skipped: Python reads them.
#pragma once

#include <string>

#include "sdf/mesh/mesh_report.h"

namespace sdftrack::sdf {

// .ply (text or binary), .obj, .stl (text or binary); faces with more corners become fans of triangles.
// Throws std::invalid_argument "mesh: cannot read FILE: ..." for what is none of these, or ends early.
CleanMesh read_mesh_file(const std::string& file);

// All bytes of a file. Throws std::invalid_argument where it is not there, or may not be read.
std::string bytes_of(const std::string& file);

}  // namespace sdftrack::sdf

// SPDX-License-Identifier: MIT
// Properties of a mesh, and the mesh prepared for a signed distance: equal vertices merged, duplicate faces
// dropped, flipped faces and inside-out parts turned.
#pragma once

#include <limits>
#include <vector>

#include "sdf/mesh.h"

namespace sdftrack::sdf {

struct MeshReport {
  std::size_t merged_vertices = 0;     // bit for bit equal to another vertex
  std::size_t degenerate_faces = 0;    // two corners at one vertex
  std::size_t duplicate_faces = 0;     // the same three vertices as another face
  std::size_t double_sided_faces = 0;  // present in both orientations, one of which is kept
  std::size_t inverted_parts = 0;      // inside out as a whole, and turned
  std::size_t flipped_faces = 0;       // turned against most of their part
  std::size_t open_edges = 0;          // of one face only
  std::size_t non_manifold_edges = 0;  // of more than two faces
  std::size_t unbalanced_edges = 0;    // more often in one direction: inside is undefined
  std::size_t parts = 0;               // connected by shared vertices
  double volume_m3 = 0;                // negative: inside out
  // Of the material behind all but the thinnest 2 % of the surface, where it was measured.
  double thinnest_m = std::numeric_limits<double>::infinity();

  bool watertight() const { return unbalanced_edges == 0; }
};

struct CleanMesh {
  std::vector<Vec3d> vertices;
  std::vector<Face> faces;
  MeshReport report;

  MeshView view() const { return {vertices.data(), vertices.size(), faces.data(), faces.size()}; }
};

CleanMesh clean_mesh(const MeshView& mesh);

// Thickness (m) below which the share `fraction` of the surface lies, seen from inside along the normal;
// infinity where nothing lies behind. A sample of a few thousand faces, spread over the area, is used.
double thin_quantile(const MeshView& mesh, const class Bvh& bvh, double fraction);

}  // namespace sdftrack::sdf

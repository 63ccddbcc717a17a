// SPDX-License-Identifier: MIT
// Bounding volume hierarchy over the triangles of a mesh: a flat array of nodes, binned surface area
// heuristic, all in double. It finds the closest triangle and the first triangle along a ray.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "sdf/bvh_ray.h"
#include "sdf/mesh.h"

namespace sdftrack::sdf {

struct Closest {
  double distance2 = std::numeric_limits<double>::infinity();
  Vec3d point{0, 0, 0};
  std::int32_t face = -1;  // -1: nothing within the limit
};

class Bvh {
 public:
  explicit Bvh(const MeshView& mesh);  // copies what it needs

  // Nearest triangle nearer than sqrt(limit2). `guess` (a face or -1) only makes the search faster.
  Closest closest(Vec3d p, double limit2 = std::numeric_limits<double>::infinity(),
                  std::int32_t guess = -1) const;
  // Smallest t > 0; of equal t, the smallest face index.
  FirstHit first_hit(Vec3d origin, Vec3d direction) const {
    return sdf::first_hit(view(), origin, direction);
  }

  const Box3& box() const { return nodes_[0].box; }
  BvhView view() const { return {nodes_.data(), triangles_.data(), faces_.data()}; }
  std::size_t node_count() const { return nodes_.size(); }

 private:
  std::vector<BvhNode> nodes_;
  std::vector<Triangle> triangles_;   // in the order of the leaves
  std::vector<std::int32_t> faces_;   // their indices in the mesh
  std::vector<std::int32_t> places_;  // face -> position in triangles_
};

}  // namespace sdftrack::sdf

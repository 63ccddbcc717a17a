// SPDX-License-Identifier: MIT
// Bounding volume hierarchy over the triangles of a mesh: a flat array of nodes, binned surface area
// heuristic, all in double. It answers "closest triangle" and "first triangle along a ray".
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "sdf/mesh.h"

namespace sdftrack::sdf {

struct Box3 {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void add(Vec3d p);
  void add(const Box3& b);
  double half_area() const;
  double distance2(Vec3d p) const;
};

struct Closest {
  double distance2 = std::numeric_limits<double>::infinity();
  Vec3d point{0, 0, 0};
  std::int32_t face = -1;  // -1: nothing within the limit
};

struct FirstHit {
  RayHit hit{std::numeric_limits<double>::infinity(), 0, 0, 0};
  std::int32_t face = -1;
};

class Bvh {
 public:
  explicit Bvh(const MeshView& mesh);  // copies what it needs

  // Nearest triangle nearer than sqrt(limit2). `guess` (a face or -1) only makes it faster.
  Closest closest(Vec3d p, double limit2 = std::numeric_limits<double>::infinity(),
                  std::int32_t guess = -1) const;
  // Smallest t > 0; of equal t, the smallest face index.
  FirstHit first_hit(Vec3d origin, Vec3d direction) const;

  const Box3& box() const { return nodes_[0].box; }

 private:
  struct Node {
    Box3 box;
    std::int32_t first;  // leaf: its first triangle; inner: its left child, the right one follows
    std::int32_t count;  // leaf: triangles; inner: 0
  };

  std::vector<Node> nodes_;
  std::vector<Triangle> triangles_;   // in the order of the leaves
  std::vector<std::int32_t> faces_;   // their indices in the mesh
  std::vector<std::int32_t> places_;  // face -> position in triangles_
};

}  // namespace sdftrack::sdf

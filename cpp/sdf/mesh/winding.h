// SPDX-License-Identifier: MIT
// Generalised winding number of any triangles, open or not (Jacobson et al., SIGGRAPH 2013), far clusters
// replaced by one dipole (Barill et al., SIGGRAPH 2018).
#pragma once

#include <vector>

#include "sdf/mesh.h"

namespace sdftrack::sdf {

class WindingTree {
 public:
  explicit WindingTree(const MeshView& mesh);  // copies what it needs

  double operator()(Vec3d p) const;  // about 1 inside, about 0 outside

 private:
  struct Node {
    Vec3d centre, area_normal;  // area-weighted mean point; sum of area times normal
    double radius;              // of a ball around `centre` that holds all its triangles
    std::size_t begin, end;     // its triangles
    std::size_t left = 0;       // children left and left + 1; 0: a leaf
  };

  double sum(Vec3d p, double far) const;
  void build(std::size_t node, std::vector<Triangle>& triangles);

  std::vector<Node> nodes_;
  std::vector<Triangle> triangles_;
};

}  // namespace sdftrack::sdf

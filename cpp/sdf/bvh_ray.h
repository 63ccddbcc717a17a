// SPDX-License-Identifier: MIT
// A ray through a hierarchy of triangles, for CPU and GPU.
#pragma once

#include <cstdint>
#include <limits>

#include "base/order.h"
#include "sdf/triangle.h"

namespace sdftrack::sdf {

struct Box3 {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};

  void add(Vec3d p);
  void add(const Box3& b);
  double half_area() const;
  double distance2(Vec3d p) const;
};

struct BvhNode {
  Box3 box;
  std::int32_t first;  // leaf: its first triangle; inner: its left child, the right one follows
  std::int32_t count;  // leaf: triangles; inner: 0
};

// The view of a Bvh for a loop or a kernel.
struct BvhView {
  const BvhNode* nodes;
  const Triangle* triangles;  // in the order of the leaves
  const std::int32_t* faces;  // their indices in the mesh
};

constexpr double kNoEntry = std::numeric_limits<double>::infinity();

// Narrows the stretch of a ray to that between two planes perpendicular to an axis.
HD void between(double low, double high, double origin, double inverse, double* near, double* far) {
  constexpr double kWiden = 1 + 1e-12;
  const double a = (low - origin) * inverse, b = (high - origin) * inverse;
  const bool swapped = a > b;
  *near = larger(*near, swapped ? b : a);  // a NaN (0 x infinity: in the plane of the face) changes nothing
  *far = smaller(*far, (swapped ? a : b) * kWiden);
}

// Where the ray enters the box, infinity when it misses it. Slightly wider than exact, so that rounding never
// loses a triangle on a face of the box.
HD double entry(const Box3& box, Vec3d origin, Vec3d inverse) {
  constexpr double kWiden = 1 + 1e-12;
  double near = 0, far = kNoEntry;
  between(box.low.x, box.high.x, origin.x, inverse.x, &near, &far);
  between(box.low.y, box.high.y, origin.y, inverse.y, &near, &far);
  between(box.low.z, box.high.z, origin.z, inverse.z, &near, &far);
  return near <= far * kWiden ? near : kNoEntry;
}

struct FirstHit {
  RayHit hit{kNoEntry, 0, 0, 0};
  std::int32_t face = -1;
};

// More than the depth of any hierarchy: 64 levels, then splits in halves.
constexpr int kBvhStack = 96;

// Smallest t > 0; of equal t, the smallest face index. The stack does not store where the ray enters the
// boxes; this is computed again, because memory limits a GPU.
HD FirstHit first_hit(const BvhView& bvh, Vec3d origin, Vec3d direction) {
  FirstHit best;
  const Vec3d inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
  const auto into = [&](std::int32_t node) { return entry(bvh.nodes[node].box, origin, inverse); };
  const auto worth = [&](double near) { return near <= best.hit.t && near != kNoEntry; };
  std::int32_t stack[kBvhStack];
  stack[0] = 0;
  for (int top = 1; top > 0;) {
    std::int32_t at = stack[--top];
    if (!worth(into(at))) continue;
    while (bvh.nodes[at].count == 0) {
      const std::int32_t left = bvh.nodes[at].first, right = left + 1;
      const double to_left = into(left), to_right = into(right);
      const bool left_first = to_left < to_right;
      if (!worth(left_first ? to_left : to_right)) break;
      at = left_first ? left : right;
      if (worth(left_first ? to_right : to_left)) stack[top++] = left_first ? right : left;
    }
    const BvhNode& leaf = bvh.nodes[at];
    for (std::int32_t k = leaf.first; k < leaf.first + leaf.count; ++k) {
      RayHit hit;
      if (intersect(bvh.triangles[k], origin, direction, &hit) &&
          (hit.t < best.hit.t || (hit.t == best.hit.t && bvh.faces[k] < best.face)))
        best = {hit, bvh.faces[k]};
    }
  }
  return best;
}

}  // namespace sdftrack::sdf

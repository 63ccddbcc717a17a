// SPDX-License-Identifier: MIT
#include "sdf/mesh/winding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace sdftrack::sdf {

namespace {

constexpr std::size_t kClusterSize = 8;
constexpr double kFar = 3;  // radii; the dipole is then good to about 1e-2 (Barill et al., section 4)
constexpr double kFarther = 12, kUnsure = 0.03;

Vec3d centroid(const Triangle& t) { return (1.0 / 3) * (t.a + t.b + t.c); }

// Solid angle of a triangle seen from p (van Oosterom and Strackee, 1983).
double solid_angle(const Triangle& t, Vec3d p) {
  const Vec3d a = t.a - p, b = t.b - p, c = t.c - p;
  const double la = norm(a), lb = norm(b), lc = norm(c);
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

}  // namespace

WindingTree::WindingTree(const MeshView& mesh) {
  for (std::size_t i = 0; i < mesh.face_count; ++i) triangles_.push_back(mesh.triangle(i));
  nodes_.push_back({{}, {}, 0, 0, triangles_.size()});
  for (std::size_t i = 0; i < nodes_.size(); ++i) build(i, triangles_);
}

void WindingTree::build(std::size_t index, std::vector<Triangle>& triangles) {
  Node node = nodes_[index];
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300}, sum{0, 0, 0};
  double area = 0;
  for (std::size_t i = node.begin; i < node.end; ++i) {
    const Triangle& t = triangles[i];
    const Vec3d n = 0.5 * cross(t.b - t.a, t.c - t.a), c = centroid(t);
    node.area_normal = node.area_normal + n;
    area += norm(n);
    sum = sum + norm(n) * c;
    low = {std::min(low.x, c.x), std::min(low.y, c.y), std::min(low.z, c.z)};
    high = {std::max(high.x, c.x), std::max(high.y, c.y), std::max(high.z, c.z)};
  }
  node.centre = area > 0 ? (1 / area) * sum : 0.5 * (low + high);
  for (std::size_t i = node.begin; i < node.end; ++i)
    for (const Vec3d& p : {triangles[i].a, triangles[i].b, triangles[i].c})
      node.radius = std::max(node.radius, norm(p - node.centre));
  if (node.end - node.begin > kClusterSize) {
    const Vec3d e = high - low;
    const auto key = [&](const Triangle& t) {
      const Vec3d c = centroid(t);
      return e.x >= e.y && e.x >= e.z ? c.x : e.y >= e.z ? c.y : c.z;
    };
    const std::size_t middle = node.begin + (node.end - node.begin) / 2;
    std::stable_sort(triangles.begin() + std::ptrdiff_t(node.begin),
                     triangles.begin() + std::ptrdiff_t(node.end),
                     [&](const Triangle& a, const Triangle& b) { return key(a) < key(b); });
    node.left = nodes_.size();
    nodes_.push_back({{}, {}, 0, node.begin, middle});
    nodes_.push_back({{}, {}, 0, middle, node.end});
  }
  nodes_[index] = node;
}

double WindingTree::operator()(Vec3d p) const {
  // Near 1/2 the error of the dipoles could change the side: only farther clusters become dipoles then.
  const double number = sum(p, kFar);
  return std::abs(number - 0.5) > kUnsure ? number : sum(p, kFarther);
}

double WindingTree::sum(Vec3d p, double far) const {
  double angle = 0;
  std::array<std::size_t, 128> stack;  // halved by the median at each level: far deeper than any mesh
  std::size_t top = 0;
  stack[top++] = 0;
  while (top) {
    const Node& node = nodes_[stack[--top]];
    const Vec3d d = node.centre - p;
    const double d2 = dot(d, d);
    if (d2 > far * far * node.radius * node.radius) {
      angle += dot(node.area_normal, d) / (d2 * std::sqrt(d2));
    } else if (node.left) {
      stack[top++] = node.left + 1;
      stack[top++] = node.left;
    } else {
      for (std::size_t i = node.begin; i < node.end; ++i) angle += solid_angle(triangles_[i], p);
    }
  }
  return angle / (4 * std::numbers::pi);
}

}  // namespace sdftrack::sdf

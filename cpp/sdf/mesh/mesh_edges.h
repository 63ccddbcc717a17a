// SPDX-License-Identifier: MIT
// The edges of a mesh's faces, sorted so that edges with the same ends are adjacent.
#pragma once

#include <algorithm>
#include <tuple>
#include <vector>

#include "sdf/mesh.h"

namespace sdftrack::sdf {

// A directed edge of a face, filed under its two vertices in order.
struct Edge {
  std::int32_t low, high, face;
  bool forward;  // from low to high

  auto key() const { return std::tie(low, high); }
};

inline std::vector<Edge> sorted_edges(const Face* faces, std::size_t count) {
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const Face& f = faces[i];
    for (const auto& [a, b] : {std::pair{f.a, f.b}, std::pair{f.b, f.c}, std::pair{f.c, f.a}})
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(i), a < b});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  return edges;
}

inline std::vector<Edge> sorted_edges(const std::vector<Face>& faces) {
  return sorted_edges(faces.data(), faces.size());
}

// visit(first of the faces' edges with these ends, how many), for each edge of the mesh
template <class Visit>
void for_each_edge(const std::vector<Edge>& edges, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    for (end = begin; end < edges.size() && edges[end].key() == edges[begin].key();) ++end;
    visit(&edges[begin], end - begin);
  }
}

// How much more often an edge is used in one direction than in the other; 0: the surface does not end there.
inline std::ptrdiff_t edge_balance(const Edge* e, std::size_t n) {
  std::ptrdiff_t balance = 0;
  for (std::size_t i = 0; i < n; ++i) balance += e[i].forward ? 1 : -1;
  return balance;
}

}  // namespace sdftrack::sdf

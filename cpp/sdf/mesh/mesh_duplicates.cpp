// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_duplicates.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "sdf/mesh/mesh_edges.h"

namespace sdftrack::sdf {

namespace {

struct Filed {
  std::array<std::int32_t, 3> key;
  std::size_t face;
  int sense;
};

std::vector<Filed> filed_by_corners(const std::vector<Face>& faces) {
  std::vector<Filed> filed(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    std::array<std::int32_t, 3> k{faces[i].a, faces[i].b, faces[i].c};
    const bool even = (k[0] < k[1]) ^ (k[1] < k[2]) ^ (k[0] < k[2]);
    std::sort(k.begin(), k.end());
    filed[i] = {k, i, even ? 1 : -1};
  }
  std::sort(filed.begin(), filed.end(),
            [](const Filed& a, const Filed& b) { return std::tie(a.key, a.face) < std::tie(b.key, b.face); });
  return filed;
}

// Which faces belong to a piece, connected over edges, each of whose edges has an even number of faces.
std::vector<std::uint8_t> in_closed_pieces(const std::vector<Face>& faces) {
  std::vector<std::size_t> parent(faces.size());
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = i;
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<std::uint8_t> odd(faces.size(), 0), closed(faces.size(), 0);
  const std::vector<Edge> edges = sorted_edges(faces);
  for_each_edge(edges, [&](const Edge* e, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) {
      parent[root(static_cast<std::size_t>(e[i].face))] = root(static_cast<std::size_t>(e[0].face));
      if (n % 2) odd[static_cast<std::size_t>(e[i].face)] = 1;
    }
  });
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (odd[i]) odd[root(i)] = 1;
  for (std::size_t i = 0; i < faces.size(); ++i) closed[i] = !odd[root(i)];
  return closed;
}

}  // namespace

std::vector<Face> drop_duplicates(const std::vector<Face>& faces, MeshReport* report) {
  const std::vector<Filed> filed = filed_by_corners(faces);
  std::vector<std::uint8_t> keep(faces.size(), 0);
  std::vector<std::size_t> cancelled;  // one of each group whose faces cancel
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < filed.size(); begin = end) {
    int sum = 0;
    for (end = begin; end < filed.size() && filed[end].key == filed[begin].key; ++end)
      sum += filed[end].sense;
    std::size_t best = begin;
    while (sum && filed[best].sense * sum < 0) ++best;
    if (sum)
      keep[filed[best].face] = 1, ++kept;
    else
      cancelled.push_back(filed[begin].face);
  }
  std::sort(cancelled.begin(), cancelled.end());
  std::vector<Face> flaps;
  for (std::size_t i : cancelled) flaps.push_back(faces[i]);
  const std::vector<std::uint8_t> closed = in_closed_pieces(flaps);
  for (std::size_t i = 0; i < cancelled.size(); ++i)
    if (closed[i] || kept == 0) keep[cancelled[i]] = 1, ++report->double_sided_faces;
  std::vector<Face> out;
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (keep[i]) out.push_back(faces[i]);
  report->duplicate_faces = faces.size() - out.size();
  return out;
}

}  // namespace sdftrack::sdf

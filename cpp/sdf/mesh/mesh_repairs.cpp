// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_repairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "sdf/mesh/mesh_edges.h"
#include "sdf/mesh/winding.h"

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
      parent[root(std::size_t(e[i].face))] = root(std::size_t(e[0].face));
      if (n % 2) odd[e[i].face] = 1;
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

namespace {

constexpr std::size_t kSamples = 64;  // faces of a region that are tested
constexpr double kInsideOut = -0.55;  // winding number in front of a region: 0 if good, -1 if inverted
constexpr double kLift = 1e-4;        // of a face's size

double volume(const MeshView& mesh, const Region& region) {
  const Vec3d o = mesh.triangle(region[0]).a;
  double sum = 0;
  for (std::size_t f : region) {
    const Triangle t = mesh.triangle(f);
    sum += dot(t.a - o, cross(t.b - o, t.c - o)) / 6;
  }
  return sum;
}

// The area-weighted mean winding number just in front of a region's faces.
double number_before(const WindingTree& tree, const MeshView& mesh, const Region& region) {
  const std::size_t step = (region.size() + kSamples - 1) / kSamples;
  double sum = 0, area = 0;
  for (std::size_t i = 0; i < region.size(); i += step) {
    const Triangle t = mesh.triangle(region[i]);
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    const double a = norm(n);
    if (!(a > 0)) continue;
    sum += a * tree((1.0 / 3) * (t.a + t.b + t.c) + (kLift / std::sqrt(a)) * n);
    area += a;
  }
  return area > 0 ? sum / area : 0;
}

}  // namespace

// Walks over edges that two faces share, and turns the minority of faces in each connected region.
std::vector<Region> turn_flipped(std::vector<Face>* faces, MeshReport* report) {
  std::vector<Region> regions;
  const std::vector<Edge> edges = sorted_edges(*faces);
  struct Link {
    std::int32_t face;
    bool same_sense;
  };
  std::vector<std::array<Link, 3>> links(faces->size());
  std::vector<int> link_count(faces->size(), 0);
  for_each_edge(edges, [&](const Edge* e, std::size_t n) {
    if (n != 2 || e[0].face == e[1].face) return;
    const bool same = e[0].forward != e[1].forward;
    const auto f0 = std::size_t(e[0].face), f1 = std::size_t(e[1].face);
    links[f0][link_count[f0]++] = {e[1].face, same};
    links[f1][link_count[f1]++] = {e[0].face, same};
  });
  std::vector<int> sense(faces->size(), 0);
  for (std::size_t seed = 0; seed < faces->size(); ++seed) {
    if (sense[seed]) continue;
    Region region{seed};
    sense[seed] = 1;
    std::size_t turned = 0;
    for (std::size_t next = 0; next < region.size(); ++next) {
      const std::size_t f = region[next];
      turned += sense[f] < 0;
      for (int k = 0; k < link_count[f]; ++k) {
        const Link& link = links[f][k];
        const auto g = std::size_t(link.face);
        if (sense[g]) continue;
        sense[g] = link.same_sense ? sense[f] : -sense[f];
        region.push_back(g);
      }
    }
    const int minority = 2 * turned > region.size() ? 1 : -1;
    for (std::size_t f : region)
      if (sense[f] == minority) {
        std::swap((*faces)[f].b, (*faces)[f].c);
        ++report->flipped_faces;
      }
    regions.push_back(std::move(region));
  }
  return regions;
}

void turn_inverted(CleanMesh* mesh, const std::vector<Region>& regions, bool closed) {
  const auto inward = [&](const Region& region) { return volume(mesh->view(), region) < 0; };
  if (closed && std::none_of(regions.begin(), regions.end(), inward)) return;
  const WindingTree tree(mesh->view());
  std::vector<const Region*> inverted;
  for (const Region& region : regions)
    if (number_before(tree, mesh->view(), region) < kInsideOut) inverted.push_back(&region);
  for (const Region* region : inverted) {
    for (std::size_t f : *region) std::swap(mesh->faces[f].b, mesh->faces[f].c);
    ++mesh->report.inverted_parts;
  }
}

}  // namespace sdftrack::sdf

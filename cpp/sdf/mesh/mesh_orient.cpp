// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_orient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sdf/mesh/mesh_edges.h"
#include "sdf/mesh/winding.h"

namespace sdftrack::sdf {

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
    const auto f0 = static_cast<std::size_t>(e[0].face), f1 = static_cast<std::size_t>(e[1].face);
    links[f0][static_cast<std::size_t>(link_count[f0]++)] = {e[1].face, same};
    links[f1][static_cast<std::size_t>(link_count[f1]++)] = {e[0].face, same};
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
        const Link& link = links[f][static_cast<std::size_t>(k)];
        const auto g = static_cast<std::size_t>(link.face);
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

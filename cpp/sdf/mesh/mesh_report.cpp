// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_report.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "sdf/bvh.h"
#include "sdf/mesh/mesh_edges.h"
#include "sdf/mesh/mesh_repairs.h"

namespace sdftrack::sdf {

namespace {

using Index = std::int32_t;

std::vector<Index> merge_vertices(const MeshView& mesh, CleanMesh* out) {
  std::vector<Index> order(mesh.vertex_count), to(mesh.vertex_count);
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](Index i) {
    const Vec3d& p = mesh.vertices[i];
    return std::make_tuple(p.x, p.y, p.z);
  };
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key(order[i]) != key(order[i - 1]))
      out->vertices.push_back(mesh.vertices[order[i]]);
    else
      ++out->report.merged_vertices;
    to[order[i]] = static_cast<Index>(out->vertices.size() - 1);
  }
  return to;
}

std::size_t count_parts(const CleanMesh& mesh) {
  std::vector<Index> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (const Face& f : mesh.faces) {
    for (Index v : {f.a, f.b, f.c}) used[v] = 1;
    parent[root(f.b)] = root(f.a);
    parent[root(f.c)] = root(f.a);
  }
  std::size_t parts = 0;
  for (std::size_t i = 0; i < parent.size(); ++i) parts += used[i] && parent[i] == static_cast<Index>(i);
  return parts;
}

}  // namespace

CleanMesh clean_mesh(const MeshView& mesh) {
  CleanMesh out;
  const std::vector<Index> to = merge_vertices(mesh, &out);
  std::vector<Face> faces;
  for (std::size_t i = 0; i < mesh.face_count; ++i) {
    const auto at = [&](Index v) { return to[v]; };
    const Face f{at(mesh.faces[i].a), at(mesh.faces[i].b), at(mesh.faces[i].c)};
    if (f.a == f.b || f.b == f.c || f.c == f.a)
      ++out.report.degenerate_faces;
    else
      faces.push_back(f);
  }
  out.faces = drop_duplicates(faces, &out.report);
  const std::vector<Region> regions = turn_flipped(&out.faces, &out.report);
  const auto unbalanced = [&](const Edge* e, std::size_t n) {
    out.report.unbalanced_edges += edge_balance(e, n) != 0;
  };
  for_each_edge(sorted_edges(out.faces), unbalanced);
  turn_inverted(&out, regions, out.report.unbalanced_edges == 0);
  out.report.unbalanced_edges = 0;
  const std::vector<Edge> edges = sorted_edges(out.faces);
  for_each_edge(edges, unbalanced);
  for_each_edge(edges, [&](const Edge*, std::size_t n) {
    out.report.open_edges += n == 1;
    out.report.non_manifold_edges += n > 2;
  });
  out.report.parts = count_parts(out);
  if (out.vertices.empty()) return out;
  const Vec3d o = out.vertices[0];
  for (std::size_t i = 0; i < out.faces.size(); ++i) {
    const Triangle t = out.view().triangle(i);
    out.report.volume_m3 += dot(t.a - o, cross(t.b - o, t.c - o)) / 6;
  }
  return out;
}

double thin_quantile(const MeshView& mesh, const Bvh& bvh, double fraction) {
  constexpr std::size_t kSamples = 4096;
  std::vector<double> cumulative(mesh.face_count);
  double total = 0;
  for (std::size_t i = 0; i < mesh.face_count; ++i) {
    const Triangle t = mesh.triangle(i);
    cumulative[i] = total += 0.5 * norm(cross(t.b - t.a, t.c - t.a));
  }
  std::vector<double> thickness;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double at = (double(k) + 0.5) / kSamples * total;
    const auto place = std::lower_bound(cumulative.begin(), cumulative.end(), at);
    const Triangle t = mesh.triangle(std::min(mesh.face_count - 1, std::size_t(place - cumulative.begin())));
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    const double length = norm(n);
    if (!(length > 0)) continue;
    // Two fixed irrational numbers spread the points over a face that is drawn more than once.
    double s = std::fmod(0.5 + 0.7548776662466927 * double(k), 1.0);
    double r = std::fmod(0.5 + 0.5698402909980532 * double(k), 1.0);
    if (s + r > 1) s = 1 - s, r = 1 - r;
    const Vec3d inward = (-1 / length) * n, p = t.a + s * (t.b - t.a) + r * (t.c - t.a);
    const double lift = 1e-6 * std::sqrt(length);
    thickness.push_back(lift + bvh.first_hit(p + lift * inward, inward).hit.t);
  }
  if (thickness.empty()) return std::numeric_limits<double>::infinity();
  const auto at = std::min(thickness.size() - 1, std::size_t(fraction * double(thickness.size())));
  std::nth_element(thickness.begin(), thickness.begin() + std::ptrdiff_t(at), thickness.end());
  return thickness[at];
}

}  // namespace sdftrack::sdf

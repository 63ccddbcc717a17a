// SPDX-License-Identifier: MIT
#include "sdf/mesh_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "sdf/bvh.h"

namespace sdftrack::sdf {

namespace {

using Index = std::int32_t;

// A directed edge of a face, filed under its two vertices in order.
struct Edge {
  Index low, high, face;
  bool forward;  // from low to high

  auto key() const { return std::tie(low, high); }
};

std::vector<Edge> sorted_edges(const std::vector<Face>& faces) {
  std::vector<Edge> edges;
  edges.reserve(3 * faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Face& f = faces[i];
    for (const auto& [a, b] : {std::pair{f.a, f.b}, std::pair{f.b, f.c}, std::pair{f.c, f.a}})
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<Index>(i), a < b});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  return edges;
}

template <class Visit>
void for_each_edge(const std::vector<Edge>& edges, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    for (end = begin; end < edges.size() && edges[end].key() == edges[begin].key();) ++end;
    visit(&edges[begin], end - begin);
  }
}

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
    to[static_cast<std::size_t>(order[i])] = static_cast<Index>(out->vertices.size() - 1);
  }
  return to;
}

// Of faces over the same three vertices, those of opposite sense cancel (a flap without volume), and of the
// rest one is kept.
std::vector<Face> drop_duplicates(const std::vector<Face>& faces, MeshReport* report) {
  struct Filed {
    std::array<Index, 3> key;
    std::size_t face;
    int sense;
  };
  std::vector<Filed> filed(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    std::array<Index, 3> k{faces[i].a, faces[i].b, faces[i].c};
    const bool even = (k[0] < k[1]) ^ (k[1] < k[2]) ^ (k[0] < k[2]);
    std::sort(k.begin(), k.end());
    filed[i] = {k, i, even ? 1 : -1};
  }
  std::sort(filed.begin(), filed.end(),
            [](const Filed& a, const Filed& b) { return std::tie(a.key, a.face) < std::tie(b.key, b.face); });
  std::vector<std::uint8_t> keep(faces.size(), 0);
  for (std::size_t begin = 0, end = 0; begin < filed.size(); begin = end) {
    int sum = 0;
    for (end = begin; end < filed.size() && filed[end].key == filed[begin].key; ++end)
      sum += filed[end].sense;
    bool kept = false;
    for (std::size_t i = begin; i < end && !kept; ++i)
      if (filed[i].sense * sum > 0) {
        keep[filed[i].face] = 1;
        kept = true;
      }
    report->duplicate_faces += end - begin - (kept ? 1 : 0);
  }
  std::vector<Face> out;
  for (std::size_t i = 0; i < faces.size(); ++i)
    if (keep[i]) out.push_back(faces[i]);
  return out;
}

// Walks over edges that two faces share and turns, in each region so reached, the minority.
void turn_flipped(std::vector<Face>* faces, MeshReport* report) {
  const std::vector<Edge> edges = sorted_edges(*faces);
  struct Link {
    Index face;
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
    std::vector<std::size_t> region{seed};
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
  }
}

std::size_t count_parts(const CleanMesh& mesh) {
  std::vector<Index> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[static_cast<std::size_t>(i)] != i)
      i = parent[static_cast<std::size_t>(i)] =
          parent[static_cast<std::size_t>(parent[static_cast<std::size_t>(i)])];
    return i;
  };
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (const Face& f : mesh.faces) {
    for (Index v : {f.a, f.b, f.c}) used[static_cast<std::size_t>(v)] = 1;
    parent[static_cast<std::size_t>(root(f.b))] = root(f.a);
    parent[static_cast<std::size_t>(root(f.c))] = root(f.a);
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
    const auto at = [&](Index v) { return to[static_cast<std::size_t>(v)]; };
    const Face f{at(mesh.faces[i].a), at(mesh.faces[i].b), at(mesh.faces[i].c)};
    if (f.a == f.b || f.b == f.c || f.c == f.a)
      ++out.report.degenerate_faces;
    else
      faces.push_back(f);
  }
  out.faces = drop_duplicates(faces, &out.report);
  turn_flipped(&out.faces, &out.report);
  for_each_edge(sorted_edges(out.faces), [&](const Edge* e, std::size_t n) {
    std::ptrdiff_t balance = 0;
    for (std::size_t i = 0; i < n; ++i) balance += e[i].forward ? 1 : -1;
    out.report.open_edges += n == 1;
    out.report.non_manifold_edges += n > 2;
    out.report.unbalanced_edges += balance != 0;
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
    const double at = (static_cast<double>(k) + 0.5) / kSamples * total;
    const auto place = std::lower_bound(cumulative.begin(), cumulative.end(), at);
    const Triangle t =
        mesh.triangle(std::min(mesh.face_count - 1, static_cast<std::size_t>(place - cumulative.begin())));
    const Vec3d n = cross(t.b - t.a, t.c - t.a);
    const double length = norm(n);
    if (!(length > 0)) continue;
    // Two fixed irrational numbers spread the points over a face that is drawn more than once.
    double s = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(k), 1.0);
    double r = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(k), 1.0);
    if (s + r > 1) s = 1 - s, r = 1 - r;
    const Vec3d inward = (-1 / length) * n, p = t.a + s * (t.b - t.a) + r * (t.c - t.a);
    const double lift = 1e-6 * std::sqrt(length);
    thickness.push_back(lift + bvh.first_hit(p + lift * inward, inward).hit.t);
  }
  if (thickness.empty()) return std::numeric_limits<double>::infinity();
  const auto at = std::min(thickness.size() - 1,
                           static_cast<std::size_t>(fraction * static_cast<double>(thickness.size())));
  std::nth_element(thickness.begin(), thickness.begin() + static_cast<std::ptrdiff_t>(at), thickness.end());
  return thickness[at];
}

}  // namespace sdftrack::sdf

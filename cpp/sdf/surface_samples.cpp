// SPDX-License-Identifier: MIT
#include "sdf/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sdf/closest_zero.h"
#include "sdf/triangle.h"

namespace sdftrack {

namespace {

struct Corner {
  Vec3d p;  // voxels
  double phi;
};

Vec3d crossing(const Corner& a, const Corner& b) { return a.p + (a.phi / (a.phi - b.phi)) * (b.p - a.p); }

// The zero set of the linear field in a tetrahedron: nothing, one triangle, or two.
template <class Visit>
void cut(const std::array<Corner, 4>& corners, const Visit& visit) {
  std::array<Corner, 4> in, out;
  std::size_t inside = 0, outside = 0;
  for (const Corner& c : corners) (c.phi < 0 ? in[inside++] : out[outside++]) = c;
  if (inside == 0 || outside == 0) return;
  if (inside == 2) {
    const Vec3d a = crossing(in[0], out[0]), b = crossing(in[0], out[1]), c = crossing(in[1], out[1]),
                d = crossing(in[1], out[0]);
    visit(Triangle{a, b, c});
    visit(Triangle{a, c, d});
    return;
  }
  const auto& one = inside == 1 ? in[0] : out[0];
  const auto& three = inside == 1 ? out : in;
  visit(Triangle{crossing(one, three[0]), crossing(one, three[1]), crossing(one, three[2])});
}

// Six tetrahedra round the diagonal of every cell that the surface enters.
template <class Visit>
void for_each_triangle(const SdfView& sdf, const Visit& visit) {
  constexpr int kPaths[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}};
  const auto row = static_cast<std::size_t>(sdf.nx), slice = row * static_cast<std::size_t>(sdf.ny);
  for (int iz = 0; iz + 1 < sdf.nz; ++iz)
    for (int iy = 0; iy + 1 < sdf.ny; ++iy)
      for (int ix = 0; ix + 1 < sdf.nx; ++ix) {
        const float* c =
            sdf.phi + static_cast<std::size_t>(iz) * slice + static_cast<std::size_t>(iy) * row + ix;
        std::array<Corner, 8> corners;
        int inside = 0;
        for (int k = 0; k < 8; ++k) {
          const int dx = k & 1, dy = (k >> 1) & 1, dz = k >> 2;
          const double phi = c[static_cast<std::size_t>(dz) * slice + static_cast<std::size_t>(dy) * row +
                               static_cast<std::size_t>(dx)];
          corners[static_cast<std::size_t>(k)] = {
              {static_cast<double>(ix + dx), static_cast<double>(iy + dy), static_cast<double>(iz + dz)},
              phi};
          inside += phi < 0;
        }
        if (inside == 0 || inside == 8) continue;
        for (const auto& path : kPaths)
          cut({corners[0], corners[static_cast<std::size_t>(path[0])],
               corners[static_cast<std::size_t>(path[1])], corners[7]},
              visit);
      }
}

double area(const Triangle& t) { return 0.5 * norm(cross(t.b - t.a, t.c - t.a)); }

}  // namespace

std::vector<SurfaceSample> surface_samples(const SdfView& sdf, int count) {
  std::vector<SurfaceSample> samples;
  double total = 0;
  for_each_triangle(sdf, [&](const Triangle& t) { total += area(t); });
  if (!(total > 0) || count <= 0) return samples;

  samples.reserve(static_cast<std::size_t>(count));
  double seen = 0;
  int next = 0;
  for_each_triangle(sdf, [&](const Triangle& t) {
    seen += area(t);
    // One point for each count-th part of the area, in the order of the cells.
    for (; next < count && (next + 0.5) / count * total <= seen; ++next) {
      // Two irrational steps (the plastic number's) spread the places inside the triangles.
      double s = std::fmod(0.5 + 0.7548776662466927 * next, 1.0),
             r = std::fmod(0.5 + 0.5698402909980532 * next, 1.0);
      if (s + r > 1) s = 1 - s, r = 1 - r;
      const Vec3d vox = t.a + s * (t.b - t.a) + r * (t.c - t.a);
      Vec3d p = sdf.origin_obj.cast<double>() + static_cast<double>(sdf.voxel_m) * vox, g;
      double phi = 0;
      for (int i = 0; i < 8; ++i) p = newton_to_zero(sdf, p, &phi, &g);
      sample(sdf, p, &phi, &g);
      const double length = norm(g);
      if (!(length > 1e-6) || std::abs(phi) > 1e-2 * static_cast<double>(sdf.voxel_m)) continue;
      samples.push_back({p.cast<float>(), ((1 / length) * g).cast<float>()});
    }
  });
  return samples;
}

}  // namespace sdftrack

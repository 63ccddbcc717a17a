// SPDX-License-Identifier: MIT
#include "sdf/paint.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace sdftrack::sdf {

namespace {

// Barycentric weights of a point in the triangle's plane; the first corner for a triangle without area.
void weigh_corners(const Triangle& t, Vec3d p, double (&w)[3]) {
  const Vec3d n = cross(t.b - t.a, t.c - t.a);
  const double area2 = dot(n, n);
  w[0] = 1, w[1] = w[2] = 0;
  if (!(area2 > 0)) return;
  w[1] = std::clamp(dot(cross(p - t.a, t.c - t.a), n) / area2, 0.0, 1.0);
  w[2] = std::clamp(dot(cross(t.b - t.a, p - t.a), n) / area2, 0.0, 1.0 - w[1]);
  w[0] = 1 - w[1] - w[2];
}

}  // namespace

std::vector<std::uint8_t> paint(const MeshView& mesh, const std::uint8_t* vertex_rgb, const Grid& grid,
                                const float* phi, double reach_m, int threads) {
  const Bvh bvh(mesh);
  std::vector<std::uint8_t> rgba(4 * grid.size());
  parallel_for(grid.nz, threads, [&](std::size_t z) {
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const std::size_t i = grid.index(x, y, int(z));
        if (std::abs(double(phi[i])) > reach_m + grid.voxel_m) continue;
        const Closest at = bvh.closest(grid.point(x, y, int(z)), reach_m * reach_m);
        if (at.face < 0) continue;
        const auto face = std::size_t(at.face);
        double w[3];
        weigh_corners(mesh.triangle(face), at.point, w);
        const std::int32_t corner[3] = {mesh.faces[face].a, mesh.faces[face].b, mesh.faces[face].c};
        for (int c = 0; c < 3; ++c) {
          double sum = 0.5;
          for (int k = 0; k < 3; ++k) sum += w[k] * vertex_rgb[3 * corner[k] + c];
          rgba[4 * i + std::size_t(c)] = static_cast<std::uint8_t>(sum);
        }
        rgba[4 * i + 3] = 255;
      }
  });
  return rgba;
}

}  // namespace sdftrack::sdf

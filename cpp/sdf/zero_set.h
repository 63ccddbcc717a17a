// SPDX-License-Identifier: MIT
// The zero set of a volume as triangles: each cell is cut into six tetrahedra around its diagonal, and the
// field is linear in each. Closed wherever the volume's border is outside, in any configuration of signs.
#pragma once

#include <cstddef>

#include "base/views.h"
#include "sdf/triangle.h"

namespace sdftrack::sdf {

namespace zero_set {

struct Corner {
  Vec3d p;  // voxels
  double phi;
};

HD Vec3d crossing(const Corner& a, const Corner& b) { return a.p + (a.phi / (a.phi - b.phi)) * (b.p - a.p); }

// The zero set of the linear field in a tetrahedron: nothing, one triangle, or two.
template <class Visit>
HD void cut(const Corner (&corners)[4], const Visit& visit) {
  Corner in[4], out[4];
  int inside = 0, outside = 0;
  for (const Corner& c : corners) (c.phi < 0 ? in[inside++] : out[outside++]) = c;
  if (inside == 0 || outside == 0) return;
  if (inside == 2) {
    const Vec3d a = crossing(in[0], out[0]), b = crossing(in[0], out[1]), c = crossing(in[1], out[1]),
                d = crossing(in[1], out[0]);
    visit(Triangle{a, b, c});
    visit(Triangle{a, c, d});
    return;
  }
  const Corner& one = inside == 1 ? in[0] : out[0];
  const Corner* const three = inside == 1 ? out : in;
  visit(Triangle{crossing(one, three[0]), crossing(one, three[1]), crossing(one, three[2])});
}

// The triangles of the cell that begins at voxel (x, y, z); phi: at its corners, x fastest.
template <class Visit>
HD void cut_cell(int x, int y, int z, const float (&phi)[8], const Visit& visit) {
  constexpr int kPaths[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}};
  Corner corners[8];
  for (int k = 0; k < 8; ++k)
    corners[k] = {{double(x + (k & 1)), double(y + (k >> 1 & 1)), double(z + (k >> 2))}, phi[k]};
  for (const auto& path : kPaths) cut({corners[0], corners[path[0]], corners[path[1]], corners[7]}, visit);
}

}  // namespace zero_set

// Six tetrahedra around the diagonal of every cell on the surface. visit(Triangle): corners in voxels.
template <class Visit>
void for_each_zero_triangle(const SdfView& sdf, const Visit& visit) {
  const auto row = std::size_t(sdf.nx), slice = row * std::size_t(sdf.ny);
  for (int iz = 0; iz + 1 < sdf.nz; ++iz)
    for (int iy = 0; iy + 1 < sdf.ny; ++iy)
      for (int ix = 0; ix + 1 < sdf.nx; ++ix) {
        const float* c = sdf.phi + std::size_t(iz) * slice + std::size_t(iy) * row + ix;
        const float* d = c + slice;
        const bool inside = c[0] < 0;  // nearly every cell lies on one side
        if ((c[1] < 0) == inside && (c[row] < 0) == inside && (c[row + 1] < 0) == inside &&
            (d[0] < 0) == inside && (d[1] < 0) == inside && (d[row] < 0) == inside &&
            (d[row + 1] < 0) == inside)
          continue;
        zero_set::cut_cell(ix, iy, iz, {c[0], c[1], c[row], c[row + 1], d[0], d[1], d[row], d[row + 1]},
                           visit);
      }
}

}  // namespace sdftrack::sdf

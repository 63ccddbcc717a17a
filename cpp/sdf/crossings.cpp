// SPDX-License-Identifier: MIT
#include "sdf/crossings.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "base/parallel.h"
#include "base/to_int.h"

namespace sdftrack::sdf {

namespace {

// y and z are snapped to 2^-18 voxel, so that "left or right of this edge" is exact in 64 bits up to 8000
// voxels a side. Two triangles then agree about their shared edge in spite of rounding.
constexpr std::int64_t kSubvoxel = std::int64_t{1} << 18;
// From the origin, in subvoxels: twice the product of two differences of coordinates fits an int64.
constexpr std::int64_t kFarthest = (std::int64_t{1} << 30) - 1;

struct Corner {
  std::int64_t y, z;
  double x;
};

struct Crossing {
  std::size_t row;
  double x_vox;
  std::int8_t step;  // +1: the ray along +x enters
};

std::int64_t edge(const Corner& a, const Corner& b, std::int64_t y, std::int64_t z) {
  return (b.y - a.y) * (z - a.z) - (b.z - a.z) * (y - a.y);
}

// On the edge itself the point counts as moved by (e, e^2) in (y, z), e infinitesimal: there are no ties.
bool left_of(const Corner& a, const Corner& b, std::int64_t e) {
  if (e != 0) return e > 0;
  return a.z != b.z ? b.z < a.z : b.y > a.y;
}

Corner snap(const Grid& grid, Vec3d p) {
  const double s = 1 / grid.voxel_m;
  const auto subvoxel = [&](double x_m) {
    const double x = std::round(x_m * s * double(kSubvoxel));
    if (!(std::abs(x) <= double(kFarthest)))
      throw std::invalid_argument("mesh: expected vertices within " + std::to_string(kFarthest / kSubvoxel) +
                                  " voxels of the volume; choose larger voxels or a part of the mesh");
    return static_cast<std::int64_t>(x);
  };
  return {subvoxel(p.y - grid.origin_obj.y), subvoxel(p.z - grid.origin_obj.z),
          (p.x - grid.origin_obj.x) * s};
}

int first_line(std::int64_t low) { return int(std::max<std::int64_t>(0, (low + kSubvoxel - 1) / kSubvoxel)); }
int last_line(std::int64_t high, int n) { return int(std::min<std::int64_t>(n - 1, high / kSubvoxel)); }

void add_crossings(const Triangle& t, const Grid& grid, std::vector<Crossing>* out) {
  Corner a = snap(grid, t.a), b = snap(grid, t.b), c = snap(grid, t.c);
  const std::int64_t area = edge(a, b, c.y, c.z);
  if (area == 0) return;  // parallel to the rows
  const std::int8_t step = area < 0 ? 1 : -1;
  if (area < 0) std::swap(b, c);
  for (int iz = first_line(std::min({a.z, b.z, c.z})); iz <= last_line(std::max({a.z, b.z, c.z}), grid.nz);
       ++iz)
    for (int iy = first_line(std::min({a.y, b.y, c.y})); iy <= last_line(std::max({a.y, b.y, c.y}), grid.ny);
         ++iy) {
      const std::int64_t y = iy * kSubvoxel, z = iz * kSubvoxel;
      const std::int64_t wa = edge(b, c, y, z), wb = edge(c, a, y, z), wc = edge(a, b, y, z);
      if (!left_of(b, c, wa) || !left_of(c, a, wb) || !left_of(a, b, wc)) continue;
      const double x = (double(wa) * a.x + double(wb) * b.x + double(wc) * c.x) / double(std::abs(area));
      out->push_back({std::size_t(iz) * grid.ny + iy, x, step});
    }
}

}  // namespace

std::vector<std::int8_t> winding_numbers(const MeshView& mesh, const Grid& grid, int threads) {
  std::vector<Crossing> crossings;
  for (std::size_t i = 0; i < mesh.face_count; ++i) add_crossings(mesh.triangle(i), grid, &crossings);
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return a.row != b.row ? a.row < b.row : a.x_vox != b.x_vox ? a.x_vox < b.x_vox : a.step < b.step;
  });

  std::vector<std::int8_t> winding(grid.size(), 0);
  const auto slice = [&](std::size_t iz) {
    const std::size_t begin = iz * std::size_t(grid.ny), end = begin + std::size_t(grid.ny);
    const auto before = [](const Crossing& c, std::size_t row) { return c.row < row; };
    auto next = std::lower_bound(crossings.begin(), crossings.end(), begin, before);
    while (next != crossings.end() && next->row < end) {
      const std::size_t row = next->row;
      std::int8_t* line = &winding[row * std::size_t(grid.nx)];
      int number = 0, ix = 0;
      for (; next != crossings.end() && next->row == row; ++next) {
        const int stop = to_int(std::clamp(std::ceil(next->x_vox), 0.0, double(grid.nx)));
        for (; ix < stop; ++ix) line[ix] = static_cast<std::int8_t>(std::clamp(number, -127, 127));
        number += next->step;
      }
      for (; ix < grid.nx && number != 0; ++ix)
        line[ix] = static_cast<std::int8_t>(std::clamp(number, -127, 127));
    }
  };
  parallel_for(grid.nz, threads, slice);
  return winding;
}

}  // namespace sdftrack::sdf

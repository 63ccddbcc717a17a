// SPDX-License-Identifier: MIT
#include "sdf/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace sdftrack::sdf {

namespace {

// One step down the gradient onto phi = 0.
Vec3d newton_to_zero(const SdfView& sdf, Vec3d q, double* phi_m, Vec3d* gradient) {
  sample(sdf, q, phi_m, gradient);
  const double g2 = dot(*gradient, *gradient);
  return g2 > 1e-12 ? q - (*phi_m / g2) * *gradient : q;
}

// Spreads the lowest ten bits of x to every third bit of the result.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ffu;
  x = (x | x << 8) & 0x0300f00fu;
  x = (x | x << 4) & 0x030c30c3u;
  return (x | x << 2) & 0x09249249u;
}

// Position of a triangle on a space-filling curve: neighbours on the curve are neighbours in space.
std::uint32_t curve_place(const Triangle& t) {
  const auto cell = [](double v) { return static_cast<std::uint32_t>(std::clamp(v, 0.0, 1023.0)); };
  return spread(cell(t.a.x)) | spread(cell(t.a.y)) << 1 | spread(cell(t.a.z)) << 2;
}

// A hash of the bits that separates neighbours.
std::uint32_t scrambled(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}

double area(const Triangle& t) { return 0.5 * norm(cross(t.b - t.a, t.c - t.a)); }

}  // namespace

ZeroSurface::ZeroSurface(const SdfView& sdf) : sdf_(sdf) {
  std::vector<Triangle> found;
  for_each_zero_triangle(sdf, [&](const Triangle& t) {
    found.push_back(t);
    area_vox_ += area(t);
  });
  // In the order of the cells both sides of a body alternate, and equal steps of area would favour one side.
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  order.reserve(found.size());
  for (const Triangle& t : found) order.emplace_back(curve_place(t), order.size());
  std::sort(order.begin(), order.end());
  triangles_.reserve(found.size());
  for (const auto& [place, at] : order) triangles_.push_back(found[at]);
}

double ZeroSurface::area_m2() const { return area_vox_ * double(sdf_.voxel_m) * double(sdf_.voxel_m); }

std::vector<SurfaceSample> ZeroSurface::samples(int count) const {
  const SdfView& sdf = sdf_;
  const double total = area_vox_;
  std::vector<SurfaceSample> samples;
  if (!(total > 0) || count <= 0) return samples;

  samples.reserve(count);
  double seen = 0;
  int next = 0;
  for (const Triangle& t : triangles_) {
    seen += area(t);
    // One point for each count-th part of the area, along the curve.
    for (; next < count && (next + 0.5) / count * total <= seen; ++next) {
      // Two irrational steps (the plastic number's) spread the points inside the triangles.
      double s = std::fmod(0.5 + 0.7548776662466927 * next, 1.0),
             r = std::fmod(0.5 + 0.5698402909980532 * next, 1.0);
      if (s + r > 1) s = 1 - s, r = 1 - r;
      const Vec3d vox = t.a + s * (t.b - t.a) + r * (t.c - t.a);
      Vec3d p = sdf.origin_obj.cast<double>() + double(sdf.voxel_m) * vox, g;
      double phi = 0;
      for (int i = 0; i < 8; ++i) p = newton_to_zero(sdf, p, &phi, &g);
      sample(sdf, p, &phi, &g);
      const double length = norm(g);
      if (!(length > 1e-6) || std::abs(phi) > 1e-2 * double(sdf.voxel_m)) continue;
      samples.push_back({p.cast<float>(), ((1 / length) * g).cast<float>()});
    }
  }
  return samples;
}

std::vector<SurfaceSample> sample_near(const SdfView& sdf, const std::vector<VoxelBox>& boxes,
                                       const std::function<bool(std::size_t voxel)>& requested, int count) {
  struct Near {
    std::uint32_t order;
    int x, y, z;
  };
  std::vector<Near> found;
  const float half = 0.5f * sdf.voxel_m;
  const auto row = std::size_t(sdf.nx), slice = row * std::size_t(sdf.ny);
  for (const VoxelBox& box : boxes)
    for (int z = box.z0; z < box.z1; ++z)
      for (int y = box.y0; y < box.y1; ++y) {
        const std::size_t at = std::size_t(z) * slice + std::size_t(y) * row;
        for (int x = box.x0; x < box.x1; ++x) {
          const std::size_t i = at + std::size_t(x);
          if (std::abs(sdf.phi[i]) < half && requested(i))
            found.push_back({scrambled(static_cast<std::uint32_t>(i)), x, y, z});
        }
      }
  const auto earlier = [](const Near& a, const Near& b) { return a.order < b.order; };
  const std::size_t kept = std::min(found.size(), std::size_t(std::max(0, count)));
  std::partial_sort(found.begin(), found.begin() + std::ptrdiff_t(kept), found.end(), earlier);
  std::vector<SurfaceSample> samples;
  samples.reserve(kept);
  for (std::size_t k = 0; k < kept; ++k) {
    const Vec3d voxel{1.0 * found[k].x, 1.0 * found[k].y, 1.0 * found[k].z};
    Vec3d p = sdf.origin_obj.cast<double>() + double(sdf.voxel_m) * voxel, g;
    double phi = 0;
    for (int i = 0; i < 3; ++i) p = newton_to_zero(sdf, p, &phi, &g);
    sample(sdf, p, &phi, &g);
    const double length = norm(g);
    if (!(length > 1e-6) || std::abs(phi) > 5e-2 * double(sdf.voxel_m)) continue;
    samples.push_back({p.cast<float>(), ((1 / length) * g).cast<float>()});
  }
  return samples;
}

}  // namespace sdftrack::sdf

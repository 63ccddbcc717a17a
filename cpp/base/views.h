// SPDX-License-Identifier: MIT
// Views: small structs that own nothing and are passed by value to a loop or a kernel.
#pragma once

#include <cstddef>

#include "base/vec.h"

namespace sdftrack {

// Row-major image, pixel (0, 0) is the centre of the first pixel.
template <class T>
struct ImageView {
  const T* data;
  int width, height;

  HD T operator()(int x, int y) const { return data[static_cast<std::size_t>(y) * width + x]; }
};

// phi[(iz * ny + iy) * nx + ix] is the distance in metres at voxel centre
// origin_obj + voxel_m * (ix, iy, iz); negative inside the object. At least 2 voxels along each axis.
struct SdfView {
  const float* phi;
  int nx, ny, nz;
  float voxel_m;
  Vec3f origin_obj;
};

// One axis of a trilinear sample: the cell, the fraction in it, and what clamping to the box did.
template <class T>
struct AxisSample {
  int cell;      // index of the lower corner
  T fraction;    // 0..1 in the cell
  T beyond_vox;  // signed distance to the box in voxels, 0 inside
};

template <class T>
HD AxisSample<T> locate(T x_vox, int n) {
  const T last = static_cast<T>(n - 1);
  const T q = x_vox > T(0) ? (x_vox < last ? x_vox : last) : T(0);  // NaN becomes 0: no read outside
  int cell = static_cast<int>(q);
  cell = cell > n - 2 ? n - 2 : cell;
  return {cell, q - static_cast<T>(cell), x_vox - q};
}

// phi (m) and its gradient (dimensionless) at p_obj: the trilinear interpolant and its exact derivative, from
// the same 8 corners. Outside the box the field goes on as phi(q) + |p - q|, q = p clamped to the box, so it
// is continuous everywhere and always points back (docs/math/depth_tracker.md, section 1).
template <class T>
HD void sample(const SdfView& sdf, Vec3<T> p_obj, T* phi_m, Vec3<T>* gradient) {
  const T inv_voxel = T(1) / static_cast<T>(sdf.voxel_m);
  const AxisSample<T> x = locate((p_obj.x - static_cast<T>(sdf.origin_obj.x)) * inv_voxel, sdf.nx);
  const AxisSample<T> y = locate((p_obj.y - static_cast<T>(sdf.origin_obj.y)) * inv_voxel, sdf.ny);
  const AxisSample<T> z = locate((p_obj.z - static_cast<T>(sdf.origin_obj.z)) * inv_voxel, sdf.nz);

  const std::size_t row = static_cast<std::size_t>(sdf.nx), slice = row * static_cast<std::size_t>(sdf.ny);
  const float* c = sdf.phi + static_cast<std::size_t>(z.cell) * slice +
                   static_cast<std::size_t>(y.cell) * row + static_cast<std::size_t>(x.cell);
  const T c000 = c[0], c100 = c[1], c010 = c[row], c110 = c[row + 1];
  const T c001 = c[slice], c101 = c[slice + 1], c011 = c[slice + row], c111 = c[slice + row + 1];

  const T dx00 = c100 - c000, dx10 = c110 - c010, dx01 = c101 - c001, dx11 = c111 - c011;
  const T v00 = c000 + x.fraction * dx00, v10 = c010 + x.fraction * dx10;
  const T v01 = c001 + x.fraction * dx01, v11 = c011 + x.fraction * dx11;
  const T w0 = v00 + y.fraction * (v10 - v00), w1 = v01 + y.fraction * (v11 - v01);
  const T dx0 = dx00 + y.fraction * (dx10 - dx00), dx1 = dx01 + y.fraction * (dx11 - dx01);

  T phi = w0 + z.fraction * (w1 - w0);
  Vec3<T> g{inv_voxel * (dx0 + z.fraction * (dx1 - dx0)),
            inv_voxel * ((v10 - v00) + z.fraction * ((v11 - v01) - (v10 - v00))), inv_voxel * (w1 - w0)};

  const Vec3<T> beyond{x.beyond_vox, y.beyond_vox, z.beyond_vox};
  const T beyond2 = dot(beyond, beyond);
  if (beyond2 > T(0)) {
    const T length = std::sqrt(beyond2);
    phi += static_cast<T>(sdf.voxel_m) * length;
    // Along a clamped axis q does not move with p: only |p - q| changes there.
    g = {beyond.x != T(0) ? beyond.x / length : g.x, beyond.y != T(0) ? beyond.y / length : g.y,
         beyond.z != T(0) ? beyond.z / length : g.z};
  }
  *phi_m = phi;
  *gradient = g;
}

}  // namespace sdftrack

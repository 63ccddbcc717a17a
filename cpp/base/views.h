// SPDX-License-Identifier: MIT
// Views: small structs that own nothing and are passed by value to a loop or a kernel.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vec.h"

namespace sdftrack {

// Row-major image, pixel (0, 0) is the centre of the first pixel.
template <class T>
struct ImageView {
  const T* data;
  int width, height;

  HD T operator()(int x, int y) const { return data[std::size_t(y) * width + x]; }
};

// phi[(iz * ny + iy) * nx + ix]: distance (m) at origin_obj + voxel_m * (ix, iy, iz); negative inside the
// object. At least 2 voxels along each axis, fewer than 2^31 in all.
struct SdfView {
  const float* phi;
  int nx, ny, nz;
  float voxel_m;
  Vec3f origin_obj;
  std::uint64_t id = 0;  // identifies the values: different volumes have different ids; 0: unknown
};

// One axis of a trilinear sample: the cell, the fraction in it, and the effect of clamping to the box.
template <class T>
struct AxisSample {
  IntOf<T> cell;  // index of the lower corner
  T fraction;     // 0..1 in the cell
  T beyond_vox;   // signed distance to the box in voxels, 0 inside
};

template <class T>
HD AxisSample<T> locate(T x_vox, int n) {
  const T last = T(static_cast<ScalarOf<T>>(n - 1)), last_cell = T(static_cast<ScalarOf<T>>(n - 2));
  const T q =
      select(x_vox > T(0), select(x_vox < last, x_vox, last), T(0));  // NaN becomes 0: no read outside
  const IntOf<T> cell = truncate(select(q < last_cell, q, last_cell));
  return {cell, q - real<T>(cell), x_vox - q};
}

// phi (m) and its gradient (dimensionless) at p_obj: the trilinear interpolant and its exact derivative, from
// the same 8 corners. Outside the box the field continues as phi(q) + |p - q|, q = p clamped to the box, so
// it is continuous everywhere and always points back (docs/math/depth_tracker.md, section 1).
template <class T>
HD void sample(const SdfView& sdf, Vec3<T> p_obj, T* phi_m, Vec3<T>* gradient) {
  using S = ScalarOf<T>;
  const T voxel = T(S(sdf.voxel_m)), inv_voxel = T(S(1) / S(sdf.voxel_m));
  const AxisSample<T> x = locate((p_obj.x - T(S(sdf.origin_obj.x))) * inv_voxel, sdf.nx);
  const AxisSample<T> y = locate((p_obj.y - T(S(sdf.origin_obj.y))) * inv_voxel, sdf.ny);
  const AxisSample<T> z = locate((p_obj.z - T(S(sdf.origin_obj.z))) * inv_voxel, sdf.nz);

  const int row = sdf.nx, slice = row * sdf.ny;
  const IntOf<T> at = z.cell * slice + y.cell * row + x.cell;
  T c000, c100, c010, c110, c001, c101, c011, c111;
  gather_pair(sdf.phi, at, &c000, &c100);
  gather_pair(sdf.phi + row, at, &c010, &c110);
  gather_pair(sdf.phi + slice, at, &c001, &c101);
  gather_pair(sdf.phi + slice + row, at, &c011, &c111);

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
  const auto outside = beyond2 > T(0);
  if (any(outside)) {
    const T length = sqrt(beyond2);
    phi = select(outside, phi + voxel * length, phi);
    // Along a clamped axis q does not move with p: only |p - q| changes there.
    g = {select(beyond.x != T(0), beyond.x / length, g.x), select(beyond.y != T(0), beyond.y / length, g.y),
         select(beyond.z != T(0), beyond.z / length, g.z)};
  }
  *phi_m = phi;
  *gradient = g;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// The brightness of a coloured surface, from a volume of colours (docs/math/photometric.md).
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/views.h"

namespace sdftrack::energies {

// Colours (0..255 times 256; 0, 0, 0: not known) at the voxels of a distance volume, and how much each voxel
// was seen; 4 numbers per voxel.
struct ColorView {
  const std::uint16_t* rgb_seen = nullptr;  // nullptr: no colours
  std::uint16_t least = 1;                  // if seen less, the colour is not known
};

// Rec. 601 luma (0..1) of an RGB colour with channels from 0 to `full`.
template <class C>
HD float brightness(const C* rgb, float full) {
  return (0.299f * float(rgb[0]) + 0.587f * float(rgb[1]) + 0.114f * float(rgb[2])) / full;
}

constexpr double kMinKnown = 0.5;  // least summed weight of the known ones among the eight corners

// Brightness (0..1) at p_obj and its gradient (1/m): the trilinear interpolant of the known corners, over the
// sum of their weights. False where too few corners are known.
template <class T>
HD bool sample_brightness(const SdfView& sdf, const ColorView& colors, Vec3<T> p_obj, T* grey,
                          Vec3<T>* gradient) {
  const T inv = T(1) / T(sdf.voxel_m);
  const AxisSample<T> x = locate((p_obj.x - T(sdf.origin_obj.x)) * inv, sdf.nx);
  const AxisSample<T> y = locate((p_obj.y - T(sdf.origin_obj.y)) * inv, sdf.ny);
  const AxisSample<T> z = locate((p_obj.z - T(sdf.origin_obj.z)) * inv, sdf.nz);
  if (x.beyond_vox != T(0) || y.beyond_vox != T(0) || z.beyond_vox != T(0)) return false;
  T sum = 0, weight = 0;
  Vec3<T> d_sum{0, 0, 0}, d_weight{0, 0, 0};
  for (int k = 0; k < 8; ++k) {
    const int i = k & 1, j = k >> 1 & 1, l = k >> 2;
    const std::size_t at =
        (std::size_t(z.cell + l) * sdf.ny + std::size_t(y.cell + j)) * std::size_t(sdf.nx) +
        std::size_t(x.cell + i);
    const std::uint16_t* const c = colors.rgb_seen + 4 * at;
    if (c[3] < colors.least || !(c[0] | c[1] | c[2])) continue;
    const T wx = i ? x.fraction : T(1) - x.fraction, wy = j ? y.fraction : T(1) - y.fraction,
            wz = l ? z.fraction : T(1) - z.fraction;
    const T g = T(brightness(c, 255.0f * 256.0f)), w = wx * wy * wz;
    const Vec3<T> dw{(i ? inv : -inv) * wy * wz, (j ? inv : -inv) * wx * wz, (l ? inv : -inv) * wx * wy};
    sum += w * g, weight += w;
    d_sum = d_sum + g * dw, d_weight = d_weight + dw;
  }
  if (!(weight >= T(kMinKnown))) return false;
  *grey = sum / weight;
  *gradient = (T(1) / weight) * (d_sum - *grey * d_weight);
  return true;
}

}  // namespace sdftrack::energies

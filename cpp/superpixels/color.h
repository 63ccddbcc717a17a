// SPDX-License-Identifier: MIT
// Converts sRGB to the colours that superpixels compare, as whole numbers that are equal on every processor:
// only products, sums and roundings of float, in one order, and no table that could differ. Error against the
// exact formulas: below 0.02 units of L, a or b, most of it from rounding (docs/math/superpixels.md).
#pragma once

#include <cstdint>

#include "base/lane.h"

namespace sdftrack::superpixels {

enum class ColorSpace { kLab, kXyz, kRgb };

// x^(-1/3) for x > 0.008: an estimate from the exponent, 3.4 % off, and two steps of third order.
template <class T>
HD T inverse_cube_root(T x) {
  T r = from_bits<T>(truncate(T(1.4199173e9f) - real<T>(bits_of(x)) * T(1.f / 3)));
  for (int step = 0; step < 2; ++step) {
    const T e = T(1) - x * (r * r * r);
    r = r + r * (e * (T(1.f / 3) + e * T(2.f / 9)));
  }
  return r;
}

// x^(12/5) for 0.05 < x < 1.1, by x^(-1/5) in three Newton steps.
template <class T>
HD T to_the_2_4(T x) {
  T r = from_bits<T>(truncate(T(1.2779306e9f) - real<T>(bits_of(x)) * T(0.2f)));
  for (int step = 0; step < 3; ++step) {
    const T r2 = r * r;
    r = r * (T(1.2f) - x * T(0.2f) * (r2 * r2 * r));
  }
  const T q = x * r;
  return q * q * q;
}

// Linear light of an sRGB value in 0..1 (IEC 61966-2-1).
template <class T>
HD T linear_light(T v) {
  const T bent = to_the_2_4((v + T(0.055f)) * T(1 / 1.055f));
  return select(v <= T(0.04045f), v * T(1 / 12.92f), bent);
}

// Rounds to the nearest whole number, for |x| < 32768.
template <class T>
HD IntOf<T> nearest(T x) {
  return truncate(x + T(32768.5f)) - 32768;
}

// A pixel's colour times `scale`. L*, a* and b* (D65), or X, Y and Z, or R, G and B, the last six in percent.
template <class T>
struct ColorFeature {
  IntOf<T> c0, c1, c2;
};

// The curve of L*a*b*: a cube root of light, except for dark values.
template <class T>
HD T lab_bend(T t) {
  const T r = inverse_cube_root(t);
  return select(t > T(0.008856452f), t * (r * r), T(7.7870370f) * t + T(16.f / 116));
}

// r, g, b: light in 0..1; for kRgb the unchanged values.
template <ColorSpace kSpace, class T>
HD ColorFeature<T> color_feature(T r, T g, T b, T scale) {
  if constexpr (kSpace == ColorSpace::kRgb) {
    const T percent = T(100) * scale;
    return {nearest(r * percent), nearest(g * percent), nearest(b * percent)};
  } else {
    const T x = (T(0.412453f) * r + T(0.357580f) * g) + T(0.180423f) * b;
    const T y = (T(0.212671f) * r + T(0.715160f) * g) + T(0.072169f) * b;
    const T z = (T(0.019334f) * r + T(0.119193f) * g) + T(0.950227f) * b;
    if constexpr (kSpace == ColorSpace::kXyz) {
      const T percent = T(100) * scale;
      return {nearest(x * percent), nearest(y * percent), nearest(z * percent)};
    } else {
      const T fx = lab_bend(x * T(1 / 0.95047f)), fy = lab_bend(y), fz = lab_bend(z * T(1 / 1.08883f));
      return {nearest((T(116) * fy - T(16)) * scale), nearest(T(500) * (fx - fy) * scale),
              nearest(T(200) * (fy - fz) * scale)};
    }
  }
}

// Two signed 16-bit numbers in one of 32 bits, which the processor multiplies in pairs.
template <class I>
HD I pair_of(I low, I high) {
  return (low & 0xffff) | (high << 16);
}
HD int low_of(std::int32_t pair) { return static_cast<std::int16_t>(pair & 0xffff); }
HD int high_of(std::int32_t pair) { return pair >> 16; }

}  // namespace sdftrack::superpixels

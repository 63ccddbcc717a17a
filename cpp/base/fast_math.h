// SPDX-License-Identifier: MIT
// exp and log for per-pixel work: polynomials without tables or branches, so that they inline. In double they
// are the library's own, which is what the finite-difference tests use.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "base/hd.h"

namespace sdftrack {

// e^x for x <= 0; relative error below 4e-7 for x >= -4, growing to 8e-6 at -80; 2e-38 below -87.
HD float exp_negative(float x) {
#ifdef __CUDA_ARCH__
  return expf(x);
#else
  const float t = 1.44269504f * (x < -87.0f ? -87.0f : x);
  const int n = static_cast<int>(t - 0.5f);  // nearest integer, t <= 0
  const float f = (t - static_cast<float>(n)) * 0.69314718f;
  const float f2 = f * f;  // Estrin's order: short chains, so that neighbouring pixels overlap
  const float p = (1.0f + f) + f2 * ((0.5f + 0.16666667f * f) +
                                     f2 * ((0.041666668f + 0.0083333338f * f) + 0.0013888889f * f2));
  return p * std::bit_cast<float>((n + 127) << 23);
#endif
}
HD double exp_negative(double x) { return std::exp(x); }

// Natural logarithm of a positive normal number; absolute error below 6e-7 for numbers below 3.
HD float log_positive(float x) {
#ifdef __CUDA_ARCH__
  return logf(x);
#else
  // x = 2^e m with m in [sqrt(1/2), sqrt(2)); log m = 2 atanh(q), q = (m - 1) / (m + 1), |q| < 0.172.
  const std::int32_t bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t e = (bits - 0x3f3504f3) >> 23;
  const float m = std::bit_cast<float>(bits - (e << 23));
  const float q = (m - 1.0f) / (m + 1.0f), q2 = q * q;
  const float q4 = q2 * q2;
  const float series = q * ((2.0f + 0.66666669f * q2) + q4 * ((0.4f + 0.2857143f * q2) + 0.22222222f * q4));
  return 0.69314718f * static_cast<float>(e) + series;
#endif
}
HD double log_positive(double x) { return std::log(x); }

}  // namespace sdftrack

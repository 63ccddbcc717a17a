// SPDX-License-Identifier: MIT
// exp and log for per-pixel work: polynomials without tables or branches, so that they inline. In double they
// are the standard library's functions, which the finite-difference tests use. On a GPU they are CUDA's
// functions, except in files compiled with SDFTRACK_CPU_BITS.
#pragma once

#include <cmath>

#include "base/lane.h"

#if defined(__CUDA_ARCH__) && !defined(SDFTRACK_CPU_BITS)
#define SDFTRACK_DEVICE_MATH
#endif

namespace sdftrack {

// e^x for x <= 0; relative error below 4e-7 for x >= -4, growing to 8e-6 at -80; 2e-38 below -87.
HD double exp_negative(double x) { return std::exp(x); }
template <class T>
HD T exp_negative(T x) {
#ifdef SDFTRACK_DEVICE_MATH
  return expf(x);
#else
  const T t = T(1.44269504f) * select(x < T(-87.0f), T(-87.0f), x);
  const IntOf<T> n = truncate(t - T(0.5f));  // nearest integer, t <= 0
  const T f = (t - real<T>(n)) * T(0.69314718f);
  const T f2 = f * f;  // Estrin's scheme: short chains, so that neighbouring pixels overlap
  const T p = (T(1.0f) + f) + f2 * ((T(0.5f) + T(0.16666667f) * f) +
                                    f2 * ((T(0.041666668f) + T(0.0083333338f) * f) + T(0.0013888889f) * f2));
  return p * from_bits<T>((n + 127) << 23);
#endif
}

// tanh from e^-2|x|; absolute error below 4e-7.
template <class T>
HD T fast_tanh(T x) {
  const T d = exp_negative(T(-2) * abs(x));
  return copysign((T(1) - d) / (T(1) + d), x);
}

// Natural logarithm of a positive normal number; absolute error below 4e-7 for numbers below 3.
template <class T>
HD T log_positive(T x) {
#ifdef SDFTRACK_DEVICE_MATH
  return logf(x);
#else
  // x = 2^e (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)); log(1 + f) = f - f^2 / 2 + f^3 P(f), where P is the
  // minimax polynomial of its degree.
  const IntOf<T> bits = bits_of(x), e = (bits - 0x3f3504f3) >> 23;
  const T f = from_bits<T>(bits - (e << 23)) - T(1.0f), f2 = f * f;
  const T P = (T(0.333346903f) - T(0.249805734f) * f) +
              f2 * ((T(0.199102372f) - T(0.171669081f) * f) + f2 * (T(0.161411837f) - T(0.102242053f) * f));
  return T(0.69314718f) * real<T>(e) + (f + f2 * (f * P - T(0.5f)));
#endif
}
HD double log_positive(double x) { return std::log(x); }

// The error function (Abramowitz and Stegun, 7.1.26); absolute error below 1e-6. Cut at 4 to avoid denormal
// numbers, which cost a hundred times as much.
template <class T>
HD T fast_erf(T x) {
#ifdef SDFTRACK_DEVICE_MATH
  return erff(x);
#else
  const T size = select(abs(x) < T(4), abs(x), T(4)), t = T(1) / (T(1) + T(0.3275911f) * size);
  const T p =
      t * (T(0.254829592f) +
           t * (T(-0.284496736f) + t * (T(1.421413741f) + t * (T(-1.453152027f) + t * T(1.061405429f)))));
  return copysign(T(1) - p * exp_negative(T(-1) * size * size), x);
#endif
}
HD double fast_erf(double x) { return std::erf(x); }

}  // namespace sdftrack

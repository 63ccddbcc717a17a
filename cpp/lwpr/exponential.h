// SPDX-License-Identifier: MIT
// The exponential of activations, for one number or a pack: bitwise equal on every device.
#pragma once

#include <cstring>

#include "base/hd.h"

namespace sdftrack::lwpr {

// e^x for -30 <= x <= 0, relative error below 5e-16; undefined for any other x. Bits: long long for a double,
// as many of them for a pack.
template <class Bits, class T>
HD T exp_of(T x) {
  const double magic = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer, in the low bits
  const T t = x * 1.4426950408889634 + magic, n = t - magic;
  const T f = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10;
  const T f2 = f * f, f4 = f2 * f2;
  const T p0 = (1.0 + f) + f2 * (0.5 + f * (1.0 / 6));
  const T p1 = (1.0 / 24 + f * (1.0 / 120)) + f2 * (1.0 / 720 + f * (1.0 / 5040));
  const T p2 = (1.0 / 40320 + f * (1.0 / 362880)) + f2 * (1.0 / 3628800 + f * (1.0 / 39916800)) +
               f4 * (1.0 / 479001600);
  const T p = p0 + f4 * (p1 + f4 * p2);
  Bits bits;
  memcpy(&bits, &t, sizeof(bits));
  bits = (bits << 52) + 0x3ff0000000000000LL;  // 2^n
  T power;
  memcpy(&power, &bits, sizeof(power));
  return p * power;
}

}  // namespace sdftrack::lwpr

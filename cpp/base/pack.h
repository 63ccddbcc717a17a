// SPDX-License-Identifier: MIT
// Packs of floats for lane.h, by the vector extensions of GCC and Clang. Included only by files that are
// compiled for one instruction set (energies/ops_*.cpp, tracking/points_*.cpp); all functions are inlined, so
// that no two of these files share one.
#pragma once

#include "base/lane.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace sdftrack {

template <int W>
struct PackTypes;
template <>
struct PackTypes<4> {
  using Float = float __attribute__((vector_size(16)));
  using Int = int __attribute__((vector_size(16)));
};
template <>
struct PackTypes<8> {
  using Float = float __attribute__((vector_size(32)));
  using Int = int __attribute__((vector_size(32)));
};
template <>
struct PackTypes<16> {
  using Float = float __attribute__((vector_size(64)));
  using Int = int __attribute__((vector_size(64)));
};

template <int W>
struct Pack {
  using V = typename PackTypes<W>::Float;
  using I = typename PackTypes<W>::Int;  // indices; as a mask -1 is yes, 0 no
  V v;

  Pack() = default;
  HD Pack(float x) : v(x - V{}) {}
  HD static Pack of(V v) {
    Pack p;
    p.v = v;
    return p;
  }

  HD friend Pack operator+(Pack a, Pack b) { return of(a.v + b.v); }
  HD friend Pack operator-(Pack a, Pack b) { return of(a.v - b.v); }
  HD friend Pack operator*(Pack a, Pack b) { return of(a.v * b.v); }
  HD friend Pack operator/(Pack a, Pack b) { return of(a.v / b.v); }
  HD friend Pack operator-(Pack a) { return of(-a.v); }
  HD Pack& operator+=(Pack b) { return v += b.v, *this; }
  HD Pack& operator-=(Pack b) { return v -= b.v, *this; }
  HD Pack& operator*=(Pack b) { return v *= b.v, *this; }
  HD friend I operator<(Pack a, Pack b) { return a.v < b.v; }
  HD friend I operator>(Pack a, Pack b) { return a.v > b.v; }
  HD friend I operator<=(Pack a, Pack b) { return a.v <= b.v; }
  HD friend I operator>=(Pack a, Pack b) { return a.v >= b.v; }
  HD friend I operator==(Pack a, Pack b) { return a.v == b.v; }
  HD friend I operator!=(Pack a, Pack b) { return a.v != b.v; }
};

template <int W>
struct Lane<Pack<W>> {
  using Scalar = float;
  using Int = typename Pack<W>::I;
  static constexpr int width = W;
};

template <int W>
HD Pack<W> select(typename Pack<W>::I mask, Pack<W> a, Pack<W> b) {
  return Pack<W>::of(mask ? a.v : b.v);
}
// Compared ints give a mask of long where that has 32 bits (Clang on Windows).
template <class Mask, class I>
HD I select(Mask mask, I a, I b) requires requires {
  mask[0];
  a[0];
}
{ return mask ? a : b; }
template <int W>
HD Pack<W> abs(Pack<W> x) {
  return Pack<W>::of((typename Pack<W>::V)((typename Pack<W>::I)x.v & 0x7fffffff));
}
template <int W>
HD Pack<W> copysign(Pack<W> size, Pack<W> sign) {
  using I = typename Pack<W>::I;
  return Pack<W>::of((typename Pack<W>::V)(((I)size.v & 0x7fffffff) | ((I)sign.v & (int)0x80000000)));
}
template <int W>
HD typename Pack<W>::I truncate(Pack<W> x) {
  return __builtin_convertvector(x.v, typename Pack<W>::I);
}
template <class T>
HD T real(IntOf<T> i) requires(kWidth<T> > 1) {
  return T::of(__builtin_convertvector(i, typename T::V));
}
template <int W>
HD typename Pack<W>::I bits_of(Pack<W> x) {
  return (typename Pack<W>::I)x.v;
}
template <class T>
HD T from_bits(IntOf<T> bits) requires(kWidth<T> > 1) {
  return T::of((typename T::V)bits);
}

#if defined(__AVX512F__)
HD int keep(Pack<16>::I mask, int first, int* out) {
  const __m512i iota = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __mmask16 yes = _mm512_movepi32_mask((__m512i)mask);
  _mm512_storeu_si512(out,
                      _mm512_maskz_compress_epi32(yes, _mm512_add_epi32(iota, _mm512_set1_epi32(first))));
  return __builtin_popcount(yes);
}
HD bool any(Pack<16>::I mask) { return _mm512_movepi32_mask((__m512i)mask) != 0; }
HD bool all(Pack<16>::I mask) { return _mm512_movepi32_mask((__m512i)mask) == 0xffff; }
HD Pack<16> sqrt(Pack<16> x) { return Pack<16>::of((Pack<16>::V)_mm512_sqrt_ps((__m512)x.v)); }
template <class T>
HD T gather(const float* p, Pack<16>::I i) {
  return T::of((Pack<16>::V)_mm512_i32gather_ps((__m512i)i, p, 4));
}
// Eight corners of 64 bits each in one gather; then the even and the odd floats of two of them.
HD void gather_pair(const float* p, Pack<16>::I i, Pack<16>* a, Pack<16>* b) {
  const __m512i at = (__m512i)i;
  const __m512 low = _mm512_castpd_ps(_mm512_i32gather_pd(_mm512_castsi512_si256(at), p, 4));
  const __m512 high = _mm512_castpd_ps(_mm512_i32gather_pd(_mm512_extracti64x4_epi64(at, 1), p, 4));
  const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const __m512i odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
  a->v = (Pack<16>::V)_mm512_permutex2var_ps(low, even, high);
  b->v = (Pack<16>::V)_mm512_permutex2var_ps(low, odd, high);
}
#elif defined(__AVX2__)
HD int keep(Pack<8>::I mask, int first, int* out) {
  int yes = _mm256_movemask_ps((__m256)mask), n = 0;
  for (; yes != 0; yes &= yes - 1) out[n++] = first + __builtin_ctz(static_cast<unsigned>(yes));
  return n;
}
HD bool any(Pack<8>::I mask) { return _mm256_movemask_ps((__m256)mask) != 0; }
HD bool all(Pack<8>::I mask) { return _mm256_movemask_ps((__m256)mask) == 0xff; }
HD Pack<8> sqrt(Pack<8> x) { return Pack<8>::of((Pack<8>::V)_mm256_sqrt_ps((__m256)x.v)); }
template <class T>
HD T gather(const float* p, Pack<8>::I i) {
  return T::of((Pack<8>::V)_mm256_i32gather_ps(p, (__m256i)i, 4));
}
HD void gather_pair(const float* p, Pack<8>::I i, Pack<8>* a, Pack<8>* b) {
  const __m256i at = (__m256i)i;
  const double* pairs = (const double*)p;
  const __m256 low = _mm256_castpd_ps(_mm256_i32gather_pd(pairs, _mm256_castsi256_si128(at), 4));
  const __m256 high = _mm256_castpd_ps(_mm256_i32gather_pd(pairs, _mm256_extracti128_si256(at, 1), 4));
  // Within each half 0 1 . . and 8 9 . .; then the quarters in order.
  const __m256 even = _mm256_shuffle_ps(low, high, 0x88), odd = _mm256_shuffle_ps(low, high, 0xdd);
  a->v = (Pack<8>::V)_mm256_permute4x64_pd((__m256d)even, 0xd8);
  b->v = (Pack<8>::V)_mm256_permute4x64_pd((__m256d)odd, 0xd8);
}
#else
HD int keep(Pack<4>::I mask, int first, int* out) {
  int n = 0;
  for (int k = 0; k < 4; ++k) out[n] = first + k, n += mask[k] != 0;
  return n;
}
HD bool any(Pack<4>::I mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }
HD bool all(Pack<4>::I mask) { return (mask[0] & mask[1] & mask[2] & mask[3]) != 0; }
HD Pack<4> sqrt(Pack<4> x) {
  for (int k = 0; k < 4; ++k) x.v[k] = std::sqrt(x.v[k]);
  return x;
}
template <class T>
HD T gather(const float* p, Pack<4>::I i) {
  T x;
  for (int k = 0; k < 4; ++k) x.v[k] = p[i[k]];
  return x;
}
HD void gather_pair(const float* p, Pack<4>::I i, Pack<4>* a, Pack<4>* b) {
  for (int k = 0; k < 4; ++k) a->v[k] = p[i[k]], b->v[k] = p[i[k] + 1];
}
#endif

}  // namespace sdftrack

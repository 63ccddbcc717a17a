// SPDX-License-Identifier: MIT
// Additions to base/pack.h for the loops over rows of pixels, for the lanes of the file that includes this
// (rows_*.cpp): pairs of 16 bits, bytes, and the packs at the ends of rows.
#pragma once

#include "superpixels/row_ops.h"

namespace sdftrack::superpixels {
namespace {

#define SLIC_INLINE __attribute__((always_inline))

using L = SDFTRACK_LANES;
using I = IntOf<L>;
constexpr int kW = kWidth<L>;

// low * low + high * high of two pairs; their differences; four times each; the smaller of two numbers.
HD int pair_product(int a, int b) { return low_of(a) * low_of(b) + high_of(a) * high_of(b); }
#if defined(__AVX512BW__)
HD I pair_product(I a, I b) { return (I)_mm512_madd_epi16((__m512i)a, (__m512i)b); }
HD I pair_minus(I a, I b) { return (I)_mm512_sub_epi16((__m512i)a, (__m512i)b); }
HD I pair_times_4(I a) { return (I)_mm512_slli_epi16((__m512i)a, 2); }
HD I smaller(I a, I b) { return (I)_mm512_min_epi32((__m512i)a, (__m512i)b); }
#elif defined(__AVX2__)
HD I pair_product(I a, I b) { return (I)_mm256_madd_epi16((__m256i)a, (__m256i)b); }
HD I pair_minus(I a, I b) { return (I)_mm256_sub_epi16((__m256i)a, (__m256i)b); }
HD I pair_times_4(I a) { return (I)_mm256_slli_epi16((__m256i)a, 2); }
HD I smaller(I a, I b) { return (I)_mm256_min_epi32((__m256i)a, (__m256i)b); }
#elif defined(__SSE2__)
HD I pair_product(I a, I b) { return (I)_mm_madd_epi16((__m128i)a, (__m128i)b); }
HD I pair_minus(I a, I b) { return (I)_mm_sub_epi16((__m128i)a, (__m128i)b); }
HD I pair_times_4(I a) { return (I)_mm_slli_epi16((__m128i)a, 2); }
HD I smaller(I a, I b) { return a < b ? a : b; }
#else
HD int pair_minus(int a, int b) { return pair_of(low_of(a) - low_of(b), high_of(a) - high_of(b)); }
HD int pair_times_4(int a) { return pair_of(4 * low_of(a), 4 * high_of(a)); }
HD int smaller(int a, int b) { return a < b ? a : b; }
#endif

HD I all_lanes(int x) { return I{} + x; }

HD I load_whole(const int* p) {
  I v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
// The first n of a pack; nothing after them is read.
HD I load_part(const int* p, int n) {
#if defined(__AVX512BW__)
  return (I)_mm512_maskz_loadu_epi32(static_cast<__mmask16>((1u << n) - 1), p);
#elif defined(__AVX2__)
  const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  return (I)_mm256_maskload_epi32(p, _mm256_cmpgt_epi32(_mm256_set1_epi32(n), lane));
#else
  int some[kW] = {};
  for (int k = 0; k < n; ++k) some[k] = p[k];
  return load_whole(some);
#endif
}
HD void store_part(I v, int* p, int n) {
  if (n >= kW) {
    __builtin_memcpy(p, &v, sizeof v);
  } else {
    int some[kW];
    __builtin_memcpy(some, &v, sizeof v);
    for (int k = 0; k < n; ++k) p[k] = some[k];
  }
}
HD int sum_of(I v) {
  int lanes[kW], sum = 0;
  store_part(v, lanes, kW);
  for (int k = 0; k < kW; ++k) sum += lanes[k];
  return sum;
}

// table[which] of each, as bytes; which < 16.
HD void store_codes(I which, const std::uint8_t* table, std::uint8_t* out) {
#if defined(__AVX512BW__)
  const __m128i codes = _mm_load_si128((const __m128i*)table);
  _mm_storeu_si128((__m128i*)out, _mm_shuffle_epi8(codes, _mm512_cvtepi32_epi8((__m512i)which)));
#elif defined(__AVX2__)
  const __m128i words =
      _mm_packs_epi32(_mm256_castsi256_si128((__m256i)which), _mm256_extracti128_si256((__m256i)which, 1));
  const __m128i codes = _mm_load_si128((const __m128i*)table);
  _mm_storel_epi64((__m128i*)out, _mm_shuffle_epi8(codes, _mm_packus_epi16(words, words)));
#else
  int some[kW];
  store_part(which, some, kW);
  unsigned codes = 0;  // one word: a word read back after byte writes would stall
  for (int k = 0; k < kW; ++k) codes |= static_cast<unsigned>(table[some[k]]) << 8 * k;
  __builtin_memcpy(out, &codes, kW);
#endif
}

// The first n bytes of eight or fewer: another thread may be writing the bytes after them.
HD std::uint64_t first_bytes(const std::uint8_t* p, int n) {
  std::uint64_t all = 0;
  if (n == kW) {
    __builtin_memcpy(&all, p, kW < 8 ? kW : 8);
  } else if (n >= 4) {  // both halves overlap
    std::uint32_t low, high;
    __builtin_memcpy(&low, p, 4), __builtin_memcpy(&high, p + n - 4, 4);
    all = low | static_cast<std::uint64_t>(high) << 8 * (n - 4);
  } else {
    for (int k = 0; k < n; ++k) all |= static_cast<std::uint64_t>(p[k]) << 8 * k;
  }
  return all;
}

// A bit for each of the first n bytes of a pack that has changed, except for kOutside.
HD unsigned changed_bits(const std::uint8_t* now, const std::uint8_t* was, int n) {
  const unsigned all = (1u << n) - 1;
#if defined(__AVX512BW__)
  const __m128i old = _mm_maskz_loadu_epi8(static_cast<__mmask16>(all), was);
  const __mmask16 inside = _mm_cmpneq_epi8_mask(old, _mm_set1_epi8(static_cast<char>(kOutside)));
  return _mm_mask_cmpneq_epi8_mask(inside, _mm_loadu_si128((const __m128i*)now), old) & all;
#elif defined(__SSE2__)
  long long bytes = 0;
  __builtin_memcpy(&bytes, now, kW);
  const __m128i old = _mm_cvtsi64_si128(static_cast<long long>(first_bytes(was, n))),
                same = _mm_cmpeq_epi8(_mm_cvtsi64_si128(bytes), old);
  const __m128i outside = _mm_cmpeq_epi8(old, _mm_set1_epi8(static_cast<char>(kOutside)));
  return static_cast<unsigned>(~_mm_movemask_epi8(_mm_or_si128(same, outside))) & all;
#else
  return (now[0] != was[0]) & (was[0] != kOutside) & all;
#endif
}

template <class Mask, class T>
HD T choose(Mask mask, T a, T b) {
  return mask ? a : b;
}

// Whole packs, and what is left at the end of a row.
struct Whole {
  HD I load(const int* p) const { return load_whole(p); }
  static constexpr int n = kW;
};
struct Part {
  int n;
  HD I load(const int* p) const { return load_part(p, n); }
};
// body(i, part) for the pixels of a row; the properties of a part are constants for all whole packs.
template <class Body>
HD void each_part(int width, const Body& body) {
  int i = 0;
  for (; i + kW <= width; i += kW) body(i, Whole{});
  if (i < width) body(i, Part{width - i});
}

}  // namespace
}  // namespace sdftrack::superpixels

// SPDX-License-Identifier: MIT
// The loops of row_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "superpixels/row_ops.h"

namespace sdftrack {
namespace {

using L = SDFTRACK_LANES;
using I = IntOf<L>;
constexpr int kW = kWidth<L>;

// low * low + high * high of two pairs.
HD int pair_product(int a, int b) { return low_of(a) * low_of(b) + high_of(a) * high_of(b); }
#if defined(__AVX512BW__)
HD I pair_product(I a, I b) { return (I)_mm512_madd_epi16((__m512i)a, (__m512i)b); }
HD I pair_minus(I a, I b) { return (I)_mm512_sub_epi16((__m512i)a, (__m512i)b); }
#elif defined(__AVX2__)
HD I pair_product(I a, I b) { return (I)_mm256_madd_epi16((__m256i)a, (__m256i)b); }
HD I pair_minus(I a, I b) { return (I)_mm256_sub_epi16((__m256i)a, (__m256i)b); }
#elif defined(__SSE2__)
HD I pair_product(I a, I b) { return (I)_mm_madd_epi16((__m128i)a, (__m128i)b); }
HD I pair_minus(I a, I b) { return (I)_mm_sub_epi16((__m128i)a, (__m128i)b); }
#else
HD int pair_minus(int a, int b) { return pair_of(low_of(a) - low_of(b), high_of(a) - high_of(b)); }
#endif

HD I all_lanes(int x) { return I{} + x; }

HD I load_whole(const int* p) {
  I v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}
// The first n of a pack; nothing beyond them is read.
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
HD void store_bytes(I v, std::uint8_t* out) {
#if defined(__AVX512BW__)
  _mm_storeu_si128((__m128i*)out, _mm512_cvtepi32_epi8((__m512i)v));
#elif defined(__AVX2__)
  const __m128i words = _mm_packs_epi32(_mm256_castsi256_si128((__m256i)v), _mm256_extracti128_si256((__m256i)v, 1));
  _mm_storel_epi64((__m128i*)out, _mm_packus_epi16(words, words));
#else
  int some[kW];
  __builtin_memcpy(some, &v, sizeof v);
  for (int k = 0; k < kW; ++k) out[k] = static_cast<std::uint8_t>(some[k]);
#endif
}

template <class Mask, class T>
HD T choose(Mask mask, T a, T b) {
  return mask ? a : b;
}

// body(i, n, load) for the pixels of a row; n and how to load them are constants for all whole packs.
template <class Body>
HD void each_part(int width, const Body& body) {
  int i = 0;
  for (; i + kW <= width; i += kW) body(i, [](const int* p) __attribute__((always_inline)) { return load_whole(p); });
  if (i < width) {
    const int n = width - i;
    body(i, [n](const int* p) __attribute__((always_inline)) { return load_part(p, n); });
  }
}

// Of |p - c|^2 only what depends on the centre: |c|^2 - 2 c p. One product of pairs does two of the terms.
template <bool kDepth, int kCount>
void nearest_squared(const CellRows& cell, const NearCenters& near, int count, std::uint8_t* out, int out_stride) {
  const int many = kCount > 0 ? kCount : count;
  I c01[kNear], c2x[kNear], z[kNear], id[kNear];
  int constant[kNear];
  for (int k = 0; k < many; ++k) {
    const int a = low_of(near.c01[k]), b = high_of(near.c01[k]), c = low_of(near.c2x[k]), x = high_of(near.c2x[k]);
    c01[k] = all_lanes(pair_of(-2 * a, -2 * b));
    c2x[k] = all_lanes(pair_of(-2 * c, -2 * x));
    id[k] = all_lanes(near.id[k]);
    constant[k] = a * a + b * b + c * c + x * x + near.y[k] * near.y[k];
    if constexpr (kDepth) z[k] = all_lanes(-2 * near.z[k]), constant[k] += near.z[k] * near.z[k];
  }
  for (int row = 0; row < cell.rows; ++row) {
    const std::ptrdiff_t at = row * cell.stride;
    int c[kNear];
    for (int k = 0; k < many; ++k) c[k] = constant[k] - 2 * near.y[k] * cell.y[row];
    std::uint8_t* const to = out + row * out_stride;
    each_part(cell.width, [&](int i, const auto& load) __attribute__((always_inline)) {
      const I p01 = load(cell.c01 + at + i), p2x = load(cell.c2x + at + i);
      I pz{};
      if constexpr (kDepth) pz = load(cell.z + at + i);
      const auto cost = [&](int k) __attribute__((always_inline)) {
        I e = (pair_product(p01, c01[k]) + pair_product(p2x, c2x[k])) + c[k];
        if constexpr (kDepth) e = e + pz * z[k];
        return e;
      };
      I best = cost(0), which = id[0];
      for (int k = 1; k < many; ++k) {
        const I e = cost(k);
        const auto nearer = e < best;
        which = choose(nearer, id[k], which);
        best = choose(nearer, e, best);
      }
      store_bytes(which, to + i);
    });
  }
}

// d_lab + (m / S) d_xy (Eq. A.1): two square roots.
template <bool kDepth>
void nearest_thesis(const CellRows& cell, const NearCenters& near, std::uint8_t* out, int out_stride) {
  for (int row = 0; row < cell.rows; ++row) {
    const std::ptrdiff_t at = row * cell.stride;
    std::uint8_t* const to = out + row * out_stride;
    each_part(cell.width, [&](int i, const auto& load) __attribute__((always_inline)) {
      const I p01 = load(cell.c01 + at + i), p2x = load(cell.c2x + at + i);
      I pz{};
      if constexpr (kDepth) pz = load(cell.z + at + i);
      const auto cost = [&](int k) __attribute__((always_inline)) {
        const I d01 = pair_minus(p01, all_lanes(near.c01[k])), d2x = pair_minus(p2x, all_lanes(near.c2x[k]));
        const I d2 = d2x & 0xffff, dx = d2x >> 16;
        const int dy = cell.y[row] - near.y[k];
        I color = pair_product(d01, d01) + pair_product(d2, d2);
        if constexpr (kDepth) {
          const I dz = pz - near.z[k];
          color = color + dz * dz;
        }
        return sqrt(real<L>(color)) + sqrt(real<L>(dx * dx + dy * dy));
      };
      L best = cost(0);
      I which = all_lanes(near.id[0]);
      for (int k = 1; k < near.count; ++k) {
        const L e = cost(k);
        const auto nearer = e < best;
        which = choose(nearer, all_lanes(near.id[k]), which);
        best = select(nearer, e, best);
      }
      store_bytes(which, to + i);
    });
  }
}

void nearest_centers(SlicDistance distance, const CellRows& cell, const NearCenters& near, std::uint8_t* out,
                     int out_stride) {
  if (distance == SlicDistance::kThesis)
    return cell.z ? nearest_thesis<true>(cell, near, out, out_stride)
                  : nearest_thesis<false>(cell, near, out, out_stride);
  if (cell.z) return nearest_squared<true, 0>(cell, near, near.count, out, out_stride);
  if (near.count == kNear) return nearest_squared<false, kNear>(cell, near, kNear, out, out_stride);
  return nearest_squared<false, 0>(cell, near, near.count, out, out_stride);
}

template <ColorSpace kSpace>
HD void convert_to(const float* r, const float* g, const float* b, int n, float scale, const int* x, int* c01,
                   int* c2x) {
  for (int i = 0; i < n; i += kW) {
    const int some = n - i < kW ? n - i : kW;
    const ColorFeature<L> f =
        color_feature<kSpace>(load<L>(r + i, some), load<L>(g + i, some), load<L>(b + i, some), L(scale));
    const I place = some == kW ? load_whole(x + i) : load_part(x + i, some);
    store_part(pair_of(f.c0, f.c1), c01 + i, some);
    store_part(pair_of(f.c2, place), c2x + i, some);
  }
}

void convert_row(ColorSpace space, const float* r, const float* g, const float* b, int n, float scale, const int* x,
             int* c01, int* c2x) {
  if (space == ColorSpace::kLab)
    convert_to<ColorSpace::kLab>(r, g, b, n, scale, x, c01, c2x);
  else if (space == ColorSpace::kXyz)
    convert_to<ColorSpace::kXyz>(r, g, b, n, scale, x, c01, c2x);
  else
    convert_to<ColorSpace::kRgb>(r, g, b, n, scale, x, c01, c2x);
}

void linearize_row(const float* values, int n, float* light) {
  for (int i = 0; i < n; i += kW) {
    const int some = n - i < kW ? n - i : kW;
    store(linear_light(load<L>(values + i, some)), light + i, some);
  }
}

}  // namespace

const RowOps RowOps::SDFTRACK_SET = {convert_row, linearize_row, nearest_centers};

}  // namespace sdftrack

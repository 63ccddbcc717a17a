// SPDX-License-Identifier: MIT
// The loops of row_ops.h for the lanes L of the file that includes this; see energies/term_loops.h.
#pragma once

#include "superpixels/row_ops.h"

namespace sdftrack {
namespace {

#define SLIC_INLINE __attribute__((always_inline))

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
  const __m128i words =
      _mm_packs_epi32(_mm256_castsi256_si128((__m256i)v), _mm256_extracti128_si256((__m256i)v, 1));
  _mm_storel_epi64((__m128i*)out, _mm_packus_epi16(words, words));
#else
  int some[kW];
  __builtin_memcpy(some, &v, sizeof v);
  for (int k = 0; k < kW; ++k) out[k] = static_cast<std::uint8_t>(some[k]);
#endif
}

HD I load_bytes(const std::uint8_t* p) {
#if defined(__AVX512BW__)
  return (I)_mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i*)p));
#elif defined(__AVX2__)
  return (I)_mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i*)p));
#else
  int some[kW];
  for (int k = 0; k < kW; ++k) some[k] = p[k];
  return load_whole(some);
#endif
}

template <class Mask, class T>
HD T choose(Mask mask, T a, T b) {
  return mask ? a : b;
}

// Whole packs, and what is left at the end of a row.
struct Whole {
  HD I load(const int* p) const { return load_whole(p); }
  HD auto among(I mask) const { return mask; }
};
struct Part {
  int n;
  HD I load(const int* p) const { return load_part(p, n); }
  HD auto among(I mask) const { return mask & (I)among_first<L>(n); }
};
// body(i, part) for the pixels of a row; what a part can do is a constant for all whole packs.
template <class Body>
HD void each_part(int width, const Body& body) {
  int i = 0;
  for (; i + kW <= width; i += kW) body(i, Whole{});
  if (i < width) body(i, Part{width - i});
}

// Writes the ids of a part and lists those that are new; returns the end of the list.
template <class P>
HD int put(const P& part, I which, const CellRows& cell, const Tile& tile, int row, int i, int found) {
  store_bytes(which, tile.now + row * tile.stride + i);
  const I was = load_bytes(tile.was + row * cell.stride + i);
  const I fresh = part.among((I)(was != which) & (I)(was != int{kOutside}));
  return found + keep(fresh, changed_at(row, i), tile.changed + found);
}

// Of |p - c|^2 only what depends on the centre, |c|^2 - 2 c p: without what hangs on the row.
struct Costs {
  I c01[kNear], c2x[kNear], z[kNear], id[kNear];
  alignas(64) int constant[kNearRoom], y[kNearRoom];
};

template <bool kDepth>
HD void make_costs(const NearCenters& near, int many, Costs* costs) {
  alignas(64) int c01[kNearRoom], c2x[kNearRoom], z[kNearRoom];
  for (int k = 0; k < kNearRoom; k += kW) {
    const I a = load_whole(near.c01 + k), b = load_whole(near.c2x + k), y = load_whole(near.y + k);
    I constant = pair_product(a, a) + pair_product(b, b) + y * y;
    if constexpr (kDepth) {
      const I d = load_whole(near.z + k);
      constant = constant + d * d;
      store_part(d * -2, z + k, kW);
    }
    store_part(pair_minus(I{}, pair_minus(a, pair_minus(I{}, a))), c01 + k, kW);  // -2 of both
    store_part(pair_minus(I{}, pair_minus(b, pair_minus(I{}, b))), c2x + k, kW);
    store_part(constant, costs->constant + k, kW);
    store_part(y * -2, costs->y + k, kW);
  }
  for (int k = 0; k < many; ++k) {
    costs->c01[k] = all_lanes(c01[k]), costs->c2x[k] = all_lanes(c2x[k]),
    costs->id[k] = all_lanes(near.id[k]);
    if constexpr (kDepth) costs->z[k] = all_lanes(z[k]);
  }
}

// kRows rows at a time: what belongs to a centre is loaded once for them.
template <bool kDepth, int kCount, int kRows>
HD void nearest_in_rows(const CellRows& cell, const Costs& costs, int count, int row, const Tile& tile,
                        int* found) {
  const int many = kCount > 0 ? kCount : count;
  const std::ptrdiff_t at = row * cell.stride;
  alignas(64) int c[kRows][kNearRoom];
  for (int r = 0; r < kRows; ++r)
    for (int k = 0; k < kNearRoom; k += kW)
      store_part(load_whole(costs.constant + k) + load_whole(costs.y + k) * cell.y[row + r], c[r] + k, kW);
  each_part(cell.width, [&](int i, const auto& part) SLIC_INLINE {
    const int(*constants)[kNearRoom] = c;
    asm("" : "+r"(constants));  // read where they are added: for narrow cells cheaper than packs of them
    I p01[kRows], p2x[kRows], pz[kRows], best[kRows], which[kRows];
    for (int r = 0; r < kRows; ++r) {
      // The same rows of the next cell: lines too far apart for the processor to guess.
      prefetch(cell.c01 + at + r * cell.stride + i + cell.width);
      prefetch(cell.c2x + at + r * cell.stride + i + cell.width);
      p01[r] = part.load(cell.c01 + at + r * cell.stride + i),
      p2x[r] = part.load(cell.c2x + at + r * cell.stride + i);
      if constexpr (kDepth) pz[r] = part.load(cell.z + at + r * cell.stride + i);
    }
    const auto cost = [&](int r, int k) SLIC_INLINE {
      I e = (pair_product(p01[r], costs.c01[k]) + pair_product(p2x[r], costs.c2x[k])) + constants[r][k];
      if constexpr (kDepth) e = e + pz[r] * costs.z[k];
      return e;
    };
    for (int r = 0; r < kRows; ++r) best[r] = cost(r, 0), which[r] = costs.id[0];
#pragma GCC unroll 9
    for (int k = 1; k < many; ++k)
      for (int r = 0; r < kRows; ++r) {
        const I e = cost(r, k);
        const auto nearer = e < best[r];
        which[r] = choose(nearer, costs.id[k], which[r]);
        best[r] = choose(nearer, e, best[r]);
      }
    for (int r = 0; r < kRows; ++r) *found = put(part, which[r], cell, tile, row + r, i, *found);
  });
}

template <bool kDepth, int kCount>
int nearest_squared(const CellRows& cell, const NearCenters& near, const Tile& tile) {
  Costs costs;
  make_costs<kDepth>(near, kCount > 0 ? kCount : near.count, &costs);
  int row = 0, found = 0;
  for (; row + 2 <= cell.rows; row += 2)
    nearest_in_rows<kDepth, kCount, 2>(cell, costs, near.count, row, tile, &found);
  if (row < cell.rows) nearest_in_rows<kDepth, kCount, 1>(cell, costs, near.count, row, tile, &found);
  return found;
}

// d_lab + (m / S) d_xy (Eq. A.1): two square roots.
template <bool kDepth>
int nearest_thesis(const CellRows& cell, const NearCenters& near, const Tile& tile) {
  int found = 0;
  for (int row = 0; row < cell.rows; ++row) {
    const std::ptrdiff_t at = row * cell.stride;
    each_part(cell.width, [&](int i, const auto& part) SLIC_INLINE {
      const I p01 = part.load(cell.c01 + at + i), p2x = part.load(cell.c2x + at + i);
      I pz{};
      if constexpr (kDepth) pz = part.load(cell.z + at + i);
      const auto cost = [&](int k) SLIC_INLINE {
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
      found = put(part, which, cell, tile, row, i, found);
    });
  }
  return found;
}

int nearest_centers(SlicDistance distance, const CellRows& cell, const NearCenters& near, const Tile& tile) {
  if (distance == SlicDistance::kThesis)
    return cell.z ? nearest_thesis<true>(cell, near, tile) : nearest_thesis<false>(cell, near, tile);
  if (cell.z) return nearest_squared<true, 0>(cell, near, tile);
  if (near.count == kNear) return nearest_squared<false, kNear>(cell, near, tile);
  return nearest_squared<false, 0>(cell, near, tile);
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

void convert_row(ColorSpace space, const float* r, const float* g, const float* b, int n, float scale,
                 const int* x, int* c01, int* c2x) {
  if (space == ColorSpace::kLab)
    convert_to<ColorSpace::kLab>(r, g, b, n, scale, x, c01, c2x);
  else if (space == ColorSpace::kXyz)
    convert_to<ColorSpace::kXyz>(r, g, b, n, scale, x, c01, c2x);
  else
    convert_to<ColorSpace::kRgb>(r, g, b, n, scale, x, c01, c2x);
}

void sum_row(const int* c01, const int* c2x, int n, int* sums) {
  I s0{}, s1{}, s2{};
  const auto add = [&](I a, I b) SLIC_INLINE {
    s0 = s0 + ((a << 16) >> 16), s1 = s1 + (a >> 16), s2 = s2 + ((b << 16) >> 16);
  };
  each_part(n, [&](int i, const auto& part) SLIC_INLINE { add(part.load(c01 + i), part.load(c2x + i)); });
  int lanes[3][kW];
  store_part(s0, lanes[0], kW), store_part(s1, lanes[1], kW), store_part(s2, lanes[2], kW);
  for (int k = 0; k < kW; ++k) sums[0] += lanes[0][k], sums[1] += lanes[1][k], sums[2] += lanes[2][k];
}

void linearize_row(const float* values, int n, float* light) {
  for (int i = 0; i < n; i += kW) {
    const int some = n - i < kW ? n - i : kW;
    store(linear_light(load<L>(values + i, some)), light + i, some);
  }
}

}  // namespace

const RowOps RowOps::SDFTRACK_SET = {convert_row, sum_row, linearize_row, nearest_centers};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// The nearest of 9 centres for the pixels of a tile, for the lanes of the file that includes this.
#pragma once

#include "superpixels/row_packs.h"

namespace sdftrack::superpixels {
namespace {

// Notes the centre of each pixel of a pack, and the pixels for which it is new.
template <class P>
HD void put(const P& part, I which, const NearCenters& near, const CellRows& cell, const Tile& tile, int row,
            int i) {
  std::uint8_t* const now = tile.now + row * tile.stride + i;
  store_codes(which, near.code, now);
  const unsigned changed = changed_bits(now, tile.was + row * cell.stride + i, part.n);
  std::uint16_t& slot = tile.changed[i / 16 * padded_rows(cell) + row];
  slot = static_cast<std::uint16_t>(kW == 16 ? changed : slot | changed << i % 16);
}

// Only the part of |p - c|^2 that depends on the centre, |c|^2 - 2 c p, times sixteen, with the centre's
// index in the four free bits: one number whose minimum is the nearest centre, the first of equals. The
// factor -32 is 4 of the pixel times -8 of the centre: each fits into 16 bits. x is the same in all rows.
struct Costs {
  alignas(64) int c01[kNearRoom], c2y[kNearRoom], x[kNearRoom], first[kNearRoom];
};

HD void make_costs(const NearCenters& near, Costs* costs) {
  alignas(64) static constexpr int kPlace[kNearRoom] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  for (int k = 0; k < kNearRoom; k += kW) {
    const I a = load_whole(near.c0 + k), b = load_whole(near.c1 + k), c = load_whole(near.c2 + k);
    const I x = load_whole(near.x + k), y = load_whole(near.y + k);
    store_part(pair_of(a * -8, b * -8), costs->c01 + k, kW);
    store_part(pair_of(c * -8, y * -8), costs->c2y + k, kW);
    store_part(x * -32, costs->x + k, kW);
    const I square = (a * a + b * b + c * c) + (x * x + y * y);
    store_part(square * 16 + load_whole(kPlace + k), costs->first + k, kW);
  }
}

// Rows at a time: with few registers a centre's values are loaded once for two rows.
constexpr int kRowsAtOnce = kW == 16 ? 1 : 2;

template <int kRows, class P>
HD void nearest_in_rows(const P& part, const CellRows& cell, const NearCenters& near, const I* c01,
                        const I* c2y, const I* first, int row, int i, const Tile& tile) {
  I p01[kRows], p2y[kRows], best[kRows];
  for (int r = 0; r < kRows; ++r) {
    const std::ptrdiff_t at = (row + r) * cell.stride + i;
    // The same rows of the next cell: these lines are too far apart for the processor to predict.
    prefetch(cell.c01 + at + cell.width + kW - 1), prefetch(cell.c2x + at + cell.width + kW - 1);
    p01[r] = pair_times_4(part.load(cell.c01 + at));
    p2y[r] = ((part.load(cell.c2x + at) << 2) & 0xffff) | all_lanes(cell.y[row + r] << 18);
  }
#pragma GCC unroll 9
  for (int k = 0; k < kNear; ++k)
    for (int r = 0; r < kRows; ++r) {
      const I cost = (pair_product(p01[r], c01[k]) + first[k]) + pair_product(p2y[r], c2y[k]);
      best[r] = k == 0 ? cost : smaller(best[r], cost);
    }
  for (int r = 0; r < kRows; ++r) put(part, best[r] & 15, near, cell, tile, row + r, i);
}

void nearest_squared(const CellRows& given, const NearCenters& near, const Tile& given_tile) {
  const CellRows cell = given;  // so that the compiler knows that no written byte aliases them
  const Tile tile = given_tile;
  Costs costs;
  make_costs(near, &costs);
  each_part(cell.width, [&](int i, const auto& part) SLIC_INLINE {
    const I x = part.load(cell.x + i);
    I c01[kNear], c2y[kNear], first[kNear];
#pragma GCC unroll 9
    for (int k = 0; k < kNear; ++k) {
      c01[k] = all_lanes(costs.c01[k]), c2y[k] = all_lanes(costs.c2y[k]);
      first[k] = x * costs.x[k] + costs.first[k];
    }
    int row = 0;
    for (; row + kRowsAtOnce <= cell.rows; row += kRowsAtOnce)
      nearest_in_rows<kRowsAtOnce>(part, cell, near, c01, c2y, first, row, i, tile);
    if (row < cell.rows) nearest_in_rows<1>(part, cell, near, c01, c2y, first, row, i, tile);
  });
}

// Costs that need more than 28 bits: with depth, squared; d_lab + (m / S) d_xy (Eq. A.1), two square roots.
template <bool kThesis>
void nearest_plain(const CellRows& cell, const NearCenters& near, const Tile& tile) {
  using Cost = std::conditional_t<kThesis, L, I>;
  for (int row = 0; row < cell.rows; ++row) {
    const std::ptrdiff_t at = row * cell.stride;
    each_part(cell.width, [&](int i, const auto& part) SLIC_INLINE {
      const I p01 = part.load(cell.c01 + at + i), p2x = part.load(cell.c2x + at + i);
      I pz{};
      if (cell.z) pz = part.load(cell.z + at + i);
      const auto cost = [&](int k) SLIC_INLINE {
        const I d01 = pair_minus(p01, all_lanes(pair_of(near.c0[k], near.c1[k])));
        const I d2x = pair_minus(p2x, all_lanes(pair_of(near.c2[k], near.x[k])));
        const I d2 = d2x & 0xffff, dx = d2x >> 16, dz = pz - near.z[k];
        const int dy = cell.y[row] - near.y[k];
        const I color = (pair_product(d01, d01) + pair_product(d2, d2)) + dz * dz, place = dx * dx + dy * dy;
        if constexpr (kThesis)
          return sqrt(real<L>(color)) + sqrt(real<L>(place));
        else
          return color + place;
      };
      Cost best = cost(0);
      I which{};
      for (int k = 1; k < near.count; ++k) {
        const Cost e = cost(k);
        const auto nearer = e < best;
        which = choose(nearer, all_lanes(k), which);
        best = select(nearer, e, best);
      }
      put(part, which, near, cell, tile, row, i);
    });
  }
}

void nearest_centers(SlicDistance distance, const CellRows& cell, const NearCenters& near, const Tile& tile) {
  __builtin_memset(tile.changed, 0, sizeof(std::uint16_t) * std::size_t(changed_slots(cell)));
  if (distance == SlicDistance::kThesis)
    nearest_plain<true>(cell, near, tile);
  else if (cell.z)
    nearest_plain<false>(cell, near, tile);
  else
    nearest_squared(cell, near, tile);
}

}  // namespace
}  // namespace sdftrack::superpixels

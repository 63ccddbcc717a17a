// SPDX-License-Identifier: MIT
// Sums of a tile's pixels, for the lanes of the file that includes this.
#pragma once

#include "superpixels/row_packs.h"

namespace sdftrack::superpixels {
namespace {

void sum_tile(const CellRows& cell, int* color) {
  I s0{}, s1{}, s2{};
  for (int row = 0; row < cell.rows; ++row) {
    const std::ptrdiff_t at = row * cell.stride;
    each_part(cell.width, [&](int i, const auto& part) SLIC_INLINE {
      const I a = part.load(cell.c01 + at + i), b = part.load(cell.c2x + at + i);
      s0 = s0 + ((a << 16) >> 16), s1 = s1 + (a >> 16), s2 = s2 + ((b << 16) >> 16);
    });
  }
  color[0] = sum_of(s0), color[1] = sum_of(s1), color[2] = sum_of(s2);
}

// The eight numbers of a Gains at once.
using Eight = int __attribute__((vector_size(32)));
using EightShort = short __attribute__((vector_size(16)));
using EightLong = long long __attribute__((vector_size(64)));
using TwoLong = long long __attribute__((vector_size(16)));

HD void add_to(Gains* gains, const Eight& more) {
  Eight sum;
  __builtin_memcpy(&sum, gains->sums, sizeof sum);
  sum += more;
  __builtin_memcpy(gains->sums, &sum, sizeof sum);
}

// visit(row, x) for the changed pixels of a tile.
template <class Visit>
HD bool each_changed(const CellRows& cell, const Tile& tile, const Visit& visit) {
  const int rows = padded_rows(cell), slots = changed_slots(cell);
  std::uint64_t any = 0;
  for (int column = 0, first = 0; first < slots; ++column, first += rows)
    for (int row = 0; row < rows; row += 4) {
      const std::uint16_t* const four = tile.changed + first + row;
      std::uint64_t left = 0;
      for (int k = 0; k < 4; ++k) left |= static_cast<std::uint64_t>(four[k]) << 16 * k;
      any |= left;
      for (; left != 0; left &= left - 1) {
        const int bit = __builtin_ctzll(left);
        visit(row + bit / 16, 16 * column + bit % 16);
      }
    }
  return any != 0;
}

// kFirst: all pixels belong to their own cell's centre so far; its losses are summed in a register.
template <bool kFirst>
HD bool move_all(const CellRows& cell, const Tile& tile, std::uint8_t* codes, Gains* gains) {
  Eight lost{};
  int home = 0;
  const bool any = each_changed(cell, tile, [&](int row, int x) SLIC_INLINE {
    const std::ptrdiff_t at = row * cell.stride + x;
    const int was = codes[at], now = tile.now[row * tile.stride + x];
    codes[at] = static_cast<std::uint8_t>(now);
    const std::uint64_t c01 = static_cast<std::uint32_t>(cell.c01[at]);
    const std::uint64_t c2n = static_cast<std::uint32_t>((cell.c2x[at] & 0xffff) | 0x10000);
    const std::uint64_t xy = static_cast<std::uint32_t>(row << 16 | x);
    const std::uint64_t z = cell.z ? static_cast<std::uint16_t>(cell.z[at]) : 0;
    const TwoLong packed{static_cast<long long>(c01 | c2n << 32), static_cast<long long>(xy | z << 32)};
    const Eight pixel = __builtin_convertvector((EightShort)packed, Eight);
    if constexpr (kFirst)
      lost += pixel, home = was;
    else
      add_to(gains + was, -pixel);
    add_to(gains + now, pixel);
  });
  if (kFirst && any) add_to(gains + home, -lost);
  return any;
}

bool move_pixels(const CellRows& given, const Tile& given_tile, bool first, std::uint8_t* codes,
                 Gains* gains) {
  const CellRows cell = given;
  const Tile tile = given_tile;
  return first ? move_all<true>(cell, tile, codes, gains) : move_all<false>(cell, tile, codes, gains);
}

void settle_gains(Gains* gains, const NearCenters& near, int x, int y, CenterSums* corner,
                  std::ptrdiff_t stride) {
  static_assert(sizeof(CenterSums) == sizeof(EightLong));
  const EightLong place{0, 0, 0, 0, x, y, 0, 0};
  for (int k = 0; k < near.count; ++k) {
    Gains* const of = gains + near.code[k];
    CenterSums* const sums = corner + near.id[k] / 3 * stride + near.id[k] % 3;
    Eight owed;
    EightLong all;
    __builtin_memcpy(&owed, of->sums, sizeof owed);
    __builtin_memcpy(&all, sums, sizeof all);
    all += __builtin_convertvector(owed, EightLong) + place * of->sums[3];
    __builtin_memcpy(static_cast<void*>(sums), &all, sizeof all);
    owed = Eight{};
    __builtin_memcpy(of->sums, &owed, sizeof owed);
  }
}

}  // namespace
}  // namespace sdftrack::superpixels

// SPDX-License-Identifier: MIT
// Loops over rows of pixels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/isa.h"
#include "superpixels/center.h"
#include "superpixels/color.h"

namespace sdftrack::superpixels {

constexpr int kNear = 9;                // centres that a pixel may belong to
constexpr std::uint8_t kOutside = 255;  // in place of a code: outside the mask

// The stored code of a pixel's centre: column and row of the centre's cell, each modulo 4. The centres of two
// adjacent pixels lie within 4 x 4 cells, so equal codes mean the same centre.
constexpr int kCodes = 16;
HD std::uint8_t code_of(int i, int j) { return static_cast<std::uint8_t>((j & 3) << 2 | (i & 3)); }

enum class SlicDistance { kSquared, kThesis };

// The centres around a cell, row by row through the 3 x 3 cells, places counted from the cell's middle; room
// for whole packs. Unused entries are copies of the first, which are never nearer.
constexpr int kNearRoom = 16;
struct NearCenters {
  int count = 0;
  int id[kNearRoom] = {};  // 0..8
  alignas(16) std::uint8_t code[kNearRoom] = {};
  alignas(64) int c0[kNearRoom] = {};
  alignas(64) int c1[kNearRoom] = {};
  alignas(64) int c2[kNearRoom] = {};
  alignas(64) int x[kNearRoom] = {};
  alignas(64) int y[kNearRoom] = {};
  alignas(64) int z[kNearRoom] = {};
};

// Pixels of a cell, or some rows of it. z may be null.
struct CellRows {
  const int* c01;  // pairs of 16 bits, see color.h: colour
  const int* c2x;  // colour and x, counted from the cell's middle
  const int* z;
  std::ptrdiff_t stride;
  int width, rows;
  const int* x;  // of each column, and
  const int* y;  // of each row, counted from the cell's middle
};

// The codes of these pixels, before and after.
struct Tile {
  const std::uint8_t* was;  // codes up to now, or kOutside; strides of CellRows; a pack more can be read
  std::uint8_t* now;        // rows have room for a pack more than the cell is wide
  int stride;               // of `now`
  std::uint16_t*
      changed;  // a bit for each of 16 pixels that has a new code; columns of 16, one after another
};
constexpr int kTile = 8192;                                                   // pixels, rows of `now` in full
HD int padded_rows(const CellRows& cell) { return (cell.rows + 3) / 4 * 4; }  // read four at a time
HD int changed_slots(const CellRows& cell) { return (cell.width + 15) / 16 * padded_rows(cell); }
constexpr int kMaxSlots = 4096;  // changed_slots() of a tile is less: its rows have more than 16 in `now`

// The changes of a centre's sums in a tile, in the order of CenterSums: 2^13 pixels of less than 2^13 each
// fit. x and y in pixels from the tile's first.
struct Gains {
  alignas(32) int sums[8];
};

struct RowOps {
  // Light (RGB: values) of a row to pairs; x of each pixel counted from its cell's middle.
  void (*convert)(ColorSpace, const float* r, const float* g, const float* b, int n, float scale,
                  const int* x, int* c01, int* c2x);
  // Values in 0..1 to light.
  void (*linearize)(const float* values, int n, float* light);
  // The code of the nearest centre, the first of equals, for each pixel, and the pixels whose code changed.
  void (*nearest)(SlicDistance, const CellRows&, const NearCenters&, const Tile& tile);
  // Adds up the three colours of a tile.
  void (*sum)(const CellRows&, int* color);
  // Moves the changed pixels from their old centres to the new ones and writes their codes. Returns whether
  // there are any. first: all pixels have the same old centre.
  bool (*move)(const CellRows&, const Tile&, bool first, std::uint8_t* codes, Gains* gains);
  // Adds the gains to the sums of the centres around a cell and resets them; x and y of the tile's first
  // pixel. `corner`: sums of the cell above to the left; `stride` of them in a row.
  void (*settle)(Gains* gains, const NearCenters&, int x, int y, CenterSums* corner, std::ptrdiff_t stride);

  static const RowOps baseline, avx2, avx512;
};

}  // namespace sdftrack::superpixels

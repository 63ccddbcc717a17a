// SPDX-License-Identifier: MIT
// Loops over rows of pixels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/isa.h"
#include "superpixels/color.h"

namespace sdftrack {

constexpr int kNear = 9;                // centres that a pixel may belong to
constexpr std::uint8_t kOutside = 255;  // in place of the id of one: outside the mask

enum class SlicDistance { kSquared, kThesis };

// The centres around a cell, places counted from the cell's middle. Pairs of 16 bits, see color.h. Room for
// whole packs.
constexpr int kNearRoom = 16;
struct NearCenters {
  int count = 0;
  alignas(64) int id[kNearRoom] = {};   // 0..8: row by row through the 3 x 3 cells
  alignas(64) int c01[kNearRoom] = {};  // colour
  alignas(64) int c2x[kNearRoom] = {};  // colour and x
  alignas(64) int y[kNearRoom] = {};
  alignas(64) int z[kNearRoom] = {};
};

// Pixels of a cell, or some rows of it. z may be null.
struct CellRows {
  const int* c01;
  const int* c2x;
  const int* z;
  std::ptrdiff_t stride;
  int width, rows;
  const int* y;  // of each row, counted from the cell's middle
};

// What becomes of them.
struct Tile {
  const std::uint8_t* was;  // ids up to now, or kOutside; strides as of CellRows; a pack more can be read
  std::uint8_t* now;        // rows have room for a pack more than the cell is wide
  int stride;               // of `now`
  int* changed;             // room for all pixels and a pack
};
constexpr int kTile = 8192;  // pixels, rows of `now` in full
HD int changed_at(int row, int x) { return row << 16 | x; }

struct RowOps {
  // Light (RGB: values) of a row to pairs; x of each pixel counted from its cell's middle.
  void (*convert)(ColorSpace, const float* r, const float* g, const float* b, int n, float scale,
                  const int* x, int* c01, int* c2x);
  // Adds up the three colours of a row of n < 2^16 pixels.
  void (*sum)(const int* c01, const int* c2x, int n, int* sums);
  // Values in 0..1 to light.
  void (*linearize)(const float* values, int n, float* light);
  // The id of the nearest centre, the first of equals, for each pixel; rows of `now` are tile.stride apart.
  // Lists the pixels whose id it changes, in the order of rows, as changed_at(row, x), and returns how many
  // they are.
  int (*nearest)(SlicDistance, const CellRows&, const NearCenters&, const Tile& tile);

  static const RowOps baseline, avx2, avx512;
};

}  // namespace sdftrack

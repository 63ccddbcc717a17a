// SPDX-License-Identifier: MIT
// Loops over rows of pixels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/isa.h"
#include "superpixels/color.h"

namespace sdftrack {

constexpr int kNear = 9;  // centres that a pixel may belong to

enum class SlicDistance { kSquared, kThesis };

// The centres around a cell, places counted from the cell's middle. Pairs of 16 bits, see color.h.
struct NearCenters {
  int count = 0;
  int id[kNear];      // 0..8: row by row through the 3 x 3 cells
  int c01[kNear];     // colour
  int c2x[kNear];     // colour and x
  int y[kNear];
  int z[kNear];
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

struct RowOps {
  // Light (RGB: values) of a row to pairs; x of each pixel counted from its cell's middle.
  void (*convert)(ColorSpace, const float* r, const float* g, const float* b, int n, float scale, const int* x,
                  int* c01, int* c2x);
  // Values in 0..1 to light.
  void (*linearize)(const float* values, int n, float* light);
  // The id of the nearest centre, the first of equals, for each pixel. Rows of `out` are out_stride apart and have
  // room for a whole pack more than the cell is wide.
  void (*nearest)(SlicDistance, const CellRows&, const NearCenters&, std::uint8_t* out, int out_stride);

  static const RowOps baseline, avx2, avx512;
};

}  // namespace sdftrack

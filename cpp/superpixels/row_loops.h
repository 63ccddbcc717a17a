// SPDX-License-Identifier: MIT
// The loops of row_ops.h for the lanes of the file that includes this; see energies/term_loops.h.
#pragma once

#include "superpixels/row_nearest.h"
#include "superpixels/row_sums.h"
#include "superpixels/run_small.h"

namespace sdftrack::superpixels {
namespace {

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

void linearize_row(const float* values, int n, float* light) {
  for (int i = 0; i < n; i += kW) {
    const int some = n - i < kW ? n - i : kW;
    store(linear_light(load<L>(values + i, some)), light + i, some);
  }
}

}  // namespace

const RowOps RowOps::SDFTRACK_SET = {convert_row, linearize_row, nearest_centers,
                                     sum_tile,    move_pixels,   settle_gains};
const RunOps RunOps::SDFTRACK_SET = {mark_row,   start_row,           join_row, find_small_in_row,
                                     choose_row, join_choices_of_row, write_row};

}  // namespace sdftrack::superpixels

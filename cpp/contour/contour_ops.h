// SPDX-License-Identifier: MIT
// Loops over pixels and cells, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include "base/isa.h"
#include "contour/contour_terms.h"

namespace sdftrack::contour {

struct ContourOps {
  energies::Sums<double, 4> (*similarity)(const RegistrationTerm<float, 4>&);
  energies::Sums<double, 6> (*affinity)(const RegistrationTerm<float, 6>&);
  // `count` cells of a row, from `phi` to `out`.
  void (*step)(const ContourStep<float>&, const float* phi, const float* foreground, int row, int count,
               float* out);
  // least[x] = min over k = -radius .. radius of row_square[x + k * row] + k^2, for `count` cells of a row,
  // with rows up to `above` before it and `below` behind it.
  void (*min_square)(const float* row_square, int row, int above, int below, int count, float* least);
  void (*posterior)(const WindowMixture&, int count, float* out);
  void (*sums_at)(const PlacedSamples&, const float* u0, const float* v0, int places, float* sums);
  // out[i * step]: the sum of products of row i with b; the length is a multiple of 16.
  void (*products)(const float* rows, int count, const float* b, int length, float* out, int step);

  // Defined in contour_*.cpp.
  static const ContourOps baseline, avx2, avx512;
};

}  // namespace sdftrack::contour

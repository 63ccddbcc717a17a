// SPDX-License-Identifier: MIT
// Silhouettes as truncated cosine series (thesis Eq. 6.1 to 6.4; docs/math/harmonics.md): +1 inside, -1
// outside, the lowest harmonics of the orthonormal DCT-II.
#pragma once

#include <span>
#include <vector>

#include "contour/memory/plane.h"

namespace sdftrack::contour {

// How coefficients C(u, v) form harmonic k: all with max(u, v) + 1 = k, or all with u + v + 1 = k.
enum class HarmonicOrder { kMax, kSum };

// Row and column frequency of a coefficient, and its harmonic, from 1 on.
struct Frequency {
  int u, v, harmonic;
};

class CosineSeries {
 public:
  // The first n harmonics of a grid of `size` x `size` pixels.
  CosineSeries(int n, HarmonicOrder order, int size);

  // The lowest harmonic first; within one, from (0, k - 1) along the shell to (k - 1, 0).
  const std::vector<Frequency>& layout() const { return layout_; }
  // Coefficients of a picture of the grid, 1 inside and 0 outside.
  std::vector<double> coefficients(const Picture& inside) const;
  std::vector<double> coefficients(const Mask& inside) const;
  // The series at the pixel centres of an image of any size.
  Plane<double> sampled(std::span<const double> coefficients, int width, int height) const;

 private:
  // The cosines at `samples` equidistant points, one a row.
  Plane<double> cosines(int samples) const;
  std::vector<double> coefficients(const Plane<double>& picture) const;

  int n_, size_;
  std::vector<Frequency> layout_;
  Plane<double> basis_;
};

}  // namespace sdftrack::contour

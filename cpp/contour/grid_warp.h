// SPDX-License-Identifier: MIT
// Where an object's grid lies in the image: a similarity or an affinity.
#pragma once

#include <cmath>

namespace sdftrack::contour {

// p_image = A X + t, in pixels. X: cells from the middle of the grid. A is stored row by row.
struct GridWarp {
  double a[4] = {1, 0, 0, 1};
  double t[2] = {0, 0};

  double determinant() const { return a[0] * a[3] - a[1] * a[2]; }
  // Length of a cell in pixels, averaged over directions.
  double scale() const { return std::sqrt(std::abs(determinant())); }
  void to_image(double x, double y, double* u, double* v) const {
    *u = a[0] * x + a[1] * y + t[0], *v = a[2] * x + a[3] * y + t[1];
  }
  GridWarp inverse() const {
    const double d = 1 / determinant();
    GridWarp out{{a[3] * d, -a[1] * d, -a[2] * d, a[0] * d}, {0, 0}};
    out.t[0] = -(out.a[0] * t[0] + out.a[1] * t[1]), out.t[1] = -(out.a[2] * t[0] + out.a[3] * t[1]);
    return out;
  }
  // Moves the grid: X <- M X + m before this warp's inverse becomes the new warp's inverse, so A <- A M^-1.
  GridWarp moved(const double M[4], const double m[2]) const {
    const double d = 1 / (M[0] * M[3] - M[1] * M[2]);
    const double n[4] = {M[3] * d, -M[1] * d, -M[2] * d, M[0] * d};
    GridWarp out{{a[0] * n[0] + a[1] * n[2], a[0] * n[1] + a[1] * n[3], a[2] * n[0] + a[3] * n[2],
                  a[2] * n[1] + a[3] * n[3]},
                 {t[0], t[1]}};
    out.t[0] -= out.a[0] * m[0] + out.a[1] * m[1], out.t[1] -= out.a[2] * m[0] + out.a[3] * m[1];
    return out;
  }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [A, offset] = self;
    archive(A[0], A[1], A[2], A[3], offset[0], offset[1]);
    archive.check(self.scale() > 0 && std::isfinite(self.scale()) && std::isfinite(offset[0] + offset[1]));
  }
};

// Increment of the similarity: (log scale, angle, tx, ty); of the affinity: (m00, m01, m10, m11, tx, ty).
template <int P>
GridWarp moved(const GridWarp& warp, const double* delta) {
  if constexpr (P == 4) {
    const double e = std::exp(delta[0]), c = e * std::cos(delta[1]), s = e * std::sin(delta[1]);
    const double M[4] = {c, -s, s, c};
    return warp.moved(M, delta + 2);
  } else {
    const double M[4] = {1 + delta[0], delta[1], delta[2], 1 + delta[3]};
    return warp.moved(M, delta + 4);
  }
}

}  // namespace sdftrack::contour

// SPDX-License-Identifier: MIT
// The sums that make an EnergySummary, over an even subset of the pixels.
#pragma once

#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kMaxUnknowns = 10;  // one object with its camera; larger problems are not summarised

template <int P>
struct TermSums {
  // Pixels with one kind of residual: fallback, hit, hit at a grazing angle.
  struct Class {
    Sums<double, P> JJ;  // hessian only: sum of weight times J J^T
    double curvature = 0, slope2 = 0, weight = 0;
  };
  Class classes[3];
  Sums<double, P> inliers;  // hessian: sum of J J^T; gradient: due to the interpolant's error; count
  Sums<double, P> missed;   // gradient only, of all pixels whose rays miss the model
  int count = 0;            // pixels of the subset
};

// How far the trilinear interpolant lies above the field, averaged over a cell: h^2 / 12 times the second
// derivatives. Differences over one voxel h give this product without dividing.
template <class Field, class T>
HD T interpolation_error(const Field& field, Vec3<T> p_cam, T voxel_m) {
  T centre, sum = T(0);
  Vec3<T> unused;
  field.value(p_cam, &centre, &unused);
  for (int k = 0; k < 6; ++k) {
    const T h = k % 2 ? voxel_m : -voxel_m, none = T(0);
    T value;
    field.value(p_cam + Vec3<T>{k / 2 == 0 ? h : none, k / 2 == 1 ? h : none, k / 2 == 2 ? h : none}, &value,
                &unused);
    sum += value - centre;
  }
  return sum * T(1.0 / 12);
}

}  // namespace sdftrack::energies

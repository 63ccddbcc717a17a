// SPDX-License-Identifier: MIT
// The sums of which an EnergySummary is made, over an even subset of the pixels.
#pragma once

#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kMaxUnknowns = 10;  // of one object with its camera: more are not summarised

template <int P>
struct TermSums {
  // Pixels whose residuals are of one kind: fallback, hit, hit at a grazing angle.
  struct Class {
    Sums<double, P> JJ;  // hessian alone: sum of weight times J J^T
    double curvature = 0, slope2 = 0, weight = 0;
  };
  Class classes[3];
  Sums<double, P> inliers;  // hessian: sum of J J^T; gradient: what the interpolant's error makes; count
  Sums<double, P> missed;   // gradient alone, of all pixels whose rays miss the model
  int count = 0;            // pixels of the subset
};

// By how much the trilinear interpolant lies above the field on average over a cell: h^2 / 12 of the second
// derivatives, which the differences over one voxel h give without dividing.
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

// SPDX-License-Identifier: MIT
// One voxel of |grad phi| = 1 (docs/math/reconstruction.md, section 3).
#pragma once

#include "base/lane.h"

namespace sdftrack::levelset {

// The type of a comparison of lanes.
template <class T>
using MaskOf = decltype(T(0) < T(0));

template <class T>
HD T least(T a, T b) {
  return select(a < b, a, b);
}
template <class T>
HD T most(T a, T b) {
  return select(a > b, a, b);
}

// Distance of a voxel whose nearer neighbours along the three axes have the distances a, b and c: Godunov's
// upwind difference (Zhao, Mathematics of Computation 74, 2005).
template <class T>
HD T upwind_distance(T a, T b, T c, T voxel_m) {
  const T low = least(a, b), high = most(a, b);
  const T first = least(low, c), third = most(high, c), second = most(low, least(high, c));
  const T gap = first - second, two = T(2) * voxel_m * voxel_m - gap * gap;
  const T u1 = first + voxel_m, u2 = T(0.5f) * (first + second + sqrt(most(two, T(0))));
  const T sum = first + second + third;
  const T three = sum * sum - T(3) * (first * first + second * second + third * third - voxel_m * voxel_m);
  const T u3 = (sum + sqrt(most(three, T(0)))) * T(1.0f / 3.0f);
  return select(u1 <= second, u1, select(u2 <= third, u2, u3));
}

// A row of a volume: its values, and the offsets of its neighbours along y and z.
struct RowAt {
  float* phi;
  int row, slice;
};

template <class T>
struct EikonalTerm {
  float voxel_m, max_m;  // max_m: the limit of distances

  // The voxel's new value. A voxel next to a change of sign keeps its value.
  HD T relax(const RowAt& at, int x, int n) const {
    const float* p = at.phi + x;
    const T own = load<T>(p, n);
    const T x0 = load<T>(p - 1, n), x1 = load<T>(p + 1, n), y0 = load<T>(p - at.row, n),
            y1 = load<T>(p + at.row, n), z0 = load<T>(p - at.slice, n), z1 = load<T>(p + at.slice, n);
    const T low = least(least(least(x0, x1), least(y0, y1)), least(z0, z1)),
            high = most(most(most(x0, x1), most(y0, y1)), most(z0, z1));
    const auto inside = own < T(0);
    const auto crossed = select(inside, high, T(-1)) >= T(0), entered = select(inside, T(0), low) < T(0);
    const T u = upwind_distance(least(abs(x0), abs(x1)), least(abs(y0), abs(y1)), least(abs(z0), abs(z1)),
                                T(voxel_m));
    const T kept = least(u, T(max_m));
    return select(crossed | entered, own, select(inside, T(0) - kept, kept));
  }
};

// A voxel's distance with the sign of its log ratio.
template <class T>
struct Sided {
  T phi;              // of unchanged size; at least a voxel where the sign has changed
  MaskOf<T> crossed;  // whether a neighbour is on the other side
};
// low, high: least and greatest log ratio of the neighbours.
template <class T>
HD Sided<T> sided(T log_ratio, T low, T high, T before, T voxel_m) {
  const auto inside = log_ratio > T(0);
  const auto yes = (select(inside, T(0) - low, high) > T(0)) | (select(inside, low, T(1)) == T(0));
  const T size = abs(before);
  const auto turned = select(inside, before, T(-1) * before) > T(0);
  const T kept = select(turned, most(size, voxel_m), size);
  Sided<T> out;
  out.phi = select(inside, T(-1) * kept, kept), out.crossed = yes;
  return out;
}

}  // namespace sdftrack::levelset

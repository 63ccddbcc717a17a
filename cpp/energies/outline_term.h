// SPDX-License-Identifier: MIT
// The contribution of one outline point.
#pragma once

#include "energies/free_space_residual.h"
#include "energies/points_view.h"
#include "energies/term.h"

namespace sdftrack::energies {

template <class T>
HD Contribution<T, 6> contribution_of(const Curve<T>& c, Vec3<T> g, Vec3<T> p_obj,
                                      decltype(T() < T()) counts) {
  const Vec3<T> m = cross(p_obj, g);
  const T none = T(0);
  return {select(counts, c.cost, none),
          select(counts, c.slope, none),
          select(counts, c.curvature, none),
          {g.x, g.y, g.z, m.x, m.y, m.z}};
}

// How far an outline point lies sideways in free space (energies/free_space_residual.h).
template <class T>
struct OutlineTerm {
  Rigid<T> T_cam_obj, T_obj_cam;
  Intrinsics<T> K;
  DepthLogistic<T> penalty;
  DistanceView grid;
  PointsView points_obj;
  T weight;
  T dead_px;  // distances up to this cost nothing

  template <class U>
  HD OutlineTerm<U> cast() const {
    return {T_cam_obj.template cast<U>(),
            T_obj_cam.template cast<U>(),
            K.template cast<U>(),
            penalty.template cast<U>(),
            grid,
            points_obj,
            U(weight),
            U(dead_px)};
  }
  HD Contribution<T, 6> linearize(IntOf<T> k) const {
    const Vec3<T> p_obj = points_obj.at<T>(k);
    T r;
    Vec3<T> dr_cam;
    const auto counts = free_space_residual(grid, K, dead_px, T_cam_obj * p_obj, &r, &dr_cam);
    const Curve<T> c = penalty(r, T(1));
    return contribution_of({weight * c.cost, weight * c.slope, weight * c.curvature}, -(T_obj_cam.R * dr_cam),
                           p_obj, counts);
  }
};

}  // namespace sdftrack::energies

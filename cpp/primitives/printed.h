// SPDX-License-Identifier: MIT
// How the thesis gives a size: a unit solid scaled along its axes (Eq. 3.27).
#pragma once

#include "primitives/dual.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// S = diag(s): the unit solid has radii and edges of 1, so that s are the lengths; x and y of a round body
// share one length, and a patch has no third.
template <class Solid, class T>
HD Vec3<T> diagonal_of(const T (&size)[sdf::kMaxSizes]) {
  const auto along = [&](const SolidAxis& axis) { return axis.size < 0 ? T(1) : size[axis.size]; };
  return {along(Solid::kAxes[0]), along(Solid::kAxes[1]), along(Solid::kAxes[2])};
}

template <class Solid, class T>
HD sdf::SolidSample<T> unit_sample_of(Vec3<T> p) {
  if constexpr (requires { Solid::unit_sample(p); }) {
    return Solid::unit_sample(p);
  } else {
    const T one[sdf::kMaxSizes] = {T(1), T(1), T(1)};
    return Solid::sample(p, one);
  }
}

// phi_u(S^-1 p) is not a distance: its slope is |S^-1 grad phi_u|, by which it is divided. The result is
// exact on the surface and correct to first order near it.
template <class T>
HD T printed_phi(PrimitiveKind kind, Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  return visit_solid(
      kind, [&](auto solid) __attribute__((always_inline)) {
        using Solid = decltype(solid);
        const Vec3<T> s = diagonal_of<Solid>(size);
        const sdf::SolidSample<T> u = unit_sample_of<Solid>(Vec3<T>{p.x / s.x, p.y / s.y, p.z / s.z});
        return u.phi_m / norm(Vec3<T>{u.grad.x / s.x, u.grad.y / s.y, u.grad.z / s.z});
      });
}

HD sdf::SolidSample<double> printed_sample(PrimitiveKind kind, Vec3d p,
                                           const double (&size)[sdf::kMaxSizes]) {
  using D = Dual<3 + sdf::kMaxSizes>;
  const Vec3<D> at{D::variable(p.x, 0), D::variable(p.y, 1), D::variable(p.z, 2)};
  const D lengths[sdf::kMaxSizes] = {D::variable(size[0], 3), D::variable(size[1], 4),
                                     D::variable(size[2], 5)};
  const D phi = printed_phi(kind, at, lengths);
  return {phi.value, {phi.d[0], phi.d[1], phi.d[2]}, {phi.d[3], phi.d[4], phi.d[5]}};
}

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
// The field of a solid of unknown size: phi and its derivatives by the point and by every unknown.
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>

#include "energies/field.h"
#include "optim/parameters.h"
#include "primitives/dual.h"
#include "primitives/solids.h"

namespace sdftrack::primitives {

// How the thesis gives a size (Eq. 3.27): S = diag(s): the unit solid has radii and edges of 1, so that s are
// the lengths; x and y of a round body share one length, and a patch has no third, which is not scaled.
template <class Solid, class T>
HD Vec3<T> diagonal_of(const T (&size)[sdf::kMaxSizes], T unit_m) {
  const auto along = [&](const SolidAxis& axis) { return axis.size < 0 ? unit_m : size[axis.size]; };
  return {along(Solid::kAxes[0]), along(Solid::kAxes[1]), along(Solid::kAxes[2])};
}

template <class Solid, class T>
HD auto unit_sample_of(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  if constexpr (requires { Solid::unit_sample(p, size); }) {
    return Solid::unit_sample(p, size);
  } else {
    const T one[sdf::kMaxSizes] = {T(1), T(1), T(1)};
    return Solid::sample(p, one);
  }
}

// unit_m phi_u(S^-1 p): the field of a solid whose lengths are all unit_m, at the scaled point. It is 0 on
// the surface and no distance elsewhere: its slope is unit_m |S^-1 grad phi_u|.
template <class Solid, class T>
HD T printed_phi(Vec3<T> p, const T (&size)[sdf::kMaxSizes], T unit_m) {
  const Vec3<T> s = diagonal_of<Solid>(size, unit_m);
  return unit_m * unit_sample_of<Solid>(Vec3<T>{p.x / s.x, p.y / s.y, p.z / s.z}, size).phi_m;
}

HD AnySample<double> printed_sample(PrimitiveKind kind, Vec3d p, const double (&size)[sdf::kMaxSizes],
                                    double unit_m) {
  return visit_solid(
      kind, [&](auto solid) __attribute__((always_inline)) {
        constexpr int kSizes = std::max(sdf::kMaxLengths, int(std::size(solid.kSizes)));
        using D = Dual<3 + kSizes>;
        const Vec3<D> at{D::variable(p.x, 0), D::variable(p.y, 1), D::variable(p.z, 2)};
        D sizes[sdf::kMaxSizes];
        for (int i = 0; i < kSizes; ++i) sizes[i] = D::variable(size[i], 3 + i);
        const D phi = printed_phi<decltype(solid)>(at, sizes, D(unit_m));
        AnySample<double> out{phi.value, {phi.d[0], phi.d[1], phi.d[2]}, {}};
        for (int i = 0; i < kSizes; ++i) out.size[i] = phi.d[3 + i];
        return out;
      });
}

// Unknowns: T_obj_cam <- increment(v, w) T_obj_cam, then the logarithms of the sizes.
struct PrimitiveField {
  static constexpr int P = 6 + sdf::kMaxSizes;  // columns of unknowns that a kind lacks are 0
  using Row = energies::FieldRow<double, P>;

  PrimitiveKind kind;
  Scaling scaling;
  Rigidd T_obj_cam;
  double size_m[sdf::kMaxSizes];  // exponents: without unit
  double unit_m = 1;              // of the printed form

  static PrimitiveField of(PrimitiveKind kind, Scaling scaling, const optim::State& x, double unit_m = 1) {
    PrimitiveField field{kind, scaling, x.T_obj_cam[0], {1, 1, 1, 1, 1}, unit_m};
    for (std::size_t i = 0; i < x.log_size.size(); ++i) field.size_m[i] = std::exp(x.log_size[i]);
    return field;
  }

  AnySample<double> sample(Vec3d p_obj) const {
    if (scaling == Scaling::kPrinted) return printed_sample(kind, p_obj, size_m, unit_m);
    return exact_sample(kind, p_obj, size_m);
  }

  // phi and only its derivative with respect to the camera point.
  void value(Vec3d p_cam, double* phi_m, Vec3d* grad_cam) const {
    const AnySample<double> s = sample(T_obj_cam * p_cam);
    *phi_m = s.phi_m;
    *grad_cam = transpose_times(T_obj_cam.R, s.grad);
  }

  // d phi / d unknowns.
  template <int N>
  void derivative(Vec3d p_obj, const sdf::SolidSample<double, N>& s, double (&J)[P]) const {
    const Vec3d m = cross(p_obj, s.grad);
    const double pose[6] = {s.grad.x, s.grad.y, s.grad.z, m.x, m.y, m.z};
    for (int j = 0; j < 6; ++j) J[j] = pose[j];
    for (int i = 0; i < sdf::kMaxSizes; ++i)
      J[6 + i] =
          i < N && i < size_count(kind) ? size_m[i] * s.size[i] : 0.0;  // with respect to the logarithm
  }

  void row(Vec3d p_cam, Row* out) const {
    const Vec3d p_obj = T_obj_cam * p_cam;
    const AnySample<double> s = sample(p_obj);
    derivative(p_obj, s, out->J);
    out->phi_m = s.phi_m;
    out->grad_cam = transpose_times(T_obj_cam.R, s.grad);
  }
};

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
// The field of a solid of unknown size: phi at a camera point, its derivatives with respect to the point and
// to every unknown.
#pragma once

#include <cmath>

#include "energies/field.h"
#include "optim/parameters.h"
#include "primitives/printed.h"

namespace sdftrack::primitives {

// Unknowns: T_obj_cam <- increment(v, w) T_obj_cam, then the logarithms of the lengths, so that none becomes
// negative.
struct PrimitiveField {
  static constexpr int P = 6 + sdf::kMaxSizes;  // columns of unknowns that a kind lacks are 0
  using Row = energies::FieldRow<double, P>;

  PrimitiveKind kind;
  Scaling scaling;
  Rigidd T_obj_cam;
  double size_m[sdf::kMaxSizes];

  static PrimitiveField of(PrimitiveKind kind, Scaling scaling, const optim::State& x) {
    PrimitiveField field{kind, scaling, x.T_obj_cam[0], {1, 1, 1}};
    for (std::size_t i = 0; i < x.log_size.size(); ++i) field.size_m[i] = std::exp(x.log_size[i]);
    return field;
  }

  sdf::SolidSample<double> sample(Vec3d p_obj) const {
    if (scaling == Scaling::kPrinted) return printed_sample(kind, p_obj, size_m);
    return exact_sample(kind, p_obj, size_m);
  }

  // phi and only its derivative with respect to the camera point.
  void value(Vec3d p_cam, double* phi_m, Vec3d* grad_cam) const {
    const sdf::SolidSample<double> s = sample(T_obj_cam * p_cam);
    *phi_m = s.phi_m;
    *grad_cam = transpose_times(T_obj_cam.R, s.grad);
  }

  // d phi / d unknowns.
  void derivative(Vec3d p_obj, const sdf::SolidSample<double>& s, double (&J)[P]) const {
    const Vec3d m = cross(p_obj, s.grad);
    const double pose[6] = {s.grad.x, s.grad.y, s.grad.z, m.x, m.y, m.z};
    for (int j = 0; j < 6; ++j) J[j] = pose[j];
    for (int i = 0; i < sdf::kMaxSizes; ++i)
      J[6 + i] = i < size_count(kind) ? size_m[i] * s.size[i] : 0.0;  // with respect to the logarithm
  }

  void row(Vec3d p_cam, Row* out) const {
    const Vec3d p_obj = T_obj_cam * p_cam;
    const sdf::SolidSample<double> s = sample(p_obj);
    derivative(p_obj, s, out->J);
    out->phi_m = s.phi_m;
    out->grad_cam = transpose_times(T_obj_cam.R, s.grad);
  }
};

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
// Fields: phi at a camera point, with its derivative by the point and by every unknown.
// Any field works with any residual and any penalty.
#pragma once

#include "base/camera.h"
#include "base/fast_math.h"
#include "base/rigid.h"
#include "base/views.h"

namespace sdftrack::energies {

template <class T, int P>
struct FieldRow {
  T phi_m;
  Vec3<T> grad_cam;  // d phi / d p_cam
  T J[P];            // d phi / d unknowns
};

// One object. Unknowns: T_obj_cam <- increment(v, w) T_obj_cam, v in metres, w in radians (MRP r = w / 4).
template <class T>
struct SingleObject {
  static constexpr int P = 6;
  using Scalar = T;
  SdfView sdf;
  Rigid<T> T_obj_cam;

  template <class U>
  HD SingleObject<U> cast() const {
    return {sdf, T_obj_cam.template cast<U>()};
  }

  // phi and its derivative by the camera point only: what a trial step needs.
  HD void value(Vec3<T> p_cam, T* phi_m, Vec3<T>* grad_cam) const {
    Vec3<T> g;
    sample(sdf, T_obj_cam * p_cam, phi_m, &g);
    *grad_cam = transpose_times(T_obj_cam.R, g);
  }

  HD void row(Vec3<T> p_cam, FieldRow<T, P>* out) const {
    const Vec3<T> p_obj = T_obj_cam * p_cam;
    Vec3<T> g;
    sample(sdf, p_obj, &out->phi_m, &g);
    const Vec3<T> m = cross(p_obj, g);  // d phi / d w, because d p / d w = -[p]x (thesis Eq. 3.17)
    const T J[P] = {g.x, g.y, g.z, m.x, m.y, m.z};
    for (int j = 0; j < P; ++j) out->J[j] = J[j];
    out->grad_cam = transpose_times(T_obj_cam.R, g);
  }
};

// One object of unknown size: phi(p) = s phi_unit(p / s), s = exp(log_scale), a distance field again.
template <class T>
struct ScaledObject {
  static constexpr int P = 7;
  using Scalar = T;
  SdfView sdf;
  Rigid<T> T_obj_cam;
  T scale;

  template <class U>
  HD ScaledObject<U> cast() const {
    return {sdf, T_obj_cam.template cast<U>(), U(scale)};
  }

  HD void value(Vec3<T> p_cam, T* phi_m, Vec3<T>* grad_cam) const {
    Vec3<T> g;
    sample(sdf, (T(1) / scale) * (T_obj_cam * p_cam), phi_m, &g);
    *phi_m *= scale;
    *grad_cam = transpose_times(T_obj_cam.R, g);
  }

  HD void row(Vec3<T> p_cam, FieldRow<T, P>* out) const {
    const Vec3<T> p_obj = T_obj_cam * p_cam;
    Vec3<T> g;
    sample(sdf, (T(1) / scale) * p_obj, &out->phi_m, &g);
    out->phi_m *= scale;
    const Vec3<T> m = cross(p_obj, g);
    const T J[P] = {g.x, g.y, g.z, m.x, m.y, m.z, out->phi_m - dot(p_obj, g)};
    for (int j = 0; j < P; ++j) out->J[j] = J[j];
    out->grad_cam = transpose_times(T_obj_cam.R, g);
  }
};

// The union of K objects, each with its own shape and unknowns: a soft minimum of their fields,
//   phi = -log(sum exp(-a phi_k)) / a = phi_min - log(sum exp(-a (phi_k - phi_min))) / a,
// The derivative is the sum of the objects' derivatives weighted by their memberships exp(-a phi_k) / sum
// (thesis Eqs. 5.14 to 5.20, where a factor -1 / a is an error). The union lies up to log(K) / a below the
// smallest phi_k where the surfaces meet.
template <int K, class T>
struct SoftMin {
  static constexpr int P = 6 * K;
  using Scalar = T;
  SingleObject<T> object[K];
  T sharpness_per_m;  // a

  template <class U>
  HD SoftMin<K, U> cast() const {
    SoftMin<K, U> out;
    for (int k = 0; k < K; ++k) out.object[k] = object[k].template cast<U>();
    out.sharpness_per_m = U(sharpness_per_m);
    return out;
  }

  // Computes every object's membership from its phi; returns phi of the union.
  HD T join(const T (&phi_m)[K], T (&membership)[K]) const {
    T least = phi_m[0], sum = T(0);
    for (int k = 1; k < K; ++k) least = select(phi_m[k] < least, phi_m[k], least);
    for (int k = 0; k < K; ++k) {
      membership[k] = exp_negative(sharpness_per_m * (least - phi_m[k]));
      sum += membership[k];
    }
    const T share = T(1) / sum;
    for (int k = 0; k < K; ++k) membership[k] *= share;
    return least - log_positive(sum) / sharpness_per_m;
  }

  HD void value(Vec3<T> p_cam, T* phi_m, Vec3<T>* grad_cam) const {
    T phi[K], membership[K];
    Vec3<T> grad[K];
    for (int k = 0; k < K; ++k) object[k].value(p_cam, &phi[k], &grad[k]);
    *phi_m = join(phi, membership);
    *grad_cam = {T(0), T(0), T(0)};
    for (int k = 0; k < K; ++k) *grad_cam = *grad_cam + membership[k] * grad[k];
  }

  HD void row(Vec3<T> p_cam, FieldRow<T, P>* out) const {
    T phi[K], membership[K];
    FieldRow<T, 6> own[K];
    for (int k = 0; k < K; ++k) object[k].row(p_cam, &own[k]), phi[k] = own[k].phi_m;
    out->phi_m = join(phi, membership);
    out->grad_cam = {T(0), T(0), T(0)};
    for (int k = 0; k < K; ++k) {
      out->grad_cam = out->grad_cam + membership[k] * own[k].grad_cam;
      for (int j = 0; j < 6; ++j) out->J[6 * k + j] = membership[k] * own[k].J[j];
    }
  }
};

using Two = SoftMin<2, float>;
using Three = SoftMin<3, float>;
using Four = SoftMin<4, float>;

// Any field, plus columns for fx, fy, cx, cy: the point p_cam = depth * ray(K) moves with them.
template <class Field>
struct WithIntrinsics {
  static constexpr int P = Field::P + 4;
  using Scalar = typename Field::Scalar;
  Field field;
  Intrinsics<Scalar> K;

  template <class U>
  HD auto cast() const {
    return WithIntrinsics<decltype(field.template cast<U>())>{field.template cast<U>(), K.template cast<U>()};
  }

  HD void value(Vec3<Scalar> p_cam, Scalar* phi_m, Vec3<Scalar>* grad_cam) const {
    field.value(p_cam, phi_m, grad_cam);
  }

  HD void row(Vec3<Scalar> p_cam, FieldRow<Scalar, P>* out) const {
    FieldRow<Scalar, Field::P> in;
    field.row(p_cam, &in);
    out->phi_m = in.phi_m;
    out->grad_cam = in.grad_cam;
    for (int j = 0; j < Field::P; ++j) out->J[j] = in.J[j];
    out->J[Field::P + 0] = -in.grad_cam.x * p_cam.x / K.fx;
    out->J[Field::P + 1] = -in.grad_cam.y * p_cam.y / K.fy;
    out->J[Field::P + 2] = -in.grad_cam.x * p_cam.z / K.fx;
    out->J[Field::P + 3] = -in.grad_cam.y * p_cam.z / K.fy;
  }
};

}  // namespace sdftrack::energies

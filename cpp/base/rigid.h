// SPDX-License-Identifier: MIT
// Rigid transforms. T_a_b maps a point in frame b to frame a: p_a = T_a_b * p_b.
#pragma once

#include "base/vec.h"

namespace sdftrack {

template <class T>
struct Rigid {
  Mat3<T> R = Mat3<T>::identity();
  Vec3<T> t{T(0), T(0), T(0)};

  template <class U>
  HD Rigid<U> cast() const {
    return {R.template cast<U>(), t.template cast<U>()};
  }
};

using Rigidd = Rigid<double>;
using Rigidf = Rigid<float>;

template <class T>
HD Vec3<T> operator*(const Rigid<T>& A, Vec3<T> p) {
  return A.R * p + A.t;
}
template <class T>
HD Rigid<T> operator*(const Rigid<T>& A, const Rigid<T>& B) {
  return {A.R * B.R, A.R * B.t + A.t};
}
template <class T>
HD Rigid<T> inverse(const Rigid<T>& A) {
  return {transpose(A.R), -transpose_times(A.R, A.t)};
}

// Modified Rodrigues Parameters r = tan(angle / 4) axis (thesis Eq. 3.5, corrected: docs/math/mrp.md).
template <class T>
HD Mat3<T> rotation_from_mrp(Vec3<T> r) {
  const T s = dot(r, r);
  const T d = T(1) / ((T(1) + s) * (T(1) + s));
  const Mat3<T> K = hat(r);
  return Mat3<T>::identity() + d * (T(8) * (K * K) + (T(4) * (T(1) - s)) * K);
}

// The increment of the optimiser, T_obj_cam <- increment(v, w) T_obj_cam: v in metres; w = 4 r in radians,
// so that rotations and translations are damped in their own units.
template <class T>
HD Rigid<T> increment(Vec3<T> v_m, Vec3<T> w_rad) {
  return {rotation_from_mrp(T(0.25) * w_rad), v_m};
}

// Rotation vector (axis times angle) to matrix: Rodrigues' formula.
template <class T>
HD Mat3<T> rotation_exp(Vec3<T> w_rad) {
  const T a2 = dot(w_rad, w_rad), a = std::sqrt(a2);
  const T s = a > T(1e-4) ? std::sin(a) / a : T(1) - a2 / T(6);
  const T c = a > T(1e-4) ? (T(1) - std::cos(a)) / a2 : T(0.5) - a2 / T(24);
  const Mat3<T> K = hat(w_rad);
  return Mat3<T>::identity() + s * K + c * (K * K);
}

struct Quaternion {
  double w, x, y, z;  // w >= 0, unit length
};
// Shepperd's method: divide by the largest of the four components.
HD Quaternion quaternion_from_rotation(const Mat3d& R) {
  const double m00 = R.r0.x, m11 = R.r1.y, m22 = R.r2.z, trace = m00 + m11 + m22;
  const double of_last = m11 < m22 ? m22 : m11, of_all = m00 < of_last ? of_last : m00;
  Quaternion q;
  if (trace >= of_all) {
    q = {1 + trace, R.r2.y - R.r1.z, R.r0.z - R.r2.x, R.r1.x - R.r0.y};
  } else if (m00 >= of_last) {
    q = {R.r2.y - R.r1.z, 1 + m00 - m11 - m22, R.r0.y + R.r1.x, R.r0.z + R.r2.x};
  } else if (m11 >= m22) {
    q = {R.r0.z - R.r2.x, R.r0.y + R.r1.x, 1 - m00 + m11 - m22, R.r1.z + R.r2.y};
  } else {
    q = {R.r1.x - R.r0.y, R.r0.z + R.r2.x, R.r1.z + R.r2.y, 1 - m00 - m11 + m22};
  }
  const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z) * (q.w < 0 ? -1.0 : 1.0);
  return {q.w / n, q.x / n, q.y / n, q.z / n};
}
Mat3d rotation_from_quaternion(Quaternion q);

// Matrix to rotation vector, |w| <= pi; exact near 0 and near pi (through the quaternion).
Vec3d rotation_log(const Mat3d& R);
// Matrix to MRP, |r| <= 1.
HD Vec3d mrp_from_rotation(const Mat3d& R) {
  const Quaternion q = quaternion_from_rotation(R);
  return (1 / (1 + q.w)) * Vec3d{q.x, q.y, q.z};
}
// Angle of the rotation, radians, in [0, pi]; exact for small angles too.
double rotation_angle(const Mat3d& R);
// The rotation nearest to A (polar decomposition); A must have a positive determinant.
Mat3d nearest_rotation(const Mat3d& A);
// Largest entry of |A^T A - I|: how far A is from a rotation.
double orthogonality_error(const Mat3d& A);

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Small vectors and 3x3 matrices. No Eigen here: kernels include this file.
// T is a lane type (base/lane.h).
#pragma once

#include "base/lane.h"

namespace sdftrack {

template <class T>
struct Vec2 {
  T x, y;
};

template <class T>
struct Vec3 {
  T x, y, z;

  template <class U>
  HD Vec3<U> cast() const {
    return {static_cast<U>(x), static_cast<U>(y), static_cast<U>(z)};
  }
};

// Points of a list, by index.
template <class T>
HD Vec3<T> gather(const Vec3<float>* points, IntOf<T> i) {
  const float* p = &points->x;
  return {gather<T>(p, i * 3), gather<T>(p + 1, i * 3), gather<T>(p + 2, i * 3)};
}

using Vec2f = Vec2<float>;
using Vec2d = Vec2<double>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <class T>
HD Vec3<T> operator+(Vec3<T> a, Vec3<T> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
HD Vec3<T> operator-(Vec3<T> a, Vec3<T> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
HD Vec3<T> operator-(Vec3<T> a) {
  return {-a.x, -a.y, -a.z};
}
template <class T>
HD Vec3<T> operator*(T s, Vec3<T> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class T>
HD T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
HD Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
HD T norm(Vec3<T> a) {
  return sqrt(dot(a, a));
}

// Rows r0, r1, r2.
template <class T>
struct Mat3 {
  Vec3<T> r0, r1, r2;

  static HD Mat3 identity() { return {{T(1), T(0), T(0)}, {T(0), T(1), T(0)}, {T(0), T(0), T(1)}}; }

  template <class U>
  HD Mat3<U> cast() const {
    return {r0.template cast<U>(), r1.template cast<U>(), r2.template cast<U>()};
  }
};

using Mat3d = Mat3<double>;

template <class T>
HD Vec3<T> operator*(const Mat3<T>& A, Vec3<T> v) {
  return {dot(A.r0, v), dot(A.r1, v), dot(A.r2, v)};
}
// A^T v, without forming the transpose.
template <class T>
HD Vec3<T> transpose_times(const Mat3<T>& A, Vec3<T> v) {
  return v.x * A.r0 + v.y * A.r1 + v.z * A.r2;
}
template <class T>
HD Mat3<T> transpose(const Mat3<T>& A) {
  return {{A.r0.x, A.r1.x, A.r2.x}, {A.r0.y, A.r1.y, A.r2.y}, {A.r0.z, A.r1.z, A.r2.z}};
}
template <class T>
HD Mat3<T> operator*(const Mat3<T>& A, const Mat3<T>& B) {
  return {transpose_times(B, A.r0), transpose_times(B, A.r1), transpose_times(B, A.r2)};
}
template <class T>
HD Mat3<T> operator+(const Mat3<T>& A, const Mat3<T>& B) {
  return {A.r0 + B.r0, A.r1 + B.r1, A.r2 + B.r2};
}
template <class T>
HD Mat3<T> operator*(T s, const Mat3<T>& A) {
  return {s * A.r0, s * A.r1, s * A.r2};
}
template <class T>
HD T determinant(const Mat3<T>& A) {
  return dot(A.r0, cross(A.r1, A.r2));
}
// [v]x, so that hat(v) u = v x u.
template <class T>
HD Mat3<T> hat(Vec3<T> v) {
  return {{T(0), -v.z, v.y}, {v.z, T(0), -v.x}, {-v.y, v.x, T(0)}};
}

}  // namespace sdftrack

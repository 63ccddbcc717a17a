// SPDX-License-Identifier: MIT
#include "base/rigid.h"

#include <algorithm>

namespace sdftrack {

Quaternion quaternion_from_rotation(const Mat3d& R) {
  // Shepperd's method: divide by the largest of the four components.
  const double m00 = R.r0.x, m11 = R.r1.y, m22 = R.r2.z, trace = m00 + m11 + m22;
  Quaternion q;
  if (trace >= std::max({m00, m11, m22})) {
    q = {1 + trace, R.r2.y - R.r1.z, R.r0.z - R.r2.x, R.r1.x - R.r0.y};
  } else if (m00 >= std::max(m11, m22)) {
    q = {R.r2.y - R.r1.z, 1 + m00 - m11 - m22, R.r0.y + R.r1.x, R.r0.z + R.r2.x};
  } else if (m11 >= m22) {
    q = {R.r0.z - R.r2.x, R.r0.y + R.r1.x, 1 - m00 + m11 - m22, R.r1.z + R.r2.y};
  } else {
    q = {R.r1.x - R.r0.y, R.r0.z + R.r2.x, R.r1.z + R.r2.y, 1 - m00 - m11 + m22};
  }
  const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z) * (q.w < 0 ? -1.0 : 1.0);
  return {q.w / n, q.x / n, q.y / n, q.z / n};
}

Mat3d rotation_from_quaternion(Quaternion q) {
  const double w = q.w, x = q.x, y = q.y, z = q.z;
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
}

Vec3d rotation_log(const Mat3d& R) {
  const Quaternion q = quaternion_from_rotation(R);
  const Vec3d v{q.x, q.y, q.z};
  const double n = norm(v);
  const double scale = n > 1e-12 ? 2 * std::atan2(n, q.w) / n : 2.0;
  return scale * v;
}

Vec3d mrp_from_rotation(const Mat3d& R) {
  const Quaternion q = quaternion_from_rotation(R);
  return (1 / (1 + q.w)) * Vec3d{q.x, q.y, q.z};
}

double rotation_angle(const Mat3d& R) { return norm(rotation_log(R)); }

namespace {

Mat3d inverse_transpose(const Mat3d& A) {
  const double d = 1 / determinant(A);
  return {d * cross(A.r1, A.r2), d * cross(A.r2, A.r0), d * cross(A.r0, A.r1)};
}

}  // namespace

Mat3d nearest_rotation(const Mat3d& A) {
  Mat3d R = A;
  // Higham's Newton iteration for the polar factor: quadratic, few steps for a matrix near a rotation.
  for (int i = 0; i < 50 && orthogonality_error(R) > 1e-15; ++i) R = 0.5 * (R + inverse_transpose(R));
  return R;
}

double orthogonality_error(const Mat3d& A) {
  const Mat3d E = transpose(A) * A + -1.0 * Mat3d::identity();
  double worst = 0;
  for (const Vec3d& r : {E.r0, E.r1, E.r2})
    worst = std::max({worst, std::abs(r.x), std::abs(r.y), std::abs(r.z)});
  return worst;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "base/rigid.h"

#include <algorithm>

namespace sdftrack {

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

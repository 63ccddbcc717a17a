// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>

#include "base/rigid.h"

namespace sdftrack {
namespace {

void expect_near(const Mat3d& A, const Mat3d& B, double tolerance) {
  const Mat3d D = A + -1.0 * B;
  for (const Vec3d& r : {D.r0, D.r1, D.r2}) EXPECT_LT(norm(r), tolerance);
}

const Vec3d kRotations[] = {{0, 0, 0},   {1e-9, 0, 0}, {0.3, -0.7, 1.1},
                            {0, 3.1, 0}, {0, 0, M_PI}, {-1.9, 1.2, 2.0}};

TEST(Rigid, an_mrp_is_the_tangent_of_a_quarter_of_the_angle) {
  for (const Vec3d& w : kRotations) {
    const double angle = norm(w);
    if (angle == 0) continue;
    const Vec3d r = (std::tan(angle / 4) / angle) * w;
    expect_near(rotation_from_mrp(r), rotation_exp(w), 1e-12);
  }
}

TEST(Rigid, mrp_of_a_rotation_gives_the_rotation_back) {
  for (const Vec3d& w : kRotations)
    expect_near(rotation_from_mrp(mrp_from_rotation(rotation_exp(w))), rotation_exp(w), 1e-12);
}

TEST(Rigid, an_increment_moves_a_point_by_v_plus_w_cross_p) {
  const Vec3d p{0.2, -0.1, 0.4}, v{1e-6, 2e-6, -1e-6}, w{3e-6, -1e-6, 2e-6};
  EXPECT_LT(norm(increment(v, w) * p - (p + v + cross(w, p))), 1e-11);
}

TEST(Rigid, the_nearest_rotation_of_a_rounded_one_is_a_rotation) {
  Mat3d A = rotation_exp(Vec3d{0.4, 0.5, -0.2});
  A.r0.x += 3e-4;
  const Mat3d R = nearest_rotation(A);
  EXPECT_LT(orthogonality_error(R), 1e-14);
  expect_near(R, A, 1e-3);
}

}  // namespace
}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>

#include "base/views.h"
#include "volume_fixture.h"

namespace sdftrack {
namespace {

const Volume kBall = make_volume(24, 0.1, [](Vec3d p) { return norm(p) - 0.06; });

TEST(SampleSdf, a_point_that_is_not_finite_reads_nothing_outside_the_volume) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const Vec3f& p : {Vec3f{nan, 0, 0}, Vec3f{0, nan, nan}, Vec3f{inf, -inf, 0}}) {
    float phi;
    Vec3f g;
    sample(kBall.view(), p, &phi, &g);  // the sanitizer or the loader would tell
  }
  EXPECT_EQ(locate(nan, 24).cell, 0);
  EXPECT_EQ(locate(inf, 24).cell, 22);
  EXPECT_EQ(locate(-inf, 24).cell, 0);
}

}  // namespace
}  // namespace sdftrack

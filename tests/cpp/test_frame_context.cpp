// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <numeric>

#include "box_scene.h"

namespace sdftrack {
namespace {

const Rigidd kLeft = pose_at({-0.12, 0, 0.6}), kRight = pose_at({0.12, 0, 0.6});

TEST(FrameContext, others_claim_the_readings_on_their_surface_and_no_more) {
  PartsFixture parts;
  parts.add(kLeft), parts.add(kRight);
  parts.open({kLeft, kRight}, 0);  // the mask is of the right one
  const unsigned char* claimed = parts.context.claimed_by_others(parts.objects[0]);
  ASSERT_TRUE(claimed);
  int of_right = 0, elsewhere = 0;
  for (std::size_t i = 0; i < parts.context.pixels(); ++i)
    (parts.image.mask[i] ? of_right : elsewhere) += claimed[i];
  const int all = std::accumulate(parts.image.mask.begin(), parts.image.mask.end(), 0);
  EXPECT_GT(of_right, 0.99 * all);
  EXPECT_EQ(elsewhere, 0);
  const frame::DepthFrame left = parts.context.unclaimed(parts.context.frame(), claimed);
  for (std::size_t i = 0; i < parts.context.pixels(); ++i) ASSERT_EQ(left.mask[i] == 0, claimed[i] != 0);
  parts.objects[1].lost_frames = 1;  // whoever is lost claims nothing
  EXPECT_EQ(parts.context.claimed_by_others(parts.objects[0]), nullptr);
}

TEST(FrameContext, neighbors_are_the_others_that_are_followed_where_this_frame_has_shown_them) {
  PartsFixture parts;
  parts.add(kLeft), parts.add(kRight), parts.add(kRight);
  parts.objects[2].weak = true;
  parts.open({kLeft, kRight}, 0);
  ASSERT_EQ(parts.context.neighbors_of(parts.objects[0]).size(), 1u);
  EXPECT_EQ(parts.context.neighbors_of(parts.objects[1]).size(), 1u);
  EXPECT_EQ(parts.context.neighbors_of(parts.objects[2]).size(), 2u);
  tracking::JointFitted& joint = parts.context.together(1).emplace();
  joint.fitted.T_cam_obj = kLeft;
  joint.fitted.seen = {100, 100, 0, 0, 0};
  const Rigidd T_obj_cam = inverse(kLeft);
  EXPECT_FLOAT_EQ(parts.context.neighbors_of(parts.objects[0])[0].T_obj_cam.t.x,
                  static_cast<float>(T_obj_cam.t.x));
  joint.hidden = true;
  EXPECT_TRUE(parts.context.neighbors_of(parts.objects[0]).empty());
}

}  // namespace
}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "box_scene.h"

namespace sdftrack {
namespace {

const Rigidd kFirst = pose_at({-0.02, 0.01, 0.55}), kSecond = beside(kFirst, 0.003);

struct Groups : PartsFixture {
  tracking::GroupFitter groups{options, settings, &follower};

  void fit(const std::vector<Rigidd>& boxes, int frame, bool covered = false) {
    open(boxes, frame, tracking::kUnknown, covered);
    groups.fit(&context, objects);
  }
  tracking::ObjectResult accept(std::size_t k) {
    return groups.accept(&*context.together(k), context, &objects[k]);
  }
};

TEST(GroupFitter, of_two_that_start_in_one_place_the_second_is_refused) {
  Groups parts;
  for (int k = 0; k < 2; ++k) {
    parts.add(kFirst);
    parts.objects.back().requested = at_pose(kFirst);
  }
  parts.fit({kFirst}, 0);
  EXPECT_EQ(parts.accept(0).trust.status, tracking::Status::kOk);
  const tracking::ObjectResult refused = parts.accept(1);
  EXPECT_EQ(refused.trust.status, tracking::Status::kLost);
  EXPECT_EQ(refused.trust.reason.code, tracking::ReasonCode::kSamePlace);
  EXPECT_EQ(refused.trust.reason.object, 0);
}

TEST(GroupFitter, a_hidden_one_is_carried_for_some_frames_and_then_lost) {
  Groups parts;
  parts.add(kFirst), parts.add(kSecond);
  std::vector<tracking::Status> said;
  for (int i = 0; i < 7; ++i) {
    parts.fit({kFirst, kSecond}, i, true);
    EXPECT_EQ(parts.accept(0).trust.status, tracking::Status::kOk);
    const tracking::ObjectResult hidden = parts.accept(1);
    said.push_back(hidden.trust.status);
    EXPECT_EQ(hidden.trust.reason.code,
              i < 5 ? tracking::ReasonCode::kPlacedByNeighbors : tracking::ReasonCode::kFewReadings);
    EXPECT_LT(norm(parts.pose_of(1).t - kSecond.t), 0.01);
  }
  EXPECT_EQ(said.front(), tracking::Status::kWeak);
  EXPECT_EQ(said.back(), tracking::Status::kLost);
}

}  // namespace
}  // namespace sdftrack

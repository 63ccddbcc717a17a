// SPDX-License-Identifier: MIT
// A whole tracker, on the sequence that tests/python/test_core_tracker.py gives to the Python Tracker: both
// are compared with the same file.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "box_scene.h"

namespace sdftrack {
namespace {

constexpr double kSame = 1e-9;  // the C library's functions may differ in their last digit
constexpr const char* kStatus[] = {"ok", "weak", "lost", "bad_frame"};

const Rigidd kLeft = pose_at({-0.02, 0.01, 0.55}), kRight = beside(kLeft, 0.004);

struct Scene {
  Camera camera = small_camera();
  tracking::Tracker tracker;
  BoxImage image;

  explicit Scene(tracking::TrackerSettings settings = {})
      : tracker({box_volume().view(), box_volume().view()}, camera, {}, settings) {}

  frame::DepthFrame frame(int i, const std::vector<Rigidd>& boxes, bool covered = false) {
    image = image_of(camera, boxes, i, covered);
    return tracker.make_frame({image.depth_m.data(), camera.width, camera.height}, nullptr, i / 30.0,
                              nullptr);
  }
};

// The lines of the file, one for each object and call.
class Expected {
 public:
  Expected() : file_(SDFTRACK_TEST_DATA "/tracked_boxes.txt") {}

  void compare(const tracking::FrameResult& result) {
    for (std::size_t k = 0; k < result.objects.size(); ++k) compare(result, k);
    ++call_;
  }
  bool at_end() {
    std::string more;
    return !std::getline(file_, more);
  }

 private:
  void compare(const tracking::FrameResult& result, std::size_t k) {
    std::string line, status, reason;
    ASSERT_TRUE(std::getline(file_, line));
    std::istringstream in(line);
    int call, index;
    std::size_t object;
    in >> call >> index >> object >> status;
    const tracking::ObjectResult& r = result.objects[k];
    SCOPED_TRACE("call " + std::to_string(call_) + ", object " + std::to_string(k));
    EXPECT_EQ(call, call_);
    EXPECT_EQ(index, result.index);
    EXPECT_EQ(object, k);
    EXPECT_EQ(status, kStatus[static_cast<int>(r.trust.status)]);
    const Rigidd& T = r.T_cam_obj;
    std::vector<double> numbers{T.R.r0.x, T.R.r0.y, T.R.r0.z, T.t.x,    T.R.r1.x, T.R.r1.y,
                                T.R.r1.z, T.t.y,    T.R.r2.x, T.R.r2.y, T.R.r2.z, T.t.z};
    numbers.insert(numbers.end(), r.twist.begin(), r.twist.end());
    numbers.insert(numbers.end(), {r.trust.confidence, r.trust.inliers});
    for (const double number : numbers) {
      std::string text;
      in >> text;
      if (text == "nan")
        EXPECT_TRUE(std::isnan(number));
      else
        EXPECT_NEAR(number, std::stod(text), kSame);
    }
    in >> std::ws;
    std::getline(in, reason);
    EXPECT_EQ(reason, tracking::sentence(r.trust.reason, {"left", "right"}));
  }

  std::ifstream file_;
  int call_ = 0;
};

TEST(Tracker, it_answers_a_sequence_as_the_python_tracker_does) {
  Scene scene;
  tracking::Tracker& tracker = scene.tracker;
  Expected expected;
  std::vector<Rigidd> both{kLeft, kRight};
  expected.compare(tracker.start(scene.frame(0, both), {at_pose(kLeft), at_pose(kRight)}));
  for (const int i : {1, 2}) {
    const Rigidd left = pose_at({-0.02 + 0.003 * i, 0.01, 0.55});
    both = {left, beside(left, 0.004)};
    expected.compare(tracker.track(scene.frame(i, both)));
  }
  expected.compare(tracker.track(tracker.make_unreadable_frame("the file is torn", 3 / 30.0)));
  expected.compare(tracker.track(tracker.make_unreadable_frame("", 4 / 30.0)));
  const std::vector<float> zeros(160 * 120, 0.0f);
  expected.compare(tracker.track(tracker.make_frame({zeros.data(), 160, 120}, nullptr, 5 / 30.0, nullptr)));
  expected.compare(tracker.track(scene.frame(6, both)));
  for (const int i : {7, 8}) expected.compare(tracker.track(scene.frame(i, both, true)));
  for (const int i : {9, 10}) expected.compare(tracker.track(scene.frame(i, {})));
  const std::vector<Rigidd> away{pose_at({0.03, 0.0, 0.6}), pose_at({-0.16, 0.02, 0.65})};
  for (const int i : {11, 12, 13, 14}) expected.compare(tracker.track(scene.frame(i, away)));
  expected.compare(tracker.recover(scene.frame(14, away), {1}, {tracking::PoseHint{}}));
  tracker.set_pose(1, away[0], 1e-9 * tracking::Matrix6d::Identity());
  expected.compare(tracker.track(scene.frame(15, away)));
  expected.compare(tracker.recover(scene.frame(15, {}), {0}, {tracking::PoseHint{}}));
  EXPECT_TRUE(expected.at_end());
}

TEST(Tracker, some_objects_can_be_recovered_only_beside_a_result_about_the_others) {
  Scene scene;
  const frame::DepthFrame frame = scene.frame(0, {kLeft, kRight});
  EXPECT_THROW(scene.tracker.recover(frame, {0}, {tracking::PoseHint{}}), std::runtime_error);
  scene.tracker.start(frame, {at_pose(kLeft), at_pose(kRight)});
  EXPECT_EQ(scene.tracker.recover(frame, {0}, {at_pose(kLeft)}).objects.size(), 2u);
  scene.tracker.remove(1);
  scene.tracker.add(box_volume().view(), at_pose(kRight));
  EXPECT_THROW(scene.tracker.recover(frame, {0}, {tracking::PoseHint{}}), std::runtime_error);
}

TEST(Tracker, a_moved_object_frame_moves_the_poses_and_not_the_velocity) {
  const Rigidd motion = increment(Vec3d{0.02, -0.03, 0.02}, Vec3d{0.004, -0.005, 0.003});
  const auto left = [](int i) { return pose_at({-0.02 + 0.003 * i, 0.01, 0.55}); };
  Scene scene, as_before;
  for (Scene* s : {&scene, &as_before}) {
    s->tracker.start(s->frame(0, {left(0), kRight}), {at_pose(left(0)), at_pose(kRight)});
    for (const int i : {1, 2, 3}) s->tracker.track(s->frame(i, {left(i), kRight}));
  }
  const Rigidd before = scene.tracker.last_result().objects[0].T_cam_obj;
  scene.tracker.move_frame(0, motion);
  const Rigidd moved = *scene.tracker.last_good_poses()[0], expected = before * motion;
  EXPECT_LT(norm(moved.t - expected.t), 1e-12);
  EXPECT_LT(norm(moved.R.r0 - expected.R.r0), 1e-12);
  EXPECT_EQ(scene.tracker.last_result().index, 3);
  // Back again before the next frame: all that the frames after it depend on is as it was.
  scene.tracker.move_frame(0, inverse(motion));
  for (const int i : {4, 5}) {
    const auto& found = scene.tracker.track(scene.frame(i, {left(i), kRight})).objects[0];
    const auto& same = as_before.tracker.track(as_before.frame(i, {left(i), kRight})).objects[0];
    EXPECT_LT(norm(found.T_cam_obj.t - same.T_cam_obj.t), 1e-7);
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(found.twist[k], same.twist[k], 1e-5);
  }
}

TEST(Tracker, a_frame_outside_of_the_sequence_leaves_its_record) {
  Scene scene;
  scene.tracker.start(scene.frame(0, {kLeft, kRight}), {at_pose(kLeft), at_pose(kRight)});
  const Rigidd best = *scene.tracker.last_good_poses()[0];
  const Rigidd left = pose_at({-0.017, 0.01, 0.55});
  const auto& answers = scene.tracker.revisit(scene.frame(1, {left, kRight}));
  EXPECT_LT(norm(answers[0].T_cam_obj.t - left.t), 5e-4);
  EXPECT_EQ(scene.tracker.last_result().index, 0);
  EXPECT_EQ(norm(scene.tracker.last_good_poses()[0]->t - best.t), 0);
}

TEST(Tracker, a_frame_that_could_not_be_read_says_nothing_of_a_pose_and_gives_nobody_a_pixel) {
  Scene scene;
  tracking::Tracker& tracker = scene.tracker;
  tracker.start(scene.frame(0, {kLeft, kRight}), {{kLeft, {}, {}}, {kRight, {}, {}}});
  const frame::DepthFrame unreadable = tracker.make_unreadable_frame("torn", 1.0);
  EXPECT_FALSE(tracker.look(unreadable, 0, kLeft));
  const auto pixels = static_cast<std::size_t>(scene.camera.width) * scene.camera.height;
  std::vector<float> membership(2 * pixels, 1.0f), foreground(pixels, 1.0f);
  tracker.find_membership(unreadable, membership.data(), foreground.data());
  for (const float share : membership) ASSERT_EQ(share, 0.0f);
  for (const float chance : foreground) ASSERT_TRUE(std::isnan(chance));
  for (const tracking::ObjectResult& result : tracker.revisit(unreadable))
    EXPECT_EQ(result.trust.status, tracking::Status::kBadFrame);
}

TEST(Tracker, other_volumes_for_the_same_objects_go_on_from_the_poses_that_are_given) {
  const Volume finer = make_volume(80, 0.1, [](Vec3d p) { return box_distance(p, kHalfBox_m); });
  Scene scene;
  scene.tracker.start(scene.frame(0, {kLeft, kRight}), {at_pose(kLeft), at_pose(kRight)});
  scene.tracker.replace_shapes({finer.view(), box_volume().view()}, scene.tracker.last_good_poses());
  const tracking::FrameResult& result = scene.tracker.track(scene.frame(1, {kLeft, kRight}));
  EXPECT_EQ(result.index, 1);
  for (const tracking::ObjectResult& object : result.objects) {
    EXPECT_EQ(object.trust.status, tracking::Status::kOk) << tracking::sentence(object.trust.reason);
    EXPECT_FALSE(std::isnan(object.twist[0]));
  }
  EXPECT_THROW(scene.tracker.replace_shapes({finer.view()}, {std::nullopt}), std::invalid_argument);
}

}  // namespace
}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Predicts where an object is in the next frame.
#pragma once

#include <limits>

#include "base/rigid.h"

namespace sdftrack::tracking {

constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();

enum class MotionModel {
  kStatic,
  kConstantVelocity,
  kAdaptive,  // whichever of the two has predicted better lately
};

// How far surface points lay from their predicted positions, lately: m.
struct PredictionErrors {
  double still_m = 0, moving_m = 0;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [still, moving] = self;
    archive(still, moving);
  }
};

// Constant velocity of an object's centre and constant turn about it, in camera axes, from its last two
// reliable poses. Per second where all frames have times, else per frame.
class ConstantVelocity {
 public:
  void reset() { *this = {}; }
  // A reliable pose, of the centred frame.
  void observe(const Rigidd& T_cam_obj, double time_s);
  // Replaces the last observed pose by this one, for a shape that has been enlarged.
  void rebase(const Rigidd& T_cam_obj) {
    if (seen_) last_ = T_cam_obj;
  }
  // The object frame has been moved: its poses are T_cam_obj * motion from now on.
  void move_frame(const Rigidd& motion) { last_ = last_ * motion; }
  // A frame without a reliable pose: the velocity is trusted less and less, because an object that is held or
  // hidden slows down as often as not.
  void pass();
  // Sets a velocity, of the centre and of the turn about it, that does not follow from the last two poses.
  void set_velocity(const Vec3d& v, const Vec3d& w) { v_ = v, w_ = w; }
  bool knows_velocity() const { return poses_ > 1; }
  // Whether velocities are known per second, and the velocities of the centre and of the turn about it.
  bool knows_time() const { return knows_velocity() && per_second_; }
  Vec3d velocity() const { return v_; }
  Vec3d turn_rate() const { return w_; }
  // The interval of one frame, in the unit of the velocities, for the next observation.
  double frame_interval(double time_s) const { return elapsed(time_s) / double(frames_); }
  // `last` moved on to the time of the next frame.
  Rigidd predict(const Rigidd& last, double time_s) const;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [seen, poses, last, time_s, frames, belief, per_second, v, w] = self;
    archive(seen, poses, last, time_s, frames, belief, per_second, v, w);
  }

 private:
  double elapsed(double time_s) const;

  bool seen_ = false;
  int poses_ = 0;
  Rigidd last_;
  double time_s_ = kNoTime;
  int frames_ = 1;  // since the last observation, the next frame included
  double belief_ = 1;
  bool per_second_ = false;
  Vec3d v_{0, 0, 0}, w_{0, 0, 0};
};

}  // namespace sdftrack::tracking

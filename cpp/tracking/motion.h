// SPDX-License-Identifier: MIT
// Where an object is expected in the next frame.
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

// How far surface points came to lie from where a prediction had them, lately: m.
struct PredictionErrors {
  double still_m = 0, moving_m = 0;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [still, moving] = self;
    archive(still, moving);
  }
};

// Constant velocity of an object's centre and constant turn about it, in camera axes, from its last two sure
// poses. Per second where all frames have times, else per frame.
class ConstantVelocity {
 public:
  void reset() { *this = {}; }
  // A pose that can be relied on, of the centred frame.
  void observe(const Rigidd& T_cam_obj, double time_s);
  // The last pose that was observed is now known as this one, of a shape that has been enlarged.
  void rebase(const Rigidd& T_cam_obj) {
    if (seen_) last_ = T_cam_obj;
  }
  // A frame without such a pose: the velocity is believed less and less, for an object that is held or hidden
  // slows down as often as not.
  void pass();
  // Another velocity than that of the last two poses: of the centre and of the turn about it.
  void set_velocity(const Vec3d& v, const Vec3d& w) { v_ = v, w_ = w; }
  bool knows_velocity() const { return poses_ > 1; }
  // Whether velocities are known per second, and these: of the centre and of the turn about it.
  bool knows_time() const { return knows_velocity() && per_second_; }
  Vec3d velocity() const { return v_; }
  Vec3d turn_rate() const { return w_; }
  // Of one frame, in the unit of the velocities, for the next observation.
  double frame_interval(double time_s) const { return elapsed(time_s) / static_cast<double>(frames_); }
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

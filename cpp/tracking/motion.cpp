// SPDX-License-Identifier: MIT
#include "tracking/motion.h"

namespace sdftrack::tracking {

namespace {

constexpr double kFade = 0.7;          // weight kept over a frame without a reliable pose
constexpr double kLongestGap_s = 0.5;  // a velocity older than this is not used

}  // namespace

// Seconds where both times are known and in order, else frames.
double ConstantVelocity::elapsed(double time_s) const {
  const double dt = time_s - time_s_;
  return dt > 0 ? dt : double(frames_);
}

void ConstantVelocity::observe(const Rigidd& T_cam_obj, double time_s) {
  if (seen_) {
    const double dt = elapsed(time_s);
    per_second_ = time_s - time_s_ > 0;
    v_ = (1 / dt) * (T_cam_obj.t - last_.t);
    w_ = (1 / dt) * rotation_log(T_cam_obj.R * transpose(last_.R));
    if (per_second_ && dt > kLongestGap_s) v_ = w_ = {0, 0, 0};
  }
  seen_ = true, last_ = T_cam_obj, time_s_ = time_s, frames_ = 1, belief_ = 1;
  ++poses_;
}

void ConstantVelocity::pass() {
  ++frames_;
  belief_ *= kFade;
}

Rigidd ConstantVelocity::predict(const Rigidd& last, double time_s) const {
  if (!seen_) return last;
  const double dt = elapsed(time_s);
  const bool same_unit = per_second_ == (time_s - time_s_ > 0);
  if (!same_unit || (per_second_ && dt > kLongestGap_s)) return last;
  // After frames without a reliable pose `last` has been predicted already: one frame's share is left.
  const double step = belief_ * dt / double(frames_);
  return {rotation_exp(step * w_) * last.R, last.t + step * v_};
}

}  // namespace sdftrack::tracking

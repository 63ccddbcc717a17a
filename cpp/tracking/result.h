// SPDX-License-Identifier: MIT
// A tracker's result for one frame.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "tracking/tracked_object.h"

namespace sdftrack::tracking {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// (v, w) about the object's origin, camera axes, m/s and rad/s.
using Twist = std::array<double, 6>;

struct ObjectResult {
  Rigidd T_cam_obj;     // of the caller's object frame; the last good one when lost, NaN before the first
  Matrix6d covariance;  // NaN when lost
  // The part of the covariance by unstated errors of the sensor: an error of distance, and a delay.
  Matrix6d unstated = Matrix6d::Zero();
  Trust trust;
  Twist twist{kUnknown, kUnknown, kUnknown, kUnknown, kUnknown, kUnknown};
  double cost = 0;          // mean per pixel of the last stage
  double systematic_m = 0;  // sd of the depth error that the measurements are assumed to share
  double runner_up = 0;     // after a search: score of the best other pose over this one's; NaN: no search
  std::vector<TrackStep> steps;
  bool color_used = false;
  double foreground = -1;  // mean posterior of the colours on the surface; -1: no colours

  // Ok except for directions that the frame does not determine: along these, any pose is as good.
  bool sure_where_determined() const {
    return trust.status == Status::kOk || is_weak_by(ReasonCode::kOpenDirections);
  }
  // Whether nothing is against the pose but turns that this frame alone cannot refute.
  bool sure_but_for_turns() const { return sure_where_determined() || is_weak_by(ReasonCode::kAmbiguous); }
  bool is_weak_by(ReasonCode code) const {
    return trust.status == Status::kWeak && trust.reason.code == code;
  }

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [T, sd, open, reliable, rates, value, shared, second, trials, colored, chance] = self;
    archive(T.R.r0, T.R.r1, T.R.r2, T.t, sd, open, reliable, rates, value, shared, second, trials, colored,
            chance);
  }
};

struct FrameResult {
  std::vector<ObjectResult> objects;
  int index = -1;            // of the frame since the start (0)
  double time_s = kUnknown;  // of the frame

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [results, number, time] = self;
    archive(results, number, time);
  }
};

inline bool is_followed(Status status) { return status == Status::kOk || status == Status::kWeak; }

bool is_finite(const ObjectResult& result);

// The result of an object whose pose this frame does not show.
ObjectResult result_without_pose(const TrackedObject& object, Reason reason, Status status);

}  // namespace sdftrack::tracking

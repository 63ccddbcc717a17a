// SPDX-License-Identifier: MIT
#include "tracking/tracked_object.h"

#include <algorithm>

namespace sdftrack::tracking {

namespace {

constexpr double kOfUsual = 0.85;    // an agreeing share below this times the usual one is not convincing,
constexpr double kOverUsual = 1.4;   // nor is a mean cost above this times the usual one,
constexpr double kLeastCost = 0.01;  // which is about 0.2 by noise alone, and 0 for renderings without noise

}  // namespace

void TrackedObject::observe_motion(double time_s) {
  motion.observe(T_cam_obj, time_s);
  if (!holds_open_directions()) return;
  Vec3d v = motion.velocity(), w = motion.turn_rate();
  open.remove_from(T_cam_obj, &v, &w);
  motion.set_velocity(v, w);
}

bool convincing(const Fitted& fitted, const TrackedObject& object, const TrackerOptions& options) {
  const Visibility& seen = fitted.seen;
  if (object.usual_share > 0)
    return agreeing_share(seen) >= kOfUsual * object.usual_share &&
           fitted.cost <= kOverUsual * std::max(kLeastCost, object.usual_cost);
  return seen.agree >= options.retry_inliers * (seen.agree + seen.farther) && seen.agree > 0;
}

}  // namespace sdftrack::tracking

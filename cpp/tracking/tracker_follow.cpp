// SPDX-License-Identifier: MIT
// One object from its last pose to the next: the fit, what is said of it, and what is kept of it.
#include <limits>
#include <utility>

#include "tracking/tracker.h"

namespace sdftrack {

namespace {

constexpr double kProof = 0.9;  // evidence by which what a search has found proves to be the object
constexpr double kSlow = 0.02, kFast = 0.3;  // how fast the usual values follow

}  // namespace

Rigidd Tracker::expected_pose(const Object& object, double time_s) const {
  const bool moves = settings_.motion == MotionModel::kConstantVelocity || object.weak;
  return moves ? object.motion.predict(object.T_cam_obj, time_s) : object.T_cam_obj;
}

ObjectResult Tracker::follow(const DepthFrame& frame, Object* object) {
  const auto k = static_cast<std::size_t>(object - objects_.data());
  if (k < together_.size() && together_[k]) return followed_together(frame, &*together_[k], object);
  const bool crowd = object->lost_frames > 0 && objects_.size() > 1;
  const DepthFrame left = crowd ? not_taken(frame, taken_by_others(frame, *object)) : frame;
  if (crowd) beside_ = others_than(*object);
  std::optional<Fitted> best = best_fit(left, *object, expected_pose(*object, frame.time_s));
  if (best && crowd && stands_in(*beside_, *object->shape, best->T_cam_obj)) best.reset();
  beside_ = nullptr;
  object->prior.reset();
  if (!best) return without_pose(*object, "too few depth readings near the last pose", Status::kLost);
  const Trust trust = judge(*best, options_, object->prior_log_odds);
  return judged(std::move(*best), trust, frame.time_s, object);
}

ObjectResult Tracker::judged(Fitted fitted, const Trust& trust, double time_s, Object* object) const {
  ObjectResult result;
  if (trust.status == Status::kLost) {
    result = without_pose(*object, trust.reason, Status::kLost);
    result.trust.inliers = trust.inliers;
  } else {
    keep(fitted, trust, time_s, object);
    result.T_cam_obj = uncentred(fitted.T_cam_obj, *object->shape);
    result.covariance = fitted.covariance;
    result.trust = trust;
    result.runner_up = std::numeric_limits<double>::quiet_NaN();
  }
  result.cost = fitted.cost;
  result.foreground = fitted.foreground;
  result.steps = std::move(fitted.steps);
  return result;
}

void Tracker::keep(const Fitted& fitted, const Trust& trust, double time_s, Object* object) const {
  object->T_cam_obj = fitted.T_cam_obj;
  object->memory = fitted.memory;
  object->hidden_frames = 0;
  object->weak = trust.status != Status::kOk;
  if (!object->weak && trust.evidence >= kProof) object->prior_log_odds = 0;
  if (object->weak)
    object->motion.pass();
  else
    object->motion.observe(fitted.T_cam_obj, time_s);
  // What further attempts could not better is the state of things: an object that a hand covers is not
  // searched for in every frame.
  const double share = agreeing_share(fitted.seen);
  const bool first = !(object->usual_share > 0);
  const double rate = first ? 1 : convincing(fitted, *object, options_) ? kSlow : kFast;
  object->usual_share += rate * (share - object->usual_share);
  object->usual_cost += rate * (fitted.cost - object->usual_cost);
}

ObjectResult Tracker::without_pose(const Object& object, std::string reason, Status status) {
  ObjectResult result;
  result.T_cam_obj = uncentred(object.T_cam_obj, *object.shape);
  result.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  result.runner_up = std::numeric_limits<double>::quiet_NaN();
  result.trust = {status, std::move(reason), 0, 0};
  return result;
}

}  // namespace sdftrack

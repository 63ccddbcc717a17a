// SPDX-License-Identifier: MIT
// The attempts of one frame: a narrow fit, and wider ones while the object does not look as it used to.
#include <cmath>

#include "tracking/tracker.h"

namespace sdftrack {

namespace {

constexpr double kOfUsual = 0.85;       // an agreeing share this far below the usual one is not convincing,
constexpr double kOverUsual = 1.4;      // nor is a mean cost this far above the usual one
constexpr double kWideTurn = 0.2;       // rad, of the further starts of a wide attempt
constexpr double kClearlyBetter = 0.1;  // quality that a further attempt must gain
constexpr double kNextReach_m = 0.06;   // of a search for an object that moved too fast to be followed

// Of attempts on an object that may be held: what stands in front of the surface is no fault, what is seen
// through it is one.
double held_quality(const Fitted& fitted, const TrackerOptions& options) {
  const double past =
      fitted.seen.expected > 0 ? fitted.seen.farther / static_cast<double>(fitted.seen.expected) : 0;
  return fit_quality(fitted, options) - past;
}

}  // namespace

bool convincing(const Fitted& fitted, const TrackedObject& object, const TrackerOptions& options) {
  const Visibility& seen = fitted.seen;
  if (object.usual_share > 0)
    return agreeing_share(seen) >= kOfUsual * object.usual_share &&
           fitted.cost <= kOverUsual * object.usual_cost;
  return seen.agree >= options.retry_inliers * (seen.agree + seen.farther) && seen.agree > 0;
}

std::optional<Fitted> Tracker::best_fit(const DepthFrame& frame, const Object& object,
                                        const Rigidd& expected) {
  return further_fits(frame, object, expected, fit(frame, object, narrow_attempt(expected), expected));
}

std::optional<Fitted> Tracker::further_fits(const DepthFrame& frame, const Object& object,
                                            const Rigidd& expected, std::optional<Fitted> best) {
  const auto done = [&] { return best && convincing(*best, object, options_); };
  const auto better = [&](const Fitted& other) {
    if (beside_ && stands_in(*beside_, *object.shape, other.T_cam_obj)) return false;
    return !best || held_quality(other, options_) > held_quality(*best, options_) + kClearlyBetter;
  };
  if (done() || !(options_.retry_inliers > 0)) return best;
  // Readings of a hand around the object draw a coarse fit to it; without coarse stages they have no say.
  const Rigidd moved = object.motion.predict(object.T_cam_obj, frame.time_s);
  if (std::optional<Fitted> straight =
          fit(frame, object, {0, options_.padding_m, 0, {expected, moved}}, expected)) {
    if (best) prepend(best->steps, &straight->steps);
    const bool inside = beside_ && stands_in(*beside_, *object.shape, straight->T_cam_obj);
    if (!best || (!inside && held_quality(*straight, options_) > held_quality(*best, options_)))
      best = std::move(straight);
    else
      best->steps = straight->steps;
  }
  if (done()) return best;
  std::optional<Fitted> wide = fit(frame, object, wide_attempt(object, expected, frame.time_s), expected);
  if (wide && best) prepend(best->steps, &wide->steps), best->steps = wide->steps;
  if (wide && better(*wide)) best = polished(frame, object, *wide);

  // A given prior says where it is: nothing is searched for against it.
  if (done() || !settings_.recover || !(object.usual_share > 0) || object.prior) return best;
  SearchQuery query;
  query.plane = plane_.plane();
  query.taken = taken_by_others(frame, object);
  query.others = others_than(object);
  query.near = expected;
  query.reach_m = kNextReach_m;
  query.seeds = std::min(options_.recover_seeds, kSearchSeeds);
  std::optional<Found> found =
      finder_.find(not_taken(frame, query.taken), camera_, *object.shape, object.memory,
                   colors_of(frame, object), query, std::log(options_.search_odds), &fitter_);
  // A look-alike next to it may be seen better, but is not where it can have gone.
  const auto in_reach = [&] { return norm(found->fitted.T_cam_obj.t - expected.t) <= kNextReach_m; };
  if (found && found->trust.status == Status::kOk && in_reach() && better(found->fitted)) {
    if (best) prepend(best->steps, &found->fitted.steps);
    best = std::move(found->fitted);
  }
  return best;
}

std::optional<Fitted> Tracker::fit(const DepthFrame& frame, const Object& object, const Attempt& attempt,
                                   const Rigidd& expected) {
  return fitter_.fit(frame, camera_, target_of(frame, object, expected), attempt, plane_.plane());
}

FitTarget Tracker::target_of(const DepthFrame& frame, const Object& object, const Rigidd& expected) const {
  const Matrix6d weak = PosePrior::isotropic(options_.motion_sigma_m, options_.motion_sigma_rad);
  return {
      *object.shape, expected, object.prior ? *object.prior : weak, object.memory, colors_of(frame, object),
      beside_};
}

// A wide attempt may end far from where its pixels were chosen: once more from there, with the pixels of that
// place.
Fitted Tracker::polished(const DepthFrame& frame, const Object& object, const Fitted& wide) {
  std::optional<Fitted> again = fit(frame, object, narrow_attempt(wide.T_cam_obj), wide.T_cam_obj);
  if (!again || fit_quality(*again, options_) < fit_quality(wide, options_)) return wide;
  prepend(wide.steps, &again->steps);
  return *again;
}

Attempt Tracker::narrow_attempt(const Rigidd& T_cam_obj) const {
  return {options_.scale_start_m, options_.padding_m, options_.coarse_steps, {T_cam_obj}};
}

// From the last pose, from where the last motion would take it, and from small turns of it about each axis.
Attempt Tracker::wide_attempt(const Object& object, const Rigidd& expected, double time_s) const {
  const Rigidd& T = object.T_cam_obj;
  const Rigidd moved = object.motion.predict(T, time_s);
  Attempt attempt{options_.far_scale_m, options_.far_padding_m, 2 * options_.coarse_steps, {expected, moved}};
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    for (const double sign : {-1.0, 1.0})
      attempt.starts.add({rotation_exp(sign * kWideTurn * axis) * T.R, T.t});
  return attempt;
}

}  // namespace sdftrack

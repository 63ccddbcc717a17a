// SPDX-License-Identifier: MIT
// The attempts of one frame: a narrow fit, and wider ones while the object does not match its usual values.
#include <algorithm>
#include <cmath>

#include "tracking/fit/stages.h"
#include "tracking/object_follower.h"

namespace sdftrack::tracking {

namespace {

constexpr double kStepSd_m = 0.01, kStepWeight = 0.05;    // of the displacement from the expected pose
constexpr double kGivenSd_m = 0.025;                      // of a given pose
constexpr double kTrustWeight = 0.03, kMinChance = 1e-4;  // of the evidence, per log odds
constexpr double kScalePerStep = 0.5, kFinePadding_m = 0.01;
constexpr int kFirstFrames = 4;  // after a start, in which a coarse fit is tried too
constexpr int kSettlingRounds = 5;
constexpr double kClearlyLess = 0.5;  // log odds
constexpr double kRests_m = 0.001;
constexpr double kWideTurn = 0.2;       // rad, of the further starts of a wide attempt
constexpr double kClearlyBetter = 0.1;  // gain of score that a further attempt must reach
constexpr int kSearchPause = 10;        // frames, after a search that found nothing better
constexpr double kNextTurn = 1.0;       // rad: largest turn from one frame to the next
constexpr double kNextReach_m = 0.06;   // of a search for an object that moved too fast to be followed

double agree_unhidden(const Visibility& seen) {
  const int open = seen.agree + seen.farther + seen.missing;
  return open > 0 ? double(seen.agree) / open : 0;
}

double log_odds(const Fitted& fitted, const TrackerOptions& options) {
  const double evidence = evidence_share(evidence_of(fitted, options), 0);
  return std::log(std::max(kMinChance, evidence) / std::max(kMinChance, 1 - evidence));
}

// The score that compares the attempts of one frame. An occluder in front of the surface does not count
// against a pose; depth behind the surface does. The object is likely near its expected pose, as near as it
// has been lately. At a start it is unknown how much of the object is hidden, and a pose on the fingers that
// hold it, where nothing hides it, would score better.
double score(const Fitted& fitted, const TrackedObject& object, const Rigidd& expected, double step_m,
             const TrackerOptions& options) {
  const Visibility& seen = fitted.seen;
  const bool known = object.usual_share > 0;
  const double past = seen.expected > 0 ? seen.farther / double(seen.expected) : 0;
  const double hidden = known ? 0 : agree_unhidden(seen) - agreeing_share(seen);
  const double away = surface_step(fitted.T_cam_obj, expected, object.shape->diameter_m) /
                      (known ? kStepSd_m + step_m : kGivenSd_m);
  const double trust = known ? 0 : kTrustWeight * log_odds(fitted, options);
  // At a start each fit has measured the noise by its own residuals, so that a bad fit excuses itself. As
  // with two densities, the wider one pays by the logarithm of its width.
  const double worst = options.outlier_floor > 0 ? -std::log(options.outlier_floor) : 0;
  const double wide =
      known || worst == 0 ? 0 : agreeing_share(seen) * std::log(fitted.memory.noise_factor) / worst;
  return fit_quality(fitted, options) + hidden + trust - past - wide - kStepWeight * away * away;
}

}  // namespace

// From the expected pose: as fine as the motion allows, and if that is not convincing, coarse to fine.
// Touching objects attract a coarse fit; a fine fit does not see them.
std::optional<Fitted> ObjectFollower::fit_near(const FrameContext& context, const frame::DepthFrame& frame,
                                               const TrackedObject& object, const Rigidd& expected,
                                               const Neighbors* neighbors) {
  const FitTarget target = target_of(context, object, expected, neighbors);
  if (!options_.fine_first || !(options_.retry_inliers > 0))
    return fit(context, frame, target, narrow_attempt(expected));
  const Attempt coarse = narrow_attempt(expected);
  // At a start the error of the given pose is unknown: both are tried, and in the frames that follow.
  const bool known = object.usual_share > 0;
  std::optional<Fitted> first = known ? fit(context, frame, target, fine_attempt(object, expected))
                                      : settled(context, frame, object, expected, neighbors);
  if (object.sure_frames >= kFirstFrames && first && convincing(*first, object, options_)) return first;
  std::optional<Fitted> second = fit(context, frame, target, coarse);
  if (!first || !second) return first ? first : second;
  prepend(first->steps, &second->steps);
  if (score(*second, object, expected, step_m(object), options_) >
      score(*first, object, expected, step_m(object), options_))
    return second;
  first->steps = std::move(second->steps);
  return first;
}

std::optional<Fitted> ObjectFollower::fit_finely(const FrameContext& context, const TrackedObject& object,
                                                 const Rigidd& T_cam_obj) {
  const FitTarget target = target_of(context, object, T_cam_obj, nullptr);
  return fit(context, context.frame(), target, fine_attempt(object, T_cam_obj));
}

std::optional<Fitted> ObjectFollower::fit_further(FrameContext* context, const frame::DepthFrame& frame,
                                                  const TrackedObject& object, const Rigidd& expected,
                                                  const Neighbors* neighbors, std::optional<Fitted> best) {
  const auto done = [&] { return best && convincing(*best, object, options_); };
  const auto inside = [&](const Fitted& other) {
    return neighbors && stands_in(*neighbors, *object.shape, other.T_cam_obj);
  };
  const auto better = [&](const Fitted& other) {
    if (inside(other)) return false;
    return !best || score(other, object, expected, step_m(object), options_) >
                        score(*best, object, expected, step_m(object), options_) + kClearlyBetter;
  };
  if (done() || !(options_.retry_inliers > 0)) return best;
  const FitTarget target = target_of(*context, object, expected, neighbors);
  // Measurements of a hand around the object attract a coarse fit; without coarse stages they have no effect.
  const Rigidd moved = object.motion.predict(object.T_cam_obj, frame.time_s);
  if (std::optional<Fitted> straight =
          fit(*context, frame, target, {0, options_.padding_m, 0, {expected, moved}})) {
    if (best) prepend(best->steps, &straight->steps);
    if (!best || (!inside(*straight) && score(*straight, object, expected, step_m(object), options_) >
                                            score(*best, object, expected, step_m(object), options_)))
      best = std::move(straight);
    else
      best->steps = straight->steps;
  }
  if (done()) return best;
  std::optional<Fitted> wide = fit(*context, frame, target, wide_attempt(object, expected, frame.time_s));
  if (wide && best) prepend(best->steps, &wide->steps), best->steps = wide->steps;
  if (wide && better(*wide)) best = polished(*context, frame, object, neighbors, *wide);

  // A given prior states where the object is: no search contradicts it. Neither does a search, which uses
  // depth alone, contradict the outline where depth is known to misfit.
  if (done() || !settings_.recover || !(object.usual_share > 0) || object.prior || object.by_mask_alone)
    return best;
  if (best && object.memory.search_pause > 0) {
    best->memory.search_pause = object.memory.search_pause - 1;
    return best;
  }
  SearchQuery query;
  query.near = expected;
  query.reach_m = kNextReach_m;
  query.seeds = std::min(options_.recover_seeds, kSearchSeeds);
  std::optional<Found> found = search(context, frame, object, query, std::log(options_.search_odds));
  // A look-alike nearby may be seen better, but lies outside the object's reach.
  const auto in_reach = [&] {
    return norm(found->fitted.T_cam_obj.t - expected.t) <= kNextReach_m &&
           rotation_angle(found->fitted.T_cam_obj.R * transpose(expected.R)) <= kNextTurn;
  };
  if (found && found->trust.status == Status::kOk && in_reach() && better(found->fitted)) {
    if (best) prepend(best->steps, &found->fitted.steps);
    best = std::move(found->fitted);
  } else if (best) {
    best->memory.search_pause = kSearchPause;
  }
  return best;
}

std::optional<Fitted> ObjectFollower::fit(const FrameContext& context, const frame::DepthFrame& frame,
                                          const FitTarget& target, const Attempt& attempt) {
  return fitter_.fit(frame, context.camera(), target, attempt, context.plane());
}

// A wide attempt may end far from where its pixels were chosen: it is fitted again with pixels there.
Fitted ObjectFollower::polished(const FrameContext& context, const frame::DepthFrame& frame,
                                const TrackedObject& object, const Neighbors* neighbors, const Fitted& wide) {
  std::optional<Fitted> again = fit(context, frame, target_of(context, object, wide.T_cam_obj, neighbors),
                                    narrow_attempt(wide.T_cam_obj));
  if (!again || fit_quality(*again, options_) < fit_quality(wide, options_)) return wide;
  prepend(wide.steps, &again->steps);
  return *again;
}

// A fine fit from a given pose may have a long way to go in short steps: it is repeated until it rests, or
// until the evidence clearly falls, as where errors of the depth draw the pose away.
std::optional<Fitted> ObjectFollower::settled(const FrameContext& context, const frame::DepthFrame& frame,
                                              const TrackedObject& object, const Rigidd& given,
                                              const Neighbors* neighbors) {
  std::optional<Fitted> best;
  Rigidd from = given;
  for (int round = 0; round < kSettlingRounds; ++round) {
    std::optional<Fitted> next =
        fit(context, frame, target_of(context, object, from, neighbors), fine_attempt(object, from));
    if (!next) return best;
    if (best) {
      prepend(best->steps, &next->steps);
      if (log_odds(*next, options_) < log_odds(*best, options_) - kClearlyLess) {
        best->steps = std::move(next->steps);
        return best;
      }
      next->memory.systematic_m = std::max(next->memory.systematic_m, best->memory.systematic_m);
    }
    best = std::move(next);
    if (surface_step(best->T_cam_obj, from, object.shape->diameter_m) < kRests_m) return best;
    from = best->T_cam_obj;
  }
  return best;
}

Attempt ObjectFollower::fine_attempt(const TrackedObject& object, const Rigidd& T_cam_obj) const {
  const double near_m = step_m(object);
  return {kScalePerStep * near_m,
          std::min(options_.padding_m, kFinePadding_m + near_m),
          kCoarseSteps,
          {T_cam_obj}};
}

Attempt ObjectFollower::narrow_attempt(const Rigidd& T_cam_obj) const {
  return {options_.scale_start_m, options_.padding_m, kCoarseSteps, {T_cam_obj}};
}

// Starts at the last pose, at the pose predicted by the last motion, and at its small turns about each axis.
Attempt ObjectFollower::wide_attempt(const TrackedObject& object, const Rigidd& expected,
                                     double time_s) const {
  const Rigidd& T = object.T_cam_obj;
  const Rigidd moved = object.motion.predict(T, time_s);
  Attempt attempt{options_.far_scale_m, options_.far_padding_m, 2 * kCoarseSteps, {expected, moved}};
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    for (const double sign : {-1.0, 1.0})
      attempt.starts.add({rotation_exp(sign * kWideTurn * axis) * T.R, T.t});
  return attempt;
}

}  // namespace sdftrack::tracking

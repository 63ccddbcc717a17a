// SPDX-License-Identifier: MIT
#include "tracking/object_follower.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/portable_math.h"
#include "tracking/options/sensor_noise.h"

namespace sdftrack::tracking {

namespace {

constexpr double kProof = 0.9;                           // evidence that the result of a search is the object
constexpr double kSlow = 0.02, kFast = 0.3;              // how fast the usual values follow
constexpr double kFollowedOdds = 3, kDoubtFades = 0.97;  // log odds against loss; per doubtful frame
constexpr double kStepFades = 0.8;                       // per frame
constexpr double kClearlyNearer = 0.8;                   // error of one prediction over that of the other
constexpr double kMinStep_m = 0.005;  // an object at rest may jump this far and still be seen by a narrow fit
constexpr double kMinMotion_m = 0.002, kMinMotion_rad = 0.01;  // in a frame, of an object at rest
// Weight of a new frame in the histograms (thesis Eq. 4.22).
constexpr double kObjectRate = 0.05, kBackgroundRate = 0.3;
constexpr double kUnread = 0.7, kSeenPast = 0.1;  // shares of the visible surface: without depth, free space
constexpr int kColorBudget = 1500, kFirstColorBudget = 20000;  // pixels visited for the histograms

Matrix6d size_covariance(const Rigidd& T_cam_obj, const TrackedObject& object) {
  return object.free_scale ? object.size.free_covariance(T_cam_obj, *object.shape)
                           : object.size.covariance(T_cam_obj, *object.shape);
}

bool is_in_image(const Camera& camera, const Vec3d& p_cam) {
  if (!(p_cam.z > 0)) return false;
  const Vec2d u = camera.project_point(p_cam);
  return u.x >= 0 && u.y >= 0 && u.x < camera.width && u.y < camera.height;
}

}  // namespace

ObjectFollower::ObjectFollower(const TrackerOptions& options, const TrackerSettings& settings)
    : options_(options),
      settings_(settings),
      device_(settings.device >= 0 ? std::make_unique<energies::CudaWork>(settings.device) : nullptr),
      fitter_(options, settings.threads, device_.get()),
      finder_(options, settings.threads, device_.get()) {}

ObjectResult ObjectFollower::follow(FrameContext* context, TrackedObject* object) {
  if (object->unread)
    if (std::optional<ObjectResult> seen = follow_unread(context, object)) return std::move(*seen);
  ObjectResult result = follow_depth(context, object);
  if (result.trust.status == Status::kLost && !object->unread)
    if (std::optional<ObjectResult> seen = follow_unread(context, object)) return std::move(*seen);
  return result;
}

// Black, shiny and transparent objects have no depth: only their outline is left.
std::optional<ObjectResult> ObjectFollower::follow_unread(FrameContext* context, TrackedObject* object) {
  object->unread = false;
  if (!options_.outline || !context->frame().color || !object->placed() || !object->colors.known())
    return std::nullopt;
  const Rigidd expected = expected_pose(*object, context->frame().time_s);
  if (!is_in_image(context->camera(), expected.t)) return std::nullopt;
  const Visibility seen = compare_visible_surface(context->frame(), context->camera(), *object->shape,
                                                  expected, DepthError{options_.noise_m}, kTrustPoints);
  if (seen.missing < kUnread * seen.expected || seen.farther > kSeenPast * seen.expected) return std::nullopt;
  TrackedObject before = *object;
  std::optional<ObjectResult> result = follow_outline(context, object);
  if (!result || result->trust.status == Status::kLost) {
    *object = std::move(before);
    return std::nullopt;
  }
  object->unread = true;
  return result;
}

ObjectResult ObjectFollower::follow_depth(FrameContext* context, TrackedObject* object) {
  const bool crowd = object->lost_frames > 0 && context->has_several();
  const frame::DepthFrame left =
      crowd ? context->unclaimed(context->frame(), context->claimed_by_others(*object)) : context->frame();
  const Neighbors* const neighbors = crowd ? &context->neighbors_of(*object) : nullptr;
  const Rigidd expected = expected_pose(*object, left.time_s);
  std::optional<Fitted> best = fit_further(context, left, *object, expected, neighbors,
                                           fit_near(*context, left, *object, expected, neighbors));
  if (best && crowd && stands_in(*neighbors, *object->shape, best->T_cam_obj)) best.reset();
  object->prior.reset();
  if (!best) return result_without_pose(*object, {ReasonCode::kFewReadings}, Status::kLost);
  const Trust trust = judge_followed(*best, *object);
  return accept(std::move(*best), trust, *context, object);
}

Rigidd ObjectFollower::expected_pose(const TrackedObject& object, double time_s) const {
  return expects_motion(object) ? object.motion.predict(object.T_cam_obj, time_s) : object.T_cam_obj;
}

bool ObjectFollower::expects_motion(const TrackedObject& object) const {
  if (settings_.motion == MotionModel::kConstantVelocity || object.weak) return true;
  return settings_.motion == MotionModel::kAdaptive &&
         object.errors.moving_m < kClearlyNearer * object.errors.still_m;
}

double ObjectFollower::step_m(const TrackedObject& object) const {
  return expects_motion(object) ? object.errors.moving_m : object.errors.still_m;
}

FitTarget ObjectFollower::target_of(const FrameContext& context, const TrackedObject& object,
                                    const Rigidd& expected, const Neighbors* neighbors) const {
  OutlineColors outline_colors;
  if (context.frame().color && object.colors.known())
    outline_colors = {&object.colors, options_.outline_local ? &object.outline_colors : nullptr};
  Matrix6d weak = optim::PosePrior::isotropic(options_.motion_sigma_m, options_.motion_sigma_rad);
  if (object.holds_open_directions()) weak += object.open.hold();
  return {*object.shape,
          expected,
          object.prior ? *object.prior : weak,
          object.memory,
          context.colors_of(object),
          neighbors,
          outline_colors};
}

std::optional<Fitted> ObjectFollower::look(const frame::DepthFrame& frame, const Camera& camera,
                                           const frame::Shape& shape, const Rigidd& T_cam_obj) {
  return fitter_.look(frame, camera, {shape, centred(T_cam_obj, shape), Matrix6d::Zero(), {}});
}

std::optional<Found> ObjectFollower::search(FrameContext* context, const frame::DepthFrame& frame,
                                            const TrackedObject& object, SearchQuery query,
                                            double prior_log_odds) {
  query.plane = context->plane();
  query.taken = context->claimed_by_others(object);
  query.others = &context->neighbors_of(object);
  query.symmetries = &object.symmetries;
  return finder_.find(context->unclaimed(frame, query.taken), context->camera(), *object.shape, object.memory,
                      context->colors_of(object), query, prior_log_odds, &fitter_);
}

ObjectResult ObjectFollower::accept(Fitted fitted, Trust trust, const FrameContext& context,
                                    TrackedObject* object) const {
  ObjectResult result;
  doubt_frame(context.fault(), &trust.status, &trust.reason, &trust.confidence);
  if (trust.status == Status::kLost) {
    result = result_without_pose(*object, trust.reason, Status::kLost);
    result.trust.inliers = trust.inliers;
  } else {
    const double time_s = context.frame().time_s;
    if (context.fault() == ReasonCode::kRepeatedDepth) move_on(time_s, *object, &fitted);
    fitted.unseen_errors += lag_covariance(fitted, time_s, *object);  // `keep` replaces the last pose
    keep(fitted, trust, time_s, object);
    fitted.covariance += fitted.unseen_errors + size_covariance(fitted.T_cam_obj, *object) +
                         fitted.memory.outline.way * fitted.memory.outline.way.transpose();
    result.T_cam_obj = uncentred(fitted.T_cam_obj, *object->shape);
    result.covariance = fitted.covariance;
    if (is_unstated(options_)) result.unstated = fitted.unseen_errors;
    result.trust = trust;
    result.runner_up = kUnknown;
  }
  result.cost = fitted.cost;
  result.systematic_m = hypotenuse(fitted.systematic_m, distance_error_m(options_, fitted.T_cam_obj.t.z));
  result.foreground = fitted.foreground;
  result.steps = std::move(fitted.steps);
  return result;
}

// An object at its last pose, or at a pose given by the caller, is lost only where another explanation is
// more likely. This counts in full after a sure frame and less with every doubtful one, so that an object
// doubted for long is searched for again.
Trust ObjectFollower::judge_followed(const Fitted& fitted, const TrackedObject& object) const {
  double vouched = 0;
  if (object.given)
    vouched = std::log(options_.given_odds);
  else if (object.lost_frames == 0 && object.usual_share > 0)
    vouched = kFollowedOdds * std::pow(kDoubtFades, object.weak_frames);
  PoseEvidence evidence = evidence_of(fitted, options_);
  // Where the outline fits the model, large residuals of the depth are the sensor's own error.
  if (object.by_mask_alone && object.size.outline_agrees()) evidence = but_for_residuals(evidence);
  return judge(evidence, fitted.covariance, options_, object.prior_log_odds, vouched);
}

// If nothing is stated about the sensor, depth may be delayed: the pose then lags by a part of the motion
// since the last frame.
Matrix6d ObjectFollower::lag_covariance(const Fitted& fitted, double time_s,
                                        const TrackedObject& object) const {
  if (!is_unstated(options_) || !object.followed() || !(object.usual_share > 0)) return Matrix6d::Zero();
  const Rigidd before = uncentred(object.T_cam_obj, *object.shape),
               now = uncentred(fitted.T_cam_obj, *object.shape);
  const Vec3d v = now.t - before.t, w = rotation_log(now.R * transpose(before.R));
  const Vector6d motion{{v.x, v.y, v.z, w.x, w.y, w.z}};
  const double frame_s = object.motion.knows_time() ? object.motion.frame_interval(time_s) : 0;
  return object.color_delay.lag2_frames(frame_s) * motion * motion.transpose();
}

// The measurements are from an earlier moment: the object has moved since by an unknown amount.
void ObjectFollower::move_on(double time_s, const TrackedObject& object, Fitted* fitted) const {
  const Rigidd before = fitted->T_cam_obj;
  fitted->T_cam_obj = object.motion.predict(before, time_s);
  double sd_m = options_.motion_sigma_m, sd_rad = options_.motion_sigma_rad;
  if (object.motion.knows_velocity()) {
    const Vec3d step = uncentred(fitted->T_cam_obj, *object.shape).t - uncentred(before, *object.shape).t;
    sd_m = std::max(kMinMotion_m, norm(step));
    sd_rad = std::max(kMinMotion_rad, rotation_angle(fitted->T_cam_obj.R * transpose(before.R)));
  }
  for (int i = 0; i < 3; ++i) {
    fitted->covariance(i, i) += sd_m * sd_m;
    fitted->covariance(i + 3, i + 3) += sd_rad * sd_rad;
  }
}

void ObjectFollower::keep(const Fitted& fitted, const Trust& trust, double time_s,
                          TrackedObject* object) const {
  const auto observe = [&](const Rigidd& predicted, double* error_m) {
    const double step_m = surface_step(fitted.T_cam_obj, predicted, object->shape->diameter_m);
    *error_m = std::max({kMinStep_m, step_m, kStepFades * *error_m});
  };
  observe(object->motion.predict(object->T_cam_obj, time_s), &object->errors.moving_m);
  observe(object->T_cam_obj, &object->errors.still_m);
  object->T_cam_obj = fitted.T_cam_obj;
  // A direction along which the sensor's systematic error moves the pose is observed all the same.
  object->open =
      OpenDirections(fitted.covariance - fitted.systematic_errors, fitted.T_cam_obj, *object->shape);
  object->determined_frames = object->open.empty() ? object->determined_frames + 1 : 0;
  if (fitted.size_by_depth) object->size.depth.observe(*fitted.size_by_depth, fitted.T_cam_obj.R);
  if (fitted.form_by_depth) object->size.form.observe(*fitted.form_by_depth, fitted.T_cam_obj.R);
  if (fitted.by_outline) {
    object->size.outline.observe(fitted.by_outline->size, fitted.T_cam_obj.R);
    object->size.form_outline.observe(fitted.by_outline->form);
    object->size.outline_has_agreed |= object->size.outline_agrees();
  }
  object->memory = fitted.memory;
  object->memory.learns_systematic = false;
  object->hidden_frames = 0;
  object->weak = trust.status != Status::kOk;
  object->weak_frames = object->weak ? object->weak_frames + 1 : 0;
  if (!object->weak && trust.evidence >= kProof) object->prior_log_odds = 0, object->given = false;
  if (object->weak)
    object->motion.pass();
  else
    object->observe_motion(time_s), ++object->sure_frames;
  if (!object->weak && object->motion.knows_time()) {
    const Vec3d v = object->motion.velocity(), w = object->motion.turn_rate();
    object->color_delay.observe(fitted.apart, Vector6d{{v.x, v.y, v.z, w.x, w.y, w.z}});
  } else {
    object->color_delay.pass();
  }
  // Values that further attempts could not improve become the usual ones: an object covered by a hand is not
  // searched for in every frame.
  const double share = agreeing_share(fitted.seen);
  const bool first = !(object->usual_share > 0);
  const double rate = first ? 1 : convincing(fitted, *object, options_) ? kSlow : kFast;
  object->usual_share += rate * (share - object->usual_share);
  object->usual_cost += rate * (fitted.cost - object->usual_cost);
}

// Only from a reliable pose: from another pose the colours of an occluder, or of something mistaken for the
// object, would be learnt and would support that pose from then on.
void ObjectFollower::learn_colors(FrameContext* context, TrackedObject* object) {
  if (!context->frame().color || object->prior_log_odds < 0) return;
  if (object->colors_by_outline) object->colors_by_outline = false, object->colors.forget();
  const int budget = object->colors.known() ? kColorBudget : kFirstColorBudget;
  count_colors(context->frame(), context->camera(), *object->shape, object->T_cam_obj, options_.padding_m,
               budget, object->colors, &color_reader_, &color_counts_, context->neighbors_of(*object),
               options_.color_learning_printed);
  object->colors.update(color_counts_, kObjectRate, kBackgroundRate);
  if (object->memory.outline_age == 0 || !object->outline_colors.known()) learn_outline(*context, object);
}

void ObjectFollower::learn_outline(const FrameContext& context, TrackedObject* object) {
  if (options_.outline && options_.outline_local && object->colors.known())
    fitter_.learn_outline(context.frame(), context.camera(), *object->shape, object->colors,
                          object->T_cam_obj, object->memory, &object->outline_colors);
}

}  // namespace sdftrack::tracking

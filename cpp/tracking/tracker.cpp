// SPDX-License-Identifier: MIT
#include "tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace sdftrack {

namespace {

constexpr double kOfUsual = 0.85;        // a share this far below the usual one is not convincing
constexpr double kWideTurn = 0.2;        // rad, of the further starts of a wide attempt
constexpr double kClearlyBetter = 0.15;  // share of surface points that a wider attempt must gain

// Whether an attempt needs no second one. An object that has been followed is compared with itself; at a
// start only the surface that nothing hides can be judged.
bool convincing(const Visibility& seen, double usual_share, const TrackerOptions& options) {
  if (usual_share > 0) return agreeing_share(seen) >= kOfUsual * usual_share;
  return seen.agree >= options.retry_inliers * (seen.agree + seen.farther) && seen.agree > 0;
}

bool has_depth(const ImageView<float>& depth_m) {
  const int pixels = depth_m.width * depth_m.height, stride = std::max(1, pixels / 4099);
  for (int i = 0; i < pixels; i += stride)
    if (depth_m.data[i] > 0) return true;
  return false;
}

Rigidd centred(const Rigidd& T_cam_obj, const Shape& shape) {
  return {T_cam_obj.R, T_cam_obj * shape.centre_obj};
}

void prepend(const std::vector<TrackStep>& first, std::vector<TrackStep>* steps) {
  steps->insert(steps->begin(), first.begin(), first.end());
}

Rigidd uncentred(const Rigidd& T_cam_centre, const Shape& shape) {
  return {T_cam_centre.R, T_cam_centre * -shape.centre_obj};
}

}  // namespace

Tracker::Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
                 int threads)
    : options_(options), fitter_(options, threads) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    Object object;
    for (std::size_t j = 0; j < i && !object.shape; ++j)
      if (shapes[j].phi == shapes[i].phi) object.shape = objects_[j].shape;
    if (!object.shape)
      object.shape = std::make_shared<const Shape>(
          make_shape(shapes[i], 3 * options.trust_points, options.free_space_points));
    objects_.push_back(object);
  }
  set_camera(camera);
}

void Tracker::set_camera(const Camera& camera) {
  camera_ = camera;
  rays_ = camera.distorted() ? ray_table(camera) : std::vector<float>{};
}

DepthFrame Tracker::make_frame(const ImageView<float>& depth_m, const unsigned char* mask) const {
  return {depth_m, mask, rays_.empty() ? nullptr : rays_.data()};
}

std::vector<ObjectResult> Tracker::start(const ImageView<float>& depth_m, const unsigned char* mask,
                                         const std::vector<Rigidd>& T_cam_obj) {
  if (T_cam_obj.size() != objects_.size())
    throw std::invalid_argument("poses: expected one per shape (" + std::to_string(objects_.size()) +
                                "), got " + std::to_string(T_cam_obj.size()));
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    Object& object = objects_[k];
    object.T_cam_obj = centred(T_cam_obj[k], *object.shape);
    object.memory = {1, false, options_.damping_start}, object.usual_share = 0, object.last_motion = {};
  }
  plane_ = {};
  return track_all(make_frame(depth_m, mask));
}

std::vector<ObjectResult> Tracker::track(const ImageView<float>& depth_m, const unsigned char* mask) {
  return track_all(make_frame(depth_m, mask));
}

void Tracker::set_pose(int k, const Rigidd& T_cam_obj) {
  Object& object = objects_.at(static_cast<std::size_t>(k));
  object.T_cam_obj = centred(T_cam_obj, *object.shape);
}

std::vector<ObjectResult> Tracker::track_all(const DepthFrame& frame) {
  std::vector<ObjectResult> results;
  if (!has_depth(frame.depth_m)) {
    for (const Object& object : objects_)
      results.push_back(lost(object, "the depth image has no valid reading", Status::kBadFrame));
    return results;
  }
  if (options_.drop_plane) follow_plane(frame);
  for (Object& object : objects_) results.push_back(track_one(frame, &object));
  return results;
}

void Tracker::follow_plane(const DepthFrame& frame) {
  std::vector<Rect> regions;
  for (const Object& object : objects_)
    regions.push_back(projected_box(camera_, *object.shape, object.T_cam_obj, options_.padding_m));
  plane_.update(frame, camera_, regions);
}

ObjectResult Tracker::lost(const Object& object, std::string reason, Status status) const {
  ObjectResult result;
  result.T_cam_obj = uncentred(object.T_cam_obj, *object.shape);
  result.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  result.trust = {status, std::move(reason), 0, 0};
  return result;
}

std::optional<Fitted> Tracker::fit(const DepthFrame& frame, const Object& object, const Attempt& attempt,
                                   const Rigidd& expected) {
  const FitTarget target{*object.shape, expected,
                         PosePrior::isotropic(options_.motion_sigma_m, options_.motion_sigma_rad),
                         object.memory};
  return fitter_.fit(frame, camera_, target, attempt, plane_.plane());
}

ObjectResult Tracker::track_one(const DepthFrame& frame, Object* object) {
  const Rigidd last = object->T_cam_obj;
  std::optional<Fitted> best = fit(frame, *object, narrow_attempt(last), last);
  if (options_.retry_inliers > 0 && !(best && convincing(best->seen, object->usual_share, options_))) {
    std::optional<Fitted> wide = fit(frame, *object, wide_attempt(*object), last);
    if (wide && best) prepend(best->steps, &wide->steps), best->steps = wide->steps;
    if (wide && (!best || agreeing_share(wide->seen) > agreeing_share(best->seen) + kClearlyBetter))
      best = polished(frame, *object, *wide);
  }
  if (!best) return lost(*object, "too few depth readings near the last pose", Status::kLost);
  return judged(std::move(*best), object);
}

// A wide attempt may end far from where its pixels were chosen: once more from there, with the pixels of that
// place.
Fitted Tracker::polished(const DepthFrame& frame, const Object& object, const Fitted& wide) {
  std::optional<Fitted> again = fit(frame, object, narrow_attempt(wide.T_cam_obj), wide.T_cam_obj);
  if (!again || agreeing_share(again->seen) < agreeing_share(wide.seen)) return wide;
  prepend(wide.steps, &again->steps);
  return *again;
}

ObjectResult Tracker::judged(Fitted fitted, Object* object) {
  ObjectResult result;
  result.trust = judge(fitted.seen, fitted.cost, fitted.covariance, options_);
  if (result.trust.status == Status::kLost) {
    const double inliers = result.trust.inliers;
    result = lost(*object, result.trust.reason, Status::kLost);
    result.trust.inliers = inliers;
  } else {
    keep(fitted, object);
    result.T_cam_obj = uncentred(fitted.T_cam_obj, *object->shape);
    result.covariance = fitted.covariance;
  }
  result.cost = fitted.cost;
  result.steps = std::move(fitted.steps);
  return result;
}

void Tracker::keep(const Fitted& fitted, Object* object) {
  object->last_motion = {fitted.T_cam_obj.R * transpose(object->T_cam_obj.R),
                         fitted.T_cam_obj.t - object->T_cam_obj.t};
  object->T_cam_obj = fitted.T_cam_obj;
  object->memory = fitted.memory;
  const double now = agreeing_share(fitted.seen);
  object->usual_share = object->usual_share > 0 ? 0.98 * object->usual_share + 0.02 * now : now;
}

Attempt Tracker::narrow_attempt(const Rigidd& T_cam_obj) const {
  return {options_.scale_start_m, options_.padding_m, options_.coarse_steps, {T_cam_obj}};
}

// From the last pose, from where the last motion would take it, and from small turns of it about each axis.
Attempt Tracker::wide_attempt(const Object& object) const {
  const Rigidd& T = object.T_cam_obj;
  Attempt attempt{options_.far_scale_m, options_.far_padding_m, 2 * options_.coarse_steps, {T}};
  attempt.starts.push_back({object.last_motion.R * T.R, T.t + object.last_motion.t});
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    for (const double sign : {-1.0, 1.0})
      attempt.starts.push_back({rotation_exp(sign * kWideTurn * axis) * T.R, T.t});
  return attempt;
}

}  // namespace sdftrack

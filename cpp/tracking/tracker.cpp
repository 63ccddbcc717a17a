// SPDX-License-Identifier: MIT
#include "tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace sdftrack {

namespace {

// A step that promises a smaller gain in log-likelihood moves the pose by less than 5 % of its standard
// deviation.
constexpr double kLeastGain = 1e-3;
// An accepted step that promised less than this (1.4 standard deviations) is the last: Gauss-Newton leaves of
// it what is of second order, a few hundredths of one (docs/math/depth_tracker.md, section
// 4).
constexpr double kLastGain = 1, kLastCoarseGain = 10;
// Newton steps before the first linearisation; one leaves curved parts as fallback, with its bias.
constexpr int kSettleSteps = 2;
constexpr double kFineReach_m = 0.004, kFineReachPerScale = 5;
constexpr int kSummaryPixels = 1000;
constexpr double kLeastNoise_m = 1e-4;  // s never falls below: the volume itself is no better than this

constexpr double kOfUsual = 0.85;        // a share this far below the usual one is not convincing
constexpr double kWideTurn = 0.2;        // rad, of the further starts of a wide attempt
constexpr double kClearlyBetter = 0.15;  // share of surface points that a wider attempt must gain

// Of the surface points that the camera should see, share that it reads where the pose puts them.
double share(const Visibility& seen) {
  return seen.expected > 0 ? static_cast<double>(seen.agree) / seen.expected : 0.0;
}

// Whether an attempt needs no second one. An object that has been followed is compared with itself; at a
// start only the surface that nothing hides can be judged.
bool convincing(const Visibility& seen, double usual_share, const TrackerOptions& options) {
  if (usual_share > 0) return share(seen) >= kOfUsual * usual_share;
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

Rigidd uncentred(const Rigidd& T_cam_centre, const Shape& shape) {
  return {T_cam_centre.R, T_cam_centre * -shape.centre_obj};
}

}  // namespace

Tracker::Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
                 int threads)
    : options_(options), threads_(threads) {
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
    object.noise = {}, object.usual_share = 0, object.last_motion = {},
    object.damping = options_.damping_start;
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

ObjectResult Tracker::track_one(const DepthFrame& frame, Object* object) {
  std::optional<Fitted> best =
      try_fit(frame, object,
              {options_.scale_start_m, options_.padding_m, options_.coarse_steps, {object->T_cam_obj}});
  if (options_.retry_inliers > 0 && !(best && convincing(best->seen, object->usual_share, options_))) {
    std::optional<Fitted> wide = try_fit(frame, object, wide_attempt(*object));
    if (wide && best) {  // one record of every trial, in order
      std::vector<TrackStep>& first = best->result.steps;
      wide->result.steps.insert(wide->result.steps.begin(), first.begin(), first.end());
      first = wide->result.steps;
    }
    if (wide && (!best || share(wide->seen) > share(best->seen) + kClearlyBetter))
      best = polished(frame, object, *wide);
  }
  if (!best) return lost(*object, "too few depth readings near the last pose", Status::kLost);

  ObjectResult& result = best->result;
  result.trust = judge(best->seen, result.cost, result.covariance, options_);
  if (result.trust.status == Status::kLost) {
    ObjectResult gone = lost(*object, result.trust.reason, Status::kLost);
    gone.trust.inliers = result.trust.inliers;
    gone.cost = result.cost;
    gone.steps = std::move(result.steps);
    return gone;
  }
  keep(*best, object);
  result.T_cam_obj = uncentred(best->T_cam_obj, *object->shape);
  return std::move(result);
}

// A wide attempt may end far from where its pixels were chosen: once more from there, with the pixels of that
// place.
Tracker::Fitted Tracker::polished(const DepthFrame& frame, Object* object, const Fitted& wide) {
  const Rigidd last = object->T_cam_obj;
  object->T_cam_obj = wide.T_cam_obj;
  std::optional<Fitted> again = try_fit(
      frame, object, {options_.scale_start_m, options_.padding_m, options_.coarse_steps, {wide.T_cam_obj}});
  object->T_cam_obj = last;
  if (!again || share(again->seen) < share(wide.seen)) return wide;
  again->result.steps.insert(again->result.steps.begin(), wide.result.steps.begin(), wide.result.steps.end());
  return *again;
}

void Tracker::keep(const Fitted& fitted, Object* object) {
  object->last_motion = {fitted.T_cam_obj.R * transpose(object->T_cam_obj.R),
                         fitted.T_cam_obj.t - object->T_cam_obj.t};
  object->T_cam_obj = fitted.T_cam_obj;
  object->noise = fitted.noise;
  const double now = share(fitted.seen);
  object->usual_share = object->usual_share > 0 ? 0.98 * object->usual_share + 0.02 * now : now;
}

// From the last pose, from where the last motion would take it, and from small turns of it about each axis.
Tracker::Attempt Tracker::wide_attempt(const Object& object) const {
  const Rigidd& T = object.T_cam_obj;
  Attempt attempt{options_.far_scale_m, options_.far_padding_m, 2 * options_.coarse_steps, {T}};
  attempt.starts.push_back({object.last_motion.R * T.R, T.t + object.last_motion.t});
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
    for (const double sign : {-1.0, 1.0})
      attempt.starts.push_back({rotation_exp(sign * kWideTurn * axis) * T.R, T.t});
  return attempt;
}

std::optional<Tracker::Fitted> Tracker::try_fit(const DepthFrame& frame, Object* object,
                                                const Attempt& attempt) {
  const Shape& shape = *object->shape;
  select_pixels(frame, camera_, shape, object->T_cam_obj, options_, attempt.padding_m, plane_.plane(),
                &pixels_);
  if (pixels_.count() < options_.min_pixels) return std::nullopt;
  if (options_.free_space)
    free_space_grid(frame, camera_, shape, object->T_cam_obj, attempt.padding_m, &free_scratch_, &free_grid_);
  else
    free_grid_.distance_px.clear();

  Fitted fitted;
  fitted.noise = object->noise;
  State x = best_coarse_fit(frame, object, attempt, &fitted);
  const double stated_noise_m = sensor_noise_m(options_, object->T_cam_obj.t.z);
  choose_fine_pixels(object, last_scale(fitted.noise, stated_noise_m), x);
  fit_fine(object, stated_noise_m, &x, &fitted);
  fitted.T_cam_obj = inverse(x.T_obj_cam[0]);
  const double noise_m = fitted.noise.factor * sensor_noise_m(options_, fitted.T_cam_obj.t.z);
  fitted.seen =
      compare_visible_surface(frame, camera_, shape, fitted.T_cam_obj, noise_m, options_.trust_points);
  return fitted;
}

State Tracker::best_coarse_fit(const DepthFrame& frame, Object* object, const Attempt& attempt,
                               Fitted* fitted) {
  const double noise_m = fitted->noise.factor * sensor_noise_m(options_, object->T_cam_obj.t.z);
  coarse_.assign_subset(pixels_, options_.coarse_pixels);
  State best;
  double most = -1;
  for (const Rigidd& start : attempt.starts) {
    State x{{inverse(start)}, camera_.K, {}};
    if (!options_.keep_damping) object->damping = options_.damping_start;
    fit_coarse(object, attempt, &x, fitted);
    if (attempt.starts.size() == 1) return x;
    const double now = share(compare_visible_surface(frame, camera_, *object->shape, inverse(x.T_obj_cam[0]),
                                                     noise_m, options_.trust_points));
    if (now > most) most = now, best = x;
  }
  return best;
}

// Coarse stages on an even subset: phi at the measured points, the better start from afar, and last the
// residual of the fine stage.
void Tracker::fit_coarse(Object* object, const Attempt& attempt, State* x, Fitted* fitted) {
  if (!(attempt.scale_m > 0)) return;
  const double last = last_scale(fitted->noise, sensor_noise_m(options_, object->T_cam_obj.t.z));
  SdfEnergyOptions energy{Residual::kPoint, options_.curvature};
  energy.outlier_floor = static_cast<float>(options_.outlier_floor);
  for (double s = attempt.scale_m; s > 1.5 * last; s *= 0.5) {
    energy.scale_m = static_cast<float>(s);
    run_stage(object, &coarse_, energy, attempt.coarse_steps, x, &fitted->result);
  }
  if (coarse_.count() < pixels_.count()) {
    energy.scale_m = static_cast<float>(last);
    energy.residual = options_.residual;
    run_stage(object, &coarse_, energy, attempt.coarse_steps, x, &fitted->result);
  }
}

// Readings far from the surface have lost all weight at this scale; what is left is brought down to the
// budget.
void Tracker::choose_fine_pixels(Object* object, double scale_m, const State& x) {
  if (options_.outlier_floor > 0)
    SdfEnergy(object->shape->sdf, &pixels_, {})
        .keep_near(x, std::max(kFineReach_m, kFineReachPerScale * scale_m));
  if (pixels_.count() > options_.max_pixels) {
    scratch_.assign_subset(pixels_, options_.max_pixels);
    std::swap(scratch_, pixels_);
  }
}

double Tracker::last_scale(const Noise& noise, double stated_noise_m) const {
  return options_.scale_per_noise * std::max(kLeastNoise_m, noise.factor * stated_noise_m);
}

void Tracker::fit_fine(Object* object, double stated_noise_m, State* x, Fitted* fitted) {
  SdfEnergyOptions options{options_.residual, options_.curvature};
  options.outlier_floor = static_cast<float>(options_.outlier_floor);
  options.threads = threads_;
  // The first frame does not know the sensor's noise yet: fit, measure, fit again.
  for (int round = fitted->noise.known || !options_.adapt_noise ? 1 : 0; round < 2; ++round) {
    options.scale_m = static_cast<float>(last_scale(fitted->noise, stated_noise_m));
    run_stage(object, &pixels_, options, options_.fine_steps, x, &fitted->result);
    SdfEnergy energy(object->shape->sdf, &pixels_, options);
    const EnergySummary summary = energy.summarize(*x, kSummaryPixels);
    if (options_.adapt_noise) fitted->noise = updated(fitted->noise, summary.noise_m, stated_noise_m);
    if (round == 0) continue;
    fitted->result.covariance =
        camera_covariance(increment_covariance(summary, *object->shape, options_.correlation_area_px),
                          inverse(x->T_obj_cam[0]), -object->shape->centre_obj);
  }
}

void Tracker::run_stage(Object* object, PixelSet* pixels, const SdfEnergyOptions& energy_options, int steps,
                        State* x, ObjectResult* result) {
  const Shape& shape = *object->shape;
  SdfEnergy data(shape.sdf, pixels, energy_options);
  if (energy_options.residual == Residual::kRayHit) data.settle(*x, kSettleSteps);
  SumEnergy sum;
  sum.add(&data);

  FreeSpaceEnergy free_space(&shape.outline, &free_grid_,
                             {static_cast<float>(options_.free_space_scale_m), 1.0f});
  if (!free_grid_.empty())
    sum.add(&free_space,
            options_.free_space_weight * pixels->count() / static_cast<double>(shape.outline.size()));
  PosePrior prior({1, false, false}, 0, inverse(object->T_cam_obj), options_.motion_sigma_m,
                  options_.motion_sigma_rad);
  if (options_.motion_sigma_m > 0 && options_.motion_sigma_rad > 0) sum.add(&prior);

  LmOptions lm;
  lm.max_steps = steps;
  lm.damping = object->damping;
  lm.cost_relative = 0;
  lm.cost_gain = kLeastGain;
  lm.last_gain = pixels == &pixels_ ? kLastGain : kLastCoarseGain;  // a coarse fit is only a start
  const LmResult fitted = minimize(sum, *x, lm);
  for (const LmStep& step : fitted.steps)
    result->steps.push_back({step, energy_options.scale_m, pixels->count()});
  *x = fitted.x;
  if (options_.keep_damping) object->damping = std::clamp(fitted.damping, 1e-6, options_.damping_start);
  result->cost = fitted.count > 0 ? fitted.cost / fitted.count : 0;
}

Tracker::Noise Tracker::updated(const Noise& noise, double measured_m, double stated_m) {
  if (!(measured_m > 0)) return noise;
  const double measured = std::clamp(measured_m / stated_m, 0.1, 10.0);
  return {noise.known ? 0.8 * noise.factor + 0.2 * measured : measured, true};
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace sdftrack {

namespace {

constexpr double kOfUsual = 0.85;       // an agreeing share this far below the usual one is not convincing,
constexpr double kOverUsual = 1.4;      // nor is a mean cost this far above the usual one
constexpr double kWideTurn = 0.2;       // rad, of the further starts of a wide attempt
constexpr double kClearlyBetter = 0.1;  // quality that a further attempt must gain
constexpr double kNextReach_m = 0.06;   // of a search for an object that moved too fast to be followed
constexpr int kColorBudget = 3000, kFirstColorBudget = 20000;  // pixels visited for the histograms
constexpr double kSlow = 0.02, kFast = 0.3;                    // how fast the usual values follow

// Whether an attempt needs no further one. An object that has been followed is compared with itself; at a
// start only the surface that nothing hides can be judged.
bool convincing(const Fitted& fitted, const TrackedObject& object, const TrackerOptions& options) {
  const Visibility& seen = fitted.seen;
  if (object.usual_share > 0)
    return agreeing_share(seen) >= kOfUsual * object.usual_share &&
           fitted.cost <= kOverUsual * object.usual_cost;
  return seen.agree >= options.retry_inliers * (seen.agree + seen.farther) && seen.agree > 0;
}

// Of attempts on an object that may be held: what stands in front of the surface is no fault, what is seen
// through it is one.
double held_quality(const Fitted& fitted, const TrackerOptions& options) {
  const double past =
      fitted.seen.expected > 0 ? fitted.seen.farther / static_cast<double>(fitted.seen.expected) : 0;
  return fit_quality(fitted, options) - past;
}

bool has_depth(const ImageView<float>& depth_m) {
  const int pixels = depth_m.width * depth_m.height, stride = std::max(1, pixels / 4099);
  for (int i = 0; i < pixels; i += stride)
    if (depth_m.data[i] > 0) return true;
  return false;
}

// Within the mask, if there is one.
bool has_reading(const ImageView<float>& depth_m, const std::vector<unsigned char>& mask) {
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] && depth_m.data[i] > 0) return true;
  return mask.empty();
}

std::vector<int> all_of(std::size_t n) {
  std::vector<int> k(n);
  std::iota(k.begin(), k.end(), 0);
  return k;
}

}  // namespace

Tracker::Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
                 const TrackerSettings& settings)
    : options_(options),
      settings_(settings),
      fitter_(options, settings.threads),
      finder_(options, settings.threads) {
  for (const SdfView& sdf : shapes) {
    objects_.push_back(new_object(sdf));
  }
  set_camera(camera);
}

TrackedObject Tracker::new_object(const SdfView& sdf) const {
  Object object;
  object.shape = shape_of(sdf);
  object.colors = ColorModel(static_cast<float>(options_.color_prior));
  object.forget(options_.damping_start);
  return object;
}

std::shared_ptr<const Shape> Tracker::shape_of(const SdfView& sdf) const {
  for (const Object& object : objects_)
    if (object.shape->sdf.phi == sdf.phi) return object.shape;
  return std::make_shared<const Shape>(
      make_shape(sdf, 3 * options_.trust_points, options_.free_space_points));
}

void Tracker::set_camera(const Camera& camera) {
  camera_ = camera;
  rays_ = camera.distorted() ? ray_table(camera) : std::vector<float>{};
}

DepthFrame Tracker::make_frame(const ImageView<float>& depth_m, const unsigned char* mask, double time_s,
                               const ColorImage* color) const {
  return {depth_m, mask, rays_.empty() ? nullptr : rays_.data(), time_s, color};
}

std::vector<ObjectResult> Tracker::start(const DepthFrame& frame, const std::vector<Whereabouts>& places) {
  if (places.size() != objects_.size())
    throw std::invalid_argument("poses: expected one per shape (" + std::to_string(objects_.size()) +
                                "), got " + std::to_string(places.size()));
  plane_ = {};
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    objects_[k].forget(options_.damping_start);
    objects_[k].colors.forget();
    const std::optional<Rigidd>& pose = places[k].T_cam_obj;  // the plane's search leaves its region out
    objects_[k].T_cam_obj = pose ? centred(*pose, *objects_[k].shape) : Rigidd{};
    objects_[k].wanted = places[k];
  }
  return track(frame);
}

std::vector<ObjectResult> Tracker::track(const DepthFrame& frame) {
  return each(frame, all_of(objects_.size()), [&](std::size_t, Object* o) { return track_one(frame, o); });
}

std::vector<ObjectResult> Tracker::recover(const DepthFrame& frame, const std::vector<int>& objects,
                                           const std::vector<Whereabouts>& places) {
  return each(frame, objects, [&](std::size_t i, Object* object) {
    object->forget(options_.damping_start);
    return begin_at(frame, object, places[i]);
  });
}

std::optional<Fitted> Tracker::look(const DepthFrame& frame, int k, const Rigidd& T_cam_obj) {
  const Shape& shape = *objects_.at(static_cast<std::size_t>(k)).shape;
  return fitter_.look(frame, camera_, {shape, centred(T_cam_obj, shape), Matrix6d::Zero(), {}});
}

void Tracker::set_pose(int k, const Rigidd& T_cam_obj, const std::optional<Matrix6d>& covariance_cam) {
  Object& object = objects_.at(static_cast<std::size_t>(k));
  object.T_cam_obj = centred(T_cam_obj, *object.shape);
  object.motion.reset();
  object.lost_frames = 0;
  object.wanted.reset(), object.before_found.reset(), object.prior.reset();
  if (covariance_cam)
    object.prior = increment_information(*covariance_cam, object.T_cam_obj, -object.shape->centre_obj);
}

int Tracker::add(const SdfView& shape, const Whereabouts& place) {
  Object object = new_object(shape);
  if (place.T_cam_obj) object.T_cam_obj = centred(*place.T_cam_obj, *object.shape);
  object.wanted = place;
  objects_.push_back(std::move(object));
  return object_count() - 1;
}

void Tracker::remove(int k) {
  objects_.at(static_cast<std::size_t>(k));
  objects_.erase(objects_.begin() + k);
}

template <class Work>
std::vector<ObjectResult> Tracker::each(const DepthFrame& frame, const std::vector<int>& objects,
                                        const Work& work) {
  const bool readable = has_depth(frame.depth_m);
  if (readable && options_.drop_plane) follow_plane(frame);
  std::vector<ObjectResult> results;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Object& object = objects_.at(static_cast<std::size_t>(objects[i]));
    if (readable) {
      const bool color_used = colors_of(frame, object) != nullptr;
      results.push_back(work(i, &object));
      results.back().color_used = color_used;
      if (results.back().trust.status == Status::kOk) learn_colors(frame, &object);
      continue;
    }
    results.push_back(unread(&object));
  }
  return results;
}

ObjectResult Tracker::unread(Object* object) {
  // A place to begin at is kept for the next frame; a pose is one already.
  if (object->wanted && object->wanted->T_cam_obj)
    object->T_cam_obj = centred(*object->wanted->T_cam_obj, *object->shape), object->wanted.reset();
  return without_pose(*object, "the depth image has no valid reading", Status::kBadFrame);
}

void Tracker::follow_plane(const DepthFrame& frame) {
  std::vector<Rect> regions;
  for (const Object& object : objects_)
    regions.push_back(projected_box(camera_, *object.shape, object.T_cam_obj, options_.padding_m));
  plane_.update(frame, camera_, regions);
}

const ColorModel* Tracker::colors_of(const DepthFrame& frame, const Object& object) const {
  const bool tell =
      frame.color && object.colors.known() && object.colors.overlap() <= options_.color_max_overlap;
  return tell ? &object.colors : nullptr;
}

// Only from a pose that is sure: from another it would learn the colours of what hides the object.
void Tracker::learn_colors(const DepthFrame& frame, Object* object) {
  if (!frame.color) return;
  const int budget = object->colors.known() ? kColorBudget : kFirstColorBudget;
  count_colors(frame, camera_, *object->shape, object->T_cam_obj, options_.padding_m, budget, object->colors,
               &color_reader_, &color_counts_);
  object->colors.update(color_counts_, options_.color_object_rate, options_.color_background_rate);
}

ObjectResult Tracker::track_one(const DepthFrame& frame, Object* object) {
  if (object->wanted) {
    const Whereabouts place = std::move(*object->wanted);
    object->wanted.reset();
    return begin_at(frame, object, place);
  }
  ObjectResult result = confirmed(follow(frame, object), object);
  if (result.trust.status != Status::kLost) {
    object->lost_frames = 0;
    return result;
  }
  ++object->lost_frames;
  object->motion.reset();
  return settings_.recover ? look_for(frame, object, std::move(result)) : result;
}

ObjectResult Tracker::begin_at(const DepthFrame& frame, Object* object, const Whereabouts& place) {
  if (place.T_cam_obj) {
    object->T_cam_obj = centred(*place.T_cam_obj, *object->shape);
    return follow(frame, object);
  }
  SearchQuery query;
  query.mask = place.mask.empty() ? nullptr : place.mask.data();
  query.box = place.box;
  query.plane = plane_.plane();
  query.taken = taken_by_others(frame, *object);
  const std::optional<Found> found = finder_.find(frame, camera_, *object->shape, object->memory,
                                                  colors_of(frame, *object), query, &fitter_);
  if (!found) {
    object->lost_frames = 1;
    return without_pose(*object,
                        has_reading(frame.depth_m, place.mask) ? "nothing was found that could be the object"
                                                               : "no depth reading within the mask",
                        Status::kLost);
  }
  ObjectResult result = judged(found->fitted, found->trust, frame.time_s, object);
  result.runner_up = found->runner_up;
  object->lost_frames = result.trust.status == Status::kLost;
  return result;
}

Rigidd Tracker::expected_pose(const Object& object, double time_s) const {
  const bool moves = settings_.motion == MotionModel::kConstantVelocity || object.weak;
  return moves ? object.motion.predict(object.T_cam_obj, time_s) : object.T_cam_obj;
}

ObjectResult Tracker::follow(const DepthFrame& frame, Object* object) {
  const std::optional<Fitted> best = best_fit(frame, *object, expected_pose(*object, frame.time_s));
  object->prior.reset();
  if (!best) return without_pose(*object, "too few depth readings near the last pose", Status::kLost);
  return judged(*best, judge(*best, options_), frame.time_s, object);
}

std::optional<Fitted> Tracker::best_fit(const DepthFrame& frame, const Object& object,
                                        const Rigidd& expected) {
  std::optional<Fitted> best = fit(frame, object, narrow_attempt(expected), expected);
  const auto done = [&] { return best && convincing(*best, object, options_); };
  const auto better = [&](const Fitted& other) {
    return !best || held_quality(other, options_) > held_quality(*best, options_) + kClearlyBetter;
  };
  if (done() || !(options_.retry_inliers > 0)) return best;
  // Readings of a hand around the object draw a coarse fit to it; without coarse stages they have no say.
  const Rigidd moved = object.motion.predict(object.T_cam_obj, frame.time_s);
  if (std::optional<Fitted> straight =
          fit(frame, object, {0, options_.padding_m, 0, {expected, moved}}, expected)) {
    if (best) prepend(best->steps, &straight->steps);
    if (!best || held_quality(*straight, options_) > held_quality(*best, options_))
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
  query.near = expected;
  query.reach_m = kNextReach_m;
  query.seeds = std::min(options_.recover_seeds, kSearchSeeds);
  std::optional<Found> found =
      finder_.find(frame, camera_, *object.shape, object.memory, colors_of(frame, object), query, &fitter_);
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
  const Matrix6d weak = PosePrior::isotropic(options_.motion_sigma_m, options_.motion_sigma_rad);
  const FitTarget target{*object.shape, expected, object.prior ? *object.prior : weak, object.memory,
                         colors_of(frame, object)};
  return fitter_.fit(frame, camera_, target, attempt, plane_.plane());
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
      attempt.starts.push_back({rotation_exp(sign * kWideTurn * axis) * T.R, T.t});
  return attempt;
}

ObjectResult Tracker::judged(Fitted fitted, const Trust& trust, double time_s, Object* object) const {
  ObjectResult result;
  if (trust.status == Status::kLost) {
    result = without_pose(*object, trust.reason, Status::kLost);
    result.trust.inliers = trust.inliers;
  } else {
    keep(fitted, trust.status, time_s, object);
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

void Tracker::keep(const Fitted& fitted, Status status, double time_s, Object* object) const {
  object->T_cam_obj = fitted.T_cam_obj;
  object->memory = fitted.memory;
  object->weak = status != Status::kOk;
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

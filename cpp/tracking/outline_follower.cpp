// SPDX-License-Identifier: MIT
// An object in frames without depth: followed by its outline in the colour image.
#include <cmath>
#include <numbers>

#include "base/pixel_ray.h"
#include "base/portable_math.h"
#include "frame/region.h"
#include "tracking/object_follower.h"
#include "tracking/trust/silhouette_colors.h"

namespace sdftrack::tracking {

namespace {

constexpr double kAround_px = 40;  // around the silhouette, where the background's colours are counted
constexpr int kFirstBudget = 20000, kBudget = 3000;  // pixels visited for the histograms
constexpr double kOutlineObjectRate = 0.1, kOutlineBackgroundRate = 0.2;
constexpr double kBent_rad = 0.06;  // sd of a pose by depth that bends a whole surface
constexpr double kFar_m = 0.020, kFar_rad = 10 * std::numbers::pi / 180;

double within(double limit, double variance) { return error_function(limit / std::sqrt(2 * variance)); }

// Pixels whose measurement lies near the surface at a pose: a mask of the object that tolerates bent depth.
std::vector<unsigned char> measured_near(const frame::DepthFrame& frame, const Camera& camera,
                                         const frame::Shape& shape, const Rigidd& T_cam_obj) {
  std::vector<unsigned char> mask(std::size_t(camera.width) * camera.height);
  const frame::Rect box = frame::projected_box(camera, shape, T_cam_obj, kDepthBends_m);
  const LensRays rays(camera);
  const Rigidf T_obj_cam = inverse(T_cam_obj).cast<float>();
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t i = std::size_t(y) * camera.width + x;
      const float z = frame.depth_m(x, y);
      if (!(z > 0)) continue;
      float phi = 0;
      Vec3f slope;
      sample(shape.sdf, T_obj_cam * (z * rays.at(x, y).cast<float>()), &phi, &slope);
      mask[i] = std::abs(phi) < float(kDepthBends_m);
    }
  return mask;
}

}  // namespace

void ObjectFollower::learn_silhouette(const FrameContext& context, TrackedObject* object) {
  count_silhouette_colors(context.frame(), context.camera(), *object->shape, object->T_cam_obj, kAround_px,
                          object->colors.known() ? kBudget : kFirstBudget, object->colors, &color_counts_);
  object->colors.update(color_counts_, kOutlineObjectRate, kOutlineBackgroundRate);
  learn_outline(context, object);
}

void ObjectFollower::learn_colors_at_start(const FrameContext& context,
                                           const std::vector<unsigned char>& mask, const Rigidd& T_cam_obj,
                                           TrackedObject* object) {
  object->colors_by_outline = true;
  count_mask_and_ring_colors(
      context.frame(), context.camera(),
      mask.empty() ? measured_near(context.frame(), context.camera(), *object->shape, T_cam_obj) : mask,
      T_cam_obj.t.z, kAround_px, kFirstBudget, &color_counts_);
  object->colors.update(color_counts_, kOutlineObjectRate, kOutlineBackgroundRate);
}

std::optional<Fitted> ObjectFollower::fit_outline(const FrameContext& context, const TrackedObject& object,
                                                  const Rigidd& T_cam_obj) {
  FitTarget target = target_of(context, object, T_cam_obj, nullptr);
  target.prior = optim::PosePrior::isotropic(kDepthBends_m, kBent_rad);
  double share = 0;
  return fitter_.fit_outline(context.frame(), context.camera(), target, &share);
}

std::optional<ObjectResult> ObjectFollower::follow_outline(FrameContext* context, TrackedObject* object) {
  const bool at_start = object->requested && object->requested->T_cam_obj;
  if (!options_.outline || !context->frame().color || !object->placed()) return std::nullopt;
  if (at_start) {
    object->T_cam_obj = centred(*object->requested->T_cam_obj, *object->shape);
    object->requested.reset();
    if (!object->colors.known()) object->colors_by_outline = true, learn_silhouette(*context, object);
  }
  if (!object->colors.known()) return std::nullopt;
  const double time_s = context->frame().time_s;
  const Rigidd expected = expected_pose(*object, time_s);
  double share = 0;
  std::optional<Fitted> fitted = fitter_.fit_outline(context->frame(), context->camera(),
                                                     target_of(*context, *object, expected, nullptr), &share);
  object->prior.reset();
  if (!fitted) {
    object->motion.pass();
    object->weak = true;
    return result_without_pose(*object, {ReasonCode::kLittleOutline}, Status::kLost);
  }
  object->T_cam_obj = fitted->T_cam_obj;
  // The outline's common error hardly changes between frames: its direction is observed all the same.
  object->open =
      OpenDirections(fitted->covariance - fitted->systematic_errors, fitted->T_cam_obj, *object->shape);
  object->memory = fitted->memory;
  object->observe_motion(time_s);
  object->weak = true;
  object->hidden_frames = 0;
  // The background moves: its colours from the last frame with depth soon become outdated.
  if (object->colors_by_outline)
    learn_silhouette(*context, object);
  else
    learn_outline(*context, object);
  ObjectResult result;
  result.T_cam_obj = uncentred(fitted->T_cam_obj, *object->shape);
  result.covariance = fitted->covariance;
  result.runner_up = kUnknown;
  result.color_used = true;
  result.cost = fitted->cost;
  result.steps = std::move(fitted->steps);
  result.trust.status = Status::kWeak;
  result.trust.reason = {ReasonCode::kByOutline};
  result.trust.inliers = share;
  result.trust.confidence = share * within(kFar_m, result.covariance.diagonal().head<3>().maxCoeff()) *
                            within(kFar_rad, result.covariance.diagonal().tail<3>().maxCoeff());
  return result;
}

}  // namespace sdftrack::tracking

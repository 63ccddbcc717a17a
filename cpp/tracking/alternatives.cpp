// SPDX-License-Identifier: MIT
#include "tracking/alternatives.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr double kSharedPx = 100;  // pixels that share one error, until measured (docs/trust.md)
// Log odds. Values below the first count as 0, for errors of a sensor last for many frames; one frame counts
// at most the second; the third decides.
constexpr double kSilent = 1, kPerFrame = 3, kDecided = 6;
constexpr double kHidden = 0.5;      // of the expected surface: beyond it the occluder decides the residuals
constexpr double kTurnReach = 0.25;  // of the diameter, between the centres: it has turned, not moved away
constexpr double kWorthAFit = 0.4;   // share of the score of the pose that a search has found
constexpr double kLeastChance = 1e-6;
// Of the diameter, root mean square distance between a surface and the same surface after a motion. Below
// this, where depth misfits, neither depth nor the outline can tell the two apart, and they are equivalent.
constexpr double kSameSurface = 0.01;

double log_odds(double chance) {
  const double p = std::clamp(chance, kLeastChance, 1 - kLeastChance);
  return std::log(p / (1 - p));
}

double mean_cost(const Fitted& f) {
  if (f.steps.empty() || f.steps.back().pixels <= 0) return f.cost;
  return f.steps.back().step.cost / f.steps.back().pixels;
}

int pixel_count(const Fitted& f) { return f.steps.empty() ? 0 : f.steps.back().pixels; }

double by_evidence(const Fitted& fitted, const Fitted& other, const TrackerOptions& options) {
  return log_odds(evidence_share(evidence_of(fitted, options), 0)) -
         log_odds(evidence_share(evidence_of(other, options), 0));
}

double by_cost(const Fitted& fitted, const Fitted& other, double shared_px) {
  return (mean_cost(other) - mean_cost(fitted)) * std::min(pixel_count(fitted), pixel_count(other)) /
         shared_px;
}

bool is_hidden(const Fitted& f) { return f.seen.nearer > kHidden * f.seen.expected; }

// The log odds of one frame. Residuals decide where the evidence is equal for both fits; a largely hidden fit
// does not count, as residuals at the edge of an occluder are those of another surface.
double weighed(const Fitted& fitted, const Fitted& other, const TrackerOptions& options, double shared_px) {
  if (is_hidden(fitted) || is_hidden(other)) return 0;
  constexpr double kByCost = kSilent + kPerFrame;
  const double odds =
      by_evidence(fitted, other, options) + std::clamp(by_cost(fitted, other, shared_px), -kByCost, kByCost);
  return std::copysign(std::clamp(std::abs(odds) - kSilent, 0.0, kPerFrame), odds);
}

double shared_px(const TrackedObject& object) {
  const double measured_px = object.memory.correlation_area_px;
  return measured_px > 0 ? measured_px : kSharedPx;
}

// The object's pose after half turns about its principal axes: most things look alike from two sides.
std::vector<Rigidd> half_turned(const TrackedObject& object) {
  const frame::Moments& m = object.shape->moments;
  const Eigen::Vector3d mean(m.mean.x, m.mean.y, m.mean.z);
  const optim::Eigenpairs<3> axes =
      optim::eigenpairs(Eigen::Matrix3d(square_of(m) - mean * mean.transpose()));
  std::vector<Rigidd> all;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d a = std::numbers::pi * axes.vectors.col(i);
    const Mat3d R = rotation_exp(Vec3d{a.x(), a.y(), a.z()});
    all.push_back(object.T_cam_obj * Rigidd{R, m.mean - R * m.mean});
  }
  return all;
}

// The poses that a search finds at the object's place.
std::vector<Rigidd> found_there(FrameContext* context, ObjectFollower* follower,
                                const TrackedObject& object) {
  SearchQuery query;
  query.near = object.T_cam_obj;
  query.reach_m = kTurnReach * object.shape->diameter_m;
  query.alike = kWorthAFit;
  const std::optional<Found> found = follower->search(context, context->frame(), object, query, 0);
  if (!found) return {};
  std::vector<Rigidd> all{found->fitted.T_cam_obj};
  for (const Rigidd& motion : found->alternatives) all.push_back(found->fitted.T_cam_obj * motion);
  return all;
}

// Adds as alternatives those poses at the object's place that explain the frame about as well.
void add_alternatives(const FrameContext& context, ObjectFollower* follower, const std::vector<Rigidd>& poses,
                      TrackedObject* object) {
  const Rigidd T = object->T_cam_obj;
  std::optional<Fitted> own;
  for (const Rigidd& there : poses) {
    if (!looks_distinct(there, T, &object->symmetries)) continue;
    if (!own && !(own = follower->fit_finely(context, *object, T))) return;
    std::optional<Fitted> other = follower->fit_finely(context, *object, there);
    if (!other) continue;
    const auto same = [&](const Alternative& a) { return !distinct(T * a.motion, other->T_cam_obj); };
    if (looks_distinct(other->T_cam_obj, own->T_cam_obj, &object->symmetries) &&
        norm(other->T_cam_obj.t - T.t) < kTurnReach * object->shape->diameter_m &&
        std::none_of(object->alternatives.begin(), object->alternatives.end(), same) &&
        log_odds_between(*own, *other, follower->options(), shared_px(*object)) < kDecided)
      object->alternatives.push_back({inverse(T) * other->T_cam_obj, 0});
    follower->give_back(std::move(other->steps));
  }
  if (own) follower->give_back(std::move(own->steps));
}

// Root mean square distance of the moved surface from the original.
double moved_apart_m(const frame::Shape& shape, const Rigidd& motion) {
  const Rigidf moved = motion.cast<float>();
  double square = 0;
  for (const Vec3f& p : shape.points) {
    float phi = 0;
    Vec3f slope;
    sample(shape.sdf, moved * p, &phi, &slope);
    square += double(phi) * double(phi);
  }
  return shape.points.empty() ? 0 : std::sqrt(square / double(shape.points.size()));
}

bool is_same_surface(const frame::Shape& shape, const Rigidd& motion) {
  return moved_apart_m(shape, motion) < kSameSurface * shape.diameter_m;
}

// The log odds of a fit to the outline against another fit.
double outline_odds(const Fitted& fitted, const Fitted& other) {
  const OutlineNoise& noise = fitted.memory.outline;
  return (other.cost - fitted.cost) * pixel_count(fitted) /
         (noise.factor * noise.factor * std::max(1.0, noise.shared_lines));
}

void exchange(std::size_t i, TrackedObject* object) {
  const Rigidd back = inverse(object->alternatives[i].motion);
  for (Alternative& a : object->alternatives) {
    a.motion = back * a.motion;
    a.log_odds = 0;
  }
  object->alternatives[i].motion = back;
  object->motion.reset();
}

}  // namespace

double log_odds_between(const Fitted& fitted, const Fitted& other, const TrackerOptions& options,
                        double shared_px) {
  return by_evidence(fitted, other, options) + by_cost(fitted, other, shared_px);
}

void look_for_turns(FrameContext* context, ObjectFollower* follower, TrackedObject* object) {
  object->alternatives.clear();
  std::vector<Rigidd> all = half_turned(*object);
  const std::vector<Rigidd> found = found_there(context, follower, *object);
  all.insert(all.end(), found.begin(), found.end());
  add_alternatives(*context, follower, all, object);
  // The side that is visible now may be one that has not been seen yet.
  if (object->shape->seen.amount) object->unproven_frames = kProvingFrames;
}

void doubt_half_turns(const FrameContext& context, ObjectFollower* follower, TrackedObject* object) {
  add_alternatives(context, follower, half_turned(*object), object);
}

Rigidd pose_by_outline(const FrameContext& context, ObjectFollower* follower,
                       const std::vector<unsigned char>& mask, const Rigidd& T_cam_obj,
                       TrackedObject* object) {
  follower->learn_colors_at_start(context, mask, T_cam_obj, object);
  std::optional<Fitted> best = follower->fit_outline(context, *object, T_cam_obj);
  if (!best) return T_cam_obj;
  std::vector<Fitted> others;
  for (const Alternative& a : object->alternatives) {
    std::optional<Fitted> other = follower->fit_outline(context, *object, T_cam_obj * a.motion);
    if (!other) continue;
    if (!mask.empty() && other->cost < best->cost) std::swap(*best, *other);
    others.push_back(std::move(*other));
  }
  object->alternatives.clear();
  for (const Fitted& other : others) {
    const Rigidd motion = inverse(best->T_cam_obj) * other.T_cam_obj;
    if ((mask.empty() || outline_odds(*best, other) < kDecided) && !is_same_surface(*object->shape, motion))
      object->alternatives.push_back({motion, 0});
  }
  object->memory.outline = best->memory.outline;
  object->memory.outline.depth_excess = kMaxExcess;
  object->memory.outline.apart_m = kDepthBends_m;
  return best->T_cam_obj;
}

void compare_alternatives(FrameContext* context, ObjectFollower* follower, TrackedObject* object,
                          ObjectResult* result) {
  std::vector<Alternative>& all = object->alternatives;
  if (all.empty() || !is_followed(result->trust.status) || is_frame_fault(context->fault())) return;
  if (object->by_mask_alone) return;  // depth that misfits cannot tell two poses apart
  const Rigidd T = object->T_cam_obj;
  std::optional<Fitted> own = follower->fit_finely(*context, *object, T);
  if (!own) return;
  const TrackerOptions& options = follower->options();
  for (std::size_t i = 0; i < all.size();) {
    std::optional<Fitted> other = follower->fit_finely(*context, *object, T * all[i].motion);
    // The alternative converged to the object's own pose, or into another object, for which it was mistaken.
    const bool gone = !other || !distinct(other->T_cam_obj, own->T_cam_obj) ||
                      stands_in(context->neighbors_of(*object), *object->shape, other->T_cam_obj);
    if (!gone) all[i].log_odds += weighed(*own, *other, options, shared_px(*object));
    if (!gone && all[i].log_odds < -kDecided) {
      const Trust trust = judge(*other, options, object->prior_log_odds);
      if (trust.status != Status::kLost) {
        exchange(i, object);
        *result = follower->accept(std::move(*other), trust, *context, object);
        break;
      }
    }
    if (other) follower->give_back(std::move(other->steps));
    if (gone || all[i].log_odds > kDecided)
      all.erase(all.begin() + std::ptrdiff_t(i));
    else
      ++i;
  }
  follower->give_back(std::move(own->steps));
}

void doubt_ambiguous(const TrackedObject& object, ObjectResult* result) {
  if (object.alternatives.empty() || result->trust.status != Status::kOk) return;
  result->trust.status = Status::kWeak;
  result->trust.reason = {ReasonCode::kAmbiguous};
  result->trust.confidence /= double(object.alternatives.size() + 1);
}

void doubt_unproven(TrackedObject* object, ObjectResult* result) {
  if (object->unproven_frames == 0) return;
  if (result->trust.status != Status::kOk) {
    object->unproven_frames = kProvingFrames;
    return;
  }
  --object->unproven_frames;
  result->trust.status = Status::kWeak;
  result->trust.reason = {ReasonCode::kFoundAgain};
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/verdict.h"

#include <cmath>
#include <utility>

#include "base/to_int.h"
#include "optim/camera_increment.h"

namespace sdftrack::tracking {

namespace {

constexpr double kLikely = 0.5, kClearlyLikely = 0.75;  // probabilities
constexpr Vec3d kNowhere{kUnknown, kUnknown, kUnknown};
constexpr Rigidd kNoPose{{kNowhere, kNowhere, kNowhere}, kNowhere};

void doubt_overlap(int other, ObjectResult* result) {
  const ReasonCode code = result->trust.reason.code;
  if (code == ReasonCode::kOverlaps || code == ReasonCode::kSamePlace) return;
  result->trust.status = Status::kWeak;
  result->trust.reason = reason_about(ReasonCode::kOverlaps, other);
  result->trust.confidence *= 0.5;
}

}  // namespace

void doubt_overlaps(const std::vector<TrackedObject>& objects, std::vector<ObjectResult>* results) {
  const auto followed = [&](std::size_t k) { return is_followed((*results)[k].trust.status); };
  for (std::size_t k = 0; objects.size() > 1 && k < objects.size(); ++k) {
    if (!followed(k)) continue;
    const energies::SingleObject<float> field = field_of(*objects[k].shape, objects[k].T_cam_obj);
    for (std::size_t j = 0; j < objects.size(); ++j) {
      if (j == k || !followed(j) || !middle_in(field, *objects[j].shape, objects[j].T_cam_obj)) continue;
      doubt_overlap(int(j), &(*results)[k]);
      doubt_overlap(int(k), &(*results)[j]);
    }
  }
}

void mark_unfound(const TrackedObject& object, ObjectResult* result) {
  if (object.unfound.empty() || result->trust.status == Status::kBadFrame) return;
  result->trust = {
      Status::kLost, {ReasonCode::kPrimitiveNotFound, 0, -1, object.unfound}, 0, result->trust.evidence, 0};
  result->covariance.setConstant(kUnknown);
  result->unstated.setZero();
  result->runner_up = kUnknown;
}

void doubt_size(const TrackedObject& object, ObjectResult* result) {
  Trust& trust = result->trust;
  const bool ok = trust.status == Status::kOk;
  if (object.free_scale && !object.size.determines_scale()) {
    if (ok) trust.status = Status::kWeak, trust.reason = {ReasonCode::kFreeScale};
    return;
  }
  // The size may explain the reported reason of a poor fit.
  if (!ok && trust.reason.code != ReasonCode::kPoorFit && trust.reason.code != ReasonCode::kSeenPast &&
      trust.reason.code != ReasonCode::kRunsOn)
    return;
  ReasonCode code = ReasonCode::kOtherForm;
  std::string which = object.primitive ? "" : object.size.other_form();  // a primitive's sizes are fitted
  if (which.empty() && !object.free_scale) code = ReasonCode::kOtherSize, which = object.size.other_size();
  if (which.empty()) return;
  trust.reason = {code, 0, -1, std::move(which), trust.reason.frame};
  if (!ok) return;
  trust.status = Status::kWeak;
  trust.confidence *= 0.5;
}

void doubt_unlikely(TrackedObject* object, ObjectResult* result) {
  Trust& trust = result->trust;
  object->unlikely = trust.evidence < (object->unlikely ? kClearlyLikely : kLikely);
  if (trust.status != Status::kOk || !object->open.empty()) return;
  if (!object->unlikely && trust.confidence >= kLikely) return;
  trust.status = Status::kWeak;
  trust.reason = reason_with_percent(ReasonCode::kUnlikely, to_int(std::round(100 * trust.confidence)));
}

void doubt_open_directions(const TrackedObject& object, ObjectResult* result) {
  const bool just_now = object.shape->seen.amount && object.determined_frames < kDeterminedFrames;
  if ((object.open.empty() && !just_now) || result->trust.status != Status::kOk) return;
  std::string which =
      object.open.empty()
          ? "what was not observed a moment ago is observed, but for too short a time"
          : object.open.unexplained(object.symmetries, object.primitive && !object.shape->slips.empty());
  if (which.empty()) return;
  result->trust.status = Status::kWeak;
  result->trust.reason = {ReasonCode::kOpenDirections, 0, -1, std::move(which)};
}

void report_nearest(TrackedObject* object, ObjectResult* result) {
  if (object->symmetry.empty()) return;
  if (!is_followed(result->trust.status)) {
    if (object->reported) result->T_cam_obj = *object->reported;
    return;
  }
  const Mat3d R_near = object->reported ? object->reported->R : Mat3d::identity();
  const Rigidd nearest = object->symmetry.canonical(result->T_cam_obj, R_near);
  const Vec3d d = nearest.t - result->T_cam_obj.t;
  // To the other origin: its velocity is v + w x d.
  const Matrix6d to_origin = -optim::camera_by_increment(Rigidd{}, d);
  for (Matrix6d* covariance : {&result->covariance, &result->unstated})
    *covariance = (to_origin * *covariance * to_origin.transpose()).eval();
  Eigen::Map<Eigen::Matrix<double, 6, 1>> twist(result->twist.data());
  twist = (to_origin * twist).eval();
  result->T_cam_obj = nearest;
  object->reported = nearest;
}

Twist twist_between(const Rigidd& before, const Rigidd& now, double elapsed_s) {
  const Vec3d v = (1 / elapsed_s) * (now.t - before.t);
  const Vec3d w = (1 / elapsed_s) * rotation_log(now.R * transpose(before.R));
  return {v.x, v.y, v.z, w.x, w.y, w.z};
}

void Verdict::start(Poses best) {
  best_ = std::move(best);
  result_.index = 0;
  interrupt();
}

void Verdict::resume(int index, double time_s, const std::vector<bool>& followed, Poses best) {
  result_.index = index, result_.time_s = time_s;
  followed_ = followed;
  best_ = std::move(best);
  last_ = followed_.size() == best_.size() ? Last::kResumed : Last::kNone;
}

void Verdict::add(const std::optional<Rigidd>& pose) {
  best_.push_back(pose);
  interrupt();
}

void Verdict::remove(std::size_t k) {
  best_.erase(best_.begin() + std::ptrdiff_t(k));
  interrupt();
}

void Verdict::conclude(std::vector<TrackedObject>* all, const std::vector<int>& served, double time_s,
                       std::vector<ObjectResult>* latest) {
  std::vector<TrackedObject>& objects = *all;
  std::vector<ObjectResult>& results = result_.objects;
  const double elapsed_s = last_ == Last::kNone ? kUnknown : time_s - result_.time_s;
  if (last_ == Last::kNone) followed_.assign(objects.size(), false);
  results.resize(objects.size());
  for (std::size_t i = 0; i < served.size(); ++i) std::swap(results[served[i]], (*latest)[i]);
  for (std::size_t k = 0; k < objects.size(); ++k) mark_unfound(objects[k], &results[k]);
  doubt_overlaps(objects, &results);
  for (ObjectResult& result : results) result.twist.fill(kUnknown);
  for (const int index : served) {
    const auto k = std::size_t(index);
    ObjectResult& result = results[k];
    const bool followed = is_followed(result.trust.status);
    if (!followed) result.T_cam_obj = best_[k] ? *best_[k] : kNoPose;
    if (elapsed_s > 0 && followed && followed_[k] && best_[k])
      result.twist = twist_between(*best_[k], result.T_cam_obj, elapsed_s);
    if (followed) best_[k] = result.T_cam_obj;
    followed_[k] = followed;
    report_nearest(&objects[k], &result);
  }
  result_.time_s = time_s;
  last_ = Last::kKnown;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "tracking/alternatives.h"
#include "tracking/identity.h"
#include "tracking/options/option_schema.h"
#include "tracking/trust/lost_place.h"

namespace sdftrack::tracking {

Tracker::Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
                 const TrackerSettings& settings)
    : options_(check_options(options)),
      settings_(settings),
      context_(camera, options),
      follower_(options, settings),
      groups_(options, settings, &follower_),
      recovery_(options, &follower_),
      membership_(options) {
  for (const SdfView& sdf : shapes) {
    objects_.push_back(new_object(shape_of(sdf)));
    verdict_.add(std::nullopt);
  }
}

frame::DepthFrame Tracker::make_frame(const ImageView<float>& depth_m, const unsigned char* mask,
                                      double time_s, const appearance::ColorImage* color) const {
  return {depth_m, mask, context_.rays(), time_s, color};
}

frame::DepthFrame Tracker::make_unreadable_frame(std::string_view error, double time_s,
                                                 const appearance::ColorImage* color) const {
  return {{nullptr, camera().width, camera().height}, nullptr, context_.rays(), time_s, color, error};
}

const FrameResult& Tracker::start(const frame::DepthFrame& frame, const std::vector<PoseHint>& hints) {
  if (hints.size() != objects_.size())
    throw std::invalid_argument("poses: expected one per shape (" + std::to_string(objects_.size()) +
                                "), got " + std::to_string(hints.size()));
  context_.forget_plane();
  context_.forget_sequence();
  Poses best;
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    objects_[k].forget(options_);
    objects_[k].colors.forget(), objects_[k].outline_colors.forget();
    objects_[k].colors_by_outline = false, objects_[k].color_delay.forget();
    const std::optional<Rigidd>& pose = hints[k].T_cam_obj;  // the search for the plane leaves its region out
    objects_[k].T_cam_obj = pose ? centred(*pose, *objects_[k].shape) : Rigidd{};
    objects_[k].requested = hints[k];
    objects_[k].reported = pose;
    best.push_back(pose);
  }
  verdict_.start(std::move(best));
  context_.open_next(frame, objects_);
  process_all();
  return finish_frame(frame);
}

const FrameResult& Tracker::track(const frame::DepthFrame& frame) {
  for (int k = 0; k < object_count() && verdict_.has_result(); ++k)
    if (is_followed(verdict_.result().objects[k].trust.status)) adjust_scale(k);
  verdict_.next_frame();
  context_.open_next(frame, objects_);
  process_all();
  return finish_frame(frame);
}

const std::vector<ObjectResult>& Tracker::revisit(const frame::DepthFrame& frame) {
  context_.open(frame, objects_);
  process_all();
  return results_;
}

const FrameResult& Tracker::recover(const frame::DepthFrame& frame, const std::vector<int>& objects,
                                    const std::vector<PoseHint>& hints) {
  if (!verdict_.has_result() && objects.size() < objects_.size())
    throw std::runtime_error(
        "recover: call track(frame) first; the poses of the other objects in the last frame are unknown");
  requested_ = objects;
  context_.open(frame, objects_);
  process_each([&](std::size_t i, Object* object) {
    object->forget(options_);
    return begin_at(object, hints.at(i));
  });
  return finish_frame(frame);
}

const FrameResult& Tracker::finish_frame(const frame::DepthFrame& frame) {
  verdict_.conclude(&objects_, requested_, frame.time_s, &results_);
  return verdict_.result();
}

// Follows or searches for all objects; groups are fitted jointly.
void Tracker::process_all() {
  requested_.resize(objects_.size());
  std::iota(requested_.begin(), requested_.end(), 0);
  if (objects_.size() > 1) groups_.fit(&context_, objects_);
  process_each([&](std::size_t, Object* object) { return track_one(object); });
}

template <class Work>
void Tracker::process_each(const Work& work) {
  const bool readable = context_.readable();
  if (readable && options_.drop_plane) context_.follow_plane();
  for (ObjectResult& old : results_) follower_.give_back(std::move(old.steps));
  results_.resize(requested_.size());
  // First the objects at known places, so that a search for the others leaves their measurements out.
  order_.clear();
  for (const bool placed : {true, false})
    for (std::size_t i = 0; i < requested_.size(); ++i)
      if (object(requested_[i]).placed() == placed) order_.push_back(i);
  for (const std::size_t i : order_) {
    Object& one = object(requested_[i]);
    const Rigidd before = one.T_cam_obj;
    if (!readable) {
      std::optional<ObjectResult> seen = follower_.follow_outline(&context_, &one);
      results_[i] = seen ? std::move(*seen) : unread(&one);
      explain_loss(one, &results_[i]);
      refuse_if_not_finite(before, &one, &results_[i]);
      continue;
    }
    const bool color_used = context_.colors_of(one) != nullptr;
    results_[i] = work(i, &one);
    explain_loss(one, &results_[i]);
    refuse_if_not_finite(before, &one, &results_[i]);
    results_[i].color_used = color_used;
    if (results_[i].trust.status == Status::kOk) follower_.learn_colors(&context_, &one);
  }
  // Then the searches, once all followed objects have their poses.
  for (const std::size_t i : order_) {
    Object& one = object(requested_[i]);
    if (!std::exchange(one.to_search, false)) continue;
    const Rigidd before = one.T_cam_obj;
    results_[i] = recovery_.find_lost(&context_, &one, std::move(results_[i]));
    refuse_if_not_finite(before, &one, &results_[i]);
  }
  if (readable && objects_.size() > 1) assign_finds(requested_, &objects_, &results_);
  for (std::size_t i = 0; i < requested_.size(); ++i)
    if (object(requested_[i]).doubtful_frames > 0) doubt_identity(&object(requested_[i]), &results_[i]);
  for (std::size_t i = 0; i < requested_.size(); ++i) {
    doubt_ambiguous(object(requested_[i]), &results_[i]);
    doubt_size(object(requested_[i]), &results_[i]);
    doubt_open_directions(object(requested_[i]), &results_[i]);
    if (follower_.options().weak_evidence > 0)  // the thesis' tracker is not judged
      doubt_unlikely(&object(requested_[i]), &results_[i]);
    doubt_unproven(&object(requested_[i]), &results_[i]);
  }
  for (ObjectResult& result : results_)
    doubt_frame(context_.fault(), &result.trust.status, &result.trust.reason, &result.trust.confidence);
}

// An invalid volume can drive a fit to NaN. before: the object's pose before this frame.
void Tracker::refuse_if_not_finite(const Rigidd& before, Object* object, ObjectResult* result) const {
  if (!is_followed(result->trust.status) || is_finite(*result)) return;
  object->forget(options_);
  object->T_cam_obj = before, object->lost_frames = 1;
  std::vector<TrackStep> steps = std::move(result->steps);
  *result = result_without_pose(*object, {ReasonCode::kNotFinite}, Status::kLost);
  result->steps = std::move(steps);
}

void Tracker::explain_loss(const TrackedObject& object, ObjectResult* result) const {
  if (is_followed(result->trust.status)) return;
  result->trust.reason = lost_at(object.T_cam_obj, *object.shape, camera(), context_.frame().depth_m,
                                 std::move(result->trust.reason));
}

ObjectResult Tracker::unread(Object* object) const {
  // A place to start at is kept for the next frame; a pose is already a start.
  if (object->requested && object->requested->T_cam_obj)
    object->T_cam_obj = centred(*object->requested->T_cam_obj, *object->shape), object->requested.reset();
  const frame::DepthFrame& frame = context_.frame();
  Reason reason{ReasonCode::kNoReading};
  if (!frame.depth_m.data && frame.error.empty()) reason = {ReasonCode::kNoDepthImage};
  if (!frame.depth_m.data && !frame.error.empty())
    reason = {ReasonCode::kUnreadable, 0, -1, std::string(frame.error)};
  return result_without_pose(*object, std::move(reason), Status::kBadFrame);
}

ObjectResult Tracker::track_one(Object* object) {
  if (object->requested) {
    const PoseHint hint = std::move(*object->requested);
    object->requested.reset();
    return begin_at(object, hint);
  }
  const int away = object->lost_frames;
  ObjectResult result = follow(object);
  if (object->before_found) result = recovery_.confirm(std::move(result), object);
  if (result.trust.status != Status::kLost) {
    object->lost_frames = 0;
    if (away >= kCouldTurn && is_followed(result.trust.status)) look_for_turns(&context_, &follower_, object);
    compare_alternatives(&context_, &follower_, object, &result);
    return doubt_mask(*object, std::move(result));
  }
  ++object->lost_frames;
  object->motion.reset();
  object->to_search = settings_.recover;
  return result;
}

ObjectResult Tracker::begin_at(Object* object, const PoseHint& hint) {
  if (hint.T_cam_obj) return begin_at_pose(object, centred(*hint.T_cam_obj, *object->shape));
  std::optional<Rigidd> off_by_residuals;
  ObjectResult found = recovery_.find(&context_, hint, object, &off_by_residuals);
  if (!off_by_residuals) return found;
  // The caller states that the object is there, and its outline agrees: a depth error larger than stated is
  // the likelier explanation of the frame.
  object->lost_frames = 0;
  if (options_.outline && context_.frame().color && !object->colors.known())
    off_by_residuals = pose_by_outline(context_, &follower_, hint.mask, *off_by_residuals, object);
  ObjectResult believed = begin_at_pose(object, *off_by_residuals);
  believed.runner_up = found.runner_up;
  prepend(found.steps, &believed.steps);
  object->by_mask_alone = true;
  return doubt_mask(*object, std::move(believed));
}

// Another object of about that size would have such residuals too: the object stays in doubt unless its
// outline fits the model.
ObjectResult Tracker::doubt_mask(const Object& object, ObjectResult result) const {
  if (!object.by_mask_alone || result.trust.status != Status::kOk || object.size.outline_agrees())
    return result;
  result.trust.status = Status::kWeak, result.trust.reason = {ReasonCode::kPoorFit};
  result.trust.confidence = std::min(result.trust.confidence, options_.weak_evidence);
  return result;
}

ObjectResult Tracker::begin_at_pose(Object* object, const Rigidd& T_cam_obj) {
  object->T_cam_obj = T_cam_obj;
  object->memory.learns_systematic = true;
  object->given = true;
  // Biased depth would turn the object away from the given pose before its colours are learnt.
  if (options_.outline && context_.frame().color && !object->colors.known())
    object->colors_by_outline = true, follower_.learn_silhouette(context_, object);
  return follow(object);
}

ObjectResult Tracker::follow(Object* object) {
  if (JointFitted* const joint = context_.together_of(*object))
    return groups_.accept(joint, context_, object);
  return follower_.follow(&context_, object);
}

void Tracker::add_to_reason(int k, const std::string& more) {
  std::string& text = verdict_.result().objects.at(std::size_t(k)).trust.reason.more;
  text += (text.empty() ? "" : "; ") + more;
}

void Tracker::doubt_standing() {
  Trust& trust = verdict_.result().objects.front().trust;
  if (trust.status == Status::kLost) return;
  trust.status = Status::kWeak;
  trust.confidence *= 0.5;
  if (trust.reason.empty()) trust.reason.code = ReasonCode::kFoundStanding;
}

std::optional<Fitted> Tracker::look(const frame::DepthFrame& frame, int k, const Rigidd& T_cam_obj) {
  if (!frame.depth_m.data) return std::nullopt;  // an unreadable frame
  return follower_.look(frame, camera(), shape(k), T_cam_obj);
}

ColorDelay::Estimate Tracker::color_delay() const {
  double sum = 0, weights = 0;
  int frames = 0;
  for (const Object& object : objects_) {
    const ColorDelay::Estimate one = object.color_delay.estimate();
    if (one.frames == 0) continue;
    const double weight = 1 / (one.sd_s * one.sd_s);
    sum += weight * one.delay_s, weights += weight, frames = std::max(frames, one.frames);
  }
  return weights > 0 ? ColorDelay::Estimate{sum / weights, 1 / std::sqrt(weights), frames}
                     : ColorDelay::Estimate{};
}

void Tracker::find_membership(const frame::DepthFrame& frame, float* membership, float* foreground) {
  context_.open(frame, objects_);
  membership_.find(context_, objects_, membership, foreground);
}

void Tracker::find_foreground(const frame::DepthFrame& frame, int k, const frame::Rect& box,
                              std::vector<float>* foreground) {
  context_.open(frame, objects_);
  membership_.find_foreground(context_, object(k), box, foreground);
}

}  // namespace sdftrack::tracking

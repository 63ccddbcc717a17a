// SPDX-License-Identifier: MIT
// How a tracker finds again what it has lost.
#include <algorithm>
#include <cmath>

#include "tracking/tracker.h"

namespace sdftrack {

namespace {

// An object that was just lost is looked for around its last pose, ever farther away as a hand may have
// carried it; later, in turns, there and everywhere.
constexpr double kReach_m = 0.10, kReachPerFrame_m = 0.05, kFarthest_m = 0.5;
constexpr int kNearFrames = 3;

// What a search finds is believed only when it is sure of it.
constexpr double kSure = 0.5;

constexpr float kExplained_m = 0.006;  // readings this near to another object's surface are its own

}  // namespace

// What was found again in the last frame must hold in this one too: a look-alike seldom holds its ground in
// two frames, and a wrong recovery is worse than a late one.
ObjectResult Tracker::confirmed(ObjectResult result, Object* object) {
  if (!object->before_found) return result;
  if (result.trust.status == Status::kOk) {
    object->before_found.reset();
    return result;
  }
  object->T_cam_obj = *object->before_found;
  object->before_found.reset();
  ObjectResult gone = without_pose(*object, "what seemed to be the object was not confirmed", Status::kLost);
  gone.steps = std::move(result.steps);
  return gone;
}

// The fields of the objects that are followed surely, where they are in this frame if that is known.
const Others* Tracker::others_than(const Object& object) {
  others_.clear();
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    const Object& other = objects_[k];
    if (&other == &object) continue;
    const JointFitted* const now = k < together_.size() && together_[k] ? &*together_[k] : nullptr;
    const bool sure =
        now ? !now->hidden && convincing(now->fitted, other, options_) : other.holds_its_place();
    if (!sure) continue;
    others_.push_back(field_of(*other.shape, now ? now->fitted.T_cam_obj : other.T_cam_obj));
  }
  return &others_;
}

// Marks the readings on an object's surface as taken.
void Tracker::mark_explained(const DepthFrame& frame, const Shape& shape, const Rigidd& T_cam_obj) {
  const Intrinsics<float> K = camera_.K.cast<float>();
  const IdealPixel ideal{frame, K, camera_.width};
  const Rect box = projected_box(camera_, shape, T_cam_obj, 0);
  const SingleObject<float> field = field_of(shape, T_cam_obj);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) {
      const float z = frame.depth_m(x, y);
      if (!(z > 0)) continue;
      const Vec2f u = ideal(x, y);
      float phi;
      Vec3f unused;
      field.value(z * ray(K, u.x, u.y), &phi, &unused);
      if (std::abs(phi) < kExplained_m)
        taken_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
               static_cast<std::size_t>(x)] = 1;
    }
}

// Pixels that the other objects explain where they are followed; nullptr: none.
const unsigned char* Tracker::taken_by_others(const DepthFrame& frame, const Object& object) {
  bool any = false;
  for (const Object& other : objects_) {
    if (&other == &object || !other.holds_its_place()) continue;
    if (!any) taken_.assign(static_cast<std::size_t>(camera_.width) * camera_.height, 0);
    any = true;
    mark_explained(frame, *other.shape, other.T_cam_obj);
  }
  return any ? taken_.data() : nullptr;
}

// The frame without the readings that others explain: a fit would be drawn to them.
DepthFrame Tracker::not_taken(const DepthFrame& frame, const unsigned char* taken) {
  if (!taken) return frame;
  const std::size_t pixels =
      static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
  free_.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) free_[i] = !taken[i] && (!frame.mask || frame.mask[i]);
  DepthFrame alone = frame;
  alone.mask = free_.data();
  return alone;
}

ObjectResult Tracker::look_for(const DepthFrame& frame, Object* object, ObjectResult lost) {
  const int n = object->lost_frames;
  SearchQuery query;
  query.plane = plane_.plane();
  query.taken = taken_by_others(frame, *object);
  query.others = others_than(*object);
  if (n <= kNearFrames || n % 2 == 0) {
    query.near = object->T_cam_obj;
    query.reach_m = std::min(kFarthest_m, kReach_m + kReachPerFrame_m * n);
  }
  if (options_.recover_seeds < kSearchSeeds) {
    query.seeds = options_.recover_seeds;
    query.first_seed = (n - 1) * options_.recover_seeds % kSearchSeeds;
  }
  std::optional<Found> found =
      finder_.find(not_taken(frame, query.taken), camera_, *object->shape, object->memory,
                   colors_of(frame, *object), query, std::log(options_.search_odds), &fitter_);
  if (!found || found->trust.status != Status::kOk || found->trust.confidence < kSure) return lost;

  const Rigidd last = object->T_cam_obj;
  ObjectResult result = judged(std::move(found->fitted), found->trust, frame.time_s, object);
  result.runner_up = found->runner_up;
  result.trust.status = Status::kWeak;
  result.trust.reason = "found again; the next frame must confirm it";
  prepend(lost.steps, &result.steps);
  object->before_found = last;
  object->prior_log_odds = std::log(options_.search_odds);
  object->lost_frames = 0;
  return result;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "tracking/recovery.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tracking/alternatives.h"

namespace sdftrack::tracking {

namespace {

// A recently lost object is searched for around its last pose, over a growing distance as a hand may have
// carried it; later, alternately, there and everywhere.
constexpr double kReach_m = 0.10, kReachPerFrame_m = 0.05, kFarthest_m = 0.5;
constexpr int kNearFrames = 3;
// Sd of its turn since then.
constexpr double kTurn_rad = 0.5, kTurnPerFrame_rad = 0.15;

// The result of a search is accepted only when the search is sure of it.
constexpr double kSure = 0.5;
constexpr double kBarely = 0.1;  // confidence below which a start anywhere is not accepted
// It is on trial for at most so many frames: as long as only the search's own odds are against it.
constexpr int kTrialFrames = 5;

// An occluder hides its last place, so the object is likely still there: a find elsewhere must be more
// convincing (log odds).
constexpr double kHides = 0.5, kStillThere = 3;  // kHides: share of the expected surface

bool may_still_be_there(const FrameContext& context, const TrackedObject& object, const Rigidd& found,
                        const TrackerOptions& options) {
  if (norm(found.t - object.T_cam_obj.t) < 0.5 * object.shape->diameter_m) return false;
  const Visibility seen =
      compare_visible_surface(context.frame(), context.camera(), *object.shape, object.T_cam_obj,
                              DepthError{options.noise_m}, kTrustPoints);
  return seen.nearer > kHides * seen.expected;
}

// Whether the evidence of the frame alone supports the pose.
bool speaks_for(const Trust& trust, double prior_log_odds) {
  return trust.evidence > (1 - trust.evidence) * std::exp(prior_log_odds);
}

// Whether the residuals alone may contradict the pose.
bool misfits(const Trust& trust) {
  return trust.status == Status::kLost ||
         (trust.status == Status::kWeak && trust.reason.code == ReasonCode::kPoorFit);
}

// Only pixels in the mask count, if there is one.
bool has_reading(const ImageView<float>& depth_m, const std::vector<unsigned char>& mask) {
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] && depth_m.data[i] > 0) return true;
  return mask.empty();
}

}  // namespace

ObjectResult Recovery::find(FrameContext* context, const PoseHint& hint, TrackedObject* object,
                            std::optional<Rigidd>* off_by_residuals) const {
  SearchQuery query;
  query.mask = hint.mask.empty() ? nullptr : hint.mask.data();
  query.box = hint.box;
  // The caller who gives a mask or a box states that the object is inside it.
  object->prior_log_odds = query.mask || query.box ? 0 : std::log(options_.search_odds);
  const std::optional<Found> found =
      follower_->search(context, context->frame(), *object, query, object->prior_log_odds);
  if (!found) {
    object->lost_frames = 1;
    const bool empty = !has_reading(context->frame().depth_m, hint.mask);
    return result_without_pose(*object, {empty ? ReasonCode::kNoReadingInMask : ReasonCode::kNothingFound},
                               Status::kLost);
  }
  if ((query.mask || query.box) && misfits(found->trust) &&
      evidence_share(but_for_residuals(evidence_of(found->fitted, options_)), 0) >= options_.lost_evidence)
    *off_by_residuals = found->fitted.T_cam_obj;
  Trust trust = found->trust;
  // A search of a whole image always finds something.
  if (!query.mask && !query.box && trust.status == Status::kWeak && trust.confidence < kBarely)
    trust.status = Status::kLost;
  ObjectResult result = follower_->accept(found->fitted, std::move(trust), *context, object);
  result.runner_up = found->runner_up;
  object->alternatives.clear();
  for (const Rigidd& motion : found->alternatives) object->alternatives.push_back({motion, 0});
  object->lost_frames = result.trust.status == Status::kLost;
  if (is_followed(result.trust.status)) doubt_half_turns(*context, follower_, object);
  return result;
}

ObjectResult Recovery::find_lost(FrameContext* context, TrackedObject* object, ObjectResult lost) const {
  const int n = object->lost_frames;
  SearchQuery query;
  if (n <= kNearFrames || n % 2 == 0) {
    query.near = object->T_cam_obj;
    query.reach_m = std::min(kFarthest_m, kReach_m + kReachPerFrame_m * n);
  }
  query.last_rotation = object->T_cam_obj.R;
  query.turn_sd_rad = kTurn_rad + kTurnPerFrame_rad * n;
  if (options_.recover_seeds < kSearchSeeds) {
    query.seeds = options_.recover_seeds;
    query.first_seed = (n - 1) * options_.recover_seeds % kSearchSeeds;
  }
  std::optional<Found> found =
      follower_->search(context, context->frame(), *object, query, std::log(options_.search_odds));
  if (!found || found->trust.status != Status::kOk || found->trust.confidence < kSure) return lost;
  if (may_still_be_there(*context, *object, found->fitted.T_cam_obj, options_) &&
      judge(found->fitted, options_, std::log(options_.search_odds) - kStillThere).confidence < kSure)
    return lost;

  const Rigidd last = object->T_cam_obj;
  object->motion.reset();  // its motion before the loss does not predict the motion here
  ObjectResult result = follower_->accept(std::move(found->fitted), found->trust, *context, object);
  result.runner_up = found->runner_up;
  result.trust.status = Status::kWeak;
  result.trust.reason = {ReasonCode::kFoundAgain};
  prepend(lost.steps, &result.steps);
  object->before_found = last, object->trial_frames = 0;
  object->prior_log_odds = std::log(options_.search_odds);
  object->lost_frames = 0;
  if (n >= kCouldTurn) look_for_turns(context, follower_, object);
  return result;
}

ObjectResult Recovery::confirm(ObjectResult result, TrackedObject* object) const {
  if (result.trust.status == Status::kOk) {
    object->before_found.reset();
    return result;
  }
  if (is_frame_fault(result.trust.reason.code)) return result;  // a later frame must decide
  if (result.trust.status == Status::kWeak && speaks_for(result.trust, object->prior_log_odds) &&
      ++object->trial_frames < kTrialFrames) {
    result.trust.reason = {ReasonCode::kFoundAgain};
    return result;
  }
  object->T_cam_obj = *object->before_found;
  object->before_found.reset();
  ObjectResult gone = result_without_pose(*object, {ReasonCode::kNotConfirmed}, Status::kLost);
  gone.steps = std::move(result.steps);
  return gone;
}

}  // namespace sdftrack::tracking

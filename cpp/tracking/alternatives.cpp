// SPDX-License-Identifier: MIT
#include "tracking/alternatives.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sdftrack::tracking {

namespace {

constexpr double kSharedPx = 100;  // pixels that share one error, until that is measured (docs/trust.md)
// Log odds: less than the first say nothing, for errors of a sensor last for many frames; a frame says no
// more than the second; the third decide.
constexpr double kSilent = 1, kPerFrame = 3, kDecided = 6;
constexpr double kLeastChance = 1e-6;

double log_odds(double chance) {
  const double p = std::clamp(chance, kLeastChance, 1 - kLeastChance);
  return std::log(p / (1 - p));
}

double mean_cost(const Fitted& f) {
  if (f.steps.empty() || f.steps.back().pixels <= 0) return f.cost;
  return f.steps.back().step.cost / f.steps.back().pixels;
}

int pixel_count(const Fitted& f) { return f.steps.empty() ? 0 : f.steps.back().pixels; }

// What one frame adds to the log odds.
double weighed(double odds) {
  const double said = std::max(0.0, std::abs(odds) - kSilent);
  return std::copysign(std::min(said, kPerFrame), odds);
}

// The alternative's pose becomes the object's, and the object's an alternative.
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
  const double evidence = log_odds(evidence_share(evidence_of(fitted, options), 0)) -
                          log_odds(evidence_share(evidence_of(other, options), 0));
  const int pixels = std::min(pixel_count(fitted), pixel_count(other));
  return evidence + (mean_cost(other) - mean_cost(fitted)) * pixels / shared_px;
}

void compare_alternatives(FrameContext* context, ObjectFollower* follower, TrackedObject* object,
                          ObjectResult* result) {
  std::vector<Alternative>& all = object->alternatives;
  if (all.empty() || !is_followed(result->trust.status) || is_frame_fault(context->fault())) return;
  const std::size_t i = object->compared++ % all.size();
  const Rigidd T = object->T_cam_obj;
  std::optional<Fitted> other = follower->fit_finely(*context, *object, T * all[i].motion);
  std::optional<Fitted> own = follower->fit_finely(*context, *object, T);
  if (!own) return;
  const TrackerOptions& options = follower->options();
  const double measured_px = object->memory.correlation_area_px;
  const double shared_px = measured_px > 0 ? measured_px : kSharedPx;
  // It slid to the object's own pose, or into another object, which is what it was taken for.
  const bool gone = !other || !distinct(other->T_cam_obj, own->T_cam_obj) ||
                    stands_in(context->neighbors_of(*object), *object->shape, other->T_cam_obj);
  if (!gone) all[i].log_odds += weighed(log_odds_between(*own, *other, options, shared_px));
  if (gone || all[i].log_odds > kDecided) {
    all.erase(all.begin() + static_cast<std::ptrdiff_t>(i));
  } else if (all[i].log_odds < -kDecided) {
    const Trust trust = judge(*other, options, object->prior_log_odds);
    if (trust.status == Status::kLost) return;
    exchange(i, object);
    *result = follower->accept(std::move(*other), trust, *context, object);
    other.reset();
  }
  follower->give_back(std::move(own->steps));
  if (other) follower->give_back(std::move(other->steps));
}

void doubt_ambiguous(const TrackedObject& object, ObjectResult* result) {
  if (object.alternatives.empty() || result->trust.status != Status::kOk) return;
  result->trust.status = Status::kWeak;
  result->trust.reason = {ReasonCode::kAmbiguous};
  result->trust.confidence /= static_cast<double>(object.alternatives.size() + 1);
}

}  // namespace sdftrack::tracking

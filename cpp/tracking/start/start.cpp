// SPDX-License-Identifier: MIT
#include "tracking/start/start.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "tracking/start/free_scale.h"
#include "tracking/start/size_check.h"

namespace sdftrack::tracking {

namespace {

constexpr double kUnlikelyPose = 0.1;  // confidence of a pose that explains nothing

PoseHint place_at_click(const Tracker& tracker, int k, const frame::DepthFrame& frame, Vec2d px) {
  try {
    return place_of_click(tracker, k, frame, px).hint();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("clicks[" + std::to_string(k) + "]: " + error.what());
  }
}

// A pose that is found, weakly, explains why little is seen, but not that more is.
void doubt_sizes(const frame::DepthFrame& frame, const std::vector<PoseHint>& places, Tracker* tracker) {
  for (int k = 0; k < tracker->object_count(); ++k) {
    const Trust& trust = tracker->last_result().objects[static_cast<std::size_t>(k)].trust;
    if ((trust.status != Status::kLost && trust.status != Status::kWeak) || !tracker->has_known_size(k))
      continue;
    const SizeDoubt doubt =
        size_doubt_at(frame, tracker->camera(), places[static_cast<std::size_t>(k)], tracker->shape(k));
    const bool believed = trust.status == Status::kWeak && trust.confidence > kUnlikelyPose;
    if (!doubt.text.empty() && (!believed || doubt.larger)) tracker->add_to_reason(k, doubt.text);
  }
}

bool is_convincing(const ObjectResult& result) {
  const Status status = result.trust.status;
  return (status != Status::kLost && status != Status::kWeak) ||
         search_confidence(result) >= kMinStandingConfidence;
}

std::string places_to_click(const std::vector<Pixel>& places) {
  std::string shown;
  for (const Pixel p : places)
    shown += (shown.empty() ? "(" : " or (") + std::to_string(p.x) + ", " + std::to_string(p.y) + ")";
  return "it might be at pixel " + shown + ": try a click there";
}

void start_at(Tracker* tracker, const frame::DepthFrame& frame, const std::vector<PoseHint>& places) {
  start_with_free_scales(tracker, frame, places);
  doubt_sizes(frame, places, tracker);
}

}  // namespace

std::vector<PoseHint> located(const Tracker& tracker, const frame::DepthFrame& frame,
                              const std::vector<StartHint>& hints) {
  std::vector<PoseHint> places;
  for (std::size_t i = 0; i < hints.size(); ++i) {
    const auto k = static_cast<int>(i);
    const std::optional<Vec2d>& px = hints[i].click_px;
    places.push_back(px ? place_at_click(tracker, k, frame, *px) : hints[i].place);
    if (!places.back().mask.empty() && tracker.has_known_size(k))
      check_mask_size(frame, tracker.camera(), places.back().mask.data(), tracker.shape(k),
                      "masks[" + std::to_string(k) + "]");
  }
  return places;
}

const FrameResult& start(Tracker* tracker, const frame::DepthFrame& frame,
                         const std::vector<StartHint>& hints) {
  start_at(tracker, frame, located(*tracker, frame, hints));
  const auto nothing_known = [](const StartHint& hint) {
    return !hint.place.T_cam_obj && hint.place.mask.empty() && !hint.place.box && !hint.click_px;
  };
  if (hints.size() == 1 && nothing_known(hints[0]) && !tracker->is_primitive(0))
    if (const std::optional<PoseHint> place = place_of_standing(tracker, frame)) {
      start_at(tracker, frame, {*place});
      tracker->doubt_standing();
    }
  return tracker->last_result();
}

std::optional<PoseHint> place_of_standing(Tracker* tracker, const frame::DepthFrame& frame) {
  if (tracker->object_count() > 1) return std::nullopt;
  const ObjectResult& result = tracker->last_result().objects.front();
  if (is_convincing(result)) return std::nullopt;
  const auto [place, pixels] = PlaceTrials(*tracker, 0, frame).anywhere();
  if (place) return place->hint();
  if (result.trust.status == Status::kLost && !pixels.empty())
    tracker->add_to_reason(0, places_to_click(pixels));
  return std::nullopt;
}

}  // namespace sdftrack::tracking

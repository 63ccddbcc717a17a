// SPDX-License-Identifier: MIT
// A start as a caller states it: at poses, in masks or boxes, by clicks, or anywhere.
#pragma once

#include <optional>
#include <vector>

#include "tracking/start/start_place.h"

namespace sdftrack::tracking {

struct StartHint {
  PoseHint place;                 // nothing: anywhere
  std::optional<Vec2d> click_px;  // a depth pixel on the object, in place of the others
};

// The places of all objects: clicks become masks or boxes. Throws std::invalid_argument, a sentence that
// begins with "clicks[k]: " or "masks[k]: ", where a click is not on the object, or a mask is not of the
// object's size.
std::vector<PoseHint> located(const Tracker& tracker, const frame::DepthFrame& frame,
                              const std::vector<StartHint>& hints);

// Starts the tracker, with places as above. Where an object is not found in its mask or box, or hardly, and
// what is seen there has another size, the reason says so. If nothing is known of the only object and it is
// not found in the whole image, or hardly, what stands on planes is tried; what is found there is weak.
const FrameResult& start(Tracker* tracker, const frame::DepthFrame& frame,
                         const std::vector<StartHint>& hints);

// After a start that has not found the only object: a place where something standing may be it. Without one
// the reason of a lost object names pixels to click on.
std::optional<PoseHint> place_of_standing(Tracker* tracker, const frame::DepthFrame& frame);

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// Starts of objects whose form is known and whose scale is not.
#pragma once

#include <vector>

#include "tracking/tracker.h"

namespace sdftrack::tracking {

// Starts the tracker at these places, again with each scale that is found, until none changes. In a mask,
// which may show any scale, those that its extent allows are compared first.
void start_with_free_scales(Tracker* tracker, const frame::DepthFrame& frame,
                            const std::vector<PoseHint>& places);

}  // namespace sdftrack::tracking

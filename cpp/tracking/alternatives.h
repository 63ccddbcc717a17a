// SPDX-License-Identifier: MIT
// Other poses that explain a start, or a frame after a loss, as well as the chosen one. The object stays
// doubted until later frames have refuted all of them.
#pragma once

#include "tracking/object_follower.h"

namespace sdftrack::tracking {

// Number of consecutive frames without a pose after which the object may also have been turned.
constexpr int kCouldTurn = 5;

// For an object that is seen again after it could have been turned: finds the turns that explain it as well.
void look_for_turns(FrameContext* context, ObjectFollower* follower, TrackedObject* object);

// Adds the half turns of an object that a search has found; the search's hypotheses need not contain them.
void doubt_half_turns(const FrameContext& context, ObjectFollower* follower, TrackedObject* object);

// Compares the object's alternatives with its pose in this frame. An alternative is dropped once enough
// frames contradict it, and replaces the pose once enough frames support it.
void compare_alternatives(FrameContext* context, ObjectFollower* follower, TrackedObject* object,
                          ObjectResult* result);

// At a start where depth misfits and colours are known: the pose by the outline, near the pose by depth or
// near one of its alternatives, which are then relative to it. With a mask, whose colours favour none of
// them, the outline decides between them. After that depth counts little until the two agree.
Rigidd pose_by_outline(const FrameContext& context, ObjectFollower* follower,
                       const std::vector<unsigned char>& mask, const Rigidd& T_cam_obj,
                       TrackedObject* object);

// Reports the doubt about an object whose alternatives have not all been refuted.
void doubt_ambiguous(const TrackedObject& object, ObjectResult* result);

// A shape that grows may be found again in a turn that shows a side not seen before; nothing then refutes a
// wrong turn. The turn is accepted after enough consecutive frames that would be sure.
void doubt_unproven(TrackedObject* object, ObjectResult* result);

// The log odds of a fit against another fit to the same frame; `shared_px`: pixels that share one error.
double log_odds_between(const Fitted& fitted, const Fitted& other, const TrackerOptions& options,
                        double shared_px);

}  // namespace sdftrack::tracking

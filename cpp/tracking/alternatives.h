// SPDX-License-Identifier: MIT
// Other poses that explain a start, or a frame after a loss, as well as the one that was taken. The object
// stays doubted until later frames have refuted them all.
#pragma once

#include "tracking/object_follower.h"

namespace sdftrack::tracking {

// Frames in a row without a pose, after which the object may have been turned as well.
constexpr int kCouldTurn = 5;

// Of an object that is seen again, after it could have been turned: what else explains it at its place.
void look_for_turns(FrameContext* context, ObjectFollower* follower, TrackedObject* object);

// Half turns of an object that a search has found, which its hypotheses need not contain.
void doubt_half_turns(const FrameContext& context, ObjectFollower* follower, TrackedObject* object);

// Compares the object's alternatives with its pose in this frame: one is dropped where enough frames speak
// against it, and takes the object's place where they speak for it.
void compare_alternatives(FrameContext* context, ObjectFollower* follower, TrackedObject* object,
                          ObjectResult* result);

// At a start where depth misfits and colours are there: the pose by the outline, near the one that depth has
// found or near one of its alternatives, which then stand relative to it. With a mask, whose colours favour
// none of them, the outline decides between them. From there on depth counts little, until the two agree.
Rigidd pose_by_outline(const FrameContext& context, ObjectFollower* follower,
                       const std::vector<unsigned char>& mask, const Rigidd& T_cam_obj,
                       TrackedObject* object);

// What is said of an object whose alternatives have not all been refuted.
void doubt_ambiguous(const TrackedObject& object, ObjectResult* result);

// A shape that grows may be found again in a turn that shows what has not been seen yet: nothing refutes
// another one then. It is believed when enough frames in a row would be sure.
void doubt_unproven(TrackedObject* object, ObjectResult* result);

// The log odds of a fit against another one to the same frame; `shared_px`: pixels that share one error.
double log_odds_between(const Fitted& fitted, const Fitted& other, const TrackerOptions& options,
                        double shared_px);

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// Objects without a pose: searched for at a start, and found again when they are lost.
#pragma once

#include "tracking/object_follower.h"

namespace sdftrack::tracking {

class Recovery {
 public:
  // The follower makes the searches, and outlives this.
  Recovery(const TrackerOptions& options, ObjectFollower* follower)
      : options_(options), follower_(follower) {}

  // Within the hint's mask or box, or everywhere; a hint with a pose needs no search. off_by_residuals: where
  // a mask or box vouches for the place and nothing but the size of the residuals speaks against the pose
  // found, it (centred).
  ObjectResult find(FrameContext* context, const PoseHint& hint, TrackedObject* object,
                    std::optional<Rigidd>* off_by_residuals) const;
  // An object that this frame has lost, around its last pose or everywhere: what is found of it, or `lost`.
  ObjectResult find_lost(FrameContext* context, TrackedObject* object, ObjectResult lost) const;
  // Of an object with before_found: what was found again in the last frame must hold in this one too: a
  // look-alike seldom holds its ground in two frames, and a wrong recovery is worse than a late one.
  ObjectResult confirm(ObjectResult result, TrackedObject* object) const;

 private:
  TrackerOptions options_;
  ObjectFollower* follower_;
};

}  // namespace sdftrack::tracking

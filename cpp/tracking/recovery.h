// SPDX-License-Identifier: MIT
// Objects without a pose: the search at a start, and for lost objects.
#pragma once

#include "tracking/object_follower.h"

namespace sdftrack::tracking {

class Recovery {
 public:
  // The follower makes the searches and must outlive this object.
  Recovery(const TrackerOptions& options, ObjectFollower* follower)
      : options_(options), follower_(follower) {}

  // Searches in the hint's mask or box, or everywhere; a hint with a pose needs no search. off_by_residuals:
  // the pose found (centred), where a mask or box states the place and only the residuals contradict it.
  ObjectResult find(FrameContext* context, const PoseHint& hint, TrackedObject* object,
                    std::optional<Rigidd>* off_by_residuals) const;
  // Searches for an object lost in this frame, around its last pose or everywhere; else returns `lost`.
  ObjectResult find_lost(FrameContext* context, TrackedObject* object, ObjectResult lost) const;
  // For an object with before_found: the pose found in the last frame must hold in this frame too. A
  // look-alike seldom fits in two frames, and a wrong recovery is worse than a late one.
  ObjectResult confirm(ObjectResult result, TrackedObject* object) const;

 private:
  TrackerOptions options_;
  ObjectFollower* follower_;
};

}  // namespace sdftrack::tracking

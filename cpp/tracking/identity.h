// SPDX-License-Identifier: MIT
// Decides which of several look-alikes was found. No image tells them apart, only their last positions.
#pragma once

#include <vector>

#include "tracking/result.h"

namespace sdftrack::tracking {

// Called after a frame's searches, with the objects that the frame has served and their results: a find
// belongs to the object that was last seen nearer to it.
void assign_finds(const std::vector<int>& served, std::vector<TrackedObject>* objects,
                  std::vector<ObjectResult>* results);

// Doubts the results for a few frames after look-alikes could not be told apart.
void doubt_identity(TrackedObject* object, ObjectResult* result);

}  // namespace sdftrack::tracking

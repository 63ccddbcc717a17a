// SPDX-License-Identifier: MIT
// Which of several look-alikes it is that was found: no picture tells them apart, only where each one was
// last.
#pragma once

#include <vector>

#include "tracking/result.h"

namespace sdftrack::tracking {

// After a frame's searches, over the objects that it has served and their results: a find belongs to the
// object that was last seen nearer to it.
void assign_finds(const std::vector<int>& served, std::vector<TrackedObject>* objects,
                  std::vector<ObjectResult>* results);

// For a few frames after look-alikes could not be told apart their results are doubted.
void doubt_identity(TrackedObject* object, ObjectResult* result);

}  // namespace sdftrack::tracking

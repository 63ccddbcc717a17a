// SPDX-License-Identifier: MIT
// The tracker's results as dictionaries of arrays.
#pragma once

#include <string>
#include <vector>

#include "array.h"
#include "tracking/tracker.h"

namespace sdftrack::bindings {

using Names = std::vector<std::string>;  // of the objects, for the texts of the reasons

// Numbers of all objects in arrays, the rest in lists.
py::dict result_to_dict(const tracking::FrameResult& result, const Names& names);
// An unchanged fit, its judgement, and the grounds of the judgement.
py::dict judgement_to_dict(const tracking::Fitted& f, const tracking::Trust& trust,
                           const tracking::TrackerOptions& options);

}  // namespace sdftrack::bindings

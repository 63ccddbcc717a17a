// SPDX-License-Identifier: MIT
// What the tracker found, as dictionaries of arrays.
#pragma once

#include <string>
#include <vector>

#include "array.h"
#include "tracking/tracker.h"

namespace sdftrack::bindings {

// Numbers of all objects in arrays, the rest in lists. names: for the sentences of the reasons.
py::dict result_to_dict(const tracking::FrameResult& result, const std::vector<std::string>& names);
// A fit as it is, what is said of it, and what it is said by.
py::dict judgement_to_dict(const tracking::Fitted& f, const tracking::Trust& trust,
                           const tracking::TrackerOptions& options);

}  // namespace sdftrack::bindings

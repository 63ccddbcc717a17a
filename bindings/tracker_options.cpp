// SPDX-License-Identifier: MIT
#include "option_binding.h"
#include "tracking/options/option_schema.h"

namespace sdftrack::bindings {

void bind_tracker_options(py::module_& m) {
  bind_options<tracking::TrackerOptions>(m, "TrackerOptions",
                                         "Options of the tracker; see sdftrack.TrackerOptions.");
}

}  // namespace sdftrack::bindings

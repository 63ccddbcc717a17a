// SPDX-License-Identifier: MIT
#include "option_binding.h"
#include "tracking/options/option_schema.h"
#include "tracking/options/sensor_presets.h"

namespace sdftrack::bindings {

void bind_tracker_options(py::module_& m) {
  using namespace py::literals;
  bind_options<tracking::TrackerOptions>(m, "TrackerOptions",
                                         "Options of the tracker; see sdftrack.TrackerOptions.");
  m.def(
      "sensor_presets",
      [] {
        py::list out;
        for (const tracking::SensorPreset& s : tracking::kSensorPresets)
          out.append(py::dict("name"_a = s.name, "noise_m"_a = s.noise_m, "noise_per_m"_a = s.noise_per_m,
                              "noise_incidence"_a = s.noise_incidence, "correlation_px"_a = s.correlation_px,
                              "systematic_m"_a = s.systematic_m, "systematic_per_m"_a = s.systematic_per_m,
                              "lateral_px"_a = s.lateral_px, "source"_a = s.source));
        return out;
      },
      "One dict of the values of each preset (SensorModel.preset).");
}

}  // namespace sdftrack::bindings

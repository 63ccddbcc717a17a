// SPDX-License-Identifier: MIT
// The schema of every option of the core as plain data, the input of bindings/generate_options.py.
#include "base/option_schema.h"

#include <pybind11/stl.h>

#include <cmath>

#include "array.h"
#include "contour/option_schema.h"
#include "lwpr/option_schema.h"
#include "reconstruction/option_schema.h"
#include "tracking/options/option_schema.h"

namespace sdftrack::bindings {

namespace {

using namespace py::literals;

constexpr const char* kKinds[] = {"bool", "int", "number", "choice", "numbers"};

py::object default_of(const OptionDescription& option) {
  if (option.range.may_be_none) return py::none();
  const auto* numbers = std::get_if<std::vector<double>>(&option.value);
  if (numbers && numbers->size() == 1) return py::float_(numbers->front());
  return py::cast(option.value);
}

template <class Options>
py::list schema_of() {
  py::list out;
  for (const OptionDescription& o : describe_options(Options{}))
    out.append(py::dict("name"_a = o.name, "kind"_a = kKinds[static_cast<int>(o.kind)],
                        "default"_a = default_of(o), "min"_a = o.range.min, "max"_a = o.range.max,
                        "min_open"_a = o.range.min_open, "max_open"_a = o.range.max_open,
                        "ends_only"_a = o.range.ends_only, "may_be_none"_a = o.range.may_be_none,
                        "choices"_a = o.choices, "unit"_a = o.unit, "meaning"_a = o.meaning));
  return out;
}

py::dict option_schema() {
  return py::dict("tracker"_a = schema_of<tracking::TrackerOptions>(),
                  "reconstruct"_a = schema_of<reconstruction::ReconstructionOptions>(),
                  "contour"_a = schema_of<contour::ContourOptions>(),
                  "lwpr"_a = schema_of<lwpr::LwprOptions>());
}

std::string option_expected(const std::string& kind, double min, double max, bool min_open, bool max_open,
                            bool ends_only, bool may_be_none, const std::vector<std::string>& choices) {
  for (int k = 0; k < static_cast<int>(std::size(kKinds)); ++k)
    if (kind == kKinds[k])
      return expected_of(static_cast<OptionKind>(k), {min, max, min_open, max_open, ends_only, may_be_none},
                         choices);
  throw std::invalid_argument("kind: expected a kind of option, got \"" + kind + "\"");
}

}  // namespace

void bind_option_schema(py::module_& m) {
  m.def("option_schema", &option_schema, "All options of the core, grouped by table.");
  m.def("option_expected", &option_expected, "kind"_a, "min"_a, "max"_a, "min_open"_a, "max_open"_a,
        "ends_only"_a, "may_be_none"_a, "choices"_a,
        "The expected values of such an option, as stated in error messages.");
  m.def(
      "option_in_range",
      [](double value, double min, double max, bool min_open, bool max_open, bool ends_only) {
        return lies_in({min, max, min_open, max_open, ends_only}, value);
      },
      "value"_a, "min"_a, "max"_a, "min_open"_a, "max_open"_a, "ends_only"_a,
      "Whether a number lies in the range of an option.");
}

}  // namespace sdftrack::bindings

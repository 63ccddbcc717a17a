// SPDX-License-Identifier: MIT
// The options of every part, and the values of sensors that come with the tracker's.
#include "contour/memory/options.h"

#include <cmath>

#include "contour/option_schema.h"
#include "lwpr/option_schema.h"
#include "option_binding.h"
#include "reconstruction/option_schema.h"
#include "tracking/options/option_schema.h"
#include "tracking/options/sensor_presets.h"

namespace sdftrack::bindings {

namespace {

py::object package(const char* module, const char* name) { return py::module_::import(module).attr(name); }

std::string type_of(const OptionDescription& option) {
  constexpr const char* kTypes[] = {"bool", "int", "float", "str", "collections.abc.Sequence[float]"};
  return kTypes[static_cast<int>(option.kind)] + std::string(option.range.may_be_none ? " | None" : "");
}

bool is_truth(const py::handle& given) {
  if (PyLong_CheckExact(given.ptr()) || PyFloat_CheckExact(given.ptr())) return false;
  return PyBool_Check(given.ptr()) || py::isinstance(given, package("numpy", "bool_"));
}

// A number of any type; nothing: it is none.
std::optional<double> number_from(const py::handle& given, bool whole) {
  if (is_truth(given) || PyUnicode_Check(given.ptr()) || PyBytes_Check(given.ptr())) return std::nullopt;
  const auto number = whole ? py::reinterpret_steal<py::object>(PyNumber_Index(given.ptr()))
                            : py::reinterpret_borrow<py::object>(given);
  const double value = number ? PyFloat_AsDouble(number.ptr()) : 0;
  if (!PyErr_Occurred()) return value;
  const bool is_large = PyErr_ExceptionMatches(PyExc_OverflowError);  // an int of hundreds of digits
  PyErr_Clear();
  if (!is_large) return std::nullopt;
  return given < py::int_(0) ? -kNoBound : kNoBound;
}

OptionValue value_from(const OptionDescription& option, const py::handle& given) {
  const auto refusal = [&](const std::string& expected) {
    return option.name + ": expected " + expected + ", got " +
           package("sdftrack._internal.validation", "shown")(given).cast<std::string>();
  };
  const std::string expected = expected_of(option.kind, option.range, option.choices);
  if (option.range.may_be_none && given.is_none()) return {};
  if (option.kind == OptionKind::kBool && is_truth(given)) return given.cast<bool>();
  if (option.kind == OptionKind::kNumbers) return given.cast<std::vector<double>>();
  if (option.kind == OptionKind::kChoice && PyUnicode_Check(given.ptr())) {
    const auto name = py::str(given).cast<std::string>();
    for (const std::string& choice : option.choices)
      if (choice == name) return name;
    throw py::value_error(refusal(expected));
  }
  if (option.kind == OptionKind::kBool || option.kind == OptionKind::kChoice)
    throw py::type_error(refusal(expected));
  const bool whole = option.kind == OptionKind::kInt;
  const std::optional<double> value = number_from(given, whole);
  if (!value) throw py::type_error(refusal(whole ? "a whole number" : "a number"));
  constexpr double kMost = std::numeric_limits<int>::max();
  if (!lies_in(option.range, *value) || (whole && std::abs(*value) > kMost))
    throw py::value_error(refusal(expected));
  return whole ? OptionValue(static_cast<int>(*value)) : OptionValue(*value);
}

}  // namespace

py::dict values_of(const DescribedOptions& options) {
  py::dict out;
  for (const OptionDescription& option : options) out[option.name.c_str()] = option.value;
  return out;
}

std::string init_signature(const DescribedOptions& options) {
  std::string out = "__init__(self, *";
  for (const OptionDescription& option : options)
    out += ", " + option.name + ": " + type_of(option) + " = " +
           py::repr(py::cast(option.value)).cast<std::string>();
  return out + ") -> None";
}

py::dict dataclass_fields(const DescribedOptions& options) {
  py::dict out;
  for (const OptionDescription& o : options) {
    const auto* numbers = std::get_if<std::vector<double>>(&o.value);
    py::object field = package("dataclasses", "field")(
        "default"_a = numbers ? py::cast(numbers->at(0)) : py::cast(o.value),
        "metadata"_a = py::dict("unit"_a = o.unit, "meaning"_a = o.meaning,
                                "expected"_a = expected_of(o.kind, o.range, o.choices), "min"_a = o.range.min,
                                "max"_a = o.range.max, "min_open"_a = o.range.min_open,
                                "max_open"_a = o.range.max_open));
    field.attr("name") = o.name, field.attr("type") = type_of(o);
    field.attr("_field_type") = package("dataclasses", "_FIELD");
    out[o.name.c_str()] = field;
  }
  return out;
}

void take(const py::dict& given, DescribedOptions* options) {
  std::size_t known = 0;
  for (OptionDescription& option : *options)
    if (given.contains(option.name)) {
      option.value = value_from(option, given[option.name.c_str()]);
      ++known;
    }
  if (known < given.size())
    package("sdftrack._internal.unknown_option", "refuse_unknown")(given, values_of(*options));
}

std::string options_repr(const py::object& self, const DescribedOptions& defaults) {
  std::string out;
  for (const OptionDescription& option : defaults) {
    const py::object value = self.attr(option.name.c_str());
    if (value.equal(py::cast(option.value))) continue;
    out += (out.empty() ? "" : ", ") + option.name + "=" + py::repr(value).cast<std::string>();
  }
  return py::type::of(self).attr("__name__").cast<std::string>() + "(" + out + ")";
}

void bind_options(py::module_& m) {
  bind_options<tracking::TrackerOptions>(m, "TrackerOptions", "Options of a tracker.");
  bind_options<reconstruction::ReconstructionOptions>(m, "ReconstructionOptions",
                                                      "Options of a reconstruction.");
  bind_options<contour::ContourOptions>(m, "ContourOptions", "Options of a contour tracker.");
  bind_options<contour::MemoryOptions>(m, "MemoryOptions", "Options of a memory of silhouettes.");
  bind_options<lwpr::LwprOptions>(m, "LwprOptions", "Options of a regression.");
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

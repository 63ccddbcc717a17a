// SPDX-License-Identifier: MIT
// A struct of options as an immutable Python class with the interface of a dataclass, by its visit_options.
#pragma once

#include "array.h"
#include "base/option_schema.h"

namespace sdftrack::bindings {

using DescribedOptions = std::vector<OptionDescription>;

// Numbers with the fewest digits that give the same value, choices by name.
py::dict values_of(const DescribedOptions& options);
// "__init__(self, *, name: type = default, ...) -> None", for the stub.
std::string init_signature(const DescribedOptions& options);
// What a dataclass has as __dataclass_fields__; metadata: unit, meaning, expected, min, max, min_open,
// max_open.
py::dict dataclass_fields(const DescribedOptions& options);
// The given value of each option, if any; TypeError for an unknown name or another type, ValueError out of
// range.
void take(const py::dict& given, DescribedOptions* options);
std::string options_repr(const py::object& self, const DescribedOptions& defaults);

template <class Options>
py::dict values_of(const Options& options) {
  return values_of(describe_options(options));
}

template <class Options>
Options options_from(const py::dict& given) {
  Options out;
  DescribedOptions options = describe_options(out);
  take(given, &options);
  for (const OptionDescription& option : options) {
    OptionSetter setter{option.name, option.value};
    visit_options(out, setter);
  }
  if constexpr (requires { out.check(); }) out.check();
  return out;
}

template <class Value, class Kind>
auto attribute_of(const Value& value, const Kind& kind) {
  if constexpr (std::is_same_v<Kind, Choices<Value>>)
    return std::string(name_of(kind, value));
  else if constexpr (std::is_floating_point_v<Value>)
    return decimal_of(value);
  else
    return value;
}

template <class Options>
void bind_options(py::module_& m, const char* class_name, const char* doc) {
  py::class_<Options> bound(m, class_name, doc);
  Options defaults;
  const DescribedOptions described = describe_options(defaults);
  {
    py::options own;
    own.disable_function_signatures();
    bound
        .def(py::init([](const py::kwargs& given) { return options_from<Options>(given); }),
             init_signature(described).c_str())
        .def(
            "__eq__",
            [](const Options& a, const py::object& b) {
              return py::isinstance<Options>(b) && values_of(a).equal(values_of(b.cast<const Options&>()));
            },
            "__eq__(self, other: object) -> bool")
        .def(
            "replace",
            [](const py::object& self, const py::kwargs& changes) {
              py::dict all = self.attr("to_dict")();
              all.attr("update")(changes);
              return py::type::of(self)(**all);
            },
            "replace(self, **changes: typing.Any) -> typing.Self\n\nA copy with some options changed.");
  }
  bound.def("to_dict", &values_of<Options>, "``{name: value}``.")
      .def("__hash__", [](const Options& o) { return py::hash(py::tuple(values_of(o).attr("values")())); })
      .def("__repr__", [described](const py::object& self) { return options_repr(self, described); })
      .def(py::pickle(&values_of<Options>, &options_from<Options>));
  const auto bind = [&](const char* name, auto& member, const auto& kind, const char*, const char* meaning) {
    using Member = std::decay_t<decltype(member)>;
    const auto offset = reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&defaults);
    bound.def_property_readonly(
        name,
        [offset, kind](const Options& o) {
          return attribute_of(*reinterpret_cast<const Member*>(reinterpret_cast<const char*>(&o) + offset),
                              kind);
        },
        meaning);
  };
  visit_options(defaults, bind);
  bound.def_static(
      "fields", [described] { return dataclass_fields(described); }, "Each option as a dataclass's field.");
}

}  // namespace sdftrack::bindings

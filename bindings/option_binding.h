// SPDX-License-Identifier: MIT
// A struct of options as a Python class with one attribute per option, by its visit_options.
#pragma once

#include <pybind11/stl.h>

#include <stdexcept>
#include <string>

#include "array.h"
#include "base/option_schema.h"

namespace sdftrack::bindings {

// Converts to an attribute: numbers with the fewest digits that give the same value, choices by name.
inline bool to_attribute(bool value, TrueOrFalse) { return value; }
inline int to_attribute(int value, const OptionRange&) { return value; }
template <std::floating_point Number>
double to_attribute(Number value, const OptionRange&) {
  return decimal_of(value);
}
inline std::vector<double> to_attribute(const std::vector<double>& value, NumberArray) { return value; }
template <class Value>
std::string to_attribute(const Value& value, Choices<Value> choices) {
  return name_of(choices, value);
}

template <class Value, class Kind>
void from_attribute(const Value& value, const Kind&, const char*, Value* to) {
  *to = value;
}
inline void from_attribute(double value, const OptionRange&, const char*, float* to) {
  *to = static_cast<float>(value);
}
template <class Value>
void from_attribute(const std::string& value, Choices<Value> choices, const char* name, Value* to) {
  OptionDescription option{name, OptionKind::kChoice, value};
  for (const auto& choice : choices) {
    option.choices.emplace_back(choice.name);
    if (value == choice.name) *to = choice.value;
  }
  check_option(option);
}

// Calls `use` with the member of `o` that has this name, and its range, as listed in visit_options.
template <class Options, class Member, class Kind, class Use>
void with_member(Options& o, const std::string& requested, const Use& use) {
  const auto visit = [&](const char* name, auto& member, const auto& kind, const char*, const char*) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, Member> &&
                  std::is_same_v<std::decay_t<decltype(kind)>, Kind>)
      if (requested == name) use(member, kind);
  };
  visit_options(o, visit);
}

template <class Options>
OptionDescription described(const Options& o, const std::string& requested) {
  for (OptionDescription& option : describe_options(o))
    if (option.name == requested) return option;
  throw std::logic_error(requested + ": no such option");
}

// Setting an option checks its bounds. Relations between options are checked where the struct is used.
template <class Options>
py::class_<Options> bind_options(py::module_& m, const char* class_name, const char* doc) {
  py::class_<Options> bound(m, class_name, doc);
  bound.def(py::init<>());
  Options defaults;
  const auto bind = [&](const char* name, auto& member, const auto& kind, const char*, const char*) {
    using Member = std::decay_t<decltype(member)>;
    using Kind = std::decay_t<decltype(kind)>;
    using Attribute = decltype(to_attribute(member, kind));
    const std::string own = name;
    bound.def_property(
        name,
        [own](const Options& o) {
          Attribute out{};
          with_member<const Options, Member, Kind>(
              o, own, [&](const Member& value, const Kind& of) { out = to_attribute(value, of); });
          return out;
        },
        [own](Options& o, const Attribute& value) {
          Options changed = o;
          with_member<Options, Member, Kind>(
              changed, own, [&](Member& to, const Kind& of) { from_attribute(value, of, own.c_str(), &to); });
          check_option(described(changed, own));
          o = changed;
        });
  };
  visit_options(defaults, bind);
  return bound;
}

}  // namespace sdftrack::bindings

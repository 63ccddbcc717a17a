// SPDX-License-Identifier: MIT
// The description of an option: name, bounds, unit, meaning. A struct of options has one function
//
//   visit_options(options, f), which calls f(name, member, range, unit, meaning) once per option,
//
// and everything else follows from it: checks, bindings, Python's classes, TOML, the tables of
// docs/options.md. The default is the initial value of the struct's member.
#pragma once

#include <concepts>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace sdftrack {

// `Visited` is `Options` or const Options: visit_options is written once for reading and writing.
template <class Visited, class Options>
concept OptionsOf = std::same_as<std::remove_const_t<Visited>, Options>;

constexpr double kNoBound = std::numeric_limits<double>::infinity();

// The allowed numbers of an option; never NaN.
struct OptionRange {
  double min = -kNoBound, max = kNoBound;
  bool min_open = false, max_open = false;  // the end itself is excluded
  bool ends_only = false;                   // min or max, nothing between
  bool may_be_none = false;                 // None in Python: the value is then measured

  constexpr OptionRange below(double end) const { return {min, end, min_open, true, ends_only, may_be_none}; }
  constexpr OptionRange up_to(double end) const {
    return {min, end, min_open, false, ends_only, may_be_none};
  }
  constexpr OptionRange or_none() const { return {min, max, min_open, max_open, ends_only, true}; }
};

constexpr OptionRange above(double min) { return {.min = min, .min_open = true}; }
constexpr OptionRange at_least(double min) { return {.min = min}; }
constexpr OptionRange from_to(double min, double max) { return {.min = min, .max = max}; }
constexpr OptionRange either(double a, double b) { return {.min = a, .max = b, .ends_only = true}; }

// A bool that is also true or false in Python.
struct TrueOrFalse {};
constexpr TrueOrFalse kTrueOrFalse;

// A std::vector<double> that a separate function checks.
struct NumberArray {};
constexpr NumberArray kNumberArray;

// The names of an enum's values (or of false and true), in the order in which they are shown.
template <class Value>
struct Choice {
  Value value;
  const char* name;
};
template <class Value>
using Choices = std::span<const Choice<Value>>;

enum class OptionKind { kBool, kInt, kNumber, kChoice, kNumbers };

using OptionValue = std::variant<bool, int, double, std::string, std::vector<double>>;

// One option of one struct, with its value there.
struct OptionDescription {
  std::string name;
  OptionKind kind;
  OptionValue value;
  OptionRange range = {};
  std::vector<std::string> choices = {};
  std::string unit = {}, meaning = {};
};

// "a number > 0", "2 to 32", "one of ['a', 'b']": the text after "expected" in a message.
std::string expected_of(OptionKind kind, const OptionRange& range, const std::vector<std::string>& choices);

// False for NaN.
bool lies_in(const OptionRange& range, double value);

// Throws std::invalid_argument "NAME: expected ..., got ..." for a value out of range.
void check_option(const OptionDescription& option);

// The double with the fewest digits that rounds to this float: 0.05 for 0.05f.
double decimal_of(float value);
inline double decimal_of(double value) { return value; }

template <class Value>
std::string name_of(Choices<Value> choices, Value value) {
  for (const auto& choice : choices)
    if (choice.value == value) return choice.name;
  return "a value without a name";
}

struct OptionDescriber {
  std::vector<OptionDescription> options;

  void operator()(const char* name, const bool& value, TrueOrFalse, const char* unit, const char* meaning) {
    options.push_back({name, OptionKind::kBool, value, {}, {}, unit, meaning});
  }
  void operator()(const char* name, const int& value, const OptionRange& range, const char* unit,
                  const char* meaning) {
    options.push_back({name, OptionKind::kInt, value, range, {}, unit, meaning});
  }
  template <std::floating_point Number>
  void operator()(const char* name, const Number& value, const OptionRange& range, const char* unit,
                  const char* meaning) {
    options.push_back({name, OptionKind::kNumber, decimal_of(value), range, {}, unit, meaning});
  }
  template <class Value>
  void operator()(const char* name, const Value& value, Choices<Value> choices, const char* unit,
                  const char* meaning) {
    std::vector<std::string> names;
    for (const auto& choice : choices) names.emplace_back(choice.name);
    options.push_back({name, OptionKind::kChoice, name_of(choices, value), {}, names, unit, meaning});
  }
  void operator()(const char* name, const std::vector<double>& value, NumberArray, const char* unit,
                  const char* meaning) {
    options.push_back({name, OptionKind::kNumbers, value, {}, {}, unit, meaning});
  }
};

// Every option of the struct in the order of visit_options.
template <class Options>
std::vector<OptionDescription> describe_options(const Options& options) {
  OptionDescriber describer;
  visit_options(options, describer);
  return std::move(describer.options);
}

// Returns the options; throws std::invalid_argument that names the first option out of range.
template <class Options>
const Options& check_options(const Options& options) {
  for (const OptionDescription& option : describe_options(options)) check_option(option);
  return options;
}

}  // namespace sdftrack

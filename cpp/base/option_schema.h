// SPDX-License-Identifier: MIT
// The description of an option: name, bounds, unit, meaning. A struct of options has one function
//
//   visit_options(options, f), which calls f(name, member, range, unit, meaning) once per option,
//
// and everything else follows from it: checks, the class that is also Python's, TOML, the tables of
// docs/options.md. The default is the initial value of the struct's member.
#pragma once

#include <concepts>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
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

// std::monostate: None.
using OptionValue = std::variant<std::monostate, bool, int, double, std::string, std::vector<double>>;

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
  void operator()(const char* name, const std::optional<double>& value, const OptionRange& range,
                  const char* unit, const char* meaning) {
    options.push_back({name, OptionKind::kNumber, {}, range, {}, unit, meaning});
    if (value) options.back().value = *value;
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

// Sets the option of this name, as listed in visit_options; the bounds are not checked.
struct OptionSetter {
  const std::string& name;
  const OptionValue& value;
  bool found = false;

  void operator()(const char* own, bool& to, TrueOrFalse, const char*, const char*) {
    if (is(own)) to = as<bool>("true or false");
  }
  template <class Number>
  void operator()(const char* own, Number& to, const OptionRange&, const char*, const char*) {
    if (is(own)) to = number<Number>();
  }
  void operator()(const char* own, std::optional<double>& to, const OptionRange&, const char*, const char*) {
    if (!is(own)) return;
    to.reset();
    if (!std::holds_alternative<std::monostate>(value)) to = number<double>();
  }
  void operator()(const char* own, std::vector<double>& to, NumberArray, const char*, const char*) {
    if (is(own)) to = as<std::vector<double>>("numbers");
  }
  template <class Value>
  void operator()(const char* own, Value& to, Choices<Value> choices, const char*, const char*) {
    if (!is(own)) return;
    OptionDescription option{name, OptionKind::kChoice, as<std::string>("a name")};
    for (const Choice<Value>& choice : choices) {
      option.choices.emplace_back(choice.name);
      if (option.value == OptionValue(std::string(choice.name))) to = choice.value;
    }
    check_option(option);
  }

 private:
  bool is(const char* own) { return name == own && (found = true); }
  template <class Number>
  Number number() const {
    const int* whole = std::get_if<int>(&value);
    return whole ? static_cast<Number>(*whole) : static_cast<Number>(as<double>("a number"));
  }
  template <class T>
  T as(const char* expected) const {
    if (const T* given = std::get_if<T>(&value)) return *given;
    throw std::invalid_argument(name + ": expected " + expected);
  }
};

// Returns the options; throws std::invalid_argument that names the first option out of range.
template <class Options>
const Options& check_options(const Options& options) {
  for (const OptionDescription& option : describe_options(options)) check_option(option);
  return options;
}

}  // namespace sdftrack

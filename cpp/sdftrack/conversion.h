// SPDX-License-Identifier: MIT
// The public types and those of the core.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/option_schema.h"
#include "sdftrack/tracker.h"
#include "tracking/tracker.h"

namespace sdftrack {

Rigidd rigid_of(const Eigen::Isometry3d& T, const char* name);
// name: of the argument, for errors.
Camera camera_of(const LensCamera& camera, const char* name = "camera");
TrackedPose pose_of(const tracking::ObjectResult& result);
tracking::PoseHint hint_of(const Place& place, const Camera& camera);

using OptionSettings = std::vector<std::pair<std::string, OptionSetting>>;

// Sets the option of this name, as listed in visit_options.
struct OptionSetter {
  const std::string& name;
  const OptionSetting& value;
  bool found = false;

  void operator()(const char* own, bool& to, TrueOrFalse, const char*, const char*) {
    if (name == own) to = as<bool>("true or false"), found = true;
  }
  template <class Number>
  void operator()(const char* own, Number& to, const OptionRange&, const char*, const char*) {
    if (name != own) return;
    const int* whole = std::get_if<int>(&value);
    to = whole ? static_cast<Number>(*whole) : static_cast<Number>(as<double>("a number"));
    found = true;
  }
  template <class Value>
  void operator()(const char* own, Value& to, Choices<Value> choices, const char*, const char*) {
    if (name != own) return;
    OptionDescription option{name, OptionKind::kChoice, as<std::string>("a name")};
    for (const Choice<Value>& choice : choices) {
      option.choices.emplace_back(choice.name);
      if (option.value == OptionValue(std::string(choice.name))) to = choice.value;
    }
    check_option(option);
    found = true;
  }

 private:
  template <class T>
  T as(const char* expected) const {
    if (const T* given = std::get_if<T>(&value)) return *given;
    throw std::invalid_argument(name + ": expected " + expected);
  }
};

// whose: the options', for the error about an unknown name.
template <class Options>
void set_options(const OptionSettings& settings, const char* whose, Options* options) {
  for (const auto& [name, value] : settings) {
    OptionSetter setter{name, value};
    visit_options(*options, setter);
    if (!setter.found) throw std::invalid_argument(name + ": no such option of " + whose);
  }
}

// A frame of the caller in the core's form: it borrows the images, or holds the depth in metres.
class FrameReader {
 public:
  FrameReader(const DepthCamera& depth, const std::optional<ColorCamera>& color);
  frame::DepthFrame read(const Frame& frame, const tracking::Tracker& tracker);
  // In metres; nullptr: the frame has none.
  const float* depth_of(const Frame& frame, const Camera& camera);

 private:
  appearance::ColorMap map_;
  std::vector<float> depth_m_;
  appearance::ColorImage color_;
};

}  // namespace sdftrack

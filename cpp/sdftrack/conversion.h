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

// whose: the options', for the error about an unknown name.
template <class Options>
void set_options(const OptionSettings& settings, const char* whose, Options* options) {
  for (const auto& [name, value] : settings) {
    const OptionValue given = std::visit([](const auto& v) { return OptionValue(v); }, value);
    OptionSetter setter{name, given};
    visit_options(*options, setter);
    if (!setter.found) throw std::invalid_argument(name + ": no such option of " + whose);
  }
}

// A frame of the caller in the core's form: it borrows the images, or holds the depth in metres.
class FrameReader {
 public:
  FrameReader(const DepthCamera& depth, const std::optional<ColorCamera>& color);
  frame::DepthFrame read(const Frame& frame, const tracking::Tracker& tracker);
  // The depth alone, if the frame has any.
  frame::DepthFrame depth_of(const Frame& frame, const Camera& camera);

 private:
  appearance::ColorMap map_;
  std::vector<float> depth_m_, filled_m_;
  appearance::ColorImage color_;
};

}  // namespace sdftrack

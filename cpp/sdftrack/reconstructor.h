// SPDX-License-Identifier: MIT
// Reconstructs an unknown rigid object while it is tracked in depth, or depth and colour. Results are those
// of the Python class of this name.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdftrack/camera.h"
#include "sdftrack/shape.h"
#include "sdftrack/tracker.h"

namespace sdftrack {

struct ReconstructorSetup {
  int voxels = 200;     // along each side of the volume, 16 to 512
  double extent_m = 0;  // side of the volume; 0: 1.8 times the object's size. It grows with the shape
  // By the names of docs/options.md, such as {"min_seen", 0.3}; `evolution` is always "ours".
  std::vector<std::pair<std::string, OptionSetting>> options;
  // Of the tracker inside, where by default `outline` and `smooth_colors` are off.
  std::vector<std::pair<std::string, OptionSetting>> tracker_options;
  std::optional<ColorCamera> color;  // none: colour images are aligned with depth, pixel by pixel
  int threads = 0;                   // 0: all cores; results have the same bits for any number
};

struct ReconstructionResult {
  TrackedPose pose;
  int index = -1;  // of the frame since the start (0)
  double time_s = std::numeric_limits<double>::quiet_NaN();
  // Mean motion of the surface by this frame, m; NaN: its pose was not reliable, and it was not fused.
  double shape_change_m = std::numeric_limits<double>::quiet_NaN();
};

// Watertight; metres, object frame.
struct ReconstructedMesh {
  Shape::Vertices vertices;
  Shape::Faces faces;
  Eigen::Matrix<std::uint8_t, 3, Eigen::Dynamic> rgb;  // of each vertex; no columns: no frame had colours
  Eigen::VectorXf seen;  // of each vertex: number of equivalent frontal views; 0: guessed
};

// The object frame has the axes of the first frame's camera and its origin at the centre of a ball around the
// object. A reconstructor is used by one thread at a time. Arguments that cannot be meant throw
// std::invalid_argument, and leave the reconstructor as it was.
class Reconstructor {
 public:
  explicit Reconstructor(const DepthCamera& camera, const ReconstructorSetup& setup = {});
  // initial: a coarse shape of the object or its category, for unobserved parts; it has the object frame.
  Reconstructor(const DepthCamera& camera, Shape initial, const ReconstructorSetup& setup = {});
  Reconstructor(Reconstructor&&) noexcept;
  Reconstructor& operator=(Reconstructor&&) noexcept;
  ~Reconstructor();

  // Starts with a frame in which the object is in a mask, in a box (the connected surface at its centre), or,
  // with an initial shape, at a pose. A result is valid until the next call.
  const ReconstructionResult& start(const Frame& frame, const Place& place);
  // The next frame. Like the following functions it throws std::logic_error before a start.
  const ReconstructionResult& track(const Frame& frame);

  // A copy of the shape as it is now, with its guessed parts: for a Tracker, for instance.
  Shape shape() const;
  ReconstructedMesh mesh() const;

 private:
  class Session;
  std::unique_ptr<Session> session_;
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// Tracks rigid objects of known shape in depth, or depth and colour: one pose, with its covariance and a
// measure of trust, for each object and frame. Results are those of the Python class of this name.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sdftrack/camera.h"
#include "sdftrack/shape.h"

namespace sdftrack {

enum class Status {
  kOk,       // the pose is more likely right than not, and every direction is determined
  kWeak,     // the pose is followed, but `reason` says what is in doubt
  kLost,     // not found
  kBadFrame  // the frame shows nothing
};

struct TrackedPose {
  Status status = Status::kLost;
  std::string reason;  // one sentence; empty: ok
  // Of the object frame in the camera, metres: the last good one where it is lost, NaN before the first.
  Eigen::Isometry3d T_cam_obj = Eigen::Isometry3d::Identity();
  // Of (x, y, z, rx, ry, rz): translation (m) and rotation (rad) in camera axes; NaN where lost.
  Eigen::Matrix<double, 6, 6> covariance;
  Eigen::Matrix<double, 6, 1> twist;  // m/s and rad/s in camera axes; NaN where not known
  double confidence = 0;              // probability that the pose is within 20 mm and 10 degrees

  bool ok() const { return status == Status::kOk; }
};

struct TrackResult {
  std::vector<TrackedPose> objects;
  int index = -1;  // of the frame since the start (0)
  double time_s = std::numeric_limits<double>::quiet_NaN();
};

// Where an object is at a start: a pose, else a mask, a box or a click; nothing: it is searched for in the
// whole image, and the only object of a tracker then among what stands on planes.
struct Place {
  struct Box {
    int x, y, width, height;  // depth pixels
  };
  std::optional<Eigen::Isometry3d> T_cam_obj;
  const std::uint8_t* mask = nullptr;  // one byte for each depth pixel, not 0 on the object
  std::optional<Box> box;
  // A depth pixel on the object. What hangs together there, without tables and walls and by its colours, is
  // searched. Throws std::invalid_argument where the object is not there; the sentence says why.
  std::optional<Eigen::Vector2d> click_px;
};

// The rigid motions that map a shape onto itself, in its object frame.
struct ShapeSymmetry {
  struct Axis {
    Eigen::Vector3d direction, point;  // metres
  };
  std::vector<Eigen::Isometry3d> discrete;  // without the identity
  std::vector<Axis> axes;                   // of continuous symmetry
};

// The size of an object over that of its shape, and its standard deviation; infinite: not known.
struct Scale {
  double value = 1, sd = std::numeric_limits<double>::infinity();
};

using OptionSetting = std::variant<bool, int, double, std::string>;

struct TrackerSetup {
  std::string sensor;  // "kinect_v1", "realsense_d400", "azure_kinect"; empty: its noise is estimated
  // By the names of docs/options.md, such as {"max_pixels", 2000}; they override those of the sensor.
  std::vector<std::pair<std::string, OptionSetting>> options;
  std::optional<ColorCamera> color;  // none: colour images are aligned with depth, pixel by pixel
  int threads = 0;                   // 0: all cores; results have the same bits for any number
  bool recover = true;               // search for a lost object in every frame
};

// A tracker is used by one thread at a time. Arguments that are out of range or of another size throw
// std::invalid_argument, and leave the tracker as it was.
class Tracker {
 public:
  Tracker(std::vector<Shape> shapes, const DepthCamera& camera, const TrackerSetup& setup = {});
  Tracker(Shape shape, const DepthCamera& camera, const TrackerSetup& setup = {});
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;
  ~Tracker();

  // Poses of object k that differ by one of these motions are equivalent: a result has the one nearest to the
  // last result, at a start to the given pose, else to the camera's axes.
  void declare_symmetry(int k, const ShapeSymmetry& symmetry);

  // Shape k has the form of its object but not its size: the scale is estimated, from a mask whatever it is,
  // from other starts if it is within a fifth of 1, and refined in later frames. Poses are those of the
  // enlarged shape.
  void estimate_scale(int k);
  Scale scale(int k) const;

  // Forgets the past and starts at these places, one for each shape. A result is valid until the next call.
  // Where the measurements in a mask or a box have another size than the shape, the reason says so, with the
  // unit that is likely wrong; a mask of quite another size is refused.
  const TrackResult& start(const Frame& frame, const std::vector<Place>& places);
  const TrackResult& start(const Frame& frame, const Place& place = {});
  const TrackResult& start(const Frame& frame, const Eigen::Isometry3d& T_cam_obj);
  // The next frame. Throws std::logic_error before a start.
  const TrackResult& track(const Frame& frame);

 private:
  class Session;
  std::unique_ptr<Session> session_;
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "sdftrack/tracker.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "frame/depth_metres.h"
#include "sdftrack/shape_volume.h"
#include "tracking/options/option_schema.h"
#include "tracking/options/sensor_presets.h"
#include "tracking/start/start.h"

namespace sdftrack {

namespace {

constexpr double kRotationError = 1e-2;  // what is more is a scale or a mirror

Rigidd rigid_of(const Eigen::Isometry3d& T, const char* name) {
  const Eigen::Matrix3d R = T.linear();
  if (!T.matrix().allFinite() || R.determinant() < 0 ||
      (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRotationError)
    throw std::invalid_argument(std::string(name) + ": expected a rotation and a translation in metres");
  const auto row = [&](int i) { return Vec3d{R(i, 0), R(i, 1), R(i, 2)}; };
  return {nearest_rotation(Mat3d{row(0), row(1), row(2)}), {T(0, 3), T(1, 3), T(2, 3)}};
}

Eigen::Isometry3d isometry_of(const Rigidd& T) {
  Eigen::Isometry3d out;
  int i = 0;
  for (const Vec3d& row : {T.R.r0, T.R.r1, T.R.r2}) out.linear().row(i++) << row.x, row.y, row.z;
  out.translation() << T.t.x, T.t.y, T.t.z;
  out.makeAffine();
  return out;
}

Camera camera_of(const DepthCamera& c) {
  if (c.width <= 0 || c.height <= 0 || !(c.fx > 0 && c.fy > 0) || !std::isfinite(c.fx + c.fy + c.cx + c.cy))
    throw std::invalid_argument("camera: expected a width, a height and focal lengths above 0");
  return {{c.fx, c.fy, c.cx, c.cy}, c.width, c.height, c.distortion};
}

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

tracking::TrackerOptions options_of(const TrackerSetup& setup) {
  tracking::TrackerOptions options;
  if (!setup.sensor.empty()) tracking::state_sensor(setup.sensor, &options);
  for (const auto& [name, value] : setup.options) {
    OptionSetter setter{name, value};
    tracking::visit_options(options, setter);
    if (!setter.found) throw std::invalid_argument(name + ": no such option of a tracker");
  }
  return check_options(options);
}

TrackedPose pose_of(const tracking::ObjectResult& result) {
  TrackedPose out;
  out.status = static_cast<Status>(result.trust.status);
  out.reason = tracking::sentence(result.trust.reason);
  out.T_cam_obj = isometry_of(result.T_cam_obj);
  out.covariance = result.covariance;
  out.twist = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(result.twist.data());
  out.confidence = result.trust.confidence;
  return out;
}

}  // namespace

class Tracker::Session {
 public:
  Session(std::vector<Shape> shapes, const DepthCamera& camera, const TrackerSetup& setup)
      : shapes_(std::move(shapes)),
        core_(views_of(shapes_), camera_of(camera), options_of(setup), {setup.threads, setup.recover}) {}

  void declare_symmetry(int k, const ShapeSymmetry& symmetry) {
    if (k < 0 || k >= core_.object_count())
      throw std::invalid_argument("k: expected 0.." + std::to_string(core_.object_count() - 1));
    const auto vector_of = [](const Eigen::Vector3d& v) { return Vec3d{v.x(), v.y(), v.z()}; };
    frame::Symmetry out;
    for (const Eigen::Isometry3d& S : symmetry.discrete) out.discrete.push_back(rigid_of(S, "discrete"));
    for (const ShapeSymmetry::Axis& about : symmetry.axes) {
      if (!about.point.allFinite() || !about.direction.allFinite() || about.direction.isZero())
        throw std::invalid_argument("axes: expected directions that are not 0, and finite points");
      out.axes.push_back({vector_of(about.direction.normalized()), vector_of(about.point)});
    }
    core_.set_symmetry(k, out);
  }

  const TrackResult& start(const Frame& frame, const std::vector<Place>& places) {
    if (places.size() != shapes_.size())
      throw std::invalid_argument("places: expected one per shape (" + std::to_string(shapes_.size()) +
                                  "), got " + std::to_string(places.size()));
    std::vector<tracking::StartHint> hints;
    for (const Place& place : places) {
      hints.push_back({hint_of(place), {}});
      if (place.click_px) hints.back().click_px = {place.click_px->x(), place.click_px->y()};
    }
    return converted(tracking::start(&core_, frame_of(frame), hints));
  }

  const TrackResult& track(const Frame& frame) {
    if (core_.last_result().index < 0) throw std::logic_error("track: call start first");
    return converted(core_.track(frame_of(frame)));
  }

 private:
  static std::vector<SdfView> views_of(const std::vector<Shape>& shapes) {
    if (shapes.empty()) throw std::invalid_argument("shapes: expected at least one");
    std::vector<SdfView> out;
    for (const Shape& shape : shapes) out.push_back(shape.volume_->mesh.view());
    return out;
  }

  tracking::PoseHint hint_of(const Place& place) const {
    tracking::PoseHint out;
    if (place.T_cam_obj) out.T_cam_obj = rigid_of(*place.T_cam_obj, "T_cam_obj");
    if (place.mask) {
      out.mask.assign(place.mask, place.mask + pixels());
      if (std::all_of(out.mask.begin(), out.mask.end(), [](unsigned char m) { return m == 0; }))
        throw std::invalid_argument("mask: expected pixels that are not 0, got none");
    }
    if (place.box) {
      const auto& [x, y, width, height] = *place.box;
      if (width <= 0 || height <= 0 || x < 0 || y < 0 || x > core_.camera().width - width ||
          y > core_.camera().height - height)
        throw std::invalid_argument("box: expected one within the image, with a width and a height");
      out.box = frame::Rect{x, y, x + width, y + height};
    }
    return out;
  }

  // Borrows the frame's images, or holds the depth in metres.
  frame::DepthFrame frame_of(const Frame& frame) {
    if (frame.depth && frame.depth_m)
      throw std::invalid_argument("frame: expected depth or depth_m, got both");
    const Camera& camera = core_.camera();
    const float* depth_m = frame.depth_m;
    if (frame.depth) {
      if (!(frame.depth_unit_m > 0)) throw std::invalid_argument("depth_unit_m: expected a number above 0");
      depth_m_.resize(pixels());
      frame::metres_of(frame.depth, pixels(), frame.depth_unit_m, depth_m_.data());
      depth_m = depth_m_.data();
    }
    if (depth_m && frame::has_lattice({depth_m, camera.width, camera.height})) {
      if (!frame.depth) depth_m_.assign(depth_m, depth_m + pixels());
      frame::fill_lattice(camera.width, camera.height, depth_m_.data());
      depth_m = depth_m_.data();
    }
    color_ = {frame.rgb, appearance::aligned_map(camera.width, camera.height)};
    const appearance::ColorImage* const color = frame.rgb ? &color_ : nullptr;
    if (!depth_m) return core_.make_unreadable_frame({}, frame.time_s, color);
    return core_.make_frame({depth_m, camera.width, camera.height}, nullptr, frame.time_s, color);
  }

  const TrackResult& converted(const tracking::FrameResult& found) {
    result_.objects.clear();
    for (const tracking::ObjectResult& one : found.objects) result_.objects.push_back(pose_of(one));
    result_.index = found.index, result_.time_s = found.time_s;
    return result_;
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(core_.camera().width) * static_cast<std::size_t>(core_.camera().height);
  }

  std::vector<Shape> shapes_;
  tracking::Tracker core_;
  std::vector<float> depth_m_;
  appearance::ColorImage color_;
  TrackResult result_;
};

Tracker::Tracker(std::vector<Shape> shapes, const DepthCamera& camera, const TrackerSetup& setup)
    : session_(std::make_unique<Session>(std::move(shapes), camera, setup)) {}
Tracker::Tracker(Shape shape, const DepthCamera& camera, const TrackerSetup& setup)
    : Tracker(std::vector<Shape>{std::move(shape)}, camera, setup) {}
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

void Tracker::declare_symmetry(int k, const ShapeSymmetry& symmetry) {
  session_->declare_symmetry(k, symmetry);
}
const TrackResult& Tracker::start(const Frame& frame, const std::vector<Place>& places) {
  return session_->start(frame, places);
}
const TrackResult& Tracker::start(const Frame& frame, const Place& place) {
  return session_->start(frame, {place});
}
const TrackResult& Tracker::start(const Frame& frame, const Eigen::Isometry3d& T_cam_obj) {
  Place place;
  place.T_cam_obj = T_cam_obj;
  return session_->start(frame, {place});
}
const TrackResult& Tracker::track(const Frame& frame) { return session_->track(frame); }

}  // namespace sdftrack

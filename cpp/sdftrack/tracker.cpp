// SPDX-License-Identifier: MIT
#include "sdftrack/tracker.h"

#include <cmath>
#include <stdexcept>

#include "sdftrack/conversion.h"
#include "sdftrack/shape_volume.h"
#include "tracking/options/option_schema.h"
#include "tracking/options/sensor_presets.h"
#include "tracking/start/start.h"

namespace sdftrack {

namespace {

tracking::TrackerOptions options_of(const TrackerSetup& setup) {
  tracking::TrackerOptions options;
  if (!setup.sensor.empty()) tracking::state_sensor(setup.sensor, &options);
  set_options(setup.options, "a tracker", &options);
  return check_options(options);
}

}  // namespace

class Tracker::Session {
 public:
  Session(std::vector<Shape> shapes, const DepthCamera& camera, const TrackerSetup& setup)
      : shapes_(std::move(shapes)),
        core_(views_of(shapes_), camera_of(camera), options_of(setup), {setup.threads, setup.recover}),
        frames_(camera, setup.color) {}

  void declare_symmetry(int k, const ShapeSymmetry& symmetry) {
    check_object(k);
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

  void estimate_scale(int k) {
    check_object(k);
    core_.free_scale(k);
  }

  Scale scale(int k) const {
    check_object(k);
    const tracking::SizeTest::LogScale found = core_.scale(k);
    return {std::exp(found.mean), std::exp(found.mean) * found.sd};
  }

  const TrackResult& start(const Frame& frame, const std::vector<Place>& places) {
    if (places.size() != shapes_.size())
      throw std::invalid_argument("places: expected one per shape (" + std::to_string(shapes_.size()) +
                                  "), got " + std::to_string(places.size()));
    std::vector<tracking::StartHint> hints;
    for (const Place& place : places) {
      hints.push_back({hint_of(place, core_.camera()), {}});
      if (place.click_px) hints.back().click_px = {place.click_px->x(), place.click_px->y()};
    }
    return converted(tracking::start(&core_, frames_.read(frame, core_), hints));
  }

  const TrackResult& track(const Frame& frame) {
    if (core_.last_result().index < 0) throw std::logic_error("track: call start first");
    return converted(core_.track(frames_.read(frame, core_)));
  }

 private:
  void check_object(int k) const {
    if (k < 0 || k >= core_.object_count())
      throw std::invalid_argument("k: expected 0.." + std::to_string(core_.object_count() - 1));
  }

  static std::vector<SdfView> views_of(const std::vector<Shape>& shapes) {
    if (shapes.empty()) throw std::invalid_argument("shapes: expected at least one");
    std::vector<SdfView> out;
    for (const Shape& shape : shapes) out.push_back(shape.volume_->mesh.view());
    return out;
  }

  const TrackResult& converted(const tracking::FrameResult& found) {
    result_.objects.clear();
    for (const tracking::ObjectResult& one : found.objects) result_.objects.push_back(pose_of(one));
    result_.index = found.index, result_.time_s = found.time_s;
    return result_;
  }

  std::vector<Shape> shapes_;
  tracking::Tracker core_;
  FrameReader frames_;
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
void Tracker::estimate_scale(int k) { session_->estimate_scale(k); }
Scale Tracker::scale(int k) const { return session_->scale(k); }
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

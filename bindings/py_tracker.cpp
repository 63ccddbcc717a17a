// SPDX-License-Identifier: MIT
// The calls that use a frame.
#include "py_tracker.h"

#include <pybind11/stl.h>

#include "appearance.h"
#include "busy.h"
#include "pixel_mask.h"
#include "plane/ray_length.h"
#include "release_gil.h"
#include "track_results.h"
#include "tracking/start/size_check.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

constexpr int kCaller = 4;  // stack levels from here to the caller of Tracker.start
constexpr const char* kRayLength =
    "depth: the table or wall is flat only if the depth is the distance along each pixel's ray; "
    "expected Z, the distance along the optical axis: divide by the length of the ray (x, y, 1), camera.rays";

py::tuple box_to_tuple(const frame::Rect& r) { return py::make_tuple(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0); }

py::array image_from(std::vector<unsigned char> mask, const Camera& camera) {
  return to_numpy(std::move(mask), {camera.height, camera.width});
}

}  // namespace

PyTracker::PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera,
                     const tracking::TrackerOptions& options, int threads, bool recover,
                     tracking::MotionModel motion, int device, tracking::Collision collision) {
  const std::vector<SdfView> views = views_of(shapes, &held_);
  const ReleaseGil release;
  tracker_ = std::make_unique<tracking::Tracker>(
      views, camera, options, tracking::TrackerSettings{threads, recover, device, collision, motion});
}

void PyTracker::check_object(int k) const {
  if (k < 0 || k >= tracker_->object_count())
    throw py::value_error("k: expected 0.." + std::to_string(tracker_->object_count() - 1) + ", got " +
                          std::to_string(k));
}

std::vector<tracking::StartHint> PyTracker::start_hints_from(const py::list& places) const {
  std::vector<tracking::StartHint> hints;
  for (const py::handle& handle : places) {
    const auto place = py::reinterpret_borrow<py::object>(handle);
    if (py::isinstance<py::tuple>(place) && py::len(place) == 2) {
      const auto [x, y] = place.cast<std::tuple<double, double>>();
      hints.push_back({{}, Vec2d{x, y}});
    } else {
      hints.push_back({pose_hint_from(place, tracker_->camera()), {}});
    }
  }
  return hints;
}

std::vector<tracking::PoseHint> PyTracker::hints_from(const py::list& places) const {
  std::vector<tracking::PoseHint> where;
  for (const py::handle& place : places)
    where.push_back(pose_hint_from(py::reinterpret_borrow<py::object>(place), tracker_->camera()));
  return where;
}

void PyTracker::warn_of_ray_length() {
  if (PyErr_WarnEx(PyExc_UserWarning, kRayLength, kCaller) < 0) throw py::error_already_set();
}

py::dict PyTracker::start(const PyFrame& frame, const py::list& places, const Names& names) {
  const std::vector<tracking::StartHint> hints = start_hints_from(places);
  const Busy busy(&busy_, "tracker");
  bool bent = false;
  run<ReleaseGilUntilSignal>(frame, [&](const frame::DepthFrame& f) {
    bent = f.depth_m.data && plane::is_ray_length(f, tracker_->camera());
    tracking::start(tracker_.get(), f, hints);
  });
  if (bent) warn_of_ray_length();
  return result_to_dict(tracker_->last_result(), names);
}

py::list PyTracker::located(const PyFrame& frame, const py::list& places) {
  const std::vector<tracking::StartHint> hints = start_hints_from(places);
  std::vector<tracking::PoseHint> found;
  const Busy busy(&busy_, "tracker");
  run<ReleaseGilUntilSignal>(
      frame, [&](const frame::DepthFrame& f) { found = tracking::located(*tracker_, f, hints); });
  py::list out = places.attr("copy")();
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!hints[k].click_px) continue;
    if (const std::optional<frame::Rect>& box = found[k].box)
      out[k] = box_to_tuple(*box);
    else
      out[k] = image_from(std::move(found[k].mask), tracker_->camera());
  }
  return out;
}

py::tuple PyTracker::place_of_click(const PyFrame& frame, int k, const std::array<double, 2>& px) {
  check_object(k);
  tracking::RegionPlace place;
  const Busy busy(&busy_, "tracker");
  run<ReleaseGilUntilSignal>(frame, [&](const frame::DepthFrame& f) {
    place = tracking::place_of_click(*tracker_, k, f, {px[0], px[1]});
  });
  const py::object box = place.box ? py::object(box_to_tuple(*place.box)) : py::none();
  return py::make_tuple(image_from(std::move(place.region.on), tracker_->camera()), box);
}

void PyTracker::check_mask_size(const PyFrame& frame, int k, const py::object& mask,
                                const std::string& name) {
  check_object(k);
  const unsigned char* pixels = mask_view(mask, tracker_->camera());
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& f) {
    tracking::check_mask_size(f, tracker_->camera(), pixels, tracker_->shape(k), name);
  });
}

py::dict PyTracker::track(const PyFrame& frame, const Names& names) {
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& f) { tracker_->track(f); });
  return result_to_dict(tracker_->last_result(), names);
}

py::dict PyTracker::recover(const PyFrame& frame, const std::vector<int>& objects, const py::list& places,
                            const Names& names) {
  for (const int k : objects) check_object(k);
  const std::vector<tracking::PoseHint> hints = hints_from(places);
  if (hints.size() != objects.size())
    throw py::value_error("places: expected one per object (" + std::to_string(objects.size()) + "), got " +
                          std::to_string(hints.size()));
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& f) { tracker_->recover(f, objects, hints); });
  return result_to_dict(tracker_->last_result(), names);
}

py::tuple PyTracker::revisit(const PyFrame& frame) {
  const auto count = static_cast<py::ssize_t>(tracker_->object_count());
  py::array_t<double> poses({count, py::ssize_t{4}, py::ssize_t{4}});
  py::array_t<bool> sure(count);
  double* const to = poses.mutable_data();
  bool* const is_sure = sure.mutable_data();
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& f) {
    const std::vector<tracking::ObjectResult>& results = tracker_->revisit(f);
    for (std::size_t k = 0; k < results.size(); ++k) {
      write_matrix(results[k].T_cam_obj, to + 16 * k);
      is_sure[k] = results[k].sure_where_determined();
    }
  });
  return py::make_tuple(poses, sure);
}

py::object PyTracker::judge(const PyFrame& frame, int k, const py::array& T) {
  check_object(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  std::optional<tracking::Fitted> f;
  tracking::Trust trust;
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& depth) {
    f = tracker_->look(depth, k, T_cam_obj);
    if (f) trust = tracking::judge(*f, tracker_->options());
  });
  if (!f) return py::none();
  return judgement_to_dict(*f, trust, tracker_->options());
}

py::tuple PyTracker::membership(const PyFrame& frame) {
  const Camera& camera = tracker_->camera();
  const py::ssize_t h = camera.height, w = camera.width;
  py::array_t<float> weights({h, w, static_cast<py::ssize_t>(tracker_->object_count())}), foreground({h, w});
  float *const to = weights.mutable_data(), *const chance = foreground.mutable_data();
  const Busy busy(&busy_, "tracker");
  run(frame, [&](const frame::DepthFrame& f) { tracker_->find_membership(f, to, chance); });
  return py::make_tuple(weights, foreground);
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
// The calls that look at a frame.
#include "py_tracker.h"

#include <pybind11/stl.h>

#include "appearance.h"
#include "busy.h"
#include "region_colors.h"
#include "release_gil.h"
#include "track_results.h"
#include "volume.h"

namespace sdftrack {

PyTracker::PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera, const TrackerOptions& options,
                     int threads, bool recover, MotionModel motion, bool cuda, Collision collision) {
  std::vector<SdfView> views;
  for (const auto& [values, voxel_m, origin] : shapes) {
    volumes_.push_back(values);
    views.push_back(volume_view(values, voxel_m, origin));
  }
  const ReleaseGil release;
  tracker_ = std::make_unique<Tracker>(views, camera, options,
                                       TrackerSettings{threads, recover, cuda, collision, motion});
}

void PyTracker::check_object(int k) const {
  if (k < 0 || k >= tracker_->object_count())
    throw py::value_error("k: expected 0.." + std::to_string(tracker_->object_count() - 1) + ", got " +
                          std::to_string(k));
}

Whereabouts PyTracker::place_from(const py::object& place) const {
  Whereabouts where;
  if (place.is_none()) return where;
  if (py::isinstance<py::tuple>(place)) {
    const auto [x, y, w, h] = place.cast<std::tuple<int, int, int, int>>();
    where.box = Rect{x, y, x + w, y + h};
    return where;
  }
  const auto array = place.cast<py::array>();
  if (array.ndim() == 2 && array.shape(0) == 4 && array.shape(1) == 4) {
    where.T_cam_obj = rigid_from(array, "T");
    return where;
  }
  const Camera& camera = tracker_->camera();
  const unsigned char* mask = mask_view(place, camera);
  where.mask.assign(mask, mask + static_cast<std::size_t>(camera.width) * camera.height);
  return where;
}

std::vector<Whereabouts> PyTracker::places_from(const py::list& places) const {
  std::vector<Whereabouts> where;
  for (const py::handle& place : places)
    where.push_back(place_from(py::reinterpret_borrow<py::object>(place)));
  return where;
}

template <class Work>
py::dict PyTracker::run(const py::array& depth, const py::object& mask, double time_s,
                        const ColorImage& image, const Work& work) {
  const Busy busy(&busy_, "tracker");
  const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
  const unsigned char* mask_data = mask_view(mask, tracker_->camera());
  const std::vector<ObjectResult>* results;
  {
    const ReleaseGil release;
    results = &work(tracker_->make_frame(view, mask_data, time_s, image.rgb ? &image : nullptr));
  }
  return results_to_dict(*results);
}

py::dict PyTracker::start(const py::array& depth, const py::object& mask, double time_s,
                          const py::list& places, const py::object& color, const py::object& color_map) {
  const std::vector<Whereabouts> where = places_from(places);
  const ColorImage image = color_view(color, color_map);
  return run(
      depth, mask, time_s,
      image, [&](const DepthFrame& frame) -> const auto& { return tracker_->start(frame, where); });
}

py::dict PyTracker::track(const py::array& depth, const py::object& mask, double time_s,
                          const py::object& color, const py::object& color_map) {
  const ColorImage image = color_view(color, color_map);
  return run(
      depth, mask, time_s,
      image, [&](const DepthFrame& frame) -> const auto& { return tracker_->track(frame); });
}

py::dict PyTracker::recover(const py::array& depth, const py::object& mask, double time_s,
                            const std::vector<int>& objects, const py::list& places, const py::object& color,
                            const py::object& color_map) {
  for (const int k : objects) check_object(k);
  const std::vector<Whereabouts> where = places_from(places);
  if (where.size() != objects.size())
    throw py::value_error("places: expected one per object (" + std::to_string(objects.size()) + "), got " +
                          std::to_string(where.size()));
  const ColorImage image = color_view(color, color_map);
  return run(
      depth, mask, time_s, image, [&](const DepthFrame& frame) -> const auto& {
        return tracker_->recover(frame, objects, where);
      });
}

py::object PyTracker::judge(const py::array& depth, const py::object& mask, int k, const py::array& T) {
  check_object(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  const Busy busy(&busy_, "tracker");
  const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
  const unsigned char* mask_data = mask_view(mask, tracker_->camera());
  std::optional<Fitted> f;
  Trust trust;
  {
    const ReleaseGil release;
    f = tracker_->look(tracker_->make_frame(view, mask_data, 0, nullptr), k, T_cam_obj);
    if (f) trust = sdftrack::judge(*f, tracker_->options());
  }
  if (!f) return py::none();
  return judgement_to_dict(*f, trust, tracker_->options());
}

std::array<int, 4> PyTracker::region(int k, const py::array& T, double padding_m) {
  check_object(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  const Busy busy(&busy_, "tracker");
  const Shape& shape = tracker_->shape(k);
  const Rect r = projected_box(tracker_->camera(), shape, centred(T_cam_obj, shape), padding_m);
  return {r.x0, r.y0, r.x1, r.y1};
}

py::tuple PyTracker::look_at(const py::array& depth, const py::object& color, const py::object& color_map,
                             int k, const std::array<int, 4>& region) {
  check_object(k);
  const ColorImage image = color_view(color, color_map);
  const Busy busy(&busy_, "tracker");
  const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
  const Rect rect{region[0], region[1], region[2], region[3]};
  const py::ssize_t h = rect.y1 - rect.y0, w = rect.x1 - rect.x0;
  std::vector<float> foreground;
  std::vector<std::uint8_t> rgb;
  {
    const ReleaseGil release;
    const DepthFrame frame = tracker_->make_frame(view, nullptr, 0, image.rgb ? &image : nullptr);
    tracker_->find_foreground(frame, k, rect, &foreground);
    if (image.rgb) fetch_colors(frame, rect, &rgb);
  }
  const bool colored = !rgb.empty();
  return py::make_tuple(to_numpy(std::move(foreground), {h, w}),
                        colored ? py::object(to_numpy(std::move(rgb), {h, w, 3})) : py::none());
}

py::tuple PyTracker::membership(const py::array& depth, const py::object& color,
                                const py::object& color_map) {
  const ColorImage image = color_view(color, color_map);
  const Busy busy(&busy_, "tracker");
  const Camera& camera = tracker_->camera();
  const ImageView<float> view = image_view(depth, "depth", camera);
  const py::ssize_t h = camera.height, w = camera.width;
  py::array_t<float> weights({h, w, static_cast<py::ssize_t>(tracker_->object_count())}), foreground({h, w});
  float *const to = weights.mutable_data(), *const chance = foreground.mutable_data();
  {
    const ReleaseGil release;
    tracker_->find_membership(tracker_->make_frame(view, nullptr, 0, image.rgb ? &image : nullptr), to,
                              chance);
  }
  return py::make_tuple(weights, foreground);
}

}  // namespace sdftrack

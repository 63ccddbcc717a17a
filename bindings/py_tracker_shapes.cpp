// SPDX-License-Identifier: MIT
// The calls that change which shapes are tracked, and from where.
#include <pybind11/stl.h>

#include "busy.h"
#include "py_tracker.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack {

int PyTracker::add(const PyVolume& shape, const py::object& place) {
  const auto& [values, voxel_m, origin] = shape;
  const SdfView view = volume_view(values, voxel_m, origin);
  const Whereabouts where = place_from(place);
  const Busy busy(&busy_, "tracker");
  volumes_.push_back(values);
  const ReleaseGil release;
  return tracker_->add(view, where);
}

void PyTracker::remove(int k) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  tracker_->remove(k);
}

void PyTracker::reshape(int k, const PyVolume& shape, const py::array& seen, int least,
                        const py::array& boxes, const std::optional<py::array>& colors) {
  check_object(k);
  if (tracker_->object_count() != 1)
    throw py::value_error("k: expected the only object of its tracker, got one of " +
                          std::to_string(tracker_->object_count()));
  const auto& [values, voxel_m, origin] = shape;
  const SdfView view = volume_view(values, voxel_m, origin);
  if (!py::isinstance<py::array_t<std::uint16_t>>(seen) || seen.ndim() != 3 || seen.size() != values.size())
    throw py::type_error("seen: expected uint16 of the volume's shape, got " + describe(seen));
  const SeenView amount{static_cast<const std::uint16_t*>(seen.data()),
                        static_cast<int>(seen.strides(2) / static_cast<py::ssize_t>(sizeof(std::uint16_t))),
                        static_cast<std::uint16_t>(least)};
  const auto* first = reinterpret_cast<const VoxelBox*>(borrow<std::int32_t>(boxes, "boxes", {-1, 6}));
  PartialShape known{view, amount, {}, {first, first + boxes.shape(0)}, {}};
  if (colors) known.colors = painted_view(*colors, view), known.colors.least = amount.least;
  const Busy busy(&busy_, "tracker");
  {
    const ReleaseGil release;
    tracker_->reshape(k, std::move(known));
  }
  volumes_.assign({values, seen});  // the old ones are free now
  if (colors) volumes_.push_back(*colors);
}

void PyTracker::paint(int k, const py::array& colors) {
  check_object(k);
  const ColorView view = painted_view(colors, tracker_->shape(k).sdf);
  const Busy busy(&busy_, "tracker");
  volumes_.push_back(colors);
  tracker_->paint(k, view);
}

void PyTracker::set_camera(const Camera& camera) {
  const Busy busy(&busy_, "tracker");
  tracker_->set_camera(camera);
}

void PyTracker::set_pose(int k, const py::array& T, const std::optional<Matrix6d>& covariance) {
  check_object(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  const Busy busy(&busy_, "tracker");
  tracker_->set_pose(k, T_cam_obj, covariance);
}

std::vector<std::pair<int, int>> PyTracker::overlaps(const std::vector<int>& of) {
  for (const int k : of) check_object(k);
  const Busy busy(&busy_, "tracker");
  return tracker_->overlaps(of);
}

}  // namespace sdftrack

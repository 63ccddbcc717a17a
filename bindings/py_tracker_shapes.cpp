// SPDX-License-Identifier: MIT
// The calls that change the tracked shapes and their poses.
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "busy.h"
#include "pixel_mask.h"
#include "py_tracker.h"
#include "release_gil.h"
#include "symmetry.h"
#include "volume.h"

namespace sdftrack::bindings {

std::vector<SdfView> PyTracker::views_of(const std::vector<PyVolume>& shapes, std::vector<Held>* held) {
  std::vector<SdfView> views;
  for (const auto& [values, voxel_m, origin] : shapes) {
    held->push_back({values, {}, {}});
    views.push_back(volume_view(values, voxel_m, origin));
  }
  return views;
}

tracking::Poses PyTracker::poses_from(const py::array& poses) const {
  const auto count = static_cast<py::ssize_t>(tracker_->object_count());
  const double* m = borrow<double>(poses, "poses", {count, 4, 4});
  tracking::Poses out(static_cast<std::size_t>(count));
  for (std::optional<Rigidd>& pose : out) {
    if (std::all_of(m, m + 16, [](double x) { return std::isfinite(x); })) pose = read_matrix(m);
    m += 16;
  }
  return out;
}

void PyTracker::replace_shapes(const std::vector<PyVolume>& shapes, const py::array& poses) {
  const Busy busy(&busy_, "tracker");
  const tracking::Poses from = poses_from(poses);
  std::vector<Held> held;
  const std::vector<SdfView> views = views_of(shapes, &held);
  {
    const ReleaseGil release;
    tracker_->replace_shapes(views, from);
  }
  held_.swap(held);
}

void PyTracker::free_scale(int k) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  tracker_->free_scale(k);
}

py::object PyTracker::enlarged_volume(int k, double voxel_m) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  const frame::Shape& shape = tracker_->shape(k);
  const SdfView& sdf = shape.sdf;
  if (sdf.voxel_m == static_cast<float>(voxel_m)) return py::none();
  py::array_t<float> values({sdf.nz, sdf.ny, sdf.nx});
  std::copy_n(sdf.phi, values.size(), values.mutable_data());
  const Vec3d origin = sdf.origin_obj.cast<double>() + shape.centre_obj;
  return py::make_tuple(values, static_cast<double>(sdf.voxel_m), std::array{origin.x, origin.y, origin.z});
}

std::pair<double, double> PyTracker::scale(int k) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  const tracking::SizeTest::LogScale scale = tracker_->scale(k);
  return {scale.mean, scale.sd};
}

int PyTracker::add(const PyVolume& shape, const py::object& place) {
  const auto& [values, voxel_m, origin] = shape;
  const SdfView view = volume_view(values, voxel_m, origin);
  const tracking::PoseHint hint = pose_hint_from(place, tracker_->camera());
  const Busy busy(&busy_, "tracker");
  Held held{values, {}, {}};
  int k;
  {
    const ReleaseGil release;
    k = tracker_->add(view, hint);
  }
  held_.push_back(std::move(held));
  return k;
}

void PyTracker::remove(int k) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  tracker_->remove(k);
  held_.erase(held_.begin() + k);
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
  const frame::SeenView amount{
      static_cast<const std::uint16_t*>(seen.data()),
      static_cast<int>(seen.strides(2) / static_cast<py::ssize_t>(sizeof(std::uint16_t))),
      static_cast<std::uint16_t>(least)};
  const auto* first = reinterpret_cast<const sdf::VoxelBox*>(borrow<std::int32_t>(boxes, "boxes", {-1, 6}));
  frame::PartialShape known{view, amount, {}, {first, first + boxes.shape(0)}, {}};
  if (colors) known.colors = painted_view(*colors, view), known.colors.least = amount.least;
  const Busy busy(&busy_, "tracker");
  {
    const ReleaseGil release;
    tracker_->reshape(k, std::move(known));
  }
  held_[static_cast<std::size_t>(k)] = {values, seen, colors ? *colors : py::array()};
}

void PyTracker::paint(int k, const py::array& colors) {
  check_object(k);
  const energies::ColorView view = painted_view(colors, tracker_->shape(k).sdf);
  const Busy busy(&busy_, "tracker");
  tracker_->paint(k, view);
  held_[static_cast<std::size_t>(k)].colors = colors;
}

void PyTracker::set_camera(const Camera& camera) {
  const Busy busy(&busy_, "tracker");
  tracker_->set_camera(camera);
}

void PyTracker::set_pose(int k, const py::array& T, const std::optional<tracking::Matrix6d>& covariance) {
  check_object(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  const Busy busy(&busy_, "tracker");
  tracker_->set_pose(k, T_cam_obj, covariance);
}

void PyTracker::set_symmetry(int k, const py::array& discrete, const py::array& axes) {
  check_object(k);
  const frame::Symmetry symmetry = symmetry_from(discrete, axes);
  const Busy busy(&busy_, "tracker");
  tracker_->set_symmetry(k, symmetry);
}

void PyTracker::mark_unfound(int k, const std::string& kind) {
  check_object(k);
  const Busy busy(&busy_, "tracker");
  tracker_->mark_unfound(k, kind);
}

bool PyTracker::is_sure(int k) {
  const Busy busy(&busy_, "tracker");
  check_object(k);
  const auto& results = tracker_->last_result().objects;
  const auto i = static_cast<std::size_t>(k);
  return i < results.size() && results[i].sure_but_for_turns();
}

py::array_t<double> PyTracker::alternative_poses(int k) {
  const Busy busy(&busy_, "tracker");
  check_object(k);
  const std::vector<Rigidd> poses = tracker_->alternative_poses(k);
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (std::size_t i = 0; i < poses.size(); ++i) write_matrix(poses[i], out.mutable_data() + 16 * i);
  return out;
}

double PyTracker::evidence(int k) {
  const Busy busy(&busy_, "tracker");
  check_object(k);
  const auto& results = tracker_->last_result().objects;
  const auto i = static_cast<std::size_t>(k);
  return i < results.size() ? results[i].trust.evidence : 0;
}

py::array_t<double> PyTracker::best() {
  const Busy busy(&busy_, "tracker");
  const tracking::Poses& best = tracker_->last_good_poses();
  const auto count = static_cast<py::ssize_t>(best.size());
  py::array_t<double> out({count, py::ssize_t{4}, py::ssize_t{4}});
  double* to = out.mutable_data();
  std::fill_n(to, out.size(), tracking::kUnknown);
  for (std::size_t k = 0; k < best.size(); ++k)
    if (best[k]) write_matrix(*best[k], to + 16 * k);
  return out;
}

std::tuple<double, double, int> PyTracker::color_delay() {
  const Busy busy(&busy_, "tracker");
  const tracking::ColorDelay::Estimate now = tracker_->color_delay();
  return {now.delay_s, now.sd_s, now.frames};
}

void PyTracker::resume(int index, double time_s, const std::vector<bool>& followed, const py::array& best) {
  const Busy busy(&busy_, "tracker");
  tracker_->resume(index, time_s, followed, poses_from(best));
}

void PyTracker::interrupt(int index) {
  const Busy busy(&busy_, "tracker");
  tracker_->interrupt(index);
}

py::bytes PyTracker::state() {
  const Busy busy(&busy_, "tracker");
  return state_of(*tracker_);
}

bool PyTracker::set_state(const py::bytes& state) {
  const Busy busy(&busy_, "tracker");
  return sdftrack::set_state(std::string_view(state), tracker_.get());
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
#include "py_tracker.h"

#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>

#include <algorithm>
#include <cmath>

#include "pixel_mask.h"
#include "plane/ray_length.h"
#include "symmetry.h"
#include "track_results.h"
#include "tracking/start/size_check.h"

namespace sdftrack::bindings {

namespace {

constexpr const char* kRayLength =
    "depth: the table or wall is flat only if the depth is the distance along each pixel's ray; "
    "expected Z, the distance along the optical axis: divide by the length of the ray (x, y, 1), camera.rays";

std::vector<SdfView> views_of(const std::vector<PyVolume>& shapes, std::vector<PyTracker::Held>* held) {
  std::vector<SdfView> views;
  held->clear();
  for (const PyVolume& shape : shapes) {
    held->push_back({std::get<0>(shape), {}, {}});
    views.push_back(volume_view(shape));
  }
  return views;
}

py::array_t<double> poses_to_numpy(const tracking::Poses& poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  double* to = out.mutable_data();
  std::fill_n(to, out.size(), tracking::kUnknown);
  for (std::size_t k = 0; k < poses.size(); ++k)
    if (poses[k]) write_matrix(*poses[k], to + 16 * k);
  return out;
}

// (M, 4, 4), NaN: not known.
tracking::Poses poses_from(const py::array& poses, int count) {
  const double* m = borrow<double>(poses, "poses", {count, 4, 4});
  tracking::Poses out(static_cast<std::size_t>(count));
  for (std::optional<Rigidd>& pose : out) {
    if (std::all_of(m, m + 16, [](double x) { return std::isfinite(x); })) pose = read_matrix(m);
    m += 16;
  }
  return out;
}

}  // namespace

namespace of_tracker {

// -- Starts

// A hint of pose_hint_from, or (x, y): a click.
std::vector<tracking::StartHint> start_hints_from(const py::list& places, const Camera& camera) {
  std::vector<tracking::StartHint> hints;
  for (const py::handle& handle : places) {
    const auto place = py::reinterpret_borrow<py::object>(handle);
    if (py::isinstance<py::tuple>(place) && py::len(place) == 2) {
      const auto [x, y] = place.cast<std::tuple<double, double>>();
      hints.push_back({{}, Vec2d{x, y}});
    } else {
      hints.push_back({pose_hint_from(place, camera), {}});
    }
  }
  return hints;
}

py::tuple box_to_tuple(const frame::Rect& r) { return py::make_tuple(r.x0, r.y0, r.x1 - r.x0, r.y1 - r.y0); }

py::array image_from(std::vector<unsigned char> mask, const Camera& camera) {
  return to_numpy(std::move(mask), {camera.height, camera.width});
}

py::dict start(PyTracker& self, const PyFrame& frame, const py::list& places, const Names& names) {
  const std::vector<tracking::StartHint> hints = start_hints_from(places, self.core().camera());
  bool bent = false;
  self.run<ReleaseGilUntilSignal>(frame, [&](const frame::DepthFrame& f) {
    bent = f.depth_m.data && plane::is_ray_length(f, self.core().camera());
    tracking::start(&self.core(), f, hints);
  });
  if (bent) warn_of_ray_length(3);
  return result_to_dict(self.core().last_result(), names);
}

py::list located(PyTracker& self, const PyFrame& frame, const py::list& places) {
  const std::vector<tracking::StartHint> hints = start_hints_from(places, self.core().camera());
  std::vector<tracking::PoseHint> found;
  self.run<ReleaseGilUntilSignal>(
      frame, [&](const frame::DepthFrame& f) { found = tracking::located(self.core(), f, hints); });
  py::list out = places.attr("copy")();
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!hints[k].click_px) continue;
    if (const std::optional<frame::Rect>& box = found[k].box)
      out[k] = box_to_tuple(*box);
    else
      out[k] = image_from(std::move(found[k].mask), self.core().camera());
  }
  return out;
}

py::tuple place_of_click(PyTracker& self, const PyFrame& frame, int k, const std::array<double, 2>& px) {
  const tracking::Tracker& core = self.with(k);
  tracking::RegionPlace place;
  self.run<ReleaseGilUntilSignal>(frame, [&](const frame::DepthFrame& f) {
    place = tracking::place_of_click(core, k, f, {px[0], px[1]});
  });
  const py::object box = place.box ? py::object(box_to_tuple(*place.box)) : py::none();
  return py::make_tuple(image_from(std::move(place.region.on), core.camera()), box);
}

void check_mask_size(PyTracker& self, const PyFrame& frame, int k, const py::object& mask,
                     const std::string& name) {
  const tracking::Tracker& core = self.with(k);
  const unsigned char* pixels = mask_view(mask, core.camera());
  self.run(frame, [&](const frame::DepthFrame& f) {
    tracking::check_mask_size(f, core.camera(), pixels, core.shape(k), name);
  });
}

// -- Frames

py::dict track(PyTracker& self, const PyFrame& frame, const Names& names) {
  self.run(frame, [&](const frame::DepthFrame& f) { self.core().track(f); });
  return result_to_dict(self.core().last_result(), names);
}

py::dict recover(PyTracker& self, const PyFrame& frame, const std::vector<int>& objects,
                 const py::list& places, const Names& names) {
  for (const int k : objects) self.with(k);
  std::vector<tracking::PoseHint> hints;
  for (const py::handle& place : places)
    hints.push_back(pose_hint_from(py::reinterpret_borrow<py::object>(place), self.core().camera()));
  if (hints.size() != objects.size())
    throw py::value_error("places: expected one per object (" + std::to_string(objects.size()) + "), got " +
                          std::to_string(hints.size()));
  self.run(frame, [&](const frame::DepthFrame& f) { self.core().recover(f, objects, hints); });
  return result_to_dict(self.core().last_result(), names);
}

py::tuple revisit(PyTracker& self, const PyFrame& frame) {
  tracking::Poses poses;
  std::vector<unsigned char> sure;
  self.run(frame, [&](const frame::DepthFrame& f) {
    for (const tracking::ObjectResult& one : self.core().revisit(f))
      poses.push_back(one.T_cam_obj), sure.push_back(one.sure_where_determined());
  });
  const auto count = static_cast<py::ssize_t>(sure.size());
  return py::make_tuple(poses_to_numpy(poses), to_numpy(std::move(sure), {count}).attr("astype")("bool"));
}

py::object judge(PyTracker& self, const PyFrame& frame, int k, const py::array& T) {
  tracking::Tracker& core = self.with(k);
  const Rigidd T_cam_obj = rigid_from(T, "T");
  std::optional<tracking::Fitted> f;
  tracking::Trust trust;
  self.run(frame, [&](const frame::DepthFrame& depth) {
    f = core.look(depth, k, T_cam_obj);
    if (f) trust = tracking::judge(*f, core.options());
  });
  if (!f) return py::none();
  return judgement_to_dict(*f, trust, core.options());
}

py::tuple membership(PyTracker& self, const PyFrame& frame) {
  const Camera& camera = self.core().camera();
  const py::ssize_t h = camera.height, w = camera.width, count = self.core().object_count();
  py::array_t<float> weights({h, w, count}), foreground({h, w});
  float *const to = weights.mutable_data(), *const chance = foreground.mutable_data();
  self.run(frame, [&](const frame::DepthFrame& f) { self.core().find_membership(f, to, chance); });
  return py::make_tuple(weights, foreground);
}

// Of the last frame; nullptr: it did not have the object.
const tracking::ObjectResult* last_of(PyTracker& self, int k) {
  const auto& results = self.with(k).last_result().objects;
  return static_cast<std::size_t>(k) < results.size() ? &results[static_cast<std::size_t>(k)] : nullptr;
}

// -- Shapes

void replace_shapes(PyTracker& self, const std::vector<PyVolume>& shapes, const py::array& poses) {
  const tracking::Poses from = poses_from(poses, self.core().object_count());
  std::vector<PyTracker::Held> held;
  const std::vector<SdfView> views = views_of(shapes, &held);
  unlocked([&] { self.core().replace_shapes(views, from); });
  self.held.swap(held);
}

// Values, voxel size and origin of object k as it is enlarged; None: its voxels still have this size.
py::object enlarged_volume(PyTracker& self, int k, double voxel_m) {
  const frame::Shape& shape = self.with(k).shape(k);
  const SdfView& sdf = shape.sdf;
  if (sdf.voxel_m == static_cast<float>(voxel_m)) return py::none();
  return py::make_tuple(py::array_t<float>({sdf.nz, sdf.ny, sdf.nx}, sdf.phi),
                        static_cast<double>(sdf.voxel_m), sdf.origin_obj.cast<double>() + shape.centre_obj);
}

int add(PyTracker& self, const PyVolume& shape, const py::object& place) {
  const SdfView view = volume_view(shape);
  const tracking::PoseHint hint = pose_hint_from(place, self.core().camera());
  const int k = unlocked([&] { return self.core().add(view, hint); });
  self.held.push_back({std::get<0>(shape), {}, {}});
  return k;
}

// seen: uint16 [z, y, x], how much of the surface was seen near each voxel; less than `least` is unknown.
// boxes: int32 (n, 6), voxels x0 y0 z0 x1 y1 z1 that contain the surface.
void reshape(PyTracker& self, int k, const PyVolume& shape, const py::array& seen, int least,
             const py::array& boxes, const std::optional<py::array>& colors) {
  tracking::Tracker& core = self.with(k);
  if (core.object_count() != 1)
    throw py::value_error("k: expected the only object of its tracker, got one of " +
                          std::to_string(core.object_count()));
  const py::array& values = std::get<0>(shape);
  const SdfView view = volume_view(shape);
  if (!py::isinstance<py::array_t<std::uint16_t>>(seen) || seen.ndim() != 3 || seen.size() != values.size())
    throw py::type_error("seen: expected uint16 of the volume's shape, got " + describe(seen));
  const frame::SeenView amount{
      static_cast<const std::uint16_t*>(seen.data()),
      static_cast<int>(seen.strides(2) / static_cast<py::ssize_t>(sizeof(std::uint16_t))),
      static_cast<std::uint16_t>(least)};
  const auto* first = reinterpret_cast<const sdf::VoxelBox*>(borrow<std::int32_t>(boxes, "boxes", {-1, 6}));
  frame::PartialShape known{view, amount, {}, {first, first + boxes.shape(0)}, {}};
  if (colors) known.colors = painted_view(*colors, view), known.colors.least = amount.least;
  unlocked([&] { core.reshape(k, std::move(known)); });
  self.held[static_cast<std::size_t>(k)] = {values, seen, colors ? *colors : py::array()};
}

// colors: uint16 (z, y, x, 4) of object k's volume.
void paint(PyTracker& self, int k, const py::array& colors) {
  self.with(k).paint(k, painted_view(colors, self.core().shape(k).sdf));
  self.held[static_cast<std::size_t>(k)].colors = colors;
}

}  // namespace of_tracker

namespace {

void bind_inputs(py::module_& m) {
  py::native_enum<tracking::MotionModel>(m, "MotionModel", "enum.Enum",
                                         "Where an object is expected in the next frame.")
      .value("static", tracking::MotionModel::kStatic)
      .value("constant_velocity", tracking::MotionModel::kConstantVelocity)
      .value("adaptive", tracking::MotionModel::kAdaptive)
      .finalize();
  py::native_enum<tracking::Collision>(m, "Collision", "enum.Enum", "Penalty on the penetration of objects.")
      .value("none", tracking::Collision::kNone)
      .value("contact", tracking::Collision::kContact)
      .value("printed", tracking::Collision::kPrinted)
      .finalize();
  py::class_<PyFrame>(m, "TrackerFrame", "A frame for Tracker; without depth, `error` may give the reason.")
      .def(py::init<py::object, py::object, py::object, py::object, double, std::string, py::object>(),
           "depth"_a, "mask"_a = py::none(), "color"_a = py::none(), "color_map"_a = py::none(),
           "time_s"_a = tracking::kUnknown, "error"_a = "", "given"_a = py::none());
}

}  // namespace

void warn_of_ray_length(int levels) {
  if (PyErr_WarnEx(PyExc_UserWarning, kRayLength, levels) < 0) throw py::error_already_set();
}

PyTracker::PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera,
                     const tracking::TrackerOptions& options, int threads, bool recover,
                     tracking::MotionModel motion, int device, tracking::Collision collision) {
  const std::vector<SdfView> views = views_of(shapes, &held);
  const ReleaseGil release;
  tracker_ = std::make_unique<tracking::Tracker>(
      views, camera, options, tracking::TrackerSettings{threads, recover, device, collision, motion});
}

tracking::Tracker& PyTracker::with(int k) {
  if (k < 0 || k >= tracker_->object_count())
    throw py::value_error("k: expected 0.." + std::to_string(tracker_->object_count() - 1) + ", got " +
                          std::to_string(k));
  return *tracker_;
}

void bind_tracking(py::module_& m) {
  bind_inputs(m);
  py::class_<PyTracker>(m, "Tracker", "Tracks shapes; see sdftrack.Tracker.")
      .def(py::init<const std::vector<PyVolume>&, const Camera&, const tracking::TrackerOptions&, int, bool,
                    tracking::MotionModel, int, tracking::Collision>(),
           "shapes"_a, "camera"_a, "options"_a, "threads"_a, "recover"_a, "motion"_a, "device"_a,
           "collision"_a)
      .def("start", &of_tracker::start, "frame"_a, "places"_a, "names"_a)
      .def("located", &of_tracker::located, "frame"_a, "places"_a,
           "The places with masks or boxes in place of clicks; masks of another size than the shape are "
           "refused.")
      .def("place_of_click", &of_tracker::place_of_click, "frame"_a, "k"_a, "px"_a,
           "The region (H, W) bool of a click on object k, and the box to search in its place or None.")
      .def("check_mask_size", &of_tracker::check_mask_size, "frame"_a, "k"_a, "mask"_a, "name"_a,
           "ValueError, a sentence about `name`, if a mask is of another size than object k.")
      .def("track", &of_tracker::track, "frame"_a, "names"_a)
      .def("recover", &of_tracker::recover, "frame"_a, "objects"_a, "places"_a, "names"_a)
      .def("revisit", &of_tracker::revisit, "frame"_a,
           "Poses (M, 4, 4) in a frame outside the sequence, and whether each is sure.")
      .def("judge", &of_tracker::judge, "frame"_a, "k"_a, "T"_a,
           "The judgement of object k at an unchanged pose, with its grounds; None: too few measurements.")
      .def("membership", &of_tracker::membership, "frame"_a,
           "Soft weights (H, W, M) and P_f (H, W) of the last poses in this frame.")
      .def("add", &of_tracker::add, "shape"_a, "place"_a)
      .def(
          "remove",
          [](PyTracker& self, int k) { self.with(k).remove(k), self.held.erase(self.held.begin() + k); },
          "k"_a)
      .def("replace_shapes", &of_tracker::replace_shapes, "shapes"_a, "poses"_a)
      .def("reshape", &of_tracker::reshape, "k"_a, "shape"_a, "seen"_a, "least"_a, "boxes"_a,
           "colors"_a = py::none())
      .def("paint", &of_tracker::paint, "k"_a, "colors"_a)
      .def(
          "set_symmetry",
          [](PyTracker& self, int k, const py::array& discrete, const py::array& axes) {
            self.with(k).set_symmetry(k, symmetry_from(discrete, axes));
          },
          "k"_a, "discrete"_a, "axes"_a)
      .def(
          "mark_unfound",
          [](PyTracker& self, int k, const std::string& kind) { self.with(k).mark_unfound(k, kind); }, "k"_a,
          "kind"_a)
      .def(
          "free_scale", [](PyTracker& self, int k) { self.with(k).free_scale(k); }, "k"_a)
      .def("enlarged_volume", &of_tracker::enlarged_volume, "k"_a, "voxel_m"_a)
      .def(
          "scale",
          [](PyTracker& self, int k) {
            const tracking::SizeTest::LogScale scale = self.with(k).scale(k);
            return std::pair{scale.mean, scale.sd};
          },
          "k"_a, "Log scale and its sd.")
      .def(
          "is_sure",
          [](PyTracker& self, int k) {
            const tracking::ObjectResult* last = of_tracker::last_of(self, k);
            return last && last->sure_but_for_turns();
          },
          "k"_a, "Whether in the last frame only open directions count against the pose.")
      .def(
          "alternative_poses",
          [](PyTracker& self, int k) { return matrices_from(self.with(k).alternative_poses(k)); }, "k"_a)
      .def(
          "evidence",
          [](PyTracker& self, int k) {
            const tracking::ObjectResult* last = of_tracker::last_of(self, k);
            return last ? last->trust.evidence : 0;
          },
          "k"_a)
      .def("color_delay",
           [](PyTracker& self) {
             const tracking::ColorDelay::Estimate now = self.core().color_delay();
             return std::tuple{now.delay_s, now.sd_s, now.frames};
           })
      .def_property_readonly("index", [](PyTracker& self) { return self.core().last_result().index; })
      .def_property_readonly(
          "best", [](PyTracker& self) { return poses_to_numpy(self.core().last_good_poses()); },
          "(M, 4, 4), NaN: no good pose yet.")
      .def(
          "resume",
          [](PyTracker& self, int index, double time_s, const std::vector<bool>& followed,
             const py::array& best) {
            self.core().resume(index, time_s, followed, poses_from(best, self.core().object_count()));
          },
          "index"_a, "time_s"_a, "followed"_a, "best"_a)
      .def(
          "interrupt", [](PyTracker& self, int index) { self.core().interrupt(index); }, "index"_a)
      .def(
          "state", [](PyTracker& self) { return py::bytes(state_of(self.core())); },
          "All that the next frames depend on, but for shapes, camera and settings.")
      .def(
          "set_state",
          [](PyTracker& self, const py::bytes& state) {
            return set_state(std::string_view(state), &self.core());
          },
          "state"_a,
          "Goes on from such a state; False, and nothing changed, where it is one of another version.")
      .def(
          "set_camera", [](PyTracker& self, const Camera& camera) { self.core().set_camera(camera); },
          "camera"_a)
      .def(
          "set_pose",
          [](PyTracker& self, int k, const py::array& T,
             const std::optional<tracking::Matrix6d>& covariance) {
            self.with(k).set_pose(k, rigid_from(T, "T"), covariance);
          },
          "k"_a, "T"_a, "covariance"_a);
}

}  // namespace sdftrack::bindings

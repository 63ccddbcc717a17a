// SPDX-License-Identifier: MIT
// The reconstruction of an object while it is tracked: its keyframes, its volume and its frames.
#include "session.h"

#include <algorithm>

#include "beginning.h"
#include "pixel_mask.h"
#include "plane/ray_length.h"
#include "py_tracker.h"
#include "reconstruction/session/session.h"
#include "track_results.h"

namespace sdftrack::bindings {

namespace {

using reconstruction::GrowingVolume;
using reconstruction::Keyframe;
using reconstruction::Keyframes;
using Region = std::array<int, 4>;

template <class T>
std::vector<T> part_from(const py::array& part, const char* name, std::size_t size) {
  const T* from = borrow<T>(part, name, std::vector<py::ssize_t>(static_cast<std::size_t>(part.ndim()), -1));
  if (static_cast<std::size_t>(part.size()) != size && part.size() != 0)
    throw py::value_error(std::string(name) + ": expected the region's pixels, got " + describe(part));
  return {from, from + part.size()};
}

std::shared_ptr<Keyframe> keyframe_from(int index, const Region& region, const py::array& depth,
                                        const std::optional<py::array>& rgb, const py::array& foreground,
                                        const py::array& T, const std::optional<py::array>& mask,
                                        int recording) {
  auto out = std::make_shared<Keyframe>();
  out->index = index, out->recording = recording;
  out->region = {region[0], region[1], region[2], region[3]};
  const auto size = static_cast<std::size_t>(out->region.count());
  out->depth_m = part_from<float>(depth, "depth", size);
  if (rgb) out->rgb = part_from<std::uint8_t>(*rgb, "rgb", 3 * size);
  out->foreground = part_from<float>(foreground, "foreground", size);
  out->T_cam_obj = read_matrix(borrow<double>(T, "T_cam_obj", {4, 4}));
  if (mask) out->mask = part_from<unsigned char>(*mask, "mask", size);
  return out;
}

// A part of an image of the keyframe, which owns it; `empty`: its value without pixels.
template <class T>
py::object part_of(const py::object& self, std::vector<T> Keyframe::*member, py::ssize_t channels,
                   const py::object& empty) {
  auto& frame = self.cast<Keyframe&>();
  const std::vector<T>& values = frame.*member;
  const auto h = static_cast<py::ssize_t>(frame.region.height()),
             w = static_cast<py::ssize_t>(frame.region.width());
  if (values.empty() && h * w > 0) return empty;
  if (channels == 1) return py::array_t<T>({h, w}, values.data(), self);
  return values.empty() ? empty : py::object(py::array_t<T>({h, w, channels}, values.data(), self));
}

py::array_t<float> no_floats() { return py::array_t<float>(py::ssize_t{0}); }

py::dict record_of(const Keyframes& self) {
  const auto n = static_cast<py::ssize_t>(self.records().size());
  py::array_t<double> views({n, py::ssize_t{5}}), gaps({n, py::ssize_t{2}});
  py::array_t<std::int64_t> nearest({n, py::ssize_t{2}});
  double *view = views.mutable_data(), *gap = gaps.mutable_data();
  std::int64_t* who = nearest.mutable_data();
  for (const Keyframes::Record& r : self.records()) {
    view = std::copy(r.view.begin(), r.view.end(), view);
    gap = std::copy(r.gap.begin(), r.gap.end(), gap);
    who = std::copy(r.nearest.begin(), r.nearest.end(), who);
  }
  py::dict out;
  out["views"] = views, out["nearest"] = nearest, out["gaps"] = gaps;
  return out;
}

void restore_keyframes(Keyframes* to, std::vector<std::shared_ptr<Keyframe>> frames, const py::array& views,
                       const py::array& nearest, const py::array& gaps) {
  const auto n = static_cast<py::ssize_t>(frames.size());
  const double *view = borrow<double>(views, "views", {n, 5}), *gap = borrow<double>(gaps, "gaps", {n, 2});
  const auto* who = borrow<std::int64_t>(nearest, "nearest", {n, 2});
  std::vector<Keyframes::Record> records(frames.size());
  for (Keyframes::Record& r : records) {
    std::copy_n(view, 5, r.view.begin()), std::copy_n(gap, 2, r.gap.begin());
    r.nearest = {static_cast<int>(who[0]), static_cast<int>(who[1])};
    view += 5, gap += 2, who += 2;
  }
  to->restore(std::move(frames), std::move(records));
}

class PySession {
 public:
  PySession(const Camera& camera, const reconstruction::ReconstructionOptions& options, int voxels,
            const std::optional<double>& extent, int threads, int device,
            const std::optional<PyVolume>& initial, const reconstruction::Beginning& beginning)
      : initial_(initial), threads_(threads) {
    const std::optional<reconstruction::KnownShape> shape = known_shape_from(initial);
    const ReleaseGil release;
    core_ = std::make_unique<reconstruction::Session>(
        camera, options, reconstruction::SessionSettings{voxels, extent, threads, device}, shape, beginning);
  }

  py::dict start(const py::object& tracker, const PyFrame& frame, const Names& names) {
    bool bent = false;
    return served(
        tracker, frame, names,
        [&](const frame::DepthFrame& f, tracking::Tracker* own) {
          bent = plane::is_ray_length(f, own->camera());
          core_->start(own, f);
        },
        [&] {
          if (bent) warn_of_ray_length(4);
        });
  }
  py::dict track(const PyFrame& frame, const Names& names) {
    return served(
        tracker_, frame, names, [&](const frame::DepthFrame& f, tracking::Tracker*) { core_->track(f); },
        [] {});
  }
  py::dict resume(const py::object& tracker, const PyFrame& frame, const reconstruction::Beginning& shown,
                  bool masked, const Names& names) {
    return served(
        tracker, frame, names,
        [&](const frame::DepthFrame& f, tracking::Tracker* own) { core_->resume(own, f, shown, masked); },
        [] {});
  }
  bool add(const PyFrame& frame, const py::array& T) {
    const Rigidd T_cam_obj = rigid_from(T, "T");
    bool fused = false;
    tracker_.cast<PyTracker&>().run(frame,
                                    [&](const frame::DepthFrame& f) { fused = core_->add(f, T_cam_obj); });
    return fused;
  }
  // The tracker takes the shape as it is now, and the following frames.
  void set_tracker(const py::object& tracker) {
    auto* const own = &tracker.cast<PyTracker&>().core();
    tracker_ = tracker;
    core_->set_tracker(own), core_->show_shape(own);
  }
  // The tracker borrows it, as long as the session neither fuses nor ends.
  void show_shape(const py::object& tracker) { core_->show_shape(&tracker.cast<PyTracker&>().core()); }
  void restore(std::vector<reconstruction::Beginning> later, int index, const std::array<int, 3>& voxels,
               double voxel_m, const Vec3d& origin) {
    const sdf::Grid grid = grid_from({voxels[2], voxels[1], voxels[0]}, voxel_m, origin, "voxels");
    const ReleaseGil release;
    core_->restore(std::move(later), index, grid);
  }
  reconstruction::Session& core() { return *core_; }
  int threads() const { return threads_; }

 private:
  template <class Work, class After>
  py::dict served(const py::object& tracker, const PyFrame& frame, const Names& names, const Work& work,
                  const After& after) {
    auto& own = tracker.cast<PyTracker&>();
    own.run(frame, [&](const frame::DepthFrame& f) { work(f, &own.core()); });
    tracker_ = tracker;
    after();
    py::dict out = result_to_dict(core_->result().tracked, names);
    out["shape_change"] = core_->result().change_m;
    return out;
  }

  std::optional<PyVolume> initial_;  // its array is borrowed
  int threads_;
  std::unique_ptr<reconstruction::Session> core_;
  py::object tracker_;
};

// The volume of a session, for what rebuilds it.
struct PyGrowingVolume {
  std::shared_ptr<GrowingVolume> core;
  int threads;
};

void bind_keyframes(py::module_& m) {
  py::class_<Keyframe, std::shared_ptr<Keyframe>>(
      m, "Keyframe", "A fused frame: its images cropped to the object, and the pose used for fusion.")
      .def(py::init(&keyframe_from), "index"_a, "region"_a, "depth"_a, "rgb"_a, "foreground"_a, "T_cam_obj"_a,
           "mask"_a = py::none(), "recording"_a = 0)
      .def("__reduce__",
           [](const py::object& self) {
             return reduced(
                 self, {"index", "region", "depth", "rgb", "foreground", "T_cam_obj", "mask", "recording"});
           })
      .def_readonly("index", &Keyframe::index)
      .def_readonly("recording", &Keyframe::recording)
      .def_property_readonly("region",
                             [](const Keyframe& self) {
                               const auto [x0, y0, x1, y1] = self.region;
                               return py::make_tuple(x0, y0, x1, y1);
                             })
      .def_property_readonly(
          "depth", [](const py::object& self) { return part_of(self, &Keyframe::depth_m, 1, no_floats()); })
      .def_property_readonly(
          "rgb", [](const py::object& self) { return part_of(self, &Keyframe::rgb, 3, py::none()); })
      .def_property_readonly(
          "foreground",
          [](const py::object& self) { return part_of(self, &Keyframe::foreground, 1, no_floats()); })
      .def_property_readonly("mask",
                             [](const py::object& self) -> py::object {
                               if (self.cast<Keyframe&>().mask.empty()) return py::none();
                               return part_of(self, &Keyframe::mask, 1, py::none());
                             })
      .def_property(
          "T_cam_obj", [](const Keyframe& self) { return self.T_cam_obj; },
          [](Keyframe& self, const py::array& T) {
            self.T_cam_obj = read_matrix(borrow<double>(T, "T_cam_obj", {4, 4}));
          });
  py::class_<Keyframes>(m, "Keyframes", "Keeps a limited number of frames, spread over viewpoints and time.")
      .def(py::init<int>(), "most"_a)
      .def("add", &Keyframes::add, "keyframe"_a)
      .def_property_readonly("frames", [](const Keyframes& self) { return self.frames(); })
      .def("record", &record_of, "What the choice depends on, beside the frames.")
      .def(
          "restore",
          [](Keyframes& self, std::vector<std::shared_ptr<Keyframe>> frames, const py::array& views,
             const py::array& nearest,
             const py::array& gaps) { restore_keyframes(&self, std::move(frames), views, nearest, gaps); },
          "frames"_a, "views"_a, "nearest"_a, "gaps"_a);
}

void check_keyframe(const Keyframe& keyframe, const Camera& camera) {
  const auto& [x0, y0, x1, y1] = keyframe.region;
  check_region({x0, y0, x1, y1}, camera.width, camera.height);
  const auto size = static_cast<std::size_t>(keyframe.region.count());
  if (keyframe.depth_m.size() != size || (keyframe.mask.empty() && keyframe.foreground.size() != size))
    throw py::value_error("keyframe: expected depth, and a mask or a foreground, of its region");
}

void bind_growing_volume(py::module_& m) {
  py::class_<PyGrowingVolume>(m, "GrowingVolume",
                              "The volume of a session, enlarged where the shape needs it.")
      .def_property_readonly("core",
                             [](const PyGrowingVolume& self) {
                               return reconstruction_to_python(self.core->core(), self.threads);
                             })
      .def_property_readonly("fused", [](const PyGrowingVolume& self) { return self.core->fused(); })
      .def("emptied",
           [](const PyGrowingVolume& self) {
             return PyGrowingVolume{std::shared_ptr(self.core->emptied()), self.threads};
           })
      .def(
          "begin_recording",
          [](const PyGrowingVolume& self, const reconstruction::Beginning& beginning, const py::array& T) {
            self.core->begin_recording(beginning, rigid_from(T, "T"));
          },
          "beginning"_a, "T_cam_obj"_a)
      .def(
          "fuse",
          [](const PyGrowingVolume& self, const Keyframe& keyframe) {
            check_keyframe(keyframe, self.core->camera());
            const ReleaseGil release;
            self.core->fuse(keyframe);
          },
          "keyframe"_a)
      .def(
          "fuse_again",
          [](const PyGrowingVolume& self, const Keyframe& keyframe, const PyGrowingVolume& known,
             const py::array& T_cam_known) {
            check_keyframe(keyframe, self.core->camera());
            const Rigidd T = rigid_from(T_cam_known, "T_cam_known");
            const ReleaseGil release;
            self.core->fuse_again(keyframe, *known.core, T);
          },
          "keyframe"_a, "known"_a, "T_cam_known"_a)
      .def("measure", [](const PyGrowingVolume& self) {
        const ReleaseGil release;
        self.core->measure();
      });
}

}  // namespace

void bind_session(py::module_& m) {
  bind_keyframes(m), bind_growing_volume(m);
  py::class_<PySession>(m, "ReconstructionSession", "See sdftrack.Reconstructor.")
      .def(py::init<const Camera&, const reconstruction::ReconstructionOptions&, int,
                    const std::optional<double>&, int, int, const std::optional<PyVolume>&,
                    const reconstruction::Beginning&>(),
           "camera"_a, "options"_a, "voxels"_a, "extent"_a, "threads"_a, "device"_a, "initial"_a,
           "beginning"_a)
      .def("start", &PySession::start, "tracker"_a, "frame"_a, "names"_a)
      .def("track", &PySession::track, "frame"_a, "names"_a)
      .def("resume", &PySession::resume, "tracker"_a, "frame"_a, "shown"_a, "masked"_a, "names"_a)
      .def("add", &PySession::add, "frame"_a, "T_cam_obj"_a)
      .def("set_tracker", &PySession::set_tracker, "tracker"_a)
      .def("show_shape", &PySession::show_shape, "tracker"_a)
      .def("restore", &PySession::restore, "later"_a, "index"_a, "voxels"_a, "voxel_m"_a, "origin"_a)
      .def_property(
          "volume",
          [](PySession& self) {
            return PyGrowingVolume{self.core().shared_volume(), self.threads()};
          },
          [](PySession& self, const PyGrowingVolume& volume) { self.core().set_volume(volume.core); })
      .def_property_readonly(
          "keyframes", [](PySession& self) -> Keyframes& { return self.core().keyframes(); },
          py::return_value_policy::reference_internal)
      .def_property_readonly("beginning", [](PySession& self) { return self.core().beginning(); })
      .def_property_readonly("later", [](PySession& self) { return self.core().later(); })
      .def_property_readonly("index", [](PySession& self) { return self.core().index(); })
      .def_property_readonly(
          "part_seconds",
          [](PySession& self) {
            const reconstruction::SessionResult& last = self.core().result();
            py::dict out;
            out["track"] = last.track_s, out["fuse"] = last.fuse_s, out["reshape"] = last.show_s;
            return out;
          },
          "Time of tracking, fusing, and giving the tracker the new shape, in the last frame.")
      .def_property_readonly("least_seen", [](PySession& self) { return self.core().least_seen(); })
      .def_property_readonly(
          "tracker_noise",
          [](PySession& self) {
            const tracking::TrackerOptions options = self.core().tracker_options({});
            return std::pair{options.noise_m, options.noise_per_m};
          },
          "Depth noise for the tracker's options: noise_m and noise_per_m.");
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <atomic>

#include "array.h"
#include "busy.h"
#include "tracking/plane.h"
#include "tracking/tracker.h"
#include "volume.h"

namespace sdftrack {

namespace {

// Keeps the volumes alive, and refuses use by two threads at once.
class PyTracker {
 public:
  PyTracker(const std::vector<std::tuple<py::array, double, std::array<double, 3>>>& shapes,
            const Camera& camera, const TrackerOptions& options, int threads) {
    std::vector<SdfView> views;
    for (const auto& [values, voxel_m, origin] : shapes) {
      volumes_.push_back(values);
      views.push_back(volume_view(values, voxel_m, origin));
    }
    py::gil_scoped_release release;
    tracker_ = std::make_unique<Tracker>(views, camera, options, threads);
  }

  py::list start(const py::array& depth, const py::object& mask, const std::vector<py::array>& poses) {
    std::vector<Rigidd> T_cam_obj;
    for (std::size_t k = 0; k < poses.size(); ++k)
      T_cam_obj.push_back(rigid_from(poses[k], ("poses[" + std::to_string(k) + "]").c_str()));
    return run(depth, mask, [&](const ImageView<float>& d, const unsigned char* m) {
      return tracker_->start(d, m, T_cam_obj);
    });
  }
  py::list track(const py::array& depth, const py::object& mask) {
    return run(depth, mask,
               [&](const ImageView<float>& d, const unsigned char* m) { return tracker_->track(d, m); });
  }
  void set_camera(const Camera& camera) {
    const Busy busy(&busy_, "tracker");
    tracker_->set_camera(camera);
  }
  void set_pose(int k, const py::array& T) {
    if (k < 0 || k >= tracker_->object_count())
      throw py::value_error("k: expected 0.." + std::to_string(tracker_->object_count() - 1) + ", got " +
                            std::to_string(k));
    const Rigidd T_cam_obj = rigid_from(T, "T");
    const Busy busy(&busy_, "tracker");
    tracker_->set_pose(k, T_cam_obj);
  }

 private:
  template <class Work>
  py::list run(const py::array& depth, const py::object& mask, const Work& work) {
    const Busy busy(&busy_, "tracker");
    const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
    const unsigned char* mask_data = mask_view(mask, tracker_->camera());
    std::vector<ObjectResult> results;
    {
      py::gil_scoped_release release;
      results = work(view, mask_data);
    }
    py::list out;
    for (const ObjectResult& r : results) out.append(to_dict(r));
    return out;
  }

  static py::dict to_dict(const ObjectResult& r) {
    static constexpr const char* kStatus[] = {"ok", "weak", "lost", "bad_frame"};
    py::list steps;
    for (const TrackStep& s : r.steps)
      steps.append(py::make_tuple(s.step.cost, s.step.damping, s.step.accepted, s.scale_m, s.pixels));
    py::dict out;
    out["pose"] = matrix_from(r.T_cam_obj);
    out["covariance"] = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>(r.covariance);
    out["status"] = kStatus[static_cast<int>(r.trust.status)];
    out["reason"] = r.trust.reason;
    out["inliers"] = r.trust.inliers, out["confidence"] = r.trust.confidence;
    out["energy"] = r.cost, out["steps"] = steps;
    return out;
  }

  std::vector<py::array> volumes_;
  std::unique_ptr<Tracker> tracker_;
  std::atomic<bool> busy_{false};
};

py::object remove_plane(const py::array& depth, const Camera& camera, int start_x, int start_y,
                        double tolerance_m) {
  const std::vector<float> rays = camera.distorted() ? ray_table(camera) : std::vector<float>{};
  const DepthFrame frame{image_view(depth, "depth", camera), nullptr, rays.empty() ? nullptr : rays.data()};
  std::optional<Plane> plane;
  {
    py::gil_scoped_release release;
    plane = find_plane(frame, camera, {tolerance_m, start_x, start_y, {}});
  }
  if (!plane) return py::none();
  return py::make_tuple(std::array<double, 3>{plane->normal_cam.x, plane->normal_cam.y, plane->normal_cam.z},
                        plane->offset_m);
}

}  // namespace

void bind_tracking(py::module_& m) {
  py::class_<TrackerOptions> options(m, "TrackerOptions",
                                     "Options of the tracker; see sdftrack.TrackerOptions.");
  options.def(py::init<>());
#define SDFTRACK_OPTION(name) options.def_readwrite(#name, &TrackerOptions::name)
  SDFTRACK_OPTION(residual);
  SDFTRACK_OPTION(curvature);
  SDFTRACK_OPTION(outlier_floor);
  SDFTRACK_OPTION(scale_start_m);
  SDFTRACK_OPTION(scale_per_noise);
  SDFTRACK_OPTION(noise_m);
  SDFTRACK_OPTION(noise_per_m);
  SDFTRACK_OPTION(adapt_noise);
  SDFTRACK_OPTION(correlation_area_px);
  SDFTRACK_OPTION(padding_m);
  SDFTRACK_OPTION(retry_inliers);
  SDFTRACK_OPTION(far_scale_m);
  SDFTRACK_OPTION(far_padding_m);
  SDFTRACK_OPTION(max_pixels);
  SDFTRACK_OPTION(coarse_pixels);
  SDFTRACK_OPTION(min_pixels);
  SDFTRACK_OPTION(damping_start);
  SDFTRACK_OPTION(keep_damping);
  SDFTRACK_OPTION(coarse_steps);
  SDFTRACK_OPTION(fine_steps);
  SDFTRACK_OPTION(free_space);
  SDFTRACK_OPTION(free_space_scale_m);
  SDFTRACK_OPTION(free_space_weight);
  SDFTRACK_OPTION(free_space_points);
  SDFTRACK_OPTION(motion_sigma_m);
  SDFTRACK_OPTION(motion_sigma_rad);
  SDFTRACK_OPTION(drop_plane);
  SDFTRACK_OPTION(lost_inliers);
  SDFTRACK_OPTION(weak_inliers);
  SDFTRACK_OPTION(trust_points);
#undef SDFTRACK_OPTION

  py::class_<PyTracker>(m, "Tracker", "Tracks shapes one by one; see sdftrack.Tracker.")
      .def(py::init<const std::vector<std::tuple<py::array, double, std::array<double, 3>>>&, const Camera&,
                    const TrackerOptions&, int>(),
           py::arg("shapes"), py::arg("camera"), py::arg("options"), py::arg("threads"))
      .def("start", &PyTracker::start, py::arg("depth"), py::arg("mask"), py::arg("poses"))
      .def("track", &PyTracker::track, py::arg("depth"), py::arg("mask"))
      .def("set_camera", &PyTracker::set_camera, py::arg("camera"))
      .def("set_pose", &PyTracker::set_pose, py::arg("k"), py::arg("T"));
  m.def("find_plane", &remove_plane, py::arg("depth"), py::arg("camera"), py::arg("start_x"),
        py::arg("start_y"), py::arg("tolerance_m"), "Dominant plane as (normal, offset), or None.");
}

}  // namespace sdftrack

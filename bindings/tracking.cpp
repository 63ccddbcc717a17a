// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <atomic>

#include "appearance.h"
#include "array.h"
#include "busy.h"
#include "tracking/tracker.h"
#include "volume.h"

namespace sdftrack {

namespace {

// The colour of each reading of a region, 0 where there is none.
void fetch_colors(const DepthFrame& frame, const Rect& rect, std::vector<std::uint8_t>* rgb) {
  const ColorImage& image = *frame.color;
  rgb->clear();
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x) {
      const float z = frame.depth_m(x, y);
      int cx = 0, cy = 0;
      float depth = 0;
      const Vec2f u{static_cast<float>(x), static_cast<float>(y)};
      const bool found = z > 0 && image.map.find(u, z, &cx, &cy, &depth);
      const unsigned char none[3] = {}, *const c = found ? image.at(cx, cy) : none;
      rgb->insert(rgb->end(), c, c + 3);
      if (found && !(c[0] | c[1] | c[2])) rgb->back() = 1;  // black is a colour, too
    }
}

// Keeps the volumes alive, and refuses use by two threads at once.
class PyTracker {
 public:
  PyTracker(const std::vector<std::tuple<py::array, double, std::array<double, 3>>>& shapes,
            const Camera& camera, const TrackerOptions& options, int threads, bool recover,
            MotionModel motion, bool cuda, Collision collision) {
    std::vector<SdfView> views;
    for (const auto& [values, voxel_m, origin] : shapes) {
      volumes_.push_back(values);
      views.push_back(volume_view(values, voxel_m, origin));
    }
    py::gil_scoped_release release;
    tracker_ = std::make_unique<Tracker>(views, camera, options,
                                         TrackerSettings{threads, recover, cuda, collision, motion});
  }

  py::dict start(const py::array& depth, const py::object& mask, double time_s, const py::list& places,
                 const py::object& color, const py::object& color_map) {
    const std::vector<Whereabouts> where = places_from(places);
    const ColorImage image = color_view(color, color_map);
    return run(
        depth, mask, time_s,
        image, [&](const DepthFrame& frame) -> const auto& { return tracker_->start(frame, where); });
  }
  py::dict track(const py::array& depth, const py::object& mask, double time_s, const py::object& color,
                 const py::object& color_map) {
    const ColorImage image = color_view(color, color_map);
    return run(
        depth, mask, time_s,
        image, [&](const DepthFrame& frame) -> const auto& { return tracker_->track(frame); });
  }
  py::dict recover(const py::array& depth, const py::object& mask, double time_s,
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
  // What the tracker would say of object k at a pose as it is, and what it says it by; None: too few
  // readings.
  py::object judge(const py::array& depth, const py::object& mask, int k, const py::array& T) {
    check_object(k);
    const Rigidd T_cam_obj = rigid_from(T, "T");
    const Busy busy(&busy_, "tracker");
    const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
    const unsigned char* mask_data = mask_view(mask, tracker_->camera());
    std::optional<Fitted> f;
    Trust trust;
    {
      py::gil_scoped_release release;
      f = tracker_->look(tracker_->make_frame(view, mask_data, 0, nullptr), k, T_cam_obj);
      if (f) trust = sdftrack::judge(*f, tracker_->options());
    }
    if (!f) return py::none();
    py::dict out;
    out["status"] = kStatus[static_cast<int>(trust.status)], out["reason"] = trust.reason;
    out["inliers"] = trust.inliers, out["confidence"] = trust.confidence;
    out["covariance"] = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>(f->covariance);
    out["expected"] = f->seen.expected, out["agree"] = f->seen.agree, out["farther"] = f->seen.farther;
    out["nearer"] = f->seen.nearer, out["missing"] = f->seen.missing, out["gap_m"] = f->seen.gap_m;
    out["ends"] = f->outline.ends, out["runs_on"] = f->outline.runs_on;
    out["roughness"] = f->roughness,
    out["evidence"] = evidence_share(evidence_of(*f, tracker_->options()), 0);
    return out;
  }
  std::vector<std::pair<int, int>> overlaps(const std::vector<int>& of) {
    for (const int k : of) check_object(k);
    const Busy busy(&busy_, "tracker");
    return tracker_->overlaps(of);
  }
  // colors: uint16 (z, y, x, 4) beside object k's volume.
  void paint(int k, const py::array& colors) {
    check_object(k);
    const ColorView view = painted_view(colors, tracker_->shape(k).sdf);
    const Busy busy(&busy_, "tracker");
    volumes_.push_back(colors);
    tracker_->paint(k, view);
  }
  // seen: uint16 [z, y, x], how much of the surface was seen near each voxel; less than `least` is unknown.
  // boxes: int32 (n, 6), voxels x0 y0 z0 x1 y1 z1 that hold the surface.
  void reshape(int k, const std::tuple<py::array, double, std::array<double, 3>>& shape,
               const py::array& seen, int least, const py::array& boxes,
               const std::optional<py::array>& colors) {
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
      py::gil_scoped_release release;
      tracker_->reshape(k, std::move(known));
    }
    volumes_.assign({values, seen});  // the old ones are free now
    if (colors) volumes_.push_back(*colors);
  }
  // Where object k, padded, may be seen at a pose: x0, y0, x1, y1, half open.
  std::array<int, 4> region(int k, const py::array& T, double padding_m) {
    check_object(k);
    const Rigidd T_cam_obj = rigid_from(T, "T");
    const Busy busy(&busy_, "tracker");
    const Shape& shape = tracker_->shape(k);
    const Rect r = projected_box(tracker_->camera(), shape, centred(T_cam_obj, shape), padding_m);
    return {r.x0, r.y0, r.x1, r.y1};
  }
  // P_f (h, w) of a region by object k's colours (NaN: not known), and the region's colours (h, w, 3).
  py::tuple look_at(const py::array& depth, const py::object& color, const py::object& color_map, int k,
                    const std::array<int, 4>& region) {
    check_object(k);
    const ColorImage image = color_view(color, color_map);
    const Busy busy(&busy_, "tracker");
    const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
    const Rect rect{region[0], region[1], region[2], region[3]};
    const py::ssize_t h = rect.y1 - rect.y0, w = rect.x1 - rect.x0;
    std::vector<float> foreground;
    std::vector<std::uint8_t> rgb;
    {
      py::gil_scoped_release release;
      const DepthFrame frame = tracker_->make_frame(view, nullptr, 0, image.rgb ? &image : nullptr);
      tracker_->find_foreground(frame, k, rect, &foreground);
      if (image.rgb) fetch_colors(frame, rect, &rgb);
    }
    const bool colored = !rgb.empty();
    return py::make_tuple(to_numpy(std::move(foreground), {h, w}),
                          colored ? py::object(to_numpy(std::move(rgb), {h, w, 3})) : py::none());
  }
  // Soft weights (H, W, M) and P_f (H, W) of the last poses in this frame.
  py::tuple membership(const py::array& depth, const py::object& color, const py::object& color_map) {
    const ColorImage image = color_view(color, color_map);
    const Busy busy(&busy_, "tracker");
    const Camera& camera = tracker_->camera();
    const ImageView<float> view = image_view(depth, "depth", camera);
    const py::ssize_t h = camera.height, w = camera.width;
    py::array_t<float> weights({h, w, static_cast<py::ssize_t>(tracker_->object_count())}),
        foreground({h, w});
    float *const to = weights.mutable_data(), *const chance = foreground.mutable_data();
    {
      py::gil_scoped_release release;
      tracker_->find_membership(tracker_->make_frame(view, nullptr, 0, image.rgb ? &image : nullptr), to,
                                chance);
    }
    return py::make_tuple(weights, foreground);
  }
  void set_camera(const Camera& camera) {
    const Busy busy(&busy_, "tracker");
    tracker_->set_camera(camera);
  }
  void set_pose(int k, const py::array& T, const std::optional<Matrix6d>& covariance) {
    check_object(k);
    const Rigidd T_cam_obj = rigid_from(T, "T");
    const Busy busy(&busy_, "tracker");
    tracker_->set_pose(k, T_cam_obj, covariance);
  }
  int add(const std::tuple<py::array, double, std::array<double, 3>>& shape, const py::object& place) {
    const auto& [values, voxel_m, origin] = shape;
    const SdfView view = volume_view(values, voxel_m, origin);
    const Whereabouts where = place_from(place);
    const Busy busy(&busy_, "tracker");
    volumes_.push_back(values);
    py::gil_scoped_release release;
    return tracker_->add(view, where);
  }
  void remove(int k) {
    check_object(k);
    const Busy busy(&busy_, "tracker");
    tracker_->remove(k);
  }
  bool is_lost(int k) const {
    check_object(k);
    return tracker_->is_lost(k);
  }

 private:
  static constexpr const char* kStatus[] = {"ok", "weak", "lost", "bad_frame"};

  void check_object(int k) const {
    if (k < 0 || k >= tracker_->object_count())
      throw py::value_error("k: expected 0.." + std::to_string(tracker_->object_count() - 1) + ", got " +
                            std::to_string(k));
  }

  // None: anywhere; (4, 4) float64: a pose; H x W uint8: a mask; (x, y, w, h): a box.
  Whereabouts place_from(const py::object& place) const {
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
  std::vector<Whereabouts> places_from(const py::list& places) const {
    std::vector<Whereabouts> where;
    for (const py::handle& place : places)
      where.push_back(place_from(py::reinterpret_borrow<py::object>(place)));
    return where;
  }

  template <class Work>
  py::dict run(const py::array& depth, const py::object& mask, double time_s, const ColorImage& image,
               const Work& work) {
    const Busy busy(&busy_, "tracker");
    const ImageView<float> view = image_view(depth, "depth", tracker_->camera());
    const unsigned char* mask_data = mask_view(mask, tracker_->camera());
    const std::vector<ObjectResult>* results;
    {
      py::gil_scoped_release release;
      results = &work(tracker_->make_frame(view, mask_data, time_s, image.rgb ? &image : nullptr));
    }
    return to_dict(*results);
  }

  // Numbers of all objects in arrays, the rest in lists.
  static py::dict to_dict(const std::vector<ObjectResult>& results) {
    const auto n = static_cast<py::ssize_t>(results.size());
    py::array_t<double> poses({n, py::ssize_t{4}, py::ssize_t{4}}),
        covariances({n, py::ssize_t{6}, py::ssize_t{6}}), inliers(n), confidence(n), runner_up(n), energy(n);
    py::list status, reason, steps, color_used;
    for (py::ssize_t k = 0; k < n; ++k) {
      const ObjectResult& r = results[static_cast<std::size_t>(k)];
      write_matrix(r.T_cam_obj, poses.mutable_data(k, 0, 0));
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariances.mutable_data(k, 0, 0)) =
          r.covariance;
      inliers.mutable_at(k) = r.trust.inliers, confidence.mutable_at(k) = r.trust.confidence;
      runner_up.mutable_at(k) = r.runner_up;
      status.append(kStatus[static_cast<int>(r.trust.status)]);
      reason.append(r.trust.reason);
      color_used.append(r.color_used);
      energy.mutable_at(k) = r.cost;
      py::array_t<double> trials({static_cast<py::ssize_t>(r.steps.size()), py::ssize_t{5}});
      double* row = trials.mutable_data();
      for (const TrackStep& s : r.steps)
        for (const double x : {s.step.cost, s.step.damping, s.step.accepted ? 1.0 : 0.0, s.scale_m,
                               static_cast<double>(s.pixels)})
          *row++ = x;
      steps.append(trials);
    }
    py::dict out;
    out["poses"] = poses, out["covariances"] = covariances, out["inliers"] = inliers;
    out["confidence"] = confidence, out["runner_up"] = runner_up, out["status"] = status;
    out["reason"] = reason, out["steps"] = steps, out["color_used"] = color_used, out["energy"] = energy;
    return out;
  }

  std::vector<py::array> volumes_;
  std::unique_ptr<Tracker> tracker_;
  std::atomic<bool> busy_{false};
};

double correlation_area(const py::array& u_px, const py::array& v_px, const py::array& residual_m,
                        double scale_m, double outlier_floor) {
  const py::ssize_t n = u_px.size();
  const float* u = borrow<float>(u_px, "u_px", {-1});
  const float* v = borrow<float>(v_px, "v_px", {n});
  const float* residual = borrow<float>(residual_m, "residual_m", {n});
  PixelSet pixels;
  for (py::ssize_t i = 0; i < n; ++i) {
    pixels.push(u[i], v[i], 0.0f, 1.0f);
    pixels.hit_m.back() = residual[i], pixels.gain.back() = 0;
  }
  return CorrelationArea().measure(pixels, {static_cast<float>(scale_m), static_cast<float>(outlier_floor)});
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
  SDFTRACK_OPTION(coarse_floor);
  SDFTRACK_OPTION(coarse_floor_behind);
  SDFTRACK_OPTION(coarse_steps);
  SDFTRACK_OPTION(fine_steps);
  SDFTRACK_OPTION(free_space);
  SDFTRACK_OPTION(free_space_scale_m);
  SDFTRACK_OPTION(free_space_weight);
  SDFTRACK_OPTION(free_space_points);
  SDFTRACK_OPTION(photometric);
  SDFTRACK_OPTION(photometric_sigma);
  SDFTRACK_OPTION(photometric_weight);
  SDFTRACK_OPTION(photometric_pixels);
  SDFTRACK_OPTION(motion_sigma_m);
  SDFTRACK_OPTION(motion_sigma_rad);
  SDFTRACK_OPTION(drop_plane);
  SDFTRACK_OPTION(collision_tolerance_m);
  SDFTRACK_OPTION(union_sharpness);
  SDFTRACK_OPTION(coarse_union_sharpness);
  SDFTRACK_OPTION(color_likelihood);
  SDFTRACK_OPTION(color_prior);
  SDFTRACK_OPTION(color_object_rate);
  SDFTRACK_OPTION(color_background_rate);
  SDFTRACK_OPTION(color_free_space);
  SDFTRACK_OPTION(color_max_overlap);
  SDFTRACK_OPTION(recover_seeds);
  SDFTRACK_OPTION(lost_inliers);
  SDFTRACK_OPTION(weak_inliers);
  SDFTRACK_OPTION(lost_evidence);
  SDFTRACK_OPTION(weak_evidence);
  SDFTRACK_OPTION(search_odds);
  SDFTRACK_OPTION(trust_points);
#undef SDFTRACK_OPTION

  py::enum_<MotionModel>(m, "MotionModel", "Where an object is expected in the next frame.")
      .value("static", MotionModel::kStatic)
      .value("constant_velocity", MotionModel::kConstantVelocity);
  py::enum_<Collision>(m, "Collision", "What it costs objects to stand in one another.")
      .value("none", Collision::kNone)
      .value("contact", Collision::kContact)
      .value("printed", Collision::kPrinted);
  py::class_<PyTracker>(m, "Tracker", "Tracks shapes; see sdftrack.Tracker.")
      .def(py::init<const std::vector<std::tuple<py::array, double, std::array<double, 3>>>&, const Camera&,
                    const TrackerOptions&, int, bool, MotionModel, bool, Collision>(),
           py::arg("shapes"), py::arg("camera"), py::arg("options"), py::arg("threads"), py::arg("recover"),
           py::arg("motion"), py::arg("cuda"), py::arg("collision"))
      .def("start", &PyTracker::start, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("places"), py::arg("color") = py::none(), py::arg("color_map") = py::none())
      .def("track", &PyTracker::track, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("color") = py::none(), py::arg("color_map") = py::none())
      .def("recover", &PyTracker::recover, py::arg("depth"), py::arg("mask"), py::arg("time_s"),
           py::arg("objects"), py::arg("places"), py::arg("color") = py::none(),
           py::arg("color_map") = py::none())
      .def("add", &PyTracker::add, py::arg("shape"), py::arg("place"))
      .def("remove", &PyTracker::remove, py::arg("k"))
      .def("is_lost", &PyTracker::is_lost, py::arg("k"))
      .def("judge", &PyTracker::judge, py::arg("depth"), py::arg("mask"), py::arg("k"), py::arg("T"))
      .def("reshape", &PyTracker::reshape, py::arg("k"), py::arg("shape"), py::arg("seen"), py::arg("least"),
           py::arg("boxes"), py::arg("colors") = py::none())
      .def("region", &PyTracker::region, py::arg("k"), py::arg("T"), py::arg("padding_m"))
      .def("look_at", &PyTracker::look_at, py::arg("depth"), py::arg("color"), py::arg("color_map"),
           py::arg("k"), py::arg("region"))
      .def("paint", &PyTracker::paint, py::arg("k"), py::arg("colors"))
      .def("overlaps", &PyTracker::overlaps, py::arg("of"))
      .def("membership", &PyTracker::membership, py::arg("depth"), py::arg("color") = py::none(),
           py::arg("color_map") = py::none())
      .def("set_camera", &PyTracker::set_camera, py::arg("camera"))
      .def("set_pose", &PyTracker::set_pose, py::arg("k"), py::arg("T"), py::arg("covariance"));
  m.def(
      "twists",
      [](const py::array& before, const py::array& now, double elapsed_s) {
        const py::ssize_t n = before.ndim() > 0 ? before.shape(0) : 0;
        const double* a = borrow<double>(before, "before", {n, 4, 4});
        const double* b = borrow<double>(now, "now", {n, 4, 4});
        py::array_t<double> out({n, py::ssize_t{6}});
        for (py::ssize_t k = 0; k < n; ++k) {
          const Rigidd from = read_matrix(a + 16 * k), to = read_matrix(b + 16 * k);
          const Vec3d v = (1 / elapsed_s) * (to.t - from.t);
          const Vec3d w = (1 / elapsed_s) * rotation_log(to.R * transpose(from.R));
          const double twist[6] = {v.x, v.y, v.z, w.x, w.y, w.z};
          std::copy(twist, twist + 6, out.mutable_data(k, 0));
        }
        return out;
      },
      py::arg("before"), py::arg("now"), py::arg("elapsed_s"),
      "(v, w) from poses to poses, (M, 4, 4) each, camera axes.");
  m.def("correlation_area", &correlation_area, py::arg("u_px"), py::arg("v_px"), py::arg("residual_m"),
        py::arg("scale_m"), py::arg("outlier_floor"), "Pixels that share one error; 0: too few to tell.");

  m.def(
      "colors_at",
      [](const py::array& depth, const py::object& color, const py::object& map,
         const std::array<int, 4>& region) {
        const ColorImage image = color_view(color, map);
        const auto h = static_cast<int>(depth.shape(0)), w = static_cast<int>(depth.shape(1));
        DepthFrame frame{{borrow<float>(depth, "depth", {h, w}), w, h}, nullptr, nullptr};
        frame.color = &image;
        std::vector<std::uint8_t> rgb;
        fetch_colors(frame, {region[0], region[1], region[2], region[3]}, &rgb);
        return to_numpy(std::move(rgb), {region[3] - region[1], region[2] - region[0], 3});
      },
      py::arg("depth"), py::arg("color"), py::arg("color_map"), py::arg("region"));
}

}  // namespace sdftrack

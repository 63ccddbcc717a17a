// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <atomic>

#include "array.h"
#include "busy.h"
#include "calibration/intrinsics.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// The problem, with the volume that it refers to; one call at a time.
class Calibration {
 public:
  Calibration(const std::tuple<py::array, double, std::array<double, 3>>& volume,
              const calibration::Lens& lens, const std::vector<int>& free,
              const calibration::IntrinsicsOptions& options)
      : values_(std::get<0>(volume)), problem_(shape_of(volume), lens, unknowns(free), options) {}

  Busy turn() { return Busy(&busy_, "Calibration"); }
  calibration::IntrinsicsProblem& problem() { return problem_; }
  const calibration::IntrinsicsProblem& problem() const { return problem_; }

 private:
  static frame::Shape shape_of(const std::tuple<py::array, double, std::array<double, 3>>& volume) {
    const auto& [values, voxel_m, origin] = volume;
    return frame::make_shape(volume_view(values, voxel_m, origin), 1, 1);
  }
  static std::vector<calibration::LensUnknown> unknowns(const std::vector<int>& free) {
    std::vector<calibration::LensUnknown> out;
    for (const int which : free) {
      if (which < 0 || which >= calibration::kLensUnknowns) throw py::value_error("free: expected 0 to 8");
      out.push_back(static_cast<calibration::LensUnknown>(which));
    }
    return out;
  }

  py::array values_;
  calibration::IntrinsicsProblem problem_;
  std::atomic<bool> busy_{false};
};

int add(Calibration& self, const py::array& depth_m, const py::object& mask, const py::array& T_cam_obj) {
  const Busy busy = self.turn();
  const Camera& camera = self.problem().lens().camera;
  const std::vector<float> rays = camera.distorted() ? ray_table(camera) : std::vector<float>{};
  const frame::DepthFrame frame{image_view(depth_m, "depth", camera), mask_view(mask, camera),
                                rays.empty() ? nullptr : rays.data()};
  return self.problem().add(frame, rigid_from(T_cam_obj, "T_cam_obj"));
}

py::dict as_dict(const std::vector<calibration::FrameEstimate>& frames, int n) {
  const auto m = static_cast<py::ssize_t>(frames.size());
  std::vector<double> value, information, gradient, scatter, noise;
  std::vector<int> hits, open_shifts;
  for (const calibration::FrameEstimate& f : frames) {
    value.insert(value.end(), f.value.data(), f.value.data() + n);
    information.insert(information.end(), f.information.data(), f.information.data() + n * n);
    gradient.insert(gradient.end(), f.gradient.data(), f.gradient.data() + n);
    scatter.insert(scatter.end(), f.scatter.data(), f.scatter.data() + n * n);
    noise.push_back(f.noise_m), hits.push_back(f.hits), open_shifts.push_back(f.open_shifts);
  }
  py::dict out;
  out["value"] = to_numpy(std::move(value), {m, n});
  out["information"] = to_numpy(std::move(information), {m, n, n});
  out["gradient"] = to_numpy(std::move(gradient), {m, n});
  out["scatter"] = to_numpy(std::move(scatter), {m, n, n});
  out["noise_m"] = to_numpy(std::move(noise), {m});
  out["hits"] = to_numpy(std::move(hits), {m});
  out["open_shifts"] = to_numpy(std::move(open_shifts), {m});
  return out;
}

template <class Work>
py::dict estimates(Calibration& self, const Work& work) {
  const Busy busy = self.turn();
  std::vector<calibration::FrameEstimate> frames;
  {
    const ReleaseGil release;
    frames = work(self.problem());
  }
  return as_dict(frames, self.problem().free().count());
}

calibration::LensPrior prior_from(const Calibration& self, const std::vector<double>& value,
                                  const std::vector<double>& sd) {
  const auto n = static_cast<std::size_t>(self.problem().free().count());
  if (sd.size() != value.size() || (!sd.empty() && sd.size() != n))
    throw py::value_error("prior: expected one value and one sd for each free unknown");
  return {value, sd};
}

py::tuple as_tuple(const optim::LmRecord& record) {
  py::list steps;
  for (const optim::LmStep& s : record.steps) steps.append(py::make_tuple(s.cost, s.damping, s.accepted));
  return py::make_tuple(steps, optim::stop_name(record.stop), record.cost, static_cast<long>(record.count));
}

py::tuple solve(Calibration& self, double scale_m, const std::vector<double>& prior_value,
                const std::vector<double>& prior_sd, bool quick) {
  const Busy busy = self.turn();
  const calibration::LensPrior prior = prior_from(self, prior_value, prior_sd);
  optim::LmRecord record;
  {
    const ReleaseGil release;
    record = self.problem().solve(scale_m, prior_sd.empty() ? nullptr : &prior, quick);
  }
  return as_tuple(record);
}

py::tuple polish(Calibration& self) {
  const Busy busy = self.turn();
  optim::LmRecord record;
  {
    const ReleaseGil release;
    record = self.problem().polish();
  }
  return as_tuple(record);
}

// For the measurements of a frame that count: pixel, depth, and residual at the current state.
py::dict readings(Calibration& self, int frame) {
  const Busy busy = self.turn();
  const std::vector<calibration::LensFrame::Reading> found = self.problem().readings(frame);
  const calibration::LensPixels& pixels = self.problem().pixels(frame);
  std::vector<double> u, v, reading, residual;
  std::vector<unsigned char> hit;
  for (std::size_t i = 0; i < pixels.used.size(); ++i)
    if (pixels.used[i])
      u.push_back(pixels.u_px[i]), v.push_back(pixels.v_px[i]), reading.push_back(pixels.reading_m[i]);
  for (const calibration::LensFrame::Reading& r : found)
    residual.push_back(r.residual_m), hit.push_back(r.hit);
  const auto n = static_cast<py::ssize_t>(found.size());
  py::dict out;
  out["u_px"] = to_numpy(std::move(u), {n}), out["v_px"] = to_numpy(std::move(v), {n});
  out["reading_m"] = to_numpy(std::move(reading), {n});
  out["residual_m"] = to_numpy(std::move(residual), {n});
  out["hit"] = to_numpy(std::move(hit), {n});
  return out;
}

}  // namespace

void bind_calibration(py::module_& m) {
  py::class_<Calibration>(m, "Calibration", "Estimates the intrinsics from frames of a known object.")
      .def(py::init<const std::tuple<py::array, double, std::array<double, 3>>&, const calibration::Lens&,
                    const std::vector<int>&, const calibration::IntrinsicsOptions&>(),
           py::arg("volume"), py::arg("lens"), py::arg("free"), py::arg("options"))
      .def("add", &add, py::arg("depth"), py::arg("mask"), py::arg("T_cam_obj"))
      .def("drop", [](Calibration& self, const std::vector<int>& frames) { self.problem().drop(frames); })
      .def("solve", &solve, py::arg("scale_m"), py::arg("prior_value") = std::vector<double>{},
           py::arg("prior_sd") = std::vector<double>{}, py::arg("quick") = false)
      .def("polish", &polish)
      .def("readings", &readings, py::arg("frame"))
      .def("examine",
           [](Calibration& self) {
             return estimates(self, [](calibration::IntrinsicsProblem& p) { return p.examine(); });
           })
      .def("solve_each",
           [](Calibration& self) {
             return estimates(self, [](calibration::IntrinsicsProblem& p) { return p.solve_each(); });
           })
      .def(
          "coverage",
          [](Calibration& self, int columns, int rows) {
            if (columns < 1 || rows < 1) throw py::value_error("columns, rows: expected at least 1");
            return to_numpy(self.problem().coverage(columns, rows), {rows, columns});
          },
          py::arg("columns"), py::arg("rows"))
      .def(
          "bias",
          [](Calibration& self, std::uint64_t seed, int pairs) {
            const Busy busy = self.turn();
            const ReleaseGil release;
            return Eigen::VectorXd(self.problem().bias(seed, pairs));
          },
          py::arg("seed"), py::arg("pairs"))
      .def_property(
          "lens", [](Calibration& self) { return self.problem().lens(); },
          [](Calibration& self, const calibration::Lens& lens) { self.problem().set_lens(lens); })
      .def_property_readonly("poses", [](Calibration& self) {
        py::list out;
        for (int k = 0; k < self.problem().frame_count(); ++k)
          out.append(matrix_from(self.problem().T_cam_obj(k)));
        return out;
      });
}

}  // namespace sdftrack::bindings

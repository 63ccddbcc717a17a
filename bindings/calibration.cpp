// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>
#include <pybind11/native_enum.h>

#include "array.h"
#include "calibration/intrinsics.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// The problem, with the volume that it refers to.
class Calibration {
 public:
  Calibration(const PyVolume& volume, const calibration::Lens& lens, const std::vector<int>& free,
              const calibration::IntrinsicsOptions& options)
      : values_(std::get<0>(volume)), problem_(shape_of(volume), lens, unknowns(free), options) {}

  calibration::IntrinsicsProblem& problem() { return problem_; }
  const calibration::IntrinsicsProblem& problem() const { return problem_; }

 private:
  static frame::Shape shape_of(const PyVolume& volume) {
    return frame::make_shape(volume_view(volume), 1, 1);
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
};

int add(Calibration& self, const py::array& depth_m, const py::object& mask, const py::array& T_cam_obj) {
  const FrameWithRays given(depth_m, mask, self.problem().lens().camera);
  return self.problem().add(given.frame, rigid_from(T_cam_obj, "T_cam_obj"));
}

py::dict as_dict(const std::vector<calibration::FrameEstimate>& frames, int n) {
  using Frame = calibration::FrameEstimate;
  return py::dict(
      "value"_a = gathered<double>(frames, {n}, [](const Frame& f) { return f.value.data(); }),
      "information"_a = gathered<double>(frames, {n, n}, [](const Frame& f) { return f.information.data(); }),
      "gradient"_a = gathered<double>(frames, {n}, [](const Frame& f) { return f.gradient.data(); }),
      "scatter"_a = gathered<double>(frames, {n, n}, [](const Frame& f) { return f.scatter.data(); }),
      "noise_m"_a = gathered<double>(frames, {}, [](const Frame& f) { return f.noise_m; }),
      "hits"_a = gathered<int>(frames, {}, [](const Frame& f) { return f.hits; }),
      "open_shifts"_a = gathered<int>(frames, {}, [](const Frame& f) { return f.open_shifts; }));
}

template <class Work>
py::dict estimates(Calibration& self, const Work& work) {
  return as_dict(unlocked([&] { return work(self.problem()); }), self.problem().free().count());
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
  const calibration::LensPrior prior = prior_from(self, prior_value, prior_sd);
  return as_tuple(
      unlocked([&] { return self.problem().solve(scale_m, prior_sd.empty() ? nullptr : &prior, quick); }));
}

// For the measurements of a frame that count: pixel, depth, and residual at the current state.
py::dict readings(Calibration& self, int frame) {
  const std::vector<calibration::LensFrame::Reading> found = self.problem().readings(frame);
  const calibration::LensPixels& pixels = self.problem().pixels(frame);
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < pixels.used.size(); ++i)
    if (pixels.used[i]) used.push_back(i);
  using Reading = calibration::LensFrame::Reading;
  return py::dict(
      "u_px"_a = gathered<double>(used, {}, [&](std::size_t i) { return pixels.u_px[i]; }),
      "v_px"_a = gathered<double>(used, {}, [&](std::size_t i) { return pixels.v_px[i]; }),
      "reading_m"_a = gathered<double>(used, {}, [&](std::size_t i) { return pixels.reading_m[i]; }),
      "residual_m"_a = gathered<double>(found, {}, [](const Reading& r) { return r.residual_m; }),
      "hit"_a = gathered<unsigned char>(found, {}, [](const Reading& r) { return r.hit; }));
}

calibration::Lens lens_from(const Camera& camera, double skew, double depth_scale, double depth_offset_m) {
  return {camera, skew, depth_scale, depth_offset_m};
}

std::vector<double> lens_values(const calibration::Lens& lens) {
  std::vector<double> out;
  for (int j = 0; j < calibration::kLensUnknowns; ++j)
    out.push_back(lens.get(static_cast<calibration::LensUnknown>(j)));
  return out;
}

void bind_lens(py::module_& m) {
  py::class_<calibration::Lens>(m, "Lens", "A depth camera with skew, depth scale and depth offset.")
      .def(py::init(&lens_from), "camera"_a, "skew"_a = 0.0, "depth_scale"_a = 1.0, "depth_offset_m"_a = 0.0)
      .def_property_readonly("values", &lens_values,
                             "fx, fy, cx, cy, skew, k1, k2, depth scale, depth offset (m).");
  py::native_enum<energies::Residual>(m, "Residual", "enum.Enum", "What a pixel's residual is.")
      .value("point", energies::Residual::kPoint)
      .value("slope", energies::Residual::kSlope)
      .value("ray_hit", energies::Residual::kRayHit)
      .finalize();
  py::class_<calibration::IntrinsicsOptions>(m, "IntrinsicsOptions", "Options of a calibration.")
      .def(py::init<>())
      .def_readwrite("residual", &calibration::IntrinsicsOptions::residual)
      .def_readwrite("max_pixels", &calibration::IntrinsicsOptions::max_pixels)
      .def_readwrite("padding_m", &calibration::IntrinsicsOptions::padding_m)
      .def_readwrite("outlier_floor", &calibration::IntrinsicsOptions::outlier_floor)
      .def_readwrite("threads", &calibration::IntrinsicsOptions::threads);
}

}  // namespace

void bind_calibration(py::module_& m) {
  bind_lens(m);
  py::class_<Calibration>(m, "Calibration", "Estimates the intrinsics from frames of a known object.")
      .def(py::init<const PyVolume&, const calibration::Lens&, const std::vector<int>&,
                    const calibration::IntrinsicsOptions&>(),
           "volume"_a, "lens"_a, "free"_a, "options"_a)
      .def("add", &add, "depth"_a, "mask"_a, "T_cam_obj"_a)
      .def("drop", [](Calibration& self, const std::vector<int>& frames) { self.problem().drop(frames); })
      .def("solve", &solve, "scale_m"_a, "prior_value"_a = std::vector<double>{},
           "prior_sd"_a = std::vector<double>{}, "quick"_a = false)
      .def("polish",
           [](Calibration& self) { return as_tuple(unlocked([&] { return self.problem().polish(); })); })
      .def("readings", &readings, "frame"_a)
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
          "columns"_a, "rows"_a)
      .def(
          "bias",
          [](Calibration& self, std::uint64_t seed, int pairs) {
            const ReleaseGil release;
            return Eigen::VectorXd(self.problem().bias(seed, pairs));
          },
          "seed"_a, "pairs"_a)
      .def_property(
          "lens", [](Calibration& self) { return self.problem().lens(); },
          [](Calibration& self, const calibration::Lens& lens) { self.problem().set_lens(lens); })
      .def_property_readonly("poses", [](Calibration& self) {
        py::list out;
        for (int k = 0; k < self.problem().frame_count(); ++k) out.append(self.problem().T_cam_obj(k));
        return out;
      });
}

}  // namespace sdftrack::bindings

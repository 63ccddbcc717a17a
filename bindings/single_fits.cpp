// SPDX-License-Identifier: MIT
#include "tracking/fit/single_fits.h"

#include <pybind11/eigen.h>

#include <atomic>

#include "array.h"
#include "busy.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// A few shapes, ready to be fitted to frames of one camera.
class SingleFitter {
 public:
  SingleFitter(const std::vector<PyVolume>& volumes, const Camera& camera, int device)
      : camera_(camera), rays_(camera.distorted() ? ray_table(camera) : std::vector<float>{}), fits_(device) {
    for (const PyVolume& volume : volumes) {
      values_.push_back(std::get<0>(volume));
      shapes_.push_back(frame::make_shape(volume_view(volume), 1, 1));
    }
  }

  // of: the index of each pose's shape.
  py::list fit(const py::array& depth_m, const py::object& mask, const std::vector<std::size_t>& of,
               const std::vector<py::array>& T_cam_obj, const tracking::SingleFitOptions& options,
               int threads) {
    const Busy turn(&busy_, "pose fitter");
    frame::DepthFrame frame{image_view(depth_m, "depth", camera_), mask_view(mask, camera_),
                            rays_.empty() ? nullptr : rays_.data()};
    std::vector<const frame::Shape*> shapes;
    std::vector<Rigidd> starts;
    for (std::size_t k = 0; k < of.size(); ++k) {
      shapes.push_back(&shapes_.at(of[k]));
      const Rigidd T = rigid_from(T_cam_obj.at(k), "poses");
      starts.push_back({T.R, T * shapes.back()->centre_obj});
    }
    std::vector<tracking::SingleFit> found =
        unlocked([&] { return fits_.run(frame, camera_, shapes, starts, options, threads); });
    py::list out;
    for (std::size_t k = 0; k < found.size(); ++k) out.append(to_python(found[k], *shapes[k]));
    return out;
  }

 private:
  static py::dict to_python(const tracking::SingleFit& fit, const frame::Shape& shape) {
    py::list steps;
    for (const optim::LmStep& s : fit.steps) steps.append(py::make_tuple(s.cost, s.damping, s.accepted));
    py::dict out;
    out["pose"] = Rigidd{fit.T_cam_obj.R, fit.T_cam_obj * -shape.centre_obj};
    out["covariance"] = fit.covariance;
    out["cost"] = fit.cost, out["pixels"] = fit.pixels, out["hits"] = fit.hits;
    out["stop"] = optim::stop_name(fit.stop), out["steps"] = steps;
    return out;
  }

  Camera camera_;
  std::vector<float> rays_;
  std::vector<py::array> values_;  // keep the volumes alive
  std::vector<frame::Shape> shapes_;
  tracking::SingleFits fits_;
  std::atomic<bool> busy_{false};
};

}  // namespace

// Called after TrackerOptions is bound, so that the signature can name it.
void bind_single_fits(py::module_& m) {
  py::class_<SingleFitter>(m, "SingleFitter",
                           "Objects that are each fitted on their own; see sdftrack.PoseFitter.")
      .def(py::init<const std::vector<PyVolume>&, const Camera&, int>(), "volumes"_a, "camera"_a, "device"_a)
      .def(
          "fit",
          [](SingleFitter& self, const py::array& depth, const py::object& mask,
             const std::vector<std::size_t>& of, const std::vector<py::array>& T_cam_obj, double scale_m,
             const tracking::TrackerOptions& options, int max_steps, int rounds, int threads) {
            tracking::SingleFitOptions single;
            single.scale_m = scale_m, single.tracker = options, single.rules.max_steps = max_steps;
            single.rounds = rounds;
            return self.fit(depth, mask, of, T_cam_obj, single, threads);
          },
          "depth"_a, "mask"_a, "of"_a, "T_cam_obj"_a, "scale_m"_a, "options"_a, "max_steps"_a, "rounds"_a,
          "threads"_a);
}

}  // namespace sdftrack::bindings

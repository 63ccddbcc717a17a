// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>

#include <atomic>
#include <set>
#include <stdexcept>

#include "appearance.h"
#include "array.h"
#include "busy.h"
#include "energies/cuda_work.h"
#include "energies/sdf_energy.h"
#include "frame/selection.h"
#include "frame/shape.h"
#include "optim/lm.h"
#include "release_gil.h"
#include "tracking/options/sensor_noise.h"
#include "tracking/trust/color_evidence.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// The data energy of one object, or of the union of a few, in one frame, with everything it refers to: pixels
// fixed at construction, classes (ray hit or fallback) fixed at the start poses, so that its cost is a
// function of the state alone.
class FrameEnergy {
 public:
  FrameEnergy(const std::vector<PyVolume>& volumes, const Camera& camera, const py::array& depth_m,
              const py::object& mask, const py::list& T_cam_obj, const tracking::TrackerOptions& options,
              double scale_m, bool scale, bool intrinsics, int threads, const py::object& color,
              const py::object& color_map, int device)
      : camera_(camera) {
    for (const PyVolume& volume : volumes) {
      values_.push_back(std::get<0>(volume));
      shapes_.push_back(frame::make_shape(volume_view(volume), 1, 1));
    }
    start_ = state(T_cam_obj, {camera.K.fx, camera.K.fy, camera.K.cx, camera.K.cy},
                   scale ? std::vector<double>{1.0} : std::vector<double>{});
    const appearance::ColorImage image = color_view(color, color_map);
    FrameWithRays given(depth_m, mask, camera);
    frame::DepthFrame& frame = given.frame;
    frame.color = image.rgb ? &image : nullptr;
    for (std::size_t k = 0; k < shapes_.size(); ++k) add_pixels(frame, options, k);
    if (pixels_.count() == 0)
      throw py::value_error(
          "frame: no depth measurement near the object at this pose; is the pose in metres, T_cam_obj?");
    energies::SdfEnergyOptions energy{options.residual, options.curvature};
    energy.scale_m = static_cast<float>(scale_m);
    energy.outlier_floor = static_cast<float>(options.outlier_floor);
    energy.warm_hits = false;
    energy.scale = scale, energy.intrinsics = intrinsics, energy.threads = threads;
    if (frame.color) {
      look_at_colors(frame, options);
      energy.color = true, energy.color_likelihood = options.color_likelihood;
      energy.color_prior = static_cast<float>(options.color_prior);
    }
    energy.sharpness = static_cast<float>(options.union_sharpness);
    std::vector<SdfView> sdfs;
    for (const frame::Shape& shape : shapes_) sdfs.push_back(shape.sdf);
    energy_ =
        std::make_unique<energies::SdfEnergy>(sdfs.data(), static_cast<int>(sdfs.size()), &pixels_, energy);
    energy_->classify(start_, 8);
    if (device >= 0) {
      device_ = std::make_unique<energies::CudaWork>(device);
      energy_->enter_device(device_.get());
    }
  }

  optim::State state(const py::list& T_cam_obj, const std::array<double, 4>& K,
                     const std::vector<double>& scales) const {
    if (T_cam_obj.size() != shapes_.size())
      throw py::value_error("poses: expected one per shape (" + std::to_string(shapes_.size()) + "), got " +
                            std::to_string(T_cam_obj.size()));
    optim::State x{{}, {K[0], K[1], K[2], K[3]}, {}};
    for (std::size_t k = 0; k < shapes_.size(); ++k) {
      const Rigidd T = rigid_from(py::array(py::reinterpret_borrow<py::object>(T_cam_obj[k])), "poses");
      x.T_obj_cam.push_back(inverse(Rigidd{T.R, T * shapes_[k].centre_obj}));
    }
    for (const double scale : scales) x.log_scale.push_back(std::log(scale));
    return x;
  }
  py::tuple from_state(const optim::State& x) const {
    py::list poses;
    for (std::size_t k = 0; k < shapes_.size(); ++k) {
      const Rigidd T = inverse(x.T_obj_cam[k]);
      poses.append(Rigidd{T.R, T * -shapes_[k].centre_obj});
    }
    const double scale = x.log_scale.empty() ? 1.0 : std::exp(x.log_scale[0]);
    return py::make_tuple(poses, std::array<double, 4>{x.K.fx, x.K.fy, x.K.cx, x.K.cy}, scale);
  }

  // Adds the pixels around object k that no earlier object has added.
  void add_pixels(const frame::DepthFrame& frame, const tracking::TrackerOptions& options, std::size_t k) {
    frame::PixelSelection selection;
    energies::PixelSet around;
    selection.choose(frame, camera_, shapes_[k], inverse(start_.T_obj_cam[k]),
                     tracking::sensor_noise(options), options.padding_m, nullptr);
    selection.pack(options.max_pixels, &around);
    const std::set<int> known(pixels_.at.begin(), pixels_.at.end());
    for (int i = 0; i < around.count(); ++i) {
      if (known.count(around.at[static_cast<std::size_t>(i)]) > 0) continue;
      pixels_.resize(pixels_.count() + 1);
      pixels_.copy(around, i, pixels_.count() - 1);
    }
  }

  // The model is learned from this frame: inside and around its mask, or at the start pose.
  void look_at_colors(const frame::DepthFrame& frame, const tracking::TrackerOptions& options) {
    const Rigidd T_cam_obj = inverse(start_.T_obj_cam[0]);
    tracking::ColorReader reader;
    appearance::ColorCounts counts;
    appearance::ColorModel model(static_cast<float>(options.color_prior));
    if (frame.mask)
      tracking::count_mask_colors(frame, camera_, frame.mask, &reader, &counts);
    else
      tracking::count_colors(frame, camera_, shapes_[0], T_cam_obj, options.padding_m,
                             camera_.width * camera_.height, model, &reader, &counts, {},
                             options.color_learning_printed);
    model.update(counts, 1, 1);
    if (!model.known())
      throw py::value_error("color: too few pixels of the object at this pose for a histogram (" +
                            std::to_string(counts.object_pixels) +
                            "); give the frame a mask, or a better pose");
    reader.open(frame, camera_, frame::projected_box(camera_, shapes_[0], T_cam_obj, options.padding_m),
                frame::depth_range(shapes_[0], T_cam_obj, options.padding_m));
    tracking::fetch_foreground(model, reader, &pixels_);
  }

  energies::SdfEnergy& energy() { return *energy_; }
  const energies::PixelSet& pixels() const { return pixels_; }
  // Every use of energy() writes to its working memory.
  Busy turn() { return {&busy_, "energy"}; }

 private:
  std::vector<py::array> values_;  // keep the volumes alive
  std::vector<frame::Shape> shapes_;
  Camera camera_;
  energies::PixelSet pixels_;
  optim::State start_;
  std::unique_ptr<energies::CudaWork> device_;  // nullptr: CPU
  std::unique_ptr<energies::SdfEnergy> energy_;
  std::atomic<bool> busy_{false};
};

py::dict linearize(FrameEnergy& self, const optim::State& x) {
  const Busy busy = self.turn();
  optim::NormalEquations eq;
  {
    const ReleaseGil release;
    eq.reset(self.energy().unknowns().size());
    self.energy().linearize(x, &eq);
  }
  py::dict out;
  out["cost"] = eq.cost, out["count"] = static_cast<long>(eq.count);
  out["gradient"] = eq.gradient, out["hessian"] = eq.hessian;
  return out;
}

py::dict residuals(FrameEnergy& self, const optim::State& x) {
  const Busy busy = self.turn();
  energies::PixelReadings r;
  unlocked([&] { self.energy().read(x, &r); });
  const auto n = static_cast<py::ssize_t>(r.residual_m.size());
  py::dict out;
  out["residual_m"] = to_numpy(std::move(r.residual_m), {n});
  out["weight"] = to_numpy(std::move(r.weight), {n});
  out["hit"] = to_numpy(std::move(r.hit), {n});
  out["u_px"] = to_numpy(std::vector<float>(self.pixels().u_px), {n});
  out["v_px"] = to_numpy(std::vector<float>(self.pixels().v_px), {n});
  out["foreground"] = to_numpy(std::vector<float>(self.pixels().foreground), {n});
  out["depth_m"] = to_numpy(std::vector<float>(self.pixels().depth_m), {n});
  return out;
}

py::tuple run_minimize(FrameEnergy& self, const optim::State& x, const optim::LmOptions& options) {
  const Busy busy = self.turn();
  optim::LmResult result = unlocked([&] { return optim::minimize(self.energy(), x, options); });
  py::list steps;
  for (const optim::LmStep& s : result.steps) steps.append(py::make_tuple(s.cost, s.damping, s.accepted));
  return py::make_tuple(self.from_state(result.x), steps, optim::stop_name(result.stop), result.cost,
                        static_cast<long>(result.count));
}

void bind_optimizer(py::module_& m) {
  py::class_<optim::State>(m, "State", "A point in the space of unknowns, in the core's own frames.");
  py::class_<optim::LmOptions>(m, "LmOptions", "Options of the optimiser.")
      .def(py::init<>())
      .def_readwrite("max_steps", &optim::LmOptions::max_steps)
      .def_readwrite("damping", &optim::LmOptions::damping)
      .def_readwrite("damping_up", &optim::LmOptions::damping_up)
      .def_readwrite("damping_down", &optim::LmOptions::damping_down)
      .def_readwrite("damping_min", &optim::LmOptions::damping_min)
      .def_readwrite("damping_max", &optim::LmOptions::damping_max)
      .def_readwrite("step_m", &optim::LmOptions::step_m)
      .def_readwrite("step_rad", &optim::LmOptions::step_rad)
      .def_readwrite("step_relative", &optim::LmOptions::step_relative)
      .def_readwrite("cost_relative", &optim::LmOptions::cost_relative)
      .def_readwrite("cost_gain", &optim::LmOptions::cost_gain)
      .def_readwrite("sure_gain", &optim::LmOptions::sure_gain)
      .def_readwrite("fixed", &optim::LmOptions::fixed);
}

}  // namespace

// Called after TrackerOptions is bound, so that the signature can name it.
void bind_frame_energy(py::module_& m) {
  bind_optimizer(m);
  py::class_<FrameEnergy>(m, "FrameEnergy", "Data energy of one object in one frame; see sdftrack.Energy.")
      .def(py::init<const std::vector<PyVolume>&, const Camera&, const py::array&, const py::object&,
                    const py::list&, const tracking::TrackerOptions&, double, bool, bool, int,
                    const py::object&, const py::object&, int>(),
           "volumes"_a, "camera"_a, "depth"_a, "mask"_a, "T_cam_obj"_a, "options"_a, "scale_m"_a, "scale"_a,
           "intrinsics"_a, "threads"_a, "color"_a = py::none(), "color_map"_a = py::none(), "device"_a = -1)
      .def("state", &FrameEnergy::state, "T_cam_obj"_a, "K"_a, "scales"_a)
      .def("cost",
           [](FrameEnergy& self, const optim::State& x) {
             const Busy busy = self.turn();
             const ReleaseGil release;
             return self.energy().cost(x);
           })
      .def("linearize", &linearize)
      .def("retract",
           [](FrameEnergy& self, const optim::State& x, const Eigen::VectorXd& delta) {
             if (delta.size() != self.energy().unknowns().size())
               throw py::value_error("delta: expected " + std::to_string(self.energy().unknowns().size()) +
                                     " numbers, got " + std::to_string(delta.size()));
             return self.from_state(optim::retract(self.energy().unknowns(), x, delta));
           })
      .def("residuals", &residuals)
      .def("minimize", &run_minimize, "start"_a, "options"_a);
}

}  // namespace sdftrack::bindings

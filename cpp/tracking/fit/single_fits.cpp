// SPDX-License-Identifier: MIT
#include "tracking/fit/single_fits.h"

#include <algorithm>

#include "base/parallel.h"
#include "energies/pose_fits.h"
#include "energies/sdf_energy.h"
#include "frame/selection_cuda.h"
#include "tracking/fit/stages.h"
#include "tracking/options/sensor_noise.h"

namespace sdftrack::tracking {

namespace {

using Field = energies::SingleObject<float>;
using Penalty = energies::DepthLogistic<float>;
using DeviceFits = energies::CudaPoseFits<Field, Penalty>;

energies::SdfEnergyOptions energy_of(const SingleFitOptions& options) {
  energies::SdfEnergyOptions energy{options.tracker.residual, options.tracker.curvature};
  energy.scale_m = float(options.scale_m);
  energy.outlier_floor = float(options.tracker.outlier_floor);
  return energy;
}

// From the normal equations at the end alone, as if the measurements' errors were independent.
Matrix6d covariance_of(const Matrix6d& hessian, int pixels, const frame::Shape& shape,
                       const Rigidd& T_cam_obj, const SingleFitOptions& options) {
  energies::EnergySummary sums;
  sums.A = sums.B = hessian;
  sums.inliers = pixels;
  sums.geometry = 2 * options.scale_m * options.scale_m / std::max(1, pixels) * hessian;
  sums.rounding = sums.missed = energies::SmallVector::Zero(6);
  const Matrix6d increment =
      increment_covariance(sums, shape, std::max(1.0, options.tracker.correlation_area_px));
  return camera_covariance(increment, T_cam_obj, -shape.centre_obj);
}

SingleFit result_of(const Rigidd& T_obj_cam, const Matrix6d& hessian, int pixels, int hits,
                    const frame::Shape& shape, const SingleFitOptions& options) {
  SingleFit fit;
  fit.T_cam_obj = inverse(T_obj_cam);
  fit.covariance = covariance_of(hessian, pixels, shape, fit.T_cam_obj, options);
  fit.pixels = pixels, fit.hits = hits;
  return fit;
}

int settle_steps(const SingleFitOptions& options) {
  return options.tracker.residual == energies::Residual::kRayHit ? kSettleSteps : 0;
}

}  // namespace

SingleFitOptions::SingleFitOptions() {
  rules.max_steps = 10, rules.cost_relative = 0, rules.cost_gain = kMinGain, rules.sure_gain = kSureGain;
}

SingleFits::SingleFits(int device)
    : device_(device >= 0 ? std::make_unique<energies::CudaWork>(device) : nullptr) {}

std::vector<SingleFit> SingleFits::run(const frame::DepthFrame& frame, const Camera& camera,
                                       const std::vector<const frame::Shape*>& shapes,
                                       const std::vector<Rigidd>& T_cam_obj, const SingleFitOptions& options,
                                       int threads) {
  if (shapes.empty()) return {};
  if (device_) return fit_there(frame, camera, shapes, T_cam_obj, options);
  if (work_.size() < shapes.size()) work_.resize(shapes.size());
  std::vector<SingleFit> out(shapes.size());
  parallel_for(shapes.size(), threads, [&](std::size_t k) {
    out[k] = fit_here(frame, camera, *shapes[k], T_cam_obj[k], options, &work_[k]);
  });
  return out;
}

SingleFit SingleFits::fit_here(const frame::DepthFrame& frame, const Camera& camera,
                               const frame::Shape& shape, const Rigidd& T_cam_obj,
                               const SingleFitOptions& options, Work* work) const {
  work->selection.choose(frame, camera, shape, T_cam_obj, sensor_noise(options.tracker),
                         options.tracker.padding_m, nullptr);
  work->selection.pack(options.tracker.max_pixels, &work->pixels);
  energies::SdfEnergy energy(shape.sdf, &work->pixels, energy_of(options));
  optim::LmResult& found = work->found;
  found.x.T_obj_cam.assign(1, inverse(T_cam_obj));
  found.x.K = camera.K;
  optim::LmOptions lm;
  static_cast<optim::LmRules&>(lm) = options.rules;
  for (int round = 0; round < options.rounds; ++round) {
    energy.settle(found.x, settle_steps(options));
    optim::minimize(energy, lm, &work->lm, &found);
  }
  const std::vector<float>& gain = work->pixels.gain;
  SingleFit fit = result_of(found.x.T_obj_cam[0], work->lm.here.hessian, work->pixels.count(),
                            int(std::count(gain.begin(), gain.end(), 0.0f)), shape, options);
  fit.cost = found.cost, fit.stop = found.stop, fit.steps = found.steps;
  return fit;
}

std::vector<SingleFit> SingleFits::fit_there(const frame::DepthFrame& frame, const Camera& camera,
                                             const std::vector<const frame::Shape*>& shapes,
                                             const std::vector<Rigidd>& T_cam_obj,
                                             const SingleFitOptions& options) {
  const std::size_t n = shapes.size();
  device_->keep_volumes(n);
  std::vector<frame::Lookout> lookouts;
  for (std::size_t k = 0; k < n; ++k)
    lookouts.push_back(frame::lookout_for(frame, camera, *shapes[k], T_cam_obj[k],
                                          sensor_noise(options.tracker), options.tracker.padding_m, nullptr));
  const frame::PixelsOnDevice chosen =
      frame::choose_on_device(device_.get(), frame, lookouts, options.tracker.max_pixels);
  const energies::SdfEnergyOptions energy = energy_of(options);
  std::vector<DeviceFits::Problem> problems;
  std::vector<DeviceFits::Fit> fits(n);
  for (std::size_t k = 0; k < n; ++k) {
    fits[k].search.at.T_obj_cam[0] = inverse(T_cam_obj[k]);
    problems.push_back({{Field{device_->volume(shapes[k]->sdf), {}},
                         Penalty{energy.scale_m, energy.outlier_floor, energy.curvature, energy.floor_behind},
                         camera.K.cast<float>(), chosen.of(k), energy.residual, false, 1},
                        chosen.counts + k,
                        settle_steps(options),
                        options.rules});
  }
  std::vector<optim::LmStep> steps;
  const int room = DeviceFits::run(device_.get(), &problems, &fits, &steps, options.rounds);
  std::vector<SingleFit> out;
  for (std::size_t k = 0; k < n; ++k) {
    const auto& search = fits[k].search;
    Matrix6d hessian;
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b <= a; ++b) hessian(a, b) = hessian(b, a) = search.here.hessian[optim::lower_at(a, b)];
    out.push_back(
        result_of(search.at.T_obj_cam[0], hessian, fits[k].pixels, fits[k].hits, *shapes[k], options));
    out.back().cost = search.cost, out.back().stop = search.stop;
    const auto first = steps.begin() + std::ptrdiff_t(k) * room;
    out.back().steps.assign(first, first + search.tried);
  }
  return out;
}

}  // namespace sdftrack::tracking

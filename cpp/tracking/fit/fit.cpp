// SPDX-License-Identifier: MIT
#include "tracking/fit/fit.h"

#include <algorithm>
#include <cmath>

#include "base/device_copies.h"
#include "base/to_int.h"
#include "energies/cuda_work.h"
#include "tracking/fit/stages.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kUsualSteps = 64;  // trials of a frame
constexpr int kOutlineRounds = 3;
constexpr double kLessWork =
    2;  // all pixels over those of the coarse stages, where it pays to use these first
constexpr double kMoved_px = 2;  // from where the lines across the outline were made: they are made again

}  // namespace

double fit_quality(const Fitted& fitted, const TrackerOptions& options) {
  const double worst = options.outlier_floor > 0 ? -std::log(options.outlier_floor) : 0;
  return agreeing_share(fitted.seen) - (worst > 0 ? fitted.cost / worst : 0);
}

std::optional<Fitted> PoseFitter::fit(const frame::DepthFrame& frame, const Camera& camera,
                                      const FitTarget& target, const Attempt& attempt,
                                      const frame::Plane* plane) {
  camera_ = &camera, target_ = &target;
  if (view_.open(frame, camera, target, attempt.padding_m, plane) < kMinFitPixels) return std::nullopt;
  view_.read_free_space(attempt.padding_m);
  Fitted fitted = blank();
  optim::State& x = state_;
  fit_coarsely(frame, attempt, &x, &fitted);
  view_.choose_fine_pixels(view_.last_scale(fitted.memory), x);
  fit_between(&x, &fitted);
  fit_fine(&x, &fitted, true);
  fitted.T_cam_obj = inverse(x.T_obj_cam[0]);
  view_.examine(&fitted);
  return fitted;
}

std::optional<Fitted> PoseFitter::look(const frame::DepthFrame& frame, const Camera& camera,
                                       const FitTarget& target) {
  camera_ = &camera, target_ = &target;
  if (view_.open(frame, camera, target, options_.padding_m, nullptr) < kMinFitPixels) return std::nullopt;
  Fitted fitted = blank();
  fitted.T_cam_obj = target.expected;
  optim::State& x = state_;
  begin_at(target.expected, &x);
  view_.choose_fine_pixels(view_.last_scale(fitted.memory), x);
  fit_fine(&x, &fitted, false);
  view_.examine(&fitted);
  return fitted;
}

Fitted PoseFitter::blank() {
  Fitted fitted;
  fitted.memory = target_->memory;
  fitted.steps = spare_steps();
  return fitted;
}

std::vector<TrackStep> PoseFitter::spare_steps() {
  std::vector<TrackStep> steps;
  if (!spare_steps_.empty()) {
    steps = std::move(spare_steps_.back());
    spare_steps_.pop_back();
    steps.clear();
  }
  steps.reserve(kUsualSteps);  // has room whichever vector is taken next
  return steps;
}

void PoseFitter::begin_at(const Rigidd& T_cam_obj, optim::State* x) const {
  x->T_obj_cam.assign(1, inverse(T_cam_obj));
  x->K = camera_->K;
  x->log_scale.clear();
}

// Starts from the best of the attempt's starts.
void PoseFitter::fit_coarsely(const frame::DepthFrame& frame, const Attempt& attempt, optim::State* x,
                              Fitted* fitted) {
  const double noise_m = fitted->memory.noise_factor * view_.stated_noise_m();
  double most = -1;
  for (const Rigidd& start : attempt.starts) {
    optim::State& now = attempt.starts.size() == 1 ? *x : trial_;
    begin_at(start, &now);
    fit_coarse(attempt, &now, fitted);
    if (attempt.starts.size() == 1) return;
    const double share = agreeing_share(
        compare_visible_surface(frame, *camera_, target_->shape, inverse(now.T_obj_cam[0]),
                                DepthError{noise_m, fitted->memory.systematic_m}, kTrustPoints));
    if (share > most) most = share, *x = now;
  }
}

void PoseFitter::fit_coarse(const Attempt& attempt, optim::State* x, Fitted* fitted) {
  energies::PixelSet& coarse = view_.coarse();
  each_coarse_stage(options_, attempt.scale_m, view_.last_scale(fitted->memory),
                    coarse.count() < view_.candidates(), view_.energy_options(),
                    [&](const energies::SdfEnergyOptions& energy) {
                      run_stage(&coarse, energy, attempt.coarse_steps, x, fitted);
                    });
}

void PoseFitter::fit_between(optim::State* x, Fitted* fitted) {
  const int all = view_.pixels().count();
  energies::SdfEnergyOptions energy = view_.energy_options();
  energy.scale_m = float(view_.last_scale(fitted->memory));
  refuse_behind(options_, &energy);
  each_share_between(all / double(std::max(1, options_.coarse_pixels)), [&](double share) {
    view_.coarse().assign_subset(view_.pixels(), to_int(share * all));
    run_stage(&view_.coarse(), energy, kCoarseSteps, x, fitted);
  });
}

// With `move` false: only the noise and the covariance of the unchanged state.
void PoseFitter::fit_fine(optim::State* x, Fitted* fitted, bool move) {
  energies::SdfEnergyOptions options = view_.energy_options();
  options.threads = threads_;
  // The first frame does not know the sensor's noise yet: fit, measure, fit again.
  for (int round = fitted->memory.noise_known || !options_.adapt_noise ? 1 : 0; round < 2; ++round) {
    options.scale_m = float(view_.last_scale(fitted->memory));
    energies::SdfEnergy energy(target_->shape.sdf, &view_.pixels(), options);
    if (move)
      run_fine(options, x, fitted);
    else
      energy.classify(*x, kClassifySteps);
    const energies::EnergySummary summary = energy.summarize(*x, kSummaryPixels, &view_.summary_scratch());
    view_.measure_noise(summary, &fitted->memory);
    if (round == 1) view_.measure_pose(options, *x, summary, &energy, fitted);
  }
}

// Upper bound of the motion in the image.
double PoseFitter::moved_px(const Rigidd& before, const Rigidd& now) const {
  return surface_step(now, before, target_->shape.diameter_m) * camera_->K.fx / now.t.z;
}

// The outline is searched again where the pose has moved: its lines are valid for a small part of their
// reach. Its effect on the pose is found on a part of the pixels.
void PoseFitter::run_fine(const energies::SdfEnergyOptions& energy, optim::State* x, Fitted* fitted) {
  const auto run = [&](energies::PixelSet* pixels) {
    run_stage(pixels, energy, fine_steps(options_), x, fitted);
  };
  energies::PixelSet& all = view_.pixels();
  if (!view_.outline_helps()) return run(&all);
  energies::PixelSet* few = &all;
  if (all.count() > kLessWork * options_.coarse_pixels) {
    few = &view_.coarse();
    few->assign_subset(all, options_.coarse_pixels);
  }
  if (!(target_->memory.outline.factor > 0)) {
    view_.read_outline(inverse(x->T_obj_cam[0]), options_.outline_far_px);
    run(few);
  }
  for (int round = 0; round < kOutlineRounds; ++round) {
    const Rigidd T_cam_obj = inverse(x->T_obj_cam[0]);
    view_.read_outline(T_cam_obj, options_.outline_reach_px);
    run(few);
    if (moved_px(T_cam_obj, inverse(x->T_obj_cam[0])) < kMoved_px) break;
  }
  if (few != &all) run(&all);
}

void PoseFitter::run_stage(energies::PixelSet* pixels, const energies::SdfEnergyOptions& energy_options,
                           int steps, optim::State* x, Fitted* fitted) {
  const frame::Shape& shape = target_->shape;
  energies::SdfEnergy data(shape.sdf, pixels, energy_options);
  energies::CudaWork* const device = pixels->count() >= kMinOnDevice ? device_ : nullptr;
  FreeSpaceEnergy free_space(&shape.outline, &view_.free_grid(),
                             free_space_options(options_, view_.free_grid()));
  const double free_space_weight =
      view_.free_grid().empty() ? 0
                                : options_.free_space_weight * pixels->count() / double(shape.outline.size());
  double brightness_weight;
  energies::PhotometricEnergy brightness = view_.brightness(*pixels, *x, &brightness_weight);
  const bool all = pixels == &view_.pixels();
  energies::OutlineEnergy outline = view_.outline_energy(fitted->memory, kCommonBesideDepth_px);
  const double outline_weight =
      view_.outline_weight(fitted->memory) * pixels->count() / std::max(1, view_.pixels().count());
  optim::PosePrior prior({1, false, false}, 0, inverse(target_->expected), target_->prior);
  const bool has_prior = target_->prior.diagonal().maxCoeff() > 0;

  optim::LmResult& found = lm_result_;
  found.x = *x;
  const optim::LmOptions lm = stage_lm(options_, steps, target_->memory.noise_known, all);
  // Changing colours are not sent; constant ones may be used on a device.
  const bool has_colors =
      device && (shape.sdf.id != 0 || DeviceCopies::find(shape.colors.rgb_seen, device->device()));
  if (device && (!(brightness_weight > 0) || has_colors)) {
    energies::Beside beside;
    if (has_prior) beside.prior = prior.term();
    if (free_space_weight > 0)
      beside.outline = free_space.term(*x), beside.outline_weight = free_space_weight;
    if (brightness_weight > 0)
      beside.brightness = brightness.on_device(), beside.brightness_weight = brightness_weight;
    if (outline_weight > 0) beside.lines = outline.on_device(), beside.lines_weight = outline_weight;
    data.search(device, kSettleSteps, lm, beside, &found);
  } else {
    if (energy_options.residual == energies::Residual::kRayHit)
      data.settle(*x, kSettleSteps, device);
    else if (device)
      data.enter_device(device);
    sum_.clear();
    sum_.add(&data);
    if (free_space_weight > 0) sum_.add(&free_space, free_space_weight);
    if (brightness_weight > 0) sum_.add(&brightness, brightness_weight);
    if (outline_weight > 0) sum_.add(&outline, outline_weight);
    if (has_prior) sum_.add(&prior);
    optim::minimize(sum_, lm, &lm_work_, &found);
    data.leave_device();
  }
  for (const optim::LmStep& step : found.steps)
    fitted->steps.push_back({step, energy_options.scale_m, pixels->count()});
  *x = found.x;
  if (brightness_weight > 0) found.cost -= brightness_weight * brightness.cost(*x);
  if (outline_weight > 0) {
    found.cost -= outline_weight * outline.cost(*x);
    found.count -= double(view_.outline_lines().lines.size());
  }
  fitted->cost = found.count > 0 ? found.cost / found.count : 0;
}

}  // namespace sdftrack::tracking

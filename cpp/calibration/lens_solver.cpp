// SPDX-License-Identifier: MIT
#include "calibration/lens_solver.h"

#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/robust.h"

namespace sdftrack::calibration {

namespace {

constexpr double kMinGain = 0.01;  // a step that promises less (log-likelihood) moves nothing by over 0.15 sd
constexpr double kCoarseGain = 1e-3;  // a coarse step with less gain, as a share of the cost, is the last
constexpr int kFineRounds = 2;        // each with the current noise and the pixels that count then
constexpr double kNarrowing = 0.4;    // of s, from stage to stage

// points: no measurement has a hit, and outliers have the largest residuals.
double noise_of(const LensView& view, bool points, LensFrame* frame) {
  std::vector<double> sizes;
  for (const LensFrame::Reading& r : frame->readings(view))
    if (r.hit || points) sizes.push_back(std::abs(r.residual_m));
  return robust_sd(&sizes);
}

}  // namespace

void LensSolver::measure_noise(const LensView& view, bool points) {
  parallel_for(frames_.size(), options_.threads,
               [&](std::size_t m) { frames_[m]->noise_m = noise_of(view, points, frames_[m]); });
}

// classify: choose again which pixels count; else use those of run_poses.
void LensSolver::run_joint(const LensEnergy::Settings& settings, const optim::LmOptions& lm, bool classify) {
  std::vector<optim::LmStep> steps = std::move(record_.steps);
  LensEnergy energy(sdf_, free_, frames_, lens_, prior_, settings);
  if (classify) energy.classify();
  optim::minimize(energy, lm, &record_);
  steps.insert(steps.end(), record_.steps.begin(), record_.steps.end());
  record_.steps = std::move(steps);
}

// The lens is fixed. Each frame has its own damping: a failing frame does not delay the others.
void LensSolver::run_poses(const LensEnergy::Settings& settings, const optim::LmOptions& lm) {
  const FreeLens none{{}, free_.distorted};
  LensEnergy::Settings alone = settings;
  alone.threads = 1;
  parallel_for(frames_.size(), options_.threads, [&](std::size_t m) {
    const std::vector<LensFrame*> one{frames_[m]};
    Lens lens = *lens_;
    LensEnergy energy(sdf_, none, one, &lens, nullptr, alone);
    energy.classify();
    optim::LmRecord record;
    optim::minimize(energy, lm, &record);
  });
}

bool LensSolver::coarser_than_noise(double scale_m) const {
  return std::any_of(frames_.begin(), frames_.end(),
                     [&](const LensFrame* f) { return scale_m >= f->noise_m; });
}

void LensSolver::coarse(double scale_m) {
  optim::LmOptions lm;
  lm.max_steps = options_.coarse_steps, lm.cost_relative = kCoarseGain;
  for (double s = scale_m; s > options_.min_scale_m && coarser_than_noise(s); s *= kNarrowing) {
    const LensEnergy::Settings settings = coarse_settings(s);
    run_poses(settings, lm);
    run_joint(settings, lm, true);
    measure_noise({sdf_, *lens_, free_, options_.stride(options_.coarse_pixels)});
  }
}

// Directions held only by the outline, for example a box along an edge, are fitted while the lens is fixed:
// then the outline does not affect the lens.
void LensSolver::align(double scale_m) {
  optim::LmOptions lm;
  lm.max_steps = options_.coarse_steps, lm.cost_relative = kCoarseGain;
  for (double s = scale_m; s > options_.min_scale_m; s *= kNarrowing) {
    run_poses(coarse_settings(s), lm);
    measure_noise({sdf_, *lens_, free_, options_.stride(options_.coarse_pixels)});
    if (!coarser_than_noise(s)) break;
  }
}

LensEnergy::Settings LensSolver::coarse_settings(double scale_m) const {
  return {scale_m, options_.outlier_floor, OutlineUse::kAll, options_.stride(options_.coarse_pixels),
          options_.threads};
}

LensEnergy::Settings LensSolver::fine_settings(int stride) const {
  const OutlineUse outline =
      options_.residual == energies::Residual::kPoint ? OutlineUse::kPoints : OutlineUse::kWithin;
  return {options_.min_scale_m, options_.outlier_floor, outline, stride, options_.threads};
}

LensEnergy LensSolver::fine_energy() const { return {sdf_, free_, frames_, lens_, prior_, fine_settings(1)}; }

optim::LmOptions LensSolver::fine_steps() const {
  optim::LmOptions lm;
  lm.max_steps = options_.fine_steps, lm.cost_relative = 0, lm.cost_gain = kMinGain;
  return lm;
}

void LensSolver::poses() { run_poses(fine_settings(1), fine_steps()); }

void LensSolver::fine(int stride) {
  const optim::LmOptions lm = fine_steps();
  const LensEnergy::Settings settings = fine_settings(stride);
  for (int round = 0; round < kFineRounds; ++round) {
    run_poses(settings, lm);
    run_joint(settings, lm, false);
    measure_noise({sdf_, *lens_, free_, stride}, settings.outline == OutlineUse::kPoints);
  }
}

void LensSolver::solve(double scale_m, int fine_stride) {
  coarse(scale_m);
  align(scale_m);
  fine(fine_stride);
}

}  // namespace sdftrack::calibration

// SPDX-License-Identifier: MIT
#include "calibration/lens_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "base/robust.h"

namespace sdftrack {

namespace {

constexpr double kLeastGain =
    0.01;  // a step that promises less (log-likelihood) moves nothing by over 0.15 sd
constexpr double kCoarseGain = 0.01;  // a coarse step that gains less than this share of the cost is the last
constexpr double kNarrowing = 0.4;    // of s, from stage to stage

double noise_of(const LensView& view, LensFrame* frame) {
  std::vector<double> sizes;
  for (const LensFrame::Reading& r : frame->readings(view))
    if (r.hit) sizes.push_back(std::abs(r.residual_m));
  return robust_sd(&sizes);
}

}  // namespace

void LensSolver::run(LensEnergy energy, const LmOptions& lm) {
  std::vector<LmStep> steps = std::move(record_.steps);
  energy.classify();
  minimize(energy, lm, &record_);
  steps.insert(steps.end(), record_.steps.begin(), record_.steps.end());
  record_.steps = std::move(steps);
  // The noise is that of where the stage has led to.
  parallel_for(frames_.size(), options_.threads,
               [&](std::size_t m) { frames_[m]->noise_m = noise_of(energy.view(), frames_[m]); });
}

void LensSolver::coarse(double scale_m, bool poses_only) {
  LmOptions lm;
  lm.max_steps = options_.coarse_steps, lm.cost_relative = kCoarseGain;
  const FreeLens none{{}, free_.distorted};
  const FreeLens& free = poses_only ? none : free_;
  for (double s = scale_m; s > options_.least_scale_m; s *= kNarrowing) {
    run({sdf_,
         free,
         frames_,
         lens_,
         poses_only ? nullptr : prior_,
         {s, options_.outlier_floor, Outline::kAll, options_.coarse_stride, options_.threads}},
        lm);
    if (std::all_of(frames_.begin(), frames_.end(), [&](const LensFrame* f) { return s < f->noise_m; }))
      break;
  }
}

LensEnergy LensSolver::fine_energy() const {
  return {sdf_,    free_,
          frames_, lens_,
          prior_,  {options_.least_scale_m, options_.outlier_floor, Outline::kWithin, 1, options_.threads}};
}

void LensSolver::fine() {
  LmOptions lm;
  lm.max_steps = options_.fine_steps, lm.cost_relative = 0, lm.cost_gain = kLeastGain;
  run(fine_energy(), lm);
}

void LensSolver::solve(double scale_m) {
  coarse(scale_m, false);
  fine();
  // What only the outline holds, a box along an edge for instance, comes to its place while the lens stands
  // still: then nothing that the outline says enters the lens.
  coarse(scale_m, true);
  fine();
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// The stages of a fit, coarse to fine: the same for one object and for several that touch.
#pragma once

#include <cmath>

#include "base/to_int.h"
#include "energies/sdf_energy.h"
#include "optim/lm.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

// A smaller predicted gain in log-likelihood moves the pose by less than 5 % of its sd.
constexpr double kMinGain = 1e-3;
// A step with a smaller predicted gain in log-likelihood (five standard deviations) is taken without an
// evaluation at its end, and is the last of its stage: what Gauss-Newton leaves is of second order
// (docs/math/depth_tracker.md, section 4).
constexpr double kSureGain = 12;
// Noise alone predicts this gain, one half for each unknown. A stage on a part of the pixels leaves it to the
// next stages, or a pose at rest would tremble.
constexpr double kNoiseGain = 3;
constexpr double kPrintedDampingMax = 10e6;  // Table 3.2
constexpr double kMaxRatio = 6.5;            // of pixels from one stage to the next
constexpr int kMaxStages = 64;               // more than any number of pixels needs
constexpr int kCoarseSteps = 3;              // trials of a coarse stage; the next stage corrects what is left
// Trials of the last stage: a bound on the time of a frame; the gain usually ends the stage earlier. By the
// printed rule the stage continues until the damping is at its bound.
constexpr int kFineSteps = 8, kPrintedSteps = 100;
inline int fine_steps(const TrackerOptions& options) {
  return options.stop_printed ? kPrintedSteps : kFineSteps;
}
// Newton steps before the first linearisation; with one, curved parts keep the fallback and its bias.
constexpr int kSettleSteps = 2;
constexpr int kClassifySteps = 4;
constexpr int kSummaryPixels = 1000;
constexpr int kMinFitPixels = 40;   // near the object; with fewer no pose is fitted, and the object is lost
constexpr int kMinOnDevice = 1500;  // pixels; fewer are summed on the CPU before a kernel would have started

// A hand may be in front of the surface; behind it the sensor sees nothing. Used in all stages but the last,
// where the unequal tails would draw the surface towards the mean of the measurements.
inline void refuse_behind(const TrackerOptions& options, energies::SdfEnergyOptions* energy) {
  if (options.outlier_floor > 0) energy->floor_behind = float(options.coarse_floor_behind);
}

// run(energy): stages on an even subset with phi at the measured points, which lead more reliably from afar.
// If more pixels follow, a last stage has the residual of the fine stage. `energy` as in the fine stage.
template <class Run>
void each_coarse_stage(const TrackerOptions& options, double scale_m, double last_scale_m, bool more_follow,
                       energies::SdfEnergyOptions energy, const Run& run) {
  if (!(scale_m > 0)) return;
  energy.residual = energies::Residual::kPoint;
  if (options.outlier_floor > 0) energy.outlier_floor = float(options.coarse_floor);
  refuse_behind(options, &energy);
  for (double s = scale_m; s > 1.5 * last_scale_m; s *= 0.5) {
    energy.scale_m = float(s);
    run(energy);
  }
  if (!more_follow) return;
  energy.scale_m = float(last_scale_m);
  energy.residual = options.residual;
  run(energy);
}

// run(share): from the few pixels of the coarse stages to all pixels in even ratios, so that one evaluation
// is enough at the start of each stage. ratio: all pixels over those of the coarse stages.
template <class Run>
void each_share_between(double ratio, const Run& run) {
  const int stages =
      ratio > 1 ? to_int_within(std::ceil(std::log(ratio) / std::log(kMaxRatio)), 1, kMaxStages) : 1;
  for (int k = 1; k < stages; ++k) run(std::pow(ratio, double(k) / stages - 1));
}

// Gains are those of single objects. The first frame, whose noise is not known yet, may begin far off: there
// every step counts and is evaluated.
inline optim::LmOptions stage_lm(const TrackerOptions& options, int steps, bool noise_known,
                                 bool all_pixels) {
  optim::LmOptions lm;
  lm.max_steps = steps;
  lm.damping = options.damping_start;
  lm.cost_relative = 0;
  if (options.stop_printed) {
    lm.damping_max = kPrintedDampingMax;
    return lm;
  }
  lm.cost_gain = kMinGain;
  lm.block = 6;
  if (!noise_known) return lm;
  lm.sure_gain = kSureGain;
  if (!all_pixels) lm.cost_gain = kNoiseGain;
  return lm;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// The stages of a calibration, coarse to fine.
#pragma once

#include <algorithm>
#include <vector>

#include "calibration/lens_energy.h"

namespace sdftrack::calibration {

struct IntrinsicsOptions {
  energies::Residual residual = energies::Residual::kRayHit;  // or kPoint, the thesis', in the last stage
  int max_pixels = 5000;                                      // of a frame
  double padding_m = 0.03;    // a pixel counts if its point is this near to the object's box
  double min_scale_m = 2e-4;  // s of the last stage, or the noise if that is larger
  double outlier_floor = 0.1;
  int coarse_steps = 12, fine_steps = 12;  // trials of a stage
  // Pixels of a frame that suffice: for the early stages, for the joint steps at the noise, for the bias.
  int coarse_pixels = 350, fine_pixels = 1000, twin_pixels = 700;
  int threads = 1;

  int stride(int pixels) const { return std::max(1, max_pixels / pixels); }
};

class LensSolver {
 public:
  // Everything belongs to the caller and is changed in place; prior: nullptr for none.
  LensSolver(const SdfView& sdf, const FreeLens& free, const IntrinsicsOptions& options,
             std::vector<LensFrame*> frames, Lens* lens, const LensPrior* prior)
      : sdf_(sdf), free_(free), options_(options), frames_(std::move(frames)), lens_(lens), prior_(prior) {}

  // Stages from scale_m down to the noise, on some of the pixels, including outlines.
  void coarse(double scale_m);
  // The same stages with a fixed lens: only the poses.
  void align(double scale_m);
  // At the scale of the noise, on pixels within the outlines.
  void fine(int stride = 1);
  // Each frame to its own optimum at that scale, with a fixed lens.
  void poses();
  // All stages.
  void solve(double scale_m, int fine_stride = 1);

  LensEnergy fine_energy() const;
  const optim::LmRecord& record() const { return record_; }  // of the last stage, with the steps of all

 private:
  LensEnergy::Settings coarse_settings(double scale_m) const;
  LensEnergy::Settings fine_settings(int stride) const;
  optim::LmOptions fine_steps() const;
  void run_joint(const LensEnergy::Settings& settings, const optim::LmOptions& lm, bool classify);
  void run_poses(const LensEnergy::Settings& settings, const optim::LmOptions& lm);
  void measure_noise(const LensView& view, bool points = false);
  bool coarser_than_noise(double scale_m) const;

  SdfView sdf_;
  const FreeLens& free_;
  const IntrinsicsOptions& options_;
  std::vector<LensFrame*> frames_;
  Lens* lens_;
  const LensPrior* prior_;
  optim::LmRecord record_;
};

}  // namespace sdftrack::calibration

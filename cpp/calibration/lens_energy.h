// SPDX-License-Identifier: MIT
// All frames of a calibration as one energy: a pose each, and the lens that they share.
#pragma once

#include <vector>

#include "calibration/lens_frame.h"
#include "optim/arrow.h"

namespace sdftrack::calibration {

// Prior of the free unknowns: a value and an sd each (infinite: unknown).
struct LensPrior {
  std::vector<double> value, sd;
};

class LensEnergy final : public optim::ArrowEnergy {
 public:
  struct Settings {
    double min_scale_m;  // s of the penalty, or the frame's noise if that is larger
    double outlier_floor;
    OutlineUse outline;
    int stride, threads;
  };
  // The frames, the lens and the prior (nullptr: none) belong to the caller.
  LensEnergy(const SdfView& sdf, const FreeLens& free, const std::vector<LensFrame*>& frames, Lens* lens,
             const LensPrior* prior, const Settings& settings)
      : sdf_(sdf), free_(free), frames_(frames), lens_(lens), prior_(prior), settings_(settings) {}

  energies::DepthLogistic<double> penalty_of(const LensFrame& frame) const;
  void classify();
  LensView view(bool trial = false) const {
    return {sdf_, trial ? trial_lens_ : *lens_, free_, settings_.stride};
  }

  int shared_unknowns() const override { return free_.count(); }
  void linearize(bool trial, std::vector<optim::ArrowBlock>* blocks, optim::ArrowBlock* prior) override;
  void retract(const std::vector<optim::Vector6d>& poses, const optim::SharedVector& shared) override;
  void accept() override;
  bool is_small(const std::vector<optim::Vector6d>& poses, const optim::SharedVector& shared) const override;

 private:
  SdfView sdf_;
  const FreeLens& free_;
  const std::vector<LensFrame*>& frames_;
  Lens *lens_, trial_lens_;
  const LensPrior* prior_;
  Settings settings_;
};

}  // namespace sdftrack::calibration

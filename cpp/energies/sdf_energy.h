// SPDX-License-Identifier: MIT
// The data energy of one object: a penalty on each pixel's residual to the object's signed distance field.
#pragma once

#include <vector>

#include "base/views.h"
#include "energies/pixel_set.h"
#include "energies/summary.h"
#include "optim/energy.h"

namespace sdftrack {

struct SdfEnergyOptions {
  Residual residual = Residual::kRayHit;
  Curvature curvature = Curvature::kIrls;
  float scale_m = 0.002f;      // s of the logistic density
  float outlier_floor = 0.1f;  // e; 0: the printed likelihood
  float floor_behind = -1;     // e of readings behind the surface; negative: the same
  bool warm_hits = true;       // go on from the last hits; false: cost is a function of the state alone
  bool scale = false;          // unknown size
  bool intrinsics = false;     // unknown fx, fy, cx, cy
  bool color = false;          // weigh the pixels by their colours' posteriors
  ColorLikelihood color_likelihood = ColorLikelihood::kOdds;
  float color_prior = 0.7f;  // the posterior of a colour that says nothing
  int threads = 1;
};

// What became of each pixel at a state.
struct PixelReadings {
  std::vector<float> residual_m, weight;
  std::vector<unsigned char> hit;  // 1: the ray meets the model
};

class CudaWork;

// Working memory of a summary, for whoever makes one in every frame.
struct SummaryScratch {
  std::vector<float> residuals, noises;
  std::vector<int> places;
};

class SdfEnergy final : public Energy {
 public:
  // `pixels` is kept, not copied; its hits and classes are working memory of this energy.
  SdfEnergy(SdfView sdf, PixelSet* pixels, const SdfEnergyOptions& options)
      : sdf_(sdf), pixels_(pixels), options_(options) {}

  Unknowns unknowns() const override { return {1, options_.scale, options_.intrinsics}; }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

  // From now on the sums run on the GPU, until leave_device() brings the hits and classes back. The pixels
  // must stay as they are.
  void enter_device(CudaWork* device);
  void leave_device();

  // How many pixels' points lie within reach_m of the surface at x; and leaves out the others.
  int count_near(const State& x, double reach_m);
  void keep_near(const State& x, double reach_m);
  // `steps` Newton steps of every ray from the measured depths. The
  // next linearisation decides which rays meet the model; it stays so from then on, so that costs may be
  // compared.
  void settle(const State& x, int steps, CudaWork* device = nullptr);
  // One more Newton step of every ray from where it is: the hits at x, when they were taken close to it.
  void follow_hits(const State& x);
  // Decide which rays meet the model, at x, after `steps` steps.
  void classify(const State& x, int steps);
  EnergySummary summarize(const State& x, int pixel_budget, SummaryScratch* scratch);
  void read(const State& x, PixelReadings* out);

 private:
  template <class Visit>
  void with_term(const State& x, bool reclassify, const Visit& visit);
  const float* distances(const State& x);  // phi at the measured points

  SdfView sdf_;
  PixelSet* pixels_;
  SdfEnergyOptions options_;
  bool undecided_ = true;  // which rays meet the model
  CudaWork* device_ = nullptr;
  PixelsView<float> device_pixels_{};
  SdfView device_sdf_{};
};

}  // namespace sdftrack

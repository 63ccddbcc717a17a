// SPDX-License-Identifier: MIT
// The data energy of an object, or of a few that the same pixels may show: a penalty on each pixel's residual
// to the signed distance field of the object, or of their union.
#pragma once

#include <array>
#include <vector>

#include "base/views.h"
#include "energies/beside.h"
#include "energies/energy_options.h"
#include "energies/pixel_set.h"
#include "energies/summary.h"
#include "optim/energy.h"
#include "optim/lm.h"

namespace sdftrack::energies {

// Residual, weight and class of each pixel at a state.
struct PixelReadings {
  std::vector<float> residual_m, weight;
  std::vector<unsigned char> hit;  // 1: the ray meets the model
};

class CudaWork;

// Working memory of a summary, kept by a caller that makes one in every frame.
struct SummaryScratch {
  std::vector<float> residuals, noises;
  std::vector<int> places;
};

class SdfEnergy final : public optim::Energy {
 public:
  // `pixels` is kept, not copied; its hits and classes are working memory of this energy.
  SdfEnergy(SdfView sdf, PixelSet* pixels, const SdfEnergyOptions& options)
      : SdfEnergy(&sdf, 1, pixels, options) {}
  // The energy of the union of the first `objects` (at most kMaxJoined) of sdfs.
  SdfEnergy(const SdfView* sdfs, int objects, PixelSet* pixels, const SdfEnergyOptions& options);

  optim::Unknowns unknowns() const override { return {objects_, options_.scale, options_.intrinsics}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;

  // Sums run on the GPU until leave_device() brings hits and classes back; the pixels must not change.
  void enter_device(CudaWork* device);
  void leave_device();

  // Whether `search` is supported: for the pose, and optionally the size, of one object.
  bool can_search() const { return objects_ == 1 && !options_.intrinsics && options_.warm_hits; }
  // As settle() with settle_steps and optim::minimize() of this energy and the terms of `beside`, from
  // out->x, all on the device: the host waits once.
  void search(CudaWork* device, int settle_steps, const optim::LmOptions& options, const Beside& beside,
              optim::LmResult* out);

  // phi at the measured points, valid until the pixels' classes are decided: it shares their memory.
  const float* distances(const optim::State& x);
  // count_near: how many points lie within reach_m of the surface at x. keep_near: removes the other pixels.
  int count_near(const optim::State& x, double reach_m);
  void keep_near(const optim::State& x, double reach_m) { keep_near(distances(x), reach_m); }
  void keep_near(const float* phi, double reach_m);  // phi: from `distances`
  // `steps` Newton steps of every ray from the measured depths. The next linearisation decides which rays
  // meet the model. The decision is then fixed, so that costs may be compared.
  void settle(const optim::State& x, int steps, CudaWork* device = nullptr);
  // One more Newton step of every ray from its last hit: the hits at x if the last state was close.
  void follow_hits(const optim::State& x);
  // Decides at x which rays meet the model, after `steps` steps.
  void classify(const optim::State& x, int steps);
  EnergySummary summarize(const optim::State& x, int pixel_budget, SummaryScratch* scratch);
  void read(const optim::State& x, PixelReadings* out);

 private:
  template <class Visit>
  void with_term(const optim::State& x, bool reclassify, const Visit& visit);

  std::array<SdfView, kMaxJoined> sdfs_{};
  int objects_;
  PixelSet* pixels_;
  SdfEnergyOptions options_;
  bool undecided_ = true;  // which rays meet the model
  CudaWork* device_ = nullptr;
  PixelsView<float> device_pixels_{};
  std::array<SdfView, kMaxJoined> device_sdfs_{};
};

}  // namespace sdftrack::energies

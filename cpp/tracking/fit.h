// SPDX-License-Identifier: MIT
// One object fitted to one frame: pixels -> energies -> minimize, coarse to fine -> covariance.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <vector>

#include "optim/lm.h"
#include "optim/prior.h"
#include "tracking/color_evidence.h"
#include "tracking/correlation.h"
#include "tracking/free_space.h"
#include "tracking/local_noise.h"
#include "tracking/selection.h"
#include "tracking/trust.h"

namespace sdftrack {

struct TrackStep {
  LmStep step;
  double scale_m;
  int pixels;
};

// One record of every trial, in order.
inline void prepend(const std::vector<TrackStep>& first, std::vector<TrackStep>* steps) {
  steps->insert(steps->begin(), first.begin(), first.end());
}

// What a fit takes from the frames before and hands on to the next one.
struct FitMemory {
  double noise_factor = 1;  // sensor noise, measured over stated
  bool noise_known = false;
  double correlation_area_px = 0;  // 0: not measured yet
  int area_age = 0;                // frames since that was measured
  double damping = 0;              // only with TrackerOptions::keep_damping
};

// Whom to fit, and where it is expected: pixels are taken around `expected`, the prior is centred there.
struct FitTarget {
  const Shape& shape;
  Rigidd expected;  // T_cam_obj, centred frame
  Matrix6d prior;   // information of the prior on the increment of T_obj_cam; 0: none
  FitMemory memory;
  const ColorModel* colors = nullptr;  // nullptr: depth alone
};

// A few poses, T_cam_obj, centred.
class Starts {
 public:
  Starts(std::initializer_list<Rigidd> poses) {
    for (const Rigidd& T : poses) add(T);
  }
  void add(const Rigidd& T_cam_obj) { poses_.at(count_++) = T_cam_obj; }
  std::size_t size() const { return count_; }
  const Rigidd* begin() const { return poses_.data(); }
  const Rigidd* end() const { return poses_.data() + count_; }

 private:
  std::array<Rigidd, 8> poses_;
  std::size_t count_ = 0;
};

// How far away the first stage looks, and where from.
struct Attempt {
  double scale_m, padding_m;
  int coarse_steps;
  Starts starts;  // the best after the coarse stages goes on
};

struct Fitted {
  Rigidd T_cam_obj;     // centred frame
  Matrix6d covariance;  // camera axes, about the caller's object origin
  double cost = 0;      // mean per pixel of the last stage; with colours that of depth where they are its own
  double foreground = -1;  // mean posterior of the colours on the surface; -1: no colours
  Visibility seen;
  Outline outline;
  double roughness = 1;  // see PoseEvidence
  double centre_sd = 0;  // likewise
  FitMemory memory;
  std::vector<TrackStep> steps;
};

// What fits to the same frame are compared by: surface that is seen where it should be, less the share of the
// worst cost.
double fit_quality(const Fitted& fitted, const TrackerOptions& options);

inline PoseEvidence evidence_of(const Fitted& f, const TrackerOptions& options) {
  PoseEvidence evidence{f.seen, f.outline, f.roughness, f.centre_sd, {}};
  if (f.foreground >= 0) evidence.color_gain = f.foreground - options.color_prior;
  return evidence;
}
inline Trust judge(const Fitted& f, const TrackerOptions& options, double prior_log_odds = 0) {
  return judge(evidence_of(f, options), f.covariance, options, prior_log_odds);
}

class PoseFitter {
 public:
  // device: where large sums run; nullptr: here. It outlives the fitter.
  PoseFitter(const TrackerOptions& options, int threads, CudaWork* device = nullptr)
      : options_(options), threads_(threads), device_(device) {}

  // None where too few readings lie near the expected pose.
  std::optional<Fitted> fit(const DepthFrame& frame, const Camera& camera, const FitTarget& target,
                            const Attempt& attempt, const Plane* plane);
  // The memory of a record that is no longer needed, for the next fit.
  void give_back(std::vector<TrackStep>&& steps) {
    if (steps.capacity() > 0) spare_steps_.push_back(std::move(steps));  // else lost frames would pile up
  }
  // Nothing is fitted: the expected pose as it is, with its covariance and all that it is judged by.
  std::optional<Fitted> look(const DepthFrame& frame, const Camera& camera, const FitTarget& target);

 private:
  bool gather(const DepthFrame& frame, const Camera& camera, const FitTarget& target, double padding_m,
              const Plane* plane);
  void pack(int wanted, PixelSet* out);
  void examine(const DepthFrame& frame, Fitted* fitted);
  Fitted blank();
  void begin_at(const Rigidd& T_cam_obj, State* x) const;
  void fit_coarsely(const DepthFrame& frame, const Attempt& attempt, State* x, Fitted* fitted);
  void fit_coarse(const Attempt& attempt, State* x, Fitted* fitted);
  void choose_fine_pixels(double scale_m, const State& x);
  void fit_between(State* x, Fitted* fitted);
  void fit_fine(State* x, Fitted* fitted, bool move);
  void run_stage(PixelSet* pixels, const SdfEnergyOptions& energy, int steps, State* x, Fitted* fitted);
  void read_free_space(const DepthFrame& frame, double padding_m);
  SdfEnergyOptions energy_options() const;
  double last_scale(const FitMemory& memory) const;
  double correlation_area(const SdfEnergyOptions& options, const State& x, SdfEnergy* energy,
                          FitMemory* memory);

  TrackerOptions options_;
  int threads_;
  CudaWork* device_;

  // Of the fit in hand.
  const Camera* camera_ = nullptr;
  const FitTarget* target_ = nullptr;
  double stated_noise_m_ = 0;

  // Working memory, kept from frame to frame.
  PixelSelection selection_;
  PixelSet pixels_, coarse_, scratch_;
  FreeSpaceScratch free_scratch_;
  DistanceGrid free_grid_;
  CorrelationArea correlation_;
  ColorReader color_reader_;
  std::vector<float> floats_;
  State state_, trial_;
  SumEnergy sum_;
  LmWork lm_work_;
  LmResult lm_result_;
  SummaryScratch summary_scratch_;
  std::vector<std::vector<TrackStep>> spare_steps_;
};

}  // namespace sdftrack

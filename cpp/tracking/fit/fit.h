// SPDX-License-Identifier: MIT
// One object fitted to one frame: pixels -> energies -> minimize, coarse to fine -> covariance.
#pragma once

#include <array>
#include <initializer_list>

#include "optim/prior.h"
#include "tracking/fit/fit_view.h"
#include "tracking/fit/free_space.h"

namespace sdftrack::tracking {

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

// The scale and the region of the first stage, and its start poses.
struct Attempt {
  double scale_m, padding_m;
  int coarse_steps;
  Starts starts;  // the best one after the coarse stages is continued
};

// Approximate distance between the same surface points in two poses.
inline double surface_step(const Rigidd& A, const Rigidd& B, double diameter_m) {
  return norm(A.t - B.t) + 0.5 * diameter_m * rotation_angle(A.R * transpose(B.R));
}

// The measure by which fits to the same frame are compared: the share of the surface that agrees, minus the
// cost as a share of the worst cost.
double fit_quality(const Fitted& fitted, const TrackerOptions& options);

inline PoseEvidence evidence_of(const Fitted& f, const TrackerOptions& options) {
  PoseEvidence evidence{f.seen, f.outline, f.roughness, f.centre_sd, {}};
  if (f.foreground >= 0) evidence.color_gain = f.foreground - options.color_prior;
  return evidence;
}
inline Trust judge(const Fitted& f, const TrackerOptions& options, double prior_log_odds = 0,
                   double vouched_log_odds = 0) {
  return judge(evidence_of(f, options), f.covariance, options, prior_log_odds, vouched_log_odds);
}

class PoseFitter {
 public:
  // device: where large sums run; nullptr: on the CPU. It must outlive the fitter.
  PoseFitter(const TrackerOptions& options, int threads, energies::CudaWork* device = nullptr)
      : options_(options), threads_(threads), device_(device), view_(options) {}

  // No result where too few measurements lie near the expected pose.
  std::optional<Fitted> fit(const frame::DepthFrame& frame, const Camera& camera, const FitTarget& target,
                            const Attempt& attempt, const frame::Plane* plane);
  // Fits by the outline in the colour image alone: the frame needs no depth. No result where too little of
  // the outline stands out. share: of the places on the outline, those that determine its position.
  std::optional<Fitted> fit_outline(const frame::DepthFrame& frame, const Camera& camera,
                                    const FitTarget& target, double* share);
  // Learns the colours on both sides of the outline at T_cam_obj (centred), which must be reliable.
  void learn_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                     const appearance::ColorModel& whole, const Rigidd& T_cam_obj, const FitMemory& memory,
                     appearance::LocalColors* colors) {
    view_.learn_outline(frame, camera, shape, whole, T_cam_obj, memory, colors);
  }
  // Takes back the memory of a record that is no longer needed, for the next fit.
  void give_back(std::vector<TrackStep>&& steps) {
    if (steps.capacity() > 0) spare_steps_.push_back(std::move(steps));  // else lost frames would pile up
  }
  std::vector<TrackStep> spare_steps();
  // Nothing is fitted: the expected pose unchanged, with its covariance and all that it is judged by.
  std::optional<Fitted> look(const frame::DepthFrame& frame, const Camera& camera, const FitTarget& target);

 private:
  Fitted blank();
  void begin_at(const Rigidd& T_cam_obj, optim::State* x) const;
  void fit_coarsely(const frame::DepthFrame& frame, const Attempt& attempt, optim::State* x, Fitted* fitted);
  void fit_coarse(const Attempt& attempt, optim::State* x, Fitted* fitted);
  void fit_between(optim::State* x, Fitted* fitted);
  void fit_fine(optim::State* x, Fitted* fitted, bool move);
  double moved_px(const Rigidd& before, const Rigidd& now) const;
  void run_fine(const energies::SdfEnergyOptions& energy, optim::State* x, Fitted* fitted);
  void run_stage(energies::PixelSet* pixels, const energies::SdfEnergyOptions& energy, int steps,
                 optim::State* x, Fitted* fitted);

  TrackerOptions options_;
  int threads_;
  energies::CudaWork* device_;

  // Of the current fit.
  const Camera* camera_ = nullptr;
  const FitTarget* target_ = nullptr;

  // Working memory, kept from frame to frame.
  FitView view_;
  optim::State state_, trial_;
  optim::SumEnergy sum_;
  optim::LmWork lm_work_;
  optim::LmResult lm_result_;
  std::vector<std::vector<TrackStep>> spare_steps_;
};

}  // namespace sdftrack::tracking

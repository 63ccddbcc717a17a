// SPDX-License-Identifier: MIT
// Several objects that touch or hide each other, fitted to one frame together: every pixel speaks to the
// union of those that may have made it, and no object may stand in another (docs/math/several_objects.md).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "energies/joint_fits.h"
#include "optim/prior.h"
#include "tracking/fit/fit_view.h"
#include "tracking/fit/free_space.h"
#include "tracking/several/collision.h"
#include "tracking/several/joint_pixels.h"

namespace sdftrack::tracking {

// What became of one object of a group.
struct JointFitted {
  Fitted fitted;
  int inside = -1;      // in which object of the tracker it came to stand; -1: none
  bool hidden = false;  // too few readings are its own: the others, its motion and the prior have placed it
};

class JointFitter {
 public:
  // device: where stages of many pixels run; nullptr: here. It outlives the fitter.
  JointFitter(const TrackerOptions& options, Collision collision, int threads,
              energies::CudaWork* device = nullptr)
      : options_(options),
        threads_(threads),
        device_(device),
        collision_({collision, options.collision_tolerance_m}) {}

  // All targets from where they are expected, over padding_m and from scale_m on. One result for each, valid
  // until the next fit, but for what the caller moves out of them.
  std::vector<JointFitted>& fit(const frame::DepthFrame& frame, const Camera& camera,
                                const std::vector<FitTarget>& targets, const frame::Plane* plane);

 private:
  void open(const frame::DepthFrame& frame, const Camera& camera, const frame::Plane* plane);
  void fit_coarse(optim::State* x);
  void fit_between(optim::State* x);
  void fit_fine(optim::State* x);
  bool read_outlines(const optim::State& x);
  const Neighbors& neighbors_at(const optim::State& x, std::size_t m);
  struct Stage {
    int steps;
    double contact_reach_m;  // of points that may come to lie in another object in the course of it
    int contact_stride;      // of these points, how many are passed over for one that is looked at
    bool all = false;        // all pixels
    bool outlines = false;   // also the outlines that were read
  };
  void run_stage(JointPixels* pixels, const energies::SdfEnergyOptions& energy, const Stage& stage,
                 optim::State* x);
  bool runs_on_device(const JointPixels& pixels) const;
  void minimize_on_device(JointPixels* pixels, const energies::SdfEnergyOptions& energy,
                          const optim::LmOptions& lm);
  void settle(JointPixels* pixels, const energies::SdfEnergyOptions& energy, const optim::State& x);
  void measure(const optim::State& x, bool last);
  void measure_one(std::size_t m, const optim::State& x, bool last);
  double cost_of(std::size_t m, energies::SdfEnergy* data);
  void examine(const optim::State& x);
  void make_terms(const JointPixels& pixels, const optim::State& x, const Stage& stage);
  double free_space_weight(std::size_t m, int pixels) const {
    return options_.free_space_weight * pixels / static_cast<double>((*targets_)[m].shape.outline.size());
  }
  // The group's reference noise, which is its first object's, over that of object m.
  float noise_ratio(std::size_t m) const {
    return static_cast<float>(views_.front()->stated_noise_m() / views_[m]->stated_noise_m());
  }
  double coarse_count() const {
    return static_cast<double>(options_.coarse_pixels) * static_cast<double>(targets_->size());
  }
  double last_scale() const { return views_.front()->last_scale(memory_); }

  TrackerOptions options_;
  int threads_;
  energies::CudaWork* device_;

  // Of the fit in hand.
  const Camera* camera_ = nullptr;
  const std::vector<FitTarget>* targets_ = nullptr;
  FitMemory memory_;             // the noise of one sensor
  double contact_reach_m_ = -1;  // for which the contacts were looked for; -1: not yet

  // Working memory, kept from frame to frame.
  std::vector<std::unique_ptr<FitView>> views_;
  JointPixels coarse_, all_, part_;
  CollisionEnergy collision_;
  std::vector<const frame::Shape*> shapes_;
  std::vector<energies::SdfEnergy> energies_;
  std::vector<FreeSpaceEnergy> free_space_;
  std::vector<energies::PhotometricEnergy> brightness_;
  std::vector<energies::OutlineEnergy> outlines_;
  std::vector<optim::PosePrior> priors_;
  Neighbors neighbors_;
  optim::GroupEnergy group_;
  optim::State state_, one_;
  optim::LmWork lm_work_;
  optim::LmResult lm_result_;
  energies::JointTask task_;  // of a device
  energies::JointFound found_;
  energies::PixelSet task_pixels_;
  std::vector<JointFitted> out_;
};

}  // namespace sdftrack::tracking

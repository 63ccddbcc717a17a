// SPDX-License-Identifier: MIT
// Several objects that touch or hide each other, fitted together to one frame: every pixel contributes to the
// union of objects that may show there, and no object may penetrate another (docs/math/several_objects.md).
#pragma once

#include <memory>
#include <vector>

#include "energies/joint_fits.h"
#include "optim/prior.h"
#include "tracking/fit/fit_view.h"
#include "tracking/fit/free_space.h"
#include "tracking/several/collision.h"
#include "tracking/several/joint_pixels.h"

namespace sdftrack::tracking {

// The fit of one object of a group.
struct JointFitted {
  Fitted fitted;
  int inside = -1;      // the tracker's object in which this one ended up; -1: none
  bool hidden = false;  // too few measurements are its own: placed by the others, its motion and the prior
  bool held = false;    // of a hidden one: the others bound its motion, see play.h
};

class JointFitter {
 public:
  // device: where stages of many pixels run; nullptr: on the CPU. It must outlive the fitter.
  JointFitter(const TrackerOptions& options, Collision collision, int threads,
              energies::CudaWork* device = nullptr)
      : options_(options),
        threads_(threads),
        device_(device),
        collision_({collision, options.collision_tolerance_m}) {}

  // Fits all targets from their expected poses. Returns one result for each, valid until the next fit except
  // for what the caller moves out of them.
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
    double contact_reach_m;  // of points that may enter another object during the stage
    int contact_stride;      // every n-th of these points is used
    bool all = false;        // all pixels
    bool outlines = false;   // also the outlines that were found
  };
  void run_stage(JointPixels* pixels, const energies::SdfEnergyOptions& energy, const Stage& stage,
                 optim::State* x);
  bool runs_on_device(const JointPixels& pixels) const;
  void minimize_on_device(JointPixels* pixels, const energies::SdfEnergyOptions& energy,
                          const optim::LmOptions& lm);
  void settle(JointPixels* pixels, const energies::SdfEnergyOptions& energy, const optim::State& x);
  void measure(const optim::State& x, bool last);
  void measure_one(std::size_t m, const optim::State& x, bool last);
  Matrix6d prior_of(std::size_t m, int pixels) const;
  double cost_of(std::size_t m, energies::SdfEnergy* data);
  void examine(const optim::State& x);
  void make_terms(const JointPixels& pixels, const optim::State& x, const Stage& stage);
  double free_space_weight(std::size_t m, int pixels) const {
    return options_.free_space_weight * pixels / double((*targets_)[m].shape.outline.size());
  }
  // The group's reference noise (that of its first object) over the noise of object m.
  float noise_ratio(std::size_t m) const {
    return float(views_.front()->stated_noise_m() / views_[m]->stated_noise_m());
  }
  double coarse_count() const { return double(options_.coarse_pixels) * double(targets_->size()); }
  double last_scale() const { return views_.front()->last_scale(memory_); }

  TrackerOptions options_;
  int threads_;
  energies::CudaWork* device_;

  // Of the current fit.
  const Camera* camera_ = nullptr;
  const std::vector<FitTarget>* targets_ = nullptr;
  FitMemory memory_;             // the noise, which all share: there is one sensor
  double contact_reach_m_ = -1;  // for which contacts were last searched; -1: not yet

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
  energies::JointTask task_;  // for a device
  energies::JointFound found_;
  energies::PixelSet task_pixels_;
  std::vector<JointFitted> out_;
};

}  // namespace sdftrack::tracking

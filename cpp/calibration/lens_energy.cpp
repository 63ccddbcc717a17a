// SPDX-License-Identifier: MIT
#include "calibration/lens_energy.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace sdftrack::calibration {

namespace {

constexpr double kSmallStep_m = 1e-7, kSmallStep_rad = 1e-7;

}  // namespace

energies::DepthLogistic<double> LensEnergy::penalty_of(const LensFrame& frame) const {
  return {std::max(settings_.min_scale_m, frame.noise_m), settings_.outlier_floor};
}

void LensEnergy::classify() {
  parallel_for(frames_.size(), settings_.threads,
               [&](std::size_t m) { frames_[m]->classify(view(), settings_.outline); });
}

void LensEnergy::linearize(bool trial, std::vector<optim::ArrowBlock>* blocks, optim::ArrowBlock* prior) {
  blocks->resize(frames_.size());
  parallel_for(frames_.size(), settings_.threads, [&](std::size_t m) {
    frames_[m]->linearize(view(trial), penalty_of(*frames_[m]), trial, &(*blocks)[m]);
  });
  const Lens& lens = trial ? trial_lens_ : *lens_;
  if (!prior_) return;
  for (std::size_t j = 0; j < free_.unknowns.size(); ++j) {
    const double information = 1 / (prior_->sd[j] * prior_->sd[j]);
    const double off = lens.get(free_.unknowns[j]) - prior_->value[j];
    const auto k = static_cast<Eigen::Index>(j);
    prior->shared(k, k) += information, prior->shared_gradient[k] += information * off;
    prior->cost += 0.5 * information * off * off;
  }
}

void LensEnergy::retract(const std::vector<optim::Vector6d>& poses, const optim::SharedVector& shared) {
  trial_lens_ = *lens_;
  for (std::size_t j = 0; j < free_.unknowns.size(); ++j) {
    const LensUnknown which = free_.unknowns[j];
    trial_lens_.set(which, lens_->get(which) + shared[static_cast<Eigen::Index>(j)]);
  }
  for (std::size_t m = 0; m < frames_.size(); ++m) {
    const optim::Vector6d& d = poses[m];
    frames_[m]->trial_T_obj_cam =
        increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * frames_[m]->T_obj_cam;
  }
}

void LensEnergy::accept() {
  *lens_ = trial_lens_;
  for (LensFrame* frame : frames_) frame->accept();
}

bool LensEnergy::is_small(const std::vector<optim::Vector6d>& poses,
                          const optim::SharedVector& shared) const {
  for (std::size_t j = 0; j < free_.unknowns.size(); ++j) {
    const bool pixels = free_.unknowns[j] <= LensUnknown::kCy;
    const double unit = pixels ? lens_->camera.K.fx : 1;
    if (std::abs(shared[static_cast<Eigen::Index>(j)]) > 1e-7 * unit) return false;
  }
  return std::all_of(poses.begin(), poses.end(), [](const optim::Vector6d& d) {
    return d.head<3>().norm() < kSmallStep_m && d.tail<3>().norm() < kSmallStep_rad;
  });
}

}  // namespace sdftrack::calibration

// SPDX-License-Identifier: MIT
#include "tracking/several/joint_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tracking/fit/stages.h"

namespace sdftrack::tracking {

namespace {

// A measurement may belong to any object whose distance exceeds that of the nearest one by no more than this:
// larger while the poses are rough.
constexpr double kCoarseMargin_m = 0.03, kFineMargin_m = 0.008;
constexpr int kStepsPerSingle = 2;          // trials of a coarse stage over those of one object alone
constexpr double kMinGainInContact = 0.02;  // a fifth of a standard deviation
constexpr double kEverywhere_m = 1;         // reach of the coarse stages
constexpr double kUnseen_m = 0.03,
                 kUnseen_rad = 0.3;  // sd of the motion of what has no pixels, if none is stated

}  // namespace

std::vector<JointFitted>& JointFitter::fit(const frame::DepthFrame& frame, const Camera& camera,
                                           const std::vector<FitTarget>& targets, const frame::Plane* plane) {
  camera_ = &camera, targets_ = &targets;
  open(frame, camera, plane);
  optim::State& x = state_;
  x.K = camera.K;
  x.T_obj_cam.clear();
  for (const FitTarget& target : targets) x.T_obj_cam.push_back(inverse(target.expected));
  fit_coarse(&x);
  all_.clear(targets.size());
  const double reach_m = FitView::fine_reach_m(last_scale());
  for (std::size_t m = 0; m < targets.size(); ++m) {
    if (views_[m]->candidates() == 0) continue;
    one_.K = x.K, one_.T_obj_cam.assign(1, x.T_obj_cam[m]);
    views_[m]->pack_for_budget(reach_m, one_);
    all_.take(int(m), targets, x, reach_m, kFineMargin_m, options_.max_pixels, noise_ratio(m),
              &views_[m]->pixels());
  }
  fit_between(&x);
  fit_fine(&x);
  examine(x);
  return out_;
}

void JointFitter::open(const frame::DepthFrame& frame, const Camera& camera, const frame::Plane* plane) {
  const std::vector<FitTarget>& targets = *targets_;
  while (views_.size() < targets.size()) views_.push_back(std::make_unique<FitView>(options_));
  out_.resize(targets.size());
  shapes_.clear();
  double factor = 0;
  int known = 0;
  for (std::size_t m = 0; m < targets.size(); ++m) {
    views_[m]->open(frame, camera, targets[m], options_.padding_m, plane);
    views_[m]->read_free_space(options_.padding_m);
    shapes_.push_back(&targets[m].shape);
    Fitted& fitted = out_[m].fitted;
    fitted.memory = targets[m].memory;
    fitted.steps.clear();
    fitted.foreground = -1;
    out_[m].inside = -1;
    if (targets[m].memory.noise_known) factor += targets[m].memory.noise_factor, ++known;
  }
  memory_ = targets.front().memory;
  memory_.noise_known = known > 0;
  memory_.noise_factor = known > 0 ? factor / known : 1;
  contact_reach_m_ = -1;
}

void JointFitter::fit_coarse(optim::State* x) {
  coarse_.clear(targets_->size());
  bool more = false;
  for (std::size_t m = 0; m < targets_->size(); ++m) {
    FitView& view = *views_[m];
    if (view.candidates() == 0) continue;
    more |= view.coarse().count() < view.candidates();
    coarse_.take(int(m), *targets_, *x, kEverywhere_m, kCoarseMargin_m, options_.coarse_pixels,
                 noise_ratio(m), &view.coarse());
  }
  each_coarse_stage(options_, options_.scale_start_m, last_scale(), more, views_.front()->energy_options(),
                    [&](energies::SdfEnergyOptions energy) {
                      energy.sharpness = float(options_.coarse_union_sharpness);
                      run_stage(&coarse_, energy, {kStepsPerSingle * kCoarseSteps, 0.02, 4}, x);
                    });
}

void JointFitter::fit_between(optim::State* x) {
  energies::SdfEnergyOptions energy = views_.front()->energy_options();
  energy.sharpness = float(options_.union_sharpness);
  energy.scale_m = float(last_scale());
  refuse_behind(options_, &energy);
  each_share_between(all_.count() / std::max(1.0, coarse_count()), [&](double share) {
    part_.assign_share(all_, share);
    run_stage(&part_, energy, {kCoarseSteps, 0.006, 2}, x);
  });
}

void JointFitter::fit_fine(optim::State* x) {
  energies::SdfEnergyOptions energy = views_.front()->energy_options();
  energy.sharpness = float(options_.union_sharpness);
  energy.threads = threads_;
  const double last_reach_m =
      options_.scale_start_m > 0 ? 0.003 : options_.padding_m;  // no coarse stage before
  for (int round = memory_.noise_known || !options_.adapt_noise ? 1 : 0; round < 2; ++round) {
    energy.scale_m = float(last_scale());
    // An outline may move the pose far, into another object: the first stage has a longer contact reach.
    if (read_outlines(*x)) {
      part_.assign_share(all_, std::min(1.0, coarse_count() / std::max(1, all_.count())));
      run_stage(&part_, energy, {fine_steps(options_), 0.02, 2, false, true}, x);
    }
    run_stage(&all_, energy, {fine_steps(options_), last_reach_m, 1, true, true}, x);
    measure(*x, round == 1);
  }
}

bool JointFitter::read_outlines(const optim::State& x) {
  bool any = false;
  for (std::size_t m = 0; m < targets_->size(); ++m) {
    FitView& view = *views_[m];
    if (view.candidates() == 0 || !view.outline_helps()) continue;
    view.set_neighbors(&neighbors_at(x, m));
    view.read_outline(inverse(x.T_obj_cam[m]), options_.outline_reach_px);
    any |= view.outline_weight((*targets_)[m].memory) > 0;
  }
  return any;
}

void JointFitter::settle(JointPixels* pixels, const energies::SdfEnergyOptions& energy,
                         const optim::State& x) {
  std::array<SdfView, energies::kMaxJoined> sdfs;
  energies_.clear();
  for (const auto& part : *pixels) {
    one_.K = x.K, one_.T_obj_cam.clear();
    for (int k = 0; k < part->objects; ++k) {
      const auto m = std::size_t(part->of[k]);
      sdfs[k] = shapes_[m]->sdf;
      one_.T_obj_cam.push_back(x.T_obj_cam[m]);
    }
    energies_.emplace_back(sdfs.data(), part->objects, &part->pixels, energy);
    if (energy.residual == energies::Residual::kRayHit) energies_.back().settle(one_, kSettleSteps);
  }
}

// Free space, brightness, outline and prior of every object, as in a single fit.
void JointFitter::make_terms(const JointPixels& pixels, const optim::State& x, const Stage& stage) {
  free_space_.clear(), priors_.clear(), brightness_.clear(), outlines_.clear();
  free_space_.reserve(targets_->size()), priors_.reserve(targets_->size());
  brightness_.reserve(targets_->size()), outlines_.reserve(targets_->size());
  for (int m = 0; m < int(targets_->size()); ++m) {
    const auto i = std::size_t(m);
    const FitTarget& target = (*targets_)[i];
    energies::Beside beside;
    free_space_.emplace_back(&target.shape.outline, &views_[i]->free_grid(),
                             free_space_options(options_, views_[i]->free_grid()));
    one_.K = x.K, one_.T_obj_cam.assign(1, x.T_obj_cam[i]);
    double weight = views_[i]->free_grid().empty() ? 0 : free_space_weight(i, pixels.counts()[i]);
    if (weight > 0) {
      group_.add(&free_space_.back(), weight, &m, 1);
      beside.outline = free_space_.back().term(one_), beside.outline_weight = weight;
    }
    const energies::PixelSet& own = stage.all ? views_[i]->pixels() : views_[i]->coarse();
    weight = 0;
    if (own.count() > 0) brightness_.push_back(views_[i]->brightness(own, one_, &weight));
    if (weight > 0) {
      weight = weight * pixels.counts()[i] / own.count();
      group_.add(&brightness_.back(), weight, &m, 1);
      beside.brightness = brightness_.back().on_device(), beside.brightness_weight = weight;
    }
    weight = stage.outlines && views_[i]->pixels().count() > 0
                 ? views_[i]->outline_weight(target.memory) * pixels.counts()[i] / views_[i]->pixels().count()
                 : 0;
    if (weight > 0) {
      outlines_.push_back(views_[i]->outline_energy(target.memory, kCommonBesideDepth_px));
      group_.add(&outlines_.back(), weight, &m, 1);
      beside.lines = outlines_.back().on_device(), beside.lines_weight = weight;
    }
    const Matrix6d prior = prior_of(i, own.count());
    priors_.emplace_back(optim::Unknowns{1, false, false}, 0, inverse(target.expected), prior);
    if (prior.diagonal().maxCoeff() > 0) {
      group_.add(&priors_.back(), 1, &m, 1);
      beside.prior = priors_.back().term();
    }
    if (m < energies::kMaxJoined) task_.beside[m] = beside;
  }
}

// Without a prior and without measurements nothing would keep an object where it is.
Matrix6d JointFitter::prior_of(std::size_t m, int pixels) const {
  Matrix6d prior = (*targets_)[m].prior;
  if (pixels >= kMinFitPixels) return prior;
  const Matrix6d weak = optim::PosePrior::isotropic(kUnseen_m, kUnseen_rad);
  for (int i = 0; i < 6; ++i)
    if (!(prior(i, i) > 0)) prior(i, i) = weak(i, i);
  return prior;
}

// Changing colours are not sent.
bool JointFitter::runs_on_device(const JointPixels& pixels) const {
  if (!device_ || targets_->size() < 2 || targets_->size() > energies::kMaxJoined) return false;
  for (const FitTarget& target : *targets_)
    if (options_.photometric && target.shape.colors.rgb_seen && target.shape.sdf.id == 0) return false;
  return collision_.runs_on_device() && pixels.count() >= kMinOnDevice;
}

// Starts at lm_result_.x.
void JointFitter::minimize_on_device(JointPixels* pixels, const energies::SdfEnergyOptions& energy,
                                     const optim::LmOptions& lm) {
  optim::State& x = lm_result_.x;
  task_.objects = int(targets_->size()), task_.parts = 0;
  task_pixels_.clear();
  for (const auto& part : *pixels) {
    energies::JointPart& to = task_.part[task_.parts++];
    to.objects = part->objects, to.pixels = part->pixels.count();
    std::copy(part->of.begin(), part->of.end(), to.of);
    task_pixels_.append(part->pixels);
  }
  for (std::size_t m = 0; m < targets_->size(); ++m)
    task_.sdf[m] = shapes_[m]->sdf, task_.T_obj_cam[m] = x.T_obj_cam[m];
  task_.pixels = &task_pixels_, task_.K = x.K, task_.options = energy, task_.rules = lm;
  task_.settle_steps = energy.residual == energies::Residual::kRayHit ? kSettleSteps : 0;
  task_.contacts = collision_.on_device();
  energies::fit_together(device_, task_, &found_);
  std::copy_n(found_.T_obj_cam, targets_->size(), x.T_obj_cam.begin());
  lm_result_.cost = found_.cost, lm_result_.count = found_.count, lm_result_.damping = found_.damping;
  lm_result_.stop = found_.stop, lm_result_.steps = found_.steps;
}

void JointFitter::run_stage(JointPixels* pixels, const energies::SdfEnergyOptions& energy, const Stage& stage,
                            optim::State* x) {
  const std::vector<FitTarget>& targets = *targets_;
  const bool on_device = runs_on_device(*pixels);
  group_.clear(int(targets.size()));
  if (!on_device) {
    settle(pixels, energy, *x);
    std::size_t k = 0;
    for (const auto& part : *pixels) group_.add(&energies_[k++], 1, part->of.data(), part->objects);
  }
  make_terms(*pixels, *x, stage);
  collision_.set_printed(energy.scale_m, energy.sharpness);
  if (contact_reach_m_ != stage.contact_reach_m || stage.all) {
    collision_.prepare(shapes_, pixels->counts(), *x, stage.contact_reach_m, stage.contact_stride);
    contact_reach_m_ = stage.contact_reach_m;
  }
  // As soft as the data: a stiff contact would keep rough poses from passing each other.
  collision_.set_tolerance(options_.collision_tolerance_m *
                           std::max(1.0, double(energy.scale_m) / last_scale()));
  if (!collision_.empty()) group_.add(&collision_);

  lm_result_.x = *x;
  optim::LmOptions lm = stage_lm(options_, stage.steps, memory_.noise_known, stage.all);
  // A hinge bends where it begins: every step is evaluated, the last ones across its edge.
  if (!collision_.empty() && !options_.stop_printed)
    lm.sure_gain = 0, lm.cost_gain = std::max(lm.cost_gain, kMinGainInContact);
  if (on_device)
    minimize_on_device(pixels, energy, lm);
  else
    optim::minimize(group_, lm, &lm_work_, &lm_result_);
  *x = lm_result_.x;
  for (std::size_t m = 0; m < targets.size(); ++m)
    for (const optim::LmStep& step : lm_result_.steps)
      out_[m].fitted.steps.push_back({step, double(energy.scale_m), pixels->counts()[m]});
}

// The noise of each object, and in the last round its covariance, from the pixels that are its own.
void JointFitter::measure(const optim::State& x, bool last) {
  double factor = 0;
  int known = 0;
  for (std::size_t m = 0; m < targets_->size(); ++m) {
    measure_one(m, x, last);
    const FitMemory& memory = out_[m].fitted.memory;
    if (memory.noise_known) factor += memory.noise_factor, ++known;
  }
  if (!last && known > 0) memory_.noise_factor = factor / known;
}

void JointFitter::measure_one(std::size_t m, const optim::State& x, bool last) {
  const FitTarget& target = (*targets_)[m];
  FitView& view = *views_[m];
  Fitted& fitted = out_[m].fitted;
  fitted.T_cam_obj = inverse(x.T_obj_cam[m]);
  out_[m].hidden = view.candidates() == 0 || view.pixels().count() < kMinFitPixels;
  if (out_[m].hidden) {
    // Of what determines a hidden object's pose only the prior is its own information.
    const Matrix6d prior = prior_of(m, 0) + 1e-9 * Matrix6d::Identity();
    fitted.covariance = camera_covariance(prior.inverse(), fitted.T_cam_obj, -target.shape.centre_obj);
    fitted.cost = 0, fitted.centre_sd = std::numeric_limits<double>::infinity();
    return;
  }
  energies::SdfEnergyOptions options = view.energy_options();
  options.threads = threads_;
  options.scale_m = float(view.last_scale(memory_));
  energies::SdfEnergy energy(target.shape.sdf, &view.pixels(), options);
  one_.K = x.K, one_.T_obj_cam.assign(1, x.T_obj_cam[m]);
  energy.classify(one_, kClassifySteps);
  fitted.cost = cost_of(m, &energy);
  const energies::EnergySummary summary = energy.summarize(one_, kSummaryPixels, &view.summary_scratch());
  view.measure_noise(summary, &fitted.memory);
  if (!last) return;
  view.set_neighbors(&neighbors_at(x, m));
  view.measure_pose(options, one_, summary, &energy, &fitted);
}

// Mean cost per pixel at one_, of the terms in a single fit of this object.
double JointFitter::cost_of(std::size_t m, energies::SdfEnergy* data) {
  const int pixels = views_[m]->pixels().count();
  double sum = data->cost(one_) + priors_[m].cost(one_);
  if (!views_[m]->free_grid().empty()) sum += free_space_weight(m, pixels) * free_space_[m].cost(one_);
  return sum / pixels;
}

void JointFitter::examine(const optim::State& x) {
  const std::vector<FitTarget>& targets = *targets_;
  for (std::size_t m = 0; m < targets.size(); ++m) views_[m]->examine(neighbors_at(x, m), &out_[m].fitted);
}

// The neighbours that object m may touch; valid until the next call.
const Neighbors& JointFitter::neighbors_at(const optim::State& x, std::size_t m) {
  const std::vector<FitTarget>& targets = *targets_;
  neighbors_.clear();
  for (std::size_t k = 0; k < targets.size(); ++k)
    if (k != m &&
        may_touch(targets[m].shape, inverse(x.T_obj_cam[m]), targets[k].shape, inverse(x.T_obj_cam[k])))
      neighbors_.push_back({targets[k].shape.sdf, x.T_obj_cam[k].cast<float>()});
  return neighbors_;
}

}  // namespace sdftrack::tracking

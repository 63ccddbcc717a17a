// SPDX-License-Identifier: MIT
#include "tracking/fit.h"

#include <algorithm>
#include <cmath>

namespace sdftrack {

namespace {

// A step that promises a smaller gain in log-likelihood moves the pose by less than 5 % of its standard
// deviation.
constexpr double kLeastGain = 1e-3;
// A step that promises less than this gain in log-likelihood (five standard deviations) is taken without a
// look at where it leads, and is the last of its stage: what Gauss-Newton leaves of it is of second order
// (docs/math/depth_tracker.md, section 4).
constexpr double kSureGain = 12;
// Noise alone promises this much, one half for each unknown: a stage on a part of the pixels leaves it to
// those that follow, or what stands still would tremble.
constexpr double kNoiseGain = 3;
// Newton steps before the first linearisation; one leaves curved parts as fallback, with its bias.
constexpr int kSettleSteps = 2;
constexpr double kMostRatio = 6.5;  // of pixels from one stage to the next
constexpr double kMostSpread = 10;  // readings packed per one of the budget, to find those near the surface
constexpr double kFineReach_m = 0.004, kFineReachPerScale = 5;
constexpr float kSurelyBackground = 0.1f;  // posterior of a colour that cannot be the object's
constexpr int kSummaryPixels = 1000;
constexpr double kAreaFollows = 0.4;
constexpr int kAreaEvery = 4;         // frames from one measurement to the next
constexpr int kLeastOnDevice = 1500;  // pixels; fewer are summed here before a kernel would have started
constexpr int kClassifySteps = 4;
constexpr double kSharedPerLocal = 2;  // a sensor's whole noise is at most this much of that among neighbours
constexpr double kLeastNoise_m = 1e-4;  // s never falls below: the volume itself is no better than this

FitMemory updated(FitMemory memory, double measured_m, double stated_m) {
  if (!(measured_m > 0)) return memory;
  const double measured = std::clamp(measured_m / stated_m, 0.1, 10.0);
  memory.noise_factor = memory.noise_known ? 0.8 * memory.noise_factor + 0.2 * measured : measured;
  memory.noise_known = true;
  return memory;
}

// Whether the frame shows enough of the object, where it is expected, to measure the sensor by it.
bool clear_view(const Visibility& seen) {
  return agreeing_share(seen) > 0.6 && seen.farther < 0.1 * seen.agree;
}

}  // namespace

double fit_quality(const Fitted& fitted, const TrackerOptions& options) {
  const double worst = options.outlier_floor > 0 ? -std::log(options.outlier_floor) : 0;
  return agreeing_share(fitted.seen) - (worst > 0 ? fitted.cost / worst : 0);
}

std::optional<Fitted> PoseFitter::fit(const DepthFrame& frame, const Camera& camera, const FitTarget& target,
                                      const Attempt& attempt, const Plane* plane) {
  if (!gather(frame, camera, target, attempt.padding_m, plane)) return std::nullopt;
  read_free_space(frame, attempt.padding_m);
  Fitted fitted = blank();
  State& x = state_;
  fit_coarsely(frame, attempt, &x, &fitted);
  choose_fine_pixels(last_scale(fitted.memory), x);
  fit_between(&x, &fitted);
  fit_fine(&x, &fitted, true);
  fitted.T_cam_obj = inverse(x.T_obj_cam[0]);
  examine(frame, &fitted);
  return fitted;
}

std::optional<Fitted> PoseFitter::look(const DepthFrame& frame, const Camera& camera,
                                       const FitTarget& target) {
  if (!gather(frame, camera, target, options_.padding_m, nullptr)) return std::nullopt;
  Fitted fitted = blank();
  fitted.T_cam_obj = target.expected;
  State& x = state_;
  begin_at(target.expected, &x);
  choose_fine_pixels(last_scale(fitted.memory), x);
  fit_fine(&x, &fitted, false);
  examine(frame, &fitted);
  return fitted;
}

// The pixels around the expected pose; false where they are too few.
bool PoseFitter::gather(const DepthFrame& frame, const Camera& camera, const FitTarget& target,
                        double padding_m, const Plane* plane) {
  camera_ = &camera, target_ = &target;
  stated_noise_m_ = sensor_noise_m(options_, target.expected.t.z);
  selection_.choose(frame, camera, target.shape, target.expected, options_, padding_m, plane);
  if (selection_.count() < options_.min_pixels) return false;
  if (target.colors)
    color_reader_.open(frame, camera, projected_box(camera, target.shape, target.expected, padding_m),
                       depth_range(target.shape, target.expected, padding_m));
  pack(options_.coarse_pixels, &coarse_);
  return true;
}

void PoseFitter::pack(int wanted, PixelSet* out) {
  selection_.pack(wanted, out);
  if (target_->colors) fetch_foreground(*target_->colors, color_reader_, out);
}

// A wrong pose has large residuals; so that these do not pass for the sensor's noise and excuse themselves,
// what was known before and the noise among neighbouring readings bound what may count as agreement, and a
// doubtful view teaches no noise.
void PoseFitter::examine(const DepthFrame& frame, Fitted* fitted) {
  const FitMemory& before = target_->memory;
  const double stated_m = sensor_noise_m(options_, fitted->T_cam_obj.t.z);
  const double local = local_noise_m(pixels_, &floats_) / stated_noise_m_;  // over stated, as the factor
  const double measured = fitted->memory.noise_factor;
  fitted->roughness = local > 0 ? measured / std::max(local, kLeastNoise_m / stated_m) : 1;
  const double known = before.noise_known ? before.noise_factor : measured;
  const double noise_m = (local > 0 ? std::min(known, kSharedPerLocal * local) : known) * stated_m;
  fitted->seen = compare_visible_surface(frame, *camera_, target_->shape, fitted->T_cam_obj, noise_m,
                                         options_.trust_points);
  fitted->outline = compare_outline(frame, *camera_, target_->shape, fitted->T_cam_obj, noise_m);
  if (before.noise_known && !clear_view(fitted->seen)) fitted->memory.noise_factor = known;
}

void PoseFitter::read_free_space(const DepthFrame& frame, double padding_m) {
  free_grid_.distance_px.clear();
  if (!options_.free_space) return;
  const IsBackground of_background = [&](int at, Vec2f u, float depth_m) {
    const int bin = color_reader_.bin(at, u, depth_m);
    return bin >= 0 && target_->colors->posterior()[static_cast<std::size_t>(bin)] < kSurelyBackground;
  };
  const bool ask = target_->colors && options_.color_free_space;
  free_space_grid(frame, *camera_, target_->shape, target_->expected, padding_m,
                  ask ? &of_background : nullptr, &free_scratch_, &free_grid_);
}

Fitted PoseFitter::blank() {
  Fitted fitted;
  fitted.memory = target_->memory;
  if (spare_steps_.empty()) return fitted;
  fitted.steps = std::move(spare_steps_.back());
  spare_steps_.pop_back();
  fitted.steps.clear();
  return fitted;
}

void PoseFitter::begin_at(const Rigidd& T_cam_obj, State* x) const {
  x->T_obj_cam.assign(1, inverse(T_cam_obj));
  x->K = camera_->K;
  x->log_scale.clear();
}

// From the best of the attempt's starts.
void PoseFitter::fit_coarsely(const DepthFrame& frame, const Attempt& attempt, State* x, Fitted* fitted) {
  const double noise_m = fitted->memory.noise_factor * stated_noise_m_;
  double most = -1;
  for (const Rigidd& start : attempt.starts) {
    State& now = attempt.starts.size() == 1 ? *x : trial_;
    begin_at(start, &now);
    if (!options_.keep_damping) fitted->memory.damping = options_.damping_start;
    fit_coarse(attempt, &now, fitted);
    if (attempt.starts.size() == 1) return;
    const double share = agreeing_share(compare_visible_surface(
        frame, *camera_, target_->shape, inverse(now.T_obj_cam[0]), noise_m, options_.trust_points));
    if (share > most) most = share, *x = now;
  }
}

// Coarse stages on an even subset: phi at the measured points, the better start from afar, and last the
// residual of the fine stage.
void PoseFitter::fit_coarse(const Attempt& attempt, State* x, Fitted* fitted) {
  if (!(attempt.scale_m > 0)) return;
  const double last = last_scale(fitted->memory);
  SdfEnergyOptions energy = energy_options();
  energy.residual = Residual::kPoint;
  if (options_.outlier_floor > 0) {
    energy.outlier_floor = static_cast<float>(options_.coarse_floor);
    energy.floor_behind = static_cast<float>(options_.coarse_floor_behind);
  }
  for (double s = attempt.scale_m; s > 1.5 * last; s *= 0.5) {
    energy.scale_m = static_cast<float>(s);
    run_stage(&coarse_, energy, attempt.coarse_steps, x, fitted);
  }
  if (coarse_.count() < selection_.count()) {
    energy.scale_m = static_cast<float>(last);
    energy.residual = options_.residual;
    run_stage(&coarse_, energy, attempt.coarse_steps, x, fitted);
  }
}

// Readings far from the surface have lost all weight at this scale: of the others as many as the budget
// allows.
void PoseFitter::choose_fine_pixels(double scale_m, const State& x) {
  const double reach_m = std::max(kFineReach_m, kFineReachPerScale * scale_m);
  int wanted = options_.max_pixels;
  if (options_.outlier_floor > 0 && selection_.count() > wanted) {
    const int near = SdfEnergy(target_->shape.sdf, &coarse_, {}).count_near(x, reach_m);
    wanted = static_cast<int>(wanted * std::min(kMostSpread, coarse_.count() / std::max(1.0, 1.0 * near)));
  }
  pack(wanted, &pixels_);
  if (options_.outlier_floor > 0) SdfEnergy(target_->shape.sdf, &pixels_, {}).keep_near(x, reach_m);
  if (pixels_.count() > options_.max_pixels) {
    scratch_.assign_subset(pixels_, options_.max_pixels);
    std::swap(scratch_, pixels_);
  }
}

// From the few pixels of the coarse stages to all in even ratios, so that each stage begins where one look is
// enough.
void PoseFitter::fit_between(State* x, Fitted* fitted) {
  const double ratio = pixels_.count() / static_cast<double>(std::max(1, options_.coarse_pixels));
  const int stages = ratio > 1 ? static_cast<int>(std::ceil(std::log(ratio) / std::log(kMostRatio))) : 1;
  SdfEnergyOptions energy = energy_options();
  energy.scale_m = static_cast<float>(last_scale(fitted->memory));
  for (int k = 1; k < stages; ++k) {
    const double share = std::pow(ratio, static_cast<double>(k) / stages - 1);
    coarse_.assign_subset(pixels_, static_cast<int>(share * pixels_.count()));
    run_stage(&coarse_, energy, options_.coarse_steps, x, fitted);
  }
}

SdfEnergyOptions PoseFitter::energy_options() const {
  SdfEnergyOptions energy{options_.residual, options_.curvature};
  energy.outlier_floor = static_cast<float>(options_.outlier_floor);
  energy.color = target_->colors != nullptr;
  energy.color_likelihood = options_.color_likelihood;
  energy.color_prior = static_cast<float>(options_.color_prior);
  return energy;
}

double PoseFitter::last_scale(const FitMemory& memory) const {
  return options_.scale_per_noise * std::max(kLeastNoise_m, memory.noise_factor * stated_noise_m_);
}

// With `move` false the noise and the covariance of the state as it is.
void PoseFitter::fit_fine(State* x, Fitted* fitted, bool move) {
  SdfEnergyOptions options = energy_options();
  options.threads = threads_;
  // The first frame does not know the sensor's noise yet: fit, measure, fit again.
  for (int round = fitted->memory.noise_known || !options_.adapt_noise ? 1 : 0; round < 2; ++round) {
    options.scale_m = static_cast<float>(last_scale(fitted->memory));
    SdfEnergy energy(target_->shape.sdf, &pixels_, options);
    if (move)
      run_stage(&pixels_, options, options_.fine_steps, x, fitted);
    else
      energy.classify(*x, kClassifySteps);
    const EnergySummary summary = energy.summarize(*x, kSummaryPixels, &summary_scratch_);
    if (options_.adapt_noise) fitted->memory = updated(fitted->memory, summary.noise_m, stated_noise_m_);
    if (round == 0) continue;
    if (options.color) fitted->cost = summary.cost, fitted->foreground = summary.foreground;
    const double area_px = correlation_area(options, *x, &energy, &fitted->memory);
    const Matrix6d increment = increment_covariance(summary, target_->shape, area_px);
    fitted->centre_sd =
        std::sqrt(increment.topLeftCorner<3, 3>().diagonal().maxCoeff()) / (0.5 * target_->shape.diameter_m);
    fitted->covariance = camera_covariance(increment, inverse(x->T_obj_cam[0]), -target_->shape.centre_obj);
  }
}

// As stated, or measured and followed from frame to frame.
double PoseFitter::correlation_area(const SdfEnergyOptions& options, const State& x, SdfEnergy* energy,
                                    FitMemory* memory) {
  if (options_.correlation_area_px > 0) return options_.correlation_area_px;
  double& area = memory->correlation_area_px;
  if (area > 0 && ++memory->area_age < kAreaEvery) return std::max(1.0, area);
  memory->area_age = 0;
  energy->follow_hits(x);  // the last look may have been a step away
  const double now = correlation_.measure(pixels_, {options.scale_m, options.outlier_floor},
                                          options.color ? options.color_prior : 0.0f);
  if (now > 0) area = area > 0 ? area + kAreaFollows * (now - area) : now;
  return std::max(1.0, area);
}

void PoseFitter::run_stage(PixelSet* pixels, const SdfEnergyOptions& energy_options, int steps, State* x,
                           Fitted* fitted) {
  const Shape& shape = target_->shape;
  SdfEnergy data(shape.sdf, pixels, energy_options);
  CudaWork* const device = pixels->count() >= kLeastOnDevice ? device_ : nullptr;
  if (energy_options.residual == Residual::kRayHit)
    data.settle(*x, kSettleSteps, device);
  else if (device)
    data.enter_device(device);
  sum_.clear();
  sum_.add(&data);

  FreeSpaceEnergy free_space(&shape.outline, &free_grid_,
                             {static_cast<float>(options_.free_space_scale_m), 1.0f});
  if (!free_grid_.empty())
    sum_.add(&free_space,
             options_.free_space_weight * pixels->count() / static_cast<double>(shape.outline.size()));
  PosePrior prior({1, false, false}, 0, inverse(target_->expected), target_->prior);
  if (target_->prior.diagonal().maxCoeff() > 0) sum_.add(&prior);

  LmOptions lm;
  lm.max_steps = steps;
  lm.damping = fitted->memory.damping;
  lm.cost_relative = 0;
  lm.cost_gain = kLeastGain;
  // The first frame may begin far off: there every step counts, and is looked at.
  if (target_->memory.noise_known) {
    lm.sure_gain = kSureGain;
    if (pixels != &pixels_) lm.cost_gain = kNoiseGain;
  }
  LmResult& found = lm_result_;
  found.x = *x;
  minimize(sum_, lm, &lm_work_, &found);
  data.leave_device();
  for (const LmStep& step : found.steps)
    fitted->steps.push_back({step, energy_options.scale_m, pixels->count()});
  *x = found.x;
  if (options_.keep_damping) fitted->memory.damping = std::clamp(found.damping, 1e-6, options_.damping_start);
  fitted->cost = found.count > 0 ? found.cost / found.count : 0;
}

}  // namespace sdftrack

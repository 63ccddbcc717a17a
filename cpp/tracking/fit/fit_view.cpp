// SPDX-License-Identifier: MIT
#include "tracking/fit/fit_view.h"

#include <cmath>
#include <limits>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "optim/camera_increment.h"
#include "tracking/options/sensor_noise.h"
#include "tracking/size/depth_size.h"
#include "tracking/trust/open_directions.h"

namespace sdftrack::tracking {

namespace {

constexpr int kMinBright = 20;     // pixels
constexpr double kMaxSpread = 10;  // pixels packed per pixel of the budget, to find those near the surface
constexpr double kFineReach_m = 0.004, kFineReachPerScale = 5;
constexpr double kOddSize = 0.01, kOddSize_sd = 2;  // log scale that is evaluated again at once
constexpr double kSizeShare = 0.4;  // of the visible surface, that must agree for an evaluation of the size
constexpr float kSurelyBackground = 0.1f;  // posterior of a colour that cannot be the object's
constexpr double kAreaFollows = 0.4;
constexpr int kAreaEvery = 4;                   // frames from one measurement to the next
constexpr int kFormEvery = 4;                   // size evaluations per evaluation of the form
constexpr int kFirstLooks = 8, kLookEvery = 5;  // of the size; the second: interval of later ones
constexpr double kAgain = 0.06;                 // a log stretch that is evaluated again at once
constexpr double kSharedPerLocal = 2;  // a sensor's whole noise is at most this much of that among neighbours
constexpr double kSharedFollows = 0.1;
constexpr double kFormTolerance_m = 0.008;  // greatest distance from the surface of a measurement on it
constexpr double kMinNoise_m = 1e-4;        // lower bound of s: the volume itself is no more exact

// Whether the frame shows enough of the object at its expected pose to measure the sensor by it.
bool clear_view(const Visibility& seen) {
  return agreeing_share(seen) > 0.6 && seen.farther < 0.1 * seen.agree;
}

// Whether the size is evaluated in the current one of the frames that allow it: in all of the first frames
// and of those after an unusual size, then in one of five.
bool is_turn_for_size(int* turns) {
  if (++*turns <= kFirstLooks) return true;
  if (*turns < kFirstLooks + kLookEvery) return false;
  *turns = kFirstLooks;
  return true;
}

}  // namespace

int FitView::open(const frame::DepthFrame& frame, const Camera& camera, const FitTarget& target,
                  double padding_m, const frame::Plane* plane) {
  frame_ = &frame, camera_ = &camera, target_ = &target, neighbors_ = target.neighbors;
  stated_noise_m_ = sensor_noise(options_).at(target.expected.t.z);
  free_grid_.distance_px.clear();
  selection_.choose(frame, camera, target.shape, target.expected, sensor_noise(options_), padding_m, plane);
  coarse_.clear(), pixels_.clear();  // of another frame, whose colours may be gone
  outline_lines_.lines.clear(), apart_.reset(), by_outline_.reset();
  measured_.known = false;
  if (selection_.count() == 0) return 0;
  if (reads_colors())
    color_reader_.open(frame, camera, frame::projected_box(camera, target.shape, target.expected, padding_m),
                       frame::depth_range(target.shape, target.expected, padding_m));
  pack(options_.coarse_pixels, &coarse_);
  smooth_foreground(nullptr, 0, &coarse_);
  keep_seen(inverse(target.expected), &coarse_);
  return selection_.count();
}

void FitView::open_without_depth(const frame::DepthFrame& frame, const Camera& camera,
                                 const FitTarget& target) {
  frame_ = &frame, camera_ = &camera, target_ = &target, neighbors_ = target.neighbors;
  stated_noise_m_ = sensor_noise(options_).at(target.expected.t.z);
  coarse_.clear(), pixels_.clear();
  outline_lines_.lines.clear();
  measured_.known = false;
}

void FitView::pack(int requested, energies::PixelSet* out) {
  selection_.pack(requested, out);
  if (target_->colors) fetch_foreground(*target_->colors, color_reader_, out);
}

void FitView::smooth_foreground(const float* distance_m, double reach_m, energies::PixelSet* pixels) {
  if (target_->colors && options_.smooth_colors)
    smoother_.smooth(camera_->width, float(camera_->K.fx), float(stated_noise_m_), distance_m, float(reach_m),
                     pixels);
}

energies::PhotometricEnergy FitView::brightness(const energies::PixelSet& pixels, const optim::State& x,
                                                double* weight) {
  if (uses_brightness())
    fetch_grey(color_reader_, pixels, options_.photometric_pixels, &grey_);
  else
    grey_.clear();
  energies::PhotometricEnergy energy(target_->shape.sdf, target_->shape.colors, &grey_, {},
                                     &photometric_hits_);
  const bool enough = energy.settle(x) >= kMinBright;
  *weight = enough ? options_.photometric_weight * pixels.count() / grey_.count() : 0;
  return energy;
}

// A direction held by the brightness is not blind: its slope counts as one of the depth at the same noise.
void FitView::add_brightness(const optim::State& x, double scale_m, energies::EnergySummary* summary) {
  double weight;
  energies::PhotometricEnergy energy = brightness(pixels_, x, &weight);
  if (!(weight > 0)) return;
  photometric_.reset(6);
  energy.linearize(x, &photometric_);
  summary->A += weight * photometric_.hessian;
  summary->B += weight * weight * photometric_.hessian;  // of one measurement that stands for `weight`
  summary->geometry += scale_m * scale_m / energy.used() * photometric_.hessian;
}

// For a partially known shape: keeps the measurements of the known part.
void FitView::keep_seen(const Rigidd& T_obj_cam, energies::PixelSet* pixels) const {
  const frame::Shape& shape = target_->shape;
  if (!shape.seen.amount) return;
  const Intrinsics<float> K = camera_->K.cast<float>();
  const Rigidf T = T_obj_cam.cast<float>();
  int kept = 0;
  for (int i = 0; i < pixels->count(); ++i) {
    const auto k = std::size_t(i);
    const Vec3f p_cam = pixels->depth_m[k] * ray(K, pixels->u_px[k], pixels->v_px[k]);
    if (shape.seen.below(shape.sdf, T * p_cam)) pixels->copy(*pixels, i, kept++);
  }
  pixels->resize(kept);
}

void FitView::read_free_space(double padding_m) {
  if (!options_.free_space) return;
  const frame::IsBackground of_background = [&](int at, Vec2f u, float depth_m) {
    const int bin = color_reader_.bin(at, u, depth_m);
    return bin >= 0 && target_->colors->posterior()[bin] < kSurelyBackground;
  };
  const bool ask = target_->colors && options_.color_free_space;
  frame::free_space_grid(*frame_, *camera_, target_->shape, target_->expected, padding_m,
                         ask ? &of_background : nullptr, &free_scratch_, &free_grid_);
}

double FitView::fine_reach_m(double scale_m) { return std::max(kFineReach_m, kFineReachPerScale * scale_m); }

int FitView::budget_for(double reach_m, const optim::State& x) {
  const int requested = options_.max_pixels;
  if (!(options_.outlier_floor > 0) || selection_.count() <= requested) return requested;
  const int near = energies::SdfEnergy(target_->shape.sdf, &coarse_, {}).count_near(x, reach_m);
  return to_int(requested * std::min(kMaxSpread, coarse_.count() / std::max(1.0, 1.0 * near)));
}

void FitView::pack_for_budget(double reach_m, const optim::State& x) {
  pack(budget_for(reach_m, x), &pixels_);
}

void FitView::choose_fine_pixels(double scale_m, const optim::State& x) {
  const double reach_m =
      options_.outlier_floor > 0 ? fine_reach_m(scale_m) : std::numeric_limits<double>::infinity();
  selection_.pack(budget_for(reach_m, x), &pixels_);
  energies::SdfEnergy energy(target_->shape.sdf, &pixels_, {});
  if (target_->colors) {
    // Pixels next to and in front of the surface show to which object the measurements on it belong: the
    // colours of all are looked up.
    fetch_foreground(*target_->colors, color_reader_, &pixels_);
    const float* const distance_m = energy.distances(x);
    smooth_foreground(distance_m, reach_m, &pixels_);
    energy.keep_near(distance_m, reach_m);
  } else {
    energy.keep_near(x, reach_m);
  }
  keep_seen(x.T_obj_cam[0], &pixels_);
  if (pixels_.count() > options_.max_pixels) {
    scratch_.assign_subset(pixels_, options_.max_pixels);
    std::swap(scratch_, pixels_);
  }
}

energies::SdfEnergyOptions FitView::energy_options() const {
  energies::SdfEnergyOptions energy{options_.residual, options_.curvature};
  energy.outlier_floor = float(options_.outlier_floor);
  energy.color = target_->colors != nullptr;
  energy.color_likelihood = options_.color_likelihood;
  energy.color_prior = float(options_.color_prior);
  return energy;
}

double FitView::last_scale(const FitMemory& memory) const {
  return options_.scale_per_noise * std::max(kMinNoise_m, memory.noise_factor * stated_noise_m_);
}

void FitView::measure_noise(const energies::EnergySummary& summary, FitMemory* memory) const {
  if (!options_.adapt_noise || !(summary.noise_m > 0)) return;
  const double measured = std::clamp(summary.noise_m / stated_noise_m_, 0.1, 10.0);
  memory->noise_factor = memory->noise_known ? 0.8 * memory->noise_factor + 0.2 * measured : measured;
  memory->noise_known = true;
}

void FitView::measure_pose(const energies::SdfEnergyOptions& options, const optim::State& x,
                           energies::EnergySummary summary, energies::SdfEnergy* energy, Fitted* fitted) {
  const Matrix6d depth_information = summary.A, depth_geometry = summary.geometry;
  add_brightness(x, options.scale_m, &summary);
  if (options.color) fitted->cost = summary.cost, fitted->foreground = summary.foreground;
  double area_px = correlation_area(options, x, energy, &fitted->memory);
  add_outline(x, options.scale_m, &area_px, &summary, &fitted->memory);
  const Matrix6d increment = increment_covariance(summary, target_->shape, area_px);
  fitted->centre_sd =
      std::sqrt(increment.topLeftCorner<3, 3>().diagonal().maxCoeff()) / (0.5 * target_->shape.diameter_m);
  const bool judged = options_.weak_evidence > 0;  // the thesis' tracker is not
  fitted->covariance = camera_covariance(
      target_->shape.seen.amount && judged
          ? increment_covariance(by_form(x, summary, depth_geometry), target_->shape, area_px)
          : increment,
      inverse(x.T_obj_cam[0]), -target_->shape.centre_obj);
  measured_ = {true,
               summary,
               depth_information,
               x.T_obj_cam[0],
               {options.scale_m, options.outlier_floor},
               options.color ? options.color_prior : 0.0f};
}

// For a partially known shape: along directions that only its noise could show, depth gives no information.
energies::EnergySummary FitView::by_form(const optim::State& x, energies::EnergySummary summary,
                                         const Matrix6d& depth_geometry) const {
  const double share = std::pow(kBlindSlope / least_form_slope(target_->shape), 2);
  summary.geometry +=
      share * seen_form(*frame_, *camera_, target_->shape, inverse(x.T_obj_cam[0]), kFormTolerance_m) -
      depth_geometry;
  return summary;
}

// The effect on the pose of a sensor error that the residuals do not show in full.
void FitView::add_systematic(double systematic_m, Fitted* fitted) const {
  fitted->systematic_m = systematic_m;
  const double distance_m = distance_error_m(options_, fitted->T_cam_obj.t.z);
  BiasResponse response;
  if (systematic_m + distance_m > 0 && measured_.known && measured_.sums.inliers > 0) {
    const double information = trace_of(measured_.depth_information, target_->shape);
    BiasSums& sums = fitted->memory.bias;
    if (fitted->memory.area_age == 0 || !sums.hold(information, measured_.T_obj_cam))
      sums = bias_sums(target_->shape, *camera_, measured_.T_obj_cam, pixels_, measured_.penalty,
                       measured_.color_prior, information);
    response =
        bias_response(sums, measured_.sums, information, target_->shape)
            .moved(optim::camera_by_increment(inverse(measured_.T_obj_cam), -target_->shape.centre_obj));
  }
  fitted->systematic_errors = systematic_covariance(
      response, systematic_m, options_.lateral_px * fitted->T_cam_obj.t.z / camera_->K.fx);
  fitted->covariance += fitted->systematic_errors;
  if (distance_m > 0) fitted->unseen_errors = distance_covariance(response, distance_m, fitted->T_cam_obj.t);
}

void FitView::examine(Fitted* fitted) {
  static const Neighbors kNobody;
  examine(target_->neighbors ? *target_->neighbors : kNobody, fitted);
}

// As stated, or measured and filtered from frame to frame.
double FitView::correlation_area(const energies::SdfEnergyOptions& options, const optim::State& x,
                                 energies::SdfEnergy* energy, FitMemory* memory) {
  if (options_.correlation_area_px > 0) return options_.correlation_area_px;
  double& area = memory->correlation_area_px;
  if (area > 0 && ++memory->area_age < kAreaEvery)
    return std::max({1.0, area, options_.min_correlation_area_px});
  memory->area_age = 0;
  energy->follow_hits(x);  // the last evaluation may have been a step away
  const double now = correlation_.measure(pixels_, {options.scale_m, options.outlier_floor},
                                          options.color ? options.color_prior : 0.0f);
  if (now > 0) area = area > 0 ? area + kAreaFollows * (now - area) : now;
  return std::max({1.0, area, options_.min_correlation_area_px});
}

// A wrong pose has large residuals. So that these do not pass for noise of the sensor and excuse themselves,
// the earlier values and the noise among neighbouring measurements bound what may count as agreement, and a
// doubtful view teaches no noise. A given pose is trusted: residuals beyond the noise are then the sensor's
// systematic error, by which the following frames are judged.
void FitView::examine(const Neighbors& others, Fitted* fitted) {
  const FitMemory& before = target_->memory;
  fitted->apart = apart_, fitted->by_outline = by_outline_;
  const double stated_m = sensor_noise(options_).at(fitted->T_cam_obj.t.z);
  const double local = local_noise_m(pixels_, &floats_) / stated_noise_m_;  // over stated, as the factor
  const double measured = fitted->memory.noise_factor;
  const double own = std::max(local, kMinNoise_m / stated_m);
  const double told_m =
      std::min(sensor_systematic_m(options_, fitted->T_cam_obj.t.z), most_systematic_m(options_));
  double& learnt_m = fitted->memory.systematic_m;
  if (before.learns_systematic && local > 0)
    learnt_m = std::clamp(
        std::sqrt(std::max(0.0, measured * measured - std::pow(kSharedPerLocal * own, 2))) * stated_m,
        options_.systematic_m, most_systematic_m(options_));
  const double systematic_m = std::max(learnt_m, told_m);
  // An error of the depth found by the outline does not count against the pose.
  const double shared_m =
      std::max(systematic_m, std::min(options_.max_systematic_m, fitted->memory.outline.depth_off_m));
  fitted->roughness = local > 0 ? measured / hypotenuse(own, shared_m / stated_m) : 1;
  const double known = before.noise_known ? before.noise_factor : measured;
  const double noise_m = (local > 0 ? std::min(known, kSharedPerLocal * local) : known) * stated_m;
  fitted->seen = compare_visible(*frame_, *camera_, target_->shape, fitted->T_cam_obj,
                                 DepthError{noise_m, shared_m}, others);
  fitted->outline = compare_outline(*frame_, *camera_, target_->shape, fitted->T_cam_obj,
                                    DepthError{noise_m, shared_m}, others);
  const double seen_m = local > 0 && fitted->memory.noise_known
                            ? systematic_by_residuals(measured * stated_m, own * stated_m)
                            : 0;
  add_systematic(std::max(systematic_m, std::min(seen_m, options_.max_systematic_m)), fitted);
  fitted->memory.shared_m +=
      (before.noise_known ? kSharedFollows : 1) * (fitted->systematic_m - fitted->memory.shared_m);
  if (before.noise_known && !clear_view(fitted->seen)) fitted->memory.noise_factor = known;
  // Not in every frame, since it is as costly as the correlation area: only in frames that measure the area.
  if (measured_.known && fitted->memory.area_age == 0 && others.empty() && !target_->shape.seen.amount &&
      fitted->seen.agree > kSizeShare * fitted->seen.expected && is_turn_for_size(&fitted->memory.size_turns))
    look_at_size(own * stated_m, told_m, fitted);
}

void FitView::look_at_size(double noise_m, double systematic_m, Fitted* fitted) const {
  fitted->size_by_depth = size_by_depth(pixels_, measured_.color_prior, target_->shape, *camera_,
                                        measured_.T_obj_cam, noise_m, systematic_m);
  int& age = fitted->memory.form_age;
  if (age == 0)
    fitted->form_by_depth = strain_by_depth(pixels_, measured_.color_prior, target_->shape, *camera_,
                                            measured_.T_obj_cam, noise_m, systematic_m);
  const bool again = fitted->form_by_depth && std::abs(fitted->form_by_depth->largest().log_stretch) > kAgain;
  age = again ? 0 : (age + 1) % kFormEvery;
  const std::optional<SizeLook>& size = fitted->size_by_depth;
  const bool odd = size && std::abs(size->log_scale) > kOddSize + kOddSize_sd * size->sd();
  if (again || odd)
    fitted->memory.area_age = kAreaEvery - 1, fitted->memory.size_turns = 0;  // in the next frame
}

}  // namespace sdftrack::tracking

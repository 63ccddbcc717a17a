// SPDX-License-Identifier: MIT
#include "tracking/size/size_test.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/portable_math.h"
#include "optim/camera_increment.h"

namespace sdftrack::tracking {

namespace {

constexpr int kMaxFrames = 30;  // the mean follows the last ones
constexpr double kNewView_rad = 0.35;
constexpr double kLeastSize = 0.002;  // log scale: volumes of meshes deviate by as much
constexpr double kBand = 0.01;        // of the scale: as much as meshes deviate
constexpr double kSureAtOnce_sd = 7;  // by one frame, whose scatter is unknown
constexpr double kFormBand = 0.05;    // of a log stretch: smooth errors of a sensor may look like less
// Share of the strain by depth that the outline confirms: it does not follow the bending of a sensor.
constexpr double kSeenByOutline = 0.25, kTellsForm = 1;  // a share; its information
// Residuals beside a strain, over the noise: 0.8 to 1.4 for another object, 2.2 to 3.1 for sensors that bend
// depth, which may flatten or stretch an object by a third along the line of sight.
constexpr double kBends = 1.7;
constexpr double kSure_sd = 4.5;  // the level for any statement that two things differ
constexpr double kAgree_sd = 3, kLikely_sd = 1.5;
constexpr double kInterval_sd = 1.96, kInterval = 0.003;  // of the volume itself
constexpr double kOutlineReaches = 0.1;  // log scale: lines are searched so near to the model's silhouette
constexpr double kTellingSd = 0.032;     // an outline with a larger sd is not used
constexpr double kRescaleFrom = 0.002, kRescaleSd = 0.5;  // a smaller log scale is left; of its own sd
constexpr double kCurved = 0.03;   // an estimate at a more distant log scale is no longer linear
constexpr double kKnownSd = 0.05;  // of a free scale

std::string shown(const char* format, double a, double b, double c) {
  char text[256];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

}  // namespace

void ViewCount::observe(const Mat3d& R_cam_obj) {
  if (last_ && rotation_angle(R_cam_obj * transpose(last_->R)) <= kNewView_rad) return;
  ++count_;
  last_ = Rigidd{R_cam_obj, {0, 0, 0}};
}

void SizeWitness::observe(const SizeLook& look, const Mat3d& R_cam_obj) {
  views_.observe(R_cam_obj);
  const double rate = 1.0 / std::min(++frames_, kMaxFrames), off = look.log_scale - mean_;
  scatter_ += rate * (frames_ > 1 ? off * off - scatter_ : 0);
  mean_ += rate * off;
  own_var_ += rate * (look.own_var - own_var_);
  shared_var_ += rate * (look.shared_var - shared_var_);
  pull_ = look.pull;
  unexplained_ += rate * (look.unexplained - unexplained_);
}

double SizeWitness::sd() const {
  const double own = std::max(own_var_, scatter_) / std::min(std::max(1, frames_), kMaxFrames);
  return std::sqrt(own + shared_var_ / std::max(1, views_.count()));
}

void SizeWitness::rescaled(double log_scale) {
  if (std::abs(log_scale) > kCurved) {
    const Vector6d pull = pull_;
    *this = {};
    pull_ = pull;
  } else {
    mean_ -= log_scale;
  }
}

void StrainWitness::observe(const StrainLook& look, const Mat3d& R_cam_obj) {
  views_.observe(R_cam_obj);
  const double rate = 1.0 / std::min(++frames_, kMaxFrames);
  const Strain off = look.strain - mean_.strain;
  if (frames_ > 1) scatter_ += rate * (off * off.transpose() - scatter_);
  mean_.strain += rate * off;
  mean_.own_cov += rate * (look.own_cov - mean_.own_cov);
  mean_.shared_cov += rate * (look.shared_cov - mean_.shared_cov);
  mean_.unexplained += rate * (look.unexplained - mean_.unexplained);
}

StrainLook StrainWitness::mean() const {
  // own_cov and scatter_ both estimate the variation from frame to frame, scatter_ from few frames.
  return {mean_.strain, (mean_.own_cov + scatter_) / std::min(frames_, kMaxFrames),
          mean_.shared_cov / std::max(1, views_.count()), mean_.unexplained};
}

void OutlineFormWitness::observe(const StrainInformation& look) {
  const double rate = 1.0 / std::min(++frames_, kMaxFrames);
  mean_.information += rate * (look.information - mean_.information);
  mean_.pull += rate * (look.pull - mean_.pull);
}

std::optional<double> OutlineFormWitness::share_of(const Strain& strain) const {
  const double information = strain.dot(mean_.information * strain);
  if (!(information > kTellsForm)) return std::nullopt;
  return strain.dot(mean_.pull) / information;
}

std::string SizeTest::other_form() const {
  const StrainLook by_depth = form.known() ? form.mean() : StrainLook{};
  // No stretch exceeds this bound, which spares the axes in most frames.
  if (!(1.5 * by_depth.strain.norm() > kFormBand)) return {};
  const StrainLook::Stretch most = by_depth.largest();
  const double sure_sd = form.of_one_frame() ? kSureAtOnce_sd : kSure_sd;
  if (!(std::abs(most.log_stretch) - kFormBand > sure_sd * most.sd)) return {};
  const double unseen = by_depth.unexplained < kBends ? 1 : 0;  // share where the outline does not tell
  if (form_outline.share_of(by_depth.strain).value_or(unseen) < kSeenByOutline) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "the object appears %.0f %% %s than the model along (%.2f, %.2f, %.2f), beside its size; "
                "check the mesh",
                100 * std::abs(std::expm1(most.log_stretch)), most.log_stretch > 0 ? "longer" : "shorter",
                most.axis[0], most.axis[1], most.axis[2]);
  return text;
}

// For a size farther away the outline finds other lines.
bool SizeTest::outline_out_of_reach() const {
  return depth.known() && std::abs(depth.log_scale()) > kOutlineReaches && depth.unexplained() < kExplained;
}

SizeTest::LogScale SizeTest::free_scale() const {
  double information = 0, sum = 0;
  for (const SizeWitness* one : {&depth, &outline}) {
    if (!one->known() || (one == &outline && outline_out_of_reach())) continue;
    const double weight = std::pow(one->sd(), -2);
    information += weight, sum += weight * one->log_scale();
  }
  if (!(information > 0)) return {};
  return {sum / information, 1 / std::sqrt(information)};
}

double SizeTest::log_scale_to_add() const {
  const LogScale s = free_scale();
  return std::abs(s.mean) > std::max(kRescaleFrom, kRescaleSd * s.sd) ? s.mean : 0;
}

void SizeTest::rescaled(double log_scale) {
  depth.rescaled(log_scale);
  outline.rescaled(log_scale);
}

bool SizeTest::determines_scale() const { return free_scale().sd < kKnownSd; }

Matrix6d SizeTest::free_covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const {
  const double sd = std::min(1.0, free_scale().sd);
  Vector6d shift = sd * (optim::camera_by_increment(T_cam_obj, -shape.centre_obj) * depth.pull());
  // The origin of an enlarged shape is farther from its centre.
  const Vec3d origin = T_cam_obj.R * shape.centre_obj;
  shift.head<3>() -= sd * Eigen::Vector3d(origin.x, origin.y, origin.z);
  return shift * shift.transpose();
}

std::string SizeTest::other_size() const {
  if (!depth.known()) return {};
  const double s = depth.log_scale(), sd = depth.sd();
  if (!(std::abs(s) - kBand > kSure_sd * sd)) return {};
  if (outline.known() && !outline_out_of_reach() &&
      std::abs(s - outline.log_scale()) > kBand + kAgree_sd * hypotenuse(sd, outline.sd()))
    return {};
  const auto percent = [](double log_scale) { return 100 * std::abs(std::expm1(log_scale)); };
  const double half = kInterval_sd * sd + kInterval;
  const double a = percent(s - half), b = percent(s + half);
  return shown(
      s > 0 ? "the object appears %.1f %% larger than the model (%.1f to %.1f), or its depths are too "
              "large by as much; check the mesh and its unit"
            : "the object appears %.1f %% smaller than the model (%.1f to %.1f), or its depths are too "
              "small by as much; check the mesh and its unit",
      percent(s), std::min(a, b), std::max(a, b));
}

bool SizeTest::outline_agrees() const {
  if (!outline.known() || !(outline.sd() < kTellingSd)) return false;
  const double bound_sd = outline_has_agreed ? kAgree_sd : kLikely_sd;
  return std::abs(outline.log_scale()) < kBand + bound_sd * outline.sd();
}

Matrix6d SizeTest::covariance(const Rigidd& T_cam_obj, const frame::Shape& shape) const {
  if (!depth.known()) return Matrix6d::Zero();
  const double sure = std::max(0.0, std::abs(depth.log_scale()) - kAgree_sd * depth.sd() - kLeastSize);
  const Vector6d shift = sure * (optim::camera_by_increment(T_cam_obj, -shape.centre_obj) * depth.pull());
  return shift * shift.transpose();
}

}  // namespace sdftrack::tracking

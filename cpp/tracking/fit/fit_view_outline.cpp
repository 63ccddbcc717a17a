// SPDX-License-Identifier: MIT
// The outline in the colour image, used with depth or without it.
#include <algorithm>
#include <cmath>

#include "optim/camera_increment.h"
#include "optim/dense.h"
#include "tracking/fit/fit_view.h"
#include "tracking/options/sensor_noise.h"
#include "tracking/size/outline_size.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kMinViewLines = 20;
constexpr int kOutlineSteps = 4;
constexpr int kOutlineEvery = 4;  // frames in which depth alone holds the pose
constexpr double kUsualShared = 6, kOutlineFollows = 0.2, kExcessFollows = 0.3, kOutlineSees = 6,
                 kMinFactor = 0.25, kMaxFactor = 4;

constexpr double kInFront_m = 0.004, kInFrontPerNoise = 5, kInFrontPerSystematic = 3;

// The margin lets fingers in contact be seen, but errors of the sensor must not be mistaken for them.
double in_front_m(double noise_m, const FitMemory& memory) {
  return std::max({kInFront_m, kInFrontPerNoise * noise_m,
                   kInFrontPerSystematic * std::max(memory.systematic_m, memory.outline.depth_off_m)});
}

}  // namespace

int FitView::read_outline(const Rigidd& T_cam_obj, int reach_px) {
  outline_lines_.lines.clear();
  if (!reads_outline()) return 0;
  return find_outline_lines(
      *frame_, *camera_, target_->shape, target_->outline, T_cam_obj,
      {options_.outline_points, reach_px, in_front_m(stated_noise_m_, target_->memory), neighbors_},
      &contours_, &outline_lines_);
}

void FitView::learn_outline(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                            const appearance::ColorModel& whole, const Rigidd& T_cam_obj,
                            const FitMemory& memory, appearance::LocalColors* colors) {
  learn_outline_colors(frame, camera, shape, whole, T_cam_obj,
                       {options_.outline_points, options_.outline_reach_px,
                        in_front_m(sensor_noise(options_).at(T_cam_obj.t.z), memory), nullptr},
                       &contours_, colors);
}

double FitView::shared_lines(const FitMemory& memory) {
  return memory.outline.shared_lines > 0 ? std::max(1.0, memory.outline.shared_lines) : kUsualShared;
}

energies::OutlineEnergy FitView::outline_energy(const FitMemory& memory, double common_sd_px) {
  return {&outline_lines_, {outline_factor(memory), common_sd_px, shared_lines(memory)}};
}

double FitView::outline_weight(const FitMemory& memory) const {
  if (outline_lines_.lines.size() < kMinViewLines) return 0;
  return options_.outline_weight * memory.outline.depth_excess * std::max(1.0, memory.correlation_area_px) /
         shared_lines(memory);
}

void FitView::measure_outline(const optim::State& x, FitMemory* memory) {
  const OutlineNoise now = outline_noise(&outline_lines_, x.T_obj_cam[0], &outline_residuals_);
  if (!(now.factor > 0)) return;
  OutlineNoise& kept = memory->outline;
  const double rate = kept.factor > 0 ? kOutlineFollows : 1;
  kept.factor += rate * (std::clamp(now.factor, kMinFactor, kMaxFactor) - kept.factor);
  kept.shared_lines += rate * (now.shared_lines - kept.shared_lines);
}

// As one increment over several steps: the lines' weights change on the way, and one step would stop short.
Vector6d FitView::way_to_its_minimum(const optim::State& x, energies::OutlineEnergy* outline) {
  outline_at_ = x;
  Vector6d way = Vector6d::Zero();
  for (int k = 0; k < kOutlineSteps; ++k) {
    outline_there_.reset(6);
    outline->linearize(outline_at_, &outline_there_);
    const Matrix6d H = outline_there_.hessian + weak_knowledge(target_->shape);
    way -= optim::solve_symmetric<6, 1>(H, outline_there_.gradient);
    outline_at_.T_obj_cam[0] =
        increment(Vec3d{way[0], way[1], way[2]}, Vec3d{way[3], way[4], way[5]}) * x.T_obj_cam[0];
  }
  return way;
}

void FitView::compare_with_outline(const optim::State& x, double area_px,
                                   const energies::EnergySummary& depth, double weight, FitMemory* memory) {
  measure_outline(x, memory);
  photometric_.reset(6);
  energies::OutlineEnergy outline = outline_energy(*memory, kCommonBesideDepth_px);
  outline.linearize(x, &photometric_);
  if (!target_->shape.seen.amount) {
    outline.residuals(x.T_obj_cam[0], &outline_residuals_);
    const Vector6d to_depth = weight * optim::solve_symmetric<6, 1>(depth.A + weak_knowledge(target_->shape),
                                                                    photometric_.gradient);
    by_outline_ =
        look_by_outline(outline_lines_, {outline_residuals_, outline_factor(*memory), x.T_obj_cam[0],
                                         to_depth, shared_lines(*memory), target_->shape.moments.mean});
  }
  const Disagreement now = depth_disagreement(
      {depth.A, depth.B, depth.geometry, area_px, photometric_.hessian, photometric_.gradient, weight},
      shared_lines(*memory), weak_knowledge(target_->shape));
  const Matrix6d in_camera = optim::camera_by_increment(inverse(x.T_obj_cam[0]), Vec3d{0, 0, 0});
  const Matrix6d covariance = in_camera * now.covariance * in_camera.transpose();
  if (weight > 0)  // from the depth's pose to the outline's
    apart_ = PosesApart{-in_camera * now.way, covariance};
  else
    apart_ = PosesApart{in_camera * way_to_its_minimum(x, &outline), covariance};
  OutlineNoise& kept = memory->outline;
  kept.depth_excess *= std::pow(now.excess / kept.depth_excess, kExcessFollows);
  kept.depth_off_m += kExcessFollows * (now.off_m - kept.depth_off_m);
  kept.apart_m += kExcessFollows * (now.apart_m - kept.apart_m);
  kept.way = optim::camera_by_increment(inverse(x.T_obj_cam[0]), -target_->shape.centre_obj) *
             now.sure_way(comparable_units(target_->shape));
}

// Depth that bends an object's face into another pose does not show this in its residuals.
void FitView::compare_outline_now_and_then(const optim::State& x, double area_px,
                                           const energies::EnergySummary& depth, FitMemory* memory) {
  if (!reads_outline() || ++memory->outline_age < kOutlineEvery) return;
  memory->outline_age = 0;
  read_outline(inverse(x.T_obj_cam[0]), options_.outline_reach_px);
  if (outline_lines_.lines.size() >= kMinViewLines) compare_with_outline(x, area_px, depth, 0, memory);
  outline_lines_.lines.clear();
}

// As with the brightness, a direction held by the outline is not blind. The lines share errors that are not
// contained in the pixels' correlation area, by which the sum is multiplied later. That area grows by the
// error of the depth beyond its residuals.
void FitView::add_outline(const optim::State& x, double scale_m, double* area_px,
                          energies::EnergySummary* summary, FitMemory* memory) {
  const double weight = outline_helps() ? outline_weight(*memory) : 0;
  if (!(weight > 0)) return compare_outline_now_and_then(x, *area_px, *summary, memory);
  memory->outline_age = 0;
  compare_with_outline(x, *area_px, *summary, weight, memory);
  const double shared = shared_lines(*memory);
  const Matrix6d hessian = without_slips(photometric_.hessian, target_->shape);
  *area_px *= memory->outline.depth_excess;
  summary->A += weight * hessian;
  summary->B += weight * weight * shared / *area_px * hessian;
  summary->geometry += scale_m * scale_m / double(outline_lines_.lines.size()) * hessian;
}

void FitView::measure_outline_pose(const optim::State& x, Fitted* fitted) {
  measure_outline(x, &fitted->memory);
  const auto lines = double(outline_lines_.lines.size());
  const double m_per_px = inverse(x.T_obj_cam[0]).t.z / camera_->K.fx;
  const auto covariance_with = [&](double common_sd_px) {
    photometric_.reset(6);
    outline_energy(fitted->memory, common_sd_px).linearize(x, &photometric_);
    const Matrix6d hessian = without_slips(photometric_.hessian, target_->shape);
    energies::EnergySummary sums;
    sums.A = hessian;
    sums.B = shared_lines(fitted->memory) * hessian;
    // In metres at the object, like a residual of depth; the lines' sd is about a pixel. An outline does not
    // see the grain of the field, so a direction is blind only below a smaller slope.
    sums.geometry = std::pow(kOutlineSees * m_per_px * outline_factor(fitted->memory), 2) / lines * hessian;
    sums.rounding = sums.missed = energies::SmallVector::Zero(6);
    sums.inliers = lines;
    return increment_covariance(sums, target_->shape, 1);
  };
  const Matrix6d increment = covariance_with(kCommonError_px);
  const auto in_camera = [&](const Matrix6d& C) {
    return camera_covariance(C, inverse(x.T_obj_cam[0]), -target_->shape.centre_obj);
  };
  fitted->centre_sd =
      std::sqrt(increment.topLeftCorner<3, 3>().diagonal().maxCoeff()) / (0.5 * target_->shape.diameter_m);
  fitted->covariance = in_camera(increment);
  fitted->systematic_errors = in_camera(increment - covariance_with(0));
}

}  // namespace sdftrack::tracking

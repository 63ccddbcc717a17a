// SPDX-License-Identifier: MIT
#include "tracking/trust/systematic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sdftrack::tracking {

namespace {

constexpr int kBudget = 200;           // pixels
constexpr double kUnitSquare = 1.118;  // 1 / rms of x^2 - 1, x uniform of variance 1

constexpr double kSameShare = 1.25, kSameView = 0.995;  // of information; cosine: 6 degrees
constexpr Vec3d kAhead{0, 0, 1};

constexpr double kBends = 0.4;  // over an object, of an error of the distance

constexpr double kSharedFrom = 1.3, kWholePerSeen = 3;

}  // namespace

ModeExtent::ModeExtent(const std::vector<float>& px, const std::vector<float>& gain, std::size_t stride) {
  double sum = 0, square = 0, count = 0;
  for (std::size_t i = 0; i < px.size(); i += stride)
    if (gain[i] == 0) {
      const auto x = double(px[i]);
      sum += x, square += x * x, count += 1;
    }
  if (!(count > 0)) return;
  mean_px_ = sum / count;
  sd_px_ = std::sqrt(std::max(1.0, square / count - mean_px_ * mean_px_));
}

BiasModes bias_modes_at(double x, double y) {
  BiasModes m;
  m << 1, x, y, kUnitSquare * (x * x - 1), x * y, kUnitSquare * (y * y - 1);
  return m;
}

double systematic_by_residuals(double spread_m, double noise_m) {
  return kWholePerSeen * std::sqrt(std::max(0.0, spread_m * spread_m - std::pow(kSharedFrom * noise_m, 2)));
}

bool BiasSums::hold(double information_now, const Rigidd& T_obj_cam) const {
  return information > 0 && information_now < kSameShare * information &&
         information < kSameShare * information_now && dot(T_obj_cam.R * kAhead, sight_obj) > kSameView;
}

double trace_of(const Matrix6d& information, const frame::Shape& shape) {
  return comparable_units(shape).cwiseAbs2().dot(information.diagonal());
}

BiasSums bias_sums(const frame::Shape& shape, const Camera& camera, const Rigidd& T_obj_cam,
                   const energies::PixelSet& pixels, const energies::DepthLogistic<float>& penalty,
                   float color_prior, double information) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const energies::SingleObject<float> field{shape.sdf, T_obj_cam.cast<float>()};
  const std::size_t n = pixels.gain.size(), stride = std::max<std::size_t>(1, n / kBudget);
  const ModeExtent x(pixels.u_px, pixels.gain, stride), y(pixels.v_px, pixels.gain, stride);
  // One column for each pixel: the effect of an error of its depth on the pose, then the modes there.
  Eigen::Matrix<double, 6 + kBiasModes, Eigen::Dynamic, 0, 6 + kBiasModes, 2 * kBudget> seen(6 + kBiasModes,
                                                                                             2 * kBudget);
  const Vector6d unit = comparable_units(shape);
  double here = 0;  // information of the subset; in units of a diameter, traces may be compared
  int used = 0;
  for (std::size_t i = 0; i < n && used < 2 * kBudget; i += stride) {
    if (pixels.gain[i] != 0) continue;
    const Vec3f direction = ray(K, pixels.u_px[i], pixels.v_px[i]);
    energies::FieldRow<float, 6> row;
    field.row(pixels.hit_m[i] * direction, &row);
    const float slope = dot(row.grad_cam, direction);
    if (!(std::abs(slope) > kGrazing)) continue;
    const float share = color_prior > 0 ? std::min(1.0f, pixels.foreground[i] / color_prior) : 1.0f;
    const auto weight =
        double(share * penalty(pixels.hit_m[i] - pixels.depth_m[i], pixels.per_noise[i]).curvature);
    Vector6d J;
    for (int j = 0; j < 6; ++j) J[j] = double(-row.J[j] / slope);
    here += weight * unit.cwiseProduct(J).squaredNorm();
    seen.col(used).head<6>() = weight * J;
    seen.col(used++).tail<kBiasModes>() = bias_modes_at(x.at(pixels.u_px[i]), y.at(pixels.v_px[i]));
  }
  if (!(here > 0)) return {};
  const auto columns = seen.leftCols(used);
  const Eigen::Matrix<double, 6, 6 + kBiasModes> sums = columns.topRows<6>() * columns.transpose();
  // A patch's pixels pull together.
  return {sums.rightCols<kBiasModes>() / here, used / (kPatches * here * here) * sums.leftCols<6>(),
          information, T_obj_cam.R * kAhead};
}

BiasResponse bias_response(const BiasSums& bias, const energies::EnergySummary& sums, double information,
                           const frame::Shape& shape) {
  return BiasResponse{information * bias.modes, information * information * bias.patches}.moved(
      increment_response(sums, shape));
}

Matrix6d systematic_covariance(const BiasResponse& response, double systematic_m, double lateral_m) {
  BiasModes sd;
  sd << kOffsetShare, kLinearShare, kLinearShare, kQuadraticShare, kQuadraticShare, kQuadraticShare;
  const auto shifts = (systematic_m * (response.modes * sd.asDiagonal())).eval();
  Matrix6d C = shifts * shifts.transpose();
  C += std::pow(kPatchShare * systematic_m, 2) * response.patches;
  C.topLeftCorner<2, 2>().diagonal().array() +=
      lateral_m * lateral_m + std::pow(kLateralShare * systematic_m, 2);
  return C;
}

Matrix6d distance_covariance(const BiasResponse& response, double error_m, const Vec3d& centre_cam) {
  Matrix6d C = systematic_covariance(response, kBends * error_m, 0);
  const double distance_m = norm(centre_cam);
  if (!(distance_m > 0)) return C;
  const Vec3d along = (error_m / distance_m) * centre_cam;
  const Eigen::Vector3d shift(along.x, along.y, along.z);
  C.topLeftCorner<3, 3>() += shift * shift.transpose();
  return C;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// The effect of a sensor error that varies smoothly over the object on its pose.
#pragma once

#include "energies/pixel_set.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

constexpr float kGrazing = 0.17f;  // d phi / d z along the ray below which a hit is unusable

// The error of the measurements as a sum of modes over the part of the image where the object is seen:
// constant, linear in x and y, quadratic. Each has a root mean square of about 1 there. Finer errors are
// counted as patches, kPatches of them side by side, each with an independent error.
constexpr int kBiasModes = 6;
constexpr double kPatches = 16;

// Sd of each mode, and of a patch, over systematic_m; docs/sensors.md explains the choice.
constexpr double kOffsetShare = 1.0, kLinearShare = 0.5, kQuadraticShare = 0.2, kPatchShare = 0.25;
constexpr double kLateralShare = 0.4;  // of the pose's error across the ray, in x and in y

// systematic_m by the residuals. A fit absorbs the offset and most of the linear part, so little of the error
// is left. noise: of a measurement among its neighbours (a sensor's whole noise is at most kSharedFrom times
// as much; renderings with white noise: up to 1.18); spread: of the residuals; in metres.
double systematic_by_residuals(double spread_m, double noise_m);

using BiasModes = Eigen::Matrix<double, kBiasModes, 1>;
// The modes at a pixel, from its coordinates in units of their sd about their mean (ModeExtent).
BiasModes bias_modes_at(double x, double y);

// Mean and sd of a coordinate of the pixels that show the surface; every stride-th pixel is used.
class ModeExtent {
 public:
  ModeExtent(const std::vector<float>& px, const std::vector<float>& gain, std::size_t stride);
  double at(float px) const { return (double(px) - mean_px_) / sd_px_; }

 private:
  double mean_px_ = 0, sd_px_ = 1;
};

// Response of a pose to an error of one metre: a shift per mode, and the covariance by the patches.
struct BiasResponse {
  Eigen::Matrix<double, 6, kBiasModes> modes = Eigen::Matrix<double, 6, kBiasModes>::Zero();
  Matrix6d patches = Matrix6d::Zero();

  BiasResponse moved(const Matrix6d& J) const { return {J * modes, J * patches * J.transpose()}; }
};

// The sums over pixels that give the response, over the information of the same pixels (its trace, of
// translation in diameters). They are valid for a few frames of one view.
struct BiasSums {
  Eigen::Matrix<double, 6, kBiasModes> modes = Eigen::Matrix<double, 6, kBiasModes>::Zero();
  Matrix6d patches = Matrix6d::Zero();
  double information = 0;  // trace of the frame's information; 0: there are no sums
  Vec3d sight_obj{};       // direction of the camera's axis

  // Whether the sums are valid in a frame of this information from this pose.
  bool hold(double information_now, const Rigidd& T_obj_cam) const;

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [by_modes, by_patches, trace, sight] = self;
    archive(by_modes, by_patches, trace, sight);
  }
};

double trace_of(const Matrix6d& information, const frame::Shape& shape);

// sum_i w_i J_i m_k(u_i), J the derivative of the depth where a pixel's ray meets the model, w the weight
// that the penalty gives its residual; over an even subset of the pixels, at the hits found before. With a
// color_prior above 0 their posteriors weight them.
BiasSums bias_sums(const frame::Shape& shape, const Camera& camera, const Rigidd& T_obj_cam,
                   const energies::PixelSet& pixels, const energies::DepthLogistic<float>& penalty,
                   float color_prior, double information);

// The response of the increment: A^-1 times the sums, where A is that of `sums`, so that other terms that
// hold the pose (the outline) resist. information: the trace of the part of A from the pixels.
BiasResponse bias_response(const BiasSums& bias, const energies::EnergySummary& sums, double information,
                           const frame::Shape& shape);

// The pose covariance due to an error of sd systematic_m by this response (of the pose in camera axes), and
// to an error of lateral_m across the ray, which moves the pose unchanged.
Matrix6d systematic_covariance(const BiasResponse& response, double systematic_m, double lateral_m);

// The same for a distance error of sd error_m of an object at centre_cam; it varies less over the object.
Matrix6d distance_covariance(const BiasResponse& response, double error_m, const Vec3d& centre_cam);

}  // namespace sdftrack::tracking

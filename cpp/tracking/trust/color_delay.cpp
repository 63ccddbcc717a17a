// SPDX-License-Identifier: MIT
#include "tracking/trust/color_delay.h"

#include <algorithm>
#include <cmath>

#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr double kBias_m = 0.02, kBias_rad = 0.2, kDelay_s = 0.1;  // prior sds
constexpr double kDelayUnknowns = 6, kShared = 4;                  // neighbouring frames share their errors
constexpr int kEnoughFrames = 8;

}  // namespace

void ColorDelay::observe(const std::optional<PosesApart>& apart, const Vector6d& velocity) {
  if (waiting_) add(*waiting_, 0.5 * (before_ + velocity));
  waiting_ = apart, before_ = velocity;
}

void ColorDelay::add(const PosesApart& apart, const Vector6d& velocity) {
  if (!apart.way.allFinite() || !velocity.allFinite() || !apart.covariance.allFinite()) return;
  Eigen::Matrix<double, 6, 7> J;
  J << Matrix6d::Identity(), velocity;
  const Vector6d left = apart.way - J * solution();
  const double distance2 = left.dot(optim::solve_symmetric<6, 1>(apart.covariance, left));
  if (!(distance2 >= 0)) return;
  const double weight = 1 / (1 + distance2 / kDelayUnknowns);
  A_ += weight * J.transpose() * optim::solve_symmetric<6, 7>(apart.covariance, J);
  b_ += weight * J.transpose() * optim::solve_symmetric<6, 1>(apart.covariance, apart.way);
  excess_ += weight * distance2;
  ++frames_;
}

ColorDelay::Matrix7d ColorDelay::information() const {
  Vector7d expected;
  expected << Eigen::Vector3d::Constant(kBias_m), Eigen::Vector3d::Constant(kBias_rad), kDelay_s;
  Matrix7d A = A_;
  A.diagonal() += expected.cwiseAbs2().cwiseInverse();
  return A;
}

ColorDelay::Vector7d ColorDelay::solution() const { return optim::solve_symmetric<7, 1>(information(), b_); }

ColorDelay::Estimate ColorDelay::estimate() const {
  if (frames_ < kEnoughFrames) return {};
  const Matrix7d covariance = optim::inverse_symmetric<7>(information());
  const double excess = std::max(1.0, excess_ / (kDelayUnknowns * frames_));
  return {solution()[6], std::sqrt(kShared * excess * covariance(6, 6)), frames_};
}

double ColorDelay::lag2_frames(double frame_s) const {
  const Estimate found = estimate();
  const double expected = 1 / (kLag_frames * kLag_frames);
  if (found.frames == 0 || !(frame_s > 0)) return 1 / expected;
  const double measured = std::pow(frame_s / found.sd_s, 2);
  const double mean = measured / (expected + measured) * found.delay_s / frame_s;
  return mean * mean + 1 / (expected + measured);
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/fit/outline_noise.h"

#include <algorithm>
#include <cmath>

#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kEnoughLines = 20, kWindow = 12;
constexpr double kPieces = 12;  // of an outline, with at best independent errors
constexpr double kMedianOfNormal = 0.6745;
constexpr double kFarOff = 3;  // sd; beyond this, a residual is cut
constexpr int kRounds = 3;
constexpr double kUnknowns = 6;
constexpr double kSurelyApart = 16.8;  // 99 % of squared distances of six unknowns are smaller
constexpr int kBisections = 10;

void take_out_pose(std::vector<energies::OutlineResidual>* lines) {
  for (int round = 0; round < kRounds; ++round) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (const energies::OutlineResidual& line : *lines) {
      const double weight = 1 / (1 + 0.5 * line.off * line.off);
      H.noalias() += (weight * line.J) * line.J.transpose();
      g += weight * line.off * line.J;
    }
    H.diagonal() *= 1 + 1e-6;
    H.diagonal().array() += 1e-9;
    const Vector6d d = optim::solve_symmetric<6, 1>(H, -g);
    for (energies::OutlineResidual& line : *lines) line.off += line.J.dot(d);
  }
}

double median_size(std::vector<energies::OutlineResidual>* lines) {
  const std::size_t n = lines->size();
  double sizes[2048];
  const std::size_t m = std::min<std::size_t>(n, 2048);
  for (std::size_t i = 0; i < m; ++i) sizes[i] = std::abs((*lines)[i].off);
  std::nth_element(sizes, sizes + m / 2, sizes + m);
  return sizes[m / 2];
}

}  // namespace

OutlineNoise outline_noise(energies::OutlineLines* lines, const Rigidd& T_obj_cam,
                           std::vector<energies::OutlineResidual>* scratch) {
  energies::OutlineEnergy(lines, {}).residuals(T_obj_cam, scratch);
  std::vector<energies::OutlineResidual>& r = *scratch;
  const std::size_t n = r.size();
  if (n < kEnoughLines) return {};
  take_out_pose(&r);
  const double sd = std::max(1e-6, median_size(&r) / kMedianOfNormal);
  double squares = 0, sums = 0, window = 0;
  for (energies::OutlineResidual& line : r) {
    line.off = std::clamp(line.off / sd, -kFarOff, kFarOff);
    squares += line.off * line.off;
  }
  for (std::size_t i = 0; i < kWindow; ++i) window += r[i].off;
  for (std::size_t i = 0; i < n; ++i) {  // round the outline
    sums += window * window;
    window += r[(i + kWindow) % n].off - r[i].off;
  }
  return {sd, std::max(sums / (kWindow * squares), double(n) / kPieces), 1};
}

Disagreement depth_disagreement(const Voices& v, double shared_lines, const Matrix6d& prior) {
  const Matrix6d A_inverse = optim::inverse_symmetric<6>(v.depth_A + prior);
  const Matrix6d H_inverse = optim::inverse_symmetric<6>(v.outline_H + prior);
  // At the common pose the gradients cancel: each one's own pose is at minus its gradient over its Hessian.
  const Vector6d apart = (v.outline_weight * A_inverse + H_inverse) * v.outline_g;
  const Matrix6d depth = v.area_px * A_inverse * v.depth_B * A_inverse.transpose();
  const Matrix6d outline = shared_lines * H_inverse;
  const auto distance2 = [&](double factor) {
    const Matrix6d C = factor * depth + outline;
    return apart.dot(optim::solve_symmetric<6, 1>(C, apart));
  };
  Disagreement found;
  found.way = apart, found.covariance = depth + outline;
  if (!(distance2(1) > kSurelyApart)) return found;
  double low = 0, high = std::log(kMaxExcess);
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (distance2(std::exp(middle)) > kUnknowns ? low : high) = middle;
  }
  const Vector6d left = v.outline_weight * A_inverse * v.outline_g;  // displacement to the depth's pose
  const auto moves_m = [&](const Vector6d& d) { return std::sqrt(std::max(0.0, d.dot(v.depth_slopes * d))); };
  found.excess = std::exp(0.5 * (low + high)), found.off_m = moves_m(left), found.apart_m = moves_m(apart);
  return found;
}

// With a prior as large in every direction as the whole displacement.
Vector6d Disagreement::sure_way(const Vector6d& unit) const {
  if (!(excess > 1)) return Vector6d::Zero();
  const Matrix6d spread = (apart_m * apart_m * unit.cwiseAbs2()).asDiagonal();
  return spread * optim::solve_symmetric<6, 1>(spread + covariance, way);
}

}  // namespace sdftrack::tracking

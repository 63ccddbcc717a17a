// SPDX-License-Identifier: MIT
#include "energies/outline_energy.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::energies {

namespace {

constexpr int kMaxSteps = 20;
constexpr double kSettled_px = 1e-9;

}  // namespace

using Row = Eigen::Matrix<double, 6, 1>;

// visit(line, residual_px, J): J the derivative of the pixel by p_cam. A point behind the camera is left out.
template <class Visit>
void OutlineEnergy::each(const Rigidd& T_obj_cam, const Visit& visit) const {
  const Rigidd T_cam_obj = inverse(T_obj_cam);
  for (const OutlineLine& line : lines_->lines) {
    Vec2d u;
    PixelJacobian J;
    if (!lines_->view.place(T_cam_obj * line.p_obj, &u, &J)) continue;
    const double off = line.normal.x * (u.x - line.centre_px.x) + line.normal.y * (u.y - line.centre_px.y);
    visit(line, off - line.offset_px, J);
  }
}

// The best b by Newton's steps, in which the curvature is bounded by that of the reweighted squares.
double OutlineEnergy::common_offset(const Rigidd& T_obj_cam) const {
  if (!(hold_ > 0)) return 0;
  std::vector<Vec2d>& seen = lines_->scratch;
  seen.clear();
  each(T_obj_cam, [&](const OutlineLine& line, double off_px, const PixelJacobian&) {
    const double per_sd = inv_noise_ / line.sd_px;
    seen.push_back({off_px, per_sd * per_sd});
  });
  double b = 0;
  for (int k = 0; k < kMaxSteps; ++k) {
    double slope = hold_ * b, steep = hold_, curved = hold_;
    for (const Vec2d& line : seen) {
      const double d = line.x - b, half = 0.5 * line.y * d * d, weight = line.y / (1 + half);
      slope -= weight * d;
      steep += weight;
      curved += weight * (1 - half) / (1 + half);
    }
    const double step = slope / std::max(curved, 0.5 * steep);
    b -= step;
    if (std::abs(step) < kSettled_px) break;
  }
  return b;
}

double OutlineEnergy::cost(const optim::State& x) {
  const double b = common_offset(x.T_obj_cam[0]);
  double sum = 0.5 * hold_ * b * b;
  each(x.T_obj_cam[0], [&](const OutlineLine& line, double off_px, const PixelJacobian&) {
    const double r = (off_px - b) * inv_noise_ / line.sd_px;
    sum += std::log1p(0.5 * r * r);
  });
  return sum;
}

// visit(line, residual over its sd, row). p_cam = T^-1 X, and T <- increment(v, w) T moves it by
// -R^T (v + w x X): the derivative is (-a, a x X) with a = R J^T n.
template <class Visit>
void OutlineEnergy::each_row(const Rigidd& T, double common_px, const Visit& visit) const {
  each(T, [&](const OutlineLine& line, double off_px, const PixelJacobian& J) {
    const double per_sd = inv_noise_ / line.sd_px;
    const Vec3d a = per_sd * (T.R * (line.normal.x * J.u + line.normal.y * J.v));
    const Vec3d turn = cross(a, line.p_obj);
    visit(per_sd, (off_px - common_px) * per_sd,
          (Row() << -a.x, -a.y, -a.z, turn.x, turn.y, turn.z).finished());
  });
}

void OutlineEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  const double b = common_offset(x.T_obj_cam[0]);
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Row g = Row::Zero(), beside = Row::Zero();  // the pose's row of the Hessian with b
  double own = hold_;
  each_row(x.T_obj_cam[0], b, [&](double per_sd, double r, const Row& row) {
    const double weight = 1 / (1 + 0.5 * r * r);
    H.noalias() += (weight * row) * row.transpose();
    g += weight * r * row;
    beside += weight * per_sd * row;
    own += weight * per_sd * per_sd;
    out->cost += std::log1p(0.5 * r * r);
    out->count += 1;
  });
  if (hold_ > 0) {
    H.noalias() -= (1 / own) * beside * beside.transpose();
    out->cost += 0.5 * hold_ * b * b;
  }
  out->hessian += H;
  out->gradient += g;
}

void OutlineEnergy::residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const {
  out->clear();
  each_row(T_obj_cam, 0, [&](double, double r, const Row& row) { out->push_back({r, row}); });
}

}  // namespace sdftrack::energies

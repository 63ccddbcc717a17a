// SPDX-License-Identifier: MIT
#include "energies/outline_energy.h"

#include <cmath>

namespace sdftrack::energies {

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

double OutlineEnergy::cost(const optim::State& x) {
  double sum = 0;
  each(x.T_obj_cam[0], [&](const OutlineLine& line, double off_px, const PixelJacobian&) {
    const double r = off_px * inv_noise_ / line.sd_px;
    sum += std::log1p(0.5 * r * r);
  });
  return sum;
}

// visit(residual over its sd, row). p_cam = T^-1 X, and T <- increment(v, w) T moves it by -R^T (v + w x X):
// the derivative is (-a, a x X) with a = R J^T n.
template <class Visit>
void OutlineEnergy::each_row(const Rigidd& T, const Visit& visit) const {
  each(T, [&](const OutlineLine& line, double off_px, const PixelJacobian& J) {
    const double per_sd = inv_noise_ / line.sd_px;
    const Vec3d a = per_sd * (T.R * (line.normal.x * J.u + line.normal.y * J.v));
    const Vec3d turn = cross(a, line.p_obj);
    visit(off_px * per_sd, (Row() << -a.x, -a.y, -a.z, turn.x, turn.y, turn.z).finished());
  });
}

void OutlineEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Row g = Row::Zero();
  each_row(x.T_obj_cam[0], [&](double r, const Row& row) {
    const double weight = 1 / (1 + 0.5 * r * r);
    H.noalias() += (weight * row) * row.transpose();
    g += weight * r * row;
    out->cost += std::log1p(0.5 * r * r);
    out->count += 1;
  });
  out->hessian += H;
  out->gradient += g;
}

void OutlineEnergy::residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const {
  out->clear();
  each_row(T_obj_cam, [&](double r, const Row& row) { out->push_back({r, row}); });
}

}  // namespace sdftrack::energies

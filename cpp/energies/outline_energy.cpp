// SPDX-License-Identifier: MIT
#include "energies/outline_energy.h"

#include <cmath>

namespace sdftrack::energies {

namespace {

using Row = Eigen::Matrix<double, 6, 1>;

}  // namespace

OutlineLinesTerm OutlineEnergy::on_device() const {
  OutlineLinesTerm term = term_;
  term.lines = lines_->lines.data(), term.count = int(lines_->lines.size());
  return term;
}

// Calls visit(line, residual_px, J), J: derivative of the pixel by p_cam. Omits points behind the camera.
template <class Visit>
void OutlineEnergy::each(const Rigidd& T_obj_cam, const Visit& visit) const {
  const Rigidd T_cam_obj = inverse(T_obj_cam);
  for (const OutlineLine& line : lines_->lines) {
    double off_px;
    PixelJacobian J;
    if (term_.find(line, T_cam_obj, &off_px, &J)) visit(line, off_px, J);
  }
}

double OutlineEnergy::common_offset(const Rigidd& T_obj_cam) const {
  if (!(term_.hold > 0)) return 0;
  std::vector<Vec2d>& seen = lines_->scratch;
  seen.clear();
  each(T_obj_cam, [&](const OutlineLine& line, double off_px, const PixelJacobian&) {
    const double per_sd = term_.per_sd(line);
    seen.push_back({off_px, per_sd * per_sd});
  });
  double b = 0;
  for (int k = 0; k < kOffsetSteps; ++k) {
    CommonOffset sums = term_.begin_offset(b);
    for (const Vec2d& line : seen) sums.add(line.x - b, line.y);
    b -= sums.step();
    if (sums.settled()) break;
  }
  return b;
}

double OutlineEnergy::cost(const optim::State& x) {
  const double b = common_offset(x.T_obj_cam[0]);
  double sum = 0.5 * term_.hold * b * b;
  each(x.T_obj_cam[0], [&](const OutlineLine& line, double off_px, const PixelJacobian&) {
    const double r = (off_px - b) * term_.per_sd(line);
    sum += std::log1p(0.5 * r * r);
  });
  return sum;
}

// Calls visit(1 / sd, residual over sd, row).
template <class Visit>
void OutlineEnergy::each_row(const Rigidd& T, double common_px, const Visit& visit) const {
  each(T, [&](const OutlineLine& line, double off_px, const PixelJacobian& J) {
    const double per_sd = term_.per_sd(line);
    Row row;
    OutlineLinesTerm::row(line, T, J, per_sd, row.data());
    visit(per_sd, (off_px - common_px) * per_sd, row);
  });
}

void OutlineEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  const double b = common_offset(x.T_obj_cam[0]);
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Row g = Row::Zero(), beside = Row::Zero();  // beside: Hessian block of pose and b
  double own = term_.hold;
  each_row(x.T_obj_cam[0], b, [&](double per_sd, double r, const Row& row) {
    const double weight = 1 / (1 + 0.5 * r * r);
    H.noalias() += (weight * row) * row.transpose();
    g += weight * r * row;
    beside += weight * per_sd * row;
    own += weight * per_sd * per_sd;
    out->cost += std::log1p(0.5 * r * r);
    out->count += 1;
  });
  if (term_.hold > 0) {
    H.noalias() -= (1 / own) * beside * beside.transpose();
    out->cost += 0.5 * term_.hold * b * b;
  }
  out->hessian += H;
  out->gradient += g;
}

void OutlineEnergy::residuals(const Rigidd& T_obj_cam, std::vector<OutlineResidual>* out) const {
  out->clear();
  each_row(T_obj_cam, 0, [&](double, double r, const Row& row) { out->push_back({r, row}); });
}

}  // namespace sdftrack::energies

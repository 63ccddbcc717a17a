// SPDX-License-Identifier: MIT
#include "energies/free_space.h"

namespace sdftrack {

namespace {

DepthLogistic<double> penalty_of(const FreeSpaceOptions& options) { return {options.scale_m, 0.0}; }

}  // namespace

double FreeSpaceEnergy::cost(const State& x) {
  const Rigidd T_cam_obj = inverse(x.T_obj_cam[0]);
  const DepthLogistic<double> penalty = penalty_of(options_);
  double sum = 0, r;
  Vec3d dr_cam;
  for (const Vec3f& p : *points_obj_)
    if (residual(x, T_cam_obj, p.cast<double>(), &r, &dr_cam)) sum += penalty(r, 1.0).cost;
  return sum;
}

void FreeSpaceEnergy::linearize(const State& x, NormalEquations* out) {
  const Rigidd T_cam_obj = inverse(x.T_obj_cam[0]);
  const DepthLogistic<double> penalty = penalty_of(options_);
  double r;
  Vec3d dr_cam;
  for (const Vec3f& point : *points_obj_) {
    const Vec3d p_obj = point.cast<double>();
    if (!residual(x, T_cam_obj, p_obj, &r, &dr_cam)) continue;
    // T_obj_cam <- increment(v, w) T_obj_cam moves the camera point by -R_cam_obj (v + w x p_obj).
    const Vec3d g = x.T_obj_cam[0].R * dr_cam, m = cross(p_obj, g);
    const Eigen::Matrix<double, 6, 1> J{-g.x, -g.y, -g.z, -m.x, -m.y, -m.z};
    const Curve<double> curve = penalty(r, 1.0);
    out->cost += curve.cost;
    out->gradient.head<6>() += curve.slope * J;
    out->hessian.topLeftCorner<6, 6>() += curve.curvature * J * J.transpose();
  }
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "optim/parameters.h"

namespace sdftrack::optim {

Unit unit_of(const Unknowns& unknowns, int i) {
  if (i >= unknowns.intrinsics_offset()) return Unit::kPixel;
  if (i >= unknowns.size_offset()) return Unit::kLogScale;
  const int j = i % unknowns.per_object();
  return j < 3 ? Unit::kMetre : (j < 6 ? Unit::kRadian : Unit::kLogScale);
}

void retract(const Unknowns& unknowns, const State& x, const Eigen::VectorXd& delta, State* moved) {
  *moved = x;
  for (int k = 0; k < unknowns.objects; ++k) {
    const double* d = delta.data() + unknowns.object_offset(k);
    const auto i = std::size_t(k);
    moved->T_obj_cam[i] = increment(Vec3d{d[0], d[1], d[2]}, Vec3d{d[3], d[4], d[5]}) * x.T_obj_cam[i];
    if (unknowns.scale) moved->log_scale[i] += d[6];
  }
  for (int i = 0; i < unknowns.sizes; ++i) moved->log_size[i] += delta[unknowns.size_offset() + i];
  if (unknowns.intrinsics) {
    const double* d = delta.data() + unknowns.intrinsics_offset();
    moved->K = {x.K.fx + d[0], x.K.fy + d[1], x.K.cx + d[2], x.K.cy + d[3]};
  }
}

State retract(const Unknowns& unknowns, const State& x, const Eigen::VectorXd& delta) {
  State moved;
  retract(unknowns, x, delta, &moved);
  return moved;
}

}  // namespace sdftrack::optim

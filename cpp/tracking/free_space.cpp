// SPDX-License-Identifier: MIT
#include "tracking/free_space.h"

#include "energies/add_sums.h"

namespace sdftrack {

QuickTerms FreeSpaceEnergy::terms(const State& x) const {
  QuickTerms terms{};
  const Rigidd& T_obj_cam = x.T_obj_cam[0];
  terms.outline = {inverse(T_obj_cam).cast<float>(),
                   T_obj_cam.cast<float>(),
                   x.K.cast<float>(),
                   {options_.scale_m, 0.0f},
                   grid_->view(),
                   {points_obj_->data(), static_cast<int>(points_obj_->size()), 1},
                   1.0f,
                   options_.dead_px};
  return terms;
}

double FreeSpaceEnergy::cost(const State& x) { return point_ops_for(used_isa()).cost(terms(x)).outline; }

void FreeSpaceEnergy::linearize(const State& x, NormalEquations* out) {
  const QuickTerms at = terms(x);
  const PointOps& ops = point_ops_for(used_isa());
  add_to(ops.linearize(at), out);
  out->cost += ops.cost(at).outline;
}

}  // namespace sdftrack

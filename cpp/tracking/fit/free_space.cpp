// SPDX-License-Identifier: MIT
#include "tracking/fit/free_space.h"

#include "energies/add_sums.h"

namespace sdftrack::tracking {

energies::OutlineTerm<float> FreeSpaceEnergy::term(const optim::State& x) const {
  const Rigidd& T_obj_cam = x.T_obj_cam[0];
  return {inverse(T_obj_cam).cast<float>(),
          T_obj_cam.cast<float>(),
          x.K.cast<float>(),
          {options_.scale_m, 0.0f},
          grid_->view(),
          {points_obj_->data(), int(points_obj_->size()), 1},
          1.0f,
          options_.dead_px};
}

frame::QuickTerms FreeSpaceEnergy::terms(const optim::State& x) const {
  frame::QuickTerms terms{};
  terms.outline = term(x);
  return terms;
}

double FreeSpaceEnergy::cost(const optim::State& x) {
  return frame::point_ops_for(used_isa()).cost(terms(x)).outline;
}

void FreeSpaceEnergy::linearize(const optim::State& x, optim::NormalEquations* out) {
  const frame::QuickTerms at = terms(x);
  const frame::PointOps& ops = frame::point_ops_for(used_isa());
  energies::add_to(ops.linearize(at), out);
  out->cost += ops.cost(at).outline;
}

}  // namespace sdftrack::tracking

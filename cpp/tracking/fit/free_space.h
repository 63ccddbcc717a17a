// SPDX-License-Identifier: MIT
// Observed free space: a model point may not be where the sensor sees past it.
#pragma once

#include <algorithm>
#include <vector>

#include "energies/distance_transform.h"
#include "frame/point_ops.h"
#include "optim/energy.h"
#include "tracking/options/options.h"

namespace sdftrack::tracking {

// Number of surface points in the term, some for each side: more weigh the same and take longer.
constexpr int kFreeSpacePoints = 120;

struct FreeSpaceOptions {
  float scale_m = 0.003f;  // s of the logistic cost of the sideways distance
  float dead_px = 1.0f;    // distances up to this many pixels cost nothing
};

// A surface point at the silhouette lies up to half a node outside its node, where the interpolant has begun
// to rise. That much is no evidence, and would push the pose depending on where the points happen to lie.
inline FreeSpaceOptions free_space_options(const TrackerOptions& options,
                                           const energies::DistanceGrid& grid) {
  return {float(options.free_space_scale_m), std::max(1.0f, 0.5f * float(grid.step))};
}

// Back-projected pixels pull data to the model, but do not see a model that sticks out into free space. Here
// each surface point X is projected. Where the depth there lies behind the object, the point costs the
// sideways distance
//   r = Z / f max(0, DT(u(X)) - dead)
// to the nearest pixel that might show the object. docs/math/depth_tracker.md, section 5.
class FreeSpaceEnergy final : public optim::Energy {
 public:
  FreeSpaceEnergy(const std::vector<Vec3f>* points_obj, const energies::DistanceGrid* grid,
                  const FreeSpaceOptions& options)
      : points_obj_(points_obj), grid_(grid), options_(options) {}

  optim::Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const optim::State& x, optim::NormalEquations* out) override;
  double cost(const optim::State& x) override;
  energies::OutlineTerm<float> term(const optim::State& x) const;

 private:
  frame::QuickTerms terms(const optim::State& x) const;

  const std::vector<Vec3f>* points_obj_;
  const energies::DistanceGrid* grid_;
  FreeSpaceOptions options_;
};

}  // namespace sdftrack::tracking

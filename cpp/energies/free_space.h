// SPDX-License-Identifier: MIT
// Observed free space: a model point may not stand where the sensor sees past it.
#pragma once

#include <vector>

#include "base/camera.h"
#include "energies/distance_transform.h"
#include "energies/penalty.h"
#include "optim/energy.h"

namespace sdftrack {

struct FreeSpaceOptions {
  float scale_m = 0.003f;  // s of the logistic cost of the sideways distance
  float dead_px = 1.0f;    // distances up to this many pixels cost nothing
};

// r(X) of a surface point at p_cam and its derivative by p_cam (docs/math/depth_tracker.md, eqs. 10 and 11);
// false where the point costs nothing.
template <class T>
inline bool free_space_residual(const DistanceGrid& grid, const Intrinsics<T>& K, T dead_px, Vec3<T> p_cam,
                                T* r_m, Vec3<T>* dr_cam) {
  if (!(p_cam.z > T(1e-3))) return false;
  const T a = K.fx * p_cam.x / p_cam.z, b = K.fy * p_cam.y / p_cam.z;  // pixel from the principal point
  T distance;
  Vec2<T> slope;
  sample(grid, Vec2<T>{a + K.cx, b + K.cy}, &distance, &slope);
  const T beyond = distance - dead_px;
  if (!(beyond > T(0))) return false;
  const T f = T(0.5) * (K.fx + K.fy);
  *r_m = p_cam.z / f * beyond;
  *dr_cam = {slope.x * K.fx / f, slope.y * K.fy / f, (beyond - slope.x * a - slope.y * b) / f};
  return true;
}

// Back-projected pixels pull data to the model; nothing there sees a model that sticks out into free space.
// Here each surface point X is projected, and where the reading lies behind the object it costs the sideways
// distance
//   r = Z / f max(0, DT(u(X)) - dead)
// to the nearest pixel that might show the object. docs/math/depth_tracker.md, section 5.
class FreeSpaceEnergy final : public Energy {
 public:
  FreeSpaceEnergy(const std::vector<Vec3f>* points_obj, const DistanceGrid* grid,
                  const FreeSpaceOptions& options)
      : points_obj_(points_obj), grid_(grid), options_(options) {}

  Unknowns unknowns() const override { return {1, false, false}; }
  void linearize(const State& x, NormalEquations* out) override;
  double cost(const State& x) override;

 private:
  bool residual(const State& x, const Rigidd& T_cam_obj, Vec3d p_obj, double* r, Vec3d* dr_cam) const {
    const auto dead_px = static_cast<double>(options_.dead_px);
    return free_space_residual(*grid_, x.K, dead_px, T_cam_obj * p_obj, r, dr_cam);
  }

  const std::vector<Vec3f>* points_obj_;
  const DistanceGrid* grid_;
  FreeSpaceOptions options_;
};

}  // namespace sdftrack

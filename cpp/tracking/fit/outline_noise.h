// SPDX-License-Identifier: MIT
// How far the outline's lines may be believed beside the readings of depth (docs/math/outline.md, section 4).
#pragma once

#include <vector>

#include "energies/outline_energy.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

constexpr double kMaxExcess = 10;  // of depth_excess

struct OutlineNoise {
  double factor = 0;        // size of the lines' residuals over their stated sd; 0: not measured
  double shared_lines = 0;  // how many neighbouring lines share one error
  // By how much the depth's covariance is too small, by the distance of the pose that depth asks for from the
  // one that the outline asks for.
  double depth_excess = 1;
  // By how much readings of depth are off, as one sd, if the outline is right: 0 while the two agree.
  double depth_off_m = 0;
  double apart_m = 0;  // of the poses that either would have alone, rms over the surface; likewise
  // What of that way is no chance, in camera axes about the caller's origin (m, rad): either may be wrong by
  // it.
  Vector6d way = Vector6d::Zero();

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [f, shared, excess, off_m, apart, open] = self;
    archive(f, shared, excess, off_m, apart, open);
  }
};

// What two modalities say near one pose: Hessian, the sum of squared gradients, gradient.
struct Voices {
  Matrix6d depth_A, depth_B;  // of one reading each, independent
  Matrix6d depth_slopes;      // mean of J J^T, m^2 per squared increment
  double area_px;             // readings that share one error
  Matrix6d outline_H;
  Vector6d outline_g;
  double outline_weight;  // with which the pose was found
};

// Of the residuals that are left at the outline's own best pose: what depth asks for is no noise of the
// outline. `factor` 0 where there are too few lines.
OutlineNoise outline_noise(energies::OutlineLines* lines, const Rigidd& T_obj_cam,
                           std::vector<energies::OutlineResidual>* scratch);

// Blur, exposure and a rounded edge move all of an outline outwards or inwards together: so much is not told
// by the scatter of its lines. It is mostly the distance that this leaves open. Beside depth it is taken as
// larger: depth_excess has one factor for all directions, but depth that is bent by millimetres still has the
// distance better than an outline.
constexpr double kCommonError_px = 0.3, kCommonBesideDepth_px = 1;

struct Disagreement {
  // On the depth's covariance, with which the two agree as well as chance has it (as DerSimonian and Laird
  // estimate what varies between studies): 1 unless they are surely apart.
  double excess = 1;
  // Rms over the visible surface of what depth alone would still move it by: its error, if the pose is right.
  double off_m = 0;
  double apart_m = 0;               // rms over it of the whole way from the outline's pose to that of depth
  Vector6d way = Vector6d::Zero();  // that way, an increment of T_obj_cam; surely apart or not
  Matrix6d covariance = Matrix6d::Zero();  // of it

  // The part of the way that chance does not explain, where the two are surely apart. unit: of the directions
  // (comparable_units).
  Vector6d sure_way(const Vector6d& unit) const;
};
Disagreement depth_disagreement(const Voices& voices, double shared_lines, const Matrix6d& prior);

}  // namespace sdftrack::tracking

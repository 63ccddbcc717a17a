// SPDX-License-Identifier: MIT
// How much the outline's lines are trusted relative to depth (docs/math/outline.md, section 4).
#pragma once

#include <vector>

#include "energies/outline_energy.h"
#include "tracking/trust/covariance.h"

namespace sdftrack::tracking {

constexpr double kMaxExcess = 10;  // of depth_excess

struct OutlineNoise {
  double factor = 0;        // size of the lines' residuals over their stated sd; 0: not measured
  double shared_lines = 0;  // number of neighbouring lines that share one error
  // The factor by which the depth's covariance is too small, from the distance between the best pose by depth
  // and the best pose by the outline.
  double depth_excess = 1;
  // The error of depth, as one sd, if the outline is right: 0 while the two agree.
  double depth_off_m = 0;
  double apart_m = 0;  // rms surface distance between the depth's and the outline's pose; 0 while they agree
  // The part of that displacement that chance does not explain, in camera axes about the caller's origin (m,
  // rad): either pose may be wrong by it.
  Vector6d way = Vector6d::Zero();

  template <class Archive, class Self>
  static void visit(Archive& archive, Self& self) {
    auto& [f, shared, excess, off_m, apart, open] = self;
    archive(f, shared, excess, off_m, apart, open);
  }
};

// Depth and outline near one pose: Hessian, the sum of squared gradients, gradient.
struct Voices {
  Matrix6d depth_A, depth_B;  // as if each measurement were independent
  Matrix6d depth_slopes;      // mean of J J^T, m^2 per squared increment
  double area_px;             // number of measurements that share one error
  Matrix6d outline_H;
  Vector6d outline_g;
  double outline_weight;  // weight with which the pose was found
};

// From the residuals left at the outline's own best pose, so that disagreement with depth does not count as
// noise of the outline. `factor` is 0 where there are too few lines.
OutlineNoise outline_noise(energies::OutlineLines* lines, const Rigidd& T_obj_cam,
                           std::vector<energies::OutlineResidual>* scratch);

// Blur, exposure and a rounded edge move the whole outline outwards or inwards together. The scatter of its
// lines does not show this error, which mostly affects the distance. In addition to depth it is set larger:
// depth_excess has one factor for all directions, but depth that is bent by millimetres still determines the
// distance better than an outline.
constexpr double kCommonError_px = 0.3, kCommonBesideDepth_px = 1;

struct Disagreement {
  // The factor on the depth's covariance with which the two agree as well as chance predicts (as DerSimonian
  // and Laird estimate the variance between studies): 1 unless they surely disagree.
  double excess = 1;
  // Rms motion of the visible surface by which depth alone would move the pose: its error, if that is right.
  double off_m = 0;
  double apart_m = 0;               // rms over it of the displacement from the outline's to the depth's pose
  Vector6d way = Vector6d::Zero();  // that displacement, an increment of T_obj_cam, significant or not
  Matrix6d covariance = Matrix6d::Zero();  // of `way`

  // The part of `way` that chance does not explain, where the two surely disagree (comparable_units).
  Vector6d sure_way(const Vector6d& unit) const;
};
Disagreement depth_disagreement(const Voices& voices, double shared_lines, const Matrix6d& prior);

}  // namespace sdftrack::tracking

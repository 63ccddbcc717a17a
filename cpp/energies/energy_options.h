// SPDX-License-Identifier: MIT
// Options of a data energy as plain numbers, for the CPU and for the host code of kernels.
#pragma once

#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kMaxJoined = 4;  // objects in a union; of more near one point, only the nearest count

struct SdfEnergyOptions {
  Residual residual = Residual::kRayHit;
  Curvature curvature = Curvature::kIrls;
  float scale_m = 0.002f;      // s of the logistic density
  float outlier_floor = 0.1f;  // e; 0: the printed likelihood
  float floor_behind = -1;     // e of measurements behind the surface; negative: outlier_floor
  bool warm_hits = true;       // continue from the last hits; false: cost is a function of the state alone
  bool scale = false;          // unknown size
  bool intrinsics = false;     // unknown fx, fy, cx, cy
  float sharpness = 40;  // per smallest voxel; a union lies at most log(4) / 40 voxels below its objects
  bool color = false;    // weigh the pixels by the posteriors of their colours
  ColorLikelihood color_likelihood = ColorLikelihood::kOdds;
  float color_prior = 0.7f;  // the posterior of an uninformative colour
  int threads = 1;
};

// Sharpness of the union of the objects `of` (indices into sdfs), from their smallest voxel.
inline float sharpness_per_m(const SdfEnergyOptions& o, const SdfView* sdfs, const int* of, int objects) {
  float voxel_m = sdfs[of[0]].voxel_m;
  for (int k = 1; k < objects; ++k) voxel_m = sdfs[of[k]].voxel_m < voxel_m ? sdfs[of[k]].voxel_m : voxel_m;
  return o.sharpness / voxel_m;
}

inline void make(const SdfEnergyOptions& o, DepthLogistic<float>* penalty) {
  *penalty = {o.scale_m, o.outlier_floor, o.curvature, o.floor_behind};
}
inline void make(const SdfEnergyOptions& o, ColorOdds<float>* penalty) {
  *penalty = {o.scale_m, o.outlier_floor, o.color_prior, o.curvature, o.floor_behind};
}
inline void make(const SdfEnergyOptions& o, ColorPrinted<float>* penalty) { *penalty = {o.scale_m}; }

}  // namespace sdftrack::energies

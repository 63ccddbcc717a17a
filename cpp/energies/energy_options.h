// SPDX-License-Identifier: MIT
// What a data energy can be asked for, in plain numbers: for the CPU and for the host's part of kernels.
#pragma once

#include "energies/term.h"

namespace sdftrack::energies {

constexpr int kMaxJoined = 4;  // objects in a union: of more near one point the nearest count

struct SdfEnergyOptions {
  Residual residual = Residual::kRayHit;
  Curvature curvature = Curvature::kIrls;
  float scale_m = 0.002f;      // s of the logistic density
  float outlier_floor = 0.1f;  // e; 0: the printed likelihood
  float floor_behind = -1;     // e of readings behind the surface; negative: the same
  bool warm_hits = true;       // go on from the last hits; false: cost is a function of the state alone
  bool scale = false;          // unknown size
  bool intrinsics = false;     // unknown fx, fy, cx, cy
  float sharpness = 40;  // of a union, per smallest voxel: it lies below its objects by log(4) / 40 at most
  bool color = false;    // weigh the pixels by their colours' posteriors
  ColorLikelihood color_likelihood = ColorLikelihood::kOdds;
  float color_prior = 0.7f;  // the posterior of a colour that says nothing
  int threads = 1;
};

// Of the union of objects `of` among those of sdfs: by the smallest of their voxels.
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

// SPDX-License-Identifier: MIT
// Loops over rows of voxels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include "base/isa.h"
#include "levelset/eikonal_terms.h"
#include "levelset/evidence_terms.h"
#include "levelset/evolve_terms.h"

namespace sdftrack {

constexpr int kMostRelaxed = 64;

// What has happened to a row of voxels.
struct RowChange {
  bool near;    // a surface is read near some of them
  bool turned;  // some have gone from inside to outside, or back, or are known for the first time
  bool inside;  // some lie inside
};

struct VoxelOps {
  // `count` voxels from p_cam on, a step apart: adds what the frame says to their log ratios and weights, and
  // gives how far behind a surface that is read each of them lies.
  RowChange (*fuse)(const EvidenceTerm<float>&, Vec3f p_cam, Vec3f step_cam, int count, float most_weight,
                    float* log_ratio, float* weight, float* distance_m);
  // The voxels [x0, x1) of a row, none at the volume's border, at most kMostRelaxed.
  void (*relax)(const EikonalTerm<float>&, const RowAt&, int x0, int x1);
  // Those of them whose log ratio has another sign than a neighbour's, as x; `at` has room for kLanes more.
  // The distances of the others keep their size and take the sign of their log ratio.
  int (*crossed)(const float* log_ratio, const RowAt&, float voxel_m, int x0, int x1, int* at);
  // `count` voxels in a row whose neighbours along x, y and z lie at the same offsets: the flux of a step of
  // the evolution along x, y and z, and from that the voxels after the step.
  void (*flux)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, int count,
               float* const* flux);
  void (*step)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, const float* log_ratio,
               const float* const* flux, int count, float* out);

  // Defined in voxels_*.cpp. Rows are as long as a block, which wider packs would not fill.
  static const VoxelOps baseline, avx2;
};

inline const VoxelOps& voxel_ops_for([[maybe_unused]] Isa isa) {
#ifdef SDFTRACK_X86_SETS
  if (isa != Isa::kBaseline) return VoxelOps::avx2;
#endif
  return VoxelOps::baseline;
}

}  // namespace sdftrack

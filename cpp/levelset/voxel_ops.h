// SPDX-License-Identifier: MIT
// Loops over rows of voxels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include <cstdint>

#include "base/isa.h"
#include "levelset/eikonal_terms.h"
#include "levelset/evidence_terms.h"
#include "levelset/evolve_terms.h"

namespace sdftrack::levelset {

// A box of at most kBlockSide^3 voxels: their number along each axis, and the strides of rows and slices.
constexpr int kBlockSide = 8;
struct BlockRows {
  int nx, ny, nz;
  int row, slice;

  // Offset of row k, counted along y, then z.
  HD std::size_t offset(int k) const { return std::size_t(k % ny) * row + std::size_t(k / ny) * slice; }
};

// The place of a block's voxels in the camera's frame: the first one and the steps along the axes.
struct BlockPlace {
  Vec3d first, x, y, z;

  // The first voxel of a row, rounded once.
  HD Vec3f at(const BlockRows& rows, int k) const {
    return (first + double(k % rows.ny) * y + double(k / rows.ny) * z).cast<float>();
  }
};

struct BlockChange {
  std::uint64_t near;  // a bit for each row: a surface is measured near some of its voxels
  bool turned;         // some voxels changed between inside and outside, or are known for the first time
  bool inside;         // some voxels lie inside
  bool empty;          // all voxels are outside with the highest certainty
};

inline void prefetch_rows(const float* first, const BlockRows& rows) {
  for (int k = 0; k < rows.ny * rows.nz; ++k) prefetch(first + rows.offset(k));
}

struct VoxelOps {
  // Adds a frame's evidence to the log ratios and weights of a block. distance_m: how far each voxel lies
  // behind a measured surface (kBlockSide values per row, only in rows that are near).
  BlockChange (*fuse)(const EvidenceTerm<float>&, const BlockPlace&, const BlockRows&, float max_weight,
                      float* log_ratio, float* weight, float* distance_m);
  // A sweep over a block that has no voxels at the volume's border. Returns whether any voxel within band_m
  // of the surface changed by more than settled_m.
  bool (*relax)(const EikonalTerm<float>&, const BlockRows&, bool forward, float settled_m, float band_m,
                float* phi);
  // Finds the voxels of such a block whose log ratio differs in sign from a neighbour's, as offsets; `at` has
  // room for kLanes more. The other distances keep their size and take the sign of their log ratio.
  int (*crossed)(const float* log_ratio, const BlockRows&, float voxel_m, float* phi, int* at);
  // For `count` voxels in a row with neighbours at the same offsets: flux gives the flux of a step of the
  // evolution along x, y and z; step gives the voxels after the step.
  void (*flux)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, int count,
               float* const* flux);
  void (*step)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, const float* log_ratio,
               const float* const* flux, int count, float* out);

  // Defined in voxels_*.cpp. A row of a block cannot fill wider packs.
  static const VoxelOps baseline, avx2;
};

}  // namespace sdftrack::levelset

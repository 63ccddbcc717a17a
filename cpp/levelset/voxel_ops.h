// SPDX-License-Identifier: MIT
// Loops over rows of voxels, compiled once per instruction set like energies/term_ops.h.
#pragma once

#include <cstdint>

#include "base/isa.h"
#include "levelset/eikonal_terms.h"
#include "levelset/evidence_terms.h"
#include "levelset/evolve_terms.h"

namespace sdftrack::levelset {

// A box of at most kBlockSide^3 voxels: how many there are along each axis, and how far apart in memory rows
// and slices are.
constexpr int kBlockSide = 8;
struct BlockRows {
  int nx, ny, nz;
  int row, slice;

  // Of a row, counted along y, then z.
  HD std::size_t offset(int k) const {
    return static_cast<std::size_t>(k % ny) * static_cast<std::size_t>(row) +
           static_cast<std::size_t>(k / ny) * static_cast<std::size_t>(slice);
  }
};

// Where its voxels are seen: the first one and the steps along the axes, in the camera's frame.
struct BlockPlace {
  Vec3d first, x, y, z;

  // The first voxel of a row, rounded once.
  HD Vec3f at(const BlockRows& rows, int k) const {
    return (first + static_cast<double>(k % rows.ny) * y + static_cast<double>(k / rows.ny) * z)
        .cast<float>();
  }
};

// What has happened to them.
struct BlockChange {
  std::uint64_t near;  // a bit for each row: a surface is read near some of its voxels
  bool turned;         // some have gone from inside to outside, or back, or are known for the first time
  bool inside;         // some lie inside
  bool empty;          // all are as surely outside as they can be
};

inline void prefetch_rows(const float* first, const BlockRows& rows) {
  for (int k = 0; k < rows.ny * rows.nz; ++k) prefetch(first + rows.offset(k));
}

struct VoxelOps {
  // Adds what a frame says to the log ratios and weights of a block, and gives how far behind a surface that
  // is read each voxel lies (kBlockSide to a row; only of rows that are near).
  BlockChange (*fuse)(const EvidenceTerm<float>&, const BlockPlace&, const BlockRows&, float max_weight,
                      float* log_ratio, float* weight, float* distance_m);
  // A sweep over a block, none of whose voxels lies at the volume's border. Returns whether any voxel
  // within band_m of the surface changed by more than settled_m.
  bool (*relax)(const EikonalTerm<float>&, const BlockRows&, bool forward, float settled_m, float band_m,
                float* phi);
  // Those voxels of such a block whose log ratio has another sign than a neighbour's, as offsets from the
  // first; `at` has room for kLanes more. The distances of the others keep their size and take the sign of
  // their log ratio.
  int (*crossed)(const float* log_ratio, const BlockRows&, float voxel_m, float* phi, int* at);
  // `count` voxels in a row whose neighbours along x, y and z lie at the same offsets: the flux of a step of
  // the evolution along x, y and z, and from that the voxels after the step.
  void (*flux)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, int count,
               float* const* flux);
  void (*step)(const EvolveTerm<float>&, const Neighbours* at, const float* phi, const float* log_ratio,
               const float* const* flux, int count, float* out);

  // Defined in voxels_*.cpp. A row of a block does not fill wider packs.
  static const VoxelOps baseline, avx2;
};

}  // namespace sdftrack::levelset

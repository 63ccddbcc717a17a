// SPDX-License-Identifier: MIT
// The signed distance to the surface between what is inside and what is outside, kept up to date block by
// block (docs/math/reconstruction.md, section 3).
#pragma once

#include <vector>

#include "levelset/evidence.h"
#include "levelset/far_terms.h"
#include "sdf/surface_samples.h"

namespace sdftrack::levelset {

// How far the surface moved beside some voxels.
struct SurfaceChange {
  float sum_m, max_m;  // the sum: of those that lay near it before
  int count;           // of these
};

// Of a relaxation, in voxels.
constexpr float kStays = 0.02f;   // a surface that moved less is not followed yet
constexpr float kSettled = 0.2f;  // distances that change by more are followed on
constexpr float kMax_m = 1e6f;    // of a distance while it is relaxed

// Of a voxel of which nothing but its side is known.
float far_side_m(const sdf::Grid& grid);
// Boxes of cells that hold all of the surface, if it runs only through these blocks.
std::vector<sdf::VoxelBox> boxes_of(const BlockLattice& blocks, const std::vector<unsigned char>& surface);

class EvidenceDistance {
 public:
  static constexpr int kBlock = EvidenceVolume::kBlock;

  explicit EvidenceDistance(const EvidenceVolume& evidence);

  // After these blocks have been fused (`all`: for the first time, all blocks): distances to the new surface,
  // exact beside it and by `rounds` of relaxation up to band_voxels away, in those blocks and beside them.
  void update(const EvidenceVolume& evidence, const std::vector<int>& fused, int rounds, float band_voxels,
              int threads, bool all = false);
  // Farther away: found on a lattice of kCoarse voxels by sweeping, and carried over to slices [z0, z1).
  void sweep_far(float band_voxels);
  void fill_far(float band_voxels, int z0, int z1, int threads);

  // Boxes of cells that hold all of the surface.
  std::vector<sdf::VoxelBox> surface_boxes() const;
  // How far the surface moved in the last update, on the mean where it changed.
  double change_m() const { return change_m_; }
  const LargeArray<float>& phi() const { return phi_; }
  SdfView view() const { return grid().view(phi_.data()); }

 private:
  using Change = SurfaceChange;
  const sdf::Grid& grid() const { return blocks_.grid; }
  bool cross(const EvidenceVolume& evidence, const VoxelRange& range, Change* change);
  void cross_beside(const EvidenceVolume& evidence, const std::vector<int>& changed, int threads);
  BlockRows rows_of(const VoxelRange& range, std::size_t* first) const;
  void relax(int block, bool forward, float band_m);
  void find_active(const EvidenceVolume& evidence, const std::vector<int>& changed, float band_m);
  float nearest(int block) const;
  bool beside_surface(int block) const;
  void mark_around(int block);

  BlockLattice blocks_;
  LargeArray<float> phi_;
  bool has_surface_ = false;
  std::vector<Change> changes_;  // by block
  std::vector<float> moved_m_;   // by block, at most: the surface since the distances around it followed
  double change_m_ = 0;
  std::vector<unsigned char> unsettled_;  // blocks of which distances changed when last relaxed
  std::vector<unsigned char> marked_;
  std::vector<int> changed_;
  std::vector<int> beside_;             // blocks with a face on one that has changed
  std::vector<unsigned char> surface_;  // blocks that hold a voxel beside the surface
  std::vector<int> active_[8];          // by colour: no two of one colour are neighbours
  std::vector<float> coarse_;
  std::vector<std::uint8_t> known_, inside_;
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
// The signed distance to the surface between what is inside and what is outside, kept up to date block by
// block (docs/math/reconstruction.md, section 3).
#pragma once

#include <vector>

#include "levelset/evidence.h"
#include "sdf/surface_samples.h"

namespace sdftrack::levelset {

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
  SdfView view() const { return grid_.view(phi_.data()); }

 private:
  static constexpr int kCoarse = 4;
  struct Change {
    float sum_m = 0, max_m = 0;
    int count = 0;
  };
  struct Range {
    int x0, x1, y0, y1, z0, z1;
  };
  Range inner(int block) const;
  bool cross(const EvidenceVolume& evidence, const Range& range, Change* change);
  void cross_beside(const EvidenceVolume& evidence, const std::vector<int>& changed, int threads);
  BlockRows rows_of(const Range& range, std::size_t* first) const;
  void relax(int block, bool forward, float band_m);
  void find_active(const EvidenceVolume& evidence, const std::vector<int>& changed, float band_m);
  float least(int block) const;
  bool beside_surface(int block) const;
  void mark_around(int block);

  sdf::Grid grid_;
  int bx_, by_, bz_;
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
  sdf::Grid coarse_grid() const;
  std::vector<float> coarse_;
  std::vector<std::uint8_t> known_, inside_;
};

}  // namespace sdftrack::levelset

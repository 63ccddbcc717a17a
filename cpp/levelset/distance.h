// SPDX-License-Identifier: MIT
// The signed distance to the surface between inside and outside, kept up to date block by block
// (docs/math/reconstruction.md, section 3).
#pragma once

#include <vector>

#include "levelset/evidence.h"
#include "levelset/far_terms.h"
#include "sdf/surface_samples.h"

namespace sdftrack::levelset {

// How far the surface moved next to some voxels.
struct SurfaceChange {
  float sum_m, max_m;  // sum_m: over the voxels that were near it before
  int count;           // of those voxels
};

// Thresholds of a relaxation, in voxels.
constexpr float kStays = 0.02f;   // smaller motions of the surface are not propagated yet
constexpr float kSettled = 0.2f;  // larger changes of distances are propagated further
constexpr float kMax_m = 1e6f;    // limit of a distance while it is relaxed

// Distance of a voxel of which only the sign is known.
float far_side_m(const sdf::Grid& grid);
// Boxes of cells that contain the whole surface, if it runs only through these blocks.
std::vector<sdf::VoxelBox> boxes_of(const BlockLattice& blocks, const std::vector<unsigned char>& surface);

class EvidenceDistance {
 public:
  static constexpr int kBlock = EvidenceVolume::kBlock;

  explicit EvidenceDistance(const EvidenceVolume& evidence);

  // Call it after `fused` blocks have been fused (`all`: the first time, all blocks). Updates the distances
  // in and next to these: exact next to the surface, and by `rounds` of relaxation up to band_voxels away.
  void update(const EvidenceVolume& evidence, const std::vector<int>& fused, int rounds, float band_voxels,
              int threads, bool all = false);
  // Beyond the band: sweeping on a lattice of every kCoarse-th voxel, then filling of slices [z0, z1).
  void sweep_far(float band_voxels);
  void fill_far(float band_voxels, int z0, int z1, int threads);

  // Boxes of cells that contain the whole surface.
  std::vector<sdf::VoxelBox> surface_boxes() const;
  // Mean motion of the surface in the last update, where it changed.
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
  std::vector<float> moved_m_;   // by block: largest motion since the distances around it were updated
  double change_m_ = 0;
  std::vector<unsigned char> unsettled_;  // blocks whose distances changed when last relaxed
  std::vector<unsigned char> marked_;
  std::vector<int> changed_;
  std::vector<int> beside_;             // blocks that share a face with a changed one
  std::vector<unsigned char> surface_;  // blocks with a voxel next to the surface
  std::vector<int> active_[8];          // by colour: no two of one colour are neighbours
  std::vector<float> coarse_;
  std::vector<std::uint8_t> known_, inside_;
};

}  // namespace sdftrack::levelset

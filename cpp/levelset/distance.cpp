// SPDX-License-Identifier: MIT
#include "levelset/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "levelset/crossing_terms.h"
#include "levelset/voxel_ops.h"
#include "sdf/sweep.h"

namespace sdftrack::levelset {

namespace {

constexpr std::size_t kAtOnce = 8;  // blocks
}  // namespace

float far_side_m(const sdf::Grid& grid) {
  return float(grid.voxel_m * std::max({grid.nx, grid.ny, grid.nz}));
}

EvidenceDistance::EvidenceDistance(const EvidenceVolume& evidence) : blocks_(evidence.blocks()) {
  const float far = far_side_m(grid());
  phi_ = LargeArray<float>(grid().size());
  for (std::size_t i = 0; i < phi_.size(); ++i) phi_[i] = evidence.log_ratio()[i] > 0 ? -far : far;
  const auto blocks = std::size_t(blocks_.count());
  marked_.resize(blocks), surface_.resize(blocks), changes_.resize(blocks), moved_m_.resize(blocks),
      unsettled_.resize(blocks);
}

BlockRows EvidenceDistance::rows_of(const VoxelRange& r, std::size_t* first) const {
  *first = grid().index(r.x0, r.y0, r.z0);
  return {r.x1 - r.x0, r.y1 - r.y0, r.z1 - r.z0, grid().nx, grid().nx * grid().ny};
}

// Returns whether the surface is next to any voxel of the range.
bool EvidenceDistance::cross(const EvidenceVolume& evidence, const VoxelRange& r, Change* change) {
  std::size_t first;
  const BlockRows rows = rows_of(r, &first);
  const float voxel = float(grid().voxel_m);
  const RatioView ratios{evidence.log_ratio().data(), evidence.weight().data()};
  int found[kBlock * kBlock * kBlock + 16];
  const int n = for_isa<VoxelOps>(used_isa())
                    .crossed(ratios.log_ratio + first, rows, voxel, phi_.data() + first, found);
  for (int k = 0; k < n; ++k) {
    const std::size_t i = first + std::size_t(found[k]);
    const float now = crossing_distance(ratios, i, std::size_t(rows.row), std::size_t(rows.slice), voxel),
                moved = std::abs(now - phi_[i]);
    if (std::abs(phi_[i]) < kMoveWithin * voxel) change->sum_m += moved, change->count += 1;
    change->max_m = std::max(change->max_m, moved);
    phi_[i] = now;
  }
  return n > 0;
}

// A change in a block also moves the surface between it and the voxels on the other side of its faces.
void EvidenceDistance::cross_beside(const EvidenceVolume& evidence, const std::vector<int>& changed,
                                    int threads) {
  enum : unsigned char { kNone, kChanged, kBeside };
  std::fill(marked_.begin(), marked_.end(), static_cast<unsigned char>(kNone));
  for (const int b : changed) marked_[b] = kChanged;
  const auto each_face = [&](int b, const auto& body) {  // body(neighbour, axis, whether it comes after)
    const int at[3] = {blocks_.x(b), blocks_.y(b), blocks_.z(b)},
              size[3] = {blocks_.bx, blocks_.by, blocks_.bz},
              step[3] = {1, blocks_.bx, blocks_.bx * blocks_.by};
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] > 0) body(std::size_t(b - step[axis]), axis, false);
      if (at[axis] + 1 < size[axis]) body(std::size_t(b + step[axis]), axis, true);
    }
  };
  beside_.clear();
  for (const int b : changed)
    each_face(b, [&](std::size_t other, int, bool) {
      if (marked_[other] == kNone) marked_[other] = kBeside, beside_.push_back(int(other));
    });
  parallel_for((beside_.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
    for (std::size_t k = kAtOnce * chunk; k < std::min(beside_.size(), kAtOnce * (chunk + 1)); ++k) {
      const int b = beside_[k];
      each_face(b, [&](std::size_t other, int axis, bool after) {
        if (marked_[other] != kChanged) return;
        VoxelRange r = blocks_.inner(b);
        int* const from[3] = {&r.x0, &r.y0, &r.z0};
        int* const to[3] = {&r.x1, &r.y1, &r.z1};
        if (after)
          *from[axis] = std::max(*from[axis], *to[axis] - 1);
        else
          *to[axis] = std::min(*to[axis], *from[axis] + 1);
        Change unused{};
        if (cross(evidence, r, &unused)) surface_[b] = 1;
      });
    }
  });
}

std::vector<sdf::VoxelBox> boxes_of(const BlockLattice& blocks, const std::vector<unsigned char>& surface) {
  const sdf::Grid& grid = blocks.grid;
  std::vector<sdf::VoxelBox> cells;
  for (int b = 0; b < blocks.count(); ++b) {
    if (!surface[b]) continue;
    const int x = kBlockSide * blocks.x(b), y = kBlockSide * blocks.y(b), z = kBlockSide * blocks.z(b);
    cells.push_back({x, y, z, std::min(x + kBlockSide, grid.nx - 1), std::min(y + kBlockSide, grid.ny - 1),
                     std::min(z + kBlockSide, grid.nz - 1)});
  }
  return cells;
}

std::vector<sdf::VoxelBox> EvidenceDistance::surface_boxes() const { return boxes_of(blocks_, surface_); }

void EvidenceDistance::relax(int block, bool forward, float band_m) {
  std::size_t first;
  const BlockRows rows = rows_of(blocks_.inner(block), &first);
  const float voxel_m = float(grid().voxel_m);
  unsettled_[block] =
      for_isa<VoxelOps>(used_isa())
          .relax({voxel_m, kMax_m}, rows, forward, kSettled * voxel_m, band_m, phi_.data() + first);
}

float EvidenceDistance::nearest(int block) const {
  const VoxelRange r = blocks_.inner(block);
  float nearest = std::numeric_limits<float>::max();
  for (int z = r.z0; z < r.z1; ++z)
    for (int y = r.y0; y < r.y1; ++y) {
      const float* const row = phi_.data() + grid().index(0, y, z);
      for (int x = r.x0; x < r.x1; ++x) nearest = std::min(nearest, std::abs(row[x]));
    }
  return nearest;
}

// Whether the surface runs through the block or a neighbour: all that lies within a block's width of it.
bool EvidenceDistance::beside_surface(int block) const {
  const VoxelRange r = blocks_.around(block);
  for (int z = r.z0; z < r.z1; ++z)
    for (int y = r.y0; y < r.y1; ++y)
      for (int x = r.x0; x < r.x1; ++x)
        if (surface_[blocks_.at(x, y, z)]) return true;
  return false;
}

// Finds the blocks in or next to which the surface has moved or distances are still affected by an earlier
// motion, as eight sets without neighbours.
void EvidenceDistance::find_active(const EvidenceVolume& evidence, const std::vector<int>& changed,
                                   float band_m) {
  std::fill(marked_.begin(), marked_.end(), static_cast<unsigned char>(0));
  for (int b = 0; b < int(unsettled_.size()); ++b)
    if (unsettled_[b]) mark_around(b);
  const float min_m = kStays * float(grid().voxel_m);
  for (const int b : changed) {
    float& moved_m = moved_m_[b];
    moved_m += changes_[b].max_m;
    if (moved_m < min_m && !evidence.turned(b)) continue;
    moved_m = 0;
    mark_around(b);
  }
  for (std::vector<int>& set : active_) set.clear();
  for (int b = 0; b < int(marked_.size()); ++b) {
    if (!marked_[b]) continue;
    if (beside_surface(b) || nearest(b) < band_m)
      active_[blocks_.color(b)].push_back(b);
    else
      unsettled_[b] = 0;
  }
}

void EvidenceDistance::mark_around(int block) {
  const VoxelRange r = blocks_.around(block);
  for (int z = r.z0; z < r.z1; ++z)
    for (int y = r.y0; y < r.y1; ++y)
      for (int x = r.x0; x < r.x1; ++x) marked_[blocks_.at(x, y, z)] = 1;
}

void EvidenceDistance::update(const EvidenceVolume& evidence, const std::vector<int>& fused, int rounds,
                              float band_voxels, int threads, bool all) {
  const float band_m = band_voxels * float(grid().voxel_m);
  // A block without a surface and without a turned voxel has gained no surface.
  std::vector<int>& changed = changed_;
  changed.clear();
  for (const int b : fused)
    if (all || surface_[b] || evidence.turned(b)) changed.push_back(b);
  parallel_for((changed.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
    for (std::size_t k = kAtOnce * chunk; k < std::min(changed.size(), kAtOnce * (chunk + 1)); ++k) {
      const auto b = std::size_t(changed[k]);
      changes_[b] = {};
      surface_[b] = cross(evidence, blocks_.inner(changed[k]), &changes_[b]);
    }
  });
  cross_beside(evidence, changed, threads);
  double sum = 0;
  int count = 0;
  for (const int b : changed) {
    const Change& change = changes_[b];
    sum += double(change.sum_m), count += change.count;
  }
  change_m_ = count > 0 ? sum / count : 0;
  find_active(evidence, changed, band_m);
  // A front that has moved away leaves distances that are too small: they grow by a voxel in each round.
  for (int round = 0; round < rounds; ++round)
    for (const std::vector<int>& set : active_)
      parallel_for((set.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
        for (std::size_t k = kAtOnce * chunk; k < std::min(set.size(), kAtOnce * (chunk + 1)); ++k)
          relax(set[k], round % 2 == 0, band_m);
      });
}

// Coarse nodes within the band keep their distances; the others are swept.
void EvidenceDistance::sweep_far(float band_voxels) {
  const float band_m = band_voxels * float(grid().voxel_m);
  const sdf::Grid coarse = coarse_lattice(grid());
  coarse_.resize(coarse.size()), known_.resize(coarse.size()), inside_.resize(coarse.size());
  std::size_t i = 0;
  has_surface_ = false;
  for (int z = 0; z < coarse.nz; ++z)
    for (int y = 0; y < coarse.ny; ++y)
      for (int x = 0; x < coarse.nx; ++x, ++i) {
        const float phi = phi_[coarse_voxel(grid(), x, y, z)];
        coarse_[i] = std::abs(phi), known_[i] = coarse_[i] < band_m, inside_[i] = phi < 0;
        has_surface_ |= known_[i] != 0;
      }
  if (!has_surface_) return;
  sdf::fast_sweep(coarse, known_, 1, &coarse_);
  for (std::size_t k = 0; k < coarse_.size(); ++k)
    if (inside_[k]) coarse_[k] = -coarse_[k];
}

// Each voxel of these slices beyond the band keeps its sign and takes its size from the coarse nodes.
void EvidenceDistance::fill_far(float band_voxels, int z0, int z1, int threads) {
  if (!has_surface_) return;
  const float band_m = band_voxels * float(grid().voxel_m);
  const sdf::Grid coarse = coarse_lattice(grid());
  parallel_for(std::max(0, z1 - z0), threads, [&](std::size_t k) {
    const int z = z0 + int(k);
    const CoarsePlace at_z = coarse_place(z, coarse.nz);
    std::vector<float> between(coarse.nx);
    for (int y = 0; y < grid().ny; ++y) {
      const CoarsePlace at_y = coarse_place(y, coarse.ny);
      for (int x = 0; x < coarse.nx; ++x) between[x] = mix_across(coarse_.data(), coarse, x, at_y, at_z);
      float* const row = phi_.data() + grid().index(0, y, z);
      for (int x = 0; x < grid().nx; ++x) {
        const CoarsePlace at_x = coarse_place(x, coarse.nx);
        const float* const p = between.data() + at_x.cell;
        row[x] = far_distance(row[x], mix(p[0], p[1], at_x.share), band_m);
      }
    }
  });
}

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
#include "levelset/distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "levelset/voxel_ops.h"
#include "sdf/sweep.h"

namespace sdftrack::levelset {

namespace {

constexpr std::size_t kAtOnce = 8;  // blocks
constexpr float kStays = 0.02f;     // voxels: a surface that moved less is not followed yet
constexpr float kSettled = 0.2f;    // voxels: distances that change by more are followed on
constexpr float kMax_m = 1e6f;      // of a distance while it is relaxed

}  // namespace

EvidenceDistance::EvidenceDistance(const EvidenceVolume& evidence)
    : grid_(evidence.grid()), bx_(evidence.blocks_x()), by_(evidence.blocks_y()), bz_(evidence.blocks_z()) {
  const float far = static_cast<float>(grid_.voxel_m * std::max({grid_.nx, grid_.ny, grid_.nz}));
  phi_ = LargeArray<float>(grid_.size());
  for (std::size_t i = 0; i < phi_.size(); ++i) phi_[i] = evidence.log_ratio()[i] > 0 ? -far : far;
  const std::size_t blocks =
      static_cast<std::size_t>(bx_) * static_cast<std::size_t>(by_) * static_cast<std::size_t>(bz_);
  marked_.resize(blocks), surface_.resize(blocks), changes_.resize(blocks), moved_m_.resize(blocks),
      unsettled_.resize(blocks);
}

// Its voxels but those at the volume's border.
EvidenceDistance::Range EvidenceDistance::inner(int block) const {
  const int x = kBlock * (block % bx_), y = kBlock * (block / bx_ % by_), z = kBlock * (block / (bx_ * by_));
  return {std::max(1, x), std::min(grid_.nx - 1, x + kBlock),
          std::max(1, y), std::min(grid_.ny - 1, y + kBlock),
          std::max(1, z), std::min(grid_.nz - 1, z + kBlock)};
}

BlockRows EvidenceDistance::rows_of(const Range& r, std::size_t* first) const {
  *first = grid_.index(r.x0, r.y0, r.z0);
  return {r.x1 - r.x0, r.y1 - r.y0, r.z1 - r.z0, grid_.nx, grid_.nx * grid_.ny};
}

// Where the mean log ratio changes its sign between two voxels, the surface lies where a line through both is
// 0; the distance of a voxel to the plane through such points of its axes. Returns whether there are any.
bool EvidenceDistance::cross(const EvidenceVolume& evidence, const Range& r, Change* change) {
  std::size_t first;
  const BlockRows rows = rows_of(r, &first);
  const float voxel = static_cast<float>(grid_.voxel_m);
  const float* ratio = evidence.log_ratio().data();
  const float* weight = evidence.weight().data();
  const auto mean = [&](std::size_t i) { return weight[i] > 0 ? ratio[i] / weight[i] : ratio[i]; };
  int found[kBlock * kBlock * kBlock + 16];
  const int n = voxel_ops_for(used_isa()).crossed(ratio + first, rows, voxel, phi_.data() + first, found);
  for (int k = 0; k < n; ++k) {
    const std::size_t i = first + static_cast<std::size_t>(found[k]);
    const float own = mean(i);
    float sum = 0;
    for (const int step : {1, rows.row, rows.slice}) {
      float nearest = 2;  // in voxels; beyond 1: no crossing along this axis
      for (const std::size_t j : {i - static_cast<std::size_t>(step), i + static_cast<std::size_t>(step)}) {
        const float other = mean(j);
        if ((other > 0) == (own > 0)) continue;
        nearest = std::min(nearest, std::abs(own) / std::max(std::abs(own) + std::abs(other), 1e-20f));
      }
      if (nearest <= 1) sum += 1 / std::max(nearest * nearest, 1e-8f);
    }
    const float distance = voxel / std::sqrt(std::max(sum, 1.0f));
    const float now = own > 0 ? -distance : distance, moved = std::abs(now - phi_[i]);
    if (std::abs(phi_[i]) < 2 * voxel) change->sum_m += moved, change->count += 1;
    change->max_m = std::max(change->max_m, moved);
    phi_[i] = now;
  }
  return n > 0;
}

// What has changed in a block also moves the surface between it and the voxels on the other side of its
// faces.
void EvidenceDistance::cross_beside(const EvidenceVolume& evidence, const std::vector<int>& changed,
                                    int threads) {
  enum : unsigned char { kNone, kChanged, kBeside };
  std::fill(marked_.begin(), marked_.end(), static_cast<unsigned char>(kNone));
  for (const int b : changed) marked_[static_cast<std::size_t>(b)] = kChanged;
  const auto each_face = [&](int b, const auto& body) {  // body(neighbour, axis, whether it lies after)
    const int at[3] = {b % bx_, b / bx_ % by_, b / (bx_ * by_)}, size[3] = {bx_, by_, bz_},
              step[3] = {1, bx_, bx_ * by_};
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] > 0) body(static_cast<std::size_t>(b - step[axis]), axis, false);
      if (at[axis] + 1 < size[axis]) body(static_cast<std::size_t>(b + step[axis]), axis, true);
    }
  };
  beside_.clear();
  for (const int b : changed)
    each_face(b, [&](std::size_t other, int, bool) {
      if (marked_[other] == kNone) marked_[other] = kBeside, beside_.push_back(static_cast<int>(other));
    });
  parallel_for((beside_.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
    for (std::size_t k = kAtOnce * chunk; k < std::min(beside_.size(), kAtOnce * (chunk + 1)); ++k) {
      const int b = beside_[k];
      each_face(b, [&](std::size_t other, int axis, bool after) {
        if (marked_[other] != kChanged) return;
        Range r = inner(b);
        int* const from[3] = {&r.x0, &r.y0, &r.z0};
        int* const to[3] = {&r.x1, &r.y1, &r.z1};
        if (after)
          *from[axis] = std::max(*from[axis], *to[axis] - 1);
        else
          *to[axis] = std::min(*to[axis], *from[axis] + 1);
        Change unused;
        if (cross(evidence, r, &unused)) surface_[static_cast<std::size_t>(b)] = 1;
      });
    }
  });
}

std::vector<sdf::VoxelBox> EvidenceDistance::surface_boxes() const {
  std::vector<sdf::VoxelBox> cells;
  for (int b = 0; b < static_cast<int>(surface_.size()); ++b) {
    if (!surface_[static_cast<std::size_t>(b)]) continue;
    const int x = kBlock * (b % bx_), y = kBlock * (b / bx_ % by_), z = kBlock * (b / (bx_ * by_));
    cells.push_back({x, y, z, std::min(x + kBlock, grid_.nx - 1), std::min(y + kBlock, grid_.ny - 1),
                     std::min(z + kBlock, grid_.nz - 1)});
  }
  return cells;
}

void EvidenceDistance::relax(int block, bool forward, float band_m) {
  std::size_t first;
  const BlockRows rows = rows_of(inner(block), &first);
  const float voxel_m = static_cast<float>(grid_.voxel_m);
  unsettled_[static_cast<std::size_t>(block)] =
      voxel_ops_for(used_isa())
          .relax({voxel_m, kMax_m}, rows, forward, kSettled * voxel_m, band_m, phi_.data() + first);
}

float EvidenceDistance::least(int block) const {
  const Range r = inner(block);
  float least = std::numeric_limits<float>::max();
  for (int z = r.z0; z < r.z1; ++z)
    for (int y = r.y0; y < r.y1; ++y) {
      const float* const row = phi_.data() + grid_.index(0, y, z);
      for (int x = r.x0; x < r.x1; ++x) least = std::min(least, std::abs(row[x]));
    }
  return least;
}

// Whether the surface runs through the block or one beside it, where all that is within a block's width of
// the surface lies.
bool EvidenceDistance::beside_surface(int block) const {
  const int ix = block % bx_, iy = block / bx_ % by_, iz = block / (bx_ * by_);
  for (int z = std::max(0, iz - 1); z <= std::min(bz_ - 1, iz + 1); ++z)
    for (int y = std::max(0, iy - 1); y <= std::min(by_ - 1, iy + 1); ++y)
      for (int x = std::max(0, ix - 1); x <= std::min(bx_ - 1, ix + 1); ++x)
        if (surface_[static_cast<std::size_t>((z * by_ + y) * bx_ + x)]) return true;
  return false;
}

// Where the surface has moved and beside it, and where distances still follow an earlier move, as eight sets
// without neighbours.
void EvidenceDistance::find_active(const EvidenceVolume& evidence, const std::vector<int>& changed,
                                   float band_m) {
  std::fill(marked_.begin(), marked_.end(), static_cast<unsigned char>(0));
  for (int b = 0; b < static_cast<int>(unsettled_.size()); ++b)
    if (unsettled_[static_cast<std::size_t>(b)]) mark_around(b);
  const float min_m = kStays * static_cast<float>(grid_.voxel_m);
  for (const int b : changed) {
    float& moved_m = moved_m_[static_cast<std::size_t>(b)];
    moved_m += changes_[static_cast<std::size_t>(b)].max_m;
    if (moved_m < min_m && !evidence.turned(b)) continue;
    moved_m = 0;
    mark_around(b);
  }
  for (std::vector<int>& set : active_) set.clear();
  for (int b = 0; b < static_cast<int>(marked_.size()); ++b) {
    if (!marked_[static_cast<std::size_t>(b)]) continue;
    if (beside_surface(b) || least(b) < band_m)
      active_[(b % bx_ & 1) | (b / bx_ % by_ & 1) << 1 | (b / (bx_ * by_) & 1) << 2].push_back(b);
    else
      unsettled_[static_cast<std::size_t>(b)] = 0;
  }
}

void EvidenceDistance::mark_around(int block) {
  const int ix = block % bx_, iy = block / bx_ % by_, iz = block / (bx_ * by_);
  for (int z = std::max(0, iz - 1); z <= std::min(bz_ - 1, iz + 1); ++z)
    for (int y = std::max(0, iy - 1); y <= std::min(by_ - 1, iy + 1); ++y)
      for (int x = std::max(0, ix - 1); x <= std::min(bx_ - 1, ix + 1); ++x)
        marked_[static_cast<std::size_t>((z * by_ + y) * bx_ + x)] = 1;
}

void EvidenceDistance::update(const EvidenceVolume& evidence, const std::vector<int>& fused, int rounds,
                              float band_voxels, int threads, bool all) {
  const float band_m = band_voxels * static_cast<float>(grid_.voxel_m);
  // Where there is no surface and no voxel has turned, none has come.
  std::vector<int>& changed = changed_;
  changed.clear();
  for (const int b : fused)
    if (all || surface_[static_cast<std::size_t>(b)] || evidence.turned(b)) changed.push_back(b);
  parallel_for((changed.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
    for (std::size_t k = kAtOnce * chunk; k < std::min(changed.size(), kAtOnce * (chunk + 1)); ++k) {
      const auto b = static_cast<std::size_t>(changed[k]);
      changes_[b] = {};
      surface_[b] = cross(evidence, inner(changed[k]), &changes_[b]);
    }
  });
  cross_beside(evidence, changed, threads);
  double sum = 0;
  int count = 0;
  for (const int b : changed) {
    const Change& change = changes_[static_cast<std::size_t>(b)];
    sum += static_cast<double>(change.sum_m), count += change.count;
  }
  change_m_ = count > 0 ? sum / count : 0;
  find_active(evidence, changed, band_m);
  // A front that has gone leaves distances behind that are too small: they grow by a voxel in each round.
  for (int round = 0; round < rounds; ++round)
    for (const std::vector<int>& set : active_)
      parallel_for((set.size() + kAtOnce - 1) / kAtOnce, threads, [&](std::size_t chunk) {
        for (std::size_t k = kAtOnce * chunk; k < std::min(set.size(), kAtOnce * (chunk + 1)); ++k)
          relax(set[k], round % 2 == 0, band_m);
      });
}

// Coarse nodes within the band keep their distances, the others are swept.
void EvidenceDistance::sweep_far(float band_voxels) {
  const float band_m = band_voxels * static_cast<float>(grid_.voxel_m);
  const sdf::Grid coarse = coarse_grid();
  coarse_.resize(coarse.size()), known_.resize(coarse.size()), inside_.resize(coarse.size());
  std::size_t i = 0;
  has_surface_ = false;
  for (int z = 0; z < coarse.nz; ++z)
    for (int y = 0; y < coarse.ny; ++y)
      for (int x = 0; x < coarse.nx; ++x, ++i) {
        const float phi =
            phi_[grid_.index(std::min(kCoarse * x, grid_.nx - 1), std::min(kCoarse * y, grid_.ny - 1),
                             std::min(kCoarse * z, grid_.nz - 1))];
        coarse_[i] = std::abs(phi), known_[i] = coarse_[i] < band_m, inside_[i] = phi < 0;
        has_surface_ |= known_[i] != 0;
      }
  if (!has_surface_) return;
  sdf::fast_sweep(coarse, known_, &coarse_);
  for (std::size_t k = 0; k < coarse_.size(); ++k)
    if (inside_[k]) coarse_[k] = -coarse_[k];
}

// Every voxel of these slices beyond the band takes what the coarse nodes around it say, and keeps its sign.
void EvidenceDistance::fill_far(float band_voxels, int z0, int z1, int threads) {
  if (!has_surface_) return;
  const float band_m = band_voxels * static_cast<float>(grid_.voxel_m), per = 1.0f / kCoarse;
  const sdf::Grid coarse = coarse_grid();
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  parallel_for(static_cast<std::size_t>(std::max(0, z1 - z0)), threads, [&](std::size_t k) {
    const int z = z0 + static_cast<int>(k), iz = std::min(z / kCoarse, coarse.nz - 2);
    const float fz = per * static_cast<float>(z) - static_cast<float>(iz);
    std::vector<float> between(static_cast<std::size_t>(coarse.nx));
    for (int y = 0; y < grid_.ny; ++y) {
      const int iy = std::min(y / kCoarse, coarse.ny - 2);
      const float fy = per * static_cast<float>(y) - static_cast<float>(iy);
      const float *const a = &coarse_[coarse.index(0, iy, iz)],
                         *const b = &coarse_[coarse.index(0, iy + 1, iz)],
                         *const c = &coarse_[coarse.index(0, iy, iz + 1)],
                         *const d = &coarse_[coarse.index(0, iy + 1, iz + 1)];
      for (std::size_t x = 0; x < between.size(); ++x)
        between[x] = mix(mix(a[x], b[x], fy), mix(c[x], d[x], fy), fz);
      float* const row = phi_.data() + grid_.index(0, y, z);
      for (int x = 0; x < grid_.nx; ++x) {
        const int ix = std::min(x / kCoarse, coarse.nx - 2);
        const float* const p = between.data() + ix;
        const float there = std::abs(mix(p[0], p[1], per * static_cast<float>(x) - static_cast<float>(ix)));
        const float own = row[x], size = std::max(band_m, there);
        row[x] = std::abs(own) < band_m ? own : std::copysign(size, own);
      }
    }
  });
}

sdf::Grid EvidenceDistance::coarse_grid() const {
  const auto nodes = [](int n) { return (n - 1 + kCoarse - 1) / kCoarse + 1; };
  return {nodes(grid_.nx), nodes(grid_.ny), nodes(grid_.nz), kCoarse * grid_.voxel_m, grid_.origin_obj};
}

}  // namespace sdftrack::levelset

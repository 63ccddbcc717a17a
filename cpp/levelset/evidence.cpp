// SPDX-License-Identifier: MIT
#include "levelset/evidence.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/to_int.h"
#include "levelset/voxel_ops.h"

namespace sdftrack::levelset {

namespace {

constexpr int kBlocksAtOnce = 64;

}  // namespace

EvidenceTerm<float> evidence_term(const PixelRect& rect, const float* pixels, const Camera& camera,
                                  const EvidenceOptions& options) {
  return {pixels,           rect.x0,       rect.y0,
          rect.width(),     rect.height(), camera.K.cast<float>(),
          options.form,     options.noise, options.carve_from_m,
          options.min_slant};
}

float evidence_reach_m(const EvidenceOptions& options) {
  return (options.form.printed ? kPrintedReach + 1 : kReachPerSigma) * options.form.sigma_d_m;
}

EvidenceVolume::EvidenceVolume(const sdf::Grid& grid, const float* prior)
    : blocks_(grid),
      log_ratio_(grid.size()),
      weight_(grid.size()),
      colors_(grid.size()),
      empty_(std::size_t(blocks_.count())),
      spoken_(empty_.size()),
      turned_(empty_.size(), 1) {
  if (prior) std::copy_n(prior, grid.size(), log_ratio_.begin());
}

EvidenceVolume EvidenceVolume::padded(const std::array<int, 3>& before,
                                      const std::array<int, 3>& after) const {
  const sdf::Grid& before_grid = blocks_.grid;
  sdf::Grid grid = before_grid;
  grid.nx += kBlock * (before[0] + after[0]);
  grid.ny += kBlock * (before[1] + after[1]);
  grid.nz += kBlock * (before[2] + after[2]);
  grid.origin_obj = before_grid.point(-kBlock * before[0], -kBlock * before[1], -kBlock * before[2]);
  EvidenceVolume larger(grid, nullptr);
  for (int z = 0; z < before_grid.nz; ++z)
    for (int y = 0; y < before_grid.ny; ++y) {
      const auto from = std::ptrdiff_t(before_grid.index(0, y, z)),
                 to = std::ptrdiff_t(
                     grid.index(kBlock * before[0], y + kBlock * before[1], z + kBlock * before[2]));
      std::copy_n(log_ratio_.begin() + from, before_grid.nx, larger.log_ratio_.begin() + to);
      std::copy_n(weight_.begin() + from, before_grid.nx, larger.weight_.begin() + to);
      std::copy_n(colors_.begin() + from, before_grid.nx, larger.colors_.begin() + to);
    }
  for (int b = 0; b < int(spoken_.size()); ++b) {
    const int x = blocks_.x(b) + before[0], y = blocks_.y(b) + before[1], z = blocks_.z(b) + before[2];
    larger.spoken_[(z * larger.blocks_.by + y) * larger.blocks_.bx + x] = spoken_[b];
  }
  larger.frame_ = frame_;
  return larger;
}

void EvidenceVolume::bound_guess(const std::function<bool(Vec3d p_obj)>& may_be_inside, int threads) {
  parallel_for(grid().nz, threads, [&](std::size_t slice) {
    const int z = int(slice);
    for (int y = 0; y < grid().ny; ++y)
      for (int x = 0; x < grid().nx; ++x) {
        const std::size_t at = grid().index(x, y, z);
        if (!(weight_[at] > 0) && log_ratio_[at] > 0 && !may_be_inside(grid().point(x, y, z)))
          log_ratio_[at] = -log_ratio_[at];
      }
  });
}

void find_tiles(const EvidenceImage& image, float reach_m, std::vector<Tile>* tiles) {
  const int tiles_x = tiles_along(image.width());
  tiles->assign(std::size_t(tiles_x) * std::size_t(tiles_along(image.height())), Tile::empty());
  const EvidencePixel* pixel = image.pixels().data();
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x, ++pixel)
      (*tiles)[std::size_t(y / kTile) * tiles_x + std::size_t(x / kTile)].add(*pixel, reach_m);
}

const std::vector<int>& EvidenceVolume::fuse(const EvidenceImage& image, const FrameColors& colors,
                                             const Camera& camera, const Rigidd& T_cam_obj,
                                             const EvidenceOptions& options, int threads) {
  find_tiles(image, evidence_reach_m(options), &tiles_);
  const EvidenceTerm<float> term =
      evidence_term(image.rect(), reinterpret_cast<const float*>(image.pixels().data()), camera, options);
  const BlockSight sight{blocks_,
                         T_cam_obj,
                         camera.K,
                         image.rect().x0,
                         image.rect().y0,
                         tiles_along(image.width()),
                         tiles_along(image.height()),
                         tiles_.data(),
                         frame_,
                         options.known_every};
  const int blocks = blocks_.count();
  touched_.assign(blocks, 0);

  parallel_for((blocks + kBlocksAtOnce - 1) / kBlocksAtOnce, threads, [&](std::size_t chunk) {
    const int first = int(chunk) * kBlocksAtOnce, last = std::min(blocks, first + kBlocksAtOnce);
    int here[kBlocksAtOnce], n = 0;
    for (int b = first; b < last; ++b)
      if (!sight.rests(b, spoken_[b]) && sight.touches(b, empty_[b])) here[n++] = b;
    for (int k = 0; k < n; ++k) {
      prefetch_block(here[std::min(k + 1, n - 1)]);
      touched_[here[k]] = fuse_block(here[k], term, sight, image, colors, options);
    }
  });
  changed_.clear();
  for (int b = 0; b < blocks; ++b)
    if (touched_[b]) changed_.push_back(b);
  ++frame_;
  return changed_;
}

void EvidenceVolume::prefetch_block(int block) const {
  std::size_t first;
  const BlockRows rows = blocks_.rows(block, &first);
  prefetch_rows(&log_ratio_[first], rows);
  prefetch_rows(&weight_[first], rows);
}

bool EvidenceVolume::fuse_block(int block, const EvidenceTerm<float>& term, const BlockSight& sight,
                                const EvidenceImage& image, const FrameColors& colors,
                                const EvidenceOptions& options) {
  std::size_t first;
  const BlockRows rows = blocks_.rows(block, &first);
  const BlockPlace place = sight.place(block);
  float distance[kBlock * kBlock * kBlock];
  const BlockChange change =
      for_isa<VoxelOps>(used_isa())
          .fuse(term, place, rows, options.max_weight, &log_ratio_[first], &weight_[first], distance);
  empty_[block] = change.empty;
  unsigned char& spoken = spoken_[block];
  if (change.near && spoken < kKnownFrames) ++spoken;
  const float reach = options.color_reach_voxels * float(grid().voxel_m);
  for (int row = 0; row < rows.ny * rows.nz; ++row)
    if (change.near >> row & 1)
      color_row(term, image, colors, place.at(rows, row), place.x.cast<float>(), rows.nx,
                distance + kBlock * row, reach, first + rows.offset(row));
  turned_[block] = change.turned;
  return change.near || change.turned || change.inside;
}

// The voxels of a row that lie within reach of a measurement take its colour.
void EvidenceVolume::color_row(const EvidenceTerm<float>& term, const EvidenceImage& image,
                               const FrameColors& colors, Vec3f p_cam, Vec3f step_cam, int count,
                               const float* distance_m, float reach_m, std::size_t at) {
  for (int k = 0; k < count; ++k) {
    if (!(std::abs(distance_m[k]) < reach_m)) continue;
    const std::size_t j = colored_pixel(term, p_cam + float(k) * step_cam);
    const float slant = image.pixels()[j].slant;
    colors_[at + std::size_t(k)].add(color_of(colors.rgb, image.source()[j]), slant * slant);
  }
}

}  // namespace sdftrack::levelset

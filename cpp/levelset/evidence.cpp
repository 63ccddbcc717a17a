// SPDX-License-Identifier: MIT
#include "levelset/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "levelset/voxel_ops.h"

namespace sdftrack {

namespace {

constexpr int kBlocksAtOnce = 64;
constexpr float kSurelyEmpty = 0.9f;  // of the mean ratio before a surface
constexpr float kLeastWeight = 4;     // frames after which a voxel needs no more free space

int blocks_along(int n) { return (n + EvidenceVolume::kBlock - 1) / EvidenceVolume::kBlock; }

std::uint16_t mixed(std::uint16_t before, unsigned char now, float share) {
  const float x =
      static_cast<float>(before) + share * (256.0f * static_cast<float>(now) - static_cast<float>(before));
  return static_cast<std::uint16_t>(x + 0.5f);
}

}  // namespace

EvidenceVolume::EvidenceVolume(const Grid& grid, std::vector<float> prior)
    : grid_(grid),
      bx_(blocks_along(grid.nx)),
      by_(blocks_along(grid.ny)),
      bz_(blocks_along(grid.nz)),
      log_ratio_(std::move(prior)),
      weight_(grid.size()),
      colors_(grid.size()),
      empty_(static_cast<std::size_t>(bx_) * static_cast<std::size_t>(by_) * static_cast<std::size_t>(bz_)) {
  log_ratio_.resize(grid.size());
}

EvidenceVolume EvidenceVolume::padded(const std::array<int, 3>& before,
                                      const std::array<int, 3>& after) const {
  Grid grid = grid_;
  grid.nx += kBlock * (before[0] + after[0]);
  grid.ny += kBlock * (before[1] + after[1]);
  grid.nz += kBlock * (before[2] + after[2]);
  grid.origin_obj = grid_.point(-kBlock * before[0], -kBlock * before[1], -kBlock * before[2]);
  EvidenceVolume larger(grid, {});
  for (int z = 0; z < grid_.nz; ++z)
    for (int y = 0; y < grid_.ny; ++y) {
      const auto from = static_cast<std::ptrdiff_t>(grid_.index(0, y, z)),
                 to = static_cast<std::ptrdiff_t>(
                     grid.index(kBlock * before[0], y + kBlock * before[1], z + kBlock * before[2]));
      std::copy_n(log_ratio_.begin() + from, grid_.nx, larger.log_ratio_.begin() + to);
      std::copy_n(weight_.begin() + from, grid_.nx, larger.weight_.begin() + to);
      std::copy_n(colors_.begin() + from, grid_.nx, larger.colors_.begin() + to);
    }
  return larger;
}

void EvidenceVolume::find_tiles(const EvidenceImage& image, float reach_m) {
  tiles_x_ = (image.width() + kTile - 1) / kTile, tiles_y_ = (image.height() + kTile - 1) / kTile;
  const std::size_t count = static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y_);
  tiles_.assign(count, {std::numeric_limits<float>::max(), 0});
  const EvidencePixel* pixel = image.pixels().data();
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x, ++pixel) {
      if (pixel->slant == 0) continue;
      Tile& tile = tiles_[static_cast<std::size_t>(y / kTile) * static_cast<std::size_t>(tiles_x_) +
                          static_cast<std::size_t>(x / kTile)];
      const float behind = pixel->slant > 0 ? reach_m / pixel->slant : 0.0f;
      tile.near_m = std::min(tile.near_m, pixel->depth_m);
      tile.last_m = std::max(tile.last_m, pixel->depth_m + behind);
    }
}

// Whether any reading before or around which the block lies can say something about it.
bool EvidenceVolume::touches(int block, const Rigidd& T_cam_obj, const Camera& camera,
                             const EvidenceImage& image, const EvidenceOptions& options) const {
  const int ix = block % bx_, iy = block / bx_ % by_, iz = block / (bx_ * by_);
  const Vec3d middle = T_cam_obj * (grid_.point(kBlock * ix, kBlock * iy, kBlock * iz) +
                                    grid_.voxel_m * 0.5 * (kBlock - 1) * Vec3d{1, 1, 1});
  const double radius = grid_.voxel_m * 0.5 * (kBlock - 1) * std::sqrt(3.0);
  if (middle.z < radius + 0.01) return middle.z > -radius;
  const double u = camera.K.fx * middle.x / middle.z + camera.K.cx - image.rect().x0,
               v = camera.K.fy * middle.y / middle.z + camera.K.cy - image.rect().y0;
  const double reach = std::max(camera.K.fx, camera.K.fy) * radius / (middle.z - radius) * 1.1 + 1;
  const int x0 = std::max(0, static_cast<int>(std::floor((u - reach) / kTile))),
            x1 = std::min(tiles_x_ - 1, static_cast<int>(std::floor((u + reach) / kTile)));
  const int y0 = std::max(0, static_cast<int>(std::floor((v - reach) / kTile))),
            y1 = std::min(tiles_y_ - 1, static_cast<int>(std::floor((v + reach) / kTile)));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Tile& tile = tiles_[static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles_x_) +
                                static_cast<std::size_t>(x)];
      if (tile.last_m == 0 || middle.z - radius > tile.last_m) continue;
      const bool only_past = middle.z + radius < tile.near_m - 2 * options.form.sigma_d_m;
      if (!only_past || !empty_[static_cast<std::size_t>(block)]) return true;
    }
  return false;
}

const std::vector<int>& EvidenceVolume::fuse(const EvidenceImage& image, const FrameColors& colors,
                                             const Camera& camera, const Rigidd& T_cam_obj,
                                             const EvidenceOptions& options, int threads) {
  find_tiles(image, kReachPerSigma * options.form.sigma_d_m);
  const EvidenceTerm<float> term{reinterpret_cast<const float*>(image.pixels().data()),
                                 image.rect().x0,
                                 image.rect().y0,
                                 image.width(),
                                 image.height(),
                                 camera.K.cast<float>(),
                                 options.form,
                                 options.noise,
                                 options.carve_from_m,
                                 options.least_slant};
  const int blocks = bx_ * by_ * bz_;
  touched_.assign(static_cast<std::size_t>(blocks), 0);
  parallel_for(static_cast<std::size_t>((blocks + kBlocksAtOnce - 1) / kBlocksAtOnce), threads,
               [&](std::size_t chunk) {
                 const int first = static_cast<int>(chunk) * kBlocksAtOnce,
                           last = std::min(blocks, first + kBlocksAtOnce);
                 for (int b = first; b < last; ++b)
                   if (touches(b, T_cam_obj, camera, image, options)) {
                     touched_[static_cast<std::size_t>(b)] =
                         fuse_block(b, term, image, colors, T_cam_obj, options);
                   }
               });
  changed_.clear();
  for (int b = 0; b < blocks; ++b)
    if (touched_[static_cast<std::size_t>(b)]) changed_.push_back(b);
  return changed_;
}

bool EvidenceVolume::fuse_block(int block, const EvidenceTerm<float>& term, const EvidenceImage& image,
                                const FrameColors& colors, const Rigidd& T_cam_obj,
                                const EvidenceOptions& options) {
  const int x0 = kBlock * (block % bx_), y0 = kBlock * (block / bx_ % by_),
            z0 = kBlock * (block / (bx_ * by_));
  const int count = std::min(kBlock, grid_.nx - x0);
  const Vec3f step = (grid_.voxel_m * (T_cam_obj.R * Vec3d{1, 0, 0})).cast<float>();
  const float reach = options.color_reach_voxels * static_cast<float>(grid_.voxel_m);
  const VoxelOps& ops = voxel_ops_for(used_isa());
  float distance[kBlock];
  bool empty = true, changed = false;
  for (int z = z0; z < std::min(z0 + kBlock, grid_.nz); ++z)
    for (int y = y0; y < std::min(y0 + kBlock, grid_.ny); ++y) {
      const std::size_t at = grid_.index(x0, y, z);
      const Vec3f first = (T_cam_obj * grid_.point(x0, y, z)).cast<float>();
      const RowChange change =
          ops.fuse(term, first, step, count, options.most_weight, &log_ratio_[at], &weight_[at], distance);
      changed |= change.near || change.turned || change.inside;
      empty = empty && !change.near && surely_empty(at, count);
      if (!change.near) continue;
      for (int k = 0; k < count; ++k) {
        const std::size_t i = at + static_cast<std::size_t>(k);
        if (!(std::abs(distance[k]) < reach)) continue;
        const Vec3f p = first + static_cast<float>(k) * step;
        const Vec2f u = project(term.K, p);
        const int px = static_cast<int>(u.x - static_cast<float>(term.x0) + 0.5f),
                  py = static_cast<int>(u.y - static_cast<float>(term.y0) + 0.5f);
        const std::size_t j = static_cast<std::size_t>(py) * static_cast<std::size_t>(image.width()) +
                              static_cast<std::size_t>(px);
        const float slant = image.pixels()[j].slant;
        add_color(i, colors.rgb ? colors.rgb + 3 * image.source()[j] : nullptr, slant * slant);
      }
    }
  empty_[static_cast<std::size_t>(block)] = empty;
  return changed;
}

bool EvidenceVolume::surely_empty(std::size_t at, int count) const {
  constexpr float kMean = kSurelyEmpty * kCarvedRatio / kCarvedWeight;
  bool yes = true;
  for (std::size_t i = at; i < at + static_cast<std::size_t>(count); ++i)
    yes &= (weight_[i] >= kLeastWeight * kCarvedWeight) & (log_ratio_[i] < kMean * weight_[i]);
  return yes;
}

void EvidenceVolume::add_color(std::size_t voxel, const unsigned char* rgb, float weight) {
  constexpr float kMost = 65535.0f / kSeenScale;
  Color& color = colors_[voxel];
  const float sum = seen(voxel) + weight, share = weight / sum;
  color.seen = static_cast<std::uint16_t>(std::max(1.0f, std::min(kMost, sum) * kSeenScale + 0.5f));
  if (rgb)
    color.r = mixed(color.r, rgb[0], share), color.g = mixed(color.g, rgb[1], share),
    color.b = mixed(color.b, rgb[2], share);
}

}  // namespace sdftrack

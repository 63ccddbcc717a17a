// SPDX-License-Identifier: MIT
#include "levelset/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/to_int.h"
#include "levelset/voxel_ops.h"

namespace sdftrack::levelset {

namespace {

constexpr int kBlocksAtOnce = 64;
constexpr int kKnownFrames = 30;  // that have spoken of a block
constexpr int kRestTogether = 4;  // blocks along each axis that take the same frames
int blocks_along(int n) { return (n + EvidenceVolume::kBlock - 1) / EvidenceVolume::kBlock; }

std::uint16_t mixed(std::uint16_t before, unsigned char now, float share) {
  const float x =
      static_cast<float>(before) + share * (256.0f * static_cast<float>(now) - static_cast<float>(before));
  return static_cast<std::uint16_t>(x + 0.5f);
}

}  // namespace

EvidenceVolume::EvidenceVolume(const sdf::Grid& grid, const float* prior)
    : grid_(grid),
      bx_(blocks_along(grid.nx)),
      by_(blocks_along(grid.ny)),
      bz_(blocks_along(grid.nz)),
      log_ratio_(grid.size()),
      weight_(grid.size()),
      colors_(grid.size()),
      empty_(static_cast<std::size_t>(bx_) * static_cast<std::size_t>(by_) * static_cast<std::size_t>(bz_)),
      spoken_(empty_.size()),
      turned_(empty_.size(), 1) {
  if (prior) std::copy_n(prior, grid.size(), log_ratio_.begin());
}

EvidenceVolume EvidenceVolume::padded(const std::array<int, 3>& before,
                                      const std::array<int, 3>& after) const {
  sdf::Grid grid = grid_;
  grid.nx += kBlock * (before[0] + after[0]);
  grid.ny += kBlock * (before[1] + after[1]);
  grid.nz += kBlock * (before[2] + after[2]);
  grid.origin_obj = grid_.point(-kBlock * before[0], -kBlock * before[1], -kBlock * before[2]);
  EvidenceVolume larger(grid, nullptr);
  for (int z = 0; z < grid_.nz; ++z)
    for (int y = 0; y < grid_.ny; ++y) {
      const auto from = static_cast<std::ptrdiff_t>(grid_.index(0, y, z)),
                 to = static_cast<std::ptrdiff_t>(
                     grid.index(kBlock * before[0], y + kBlock * before[1], z + kBlock * before[2]));
      std::copy_n(log_ratio_.begin() + from, grid_.nx, larger.log_ratio_.begin() + to);
      std::copy_n(weight_.begin() + from, grid_.nx, larger.weight_.begin() + to);
      std::copy_n(colors_.begin() + from, grid_.nx, larger.colors_.begin() + to);
    }
  for (int b = 0; b < static_cast<int>(spoken_.size()); ++b) {
    const int x = b % bx_ + before[0], y = b / bx_ % by_ + before[1], z = b / (bx_ * by_) + before[2];
    larger.spoken_[static_cast<std::size_t>((z * larger.by_ + y) * larger.bx_ + x)] =
        spoken_[static_cast<std::size_t>(b)];
  }
  larger.frame_ = frame_;
  return larger;
}

void EvidenceVolume::bound_guess(const std::function<bool(Vec3d p_obj)>& may_be_inside, int threads) {
  parallel_for(static_cast<std::size_t>(grid_.nz), threads, [&](std::size_t slice) {
    const int z = static_cast<int>(slice);
    for (int y = 0; y < grid_.ny; ++y)
      for (int x = 0; x < grid_.nx; ++x) {
        const std::size_t at = grid_.index(x, y, z);
        if (!(weight_[at] > 0) && log_ratio_[at] > 0 && !may_be_inside(grid_.point(x, y, z)))
          log_ratio_[at] = -log_ratio_[at];
      }
  });
}

void EvidenceVolume::find_tiles(const EvidenceImage& image, float reach_m) {
  tiles_x_ = (image.width() + kTile - 1) / kTile, tiles_y_ = (image.height() + kTile - 1) / kTile;
  const std::size_t count = static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y_);
  tiles_.assign(count, {std::numeric_limits<float>::max(), 0, 0});
  const EvidencePixel* pixel = image.pixels().data();
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x, ++pixel) {
      if (pixel->slant == 0) continue;
      Tile& tile = tiles_[static_cast<std::size_t>(y / kTile) * static_cast<std::size_t>(tiles_x_) +
                          static_cast<std::size_t>(x / kTile)];
      tile.last_m = std::max(tile.last_m, pixel->depth_m);
      if (pixel->slant < 0) continue;
      const float reach = reach_m / pixel->slant;
      tile.surface_from_m = std::min(tile.surface_from_m, pixel->depth_m - reach);
      tile.surface_to_m = std::max(tile.surface_to_m, pixel->depth_m + reach);
    }
}

// Whether any reading before or around which the block lies can say something about it.
bool EvidenceVolume::touches(int block, const Rigidd& T_cam_obj, const Camera& camera,
                             const EvidenceImage& image) const {
  const int ix = block % bx_, iy = block / bx_ % by_, iz = block / (bx_ * by_);
  const Vec3d middle = T_cam_obj * (grid_.point(kBlock * ix, kBlock * iy, kBlock * iz) +
                                    grid_.voxel_m * 0.5 * (kBlock - 1) * Vec3d{1, 1, 1});
  const double radius = grid_.voxel_m * 0.5 * (kBlock - 1) * std::sqrt(3.0);
  if (middle.z < radius + 0.01) return middle.z > -radius;
  const double u = camera.K.fx * middle.x / middle.z + camera.K.cx - image.rect().x0,
               v = camera.K.fy * middle.y / middle.z + camera.K.cy - image.rect().y0;
  const double reach = std::max(camera.K.fx, camera.K.fy) * radius / (middle.z - radius) * 1.1 + 1;
  const int x0 = std::max(0, to_int(std::floor((u - reach) / kTile))),
            x1 = std::min(tiles_x_ - 1, to_int(std::floor((u + reach) / kTile)));
  const int y0 = std::max(0, to_int(std::floor((v - reach) / kTile))),
            y1 = std::min(tiles_y_ - 1, to_int(std::floor((v + reach) / kTile)));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Tile& tile = tiles_[static_cast<std::size_t>(y) * static_cast<std::size_t>(tiles_x_) +
                                static_cast<std::size_t>(x)];
      const double from = middle.z - radius, to = middle.z + radius;
      if (from < tile.surface_to_m && to > tile.surface_from_m) return true;
      if (from < tile.last_m && !empty_[static_cast<std::size_t>(block)]) return true;
    }
  return false;
}

// What many frames have spoken of changes little with one more: it takes each `known_every`-th, neighbours
// mostly the same one, for the work at a surface is shared by the blocks on both sides of it.
bool EvidenceVolume::rests(int block, const EvidenceOptions& options) const {
  if (spoken_[static_cast<std::size_t>(block)] < kKnownFrames) return false;
  const int group =
      block % bx_ / kRestTogether + block / bx_ % by_ / kRestTogether + block / (bx_ * by_) / kRestTogether;
  return (group + frame_) % options.known_every != 0;
}

const std::vector<int>& EvidenceVolume::fuse(const EvidenceImage& image, const FrameColors& colors,
                                             const Camera& camera, const Rigidd& T_cam_obj,
                                             const EvidenceOptions& options, int threads) {
  const float reach = options.form.printed ? kPrintedReach + 1 : kReachPerSigma;
  find_tiles(image, reach * options.form.sigma_d_m);
  const EvidenceTerm<float> term{reinterpret_cast<const float*>(image.pixels().data()),
                                 image.rect().x0,
                                 image.rect().y0,
                                 image.width(),
                                 image.height(),
                                 camera.K.cast<float>(),
                                 options.form,
                                 options.noise,
                                 options.carve_from_m,
                                 options.min_slant};
  const int blocks = bx_ * by_ * bz_;
  touched_.assign(static_cast<std::size_t>(blocks), 0);

  parallel_for(static_cast<std::size_t>((blocks + kBlocksAtOnce - 1) / kBlocksAtOnce), threads,
               [&](std::size_t chunk) {
                 const int first = static_cast<int>(chunk) * kBlocksAtOnce,
                           last = std::min(blocks, first + kBlocksAtOnce);
                 int here[kBlocksAtOnce], n = 0;
                 for (int b = first; b < last; ++b)
                   if (!rests(b, options) && touches(b, T_cam_obj, camera, image)) here[n++] = b;
                 for (int k = 0; k < n; ++k) {
                   prefetch_block(here[std::min(k + 1, n - 1)]);
                   touched_[static_cast<std::size_t>(here[k])] =
                       fuse_block(here[k], term, image, colors, T_cam_obj, options);
                 }
               });
  changed_.clear();
  for (int b = 0; b < blocks; ++b)
    if (touched_[static_cast<std::size_t>(b)]) changed_.push_back(b);
  ++frame_;
  return changed_;
}

BlockRows EvidenceVolume::rows_of(int block, std::size_t* first) const {
  const int x = kBlock * (block % bx_), y = kBlock * (block / bx_ % by_), z = kBlock * (block / (bx_ * by_));
  *first = grid_.index(x, y, z);
  return {std::min(kBlock, grid_.nx - x), std::min(kBlock, grid_.ny - y), std::min(kBlock, grid_.nz - z),
          grid_.nx, grid_.nx * grid_.ny};
}

void EvidenceVolume::prefetch_block(int block) const {
  std::size_t first;
  const BlockRows rows = rows_of(block, &first);
  prefetch_rows(&log_ratio_[first], rows);
  prefetch_rows(&weight_[first], rows);
}

bool EvidenceVolume::fuse_block(int block, const EvidenceTerm<float>& term, const EvidenceImage& image,
                                const FrameColors& colors, const Rigidd& T_cam_obj,
                                const EvidenceOptions& options) {
  std::size_t first;
  const BlockRows rows = rows_of(block, &first);
  const Vec3d corner =
      grid_.point(kBlock * (block % bx_), kBlock * (block / bx_ % by_), kBlock * (block / (bx_ * by_)));
  const auto step = [&](Vec3d axis) { return grid_.voxel_m * (T_cam_obj.R * axis); };
  const BlockPlace place{T_cam_obj * corner, step({1, 0, 0}), step({0, 1, 0}), step({0, 0, 1})};
  float distance[kBlock * kBlock * kBlock];
  const BlockChange change =
      voxel_ops_for(used_isa())
          .fuse(term, place, rows, options.max_weight, &log_ratio_[first], &weight_[first], distance);
  empty_[static_cast<std::size_t>(block)] = change.empty;
  unsigned char& spoken = spoken_[static_cast<std::size_t>(block)];
  if (change.near && spoken < kKnownFrames) ++spoken;
  const float reach = options.color_reach_voxels * static_cast<float>(grid_.voxel_m);
  for (int row = 0; row < rows.ny * rows.nz; ++row)
    if (change.near >> row & 1)
      color_row(term, image, colors, place.at(rows, row), place.x.cast<float>(), rows.nx,
                distance + kBlock * row, reach, first + rows.offset(row));
  turned_[static_cast<std::size_t>(block)] = change.turned;
  return change.near || change.turned || change.inside;
}

// The voxels of a row that lie within reach of a reading take its colour.
void EvidenceVolume::color_row(const EvidenceTerm<float>& term, const EvidenceImage& image,
                               const FrameColors& colors, Vec3f p_cam, Vec3f step_cam, int count,
                               const float* distance_m, float reach_m, std::size_t at) {
  for (int k = 0; k < count; ++k) {
    if (!(std::abs(distance_m[k]) < reach_m)) continue;
    const Vec2f u = project(term.K, p_cam + static_cast<float>(k) * step_cam);
    const int px = to_int_within(u.x - static_cast<float>(term.x0) + 0.5f, 0, image.width() - 1),
              py = to_int_within(u.y - static_cast<float>(term.y0) + 0.5f, 0, image.height() - 1);
    const std::size_t j =
        static_cast<std::size_t>(py) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(px);
    const float slant = image.pixels()[j].slant;
    add_color(at + static_cast<std::size_t>(k), colors.rgb ? colors.rgb + 3 * image.source()[j] : nullptr,
              slant * slant);
  }
}

void EvidenceVolume::add_color(std::size_t voxel, const unsigned char* rgb, float weight) {
  constexpr float kMost = 65535.0f / kSeenScale;
  Color& color = colors_[voxel];
  const float sum = seen(voxel) + weight, share = weight / sum;
  color.seen = static_cast<std::uint16_t>(std::max(1.0f, std::min(kMost, sum) * kSeenScale + 0.5f));
  if (!rgb || !(rgb[0] | rgb[1] | rgb[2])) return;  // seen, but not by the colour camera
  if (!(color.r | color.g | color.b))
    color.r = mixed(0, rgb[0], 1), color.g = mixed(0, rgb[1], 1), color.b = mixed(0, rgb[2], 1);
  else
    color.r = mixed(color.r, rgb[0], share), color.g = mixed(color.g, rgb[1], share),
    color.b = mixed(color.b, rgb[2], share);
}

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
// A volume as blocks of 8^3 voxels: which may have evidence of a frame, and the colours that it adds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/rigid.h"
#include "base/to_int.h"
#include "levelset/eikonal_terms.h"
#include "levelset/evidence_image.h"
#include "levelset/voxel_ops.h"
#include "sdf/grid.h"

namespace sdftrack::levelset {

constexpr int kBlockVoxels = kBlockSide * kBlockSide * kBlockSide;

HD int blocks_along(int n) { return (n + kBlockSide - 1) / kBlockSide; }

// The place of voxel `t` in a block, counted along x, then y, then z.
struct VoxelPlace {
  int x, y, z;
  HD explicit VoxelPlace(int t)
      : x(t % kBlockSide), y(t / kBlockSide % kBlockSide), z(t / (kBlockSide * kBlockSide)) {}
};

// Half-open box of voxels.
struct VoxelRange {
  int x0, x1, y0, y1, z0, z1;
};

// Blocks are counted like voxels: along x, then y, then z.
struct BlockLattice {
  sdf::Grid grid;
  int bx, by, bz;

  HD explicit BlockLattice(const sdf::Grid& of)
      : grid(of), bx(blocks_along(of.nx)), by(blocks_along(of.ny)), bz(blocks_along(of.nz)) {}
  HD int count() const { return bx * by * bz; }
  HD int x(int block) const { return block % bx; }
  HD int y(int block) const { return block / bx % by; }
  HD int z(int block) const { return block / (bx * by); }
  HD Vec3d corner(int block) const {
    return grid.point(kBlockSide * x(block), kBlockSide * y(block), kBlockSide * z(block));
  }
  // The block's voxels, and the index of the first one.
  HD BlockRows rows(int block, std::size_t* first) const {
    const int vx = kBlockSide * x(block), vy = kBlockSide * y(block), vz = kBlockSide * z(block);
    *first = grid.index(vx, vy, vz);
    return {least(kBlockSide, grid.nx - vx), least(kBlockSide, grid.ny - vy), least(kBlockSide, grid.nz - vz),
            grid.nx, grid.nx * grid.ny};
  }
  // The block's voxels except those at the volume's border.
  HD VoxelRange inner(int block) const {
    const int vx = kBlockSide * x(block), vy = kBlockSide * y(block), vz = kBlockSide * z(block);
    return {most(1, vx), least(grid.nx - 1, vx + kBlockSide),
            most(1, vy), least(grid.ny - 1, vy + kBlockSide),
            most(1, vz), least(grid.nz - 1, vz + kBlockSide)};
  }
  // The block and its neighbours, by their places along the axes.
  HD VoxelRange around(int block) const {
    return {most(0, x(block) - 1),   least(bx, x(block) + 2), most(0, y(block) - 1),
            least(by, y(block) + 2), most(0, z(block) - 1),   least(bz, z(block) + 2)};
  }
  HD int at(int ix, int iy, int iz) const { return (iz * by + iy) * bx + ix; }
  // The block's set, one of eight in which no two blocks are neighbours.
  HD int color(int block) const { return (x(block) & 1) | (y(block) & 1) << 1 | (z(block) & 1) << 2; }
};

// A tile of kTile x kTile pixels of an evidence image: the range of depths with evidence on its surface, and
// the farthest measurement, in front of which it may be empty; 0: there is none.
constexpr int kTile = 4;
struct Tile {
  float surface_from_m, surface_to_m, last_m;

  static HD Tile empty() { return {kLargest_m, 0, 0}; }
  // reach_m: how far from a measurement, along the normal, there is evidence.
  HD void add(const EvidencePixel& pixel, float reach_m) {
    if (pixel.slant == 0) return;
    last_m = most(last_m, pixel.depth_m);
    if (pixel.slant < 0) return;
    const float reach = reach_m / pixel.slant;
    surface_from_m = least(surface_from_m, pixel.depth_m - reach);
    surface_to_m = most(surface_to_m, pixel.depth_m + reach);
  }
};
HD int tiles_along(int pixels) { return (pixels + kTile - 1) / kTile; }
void find_tiles(const EvidenceImage& image, float reach_m, std::vector<Tile>* tiles);

constexpr int kKnownFrames = 30;  // frames with evidence after which a block is known
constexpr int kRestTogether = 4;  // blocks along each axis that share their frames

// The view of a frame on the blocks.
struct BlockSight {
  BlockLattice blocks;
  Rigidd T_cam_obj;
  Intrinsics<double> K;
  int x0, y0, tiles_x, tiles_y;
  const Tile* tiles;
  int frame, known_every;

  // Whether any measurement can have evidence on the block; empty: the block is known to be empty.
  HD bool touches(int block, bool empty) const {
    const double voxel = blocks.grid.voxel_m;
    const Vec3d middle = T_cam_obj * (blocks.corner(block) + voxel * 0.5 * (kBlockSide - 1) * Vec3d{1, 1, 1});
    const double radius = voxel * 0.5 * (kBlockSide - 1) * sqrt(3.0);
    if (middle.z < radius + 0.01) return middle.z > -radius;
    const double u = K.fx * middle.x / middle.z + K.cx - x0, v = K.fy * middle.y / middle.z + K.cy - y0;
    const double reach = most(K.fx, K.fy) * radius / (middle.z - radius) * 1.1 + 1;
    const int first_x = most(0, to_int(std::floor((u - reach) / kTile))),
              last_x = least(tiles_x - 1, to_int(std::floor((u + reach) / kTile)));
    const int first_y = most(0, to_int(std::floor((v - reach) / kTile))),
              last_y = least(tiles_y - 1, to_int(std::floor((v + reach) / kTile)));
    const double from = middle.z - radius, to = middle.z + radius;
    for (int y = first_y; y <= last_y; ++y)
      for (int x = first_x; x <= last_x; ++x) {
        const Tile& tile = tiles[std::size_t(y) * tiles_x + x];
        if (from < tile.surface_to_m && to > tile.surface_from_m) return true;
        if (from < tile.last_m && !empty) return true;
      }
    return false;
  }

  // One more frame changes a block with much evidence little: it takes every `known_every`-th frame.
  // Neighbours mostly take the same frames, because they share work. spoken: frames so far.
  HD bool rests(int block, int spoken) const {
    if (spoken < kKnownFrames) return false;
    const int group =
        blocks.x(block) / kRestTogether + blocks.y(block) / kRestTogether + blocks.z(block) / kRestTogether;
    return (group + frame) % known_every != 0;
  }

  // The place of the block's voxels in the camera's frame.
  HD BlockPlace place(int block) const {
    const double voxel = blocks.grid.voxel_m;
    return {T_cam_obj * blocks.corner(block), voxel * (T_cam_obj.R * Vec3d{1, 0, 0}),
            voxel * (T_cam_obj.R * Vec3d{0, 1, 0}), voxel * (T_cam_obj.R * Vec3d{0, 0, 1})};
  }
};

// Mean colour (0..255) times 256, and the weight seen within reach of the surface, times kSeenScale.
constexpr float kSeenScale = 256;
struct VoxelColor {
  std::uint16_t r, g, b, seen;

  HD float seen_sum() const { return float(seen) / kSeenScale; }
  // rgb: nullptr, or black, where the colour camera has not seen the voxel.
  HD void add(const unsigned char* rgb, float weight) {
    constexpr float kMost = 65535.0f / kSeenScale;
    const float sum = seen_sum() + weight, share = weight / sum;
    seen = static_cast<std::uint16_t>(most(1.0f, least(kMost, sum) * kSeenScale + 0.5f));
    if (!rgb || !(rgb[0] | rgb[1] | rgb[2])) return;
    const float part = r | g | b ? share : 1;
    r = mixed(r, rgb[0], part), g = mixed(g, rgb[1], part), b = mixed(b, rgb[2], part);
  }

 private:
  HD static std::uint16_t mixed(std::uint16_t before, unsigned char now, float share) {
    const float x = float(before) + share * (256.0f * float(now) - float(before));
    return static_cast<std::uint16_t>(x + 0.5f);
  }
};

// The colour of the pixel measured at `source`; nullptr: not known.
HD const unsigned char* color_of(const unsigned char* rgb, int source) {
  return rgb && source >= 0 ? rgb + 3 * std::ptrdiff_t(source) : nullptr;
}

// The pixel of an evidence image that gives a voxel its colour.
HD std::size_t colored_pixel(const EvidenceTerm<float>& term, Vec3f p_cam) {
  const Vec2f u = project(term.K, p_cam);
  const int x = to_int_within(u.x - float(term.x0) + 0.5f, 0, term.width - 1),
            y = to_int_within(u.y - float(term.y0) + 0.5f, 0, term.height - 1);
  return std::size_t(y) * term.width + x;
}

}  // namespace sdftrack::levelset

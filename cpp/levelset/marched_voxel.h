// SPDX-License-Identifier: MIT
// Marching cubes by blocks of voxels: the data of each voxel, with the three edges and the cell that start at
// it. Vertices and faces are numbered by block, then by voxel, on the CPU and on a GPU.
#pragma once

#include "levelset/cube_cases.h"
#include "levelset/evidence_blocks.h"

namespace sdftrack::levelset {

// A tile: a block's voxels and the next ones along each axis.
constexpr int kTileSide = kBlockSide + 1, kTileVoxels = kTileSide * kTileSide * kTileSide;

// Value k of a block's tile. Beyond the volume, its last voxels are repeated, so that no surface appears.
HD float tile_value(const BlockLattice& blocks, int b, int k, const float* phi) {
  const sdf::Grid& grid = blocks.grid;
  return phi[grid.index(least(grid.nx - 1, kBlockSide * blocks.x(b) + k % kTileSide),
                        least(grid.ny - 1, kBlockSide * blocks.y(b) + k / kTileSide % kTileSide),
                        least(grid.nz - 1, kBlockSide * blocks.z(b) + k / (kTileSide * kTileSide)))];
}

// Counts of a block or a voxel: vertices in the lower half, faces in the upper half.
constexpr int kOneFace = 1 << 16;
HD int vertices_of(int packed) { return packed % kOneFace; }
HD int faces_of(int packed) { return packed / kOneFace; }

// The number of a voxel's cut edges on axes before `axis`. edges: the cut ones, a bit per axis.
HD int cut_edges_before(int edges, int axis) {
  const int before = edges & ((1 << axis) - 1);
  return (before & 1) + (before >> 1 & 1);
}

// A voxel's first vertex among those of its block, and in the last three bits its cut edges.
using VoxelVertices = std::uint16_t;
HD int vertex_of(VoxelVertices own, int axis) { return (own >> 3) + cut_edges_before(own & 7, axis); }

struct MarchedVoxel {
  int x, y, z;  // in the volume
  int edges = 0, inside = 0;
  bool has_cell = false;
  const float* at;  // in the tile

  HD MarchedVoxel(const BlockLattice& blocks, int b, int t, const float* tile) {
    const sdf::Grid& grid = blocks.grid;
    const VoxelPlace place(t);
    x = kBlockSide * blocks.x(b) + place.x, y = kBlockSide * blocks.y(b) + place.y,
    z = kBlockSide * blocks.z(b) + place.z;
    at = tile + (place.z * kTileSide + place.y) * kTileSide + place.x;
    if (x >= grid.nx || y >= grid.ny || z >= grid.nz) return;
    has_cell = x + 1 < grid.nx && y + 1 < grid.ny && z + 1 < grid.nz;
    for (int corner = 0; corner < 8; ++corner) inside |= is_inside(value(corner)) ? 1 << corner : 0;
    for (int axis = 0; axis < 3; ++axis)
      if ((inside & 1) != (inside >> (1 << axis) & 1)) edges |= 1 << axis;
  }
  HD float value(int corner) const {
    return at[((corner >> 2) * kTileSide + (corner >> 1 & 1)) * kTileSide + (corner & 1)];
  }
  HD int vertices() const { return cut_edges_before(edges, 2) + (edges >> 2); }
  HD int faces(const CubeCase* cases) const { return has_cell ? cases[inside].triangles : 0; }
  HD int counts(const CubeCase* cases) const { return vertices() + faces(cases) * kOneFace; }
  HD VoxelVertices numbered(int first) const { return static_cast<VoxelVertices>(first << 3 | edges); }
  // Writes the voxel's vertices, from `out` on.
  HD void cut_edges(Vec3d* out) const {
    for (int axis = 0; axis < 3; ++axis) {
      if ((edges >> axis & 1) == 0) continue;
      const double cut = cut_between(value(0), value(1 << axis));
      *out++ = {x + (axis == 0 ? cut : 0.0), y + (axis == 1 ? cut : 0.0), z + (axis == 2 ? cut : 0.0)};
    }
  }
};

// Where an edge of a voxel's cell starts, possibly in another block.
struct VertexPlace {
  int block, voxel;
  HD VertexPlace(const BlockLattice& blocks, const MarchedVoxel& of, CubeEdge edge) {
    const int x = of.x + (edge.corner & 1), y = of.y + (edge.corner >> 1 & 1), z = of.z + (edge.corner >> 2);
    block = blocks.at(x / kBlockSide, y / kBlockSide, z / kBlockSide);
    voxel = ((z % kBlockSide) * kBlockSide + y % kBlockSide) * kBlockSide + x % kBlockSide;
  }
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
#include "levelset/zero_mesh.h"

#include "base/parallel.h"
#include "levelset/marched_voxel.h"

namespace sdftrack::levelset {

namespace {

// The numbers before a block; slot: its place among the blocks that have vertices or faces, else kNoVertex.
constexpr int kNoVertex = -1;
struct BlockStart {
  int vertex, face, slot;
};

struct Tile {
  float values[kTileVoxels];
  bool has_surface = false;

  Tile(const BlockLattice& blocks, int b, const float* phi) {
    int inside = 0;
    for (int k = 0; k < kTileVoxels; ++k) {
      values[k] = tile_value(blocks, b, k, phi);
      inside += is_inside(values[k]) ? 1 : 0;
    }
    has_surface = inside > 0 && inside < kTileVoxels;
  }
};

class March {
 public:
  March(const sdf::Grid& grid, const float* phi, int threads) : blocks_(grid), phi_(phi), threads_(threads) {}

  ZeroMesh mesh() {
    place_blocks();
    over_slots([this](int b, const BlockStart& start) { place_vertices(b, start); });
    over_slots([this](int b, const BlockStart& start) { place_faces(b, start); });
    return std::move(out_);
  }

 private:
  void place_blocks() {
    starts_.resize(blocks_.count());
    std::vector<int> counts(starts_.size(), 0);
    parallel_for(starts_.size(), threads_, [&](std::size_t b) { counts[b] = count(int(b)); });
    int vertices = 0, faces = 0;
    for (std::size_t b = 0; b < starts_.size(); ++b) {
      const bool some = counts[b] > 0;
      starts_[b] = {vertices, faces, some ? int(slots_.size()) : kNoVertex};
      if (some) slots_.push_back(int(b));
      vertices += vertices_of(counts[b]), faces += faces_of(counts[b]);
    }
    voxels_.resize(slots_.size() * kBlockVoxels);
    out_.vertices.resize(3 * std::size_t(vertices));
    out_.faces.resize(3 * std::size_t(faces));
  }

  int count(int b) const {
    const Tile tile(blocks_, b, phi_);
    int sum = 0;
    for (int t = 0; tile.has_surface && t < kBlockVoxels; ++t)
      sum += MarchedVoxel(blocks_, b, t, tile.values).counts(cases_.data());
    return sum;
  }

  template <class Place>
  void over_slots(const Place& place) {
    parallel_for(slots_.size(), threads_, [&](std::size_t slot) {
      const int b = slots_[slot];
      place(b, starts_[b]);
    });
  }

  VoxelVertices& voxel(int slot, int t) { return voxels_[std::size_t(slot) * kBlockVoxels + t]; }

  void place_vertices(int b, const BlockStart& start) {
    const Tile tile(blocks_, b, phi_);
    int first = 0;
    for (int t = 0; t < kBlockVoxels; ++t) {
      const MarchedVoxel marched(blocks_, b, t, tile.values);
      voxel(start.slot, t) = marched.numbered(first);
      Vec3d cut[3];
      marched.cut_edges(cut);
      for (int k = 0; k < marched.vertices(); ++k, ++first) {
        double* const to = out_.vertices.data() + 3 * std::ptrdiff_t(start.vertex + first);
        to[0] = cut[k].x, to[1] = cut[k].y, to[2] = cut[k].z;
      }
    }
  }

  void place_faces(int b, const BlockStart& start) {
    const Tile tile(blocks_, b, phi_);
    std::int32_t* to = out_.faces.data() + 3 * std::ptrdiff_t(start.face);
    for (int t = 0; t < kBlockVoxels; ++t) {
      const MarchedVoxel marched(blocks_, b, t, tile.values);
      const CubeCase& cell = cases_[marched.inside];
      for (int k = 0; k < 3 * marched.faces(cases_.data()); ++k)
        *to++ = vertex_on(marched, cube_edge(cell.edges[k]));
    }
  }

  std::int32_t vertex_on(const MarchedVoxel& marched, CubeEdge edge) {
    const VertexPlace place(blocks_, marched, edge);
    const BlockStart& start = starts_[place.block];
    return start.vertex + vertex_of(voxel(start.slot, place.voxel), edge.axis);
  }

  BlockLattice blocks_;
  const float* phi_;
  int threads_;
  const std::array<CubeCase, kCubeCases> cases_ = make_cube_cases();
  std::vector<BlockStart> starts_;     // by block
  std::vector<int> slots_;             // their blocks
  std::vector<VoxelVertices> voxels_;  // by slot
  ZeroMesh out_;
};

}  // namespace

ZeroMesh zero_mesh(const sdf::Grid& grid, const float* phi, int threads) {
  return March(grid, phi, threads).mesh();
}

}  // namespace sdftrack::levelset

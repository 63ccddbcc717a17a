// SPDX-License-Identifier: MIT
#include "sdf/mesh/winding_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "base/parallel.h"
#include "sdf/bvh.h"
#include "sdf/crossings.h"
#include "sdf/mesh/mesh_edges.h"
#include "sdf/mesh/winding.h"

namespace sdftrack::sdf {

namespace {

constexpr int kGridBlock = 8;        // voxels a side
constexpr double kTreeError = 0.02;  // of a sum with dipoles
constexpr double kManyRims = 4;      // number of straight rims that may be adjacent

// The borders of the mesh: edges that are used more often in one direction than in the other.
struct Rims {
  std::vector<Face> edges;  // edges as faces without area
  double length_m = 0;
  std::optional<Bvh> nearest;

  explicit Rims(const MeshView& mesh) {
    for_each_edge(sorted_edges(mesh.faces, mesh.face_count), [&](const Edge* e, std::size_t n) {
      if (const auto balance = edge_balance(e, n)) {
        edges.push_back({e->low, e->high, e->high});
        length_m += double(std::abs(balance)) * norm(mesh.vertices[e->high] - mesh.vertices[e->low]);
      }
    });
    if (!edges.empty())
      nearest.emplace(MeshView{mesh.vertices, mesh.vertex_count, edges.data(), edges.size()});
  }

  // The largest change of the smooth part over a path of `way_m` within way_m of p. By Biot and Savart, the
  // gradient of the rims' field is at most length / (4 pi d^2), or 1 / (2 pi d) for a straight line.
  double change(Vec3d p, double way_m) const {
    if (!nearest) return 0;
    const double d = std::sqrt(nearest->closest(p).distance2) - way_m;
    if (d <= 0) return 1e300;
    return way_m *
           std::min(length_m / (4 * std::numbers::pi * d * d), kManyRims / (2 * std::numbers::pi * d));
  }
};

struct Filler {
  const Grid& grid;
  const WindingTree& tree;
  const Rims& rims;
  const std::vector<float>& u;
  const std::vector<std::int8_t>& crossed;
  std::vector<float>& w;

  struct Member {
    int x, y, z;
    int jump;  // relative to the first voxel of its piece
  };

  // Collects the voxels of the block reached from `seed`: along rows, with jumps counted, and across rows
  // where no triangle lies between, since the sum of its distances from both would be at most their spacing.
  void collect(const Vec3<int>& low, const Vec3<int>& high, const Vec3<int>& seed,
               std::array<std::uint8_t, kGridBlock * kGridBlock * kGridBlock>& seen,
               std::vector<Member>* piece) const {
    const auto local = [&](int x, int y, int z) {
      return std::size_t(((z - low.z) * kGridBlock + (y - low.y)) * kGridBlock + (x - low.x));
    };
    piece->assign(1, {seed.x, seed.y, seed.z, 0});
    seen[local(seed.x, seed.y, seed.z)] = 1;
    constexpr std::array<Vec3<int>, 6> kSteps{
        {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
    for (std::size_t next = 0; next < piece->size(); ++next) {
      const Member m = (*piece)[next];
      const std::size_t i = grid.index(m.x, m.y, m.z);
      for (const Vec3<int>& s : kSteps) {
        const int x = m.x + s.x, y = m.y + s.y, z = m.z + s.z;
        if (x < low.x || y < low.y || z < low.z || x >= high.x || y >= high.y || z >= high.z) continue;
        if (seen[local(x, y, z)]) continue;
        const std::size_t k = grid.index(x, y, z);
        if (!s.x && u[i] + u[k] <= 1.001 * grid.voxel_m) continue;
        seen[local(x, y, z)] = 1;
        const int jump = s.x ? crossed[k] - crossed[i] : 0;
        piece->push_back({x, y, z, m.jump + jump});
      }
    }
  }

  void block(const Vec3<int>& low, int side) const {
    const Vec3<int> high{std::min(low.x + side, grid.nx), std::min(low.y + side, grid.ny),
                         std::min(low.z + side, grid.nz)};
    const double way = 0.5 * std::numbers::sqrt3 * (side + 1) * grid.voxel_m;  // to a voxel past the corner
    const Vec3d middle =
        0.5 * (grid.point(low.x, low.y, low.z) + grid.point(high.x - 1, high.y - 1, high.z - 1));
    const double change = side > 1 ? 2 * rims.change(middle, way) : 0;
    bool sure = change < 0.5 - kTreeError;
    std::array<std::uint8_t, kGridBlock * kGridBlock * kGridBlock> seen{};
    std::vector<Member> piece;
    for (int z = low.z; z < high.z && sure; ++z)
      for (int y = low.y; y < high.y && sure; ++y)
        for (int x = low.x; x < high.x && sure; ++x) {
          const auto local = std::size_t(((z - low.z) * kGridBlock + (y - low.y)) * kGridBlock + (x - low.x));
          if (seen[local]) continue;
          collect(low, high, {x, y, z}, seen, &piece);
          sure = settle(piece, change) || side == 1;
        }
    if (sure) return;
    const int half = side / 2;
    for (int z = low.z; z < high.z; z += half)
      for (int y = low.y; y < high.y; y += half)
        for (int x = low.x; x < high.x; x += half) block({x, y, z}, half);
  }

  // One sum for a whole piece; false: some voxels may be on the other side of 1/2.
  bool settle(const std::vector<Member>& piece, double change) const {
    const Member& best = *std::max_element(piece.begin(), piece.end(), [&](const Member& a, const Member& b) {
      return u[grid.index(a.x, a.y, a.z)] < u[grid.index(b.x, b.y, b.z)];
    });
    const double number = tree(grid.point(best.x, best.y, best.z));
    for (const Member& m : piece) w[grid.index(m.x, m.y, m.z)] = float(number + m.jump - best.jump);
    const double beside = std::abs(number - std::floor(number) - 0.5);  // from the nearest half
    return beside > change + kTreeError;
  }
};

}  // namespace

std::vector<float> winding_of_open_mesh(const MeshView& mesh, const Grid& grid, const std::vector<float>& u,
                                        int threads) {
  const WindingTree tree(mesh);
  const Rims rims(mesh);
  const std::vector<std::int8_t> crossed = winding_numbers(mesh, grid, threads);
  std::vector<float> w(grid.size());
  const Filler filler{grid, tree, rims, u, crossed, w};
  const int ny = (grid.ny + kGridBlock - 1) / kGridBlock, nz = (grid.nz + kGridBlock - 1) / kGridBlock;
  parallel_for(std::size_t(ny) * nz, threads, [&](std::size_t chunk) {
    const int y = int(chunk) % ny * kGridBlock, z = int(chunk) / ny * kGridBlock;
    for (int x = 0; x < grid.nx; x += kGridBlock) filler.block({x, y, z}, kGridBlock);
  });
  return w;
}

}  // namespace sdftrack::sdf

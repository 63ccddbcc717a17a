// SPDX-License-Identifier: MIT
#include "base/device_pool.h"
#include "levelset/far_kernels.cuh"
#include "levelset/redistance.h"
#include "levelset/zero_mesh_kernels.cuh"
#include "sdf/redistance.h"
#include "sdf/sweep_terms.h"
#include "sdf/zero_set.h"

namespace sdftrack::levelset {

// The distance to the triangles of a zero set (sdf/zero_set.h). The triangles are sorted by block of voxels;
// each voxel takes the nearest one in its block and in the blocks around it. A block is wider than the band.

static_assert(sdf::kBandRedistanced <= kBlockSide);

// Calls visit(triangle) for the triangles of a thread's cell, with corners in voxels.
template <class Visit>
__device__ void cut_own_cell(const MarchedVoxel& voxel, const Visit& visit) {
  if (!voxel.has_cell) return;
  const float phi[8] = {voxel.value(0), voxel.value(1), voxel.value(2), voxel.value(3),
                        voxel.value(4), voxel.value(5), voxel.value(6), voxel.value(7)};
  int below = 0;
  for (const float value : phi) below += value < 0 ? 1 : 0;
  if (below > 0 && below < 8) sdf::zero_set::cut_cell(voxel.x, voxel.y, voxel.z, phi, visit);
}
__device__ inline int triangles_in(const MarchedVoxel& voxel) {
  int count = 0;
  cut_own_cell(voxel, [&count](const sdf::Triangle&) { ++count; });
  return count;
}

struct CountTriangles {
  static constexpr const char* kName = "redistance: count";
  __device__ int operator()(const MarchedVoxel& voxel) const { return triangles_in(voxel); }
};

// A triangle in metres, and the voxel of its block at which its cell starts.
struct CellTriangle {
  sdf::Triangle triangle;
  int cell;
};

struct PlaceTriangles {
  static constexpr const char* kName = "redistance: triangles";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const float* phi;
  BlockPlaces of;
  CellTriangle* triangles;
  __device__ void operator()() const {
    SDFTRACK_SHARED(float[kTileVoxels], tile);
    SDFTRACK_SHARED(int[kBlockVoxels], all);
    const int b = of.blocks[blockIdx.x];
    const MarchedVoxel voxel = marched_voxel(blocks, b, phi, tile);
    CellTriangle* out = triangles + of.vertex[b] + sum_before(triangles_in(voxel), all, kThreads);
    const Vec3d origin = blocks.grid.origin_obj;
    const double voxel_m = blocks.grid.voxel_m;
    cut_own_cell(voxel, [&](const sdf::Triangle& t) {
      *out++ = {{origin + voxel_m * t.a, origin + voxel_m * t.b, origin + voxel_m * t.c}, int(threadIdx.x)};
    });
  }
};

// The distance where a triangle is within the band, which sweeps keep; elsewhere none yet.
struct BandDistances {
  static constexpr const char* kName = "redistance: band";
  static constexpr int kThreads = kBlockVoxels;
  BlockLattice blocks;
  const int* counts;
  const int* first;  // index of a block's first triangle
  const CellTriangle* triangles;
  float *u, *other;  // two copies
  unsigned char* known;
  __device__ void operator()() const {
    const int b = int(blockIdx.x);
    const sdf::Grid& grid = blocks.grid;
    const VoxelPlace place(int(threadIdx.x));
    const int x = kBlockSide * blocks.x(b) + place.x, y = kBlockSide * blocks.y(b) + place.y,
              z = kBlockSide * blocks.z(b) + place.z;
    if (x >= grid.nx || y >= grid.ny || z >= grid.nz) return;
    const double band_m = sdf::kBandRedistanced * grid.voxel_m, band2 = band_m * band_m;
    double least2 = band2;
    const VoxelRange around = blocks.around(b);
    for (int bz = around.z0; bz < around.z1; ++bz)
      for (int by = around.y0; by < around.y1; ++by)
        for (int bx = around.x0; bx < around.x1; ++bx) {
          const int beside = blocks.at(bx, by, bz);
          if (counts[beside] > 0) look(beside, x, y, z, &least2);
        }
    const std::size_t i = grid.index(x, y, z);
    const bool near = least2 < band2;
    known[i] = near;
    u[i] = other[i] = near ? float(sqrt(least2)) : sdf::kUnreached;
  }

 private:
  // The number of voxels between place i and the range from `first` to first + wide.
  __device__ static int apart(int i, int first, int wide) {
    return i < first ? first - i : (i > first + wide ? i - first - wide : 0);
  }
  __device__ bool beyond(int dx, int dy, int dz, double reach2) const {
    const double voxel2 = blocks.grid.voxel_m * blocks.grid.voxel_m;
    return voxel2 * double(dx * dx + dy * dy + dz * dz) > reach2 * (1 + 1e-6);
  }
  __device__ void look(int block, int x, int y, int z, double* least2) const {
    const int x0 = kBlockSide * blocks.x(block), y0 = kBlockSide * blocks.y(block),
              z0 = kBlockSide * blocks.z(block);
    if (beyond(apart(x, x0, kBlockSide), apart(y, y0, kBlockSide), apart(z, z0, kBlockSide), *least2)) return;
    const Vec3d p = blocks.grid.point(x, y, z);
    for (int k = first[block], end = k + counts[block]; k < end; ++k) {
      const VoxelPlace cell(triangles[k].cell);
      if (beyond(apart(x, x0 + cell.x, 1), apart(y, y0 + cell.y, 1), apart(z, z0 + cell.z, 1), *least2))
        continue;
      const Vec3d d = p - sdf::closest_point(triangles[k].triangle, p);
      *least2 = least(*least2, dot(d, d));
    }
  }
};

struct SignDistances {
  static constexpr const char* kName = "redistance: signs";
  static constexpr int kThreads = kThreadsPerVoxels;
  std::size_t voxels;
  const float* phi;
  float* u;
  __device__ void operator()() const {
    const std::size_t i = std::size_t(blockIdx.x) * kThreads + threadIdx.x;
    if (i < voxels && phi[i] < 0) u[i] = -u[i];
  }
};

namespace {

constexpr int kSweepsAtOnce = 16;  // until the host checks convergence; an even number

struct Work {
  DeviceStream stream;
  DeviceBuffer<float> phi, u, other;
  DeviceBuffer<unsigned char> known;
  DeviceBuffer<int> counts, by_block, totals{kTotals + 1};  // the last: whether a sweep has changed a value
  PinnedBuffer<int> totals_here{kTotals + 1};
  DeviceBuffer<CellTriangle> triangles;

  const int* read_totals() {
    stream.download(totals.data(), kTotals + 1, totals_here.data());
    stream.wait();
    return totals_here.data();
  }
};

// Sweeps outwards from the known values, in both copies; the result is in `u`.
void sweep(const sdf::Grid& grid, Work* work, const unsigned char* known, float* u, float* other) {
  int* const changed = work->totals.data() + kTotals;
  const unsigned threads = blocks_of(static_cast<std::int64_t>(grid.size()), kThreadsPerVoxels);
  do {
    work->stream.fill_zero(changed, 1);
    for (int k = 0; k < kSweepsAtOnce; ++k) {
      launch(work->stream, threads, SweepNodes{grid, known, u, other, changed});
      std::swap(u, other);
    }
  } while (work->read_totals()[kTotals]);
}

}  // namespace

std::vector<float> redistance_cuda(const sdf::Grid& grid, const float* phi_here, int device) {
  std::vector<float> out(grid.size());  // before `work`, whose destructor waits for writes to it
  const BlockLattice blocks(grid);
  const auto count = std::size_t(blocks.count());
  const auto work = pool_of<Work>().borrow(device);
  const DeviceStream& stream = work->stream;
  float* const phi = work->phi.room(grid.size());
  stream.upload(phi_here, grid.size(), phi);
  stream.fill_zero(work->totals.data(), kTotals + 1);
  int* const counts = work->counts.room(count);
  const BlockPlaces places = BlockPlaces::in(work->by_block.room(4 * count), count, work->totals.data());
  const auto each_block = static_cast<unsigned>(count);
  launch(stream, each_block, CountOverBlocks<CountTriangles>{blocks, phi, {}, counts});
  launch(stream, 1, PlaceBlocks{blocks.count(), counts, places});
  const int* const totals = work->read_totals();
  if (totals[kSlots] == 0) sdf::refuse_one_sign();
  CellTriangle* const triangles = work->triangles.room(std::size_t(totals[kVertices]));
  float *const u = work->u.room(grid.size()), *const other = work->other.room(grid.size());
  unsigned char* const known = work->known.room(grid.size());
  launch(stream, static_cast<unsigned>(totals[kSlots]), PlaceTriangles{blocks, phi, places, triangles});
  launch(stream, each_block, BandDistances{blocks, counts, places.vertex, triangles, u, other, known});
  sweep(grid, &*work, known, u, other);
  launch(stream, blocks_of(static_cast<std::int64_t>(grid.size()), kThreadsPerVoxels),
         SignDistances{grid.size(), phi, u});
  stream.download(u, out.size(), out.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::levelset

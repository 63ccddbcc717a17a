// SPDX-License-Identifier: MIT
#include "base/device_pool.h"
#include "levelset/far_kernels.cuh"
#include "levelset/redistance.h"
#include "levelset/redistance_kernels.cuh"

namespace sdftrack::levelset {

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
  const auto count = static_cast<std::size_t>(blocks.count());
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
  CellTriangle* const triangles = work->triangles.room(static_cast<std::size_t>(totals[kVertices]));
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

// SPDX-License-Identifier: MIT
#include "base/device_copies.h"
#include "base/device_pool.h"
#include "levelset/zero_mesh.h"
#include "levelset/zero_mesh_kernels.cuh"

namespace sdftrack::levelset {

namespace {

struct Work {
  Work() {
    static const std::array<CubeCase, kCubeCases> made = make_cube_cases();
    stream.upload(made.data(), made.size(), cases.data());
  }

  DeviceStream stream;
  DeviceBuffer<CubeCase> cases{kCubeCases};
  DeviceBuffer<float> phi;
  DeviceBuffer<int> counts, by_block, totals{kTotals};
  PinnedBuffer<int> totals_here{kTotals};
  DeviceBuffer<VoxelVertices> voxels;
  DeviceBuffer<Vec3d> vertices;
  DeviceBuffer<std::int32_t> faces;
};

// The values on the device, or a new copy of them.
const float* values_there(const sdf::Grid& grid, const float* phi, int device, Work* work) {
  if (const float* const there = DeviceCopies::find(phi, device)) return there;
  float* const copy = work->phi.room(grid.size());
  work->stream.upload(phi, grid.size(), copy);
  return copy;
}

}  // namespace

ZeroMesh zero_mesh_cuda(const sdf::Grid& grid, const float* phi_here, int device) {
  ZeroMesh out;  // before `work`, whose destructor waits for writes to it
  const BlockLattice blocks(grid);
  const auto count = std::size_t(blocks.count());
  const auto work = pool_of<Work>().borrow(device);
  const DeviceStream& stream = work->stream;
  const float* const phi = values_there(grid, phi_here, device, &*work);
  const CubeCase* const cases = work->cases.data();
  const BlockPlaces places = BlockPlaces::in(work->by_block.room(4 * count), count, work->totals.data());
  int* const counts = work->counts.room(count);
  launch(stream, static_cast<unsigned>(count), CountOverBlocks<CountVertices>{blocks, phi, {cases}, counts});
  launch(stream, 1, PlaceBlocks{blocks.count(), counts, places});
  const int* const totals = work->totals_here.data();
  stream.download(places.totals, kTotals, work->totals_here.data());
  stream.wait();
  if (totals[kSlots] == 0) return out;
  const auto vertices = std::size_t(totals[kVertices]), faces = std::size_t(totals[kFaces]),
             slots = std::size_t(totals[kSlots]);
  VoxelVertices* const voxels = work->voxels.room(slots * kBlockVoxels);
  Vec3d* const vertices_there = work->vertices.room(vertices);
  std::int32_t* const faces_there = work->faces.room(3 * faces);
  launch(stream, static_cast<unsigned>(slots), PlaceVertices{blocks, phi, places, voxels, vertices_there});
  launch(stream, static_cast<unsigned>(slots), PlaceFaces{blocks, phi, cases, places, voxels, faces_there});
  out.vertices.resize(3 * vertices), out.faces.resize(3 * faces);
  stream.download(vertices_there, vertices, reinterpret_cast<Vec3d*>(out.vertices.data()));
  stream.download(faces_there, 3 * faces, out.faces.data());
  stream.wait();
  return out;
}

}  // namespace sdftrack::levelset

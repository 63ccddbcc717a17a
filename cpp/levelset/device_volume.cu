// SPDX-License-Identifier: MIT
// A volume on a GPU: its construction and its distances.
#include <string>

#include "base/device_copies.h"
#include "levelset/device_work.cuh"
#include "levelset/distance_kernels.cuh"
#include "levelset/far_kernels.cuh"

namespace sdftrack::levelset {

namespace {

constexpr int kSweepsAtOnce = 16;  // until the host checks convergence; an even number

}  // namespace

DeviceVolume::Impl::Impl(EvidenceVolume* evidence, int device_)
    : device(device_),
      blocks(evidence->blocks()),
      voxels(blocks.grid.size()),
      count(std::size_t(blocks.count())),
      log_ratio(voxels),
      weight(voxels),
      phi(voxels),
      colors(voxels),
      bytes(9 * count),
      shown(count),
      moved(count),
      change(count),
      lists(kLists * count),
      nodes(coarse_lattice(blocks.grid).size()),
      other_nodes(nodes.size()),
      known(nodes.size()),
      report(1),
      host_report(1),
      surface(count),
      phi_here(voxels),
      colors_here(voxels) {
  const EvidenceVolume::Parts from = evidence->parts();
  frame = *from.frame;
  // The uploads may still read the caller's pageable memory after they return; hence the wait at the end.
  const StreamWaiter waiter(stream);
  stream.upload(from.log_ratio, voxels, log_ratio.data());
  stream.upload(from.weight, voxels, weight.data());
  std::copy_n(from.colors, voxels, colors_here.data());
  stream.upload(colors_here.data(), voxels, colors.data());
  stream.fill_zero(bytes.data(), bytes.size());
  const DeviceBlocks of = of_blocks();
  stream.upload(from.empty, count, of.empty);
  stream.upload(from.spoken, count, of.spoken);
  stream.upload(from.turned, count, of.turned);
  stream.fill_zero(shown.data(), count);
  stream.fill_zero(moved.data(), count);
  stream.fill_zero(change.data(), count);
  stream.fill_zero(report.data(), 1);
  launch(stream, blocks_of(static_cast<std::int64_t>(voxels), kThreadsPerVoxels),
         FillSides{log_ratio.data(), far_side_m(blocks.grid), voxels, phi.data()});
  stream.download(phi.data(), voxels, phi_here.data());
  stream.wait();
  DeviceCopies::add(phi_here.data(), device, phi.data());
  DeviceCopies::add(colors_here.data(), device, colors.data());
}
DeviceVolume::Impl::~Impl() {
  DeviceCopies::remove(phi_here.data(), device);
  DeviceCopies::remove(colors_here.data(), device);
  static_cast<void>(cudaStreamSynchronize(stream.get()));
}

DeviceVolume::DeviceVolume(EvidenceVolume* evidence, int device) {
  const DeviceScope scope(device);
  try {
    impl_ = std::make_unique<Impl>(evidence, device);
  } catch (const CudaError& error) {
    if (std::string(error.what()).find("cudaErrorMemoryAllocation") == std::string::npos) throw;
    const sdf::Grid& grid = evidence->grid();
    const bool here = std::string(error.what()).find("cudaMallocHost") != std::string::npos;
    throw CudaError("CUDA: the " + std::string(here ? "host" : "device") +
                    " has too little free memory for a volume of " + std::to_string(grid.nx) + " x " +
                    std::to_string(grid.ny) + " x " + std::to_string(grid.nz) + " voxels (about " +
                    std::to_string((here ? 12 : 21) * grid.size() / 1000000) +
                    " MB); use fewer voxels, or device=\"cpu\" (" + error.what() + ")");
  }
}
DeviceVolume::~DeviceVolume() = default;

void DeviceVolume::update(int rounds, float band_voxels, bool all) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const auto voxel_m = float(v.blocks.grid.voxel_m);
  const float band_m = band_voxels * voxel_m;
  const DeviceBlocks of = v.of_blocks();
  v.older |= kPhiNotShown;
  launch(v.stream, v.for_each_block(), FindRoles{v.blocks, of, all});
  v.make_lists(HasRole{of.role});
  launch(v.stream, v.for_listed(), CrossBlocks{v.blocks, v.of_voxels(), of, v.list(0), voxel_m});
  launch(v.stream, 1, AddChanges{of, v.list(0), &v.report.data()->change_m});
  launch(v.stream, v.for_each_block(), FindSources{v.blocks.count(), of, kStays * voxel_m});
  launch(v.stream, v.for_each_block(), MarkBlocks{v.blocks, of});
  v.make_lists(MayBeNear{of.marked});
  launch(v.stream, v.for_listed(), FindNear{v.blocks, v.phi.data(), of, v.list(0), band_m});
  v.make_lists(FollowsInColor{v.blocks, of.marked}, kLists);
  // A front that has moved away leaves distances that are too small: they grow by a voxel in each round.
  for (int round = 0; round < rounds; ++round)
    for (int color = 0; color < kLists; ++color)
      launch(v.stream, v.for_listed(),
             RelaxBlocks{v.blocks,
                         {voxel_m, kMax_m},
                         of,
                         v.list(color),
                         round % 2 == 0,
                         kSettled * voxel_m,
                         band_m,
                         v.phi.data()});
}

void DeviceVolume::sweep_far(float band_voxels) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const sdf::Grid& grid = v.blocks.grid;
  const sdf::Grid lattice = coarse_lattice(grid);
  const float band_m = band_voxels * float(grid.voxel_m);
  const unsigned threads = blocks_of(static_cast<std::int64_t>(lattice.size()), kThreadsPerVoxels);
  float *from = v.nodes.data(), *to = v.other_nodes.data();
  Impl::Report* const report = v.report.data();
  v.stream.fill_zero(&report->has_surface, 1);
  launch(v.stream, threads,
         StartNodes{grid, lattice, v.phi.data(), band_m, from, to, v.known.data(), &report->has_surface});
  do {
    v.stream.fill_zero(&report->nodes_changed, 1);
    for (int k = 0; k < kSweepsAtOnce; ++k) {
      launch(v.stream, threads, SweepNodes{lattice, v.known.data(), from, to, &report->nodes_changed});
      std::swap(from, to);
    }
  } while (v.read_report().nodes_changed);
  launch(v.stream, threads, SignNodes{grid, lattice, v.phi.data(), from, to});
}

void DeviceVolume::fill_far(float band_voxels, int z0, int z1) {
  Impl& v = *impl_;
  if (z1 <= z0) return;
  const DeviceScope scope(v.device);
  const sdf::Grid& grid = v.blocks.grid;
  const std::size_t slice = std::size_t(grid.nx) * grid.ny, first = slice * std::size_t(z0),
                    last = slice * std::size_t(z1);
  launch(v.stream, blocks_of(static_cast<std::int64_t>(last - first), kThreadsPerVoxels),
         FillFar{v.blocks, coarse_lattice(grid), v.other_nodes.data(), &v.report.data()->has_surface,
                 band_voxels * float(grid.voxel_m), first, last, v.phi.data(), v.shown.data()});
  v.older |= kPhiNotShown;
}

}  // namespace sdftrack::levelset

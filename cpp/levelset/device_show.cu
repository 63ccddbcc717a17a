// SPDX-License-Identifier: MIT
// Transfer of a volume on a GPU to the host.
#include <cstdint>

#include "base/parallel.h"
#include "levelset/device_blocks.cuh"
#include "levelset/device_work.cuh"

namespace sdftrack::levelset {

// Transfer of a volume on the GPU to the host: the blocks of which the host's copy is older.

// Writes the blocks to their places in the host's memory, without work on the host.
struct ShowBlocks {
  static constexpr const char* kName = "volume: show changed blocks";
  static constexpr int kThreads = 128;
  using Color = std::uint64_t;  // a VoxelColor as one word, for the transfer over the bus
  static_assert(sizeof(Color) == sizeof(VoxelColor));
  BlockLattice blocks;
  int what;  // Shown
  const float* phi;
  const Color* colors;
  float* phi_here;
  Color* colors_here;
  int* shown;
  __device__ void operator()() const {
    for (int b = int(blockIdx.x); b < blocks.count(); b += int(gridDim.x)) {
      const int older = shown[b] & what;
      if (!older) continue;
      std::size_t first;
      const BlockRows rows = blocks.rows(b, &first);
      for (int i = int(threadIdx.x); i < kBlockVoxels; i += kThreads) {
        const VoxelPlace at(i);
        if (at.x >= rows.nx || at.y >= rows.ny || at.z >= rows.nz) continue;
        const std::size_t voxel = first + rows.offset(at.z * rows.ny + at.y) + std::size_t(at.x);
        if (older & kPhiNotShown) phi_here[voxel] = phi[voxel];
        if (older & kColorNotShown) colors_here[voxel] = colors[voxel];
      }
      __syncthreads();  // each thread has read the present mark
      if (threadIdx.x == 0) shown[b] &= ~what;
    }
  }
};

void DeviceVolume::settle() {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  v.stream.download(v.of_blocks().surface, v.count, v.surface.data());
  v.change_m = v.read_report().change_m, v.on_its_way = false;
  v.surface_here.assign(v.surface.data(), v.surface.data() + v.count);
}

// Does nothing if the host's copy is complete.
void DeviceVolume::Impl::show(int what) {
  if (!(older & what)) return;
  const DeviceScope scope(device);
  using Color = ShowBlocks::Color;
  launch(stream, for_listed(),
         ShowBlocks{blocks, what, phi.data(), reinterpret_cast<const Color*>(colors.data()), phi_here.data(),
                    reinterpret_cast<Color*>(colors_here.data()), shown.data()});
  older &= ~what, on_its_way = true;
}
void DeviceVolume::Impl::wait_for_what_is_shown() {
  if (!on_its_way) return;
  stream.wait();
  on_its_way = false;
}

void DeviceVolume::begin_to_show() { impl_->show(kPhiNotShown | kColorNotShown); }

std::span<const float> DeviceVolume::phi() {
  impl_->show(kPhiNotShown);
  impl_->wait_for_what_is_shown();
  return {impl_->phi_here.data(), impl_->voxels};
}

std::span<const VoxelColor> DeviceVolume::colors() {
  impl_->show(kColorNotShown);
  impl_->wait_for_what_is_shown();
  return {impl_->colors_here.data(), impl_->voxels};
}

void DeviceVolume::download(EvidenceVolume* evidence, int threads) {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const EvidenceVolume::Parts to = evidence->parts();
  const DeviceBlocks of = v.of_blocks();
  const StreamWaiter waiter(v.stream);
  v.stream.download(v.log_ratio.data(), v.voxels, to.log_ratio);
  v.stream.download(v.weight.data(), v.voxels, to.weight);
  v.show(kColorNotShown);
  v.stream.download(of.empty, v.count, to.empty);
  v.stream.download(of.spoken, v.count, to.spoken);
  v.stream.download(of.turned, v.count, to.turned);
  v.stream.wait();
  v.on_its_way = false;
  const auto slice = std::size_t(v.blocks.grid.nx) * v.blocks.grid.ny;
  parallel_for(v.voxels / slice, threads, [&](std::size_t z) {
    std::copy_n(v.colors_here.data() + z * slice, slice, to.colors + z * slice);
  });
  *to.frame = v.frame;
}

std::vector<sdf::VoxelBox> DeviceVolume::surface_boxes() const {
  return boxes_of(impl_->blocks, impl_->surface_here);
}
double DeviceVolume::change_m() const { return impl_->change_m; }

}  // namespace sdftrack::levelset

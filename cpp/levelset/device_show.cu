// SPDX-License-Identifier: MIT
// What the host asks for of a volume on a GPU.
#include "base/parallel.h"
#include "levelset/device_work.cuh"
#include "levelset/show_kernels.cuh"

namespace sdftrack::levelset {

namespace {

// A list of blocks' values to the host's copy of the volume, or all values where most have changed.
template <class T>
void bring(DeviceVolume::Impl* volume, std::size_t changed, const T* values, T* here, int threads) {
  DeviceVolume::Impl& v = *volume;
  if (2 * changed > v.count) {
    const StreamWaiter waiter(v.stream);
    v.stream.download(values, v.voxels, here);
    v.stream.wait();
    return;
  }
  for (std::size_t from = 0; from < changed; from += kShownAtOnce) {
    const std::size_t n = std::min(kShownAtOnce, changed - from);
    T* const values_here = reinterpret_cast<T*>(v.staging.data());
    T* const values_there = reinterpret_cast<T*>(v.staged.data());
    int* const ids = reinterpret_cast<int*>(values_here + n * kBlockVoxels);
    const int* const listed = v.list(0).blocks + from;
    launch(v.stream, static_cast<unsigned>(n), Gather<T>{v.blocks, listed, values, values_there});
    v.stream.download(values_there, n * kBlockVoxels, values_here);
    v.stream.download(listed, n, ids);
    v.stream.wait();
    parallel_for(n, threads, [&](std::size_t k) {
      std::size_t first;
      const BlockRows rows = v.blocks.rows(ids[k], &first);
      for (int row = 0; row < rows.ny * rows.nz; ++row)
        std::copy_n(
            values_here + k * kBlockVoxels + kBlockSide * (row % rows.ny + kBlockSide * (row / rows.ny)),
            rows.nx, here + first + rows.offset(row));
    });
  }
}

}  // namespace

void DeviceVolume::settle() {
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  v.stream.download(v.of_blocks().surface, v.count, v.surface.data());
  v.change_m = v.read_report().change_m;
  v.surface_here.assign(v.surface.data(), v.surface.data() + v.count);
}

const LargeArray<float>& DeviceVolume::phi(int threads) {
  Impl& v = *impl_;
  if (!v.phi_is_older) return v.phi_here;
  const DeviceScope scope(v.device);
  const int* const shown = v.shown.data();
  v.make_lists(PhiNotShown{v.blocks, shown, v.filled_from, v.filled_to});
  const auto changed = static_cast<std::size_t>(v.read_report().listed[0]);
  bring(&v, changed, v.phi.data(), v.phi_here.data(), threads);
  launch(v.stream, v.for_each_block(), NoteShown{v.blocks.count(), kPhiNotShown, v.shown.data()});
  v.stream.wait();
  v.filled_from = v.filled_to = 0, v.phi_is_older = false;
  return v.phi_here;
}

void DeviceVolume::bring_colors(EvidenceVolume* evidence, int threads) {
  Impl& v = *impl_;
  if (!v.colors_are_older) return;
  const DeviceScope scope(v.device);
  v.make_lists(ColorNotShown{v.shown.data()});
  const auto changed = static_cast<std::size_t>(v.read_report().listed[0]);
  bring(&v, changed, v.colors.data(), evidence->parts().colors, threads);
  launch(v.stream, v.for_each_block(), NoteShown{v.blocks.count(), kColorNotShown, v.shown.data()});
  v.stream.wait();
  v.colors_are_older = false;
}

void DeviceVolume::download(EvidenceVolume* evidence, int threads) {
  bring_colors(evidence, threads);
  Impl& v = *impl_;
  const DeviceScope scope(v.device);
  const EvidenceVolume::Parts to = evidence->parts();
  const DeviceBlocks of = v.of_blocks();
  const StreamWaiter waiter(v.stream);
  v.stream.download(v.log_ratio.data(), v.voxels, to.log_ratio);
  v.stream.download(v.weight.data(), v.voxels, to.weight);
  v.stream.download(of.empty, v.count, to.empty);
  v.stream.download(of.spoken, v.count, to.spoken);
  v.stream.download(of.turned, v.count, to.turned);
  v.stream.wait();
  *to.frame = v.frame;
}

std::vector<sdf::VoxelBox> DeviceVolume::surface_boxes() const {
  return boxes_of(impl_->blocks, impl_->surface_here);
}
double DeviceVolume::change_m() const { return impl_->change_m; }

}  // namespace sdftrack::levelset

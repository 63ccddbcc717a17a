// SPDX-License-Identifier: MIT
// Transfer of a volume on a GPU to the host.
#include "base/parallel.h"
#include "levelset/device_work.cuh"
#include "levelset/show_kernels.cuh"

namespace sdftrack::levelset {

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
  const auto slice = static_cast<std::size_t>(v.blocks.grid.nx) * static_cast<std::size_t>(v.blocks.grid.ny);
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

// SPDX-License-Identifier: MIT
// Replaces device_volume.cu in a build without CUDA: throws an error.
#include "base/no_cuda.h"
#include "levelset/device_volume.h"

namespace sdftrack::levelset {

struct DeviceVolume::Impl {};

DeviceVolume::DeviceVolume(EvidenceVolume*, int) { no_cuda(); }
DeviceVolume::~DeviceVolume() = default;
void DeviceVolume::send(const FrameEvidence&) { no_cuda(); }
void DeviceVolume::fuse(const Camera&, const Rigidd&, const EvidenceImageOptions&, const EvidenceOptions&) {
  no_cuda();
}
void DeviceVolume::update(int, float, bool) { no_cuda(); }
void DeviceVolume::sweep_far(float) { no_cuda(); }
void DeviceVolume::fill_far(float, int, int) { no_cuda(); }
void DeviceVolume::settle() { no_cuda(); }
std::vector<sdf::VoxelBox> DeviceVolume::surface_boxes() const { no_cuda(); }
double DeviceVolume::change_m() const { no_cuda(); }
std::span<const float> DeviceVolume::phi() { no_cuda(); }
std::span<const VoxelColor> DeviceVolume::colors() { no_cuda(); }
void DeviceVolume::begin_to_show() { no_cuda(); }
void DeviceVolume::download(EvidenceVolume*, int) { no_cuda(); }

}  // namespace sdftrack::levelset

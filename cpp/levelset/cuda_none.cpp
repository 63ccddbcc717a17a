// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "levelset/device_volume.h"
#include "levelset/evolve.h"
#include "levelset/redistance.h"
#include "levelset/zero_mesh.h"

namespace sdftrack::levelset {

ZeroMesh zero_mesh_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

std::vector<float> redistance_cuda(const sdf::Grid&, const float*, int) { no_cuda(); }

std::vector<float> evolve_cuda(const sdf::Grid&, const float*, const float*, int, const EvolveOptions&, int) {
  no_cuda();
}

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

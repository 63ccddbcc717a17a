// SPDX-License-Identifier: MIT
// The evidence and the distances of a volume that stays on a GPU from frame to frame: the counterpart of
// EvidenceVolume and EvidenceDistance. No CUDA header is needed to include this.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "levelset/distance.h"

namespace sdftrack::levelset {

class DeviceVolume {
 public:
  // Copies the evidence; of the distances only the signs. Throws std::runtime_error without enough memory.
  DeviceVolume(EvidenceVolume* evidence, int device);
  ~DeviceVolume();
  DeviceVolume(const DeviceVolume&) = delete;
  DeviceVolume& operator=(const DeviceVolume&) = delete;

  // Sends a frame's measurements. Their roles must then be found (reconstruction/device_roles.h).
  void send(const FrameEvidence& frame);
  // As EvidenceImage::make for the sent frame and EvidenceVolume::fuse; `update` knows the changed blocks.
  void fuse(const Camera& camera, const Rigidd& T_cam_obj, const EvidenceImageOptions& image_options,
            const EvidenceOptions& options);
  // As in EvidenceDistance. `all`: all blocks, not only the fused ones.
  void update(int rounds, float band_voxels, bool all = false);
  void sweep_far(float band_voxels);
  void fill_far(float band_voxels, int z0, int z1);

  // Waits until all of this is done; call it at the end of a frame. Others may then use the volume on the
  // device, and the next two functions describe the frame.
  void settle();
  std::vector<sdf::VoxelBox> surface_boxes() const;
  double change_m() const;

  // The distances and colours of the device, with the changes since the last call; the addresses stay.
  std::span<const float> phi();
  std::span<const VoxelColor> colors();
  // Starts to bring both; phi() or colors() waits for the end. Until then their spans hold old and new
  // values.
  void begin_to_show();
  // Brings all evidence to the host.
  void download(EvidenceVolume* evidence, int threads);

  struct Impl;  // device_work.cuh
  Impl& impl() { return *impl_; }

 private:
  void make_image(const Camera& camera, const EvidenceImageOptions& options, float reach_m);

  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
// The evidence and the distances of a volume that stays on a GPU from frame to frame: what EvidenceVolume and
// EvidenceDistance are on the CPU. No CUDA header is needed to include this.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "levelset/distance.h"

namespace sdftrack::levelset {

class DeviceVolume {
 public:
  // A copy of the evidence there; of the distances only the sides are known. std::runtime_error where the
  // device has too little memory.
  DeviceVolume(EvidenceVolume* evidence, int device);
  ~DeviceVolume();
  DeviceVolume(const DeviceVolume&) = delete;
  DeviceVolume& operator=(const DeviceVolume&) = delete;

  // A frame's readings; whose each is has then to be found (reconstruction/device_roles.h).
  void send(const FrameEvidence& frame);
  // As EvidenceImage::make of what was sent and EvidenceVolume::fuse; `update` knows what has changed.
  void fuse(const Camera& camera, const Rigidd& T_cam_obj, const EvidenceImageOptions& image_options,
            const EvidenceOptions& options);
  // As in EvidenceDistance. `all`: of all blocks, whatever was fused.
  void update(int rounds, float band_voxels, bool all = false);
  void sweep_far(float band_voxels);
  void fill_far(float band_voxels, int z0, int z1);

  // Waits until all of that is done. A frame ends with it: others may then take the volume where it lies, and
  // the following two are those of the frame.
  void settle();
  std::vector<sdf::VoxelBox> surface_boxes() const;
  double change_m() const;

  // The distances and colours as they are there: brings what has changed since the last call. They stay where
  // they are in memory.
  std::span<const float> phi();
  std::span<const VoxelColor> colors();
  // Begins to bring both. The next call of one of these waits for the end; until then what was borrowed of
  // them is in part older, in part newer.
  void begin_to_show();
  // All of the evidence.
  void download(EvidenceVolume* evidence, int threads);

  struct Impl;  // device_work.cuh
  Impl& impl() { return *impl_; }

 private:
  void make_image(const Camera& camera, const EvidenceImageOptions& options, float reach_m);

  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::levelset

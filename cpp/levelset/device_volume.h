// SPDX-License-Identifier: MIT
// The evidence and the distances of a volume that stays on a GPU from frame to frame: what EvidenceVolume and
// EvidenceDistance are on the CPU. No CUDA header is needed to include this.
#pragma once

#include <memory>
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

  // As EvidenceVolume::fuse; `update` knows what has changed.
  void fuse(const EvidenceImage& image, const FrameColors& colors, const Camera& camera,
            const Rigidd& T_cam_obj, const EvidenceOptions& options);
  // As in EvidenceDistance. `all`: of all blocks, whatever was fused.
  void update(int rounds, float band_voxels, bool all = false);
  void sweep_far(float band_voxels);
  void fill_far(float band_voxels, int z0, int z1);

  // Brings what has changed since the last call to phi() and to the evidence's colours.
  void show(EvidenceVolume* evidence, int threads);
  // Brings all of the evidence back.
  void download(EvidenceVolume* evidence);

  // Of each point (NaN: none) the distance, and whether nothing of an object can be there: frames have looked
  // past it, more than near_m away from the surface.
  void look_up(const std::vector<Vec3f>& points, float near_m, std::vector<float>* distance_m,
               std::vector<unsigned char>* looked_past);

  // As `show` left them; they stay where they are in memory.
  const LargeArray<float>& phi() const;
  std::vector<sdf::VoxelBox> surface_boxes() const;
  double change_m() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::levelset

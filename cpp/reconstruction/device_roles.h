// SPDX-License-Identifier: MIT
// Assigns each measurement of a frame to the object or not, on the GPU that has the volume, as RoleFinder
// does on the CPU. No CUDA header is needed to include this.
#pragma once

#include <memory>

#include "levelset/device_volume.h"
#include "reconstruction/first_view.h"
#include "reconstruction/role_terms.h"

namespace sdftrack::reconstruction {

class DeviceRoles {
 public:
  // Both are borrowed. view: nullptr where the object may be anywhere.
  DeviceRoles(levelset::DeviceVolume* volume, const FirstView* view);
  ~DeviceRoles();
  DeviceRoles(const DeviceRoles&) = delete;
  DeviceRoles& operator=(const DeviceRoles&) = delete;

  // For the last frame that was sent to the volume: by its mask, or else by colour and by how the
  // measurements connect to the current surface.
  void find(const Camera& camera, const Rigidd& T_cam_obj, const RoleOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sdftrack::reconstruction

// SPDX-License-Identifier: MIT
// In a build without CUDA, in place of the .cu files of this folder: the error of no_cuda.h.
#include "base/no_cuda.h"
#include "reconstruction/device_roles.h"

namespace sdftrack::reconstruction {

struct DeviceRoles::Impl {};

DeviceRoles::DeviceRoles(levelset::DeviceVolume*, const FirstView*) { no_cuda(); }
DeviceRoles::~DeviceRoles() = default;
void DeviceRoles::find(const Camera&, const Rigidd&, const RoleOptions&) { no_cuda(); }

}  // namespace sdftrack::reconstruction

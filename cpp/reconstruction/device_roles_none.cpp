// SPDX-License-Identifier: MIT
// What a build without CUDA has in place of device_roles.cu: one error.
#include "base/no_cuda.h"
#include "reconstruction/device_roles.h"

namespace sdftrack::reconstruction {

struct DeviceRoles::Impl {};

DeviceRoles::DeviceRoles(levelset::DeviceVolume*, const FirstView*) { no_cuda(); }
DeviceRoles::~DeviceRoles() = default;
void DeviceRoles::find(const Camera&, const Rigidd&, const RoleOptions&) { no_cuda(); }

}  // namespace sdftrack::reconstruction

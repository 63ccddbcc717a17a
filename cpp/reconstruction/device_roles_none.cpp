// SPDX-License-Identifier: MIT
// A build without CUDA has this in place of device_roles.cu: an error.
#include "base/no_cuda.h"
#include "reconstruction/device_roles.h"

namespace sdftrack::reconstruction {

struct DeviceRoles::Impl {};

DeviceRoles::DeviceRoles(levelset::DeviceVolume*, const FirstView*) { no_cuda(); }
DeviceRoles::~DeviceRoles() = default;
void DeviceRoles::find(const Camera&, const Rigidd&, const RoleOptions&) { no_cuda(); }

}  // namespace sdftrack::reconstruction

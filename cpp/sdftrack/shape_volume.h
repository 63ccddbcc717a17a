// SPDX-License-Identifier: MIT
// What a Shape holds.
#pragma once

#include "sdf/mesh/mesh_volume.h"
#include "sdftrack/shape.h"

namespace sdftrack {

struct Shape::Volume {
  sdf::MeshVolume mesh;
};

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// A known shape of Python for the reconstruction of an object.
#pragma once

#include <optional>

#include "reconstruction/beginning.h"
#include "volume.h"

namespace sdftrack::bindings {

// The caller keeps the array.
std::optional<reconstruction::KnownShape> known_shape_from(const std::optional<PyVolume>& shape);

}  // namespace sdftrack::bindings

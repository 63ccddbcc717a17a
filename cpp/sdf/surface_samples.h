// SPDX-License-Identifier: MIT
// Points spread over the zero set of a volume.
#pragma once

#include <vector>

#include "base/views.h"

namespace sdftrack {

struct SurfaceSample {
  Vec3f p_obj;  // m, on the zero set of the trilinear interpolant
  Vec3f n_obj;  // unit, outwards
};

// `count` points (fewer only where a field has creases on its surface, none where it has no zero set), as
// many per area everywhere, always the same ones.
std::vector<SurfaceSample> surface_samples(const SdfView& sdf, int count);

}  // namespace sdftrack

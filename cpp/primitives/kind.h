// SPDX-License-Identifier: MIT
// The kinds of shapes that are given by a formula. Centred at mid-height, axis along z, a cone's apex at +z;
// a plane patch has its normal along z. A new kind needs a name here and a header solid_<name>.h, which
// solids.h includes.
#pragma once

#include <array>

#include "sdf/solid_sample.h"

namespace sdftrack::primitives {

enum class PrimitiveKind { kSphere, kCylinder, kCone, kBox, kEllipsoid, kPlane, kEnd };
constexpr int kPrimitiveKinds = static_cast<int>(PrimitiveKind::kEnd);

// How the lengths enter phi.
enum class Scaling {
  kExact,    // the exact distance to the solid of these lengths
  kPrinted,  // a unit solid under S = diag(s) (thesis Eq. 3.27), its field divided by |S^-1 grad| to first
             // order
};

using PrimitiveSize = std::array<double, sdf::kMaxSizes>;  // m; lengths that a kind lacks are 1

}  // namespace sdftrack::primitives

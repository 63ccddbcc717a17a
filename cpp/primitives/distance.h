// SPDX-License-Identifier: MIT
// The exact distance to a shape of a kind.
#pragma once

#include "primitives/kind.h"
#include "sdf/patch.h"
#include "sdf/solid_ellipsoid.h"
#include "sdf/solids.h"

namespace sdftrack::primitives {

template <PrimitiveKind kKind, class T>
HD sdf::SolidSample<T> sample_of(Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  if constexpr (kKind == PrimitiveKind::kSphere)
    return sdf::sphere_sample(p, size[0]);
  else if constexpr (kKind == PrimitiveKind::kCylinder)
    return sdf::cylinder_sample(p, size[0], size[1]);
  else if constexpr (kKind == PrimitiveKind::kCone)
    return sdf::cone_sample(p, size[0], size[1]);
  else if constexpr (kKind == PrimitiveKind::kBox)
    return sdf::box_sample(p, size);
  else if constexpr (kKind == PrimitiveKind::kPlane)
    return sdf::patch_sample(p, size);
  else
    return sdf::ellipsoid_sample(p, size);
}

template <class T>
HD sdf::SolidSample<T> exact_sample(PrimitiveKind kind, Vec3<T> p, const T (&size)[sdf::kMaxSizes]) {
  switch (kind) {
    case PrimitiveKind::kSphere:
      return sample_of<PrimitiveKind::kSphere>(p, size);
    case PrimitiveKind::kCylinder:
      return sample_of<PrimitiveKind::kCylinder>(p, size);
    case PrimitiveKind::kCone:
      return sample_of<PrimitiveKind::kCone>(p, size);
    case PrimitiveKind::kBox:
      return sample_of<PrimitiveKind::kBox>(p, size);
    case PrimitiveKind::kPlane:
      return sample_of<PrimitiveKind::kPlane>(p, size);
    case PrimitiveKind::kEllipsoid:
      break;
  }
  return sample_of<PrimitiveKind::kEllipsoid>(p, size);
}

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
// The exact distance to a shape of a kind.
#pragma once

#include "primitives/kind.h"
#include "sdf/patch.h"
#include "sdf/solid_ellipsoid.h"
#include "sdf/solids.h"

namespace sdftrack {

template <PrimitiveKind kKind, class T>
HD SolidSample<T> sample_of(Vec3<T> p, const T (&size)[kMostSizes]) {
  if constexpr (kKind == PrimitiveKind::kSphere)
    return sphere_sample(p, size[0]);
  else if constexpr (kKind == PrimitiveKind::kCylinder)
    return cylinder_sample(p, size[0], size[1]);
  else if constexpr (kKind == PrimitiveKind::kCone)
    return cone_sample(p, size[0], size[1]);
  else if constexpr (kKind == PrimitiveKind::kBox)
    return box_sample(p, size);
  else if constexpr (kKind == PrimitiveKind::kPlane)
    return patch_sample(p, size);
  else
    return ellipsoid_sample(p, size);
}

template <class T>
HD SolidSample<T> exact_sample(PrimitiveKind kind, Vec3<T> p, const T (&size)[kMostSizes]) {
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

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
// The contact term of one surface point that lies in another object, as plain numbers for the CPU and for
// kernels (tracking/several/collision.h).
#pragma once

#include "base/rigid.h"
#include "base/views.h"

namespace sdftrack::energies {

// Two objects: points of `object` may lie in `other`.
struct ContactPair {
  int object, other;
};

// A point, and the pairs of objects in which it may lie: `count` entries of a list of pairs from `first` on.
struct ContactPoint {
  Vec3f p_obj;
  int first, count;
};

// The data that is sent to a device for a group of objects that may penetrate each other.
struct Contacts {
  static constexpr int kObjects = 4, kPairs = kObjects * (kObjects - 1);
  const ContactPoint* points = nullptr;
  const int* near_pairs = nullptr;
  int point_count = 0, near_count = 0, pair_count = 0;
  ContactPair pairs[kPairs] = {};
  double weight[kObjects] = {};  // weight of one point of each object
};

struct Contact {
  int pair = -1;
  double phi_m = 0;  // phi in the nearest other object
  Vec3d grad_other;  // gradient of that object's field, in its frame
};

// The nearest of the objects in which a point may lie. of_point: the list of pairs; T_other_object: of all
// pairs. sdf_of(object): the object's volume.
template <class SdfOf>
HD Contact nearest_contact(const ContactPoint& point, const int* of_point, const ContactPair* pairs,
                           const Rigidd* T_other_object, const SdfOf& sdf_of) {
  Contact least;
  for (int k = 0; k < point.count; ++k) {
    const int pair = of_point[point.first + k];
    double phi;
    Vec3d g;
    sample(sdf_of(pairs[pair].other), T_other_object[pair] * point.p_obj.cast<double>(), &phi, &g);
    if (least.pair < 0 || phi < least.phi_m) least.pair = pair, least.phi_m = phi, least.grad_other = g;
  }
  return least;
}

// d phi / d unknowns of the object that owns the point (`own`) and of the object in which it lies (`other`).
// A point moves with the inverse of its object's increment.
HD void contact_rows(const Rigidd& T_other_object, Vec3f p_obj, Vec3d grad_other, double* own,
                     double* other) {
  const Vec3d C = p_obj.cast<double>(), g = grad_other, m = cross(T_other_object * C, g);
  const Vec3d g_own = transpose_times(T_other_object.R, g), m_own = cross(C, g_own);
  other[0] = g.x, other[1] = g.y, other[2] = g.z, other[3] = m.x, other[4] = m.y, other[5] = m.z;
  own[0] = -g_own.x, own[1] = -g_own.y, own[2] = -g_own.z;
  own[3] = -m_own.x, own[4] = -m_own.y, own[5] = -m_own.z;
}

}  // namespace sdftrack::energies

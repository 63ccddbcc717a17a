// SPDX-License-Identifier: MIT
// How hard a reading pulls at the pose: one pixel's formula.
#pragma once

#include "energies/penalty.h"

namespace sdftrack::frame {

template <class T>
struct PullTerm {
  energies::DepthLogistic<T> penalty;
  const float *hit_m, *depth_m, *per_noise;

  template <class U>
  HD PullTerm<U> cast() const {
    return {penalty.template cast<U>(), hit_m, depth_m, per_noise};
  }
  HD T pull(int i, int n) const {
    const T residual_m = load<T>(hit_m + i, n) - load<T>(depth_m + i, n);
    return penalty.scale_m * penalty(residual_m, load<T>(per_noise + i, n)).slope;
  }
};

}  // namespace sdftrack::frame

// SPDX-License-Identifier: MIT
// How strongly a measurement pulls the pose: the formula for one pixel.
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

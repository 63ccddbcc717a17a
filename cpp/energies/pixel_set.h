// SPDX-License-Identifier: MIT
// The pixels that an energy sums over, packed: fixed for a whole frame, so that costs may be compared.
#pragma once

#include <vector>

#include "energies/term.h"

namespace sdftrack {

struct PixelSet {
  std::vector<float> u_px, v_px, depth_m, noise_scale;
  std::vector<float> hit_m, trial_hit_m, gain;  // see PixelsView

  int count() const { return static_cast<int>(depth_m.size()); }

  void clear() {
    for (std::vector<float>* v : {&u_px, &v_px, &depth_m, &noise_scale, &hit_m, &trial_hit_m, &gain})
      v->clear();
  }
  void push(float u, float v, float depth, float noise) {
    u_px.push_back(u), v_px.push_back(v), depth_m.push_back(depth), noise_scale.push_back(noise);
    hit_m.push_back(depth), trial_hit_m.push_back(depth), gain.push_back(1.0f);
  }
  // Every `stride`-th pixel of `other`, from the measured depths.
  void assign_stride(const PixelSet& other, int stride) {
    clear();
    for (int i = 0; i < other.count(); i += stride) {
      const auto j = static_cast<std::size_t>(i);
      push(other.u_px[j], other.v_px[j], other.depth_m[j], other.noise_scale[j]);
    }
  }
  PixelsView<float> view() {
    return {count(),      u_px.data(),        v_px.data(), depth_m.data(), noise_scale.data(),
            hit_m.data(), trial_hit_m.data(), gain.data()};
  }
};

}  // namespace sdftrack

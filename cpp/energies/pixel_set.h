// SPDX-License-Identifier: MIT
// The pixels that an energy sums over, packed: fixed for a whole frame, so that costs may be compared.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "energies/term.h"

namespace sdftrack {

struct PixelSet {
  std::vector<float> u_px, v_px, depth_m, per_noise;
  std::vector<float> foreground;                // P_f of the pixel's colour; see PixelsView
  std::vector<float> hit_m, trial_hit_m, gain;  // see PixelsView
  std::vector<int> at;                          // index in the depth image

  int count() const { return static_cast<int>(depth_m.size()); }

  void clear() {
    for (std::vector<float>* v : floats()) v->clear();
    at.clear();
  }
  void push(float u, float v, float depth, float noise_scale, int index = 0, float p_foreground = 0) {
    u_px.push_back(u), v_px.push_back(v), depth_m.push_back(depth), per_noise.push_back(1 / noise_scale);
    foreground.push_back(p_foreground), at.push_back(index);
    hit_m.push_back(depth), trial_hit_m.push_back(depth), gain.push_back(1.0f);
  }
  void resize(int n) {
    for (std::vector<float>* v : floats()) v->resize(static_cast<std::size_t>(n));
    at.resize(static_cast<std::size_t>(n));
  }
  // Overwrites pixel `to` by pixel `from`, from its measured depth.
  void move(int from, int to) {
    const auto i = static_cast<std::size_t>(from), j = static_cast<std::size_t>(to);
    u_px[j] = u_px[i], v_px[j] = v_px[i], depth_m[j] = depth_m[i], per_noise[j] = per_noise[i];
    foreground[j] = foreground[i], at[j] = at[i];
    hit_m[j] = trial_hit_m[j] = depth_m[i], gain[j] = 1.0f;
  }
  // `wanted` pixels of `other` (all, where it has fewer), evenly spread over its order; from the measured
  // depths.
  void assign_subset(const PixelSet& other, int wanted) {
    clear();
    const auto n = static_cast<std::size_t>(other.count());
    const std::size_t m = std::min(n, static_cast<std::size_t>(std::max(0, wanted)));
    for (std::size_t k = 0; k < m; ++k) {
      const std::size_t i = k * n / m;
      push(other.u_px[i], other.v_px[i], other.depth_m[i], 1, other.at[i], other.foreground[i]);
      per_noise.back() = other.per_noise[i];
    }
  }
  PixelsView<float> view() {
    return {count(),      u_px.data(),        v_px.data(), depth_m.data(),   per_noise.data(),
            hit_m.data(), trial_hit_m.data(), gain.data(), foreground.data()};
  }

 private:
  std::array<std::vector<float>*, 8> floats() {
    return {&u_px, &v_px, &depth_m, &per_noise, &foreground, &hit_m, &trial_hit_m, &gain};
  }
};

}  // namespace sdftrack

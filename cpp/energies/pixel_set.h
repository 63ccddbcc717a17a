// SPDX-License-Identifier: MIT
// The pixels that an energy sums over, packed. Fixed for a whole frame, so that costs may be compared.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "energies/term.h"

namespace sdftrack::energies {

struct PixelSet {
  std::vector<float> u_px, v_px, depth_m, per_noise;
  std::vector<float> foreground;   // P_f of the pixel's colour; see PixelsView
  std::vector<float> hit_m, gain;  // see PixelsView
  std::vector<int> at;             // index in the depth image

  int count() const { return int(depth_m.size()); }

  void clear() {
    for (std::vector<float>* v : floats()) v->clear();
    at.clear();
  }
  void push(float u, float v, float depth, float noise_scale, int index = 0, float p_foreground = 0) {
    resize(count() + 1);
    set(count() - 1, {u, v}, depth, noise_scale, index, p_foreground);
  }
  // Sets pixel k; its hit starts at the measured depth.
  void set(int k, Vec2f u, float depth, float noise_scale, int index, float p_foreground = 0) {
    const auto i = std::size_t(k);
    u_px[i] = u.x, v_px[i] = u.y, depth_m[i] = depth, per_noise[i] = 1 / noise_scale;
    foreground[i] = p_foreground, at[i] = index;
    hit_m[i] = depth, gain[i] = 1.0f;
  }
  void resize(int n) {
    for (std::vector<float>* v : floats()) v->resize(std::size_t(n));
    at.resize(n);
  }
  // Copies pixel `from` of the other (or this) set to pixel `to`; its hit starts at the measured depth.
  void copy(const PixelSet& other, int from, int to) {
    const auto i = std::size_t(from), j = std::size_t(to);
    u_px[j] = other.u_px[i], v_px[j] = other.v_px[i], depth_m[j] = other.depth_m[i];
    per_noise[j] = other.per_noise[i], foreground[j] = other.foreground[i], at[j] = other.at[i];
    hit_m[j] = depth_m[j], gain[j] = 1.0f;
  }
  void append(const PixelSet& other) {
    const auto join = [](const auto& from, auto* to) { to->insert(to->end(), from.begin(), from.end()); };
    join(other.u_px, &u_px), join(other.v_px, &v_px), join(other.depth_m, &depth_m);
    join(other.per_noise, &per_noise), join(other.foreground, &foreground);
    join(other.hit_m, &hit_m), join(other.gain, &gain), join(other.at, &at);
  }
  // Resets the hits to the measured depths and all gains to 1.
  void start_afresh() {
    std::copy(depth_m.begin(), depth_m.end(), hit_m.begin());
    std::fill(gain.begin(), gain.end(), 1.0f);
  }
  // `requested` pixels of `other` (or all), spread evenly; their hits start at the measured depths.
  void assign_subset(const PixelSet& other, int requested) {
    const int n = other.count(), m = std::clamp(requested, 0, n);
    resize(m);
    const double stride = m > 0 ? double(n) / m : 1;
    for (int k = 0; k < m; ++k) copy(other, int(k * stride), k);
  }
  PixelsView<float> view() {
    return {count(),          u_px.data(),  v_px.data(), depth_m.data(),
            per_noise.data(), hit_m.data(), gain.data(), foreground.data()};
  }

 private:
  std::array<std::vector<float>*, 7> floats() {
    return {&u_px, &v_px, &depth_m, &per_noise, &foreground, &hit_m, &gain};
  }
};

}  // namespace sdftrack::energies

// SPDX-License-Identifier: MIT
#include "appearance/local_colors.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::appearance {

int LocalColors::place_of(Vec3d p) {
  const double x = std::abs(p.x), y = std::abs(p.y), z = std::abs(p.z);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const double main = axis == 0 ? p.x : axis == 1 ? p.y : p.z;
  if (main == 0) return 0;
  const auto cell = [&](double side) {
    return std::clamp(to_int((side / std::abs(main) + 1) / 2 * kPerSide), 0, kPerSide - 1);
  };
  const int i = cell(axis == 0 ? p.y : p.x), j = cell(axis == 2 ? p.y : p.z);
  return ((2 * axis + (main > 0 ? 1 : 0)) * kPerSide + i) * kPerSide + j;
}

void LocalColors::open(float rate) {
  if (places_.empty()) places_.resize(kPlaces), frame_ = 0;
  ++frame_;
  keep_ = 1 - rate;
}

void LocalColors::add(int place, bool object, int bin) {
  Place& here = places_[place];
  if (here.frame != frame_) {
    here.frame = frame_;
    here.object_pixels *= keep_, here.background_pixels *= keep_;
    for (float& n : here.object) n *= keep_;
    for (float& n : here.background) n *= keep_;
  }
  (object ? here.object : here.background)[local_bin(bin)] += 1;
  (object ? here.object_pixels : here.background_pixels) += 1;
}

}  // namespace sdftrack::appearance

// SPDX-License-Identifier: MIT
#include "contour/memory/mask_ops.h"

#include <utility>

#include "energies/distance_transform.h"

namespace sdftrack::contour {

namespace {

// Pixels of the mask in the square of 2 radius + 1 around each pixel; none beyond the border.
Plane<int> counts_around(const Mask& mask, int radius) {
  Plane<int> along_x(mask.width, mask.height), out(mask.width, mask.height);
  for (int y = 0; y < mask.height; ++y)
    for (int k = -radius; k <= radius; ++k)
      for (int x = std::max(0, -k); x < mask.width - std::max(0, k); ++x)
        along_x.row(y)[x] += mask.row(y)[x + k];
  for (int y = 0; y < mask.height; ++y)
    for (int k = std::max(-radius, -y); k <= std::min(radius, mask.height - 1 - y); ++k)
      for (int x = 0; x < mask.width; ++x) out.row(y)[x] += along_x.row(y + k)[x];
  return out;
}

energies::DistanceGrid distances_to(const Mask& mask, unsigned char side, float reach_px) {
  energies::DistanceScratch scratch;
  energies::DistanceGrid grid;
  grid.width = mask.width, grid.height = mask.height, grid.limit_px = reach_px;
  const Mask free = each<unsigned char>(mask, [side](unsigned char inside) { return inside != side; });
  energies::distance_transform(free.values, &scratch, &grid);
  return grid;
}

}  // namespace

int area_of(const Mask& mask) {
  int out = 0;
  for (const unsigned char inside : mask.values) out += inside;
  return out;
}

Mask inside_of(const Picture& phi) {
  return each<unsigned char>(phi, [](float distance) { return distance < 0; });
}

Mask edge_of(const Mask& mask) {
  Mask out = mask;
  for (int y = 1; y + 1 < mask.height; ++y)
    for (int x = 1; x + 1 < mask.width; ++x) {
      const unsigned char* const at = mask.row(y) + x;
      out.row(y)[x] = at[0] & ((at[-1] & at[1] & at[-mask.width] & at[mask.width]) ^ 1);
    }
  return out;
}

Mask grown(const Mask& mask, int by) {
  return each<unsigned char>(counts_around(mask, by), [](int around) { return around > 0; });
}

Mask thick_parts(const Mask& mask, int sliver) {
  const int all = (2 * sliver + 1) * (2 * sliver + 1);
  const Mask core =
      each<unsigned char>(counts_around(mask, sliver), [all](int around) { return around == all; });
  return both(mask, grown(core, sliver + 1));
}

Picture signed_distances(const Mask& mask, float reach_px) {
  const energies::DistanceGrid to_inside = distances_to(mask, 1, reach_px + 1);
  const energies::DistanceGrid to_outside = distances_to(mask, 0, reach_px + 1);
  Picture out(mask.width, mask.height);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float beyond = mask.values[i] ? to_outside.distance_px[i] : to_inside.distance_px[i];
    const float distance = std::min(beyond - 0.5f, reach_px);
    out.values[i] = mask.values[i] ? -distance : distance;
  }
  return out;
}

Pieces pieces_of(const Mask& mask) {
  Pieces out;
  out.numbers = Plane<int>(mask.width, mask.height);
  std::vector<std::pair<int, int>> waiting;
  const auto enter = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= mask.width || y >= mask.height) return;
    if (!mask.row(y)[x] || out.numbers.row(y)[x] != 0) return;
    out.numbers.row(y)[x] = int(out.areas.size()) - 1;
    ++out.areas.back();
    waiting.emplace_back(x, y);
  };
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (!mask.row(y)[x] || out.numbers.row(y)[x] != 0) continue;
      out.areas.push_back(0);
      enter(x, y);
      while (!waiting.empty()) {
        const auto [cx, cy] = waiting.back();
        waiting.pop_back();
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx) enter(cx + dx, cy + dy);
      }
    }
  return out;
}

}  // namespace sdftrack::contour

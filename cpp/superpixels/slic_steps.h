// SPDX-License-Identifier: MIT
// The small steps of slic.cpp, for a row, a cell or a centre.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/to_int.h"
#include "superpixels/center.h"
#include "superpixels/row_ops.h"

namespace sdftrack::superpixels {

// For the next image of a video: how far from the middle of its cell, in cells, a centre may be to be kept;
// from which difference on the colour beneath it has changed, and how much that may then differ from the
// centre's own colour (units of colour).
constexpr double kStays = 1;
constexpr double kChanged = 3;
constexpr double kAlike = 20;

struct PixelPlanes {
  const int* c01;
  const int* c2x;
  const int* z;
  const std::uint8_t* mask;
  int width, height;
};
struct CellBox {
  int x_begin, x_end, y_begin, y_end;
};

// Bytes of interleaved channels to light, a plane for each.
inline void look_up(const std::uint8_t* bytes, int channels, int n, const float* light, float* r, float* g,
                    float* b) {
  // Copied as bits: two of them can be stored at a time.
  const auto put = [light](std::uint8_t byte, float* to) { std::memcpy(to, light + byte, sizeof(float)); };
  if (channels == 1)
    for (int i = 0; i < n; ++i) put(bytes[i], r + i), put(bytes[i], g + i), put(bytes[i], b + i);
  else
    for (int i = 0; i < n; ++i, bytes += 3) put(bytes[0], r + i), put(bytes[1], g + i), put(bytes[2], b + i);
}
inline void split(const float* values, int channels, int n, float* r, float* g, float* b) {
  if (channels == 1)
    for (int i = 0; i < n; ++i) r[i] = g[i] = b[i] = values[i];
  else
    for (int i = 0; i < n; ++i, values += 3) r[i] = values[0], g[i] = values[1], b[i] = values[2];
}

// Depth in units of colour; a missing measurement is the last one to the left, or the row's first.
inline void depth_row(const float* depth_m, int n, double scale, int* z) {
  int i = 0;
  while (i < n && !(depth_m[i] > 0)) ++i;
  int last = i < n ? place_of(double(depth_m[i]), scale) : 0;
  for (i = 0; i < n; ++i) {
    if (depth_m[i] > 0) last = place_of(double(depth_m[i]), scale);
    z[i] = last;
  }
}

// The change of colour around a pixel that is not at the border.
HD std::int64_t color_gradient(const PixelPlanes& p, int x, int y) {
  const std::int64_t i = static_cast<std::int64_t>(y) * p.width + x;
  std::int64_t sum = 0;
  const std::int64_t pairs[2][2] = {{i - 1, i + 1}, {i - p.width, i + p.width}};
  for (const auto& pair : pairs) {
    const std::int64_t d0 = low_of(p.c01[pair[1]]) - low_of(p.c01[pair[0]]);
    const std::int64_t d1 = high_of(p.c01[pair[1]]) - high_of(p.c01[pair[0]]);
    const std::int64_t d2 = low_of(p.c2x[pair[1]]) - low_of(p.c2x[pair[0]]);
    sum += d0 * d0 + d1 * d1 + d2 * d2;
  }
  return sum;
}

// The pixel at a centre's place.
inline std::int64_t pixel_beneath(const PixelPlanes& p, const Center& center, double unit) {
  const int x = std::clamp(to_int(center.x / unit + 0.5), 0, p.width - 1);
  const int y = std::clamp(to_int(center.y / unit + 0.5), 0, p.height - 1);
  return static_cast<std::int64_t>(y) * p.width + x;
}

inline void note_beneath(const PixelPlanes& p, double unit, Center* center) {
  const std::int64_t i = pixel_beneath(p, *center, unit);
  center->beneath[0] = low_of(p.c01[i]), center->beneath[1] = high_of(p.c01[i]);
  center->beneath[2] = low_of(p.c2x[i]);
}

inline double distance2(const int* a, const int* b) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += double(a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

// Whether a centre of the previous image may be kept in this one: it is near its cell, and the colour beneath
// it is unchanged. Centres that move away with the scene leave their cells to others, and the number of
// segments would fall; after a cut no centre fits.
inline bool still_fits(const PixelPlanes& p, const Center& center, const CellBox& box, double unit,
                       double scale) {
  const double dx = center.x / unit - 0.5 * (box.x_begin + box.x_end - 1);
  const double dy = center.y / unit - 0.5 * (box.y_begin + box.y_end - 1);
  if (std::abs(dx) > kStays * (box.x_end - box.x_begin) || std::abs(dy) > kStays * (box.y_end - box.y_begin))
    return false;
  Center now = center;
  note_beneath(p, unit, &now);
  return distance2(now.beneath, center.beneath) <= kChanged * scale * kChanged * scale ||
         distance2(now.beneath, center.color) <= kAlike * scale * kAlike * scale;
}

// The pixel of the cell in the mask that is nearest to its middle, the first of equals; or false.
HD bool nearest_inside(const PixelPlanes& p, const CellBox& box, int* px, int* py) {
  const int cx = *px, cy = *py;
  std::int64_t best = -1;
  for (int y = box.y_begin; y < box.y_end; ++y)
    for (int x = box.x_begin; x < box.x_end; ++x) {
      const std::int64_t d =
          static_cast<std::int64_t>(x - cx) * (x - cx) + static_cast<std::int64_t>(y - cy) * (y - cy);
      if (p.mask[static_cast<std::int64_t>(y) * p.width + x] && (best < 0 || d < best))
        best = d, *px = x, *py = y;
    }
  return best >= 0;
}

// A cell's middle, moved to the place of least change in its 3 x 3 pixels (Table A.1); of equals the middle
// itself, then the first. Cells of less than 3 pixels, and pixels at the border, are not moved.
HD Center first_center(const PixelPlanes& p, const CellBox& box, double unit) {
  int x = (box.x_begin + box.x_end - 1) / 2, y = (box.y_begin + box.y_end - 1) / 2;
  Center center;
  if (p.mask && !nearest_inside(p, box, &x, &y)) return center;
  if (box.x_end - box.x_begin >= 3 && box.y_end - box.y_begin >= 3 && x > 1 && y > 1 && x < p.width - 2 &&
      y < p.height - 2) {
    std::int64_t least = color_gradient(p, x, y);
    const int x0 = x, y0 = y;
    for (int v = y0 - 1; v <= y0 + 1; ++v)
      for (int u = x0 - 1; u <= x0 + 1; ++u) {
        if (p.mask && !p.mask[static_cast<std::int64_t>(v) * p.width + u]) continue;
        const std::int64_t change = color_gradient(p, u, v);
        if (change < least) least = change, x = u, y = v;
      }
  }
  const std::int64_t i = static_cast<std::int64_t>(y) * p.width + x;
  center.color[0] = low_of(p.c01[i]), center.color[1] = high_of(p.c01[i]), center.color[2] = low_of(p.c2x[i]);
  center.x = place_of(x, unit), center.y = place_of(y, unit);
  center.z = p.z ? p.z[i] : 0;
  center.used = 1;
  return center;
}

// The centres around a used cell; none around an unused one.
inline void find_near(const CellGrid& g, const Center* centers, int i, int j, NearCenters* found) {
  NearCenters& near = *found;
  near.count = 0;
  if (!centers[static_cast<std::int64_t>(j) * g.nx + i].used) return;
  const int x0 = g.x_middle[i], y0 = g.y_middle[j];
  const auto center_at = [&](int id) -> const Center& {
    return centers[static_cast<std::int64_t>(j + id / 3 - 1) * g.nx + i + id % 3 - 1];
  };
  const auto put = [&](int place, int id) {
    const Center& c = center_at(id);
    near.id[place] = id, near.code[place] = code_of(i + id % 3 - 1, j + id / 3 - 1);
    near.c0[place] = c.color[0], near.c1[place] = c.color[1], near.c2[place] = c.color[2];
    near.x[place] = c.x - x0, near.y[place] = c.y - y0, near.z[place] = c.z;
    return c.used;
  };
  if (i > 0 && j > 0 && i + 1 < g.nx &&
      j + 1 < g.ny) {  // nearly always all nine, so that places are constants
    for (int id = 0; id < kNear; ++id) near.count += put(id, id);
    if (near.count == kNear) return;
  }
  int n = 0;
  for (int v = j > 0 ? -1 : 0; v <= (j + 1 < g.ny ? 1 : 0); ++v)
    for (int u = i > 0 ? -1 : 0; u <= (i + 1 < g.nx ? 1 : 0); ++u) n += put(n, 4 + 3 * v + u);
  near.count = n;
  for (const int id = near.id[0]; n < kNear; ++n) put(n, id);
}

// Adds n pixels of a row to the sums of one centre, without those outside the mask.
inline void add_masked(const int* c01, const int* c2x, const std::uint8_t* ids, int n, int x, int y,
                       CenterSums* sums) {
  for (int i = 0; i < n; ++i) {
    if (ids[i] == kOutside) continue;
    ++sums->count, sums->x += x + i, sums->y += y;
    sums->color[0] += low_of(c01[i]), sums->color[1] += high_of(c01[i]), sums->color[2] += low_of(c2x[i]);
  }
}
// The sum of 0, 1, ... n - 1.
inline std::int64_t sum_below(std::int64_t n) { return n * (n - 1) / 2; }

// Adds all pixels of a tile to the sums of one centre; x and y of its first.
inline void add_whole(const RowOps& ops, const CellRows& cell, int x, int y, CenterSums* sums) {
  int color[3];
  ops.sum(cell, color);
  const std::int64_t w = cell.width, h = cell.rows;
  sums->count += w * h, sums->x += h * (w * x + sum_below(w)), sums->y += w * (h * y + sum_below(h));
  for (int k = 0; k < 3; ++k) sums->color[k] += color[k];
}

}  // namespace sdftrack::superpixels

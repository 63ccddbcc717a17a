// SPDX-License-Identifier: MIT
// The small steps of slic.cpp: what is done for a row, a cell or a centre.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "superpixels/center.h"
#include "superpixels/row_ops.h"

namespace sdftrack {

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
  if (channels == 1)
    for (int i = 0; i < n; ++i) r[i] = g[i] = b[i] = light[bytes[i]];
  else
    for (int i = 0; i < n; ++i, bytes += 3)
      r[i] = light[bytes[0]], g[i] = light[bytes[1]], b[i] = light[bytes[2]];
}
inline void split(const float* values, int channels, int n, float* r, float* g, float* b) {
  if (channels == 1)
    for (int i = 0; i < n; ++i) r[i] = g[i] = b[i] = values[i];
  else
    for (int i = 0; i < n; ++i, values += 3) r[i] = values[0], g[i] = values[1], b[i] = values[2];
}

// Depth in units of colour. Where there is none it is the last reading to the left, or else the first of the
// row.
inline void depth_row(const float* depth_m, int n, double scale, int* z) {
  int i = 0;
  while (i < n && !(depth_m[i] > 0)) ++i;
  int last = i < n ? place_of(static_cast<double>(depth_m[i]), scale) : 0;
  for (i = 0; i < n; ++i) {
    if (depth_m[i] > 0) last = place_of(static_cast<double>(depth_m[i]), scale);
    z[i] = last;
  }
}

// How much the colour changes around a pixel that is not at the border.
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

HD bool cell_used(const PixelPlanes& p, const CellBox& box) {
  for (int y = box.y_begin; y < box.y_end; ++y)
    for (int x = box.x_begin; x < box.x_end; ++x)
      if (p.mask[static_cast<std::int64_t>(y) * p.width + x]) return true;
  return false;
}

// The pixel of the cell inside the mask that is nearest to its middle, the first of equals; false: there is
// none.
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

// A cell's middle, moved to the place of least change in its 3 x 3 pixels (Table A.1), its own of equals,
// then the first. Cells of less than 3 pixels, and pixels at the border, stay.
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

// The centres around a cell that is used; none around one that is not.
inline NearCenters near_centers(const CellGrid& g, const Center* centers, int i, int j) {
  NearCenters near;
  if (!centers[static_cast<std::int64_t>(j) * g.nx + i].used) return near;
  const int x0 = g.x_middle[static_cast<std::size_t>(i)], y0 = g.y_middle[static_cast<std::size_t>(j)];
  int n = 0;
  for (int v = -1; v <= 1; ++v) {
    if (j + v < 0 || j + v >= g.ny) continue;
    const Center* const row = centers + static_cast<std::int64_t>(j + v) * g.nx + i;
    for (int u = i > 0 ? -1 : 0; u <= (i + 1 < g.nx ? 1 : 0); ++u) {
      const Center& c = row[u];
      near.id[n] = 4 + 3 * v + u;
      near.c01[n] = pair_of(c.color[0], c.color[1]), near.c2x[n] = pair_of(c.color[2], c.x - x0);
      near.y[n] = c.y - y0, near.z[n] = c.z;
      n += c.used;
    }
  }
  near.count = n;
  return near;
}

// Adds n pixels of a row to the sums of one centre, those outside the mask left out.
inline void add_masked(const int* c01, const int* c2x, const std::uint8_t* ids, int n, int x, int y,
                       CenterSums* sums) {
  for (int i = 0; i < n; ++i) {
    if (ids[i] == kOutside) continue;
    ++sums->count, sums->x += x + i, sums->y += y;
    sums->color[0] += low_of(c01[i]), sums->color[1] += high_of(c01[i]), sums->color[2] += low_of(c2x[i]);
  }
}
inline void add_whole(const RowOps& ops, const int* c01, const int* c2x, int n, int x, int y,
                      CenterSums* sums) {
  constexpr int kAtOnce = 1 << 16;  // 2^16 * 2^14 fits into 31 bits
  for (int i = 0; i < n; i += kAtOnce) {
    const int some = n - i < kAtOnce ? n - i : kAtOnce;
    int color[3] = {0, 0, 0};
    ops.sum(c01 + i, c2x + i, some, color);
    for (int k = 0; k < 3; ++k) sums->color[k] += color[k];
  }
  sums->count += n, sums->y += static_cast<std::int64_t>(n) * y;
  sums->x += static_cast<std::int64_t>(n) * (2 * x + n - 1) / 2;
}

// What the sums of the 9 centres around a cell gain and lose, two numbers of 32 bits to a word: enough for a
// tile (kTile pixels of less than 2^14 each), half the work of one word for each.
struct Gains {
  std::int64_t c01 = 0, c2n = 0, xy = 0, z = 0;

  template <bool kDepth, int kSign>
  void add(const Gains& pixel) {
    c01 += kSign * pixel.c01, c2n += kSign * pixel.c2n, xy += kSign * pixel.xy;
    if constexpr (kDepth) z += kSign * pixel.z;
  }
};

inline std::int64_t two_of(std::int64_t low, std::int64_t high) {
  return high * (std::int64_t{1} << 32) + low;
}
inline int low_word(std::int64_t two) { return static_cast<std::int32_t>(two); }
inline int high_word(std::int64_t two) { return static_cast<int>((two - low_word(two)) >> 32); }

// Into the sums, and 0 from then on; x and y of the tile's first pixel.
inline void settle(Gains* owed, int x, int y, CenterSums* sums) {
  const Gains gains = *owed;
  *owed = Gains{};
  const std::int64_t n = high_word(gains.c2n);
  sums->count += n;
  sums->color[0] += low_word(gains.c01), sums->color[1] += high_word(gains.c01);
  sums->color[2] += low_word(gains.c2n);
  sums->x += low_word(gains.xy) + n * x, sums->y += high_word(gains.xy) + n * y;
  sums->z += gains.z;
}

// The pixels of a tile that have a new centre.
template <bool kDepth>
void move_pixels(const CellRows& cell, const Tile& tile, int changed, std::uint8_t* ids, Gains* gains) {
  for (int i = 0; i < changed; ++i) {
    const int row = tile.changed[i] >> 16, x = tile.changed[i] & 0xffff;
    const std::ptrdiff_t at = row * cell.stride + x;
    const int was = ids[at], now = tile.now[row * tile.stride + x];
    const int c01 = cell.c01[at], c2x = cell.c2x[at];
    Gains pixel{two_of(low_of(c01), high_of(c01)), two_of(low_of(c2x), 1), two_of(x, row)};
    if constexpr (kDepth) pixel.z = cell.z[at];
    gains[was].template add<kDepth, -1>(pixel), gains[now].template add<kDepth, 1>(pixel);
    ids[at] = static_cast<std::uint8_t>(now);
  }
}

// Writes the runs of a row, each where the centre changes, and returns how many there are.
inline int find_runs(const CellGrid& g, const std::uint8_t* near, int y, int band, int* start, int* center) {
  const int first = y * g.width;
  int last = -2, found = 0, offset[kNear];
  for (int k = 0; k < kNear; ++k) offset[k] = (k / 3 - 1) * g.nx + k % 3 - 1;
  for (int i = 0; i < g.nx; ++i) {
    const int begin = g.x_begin[static_cast<std::size_t>(i)],
              end = g.x_begin[static_cast<std::size_t>(i) + 1];
    const int home = band * g.nx + i;
    for (int x = begin; x < end;) {
      const int k = near[x];
      const int of = k == kOutside ? -1 : home + offset[k];
      start[found] = first + x, center[found] = of;
      found += of != last, last = of;
      // To the next byte that differs, 8 at a time.
      for (++x; x < end;) {
        std::uint64_t word;
        std::memcpy(&word, near + x, 8);
        word ^= 0x0101010101010101u * static_cast<std::uint64_t>(k);
        const int same = word == 0 ? 8 : std::countr_zero(word) / 8;
        x += same;
        if (same < 8) break;
      }
    }
  }
  return found;
}

}  // namespace sdftrack

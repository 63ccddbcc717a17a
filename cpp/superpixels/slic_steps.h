// SPDX-License-Identifier: MIT
// The small steps of slic.cpp: what is done for a row, a cell or a centre.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "superpixels/center.h"
#include "superpixels/connect.h"
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
struct PixelRun {
  const int* c01;
  const int* c2x;
  const int* z;
};

// Bytes of interleaved channels to light, a plane for each.
inline void look_up(const std::uint8_t* bytes, int channels, int n, const float* light, float* r, float* g, float* b) {
  if (channels == 1)
    for (int i = 0; i < n; ++i) r[i] = g[i] = b[i] = light[bytes[i]];
  else
    for (int i = 0; i < n; ++i, bytes += 3) r[i] = light[bytes[0]], g[i] = light[bytes[1]], b[i] = light[bytes[2]];
}
inline void split(const float* values, int channels, int n, float* r, float* g, float* b) {
  if (channels == 1)
    for (int i = 0; i < n; ++i) r[i] = g[i] = b[i] = values[i];
  else
    for (int i = 0; i < n; ++i, values += 3) r[i] = values[0], g[i] = values[1], b[i] = values[2];
}

// Depth in units of colour. Where there is none it is the last reading to the left, or else the first of the row.
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

// The pixel of the cell inside the mask that is nearest to its middle, the first of equals; false: there is none.
HD bool nearest_inside(const PixelPlanes& p, const CellBox& box, int* px, int* py) {
  const int cx = *px, cy = *py;
  std::int64_t best = -1;
  for (int y = box.y_begin; y < box.y_end; ++y)
    for (int x = box.x_begin; x < box.x_end; ++x) {
      const std::int64_t d = static_cast<std::int64_t>(x - cx) * (x - cx) + static_cast<std::int64_t>(y - cy) * (y - cy);
      if (p.mask[static_cast<std::int64_t>(y) * p.width + x] && (best < 0 || d < best)) best = d, *px = x, *py = y;
    }
  return best >= 0;
}

// A cell's middle, moved to the place of least change in its 3 x 3 pixels (Table A.1), its own of equals, then the
// first. Cells of less than 3 pixels, and pixels at the border, stay.
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
  for (int k = 0; k < kNear; ++k) {
    const int u = i + k % 3 - 1, v = j + k / 3 - 1;
    if (u < 0 || u >= g.nx || v < 0 || v >= g.ny) continue;
    const Center& c = centers[static_cast<std::int64_t>(v) * g.nx + u];
    if (!c.used) continue;
    const int n = near.count++;
    near.id[n] = k;
    near.c01[n] = pair_of(c.color[0], c.color[1]), near.c2x[n] = pair_of(c.color[2], c.x - x0);
    near.y[n] = c.y - y0, near.z[n] = c.z;
  }
  return near;
}

// Adds n pixels of a row to the sums of one centre; those outside the mask (near: kOutside) are left out.
inline void add_run(const int* c01, const int* c2x, const int* z, const std::uint8_t* near, int n, int x, int y,
                    CenterSums* sums) {
  constexpr int kAtOnce = 1 << 16;  // 2^16 * 2^15 fits
  for (int begin = 0; begin < n; begin += kAtOnce) {
    const int end = n - begin < kAtOnce ? n : begin + kAtOnce;
    int count = 0, s0 = 0, s1 = 0, s2 = 0;
    std::int64_t sx = 0, sz = 0;
    for (int i = begin; i < end; ++i) {
      const int in = near ? -(near[i] != 255) : -1;
      s0 += low_of(c01[i]) & in, s1 += high_of(c01[i]) & in, s2 += low_of(c2x[i]) & in;
      count -= in;
    }
    if (near)
      for (int i = begin; i < end; ++i) sx += near[i] != 255 ? x + i : 0;
    else
      sx = static_cast<std::int64_t>(end - begin) * (2 * x + begin + end - 1) / 2;
    if (z)
      for (int i = begin; i < end; ++i) sz += !near || near[i] != 255 ? z[i] : 0;
    sums->count += count, sums->x += sx, sums->y += static_cast<std::int64_t>(count) * y, sums->z += sz;
    sums->color[0] += s0, sums->color[1] += s1, sums->color[2] += s2;
  }
}

// Takes pixels that have a new centre from the sums of the old to those of the new. `now` has room for a word.
inline void move_pixels(const PixelRun& p, const std::uint8_t* now, std::uint8_t* was, int n, int x, int y,
                        CenterSums* const* around) {
  for (int i = 0; i < n; i += 8) {
    std::uint64_t a, b;
    std::memcpy(&a, now + i, 8), std::memcpy(&b, was + i, 8);
    std::uint64_t differ = a ^ b;
    if (n - i < 8) differ &= (std::uint64_t{1} << 8 * (n - i)) - 1;
    while (differ != 0) {
      const int k = i + std::countr_zero(differ) / 8;
      differ &= ~(std::uint64_t{255} << 8 * (k - i));
      if (was[k] == 255) continue;  // outside the mask
      CenterSums& from = *around[was[k]];
      CenterSums& to = *around[now[k]];
      was[k] = now[k];
      const int c0 = low_of(p.c01[k]), c1 = high_of(p.c01[k]), c2 = low_of(p.c2x[k]);
      --from.count, from.color[0] -= c0, from.color[1] -= c1, from.color[2] -= c2, from.x -= x + k, from.y -= y;
      ++to.count, to.color[0] += c0, to.color[1] += c1, to.color[2] += c2, to.x += x + k, to.y += y;
      if (p.z) from.z -= p.z[k], to.z += p.z[k];
    }
  }
}

// The runs of a row: where the centre changes.
inline void find_runs(const CellGrid& g, const std::uint8_t* near, int y, int band, Connect* connect) {
  const int first = y * g.width;
  int last = -2;
  for (int i = 0; i < g.nx; ++i) {
    const int begin = g.x_begin[static_cast<std::size_t>(i)], end = g.x_begin[static_cast<std::size_t>(i) + 1];
    const int home = band * g.nx + i;
    for (int x = begin; x < end;) {
      const int k = near[x];
      const int center = k == 255 ? -1 : home + (k / 3 - 1) * g.nx + k % 3 - 1;
      if (center != last) connect->add(first + x, center), last = center;
      // To the next byte that differs, 8 at a time.
      for (++x; x < end;) {
        std::uint64_t word;
        std::memcpy(&word, near + x, 8);
        word ^= 0x0101010101010101u * static_cast<std::uint64_t>(k);
        const int same = word == 0 ? 8 : std::countr_zero(word) / 8;
        x += same;
        if (same < 8) break;
      }
      if (x > end) x = end;
    }
  }
  connect->end_row();
}

}  // namespace sdftrack

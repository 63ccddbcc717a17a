// SPDX-License-Identifier: MIT
// Colours and the rounds of k-means on the device: the steps of slic.cpp, a thread for each pixel or cell.
// Each kernel is a struct that is called as every thread.
#pragma once

#include "superpixels/slic_planes.cuh"

namespace sdftrack::superpixels {

constexpr int kPart = 4096;  // pixels of a cell that one block sums

struct ConvertPixels {
  static constexpr const char* kName = "superpixels: convert pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    if (blockIdx.x == 0 && threadIdx.x == 0) *p.counters = SlicCounters{};
    each_of_mine(s.pixels(), [&](int i) {
      float v[3];
      for (int k = 0; k < 3; ++k) {
        const std::int64_t from = static_cast<std::int64_t>(i) * s.channels + (s.channels == 3 ? k : 0);
        if (p.bytes)
          v[k] = p.light[p.bytes[from]];
        else
          v[k] = s.space == ColorSpace::kRgb ? p.floats[from] : linear_light(p.floats[from]);
      }
      const ColorFeature<float> f =
          s.space == ColorSpace::kLab   ? color_feature<ColorSpace::kLab>(v[0], v[1], v[2], s.scale)
          : s.space == ColorSpace::kXyz ? color_feature<ColorSpace::kXyz>(v[0], v[1], v[2], s.scale)
                                        : color_feature<ColorSpace::kRgb>(v[0], v[1], v[2], s.scale);
      p.c01[i] = pair_of(f.c0, f.c1), p.c2x[i] = pair_of(f.c2, p.x_place[i % s.width]);
      p.center[i] = -1;
    });
  }
};

// The first centres, where round 0 takes those of the round before it, and no sums.
struct PlaceCenters {
  static constexpr const char* kName = "superpixels: place centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    const PixelPlanes planes{p.c01, p.c2x, p.z, p.mask, s.width, s.height};
    each_of_mine(s.cells(), [&](int c) {
      const int i = c % s.nx, j = c / s.nx;
      p.centers[s.center_at(1, c)] =
          first_center(planes, {p.x_begin[i], p.x_begin[i + 1], p.y_begin[j], p.y_begin[j + 1]}, s.unit);
      p.number[c] = 0;
      for (int round = 0; round < 3; ++round)
        for (int k = 0; k < kSums; ++k) p.sums[s.sums_at(round, c) + k] = 0;
    });
  }
};

// The centre that round `round` starts from: that of the round before, moved to the mean of its pixels. Who
// wants it makes it, so that no kernel does nothing else.
struct MovedCenter {
  Center center;
  std::int64_t way = 0;
};
__device__ inline MovedCenter moved_center(const SlicPlanes& p, const SlicShape& s, int round, int c) {
  MovedCenter out{p.centers[s.center_at(round + 1, c)]};
  if (round == 0 || !out.center.used) return out;
  const Word* const from = p.sums + s.sums_at(round + 2, c);
  std::int64_t v[kSums];
  for (int k = 0; k < kSums; ++k) v[k] = static_cast<std::int64_t>(from[k]);
  out.way = move_center({{v[1], v[2], v[3]}, v[0], v[4], v[5], v[6]}, s.unit, &out.center);
  return out;
}
__device__ inline void add_way(const SlicPlanes& p, int round, std::int64_t way) {
  if (way != 0)
    atomicAdd(reinterpret_cast<Word*>(&p.counters->moved[ring_slot(round)]), static_cast<Word>(way));
}
// Nothing has moved in the round before the last: nothing will.
__device__ inline bool rounds_ended(const SlicPlanes& p, int round) {
  return round >= 2 && p.counters->moved[ring_slot(round - 2)] == 0;
}
// After `rounds` of them: how far their last one takes the centres.
__device__ inline void end_rounds(const SlicPlanes& p, const SlicShape& s, int rounds) {
  if (rounds_ended(p, rounds)) return;
  each_of_mine(s.cells(), [&](int c) { add_way(p, rounds - 1, moved_center(p, s, rounds, c).way); });
}

// |p - c|^2, or d_lab + (m / S) d_xy: what row_loops.h compares, in the same order.
__device__ inline float thesis_cost(int color, int place) {
  return sqrt(static_cast<float>(color)) + sqrt(static_cast<float>(place));
}

__device__ inline int warp_sum(int value) {
  for (int by = 16; by > 0; by /= 2) value += __shfl_down_sync(0xffffffffu, value, by);
  return value;
}

// What pixels compare with: a centre, in a block's own memory.
struct NearCenter {
  int color[3], x, y, z, used;
};

// A block for each part of a cell: the nearest of 9 centres for its pixels, and their sums, first in a warp,
// then in the block's own memory, then in the device's.
struct AssignPixels {
  static constexpr const char* kName = "superpixels: assign pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round, parts;  // of a cell
  __device__ void operator()() const {
    SDFTRACK_SHARED(NearCenter[kNear], near);
    SDFTRACK_SHARED(Word[kNear][kSums], sums);
    if (rounds_ended(p, round)) return;
    const int cell = static_cast<int>(blockIdx.x) / parts, part = static_cast<int>(blockIdx.x) % parts;
    const int i = cell % s.nx, j = cell / s.nx, me = static_cast<int>(threadIdx.x);
    if (me < kNear) near[me] = near_center(i, j, me, part == 0);
    if (me < kNear * kSums) sums[me / kSums][me % kSums] = 0;
    __syncthreads();
    const std::int64_t w = p.x_begin[i + 1] - p.x_begin[i], area = w * (p.y_begin[j + 1] - p.y_begin[j]);
    const std::int64_t first = static_cast<std::int64_t>(part) * kPart,
                       end = area < first + kPart ? area : first + kPart;
    for (std::int64_t warp = first + me / 32 * 32; warp < end; warp += kBlockThreads)
      assign_warp(i, j, static_cast<int>(w), warp, end, near, sums);
    __syncthreads();
    if (me < kNear && sums[me][0] != 0) {
      Word* const to = p.sums + s.sums_at(round, neighbor(cell, me));
      for (int v = 0; v < kSums; ++v) atomicAdd(&to[v], sums[me][v]);
    }
  }

 private:
  __device__ int neighbor(int cell, int k) const { return cell + (k / 3 - 1) * s.nx + k % 3 - 1; }

  // The block of the cell's first part keeps the cell's own centre, and clears what the next rounds add to.
  __device__ NearCenter near_center(int i, int j, int k, bool keeps) const {
    const int u = i + k % 3 - 1, v = j + k / 3 - 1, c = v * s.nx + u;
    if (u < 0 || u >= s.nx || v < 0 || v >= s.ny) return {};
    const MovedCenter moved = moved_center(p, s, round, c);
    if (k == kNear / 2 && keeps) {
      p.centers[s.center_at(round, c)] = moved.center;
      for (int n = 0; n < kSums; ++n) p.sums[s.sums_at(round + 1, c) + n] = 0;
      if (round > 0) add_way(p, round - 1, moved.way);
      if (c == 0) p.counters->moved[ring_slot(round + kAhead)] = 0;
    }
    const Center& m = moved.center;
    return {{m.color[0], m.color[1], m.color[2]}, m.x, m.y, m.z, m.used};
  }

  // 32 pixels of a cell from its `warp`-th on: one for each lane.
  __device__ void assign_warp(int i, int j, int w, std::int64_t warp, std::int64_t end,
                              const NearCenter* near, Word (*sums)[kSums]) const {
    const int lane = static_cast<int>(threadIdx.x) % 32;
    const std::int64_t n = warp + lane;
    const int row = static_cast<int>(n / w), first_row = static_cast<int>(warp / w);
    const int x0 = p.x_begin[i], y0 = p.y_begin[j];
    int id = -1, a = 0, b = 0, c = 0, z = 0;
    if (n < end) {
      const int y = y0 + row, at = y * s.width + x0 + static_cast<int>(n % w);
      if (!p.mask || p.mask[at]) {
        a = low_of(p.c01[at]), b = high_of(p.c01[at]), c = low_of(p.c2x[at]), z = p.z ? p.z[at] : 0;
        id = nearest(a, b, c, z, high_of(p.c2x[at]) + p.x_middle[i], p.y_place[y] + p.y_middle[j], near);
        p.center[at] = neighbor(j * s.nx + i, id);
      }
    }
    const int place = lane | (row - first_row) << 16;  // both sums are below 2^10
    for (int k = 0; k < kNear; ++k) {
      const bool mine = id == k;
      const unsigned these = __ballot_sync(0xffffffffu, mine);
      if (these == 0) continue;
      const int sum_a = warp_sum(mine ? a : 0), sum_b = warp_sum(mine ? b : 0),
                sum_c = warp_sum(mine ? c : 0), sum_z = p.z ? warp_sum(mine ? z : 0) : 0,
                sum_place = warp_sum(mine ? place : 0);
      if (lane != 0) continue;
      const std::int64_t count = __popc(these), rows = count * first_row + (sum_place >> 16),
                         numbers = count * warp + (sum_place & 0xffff);
      const std::int64_t values[kSums] = {
          count, sum_a, sum_b, sum_c, count * x0 + numbers - rows * w, count * y0 + rows, sum_z};
      for (int v = 0; v < kSums; ++v) atomicAdd(&sums[k][v], static_cast<Word>(values[v]));
    }
  }

  // x and y in units of place.
  __device__ int nearest(int a, int b, int c, int z, int x, int y, const NearCenter* near) const {
    int best_id = -1, best = 0;
    float best_cost = 0;
    for (int k = 0; k < kNear; ++k) {
      const NearCenter& o = near[k];
      if (!o.used) continue;
      const int d0 = a - o.color[0], d1 = b - o.color[1], d2 = c - o.color[2], dz = z - (p.z ? o.z : 0);
      const int dx = x - o.x, dy = y - o.y;
      const int color = d0 * d0 + d1 * d1 + d2 * d2 + dz * dz, place = dx * dx + dy * dy;
      if (s.distance == SlicDistance::kThesis) {
        const float cost = thesis_cost(color, place);
        if (best_id < 0 || cost < best_cost) best_cost = cost, best_id = k;
      } else if (best_id < 0 || color + place < best) {
        best = color + place, best_id = k;
      }
    }
    return best_id;
  }
};

}  // namespace sdftrack::superpixels

// SPDX-License-Identifier: MIT
// Colours and the rounds of k-means on the device: the steps of slic.cpp, a thread for each pixel or cell.
// Each kernel is a struct whose operator() runs in every thread.
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

// The initial centres, with zero sums.
struct PlaceCenters {
  static constexpr const char* kName = "superpixels: place centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    const PixelPlanes planes{p.c01, p.c2x, p.z, p.mask, s.width, s.height};
    each_of_mine(s.cells(), [&](int c) {
      const int i = c % s.nx, j = c / s.nx;
      p.centers[s.center_at(0, c)] =
          first_center(planes, {p.x_begin[i], p.x_begin[i + 1], p.y_begin[j], p.y_begin[j + 1]}, s.unit);
      p.number[c] = 0;
      for (int round = 0; round < 3; ++round)
        for (int k = 0; k < kSums; ++k) p.sums[s.sums_at(round, c) + k] = 0;
    });
  }
};

// Nothing moved in the round before the last, so nothing will.
__device__ inline bool rounds_ended(const SlicPlanes& p, int round) {
  return round >= 2 && p.counters->moved[ring_slot(round - 2)] == 0;
}

// The centres at the start of round `round`: those of the round before, moved to the mean of their pixels.
// After the last round only their motion is computed.
struct MoveCenters {
  static constexpr const char* kName = "superpixels: move centers";
  static constexpr int kThreads = 64;  // few cells, which long divisions keep busy: on many multiprocessors
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (rounds_ended(p, round)) return;
    if (blockIdx.x == 0 && threadIdx.x == 0) p.counters->moved[ring_slot(round + kAhead)] = 0;
    const int c = int(blockIdx.x) * kThreads + int(threadIdx.x);
    if (c >= s.cells()) return;
    Center center = p.centers[s.center_at(round + 1, c)];
    if (center.used) {
      const Word* const from = p.sums + s.sums_at(round + 2, c);
      std::int64_t v[kSums];
      for (int k = 0; k < kSums; ++k) v[k] = static_cast<std::int64_t>(from[k]);
      const std::int64_t way = move_center({{v[1], v[2], v[3]}, v[0], v[4], v[5], v[6]}, s.unit, &center);
      if (way != 0)
        atomicAdd(reinterpret_cast<Word*>(&p.counters->moved[ring_slot(round - 1)]), static_cast<Word>(way));
    }
    p.centers[s.center_at(round, c)] = center;
    for (int n = 0; n < kSums; ++n) p.sums[s.sums_at(round + 1, c) + n] = 0;
  }
};

// |p - c|^2, or d_lab + (m / S) d_xy: compared as in row_loops.h, in the same order.
__device__ inline float thesis_cost(int color, int place) { return sqrt(float(color)) + sqrt(float(place)); }

__device__ inline int warp_sum(int value) {
  for (int by = 16; by > 0; by /= 2) value += __shfl_down_sync(0xffffffffu, value, by);
  return value;
}

// A centre to compare pixels with, in a block's shared memory.
struct NearCenter {
  int color[3], x, y, z, used;
};

// A block for each part of a cell: the nearest of 9 centres for its pixels, and their sums, first in a warp,
// then in shared memory, then in the device's memory. The sums of a part fit into 32 bits.
struct AssignPixels {
  static constexpr const char* kName = "superpixels: assign pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round, parts;  // of a cell
  __device__ void operator()() const {
    SDFTRACK_SHARED(NearCenter[kNear], near);
    SDFTRACK_SHARED(int[kNear][kSums], sums);
    if (rounds_ended(p, round)) return;
    const int cell = int(blockIdx.x) / parts, part = int(blockIdx.x) % parts;
    const int i = cell % s.nx, j = cell / s.nx, me = int(threadIdx.x);
    if (me < kNear) near[me] = near_center(i, j, me);
    if (me < kNear * kSums) sums[me / kSums][me % kSums] = 0;
    __syncthreads();
    const int x0 = p.x_begin[i], y0 = p.y_begin[j];
    const std::int64_t w = p.x_begin[i + 1] - x0, area = w * (p.y_begin[j + 1] - y0);
    const std::int64_t first = static_cast<std::int64_t>(part) * kPart,
                       end = area < first + kPart ? area : first + kPart;
    const int first_row = int(first / w);
    for (std::int64_t warp = first + me / 32 * 32; warp < end; warp += kBlockThreads)
      assign_warp({i, j, x0, y0, int(w), first_row, first}, warp, end, near, sums);
    __syncthreads();
    if (me >= kNear * kSums) return;
    const int k = me / kSums, v = me % kSums, count = sums[k][0];
    if (count == 0) return;
    std::int64_t sum = sums[k][v];
    if (v == 4) sum += count * (x0 + first - first_row * w) - sums[k][5] * w;  // from places in the part to x
    if (v == 5) sum += std::int64_t{count} * (y0 + first_row);
    atomicAdd(&p.sums[s.sums_at(round, neighbor(cell, k)) + v], static_cast<Word>(sum));
  }

 private:
  struct Cell {
    int i, j, x0, y0, w, first_row;
    std::int64_t first;  // pixel of the part, in first_row
  };
  __device__ int neighbor(int cell, int k) const { return cell + (k / 3 - 1) * s.nx + k % 3 - 1; }

  __device__ NearCenter near_center(int i, int j, int k) const {
    const int u = i + k % 3 - 1, v = j + k / 3 - 1;
    if (u < 0 || u >= s.nx || v < 0 || v >= s.ny) return {};
    const Center& m = p.centers[s.center_at(round, v * s.nx + u)];
    return {{m.color[0], m.color[1], m.color[2]}, m.x, m.y, m.z, m.used};
  }

  // 32 pixels of a cell from its `warp`-th on: one for each lane.
  __device__ void assign_warp(const Cell& in, std::int64_t warp, std::int64_t end, const NearCenter* near,
                              int (*sums)[kSums]) const {
    const int lane = int(threadIdx.x) % 32;
    const std::int64_t n = warp + lane;
    const int row = int(n / in.w), column = int(n - static_cast<std::int64_t>(row) * in.w);
    int id = -1, v[kSums] = {1, 0, 0, 0, int(n - in.first), row - in.first_row, 0};
    if (n < end) {
      const int y = in.y0 + row, at = y * s.width + in.x0 + column;
      if (!p.mask || p.mask[at]) {
        v[1] = low_of(p.c01[at]), v[2] = high_of(p.c01[at]), v[3] = low_of(p.c2x[at]),
        v[6] = p.z ? p.z[at] : 0;
        id = nearest(v[1], v[2], v[3], v[6], high_of(p.c2x[at]) + p.x_middle[in.i],
                     p.y_place[y] + p.y_middle[in.j], near);
        p.center[at] = neighbor(in.j * s.nx + in.i, id);
      }
    }
    for (int k = 0; k < kNear; ++k) {
      const bool mine = id == k;
      const unsigned these = __ballot_sync(0xffffffffu, mine);
      if (these == 0) continue;
      for (int n_sum = 1; n_sum < kSums; ++n_sum) {
        if (n_sum == 6 && !p.z) break;
        const int sum = warp_sum(mine ? v[n_sum] : 0);
        if (lane == 0) atomicAdd(&sums[k][n_sum], sum);
      }
      if (lane == 0) atomicAdd(&sums[k][0], __popc(these));
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

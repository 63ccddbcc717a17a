// SPDX-License-Identifier: MIT
// Superpixels on the device: the steps of slic.cpp and connect.cpp, a thread for each pixel, cell or centre.
// All sums are of whole numbers, so the order of the atomics has no say and the labels are the CPU's.
#pragma once

#include <cstdint>

#include "base/launch.cuh"
#include "superpixels/slic_steps.h"

namespace sdftrack::superpixels {

using Word = unsigned long long;  // what atomics take

// Everything on the device. Borrowed.
struct SlicPlanes {
  const std::uint8_t* bytes;
  const float* floats;
  const std::uint8_t* mask;
  const float* light;  // of a byte
  const int *x_begin, *y_begin, *x_middle, *y_middle, *x_place, *y_place;
  const int* z;  // may be null
  int *c01, *c2x, *center, *parent, *size, *labels;
  Word* best;  // of a region: its choice
  Center* centers;
  Word* sums;           // 7 for each centre
  int* block_count;     // roots in each block of pixels
  int* number;          // of centres, without connectivity
  std::int64_t* moved;  // in each of kRoundsAtOnce iterations
  int* joined;          // in each of kJoinsAtOnce rounds
  int* segments;
};
struct SlicShape {
  int width, height, channels, nx, ny;
  double unit;
  float scale;
  int first_label, min_size;
  ColorSpace space;
  SlicDistance distance;

  HD int pixels() const { return width * height; }
  HD int cells() const { return nx * ny; }
};

constexpr int kBlockThreads = 256;
constexpr int kRoundsAtOnce = 10, kJoinsAtOnce = 4;  // until the host looks whether it is done
constexpr int kPart = 4096;                          // pixels of a cell that one block sums: 2^12 * 2^15 fits

__device__ inline int thread_index() { return blockIdx.x * kBlockThreads + threadIdx.x; }
__device__ inline int thread_total() { return gridDim.x * kBlockThreads; }

// Each kernel is a struct that is called as every thread.
struct ConvertPixels {
  static constexpr const char* kName = "superpixels: convert pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
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
    }
  }
};

struct PlaceCenters {
  static constexpr const char* kName = "superpixels: place centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    const PixelPlanes planes{p.c01, p.c2x, p.z, p.mask, s.width, s.height};
    for (int c = thread_index(); c < s.cells(); c += thread_total()) {
      const int i = c % s.nx, j = c / s.nx;
      p.centers[c] =
          first_center(planes, {p.x_begin[i], p.x_begin[i + 1], p.y_begin[j], p.y_begin[j + 1]}, s.unit);
    }
  }
};

struct ClearSums {
  static constexpr const char* kName = "superpixels: clear sums";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    for (int c = thread_index(); c < s.cells(); c += thread_total())
      for (int k = 0; k < 7; ++k) p.sums[std::int64_t{7} * c + k] = 0;
  }
};

// |p - c|^2, or d_lab + (m / S) d_xy: what row_loops.h compares, in the same order.
__device__ inline float thesis_cost(int color, int place) {
  return sqrt(static_cast<float>(color)) + sqrt(static_cast<float>(place));
}

// A block for each part of a cell: the nearest of 9 centres for its pixels, and their sums, first in the
// block's own memory, then in the device's.
struct AssignPixels {
  static constexpr const char* kName = "superpixels: assign pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round, parts;  // of a cell
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kNear][7], sums);
    if (round > 0 && p.moved[round - 1] == 0) return;  // nothing has moved: nothing will
    const int cell = blockIdx.x / parts, part = blockIdx.x % parts;
    const int i = cell % s.nx, j = cell / s.nx;
    for (int k = threadIdx.x; k < kNear * 7; k += kBlockThreads) sums[k / 7][k % 7] = 0;
    __syncthreads();
    const int x0 = p.x_begin[i], y0 = p.y_begin[j], w = p.x_begin[i + 1] - x0, h = p.y_begin[j + 1] - y0;
    const std::int64_t area = static_cast<std::int64_t>(w) * h,
                       first = static_cast<std::int64_t>(part) * kPart;
    for (std::int64_t n = first + threadIdx.x; n < area && n < first + kPart; n += kBlockThreads) {
      const int dx = static_cast<int>(n % w), dy = static_cast<int>(n / w);
      const int at = (y0 + dy) * s.width + x0 + dx;
      if (p.mask && !p.mask[at]) continue;
      const int id = nearest(at, y0 + dy, i, j);
      p.center[at] = cell + (id / 3 - 1) * s.nx + id % 3 - 1;
      const int values[7] = {1,  low_of(p.c01[at]), high_of(p.c01[at]), low_of(p.c2x[at]), dx,
                             dy, p.z ? p.z[at] : 0};
      for (int k = 0; k < 7; ++k) atomicAdd(&sums[id][k], values[k]);
    }
    __syncthreads();
    for (int k = threadIdx.x; k < kNear; k += kBlockThreads) {
      const int n = sums[k][0];
      if (n == 0) continue;
      Word* const to = p.sums + std::int64_t{7} * (cell + (k / 3 - 1) * s.nx + k % 3 - 1);
      for (int v = 0; v < 7; ++v) {
        const std::int64_t offset = v == 4 ? x0 : (v == 5 ? y0 : 0);
        atomicAdd(&to[v], static_cast<Word>(sums[k][v] + offset * n));
      }
    }
    __syncthreads();
  }

 private:
  __device__ int nearest(int at, int y, int i, int j) const {
    const int a = low_of(p.c01[at]), b = high_of(p.c01[at]), c = low_of(p.c2x[at]), x = high_of(p.c2x[at]);
    int best_id = -1, best = 0;
    float best_cost = 0;
    for (int k = 0; k < kNear; ++k) {
      const int u = i + k % 3 - 1, v = j + k / 3 - 1;
      if (u < 0 || u >= s.nx || v < 0 || v >= s.ny) continue;
      const Center& o = p.centers[v * s.nx + u];
      if (!o.used) continue;
      const int d0 = a - o.color[0], d1 = b - o.color[1], d2 = c - o.color[2], dz = p.z ? p.z[at] - o.z : 0;
      const int dx = x - (o.x - p.x_middle[i]), dy = p.y_place[y] - (o.y - p.y_middle[j]);
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

struct MoveCenters {
  static constexpr const char* kName = "superpixels: move centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (round > 0 && p.moved[round - 1] == 0) return;
    for (int c = thread_index(); c < s.cells(); c += thread_total()) {
      if (!p.centers[c].used) continue;
      std::int64_t v[7];
      for (int k = 0; k < 7; ++k) v[k] = static_cast<std::int64_t>(p.sums[std::int64_t{7} * c + k]);
      const CenterSums sums{{v[1], v[2], v[3]}, v[0], v[4], v[5], v[6]};
      const std::int64_t way = move_center(sums, s.unit, &p.centers[c]);
      if (way != 0) atomicAdd(reinterpret_cast<Word*>(&p.moved[round]), static_cast<Word>(way));
    }
  }
};

// Connectivity: a pixel's parent is never a later pixel, so that a region's root is its first pixel.
struct StartRegions {
  static constexpr const char* kName = "superpixels: start regions";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      const bool as_left = i % s.width > 0 && p.center[i - 1] == p.center[i];
      p.parent[i] = as_left ? i - 1 : i;
    }
  }
};

__device__ inline int root_of(const int* parent, int i) {
  while (true) {
    const int up = *const_cast<const volatile int*>(parent + i);
    if (up == i) return i;
    i = up;
  }
}

__device__ inline void unite(int* parent, int a, int b) {
  while (true) {
    a = root_of(parent, a), b = root_of(parent, b);
    if (a == b) return;
    const int early = a < b ? a : b, late = a < b ? b : a;
    if (atomicCAS(&parent[late], late, early) == late) return;  // else another was faster: again from there
  }
}

struct JoinPixels {
  static constexpr const char* kName = "superpixels: join pixels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      if (p.center[i] < 0 || i < s.width || p.center[i - s.width] != p.center[i]) continue;
      // The pair to the left has said so already.
      const bool said =
          i % s.width > 0 && p.center[i - 1] == p.center[i] && p.center[i - s.width - 1] == p.center[i];
      if (!said) unite(p.parent, i, i - s.width);
    }
  }
};

// Every parent a root. Others may shorten the same ways meanwhile.
// Rounds after one in which nothing was joined have nothing to do.
__device__ inline bool joins_ended(const SlicPlanes& p, int round) {
  return round > 0 && p.joined[round - 1] == 0;
}

struct Flatten {
  static constexpr const char* kName = "superpixels: flatten";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      const int root = root_of(p.parent, i);
      *const_cast<volatile int*>(p.parent + i) = root;
      p.size[i] = 0, p.best[i] = 0;
    }
  }
};

struct CountSizes {
  static constexpr const char* kName = "superpixels: count sizes";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) atomicAdd(&p.size[p.parent[i]], 1);
  }
};

// The largest neighbour of each small region, of equals the first.
struct ChooseNeighbors {
  static constexpr const char* kName = "superpixels: choose neighbors";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      const int own = p.parent[i];
      if (p.center[i] < 0 || p.size[own] >= s.min_size) continue;
      const int x = i % s.width;
      if (x > 0) tell(own, i - 1);
      if (x + 1 < s.width) tell(own, i + 1);
      if (i >= s.width) tell(own, i - s.width);
      if (i + s.width < s.pixels()) tell(own, i + s.width);
    }
  }
  __device__ void tell(int own, int other) const {
    const int root = p.parent[other];
    if (p.center[other] < 0 || root == own) return;
    const Word key = static_cast<Word>(p.size[root]) << 32 | (0xffffffffu - static_cast<unsigned>(root));
    atomicMax(&p.best[own], key);
  }
};

struct JoinChoices {
  static constexpr const char* kName = "superpixels: join choices";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  int round;
  __device__ void operator()() const {
    if (joins_ended(p, round)) return;
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      if (p.best[i] == 0) continue;
      unite(p.parent, i, static_cast<int>(0xffffffffu - static_cast<unsigned>(p.best[i] & 0xffffffffu)));
      p.joined[round] = 1;
    }
  }
};

// Numbers in the order of the image: roots counted block by block, then added up.
struct CountRoots {
  static constexpr const char* kName = "superpixels: count roots";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int, count);
    if (threadIdx.x == 0) count = 0;
    __syncthreads();
    const int i = thread_index();
    if (i < s.pixels() && p.center[i] >= 0 && p.parent[i] == i) atomicAdd(&count, 1);
    __syncthreads();
    if (threadIdx.x == 0) p.block_count[blockIdx.x] = count;
    __syncthreads();
  }
};

// One block: each count becomes the sum of those before it. A thread adds a stretch of them.
struct AddUp {
  static constexpr const char* kName = "superpixels: add up";
  static constexpr int kThreads = kBlockThreads;
  int* counts;
  int n;
  int* total;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kBlockThreads], sums);
    const int me = static_cast<int>(threadIdx.x), each = (n + kBlockThreads - 1) / kBlockThreads;
    const int first = me * each < n ? me * each : n, last = first + each < n ? first + each : n;
    int own = 0;
    for (int i = first; i < last; ++i) own += counts[i];
    sums[me] = own;
    __syncthreads();
    for (int reach = 1; reach < kBlockThreads; reach *= 2) {
      const int before = me >= reach ? sums[me - reach] : 0;
      __syncthreads();
      sums[me] += before;
      __syncthreads();
    }
    int sum = sums[me] - own;
    for (int i = first; i < last; ++i) {
      const int here = counts[i];
      counts[i] = sum, sum += here;
    }
    if (me == kBlockThreads - 1) *total = sums[me];
  }
};

struct NumberRoots {
  static constexpr const char* kName = "superpixels: number roots";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int[kBlockThreads], is_root);
    const int i = thread_index();
    const bool root = i < s.pixels() && p.center[i] >= 0 && p.parent[i] == i;
    is_root[threadIdx.x] = root;
    __syncthreads();
    if (root) {
      int before = p.block_count[blockIdx.x];
      for (int k = 0; k < static_cast<int>(threadIdx.x); ++k) before += is_root[k];
      p.size[i] = before;  // in place of its size
    }
    __syncthreads();
  }
};

struct WriteLabels {
  static constexpr const char* kName = "superpixels: write labels";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  bool connected;
  __device__ void operator()() const {
    for (int i = thread_index(); i < s.pixels(); i += thread_total()) {
      const int center = p.center[i];
      p.labels[i] = center < 0 ? 0 : s.first_label + (connected ? p.size[p.parent[i]] : p.number[center]);
    }
  }
};

struct MarkCenters {
  static constexpr const char* kName = "superpixels: mark centers";
  static constexpr int kThreads = kBlockThreads;
  SlicPlanes p;
  SlicShape s;
  __device__ void operator()() const {
    for (int i = thread_index(); i < s.pixels(); i += thread_total())
      if (p.center[i] >= 0) p.number[p.center[i]] = 1;
  }
};

}  // namespace sdftrack::superpixels

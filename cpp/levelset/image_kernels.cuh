// SPDX-License-Identifier: MIT
// A frame prepared for fusion on the GPU by the steps of evidence_image.cpp, one thread per pixel of its
// rectangle.
#pragma once

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

struct ReadPixels {
  static constexpr const char* kName = "image: read";
  static constexpr int kThreads = kThreadsPerPixels;
  LensRays lens;
  PixelRect rect;
  const float* depth_m;
  const PixelRole* role;  // of the measured pixels
  EvidencePixel* pixels;
  int* source;
  PixelRole* role_here;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i >= rect.count()) return;
    const int from = source_of(lens, rect, i % rect.width(), i / rect.width());
    const float z = from < 0 ? 0.0f : depth_m[from];
    source[i] = from;
    role_here[i] = readable(z) ? role[from] : PixelRole::kUnknown;
    pixels[i].depth_m = readable(z) ? z : 0.0f;
  }
};

struct FindEdges {
  static constexpr const char* kName = "image: edges";
  static constexpr int kThreads = kThreadsPerPixels;
  ImagePlanes planes;
  float jump_m;
  unsigned char* edge;
  __device__ void operator()() const {
    const int i = global_thread(kThreads), w = planes.width;
    if (i >= w * planes.height) return;
    const int x = i % w, y = i / w;
    edge[i] = (x > 0 && planes.differs(i - 1, i, jump_m)) ||
              (x + 1 < w && planes.differs(i, i + 1, jump_m)) ||
              (y > 0 && planes.differs(i - w, i, jump_m)) ||
              (y + 1 < planes.height && planes.differs(i, i + w, jump_m));
  }
};

// Sets 1 where a 1 is at most `reach` away along the rows (step 1) or the columns (step: width).
struct SpreadEdges {
  static constexpr const char* kName = "image: spread edges";
  static constexpr int kThreads = kThreadsPerPixels;
  int width, height, reach, step;
  const unsigned char* from;
  unsigned char* to;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i >= width * height) return;
    const int at = step == 1 ? i % width : i / width, n = step == 1 ? width : height;
    const int first = most(-reach, -at), last = least(reach, n - 1 - at);
    bool near = false;
    for (int k = first; k <= last && !near; ++k) near = from[i + k * step] != 0;
    to[i] = near;
  }
};

struct JudgePixels {
  static constexpr const char* kName = "image: judge";
  static constexpr int kThreads = kThreadsPerPixels;
  ImagePlanes planes;
  PixelRect rect;
  Intrinsics<float> K;
  EvidenceImageOptions options;
  __device__ void operator()() const {
    const int i = global_thread(kThreads);
    if (i < planes.width * planes.height) planes.judge(i % planes.width, i / planes.width, rect, K, options);
  }
};

// One thread per tile.
struct FindTiles {
  static constexpr const char* kName = "image: tiles";
  static constexpr int kThreads = kThreadsPerPixels;
  const EvidencePixel* pixels;
  int width, height;
  float reach_m;
  Tile* tiles;
  __device__ void operator()() const {
    const int i = global_thread(kThreads), along = tiles_along(width);
    if (i >= along * tiles_along(height)) return;
    const int x0 = kTile * (i % along), y0 = kTile * (i / along);
    Tile own = Tile::empty();
    for (int y = y0; y < least(height, y0 + kTile); ++y)
      for (int x = x0; x < least(width, x0 + kTile); ++x) own.add(pixels[y * width + x], reach_m);
    tiles[i] = own;
  }
};

}  // namespace sdftrack::levelset

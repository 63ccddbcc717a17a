// SPDX-License-Identifier: MIT
// A frame prepared for fusion on the GPU by the steps of evidence_image.cpp, one thread per pixel.
#pragma once

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

// A frame's evidence on the GPU: the blocks on which it can have evidence, and a thread for each of their
// voxels (evidence.cpp is the CPU's version).

struct ChooseBlocks {
  static constexpr const char* kName = "evidence: choose blocks";
  static constexpr int kThreads = kThreadsPerBlocks;
  BlockSight sight;
  DeviceBlocks of;
  __device__ void operator()() const {
    const int b = global_thread(kThreads);
    if (b >= sight.blocks.count()) return;
    of.touched[b] = 0;
    of.marked[b] = !sight.rests(b, of.spoken[b]) && sight.touches(b, of.empty[b]);
  }
};

struct IsMarked {
  static constexpr const char* kName = "blocks: list those chosen";
  const unsigned char* marked;
  __device__ bool operator()(int, int b) const { return marked[b] != 0; }
};

struct FuseBlocks {
  static constexpr const char* kName = "evidence: fuse";
  static constexpr int kThreads = kBlockVoxels;
  EvidenceTerm<float> term;
  BlockSight sight;
  DeviceVoxels voxels;
  DeviceBlocks of;
  BlockList list;
  const unsigned char* rgb;  // of the measurements, or nullptr
  const int* source;         // for each of the image's pixels, the index of its measurement
  float max_weight, color_reach_m;
  __device__ void operator()() const {
    SDFTRACK_SHARED(int, seen);  // the changes in the block
    const int t = int(threadIdx.x);
    for (int k = int(blockIdx.x); k < *list.count; k += int(gridDim.x)) {
      const int b = list.blocks[k];
      if (t == 0) seen = 0;
      __syncthreads();
      if (const int own = fuse_voxel(b, VoxelPlace(t))) atomicOr(&seen, own);
      __syncthreads();
      if (t == 0) note(b, seen);
      __syncthreads();
    }
  }

 private:
  enum Seen { kNear = 1, kTurned = 2, kInside = 4, kUnsure = 8 };

  __device__ int fuse_voxel(int b, const VoxelPlace& at) const {
    std::size_t first;
    const BlockRows rows = sight.blocks.rows(b, &first);
    if (at.x >= rows.nx || at.y >= rows.ny || at.z >= rows.nz) return 0;
    const int row = at.z * rows.ny + at.y;
    const BlockPlace place = sight.place(b);
    const Vec3f p_cam = place.at(rows, row) + float(at.x) * place.x.cast<float>();
    const std::size_t i = first + rows.offset(row) + std::size_t(at.x);
    const Evidence<float> evidence = term.at(p_cam);
    const FusedVoxel<float> now =
        fused(evidence, voxels.log_ratio[i], voxels.weight[i], max_weight, term.form.printed);
    voxels.log_ratio[i] = now.log_ratio, voxels.weight[i] = now.weight;
    if (abs(evidence.distance_m) < color_reach_m) {
      const std::size_t j = colored_pixel(term, p_cam);
      const float slant = term.pixels[4 * j + 1];
      VoxelColor color = voxels.colors[i];
      color.add(color_of(rgb, source[j]), slant * slant);
      voxels.colors[i] = color;
    }
    return (evidence.distance_m < kNoSurface_m ? kNear : 0) | (now.turned ? kTurned : 0) |
           (now.inside ? kInside : 0) | (now.unsure ? kUnsure : 0);
  }
  __device__ void note(int b, int happened) const {
    const bool near = happened & kNear, turned = happened & kTurned;
    of.empty[b] = !near && !(happened & kUnsure);
    if (near && of.spoken[b] < kKnownFrames) ++of.spoken[b];
    of.turned[b] = turned;
    of.touched[b] = near || turned || happened & kInside;
    if (near) of.shown[b] |= kColorNotShown;
  }
};

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

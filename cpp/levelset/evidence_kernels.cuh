// SPDX-License-Identifier: MIT
// A frame's evidence on the GPU: the blocks on which it can have evidence, and a thread for each of their
// voxels (evidence.cpp is the CPU's version).
#pragma once

#include "levelset/device_blocks.cuh"

namespace sdftrack::levelset {

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
    const int t = static_cast<int>(threadIdx.x);
    for (int k = static_cast<int>(blockIdx.x); k < *list.count; k += static_cast<int>(gridDim.x)) {
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
    const Vec3f p_cam = place.at(rows, row) + static_cast<float>(at.x) * place.x.cast<float>();
    const std::size_t i = first + rows.offset(row) + static_cast<std::size_t>(at.x);
    const Evidence<float> said = term.at(p_cam);
    const FusedVoxel<float> now =
        fused(said, voxels.log_ratio[i], voxels.weight[i], max_weight, term.form.printed);
    voxels.log_ratio[i] = now.log_ratio, voxels.weight[i] = now.weight;
    if (abs(said.distance_m) < color_reach_m) {
      const std::size_t j = colored_pixel(term, p_cam);
      const float slant = term.pixels[4 * j + 1];
      VoxelColor color = voxels.colors[i];
      color.add(color_of(rgb, source[j]), slant * slant);
      voxels.colors[i] = color;
    }
    return (said.distance_m < kNoSurface_m ? kNear : 0) | (now.turned ? kTurned : 0) |
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

}  // namespace sdftrack::levelset

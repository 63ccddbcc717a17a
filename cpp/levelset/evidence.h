// SPDX-License-Identifier: MIT
// The evidence of all frames on the voxels of a volume, and the colours seen on the surface.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/large_array.h"
#include "base/rigid.h"
#include "levelset/evidence_blocks.h"

namespace sdftrack::levelset {

struct EvidenceOptions {
  EvidenceForm form;
  SensorNoise noise{0.001f, 0, 0, 0.001f};
  float carve_from_m = 0.003f;
  float min_slant = 0.2f;
  float max_weight = 100;           // limit of a voxel's weight, in frames
  float color_reach_voxels = 2.5f;  // from the surface
  int known_every = 2;              // a block with much evidence takes every n-th frame
};

// Colours of a frame: rgb of each pixel of the evidence image, or nullptr.
struct FrameColors {
  const unsigned char* rgb;  // 3 per pixel of the rectangle
};

// The term that voxels evaluate for a frame's image. `pixels`: the image's pixels, in host or GPU memory.
EvidenceTerm<float> evidence_term(const PixelRect& rect, const float* pixels, const Camera& camera,
                                  const EvidenceOptions& options);
// How far from a measurement of the surface, along its normal, there is evidence.
float evidence_reach_m(const EvidenceOptions& options);

class EvidenceVolume {
 public:
  static constexpr int kBlock = kBlockSide;

  // A volume without evidence; prior: log ratio by voxel, or nullptr for none.
  EvidenceVolume(const sdf::Grid& grid, const float* prior);

  // Adds a frame. Returns the blocks whose surface may have changed, in order.
  const std::vector<int>& fuse(const EvidenceImage& image, const FrameColors& colors, const Camera& camera,
                               const Rigidd& T_cam_obj, const EvidenceOptions& options, int threads);

  // The same evidence in a larger volume, with whole blocks added before and after it along each axis.
  EvidenceVolume padded(const std::array<int, 3>& before, const std::array<int, 3>& after) const;

  // Sets voxels outside that are inside only by the prior and where the object cannot be.
  void bound_guess(const std::function<bool(Vec3d p_obj)>& may_be_inside, int threads);

  // Whether a voxel of this block changed between inside and outside, or was seen for the first time.
  bool turned(int block) const { return turned_[block]; }

  const sdf::Grid& grid() const { return blocks_.grid; }
  const BlockLattice& blocks() const { return blocks_; }
  // Sums over the frames, or the prior where the weight is 0. The mean ratio is log_ratio / weight.
  const LargeArray<float>& log_ratio() const { return log_ratio_; }
  const LargeArray<float>& weight() const { return weight_; }
  using Color = VoxelColor;
  const LargeArray<Color>& colors() const { return colors_; }
  float seen(std::size_t voxel) const { return colors_[voxel].seen_sum(); }

  // All data that frames change, for a copy elsewhere: voxels, blocks, and the number of frames.
  struct Parts {
    float *log_ratio, *weight;
    Color* colors;
    unsigned char *empty, *spoken, *turned;
    int* frame;
  };
  Parts parts() {
    return {log_ratio_.begin(), weight_.begin(), colors_.begin(), empty_.data(),
            spoken_.data(),     turned_.data(),  &frame_};
  }

 private:
  bool fuse_block(  // whether the surface may have changed
      int block, const EvidenceTerm<float>& term, const BlockSight& sight, const EvidenceImage& image,
      const FrameColors& colors, const EvidenceOptions& options);
  void color_row(const EvidenceTerm<float>& term, const EvidenceImage& image, const FrameColors& colors,
                 Vec3f p_cam, Vec3f step_cam, int count, const float* distance_m, float reach_m,
                 std::size_t at);
  void prefetch_block(int block) const;

  BlockLattice blocks_;
  LargeArray<float> log_ratio_, weight_;
  LargeArray<Color> colors_;
  std::vector<Tile> tiles_;
  std::vector<unsigned char> empty_;   // blocks whose voxels are all outside with the highest certainty
  std::vector<unsigned char> spoken_;  // frames with evidence on a block's surface, until it is known
  int frame_ = 0;
  std::vector<unsigned char> turned_, touched_;
  std::vector<int> changed_;
};

}  // namespace sdftrack::levelset

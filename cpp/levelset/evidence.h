// SPDX-License-Identifier: MIT
// What all frames say about the voxels of a volume, and the colours seen on the surface between them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "base/large_array.h"
#include "base/rigid.h"
#include "levelset/evidence_image.h"
#include "levelset/voxel_ops.h"
#include "sdf/grid.h"

namespace sdftrack::levelset {

struct EvidenceOptions {
  EvidenceForm form;
  SensorNoise noise{0.001f, 0, 0, 0.001f};
  float carve_from_m = 0.003f;
  float min_slant = 0.2f;
  float max_weight = 100;           // frames that a voxel remembers
  float color_reach_voxels = 2.5f;  // from the surface
  int known_every = 2;              // a block that many frames have spoken of takes one of so many
};

// Colours of a frame: rgb of each pixel of the evidence image, or nullptr.
struct FrameColors {
  const unsigned char* rgb;  // 3 per pixel of the rectangle
};

class EvidenceVolume {
 public:
  static constexpr int kBlock = 8;

  // No evidence; prior: log ratio by voxel, or nullptr for none.
  EvidenceVolume(const sdf::Grid& grid, const float* prior);

  // Adds a frame. Returns the blocks of which the surface may have changed, in order.
  const std::vector<int>& fuse(const EvidenceImage& image, const FrameColors& colors, const Camera& camera,
                               const Rigidd& T_cam_obj, const EvidenceOptions& options, int threads);

  // The same evidence in a larger volume: whole blocks more before and after it along each axis.
  EvidenceVolume padded(const std::array<int, 3>& before, const std::array<int, 3>& after) const;

  // What is only guessed to be inside, and cannot be, is outside from now on.
  void bound_guess(const std::function<bool(Vec3d p_obj)>& may_be_inside, int threads);

  // Whether in one of these a voxel went from inside to outside or back, or was seen for the first time.
  bool turned(int block) const { return turned_[static_cast<std::size_t>(block)]; }

  const sdf::Grid& grid() const { return grid_; }
  int blocks_x() const { return bx_; }
  int blocks_y() const { return by_; }
  int blocks_z() const { return bz_; }
  // Sums over the frames, the prior where the weight is 0; the mean ratio is log_ratio / weight.
  const LargeArray<float>& log_ratio() const { return log_ratio_; }
  const LargeArray<float>& weight() const { return weight_; }
  // Mean colour (0..255) times 256, and how much was seen within reach of the surface, times 256.
  struct Color {
    std::uint16_t r, g, b, seen;
  };
  const LargeArray<Color>& colors() const { return colors_; }
  float seen(std::size_t voxel) const { return static_cast<float>(colors_[voxel].seen) / kSeenScale; }
  static constexpr float kSeenScale = 256;

 private:
  bool touches(int block, const Rigidd& T_cam_obj, const Camera& camera, const EvidenceImage& image) const;
  void find_tiles(const EvidenceImage& image, float reach_m);
  bool rests(int block, const EvidenceOptions& options) const;
  bool fuse_block(  // whether the surface may have changed
      int block, const EvidenceTerm<float>& term, const EvidenceImage& image, const FrameColors& colors,
      const Rigidd& T_cam_obj, const EvidenceOptions& options);
  void color_row(const EvidenceTerm<float>& term, const EvidenceImage& image, const FrameColors& colors,
                 Vec3f p_cam, Vec3f step_cam, int count, const float* distance_m, float reach_m,
                 std::size_t at);
  BlockRows rows_of(int block, std::size_t* first) const;
  void prefetch_block(int block) const;
  void add_color(std::size_t voxel, const unsigned char* rgb, float weight);

  sdf::Grid grid_;
  int bx_, by_, bz_;
  LargeArray<float> log_ratio_, weight_;
  LargeArray<Color> colors_;
  // Of the image's tiles: the depths between which its surface says something, and the last reading of all,
  // before which it may be empty; 0: there are none.
  static constexpr int kTile = 4;
  struct Tile {
    float surface_from_m, surface_to_m, last_m;
  };
  std::vector<Tile> tiles_;
  int tiles_x_ = 0, tiles_y_ = 0;
  std::vector<unsigned char> empty_;   // blocks of which every voxel is as surely outside as it can be
  std::vector<unsigned char> spoken_;  // frames that have spoken of a block's surface, until it is known
  int frame_ = 0;
  std::vector<unsigned char> turned_, touched_;
  std::vector<int> changed_;
};

}  // namespace sdftrack::levelset

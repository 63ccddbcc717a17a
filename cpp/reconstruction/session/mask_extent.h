// SPDX-License-Identifier: MIT
// Compares the shape's extent in the first frame's image with that of its mask.
#pragma once

#include <vector>

#include "levelset/evidence_blocks.h"
#include "reconstruction/object_mask.h"
#include "sdf/grid.h"
#include "sdf/surface_samples.h"

namespace sdftrack::reconstruction {

struct VolumeNow {
  sdf::Grid grid;
  const float* phi;
  const std::uint16_t* seen;  // of voxel i: seen[i * stride]
  std::size_t stride;
  std::vector<sdf::VoxelBox> boxes;  // that hold the surface
};

// If the mask covers the whole rigid object, the shape stays within it from that viewpoint, whatever other
// frames add. If it extends beyond, something else was fused into the shape, or the mask covers only a part
// of the object. Nothing is inferred where the mask ends at the image border.
class MaskExtent {
 public:
  MaskExtent(const Camera& camera, const PixelMask& outline, const Rigidd& T_cam_obj);

  // Excess of the observed surface (voxels seen `least` or more) over the mask's width or height, whichever
  // is relatively larger, in every tenth of the `fused` frames.
  double beyond(const VolumeNow& volume, int fused, int least);
  // The next frame looks at the surface anew: the volume has been replaced.
  void forget() { looked_ = -kFramesBetween, share_ = 0; }

  static constexpr double kMaxBeyond = 0.15;  // of the mask's width or height

 private:
  static constexpr int kFramesBetween = 10;
  double share_of(const sdf::Grid& grid, const std::vector<Vec3d>& voxels) const;

  Camera camera_;
  Rigidd T_cam_obj_;
  frame::Rect mask_;
  int looked_ = -kFramesBetween;
  double share_ = 0;
};

}  // namespace sdftrack::reconstruction

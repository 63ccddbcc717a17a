// SPDX-License-Identifier: MIT
// The volume of a session: it begins with what is guessed from a first frame, takes keyframes, and is
// enlarged where the shape comes near its border.
#pragma once

#include <memory>
#include <optional>

#include "reconstruction/prior.h"
#include "reconstruction/reconstruction.h"
#include "reconstruction/session/keyframes.h"
#include "reconstruction/session/mask_extent.h"

namespace sdftrack::reconstruction {

class GrowingVolume {
 public:
  static constexpr int kMaxVoxels = 512;  // along each side

  // initial: belongs to the caller, who keeps it; nullptr: none. options: with the measured noise.
  GrowingVolume(const Camera& camera, const sdf::Grid& grid, std::shared_ptr<const Beginning> beginning,
                const std::optional<KnownShape>& initial, const ReconstructionOptions& options, int threads,
                int device);

  // An empty volume on the same lattice.
  std::unique_ptr<GrowingVolume> emptied() const;
  // The following frames are bounded by the first frame of their recording, which has this pose.
  void begin_recording(const Beginning& beginning, const Rigidd& T_cam_obj);
  void fuse(const Keyframe& keyframe);
  // depth_m: the frame's whole image.
  void fuse(const Keyframe& keyframe, const ImageView<float>& depth_m) { fuse(keyframe, depth_m, nullptr); }
  // Fuses a keyframe of `known` again, where it had this pose; measure() is to follow the last one.
  void fuse_again(const Keyframe& keyframe, const GrowingVolume& known, const Rigidd& T_cam_known);
  void measure() { core_->measure(threads_); }
  // Enlarges the volume if the surface is within a block of its border; the thesis' evolution keeps its
  // volume. Returns whether it did.
  bool grow_if_needed();

  int fused() const { return fused_; }  // frames
  const Camera& camera() const { return camera_; }
  const ReconstructionOptions& options() const { return options_; }
  // It is another one after growing and at the begin of a recording.
  const std::shared_ptr<Reconstruction>& core() const { return core_; }
  VolumeNow now() const;

 private:
  void fuse(const Keyframe& keyframe, const ImageView<float>& depth_m, const Reconstruction::Known* known);

  Camera camera_;
  std::shared_ptr<const Beginning> beginning_;
  std::optional<KnownShape> initial_;
  ReconstructionOptions options_;
  int threads_, device_;
  std::shared_ptr<Reconstruction> core_;
  int fused_ = 0, look_again_ = 0;
};

}  // namespace sdftrack::reconstruction

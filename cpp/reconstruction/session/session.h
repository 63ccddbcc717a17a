// SPDX-License-Identifier: MIT
// The reconstruction of an unknown object while it is tracked: each reliable pose adds its frame to the
// volume, and the tracker continues with the new shape (thesis, section 4.5; docs/math/reconstruction.md).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "reconstruction/session/growing_volume.h"
#include "tracking/tracker.h"

namespace sdftrack::reconstruction {

struct SessionSettings {
  int voxels = 200;              // along each side of the volume, at first
  std::optional<double> side_m;  // of the volume; none: 1.8 times the object's size
  int threads = 0;
  int device = Reconstruction::kOnCpu;
};

struct SessionResult {
  tracking::FrameResult tracked;  // of the one object
  double change_m;                // mean motion of the surface by this frame; NaN: it was not fused
  // Time spent on tracking, on fusing the frame, and on giving the tracker the new shape.
  double track_s, fuse_s, show_s;
};

class Session {
 public:
  // initial: kept by the caller. Throws std::invalid_argument for an object larger than the volume.
  Session(const Camera& camera, const ReconstructionOptions& options, const SessionSettings& settings,
          const std::optional<KnownShape>& initial, const Beginning& beginning);

  // The options of a tracker for the session. given: outline and smooth_colors are best off, as the outline
  // of a growing shape is not final, and measurements in front of guessed parts may belong to the object.
  tracking::TrackerOptions tracker_options(const tracking::TrackerOptions& given) const;

  // Fuses the frame of the beginning. The tracker is borrowed, has one object in the object frame of the
  // session, and takes its shape from here on. Throws std::invalid_argument if no surface is found.
  const SessionResult& start(tracking::Tracker* tracker, const frame::DepthFrame& frame);
  // Tracks the object in the next frame, and fuses the frame if its pose is reliable.
  const SessionResult& track(const frame::DepthFrame& frame);
  // Continues with the first frame of another recording, in which `tracker` has just found the shape, at the
  // pose of `shown`. masked: shown.on_object are the object's pixels; otherwise its pose was given.
  const SessionResult& resume(tracking::Tracker* tracker, const frame::DepthFrame& frame,
                              const Beginning& shown, bool masked);
  const SessionResult& result() const { return result_; }

  // Fuses a frame at a pose. False: too little of the object is in the image.
  bool add(const frame::DepthFrame& frame, const Rigidd& T_cam_obj);
  void show_shape(tracking::Tracker* tracker) const;
  void set_tracker(tracking::Tracker* tracker) { tracker_ = tracker; }

  const GrowingVolume& volume() const { return *volume_; }
  std::shared_ptr<GrowingVolume> shared_volume() const { return volume_; }
  // A volume rebuilt from the same keyframes.
  void set_volume(std::shared_ptr<GrowingVolume> volume);
  Keyframes& keyframes() { return keyframes_; }
  const Beginning& beginning() const { return *beginning_; }
  const std::vector<Beginning>& later() const { return later_; }  // of further recordings
  int index() const { return index_; }
  // Minimum observation of a surface patch for tracking, in the volume's unit.
  int least_seen() const;
  // Continues a session that was kept: its recordings, last frame, and lattice; the volume is empty.
  void restore(std::vector<Beginning> later, int index, const sdf::Grid& grid);

 private:
  void begin_frame() { result_.track_s = result_.fuse_s = result_.show_s = 0; }
  void keep(std::shared_ptr<Keyframe> keyframe, const frame::DepthFrame& frame);
  void settle();
  std::optional<Rigidd> settled_by() const;
  void rebuild(const Rigidd& motion);
  const SessionResult& finish(const Rigidd& T_cam_obj, bool fused, bool judged);

  Camera camera_;
  ReconstructionOptions options_;
  SessionSettings settings_;
  std::optional<KnownShape> initial_;
  std::shared_ptr<const Beginning> beginning_;
  std::vector<Beginning> later_;
  std::shared_ptr<GrowingVolume> volume_;
  Keyframes keyframes_;
  std::optional<MaskExtent> mask_extent_;  // none: the shape keeps to the mask, or there is none
  tracking::Tracker* tracker_ = nullptr;
  SessionResult result_{};
  int index_ = 0;
};

// The colour of each measurement of a region, 0 where there is none; three bytes per pixel.
std::vector<std::uint8_t> colors_of(const frame::DepthFrame& frame, const levelset::PixelRect& region);

// A keyframe (index 0) in which a mask marks the object.
Keyframe masked_keyframe(const frame::DepthFrame& frame, const PixelMask& on_object, const Rigidd& T_cam_obj);

}  // namespace sdftrack::reconstruction

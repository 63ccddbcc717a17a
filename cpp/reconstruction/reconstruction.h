// SPDX-License-Identifier: MIT
// A shape that grows from frames with known poses: evidence, then the distance to the surface between inside
// and outside; or, as in the thesis, steps of a field that follows the evidence.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include "levelset/evolved_field.h"
#include "reconstruction/device_roles.h"
#include "reconstruction/first_view.h"
#include "reconstruction/roles.h"

namespace sdftrack::reconstruction {

struct ReconstructionOptions {
  // The thesis' gradient flow instead of distances from the evidence, with all that belongs to it: its
  // likelihood, its use of colours, no forgetting of frames. Lengths in voxels.
  bool evolved = false;
  levelset::EvolveOptions evolve{4, 3, 1, true};
  float sigma_d_voxels = 8;
  int first_steps = 100;
  int evolution_steps = 15;   // "10 to 20" (section 4.6.1)
  int redistance_every = 15;  // steps; the prior of 4.39 alone does not keep the field a distance
  levelset::EvidenceOptions evidence;
  levelset::EvidenceImageOptions image;
  RoleOptions roles;
  float band_voxels = 8;  // distances that are updated in every frame
  int rounds = 2;         // of relaxation per frame
  int far_every = 10;     // frames between updates of the distances beyond, at first
  // Of a whole session (session.h).
  std::optional<double> noise_m;  // sd of the depth; none: measured within the mask of the first frame
  double prior = 0.4;             // log odds of the initial guess
  double min_seen = 0.15;         // frontal views
  double padding_m = 0.02;        // around the shape, of what is considered in the next frame
  bool planes = true, keep_to_mask = true;
  int mask_margin_px = 3;
  int kept_frames = 600;
  int settle_after = 10;  // frames
};

using levelset::FrameEvidence;

class Reconstruction {
 public:
  // prior: log odds of each voxel before the first frame, or nullptr. view: the space that the object keeps
  // to, or nullptr. first_shape: initial distances (m) of an evolution, or nullptr. device: the GPU that
  // computes and holds the volume, or kOnCpu.
  Reconstruction(const sdf::Grid& grid, const float* prior, const ReconstructionOptions& options,
                 std::shared_ptr<const FirstView> view = nullptr, int threads = 1,
                 const float* first_shape = nullptr, int device = kOnCpu);
  static constexpr int kOnCpu = -1;

  // A copy in a volume with whole blocks (8 voxels each) added before and after it along each axis; an
  // evolution stays within its initial volume.
  std::unique_ptr<Reconstruction> grown(const std::array<int, 3>& before, const std::array<int, 3>& after,
                                        int threads) const;

  // A copy for frames of another recording, which keep to the view of that recording's first frame. Voxels
  // without evidence are bounded by that view, too.
  std::unique_ptr<Reconstruction> continued(std::shared_ptr<const FirstView> view, int threads) const;

  void fuse(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj, int threads);
  // Fuses a frame again. `known`, a shape of the same frames, tells what of the frame is the object's, at the
  // pose that the frame had there; distances are as before until measure(). A GPU and an evolution ignore it:
  // the shape as it grows tells, and distances are measured at once.
  struct Known {
    const Reconstruction& shape;
    Rigidd T_cam_obj;
  };
  void fuse_again(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj, int threads,
                  const Known& known);
  void measure(int threads);

  int device() const { return device_; }
  // The first view, if it suggests a far side, and while all frames have shown the same side; nullptr: none.
  const FirstView* far_side() const { return far_side_.get(); }
  // The view of the present recording; nullptr: the object may be anywhere.
  const FirstView* view() const { return view_.get(); }
  const sdf::Grid& grid() const { return evidence_.grid(); }
  // With a GPU the next three functions fetch what has changed since their last call, to the same memory:
  // data borrowed before is updated only then. One thread at a time.
  const levelset::EvidenceVolume& evidence(int threads = 1) const;
  std::span<const levelset::VoxelColor> colors() const {
    return on_device_ ? on_device_->colors() : std::span(evidence_.colors());
  }
  // The shape's distances, m, negative inside; the zero set is the surface.
  std::span<const float> phi() const {
    return field_ ? field_->phi() : on_device_ ? on_device_->phi() : std::span(distance_->phi());
  }
  // Starts to fetch colours and phi from a GPU while the host continues; the next call of either one waits.
  void begin_to_show() const {
    if (on_device_) on_device_->begin_to_show();
  }
  std::vector<sdf::VoxelBox> surface_boxes() const {
    return field_       ? field_->surface_boxes()
           : on_device_ ? on_device_->surface_boxes()
                        : distance_->surface_boxes();
  }
  double change_m() const {
    return field_ ? field_->change_m() : on_device_ ? on_device_->change_m() : distance_->change_m();
  }

 private:
  Reconstruction(levelset::EvidenceVolume evidence, const ReconstructionOptions& options,
                 std::shared_ptr<const FirstView> view, int device);
  // Computes the evidence's shape from the start.
  void begin_shape();
  void follow(const std::vector<int>& changed, int threads);
  void measure_all(int threads);
  void update_far(int threads);
  bool measures_at_once() const { return on_device_ || field_; }
  // Returns the blocks whose surface may have changed.
  const std::vector<int>& add_evidence(const FrameEvidence& frame, const Camera& camera,
                                       const Rigidd& T_cam_obj, int threads, const Known& known);
  void doubt_far_side(const Rigidd& T_cam_obj);
  void find_roles(const FrameEvidence& frame, const Camera& camera, const Known& known);
  bool looked_past(Vec3d p_obj) const;

  ReconstructionOptions options_;
  std::shared_ptr<const FirstView> view_;
  std::shared_ptr<const FirstView> far_side_;  // the first recording's view; nullptr: without one
  int device_;
  // If a GPU holds the evidence, this copy may be older.
  mutable levelset::EvidenceVolume evidence_;
  mutable bool evidence_is_older_ = false;
  // One of three: distances on the host, distances and evidence on a GPU, or an evolution.
  std::optional<levelset::EvidenceDistance> distance_;
  std::unique_ptr<levelset::DeviceVolume> on_device_;
  std::unique_ptr<DeviceRoles> device_roles_;
  std::optional<levelset::EvolvedField> field_;
  levelset::EvidenceImage image_;
  RoleFinder finder_;
  const std::vector<levelset::PixelRole>* roles_ = nullptr;
  std::vector<Vec3f> readings_;  // measurements in the rectangle, object frame; NaN where there is none
  std::vector<float> reading_distance_m_;
  int frames_ = 0;
};

}  // namespace sdftrack::reconstruction

// SPDX-License-Identifier: MIT
// A shape that grows from frames with known poses: evidence, then the distance to the surface between inside
// and outside; or, as the thesis has it, steps of a field that follows the evidence.
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
  // The thesis' gradient flow in place of distances from the evidence, and all that it goes with: its
  // likelihood, its reading of colours, every frame remembered. Lengths in voxels.
  bool evolved = false;
  levelset::EvolveOptions evolve{4, 3, 1, true};
  float sigma_d_voxels = 8;
  int first_steps = 100;
  int evolution_steps = 15;  // "10 to 20" (section 4.6.1)
  levelset::EvidenceOptions evidence;
  levelset::EvidenceImageOptions image;
  RoleOptions roles;
  float band_voxels = 8;  // of distances that are kept up to date in every frame
  int rounds = 2;         // of relaxation per frame
  int far_every = 10;     // frames from one update of the distances beyond to the next, at first
};

using levelset::FrameEvidence;

class Reconstruction {
 public:
  // prior: log ratios by voxel before anything is seen, or nullptr. view: what the object keeps to, or
  // nullptr. first_shape: distances (m) by voxel that an evolution begins with, nullptr without one. device:
  // of the GPU that does the work and has the volume, or kOnCpu.
  Reconstruction(const sdf::Grid& grid, const float* prior, const ReconstructionOptions& options,
                 std::shared_ptr<const FirstView> view = nullptr, int threads = 1,
                 const float* first_shape = nullptr, int device = kOnCpu);
  static constexpr int kOnCpu = -1;

  // The same in a volume with whole blocks (8 voxels) more before and after it along each axis; an evolution
  // keeps to the volume that it began in.
  std::unique_ptr<Reconstruction> grown(const std::array<int, 3>& before, const std::array<int, 3>& after,
                                        int threads) const;

  // The same for frames of another recording, which keep to the view of its own first one; what no frame has
  // spoken of is bounded by it, too.
  std::unique_ptr<Reconstruction> continued(std::shared_ptr<const FirstView> view, int threads) const;

  void fuse(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj, int threads);

  int device() const { return device_; }
  const sdf::Grid& grid() const { return evidence_.grid(); }
  // From a GPU the next three bring back what has changed there since they were last asked for, to the same
  // place in memory: what was borrowed of them before is as old as that. One thread at a time.
  const levelset::EvidenceVolume& evidence(int threads = 1) const;
  std::span<const levelset::VoxelColor> colors() const {
    return on_device_ ? on_device_->colors() : std::span(evidence_.colors());
  }
  // Of the shape, m: negative inside; its zero set is the surface.
  std::span<const float> phi() const {
    return field_ ? field_->phi() : on_device_ ? on_device_->phi() : std::span(distance_->phi());
  }
  // Begins to bring both from a GPU while the host goes on; the next call of one of them waits for the end.
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
  // The evidence's shape, from nothing.
  void begin_shape();
  void follow(const std::vector<int>& changed, int threads);
  void measure_all(int threads);
  void update_far(int threads);
  void find_roles(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj);

  bool looked_past(Vec3d p_obj) const;

  ReconstructionOptions options_;
  std::shared_ptr<const FirstView> view_;
  int device_;
  // Where a GPU has it, what is here may be older.
  mutable levelset::EvidenceVolume evidence_;
  mutable bool evidence_is_older_ = false;
  // One of the three: the distances, here or on a GPU with the evidence, or an evolution.
  std::optional<levelset::EvidenceDistance> distance_;
  std::unique_ptr<levelset::DeviceVolume> on_device_;
  std::unique_ptr<DeviceRoles> device_roles_;
  std::optional<levelset::EvolvedField> field_;
  levelset::EvidenceImage image_;
  RoleFinder finder_;
  const std::vector<levelset::PixelRole>* roles_ = nullptr;
  std::vector<Vec3f> readings_;  // of the rectangle, object frame; NaN where there is none
  std::vector<float> reading_distance_m_;
  int frames_ = 0;
};

}  // namespace sdftrack::reconstruction

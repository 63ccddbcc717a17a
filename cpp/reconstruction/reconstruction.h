// SPDX-License-Identifier: MIT
// A shape that grows from frames with known poses: evidence, then the distance to the surface between inside
// and outside.
#pragma once

#include <array>
#include <memory>

#include "levelset/distance.h"
#include "reconstruction/first_view.h"
#include "reconstruction/roles.h"

namespace sdftrack::reconstruction {

struct ReconstructionOptions {
  levelset::EvidenceOptions evidence;
  levelset::EvidenceImageOptions image;
  RoleOptions roles;
  float band_voxels = 8;  // of distances that are kept up to date in every frame
  int rounds = 2;         // of relaxation per frame
  int far_every = 10;     // frames from one update of the distances beyond to the next
};

// A frame, of a rectangle of pixels.
struct FrameEvidence {
  ImageView<float> depth_m;
  levelset::PixelRect rect;
  const unsigned char* mask = nullptr;  // of the whole image; nullptr: by colour and depth
  const float* foreground = nullptr;    // of the rectangle
  const unsigned char* rgb = nullptr;   // of the rectangle
};

class Reconstruction {
 public:
  // prior: log ratios by voxel before anything is seen, or nullptr. view: what the object keeps to, or
  // nullptr.
  Reconstruction(const sdf::Grid& grid, const float* prior, const ReconstructionOptions& options,
                 std::shared_ptr<const FirstView> view = nullptr, int threads = 1);

  // The same in a volume with whole blocks (8 voxels) more before and after it along each axis.
  std::unique_ptr<Reconstruction> grown(const std::array<int, 3>& before, const std::array<int, 3>& after,
                                        int threads) const;

  // The same for frames of another recording, which keep to the view of its own first one; what no frame has
  // spoken of is bounded by it, too.
  std::unique_ptr<Reconstruction> continued(std::shared_ptr<const FirstView> view, int threads) const;

  void fuse(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj, int threads);

  const sdf::Grid& grid() const { return evidence_.grid(); }
  const levelset::EvidenceVolume& evidence() const { return evidence_; }
  const levelset::EvidenceDistance& distance() const { return distance_; }
  const std::vector<levelset::PixelRole>& roles() const { return *roles_; }

 private:
  Reconstruction(levelset::EvidenceVolume evidence, const ReconstructionOptions& options,
                 std::shared_ptr<const FirstView> view);
  void measure_all(int threads);
  void update_far(int threads);
  void find_roles(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj);

  bool has_room(Vec3d p_obj) const;

  ReconstructionOptions options_;
  std::shared_ptr<const FirstView> view_;
  levelset::EvidenceVolume evidence_;
  levelset::EvidenceDistance distance_;
  levelset::EvidenceImage image_;
  RoleFinder finder_;
  const std::vector<levelset::PixelRole>* roles_ = nullptr;
  std::vector<float> reading_distance_m_;
  int frames_ = 0;
};

}  // namespace sdftrack::reconstruction

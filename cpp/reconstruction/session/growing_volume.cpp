// SPDX-License-Identifier: MIT
#include "reconstruction/session/growing_volume.h"

#include <algorithm>

#include "reconstruction/bodies.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kBlockSide = levelset::EvidenceVolume::kBlock;
constexpr int kBlocksGrown = 4;
constexpr int kFramesBetweenGrowth = 5;  // looks whether the object has come near the border

std::shared_ptr<Reconstruction> first_volume(const Camera& camera, const sdf::Grid& grid,
                                             const Beginning& beginning,
                                             const std::optional<KnownShape>& initial,
                                             const ReconstructionOptions& options, int threads, int device) {
  const KnownShape* const shape = initial ? &*initial : nullptr;
  std::vector<float> prior, first;
  if (options.evolved) {
    first = printed_shape(beginning.ball, shape, grid);
    prior = printed_prior(first.data(), first.size(), grid.voxel_m);
  } else if (options.prior > 0) {
    prior = shape ? shape_prior(*shape, options.prior, grid)
                  : ball_prior(beginning.ball, options.prior, grid, beginning.view.has_value());
  }
  return std::make_shared<Reconstruction>(grid, prior.empty() ? nullptr : prior.data(), options,
                                          beginning.view_at(camera, beginning.T_cam_obj, !shape), threads,
                                          first.empty() ? nullptr : first.data(), device);
}

}  // namespace

GrowingVolume::GrowingVolume(const Camera& camera, const sdf::Grid& grid,
                             std::shared_ptr<const Beginning> beginning,
                             const std::optional<KnownShape>& initial, const ReconstructionOptions& options,
                             int threads, int device)
    : camera_(camera),
      beginning_(std::move(beginning)),
      initial_(initial),
      options_(options),
      threads_(threads),
      device_(device),
      core_(first_volume(camera, grid, *beginning_, initial, options, threads, device)) {}

std::unique_ptr<GrowingVolume> GrowingVolume::emptied() const {
  return std::make_unique<GrowingVolume>(camera_, core_->grid(), beginning_, initial_, options_, threads_,
                                         device_);
}

void GrowingVolume::begin_recording(const Beginning& beginning, const Rigidd& T_cam_obj) {
  core_ = core_->continued(beginning.view_at(camera_, T_cam_obj), threads_);
}

void GrowingVolume::fuse(const Keyframe& keyframe) {
  const std::vector<float> depth_m = whole(keyframe.depth_m, keyframe.region, camera_.width, camera_.height);
  fuse(keyframe, {depth_m.data(), camera_.width, camera_.height}, nullptr);
}

void GrowingVolume::fuse_again(const Keyframe& keyframe, const GrowingVolume& known,
                               const Rigidd& T_cam_known) {
  const std::vector<float> depth_m = whole(keyframe.depth_m, keyframe.region, camera_.width, camera_.height);
  const Reconstruction::Known there{*known.core_, {nearest_rotation(T_cam_known.R), T_cam_known.t}};
  fuse(keyframe, {depth_m.data(), camera_.width, camera_.height}, &there);
}

void GrowingVolume::fuse(const Keyframe& keyframe, const ImageView<float>& depth_m,
                         const Reconstruction::Known* known) {
  levelset::FrameEvidence frame{depth_m, keyframe.region};
  std::vector<unsigned char> mask;
  if (keyframe.mask.empty()) {
    frame.foreground = keyframe.foreground.data();
  } else {
    mask = whole(keyframe.mask, keyframe.region, camera_.width, camera_.height);
    frame.mask = mask.data();
  }
  if (!keyframe.rgb.empty()) frame.rgb = keyframe.rgb.data();
  const Rigidd& T = keyframe.T_cam_obj;
  const Rigidd T_cam_obj{nearest_rotation(T.R), T.t};
  if (known)
    core_->fuse_again(frame, camera_, T_cam_obj, threads_, *known);
  else
    core_->fuse(frame, camera_, T_cam_obj, threads_);
  ++fused_;
}

bool GrowingVolume::grow_if_needed() {
  if (options_.evolved) return false;
  const sdf::Grid& grid = core_->grid();
  const std::vector<sdf::VoxelBox> boxes = core_->surface_boxes();
  const bool near = std::any_of(boxes.begin(), boxes.end(), [&](const sdf::VoxelBox& b) {
    return std::min({b.x0, b.y0, b.z0}) < kBlockSide || b.x1 > grid.nx - kBlockSide ||
           b.y1 > grid.ny - kBlockSide || b.z1 > grid.nz - kBlockSide;
  });
  if (!near || fused_ < look_again_) return false;
  look_again_ = fused_ + kFramesBetweenGrowth;
  const Bodies bodies = bodies_of(grid.nx, grid.ny, grid.nz, core_->phi().data());
  const int voxels[3] = {grid.nx, grid.ny, grid.nz};
  int first[3] = {grid.nx, grid.ny, grid.nz}, last[3] = {0, 0, 0};
  for (const BodyRun& run : bodies.runs) {
    if (run.body != bodies.largest) continue;
    const int from[3] = {run.x0, run.y, run.z}, to[3] = {run.x1, run.y + 1, run.z + 1};
    for (int a = 0; a < 3; ++a) first[a] = std::min(first[a], from[a]), last[a] = std::max(last[a], to[a]);
  }
  std::array<int, 3> before{}, after{};
  bool grows = false;
  for (std::size_t a = 0; a < 3; ++a) {
    before[a] = first[a] < kBlockSide ? kBlocksGrown : 0;
    after[a] = last[a] > voxels[a] - kBlockSide ? kBlocksGrown : 0;
    if (voxels[a] + kBlockSide * (before[a] + after[a]) > kMaxVoxels) before[a] = after[a] = 0;
    grows |= before[a] > 0 || after[a] > 0;
  }
  if (grows) core_ = core_->grown(before, after, threads_);
  return grows;
}

VolumeNow GrowingVolume::now() const {
  return {core_->grid(), core_->phi().data(), &core_->colors().data()->seen, 4, core_->surface_boxes()};
}

}  // namespace sdftrack::reconstruction

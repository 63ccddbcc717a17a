// SPDX-License-Identifier: MIT
#include "reconstruction/session/mask_extent.h"

#include <algorithm>

#include "reconstruction/bodies.h"

namespace sdftrack::reconstruction {

namespace {

constexpr double kNearestSeen_m = 1e-3;

// Observed surface voxels of the largest body.
std::vector<Vec3d> seen_surface(const VolumeNow& volume, int least) {
  const sdf::Grid& grid = volume.grid;
  const Bodies bodies = bodies_of(grid.nx, grid.ny, grid.nz, volume.phi);
  const auto deepest = -float(grid.voxel_m);
  std::vector<Vec3d> out;
  for (const BodyRun& run : bodies.runs)
    for (int x = run.x0; x < run.x1 && run.body == bodies.largest; ++x) {
      const std::size_t i = grid.index(x, run.y, run.z);
      if (volume.phi[i] > deepest && volume.seen[i * volume.stride] >= least)
        out.push_back({1.0 * x, 1.0 * run.y, 1.0 * run.z});
    }
  return out;
}

std::vector<Vec3d> corners_of(const std::vector<sdf::VoxelBox>& boxes) {
  std::vector<Vec3d> out;
  for (const sdf::VoxelBox& b : boxes)
    for (const int x : {b.x0, b.x1})
      for (const int y : {b.y0, b.y1})
        for (const int z : {b.z0, b.z1}) out.push_back({1.0 * x, 1.0 * y, 1.0 * z});
  return out;
}

}  // namespace

MaskExtent::MaskExtent(const Camera& camera, const PixelMask& outline, const Rigidd& T_cam_obj)
    : camera_(camera),
      T_cam_obj_(T_cam_obj),
      mask_(frame::mask_bounds(outline.on.data(), outline.width, outline.height)) {}

double MaskExtent::beyond(const VolumeNow& volume, int fused, int least) {
  if (volume.boxes.empty()) return share_;
  if (share_of(volume.grid, corners_of(volume.boxes)) <= kMaxBeyond) {
    share_ = 0;  // the boxes hold their surface: no need to look at it
  } else if (fused >= looked_ + kFramesBetween) {
    looked_ = fused;
    share_ = share_of(volume.grid, seen_surface(volume, least));
  }
  return share_;
}

double MaskExtent::share_of(const sdf::Grid& grid, const std::vector<Vec3d>& voxels) const {
  const double x0 = mask_.x0, y0 = mask_.y0, x1 = mask_.x1 - 1, y1 = mask_.y1 - 1;
  double left = x0, top = y0, right = x1, bottom = y1;
  bool any = false;
  for (const Vec3d& voxel : voxels) {
    const Vec3d p = T_cam_obj_ * (grid.voxel_m * voxel + grid.origin_obj);
    if (!(p.z > kNearestSeen_m)) continue;
    const Vec2d u = camera_.project_point(p);
    left = std::min(left, u.x), right = std::max(right, u.x);
    top = std::min(top, u.y), bottom = std::max(bottom, u.y);
    any = true;
  }
  if (!any) return 0;
  if (x0 <= 0) left = x0;
  if (y0 <= 0) top = y0;
  if (x1 >= camera_.width - 1) right = x1;
  if (y1 >= camera_.height - 1) bottom = y1;
  return std::max((right - left + 1) / (x1 - x0 + 1), (bottom - top + 1) / (y1 - y0 + 1)) - 1;
}

}  // namespace sdftrack::reconstruction

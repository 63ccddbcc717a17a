// SPDX-License-Identifier: MIT
// Boxes before a wall as a small depth camera sees them, in closed form; tests/python/box_scene.py is its
// twin.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tracking/tracker.h"
#include "volume_fixture.h"

namespace sdftrack {

inline const Vec3d kHalfBox_m{0.06, 0.045, 0.03};
inline constexpr float kWall_m = 1.2f;
inline constexpr double kNearBoard_m = 0.4;

inline const Volume& box_volume() {
  static const Volume volume = make_volume(60, 0.1, [](Vec3d p) { return box_distance(p, kHalfBox_m); });
  return volume;
}

inline Camera small_camera() { return {{130, 130, 79.5, 59.5}, 160, 120, {}}; }

// A turn whose matrix is written out, so that no library's sine has a say.
inline Rigidd pose_at(Vec3d t_m) { return {{{0.64, -0.48, 0.6}, {0.6, 0.8, 0.0}, {-0.48, 0.36, 0.8}}, t_m}; }

// Next to the one at T_cam_obj along the box's shortest edge.
inline Rigidd beside(const Rigidd& T_cam_obj, double gap_m) {
  return {T_cam_obj.R, T_cam_obj * Vec3d{0, 0, 2 * kHalfBox_m.z + gap_m}};
}

// Depth of the box along the ray of (x, y, 1); infinite: it passes by.
inline double box_depth(const Rigidd& T_cam_obj, double x, double y) {
  const Mat3d& R = T_cam_obj.R;
  const Vec3d& t = T_cam_obj.t;
  const std::array<Vec3d, 3> axes{Vec3d{R.r0.x, R.r1.x, R.r2.x}, Vec3d{R.r0.y, R.r1.y, R.r2.y},
                                  Vec3d{R.r0.z, R.r1.z, R.r2.z}};
  const std::array half{kHalfBox_m.x, kHalfBox_m.y, kHalfBox_m.z};
  double enters = 0, leaves = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d& a = axes[i];
    const double along = a.x * x + a.y * y + a.z, middle = a.x * t.x + a.y * t.y + a.z * t.z;
    const double one = (middle - half[i]) / along, two = (middle + half[i]) / along;
    enters = std::max(enters, std::min(one, two));
    leaves = std::min(leaves, std::max(one, two));
  }
  return enters < leaves ? enters : std::numeric_limits<double>::infinity();
}

// The same for the same frame number: something like noise of 0.6 mm.
inline double unevenness_m(int x, int y, int frame) {
  std::uint32_t n = static_cast<std::uint32_t>((frame * 120 + y) * 160 + x) * 2654435761u;
  n = (n ^ (n >> 15)) * 2246822519u;
  n ^= n >> 13;
  return ((n & 1023u) / 1023.0 - 0.5) * 0.002;
}

struct BoxImage {
  std::vector<float> depth_m;
  std::vector<unsigned char> mask;  // of the last of the boxes
};

// covered: a board is in front of what only the last of the boxes shows.
inline BoxImage image_of(const Camera& camera, const std::vector<Rigidd>& boxes, int frame,
                         bool covered = false) {
  BoxImage image;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const double x = (u - camera.K.cx) / camera.K.fx, y = (v - camera.K.cy) / camera.K.fy;
      double nearest = std::numeric_limits<double>::infinity();
      bool last = false;
      for (std::size_t k = 0; k < boxes.size(); ++k) {
        const double z = box_depth(boxes[k], x, y);
        if (!(z < nearest)) continue;
        nearest = z, last = k + 1 == boxes.size();
      }
      const bool hit = nearest < 10;
      double z = hit ? nearest + unevenness_m(u, v, frame) : static_cast<double>(kWall_m);
      if (covered && last) z = kNearBoard_m;
      image.depth_m.push_back(static_cast<float>(z));
      image.mask.push_back(last);
    }
  return image;
}

inline tracking::PoseHint at_pose(const Rigidd& T_cam_obj) {
  tracking::PoseHint hint;
  hint.T_cam_obj = T_cam_obj;
  return hint;
}

// A frame of boxes and the objects that are to be found in it, for parts of a tracker by themselves.
struct PartsFixture {
  Camera camera = small_camera();
  tracking::TrackerOptions options;
  tracking::TrackerSettings settings;
  tracking::FrameContext context{camera, options};
  tracking::ObjectFollower follower{options, settings};
  std::vector<tracking::TrackedObject> objects;
  BoxImage image;

  PartsFixture() { settings.recover = true; }

  void add(const Rigidd& T_cam_obj) {
    tracking::TrackedObject object;
    object.shape = objects.empty()
                       ? std::make_shared<const frame::Shape>(frame::make_shape(
                             box_volume().view(), tracking::kSurfacePoints, tracking::kFreeSpacePoints))
                       : objects.front().shape;
    object.colors = appearance::ColorModel(static_cast<float>(options.color_prior));
    object.forget(options);
    object.T_cam_obj = tracking::centred(T_cam_obj, *object.shape);
    objects.push_back(object);
  }
  void open(const std::vector<Rigidd>& boxes, int frame, double time_s = tracking::kUnknown,
            bool covered = false) {
    image = image_of(camera, boxes, frame, covered);
    context.open({{image.depth_m.data(), camera.width, camera.height}, nullptr, nullptr, time_s}, objects);
  }
  Rigidd pose_of(std::size_t k) const { return tracking::uncentred(objects[k].T_cam_obj, *objects[k].shape); }
};

}  // namespace sdftrack

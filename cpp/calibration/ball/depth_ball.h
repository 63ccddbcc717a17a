// SPDX-License-Identifier: MIT
// Centre of a ball of known radius in a depth image, by the tracker's ray-hit residual with translation only
// (thesis, sections 3.5 and 3.7; docs/math/color_to_depth.md, eq. 2 to 5).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/camera.h"
#include "base/views.h"

namespace sdftrack::calibration {

struct DepthBall {
  Vec3d center_cam;            // m
  Eigen::Matrix3d covariance;  // m^2
  double noise_m;
  int pixels;    // number of pixels that agree
  double share;  // agreeing share of the pixels that face the camera
};

// First intersection of the ray (x, y, 1) with a sphere.
struct SphereHit {
  double z;           // m; NaN where the ray misses
  Vec3d by_center;    // n / (n . ray) with the outward normal n
  double cosine = 0;  // of incidence
};
SphereHit hit_sphere(Vec3d ray, Vec3d center_cam, double radius_m);

class BallFinder {
 public:
  BallFinder(const Camera& camera, double radius_m);

  const Camera& camera() const { return camera_; }
  // Fits from a start within about half a radius; empty if the measurements are not of a ball.
  // given_m: the depth before holes of a registration were filled; nullptr: the same. What was filled is no
  // measurement: across a hole it lies behind the ball.
  std::optional<DepthBall> fit(const ImageView<float>& depth, const float* given_m, Vec3d start_cam) const;
  // All regions with the ball's shape and size, the most completely visible first; they may include round
  // objects of the background. Every fourth pixel is tested as the nearest point of a ball: depth on three
  // rings must match a sphere, and a ring around it must lie behind. The best ones are fitted.
  std::vector<DepthBall> search(const ImageView<float>& depth, const float* given_m) const;

 private:
  struct Gated;
  Vec3d ray(int u, int v) const;
  std::optional<Gated> gated(const ImageView<float>& depth, const float* given_m, Vec3d center_cam,
                             double gate_m) const;
  double free_around(const ImageView<float>& depth, Vec3d center_cam) const;

  Camera camera_;
  double radius_m_;
  std::vector<float> rays_;  // rays of a camera with lens distortion; empty: pinhole
};

}  // namespace sdftrack::calibration

// SPDX-License-Identifier: MIT
// Frames of a ball before a wall, from all around it, and reconstructions of it.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "reconstruction/reconstruction.h"

namespace sdftrack {

class BallFrames {
 public:
  static constexpr double kRadius_m = 0.04, kAway_m = 0.4;

  // A volume about the ball, guessed to be all inside a larger one.
  reconstruction::Reconstruction begun(int voxels, double voxel_m, int device = -1,
                                       reconstruction::ReconstructionOptions options = {}) const {
    const double first = -0.5 * voxel_m * (voxels - 1);
    const sdf::Grid grid{voxels, voxels, voxels, voxel_m, {first, first, first}};
    std::vector<float> prior;
    for (int z = 0; z < voxels; ++z)
      for (int y = 0; y < voxels; ++y)
        for (int x = 0; x < voxels; ++x)
          prior.push_back(norm(grid.point(x, y, z)) < 1.3 * kRadius_m ? 1.0f : -1.0f);
    options.far_every = 3;
    return {grid, prior.data(), options, view, 1, nullptr, device};
  }

  // The first one has a mask; the k-th is seen from k / 10 of the way around.
  void fuse(int k, reconstruction::Reconstruction* into) const {
    std::minstd_rand random(static_cast<unsigned>(k + 1));
    std::vector<float> depth, foreground;
    std::vector<unsigned char> mask, rgb;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vec3d r = camera.pixel_ray(x, y);
        const double rr = dot(r, r), along = kAway_m * r.z / rr,
                     left = along * along - (kAway_m * kAway_m - kRadius_m * kRadius_m) / rr;
        const double noise = 0.001 * (static_cast<double>(random() % 1000) / 500 - 1);
        depth.push_back(static_cast<float>((left > 0 ? along - std::sqrt(left) : 0.7) + noise));
        if (random() % 50 == 0) depth.back() = 0;
        mask.push_back(left > 0);
        if (x < rect.x0 || y < rect.y0 || x >= rect.x1 || y >= rect.y1) continue;
        foreground.push_back(static_cast<float>(random() % 100) / 100);
        for (const int shift : {3, 4, 5}) rgb.push_back(static_cast<unsigned char>(random() >> shift));
      }
    const double angle = 2 * 3.14159265358979 * k / 10;
    const Rigidd T_cam_obj{rotation_exp(Vec3d{0.3, angle, 0.1}), {0, 0, kAway_m}};
    reconstruction::FrameEvidence frame{{depth.data(), camera.width, camera.height}, rect};
    if (k == 0) frame.mask = mask.data();
    if (by_color) frame.foreground = foreground.data();
    frame.rgb = rgb.data();
    into->fuse(frame, camera, T_cam_obj, 1);
  }

  Camera camera{{150, 150, 39.5, 29.5}, 80, 60, {}};
  levelset::PixelRect rect{0, 0, 80, 60};
  bool by_color = false;  // readings have a chance of being the object's, at random
  std::shared_ptr<const reconstruction::FirstView> view;
};

}  // namespace sdftrack

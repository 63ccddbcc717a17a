// SPDX-License-Identifier: MIT
// Tracks a sphere, whose volume and depth image are made here, by the installed library.
#include <cmath>
#include <cstdio>
#include <vector>

#include "tracking/tracker.h"

using sdftrack::Vec3d;

namespace {

constexpr double kRadius_m = 0.05;
constexpr int kVoxels = 48;
constexpr double kHalf_m = 0.075;

std::vector<float> sphere_volume() {
  std::vector<float> phi;
  const double step = 2 * kHalf_m / (kVoxels - 1);
  for (int z = 0; z < kVoxels; ++z)
    for (int y = 0; y < kVoxels; ++y)
      for (int x = 0; x < kVoxels; ++x)
        phi.push_back(static_cast<float>(
            std::hypot(step * x - kHalf_m, step * y - kHalf_m, step * z - kHalf_m) - kRadius_m));
  return phi;
}

// 0 where a pixel's ray misses the sphere.
std::vector<float> sphere_depth(const sdftrack::Camera& camera, Vec3d centre) {
  std::vector<float> depth;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3d ray{(x - camera.K.cx) / camera.K.fx, (y - camera.K.cy) / camera.K.fy, 1};
      const double a = dot(ray, ray), b = dot(ray, centre);
      const double root = b * b - a * (dot(centre, centre) - kRadius_m * kRadius_m);
      depth.push_back(root > 0 ? static_cast<float>((b - std::sqrt(root)) / a) : 0.0f);
    }
  return depth;
}

}  // namespace

int main() {
  const sdftrack::Camera camera{{250, 250, 159.5, 119.5}, 320, 240, {}};
  const Vec3d centre{0.03, -0.02, 0.6};
  const std::vector<float> phi = sphere_volume(), depth = sphere_depth(camera, centre);
  const auto low = static_cast<float>(-kHalf_m);
  const sdftrack::SdfView volume{
      phi.data(),     kVoxels, kVoxels, kVoxels, static_cast<float>(2 * kHalf_m / (kVoxels - 1)),
      {low, low, low}};

  sdftrack::tracking::Tracker tracker({volume}, camera, {}, {});
  sdftrack::Rigidd guess;
  guess.t = centre + Vec3d{0.01, 0.005, -0.01};
  const auto frame = tracker.make_frame({depth.data(), camera.width, camera.height}, nullptr, 0.0, nullptr);
  const sdftrack::tracking::ObjectResult result = tracker.start(frame, {{guess, {}, {}}}).objects.at(0);
  const double error_m = norm(result.T_cam_obj.t - centre);
  std::printf("off by %.2f mm\n", 1000 * error_m);
  return sdftrack::tracking::is_followed(result.trust.status) && error_m < 0.001 ? 0 : 1;
}

// SPDX-License-Identifier: MIT
// The plane of a depth image: no image is too small or too broken to be looked at.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "plane/plane.h"
#include "plane/plane_mask.h"
#include "plane/ray_length.h"

namespace sdftrack {
namespace {

// Depths are float32: half a unit in the last place at 2 m is 1.2e-7; a fit to thousands of them is better.
constexpr double kFloat_m = 1e-6;
const Vec3d kNormal{0.1 / std::sqrt(1.01), -0.8 / std::sqrt(1.01), -0.6 / std::sqrt(1.01)};
constexpr double kOffset_m = 0.55;

Camera camera_of(int width, int height) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.K = {0.8 * width, 0.8 * width, 0.5 * (width - 1), 0.5 * (height - 1)};
  return camera;
}

std::vector<float> table(const Camera& camera, double sigma_m) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 1);
  std::vector<float> depth;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const double along = dot(kNormal, ray(camera.K, static_cast<double>(x), static_cast<double>(y)));
      const double z = along < 0 ? -kOffset_m / along : 0;
      depth.push_back(z > 0 && z < 3 ? static_cast<float>(z + sigma_m * noise(random)) : 0.0f);
    }
  return depth;
}

frame::DepthFrame frame_of(const std::vector<float>& depth, const Camera& camera) {
  return {{depth.data(), camera.width, camera.height}, nullptr, nullptr};
}

TEST(Plane, is_looked_for_in_images_of_all_sizes_and_all_kinds_of_readings) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> anywhere(0.3f, 3.0f), chance(0, 1);
  const float odd[] = {
      0.0f,   -1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
      1e-30f, 1e30f};
  for (int width = 1; width <= 40; width += 3)
    for (int height = 1; height <= 31; height += 2)
      for (int kind = 0; kind < 3; ++kind) {
        const Camera camera = camera_of(width, height);
        std::vector<float> depth =
            kind == 0 ? table(camera, 0.001) : std::vector<float>(table(camera, 0).size());
        for (float& z : depth) {
          if (kind == 1) z = anywhere(random);
          if (kind == 2 || chance(random) < 0.2f) z = odd[random() % 6];
        }
        plane::is_ray_length(frame_of(depth, camera), camera);
        plane::PlaneOptions options;
        options.method = static_cast<plane::PlaneMethod>(random() % 3);
        if (chance(random) < 0.5f) {
          options.start_x = static_cast<int>(random() % static_cast<unsigned>(width));
          options.start_y = static_cast<int>(random() % static_cast<unsigned>(height));
        }
        const frame::DepthFrame frame = frame_of(depth, camera);
        const plane::FoundPlane found = plane::search_plane(frame, camera, options);
        if (found.miss != plane::PlaneMiss::kNone) continue;
        const frame::Plane plane = plane::normal_form(found.plane);
        EXPECT_NEAR(norm(plane.normal_cam), 1, 1e-12);
        std::vector<unsigned char> mask(depth.size());
        plane::mask_plane(frame, camera, found.plane, {0.01, {}, found.noise_scale, true}, 2, mask.data());
        for (std::size_t i = 0; i < depth.size(); ++i)
          if (!(depth[i] > 0)) EXPECT_EQ(mask[i], 0);
      }
}

TEST(Plane, is_flat_by_lengths_of_rays_only_where_depth_is_these) {
  const Camera camera = camera_of(160, 120);
  std::vector<float> depth = table(camera, 0.002);
  EXPECT_FALSE(plane::is_ray_length(frame_of(depth, camera), camera));
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      depth[static_cast<std::size_t>(y * camera.width + x)] *=
          static_cast<float>(norm(ray(camera.K, static_cast<double>(x), static_cast<double>(y))));
  EXPECT_TRUE(plane::is_ray_length(frame_of(depth, camera), camera));
  std::mt19937 random(3);
  std::uniform_real_distribution<float> anywhere(0.3f, 3.0f);
  for (float& z : depth) z = anywhere(random);
  EXPECT_FALSE(plane::is_ray_length(frame_of(depth, camera), camera));
}

}  // namespace
}  // namespace sdftrack

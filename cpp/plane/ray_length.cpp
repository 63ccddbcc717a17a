// SPDX-License-Identifier: MIT
#include "plane/ray_length.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/pixel_ray.h"
#include "base/to_int.h"
#include "plane/plane.h"

namespace sdftrack::plane {

namespace {

constexpr int kRayPoints = 1000, kRaySeeds = 40;
constexpr double kTolerance_m = 0.01, kExtent_m = 0.3, kFar_m = 100;
constexpr double kHeld = 1.0 / 3, kMoreThan = 1.5;

// The number of points on the plane that holds most of them.
double largest(const std::vector<Vec3d>& points) {
  const std::optional<frame::Plane> plane =
      plane_among(points, kTolerance_m, kRaySeeds, kHeld / kMoreThan, kExtent_m);
  if (!plane) return 0;
  return double(std::count_if(points.begin(), points.end(),
                              [&](const Vec3d& p) { return on_plane(*plane, p, kTolerance_m); }));
}

}  // namespace

bool is_ray_length(const frame::DepthFrame& frame, const Camera& camera) {
  const LensRays rays(camera);
  const int step = std::max(1, to_int(std::sqrt(camera.width * camera.height / kRayPoints)));
  std::vector<Vec3d> by_z, by_length;
  for (int y = step / 2; y < camera.height; y += step)
    for (int x = step / 2; x < camera.width; x += step) {
      const auto reading_m = double(frame.depth_m(x, y));
      if (!(reading_m > 0 && reading_m < kFar_m)) continue;
      const Vec3d ray = rays.at(x, y);
      by_z.push_back(reading_m * ray), by_length.push_back((reading_m / norm(ray)) * ray);
    }
  const double flat = largest(by_length);
  return flat > kHeld * double(by_z.size()) && flat > kMoreThan * largest(by_z);
}

}  // namespace sdftrack::plane

// SPDX-License-Identifier: MIT
#include "tracking/start/connected_region.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "base/to_int.h"
#include "plane/plane.h"
#include "plane/plane_mask.h"

namespace sdftrack::tracking {

namespace {

// A larger difference between neighbours is an edge: noise, and a surface seen at 76 degrees. Of the depth,
// and of a pixel's width there.
constexpr double kGrowthStep = 0.012, kGrowthStep_px = 4;
constexpr double kTableHalf_m = 0.008;
constexpr int kNear_px = 4;     // a click on a hole is taken for the nearest measurement this near
constexpr int kBeside_px = 2;   // an island among holes has fewer than kFewBeside measurements at its
constexpr int kFewBeside = 13;  // distance this near, itself counted
constexpr float kAtItsDepth_m = 0.02f;
constexpr float kOtherSurface_m = 0.04f;  // from the measurement nearest to the click

struct Reading {
  int x, y;
  float z;
  int apart2;  // squared, from the click
};

std::vector<Reading> readings_about(const ImageView<float>& depth_m, int x, int y) {
  std::vector<Reading> out;
  for (int v = std::max(0, y - kNear_px); v <= std::min(depth_m.height - 1, y + kNear_px); ++v)
    for (int u = std::max(0, x - kNear_px); u <= std::min(depth_m.width - 1, x + kNear_px); ++u)
      if (depth_m(u, v) > 0) out.push_back({u, v, depth_m(u, v), (v - y) * (v - y) + (u - x) * (u - x)});
  return out;
}

bool is_island(const Reading& one, const std::vector<Reading>& all) {
  return std::count_if(all.begin(), all.end(), [&](const Reading& other) {
           return std::max(std::abs(one.x - other.x), std::abs(one.y - other.y)) <= kBeside_px &&
                  std::abs(one.z - other.z) < kAtItsDepth_m;
         }) < kFewBeside;
}

// The measurements that are not on the dominant plane, if there is one.
std::optional<frame::PixelMask> off_table(const frame::DepthFrame& frame, const Camera& camera) {
  plane::PlaneOptions options;
  options.tolerance_m = kTableHalf_m;
  const plane::FoundPlane found = plane::search_plane(frame, camera, options);
  if (found.miss != plane::PlaneMiss::kNone) return std::nullopt;
  frame::PixelMask out(camera.width, camera.height);
  plane::mask_plane(frame, camera, found.plane, {kTableHalf_m, options.noise, found.noise_scale}, 1,
                    out.on.data());
  return out;
}

}  // namespace

DepthWindow depth_window(const frame::DepthFrame& frame, const frame::Rect& window, int step) {
  DepthWindow out{(window.x1 - window.x0 + step - 1) / step, (window.y1 - window.y0 + step - 1) / step, {}};
  for (int y = window.y0; y < window.y1; y += step)
    for (int x = window.x0; x < window.x1; x += step) out.depth_m.push_back(frame.depth_m(x, y));
  return out;
}

frame::PixelMask joined(const DepthWindow& window, const frame::PixelMask& free, Pixel seed, double step_m) {
  return frame::joined(window.view(), free, seed, static_cast<float>(step_m),
                       frame::Neighborhood::kSidesAndCorners);
}

Pixel nearest_reading(const frame::DepthFrame& frame, Vec2d px) {
  if (!frame.depth_m.data)
    throw std::invalid_argument("expected a depth image, got none" +
                                (frame.error.empty() ? "" : ": " + std::string(frame.error)));
  const int x = to_int(std::nearbyint(px.x)), y = to_int(std::nearbyint(px.y));
  const std::vector<Reading> all = readings_about(frame.depth_m, x, y);
  if (all.empty())
    throw std::invalid_argument("expected a depth measurement at (" + std::to_string(x) + ", " +
                                std::to_string(y) + "), got none there; click on the object itself");
  const auto nearer = [](const Reading& a, const Reading& b) { return a.apart2 < b.apart2; };
  const float z = std::min_element(all.begin(), all.end(), nearer)->z;
  // Beyond all others where it is poor: an island among holes, or of another surface.
  const auto rank = [&](const Reading& one) {
    const bool poor = is_island(one, all) || std::abs(one.z - z) > kOtherSurface_m;
    return one.apart2 + (poor ? 9 * kNear_px * kNear_px : 0);
  };
  std::vector<int> ranks;
  for (const Reading& one : all) ranks.push_back(rank(one));
  const Reading& best =
      all[static_cast<std::size_t>(std::min_element(ranks.begin(), ranks.end()) - ranks.begin())];
  return {best.x, best.y};
}

frame::PixelMask connected_region(const frame::DepthFrame& frame, const Camera& camera, Vec2d px,
                                  double reach_m) {
  const Pixel seed = nearest_reading(frame, px);
  const frame::Rect whole{0, 0, camera.width, camera.height};
  const frame::PointImage points = frame::points_of(frame, camera, whole);
  frame::PixelMask near = points.measured();
  const Vec3d at_seed = points.p[points.at(seed.x, seed.y)];
  for (std::size_t i = 0; i < near.on.size(); ++i)
    near.on[i] = near.on[i] && norm(points.p[i] - at_seed) <= reach_m;
  if (const std::optional<frame::PixelMask> off = off_table(frame, camera); off && (*off)(seed.x, seed.y))
    for (std::size_t i = 0; i < near.on.size(); ++i) near.on[i] = near.on[i] && off->on[i];
  const double step_m = at_seed.z * (kGrowthStep + kGrowthStep_px / camera.K.fx);
  frame::PixelMask region = joined(depth_window(frame, whole), near, seed, step_m);
  if (const int pixels = frame::count(region); pixels < kMinRegionPixels)
    throw std::invalid_argument(too_small_region(pixels));
  return region;
}

std::string too_small_region(int pixels) {
  return "expected a surface, got only " + std::to_string(pixels) +
         " connected pixels; click on the centre of the object";
}

}  // namespace sdftrack::tracking

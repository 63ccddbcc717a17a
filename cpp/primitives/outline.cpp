// SPDX-License-Identifier: MIT
#include "primitives/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tracking/plane.h"

namespace sdftrack {

namespace {

constexpr double kNearer_m = 0.01;  // at 1 m: a reading so much nearer than the object hides it
constexpr double kStep_m = 0.02;    // at 1 m: one less far behind it touches it
constexpr double kBehind_m = 0.05;  // at 1 m
constexpr double kSlack_m = 0.005;  // at 1 m
constexpr double kStretch_m = 0.6;  // before and behind the object's readings

Vec3d ray_at(const DepthFrame& frame, const Camera& camera, int x, int y) {
  if (!frame.rays) return ray(camera.K, static_cast<double>(x), static_cast<double>(y));
  const float* r = frame.rays + 2 * (static_cast<std::ptrdiff_t>(y) * camera.width + x);
  return {r[0], r[1], 1};
}

}  // namespace

std::vector<std::size_t> spread_order(std::size_t n) {
  std::vector<std::size_t> out(n);
  if (n == 0) return out;
  // Steps of the golden section through 0 .. n - 1, made coprime so that each comes once.
  auto step = static_cast<std::size_t>(0.6180339887498949 * static_cast<double>(n));
  step = std::max<std::size_t>(1, step);
  while (std::gcd(step, n) != 1) ++step;
  for (std::size_t i = 0, at = n / 2; i < n; ++i, at = (at + step) % n) out[i] = at;
  return out;
}

std::vector<Vec3d> labelled_points(const DepthFrame& frame, const Camera& camera,
                                   const std::uint8_t* labels) {
  std::vector<Vec3d> found, out;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (labels[static_cast<std::ptrdiff_t>(y) * camera.width + x] != static_cast<std::uint8_t>(Label::kOn))
        continue;
      const double z = frame.depth_m(x, y);
      if (z > 0) found.push_back(z * ray_at(frame, camera, x, y));
    }
  for (const std::size_t i : spread_order(found.size())) out.push_back(found[i]);
  return out;
}

std::vector<OutlineRay> outline_rays(const DepthFrame& frame, const Camera& camera,
                                     const std::uint8_t* labels, int reach_px) {
  const int w = camera.width, h = camera.height;
  const auto label = [&](int x, int y) {
    return static_cast<Label>(labels[static_cast<std::ptrdiff_t>(y) * w + x]);
  };
  const auto is_on = [&](int x, int y) { return label(x, y) == Label::kOn && frame.depth_m(x, y) > 0; };
  int x0 = w, y0 = h, x1 = 0, y1 = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      if (label(x, y) == Label::kOn)
        x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  x0 = std::max(0, x0 - reach_px), y0 = std::max(0, y0 - reach_px);
  x1 = std::min(w - 1, x1 + reach_px), y1 = std::min(h - 1, y1 + reach_px);

  std::vector<OutlineRay> found, out;
  std::vector<unsigned char> off(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0);
  const auto around = [&](int x, int y, const auto& look) {
    for (int v = std::max(0, y - reach_px); v <= std::min(h - 1, y + reach_px); ++v)
      for (int u = std::max(0, x - reach_px); u <= std::min(w - 1, x + reach_px); ++u) look(u, v);
  };
  const auto nearest_on = [&](int x, int y) {
    float nearest = std::numeric_limits<float>::infinity();
    around(x, y, [&](int u, int v) {
      if (is_on(u, v)) nearest = std::min(nearest, frame.depth_m(u, v));
    });
    return nearest;
  };
  const double focal = 0.5 * (camera.K.fx + camera.K.fy);
  const auto add = [&](int x, int y, double near_m, double far_m, double z, bool on, double slack_m = 0) {
    found.push_back({ray_at(frame, camera, x, y), std::max(0.02, near_m), far_m, z / focal, on, slack_m});
  };
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      if (label(x, y) != Label::kOff) continue;
      const float z = frame.depth_m(x, y);
      if (!(z > 0)) continue;
      const float nearest = nearest_on(x, y);
      if (!std::isfinite(nearest) || z < nearest - plane_tolerance_m(kNearer_m, nearest)) continue;
      const bool touches = z < nearest + plane_tolerance_m(kStep_m, nearest);
      if (!touches)
        off[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] = 1;
      add(x, y, nearest - kStretch_m, std::min<double>(z, nearest + kStretch_m), nearest, false,
          touches ? plane_tolerance_m(kSlack_m, nearest) : 0.0);
    }
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      if (!is_on(x, y)) continue;
      bool beside = false;
      around(x, y, [&](int u, int v) {
        beside |=
            off[static_cast<std::size_t>(v) * static_cast<std::size_t>(w) + static_cast<std::size_t>(u)] != 0;
      });
      // A mask may hold readings of what is behind the object: the pixel is not the object's then.
      const double z = nearest_on(x, y);
      if (beside && frame.depth_m(x, y) < z + plane_tolerance_m(kBehind_m, z))
        add(x, y, z - kStretch_m, z + kStretch_m, z, true);
    }
  for (const std::size_t i : spread_order(found.size())) out.push_back(found[i]);
  return out;
}

}  // namespace sdftrack

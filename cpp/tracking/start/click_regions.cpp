// SPDX-License-Identifier: MIT
#include "tracking/start/click_regions.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "base/portable_math.h"
#include "base/short_text.h"
#include "base/to_int.h"
#include "plane/near_planes.h"
#include "tracking/start/color_cut.h"

namespace sdftrack::tracking {

namespace {

constexpr double kSurroundings = 2.5;  // times the object's size, where planes are looked for
constexpr double kClickStep = 0.008, kClickStep_px = 3;  // an edge: of the depth, of a pixel's width there
constexpr double kTouching = 0.4;                        // of that step, for objects that touch

constexpr double kCutSteps = 2;   // of that step, between pixels of one colour
constexpr double kMinPart = 0.2;  // of what hangs together by depth, that the others hold at least
constexpr int kCore_px = 3;       // about the click: what surely is the object,
constexpr double kCore_m = 0.01;  // if it is as far from the camera

// The part of the image that holds all within `reach_m` of a measurement.
frame::Rect window_about(const frame::DepthFrame& frame, const Camera& camera, Pixel at, double reach_m) {
  const auto z = static_cast<double>(frame.depth_m(at.x, at.y));
  const double far = reach_m / std::max(z - 0.5 * reach_m, 0.5 * z);
  const int columns = to_int_within(far * camera.K.fx, 0, camera.width) + 1;
  const int rows = to_int_within(far * camera.K.fy, 0, camera.height) + 1;
  return {std::max(0, at.x - columns), std::max(0, at.y - rows), std::min(camera.width, at.x + columns + 1),
          std::min(camera.height, at.y + rows + 1)};
}

// The free pixel nearest in space to the clicked one, if it is within a plane's thickness.
std::optional<Pixel> nearest_free(const frame::PixelMask& free, const frame::PointImage& points,
                                  Pixel clicked) {
  const Vec3d from = points.p[points.at(clicked.x, clicked.y)];
  double nearest = 2 * plane::near_plane_tolerance_m(from.z);
  std::optional<Pixel> out;
  for (int y = 0; y < free.height; ++y)
    for (int x = 0; x < free.width; ++x)
      if (const double apart = norm(points.p[points.at(x, y)] - from); free(x, y) && apart < nearest)
        nearest = apart, out = Pixel{x, y};
  return out;
}

[[noreturn]] void refuse_plane(Vec2d px, double extent_m) {
  char extent[32];
  std::snprintf(extent, sizeof extent, "%.2f", extent_m);
  throw std::invalid_argument("expected a pixel of the object, got (" + short_text(px.x) + ", " +
                              short_text(px.y) + ") on a plane that extends over " + extent +
                              " m (a table, a wall); click on the centre of the object");
}

// The surroundings of a click, in pixels of a window.
struct Surroundings {
  frame::PointImage points;
  frame::PixelMask around, free;  // within reach of planes; of the object's size, later without planes
};

Surroundings surroundings_of(const frame::DepthFrame& frame, const Camera& camera, const frame::Rect& window,
                             Pixel clicked, double size_m) {
  Surroundings out{frame::points_of(frame, camera, window), {}, {}};
  out.around = out.free = out.points.measured();
  const Vec3d from = out.points.p[out.points.at(clicked.x, clicked.y)];
  for (std::size_t i = 0; i < out.points.p.size(); ++i) {
    const double apart = norm(out.points.p[i] - from);
    out.around.on[i] = out.around.on[i] && apart < kSurroundings * size_m;
    out.free.on[i] = out.free.on[i] && apart <= size_m;
  }
  return out;
}

// The clicked pixel, or the free one beside it: the foot of an object, or the table beside it.
Pixel without_planes(Vec2d px, Pixel clicked, double size_m, Surroundings* s) {
  double table_m = 0;
  for (const plane::NearPlane& plane : plane::planes_near(s->points, s->around, size_m)) {
    for (std::size_t i = 0; i < s->free.on.size(); ++i) s->free.on[i] = s->free.on[i] && !plane.pixels.on[i];
    if (plane.pixels(clicked.x, clicked.y)) table_m = plane.extent_m;
  }
  if (s->free(clicked.x, clicked.y)) return clicked;
  const std::optional<Pixel> beside = nearest_free(s->free, s->points, clicked);
  if (!beside) refuse_plane(px, table_m);
  return *beside;
}

frame::PixelMask core_of(const frame::PixelMask& region, const Surroundings& s, Pixel seed) {
  frame::PixelMask out(region.width, region.height);
  const double z = s.points.p[s.points.at(seed.x, seed.y)].z;
  for (int y = 0; y < region.height; ++y)
    for (int x = 0; x < region.width; ++x)
      out.on[out.at(x, y)] = region(x, y) && hypotenuse(x - seed.x, y - seed.y) <= kCore_px &&
                             std::abs(s.points.p[s.points.at(x, y)].z - z) < kCore_m;
  return out;
}

frame::PixelMask in_whole_image(const frame::PixelMask& region, const frame::Rect& window,
                                const Camera& camera) {
  frame::PixelMask out(camera.width, camera.height);
  for (int y = 0; y < region.height; ++y)
    for (int x = 0; x < region.width; ++x) out.on[out.at(window.x0 + x, window.y0 + y)] = region(x, y);
  return out;
}

}  // namespace

std::vector<frame::PixelMask> click_regions(const frame::DepthFrame& frame, const Camera& camera, Vec2d px,
                                            double size_m) {
  const Pixel reading = nearest_reading(frame, px);
  const frame::Rect window = window_about(frame, camera, reading, kSurroundings * size_m);
  const Pixel clicked{reading.x - window.x0, reading.y - window.y0};
  Surroundings s = surroundings_of(frame, camera, window, clicked, size_m);
  const Pixel seed = without_planes(px, clicked, size_m, &s);
  const double z = s.points.p[s.points.at(seed.x, seed.y)].z;
  const double step_m = z * (kClickStep + kClickStep_px / camera.K.fx);
  const DepthWindow depth = depth_window(frame, window);
  const frame::PixelMask loose = joined(depth, s.free, seed, step_m);
  std::vector<frame::PixelMask> regions{loose, joined(depth, s.free, seed, kTouching * step_m)};
  if (const auto cut =
          cut_by_color(frame, camera, window.x0, window.y0, s.free, loose, core_of(loose, s, seed)))
    regions.push_back(joined(depth, *cut, seed, kCutSteps * step_m));
  const double least = std::max<double>(kMinRegionPixels, kMinPart * frame::count(loose));
  std::vector<frame::PixelMask> kept;
  for (frame::PixelMask& region : regions)
    if (frame::count(region) >= least && std::find(kept.begin(), kept.end(), region) == kept.end())
      kept.push_back(std::move(region));
  if (kept.empty()) throw std::invalid_argument(too_small_region(frame::count(loose)));
  for (frame::PixelMask& region : kept) region = in_whole_image(region, window, camera);
  return kept;
}

}  // namespace sdftrack::tracking

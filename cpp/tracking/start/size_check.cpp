// SPDX-License-Identifier: MIT
#include "tracking/start/size_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "base/portable_math.h"
#include "base/quantile.h"

namespace sdftrack::tracking {

namespace {

constexpr double kOtherSize = 8;         // between what is seen and the shape: views show parts, masks more
constexpr double kMillimetreMesh = 200;  // a smaller factor is that of centimetres or inches
constexpr double kSpeck_px = 3, kMostImages = 20;         // how large a shape that is clicked on may appear
constexpr double kLargerView = 1.15, kSmallerView = 0.4;  // of the diameter: no view of the whole object
constexpr double kLeastView = 0.55, kMostView = 1.1;      // of the diameter: extents of views
constexpr double kDepthUnits[] = {5, 4};  // parts of a millimetre: of TUM's folders and of some sensors
constexpr double kExtentEnds = 0.05;      // of a mask's measurements: those behind the edge do not count
constexpr double kStandsAlone = 0.95;     // of a region that lies within its box
constexpr int kRoughBox = 50, kRoughDiameter = 24;  // voxels along the shortest side that tell a size
constexpr int kDirections = 200;                    // of half a sphere, that a diameter is looked for in

std::string text_with(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// The likely cause if a shape is `ratio` times as large as what is seen.
std::string advice(double ratio) {
  if (ratio < 1) return "is the depth in millimetres (metres are expected), or was the mesh scaled twice?";
  return std::string("is the mesh in ") + (ratio > kMillimetreMesh ? "mm" : "cm or in") +
         " and read as metres, or the depth in a larger unit than metres?";
}

// Evenly spread over half a sphere (a spiral by the golden angle).
Vec3f direction(int k) {
  const double z = (k + 0.5) / kDirections, turn = 2.399963229728653 * k, r = std::sqrt(1 - z * z);
  return Vec3d{r * std::cos(turn), r * std::sin(turn), z}.cast<float>();
}

// Of the voxels inside a shape or within half a step of its surface, of about `per_side` along the shortest
// side, the two ends of each row: no voxel between them lies farther in any direction.
std::vector<Vec3f> ends_inside(const SdfView& sdf, int per_side) {
  const int every = std::max(1, std::min({sdf.nx, sdf.ny, sdf.nz}) / per_side);
  const float step_m = static_cast<float>(every) * sdf.voxel_m;
  std::vector<Vec3f> out;
  for (int z = 0; z < sdf.nz; z += every)
    for (int y = 0; y < sdf.ny; y += every) {
      const float* row = sdf.phi + (static_cast<std::ptrdiff_t>(z) * sdf.ny + y) * sdf.nx;
      int first = 0, last = (sdf.nx - 1) / every * every;
      while (first <= last && !(row[first] < 0.5f * step_m)) first += every;
      while (last > first && !(row[last] < 0.5f * step_m)) last -= every;
      for (const int x : {first, last})
        if (first <= last)
          out.push_back(sdf.voxel_m *
                        Vec3f{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    }
  return out;
}

double extent_along(Vec3f direction, const std::vector<Vec3f>& points) {
  float low = 1e9f, high = -1e9f;
  for (const Vec3f& p : points) {
    const float at = dot(direction, p);
    low = std::min(low, at), high = std::max(high, at);
  }
  return std::max(0.0, static_cast<double>(high - low));
}

bool touches_border(const unsigned char* mask, const Camera& camera) {
  const frame::Rect r = frame::mask_bounds(mask, camera.width, camera.height);
  return r.x0 == 0 || r.y0 == 0 || r.x1 == camera.width || r.y1 == camera.height;
}

// The units of depth that explain the ratio, as "1/5000 m or 1/4000 m".
std::string fine_units(double large, bool larger) {
  const double low = larger ? kLeastView : 1 / kMostView, high = larger ? kMostView : 1 / kLeastView;
  std::string out;
  for (const double part : kDepthUnits)
    if (large / high < part && part < large / low)
      out += (out.empty() ? "" : " or ") + ("1/" + text_with("%.0f", 1000 * part) + " m");
  return out;
}

// What stands alone in the middle of a box; empty if nothing does.
frame::PixelMask alone_in(const frame::DepthFrame& frame, const Camera& camera, const frame::Rect& box) {
  std::vector<double> depths_m;
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x)
      if (frame.depth_m(x, y) > 0) depths_m.push_back(static_cast<double>(frame.depth_m(x, y)));
  if (depths_m.empty()) return {};
  const double w = box.x1 - box.x0, h = box.y1 - box.y0;
  const double reach_m = hypotenuse(w, h) / camera.K.fx * median(&depths_m);
  frame::PixelMask whole;
  try {
    whole = connected_region(frame, camera, {box.x0 + 0.5 * w, box.y0 + 0.5 * h}, reach_m);
  } catch (const std::invalid_argument&) {
    return {};
  }
  frame::PixelMask inside(camera.width, camera.height);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) inside.on[inside.at(x, y)] = whole(x, y);
  return frame::count(inside) > kStandsAlone * frame::count(whole) ? inside : frame::PixelMask();
}

}  // namespace

std::string length_text(double metres) {
  return metres >= 1 || metres < 1e-4 ? text_with("%.3g m", metres) : text_with("%.3g mm", 1e3 * metres);
}

double extent_in(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask) {
  std::vector<Vec3d> points;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (!mask[static_cast<std::ptrdiff_t>(y) * camera.width + x]) continue;
      if (const Vec3d p = frame::point_at(frame, camera, x, y); p.z > 0) points.push_back(p);
    }
  return frame::longest_extent_m(points, kExtentEnds, 1 - kExtentEnds) / (1 - 2 * kExtentEnds);
}

double size_of(const frame::Shape& shape) {
  const std::vector<Vec3f> points = ends_inside(shape.sdf, kRoughBox);
  const Vec3d box{extent_along({1, 0, 0}, points), extent_along({0, 1, 0}, points),
                  extent_along({0, 0, 1}, points)};
  return norm(box);
}

double diameter_of(const frame::Shape& shape) {
  const std::vector<Vec3f> points = ends_inside(shape.sdf, kRoughDiameter);
  double best = 0;
  for (int k = 0; k < kDirections; ++k) best = std::max(best, extent_along(direction(k), points));
  return best;
}

bool mask_fits(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
               const frame::Shape& shape) {
  if (!frame.depth_m.data) return true;
  const double seen = extent_in(frame, camera, mask), size = size_of(shape);
  return seen == 0 || (size / kOtherSize < seen && seen < kOtherSize * size);
}

void check_mask_size(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                     const frame::Shape& shape, const std::string& name) {
  if (mask_fits(frame, camera, mask, shape)) return;
  const double seen = extent_in(frame, camera, mask), size = size_of(shape);
  throw std::invalid_argument(name + ": expected the object, " + length_text(size) +
                              " across by its mesh, got depth measurements that extend over " +
                              length_text(seen) + "; " + advice(size / seen));
}

void check_visible_size(const Camera& camera, double depth_m, const frame::Shape& shape) {
  const double size = size_of(shape), pixels = camera.K.fx * size / depth_m;
  if (kSpeck_px < pixels && pixels < kMostImages * std::max(camera.width, camera.height)) return;
  throw std::invalid_argument("expected an object of visible size, got a shape of " + length_text(size) +
                              " at a distance of " + length_text(depth_m) + ", " + text_with("%.3g", pixels) +
                              " pixels large; " + advice(pixels > kSpeck_px ? 1e3 : 1e-3));
}

SizeDoubt size_doubt(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                     const frame::Shape& shape) {
  if (!frame.depth_m.data) return {};
  const double seen = extent_in(frame, camera, mask), size = diameter_of(shape), ratio = seen / size;
  if (seen == 0 || (kSmallerView < ratio && ratio < kLargerView)) return {};
  if (seen < size && touches_border(mask, camera)) return {};
  const bool larger = ratio > 1;
  std::string text = "the depth measurements there extend over " + length_text(seen) + ", " +
                     text_with("%.2g", ratio) + (larger ? " times" : " of") + " the " + length_text(size) +
                     " of the mesh: ";
  const std::string fine = fine_units(std::max(ratio, 1 / ratio), larger);
  if (fine.empty())
    text += "check the units of depth and mesh, and that the mesh has the object's size";
  else
    text += "is the depth in " + (larger ? fine : "millimetres") + " and read as " +
            (larger ? "millimetres" : fine) + "?";
  return {text, larger};
}

SizeDoubt size_doubt_at(const frame::DepthFrame& frame, const Camera& camera, const PoseHint& place,
                        const frame::Shape& shape) {
  if (!frame.depth_m.data || place.T_cam_obj) return {};
  if (!place.mask.empty()) return size_doubt(frame, camera, place.mask.data(), shape);
  if (!place.box) return {};
  const frame::PixelMask region = alone_in(frame, camera, *place.box);
  return region.on.empty() ? SizeDoubt{} : size_doubt(frame, camera, region.on.data(), shape);
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "reconstruction/object_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/portable_math.h"
#include "base/quantile.h"

namespace sdftrack::reconstruction {

namespace {

constexpr float kSteps_m[] = {0.05f, 0.03f, 0.02f, 0.01f};  // between neighbouring measurements of one object
constexpr double kMaxOnBorder = 0.03;                       // of a box's border pixels
constexpr double kNearShare = 0.25;  // of the measurements in the middle of a box: those of the object

using frame::Pixel;

// The pixel nearest to the centre, among the near pixels of the central half.
Pixel middle_reading(const ImageView<float>& depth_m, const frame::Rect& box) {
  const int w = box.x1 - box.x0, h = box.y1 - box.y0;
  const frame::Rect inner{box.x0 + w / 4, box.y0 + h / 4, box.x0 + std::max(w / 4 + 1, 3 * w / 4),
                          box.y0 + std::max(h / 4 + 1, 3 * h / 4)};
  std::vector<float> read;
  for (int y = inner.y0; y < inner.y1; ++y)
    for (int x = inner.x0; x < inner.x1; ++x)
      if (depth_m(x, y) > 0) read.push_back(depth_m(x, y));
  if (read.empty())
    throw std::invalid_argument(
        "box: expected depth measurements at its centre, got none; is the object black or shiny?");
  const float near = quantile(&read, kNearShare);
  const double mx = 0.5 * (inner.x0 + inner.x1 - 1), my = 0.5 * (inner.y0 + inner.y1 - 1);
  Pixel best{};
  double least = std::numeric_limits<double>::infinity();
  for (int y = inner.y0; y < inner.y1; ++y)
    for (int x = inner.x0; x < inner.x1; ++x) {
      const float z = depth_m(x, y);
      if (!(z > 0) || !(std::abs(z - near) < kSteps_m[3])) continue;
      const double away2 = (x - mx) * (x - mx) + (y - my) * (y - my);
      if (away2 < least) least = away2, best = {x, y};
    }
  return best;
}

// Share of the box's border pixels that are in the mask; corners count twice.
double share_on_border(const PixelMask& mask, const frame::Rect& box) {
  int on = 0;
  for (int x = box.x0; x < box.x1; ++x) on += mask(x, box.y0) + mask(x, box.y1 - 1);
  for (int y = box.y0; y < box.y1; ++y) on += mask(box.x0, y) + mask(box.x1 - 1, y);
  return on / (2.0 * (box.x1 - box.x0 + box.y1 - box.y0));
}

double turn(Pixel a, Pixel b, Pixel c) {
  return (1.0 * b.x - a.x) * (c.y - a.y) - (1.0 * b.y - a.y) * (c.x - a.x);
}

// Andrew's monotone chain over the ends of each column; no three corners on a line.
std::vector<Pixel> convex_hull(const PixelMask& mask) {
  std::vector<Pixel> points, hull;
  for (int x = 0; x < mask.width; ++x) {
    int first = -1, last = -1;
    for (int y = 0; y < mask.height; ++y)
      if (mask(x, y)) last = y, first = first < 0 ? y : first;
    if (first >= 0) points.push_back({x, first});
    if (last > first) points.push_back({x, last});
  }
  for (const bool back : {false, true}) {
    const std::size_t begin = hull.size();
    for (const Pixel& p : points) {
      while (hull.size() >= begin + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    if (!hull.empty()) hull.pop_back();  // it begins the other half
    if (!back) std::reverse(points.begin(), points.end());
  }
  return hull;
}

}  // namespace

PixelMask mask_of_box(const ImageView<float>& depth_m, const frame::Rect& box) {
  const Pixel start = middle_reading(depth_m, box);
  PixelMask mask, read(depth_m.width, depth_m.height);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) read.on[read.at(x, y)] = depth_m(x, y) > 0;
  for (const float step_m : kSteps_m) {
    mask = frame::joined(depth_m, read, start, step_m, frame::Neighborhood::kSides);
    if (share_on_border(mask, box) < kMaxOnBorder) break;
  }
  return mask;
}

double shorter_side_px(const PixelMask& mask) {
  const std::vector<Pixel> hull = convex_hull(mask);
  double least = std::numeric_limits<double>::infinity(), shorter = 0;
  // A side of the rectangle of least area lies along an edge of the hull.
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Pixel a = hull[i], b = hull[(i + 1) % hull.size()];
    const double length = hypotenuse(b.x - a.x, b.y - a.y);
    if (!(length > 0)) continue;
    const double ux = (b.x - a.x) / length, uy = (b.y - a.y) / length;
    double low = 0, high = 0, across = 0;
    for (const Pixel& p : hull) {
      const double along = ux * (p.x - a.x) + uy * (p.y - a.y);
      low = std::min(low, along), high = std::max(high, along);
      across = std::max(across, std::abs(ux * (p.y - a.y) - uy * (p.x - a.x)));
    }
    if ((high - low) * across < least) least = (high - low) * across, shorter = std::min(high - low, across);
  }
  return shorter;
}

}  // namespace sdftrack::reconstruction

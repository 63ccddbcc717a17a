// SPDX-License-Identifier: MIT
#include "calibration/ball/edges.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/to_int.h"

namespace sdftrack::calibration {

namespace {

constexpr double kStep_px = 0.5;     // between the samples of a profile
constexpr int kSide = 4;             // samples beyond the reach on each side, whose mean is the side's colour
constexpr double kMinContrast = 18;  // grey values between the two sides of an edge

// Bilinear; false outside the image.
bool colour_at(const RgbImage& image, double x, double y, Vec3d* out) {
  if (!(x >= 0 && y >= 0 && x <= image.width - 1 && y <= image.height - 1)) return false;
  const int x0 = std::min(to_int(x), image.width - 2), y0 = std::min(to_int(y), image.height - 2);
  const double a = x - x0, b = y - y0;
  const Vec3d top = (1 - a) * as_vector(image(x0, y0)) + a * as_vector(image(x0 + 1, y0));
  const Vec3d low = (1 - a) * as_vector(image(x0, y0 + 1)) + a * as_vector(image(x0 + 1, y0 + 1));
  *out = (1 - b) * top + b * low;
  return true;
}

// The colour direction along which the inside counts as covered at any brightness.
Vec3d insensitive_to_shade(Vec3d inner, Vec3d difference) {
  const Vec3d unit = (1 / std::max(norm(inner), 1e-9)) * inner;
  const Vec3d w = difference - dot(difference, unit) * unit;
  return norm(w) < kMinContrast ? difference : w;  // a dark or similar background: use brightness
}

}  // namespace

Edge edge_along(const RgbImage& image, Vec2d at, Vec2d normal, double reach_px) {
  const Edge none{at, false, 0};
  const int n = to_int(std::nearbyint(reach_px / kStep_px)), last = n + kSide;
  std::vector<Vec3d> profile(2 * last + 1);
  const auto sample = [&](int k) -> Vec3d& { return profile[k + last]; };
  for (int k = -last; k <= last; ++k)
    if (!colour_at(image, at.x + kStep_px * k * normal.x, at.y + kStep_px * k * normal.y, &sample(k)))
      return none;
  Vec3d inner{0, 0, 0}, outer{0, 0, 0};
  for (int k = 0; k <= kSide; ++k) {
    inner = inner + (1.0 / (kSide + 1)) * sample(-n - k);
    outer = outer + (1.0 / (kSide + 1)) * sample(n + k);
  }
  const Vec3d w = insensitive_to_shade(inner, inner - outer);
  const double strength = norm(w), whole = dot(inner - outer, w);
  // The sides differ, coverage is full inside and empty outside and falls in between.
  const double level = 0.3 + 12 / std::max(strength, 1.0);
  bool sure = strength > kMinContrast;
  double covered = 0.5;  // the whole samples between the sides, and half a step of the last covered one
  int blurred = 0;
  for (int k = -last; k <= last; ++k) {
    const double cover = dot(sample(k) - outer, w) / whole;
    if (k <= 1 - n) sure = sure && std::abs(cover - 1) < level;
    if (k >= n - 1) sure = sure && std::abs(cover) < level;
    if (std::abs(k) >= n) continue;
    covered += cover;
    blurred += std::abs(cover - 0.5) < 0.4;
  }
  covered *= kStep_px;
  sure = sure && covered > 0 && covered < 2 * kStep_px * n;
  const double off = covered - kStep_px * n;
  return {{at.x + off * normal.x, at.y + off * normal.y}, sure, kStep_px * blurred};
}

}  // namespace sdftrack::calibration

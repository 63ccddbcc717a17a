// SPDX-License-Identifier: MIT
// One pixel of a frame prepared for fusion (evidence_image.h), for the CPU's loops and the GPU's kernels.
#pragma once

#include <limits>

#include "base/lens_pixel.h"
#include "base/to_int.h"
#include "levelset/evidence_terms.h"

namespace sdftrack::levelset {

// What a measurement belongs to.
enum class PixelRole : unsigned char {
  kUnknown,  // nothing is concluded
  kObject,
  kBeyond  // not the object; the space in front is empty
};

// Half-open rectangle of pixels.
struct PixelRect {
  int x0, y0, x1, y1;

  HD int width() const { return x1 - x0; }
  HD int height() const { return y1 - y0; }
  HD int count() const { return width() * height(); }
};

struct EvidenceImageOptions {
  int border_px = 2;       // object pixels closer than this to others or to a depth jump give no evidence
  float jump_m = 0.01f;    // between neighbours
  float min_slant = 0.2f;  // least cosine between ray and normal of a surface that gives evidence
  bool printed = false;    // each object pixel gives evidence, on its own; no other pixel does
};

constexpr float kLargest_m = std::numeric_limits<float>::max();

HD bool readable(float depth_m) { return depth_m > 0 && depth_m <= kLargest_m; }

// Index of the rectangle's pixel to which the lens projects ideal pixel (x, y); -1: outside.
HD int source_of(const LensRays& lens, const PixelRect& rect, int x, int y) {
  if (!lens.distorted) return y * rect.width() + x;
  const Vec2d u = lens_pixel(lens, ray(lens.K, 1.0 * (rect.x0 + x), 1.0 * (rect.y0 + y)));
  const int sx = to_int(std::floor(u.x + 0.5)) - rect.x0, sy = to_int(std::floor(u.y + 0.5)) - rect.y0;
  const bool inside = sx >= 0 && sy >= 0 && sx < rect.width() && sy < rect.height();
  return inside ? sy * rect.width() + sx : -1;
}

// An image while it is built, row by row. Not owned.
struct ImagePlanes {
  EvidencePixel* pixels;
  const PixelRole* role;
  const unsigned char *edge, *border;  // edge: the pixel is at a border; border: it is near one
  int width, height;

  // Whether a border runs between two neighbours: their roles or depths differ.
  HD bool differs(int i, int j, float jump_m) const {
    return role[i] != role[j] || !(abs(pixels[i].depth_m - pixels[j].depth_m) < jump_m);
  }

  // Computes the pixel's evidence on the voxels along its ray. A surface pixel gets a plane through the
  // nearest pixels, by central differences. The pixel's depth is already set.
  HD void judge(int x, int y, const PixelRect& rect, const Intrinsics<float>& K,
                const EvidenceImageOptions& options) const {
    const int i = y * width + x;
    EvidencePixel& pixel = pixels[i];
    pixel.du_m = pixel.dv_m = 0;
    if (options.printed) {
      pixel.slant = role[i] == PixelRole::kObject ? 1.0f : 0.0f;
      return;
    }
    pixel.slant = role[i] == PixelRole::kUnknown || border[i] ? 0 : kCarves;
    // Background pixels carve right up to the outline; otherwise a skin of the prior would remain there.
    if (role[i] == PixelRole::kBeyond && border[i] && !edge[i]) pixel.slant = kCarvesFaintly;
    constexpr int k = 2;
    if (pixel.slant != kCarves || role[i] != PixelRole::kObject || x < k || y < k || x >= width - k ||
        y >= height - k)
      return;
    float du = 0, dv = 0;  // least squares over 5 x 3 and 3 x 5 pixels
    for (int s = -1; s <= 1; ++s) {
      du += 2 * (depth(i, 2, s) - depth(i, -2, s)) + depth(i, 1, s) - depth(i, -1, s);
      dv += 2 * (depth(i, s, 2) - depth(i, s, -2)) + depth(i, s, 1) - depth(i, s, -1);
    }
    du /= 30, dv /= 30;
    const float u = float(rect.x0 + x) - K.cx, v = float(rect.y0 + y) - K.cy;
    const float slant = pixel.depth_m / norm(Vec3f{K.fx * du, K.fy * dv, pixel.depth_m + u * du + v * dv});
    if (slant < options.min_slant) return;
    pixel.slant = slant, pixel.du_m = du, pixel.dv_m = dv;
  }

 private:
  HD float depth(int i, int dx, int dy) const { return pixels[i + dy * width + dx].depth_m; }
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
// One pixel of a frame made ready for evidence (evidence_image.h), for the CPU's loops and the GPU's kernels.
#pragma once

#include <limits>

#include "base/lens_pixel.h"
#include "base/to_int.h"
#include "levelset/evidence_terms.h"

namespace sdftrack::levelset {

// What a reading belongs to.
enum class PixelRole : unsigned char {
  kUnknown,  // nothing is concluded
  kObject,
  kBeyond  // not the object's; the space before it is empty
};

// Half-open rectangle of pixels.
struct PixelRect {
  int x0, y0, x1, y1;

  HD int width() const { return x1 - x0; }
  HD int height() const { return y1 - y0; }
  HD int count() const { return width() * height(); }
};

struct EvidenceImageOptions {
  int border_px = 2;     // object pixels nearer than this to others, and those at jumps of depth, say nothing
  float jump_m = 0.01f;  // between neighbours
  float min_slant = 0.2f;  // cosine between the ray and the normal below which a surface says nothing
  bool printed = false;    // every reading of the object speaks, of itself alone; no other does
};

constexpr float kLargest_m = std::numeric_limits<float>::max();

HD bool readable(float depth_m) { return depth_m > 0 && depth_m <= kLargest_m; }

// Where the lens has put ideal pixel (x, y) of a rectangle: an index of its pixels, -1 outside.
HD int source_of(const LensRays& lens, const PixelRect& rect, int x, int y) {
  if (!lens.distorted) return y * rect.width() + x;
  const Vec2d u = lens_pixel(lens, ray(lens.K, 1.0 * (rect.x0 + x), 1.0 * (rect.y0 + y)));
  const int sx = to_int(std::floor(u.x + 0.5)) - rect.x0, sy = to_int(std::floor(u.y + 0.5)) - rect.y0;
  const bool inside = sx >= 0 && sy >= 0 && sx < rect.width() && sy < rect.height();
  return inside ? sy * rect.width() + sx : -1;
}

// An image while it is made, row by row. Borrowed.
struct ImagePlanes {
  EvidencePixel* pixels;
  const PixelRole* role;
  const unsigned char *edge, *border;  // a pixel is at a border; or near to one
  int width, height;

  // Whether a border runs between two neighbours: their roles or depths do not go together.
  HD bool differs(int i, int j, float jump_m) const {
    return role[i] != role[j] || !(abs(pixels[i].depth_m - pixels[j].depth_m) < jump_m);
  }

  // What the pixel says of the voxels on its ray: a plane through the nearest pixels, by central differences,
  // where it is one of a surface. Its depth is there.
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
    // What lies beyond an outline carves up to it, or a skin of what was only guessed would stay there.
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
    const float u = static_cast<float>(rect.x0 + x) - K.cx, v = static_cast<float>(rect.y0 + y) - K.cy;
    const float slant = pixel.depth_m / norm(Vec3f{K.fx * du, K.fy * dv, pixel.depth_m + u * du + v * dv});
    if (slant < options.min_slant) return;
    pixel.slant = slant, pixel.du_m = du, pixel.dv_m = dv;
  }

 private:
  HD float depth(int i, int dx, int dy) const { return pixels[i + dy * width + dx].depth_m; }
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
#include "levelset/evidence_image.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::levelset {

namespace {

// 1 where a 1 is at most `reach` away along each of `lines` lines of n pixels.
void spread(const unsigned char* from, int reach, int n, int lines, std::size_t step, std::size_t line_step,
            unsigned char* to) {
  for (int l = 0; l < lines; ++l, from += line_step, to += line_step) {
    int last = -2 * reach - 1;  // the last 1 up to x + reach
    for (int x = -reach; x < n; ++x) {
      const int ahead = x + reach;
      if (ahead < n && from[static_cast<std::size_t>(ahead) * step]) last = ahead;
      if (x >= 0) to[static_cast<std::size_t>(x) * step] = last >= x - reach;
    }
  }
}

}  // namespace

void EvidenceImage::make(const ImageView<float>& depth_m, const Camera& camera, const PixelRect& rect,
                         const PixelRole* role, const EvidenceImageOptions& options) {
  rect_ = rect;
  const std::size_t count = static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
  pixels_.resize(count), source_.resize(count), role_.resize(count), border_.resize(count),
      spread_.resize(count);
  read(depth_m, camera, role);
  if (options.printed) {
    take_all();
    return;
  }
  find_borders(options);
  find_slopes(camera, options);
}

void EvidenceImage::take_all() {
  for (std::size_t i = 0; i < pixels_.size(); ++i)
    pixels_[i].slant = role_[i] == PixelRole::kObject ? 1.0f : 0.0f;
}

void EvidenceImage::read(const ImageView<float>& depth_m, const Camera& camera, const PixelRole* role) {
  const bool distorted = camera.distorted();
  for (int y = 0; y < height(); ++y)
    for (int x = 0; x < width(); ++x) {
      int sx = rect_.x0 + x, sy = rect_.y0 + y;
      if (distorted) {
        const Vec3d r = ray(camera.K, 1.0 * sx, 1.0 * sy);
        const Vec2d u = camera.project_point(r);
        sx = to_int(std::floor(u.x + 0.5)), sy = to_int(std::floor(u.y + 0.5));
      }
      const std::size_t i = at(x, y);
      const bool inside = sx >= rect_.x0 && sy >= rect_.y0 && sx < rect_.x1 && sy < rect_.y1;
      const float z = inside ? depth_m(sx, sy) : 0.0f;
      const bool readable = z > 0 && std::isfinite(z);
      source_[i] = inside ? static_cast<int>(at(sx - rect_.x0, sy - rect_.y0)) : -1;
      role_[i] = readable ? role[at(sx - rect_.x0, sy - rect_.y0)] : PixelRole::kUnknown;
      pixels_[i] = {readable ? z : 0.0f, 0, 0, 0};
    }
}

// Pixels within border_px of a jump of depth, or of a change of role, row by row and then column by column.
void EvidenceImage::find_borders(const EvidenceImageOptions& options) {
  const int w = width(), h = height();
  const auto differs = [&](std::size_t i, std::size_t j) {
    return role_[i] != role_[j] || !(std::abs(pixels_[i].depth_m - pixels_[j].depth_m) < options.jump_m);
  };
  std::fill(border_.begin(), border_.end(), static_cast<unsigned char>(0));
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const std::size_t i = at(x, y);
      if (x + 1 < w && differs(i, i + 1)) border_[i] = border_[i + 1] = 1;
      if (y + 1 < h && differs(i, i + static_cast<std::size_t>(w)))
        border_[i] = border_[i + static_cast<std::size_t>(w)] = 1;
    }
  edge_ = border_;
  if (options.border_px <= 1) return;
  const int reach = options.border_px - 1;  // those marked are at the border themselves
  spread(border_.data(), reach, w, h, 1, static_cast<std::size_t>(w), spread_.data());
  spread(spread_.data(), reach, h, w, static_cast<std::size_t>(w), 1, border_.data());
}

// A plane through the nearest pixels, by central differences.
void EvidenceImage::find_slopes(const Camera& camera, const EvidenceImageOptions& options) {
  const int w = width(), h = height();
  const auto fx = static_cast<float>(camera.K.fx), fy = static_cast<float>(camera.K.fy);
  const auto cx = static_cast<float>(camera.K.cx), cy = static_cast<float>(camera.K.cy);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const std::size_t i = at(x, y);
      EvidencePixel& pixel = pixels_[i];
      pixel.slant = role_[i] == PixelRole::kUnknown || border_[i] ? 0 : kCarves;
      // What lies beyond an outline carves up to it, or a skin of what was only guessed would stay there.
      if (role_[i] == PixelRole::kBeyond && border_[i] && !edge_[i]) pixel.slant = kCarvesFaintly;
      constexpr int k = 2;
      if (pixel.slant != kCarves || role_[i] != PixelRole::kObject || x < k || y < k || x >= w - k ||
          y >= h - k)
        continue;
      float du = 0, dv = 0;  // least squares over 5 x 3 and 3 x 5 pixels
      const auto z = [&](int i, int j) { return pixels_[at(x + i, y + j)].depth_m; };
      for (int s = -1; s <= 1; ++s) {
        du += 2 * (z(2, s) - z(-2, s)) + z(1, s) - z(-1, s);
        dv += 2 * (z(s, 2) - z(s, -2)) + z(s, 1) - z(s, -1);
      }
      du /= 30, dv /= 30;
      const float u = static_cast<float>(rect_.x0 + x) - cx, v = static_cast<float>(rect_.y0 + y) - cy;
      const Vec3f n{fx * du, fy * dv, pixel.depth_m + u * du + v * dv};
      const float slant = pixel.depth_m / norm(n);
      if (slant < options.min_slant) continue;
      pixel.slant = slant, pixel.du_m = du, pixel.dv_m = dv;
    }
}

}  // namespace sdftrack::levelset

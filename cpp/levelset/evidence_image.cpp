// SPDX-License-Identifier: MIT
#include "levelset/evidence_image.h"

#include <algorithm>

namespace sdftrack::levelset {

namespace {

// Sets 1 where a 1 is at most `reach` away, along each of `lines` lines of n pixels.
void spread(const unsigned char* from, int reach, int n, int lines, std::size_t step, std::size_t line_step,
            unsigned char* to) {
  for (int l = 0; l < lines; ++l, from += line_step, to += line_step) {
    int last = -2 * reach - 1;  // the last 1 up to x + reach
    for (int x = -reach; x < n; ++x) {
      const int ahead = x + reach;
      if (ahead < n && from[std::size_t(ahead) * step]) last = ahead;
      if (x >= 0) to[std::size_t(x) * step] = last >= x - reach;
    }
  }
}

}  // namespace

void EvidenceImage::make(const ImageView<float>& depth_m, const Camera& camera, const PixelRect& rect,
                         const PixelRole* role, const EvidenceImageOptions& options) {
  rect_ = rect;
  const auto count = std::size_t(rect.count());
  pixels_.resize(count), source_.resize(count), role_.resize(count), edge_.resize(count),
      border_.resize(count), spread_.resize(count);
  read(depth_m, camera, role);
  if (!options.printed) find_borders(options);
  const ImagePlanes planes = this->planes();
  const Intrinsics<float> K = camera.K.cast<float>();
  for (int y = 0; y < height(); ++y)
    for (int x = 0; x < width(); ++x) planes.judge(x, y, rect, K, options);
}

void EvidenceImage::read(const ImageView<float>& depth_m, const Camera& camera, const PixelRole* role) {
  const LensRays lens(camera);
  std::size_t i = 0;
  for (int y = 0; y < height(); ++y)
    for (int x = 0; x < width(); ++x, ++i) {
      const int source = source_of(lens, rect_, x, y);
      const float z = source < 0 ? 0.0f : depth_m(rect_.x0 + source % width(), rect_.y0 + source / width());
      source_[i] = source;
      role_[i] = readable(z) ? role[source] : PixelRole::kUnknown;
      pixels_[i].depth_m = readable(z) ? z : 0.0f;
    }
}

// Marks pixels within border_px of a jump of depth or a change of role, row by row and then column by column.
void EvidenceImage::find_borders(const EvidenceImageOptions& options) {
  const int w = width(), h = height();
  const ImagePlanes planes = this->planes();
  std::fill(edge_.begin(), edge_.end(), static_cast<unsigned char>(0));
  int i = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x, ++i) {
      const auto at = std::size_t(i);
      if (x + 1 < w && planes.differs(i, i + 1, options.jump_m)) edge_[at] = edge_[at + 1] = 1;
      if (y + 1 < h && planes.differs(i, i + w, options.jump_m)) edge_[at] = edge_[at + std::size_t(w)] = 1;
    }
  border_ = edge_;
  if (options.border_px <= 1) return;
  const int reach = options.border_px - 1;  // edge pixels are at the border themselves
  spread(edge_.data(), reach, w, h, 1, std::size_t(w), spread_.data());
  spread(spread_.data(), reach, h, w, std::size_t(w), 1, border_.data());
}

}  // namespace sdftrack::levelset

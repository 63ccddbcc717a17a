// SPDX-License-Identifier: MIT
// A frame made ready for evidence: what each pixel may say about the voxels on its ray.
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/views.h"
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
};

struct EvidenceImageOptions {
  int border_px = 2;     // object pixels nearer than this to others, and those at jumps of depth, say nothing
  float jump_m = 0.01f;  // between neighbours
  float min_slant = 0.2f;  // cosine between the ray and the normal below which a surface says nothing
  bool printed = false;    // every reading of the object speaks, of itself alone; no other does
};

class EvidenceImage {
 public:
  // depth_m: 0 or NaN where nothing is read. role: of the rectangle's pixels, row by row. Pixels of an image
  // with distortion are looked up where the lens puts them.
  void make(const ImageView<float>& depth_m, const Camera& camera, const PixelRect& rect,
            const PixelRole* role, const EvidenceImageOptions& options);

  const PixelRect& rect() const { return rect_; }
  int width() const { return rect_.x1 - rect_.x0; }
  int height() const { return rect_.y1 - rect_.y0; }
  const std::vector<EvidencePixel>& pixels() const { return pixels_; }
  // Where in the rectangle, row by row, an ideal pixel of it was read; -1: outside.
  const std::vector<int>& source() const { return source_; }

 private:
  void read(const ImageView<float>& depth_m, const Camera& camera, const PixelRole* role);
  void find_borders(const EvidenceImageOptions& options);
  void take_all();
  void find_slopes(const Camera& camera, const EvidenceImageOptions& options);
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width()) + static_cast<std::size_t>(x);
  }

  PixelRect rect_{};
  std::vector<EvidencePixel> pixels_;
  std::vector<int> source_;
  std::vector<PixelRole> role_;
  std::vector<unsigned char> edge_, border_, spread_;
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
// A frame prepared for fusion: the evidence of each pixel on the voxels along its ray.
#pragma once

#include <vector>

#include "base/camera.h"
#include "base/views.h"
#include "levelset/evidence_image_terms.h"

namespace sdftrack::levelset {

// A frame's measurements in a rectangle of pixels.
struct FrameEvidence {
  ImageView<float> depth_m;
  PixelRect rect;
  const unsigned char* mask = nullptr;  // of the whole image; nullptr: by colour and depth
  const float* foreground = nullptr;    // of the rectangle: each pixel's foreground posterior
  const unsigned char* rgb = nullptr;   // of the rectangle
};

class EvidenceImage {
 public:
  // depth_m: 0 or NaN where there is no measurement. role: of the rectangle's pixels, row by row. Pixels of
  // an image with distortion are read where the lens projects them.
  void make(const ImageView<float>& depth_m, const Camera& camera, const PixelRect& rect,
            const PixelRole* role, const EvidenceImageOptions& options);

  const PixelRect& rect() const { return rect_; }
  int width() const { return rect_.width(); }
  int height() const { return rect_.height(); }
  const std::vector<EvidencePixel>& pixels() const { return pixels_; }
  // Index in the rectangle, row by row, at which each ideal pixel was read; -1: outside.
  const std::vector<int>& source() const { return source_; }

 private:
  void read(const ImageView<float>& depth_m, const Camera& camera, const PixelRole* role);
  void find_borders(const EvidenceImageOptions& options);
  ImagePlanes planes() {
    return {pixels_.data(), role_.data(), edge_.data(), border_.data(), width(), height()};
  }

  PixelRect rect_{};
  std::vector<EvidencePixel> pixels_;
  std::vector<int> source_;
  std::vector<PixelRole> role_;
  std::vector<unsigned char> edge_, border_, spread_;
};

}  // namespace sdftrack::levelset

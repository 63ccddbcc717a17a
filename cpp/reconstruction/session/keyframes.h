// SPDX-License-Identifier: MIT
// The frames that a reconstruction keeps: their images cropped to the object, and the poses used for fusion.
// They are limited in number, and spread over viewpoints and time.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/rigid.h"
#include "levelset/evidence_image.h"
#include "reconstruction/object_mask.h"

namespace sdftrack::reconstruction {

struct Keyframe {
  int index = 0;
  levelset::PixelRect region{};  // of the depth image; the images below are of this region, row by row
  std::vector<float> depth_m;
  std::vector<std::uint8_t> rgb;  // three bytes per pixel; empty: no colours
  std::vector<float> foreground;  // probability by colour; empty where there is a mask
  Rigidd T_cam_obj;
  std::vector<unsigned char> mask;  // empty: none; the first frame of a recording has one
  int recording = 0;                // 0: the one that began the reconstruction
};

// Bounding box of a mask with a margin.
levelset::PixelRect keyframe_region(const PixelMask& mask);

template <class T>
std::vector<T> cut(const ImageView<T>& image, const levelset::PixelRect& region) {
  std::vector<T> out;
  out.reserve(region.count());
  for (int y = region.y0; y < region.y1; ++y)
    for (int x = region.x0; x < region.x1; ++x) out.push_back(image(x, y));
  return out;
}

// An image (width x height, some numbers per pixel) that is 0 outside the region.
template <class T>
std::vector<T> whole(const std::vector<T>& part, const levelset::PixelRect& region, int width, int height,
                     std::size_t channels = 1) {
  std::vector<T> out(channels * std::size_t(width) * std::size_t(height));
  const std::size_t row = channels * std::size_t(region.x1 - region.x0);
  for (int y = region.y0; y < region.y1; ++y)
    std::copy_n(part.begin() + std::ptrdiff_t(std::size_t(y - region.y0) * row), row,
                out.begin() + std::ptrdiff_t(channels * (std::size_t(y) * width + region.x0)));
  return out;
}

// Keeps the first frame of each recording, and those frames whose removal would leave the widest gaps.
//
// Two frames are similar if they show the same side from the same distance; rotation about the line of sight
// is ignored, and time has a small weight. Once there are more than `most`, each new frame replaces the frame
// with the smallest sum of distances to its two nearest neighbours. (With the nearest one alone it would
// always be the second to last frame of a moving camera, and the gap behind it would grow without bound.)
// Each frame stores its two nearest neighbours, so that adding one costs O(most).
class Keyframes {
 public:
  explicit Keyframes(int most) : most_(most) {}

  // Adds a keyframe, and removes one if there are too many.
  void add(std::shared_ptr<Keyframe> keyframe);
  // In order of arrival.
  const std::vector<std::shared_ptr<Keyframe>>& frames() const { return frames_; }

  // What the choice depends on, for each frame.
  struct Record {
    std::array<double, 5> view;  // direction to the camera, distance, time
    std::array<int, 2> nearest;  // numbers of its two nearest neighbours; -1: there are none yet
    std::array<double, 2> gap;   // to these
  };
  const std::vector<Record>& records() const { return records_; }
  // Continues with what another one kept.
  void restore(std::vector<std::shared_ptr<Keyframe>> frames, std::vector<Record> records);

 private:
  std::size_t least_missed() const;
  void drop(std::size_t k);
  void find_nearest(std::size_t i);

  int most_;
  std::vector<std::shared_ptr<Keyframe>> frames_;
  std::vector<Record> records_;
};

}  // namespace sdftrack::reconstruction

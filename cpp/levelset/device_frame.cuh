// SPDX-License-Identifier: MIT
// A frame on a GPU: the measurements that were sent, and the results from them.
#pragma once

#include <algorithm>

#include "base/device_stream.h"
#include "levelset/evidence_blocks.h"

namespace sdftrack::levelset {

// Addresses on the device, row by row of the rectangle; nullptr: the frame has none.
struct DeviceReadings {
  PixelRect rect;
  const float *depth_m, *foreground;
  const unsigned char *rgb, *mask;
};

class DeviceFrame {
 public:
  // Waits for the stream first, because it may still read the last frame from the pinned memory.
  void send(const FrameEvidence& frame, const DeviceStream& stream) {
    stream.wait();
    const PixelRect& rect = frame.rect;
    const auto n = std::size_t(rect.count());
    make_room(n, rect);
    // Words first, so that each array lies at a multiple of its element size.
    unsigned char *const here = staging_.data(), *const there = sent_.data();
    std::size_t used = 0;
    const auto next = [&](bool given, std::size_t each) {
      const std::size_t at = used;
      used += given ? each * n : 0;
      return at;
    };
    const std::size_t depth = next(true, sizeof(float)), foreground = next(frame.foreground, sizeof(float)),
                      rgb = next(frame.rgb, 3), mask = next(frame.mask, 1);
    cut(frame.depth_m.data, frame.depth_m.width, rect, reinterpret_cast<float*>(here + depth));
    if (frame.foreground) std::copy_n(frame.foreground, n, reinterpret_cast<float*>(here + foreground));
    if (frame.rgb) std::copy_n(frame.rgb, 3 * n, here + rgb);
    if (frame.mask) cut(frame.mask, frame.depth_m.width, rect, here + mask);
    stream.upload(here, used, there);
    readings_ = {rect, reinterpret_cast<const float*>(there + depth),
                 frame.foreground ? reinterpret_cast<const float*>(there + foreground) : nullptr,
                 frame.rgb ? there + rgb : nullptr, frame.mask ? there + mask : nullptr};
  }

  const DeviceReadings& readings() const { return readings_; }

  // The measurements' roles, and working memory to find them.
  DeviceBuffer<PixelRole> role;
  DeviceBuffer<int> parent, reached;
  DeviceBuffer<unsigned char> state;
  // The evidence image.
  DeviceBuffer<EvidencePixel> pixels;
  DeviceBuffer<int> source;
  DeviceBuffer<PixelRole> image_role;
  DeviceBuffer<unsigned char> edge, spread, border;
  DeviceBuffer<Tile> tiles;

 private:
  // Allocates half as much again, because rectangles change from frame to frame.
  template <class T, class Memory>
  static void room(CudaBuffer<T, Memory>* of, std::size_t n) {
    if (of->size() < n) of->room(n + n / 2);
  }
  void make_room(std::size_t n, const PixelRect& rect) {
    constexpr std::size_t kSent = 2 * sizeof(float) + 3 + 1;
    room(&staging_, kSent * n), room(&sent_, kSent * n);
    room(&role, n), room(&parent, n), room(&reached, n), room(&state, n);
    room(&pixels, n), room(&source, n), room(&image_role, n);
    room(&edge, n), room(&spread, n), room(&border, n);
    room(&tiles, std::size_t(tiles_along(rect.width()) * tiles_along(rect.height())));
  }
  // Copies the rectangle's part of an image.
  template <class T>
  static void cut(const T* image, int width, const PixelRect& rect, T* to) {
    for (int y = rect.y0; y < rect.y1; ++y, to += rect.width())
      std::copy_n(image + y * width + rect.x0, rect.width(), to);
  }

  PinnedBuffer<unsigned char> staging_;
  DeviceBuffer<unsigned char> sent_;
  DeviceReadings readings_{};
};

}  // namespace sdftrack::levelset

// SPDX-License-Identifier: MIT
#include "calibration/ball/median.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "base/baseline_lanes.h"

namespace sdftrack::calibration {

namespace {

constexpr int kWindow = 5, kCount = kWindow * kWindow, kHalf = kWindow / 2;
constexpr int kHeld = kCount / 2 + 2;
constexpr int kPacks = 4;  // at a time: a single one would wait for its previous step
constexpr int kLanes = kPacks * kWidth<BaselineLanes>;

struct WindowLanes {
  BaselineLanes pack[kPacks];
};

void order(WindowLanes& a, WindowLanes& b) {
  for (int i = 0; i < kPacks; ++i) {
    const BaselineLanes x = a.pack[i], y = b.pack[i];
    a.pack[i] = select(y < x, y, x);
    b.pack[i] = select(y < x, x, y);
  }
}

// Neither the least nor the greatest of `kHeld` numbers is the median of all: each is replaced by a number
// not yet held, until three are left.
const WindowLanes& window_median(WindowLanes* w) {
  int next = kHeld;
  for (int held = kHeld; held > 2; --held) {
    for (int i = 1; i < held; ++i) order(w[0], w[i]);
    for (int i = 1; i < held - 1; ++i) order(w[i], w[held - 1]);
    if (next < kCount) w[0] = w[next++];
  }
  return w[1];
}

}  // namespace

std::vector<float> median5(const ImageView<float>& image) {
  const int w = image.width, h = image.height;
  std::vector<float> out(std::size_t(w) * h);
  std::vector<float> rows[kWindow];  // extended beyond both ends
  for (std::vector<float>& row : rows) row.resize(w + kWindow + kLanes);
  WindowLanes window[kCount];
  for (int y = 0; y < h; ++y) {
    for (int k = 0; k < kWindow; ++k)
      for (int x = 0; x < w + kWindow + kLanes; ++x)
        rows[k][x] = image(std::clamp(x - kHalf, 0, w - 1), std::clamp(y + k - kHalf, 0, h - 1));
    for (int x0 = 0; x0 < w; x0 += kLanes) {
      for (int k = 0; k < kCount; ++k)
        std::memcpy(&window[k], &rows[k / kWindow][x0 + k % kWindow], sizeof(WindowLanes));
      std::memcpy(&out[std::size_t(y) * w + x0], &window_median(window),
                  sizeof(float) * std::size_t(std::min(kLanes, w - x0)));
    }
  }
  return out;
}

}  // namespace sdftrack::calibration

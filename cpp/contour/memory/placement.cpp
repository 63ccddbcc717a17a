// SPDX-License-Identifier: MIT
#include "contour/memory/placement.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"
#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr std::size_t kHistory = 8;    // frames used for a prediction
constexpr double kDecay = 4;           // frames after which the weight has fallen to 1 / e
constexpr double kMinVelocity = 0.1;   // of the weights, added to the velocity's: a few frames do not fix it
constexpr std::size_t kErrors = 60;    // frames whose errors are kept
constexpr std::size_t kMinErrors = 6;  // with fewer, their rms is not used yet
constexpr double kFirstError = 0.02;   // assumed until then
constexpr double kMaxError = 0.2;      // of the size: limits the effect of one jump

Picture as_picture(const Mask& mask) {
  return each<float>(mask, [](unsigned char inside) { return float(inside); });
}

Mask above_half(const Picture& picture) {
  return each<unsigned char>(picture, [](float share) { return share > 0.5f; });
}

}  // namespace

GridWarp Placement::to_image(int size) const {
  const double scale = size_px / (kFill * size), middle = 0.5 * (size - 1);
  GridWarp out{{scale * turn[0], scale * turn[1], scale * turn[2], scale * turn[3]}, {0, 0}};
  out.t[0] = center_px[0] - (out.a[0] + out.a[1]) * middle;
  out.t[1] = center_px[1] - (out.a[2] + out.a[3]) * middle;
  return out;
}

Placement Placement::moved(const std::array<double, 4>& move, int size) const {
  const auto [x, y, log_scale, angle_rad] = move;
  const double scale = size_px / (kFill * size), c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {{center_px[0] + scale * (turn[0] * x + turn[1] * y),
           center_px[1] + scale * (turn[2] * x + turn[3] * y)},
          size_px * std::exp(log_scale),
          {turn[0] * c + turn[1] * s, turn[1] * c - turn[0] * s, turn[2] * c + turn[3] * s,
           turn[3] * c - turn[2] * s}};
}

Placement placement_of(const Mask& mask, const GridWarp& warp) {
  double cells = 0, sum_x = 0, sum_y = 0;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      if (mask.row(y)[x]) ++cells, sum_x += x, sum_y += y;
  const double cell_px = warp.scale();
  Placement out;
  warp.to_image(sum_x / cells, sum_y / cells, &out.center_px[0], &out.center_px[1]);
  out.size_px = std::sqrt(cells) * cell_px;
  for (std::size_t i = 0; i < 4; ++i) out.turn[i] = warp.a[i] / cell_px;
  return out;
}

Picture seen_from(const Picture& picture, const GridWarp& warp, const Placement& placement, int size,
                  int margin) {
  GridWarp to_cells = after(warp.inverse(), placement.to_image(size));
  const double cells = to_cells.scale();  // cells per pixel of the frame
  to_cells = after(to_cells, {{1, 0, 0, 1}, {-1.0 * margin, -1.0 * margin}});
  const int n = size + 2 * margin, radius = to_int(cells / 2);
  return cells > 1 && radius > 0 ? warped(box_mean(picture, radius), to_cells, n, n)
                                 : warped(picture, to_cells, n, n);
}

Mask seen_from(const Mask& mask, const GridWarp& warp, const Placement& placement, int size) {
  return above_half(seen_from(as_picture(mask), warp, placement, size));
}

Mask put_back(const Mask& mask, const GridWarp& warp, const Placement& placement, int width, int height) {
  const GridWarp to_frame = after(placement.to_image(mask.width).inverse(), warp);
  return above_half(warped(as_picture(mask), to_frame, width, height));
}

void MotionPredictor::add(int time, const Placement& placement, double weight) {
  const double log_size = std::log(placement.size_px);
  if (weight >= 1 && seen_.size() >= kMinErrors) {
    const Prediction there = predict(time);
    errors_.push_back({(placement.center_px[0] - there.center_px[0]) / there.size_px,
                       (placement.center_px[1] - there.center_px[1]) / there.size_px,
                       log_size - std::log(there.size_px)});
    if (errors_.size() > kErrors) errors_.erase(errors_.begin());
  }
  seen_.push_back({time, placement.center_px[0], placement.center_px[1], log_size, weight});
  if (seen_.size() > kHistory) seen_.erase(seen_.begin());
}

Prediction MotionPredictor::predict(int time) const {
  double w = 0, wt = 0, wtt = 0, x[2] = {}, y[2] = {}, log_size = 0;
  for (const Seen& seen : seen_) {
    const double age = seen.time - time;
    const double weight = seen.weight * std::exp((seen.time - seen_.back().time) / kDecay);
    w += weight, wt += weight * age, wtt += weight * age * age;
    x[0] += weight * seen.x, x[1] += weight * age * seen.x;
    y[0] += weight * seen.y, y[1] += weight * age * seen.y;
    log_size += weight * seen.log_size;
  }
  wtt += kMinVelocity * w;
  const double determinant = w * wtt - wt * wt;
  Prediction out{{(wtt * x[0] - wt * x[1]) / determinant, (wtt * y[0] - wt * y[1]) / determinant},
                 std::exp(log_size / w),
                 kFirstError,
                 kFirstError};
  if (errors_.size() < kMinErrors) return out;
  double squares[3] = {};
  for (const std::array<double, 3>& error : errors_)
    for (std::size_t k = 0; k < 3; ++k) {
      const double off = std::min(std::abs(error[k]), kMaxError);
      squares[k] += off * off / double(errors_.size());
    }
  out.place_error = std::sqrt(squares[0] + squares[1]), out.size_error = std::sqrt(squares[2]);
  return out;
}

}  // namespace sdftrack::contour

// SPDX-License-Identifier: MIT
#include "primitives/outline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "plane/plane.h"

namespace sdftrack::primitives {

namespace {

constexpr double kNearer_m = 0.01;  // at 1 m: a measurement nearer than the object by more hides it
constexpr double kStep_m = 0.02;    // at 1 m: a measurement less far behind touches the object
constexpr double kBehind_m = 0.05;  // at 1 m
constexpr double kSlack_m = 0.005;  // at 1 m
constexpr double kStretch_m = 0.6;  // in front of and behind the object's measurements
constexpr double kRamps = 2;        // depth steps between pixels, before a measurement, that are ignored
constexpr int kLost_px = 3;         // largest width of a rim without measurements

Vec3d ray_at(const frame::DepthFrame& frame, const Camera& camera, int x, int y) {
  if (!frame.rays) return ray(camera.K, double(x), double(y));
  const float* r = frame.rays + 2 * (std::ptrdiff_t(y) * camera.width + x);
  return {r[0], r[1], 1};
}

// The change of depth from pixel to pixel on the surface seen at (x, y): centimetres on a face at a grazing
// angle. The smaller of both sides counts, since the other one may be the edge itself.
double ramp_m(const frame::DepthFrame& frame, int x, int y, int width, int height) {
  const float z = frame.depth_m(x, y);
  const auto step = [&](int u, int v) {
    const bool has = u >= 0 && v >= 0 && u < width && v < height && frame.depth_m(u, v) > 0;
    return has ? std::abs(frame.depth_m(u, v) - z) : std::numeric_limits<float>::infinity();
  };
  const float along_x = std::min(step(x - 1, y), step(x + 1, y));
  const float along_y = std::min(step(x, y - 1), step(x, y + 1));
  return std::max(std::isfinite(along_x) ? along_x : 0.0f, std::isfinite(along_y) ? along_y : 0.0f);
}

// The neighbourhood of a pixel in an image.
struct Window {
  int width, height;

  template <class Look>
  void around(int x, int y, int reach_px, const Look& look) const {
    for (int v = std::max(0, y - reach_px); v <= std::min(height - 1, y + reach_px); ++v)
      for (int u = std::max(0, x - reach_px); u <= std::min(width - 1, x + reach_px); ++u) look(u, v);
  }
};

// Finds the three kinds of rays, in the order of rays().
class OutlineFinder {
 public:
  OutlineFinder(const frame::DepthFrame& frame, const Camera& camera, const std::uint8_t* labels,
                int reach_px)
      : frame_(frame),
        camera_(camera),
        labels_(labels),
        reach_px_(reach_px),
        window_{camera.width, camera.height},
        off_(std::size_t(camera.width) * camera.height, 0) {}

  std::vector<OutlineRay> rays() {
    int x0 = window_.width, y0 = window_.height, x1 = 0, y1 = 0;
    for (int y = 0; y < window_.height; ++y)
      for (int x = 0; x < window_.width; ++x)
        if (label(x, y) == Label::kOn)
          x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    const int rim = std::max(reach_px_, kLost_px);
    x0 = std::max(0, x0 - rim), y0 = std::max(0, y0 - rim);
    x1 = std::min(window_.width - 1, x1 + rim), y1 = std::min(window_.height - 1, y1 + rim);
    const auto each = [&](void (OutlineFinder::*look)(int, int)) {
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) (this->*look)(x, y);
    };
    each(&OutlineFinder::look_beside), each(&OutlineFinder::look_on), each(&OutlineFinder::look_lost);
    return std::move(found_);
  }

 private:
  std::size_t at(int x, int y) const { return std::size_t(y) * window_.width + x; }
  Label label(int x, int y) const { return static_cast<Label>(labels_[at(x, y)]); }
  bool is_on(int x, int y) const { return label(x, y) == Label::kOn && frame_.depth_m(x, y) > 0; }
  float nearest_on(int x, int y, int reach_px) const {
    float nearest = std::numeric_limits<float>::infinity();
    window_.around(x, y, reach_px, [&](int u, int v) {
      if (is_on(u, v)) nearest = std::min(nearest, frame_.depth_m(u, v));
    });
    return nearest;
  }
  bool is_beside(int x, int y, int reach_px) const {
    bool beside = false;
    window_.around(x, y, reach_px, [&](int u, int v) { beside |= off_[at(u, v)] != 0; });
    return beside;
  }
  void add(int x, int y, double near_m, double far_m, double z, Sight sight, double slack_m = 0) {
    const double focal = 0.5 * (camera_.K.fx + camera_.K.fy);
    found_.push_back(
        {ray_at(frame_, camera_, x, y), std::max(0.02, near_m), far_m, z / focal, sight, slack_m});
  }

  // Pixels that show something behind the object or touching it.
  void look_beside(int x, int y) {
    if (label(x, y) != Label::kOff) return;
    const float z = frame_.depth_m(x, y);
    if (!(z > 0)) return;
    const float nearest = nearest_on(x, y, std::max(reach_px_, kLost_px));
    if (!std::isfinite(nearest) || z < nearest - plane::plane_tolerance_m(kNearer_m, nearest)) return;
    const bool touches = z < nearest + plane::plane_tolerance_m(kStep_m, nearest);
    if (!touches) off_[at(x, y)] = 1;
    // It may be a face of the object that the mask leaves out: the ray is free up to a little before it.
    const double free_m = z - kRamps * ramp_m(frame_, x, y, window_.width, window_.height);
    add(x, y, nearest - kStretch_m, std::min<double>(free_m, nearest + kStretch_m), nearest, Sight::kBeside,
        touches ? plane::plane_tolerance_m(kSlack_m, nearest) : 0.0);
  }

  void look_on(int x, int y) {
    if (!is_on(x, y) || !is_beside(x, y, reach_px_)) return;
    // A mask may contain measurements of the background: such pixels are left out.
    const double z = nearest_on(x, y, reach_px_);
    if (frame_.depth_m(x, y) < z + plane::plane_tolerance_m(kBehind_m, z))
      add(x, y, z - kStretch_m, z + kStretch_m, z, Sight::kOn);
  }

  void look_lost(int x, int y) {
    if (frame_.depth_m(x, y) > 0 || label(x, y) == Label::kUnknown || !is_beside(x, y, kLost_px)) return;
    const double z = nearest_on(x, y, kLost_px);
    if (std::isfinite(z)) add(x, y, z - kStretch_m, z + kStretch_m, z, Sight::kLost);
  }

  const frame::DepthFrame& frame_;
  const Camera& camera_;
  const std::uint8_t* labels_;
  int reach_px_;
  Window window_;
  std::vector<unsigned char> off_;  // pixels that show what is behind the object
  std::vector<OutlineRay> found_;
};

}  // namespace

std::vector<std::size_t> spread_order(std::size_t n) {
  std::vector<std::size_t> out(n);
  if (n == 0) return out;
  // Steps of the golden section through 0 .. n - 1, made coprime so that each comes once.
  auto step = std::size_t(0.6180339887498949 * double(n));
  step = std::max<std::size_t>(1, step);
  while (std::gcd(step, n) != 1) ++step;
  for (std::size_t i = 0, at = n / 2; i < n; ++i, at = (at + step) % n) out[i] = at;
  return out;
}

LabelledPoints labelled_points(const frame::DepthFrame& frame, const Camera& camera,
                               const std::uint8_t* labels) {
  LabelledPoints found, out;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (labels[std::ptrdiff_t(y) * camera.width + x] != static_cast<std::uint8_t>(Label::kOn)) continue;
      const double z = frame.depth_m(x, y);
      if (z > 0) found.points.push_back(z * ray_at(frame, camera, x, y)), found.pixels.push_back({x, y});
    }
  for (const std::size_t i : spread_order(found.points.size()))
    out.points.push_back(found.points[i]), out.pixels.push_back(found.pixels[i]);
  return out;
}

std::vector<OutlineRay> outline_rays(const frame::DepthFrame& frame, const Camera& camera,
                                     const std::uint8_t* labels, int reach_px) {
  const std::vector<OutlineRay> found = OutlineFinder(frame, camera, labels, reach_px).rays();
  std::vector<OutlineRay> out;
  out.reserve(found.size());
  for (const std::size_t i : spread_order(found.size())) out.push_back(found[i]);
  return out;
}

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
// Whether a pixel's measurement may show the object, and which candidates are used: formulas for one pixel.
#pragma once

#include "base/camera.h"
#include "base/rigid.h"

namespace sdftrack::frame {

constexpr int kRowsAhead = 3;

// See IdealPixel (region.h).
HD Vec2f ideal_pixel(const float* rays, const Intrinsics<float>& K, int width, int x, int y) {
  if (!rays) return {float(x), float(y)};
  const float* r = rays + 2 * (std::size_t(y) * width + x);
  return {K.fx * r[0] + K.cx, K.fy * r[1] + K.cy};
}

// Selects `requested` of `count` candidates, evenly spread over their order.
struct Spread {
  int requested;
  double stride;

  HD static Spread of(int requested, int count) {
    const int n = requested < 0 ? 0 : (requested < count ? requested : count);
    return {n, n > 0 ? double(count) / n : 1.0};
  }
  HD int candidate(int k) const { return int(k * stride); }
  // The k whose candidate this is; -1: it is not selected.
  HD int place_of(int candidate_) const {
    const int about = int(candidate_ / stride);
    for (int k = about > 0 ? about - 1 : 0; k <= about + 1 && k < requested; ++k)
      if (candidate(k) == candidate_) return k;
    return -1;
  }
};

// The noise of measurements, relative to the noise at a given depth.
struct RelativeNoise {
  float noise, per_m2;

  HD float per_noise(float z) const { return 1 / (noise + per_m2 * z * z); }
};

// Measurements in the object's padded box, without those on a plane.
template <class T>
struct SelectTerm {
  const float* depth_m;
  const float* rays;  // x, y of every pixel's ray, interleaved; nullptr without distortion
  int width;
  Intrinsics<T> K;
  T near_m, far_m;
  Rigid<T> T_obj_cam;
  Vec3<T> half_box_m;
  Vec3<T> plane_normal_cam;
  T plane_offset_m;
  T plane_tolerance_m;  // negative: no plane
  T inv_fx = T(1) / K.fx, inv_fy = T(1) / K.fy;

  template <class U>
  HD SelectTerm<U> cast() const {
    return {depth_m,
            rays,
            width,
            K.template cast<U>(),
            U(near_m),
            U(far_m),
            T_obj_cam.template cast<U>(),
            half_box_m.template cast<U>(),
            plane_normal_cam.template cast<U>(),
            U(plane_offset_m),
            U(plane_tolerance_m),
            U(inv_fx),
            U(inv_fy)};
  }

  // Pixels x to x + n - 1 of row y.
  HD auto wants(int x, int y, int n) const {
    const int at = y * width + x;
    const T z = load<T>(depth_m + at, n);
    prefetch(depth_m + at +
             kRowsAhead * width);  // rows are far apart: the hardware does not prefetch the next one
    auto requested = (z > near_m) & (z < far_m);  // NaN fails
    if (!any(requested)) return requested;
    const Vec3<T> p_cam = z * ray_of(x, y, n);
    const Vec3<T> p = T_obj_cam * p_cam;
    requested =
        requested & (abs(p.x) <= half_box_m.x) & (abs(p.y) <= half_box_m.y) & (abs(p.z) <= half_box_m.z);
    return requested & (abs(dot(plane_normal_cam, p_cam) + plane_offset_m) > plane_tolerance_m);
  }

 private:
  HD Vec3<T> ray_of(int x, int y, int n) const {
    if (!rays) {
      const T u = real<T>(indices<T>(x, n)), v = T(float(y));
      return {(u - K.cx) * inv_fx, (v - K.cy) * inv_fy, T(1)};
    }
    const float* r = rays + 2 * (std::size_t(y) * width + x);
    T a, b;
    gather_pair(r, 2 * indices<T>(0, n), &a, &b);
    return {a, b, T(1)};
  }
};

}  // namespace sdftrack::frame

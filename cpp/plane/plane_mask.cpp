// SPDX-License-Identifier: MIT
#include "plane/plane_mask.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.h"
#include "base/portable_math.h"

namespace sdftrack::plane {

namespace {

constexpr int kChunkRows = 32;
constexpr double kFootSigmas = 2;  // of the noise: a measurement above may be a foot
constexpr double kFoot = 2;        // tolerances: reach of a foot from what stands out

enum : unsigned char { kNotOut = 0, kOut = 1, kRaised = 2, kFoundFoot = 3 };

// The plane and the slab in float, used row by row. Residuals are |g| times heights.
struct MaskRow {
  float g[3];
  float near_m, per_m, sideways;           // sideways: of the residual's sd, per metre of depth
  float tolerance2, floor2, slab2, foot2;  // squares: the tolerance and the floor; multiples of the noise
  bool feet;
  float bend[4];  // of this row, by powers of u
  float u0, du;
  bool bent;

  template <class RayX, class Residual>
  void run(const float* depth_m, int width, RayX ray, Residual bent_by, unsigned char* mask) const {
    for (int x = 0; x < width; ++x) {
      const float z = depth_m[x];
      const float q = ray(x);
      const float e = 1.0f - z * q - bent_by(x);
      const float away = z - float(DepthNoise::kNoiseNearest_m);
      const float along = (near_m + per_m * away * away) * q, across = sideways * z;
      const float noise2 = std::max(along * along + across * across, floor2);
      const float e2 = e * e;
      const bool seen = z > 0.0f;
      const bool out = seen & (e2 > std::max(tolerance2, slab2 * noise2));
      const bool raised = seen & !out & (e > 0.0f) & (e2 > foot2 * noise2);
      mask[x] = static_cast<unsigned char>(int(out) | (int(raised & feet) << 1));
    }
  }
};

MaskRow mask_row(const Camera& camera, const InversePlane& plane, const PlaneSlab& slab) {
  const auto f = [](double v) { return float(v); };
  const double length = norm(plane.g), s2 = slab.noise_scale * slab.noise_scale;
  MaskRow m{};
  m.g[0] = f(plane.g.x), m.g[1] = f(plane.g.y), m.g[2] = f(plane.g.z);
  m.near_m = f(slab.noise.near_m), m.per_m = f(slab.noise.per_m);
  m.sideways =
      f(slab.noise.lateral_px * hypotenuse(plane.g.x, plane.g.y) / std::sqrt(camera.K.fx * camera.K.fy));
  m.tolerance2 = f(length * length * slab.tolerance_m * slab.tolerance_m);
  // The floor applies to the noise, whatever its scale.
  m.floor2 = s2 > 0 ? f(length * length * kPlaneNoiseFloor_m * kPlaneNoiseFloor_m / s2) : 0.0f;
  m.slab2 = f(kPlaneSigmas * kPlaneSigmas * s2), m.foot2 = f(kFootSigmas * kFootSigmas * s2);
  m.feet = slab.feet && s2 > 0;
  m.bent = plane.bent();
  const double half = 0.5 * std::max(camera.width, camera.height);
  m.u0 = f(-0.5 * (camera.width - 1) / half), m.du = f(1 / half);
  return m;
}

void run_row(const frame::DepthFrame& frame, const Camera& camera, const InversePlane& plane, MaskRow m,
             int y, unsigned char* mask) {
  const int width = camera.width;
  const float* depth_m = frame.depth_m.data + y * width;
  const double half = 0.5 * std::max(camera.width, camera.height);
  const double v = (y - 0.5 * (camera.height - 1)) / half;
  const auto& b = plane.bend;
  m.bend[0] = float(v * v * (b[2] + v * b[6])), m.bend[1] = float(v * (b[1] + v * b[5]));
  m.bend[2] = float(b[0] + v * b[4]), m.bend[3] = float(b[3]);
  const auto straight = [](int) { return 0.0f; };
  const auto bent = [&m](int x) {
    const float u = m.u0 + m.du * float(x);
    return m.bend[0] + u * (m.bend[1] + u * (m.bend[2] + u * m.bend[3]));
  };
  const auto run = [&](auto ray) {
    if (m.bent)
      m.run(depth_m, width, ray, bent, mask);
    else
      m.run(depth_m, width, ray, straight, mask);
  };
  if (frame.rays) {
    const float* r = frame.rays + 2 * std::ptrdiff_t(y) * width;
    run([&m, r](int x) { return m.g[0] * r[2 * x] + m.g[1] * r[2 * x + 1] + m.g[2]; });
  } else {
    const double ry = (y - camera.K.cy) / camera.K.fy;
    const auto first = float(plane.g.y * ry + plane.g.z - plane.g.x * camera.K.cx / camera.K.fx);
    const auto slope = float(plane.g.x / camera.K.fx);
    run([first, slope](int x) { return first + slope * float(x); });
  }
}

// Raised measurements that are connected to what stands out join it, ring by ring, up to kFoot tolerances in
// pixels at their depth; the others are dropped.
void grow_feet(const frame::DepthFrame& frame, const Camera& camera, const PlaneSlab& slab,
               unsigned char* mask) {
  const int w = camera.width, h = camera.height;
  const double reach = kFoot * slab.tolerance_m * std::sqrt(camera.K.fx * camera.K.fy);
  std::vector<int> ring, next;
  const auto near = [&](int at, int level) {
    return level < std::ceil(reach / double(frame.depth_m.data[at]));
  };
  const auto take = [&](int at, int level) {
    if (mask[at] != kRaised || !near(at, level)) return;
    mask[at] = kFoundFoot, next.push_back(at);
  };
  const auto beside_out = [&](int at, int x, int y) {
    return (x > 0 && mask[at - 1] == kOut) || (x + 1 < w && mask[at + 1] == kOut) ||
           (y > 0 && mask[at - w] == kOut) || (y + 1 < h && mask[at + w] == kOut);
  };
  for (int y = 0; y < h; ++y) {
    unsigned char* row = mask + y * w;
    for (auto* p = static_cast<unsigned char*>(std::memchr(row, kRaised, std::size_t(w))); p;
         p = static_cast<unsigned char*>(std::memchr(p + 1, kRaised, std::size_t(row + w - p - 1)))) {
      const int x = int(p - row), at = y * w + x;
      if (beside_out(at, x, y)) take(at, 0);
    }
  }
  for (int level = 1; !next.empty(); ++level) {
    ring.swap(next), next.clear();
    for (const int at : ring) {
      const int x = at % w, y = at / w;
      if (x > 0) take(at - 1, level);
      if (x + 1 < w) take(at + 1, level);
      if (y > 0) take(at - w, level);
      if (y + 1 < h) take(at + w, level);
    }
  }
  for (std::ptrdiff_t i = 0, n = std::ptrdiff_t(w) * h; i < n; ++i) mask[i] &= 1;
  static_assert((kFoundFoot & 1) == 1 && (kRaised & 1) == 0);
}

}  // namespace

void mask_plane(const frame::DepthFrame& frame, const Camera& camera, const InversePlane& plane,
                const PlaneSlab& slab, int threads, unsigned char* mask) {
  const MaskRow m = mask_row(camera, plane, slab);
  const int chunks = (camera.height + kChunkRows - 1) / kChunkRows;
  parallel_for(chunks, threads, [&](std::size_t chunk) {
    const int first = int(chunk) * kChunkRows;
    for (int y = first; y < std::min(camera.height, first + kChunkRows); ++y)
      run_row(frame, camera, plane, m, y, mask + y * camera.width);
  });
  if (m.feet) grow_feet(frame, camera, slab, mask);
}

}  // namespace sdftrack::plane

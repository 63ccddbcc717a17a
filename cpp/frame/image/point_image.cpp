// SPDX-License-Identifier: MIT
#include "frame/image/point_image.h"

#include <algorithm>
#include <cmath>

#include "base/quantile.h"
#include "optim/dense.h"

namespace sdftrack::frame {

namespace {

constexpr int kBlur = 2;   // pixels to each side that a mean point is of
constexpr int kApart = 3;  // a normal is that of the mean points so far to its sides

struct WeightedPoint {
  Vec3d sum{0, 0, 0};
  double weight = 0;

  void add(const WeightedPoint& other) { sum = sum + other.sum, weight += other.weight; }
};

int reflected(int i, int n) { return i < 0 ? -i : i >= n ? 2 * n - 2 - i : i; }

// Means over squares, of what is measured in them; the image continues reflected beyond its border.
std::vector<Vec3d> mean_points(const PointImage& points) {
  const int w = points.width, h = points.height;
  std::vector<WeightedPoint> along(points.p.size());
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int d = -kBlur; d <= kBlur; ++d) {
        const Vec3d p = points.p[points.at(reflected(x + d, w), y)];
        along[points.at(x, y)].add({p, p.z > 0 ? 1.0 : 0.0});
      }
  std::vector<Vec3d> out(points.p.size());
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      WeightedPoint square;
      for (int d = -kBlur; d <= kBlur; ++d) square.add(along[points.at(x, reflected(y + d, h))]);
      out[points.at(x, y)] = (1 / std::max(square.weight, 1e-9)) * square.sum;
    }
  return out;
}

}  // namespace

PixelMask PointImage::measured() const {
  PixelMask out(width, height);
  for (std::size_t i = 0; i < p.size(); ++i) out.on[i] = p[i].z > 0;
  return out;
}

Vec3d point_at(const DepthFrame& frame, const Camera& camera, int x, int y) {
  const auto z = double(frame.depth_m(x, y));
  if (!(z > 0 && std::isfinite(z))) return {0, 0, 0};
  if (!frame.rays) return z * ray(camera.K, double(x), double(y));
  const float* r = frame.rays + 2 * (std::size_t(y) * camera.width + x);
  return z * Vec3d{double(r[0]), double(r[1]), 1.0};
}

PointImage points_of(const DepthFrame& frame, const Camera& camera, const Rect& window, int step) {
  PointImage out;
  out.width = (window.x1 - window.x0 + step - 1) / step;
  out.height = (window.y1 - window.y0 + step - 1) / step;
  for (int y = window.y0; y < window.y1; y += step)
    for (int x = window.x0; x < window.x1; x += step) out.p.push_back(point_at(frame, camera, x, y));
  return out;
}

std::vector<Vec3d> points_in(const PointImage& points, const PixelMask& mask) {
  std::vector<Vec3d> out;
  for (std::size_t i = 0; i < points.p.size(); ++i)
    if (mask.on[i]) out.push_back(points.p[i]);
  return out;
}

std::vector<Vec3d> smooth_normals(const PointImage& points) {
  std::vector<Vec3d> out(points.p.size(), Vec3d{0, 0, 0});
  if (points.width <= 2 * kApart || points.height <= 2 * kApart) return out;
  const std::vector<Vec3d> mean = mean_points(points);
  const PixelMask whole = eroded(points.measured(), 1);
  for (int y = kApart; y < points.height - kApart; ++y)
    for (int x = kApart; x < points.width - kApart; ++x) {
      if (!whole(x, y)) continue;
      const Vec3d right = mean[points.at(x + kApart, y)] - mean[points.at(x - kApart, y)];
      const Vec3d down = mean[points.at(x, y + kApart)] - mean[points.at(x, y - kApart)];
      const Vec3d n = cross(down, right);
      if (norm(n) > 0) out[points.at(x, y)] = (1 / norm(n)) * n;
    }
  return out;
}

double longest_extent_m(const std::vector<Vec3d>& points, double low_share, double high_share) {
  if (points.size() < 3) return 0;
  const auto n = double(points.size());
  Vec3d middle{0, 0, 0};
  for (const Vec3d& p : points) middle = middle + p;
  middle = (1 / n) * middle;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vec3d& p : points) {
    const Eigen::Vector3d d(p.x - middle.x, p.y - middle.y, p.z - middle.z);
    scatter += d * d.transpose();
  }
  // A few points far behind turn the first axis towards them: the extent is the largest of the three.
  const Eigen::Matrix3d axes = optim::eigenpairs<3>(scatter / n).vectors;
  double longest = 0;
  for (int k = 2; k >= 0; --k) {
    const Eigen::Vector3d axis = axes.col(k);
    std::vector<double> along;
    along.reserve(points.size());
    for (const Vec3d& p : points) along.push_back(axis.x() * p.x + axis.y() * p.y + axis.z() * p.z);
    const double low = quantile(&along, low_share);
    longest = std::max(longest, quantile(&along, high_share) - low);
  }
  return longest;
}

}  // namespace sdftrack::frame

// SPDX-License-Identifier: MIT
#include "calibration/ball/depth_ball.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "calibration/ball/ball_filter.h"
#include "calibration/ball/median.h"
#include "optim/dense.h"

namespace sdftrack::calibration {

namespace {

// Measurements at more than 60 degrees of incidence suffer from lateral noise and edge loss.
constexpr double kMinCosine = 0.5;
constexpr int kMinPixels = 40;
constexpr double kNoiseFloor_m = 0.0003;
// Constant part, and the part per squared metre: twice a Kinect's noise, with its disparity steps.
constexpr double kMaxNoise_m = 0.002;
constexpr double kTukeyReach = 4.685;  // sd
constexpr double kSmallStep_m = 1e-6;
struct Stage {
  double gate_radii;  // 0: only by the noise
  int steps;
};
constexpr Stage kStages[] = {{0.5, 3}, {0.2, 4}, {0, 6}};
constexpr int kOnRim = 48;  // points around the outline
constexpr int kTried = 8;   // candidates that are fitted

// Normal equations for a step of the centre, with Tukey's weights.
struct Step {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  int agree = 0;
};

}  // namespace

SphereHit hit_sphere(Vec3d ray, Vec3d center_cam, double radius_m) {
  const double dd = dot(ray, ray), dc = dot(ray, center_cam);
  const double inside = dc * dc - dd * (dot(center_cam, center_cam) - radius_m * radius_m);
  if (!(inside >= 0)) return {std::numeric_limits<double>::quiet_NaN(), {0, 0, 0}, 0};
  const double z = (dc - std::sqrt(inside)) / dd;
  const Vec3d normal = (1 / radius_m) * (z * ray - center_cam);
  const double along = dot(normal, ray);
  return {z, (1 / along) * normal, std::abs(along) / (norm(normal) * std::sqrt(dd))};
}

// Residuals of the measurements that may be the ball's, and the pixels that face the camera.
struct BallFinder::Gated {
  std::vector<double> residual;
  std::vector<Vec3d> by_center;
  int facing = 0;

  Step step(double noise_m) const {
    Step out;
    for (std::size_t i = 0; i < residual.size(); ++i) {
      const double w = tukey_weight(residual[i] / noise_m);
      const Eigen::Vector3d J(by_center[i].x, by_center[i].y, by_center[i].z);
      out.H += w * J * J.transpose(), out.g += w * residual[i] * J;
      out.agree += w > 0;
    }
    return out;
  }
};

BallFinder::BallFinder(const Camera& camera, double radius_m) : camera_(camera), radius_m_(radius_m) {
  if (camera.distorted()) rays_ = ray_table(camera);
}

Vec3d BallFinder::ray(int u, int v) const {
  if (rays_.empty()) return sdftrack::ray(camera_.K, double(u), double(v));
  const std::size_t at = 2 * (std::size_t(v) * camera_.width + u);
  return {double(rays_[at]), double(rays_[at + 1]), 1};
}

// Empty if there are too few.
std::optional<BallFinder::Gated> BallFinder::gated(const ImageView<float>& depth, const float* given_m,
                                                   Vec3d center_cam, double gate_m) const {
  const Vec2d px = camera_.project_point(center_cam);
  const double focal = std::max(camera_.K.fx, camera_.K.fy);
  const double reach = 1.2 * focal * radius_m_ / std::max(center_cam.z - radius_m_, 0.02) + 1;
  const int x1 = to_int_within(px.x + reach + 2, 0, depth.width);
  const int y1 = to_int_within(px.y + reach + 2, 0, depth.height);
  Gated out;
  for (int v = to_int_within(px.y - reach, 0, depth.height); v < y1; ++v)
    for (int u = to_int_within(px.x - reach, 0, depth.width); u < x1; ++u) {
      const SphereHit hit = hit_sphere(ray(u, v), center_cam, radius_m_);
      const bool filled = given_m && depth(u, v) > 0 && !(given_m[std::ptrdiff_t(v) * depth.width + u] > 0);
      if (filled || !(hit.cosine > kMinCosine)) continue;
      ++out.facing;
      const double r = double(depth(u, v)) - hit.z;
      if (!(depth(u, v) > 0) || !(std::abs(r) < gate_m)) continue;
      out.residual.push_back(r), out.by_center.push_back(hit.by_center);
    }
  if (out.residual.size() < std::size_t(kMinPixels)) return std::nullopt;
  return out;
}

std::optional<DepthBall> BallFinder::fit(const ImageView<float>& depth, const float* given_m,
                                         Vec3d start_cam) const {
  Vec3d center = start_cam;
  double noise = 0.002;
  Step last;
  int facing = 0;
  for (const Stage& stage : kStages)
    for (int k = 0; k < stage.steps; ++k) {
      const double gate = std::max(stage.gate_radii * radius_m_, kTukeyReach * noise);
      const std::optional<Gated> near = gated(depth, given_m, center, gate);
      if (!near) return std::nullopt;
      noise = std::max(sd_by_median(near->residual), kNoiseFloor_m);
      last = near->step(noise), facing = near->facing;
      const Eigen::Matrix3d damped = last.H + 1e-9 * last.H.trace() * Eigen::Matrix3d::Identity();
      const Eigen::Vector3d step = optim::solve_symmetric<3, 1>(damped, last.g);
      center = center + Vec3d{step[0], step[1], step[2]};
      if (!step.allFinite() || !(center.z > radius_m_ && center.z < kFarthest_m)) return std::nullopt;
      if (stage.gate_radii == 0 && step.cwiseAbs().maxCoeff() < kSmallStep_m) break;
    }
  const double share = double(last.agree) / std::max(1, facing);
  const double max_noise = std::min(0.15 * radius_m_, kMaxNoise_m * (1 + center.z * center.z));
  if (last.agree < kMinPixels || share < kMinShare || noise > max_noise) return std::nullopt;
  if (free_around(depth, center) < kMinFree) return std::nullopt;
  return DepthBall{center, noise * noise * optim::inverse_symmetric<3>(last.H), noise, last.agree, share};
}

// Share of the pixels in a ring around the outline that lie behind the ball.
double BallFinder::free_around(const ImageView<float>& depth, Vec3d center_cam) const {
  const double reach = kOuterRing * radius_m_;
  int free = 0;
  for (const Vec2d d : directions(kOnRim, 0)) {
    const Vec2d px = camera_.project_point(center_cam + Vec3d{reach * d.x, reach * d.y, 0});
    const double at = depth_at(depth, px.x, px.y);
    free += at <= 0 || at > center_cam.z + 0.5 * radius_m_;
  }
  return double(free) / kOnRim;
}

std::vector<DepthBall> BallFinder::search(const ImageView<float>& depth, const float* given_m) const {
  const std::vector<float> smooth = median5(depth);
  std::vector<NearestPoint> points =
      nearest_points({smooth.data(), depth.width, depth.height}, camera_, radius_m_);
  std::vector<DepthBall> found;
  for (int k = 0; k < kTried && !points.empty(); ++k) {
    const NearestPoint best =
        *std::max_element(points.begin(), points.end(),
                          [](const NearestPoint& a, const NearestPoint& b) { return a.score < b.score; });
    const Vec3d d = ray(best.u, best.v);
    const std::optional<DepthBall> ball = fit(depth, given_m, (best.z + radius_m_ / norm(d)) * d);
    if (ball && std::none_of(found.begin(), found.end(), [&](const DepthBall& f) {
          return norm(f.center_cam - ball->center_cam) < radius_m_;
        }))
      found.push_back(*ball);
    std::erase_if(points, [&](const NearestPoint& p) {
      return hypotenuse(p.u - best.u, p.v - best.v) < best.radius_px;
    });
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const DepthBall& a, const DepthBall& b) { return a.share > b.share; });
  return found;
}

}  // namespace sdftrack::calibration

// SPDX-License-Identifier: MIT
#include "tracking/search/placement.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kPoints = 120;
constexpr double kLarger = 0.15;   // excess over the box, relative to it, from which its edges are tried
constexpr double kSideStep = 0.2;  // to a place beside the centroid, over the diameter

}  // namespace

double box_coverage(const Camera& camera, const frame::Shape& shape, const Rigidf& T_obj_cam,
                    const frame::Rect& box) {
  const Rigidf T_cam_obj = inverse(T_obj_cam);
  const Intrinsics<float> K = camera.K.cast<float>();
  Vec2f low{1e9f, 1e9f}, high{-1e9f, -1e9f};
  for (const Vec3f& p_obj : shape.outline) {
    const Vec3f p = T_cam_obj * p_obj;
    if (!(p.z > 1e-3f)) return 0;
    const Vec2f u = project(K, p);
    low = {std::min(low.x, u.x), std::min(low.y, u.y)}, high = {std::max(high.x, u.x), std::max(high.y, u.y)};
  }
  const auto overlap = [](float a0, float a1, int b0, int b1) {
    const double length = std::min<double>(a1, b1) - std::max<double>(a0, b0);
    return std::max(0.0, length) / std::max(1, b1 - b0);
  };
  return overlap(low.x, high.x, box.x0, box.x1) * overlap(low.y, high.y, box.y0, box.y1);
}

// The centroid weights each point by its area in the image. Where something hides a side of the object, only
// those points count that the measurements reach, from the edge of the other side.
void Placer::turn(const Mat3d& R_cam_obj, const Proposal& proposal) {
  R_ = R_cam_obj, proposal_ = &proposal;
  const Vec3d view = (1 / norm(proposal.centroid_cam)) * proposal.centroid_cam;
  const std::size_t stride = std::max<std::size_t>(1, shape_.search_points.size() / kPoints);
  all_.clear(), facing_.clear();
  double edge = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < shape_.search_points.size(); i += stride) {
    all_.push_back(R_ * shape_.search_points[i].cast<double>());
    edge = std::min(edge, dot(proposal.hidden_cam, all_.back()));
  }
  edge = proposal.seen_extent_m > 0 ? edge + proposal.seen_extent_m : std::numeric_limits<double>::max();
  Vec3d sum{0, 0, 0};
  double total = 0;
  for (std::size_t k = 0; k < all_.size(); ++k) {
    const double facing = -dot(R_ * shape_.search_normals[k * stride].cast<double>(), view);
    if (facing <= 0) continue;
    facing_.push_back(all_[k]);
    if (dot(proposal.hidden_cam, all_[k]) > edge) continue;
    sum = sum + facing * all_[k], total += facing;
  }
  centroid_ = total > 0 ? (1 / total) * sum : sum;
}

Rigidd Placer::on_centroid() const { return {R_, proposal_->centroid_cam - centroid_}; }

const std::vector<Rigidd>& Placer::about_centroid() {
  places_.clear();
  const double step = kSideStep * shape_.diameter_m;
  for (const Vec3d& side :
       {Vec3d{0, 0, 0}, Vec3d{step, 0, 0}, Vec3d{-step, 0, 0}, Vec3d{0, step, 0}, Vec3d{0, -step, 0}}) {
    Rigidd T = on_centroid();
    T.t = T.t + side;
    settle_depth(&T);
    places_.push_back(T);
  }
  return places_;
}

Placer::Bounds Placer::bounds(const Rigidd& T) const {
  Bounds b{{1e9, 1e9}, {-1e9, -1e9}};
  for (const Vec3d& q : all_) {
    const double inv = 1 / std::max(1e-3, q.z + T.t.z);
    const double u[2] = {(q.x + T.t.x) * inv, (q.y + T.t.y) * inv};
    for (int a = 0; a < 2; ++a) b.low[a] = std::min(b.low[a], u[a]), b.high[a] = std::max(b.high[a], u[a]);
  }
  return b;
}

const std::vector<Rigidd>& Placer::in_box(const frame::Rect& box) {
  places_.clear();
  const Intrinsics<double>& K = camera_.K;
  const double low[2] = {(box.x0 - K.cx) / K.fx, (box.y0 - K.cy) / K.fy};
  const double high[2] = {(box.x1 - 1 - K.cx) / K.fx, (box.y1 - 1 - K.cy) / K.fy};
  const auto align = [&](const int side[2], Rigidd* T) {
    for (int round = 0; round < 2; ++round) {
      const Bounds b = bounds(*T);
      double shift[2];
      for (int a = 0; a < 2; ++a)
        shift[a] = side[a] < 0   ? low[a] - b.low[a]
                   : side[a] > 0 ? high[a] - b.high[a]
                                 : 0.5 * (low[a] + high[a] - b.low[a] - b.high[a]);
      T->t.x += shift[0] * T->t.z, T->t.y += shift[1] * T->t.z;
      settle_depth(T);
    }
  };
  Rigidd middle = on_centroid();
  const int centred[2] = {0, 0};
  align(centred, &middle);
  const Bounds b = bounds(middle);
  int reach[2];
  for (int a = 0; a < 2; ++a) reach[a] = b.high[a] - b.low[a] > (1 + kLarger) * (high[a] - low[a]);
  for (int y = -reach[1]; y <= reach[1]; ++y)
    for (int x = -reach[0]; x <= reach[0]; ++x) {
      const int side[2] = {x, y};
      Rigidd T = middle;
      if (x != 0 || y != 0) align(side, &T);
      places_.push_back(T);
    }
  return places_;
}

// Moves along the line of sight by the median of the measured gaps.
void Placer::settle_depth(Rigidd* T) {
  beyond_.clear();
  const double inv = 1.0 / scene_.step;
  for (const Vec3d& q : facing_) {
    const Vec3d p = q + T->t;
    if (!(p.z > 1e-3)) continue;
    const Vec2d u = project(camera_.K, p);
    const double x = (u.x - scene_.x0) * inv + 0.5, y = (u.y - scene_.y0) * inv + 0.5;
    if (!(x > 0 && y > 0 && x < scene_.width && y < scene_.height)) continue;
    const double z = scene_.depth_m[scene_.at(to_int(x), to_int(y))];
    if (z > 0 && std::abs(z - p.z) < shape_.diameter_m) beyond_.push_back(z - p.z);
  }
  if (beyond_.empty()) return;
  const auto middle = beyond_.begin() + static_cast<std::ptrdiff_t>(beyond_.size() / 2);
  std::nth_element(beyond_.begin(), middle, beyond_.end());
  T->t = (1 + *middle / T->t.z) * T->t;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
// Points of a cloud that lie by themselves: the surface is where points are dense.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "primitives/view.h"

namespace sdftrack::primitives {

namespace {

constexpr std::size_t kWithNeighbours = 20000;  // points that are looked at, as many as a fit uses
constexpr std::size_t kLeastPoints = 300;       // with fewer, many lie by themselves
constexpr std::size_t kSampled = 100;           // points whose distance to a neighbour is measured
constexpr int kNeighbour = 8;                   // the nearest one is 1
// Times the median distance to that neighbour: at a corner of an open surface it is twice as far. Chosen on
// 160 clouds (experiments/primitives/stray_points.py).
constexpr double kFarFromOthers = 1.5;
constexpr double kFewStrays = 0.01;  // a share of the points below which none are left out

double squared(Vec3d d) { return dot(d, d); }

// Distance within which half of the points have kNeighbour others.
double usual_reach(const std::vector<Vec3d>& points) {
  std::vector<double> reach, apart(points.size());
  const std::size_t step = std::max<std::size_t>(1, points.size() / kSampled);
  for (std::size_t i = 0; i < points.size(); i += step) {
    for (std::size_t j = 0; j < points.size(); ++j) apart[j] = squared(points[j] - points[i]);
    std::nth_element(apart.begin(), apart.begin() + kNeighbour, apart.end());
    reach.push_back(std::sqrt(apart[kNeighbour]));
  }
  const auto middle = reach.begin() + std::ptrdiff_t(reach.size() / 2);
  std::nth_element(reach.begin(), middle, reach.end());
  return *middle;
}

// Points by cells as wide as the reach of a search. Cells far apart may share a list.
class Cells {
 public:
  Cells(const std::vector<Vec3d>& points, double reach_m)
      : points_(points), reach_m_(reach_m), next_(points.size(), kNone) {
    std::size_t lists = 1;
    while (lists < 2 * points.size()) lists *= 2;
    first_.assign(lists, kNone);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::size_t& first = first_[list_of(cell(points[i], {0, 0, 0}))];
      next_[i] = first, first = i;
    }
  }

  // Whether at least `least` others are within the reach.
  bool has_neighbours(std::size_t i, int least) const {
    int count = -1;  // without itself
    std::size_t seen[27];
    int lists = 0;
    for (double x : {-1.0, 0.0, 1.0})
      for (double y : {-1.0, 0.0, 1.0})
        for (double z : {-1.0, 0.0, 1.0}) {
          const std::size_t list = list_of(cell(points_[i], {x, y, z}));
          if (std::find(seen, seen + lists, list) != seen + lists) continue;
          seen[lists++] = list;
          for (std::size_t j = first_[list]; j != kNone; j = next_[j])
            if (squared(points_[j] - points_[i]) <= reach_m_ * reach_m_ && ++count >= least) return true;
        }
    return false;
  }

 private:
  static constexpr std::size_t kNone = std::size_t(-1);

  Vec3d cell(Vec3d p, Vec3d by) const {
    const Vec3d at = (1 / reach_m_) * (p - points_.front());
    return {std::floor(at.x) + by.x, std::floor(at.y) + by.y, std::floor(at.z) + by.z};
  }
  std::size_t list_of(Vec3d cell) const {
    std::uint64_t key = 0;
    for (const double x : {cell.x, cell.y, cell.z})
      key = (key ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(x))) * 0x9e3779b97f4a7c15u;
    return std::size_t(key >> 20) & (first_.size() - 1);
  }

  const std::vector<Vec3d>& points_;
  double reach_m_;
  std::vector<std::size_t> first_, next_;
};

}  // namespace

PrimitiveView without_strays(const PrimitiveView& view) {
  if (view.along_rays || view.points.size() < kLeastPoints) return view;
  std::vector<Vec3d> points = view.points;
  if (points.size() > kWithNeighbours) points.resize(kWithNeighbours);
  const double reach_m = kFarFromOthers * usual_reach(points);
  if (!(reach_m > 0)) return view;  // half of the points are the same one
  const Cells cells(points, reach_m);
  PrimitiveView out = view;
  out.points.clear();
  for (std::size_t i = 0; i < points.size(); ++i)
    if (cells.has_neighbours(i, kNeighbour)) out.points.push_back(points[i]);
  const auto left_out = double(points.size() - out.points.size());
  if (left_out < kFewStrays * double(points.size())) return view;
  out.pack();
  return out;
}

}  // namespace sdftrack::primitives

// SPDX-License-Identifier: MIT
#include "contour/memory/occluders.h"

#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "contour/memory/mask_ops.h"

namespace sdftrack::contour {

namespace {

constexpr double kMinShare = 0.0015;  // of the grid (6 of 64 x 64 pixels): smaller pieces are ragged edges
// Visible share of the object in the hull of two pieces, above which they are two occluders.
constexpr double kSeenBetween = 0.25;

using Point = std::pair<int, int>;  // x, y

int turn(const Point& a, const Point& b, const Point& c) {
  return (b.first - a.first) * (c.second - a.second) - (b.second - a.second) * (c.first - a.first);
}

// Corners of the convex hull in order, by Andrew's monotone chain.
std::vector<Point> hull_of(std::vector<Point> points) {
  std::sort(points.begin(), points.end());
  if (points.size() < 3) return points;
  std::vector<Point> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // the first one of the other side
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

// Whether a pixel lies in the region or at most half a pixel outside it, across the edge.
bool holds(const std::vector<Point>& hull, const Point& p) {
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const int longest = std::max(std::abs(b.first - a.first), std::abs(b.second - a.second));
    if (2 * turn(a, b, p) < -longest) return false;
  }
  return true;
}

// The visible share of the object within a convex region.
double seen_share(const std::vector<Point>& hull, const Mask& hidden, const Mask& seen) {
  const auto by_y = [](const Point& a, const Point& b) { return a.second < b.second; };
  const auto [left, right] = std::minmax_element(hull.begin(), hull.end());
  const auto [top, bottom] = std::minmax_element(hull.begin(), hull.end(), by_y);
  int n_seen = 0, n_hidden = 0;
  for (int y = top->second; y <= bottom->second; ++y)
    for (int x = left->first; x <= right->first; ++x) {
      if (!holds(hull, {x, y})) continue;
      n_seen += seen.row(y)[x], n_hidden += hidden.row(y)[x];
    }
  return double(n_seen) / std::max(1, n_seen + n_hidden);
}

// Hulls of the pieces, without ragged edges.
std::vector<std::vector<Point>> hulls_of(const Mask& hidden, double of_largest) {
  const Pieces pieces = pieces_of(hidden);
  const int largest = *std::max_element(pieces.areas.begin(), pieces.areas.end());
  const double least = std::max(kMinShare * double(hidden.size()), of_largest * largest);
  std::vector<std::vector<Point>> points(pieces.areas.size()), out;
  for (int y = 0; y < hidden.height; ++y)
    for (int x = 0; x < hidden.width; ++x) points[pieces.numbers.row(y)[x]].emplace_back(x, y);
  for (std::size_t k = 1; k < points.size(); ++k)
    if (pieces.areas[k] >= least) out.push_back(hull_of(std::move(points[k])));
  return out;
}

// Joins the first two groups that belong together; false if there are none.
bool join_two(const Mask& hidden, const Mask& seen, std::vector<std::vector<Point>>* groups) {
  for (std::size_t i = 0; i < groups->size(); ++i)
    for (std::size_t j = i + 1; j < groups->size(); ++j) {
      std::vector<Point> points = (*groups)[i];
      points.insert(points.end(), (*groups)[j].begin(), (*groups)[j].end());
      std::vector<Point> hull = hull_of(std::move(points));
      if (seen_share(hull, hidden, seen) >= kSeenBetween) continue;
      (*groups)[i] = std::move(hull);
      groups->erase(groups->begin() + std::ptrdiff_t(j));
      return true;
    }
  return false;
}

}  // namespace

int count_occluders(const Mask& hidden, const Mask& seen, double of_largest) {
  std::vector<std::vector<Point>> groups = hulls_of(hidden, of_largest);
  while (join_two(hidden, seen, &groups)) {
  }
  return int(groups.size());
}

}  // namespace sdftrack::contour

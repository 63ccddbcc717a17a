// SPDX-License-Identifier: MIT
#include "sdf/bvh.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "base/interrupt.h"
#include "base/to_int.h"

namespace sdftrack::sdf {

namespace {

constexpr int kLeafSize = 4;
constexpr int kBins = 16;
constexpr std::size_t kManyItems = 4096;
constexpr int kMaxDepth = 64;  // deeper splits are at the median, so that kBvhStack suffices

double axis_of(Vec3d p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

struct Item {
  Box3 box;
  Vec3d centre;
  std::int32_t face;
};

struct Split {
  int axis = -1;
  int bin = 0;
  double low = 0, scale = 0;
};

int bin_of(const Split& s, Vec3d centre) {
  return to_int_within((axis_of(centre, s.axis) - s.low) * s.scale, 0, kBins - 1);
}

// The cheapest of the kBins - 1 planes of each axis: left area x left count + right area x right count.
Split best_split(const std::vector<Item>& items, std::size_t begin, std::size_t end) {
  if (end - begin > kManyItems) check_interrupt();
  Box3 centres;
  for (std::size_t i = begin; i < end; ++i) centres.add(items[i].centre);
  Split best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = axis_of(centres.low, axis), extent = axis_of(centres.high, axis) - low;
    if (!(extent > 0)) continue;
    Split split{axis, 0, low, kBins / extent};
    std::array<Box3, kBins> boxes;
    std::array<int, kBins> counts{};
    for (std::size_t i = begin; i < end; ++i) {
      const auto b = std::size_t(bin_of(split, items[i].centre));
      boxes[b].add(items[i].box);
      ++counts[b];
    }
    std::array<double, kBins> right_cost{};
    Box3 right;
    int right_count = 0;
    for (std::size_t b = kBins - 1; b > 0; --b) {
      right.add(boxes[b]);
      right_count += counts[b];
      right_cost[b] = right_count ? right.half_area() * right_count : 0;
    }
    Box3 left;
    int left_count = 0;
    for (std::size_t b = 0; b + 1 < kBins; ++b) {
      left.add(boxes[b]);
      left_count += counts[b];
      const double cost = (left_count ? left.half_area() * left_count : 0) + right_cost[b + 1];
      if (left_count && cost < best_cost) {
        best_cost = cost;
        best = split;
        best.bin = int(b);
      }
    }
  }
  return best;
}

std::size_t divide(std::vector<Item>& items, std::size_t begin, std::size_t end, int depth) {
  const auto first = items.begin() + std::ptrdiff_t(begin);
  const auto last = items.begin() + std::ptrdiff_t(end);
  std::size_t middle = begin;
  if (depth < kMaxDepth) {
    const Split split = best_split(items, begin, end);
    if (split.axis >= 0) {
      const auto m = std::stable_partition(
          first, last, [&](const Item& item) { return bin_of(split, item.centre) <= split.bin; });
      middle = std::size_t(m - items.begin());
    }
  }
  return middle == begin || middle == end ? begin + (end - begin) / 2 : middle;
}

}  // namespace

void Box3::add(Vec3d p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
}

void Box3::add(const Box3& b) {
  low = {std::min(low.x, b.low.x), std::min(low.y, b.low.y), std::min(low.z, b.low.z)};
  high = {std::max(high.x, b.high.x), std::max(high.y, b.high.y), std::max(high.z, b.high.z)};
}

double Box3::half_area() const {
  const Vec3d e = high - low;
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

double Box3::distance2(Vec3d p) const {
  const Vec3d d{std::max({low.x - p.x, 0.0, p.x - high.x}), std::max({low.y - p.y, 0.0, p.y - high.y}),
                std::max({low.z - p.z, 0.0, p.z - high.z})};
  return dot(d, d);
}

Bvh::Bvh(const MeshView& mesh) {
  if (mesh.face_count == 0) throw std::invalid_argument("mesh: expected at least one face, got none");
  std::vector<Item> items(mesh.face_count);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Triangle t = mesh.triangle(i);
    Box3 box;
    box.add(t.a), box.add(t.b), box.add(t.c);
    items[i] = {box, 0.5 * (box.low + box.high), static_cast<std::int32_t>(i)};
  }
  struct Task {
    std::size_t node, begin, end;
    int depth;
  };
  nodes_.reserve(items.size());
  nodes_.emplace_back();
  std::vector<Task> tasks{{0, 0, items.size(), 0}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    Box3 box;
    for (std::size_t i = task.begin; i < task.end; ++i) box.add(items[i].box);
    if (task.end - task.begin <= kLeafSize) {
      nodes_[task.node] = {box, static_cast<std::int32_t>(task.begin),
                           static_cast<std::int32_t>(task.end - task.begin)};
      continue;
    }
    const std::size_t middle = divide(items, task.begin, task.end, task.depth), child = nodes_.size();
    nodes_[task.node] = {box, static_cast<std::int32_t>(child), 0};
    nodes_.resize(child + 2);
    tasks.push_back({child, task.begin, middle, task.depth + 1});
    tasks.push_back({child + 1, middle, task.end, task.depth + 1});
  }
  places_.resize(items.size());
  for (const Item& item : items) {
    places_[item.face] = static_cast<std::int32_t>(faces_.size());
    triangles_.push_back(mesh.triangle(std::size_t(item.face)));
    faces_.push_back(item.face);
  }
}

Closest Bvh::closest(Vec3d p, double limit2, std::int32_t guess) const {
  Closest best;
  best.distance2 = limit2;
  const auto visit = [&](std::size_t i) {
    const Vec3d q = closest_point(triangles_[i], p), d = p - q;
    const double d2 = dot(d, d);
    if (d2 < best.distance2) best = {d2, q, faces_[i]};
  };
  if (guess >= 0) visit(std::size_t(places_[guess]));
  std::array<std::pair<double, std::int32_t>, kBvhStack> stack;
  int top = 0;
  stack[top++] = {nodes_[0].box.distance2(p), 0};
  while (top > 0) {
    const auto [near2, index] = stack[--top];
    if (near2 >= best.distance2) continue;
    const BvhNode& node = nodes_[index];
    if (node.count) {
      for (std::int32_t i = 0; i < node.count; ++i) visit(std::size_t(node.first + i));
      continue;
    }
    std::pair<double, std::int32_t> left{nodes_[node.first].box.distance2(p), node.first};
    std::pair<double, std::int32_t> right{nodes_[std::size_t(node.first) + 1].box.distance2(p),
                                          node.first + 1};
    if (left.first < right.first) std::swap(left, right);  // the nearer one is popped first
    if (left.first < best.distance2) stack[top++] = left;
    if (right.first < best.distance2) stack[top++] = right;
  }
  return best;
}

}  // namespace sdftrack::sdf

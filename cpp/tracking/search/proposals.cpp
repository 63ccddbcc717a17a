// SPDX-License-Identifier: MIT
#include "tracking/search/proposals.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/to_int.h"
#include "tracking/search/free_region.h"

namespace sdftrack::tracking {

namespace {

constexpr int kMinReadings = 12;
constexpr int kCoarsePoints = 100, kFinePoints = 300, kSolidPoints = 60;
constexpr double kWindow = 0.55;   // radius of a window's measurements over the object's diameter
constexpr double kSpacing = 0.35;  // of windows, over the diameter
constexpr double kBeyond = 0.6;    // behind a window's middle, over the diameter: no part of the object
constexpr int kMaxCentres = 64;    // places that are examined,
constexpr int kMaxWindows = 12;    // and those of about the object's size that are searched
constexpr double kFilled = 0.75;   // of the object's box in the mean view
constexpr int kAreaStride = 3, kMeanShifts = 3;
constexpr float kContinuous_m = 0.015;
constexpr int kReach_nodes = 2;

// Whether most of the candidates around a candidate have about its depth: at the edge of something nearer,
// pixels of the object have the depth of that thing.
bool among_its_like(const SearchScene& scene, int i, int j) {
  const float z = scene.depth_m[scene.at(i, j)];
  int like = 0, all = 0;
  for (int y = std::max(0, j - kReach_nodes); y <= std::min(scene.height - 1, j + kReach_nodes); ++y)
    for (int x = std::max(0, i - kReach_nodes); x <= std::min(scene.width - 1, i + kReach_nodes); ++x) {
      const std::size_t k = scene.at(x, y);
      if (scene.node[k] != Node::kCandidate) continue;
      ++all;
      like += std::abs(scene.depth_m[k] - z) < kContinuous_m;
    }
  return 5 * like >= 2 * all;
}

void take(const SearchScene& scene, const Camera& camera, const std::vector<int>& nodes, int requested,
          std::vector<Vec3f>* out) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const std::size_t n = nodes.size(), m = std::min(n, static_cast<std::size_t>(requested));
  out->clear();
  for (std::size_t k = 0; k < m; ++k) out->push_back(scene.point(K, nodes[k * n / m]));
}

Vec3d mean_of(const std::vector<Vec3f>& points) {
  Vec3d sum{0, 0, 0};
  for (const Vec3f& p : points) sum = sum + p.cast<double>();
  return (1.0 / static_cast<double>(std::max<std::size_t>(1, points.size()))) * sum;
}

// The part common to all kinds of places, once the nodes that show the object are known.
bool finish(const SearchScene& scene, const Camera& camera, const frame::Shape& shape, bool all_object,
            ProposalScratch* scratch, Proposal* out) {
  const std::vector<int>& nodes = scratch->nodes;
  if (nodes.size() < kMinReadings) return false;
  take(scene, camera, nodes, kCoarsePoints, &out->coarse);
  take(scene, camera, nodes, kFinePoints, &out->fine);
  std::vector<int>& solids = scratch->stack;
  solids.clear();
  for (int k = 0; k < static_cast<int>(scene.node.size()); ++k) {
    const Node node = scene.node[static_cast<std::size_t>(k)];
    if ((node == Node::kOther || node == Node::kPlane) && scene.depth_m[static_cast<std::size_t>(k)] > 0)
      solids.push_back(k);
  }
  take(scene, camera, solids, kSolidPoints, &out->solids);
  out->centroid_cam = mean_of(out->fine);
  free_region(scene, nodes, all_object, out->centroid_cam.z + kBeyond * shape.diameter_m, scratch,
              &out->free_space);
  out->hidden_cam = {0, 0, 0}, out->seen_extent_m = 0;
  return true;
}

bool propose_mask(const SearchScene& scene, const Camera& camera, const frame::Shape& shape,
                  ProposalScratch* scratch, Proposal* out) {
  std::vector<float>& depths = scratch->depths;
  scratch->nodes.clear(), depths.clear();
  for (std::size_t k = 0; k < scene.node.size(); ++k)
    if (scene.node[k] == Node::kCandidate) depths.push_back(scene.depth_m[k]);
  if (depths.size() < kMinReadings) return false;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  const float median = *middle, reach = static_cast<float>(shape.diameter_m);
  for (int k = 0; k < static_cast<int>(scene.node.size()); ++k)
    if (scene.node[static_cast<std::size_t>(k)] == Node::kCandidate &&
        std::abs(scene.depth_m[static_cast<std::size_t>(k)] - median) < reach &&
        among_its_like(scene, k % scene.width, k / scene.width))
      scratch->nodes.push_back(k);
  if (!finish(scene, camera, shape, true, scratch, out)) return false;
  find_hidden_side(scene, camera, *scratch, out);
  return true;
}

// The measurements in a window around a measurement, in a crop of the scene that the object cannot leave.
bool propose_window(const SearchScene& scene, const Camera& camera, const frame::Shape& shape, Vec3f middle,
                    double radius_m, ProposalScratch* scratch, Proposal* out) {
  const Intrinsics<float> K = camera.K.cast<float>();
  // Kept within the scene, however near the window's middle is.
  const int reach =
      1 + to_int_within((1.2 * shape.diameter_m) * camera.K.fx / static_cast<double>(middle.z) / scene.step,
                        0, std::max(scene.width, scene.height));
  const Vec2f u = project(K, middle);
  const auto step = static_cast<float>(scene.step);
  const int i = to_int_within(std::round((u.x - static_cast<float>(scene.x0)) / step), 0, scene.width - 1),
            j = to_int_within(std::round((u.y - static_cast<float>(scene.y0)) / step), 0, scene.height - 1);
  const frame::Rect window{std::max(0, i - reach), std::max(0, j - reach),
                           std::min(scene.width, i + reach + 1), std::min(scene.height, j + reach + 1)};
  crop(scene, window, &scratch->window);
  const SearchScene& cropped = scratch->window;
  scratch->nodes.clear();
  for (int y = 0; y < cropped.height; ++y)
    for (int x = 0; x < cropped.width; ++x) {
      const std::size_t k = cropped.at(x, y);
      if (cropped.node[k] != Node::kCandidate) continue;
      if (norm(cropped.point(K, static_cast<int>(k)) - middle) < static_cast<float>(radius_m) &&
          among_its_like(cropped, x, y))
        scratch->nodes.push_back(static_cast<int>(k));
    }
  return finish(cropped, camera, shape, false, scratch, out);
}

// Nodes as far apart as possible, the first nearest to a point: farthest-point sampling.
void spread_centres(const SearchScene& scene, const Camera& camera, const std::vector<int>& nodes,
                    Vec3f first, double spacing_m, int requested, ProposalScratch* scratch) {
  const Intrinsics<float> K = camera.K.cast<float>();
  std::vector<float>& apart = scratch->apart;
  scratch->centres.clear();
  if (nodes.empty()) return;
  apart.clear();
  for (const int k : nodes) apart.push_back(norm(scene.point(K, k) - first));
  std::size_t next = static_cast<std::size_t>(std::min_element(apart.begin(), apart.end()) - apart.begin());
  apart.assign(nodes.size(), 1e9f);
  while (static_cast<int>(scratch->centres.size()) < requested &&
         apart[next] > static_cast<float>(spacing_m)) {
    scratch->centres.push_back(nodes[next]);
    const Vec3f p = scene.point(K, nodes[next]);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      apart[k] = std::min(apart[k], norm(scene.point(K, nodes[k]) - p));
    next = static_cast<std::size_t>(std::max_element(apart.begin(), apart.end()) - apart.begin());
  }
}

// Mean of the measurements in a window, and the area of their surface.
struct WindowContent {
  Vec3f mean;
  double area_m2;
};

WindowContent content(const SearchScene& scene, const Intrinsics<float>& K, const std::vector<int>& nodes,
                      Vec3f middle, float reach_m) {
  const double node_area = static_cast<double>(scene.step) * scene.step / static_cast<double>(K.fx * K.fy);
  Vec3f sum{0, 0, 0};
  double area_m2 = 0;
  int count = 0;
  for (std::size_t k = 0; k < nodes.size(); k += kAreaStride) {
    const Vec3f p = scene.point(K, nodes[k]);
    if (!(norm(p - middle) < reach_m)) continue;
    sum = sum + p, ++count;
    area_m2 += kAreaStride * node_area * static_cast<double>(p.z * p.z);
  }
  return {count > 0 ? (1.0f / static_cast<float>(count)) * sum : middle, area_m2};
}

// Windows are moved onto their contents. Of windows that then agree one is kept; of many, those whose surface
// area is about that of the object's visible part. Where a pose was given the first window is unchanged.
void settle_centres(const SearchScene& scene, const Camera& camera, const frame::Shape& shape,
                    const std::vector<int>& nodes, bool first_stays, std::vector<Vec3f>* middles) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const Vec3d& h = shape.half_box_m;
  const double expected_m2 = kFilled * 4 / 3 * (h.x * h.y + h.y * h.z + h.z * h.x);
  const auto reach = static_cast<float>(kWindow * shape.diameter_m),
             apart = static_cast<float>(kSpacing * shape.diameter_m);
  std::vector<std::pair<double, Vec3f>> ranked;
  for (std::size_t c = 0; c < middles->size(); ++c) {
    const bool first = first_stays && c == 0;
    Vec3f middle = (*middles)[c];
    for (int k = 0; k < kMeanShifts && !first; ++k) middle = content(scene, K, nodes, middle, reach).mean;
    if (std::any_of(ranked.begin(), ranked.end(),
                    [&](const auto& other) { return norm(other.second - middle) < apart; }))
      continue;
    const double area_m2 = content(scene, K, nodes, middle, reach).area_m2;
    ranked.emplace_back(first ? -1 : std::abs(std::log(std::max(1e-6, area_m2) / expected_m2)), middle);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  middles->clear();
  for (const auto& [rank, middle] : ranked)
    if (middles->size() < kMaxWindows) middles->push_back(middle);
}

}  // namespace

void all_candidates(const SearchScene& scene, const Camera& camera, int requested, std::vector<Vec3f>* out) {
  std::vector<int> nodes;
  for (int k = 0; k < static_cast<int>(scene.node.size()); ++k)
    if (scene.node[static_cast<std::size_t>(k)] == Node::kCandidate) nodes.push_back(k);
  take(scene, camera, nodes, requested, out);
}

void make_proposals(const SearchScene& scene, const Camera& camera, const frame::Shape& shape,
                    const SearchQuery& query, ProposalScratch* scratch, std::vector<Proposal>* out) {
  std::size_t count = 0;
  const auto next = [&]() -> Proposal* {
    if (out->size() <= count) out->resize(count + 1);
    return &(*out)[count];
  };
  if (query.mask) {
    count += propose_mask(scene, camera, shape, scratch, next());
  } else {
    const Intrinsics<float> K = camera.K.cast<float>();
    std::vector<int> nodes;
    Vec3d sum{0, 0, 0};
    for (int k = 0; k < static_cast<int>(scene.node.size()); ++k) {
      if (scene.node[static_cast<std::size_t>(k)] != Node::kCandidate) continue;
      const Vec3d p = scene.point(K, k).cast<double>();
      if (query.near && norm(p - query.near->t) > query.reach_m + 0.5 * shape.diameter_m) continue;
      nodes.push_back(k), sum = sum + p;
    }
    if (!nodes.empty()) {
      Vec3f first = ((1.0 / static_cast<double>(nodes.size())) * sum).cast<float>();
      if (query.near) first = query.near->t.cast<float>();
      spread_centres(scene, camera, nodes, first, kSpacing * shape.diameter_m, query.box ? 1 : kMaxCentres,
                     scratch);
      std::vector<Vec3f>& middles = scratch->middles;
      middles.clear();
      for (const int centre : scratch->centres) middles.push_back(scene.point(K, centre));
      if (!query.box) settle_centres(scene, camera, shape, nodes, query.near.has_value(), &middles);
      for (const Vec3f& middle : middles)
        count += propose_window(scene, camera, shape, middle, kWindow * shape.diameter_m, scratch, next());
    }
  }
  out->resize(count);
}

}  // namespace sdftrack::tracking

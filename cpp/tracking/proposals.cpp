// SPDX-License-Identifier: MIT
#include "tracking/proposals.h"

#include <algorithm>
#include <cmath>

#include "tracking/free_region.h"

namespace sdftrack {

namespace {

constexpr int kLeastReadings = 12;
constexpr int kCoarsePoints = 100, kFinePoints = 300, kSolidPoints = 60;
constexpr double kWindow = 0.55;   // radius of a window's readings over the object's diameter
constexpr double kSpacing = 0.35;  // of windows, over the diameter
constexpr double kBeyond = 0.6;    // behind a window's middle, over the diameter: nothing of the object
constexpr int kMostWindows = 6, kMostProposals = 12;
constexpr float kContinuous_m = 0.015;
constexpr int kReach_nodes = 2;

// Whether most of the candidates about a candidate have about its depth: at the edge of something nearer,
// pixels of the object read that thing's depth.
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

void take(const SearchScene& scene, const Camera& camera, const std::vector<int>& nodes, int wanted,
          std::vector<Vec3f>* out) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const std::size_t n = nodes.size(), m = std::min(n, static_cast<std::size_t>(wanted));
  out->clear();
  for (std::size_t k = 0; k < m; ++k) out->push_back(scene.point(K, nodes[k * n / m]));
}

Vec3d mean_of(const std::vector<Vec3f>& points) {
  Vec3d sum{0, 0, 0};
  for (const Vec3f& p : points) sum = sum + p.cast<double>();
  return (1.0 / static_cast<double>(std::max<std::size_t>(1, points.size()))) * sum;
}

// What all kinds of places share, once it is known which nodes show the object.
bool finish(const SearchScene& scene, const Camera& camera, const Shape& shape, bool all_object,
            ProposalScratch* scratch, Proposal* out) {
  const std::vector<int>& nodes = scratch->nodes;
  if (nodes.size() < kLeastReadings) return false;
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

bool propose_mask(const SearchScene& scene, const Camera& camera, const Shape& shape,
                  ProposalScratch* scratch, Proposal* out) {
  std::vector<float>& depths = scratch->depths;
  scratch->nodes.clear(), depths.clear();
  for (std::size_t k = 0; k < scene.node.size(); ++k)
    if (scene.node[k] == Node::kCandidate) depths.push_back(scene.depth_m[k]);
  if (depths.size() < kLeastReadings) return false;
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

// The readings within a window about a reading, in a crop of the scene that the object cannot leave.
bool propose_window(const SearchScene& scene, const Camera& camera, const Shape& shape, int centre,
                    int component, double radius_m, ProposalScratch* scratch, Proposal* out) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const Vec3f middle = scene.point(K, centre);
  const int reach = 1 + static_cast<int>((1.2 * shape.diameter_m) * camera.K.fx /
                                         static_cast<double>(middle.z) / scene.step);
  const int i = centre % scene.width, j = centre / scene.width;
  const Rect window{std::max(0, i - reach), std::max(0, j - reach), std::min(scene.width, i + reach + 1),
                    std::min(scene.height, j + reach + 1)};
  crop(scene, window, &scratch->window);
  const SearchScene& cropped = scratch->window;
  scratch->nodes.clear();
  for (int y = 0; y < cropped.height; ++y)
    for (int x = 0; x < cropped.width; ++x) {
      const std::size_t k = cropped.at(x, y);
      if (cropped.node[k] != Node::kCandidate) continue;
      if (component >= 0 && scratch->component[scene.at(window.x0 + x, window.y0 + y)] != component) continue;
      if (norm(cropped.point(K, static_cast<int>(k)) - middle) < static_cast<float>(radius_m) &&
          among_its_like(cropped, x, y))
        scratch->nodes.push_back(static_cast<int>(k));
    }
  return finish(cropped, camera, shape, false, scratch, out);
}

// Nodes that lie as far apart as can be, the first the nearest to a point: farthest-point sampling.
void spread_centres(const SearchScene& scene, const Camera& camera, const std::vector<int>& nodes,
                    Vec3f first, double spacing_m, int wanted, ProposalScratch* scratch) {
  const Intrinsics<float> K = camera.K.cast<float>();
  std::vector<float>& apart = scratch->apart;
  scratch->centres.clear();
  if (nodes.empty()) return;
  apart.clear();
  for (const int k : nodes) apart.push_back(norm(scene.point(K, k) - first));
  std::size_t next = static_cast<std::size_t>(std::min_element(apart.begin(), apart.end()) - apart.begin());
  apart.assign(nodes.size(), 1e9f);
  while (static_cast<int>(scratch->centres.size()) < wanted && apart[next] > static_cast<float>(spacing_m)) {
    scratch->centres.push_back(nodes[next]);
    const Vec3f p = scene.point(K, nodes[next]);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      apart[k] = std::min(apart[k], norm(scene.point(K, nodes[k]) - p));
    next = static_cast<std::size_t>(std::max_element(apart.begin(), apart.end()) - apart.begin());
  }
}

}  // namespace

void all_candidates(const SearchScene& scene, const Camera& camera, int wanted, std::vector<Vec3f>* out) {
  std::vector<int> nodes;
  for (int k = 0; k < static_cast<int>(scene.node.size()); ++k)
    if (scene.node[static_cast<std::size_t>(k)] == Node::kCandidate) nodes.push_back(k);
  take(scene, camera, nodes, wanted, out);
}

void make_proposals(const SearchScene& scene, const Camera& camera, const Shape& shape,
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
      spread_centres(scene, camera, nodes, first, kSpacing * shape.diameter_m, query.box ? 1 : kMostWindows,
                     scratch);
      const std::vector<int> centres = scratch->centres;
      for (const int centre : centres)
        count +=
            propose_window(scene, camera, shape, centre, -1, kWindow * shape.diameter_m, scratch, next());
    }
  }
  out->resize(count);
}

}  // namespace sdftrack

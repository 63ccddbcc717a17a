// SPDX-License-Identifier: MIT
#include "tracking/search/free_region.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr float kInFront_m = 0.010;    // a measurement nearer than the object by this may hide it
constexpr float kBorder_nodes = 3;     // from the measurements: what stands there hides or bounds them
constexpr double kHiddenBorder = 0.1;  // share of the border from which an object counts as cut off

// The depth of the nearest candidate for every node, by two sweeps.
void spread_depths(const SearchScene& scene, const std::vector<int>& nodes, ProposalScratch* scratch) {
  const int w = scene.width, h = scene.height;
  std::vector<float>&z = scratch->nearest_m, &d = scratch->nearest_px;
  z.assign(scene.depth_m.size(), 0.0f);
  d.assign(scene.depth_m.size(), 1e9f);
  for (const int node : nodes)
    z[static_cast<std::size_t>(node)] = scene.depth_m[static_cast<std::size_t>(node)],
    d[static_cast<std::size_t>(node)] = 0;
  const auto pull = [&](int i, int j, int di, int dj, float length) {
    if (i + di < 0 || i + di >= w || j + dj < 0 || j + dj >= h) return;
    const std::size_t to = scene.at(i, j), from = scene.at(i + di, j + dj);
    if (d[from] + length < d[to]) d[to] = d[from] + length, z[to] = z[from];
  };
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i)
      pull(i, j, -1, 0, 1), pull(i, j, 0, -1, 1), pull(i, j, -1, -1, 1.4f), pull(i, j, 1, -1, 1.4f);
  for (int j = h - 1; j >= 0; --j)
    for (int i = w - 1; i >= 0; --i)
      pull(i, j, 1, 0, 1), pull(i, j, 0, 1, 1), pull(i, j, 1, 1, 1.4f), pull(i, j, -1, 1, 1.4f);
}

constexpr int kFreeNeighbours = 3;  // of 8; a lone node is no evidence, as measurements at edges jitter

// A ring of nodes outside the scene counts as not free, as nothing is known there.
void transform_free(const SearchScene& scene, ProposalScratch* scratch, energies::DistanceGrid* grid) {
  const int w = scene.width + 2;
  std::vector<unsigned char>& ringed = scratch->ringed;
  ringed.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(scene.height + 2), 0);
  for (int j = 0; j < scene.height; ++j)
    for (int i = 0; i < scene.width; ++i) {
      if (!scratch->free[scene.at(i, j)]) continue;
      int neighbours = -1;
      for (int y = std::max(0, j - 1); y <= std::min(scene.height - 1, j + 1); ++y)
        for (int x = std::max(0, i - 1); x <= std::min(scene.width - 1, i + 1); ++x)
          neighbours += scratch->free[scene.at(x, y)];
      ringed[static_cast<std::size_t>((j + 1) * w + i + 1)] = neighbours >= kFreeNeighbours;
    }
  grid->step = scene.step;
  grid->width = scene.width + 2, grid->height = scene.height + 2;
  grid->x0 = scene.x0 - scene.step, grid->y0 = scene.y0 - scene.step;
  grid->limit_px = 64;
  energies::distance_transform(ringed, &scratch->transform, grid);
}

}  // namespace

void free_region(const SearchScene& scene, const std::vector<int>& nodes, bool all_object, double beyond_m,
                 ProposalScratch* scratch, energies::DistanceGrid* grid) {
  spread_depths(scene, nodes, scratch);
  const auto beyond = static_cast<float>(beyond_m);
  scratch->free.assign(scene.depth_m.size(), 0);
  for (std::size_t k = 0; k < scene.depth_m.size(); ++k) {
    const float z = scene.depth_m[k];
    const Node node = scene.node[k];
    // Next to measurements that may belong to another object, something as near may well hide the object.
    const float edge = all_object ? scratch->nearest_m[k] - kInFront_m : beyond;
    scratch->free[k] = node == Node::kPlane || (node == Node::kOther && z > edge) ||
                       (node == Node::kCandidate && z > beyond);
  }
  transform_free(scene, scratch, grid);
}

void find_hidden_side(const SearchScene& scene, const Camera& camera, const ProposalScratch& scratch,
                      Proposal* out) {
  out->hidden_cam = {0, 0, 0}, out->seen_extent_m = 0;
  const std::vector<float>& d = scratch.nearest_px;
  double hiding = 0, bounding = 0, nx = 0, ny = 0;
  for (int j = 1; j + 1 < scene.height; ++j)
    for (int i = 1; i + 1 < scene.width; ++i) {
      const std::size_t k = scene.at(i, j);
      if (!(scene.node[k] == Node::kOther || scene.node[k] == Node::kPlane) || !(scene.depth_m[k] > 0) ||
          d[k] > kBorder_nodes)
        continue;
      if (scene.node[k] == Node::kPlane || scene.depth_m[k] > scratch.nearest_m[k] - kInFront_m) {
        ++bounding;
        continue;
      }
      ++hiding;
      nx += static_cast<double>(d[scene.at(i + 1, j)] - d[scene.at(i - 1, j)]);
      ny += static_cast<double>(d[scene.at(i, j + 1)] - d[scene.at(i, j - 1)]);
    }
  const Vec3d ray = (1 / norm(out->centroid_cam)) * out->centroid_cam;
  Vec3d n{nx / camera.K.fx, ny / camera.K.fy, 0};
  n = n - dot(n, ray) * ray;
  if (hiding < kHiddenBorder * (hiding + bounding) || !(norm(n) > 0)) return;
  out->hidden_cam = (1 / norm(n)) * n;
  std::vector<double> along;
  for (const Vec3f& p : out->fine) along.push_back(dot(out->hidden_cam, p.cast<double>()));
  std::sort(along.begin(), along.end());
  out->seen_extent_m = along[along.size() - 1 - along.size() / 50] - along[along.size() / 50];
}

}  // namespace sdftrack::tracking

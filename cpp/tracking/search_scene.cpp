// SPDX-License-Identifier: MIT
#include "tracking/search_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdftrack {

namespace {

constexpr int kNodes = 48;       // along the longer side of a mask or box
constexpr double kMargin = 0.3;  // of its longer side, on each side
constexpr int kLeastMargin_px = 8;
constexpr float kForeground = 0.3f;  // by colour, below which a reading is not the object's
constexpr double kPlaneTolerance_m = 0.006;
constexpr float kInFront_m = 0.010;  // a reading nearer than the object by this may hide it
constexpr int kLeastReadings = 12;
constexpr int kCoarsePoints = 100, kFinePoints = 300, kDensePoints = 1500;

Rect bounds_of(const unsigned char* mask, int width, int height) {
  Rect r{width, height, 0, 0};
  for (int y = 0; y < height; ++y) {
    const unsigned char* row = mask + static_cast<std::ptrdiff_t>(y) * width;
    int x = 0;
    while (x < width && !row[x]) ++x;
    if (x == width) continue;
    int last = width - 1;
    while (!row[last]) --last;
    r = {std::min(r.x0, x), std::min(r.y0, y), std::max(r.x1, last + 1), y + 1};
  }
  return r;
}

Rect widened(const Rect& r, int margin, const Camera& camera) {
  return {std::max(0, r.x0 - margin), std::max(0, r.y0 - margin), std::min(camera.width, r.x1 + margin),
          std::min(camera.height, r.y1 + margin)};
}

struct NodeReader {
  const DepthFrame& frame;
  const Camera& camera;
  const SearchQuery& query;
  const unsigned char* mask;
  bool lens;

  // Image pixel of a node: where the lens puts its ray.
  bool locate(int u, int v, int* x, int* y) const {
    *x = u, *y = v;
    if (lens) {
      const Vec2d p = camera.project_point(ray(camera.K, static_cast<double>(u), static_cast<double>(v)));
      *x = static_cast<int>(std::lround(p.x)), *y = static_cast<int>(std::lround(p.y));
    }
    return *x >= 0 && *y >= 0 && *x < camera.width && *y < camera.height;
  }

  bool not_object(int x, int y, float z, Vec3d ray_cam) const {
    const std::size_t at =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
    if (mask && !mask[at]) return true;
    if (query.box && (x < query.box->x0 || x >= query.box->x1 || y < query.box->y0 || y >= query.box->y1))
      return true;
    if (query.taken && query.taken[at]) return true;
    if (query.foreground && query.foreground[at] < kForeground) return true;
    return z > 0 && query.plane &&
           std::abs(dot(query.plane->normal_cam, static_cast<double>(z) * ray_cam) + query.plane->offset_m) <
               kPlaneTolerance_m;
  }
};

}  // namespace

void make_search_scene(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                       const SearchQuery& query, SearchScene* scene) {
  const unsigned char* mask = query.mask ? query.mask : frame.mask;
  Rect rect{0, 0, camera.width, camera.height};
  if (query.mask)
    rect = bounds_of(query.mask, camera.width, camera.height);
  else if (query.box)
    rect = {std::max(0, query.box->x0), std::max(0, query.box->y0), std::min(camera.width, query.box->x1),
            std::min(camera.height, query.box->y1)};
  (void)shape;
  scene->width = scene->height = 0;
  scene->depth_m.clear(), scene->candidate.clear(), scene->other.clear();
  if (rect.empty()) return;
  const int longest = std::max(rect.x1 - rect.x0, rect.y1 - rect.y0);
  scene->step = std::max(1, (longest + kNodes - 1) / kNodes);
  rect = widened(rect, std::max(kLeastMargin_px, static_cast<int>(kMargin * longest)), camera);
  const int step = scene->step;
  scene->x0 = rect.x0 + (step - 1) / 2, scene->y0 = rect.y0 + (step - 1) / 2;
  scene->width = (rect.x1 - scene->x0 + step - 1) / step,
  scene->height = (rect.y1 - scene->y0 + step - 1) / step;
  const auto count = static_cast<std::size_t>(scene->width) * static_cast<std::size_t>(scene->height);
  scene->depth_m.resize(count), scene->candidate.resize(count), scene->other.resize(count);
  const NodeReader reader{frame, camera, query, mask, frame.rays != nullptr};
  for (int j = 0; j < scene->height; ++j)
    for (int i = 0; i < scene->width; ++i) {
      const std::size_t k = scene->at(i, j);
      const int u = scene->x0 + i * step, v = scene->y0 + j * step;
      int x, y;
      const bool seen = reader.locate(u, v, &x, &y);
      const float z = seen ? frame.depth_m(x, y) : 0.0f;
      scene->depth_m[k] = z > 0 ? z : 0.0f;
      const Vec3d ray_cam = ray(camera.K, static_cast<double>(u), static_cast<double>(v));
      scene->other[k] = seen && reader.not_object(x, y, scene->depth_m[k], ray_cam);
      scene->candidate[k] = z > 0 && !scene->other[k];
    }
}

namespace {

void back_project(const SearchScene& scene, const Camera& camera, const std::vector<int>& nodes, int wanted,
                  std::vector<Vec3f>* out) {
  const Intrinsics<float> K = camera.K.cast<float>();
  const std::size_t n = nodes.size(), m = std::min(n, static_cast<std::size_t>(wanted));
  out->clear();
  for (std::size_t k = 0; k < m; ++k) {
    const int node = nodes[k * n / m];
    const Vec2f u = scene.pixel(node % scene.width, node / scene.width);
    out->push_back(scene.depth_m[static_cast<std::size_t>(node)] * ray(K, u.x, u.y));
  }
}

// The depth of the nearest candidate of every node, by two sweeps.
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

constexpr int kFreeNeighbours = 3;  // of 8; a lone node is no evidence, for readings at edges jitter

// A ring of nodes outside the scene counts as not free: nothing is known there.
void transform_free(const SearchScene& scene, ProposalScratch* scratch, DistanceGrid* grid) {
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
  distance_transform(ringed, &scratch->transform, grid);
}

Vec3d mean_of(const std::vector<Vec3f>& points) {
  Vec3d sum{0, 0, 0};
  for (const Vec3f& p : points) sum = sum + p.cast<double>();
  return (1.0 / static_cast<double>(std::max<std::size_t>(1, points.size()))) * sum;
}

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
      if (!scene.candidate[k]) continue;
      ++all;
      like += std::abs(scene.depth_m[k] - z) < kContinuous_m;
    }
  return 5 * like >= 2 * all;
}

constexpr float kBorder_nodes = 3;     // from the readings: who stands there, hides or bounds them
constexpr double kHiddenBorder = 0.1;  // share of the border from which an object counts as cut off

// The mean outward direction of the border where something nearer stands.
void find_hidden_side(const SearchScene& scene, const Camera& camera, const ProposalScratch& scratch,
                      Proposal* out) {
  out->hidden_cam = {0, 0, 0}, out->seen_extent_m = 0;
  const std::vector<float>& d = scratch.nearest_px;
  double hiding = 0, bounding = 0, nx = 0, ny = 0;
  for (int j = 1; j + 1 < scene.height; ++j)
    for (int i = 1; i + 1 < scene.width; ++i) {
      const std::size_t k = scene.at(i, j);
      if (!scene.other[k] || !(scene.depth_m[k] > 0) || d[k] > kBorder_nodes) continue;
      if (scene.depth_m[k] > scratch.nearest_m[k] - kInFront_m) {
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

}  // namespace

bool propose_mask(const SearchScene& scene, const Camera& camera, const Shape& shape,
                  ProposalScratch* scratch, Proposal* out) {
  std::vector<int>& nodes = scratch->nodes;
  std::vector<float>& depths = scratch->depths;
  nodes.clear(), depths.clear();
  for (std::size_t k = 0; k < scene.depth_m.size(); ++k)
    if (scene.candidate[k]) depths.push_back(scene.depth_m[k]);
  if (depths.size() < kLeastReadings) return false;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  const float median = *middle, reach = static_cast<float>(shape.diameter_m);
  for (std::size_t k = 0; k < scene.depth_m.size(); ++k)
    if (scene.candidate[k] && std::abs(scene.depth_m[k] - median) < reach &&
        among_its_like(scene, static_cast<int>(k) % scene.width, static_cast<int>(k) / scene.width))
      nodes.push_back(static_cast<int>(k));
  if (nodes.size() < kLeastReadings) return false;
  back_project(scene, camera, nodes, kCoarsePoints, &out->coarse);
  back_project(scene, camera, nodes, kFinePoints, &out->fine);
  back_project(scene, camera, nodes, kDensePoints, &out->dense);
  out->centroid_cam = mean_of(out->fine);

  spread_depths(scene, nodes, scratch);
  scratch->free.assign(scene.depth_m.size(), 0);
  for (std::size_t k = 0; k < scene.depth_m.size(); ++k)
    scratch->free[k] = scene.other[k] && scene.depth_m[k] > scratch->nearest_m[k] - kInFront_m;
  transform_free(scene, scratch, &out->free_space);
  find_hidden_side(scene, camera, *scratch, out);
  return true;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "tracking/search/search_scene.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr int kNodes = 48;  // along the longer side of a mask or box
constexpr int kMaxNodes = 160;
constexpr double kMaskMargin = 0.3, kBoxMargin = 0.5;  // of its longer side, on each side
constexpr int kMinMargin_px = 8;
constexpr float kForeground = 0.3f;  // posterior below which a measurement is not the object's
constexpr double kPlaneTolerance_m = 0.006;
constexpr int kPlanes = 3, kPlaneSeeds = 60, kPlanePoints = 500;
constexpr double kPlaneShare = 0.15;  // of the measurements, from which a plane counts as one
constexpr double kWiderPlane = 1.1;   // times the object's diameter

frame::Rect clipped(const frame::Rect& r, int margin, const Camera& camera) {
  return {std::max(0, r.x0 - margin), std::max(0, r.y0 - margin), std::min(camera.width, r.x1 + margin),
          std::min(camera.height, r.y1 + margin)};
}

frame::Rect around(const Rigidd& T_cam_obj, double radius_m, const Camera& camera) {
  const frame::Rect whole{0, 0, camera.width, camera.height};
  const double z = T_cam_obj.t.z;
  if (z < radius_m) return whole;
  const Vec2d u = project(camera.K, T_cam_obj.t);
  const double r = radius_m * camera.K.fx / (z - 0.5 * radius_m);
  const auto pixel = [](double v) { return to_int(std::clamp(v, -1e6, 1e6)); };
  return clipped({pixel(u.x - r), pixel(u.y - r), pixel(u.x + r), pixel(u.y + r)}, 0, camera);
}

// Region and step of the nodes.
frame::Rect region_of(const Camera& camera, const frame::Shape& shape, const SearchQuery& query, int* step) {
  frame::Rect rect{0, 0, camera.width, camera.height};
  double margin = 0;
  int nodes = kNodes;
  if (query.mask)
    rect = frame::mask_bounds(query.mask, camera.width, camera.height), margin = kMaskMargin;
  else if (query.box)
    rect = clipped(*query.box, 0, camera), margin = kBoxMargin;
  else if (query.near)
    rect = around(*query.near, query.reach_m + shape.diameter_m, camera), nodes = kMaxNodes;
  else
    nodes = kMaxNodes;
  if (rect.empty()) return rect;
  const int longest = std::max(rect.x1 - rect.x0, rect.y1 - rect.y0);
  *step = std::max(1, (longest + nodes - 1) / nodes);
  return clipped(rect, margin > 0 ? std::max(kMinMargin_px, to_int(margin * longest)) : 0, camera);
}

struct NodeReader {
  const frame::DepthFrame& frame;
  const Camera& camera;
  const SearchQuery& query;
  const unsigned char* mask;

  // Image pixel of a node: the position to which the lens projects its ray.
  bool locate(int u, int v, int* x, int* y) const {
    *x = u, *y = v;
    if (frame.rays) {
      const Vec2d p = camera.project_point(ray(camera.K, static_cast<double>(u), static_cast<double>(v)));
      *x = to_int(std::round(p.x)), *y = to_int(std::round(p.y));
    }
    return *x >= 0 && *y >= 0 && *x < camera.width && *y < camera.height;
  }

  bool not_object(int x, int y) const {
    const std::size_t at =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(x);
    if (mask && !mask[at]) return true;
    if (query.box && (x < query.box->x0 || x >= query.box->x1 || y < query.box->y0 || y >= query.box->y1))
      return true;
    if (query.taken && query.taken[at]) return true;
    return query.foreground && query.foreground[at] < kForeground;
  }

  Node classify(int u, int v, float* depth_m) const {
    int x, y;
    *depth_m = 0;
    if (!locate(u, v, &x, &y)) return Node::kUnknown;
    const float z = frame.depth_m(x, y);
    *depth_m = z > 0 ? z : 0.0f;
    if (not_object(x, y)) return Node::kOther;
    return z > 0 ? Node::kCandidate : Node::kUnknown;
  }
};

void mark_plane(const Camera& camera, const frame::Plane& plane, SearchScene* scene) {
  const Intrinsics<float> K = camera.K.cast<float>();
  for (std::size_t k = 0; k < scene->node.size(); ++k) {
    if (!(scene->depth_m[k] > 0)) continue;
    const Vec3d p = scene->point(K, static_cast<int>(k)).cast<double>();
    if (std::abs(dot(plane.normal_cam, p) + plane.offset_m) <
        plane::plane_tolerance_m(kPlaneTolerance_m, p.z))
      scene->node[k] = Node::kPlane;
  }
}

// Planes among nodes of one kind: from patches spread over the scene, larger than the object.
void mark_planes(const Camera& camera, const frame::Shape& shape, Node kind, SearchScene* scene) {
  const Intrinsics<float> K = camera.K.cast<float>();
  for (int round = 0; round < kPlanes; ++round) {
    std::vector<Vec3d> points;
    std::size_t readings = 0, k = 0;
    for (const Node node : scene->node) readings += node == kind && scene->depth_m[k] > 0, ++k;
    const std::size_t stride = std::max<std::size_t>(1, readings / kPlanePoints);
    std::size_t n = 0;
    for (k = 0; k < scene->node.size(); ++k)
      if (scene->node[k] == kind && scene->depth_m[k] > 0 && n++ % stride == 0)
        points.push_back(scene->point(K, static_cast<int>(k)).cast<double>());
    const std::optional<frame::Plane> plane = plane::plane_among(points, kPlaneTolerance_m, kPlaneSeeds,
                                                                 kPlaneShare, kWiderPlane * shape.diameter_m);
    if (!plane) return;
    mark_plane(camera, *plane, scene);
  }
}

}  // namespace

void make_search_scene(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const SearchQuery& query, SearchScene* scene) {
  scene->width = scene->height = 0;
  scene->depth_m.clear(), scene->node.clear();
  int step = 1;
  const frame::Rect rect = region_of(camera, shape, query, &step);
  if (rect.empty()) return;
  scene->step = step;
  scene->x0 = rect.x0 + (step - 1) / 2, scene->y0 = rect.y0 + (step - 1) / 2;
  scene->width = std::max(1, (rect.x1 - scene->x0 + step - 1) / step);
  scene->height = std::max(1, (rect.y1 - scene->y0 + step - 1) / step);
  const auto count = static_cast<std::size_t>(scene->width) * static_cast<std::size_t>(scene->height);
  scene->depth_m.resize(count), scene->node.resize(count);
  const NodeReader reader{frame, camera, query, query.mask ? query.mask : frame.mask};
  for (int j = 0; j < scene->height; ++j)
    for (int i = 0; i < scene->width; ++i) {
      const std::size_t k = scene->at(i, j);
      scene->node[k] = reader.classify(scene->x0 + i * step, scene->y0 + j * step, &scene->depth_m[k]);
    }
  if (query.mask) return;
  if (query.plane) mark_plane(camera, *query.plane, scene);
  mark_planes(camera, shape, query.box ? Node::kOther : Node::kCandidate, scene);
}

void crop(const SearchScene& scene, const frame::Rect& nodes, SearchScene* out) {
  out->step = scene.step;
  out->x0 = scene.x0 + nodes.x0 * scene.step, out->y0 = scene.y0 + nodes.y0 * scene.step;
  out->width = nodes.x1 - nodes.x0, out->height = nodes.y1 - nodes.y0;
  out->depth_m.clear(), out->node.clear();
  for (int j = nodes.y0; j < nodes.y1; ++j) {
    const auto first = static_cast<std::ptrdiff_t>(scene.at(nodes.x0, j)), last = first + out->width;
    out->depth_m.insert(out->depth_m.end(), scene.depth_m.begin() + first, scene.depth_m.begin() + last);
    out->node.insert(out->node.end(), scene.node.begin() + first, scene.node.begin() + last);
  }
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "frame/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/to_int.h"
#include "base/volume_id.h"

namespace sdftrack::frame {

namespace {

struct Box {
  float low[3], high[3];  // voxels
  float middle[3];        // the deepest one
  float depth_m = 0;
};

// A ball of radius |phi| around a point inside lies inside, and such balls reach the surface on every side:
// the extent of all balls is the object's, to a small part of a voxel.
Box box_of_inside(const SdfView& sdf) {
  constexpr float kFar = std::numeric_limits<float>::max();
  Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}, {}};
  const float* row = sdf.phi;
  for (int z = 0; z < sdf.nz; ++z)
    for (int y = 0; y < sdf.ny; ++y, row += sdf.nx)
      for (int x = 0; x < sdf.nx; ++x)
        if (row[x] <= 0) {
          const float at[3] = {float(x), float(y), float(z)};
          const float radius = -row[x] / sdf.voxel_m;
          if (-row[x] > box.depth_m) box.depth_m = -row[x], std::copy(at, at + 3, box.middle);
          for (int a = 0; a < 3; ++a) {
            box.low[a] = std::min(box.low[a], at[a] - radius);
            box.high[a] = std::max(box.high[a], at[a] + radius);
          }
        }
  if (box.high[0] < box.low[0])
    throw std::invalid_argument(
        "shape: the field has no inside (no value <= 0); distances are negative inside");
  return box;
}

constexpr int kSearchPoints = 480;
constexpr double kSmoothShare = 0.06;  // of the diameter: radius in which normals are averaged
constexpr double kContactSpacing_m = 0.0025;
constexpr int kMinContacts = 1000, kMaxContacts = 20000;

int contact_count(double area_m2) {
  return to_int(
      std::clamp(area_m2 / (kContactSpacing_m * kContactSpacing_m), 1.0 * kMinContacts, 1.0 * kMaxContacts));
}

constexpr int kCoarseVoxels = 80;  // along the longest side
constexpr int kCoarseInPart = 50;  // at most, for a partly known shape; at least half as many

// Voxels between neighbouring nodes, for `nodes` on the longest side.
float coarse_step(const SdfView& sdf, int nodes) {
  const int longest = std::max({sdf.nx, sdf.ny, sdf.nz});
  return std::max(1.0f, float(longest - 1) / float(nodes - 1));
}

float node_value(const SdfView& sdf, float step, int x, int y, int z) {
  const Vec3f at{float(x), float(y), float(z)};
  float phi;
  Vec3f gradient;
  sample(sdf, sdf.origin_obj + step * sdf.voxel_m * at, &phi, &gradient);
  return phi;
}

// value_at(x, y, z): the distance at a node, `step` voxels from the next.
template <class ValueAt>
void make_coarse(float step, const ValueAt& value_at, Shape* shape) {
  const SdfView& sdf = shape->sdf;
  const auto count = [&](int n) { return std::max(2, to_int(std::ceil(float(n - 1) / step)) + 1); };
  SdfView& coarse = shape->coarse_sdf;
  coarse = {nullptr, count(sdf.nx), count(sdf.ny), count(sdf.nz), step * sdf.voxel_m, sdf.origin_obj};
  shape->coarse_phi.clear();
  shape->coarse_phi.reserve(std::size_t(coarse.nx) * coarse.ny * coarse.nz);
  for (int z = 0; z < coarse.nz; ++z)
    for (int y = 0; y < coarse.ny; ++y)
      for (int x = 0; x < coarse.nx; ++x) shape->coarse_phi.push_back(value_at(x, y, z));
}

void mix_coarse(Shape* shape) {
  const float step = coarse_step(shape->sdf, kCoarseVoxels);
  make_coarse(
      step, [&](int x, int y, int z) { return node_value(shape->sdf, step, x, y, z); }, shape);
}

// Nodes at voxels copy one value each, without interpolation: a partial shape is made again in every frame.
void pick_coarse(Shape* shape) {
  const SdfView& sdf = shape->sdf;
  const float step = std::ceil(coarse_step(sdf, kCoarseInPart));
  const int whole = to_int(step);
  make_coarse(
      step,
      [&](int x, int y, int z) {
        const int vx = whole * x, vy = whole * y, vz = whole * z;
        return vx < sdf.nx && vy < sdf.ny && vz < sdf.nz ? sdf.phi[(vz * sdf.ny + vy) * sdf.nx + vx]
                                                         : node_value(sdf, step, x, y, z);
      },
      shape);
}

void put_points(const std::vector<sdf::SurfaceSample>& samples, std::vector<Vec3f>* points,
                std::vector<Vec3f>* normals) {
  for (const sdf::SurfaceSample& s : samples) {
    points->push_back(s.p_obj);
    normals->push_back(s.n_obj);
  }
}

void put_surface(const std::vector<sdf::SurfaceSample>& samples, Shape* shape) {
  put_points(samples, &shape->points, &shape->normals);
  shape->moments = moments_of(shape->points);
}

void choose_outline(int count, Shape* shape) {
  const std::size_t n = shape->points.size(), m = std::min(n, std::size_t(std::max(0, count)));
  for (std::size_t k = 0; k < m; ++k) shape->outline.push_back(shape->points[k * n / m]);
}

}  // namespace

Shape make_shape(const SdfView& sdf, int point_count, int outline_count) {
  const Box box = box_of_inside(sdf);
  const double voxel = sdf.voxel_m;
  double centre[3], half[3];
  const Vec3d origin = sdf.origin_obj.cast<double>();
  const double o[3] = {origin.x, origin.y, origin.z};
  for (int a = 0; a < 3; ++a) {
    centre[a] = o[a] + 0.5 * voxel * (box.low[a] + box.high[a]);
    half[a] = 0.5 * voxel * (box.high[a] - box.low[a]);
  }
  Shape shape{};
  shape.id = new_volume_id();
  shape.sdf = sdf;
  shape.sdf.id = shape.id;
  shape.centre_obj = {centre[0], centre[1], centre[2]};
  shape.half_box_m = {half[0], half[1], half[2]};
  shape.depth_m = box.depth_m;
  shape.diameter_m = 2 * norm(shape.half_box_m);
  shape.sdf.origin_obj = (origin - shape.centre_obj).cast<float>();
  shape.middle = shape.sdf.origin_obj + sdf.voxel_m * Vec3f{box.middle[0], box.middle[1], box.middle[2]};
  const sdf::ZeroSurface surface(shape.sdf);
  put_surface(surface.samples(point_count), &shape);
  shape.slips = slips_of(shape.points, shape.normals, 0.5 * shape.diameter_m);
  choose_outline(outline_count, &shape);
  put_points(surface.samples(kSearchPoints), &shape.search_points, &shape.search_normals);
  for (const sdf::SurfaceSample& s : surface.samples(contact_count(surface.area_m2())))
    shape.contact.push_back(s.p_obj);
  mix_coarse(&shape);
  shape.coarse_sdf.id = new_volume_id();
  return shape;
}

Shape make_shape(const PartialShape& known, int point_count, int outline_count) {
  Shape shape{};
  shape.id = new_volume_id();
  shape.sdf = known.sdf;  // without an id: its values change in place
  shape.seen = known.seen;
  shape.colors = known.colors;
  shape.centre_obj = known.centre_obj;
  shape.sdf.origin_obj = (known.sdf.origin_obj.cast<double>() - known.centre_obj).cast<float>();
  // The box of the whole surface, seen or not, around the centre.
  Vec3d half{0, 0, 0};
  const Vec3d first = shape.sdf.origin_obj.cast<double>();
  const double voxel = known.sdf.voxel_m;
  for (const sdf::VoxelBox& box : known.boxes) {
    const Vec3d low = first + voxel * Vec3d{1.0 * box.x0, 1.0 * box.y0, 1.0 * box.z0},
                high = first + voxel * Vec3d{1.0 * box.x1, 1.0 * box.y1, 1.0 * box.z1};
    half = {std::max({half.x, -low.x, high.x}), std::max({half.y, -low.y, high.y}),
            std::max({half.z, -low.z, high.z})};
  }
  shape.half_box_m = half;
  shape.diameter_m = 2 * norm(half);
  const auto is_seen = [&](std::size_t voxel) { return known.seen.at(voxel); };
  put_surface(sdf::sample_near(shape.sdf, known.boxes, is_seen, point_count), &shape);
  shape.smooth_normals = smooth_normals(shape.points, shape.normals, kSmoothShare * shape.diameter_m);
  choose_outline(outline_count, &shape);
  const std::size_t searched = std::min<std::size_t>(kSearchPoints, shape.points.size());
  shape.search_points.assign(shape.points.begin(), shape.points.begin() + std::ptrdiff_t(searched));
  shape.search_normals.assign(shape.normals.begin(), shape.normals.begin() + std::ptrdiff_t(searched));
  pick_coarse(&shape);
  const std::vector<float>& phi = shape.coarse_phi;
  const auto deepest = int(std::min_element(phi.begin(), phi.end()) - phi.begin());
  const SdfView& c = shape.coarse_sdf;
  shape.depth_m = std::max(0.0f, -phi[deepest]);
  shape.middle = c.origin_obj + c.voxel_m * Vec3f{float(deepest % c.nx), float(deepest / c.nx % c.ny),
                                                  float(deepest / (c.nx * c.ny))};
  return shape;
}

}  // namespace sdftrack::frame

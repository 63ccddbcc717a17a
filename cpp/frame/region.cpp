// SPDX-License-Identifier: MIT
#include "frame/region.h"

#include <algorithm>
#include <cmath>

#include "base/to_int.h"

namespace sdftrack::frame {

namespace {

constexpr int kFreeSpaceMargin_px = 16;
constexpr int kFreeSpaceNodes = 40;  // along the longer side

}  // namespace

double reading_at(const DepthFrame& frame, const Camera& camera, Vec3d p_cam) {
  const Vec2d u = camera.project_point(p_cam);
  const bool inside = u.x > -0.5 && u.y > -0.5 && u.x < camera.width - 0.5 && u.y < camera.height - 0.5;
  if (!inside || !frame.depth_m.data) return 0;
  const double z = frame.depth_m(to_int(u.x + 0.5), to_int(u.y + 0.5));
  return z > 0 ? z : 0;
}

Rect mask_bounds(const unsigned char* mask, int width, int height) {
  Rect r{width, height, 0, 0};
  for (int y = 0; y < height; ++y) {
    const unsigned char* row = mask + y * width;
    int x = 0;
    while (x < width && !row[x]) ++x;
    if (x == width) continue;
    int last = width - 1;
    while (!row[last]) --last;
    r = {std::min(r.x0, x), std::min(r.y0, y), std::max(r.x1, last + 1), y + 1};
  }
  return r;
}

Rect projected_box(const Camera& camera, const Shape& shape, const Rigidd& T_cam_obj, double padding_m) {
  const Rect whole{0, 0, camera.width, camera.height};
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  const Vec3d h = shape.half_box_m + Vec3d{padding_m, padding_m, padding_m};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p =
        T_cam_obj * Vec3d{corner & 1 ? h.x : -h.x, corner & 2 ? h.y : -h.y, corner & 4 ? h.z : -h.z};
    if (p.z < 0.02) return whole;
    const Vec2d u = camera.project_point(p);
    low[0] = std::min(low[0], u.x), low[1] = std::min(low[1], u.y);
    high[0] = std::max(high[0], u.x), high[1] = std::max(high[1], u.y);
  }
  const auto clip = [](double v, int n) { return to_int(std::clamp(v, 0.0, double(n))); };
  return {clip(std::floor(low[0]), camera.width), clip(std::floor(low[1]), camera.height),
          clip(std::ceil(high[0]) + 1, camera.width), clip(std::ceil(high[1]) + 1, camera.height)};
}

DepthRange depth_range(const Shape& shape, const Rigidd& T_cam_obj, double padding_m) {
  const Vec3d z = T_cam_obj.R.r2;  // the camera's z axis in object coordinates
  const double reach = std::abs(z.x) * shape.half_box_m.x + std::abs(z.y) * shape.half_box_m.y +
                       std::abs(z.z) * shape.half_box_m.z + padding_m;
  return {T_cam_obj.t.z - reach, T_cam_obj.t.z + reach};
}

namespace {

// Index of the stored pixel to which the lens maps an ideal pixel's ray. -1 outside the image.
int stored_pixel(const DepthFrame& frame, const Camera& camera, int x, int y) {
  if (frame.rays) {
    const Vec2d u = camera.project_point(ray(camera.K, double(x), double(y)));
    x = to_int(std::round(u.x)), y = to_int(std::round(u.y));
    if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) return -1;
  }
  return y * camera.width + x;
}

// Whether all measurements of a column are farther than `far`.
void free_columns(const ImageView<float>& depth_m, const Rect& part, float far,
                  std::vector<unsigned char>* columns) {
  const int n = part.x1 - part.x0;
  columns->assign(std::size_t(n), 1);
  unsigned char* const free = columns->data();
  for (int y = part.y0; y < part.y1; ++y) {
    const float* const row = depth_m.data + y * depth_m.width + part.x0;
    for (int x = 0; x < n; ++x) free[x] &= static_cast<unsigned char>(row[x] > far);
  }
}

}  // namespace

void free_space_grid(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                     const Rigidd& T_cam_obj, double padding_m, const IsBackground* is_background,
                     FreeSpaceScratch* scratch, energies::DistanceGrid* grid) {
  const Camera ideal{camera.K, camera.width, camera.height, {}};  // the energy projects without a lens
  Rect rect = projected_box(ideal, shape, T_cam_obj, padding_m);
  rect = {std::max(0, rect.x0 - kFreeSpaceMargin_px), std::max(0, rect.y0 - kFreeSpaceMargin_px),
          std::min(camera.width, rect.x1 + kFreeSpaceMargin_px),
          std::min(camera.height, rect.y1 + kFreeSpaceMargin_px)};
  grid->distance_px.clear();
  if (rect.empty()) return;
  const int longest = std::max(rect.x1 - rect.x0, rect.y1 - rect.y0);
  const int step = std::max(1, (longest + kFreeSpaceNodes - 1) / kFreeSpaceNodes);
  grid->step = step;
  // A ring of nodes outside the region counts as not free, because nothing is known there.
  grid->width = (rect.x1 - rect.x0 + step - 1) / step + 2;
  grid->height = (rect.y1 - rect.y0 + step - 1) / step + 2;
  grid->x0 = rect.x0 - step + (step - 1) / 2, grid->y0 = rect.y0 - step + (step - 1) / 2;
  scratch->free.assign(std::size_t(grid->width) * grid->height, 0);
  const auto far = float(depth_range(shape, T_cam_obj, padding_m).far_m);
  const auto middle = float(T_cam_obj.t.z);
  const auto is_free = [&](int x, int y) {
    const int at = stored_pixel(frame, camera, x, y);
    if (at < 0) return false;
    const float z = frame.depth_m.data[at];
    if (z > 0) return z > far;
    return is_background && (*is_background)(at, {float(x), float(y)}, middle);
  };
  const bool plain = !frame.rays && !is_background;
  for (int j = 1; j + 1 < grid->height; ++j) {
    unsigned char* const nodes = scratch->free.data() + std::ptrdiff_t(j) * grid->width;
    const int y0 = rect.y0 + (j - 1) * step, y1 = std::min(y0 + step, rect.y1);
    if (plain) free_columns(frame.depth_m, {rect.x0, y0, rect.x1, y1}, far, &scratch->columns);
    for (int i = 1; i + 1 < grid->width; ++i) {
      const int x0 = rect.x0 + (i - 1) * step, x1 = std::min(x0 + step, rect.x1);
      bool free = true;
      for (int x = x0; free && x < x1; ++x)
        if (plain)
          free = scratch->columns[x - rect.x0];
        else
          for (int y = y0; free && y < y1; ++y) free = is_free(x, y);
      nodes[i] = free;
    }
  }
  energies::distance_transform(scratch->free, &scratch->transform, grid);
}

}  // namespace sdftrack::frame

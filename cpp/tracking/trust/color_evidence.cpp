// SPDX-License-Identifier: MIT
#include "tracking/trust/color_evidence.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/to_int.h"

namespace sdftrack::tracking {

namespace {

constexpr int kSightMargin_px = 12;  // what stands in front is shifted by parallax
constexpr int kSightBudget = 6000;   // measurements entered into the z-buffer
constexpr int kEdge_px = 2;          // a colour this near a depth step may be that of the other side
constexpr float kStep_m = 0.02f;
constexpr float kBandVoxels = 3, kOffBands = 3;
constexpr float kFrontBands = 1.5f, kInFront_m = 0.06f;  // of an occluder
constexpr float kBeside_m = 0.006f;  // fingers extend a little beyond the silhouette of the object they hold
constexpr int kLooksBehind = 8;

int stride_for(const frame::Rect& r, int budget) {
  const double area = double(r.x1 - r.x0) * (r.y1 - r.y0);
  return std::max(1, to_int(std::ceil(std::sqrt(area / budget))));
}

frame::Rect grown(const frame::Rect& r, int by_x, int by_y, const Camera& camera) {
  return {std::max(0, r.x0 - by_x), std::max(0, r.y0 - by_y), std::min(camera.width, r.x1 + by_x),
          std::min(camera.height, r.y1 + by_y)};
}

}  // namespace

void ColorReader::open(const frame::DepthFrame& frame, const Camera& camera, frame::Rect region,
                       frame::DepthRange range) {
  color_ = frame.color, width_ = camera.width;
  const appearance::ColorMap& map = color_->map;
  if (map.aligned || region.empty()) return;
  region = grown(region, kSightMargin_px, kSightMargin_px, camera);
  const frame::IdealPixel ideal{frame, camera.K.cast<float>(), camera.width};
  const auto place = [&](int x, int y, float z, int* cx, int* cy, float* depth) {
    const Vec2f u = map.raw_pixel ? Vec2f{float(x), float(y)} : ideal(x, y);
    return map.find(u, z, cx, cy, depth);
  };
  // The part of the colour image spanned by the region's corners between the nearest and the farthest depth.
  int x0 = map.width, y0 = map.height, x1 = 0, y1 = 0, x, y;
  float depth;
  for (const double z : {std::max(0.02, range.near_m), range.far_m})
    for (const int u : {region.x0, region.x1 - 1})
      for (const int v : {region.y0, region.y1 - 1})
        if (place(u, v, float(z), &x, &y, &depth))
          x0 = std::min(x0, x), x1 = std::max(x1, x + 1), y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
        else
          x0 = y0 = 0, x1 = map.width, y1 = map.height;
  const int step = stride_for(region, kSightBudget);
  const double scale = double(std::max(x1 - x0, 1)) / (region.x1 - region.x0);
  sight_.clear(x0, y0, x1, y1, to_int(std::ceil(1.5 * step * scale)));
  for (int v = region.y0; v < region.y1; v += step)
    for (int u = region.x0; u < region.x1; u += step) {
      const float z = frame.depth_m(u, v);
      if (z > 0 && place(u, v, z, &x, &y, &depth)) sight_.add(x, y, depth);
    }
}

float ColorReader::grey(int at, Vec2f ideal_px, float depth_m) const {
  constexpr float kFull = 255;
  if (color_->map.aligned) return energies::brightness(color_->rgb + 3 * std::size_t(at), kFull);
  Vec2f c;
  float depth;
  if (!color_->map.place(mapped_from(at, ideal_px), depth_m, &c, &depth)) return -1;
  if (!sight_.sees(to_int(c.x + 0.5f), to_int(c.y + 0.5f), depth)) return -1;
  const int w = color_->map.width, h = color_->map.height;
  const AxisSample<float> x = locate(c.x, w), y = locate(c.y, h);
  const auto at_corner = [&](int i, int j) {
    return energies::brightness(color_->at(x.cell + i, y.cell + j), kFull);
  };
  const float top = at_corner(0, 0) + x.fraction * (at_corner(1, 0) - at_corner(0, 0)),
              bottom = at_corner(0, 1) + x.fraction * (at_corner(1, 1) - at_corner(0, 1));
  return top + y.fraction * (bottom - top);
}

void fetch_grey(const ColorReader& reader, const energies::PixelSet& pixels, int requested,
                energies::GreyPixels* out) {
  out->clear();
  const int n = pixels.count(), m = std::clamp(requested, 0, n);
  for (int k = 0; k < m; ++k) {
    const auto i = std::size_t(static_cast<std::int64_t>(k) * n / m);
    const float g = reader.grey(pixels.at[i], {pixels.u_px[i], pixels.v_px[i]}, pixels.depth_m[i]);
    if (g >= 0) out->push(pixels.u_px[i], pixels.v_px[i], pixels.depth_m[i], g);
  }
}

void fetch_foreground(const appearance::ColorModel& model, const ColorReader& reader,
                      energies::PixelSet* pixels) {
  for (std::size_t i = 0; i < pixels->at.size(); ++i) {
    const int bin = reader.bin(pixels->at[i], {pixels->u_px[i], pixels->v_px[i]}, pixels->depth_m[i]);
    pixels->foreground[i] = bin < 0 ? model.prior() : model.posterior()[bin];
  }
}

namespace {

bool near_a_step(const ImageView<float>& depth_m, int x, int y) {
  const float z = depth_m(x, y);
  const auto off = [&](int u, int v) {
    if (u < 0 || v < 0 || u >= depth_m.width || v >= depth_m.height) return true;
    return !(std::abs(depth_m(u, v) - z) < kStep_m);  // also where there is no depth
  };
  return off(x - kEdge_px, y) || off(x + kEdge_px, y) || off(x, y - kEdge_px) || off(x, y + kEdge_px);
}

// Whether the surface lies behind a point, on the camera's ray through it or slightly beside it.
bool hides(const energies::SingleObject<float>& field, Vec3f p_cam, float phi, float voxel_m) {
  const Vec3f direction = (1 / norm(p_cam)) * p_cam;
  float way = phi;
  for (int k = 0; k < kLooksBehind && way < kInFront_m; ++k) {
    Vec3f unused;
    field.value(p_cam + way * direction, &phi, &unused);
    if (phi < voxel_m + kBeside_m) return true;
    way += phi;
  }
  return false;
}

}  // namespace

void count_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                  const Rigidd& T_cam_obj, double padding_m, int budget, const appearance::ColorModel& known,
                  ColorReader* reader, appearance::ColorCounts* counts, const Neighbors& others, bool plain) {
  counts->clear();
  const frame::Rect region = frame::projected_box(camera, shape, T_cam_obj, padding_m);
  if (region.empty()) return;
  reader->open(frame, camera, region, frame::depth_range(shape, T_cam_obj, padding_m));
  const Intrinsics<float> K = camera.K.cast<float>();
  const frame::IdealPixel ideal{frame, K, camera.width};
  const energies::SingleObject<float> field = field_of(shape, T_cam_obj);
  const float band = kBandVoxels * shape.sdf.voxel_m, off = plain ? band : kOffBands * band;
  const int step = stride_for(region, budget);
  for (int y = region.y0; y < region.y1; y += step)
    for (int x = region.x0; x < region.x1; x += step) {
      const float z = frame.depth_m(x, y);
      if (!(z > 0)) continue;
      const Vec2f u = ideal(x, y);
      float phi;
      Vec3f unused;
      const Vec3f p_cam = z * ray(K, u.x, u.y);
      field.value(p_cam, &phi, &unused);
      const bool on = std::abs(phi) <= band;
      // At guessed parts of a shape there is the object or a hand.
      if (on && shape.seen.amount && !shape.seen.below(shape.sdf, field.T_obj_cam * p_cam)) continue;
      const bool in_front = !plain && phi > kFrontBands * band && hides(field, p_cam, phi, shape.sdf.voxel_m);
      if (on ? !plain && near_a_step(frame.depth_m, x, y) : !in_front && !(phi > off)) continue;
      if (!on && on_one_of(others, p_cam.cast<double>(), double(off))) continue;
      const int bin = reader->bin(y * camera.width + x, u, z);
      if (bin < 0) continue;
      if (on) {
        counts->add_object(bin, plain ? 1 : known.weight(bin));
        continue;
      }
      if (phi > off) counts->add_background(bin);
      if (in_front) counts->add_front(bin);
    }
}

void count_mask_colors(const frame::DepthFrame& frame, const Camera& camera, const unsigned char* mask,
                       ColorReader* reader, appearance::ColorCounts* counts) {
  counts->clear();
  frame::Rect box{camera.width, camera.height, 0, 0};
  frame::DepthRange range{1e9, 0};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      if (!mask[y * camera.width + x]) continue;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
      const auto z = double(frame.depth_m(x, y));
      if (z > 0) range = {std::min(range.near_m, z), std::max(range.far_m, z)};
    }
  if (box.empty())
    throw std::invalid_argument(
        "mask: expected pixels of the object, got an empty mask; no colour histogram can be built");
  const frame::Rect region =
      grown(box, 8 + (box.x1 - box.x0) * 3 / 10, 8 + (box.y1 - box.y0) * 3 / 10, camera);
  reader->open(frame, camera, region, range);
  const frame::IdealPixel ideal{frame, camera.K.cast<float>(), camera.width};
  for (int y = region.y0; y < region.y1; ++y)
    for (int x = region.x0; x < region.x1; ++x) {
      const float z = frame.depth_m(x, y);
      const int at = y * camera.width + x, bin = z > 0 ? reader->bin(at, ideal(x, y), z) : -1;
      if (bin < 0) continue;
      if (mask[at])
        counts->add_object(bin);
      else
        counts->add_background(bin);
    }
  if (counts->object_pixels == 0)
    throw std::invalid_argument(
        "mask: expected pixels with depth in view of the colour camera, got none; no colour histogram can be "
        "built");
}

}  // namespace sdftrack::tracking

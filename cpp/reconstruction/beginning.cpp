// SPDX-License-Identifier: MIT
#include "reconstruction/beginning.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

#include "base/quantile.h"
#include "plane/near_planes.h"
#include "reconstruction/guessed_back.h"
#include "render/raycast_sdf.h"

namespace sdftrack::reconstruction {

namespace {

constexpr std::size_t kFewestReadings = 100;
constexpr double kFrontShare = 0.05;
constexpr double kCentreBehind = 0.6;  // radii: measurements are the ball's front, their median is inside it
constexpr double kMostOfImage = 0.8;
constexpr double kOwnShare = 0.2;  // of a mask's measurements, that planes leave at least
constexpr float kInMargin_m = 1e-3f;
constexpr double kMinNoise_m = 5e-4, kUsualNoise_m = 1e-3;
constexpr int kAcrossHole_px = 2;     // from a measurement to the next one in filled depth
constexpr double kBendsKept = 0.9;    // the largest are edges and curvature
constexpr double kOfKeptBends = 1.3;  // sd of a normal distribution over that of its inner 0.9
constexpr int kWindow_px = 200;       // along the surroundings, that are enough for a plane
constexpr double kAround = 2.5;       // times the object's size: where planes are searched for
constexpr double kAboveShare = 0.9;   // of the mask's measurements lie above a plane that the object is on
constexpr double kThin_m = 0.002, kPerSd = 2.0;   // half thickness of a plane: sd of its own measurements
constexpr double kAlike = 0.97, kClose_m = 0.04;  // cosine, distance: of such planes the one behind suffices
constexpr double kMadToSd = 1.48;

template <class... Numbers>
std::string printed(const char* format, Numbers... numbers) {
  char text[400];
  std::snprintf(text, sizeof text, format, numbers...);
  return text;
}

frame::PointImage points_of(const ImageView<float>& depth_m, const Camera& camera) {
  const LensRays lens(camera);
  frame::PointImage out;
  out.width = depth_m.width, out.height = depth_m.height;
  out.p.reserve(std::size_t(out.width) * out.height);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const float z = depth_m(x, y);
      // Rays are rounded to float, as in a camera's table.
      const Vec3d ray = lens.at(x, y).cast<float>().cast<double>();
      out.p.push_back(z > 0 && std::isfinite(z) ? double(z) * ray : Vec3d{0, 0, 0});
    }
  return out;
}

bool above_all(Vec3d p_cam, const std::vector<PlaneBelow>& planes) {
  return std::all_of(planes.begin(), planes.end(), [&](const PlaneBelow& plane) {
    return dot(p_cam, plane.normal_cam) + plane.offset_m >= plane.thick_m;
  });
}

PixelMask without_planes(const PixelMask& mask, const frame::PointImage& points,
                         const std::vector<PlaneBelow>& planes) {
  PixelMask out = mask;
  for (std::size_t i = 0; i < out.on.size(); ++i)
    if (out.on[i] && points.p[i].z > 0) out.on[i] = above_all(points.p[i], planes);
  return out;
}

std::size_t readings_in(const PixelMask& mask, const ImageView<float>& depth_m) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < mask.on.size(); ++i) count += mask.on[i] && depth_m.data[i] > 0;
  return count;
}

std::vector<float> depths_in(const PixelMask& mask, const ImageView<float>& depth_m) {
  std::vector<float> out;
  for (std::size_t i = 0; i < mask.on.size(); ++i)
    if (mask.on[i] && depth_m.data[i] > 0) out.push_back(depth_m.data[i]);
  return out;
}

PixelMask rectangle(const ImageView<float>& depth_m, const frame::Rect& box) {
  PixelMask out(depth_m.width, depth_m.height);
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) out.on[out.at(x, y)] = 1;
  return out;
}

// A ball fitted to a mask: its diameter is the longer side, its front touches the measurements.
Ball ball_of(const ImageView<float>& depth_m, const PixelMask& mask, const Camera& camera) {
  const double share = frame::count(mask) / double(mask.on.size());
  if (share > kMostOfImage)
    throw std::invalid_argument(
        printed("mask: expected the object alone, got %.0f %% of the image", 100 * share));
  std::vector<float> read = depths_in(mask, depth_m);
  if (read.size() < kFewestReadings)
    throw std::invalid_argument(
        printed("mask: expected at least %zu depth measurements on the object, got %zu; is it black, shiny, "
                "too small or too near?",
                kFewestReadings, read.size()));
  const float z = median(&read);
  PixelMask near(mask.width, mask.height);
  int x0 = mask.width, x1 = -1, y0 = mask.height, y1 = -1;
  read.clear();
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      const float depth = depth_m(x, y);
      if (!mask(x, y) || !(depth > 0) || !(std::abs(depth - z) < 0.5f * z)) continue;
      near.on[near.at(x, y)] = 1, read.push_back(depth);
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  const Intrinsics<double>& K = camera.K;
  const double left = (x0 - K.cx) / K.fx, right = (x1 - K.cx) / K.fx, top = (y0 - K.cy) / K.fy,
               bottom = (y1 - K.cy) / K.fy, median_m = z;
  const double radius = 0.5 * std::max(right - left, bottom - top) * median_m;
  const double at = median_m + kCentreBehind * radius, front = quantile(&read, kFrontShare);
  return {{at * (0.5 * (left + right)), at * (0.5 * (top + bottom)), at},
          radius,
          at - front,
          shorter_side_px(near) * median_m / K.fx};
}

// A plane that was found, shifted to the median of its measurements.
PlaneBelow settled(const plane::NearPlane& found, const frame::PointImage& points) {
  std::vector<double> heights;
  for (std::size_t i = 0; i < found.pixels.on.size(); ++i)
    if (found.pixels.on[i])
      heights.push_back(dot(found.plane.normal_cam, points.p[i]) + found.plane.offset_m);
  const double middle = median(&heights);
  for (double& height : heights) height = std::abs(height - middle);
  return {found.plane.normal_cam, found.plane.offset_m - middle,
          std::max(kThin_m, kPerSd * kMadToSd * median(&heights))};
}

// A table bent by lens distortion is found as several planes: the one farthest below the object is kept.
std::vector<PlaneBelow> without_doubles(std::vector<PlaneBelow> planes, Vec3d middle) {
  const auto height = [&](const PlaneBelow& p) { return dot(p.normal_cam, middle) + p.offset_m; };
  std::stable_sort(planes.begin(), planes.end(),
                   [&](const PlaneBelow& a, const PlaneBelow& b) { return height(a) > height(b); });
  std::vector<PlaneBelow> kept;
  for (const PlaneBelow& plane : planes)
    if (std::none_of(kept.begin(), kept.end(), [&](const PlaneBelow& k) {
          return dot(plane.normal_cam, k.normal_cam) > kAlike && height(k) - height(plane) < kClose_m;
        }))
      kept.push_back(plane);
  return kept;
}

double median_of(const std::vector<Vec3d>& points, double Vec3d::*axis) {
  std::vector<double> values;
  for (const Vec3d& p : points) values.push_back(p.*axis);
  return median(&values);
}

// The pixels `around`, thinned to about kWindow_px along each side of their box.
frame::PointImage thinned(const frame::PointImage& points, const PixelMask& around, PixelMask* around_there) {
  const frame::Rect box = frame::mask_bounds(around.on.data(), around.width, around.height);
  const int step = std::max(1, std::max(box.y1 - box.y0, box.x1 - box.x0) / kWindow_px);
  frame::PointImage out;
  out.width = (box.x1 - box.x0 + step - 1) / step, out.height = (box.y1 - box.y0 + step - 1) / step;
  *around_there = PixelMask(out.width, out.height);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const std::size_t from = around.at(box.x0 + step * x, box.y0 + step * y);
      around_there->on[out.p.size()] = around.on[from];
      out.p.push_back(points.p[from]);
    }
  return out;
}

// among: planes are also searched for among the object's pixels.
std::vector<PlaneBelow> planes_under(const frame::PointImage& points, const PixelMask& on_object,
                                     double size_m, bool among) {
  std::vector<Vec3d> own;
  for (std::size_t i = 0; i < points.p.size(); ++i)
    if (on_object.on[i] && points.p[i].z > 0) own.push_back(points.p[i]);
  if (own.empty()) return {};
  const Vec3d middle{median_of(own, &Vec3d::x), median_of(own, &Vec3d::y), median_of(own, &Vec3d::z)};
  PixelMask around = points.measured();
  for (std::size_t i = 0; i < around.on.size(); ++i)
    around.on[i] &= (among || !on_object.on[i]) && norm(points.p[i] - middle) < kAround * size_m;
  if (frame::count(around) == 0) return {};
  PixelMask around_there;
  const frame::PointImage there = thinned(points, around, &around_there);
  std::vector<PlaneBelow> kept;
  for (const plane::NearPlane& found : plane::planes_near(there, around_there, size_m)) {
    const PlaneBelow plane = settled(found, there);
    const auto over = std::count_if(own.begin(), own.end(), [&](Vec3d p) {
      return dot(p, plane.normal_cam) + plane.offset_m > -plane.thick_m;
    });
    if (double(over) > kAboveShare * double(own.size())) kept.push_back(plane);
  }
  return without_doubles(std::move(kept), middle);
}

PixelMask object_in_box(const ImageView<float>& depth_m, const frame::Rect& box, const Camera& camera,
                        bool planes) {
  const PixelMask inside = rectangle(depth_m, box);
  std::vector<float> read = depths_in(inside, depth_m);
  if (!planes || read.empty()) return mask_of_box(depth_m, box);
  const double size_m =
      std::max((box.x1 - box.x0) / camera.K.fx, (box.y1 - box.y0) / camera.K.fy) * median(&read);
  const frame::PointImage points = points_of(depth_m, camera);
  PixelMask inside_read = inside;
  for (std::size_t i = 0; i < inside.on.size(); ++i) inside_read.on[i] &= points.p[i].z > 0;
  const PixelMask free = without_planes(inside_read, points, planes_under(points, inside_read, size_m, true));
  if (frame::count(free) == 0)
    throw std::invalid_argument(
        "box: expected an object in it, got only a plane that extends beyond it (a table, a wall); move the "
        "box, or give planes=False if the object is that flat");
  std::vector<float> kept(inside.on.size(), 0.0f);
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (free.on[i]) kept[i] = depth_m.data[i];
  return mask_of_box({kept.data(), depth_m.width, depth_m.height}, box);
}

// The object's pixels at the pose of a shape.
PixelMask silhouette(const ImageView<float>& depth_m, const Rigidd& T_cam_obj, const Camera& camera,
                     const KnownShape& shape) {
  const render::SdfImage image = render::raycast_sdf(shape.view(), camera, T_cam_obj, 0);
  PixelMask out(depth_m.width, depth_m.height);
  for (std::size_t i = 0; i < out.on.size(); ++i) out.on[i] = image.depth_m[i] > 0;
  const Vec3d t = T_cam_obj.t;
  if (readings_in(out, depth_m) < kFewestReadings)
    throw std::invalid_argument(
        printed("pose: expected one at which there are depth measurements of the shape, got a T_cam_obj at "
                "(%.3g, %.3g, %.3g) m; it is in metres, with OpenCV's axes: x right, y down, z forward "
                "(z < 0 is behind the camera)",
                t.x, t.y, t.z));
  return out;
}

// Within the outline the object may be at any depth; outside it only behind a possible occluder.
std::vector<float> room(const ImageView<float>& depth_m, const PixelMask& on_object, const PixelMask* outline,
                        int margin_px) {
  std::vector<float> read = depths_in(on_object, depth_m);
  const float middle = median(&read);
  const PixelMask wider = outline ? frame::dilated(*outline, margin_px) : PixelMask();
  std::vector<float> from_m(on_object.on.size(), 0.0f);
  for (std::size_t i = 0; outline && i < from_m.size(); ++i) {
    const float z = depth_m.data[i];
    if (outline->on[i]) continue;
    from_m[i] = wider.on[i] ? kInMargin_m : z > 0 && z < middle ? z : std::numeric_limits<float>::infinity();
  }
  return from_m;
}

// The far side that the near one suggests, also a little beyond the object's pixels: what is as low as the
// table was taken from them. The rest of the mask or box is not the object's. Beyond it, where it does not
// bound the object, the deepest.
void guess_far_side(const ImageView<float>& depth_m, const Camera& camera, const PixelMask& before_planes,
                    int margin_px, Beginning* found) {
  std::vector<float>& from_m = found->view->from_m;
  PixelMask wide = frame::dilated(found->on_object, margin_px);
  for (std::size_t i = 0; i < wide.on.size(); ++i) wide.on[i] &= before_planes.on[i];
  const std::vector<float> back_m = guessed_back(depth_m, wide, camera);
  const float deepest = *std::max_element(back_m.begin(), back_m.end());
  if (!(deepest > 0)) return;
  for (std::size_t i = 0; i < from_m.size(); ++i) {
    if (from_m[i] != 0) continue;
    const float elsewhere_m = found->outline->on[i] ? kInMargin_m : deepest;
    from_m[i] = -(back_m[i] > 0 ? back_m[i] : elsewhere_m);
  }
}

// The object's own pixels, and the bounds that planes and outline give.
void bound_object(const ImageView<float>& depth_m, const Camera& camera, const BeginningOptions& options,
                  Beginning* found) {
  ViewBounds view;
  const frame::PointImage points = points_of(depth_m, camera);
  if (options.planes) view.planes = planes_under(points, found->on_object, 2 * found->ball.radius_m, false);
  const PixelMask free = without_planes(found->on_object, points, view.planes);
  const double before = double(readings_in(found->on_object, depth_m)),
               after = double(readings_in(free, depth_m));
  if (after < kOwnShare * before)
    throw std::invalid_argument(
        printed("mask: expected an object, got a plane that extends beyond it (%.0f %% of its depth "
                "measurements lie on a table or a wall); give the object's mask, or planes=False if it is "
                "that flat",
                100 - 100 * after / before));
  const PixelMask before_planes = std::move(found->on_object);
  found->on_object = free;
  view.from_m =
      room(depth_m, free, options.keep_to_mask ? &*found->outline : nullptr, options.mask_margin_px);
  found->view = std::move(view);
  found->ball = ball_of(depth_m, free, camera);
  guess_far_side(depth_m, camera, before_planes, options.mask_margin_px, found);
}

}  // namespace

std::shared_ptr<const FirstView> Beginning::view_at(const Camera& camera, const Rigidd& T,
                                                    bool far_side) const {
  if (!view) return nullptr;
  std::vector<float> from_m = view->from_m;
  if (!far_side)
    for (float& from : from_m) from = std::max(from, 0.0f);
  return std::make_shared<const FirstView>(
      camera, T, std::move(from_m), view->planes,
      Place{ball.centre_cam, ball.radius_m, ball.centre_cam.z - ball.behind_m + ball.shorter_m});
}

KnownShape::Extent KnownShape::extent() const {
  constexpr int kMost = std::numeric_limits<int>::max();
  int low[3] = {kMost, kMost, kMost}, high[3] = {-1, -1, -1};
  const float* row = phi;
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y, row += grid.nx)
      for (int x = 0; x < grid.nx; ++x) {
        if (!(row[x] <= 0)) continue;
        const int at[3] = {x, y, z};
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
      }
  return {grid.point(low[0], low[1], low[2]), grid.point(high[0], high[1], high[2])};
}

std::vector<PlaneBelow> planes_below(const ImageView<float>& depth_m, const PixelMask& on_object,
                                     const Camera& camera, double size_m) {
  return planes_under(points_of(depth_m, camera), on_object, size_m, false);
}

double measured_noise_m(const frame::DepthFrame& frame, const PixelMask& mask) {
  const ImageView<float> depth_m{frame.measured_m(), frame.depth_m.width, frame.depth_m.height};
  const int reach_px = frame.given_m ? kAcrossHole_px : 1;
  std::vector<double> found;
  for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}}) {
    const auto step_to_next = [&, dx = dx, dy = dy](int x, int y, int sign) {
      for (int step = 1; step <= reach_px; ++step) {
        const int u = x + sign * step * dx, v = y + sign * step * dy;
        if (u < 0 || v < 0 || u >= depth_m.width || v >= depth_m.height) return 0;
        if (mask(u, v) && depth_m(u, v) > 0) return step;
      }
      return 0;
    };
    std::vector<float> bends;
    for (int y = 0; y < depth_m.height; ++y)
      for (int x = 0; x < depth_m.width; ++x) {
        if (!mask(x, y) || !(depth_m(x, y) > 0)) continue;
        const int before = step_to_next(x, y, -1), after = step_to_next(x, y, 1);
        if (before == 0 || after == 0) continue;
        const float a = 2.0f * float(after) / float(before + after), b = 2 - a;
        const float bend = b * depth_m(x + after * dx, y + after * dy) - 2 * depth_m(x, y) +
                           a * depth_m(x - before * dx, y - before * dy);
        bends.push_back(std::abs(bend) * std::sqrt(6 / (4 + a * a + b * b)));
      }
    if (bends.size() <= kFewestReadings / 2) continue;
    std::sort(bends.begin(), bends.end());
    bends.resize(std::size_t(kBendsKept * double(bends.size())));
    double sum = 0;
    for (const double bend : bends) sum += bend * bend;
    found.push_back(kOfKeptBends * std::sqrt(sum / double(bends.size()) / 6));
  }
  if (found.empty()) return kUsualNoise_m;
  return std::max(kMinNoise_m, found.size() == 1 ? found[0] : 0.5 * (found[0] + found[1]));
}

Beginning find_object(const frame::DepthFrame& frame, const tracking::PoseHint& place, const Camera& camera,
                      const KnownShape* initial, const BeginningOptions& options) {
  const ImageView<float>& depth_m = frame.depth_m;
  Beginning found;
  if (place.T_cam_obj) {
    found.on_object = silhouette(depth_m, *place.T_cam_obj, camera, *initial);
  } else if (place.box) {
    found.on_object = object_in_box(depth_m, *place.box, camera, options.planes);
    found.outline = rectangle(depth_m, *place.box);  // the connected region may be smaller than the object
  } else {
    found.on_object = PixelMask(depth_m.width, depth_m.height);
    for (std::size_t i = 0; i < place.mask.size(); ++i) found.on_object.on[i] = place.mask[i] != 0;
    found.outline = found.on_object;
  }
  found.ball = ball_of(depth_m, found.on_object, camera);
  if (found.outline && (options.keep_to_mask || options.planes))
    bound_object(depth_m, camera, options, &found);
  found.T_cam_obj.t = found.ball.centre_cam;
  if (place.T_cam_obj) {
    found.T_cam_obj = *place.T_cam_obj;
  } else if (initial) {
    const KnownShape::Extent box = initial->extent();
    found.T_cam_obj.t = found.T_cam_obj.t - 0.5 * (box.low + box.high);
  }
  found.noise_m = options.noise_m ? *options.noise_m : measured_noise_m(frame, found.on_object);
  return found;
}

Beginning find_standing(const frame::DepthFrame& frame, const Rigidd& T_cam_obj, const Camera& camera,
                        const KnownShape& shape, const BeginningOptions& options) {
  tracking::PoseHint place;
  place.T_cam_obj = T_cam_obj;
  Beginning found = find_object(frame, place, camera, &shape, options);
  if (options.planes)
    found.view = ViewBounds{std::vector<float>(found.on_object.on.size(), 0.0f),
                            planes_below(frame.depth_m, found.on_object, camera, 2 * found.ball.radius_m)};
  return found;
}

}  // namespace sdftrack::reconstruction

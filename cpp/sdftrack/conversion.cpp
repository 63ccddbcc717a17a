// SPDX-License-Identifier: MIT
#include "sdftrack/conversion.h"

#include <algorithm>
#include <cmath>

#include "frame/image/depth_metres.h"

namespace sdftrack {

namespace {

constexpr double kRotationError = 1e-2;  // what is more is a scale or a mirror

Eigen::Isometry3d isometry_of(const Rigidd& T) {
  Eigen::Isometry3d out;
  int i = 0;
  for (const Vec3d& row : {T.R.r0, T.R.r1, T.R.r2}) out.linear().row(i++) << row.x, row.y, row.z;
  out.translation() << T.t.x, T.t.y, T.t.z;
  out.makeAffine();
  return out;
}

std::size_t pixels_of(const Camera& camera) { return std::size_t(camera.width) * camera.height; }

}  // namespace

Rigidd rigid_of(const Eigen::Isometry3d& T, const char* name) {
  const Eigen::Matrix3d R = T.linear();
  if (!T.matrix().allFinite() || R.determinant() < 0 ||
      (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRotationError)
    throw std::invalid_argument(std::string(name) + ": expected a rotation and a translation in metres");
  const auto row = [&](int i) { return Vec3d{R(i, 0), R(i, 1), R(i, 2)}; };
  return {nearest_rotation(Mat3d{row(0), row(1), row(2)}), {T(0, 3), T(1, 3), T(2, 3)}};
}

Camera camera_of(const LensCamera& c, const char* name) {
  if (c.width <= 0 || c.height <= 0 || !(c.fx > 0 && c.fy > 0) || !std::isfinite(c.fx + c.fy + c.cx + c.cy))
    throw std::invalid_argument(std::string(name) + ": expected a width, a height and focal lengths above 0");
  return {{c.fx, c.fy, c.cx, c.cy}, c.width, c.height, c.distortion};
}

TrackedPose pose_of(const tracking::ObjectResult& result) {
  TrackedPose out;
  out.status = static_cast<Status>(result.trust.status);
  out.reason = tracking::sentence(result.trust.reason);
  out.T_cam_obj = isometry_of(result.T_cam_obj);
  out.covariance = result.covariance;
  out.twist = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(result.twist.data());
  out.confidence = result.trust.confidence;
  return out;
}

tracking::PoseHint hint_of(const Place& place, const Camera& camera) {
  tracking::PoseHint out;
  if (place.T_cam_obj) out.T_cam_obj = rigid_of(*place.T_cam_obj, "T_cam_obj");
  if (place.mask) {
    out.mask.assign(place.mask, place.mask + pixels_of(camera));
    if (std::all_of(out.mask.begin(), out.mask.end(), [](unsigned char m) { return m == 0; }))
      throw std::invalid_argument("mask: expected pixels that are not 0, got none");
  }
  if (place.box) {
    const auto& [x, y, width, height] = *place.box;
    if (width <= 0 || height <= 0 || x < 0 || y < 0 || x > camera.width - width || y > camera.height - height)
      throw std::invalid_argument("box: expected one within the image, with a width and a height");
    out.box = frame::Rect{x, y, x + width, y + height};
  }
  return out;
}

FrameReader::FrameReader(const DepthCamera& depth, const std::optional<ColorCamera>& color)
    : map_(color ? appearance::rigid_map(camera_of(depth), camera_of(*color, "color"),
                                         rigid_of(color->T_color_depth, "T_color_depth"))
                 : appearance::aligned_map(depth.width, depth.height)) {}

frame::DepthFrame FrameReader::depth_of(const Frame& frame, const Camera& camera) {
  if (frame.depth && frame.depth_m) throw std::invalid_argument("frame: expected depth or depth_m, got both");
  const std::size_t pixels = pixels_of(camera);
  frame::DepthFrame out{{frame.depth_m, camera.width, camera.height}, nullptr, nullptr};
  if (frame.depth) {
    if (!(frame.depth_unit_m > 0)) throw std::invalid_argument("depth_unit_m: expected a number above 0");
    depth_m_.resize(pixels);
    frame::metres_of(frame.depth, pixels, frame.depth_unit_m, depth_m_.data());
    out.depth_m.data = depth_m_.data();
  }
  if (out.depth_m.data && frame::has_lattice(out.depth_m)) {
    out.given_m = out.depth_m.data;
    filled_m_.assign(out.given_m, out.given_m + pixels);
    frame::fill_lattice(camera.width, camera.height, filled_m_.data());
    out.depth_m.data = filled_m_.data();
  }
  return out;
}

frame::DepthFrame FrameReader::read(const Frame& frame, const tracking::Tracker& tracker) {
  const frame::DepthFrame depth = depth_of(frame, tracker.camera());
  color_ = {frame.rgb, map_};
  const appearance::ColorImage* const color = frame.rgb ? &color_ : nullptr;
  if (!depth.depth_m.data) return tracker.make_unreadable_frame({}, frame.time_s, color);
  frame::DepthFrame out = tracker.make_frame(depth.depth_m, nullptr, frame.time_s, color);
  out.given_m = depth.given_m;
  return out;
}

}  // namespace sdftrack

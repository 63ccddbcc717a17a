// SPDX-License-Identifier: MIT
#include "tracking/trust/lost_place.h"

#include <algorithm>
#include <cstdio>

#include "frame/region.h"

namespace sdftrack::tracking {

namespace {

constexpr double kFarthest_m = 30;     // beyond what depth cameras measure
constexpr double kBeyond = 2;          // times the largest measurement: not a matter of a few lost pixels
constexpr double kOtherUnit_m = 10;    // from here on a distance is likely in another unit: in centimetres,
constexpr double kMillimetres_m = 90;  // and from here on in millimetres

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

float largest_reading(const ImageView<float>& depth_m) {
  const int pixels = depth_m.width * depth_m.height, stride = std::max(1, pixels / 4099);
  float largest = 0;
  for (int i = 0; i < pixels; i += stride) largest = std::max(largest, depth_m.data[i]);
  return largest;
}

std::string unit_of(double distance_m) {
  if (distance_m < kOtherUnit_m) return "";
  return distance_m < kMillimetres_m ? "; is it in centimetres? metres are expected"
                                     : "; is it in millimetres? metres are expected";
}

}  // namespace

Reason lost_at(const Rigidd& T_cam_obj, const frame::Shape& shape, const Camera& camera,
               const ImageView<float>& depth_m, Reason reason) {
  if (reason.code != ReasonCode::kFewReadings && reason.code != ReasonCode::kLittleOutline &&
      reason.code != ReasonCode::kNoDepthImage)
    return reason;
  const double z = T_cam_obj.t.z;
  if (norm(T_cam_obj.t) == 0) return reason;  // of an object that never had a pose
  if (z <= 0) return {ReasonCode::kBehindCamera, 0, -1, number(z) + " m" + unit_of(-z)};
  const double largest = depth_m.data ? double(largest_reading(depth_m)) : 0;
  const double near = frame::depth_range(shape, T_cam_obj, 0).near_m;
  if (near > (largest > 0 ? kBeyond * largest : kFarthest_m))
    return {ReasonCode::kFarAway, 0, -1,
            number(z) + " m away" +
                (largest > 0 ? ", beyond all depth measurements (up to " + number(largest) + " m)" : "") +
                unit_of(z)};
  if (reason.code != ReasonCode::kNoDepthImage && frame::projected_box(camera, shape, T_cam_obj, 0).empty())
    return {ReasonCode::kOutsideImage};
  return reason;
}

}  // namespace sdftrack::tracking

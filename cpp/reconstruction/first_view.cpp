// SPDX-License-Identifier: MIT
#include "reconstruction/first_view.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/to_int.h"

namespace sdftrack::reconstruction {

namespace {

constexpr double kBend = 0.1;  // of a plane, over the distance from the object

}  // namespace

FirstView::FirstView(const Camera& camera, const Rigidd& T_cam_obj, std::vector<float> from_m,
                     std::vector<PlaneBelow> planes, const Place& place)
    : camera_(camera),
      T_cam_obj_(T_cam_obj),
      from_m_(std::move(from_m)),
      planes_(std::move(planes)),
      place_(place) {
  if (from_m_.size() != static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height))
    throw std::invalid_argument("from_m: expected one number for each of the camera's pixels");
}

bool FirstView::above(Vec3d p_cam, double thicknesses) const {
  const double away_m = std::max(0.0, norm(p_cam - place_.middle_cam) - place_.radius_m);
  for (const PlaneBelow& plane : planes_)
    if (dot(plane.normal_cam, p_cam) + plane.offset_m < thicknesses * plane.thick_m + kBend * away_m)
      return false;
  return true;
}

// Of an object that the image's border cuts nobody knows how far it reaches beyond.
double FirstView::from(Vec3d p_cam) const {
  const Vec2d u = camera_.distorted() ? camera_.project_point(p_cam) : project(camera_.K, p_cam);
  const int x = to_int(std::clamp(u.x + 0.5, 0.0, camera_.width - 1.0)),
            y = to_int(std::clamp(u.y + 0.5, 0.0, camera_.height - 1.0));
  return static_cast<double>(from_m_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) +
                                     static_cast<std::size_t>(x)]);
}

}  // namespace sdftrack::reconstruction

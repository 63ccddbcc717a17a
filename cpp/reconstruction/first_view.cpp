// SPDX-License-Identifier: MIT
#include "reconstruction/first_view.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace sdftrack::reconstruction {

FirstView::FirstView(const Camera& camera, const Rigidd& T_cam_obj, std::vector<float> from_m,
                     std::vector<PlaneBelow> planes, const Place& place)
    : from_m_(std::move(from_m)),
      planes_(std::move(planes)),
      term_{LensRays(camera), camera.width,   camera.height,      T_cam_obj, place,
            from_m_.data(),   planes_.data(), int(planes_.size())} {
  if (from_m_.size() != std::size_t(camera.width) * camera.height)
    throw std::invalid_argument("from_m: expected one number for each of the camera's pixels");
}

bool FirstView::has_far_side() const {
  return std::any_of(from_m_.begin(), from_m_.end(), [](float from) { return from < 0; });
}

}  // namespace sdftrack::reconstruction

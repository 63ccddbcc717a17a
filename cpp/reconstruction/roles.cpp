// SPDX-License-Identifier: MIT
#include "reconstruction/roles.h"

#include <cmath>

namespace sdftrack::reconstruction {

namespace {

std::size_t size_of(const levelset::PixelRect& rect) {
  return static_cast<std::size_t>(rect.x1 - rect.x0) * static_cast<std::size_t>(rect.y1 - rect.y0);
}

}  // namespace

const std::vector<levelset::PixelRole>& RoleFinder::find(const levelset::PixelRect& rect,
                                                         const std::vector<float>& distance_m,
                                                         const float* foreground,
                                                         const ImageView<float>& depth_m,
                                                         const RoleOptions& options,
                                                         const std::function<bool(int, int)>& has_room) {
  const int w = rect.x1 - rect.x0, h = rect.y1 - rect.y0;
  roles_.assign(size_of(rect), levelset::PixelRole::kUnknown);
  const auto may_be = [&](std::size_t i) {
    return !std::isnan(distance_m[i]) && !(foreground && foreground[i] < options.min_foreground);
  };
  const auto room = [&](int i) { return has_room(rect.x0 + i % w, rect.y0 + i / w); };
  open_.clear();
  for (std::size_t i = 0; i < roles_.size(); ++i) {
    if (std::isnan(distance_m[i])) continue;
    roles_[i] = levelset::PixelRole::kBeyond;
    if (may_be(i) && std::abs(distance_m[i]) < options.near_m && room(static_cast<int>(i)))
      roles_[i] = levelset::PixelRole::kObject, open_.push_back(static_cast<int>(i));
  }
  while (!open_.empty()) {
    const int i = open_.back(), x = i % w, y = i / w;
    open_.pop_back();
    const float z = depth_m(rect.x0 + x, rect.y0 + y);
    const auto visit = [&](int nx, int ny) {
      if (nx < 0 || ny < 0 || nx >= w || ny >= h) return;
      const int at = ny * w + nx;
      const auto j = static_cast<std::size_t>(at);
      if (roles_[j] != levelset::PixelRole::kBeyond || !may_be(j)) return;
      if (!(std::abs(depth_m(rect.x0 + nx, rect.y0 + ny) - z) < options.joined_m) || !room(at)) return;
      roles_[j] = levelset::PixelRole::kObject, open_.push_back(at);
    };
    visit(x - 1, y), visit(x + 1, y), visit(x, y - 1), visit(x, y + 1);
  }
  return roles_;
}

const std::vector<levelset::PixelRole>* RoleFinder::from_colors(const levelset::PixelRect& rect,
                                                                const ImageView<float>& depth_m,
                                                                const float* foreground) {
  roles_.resize(size_of(rect));
  bool known = false;
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      known |= !std::isnan(foreground[i]);
      roles_[i] = !(depth_m(x, y) > 0) || std::isnan(foreground[i]) ? levelset::PixelRole::kUnknown
                  : foreground[i] > 0.5f                            ? levelset::PixelRole::kObject
                                                                    : levelset::PixelRole::kBeyond;
    }
  return known ? &roles_ : nullptr;
}

const std::vector<levelset::PixelRole>& RoleFinder::from_mask(const levelset::PixelRect& rect,
                                                              const ImageView<float>& depth_m,
                                                              const unsigned char* mask) {
  roles_.resize(size_of(rect));
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      const bool readable = depth_m(x, y) > 0;
      const bool inside = mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth_m.width) +
                               static_cast<std::size_t>(x)] != 0;
      roles_[i] = !readable ? levelset::PixelRole::kUnknown
                  : inside  ? levelset::PixelRole::kObject
                            : levelset::PixelRole::kBeyond;
    }
  return roles_;
}

}  // namespace sdftrack::reconstruction

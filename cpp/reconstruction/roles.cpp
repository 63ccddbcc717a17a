// SPDX-License-Identifier: MIT
#include "reconstruction/roles.h"

#include <cmath>

namespace sdftrack::reconstruction {

const std::vector<levelset::PixelRole>& RoleFinder::find(const levelset::PixelRect& rect,
                                                         const std::vector<float>& distance_m,
                                                         const float* foreground,
                                                         const ImageView<float>& depth_m,
                                                         const RoleOptions& options,
                                                         const std::function<bool(int, int)>& has_room) {
  const int w = rect.width(), h = rect.height();
  roles_.assign(rect.count(), levelset::PixelRole::kUnknown);
  const auto may_be = [&](std::size_t i) {
    return !std::isnan(distance_m[i]) && options.may_be(foreground, int(i));
  };
  const auto room = [&](int i) { return has_room(rect.x0 + i % w, rect.y0 + i / w); };
  open_.clear();
  for (std::size_t i = 0; i < roles_.size(); ++i) {
    if (std::isnan(distance_m[i])) continue;
    roles_[i] = levelset::PixelRole::kBeyond;
    if (may_be(i) && options.starts(distance_m[i]) && room(int(i)))
      roles_[i] = levelset::PixelRole::kObject, open_.push_back(int(i));
  }
  while (!open_.empty()) {
    const int i = open_.back(), x = i % w, y = i / w;
    open_.pop_back();
    const float z = depth_m(rect.x0 + x, rect.y0 + y);
    const auto visit = [&](int nx, int ny) {
      if (nx < 0 || ny < 0 || nx >= w || ny >= h) return;
      const int at = ny * w + nx;
      const auto j = std::size_t(at);
      if (roles_[j] != levelset::PixelRole::kBeyond || !may_be(j)) return;
      if (!options.joins(depth_m(rect.x0 + nx, rect.y0 + ny), z) || !room(at)) return;
      roles_[j] = levelset::PixelRole::kObject, open_.push_back(at);
    };
    visit(x - 1, y), visit(x + 1, y), visit(x, y - 1), visit(x, y + 1);
  }
  return roles_;
}

const std::vector<levelset::PixelRole>* RoleFinder::from_colors(const levelset::PixelRect& rect,
                                                                const ImageView<float>& depth_m,
                                                                const float* foreground) {
  roles_.resize(rect.count());
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
  roles_.resize(rect.count());
  std::size_t i = 0;
  for (int y = rect.y0; y < rect.y1; ++y)
    for (int x = rect.x0; x < rect.x1; ++x, ++i) {
      const unsigned char inside = mask[std::size_t(y) * depth_m.width + x];
      roles_[i] = masked_role(depth_m(x, y), inside);
    }
  return roles_;
}

}  // namespace sdftrack::reconstruction

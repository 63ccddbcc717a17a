// SPDX-License-Identifier: MIT
#include "tracking/fit/outline_lines.h"

#include <algorithm>
#include <cmath>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "energies/outline_offset.h"
#include "tracking/fit/outline_places.h"
#include "tracking/trust/color_projection.h"

namespace sdftrack::tracking {

namespace {

constexpr double kThickness_px = 6;  // an object thinner than this has its other side on the same line
constexpr double kMinContrast = 0.25;
constexpr double kMaxSd = 0.45;    // of the sd of an offset about which nothing is known
constexpr double kPixelSd = 0.29;  // of an edge at an unknown position in a pixel
// Distance from the outline of the pixels whose colours are learnt: nearer, a slightly wrong pose would
// include those of the other side.
constexpr int kNearestLearnt_px = 2, kFarthestLearnt_px = 10;
// Posterior of a colour that the object has nowhere: of a finger whose depth is hardly nearer.
constexpr float kForeign = 0.3f;
constexpr float kLocalRate = 0.2f;
constexpr float kSurest = 0.97f;  // bound of the probability by a place's colours

class LineMaker {
 public:
  LineMaker(const frame::DepthFrame& frame, const OutlineColors& colors, const OutlineSearch& search,
            const energies::ColorProjection& view)
      : color_(*frame.color),
        view_(view),
        whole_(*colors.whole),
        local_(colors.local && colors.local->known() ? colors.local : nullptr),
        posterior_(colors.whole->posterior().data()),
        odds_(1 / colors.whole->prior() - 1),
        surest_(local_ ? kSurest : bound(*colors.whole)),
        stride_((search.reach_px + energies::kMaxReach - 1) / energies::kMaxReach),
        reach_(std::max(2, search.reach_px / stride_)) {}

  // Measures a line; place: of its point on the object. Samples are whole pixels of the nearer axis.
  bool measure(int place, energies::OutlineLine* line) const {
    const Vec2d c = line->centre_px, n = line->normal;
    const bool across = std::abs(n.x) >= std::abs(n.y);
    const double main = across ? c.x : c.y, rise = across ? n.x : n.y, side = across ? n.y : n.x;
    const int step = rise > 0 ? stride_ : -stride_, beyond = reach_ + energies::kBeyondReach;
    const int middle = to_int(std::round(main));
    const double begin = (middle - main) / rise, per_step = stride_ / std::abs(rise);  // px along n
    const int width = across ? view_.width : view_.height, height = across ? view_.height : view_.width;
    if (!(main > -1e6 && main < 1e6)) return false;
    if (std::min(middle - beyond * stride_, middle + beyond * stride_) < 0 ||
        middle + beyond * stride_ >= width)
      return false;
    float chance[energies::kMaxSamples];
    for (int i = -beyond; i <= beyond; ++i) {
      const double t = begin + i * per_step, b = (across ? c.y : c.x) + t * side;
      const int low = to_int(std::floor(b));
      if (low < 0 || low >= height - 1) return false;
      const int a = middle + i * step;
      const auto fraction = float(b - low);
      const float first = chance_at(place, across, a, low), second = chance_at(place, across, a, low + 1);
      chance[i + beyond] = first + fraction * (second - first);
    }
    const energies::OutlineOffset found = energies::outline_offset(chance, reach_);
    const double blind = (2 * reach_ + 1) / std::sqrt(12.0);
    if (found.contrast < kMinContrast || found.sd > kMaxSd * blind) return false;
    line->offset_px = begin + found.mean * per_step;
    line->sd_px = hypotenuse(found.sd * per_step, kPixelSd * stride_);
    return true;
  }

 private:
  float even(float P) const { return odds_ * P / (odds_ * P + 1 - P); }
  // The posteriors' bounds lie symmetrically about their prior, not about one half: if one side were surer
  // than the other, the outline would be shifted to that side.
  float bound(const appearance::ColorModel& colors) const {
    const auto [least, most] = std::minmax_element(colors.posterior().begin(), colors.posterior().end());
    return std::clamp(std::min(even(*most), 1 - even(*least)), 0.5f, 1.0f);
  }

  float chance_at(int place, bool across, int a, int b) const {
    const int bin = appearance::color_bin(across ? color_.at(a, b) : color_.at(b, a));
    const float even_chance = local_ ? local_->chance(whole_, place, bin) : even(posterior_[bin]);
    return std::clamp(even_chance, 1 - surest_, surest_);
  }

  const appearance::ColorImage& color_;
  const energies::ColorProjection& view_;
  const appearance::ColorModel& whole_;
  const appearance::LocalColors* const local_;
  const float* posterior_;
  const float odds_, surest_;
  const int stride_, reach_;
};

const std::vector<ContourPoint>& contour_in(const energies::ColorProjection& view, const Camera& camera,
                                            const frame::Shape& shape, const Rigidd& T_cam_obj,
                                            const OutlineSearch& search, ContourLibrary* contours) {
  const Vec3d eye = centre_of(view);
  const double focal_px = std::sqrt(camera.K.fx * camera.K.fy);
  return contours->seen_from(inverse(T_cam_obj) * eye, shape, focal_px, search.points, kThickness_px);
}

}  // namespace

int find_outline_lines(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const OutlineColors& colors, const Rigidd& T_cam_obj, const OutlineSearch& search,
                       ContourLibrary* contours, energies::OutlineLines* out) {
  out->lines.clear();
  out->view = color_projection(camera, frame.color->map);
  const OutlinePlaces places(frame, camera, shape, T_cam_obj, search, out->view);
  const LineMaker maker(frame, colors, search, out->view);
  const std::vector<ContourPoint>& points = contour_in(out->view, camera, shape, T_cam_obj, search, contours);
  for (const ContourPoint& point : points) {
    energies::OutlineLine line;
    line.p_obj = point.p_obj;
    if (places.find(point, &line.centre_px, &line.normal) &&
        maker.measure(appearance::LocalColors::place_of(point.p_obj), &line))
      out->lines.push_back(line);
  }
  return int(points.size());
}

void learn_outline_colors(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                          const appearance::ColorModel& whole, const Rigidd& T_cam_obj,
                          const OutlineSearch& search, ContourLibrary* contours,
                          appearance::LocalColors* colors) {
  const energies::ColorProjection view = color_projection(camera, frame.color->map);
  const OutlinePlaces places(frame, camera, shape, T_cam_obj, search, view);
  colors->open(kLocalRate);
  for (const ContourPoint& point : contour_in(view, camera, shape, T_cam_obj, search, contours)) {
    Vec2d centre, normal;
    if (!places.find(point, &centre, &normal)) continue;
    const int place = appearance::LocalColors::place_of(point.p_obj);
    for (int away = kNearestLearnt_px; away <= kFarthestLearnt_px; ++away)
      for (const int by : {-away, away}) {
        const double x = centre.x + by * normal.x + 0.5, y = centre.y + by * normal.y + 0.5;
        if (!(x >= 0 && y >= 0 && x < view.width && y < view.height)) continue;
        const int bin = appearance::color_bin(frame.color->at(to_int(x), to_int(y)));
        if (by > 0 || whole.weight(bin) > kForeign) colors->add(place, by < 0, bin);
      }
  }
}

}  // namespace sdftrack::tracking

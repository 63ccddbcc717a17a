// SPDX-License-Identifier: MIT
#include "tracking/fit/outline_lines.h"

#include <algorithm>
#include <cmath>

#include "energies/outline_offset.h"
#include "tracking/trust/color_projection.h"

namespace sdftrack::tracking {

namespace {

constexpr double kThickness_px = 6;  // an object thinner than this has its other side on the same line
constexpr double kMinContrast = 0.35;
constexpr double kMaxSd = 0.45;    // of that of an offset about which nothing is known
constexpr double kPixelSd = 0.29;  // of an edge somewhere in a pixel
constexpr double kInFront_m = 0.010, kInFrontPerNoise = 5;
constexpr double kAside_px = 4;  // of the places on both sides at which an occluder is looked for

// Where A p + q = 0: the colour camera's centre.
Vec3d centre_of(const energies::ColorProjection& view) {
  const Mat3d& A = view.A;
  const Vec3d x = cross(A.r1, A.r2), y = cross(A.r2, A.r0), z = cross(A.r0, A.r1);
  const double per = -1 / dot(A.r0, x);
  return per * (view.q.x * x + view.q.y * y + view.q.z * z);
}

class LineMaker {
 public:
  LineMaker(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
            const appearance::ColorModel& colors, const Rigidd& T_cam_obj, const OutlineSearch& search,
            const energies::ColorProjection& view)
      : frame_(frame),
        camera_(camera),
        shape_(shape),
        T_cam_obj_(T_cam_obj),
        T_obj_cam_(inverse(T_cam_obj)),
        view_(view),
        posterior_(colors.posterior().data()),
        odds_(1 / colors.prior() - 1),
        surest_(bound(colors)),
        stride_((search.reach_px + energies::kMaxReach - 1) / energies::kMaxReach),
        reach_(std::max(2, search.reach_px / stride_)),
        in_front_m_(std::max(kInFront_m, kInFrontPerNoise * search.noise_m)) {}

  bool make(const ContourPoint& point, energies::OutlineLine* line) const {
    const Vec3d p = T_cam_obj_ * point.p_obj, n = T_cam_obj_.R * point.n_obj;
    energies::PixelJacobian J;
    if (!view_.place(p, &line->centre_px, &J)) return false;
    const Vec3d along = cross(n, p);  // of the outline, in space
    const Vec2d tangent{dot(J.u, along), dot(J.v, along)}, out{dot(J.u, n), dot(J.v, n)};
    const double length = std::hypot(tangent.x, tangent.y);
    if (!(length > 0)) return false;
    const double sign = out.x * tangent.y - out.y * tangent.x >= 0 ? 1 / length : -1 / length;
    line->normal = {sign * tangent.y, -sign * tangent.x};
    line->p_obj = point.p_obj;
    return !is_hidden(p, n) && measure(line);
  }

 private:
  // Samples lie at whole pixels of the axis that the normal is nearer to.
  bool measure(energies::OutlineLine* line) const {
    const Vec2d c = line->centre_px, n = line->normal;
    const bool across = std::abs(n.x) >= std::abs(n.y);
    const double main = across ? c.x : c.y, rise = across ? n.x : n.y, side = across ? n.y : n.x;
    const int step = rise > 0 ? stride_ : -stride_, beyond = reach_ + energies::kBeyondReach;
    const int middle = static_cast<int>(std::lround(main));
    const double begin = (middle - main) / rise, per_step = stride_ / std::abs(rise);  // px along n
    const int width = across ? view_.width : view_.height, height = across ? view_.height : view_.width;
    if (!(main > -1e6 && main < 1e6)) return false;
    if (std::min(middle - beyond * stride_, middle + beyond * stride_) < 0 ||
        middle + beyond * stride_ >= width)
      return false;
    float chance[energies::kMaxSamples];
    for (int i = -beyond; i <= beyond; ++i) {
      const double t = begin + i * per_step, b = (across ? c.y : c.x) + t * side;
      const auto low = static_cast<int>(std::floor(b));
      if (low < 0 || low + 1 >= height) return false;
      const int a = middle + i * step;
      const auto fraction = static_cast<float>(b - low);
      const float first = posterior(across, a, low), second = posterior(across, a, low + 1);
      const float P = first + fraction * (second - first);
      chance[i + beyond] = std::clamp(even(P), 1 - surest_, surest_);
    }
    const energies::OutlineOffset found = energies::outline_offset(chance, reach_);
    const double blind = (2 * reach_ + 1) / std::sqrt(12.0);
    if (found.contrast < kMinContrast || found.sd > kMaxSd * blind) return false;
    line->offset_px = begin + found.mean * per_step;
    line->sd_px = std::hypot(found.sd * per_step, kPixelSd * stride_);
    return true;
  }

  // The posterior had both been equally likely beforehand.
  float even(float P) const { return odds_ * P / (odds_ * P + 1 - P); }
  // The posteriors' bounds lie about their prior, not about one half: were one side surer than the other, the
  // outline would lie to that side.
  float bound(const appearance::ColorModel& colors) const {
    const auto [least, most] = std::minmax_element(colors.posterior().begin(), colors.posterior().end());
    return std::clamp(std::min(even(*most), 1 - even(*least)), 0.5f, 1.0f);
  }

  float posterior(bool across, int a, int b) const {
    const unsigned char* rgb = across ? frame_.color->at(a, b) : frame_.color->at(b, a);
    return posterior_[appearance::color_bin(rgb)];
  }

  bool is_hidden(Vec3d p, Vec3d n) const {
    if (!frame_.depth_m.data) return false;
    const double by = kAside_px * p.z / camera_.K.fx;
    for (const double k : {-1.0, 0.0, 1.0}) {
      const Vec3d at = p + (k * by) * n;
      if (!(at.z > 0)) return true;
      const Vec2d ideal = project(camera_.K, at), u = frame_.rays ? camera_.project_point(at) : ideal;
      if (!(u.x > -0.5 && u.y > -0.5 && u.x < camera_.width - 0.5 && u.y < camera_.height - 0.5)) continue;
      const double z = frame_.depth_m(static_cast<int>(u.x + 0.5), static_cast<int>(u.y + 0.5));
      if (!(z > 0) || z > p.z - in_front_m_) continue;
      float phi;
      Vec3f unused;
      sample(shape_.sdf, (T_obj_cam_ * (z * ray(camera_.K, ideal.x, ideal.y))).cast<float>(), &phi, &unused);
      if (static_cast<double>(phi) > in_front_m_) return true;
    }
    return false;
  }

  const frame::DepthFrame& frame_;
  const Camera& camera_;
  const frame::Shape& shape_;
  const Rigidd T_cam_obj_, T_obj_cam_;
  const energies::ColorProjection& view_;
  const float* posterior_;
  const float odds_, surest_;
  const int stride_, reach_;
  const double in_front_m_;
};

}  // namespace

int find_outline_lines(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                       const appearance::ColorModel& colors, const Rigidd& T_cam_obj,
                       const OutlineSearch& search, ContourLibrary* contours, energies::OutlineLines* out) {
  out->lines.clear();
  out->view = color_projection(camera, frame.color->map);
  const Vec3d eye = centre_of(out->view);  // the outline is that which the colour camera sees
  const double focal_px = std::sqrt(camera.K.fx * camera.K.fy);
  const LineMaker maker(frame, camera, shape, colors, T_cam_obj, search, out->view);
  const std::vector<ContourPoint>& points =
      contours->seen_from(inverse(T_cam_obj) * eye, shape, focal_px, search.points, kThickness_px);
  for (const ContourPoint& point : points) {
    energies::OutlineLine line;
    if (maker.make(point, &line)) out->lines.push_back(line);
  }
  return static_cast<int>(points.size());
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "frame/selection.h"

#include <algorithm>

#include "energies/term_ops.h"
#include "frame/point_ops.h"

namespace sdftrack::frame {

namespace {

constexpr float kPlaneTolerance_m = 0.005f;

// Keeps those of the n indices from `at` on where the mask is not 0.
int within_mask(const unsigned char* mask, int* at, int n) {
  int kept = 0;
  for (int k = 0; k < n; ++k)
    if (mask[at[k]]) at[kept++] = at[k];
  return kept;
}

}  // namespace

Lookout lookout_for(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                    const Rigidd& T_cam_obj, const DepthNoiseLaw& noise, double padding_m,
                    const Plane* plane) {
  const double reference = noise.at(T_cam_obj.t.z);
  const DepthRange range = depth_range(shape, T_cam_obj, padding_m);
  const auto pad = float(padding_m);
  return {projected_box(camera, shape, T_cam_obj, padding_m),
          {frame.measured_m(), frame.rays, camera.width, camera.K.cast<float>(),
           float(std::max(1e-3, range.near_m)), float(range.far_m), inverse(T_cam_obj).cast<float>(),
           shape.half_box_m.cast<float>() + Vec3f{pad, pad, pad},
           plane ? plane->normal_cam.cast<float>() : Vec3f{0, 0, 0}, plane ? float(plane->offset_m) : 0.0f,
           plane ? kPlaneTolerance_m : -1.0f},
          {float(noise.noise_m / reference), float(noise.noise_per_m / reference)}};
}

void PixelSelection::choose(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                            const Rigidd& T_cam_obj, const DepthNoiseLaw& noise, double padding_m,
                            const Plane* plane) {
  const Lookout lookout = lookout_for(frame, camera, shape, T_cam_obj, noise, padding_m, plane);
  const Rect& rect = lookout.rect;
  frame_ = frame, K_ = lookout.term.K, count_ = 0, noise_ = lookout.noise;
  if (rect.empty()) return;
  const PointOps& ops = point_ops_for(used_isa());
  const auto area = std::size_t(rect.x1 - rect.x0) * std::size_t(rect.y1 - rect.y0);
  if (at_.size() < area + energies::kLanes) at_.resize(area + energies::kLanes);  // a pack is stored whole
  for (int y = rect.y0; y < rect.y1; ++y) {
    int* const row = at_.data() + count_;
    const int found = ops.candidates(lookout.term, y, rect.x0, rect.x1, row);
    count_ += frame.mask ? within_mask(frame.mask, row, found) : found;
  }
}

void PixelSelection::pack(int requested, energies::PixelSet* out) const {
  const Spread spread = Spread::of(requested, count_);
  const int n = spread.requested;
  out->resize(n);
  const IdealPixel ideal{frame_, K_, frame_.depth_m.width};
  const float* const measured_m = frame_.measured_m();
  const int width = frame_.depth_m.width;
  int y = 0, next_row = width;  // of the current pixel
  for (int k = 0; k < n; ++k) {
    const int at = at_[spread.candidate(k)];
    while (at >= next_row) ++y, next_row += width;
    const Vec2f u = ideal(at - (next_row - width), y);
    const auto i = std::size_t(k);
    out->at[i] = at, out->u_px[i] = u.x, out->v_px[i] = u.y, out->depth_m[i] = measured_m[at];
  }
  for (std::size_t i = 0; i < std::size_t(n); ++i) {
    out->per_noise[i] = noise_.per_noise(out->depth_m[i]);
  }
  std::fill(out->foreground.begin(), out->foreground.end(), 0.0f);
  out->start_afresh();
}

}  // namespace sdftrack::frame

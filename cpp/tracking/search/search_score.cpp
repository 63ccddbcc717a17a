// SPDX-License-Identifier: MIT
#include "tracking/search/search_score.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::tracking {

namespace {

constexpr int kMinAgreeing = 6;  // surface points; fewer are not sufficient
constexpr double kExplained_m = 0.005, kExplainedPerNoise = 4;
constexpr double kEnoughSeen = 0.8;  // share of the visible surface that must be measured for a full score

double ratio(int part, int whole) { return whole > 0 ? static_cast<double>(part) / whole : 0.0; }

double unhidden(const Visibility& seen) {
  return seen.agree >= kMinAgreeing ? ratio(seen.agree, seen.agree + seen.farther) : 0.0;
}

}  // namespace

double explained_share(const SdfView& sdf, const std::vector<Vec3f>& readings_cam, const Rigidd& T_cam_obj,
                       double noise_m) {
  if (readings_cam.empty()) return 0;
  const Rigidf T_obj_cam = inverse(T_cam_obj).cast<float>();
  const auto tolerance = static_cast<float>(std::max(kExplained_m, kExplainedPerNoise * noise_m));
  int explained = 0;
  for (const Vec3f& p_cam : readings_cam) {
    float phi;
    Vec3f gradient;
    sample(sdf, T_obj_cam * p_cam, &phi, &gradient);
    explained += std::abs(phi) < tolerance && dot(gradient, T_obj_cam.R * p_cam) < 0;
  }
  return static_cast<double>(explained) / static_cast<double>(readings_cam.size());
}

double score_of_mask(const Visibility& seen, double explained) { return unhidden(seen) * explained; }

double score_of_place(const Visibility& seen, const Outline& outline) {
  const double read = ratio(seen.agree, seen.agree + seen.farther + seen.nearer);
  if (seen.agree < kMinAgreeing) return 0;
  return evidence_share({seen, outline, 1, 0, {}}, 0) * std::sqrt(std::min(1.0, read / kEnoughSeen));
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/search_score.h"

#include <algorithm>
#include <cmath>

namespace sdftrack {

namespace {

constexpr int kLeastAgreeing = 6;    // surface points; fewer say nothing
constexpr double kEnoughSeen = 0.4;  // share of the visible surface that must be read for a full score
double ratio(int part, int whole) { return whole > 0 ? static_cast<double>(part) / whole : 0.0; }

}  // namespace

double search_score(const Evidence& evidence) {
  const Visibility& seen = evidence.seen;
  if (seen.agree < kLeastAgreeing) return 0;
  const double unhidden = ratio(seen.agree, seen.agree + seen.farther);
  const double read = ratio(seen.agree, seen.agree + seen.farther + seen.nearer);
  if (evidence.all_object) return unhidden * evidence.explained;
  return unhidden * std::min(1.0, read / kEnoughSeen);
}

double explained_share(const SdfView& sdf, const std::vector<Vec3f>& readings_cam, const Rigidd& T_cam_obj,
                       double tolerance_m) {
  if (readings_cam.empty()) return 0;
  const Rigidf T_obj_cam = inverse(T_cam_obj).cast<float>();
  const auto tolerance = static_cast<float>(tolerance_m);
  int explained = 0;
  for (const Vec3f& p_cam : readings_cam) {
    float phi;
    Vec3f gradient;
    sample(sdf, T_obj_cam * p_cam, &phi, &gradient);
    explained += std::abs(phi) < tolerance && dot(gradient, T_obj_cam.R * p_cam) < 0;
  }
  return static_cast<double>(explained) / static_cast<double>(readings_cam.size());
}

}  // namespace sdftrack

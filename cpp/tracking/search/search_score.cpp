// SPDX-License-Identifier: MIT
#include "tracking/search/search_score.h"

#include <algorithm>
#include <cmath>

#include "frame/point_ops.h"

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
  const auto count = static_cast<int>(readings_cam.size());
  const frame::ExplainedTerm<float> term{
      {sdf, inverse(T_cam_obj).cast<float>()},
      {readings_cam.data(), count, 1},
      static_cast<float>(std::max(kExplained_m, kExplainedPerNoise * noise_m))};
  return static_cast<double>(frame::point_ops_for(used_isa()).explained(term)) / count;
}

double score_of_mask(const Visibility& seen, double explained) { return unhidden(seen) * explained; }

double score_of_place(const Visibility& seen, const Outline& outline) {
  const double read = ratio(seen.agree, seen.agree + seen.farther + seen.nearer);
  if (seen.agree < kMinAgreeing) return 0;
  return evidence_share({seen, outline, 1, 0, {}}, 0) * std::sqrt(std::min(1.0, read / kEnoughSeen));
}

}  // namespace sdftrack::tracking

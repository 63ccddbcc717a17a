// SPDX-License-Identifier: MIT
#include "contour/memory/templates.h"

#include "contour/memory/resampling.h"

namespace sdftrack::contour {

namespace {

constexpr float kEdge_px = 3;  // of kFrame: width of the transition between inside and outside, to each side
// Cost of a pixel of the background's colour inside, relative to one of the object's colour outside.
constexpr float kLacking = 0.6f;

}  // namespace

const std::array<Stage, 2>& stored_stages() {
  static const std::array<Stage, 2> stages = {
      Stage{4, 2, {{0, 0}, {-0.08, 0}, {0.08, 0}}},
      Stage{2, 1, {{0, 0}, {-0.05, 0}, {0.05, 0}, {0, -0.06}, {0, 0.06}}}};
  return stages;
}

const std::array<Stage, 2>& last_stages() {
  static const std::array<Stage, 2> stages = {
      Stage{1, 2, {{0, 0}}}, Stage{1, 0, {{0, 0}, {-0.02, 0}, {0.02, 0}, {0, -0.03}, {0, 0.03}}}};
  return stages;
}

std::vector<float> template_of(const Picture& phi, const Stage& stage) {
  const float per_edge = float(kFrame) / float(phi.width) / kEdge_px;
  Picture soft = each<float>(phi, [per_edge](float d) { return std::clamp(d * per_edge, -1.0f, 1.0f); });
  if (phi.width != kFrame) soft = resized(soft, kFrame, kFrame);
  const Picture outside = each<float>(soft, [](float s) { return std::max(s, 0.0f) - 1; });
  const Picture within = each<float>(soft, [](float s) { return kLacking * std::max(-s, 0.0f); });
  std::vector<float> out = block_means(outside, stage.block).values;
  const Picture second = block_means(within, stage.block);
  out.insert(out.end(), second.values.begin(), second.values.end());
  return out;
}

}  // namespace sdftrack::contour

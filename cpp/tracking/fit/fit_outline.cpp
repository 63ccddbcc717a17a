// SPDX-License-Identifier: MIT
// A fit to the outline in the colour image alone.
#include <algorithm>
#include <array>

#include "tracking/fit/fit.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kMinLines = 20;
constexpr double kMinShare = 0.2;  // of the evaluated places
constexpr int kSteps = 5, kNearRounds = 4;
constexpr double kSettled_px = 0.2;

}  // namespace

// First along wide lines, then along narrow ones, which are made again at the new pose: there they lie where
// the outline at that pose does.
std::optional<Fitted> PoseFitter::fit_outline(const frame::DepthFrame& frame, const Camera& camera,
                                              const FitTarget& target, double* share) {
  camera_ = &camera, target_ = &target;
  view_.open_without_depth(frame, camera, target);
  Fitted fitted = blank();
  optim::State& x = state_;
  begin_at(target.expected, &x);
  const int far = options_.outline_far_px, near = options_.outline_reach_px;
  std::array<int, 2 + kNearRounds> reaches;
  reaches.fill(near);
  reaches[0] = std::max(far, near), reaches[1] = std::max((far + near) / 2, near);
  for (std::size_t k = 0; k < reaches.size(); ++k) {
    const Rigidd before = inverse(x.T_obj_cam[0]);
    const int looked_at = view_.read_outline(before, reaches[k]);
    const std::size_t lines = view_.outline_lines().lines.size();
    *share = looked_at > 0 ? double(lines) / looked_at : 0;
    if (lines < kMinLines || *share < kMinShare) return std::nullopt;
    energies::OutlineEnergy outline = view_.outline_energy(fitted.memory, kCommonError_px);
    optim::PosePrior prior({1, false, false}, 0, inverse(target.expected), target.prior);
    sum_.clear();
    sum_.add(&outline, 1 / FitView::shared_lines(fitted.memory));
    if (target.prior.diagonal().maxCoeff() > 0) sum_.add(&prior);
    optim::LmOptions lm;
    lm.max_steps = kSteps, lm.damping = 1e-6, lm.block = 6;
    lm_result_.x = x;
    optim::minimize(sum_, lm, &lm_work_, &lm_result_);
    for (const optim::LmStep& step : lm_result_.steps) fitted.steps.push_back({step, 0, int(lines)});
    x = lm_result_.x;
    fitted.cost = lm_result_.count > 0 ? lm_result_.cost / lm_result_.count : 0;
    if (reaches[k] == near && moved_px(before, inverse(x.T_obj_cam[0])) < kSettled_px) break;
  }
  fitted.T_cam_obj = inverse(x.T_obj_cam[0]);
  view_.measure_outline_pose(x, &fitted);
  return fitted;
}

}  // namespace sdftrack::tracking

// SPDX-License-Identifier: MIT
#include "tracking/finder.h"

#include <algorithm>

#include "tracking/outline.h"

namespace sdftrack {

namespace {

constexpr std::size_t kFitted = 3;   // hypotheses worth a fit at full resolution
constexpr double kComparable = 0.9;  // of the best score
constexpr double kTie = 0.97;        // scores this close are told apart by the last rotation, if by anything
constexpr double kAmbiguous = 0.95;

// Among hypotheses that tie with the first, the one nearest in rotation goes first.
void prefer_rotation(const Mat3d& R, std::vector<Hypothesis>* hypotheses) {
  const double least = kTie * hypotheses->front().score;
  auto best = hypotheses->begin();
  for (auto h = hypotheses->begin(); h != hypotheses->end() && h->score >= least; ++h)
    if (rotation_angle(transpose(R) * h->T_cam_obj.R) < rotation_angle(transpose(R) * best->T_cam_obj.R))
      best = h;
  std::rotate(hypotheses->begin(), best, best + 1);
}

// How much better seen than contradicted.
double balance(const Visibility& seen) {
  return seen.expected > 0 ? static_cast<double>(seen.agree - seen.farther) / seen.expected : 0.0;
}

constexpr double kLeastEnds = 0.3;  // of the outline that is not hidden
constexpr int kEnoughOutline = 6;   // directions; fewer say nothing

// A face in a wall, a small object in a larger one: all that is seen agrees, but nothing ends where it
// should.
bool is_part_of_something(const Outline& outline) {
  const int known = outline.ends + outline.runs_on;
  return known >= kEnoughOutline && outline.ends < kLeastEnds * known;
}

void doubt(double runner_up, Trust* trust) {
  if (runner_up < kAmbiguous || trust->status == Status::kLost) return;
  trust->confidence /= 1 + runner_up;
  if (trust->status != Status::kOk) return;
  trust->status = Status::kWeak;
  trust->reason = "ambiguous: another pose explains the view nearly as well";
}

}  // namespace

std::optional<Found> ObjectFinder::find(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                                        const FitMemory& memory, const ColorModel* colors,
                                        const SearchQuery& query, PoseFitter* fitter) {
  std::vector<Hypothesis> hypotheses =
      search_pose(frame, camera, shape, options_, query, threads_, &scratch_);
  if (hypotheses.empty()) return std::nullopt;
  if (query.near) prefer_rotation(query.near->R, &hypotheses);

  std::optional<Found> best;
  const double least = kComparable * hypotheses.front().score;
  for (std::size_t k = 0; k < std::min(kFitted, hypotheses.size()); ++k) {
    const Hypothesis& h = hypotheses[k];
    if (h.score < least) continue;
    const FitTarget target{shape, h.T_cam_obj, Matrix6d::Zero(), memory, colors};
    const Attempt attempt{options_.scale_start_m, options_.padding_m, options_.coarse_steps, {h.T_cam_obj}};
    std::optional<Fitted> fitted = fitter->fit(frame, camera, target, attempt, query.plane);
    if (!fitted) continue;
    if (best && balance(fitted->seen) <= balance(best->fitted.seen) + (query.near ? 1 - kTie : 0)) continue;
    const Trust trust = judge(fitted->seen, fitted->cost, fitted->covariance, options_);
    const double noise_m = fitted->memory.noise_factor * sensor_noise_m(options_, fitted->T_cam_obj.t.z);
    if (is_part_of_something(compare_outline(frame, camera, shape, fitted->T_cam_obj, noise_m))) continue;
    const Hypothesis* other = k > 0 ? &hypotheses[0] : hypotheses.size() > 1 ? &hypotheses[1] : nullptr;
    best = Found{std::move(*fitted), trust, other && h.score > 0 ? other->score / h.score : 0};
  }
  if (best && !query.near) doubt(best->runner_up, &best->trust);
  return best;
}

}  // namespace sdftrack

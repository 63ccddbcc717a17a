// SPDX-License-Identifier: MIT
#include "tracking/finder.h"

#include <algorithm>
#include <array>

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

// The fits of the best hypotheses, in their order, with how well each is seen.
struct Candidates {
  std::array<std::optional<Fitted>, kFitted> fits;
  std::array<double, kFitted> quality{};
  std::size_t count = 0;

  void add(Fitted fitted, const TrackerOptions& options) {
    quality[count] = std::max(0.0, fit_quality(fitted, options));
    fits[count++] = std::move(fitted);
  }
  // The first that no other beats by more than a tie.
  std::size_t best(double tie) const {
    std::size_t k = 0;
    for (std::size_t i = 1; i < count; ++i)
      if (tie * quality[i] > quality[k]) k = i;
    return k;
  }
  // Quality of the best other pose over that of k; 0: all ended where k did.
  double runner_up(std::size_t k) const {
    double most = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (quality[k] > 0 && distinct(fits[i]->T_cam_obj, fits[k]->T_cam_obj))
        most = std::max(most, quality[i] / quality[k]);
    }
    return std::min(1.0, most);
  }
};

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
                                        const SearchQuery& query, double prior_log_odds, PoseFitter* fitter) {
  std::vector<Hypothesis> hypotheses =
      search_pose(frame, camera, shape, options_, query, threads_, &scratch_);
  if (hypotheses.empty()) return std::nullopt;
  if (query.near) prefer_rotation(query.near->R, &hypotheses);

  Candidates all;
  const double least = kComparable * hypotheses.front().score;
  for (std::size_t k = 0; k < hypotheses.size() && all.count < kFitted && hypotheses[k].score >= least; ++k) {
    const Rigidd& T = hypotheses[k].T_cam_obj;
    const FitTarget target{shape, T, Matrix6d::Zero(), memory, colors};
    const Attempt attempt{options_.scale_start_m, options_.padding_m, options_.coarse_steps, {T}};
    std::optional<Fitted> fitted = fitter->fit(frame, camera, target, attempt, query.plane);
    if (!fitted) continue;
    if (is_part_of_something(fitted->outline)) continue;
    all.add(std::move(*fitted), options_);
  }
  if (all.count == 0) return std::nullopt;

  const std::size_t best = all.best(query.near ? kTie : 1);
  const Fitted& fitted = *all.fits[best];
  Found found{fitted, judge(fitted, options_, prior_log_odds), all.runner_up(best)};
  for (const Hypothesis& h : hypotheses)  // those that were not worth a fit
    if (h.score < least) found.runner_up = std::max(found.runner_up, h.score / hypotheses.front().score);
  if (!query.near) doubt(found.runner_up, &found.trust);
  return found;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "tracking/search/finder.h"

#include <algorithm>
#include <cmath>

#include "tracking/trust/outline.h"

namespace sdftrack::tracking {

namespace {

// Hypotheses worth a fit at full resolution: their number, and their share of the best score. In a mask the
// measurements are the object's, and the score is nearly sufficient; elsewhere the fit tells clutter from the
// object.
constexpr std::size_t kFittedInMask = 3, kFitted = 5;
constexpr double kComparableInMask = 0.85, kComparable = 0.3;
constexpr double kTie = 0.97;          // scores this close are told apart only by the last rotation
constexpr double kMinEndsThere = 0.1;  // where the place of the object is given, with whatever it touches
constexpr double kAmbiguous = 0.8;
constexpr double kAnyTurn = 0.02;  // least probability of a turn

// Moves the hypothesis nearest in rotation to the front, among those that tie with the first.
void prefer_rotation(const Mat3d& R, std::vector<Hypothesis>* hypotheses) {
  const double least = kTie * hypotheses->front().score;
  auto best = hypotheses->begin();
  for (auto h = hypotheses->begin(); h != hypotheses->end() && h->score >= least; ++h)
    if (rotation_angle(transpose(R) * h->T_cam_obj.R) < rotation_angle(transpose(R) * best->T_cam_obj.R))
      best = h;
  std::rotate(hypotheses->begin(), best, best + 1);
}

// A recently lost object has hardly turned since: the score of each hypothesis is weighted by the probability
// of its turn from the last rotation, normal with `sd_rad`.
void weigh_turns(const Mat3d& R, double sd_rad, std::vector<Hypothesis>* hypotheses) {
  for (Hypothesis& h : *hypotheses) {
    const double turn = rotation_angle(transpose(R) * h.T_cam_obj.R) / sd_rad;
    h.score *= std::max(kAnyTurn, std::exp(-0.5 * turn * turn));
  }
  std::stable_sort(hypotheses->begin(), hypotheses->end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
}

double odds(double chance) { return chance / std::max(1e-9, 1 - chance); }

// A hypothesis after its fit.
struct Candidate {
  std::size_t hypothesis;
  Fitted fitted;
  double quality;
};

// The first candidate that no other beats by more than a tie.
std::size_t best_of(const std::vector<Candidate>& all, double tie) {
  std::size_t k = 0;
  for (std::size_t i = 1; i < all.size(); ++i)
    if (tie * all[i].quality > all[k].quality) k = i;
  return k;
}

// Score of the best other pose over that of the chosen one; 0: all fits ended at the chosen pose.
// alternatives: motions to the poses that nearly reach it.
double runner_up(const std::vector<Hypothesis>& hypotheses, const std::vector<Candidate>& all,
                 std::size_t chosen, const SearchQuery& query, std::vector<Rigidd>* alternatives) {
  const Rigidd& T = all[chosen].fitted.T_cam_obj;
  const double own = hypotheses[all[chosen].hypothesis].score;
  double most = 0;
  for (std::size_t h = 0; h < hypotheses.size(); ++h) {
    const auto fit =
        std::find_if(all.begin(), all.end(), [&](const Candidate& c) { return c.hypothesis == h; });
    const Rigidd& other = fit != all.end() ? fit->fitted.T_cam_obj : hypotheses[h].T_cam_obj;
    if (!looks_distinct(other, T, query.symmetries)) continue;
    most = std::max(most, hypotheses[h].score);
    if (hypotheses[h].score >= query.alike * own) alternatives->push_back(inverse(T) * other);
  }
  return own > 0 ? std::min(1.0, most / own) : 1.0;
}

void doubt(double runner_up, Trust* trust) {
  if (runner_up < kAmbiguous || trust->status == Status::kLost) return;
  trust->confidence /= 1 + runner_up;
  if (trust->status != Status::kOk) return;
  trust->status = Status::kWeak;
  trust->reason = {ReasonCode::kAmbiguous};
}

}  // namespace

bool looks_distinct(const Rigidd& a, const Rigidd& b, const std::vector<Rigidd>* symmetries) {
  if (!distinct(a, b)) return false;
  return !symmetries || std::none_of(symmetries->begin(), symmetries->end(),
                                     [&](const Rigidd& S) { return !distinct(a, b * S); });
}

ObjectFinder::ObjectFinder(const TrackerOptions& options, int threads, energies::CudaWork* device)
    : options_(options),
      threads_(threads),
      device_(device ? std::make_unique<frame::PointsOnDevice>(device) : nullptr) {}

std::optional<Found> ObjectFinder::find(const frame::DepthFrame& frame, const Camera& camera,
                                        const frame::Shape& shape, const FitMemory& memory,
                                        const appearance::ColorModel* colors, const SearchQuery& query,
                                        double prior_log_odds, PoseFitter* fitter) {
  std::vector<Hypothesis> hypotheses =
      search_pose(frame, camera, shape, options_, query, threads_, &scratch_, device_.get());
  if (hypotheses.empty()) return std::nullopt;
  if (query.last_rotation) weigh_turns(*query.last_rotation, query.turn_sd_rad, &hypotheses);
  if (query.near) prefer_rotation(query.near->R, &hypotheses);

  std::vector<Candidate> all;
  FitMemory known = memory;
  const double min_ends = query.mask || query.box ? kMinEndsThere : kMinEnds;
  const double least = (query.mask ? kComparableInMask : kComparable) * hypotheses.front().score;
  const std::size_t most = query.mask ? kFittedInMask : kFitted;
  for (std::size_t k = 0; k < hypotheses.size() && all.size() < most && hypotheses[k].score >= least; ++k) {
    const Rigidd& T = hypotheses[k].T_cam_obj;
    const FitTarget target{shape, T, Matrix6d::Zero(), known, colors, query.others};
    const Attempt attempt{0, options_.padding_m, 0, {T}};  // the search has already come near
    std::optional<Fitted> fitted = fitter->fit(frame, camera, target, attempt, query.plane);
    if (!fitted) continue;
    if (is_part_of_something(fitted->outline, min_ends)) continue;
    if (query.others && stands_in(*query.others, shape, fitted->T_cam_obj)) continue;
    if (!known.noise_known) known = fitted->memory;  // the others are compared under the same noise
    // Score and evidence count partly the same points: hence the root of the evidence's odds.
    const double evidence = evidence_share(evidence_of(*fitted, options_), prior_log_odds);
    const double fit = query.mask ? std::max(0.0, fit_quality(*fitted, options_)) : std::sqrt(odds(evidence));
    const double quality = hypotheses[k].score * fit;
    all.push_back({k, std::move(*fitted), quality});
  }
  if (all.empty()) return std::nullopt;

  const std::size_t chosen = best_of(all, query.near ? kTie : 1);
  const Fitted& fitted = all[chosen].fitted;
  Found found{fitted, judge(fitted, options_, prior_log_odds), 0, {}};
  found.runner_up = runner_up(hypotheses, all, chosen, query, &found.alternatives);
  if (!query.near) doubt(found.runner_up, &found.trust);
  return found;
}

}  // namespace sdftrack::tracking

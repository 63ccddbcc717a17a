// SPDX-License-Identifier: MIT
#include "primitives/fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plane/plane.h"
#include "primitives/bounds.h"

namespace sdftrack::primitives {

namespace {

constexpr double kVague = 0.25;           // a length with a larger relative sd, or an exponent, is not known
constexpr std::size_t kTried = 4;         // guesses that are fitted
constexpr std::size_t kRefined = 2;       // guesses that are refined
constexpr std::size_t kMoreOfFew = 5;     // times as many of both for few points: more local minima
constexpr std::size_t kMoreOfShapes = 4;  // times as many of both where exponents are unknown
constexpr double kLogisticOfSd = 0.5513;  // sqrt(3) / pi: s of a density with sd 1
constexpr double kMadToSd = 1.4826;
constexpr double kMinScale_m = 2e-4, kMaxScale_m = 0.004;
constexpr double kFirstScale_m = 0.01;
constexpr double kFirstScale = 0.04;                        // of the diameter, where this is larger
constexpr double kWrongLabels = 0.05;                       // share of outline pixels with a wrong label
constexpr double kOutlines_px[] = {0.5, 0.35, 0.25, 0.15};  // scales of a lost and a clean edge
constexpr double kThinPart = 0.08;                          // of the diameter
constexpr double kFarthest = 2;                             // of the diameter: limit of all lengths
constexpr double kAtLimit = 0.97;                           // of that limit
// sd of the gap between an object and its table, whose plane is known to 0.01 to 0.03 mm.
constexpr double kStanding_m = 1e-4, kStanding = 0.2;  // m, and of the measurements' scale
// A round body within 10 degrees of standing on its base, or a cylinder of lying on its side, is also fitted
// in that position, which is kept unless it costs more than kFlat nats. In 800 views of standing solids it
// cost at most 9; for 8 real cylinders whose table the sensor bends by 0.3 to 1.3 degrees, 18 or more.
constexpr double kUpright = 0.985, kLying = 0.174, kFlat = 12;
constexpr double kRough = 0.3;  // nats: the least gain that a step of an early stage must promise
constexpr double kLittle = 0.003, kSure = 0.1;  // nats: a step that gains less moves no unknown by 0.1 sd

bool has_exponents(PrimitiveKind kind) { return kind == PrimitiveKind::kSuperquadric; }

// How many times as many guesses are fitted and refined.
std::size_t effort(PrimitiveKind kind, const SeedCloud& cloud) {
  return cloud.sparse ? kMoreOfFew : has_exponents(kind) ? kMoreOfShapes : 1;
}

struct Candidate {
  optim::State x;
  double cost;
};

optim::State state_of(PrimitiveKind kind, const PrimitiveGuess& guess) {
  optim::State x;
  x.T_obj_cam = {guess.T_obj_cam};
  for (int i = 0; i < size_count(kind); ++i) x.log_size.push_back(std::log(guess.size[i]));
  return x;
}

class Fitter {
 public:
  Fitter(PrimitiveKind kind, const PrimitiveView& view, const PrimitiveFitOptions& options,
         const SeedCloud& cloud)
      : kind_(kind),
        view_(view),
        options_(options),
        diameter_m_(cloud.diameter_m),
        first_m_(std::max(kFirstScale_m, kFirstScale * cloud.diameter_m)),
        tried_(effort(kind, cloud) * kTried),
        refined_(effort(kind, cloud) * kRefined),
        few_(cloud.sparse),
        crowded_(!has_inside(kind)) {}

  PrimitiveEnergyOptions energy(double scale_m, double outline_px, int points, int rays) const {
    PrimitiveEnergyOptions e;
    e.scaling = options_.scaling, e.unit_m = diameter_m_;
    e.scale_m = scale_m, e.outline_scale_px = outline_px;
    e.points = std::min(points, options_.max_points), e.rays = std::min(rays, options_.max_rays);
    e.outline_floor = outline_px > 1 ? 0.0 : kWrongLabels;
    e.thin_m = has_inside(kind_) ? kThinPart * diameter_m_ : 0;  // a narrow strip is a valid patch
    e.far_m = kFarthest * diameter_m_;
    e.crowded = crowded_ && !view_.along_rays;
    if (!per_noise_.empty()) e.per_noise = per_noise_.data();
    e.standing_sigma_m = std::max(kStanding_m, kStanding * scale_m);
    return e;
  }

  double cost(const optim::State& x, const PrimitiveEnergyOptions& e) const {
    return PrimitiveEnergy(kind_, &view_, e).cost(x);
  }

  void improve(const PrimitiveEnergyOptions& e, int trials, bool rigid, Candidate* c, bool rough = true) {
    PrimitiveEnergy energy(kind_, &view_, e);
    optim::LmOptions lm;
    lm.max_steps = trials, lm.cost_gain = rough ? kRough : kLittle;
    if (!rough) lm.sure_gain = kSure;
    lm.fixed.assign(energy.unknowns().size(), false);
    for (std::size_t i = 0; i < c->x.log_size.size(); ++i) lm.fixed[6 + i] = rigid;
    optim::LmResult& result = result_;
    result.x = c->x;
    optim::minimize(energy, lm, &work_, &result);
    steps_ += int(result.steps.size());
    c->x = result.x, c->cost = result.cost;
  }

  // Keeps the best few by the energy `e`.
  void sieve(const PrimitiveEnergyOptions& e, std::size_t kept, std::vector<Candidate>* all) const {
    for (Candidate& c : *all) {
      c.cost = cost(c.x, e);
      if (!std::isfinite(c.cost)) c.cost = std::numeric_limits<double>::max();
    }
    std::stable_sort(all->begin(), all->end(),
                     [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    if (all->size() > kept) all->resize(kept);
  }

  // s from the residuals' spread, by their median, which is robust to outliers.
  double own_scale(const optim::State& x, int points) const {
    std::vector<double> r;
    PrimitiveEnergy(kind_, &view_, energy(1, 1, points, 0)).residuals(x, &r);
    for (double& m : r) m = std::abs(m);
    // A fit can bring as many residuals as there are unknowns to 0; these do not show the spread. For few
    // points: the median of the others.
    std::size_t at = r.size() / 2;
    if (few_) at = std::min(r.size() - 1, (r.size() + std::size_t(free_count(kind_))) / 2);
    const auto middle = r.begin() + std::ptrdiff_t(at);
    std::nth_element(r.begin(), middle, r.end());
    return std::clamp(kLogisticOfSd * kMadToSd * *middle, kMinScale_m, kMaxScale_m);
  }

  Candidate coarse(std::vector<Candidate> all, bool is_given) {
    const double s = first_m_;
    if (!is_given) {
      sieve(energy(s, 4, 120, 60), 3 * tried_, &all);
      sieve(energy(0.6 * s, 3, 300, 100), tried_, &all);
    }
    for (Candidate& c : all) {
      if (!is_given) improve(energy(s, 4, 300, 120), 3, true, &c);  // rigid, at an arbitrary size
      improve(energy(0.7 * s, 4, 300, 120), 6, false, &c);
    }
    sieve(energy(0.4 * s, 2, 500, 200), refined_, &all);
    for (Candidate& c : all) {
      improve(energy(0.4 * s, 2, 500, 200), 8, false, &c);
      improve(energy(0.2 * s, 1, 700, 300), 8, false, &c);
    }
    sieve(energy(0.2 * s, 1, 700, 300), 1, &all);
    return all.front();
  }

  // The width of the outline, estimated from its pixels. Too large a width pulls in the tip of a cone, where
  // more pixels lie next to the solid than on it.
  double own_outline_px(const optim::State& x) const {
    double best_px = kOutlines_px[0], least = std::numeric_limits<double>::infinity();
    const std::vector<double> d = PrimitiveEnergy(kind_, &view_, energy(1, 1, 0, 600)).clearances(x);
    for (const double px : kOutlines_px) {
      const double cost = PrimitiveEnergy(kind_, &view_, energy(1, px, 0, 600)).outline_cost(d);
      if (cost < least) least = cost, best_px = px;
    }
    return best_px;
  }

  // Energy options of the last steps.
  PrimitiveEnergyOptions fine(Candidate* best) {
    crowded_ = true;  // a solid may need to grow until then
    double s = own_scale(best->x, 700);
    PrimitiveEnergy(kind_, &view_, energy(1, 1, options_.max_points, 0)).slants(best->x, &per_noise_);
    improve(energy(s, 0.7, 1500, 600), 10, false, best, false);
    s = own_scale(best->x, 1500);
    PrimitiveEnergyOptions last = energy(s, own_outline_px(best->x), options_.max_points, options_.max_rays);
    improve(last, 10, false, best, false);
    last.rest = lay_flat(last, best);
    return last;
  }

  // The part of a round body that lies on the table; `best` is changed accordingly. No object stands on one
  // point of a rim, but measurements leave the axis uncertain. The lowest point of a base that is estimated
  // to be tilted by w is lower than its centre by R w: with that point held to the table, cones came out low.
  Rest lay_flat(PrimitiveEnergyOptions e, Candidate* best) {
    if (!is_round(kind_) || !view_.has_plane || !view_.stands) return Rest::kPoint;
    const double up = (best->x.T_obj_cam[0].R * view_.plane.normal_cam).z;
    const bool two_bases = !has_apex(kind_);
    if (two_bases && std::abs(up) < kLying)
      e.rest = Rest::kSide;
    else if (up > kUpright || (two_bases && up < -kUpright))
      e.rest = Rest::kBase;
    else
      return Rest::kPoint;
    Candidate flat = *best;
    improve(e, 10, false, &flat, false);
    if (!(flat.cost < best->cost + kFlat)) return Rest::kPoint;
    // An object of another kind may cost less from here and still not lie flat.
    const double z = (flat.x.T_obj_cam[0].R * view_.plane.normal_cam).z;
    const double off =
        (e.rest == Rest::kSide ? z * z : 1 - z * z) / (e.resting_sigma_rad * e.resting_sigma_rad);
    if (0.5 * off > kFlat) return Rest::kPoint;
    *best = flat;
    return e.rest;
  }

  optim::LmWork* work() { return &work_; }
  int steps() const { return steps_; }

 private:
  PrimitiveKind kind_;
  const PrimitiveView& view_;
  const PrimitiveFitOptions& options_;
  double diameter_m_, first_m_;
  std::size_t tried_, refined_;
  bool few_, crowded_;
  std::vector<float> per_noise_;
  optim::LmWork work_;
  optim::LmResult result_;
  int steps_ = 0;
};

}  // namespace

void count_inliers(const PrimitiveView& view, const PrimitiveFitOptions& options, PrimitiveFit* fit) {
  PrimitiveEnergyOptions e;
  e.points = options.max_points, e.rays = options.max_rays;
  std::vector<double> r;
  const PrimitiveEnergy energy(fit->kind, &view, e);
  energy.residuals(fit->x, &r);
  fit->outline = energy.outline_agreement(fit->x);
  double squares = 0, inside = 0;
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double tolerance = view.along_rays ? plane::plane_tolerance_m(options.tolerance_m, view.points[i].z)
                                             : options.tolerance_m;
    if (!(std::abs(r[i]) < tolerance)) continue;
    squares += r[i] * r[i], inside += 1;
  }
  fit->inliers = inside / double(std::max<std::size_t>(1, r.size()));
  fit->rms_m = inside > 0 ? std::sqrt(squares / inside) : std::numeric_limits<double>::quiet_NaN();
}

PrimitiveSize PrimitiveFit::size() const {
  PrimitiveSize out;
  out.fill(1);
  for (std::size_t i = 0; i < x.log_size.size(); ++i) {
    out[i] = std::exp(x.log_size[i]);
    // The penalty beyond its limits leaves an exponent there within a hundredth.
    if (!is_length(kind, int(i))) out[i] = std::clamp(out[i], sdf::kLeastExponent, sdf::kMostExponent);
  }
  return out;
}

PrimitiveFit fit_primitive(PrimitiveKind kind, const PrimitiveView& view, const SeedCloud& cloud,
                           const PrimitiveFitOptions& options, const PrimitiveGuess* initial) {
  PrimitiveFit fit;
  fit.kind = kind;
  Fitter fitter(kind, view, options, cloud);
  std::vector<Candidate> all;
  if (initial)
    all.push_back({state_of(kind, *initial), 0});
  else
    for (const PrimitiveGuess& guess : guesses(kind, cloud, options.seed))
      all.push_back({state_of(kind, guess), 0});
  if (all.empty()) return fit;
  Candidate best = fitter.coarse(std::move(all), initial != nullptr);
  if (has_exponents(kind) && !initial) {
    // Other shapes about the one found: octahedra and prisms are nearly the same with other axes and
    // exponents.
    std::vector<PrimitiveGuess> others;
    fit.x = best.x;
    reshape_superquadric(cloud, {best.x.T_obj_cam[0], fit.size()}, &others);
    all.clear();
    for (const PrimitiveGuess& guess : others) all.push_back({state_of(kind, guess), 0});
    const Candidate other = fitter.coarse(std::move(all), false);
    if (other.cost < best.cost) best = other;
  }
  const PrimitiveEnergyOptions last = fitter.fine(&best);
  fit.x = best.x, fit.steps = fitter.steps(), fit.scale_m = last.scale_m, fit.unit_m = last.unit_m;
  fit.freedom = int(std::min(view.points.size(), std::size_t(last.points)) +
                    std::min(view.outline.size(), std::size_t(last.rays))) +
                (view.stands ? 1 : 0) - free_count(kind);
  fit.covariance = fit_covariance(view, last, fit, cloud.diameter_m);
  PrimitiveEnergyOptions doubtful = last;  // a sharp outline turns misfits of a wrong kind into evidence
  doubtful.outline_scale_px = kOutlines_px[0];
  find_bounds(view, doubtful, fitter.work(), &fit);
  for (int i = 0; i < size_count(kind); ++i) {
    const auto at = std::size_t(i);
    fit.far[at] = is_length(kind, i) && fit.x.log_size[at] > std::log(kAtLimit * last.far_m);
    const double vague = is_length(kind, i) ? kVague : kVague / fit.size()[at];
    if (!(fit.covariance(6 + i, 6 + i) < vague * vague) || fit.freedom <= kFreedomWithoutMean || fit.far[at])
      fit.bounded[at] = false;
  }
  count_inliers(view, options, &fit);
  fit.found = std::isfinite(best.cost);
  return fit;
}

}  // namespace sdftrack::primitives

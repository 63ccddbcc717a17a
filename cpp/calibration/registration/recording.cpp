// SPDX-License-Identifier: MIT
#include "calibration/registration/recording.h"

#include <algorithm>
#include <cmath>

#include "base/portable_math.h"
#include "calibration/registration/first_map.h"

namespace sdftrack::calibration {

namespace {

constexpr double kStaticShare = 0.4;  // of the frames in which the same place shows something round
constexpr double kLeastStatic = 5;    // frames
constexpr double kLateBand_px = 40;   // tolerance when choosing candidates while colour may be late, at 1 m/s
constexpr int kMapRounds = 6;         // of centres under the last colour camera, and maps from them
constexpr double kSettled_px = 0.003;
constexpr double kMinKept = 0.5;
constexpr std::size_t kLeastKept = 4;

// The colour camera that a projective map implies; `before` if that is not a plausible camera.
Camera camera_of(const DepthToColor& map, const Camera& before) {
  const std::optional<CameraAndPlace> found = decompose(map.M());
  if (!found) return before;
  const double fx = found->K(0, 0), fy = found->K(1, 1), cx = found->K(0, 2), cy = found->K(1, 2);
  const int w = before.width, h = before.height, side = std::max(w, h);
  const bool usual = 0.3 * side < fx && fx < 4 * side && 0.5 < fx / fy && fx / fy < 2 && -0.5 * w < cx &&
                     cx < 1.5 * w && -0.5 * h < cy && cy < 1.5 * h;
  return usual ? Camera{{fx, fy, cx, cy}, w, h, {}} : before;
}

double largest_move(const BallPairs& a, const BallPairs& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (const double off : {a[i].color_px.x - b[i].color_px.x, a[i].color_px.y - b[i].color_px.y})
      if (std::abs(off) > most) most = std::abs(off);  // an outline without a cone counts as not moved
  return most;
}

}  // namespace

void BallRecording::sort_moving_first(double radius_m) {
  std::vector<Vec3d> centers;
  std::size_t with_balls = 0;
  for (const ObservedFrame& f : frames_) {
    with_balls += !f.balls.empty();
    for (const DepthBall& b : f.balls) centers.push_back(b.center_cam);
  }
  const double limit = std::max(kLeastStatic, kStaticShare * double(with_balls));
  const auto stands = [&](const DepthBall& ball) {
    const auto near = std::count_if(centers.begin(), centers.end(),
                                    [&](Vec3d c) { return norm(c - ball.center_cam) < 0.5 * radius_m; });
    return double(near) > limit;
  };
  for (ObservedFrame& f : frames_) {
    std::stable_sort(f.balls.begin(), f.balls.end(),
                     [](const DepthBall& a, const DepthBall& b) { return a.share > b.share; });
    std::stable_partition(f.balls.begin(), f.balls.end(), [&](const DepthBall& b) { return !stands(b); });
  }
}

BallRecording::Picks BallRecording::first_picks() const {
  Picks out;
  for (const ObservedFrame& f : frames_)
    if (!f.balls.empty() && !f.outlines.empty()) out.push_back({&f, 0, 0});
  return out;
}

BallPairs BallRecording::pairs_of(const Picks& picks, const Camera& color) {
  BallPairs out;
  for (const Pick& pick : picks) {
    const DepthBall& ball = pick.frame->balls[pick.ball];
    const Outline& outline = pick.frame->outlines[pick.outline];
    BallPair pair;
    pair.index = pick.frame->index, pair.time_s = pick.frame->time_s;
    pair.center_cam = ball.center_cam, pair.center_covariance = ball.covariance;
    pair.radius_px = outline.radius_px;
    if (const std::optional<Cone> cone = outline.cone(color))
      pair.color_px = cone->center_px, pair.color_covariance = cone->covariance_px;
    out.push_back(pair);
  }
  return out;
}

BallPairs BallRecording::pairs(const Camera& color) const { return pairs_of(first_picks(), color); }

// In each frame the two candidates that are closest under the map.
BallRecording::Picks BallRecording::picked_again(const Picks& picks, const DepthToColor& map,
                                                 const Camera& color, bool time_offset) const {
  Picks out = picks;
  for (Pick& pick : out) {
    const ObservedFrame& f = *pick.frame;
    if (f.balls.size() == 1 && f.outlines.size() == 1) continue;
    double least = time_offset ? kLateBand_px : kBand_px;
    for (std::size_t b = 0; b < f.outlines.size(); ++b) {
      const std::optional<Cone> cone = f.outlines[b].cone(color);
      if (!cone) continue;
      for (std::size_t a = 0; a < f.balls.size(); ++a) {
        const Vec2d px = map.pixel(f.balls[a].center_cam);
        const double off = hypotenuse(px.x - cone->center_px.x, px.y - cone->center_px.y);
        if (off < least) least = off, pick.ball = a, pick.outline = b;
      }
    }
  }
  return out;
}

// The path of the picked balls; frames without colour are used, rejected pairs are not.
BallPath BallRecording::path_of(const Picks& picks, const MapFit& fit) const {
  std::vector<TimedPoint> points;
  auto pick = picks.begin();
  for (const ObservedFrame& f : frames_) {
    const bool paired = pick != picks.end() && pick->frame == &f;
    if (paired) {
      const auto k = std::size_t(pick - picks.begin());
      // A pair outside the path has no residual, but is not wrong for that reason.
      if (fit.kept[k] || !is_finite(fit.residual_px[k]))
        points.push_back({f.time_s, f.balls[pick->ball].center_cam});
      ++pick;
    } else if (f.balls.size() == 1) {
      points.push_back({f.time_s, f.balls[0].center_cam});
    }
  }
  return BallPath::through(std::move(points));
}

std::optional<Registration> BallRecording::registered(const Camera& color, bool known, bool time_offset,
                                                      std::uint64_t seed) const {
  Camera eye = color;
  Picks picks = first_picks();
  BallPairs pairs = pairs_of(picks, eye);
  std::optional<MapFit> fit = first_map(pairs, known ? &color : nullptr, time_offset, seed);
  for (int round = 0; round < kMapRounds && fit; ++round) {
    if (!known) eye = camera_of(fit->map, eye);
    const Picks now = picked_again(picks, fit->map, eye, time_offset);
    const bool changed = now != picks;
    picks = now;
    const BallPairs before = std::exchange(pairs, pairs_of(picks, eye));
    std::optional<BallPath> path;
    if (time_offset) path.emplace(path_of(picks, *fit));
    fit = fit_map(fit->map, pairs, changed ? Chosen(pairs.size(), 1) : fit->kept, path ? &*path : nullptr,
                  fit->offset_s);
    if (!has_enough(*fit) || (round > 0 && !changed && largest_move(pairs, before) < kSettled_px)) break;
  }
  if (!fit) return std::nullopt;
  return Registration{std::move(*fit), std::move(pairs)};
}

bool has_enough(const MapFit& fit) {
  const std::size_t kept = count_of(fit.kept);
  return kept >= kLeastKept && double(kept) >= kMinKept * double(fit.kept.size());
}

}  // namespace sdftrack::calibration

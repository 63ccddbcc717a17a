// SPDX-License-Identifier: MIT
#include "tracking/start/start_place.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <tuple>

#include "base/interrupt.h"
#include "base/portable_math.h"
#include "base/short_text.h"
#include "base/to_int.h"
#include "tracking/start/click_regions.h"
#include "tracking/start/pose_score.h"
#include "tracking/start/size_check.h"
#include "tracking/start/standing_regions.h"

namespace sdftrack::tracking {

namespace {

constexpr double kBoxMargin = 0.15;  // of the larger side of a region, about it
constexpr double kMinScore = 0.42;   // below which the shape is not there
constexpr double kConvincing = 0.8;  // score of an ok pose from which no other region is tried
constexpr double kAmbiguous = 0.8;   // of the best score, from which the second one halves the confidence
constexpr double kSure = 0.6;        // confidence from which nothing else is tried
constexpr double kApart_px = 30;     // between two places that are named
constexpr std::size_t kClicked = 3;  // of the likeliest regions that are looked at as if they were clicked on
constexpr std::size_t kNamed = 2;    // places

frame::Rect box_about(const frame::PixelMask& region) {
  const frame::Rect r = frame::mask_bounds(region.on.data(), region.width, region.height);
  const double margin = kBoxMargin * std::max(r.x1 - r.x0, r.y1 - r.y0);
  const auto low = [&](int at) { return std::max(0, to_int(std::floor(at - margin))); };
  const auto high = [&](int at, int n) { return std::min(n, to_int(std::ceil(at + margin))); };
  return {low(r.x0), low(r.y0), high(r.x1, region.width), high(r.y1, region.height)};
}

// The pixel of a region that is nearest to its centroid.
Pixel middle_of(const frame::PixelMask& region) {
  double u = 0, v = 0;
  std::vector<Pixel> pixels;
  for (int y = 0; y < region.height; ++y)
    for (int x = 0; x < region.width; ++x)
      if (region(x, y)) pixels.push_back({x, y}), u += x, v += y;
  u /= static_cast<double>(pixels.size()), v /= static_cast<double>(pixels.size());
  return *std::min_element(pixels.begin(), pixels.end(), [&](Pixel a, Pixel b) {
    const auto apart2 = [&](Pixel p) { return (p.y - v) * (p.y - v) + (p.x - u) * (p.x - u); };
    return apart2(a) < apart2(b);
  });
}

struct ScoredPlace {
  double confidence;
  Pixel at;
};

// The places of the best finds that are not close to a better one.
std::vector<Pixel> best_places(std::vector<ScoredPlace> found) {
  const auto key = [](const ScoredPlace& f) { return std::tuple(f.confidence, f.at.x, f.at.y); };
  std::sort(found.begin(), found.end(),
            [&](const ScoredPlace& a, const ScoredPlace& b) { return key(a) > key(b); });
  std::vector<Pixel> out;
  for (std::size_t k = 0; k < found.size() && out.size() < kNamed; ++k) {
    const Pixel p = found[k].at;
    if (std::all_of(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(k),
                    [&](const ScoredPlace& better) {
                      return hypotenuse(p.x - better.at.x, p.y - better.at.y) > kApart_px;
                    }))
      out.push_back(p);
  }
  return out;
}

bool has_readings(const frame::DepthFrame& frame) {
  const float* z = frame.depth_m.data;
  return z && std::any_of(z, z + static_cast<std::ptrdiff_t>(frame.depth_m.width) * frame.depth_m.height,
                          [](float depth_m) { return depth_m > 0; });
}

std::vector<frame::PixelMask> regions_if_any(const frame::DepthFrame& frame, const Camera& camera, Pixel px,
                                             double size_m) {
  try {
    return click_regions(frame, camera, {static_cast<double>(px.x), static_cast<double>(px.y)}, size_m);
  } catch (const std::invalid_argument&) {  // a plane, or too few pixels
    return {};
  }
}

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", 1e3 * metres);
  return text;
}

void check_in_image(const Camera& camera, Vec2d px) {
  if (px.x >= -0.5 && px.x < camera.width - 0.5 && px.y >= -0.5 && px.y < camera.height - 0.5) return;
  throw std::invalid_argument("expected a pixel of the " + std::to_string(camera.width) + " x " +
                              std::to_string(camera.height) + " depth image, got (" + short_text(px.x) +
                              ", " + short_text(px.y) + ")");
}

}  // namespace

PoseHint RegionPlace::hint() const {
  PoseHint out;
  if (box)
    out.box = box;
  else
    out.mask = region.on;
  return out;
}

double search_confidence(const ObjectResult& result) {
  if (!is_followed(result.trust.status)) return 0;
  const bool ambiguous = result.trust.reason.code == ReasonCode::kAmbiguous && result.runner_up >= kAmbiguous;
  return result.trust.confidence * (1 + (ambiguous ? result.runner_up : 0.0));
}

RegionPlace place_of_click(const Tracker& tracker, int k, const frame::DepthFrame& frame, Vec2d px) {
  if (tracker.is_primitive(k))
    throw std::invalid_argument("expected a shape of known size, got a Primitive; give a mask or box of it");
  return PlaceTrials(tracker, k, frame).at_click(px);
}

PlaceTrials::PlaceTrials(const Tracker& tracker, int k, const frame::DepthFrame& frame)
    : tracker_(tracker),
      frame_(frame),
      shape_(tracker.shape(k)),
      size_m_(size_of(shape_)),
      alone_(tracker.alone(k)) {}

PlaceTrials::Scored PlaceTrials::tried(const RegionPlace& place, Pixel px) {
  check_interrupt();
  const ObjectResult& result = alone_->start(frame_, {place.hint()}).objects.front();
  if (!is_followed(result.trust.status)) return {};
  const double score = score_pose(shape_, frame_, tracker_.camera(), centred(result.T_cam_obj, shape_),
                                  place.region, px, tracker_.threads());
  return {score, search_confidence(result), result.trust.status == Status::kOk};
}

RegionPlace PlaceTrials::at_click(Vec2d px) {
  const Camera& camera = tracker_.camera();
  check_in_image(camera, px);
  const Pixel seed = nearest_reading(frame_, px);
  check_visible_size(camera, static_cast<double>(frame_.depth_m(seed.x, seed.y)), shape_);
  std::vector<RegionPlace> places;
  for (frame::PixelMask& region : click_regions(frame_, camera, px, size_m_))
    places.push_back({std::move(region), std::nullopt});
  places.push_back({places.front().region, box_about(places.front().region)});
  double most = 0;
  const RegionPlace* best = nullptr;
  for (const RegionPlace& place : places) {
    if (!place.box) check_mask_size(frame_, camera, place.region.on.data(), shape_, "region");
    const Scored one = tried(place, seed);
    if (one.score >= kMinScore && one.score * one.confidence > most)
      most = one.score * one.confidence, best = &place;
    if (one.score > kConvincing && one.ok) break;
  }
  if (best) return *best;
  const unsigned char* region = places.front().region.on.data();
  const std::string doubt = size_doubt(frame_, camera, region, shape_).text;
  throw std::invalid_argument(
      "expected the shape (" + millimetres(size_m_) + " across) at (" + std::to_string(seed.x) + ", " +
      std::to_string(seed.y) + "), got a surface of " + millimetres(extent_in(frame_, camera, region)) +
      " that none of its poses explains; " +
      (doubt.empty() ? "click on the middle of the object, or give a mask of it" : doubt));
}

std::pair<std::optional<RegionPlace>, std::vector<Pixel>> PlaceTrials::anywhere() {
  if (!has_readings(frame_)) return {};
  const Camera& camera = tracker_.camera();
  const StandingRegions standing = standing_regions(frame_, camera, size_m_);
  double most = 0;
  std::optional<RegionPlace> best;
  std::vector<ScoredPlace> found;
  const auto consider = [&](const frame::PixelMask& region) {
    if (!mask_fits(frame_, camera, region.on.data(), shape_)) return;
    const Pixel middle = middle_of(region);
    const RegionPlace place{region, std::nullopt};
    const Scored scored = tried(place, middle);
    const double confidence = std::max(0.0, scored.score) * scored.confidence;
    if (confidence > 0) found.push_back({confidence, middle});
    if (confidence > most) most = confidence, best = place;
  };
  for (const frame::PixelMask& region : standing.regions) consider(region);
  std::vector<Pixel> pixels;
  for (std::size_t k = 0; k < std::min(kClicked, standing.regions.size()); ++k)
    pixels.push_back(middle_of(standing.regions[k]));
  pixels.insert(pixels.end(), standing.pixels.begin(), standing.pixels.end());
  for (const Pixel px : pixels) {
    if (most > kSure) break;
    for (const frame::PixelMask& region : regions_if_any(frame_, camera, px, size_m_)) consider(region);
  }
  if (most < kMinStandingConfidence) best.reset();
  return {std::move(best), best_places(std::move(found))};
}

}  // namespace sdftrack::tracking

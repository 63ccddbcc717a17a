// SPDX-License-Identifier: MIT
#include "tracking/frame_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sdftrack::tracking {

namespace {

// A sensor's noise never repeats: of a scene at rest, measured in steps of a millimetre, a third of the
// pixels or more differ from frame to frame. So this many equal pixels mean the same image.
constexpr int kMinReadings = 200;
// A rendering without noise does repeat where nothing moves. Its inverse depth is linear along a row of a
// plane and smooth elsewhere; noise changes the sign of its second difference from pixel to pixel.
constexpr float kNoise_m = 5e-5f;       // least second difference
constexpr float kStep_m = 0.03f;        // a larger step between neighbours is an edge
constexpr double kNoisyShare = 0.1;     // of the places; about 0.7 by Gaussian noise
constexpr double kJump = 10;            // in usual time steps
constexpr int kMinSteps = 3;            // until the usual step is known
constexpr double kStepRate = 0.2;       // how fast the usual step follows
constexpr double kBrighter = 1.25;      // ratio of the mean brightness of the objects,
constexpr double kBrighterImage = 1.1;  // and of the whole image: a hand darkens only a part of it
constexpr int kRegionSamples = 8;       // along each side of an object's region

// Whether the two second differences of four neighbours indicate noise. In metres: of 1 / z, times z^2.
bool noisy(const float* z) {
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(z[i + 1] - z[i]) < kStep_m)) return false;
  const float a = 1 / z[0] - 2 / z[1] + 1 / z[2], b = 1 / z[1] - 2 / z[2] + 1 / z[3];
  return a * b < 0 && std::min(std::abs(a), std::abs(b)) * z[1] * z[1] > kNoise_m;
}

double brightness_at(const appearance::ColorImage& color, int x, int y) {
  const unsigned char* rgb = color.at(x, y);
  return (rgb[0] + rgb[1] + rgb[2]) / 3.0;
}

double ratio(double a, double b) { return std::max(a, 1.0) / std::max(b, 1.0); }

// Whether both ratios exceed their factors, in the same direction.
bool both_beyond(double a, double factor_a, double b, double factor_b) {
  return (a > factor_a && b > factor_b) || (a < 1 / factor_a && b < 1 / factor_b);
}

}  // namespace

// Remembers the image. Whether it equals the one before, bit by bit, and has a sensor's noise.
bool FrameWatch::repeats(const ImageView<float>& depth_m) {
  const int run = std::min(kRun, depth_m.width);
  int others = seen_ ? 0 : 1;
  seen_ = true;
  float* kept = depths_.data();
  for (int j = 0; j < kRows; ++j) {
    const int y = (2 * j + 1) * depth_m.height / (2 * kRows);
    for (int i = 0; i < kRuns; ++i, kept += kRun) {
      const int x = (depth_m.width - run) * (2 * i + 1) / (2 * kRuns);
      const float* const first = depth_m.data + y * depth_m.width + x;
      for (int k = 0; k < run; ++k) {
        const float now = first[k] > 0 ? first[k] : 0.0f;  // NaN is no measurement
        others += now != kept[k];
        kept[k] = now;
      }
    }
  }
  if (others > 0) return false;
  int readings = 0, places = 0, rough = 0;
  for (const float z : depths_) readings += z > 0;
  if (readings < kMinReadings) return false;
  for (std::size_t r = 0; r < depths_.size(); r += kRun)
    for (std::size_t k = r; k + 3 < r + kRun; ++k)
      if (depths_[k] > 0 && depths_[k + 1] > 0 && depths_[k + 2] > 0 && depths_[k + 3] > 0)
        ++places, rough += noisy(&depths_[k]);
  return rough > kNoisyShare * places;
}

ReasonCode FrameWatch::check_time(double time_s) {
  const double step_s = time_s - std::exchange(time_s_, time_s);
  if (!std::isfinite(step_s)) return ReasonCode::kNone;
  if (step_s == 0) return ReasonCode::kRepeatedTime;
  if (step_s < 0) return ReasonCode::kBackwardTime;
  const bool jumps = steps_ >= kMinSteps && step_s > kJump * usual_step_s_;
  const double bounded = steps_ > 0 ? std::min(step_s, kJump * usual_step_s_) : step_s;
  usual_step_s_ += (steps_ > 0 ? kStepRate : 1.0) * (bounded - usual_step_s_);
  ++steps_;
  return jumps ? ReasonCode::kTimeJump : ReasonCode::kNone;
}

FrameWatch::Brightness FrameWatch::brightness(const frame::DepthFrame& frame,
                                              const std::vector<frame::Rect>& regions, float depth_m) {
  if (!frame.color) return {};
  const appearance::ColorImage& color = *frame.color;
  double image = 0, objects = 0;
  int samples = 0;
  for (int j = 0; j < kColorRows; ++j)
    for (int i = 0; i < kColorColumns; ++i)
      image += brightness_at(color, (2 * i + 1) * color.map.width / (2 * kColorColumns),
                             (2 * j + 1) * color.map.height / (2 * kColorRows));
  for (const frame::Rect& r : regions)
    for (int j = 0; j < kRegionSamples && !r.empty(); ++j)
      for (int i = 0; i < kRegionSamples; ++i) {
        const auto u = float(r.x0 + (2 * i + 1) * (r.x1 - r.x0) / (2 * kRegionSamples));
        const auto v = float(r.y0 + (2 * j + 1) * (r.y1 - r.y0) / (2 * kRegionSamples));
        int x, y;
        float unused;
        if (!color.map.find({u, v}, depth_m, &x, &y, &unused)) continue;
        objects += brightness_at(color, x, y), ++samples;
      }
  return {image / (kColorRows * kColorColumns), samples > 0 ? objects / samples : -1};
}

// An exposure affects the whole image; where the objects are not known, only the whole image is compared.
bool FrameWatch::exposure_jumps(const Brightness& now) const {
  if (now.image < 0 || brightness_.image < 0) return false;
  const double image = ratio(now.image, brightness_.image);
  if (now.objects < 0 || brightness_.objects < 0) return both_beyond(image, kBrighter, image, kBrighter);
  return both_beyond(ratio(now.objects, brightness_.objects), kBrighter, image, kBrighterImage);
}

ReasonCode FrameWatch::look(const frame::DepthFrame& frame, const std::vector<frame::Rect>& regions,
                            float depth_m) {
  if (!frame.depth_m.data) return ReasonCode::kNone;
  const bool repeated = repeats(frame.depth_m);
  const ReasonCode time = check_time(frame.time_s);
  const Brightness now = brightness(frame, regions, depth_m);
  const bool brighter = exposure_jumps(now);
  brightness_ = now;
  // The same image at the same time is the same frame given again: this is no fault.
  if (repeated) return time == ReasonCode::kRepeatedTime ? ReasonCode::kNone : ReasonCode::kRepeatedDepth;
  if (time != ReasonCode::kNone) return time;
  return brighter ? ReasonCode::kExposureJump : ReasonCode::kNone;
}

void doubt_frame(ReasonCode fault, Status* status, Reason* reason, double* confidence) {
  if (fault == ReasonCode::kNone || *status == Status::kBadFrame) return;
  if (*status != Status::kOk) {
    if (reason->code != fault) reason->frame = fault;
    return;
  }
  *status = Status::kWeak;
  *reason = {fault};
  *confidence *= 0.5;
}

}  // namespace sdftrack::tracking

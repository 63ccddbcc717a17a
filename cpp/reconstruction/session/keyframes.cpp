// SPDX-License-Identifier: MIT
#include "reconstruction/session/keyframes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sdftrack::reconstruction {

namespace {

constexpr int kMargin_px = 25;        // of what is kept around the object
constexpr double kPerDistance = 0.5;  // half as far is another view, as 20 degrees to the side are
constexpr double kPerFrame = 1e-4, kLate = 0.02;  // the same view 200 frames later counts as 1.1 degrees away
constexpr double kNearest_m = 1e-6, kNoGap = std::numeric_limits<double>::infinity();

std::array<double, 5> view_of(const Keyframe& keyframe) {
  const Rigidd& T = keyframe.T_cam_obj;
  const double away = std::max(norm(T.t), kNearest_m);
  const Vec3d to_object = transpose_times(T.R, T.t);
  return {-to_object.x / away, -to_object.y / away, -to_object.z / away, kPerDistance * std::log(away),
          1.0 * keyframe.index};
}

// How different two views are: in radians, for nearby directions.
double apart(const std::array<double, 5>& a, const std::array<double, 5>& b) {
  double square = 0;
  for (std::size_t i = 0; i < 4; ++i) square += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(square) + std::min(kPerFrame * std::abs(a[4] - b[4]), kLate);
}

// Of equal gaps the earlier one stays in front.
void note_neighbor(int who, double gap, Keyframes::Record* record) {
  auto& [view, nearest, gaps] = *record;
  if (gap < gaps[0])
    nearest = {who, nearest[0]}, gaps = {gap, gaps[0]};
  else if (gap < gaps[1])
    nearest[1] = who, gaps[1] = gap;
}

}  // namespace

levelset::PixelRect keyframe_region(const PixelMask& mask) {
  const frame::Rect box = frame::mask_bounds(mask.on.data(), mask.width, mask.height);
  return {std::max(0, box.x0 - kMargin_px), std::max(0, box.y0 - kMargin_px),
          std::min(mask.width, box.x1 + kMargin_px), std::min(mask.height, box.y1 + kMargin_px)};
}

void Keyframes::add(std::shared_ptr<Keyframe> keyframe) {
  const std::array<double, 5> view = view_of(*keyframe);
  const std::size_t n = frames_.size();
  for (Record& other : records_) note_neighbor(int(n), apart(other.view, view), &other);
  frames_.push_back(std::move(keyframe));
  records_.push_back({view, {-1, -1}, {kNoGap, kNoGap}});
  find_nearest(n);
  if (n == std::size_t(most_)) drop(least_missed());
}

void Keyframes::restore(std::vector<std::shared_ptr<Keyframe>> frames, std::vector<Record> records) {
  frames_ = std::move(frames), records_ = std::move(records);
}

// The keyframe to remove; never the first of a recording, to which its other frames refer.
std::size_t Keyframes::least_missed() const {
  std::size_t best = frames_.size() - 1;
  double least = kNoGap;
  bool found = false;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    if (frames_[i]->recording != frames_[i - 1]->recording) continue;
    const double gap = records_[i].gap[0] + records_[i].gap[1];
    if (!found || gap < least) best = i, least = gap, found = true;
  }
  return best;
}

void Keyframes::drop(std::size_t k) {
  frames_.erase(frames_.begin() + std::ptrdiff_t(k));
  records_.erase(records_.begin() + std::ptrdiff_t(k));
  const int dropped = int(k);
  std::vector<std::size_t> bereft;  // few: a frame is among the nearest of few others
  for (std::size_t i = 0; i < records_.size(); ++i)
    for (int& who : records_[i].nearest) {
      if (who == dropped && (bereft.empty() || bereft.back() != i)) bereft.push_back(i);
      who -= who > dropped;
    }
  for (const std::size_t i : bereft) find_nearest(i);
}

void Keyframes::find_nearest(std::size_t i) {
  Record& own = records_[i];
  own.nearest = {-1, -1}, own.gap = {kNoGap, kNoGap};
  for (std::size_t k = 0; k < records_.size(); ++k)
    if (k != i) note_neighbor(int(k), apart(records_[k].view, own.view), &own);
}

}  // namespace sdftrack::reconstruction

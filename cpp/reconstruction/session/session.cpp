// SPDX-License-Identifier: MIT
#include "reconstruction/session/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <stdexcept>

#include "base/option_schema.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kYoungFrames = 30;            // in which the tracker takes the shape as each frame leaves it
constexpr double kPrintedScale_voxels = 2;  // s of the thesis' likelihood (below Eq. 4.13)
constexpr double kSeenUnit = 256;
constexpr int kLeastRegion_px = levelset::EvidenceVolume::kBlock;
constexpr double kDoubted = 0.5;
constexpr double kMostSettled_m = 0.01, kMostSettled_rad = 0.1;  // more is not the noise of a frame

ReconstructionOptions with_noise(ReconstructionOptions options, double noise_m) {
  options.evidence.noise.noise_m = options.evidence.noise.usual_m = float(noise_m);
  return options;
}

template <class Call>
auto timed(double* sum_s, const Call& call) {
  struct Watch {
    double* sum_s;
    std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
    ~Watch() { *sum_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); }
  } const watch{sum_s};
  return call();
}

// The surface is fused from what was filled in the depth, too, and agrees best with frames that have the
// same.
frame::DepthFrame as_fused(frame::DepthFrame frame) {
  frame.given_m = nullptr;
  return frame;
}

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

std::vector<std::uint8_t> colors_of(const frame::DepthFrame& frame, const levelset::PixelRect& region) {
  const appearance::ColorImage& image = *frame.color;
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * std::size_t(region.count()));
  for (int y = region.y0; y < region.y1; ++y)
    for (int x = region.x0; x < region.x1; ++x) {
      const float z = frame.depth_m(x, y);
      int cx = 0, cy = 0;
      float depth = 0;
      const Vec2f u{float(x), float(y)};
      const bool found = z > 0 && image.map.find(u, z, &cx, &cy, &depth);
      const unsigned char none[3] = {}, *const c = found ? image.at(cx, cy) : none;
      rgb.insert(rgb.end(), c, c + 3);
      if (found && !(c[0] | c[1] | c[2])) rgb.back() = 1;  // black is also a colour
    }
  return rgb;
}

Keyframe masked_keyframe(const frame::DepthFrame& frame, const PixelMask& on_object,
                         const Rigidd& T_cam_obj) {
  Keyframe out;
  out.region = keyframe_region(on_object);
  out.depth_m = cut(frame.depth_m, out.region);
  if (frame.color) out.rgb = colors_of(frame, out.region);
  out.T_cam_obj = T_cam_obj;
  out.mask =
      cut(ImageView<unsigned char>{on_object.on.data(), on_object.width, on_object.height}, out.region);
  return out;
}

Session::Session(const Camera& camera, const ReconstructionOptions& options, const SessionSettings& settings,
                 const std::optional<KnownShape>& initial, const Beginning& beginning)
    : camera_(camera),
      options_(with_noise(options, beginning.noise_m)),
      settings_(settings),
      initial_(initial),
      beginning_(std::make_shared<const Beginning>(beginning)),
      keyframes_(options.kept_frames) {
  const double wide_m = 2 * beginning.ball.radius_m;
  if (settings.side_m && wide_m > *settings.side_m)
    throw std::invalid_argument("extent: the object is about " + text_of(wide_m) + " m wide, the volume " +
                                text_of(*settings.side_m) + " m; give a larger extent, or omit it");
  const sdf::Grid grid =
      lattice_for(beginning, initial ? &*initial : nullptr, settings.voxels, settings.side_m);
  volume_ = std::make_shared<GrowingVolume>(camera, grid, beginning_, initial, options_, settings.threads,
                                            settings.device);
  if (beginning.outline && !options.keep_to_mask && !options.evolved)
    mask_extent_.emplace(camera, *beginning.outline, beginning.T_cam_obj);
}

tracking::TrackerOptions Session::tracker_options(const tracking::TrackerOptions& given) const {
  // The young shape fits the frames that it was made of too well to measure the sensor by.
  tracking::TrackerOptions out = given;
  out.adapt_noise = false;
  out.noise_m = beginning_->noise_m, out.noise_per_m = decimal_of(options_.evidence.noise.noise_per_m);
  if (options_.evolved)  // the width of the likelihood is in voxels, whatever the sensor
    out.noise_m = kPrintedScale_voxels * volume_->core()->grid().voxel_m, out.noise_per_m = 0;
  return out;
}

int Session::least_seen() const { return std::max(1, int(std::nearbyint(kSeenUnit * options_.min_seen))); }

const SessionResult& Session::start(tracking::Tracker* tracker, const frame::DepthFrame& frame) {
  auto keyframe =
      std::make_shared<Keyframe>(masked_keyframe(frame, beginning_->on_object, beginning_->T_cam_obj));
  begin_frame();
  timed(&result_.fuse_s, [&] { volume_->fuse(*keyframe, frame.depth_m); });
  if (volume_->core()->surface_boxes().empty())
    throw std::invalid_argument(
        "start: no surface was found on the object; is it too small for the volume's voxels?");
  keyframes_.add(std::move(keyframe));
  tracker_ = tracker;
  timed(&result_.show_s, [&] { show_shape(tracker); });
  tracking::PoseHint hint;
  hint.T_cam_obj = beginning_->T_cam_obj;
  timed(&result_.track_s, [&] { tracker->start(as_fused(frame), {hint}); });
  tracker->set_pose(0, beginning_->T_cam_obj, std::nullopt);
  return finish(beginning_->T_cam_obj, true, true);
}

const SessionResult& Session::track(const frame::DepthFrame& frame) {
  begin_frame();
  volume_->core()->begin_to_show();
  static_cast<void>(volume_->core()->phi());  // waits for what the tracker borrows
  timed(&result_.track_s, [&] { tracker_->track(as_fused(frame)); });
  const tracking::ObjectResult& found = tracker_->last_result().objects.front();
  ++index_;
  // The thesis does not judge its poses: every frame that could be tracked adds to the shape. Along what
  // cannot be observed, any pose adds the same.
  const bool sure =
      found.sure_where_determined() || (options_.evolved && found.trust.status == tracking::Status::kWeak);
  const Rigidd T_cam_obj = found.T_cam_obj;
  const bool fused = sure && frame.depth_m.data && add(frame, T_cam_obj);
  finish(T_cam_obj, fused, true);
  const bool all_kept = int(keyframes_.frames().size()) == volume_->fused();
  if (fused && volume_->fused() == options_.settle_after && all_kept && later_.empty() && !options_.evolved)
    timed(&result_.fuse_s, [&] { settle(); });
  return result_;
}

// Without memory for a second volume the shape stays as it is.
void Session::settle() {
  const std::optional<Rigidd> motion = settled_by();
  if (!motion) return;
  try {
    rebuild(*motion);
  } catch (const std::bad_alloc&) {
    return;
  }
  Rigidd& reported = result_.tracked.objects.front().T_cam_obj;
  reported = reported * *motion;
}

// The first shape took the noise of the first frame for its form, and the next frames were placed on it. The
// mean of all shows where the first frame is. Returns what moves the poses of the others accordingly,
// T_cam_obj * motion; none where that is not certain.
std::optional<Rigidd> Session::settled_by() const {
  const Keyframe& first = *keyframes_.frames().front();
  const std::vector<float> depth_m = whole(first.depth_m, first.region, camera_.width, camera_.height);
  const std::vector<std::uint8_t> rgb =
      first.rgb.empty() ? first.rgb : whole(first.rgb, first.region, camera_.width, camera_.height, 3);
  const appearance::ColorImage color{rgb.data(), appearance::aligned_map(camera_.width, camera_.height)};
  const std::unique_ptr<tracking::Tracker> tracker = tracker_->alone(0, false);
  tracker->set_pose(0, first.T_cam_obj, std::nullopt);
  const frame::DepthFrame frame =
      tracker->make_frame({depth_m.data(), camera_.width, camera_.height}, nullptr,
                          std::numeric_limits<double>::quiet_NaN(), rgb.empty() ? nullptr : &color);
  const tracking::ObjectResult& found = tracker->revisit(frame).front();
  if (found.trust.status != tracking::Status::kOk) return std::nullopt;
  const Rigidd motion = inverse(found.T_cam_obj) * first.T_cam_obj;
  const bool noise = norm(motion.t) < kMostSettled_m && norm(rotation_log(motion.R)) < kMostSettled_rad;
  return noise ? std::optional(motion) : std::nullopt;
}

// The first keyframe keeps its pose: there the object frame is defined.
void Session::rebuild(const Rigidd& motion) {
  const auto& kept = keyframes_.frames();
  std::shared_ptr<GrowingVolume> volume = volume_->emptied();
  std::vector<Rigidd> before;
  for (const std::shared_ptr<Keyframe>& keyframe : kept) before.push_back(keyframe->T_cam_obj);
  try {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      if (i > 0) kept[i]->T_cam_obj = before[i] * motion;
      volume->fuse_again(*kept[i], *volume_, before[i]);
    }
    volume->measure();
    set_volume(std::move(volume));
  } catch (...) {
    for (std::size_t i = 0; i < kept.size(); ++i) kept[i]->T_cam_obj = before[i];
    throw;
  }
  tracker_->move_frame(0, motion);
}

const SessionResult& Session::resume(tracking::Tracker* tracker, const frame::DepthFrame& frame,
                                     const Beginning& shown, bool masked) {
  begin_frame();
  volume_->begin_recording(shown, shown.T_cam_obj);
  tracker_ = tracker, ++index_;
  later_.push_back(shown);
  show_shape(tracker);
  bool fused = true;
  if (masked) {
    auto first = std::make_shared<Keyframe>(masked_keyframe(frame, shown.on_object, shown.T_cam_obj));
    first->index = index_, first->recording = int(later_.size());
    keep(std::move(first), frame);
  } else {
    fused = add(frame, shown.T_cam_obj);
  }
  return finish(shown.T_cam_obj, fused, false);  // ok says that it was added
}

bool Session::add(const frame::DepthFrame& frame, const Rigidd& T_cam_obj) {
  const frame::Shape& shape = tracker_->shape(0);
  const Rigidd T{nearest_rotation(T_cam_obj.R), T_cam_obj.t};
  const frame::Rect box =
      frame::projected_box(camera_, shape, tracking::centred(T, shape), options_.padding_m);
  if (box.x1 - box.x0 < kLeastRegion_px || box.y1 - box.y0 < kLeastRegion_px) return false;
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->index = index_, keyframe->region = {box.x0, box.y0, box.x1, box.y1};
  keyframe->recording = int(later_.size()), keyframe->T_cam_obj = T_cam_obj;
  keyframe->depth_m = cut(frame.depth_m, keyframe->region);
  tracker_->find_foreground(frame, 0, box, &keyframe->foreground);
  if (frame.color) keyframe->rgb = colors_of(frame, keyframe->region);
  keep(std::move(keyframe), frame);
  return true;
}

void Session::keep(std::shared_ptr<Keyframe> keyframe, const frame::DepthFrame& frame) {
  timed(&result_.fuse_s, [&] { volume_->fuse(*keyframe, frame.depth_m); });
  keyframes_.add(std::move(keyframe));
  // What many frames have shown moves little with one more: sample points, normals and the coarse grid of the
  // tracker's shape may be one frame older than the distances and colours, which it borrows.
  if (volume_->grow_if_needed() || volume_->fused() <= kYoungFrames || volume_->fused() % 2 == 0)
    timed(&result_.show_s, [&] { show_shape(tracker_); });
  else
    volume_->core()->begin_to_show();  // while this thread continues
}

void Session::show_shape(tracking::Tracker* tracker) const {
  const Reconstruction& core = *volume_->core();
  const sdf::Grid& grid = core.grid();
  const levelset::VoxelColor* const colors = core.colors().data();
  // The thesis tracks by all of the shape, seen or guessed.
  const auto least = static_cast<std::uint16_t>(options_.evolved ? 0 : least_seen());
  frame::PartialShape known{grid.view(core.phi().data()), {&colors->seen, 4, least}, {&colors->r}, {}, {}};
  known.colors.least = least;
  known.boxes = core.surface_boxes();
  tracker->reshape(0, std::move(known));
}

void Session::set_volume(std::shared_ptr<GrowingVolume> volume) {
  volume_.swap(volume);
  try {
    if (tracker_) show_shape(tracker_);
  } catch (...) {
    volume_.swap(volume);  // which the tracker still reads
    throw;
  }
  if (mask_extent_) mask_extent_->forget();
}

void Session::restore(std::vector<Beginning> later, int index, const sdf::Grid& grid) {
  later_ = std::move(later), index_ = index;
  volume_ = std::make_shared<GrowingVolume>(camera_, grid, beginning_, initial_, options_, settings_.threads,
                                            settings_.device);
}

const SessionResult& Session::finish(const Rigidd& T_cam_obj, bool fused, bool judged) {
  result_.tracked = tracker_->last_result();
  result_.tracked.index = index_;
  tracking::ObjectResult& object = result_.tracked.objects.front();
  object.T_cam_obj = T_cam_obj;
  if (judged && fused && mask_extent_ && object.trust.status == tracking::Status::kOk) {
    const double share = mask_extent_->beyond(volume_->now(), volume_->fused(), least_seen());
    if (share > MaskExtent::kMaxBeyond) {
      object.trust.status = tracking::Status::kWeak;
      object.trust.reason =
          tracking::reason_with_percent(tracking::ReasonCode::kBeyondMask, int(std::nearbyint(100 * share)));
      object.trust.confidence = std::min(object.trust.confidence, kDoubted);
    }
  }
  result_.change_m = fused ? volume_->core()->change_m() : std::numeric_limits<double>::quiet_NaN();
  return result_;
}

}  // namespace sdftrack::reconstruction

// SPDX-License-Identifier: MIT
#include "reconstruction/reconstruction.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "base/parallel.h"
#include "levelset/free_space_terms.h"
#include "reconstruction/option_schema.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kFirstRounds = 8;
constexpr double kSameSide = 0.94;  // cosine of 20 degrees
constexpr int kYoungRounds = 6;  // after this (even) number of updates of far distances half as many suffice

ReconstructionOptions checked(ReconstructionOptions options, const sdf::Grid& grid) {
  options = check_options(options);
  if (options.evolved) {
    options.evidence.form = {true, options.sigma_d_voxels * float(grid.voxel_m)};
    options.evidence.max_weight = std::numeric_limits<float>::max();
    options.evidence.known_every = 1;
  }
  options.image.printed = options.evidence.form.printed;
  return options;
}

// A guess where the object cannot be is discarded.
levelset::EvidenceVolume guessed(const sdf::Grid& grid, const float* prior, const FirstView* view,
                                 int threads) {
  if (!prior || !view) return {grid, prior};
  std::vector<float> kept(prior, prior + grid.size());
  parallel_for(grid.nz, threads, [&](std::size_t slice) {
    const int z = int(slice);
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        float& ratio = kept[grid.index(x, y, z)];
        if (ratio > 0 && !view->may_be_guessed(grid.point(x, y, z))) ratio = -ratio;
      }
  });
  return {grid, kept.data()};
}

}  // namespace

Reconstruction::Reconstruction(const sdf::Grid& grid, const float* prior,
                               const ReconstructionOptions& options, std::shared_ptr<const FirstView> view,
                               int threads, const float* first_shape, int device)
    : Reconstruction(guessed(grid, prior, view.get(), threads), options, view, device) {
  if (view && view->has_far_side()) far_side_ = std::move(view);
  if (options.evolved != (first_shape != nullptr))
    throw std::invalid_argument("first_shape: expected one if and only if evolution is 'printed'");
  if (options.evolved)
    field_.emplace(grid, first_shape);
  else
    begin_shape();
}

Reconstruction::Reconstruction(levelset::EvidenceVolume evidence, const ReconstructionOptions& options,
                               std::shared_ptr<const FirstView> view, int device)
    : options_(checked(options, evidence.grid())),
      view_(std::move(view)),
      device_(device),
      evidence_(std::move(evidence)) {
  levelset::SensorNoise& noise = options_.evidence.noise;
  noise.min_m = std::max(noise.min_m, float(grid().voxel_m));
  // A measurement at normal incidence weighs 1 in any volume.
  noise.usual_m = std::max(noise.usual_m, noise.min_m);
}

void Reconstruction::begin_shape() {
  if (device_ == kOnCpu) {
    distance_.emplace(evidence_);
    return;
  }
  on_device_ = std::make_unique<levelset::DeviceVolume>(&evidence_, device_);
  device_roles_ = std::make_unique<DeviceRoles>(on_device_.get(), view_.get());
}

const levelset::EvidenceVolume& Reconstruction::evidence(int threads) const {
  if (evidence_is_older_) {
    on_device_->download(&evidence_, threads);
    evidence_is_older_ = false;
  }
  return evidence_;
}

std::unique_ptr<Reconstruction> Reconstruction::grown(const std::array<int, 3>& before,
                                                      const std::array<int, 3>& after, int threads) const {
  if (field_) throw std::invalid_argument("grown: a volume with evolution 'printed' cannot be enlarged");
  std::unique_ptr<Reconstruction> larger(
      new Reconstruction(evidence(threads).padded(before, after), options_, view_, device_));
  larger->frames_ = frames_, larger->far_side_ = far_side_;
  larger->begin_shape();
  larger->measure_all(threads);
  return larger;
}

std::unique_ptr<Reconstruction> Reconstruction::continued(std::shared_ptr<const FirstView> view,
                                                          int threads) const {
  if (field_) throw std::invalid_argument("continued: evolution 'printed' supports only one recording");
  levelset::EvidenceVolume evidence = this->evidence(threads).padded({0, 0, 0}, {0, 0, 0});
  if (view) evidence.bound_guess([&](Vec3d p_obj) { return view->leaves_room(p_obj); }, threads);
  std::unique_ptr<Reconstruction> next(
      new Reconstruction(std::move(evidence), options_, std::move(view), device_));
  next->frames_ = frames_, next->far_side_ = far_side_;
  next->begin_shape();
  next->measure_all(threads);
  return next;
}

// Computes the distances of the whole volume from the start.
void Reconstruction::measure_all(int threads) {
  const float band = options_.band_voxels;
  if (on_device_) {
    on_device_->update(kFirstRounds, band, true);
    on_device_->sweep_far(band);
    on_device_->fill_far(band, 0, grid().nz);
    on_device_->settle();
    return;
  }
  std::vector<int> all(evidence_.blocks().count());
  std::iota(all.begin(), all.end(), 0);
  distance_->update(evidence_, all, kFirstRounds, band, threads, true);
  distance_->sweep_far(band);
  distance_->fill_far(band, 0, grid().nz, threads);
}

bool Reconstruction::looked_past(Vec3d p_obj) const {
  return levelset::looked_past(grid(), phi().data(), evidence_.log_ratio().data(), evidence_.weight().data(),
                               p_obj, options_.roles.near_m);
}

void Reconstruction::find_roles(const FrameEvidence& frame, const Camera& camera, const Known& known) {
  if (field_ && frame.foreground) {
    roles_ = finder_.from_colors(frame.rect, frame.depth_m, frame.foreground);
    if (roles_) return;  // otherwise no colours are known
  }
  const ReadingTerm term{LensRays(camera), inverse(known.T_cam_obj).cast<float>()};
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  readings_.clear();
  for (int y = frame.rect.y0; y < frame.rect.y1; ++y)
    for (int x = frame.rect.x0; x < frame.rect.x1; ++x) {
      const float z = frame.depth_m(x, y);
      readings_.push_back(levelset::readable(z) ? term.at(x, y, z) : Vec3f{kNone, kNone, kNone});
    }
  const SdfView sdf = known.shape.grid().view(known.shape.phi().data());
  Vec3f unused;
  reading_distance_m_.assign(readings_.size(), kNone);
  for (std::size_t i = 0; i < readings_.size(); ++i)
    if (!std::isnan(readings_[i].x)) sample(sdf, readings_[i], &reading_distance_m_[i], &unused);
  // Not where the recording's first frame leaves no room, nor where other frames have seen free space.
  const auto has_room = [&](int x, int y) {
    const int i = (y - frame.rect.y0) * frame.rect.width() + x - frame.rect.x0;
    const Vec3d p_obj = readings_[i].cast<double>();
    return !(view_ && !view_->may_hold(p_obj)) && !known.shape.looked_past(p_obj);
  };
  roles_ = &finder_.find(frame.rect, reading_distance_m_, frame.foreground, frame.depth_m, options_.roles,
                         has_room);
}

// Updates a part of the volume in each frame.
void Reconstruction::update_far(int threads) {
  const int every = options_.far_every * (frames_ < kYoungRounds * options_.far_every ? 1 : 2);
  const int part = frames_ % every, nz = grid().nz;
  const int from = nz * part / every, to = nz * (part + 1) / every;
  const float band = options_.band_voxels;
  if (on_device_) {
    if (part == 0) on_device_->sweep_far(band);
    on_device_->fill_far(band, from, to);
  } else {
    if (part == 0) distance_->sweep_far(band);
    distance_->fill_far(band, from, to, threads);
  }
}

void Reconstruction::fuse(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj,
                          int threads) {
  if (on_device_) {
    evidence_is_older_ = true;
    on_device_->send(frame);
    device_roles_->find(camera, T_cam_obj, options_.roles);
    on_device_->fuse(camera, T_cam_obj, options_.image, options_.evidence);
    follow({}, threads);
    on_device_->settle();
  } else {
    follow(add_evidence(frame, camera, T_cam_obj, threads, {*this, T_cam_obj}), threads);
  }
  ++frames_;
  doubt_far_side(T_cam_obj);
}

// From elsewhere the side of the object is seen: what is behind it is no longer for the first view to say.
void Reconstruction::doubt_far_side(const Rigidd& T_cam_obj) {
  if (!far_side_) return;
  const auto to_camera = [](const Rigidd& T) {
    const Vec3d p = transpose_times(T.R, T.t);
    return (1 / norm(p)) * p;
  };
  const double cosine = dot(to_camera(T_cam_obj), to_camera(far_side_->term().T_cam_obj));
  if (!(cosine > kSameSide)) far_side_.reset();
}

const std::vector<int>& Reconstruction::add_evidence(const FrameEvidence& frame, const Camera& camera,
                                                     const Rigidd& T_cam_obj, int threads,
                                                     const Known& known) {
  if (frame.mask)
    roles_ = &finder_.from_mask(frame.rect, frame.depth_m, frame.mask);
  else
    find_roles(frame, camera, known);
  image_.make(frame.depth_m, camera, frame.rect, roles_->data(), options_.image);
  return evidence_.fuse(image_, {frame.rgb}, camera, T_cam_obj, options_.evidence, threads);
}

void Reconstruction::fuse_again(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj,
                                int threads, const Known& known) {
  if (measures_at_once()) return fuse(frame, camera, T_cam_obj, threads);
  add_evidence(frame, camera, T_cam_obj, threads, known);
  ++frames_;
  doubt_far_side(T_cam_obj);
}

void Reconstruction::measure(int threads) {
  if (measures_at_once()) return;
  begin_shape();
  measure_all(threads);
}

// Updates the shape after these blocks have been fused; a GPU knows them itself.
void Reconstruction::follow(const std::vector<int>& changed, int threads) {
  if (field_) {
    field_->evolve(evidence_.log_ratio().data(), frames_ ? options_.evolution_steps : options_.first_steps,
                   options_.redistance_every, options_.evolve, threads, device_);
    return;
  }
  if (frames_ == 0) {
    measure_all(threads);
    return;
  }
  if (on_device_)
    on_device_->update(options_.rounds, options_.band_voxels);
  else
    distance_->update(evidence_, changed, options_.rounds, options_.band_voxels, threads);
  update_far(threads);
}

}  // namespace sdftrack::reconstruction

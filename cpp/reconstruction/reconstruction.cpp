// SPDX-License-Identifier: MIT
#include "reconstruction/reconstruction.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "base/parallel.h"
#include "base/to_int.h"
#include "reconstruction/option_schema.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kFirstRounds = 8;
constexpr int kYoungRounds = 6;    // updates of far distances (an even number), after which half as many do
constexpr float kEmptyFrames = 3;  // that have looked past a place, and
constexpr float kEmptyRatio = -1.5f;  // their mean, where nothing of the object can be

ReconstructionOptions checked(ReconstructionOptions options, const sdf::Grid& grid) {
  options = check_options(options);
  if (options.evolved) {
    options.evidence.form = {true, options.sigma_d_voxels * static_cast<float>(grid.voxel_m)};
    options.evidence.max_weight = std::numeric_limits<float>::max();
    options.evidence.known_every = 1;
  }
  options.image.printed = options.evidence.form.printed;
  return options;
}

// A guess is none where the object cannot be.
levelset::EvidenceVolume guessed(const sdf::Grid& grid, const float* prior, const FirstView* view,
                                 int threads) {
  if (!prior || !view) return {grid, prior};
  std::vector<float> kept(prior, prior + grid.size());
  parallel_for(static_cast<std::size_t>(grid.nz), threads, [&](std::size_t slice) {
    const int z = static_cast<int>(slice);
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
                               int threads, const float* first_shape)
    : Reconstruction(guessed(grid, prior, view.get(), threads), options, view) {
  if (options.evolved != (first_shape != nullptr))
    throw std::invalid_argument("first_shape: expected one if and only if evolution is 'printed'");
  if (options.evolved) field_.emplace(grid, first_shape);
}

Reconstruction::Reconstruction(levelset::EvidenceVolume evidence, const ReconstructionOptions& options,
                               std::shared_ptr<const FirstView> view)
    : options_(checked(options, evidence.grid())),
      view_(std::move(view)),
      evidence_(std::move(evidence)),
      distance_(evidence_) {
  levelset::SensorNoise& noise = options_.evidence.noise;
  noise.min_m = std::max(noise.min_m, static_cast<float>(grid().voxel_m));
  noise.usual_m = std::max(noise.usual_m, noise.min_m);  // seen head on, a reading weighs 1 in any volume
}

std::unique_ptr<Reconstruction> Reconstruction::grown(const std::array<int, 3>& before,
                                                      const std::array<int, 3>& after, int threads) const {
  if (field_) throw std::invalid_argument("grown: a volume with evolution 'printed' cannot be enlarged");
  std::unique_ptr<Reconstruction> larger(
      new Reconstruction(evidence_.padded(before, after), options_, view_));
  larger->frames_ = frames_;
  larger->measure_all(threads);
  return larger;
}

std::unique_ptr<Reconstruction> Reconstruction::continued(std::shared_ptr<const FirstView> view,
                                                          int threads) const {
  if (field_) throw std::invalid_argument("continued: evolution 'printed' supports only one recording");
  levelset::EvidenceVolume evidence = evidence_.padded({0, 0, 0}, {0, 0, 0});
  if (view) evidence.bound_guess([&](Vec3d p_obj) { return view->leaves_room(p_obj); }, threads);
  std::unique_ptr<Reconstruction> next(new Reconstruction(std::move(evidence), options_, std::move(view)));
  next->frames_ = frames_;
  next->measure_all(threads);
  return next;
}

// The distances of the whole volume, from nothing.
void Reconstruction::measure_all(int threads) {
  std::vector<int> all(
      static_cast<std::size_t>(evidence_.blocks_x() * evidence_.blocks_y() * evidence_.blocks_z()));
  std::iota(all.begin(), all.end(), 0);
  distance_.update(evidence_, all, kFirstRounds, options_.band_voxels, threads, true);
  distance_.sweep_far(options_.band_voxels);
  distance_.fill_far(options_.band_voxels, 0, grid().nz, threads);
}

// Nothing of the object is where its recording's first frame leaves no room for it, nor where others have
// looked past.
bool Reconstruction::has_room(Vec3d p_obj) const {
  if (view_ && !view_->may_hold(p_obj)) return false;
  const Vec3d at = (1 / grid().voxel_m) * (p_obj - grid().origin_obj) + Vec3d{0.5, 0.5, 0.5};
  const int x = to_int(std::floor(at.x)), y = to_int(std::floor(at.y)), z = to_int(std::floor(at.z));
  if (x < 0 || y < 0 || z < 0 || x >= grid().nx || y >= grid().ny || z >= grid().nz) return true;
  const std::size_t voxel = grid().index(x, y, z);
  const float weight = evidence_.weight()[voxel];
  return !(phi()[voxel] > options_.roles.near_m && weight > kEmptyFrames * levelset::kCarvedWeight &&
           evidence_.log_ratio()[voxel] < kEmptyRatio * weight);
}

void Reconstruction::find_roles(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj) {
  if (field_ && frame.foreground) {
    roles_ = finder_.from_colors(frame.rect, frame.depth_m, frame.foreground);
    if (roles_) return;  // else no colours are known
  }
  const SdfView sdf = grid().view(phi().data());
  const Rigidf T_obj_cam = inverse(T_cam_obj).cast<float>();
  const auto read_at = [&](int x, int y) {
    const Vec3d r = camera.distorted() ? camera.pixel_ray(x, y) : ray(camera.K, 1.0 * x, 1.0 * y);
    return T_obj_cam * (frame.depth_m(x, y) * r.cast<float>());
  };
  reading_distance_m_.clear();
  for (int y = frame.rect.y0; y < frame.rect.y1; ++y)
    for (int x = frame.rect.x0; x < frame.rect.x1; ++x) {
      const float z = frame.depth_m(x, y);
      float phi = std::numeric_limits<float>::quiet_NaN();
      Vec3f unused;
      if (z > 0 && std::isfinite(z)) sample(sdf, read_at(x, y), &phi, &unused);
      reading_distance_m_.push_back(phi);
    }
  roles_ = &finder_.find(frame.rect, reading_distance_m_, frame.foreground, frame.depth_m, options_.roles,
                         [&](int x, int y) { return has_room(read_at(x, y).cast<double>()); });
}

// A part in each frame.
void Reconstruction::update_far(int threads) {
  const int every = options_.far_every * (frames_ < kYoungRounds * options_.far_every ? 1 : 2);
  const int part = frames_ % every, nz = grid().nz;
  if (part == 0) distance_.sweep_far(options_.band_voxels);
  distance_.fill_far(options_.band_voxels, nz * part / every, nz * (part + 1) / every, threads);
}

void Reconstruction::fuse(const FrameEvidence& frame, const Camera& camera, const Rigidd& T_cam_obj,
                          int threads) {
  if (frame.mask) {
    roles_ = &finder_.from_mask(frame.rect, frame.depth_m, frame.mask);
  } else {
    find_roles(frame, camera, T_cam_obj);
  }
  image_.make(frame.depth_m, camera, frame.rect, roles_->data(), options_.image);
  const std::vector<int>& changed =
      evidence_.fuse(image_, {frame.rgb}, camera, T_cam_obj, options_.evidence, threads);
  follow(changed, threads);
  ++frames_;
}

// The shape, after these blocks have been fused.
void Reconstruction::follow(const std::vector<int>& changed, int threads) {
  if (field_) {
    field_->evolve(evidence_.log_ratio().data(), frames_ ? options_.evolution_steps : options_.first_steps,
                   options_.evolve, threads);
  } else if (frames_ == 0) {
    measure_all(threads);
  } else {
    distance_.update(evidence_, changed, options_.rounds, options_.band_voxels, threads);
    update_far(threads);
  }
}

}  // namespace sdftrack::reconstruction

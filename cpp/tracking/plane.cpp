// SPDX-License-Identifier: MIT
#include "tracking/plane.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sdftrack {

namespace {

constexpr int kPoints = 4800;    // readings of the last fit, on an even grid
constexpr int kFewPoints = 600;  // of those before it
constexpr int kFollowPoints = 1500;
constexpr int kFramesBetweenSearches = 30;
constexpr int kSeeds = 150;             // patches tried
constexpr int kPatchNodes[2] = {2, 4};  // half widths of patches, in turn
constexpr double kPatchFilled = 0.6;    // of a patch's nodes have a reading
constexpr double kPatchRough = 4;       // times the law: a patch is no plane
constexpr int kBest = 5;                // patches that are extended and refitted
constexpr double kLoose = 3;            // slabs, that the readings of a patch's plane may be off
constexpr std::size_t kLeastPoints = 20;
constexpr double kLeastShare = 0.1;    // of the readings
constexpr double kBehind_m = 0.3;      // a box's top is not farther than this from what it stands on
constexpr double kBehindShare = 0.25;  // of the readings of the plane before it
const double kParallel = std::cos(8 * 3.14159265358979 / 180);

PlaneRuler ruler_of(const Camera& camera, const PlaneOptions& options) {
  return {options.tolerance_m, std::sqrt(camera.K.fx * camera.K.fy), options.noise.lateral_px};
}

// Every so-manieth reading.
std::vector<PlaneReading> thinned(const std::vector<PlaneReading>& readings, std::size_t wanted) {
  const std::size_t stride = std::max<std::size_t>(1, readings.size() / wanted);
  std::vector<PlaneReading> few;
  for (std::size_t i = stride / 2; i < readings.size(); i += stride) few.push_back(readings[i]);
  return few;
}

// Whether a plane explains a patch up to a few sd of the noise.
bool flat(const std::vector<PlaneReading>& patch, const PlaneRuler& ruler, const InversePlane& plane) {
  double squares = 0;
  for (const PlaneReading& p : patch) {
    const double u = plane_residual(plane, p) / plane_residual_sd(plane, p, ruler);
    squares += u * u;
  }
  return squares < kPatchRough * kPatchRough * static_cast<double>(patch.size());
}

// Readings of the square of nodes about one of them; none where too few were measured.
void patch_about(const PlaneGrid& grid, int column, int row, int half, std::vector<PlaneReading>* patch) {
  patch->clear();
  if (column < half || row < half || column + half >= grid.columns || row + half >= grid.rows) return;
  for (int j = row - half; j <= row + half; ++j)
    for (int i = column - half; i <= column + half; ++i) {
      const PlaneReading& p = grid.nodes[static_cast<std::size_t>(j * grid.columns + i)];
      if (p.depth_m > 0) patch->push_back(p);
    }
  const int side = 2 * half + 1;
  if (static_cast<double>(patch->size()) < kPatchFilled * side * side) patch->clear();
}

struct Candidate {
  InversePlane plane;
  int votes;
};

// The planes of flat patches all over the image that most readings lie near, best first.
std::vector<Candidate> best_patches(const PlaneGrid& grid, const std::vector<PlaneReading>& few,
                                    const PlaneRuler& ruler) {
  PlaneRuler loose = ruler;
  loose.tolerance_m *= kLoose;
  std::vector<Candidate> found;
  std::vector<PlaneReading> patch;
  for (int k = 0; k < kSeeds; ++k) {
    // Additive recurrence: seeds that fill the image evenly, the same ones every time.
    const double a = std::fmod(0.5 + 0.7548776662 * k, 1.0), b = std::fmod(0.5 + 0.5698402910 * k, 1.0);
    const int widest = std::max(1, (std::min(grid.columns, grid.rows) - 1) / 2);
    patch_about(grid, static_cast<int>(a * grid.columns), static_cast<int>(b * grid.rows),
                std::min(widest, kPatchNodes[k % 2]), &patch);
    InversePlane plane;
    if (!fit_patch(patch, &plane) || !flat(patch, ruler, plane)) continue;
    found.push_back({plane, plane_votes(few, loose, plane)});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
  return found;
}

// The plane about the start pixel: of all readings of a square about it.
PlaneMiss start_patch(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options,
                      const PlaneRuler& ruler, InversePlane* plane) {
  if (!(plane_reading(frame, camera, options.noise, options.start_x, options.start_y).depth_m > 0))
    return PlaneMiss::kNoStart;
  const int half = std::max(2, camera.width / 40);
  std::vector<PlaneReading> patch;
  for (int y = std::max(0, options.start_y - half); y <= std::min(camera.height - 1, options.start_y + half);
       ++y)
    for (int x = std::max(0, options.start_x - half); x <= std::min(camera.width - 1, options.start_x + half);
         ++x) {
      const PlaneReading p = plane_reading(frame, camera, options.noise, x, y);
      if (p.depth_m > 0) patch.push_back(p);
    }
  if (!fit_patch(patch, plane) || !flat(patch, ruler, *plane)) return PlaneMiss::kStartNotFlat;
  return PlaneMiss::kNone;
}

// A plane parallel to this one and a little behind it, with enough readings: what the box stands on whose top
// this is.
bool step_behind(const std::vector<PlaneReading>& few, const PlaneRuler& ruler, Candidate* best) {
  const double length = norm(best->plane.g), bin_m = std::max(0.005, ruler.tolerance_m);
  std::vector<int> counts(static_cast<std::size_t>(kBehind_m / bin_m) + 2, 0);
  for (const PlaneReading& p : few) {
    const double below_m = -plane_residual(best->plane, p) / length;
    if (below_m > 2 * bin_m && below_m < kBehind_m) ++counts[static_cast<std::size_t>(below_m / bin_m)];
  }
  const auto fullest = std::max_element(counts.begin(), counts.end()) - counts.begin();
  if (2 * counts[static_cast<std::size_t>(fullest)] < kBehindShare * best->votes) return false;
  Candidate behind = *best;
  const double offset_m = 1 / length + (static_cast<double>(fullest) + 0.5) * bin_m;
  behind.plane.g = (1 / (length * offset_m)) * best->plane.g;
  double scale = 1;
  if (!fit_plane(few, ruler, 3, false, &behind.plane, &scale)) return false;
  behind.votes = plane_votes(few, ruler, behind.plane);
  const double cosine = dot(behind.plane.g, best->plane.g) / (norm(behind.plane.g) * length);
  if (cosine < kParallel || behind.votes < kBehindShare * best->votes ||
      1 / norm(behind.plane.g) < 1 / length + bin_m)
    return false;
  *best = behind;
  return true;
}

// The best patch's plane, refitted among a few readings.
bool extended(const PlaneGrid& grid, const std::vector<PlaneReading>& few, const PlaneRuler& ruler,
              Candidate* best) {
  std::vector<Candidate> found = best_patches(grid, few, ruler);
  best->votes = 0;
  for (std::size_t k = 0; k < found.size() && k < kBest; ++k) {
    double scale = 1;
    Candidate& c = found[k];
    if (!fit_plane(few, ruler, 3, false, &c.plane, &scale)) continue;
    c.votes = plane_votes(few, ruler, c.plane);
    if (c.votes > best->votes) *best = c;
  }
  if (best->votes == 0) return false;
  for (int k = 0; k < 3 && step_behind(few, ruler, best); ++k) {
  }
  return true;
}

}  // namespace

FoundPlane search_plane(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options) {
  const PlaneRuler ruler = ruler_of(camera, options);
  PlaneGrid grid;
  fill_grid(frame, camera, options.noise, options.leave_out, kPoints, &grid);
  FoundPlane found;
  const auto missed = [&found](PlaneMiss why) {
    found.miss = why;
    return found;
  };
  if (grid.read.size() < kLeastPoints) return missed(PlaneMiss::kFewReadings);
  const std::vector<PlaneReading> few = thinned(grid.read, kFewPoints);
  Candidate best{{}, 0};
  if (options.start_x >= 0) {
    const PlaneMiss miss = start_patch(frame, camera, options, ruler, &best.plane);
    if (miss != PlaneMiss::kNone) return missed(miss);
    double scale = 1;
    if (options.method != PlaneMethod::kPrinted && !fit_plane(few, ruler, 3, false, &best.plane, &scale))
      return missed(PlaneMiss::kSmall);
  } else if (options.method == PlaneMethod::kPrinted) {
    const std::vector<Candidate> patches = best_patches(grid, few, ruler);
    if (patches.empty()) return missed(PlaneMiss::kSmall);
    best = patches[0];
  } else if (!extended(grid, few, ruler, &best)) {
    return missed(PlaneMiss::kSmall);
  }
  found.plane = best.plane;
  if (options.method != PlaneMethod::kPrinted &&
      !fit_plane(grid.read, ruler, 4, false, &found.plane, &found.noise_scale))
    return missed(PlaneMiss::kSmall);
  if (options.method == PlaneMethod::kBent &&
      !fit_plane(grid.read, ruler, 6, true, &found.plane, &found.noise_scale))
    return missed(PlaneMiss::kSmall);
  const int votes = plane_votes(grid.read, ruler, found.plane);
  found.share = static_cast<double>(votes) / static_cast<double>(grid.read.size());
  if (found.share < kLeastShare || static_cast<std::size_t>(votes) < kLeastPoints)
    return missed(PlaneMiss::kSmall);
  return found;
}

std::optional<Plane> find_plane(const DepthFrame& frame, const Camera& camera, const PlaneOptions& options) {
  const FoundPlane found = search_plane(frame, camera, options);
  if (found.miss != PlaneMiss::kNone) return std::nullopt;
  return normal_form(found.plane);
}

void PlaneFollower::update(const DepthFrame& frame, const Camera& camera, const std::vector<Rect>& objects) {
  PlaneOptions options;
  options.leave_out = objects;
  if (plane_) {
    fill_grid(frame, camera, options.noise, objects, kFollowPoints, &grid_);
    const PlaneRuler ruler = ruler_of(camera, options);
    InversePlane moved;
    moved.g = (-1 / plane_->offset_m) * plane_->normal_cam;
    double scale = 1;
    if (fit_plane(grid_.read, ruler, 3, false, &moved, &scale) &&
        plane_votes(grid_.read, ruler, moved) > kLeastShare * static_cast<double>(grid_.read.size())) {
      plane_ = normal_form(moved);
      return;
    }
    plane_.reset();
  }
  if (frames_to_search_-- > 0) return;
  plane_ = find_plane(frame, camera, options);
  frames_to_search_ = kFramesBetweenSearches;
}

}  // namespace sdftrack

// SPDX-License-Identifier: MIT
#include "plane/plane.h"

#include "base/to_int.h"

namespace sdftrack::plane {

namespace {

constexpr int kPoints = 4800;      // measurements of the last fit, on a regular grid
constexpr int kFewPoints = 600;    // of the fits before it
constexpr int kBentPoints = 2000;  // ten unknowns then take as long as three with kPoints
constexpr int kFollowPoints = 1500;
constexpr int kFramesBetweenSearches = 30;
constexpr int kSeeds = 150;             // patches tried
constexpr int kPatchNodes[2] = {2, 4};  // half widths of patches, in turn
constexpr double kPatchFilled = 0.6;    // share of a patch's nodes with a measurement
constexpr double kPatchRough = 4;       // times the law: above, a patch is not a plane
constexpr int kRounds = 3, kLastRounds = 2,
              kBentRounds = 5;    // of refitting to few measurements, to all, and bent
constexpr int kSteps = 3;         // levels in a stack of boxes
constexpr std::size_t kBest = 5;  // patches that are extended and refitted
constexpr double kLoose = 3;      // slabs: tolerance for measurements of a patch's plane
constexpr std::size_t kMinPoints = 20;
constexpr double kMinShare = 0.1;      // of the measurements
constexpr double kBehind_m = 0.3;      // a box's top is not farther than this from what it stands on
constexpr double kBehindShare = 0.25;  // of the measurements of the plane in front of it
const double kParallel = std::cos(8 * 3.14159265358979 / 180);

// Every n-th measurement, about `requested` of them.
std::vector<PlaneReading> thinned(const std::vector<PlaneReading>& readings, std::size_t requested) {
  const std::size_t stride = std::max<std::size_t>(1, readings.size() / requested);
  std::vector<PlaneReading> few;
  for (std::size_t i = stride / 2; i < readings.size(); i += stride) few.push_back(readings[i]);
  return few;
}

// Whether a plane fits a patch within a few sd of the noise.
bool flat(const std::vector<PlaneReading>& patch, const PlaneRuler& ruler, const InversePlane& plane) {
  const PlaneGauge gauge(plane, ruler);
  double squares = 0;
  for (const PlaneReading& p : patch) {
    const double e = gauge.residual(p);
    squares += e * e / gauge.variance(gauge.depth(p));
  }
  return squares < kPatchRough * kPatchRough * double(patch.size());
}

// The measurements in the square of nodes around a node; none if too few were measured.
void patch_about(const PlaneGrid& grid, int column, int row, int half, std::vector<PlaneReading>* patch) {
  patch->clear();
  if (column < half || row < half || column + half >= grid.columns || row + half >= grid.rows) return;
  for (int j = row - half; j <= row + half; ++j)
    for (int i = column - half; i <= column + half; ++i) {
      const PlaneReading& p = grid.nodes[j * grid.columns + i];
      if (p.depth_m > 0) patch->push_back(p);
    }
  const int side = 2 * half + 1;
  if (double(patch->size()) < kPatchFilled * side * side) patch->clear();
}

struct Candidate {
  InversePlane plane;
  int votes = 0;
  int column = 0, row = 0;  // the patch's middle on the grid
};

// The planes of flat patches in the whole image, those near most measurements first.
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
    const int column = to_int(a * grid.columns), row = to_int(b * grid.rows);
    patch_about(grid, column, row, std::min(widest, kPatchNodes[k % 2]), &patch);
    InversePlane plane;
    if (!fit_patch(patch, &plane) || !flat(patch, ruler, plane)) continue;
    found.push_back({plane, plane_votes(few, loose, plane), column, row});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
  return found;
}

// All measurements of the square around a pixel.
std::vector<PlaneReading> whole_patch(const frame::DepthFrame& frame, const Camera& camera, int at_x,
                                      int at_y) {
  const int half = std::max(2, camera.width / 40);
  const int top = std::max(0, at_y - half), left = std::max(0, at_x - half);
  std::vector<PlaneReading> patch;
  for (int y = top; y <= std::min(camera.height - 1, at_y + half); ++y)
    for (int x = left; x <= std::min(camera.width - 1, at_x + half); ++x) {
      const PlaneReading p = plane_reading(frame, camera, x, y);
      if (p.depth_m > 0) patch.push_back(p);
    }
  return patch;
}

// Finds a parallel plane a little behind this one, with enough measurements: if this is the top of a box, the
// plane that the box stands on.
bool step_behind(const std::vector<PlaneReading>& few, const PlaneRuler& ruler, Candidate* best) {
  const PlaneGauge gauge(best->plane, ruler);
  const double length = gauge.length, bin_m = std::max(0.005, ruler.tolerance_m);
  std::vector<int> counts(std::size_t(kBehind_m / bin_m) + 2, 0);
  for (const PlaneReading& p : few) {
    const double below_m = -gauge.residual(p) / length;
    if (below_m > 2 * bin_m && below_m < kBehind_m) ++counts[below_m / bin_m];
  }
  const auto fullest = std::max_element(counts.begin(), counts.end()) - counts.begin();
  if (2 * counts[fullest] < kBehindShare * best->votes) return false;
  Candidate behind = *best;
  const double offset_m = 1 / length + (double(fullest) + 0.5) * bin_m;
  behind.plane.g = (1 / (length * offset_m)) * best->plane.g;
  double scale = 1;
  if (!fit_plane(few, ruler, kRounds, PlaneStart::kRough, &behind.plane, &scale)) return false;
  behind.votes = plane_votes(few, ruler, behind.plane);
  const double cosine = dot(behind.plane.g, best->plane.g) / (norm(behind.plane.g) * length);
  if (cosine < kParallel || behind.votes < kBehindShare * best->votes ||
      1 / norm(behind.plane.g) < 1 / length + bin_m)
    return false;
  *best = behind;
  return true;
}

// The best patch's plane, refitted to a few measurements; without votes: none was found.
Candidate extended(const PlaneGrid& grid, const std::vector<PlaneReading>& few, const PlaneRuler& ruler) {
  std::vector<Candidate> found = best_patches(grid, few, ruler);
  if (found.size() > kBest) found.resize(kBest);
  Candidate best;
  for (Candidate& c : found) {
    double scale = 1;
    if (!fit_plane(few, ruler, kRounds, PlaneStart::kRough, &c.plane, &scale)) continue;
    c.votes = plane_votes(few, ruler, c.plane);
    if (c.votes > best.votes) best = c;
  }
  for (int k = 0; best.votes > 0 && k < kSteps && step_behind(few, ruler, &best); ++k) {
  }
  return best;
}

// The plane of the patch at the start pixel, refitted to `few` measurements; it must still hold the patch.
PlaneMiss started(const frame::DepthFrame& frame, const Camera& camera, const PlaneOptions& options,
                  const std::vector<PlaneReading>& few, const PlaneRuler& ruler, InversePlane* plane) {
  if (!(plane_reading(frame, camera, options.start_x, options.start_y).depth_m > 0))
    return PlaneMiss::kNoStart;
  const std::vector<PlaneReading> patch = whole_patch(frame, camera, options.start_x, options.start_y);
  if (!fit_patch(patch, plane) || !flat(patch, ruler, *plane)) return PlaneMiss::kStartNotFlat;
  if (options.method == PlaneMethod::kPrinted) return PlaneMiss::kNone;
  double scale = 1;
  const bool holds = fit_plane(few, ruler, kRounds, PlaneStart::kRough, plane, &scale) &&
                     2 * std::size_t(plane_votes(patch, ruler, *plane)) > patch.size();
  return holds ? PlaneMiss::kNone : PlaneMiss::kSmall;
}

// The first plane, good to a few times its final error.
PlaneMiss first_plane(const frame::DepthFrame& frame, const Camera& camera, const PlaneOptions& options,
                      const PlaneGrid& grid, const PlaneRuler& ruler, InversePlane* plane) {
  const std::vector<PlaneReading> few = thinned(grid.read, kFewPoints);
  if (options.start_x >= 0) return started(frame, camera, options, few, ruler, plane);
  Candidate best;
  if (options.method == PlaneMethod::kPrinted) {
    const std::vector<Candidate> patches = best_patches(grid, few, ruler);
    if (patches.empty()) return PlaneMiss::kSmall;
    best = patches[0];
    fit_patch(whole_patch(frame, camera, grid.x_of(best.column), grid.y_of(best.row)), &best.plane);
  } else {
    best = extended(grid, few, ruler);
  }
  *plane = best.plane;
  return best.votes > 0 ? PlaneMiss::kNone : PlaneMiss::kSmall;
}

bool refitted(const PlaneGrid& grid, const PlaneRuler& ruler, PlaneMethod method, FoundPlane* found) {
  if (method == PlaneMethod::kPrinted) return true;
  return fit_plane(grid.read, ruler, kLastRounds, PlaneStart::kNear, &found->plane, &found->noise_scale) &&
         (method != PlaneMethod::kBent || fit_plane(thinned(grid.read, kBentPoints), ruler, kBentRounds,
                                                    PlaneStart::kBend, &found->plane, &found->noise_scale));
}

}  // namespace

FoundPlane search_plane(const frame::DepthFrame& frame, const Camera& camera, const PlaneOptions& options) {
  const PlaneRuler ruler = plane_ruler(camera, options.tolerance_m, options.noise);
  PlaneGrid grid;
  fill_grid(frame, camera, options.leave_out, kPoints, &grid);
  FoundPlane found;
  if (grid.read.size() < kMinPoints) {
    found.miss = PlaneMiss::kFewReadings;
    return found;
  }
  found.miss = first_plane(frame, camera, options, grid, ruler, &found.plane);
  if (found.miss != PlaneMiss::kNone) return found;
  const int votes =
      refitted(grid, ruler, options.method, &found) ? plane_votes(grid.read, ruler, found.plane) : 0;
  found.share = double(votes) / double(grid.read.size());
  if (found.share < kMinShare || votes < int(kMinPoints)) found.miss = PlaneMiss::kSmall;
  return found;
}

std::optional<frame::Plane> find_plane(const frame::DepthFrame& frame, const Camera& camera,
                                       const PlaneOptions& options) {
  const FoundPlane found = search_plane(frame, camera, options);
  if (found.miss != PlaneMiss::kNone) return std::nullopt;
  return normal_form(found.plane);
}

void PlaneFollower::update(const frame::DepthFrame& frame, const Camera& camera,
                           const std::vector<frame::Rect>& objects) {
  PlaneOptions options;
  options.leave_out = objects;
  if (plane_) {
    fill_grid(frame, camera, objects, kFollowPoints, &grid_);
    const PlaneRuler ruler = plane_ruler(camera, options.tolerance_m, options.noise);
    InversePlane moved;
    moved.g = (-1 / plane_->offset_m) * plane_->normal_cam;
    double scale = 1;
    if (fit_plane(grid_.read, ruler, kRounds, PlaneStart::kRough, &moved, &scale) &&
        plane_votes(grid_.read, ruler, moved) > kMinShare * double(grid_.read.size())) {
      plane_ = normal_form(moved);
      return;
    }
    plane_.reset();
  }
  if (frames_to_search_-- > 0) return;
  plane_ = find_plane(frame, camera, options);
  frames_to_search_ = kFramesBetweenSearches;
}

}  // namespace sdftrack::plane

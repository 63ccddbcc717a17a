// SPDX-License-Identifier: MIT
#include "reconstruction/prior.h"

#include <algorithm>
#include <cmath>

namespace sdftrack::reconstruction {

namespace {

constexpr double kSidePerBall =
    1.8;                             // of its diameter: as in the thesis' section 4.6, with room for the rest
constexpr double kFades_voxels = 4;  // sigma_G of thesis Eq. 4.34
constexpr float kInfluence = 0.5f;   // a of thesis Eq. 4.34

// Scaled to full weight a few voxels from the surface.
void fade(double weight, double voxel_m, std::vector<float>* inside_m) {
  const auto factor = float(weight / (kFades_voxels * voxel_m));
  const auto most = float(weight);
  for (float& value : *inside_m) value = std::clamp(value * factor, -most, most);
}

// value(x, y, z) at each voxel.
template <class Value>
std::vector<float> filled(const sdf::Grid& grid, const Value& value) {
  std::vector<float> out(grid.size());
  float* to = out.data();
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y, to += grid.nx)
      for (int x = 0; x < grid.nx; ++x) to[x] = value(x, y, z);
  return out;
}

}  // namespace

sdf::Grid lattice_for(const Beginning& beginning, const KnownShape* initial, int voxels,
                      const std::optional<double>& side_m) {
  Vec3d middle{0, 0, 0};
  double widest = 2 * beginning.ball.radius_m;
  if (initial) {
    const KnownShape::Extent box = initial->extent();
    const Vec3d size = box.high - box.low;
    middle = 0.5 * (box.low + box.high);
    widest = std::max({widest, size.x, size.y, size.z});
  }
  const double side = side_m.value_or(kSidePerBall * widest), half = 0.5 * side;
  return {voxels, voxels, voxels, side / (voxels - 1), middle - Vec3d{half, half, half}};
}

std::vector<float> distances_at(const sdf::Grid& grid, const KnownShape& shape) {
  const SdfView view = shape.view();
  return filled(grid, [&](int x, int y, int z) {
    double phi;
    Vec3d unused;
    sample(view, grid.point(x, y, z), &phi, &unused);
    return float(phi);
  });
}

std::vector<float> ball_prior(const Ball& ball, double weight, const sdf::Grid& grid, bool bounded) {
  const auto radius = float(ball.radius_m * (bounded ? kWider : 1));
  const auto back = float(ball.shorter_m - ball.behind_m);
  const auto voxel = float(grid.voxel_m);
  const Vec3f origin = grid.origin_obj.cast<float>();
  const auto at = [&](int i, float first) { return float(i) * voxel + first; };
  std::vector<float> guess = filled(grid, [&](int ix, int iy, int iz) {
    const float x = at(ix, origin.x), y = at(iy, origin.y), z = at(iz, origin.z);
    const float inside = radius - std::sqrt(z * z + y * y + x * x);
    return bounded ? std::min(inside, back - z) : inside;
  });
  fade(weight, grid.voxel_m, &guess);
  return guess;
}

std::vector<float> shape_prior(const KnownShape& shape, double weight, const sdf::Grid& grid) {
  std::vector<float> guess = distances_at(grid, shape);
  for (float& value : guess) value = -value;
  fade(weight, grid.voxel_m, &guess);
  return guess;
}

std::vector<float> printed_shape(const Ball& ball, const KnownShape* initial, const sdf::Grid& grid) {
  if (initial) return distances_at(grid, *initial);
  const double radius_m = std::sqrt(0.5 * ball.shorter_m * ball.radius_m);
  const Vec3d back = ((radius_m - ball.behind_m) / ball.centre_cam.z) * ball.centre_cam;
  return filled(grid,
                [&](int x, int y, int z) { return float(norm(grid.point(x, y, z) - back) - radius_m); });
}

std::vector<float> printed_prior(const float* shape_m, std::size_t count, double voxel_m) {
  const auto fades = float(kFades_voxels * voxel_m);
  std::vector<float> guess;
  guess.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float inside = kInfluence / (1 + std::exp(shape_m[i] / fades)) + 0.5f * (1 - kInfluence);
    guess.push_back(std::log(inside / (1 - inside)));
  }
  return guess;
}

}  // namespace sdftrack::reconstruction

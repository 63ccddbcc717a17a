// SPDX-License-Identifier: MIT
#include "reconstruction/surface.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/parallel.h"
#include "base/quantile.h"
#include "levelset/zero_mesh.h"
#include "reconstruction/bodies.h"

namespace sdftrack::reconstruction {

namespace {

constexpr int kMargin_voxels = 8;
constexpr double kBand_voxels = 8, kGuessBlur_voxels = 2.5, kSeenBlur_voxels = 1, kBlurEnds = 2;
constexpr float kMinWeight = 0.1f;  // frames; of less nothing is known
constexpr int kEnclosed = 5;        // of six directions
constexpr float kJustOutside_m = 1e-6f;

// A box of voxels.
struct Part {
  int low[3], n[3];  // x, y, z

  std::size_t size() const { return std::size_t(n[0]) * n[1] * n[2]; }
  std::size_t index(int x, int y, int z) const { return (std::size_t(z) * n[1] + y) * n[0] + x; }
};

Part part_around(const std::vector<sdf::VoxelBox>& boxes, const sdf::Grid& grid) {
  int low[3] = {grid.nx, grid.ny, grid.nz}, high[3] = {0, 0, 0};
  for (const sdf::VoxelBox& b : boxes) {
    const int from[3] = {b.x0, b.y0, b.z0}, to[3] = {b.x1, b.y1, b.z1};
    for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], from[a]), high[a] = std::max(high[a], to[a]);
  }
  const int most[3] = {grid.nx, grid.ny, grid.nz};
  Part out{};
  for (int a = 0; a < 3; ++a) {
    out.low[a] = std::max(0, low[a] - kMargin_voxels);
    out.n[a] = std::min(most[a], high[a] + kMargin_voxels) - out.low[a];
  }
  return out;
}

// value(i) of each voxel of the part, i in the whole volume.
template <class T, class Value>
std::vector<T> copied(const Part& part, const sdf::Grid& grid, const Value& value) {
  std::vector<T> out(part.size());
  T* to = out.data();
  for (int z = 0; z < part.n[2]; ++z)
    for (int y = 0; y < part.n[1]; ++y, to += part.n[0]) {
      const std::size_t from = grid.index(part.low[0], part.low[1] + y, part.low[2] + z);
      for (int x = 0; x < part.n[0]; ++x) to[x] = value(from + std::size_t(x));
    }
  return out;
}

// Half of a Gaussian's weights, from the middle on; their whole sum is 1.
std::vector<double> gaussian(double sigma) {
  const int reach = int(kBlurEnds * sigma + 0.5);
  std::vector<double> out;
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    out.push_back(std::exp(-0.5 / (sigma * sigma) * (1.0 * i * i)));
    sum += i == 0 ? out.back() : 2 * out.back();
  }
  for (double& w : out) w /= sum;
  return out;
}

// Blurs along one axis, mirrored at the ends of the part.
void blur_axis(const Part& part, int axis, const std::vector<double>& weights, int threads,
               std::vector<float>* values) {
  const int n = part.n[axis], reach = int(weights.size()) - 1;
  const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
  const auto at = [&](int i, int j, int k) {
    return axis == 0 ? part.index(i, j, k) : axis == 1 ? part.index(j, i, k) : part.index(j, k, i);
  };
  parallel_for(part.n[b], threads, [&](std::size_t slice) {
    const int k = int(slice);
    std::vector<double> line(n + 2 * reach);
    for (int j = 0; j < part.n[a]; ++j) {
      for (int i = -reach; i < n + reach; ++i) {
        int from = i;
        while (from < 0 || from >= n) from = from < 0 ? -1 - from : 2 * n - 1 - from;
        line[i + reach] = (*values)[at(from, j, k)];
      }
      for (int i = 0; i < n; ++i) {
        const double* const middle = line.data() + i + reach;
        double sum = middle[0] * weights[0];
        for (int w = reach; w > 0; --w) sum += (middle[-w] + middle[w]) * weights[w];
        (*values)[at(i, j, k)] = float(sum);
      }
    }
  });
}

std::vector<float> blurred(const Part& part, std::vector<float> values, double sigma, int threads) {
  const std::vector<double> weights = gaussian(sigma);
  for (const int axis : {2, 1, 0}) blur_axis(part, axis, weights, threads, &values);
  return values;
}

// The unobserved part of the field has no detail; the observed part is unchanged, within a band.
void smooth_where_unseen(const Part& part, const std::vector<std::uint16_t>& seen, double voxel_m,
                         int threads, std::vector<float>* phi) {
  const auto band = float(kBand_voxels * voxel_m);
  for (float& value : *phi) value = std::clamp(value, -band, band);
  std::vector<float> share(seen.begin(), seen.end());
  for (float& value : share) value = value > 0 ? 1.0f : 0.0f;
  share = blurred(part, std::move(share), kSeenBlur_voxels, threads);
  const std::vector<float> smooth = blurred(part, *phi, kGuessBlur_voxels, threads);
  for (std::size_t i = 0; i < phi->size(); ++i) {
    const float own = std::clamp(2 * share[i], 0.0f, 1.0f);
    (*phi)[i] = own * (*phi)[i] + (1 - own) * smooth[i];
  }
}

// Only the largest body remains, and it is closed even where the volume ends.
void leave_largest(const Part& part, double voxel_m, std::vector<float>* phi) {
  const Bodies bodies = bodies_of(part.n[0], part.n[1], part.n[2], phi->data());
  for (const BodyRun& run : bodies.runs)
    if (run.body != bodies.largest)
      for (int x = run.x0; x < run.x1; ++x) (*phi)[part.index(x, run.y, run.z)] = kJustOutside_m;
  const auto outside = float(voxel_m);
  for (int z = 0; z < part.n[2]; ++z)
    for (int y = 0; y < part.n[1]; ++y)
      for (int x = 0; x < part.n[0]; ++x) {
        const bool border =
            x == 0 || y == 0 || z == 0 || x == part.n[0] - 1 || y == part.n[1] - 1 || z == part.n[2] - 1;
        float& value = (*phi)[part.index(x, y, z)];
        if (border) value = std::max(value, outside);
      }
}

// Vertices that were not seen have the median of the others' colours.
void fill_colors(SurfaceMesh* mesh) {
  std::vector<double> known[3];
  bool colored = false;
  for (std::size_t i = 0; i < mesh->seen.size(); ++i)
    for (std::size_t c = 0; c < 3 && mesh->seen[i] > 0; ++c) {
      known[c].push_back(mesh->rgb[3 * i + c]);
      colored |= mesh->rgb[3 * i + c] != 0;
    }
  if (!colored) {
    mesh->rgb.clear();
    return;
  }
  std::uint8_t middle[3];
  for (std::size_t c = 0; c < 3; ++c) middle[c] = static_cast<std::uint8_t>(median(&known[c]));
  for (std::size_t i = 0; i < mesh->seen.size(); ++i)
    if (!(mesh->seen[i] > 0)) std::copy(middle, middle + 3, mesh->rgb.begin() + static_cast<long>(3 * i));
}

std::uint8_t rounded_color(std::uint16_t color) {
  return static_cast<std::uint8_t>(std::min(255, (color + 128) >> 8));
}

// Where nothing is known, the object ends at the far side that its first view suggests, instead of the first
// guess: what the tracker sees must not depend on it (docs/notes/reconstruction.md).
void end_at_far_side(const Reconstruction& volume, const Part& part, const std::vector<float>& weight,
                     int threads, std::vector<float>* phi) {
  const FirstView& first = *volume.far_side();
  const FirstView* const now = volume.view();
  const sdf::Grid& grid = volume.grid();
  const double band_m = kBand_voxels * grid.voxel_m;
  parallel_for(part.n[2], threads, [&](std::size_t slice) {
    const int z = int(slice);
    for (int y = 0; y < part.n[1]; ++y)
      for (int x = 0; x < part.n[0]; ++x) {
        float& value = (*phi)[part.index(x, y, z)];
        if (weight[part.index(x, y, z)] > kMinWeight) continue;
        const Vec3d p = grid.point(part.low[0] + x, part.low[1] + y, part.low[2] + z);
        const double before_m = first.before_far_side(p);
        if (value <= 0 && before_m <= 0)
          value = float(std::min(-before_m, band_m));
        else if (value > 0 && before_m > 0 && first.behind_first_guess(p) && (!now || now->leaves_room(p)))
          value = -float(std::min(before_m, band_m));
      }
  });
}

}  // namespace

void fill_cavities(int nx, int ny, int nz, const float* weight, float* phi) {
  const Part part{{0, 0, 0}, {nx, ny, nz}};
  std::vector<unsigned char> open(part.size()), inside(part.size()), enclosed(part.size());
  for (std::size_t i = 0; i < part.size(); ++i)
    inside[i] = phi[i] <= 0, open[i] = !inside[i] && weight[i] <= kMinWeight;
  const std::size_t step[3] = {1, std::size_t(nx), std::size_t(nx) * ny};
  // The first known voxel backwards along each grid line.
  const auto follow = [&](std::size_t first, std::size_t by, int n, bool back) {
    bool behind = false;
    for (int k = 0; k < n; ++k) {
      const std::size_t i = first + by * std::size_t(back ? n - 1 - k : k);
      if (!open[i]) behind = inside[i];
      enclosed[i] = static_cast<unsigned char>(enclosed[i] + behind);
    }
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int a = axis == 0 ? 1 : 0, b = axis == 2 ? 1 : 2;
    for (int k = 0; k < part.n[b]; ++k)
      for (int j = 0; j < part.n[a]; ++j)
        for (const bool back : {false, true})
          follow(step[a] * std::size_t(j) + step[b] * std::size_t(k), step[axis], part.n[axis], back);
  }
  for (std::size_t i = 0; i < part.size(); ++i)
    if (open[i] && enclosed[i] >= kEnclosed) phi[i] = -phi[i];
}

SurfaceMesh surface_mesh(const Reconstruction& volume, int threads) {
  const std::vector<sdf::VoxelBox> boxes = volume.surface_boxes();
  if (boxes.empty())
    throw std::runtime_error("mesh: no surface is left, the frames contradict the whole shape; start again");
  const sdf::Grid& grid = volume.grid();
  const Part part = part_around(boxes, grid);
  const levelset::EvidenceVolume& evidence = volume.evidence(threads);
  const std::span<const levelset::VoxelColor> colors = volume.colors();
  const std::span<const float> distances = volume.phi();
  const auto seen = copied<std::uint16_t>(part, grid, [&](std::size_t i) { return colors[i].seen; });
  std::vector<float> phi = copied<float>(part, grid, [&](std::size_t i) { return distances[i]; });
  const auto weight = copied<float>(part, grid, [&](std::size_t i) { return evidence.weight()[i]; });
  if (volume.far_side()) end_at_far_side(volume, part, weight, threads, &phi);
  fill_cavities(part.n[0], part.n[1], part.n[2], weight.data(), phi.data());
  smooth_where_unseen(part, seen, grid.voxel_m, threads, &phi);
  leave_largest(part, grid.voxel_m, &phi);
  const sdf::Grid unit{part.n[0], part.n[1], part.n[2], 1, {0, 0, 0}};
  const int device = volume.device();
  levelset::ZeroMesh zero = device == Reconstruction::kOnCpu
                                ? levelset::zero_mesh(unit, phi.data(), 0)
                                : levelset::zero_mesh_cuda(unit, phi.data(), device);
  SurfaceMesh mesh;
  mesh.faces = std::move(zero.faces);
  for (std::size_t i = 0; i + 2 < zero.vertices.size(); i += 3) {
    const double* const v = &zero.vertices[i];
    const auto nearest = [&](int a) { return part.low[a] + int(std::nearbyint(v[a])); };
    const levelset::VoxelColor& color = colors[grid.index(nearest(0), nearest(1), nearest(2))];
    const auto place = [&](int a, double origin) { return (v[a] + part.low[a]) * grid.voxel_m + origin; };
    mesh.vertices.push_back(
        {place(0, grid.origin_obj.x), place(1, grid.origin_obj.y), place(2, grid.origin_obj.z)});
    mesh.seen.push_back(color.seen_sum());
    for (const std::uint16_t c : {color.r, color.g, color.b}) mesh.rgb.push_back(rounded_color(c));
  }
  fill_colors(&mesh);
  return mesh;
}

}  // namespace sdftrack::reconstruction

// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_volume.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "base/short_text.h"
#include "base/to_int.h"
#include "sdf/bvh.h"
#include "sdf/mesh/open_mesh.h"
#include "sdf/mesh_to_sdf.h"

namespace sdftrack::sdf {

namespace {

constexpr double kMinPadding_m = 0.025;
constexpr double kLargest_m = 3, kSmallest_m = 3e-3;  // a side beyond these is more likely a wrong unit
constexpr double kThinShare = 0.02;        // of the surface: less is the rim of an edge, more is a wall
constexpr double kEnough = 4, kThick = 2;  // voxels: of the shortest side, and of a wall

[[noreturn]] void refuse(const std::string& text) { throw std::invalid_argument(text); }

std::string digits(int count, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", count, value);
  return text;
}

// `voxels` times a factor, rounded up to a multiple of ten.
double enough_voxels(int voxels, double factor) {
  return 10 * std::ceil(std::min((voxels - 1) * factor + 1, 1e9) / 10);
}

std::string use_voxels(double voxels, const char* end) {
  const std::string number = std::to_string(static_cast<long long>(voxels));
  if (voxels > kMaxVoxels)
    return "it would take " + number + " voxels, at most " + std::to_string(kMaxVoxels) +
           " are possible: thicken it in a mesh editor" + end;
  return "use voxels=" + number;
}

std::string openness(const MeshReport& report) {
  std::string out;
  if (report.open_edges) out = std::to_string(report.open_edges) + " open edges";
  if (report.non_manifold_edges)
    out += (out.empty() ? "" : " and ") + std::to_string(report.non_manifold_edges) +
           " edges in more than two faces";
  return out.empty() ? "faces of opposite orientation" : out;
}

// In metres, without vertices that are not finite and belong to no face.
CleanMesh finite_mesh(const MeshView& mesh, double unit_m, std::vector<std::string>* warnings) {
  if (mesh.vertex_count == 0 || mesh.face_count == 0)
    refuse("mesh: it is empty (" + std::to_string(mesh.vertex_count) + " vertices, " +
           std::to_string(mesh.face_count) + " faces); expected triangles" +
           (mesh.vertex_count ? "; a point cloud has no inside: reconstruct a surface from it first" : ""));
  std::vector<bool> used(mesh.vertex_count, false);
  for (std::size_t i = 0; i < mesh.face_count; ++i)
    for (const std::int32_t v : {mesh.faces[i].a, mesh.faces[i].b, mesh.faces[i].c}) used[v] = true;
  CleanMesh out;
  std::vector<std::int32_t> renamed(mesh.vertex_count, -1);
  std::size_t dropped = 0, bad = 0;
  for (std::size_t i = 0; i < mesh.vertex_count; ++i) {
    const Vec3d p = unit_m * mesh.vertices[i];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
      renamed[i] = static_cast<std::int32_t>(out.vertices.size());
      out.vertices.push_back(p);
    } else {
      ++(used[i] ? bad : dropped);
    }
  }
  if (bad)
    refuse("mesh: " + std::to_string(bad) + " of " + std::to_string(mesh.vertex_count) +
           " vertices are NaN or infinite and belong to faces; repair or remove these faces");
  if (dropped)
    warnings->push_back("mesh: " + std::to_string(dropped) +
                        " vertices that are NaN or infinite belong to no face and were dropped");
  const auto now = [&](std::int32_t v) { return renamed[v]; };
  for (std::size_t i = 0; i < mesh.face_count; ++i)
    out.faces.push_back({now(mesh.faces[i].a), now(mesh.faces[i].b), now(mesh.faces[i].c)});
  return out;
}

void check_size(Vec3d extent, bool unit_known) {
  const double side = std::max({extent.x, extent.y, extent.z});
  if (unit_known || (side >= kSmallest_m && side <= kLargest_m)) return;
  refuse("mesh: its longest side is " + digits(4, side) + " m, expected 3 mm to 3 m; " +
         (side > kLargest_m ? "is it in mm? pass unit='mm'"
                            : "in which unit is it? pass unit='m' if this is meant") +
         " (or 'cm', 'in')");
}

void check_voxels(Vec3d extent, double voxel_m, int voxels) {
  const double shortest = std::min({extent.x, extent.y, extent.z});
  if (shortest >= kEnough * voxel_m) return;
  if (shortest <= 0) refuse("mesh: it is flat (no extent along one axis); expected a solid");
  refuse("voxels: the shortest side of the object, " + digits(3, 1e3 * shortest) +
         " mm, is under 4 voxels of " + digits(3, 1e3 * voxel_m) + " mm; " +
         use_voxels(enough_voxels(voxels, kEnough * voxel_m / shortest), ",") + " or less padding");
}

std::string voxels_for_thinnest(const MeshReport& report, double voxel_m, int voxels) {
  return use_voxels(enough_voxels(voxels, kThick * voxel_m / std::max(report.thinnest_m, 1e-6)), "");
}

void warn_of_repairs(const MeshReport& report, double voxel_m, int voxels,
                     std::vector<std::string>* warnings) {
  const auto count = [](std::size_t n) { return std::to_string(n); };
  if (report.double_sided_faces)
    warnings->push_back("mesh: " + count(report.double_sided_faces) +
                        " faces were double-sided; one side of each was kept");
  if (report.inverted_parts)
    warnings->push_back(
        "mesh: " + (report.parts == 1 ? "it was" : count(report.inverted_parts) + " of its parts were") +
        " inside out; the faces were flipped outwards");
  if (report.flipped_faces)
    warnings->push_back("mesh: " + count(report.flipped_faces) +
                        " faces were oriented against their neighbours and were flipped");
  if (report.thinnest_m < kThick * voxel_m)
    warnings->push_back("mesh: parts of it, " + digits(2, 1e3 * report.thinnest_m) +
                        " mm and less, are thinner than 2 voxels of " + digits(2, 1e3 * voxel_m) +
                        " mm, and their surfaces will be inaccurate; " +
                        voxels_for_thinnest(report, voxel_m, voxels));
}

bool has_inside(const std::vector<float>& phi) {
  return std::any_of(phi.begin(), phi.end(), [](float v) { return v < 0; });
}

void fill_closed(const CleanMesh& mesh, const Bvh& bvh, const MeshVolumeOptions& options, MeshVolume* out) {
  MeshSdf found = mesh_to_sdf(mesh.view(), bvh, out->grid, kBandVoxels, options.threads);
  out->phi = std::move(found.phi);
  if (found.inside_out)
    out->warnings.push_back("mesh: it intersects itself: " + std::to_string(found.inside_out) +
                            " voxels lie inside faces that point inwards; their winding number is below 0 "
                            "and they count as outside");
}

void fill_open(const CleanMesh& mesh, const Bvh& bvh, const MeshVolumeOptions& options, MeshVolume* out) {
  OpenMeshSdf found = open_mesh_to_sdf(mesh.view(), bvh, out->grid, kBandVoxels, options.threads);
  out->phi = std::move(found.phi);
  if (options.close_holes) return;
  if (found.gap_voxels || !has_inside(out->phi))
    refuse("mesh: expected a closed surface, got " + openness(out->report) +
           "; close it in a mesh editor, or pass holes='close' to let the winding number close it");
  out->warnings.push_back("mesh: it has " + openness(out->report) +
                          ", but no gap as wide as a voxel; it was closed by the winding number");
}

}  // namespace

Grid grid_around(Vec3d low, Vec3d high, int voxels, std::optional<double> padding) {
  if (voxels < kMinVoxels || voxels > kMaxVoxels)
    refuse("voxels: expected a whole number from " + std::to_string(kMinVoxels) + " to " +
           std::to_string(kMaxVoxels) + " along the longest side, got " + std::to_string(voxels));
  if (padding && !(std::isfinite(*padding) && *padding >= 0))
    refuse("padding: expected a fraction of the longest side, 0 or more, got " + short_text(*padding));
  const Vec3d extent = high - low;
  const double longest = std::max({extent.x, extent.y, extent.z});
  double pad = padding ? *padding * longest : std::max(0.1 * longest, kMinPadding_m);
  pad = std::max(pad, 2 * longest / (voxels - 5));  // two voxels: (voxels - 1) h = longest + 4 h
  const double voxel_m = (longest + 2 * pad) / (voxels - 1);
  const auto count = [&](double side) {
    return std::min(to_int(std::ceil((side + 2 * pad) / voxel_m - 1e-6)) + 1, voxels);
  };
  const int nx = count(extent.x), ny = count(extent.y), nz = count(extent.z);
  const auto first = [&](double a, double b, int n) { return (a + b) / 2 - (n - 1) * voxel_m / 2; };
  return {
      nx, ny, nz, voxel_m, {first(low.x, high.x, nx), first(low.y, high.y, ny), first(low.z, high.z, nz)}};
}

MeshVolume mesh_volume(const MeshView& given, const MeshVolumeOptions& options) {
  MeshVolume out;
  CleanMesh mesh = clean_mesh(finite_mesh(given, options.unit_m.value_or(1), &out.warnings).view());
  if (mesh.faces.empty()) refuse("mesh: expected at least one triangle with an area, got none");
  const Bvh bvh(mesh.view());
  mesh.report.thinnest_m = thin_quantile(mesh.view(), bvh, kThinShare);
  out.report = mesh.report;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Vec3d low{kFar, kFar, kFar}, high = -low;
  for (const Face& f : mesh.faces)
    for (const std::int32_t v : {f.a, f.b, f.c}) {
      const Vec3d& p = mesh.vertices[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  check_size(high - low, options.unit_m.has_value());
  out.grid = grid_around(low, high, options.voxels, options.padding);
  check_voxels(high - low, out.grid.voxel_m, options.voxels);
  (out.report.watertight() ? fill_closed : fill_open)(mesh, bvh, options, &out);
  if (!has_inside(out.phi))
    refuse("mesh: no voxel lies inside it at a voxel size of " + digits(2, 1e3 * out.grid.voxel_m) + " mm; " +
           (out.report.thinnest_m < kThick * out.grid.voxel_m
                ? voxels_for_thinnest(out.report, out.grid.voxel_m, options.voxels) + ", or "
                : "") +
           "check that it encloses a volume and that its faces point outwards");
  warn_of_repairs(out.report, out.grid.voxel_m, options.voxels, &out.warnings);
  return out;
}

}  // namespace sdftrack::sdf

// SPDX-License-Identifier: MIT
#include <array>
#include <optional>

#include "array.h"
#include "base/parallel.h"
#include "base/volume_id.h"
#include "levelset/redistance.h"
#include "primitives/solids.h"
#include "release_gil.h"
#include "render/raycast_sdf.h"
#include "sdf/mesh/mesh_report.h"
#include "sdf/mesh/mesh_volume.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/paint.h"
#include "sdf/redistance.h"
#include "sdf/surface_samples.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// A borrowed volume; `values` must outlive it.
struct Volume {
  const float* phi;
  sdf::Grid grid;

  Volume(const py::array& values, double voxel_size, Vec3d origin)
      : phi(borrow<float>(values, "values", {-1, -1, -1})),
        grid(grid_from({values.shape(0), values.shape(1), values.shape(2)}, voxel_size, origin)) {}
  SdfView view() const { return grid.view(phi); }
  std::vector<py::ssize_t> shape() const { return {grid.nz, grid.ny, grid.nx}; }
};

py::dict report_dict(const sdf::MeshReport& r) {
  py::dict d;
  d["merged_vertices"] = r.merged_vertices;
  d["degenerate_faces"] = r.degenerate_faces;
  d["duplicate_faces"] = r.duplicate_faces;
  d["double_sided_faces"] = r.double_sided_faces;
  d["inverted_parts"] = r.inverted_parts;
  d["flipped_faces"] = r.flipped_faces;
  d["open_edges"] = r.open_edges;
  d["non_manifold_edges"] = r.non_manifold_edges;
  d["watertight"] = r.watertight();
  d["parts"] = r.parts;
  d["volume"] = r.volume_m3;
  d["thinnest"] = r.thinnest_m;
  return d;
}

py::tuple volume_of(const py::array& vertices, const py::array& faces,
                    const sdf::MeshVolumeOptions& options) {
  const sdf::MeshView mesh = mesh_view(vertices, faces, false);
  sdf::MeshVolume out = unlocked<ReleaseGilUntilSignal>([&] { return sdf::mesh_volume(mesh, options); });
  const sdf::Grid& grid = out.grid;
  return py::make_tuple(to_numpy(std::move(out.phi), {grid.nz, grid.ny, grid.nx}), grid.voxel_m,
                        grid.origin_obj, report_dict(out.report), out.warnings);
}

py::tuple grid_of(const Vec3d& low, const Vec3d& high, int voxels, std::optional<double> padding) {
  const sdf::Grid grid = sdf::grid_around(low, high, voxels, padding);
  return py::make_tuple(grid.voxel_m, py::make_tuple(grid.nz, grid.ny, grid.nx), grid.origin_obj);
}

py::tuple from_mesh(const py::array& vertices, const py::array& faces, std::array<py::ssize_t, 3> shape,
                    double voxel_size, const Vec3d& origin, double band, int threads) {
  const sdf::MeshView mesh = mesh_view(vertices, faces);
  const sdf::Grid grid = grid_from(shape, voxel_size, origin, "shape");
  sdf::MeshSdf out = unlocked<ReleaseGilUntilSignal>(
      [&] { return sdf::mesh_to_sdf(mesh, sdf::Bvh(mesh), grid, band, threads); });
  return py::make_tuple(to_numpy(std::move(out.phi), {grid.nz, grid.ny, grid.nx}), out.inside_out);
}

// Only primitives with an inside have a volume.
primitives::PrimitiveKind solid_named(const std::string& name) {
  std::string known;
  for (int k = 0; k < primitives::kPrimitiveKinds; ++k) {
    const auto kind = static_cast<primitives::PrimitiveKind>(k);
    if (!primitives::has_inside(kind)) continue;
    if (name == primitives::facts(kind).name) return kind;
    if (!known.empty()) known.append(", ");
    known.append(primitives::facts(kind).name);
  }
  throw py::value_error("kind: expected one of " + known + ", got " + name);
}

py::array_t<float> primitive(const std::string& kind, const std::vector<double>& size,
                             std::array<py::ssize_t, 3> shape, double voxel_size, const Vec3d& origin,
                             int threads) {
  const primitives::PrimitiveKind solid = solid_named(kind);
  double lengths[sdf::kMaxSizes] = {};
  for (int i = 0; i < primitives::size_count(solid); ++i) lengths[i] = size.at(static_cast<std::size_t>(i));
  const sdf::Grid grid = grid_from(shape, voxel_size, origin, "shape");
  std::vector<float> phi(grid.size());
  {
    const ReleaseGil release;
    parallel_for(static_cast<std::size_t>(grid.nz), threads, [&](std::size_t chunk) {
      const int iz = static_cast<int>(chunk);
      for (int iy = 0; iy < grid.ny; ++iy)
        for (int ix = 0; ix < grid.nx; ++ix)
          phi[grid.index(ix, iy, iz)] =
              static_cast<float>(primitives::exact_sample(solid, grid.point(ix, iy, iz), lengths).phi_m);
    });
  }
  return to_numpy(std::move(phi), {grid.nz, grid.ny, grid.nx});
}

py::tuple sample_sdf(const py::array& values, double voxel_size, const Vec3d& origin, const py::array& points,
                     int threads) {
  const Volume volume(values, voxel_size, origin);
  const auto* p = reinterpret_cast<const Vec3d*>(borrow<double>(points, "points", {-1, 3}));
  const auto n = static_cast<std::size_t>(points.shape(0));
  std::vector<double> phi(n), gradient(3 * n);
  {
    const ReleaseGil release;
    constexpr std::size_t kChunk = 4096;
    const SdfView sdf = volume.view();
    parallel_for((n + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
      for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i) {
        Vec3d g;
        sample(sdf, p[i], &phi[i], &g);
        gradient[3 * i] = g.x, gradient[3 * i + 1] = g.y, gradient[3 * i + 2] = g.z;
      }
    });
  }
  const auto rows = static_cast<py::ssize_t>(n);
  return py::make_tuple(to_numpy(std::move(phi), {rows}), to_numpy(std::move(gradient), {rows, 3}));
}

py::tuple render_sdf(const py::array& values, double voxel_size, const Vec3d& origin, const Camera& camera,
                     const py::array& T_cam_obj, int threads, int device, std::uint64_t id) {
  const Volume volume(values, voxel_size, origin);
  const Rigidd T = rigid_from(T_cam_obj, "T_cam_obj");
  SdfView sdf = volume.view();
  sdf.id = id;
  render::SdfImage image = unlocked<ReleaseGilUntilSignal>([&] {
    return device < 0 ? render::raycast_sdf(sdf, camera, T, threads)
                      : render::raycast_sdf_cuda(sdf, camera, T, device);
  });
  return py::make_tuple(to_numpy(std::move(image.depth_m), {camera.height, camera.width}),
                        to_numpy(std::move(image.normals_cam), {camera.height, camera.width, 3}));
}

py::array_t<float> redistance_values(const py::array& values, double voxel_size, int threads, int device) {
  const Volume volume(values, voxel_size, {0, 0, 0});
  std::vector<float> out = unlocked<ReleaseGilUntilSignal>([&] {
    return device < 0 ? sdf::redistance(volume.grid, volume.phi, threads)
                      : levelset::redistance_cuda(volume.grid, volume.phi, device);
  });
  return to_numpy(std::move(out), volume.shape());
}

py::array_t<std::uint8_t> painted(const py::array& vertices, const py::array& faces,
                                  const py::array& vertex_rgb, const py::array& phi, double voxel_m,
                                  const Vec3d& origin, double reach_m, int threads) {
  const sdf::MeshView mesh = mesh_view(vertices, faces);
  const std::uint8_t* rgb = borrow<std::uint8_t>(vertex_rgb, "colors", {vertices.shape(0), 3});
  const SdfView view = volume_view(phi, voxel_m, origin);
  const sdf::Grid grid{view.nx, view.ny, view.nz, voxel_m, origin};
  std::vector<std::uint8_t> rgba =
      unlocked([&] { return paint(mesh, rgb, grid, view.phi, reach_m, threads); });
  return to_numpy(std::move(rgba), {grid.nz, grid.ny, grid.nx, 4});
}

py::tuple samples(const py::array& values, double voxel_size, const Vec3d& origin, int count) {
  const Volume volume(values, voxel_size, origin);
  std::vector<sdf::SurfaceSample> found =
      unlocked([&] { return sdf::ZeroSurface(volume.view()).samples(count); });
  return py::make_tuple(gathered<float>(found, {3}, [](const sdf::SurfaceSample& s) { return &s.p_obj.x; }),
                        gathered<float>(found, {3}, [](const sdf::SurfaceSample& s) { return &s.n_obj.x; }));
}

}  // namespace

void bind_sdf(py::module_& m) {
  m.attr("MAX_VOXELS") = sdf::kMaxVoxels;
  m.def(
      "mesh_volume",
      [](const py::array& vertices, const py::array& faces, int voxels, std::optional<double> padding,
         std::optional<double> unit_m, bool close_holes, int threads) {
        return volume_of(vertices, faces, {voxels, padding, unit_m, close_holes, threads});
      },
      "vertices"_a, "faces"_a, "voxels"_a, "padding"_a, "unit_m"_a, "close_holes"_a, "threads"_a,
      "-> phi [z, y, x] float32 m, voxel size and origin (m), report, warnings (SDF.from_mesh).");
  m.def("grid_around", &grid_of, "low"_a, "high"_a, "voxels"_a, "padding"_a,
        "-> voxel size (m), shape [z, y, x] and origin (m) of the grid around a box.");
  m.def("mesh_to_sdf", &from_mesh, "vertices"_a, "faces"_a, "shape"_a, "voxel_size"_a, "origin"_a,
        "band_voxels"_a = sdf::kBandVoxels, "threads"_a = 0,
        "-> phi [z, y, x] float32 m, number of voxels inside an inside-out part.");
  m.def("primitive_sdf", &primitive, "kind"_a, "size"_a, "shape"_a, "voxel_size"_a, "origin"_a,
        "threads"_a = 0, "Exact distance of a primitive at every voxel, float32 [z, y, x].");
  m.def("sample_sdf", &sample_sdf, "values"_a, "voxel_size"_a, "origin"_a, "points"_a, "threads"_a = 0,
        "(N, 3) float64 -> phi (N,), gradient (N, 3), of the trilinear interpolant.");
  m.def(
      "render_sdf", &render_sdf, "values"_a, "voxel_size"_a, "origin"_a, "camera"_a, "T_cam_obj"_a,
      "threads"_a = 0, "device"_a = -1, "id"_a = 0,
      "-> depth (H, W) float32 m, normals (H, W, 3) float32; id: of values that do not change, 0: unknown.");
  m.def("new_volume_id", &new_volume_id, "A number that no other volume has.");
  m.def("redistance", &redistance_values, "values"_a, "voxel_size"_a, "threads"_a = 0, "device"_a = -1,
        "Distance field with the same zero set, float32 [z, y, x].");
  m.def("paint", &painted, "vertices"_a, "faces"_a, "colors"_a, "values"_a, "voxel_size"_a, "origin"_a,
        "reach_m"_a, "threads"_a = 0,
        "RGBA [z, y, x, 4] of the voxels within reach of a mesh with coloured vertices.");
  m.def("surface_samples", &samples, "values"_a, "voxel_size"_a, "origin"_a, "count"_a,
        "-> points (N, 3) float32 m, normals (N, 3) float32.");
}

}  // namespace sdftrack::bindings

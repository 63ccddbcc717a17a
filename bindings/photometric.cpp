// SPDX-License-Identifier: MIT
#include "energies/photometric.h"

#include <pybind11/eigen.h>

#include "array.h"
#include "release_gil.h"
#include "sdf/paint.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

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

// The energy's values at a pose: cost, gradient (6), Hessian (6, 6), tone (gain, shading, offset), used.
py::tuple photometric(const std::tuple<py::array, double, Vec3d, py::array>& shape,
                      const std::array<double, 4>& K, const py::array& settled, const py::array& T,
                      const py::array& u, const py::array& v, const py::array& depth, const py::array& grey,
                      double sigma) {
  const auto& [values, voxel_m, origin, colors] = shape;
  const SdfView sdf = volume_view(values, voxel_m, origin);
  const py::ssize_t n = u.size();
  energies::GreyPixels pixels;
  for (py::ssize_t i = 0; i < n; ++i)
    pixels.push(borrow<float>(u, "u_px", {n})[i], borrow<float>(v, "v_px", {n})[i],
                borrow<float>(depth, "depth_m", {n})[i], borrow<float>(grey, "grey", {n})[i]);
  std::vector<energies::PhotometricHit> hits;
  energies::PhotometricEnergy energy(sdf, painted_view(colors, sdf), &pixels, {sigma}, &hits);
  optim::State x;
  x.K = {K[0], K[1], K[2], K[3]};
  x.T_obj_cam.assign(1, rigid_from(settled, "settled"));
  const int used = energy.settle(x);
  x.T_obj_cam[0] = rigid_from(T, "T_obj_cam");
  optim::NormalEquations at;
  at.reset(6);
  const double cost = energy.cost(x);
  energy.linearize(x, &at);
  return py::make_tuple(cost, at.gradient, at.hessian, energy.tone(), used);
}

}  // namespace

void bind_photometric(py::module_& m) {
  m.def("paint", &painted, "vertices"_a, "faces"_a, "colors"_a, "values"_a, "voxel_size"_a, "origin"_a,
        "reach_m"_a, "threads"_a = 0,
        "RGBA [z, y, x, 4] of the voxels within reach of a mesh with coloured vertices.");
  m.def("photometric", &photometric, "shape"_a, "K"_a, "settled"_a, "T_obj_cam"_a, "u_px"_a, "v_px"_a,
        "depth_m"_a, "grey"_a, "sigma"_a = 0.03,
        "Cost, gradient, Hessian, tone (gain, shading, offset) and pixels used, of the photometric energy.");
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
#include "array.h"
#include "levelset/evolve.h"
#include "levelset/zero_mesh.h"
#include "release_gil.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

py::array_t<float> evolve_values(const py::array& phi, const py::array& log_ratio, double voxel_size,
                                 int steps, const levelset::EvolveOptions& options, int threads, int device) {
  const SdfView volume = volume_view(phi, voxel_size, {0, 0, 0});
  const float* ratio = borrow<float>(log_ratio, "log_ratio", {volume.nz, volume.ny, volume.nx});
  const sdf::Grid grid{volume.nx, volume.ny, volume.nz, voxel_size, {0, 0, 0}};
  std::vector<float> out = unlocked<ReleaseGilUntilSignal>([&] {
    return device >= 0 ? levelset::evolve_cuda(grid, volume.phi, ratio, steps, options, device)
                       : levelset::evolve(grid, volume.phi, ratio, steps, options, threads);
  });
  return to_numpy(std::move(out), {volume.nz, volume.ny, volume.nx});
}

py::tuple zero_mesh(const py::array& phi, int threads, int device) {
  const SdfView volume = volume_view(phi, 1, {0, 0, 0});
  const sdf::Grid grid{volume.nx, volume.ny, volume.nz, 1, {0, 0, 0}};
  levelset::ZeroMesh mesh = unlocked([&] {
    return device >= 0 ? levelset::zero_mesh_cuda(grid, volume.phi, device)
                       : levelset::zero_mesh(grid, volume.phi, threads);
  });
  const auto vertices = static_cast<py::ssize_t>(mesh.vertices.size() / 3),
             faces = static_cast<py::ssize_t>(mesh.faces.size() / 3);
  return py::make_tuple(to_numpy(std::move(mesh.vertices), {vertices, 3}),
                        to_numpy(std::move(mesh.faces), {faces, 3}));
}

}  // namespace

void bind_levelset(py::module_& m) {
  py::class_<levelset::EvolveOptions>(m, "EvolveOptions")
      .def(py::init<>())
      .def_readwrite("sigma_h", &levelset::EvolveOptions::sigma_h)
      .def_readwrite("sigma_phi", &levelset::EvolveOptions::sigma_phi)
      .def_readwrite("dt", &levelset::EvolveOptions::dt)
      .def_readwrite("printed", &levelset::EvolveOptions::printed)
      .def_property_readonly("longest_step", &levelset::longest_step);
  m.def("evolve", &evolve_values, "phi"_a, "log_ratio"_a, "voxel_size"_a, "steps"_a, "options"_a,
        "threads"_a = 0, "device"_a = -1);
  m.def("zero_mesh", &zero_mesh, "phi"_a, "threads"_a = 0, "device"_a = -1,
        "The zero set by marching cubes -> vertices (N, 3) float64, x, y, z in voxels; faces (M, 3) int32.");
}

}  // namespace sdftrack::bindings

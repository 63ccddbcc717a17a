// SPDX-License-Identifier: MIT
#include "reconstruction/reconstruction.h"

#include <optional>

#include "array.h"
#include "reconstruction/surface.h"
#include "release_gil.h"
#include "session.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

class PyReconstruction {
 public:
  PyReconstruction(const std::array<int, 3>& voxels, double voxel_m, const Vec3d& origin,
                   const std::optional<py::array>& prior, reconstruction::ReconstructionOptions options,
                   int threads, const std::optional<py::array>& first_shape, int device,
                   const std::optional<float>& usual_noise_m)
      : threads_(threads) {
    levelset::SensorNoise& noise = options.evidence.noise;
    if (options.noise_m) noise.noise_m = static_cast<float>(*options.noise_m);
    noise.usual_m = usual_noise_m.value_or(noise.usual_m);
    const sdf::Grid grid = grid_from({voxels[2], voxels[1], voxels[0]}, voxel_m, origin, "voxels");
    const float* const guess = prior ? borrow<float>(*prior, "prior", {grid.nz, grid.ny, grid.nx}) : nullptr;
    const float* const shape =
        first_shape ? borrow<float>(*first_shape, "first_shape", {grid.nz, grid.ny, grid.nx}) : nullptr;
    const ReleaseGil release;
    core_ = std::make_unique<reconstruction::Reconstruction>(grid, guess, options, nullptr, threads, shape,
                                                             device);
  }

  void fuse(const py::array& depth, const Camera& camera, const py::array& T,
            const std::array<int, 4>& region, const py::object& mask,
            const std::optional<py::array>& foreground, const std::optional<py::array>& rgb) {
    const Rigidd T_cam_obj = rigid_from(T, "T");
    reconstruction::FrameEvidence frame{image_view(depth, "depth", camera),
                                        {region[0], region[1], region[2], region[3]}};
    check_region(region, camera.width, camera.height);
    const py::ssize_t h = region[3] - region[1], w = region[2] - region[0];
    frame.mask = mask_view(mask, camera);
    if (foreground) frame.foreground = borrow<float>(*foreground, "foreground", {h, w});
    if (rgb) frame.rgb = borrow<unsigned char>(*rgb, "rgb", {h, w, 3});
    const ReleaseGil release;
    core_->fuse(frame, camera, T_cam_obj, threads_);
  }
  // Brings the borrowed data of a volume on a GPU up to the last frame.
  void show() { core_->begin_to_show(), static_cast<void>(phi()); }
  const reconstruction::Reconstruction& core() const { return *core_; }
  explicit PyReconstruction(std::shared_ptr<reconstruction::Reconstruction> core, int threads)
      : core_(std::move(core)), threads_(threads) {}

  // Vertices (m), faces, colours or None, and how often each vertex was seen.
  py::tuple mesh() {
    reconstruction::SurfaceMesh mesh =
        unlocked([&] { return reconstruction::surface_mesh(*core_, threads_); });
    const auto n = static_cast<py::ssize_t>(mesh.vertices.size());
    py::array_t<double> vertices({n, py::ssize_t{3}});
    std::copy(mesh.vertices.begin(), mesh.vertices.end(), reinterpret_cast<Vec3d*>(vertices.mutable_data()));
    const auto faces = static_cast<py::ssize_t>(mesh.faces.size() / 3);
    const bool colored = !mesh.rgb.empty();
    return py::make_tuple(vertices, to_numpy(std::move(mesh.faces), {faces, 3}),
                          colored ? py::object(to_numpy(std::move(mesh.rgb), {n, 3})) : py::none(),
                          to_numpy(std::move(mesh.seen), {n}));
  }

  // The distances, colours and sums, from the CPU or the GPU.
  std::span<const float> phi() {
    return brought([this] { return core_->phi(); });
  }
  std::span<const levelset::VoxelColor> colors() {
    return brought([this] { return core_->colors(); });
  }
  const levelset::EvidenceVolume& evidence() {
    return brought([this]() -> auto& { return core_->evidence(threads_); });
  }

 private:
  template <class Get>
  auto brought(const Get& get) -> decltype(get()) {
    if (core_->device() == reconstruction::Reconstruction::kOnCpu) return get();
    const ReleaseGil release;
    return get();
  }

  std::shared_ptr<reconstruction::Reconstruction> core_;
  int threads_;
};

// Shows numbers of the present volume, or of that of a GPU at the last request, and keeps the owner alive.
template <class Data>
py::array shown(const py::object& self, py::ssize_t channels, const Data& data) {
  auto& own = self.cast<PyReconstruction&>();
  const auto* first = data(own);
  const sdf::Grid& grid = own.core().grid();
  const py::ssize_t n = channels * static_cast<py::ssize_t>(sizeof *first);
  py::array out(py::dtype::of<std::decay_t<decltype(*first)>>(), {grid.nz, grid.ny, grid.nx},
                {n * grid.nx * grid.ny, n * grid.nx, n}, first, self);
  out.attr("flags").attr("writeable") = false;
  return out;
}

}  // namespace

py::object reconstruction_to_python(std::shared_ptr<reconstruction::Reconstruction> core, int threads) {
  return py::cast(std::make_unique<PyReconstruction>(std::move(core), threads));
}

void bind_reconstruction(py::module_& m) {
  py::class_<PyReconstruction>(m, "Reconstruction")
      .def(py::init<const std::array<int, 3>&, double, const Vec3d&, const std::optional<py::array>&,
                    const reconstruction::ReconstructionOptions&, int, const std::optional<py::array>&, int,
                    const std::optional<float>&>(),
           "voxels"_a, "voxel_m"_a, "origin"_a, "prior"_a, "options"_a, "threads"_a,
           "first_shape"_a = py::none(), "device"_a = reconstruction::Reconstruction::kOnCpu,
           "usual_noise_m"_a = py::none())
      .def("fuse", &PyReconstruction::fuse, "depth"_a, "camera"_a, "T"_a, "region"_a, "mask"_a = py::none(),
           "foreground"_a = py::none(), "rgb"_a = py::none())
      .def("show", &PyReconstruction::show,
           "Bring what arrays and trackers have borrowed of a volume on a GPU up to the last frame.")
      .def("mesh", &PyReconstruction::mesh)
      .def_property_readonly("voxels",
                             [](const PyReconstruction& self) {
                               const sdf::Grid& g = self.core().grid();
                               return std::array<int, 3>{g.nx, g.ny, g.nz};
                             })
      .def_property_readonly("voxel_m",
                             [](const PyReconstruction& self) { return self.core().grid().voxel_m; })
      .def_property_readonly("origin",
                             [](const PyReconstruction& self) { return self.core().grid().origin_obj; })
      .def_property_readonly("phi",
                             [](const py::object& self) {
                               return shown(self, 1, [](PyReconstruction& own) { return own.phi().data(); });
                             })
      .def_property_readonly("surface_boxes",
                             [](const PyReconstruction& self) {
                               return gathered<std::int32_t>(
                                   self.core().surface_boxes(), {6}, [](const sdf::VoxelBox& box) {
                                     return reinterpret_cast<const std::int32_t*>(&box);
                                   });
                             })
      .def_property_readonly(
          "log_ratio",
          [](const py::object& self) {
            return shown(self, 1, [](PyReconstruction& own) { return own.evidence().log_ratio().data(); });
          })
      .def_property_readonly(
          "weight",
          [](const py::object& self) {
            return shown(self, 1, [](PyReconstruction& own) { return own.evidence().weight().data(); });
          })
      .def_property_readonly("seen",
                             [](const py::object& self) {
                               return shown(self, 4,
                                            [](PyReconstruction& own) { return &own.colors().data()->seen; });
                             })
      .def_property_readonly("rgb_seen", [](const py::object& self) {
        auto& own = self.cast<PyReconstruction&>();
        const sdf::Grid& g = own.core().grid();
        py::array_t<std::uint16_t> out({g.nz, g.ny, g.nx, 4}, &own.colors().data()->r, self);
        out.attr("setflags")("write"_a = false);
        return out;
      });
}

}  // namespace sdftrack::bindings

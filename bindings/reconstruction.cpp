// SPDX-License-Identifier: MIT
#include "reconstruction/reconstruction.h"

#include <pybind11/stl.h>

#include <atomic>
#include <optional>

#include "array.h"
#include "busy.h"
#include "option_binding.h"
#include "reconstruction/option_schema.h"
#include "reconstruction/surface.h"
#include "release_gil.h"
#include "session.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// Arrays that show the present volumes, or those of a GPU at the last request, and keep the owner alive.
template <class T>
py::array shown(const T* data, const sdf::Grid& grid, py::ssize_t channels, const py::object& owner) {
  const auto n = static_cast<py::ssize_t>(sizeof(T));
  std::vector<py::ssize_t> shape{grid.nz, grid.ny, grid.nx},
      strides{n * channels * grid.nx * grid.ny, n * channels * grid.nx, n * channels};
  py::array_t<T> out(shape, strides, data, owner);
  out.attr("flags").attr("writeable") = false;
  return out;
}

class PyReconstruction {
 public:
  PyReconstruction(const std::array<int, 3>& voxels, double voxel_m, const std::array<double, 3>& origin,
                   const std::optional<py::array>& prior,
                   const reconstruction::ReconstructionOptions& options, int threads, const py::object& view,
                   const std::optional<py::array>& first_shape, int device)
      : threads_(threads) {
    const sdf::Grid grid = grid_from({voxels[2], voxels[1], voxels[0]}, voxel_m, origin, "voxels");
    const float* const guess = prior ? borrow<float>(*prior, "prior", {grid.nz, grid.ny, grid.nx}) : nullptr;
    std::shared_ptr<const reconstruction::FirstView> first;
    const float* const shape =
        first_shape ? borrow<float>(*first_shape, "first_shape", {grid.nz, grid.ny, grid.nx}) : nullptr;
    if (!view.is_none()) first = view.cast<std::shared_ptr<reconstruction::FirstView>>();
    const ReleaseGil release;
    core_ =
        std::make_unique<reconstruction::Reconstruction>(grid, guess, options, first, threads, shape, device);
  }

  void fuse(const py::array& depth, const Camera& camera, const py::array& T,
            const std::array<int, 4>& region, const py::object& mask,
            const std::optional<py::array>& foreground, const std::optional<py::array>& rgb) {
    const Rigidd T_cam_obj = rigid_from(T, "T");
    const Busy busy(&busy_, "reconstruction");
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
  void show() { begin_to_show(), static_cast<void>(phi()); }
  void begin_to_show() {
    const Busy busy(&busy_, "reconstruction");
    core_->begin_to_show();
  }
  std::unique_ptr<PyReconstruction> grown(const std::array<int, 3>& before, const std::array<int, 3>& after) {
    const Busy busy(&busy_, "reconstruction");
    // Whole blocks; the result must be a valid volume.
    const sdf::Grid& grid = core_->grid();
    std::array<py::ssize_t, 3> voxels{grid.nx, grid.ny, grid.nz};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (before[axis] < 0 || after[axis] < 0)
        throw py::value_error("grown: expected numbers of blocks from 0 on");
      voxels[axis] += levelset::EvidenceVolume::kBlock *
                      (static_cast<py::ssize_t>(before[axis]) + static_cast<py::ssize_t>(after[axis]));
    }
    const Vec3d& o = grid.origin_obj;
    grid_from({voxels[2], voxels[1], voxels[0]}, grid.voxel_m, {o.x, o.y, o.z}, "grown");
    const ReleaseGil release;
    return std::unique_ptr<PyReconstruction>(
        new PyReconstruction(std::shared_ptr(core_->grown(before, after, threads_)), threads_));
  }
  std::unique_ptr<PyReconstruction> continued(const py::object& view) {
    const Busy busy(&busy_, "reconstruction");
    std::shared_ptr<const reconstruction::FirstView> first;
    if (!view.is_none()) first = view.cast<std::shared_ptr<reconstruction::FirstView>>();
    const ReleaseGil release;
    return std::unique_ptr<PyReconstruction>(
        new PyReconstruction(std::shared_ptr(core_->continued(std::move(first), threads_)), threads_));
  }
  const reconstruction::Reconstruction& core() const { return *core_; }
  explicit PyReconstruction(std::shared_ptr<reconstruction::Reconstruction> core, int threads)
      : core_(std::move(core)), threads_(threads) {}

  // Vertices (m), faces, colours or None, and how often each vertex was seen.
  py::tuple mesh() {
    reconstruction::SurfaceMesh mesh;
    {
      const Busy busy(&busy_, "reconstruction");
      const ReleaseGil release;
      mesh = reconstruction::surface_mesh(*core_, threads_);
    }
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
    const Busy busy(&busy_, "reconstruction");
    const ReleaseGil release;
    return get();
  }

  std::shared_ptr<reconstruction::Reconstruction> core_;
  std::atomic<bool> busy_{false};
  int threads_;
};

// planes: normal, offset and thickness of each.
std::shared_ptr<reconstruction::FirstView> first_view_from(const Camera& camera, const py::array& T,
                                                           const py::array& from_m, const py::array& planes,
                                                           const std::array<double, 3>& middle,
                                                           double radius_m) {
  const float* from = borrow<float>(from_m, "from_m", {camera.height, camera.width});
  const double* plane = borrow<double>(planes, "planes", {planes.shape(0), 5});
  std::vector<reconstruction::PlaneBelow> below;
  for (py::ssize_t k = 0; k < planes.shape(0); ++k, plane += 5)
    below.push_back({{plane[0], plane[1], plane[2]}, plane[3], plane[4]});
  return std::make_shared<reconstruction::FirstView>(
      camera, rigid_from(T, "T"),
      std::vector<float>(from, from + static_cast<std::ptrdiff_t>(camera.width) * camera.height),
      std::move(below), reconstruction::Place{{middle[0], middle[1], middle[2]}, radius_m});
}

PyReconstruction& of(const py::object& self) { return self.cast<PyReconstruction&>(); }

}  // namespace

py::object reconstruction_to_python(std::shared_ptr<reconstruction::Reconstruction> core, int threads) {
  return py::cast(std::make_unique<PyReconstruction>(std::move(core), threads));
}

void bind_reconstruction(py::module_& m) {
  // In addition to the options of a Reconstructor: measured values, and values that tests vary.
  bind_options<reconstruction::ReconstructionOptions>(
      m, "ReconstructionOptions", "Options of a reconstruction; see sdftrack.ReconstructorOptions.")
      .def_property(
          "usual_noise_m",
          [](const reconstruction::ReconstructionOptions& o) { return o.evidence.noise.usual_m; },
          [](reconstruction::ReconstructionOptions& o, float v) { o.evidence.noise.usual_m = v; })
      .def_property(
          "color_reach_voxels",
          [](const reconstruction::ReconstructionOptions& o) { return o.evidence.color_reach_voxels; },
          [](reconstruction::ReconstructionOptions& o, float v) { o.evidence.color_reach_voxels = v; })
      .def_property(
          "min_slant", [](const reconstruction::ReconstructionOptions& o) { return o.image.min_slant; },
          [](reconstruction::ReconstructionOptions& o, float v) {
            o.image.min_slant = o.evidence.min_slant = v;
          })
      .def_readwrite("rounds", &reconstruction::ReconstructionOptions::rounds)
      .def_readwrite("far_every", &reconstruction::ReconstructionOptions::far_every)
      .def_readwrite("first_steps", &reconstruction::ReconstructionOptions::first_steps);
  py::class_<reconstruction::FirstView, std::shared_ptr<reconstruction::FirstView>>(m, "FirstView")
      .def(py::init(&first_view_from), py::arg("camera"), py::arg("T"), py::arg("from_m"), py::arg("planes"),
           py::arg("middle"), py::arg("radius_m"))
      .def(
          "may_hold",
          [](const reconstruction::FirstView& self, const py::array& points) {
            const double* p = borrow<double>(points, "points", {points.shape(0), 3});
            py::array_t<bool> out(points.shape(0));
            for (py::ssize_t k = 0; k < points.shape(0); ++k, p += 3)
              out.mutable_at(k) = self.may_hold({p[0], p[1], p[2]});
            return out;
          },
          py::arg("points"), "Whether the object may be at points (N, 3) of the object frame.");
  py::class_<PyReconstruction>(m, "Reconstruction")
      .def(py::init<const std::array<int, 3>&, double, const std::array<double, 3>&,
                    const std::optional<py::array>&, const reconstruction::ReconstructionOptions&, int,
                    const py::object&, const std::optional<py::array>&, int>(),
           py::arg("voxels"), py::arg("voxel_m"), py::arg("origin"), py::arg("prior"), py::arg("options"),
           py::arg("threads"), py::arg("view") = py::none(), py::arg("first_shape") = py::none(),
           py::arg("device") = reconstruction::Reconstruction::kOnCpu)
      .def("fuse", &PyReconstruction::fuse, py::arg("depth"), py::arg("camera"), py::arg("T"),
           py::arg("region"), py::arg("mask") = py::none(), py::arg("foreground") = py::none(),
           py::arg("rgb") = py::none())
      .def("show", &PyReconstruction::show,
           "Bring what arrays and trackers have borrowed of a volume on a GPU up to the last frame.")
      .def("begin_to_show", &PyReconstruction::begin_to_show,
           "Begin that, and return: what was borrowed may be read after show().")
      .def("mesh", &PyReconstruction::mesh)
      .def("grown", &PyReconstruction::grown, py::arg("before"), py::arg("after"))
      .def("continued", &PyReconstruction::continued, py::arg("view"))
      .def_property_readonly("change_m", [](const PyReconstruction& self) { return self.core().change_m(); })
      .def_property_readonly("voxels",
                             [](const PyReconstruction& self) {
                               const sdf::Grid& g = self.core().grid();
                               return std::array<int, 3>{g.nx, g.ny, g.nz};
                             })
      .def_property_readonly("voxel_m",
                             [](const PyReconstruction& self) { return self.core().grid().voxel_m; })
      .def_property_readonly("origin",
                             [](const PyReconstruction& self) {
                               const Vec3d o = self.core().grid().origin_obj;
                               return std::array<double, 3>{o.x, o.y, o.z};
                             })
      .def_property_readonly("phi",
                             [](const py::object& self) {
                               PyReconstruction& own = of(self);
                               return shown(own.phi().data(), own.core().grid(), 1, self);
                             })
      .def_property_readonly(
          "surface_boxes",
          [](const PyReconstruction& self) {
            const std::vector<sdf::VoxelBox> cells = self.core().surface_boxes();
            py::array_t<std::int32_t> out({static_cast<py::ssize_t>(cells.size()), py::ssize_t{6}});
            std::copy(cells.begin(), cells.end(), reinterpret_cast<sdf::VoxelBox*>(out.mutable_data()));
            return out;
          })
      .def_property_readonly("log_ratio",
                             [](const py::object& self) {
                               PyReconstruction& own = of(self);
                               return shown(own.evidence().log_ratio().data(), own.core().grid(), 1, self);
                             })
      .def_property_readonly("weight",
                             [](const py::object& self) {
                               PyReconstruction& own = of(self);
                               return shown(own.evidence().weight().data(), own.core().grid(), 1, self);
                             })
      .def_property_readonly("seen",
                             [](const py::object& self) {
                               PyReconstruction& own = of(self);
                               return shown(&own.colors().data()->seen, own.core().grid(), 4, self);
                             })
      .def_property_readonly("rgb_seen", [](const py::object& self) {
        PyReconstruction& own = of(self);
        const sdf::Grid& g = own.core().grid();
        py::array_t<std::uint16_t> out({g.nz, g.ny, g.nx, 4}, &own.colors().data()->r, self);
        out.attr("setflags")(py::arg("write") = false);
        return out;
      });
}

}  // namespace sdftrack::bindings

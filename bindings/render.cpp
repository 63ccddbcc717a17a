// SPDX-License-Identifier: MIT
#include <cmath>
#include <memory>
#include <optional>

#include "array.h"
#include "base/volume_id.h"
#include "release_gil.h"
#include "render/raycast_mesh.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// A mesh and its hierarchy, kept together: the arrays are borrowed from numpy and held alive here.
class MeshCaster {
 public:
  MeshCaster(py::array vertices, py::array faces) : vertices_(std::move(vertices)), faces_(std::move(faces)) {
    mesh_ = mesh_view(vertices_, faces_);
    const ReleaseGil release;
    bvh_ = std::make_unique<sdf::Bvh>(mesh_);
  }

  py::tuple raycast(const Camera& camera, const py::array& T_cam_obj, const std::optional<py::array>& colors,
                    int threads, int device) const {
    const Rigidd T = rigid_from(T_cam_obj, "T_cam_obj");
    const std::uint8_t* rgb =
        colors ? borrow<std::uint8_t>(*colors, "colors", {vertices_.shape(0), 3}) : nullptr;
    render::MeshImage image = unlocked<ReleaseGilUntilSignal>([&] {
      return device < 0 ? render::raycast_mesh(mesh_, *bvh_, rgb, camera, T, threads)
                        : render::raycast_mesh_cuda(mesh_, *bvh_, id_, rgb, camera, T, device);
    });
    const py::ssize_t h = camera.height, w = camera.width;
    return py::make_tuple(to_numpy(std::move(image.depth_m), {h, w}),
                          to_numpy(std::move(image.normals_cam), {h, w, 3}),
                          rgb ? py::object(to_numpy(std::move(image.colors), {h, w, 3})) : py::none());
  }

  py::tuple closest(const py::array& points) const {
    const auto* p = reinterpret_cast<const Vec3d*>(borrow<double>(points, "points", {-1, 3}));
    const auto n = static_cast<std::size_t>(points.shape(0));
    std::vector<double> distance(n);
    std::vector<std::int32_t> face(n);
    std::vector<double> point(3 * n);
    {
      const ReleaseGil release;
      for (std::size_t i = 0; i < n; ++i) {
        const sdf::Closest c = bvh_->closest(p[i]);
        distance[i] = std::sqrt(c.distance2), face[i] = c.face;
        point[3 * i] = c.point.x, point[3 * i + 1] = c.point.y, point[3 * i + 2] = c.point.z;
      }
    }
    const auto rows = static_cast<py::ssize_t>(n);
    return py::make_tuple(to_numpy(std::move(distance), {rows}), to_numpy(std::move(face), {rows}),
                          to_numpy(std::move(point), {rows, 3}));
  }

 private:
  py::array vertices_, faces_;
  sdf::MeshView mesh_;
  std::uint64_t id_ = new_volume_id();  // unique among volumes and meshes
  std::unique_ptr<sdf::Bvh> bvh_;
};

}  // namespace

void bind_render(py::module_& m) {
  py::class_<MeshCaster>(m, "MeshCaster", "Rays and closest points of one mesh. The arrays must not change.")
      .def(py::init<py::array, py::array>(), "vertices"_a, "faces"_a)
      .def("raycast", &MeshCaster::raycast, "camera"_a, "T_cam_obj"_a, "colors"_a = py::none(),
           "threads"_a = 0, "device"_a = -1,
           "-> depth (H, W) float32 m, normals (H, W, 3) float32, colours (H, W, 3) uint8 or None.")
      .def("closest", &MeshCaster::closest, "points"_a,
           "(N, 3) float64 -> distances (N,) m, faces (N,) int32, points (N, 3).");
}

}  // namespace sdftrack::bindings

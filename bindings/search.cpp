// SPDX-License-Identifier: MIT
#include "tracking/search/search.h"

#include <pybind11/stl.h>

#include "array.h"
#include "release_gil.h"
#include "tracking/fit/free_space.h"
#include "tracking/search/so3_grid.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using ShapeTuple = std::tuple<py::array, double, std::array<double, 3>>;

// A shape prepared once for many searches.
class PySearcher {
 public:
  PySearcher(const ShapeTuple& shape, const tracking::TrackerOptions& options)
      : values_(std::get<0>(shape)), options_(options) {
    const SdfView view = volume_view(values_, std::get<1>(shape), std::get<2>(shape));
    const ReleaseGil release;
    shape_ = frame::make_shape(view, tracking::kSurfacePoints, tracking::kFreeSpacePoints);
  }

  py::list search(const py::array& depth, const Camera& camera, const py::object& mask,
                  const std::optional<std::array<int, 4>>& box, const py::object& near, double reach_m,
                  const py::object& foreground,
                  const std::optional<std::pair<std::array<double, 3>, double>>& plane,
                  const py::object& taken, int first_seed, int seeds, int threads) {
    const ImageView<float> view = image_view(depth, "depth", camera);
    tracking::SearchQuery query;
    query.mask = mask_view(mask, camera), query.taken = mask_view(taken, camera);
    if (box) query.box = frame::Rect{(*box)[0], (*box)[1], (*box)[0] + (*box)[2], (*box)[1] + (*box)[3]};
    if (!near.is_none()) {
      const Rigidd T = rigid_from(py::cast<py::array>(near), "near");
      query.near = Rigidd{T.R, T * shape_.centre_obj};
    }
    query.reach_m = reach_m, query.first_seed = first_seed, query.seeds = seeds;
    if (!foreground.is_none())
      query.foreground = image_view(py::cast<py::array>(foreground), "foreground", camera).data;
    frame::Plane table;
    if (plane) {
      const auto& [n, offset] = *plane;
      table = {{n[0], n[1], n[2]}, offset};
      query.plane = &table;
    }
    const std::vector<float> rays = camera.distorted() ? ray_table(camera) : std::vector<float>{};
    const frame::DepthFrame frame{view, nullptr, rays.empty() ? nullptr : rays.data()};
    std::vector<tracking::Hypothesis> found;
    {
      const ReleaseGil release;
      found = tracking::search_pose(frame, camera, shape_, options_, query, threads, &scratch_);
    }
    py::list out;
    for (const tracking::Hypothesis& h : found) out.append(to_dict(h));
    return out;
  }

 private:
  py::dict to_dict(const tracking::Hypothesis& h) const {
    py::dict out;
    out["pose"] = matrix_from({h.T_cam_obj.R, h.T_cam_obj * -shape_.centre_obj});
    out["score"] = h.score;
    out["expected"] = h.seen.expected, out["agree"] = h.seen.agree, out["farther"] = h.seen.farther;
    out["nearer"] = h.seen.nearer, out["missing"] = h.seen.missing;
    return out;
  }

  py::array values_;
  tracking::TrackerOptions options_;
  frame::Shape shape_;
  tracking::SearchScratch scratch_;
};

}  // namespace

void bind_search(py::module_& m) {
  py::class_<PySearcher>(m, "Searcher", "Finds a shape in a depth image without an initial pose.")
      .def(py::init<const ShapeTuple&, const tracking::TrackerOptions&>(), py::arg("shape"),
           py::arg("options"))
      .def("search", &PySearcher::search, py::arg("depth"), py::arg("camera"), py::arg("mask") = py::none(),
           py::arg("box") = py::none(), py::arg("near") = py::none(), py::arg("reach_m") = 0.0,
           py::arg("foreground") = py::none(), py::arg("plane") = py::none(), py::arg("taken") = py::none(),
           py::arg("first_seed") = 0, py::arg("seeds") = 0, py::arg("threads") = 0);
  m.def(
      "seed_rotation",
      [](int k, int n) {
        if (k < 0 || n < 1) throw py::value_error("seed_rotation: expected k >= 0 and n >= 1");
        return matrix_from({tracking::seed_rotation(k, n), {0, 0, 0}});
      },
      py::arg("k"), py::arg("n"), "Rotation k of n evenly spread ones, as a 4x4 matrix.");
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
#include "tracking/search/search.h"

#include "array.h"
#include "release_gil.h"
#include "tracking/fit/free_space.h"
#include "tracking/search/so3_grid.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

// A shape prepared once for many searches.
class PySearcher {
 public:
  PySearcher(const PyVolume& shape, const tracking::TrackerOptions& options)
      : values_(std::get<0>(shape)), options_(options) {
    const SdfView view = volume_view(shape);
    const ReleaseGil release;
    shape_ = frame::make_shape(view, tracking::kSurfacePoints, tracking::kFreeSpacePoints);
  }

  py::list search(const py::array& depth, const Camera& camera, const py::object& mask,
                  const std::optional<std::array<int, 4>>& box, const py::object& near, double reach_m,
                  const py::object& foreground, const std::optional<std::pair<Vec3d, double>>& plane,
                  const py::object& taken, int first_seed, int seeds, int threads) {
    const FrameWithRays given(depth, py::none(), camera);
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
      table = {n, offset};
      query.plane = &table;
    }
    std::vector<tracking::Hypothesis> found = unlocked([&] {
      return tracking::search_pose(given.frame, camera, shape_, options_, query, threads, &scratch_);
    });
    py::list out;
    for (const tracking::Hypothesis& h : found) out.append(to_dict(h));
    return out;
  }

 private:
  py::dict to_dict(const tracking::Hypothesis& h) const {
    py::dict out;
    out["pose"] = Rigidd{h.T_cam_obj.R, h.T_cam_obj * -shape_.centre_obj};
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
      .def(py::init<const PyVolume&, const tracking::TrackerOptions&>(), "shape"_a, "options"_a)
      .def("search", &PySearcher::search, "depth"_a, "camera"_a, "mask"_a = py::none(), "box"_a = py::none(),
           "near"_a = py::none(), "reach_m"_a = 0.0, "foreground"_a = py::none(), "plane"_a = py::none(),
           "taken"_a = py::none(), "first_seed"_a = 0, "seeds"_a = 0, "threads"_a = 0);
  m.def(
      "seed_rotation",
      [](int k, int n) {
        if (k < 0 || n < 1) throw py::value_error("seed_rotation: expected k >= 0 and n >= 1");
        return Rigidd{tracking::seed_rotation(k, n), {0, 0, 0}};
      },
      "k"_a, "n"_a, "Rotation k of n evenly spread ones, as a 4x4 matrix.");
}

}  // namespace sdftrack::bindings

// SPDX-License-Identifier: MIT
#include <pybind11/native_enum.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <optional>

#include "contour/cues/box_start.h"
#include "contour_core.h"

namespace sdftrack::bindings {

namespace {

// A copy that cannot be written.
template <class T, class Values>
py::array_t<T> frozen(const Values& values, std::vector<py::ssize_t> shape) {
  py::array_t<T> out(std::move(shape));
  std::copy(values.begin(), values.end(), out.mutable_data());
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

// The results of the phases, in numpy's arrays.
struct Observation {
  contour::ContourReport report;
  py::array_t<float> phi;
  py::array_t<double> warp;

  Observation(const contour::ContourReport& r, const contour::ContourShape& shape)
      : report(r),
        phi(frozen<float>(shape.phi, {shape.ny, shape.nx})),
        warp(frozen<double>(shape.warp, {3, 3})) {}
  explicit Observation(const contour::ContourObservation& of) : Observation(of.report, of.shape) {}
};

struct Frame : Observation {
  py::array_t<bool> mask;

  explicit Frame(const contour::ContourFrame& of)
      : Observation(of.report, of.shape), mask(frozen<bool>(of.mask, {of.height, of.width})) {}
};

void bind_phases(py::module_& m) {
  py::native_enum<contour::ShapeJudgement>(m, "ShapeJudgement", "enum.Enum",
                                           "What a memory says of a frame's shape.")
      .value("none", contour::ShapeJudgement::kNone)
      .value("unoccluded", contour::ShapeJudgement::kUnoccluded)
      .value("occluded", contour::ShapeJudgement::kOccluded)
      .value("novel", contour::ShapeJudgement::kNovel)
      .finalize();
  py::class_<Observation>(m, "ContourObservation", "Where the object is in an image; nothing is learned yet.")
      .def_property_readonly(
          "status",
          [](const Observation& o) { return kContourStatus[static_cast<std::size_t>(o.report.status)]; })
      .def_property_readonly("reason",
                             [](const Observation& o) { return contour::sentence(o.report.reason); })
      .def_property_readonly("confidence", [](const Observation& o) { return o.report.confidence; })
      .def_property_readonly("contrast", [](const Observation& o) { return o.report.contrast; })
      .def_property_readonly("likeness", [](const Observation& o) { return o.report.likeness; })
      .def_property_readonly("overlap", [](const Observation& o) { return o.report.overlap; })
      .def_property_readonly("shared", [](const Observation& o) { return o.report.shared; })
      .def_property_readonly("mean_log", [](const Observation& o) { return o.report.mean_log; })
      .def_property_readonly("phi", [](const Observation& o) { return o.phi; })
      .def_property_readonly("warp", [](const Observation& o) { return o.warp; });
  py::class_<Frame, Observation>(m, "ContourFrame", "A frame's result, once it is finished.")
      .def_property_readonly("mask", [](const Frame& f) { return f.mask; });
}

}  // namespace

void bind_contour(py::module_& m) {
  bind_phases(m);
  py::class_<ContourCore>(m, "ContourCore", "A contour tracker; use contour.ContourTracker.")
      .def(py::init<const py::dict&, int>(), py::arg("options"), py::arg("device") = -1)
      .def(
          "start_mask",
          [](ContourCore& self, const py::array& image, const py::array& mask) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const auto* values =
                reinterpret_cast<const unsigned char*>(borrow<bool>(mask, "mask", {view.height, view.width}));
            return Frame(unlocked([&] { return self.tracker.start(view, values); }));
          },
          py::arg("image"), py::arg("mask"))
      .def(
          "start_box",
          [](ContourCore& self, const py::array& image, int x0, int y0, int x1, int y1) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const contour::ImagePart box{x0, y0, x1, y1};
            return Frame(unlocked([&] { return contour::start_in_box(&self.tracker, view, box); }));
          },
          py::arg("image"), py::arg("x0"), py::arg("y0"), py::arg("x1"), py::arg("y1"),
          "As the option box_start says.")
      .def(
          "track",
          [](ContourCore& self, const py::array& image, const std::optional<py::array>& flow, int x0,
             int y0) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const std::optional<contour::FlowView> back = flow_view(flow, x0, y0, view);
            return Frame(unlocked([&] { return self.tracker.track(view, back ? &*back : nullptr); }));
          },
          py::arg("image"), py::arg("flow") = py::none(), py::arg("x0") = 0, py::arg("y0") = 0,
          "A frame without a memory.")
      .def(
          "observe",
          [](ContourCore& self, const py::array& image, const std::optional<py::array>& flow, int x0,
             int y0) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const std::optional<contour::FlowView> back = flow_view(flow, x0, y0, view);
            return Observation(unlocked([&] { return self.tracker.observe(view, back ? &*back : nullptr); }));
          },
          py::arg("image"), py::arg("flow") = py::none(), py::arg("x0") = 0, py::arg("y0") = 0,
          "Where the object is in the next image; nothing is learned yet.")
      .def(
          "posterior_on_grid",
          [](ContourCore& self, const py::array& image) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const contour::ContourGrid& grid = self.tracker.grid();
            return frozen<float>(unlocked([&] { return self.tracker.posterior_on_grid(view); }),
                                 {grid.ny, grid.nx});
          },
          py::arg("image"), "The posterior at every cell of the grid, between observe and finish.")
      .def(
          "finish",
          [](ContourCore& self, contour::ShapeJudgement judgement,
             const std::optional<py::array>& recovered) {
            const Busy turn(&self.busy, "tracker");
            const contour::ContourGrid& grid = self.tracker.grid();
            const auto* inside = recovered ? reinterpret_cast<const unsigned char*>(
                                                 borrow<bool>(*recovered, "recovered", {grid.ny, grid.nx}))
                                           : nullptr;
            return Frame(unlocked([&] { return self.tracker.finish(judgement, inside); }));
          },
          py::arg("judgement"), py::arg("recovered") = py::none(),
          "The frame with a memory's judgement, and the whole silhouette where it recovered one.")
      .def(
          "state",
          [](ContourCore& self) {
            const Busy turn(&self.busy, "tracker");
            return py::bytes(state_of(self.tracker));
          },
          "All that the next images depend on, but for the options.")
      .def(
          "set_state",
          [](ContourCore& self, const py::bytes& state) {
            const Busy turn(&self.busy, "tracker");
            return set_state(std::string_view(state), &self.tracker);
          },
          py::arg("state"),
          "Goes on from such a state; False, and nothing changed, where it is one of another version.")
      .def("options", [](const ContourCore& self) { return options_of(self.tracker.options()); });
}

}  // namespace sdftrack::bindings

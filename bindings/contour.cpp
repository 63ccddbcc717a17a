// SPDX-License-Identifier: MIT
#include <pybind11/native_enum.h>

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
  out.attr("setflags")("write"_a = false);
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
      .def_property_readonly("overlap", [](const Observation& o) { return o.report.overlap; })
      .def_property_readonly("shared", [](const Observation& o) { return o.report.shared; })
      .def_property_readonly("phi", [](const Observation& o) { return o.phi; })
      .def_property_readonly("warp", [](const Observation& o) { return o.warp; });
  py::class_<Frame, Observation>(m, "ContourFrame", "A frame's result, once it is finished.")
      .def_property_readonly("mask", [](const Frame& f) { return f.mask; });
}

}  // namespace

void bind_contour(py::module_& m) {
  bind_phases(m);
  py::class_<contour::ContourTracker>(m, "ContourCore", "A contour tracker; use contour.ContourTracker.")
      .def(py::init<const contour::ContourOptions&, int>(), "options"_a, "device"_a = -1)
      .def(
          "start_mask",
          [](contour::ContourTracker& self, const py::array& image, const py::array& mask) {
            const contour::RgbView view = color_view(image);
            const auto* values =
                reinterpret_cast<const unsigned char*>(borrow<bool>(mask, "mask", {view.height, view.width}));
            return Frame(unlocked([&] { return self.start(view, values); }));
          },
          "image"_a, "mask"_a)
      .def(
          "start_box",
          [](contour::ContourTracker& self, const py::array& image, int x0, int y0, int x1, int y1) {
            const contour::RgbView view = color_view(image);
            const contour::ImagePart box{x0, y0, x1, y1};
            return Frame(unlocked([&] { return contour::start_in_box(&self, view, box); }));
          },
          "image"_a, "x0"_a, "y0"_a, "x1"_a, "y1"_a, "As the option box_start says.")
      .def(
          "track",
          [](contour::ContourTracker& self, const py::array& image, const std::optional<py::array>& flow,
             int x0, int y0) {
            const contour::RgbView view = color_view(image);
            const std::optional<contour::FlowView> back = flow_view(flow, x0, y0, view);
            return Frame(unlocked([&] { return self.track(view, back ? &*back : nullptr); }));
          },
          "image"_a, "flow"_a = py::none(), "x0"_a = 0, "y0"_a = 0, "A frame without a memory.")
      .def(
          "observe",
          [](contour::ContourTracker& self, const py::array& image, const std::optional<py::array>& flow,
             int x0, int y0) {
            const contour::RgbView view = color_view(image);
            const std::optional<contour::FlowView> back = flow_view(flow, x0, y0, view);
            return Observation(unlocked([&] { return self.observe(view, back ? &*back : nullptr); }));
          },
          "image"_a, "flow"_a = py::none(), "x0"_a = 0, "y0"_a = 0,
          "Where the object is in the next image; nothing is learned yet.")
      .def(
          "posterior_on_grid",
          [](contour::ContourTracker& self, const py::array& image) {
            const contour::RgbView view = color_view(image);
            const contour::ContourGrid& grid = self.grid();
            return frozen<float>(unlocked([&] { return self.posterior_on_grid(view); }), {grid.ny, grid.nx});
          },
          "image"_a, "The posterior at every cell of the grid, between observe and finish.")
      .def(
          "finish",
          [](contour::ContourTracker& self, contour::ShapeJudgement judgement,
             const std::optional<py::array>& recovered) {
            const contour::ContourGrid& grid = self.grid();
            const auto* inside = recovered ? reinterpret_cast<const unsigned char*>(
                                                 borrow<bool>(*recovered, "recovered", {grid.ny, grid.nx}))
                                           : nullptr;
            return Frame(unlocked([&] { return self.finish(judgement, inside); }));
          },
          "judgement"_a, "recovered"_a = py::none(),
          "The frame with a memory's judgement, and the whole silhouette where it recovered one.")
      .def(
          "state", [](contour::ContourTracker& self) { return py::bytes(state_of(self)); },
          "All that the next images depend on, but for the options.")
      .def(
          "set_state",
          [](contour::ContourTracker& self, const py::bytes& state) {
            return set_state(std::string_view(state), &self);
          },
          "state"_a,
          "Goes on from such a state; False, and nothing changed, where it is one of another version.")
      .def_property_readonly("options", [](const contour::ContourTracker& self) { return self.options(); });
}

}  // namespace sdftrack::bindings
